/* SPDX-License-Identifier: MIT
 * Three-vectors of lanes, and records of four numbers gathered into lanes and scattered back.
 * Kernels only. Floor 4.
 */
#ifndef JSL_RIGID_LANES_H
#define JSL_RIGID_LANES_H

#include "math/wide.h"

/* -- Choice -------------------------------------------------------------------------------------
 */

/* a > b ? a : b, a < b ? a : b and m ? a : b as single instructions. The hardware's rule (the
 * second operand on NaN and on equal zeros) is that of wmax and wmin. */
#if JSL_KERNEL_ISA == 2 && !defined(JSL_DOUBLE)
JSL_INLINE wreal lmax(wreal a, wreal b) { return (wreal)_mm_max_ps((__m128)a, (__m128)b); }
JSL_INLINE wreal lmin(wreal a, wreal b) { return (wreal)_mm_min_ps((__m128)a, (__m128)b); }
JSL_INLINE wreal lselect(wmask m, wreal a, wreal b) {
    return (wreal)_mm_blendv_ps((__m128)b, (__m128)a, (__m128)m);
}
#elif JSL_KERNEL_ISA == 2
JSL_INLINE wreal lmax(wreal a, wreal b) { return (wreal)_mm_max_pd((__m128d)a, (__m128d)b); }
JSL_INLINE wreal lmin(wreal a, wreal b) { return (wreal)_mm_min_pd((__m128d)a, (__m128d)b); }
JSL_INLINE wreal lselect(wmask m, wreal a, wreal b) {
    return (wreal)_mm_blendv_pd((__m128d)b, (__m128d)a, (__m128d)m);
}
#elif JSL_KERNEL_ISA == 3 && !defined(JSL_DOUBLE)
JSL_INLINE wreal lmax(wreal a, wreal b) { return (wreal)_mm256_max_ps((__m256)a, (__m256)b); }
JSL_INLINE wreal lmin(wreal a, wreal b) { return (wreal)_mm256_min_ps((__m256)a, (__m256)b); }
JSL_INLINE wreal lselect(wmask m, wreal a, wreal b) {
    return (wreal)_mm256_blendv_ps((__m256)b, (__m256)a, (__m256)m);
}
#elif JSL_KERNEL_ISA == 3
JSL_INLINE wreal lmax(wreal a, wreal b) { return (wreal)_mm256_max_pd((__m256d)a, (__m256d)b); }
JSL_INLINE wreal lmin(wreal a, wreal b) { return (wreal)_mm256_min_pd((__m256d)a, (__m256d)b); }
JSL_INLINE wreal lselect(wmask m, wreal a, wreal b) {
    return (wreal)_mm256_blendv_pd((__m256d)b, (__m256d)a, (__m256d)m);
}
#elif JSL_KERNEL_ISA == 4 && !defined(JSL_DOUBLE)
JSL_INLINE wreal lmax(wreal a, wreal b) { return (wreal)_mm512_max_ps((__m512)a, (__m512)b); }
JSL_INLINE wreal lmin(wreal a, wreal b) { return (wreal)_mm512_min_ps((__m512)a, (__m512)b); }
JSL_INLINE wreal lselect(wmask m, wreal a, wreal b) { return wselect(m, a, b); }
#elif JSL_KERNEL_ISA == 4
JSL_INLINE wreal lmax(wreal a, wreal b) { return (wreal)_mm512_max_pd((__m512d)a, (__m512d)b); }
JSL_INLINE wreal lmin(wreal a, wreal b) { return (wreal)_mm512_min_pd((__m512d)a, (__m512d)b); }
JSL_INLINE wreal lselect(wmask m, wreal a, wreal b) { return wselect(m, a, b); }
#else
JSL_INLINE wreal lmax(wreal a, wreal b) { return a > b ? a : b; }
JSL_INLINE wreal lmin(wreal a, wreal b) { return a < b ? a : b; }
JSL_INLINE wreal lselect(wmask m, wreal a, wreal b) { return m ? a : b; }
#endif
JSL_INLINE wreal lkeep(wmask m, wreal a) { return lselect(m, a, wset(0)); }
JSL_INLINE wreal labsolute(wreal a) { return lmax(a, -a); }

