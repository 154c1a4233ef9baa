/* SPDX-License-Identifier: MIT
 * First hit of a segment with a placed shape. All in the shape's frame, relative to its position.
 */
#include "geometry/collide.h"

/* Entry of m + t d into the ball of radius r about the origin, given m outside; 2 when there is
 * none. The chord is halved about the point nearest the centre: b^2 - 4ac would cancel for far
 * starts (Haines et al. 2019, Ray Tracing Gems 7). */
static jsl_real ball_entry(jsl_vec3 m, jsl_vec3 d, jsl_real r) {
    jsl_real dd = jsl_length_sq(d);
    if (!(dd > JSL_TINY_SQ)) return 2;
    jsl_real mid = -jsl_dot(m, d) / dd;
    if (mid <= 0) return 2;
    jsl_real chord = r * r - jsl_length_sq(jsl_mul_add(m, mid, d));
    if (chord < 0) return 2;
    return jsl_max(mid - jsl_sqrt(chord / dd), 0);
}

static bool sphere_ray(jsl_real r, jsl_vec3 m, jsl_vec3 d, jsl_ray_hit *out) {
    out->fraction = ball_entry(m, d, r);
    if (out->fraction > 1) return false;
    jsl_direction(jsl_mul_add(m, out->fraction, d), jsl_v3(0, 0, 1), &out->normal);
    return true;
}

static bool box_ray(jsl_vec3 half, jsl_vec3 m, jsl_vec3 d, jsl_ray_hit *out) {
    const jsl_real h[3] = {half.x, half.y, half.z}, o[3] = {m.x, m.y, m.z}, v[3] = {d.x, d.y, d.z};
    jsl_real enter = -1, leave = 1;
    int axis = 0;
    for (int i = 0; i < 3; i++) {
        if (v[i] == 0) {
            if (jsl_abs(o[i]) > h[i]) return false;
            continue;
        }
        jsl_real s = v[i] > 0 ? 1 : -1;
        jsl_real t0 = (-s * h[i] - o[i]) / v[i], t1 = (s * h[i] - o[i]) / v[i];
        if (t0 > enter) enter = t0, axis = i;
        leave = jsl_min(leave, t1);
    }
    if (!(enter >= 0 && enter <= leave)) return false; /* a start inside was dealt with before */
    jsl_real n[3] = {0, 0, 0};
    n[axis] = v[axis] > 0 ? -1 : 1;
    out->fraction = enter;
    out->normal = jsl_v3(n[0], n[1], n[2]);
    return true;
}

static bool capsule_ray(jsl_real r, jsl_real half, jsl_vec3 m, jsl_vec3 d, jsl_ray_hit *out) {
    /* The side first: a hit on the infinite cylinder between the ends is the first hit of the
     * whole. */
    jsl_real t = ball_entry(jsl_v3(m.x, m.y, 0), jsl_v3(d.x, d.y, 0), r);
    bool starts_beside = m.x * m.x + m.y * m.y > r * r;
    if (t <= 1 && starts_beside && jsl_abs(m.z + t * d.z) <= half) {
        out->fraction = t;
        jsl_direction(jsl_v3(m.x + t * d.x, m.y + t * d.y, 0), jsl_v3(1, 0, 0), &out->normal);
        return true;
    }
    jsl_real low = ball_entry(jsl_v3(m.x, m.y, m.z + half), d, r);
    jsl_real high = ball_entry(jsl_v3(m.x, m.y, m.z - half), d, r);
    t = jsl_min(low, high);
    if (t > 1) return false;
    out->fraction = t;
    jsl_vec3 at = jsl_mul_add(m, t, d);
    at.z += low <= high ? half : -half;
    jsl_direction(at, jsl_v3(0, 0, 1), &out->normal);
    return true;
}

static bool plane_ray(jsl_vec3 m, jsl_vec3 d, jsl_ray_hit *out) {
    if (!(m.z + d.z <= 0)) return false; /* m.z > 0 here */
    out->fraction = jsl_min(m.z / -d.z, 1);
    out->normal = jsl_v3(0, 0, 1);
    return true;
}

bool jsl_shape_ray(const jsl_shape_desc *shape, jsl_pose pose, jsl_vec3 from, jsl_vec3 to,
                   jsl_ray_hit *out) {
    jsl_ray_hit hit = {0, from, {0, 0, 1}};
    if (shape->kind == JSL_SHAPE_NONE) return false;
    if (jsl_shape_point_distance(shape, pose, from, &hit.normal) <= 0) {
        *out = hit;
        return true;
    }
    jsl_axes f = jsl_axes_of(pose.orientation);
    jsl_vec3 m = jsl_axes_in(&f, jsl_sub(from, pose.position));
    jsl_vec3 d = jsl_axes_in(&f, jsl_sub(to, from));
    bool found = false;
    switch (shape->kind) {
    case JSL_SHAPE_SPHERE:
        found = sphere_ray(shape->radius, m, d, &hit);
        break;
    case JSL_SHAPE_BOX:
        found = box_ray(shape->half, m, d, &hit);
        break;
    case JSL_SHAPE_CAPSULE:
        found = capsule_ray(shape->radius, shape->half.z, m, d, &hit);
        break;
    case JSL_SHAPE_PLANE:
        found = plane_ray(m, d, &hit);
        break;
    default:
        break;
    }
    if (!found) return false;
    hit.normal = jsl_axes_out(&f, hit.normal);
    hit.point = jsl_mul_add(from, hit.fraction, jsl_sub(to, from));
    *out = hit;
    return true;
}
