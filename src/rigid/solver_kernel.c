/* SPDX-License-Identifier: MIT
 * solver_kernel.c - the passes over manifolds, each manifold in its own six-dimensional frame.
 *
 * The points of a manifold share a normal, so about a centre C with axes n, t1, t2 = t1 x n the
 * approach speed of point j is un + x_j w2 - y_j w1: the relative twist is formed once, the points
 * are relaxed one after the other with the 4x4 matrix K = J M^-1 J^T, and the summed impulse is
 * applied to the bodies once. In exact arithmetic that is Gauss-Seidel point by point.
 */
#include "rigid/lanes.h"
#include "rigid/solver.h"

#define LANES JSL_LANES
/* Of the points of one manifold in the restitution pass. */
#define BOUNCE_SWEEPS 12
#define PART(array, fields, lane) ((array) + ((lane) / LANES) * ((fields)*LANES) + ((lane) % LANES))
#define GET(p, field) wload((p) + (field)*LANES)
#define PUT(p, field, value) wstore((p) + (field)*LANES, value)
#define GET3(p, field) lv(GET(p, field), GET(p, (field) + 1), GET(p, (field) + 2))
#define PUT3(p, field, v)                                                                          \
    (PUT(p, field, (v).x), PUT(p, (field) + 1, (v).y), PUT(p, (field) + 2, (v).z))

typedef struct body {
    lvec v, w;
    wreal inv_mass;
} body;

JSL_INLINE body get_body(const jsl_rigid_bodies *bodies, const int32_t *slot) {
    wreal v[4], w[4];
    lgather(bodies->line, JSL_LINE, slot, v);
    lgather(bodies->line + 4, JSL_LINE, slot, w);
    return (body){lv(v[0], v[1], v[2]), lv(w[0], w[1], w[2]), v[3]};
}
JSL_INLINE void put_body(const jsl_rigid_bodies *bodies, const int32_t *slot, const body *b) {
    wreal v[4] = {b->v.x, b->v.y, b->v.z, b->inv_mass}, w[4] = {b->w.x, b->w.y, b->w.z, wset(0)};
    lscatter(bodies->line, JSL_LINE, slot, v);
    lscatter(bodies->line + 4, JSL_LINE, slot, w);
}
JSL_INLINE lsym get_inertia(const jsl_rigid_bodies *bodies, const int32_t *slot) {
    wreal a[4], b[4];
    lgather(bodies->line + 8, JSL_LINE, slot, a);
    lgather(bodies->line + 12, JSL_LINE, slot, b);
    return (lsym){a[0], a[1], a[2], a[3], b[0], b[1]};
}
JSL_INLINE lvec get_vec(const jsl_real *base, int stride, const int32_t *slot, wreal *fourth) {
    wreal v[4];
    lgather(base, stride, slot, v);
    if (fourth) *fourth = v[3];
    return lv(v[0], v[1], v[2]);
}
JSL_INLINE lquat get_quat(const jsl_real *base, int stride, const int32_t *slot) {
    wreal v[4];
    lgather(base, stride, slot, v);
    return (lquat){v[0], v[1], v[2], v[3]};
}

/* Applies the impulse P at the centre and the angular impulse L about it: +B, -A. */
JSL_INLINE void apply(const jsl_rigid_bodies *bodies, const int32_t *ia, const int32_t *ib, body *A,
                      body *B, lvec P, lvec L, lvec arm_a, lvec arm_b, const bool wall) {
    B->v = lmadd(B->v, B->inv_mass, P);
    B->w = ladd(B->w, lsym_mul(get_inertia(bodies, ib), ladd(L, lcross(arm_b, P))));
    put_body(bodies, ib, B);
    if (wall) return;
    A->v = lmsub(A->v, A->inv_mass, P);
    A->w = lsub(A->w, lsym_mul(get_inertia(bodies, ia), ladd(L, lcross(arm_a, P))));
    put_body(bodies, ia, A);
}

/* Records of a colour lie a few apart: too far for the hardware to guess. Fetches those of the
 * group at `lane` from real `first` on. */
