/* SPDX-License-Identifier: MIT
 * The tree against brute force.
 */
#include "helper.h"

#include "geometry/geometry.h"

typedef struct fixture {
    test_memory counted;
    jsl_memory memory;
    jsl_bvh bvh;
    jsl_pair_array pairs;
    jsl_aabb *box;
    int count;
} fixture;

static void open_fixture(fixture *f, int count) {
    *f = (fixture){.count = count};
    assert_ok(jsl_memory_init(&f->memory, test_allocator(&f->counted)));
    f->box = test_malloc((size_t)(count + 1) * sizeof *f->box);
}
static void close_fixture(fixture *f) {
    jsl_bvh_free(&f->memory, &f->bvh);
    jsl_array_free(&f->memory, &f->pairs);
    test_free(f->box);
    assert_no_leaks(&f->counted);
}

static void random_boxes(fixture *f, uint64_t *seed, double spread, double size) {
    for (int i = 0; i < f->count; i++) {
        for (int k = 0; k < 3; k++) {
            double c = test_uniform(seed, -spread, spread), h = test_uniform(seed, 0, size);
            (&f->box[i].lo.x)[k] = (jsl_real)(c - h);
            (&f->box[i].hi.x)[k] = (jsl_real)(c + h);
        }
    }
}

/* All pairs in order of (a, b), as the contract says. */
static void check_pairs(fixture *f) {
    f->pairs.count = 0;
    assert_ok(jsl_bvh_pairs(&f->memory, &f->bvh, f->box, f->count, &f->pairs));
    int64_t at = 0;
    for (int a = 0; a < f->count; a++) {
        for (int b = a + 1; b < f->count; b++) {
            if (!jsl_aabb_meet(f->box[a], f->box[b])) continue;
            assert_true(at < f->pairs.count);
            assert_i64(f->pairs.at[at].a, a);
            assert_i64(f->pairs.at[at].b, b);
            at++;
        }
    }
    assert_i64(at, f->pairs.count);
}

static void check_overlap(fixture *f, jsl_aabb query) {
    int32_t *item = test_malloc((size_t)(f->count + 1) * sizeof *item);
    char *seen = test_calloc((size_t)f->count + 1, 1);
    int64_t n = jsl_bvh_overlap(&f->bvh, query, item, f->count), want = 0;
    for (int i = 0; i < f->count; i++) want += jsl_aabb_meet(f->box[i], query);
    assert_i64(n, want);
    for (int64_t i = 0; i < n; i++) {
        assert_false(seen[item[i]]);
        seen[item[i]] = 1;
        assert_true(jsl_aabb_meet(f->box[item[i]], query));
    }
    /* A short buffer gets the first ones, and still the count of all. */
    int32_t few[3] = {-7, -7, -7};
    assert_i64(jsl_bvh_overlap(&f->bvh, query, few, 2), want);
    for (int i = 0; i < 2 && i < n; i++) assert_i64(few[i], item[i]);
    assert_i64(few[2], -7);
    test_free(item);
    test_free(seen);
}

static void pairs_and_overlaps_equal_brute_force(void **state) {
    (void)state;
    static const int counts[] = {0, 1, 2, 3, 4, 5, 17, 100, 1000};
    uint64_t seed = 5;
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        for (int round = 0; round < 3; round++) {
            fixture f;
            open_fixture(&f, counts[c]);
            random_boxes(&f, &seed, 10, round == 0 ? 0 : round == 1 ? 0.5 : 3);
            assert_ok(jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count));
            check_pairs(&f);
            for (int q = 0; q < 20; q++) {
                double x = test_uniform(&seed, -11, 11), h = test_uniform(&seed, 0, 6);
                jsl_real lo = (jsl_real)(x - h), hi = (jsl_real)(x + h);
                check_overlap(&f, (jsl_aabb){{lo, lo, -3}, {hi, hi, 3}});
            }
            close_fixture(&f);
        }
    }
}

static void refitted_trees_answer_like_fresh_ones(void **state) {
    (void)state;
    uint64_t seed = 6;
    fixture f;
    open_fixture(&f, 500);
    random_boxes(&f, &seed, 10, 0.7);
    assert_ok(jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count));
    for (int round = 0; round < 5; round++) {
        random_boxes(&f, &seed, 10, 0.7);
        jsl_bvh_refit(&f.bvh, f.box, f.count);
        check_pairs(&f);
        check_overlap(&f, (jsl_aabb){{-2, -2, -2}, {4, 4, 4}});
    }
    close_fixture(&f);
}

static int depth_of(const jsl_bvh *bvh, int32_t node) {
    const jsl_bvh_node *n = &bvh->node.at[node];
    if (n->left < 0) return 1;
    int l = depth_of(bvh, n->left), r = depth_of(bvh, n->right);
    return 1 + (l > r ? l : r);
}

