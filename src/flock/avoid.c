/* SPDX-License-Identifier: MIT
 * Steering round solid things.
 *
 * Two requests add up. The first turns the course to the tangent of the nearest threat soon enough.
 * The second is a last resort: near a surface the approach may not be faster than half the budget
 * could still brake.
 */
#include "flock/avoid.h"

/* -- Geometry -------------------------------------------------------------------------------------
 */

/* A unit vector at right angles to the unit vector u, turned about it by an angle that who fixes.
 */
static jsl_vec3 side_of(jsl_vec3 u, uint64_t who) {
    jsl_vec3 e = jsl_perpendicular(u), f = jsl_cross(u, e);
    jsl_real turn = (jsl_real)(jsl_mix64(who + 0x9e3779b97f4a7c15ull) >> 40) *
                    JSL_R(6.283185307179586 / 16777216.0);
    jsl_real s, c;
    jsl_sin_cos(turn, &s, &c);
    return jsl_add(jsl_scale(e, c), jsl_scale(f, s));
}

/* B and its mirror image about the line to the centre, once W is known. */
static void place(jsl_vec3 p, jsl_vec3 u, jsl_vec3 w, jsl_real d, jsl_real r, jsl_vec3 *near_side,
                  jsl_vec3 *far_side) {
    /* k^2 = (d - r)(d + r): d^2 - r^2 would cancel near the surface. */
    jsl_real k_sq = (d - r) * (d + r), along = k_sq / d, aside = r * jsl_sqrt(k_sq) / d;
    jsl_vec3 foot = jsl_mul_add(p, along, u);
    *near_side = jsl_mul_add(foot, aside, w);
    *far_side = jsl_mul_add(foot, -aside, w);
}

bool jsl_tangent_points(jsl_vec3 p, jsl_vec3 v, jsl_vec3 c, jsl_real r, uint64_t who,
                        jsl_vec3 *near_side, jsl_vec3 *far_side) {
    jsl_vec3 to = jsl_sub(c, p);
    jsl_real d = jsl_length(to);
    if (!(d > r) || !(d > 0)) return false;
    jsl_vec3 u = jsl_scale(to, 1 / d);
    jsl_vec3 w = jsl_mul_add(v, -jsl_dot(v, u), u);
    if (jsl_length_sq(w) <= JSL_R(1e-6) * jsl_length_sq(v)) {
        w = side_of(u, who);
    } else {
        /* The second pass removes what rounding left of U in W when W was short. */
        w = jsl_normalize(w);
        w = jsl_normalize(jsl_mul_add(w, -jsl_dot(w, u), u));
    }
    place(p, u, w, d, r, near_side, far_side);
    return true;
}

bool jsl_tangent_points_around(jsl_vec3 p, jsl_vec3 v, jsl_vec3 c, jsl_vec3 axis, jsl_real r,
                               uint64_t who, jsl_vec3 *near_side, jsl_vec3 *far_side) {
    jsl_vec3 to = jsl_sub(c, p);
    to = jsl_mul_add(to, -jsl_dot(to, axis), axis);
    jsl_real d = jsl_length(to);
    if (!(d > r) || !(d > 0)) return false;
    jsl_vec3 u = jsl_scale(to, 1 / d), w = jsl_cross(axis, u);
    jsl_real side = jsl_dot(v, w), ahead = jsl_dot(v, u);
    if (jsl_abs(side) <= JSL_R(1e-3) * jsl_abs(ahead))
        side = jsl_mix64(who + 0x9e3779b97f4a7c15ull) >> 63 ? JSL_R(1.0) : JSL_R(-1.0);
    if (side < 0) w = jsl_neg(w);
    place(p, u, w, d, r, near_side, far_side);
    return true;
}

jsl_real jsl_time_to_sphere(jsl_vec3 p, jsl_vec3 v, jsl_vec3 c, jsl_real r) {
    jsl_vec3 to = jsl_sub(c, p);
    jsl_real approach = jsl_dot(v, to), speed_sq = jsl_length_sq(v);
    if (!(approach > 0)) return -1;
    jsl_real d = jsl_length(to);
    if (d <= r) return 0;
    jsl_real k_sq = (d - r) * (d + r);
    jsl_real left = approach * approach - speed_sq * k_sq;
    if (!(left > 0)) return -1;
    return k_sq / (approach + jsl_sqrt(left));
}

jsl_real jsl_slide_along(jsl_vec3 c, jsl_vec3 axis, jsl_real half, jsl_vec3 p, jsl_vec3 path) {
    /* Closest points of two segments (Ericson 2005, Real-Time Collision Detection, section 5.1.9),
     * the axis first. */
    jsl_vec3 from = jsl_sub(p, c);
    jsl_real length_sq = jsl_length_sq(path), along = jsl_dot(path, axis);
    jsl_real start = jsl_dot(from, axis), lead = jsl_dot(from, path);
    jsl_real t = 0, slant = length_sq - along * along;
    if (slant > JSL_R(1e-6) * length_sq) t = jsl_clamp((along * start - lead) / slant, 0, 1);
    jsl_real s = jsl_clamp(start + along * t, -half, half);
    if (length_sq > 0) t = jsl_clamp((s * along - lead) / length_sq, 0, 1);
    return jsl_clamp(start + along * t, -half, half);
}

