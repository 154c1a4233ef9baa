/* SPDX-License-Identifier: MIT
 * test_arena.c - one step's scratch.
 */
#include "base/base.h"
#include "helper.h"

static void every_piece_is_aligned_and_its_own(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    jsl_arena_init(&arena, &memory);
    unsigned char *piece[300];
    for (int i = 0; i < 300; i++) {
        piece[i] = jsl_arena_alloc(&arena, i * 37 + 1);
        assert_int_equal((uintptr_t)piece[i] % JSL_ALIGN, 0);
        memset(piece[i], i & 255, (size_t)i * 37 + 1);
    }
    for (int i = 0; i < 300; i++)
        for (int k = 0; k < i * 37 + 1; k++) assert_int_equal(piece[i][k], i & 255);
    jsl_arena_fini(&arena);
    assert_no_leaks(&test);
}

static void nothing_is_not_a_failure_but_too_much_is(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    jsl_arena_init(&arena, &memory);
    assert_non_null(jsl_arena_alloc(&arena, 0));
    assert_non_null(jsl_arena_zero(&arena, 0));
    assert_null(jsl_arena_alloc(&arena, -1));
    assert_null(jsl_arena_alloc(&arena, INT64_MAX));
    assert_i64(memory.calls, 0);
    jsl_arena_fini(&arena);
}

static void zero_pieces_are_zero_even_when_used_before(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    jsl_arena_init(&arena, &memory);
    memset(jsl_arena_alloc(&arena, 1000), 0xff, 1000);
    jsl_arena_reset(&arena);
    unsigned char *p = jsl_arena_zero(&arena, 1000);
    for (int i = 0; i < 1000; i++) assert_int_equal(p[i], 0);
    jsl_arena_fini(&arena);
}

static void an_arena_reset_keeps_one_block_as_large_as_the_peak(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    jsl_arena_init(&arena, &memory);
    for (int i = 0; i < 1000; i++) assert_non_null(jsl_arena_alloc(&arena, 1001));
    assert_true(memory.live_blocks > 1);
    assert_i64(arena.peak, 1000 * 1024);
    jsl_arena_reset(&arena);
    assert_i64(memory.live_blocks, 1);
    assert_i64(arena.used, 0);
    int64_t calls = memory.calls;
    for (int step = 0; step < 10; step++) {
        for (int i = 0; i < 1000; i++) assert_non_null(jsl_arena_alloc(&arena, 1001));
        jsl_arena_reset(&arena);
    }
    assert_i64(memory.calls, calls);
    jsl_arena_fini(&arena);
    assert_no_leaks(&test);
}

static void a_slowly_growing_peak_costs_few_allocations(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    jsl_arena_init(&arena, &memory);
    for (int step = 0; step < 10000; step++) {
        for (int i = 0; i < 10; i++) assert_non_null(jsl_arena_alloc(&arena, step * 64));
        jsl_arena_reset(&arena);
    }
    assert_true(memory.calls < 40);
    jsl_arena_fini(&arena);
}

static void a_rewind_gives_back_across_blocks_and_reuses_them(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    jsl_arena_init(&arena, &memory);
    jsl_arena_mark empty = jsl_arena_save(&arena);
    char *kept = jsl_arena_alloc(&arena, 100);
    memset(kept, 7, 100);
    jsl_arena_mark mark = jsl_arena_save(&arena);
    int64_t calls = 0;
    for (int round = 0; round < 20; round++) {
        for (int i = 0; i < 64; i++) memset(jsl_arena_alloc(&arena, 9000), round, 9000);
        if (round == 0) calls = memory.calls;
        jsl_arena_rewind(&arena, mark);
        assert_i64(arena.used, 128);
    }
    assert_i64(memory.calls, calls);
    for (int i = 0; i < 100; i++) assert_int_equal(kept[i], 7);
    jsl_arena_rewind(&arena, empty);
    assert_i64(arena.used, 0);
    assert_ptr_equal(jsl_arena_alloc(&arena, 100), kept);
    jsl_arena_fini(&arena);
    assert_no_leaks(&test);
}

static void an_emptied_block_that_is_too_small_is_passed_over(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    jsl_arena_init(&arena, &memory);
    jsl_arena_alloc(&arena, 60000);
    jsl_arena_mark mark = jsl_arena_save(&arena);
    jsl_arena_alloc(&arena, 60000);
    jsl_arena_rewind(&arena, mark);
    char *large = jsl_arena_alloc(&arena, 3 << 20);
    memset(large, 1, 3 << 20);
    char *small = jsl_arena_alloc(&arena, 1 << 20);
    memset(small, 2, 1 << 20);
    assert_int_equal(large[0], 1);
    assert_int_equal(large[(3 << 20) - 1], 1);
    jsl_arena_rewind(&arena, mark);
    jsl_arena_reset(&arena);
    assert_i64(memory.live_blocks, 1);
    jsl_arena_fini(&arena);
    assert_no_leaks(&test);
}

static void out_of_memory_leaves_the_arena_usable(void **state) {
    (void)state;
    for (int fail = 1; fail < 8; fail++) {
        test_memory test = {.fail_at = fail};
        jsl_memory memory;
        jsl_arena arena;
        assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
        jsl_arena_init(&arena, &memory);
        for (int step = 0; step < 3; step++) {
            for (int i = 0; i < 50; i++) {
                char *p = jsl_arena_alloc(&arena, 20000);
                if (p) memset(p, i, 20000);
            }
            jsl_arena_reset(&arena);
        }
        assert_non_null(jsl_arena_alloc(&arena, 20000));
        jsl_arena_fini(&arena);
        assert_no_leaks(&test);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_piece_is_aligned_and_its_own),
        cmocka_unit_test(nothing_is_not_a_failure_but_too_much_is),
        cmocka_unit_test(zero_pieces_are_zero_even_when_used_before),
        cmocka_unit_test(an_arena_reset_keeps_one_block_as_large_as_the_peak),
        cmocka_unit_test(a_slowly_growing_peak_costs_few_allocations),
        cmocka_unit_test(a_rewind_gives_back_across_blocks_and_reuses_them),
        cmocka_unit_test(an_emptied_block_that_is_too_small_is_passed_over),
        cmocka_unit_test(out_of_memory_leaves_the_arena_usable),
    };
    return cmocka_run_group_tests_name("arena", tests, NULL, NULL);
}
