/* SPDX-License-Identifier: MIT
 * The particle room's functions: descs, handles, limits, looks, and what a step does not do.
 */
#include "particle_stage.h"

static void texts_name_every_choice(void **state) {
    (void)state;
    assert_string_equal(jsl_emit_mode_text(JSL_EMIT_REEVES), "reeves");
    assert_string_equal(jsl_emitter_shape_text(JSL_EMITTER_SHELL), "shell");
    assert_string_equal(jsl_particle_integrator_text(JSL_PARTICLE_RK4), "rk4");
    assert_null(jsl_emit_mode_text(JSL_EMIT_MODE_COUNT));
    assert_null(jsl_emitter_shape_text((jsl_emitter_shape)-1));
    assert_null(jsl_particle_integrator_text((jsl_particle_integrator)99));
}

typedef struct bad_desc {
    const char *field; /* that the message must name */
    jsl_result want;
    jsl_emitter_desc desc;
} bad_desc;

static void bad_descs_are_refused_and_the_field_is_named(void **state) {
    (void)state;
    const jsl_real nan = (jsl_real)NAN, inf = (jsl_real)INFINITY;
    const bad_desc list[] = {
        {"position.y", JSL_ERR_NOT_FINITE, {.position = {0, nan, 0}}},
        {"orientation.w", JSL_ERR_NOT_FINITE, {.orientation = {0, 0, 0, inf}}},
        {"velocity.z", JSL_ERR_NOT_FINITE, {.velocity = {0, 0, nan}}},
        {"shape", JSL_ERR_ARGUMENT, {.shape = JSL_EMITTER_SHAPE_COUNT}},
        {"extent.x", JSL_ERR_ARGUMENT, {.extent = {-1, 0, 0}}},
        {"mode", JSL_ERR_ARGUMENT, {.mode = (jsl_emit_mode)77}},
        {"rate", JSL_ERR_ARGUMENT, {.rate = -1}},
        {"rate", JSL_ERR_NOT_FINITE, {.rate = inf}},
        {"rate_range", JSL_ERR_ARGUMENT, {.rate_range = -2}},
        {"rate_frame", JSL_ERR_ARGUMENT, {.rate_frame = -1}},
        {"max_particles", JSL_ERR_ARGUMENT, {.max_particles = -5}},
        {"direction.x", JSL_ERR_NOT_FINITE, {.direction = {nan, 0, 1}}},
        {"cone", JSL_ERR_ARGUMENT, {.cone = 4}},
        {"speed", JSL_ERR_NOT_FINITE, {.speed = nan}},
        {"speed_range", JSL_ERR_ARGUMENT, {.speed_range = -1}},
        {"inherit", JSL_ERR_ARGUMENT, {.inherit = 2}},
        {"life", JSL_ERR_ARGUMENT, {.life = -1}},
        {"life_range", JSL_ERR_NOT_FINITE, {.life_range = nan}},
        {"size", JSL_ERR_ARGUMENT, {.size = -1}},
        {"size_range", JSL_ERR_ARGUMENT, {.size_range = -1}},
        {"integrator", JSL_ERR_ARGUMENT, {.integrator = JSL_PARTICLE_INTEGRATOR_COUNT}},
        {"buoyancy", JSL_ERR_NOT_FINITE, {.buoyancy = nan}},
        {"drag", JSL_ERR_ARGUMENT, {.drag = -1}},
        {"wind", JSL_ERR_ARGUMENT, {.wind = JSL_R(1.5)}},
        {"restitution", JSL_ERR_ARGUMENT, {.restitution = JSL_R(1.01)}},
        {"friction", JSL_ERR_ARGUMENT, {.friction = -1}},
        {"contact_size", JSL_ERR_ARGUMENT, {.contact_size = 2}},
        {"bounds.lo.z", JSL_ERR_NOT_FINITE, {.bounds = {{0, 0, nan}, {1, 1, 1}}}},
        {"bounds.hi.x", JSL_ERR_ARGUMENT, {.bounds = {{2, 0, 0}, {1, 1, 1}}}},
        {"key_count", JSL_ERR_ARGUMENT, {.key_count = JSL_PARTICLE_KEYS + 1}},
        {"key_count", JSL_ERR_ARGUMENT, {.key_count = -1}},
        {"at", JSL_ERR_ARGUMENT, {.key_count = 1, .key = {{.at = 2}}}},
        {"size_scale", JSL_ERR_ARGUMENT, {.key_count = 1, .key = {{.size_scale = -1}}}},
        {"key 1", JSL_ERR_ARGUMENT, {.key_count = 2, .key = {{.at = JSL_R(0.5)}, {.at = 0}}}},
    };
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter good, e = {{3, 4}};
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){0}, &good));
    uint64_t hash = jsl_ecs_hash(s.ecs);
    for (int i = 0; i < JSL_COUNT(list); i++) {
        int lines = s.log.lines;
        assert_result(jsl_particle_room_emitter_create(s.room, &list[i].desc, &e), list[i].want);
        assert_non_null(strstr(s.log.text, list[i].field));
        assert_result(jsl_particle_room_emitter_set(s.room, good, &list[i].desc), list[i].want);
        assert_i64(s.log.lines, lines + 2);
        assert_true(e.entity.index == 3 && e.entity.generation == 4);
    }
    assert_result(jsl_particle_room_emitter_create(s.room, NULL, &e), JSL_ERR_ARGUMENT);
    assert_true(jsl_ecs_hash(s.ecs) == hash);
    particle_stage_close(&s);
}

