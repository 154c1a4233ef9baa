/* SPDX-License-Identifier: MIT
 * move_kernel.c - velocity and position updates of a sub-step, over consecutive slots.
 */
#include "rigid/lanes.h"
#include "rigid/solver.h"

typedef struct group {
    int32_t slot[JSL_LANES];
} group;

JSL_INLINE group group_at(int64_t first) {
    group g;
    for (int k = 0; k < WN; k++) g.slot[k] = (int32_t)first + k;
    return g;
}
JSL_INLINE lvec read3(const jsl_real *base, int stride, const group *g, wreal *fourth) {
    wreal v[4];
    lgather(base, stride, g->slot, v);
    *fourth = v[3];
    return lv(v[0], v[1], v[2]);
}
JSL_INLINE void write4(jsl_real *base, int stride, const group *g, lvec a, wreal fourth) {
    wreal v[4] = {a.x, a.y, a.z, fourth};
    lscatter(base, stride, g->slot, v);
}

/* One Newton step on the implicit gyroscopic torque in the body frame (Catto, "Numerical methods",
 * GDC 2015): stable at any spin, first order, takes energy out. */
JSL_INLINE lvec gyroscopic(lvec w, lquat q, lvec inertia, wreal h) {
    lmat r = lmat_of(q);
    lvec b = lmat_mul_t(r, w);
    lvec m = lv(inertia.x * b.x, inertia.y * b.y, inertia.z * b.z);
    lvec f = lscale(h, lcross(b, m));
    /* J = I + h ([b] I - [I b]), by columns. */
    lvec c0 = lv(inertia.x, h * (b.z * inertia.x - m.z), h * (m.y - b.y * inertia.x));
    lvec c1 = lv(h * (m.z - b.z * inertia.y), inertia.y, h * (b.x * inertia.y - m.x));
    lvec c2 = lv(h * (b.y * inertia.z - m.y), h * (m.x - b.x * inertia.z), inertia.z);
    lvec c12 = lcross(c1, c2);
    wreal det = ldot(c0, c12), inv = lselect(weq(det, wset(0)), det, wset(1) / det);
    lvec d = lv(inv * ldot(f, c12), inv * ldot(c0, lcross(f, c2)), inv * ldot(c0, lcross(c1, f)));
    return lmat_mul(r, lsub(b, d));
}

/* v0 = what kicks and damping make of v; v = v0 + the velocity that impulses gave in the last
 * sub-step, which is the warm start of all constraints at once because anchors, normals and
 * inertias stand still over a step. */
JSL_INLINE void kick(const jsl_rigid_pass *pass, int64_t begin, int64_t end, const bool first) {
    const jsl_rigid_bodies *b = &pass->bodies;
    const wreal h = wset(pass->h), angular_h = wset(pass->h);
    for (int64_t i = begin; i < end; i += WN) {
        group g = group_at(i);
        wreal inv_mass, pad, damp_v, damp_w, mode;
        lvec v = read3(b->line, JSL_LINE, &g, &inv_mass),
             w = read3(b->line + 4, JSL_LINE, &g, &pad);
        lvec a = read3(b->kick, JSL_KICK, &g, &damp_v),
             alpha = read3(b->kick + 4, JSL_KICK, &g, &damp_w);
        lvec inertia = read3(b->turn, JSL_TURN, &g, &mode);
        lvec v0 = lscale(damp_v, lmadd(v, h, a));
        /* The splitting integrator kicks half a sub-step before and half after its rotation. */
        wreal share = lselect(wgt(mode, wset(JSL_R(1.5))), angular_h * wset(pass->kick), angular_h);
        lvec w0 = lscale(damp_w, lmadd(w, share, alpha));
        wmask implicit = wgt(mode, wset(JSL_R(0.5))) & wgt(wset(JSL_R(1.5)), mode);
        if (wbits(implicit)) {
            wreal q[4], p[4];
            lgather(b->move + 4, JSL_MOVE, g.slot, q);
            lgather(b->pose + 4, JSL_POSE, g.slot, p);
            lquat now = lquat_mul((lquat){q[0], q[1], q[2], q[3]}, (lquat){p[0], p[1], p[2], p[3]});
            lvec turned = gyroscopic(w0, now, inertia, h);
            w0 = lv(lselect(implicit, turned.x, w0.x), lselect(implicit, turned.y, w0.y),
                    lselect(implicit, turned.z, w0.z));
        }
        if (!first) {
            lvec old_v = read3(b->base, JSL_BASE, &g, &pad),
                 old_w = read3(b->base + 4, JSL_BASE, &g, &pad);
            v = ladd(v0, lsub(v, old_v)), w = ladd(w0, lsub(w, old_w));
        } else {
            v = v0, w = w0;
        }
        write4(b->base, JSL_BASE, &g, v0, wset(0)), write4(b->base + 4, JSL_BASE, &g, w0, wset(0));
        write4(b->line, JSL_LINE, &g, v, inv_mass), write4(b->line + 4, JSL_LINE, &g, w, wset(0));
    }
}
void JSL_KERNEL(jsl_rigid_kick_first)(const jsl_rigid_pass *pass, int64_t begin, int64_t end) {
    kick(pass, begin, end, true);
}
void JSL_KERNEL(jsl_rigid_kick_next)(const jsl_rigid_pass *pass, int64_t begin, int64_t end) {
    kick(pass, begin, end, false);
}

/* Displacement by h v, rotation by exp(h w). The series of sin x / x and cos x are good to rounding
 * up to half angles x of 1 rad; faster spins are clamped before the step. */
void JSL_KERNEL(jsl_rigid_drift)(const jsl_rigid_pass *pass, int64_t begin, int64_t end) {
    const jsl_rigid_bodies *b = &pass->bodies;
    const wreal h = wset(pass->h), half = wset(pass->h * JSL_R(0.5)), one = wset(1);
    for (int64_t i = begin; i < end; i += WN) {
        group g = group_at(i);
        wreal pad, mode, qw;
        lvec v = read3(b->line, JSL_LINE, &g, &pad), w = read3(b->line + 4, JSL_LINE, &g, &pad);
        lvec dp = read3(b->move, JSL_MOVE, &g, &pad), qv = read3(b->move + 4, JSL_MOVE, &g, &qw);
        read3(b->turn, JSL_TURN, &g, &mode);
        write4(b->move, JSL_MOVE, &g, lmadd(dp, h, v), wset(0));
        lvec r = lscale(half, w);
        wreal s = ldot(r, r);
#define C(n) wset(JSL_R(1) / JSL_R(n))
        wreal sinc =
            one -
            s * (C(6) - s * (C(120) - s * (C(5040) - s * (C(362880) - s * (C(39916800) -
                                                                           s * C(6227020800.0))))));
        wreal cosine =
            one -
            s * (C(2) -
                 s * (C(24) - s * (C(720) - s * (C(40320) - s * (C(3628800) - s * C(479001600))))));
#undef C
        lquat old = {qv.x, qv.y, qv.z, qw};
        lquat q = lquat_mul((lquat){sinc * r.x, sinc * r.y, sinc * r.z, cosine}, old);
        wreal scale = one / wsqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
        wmask split = wgt(mode, wset(JSL_R(1.5)));
        lvec out = lv(lselect(split, old.x, scale * q.x), lselect(split, old.y, scale * q.y),
                      lselect(split, old.z, scale * q.z));
        write4(b->move + 4, JSL_MOVE, &g, out, lselect(split, old.w, scale * q.w));
    }
}
