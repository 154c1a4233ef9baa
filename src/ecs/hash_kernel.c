/* SPDX-License-Identifier: MIT
 * The hash of rows, column by column: each row has a 64-bit accumulator, and each 32-bit word w of
 * a column changes it by a' = low32(a ^ w) * M + high32(a), the step of a multiply-with-carry
 * generator. For a fixed w that is a permutation, for a fixed a no two w give the same, and it
 * takes one multiplication of 32 bits, which every vector unit has. Floor 2.
 */
#include "ecs/hash_kernel.h"
#include "ecs/ecs.h"

#include "math/wide.h"

#define M 0xffffda61u /* Marsaglia's multiplier */
#define ROWS 256      /* accumulators at a time: 2 KiB, in the first-level cache */
#define HANDLE_BITS 0x000fffffffffffffull

/* -- Lanes of 64 bits --------------------------------------------------------- */

#if JSL_KERNEL_ISA == 1
typedef uint64_t lanes;
#define LANES 1
JSL_INLINE lanes load(const void *p) {
    uint64_t x;
    memcpy(&x, p, 8);
    return x;
}
JSL_INLINE lanes load32(const void *p) {
    uint32_t x;
    memcpy(&x, p, 4);
    return x;
}
JSL_INLINE void store(uint64_t *p, lanes a) { *p = a; }
JSL_INLINE lanes all(uint64_t x) { return x; }
JSL_INLINE lanes high(lanes a) { return a >> 32; }
JSL_INLINE lanes step(lanes a, lanes w) { return (uint64_t)(uint32_t)(a ^ w) * M + (a >> 32); }
JSL_INLINE lanes both(lanes a, lanes b) { return a & b; }
#elif JSL_KERNEL_ISA == 2
typedef __m128i lanes;
#define LANES 2
JSL_INLINE lanes load(const void *p) { return _mm_loadu_si128(p); }
JSL_INLINE lanes load32(const void *p) { return _mm_cvtepu32_epi64(_mm_loadl_epi64(p)); }
JSL_INLINE void store(uint64_t *p, lanes a) { _mm_storeu_si128((void *)p, a); }
JSL_INLINE lanes all(uint64_t x) { return _mm_set1_epi64x((long long)x); }
JSL_INLINE lanes high(lanes a) { return _mm_srli_epi64(a, 32); }
JSL_INLINE lanes step(lanes a, lanes w) {
    return _mm_add_epi64(_mm_mul_epu32(_mm_xor_si128(a, w), all(M)), high(a));
}
JSL_INLINE lanes both(lanes a, lanes b) { return _mm_and_si128(a, b); }
#elif JSL_KERNEL_ISA == 3
typedef __m256i lanes;
#define LANES 4
JSL_INLINE lanes load(const void *p) { return _mm256_loadu_si256(p); }
JSL_INLINE lanes load32(const void *p) { return _mm256_cvtepu32_epi64(_mm_loadu_si128(p)); }
JSL_INLINE void store(uint64_t *p, lanes a) { _mm256_storeu_si256((void *)p, a); }
JSL_INLINE lanes all(uint64_t x) { return _mm256_set1_epi64x((long long)x); }
JSL_INLINE lanes high(lanes a) { return _mm256_srli_epi64(a, 32); }
JSL_INLINE lanes step(lanes a, lanes w) {
    return _mm256_add_epi64(_mm256_mul_epu32(_mm256_xor_si256(a, w), all(M)), high(a));
}
JSL_INLINE lanes both(lanes a, lanes b) { return _mm256_and_si256(a, b); }
#else
typedef __m512i lanes;
#define LANES 8
JSL_INLINE lanes load(const void *p) { return _mm512_loadu_si512(p); }
JSL_INLINE lanes load32(const void *p) { return _mm512_cvtepu32_epi64(_mm256_loadu_si256(p)); }
JSL_INLINE void store(uint64_t *p, lanes a) { _mm512_storeu_si512(p, a); }
JSL_INLINE lanes all(uint64_t x) { return _mm512_set1_epi64((long long)x); }
JSL_INLINE lanes high(lanes a) { return _mm512_srli_epi64(a, 32); }
JSL_INLINE lanes step(lanes a, lanes w) {
    return _mm512_add_epi64(_mm512_mul_epu32(_mm512_xor_si512(a, w), all(M)), high(a));
}
JSL_INLINE lanes both(lanes a, lanes b) { return _mm512_and_si512(a, b); }
#endif

