/* SPDX-License-Identifier: MIT
 * Contact of two boxes: separating axes (Gottschalk, Lin, Manocha 1996, "OBBTree"), then either the
 * incident face clipped by the sides of the reference face, or the point where two edges cross.
 *
 * Inside this file everything is in the frame of one of the boxes, lengths in arrays by axis.
 */
#include "geometry/collide.h"

/* Faces make better contacts than edges, and one face for long a better one than two in turns:
 * another axis must be better by a share of the depth and of the thinnest half extent. */
#define FACE_SHARE JSL_R(0.02)
#define FACE_SLACK JSL_R(0.0005)
#define EDGE_SHARE JSL_R(0.05)
#define EDGE_SLACK JSL_R(0.001)
/* A vertex this share of a half extent outside a side plane is not clipped, so that equal boxes in
 * a stack keep their feature ids. */
#define CLIP_SLACK JSL_R(0.0005)
/* Edges whose directions differ by less than this sine make no axis: rounding turns it too far. */
#ifdef JSL_DOUBLE
#define PARALLEL_SQ 1e-12
#else
#define PARALLEL_SQ 1e-6f
#endif

typedef struct boxes {
    jsl_real r[3][3]; /* r[i][j] = axis i of A . axis j of B */
    jsl_real pa[3];   /* origin of B from the origin of A, in A's frame */
    jsl_real pb[3];   /* the same vector in B's frame */
    jsl_real ha[3], hb[3];
} boxes;

/* The best axis of each family. */
typedef struct axes {
    jsl_real face_a, face_b, edge; /* separations */
    int axis_a, axis_b, edge_a, edge_b;
} axes;

static const int next_axis[3] = {1, 2, 0}, last_axis[3] = {2, 0, 1};

static void set_up(const jsl_pair_in *in, const jsl_axes *fa, const jsl_axes *fb, boxes *g) {
    const jsl_vec3 *a = fa->a, *b = fb->a;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) g->r[i][j] = jsl_dot(a[i], b[j]);
        g->pa[i] = jsl_dot(a[i], in->p);
        g->pb[i] = jsl_dot(b[i], in->p);
    }
    g->ha[0] = in->a->half.x, g->ha[1] = in->a->half.y, g->ha[2] = in->a->half.z;
    g->hb[0] = in->b->half.x, g->hb[1] = in->b->half.y, g->hb[2] = in->b->half.z;
}

/* False as soon as one face separates by more than the margin. */
static bool find_faces(const boxes *g, jsl_real margin, axes *best) {
    best->face_a = best->face_b = JSL_R(-1e30);
    best->axis_a = best->axis_b = 0;
    for (int i = 0; i < 3; i++) {
        jsl_real reach = g->hb[0] * jsl_abs(g->r[i][0]) + g->hb[1] * jsl_abs(g->r[i][1]) +
                         g->hb[2] * jsl_abs(g->r[i][2]);
        jsl_real s = jsl_abs(g->pa[i]) - (g->ha[i] + reach);
        if (s > margin) return false;
        if (s > best->face_a) best->face_a = s, best->axis_a = i;
    }
    for (int j = 0; j < 3; j++) {
        jsl_real reach = g->ha[0] * jsl_abs(g->r[0][j]) + g->ha[1] * jsl_abs(g->r[1][j]) +
                         g->ha[2] * jsl_abs(g->r[2][j]);
        jsl_real s = jsl_abs(g->pb[j]) - (g->hb[j] + reach);
        if (s > margin) return false;
        if (s > best->face_b) best->face_b = s, best->axis_b = j;
    }
    return true;
}

/* The best pair of edges among those whose separation is above `least`; false as soon as one
 * separates by more than the margin. */
static bool find_edges(const boxes *g, jsl_real margin, jsl_real least, axes *best) {
    best->edge = JSL_R(-1e30);
    best->edge_a = best->edge_b = 0;
    for (int i = 0; i < 3; i++) {
        int i1 = next_axis[i], i2 = last_axis[i];
        for (int j = 0; j < 3; j++) {
            int j1 = next_axis[j], j2 = last_axis[j];
            jsl_real r1 = g->r[i1][j], r2 = g->r[i2][j];
            jsl_real reach_a = g->ha[i1] * jsl_abs(r2) + g->ha[i2] * jsl_abs(r1);
            jsl_real reach_b = g->hb[j1] * jsl_abs(g->r[i][j2]) + g->hb[j2] * jsl_abs(g->r[i][j1]);
            jsl_real along = jsl_abs(g->pa[i2] * r1 - g->pa[i1] * r2);
            /* The axis has the length of the sine: compare squares before taking a root. */
            jsl_real sq = r1 * r1 + r2 * r2, s = along - (reach_a + reach_b);
            bool below = least < 0 ? s < 0 && s * s >= least * least * sq
                                   : s < 0 || s * s <= least * least * sq;
            if (below || !(sq > PARALLEL_SQ)) continue;
            s /= jsl_sqrt(sq);
            if (s > margin) return false;
            if (s > least) least = best->edge = s, best->edge_a = i, best->edge_b = j;
        }
    }
    return true;
}

