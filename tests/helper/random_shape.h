/* SPDX-License-Identifier: MIT
 * Random placed shapes for the tests of geometry: ordinary, needles and plates, from 1e-6 to 1e6 m.
 */
#ifndef JSL_TESTS_RANDOM_SHAPE_H
#define JSL_TESTS_RANDOM_SHAPE_H

#include "helper.h"

#include <jostle/shape.h>

typedef struct random_pair {
    jsl_shape_desc a, b;
    jsl_pose pa, pb;
    double scale;  /* of the pair: tolerances are shares of it */
    double extent; /* the longest length in play, with the distance from the origin */
    double margin;
} random_pair;

static inline jsl_quat random_quat(uint64_t *s) {
    for (;;) {
        double q[4], n = 0;
        for (int i = 0; i < 4; i++) q[i] = test_uniform(s, -1, 1), n += q[i] * q[i];
        if (n > 1 || n < 0.01) continue;
        n = 1 / sqrt(n);
        return jsl_quat_normalize((jsl_quat){(jsl_real)(q[0] * n), (jsl_real)(q[1] * n),
                                             (jsl_real)(q[2] * n), (jsl_real)(q[3] * n)});
    }
}

static inline jsl_vec3 random_vec3(uint64_t *s, double r) {
    return jsl_v3((jsl_real)test_uniform(s, -r, r), (jsl_real)test_uniform(s, -r, r),
                  (jsl_real)test_uniform(s, -r, r));
}

static inline jsl_shape_desc random_shape(uint64_t *s, jsl_shape_kind kind, double scale) {
    double h[3];
    int thin = (int)(test_random(s) % 5); /* 0: needle, 1: plate, else ordinary */
    for (int i = 0; i < 3; i++) h[i] = scale * test_uniform(s, 0.2, 1);
    if (thin == 0) h[0] *= 0.02, h[1] *= 0.02;
    if (thin == 1) h[2] *= 0.01;
    double r = scale * test_uniform(s, 0.1, 1) * (thin == 0 ? 0.05 : 1);
    return (jsl_shape_desc){kind, (jsl_real)r, {(jsl_real)h[0], (jsl_real)h[1], (jsl_real)h[2]}};
}

/* How far the shape reaches from its origin along d (unit). */
static inline double reach_along(const jsl_shape_desc *shape, jsl_quat q, jsl_vec3 d) {
    jsl_vec3 l = jsl_rotate_inv(q, d);
    switch (shape->kind) {
    case JSL_SHAPE_SPHERE:
        return (double)shape->radius;
    case JSL_SHAPE_CAPSULE:
        return (double)(shape->radius + jsl_abs(l.z) * shape->half.z);
    case JSL_SHAPE_BOX:
        return (double)(jsl_abs(l.x) * shape->half.x + jsl_abs(l.y) * shape->half.y +
                        jsl_abs(l.z) * shape->half.z);
    default:
        return 0;
    }
}

/* Two shapes from deep overlap to just apart. */
static inline random_pair random_pair_make(uint64_t *s, jsl_shape_kind a, jsl_shape_kind b) {
    static const double scales[8] = {1, 1, 1, 1, 1e-3, 1e3, 1e-6, 1e6};
    random_pair p = {.scale = scales[test_random(s) % 8]};
    double ratio = test_random(s) % 4 == 0 ? 0.1 : 1;
    p.a = random_shape(s, a, p.scale);
    p.b = random_shape(s, b, p.scale * ratio);
    p.margin = 0.02 * p.scale;
    p.pa.orientation = random_quat(s);
    p.pb.orientation = random_quat(s);
    if (test_random(s) % 4 == 0) p.pb.orientation = p.pa.orientation; /* aligned: ties */
    p.pa.position = random_vec3(s, 4 * p.scale);
    jsl_vec3 d = jsl_rotate(random_quat(s), jsl_v3(0, 0, 1));
    if (b == JSL_SHAPE_PLANE) d = jsl_neg(jsl_rotate(p.pb.orientation, jsl_v3(0, 0, 1)));
    double reach = reach_along(&p.a, p.pa.orientation, d) + reach_along(&p.b, p.pb.orientation, d);
    double at = reach * (test_random(s) & 1 ? test_uniform(s, 0.9, 1.02) : test_uniform(s, 0, 1));
    p.pb.position = jsl_mul_add(p.pa.position, (jsl_real)at, d);
    p.extent = 12 * p.scale;
    return p;
}

#endif
