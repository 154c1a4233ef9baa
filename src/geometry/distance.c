/* SPDX-License-Identifier: MIT
 * Signed distance from a point to a placed shape, in closed form.
 */
#include "geometry/collide.h"

static jsl_real box_distance(jsl_vec3 h, jsl_vec3 c, jsl_vec3 *normal) {
    jsl_vec3 e = {c.x - jsl_clamp(c.x, -h.x, h.x), c.y - jsl_clamp(c.y, -h.y, h.y),
                  c.z - jsl_clamp(c.z, -h.z, h.z)};
    jsl_real outside = jsl_direction(e, jsl_v3(0, 0, 0), normal);
    if (outside > 0) return outside;
    /* Inside, or so near that the excess has no direction: the nearest face, the first of equals.
     */
    jsl_vec3 d = {jsl_abs(c.x) - h.x, jsl_abs(c.y) - h.y, jsl_abs(c.z) - h.z};
    jsl_real one = 1;
    if (d.x >= d.y && d.x >= d.z) {
        *normal = jsl_v3(c.x < 0 ? -one : one, 0, 0);
        return d.x;
    }
    if (d.y >= d.z) {
        *normal = jsl_v3(0, c.y < 0 ? -one : one, 0);
        return d.y;
    }
    *normal = jsl_v3(0, 0, c.z < 0 ? -one : one);
    return d.z;
}

jsl_real jsl_shape_point_distance(const jsl_shape_desc *shape, jsl_pose pose, jsl_vec3 point,
                                  jsl_vec3 *normal) {
    jsl_vec3 rel = jsl_sub(point, pose.position), ignored;
    if (!normal) normal = &ignored;
    switch (shape->kind) {
    case JSL_SHAPE_SPHERE:
        return jsl_direction(rel, jsl_v3(0, 0, 1), normal) - shape->radius;
    case JSL_SHAPE_BOX: {
        jsl_axes f = jsl_axes_of(pose.orientation);
        jsl_vec3 n;
        jsl_real d = box_distance(shape->half, jsl_axes_in(&f, rel), &n);
        *normal = jsl_axes_out(&f, n);
        return d;
    }
    case JSL_SHAPE_CAPSULE: {
        jsl_vec3 u = jsl_axis_z(pose.orientation);
        jsl_real t = jsl_clamp(jsl_dot(u, rel), -shape->half.z, shape->half.z);
        return jsl_direction(jsl_mul_add(rel, -t, u), jsl_perpendicular(u), normal) - shape->radius;
    }
    case JSL_SHAPE_PLANE:
        *normal = jsl_axis_z(pose.orientation);
        return jsl_dot(*normal, rel);
    default:
        *normal = jsl_v3(0, 0, 1);
        return JSL_R(1e30);
    }
}