static void bad_handles_are_refused_everywhere(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter dead, null = {{0, 0}};
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){0}, &dead));
    assert_ok(jsl_particle_room_emitter_destroy(s.room, dead));
    const jsl_emitter list[] = {dead, null};
    for (int i = 0; i < 2; i++) {
        jsl_emitter_desc d;
        int64_t n;
        jsl_emitter e = list[i];
        assert_result(jsl_particle_room_emitter_destroy(s.room, e), JSL_ERR_HANDLE);
        assert_result(jsl_particle_room_emitter_get(s.room, e, &d), JSL_ERR_HANDLE);
        assert_result(jsl_particle_room_emitter_set(s.room, e, &(jsl_emitter_desc){0}),
                      JSL_ERR_HANDLE);
        assert_result(jsl_particle_room_emit(s.room, e, 1), JSL_ERR_HANDLE);
        assert_result(jsl_particle_room_emitter_alive(s.room, e, &n), JSL_ERR_HANDLE);
        assert_result(jsl_particle_room_emitter_add(s.room, e.entity, &(jsl_emitter_desc){0}, NULL),
                      JSL_ERR_HANDLE);
    }
    jsl_emitter e;
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){0}, &e));
    assert_result(jsl_particle_room_emit(s.room, e, -1), JSL_ERR_ARGUMENT);
    assert_ok(jsl_particle_room_emit(s.room, e, 1ll << 40));
    assert_result(jsl_particle_room_emit(s.room, e, 1), JSL_ERR_LIMIT);
    assert_result(jsl_particle_room_emitter_add(s.room, e.entity, &(jsl_emitter_desc){0}, NULL),
                  JSL_ERR_STATE);
    particle_stage_close(&s);
}