JSL_INLINE void fetch_ahead(const jsl_rigid_pass *pass, int64_t lane, int64_t end,
                            const int first) {
    if (lane >= end) return;
    for (int k = 0; k < WN; k++) {
        const jsl_real *geo = pass->geo + (int64_t)pass->blocks.contact[lane + k] * JSL_GEO;
        for (int r = first; r < JSL_GEO; r += JSL_ALIGN / (int)sizeof(jsl_real))
            __builtin_prefetch(geo + r);
    }
}

/* -- Prepare --------------------------------------------------------------------------------- */

/* The manifold in the world, about x_B. */
typedef struct manifold {
    lvec normal, t1, t2, p[4], to_a; /* to_a: x_B - x_A */
    wreal gap[4], there[4], impulse[4], mu, bounce, round_a, round_b;
    lvec tangent;
    wreal twist;
} manifold;

JSL_INLINE void read_manifold(const jsl_rigid_pass *pass, const int32_t *contact, const int32_t *ia,
                              const int32_t *ib, manifold *m, wreal *scale) {
    const jsl_rigid_bodies *bodies = &pass->bodies;
    const wreal one = wset(1), zero = wset(0);
    lvec xa = get_vec(bodies->pose, JSL_POSE, ia, NULL),
         xb = get_vec(bodies->pose, JSL_POSE, ib, NULL);
    lmat ra = lmat_of(get_quat(bodies->pose + 4, JSL_POSE, ia));
    lmat rb = lmat_of(get_quat(bodies->pose + 4, JSL_POSE, ib));
    m->to_a = lsub(xb, xa);
    m->normal = lmat_mul(ra, get_vec(pass->geo + JSL_GEO_NORMAL, JSL_GEO, contact, &m->mu));
    m->tangent = get_vec(pass->geo + JSL_GEO_TANGENT, JSL_GEO, contact, &m->twist);
    lvec shift = get_vec(pass->geo + JSL_GEO_SHIFT, JSL_GEO, contact, &m->bounce);
    lvec round = get_vec(pass->geo + JSL_GEO_ROUND, JSL_GEO, contact, NULL);
    m->round_a = round.x, m->round_b = round.y, *scale = round.z;
    lgather(pass->geo + JSL_GEO_IMPULSE, JSL_GEO, contact, m->impulse);
    for (int j = 0; j < 4; j++) {
        wreal built;
        lvec a = get_vec(pass->geo + JSL_GEO_A + 4 * j, JSL_GEO, contact, &built);
        lvec b = get_vec(pass->geo + JSL_GEO_B + 4 * j, JSL_GEO, contact, NULL);
        a = lmat_mul(ra, ladd(a, shift));
        b = lmat_mul(rb, b);
        m->there[j] = lkeep(wgt(wset(JSL_FAR / 2), built), one);
        m->p[j] = lscale(wset(JSL_R(0.5)), ladd(a, b));
        m->gap[j] = built + ldot(m->normal, lsub(b, a));
    }
    /* As jsl_perpendicular. */
    lvec n = m->normal;
    wmask steep = wgt(labsolute(n.x), wset(JSL_R(0.57735)));
    lvec t = lv(lselect(steep, n.y, zero), lselect(steep, -n.x, n.z), lselect(steep, zero, -n.y));
    m->t1 = lscale(one / wsqrt(lmax(ldot(t, t), wset(JSL_R(1e-30)))), t);
    m->t2 = lcross(m->t1, n);
}

/* The centre: mean of the points, those that touch counting most. Never without weight. */
JSL_INLINE lvec centre_of(const manifold *m, wreal scale) {
    const wreal zero = wset(0), one = wset(1), two = wset(2);
    lvec c = lv(zero, zero, zero);
    wreal sum = zero;
    for (int j = 0; j < 4; j++) {
        wreal weight = lmax(lmin(two - m->gap[j] * scale * two, one), wset(JSL_R(1e-6)));
        weight = weight * m->there[j];
        c = lmadd(c, weight, m->p[j]);
        sum = sum + weight;
    }
    return lscale(linverse(sum), c);
}

