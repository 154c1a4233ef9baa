/* SPDX-License-Identifier: MIT
 * The geometry of steering round spheres and cylinders.
 */
#include "flock/avoid.h"
#include "helper.h"

/* B is made of about thirty operations, and |V - (V.U)U| is at least a thousandth of |V|, so that W
 * keeps all but 10 bits before its second pass, and all of them after: the issue asks for 1e-12 in
 * double. */
#ifdef JSL_DOUBLE
#define RELATIVE 1e-12
#else
#define RELATIVE 1e-5
#endif

static jsl_vec3 any(uint64_t *seed, double half) {
    jsl_vec3 v;
    v.x = (jsl_real)test_uniform(seed, -half, half);
    v.y = (jsl_real)test_uniform(seed, -half, half);
    v.z = (jsl_real)test_uniform(seed, -half, half);
    return v;
}

static void b_is_on_the_sphere_and_the_tangent_touches_there(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 100000; i++) {
        const jsl_vec3 p = any(&seed, 10), c = any(&seed, 10), v = any(&seed, 5);
        const double d = (double)jsl_length(jsl_sub(c, p));
        const double r = d * test_uniform(&seed, 0.01, 0.99);
        jsl_vec3 b[2];
        assert_true(jsl_tangent_points(p, v, c, (jsl_real)r, (uint64_t)i, &b[0], &b[1]));
        for (int k = 0; k < 2; k++) {
            const jsl_vec3 from_c = jsl_sub(b[k], c), from_p = jsl_sub(b[k], p);
            /* Coordinates are up to 10 whatever d is, and are rounded as such. */
            assert_close(jsl_length(from_c), r, RELATIVE * (r + 10));
            assert_close(jsl_dot(from_c, from_p), 0, RELATIVE * (d + 10) * (d + 10));
            assert_close(jsl_length_sq(from_p), d * d - r * r, RELATIVE * (d + 10) * (d + 10));
        }
        /* The near side is the one of less turn. */
        jsl_real near = jsl_dot(v, jsl_normalize(jsl_sub(b[0], p)));
        jsl_real far = jsl_dot(v, jsl_normalize(jsl_sub(b[1], p)));
        assert_true(near >= far - RELATIVE * 10);
    }
}

static void b_turns_least_of_all_points_of_the_tangent_circle(void **state) {
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < 200; i++) {
        const jsl_vec3 p = any(&seed, 3), v = any(&seed, 2);
        const jsl_vec3 c = jsl_add(p, jsl_scale(jsl_normalize(any(&seed, 1)), 10));
        const jsl_real r = 4;
        jsl_vec3 b, far;
        assert_true(jsl_tangent_points(p, v, c, r, 0, &b, &far));
        const jsl_real best = jsl_dot(v, jsl_normalize(jsl_sub(b, p)));
        const jsl_vec3 u = jsl_scale(jsl_sub(c, p), JSL_R(0.1)), e = jsl_perpendicular(u);
        const jsl_vec3 f = jsl_cross(u, e);
        for (int k = 0; k < 360; k++) {
            jsl_real s, q;
            jsl_sin_cos((jsl_real)k * JSL_PI / 180, &s, &q);
            /* The circle: k^2/d = 8.4 along, r k/d = 0.4 sqrt(84) aside. */
            const jsl_real aside = JSL_R(0.4) * jsl_sqrt(84);
            jsl_vec3 x =
                jsl_mul_add(jsl_mul_add(jsl_scale(u, JSL_R(8.4)), aside * q, e), aside * s, f);
            assert_true(jsl_dot(v, jsl_normalize(x)) <= best + 1e-4);
        }
    }
}

static void head_on_the_side_depends_on_the_boid_alone(void **state) {
    (void)state;
    const jsl_vec3 p = {0, 0, 0}, v = {3, 0, 0}, c = {10, 0, 0};
    int up = 0, left = 0;
    for (uint64_t who = 1; who <= 1000; who++) {
        jsl_vec3 b, again, far;
        assert_true(jsl_tangent_points(p, v, c, 2, who, &b, &far));
        assert_true(jsl_tangent_points(p, v, c, 2, who, &again, &far));
        assert_close_v3(b, again, 0);
        assert_close(jsl_length(jsl_sub(b, c)), 2, RELATIVE * 12);
        up += b.z > 0;
        left += b.y > 0;
    }
    /* Binomial of 1000: 500 +- 16, five sigma. */
    assert_in_range(up, 420, 580);
    assert_in_range(left, 420, 580);
}

