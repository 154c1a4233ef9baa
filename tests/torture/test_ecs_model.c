/* SPDX-License-Identifier: MIT
 * Random operations against a model so naive that it must be right: one struct an entity.
 * JSL_TEST_SEED and JSL_TEST_N choose the seed and the number of operations.
 */
#include "ecs_fixture.h"

#include <stdio.h>
#include <stdlib.h>

#define MAX_ENTITIES 6000 /* live at once */
#define MAX_FIELDS 12
#define ALL ((1u << FIXTURE_COUNT) - 1)
#define ORDERED (1u << MIXED | 1u << RANK)

typedef struct model_entity {
    jsl_entity handle;
    unsigned mask;
    uint64_t arrival; /* when it came into its table: rows of ordered tables rise in it */
    uint64_t value[FIXTURE_COUNT][MAX_FIELDS]; /* raw bits */
} model_entity;

typedef struct model {
    ecs_fixture f;
    model_entity *at;
    int64_t count;
    int32_t *of_index; /* handle.index -> place in at, or -1 */
    int64_t indices;
    uint64_t random, clock;
    jsl_entity dead[64]; /* some that have died */
    int64_t deaths;
    jsl_query everything, with_place, with_mixed;
    uint64_t step;
} model;

static uint64_t pick(model *m, uint64_t n) { return test_random(&m->random) % n; }

/* -- The model itself ---------------------------------------------------------- */

static model_entity *find(model *m, jsl_entity e) {
    if (e.index >= m->indices || m->of_index[e.index] < 0) return NULL;
    model_entity *x = &m->at[m->of_index[e.index]];
    return jsl_entity_equal(x->handle, e) ? x : NULL;
}

static void note(model *m, jsl_entity e, int32_t place) {
    if (e.index >= m->indices) {
        int64_t n = e.index * 2 + 16;
        m->of_index = realloc(m->of_index, (size_t)n * sizeof *m->of_index);
        assert_non_null(m->of_index);
        for (int64_t i = m->indices; i < n; i++) m->of_index[i] = -1;
        m->indices = n;
    }
    m->of_index[e.index] = place;
}

static model_entity *born(model *m, jsl_entity e, unsigned mask) {
    assert_true(m->count < MAX_ENTITIES * 2);
    assert_null(find(m, e));
    model_entity *x = &m->at[m->count];
    *x = (model_entity){.handle = e, .mask = mask, .arrival = ++m->clock};
    note(m, e, (int32_t)m->count++);
    return x;
}

static void died(model *m, jsl_entity e) {
    model_entity *x = find(m, e);
    assert_non_null(x);
    m->dead[m->deaths++ % 64] = e;
    note(m, e, -1);
    *x = m->at[--m->count];
    if (x != &m->at[m->count]) note(m, x->handle, (int32_t)(x - m->at));
}

static void changed(model *m, jsl_entity e, unsigned mask) {
    model_entity *x = find(m, e);
    assert_non_null(x);
    if (x->mask == mask) return;
    for (int c = 0; c < FIXTURE_COUNT; c++)
        if (!(mask >> c & 1)) memset(x->value[c], 0, sizeof x->value[c]);
    x->mask = mask;
    x->arrival = ++m->clock;
}

static jsl_entity any(model *m) { return m->at[pick(m, (uint64_t)m->count)].handle; }

/* -- Comparing --------------------------------------------------------------------- */

static void compare_entity(model *m, const model_entity *x) {
    assert_true(jsl_entity_is_alive(m->f.ecs, x->handle));
    for (int c = 0; c < FIXTURE_COUNT; c++) {
        const jsl_component_desc *desc = fixture_desc(c);
        bool has = x->mask >> c & 1;
        assert_int_equal(jsl_entity_has(m->f.ecs, x->handle, m->f.component[c]), has);
        for (int k = 0; k < desc->field_count; k++) {
            void *at = jsl_entity_field(m->f.ecs, x->handle, m->f.component[c], k);
            assert_int_equal(at != NULL, has);
            if (has && memcmp(at, &x->value[c][k], (size_t)jsl_type_size(desc->fields[k].type)))
                fail_msg("entity %u: %s.%s differs", x->handle.index, desc->name,
                         desc->fields[k].name);
        }
    }
}

