/* SPDX-License-Identifier: MIT
 * Queries: what matches, in what order, in what blocks.
 */
#include "ecs_fixture.h"

#define P (1u << PLACE)
#define V (1u << PACE)
#define M (1u << MIXED)
#define T (1u << TAG)

static void required_and_excluded_components_choose_tables(void **state) {
    (void)state;
    ecs_fixture f;
    fixture_open(&f);
    jsl_query early = fixture_query(&f, P, T); /* before any table exists */
    fixture_create(&f, P, 10, NULL);
    fixture_create(&f, P | V, 20, NULL);
    fixture_create(&f, P | V | T, 40, NULL);
    fixture_create(&f, V, 80, NULL);
    fixture_create(&f, 0, 160, NULL);
    assert_i64(jsl_query_count(f.ecs, early), 30);
    assert_i64(jsl_query_count(f.ecs, fixture_query(&f, P, T)), 30);
    assert_i64(jsl_query_count(f.ecs, fixture_query(&f, P, 0)), 70);
    assert_i64(jsl_query_count(f.ecs, fixture_query(&f, P | V, 0)), 60);
    assert_i64(jsl_query_count(f.ecs, fixture_query(&f, 0, P)), 240);
    assert_i64(jsl_query_count(f.ecs, fixture_query(&f, 0, 0)), 310);
    assert_i64(jsl_query_count(f.ecs, fixture_query(&f, M, 0)), 0);
    assert_i64(jsl_query_count(f.ecs, (jsl_query){0}), 0);
    assert_i64(jsl_query_count(f.ecs, (jsl_query){1000}), 0);
    fixture_close(&f);
}

static void optional_components_are_told_by_present_and_null_columns(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_rows rows;
    jsl_query query;
    fixture_open(&f);
    fixture_create(&f, V, 5, NULL);
    fixture_create(&f, P | V, 5, NULL);
    jsl_query_desc desc = {{{f.component[PLACE], JSL_READ_IF}, {f.component[PACE], JSL_WRITE}}};
    assert_ok(jsl_query_create(f.ecs, &desc, &query));
    jsl_iter it = jsl_query_begin(f.ecs, query, 0);
    assert_true(jsl_query_next(&it, &rows));
    assert_int_equal(rows.present, 2);
    assert_null(place_of(&rows, 0).x);
    assert_non_null(pace_of(&rows, 1).vx);
    assert_true(jsl_query_next(&it, &rows));
    assert_int_equal(rows.present, 3);
    assert_non_null(place_of(&rows, 0).z);
    assert_false(jsl_query_next(&it, &rows));
    assert_false(jsl_query_next(&it, &rows));
    fixture_close(&f);
}

static void tables_come_in_the_order_of_their_sets_whatever_the_history(void **state) {
    (void)state;
    for (int backwards = 0; backwards < 2; backwards++) {
        ecs_fixture f;
        jsl_rows rows;
        fixture_open(&f);
        for (unsigned i = 1; i < 64; i++) {
            unsigned mask = backwards ? 64 - i : i;
            fixture_create(&f, mask, 1, NULL);
        }
        unsigned expected = 0;
        for (jsl_iter it = jsl_query_begin(f.ecs, fixture_query(&f, 0, 0), 0);
             jsl_query_next(&it, &rows);) {
            expected++;
            for (int c = 0; c < FIXTURE_COUNT; c++)
                assert_int_equal(jsl_entity_has(f.ecs, rows.entity[0], f.component[c]),
                                 expected >> c & 1);
        }
        assert_int_equal(expected, 63);
        fixture_close(&f);
    }
}

static void blocks_cover_every_row_once_and_never_span_tables(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_rows rows;
    fixture_open(&f);
    fixture_create(&f, P, 100, NULL);
    fixture_create(&f, P | V, 33, NULL);
    fixture_create(&f, P | T, 16, NULL);
    const int64_t blocks[] = {1, 16, 17, 32, 64, 4096};
    for (int b = 0; b < JSL_COUNT(blocks); b++) {
        int64_t seen = 0, size = jsl_round_up(blocks[b], 16);
        for (jsl_iter it = jsl_query_begin(f.ecs, fixture_query(&f, P, 0), blocks[b]);
             jsl_query_next(&it, &rows);) {
            assert_true(rows.count > 0 && rows.count <= size);
            assert_int_equal(rows.begin % 16, 0);
            assert_int_equal((uintptr_t)place_of(&rows, 0).x % 64, 0);
            for (int64_t i = 0; i < rows.count; i++) place_of(&rows, 0).x[i] += 1;
            seen += rows.count;
        }
        assert_i64(seen, 149);
        for (jsl_iter it = jsl_query_begin(f.ecs, fixture_query(&f, P, 0), -5);
             jsl_query_next(&it, &rows);)
            for (int64_t i = 0; i < rows.count; i++)
                assert_true(place_of(&rows, 0).x[i] == (jsl_real)(b + 1));
    }
    fixture_close(&f);
}

static void the_same_terms_give_the_same_query_and_bad_ones_are_refused(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_query a, b;
    fixture_open(&f);
    jsl_query_desc desc = {{{f.component[PLACE], JSL_READ}}};
    assert_ok(jsl_query_create(f.ecs, &desc, &a));
    assert_ok(jsl_query_create(f.ecs, &desc, &b));
    assert_int_equal(a.id, b.id);
    desc.terms[0].access = JSL_WRITE;
    assert_ok(jsl_query_create(f.ecs, &desc, &b));
    assert_true(a.id != b.id);
    desc.terms[1] = (jsl_term){f.component[PLACE], JSL_WITHOUT};
    assert_result(jsl_query_create(f.ecs, &desc, &b), JSL_ERR_ARGUMENT);
    desc.terms[1] = (jsl_term){{0}, JSL_READ};
    assert_result(jsl_query_create(f.ecs, &desc, &b), JSL_ERR_HANDLE);
    desc.terms[1] = (jsl_term){f.component[PACE], (jsl_access)77};
    assert_result(jsl_query_create(f.ecs, &desc, &b), JSL_ERR_ARGUMENT);
    assert_result(jsl_query_create(f.ecs, NULL, &b), JSL_ERR_ARGUMENT);
    jsl_field wide[64];
    char name[64][4];
    for (int i = 0; i < 64; i++) {
        name[i][0] = 'f', name[i][1] = (char)('a' + i / 26), name[i][2] = (char)('a' + i % 26);
        name[i][3] = 0;
        wide[i] = (jsl_field){name[i], "1", JSL_TYPE_U8, JSL_STATE};
    }
    jsl_component one, two;
    assert_ok(jsl_component_register(f.ecs, &(jsl_component_desc){"one", wide, 64, 0}, &one));
    assert_ok(jsl_component_register(f.ecs, &(jsl_component_desc){"two", wide, 64, 0}, &two));
    desc = (jsl_query_desc){{{one, JSL_READ}, {two, JSL_READ}}};
    assert_result(jsl_query_create(f.ecs, &desc, &b), JSL_ERR_LIMIT);
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(required_and_excluded_components_choose_tables),
        cmocka_unit_test(optional_components_are_told_by_present_and_null_columns),
        cmocka_unit_test(tables_come_in_the_order_of_their_sets_whatever_the_history),
        cmocka_unit_test(blocks_cover_every_row_once_and_never_span_tables),
        cmocka_unit_test(the_same_terms_give_the_same_query_and_bad_ones_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