static void inside_there_is_no_tangent(void **state) {
    (void)state;
    jsl_vec3 b, far;
    const jsl_vec3 p = {1, 2, 3}, v = {1, 0, 0};
    assert_false(jsl_tangent_points(p, v, p, 2, 1, &b, &far));
    assert_false(jsl_tangent_points(p, v, jsl_v3(2, 2, 3), 1, 1, &b, &far));
    assert_false(jsl_tangent_points(p, v, jsl_v3(2, 2, 3), 5, 1, &b, &far));
    assert_false(jsl_tangent_points_around(p, v, jsl_v3(1, 2, 9), jsl_v3(0, 0, 1), 5, 1, &b, &far));
}

static void round_a_cylinder_b_stays_level(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 10000; i++) {
        const jsl_vec3 axis = jsl_normalize(any(&seed, 1));
        const jsl_vec3 p = any(&seed, 5), v = any(&seed, 5);
        const jsl_vec3 aside = jsl_cross(axis, any(&seed, 8));
        const jsl_real d = jsl_length(aside), r = d * (jsl_real)test_uniform(&seed, 0.05, 0.95);
        const jsl_vec3 c = jsl_mul_add(jsl_add(p, aside), 3, axis);
        jsl_vec3 b[2];
        assert_true(jsl_tangent_points_around(p, v, c, axis, r, (uint64_t)i, &b[0], &b[1]));
        for (int k = 0; k < 2; k++) {
            jsl_vec3 from_axis = jsl_sub(b[k], jsl_add(p, aside)), from_p = jsl_sub(b[k], p);
            assert_close(jsl_dot(from_p, axis), 0, RELATIVE * 20);
            assert_close(jsl_length(from_axis), r, RELATIVE * 20);
            assert_close(jsl_dot(from_axis, from_p), 0, RELATIVE * 400);
        }
    }
}

static void time_to_a_sphere(void **state) {
    (void)state;
    const jsl_vec3 p = {0, 0, 0}, c = {10, 0, 0};
    assert_close(jsl_time_to_sphere(p, jsl_v3(2, 0, 0), c, 4), 3, RELATIVE * 10);
    assert_close(jsl_time_to_sphere(p, jsl_v3(-2, 0, 0), c, 4), -1, 0);
    assert_close(jsl_time_to_sphere(p, jsl_v3(0, 2, 0), c, 4), -1, 0);
    assert_close(jsl_time_to_sphere(p, jsl_v3(0, 0, 0), c, 4), -1, 0);
    assert_close(jsl_time_to_sphere(p, jsl_v3(1, 0, 0), c, 11), 0, 0);
    assert_close(jsl_time_to_sphere(p, jsl_v3(-1, 0, 0), c, 11), -1, 0);
    uint64_t seed = 4;
    for (int i = 0; i < 10000; i++) {
        const jsl_vec3 v = any(&seed, 4), at = any(&seed, 10);
        const jsl_real r = (jsl_real)test_uniform(&seed, 0.5, 5);
        const jsl_real t = jsl_time_to_sphere(p, v, at, r);
        if (!(t > 0)) continue;
        assert_close(jsl_length(jsl_sub(jsl_scale(v, t), at)), r, RELATIVE * 100);
    }
}

