/* SPDX-License-Identifier: MIT
 * Properties that hold for every pair of shapes, on 100 000 random pairs of each kind.
 */
#include "random_shape.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PAIRS = 100000 };
static const double eps = (double)JSL_REAL_EPSILON;

/* JSL_TEST_SEED replays a run. */
static uint64_t seed_of_run(void) {
    const char *text = getenv("JSL_TEST_SEED");
    return text ? strtoull(text, NULL, 0) : 20240817;
}

static const jsl_shape_kind kinds[9][2] = {
    {JSL_SHAPE_SPHERE, JSL_SHAPE_SPHERE},  {JSL_SHAPE_SPHERE, JSL_SHAPE_BOX},
    {JSL_SHAPE_SPHERE, JSL_SHAPE_CAPSULE}, {JSL_SHAPE_SPHERE, JSL_SHAPE_PLANE},
    {JSL_SHAPE_BOX, JSL_SHAPE_BOX},        {JSL_SHAPE_BOX, JSL_SHAPE_CAPSULE},
    {JSL_SHAPE_BOX, JSL_SHAPE_PLANE},      {JSL_SHAPE_CAPSULE, JSL_SHAPE_CAPSULE},
    {JSL_SHAPE_CAPSULE, JSL_SHAPE_PLANE}};

typedef void check_fn(const random_pair *p, const jsl_manifold *m, const char *where, void *ctx);

static void for_all_pairs(const char *name, check_fn *check, void *ctx) {
    uint64_t first = seed_of_run();
    for (int k = 0; k < 9; k++) {
        uint64_t seed = first + (uint64_t)k;
        char where[160];
        int met = 0;
        for (int i = 0; i < PAIRS; i++) {
            random_pair p = random_pair_make(&seed, kinds[k][0], kinds[k][1]);
            jsl_manifold m;
            jsl_collide(&p.a, p.pa, &p.b, p.pb, (jsl_real)p.margin, &m);
            met += m.count > 0;
            snprintf(where, sizeof where, "%s: %s-%s pair %d of seed %llu", name,
                     jsl_shape_kind_text(kinds[k][0]), jsl_shape_kind_text(kinds[k][1]), i,
                     (unsigned long long)first);
            check(&p, &m, where, ctx);
        }
        if (met < PAIRS / 4) fail_msg("%s: only %d pairs met", where, met);
    }
}

static void swap_check(const random_pair *p, const jsl_manifold *m, const char *where, void *ctx) {
    (void)ctx;
    jsl_manifold w;
    jsl_collide(&p->b, p->pb, &p->a, p->pa, (jsl_real)p->margin, &w);
    bool same = w.count == m->count;
    if (same && m->count > 0)
        same =
            w.normal.x == -m->normal.x && w.normal.y == -m->normal.y && w.normal.z == -m->normal.z;
    for (int i = 0; same && i < m->count; i++)
        same = memcmp(&w.point[i], &m->point[i], sizeof w.point[i]) == 0 &&
               w.separation[i] == m->separation[i] &&
               w.feature[i] == (m->feature[i] << 16 | m->feature[i] >> 16);
    if (!same) fail_msg("%s: swapped gives another manifold", where);
}

static void swapping_the_shapes_mirrors_the_manifold_to_the_bit(void **state) {
    (void)state;
    for_all_pairs("swap", swap_check, NULL);
}

static void sane_check(const random_pair *p, const jsl_manifold *m, const char *where, void *ctx) {
    (void)ctx;
    if (m->count < 0 || m->count > JSL_MAX_MANIFOLD) fail_msg("%s: count %d", where, m->count);
    if (m->count == 0) return;
    /* Axes come from a quaternion whose length is 1 within 2 eps. */
    double n = sqrt((double)jsl_length_sq(m->normal));
    if (!(fabs(n - 1) < 16 * eps)) fail_msg("%s: normal has length %.9g", where, n);
    double most = 2 * (double)(jsl_shape_radius(&p->a) + jsl_shape_radius(&p->b));
    for (int i = 0; i < m->count; i++) {
        if (!jsl_v3_is_finite(m->point[i])) fail_msg("%s: point is not finite", where);
        double s = (double)m->separation[i];
        if (!(s <= (double)(jsl_real)p->margin && s >= -most))
            fail_msg("%s: separation %g of sizes %g", where, s, most);
        for (int j = 0; j < i; j++)
            if (m->feature[i] == m->feature[j]) fail_msg("%s: feature ids repeat", where);
    }
}

static void manifolds_are_finite_and_no_deeper_than_the_shapes(void **state) {
    (void)state;
    for_all_pairs("sane", sane_check, NULL);
}

