/* SPDX-License-Identifier: MIT
 * One world with everything in it: the same bits for every number of workers, every instruction
 * set, and after save and restore; no allocation in a step; kinds feel each other.
 */
#include "helper.h"

#include <jostle/jostle.h>

#include <pthread.h>
#include <string.h>

typedef struct mixed {
    jsl_world *world;
    jsl_body ball;
    jsl_emitter emitter;
    jsl_flock flock;
} mixed;

static jsl_shape shape_of(jsl_world *w, jsl_shape_desc desc) {
    jsl_shape shape;
    assert_ok(jsl_shape_create(w, &desc, &shape));
    return shape;
}

static mixed make_mixed(const jsl_world_desc *settings) {
    mixed m = {0};
    jsl_world_desc desc = *settings;
    desc.gravity = jsl_v3(0, 0, JSL_R(-9.81));
    desc.seed = 11;
    desc.wind = (jsl_wind){.velocity = {2, 0, 0}, .gust = 1};
    assert_ok(jsl_world_create(&desc, &m.world));
    jsl_world *w = m.world;
    jsl_shape ground = shape_of(w, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE});
    jsl_shape box = shape_of(
        w, (jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)}});
    jsl_shape sphere =
        shape_of(w, (jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = JSL_R(0.6)});
    assert_ok(jsl_body_create(w, &(jsl_body_desc){.shape = ground, .kind = JSL_BODY_STATIC}, NULL));
    for (int i = 0; i < 24; i++)
        assert_ok(jsl_body_create(
            w,
            &(jsl_body_desc){.shape = box,
                             .position = {(jsl_real)(i % 4), (jsl_real)(i / 12),
                                          JSL_R(0.5) + (jsl_real)(i / 4 % 3) * JSL_R(1.01)}},
            NULL));
    assert_ok(jsl_body_create(
        w,
        &(jsl_body_desc){
            .shape = sphere, .position = {-6, 0, 2}, .velocity = {9, 0, 2}, .density = 4000},
        &m.ball));
    assert_ok(jsl_emitter_create(w,
                                 &(jsl_emitter_desc){.position = {1, 0, 4},
                                                     .mode = JSL_EMIT_POISSON,
                                                     .rate = 4000,
                                                     .speed = 3,
                                                     .cone = 1,
                                                     .life = 1,
                                                     .life_range = JSL_R(0.3),
                                                     .drag = JSL_R(0.3),
                                                     .wind = 1,
                                                     .restitution = JSL_R(0.4)},
                                 &m.emitter));
    assert_ok(jsl_flock_create(w, &(jsl_flock_desc){0}, &m.flock));
    assert_ok(jsl_boid_create_n(
        w, m.flock, 300,
        &(jsl_boid_spawn){
            .centre = {0, 8, 6}, .radius = 6, .velocity = {0, -4, 0}, .velocity_spread = 2},
        NULL));
    return m;
}

static uint64_t run(const jsl_world_desc *settings, int steps) {
    mixed m = make_mixed(settings);
    for (int i = 0; i < steps; i++) assert_ok(jsl_step(m.world, 0, NULL));
    uint64_t hash = jsl_world_hash(m.world);
    jsl_ecs_report report;
    assert_ok(jsl_world_validate(m.world, &report));
    jsl_world_destroy(m.world);
    return hash;
}

static void the_hash_is_one_for_every_number_of_workers(void **state) {
    (void)state;
    uint64_t want = run(&(jsl_world_desc){.workers = 1}, 90);
    assert_true(want == run(&(jsl_world_desc){.workers = 1}, 90));
    for (int workers = 2; workers <= 8; workers *= 2)
        assert_true(want == run(&(jsl_world_desc){.workers = workers}, 90));
}

static void the_hash_is_one_for_every_instruction_set(void **state) {
    (void)state;
    uint64_t want = run(&(jsl_world_desc){.isa = JSL_ISA_SCALAR}, 90);
    for (int isa = JSL_ISA_SSE; isa < JSL_ISA_COUNT; isa++)
        assert_true(want == run(&(jsl_world_desc){.isa = (jsl_isa)isa}, 90));
}