static void a_desc_comes_back_as_it_was_given(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter_desc d = {
        .position = {1, 2, 3},
        .orientation = {0, 0, 0, 1},
        .velocity = {4, 5, 6},
        .shape = JSL_EMITTER_BOX,
        .extent = {1, 2, 3},
        .mode = JSL_EMIT_POISSON,
        .rate = 7,
        .rate_range = 8,
        .rate_frame = JSL_R(0.5),
        .max_particles = 99,
        .direction = {1, 0, 0},
        .cone = 1,
        .speed = 9,
        .speed_range = 10,
        .inherit = 1,
        .life = 11,
        .life_range = 12,
        .size = 13,
        .size_range = 14,
        .integrator = JSL_PARTICLE_VERLET,
        .buoyancy = 15,
        .drag = 16,
        .wind = 1,
        .restitution = 1,
        .friction = 17,
        .contact_size = 1,
        .category = 18,
        .mask = 19,
        .ghost = true,
        .bounds = {{-1, -2, -3}, {1, 2, 3}},
        .key_count = 2,
        .key = {{0, 0x11223344, 1}, {1, 0x55667788, 2}},
        .additive = true,
    };
    jsl_emitter e;
    jsl_emitter_desc got;
    assert_ok(jsl_particle_room_emitter_create(s.room, &d, &e));
    assert_ok(jsl_particle_room_emitter_get(s.room, e, &got));
    /* Every field is 4 or 8 bytes or one of two bools: compare by setting what comes back again. */
    uint64_t hash = jsl_ecs_hash(s.ecs);
    assert_ok(jsl_particle_room_emitter_set(s.room, e, &got));
    assert_true(jsl_ecs_hash(s.ecs) == hash);
    assert_true(got.rate == 7 && got.mask == 19 && got.ghost && got.additive);
    assert_true(got.key_count == 2 && got.key[1].rgba == 0x55667788 && got.key[1].size_scale == 2);
    assert_true(got.position.z == 3 && got.velocity.x == 4 && got.bounds.lo.z == -3);
    /* Without keys the look goes; the handle and the rest stay. */
    got.key_count = 0;
    assert_ok(jsl_particle_room_emitter_set(s.room, e, &got));
    assert_ok(jsl_particle_room_emitter_get(s.room, e, &got));
    assert_true(got.key_count == 0 && got.speed_range == 10);
    /* Defaults. */
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){0}, &e));
    assert_ok(jsl_particle_room_emitter_get(s.room, e, &got));
    assert_true(got.direction.z == 1 && got.orientation.w == 1 && got.mask == UINT32_MAX);
    assert_i64(got.max_particles, 1000000);
    particle_stage_close(&s);
}

static void an_emitter_rides_on_an_entity(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    s.context.gravity = jsl_v3(0, 0, 0);
    jsl_entity rider;
    assert_ok(jsl_entity_create(s.ecs, &s.position, 1, &rider));
    *(jsl_real *)jsl_entity_field(s.ecs, rider, s.position, 0) = 5;
    jsl_emitter e;
    assert_ok(jsl_particle_room_emitter_add(s.room, rider, &(jsl_emitter_desc){0}, &e));
    assert_true(jsl_entity_equal(e.entity, rider));
    assert_ok(jsl_particle_room_emit(s.room, e, 3));
    particle_stage_step(&s);
    jsl_rows rows;
    assert_true(particle_stage_rows(&s, &rows));
    assert_i64(rows.count, 3);
    assert_true(particle_position(&rows, 2).x == 5);
    particle_stage_close(&s);
}

static void particles_die_of_age_in_the_order_of_their_births(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_set_dt(&s, 1.0 / 16);
    jsl_emitter e;
    jsl_emitter_desc d = {.rate = 16, .life = JSL_R(0.5)};
    assert_ok(jsl_particle_room_emitter_create(s.room, &d, &e));
    for (int i = 1; i <= 40; i++) {
        particle_stage_step(&s);
        /* Born at the ends of steps, they die when their age reaches 8 steps. */
        assert_i64(particle_stage_count(&s), i < 8 ? i : 8);
        jsl_rows rows;
        assert_true(particle_stage_rows(&s, &rows));
        jsl_particle_columns q = jsl_particle_of(&rows, 2);
        for (int64_t k = 1; k < rows.count; k++) assert_true(q.age[k] < q.age[k - 1]);
        for (int64_t k = 0; k < rows.count; k++) assert_true(q.age[k] < q.life[k]);
    }
    particle_stage_close(&s);
}

static void immortals_do_not_age(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter e;
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){0}, &e));
    assert_ok(jsl_particle_room_emit(s.room, e, 5));
    for (int i = 0; i < 1000; i++) particle_stage_step(&s);
    jsl_rows rows;
    assert_true(particle_stage_rows(&s, &rows));
    assert_i64(rows.count, 5);
    assert_true(jsl_particle_of(&rows, 2).age[0] == 0);
    particle_stage_close(&s);
}

static void particles_end_at_the_bounds(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter e;
    jsl_emitter_desc d = {.bounds = {{-10, -10, -1}, {10, 10, 10}}};
    assert_ok(jsl_particle_room_emitter_create(s.room, &d, &e));
    jsl_rows rows;
    particle_stage_spawn(&s, e, 3, 0, &rows);
    particle_put(&rows, 0, jsl_v3(0, 0, -2), jsl_v3(0, 0, 0));
    particle_put(&rows, 1, jsl_v3(0, 0, 5), jsl_v3(0, 0, 0));
    particle_put(&rows, 2, jsl_v3(9, 0, 5), jsl_v3(100, 0, 0));
    particle_stage_step(&s);
    assert_true(particle_stage_rows(&s, &rows));
    assert_i64(rows.count, 1);
    assert_true(particle_position(&rows, 0).x == 0);
    particle_stage_close(&s);
}

