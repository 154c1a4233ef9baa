/* SPDX-License-Identifier: MIT
 * Spheres, capsules and planes, and boxes with spheres and capsules: closed forms.
 */
#include "helper.h"

#include <jostle/shape.h>

static const double eps = (double)JSL_REAL_EPSILON;
static const jsl_quat level = {0, 0, 0, 1};

static jsl_shape_desc sphere(double r) {
    return (jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = (jsl_real)r};
}
static jsl_shape_desc capsule(double r, double h) {
    return (jsl_shape_desc){JSL_SHAPE_CAPSULE, (jsl_real)r, {0, 0, (jsl_real)h}};
}
static jsl_shape_desc cube(double h) {
    return (jsl_shape_desc){JSL_SHAPE_BOX, 0, {(jsl_real)h, (jsl_real)h, (jsl_real)h}};
}
static const jsl_shape_desc plane = {.kind = JSL_SHAPE_PLANE};
static jsl_pose at(double x, double y, double z, jsl_quat q) {
    return (jsl_pose){{(jsl_real)x, (jsl_real)y, (jsl_real)z}, q};
}
/* The capsule's axis along x. */
static jsl_quat lying(void) {
    jsl_real r = jsl_sqrt(JSL_R(0.5));
    return (jsl_quat){0, r, 0, r};
}

static void expect_one(const jsl_manifold *m, jsl_vec3 normal, double separation, jsl_vec3 point) {
    assert_int_equal(m->count, 1);
    assert_close_v3(m->normal, normal, 8 * eps);
    assert_close(m->separation[0], separation, 16 * eps);
    assert_close_v3(m->point[0], point, 16 * eps);
}

static void spheres_meet_between_their_centres(void **state) {
    (void)state;
    jsl_shape_desc a = sphere(1), b = sphere(0.5);
    jsl_manifold m;
    jsl_collide(&a, at(0, 0, 0, level), &b, at(0.84, 1.12, 0, level), 0, &m); /* 1.4 apart */
    expect_one(&m, jsl_v3((jsl_real)0.6, (jsl_real)0.8, 0), -0.1,
               jsl_v3((jsl_real)0.57, (jsl_real)0.76, 0));
    jsl_collide(&a, at(0, 0, 0, level), &b, at(1.6, 0, 0, level), 0.05f, &m);
    assert_int_equal(m.count, 0);
    jsl_collide(&a, at(0, 0, 0, level), &b, at(1.6, 0, 0, level), 0.11f, &m);
    expect_one(&m, jsl_v3(1, 0, 0), 0.1, jsl_v3((jsl_real)1.05, 0, 0));
    jsl_collide(&a, at(0, 0, 0, level), &b, at(0, 0, 0, level), 0, &m);
    expect_one(&m, jsl_v3(0, 0, 1), -1.5, jsl_v3(0, 0, (jsl_real)0.25));
}

static void a_sphere_meets_faces_edges_and_the_inside_of_a_box(void **state) {
    (void)state;
    jsl_shape_desc s = sphere(0.5), b = cube(1);
    jsl_manifold m;
    jsl_collide(&b, at(0, 0, 0, level), &s, at(0.3, 0.2, 1.4, level), 0, &m);
    expect_one(&m, jsl_v3(0, 0, 1), -0.1, jsl_v3((jsl_real)0.3, (jsl_real)0.2, (jsl_real)0.95));
    jsl_collide(&b, at(0, 0, 0, level), &s, at(1.3, 1.4, 0, level), 0.01f, &m);
    expect_one(&m, jsl_v3((jsl_real)0.6, (jsl_real)0.8, 0), 0, jsl_v3(1, 1, 0));
    jsl_collide(&b, at(0, 0, 0, level), &s, at(0, -0.75, 0.5, level), 0, &m); /* centre inside */
    expect_one(&m, jsl_v3(0, -1, 0), -0.75, jsl_v3(0, (jsl_real)-0.625, (jsl_real)0.5));
}

