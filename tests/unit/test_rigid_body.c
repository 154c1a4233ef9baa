/* SPDX-License-Identifier: MIT
 * Bodies: descs, handles, setters, contacts as a table, the contact cache as state.
 */
#include "rigid_scene.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static int setup(void **state) {
    rigid_scene *s = malloc(sizeof *s);
    scene_open(s, 1);
    *state = s;
    return 0;
}
static int teardown(void **state) {
    scene_close(*state);
    free(*state);
    return 0;
}

static void a_zero_desc_is_a_cube_of_water_at_rest(void **state) {
    rigid_scene *s = *state;
    jsl_body b =
        scene_body(s, &(jsl_body_desc){.shape = scene_box(s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5))});
    jsl_body_state now = scene_get(s, b);
    assert_int_equal(now.kind, JSL_BODY_DYNAMIC);
    assert_true(jsl_abs(now.mass - 1000) < 1000 * 4 * JSL_REAL_EPSILON);
    assert_true(jsl_abs(now.inertia.x - JSL_R(1000) / 6) < 200 * 4 * JSL_REAL_EPSILON);
    assert_true(now.inertia.x == now.inertia.y && now.inertia.y == now.inertia.z);
    assert_true(now.pose.orientation.w == 1 && now.pose.position.x == 0 && now.velocity.z == 0);
}

static void every_bad_field_is_refused_and_named(void **state) {
    rigid_scene *s = *state;
    const jsl_real bad = (jsl_real)NAN, inf = (jsl_real)INFINITY;
    /* Its inverse overflows. */
    const jsl_real tiny = sizeof(jsl_real) == 4 ? JSL_R(1e-45) : (jsl_real)1e-320;
    jsl_shape cube = scene_box(s, 1, 1, 1), plane = scene_plane(s), wrong = scene_box(s, -1, 1, 1);
    const struct {
        jsl_body_desc desc;
        jsl_result code;
        const char *name;
    } row[] = {
        {{.shape = cube, .mass = bad}, JSL_ERR_NOT_FINITE, "mass"},
        {{.shape = cube, .mass = inf}, JSL_ERR_NOT_FINITE, "mass"},
        {{.shape = cube, .mass = -1}, JSL_ERR_ARGUMENT, "mass"},
        {{.shape = cube, .mass = tiny}, JSL_ERR_ARGUMENT, "mass"},
        {{.shape = cube, .density = -1}, JSL_ERR_ARGUMENT, "density"},
        {{.shape = cube, .density = bad}, JSL_ERR_NOT_FINITE, "density"},
        {{.shape = cube, .mass = 1, .density = 1}, JSL_ERR_CONFLICT, "density"},
        {{.shape = cube, .inertia = {1, 1, 3}}, JSL_ERR_ARGUMENT, "inertia"},
        {{.shape = cube, .inertia = {1, 1, 0}}, JSL_ERR_ARGUMENT, "inertia"},
        {{.shape = cube, .inertia = {1, -1, 1}}, JSL_ERR_ARGUMENT, "inertia"},
        {{.shape = cube, .inertia = {bad, 1, 1}}, JSL_ERR_NOT_FINITE, "inertia"},
        {{.shape = cube, .position = {0, bad, 0}}, JSL_ERR_NOT_FINITE, "position"},
        {{.shape = cube, .orientation = {0, 0, bad, 1}}, JSL_ERR_NOT_FINITE, "orientation"},
        {{.shape = cube, .orientation = {0, 0, 1, 1}}, JSL_ERR_ARGUMENT, "orientation"},
        {{.shape = cube, .velocity = {inf, 0, 0}}, JSL_ERR_NOT_FINITE, "velocity"},
        {{.shape = cube, .spin = {0, 0, bad}}, JSL_ERR_NOT_FINITE, "spin"},
        {{.shape = cube, .gravity_scale = bad}, JSL_ERR_NOT_FINITE, "gravity_scale"},
        {{.shape = cube, .gravity_scale = 2, .no_gravity = true},
         JSL_ERR_CONFLICT,
         "gravity_scale"},
        {{.shape = cube, .linear_damping = -1}, JSL_ERR_ARGUMENT, "linear_damping"},
        {{.shape = cube, .linear_damping = bad}, JSL_ERR_NOT_FINITE, "linear_damping"},
        {{.shape = cube, .angular_damping = -1}, JSL_ERR_ARGUMENT, "angular_damping"},
        {{.shape = cube, .angular_damping = bad}, JSL_ERR_NOT_FINITE, "angular_damping"},
        {{.shape = cube, .kind = (jsl_body_kind)9}, JSL_ERR_ARGUMENT, "kind"},
        {{.shape = cube, .kind = JSL_BODY_STATIC, .velocity = {1, 0, 0}},
         JSL_ERR_CONFLICT,
         "velocity"},
        {{.shape = cube, .kind = JSL_BODY_STATIC, .spin = {1, 0, 0}}, JSL_ERR_CONFLICT, "spin"},
        {{.shape = cube, .kind = JSL_BODY_STATIC, .mass = 1}, JSL_ERR_CONFLICT, "mass"},
        {{.shape = cube, .kind = JSL_BODY_KINEMATIC, .density = 1}, JSL_ERR_CONFLICT, "mass"},
        {{.shape = plane}, JSL_ERR_CONFLICT, "shape"},
        {{.shape = wrong}, JSL_ERR_ARGUMENT, "shape"},
        {{.mass = 1}, JSL_ERR_ARGUMENT, "inertia"},
        {{.inertia = {1, 1, 1}}, JSL_ERR_ARGUMENT, "mass"},
    };
    for (int i = 0; i < JSL_COUNT(row); i++) {
        jsl_body out = {{77, 77}};
        s->message[0] = 0;
        jsl_result code = scene_try(s, &row[i].desc, &out);
        if (code != row[i].code || !strstr(s->message, row[i].name))
            fail_msg("row %d (%s): %s, \"%s\"", i, row[i].name, jsl_result_text(code), s->message);
        assert_true(out.entity.index == 77);
        assert_true(jsl_entity_count(s->ecs) == 0);
    }
}