/* -- Two edges
 * ------------------------------------------------------------------------------------------- */

/* False when the boxes are apart and these edges end before they pass. */
static bool edge_contact(const jsl_pair_in *in, const boxes *g, const axes *best,
                         const jsl_axes *fa, const jsl_axes *fb, jsl_manifold *out) {
    int i = best->edge_a, j = best->edge_b;
    const jsl_vec3 *a = fa->a, *b = fb->a;
    jsl_vec3 n;
    jsl_direction(jsl_cross(a[i], b[j]), a[0], &n);
    if (jsl_dot(n, in->p) < 0) n = jsl_neg(n);
    /* The edge of each box that lies farthest towards the other, and its middle. */
    jsl_vec3 ca = {0, 0, 0}, cb = in->p;
    unsigned mask_a = 0, mask_b = 0;
    for (int k = 0; k < 3; k++) {
        if (k != i) {
            bool positive = jsl_dot(n, a[k]) > 0;
            ca = jsl_mul_add(ca, positive ? g->ha[k] : -g->ha[k], a[k]);
            mask_a |= (unsigned)positive << k;
        }
        if (k != j) {
            bool positive = jsl_dot(n, b[k]) < 0;
            cb = jsl_mul_add(cb, positive ? g->hb[k] : -g->hb[k], b[k]);
            mask_b |= (unsigned)positive << k;
        }
    }
    /* Nearest points of the two lines, kept on the edges. */
    jsl_vec3 d = jsl_sub(cb, ca);
    jsl_real da = jsl_dot(d, a[i]), db = jsl_dot(d, b[j]), c = g->r[i][j];
    jsl_real sine_sq = jsl_length_sq(jsl_cross(a[i], b[j]));
    jsl_real s0 = (da - db * c) / sine_sq, s = jsl_clamp(s0, -g->ha[i], g->ha[i]);
    jsl_real t0 = (da * c - db) / sine_sq, t = jsl_clamp(t0, -g->hb[j], g->hb[j]);
    if (best->edge > 0 && (s != s0 || t != t0)) return false;
    jsl_vec3 qa = jsl_mul_add(ca, s, a[i]), qb = jsl_mul_add(cb, t, b[j]);
    out->normal = n;
    jsl_manifold_add(in, out, jsl_scale(jsl_add(qa, qb), JSL_R(0.5)), best->edge,
                     JSL_FEATURE(JSL_FEATURE_EDGE(i, mask_a), JSL_FEATURE_EDGE(j, mask_b)));
    return true;
}

/* -- A face and what lies on it
 * -------------------------------------------------------------------------------- */

/* The reference box, and the other (incident) one in its frame. */
typedef struct face_pair {
    jsl_real h[3], hi[3]; /* half extents */
    jsl_real r[3][3];     /* r[k][m] = reference axis k . incident axis m */
    jsl_real c[3];        /* centre of the incident box */
    int k, u, v;          /* axis of the reference face, and its sides */
    jsl_real sign;        /* which of the two faces */
} face_pair;

typedef struct corner {
    jsl_real u, v, w;  /* w: height over the reference face */
    uint16_t ref, inc; /* features that meet here */
    uint16_t edge;     /* edge to the next corner: of the incident box, or a side (0..3) of the
                          reference face */
} corner;

enum { MAX_CORNERS = 8, SIDE_EDGE = 4 };

/* Axis and sense of side 0..3 of the reference face. */
static int side_axis(const face_pair *f, int side) { return side < 2 ? f->u : f->v; }
static unsigned side_bit(const face_pair *f, int side) {
    return (unsigned)(side & 1) << side_axis(f, side);
}

static int incident_face(const face_pair *f, int m, bool positive, corner *out) {
    int m1 = next_axis[m], m2 = last_axis[m];
    static const int sign1[4] = {-1, 1, 1, -1}, sign2[4] = {-1, -1, 1, 1};
    for (int i = 0; i < 4; i++) {
        jsl_real e0 = positive ? f->hi[m] : -f->hi[m];
        jsl_real e1 = (jsl_real)sign1[i] * f->hi[m1], e2 = (jsl_real)sign2[i] * f->hi[m2];
        jsl_real at[3];
        for (int k = 0; k < 3; k++)
            at[k] = f->c[k] + (f->r[k][m] * e0 + (f->r[k][m1] * e1 + f->r[k][m2] * e2));
        unsigned mask = (unsigned)positive << m | (unsigned)(sign1[i] > 0) << m1 |
                        (unsigned)(sign2[i] > 0) << m2;
        /* Corners 0-1 and 2-3 run along m1, 1-2 and 3-0 along m2. */
        unsigned edge = JSL_FEATURE_EDGE(i & 1 ? m2 : m1, mask);
        out[i] = (corner){at[f->u],
                          at[f->v],
                          f->sign * at[f->k] - f->h[f->k],
                          (uint16_t)JSL_FEATURE_FACE(f->k, f->sign > 0),
                          (uint16_t)JSL_FEATURE_VERTEX(mask),
                          (uint16_t)edge};
    }
    return 4;
}

