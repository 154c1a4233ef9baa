/* SPDX-License-Identifier: MIT
 * Contacts against closed forms: impacts, rest, stacks, friction and rolling.
 */
#include "rigid_scene.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static const double eps = (double)JSL_REAL_EPSILON;

static void head_on_spheres_part_as_the_closed_form_says(void **state) {
    (void)state;
    rigid_scene s;
    scene_open(&s, 1);
    s.restitution[1] = JSL_R(0.5);
    jsl_shape ball = scene_sphere(&s, JSL_R(0.5));
    jsl_body a = scene_body(
        &s, &(jsl_body_desc){.shape = ball, .material = {1}, .mass = 1, .velocity = {2, 0, 0}});
    jsl_body b = scene_body(
        &s, &(jsl_body_desc){
                .shape = ball, .material = {1}, .mass = 3, .position = {JSL_R(1.31), 0, 0}});
    scene_steps(&s, 60);
    /* m = 1, 3, v = 2, 0, e = .5: -.25 and .75. A handful of passes round the velocities. */
    assert_true(fabs((double)scene_get(&s, a).velocity.x + .25) < 64 * eps);
    assert_true(fabs((double)scene_get(&s, b).velocity.x - .75) < 64 * eps);
    assert_true(fabs((double)scene_get(&s, b).velocity.z) < 64 * eps);
    scene_close(&s);
}

/* A box corner on a box face: the solver's impulse is the lecture's, taken at the contact point it
 * found. */
static void an_oblique_frictionless_impact_has_the_lectures_impulse(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        rigid_scene s;
        scene_open(&s, 1);
        s.friction[1] = 0, s.restitution[1] = JSL_R(0.5) * (jsl_real)k;
        jsl_quat turned = jsl_quat_from_axis_angle(jsl_v3(1, 2, 3), JSL_R(0.9));
        jsl_body a = scene_body(
            &s, &(jsl_body_desc){.shape = scene_box(&s, JSL_R(0.3), JSL_R(0.2), JSL_R(0.1)),
                                 .material = {1},
                                 .mass = 1,
                                 .orientation = turned,
                                 .position = {1, JSL_R(0.1), JSL_R(0.2)},
                                 .velocity = {-2, 0, 0}});
        jsl_body b = scene_body(
            &s, &(jsl_body_desc){.shape = scene_box(&s, JSL_R(0.5), JSL_R(0.4), JSL_R(0.6)),
                                 .material = {1},
                                 .mass = 3});
        const jsl_contact *c = NULL;
        int64_t count = 0;
        jsl_body_state ba = scene_get(&s, a), bb = scene_get(&s, b);
        bool met = false;
        for (int i = 0; i < 40; i++) {
            if (!met) ba = scene_get(&s, a), bb = scene_get(&s, b);
            scene_step(&s);
            assert_int_equal(jsl_rigid_room_contacts(s.room, &c, &count), JSL_OK);
            bool now = count > 0 && c[0].normal_impulse > 0;
            if (met && !now) break;
            met = met || now;
        }
        assert_true(met);
        jsl_body_state na = scene_get(&s, a), nb = scene_get(&s, b);
        jsl_vec3 dp = jsl_scale(jsl_sub(na.velocity, ba.velocity), na.mass);
        jsl_impulse_body la = {
            ba.pose.position, ba.velocity,
            ba.spin,          ba.pose.orientation,
            1 / ba.mass,      {1 / ba.inertia.x, 1 / ba.inertia.y, 1 / ba.inertia.z}};
        jsl_impulse_body lb = {
            bb.pose.position, bb.velocity,
            bb.spin,          bb.pose.orientation,
            1 / bb.mass,      {1 / bb.inertia.x, 1 / bb.inertia.y, 1 / bb.inertia.z}};
        /* The vertex that hit, from the geometry: the lowest in x. */
        jsl_vec3 vertex = {9, 0, 0};
        for (int v = 0; v < 8; v++) {
            jsl_vec3 p = jsl_pose_point(ba.pose, jsl_v3(v & 1 ? JSL_R(0.3) : JSL_R(-0.3),
                                                        v & 2 ? JSL_R(0.2) : JSL_R(-0.2),
                                                        v & 4 ? JSL_R(0.1) : JSL_R(-0.1)));
            if (p.x < vertex.x) vertex = p;
        }
        double j = (double)jsl_impulse_two_bodies(&la, &lb, vertex, jsl_v3(1, 0, 0),
                                                  JSL_R(0.5) * (jsl_real)k);
        /* An impact without bounce takes two steps: the first slows the approach to what the gap
         * allows. Meanwhile the box turns by 0.5 rad/s / 60, which moves the moment arm by up to 1
         * %. */
        if (!(fabs((double)dp.x - j) < 0.01 * j))
            fail_msg("e = %g: impulse %g, lecture %g", 0.5 * k, (double)dp.x, j);
        assert_true(fabs((double)(nb.velocity.x * nb.mass) + j) < 0.01 * j);
        scene_close(&s);
    }
}

