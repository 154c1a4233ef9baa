/* SPDX-License-Identifier: MIT
 * SIMD lanes for kernels. A source named *_kernel.c is compiled once per instruction-set level; the
 * Makefile defines JSL_KERNEL_ISA (1 scalar, 2 sse, 3 avx2, 4 avx512) and the matching machine
 * flags.
 *
 * wreal holds WN lanes of jsl_real, wmask one all-ones or all-zero integer a lane. Elementwise IEEE
 * operations give the same bits at every width. Sums over lanes do not, so kernels that need them
 * use wsum16: always 16 virtual lanes (JSL_LANES), reduced in one fixed tree. No fused
 * multiply-add, no reciprocal approximations. Floor 1.
 */
#ifndef JSL_MATH_WIDE_H
#define JSL_MATH_WIDE_H

#include "base/base.h"

#ifndef JSL_KERNEL_ISA
#error "wide.h is for *_kernel.c files, which the Makefile compiles with JSL_KERNEL_ISA"
#endif
#if JSL_KERNEL_ISA >= 2
#include <immintrin.h>
#endif

/* JSL_KERNEL(name): the symbol of this level, name_scalar .. name_avx512. */
#define JSL_PASTE_(a, b) a##b
#define JSL_PASTE(a, b) JSL_PASTE_(a, b)
#if JSL_KERNEL_ISA == 1
#define JSL_KERNEL(name) JSL_PASTE(name, _scalar)
#define JSL_WIDE_BYTES ((int)sizeof(jsl_real))
#elif JSL_KERNEL_ISA == 2
#define JSL_KERNEL(name) JSL_PASTE(name, _sse)
#define JSL_WIDE_BYTES 16
#elif JSL_KERNEL_ISA == 3
#define JSL_KERNEL(name) JSL_PASTE(name, _avx2)
#define JSL_WIDE_BYTES 32
#else
#define JSL_KERNEL(name) JSL_PASTE(name, _avx512)
#define JSL_WIDE_BYTES 64
#endif

#ifdef JSL_DOUBLE
typedef int64_t jsl_lane_int;
#else
typedef int32_t jsl_lane_int;
#endif

#define JSL_INLINE static inline __attribute__((always_inline, unused))

#if JSL_KERNEL_ISA == 1
typedef jsl_real wreal;
typedef jsl_lane_int wmask;
#define WN 1
#else
#define WN (JSL_WIDE_BYTES / (int)sizeof(jsl_real))
typedef jsl_real wreal __attribute__((vector_size(JSL_WIDE_BYTES)));
typedef jsl_lane_int wmask __attribute__((vector_size(JSL_WIDE_BYTES)));
typedef jsl_real wreal_u
    __attribute__((vector_size(JSL_WIDE_BYTES), aligned(sizeof(jsl_real)), may_alias));
typedef wreal wreal_a __attribute__((may_alias));
#endif

/* -- The operations that differ from level to level ------------------------------------ */

/* wmax and wmin are a > b ? a : b and a < b ? a : b at every width: the second operand wins on NaN
 * and on equal zeros, as maxps and minps do. wabs clears the sign bit, of zeros and NaN too. Masks
 * must be all ones or all zeros in each lane. Blends and extrema are intrinsics because gcc makes
 * three instructions of the generic forms. */
#if JSL_KERNEL_ISA == 1
JSL_INLINE wreal wload(const jsl_real *p) { return *p; }
JSL_INLINE wreal wloadu(const jsl_real *p) { return *p; }
JSL_INLINE void wstore(jsl_real *p, wreal a) { *p = a; }
JSL_INLINE void wstoreu(jsl_real *p, wreal a) { *p = a; }
JSL_INLINE wreal wset(jsl_real a) { return a; }
JSL_INLINE wmask wgt(wreal a, wreal b) { return -(wmask)(a > b); }
JSL_INLINE wmask wge(wreal a, wreal b) { return -(wmask)(a >= b); }
JSL_INLINE wmask weq(wreal a, wreal b) { return -(wmask)(a == b); }
JSL_INLINE wreal wselect(wmask m, wreal a, wreal b) { return m ? a : b; }
JSL_INLINE wreal wmax(wreal a, wreal b) { return a > b ? a : b; }
JSL_INLINE wreal wmin(wreal a, wreal b) { return a < b ? a : b; }
#ifdef JSL_DOUBLE
JSL_INLINE wreal wsqrt(wreal a) { return __builtin_sqrt(a); }
JSL_INLINE wreal wabs(wreal a) { return __builtin_fabs(a); }
#else
JSL_INLINE wreal wsqrt(wreal a) { return __builtin_sqrtf(a); }
JSL_INLINE wreal wabs(wreal a) { return __builtin_fabsf(a); }
#endif
JSL_INLINE int wbits(wmask m) { return (int)(m & 1); }
#else
JSL_INLINE wreal wload(const jsl_real *p) { return *(const wreal_a *)(const void *)p; }
JSL_INLINE wreal wloadu(const jsl_real *p) { return *(const wreal_u *)(const void *)p; }
JSL_INLINE void wstore(jsl_real *p, wreal a) { *(wreal_a *)(void *)p = a; }
JSL_INLINE void wstoreu(jsl_real *p, wreal a) { *(wreal_u *)(void *)p = a; }
JSL_INLINE wmask wgt(wreal a, wreal b) { return (wmask)(a > b); }
JSL_INLINE wmask wge(wreal a, wreal b) { return (wmask)(a >= b); }
JSL_INLINE wmask weq(wreal a, wreal b) { return (wmask)(a == b); }

