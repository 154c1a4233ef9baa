/* SPDX-License-Identifier: MIT
 * Shapes: checks, mass properties, bounds.
 */
#include "random_shape.h"

static const double eps = (double)JSL_REAL_EPSILON;
static const double pi = 3.14159265358979323846;

static jsl_shape_desc make(jsl_shape_kind kind, double r, double x, double y, double z) {
    return (jsl_shape_desc){kind, (jsl_real)r, {(jsl_real)x, (jsl_real)y, (jsl_real)z}};
}
static jsl_result check(jsl_shape_kind kind, double r, double x, double y, double z) {
    jsl_shape_desc d = make(kind, r, x, y, z);
    return jsl_shape_check(&d);
}

static void good_shapes_pass_and_bad_ones_are_refused(void **state) {
    (void)state;
    assert_ok(check(JSL_SHAPE_SPHERE, 1, NAN, -1, 0)); /* unused lengths do not matter */
    assert_ok(check(JSL_SHAPE_BOX, -1, 1, 2, 3));
    assert_ok(check(JSL_SHAPE_CAPSULE, 1, 0, 0, 2));
    assert_ok(check(JSL_SHAPE_PLANE, 0, 0, 0, 0));
    assert_result(check(JSL_SHAPE_SPHERE, 0, 1, 1, 1), JSL_ERR_ARGUMENT);
    assert_result(check(JSL_SHAPE_SPHERE, -1, 1, 1, 1), JSL_ERR_ARGUMENT);
    assert_result(check(JSL_SHAPE_SPHERE, NAN, 1, 1, 1), JSL_ERR_NOT_FINITE);
    assert_result(check(JSL_SHAPE_BOX, 1, 1, 0, 1), JSL_ERR_ARGUMENT);
    assert_result(check(JSL_SHAPE_BOX, 1, -1, 1, NAN), JSL_ERR_NOT_FINITE);
    assert_result(check(JSL_SHAPE_BOX, 1, 1, INFINITY, 1), JSL_ERR_NOT_FINITE);
    assert_result(check(JSL_SHAPE_CAPSULE, 1, 0, 0, 0), JSL_ERR_ARGUMENT);
    assert_result(check(JSL_SHAPE_CAPSULE, 0, 0, 0, 1), JSL_ERR_ARGUMENT);
    assert_result(check(JSL_SHAPE_CAPSULE, 1, 0, 0, INFINITY), JSL_ERR_NOT_FINITE);
    assert_result(check(JSL_SHAPE_NONE, 1, 1, 1, 1), JSL_ERR_ARGUMENT);
    assert_result(check((jsl_shape_kind)77, 1, 1, 1, 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_shape_check(NULL), JSL_ERR_ARGUMENT);
}

static void every_kind_has_a_name(void **state) {
    (void)state;
    assert_string_equal(jsl_shape_kind_text(JSL_SHAPE_CAPSULE), "capsule");
    assert_string_equal(jsl_shape_kind_text((jsl_shape_kind)-1), "unknown shape");
    for (int k = 0; k < JSL_SHAPE_KIND_COUNT; k++)
        assert_non_null(jsl_shape_kind_text((jsl_shape_kind)k));
}

/* Integrals over thin slabs across z (midpoint rule): volume, and the moments about z and x. */
static void integrate(const jsl_shape_desc *s, double out[3]) {
    double r = (double)s->radius, h = (double)s->half.z,
           top = s->kind == JSL_SHAPE_SPHERE ? r : h + r;
    int n = 200000;
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < n; i++) {
        double z = top * (2 * (i + 0.5) / n - 1), dz = 2 * top / n;
        double beyond = s->kind == JSL_SHAPE_SPHERE ? z : fmax(fabs(z) - h, 0);
        double q = r * r - beyond * beyond, disc = pi * q * dz;
        out[0] += disc;
        out[1] += disc * q / 2;
        out[2] += disc * (q / 4 + z * z);
    }
}

static void mass_properties_equal_the_integrals(void **state) {
    (void)state;
    jsl_mass_properties m;
    jsl_shape_desc box = make(JSL_SHAPE_BOX, 0, 0.5, 1, 1.5);
    assert_ok(jsl_shape_mass(&box, 2, &m));
    assert_close(m.volume, 6, 8 * eps);
    assert_close(m.mass, 12, 16 * eps);
    assert_close_v3(m.inertia, jsl_v3(13, 10, 5), 16 * eps); /* m (b^2 + c^2) / 12, edges 1 2 3 */
    static const double size[3][2] = {{0.5, 1}, {1, 0.01}, {0.02, 3}};
    for (int i = 0; i < 6; i++) {
        jsl_shape_desc s = make(i < 3 ? JSL_SHAPE_SPHERE : JSL_SHAPE_CAPSULE, size[i % 3][0], 0, 0,
                                size[i % 3][1]);
        double want[3];
        integrate(&s, want);
        assert_ok(jsl_shape_mass(&s, 3, &m));
        /* The midpoint rule over 2e5 slabs is good to about 1e-9. */
        double tol = 1e-8 + 4 * eps;
        assert_close(m.volume, want[0], tol * want[0]);
        assert_close(m.mass, 3 * want[0], 3 * tol * want[0]);
        assert_close(m.inertia.z, 3 * want[1], 3 * tol * want[1]);
        assert_close(m.inertia.x, 3 * want[2], 3 * tol * want[2]);
        assert_true(m.inertia.x == m.inertia.y);
    }
}

