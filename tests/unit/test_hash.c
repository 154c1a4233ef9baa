/* SPDX-License-Identifier: MIT
 * test_hash.c - the hash of bytes, and CRC-32C.
 */
#include "base/base.h"
#include "helper.h"

#include <stdlib.h>

/* Pinned: state hashes in logs and tests depend on these. */
static void the_hash_is_pinned(void **state) {
    (void)state;
    unsigned char data[100];
    for (int i = 0; i < 100; i++) data[i] = (unsigned char)(i * 7 + 1);
    assert_true(jsl_hash_bytes(NULL, 0, 0) == 0x02fc033bf1daff36ull);
    assert_true(jsl_hash_bytes(data, 1, 0) == 0x34d347a2ee8d874aull);
    assert_true(jsl_hash_bytes(data, 32, 0) == 0xe9ca976da989e155ull);
    assert_true(jsl_hash_bytes(data, 100, 12345) == 0x7b23df3850d45e0dull);
}

static void the_hash_ignores_the_address(void **state) {
    (void)state;
    unsigned char data[256];
    for (int shift = 0; shift < 16; shift++) {
        for (int i = 0; i < 200; i++) data[shift + i] = (unsigned char)i;
        static const unsigned char zero[1] = {0};
        assert_true(jsl_hash_bytes(data + shift, 1, 0) == jsl_hash_bytes(zero, 1, 0));
        unsigned char other[200];
        memcpy(other, data + shift, 200);
        assert_true(jsl_hash_bytes(data + shift, 200, 9) == jsl_hash_bytes(other, 200, 9));
    }
}

static int by_value(const void *a, const void *b) {
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static void zeros_of_different_lengths_and_seeds_differ(void **state) {
    (void)state;
    static const unsigned char zero[1000];
    uint64_t hash[4000];
    for (size_t i = 0; i < 1000; i++)
        for (uint64_t seed = 0; seed < 4; seed++)
            hash[i * 4 + seed] = jsl_hash_bytes(zero, i, seed);
    qsort(hash, 4000, sizeof *hash, by_value);
    for (int i = 1; i < 4000; i++) assert_true(hash[i] != hash[i - 1]);
}

static void one_flipped_bit_changes_half_of_the_hash(void **state) {
    (void)state;
    const int sizes[] = {1, 8, 31, 32, 33, 64, 200};
    for (int s = 0; s < JSL_COUNT(sizes); s++) {
        unsigned char data[200];
        uint64_t seed = 1;
        for (int i = 0; i < 200; i++) data[i] = (unsigned char)test_random(&seed);
        uint64_t before = jsl_hash_bytes(data, (size_t)sizes[s], 0);
        double sum = 0;
        for (int bit = 0; bit < sizes[s] * 8; bit++) {
            data[bit / 8] ^= (unsigned char)(1 << bit % 8);
            int differ = __builtin_popcountll(before ^ jsl_hash_bytes(data, (size_t)sizes[s], 0));
            data[bit / 8] ^= (unsigned char)(1 << bit % 8);
            assert_in_range(differ, 8, 56);
            sum += differ;
        }
        assert_close(sum / (sizes[s] * 8), 32, 8);
    }
}

static void swapped_words_and_stripes_are_noticed(void **state) {
    (void)state;
    uint64_t word[16], seed = 3;
    for (int i = 0; i < 16; i++) word[i] = test_random(&seed);
    uint64_t before = jsl_hash_bytes(word, sizeof word, 0);
    for (int i = 0; i < 16; i++) {
        for (int j = 0; j < i; j++) {
            uint64_t t = word[i];
            word[i] = word[j], word[j] = t;
            assert_true(jsl_hash_bytes(word, sizeof word, 0) != before);
            t = word[i];
            word[i] = word[j], word[j] = t;
        }
    }
}

static void two_changed_floats_never_collide(void **state) {
    (void)state;
    enum { N = 200000 };
    float data[32] = {0};
    uint64_t *hash = malloc(N * sizeof *hash), seed = 5;
    for (int i = 0; i < N; i++) {
        data[test_random(&seed) % 32] = (float)i;
        hash[i] = jsl_hash_bytes(data, sizeof data, 0);
    }
    qsort(hash, N, sizeof *hash, by_value);
    for (int i = 1; i < N; i++) assert_true(hash[i] != hash[i - 1]);
    free(hash);
}

/* The check value of RFC 3720 and its appendix B.4. */
static void crc_matches_the_standard(void **state) {
    (void)state;
    unsigned char data[32];
    assert_int_equal(jsl_crc32c(0, "123456789", 9), 0xe3069283u);
    assert_int_equal(jsl_crc32c(0, "", 0), 0);
    memset(data, 0, 32);
    assert_int_equal(jsl_crc32c(0, data, 32), 0x8a9136aau);
    memset(data, 0xff, 32);
    assert_int_equal(jsl_crc32c(0, data, 32), 0x62a8ab43u);
    for (int i = 0; i < 32; i++) data[i] = (unsigned char)i;
    assert_int_equal(jsl_crc32c(0, data, 32), 0x46dd794eu);
}

static uint32_t crc_bit_by_bit(const unsigned char *p, size_t size) {
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < size; i++) {
        crc ^= p[i];
        for (int k = 0; k < 8; k++) crc = crc & 1 ? crc >> 1 ^ 0x82f63b78u : crc >> 1;
    }
    return ~crc;
}

static void both_crcs_agree_with_the_definition_and_may_be_continued(void **state) {
    (void)state;
    unsigned char data[300];
    uint64_t seed = 8;
    for (int i = 0; i < 300; i++) data[i] = (unsigned char)test_random(&seed);
    for (size_t size = 0; size <= 300; size++) {
        uint32_t want = crc_bit_by_bit(data, size);
        assert_int_equal(jsl_crc32c(0, data, size), want);
        assert_int_equal(jsl_crc32c_by_table(0, data, size), want);
        size_t cut = size / 3;
        assert_int_equal(jsl_crc32c(jsl_crc32c(0, data, cut), data + cut, size - cut), want);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_hash_is_pinned),
        cmocka_unit_test(the_hash_ignores_the_address),
        cmocka_unit_test(zeros_of_different_lengths_and_seeds_differ),
        cmocka_unit_test(one_flipped_bit_changes_half_of_the_hash),
        cmocka_unit_test(swapped_words_and_stripes_are_noticed),
        cmocka_unit_test(two_changed_floats_never_collide),
        cmocka_unit_test(crc_matches_the_standard),
        cmocka_unit_test(both_crcs_agree_with_the_definition_and_may_be_continued),
    };
    return cmocka_run_group_tests_name("hash", tests, NULL, NULL);
}