/* JSL_X86(op): the intrinsic of this level and precision; JSL_VEC its type. */
#ifdef JSL_DOUBLE
#define JSL_X86_TYPE pd
#define JSL_VEC_TYPE d
#else
#define JSL_X86_TYPE ps
#define JSL_VEC_TYPE
#endif
#if JSL_KERNEL_ISA == 2
#define JSL_X86_PREFIX _mm_
#define JSL_VEC JSL_PASTE(__m128, JSL_VEC_TYPE)
#elif JSL_KERNEL_ISA == 3
#define JSL_X86_PREFIX _mm256_
#define JSL_VEC JSL_PASTE(__m256, JSL_VEC_TYPE)
#else
#define JSL_X86_PREFIX _mm512_
#define JSL_VEC JSL_PASTE(__m512, JSL_VEC_TYPE)
#endif
#define JSL_X86(op) JSL_PASTE(JSL_PASTE(JSL_X86_PREFIX, op), JSL_X86_TYPE)

JSL_INLINE wreal wset(jsl_real a) { return (wreal)JSL_X86(set1_)(a); }
JSL_INLINE wreal wmax(wreal a, wreal b) { return (wreal)JSL_X86(max_)((JSL_VEC)a, (JSL_VEC)b); }
JSL_INLINE wreal wmin(wreal a, wreal b) { return (wreal)JSL_X86(min_)((JSL_VEC)a, (JSL_VEC)b); }
JSL_INLINE wreal wsqrt(wreal a) { return (wreal)JSL_X86(sqrt_)((JSL_VEC)a); }
JSL_INLINE wreal wabs(wreal a) { return (wreal)((wmask)a & ~(wmask)wset(JSL_R(-0.0))); }
#if JSL_KERNEL_ISA <= 3
JSL_INLINE wreal wselect(wmask m, wreal a, wreal b) {
    return (wreal)JSL_X86(blendv_)((JSL_VEC)b, (JSL_VEC)a, (JSL_VEC)m);
}
JSL_INLINE int wbits(wmask m) { return JSL_X86(movemask_)((JSL_VEC)m); }
#else
/* One vpternlog, whose truth table 0xca is m ? a : b. */
JSL_INLINE wreal wselect(wmask m, wreal a, wreal b) {
    return (wreal)_mm512_ternarylogic_epi64((__m512i)m, (__m512i)a, (__m512i)b, 0xca);
}
#ifdef JSL_DOUBLE
JSL_INLINE int wbits(wmask m) { return (int)_mm512_movepi64_mask((__m512i)m); }
#else
JSL_INLINE int wbits(wmask m) { return (int)_mm512_movepi32_mask((__m512i)m); }
#endif
#endif
#endif

/* a where m, else 0. */
#if JSL_KERNEL_ISA == 1
JSL_INLINE wreal wkeep(wmask m, wreal a) { return m ? a : 0; }
#else
JSL_INLINE wreal wkeep(wmask m, wreal a) { return (wreal)(m & (wmask)a); }
#endif

/* 16 virtual lanes: WG registers of WN lanes. */
#define WG (JSL_LANES / WN)
/* Sum of 16 values in the one order that every level uses: pairs 8 apart, then 4, 2, 1. */
JSL_INLINE jsl_real wsum16(const jsl_real *v) {
    jsl_real t[8];
    for (int i = 0; i < 8; i++) t[i] = v[i] + v[i + 8];
    for (int i = 0; i < 4; i++) t[i] = t[i] + t[i + 4];
    for (int i = 0; i < 2; i++) t[i] = t[i] + t[i + 2];
    return t[0] + t[1];
}
/* The same of WG registers, lane i of register g being virtual lane g * WN + i. */
JSL_INLINE jsl_real wsum16w(const wreal *v) {
    _Alignas(JSL_ALIGN) jsl_real t[JSL_LANES];
    for (int g = 0; g < WG; g++) wstore(t + g * WN, v[g]);
    return wsum16(t);
}

#endif