/* Where the polygon's edge from a to b crosses a side plane. */
static corner crossing(const face_pair *f, int side, unsigned inc_face, const corner *a,
                       const corner *b, jsl_real da, jsl_real db) {
    jsl_real t = da / (da - db);
    corner c = {a->u + t * (b->u - a->u),
                a->v + t * (b->v - a->v),
                a->w + t * (b->w - a->w),
                0,
                0,
                a->edge};
    unsigned mask = (unsigned)(f->sign > 0) << f->k | side_bit(f, side);
    if (a->edge < SIDE_EDGE) {
        c.ref = (uint16_t)JSL_FEATURE_VERTEX(mask | side_bit(f, a->edge));
        c.inc = (uint16_t)inc_face;
    } else {
        c.ref = (uint16_t)JSL_FEATURE_EDGE(side < 2 ? f->v : f->u, mask);
        c.inc = a->edge;
    }
    return c;
}

/* Whether a side plane cuts anything off. */
static bool any_outside(const face_pair *f, int side, const corner *at, int count) {
    jsl_real limit = f->h[side_axis(f, side)], most = -limit, sense = side & 1 ? 1 : -1;
    for (int i = 0; i < count; i++) most = jsl_max(most, sense * (side < 2 ? at[i].u : at[i].v));
    return most - limit > CLIP_SLACK * limit;
}

/* Sutherland and Hodgman 1974, one side plane. */
static int clip(const face_pair *f, int side, unsigned inc_face, const corner *in, int count,
                corner *out) {
    jsl_real limit = f->h[side_axis(f, side)], slack = CLIP_SLACK * limit;
    jsl_real sense = side & 1 ? 1 : -1;
    int n = 0;
    for (int i = 0; i < count; i++) {
        const corner *a = &in[i], *b = &in[i + 1 < count ? i + 1 : 0];
        jsl_real da = sense * (side < 2 ? a->u : a->v) - limit;
        jsl_real db = sense * (side < 2 ? b->u : b->v) - limit;
        if (da <= slack) {
            if (n == MAX_CORNERS) break;
            out[n++] = *a;
            if (db <= slack) continue;
            if (da < 0 && n < MAX_CORNERS) out[n++] = crossing(f, side, inc_face, a, b, da, db);
            out[n - 1].edge = (uint16_t)side;
        } else if (db < 0) {
            if (n == MAX_CORNERS) break;
            out[n++] = crossing(f, side, inc_face, a, b, da, db);
        }
    }
    return n;
}

/* Four of many: the deepest, the one farthest from it, and the one farthest to each side of that
 * line. */
static int reduce(corner *p, int count) {
    if (count <= JSL_MAX_MANIFOLD) return count;
    int pick[4] = {0, -1, -1, -1};
    for (int i = 1; i < count; i++)
        if (p[i].w < p[pick[0]].w) pick[0] = i;
    const corner *o = &p[pick[0]];
    jsl_real best = 0, left = 0, right = 0;
    for (int i = 0; i < count; i++) {
        jsl_real du = p[i].u - o->u, dv = p[i].v - o->v, sq = du * du + dv * dv;
        if (sq > best) best = sq, pick[1] = i;
    }
    if (pick[1] < 0) return 1;
    jsl_real lu = p[pick[1]].u - o->u, lv = p[pick[1]].v - o->v;
    for (int i = 0; i < count; i++) {
        jsl_real area = lu * (p[i].v - o->v) - lv * (p[i].u - o->u);
        if (area > left) left = area, pick[2] = i;
        if (area < right) right = area, pick[3] = i;
    }
    int n = 0;
    for (int i = 0; i < count; i++) /* in the polygon's order */
        if (i == pick[0] || i == pick[1] || i == pick[2] || i == pick[3]) p[n++] = p[i];
    return n;
}