static void compare(model *m) {
    fixture_validate(&m->f);
    assert_i64(jsl_entity_count(m->f.ecs), m->count);
    for (int64_t i = 0; i < m->count; i++) compare_entity(m, &m->at[i]);
    for (int64_t i = 0; i < 64 && i < m->deaths; i++)
        assert_false(jsl_entity_is_alive(m->f.ecs, m->dead[i]));
    jsl_rows rows;
    int64_t seen = 0;
    for (jsl_iter it = jsl_query_begin(m->f.ecs, m->everything, 0); jsl_query_next(&it, &rows);) {
        uint64_t last = 0;
        unsigned mask = find(m, rows.entity[0])->mask;
        for (int64_t i = 0; i < rows.count; i++) {
            const model_entity *x = find(m, rows.entity[i]);
            assert_non_null(x);
            assert_int_equal(x->mask, mask);
            if (mask & ORDERED && x->arrival <= last) fail_msg("table %x lost its order", mask);
            last = x->arrival;
        }
        seen += rows.count;
    }
    assert_i64(seen, m->count);
}

/* -- Operations ---------------------------------------------------------------------- */

static void op_create(model *m) {
    jsl_entity out[64];
    jsl_component set[FIXTURE_COUNT];
    unsigned mask = (unsigned)pick(m, ALL + 1);
    int64_t n = pick(m, 4) ? 1 : (int64_t)pick(m, 64);
    if (m->count + n > MAX_ENTITIES) return;
    int sets = fixture_set(&m->f, mask, set);
    if (n == 1 && pick(m, 2))
        assert_ok(jsl_entity_create(m->f.ecs, set, sets, out));
    else
        assert_ok(jsl_entity_create_n(m->f.ecs, set, sets, n, out, NULL));
    for (int64_t i = 0; i < n; i++) born(m, out[i], mask);
}

static void op_destroy(model *m) {
    if (m->count == 0) return;
    jsl_entity e = any(m);
    assert_ok(jsl_entity_destroy(m->f.ecs, e));
    died(m, e);
}

/* Distinct live handles; returns their number. */
static int64_t some(model *m, jsl_entity *out, int64_t n) {
    int64_t k = 0;
    if (m->count == 0) return 0;
    int64_t start = (int64_t)pick(m, (uint64_t)m->count);
    for (int64_t i = 0; i < n && i < m->count; i++) out[k++] = m->at[(start + i) % m->count].handle;
    for (int64_t i = k - 1; i > 0; i--) {
        int64_t j = (int64_t)pick(m, (uint64_t)i + 1);
        jsl_entity t = out[i];
        out[i] = out[j];
        out[j] = t;
    }
    return k;
}

static void op_destroy_n(model *m) {
    jsl_entity e[2000];
    int64_t n = some(m, e, (int64_t)pick(m, pick(m, 20) ? 40 : 1500));
    if (n > 2 && pick(m, 4) == 0) { /* one bad handle, and none dies */
        jsl_entity kept = e[n - 1];
        e[n - 1] = pick(m, 2) ? e[0] : m->dead[pick(m, 64)];
        assert_result(jsl_entity_destroy_n(m->f.ecs, e, n), JSL_ERR_HANDLE);
        e[n - 1] = kept;
        assert_true(jsl_entity_is_alive(m->f.ecs, kept));
    }
    assert_ok(jsl_entity_destroy_n(m->f.ecs, e, n));
    for (int64_t i = 0; i < n; i++) died(m, e[i]);
}

static bool doomed(uint64_t step, jsl_entity e) {
    return jsl_mix64(jsl_entity_id(e) * 31 + step) % 100 < 15;
}

static void mark_doomed(const jsl_rows *rows, uint8_t *dead, void *arg) {
    model *m = arg;
    for (int64_t i = 0; i < rows->count; i++) dead[i] = doomed(m->step, rows->entity[i]);
    assert_result(jsl_entity_destroy(m->f.ecs, rows->entity[0]), JSL_ERR_STATE);
}