static void mass_refuses_planes_bad_densities_and_what_does_not_fit(void **state) {
    (void)state;
    jsl_mass_properties m = {1, 2, {3, 4, 5}}, old = m;
    jsl_shape_desc plane = {.kind = JSL_SHAPE_PLANE}, ball = make(JSL_SHAPE_SPHERE, 1, 0, 0, 0);
    jsl_shape_desc huge = make(JSL_SHAPE_SPHERE, sizeof(jsl_real) == 4 ? 1e9 : 1e90, 0, 0, 0);
    jsl_shape_desc tiny = make(JSL_SHAPE_SPHERE, sizeof(jsl_real) == 4 ? 1e-12 : 1e-90, 0, 0, 0);
    assert_result(jsl_shape_mass(&plane, 1, &m), JSL_ERR_ARGUMENT);
    assert_result(jsl_shape_mass(&ball, 0, &m), JSL_ERR_ARGUMENT);
    assert_result(jsl_shape_mass(&ball, NAN, &m), JSL_ERR_NOT_FINITE);
    assert_result(jsl_shape_mass(&huge, 1000, &m), JSL_ERR_NOT_FINITE);
    assert_result(jsl_shape_mass(&tiny, 1000, &m), JSL_ERR_DEGENERATE);
    assert_memory_equal(&m, &old, sizeof m);
    for (double r = 1e-6; r < 2e6; r *= 10) {
        ball.radius = (jsl_real)r;
        assert_ok(jsl_shape_mass(&ball, 1000, &m));
        assert_true(m.inertia.x > 0 && jsl_is_finite(m.inertia.x));
    }
}

static void bounds_are_tight_and_hold_the_surface(void **state) {
    (void)state;
    uint64_t seed = 11;
    for (int i = 0; i < 3000; i++) {
        jsl_shape_kind kind = (jsl_shape_kind)(JSL_SHAPE_SPHERE + i % 3);
        jsl_shape_desc s = random_shape(&seed, kind, 1);
        jsl_pose pose = {random_vec3(&seed, 5), random_quat(&seed)};
        jsl_aabb b = jsl_shape_aabb(&s, pose);
        double tol = 32 * eps * 7;
        /* The reach along each world axis is the bound. */
        for (int k = 0; k < 3; k++) {
            jsl_vec3 d = {k == 0, k == 1, k == 2};
            double reach = reach_along(&s, pose.orientation, d),
                   c = (double)jsl_dot(d, pose.position);
            assert_close(jsl_dot(d, b.hi), c + reach, tol);
            assert_close(jsl_dot(d, b.lo), c - reach, tol);
        }
        assert_true(reach_along(&s, pose.orientation, random_vec3(&seed, 0.5)) <=
                    (double)jsl_shape_radius(&s) * (1 + 8 * eps));
    }
    const jsl_real far = JSL_R(1e30);
    jsl_shape_desc plane = {.kind = JSL_SHAPE_PLANE};
    jsl_aabb b = jsl_shape_aabb(&plane, (jsl_pose){{1, 2, 3}, {0, 0, 0, 1}});
    assert_true(b.hi.z == 3 && b.lo.z == -far && b.hi.x == far && b.lo.y == -far);
    b = jsl_shape_aabb(&plane, (jsl_pose){{1, 2, 3}, {1, 0, 0, 0}}); /* upside down */
    assert_true(b.lo.z == 3 && b.hi.z == far);
    b = jsl_shape_aabb(&plane, (jsl_pose){{1, 2, 3}, random_quat(&seed)});
    assert_true(b.lo.z == -far && b.hi.z == far);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(good_shapes_pass_and_bad_ones_are_refused),
        cmocka_unit_test(every_kind_has_a_name),
        cmocka_unit_test(mass_properties_equal_the_integrals),
        cmocka_unit_test(mass_refuses_planes_bad_densities_and_what_does_not_fit),
        cmocka_unit_test(bounds_are_tight_and_hold_the_surface),
    };
    return cmocka_run_group_tests_name("shape", tests, NULL, NULL);
}