/* As step, with a word of 64 bits. */
JSL_INLINE lanes fold(lanes a, lanes w) {
#if JSL_KERNEL_ISA == 1
    return step(a ^ w, 0);
#elif JSL_KERNEL_ISA == 2
    return step(_mm_xor_si128(a, w), _mm_setzero_si128());
#elif JSL_KERNEL_ISA == 3
    return step(_mm256_xor_si256(a, w), _mm256_setzero_si256());
#else
    return step(_mm512_xor_si512(a, w), _mm512_setzero_si512());
#endif
}

/* -- Columns ------------------------------------------------------------------ */

static void mix_key(uint64_t *acc, uint32_t key, int n) {
    lanes k = all(key);
    for (int i = 0; i < n; i += LANES) store(acc + i, step(load(acc + i), k));
}

static void mix_4(uint64_t *acc, const unsigned char *v, int n) {
    for (int i = 0; i < n; i += LANES) store(acc + i, step(load(acc + i), load32(v + i * 4)));
}

/* Three columns in one pass: positions and velocities come in threes, and the accumulators are
 * loaded once. */
static void mix_4x3(uint64_t *acc, const unsigned char *u, const unsigned char *v,
                    const unsigned char *w, int n) {
    for (int i = 0; i < n; i += LANES) {
        lanes a = step(load(acc + i), load32(u + i * 4));
        a = step(a, load32(v + i * 4));
        store(acc + i, step(a, load32(w + i * 4)));
    }
}

static void mix_8(uint64_t *acc, const unsigned char *v, uint64_t keep, int n) {
    lanes mask = all(keep);
    for (int i = 0; i < n; i += LANES) {
        lanes x = both(load(v + i * 8), mask);
        store(acc + i, step(step(load(acc + i), x), high(x)));
    }
}

static void mix_small(uint64_t *acc, const unsigned char *v, uint32_t bytes, int n) {
    uint32_t word[ROWS];
    if (bytes == 1) {
        for (int i = 0; i < n; i++) word[i] = v[i];
    } else {
        for (int i = 0; i < n; i++) {
            uint16_t x;
            memcpy(&x, v + i * 2, 2);
            word[i] = x;
        }
    }
    mix_4(acc, (const unsigned char *)word, n);
}

/* A bijection of the accumulator that spreads every bit, before they are added. */
static uint64_t finish(const uint64_t *acc, int n) {
    uint64_t sum = 0;
    for (int i = 0; i < n; i++) sum += jsl_mix64(acc[i] + 0x9e3779b97f4a7c15ull);
    return sum;
}

static bool is_4(const jsl_hash_step *s) { return s->values && s->bytes == 4; }

uint64_t JSL_KERNEL(jsl_hash_rows)(const jsl_entity *entity, const jsl_hash_step *s, int steps,
                                   int64_t count) {
    uint64_t acc[ROWS], sum = 0;
    lanes mask = all(HANDLE_BITS);
    for (int64_t row = 0; row < count; row += ROWS) {
        int left = (int)(count - row < ROWS ? count - row : ROWS);
        int n = (int)jsl_round_up(left, JSL_LANES);
        for (int i = 0; i < n; i += LANES) store(acc + i, both(load(entity + row + i), mask));
        for (int k = 0; k < steps; k++) {
            const unsigned char *v = s[k].values ? s[k].values + row * s[k].bytes : NULL;
            if (!v) {
                mix_key(acc, s[k].key, n);
            } else if (s[k].bytes == 4 && k + 2 < steps && is_4(s + k + 1) && is_4(s + k + 2)) {
                mix_4x3(acc, v, s[k + 1].values + row * 4, s[k + 2].values + row * 4, n);
                k += 2;
            } else if (s[k].bytes == 4) {
                mix_4(acc, v, n);
            } else if (s[k].bytes == 8) {
                mix_8(acc, v, s[k].entity ? HANDLE_BITS : ~0ull, n);
            } else {
                mix_small(acc, v, s[k].bytes, n);
            }
        }
        sum += finish(acc, left);
    }
    return sum;
}

/* 16 lanes of 64 bits, each taking the words of its own column of the data: t = a ^ w, a' =
 * low32(t) * M + high32(t). One changed byte always changes its lane. */
void JSL_KERNEL(jsl_sum_mix)(uint64_t sum[JSL_SUM_LANES], const unsigned char *bytes, size_t size) {
    lanes a[JSL_SUM_LANES / LANES];
    for (int i = 0; i < JSL_SUM_LANES / LANES; i++) a[i] = load(sum + i * LANES);
    for (size_t at = 0; at < size; at += JSL_SUM_BYTES)
        for (int i = 0; i < JSL_SUM_LANES / LANES; i++)
            a[i] = fold(a[i], load(bytes + at + i * LANES * 8));
    for (int i = 0; i < JSL_SUM_LANES / LANES; i++) store(sum + i * LANES, a[i]);
}