static void op_destroy_where(model *m) {
    int64_t gone, expected = 0;
    assert_ok(jsl_entity_destroy_where(m->f.ecs, m->with_mixed, mark_doomed, m, &gone));
    for (int64_t i = m->count - 1; i >= 0; i--) {
        if (!(m->at[i].mask >> MIXED & 1) || !doomed(m->step, m->at[i].handle)) continue;
        died(m, m->at[i].handle);
        expected++;
    }
    assert_i64(gone, expected);
}

static void op_change(model *m) {
    jsl_component set[FIXTURE_COUNT];
    if (m->count == 0) return;
    jsl_entity e = any(m);
    unsigned mask = 1u << pick(m, FIXTURE_COUNT) | 1u << pick(m, FIXTURE_COUNT);
    int n = fixture_set(&m->f, mask, set);
    unsigned old = find(m, e)->mask;
    bool add = pick(m, 2);
    assert_ok(add ? jsl_entity_add(m->f.ecs, e, set, n) : jsl_entity_remove(m->f.ecs, e, set, n));
    changed(m, e, add ? old | mask : old & ~mask);
}

static void op_change_n(model *m) {
    jsl_entity e[2000];
    jsl_component set[FIXTURE_COUNT];
    unsigned mask = 1u << pick(m, FIXTURE_COUNT);
    int sets = fixture_set(&m->f, mask, set);
    int64_t n = some(m, e, (int64_t)pick(m, pick(m, 20) ? 40 : 1500));
    bool add = pick(m, 2);
    if (n > 2 && pick(m, 2)) e[n - 1] = e[0]; /* repeated handles move once */
    if (n > 2 && pick(m, 4) == 0) {
        jsl_entity kept = e[1];
        e[1] = m->dead[pick(m, 64)];
        assert_result(add ? jsl_entity_add_n(m->f.ecs, e, n, set, sets)
                          : jsl_entity_remove_n(m->f.ecs, e, n, set, sets),
                      JSL_ERR_HANDLE);
        e[1] = kept;
    }
    assert_ok(add ? jsl_entity_add_n(m->f.ecs, e, n, set, sets)
                  : jsl_entity_remove_n(m->f.ecs, e, n, set, sets));
    for (int64_t i = 0; i < n; i++) {
        unsigned old = find(m, e[i])->mask;
        changed(m, e[i], add ? old | mask : old & ~mask);
    }
}

static void op_change_where(model *m) {
    static jsl_entity order[MAX_ENTITIES * 2];
    jsl_component set[FIXTURE_COUNT];
    unsigned mask = 1u << pick(m, FIXTURE_COUNT);
    int sets = fixture_set(&m->f, mask, set);
    bool add = pick(m, 2);
    int64_t n = 0, moved, expected = 0;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(m->f.ecs, m->with_place, 64); jsl_query_next(&it, &rows);)
        for (int64_t i = 0; i < rows.count; i++) order[n++] = rows.entity[i];
    assert_ok(add ? jsl_entity_add_where(m->f.ecs, m->with_place, set, sets, &moved)
                  : jsl_entity_remove_where(m->f.ecs, m->with_place, set, sets, &moved));
    for (int64_t i = 0; i < n; i++) {
        unsigned old = find(m, order[i])->mask, mask_now = add ? old | mask : old & ~mask;
        expected += old != mask_now;
        changed(m, order[i], mask_now);
    }
    assert_i64(moved, expected);
}

static void op_write(model *m) {
    if (m->count == 0) return;
    model_entity *x = &m->at[pick(m, (uint64_t)m->count)];
    for (int c = 0; c < FIXTURE_COUNT; c++) {
        const jsl_component_desc *desc = fixture_desc(c);
        for (int k = 0; k < desc->field_count && x->mask >> c & 1; k++) {
            size_t size = (size_t)jsl_type_size(desc->fields[k].type);
            uint64_t bits = test_random(&m->random);
            x->value[c][k] = 0;
            memcpy(&x->value[c][k], &bits, size);
            if (desc->fields[k].role > JSL_CACHE) x->value[c][k] = 0;
            if (desc->fields[k].type == JSL_TYPE_ENTITY)
                memcpy(&x->value[c][k], &x->handle, sizeof x->handle);
            memcpy(jsl_entity_field(m->f.ecs, x->handle, m->f.component[c], k), &x->value[c][k],
                   size);
        }
    }
}