static void surface_check(const random_pair *p, const jsl_manifold *m, const char *where,
                          void *ctx) {
    double *worst = ctx;
    /* Rounding of positions up to 12 sizes from the origin. Between boxes a vertex may stand out of
     * a face by 0.0005 of each half extent; between capsules the ends of a flat contact may be
     * 0.005 r off. */
    double tol = 128 * eps * p->extent;
    if (p->a.kind == JSL_SHAPE_BOX && p->b.kind == JSL_SHAPE_BOX) tol += 0.00075 * p->scale;
    if (p->a.kind == JSL_SHAPE_CAPSULE && p->b.kind == JSL_SHAPE_CAPSULE) tol += 0.006 * p->scale;
    for (int i = 0; i < m->count; i++) {
        jsl_real half = m->separation[i] / 2;
        jsl_vec3 on_a = jsl_mul_add(m->point[i], -half, m->normal);
        jsl_vec3 on_b = jsl_mul_add(m->point[i], half, m->normal);
        double da = (double)jsl_shape_point_distance(&p->a, p->pa, on_a, NULL);
        double db = (double)jsl_shape_point_distance(&p->b, p->pb, on_b, NULL);
        double off = fmax(fabs(da), fabs(db));
        *worst = fmax(*worst, off / p->scale);
        if (!(off <= tol))
            fail_msg("%s: point %d is %g and %g off the surfaces, %g allowed", where, i, da, db,
                     tol);
    }
}

static void contact_points_lie_on_both_surfaces(void **state) {
    (void)state;
    double worst = 0;
    for_all_pairs("surface", surface_check, &worst);
    print_message("worst: %.3g of the size\n", worst);
}

static double deepest(const jsl_manifold *m) {
    double s = 1e300;
    for (int i = 0; i < m->count; i++) s = fmin(s, (double)m->separation[i]);
    return s;
}

static void overlap_check(const random_pair *p, const jsl_manifold *m, const char *where,
                          void *ctx) {
    (void)ctx;
    /* A point well inside both shapes proves that they overlap. Try a few between the two origins.
     */
    if (p->b.kind == JSL_SHAPE_PLANE) return;
    for (int i = 0; i <= 4; i++) {
        jsl_vec3 d = jsl_sub(p->pb.position, p->pa.position);
        jsl_vec3 x = jsl_mul_add(p->pa.position, (jsl_real)i / 4, d);
        double da = (double)jsl_shape_point_distance(&p->a, p->pa, x, NULL);
        double db = (double)jsl_shape_point_distance(&p->b, p->pb, x, NULL);
        double inside = fmin(-da, -db), tol = 64 * eps * p->extent;
        if (inside <= tol) continue;
        if (m->count == 0) fail_msg("%s: overlap has no contact", where);
        if (!(deepest(m) <= tol))
            fail_msg("%s: %g inside both, but the separation is %g", where, inside, deepest(m));
    }
}

static void overlapping_shapes_always_have_a_penetrating_point(void **state) {
    (void)state;
    for_all_pairs("overlap", overlap_check, NULL);
}

typedef struct motion_count {
    uint64_t seed;
    int64_t all, turned;
} motion_count;

static void motion_check(const random_pair *p, const jsl_manifold *m, const char *where,
                         void *ctx) {
    motion_count *c = ctx;
    jsl_quat q = random_quat(&c->seed);
    jsl_vec3 shift = random_vec3(&c->seed, 4 * p->scale);
    jsl_pose pa = {jsl_add(shift, jsl_rotate(q, p->pa.position)),
                   jsl_quat_normalize(jsl_quat_mul(q, p->pa.orientation))};
    jsl_pose pb = {jsl_add(shift, jsl_rotate(q, p->pb.position)),
                   jsl_quat_normalize(jsl_quat_mul(q, p->pb.orientation))};
    jsl_manifold w;
    jsl_collide(&p->a, pa, &p->b, pb, (jsl_real)p->margin, &w);
    c->all++;
    if (w.count == 0 || m->count == 0) {
        c->turned += w.count != m->count;
        return;
    }
    /* Rounding moves the depth by rounding; where two axes tie, by no more than the preference of
     * faces. */
    double change = fabs(deepest(&w) - deepest(m)), tol = 128 * eps * p->extent;
    jsl_vec3 back = jsl_rotate_inv(q, w.normal);
    bool same = w.count == m->count && jsl_length(jsl_sub(back, m->normal)) < JSL_R(1e-3);
    if (!same) c->turned++;
    if (same && !(change <= tol)) fail_msg("%s: moved, the depth changes by %g", where, change);
}

static void a_rigid_motion_of_both_changes_nothing_beyond_rounding(void **state) {
    (void)state;
    motion_count c = {.seed = seed_of_run() + 77};
    for_all_pairs("motion", motion_check, &c);
    print_message("%lld of %lld changed features\n", (long long)c.turned, (long long)c.all);
    /* A quarter of the pairs are aligned, so that rounding decides between equal features; the
     * others change rarely. */
    assert_true(c.turned * 20 < c.all);
}