JSL_INLINE void prepare_friction(jsl_real *f, const manifold *m, lvec arm_a, lvec arm_b, lvec ipa,
                                 lvec ipb, lsym ia, lsym ib, wreal mass) {
    lvec a1 = lcross(arm_a, m->t1), b1 = lcross(arm_b, m->t1), a2 = lcross(arm_a, m->t2),
         b2 = lcross(arm_b, m->t2);
    lvec ia1 = lsym_mul(ia, a1), ib1 = lsym_mul(ib, b1), ia2 = lsym_mul(ia, a2),
         ib2 = lsym_mul(ib, b2);
    lvec q = ladd(ipa, ipb), q1 = ladd(ia1, ib1), q2 = ladd(ia2, ib2);
    lvec sn = ladd(lsym_mul(ia, m->normal), lsym_mul(ib, m->normal));
    wreal k11 = mass + (ldot(a1, ia1) + ldot(b1, ib1)),
          k22 = mass + (ldot(a2, ia2) + ldot(b2, ib2)), k12 = ldot(a1, ia2) + ldot(b1, ib2);
    wreal inv = linverse(k11 * k22 - k12 * k12);
    PUT(f, JSL_F_MASS, inv * k22);
    PUT(f, JSL_F_MASS + 1, -(inv * k12));
    PUT(f, JSL_F_MASS + 2, inv * k11);
    PUT(f, JSL_F_TWIST_MASS, linverse(ldot(m->normal, sn)));
    /* Speeds gained by the twist and the tangents from normal impulses Pn, their moments Lx and Ly,
     * and from the twist: wn += c0 Pn + c1 Lx + c2 Ly; ut += c0 Pn + c1 Lx + c2 Ly + c3 T. */
    PUT(f, JSL_F_COUPLE, ldot(m->normal, q));
    PUT(f, JSL_F_COUPLE + 1, ldot(sn, m->t2));
    PUT(f, JSL_F_COUPLE + 2, -ldot(sn, m->t1));
    PUT(f, JSL_F_COUPLE + 3, ldot(a1, ipa) + ldot(b1, ipb));
    PUT(f, JSL_F_COUPLE + 4, ldot(q1, m->t2));
    PUT(f, JSL_F_COUPLE + 5, -ldot(q1, m->t1));
    PUT(f, JSL_F_COUPLE + 6, ldot(q1, m->normal));
    PUT(f, JSL_F_COUPLE + 7, ldot(a2, ipa) + ldot(b2, ipb));
    PUT(f, JSL_F_COUPLE + 8, ldot(q2, m->t2));
    PUT(f, JSL_F_COUPLE + 9, -ldot(q2, m->t1));
    PUT(f, JSL_F_COUPLE + 10, ldot(q2, m->normal));
    PUT(f, JSL_F_MU, m->mu);
    PUT(f, JSL_F_TANGENT, ldot(m->tangent, m->t1));
    PUT(f, JSL_F_TANGENT + 1, ldot(m->tangent, m->t2));
    PUT(f, JSL_F_TWIST, m->twist);
    PUT(f, JSL_F_ROUND, m->round_a);
    PUT(f, JSL_F_ROUND + 1, m->round_b);
    for (int k = 0; k < 3; k++) PUT(f, JSL_F_SUM + k, wset(0));
}

