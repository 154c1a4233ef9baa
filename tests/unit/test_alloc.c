/* SPDX-License-Identifier: MIT
 * test_alloc.c - memory with accounts, and growable arrays.
 */
#include "base/base.h"
#include "helper.h"

static void a_zeroed_hook_is_the_c_library(void **state) {
    (void)state;
    jsl_memory memory;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    char *p = jsl_alloc_zero(&memory, 1000);
    assert_non_null(p);
    for (int i = 0; i < 1000; i++) assert_int_equal(p[i], 0);
    jsl_free(&memory, p, 1000);
    assert_i64(memory.live_bytes, 0);
}

static void half_a_hook_is_refused(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_allocator hook = test_allocator(&test);
    jsl_memory memory;
    assert_result(jsl_memory_init(&memory, (jsl_allocator){.alloc = hook.alloc}), JSL_ERR_ARGUMENT);
    assert_result(jsl_memory_init(&memory, (jsl_allocator){.free = hook.free}), JSL_ERR_ARGUMENT);
}

static void blocks_are_aligned_and_counted(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    void *p[20];
    for (size_t i = 0; i < 20; i++) {
        p[i] = jsl_alloc(&memory, i * 13 + 1);
        assert_int_equal((uintptr_t)p[i] % JSL_ALIGN, 0);
    }
    assert_i64(memory.live_blocks, 20);
    assert_i64(memory.calls, 20);
    int64_t peak = memory.live_bytes;
    for (size_t i = 0; i < 20; i++) jsl_free(&memory, p[i], i * 13 + 1);
    assert_i64(memory.live_bytes, 0);
    assert_i64(memory.live_blocks, 0);
    assert_i64(memory.peak_bytes, peak);
    assert_no_leaks(&test);
}

static void nothing_and_the_impossible_give_null(void **state) {
    (void)state;
    jsl_memory memory;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    assert_null(jsl_alloc(&memory, 0));
    assert_null(jsl_alloc_zero(&memory, 0));
    assert_null(jsl_alloc(&memory, SIZE_MAX));
    assert_null(jsl_alloc(&memory, (size_t)PTRDIFF_MAX + 1));
    jsl_free(&memory, NULL, 0);
    assert_i64(memory.calls, 0);
}

static void a_failed_realloc_leaves_the_block_as_it_was(void **state) {
    (void)state;
    test_memory test = {.fail_at = 2};
    jsl_memory memory;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    void *p = jsl_alloc(&memory, 8);
    memcpy(p, "7 bytes", 8);
    void *before = p;
    assert_result(jsl_realloc(&memory, &p, 8, 4096), JSL_ERR_MEMORY);
    assert_ptr_equal(p, before);
    assert_i64(memory.live_bytes, 8);
    assert_ok(jsl_realloc(&memory, &p, 8, 4096));
    assert_string_equal(p, "7 bytes");
    assert_ok(jsl_realloc(&memory, &p, 4096, 2));
    assert_memory_equal(p, "7 ", 2);
    assert_ok(jsl_realloc(&memory, &p, 2, 0));
    assert_null(p);
    assert_ok(jsl_realloc(&memory, &p, 0, 16));
    jsl_free(&memory, p, 16);
    assert_no_leaks(&test);
}

static void an_array_grows_by_half_and_keeps_its_contents(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    JSL_ARRAY(int) a = {0};
    for (int i = 0; i < 100000; i++) {
        assert_ok(jsl_array_reserve(&memory, &a, a.count + 1));
        a.at[a.count++] = i;
    }
    for (int i = 0; i < 100000; i++) assert_int_equal(a.at[i], i);
    assert_true(memory.calls < 30);
    assert_result(jsl_array_reserve(&memory, &a, INT64_MAX), JSL_ERR_MEMORY);
    assert_i64(a.count, 100000);
    jsl_array_free(&memory, &a);
    assert_null(a.at);
    assert_no_leaks(&test);
}

static void a_small_array_starts_with_sixteen(void **state) {
    (void)state;
    jsl_memory memory;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    JSL_ARRAY(double) a = {0};
    assert_ok(jsl_array_reserve(&memory, &a, 0));
    assert_i64(a.cap, 0);
    assert_ok(jsl_array_reserve(&memory, &a, 1));
    assert_i64(a.cap, 16);
    jsl_array_free(&memory, &a);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_zeroed_hook_is_the_c_library),
        cmocka_unit_test(half_a_hook_is_refused),
        cmocka_unit_test(blocks_are_aligned_and_counted),
        cmocka_unit_test(nothing_and_the_impossible_give_null),
        cmocka_unit_test(a_failed_realloc_leaves_the_block_as_it_was),
        cmocka_unit_test(an_array_grows_by_half_and_keeps_its_contents),
        cmocka_unit_test(a_small_array_starts_with_sixteen),
    };
    return cmocka_run_group_tests_name("alloc", tests, NULL, NULL);
}