static void a_particle_that_is_not_finite_is_removed_and_named(void **state) {
    (void)state;
    for (int field = 0; field < 6; field++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        particle_stage_ground(&s);
        jsl_emitter e;
        assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){0}, &e));
        jsl_rows rows;
        particle_stage_spawn(&s, e, 40, 0, &rows);
        for (int i = 0; i < 40; i++)
            particle_put(&rows, i, jsl_v3((jsl_real)i, 0, 5), jsl_v3(0, 0, 0));
        jsl_entity victim = rows.entity[17];
        jsl_real *column = rows.column[field];
        column[17] = field % 2 ? (jsl_real)NAN : (jsl_real)INFINITY;
        particle_stage_step(&s);
        assert_i64(particle_stage_count(&s), 39);
        assert_false(jsl_entity_is_alive(s.ecs, victim));
        assert_i64(s.warnings.count[JSL_WARN_BAD_STATE], 1);
        assert_true(jsl_entity_equal(s.warnings.first[JSL_WARN_BAD_STATE], victim));
        particle_stage_close(&s);
    }
}

static void particles_of_a_dead_emitter_go_with_it(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter a, b;
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){.life = 9}, &a));
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){.life = 9}, &b));
    assert_ok(jsl_particle_room_emit(s.room, a, 10));
    assert_ok(jsl_particle_room_emit(s.room, b, 7));
    particle_stage_step(&s);
    assert_i64(particle_stage_count(&s), 17);
    assert_ok(jsl_particle_room_emitter_destroy(s.room, a));
    particle_stage_step(&s);
    assert_i64(particle_stage_count(&s), 7);
    /* And when it was the last one. */
    assert_ok(jsl_particle_room_emitter_destroy(s.room, b));
    particle_stage_step(&s);
    assert_i64(particle_stage_count(&s), 0);
    particle_stage_close(&s);
}

static void looks_follow_the_keys(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter_desc d = {.life = 4,
                          .key_count = 4,
                          .key = {{0, 0xff000000, 1},
                                  {JSL_R(0.25), 0x00ff0080, 2},
                                  {JSL_R(0.5), 0x0000ffff, 4},
                                  {1, 0x00000000, 0}}};
    jsl_emitter e, plain;
    assert_ok(jsl_particle_room_emitter_create(s.room, &d, &e));
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){0}, &plain));
    jsl_rows rows;
    particle_stage_spawn(&s, e, 7, 4, &rows);
    jsl_particle_columns q = jsl_particle_of(&rows, 2);
    const jsl_real ages[] = {0, JSL_R(0.5), 1, JSL_R(1.5), 2, 3, 4};
    for (int i = 0; i < 7; i++) {
        q.age[i] = ages[i];
        q.size[i] = JSL_R(0.5);
    }
    q.emitter[6] = plain.entity;
    const uint32_t rgba[] = {0xff000000, 0x80800040, 0x00ff0080, 0x008080c0,
                             0x0000ffff, 0x00008080, 0xffffffff};
    const float size[] = {0.5f, 0.75f, 1, 1.5f, 2, 1, 0.5f};
    uint32_t got[7];
    float got_size[7];
    assert_ok(jsl_particle_room_colors(s.room, &rows, got, got_size));
    for (int i = 0; i < 7; i++) {
        assert_int_equal(got[i], rgba[i]);
        assert_true(got_size[i] == size[i]);
    }
    /* Either may be left out; a view that starts in the middle works; other rows are refused. */
    assert_ok(jsl_particle_room_colors(s.room, &rows, NULL, got_size));
    assert_ok(jsl_particle_room_colors(s.room, &rows, got, NULL));
    assert_ok(jsl_rows_of_entity(s.ecs, rows.entity[4], s.particle, &rows));
    assert_ok(jsl_particle_room_colors(s.room, &rows, got, got_size));
    assert_int_equal(got[0], 0x0000ffff);
    assert_ok(jsl_rows_of_entity(s.ecs, e.entity, s.position, &rows));
    assert_result(jsl_particle_room_colors(s.room, &rows, got, got_size), JSL_ERR_ARGUMENT);
    particle_stage_close(&s);
}

