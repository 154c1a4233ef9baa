/* SPDX-License-Identifier: MIT
 * Command buffers: structural changes from inside systems.
 */
#include "ecs_fixture.h"

#define P (1u << PLACE)
#define V (1u << PACE)

typedef struct wish {
    ecs_fixture *f;
    jsl_entity e[8];
    jsl_result result;
} wish;

static jsl_result run_once(ecs_fixture *f, jsl_whole_fn *whole, wish *w) {
    jsl_system_info info;
    w->f = f;
    if (jsl_system_get(f->ecs, 0, &info) != JSL_OK)
        assert_ok(jsl_system_register(
            f->ecs, &(jsl_system_desc){
                        .name = "wishes", .stage = JSL_STAGE_EMIT, .run_whole = whole, .user = w}));
    jsl_step_context context = {0};
    return jsl_schedule_run(f->ecs, JSL_STAGE_EMIT, &context);
}

static jsl_result ask_everything(const jsl_step_context *context, void *user) {
    wish *w = user;
    const jsl_component *c = w->f->component;
    struct {
        jsl_real v[3];
        jsl_real x[3];
    } values = {{4, 5, 6}, {1, 2, 3}};
    jsl_component set[] = {c[PACE], c[PLACE]}; /* not in the order of registration */
    assert_ok(jsl_defer_create(context, set, 2, &values, sizeof values));
    assert_ok(jsl_defer_create(context, set, 1, NULL, 0));
    assert_ok(jsl_defer_destroy(context, w->e[0]));
    assert_ok(jsl_defer_destroy(context, w->e[0])); /* passed over */
    assert_ok(jsl_defer_add(context, w->e[0], &c[TAG], 1));
    assert_ok(jsl_defer_add(context, w->e[1], &c[TAG], 1));
    assert_ok(jsl_defer_remove(context, w->e[2], &c[PLACE], 1));
    assert_ok(jsl_defer_remove(context, w->e[3], &c[PACE], 1)); /* has none */
    assert_i64(jsl_entity_count(context->ecs), 8);              /* nothing has happened yet */
    return w->result;
}

static void commands_are_applied_when_the_stage_ends(void **state) {
    (void)state;
    ecs_fixture f;
    wish w = {0};
    jsl_rows rows;
    fixture_open(&f);
    fixture_create(&f, P, 8, w.e);
    assert_ok(run_once(&f, ask_everything, &w));
    assert_i64(jsl_entity_count(f.ecs), 9);
    assert_false(jsl_entity_is_alive(f.ecs, w.e[0]));
    assert_true(jsl_entity_has(f.ecs, w.e[1], f.component[TAG]));
    assert_false(jsl_entity_has(f.ecs, w.e[2], f.component[PLACE]));
    assert_true(jsl_entity_has(f.ecs, w.e[3], f.component[PLACE]));
    jsl_iter it = jsl_query_begin(f.ecs, fixture_query(&f, P | V, 0), 0);
    assert_true(jsl_query_next(&it, &rows));
    assert_true(rows.count == 1);
    for (int k = 0; k < 6; k++) assert_true(*(jsl_real *)rows.column[k] == (jsl_real)(k + 1));
    fixture_close(&f);
}

static void a_failed_stage_drops_its_commands(void **state) {
    (void)state;
    ecs_fixture f;
    wish w = {.result = JSL_ERR_STATE};
    fixture_open(&f);
    fixture_create(&f, P, 8, w.e);
    uint64_t before = jsl_ecs_hash(f.ecs);
    assert_result(run_once(&f, ask_everything, &w), JSL_ERR_STATE);
    assert_true(before == jsl_ecs_hash(f.ecs));
    w.result = JSL_OK;
    assert_ok(run_once(&f, ask_everything, &w));
    assert_i64(jsl_entity_count(f.ecs), 9);
    fixture_close(&f);
}

