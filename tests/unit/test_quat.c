/* SPDX-License-Identifier: MIT
 * test_quat.c - vectors and quaternions.
 */
#include "base/base.h"
#include "helper.h"

#include <float.h>

#define EPS ((double)JSL_REAL_EPSILON)

static jsl_vec3 random_vector(uint64_t *seed, double size) {
    jsl_real x = (jsl_real)test_uniform(seed, -size, size),
             y = (jsl_real)test_uniform(seed, -size, size);
    return jsl_v3(x, y, (jsl_real)test_uniform(seed, -size, size));
}

static jsl_quat random_quat(uint64_t *seed) {
    return jsl_quat_from_rotation_vector(random_vector(seed, 3));
}

static double length4(jsl_quat q) {
    return sqrt((double)q.x * (double)q.x + (double)q.y * (double)q.y + (double)q.z * (double)q.z +
                (double)q.w * (double)q.w);
}

static void a_quarter_turn_about_z_takes_x_to_y(void **state) {
    (void)state;
    jsl_quat q = jsl_quat_from_axis_angle(jsl_v3(0, 0, 9), JSL_PI / 2);
    assert_close_v3(jsl_rotate(q, jsl_v3(1, 0, 0)), jsl_v3(0, 1, 0), 2 * EPS);
    assert_close_v3(jsl_rotate_inv(q, jsl_v3(0, 1, 0)), jsl_v3(1, 0, 0), 2 * EPS);
    q = jsl_quat_from_axis_angle(jsl_v3(1, 0, 0), JSL_PI / 2);
    assert_close_v3(jsl_rotate(q, jsl_v3(0, 1, 0)), jsl_v3(0, 0, 1), 2 * EPS);
}

static void a_product_rotates_by_the_right_factor_first(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 1000; i++) {
        jsl_quat a = random_quat(&seed), b = random_quat(&seed);
        jsl_vec3 v = random_vector(&seed, 1);
        assert_close_v3(jsl_rotate(jsl_quat_mul(a, b), v), jsl_rotate(a, jsl_rotate(b, v)),
                        20 * EPS);
        assert_close_v3(jsl_rotate_inv(a, jsl_rotate(a, v)), v, 20 * EPS);
    }
}

static void a_rotation_keeps_lengths_and_handedness(void **state) {
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < 1000; i++) {
        jsl_quat q = random_quat(&seed);
        jsl_vec3 a = random_vector(&seed, 1), b = random_vector(&seed, 1);
        assert_close(jsl_length(jsl_rotate(q, a)), jsl_length(a), 10 * EPS);
        assert_close_v3(jsl_cross(jsl_rotate(q, a), jsl_rotate(q, b)),
                        jsl_rotate(q, jsl_cross(a, b)), 30 * EPS);
    }
}

static void rotation_vectors_agree_with_sines_in_long_double(void **state) {
    (void)state;
    uint64_t seed = 3;
    const double sizes[] = {1e-30, 1e-8, 1e-3, 1, 3.2, 100, 1e5};
    for (int s = 0; s < JSL_COUNT(sizes); s++) {
        for (int i = 0; i < 1000; i++) {
            jsl_vec3 v = random_vector(&seed, sizes[s]);
            jsl_quat q = jsl_quat_from_rotation_vector(v);
            long double x = (long double)v.x, y = (long double)v.y, z = (long double)v.z;
            long double angle = sqrtl(x * x + y * y + z * z);
            long double k = sinl(angle / 2) / angle;
            /* The angle itself is rounded: its error is that of its last places. */
            double tol = (4 + 2 * (double)angle) * EPS;
            double relative = sizes[s] < 1 ? 4 * EPS * sizes[s] : tol;
            assert_close(q.x, x * k, relative);
            assert_close(q.y, y * k, relative);
            assert_close(q.z, z * k, relative);
            assert_close(q.w, cosl(angle / 2), tol);
            assert_close(length4(q), 1, 4 * EPS);
        }
    }
}

static void extreme_rotation_vectors_give_unit_quaternions(void **state) {
    (void)state;
    jsl_quat q = jsl_quat_from_rotation_vector(jsl_v3(0, 0, 0));
    assert_true(q.x == 0 && q.y == 0 && q.z == 0 && q.w == 1);
#ifdef JSL_DOUBLE
    const jsl_real large = DBL_MAX / 4, small = 0x1p-1060;
#else
    const jsl_real large = FLT_MAX / 4, small = 0x1p-140f;
#endif
    const jsl_real sizes[] = {small, JSL_R(1e-25), JSL_R(1e25), large};
    for (int i = 0; i < JSL_COUNT(sizes); i++) {
        q = jsl_quat_from_rotation_vector(jsl_v3(sizes[i], -sizes[i], sizes[i]));
        assert_close(length4(q), 1, 4 * EPS);
        q = jsl_quat_from_axis_angle(jsl_v3(sizes[i], 0, sizes[i]), 1);
        assert_close(q.x, sqrt(0.5) * sin(0.5), 2 * EPS);
        assert_close(length4(q), 1, 4 * EPS);
    }
    q = jsl_quat_from_rotation_vector(jsl_v3((jsl_real)NAN, 0, 0));
    assert_true(q.w != q.w);
    q = jsl_quat_from_axis_angle(jsl_v3(0, 0, 0), 1);
    assert_true(q.w == 1);
}