static void a_ball_leaves_the_plane_with_e_times_its_speed(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        rigid_scene s;
        scene_open(&s, 1);
        jsl_real e = JSL_R(0.5) * (jsl_real)k;
        s.restitution[1] = e;
        s.context.gravity = jsl_v3(0, 0, -10);
        scene_body(&s, &(jsl_body_desc){
                           .shape = scene_plane(&s), .material = {1}, .kind = JSL_BODY_STATIC});
        jsl_body b = scene_body(&s, &(jsl_body_desc){.shape = scene_sphere(&s, JSL_R(0.5)),
                                                     .material = {1},
                                                     .position = {0, 0, 2}});
        double least = 0, most = 0, top = 0;
        for (int i = 0; i < 90; i++) {
            scene_step(&s);
            double v = (double)scene_get(&s, b).velocity.z,
                   z = (double)scene_get(&s, b).pose.position.z;
            if (v < least) least = v;
            if (v > most) most = v;
            if (most > 0 && z > top) top = z;
        }
        /* It comes down with sqrt(2 g 1.5); the speed taken for the bounce is that at the step's
         * start, at most g dt less. */
        double fall = sqrt(2 * 10 * 1.5), late = 10.0 / 60;
        assert_true(fabs(least + fall) < 2 * late);
        if (!(most <= (double)e * fall + 1e-3 && most >= (double)e * (fall - 2 * late) - 0.02))
            fail_msg("e = %g: came with %g, left with %g", (double)e, least, most);
        if (k == 0) assert_true(fabs((double)scene_get(&s, b).pose.position.z - .5) < 2e-3);
        /* Never higher than it was dropped from. */
        assert_true(top <= 2 + 1e-3);
        scene_close(&s);
    }
}

static void a_box_that_lands_flat_leaves_flat(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        rigid_scene s;
        scene_open(&s, 1);
        jsl_real e = JSL_R(0.5) * (jsl_real)k;
        s.restitution[1] = e;
        scene_body(&s, &(jsl_body_desc){
                           .shape = scene_plane(&s), .material = {1}, .kind = JSL_BODY_STATIC});
        jsl_body b =
            scene_body(&s, &(jsl_body_desc){.shape = scene_box(&s, 1, JSL_R(0.5), JSL_R(0.25)),
                                            .material = {1},
                                            .position = {0, 0, JSL_R(0.5)},
                                            .velocity = {0, 0, -1}});
        scene_steps(&s, 40);
        jsl_body_state now = scene_get(&s, b);
        /* All four corners: e exactly, but for the 12 sweeps over a manifold's points. Without
         * bounce what is left is that of the last sub-step's single sweep, which stops the corners
         * one after the other. */
        double loose = k == 0 ? 0.05 : 2e-3;
        if (!(fabs((double)now.velocity.z - (double)e) < loose))
            fail_msg("e = %g: left with %g", (double)e, (double)now.velocity.z);
        if (!((double)jsl_length(now.spin) < loose))
            fail_msg("e = %g: spins at %g", (double)e, (double)jsl_length(now.spin));
        scene_close(&s);
    }
}