/* -- Obstacles
 * -------------------------------------------------------------------------------------- */

void jsl_obstacle_from(const jsl_collider_item *item, jsl_obstacle *out) {
    const jsl_vec3 h = item->shape.half;
    *out = (jsl_obstacle){.entity = item->entity,
                          .shape = item->shape,
                          .pose = item->pose,
                          .centre = item->pose.position,
                          .velocity = item->velocity,
                          .axis = {0, 0, 1},
                          .radius = item->radius};
    switch (item->shape.kind) {
    case JSL_SHAPE_SPHERE:
        out->radius = item->shape.radius;
        out->snug = true;
        break;
    case JSL_SHAPE_CAPSULE:
        out->radius = item->shape.radius;
        out->half = h.z;
        out->snug = true;
        break;
    case JSL_SHAPE_PLANE:
        out->plane = true;
        out->velocity = jsl_v3(0, 0, 0);
        break;
    case JSL_SHAPE_BOX: {
        /* Elongated when the longest axis is half as long again as the next: then a capsule about
         * it, else a sphere. */
        const bool x = h.x >= h.y && h.x >= h.z, y = !x && h.y >= h.z;
        const jsl_real longest = x ? h.x : y ? h.y : h.z;
        const jsl_real a = x ? h.y : h.x, b = x || y ? h.z : h.y;
        if (longest > JSL_R(1.5) * jsl_max(a, b)) {
            out->axis = x ? jsl_v3(1, 0, 0) : y ? jsl_v3(0, 1, 0) : jsl_v3(0, 0, 1);
            out->half = longest;
            out->radius = jsl_sqrt(a * a + b * b);
        }
        break;
    }
    default:
        break;
    }
    out->axis = jsl_rotate(item->pose.orientation, out->axis);
}

jsl_real jsl_obstacle_distance(const jsl_avoider *boid, const jsl_obstacle *o, jsl_vec3 *normal) {
    if (o->plane) {
        *normal = o->axis;
        return jsl_dot(jsl_sub(boid->p, o->centre), o->axis) - boid->room;
    }
    jsl_vec3 from = jsl_sub(boid->p, o->centre);
    jsl_real s = jsl_clamp(jsl_dot(from, o->axis), -o->half, o->half);
    from = jsl_mul_add(from, -s, o->axis);
    jsl_real d = jsl_length(from), gap = d - o->radius - boid->room;
    if (!o->snug && gap < boid->room)
        return jsl_shape_point_distance(&o->shape, o->pose, boid->p, normal) - boid->room;
    *normal = d > 0 ? jsl_scale(from, 1 / d) : side_of(o->axis, boid->who);
    return gap;
}

/* How a course meets an obstacle. */
typedef struct threat {
    jsl_real time;      /* s until the inflated surface; -1: never */
    jsl_vec3 centre;    /* of the sphere, slid along the axis */
    jsl_vec3 normal;    /* when steering along a surface */
    bool around, along; /* a cylinder's side; a surface met from inside the bounding capsule */
} threat;

static threat meet(const jsl_avoider *boid, jsl_vec3 velocity, const jsl_obstacle *o) {
    threat t = {.time = -1};
    const jsl_vec3 v = jsl_sub(velocity, o->velocity);
    jsl_vec3 normal;
    const jsl_real room = o->radius + boid->room;
    if (!o->plane) {
        const jsl_vec3 path = jsl_scale(v, boid->horizon);
        const jsl_real s =
            o->half > 0 ? jsl_slide_along(o->centre, o->axis, o->half, boid->p, path) : 0;
        t.centre = jsl_mul_add(o->centre, s, o->axis);
        t.around = o->half > 0 && jsl_abs(s) < o->half;
        jsl_vec3 c = t.centre, w = v;
        if (t.around) { /* across the axis only */
            jsl_vec3 to = jsl_sub(c, boid->p);
            c = jsl_add(boid->p, jsl_mul_add(to, -jsl_dot(to, o->axis), o->axis));
            w = jsl_mul_add(v, -jsl_dot(v, o->axis), o->axis);
        }
        if (jsl_length_sq(jsl_sub(c, boid->p)) > room * room) {
            t.time = jsl_time_to_sphere(boid->p, w, c, room);
            return t;
        }
    }
    /* Planes, and inside a bounding capsule or sphere: the true surface decides. */
    const jsl_real gap = jsl_obstacle_distance(boid, o, &normal), approach = -jsl_dot(v, normal);
    t.along = true;
    t.normal = normal;
    if (approach > 0) t.time = jsl_max(gap, 0) / approach;
    return t;
}

/* The earliest meeting within the horizon when flying at `velocity`, with anything but obstacle
 * `but`; -1: none. */
