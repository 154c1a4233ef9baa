/* SPDX-License-Identifier: MIT
 * Null, stale, foreign and forged handles, and those of another kind, in every function of a world
 * that takes one: an error, and nothing has changed.
 */
#include "helper.h"

#include <jostle/jostle.h>

#include <string.h>

typedef struct fixture {
    jsl_world *world;
    jsl_body body;
    jsl_emitter emitter;
    jsl_flock flock;
    jsl_entity boid;
} fixture;

static fixture make(uint32_t tag, test_log *log) {
    fixture f;
    assert_ok(
        jsl_world_create(&(jsl_world_desc){.tag = tag, .logger = test_logger(log)}, &f.world));
    jsl_shape sphere;
    assert_ok(jsl_shape_create(f.world, &(jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 1},
                               &sphere));
    assert_ok(jsl_body_create(f.world, &(jsl_body_desc){.shape = sphere}, &f.body));
    assert_ok(jsl_emitter_create(f.world, &(jsl_emitter_desc){.rate = 100}, &f.emitter));
    assert_ok(jsl_flock_create(f.world, &(jsl_flock_desc){0}, &f.flock));
    assert_ok(jsl_boid_create_n(f.world, f.flock, 1, &(jsl_boid_spawn){.radius = 1}, &f.boid));
    return f;
}

