/* SPDX-License-Identifier: MIT
 * Boxes: closed forms, brute force over all axes, the choice and the names of points.
 */
#include "random_shape.h"

#include <stdio.h>
#include <stdlib.h>

static const double eps = (double)JSL_REAL_EPSILON;
static const jsl_quat level = {0, 0, 0, 1};

static jsl_shape_desc box(double x, double y, double z) {
    return (jsl_shape_desc){JSL_SHAPE_BOX, 0, {(jsl_real)x, (jsl_real)y, (jsl_real)z}};
}
static jsl_pose at(double x, double y, double z, jsl_quat q) {
    return (jsl_pose){{(jsl_real)x, (jsl_real)y, (jsl_real)z}, q};
}
static jsl_quat turn(double x, double y, double z, double angle) {
    double n = sqrt(x * x + y * y + z * z), s = sin(angle / 2) / n;
    return (jsl_quat){(jsl_real)(x * s), (jsl_real)(y * s), (jsl_real)(z * s),
                      (jsl_real)cos(angle / 2)};
}

static double deepest(const jsl_manifold *m) {
    double s = 1e300;
    for (int i = 0; i < m->count; i++) s = fmin(s, (double)m->separation[i]);
    return s;
}

/* -- Brute force
 * ------------------------------------------------------------------------------------------ */

