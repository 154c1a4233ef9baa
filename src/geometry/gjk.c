/* SPDX-License-Identifier: MIT
 * Distance of two convex shapes by Gilbert, Johnson and Keerthi 1988, with the points that are
 * nearest.
 *
 * In double whatever the scalar: the algorithm ends when no support point is nearer than rounding
 * allows, and in float that comes many digits early. Shapes are cores (point, segment, box) with a
 * radius around them; the search is over the cores, so that only crossing cores have no distance.
 */
#include "geometry/collide.h"

typedef struct dvec {
    double x, y, z;
} dvec;

static dvec dv(jsl_vec3 a) { return (dvec){(double)a.x, (double)a.y, (double)a.z}; }
static dvec dadd(dvec a, dvec b) { return (dvec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static dvec dsub(dvec a, dvec b) { return (dvec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static dvec dmul(dvec a, double s) { return (dvec){a.x * s, a.y * s, a.z * s}; }
static double ddot(dvec a, dvec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static dvec dcross(dvec a, dvec b) {
    return (dvec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static jsl_vec3 to_real(dvec a) { return jsl_v3((jsl_real)a.x, (jsl_real)a.y, (jsl_real)a.z); }

/* centre + sum of |s_i| <= 1 times half[i]: a point, a segment or a box by the number of axes. */
typedef struct core {
    dvec centre, half[3];
    int axes;
} core;

static core core_of(const jsl_shape_desc *shape, jsl_quat q, dvec centre) {
    core c = {.centre = centre};
    jsl_axes f = jsl_axes_of(q);
    if (shape->kind == JSL_SHAPE_CAPSULE) {
        c.axes = 1;
        c.half[0] = dmul(dv(f.a[2]), (double)shape->half.z);
    } else if (shape->kind == JSL_SHAPE_BOX) {
        c.axes = 3;
        c.half[0] = dmul(dv(f.a[0]), (double)shape->half.x);
        c.half[1] = dmul(dv(f.a[1]), (double)shape->half.y);
        c.half[2] = dmul(dv(f.a[2]), (double)shape->half.z);
    }
    return c;
}

static dvec support(const core *c, dvec d) {
    dvec p = c->centre;
    for (int i = 0; i < c->axes; i++)
        p = ddot(d, c->half[i]) < 0 ? dsub(p, c->half[i]) : dadd(p, c->half[i]);
    return p;
}

typedef struct simplex {
    dvec a[4], b[4], w[4]; /* w = b - a */
    double weight[4];
    int count;
} simplex;

/* Weights of the point of the affine hull of the chosen corners (bits of mask) nearest to the
 * origin; false unless it lies inside them. Solves the Gram system by Cramer's rule, relative to
 * the last corner. */
static bool weigh(const simplex *s, unsigned mask, double weight[4]) {
    int at[4], n = 0;
    for (int i = 0; i < s->count; i++)
        if (mask >> i & 1) at[n++] = i;
    for (int i = 0; i < 4; i++) weight[i] = 0;
    dvec o = s->w[at[n - 1]], e[3];
    double g[3][3], r[3], x[3] = {0, 0, 0};
    for (int i = 0; i < n - 1; i++) e[i] = dsub(s->w[at[i]], o), r[i] = -ddot(e[i], o);
    for (int i = 0; i < n - 1; i++)
        for (int j = 0; j < n - 1; j++) g[i][j] = ddot(e[i], e[j]);
    if (n == 2) {
        if (!(g[0][0] > 0)) return false;
        x[0] = r[0] / g[0][0];
    } else if (n == 3) {
        /* By cross products: the Gram determinant would square the condition of a sliver. */
        dvec c = dcross(e[0], e[1]), p = dmul(o, -1);
        double det = ddot(c, c);
        if (!(det > 1e-28 * g[0][0] * g[1][1])) return false;
        x[0] = ddot(dcross(p, e[1]), c) / det;
        x[1] = ddot(dcross(e[0], p), c) / det;
    } else if (n == 4) {
        /* Three edges span space: o itself is solved for. */
        dvec c12 = dcross(e[1], e[2]), c20 = dcross(e[2], e[0]), c01 = dcross(e[0], e[1]);
        double det = ddot(e[0], c12);
        if (!(det * det > 1e-28 * g[0][0] * g[1][1] * g[2][2])) return false;
        x[0] = -ddot(o, c12) / det;
        x[1] = -ddot(o, c20) / det;
        x[2] = -ddot(o, c01) / det;
    }
    double last = 1;
    for (int i = 0; i < n - 1; i++) {
        if (!(x[i] >= 0)) return false;
        weight[at[i]] = x[i];
        last -= x[i];
    }
    weight[at[n - 1]] = last;
    return last >= 0;
}

static dvec blend(const simplex *s, const dvec *p) {
    dvec sum = {0, 0, 0};
    for (int i = 0; i < s->count; i++) sum = dadd(sum, dmul(p[i], s->weight[i]));
    return sum;
}

/* Keeps the smallest sub-simplex that holds the point nearest to the origin, which is returned.
 * Tries them all: at most 15, and none of the case analysis that goes wrong on slivers. */
static dvec shrink(simplex *s) {
    double best = 1e300, weight[4];
    dvec nearest = {0, 0, 0};
    simplex old = *s;
    unsigned keep = 0;
    for (unsigned mask = 1; mask < 1u << old.count; mask++) {
        if (!weigh(&old, mask, weight)) continue;
        dvec v = {0, 0, 0};
        for (int i = 0; i < old.count; i++) v = dadd(v, dmul(old.w[i], weight[i]));
        if (!(ddot(v, v) < best)) continue;
        best = ddot(v, v);
        nearest = v;
        keep = mask;
        memcpy(s->weight, weight, sizeof weight);
    }
    s->count = 0;
    for (int i = 0; i < old.count; i++) {
        if (!(keep >> i & 1)) continue;
        double w = s->weight[i];
        s->a[s->count] = old.a[i], s->b[s->count] = old.b[i], s->w[s->count] = old.w[i];
        s->weight[s->count++] = w;
    }
    return nearest;
}

enum { MOST_STEPS = 64 };

/* Nearest points of the cores; false when they cross or touch. */
static bool core_distance(const core *a, const core *b, dvec *qa, dvec *qb) {
    simplex s = {.count = 0};
    dvec v = dsub(b->centre, a->centre);
    double size = sqrt(ddot(v, v));
    for (int i = 0; i < 3; i++)
        size += sqrt(ddot(a->half[i], a->half[i])) + sqrt(ddot(b->half[i], b->half[i]));
    const double touch = 1e-14 * size;
    if (!(ddot(v, v) > touch * touch)) v = (dvec){1, 0, 0};
    double vv = 1e300;
    for (int step = 0; step < MOST_STEPS; step++) {
        dvec pa = support(a, v), pb = support(b, dmul(v, -1)), w = dsub(pb, pa);
        /* No support point is nearer by more than rounding: done. */
        if (s.count > 0 && vv - ddot(v, w) <= 1e-13 * vv) break;
        bool known = false;
        for (int i = 0; i < s.count; i++)
            known |= s.w[i].x == w.x && s.w[i].y == w.y && s.w[i].z == w.z;
        if (known) break;
        simplex before = s;
        s.a[s.count] = pa, s.b[s.count] = pb, s.w[s.count] = w;
        s.count++;
        dvec next = shrink(&s);
        double next_sq = ddot(next, next);
        if (s.count == 4 || next_sq <= touch * touch) return false;
        if (next_sq >= vv) { /* rounding has the last word */
            s = before;
            break;
        }
        v = next, vv = next_sq;
    }
    *qa = blend(&s, s.a);
    *qb = blend(&s, s.b);
    return true;
}

static double radius_of(const jsl_shape_desc *s) {
    return s->kind == JSL_SHAPE_SPHERE || s->kind == JSL_SHAPE_CAPSULE ? (double)s->radius : 0;
}

bool jsl_gjk(const jsl_pair_in *in, jsl_gap *out) {
    core a = core_of(in->a, in->qa, (dvec){0, 0, 0}), b = core_of(in->b, in->qb, dv(in->p));
    dvec qa, qb;
    if (!core_distance(&a, &b, &qa, &qb)) return false;
    dvec d = dsub(qb, qa);
    double length = sqrt(ddot(d, d)), ra = radius_of(in->a), rb = radius_of(in->b);
    dvec n = dmul(d, 1 / length);
    out->distance = (jsl_real)(length - ra - rb);
    out->normal = to_real(n);
    out->point_a = to_real(dadd(qa, dmul(n, ra)));
    out->point_b = to_real(dsub(qb, dmul(n, rb)));
    return true;
}

/* -- The public question
 * --------------------------------------------------------------------------------------- */

/* From shape a to plane b. */
static jsl_gap plane_gap(const jsl_pair_in *in) {
    core a = core_of(in->a, in->qa, (dvec){0, 0, 0});
    jsl_vec3 n = jsl_axis_z(in->qb);
    dvec down = dmul(dv(n), -1), low = dadd(support(&a, down), dmul(down, radius_of(in->a)));
    double height = ddot(dsub(low, dv(in->p)), dv(n));
    return (jsl_gap){(jsl_real)height, jsl_neg(n), to_real(low),
                     to_real(dadd(low, dmul(down, height)))};
}

/* Of crossing cores: the deepest point of their manifold. */
static jsl_gap deepest_gap(const jsl_shape_desc *a, jsl_pose pa, const jsl_shape_desc *b,
                           jsl_pose pb) {
    jsl_manifold m;
    jsl_gap gap = {0, {0, 0, 1}, pa.position, pa.position};
    jsl_collide(a, pa, b, pb, jsl_shape_radius(a) * JSL_R(1e-3), &m);
    for (int i = 0, best = 0; i < m.count; i++) {
        if (i > 0 && !(m.separation[i] < m.separation[best])) continue;
        best = i;
        gap = (jsl_gap){m.separation[i], m.normal,
                        jsl_mul_add(m.point[i], -m.separation[i] / 2, m.normal),
                        jsl_mul_add(m.point[i], m.separation[i] / 2, m.normal)};
    }
    return gap;
}

jsl_result jsl_shape_distance(const jsl_shape_desc *a, jsl_pose pose_a, const jsl_shape_desc *b,
                              jsl_pose pose_b, jsl_gap *out) {
    JSL_TRY(jsl_shape_check(a));
    JSL_TRY(jsl_shape_check(b));
    if (a->kind == JSL_SHAPE_PLANE && b->kind == JSL_SHAPE_PLANE) return JSL_ERR_ARGUMENT;
    bool swap = a->kind == JSL_SHAPE_PLANE;
    jsl_vec3 p = jsl_sub(pose_b.position, pose_a.position), origin = pose_a.position;
    jsl_pair_in in = {a, b, pose_a.orientation, pose_b.orientation, p, 0};
    if (swap) {
        in = (jsl_pair_in){b, a, pose_b.orientation, pose_a.orientation, jsl_neg(p), 0};
        origin = pose_b.position;
    }
    jsl_gap gap;
    if (in.b->kind == JSL_SHAPE_PLANE) {
        gap = plane_gap(&in);
    } else if (!jsl_gjk(&in, &gap)) {
        *out = deepest_gap(a, pose_a, b, pose_b);
        return JSL_OK;
    }
    gap.point_a = jsl_add(origin, gap.point_a);
    gap.point_b = jsl_add(origin, gap.point_b);
    *out = gap;
    if (swap) *out = (jsl_gap){gap.distance, jsl_neg(gap.normal), gap.point_b, gap.point_a};
    return JSL_OK;
}