void JSL_KERNEL(jsl_rigid_prepare)(const jsl_rigid_pass *pass, int64_t begin, int64_t end) {
    const jsl_rigid_bodies *bodies = &pass->bodies;
    for (int64_t lane = begin; lane < end; lane += WN) {
        jsl_real *n = PART(pass->blocks.normal, JSL_N, lane),
                 *f = PART(pass->blocks.friction, JSL_F, lane);
        const int32_t *slot_a = pass->blocks.a + lane, *slot_b = pass->blocks.b + lane;
        manifold m;
        wreal scale, x[4], y[4];
        fetch_ahead(pass, lane + JSL_LANES, end, 0);
        read_manifold(pass, pass->blocks.contact + lane, slot_a, slot_b, &m, &scale);
        lvec arm_b = centre_of(&m, scale), arm_a = ladd(arm_b, m.to_a);
        body A = get_body(bodies, slot_a), B = get_body(bodies, slot_b);
        lsym ia = get_inertia(bodies, slot_a), ib = get_inertia(bodies, slot_b);
        lvec vr = lsub(ladd(B.v, lcross(B.w, arm_b)), ladd(A.v, lcross(A.w, arm_a))),
             wr = lsub(B.w, A.w);
        wreal un = ldot(m.normal, vr), w1 = ldot(wr, m.t1), w2 = ldot(wr, m.t2);
        for (int j = 0; j < 4; j++) {
            lvec rho = lsub(m.p[j], arm_b);
            x[j] = m.there[j] * ldot(rho, m.t1);
            y[j] = m.there[j] * ldot(rho, m.t2);
            PUT(n, JSL_N_XY + 2 * j, x[j]);
            PUT(n, JSL_N_XY + 2 * j + 1, y[j]);
            PUT(n, JSL_N_GAP + j, m.gap[j]);
            PUT(f, JSL_F_GAP + j, m.gap[j]);
            PUT(f, JSL_F_LEVER + j, wsqrt(x[j] * x[j] + y[j] * y[j]));
            PUT(n, JSL_N_IMPULSE + j, m.impulse[j]);
        }
        if (pass->bounces) {
            jsl_real *r = PART(pass->blocks.bounce, JSL_R_FIELDS, lane);
            PUT(r, JSL_R_BOUNCE, m.bounce);
            for (int j = 0; j < 4; j++) {
                PUT(r, JSL_R_SPEED + j, un + x[j] * w2 - y[j] * w1);
                PUT(r, JSL_R_MOST + j, wset(0));
            }
        }
        lvec pa = lcross(arm_a, m.normal), pb = lcross(arm_b, m.normal);
        lvec ipa = lsym_mul(ia, pa), ipb = lsym_mul(ib, pb), q = ladd(ipa, ipb);
        wreal mass = A.inv_mass + B.inv_mass, k0 = mass + (ldot(pa, ipa) + ldot(pb, ipb));
        lvec s1 = ladd(lsym_mul(ia, m.t1), lsym_mul(ib, m.t1)),
             s2 = ladd(lsym_mul(ia, m.t2), lsym_mul(ib, m.t2));
        wreal s11 = ldot(m.t1, s1), s12 = ldot(m.t1, s2), s22 = ldot(m.t2, s2), q1 = ldot(q, m.t1),
              q2 = ldot(q, m.t2);
        int off = JSL_N_K;
        for (int i = 0; i < 4; i++)
            for (int j = i; j < 4; j++) {
                wreal k = k0 + q2 * (x[i] + x[j]) - q1 * (y[i] + y[j]) + x[i] * x[j] * s22 -
                          (x[i] * y[j] + y[i] * x[j]) * s12 + y[i] * y[j] * s11;
                if (i == j)
                    PUT(n, JSL_N_MASS + i, m.there[i] * linverse(k));
                else
                    PUT(n, off++, k);
            }
        PUT3(n, JSL_N_NORMAL, m.normal);
        PUT3(n, JSL_N_TANGENT, m.t1);
        PUT3(n, JSL_N_ARM_A, arm_a);
        PUT3(n, JSL_N_ARM_B, arm_b);
        prepare_friction(f, &m, arm_a, arm_b, ipa, ipb, ia, ib, mass);
    }
}

/* -- Warm start ------------------------------------------------------------------------------ */

JSL_INLINE void warm(const jsl_rigid_pass *pass, int64_t begin, int64_t end, const bool wall) {
    for (int64_t lane = begin; lane < end; lane += WN) {
        const jsl_real *n = PART(pass->blocks.normal, JSL_N, lane),
                       *f = PART(pass->blocks.friction, JSL_F, lane);
        const int32_t *ia = pass->blocks.a + lane, *ib = pass->blocks.b + lane;
        body A = {0}, B = get_body(&pass->bodies, ib);
        if (!wall) A = get_body(&pass->bodies, ia);
        lvec nr = GET3(n, JSL_N_NORMAL), t1 = GET3(n, JSL_N_TANGENT), t2 = lcross(t1, nr);
        wreal pn = wset(0), lx = pn, ly = pn;
        for (int j = 0; j < 4; j++) {
            wreal l = GET(n, JSL_N_IMPULSE + j);
            pn = pn + l;
            lx = lx + l * GET(n, JSL_N_XY + 2 * j);
            ly = ly + l * GET(n, JSL_N_XY + 2 * j + 1);
        }
        lvec P =
            lmadd(lmadd(lscale(pn, nr), GET(f, JSL_F_TANGENT), t1), GET(f, JSL_F_TANGENT + 1), t2);
        lvec L = lmadd(lmsub(lscale(lx, t2), ly, t1), GET(f, JSL_F_TWIST), nr);
        apply(&pass->bodies, ia, ib, &A, &B, P, L, GET3(n, JSL_N_ARM_A), GET3(n, JSL_N_ARM_B),
              wall);
    }
}

