/* SPDX-License-Identifier: MIT
 * Contacts among spheres, capsules and planes, in closed form.
 */
#include "geometry/collide.h"

/* Contact of two balls whose centres, relative to A, are ca and ca + d. */
static void ball_ball(const jsl_pair_in *in, jsl_vec3 ca, jsl_vec3 d, jsl_real ra, jsl_real rb,
                      jsl_vec3 otherwise, uint32_t feature, jsl_manifold *out) {
    jsl_real limit = ra + rb + in->margin;
    if (limit < 0 || jsl_length_sq(d) > limit * limit) return;
    jsl_real separation = jsl_direction(d, otherwise, &out->normal) - (ra + rb);
    jsl_vec3 point = jsl_mul_add(ca, ra + separation / 2, out->normal);
    jsl_manifold_add(in, out, point, separation, feature);
}

void jsl_collide_sphere_sphere(const jsl_pair_in *in, jsl_manifold *out) {
    ball_ball(in, jsl_v3(0, 0, 0), in->p, in->a->radius, in->b->radius, jsl_v3(0, 0, 1), 0, out);
}

void jsl_collide_sphere_capsule(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_vec3 u = jsl_axis_z(in->qb);
    jsl_real t = jsl_clamp(-jsl_dot(u, in->p), -in->b->half.z, in->b->half.z);
    ball_ball(in, jsl_v3(0, 0, 0), jsl_mul_add(in->p, t, u), in->a->radius, in->b->radius,
              jsl_perpendicular(u), 0, out);
}

void jsl_collide_sphere_plane(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_vec3 n = jsl_axis_z(in->qb);
    jsl_real height = -jsl_dot(n, in->p), r = in->a->radius;
    out->normal = jsl_neg(n);
    jsl_manifold_add(in, out, jsl_scale(n, -(r + height) / 2), height - r, 0);
}

void jsl_collide_capsule_plane(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_vec3 n = jsl_axis_z(in->qb), u = jsl_axis_z(in->qa);
    jsl_real rise = jsl_dot(n, u), half = in->a->half.z;
    out->normal = jsl_neg(n);
    for (int end = 0; end < 2; end++) {
        bool lower = (rise < 0) == (end == 1);
        /* A capsule that stands touches with its lower end alone. */
        if (!lower && jsl_abs(rise) > JSL_STANDING) continue;
        jsl_vec3 c = jsl_scale(u, end ? half : -half);
        jsl_real height = jsl_dot(n, jsl_sub(c, in->p));
        jsl_real r = jsl_capsule_reach(in->a->radius, rise, lower ? 0 : 2 * half);
        jsl_manifold_add(in, out, jsl_mul_add(c, -(r + height) / 2, n), height - r,
                         JSL_FEATURE(JSL_FEATURE_END0 + end, 0));
    }
}

/* -- Two capsules
 * -------------------------------------------------------------------------------------- */

/* Segments s u, |s| <= ha, and p + t v, |t| <= hb, with unit u and v. */
typedef struct segments {
    jsl_vec3 p, u, v;
    jsl_real ha, hb;
    jsl_real cosine, sine_sq; /* between u and v */
    jsl_real up, vp;          /* u.p, v.p */
} segments;

static jsl_vec3 gap(const segments *g, jsl_real s, jsl_real t) {
    return jsl_mul_add(jsl_mul_add(g->p, t, g->v), -s, g->u);
}

/* Keeps (s, t) when it is nearer than what *best holds. */
static void try_pair(const segments *g, jsl_real s, jsl_real t, jsl_real *best, jsl_real *bs,
                     jsl_real *bt) {
    jsl_real sq = jsl_length_sq(gap(g, s, t));
    if (!(sq < *best)) return;
    *best = sq, *bs = s, *bt = t;
}

/* Parameters of the nearest points. A clamped walk from the crossing of the lines is exact unless
 * they are nearly parallel, where the crossing drowns in rounding (Eberly 2015, "Robust computation
 * of distance between line segments"); then the four ends are tried as well. */
