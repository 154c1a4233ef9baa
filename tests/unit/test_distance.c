/* SPDX-License-Identifier: MIT
 * Distance of points, segments (rays) and shapes: against dense sampling, bisection and one
 * another.
 */
#include "random_shape.h"

#include <stdio.h>
#include <string.h>

static const double eps = (double)JSL_REAL_EPSILON;

/* A point of the surface in the shape's frame, from two parameters in [-1, 1]. */
static jsl_vec3 surface_point(const jsl_shape_desc *s, int part, double u, double v) {
    const double pi = 3.14159265358979323846;
    jsl_vec3 h = s->half;
    if (s->kind == JSL_SHAPE_BOX) {
        jsl_real sign = part & 1 ? 1 : -1;
        jsl_real a = (jsl_real)u, b = (jsl_real)v;
        if (part / 2 == 0) return jsl_v3(sign * h.x, a * h.y, b * h.z);
        if (part / 2 == 1) return jsl_v3(a * h.x, sign * h.y, b * h.z);
        return jsl_v3(a * h.x, b * h.y, sign * h.z);
    }
    double r = (double)s->radius, phi = pi * u,
           top = s->kind == JSL_SHAPE_CAPSULE ? (double)h.z : 0;
    if (part == 0 && top > 0)
        return jsl_v3((jsl_real)(r * cos(phi)), (jsl_real)(r * sin(phi)), (jsl_real)(v * top));
    double theta = pi / 2 * v;
    return jsl_v3((jsl_real)(r * cos(theta) * cos(phi)), (jsl_real)(r * cos(theta) * sin(phi)),
                  (jsl_real)(r * sin(theta) + (v < 0 ? -top : top)));
}

static void point_distance_equals_dense_sampling(void **state) {
    (void)state;
    uint64_t seed = 21;
    for (int i = 0; i < 90; i++) {
        jsl_shape_kind kind = (jsl_shape_kind)(JSL_SHAPE_SPHERE + i % 3);
        jsl_shape_desc s = random_shape(&seed, kind, 1);
        jsl_pose pose = {random_vec3(&seed, 2), random_quat(&seed)};
        jsl_vec3 x = jsl_add(pose.position, random_vec3(&seed, 1.5)), n;
        double d = (double)jsl_shape_point_distance(&s, pose, x, &n), nearest = 1e9;
        const int m = 120, parts = kind == JSL_SHAPE_BOX ? 6 : 2;
        for (int p = 0; p < parts; p++)
            for (int a = 0; a <= m; a++)
                for (int b = 0; b <= m; b++) {
                    jsl_vec3 q = surface_point(&s, p, 2.0 * a / m - 1, 2.0 * b / m - 1);
                    nearest =
                        fmin(nearest, (double)jsl_length(jsl_sub(jsl_pose_point(pose, q), x)));
                }
        /* Samples lie up to half a cell's diagonal from the nearest point; cells are at most 2 pi r
         * / m wide, r <= 1. */
        double cell = 0.5 * 6.2832 / m * 1.5;
        assert_true(fabs(d) <= nearest + 64 * eps);
        /* d^2 + (cell/2)^2 bounds the sample's square for points outside; inside the bound is
         * linear. */
        assert_true(nearest <= fabs(d) + cell);
        assert_close(jsl_length(n), 1, 16 * eps);
        /* Going back along the normal by the distance ends on the surface. */
        jsl_vec3 foot = jsl_mul_add(x, (jsl_real)-d, n);
        assert_close(jsl_shape_point_distance(&s, pose, foot, NULL), 0, 128 * eps);
    }
}

static void points_at_the_very_centre_get_a_unit_normal(void **state) {
    (void)state;
    for (int k = JSL_SHAPE_SPHERE; k <= JSL_SHAPE_PLANE; k++) {
        jsl_shape_desc s = {(jsl_shape_kind)k, 1, {1, 1, 1}};
        jsl_vec3 n;
        double d = (double)jsl_shape_point_distance(&s, (jsl_pose){{1, 2, 3}, {0, 0, 0, 1}},
                                                    jsl_v3(1, 2, 3), &n);
        assert_close(jsl_length(n), 1, 4 * eps);
        assert_close(d, k == JSL_SHAPE_PLANE ? 0 : -1, 4 * eps);
    }
}

