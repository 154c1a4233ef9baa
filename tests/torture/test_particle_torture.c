/* SPDX-License-Identifier: MIT
 * Particles when memory fails and when numbers are absurd.
 */
#include "particle_stage.h"

static const jsl_emitter_desc spray = {.rate = 4000,
                                       .mode = JSL_EMIT_POISSON,
                                       .position = {0, 0, 3},
                                       .life = JSL_R(0.4),
                                       .cone = 1,
                                       .speed = 5,
                                       .restitution = JSL_R(0.5)};

/* A step of which any stage may run out of memory; returns whether one did. */
static bool try_step(particle_stage *s) {
    static const jsl_stage stages[] = {JSL_STAGE_INDEX, JSL_STAGE_MOVE, JSL_STAGE_RETIRE};
    bool failed = false;
    for (int i = 0; i < 3; i++) {
        jsl_result r = jsl_schedule_run(s->ecs, stages[i], &s->context);
        assert_true(r == JSL_OK || r == JSL_ERR_MEMORY);
        failed |= r != JSL_OK;
    }
    s->context.step++;
    return failed;
}

static void a_step_survives_failing_memory(void **state) {
    (void)state;
    bool ran_out = false;
    for (int64_t fail = 1; fail < 200 && !ran_out; fail++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        particle_stage_ground(&s);
        particle_stage_collider(&s, (jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 1},
                                (jsl_pose){0}, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
        jsl_emitter e;
        assert_ok(jsl_particle_room_emitter_create(s.room, &spray, &e));
        assert_ok(jsl_collider_set_index(jsl_ecs_memory(s.ecs), &s.set, s.context.dt, 0));
        s.memory.fail_at = s.memory.calls + fail;
        for (int i = 0; i < 30; i++) try_step(&s);
        ran_out = s.memory.failures == 0;
        /* The counts add up, and life goes on. */
        s.memory.fail_at = 0;
        jsl_ecs_report report;
        assert_ok(jsl_ecs_validate(s.ecs, &report));
        for (int i = 0; i < 5; i++) assert_false(try_step(&s));
        int64_t alive;
        assert_ok(jsl_particle_room_emitter_alive(s.room, e, &alive));
        assert_i64(alive, particle_stage_count(&s));
        assert_true(alive > 500);
        particle_stage_close(&s);
    }
    assert_true(ran_out);
}

static void absurd_states_never_hang_or_crash(void **state) {
    (void)state;
    const jsl_real values[] = {0,
                               1,
                               -1,
                               JSL_R(1e-30),
                               JSL_R(1e10),
                               JSL_R(-1e18),
                               JSL_R(3e38),
                               (jsl_real)INFINITY,
                               (jsl_real)NAN};
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_ground(&s);
    const jsl_shape_desc shapes[] = {{.kind = JSL_SHAPE_BOX, .half = {1, 1, 1}},
                                     {.kind = JSL_SHAPE_SPHERE, .radius = 1},
                                     {.kind = JSL_SHAPE_CAPSULE, .radius = 1, .half = {0, 0, 1}}};
    for (int i = 0; i < 3; i++)
        particle_stage_collider(&s, shapes[i], (jsl_pose){{(jsl_real)i, 0, 1}, {0, 0, 0, 1}},
                                jsl_v3(0, 0, 0), jsl_v3(1, 1, 0));
    jsl_emitter e;
    jsl_emitter_desc d = {.restitution = JSL_R(0.5), .friction = 1, .contact_size = 1, .drag = 3};
    assert_ok(jsl_particle_room_emitter_create(s.room, &d, &e));
    jsl_rows rows;
    uint64_t seed = 2;
    particle_stage_spawn(&s, e, 5000, 0, &rows);
    for (int64_t i = 0; i < 5000; i++) {
        for (int c = 0; c < 6; c++)
            ((jsl_real *)rows.column[c])[i] = values[test_random(&seed) % 9];
        jsl_particle_of(&rows, 2).size[i] = values[test_random(&seed) % 5];
    }
    for (int i = 0; i < 20; i++) particle_stage_step(&s);
    /* What is left is finite and nowhere inside. */
    if (particle_stage_rows(&s, &rows))
        for (int64_t i = 0; i < rows.count; i++) {
            jsl_vec3 x = particle_position(&rows, i);
            assert_true(jsl_v3_is_finite(x) && jsl_v3_is_finite(particle_velocity(&rows, i)));
        }
    assert_true(s.warnings.count[JSL_WARN_BAD_STATE] > 1000);
    particle_stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_step_survives_failing_memory),
        cmocka_unit_test(absurd_states_never_hang_or_crash),
    };
    return cmocka_run_group_tests_name("particle torture", tests, NULL, NULL);
}