static void a_box_at_rest_does_not_drift(void **state) {
    (void)state;
    rigid_scene s;
    scene_open(&s, 1);
    s.context.gravity = jsl_v3(0, 0, -10);
    scene_body(&s, &(jsl_body_desc){.shape = scene_plane(&s), .kind = JSL_BODY_STATIC});
    jsl_body b =
        scene_body(&s, &(jsl_body_desc){.shape = scene_box(&s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)),
                                        .position = {0, 0, JSL_R(0.5)}});
    scene_steps(&s, 100);
    jsl_body_state first = scene_get(&s, b);
    scene_steps(&s, 1000);
    jsl_body_state last = scene_get(&s, b);
    /* Micrometres: a thousand steps of rounding, no motion. */
    assert_true(jsl_length(jsl_sub(last.pose.position, first.pose.position)) < JSL_R(1e-5));
    assert_true(jsl_length(last.velocity) < JSL_R(1e-4) && jsl_length(last.spin) < JSL_R(1e-4));
    /* Soft contacts sink by g / w^2 at rest, w = 2 pi 60 Hz: 70 micrometres. */
    assert_true(last.pose.position.z > JSL_R(0.499) && last.pose.position.z < JSL_R(0.5005));
    scene_close(&s);
}

static void a_stack_of_ten_boxes_stands(void **state) {
    (void)state;
    rigid_scene s;
    scene_open(&s, 1);
    s.context.gravity = jsl_v3(0, 0, -10);
    jsl_shape cube = scene_box(&s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5));
    scene_body(&s, &(jsl_body_desc){.shape = scene_plane(&s), .kind = JSL_BODY_STATIC});
    jsl_body top = {{0, 0}};
    for (int i = 0; i < 10; i++)
        top = scene_body(&s, &(jsl_body_desc){.shape = cube,
                                              .position = {JSL_R(0.02) * (jsl_real)(i % 2), 0,
                                                           JSL_R(0.5) + (jsl_real)i}});
    scene_steps(&s, 600);
    jsl_body_state now = scene_get(&s, top);
    assert_true(now.pose.position.z > JSL_R(9.4) && now.pose.position.z < JSL_R(9.51));
    assert_true(jsl_abs(now.pose.position.x) < JSL_R(0.1) &&
                jsl_abs(now.pose.position.y) < JSL_R(0.01));
    assert_true(jsl_length(now.velocity) < JSL_R(0.01));
    assert_true(scene_measure(&s).max_penetration < 0.01);
    scene_close(&s);
}

/* A level plane with gravity tilted by 30 degrees towards angle phi: the same as an incline, at any
 * direction. */
static jsl_body_state slide(double phi, jsl_real mu, jsl_shape_kind kind, int steps) {
    rigid_scene s;
    scene_open(&s, 1);
    s.friction[1] = mu;
    double tilt = 30 * 3.14159265358979323846 / 180, g = 9.81;
    s.context.gravity = jsl_v3((jsl_real)(g * sin(tilt) * cos(phi)),
                               (jsl_real)(g * sin(tilt) * sin(phi)), (jsl_real)(-g * cos(tilt)));
    scene_body(
        &s, &(jsl_body_desc){.shape = scene_plane(&s), .material = {1}, .kind = JSL_BODY_STATIC});
    jsl_shape shape = kind == JSL_SHAPE_BOX ? scene_box(&s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.25))
                                            : scene_sphere(&s, JSL_R(0.5));
    jsl_body b = scene_body(
        &s, &(jsl_body_desc){.shape = shape,
                             .material = {1},
                             .position = {0, 0, kind == JSL_SHAPE_BOX ? JSL_R(0.25) : JSL_R(0.5)}});
    scene_steps(&s, steps);
    jsl_body_state now = scene_get(&s, b);
    scene_close(&s);
    return now;
}