static void rays_hit_where_bisection_finds_the_surface(void **state) {
    (void)state;
    uint64_t seed = 22;
    int hits = 0, misses = 0, inside = 0;
    for (int i = 0; i < 20000; i++) {
        jsl_shape_kind kind = (jsl_shape_kind)(JSL_SHAPE_SPHERE + i % 4);
        jsl_shape_desc s = random_shape(&seed, kind, 1);
        jsl_pose pose = {random_vec3(&seed, 2), random_quat(&seed)};
        jsl_vec3 from = jsl_add(pose.position, random_vec3(&seed, 2));
        jsl_vec3 to = jsl_add(pose.position, random_vec3(&seed, i % 3 ? 1 : 3)),
                 d = jsl_sub(to, from);
        jsl_ray_hit hit;
        bool found = jsl_shape_ray(&s, pose, from, to, &hit);
        double tol = 256 * eps, start = (double)jsl_shape_point_distance(&s, pose, from, NULL);
        if (start <= 0) {
            inside++;
            assert_true(found && hit.fraction == 0);
            assert_memory_equal(&hit.point, &from, sizeof from);
            continue;
        }
        /* March by the distance itself (never past the surface of a convex shape), which is a
         * bisection that cannot skip a root. */
        double t = 0, length = (double)jsl_length(d), gap = start;
        for (int k = 0; k < 2000 && gap > tol && t <= 1; k++) {
            t += gap / length;
            gap =
                (double)jsl_shape_point_distance(&s, pose, jsl_mul_add(from, (jsl_real)t, d), NULL);
        }
        bool marched = t <= 1 && gap <= tol;
        if (!found) {
            misses++;
            /* A ray that grazes within rounding may go either way. */
            if (marched) {
                jsl_vec3 n, at = jsl_mul_add(from, (jsl_real)t, d);
                jsl_shape_point_distance(&s, pose, at, &n);
                double cosine = (double)jsl_dot(n, d) / length;
                if (t < 1 - 1e-3 && cosine < -0.05) fail_msg("ray %d missed a hit at %g", i, t);
            }
            continue;
        }
        hits++;
        assert_true(hit.fraction >= 0 && hit.fraction <= 1);
        assert_close(jsl_length(hit.normal), 1, 16 * eps);
        assert_close(jsl_shape_point_distance(&s, pose, hit.point, NULL), 0, tol);
        double cosine = -(double)jsl_dot(hit.normal, d) / length;
        assert_true(cosine > -1e-3);
        if (marched && cosine > 0.05) assert_close(hit.fraction, t, 4 * tol / (length * cosine));
    }
    assert_true(hits > 4000 && misses > 2000 && inside > 500);
}

static void rays_of_no_length_and_along_faces_are_answered(void **state) {
    (void)state;
    jsl_pose o = {{0, 0, 0}, {0, 0, 0, 1}};
    jsl_ray_hit hit;
    for (int k = JSL_SHAPE_SPHERE; k <= JSL_SHAPE_PLANE; k++) {
        jsl_shape_desc s = {(jsl_shape_kind)k, 1, {1, 1, 1}};
        assert_false(jsl_shape_ray(&s, o, jsl_v3(0, 0, 5), jsl_v3(0, 0, 5), &hit));
        assert_true(jsl_shape_ray(&s, o, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0), &hit));
        assert_true(hit.fraction == 0);
        assert_true(jsl_shape_ray(&s, o, jsl_v3(0, 0, 5), jsl_v3(0, 0, -5), &hit));
        double top = k == JSL_SHAPE_CAPSULE ? 2 : k == JSL_SHAPE_PLANE ? 0 : 1;
        assert_close(hit.fraction, (5 - top) / 10, 4 * eps);
        assert_close_v3(hit.normal, jsl_v3(0, 0, 1), 4 * eps);
        assert_false(jsl_shape_ray(&s, o, jsl_v3(0, 0, 5), jsl_v3(0, 0, (jsl_real)2.5), &hit));
        assert_false(jsl_shape_ray(&s, o, jsl_v3(0, 0, 5), jsl_v3(0, 0, 9), &hit));
    }
    jsl_shape_desc box = {JSL_SHAPE_BOX, 0, {1, 1, 1}};
    assert_true(jsl_shape_ray(&box, o, jsl_v3(-3, 1, 0), jsl_v3(3, 1, 0), &hit)); /* in the face */
    assert_false(jsl_shape_ray(&box, o, jsl_v3(-3, 1 + 2 * JSL_REAL_EPSILON, 0),
                               jsl_v3(3, 1 + 2 * JSL_REAL_EPSILON, 0), &hit));
}

