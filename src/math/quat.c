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

jsl_quat jsl_quat_from_rotation_vector(jsl_vec3 v) {
    jsl_vec3 unit;
    jsl_real angle = split_length(v, &unit);
    return about(unit, angle);
}

jsl_quat jsl_quat_from_axis_angle(jsl_vec3 axis, jsl_real angle) {
    jsl_vec3 unit;
    if (split_length(axis, &unit) == 0) return jsl_quat_identity();
    return about(unit, angle);
}
