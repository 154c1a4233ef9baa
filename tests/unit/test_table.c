/* SPDX-License-Identifier: MIT
 * Tables: alignment, padding, removal rules, order.
 */
#include "ecs_fixture.h"

#define P (1u << PLACE)
#define V (1u << PACE)
#define M (1u << MIXED)
#define R (1u << RANK)

static jsl_rows whole_table(ecs_fixture *f, unsigned with, unsigned without) {
    jsl_rows rows = {0};
    jsl_iter it = jsl_query_begin(f->ecs, fixture_query(f, with, without), 0);
    jsl_query_next(&it, &rows);
    return rows;
}

static void columns_are_aligned_and_padded_with_zeros_to_sixteen_rows(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[200];
    fixture_open(&f);
    for (int n = 1; n <= 200; n++) {
        fixture_create(&f, P | M, 1, &e[n - 1]);
        jsl_rows rows = whole_table(&f, P | M, 0);
        assert_i64(rows.count, n);
        for (int c = 0; c < 15; c++) assert_int_equal((uintptr_t)rows.column[c] % 64, 0);
        assert_int_equal((uintptr_t)rows.entity % 64, 0);
        place_columns p = place_of(&rows, 0);
        for (int i = n; i % 16; i++) assert_true(p.x[i] == 0 && p.z[i] == 0);
        for (int i = 0; i < n; i++) p.x[i] = p.z[i] = (jsl_real)NAN;
    }
    /* Removed rows leave no NaN in the padding. */
    for (int n = 199; n > 0; n -= 7) {
        assert_ok(jsl_entity_destroy_n(f.ecs, e + n - 6 * (n > 6), n > 6 ? 7 : 1));
        jsl_rows rows = whole_table(&f, P | M, 0);
        for (int64_t i = rows.count; i % 16; i++) assert_true(place_of(&rows, 0).x[i] == 0);
    }
    fixture_close(&f);
}

/* Systems may write the padding; whoever gets such a row next must not see it. */
static void a_row_that_comes_where_padding_was_written_starts_at_zero(void **state) {
    (void)state;
    static const unsigned has[] = {P | M, P};
    ecs_fixture f;
    jsl_component set[FIXTURE_COUNT];
    fixture_open(&f);
    for (int n = 0; n < 300; n++) {
        jsl_entity e;
        int way = n % 3; /* created alone, created in bulk, moved in from another table */
        if (way == 1)
            fixture_create(&f, P | M, 3, NULL);
        else
            assert_ok(jsl_entity_create(f.ecs, set, fixture_set(&f, has[way / 2], set), &e));
        if (way == 2) {
            ((jsl_real *)jsl_entity_field(f.ecs, e, f.component[PLACE], 1))[0] = 7;
            assert_ok(jsl_entity_add(f.ecs, e, &f.component[MIXED], 1));
        }
        jsl_rows rows = whole_table(&f, P | M, 0);
        place_columns p = place_of(&rows, 0);
        mixed_columns m = mixed_of(&rows, 1);
        for (int64_t i = rows.count - (way == 1 ? 3 : 1); i < rows.count; i++) {
            assert_true(p.x[i] == 0 && p.y[i] == (way == 2 ? 7 : 0) && p.z[i] == 0);
            assert_true(m.a[i] == 0 && m.b[i] == 0 && m.d[i] == 0 && m.i[i] == 0);
        }
        for (int64_t i = rows.count; i % 16; i++) {
            p.x[i] = p.y[i] = p.z[i] = (jsl_real)NAN;
            m.a[i] = 0xff, m.b[i] = -1, m.d[i] = UINT64_MAX, m.i[i] = -1;
        }
    }
    fixture_close(&f);
}

static void columns_never_start_at_the_same_place_of_a_page(void **state) {
    (void)state;
    ecs_fixture f;
    fixture_open(&f);
    for (int64_t n = 1024; n <= 65536; n *= 2) {
        fixture_create(&f, P | V, n - jsl_query_count(f.ecs, fixture_query(&f, P | V, 0)), NULL);
        jsl_rows rows = whole_table(&f, P | V, 0);
        for (int a = 0; a < 6; a++)
            for (int b = 0; b < a; b++)
                assert_true(((uintptr_t)rows.column[a] ^ (uintptr_t)rows.column[b]) & 4095);
    }
    fixture_close(&f);
}

static void removal_swaps_with_the_last_row(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[10];
    fixture_open(&f);
    fixture_create(&f, P, 10, e);
    assert_ok(jsl_entity_destroy(f.ecs, e[2]));
    jsl_rows rows = whole_table(&f, P, 0);
    assert_true(jsl_entity_equal(rows.entity[2], e[9]));
    assert_true(jsl_entity_equal(rows.entity[8], e[8]));
    fixture_close(&f);
}