static void op_reorder(model *m) {
    static uint32_t from[MAX_ENTITIES * 2];
    static uint64_t arrival[MAX_ENTITIES * 2];
    if (m->count == 0) return;
    uint32_t table;
    int64_t row;
    jsl_rows rows;
    uint64_t before = jsl_ecs_hash(m->f.ecs);
    assert_true(jsl_entity_locate(m->f.ecs, any(m), &table, &row));
    for (jsl_iter it = jsl_query_begin(m->f.ecs, m->everything, 0); jsl_query_next(&it, &rows);) {
        if (rows.table != table) continue;
        for (int64_t i = 0; i < rows.count; i++) {
            arrival[i] = find(m, rows.entity[i])->arrival;
            from[i] = (uint32_t)i;
        }
        for (int64_t i = rows.count - 1; i > 0; i--) {
            int64_t j = (int64_t)pick(m, (uint64_t)i + 1);
            uint32_t t = from[i];
            from[i] = from[j];
            from[j] = t;
        }
        assert_ok(jsl_table_reorder(m->f.ecs, table, from, NULL));
        break;
    }
    assert_true(before == jsl_ecs_hash(m->f.ecs));
    for (jsl_iter it = jsl_query_begin(m->f.ecs, m->everything, 0); jsl_query_next(&it, &rows);)
        for (int64_t i = 0; rows.table == table && i < rows.count; i++)
            find(m, rows.entity[i])->arrival = arrival[i]; /* the new order is the right one now */
}

/* What the system below asks for each entity it sees. */
enum { NOTHING, KILL, GROW, SHRINK, SPAWN };
static int wish(uint64_t step, jsl_entity e) {
    uint64_t h = jsl_mix64(jsl_entity_id(e) ^ step << 20) % 100;
    return h < 6 ? KILL : h < 10 ? GROW : h < 14 ? SHRINK : h < 18 ? SPAWN : NOTHING;
}

static void wishing(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    const model *m = user;
    for (int64_t i = 0; i < rows->count; i++) {
        jsl_entity e = rows->entity[i];
        jsl_real xyz[3] = {1, 2, 3};
        switch (wish(m->step, e)) {
        case KILL:
            jsl_defer_destroy(context, e);
            jsl_defer_destroy(context, e); /* the second is passed over */
            jsl_defer_add(context, e, &m->f.component[TAG], 1);
            break;
        case GROW:
            jsl_defer_add(context, e, &m->f.component[RANK], 1);
            break;
        case SHRINK:
            jsl_defer_remove(context, e, &m->f.component[PLACE], 1);
            break;
        case SPAWN:
            jsl_defer_create(context, &m->f.component[PLACE], 1, xyz, sizeof xyz);
            break;
        default:
            break;
        }
    }
}

static void op_stage(model *m) {
    static jsl_entity order[MAX_ENTITIES * 2];
    jsl_rows rows;
    int64_t n = 0, spawned = 0;
    if (m->count > MAX_ENTITIES) return;
    for (jsl_iter it = jsl_query_begin(m->f.ecs, m->with_place, 0); jsl_query_next(&it, &rows);)
        for (int64_t i = 0; i < rows.count; i++) order[n++] = rows.entity[i];
    jsl_step_context context = {0};
    assert_ok(jsl_schedule_run(m->f.ecs, JSL_STAGE_MOVE, &context));
    for (int64_t i = 0; i < n; i++) {
        unsigned old = find(m, order[i])->mask;
        switch (wish(m->step, order[i])) {
        case KILL:
            died(m, order[i]);
            break;
        case GROW:
            changed(m, order[i], old | 1u << RANK);
            break;
        case SHRINK:
            changed(m, order[i], old & ~(1u << PLACE));
            break;
        case SPAWN:
            spawned++;
            break;
        default:
            break;
        }
    }
    jsl_real xyz[3] = {1, 2, 3};
    for (jsl_iter it = jsl_query_begin(m->f.ecs, m->with_place, 0); jsl_query_next(&it, &rows);) {
        for (int64_t i = 0; i < rows.count; i++) {
            if (find(m, rows.entity[i])) continue;
            model_entity *x = born(m, rows.entity[i], 1u << PLACE);
            for (int k = 0; k < 3; k++) memcpy(&x->value[PLACE][k], &xyz[k], sizeof xyz[k]);
            spawned--;
        }
    }
    assert_i64(spawned, 0);
}