static void friction_is_the_same_in_twelve_directions(void **state) {
    (void)state;
    const double a = 2.3562872366624; /* 9.81 (sin 30 - .3 cos 30) */
    double slowest = 1e9, fastest = 0;
    for (int k = 0; k < 12; k++) {
        double phi = k * 3.14159265358979323846 / 6;
        jsl_body_state now = slide(phi, JSL_R(0.3), JSL_SHAPE_BOX, 60);
        double v =
            sqrt((double)(now.velocity.x * now.velocity.x + now.velocity.y * now.velocity.y));
        double across = -(double)now.velocity.x * sin(phi) + (double)now.velocity.y * cos(phi);
        if (v < slowest) slowest = v;
        if (v > fastest) fastest = v;
        /* The contact needs a few steps until its normal impulse carries the weight: below 1 % of a
         * second's speed. */
        if (!(fabs(v - a) < 0.01 * a))
            fail_msg("direction %d: v = %.6f after 1 s, not %.6f", k, v, a);
        assert_true(fabs(across) < 1e-3);
        jsl_body_state held = slide(phi, JSL_R(0.6), JSL_SHAPE_BOX, 60);
        assert_true(jsl_length(held.velocity) < JSL_R(1e-3));
        assert_true(jsl_length(jsl_sub(held.pose.position, jsl_v3(0, 0, JSL_R(0.25)))) <
                    JSL_R(0.01));
    }
    /* A friction pyramid would differ by 41 %. */
    if (!(fastest - slowest < 1e-3 * fastest)) fail_msg("from %.6f to %.6f", slowest, fastest);
}

static void a_ball_on_an_incline_rolls_or_slips_as_it_should(void **state) {
    (void)state;
    /* Rolls: a = 5/7 g sin 30; slips with mu = .1: a = g (sin - mu cos), w r = 5/2 mu g cos t. */
    jsl_body_state rolls = slide(0.4, JSL_R(0.3), JSL_SHAPE_SPHERE, 60),
                   slips = slide(0.4, JSL_R(0.1), JSL_SHAPE_SPHERE, 60);
    assert_true(fabs((double)jsl_length(rolls.velocity) - 3.50357142857143) < 1e-3);
    assert_true(fabs((double)jsl_length(rolls.spin) * 0.5 - 3.50357142857143) < 1e-3);
    assert_true(fabs((double)jsl_length(slips.velocity) - 4.05542907888747) < 2e-3);
    assert_true(fabs((double)jsl_length(slips.spin) * 0.5 - 2.12392730278134) < 2e-3);
}

static void a_billiard_ball_ends_up_rolling_at_five_sevenths(void **state) {
    (void)state;
    for (int k = 0; k < 12; k++) {
        rigid_scene s;
        scene_open(&s, 1);
        s.friction[1] = JSL_R(0.2);
        s.context.gravity = jsl_v3(0, 0, JSL_R(-9.81));
        double phi = k * 3.14159265358979323846 / 6;
        scene_body(&s, &(jsl_body_desc){
                           .shape = scene_plane(&s), .material = {1}, .kind = JSL_BODY_STATIC});
        jsl_body b = scene_body(&s, &(jsl_body_desc){.shape = scene_sphere(&s, JSL_R(0.5)),
                                                     .material = {1},
                                                     .position = {0, 0, JSL_R(0.5)},
                                                     .velocity = {(jsl_real)(2 * cos(phi)),
                                                                  (jsl_real)(2 * sin(phi)), 0}});
        scene_steps(&s, 60);
        jsl_body_state now = scene_get(&s, b);
        double v = (double)jsl_length(now.velocity), want = 5.0 / 7 * 2;
        /* mu-independent: any friction law that keeps the moment about the contact ends here, but
         * for rounding and the contact's sinking of 0.1 mm. */
        if (!(fabs(v - want) < 2e-3)) fail_msg("direction %d: v = %.6f, not %.6f", k, v, want);
        assert_true(fabs((double)jsl_length(now.spin) * 0.5 - want) < 2e-3);
        scene_close(&s);
    }
}

static void a_kinematic_platform_carries_a_box(void **state) {
    (void)state;
    rigid_scene s;
    scene_open(&s, 1);
    s.context.gravity = jsl_v3(0, 0, -10);
    jsl_body lift = scene_body(&s, &(jsl_body_desc){.shape = scene_box(&s, 2, 2, JSL_R(0.5)),
                                                    .kind = JSL_BODY_KINEMATIC,
                                                    .velocity = {1, 0, JSL_R(0.5)}});
    jsl_body b =
        scene_body(&s, &(jsl_body_desc){.shape = scene_box(&s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)),
                                        .position = {0, 0, 1}});
    scene_steps(&s, 120);
    jsl_body_state under = scene_get(&s, lift), now = scene_get(&s, b);
    assert_true(jsl_abs(under.pose.position.x - 2) < JSL_R(1e-4) &&
                jsl_abs(under.pose.position.z - 1) < JSL_R(1e-4));
    assert_true(jsl_abs(now.velocity.x - 1) < JSL_R(0.01) &&
                jsl_abs(now.velocity.z - JSL_R(0.5)) < JSL_R(0.01));
    assert_true(jsl_abs(now.pose.position.z - under.pose.position.z - 1) < JSL_R(0.01));
    scene_close(&s);
}

