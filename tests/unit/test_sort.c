/* SPDX-License-Identifier: MIT
 * test_sort.c - stable radix sorts.
 */
#include "base/base.h"
#include "helper.h"

#include <stdlib.h>

typedef struct pair {
    uint64_t key;
    uint32_t value;
} pair;

/* Values count up in the input, so the order of equal keys is that of values. */
static int stable_order(const void *a, const void *b) {
    const pair *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return (x->value > y->value) - (x->value < y->value);
}

static void check(const uint64_t *input, int64_t n) {
    size_t room = (size_t)n + 1;
    pair *want = malloc(room * sizeof *want);
    uint64_t *key = malloc(room * sizeof *key), *tmp = malloc(room * sizeof *tmp);
    uint32_t *value = malloc(room * sizeof *value), *tmp_value = malloc(room * sizeof *tmp_value);
    uint32_t *key32 = malloc(room * sizeof *key32), *tmp32 = malloc(room * sizeof *tmp32);
    bool narrow = true;
    for (int64_t i = 0; i < n; i++) {
        want[i] = (pair){input[i], (uint32_t)i};
        key[i] = input[i];
        value[i] = (uint32_t)i;
        narrow &= input[i] <= UINT32_MAX;
    }
    qsort(want, (size_t)n, sizeof *want, stable_order);
    jsl_sort_u64(key, value, tmp, tmp_value, n);
    for (int64_t i = 0; i < n; i++)
        if (key[i] != want[i].key || value[i] != want[i].value) fail_msg("u64 at %d", (int)i);
    if (narrow) {
        for (int64_t i = 0; i < n; i++) {
            key32[i] = (uint32_t)input[i];
            value[i] = (uint32_t)i;
        }
        jsl_sort_u32(key32, value, tmp32, tmp_value, n);
        for (int64_t i = 0; i < n; i++)
            if (key32[i] != want[i].key || value[i] != want[i].value) fail_msg("u32 at %d", (int)i);
    }
    free(want), free(key), free(tmp), free(value), free(tmp_value), free(key32), free(tmp32);
}

static const int64_t lengths[] = {0, 1, 2, 47, 48, 49, 100, 1000, 4095, 4096, 4097, 30000};

static void random_keys_of_every_width_are_sorted_stably(void **state) {
    (void)state;
    uint64_t seed = 21, *input = malloc(30000 * sizeof *input);
    for (int bits = 0; bits <= 64; bits += 4) {
        for (int l = 0; l < JSL_COUNT(lengths); l++) {
            for (int64_t i = 0; i < lengths[l]; i++)
                input[i] = bits == 0 ? 9 : test_random(&seed) >> (64 - bits);
            check(input, lengths[l]);
        }
    }
    free(input);
}

static void sorted_reversed_and_gapped_keys_are_sorted(void **state) {
    (void)state;
    uint64_t seed = 22, *input = malloc(30000 * sizeof *input);
    for (int l = 0; l < JSL_COUNT(lengths); l++) {
        int64_t n = lengths[l];
        for (int64_t i = 0; i < n; i++) input[i] = (uint64_t)i;
        check(input, n);
        for (int64_t i = 0; i < n; i++) input[i] = (uint64_t)(n - i);
        check(input, n);
        /* Only the highest and the lowest digit differ. */
        for (int64_t i = 0; i < n; i++) input[i] = test_random(&seed) & 0xf00000000000000full;
        check(input, n);
        for (int64_t i = 0; i < n; i++) input[i] = i == n / 2 ? 0 : UINT64_MAX;
        check(input, n);
    }
    free(input);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_keys_of_every_width_are_sorted_stably),
        cmocka_unit_test(sorted_reversed_and_gapped_keys_are_sorted),
    };
    return cmocka_run_group_tests_name("sort", tests, NULL, NULL);
}