static void a_list_with_one_bad_desc_makes_no_body(void **state) {
    rigid_scene *s = *state;
    jsl_shape cube = scene_box(s, 1, 1, 1);
    jsl_rigid_body_desc list[3] = {{{.shape = cube}, &s->shape[0]},
                                   {{.shape = cube, .kind = JSL_BODY_STATIC}, &s->shape[0]},
                                   {{.shape = cube, .mass = -2}, &s->shape[0]}};
    jsl_body out[3];
    assert_int_equal(jsl_rigid_body_create_n(s->room, list, 3, out), JSL_ERR_ARGUMENT);
    assert_non_null(strstr(s->message, "body 2"));
    assert_true(jsl_entity_count(s->ecs) == 0);
    list[2].body.mass = 2;
    assert_int_equal(jsl_rigid_body_create_n(s->room, list, 3, out), JSL_OK);
    assert_int_equal(scene_get(s, out[1]).kind, JSL_BODY_STATIC);
    assert_true(jsl_abs(scene_get(s, out[2]).mass - 2) < 4 * JSL_REAL_EPSILON);
    assert_int_equal(jsl_rigid_body_create_n(s->room, list, -1, out), JSL_ERR_ARGUMENT);
    assert_int_equal(jsl_rigid_body_create_n(s->room, list, 0, out), JSL_OK);
}

static void stale_and_forged_handles_are_refused(void **state) {
    rigid_scene *s = *state;
    jsl_body b = scene_body(s, &(jsl_body_desc){.shape = scene_sphere(s, 1)}), null = {{0, 0}};
    assert_int_equal(jsl_rigid_body_destroy(s->room, b), JSL_OK);
    jsl_body handle[2] = {b, null};
    jsl_vec3 v = {1, 2, 3};
    for (int i = 0; i < 2; i++) {
        jsl_body_state out;
        assert_int_equal(jsl_rigid_body_get(s->room, handle[i], &out), JSL_ERR_HANDLE);
        assert_int_equal(jsl_rigid_body_destroy(s->room, handle[i]), JSL_ERR_HANDLE);
        assert_int_equal(
            jsl_rigid_body_set_pose(s->room, handle[i], (jsl_pose){{0, 0, 0}, {0, 0, 0, 0}}),
            JSL_ERR_HANDLE);
        assert_int_equal(jsl_rigid_body_set_velocity(s->room, handle[i], v, v), JSL_ERR_HANDLE);
        assert_int_equal(jsl_rigid_body_add_force(s->room, handle[i], v), JSL_ERR_HANDLE);
        assert_int_equal(jsl_rigid_body_add_torque(s->room, handle[i], v), JSL_ERR_HANDLE);
        assert_int_equal(jsl_rigid_body_add_force_at(s->room, handle[i], v, v), JSL_ERR_HANDLE);
        assert_int_equal(jsl_rigid_body_apply_impulse(s->room, handle[i], v, v), JSL_ERR_HANDLE);
    }
}