/* Separation of the boxes along n (unit), in double. */
static double separation_along(const random_pair *p, const double n[3]) {
    double s = 0;
    const jsl_vec3 e[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const jsl_vec3 d = jsl_sub(p->pb.position, p->pa.position);
    s = fabs(n[0] * (double)d.x + n[1] * (double)d.y + n[2] * (double)d.z);
    for (int side = 0; side < 2; side++) {
        const jsl_shape_desc *b = side ? &p->b : &p->a;
        const double h[3] = {(double)b->half.x, (double)b->half.y, (double)b->half.z};
        for (int k = 0; k < 3; k++) {
            jsl_vec3 x = jsl_rotate(side ? p->pb.orientation : p->pa.orientation, e[k]);
            s -= h[k] * fabs(n[0] * (double)x.x + n[1] * (double)x.y + n[2] * (double)x.z);
        }
    }
    return s;
}

static double brute_force(const random_pair *p) {
    const jsl_vec3 e[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double a[3][3], b[3][3], best = -1e300;
    for (int k = 0; k < 3; k++) {
        jsl_vec3 x = jsl_rotate(p->pa.orientation, e[k]), y = jsl_rotate(p->pb.orientation, e[k]);
        a[k][0] = (double)x.x, a[k][1] = (double)x.y, a[k][2] = (double)x.z;
        b[k][0] = (double)y.x, b[k][1] = (double)y.y, b[k][2] = (double)y.z;
        best = fmax(best, fmax(separation_along(p, a[k]), separation_along(p, b[k])));
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double n[3] = {a[i][1] * b[j][2] - a[i][2] * b[j][1],
                           a[i][2] * b[j][0] - a[i][0] * b[j][2],
                           a[i][0] * b[j][1] - a[i][1] * b[j][0]};
            double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            if (length < 2e-3) continue;
            for (int k = 0; k < 3; k++) n[k] /= length;
            best = fmax(best, separation_along(p, n));
        }
    }
    return best;
}

static void the_axis_is_the_best_of_all_fifteen(void **state) {
    (void)state;
    const char *text = getenv("JSL_TEST_SEED");
    uint64_t seed = text ? strtoull(text, NULL, 0) : 7, first = seed;
    print_message("seed %llu (JSL_TEST_SEED)\n", (unsigned long long)first);
    for (int i = 0; i < 100000; i++) {
        random_pair p = random_pair_make(&seed, JSL_SHAPE_BOX, JSL_SHAPE_BOX);
        jsl_manifold m;
        jsl_collide(&p.a, p.pa, &p.b, p.pb, (jsl_real)p.margin, &m);
        double truth = brute_force(&p), tol = 64 * eps * p.extent;
        if (m.count == 0) {
            if (truth < -tol) fail_msg("pair %d: overlap of %g has no contact", i, -truth);
            continue;
        }
        double n[3] = {(double)m.normal.x, (double)m.normal.y, (double)m.normal.z};
        double ours = separation_along(&p, n);
        /* A face may be preferred to an edge, and A's to B's, that is better by 0.05 + 0.02 of the
         * depth and 0.0015 of the thinnest half extent. */
        if (truth < 0 && !(ours >= truth - (0.075 * fabs(truth) + 0.0015 * p.scale + tol)))
            fail_msg("pair %d of seed %llu: axis has %g, the best has %g", i,
                     (unsigned long long)first, ours, truth);
        if (!(deepest(&m) >= ours - tol))
            fail_msg("pair %d: a point is deeper than the boxes are along the normal", i);
        if (truth > tol && !(deepest(&m) >= truth - (0.002 * p.scale + tol)))
            fail_msg("pair %d: separation %g, axes say at least %g", i, deepest(&m), truth);
    }
}

/* -- Closed forms
 * -------------------------------------------------------------------------------------------- */

static void a_box_on_a_box_touches_with_four_corners(void **state) {
    (void)state;
    jsl_shape_desc a = box(2, 2, 0.5), b = box(0.5, 0.25, 1);
    jsl_manifold m;
    jsl_collide(&a, at(10, 20, 30, level), &b, at(10.5, 20, 31.49, level), 0.01f, &m);
    assert_int_equal(m.count, 4);
    assert_close_v3(m.normal, jsl_v3(0, 0, 1), 4 * eps);
    double sum_x = 0, sum_y = 0;
    for (int i = 0; i < 4; i++) {
        assert_close(m.separation[i], -0.01, 64 * eps * 30);
        assert_close(m.point[i].z, 30.495, 8 * eps * 30);
        assert_close(fabs((double)m.point[i].x - 10.5), 0.5, 8 * eps * 30);
        assert_close(fabs((double)m.point[i].y - 20), 0.25, 8 * eps * 30);
        sum_x += (double)m.point[i].x - 10.5, sum_y += (double)m.point[i].y - 20;
    }
    assert_close(sum_x, 0, 32 * eps * 30);
    assert_close(sum_y, 0, 32 * eps * 30);
}

static void an_overhanging_box_is_clipped_at_the_rim(void **state) {
    (void)state;
    jsl_shape_desc a = box(1, 1, 1), b = box(1, 1, 1);
    jsl_manifold m;
    jsl_collide(&a, at(0, 0, 0, level), &b, at(1.5, 0, 2, level), 0.01f, &m);
    assert_int_equal(m.count, 4);
    double lo = 1e9, hi = -1e9;
    for (int i = 0; i < 4; i++) {
        lo = fmin(lo, (double)m.point[i].x), hi = fmax(hi, (double)m.point[i].x);
        assert_close(m.separation[i], 0, 8 * eps);
    }
    assert_close(lo, 0.5, 8 * eps);
    assert_close(hi, 1, 8 * eps);
}

static void crossed_edges_touch_in_one_point(void **state) {
    (void)state;
    /* Two bars lying on their edges, one across the other: the edges are at height sqrt(2)/2 and
     * cross at the origin's z axis. */
    const double r = sqrt(0.5);
    jsl_shape_desc bar = box(2, 0.5, 0.5);
    jsl_quat qa = turn(1, 0, 0, acos(-1) / 4);
    jsl_quat qb = jsl_quat_mul(turn(0, 0, 1, acos(-1) / 2), qa);
    jsl_manifold m;
    jsl_collide(&bar, at(0.3, 0, 0, qa), &bar, at(0, 0.4, 2 * r - 0.02, qb), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close_v3(m.normal, jsl_v3(0, 0, 1), 16 * eps);
    assert_close(m.separation[0], -0.02, 32 * eps);
    assert_close_v3(m.point[0], jsl_v3(0, 0, (jsl_real)(r - 0.01)), 32 * eps);
}

static void boxes_corner_to_corner_have_their_true_distance(void **state) {
    (void)state;
    jsl_shape_desc b = box(1, 1, 1);
    jsl_manifold m;
    jsl_collide(&b, at(0, 0, 0, level), &b, at(2.003, 2.004, 2.012, level), 0.02f, &m);
    assert_int_equal(m.count, 1);
    assert_close(m.separation[0], 0.013, 8 * eps);
    assert_close_v3(m.normal,
                    jsl_v3((jsl_real)(3. / 13), (jsl_real)(4. / 13), (jsl_real)(12. / 13)),
                    0.5 * 8 * eps / 0.013);
    jsl_collide(&b, at(0, 0, 0, level), &b, at(2.003, 2.004, 2.012, level), 0.0125f, &m);
    assert_int_equal(m.count, 0);
}

static void an_eighth_turn_keeps_four_of_eight_points_for_area(void **state) {
    (void)state;
    jsl_shape_desc b = box(1, 1, 1);
    jsl_manifold m;
    jsl_collide(&b, at(0, 0, 0, level), &b, at(0, 0, 2, turn(0, 0, 1, acos(-1) / 4)), 0.01f, &m);
    assert_int_equal(m.count, 4);
    /* The octagon has area 8 (sqrt 2 - 1) = 3.31; any 4 of its corners that are chosen well span
     * more than half. */
    double twice = 0;
    for (int i = 0; i < 4; i++) {
        jsl_vec3 p = m.point[i], q = m.point[(i + 1) % 4];
        twice += (double)(p.x * q.y - p.y * q.x);
    }
    assert_true(fabs(twice) / 2 > 1.8);
}

/* A stack that rocks by less than the clip slack must not rename its points. */
static void feature_ids_stay_while_a_stack_rocks(void **state) {
    (void)state;
    jsl_shape_desc b = box(0.5, 0.5, 0.5);
    uint64_t seed = 3;
    jsl_manifold still, m;
    jsl_collide(&b, at(0, 0, 0, level), &b, at(0, 0, 0.999, level), 0.01f, &still);
    assert_int_equal(still.count, 4);
    for (int i = 0; i < 1000; i++) {
        jsl_vec3 w = random_vec3(&seed, 1);
        jsl_quat q = turn((double)w.x, (double)w.y, (double)w.z, test_uniform(&seed, 0, 1e-4));
        jsl_vec3 d = random_vec3(&seed, 1e-4);
        jsl_pose p = {{d.x, d.y, (jsl_real)0.999 + d.z}, q};
        jsl_collide(&b, at(0, 0, 0, level), &b, p, 0.01f, &m);
        assert_int_equal(m.count, 4);
        for (int k = 0; k < 4; k++) {
            bool found = false;
            for (int j = 0; j < 4; j++) found |= m.feature[k] == still.feature[j];
            assert_true(found);
        }
    }
}

static void far_from_the_origin_contacts_keep_their_depth(void **state) {
    (void)state;
    /* 8192 and 8193.5 are exact in float, and so is their difference: the depth must be the one at
     * the origin. */
    jsl_shape_desc b = box(0.5, 0.5, 1);
    jsl_quat q = turn(1, 2, 3, 0.3);
    jsl_manifold near, far;
    jsl_collide(&b, at(0, 0, 0, q), &b, at(0, 0, 1.5, level), 0, &near);
    jsl_collide(&b, at(8192, -8192, 8192, q), &b, at(8192, -8192, 8193.5, level), 0, &far);
    assert_true(near.count > 0);
    assert_int_equal(near.count, far.count);
    for (int i = 0; i < near.count; i++)
        assert_true(near.separation[i] == far.separation[i] && near.feature[i] == far.feature[i]);
}

static void a_box_on_a_plane_touches_with_its_lowest_corners(void **state) {
    (void)state;
    jsl_shape_desc b = box(1, 2, 3), plane = {.kind = JSL_SHAPE_PLANE};
    jsl_manifold m;
    jsl_collide(&b, at(5, 6, 2.98, level), &plane, at(0, 0, 0, level), 0.01f, &m);
    assert_int_equal(m.count, 4);
    assert_close_v3(m.normal, jsl_v3(0, 0, -1), 4 * eps);
    for (int i = 0; i < 4; i++) {
        assert_close(m.separation[i], -0.02, 8 * eps * 3);
        assert_close(m.point[i].z, -0.01, 8 * eps * 3);
    }
    /* On its corner: one point, at sqrt(14) below the centre when the diagonal is upright. */
    jsl_vec3 d = jsl_normalize(b.half);
    jsl_quat q = turn((double)d.y, -(double)d.x, 0, acos((double)d.z));
    q = jsl_quat_normalize(q);
    jsl_collide(&b, at(0, 0, sqrt(14.0) - 0.001, q), &plane, at(0, 0, 0, level), 0, &m);
    assert_int_equal(m.count, 1);
    assert_close(m.separation[0], -0.001, 32 * eps);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_axis_is_the_best_of_all_fifteen),
        cmocka_unit_test(a_box_on_a_box_touches_with_four_corners),
        cmocka_unit_test(an_overhanging_box_is_clipped_at_the_rim),
        cmocka_unit_test(crossed_edges_touch_in_one_point),
        cmocka_unit_test(boxes_corner_to_corner_have_their_true_distance),
        cmocka_unit_test(an_eighth_turn_keeps_four_of_eight_points_for_area),
        cmocka_unit_test(feature_ids_stay_while_a_stack_rocks),
        cmocka_unit_test(far_from_the_origin_contacts_keep_their_depth),
        cmocka_unit_test(a_box_on_a_plane_touches_with_its_lowest_corners),
    };
    return cmocka_run_group_tests_name("collide_box", tests, NULL, NULL);
}