/* -- Passes over the points ------------------------------------------------------------------ */

/* The relative motion at the centre, and what the points add to it. */
typedef struct frame {
    body A, B;
    lvec nr, t1, t2, arm_a, arm_b, vr, wr;
    wreal x[4], y[4], vn[4]; /* approach speeds, kept current while points are solved */
    wreal pn, lx, ly;        /* sums of impulse changes and of their moments */
} frame;

JSL_INLINE void open_frame(const jsl_rigid_pass *pass, const jsl_real *n, const int32_t *ia,
                           const int32_t *ib, frame *s) {
    s->A = get_body(&pass->bodies, ia), s->B = get_body(&pass->bodies, ib);
    s->nr = GET3(n, JSL_N_NORMAL), s->t1 = GET3(n, JSL_N_TANGENT), s->t2 = lcross(s->t1, s->nr);
    s->arm_a = GET3(n, JSL_N_ARM_A), s->arm_b = GET3(n, JSL_N_ARM_B);
    s->vr = lsub(ladd(s->B.v, lcross(s->B.w, s->arm_b)), ladd(s->A.v, lcross(s->A.w, s->arm_a)));
    s->wr = lsub(s->B.w, s->A.w);
    wreal un = ldot(s->nr, s->vr), w1 = ldot(s->wr, s->t1), w2 = ldot(s->wr, s->t2);
    for (int j = 0; j < 4; j++) {
        s->x[j] = GET(n, JSL_N_XY + 2 * j), s->y[j] = GET(n, JSL_N_XY + 2 * j + 1);
        s->vn[j] = un + s->x[j] * w2 - s->y[j] * w1;
    }
    s->pn = s->lx = s->ly = wset(0);
}
/* Point j changed its impulse by d: later points feel it. */
JSL_INLINE void feel(const jsl_real *n, frame *s, const int j, wreal d) {
    if (j == 0) {
        s->vn[1] = s->vn[1] + GET(n, JSL_N_K) * d;
        s->vn[2] = s->vn[2] + GET(n, JSL_N_K + 1) * d;
        s->vn[3] = s->vn[3] + GET(n, JSL_N_K + 2) * d;
    } else if (j == 1) {
        s->vn[2] = s->vn[2] + GET(n, JSL_N_K + 3) * d;
        s->vn[3] = s->vn[3] + GET(n, JSL_N_K + 4) * d;
    } else if (j == 2) {
        s->vn[3] = s->vn[3] + GET(n, JSL_N_K + 5) * d;
    }
    s->pn = s->pn + d;
    s->lx = s->lx + d * s->x[j];
    s->ly = s->ly + d * s->y[j];
}

/* With bias: pushes overlap out softly, lets gaps close no faster than they can in h. */
JSL_INLINE void solve(const jsl_rigid_pass *pass, int64_t begin, int64_t end, const bool wall) {
    const jsl_rigid_soft soft = wall ? pass->wall : pass->pair;
    const wreal zero = wset(0), one = wset(1), inv_h = wset(pass->inv_h), push = wset(-pass->push);
    const wreal rate = wset(soft.bias * soft.mass), mass = wset(soft.mass),
                keep = wset(soft.impulse);
    for (int64_t lane = begin; lane < end; lane += WN) {
        jsl_real *n = PART(pass->blocks.normal, JSL_N, lane);
        const int32_t *ia = pass->blocks.a + lane, *ib = pass->blocks.b + lane;
        frame s;
        open_frame(pass, n, ia, ib, &s);
        for (int j = 0; j < 4; j++) {
            wreal gap = GET(n, JSL_N_GAP + j), old = GET(n, JSL_N_IMPULSE + j);
            wmask apart = wgt(gap, zero);
            wreal bias = lselect(apart, gap * inv_h, lmax(rate * gap, push));
            wreal scale = lselect(apart, one, mass), leak = lselect(apart, zero, keep);
            wreal change = GET(n, JSL_N_MASS + j) * (scale * s.vn[j] + bias) + leak * old;
            wreal impulse = lmax(old - change, zero);
            PUT(n, JSL_N_IMPULSE + j, impulse);
            feel(n, &s, j, impulse - old);
        }
        apply(&pass->bodies, ia, ib, &s.A, &s.B, lscale(s.pn, s.nr),
              lmsub(lscale(s.lx, s.t2), s.ly, s.t1), s.arm_a, s.arm_b, wall);
    }
}