static void a_sphere_rests_on_a_plane(void **state) {
    (void)state;
    jsl_shape_desc s = sphere(0.5);
    jsl_manifold m;
    jsl_collide(&plane, at(0, 0, 1, level), &s, at(3, 4, 1.4, level), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close_v3(m.normal, jsl_v3(0, 0, 1), 0);
    assert_close(m.separation[0], -0.1, 8 * eps);
    assert_close_v3(m.point[0], jsl_v3(3, 4, (jsl_real)0.95), 16 * eps);
}

static void a_sphere_meets_the_side_and_the_end_of_a_capsule(void **state) {
    (void)state;
    jsl_shape_desc s = sphere(0.5), c = capsule(0.25, 1);
    jsl_manifold m;
    jsl_collide(&c, at(0, 0, 0, level), &s, at(0.7, 0, 0.5, level), 0, &m);
    expect_one(&m, jsl_v3(1, 0, 0), -0.05, jsl_v3((jsl_real)0.225, 0, (jsl_real)0.5));
    jsl_collide(&c, at(0, 0, 0, level), &s, at(0, 0.42, 1.56, level), 0, &m); /* 0.7 from the end */
    expect_one(&m, jsl_v3(0, (jsl_real)0.6, (jsl_real)0.8), -0.05,
               jsl_v3(0, (jsl_real)0.135, (jsl_real)1.18));
}

static void capsules_touch_along_a_line_or_in_a_point(void **state) {
    (void)state;
    jsl_shape_desc c = capsule(0.25, 1), d = capsule(0.5, 2);
    jsl_manifold m;
    /* Side by side, overlapping from z = 0 to z = 1. */
    jsl_collide(&c, at(0, 0, 0, level), &d, at(0.7, 0, 2, level), 0, &m);
    assert_int_equal(m.count, 2);
    assert_close_v3(m.normal, jsl_v3(1, 0, 0), 4 * eps);
    double sum = 0;
    for (int i = 0; i < 2; i++) {
        assert_close(m.separation[i], -0.05, 8 * eps);
        assert_close(m.point[i].x, 0.225, 8 * eps);
        sum += (double)m.point[i].z;
    }
    assert_close(sum, 1, 16 * eps);
    assert_close(fabs((double)(m.point[0].z - m.point[1].z)), 1, 16 * eps);
    /* Crossed. */
    jsl_collide(&c, at(0, 0, 0, level), &d, at(1, 0.6, 0.5, lying()), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close_v3(m.normal, jsl_v3(0, 1, 0), 8 * eps);
    assert_close(m.separation[0], -0.15, 16 * eps);
    assert_close_v3(m.point[0], jsl_v3(0, (jsl_real)0.175, (jsl_real)0.5), 16 * eps);
    /* End to end on one line. */
    jsl_collide(&c, at(0, 0, 0, level), &d, at(0, 0, 3.7, level), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close_v3(m.normal, jsl_v3(0, 0, 1), 8 * eps);
    assert_close(m.separation[0], -0.05, 16 * eps);
}

static void a_capsule_lies_and_stands_on_a_plane(void **state) {
    (void)state;
    jsl_shape_desc c = capsule(0.25, 1);
    jsl_manifold m;
    jsl_collide(&c, at(0, 0, 0.2, lying()), &plane, at(0, 0, 0, level), 0, &m);
    assert_int_equal(m.count, 2);
    assert_close_v3(m.normal, jsl_v3(0, 0, -1), 0);
    for (int i = 0; i < 2; i++) {
        assert_close(m.separation[i], -0.05, 8 * eps);
        assert_close(fabs((double)m.point[i].x), 1, 8 * eps);
    }
    assert_true(m.feature[0] != m.feature[1]);
    jsl_collide(&c, at(0, 0, 1.2, level), &plane, at(0, 0, 0, level), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close(m.separation[0], -0.05, 8 * eps);
}

static void a_capsule_meets_a_box_flat_on_end_at_an_edge_and_inside(void **state) {
    (void)state;
    jsl_shape_desc c = capsule(0.25, 1), b = cube(1), wide = {JSL_SHAPE_BOX, 0, {3, 3, 1}};
    jsl_manifold m;
    jsl_collide(&wide, at(0, 0, 0, level), &c, at(0, 0, 1.2, lying()), 0, &m);
    assert_int_equal(m.count, 2);
    assert_close_v3(m.normal, jsl_v3(0, 0, 1), 8 * eps);
    for (int i = 0; i < 2; i++) {
        assert_close(m.separation[i], -0.05, 16 * eps);
        assert_close(fabs((double)m.point[i].x), 1, 8 * eps);
    }
    /* Over the rim: the flat part ends at x = 1. */
    jsl_collide(&b, at(0, 0, 0, level), &c, at(1, 0, 1.2, lying()), 0, &m);
    assert_int_equal(m.count, 2);
    assert_close(jsl_max(m.point[0].x, m.point[1].x), 1, 16 * eps);
    assert_close(jsl_min(m.point[0].x, m.point[1].x), 0, 16 * eps);
    /* Standing. */
    jsl_collide(&b, at(0, 0, 0, level), &c, at(0.5, 0, 2.2, level), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close(m.separation[0], -0.05, 16 * eps);
    /* Beside an edge: the axis passes the edge x = y = 1 at (0.15, 0.2). */
    jsl_collide(&b, at(0, 0, 0, level), &c, at(1.12, 1.16, 0, level), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close_v3(m.normal, jsl_v3((jsl_real)0.6, (jsl_real)0.8, 0), 64 * eps);
    assert_close(m.separation[0], -0.05, 32 * eps);
    /* Straight through, nearest to the face x = 1. */
    jsl_collide(&b, at(0, 0, 0, level), &c, at(0.9, 0, 0, level), 0, &m);
    assert_true(m.count > 0);
    assert_close_v3(m.normal, jsl_v3(1, 0, 0), 16 * eps);
    for (int i = 0; i < m.count; i++) assert_close(m.separation[i], -0.35, 32 * eps);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spheres_meet_between_their_centres),
        cmocka_unit_test(a_sphere_meets_faces_edges_and_the_inside_of_a_box),
        cmocka_unit_test(a_sphere_rests_on_a_plane),
        cmocka_unit_test(a_sphere_meets_the_side_and_the_end_of_a_capsule),
        cmocka_unit_test(capsules_touch_along_a_line_or_in_a_point),
        cmocka_unit_test(a_capsule_lies_and_stands_on_a_plane),
        cmocka_unit_test(a_capsule_meets_a_box_flat_on_end_at_an_edge_and_inside),
    };
    return cmocka_run_group_tests_name("collide_round", tests, NULL, NULL);
}
