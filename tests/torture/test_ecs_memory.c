/* SPDX-License-Identifier: MIT
 * Every allocation of a scenario fails in turn. Each call that reports it must have changed
 * nothing, and must succeed when asked again.
 */
#include "ecs_fixture.h"

#include <stdlib.h>

typedef struct scenario {
    ecs_fixture f;
    jsl_entity e[700];
    jsl_query query;
    void *image;
    size_t image_size;
    jsl_result deferred; /* the first failure that the system saw */
    int64_t failures;    /* calls that failed */
} scenario;

static void unsettled(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    scenario *s = user;
    jsl_real xyz[3] = {1, 2, 3};
    for (int64_t i = 0; i < rows->count; i++) {
        jsl_result r = JSL_OK;
        if (i % 5 == 0)
            r = jsl_defer_create(context, &s->f.component[PLACE], 1, xyz, sizeof xyz);
        else if (i % 5 == 1)
            r = jsl_defer_destroy(context, rows->entity[i]);
        else if (i % 5 == 2)
            r = jsl_defer_add(context, rows->entity[i], &s->f.component[LINK], 1);
        if (r != JSL_OK && s->deferred == JSL_OK) s->deferred = r;
    }
}

static void every_third(const jsl_rows *rows, uint8_t *dead, void *arg) {
    (void)arg;
    for (int64_t i = 0; i < rows->count; i += 3) dead[i] = 1;
}

enum {
    REGISTER,
    QUERY,
    SYSTEM,
    CREATE,
    CREATE_MIXED,
    RESERVE,
    ADD,
    ADD_N,
    REMOVE_N,
    DESTROY_WHERE,
    ADD_WHERE,
    REMOVE_WHERE,
    REORDER,
    STAGE,
    RESTORE,
    DESTROY_N,
    STEPS
};

static jsl_result reorder(scenario *s) {
    uint32_t table, from[700];
    int64_t row;
    jsl_rows rows;
    jsl_iter it = jsl_query_begin(s->f.ecs, s->query, 0);
    if (!jsl_query_next(&it, &rows)) return JSL_OK;
    assert_true(jsl_entity_locate(s->f.ecs, rows.entity[0], &table, &row));
    for (int64_t i = 0; i < rows.count; i++) from[i] = (uint32_t)(rows.count - 1 - i);
    return jsl_table_reorder(s->f.ecs, table, from, NULL);
}

static jsl_result stage(scenario *s) {
    jsl_step_context context = {0};
    s->deferred = JSL_OK;
    jsl_result r = jsl_schedule_run(s->f.ecs, JSL_STAGE_FORCE, &context);
    return r != JSL_OK ? r : s->deferred;
}

static jsl_result one_step(scenario *s, int step) {
    jsl_ecs *ecs = s->f.ecs;
    const jsl_component *c = s->f.component;
    jsl_component set[FIXTURE_COUNT];
    int n = fixture_set(&s->f, 1u << PLACE | 1u << PACE, set);
    switch (step) {
    case REGISTER:
        return fixture_register(ecs, false, s->f.component);
    case QUERY:
        JSL_TRY(jsl_query_create(ecs, &(jsl_query_desc){0}, &s->query)); /* for fixture_fill */
        return jsl_query_create(ecs, &(jsl_query_desc){{{c[PLACE], JSL_WRITE}}}, &s->query);
    case SYSTEM:
        return jsl_system_register(ecs, &(jsl_system_desc){.name = "unsettled",
                                                           .stage = JSL_STAGE_FORCE,
                                                           .query = {{{c[PACE], JSL_WRITE}}},
                                                           .block = 16,
                                                           .run_rows = unsettled,
                                                           .user = s});
    case CREATE:
        return jsl_entity_create_n(ecs, set, n, 300, s->e, NULL);
    case CREATE_MIXED:
        return jsl_entity_create_n(ecs, &c[MIXED], 1, 400, s->e + 300, NULL);
    case RESERVE:
        return jsl_entity_reserve(ecs, set, n, 500);
    case ADD:
        return jsl_entity_add(ecs, s->e[7], &c[TAG], 1);
    case ADD_N:
        return jsl_entity_add_n(ecs, s->e + 200, 200, &c[RANK], 1);
    case REMOVE_N:
        return jsl_entity_remove_n(ecs, s->e + 350, 100, &c[MIXED], 1);
    case DESTROY_WHERE:
        return jsl_entity_destroy_where(ecs, s->query, every_third, NULL, NULL);
    case ADD_WHERE:
        return jsl_entity_add_where(ecs, s->query, &c[LINK], 1, NULL);
    case REMOVE_WHERE:
        return jsl_entity_remove_where(ecs, s->query, &c[PACE], 1, NULL);
    case REORDER:
        return reorder(s);
    case STAGE:
        return stage(s);
    case RESTORE:
        return jsl_ecs_restore(ecs, s->image, s->image_size);
    default:
        return jsl_entity_destroy_n(ecs, s->e + 500, 100);
    }
}

