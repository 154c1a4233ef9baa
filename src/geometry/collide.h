/* SPDX-License-Identifier: MIT
 * What the files of the narrow phase share. Floor 3.
 *
 * All pair functions work relative to A's position: a float near 0 keeps the digits that a float
 * far from the origin has lost. jsl_collide swaps each pair into one canonical order first and
 * mirrors the answer, so that the two orders agree to the bit whatever happens in between.
 */
#ifndef JSL_GEOMETRY_COLLIDE_H
#define JSL_GEOMETRY_COLLIDE_H

#include "base/base.h"
#include <jostle/shape.h>

/* The world directions of a body's axes. */
typedef struct jsl_axes {
    jsl_vec3 a[3];
} jsl_axes;

/* The zero quaternion gives the identity, as every desc promises. */
static inline jsl_axes jsl_axes_of(jsl_quat q) {
    jsl_real x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
    jsl_real xx = q.x * x2, yy = q.y * y2, zz = q.z * z2;
    jsl_real xy = q.x * y2, xz = q.x * z2, yz = q.y * z2;
    jsl_real wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
    return (jsl_axes){{{1 - (yy + zz), xy + wz, xz - wy},
                       {xy - wz, 1 - (xx + zz), yz + wx},
                       {xz + wy, yz - wx, 1 - (xx + yy)}}};
}
static inline jsl_vec3 jsl_axes_out(const jsl_axes *f, jsl_vec3 v) {
    return jsl_v3(f->a[0].x * v.x + f->a[1].x * v.y + f->a[2].x * v.z,
                  f->a[0].y * v.x + f->a[1].y * v.y + f->a[2].y * v.z,
                  f->a[0].z * v.x + f->a[1].z * v.y + f->a[2].z * v.z);
}
static inline jsl_vec3 jsl_axes_in(const jsl_axes *f, jsl_vec3 v) {
    return jsl_v3(jsl_dot(f->a[0], v), jsl_dot(f->a[1], v), jsl_dot(f->a[2], v));
}
/* The third column alone: the axis of capsules and the normal of planes. */
static inline jsl_vec3 jsl_axis_z(jsl_quat q) {
    jsl_real x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
    return jsl_v3(q.x * z2 + q.w * y2, q.y * z2 - q.w * x2, 1 - (q.x * x2 + q.y * y2));
}

/* Squares below this are noise of underflow: lengths under about 1e-15 m (float) have no direction.
 */
#ifdef JSL_DOUBLE
#define JSL_TINY_SQ 1e-200
#else
#define JSL_TINY_SQ 1e-30f
#endif

/* The length of v, and its direction; `otherwise` when v has none. */
static inline jsl_real jsl_direction(jsl_vec3 v, jsl_vec3 otherwise, jsl_vec3 *direction) {
    jsl_real sq = jsl_length_sq(v);
    if (sq > JSL_TINY_SQ) {
        jsl_real length = jsl_sqrt(sq);
        *direction = jsl_scale(v, 1 / length);
        return length;
    }
    *direction = otherwise;
    return 0;
}

/* One pair in canonical order (kind of a <= kind of b). */
typedef struct jsl_pair_in {
    const jsl_shape_desc *a, *b;
    jsl_quat qa, qb;
    jsl_vec3 p; /* origin of B as seen from the origin of A, world directions */
    jsl_real margin;
} jsl_pair_in;

/* Features of a pair: A's in the low 16 bits, B's in the high ones. 0 is a whole round or flat
 * thing. */
#define JSL_FEATURE(a, b) ((uint32_t)(a) | (uint32_t)(b) << 16)
/* Features of a box. mask has bit i set where the feature lies on the positive side of axis i. */
#define JSL_FEATURE_FACE(axis, positive) (0x10u | (uint32_t)(axis) << 1 | (uint32_t)(positive))
#define JSL_FEATURE_VERTEX(mask) (0x20u | (uint32_t)(mask))
#define JSL_FEATURE_EDGE(axis, mask)                                                               \
    (0x40u | (uint32_t)(axis) << 3 | ((uint32_t)(mask) & ~(1u << (axis))))
/* Features of a capsule: its end towards -z, towards +z, and what lies between. */
enum { JSL_FEATURE_END0 = 1, JSL_FEATURE_END1 = 2, JSL_FEATURE_SIDE = 3 };

/* Adds a point (relative to A) unless it is farther than the margin; false then, and for NaN. */
static inline bool jsl_manifold_add(const jsl_pair_in *in, jsl_manifold *out, jsl_vec3 point,
                                    jsl_real separation, uint32_t feature) {
    if (!(separation <= in->margin)) return false;
    out->point[out->count] = point;
    out->separation[out->count] = separation;
    out->feature[out->count++] = feature;
    return true;
}

/* Distance of the two by GJK, points relative to A; false when their cores cross. No planes. */
bool jsl_gjk(const jsl_pair_in *in, jsl_gap *out);

/* Sine of the tilt above which a capsule stands on a face rather than lies on it. */
#define JSL_STANDING JSL_R(0.1)
/* How far below a point of its axis a capsule's skin lies, straight down a direction that rises by
 * `rise` along the axis; `along`: from that point to the lower end. The side, or the lower ball
 * where the side has ended. */
static inline jsl_real jsl_capsule_reach(jsl_real radius, jsl_real rise, jsl_real along) {
    jsl_real slant_sq = jsl_max(1 - rise * rise, 0), slant = jsl_sqrt(slant_sq);
    if (radius * jsl_abs(rise) <= along * slant) return slant > 0 ? radius / slant : radius;
    return along * jsl_abs(rise) + jsl_sqrt(jsl_max(radius * radius - along * along * slant_sq, 0));
}

/* Each fills out (count 0 on entry) with points relative to A. */
typedef void jsl_collide_fn(const jsl_pair_in *in, jsl_manifold *out);
jsl_collide_fn jsl_collide_sphere_sphere, jsl_collide_sphere_box, jsl_collide_sphere_capsule,
    jsl_collide_sphere_plane, jsl_collide_box_box, jsl_collide_box_capsule, jsl_collide_box_plane,
    jsl_collide_capsule_capsule, jsl_collide_capsule_plane;

#endif
