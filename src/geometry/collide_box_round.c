/* SPDX-License-Identifier: MIT
 * Contacts of a box with a sphere, a capsule and a plane.
 */
#include "geometry/collide.h"

/* A face is kept against an edge unless the edge's distance is longer by this share, see
 * collide_box.c. */
#define EDGE_SHARE JSL_R(0.05)
#define EDGE_SLACK JSL_R(0.001)

void jsl_collide_sphere_box(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_pose box = {in->p, in->qb};
    jsl_vec3 n;
    jsl_real r = in->a->radius;
    jsl_real height = jsl_shape_point_distance(in->b, box, jsl_v3(0, 0, 0), &n);
    out->normal = jsl_neg(n);
    jsl_manifold_add(in, out, jsl_scale(n, -(r + height) / 2), height - r, 0);
}

/* -- Plane
 * ---------------------------------------------------------------------------------------------------
 */

void jsl_collide_box_plane(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_axes f = jsl_axes_of(in->qa);
    const jsl_vec3 *a = f.a;
    jsl_vec3 n = jsl_axis_z(in->qb);
    const jsl_real h[3] = {in->a->half.x, in->a->half.y, in->a->half.z};
    jsl_real m[3], height = -jsl_dot(n, in->p);
    int k = 0;
    for (int i = 0; i < 3; i++) m[i] = jsl_dot(n, a[i]);
    for (int i = 1; i < 3; i++)
        if (jsl_abs(m[i]) > jsl_abs(m[k])) k = i;
    /* The four vertices of the face that looks down most. The lowest of all is among them. */
    int u = (k + 1) % 3, v = (k + 2) % 3;
    bool positive = m[k] < 0;
    jsl_real e = positive ? h[k] : -h[k];
    jsl_vec3 centre = jsl_scale(a[k], e);
    out->normal = jsl_neg(n);
    for (int i = 0; i < 4; i++) {
        jsl_real eu = i & 1 ? h[u] : -h[u], ev = i & 2 ? h[v] : -h[v];
        jsl_real separation = height + (m[k] * e + (m[u] * eu + m[v] * ev));
        jsl_vec3 x = jsl_mul_add(jsl_mul_add(centre, eu, a[u]), ev, a[v]);
        unsigned mask = (unsigned)positive << k | (unsigned)(i & 1) << u | (unsigned)(i >> 1) << v;
        jsl_manifold_add(in, out, jsl_mul_add(x, -separation / 2, n), separation,
                         JSL_FEATURE(JSL_FEATURE_VERTEX(mask), 0));
    }
}

/* -- Capsule
 * ---------------------------------------------------------------------------------------------------
 */

/* The capsule's segment c + t u, |t| <= len, in the frame of the box. */
typedef struct seg_box {
    jsl_real h[3], c[3], u[3], len;
} seg_box;

static jsl_real excess(const seg_box *g, int i, jsl_real t) {
    jsl_real x = g->c[i] + t * g->u[i];
    return x - jsl_clamp(x, -g->h[i], g->h[i]);
}
/* Half the derivative of the squared distance along the segment: piecewise linear and never
 * falling. */
static jsl_real slope(const seg_box *g, jsl_real t) {
    return g->u[0] * excess(g, 0, t) + g->u[1] * excess(g, 1, t) + g->u[2] * excess(g, 2, t);
}

/* Parameter of the point of the segment nearest to the box; the middle one when there are many. */
static jsl_real nearest_on_segment(const seg_box *g) {
    jsl_real t[8], s[8];
    int n = 0;
    t[n++] = -g->len;
    for (int i = 0; i < 3; i++) {
        for (int side = -1; side <= 1; side += 2) {
            jsl_real x = ((jsl_real)side * g->h[i] - g->c[i]) / g->u[i];
            if (!(x > -g->len && x < g->len)) continue;
            int at = n++;
            for (; t[at - 1] > x; at--) t[at] = t[at - 1];
            t[at] = x;
        }
    }
    t[n++] = g->len;
    for (int i = 0; i < n; i++) s[i] = slope(g, t[i]);
    if (s[0] > 0) return t[0];
    if (s[n - 1] < 0) return t[n - 1];
    jsl_real lo = t[0], hi = t[n - 1];
    for (int i = 0; i < n; i++) {
        if (s[i] < 0 && i + 1 < n && s[i + 1] >= 0)
            lo = t[i] + (t[i + 1] - t[i]) * (s[i] / (s[i] - s[i + 1]));
        if (s[i] <= 0 && i + 1 < n && s[i + 1] > 0) {
            hi = t[i] + (t[i + 1] - t[i]) * (s[i] / (s[i] - s[i + 1]));
            break;
        }
    }
    return lo + (hi - lo) / 2;
}