static void opposite_axes_undo_each_other(void **state) {
    (void)state;
    jsl_quat q = jsl_quat_from_axis_angle(jsl_v3(1, 2, 3), JSL_R(0.7));
    jsl_quat p = jsl_quat_from_axis_angle(jsl_v3(-1, -2, -3), JSL_R(0.7));
    jsl_quat e = jsl_quat_mul(p, q);
    assert_close(e.w, 1, 2 * EPS);
    assert_true(p.x == -q.x && p.w == q.w && jsl_quat_conj(q).y == p.y);
}

static void normalising_mends_and_never_divides_by_zero(void **state) {
    (void)state;
    jsl_quat q = jsl_quat_normalize((jsl_quat){3, 0, 0, 4});
    assert_close(q.x, 0.6, EPS);
    assert_close(q.w, 0.8, EPS);
    q = jsl_quat_normalize((jsl_quat){0, 0, 0, 0});
    assert_true(q.w == 1);
    q = jsl_quat_normalize((jsl_quat){(jsl_real)NAN, 0, 0, 1});
    assert_true(q.x == 0 && q.w == 1);
    assert_true(jsl_length(jsl_normalize(jsl_v3(0, 0, 0))) == 0);
    assert_close(jsl_length(jsl_normalize(jsl_v3(3, -4, 12))), 1, 2 * EPS);
}

static void a_perpendicular_is_a_unit_vector_at_right_angles(void **state) {
    (void)state;
    uint64_t seed = 4;
    for (int i = 0; i < 10000; i++) {
        jsl_vec3 n = jsl_normalize(random_vector(&seed, 1)), p = jsl_perpendicular(n);
        assert_close(jsl_length(p), 1, 2 * EPS);
        assert_close(jsl_dot(p, n), 0, 2 * EPS);
    }
    for (int i = 0; i < 6; i++) {
        jsl_real s = i < 3 ? 1 : -1;
        jsl_vec3 n = jsl_v3(i % 3 == 0 ? s : 0, i % 3 == 1 ? s : 0, i % 3 == 2 ? s : 0);
        assert_close(jsl_length(jsl_perpendicular(n)), 1, EPS);
    }
}

static void a_pose_and_its_inverse_cancel(void **state) {
    (void)state;
    uint64_t seed = 5;
    for (int i = 0; i < 1000; i++) {
        jsl_pose pose = {random_vector(&seed, 10), random_quat(&seed)};
        jsl_vec3 v = random_vector(&seed, 10);
        assert_close_v3(jsl_pose_point_inv(pose, jsl_pose_point(pose, v)), v, 200 * EPS);
    }
}

static void finite_means_neither_nan_nor_infinite(void **state) {
    (void)state;
    assert_true(jsl_is_finite(0) && jsl_is_finite(JSL_R(1e38)));
    assert_false(jsl_is_finite((jsl_real)NAN));
    assert_false(jsl_is_finite((jsl_real)INFINITY));
    assert_false(jsl_v3_is_finite(jsl_v3(0, -(jsl_real)INFINITY, 0)));
    assert_true(!signbit(jsl_abs(JSL_R(-0.0))));
    assert_true(jsl_clamp(5, 0, 1) == 1 && jsl_clamp(-5, 0, 1) == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_quarter_turn_about_z_takes_x_to_y),
        cmocka_unit_test(a_product_rotates_by_the_right_factor_first),
        cmocka_unit_test(a_rotation_keeps_lengths_and_handedness),
        cmocka_unit_test(rotation_vectors_agree_with_sines_in_long_double),
        cmocka_unit_test(extreme_rotation_vectors_give_unit_quaternions),
        cmocka_unit_test(opposite_axes_undo_each_other),
        cmocka_unit_test(normalising_mends_and_never_divides_by_zero),
        cmocka_unit_test(a_perpendicular_is_a_unit_vector_at_right_angles),
        cmocka_unit_test(a_pose_and_its_inverse_cancel),
        cmocka_unit_test(finite_means_neither_nan_nor_infinite),
    };
    return cmocka_run_group_tests_name("quat", tests, NULL, NULL);
}