static int earliest(const jsl_avoider *boid, jsl_vec3 velocity, const jsl_obstacle *at,
                    const int32_t *list, int count, int but, threat *out) {
    int best = -1;
    for (int i = 0; i < count; i++) {
        if (list[i] == but) continue;
        threat t = meet(boid, velocity, &at[list[i]]);
        if (t.time < 0 || t.time >= boid->horizon) continue;
        if (best >= 0 && t.time >= out->time) continue;
        *out = t;
        best = list[i];
    }
    return best;
}

/* Courses at the present speed past a threat: one or two, the one of less turn first. Returns their
 * number. */
static int courses(const jsl_avoider *boid, const jsl_obstacle *o, const threat *t, jsl_vec3 *out) {
    const jsl_vec3 v = jsl_sub(boid->v, o->velocity);
    const jsl_real speed = jsl_length(v), r = o->radius + boid->room;
    if (t->along) {
        jsl_vec3 tangent = jsl_mul_add(v, -jsl_dot(v, t->normal), t->normal);
        if (jsl_length_sq(tangent) <= JSL_R(1e-6) * speed * speed)
            tangent = side_of(t->normal, boid->who);
        tangent = jsl_scale(jsl_normalize(tangent), speed);
        out[0] = jsl_add(tangent, o->velocity);
        return 1;
    }
    jsl_vec3 b[2], drift = jsl_v3(0, 0, 0);
    jsl_real pace = speed;
    bool outside;
    if (t->around) {
        const jsl_real along = jsl_dot(v, o->axis);
        drift = jsl_scale(o->axis, along);
        pace = jsl_length(jsl_sub(v, drift));
        outside =
            jsl_tangent_points_around(boid->p, v, t->centre, o->axis, r, boid->who, &b[0], &b[1]);
    } else {
        outside = jsl_tangent_points(boid->p, v, t->centre, r, boid->who, &b[0], &b[1]);
    }
    if (!outside) return 0;
    for (int i = 0; i < 2; i++) {
        jsl_vec3 e = jsl_normalize(jsl_sub(b[i], boid->p));
        out[i] = jsl_add(jsl_mul_add(drift, pace, e), o->velocity);
    }
    return 2;
}

/* The turn: away from the nearest threat by the tangent of less turn, unless that meets another
 * threat; then the tangents of both are tried and the one that stays free longest is taken, the
 * first of equals. */
static jsl_vec3 turn(const jsl_avoider *boid, const jsl_obstacle *at, const int32_t *list,
                     int count) {
    threat t, next;
    const int first = earliest(boid, boid->v, at, list, count, -1, &t);
    if (first < 0) return jsl_v3(0, 0, 0);
    jsl_vec3 way[4];
    int of[4] = {first, first, 0, 0}, ways = courses(boid, &at[first], &t, way);
    if (ways == 0) return jsl_v3(0, 0, 0);
    jsl_vec3 best = way[0];
    jsl_real free = -1;
    for (int i = 0, first_ways = ways; i < ways && free < boid->horizon; i++) {
        /* A tangent grazes the sphere it was made for: that is no hit. */
        const int other = earliest(boid, way[i], at, list, count, of[i], &next);
        const jsl_real until = other < 0 ? boid->horizon : next.time;
        if (until > free) {
            free = until;
            best = way[i];
        }
        if (i > 0 || other < 0) continue;
        ways += courses(boid, &at[other], &next, way + ways);
        for (int k = first_ways; k < ways; k++) of[k] = other;
    }
    /* The angle left falls with the square of the time left, so the acceleration never grows. */
    jsl_real rate = 2 / jsl_max(t.time, 2 * boid->interval);
    return jsl_scale(jsl_sub(best, boid->v), rate);
}

static jsl_vec3 guard(const jsl_avoider *boid, const jsl_obstacle *at, const int32_t *list,
                      int count) {
    jsl_vec3 sum = jsl_v3(0, 0, 0);
    const jsl_real rate = 1 / jsl_max(2 * boid->interval, JSL_R(0.02));
    for (int i = 0; i < count; i++) {
        const jsl_obstacle *o = &at[list[i]];
        jsl_vec3 n;
        jsl_real gap = jsl_obstacle_distance(boid, o, &n);
        jsl_real approach = -jsl_dot(jsl_sub(boid->v, o->velocity), n);
        jsl_real allowed = gap > 0 ? jsl_sqrt(boid->budget * gap) : 4 * gap;
        if (approach > allowed) sum = jsl_mul_add(sum, (approach - allowed) * rate, n);
    }
    return sum;
}

jsl_vec3 jsl_avoid(const jsl_avoider *boid, const jsl_obstacle *at, const int32_t *list,
                   int count) {
    if (count == 0) return jsl_v3(0, 0, 0);
    jsl_vec3 hold = guard(boid, at, list, count);
    jsl_vec3 request = jsl_add(turn(boid, at, list, count), hold);
    return jsl_v3_is_finite(request) ? request : jsl_v3(0, 0, 0);
}