static void a_restored_world_goes_on_as_if_it_had_never_stopped(void **state) {
    (void)state;
    mixed a = make_mixed(&(jsl_world_desc){0}), b = make_mixed(&(jsl_world_desc){.workers = 2});
    for (int i = 0; i < 50; i++) assert_ok(jsl_step(a.world, 0, NULL));
    for (int i = 0; i < 7; i++) assert_ok(jsl_step(b.world, 0, NULL));
    void *bytes;
    size_t size;
    assert_ok(jsl_world_save(a.world, &bytes, &size));
    assert_ok(jsl_world_restore(b.world, bytes, size));
    assert_true(jsl_world_hash(a.world) == jsl_world_hash(b.world));
    for (int i = 0; i < 60; i++) {
        assert_ok(jsl_step(a.world, 0, NULL));
        assert_ok(jsl_step(b.world, 0, NULL));
        if (jsl_world_hash(a.world) != jsl_world_hash(b.world))
            fail_msg("the worlds part %d steps after the restore", i + 1);
    }
    /* Into a world that has never held anything. */
    jsl_world *fresh;
    assert_ok(jsl_world_create(NULL, &fresh));
    assert_result(jsl_world_restore(fresh, bytes, size), JSL_ERR_VERSION);
    assert_ok(jsl_world_use_bodies(fresh));
    assert_ok(jsl_world_use_particles(fresh));
    assert_ok(jsl_world_use_flocks(fresh));
    assert_ok(jsl_look_set_n(fresh, NULL, 0, 0)); /* registers the component */
    assert_ok(jsl_world_restore(fresh, bytes, size));
    for (int i = 0; i < 60; i++) assert_ok(jsl_step(fresh, 0, NULL));
    assert_true(jsl_world_hash(a.world) == jsl_world_hash(fresh));
    jsl_world_free_bytes(a.world, bytes, size);
    jsl_world_destroy(fresh);
    jsl_world_destroy(a.world);
    jsl_world_destroy(b.world);
}

static void a_step_allocates_nothing_once_warm(void **state) {
    (void)state;
    mixed m = make_mixed(&(jsl_world_desc){.workers = 2});
    for (int i = 0; i < 240; i++) assert_ok(jsl_step(m.world, 0, NULL));
    jsl_profile before, after;
    jsl_world_profile(m.world, &before);
    for (int i = 0; i < 120; i++) assert_ok(jsl_step(m.world, 0, NULL));
    jsl_world_profile(m.world, &after);
    assert_i64(after.allocations - before.allocations, 0);
    jsl_world_destroy(m.world);
}

static void particles_rest_on_bodies_and_boids_fly_round_them(void **state) {
    (void)state;
    mixed m = make_mixed(&(jsl_world_desc){0});
    jsl_ecs *ecs = jsl_world_ecs(m.world);
    jsl_component position, particle, boid;
    assert_ok(jsl_component_find(ecs, "position", &position));
    assert_ok(jsl_component_find(ecs, "particle", &particle));
    assert_ok(jsl_component_find(ecs, "boid", &boid));
    jsl_query particles, boids;
    assert_ok(jsl_query_create(ecs, &(jsl_query_desc){{{position, JSL_READ}, {particle, JSL_READ}}},
                               &particles));
    assert_ok(
        jsl_query_create(ecs, &(jsl_query_desc){{{position, JSL_READ}, {boid, JSL_READ}}}, &boids));
    for (int i = 0; i < 150; i++) {
        assert_ok(jsl_step(m.world, 0, NULL));
        jsl_rows rows;
        for (jsl_iter it = jsl_query_begin(ecs, particles, 0); jsl_query_next(&it, &rows);)
            for (int64_t k = 0; k < rows.count; k++)
                assert_true(jsl_position_of(&rows, 0).pz[k] > JSL_R(-1e-3));
        for (jsl_iter it = jsl_query_begin(ecs, boids, 0); jsl_query_next(&it, &rows);)
            for (int64_t k = 0; k < rows.count; k++)
                assert_true(jsl_position_of(&rows, 0).pz[k] > 0);
    }
    jsl_diagnostics d;
    assert_ok(jsl_world_diagnostics(m.world, &d));
    assert_i64(d.boids, 300);
    assert_i64(d.bodies, 25);
    assert_true(d.particles > 2500);
    assert_i64(d.warnings.count[JSL_WARN_BAD_STATE], 0);
    jsl_world_destroy(m.world);
}

static void *worlds_of_a_thread(void *arg) {
    uint64_t *hash = arg;
    for (int i = 0; i < 8; i++) {
        uint64_t h = run(&(jsl_world_desc){.workers = 1 + i % 2}, 6);
        if (*hash == 0) *hash = h;
        if (*hash != h) *hash = 1; /* no hash of ours */
    }
    return NULL;
}

static void sixty_four_worlds_in_eight_threads_do_not_disturb_each_other(void **state) {
    (void)state;
    pthread_t thread[8];
    uint64_t hash[8] = {0};
    for (int i = 0; i < 8; i++)
        assert_int_equal(pthread_create(&thread[i], NULL, worlds_of_a_thread, &hash[i]), 0);
    for (int i = 0; i < 8; i++) pthread_join(thread[i], NULL);
    uint64_t want = run(&(jsl_world_desc){0}, 6);
    for (int i = 0; i < 8; i++) assert_true(hash[i] == want);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_hash_is_one_for_every_number_of_workers),
        cmocka_unit_test(the_hash_is_one_for_every_instruction_set),
        cmocka_unit_test(a_restored_world_goes_on_as_if_it_had_never_stopped),
        cmocka_unit_test(a_step_allocates_nothing_once_warm),
        cmocka_unit_test(particles_rest_on_bodies_and_boids_fly_round_them),
        cmocka_unit_test(sixty_four_worlds_in_eight_threads_do_not_disturb_each_other),
    };
    return cmocka_run_group_tests_name("mixed world", tests, NULL, NULL);
}