static void shape_distance_agrees_with_contacts_and_points(void **state) {
    (void)state;
    uint64_t seed = 23;
    static const jsl_shape_kind kinds[4] = {JSL_SHAPE_SPHERE, JSL_SHAPE_BOX, JSL_SHAPE_CAPSULE,
                                            JSL_SHAPE_PLANE};
    for (int i = 0; i < 60000; i++) {
        jsl_shape_kind ka = kinds[i % 3], kb = kinds[(i / 3) % 4];
        random_pair p = random_pair_make(&seed, ka, kb);
        jsl_gap gap, back;
        assert_ok(jsl_shape_distance(&p.a, p.pa, &p.b, p.pb, &gap));
        double tol = 128 * eps * p.extent, d = (double)gap.distance;
        assert_close(jsl_length(gap.normal), 1, 16 * eps);
        jsl_vec3 step = jsl_sub(gap.point_b, gap.point_a);
        assert_close_v3(step, jsl_scale(gap.normal, gap.distance), tol);
        if (d > 16 * tol) {
            /* The witnesses lie on both surfaces, and the slab between them separates the shapes:
             * no smaller distance exists. */
            assert_close(jsl_shape_point_distance(&p.a, p.pa, gap.point_a, NULL), 0, tol);
            assert_close(jsl_shape_point_distance(&p.b, p.pb, gap.point_b, NULL), 0, tol);
            if (kb != JSL_SHAPE_PLANE) {
                double apart = (double)jsl_dot(gap.normal, jsl_sub(p.pb.position, p.pa.position));
                apart -= reach_along(&p.a, p.pa.orientation, gap.normal) +
                         reach_along(&p.b, p.pb.orientation, gap.normal);
                /* The witnesses' rounding turns a normal as short as d by eps extent / d, and the
                 * turn has the shapes' size for a lever. */
                assert_close(apart, d, tol + 4 * eps * p.extent * p.scale / d);
            }
        }
        /* A contact exists within the margin when the distance is, and its separation is the
         * distance but for the preference of faces (0.05 of the depth and 0.0015 of the thinnest
         * half extent). */
        jsl_manifold m;
        jsl_collide(&p.a, p.pa, &p.b, p.pb, (jsl_real)p.margin, &m);
        double s = 1e300;
        for (int k = 0; k < m.count; k++) s = fmin(s, (double)m.separation[k]);
        if (d > p.margin + tol) assert_int_equal(m.count, 0);
        if (d < p.margin - 0.003 * p.scale) {
            if (m.count == 0)
                fail_msg("pair %d: distance %g, no contact within %g", i, d, p.margin);
            if (!(fabs(s - d) <= 0.003 * p.scale + 0.08 * fabs(d) + tol))
                fail_msg("pair %d (%s, %s): distance %g, contact %g", i, jsl_shape_kind_text(ka),
                         jsl_shape_kind_text(kb), d, s);
        }
        assert_ok(jsl_shape_distance(&p.b, p.pb, &p.a, p.pa, &back));
        assert_close(back.distance, d, tol);
    }
    jsl_shape_desc plane = {.kind = JSL_SHAPE_PLANE};
    jsl_pose o = {{0, 0, 0}, {0, 0, 0, 1}};
    jsl_gap gap;
    assert_result(jsl_shape_distance(&plane, o, &plane, o, &gap), JSL_ERR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(point_distance_equals_dense_sampling),
        cmocka_unit_test(points_at_the_very_centre_get_a_unit_normal),
        cmocka_unit_test(rays_hit_where_bisection_finds_the_surface),
        cmocka_unit_test(rays_of_no_length_and_along_faces_are_answered),
        cmocka_unit_test(shape_distance_agrees_with_contacts_and_points),
    };
    return cmocka_run_group_tests_name("distance", tests, NULL, NULL);
}