/* The corners of the clipped face that are within the margin, at most 4. */
static int clip_face(const face_pair *f, int m, jsl_real margin, corner *out) {
    corner buffer[MAX_CORNERS];
    bool positive = f->sign * f->r[f->k][m] < 0;
    unsigned inc_face = JSL_FEATURE_FACE(m, positive);
    int count = incident_face(f, m, positive, out);
    corner *from = out, *to = buffer;
    for (int side = 0; side < 4 && count > 0; side++) {
        if (!any_outside(f, side, from, count)) continue;
        count = clip(f, side, inc_face, from, count, to);
        corner *swap = from;
        from = to, to = swap;
    }
    int n = 0;
    for (int i = 0; i < count; i++)
        if (from[i].w <= margin) out[n++] = from[i];
    return reduce(out, n);
}

/* The faces of the incident box that look at the reference face, the most opposite first. */
static void facing_order(const face_pair *f, int order[3]) {
    order[0] = 0, order[1] = 1, order[2] = 2;
    for (int i = 1; i < 3; i++)
        for (int j = i; j > 0; j--) {
            if (!(jsl_abs(f->r[f->k][order[j]]) > jsl_abs(f->r[f->k][order[j - 1]]))) break;
            int swap = order[j];
            order[j] = order[j - 1], order[j - 1] = swap;
        }
}

static void face_contact(const jsl_pair_in *in, const boxes *g, int axis, bool b_is_reference,
                         const jsl_axes *fa, const jsl_axes *fb, jsl_manifold *out) {
    face_pair f = {.k = axis, .u = next_axis[axis], .v = last_axis[axis]};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) f.r[i][j] = b_is_reference ? g->r[j][i] : g->r[i][j];
        f.h[i] = b_is_reference ? g->hb[i] : g->ha[i];
        f.hi[i] = b_is_reference ? g->ha[i] : g->hb[i];
        f.c[i] = b_is_reference ? -g->pb[i] : g->pa[i];
    }
    f.sign = f.c[axis] < 0 ? -1 : 1;
    /* One of the three faces that look this way covers any overlap, so that boxes in contact never
     * get an empty manifold. */
    int order[3], count = 0;
    corner at[MAX_CORNERS];
    facing_order(&f, order);
    for (int i = 0; i < 3 && count == 0; i++) count = clip_face(&f, order[i], in->margin, at);

    const jsl_axes *frame = b_is_reference ? fb : fa;
    const jsl_vec3 *dir = frame->a;
    jsl_vec3 origin = b_is_reference ? in->p : jsl_v3(0, 0, 0);
    out->normal = jsl_scale(dir[axis], b_is_reference ? -f.sign : f.sign);
    for (int i = 0; i < count; i++) {
        /* Midway between the corner and its foot on the reference face. */
        jsl_real height = f.sign * (f.h[axis] + at[i].w / 2);
        jsl_vec3 x = jsl_add(jsl_scale(dir[axis], height),
                             jsl_add(jsl_scale(dir[f.u], at[i].u), jsl_scale(dir[f.v], at[i].v)));
        uint32_t feature =
            b_is_reference ? JSL_FEATURE(at[i].inc, at[i].ref) : JSL_FEATURE(at[i].ref, at[i].inc);
        jsl_manifold_add(in, out, jsl_add(origin, x), at[i].w, feature);
    }
}

/* Boxes near each other corner to corner, where no face or pair of edges lies over another: their
 * nearest points. */
static void near_contact(const jsl_pair_in *in, jsl_manifold *out) {
    jsl_gap gap;
    if (!jsl_gjk(in, &gap)) return;
    out->normal = gap.normal;
    jsl_manifold_add(in, out, jsl_scale(jsl_add(gap.point_a, gap.point_b), JSL_R(0.5)),
                     gap.distance, 0);
}

void jsl_collide_box_box(const jsl_pair_in *in, jsl_manifold *out) {
    boxes g;
    axes best;
    jsl_axes fa = jsl_axes_of(in->qa), fb = jsl_axes_of(in->qb);
    set_up(in, &fa, &fb, &g);
    if (!find_faces(&g, in->margin, &best)) return;
    jsl_real thin = g.ha[0];
    for (int i = 0; i < 3; i++) thin = jsl_min(thin, jsl_min(g.ha[i], g.hb[i]));
    jsl_real slack = FACE_SHARE * jsl_abs(best.face_a) + FACE_SLACK * thin;
    bool b_is_reference = best.face_b > best.face_a + slack;
    jsl_real face = b_is_reference ? best.face_b : best.face_a;
    jsl_real least = face + (EDGE_SHARE * jsl_abs(face) + EDGE_SLACK * thin);
    if (!find_edges(&g, in->margin, least, &best)) return;
    if (best.edge > least) {
        if (edge_contact(in, &g, &best, &fa, &fb, out)) return;
    } else {
        int axis = b_is_reference ? best.axis_b : best.axis_a;
        face_contact(in, &g, axis, b_is_reference, &fa, &fb, out);
    }
    if (out->count == 0) near_contact(in, out);
}
