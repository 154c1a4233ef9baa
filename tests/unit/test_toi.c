/* SPDX-License-Identifier: MIT
 * The instant of impact: closed forms, what the classic methods miss, and random sweeps against
 * dense sampling.
 */
#include "random_shape.h"

#include <stdlib.h>

static const double eps = (double)JSL_REAL_EPSILON;
/* Far above the rounding of distances of a few metres, in both precisions. */
static const double tolerance = sizeof(jsl_real) == 4 ? 2e-5 : 1e-9;

static jsl_toi toi(const jsl_shape_desc *a, jsl_sweep sa, const jsl_shape_desc *b, jsl_sweep sb,
                   double dt, jsl_toi_method m) {
    jsl_toi out;
    assert_ok(jsl_time_of_impact(a, &sa, b, &sb, (jsl_real)dt, (jsl_real)tolerance, m, &out));
    return out;
}
static jsl_sweep still(double x, double y, double z) {
    return (jsl_sweep){.pose = {{(jsl_real)x, (jsl_real)y, (jsl_real)z}, {0, 0, 0, 1}}};
}

static void balls_meet_when_their_path_says_so(void **state) {
    (void)state;
    jsl_shape_desc ball = {.kind = JSL_SHAPE_SPHERE, .radius = JSL_R(0.5)};
    jsl_sweep a = still(0, 0, 0), b = still(3, 0.6, 0);
    a.velocity = jsl_v3(4, 0, 0);
    a.spin = jsl_v3(5, 6, 7); /* a ball may spin: it changes nothing */
    /* Centres are 1 apart when 4t = 3 - 0.8. */
    jsl_toi c = toi(&ball, a, &ball, b, 1, JSL_TOI_CONSERVATIVE);
    assert_int_equal(c.state, JSL_TOI_HIT);
    /* They close at 4 cos = 3.2 m/s: the tolerance is reached that much early. */
    assert_close(c.time, 0.55 - tolerance / 3.2, tolerance / 3.2 + 16 * eps);
    assert_int_equal(toi(&ball, a, &ball, b, 0.5, JSL_TOI_CONSERVATIVE).state, JSL_TOI_SEPARATED);
    b.velocity = jsl_v3(5, 0, 0);
    assert_int_equal(toi(&ball, a, &ball, b, 100, JSL_TOI_CONSERVATIVE).state, JSL_TOI_SEPARATED);
    b = still(0.5, 0, 0);
    assert_int_equal(toi(&ball, a, &ball, b, 1, JSL_TOI_CONSERVATIVE).state, JSL_TOI_OVERLAPPED);
}

/* A bar (half length 1, radius 0.1) that turns at w = 10 rad/s about y, 1 above a plane: an end
 * touches whenever |sin wt| = 0.9. */