static uint32_t capsule_feature(const seg_box *g, jsl_real t) {
    return t <= -g->len ? JSL_FEATURE_END0 : t >= g->len ? JSL_FEATURE_END1 : JSL_FEATURE_SIDE;
}

/* The part of the segment over face k of the box: one or two points. False, and no points, when
 * there is none or none is as deep as `most`: what makes the axis deep may lie beyond the rim. */
static bool capsule_on_face(const jsl_pair_in *in, const seg_box *g, const jsl_axes *f, int k,
                            jsl_real most, jsl_manifold *out) {
    jsl_real sign = g->c[k] < 0 ? -1 : 1;
    jsl_real t[2] = {-g->len, g->len};
    for (int i = 0; i < 3; i++) {
        if (i == k) continue;
        if (g->u[i] == 0) {
            if (jsl_abs(g->c[i]) > g->h[i]) return false;
            continue;
        }
        jsl_real t0 = (-g->h[i] - g->c[i]) / g->u[i], t1 = (g->h[i] - g->c[i]) / g->u[i];
        t[0] = jsl_max(t[0], jsl_min(t0, t1));
        t[1] = jsl_min(t[1], jsl_max(t0, t1));
    }
    if (!(t[0] <= t[1])) return false;
    const jsl_vec3 *a = f->a;
    jsl_vec3 n = jsl_scale(a[k], sign);
    jsl_real rise = sign * g->u[k], low = rise < 0 ? g->len : -g->len;
    int first = 0, last = 1;
    /* A capsule that stands on the face, or hardly reaches over it, touches with its lower end
     * alone. */
    if (jsl_abs(rise) > JSL_STANDING || t[1] - t[0] < JSL_R(0.01) * g->len)
        first = last = rise < 0 ? 1 : 0;
    out->normal = n;
    for (int i = first; i <= last; i++) {
        jsl_real height = sign * (g->c[k] + t[i] * g->u[k]) - g->h[k];
        jsl_real r = jsl_capsule_reach(in->b->radius, rise, jsl_abs(t[i] - low));
        jsl_vec3 x =
            jsl_v3(g->c[0] + t[i] * g->u[0], g->c[1] + t[i] * g->u[1], g->c[2] + t[i] * g->u[2]);
        jsl_vec3 point = jsl_mul_add(jsl_axes_out(f, x), -(height + r) / 2, n);
        jsl_manifold_add(
            in, out, point, height - r,
            JSL_FEATURE(JSL_FEATURE_FACE(k, sign > 0), i ? JSL_FEATURE_END1 : JSL_FEATURE_END0));
    }
    bool deep = false;
    for (int i = 0; i < out->count; i++) deep |= out->separation[i] <= most;
    if (!deep) out->count = 0;
    return deep;
}

