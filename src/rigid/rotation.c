/* SPDX-License-Identifier: MIT
 * rotation.c - free rotation by splitting into turns about the principal axes.
 *
 * H = L1^2 / 2 I1 + L2^2 / 2 I2 + L3^2 / 2 I3 is split into its three terms; the flow of each is a
 * rotation about one body axis at constant rate, which is exact, and their symmetric composition is
 * of second order, reversible, symplectic, and keeps the angular momentum (Touma and Wisdom,
 * Astron. J. 107, 1994; Dullweber, Leimkuhler and McLachlan, J. Chem. Phys. 107, 1997).
 */
#include "rigid/room.h"
#include "rigid/solver.h"

/* The flow of one term over t: the body turns about its axis k, its momentum turns back in the body
 * frame. */
static void turn_axis(jsl_quat *q, jsl_real l[3], const jsl_real inertia[3], int k, jsl_real t) {
    jsl_real half = JSL_R(0.5) * t * l[k] / inertia[k], s, c;
    jsl_sin_cos(half, &s, &c);
    jsl_real axis[3] = {0, 0, 0};
    axis[k] = s;
    *q = jsl_quat_mul(*q, (jsl_quat){axis[0], axis[1], axis[2], c});
    int i = (k + 1) % 3, j = (k + 2) % 3;
    jsl_real cosine = c * c - s * s, sine = 2 * s * c, li = l[i], lj = l[j];
    l[i] = cosine * li + sine * lj;
    l[j] = cosine * lj - sine * li;
}

void jsl_rigid_turn_split(const jsl_rigid_bodies *bodies, const int32_t *slot, int64_t count,
                          jsl_real h) {
    for (int64_t n = 0; n < count; n++) {
        jsl_real *line = bodies->line + (int64_t)slot[n] * JSL_LINE,
                 *move = bodies->move + (int64_t)slot[n] * JSL_MOVE,
                 *base = bodies->base + (int64_t)slot[n] * JSL_BASE;
        const jsl_real *pose = bodies->pose + (int64_t)slot[n] * JSL_POSE,
                       *inertia = bodies->turn + (int64_t)slot[n] * JSL_TURN;
        jsl_quat start = {pose[4], pose[5], pose[6], pose[7]};
        jsl_quat q = jsl_quat_mul((jsl_quat){move[4], move[5], move[6], move[7]}, start);
        jsl_vec3 w = jsl_v3(line[4], line[5], line[6]), b = jsl_rotate_inv(q, w);
        jsl_real l[3] = {inertia[0] * b.x, inertia[1] * b.y, inertia[2] * b.z};
        turn_axis(&q, l, inertia, 0, JSL_R(0.5) * h);
        turn_axis(&q, l, inertia, 1, JSL_R(0.5) * h);
        turn_axis(&q, l, inertia, 2, h);
        turn_axis(&q, l, inertia, 1, JSL_R(0.5) * h);
        turn_axis(&q, l, inertia, 0, JSL_R(0.5) * h);
        q = jsl_quat_normalize(q);
        jsl_vec3 after =
            jsl_rotate(q, jsl_v3(l[0] / inertia[0], l[1] / inertia[1], l[2] / inertia[2]));
        jsl_quat moved = jsl_quat_mul(q, jsl_quat_conj(start));
        move[4] = moved.x, move[5] = moved.y, move[6] = moved.z, move[7] = moved.w;
        line[4] = after.x, line[5] = after.y, line[6] = after.z;
        /* Not an impulse: the next warm start must not repeat it. */
        base[4] += after.x - w.x, base[5] += after.y - w.y, base[6] += after.z - w.z;
    }
}
