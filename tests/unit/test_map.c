/* SPDX-License-Identifier: MIT
 * test_map.c - u64 -> u32.
 */
#include "base/base.h"
#include "helper.h"

#include <stdlib.h>

static void an_empty_map_finds_nothing(void **state) {
    (void)state;
    jsl_map map = {0};
    uint32_t value = 7;
    assert_false(jsl_map_get(&map, 1, &value));
    assert_false(jsl_map_remove(&map, 1));
    assert_int_equal(value, 7);
    jsl_map_clear(&map);
}

static void key_zero_is_refused(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_map map = {0};
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    assert_result(jsl_map_set(&memory, &map, 0, 1), JSL_ERR_ARGUMENT);
    assert_false(jsl_map_get(&map, 0, NULL));
    assert_false(jsl_map_remove(&map, 0));
    assert_i64(memory.calls, 0);
}

/* Beside a plain array, with keys that are few enough to be set and removed many times. */
static void a_map_agrees_with_an_array_through_random_work(void **state) {
    (void)state;
    enum { KEYS = 500, WORK = 200000 };
    test_memory test = {0};
    jsl_memory memory;
    jsl_map map = {0};
    uint32_t model[KEYS] = {0}; /* 0: absent */
    int64_t present = 0;
    uint64_t seed = 11;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    for (int i = 0; i < WORK; i++) {
        int k = (int)(test_random(&seed) % KEYS);
        uint64_t key = (uint64_t)(k + 1) * UINT64_C(0x100000001);
        if (test_random(&seed) % 2) {
            present += model[k] == 0;
            model[k] = (uint32_t)i + 1;
            assert_ok(jsl_map_set(&memory, &map, key, model[k]));
        } else {
            assert_int_equal(jsl_map_remove(&map, key), model[k] != 0);
            present -= model[k] != 0;
            model[k] = 0;
        }
        assert_i64(map.count, present);
        if (i % 1000) continue;
        for (int q = 0; q < KEYS; q++) {
            uint32_t value = 0;
            bool found = jsl_map_get(&map, (uint64_t)(q + 1) * UINT64_C(0x100000001), &value);
            assert_int_equal(found, model[q] != 0);
            assert_int_equal(value, model[q]);
        }
    }
    jsl_map_free(&memory, &map);
    assert_no_leaks(&test);
}

static void a_reserved_map_does_not_allocate_again(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    jsl_map map = {0};
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    assert_ok(jsl_map_reserve(&memory, &map, 10000));
    int64_t calls = memory.calls;
    for (uint64_t i = 1; i <= 10000; i++) assert_ok(jsl_map_set(&memory, &map, i, (uint32_t)i));
    jsl_map_clear(&map);
    assert_i64(map.count, 0);
    assert_false(jsl_map_get(&map, 1, NULL));
    for (uint64_t i = 1; i <= 10000; i++) assert_ok(jsl_map_set(&memory, &map, ~i, (uint32_t)i));
    assert_true(jsl_map_get(&map, ~77ull, NULL));
    assert_i64(memory.calls, calls);
    assert_result(jsl_map_reserve(&memory, &map, INT64_MAX), JSL_ERR_MEMORY);
    assert_i64(map.count, 10000);
    jsl_map_free(&memory, &map);
    assert_no_leaks(&test);
}

static void a_failed_growth_changes_nothing(void **state) {
    (void)state;
    for (int fail = 3; fail <= 4; fail++) {
        test_memory test = {.fail_at = fail};
        jsl_memory memory;
        jsl_map map = {0};
        assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
        jsl_result result = JSL_OK;
        uint64_t key = 0;
        while (result == JSL_OK) {
            key++;
            result = jsl_map_set(&memory, &map, key, (uint32_t)key);
        }
        assert_int_equal(result, JSL_ERR_MEMORY);
        assert_i64(map.count, (int64_t)key - 1);
        for (uint64_t k = 1; k < key; k++) {
            uint32_t value = 0;
            assert_true(jsl_map_get(&map, k, &value));
            assert_int_equal(value, k);
        }
        assert_ok(jsl_map_set(&memory, &map, key, 1));
        jsl_map_free(&memory, &map);
        assert_no_leaks(&test);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_map_finds_nothing),
        cmocka_unit_test(key_zero_is_refused),
        cmocka_unit_test(a_map_agrees_with_an_array_through_random_work),
        cmocka_unit_test(a_reserved_map_does_not_allocate_again),
        cmocka_unit_test(a_failed_growth_changes_nothing),
    };
    return cmocka_run_group_tests_name("map", tests, NULL, NULL);
}
