/* SPDX-License-Identifier: MIT
 * rotation.c - free rotation by splitting into turns about the principal axes.
 *
 * H = L1^2 / 2 I1 + L2^2 / 2 I2 + L3^2 / 2 I3 is split into its three terms; the flow of each is a
 * rotation about one body axis at constant rate, which is exact, and their symmetric composition is
 * of second order, reversible, symplectic, and keeps the angular momentum (Touma and Wisdom,
 * Astron. J. 107, 1994; Dullweber, Leimkuhler and McLachlan, J. Chem. Phys. 107, 1997).
 *
 * In double in both builds, and with rotations that divide by |q|^2: quaternions of the state are
 * unit only to rounding, and taking them for unit has a bias that makes the momentum creep by two
 * roundings a step.
 */
#include "rigid/room.h"
#include "rigid/solver.h"

#include <math.h>

typedef struct turning {
    double q[4]; /* x y z w, of any length */
    double l[3]; /* angular momentum in the body frame */
} turning;

static void multiply(const double a[4], const double b[4], double out[4]) {
    double x = a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1];
    double y = a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0];
    double z = a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3];
    double w = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2];
    out[0] = x, out[1] = y, out[2] = z, out[3] = w;
}

/* v turned by q, of any length; side -1: turned back. */
static void rotate(const double q[4], double side, const double v[3], double out[3]) {
    double k = 2 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), w = side * q[3];
    double t[3] = {k * (q[1] * v[2] - q[2] * v[1]), k * (q[2] * v[0] - q[0] * v[2]),
                   k * (q[0] * v[1] - q[1] * v[0])};
    double r[3] = {v[0] + w * t[0] + (q[1] * t[2] - q[2] * t[1]),
                   v[1] + w * t[1] + (q[2] * t[0] - q[0] * t[2]),
                   v[2] + w * t[2] + (q[0] * t[1] - q[1] * t[0])};
    out[0] = r[0], out[1] = r[1], out[2] = r[2];
}

/* The flow of one term over t: the body turns about its axis k, its momentum turns back in the body
 * frame. */
static void turn_axis(turning *s, const double inertia[3], int k, double t) {
    jsl_real sine, cosine;
    jsl_sin_cos((jsl_real)(0.5 * t * s->l[k] / inertia[k]), &sine, &cosine);
    double axis[4] = {0, 0, 0, (double)cosine}, back[3];
    axis[k] = (double)sine;
    multiply(s->q, axis, s->q);
    rotate(axis, -1, s->l, back);
    s->l[0] = back[0], s->l[1] = back[1], s->l[2] = back[2];
}

static void turn_body(const jsl_rigid_bodies *bodies, int64_t i, double h) {
    jsl_real *line = bodies->line + i * JSL_LINE, *move = bodies->move + i * JSL_MOVE,
             *base = bodies->base + i * JSL_BASE;
    const jsl_real *pose = bodies->pose + i * JSL_POSE, *turn = bodies->turn + i * JSL_TURN;
    double inertia[3], w[3], start[4], moved[4], momentum[3], after[3];
    turning s;
    for (int k = 0; k < 4; k++) start[k] = (double)pose[4 + k], moved[k] = (double)move[4 + k];
    for (int k = 0; k < 3; k++) inertia[k] = (double)turn[k], w[k] = (double)line[4 + k];
    multiply(moved, start, s.q);
    rotate(s.q, -1, w, s.l);
    for (int k = 0; k < 3; k++) s.l[k] *= inertia[k];
    rotate(s.q, 1, s.l, momentum);
    turn_axis(&s, inertia, 0, 0.5 * h);
    turn_axis(&s, inertia, 1, 0.5 * h);
    turn_axis(&s, inertia, 2, h);
    turn_axis(&s, inertia, 1, 0.5 * h);
    turn_axis(&s, inertia, 0, 0.5 * h);
    /* The momentum in the world is what it was: the turns' rounding stays out of it. */
    rotate(s.q, -1, momentum, after);
    for (int k = 0; k < 3; k++) after[k] /= inertia[k];
    rotate(s.q, 1, after, after);
    double unit = 1 / sqrt(s.q[0] * s.q[0] + s.q[1] * s.q[1] + s.q[2] * s.q[2] + s.q[3] * s.q[3]);
    for (int k = 0; k < 4; k++) s.q[k] *= unit;
    double back[4] = {-start[0], -start[1], -start[2], start[3]};
    multiply(s.q, back, moved);
    for (int k = 0; k < 4; k++) move[4 + k] = (jsl_real)moved[k];
    for (int k = 0; k < 3; k++) {
        jsl_real old = line[4 + k];
        line[4 + k] = (jsl_real)after[k];
        /* Not an impulse: the next warm start must not repeat it. */
        base[4 + k] += line[4 + k] - old;
    }
}

void jsl_rigid_turn_split(const jsl_rigid_bodies *bodies, const int32_t *slot, int64_t count,
                          jsl_real h) {
    for (int64_t n = 0; n < count; n++) turn_body(bodies, slot[n], (double)h);
}