static void a_step_allocates_nothing_after_warm_up(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 2);
    particle_stage_ground(&s);
    for (int i = 0; i < 5; i++)
        particle_stage_collider(&s,
                                (jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {1, 1, JSL_R(0.2)}},
                                (jsl_pose){{0, 0, (jsl_real)i}, {0, 0, 0, 1}},
                                jsl_v3(JSL_R(0.1), 0, 0), jsl_v3(0, 0, 1));
    for (int i = 0; i < 3; i++) {
        jsl_emitter_desc d = {.position = {0, 0, 6},
                              .mode = (jsl_emit_mode)i,
                              .rate = 3000,
                              .rate_range = 2000,
                              .life = 1,
                              .life_range = JSL_R(0.5),
                              .cone = 1,
                              .speed = 3};
        assert_ok(jsl_particle_room_emitter_create(s.room, &d, NULL));
    }
    for (int i = 0; i < 240; i++) particle_stage_step(&s);
    int64_t calls = jsl_ecs_memory(s.ecs)->calls;
    for (int i = 0; i < 120; i++) particle_stage_step(&s);
    assert_true(particle_stage_count(&s) > 5000);
    assert_i64(jsl_ecs_memory(s.ecs)->calls, calls);
    particle_stage_close(&s);
}

static void a_step_of_no_duration_changes_nothing(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_ground(&s);
    jsl_emitter e;
    assert_ok(jsl_particle_room_emitter_create(s.room, &(jsl_emitter_desc){.rate = 600}, &e));
    for (int i = 0; i < 10; i++) particle_stage_step(&s);
    uint64_t hash = jsl_ecs_hash(s.ecs);
    particle_stage_set_dt(&s, 0);
    particle_stage_step(&s);
    assert_true(jsl_ecs_hash(s.ecs) == hash);
    particle_stage_close(&s);
}

static void creating_the_room_survives_failing_memory(void **state) {
    (void)state;
    for (int64_t fail = 1; fail < 200; fail++) {
        test_memory memory = {0};
        jsl_ecs *ecs;
        jsl_particle_room *room = NULL;
        assert_ok(jsl_ecs_create(&(jsl_ecs_desc){.allocator = test_allocator(&memory)}, &ecs));
        memory.fail_at = memory.calls + fail;
        jsl_result r = jsl_particle_room_create(ecs, &room);
        jsl_emitter e;
        if (r == JSL_OK)
            r = jsl_particle_room_emitter_create(room, &(jsl_emitter_desc){.key_count = 1}, &e);
        assert_true(r == JSL_OK || r == JSL_ERR_MEMORY);
        bool done = memory.failures == 0;
        jsl_particle_room_destroy(room);
        jsl_ecs_destroy(ecs);
        assert_no_leaks(&memory);
        if (done) return;
    }
    fail_msg("the allocator never ran out of failures");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texts_name_every_choice),
        cmocka_unit_test(bad_descs_are_refused_and_the_field_is_named),
        cmocka_unit_test(bad_handles_are_refused_everywhere),
        cmocka_unit_test(a_desc_comes_back_as_it_was_given),
        cmocka_unit_test(an_emitter_rides_on_an_entity),
        cmocka_unit_test(particles_die_of_age_in_the_order_of_their_births),
        cmocka_unit_test(immortals_do_not_age),
        cmocka_unit_test(particles_end_at_the_bounds),
        cmocka_unit_test(a_particle_that_is_not_finite_is_removed_and_named),
        cmocka_unit_test(particles_of_a_dead_emitter_go_with_it),
        cmocka_unit_test(looks_follow_the_keys),
        cmocka_unit_test(a_step_allocates_nothing_after_warm_up),
        cmocka_unit_test(a_step_of_no_duration_changes_nothing),
        cmocka_unit_test(creating_the_room_survives_failing_memory),
    };
    return cmocka_run_group_tests_name("particle", tests, NULL, NULL);
}