static void a_spinning_bar_touches_first_where_only_advancement_finds_it(void **state) {
    (void)state;
    jsl_shape_desc bar = {JSL_SHAPE_CAPSULE, JSL_R(0.1), {0, 0, 1}},
                   plane = {.kind = JSL_SHAPE_PLANE};
    jsl_sweep a = still(0, 0, 1), b = still(0, 0, 0);
    jsl_real r = jsl_sqrt(JSL_R(0.5));
    a.pose.orientation = (jsl_quat){0, r, 0, r};
    a.spin = jsl_v3(0, 10, 0);
    const double pi = 3.14159265358979323846, first = asin(0.9) / 10,
                 second = (pi + asin(0.9)) / 10;
    /* Near the contact the end sinks at w cos = 4.36 m/s. */
    double tol = 2 * tolerance / 4.3 + 64 * eps;
    jsl_toi c = toi(&bar, a, &plane, b, 0.5, JSL_TOI_CONSERVATIVE);
    assert_int_equal(c.state, JSL_TOI_HIT);
    assert_close(c.time, first, tol);
    assert_true((double)c.time <= first + 64 * eps);
    assert_true(c.evaluations < 100);
    /* At the end of the step the other end is under: bisection finds that root, three times too
     * late. */
    jsl_toi half = toi(&bar, a, &plane, b, 0.5, JSL_TOI_BISECTION);
    assert_int_equal(half.state, JSL_TOI_HIT);
    assert_close(half.time, second, tol);
    jsl_toi line = toi(&bar, a, &plane, b, 0.5, JSL_TOI_LINEAR);
    assert_int_equal(line.state, JSL_TOI_HIT);
    assert_true((double)line.time > 2 * first);
    /* After a half turn it lies flat again: both ends of the step are apart, and the classics see
     * nothing. */
    double turn = pi / 10;
    assert_int_equal(toi(&bar, a, &plane, b, turn, JSL_TOI_BISECTION).state, JSL_TOI_SEPARATED);
    assert_int_equal(toi(&bar, a, &plane, b, turn, JSL_TOI_LINEAR).state, JSL_TOI_SEPARATED);
    c = toi(&bar, a, &plane, b, turn, JSL_TOI_CONSERVATIVE);
    assert_int_equal(c.state, JSL_TOI_HIT);
    assert_close(c.time, first, tol);
    /* With a single crossing in the step all of them find it; the line only roughly. */
    half = toi(&bar, a, &plane, b, 0.15, JSL_TOI_BISECTION);
    assert_close(half.time, first, tol);
    line = toi(&bar, a, &plane, b, 0.15, JSL_TOI_LINEAR);
    assert_close(line.time, first, 0.05);
}

static void a_bullet_does_not_pass_a_thin_wall(void **state) {
    (void)state;
    jsl_shape_desc ball = {.kind = JSL_SHAPE_SPHERE, .radius = JSL_R(0.05)};
    jsl_shape_desc wall = {JSL_SHAPE_BOX, 0, {JSL_R(0.01), 5, 5}};
    for (double v = 10; v < 2e6; v *= 10) {
        jsl_sweep a = still(-2, 0.3, 0.2), b = still(0, 0, 0);
        a.velocity = jsl_v3((jsl_real)v, 0, 0);
        double dt = 4 / v;
        jsl_toi c = toi(&ball, a, &wall, b, dt, JSL_TOI_CONSERVATIVE);
        assert_int_equal(c.state, JSL_TOI_HIT);
        assert_close(c.time, 1.94 / v, (tolerance + 16 * eps) / v);
        assert_int_equal(toi(&ball, a, &wall, b, dt, JSL_TOI_BISECTION).state, JSL_TOI_SEPARATED);
    }
}

static void no_random_sweep_passes_a_contact(void **state) {
    (void)state;
    const char *text = getenv("JSL_TEST_SEED");
    uint64_t seed = text ? strtoull(text, NULL, 0) : 41;
    print_message("seed %llu (JSL_TEST_SEED)\n", (unsigned long long)seed);
    int hits = 0, apart = 0, failed = 0;
    for (int i = 0; i < 3000; i++) {
        jsl_shape_desc a = random_shape(&seed, (jsl_shape_kind)(1 + i % 3), 1);
        jsl_shape_desc b = random_shape(&seed, (jsl_shape_kind)(1 + (i / 3) % 3), 1);
        jsl_sweep sa = {{random_vec3(&seed, 2), random_quat(&seed)},
                        random_vec3(&seed, 3),
                        random_vec3(&seed, 10)};
        jsl_sweep sb = {{random_vec3(&seed, 2), random_quat(&seed)},
                        random_vec3(&seed, 3),
                        random_vec3(&seed, 10)};
        sb.velocity = jsl_mul_add(sb.velocity, 3, jsl_sub(sa.pose.position, sb.pose.position));
        jsl_toi c = toi(&a, sa, &b, sb, 0.5, JSL_TOI_CONSERVATIVE);
        if (c.state == JSL_TOI_OVERLAPPED) continue;
        hits += c.state == JSL_TOI_HIT;
        apart += c.state == JSL_TOI_SEPARATED;
        failed += c.state == JSL_TOI_FAILED;
        if (c.state == JSL_TOI_HIT) assert_true(c.gap.distance <= (jsl_real)tolerance);
        /* Nothing touches before. */
        for (int k = 0; k < 100; k++) {
            jsl_real t = c.time * (jsl_real)k / 100;
            jsl_gap gap;
            jsl_pose pa = {
                jsl_mul_add(sa.pose.position, t, sa.velocity),
                jsl_quat_normalize(jsl_quat_mul(
                    jsl_quat_from_rotation_vector(jsl_scale(sa.spin, t)), sa.pose.orientation))};
            jsl_pose pb = {
                jsl_mul_add(sb.pose.position, t, sb.velocity),
                jsl_quat_normalize(jsl_quat_mul(
                    jsl_quat_from_rotation_vector(jsl_scale(sb.spin, t)), sb.pose.orientation))};
            assert_ok(jsl_shape_distance(&a, pa, &b, pb, &gap));
            if (!(gap.distance > 0))
                fail_msg("sweep %d overlaps by %g at %g, before %g", i, -(double)gap.distance,
                         (double)t, (double)c.time);
        }
    }
    print_message("%d hits, %d apart, %d failed\n", hits, apart, failed);
    assert_true(hits > 500 && apart > 500 && failed < 3);
}

