/* SPDX-License-Identifier: MIT
 * The same bits for every number of workers and whichever way a host runs its tasks; many ECS at
 * once.
 */
#include "ecs_fixture.h"

#include <pthread.h>
#include <stdlib.h>

#define P (1u << PLACE)
#define V (1u << PACE)
#define M (1u << MIXED)
#define T (1u << TAG)
#define R (1u << RANK)

static void wander(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    (void)user;
    place_columns p = place_of(rows, 0);
    pace_columns v = pace_of(rows, 1);
    for (int64_t i = 0; i < rows->count; i++) {
        p.x[i] += v.vx[i] * context->dt;
        p.y[i] += v.vy[i] * context->dt;
        if (p.x[i] > 10000) jsl_warn(context, JSL_WARN_VELOCITY_CLAMPED, 1, rows->entity[i]);
    }
}

/* Births, deaths and changes, by a dice of the entity and the step. */
static void live(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    const jsl_component *c = user;
    jsl_component set[] = {c[PACE], c[PLACE]};
    for (int64_t i = 0; i < rows->count; i++) {
        jsl_entity e = rows->entity[i];
        uint64_t h = jsl_mix64(jsl_entity_id(e) ^ context->step << 40);
        jsl_real values[6] = {1, 2, 3, (jsl_real)(h % 64), 5, (jsl_real)context->step};
        if (h % 31 == 0) jsl_defer_destroy(context, e);
        if (h % 29 == 0) jsl_defer_create(context, set, 2, values, sizeof values);
        if (h % 23 == 0) jsl_defer_add(context, e, &c[RANK], 1);
        if (h % 19 == 0) jsl_defer_remove(context, e, &c[RANK], 1);
        if (h % 101 == 0) jsl_defer_add(context, e, &c[TAG], 1);
    }
}

static void open_world(ecs_fixture *f, int64_t n) {
    fixture_open(f);
    fixture_create(f, P | V, n, NULL);
    fixture_create(f, P | V | R, n, NULL);
    fixture_create(f, P | V | M, n / 2, NULL);
    fixture_fill(f);
    jsl_system_desc desc = {
        .name = "wander",
        .stage = JSL_STAGE_MOVE,
        .query = {{{f->component[PLACE], JSL_WRITE}, {f->component[PACE], JSL_READ}}},
        .block = 64,
        .run_rows = wander};
    assert_ok(jsl_system_register(f->ecs, &desc));
    desc.name = "live", desc.order = 1, desc.run_rows = live, desc.user = f->component;
    assert_ok(jsl_system_register(f->ecs, &desc));
}

typedef struct outcome {
    uint64_t hash, images;
    jsl_warnings warnings;
} outcome;

static outcome simulate(jsl_tasks hooks, int workers, int64_t n, int steps) {
    ecs_fixture f;
    jsl_exec exec;
    outcome o = {0};
    open_world(&f, n);
    assert_ok(jsl_exec_init(&exec, jsl_ecs_memory(f.ecs), hooks, workers));
    for (int step = 0; step < steps; step++) {
        jsl_step_context context = {
            .dt = JSL_R(0.01), .step = (uint64_t)step, .exec = &exec, .warnings = &o.warnings};
        assert_ok(jsl_schedule_run(f.ecs, JSL_STAGE_MOVE, &context));
        o.hash = o.hash * 31 + jsl_ecs_hash(f.ecs);
    }
    size_t size;
    void *image = fixture_save(&f, &size); /* row order and free slots too */
    o.images = jsl_hash_bytes(image, size, 0);
    free(image);
    jsl_exec_fini(&exec, jsl_ecs_memory(f.ecs));
    fixture_close(&f);
    return o;
}

static void assert_same(const outcome *a, const outcome *b) {
    assert_true(a->hash == b->hash);
    assert_true(a->images == b->images);
    for (int i = 0; i < JSL_WARN_COUNT; i++) {
        assert_i64(a->warnings.count[i], b->warnings.count[i]);
        assert_true(jsl_entity_id(a->warnings.first[i]) == jsl_entity_id(b->warnings.first[i]));
    }
}

static void one_two_four_and_eight_workers_give_the_same_bits(void **state) {
    (void)state;
    outcome first = simulate((jsl_tasks){0}, 1, 3000, 40);
    assert_true(first.warnings.count[JSL_WARN_VELOCITY_CLAMPED] > 0);
    for (int workers = 2; workers <= 8; workers *= 2) {
        outcome o = simulate((jsl_tasks){0}, workers, 3000, 40);
        assert_same(&first, &o);
    }
}

/* A host that keeps tasks back and runs them when they are waited for, the last first. */
typedef struct lazy_host {
    jsl_task_fn *fn[JSL_MAX_WORKERS];
    void *arg[JSL_MAX_WORKERS];
    int count;
} lazy_host;

static void *enqueue_later(jsl_task_fn *fn, void *arg, void *ctx) {
    lazy_host *host = ctx;
    host->fn[host->count] = fn;
    host->arg[host->count] = arg;
    return &host->fn[host->count++];
}

static void finish_all(void *handle, void *ctx) {
    lazy_host *host = ctx;
    (void)handle;
    while (host->count > 0) {
        host->count--;
        host->fn[host->count](host->arg[host->count]);
    }
}

static void *enqueue_now(jsl_task_fn *fn, void *arg, void *ctx) {
    (void)ctx;
    fn(arg);
    return NULL;
}

static void finish_nothing(void *handle, void *ctx) { (void)handle, (void)ctx; }

static void the_hosts_tasks_give_the_same_bits(void **state) {
    (void)state;
    lazy_host host = {0};
    outcome first = simulate((jsl_tasks){0}, 1, 2000, 20);
    outcome lazy = simulate((jsl_tasks){enqueue_later, finish_all, &host, 4}, 4, 2000, 20);
    outcome eager = simulate((jsl_tasks){enqueue_now, finish_nothing, NULL, 3}, 3, 2000, 20);
    assert_same(&first, &lazy);
    assert_same(&first, &eager);
}

static void *eight_of_them(void *arg) {
    outcome *o = arg;
    for (int i = 0; i < 8; i++) o[i] = simulate((jsl_tasks){0}, 1 + i % 2, 200, 10);
    return NULL;
}

static void sixty_four_of_them_in_eight_threads_are_independent(void **state) {
    (void)state;
    outcome o[64], first = simulate((jsl_tasks){0}, 1, 200, 10);
    pthread_t thread[8];
    for (int t = 0; t < 8; t++)
        assert_int_equal(pthread_create(&thread[t], NULL, eight_of_them, &o[t * 8]), 0);
    for (int t = 0; t < 8; t++) assert_int_equal(pthread_join(thread[t], NULL), 0);
    for (int i = 0; i < 64; i++) assert_same(&first, &o[i]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_two_four_and_eight_workers_give_the_same_bits),
        cmocka_unit_test(the_hosts_tasks_give_the_same_bits),
        cmocka_unit_test(sixty_four_of_them_in_eight_threads_are_independent)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
