/* SPDX-License-Identifier: MIT
 * column_kernel.c - range, f16 and u16 loops. Plain C that both compilers turn into vector code:
 * every operation is elementwise or an integer minimum, so the bytes are the same at every level.
 */
#include "telemetry/column_kernel.h"

#include "math/wide.h"

typedef uint16_t u16_at __attribute__((aligned(1), may_alias));

/* Order of floats as order of integers: negative numbers have their magnitude bits flipped. */
JSL_INLINE int32_t key_of(int32_t bits) { return bits ^ (bits >> 31 & 0x7fffffff); }

/* Keys of n <= RANGE_LANES numbers into as many running extremes: lane by lane, so that the
 * compiler makes vectors of it. Left out are those of 2^127 and more: the span of the others is
 * finite. */
#define RANGE_LANES 32
JSL_INLINE void range_lanes(const float *x, int n, int32_t *least, int32_t *most) {
    int32_t bits[RANGE_LANES];
    memcpy(bits, x, (size_t)n * 4);
    for (int j = 0; j < n; j++) {
        int32_t skip = -((bits[j] & 0x7fffffff) >= 0x7f000000), key = key_of(bits[j]);
        int32_t low = (key & ~skip) | (INT32_MAX & skip), high = (key & ~skip) | (INT32_MIN & skip);
        least[j] = low < least[j] ? low : least[j];
        most[j] = high > most[j] ? high : most[j];
    }
}

void JSL_KERNEL(jsl_kernel_range)(const float *x, int64_t n, float *lo, float *hi) {
    int32_t least[RANGE_LANES], most[RANGE_LANES];
    for (int j = 0; j < RANGE_LANES; j++) {
        least[j] = INT32_MAX;
        most[j] = INT32_MIN;
    }
    int64_t i = 0;
    for (; i + RANGE_LANES <= n; i += RANGE_LANES) range_lanes(x + i, RANGE_LANES, least, most);
    range_lanes(x + i, (int)(n - i), least, most);
    int32_t low = INT32_MAX, high = INT32_MIN;
    for (int j = 0; j < RANGE_LANES; j++) {
        low = least[j] < low ? least[j] : low;
        high = most[j] > high ? most[j] : high;
    }
    if (low > high) low = high = 0;
    low = key_of(low);
    high = key_of(high);
    memcpy(lo, &low, 4);
    memcpy(hi, &high, 4);
}

/* Normal numbers: add half of what is cut off (ties to even) and re-bias the exponent. Below 2^-14
 * the float sum |x| + 0.5 has exactly the spacing of half-precision subnormals, so the addition
 * does the rounding. */
JSL_INLINE uint16_t half_of(float x) {
    uint32_t bits, tiny_bits;
    memcpy(&bits, &x, 4);
    uint32_t size = bits & 0x7fffffffu, sign = bits >> 16 & 0x8000u;
    float magnitude, tiny;
    memcpy(&magnitude, &size, 4);
    tiny = magnitude + 0.5f;
    memcpy(&tiny_bits, &tiny, 4);
    uint32_t normal = (size + 0xfffu + (size >> 13 & 1u) - (112u << 23)) >> 13;
    uint32_t h = size < 0x38800000u ? tiny_bits - 0x3f000000u : normal;
    h = size >= 0x47800000u ? 0x7c00u : h;
    h = size > 0x7f800000u ? 0x7e00u : h;
    return (uint16_t)(h | sign);
}

void JSL_KERNEL(jsl_kernel_f16)(const float *x, int64_t n, uint8_t *out) {
    u16_at *to = (u16_at *)(void *)out;
    for (int64_t i = 0; i < n; i++) to[i] = half_of(x[i]);
}

void JSL_KERNEL(jsl_kernel_u16)(const float *x, int64_t n, float lo, float inv_step, uint8_t *out) {
    u16_at *to = (u16_at *)(void *)out;
    for (int64_t i = 0; i < n; i++) {
        float code = (x[i] - lo) * inv_step;
        code = code > 0.0f ? code : 0.0f; /* NaN too */
        code = code < 65535.0f ? code : 65535.0f;
        to[i] = (uint16_t)(int32_t)(code + 0.5f);
    }
}

void JSL_KERNEL(jsl_kernel_from_f16)(const uint8_t *in, int64_t n, float *out) {
    const u16_at *from = (const u16_at *)(const void *)in;
    for (int64_t i = 0; i < n; i++) {
        uint32_t h = from[i], size = h & 0x7fffu;
        float tiny = (float)(int32_t)size * 0x1p-24f;
        uint32_t tiny_bits;
        memcpy(&tiny_bits, &tiny, 4);
        uint32_t bits = (size << 13) + (112u << 23);
        bits += size >= 0x7c00u ? 112u << 23 : 0u;
        bits = size < 0x400u ? tiny_bits : bits;
        bits |= (h & 0x8000u) << 16;
        memcpy(&out[i], &bits, 4);
    }
}

void JSL_KERNEL(jsl_kernel_from_u16)(const uint8_t *in, int64_t n, float lo, float step,
                                     float *out) {
    const u16_at *from = (const u16_at *)(const void *)in;
    for (int64_t i = 0; i < n; i++) out[i] = lo + (float)from[i] * step;
}