static void setters_refuse_what_is_not_finite_or_not_movable(void **state) {
    rigid_scene *s = *state;
    jsl_shape ball = scene_sphere(s, 1);
    jsl_body b = scene_body(s, &(jsl_body_desc){.shape = ball});
    jsl_body wall = scene_body(s, &(jsl_body_desc){.shape = ball, .kind = JSL_BODY_STATIC});
    jsl_vec3 bad = {0, (jsl_real)NAN, 0}, one = {1, 0, 0};
    assert_int_equal(jsl_rigid_body_set_velocity(s->room, b, bad, one), JSL_ERR_NOT_FINITE);
    assert_int_equal(jsl_rigid_body_set_velocity(s->room, b, one, bad), JSL_ERR_NOT_FINITE);
    assert_int_equal(jsl_rigid_body_add_force(s->room, b, bad), JSL_ERR_NOT_FINITE);
    assert_int_equal(jsl_rigid_body_add_torque(s->room, b, bad), JSL_ERR_NOT_FINITE);
    assert_int_equal(jsl_rigid_body_add_force_at(s->room, b, one, bad), JSL_ERR_NOT_FINITE);
    assert_int_equal(jsl_rigid_body_apply_impulse(s->room, b, bad, one), JSL_ERR_NOT_FINITE);
    assert_int_equal(jsl_rigid_body_set_pose(s->room, b, (jsl_pose){bad, {0, 0, 0, 1}}),
                     JSL_ERR_NOT_FINITE);
    assert_int_equal(jsl_rigid_body_set_pose(s->room, b, (jsl_pose){one, {0, 0, 0, 2}}),
                     JSL_ERR_ARGUMENT);
    assert_int_equal(jsl_rigid_body_set_velocity(s->room, wall, one, one), JSL_ERR_STATE);
    assert_int_equal(jsl_rigid_body_add_force(s->room, wall, one), JSL_ERR_STATE);
    assert_int_equal(jsl_rigid_body_apply_impulse(s->room, wall, one, one), JSL_ERR_STATE);
    assert_true(scene_get(s, b).velocity.y == 0 && scene_get(s, b).pose.position.x == 0);
}

static void bad_settings_are_refused_and_named(void **state) {
    rigid_scene *s = *state;
    jsl_rigid_settings row[] = {
        {.contact_hertz = -1}, {.damping_ratio = -1}, {.push_speed = (jsl_real)NAN},
        {.margin = -1},        {.max_speed = -1},     {.rotation = (jsl_rotation)7}};
    const char *name[] = {"contact_hertz", "damping_ratio", "push_speed",
                          "margin",        "max_speed",     "rotation"};
    for (int i = 0; i < JSL_COUNT(row); i++) {
        assert_int_not_equal(jsl_rigid_room_set(s->room, &row[i]), JSL_OK);
        assert_non_null(strstr(s->message, name[i]));
    }
    jsl_rigid_settings now;
    jsl_rigid_room_get(s->room, &now);
    assert_true(now.margin == 0 && now.rotation == JSL_ROTATION_IMPLICIT);
}

static void a_force_at_a_point_pushes_and_turns_for_one_step(void **state) {
    rigid_scene *s = *state;
    jsl_body b = scene_body(
        s, &(jsl_body_desc){.shape = scene_box(s, 1, 1, 1), .mass = 6, .inertia = {4, 4, 4}});
    /* F = 60 N along y at x = 1: after dt v = F dt / m, w = r x F dt / I. */
    assert_int_equal(jsl_rigid_body_add_force_at(s->room, b, jsl_v3(0, 60, 0), jsl_v3(1, 0, 0)),
                     JSL_OK);
    scene_steps(s, 3);
    jsl_body_state now = scene_get(s, b);
    assert_true(jsl_abs(now.velocity.y - JSL_R(60) / 60 / 6) < 8 * JSL_REAL_EPSILON);
    assert_true(jsl_abs(now.spin.z - JSL_R(60) / 60 / 4) < 8 * JSL_REAL_EPSILON);
    assert_true(now.velocity.x == 0 && now.spin.x == 0);
    assert_int_equal(jsl_rigid_body_apply_impulse(s->room, b, jsl_v3(0, 0, 6), now.pose.position),
                     JSL_OK);
    assert_true(jsl_abs(scene_get(s, b).velocity.z - 1) < 8 * JSL_REAL_EPSILON);
}