static void nearest(const segments *g, jsl_real *s, jsl_real *t) {
    bool skew = g->sine_sq > JSL_R(1e-12) && g->sine_sq > 4 * JSL_REAL_EPSILON;
    *s = skew ? jsl_clamp((g->up - g->cosine * g->vp) / g->sine_sq, -g->ha, g->ha) : 0;
    *t = jsl_clamp(*s * g->cosine - g->vp, -g->hb, g->hb);
    *s = jsl_clamp(g->up + *t * g->cosine, -g->ha, g->ha);
    if (g->sine_sq > JSL_R(1e-3)) return;
    jsl_real best = jsl_length_sq(gap(g, *s, *t));
    for (int end = -1; end <= 1; end += 2) {
        jsl_real sa = (jsl_real)end * g->ha, tb = (jsl_real)end * g->hb;
        try_pair(g, sa, jsl_clamp(sa * g->cosine - g->vp, -g->hb, g->hb), &best, s, t);
        try_pair(g, jsl_clamp(g->up + tb * g->cosine, -g->ha, g->ha), tb, &best, s, t);
    }
}

/* Capsules side by side touch along a line: its two ends, when the axes run so close to parallel
 * that both lie on both surfaces. */
static bool side_by_side(const jsl_pair_in *in, const segments *g, jsl_manifold *out) {
    jsl_real ra = in->a->radius, rb = in->b->radius;
    jsl_real b0 = g->up - g->hb * jsl_abs(g->cosine), b1 = g->up + g->hb * jsl_abs(g->cosine);
    jsl_real lo = jsl_max(b0, -g->ha), hi = jsl_min(b1, g->ha);
    if (!(hi - lo > JSL_R(0.01) * jsl_min(g->ha, g->hb))) return false;
    /* Sideways drift of one axis over the other: 0.1 r bends the surface away by 0.005 r. */
    jsl_real drift = JSL_R(0.1) * jsl_min(ra, rb);
    if (g->sine_sq > JSL_R(0.0025) || g->sine_sq * (hi - lo) * (hi - lo) > drift * drift)
        return false;
    for (int end = 0; end < 2; end++) {
        jsl_real s = end ? hi : lo;
        jsl_real t = jsl_clamp(s * g->cosine - g->vp, -g->hb, g->hb);
        jsl_real separation = jsl_dot(gap(g, s, t), out->normal) - (ra + rb);
        jsl_vec3 point = jsl_mul_add(jsl_scale(g->u, s), ra + separation / 2, out->normal);
        bool forward = (g->cosine > 0) == (end == 1);
        jsl_manifold_add(in, out, point, separation,
                         JSL_FEATURE(JSL_FEATURE_END0 + end, JSL_FEATURE_END0 + forward));
    }
    return out->count > 0;
}

void jsl_collide_capsule_capsule(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_real ra = in->a->radius, rb = in->b->radius;
    segments g = {.p = in->p,
                  .u = jsl_axis_z(in->qa),
                  .v = jsl_axis_z(in->qb),
                  .ha = in->a->half.z,
                  .hb = in->b->half.z};
    jsl_vec3 across = jsl_cross(g.u, g.v);
    g.cosine = jsl_dot(g.u, g.v);
    g.sine_sq = jsl_length_sq(across);
    g.up = jsl_dot(g.u, g.p);
    g.vp = jsl_dot(g.v, g.p);
    jsl_real s, t;
    nearest(&g, &s, &t);
    jsl_vec3 d = gap(&g, s, t), n;
    /* Axes that cross: the shortest way out is at right angles to both. */
    if (g.sine_sq > JSL_R(1e-6))
        n = jsl_scale(across, (jsl_dot(across, in->p) < 0 ? -1 : 1) / jsl_sqrt(g.sine_sq));
    else
        n = jsl_perpendicular(g.u);
    jsl_real distance = jsl_direction(d, n, &out->normal);
    if (!(distance - (ra + rb) <= in->margin)) return;
    if (side_by_side(in, &g, out)) return;
    jsl_vec3 point = jsl_mul_add(jsl_scale(g.u, s), ra + (distance - (ra + rb)) / 2, out->normal);
    jsl_manifold_add(in, out, point, distance - (ra + rb),
                     JSL_FEATURE(JSL_FEATURE_SIDE, JSL_FEATURE_SIDE));
}
