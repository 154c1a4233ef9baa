/* SPDX-License-Identifier: MIT
 * Entities: handles, creation, destruction, adding and removing components.
 */
#include "ecs_fixture.h"

#define P (1u << PLACE)
#define V (1u << PACE)
#define M (1u << MIXED)

static void handles_are_null_by_default_and_never_alive(void **state) {
    (void)state;
    ecs_fixture f;
    fixture_open(&f);
    jsl_entity none = {0};
    assert_true(jsl_entity_is_null(none));
    assert_false(jsl_entity_is_alive(f.ecs, none));
    assert_false(jsl_entity_is_alive(NULL, none));
    fixture_close(&f);
}

static void new_entities_have_zeroed_fields(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[100];
    jsl_rows rows;
    fixture_open(&f);
    for (int round = 0; round < 3; round++) {
        jsl_component set[] = {f.component[PACE], f.component[MIXED]};
        assert_ok(jsl_entity_create_n(f.ecs, set, 2, 100, e, &rows));
        assert_i64(rows.count, 100);
        assert_int_equal(rows.first[1], 3);
        pace_columns v = pace_of(&rows, 0);
        mixed_columns x = mixed_of(&rows, 1);
        for (int i = 0; i < 100; i++) {
            assert_true(v.vx[i] == 0 && v.vy[i] == 0 && v.vz[i] == 0);
            assert_true(x.a[i] == 0 && x.d[i] == 0 && x.f[i] == 0 && x.scratch[i] == 0);
            assert_true(jsl_entity_is_null(x.target[i]));
            assert_true(jsl_entity_equal(rows.entity[i], e[i]));
            v.vx[i] = 1, x.a[i] = 7, x.scratch[i] = 9; /* dirt for the next round */
        }
        assert_ok(jsl_entity_destroy_n(f.ecs, e, 100));
    }
    fixture_close(&f);
}

static void slots_are_reused_in_the_order_they_were_freed(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[8], again[5];
    fixture_open(&f);
    fixture_create(&f, P, 8, e);
    for (int i = 0; i < 8; i++) assert_int_equal(e[i].index, i + 1);
    assert_ok(jsl_entity_destroy(f.ecs, e[5]));
    assert_ok(jsl_entity_destroy(f.ecs, e[2]));
    assert_ok(jsl_entity_destroy_n(f.ecs, (jsl_entity[]){e[7], e[0]}, 2));
    fixture_create(&f, P, 5, again);
    const uint32_t expected[] = {6, 3, 8, 1, 9};
    for (int i = 0; i < 5; i++) assert_int_equal(again[i].index, expected[i]);
    assert_int_equal(jsl_entity_id(again[0]) >> 32, 2);
    assert_int_equal(jsl_entity_id(again[4]) >> 32, 1);
    assert_false(jsl_entity_is_alive(f.ecs, e[5]));
    assert_true(jsl_entity_equal(jsl_entity_at(f.ecs, 6), again[0]));
    assert_true(jsl_entity_is_null(jsl_entity_at(f.ecs, 10)));
    assert_true(jsl_entity_is_null(jsl_entity_at(f.ecs, 0)));
    fixture_close(&f);
}

static void a_slot_retires_when_its_generations_are_used_up(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e, first;
    fixture_open(&f);
    fixture_create(&f, 0, 1, &first);
    e = first;
    for (int i = 1; i < 0xfffff; i++) {
        assert_ok(jsl_entity_destroy(f.ecs, e));
        assert_ok(jsl_entity_create(f.ecs, NULL, 0, &e));
        assert_int_equal(e.index, 1);
    }
    assert_int_equal(e.generation & 0xfffff, 0xfffff);
    assert_ok(jsl_entity_destroy(f.ecs, e));
    assert_ok(jsl_entity_create(f.ecs, NULL, 0, &e));
    assert_int_equal(e.index, 2);
    assert_false(jsl_entity_is_alive(f.ecs, first));
    assert_false(jsl_entity_is_alive(f.ecs, (jsl_entity){1, 0}));
    fixture_close(&f);
}