/* R^T n - n for the rotation q, without cancellation. */
JSL_INLINE lvec turned_back(lquat q, lvec n) {
    lvec u = lv(q.x, q.y, q.z), t = lcross(n, u);
    t = ladd(t, t);
    return lsub(lscale(q.w, t), lcross(u, t));
}

/* Separations now, from the motion since the step's origin: linear in x_j, y_j. What turns with a
 * body is the core under the point, not the point: a ball that rolls stays as near as it was. */
typedef struct gaps {
    wreal s0, s1, s2;
} gaps;
JSL_INLINE gaps moved_gaps(const jsl_rigid_pass *pass, const jsl_real *f, const int32_t *ia,
                           const int32_t *ib, const frame *s) {
    const jsl_rigid_bodies *bodies = &pass->bodies;
    lvec xa = get_vec(bodies->move, JSL_MOVE, ia, NULL),
         xb = get_vec(bodies->move, JSL_MOVE, ib, NULL);
    lvec da = turned_back(get_quat(bodies->move + 4, JSL_MOVE, ia), s->nr),
         db = turned_back(get_quat(bodies->move + 4, JSL_MOVE, ib), s->nr), d = lsub(db, da);
    lvec core_a = lmsub(s->arm_a, GET(f, JSL_F_ROUND), s->nr),
         core_b = lmadd(s->arm_b, GET(f, JSL_F_ROUND + 1), s->nr);
    return (gaps){ldot(s->nr, lsub(xb, xa)) + (ldot(db, core_b) - ldot(da, core_a)), ldot(d, s->t1),
                  ldot(d, s->t2)};
}

/* Twist and central friction, which see the normal impulses just changed through the stored
 * couplings. Adds their impulse to P and L. */
JSL_INLINE void rub(jsl_real *f, const frame *s, wreal total, wreal lever, lvec *P, lvec *L) {
    const wreal one = wset(1), tiny = wset(JSL_R(1e-18));
    wreal mu = GET(f, JSL_F_MU), wn = ldot(s->nr, s->wr);
    wn = wn + GET(f, JSL_F_COUPLE) * s->pn + GET(f, JSL_F_COUPLE + 1) * s->lx +
         GET(f, JSL_F_COUPLE + 2) * s->ly;
    wreal twist = GET(f, JSL_F_TWIST), limit = mu * lever;
    wreal next = lmax(lmin(twist - GET(f, JSL_F_TWIST_MASS) * wn, limit), -limit),
          dt = next - twist;
    PUT(f, JSL_F_TWIST, next);
    wreal u1 = ldot(s->vr, s->t1), u2 = ldot(s->vr, s->t2);
    u1 = u1 + GET(f, JSL_F_COUPLE + 3) * s->pn + GET(f, JSL_F_COUPLE + 4) * s->lx +
         GET(f, JSL_F_COUPLE + 5) * s->ly + GET(f, JSL_F_COUPLE + 6) * dt;
    u2 = u2 + GET(f, JSL_F_COUPLE + 7) * s->pn + GET(f, JSL_F_COUPLE + 8) * s->lx +
         GET(f, JSL_F_COUPLE + 9) * s->ly + GET(f, JSL_F_COUPLE + 10) * dt;
    wreal f1 = GET(f, JSL_F_TANGENT), f2 = GET(f, JSL_F_TANGENT + 1), m12 = GET(f, JSL_F_MASS + 1);
    wreal g1 = f1 - GET(f, JSL_F_MASS) * u1 - m12 * u2,
          g2 = f2 - m12 * u1 - GET(f, JSL_F_MASS + 2) * u2;
    wreal most = mu * total, square = g1 * g1 + g2 * g2;
    wreal shrink = lselect(wgt(square, most * most), most / (wsqrt(square) + tiny), one);
    g1 = shrink * g1, g2 = shrink * g2;
    PUT(f, JSL_F_TANGENT, g1);
    PUT(f, JSL_F_TANGENT + 1, g2);
    PUT(f, JSL_F_SUM, GET(f, JSL_F_SUM) + total);
    PUT(f, JSL_F_SUM + 1, GET(f, JSL_F_SUM + 1) + g1);
    PUT(f, JSL_F_SUM + 2, GET(f, JSL_F_SUM + 2) + g2);
    *P = lmadd(lmadd(*P, g1 - f1, s->t1), g2 - f2, s->t2);
    *L = lmadd(*L, dt, s->nr);
}