static void op_rollback(model *m) {
    size_t size;
    uint64_t before = jsl_ecs_hash(m->f.ecs);
    void *image = fixture_save(&m->f, &size);
    jsl_entity out[40];
    fixture_create(&m->f, (unsigned)pick(m, ALL + 1), 40, out);
    if (m->count) assert_ok(jsl_entity_destroy(m->f.ecs, any(m)));
    assert_ok(jsl_ecs_restore(m->f.ecs, image, size));
    assert_true(before == jsl_ecs_hash(m->f.ecs));
    size_t again_size;
    void *again = fixture_save(&m->f, &again_size);
    assert_true(size == again_size && memcmp(image, again, size) == 0);
    free(image);
    free(again);
}

static void op_bad_handles(model *m) {
    if (m->count == 0 || m->deaths < 64) return;
    jsl_entity live = any(m), bad[BAD_HANDLES];
    fixture_bad_handles(&m->f, live, m->dead[pick(m, 64)], bad);
    jsl_entity e = bad[pick(m, BAD_HANDLES)];
    assert_result(jsl_entity_destroy(m->f.ecs, e), JSL_ERR_HANDLE);
    assert_result(jsl_entity_add(m->f.ecs, e, &m->f.component[TAG], 1), JSL_ERR_HANDLE);
    assert_result(jsl_entity_remove(m->f.ecs, e, &m->f.component[TAG], 1), JSL_ERR_HANDLE);
    assert_null(jsl_entity_field(m->f.ecs, e, m->f.component[PLACE], 0));
}

/* -- The run ------------------------------------------------------------------------------ */

static void operate(model *m) {
    uint64_t p = pick(m, 10000);
    m->step++;
    if (p < 2600)
        op_create(m);
    else if (p < 4600)
        op_destroy(m);
    else if (p < 7400)
        op_change(m);
    else if (p < 9000)
        op_write(m);
    else if (p < 9300)
        op_bad_handles(m);
    else if (p < 9600)
        op_destroy_n(m);
    else if (p < 9880)
        op_change_n(m);
    else if (p < 9920)
        op_destroy_where(m);
    else if (p < 9940)
        op_change_where(m);
    else if (p < 9970)
        op_reorder(m);
    else if (p < 9990)
        op_stage(m);
    else
        op_rollback(m);
}

static uint64_t number_from(const char *name, uint64_t otherwise) {
    const char *text = getenv(name);
    return text && *text ? strtoull(text, NULL, 0) : otherwise;
}

static void random_operations_agree_with_a_naive_model(void **state) {
    (void)state;
    uint64_t seed = number_from("JSL_TEST_SEED", 20240611), n = number_from("JSL_TEST_N", 1000000);
    printf("JSL_TEST_SEED=%llu JSL_TEST_N=%llu\n", (unsigned long long)seed, (unsigned long long)n);
    model m = {.random = seed};
    int64_t most = 0;
    fixture_open(&m.f);
    m.at = calloc(MAX_ENTITIES * 2, sizeof *m.at);
    assert_non_null(m.at);
    m.everything = fixture_query(&m.f, 0, 0);
    m.with_place = fixture_query(&m.f, 1u << PLACE, 0);
    m.with_mixed = fixture_query(&m.f, 1u << MIXED, 0);
    assert_ok(jsl_system_register(m.f.ecs,
                                  &(jsl_system_desc){.name = "wishing",
                                                     .stage = JSL_STAGE_MOVE,
                                                     .query = {{{m.f.component[PLACE], JSL_READ}}},
                                                     .block = 64,
                                                     .run_rows = wishing,
                                                     .user = &m}));
    for (uint64_t i = 0; i < n; i++) {
        operate(&m);
        if (m.count > most) most = m.count;
        if (i % 1024 == 0 || i < 256) compare(&m);
    }
    compare(&m);
    printf("at most %lld entities at once, %lld deaths\n", (long long)most, (long long)m.deaths);
    fixture_close(&m.f);
    free(m.at);
    free(m.of_index);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_operations_agree_with_a_naive_model)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
