/* SPDX-License-Identifier: MIT
 * The same bits for every number of workers and every instruction set, with and without staggering.
 */
#include "flock_stage.h"

#include "ecs/ecs.h"

typedef struct setup {
    int boids, steps, period, workers;
    jsl_isa isa;
    jsl_flock_response response;
} setup;

/* Two flocks in one space, one led along a path, among pillars, inside bounds. */
static void build(flock_stage *s, const setup *u) {
    const jsl_flock_desc desc = {.max_speed = 8,
                                 .min_speed = 2,
                                 .period = u->period,
                                 .response = u->response,
                                 .boid_radius = JSL_R(0.1),
                                 .bounds_lo = {-30, -30, -30},
                                 .bounds_hi = {30, 30, 30}};
    const jsl_vec3 way[] = {{20, 0, 0}, {0, 20, 5}, {-20, 0, 0}, {0, -20, -5}};
    jsl_flock flock[2] = {flock_stage_flock(s, &desc), flock_stage_flock(s, &desc)};
    jsl_entity leader = flock_stage_boid(s, flock[1], jsl_v3(0, 0, 0), jsl_v3(1, 0, 0));
    assert_ok(jsl_flock_room_set_path(s->room, flock[1], way, 4, 5));
    assert_ok(jsl_flock_room_set_leader(s->room, flock[1], leader));
    for (int k = 0; k < 2; k++) {
        jsl_boid_spawn spawn = {.centre = {k ? JSL_R(-5.0) : 5, 0, 0},
                                .radius = 20,
                                .velocity = {k ? 3 : JSL_R(-3.0), 1, 0},
                                .velocity_spread = 2};
        assert_ok(jsl_flock_room_boid_create_n(s->room, 3, flock[k], u->boids / 2, &spawn, NULL));
    }
    for (int i = 0; i < 9; i++)
        flock_stage_obstacle(
            s, (jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {1, 1, 20}},
            (jsl_pose){.position = {(jsl_real)(i % 3 - 1) * 12, (jsl_real)(i / 3 - 1) * 12, 0}},
            jsl_v3(0, 0, 0));
}

static uint64_t hash_after(const setup *u) {
    flock_stage s;
    flock_stage_open(&s, u->workers, u->isa);
    build(&s, u);
    for (int i = 0; i < u->steps; i++) flock_stage_step(&s, JSL_R(1.0 / 60));
    uint64_t hash = jsl_ecs_hash(s.ecs);
    assert_ok(jsl_ecs_validate(s.ecs, &(jsl_ecs_report){0}));
    flock_stage_close(&s);
    return hash;
}

static void any_number_of_workers_gives_the_same_state(void **state) {
    (void)state;
    for (int period = 1; period <= 3; period += 2) {
        setup u = {.boids = 9000, .steps = 8, .period = period, .workers = 1};
        const uint64_t one = hash_after(&u);
        u.workers = 2;
        assert_true(hash_after(&u) == one);
        u.workers = 4;
        assert_true(hash_after(&u) == one);
    }
}

static void any_instruction_set_gives_the_same_state(void **state) {
    (void)state;
    for (int response = 0; response < JSL_FLOCK_RESPONSE_COUNT; response++) {
        setup u = {.boids = 1500, .steps = 40, .period = 1, .workers = 1, .isa = JSL_ISA_SCALAR};
        u.response = (jsl_flock_response)response;
        const uint64_t scalar = hash_after(&u);
        for (int isa = JSL_ISA_SSE; isa < JSL_ISA_COUNT; isa++) {
            u.isa = (jsl_isa)isa;
            assert_true(hash_after(&u) == scalar);
        }
    }
}

static void a_restored_state_goes_on_as_if_never_stopped(void **state) {
    (void)state;
    const setup u = {.boids = 600, .period = 4, .workers = 1};
    flock_stage a, b;
    flock_stage_open(&a, 1, JSL_ISA_AUTO);
    build(&a, &u);
    for (int i = 0; i < 30; i++) flock_stage_step(&a, JSL_R(1.0 / 60));
    const size_t size = jsl_ecs_save_size(a.ecs);
    void *image = test_malloc(size);
    assert_ok(jsl_ecs_save(a.ecs, image, size));
    flock_stage_open(&b, 1, JSL_ISA_AUTO);
    build(&b, &u);
    assert_ok(jsl_ecs_restore(b.ecs, image, size));
    b.context.step = a.context.step;
    b.context.time = a.context.time;
    for (int i = 0; i < 30; i++) {
        flock_stage_step(&a, JSL_R(1.0 / 60));
        flock_stage_step(&b, JSL_R(1.0 / 60));
    }
    assert_true(jsl_ecs_hash(a.ecs) == jsl_ecs_hash(b.ecs));
    test_free(image);
    flock_stage_close(&a);
    flock_stage_close(&b);
}