static void the_tree_stays_shallow_whatever_the_boxes(void **state) {
    (void)state;
    /* Centres in geometric progression peel off one by one under any split by area; equal ones
     * cannot be told apart. */
    for (int kind = 0; kind < 3; kind++) {
        fixture f;
        open_fixture(&f, 3000);
        double x = 1e30;
        for (int i = 0; i < f.count; i++) {
            double c = kind == 0 ? x : kind == 1 ? 1 : i;
            x *= 0.955;
            f.box[i] = (jsl_aabb){{(jsl_real)c, 0, 0}, {(jsl_real)c, 0, 0}};
        }
        assert_ok(jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count));
        assert_true(depth_of(&f.bvh, 0) <= 72);
        if (kind != 1) check_pairs(&f);
        check_overlap(&f, (jsl_aabb){{-1, -1, -1}, {2, 1, 1}});
        close_fixture(&f);
    }
}

static void two_hundred_boxes_at_one_point_make_every_pair_once(void **state) {
    (void)state;
    fixture f;
    open_fixture(&f, 200);
    for (int i = 0; i < f.count; i++) f.box[i] = (jsl_aabb){{1, 1, 1}, {2, 2, 2}};
    assert_ok(jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count));
    check_pairs(&f);
    assert_i64(f.pairs.count, 200 * 199 / 2);
    close_fixture(&f);
}

static void pairs_are_appended_behind_what_the_array_holds(void **state) {
    (void)state;
    fixture f;
    open_fixture(&f, 2);
    f.box[0] = f.box[1] = (jsl_aabb){{0, 0, 0}, {1, 1, 1}};
    assert_ok(jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count));
    assert_ok(jsl_array_reserve(&f.memory, &f.pairs, 1));
    f.pairs.at[f.pairs.count++] = (jsl_pair){70, 80};
    assert_ok(jsl_bvh_pairs(&f.memory, &f.bvh, f.box, f.count, &f.pairs));
    assert_i64(f.pairs.count, 2);
    assert_i64(f.pairs.at[0].a, 70);
    assert_i64(f.pairs.at[1].b, 1);
    close_fixture(&f);
}

static void a_second_step_allocates_nothing(void **state) {
    (void)state;
    uint64_t seed = 8;
    fixture f;
    open_fixture(&f, 800);
    random_boxes(&f, &seed, 10, 0.8);
    for (int round = 0; round < 3; round++) {
        int64_t calls = f.memory.calls;
        assert_ok(jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count));
        f.pairs.count = 0;
        assert_ok(jsl_bvh_pairs(&f.memory, &f.bvh, f.box, f.count, &f.pairs));
        if (round > 0) assert_i64(f.memory.calls, calls);
    }
    close_fixture(&f);
}

static void lack_of_memory_is_reported_and_leaves_the_pairs_alone(void **state) {
    (void)state;
    for (int fail = 1; fail < 12; fail++) {
        uint64_t seed = 9;
        fixture f;
        open_fixture(&f, 300);
        random_boxes(&f, &seed, 3, 1);
        f.counted.fail_at = fail;
        f.counted.fail_on = true;
        jsl_result r = jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count);
        if (r == JSL_OK) {
            r = jsl_bvh_pairs(&f.memory, &f.bvh, f.box, f.count, &f.pairs);
            if (r != JSL_OK) assert_i64(f.pairs.count, 0);
        }
        if (f.counted.failures > 0) assert_result(r, JSL_ERR_MEMORY);
        f.counted.fail_at = 0;
        f.counted.fail_on = false;
        close_fixture(&f);
    }
}

static void boxes_that_are_not_numbers_do_no_harm(void **state) {
    (void)state;
    uint64_t seed = 10;
    fixture f;
    open_fixture(&f, 600);
    for (int kind = 0; kind < 3; kind++) {
        random_boxes(&f, &seed, 5, 0.5);
        for (int i = kind; i < f.count; i += 1 + kind) {
            jsl_real bad = (jsl_real)(i % 2 ? NAN : INFINITY);
            f.box[i].lo.x = i % 3 ? bad : -bad;
            f.box[i].hi.x = bad;
        }
        assert_ok(jsl_bvh_build(&f.memory, &f.bvh, f.box, f.count));
        char seen[600] = {0};
        for (int64_t i = 0; i < f.bvh.node.count; i++) {
            int32_t item = -1 - f.bvh.node.at[i].left;
            if (item >= 0) assert_int_equal(seen[item]++, 0);
        }
        for (int i = 0; i < f.count; i++) assert_int_equal(seen[i], 1);
        assert_true(depth_of(&f.bvh, 0) <= 72);
        f.pairs.count = 0;
        assert_ok(jsl_bvh_pairs(&f.memory, &f.bvh, f.box, f.count, &f.pairs));
    }
    close_fixture(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_and_overlaps_equal_brute_force),
        cmocka_unit_test(refitted_trees_answer_like_fresh_ones),
        cmocka_unit_test(the_tree_stays_shallow_whatever_the_boxes),
        cmocka_unit_test(two_hundred_boxes_at_one_point_make_every_pair_once),
        cmocka_unit_test(pairs_are_appended_behind_what_the_array_holds),
        cmocka_unit_test(a_second_step_allocates_nothing),
        cmocka_unit_test(boxes_that_are_not_numbers_do_no_harm),
        cmocka_unit_test(lack_of_memory_is_reported_and_leaves_the_pairs_alone),
    };
    return cmocka_run_group_tests_name("bvh", tests, NULL, NULL);
}