/* A stage is not all-or-nothing (its systems have run), so that is undone by an image. */
static void again(scenario *s, int step, uint64_t before, const void *image, size_t size) {
    fixture_validate(&s->f);
    s->failures++;
    if (step == STAGE) {
        assert_ok(jsl_ecs_restore(s->f.ecs, image, size));
    } else {
        assert_true(before == jsl_ecs_hash(s->f.ecs));
        size_t now_size;
        void *now = fixture_save(&s->f, &now_size);
        assert_true(size == now_size && memcmp(image, now, size) == 0);
        free(now);
    }
    assert_ok(one_step(s, step));
}

/* Runs it all with allocation fail_at failing; returns whether one did, and the hash at the end. */
static bool run(int64_t fail_at, bool give_up, uint64_t *hash) {
    scenario s = {0};
    s.f.memory.fail_at = fail_at;
    jsl_ecs_desc desc = {
        .allocator = test_allocator(&s.f.memory), .logger = test_logger(&s.f.log), .tag = 77};
    jsl_result r = jsl_ecs_create(&desc, &s.f.ecs);
    if (r != JSL_OK) {
        assert_result(r, JSL_ERR_MEMORY);
        assert_no_leaks(&s.f.memory);
        s.failures++;
        assert_ok(jsl_ecs_create(&desc, &s.f.ecs));
    }
    for (int step = 0; step < STEPS; step++) {
        if (step == STAGE) s.image = fixture_save(&s.f, &s.image_size);
        size_t size;
        uint64_t before = jsl_ecs_hash(s.f.ecs);
        void *image = fixture_save(&s.f, &size);
        r = one_step(&s, step);
        if (r != JSL_OK) {
            assert_result(r, JSL_ERR_MEMORY);
            assert_int_equal(s.f.log.code, JSL_ERR_MEMORY);
            if (!give_up) again(&s, step, before, image, size);
        }
        free(image);
        if (r != JSL_OK && give_up) break;
        if (step == CREATE_MIXED) fixture_fill(&s.f);
        fixture_validate(&s.f);
    }
    *hash = jsl_ecs_hash(s.f.ecs);
    bool failed = s.f.memory.failures > 0;
    if (failed && !give_up) assert_int_equal(s.failures, 1);
    free(s.image);
    jsl_ecs_destroy(s.f.ecs);
    assert_no_leaks(&s.f.memory);
    return failed;
}

static void every_allocation_that_fails_is_reported_and_can_be_tried_again(void **state) {
    (void)state;
    uint64_t expected, got;
    assert_false(run(0, false, &expected));
    int64_t n = 1;
    for (; run(n, false, &got); n++) assert_true(got == expected);
    assert_true(got == expected && n > 40);
}

static void an_ecs_can_be_destroyed_after_any_failure(void **state) {
    (void)state;
    uint64_t hash;
    for (int64_t n = 1; run(n, true, &hash); n++) {}
}

static void a_stage_allocates_nothing_once_warm(void **state) {
    (void)state;
    ecs_fixture f;
    fixture_open(&f);
    scenario s = {.f = f};
    jsl_entity e[640];
    fixture_create(&f, 1u << PACE | 1u << PLACE, 640, e);
    assert_ok(
        jsl_system_register(f.ecs, &(jsl_system_desc){.name = "unsettled",
                                                      .stage = JSL_STAGE_FORCE,
                                                      .query = {{{f.component[PACE], JSL_WRITE}}},
                                                      .run_rows = unsettled,
                                                      .user = &s}));
    size_t size;
    void *image = fixture_save(&f, &size);
    jsl_step_context context = {0};
    int64_t calls = 0;
    for (int i = 0; i < 4; i++) {
        calls = f.memory.calls;
        assert_ok(jsl_schedule_run(f.ecs, JSL_STAGE_FORCE, &context));
        if (i > 0) assert_i64(f.memory.calls, calls);
        assert_ok(jsl_ecs_restore(f.ecs, image, size));
    }
    free(image);
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation_that_fails_is_reported_and_can_be_tried_again),
        cmocka_unit_test(an_ecs_can_be_destroyed_after_any_failure),
        cmocka_unit_test(a_stage_allocates_nothing_once_warm)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