static void bad_sweeps_are_refused_and_change_nothing(void **state) {
    (void)state;
    jsl_shape_desc ball = {.kind = JSL_SHAPE_SPHERE, .radius = 1},
                   plane = {.kind = JSL_SHAPE_PLANE}, bad = {.kind = JSL_SHAPE_SPHERE};
    jsl_sweep s = still(0, 0, 5), nan = s, spin = s;
    nan.velocity.y = (jsl_real)NAN;
    spin.spin.x = 1;
    jsl_toi out = {.time = 7};
    assert_result(jsl_time_of_impact(&bad, &s, &ball, &s, 1, 1, JSL_TOI_CONSERVATIVE, &out),
                  JSL_ERR_ARGUMENT);
    assert_result(jsl_time_of_impact(&ball, &nan, &ball, &s, 1, 1, JSL_TOI_CONSERVATIVE, &out),
                  JSL_ERR_NOT_FINITE);
    assert_result(jsl_time_of_impact(&ball, &s, &plane, &spin, 1, 1, JSL_TOI_CONSERVATIVE, &out),
                  JSL_ERR_ARGUMENT);
    assert_result(jsl_time_of_impact(&plane, &s, &plane, &s, 1, 1, JSL_TOI_CONSERVATIVE, &out),
                  JSL_ERR_ARGUMENT);
    assert_result(jsl_time_of_impact(&ball, &s, &ball, &s, -1, 1, JSL_TOI_CONSERVATIVE, &out),
                  JSL_ERR_ARGUMENT);
    assert_result(jsl_time_of_impact(&ball, &s, &ball, &s, 1, 0, JSL_TOI_CONSERVATIVE, &out),
                  JSL_ERR_ARGUMENT);
    assert_result(
        jsl_time_of_impact(&ball, &s, &ball, &s, (jsl_real)NAN, 1, JSL_TOI_CONSERVATIVE, &out),
        JSL_ERR_NOT_FINITE);
    assert_result(jsl_time_of_impact(&ball, &s, &ball, &s, 1, 1, (jsl_toi_method)9, &out),
                  JSL_ERR_ARGUMENT);
    assert_true(out.time == 7);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(balls_meet_when_their_path_says_so),
        cmocka_unit_test(a_spinning_bar_touches_first_where_only_advancement_finds_it),
        cmocka_unit_test(a_bullet_does_not_pass_a_thin_wall),
        cmocka_unit_test(no_random_sweep_passes_a_contact),
        cmocka_unit_test(bad_sweeps_are_refused_and_change_nothing),
    };
    return cmocka_run_group_tests_name("toi", tests, NULL, NULL);
}
