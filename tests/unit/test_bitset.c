/* SPDX-License-Identifier: MIT
 * test_bitset.c - growable bit sets.
 */
#include "base/base.h"
#include "helper.h"

static void a_new_set_is_empty_and_reads_past_its_end_are_zero(void **state) {
    (void)state;
    jsl_bitset set = {0};
    assert_false(jsl_bitset_get(&set, 0));
    assert_false(jsl_bitset_get(&set, 1000000));
    assert_i64(jsl_bitset_count(&set), 0);
    assert_i64(jsl_bitset_next(&set, 0), -1);
    jsl_bitset_clear(&set);
}

static void a_set_agrees_with_an_array_through_random_work(void **state) {
    (void)state;
    enum { BITS = 3000 };
    test_memory test = {0};
    jsl_memory memory;
    jsl_bitset set = {0};
    bool model[BITS] = {0};
    uint64_t seed = 31;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    for (int64_t bits = 1; bits <= BITS; bits += 37) {
        assert_ok(jsl_bitset_reserve(&memory, &set, bits));
        assert_true(set.words * 64 >= bits);
        for (int i = 0; i < 200; i++) {
            int64_t k = (int64_t)(test_random(&seed) % (uint64_t)bits);
            model[k] = test_random(&seed) % 3 == 0;
            if (model[k])
                jsl_bitset_on(&set, k);
            else
                jsl_bitset_off(&set, k);
        }
        int64_t count = 0, at = -1;
        for (int64_t k = 0; k < bits; k++) {
            assert_int_equal(jsl_bitset_get(&set, k), model[k]);
            if (!model[k]) continue;
            count++;
            at = jsl_bitset_next(&set, at + 1);
            assert_i64(at, k);
        }
        assert_i64(jsl_bitset_next(&set, at + 1), -1);
        assert_i64(jsl_bitset_count(&set), count);
    }
    jsl_bitset_clear(&set);
    assert_i64(jsl_bitset_count(&set), 0);
    jsl_bitset_free(&memory, &set);
    assert_no_leaks(&test);
}

static void the_search_stands_on_word_borders(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_bitset set = {0};
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    assert_ok(jsl_bitset_reserve(&memory, &set, 512));
    jsl_bitset_on(&set, 63);
    jsl_bitset_on(&set, 64);
    jsl_bitset_on(&set, 511);
    assert_i64(jsl_bitset_next(&set, -5), 63);
    assert_i64(jsl_bitset_next(&set, 63), 63);
    assert_i64(jsl_bitset_next(&set, 64), 64);
    assert_i64(jsl_bitset_next(&set, 65), 511);
    assert_i64(jsl_bitset_next(&set, 512), -1);
    assert_i64(jsl_bitset_next(&set, INT64_MAX), -1);
    jsl_bitset_free(&memory, &set);
}

static void a_failed_growth_changes_nothing(void **state) {
    (void)state;
    test_memory test = {.fail_at = 2};
    jsl_memory memory;
    jsl_bitset set = {0};
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    assert_ok(jsl_bitset_reserve(&memory, &set, 10));
    jsl_bitset_on(&set, 9);
    assert_result(jsl_bitset_reserve(&memory, &set, 100000), JSL_ERR_MEMORY);
    assert_result(jsl_bitset_reserve(&memory, &set, INT64_MAX), JSL_ERR_MEMORY);
    assert_i64(set.words, 8);
    assert_true(jsl_bitset_get(&set, 9));
    jsl_bitset_free(&memory, &set);
    assert_no_leaks(&test);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_set_is_empty_and_reads_past_its_end_are_zero),
        cmocka_unit_test(a_set_agrees_with_an_array_through_random_work),
        cmocka_unit_test(the_search_stands_on_word_borders),
        cmocka_unit_test(a_failed_growth_changes_nothing),
    };
    return cmocka_run_group_tests_name("bitset", tests, NULL, NULL);
}