/* The segment passes through the box: the shallowest of the six axes that may separate them. */
static void capsule_inside(const jsl_pair_in *in, const seg_box *g, const jsl_axes *f, int k,
                           jsl_real face, jsl_manifold *out) {
    jsl_real best = JSL_R(-1e30), thin = jsl_min(g->h[0], jsl_min(g->h[1], g->h[2]));
    int edge = 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, l = (i + 2) % 3;
        jsl_real sq = g->u[j] * g->u[j] + g->u[l] * g->u[l];
        if (!(sq > JSL_R(1e-6))) continue;
        jsl_real reach = g->h[j] * jsl_abs(g->u[l]) + g->h[l] * jsl_abs(g->u[j]);
        jsl_real s = (jsl_abs(g->c[l] * g->u[j] - g->c[j] * g->u[l]) - reach) / jsl_sqrt(sq);
        if (s > best) best = s, edge = i;
    }
    jsl_real slack = EDGE_SHARE * jsl_abs(face) + EDGE_SLACK * thin, r = in->b->radius;
    if (best <= face + slack) {
        /* Of an edge about as good the face's points must not be shallower. */
        jsl_real most = best >= face - slack ? best - r + slack : in->margin;
        if (capsule_on_face(in, g, f, k, most, out) || best <= JSL_R(-1e30)) return;
    }

    int j = (edge + 1) % 3, l = (edge + 2) % 3;
    jsl_real n[3] = {0, 0, 0}, q[3] = {0, 0, 0};
    n[j] = -g->u[l], n[l] = g->u[j]; /* edge axis x u */
    jsl_real length = jsl_sqrt(n[j] * n[j] + n[l] * n[l]);
    if (g->c[j] * n[j] + g->c[l] * n[l] < 0) length = -length;
    n[j] /= length, n[l] /= length;
    q[j] = n[j] < 0 ? -g->h[j] : g->h[j];
    q[l] = n[l] < 0 ? -g->h[l] : g->h[l];
    /* Where the segment passes the edge: its direction in the plane across the edge is at right
     * angles to n. */
    jsl_real sq = g->u[j] * g->u[j] + g->u[l] * g->u[l];
    jsl_real t = ((q[j] - g->c[j]) * g->u[j] + (q[l] - g->c[l]) * g->u[l]) / sq;
    t = jsl_clamp(t, -g->len, g->len);
    jsl_vec3 x = {g->c[0] + t * g->u[0], g->c[1] + t * g->u[1], g->c[2] + t * g->u[2]};
    unsigned mask = (unsigned)(q[j] > 0) << j | (unsigned)(q[l] > 0) << l;
    jsl_vec3 normal = jsl_axes_out(f, jsl_v3(n[0], n[1], n[2]));
    out->normal = normal;
    jsl_manifold_add(in, out, jsl_mul_add(jsl_axes_out(f, x), -(best + r) / 2, normal), best - r,
                     JSL_FEATURE(JSL_FEATURE_EDGE(edge, mask), capsule_feature(g, t)));
}

void jsl_collide_box_capsule(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_axes f = jsl_axes_of(in->qa);
    jsl_vec3 c = jsl_axes_in(&f, in->p), u = jsl_axes_in(&f, jsl_axis_z(in->qb)), h = in->a->half;
    seg_box g = {{h.x, h.y, h.z}, {c.x, c.y, c.z}, {u.x, u.y, u.z}, in->b->half.z};
    jsl_real r = in->b->radius, face = JSL_R(-1e30);
    int k = 0;
    for (int i = 0; i < 3; i++) {
        jsl_real s = jsl_abs(g.c[i]) - (g.h[i] + g.len * jsl_abs(g.u[i]));
        if (s > face) face = s, k = i;
    }
    if (!(face - r <= in->margin)) return;
    jsl_real t = nearest_on_segment(&g);
    jsl_vec3 e = {excess(&g, 0, t), excess(&g, 1, t), excess(&g, 2, t)}, n;
    jsl_real distance = jsl_direction(e, jsl_v3(0, 0, 0), &n);
    /* Below the rounding of the coordinates a distance is none. */
    jsl_real noise = 8 * JSL_REAL_EPSILON * (g.h[0] + g.h[1] + g.h[2] + g.len);
    if (!(distance > noise)) {
        capsule_inside(in, &g, &f, k, face, out);
        return;
    }
    if (!(distance - r <= in->margin)) return;
    /* Nearly straight over a face: a flat contact of two points there rather than one on its rim.
     */
    jsl_real slack = JSL_R(0.002) * jsl_min(r, distance);
    if (face >= distance - slack && capsule_on_face(in, &g, &f, k, distance - r + slack, out))
        return;
    jsl_vec3 x = {g.c[0] + t * g.u[0], g.c[1] + t * g.u[1], g.c[2] + t * g.u[2]};
    out->normal = jsl_axes_out(&f, n);
    jsl_manifold_add(in, out, jsl_mul_add(jsl_axes_out(&f, x), -(distance + r) / 2, out->normal),
                     distance - r, JSL_FEATURE(0, capsule_feature(&g, t)));
}
