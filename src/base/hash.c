/* SPDX-License-Identifier: MIT
 * hash.c - a fast 64-bit hash of bytes, and CRC-32C.
 *
 * The hash: four independent lanes, each taking one little-endian 64-bit word of every 32-byte
 * stripe by lane = f((lane ^ word) * odd), f an xor-shift. Each step is a bijection of the lane and
 * of the word, so a change within one word is never lost; the four chains run side by side in the
 * multiplier. At the end the lanes and the size go through full finalisers.
 */
#include "base/base.h"

#include "base/crc_table.h"

static inline uint64_t load_le64(const unsigned char *p) {
    uint64_t word;
    memcpy(&word, p, 8);
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    word = __builtin_bswap64(word);
#endif
    return word;
}

#define K0 0x9e3779b97f4a7c15ull
#define K1 0xd1b54a32d192ed03ull
#define K2 0x8cb92ba72f3d8dd7ull
#define K3 0xabc98388fb8fac03ull

static inline uint64_t absorb(uint64_t lane, uint64_t word, uint64_t odd) {
    lane = (lane ^ word) * odd;
    return lane ^ lane >> 32;
}

uint64_t jsl_hash_bytes(const void *data, size_t size, uint64_t seed) {
    const unsigned char *p = data;
    uint64_t s = jsl_mix64(seed ^ K0);
    uint64_t a = s + K1, b = s ^ K2, c = s + K3, d = s ^ K1;
    size_t left = size;
    for (; left >= 32; left -= 32, p += 32) {
        a = absorb(a, load_le64(p), K0);
        b = absorb(b, load_le64(p + 8), K1);
        c = absorb(c, load_le64(p + 16), K2);
        d = absorb(d, load_le64(p + 24), K3);
    }
    if (left) {
        unsigned char tail[32] = {0};
        memcpy(tail, p, left);
        a = absorb(a, load_le64(tail), K0);
        b = absorb(b, load_le64(tail + 8), K1);
        c = absorb(c, load_le64(tail + 16), K2);
        d = absorb(d, load_le64(tail + 24), K3);
    }
    uint64_t h = jsl_mix64(a ^ (uint64_t)size * K2);
    h = jsl_mix64(h + b);
    h = jsl_mix64(h * K0 + c);
    return jsl_mix64(h * K1 + d);
}

static uint32_t crc_by_table(uint32_t crc, const unsigned char *p, size_t size) {
    for (; size >= 8; size -= 8, p += 8) {
        uint64_t x = load_le64(p) ^ crc;
        crc = crc_table[7][x & 255] ^ crc_table[6][x >> 8 & 255] ^ crc_table[5][x >> 16 & 255] ^
              crc_table[4][x >> 24 & 255] ^ crc_table[3][x >> 32 & 255] ^
              crc_table[2][x >> 40 & 255] ^ crc_table[1][x >> 48 & 255] ^ crc_table[0][x >> 56];
    }
    for (; size; size--, p++) crc = crc >> 8 ^ crc_table[0][(crc ^ *p) & 255];
    return crc;
}

#if defined(__x86_64__)
#include <nmmintrin.h>
__attribute__((target("sse4.2"))) static uint32_t crc_by_cpu(uint32_t crc, const unsigned char *p,
                                                             size_t size) {
    uint64_t wide = crc;
    for (; size >= 8; size -= 8, p += 8) wide = _mm_crc32_u64(wide, load_le64(p));
    crc = (uint32_t)wide;
    for (; size; size--, p++) crc = _mm_crc32_u8(crc, *p);
    return crc;
}
#endif

uint32_t jsl_crc32c_by_table(uint32_t crc, const void *data, size_t size) {
    return ~crc_by_table(~crc, data, size);
}

uint32_t jsl_crc32c(uint32_t crc, const void *data, size_t size) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("sse4.2")) return ~crc_by_cpu(~crc, data, size);
#endif
    return jsl_crc32c_by_table(crc, data, size);
}