static void the_centre_slides_to_where_the_course_passes(void **state) {
    (void)state;
    const jsl_vec3 c = {10, 0, 0}, z = {0, 0, 1};
    /* Level flight passes at its own height; climbing flight where it gets to. */
    assert_close(jsl_slide_along(c, z, 50, jsl_v3(0, 1, 7), jsl_v3(20, 0, 0)), 7, RELATIVE * 50);
    assert_close(jsl_slide_along(c, z, 50, jsl_v3(0, 1, 7), jsl_v3(20, 0, 20)), 17, RELATIVE * 50);
    assert_close(jsl_slide_along(c, z, 5, jsl_v3(0, 1, 7), jsl_v3(20, 0, 0)), 5, RELATIVE * 50);
    assert_close(jsl_slide_along(c, z, 5, jsl_v3(0, 1, -7), jsl_v3(0, 0, 0)), -5, RELATIVE * 50);
    uint64_t seed = 5;
    for (int i = 0; i < 500; i++) {
        const jsl_vec3 axis = jsl_normalize(any(&seed, 1)), p = any(&seed, 10),
                       path = any(&seed, 20);
        const jsl_real half = 6, s = jsl_slide_along(c, axis, half, p, path);
        jsl_real best = JSL_R(1e9), got = JSL_R(1e9);
        for (int a = 0; a <= 60; a++) {
            for (int t = 0; t <= 60; t++) {
                jsl_vec3 x = jsl_mul_add(p, (jsl_real)t / 60, path);
                jsl_vec3 y = jsl_mul_add(c, half * ((jsl_real)a / 30 - 1), axis);
                best = jsl_min(best, jsl_length(jsl_sub(x, y)));
                got = jsl_min(got, jsl_length(jsl_sub(x, jsl_mul_add(c, s, axis))));
            }
        }
        /* The samples are 0.2 m and up to 0.6 m apart. */
        assert_true(got <= best + JSL_R(0.6));
    }
}

static jsl_obstacle obstacle(jsl_shape_desc shape, jsl_vec3 at, jsl_vec3 velocity) {
    jsl_collider_item item = {.shape = shape,
                              .pose = {at, jsl_quat_identity()},
                              .velocity = velocity,
                              .radius = jsl_shape_radius(&shape)};
    jsl_obstacle out;
    jsl_obstacle_from(&item, &out);
    return out;
}

static void a_tall_pillar_is_no_giant_sphere(void **state) {
    (void)state;
    jsl_obstacle pillar = obstacle((jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {1, 1, 30}},
                                   jsl_v3(0, 0, 30), jsl_v3(0, 0, 0));
    assert_close(pillar.radius, sqrt(2), 1e-6);
    assert_close(pillar.half, 30, 0);
    assert_close(pillar.axis.z, 1, 0);
    /* 10 m beside it, flying past: nothing to do. */
    const int32_t list[] = {0};
    jsl_avoider boid = {.p = {-20, 10, 30},
                        .v = {10, 0, 0},
                        .room = 1,
                        .horizon = 3,
                        .budget = 20,
                        .interval = JSL_R(0.02),
                        .who = 1};
    assert_close_v3(jsl_avoid(&boid, &pillar, list, 1), jsl_v3(0, 0, 0), 0);
    /* Climbing straight at it: the turn is to a side, not up along it. */
    boid.p = jsl_v3(-12, 0, 20);
    boid.v = jsl_v3(6, 0, 6);
    jsl_vec3 a = jsl_avoid(&boid, &pillar, list, 1);
    assert_true(jsl_abs(a.y) > 1);
    assert_true(jsl_abs(a.z) < JSL_R(0.01));
}

static void a_moving_obstacle_is_met_by_relative_velocity(void **state) {
    (void)state;
    const jsl_shape_desc ball = {.kind = JSL_SHAPE_SPHERE, .radius = 1};
    const int32_t list[] = {0};
    jsl_avoider boid = {.p = {0, 0, 0},
                        .v = {5, 0, 0},
                        .room = JSL_R(0.5),
                        .horizon = 3,
                        .budget = 20,
                        .interval = JSL_R(0.02),
                        .who = 9};
    /* Ahead but running away faster; beside but coming across. */
    jsl_obstacle fleeing = obstacle(ball, jsl_v3(6, 0, 0), jsl_v3(8, 0, 0));
    assert_close_v3(jsl_avoid(&boid, &fleeing, list, 1), jsl_v3(0, 0, 0), 0);
    jsl_obstacle crossing = obstacle(ball, jsl_v3(10, 10, 0), jsl_v3(0, -5, 0));
    assert_true(jsl_length(jsl_avoid(&boid, &crossing, list, 1)) > JSL_R(0.5));
    jsl_obstacle still = obstacle(ball, jsl_v3(10, 10, 0), jsl_v3(0, 0, 0));
    assert_close_v3(jsl_avoid(&boid, &still, list, 1), jsl_v3(0, 0, 0), 0);
}

