/* SPDX-License-Identifier: MIT
 * SIMD lanes for kernels. A source named *_kernel.c is compiled once per instruction-set level; the
 * Makefile defines JSL_KERNEL_ISA (1 scalar, 2 sse, 3 avx2, 4 avx512) and the matching machine flags.
 *
 * wreal holds WN lanes of jsl_real, wmask one all-ones or all-zero integer a lane. Elementwise IEEE
 * operations give the same bits at every width. Sums over lanes do not, so kernels that need them use
 * wsum16: always 16 virtual lanes (JSL_LANES), reduced in one fixed tree. No fused multiply-add, no
 * reciprocal approximations. Floor 1.
 */
#ifndef JSL_MATH_WIDE_H
#define JSL_MATH_WIDE_H

#include "base/base.h"

#if JSL_KERNEL_ISA >= 2
#include <immintrin.h>
#endif

#ifndef JSL_KERNEL_ISA
#error "wide.h is for *_kernel.c files, which the Makefile compiles with JSL_KERNEL_ISA"
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
typedef jsl_real wreal_u __attribute__((vector_size(JSL_WIDE_BYTES), aligned(sizeof(jsl_real)), may_alias));
typedef wreal wreal_a __attribute__((may_alias));
#endif

#if JSL_KERNEL_ISA == 1
JSL_INLINE wreal wload(const jsl_real *p) { return *p; }
JSL_INLINE wreal wloadu(const jsl_real *p) { return *p; }
JSL_INLINE void wstore(jsl_real *p, wreal a) { *p = a; }
JSL_INLINE void wstoreu(jsl_real *p, wreal a) { *p = a; }
JSL_INLINE wreal wset(jsl_real a) { return a; }
JSL_INLINE wmask wgt(wreal a, wreal b) { return -(jsl_lane_int)(a > b); }
JSL_INLINE wmask wge(wreal a, wreal b) { return -(jsl_lane_int)(a >= b); }
JSL_INLINE wmask weq(wreal a, wreal b) { return -(jsl_lane_int)(a == b); }
JSL_INLINE wreal wselect(wmask m, wreal a, wreal b) { return m ? a : b; }
JSL_INLINE wreal wsqrt(wreal a) {
#ifdef JSL_DOUBLE
    return __builtin_sqrt(a);
#else
    return __builtin_sqrtf(a);
#endif
}
JSL_INLINE int wbits(wmask m) { return m & 1; }
#else
JSL_INLINE wreal wload(const jsl_real *p) { return *(const wreal_a *)(const void *)p; }
JSL_INLINE wreal wloadu(const jsl_real *p) { return *(const wreal_u *)(const void *)p; }
JSL_INLINE void wstore(jsl_real *p, wreal a) { *(wreal_a *)(void *)p = a; }
JSL_INLINE void wstoreu(jsl_real *p, wreal a) { *(wreal_u *)(void *)p = a; }
JSL_INLINE wreal wset(jsl_real a) { return a - (wreal){0}; }
JSL_INLINE wmask wgt(wreal a, wreal b) { return (wmask)(a > b); }
JSL_INLINE wmask wge(wreal a, wreal b) { return (wmask)(a >= b); }
JSL_INLINE wmask weq(wreal a, wreal b) { return (wmask)(a == b); }
JSL_INLINE wreal wselect(wmask m, wreal a, wreal b) {
    return (wreal)((m & (wmask)a) | (~m & (wmask)b));
}
#if JSL_KERNEL_ISA == 2
#ifdef JSL_DOUBLE
JSL_INLINE wreal wsqrt(wreal a) { return (wreal)_mm_sqrt_pd((__m128d)a); }
JSL_INLINE int wbits(wmask m) { return _mm_movemask_pd((__m128d)m); }
#else
JSL_INLINE wreal wsqrt(wreal a) { return (wreal)_mm_sqrt_ps((__m128)a); }
JSL_INLINE int wbits(wmask m) { return _mm_movemask_ps((__m128)m); }
#endif
#elif JSL_KERNEL_ISA == 3
#ifdef JSL_DOUBLE
JSL_INLINE wreal wsqrt(wreal a) { return (wreal)_mm256_sqrt_pd((__m256d)a); }
JSL_INLINE int wbits(wmask m) { return _mm256_movemask_pd((__m256d)m); }
#else
JSL_INLINE wreal wsqrt(wreal a) { return (wreal)_mm256_sqrt_ps((__m256)a); }
JSL_INLINE int wbits(wmask m) { return _mm256_movemask_ps((__m256)m); }
#endif
#else
#ifdef JSL_DOUBLE
JSL_INLINE wreal wsqrt(wreal a) { return (wreal)_mm512_sqrt_pd((__m512d)a); }
JSL_INLINE int wbits(wmask m) { return (int)_mm512_movepi64_mask((__m512i)m); }
#else
JSL_INLINE wreal wsqrt(wreal a) { return (wreal)_mm512_sqrt_ps((__m512)a); }
JSL_INLINE int wbits(wmask m) { return (int)_mm512_movepi32_mask((__m512i)m); }
#endif
#endif
#endif

/* a > b ? a : b and a < b ? a : b: the second operand wins on NaN and on equal zeros, at every width. */
JSL_INLINE wreal wmax(wreal a, wreal b) { return wselect(wgt(a, b), a, b); }
JSL_INLINE wreal wmin(wreal a, wreal b) { return wselect(wgt(b, a), a, b); }
/* a where m, else 0. */
JSL_INLINE wreal wkeep(wmask m, wreal a) { return wselect(m, a, wset(0)); }
JSL_INLINE wreal wabs(wreal a) { return wselect(wgt(wset(0), a), -a, a); }

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

#endif