static jsl_contact only_contact(rigid_scene *s, int64_t expected) {
    const jsl_contact *c;
    int64_t count;
    assert_int_equal(jsl_rigid_room_contacts(s->room, &c, &count), JSL_OK);
    if (count != expected)
        fail_msg("%lld contacts, not %lld", (long long)count, (long long)expected);
    return count > 0 ? c[0] : (jsl_contact){0};
}

static void the_contact_table_tells_begin_weight_and_end(void **state) {
    rigid_scene *s = *state;
    s->context.gravity = jsl_v3(0, 0, -10);
    jsl_body ground =
        scene_body(s, &(jsl_body_desc){.shape = scene_plane(s), .kind = JSL_BODY_STATIC});
    jsl_body b = scene_body(
        s, &(jsl_body_desc){.shape = scene_box(s, 1, 1, 1), .mass = 3, .position = {0, 0, 1}});
    scene_step(s);
    jsl_contact c = only_contact(s, 1);
    assert_int_equal(c.phase, JSL_CONTACT_BEGIN);
    assert_true(jsl_entity_equal(c.a, ground.entity) && jsl_entity_equal(c.b, b.entity));
    assert_true(c.normal.z > JSL_R(0.9999) && c.points == 4);
    scene_steps(s, 60);
    c = only_contact(s, 1);
    assert_int_equal(c.phase, JSL_CONTACT_PERSIST);
    /* At rest the impulse of a step carries the weight; what is left is the solver's last
     * correction. */
    assert_true(jsl_abs(c.normal_impulse - JSL_R(0.5)) < JSL_R(1e-4));
    assert_true(jsl_abs(c.point.z) < JSL_R(0.01) && jsl_abs(c.depth) < JSL_R(0.01));
    assert_true(jsl_length(c.tangent_impulse) < JSL_R(1e-4));
    assert_int_equal(jsl_rigid_body_set_pose(s->room, b, (jsl_pose){{0, 0, 50}, {0, 0, 0, 0}}),
                     JSL_OK);
    scene_step(s);
    c = only_contact(s, 1);
    assert_int_equal(c.phase, JSL_CONTACT_END);
    assert_true(jsl_entity_equal(c.a, ground.entity) && jsl_entity_equal(c.b, b.entity));
    scene_step(s);
    only_contact(s, 0);
}

static void filtered_bodies_pass_through_one_another(void **state) {
    rigid_scene *s = *state;
    jsl_shape ball = scene_sphere(s, 1);
    scene_body(s, &(jsl_body_desc){.shape = ball, .category = 2, .mask = 2});
    jsl_body b = scene_body(s, &(jsl_body_desc){.shape = ball, .position = {1, 0, 0}, .mask = 1});
    scene_steps(s, 10);
    only_contact(s, 0);
    assert_true(scene_get(s, b).pose.position.x == 1);
}

static void a_step_of_no_time_moves_nothing_but_finds_contacts(void **state) {
    rigid_scene *s = *state;
    s->context.gravity = jsl_v3(0, 0, -10);
    scene_body(s, &(jsl_body_desc){.shape = scene_plane(s), .kind = JSL_BODY_STATIC});
    jsl_body b = scene_body(s, &(jsl_body_desc){.shape = scene_sphere(s, 1),
                                                .position = {0, 0, JSL_R(0.99)},
                                                .velocity = {1, 0, 0},
                                                .spin = {0, 1, 0}});
    s->context.dt = 0;
    scene_steps(s, 3);
    jsl_body_state now = scene_get(s, b);
    assert_true(now.pose.position.x == 0 && now.pose.position.z == JSL_R(0.99) &&
                now.velocity.x == 1 && now.velocity.z == 0 && now.pose.orientation.w == 1);
    jsl_contact c = only_contact(s, 1);
    assert_true(jsl_abs(c.depth - JSL_R(0.01)) < 4 * JSL_REAL_EPSILON && c.normal_impulse == 0);
}

