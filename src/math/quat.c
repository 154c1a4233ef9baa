/* SPDX-License-Identifier: MIT
 * quat.c - quaternions from rotations.
 */
#include <jostle/math.h>

/* The length of v and the unit vector along it, without overflow or underflow in the squares. */
static jsl_real split_length(jsl_vec3 v, jsl_vec3 *unit) {
    if (!jsl_v3_is_finite(v)) { /* jsl_max would drop a NaN */
        *unit = jsl_v3((jsl_real)NAN, (jsl_real)NAN, (jsl_real)NAN);
        return (jsl_real)NAN;
    }
    jsl_real largest = jsl_max(jsl_max(jsl_abs(v.x), jsl_abs(v.y)), jsl_abs(v.z));
    if (largest == 0) {
        *unit = jsl_v3(0, 0, 0);
        return 0;
    }
    jsl_vec3 u = jsl_v3(v.x / largest, v.y / largest, v.z / largest);
    jsl_real length = jsl_length(u); /* in [1, sqrt(3)] */
    *unit = jsl_v3(u.x / length, u.y / length, u.z / length);
    return length * largest;
}

static jsl_quat about(jsl_vec3 unit, jsl_real angle) {
    jsl_real s, c;
    jsl_sin_cos(angle / 2, &s, &c);
    return (jsl_quat){unit.x * s, unit.y * s, unit.z * s, c};
}

/* Below this square of half the angle the series of sin(x)/x and cos(x) up to x^6 are exact to
 * rounding: the first terms left out are x^6/5040 and x^8/40320. */
#ifdef JSL_DOUBLE
#define SMALL_HALF_SQ 1e-5
#else
#define SMALL_HALF_SQ 0.02f
#endif

jsl_quat jsl_quat_from_rotation_vector(jsl_vec3 v) {
    jsl_vec3 half = jsl_scale(v, JSL_R(0.5));
    jsl_real x2 = jsl_dot(half, half);
    if (x2 < SMALL_HALF_SQ) {
        jsl_real sinc = 1 - x2 * (JSL_R(1.0 / 6) - x2 * JSL_R(1.0 / 120));
        jsl_real cosine = 1 - x2 * (JSL_R(0.5) - x2 * (JSL_R(1.0 / 24) - x2 * JSL_R(1.0 / 720)));
        return (jsl_quat){half.x * sinc, half.y * sinc, half.z * sinc, cosine};
    }
    jsl_vec3 unit;
    jsl_real angle = split_length(v, &unit);
    return about(unit, angle);
}

jsl_quat jsl_quat_from_axis_angle(jsl_vec3 axis, jsl_real angle) {
    jsl_vec3 unit;
    if (split_length(axis, &unit) == 0) return jsl_quat_identity();
    return about(unit, angle);
}