/* Every function that takes a handle; returns how many did not refuse it. */
static int try_all(fixture *f, jsl_entity e) {
    jsl_world *w = f->world;
    jsl_body_state body_state;
    jsl_emitter_desc emitter_desc;
    jsl_flock_desc flock_desc;
    jsl_emitter emitter;
    int64_t n;
    const jsl_vec3 v = {1, 2, 3}, path[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const jsl_body body = {.entity = e};
    const jsl_emitter source = {.entity = e};
    const jsl_flock flock = {.entity = e};
    const jsl_pose pose = {v, jsl_quat_identity()};
    const jsl_emitter_desc no_emitter = {0};
    const jsl_flock_desc no_flock = {0};
    const jsl_boid_spawn spawn = {0};
    const jsl_result got[] = {
        jsl_body_get(w, body, &body_state),
        jsl_body_set_pose(w, body, pose),
        jsl_body_set_velocity(w, body, v, v),
        jsl_body_add_force(w, body, v),
        jsl_body_add_torque(w, body, v),
        jsl_body_add_force_at(w, body, v, v),
        jsl_body_apply_impulse(w, body, v, v),
        jsl_body_destroy(w, body),
        jsl_emitter_add(w, e, &no_emitter, &emitter),
        jsl_emitter_set(w, source, &no_emitter),
        jsl_emitter_get(w, source, &emitter_desc),
        jsl_emit(w, source, 5),
        jsl_emitter_alive(w, source, &n),
        jsl_emitter_destroy(w, source),
        jsl_flock_set(w, flock, &no_flock),
        jsl_flock_get(w, flock, &flock_desc),
        jsl_flock_set_path(w, flock, path, 3, 1),
        jsl_boid_create_n(w, flock, 1, &spawn, NULL),
        jsl_flock_destroy(w, flock),
        jsl_entity_is_null(e) ? JSL_ERR_HANDLE
                              : jsl_flock_set_leader(w, f->flock, e), /* null: none */
        jsl_look_set_n(w, &e, 1, 0xff0000ff),
    };
    int accepted = 0;
    for (size_t i = 0; i < sizeof got / sizeof got[0]; i++)
        if (got[i] != JSL_ERR_HANDLE) {
            print_message("function %d gave %d\n", (int)i, (int)got[i]);
            accepted++;
        }
    return accepted;
}

static void bad_handles_are_refused_everywhere(void **state) {
    (void)state;
    test_log log = {0};
    fixture f = make(1, &log), other = make(2, &log);
    jsl_entity stale = f.body.entity;
    assert_ok(jsl_body_destroy(f.world, f.body));
    uint64_t before = jsl_world_hash(f.world);
    const jsl_entity bad[] = {
        {0, 0},                                          /* null */
        stale,                                           /* its entity is gone */
        other.body.entity,                               /* of another world, same slot */
        {f.boid.index, f.boid.generation + 1},           /* forged generation */
        {f.boid.index, f.boid.generation ^ 0x80000000u}, /* forged owner */
        {1000000, f.boid.generation},                    /* beyond the slots */
        {0xffffffffu, 0xffffffffu},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (try_all(&f, bad[i])) fail_msg("handle %d was accepted", (int)i);
        assert_true(jsl_world_hash(f.world) == before);
    }
    jsl_world_destroy(f.world);
    jsl_world_destroy(other.world);
}

static void a_handle_of_another_kind_is_refused(void **state) {
    (void)state;
    test_log log = {0};
    fixture f = make(1, &log);
    uint64_t before = jsl_world_hash(f.world);
    jsl_body_state body_state;
    jsl_emitter_desc emitter_desc;
    jsl_flock_desc flock_desc;
    assert_true(jsl_body_get(f.world, (jsl_body){f.boid}, &body_state) != JSL_OK);
    assert_true(jsl_body_destroy(f.world, (jsl_body){f.emitter.entity}) != JSL_OK);
    assert_true(jsl_emitter_get(f.world, (jsl_emitter){f.body.entity}, &emitter_desc) != JSL_OK);
    assert_true(jsl_emitter_destroy(f.world, (jsl_emitter){f.boid}) != JSL_OK);
    assert_true(jsl_flock_get(f.world, (jsl_flock){f.boid}, &flock_desc) != JSL_OK);
    assert_true(jsl_flock_destroy(f.world, (jsl_flock){f.body.entity}) != JSL_OK);
    assert_true(jsl_flock_set_leader(f.world, f.flock, f.body.entity) != JSL_OK);
    assert_true(jsl_world_hash(f.world) == before);
    jsl_world_destroy(f.world);
}

static void null_arguments_are_refused(void **state) {
    (void)state;
    test_log log = {0};
    fixture f = make(1, &log);
    jsl_world *w = f.world;
    jsl_body body;
    assert_true(jsl_body_create(w, NULL, &body) != JSL_OK);
    assert_true(jsl_body_create(NULL, &(jsl_body_desc){0}, &body) != JSL_OK);
    assert_true(jsl_body_get(w, f.body, NULL) != JSL_OK);
    assert_true(jsl_emitter_create(w, NULL, NULL) != JSL_OK);
    assert_true(jsl_emitter_get(w, f.emitter, NULL) != JSL_OK);
    assert_true(jsl_flock_create(w, NULL, NULL) != JSL_OK);
    assert_true(jsl_flock_get(w, f.flock, NULL) != JSL_OK);
    assert_true(jsl_boid_create_n(w, f.flock, 1, NULL, NULL) != JSL_OK);
    assert_true(jsl_flock_set_path(w, f.flock, NULL, 3, 1) != JSL_OK);
    assert_true(jsl_shape_create(w, NULL, NULL) != JSL_OK);
    assert_true(jsl_material_create(w, NULL, NULL) != JSL_OK);
    assert_true(jsl_world_diagnostics(w, NULL) != JSL_OK);
    assert_true(jsl_world_save(w, NULL, NULL) != JSL_OK);
    assert_true(jsl_world_restore(w, NULL, 0) != JSL_OK);
    assert_true(jsl_world_clone(w, NULL, NULL, NULL) != JSL_OK);
    assert_true(jsl_world_set_wind(w, NULL) != JSL_OK);
    assert_true(jsl_world_validate(w, NULL) != JSL_OK);
    jsl_world_destroy(w);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_handles_are_refused_everywhere),
        cmocka_unit_test(a_handle_of_another_kind_is_refused),
        cmocka_unit_test(null_arguments_are_refused),
    };
    return cmocka_run_group_tests_name("world handles", tests, NULL, NULL);
}