static void nothing_to_do_when_flying_away_or_too_far(void **state) {
    (void)state;
    const int32_t list[] = {0};
    jsl_obstacle ball = obstacle((jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 2},
                                 jsl_v3(10, 0, 0), jsl_v3(0, 0, 0));
    jsl_avoider boid = {.p = {0, 0, 0},
                        .v = {-5, 0, 0},
                        .room = 1,
                        .horizon = 2,
                        .budget = 20,
                        .interval = JSL_R(0.02),
                        .who = 1};
    assert_close_v3(jsl_avoid(&boid, &ball, list, 1), jsl_v3(0, 0, 0), 0);
    boid.v = jsl_v3(3, 0, 0); /* 7 m at 3 m/s is beyond 2 s */
    assert_close_v3(jsl_avoid(&boid, &ball, list, 1), jsl_v3(0, 0, 0), 0);
    boid.v = jsl_v3(4, 0, 0);
    assert_true(jsl_length(jsl_avoid(&boid, &ball, list, 1)) > JSL_R(0.1));
}

static void inside_the_way_is_out(void **state) {
    (void)state;
    const int32_t list[] = {0};
    jsl_obstacle ball = obstacle((jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 2},
                                 jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
    jsl_avoider boid = {.p = {1, 0, 0},
                        .v = {0, 0, 0},
                        .room = 1,
                        .horizon = 2,
                        .budget = 20,
                        .interval = JSL_R(0.02),
                        .who = 1};
    jsl_vec3 a = jsl_avoid(&boid, &ball, list, 1);
    assert_true(a.x > 1);
    assert_close(a.y, 0, 1e-6);
    boid.p = jsl_v3(0, 0, 0); /* at the very centre: some way, and finite */
    a = jsl_avoid(&boid, &ball, list, 1);
    assert_true(jsl_v3_is_finite(a) && jsl_length(a) > 1);
}

static void along_a_plane_the_turn_is_tangential(void **state) {
    (void)state;
    const int32_t list[] = {0};
    jsl_obstacle ground =
        obstacle((jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
    jsl_avoider boid = {.p = {0, 0, 5},
                        .v = {4, 0, -4},
                        .room = 1,
                        .horizon = 2,
                        .budget = 20,
                        .interval = JSL_R(0.02),
                        .who = 1};
    jsl_vec3 a = jsl_avoid(&boid, &ground, list, 1);
    assert_true(a.z > 0 && a.x > 0);
    assert_close(a.y, 0, 1e-6);
    boid.v = jsl_v3(4, 0, JSL_R(0.1)); /* level or climbing: leave it alone */
    assert_close_v3(jsl_avoid(&boid, &ground, list, 1), jsl_v3(0, 0, 0), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(b_is_on_the_sphere_and_the_tangent_touches_there),
        cmocka_unit_test(b_turns_least_of_all_points_of_the_tangent_circle),
        cmocka_unit_test(head_on_the_side_depends_on_the_boid_alone),
        cmocka_unit_test(inside_there_is_no_tangent),
        cmocka_unit_test(round_a_cylinder_b_stays_level),
        cmocka_unit_test(time_to_a_sphere),
        cmocka_unit_test(the_centre_slides_to_where_the_course_passes),
        cmocka_unit_test(a_tall_pillar_is_no_giant_sphere),
        cmocka_unit_test(a_moving_obstacle_is_met_by_relative_velocity),
        cmocka_unit_test(nothing_to_do_when_flying_away_or_too_far),
        cmocka_unit_test(inside_the_way_is_out),
        cmocka_unit_test(along_a_plane_the_turn_is_tangential),
    };
    return cmocka_run_group_tests_name("flock_avoid", tests, NULL, NULL);
}