static void removal_keeps_the_order_where_a_component_asks_for_it(void **state) {
    (void)state;
    ecs_fixture f;
    static jsl_entity e[5000], gone[2500];
    fixture_open(&f);
    fixture_create(&f, P | R, 5000, e);
    assert_ok(jsl_entity_destroy(f.ecs, e[2]));
    jsl_rows rows = whole_table(&f, P, 0);
    for (int i = 0; i < 4999; i++) assert_true(jsl_entity_equal(rows.entity[i], e[i + (i >= 2)]));
    int n = 0;
    for (int i = 4999; i > 0; i -= 2) gone[n++] = e[i];
    assert_ok(jsl_entity_destroy_n(f.ecs, gone, n));
    rows = whole_table(&f, P, 0);
    uint32_t last = 0;
    for (int64_t i = 0; i < rows.count; i++) {
        assert_true(rows.entity[i].index > last);
        last = rows.entity[i].index;
    }
    fixture_close(&f);
}

static void reordering_moves_rows_and_keeps_handles_and_hash(void **state) {
    (void)state;
    ecs_fixture f;
    static jsl_entity e[40000];
    static uint32_t from[40000];
    jsl_exec exec;
    fixture_open(&f);
    fixture_create(&f, P | M, 40000, e);
    fixture_fill(&f);
    uint64_t before = jsl_ecs_hash(f.ecs);
    for (uint32_t i = 0; i < 40000; i++) from[i] = (i * 7u + 3u) % 40000u;
    jsl_rows rows = whole_table(&f, P, 0);
    assert_ok(jsl_exec_init(&exec, jsl_ecs_memory(f.ecs), (jsl_tasks){0}, 4));
    int64_t calls = 0;
    for (int round = 0; round < 4; round++) {
        uint64_t revision = jsl_table_revision(f.ecs, rows.table);
        jsl_entity expected = whole_table(&f, P, 0).entity[from[17]];
        assert_ok(jsl_table_reorder(f.ecs, rows.table, from, round & 1 ? &exec : NULL));
        assert_true(jsl_table_revision(f.ecs, rows.table) > revision);
        assert_true(jsl_entity_equal(whole_table(&f, P, 0).entity[17], expected));
        assert_true(before == jsl_ecs_hash(f.ecs));
        fixture_validate(&f);
        if (round == 0) calls = f.memory.calls;
    }
    assert_i64(f.memory.calls, calls); /* the spare columns are kept */
    assert_result(jsl_table_reorder(f.ecs, 99, from, NULL), JSL_ERR_ARGUMENT);
    jsl_exec_fini(&exec, jsl_ecs_memory(f.ecs));
    fixture_close(&f);
}

static void rows_marked_dead_are_destroyed_by_the_rule_of_their_table(void **state) {
    (void)state;
    for (unsigned mask = P; mask <= (P | R); mask += R) {
        ecs_fixture f;
        jsl_entity e[100];
        uint8_t dead[100] = {0};
        fixture_open(&f);
        fixture_create(&f, mask, 100, e);
        for (int i = 0; i < 100; i += 3) dead[i] = 1;
        jsl_rows rows = whole_table(&f, P, 0);
        assert_i64(jsl_table_destroy_rows(f.ecs, rows.table, dead), 34);
        for (int i = 0; i < 100; i++)
            assert_int_equal(jsl_entity_is_alive(f.ecs, e[i]), i % 3 != 0);
        fixture_validate(&f);
        memset(dead, 1, sizeof dead);
        assert_i64(jsl_table_destroy_rows(f.ecs, rows.table, dead), 66);
        assert_i64(jsl_table_destroy_rows(f.ecs, 77, dead), 0);
        fixture_close(&f);
    }
}

static void components_are_registered_once_and_found_by_name(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_component c;
    fixture_open(&f);
    assert_int_equal(jsl_component_count(f.ecs), FIXTURE_COUNT);
    assert_ok(jsl_component_register(f.ecs, fixture_desc(MIXED), &c));
    assert_int_equal(c.id, f.component[MIXED].id);
    assert_ok(jsl_component_find(f.ecs, "pace", &c));
    assert_int_equal(c.id, f.component[PACE].id);
    assert_result(jsl_component_find(f.ecs, "nothing", &c), JSL_ERR_NAME);
    assert_string_equal(jsl_component_info(f.ecs, 2)->fields[4].unit, "K");
    assert_null(jsl_component_info(f.ecs, FIXTURE_COUNT));
    assert_null(jsl_component_info(f.ecs, -1));
    jsl_component_desc desc = *fixture_desc(PLACE);
    desc.field_count = 2;
    assert_result(jsl_component_register(f.ecs, &desc, &c), JSL_ERR_NAME);
    desc = *fixture_desc(PLACE);
    desc.keeps_order = true;
    assert_result(jsl_component_register(f.ecs, &desc, &c), JSL_ERR_NAME);
    fixture_close(&f);
}