static void nothing_is_allocated_once_warm(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 2, JSL_ISA_AUTO);
    build(&s, &(setup){.boids = 3000, .period = 2});
    for (int i = 0; i < 40; i++) flock_stage_step(&s, JSL_R(1.0 / 60));
    const int64_t calls = s.heap.calls;
    for (int i = 0; i < 60; i++) flock_stage_step(&s, JSL_R(1.0 / 60));
    assert_i64(s.heap.calls, calls);
    flock_stage_close(&s);
}

/* With period k a boid decides in every k-th step, and keeps its acceleration in between although
 * rows are being sorted all the while. */
static void accelerations_survive_the_sort_between_decisions(void **state) {
    (void)state;
    enum { N = 2000, K = 4 };
    static jsl_entity boid[N];
    static jsl_vec3 last[N];
    static int changed[N];
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {.period = K, .max_speed = 30, .max_accel = 60};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_boid_spawn spawn = {.radius = 25, .velocity_spread = 20};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 5, flock, N, &spawn, boid));
    for (int step = 0; step < 5 * K; step++) {
        flock_stage_step(&s, JSL_R(1.0 / 20));
        for (int i = 0; i < N; i++) {
            const jsl_vec3 a = flock_stage_see(&s, boid[i]).a;
            const bool same = a.x == last[i].x && a.y == last[i].y && a.z == last[i].z;
            if (!same) {
                changed[i]++;
                assert_int_equal(boid[i].index % K, step % K);
            }
            last[i] = a;
        }
    }
    int64_t total = 0;
    for (int i = 0; i < N; i++) total += changed[i];
    assert_true(total > 5 * N * 9 / 10); /* nearly every decision differs from the one before */
    flock_stage_close(&s);
}

/* Rows that others remember (a collider's) stay put; the flock is seen all the same. */
static void rows_of_colliders_are_not_moved(void **state) {
    (void)state;
    JSL_COMPONENT_FIELDS(jsl_collider, JSL_COLLIDER_FIELDS);
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_component collider;
    jsl_component_desc desc = {.name = "collider", .fields = jsl_collider_fields, .field_count = 4};
    assert_ok(jsl_component_register(s.ecs, &desc, &collider));
    jsl_flock flock = flock_stage_flock(&s, &(jsl_flock_desc){0});
    jsl_entity boid[300];
    jsl_boid_spawn spawn = {.radius = 15, .velocity_spread = 5};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 5, flock, 300, &spawn, boid));
    for (int i = 0; i < 300; i += 2) assert_ok(jsl_entity_add(s.ecs, boid[i], &collider, 1));
    uint32_t table;
    int64_t row[300], now;
    for (int i = 0; i < 300; i++) assert_true(jsl_entity_locate(s.ecs, boid[i], &table, &row[i]));
    for (int i = 0; i < 5; i++) flock_stage_step(&s, JSL_R(1.0 / 60));
    int moved = 0, seen = 0;
    for (int i = 0; i < 300; i++) {
        assert_true(jsl_entity_locate(s.ecs, boid[i], &table, &now));
        if (i % 2 == 0) assert_i64(now, row[i]);
        moved += now != row[i];
        seen += flock_stage_see(&s, boid[i]).neighbours > 0;
    }
    assert_true(moved > 100);
    assert_true(seen > 200);
    flock_stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_workers_gives_the_same_state),
        cmocka_unit_test(any_instruction_set_gives_the_same_state),
        cmocka_unit_test(a_restored_state_goes_on_as_if_never_stopped),
        cmocka_unit_test(nothing_is_allocated_once_warm),
        cmocka_unit_test(accelerations_survive_the_sort_between_decisions),
        cmocka_unit_test(rows_of_colliders_are_not_moved),
    };
    return cmocka_run_group_tests_name("flock", tests, NULL, NULL);
}
