/* SPDX-License-Identifier: MIT
 * bitset.c - growable bit sets.
 */
#include "base/base.h"

jsl_result jsl_bitset_reserve(jsl_memory *memory, jsl_bitset *set, int64_t bits) {
    if (bits > INT64_MAX / 2) return JSL_ERR_MEMORY;
    int64_t words = jsl_round_up((bits + 63) / 64, JSL_ALIGN / (int64_t)sizeof(uint64_t));
    if (words <= set->words) return JSL_OK;
    if (words < set->words + set->words / 2) words = set->words + set->words / 2;
    size_t old_size = (size_t)set->words * sizeof(uint64_t);
    size_t new_size = (size_t)words * sizeof(uint64_t);
    void *word = set->word;
    JSL_TRY(jsl_realloc(memory, &word, old_size, new_size));
    memset((char *)word + old_size, 0, new_size - old_size);
    *set = (jsl_bitset){word, words};
    return JSL_OK;
}

void jsl_bitset_free(jsl_memory *memory, jsl_bitset *set) {
    jsl_free(memory, set->word, (size_t)set->words * sizeof(uint64_t));
    *set = (jsl_bitset){0};
}

void jsl_bitset_clear(jsl_bitset *set) {
    if (set->words) memset(set->word, 0, (size_t)set->words * sizeof(uint64_t));
}

int64_t jsl_bitset_count(const jsl_bitset *set) {
    int64_t count = 0;
    for (int64_t w = 0; w < set->words; w++) count += __builtin_popcountll(set->word[w]);
    return count;
}

int64_t jsl_bitset_next(const jsl_bitset *set, int64_t i) {
    if (i < 0) i = 0;
    int64_t w = i >> 6;
    if (w >= set->words) return -1;
    uint64_t bits = set->word[w] & (~0ull << (i & 63));
    while (!bits) {
        if (++w >= set->words) return -1;
        bits = set->word[w];
    }
    return w * 64 + __builtin_ctzll(bits);
}