/* Without bias, after the positions moved: takes out the speed that the bias put in, then rubs. */
JSL_INLINE void relax(const jsl_rigid_pass *pass, int64_t begin, int64_t end, const bool wall) {
    const wreal zero = wset(0), inv_h = wset(pass->inv_h);
    for (int64_t lane = begin; lane < end; lane += WN) {
        jsl_real *n = PART(pass->blocks.normal, JSL_N, lane),
                 *f = PART(pass->blocks.friction, JSL_F, lane);
        const int32_t *ia = pass->blocks.a + lane, *ib = pass->blocks.b + lane;
        frame s;
        open_frame(pass, n, ia, ib, &s);
        gaps g = moved_gaps(pass, f, ia, ib, &s);
        wreal total = zero, lever = zero;
        for (int j = 0; j < 4; j++) {
            wreal gap = GET(f, JSL_F_GAP + j) + (g.s0 + s.x[j] * g.s1 + s.y[j] * g.s2);
            wreal old = GET(n, JSL_N_IMPULSE + j);
            PUT(n, JSL_N_GAP + j, gap);
            wreal bias = lmax(gap, zero) * inv_h;
            wreal impulse = lmax(old - GET(n, JSL_N_MASS + j) * (s.vn[j] + bias), zero);
            PUT(n, JSL_N_IMPULSE + j, impulse);
            feel(n, &s, j, impulse - old);
            total = total + impulse;
            lever = lever + GET(f, JSL_F_LEVER + j) * impulse;
        }
        if (pass->bounces) {
            jsl_real *r = PART(pass->blocks.bounce, JSL_R_FIELDS, lane);
            for (int j = 0; j < 4; j++)
                PUT(r, JSL_R_MOST + j, lmax(GET(r, JSL_R_MOST + j), GET(n, JSL_N_IMPULSE + j)));
        }
        lvec P = lscale(s.pn, s.nr), L = lmsub(lscale(s.lx, s.t2), s.ly, s.t1);
        rub(f, &s, total, lever, &P, &L);
        apply(&pass->bodies, ia, ib, &s.A, &s.B, P, L, s.arm_a, s.arm_b, wall);
    }
}

