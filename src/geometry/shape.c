/* SPDX-License-Identifier: MIT
 * Kinds of shapes, their checks and their mass properties.
 */
#include "base/base.h"
#include <jostle/shape.h>

const char *jsl_shape_kind_text(jsl_shape_kind kind) {
    static const char *const text[JSL_SHAPE_KIND_COUNT] = {"none", "sphere", "box", "capsule",
                                                           "plane"};
    return (unsigned)kind < JSL_SHAPE_KIND_COUNT ? text[kind] : "unknown shape";
}

static jsl_result check_length(jsl_real length) {
    if (!jsl_is_finite(length)) return JSL_ERR_NOT_FINITE;
    return length > 0 ? JSL_OK : JSL_ERR_ARGUMENT;
}

jsl_result jsl_shape_check(const jsl_shape_desc *shape) {
    if (!shape) return JSL_ERR_ARGUMENT;
    switch (shape->kind) {
    case JSL_SHAPE_SPHERE:
        return check_length(shape->radius);
    case JSL_SHAPE_BOX:
        if (!jsl_v3_is_finite(shape->half)) return JSL_ERR_NOT_FINITE;
        JSL_TRY(check_length(shape->half.x));
        JSL_TRY(check_length(shape->half.y));
        return check_length(shape->half.z);
    case JSL_SHAPE_CAPSULE:
        if (!jsl_is_finite(shape->half.z)) return JSL_ERR_NOT_FINITE;
        JSL_TRY(check_length(shape->radius));
        return check_length(shape->half.z);
    case JSL_SHAPE_PLANE:
        return JSL_OK;
    default:
        return JSL_ERR_ARGUMENT;
    }
}

/* In double whatever the scalar: r^5 of a 1e-6 m grain times a density leaves the range of float in
 * between. */
jsl_result jsl_shape_mass(const jsl_shape_desc *shape, jsl_real density, jsl_mass_properties *out) {
    JSL_TRY(jsl_shape_check(shape));
    JSL_TRY(check_length(density));
    const double pi = 3.14159265358979323846;
    double rho = density, volume, ix, iy, iz, r = shape->radius;
    double x = shape->half.x, y = shape->half.y, z = shape->half.z;
    switch (shape->kind) {
    case JSL_SHAPE_SPHERE:
        volume = 4 * pi / 3 * r * r * r;
        ix = iy = iz = rho * volume * (0.4 * r * r);
        break;
    case JSL_SHAPE_BOX:
        volume = 8 * x * y * z;
        ix = rho * volume * ((y * y + z * z) / 3);
        iy = rho * volume * ((x * x + z * z) / 3);
        iz = rho * volume * ((x * x + y * y) / 3);
        break;
    case JSL_SHAPE_CAPSULE: {
        /* A cylinder of length 2z and two half balls whose own centres lie 3r/8 beyond its ends. */
        double cylinder = 2 * pi * r * r * z, ball = 4 * pi / 3 * r * r * r;
        volume = cylinder + ball;
        iz = rho * (cylinder * (r * r / 2) + ball * (0.4 * r * r));
        ix = iy = rho * (cylinder * (r * r / 4 + z * z / 3) +
                         ball * (0.4 * r * r + z * z + 0.75 * z * r));
        break;
    }
    default:
        return JSL_ERR_ARGUMENT; /* a plane has no mass */
    }
    jsl_mass_properties m = {(jsl_real)volume, (jsl_real)(rho * volume),
                             jsl_v3((jsl_real)ix, (jsl_real)iy, (jsl_real)iz)};
    if (!jsl_is_finite(m.volume) || !jsl_is_finite(m.mass) || !jsl_v3_is_finite(m.inertia))
        return JSL_ERR_NOT_FINITE;
    if (!(m.mass > 0 && m.inertia.x > 0 && m.inertia.y > 0 && m.inertia.z > 0))
        return JSL_ERR_DEGENERATE; /* too small for the scalar type */
    *out = m;
    return JSL_OK;
}

jsl_real jsl_shape_radius(const jsl_shape_desc *shape) {
    switch (shape->kind) {
    case JSL_SHAPE_SPHERE:
        return shape->radius;
    case JSL_SHAPE_BOX:
        return jsl_length(shape->half);
    case JSL_SHAPE_CAPSULE:
        return shape->radius + shape->half.z;
    case JSL_SHAPE_PLANE:
        return JSL_R(1e30);
    default:
        return 0;
    }
}
