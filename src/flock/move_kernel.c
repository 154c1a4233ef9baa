/* SPDX-License-Identifier: MIT
 * Physics of a boid: a point that obeys its acceleration within its limits.
 */
#include "flock/move.h"
#include "math/wide.h"

/* One register of boids; returns the lanes that went bad. */
JSL_INLINE int move(const jsl_motion_limits *limits, const jsl_motion *b, int64_t j) {
    const wreal dt = wset(limits->dt), tiny = wset(JSL_R(1e-30)), none = wset(0);
    wreal ax = wloadu(b->ax + j), ay = wloadu(b->ay + j), az = wloadu(b->az + j);
    wreal vx = wloadu(b->vx + j), vy = wloadu(b->vy + j), vz = wloadu(b->vz + j);
    wreal px = wloadu(b->px + j), py = wloadu(b->py + j), pz = wloadu(b->pz + j);
    wreal a2 = ax * ax + ay * ay + az * az;
    wreal most = wset(limits->max_accel);
    wreal k = wselect(wgt(a2, most * most), most / wsqrt(wmax(a2, tiny)), wset(1));
    wreal ux = vx + ax * k * dt, uy = vy + ay * k * dt, uz = vz + az * k * dt;
    wreal speed = wsqrt(ux * ux + uy * uy + uz * uz);
    wreal wanted = wmax(wmin(speed, wset(limits->max_speed)), wset(limits->min_speed));
    wreal s = wselect(weq(wanted, speed), wset(1), wanted / wmax(speed, tiny));
    s = wselect(wgt(speed, wset(JSL_R(1e-15))), s, wset(1));
    ux *= s;
    uy *= s;
    uz *= s;
    wreal x = px, y = py, z = pz;
    if (!limits->pushes_only) {
        x += ux * dt;
        y += uy * dt;
        z += uz * dt;
    }
    /* t - t is 0 exactly for finite t; squares are included because they may overflow on their own.
     */
    wreal t = (x - x) + (y - y) + (z - z) + (ux - ux) + (uy - uy) + (uz - uz) + (speed - speed) +
              (a2 - a2);
    wmask good = weq(t, none);
    wstoreu(b->vx + j, wselect(good, ux, vx));
    wstoreu(b->vy + j, wselect(good, uy, vy));
    wstoreu(b->vz + j, wselect(good, uz, vz));
    if (!limits->pushes_only) {
        wstoreu(b->px + j, wselect(good, x, px));
        wstoreu(b->py + j, wselect(good, y, py));
        wstoreu(b->pz + j, wselect(good, z, pz));
    }
    return ~wbits(good) & (int)((1u << WN) - 1);
}

static int64_t blame(int lanes, uint8_t *bad, int64_t n) {
    int64_t count = 0;
    for (int l = 0; l < WN && l < n; l++)
        if (lanes >> l & 1) bad[l] = 1, count++;
    return count;
}

int64_t JSL_KERNEL(jsl_flock_move)(const jsl_motion_limits *limits, const jsl_motion *b, int64_t n,
                                   uint8_t *bad) {
    int64_t count = 0, j = 0;
    for (; j + WN <= n; j += WN) {
        int lanes = move(limits, b, j);
        if (lanes) count += blame(lanes, bad + j, WN);
    }
    if (j == n) return count;
    jsl_real part[9][WN] = {{0}};
    jsl_real *const column[9] = {b->px, b->py, b->pz, b->vx, b->vy, b->vz, b->ax, b->ay, b->az};
    const size_t rest = (size_t)(n - j) * sizeof(jsl_real);
    for (int k = 0; k < 9; k++) memcpy(part[k], column[k] + j, rest);
    jsl_motion tail = {part[0], part[1], part[2], part[3], part[4],
                       part[5], part[6], part[7], part[8]};
    int lanes = move(limits, &tail, 0);
    if (lanes) count += blame(lanes, bad + j, n - j);
    for (int k = 0; k < 6; k++) memcpy(column[k] + j, part[k], rest);
    return count;
}
