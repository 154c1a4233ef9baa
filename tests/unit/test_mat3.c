/* SPDX-License-Identifier: MIT
 * test_mat3.c - rotation matrices and principal moments.
 */
#include "base/base.h"
#include "helper.h"

#define EPS ((double)JSL_REAL_EPSILON)

static jsl_vec3 random_vector(uint64_t *seed, double size) {
    jsl_real x = (jsl_real)test_uniform(seed, -size, size),
             y = (jsl_real)test_uniform(seed, -size, size);
    return jsl_v3(x, y, (jsl_real)test_uniform(seed, -size, size));
}

static void a_matrix_rotates_as_its_quaternion_does(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 1000; i++) {
        jsl_quat q = jsl_quat_from_rotation_vector(random_vector(&seed, 3));
        jsl_mat3 m = jsl_mat3_from_quat(q);
        jsl_vec3 v = random_vector(&seed, 1);
        assert_close_v3(jsl_mat3_mul_vec(m, v), jsl_rotate(q, v), 10 * EPS);
        assert_close(jsl_dot(m.r0, m.r1), 0, 8 * EPS);
        assert_close_v3(jsl_cross(m.r0, m.r1), m.r2, 8 * EPS);
    }
}

static void a_rotated_diagonal_is_symmetric_and_scales_the_axes(void **state) {
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < 1000; i++) {
        jsl_quat q = jsl_quat_from_rotation_vector(random_vector(&seed, 3));
        jsl_mat3 m = jsl_mat3_rotate_diagonal(q, jsl_v3(1, 2, 5));
        assert_true(m.r0.y == m.r1.x && m.r0.z == m.r2.x && m.r1.z == m.r2.y);
        jsl_vec3 axis = jsl_rotate(q, jsl_v3(0, 0, 1));
        assert_close_v3(jsl_mat3_mul_vec(m, axis), jsl_scale(axis, 5), 100 * EPS);
    }
}

/* m = R diag(moments) R^T, ascending, and R proper, relative to the size of m. */
static void check_eigen(jsl_mat3 m, double size, double tol) {
    jsl_vec3 d;
    jsl_quat q;
    jsl_mat3_eigen_symmetric(m, &d, &q);
    assert_true(d.x <= d.y && d.y <= d.z);
    jsl_real n = jsl_sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    assert_close(n, 1, 4 * EPS);
    assert_true(q.w >= 0);
    jsl_mat3 back = jsl_mat3_rotate_diagonal(q, d);
    assert_close_v3(back.r0, m.r0, tol * size * EPS);
    assert_close_v3(back.r1, m.r1, tol * size * EPS);
    assert_close_v3(back.r2, m.r2, tol * size * EPS);
}

static jsl_mat3 symmetric(jsl_real xx, jsl_real yy, jsl_real zz, jsl_real xy, jsl_real xz,
                          jsl_real yz) {
    return (jsl_mat3){{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
}

static void random_tensors_are_rebuilt_from_their_moments(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 20000; i++) {
        jsl_vec3 a = random_vector(&seed, 1), b = random_vector(&seed, 1);
        check_eigen(symmetric(a.x, a.y, a.z, b.x, b.y, b.z), 2, 12);
    }
}

static void known_moments_come_back_at_every_scale(void **state) {
    (void)state;
    uint64_t seed = 4;
    const double scale[] = {1e-30, 1e-6, 1, 1e6, 1e30};
    for (int s = 0; s < JSL_COUNT(scale); s++) {
        for (int i = 0; i < 1000; i++) {
            jsl_real k = (jsl_real)scale[s];
            jsl_quat q = jsl_quat_from_rotation_vector(random_vector(&seed, 3));
            jsl_mat3 m = jsl_mat3_rotate_diagonal(q, jsl_v3(3 * k, k, 2 * k));
            jsl_vec3 d;
            jsl_quat frame;
            jsl_mat3_eigen_symmetric(m, &d, &frame);
            assert_close_v3(d, jsl_v3(k, 2 * k, 3 * k), 60 * EPS * scale[s]);
            check_eigen(m, 3 * scale[s], 12);
        }
    }
}

static void equal_zero_and_sorted_moments_need_no_rotation(void **state) {
    (void)state;
    jsl_vec3 d;
    jsl_quat q;
    const jsl_vec3 diagonals[] = {{0, 0, 0}, {2, 2, 2}, {1, 2, 3}, {0, 0, 1}};
    for (int i = 0; i < JSL_COUNT(diagonals); i++) {
        jsl_vec3 v = diagonals[i];
        jsl_mat3_eigen_symmetric(symmetric(v.x, v.y, v.z, 0, 0, 0), &d, &q);
        assert_true(d.x == v.x && d.y == v.y && d.z == v.z);
        assert_true(q.x == 0 && q.y == 0 && q.z == 0 && q.w == 1);
    }
    check_eigen(symmetric(3, 2, 1, 0, 0, 0), 3, 12);
    check_eigen(symmetric(2, 3, 1, 0, 0, 0), 3, 12);
    check_eigen(symmetric(1, 1, 1, 1, 1, 1), 3, 12); /* rank one: 0, 0, 3 */
}

static void nearly_equal_moments_and_needles_are_rebuilt(void **state) {
    (void)state;
    uint64_t seed = 5;
    for (int i = 0; i < 1000; i++) {
        jsl_quat q = jsl_quat_from_rotation_vector(random_vector(&seed, 3));
        check_eigen(jsl_mat3_rotate_diagonal(q, jsl_v3(1, 1 + 2 * JSL_REAL_EPSILON, 1)), 1, 16);
        check_eigen(jsl_mat3_rotate_diagonal(q, jsl_v3(JSL_R(1e-7), 1, 1)), 1, 16);
    }
}

static void a_tensor_that_is_not_finite_ends_without_harm(void **state) {
    (void)state;
    jsl_vec3 d;
    jsl_quat q;
    jsl_mat3_eigen_symmetric(symmetric((jsl_real)NAN, 1, 1, 0, 0, 0), &d, &q);
    assert_false(jsl_v3_is_finite(d));
    jsl_mat3_eigen_symmetric(symmetric(1, 1, 1, (jsl_real)INFINITY, 0, 0), &d, &q);
    assert_false(jsl_v3_is_finite(d));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_matrix_rotates_as_its_quaternion_does),
        cmocka_unit_test(a_rotated_diagonal_is_symmetric_and_scales_the_axes),
        cmocka_unit_test(random_tensors_are_rebuilt_from_their_moments),
        cmocka_unit_test(known_moments_come_back_at_every_scale),
        cmocka_unit_test(equal_zero_and_sorted_moments_need_no_rotation),
        cmocka_unit_test(nearly_equal_moments_and_needles_are_rebuilt),
        cmocka_unit_test(a_tensor_that_is_not_finite_ends_without_harm),
    };
    return cmocka_run_group_tests_name("mat3", tests, NULL, NULL);
}