/* As feel, for all points: they are swept more than once. */
JSL_INLINE void feel_all(const jsl_real *n, frame *s, const int j, wreal d) {
    static const signed char coupling[4][4] = {
        {-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};
    for (int k = 0; k < 4; k++) {
        if (k == j) continue;
        s->vn[k] = s->vn[k] + GET(n, JSL_N_K + coupling[j][k]) * d;
    }
    /* K_jj is 1 / mass; a point that is not there has mass 0 and changes nothing. */
    s->vn[j] = s->vn[j] + linverse(GET(n, JSL_N_MASS + j)) * d;
    s->pn = s->pn + d;
    s->lx = s->lx + d * s->x[j];
    s->ly = s->ly + d * s->y[j];
}

/* Once a step: points that carried load and came in fast leave with e times the speed they came
 * with. The points of a manifold are swept until they agree, so that a box that lands flat leaves
 * flat. */
JSL_INLINE void bounce(const jsl_rigid_pass *pass, int64_t begin, int64_t end, const bool wall) {
    const wreal zero = wset(0), threshold = wset(-pass->threshold);
    for (int64_t lane = begin; lane < end; lane += WN) {
        jsl_real *n = PART(pass->blocks.normal, JSL_N, lane),
                 *f = PART(pass->blocks.friction, JSL_F, lane),
                 *r = PART(pass->blocks.bounce, JSL_R_FIELDS, lane);
        const int32_t *ia = pass->blocks.a + lane, *ib = pass->blocks.b + lane;
        wreal e = GET(r, JSL_R_BOUNCE), impulse[4];
        if (!wbits(wgt(e, zero))) continue;
        frame s;
        open_frame(pass, n, ia, ib, &s);
        for (int j = 0; j < 4; j++) impulse[j] = GET(n, JSL_N_IMPULSE + j);
        for (int sweep = 0; sweep < BOUNCE_SWEEPS; sweep++)
            for (int j = 0; j < 4; j++) {
                wreal speed = GET(r, JSL_R_SPEED + j), old = impulse[j];
                wmask live =
                    wgt(threshold, speed) & wgt(GET(r, JSL_R_MOST + j), zero) & wgt(e, zero);
                wreal next = lmax(old - GET(n, JSL_N_MASS + j) * (s.vn[j] + e * speed), zero);
                impulse[j] = lselect(live, next, old);
                feel_all(n, &s, j, impulse[j] - old);
            }
        for (int j = 0; j < 4; j++) PUT(n, JSL_N_IMPULSE + j, impulse[j]);
        PUT(f, JSL_F_SUM, GET(f, JSL_F_SUM) + s.pn);
        apply(&pass->bodies, ia, ib, &s.A, &s.B, lscale(s.pn, s.nr),
              lmsub(lscale(s.lx, s.t2), s.ly, s.t1), s.arm_a, s.arm_b, wall);
    }
}

/* Impulses go back to their contacts: the next step starts from them, and callers read the sums. */
void JSL_KERNEL(jsl_rigid_store)(const jsl_rigid_pass *pass, int64_t begin, int64_t end) {
    for (int64_t lane = begin; lane < end; lane += WN) {
        const jsl_real *n = PART(pass->blocks.normal, JSL_N, lane),
                       *f = PART(pass->blocks.friction, JSL_F, lane);
        const int32_t *contact = pass->blocks.contact + lane;
        fetch_ahead(pass, lane + JSL_LANES, end, JSL_GEO_TANGENT);
        lvec nr = GET3(n, JSL_N_NORMAL), t1 = GET3(n, JSL_N_TANGENT), t2 = lcross(t1, nr);
        lvec tangent = lmadd(lscale(GET(f, JSL_F_TANGENT), t1), GET(f, JSL_F_TANGENT + 1), t2);
        lvec rub = lmadd(lscale(GET(f, JSL_F_SUM + 1), t1), GET(f, JSL_F_SUM + 2), t2);
        wreal impulse[4], last[4] = {tangent.x, tangent.y, tangent.z, GET(f, JSL_F_TWIST)},
                          sums[4] = {rub.x, rub.y, rub.z, GET(f, JSL_F_SUM)};
        wreal gap = GET(n, JSL_N_GAP);
        for (int j = 0; j < 4; j++) {
            impulse[j] = GET(n, JSL_N_IMPULSE + j);
            gap = lmin(gap, GET(n, JSL_N_GAP + j));
        }
        lscatter(pass->geo + JSL_GEO_TANGENT, JSL_GEO, contact, last);
        lscatter(pass->geo + JSL_GEO_RUB, JSL_GEO, contact, sums);
        lscatter(pass->geo + JSL_GEO_IMPULSE, JSL_GEO, contact, impulse);
        jsl_real each[JSL_LANES] __attribute__((aligned(JSL_ALIGN)));
        wstore(each, gap);
        for (int k = 0; k < WN; k++)
            pass->geo[(int64_t)contact[k] * JSL_GEO + JSL_GEO_GAP] = each[k];
    }
}

#define BOTH(name)                                                                                 \
    void JSL_KERNEL(jsl_rigid_##name)(const jsl_rigid_pass *pass, int64_t begin, int64_t end) {    \
        name(pass, begin, end, false);                                                             \
    }                                                                                              \
    void JSL_KERNEL(jsl_rigid_##name##_wall)(const jsl_rigid_pass *pass, int64_t begin,            \
                                             int64_t end) {                                        \
        name(pass, begin, end, true);                                                              \
    }
BOTH(warm)
BOTH(solve)
BOTH(relax)
BOTH(bounce)
