/* SPDX-License-Identifier: MIT
 * jostle/math.h - vectors, quaternions and small matrices as plain values.
 *
 * Right-handed. Quaternions are (x, y, z, w), unit, body to world. Everything here is a handful of
 * IEEE operations in a fixed order, so that every build gives the same bits. sin, cos and atan2 are
 * ours because those of C libraries differ from one another. Floor 1.
 */
#ifndef JOSTLE_MATH_H
#define JOSTLE_MATH_H

#include <jostle/base.h>

#include <math.h>

#ifdef __cplusplus
extern "C" {
#endif

#define JSL_PI JSL_R(3.14159265358979323846)

typedef struct jsl_vec3 {
    jsl_real x, y, z;
} jsl_vec3;

typedef struct jsl_quat {
    jsl_real x, y, z, w;
} jsl_quat;

/* Rows r0, r1, r2: m * v = (r0.v, r1.v, r2.v). */
typedef struct jsl_mat3 {
    jsl_vec3 r0, r1, r2;
} jsl_mat3;

typedef struct jsl_pose {
    jsl_vec3 position;    /* m */
    jsl_quat orientation; /* unit; the zero quaternion is read as the identity by every desc */
} jsl_pose;

typedef struct jsl_aabb {
    jsl_vec3 lo, hi; /* m; empty when any lo > hi */
} jsl_aabb;

static inline jsl_real jsl_sqrt(jsl_real x) {
#ifdef JSL_DOUBLE
    return sqrt(x);
#else
    return sqrtf(x);
#endif
}
/* Clears the sign bit, also of zeros and NaN. */
static inline jsl_real jsl_abs(jsl_real x) {
#ifdef JSL_DOUBLE
    return fabs(x);
#else
    return fabsf(x);
#endif
}
static inline jsl_real jsl_min(jsl_real a, jsl_real b) { return a < b ? a : b; }
static inline jsl_real jsl_max(jsl_real a, jsl_real b) { return a > b ? a : b; }
static inline jsl_real jsl_clamp(jsl_real x, jsl_real lo, jsl_real hi) {
    return jsl_min(jsl_max(x, lo), hi);
}
static inline bool jsl_is_finite(jsl_real x) { return x - x == 0; }

static inline jsl_vec3 jsl_v3(jsl_real x, jsl_real y, jsl_real z) { return (jsl_vec3){x, y, z}; }
static inline jsl_vec3 jsl_add(jsl_vec3 a, jsl_vec3 b) {
    return jsl_v3(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline jsl_vec3 jsl_sub(jsl_vec3 a, jsl_vec3 b) {
    return jsl_v3(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline jsl_vec3 jsl_neg(jsl_vec3 a) { return jsl_v3(-a.x, -a.y, -a.z); }
static inline jsl_vec3 jsl_scale(jsl_vec3 a, jsl_real s) {
    return jsl_v3(a.x * s, a.y * s, a.z * s);
}
/* a + s b */
static inline jsl_vec3 jsl_mul_add(jsl_vec3 a, jsl_real s, jsl_vec3 b) {
    return jsl_v3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}
static inline jsl_real jsl_dot(jsl_vec3 a, jsl_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline jsl_vec3 jsl_cross(jsl_vec3 a, jsl_vec3 b) {
    return jsl_v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline jsl_real jsl_length_sq(jsl_vec3 a) { return jsl_dot(a, a); }
static inline jsl_real jsl_length(jsl_vec3 a) { return jsl_sqrt(jsl_dot(a, a)); }
/* The unit vector along a, or (0,0,0) when a is shorter than 1e-18 m. */
static inline jsl_vec3 jsl_normalize(jsl_vec3 a) {
    jsl_real length = jsl_length(a);
    return length > JSL_R(1e-18) ? jsl_scale(a, 1 / length) : jsl_v3(0, 0, 0);
}
static inline bool jsl_v3_is_finite(jsl_vec3 a) {
    return jsl_is_finite(a.x) && jsl_is_finite(a.y) && jsl_is_finite(a.z);
}
/* A unit vector at right angles to the unit vector n, continuous but on one circle. */
static inline jsl_vec3 jsl_perpendicular(jsl_vec3 n) {
    jsl_vec3 p = jsl_abs(n.x) > JSL_R(0.57735) ? jsl_v3(n.y, -n.x, 0) : jsl_v3(0, n.z, -n.y);
    return jsl_normalize(p);
}

static inline jsl_quat jsl_quat_identity(void) { return (jsl_quat){0, 0, 0, 1}; }
static inline jsl_quat jsl_quat_mul(jsl_quat a, jsl_quat b) {
    return (jsl_quat){a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}
static inline jsl_quat jsl_quat_conj(jsl_quat q) { return (jsl_quat){-q.x, -q.y, -q.z, q.w}; }
/* Unit again; the identity when q is too short to have a direction. */
static inline jsl_quat jsl_quat_normalize(jsl_quat q) {
    jsl_real n = jsl_sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(n > JSL_R(1e-18))) return jsl_quat_identity();
    jsl_real s = 1 / n;
    return (jsl_quat){q.x * s, q.y * s, q.z * s, q.w * s};
}
/* The vector v of the body frame in the world frame. */
static inline jsl_vec3 jsl_rotate(jsl_quat q, jsl_vec3 v) {
    jsl_vec3 u = jsl_v3(q.x, q.y, q.z);
    jsl_vec3 t = jsl_scale(jsl_cross(u, v), 2);
    return jsl_add(jsl_mul_add(v, q.w, t), jsl_cross(u, t));
}
/* The vector v of the world frame in the body frame. */
static inline jsl_vec3 jsl_rotate_inv(jsl_quat q, jsl_vec3 v) {
    return jsl_rotate(jsl_quat_conj(q), v);
}
static inline jsl_vec3 jsl_pose_point(jsl_pose p, jsl_vec3 v) {
    return jsl_add(p.position, jsl_rotate(p.orientation, v));
}
static inline jsl_vec3 jsl_pose_point_inv(jsl_pose p, jsl_vec3 v) {
    return jsl_rotate_inv(p.orientation, jsl_sub(v, p.position));
}

static inline jsl_vec3 jsl_mat3_mul_vec(jsl_mat3 m, jsl_vec3 v) {
    return jsl_v3(jsl_dot(m.r0, v), jsl_dot(m.r1, v), jsl_dot(m.r2, v));
}
/* Columns are the world directions of the body axes. */
JSL_API jsl_mat3 jsl_mat3_from_quat(jsl_quat q);
/* R diag(d) R^T, a body-frame principal tensor d turned into the world. */
JSL_API jsl_mat3 jsl_mat3_rotate_diagonal(jsl_quat q, jsl_vec3 d);
/* The rotation by |v| radians about v (exponential map), accurate for any |v|. */
JSL_API jsl_quat jsl_quat_from_rotation_vector(jsl_vec3 v);
/* From an axis (any length but zero) and an angle in rad. */
JSL_API jsl_quat jsl_quat_from_axis_angle(jsl_vec3 axis, jsl_real angle);
/* Principal moments (ascending) and the rotation from the principal frame to the given one, by
 * cyclic Jacobi; m must be symmetric. Converges to rounding. */
JSL_API void jsl_mat3_eigen_symmetric(jsl_mat3 m, jsl_vec3 *moments, jsl_quat *frame);

/* Within 2 ulp of the true value for |x| <= 1e5 (float) or 1e9 (double); the same bits in every
 * build. */
JSL_API jsl_real jsl_sin(jsl_real x);
JSL_API jsl_real jsl_cos(jsl_real x);
JSL_API void jsl_sin_cos(jsl_real x, jsl_real *sine, jsl_real *cosine);
JSL_API jsl_real jsl_atan2(jsl_real y, jsl_real x);
/* e^x and ln x (x > 0), within 2 ulp; the same bits in every build. */
JSL_API jsl_real jsl_exp(jsl_real x);
JSL_API jsl_real jsl_log(jsl_real x);

#ifdef __cplusplus
}
#endif
#endif