/* Every public function that takes a handle. */
static void refuse(ecs_fixture *f, jsl_entity bad) {
    const jsl_component *c = f->component;
    jsl_rows rows;
    uint32_t table;
    int64_t row;
    assert_false(jsl_entity_is_alive(f->ecs, bad));
    assert_false(jsl_entity_has(f->ecs, bad, c[PLACE]));
    assert_false(jsl_entity_locate(f->ecs, bad, &table, &row));
    assert_null(jsl_entity_field(f->ecs, bad, c[PLACE], 0));
    f->log.lines = 0;
    assert_result(jsl_rows_of_entity(f->ecs, bad, c[PLACE], &rows), JSL_ERR_HANDLE);
    assert_result(jsl_entity_destroy(f->ecs, bad), JSL_ERR_HANDLE);
    assert_result(jsl_entity_add(f->ecs, bad, &c[TAG], 1), JSL_ERR_HANDLE);
    assert_result(jsl_entity_remove(f->ecs, bad, &c[PLACE], 1), JSL_ERR_HANDLE);
    assert_int_equal(f->log.lines, 4);
    jsl_entity live[5], mixed[5];
    jsl_iter it = jsl_query_begin(f->ecs, fixture_query(f, P, 0), 0);
    assert_true(jsl_query_next(&it, &rows));
    memcpy(live, rows.entity, sizeof live);
    for (int at = 0; at < 5; at += 2) {
        memcpy(mixed, live, sizeof mixed);
        mixed[at] = bad;
        assert_result(jsl_entity_destroy_n(f->ecs, mixed, 5), JSL_ERR_HANDLE);
        assert_result(jsl_entity_add_n(f->ecs, mixed, 5, &c[TAG], 1), JSL_ERR_HANDLE);
        assert_result(jsl_entity_remove_n(f->ecs, mixed, 5, &c[PLACE], 1), JSL_ERR_HANDLE);
    }
}

static void null_stale_forged_and_foreign_handles_are_refused_and_change_nothing(void **state) {
    (void)state;
    ecs_fixture f, other;
    jsl_entity e[40], foreign[3], bad[BAD_HANDLES];
    fixture_open(&f);
    fixture_open(&other);
    fixture_create(&f, P, 20, e);
    fixture_create(&f, P | M, 20, e + 20);
    fixture_fill(&f);
    fixture_create(&other, P, 3, foreign);
    assert_ok(jsl_entity_destroy(f.ecs, e[3]));
    fixture_bad_handles(&f, e[9], e[3], bad);
    uint64_t before = jsl_ecs_hash(f.ecs);
    for (int i = 0; i < BAD_HANDLES; i++) refuse(&f, bad[i]);
    refuse(&f, foreign[1]);
    jsl_entity next = {e[3].index, e[3].generation + 1}; /* what its slot will give out next */
    refuse(&f, next);
    assert_true(before == jsl_ecs_hash(f.ecs));
    assert_i64(jsl_entity_count(f.ecs), 39);
    jsl_entity twice[] = {e[1], e[2], e[1]};
    assert_result(jsl_entity_destroy_n(f.ecs, twice, 3), JSL_ERR_HANDLE);
    assert_true(before == jsl_ecs_hash(f.ecs));
    fixture_close(&f);
    fixture_close(&other);
}