static void degenerate_pairs_give_finite_answers(void **state) {
    (void)state;
    static const double sizes[5] = {1e-6, 1e-3, 1, 1e3, 1e6};
    const jsl_pose o = {{0, 0, 0}, {0, 0, 0, 1}}, zero = {{0, 0, 0}, {0, 0, 0, 0}};
    for (int k = 0; k < 9; k++) {
        for (int i = 0; i < 25; i++) {
            jsl_real x = (jsl_real)sizes[i % 5], y = (jsl_real)sizes[i / 5];
            jsl_shape_desc a = {kinds[k][0], x, {x, y, x}}, b = {kinds[k][1], y, {y, y, x}};
            jsl_manifold m, n;
            jsl_collide(&a, o, &b, o, 0, &m);
            assert_true(m.count > 0);
            for (int j = 0; j < m.count; j++) {
                assert_true(jsl_v3_is_finite(m.point[j]) && jsl_is_finite(m.separation[j]));
                assert_close(jsl_length(m.normal), 1, 16 * eps);
            }
            jsl_collide(&a, zero, &b, zero, 0, &n); /* the zero quaternion is the identity */
            assert_memory_equal(&m.normal, &n.normal, sizeof m.normal);
            assert_int_equal(m.count, n.count);
        }
    }
}

static void two_hundred_boxes_at_one_point_all_touch_and_agree(void **state) {
    (void)state;
    uint64_t seed = seed_of_run();
    jsl_shape_desc shape[200];
    jsl_pose pose[200];
    for (int i = 0; i < 200; i++) {
        shape[i] = random_shape(&seed, JSL_SHAPE_BOX, 1);
        pose[i] = (jsl_pose){{3, 4, 5}, random_quat(&seed)};
        if (i % 4 == 0 && i > 0) shape[i] = shape[i - 1], pose[i] = pose[i - 1];
    }
    for (int i = 0; i < 200; i++) {
        for (int j = 0; j < i; j++) {
            jsl_manifold m;
            jsl_collide(&shape[i], pose[i], &shape[j], pose[j], 0, &m);
            assert_true(m.count > 0);
            assert_true(deepest(&m) < 0 && deepest(&m) > -4);
            assert_close(jsl_length(m.normal), 1, 16 * eps);
        }
    }
}

static void a_plane_meets_no_plane_and_none_meets_nothing(void **state) {
    (void)state;
    const jsl_pose o = {{0, 0, 0}, {0, 0, 0, 1}};
    jsl_shape_desc plane = {.kind = JSL_SHAPE_PLANE}, none = {.kind = JSL_SHAPE_NONE};
    jsl_shape_desc ball = {.kind = JSL_SHAPE_SPHERE, .radius = 1};
    jsl_manifold m;
    jsl_collide(&plane, o, &plane, o, 1, &m);
    assert_int_equal(m.count, 0);
    jsl_collide(&none, o, &ball, o, 1, &m);
    assert_int_equal(m.count, 0);
    jsl_collide(&ball, o, &none, o, 1, &m);
    assert_int_equal(m.count, 0);
}

/* Any bits at all: the answer may be none, but no crash, no endless loop, no more than four points.
 */
static void arbitrary_bits_are_survived(void **state) {
    (void)state;
    uint64_t seed = seed_of_run() + 5;
    for (int i = 0; i < 50000; i++) {
        const int k = i % 9;
        random_pair p = random_pair_make(&seed, kinds[k][0], kinds[k][1]);
        jsl_real *field[] = {&p.pa.position.x,    &p.pa.orientation.y, &p.pb.position.z,
                             &p.pb.orientation.w, &p.a.half.z,         &p.b.radius,
                             &p.b.half.x,         &p.pb.orientation.x, &p.a.radius};
        for (int n = 0; n < 1 + i % 3; n++) {
            uint64_t bits = test_random(&seed);
            memcpy(field[test_random(&seed) % 9], &bits, sizeof(jsl_real));
        }
        jsl_manifold m;
        jsl_gap gap;
        jsl_ray_hit hit;
        jsl_collide(&p.a, p.pa, &p.b, p.pb, (jsl_real)p.margin, &m);
        assert_in_range(m.count, 0, JSL_MAX_MANIFOLD);
        for (int j = 0; j < m.count; j++)
            assert_true(m.separation[j] <= (jsl_real)p.margin); /* false for NaN */
        (void)jsl_shape_distance(&p.a, p.pa, &p.b, p.pb, &gap);
        (void)jsl_shape_ray(&p.b, p.pb, p.pa.position, jsl_v3(1, 2, 3), &hit);
        (void)jsl_shape_aabb(&p.a, p.pa);
    }
}

int main(void) {
    print_message("seed %llu (JSL_TEST_SEED)\n", (unsigned long long)seed_of_run());
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(swapping_the_shapes_mirrors_the_manifold_to_the_bit),
        cmocka_unit_test(manifolds_are_finite_and_no_deeper_than_the_shapes),
        cmocka_unit_test(contact_points_lie_on_both_surfaces),
        cmocka_unit_test(overlapping_shapes_always_have_a_penetrating_point),
        cmocka_unit_test(a_rigid_motion_of_both_changes_nothing_beyond_rounding),
        cmocka_unit_test(degenerate_pairs_give_finite_answers),
        cmocka_unit_test(two_hundred_boxes_at_one_point_all_touch_and_agree),
        cmocka_unit_test(arbitrary_bits_are_survived),
        cmocka_unit_test(a_plane_meets_no_plane_and_none_meets_nothing),
    };
    return cmocka_run_group_tests_name("collide", tests, NULL, NULL);
}
