/* SPDX-License-Identifier: MIT
 * The instant of impact of two moving and spinning shapes: by conservative advancement (Mirtich
 * 1996), and in the two classic ways of backing up from the end of the step.
 */
#include "geometry/collide.h"

enum { MOST_EVALUATIONS = 1000, MOST_HALVINGS = 60 };

typedef struct search {
    const jsl_shape_desc *a, *b;
    const jsl_sweep *sa, *sb;
    double turn_a, turn_b; /* reach of what turning can bring nearer, m */
    jsl_toi *out;
} search;

static jsl_pose pose_at(const jsl_sweep *s, double time) {
    jsl_real t = (jsl_real)time;
    jsl_vec3 w = jsl_scale(s->spin, t);
    jsl_pose p = {jsl_mul_add(s->pose.position, t, s->velocity), s->pose.orientation};
    if (w.x == 0 && w.y == 0 && w.z == 0) return p;
    jsl_quat q = s->pose.orientation;
    if (q.x == 0 && q.y == 0 && q.z == 0 && q.w == 0) q = jsl_quat_identity();
    p.orientation = jsl_quat_normalize(jsl_quat_mul(jsl_quat_from_rotation_vector(w), q));
    return p;
}

/* Signed distance at that time; keeps the time and the gap in out. */
static double distance_at(const search *s, double time) {
    s->out->evaluations++;
    s->out->time = (jsl_real)time;
    jsl_shape_distance(s->a, pose_at(s->sa, time), s->b, pose_at(s->sb, time), &s->out->gap);
    return (double)s->out->gap.distance;
}

/* How far from the origin a shape has anything that turning moves: the radius of a ball does not
 * count. */
static double turning_reach(const jsl_shape_desc *shape) {
    if (shape->kind == JSL_SHAPE_BOX) return (double)jsl_length(shape->half);
    return shape->kind == JSL_SHAPE_CAPSULE ? (double)shape->half.z : 0;
}

/* The slab between the nearest points keeps its direction n while the shapes move on. Along n they
 * can approach no faster than their relative speed plus R |n x w| of each, so until it is used up
 * there is no contact. */
static double approach(const search *s) {
    jsl_vec3 n = s->out->gap.normal;
    double speed = (double)jsl_dot(n, jsl_sub(s->sa->velocity, s->sb->velocity));
    speed += s->turn_a * (double)jsl_length(jsl_cross(n, s->sa->spin));
    speed += s->turn_b * (double)jsl_length(jsl_cross(n, s->sb->spin));
    return speed;
}

static jsl_toi_state conservative(const search *s, double dt, double tolerance) {
    double t = 0;
    for (int i = 0; i < MOST_EVALUATIONS; i++) {
        double d = distance_at(s, t);
        if (d < 0 && i == 0) return JSL_TOI_OVERLAPPED;
        if (d <= tolerance) return JSL_TOI_HIT;
        if (t >= dt) return JSL_TOI_SEPARATED;
        double speed = approach(s), next = speed > 0 ? t + d / speed : dt;
        if (!(next < dt)) {
            distance_at(s, dt);
            return s->out->gap.distance <= tolerance ? JSL_TOI_HIT : JSL_TOI_SEPARATED;
        }
        if (!((jsl_real)next > (jsl_real)t)) return JSL_TOI_FAILED; /* finer than the clock */
        t = next;
    }
    return JSL_TOI_FAILED;
}

static jsl_toi_state bisection(const search *s, double dt, double tolerance) {
    double lo = 0, hi = dt;
    if (distance_at(s, 0) < 0) return JSL_TOI_OVERLAPPED;
    if (distance_at(s, dt) > tolerance) return JSL_TOI_SEPARATED;
    for (int i = 0; i < MOST_HALVINGS; i++) {
        double mid = lo + (hi - lo) / 2, d = distance_at(s, mid);
        if (d >= 0 && d <= tolerance) return JSL_TOI_HIT;
        *(d > 0 ? &lo : &hi) = mid;
    }
    distance_at(s, lo);
    return JSL_TOI_FAILED;
}

static jsl_toi_state linear(const search *s, double dt, double tolerance) {
    double d0 = distance_at(s, 0);
    if (d0 < 0) return JSL_TOI_OVERLAPPED;
    double d1 = distance_at(s, dt);
    if (d1 > tolerance) return JSL_TOI_SEPARATED;
    if (d1 < 0) distance_at(s, dt * (d0 / (d0 - d1)));
    return JSL_TOI_HIT;
}

static jsl_result check_sweep(const jsl_shape_desc *shape, const jsl_sweep *s) {
    JSL_TRY(jsl_shape_check(shape));
    jsl_quat q = s->pose.orientation;
    bool finite = jsl_v3_is_finite(s->pose.position) && jsl_v3_is_finite(s->velocity) &&
                  jsl_v3_is_finite(s->spin) && jsl_is_finite(q.x + q.y + q.z + q.w);
    if (!finite) return JSL_ERR_NOT_FINITE;
    bool spins = s->spin.x != 0 || s->spin.y != 0 || s->spin.z != 0;
    return spins && shape->kind == JSL_SHAPE_PLANE ? JSL_ERR_ARGUMENT : JSL_OK;
}

jsl_result jsl_time_of_impact(const jsl_shape_desc *a, const jsl_sweep *sweep_a,
                              const jsl_shape_desc *b, const jsl_sweep *sweep_b, jsl_real dt,
                              jsl_real tolerance, jsl_toi_method method, jsl_toi *out) {
    JSL_TRY(check_sweep(a, sweep_a));
    JSL_TRY(check_sweep(b, sweep_b));
    if (!jsl_is_finite(dt) || !jsl_is_finite(tolerance)) return JSL_ERR_NOT_FINITE;
    if (!(dt >= 0) || !(tolerance > 0)) return JSL_ERR_ARGUMENT;
    if (a->kind == JSL_SHAPE_PLANE && b->kind == JSL_SHAPE_PLANE) return JSL_ERR_ARGUMENT;
    jsl_toi toi = {.state = JSL_TOI_FAILED};
    search s = {a, b, sweep_a, sweep_b, turning_reach(a), turning_reach(b), &toi};
    switch (method) {
    case JSL_TOI_CONSERVATIVE:
        toi.state = conservative(&s, (double)dt, (double)tolerance);
        break;
    case JSL_TOI_BISECTION:
        toi.state = bisection(&s, (double)dt, (double)tolerance);
        break;
    case JSL_TOI_LINEAR:
        toi.state = linear(&s, (double)dt, (double)tolerance);
        break;
    default:
        return JSL_ERR_ARGUMENT;
    }
    *out = toi;
    return JSL_OK;
}