/* -- Vectors -------------------------------------------------------------------------------------
 */

typedef struct lvec {
    wreal x, y, z;
} lvec;
typedef struct lquat {
    wreal x, y, z, w;
} lquat;
/* A symmetric 3x3 matrix. */
typedef struct lsym {
    wreal xx, xy, xz, yy, yz, zz;
} lsym;
typedef struct lmat {
    lvec c0, c1, c2; /* columns */
} lmat;

JSL_INLINE lvec lv(wreal x, wreal y, wreal z) { return (lvec){x, y, z}; }
JSL_INLINE lvec ladd(lvec a, lvec b) { return lv(a.x + b.x, a.y + b.y, a.z + b.z); }
JSL_INLINE lvec lsub(lvec a, lvec b) { return lv(a.x - b.x, a.y - b.y, a.z - b.z); }
JSL_INLINE lvec lscale(wreal s, lvec a) { return lv(s * a.x, s * a.y, s * a.z); }
/* c + s a and c - s a */
JSL_INLINE lvec lmadd(lvec c, wreal s, lvec a) {
    return lv(c.x + s * a.x, c.y + s * a.y, c.z + s * a.z);
}
JSL_INLINE lvec lmsub(lvec c, wreal s, lvec a) {
    return lv(c.x - s * a.x, c.y - s * a.y, c.z - s * a.z);
}
JSL_INLINE wreal ldot(lvec a, lvec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
JSL_INLINE lvec lcross(lvec a, lvec b) {
    return lv(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
JSL_INLINE lvec lsym_mul(lsym m, lvec a) {
    return lv(m.xx * a.x + m.xy * a.y + m.xz * a.z, m.xy * a.x + m.yy * a.y + m.yz * a.z,
              m.xz * a.x + m.yz * a.y + m.zz * a.z);
}
JSL_INLINE lmat lmat_of(lquat q) {
    wreal x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
    wreal xx = q.x * x2, yy = q.y * y2, zz = q.z * z2, xy = q.x * y2, xz = q.x * z2, yz = q.y * z2,
          wx = q.w * x2, wy = q.w * y2, wz = q.w * z2, one = wset(1);
    return (lmat){lv(one - (yy + zz), xy + wz, xz - wy), lv(xy - wz, one - (xx + zz), yz + wx),
                  lv(xz + wy, yz - wx, one - (xx + yy))};
}
JSL_INLINE lvec lmat_mul(lmat m, lvec a) {
    return lmadd(lmadd(lscale(a.x, m.c0), a.y, m.c1), a.z, m.c2);
}
/* The transpose times a. */
JSL_INLINE lvec lmat_mul_t(lmat m, lvec a) {
    return lv(ldot(m.c0, a), ldot(m.c1, a), ldot(m.c2, a));
}
JSL_INLINE lquat lquat_mul(lquat a, lquat b) {
    return (lquat){a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                   a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                   a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                   a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}
/* 1/a where a > 0, else 0. */
JSL_INLINE wreal linverse(wreal a) {
    return lkeep(wgt(a, wset(0)), wset(1) / lmax(a, wset(JSL_R(1e-30))));
}

/* -- Four numbers of WN records into four registers of lanes, and back ----------------------- */

/* Record i starts at base + stride * index[i]; 16-byte aligned (32 in double). */
#define LREC(k) (base + (size_t)stride * (size_t)index[k])

#if JSL_KERNEL_ISA == 1

JSL_INLINE void lgather(const jsl_real *base, int stride, const int32_t *index, wreal out[4]) {
    const jsl_real *p = LREC(0);
    for (int k = 0; k < 4; k++) out[k] = p[k];
}
JSL_INLINE void lscatter(jsl_real *base, int stride, const int32_t *index, const wreal in[4]) {
    jsl_real *p = LREC(0);
    for (int k = 0; k < 4; k++) p[k] = in[k];
}

#elif !defined(JSL_DOUBLE)

#if JSL_KERNEL_ISA == 2
JSL_INLINE void lgather(const jsl_real *base, int stride, const int32_t *index, wreal out[4]) {
    __m128 a = _mm_load_ps(LREC(0)), b = _mm_load_ps(LREC(1)), c = _mm_load_ps(LREC(2)),
           d = _mm_load_ps(LREC(3));
    _MM_TRANSPOSE4_PS(a, b, c, d);
    out[0] = (wreal)a, out[1] = (wreal)b, out[2] = (wreal)c, out[3] = (wreal)d;
}
JSL_INLINE void lscatter(jsl_real *base, int stride, const int32_t *index, const wreal in[4]) {
    __m128 a = (__m128)in[0], b = (__m128)in[1], c = (__m128)in[2], d = (__m128)in[3];
    _MM_TRANSPOSE4_PS(a, b, c, d);
    _mm_store_ps(LREC(0), a), _mm_store_ps(LREC(1), b), _mm_store_ps(LREC(2), c),
        _mm_store_ps(LREC(3), d);
}
#else
/* Transposes the 4x4 matrices in the low and the high halves. */
JSL_INLINE void ltranspose8(__m256 v[4]) {
    __m256 t0 = _mm256_unpacklo_ps(v[0], v[1]), t1 = _mm256_unpackhi_ps(v[0], v[1]),
           t2 = _mm256_unpacklo_ps(v[2], v[3]), t3 = _mm256_unpackhi_ps(v[2], v[3]);
    v[0] = _mm256_castpd_ps(_mm256_unpacklo_pd(_mm256_castps_pd(t0), _mm256_castps_pd(t2)));
    v[1] = _mm256_castpd_ps(_mm256_unpackhi_pd(_mm256_castps_pd(t0), _mm256_castps_pd(t2)));
    v[2] = _mm256_castpd_ps(_mm256_unpacklo_pd(_mm256_castps_pd(t1), _mm256_castps_pd(t3)));
    v[3] = _mm256_castpd_ps(_mm256_unpackhi_pd(_mm256_castps_pd(t1), _mm256_castps_pd(t3)));
}
JSL_INLINE __m256 lpair(const jsl_real *low, const jsl_real *high) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(low)), _mm_load_ps(high), 1);
}
JSL_INLINE void lgather8(const jsl_real *base, int stride, const int32_t *index, __m256 v[4]) {
    for (int k = 0; k < 4; k++) v[k] = lpair(LREC(k), LREC(k + 4));
    ltranspose8(v);
}
JSL_INLINE void lscatter8(jsl_real *base, int stride, const int32_t *index, __m256 v[4]) {
    ltranspose8(v);
    for (int k = 0; k < 4; k++) {
        _mm_store_ps(LREC(k), _mm256_castps256_ps128(v[k]));
        _mm_store_ps(LREC(k + 4), _mm256_extractf128_ps(v[k], 1));
    }
}
#if JSL_KERNEL_ISA == 3
JSL_INLINE void lgather(const jsl_real *base, int stride, const int32_t *index, wreal out[4]) {
    __m256 v[4];
    lgather8(base, stride, index, v);
    for (int k = 0; k < 4; k++) out[k] = (wreal)v[k];
}
JSL_INLINE void lscatter(jsl_real *base, int stride, const int32_t *index, const wreal in[4]) {
    __m256 v[4] = {(__m256)in[0], (__m256)in[1], (__m256)in[2], (__m256)in[3]};
    lscatter8(base, stride, index, v);
}
#else
JSL_INLINE void lgather(const jsl_real *base, int stride, const int32_t *index, wreal out[4]) {
    __m256 low[4], high[4];
    lgather8(base, stride, index, low);
    lgather8(base, stride, index + 8, high);
    for (int k = 0; k < 4; k++)
        out[k] = (wreal)_mm512_insertf32x8(_mm512_castps256_ps512(low[k]), high[k], 1);
}
JSL_INLINE void lscatter(jsl_real *base, int stride, const int32_t *index, const wreal in[4]) {
    __m256 low[4], high[4];
    for (int k = 0; k < 4; k++) {
        low[k] = _mm512_castps512_ps256((__m512)in[k]);
        high[k] = _mm512_extractf32x8_ps((__m512)in[k], 1);
    }
    lscatter8(base, stride, index, low);
    lscatter8(base, stride, index + 8, high);
}
#endif
#endif

#else /* double */

#if JSL_KERNEL_ISA == 2
JSL_INLINE void lgather(const jsl_real *base, int stride, const int32_t *index, wreal out[4]) {
    const jsl_real *p = LREC(0), *q = LREC(1);
    __m128d a = _mm_load_pd(p), b = _mm_load_pd(p + 2), c = _mm_load_pd(q), d = _mm_load_pd(q + 2);
    out[0] = (wreal)_mm_unpacklo_pd(a, c), out[1] = (wreal)_mm_unpackhi_pd(a, c);
    out[2] = (wreal)_mm_unpacklo_pd(b, d), out[3] = (wreal)_mm_unpackhi_pd(b, d);
}
JSL_INLINE void lscatter(jsl_real *base, int stride, const int32_t *index, const wreal in[4]) {
    jsl_real *p = LREC(0), *q = LREC(1);
    __m128d a = (__m128d)in[0], b = (__m128d)in[1], c = (__m128d)in[2], d = (__m128d)in[3];
    _mm_store_pd(p, _mm_unpacklo_pd(a, b)), _mm_store_pd(p + 2, _mm_unpacklo_pd(c, d));
    _mm_store_pd(q, _mm_unpackhi_pd(a, b)), _mm_store_pd(q + 2, _mm_unpackhi_pd(c, d));
}
#else
JSL_INLINE void ltranspose4(__m256d v[4]) {
    __m256d t0 = _mm256_unpacklo_pd(v[0], v[1]), t1 = _mm256_unpackhi_pd(v[0], v[1]),
            t2 = _mm256_unpacklo_pd(v[2], v[3]), t3 = _mm256_unpackhi_pd(v[2], v[3]);
    v[0] = _mm256_permute2f128_pd(t0, t2, 0x20);
    v[1] = _mm256_permute2f128_pd(t1, t3, 0x20);
    v[2] = _mm256_permute2f128_pd(t0, t2, 0x31);
    v[3] = _mm256_permute2f128_pd(t1, t3, 0x31);
}
JSL_INLINE void lgather4(const jsl_real *base, int stride, const int32_t *index, __m256d v[4]) {
    for (int k = 0; k < 4; k++) v[k] = _mm256_load_pd(LREC(k));
    ltranspose4(v);
}
JSL_INLINE void lscatter4(jsl_real *base, int stride, const int32_t *index, __m256d v[4]) {
    ltranspose4(v);
    for (int k = 0; k < 4; k++) _mm256_store_pd(LREC(k), v[k]);
}
#if JSL_KERNEL_ISA == 3
JSL_INLINE void lgather(const jsl_real *base, int stride, const int32_t *index, wreal out[4]) {
    __m256d v[4];
    lgather4(base, stride, index, v);
    for (int k = 0; k < 4; k++) out[k] = (wreal)v[k];
}
JSL_INLINE void lscatter(jsl_real *base, int stride, const int32_t *index, const wreal in[4]) {
    __m256d v[4] = {(__m256d)in[0], (__m256d)in[1], (__m256d)in[2], (__m256d)in[3]};
    lscatter4(base, stride, index, v);
}
#else
JSL_INLINE void lgather(const jsl_real *base, int stride, const int32_t *index, wreal out[4]) {
    __m256d low[4], high[4];
    lgather4(base, stride, index, low);
    lgather4(base, stride, index + 4, high);
    for (int k = 0; k < 4; k++)
        out[k] = (wreal)_mm512_insertf64x4(_mm512_castpd256_pd512(low[k]), high[k], 1);
}
JSL_INLINE void lscatter(jsl_real *base, int stride, const int32_t *index, const wreal in[4]) {
    __m256d low[4], high[4];
    for (int k = 0; k < 4; k++) {
        low[k] = _mm512_castpd512_pd256((__m512d)in[k]);
        high[k] = _mm512_extractf64x4_pd((__m512d)in[k], 1);
    }
    lscatter4(base, stride, index, low);
    lscatter4(base, stride, index + 4, high);
}
#endif
#endif
#endif

#endif