static void a_non_finite_body_is_frozen_and_named_and_the_rest_goes_on(void **state) {
    rigid_scene *s = *state;
    s->context.gravity = jsl_v3(0, 0, -10);
    jsl_shape ball = scene_sphere(s, 1);
    jsl_body bad = scene_body(s, &(jsl_body_desc){.shape = ball, .position = {0, 0, 5}});
    jsl_body near = scene_body(s, &(jsl_body_desc){.shape = ball, .position = {JSL_R(1.9), 0, 5}});
    jsl_component velocity;
    assert_int_equal(jsl_component_find(s->ecs, "velocity", &velocity), JSL_OK);
    scene_step(s);
    jsl_vec3 last = scene_get(s, bad).pose.position;
    *(jsl_real *)jsl_entity_field(s->ecs, bad.entity, velocity, 1) = (jsl_real)INFINITY;
    /* The collider set must not see it either: its box would be infinite. That is the world's part.
     */
    scene_steps(s, 5);
    jsl_body_state now = scene_get(s, bad);
    assert_true(s->warnings.count[JSL_WARN_BAD_STATE] == 1);
    assert_true(jsl_entity_equal(s->warnings.first[JSL_WARN_BAD_STATE], bad.entity));
    assert_true(now.flags & JSL_BODY_FROZEN);
    assert_true(now.pose.position.z == last.z && now.velocity.y == 0);
    now = scene_get(s, near);
    assert_true(jsl_v3_is_finite(now.pose.position) && jsl_v3_is_finite(now.velocity) &&
                now.velocity.z < 0);
    assert_int_equal(jsl_rigid_body_set_velocity(s->room, bad, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0)),
                     JSL_OK);
    scene_step(s);
    assert_true(scene_get(s, bad).velocity.z < 0);
}

static void a_limited_speed_is_reported(void **state) {
    rigid_scene *s = *state;
    jsl_rigid_settings set = {.max_speed = 10};
    assert_int_equal(jsl_rigid_room_set(s->room, &set), JSL_OK);
    jsl_body b =
        scene_body(s, &(jsl_body_desc){.shape = scene_sphere(s, 1), .velocity = {30, 40, 0}});
    scene_step(s);
    assert_true(jsl_abs(jsl_length(scene_get(s, b).velocity) - 10) < 20 * JSL_REAL_EPSILON);
    assert_true(s->warnings.count[JSL_WARN_VELOCITY_CLAMPED] == 1);
}

static void a_restored_cache_is_the_one_saved_and_damage_is_refused(void **state) {
    rigid_scene *s = *state;
    s->context.gravity = jsl_v3(0, 0, -10);
    scene_pyramid(s, 5, NULL);
    scene_steps(s, 20);
    size_t size = jsl_rigid_room_save_size(s->room);
    unsigned char *image = malloc(size);
    assert_int_equal(jsl_rigid_room_save(s->room, image, size - 1), JSL_ERR_ARGUMENT);
    assert_int_equal(jsl_rigid_room_save(s->room, image, size), JSL_OK);
    uint64_t hash = jsl_rigid_room_hash(s->room);
    for (size_t at = 0; at < size; at += 97) {
        image[at] ^= 4;
        assert_int_equal(jsl_rigid_room_restore(s->room, image, size), JSL_ERR_FORMAT);
        image[at] ^= 4;
    }
    for (size_t cut = 1; cut < size; cut += 211)
        assert_int_equal(jsl_rigid_room_restore(s->room, image, size - cut), JSL_ERR_FORMAT);
    assert_true(jsl_rigid_room_hash(s->room) == hash);
    assert_int_equal(jsl_rigid_room_restore(s->room, image, size), JSL_OK);
    assert_true(jsl_rigid_room_hash(s->room) == hash);
    free(image);
    scene_steps(s, 1);
    /* Warm starts survived: nothing was computed anew. */
    assert_true(scene_measure(s).rebuilt == 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
int main(void) {
    const struct CMUnitTest tests[] = {
        TEST(a_zero_desc_is_a_cube_of_water_at_rest),
        TEST(every_bad_field_is_refused_and_named),
        TEST(a_list_with_one_bad_desc_makes_no_body),
        TEST(stale_and_forged_handles_are_refused),
        TEST(setters_refuse_what_is_not_finite_or_not_movable),
        TEST(bad_settings_are_refused_and_named),
        TEST(a_force_at_a_point_pushes_and_turns_for_one_step),
        TEST(the_contact_table_tells_begin_weight_and_end),
        TEST(filtered_bodies_pass_through_one_another),
        TEST(a_step_of_no_time_moves_nothing_but_finds_contacts),
        TEST(a_non_finite_body_is_frozen_and_named_and_the_rest_goes_on),
        TEST(a_limited_speed_is_reported),
        TEST(a_restored_cache_is_the_one_saved_and_damage_is_refused),
    };
    return cmocka_run_group_tests_name("rigid body", tests, NULL, NULL);
}