static void bad_arguments_are_refused_and_change_nothing(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[2], out;
    jsl_rows rows;
    fixture_open(&f);
    fixture_create(&f, P, 2, e);
    uint64_t before = jsl_ecs_hash(f.ecs);
    jsl_component none = {0}, unknown = {60};
    jsl_component twice[] = {f.component[PACE], f.component[PACE]};
    assert_result(jsl_entity_create(f.ecs, &none, 1, &out), JSL_ERR_HANDLE);
    assert_result(jsl_entity_create(f.ecs, &unknown, 1, &out), JSL_ERR_HANDLE);
    assert_result(jsl_entity_create(f.ecs, twice, 2, &out), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_create(f.ecs, NULL, 1, &out), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_create(f.ecs, twice, -1, &out), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_create(NULL, twice, 1, &out), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_create_n(f.ecs, twice, 1, -1, NULL, NULL), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_create_n(f.ecs, twice, 1, INT64_MAX, NULL, NULL), JSL_ERR_LIMIT);
    assert_result(jsl_entity_reserve(f.ecs, twice, 1, -5), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_destroy_n(f.ecs, NULL, 2), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_destroy_n(f.ecs, e, -2), JSL_ERR_ARGUMENT);
    assert_result(jsl_entity_add(f.ecs, e[0], &unknown, 1), JSL_ERR_HANDLE);
    assert_result(jsl_entity_add_n(f.ecs, NULL, 2, twice, 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_rows_of_entity(f.ecs, e[0], f.component[PACE], &rows), JSL_ERR_NAME);
    assert_result(jsl_rows_of_entity(f.ecs, e[0], unknown, &rows), JSL_ERR_HANDLE);
    assert_result(jsl_entity_destroy_where(f.ecs, (jsl_query){9}, NULL, NULL, NULL),
                  JSL_ERR_HANDLE);
    assert_result(jsl_entity_add_where(f.ecs, (jsl_query){0}, twice, 1, NULL), JSL_ERR_HANDLE);
    assert_null(jsl_entity_field(f.ecs, e[0], f.component[PLACE], 3));
    assert_null(jsl_entity_field(f.ecs, e[0], f.component[PLACE], -1));
    assert_null(jsl_entity_field(f.ecs, e[0], f.component[PACE], 0));
    assert_true(before == jsl_ecs_hash(f.ecs));
    fixture_close(&f);
}

static void adding_and_removing_keeps_what_stays_and_zeroes_what_comes(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[30];
    fixture_open(&f);
    fixture_create(&f, P, 30, e);
    fixture_fill(&f);
    jsl_real x = *(jsl_real *)jsl_entity_field(f.ecs, e[11], f.component[PLACE], 0);
    uint64_t before = jsl_ecs_hash(f.ecs);
    assert_ok(jsl_entity_add(f.ecs, e[11], &f.component[PLACE], 1)); /* is there: nothing */
    assert_ok(jsl_entity_remove(f.ecs, e[11], &f.component[MIXED], 1));
    assert_true(before == jsl_ecs_hash(f.ecs));
    assert_ok(jsl_entity_add(f.ecs, e[11], &f.component[PACE], 1));
    assert_true(jsl_entity_has(f.ecs, e[11], f.component[PACE]));
    assert_true(*(jsl_real *)jsl_entity_field(f.ecs, e[11], f.component[PLACE], 0) == x);
    assert_true(*(jsl_real *)jsl_entity_field(f.ecs, e[11], f.component[PACE], 2) == 0);
    assert_ok(jsl_entity_remove(f.ecs, e[11], &f.component[PACE], 1));
    assert_true(before == jsl_ecs_hash(f.ecs));
    assert_ok(jsl_entity_add_n(f.ecs, e, 30, &f.component[MIXED], 1));
    assert_ok(jsl_entity_remove_n(f.ecs, e, 30, &f.component[MIXED], 1));
    assert_true(before == jsl_ecs_hash(f.ecs));
    int64_t moved;
    assert_ok(jsl_entity_add_where(f.ecs, fixture_query(&f, P, 0), &f.component[TAG], 1, &moved));
    assert_i64(moved, 30);
    assert_ok(
        jsl_entity_remove_where(f.ecs, fixture_query(&f, P, 0), &f.component[TAG], 1, &moved));
    assert_i64(moved, 30);
    assert_true(before == jsl_ecs_hash(f.ecs));
    fixture_close(&f);
}

static void a_reserved_set_grows_without_allocating(void **state) {
    (void)state;
    ecs_fixture f;
    fixture_open(&f);
    jsl_component set[] = {f.component[PLACE], f.component[PACE]};
    assert_ok(jsl_entity_reserve(f.ecs, set, 2, 5000));
    int64_t calls = f.memory.calls;
    for (int i = 0; i < 5000; i++) assert_ok(jsl_entity_create(f.ecs, set, 2, NULL));
    assert_i64(f.memory.calls, calls);
    fixture_close(&f);
}

static void one_entity_is_seen_through_rows_and_fields(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[5];
    jsl_rows rows;
    fixture_open(&f);
    fixture_create(&f, P | V, 5, e);
    assert_ok(jsl_rows_of_entity(f.ecs, e[3], f.component[PACE], &rows));
    assert_i64(rows.count, 1);
    assert_i64(rows.begin, 3);
    assert_true(jsl_entity_equal(rows.entity[0], e[3]));
    pace_of(&rows, 0).vy[0] = 5;
    assert_true(*(jsl_real *)jsl_entity_field(f.ecs, e[3], f.component[PACE], 1) == 5);
    fixture_close(&f);
}

static void too_many_columns_to_see_at_once_are_refused_with_a_limit(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_component set[13];
    jsl_rows rows;
    fixture_open(&f);
    for (int i = 0; i < 13; i++) {
        char name[4] = {'c', (char)('a' + i), 0};
        assert_ok(jsl_component_register(f.ecs, &(jsl_component_desc){.name = name}, &set[i]));
    }
    assert_result(jsl_entity_create_n(f.ecs, set, 13, 1, NULL, &rows), JSL_ERR_LIMIT);
    assert_i64(jsl_entity_count(f.ecs), 0);
    assert_ok(jsl_entity_create_n(f.ecs, set, 13, 1, NULL, NULL));
    assert_ok(jsl_entity_create_n(f.ecs, set, 12, 1, NULL, &rows));
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(handles_are_null_by_default_and_never_alive),
        cmocka_unit_test(new_entities_have_zeroed_fields),
        cmocka_unit_test(slots_are_reused_in_the_order_they_were_freed),
        cmocka_unit_test(a_slot_retires_when_its_generations_are_used_up),
        cmocka_unit_test(null_stale_forged_and_foreign_handles_are_refused_and_change_nothing),
        cmocka_unit_test(bad_arguments_are_refused_and_change_nothing),
        cmocka_unit_test(adding_and_removing_keeps_what_stays_and_zeroes_what_comes),
        cmocka_unit_test(a_reserved_set_grows_without_allocating),
        cmocka_unit_test(one_entity_is_seen_through_rows_and_fields),
        cmocka_unit_test(too_many_columns_to_see_at_once_are_refused_with_a_limit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