static jsl_result ask_nonsense(const jsl_step_context *context, void *user) {
    wish *w = user;
    const jsl_component *c = w->f->component;
    jsl_component unknown = {60};
    jsl_real x[3] = {0};
    assert_result(jsl_defer_destroy(context, w->e[0]), JSL_ERR_HANDLE); /* stale */
    assert_result(jsl_defer_destroy(context, (jsl_entity){0, 0}), JSL_ERR_HANDLE);
    assert_result(jsl_defer_add(context, (jsl_entity){999, 1}, &c[TAG], 1), JSL_ERR_HANDLE);
    assert_result(jsl_defer_remove(context, w->e[0], &c[TAG], 1), JSL_ERR_HANDLE);
    assert_result(jsl_defer_add(context, w->e[1], &unknown, 1), JSL_ERR_HANDLE);
    assert_result(jsl_defer_add(context, w->e[1], NULL, 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_defer_create(context, &unknown, 1, NULL, 0), JSL_ERR_HANDLE);
    assert_result(jsl_defer_create(context, &c[PLACE], 1, x, 5), JSL_ERR_ARGUMENT);
    assert_result(jsl_defer_create(context, &c[PLACE], 1, NULL, sizeof x), JSL_ERR_ARGUMENT);
    return JSL_OK;
}

static void nonsense_is_refused_and_not_recorded(void **state) {
    (void)state;
    ecs_fixture f;
    wish w = {0};
    fixture_open(&f);
    fixture_create(&f, P, 8, w.e);
    assert_ok(jsl_entity_destroy(f.ecs, w.e[0]));
    uint64_t before = jsl_ecs_hash(f.ecs);
    assert_ok(run_once(&f, ask_nonsense, &w));
    assert_true(before == jsl_ecs_hash(f.ecs));
    jsl_step_context outside = {.ecs = f.ecs};
    assert_result(jsl_defer_destroy(&outside, w.e[1]), JSL_ERR_STATE);
    assert_result(jsl_defer_create(NULL, NULL, 0, NULL, 0), JSL_ERR_ARGUMENT);
    fixture_close(&f);
}

static jsl_result change_directly(const jsl_step_context *context, void *user) {
    wish *w = user;
    assert_ok(jsl_defer_add(context, w->e[5], &w->f->component[TAG], 1));
    assert_ok(jsl_entity_destroy(context->ecs, w->e[5])); /* the command finds it dead */
    return jsl_entity_create(context->ecs, &w->f->component[PACE], 1, &w->e[0]);
}

static void whole_systems_may_change_structure_directly(void **state) {
    (void)state;
    ecs_fixture f;
    wish w = {0};
    fixture_open(&f);
    fixture_create(&f, P, 8, w.e);
    assert_ok(run_once(&f, change_directly, &w));
    assert_i64(jsl_entity_count(f.ecs), 8);
    assert_true(jsl_entity_has(f.ecs, w.e[0], f.component[PACE]));
    fixture_close(&f);
}

static jsl_result fail_to_record(const jsl_step_context *context, void *user) {
    wish *w = user;
    jsl_result r = JSL_OK;
    w->f->memory.fail_at = w->f->memory.calls + 1;
    w->f->memory.fail_on = true;
    int recorded = 0;
    for (; recorded < 100000 && r == JSL_OK; recorded++) r = jsl_defer_destroy(context, w->e[1]);
    w->f->memory.fail_at = 0;
    w->f->memory.fail_on = false;
    assert_result(r, JSL_ERR_MEMORY);
    return jsl_defer_destroy(context, w->e[2]);
}

static void a_command_that_finds_no_memory_is_not_half_recorded(void **state) {
    (void)state;
    ecs_fixture f;
    wish w = {0};
    fixture_open(&f);
    fixture_create(&f, P, 8, w.e);
    assert_ok(run_once(&f, fail_to_record, &w));
    assert_false(jsl_entity_is_alive(f.ecs, w.e[2]));
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(commands_are_applied_when_the_stage_ends),
        cmocka_unit_test(a_failed_stage_drops_its_commands),
        cmocka_unit_test(nonsense_is_refused_and_not_recorded),
        cmocka_unit_test(whole_systems_may_change_structure_directly),
        cmocka_unit_test(a_command_that_finds_no_memory_is_not_half_recorded)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