static void a_fast_ball_does_not_pass_a_thin_wall(void **state) {
    (void)state;
    rigid_scene s;
    scene_open(&s, 1);
    scene_body(&s, &(jsl_body_desc){.shape = scene_box(&s, JSL_R(0.01), 5, 5),
                                    .kind = JSL_BODY_STATIC,
                                    .position = {10, 0, 0}});
    jsl_body b = scene_body(
        &s, &(jsl_body_desc){.shape = scene_sphere(&s, JSL_R(0.1)), .velocity = {300, 0, 0}});
    scene_steps(&s, 60);
    assert_true(scene_get(&s, b).pose.position.x < 10);
    scene_close(&s);
}

static void two_hundred_boxes_at_one_point_stay_finite_and_slow(void **state) {
    (void)state;
    rigid_scene s;
    scene_open(&s, 1);
    jsl_shape cube = scene_box(&s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5));
    for (int i = 0; i < 200; i++) scene_body(&s, &(jsl_body_desc){.shape = cube});
    scene_steps(&s, 20);
    jsl_rigid_measure m = scene_measure(&s);
    assert_true(isfinite(m.kinetic) && m.bodies == 200);
    assert_true(s.warnings.count[JSL_WARN_BAD_STATE] == 0);
    /* Pushed out at 3 m/s a pair; a body feels many pairs, but does not fly. */
    assert_true(sqrt(2 * m.kinetic / m.mass) < 100);
    scene_close(&s);
}

static void a_pile_far_from_the_origin_rests_as_near(void **state) {
    (void)state;
    double moved[2];
    for (int k = 0; k < 2; k++) {
        rigid_scene s;
        scene_open(&s, 1);
        s.context.gravity = jsl_v3(0, 0, -10);
        jsl_real x = k ? 4096 : 0;
        jsl_shape cube = scene_box(&s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5));
        scene_body(&s, &(jsl_body_desc){.shape = scene_plane(&s), .kind = JSL_BODY_STATIC});
        jsl_body top = {{0, 0}};
        for (int i = 0; i < 5; i++)
            top = scene_body(
                &s, &(jsl_body_desc){.shape = cube, .position = {x, x, JSL_R(0.5) + (jsl_real)i}});
        scene_steps(&s, 300);
        jsl_body_state now = scene_get(&s, top);
        moved[k] = (double)jsl_length(jsl_sub(now.pose.position, jsl_v3(x, x, JSL_R(4.5))));
        assert_true(jsl_length(now.velocity) < JSL_R(1e-3));
        scene_close(&s);
    }
    /* Within the spacing of floats there, 0.5 mm. */
    assert_true(fabs(moved[1] - moved[0]) < 1e-3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(head_on_spheres_part_as_the_closed_form_says),
        cmocka_unit_test(an_oblique_frictionless_impact_has_the_lectures_impulse),
        cmocka_unit_test(a_ball_leaves_the_plane_with_e_times_its_speed),
        cmocka_unit_test(a_box_that_lands_flat_leaves_flat),
        cmocka_unit_test(a_box_at_rest_does_not_drift),
        cmocka_unit_test(a_stack_of_ten_boxes_stands),
        cmocka_unit_test(friction_is_the_same_in_twelve_directions),
        cmocka_unit_test(a_ball_on_an_incline_rolls_or_slips_as_it_should),
        cmocka_unit_test(a_billiard_ball_ends_up_rolling_at_five_sevenths),
        cmocka_unit_test(a_kinematic_platform_carries_a_box),
        cmocka_unit_test(a_fast_ball_does_not_pass_a_thin_wall),
        cmocka_unit_test(two_hundred_boxes_at_one_point_stay_finite_and_slow),
        cmocka_unit_test(a_pile_far_from_the_origin_rests_as_near),
    };
    return cmocka_run_group_tests_name("rigid contact", tests, NULL, NULL);
}
