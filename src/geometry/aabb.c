/* SPDX-License-Identifier: MIT
 * Bounds of placed shapes.
 */
#include "geometry/collide.h"

#define FAR JSL_R(1e30)

/* A plane bounds something only when it looks along a world axis. */
static jsl_aabb plane_aabb(jsl_pose pose) {
    jsl_vec3 n = jsl_axis_z(pose.orientation), o = pose.position;
    jsl_aabb box = {{-FAR, -FAR, -FAR}, {FAR, FAR, FAR}};
    if (n.y == 0 && n.z == 0) *(n.x > 0 ? &box.hi.x : &box.lo.x) = o.x;
    if (n.x == 0 && n.z == 0) *(n.y > 0 ? &box.hi.y : &box.lo.y) = o.y;
    if (n.x == 0 && n.y == 0) *(n.z > 0 ? &box.hi.z : &box.lo.z) = o.z;
    return box;
}

jsl_aabb jsl_shape_aabb(const jsl_shape_desc *shape, jsl_pose pose) {
    jsl_vec3 half = {0, 0, 0};
    switch (shape->kind) {
    case JSL_SHAPE_SPHERE:
        half = jsl_v3(shape->radius, shape->radius, shape->radius);
        break;
    case JSL_SHAPE_BOX: {
        jsl_axes f = jsl_axes_of(pose.orientation);
        jsl_vec3 h = shape->half;
        half.x = jsl_abs(f.a[0].x) * h.x + jsl_abs(f.a[1].x) * h.y + jsl_abs(f.a[2].x) * h.z;
        half.y = jsl_abs(f.a[0].y) * h.x + jsl_abs(f.a[1].y) * h.y + jsl_abs(f.a[2].y) * h.z;
        half.z = jsl_abs(f.a[0].z) * h.x + jsl_abs(f.a[1].z) * h.y + jsl_abs(f.a[2].z) * h.z;
        break;
    }
    case JSL_SHAPE_CAPSULE: {
        jsl_vec3 u = jsl_axis_z(pose.orientation);
        half.x = shape->radius + jsl_abs(u.x) * shape->half.z;
        half.y = shape->radius + jsl_abs(u.y) * shape->half.z;
        half.z = shape->radius + jsl_abs(u.z) * shape->half.z;
        break;
    }
    case JSL_SHAPE_PLANE:
        return plane_aabb(pose);
    default:
        break;
    }
    return (jsl_aabb){jsl_sub(pose.position, half), jsl_add(pose.position, half)};
}