static void bad_component_descriptions_are_refused(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_component c;
    fixture_open(&f);
    const char *names[] = {
        "", "Upper", "1st", "_x", "with space", "a-b", "a_name_that_is_longer_than_31_by"};
    for (int i = 0; i < JSL_COUNT(names); i++)
        assert_result(jsl_component_register(f.ecs, &(jsl_component_desc){.name = names[i]}, &c),
                      JSL_ERR_ARGUMENT);
    assert_result(jsl_component_register(f.ecs, &(jsl_component_desc){0}, &c), JSL_ERR_ARGUMENT);
    const jsl_field bad[][2] = {
        {{"a", "1", JSL_TYPE_COUNT, JSL_STATE}},
        {{"a", "1", JSL_TYPE_U8, JSL_ROLE_COUNT}},
        {{NULL, "1", JSL_TYPE_U8, JSL_STATE}},
        {{"a b", "1", JSL_TYPE_U8, JSL_STATE}},
        {{"a", "1", JSL_TYPE_U8, JSL_STATE}, {"a", "1", JSL_TYPE_U8, JSL_STATE}}};
    for (int i = 0; i < JSL_COUNT(bad); i++)
        assert_result(jsl_component_register(
                          f.ecs, &(jsl_component_desc){"bad", bad[i], 1 + (i == 4), 0}, &c),
                      JSL_ERR_ARGUMENT);
    assert_result(jsl_component_register(f.ecs, &(jsl_component_desc){"bad", NULL, 2, 0}, &c),
                  JSL_ERR_ARGUMENT);
    assert_result(jsl_component_register(f.ecs, &(jsl_component_desc){"bad", bad[0], 65, 0}, &c),
                  JSL_ERR_ARGUMENT);
    for (int i = FIXTURE_COUNT; i < JSL_MAX_COMPONENTS; i++) {
        char name[4] = {'n', (char)('a' + i / 26), (char)('a' + i % 26), 0};
        assert_ok(jsl_component_register(f.ecs, &(jsl_component_desc){.name = name}, &c));
    }
    assert_result(jsl_component_register(f.ecs, &(jsl_component_desc){.name = "last"}, &c),
                  JSL_ERR_LIMIT);
    jsl_component all[JSL_MAX_COMPONENTS];
    for (uint32_t i = 0; i < JSL_MAX_COMPONENTS; i++) all[i].id = i + 1;
    assert_ok(jsl_entity_create_n(f.ecs, all, JSL_MAX_COMPONENTS, 20, NULL, NULL));
    fixture_close(&f);
}

static void ten_thousand_tables_are_sound(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_component tag[14];
    fixture_open(&f);
    for (int i = 0; i < 14; i++) {
        char name[4] = {'t', (char)('a' + i), 0};
        assert_ok(jsl_component_register(f.ecs, &(jsl_component_desc){.name = name}, &tag[i]));
    }
    jsl_query all = fixture_query(&f, 0, 0);
    for (unsigned t = 0; t < 10000; t++) {
        jsl_component set[14];
        int n = 0;
        for (int i = 0; i < 14; i++)
            if ((t * 7919 % 16384) >> i & 1) set[n++] = tag[i];
        assert_ok(jsl_entity_create(f.ecs, set, n, NULL));
    }
    assert_i64(jsl_query_count(f.ecs, all), 10000);
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(columns_are_aligned_and_padded_with_zeros_to_sixteen_rows),
        cmocka_unit_test(a_row_that_comes_where_padding_was_written_starts_at_zero),
        cmocka_unit_test(columns_never_start_at_the_same_place_of_a_page),
        cmocka_unit_test(removal_swaps_with_the_last_row),
        cmocka_unit_test(removal_keeps_the_order_where_a_component_asks_for_it),
        cmocka_unit_test(reordering_moves_rows_and_keeps_handles_and_hash),
        cmocka_unit_test(rows_marked_dead_are_destroyed_by_the_rule_of_their_table),
        cmocka_unit_test(components_are_registered_once_and_found_by_name),
        cmocka_unit_test(bad_component_descriptions_are_refused),
        cmocka_unit_test(ten_thousand_tables_are_sound)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
