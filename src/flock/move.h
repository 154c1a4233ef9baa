/* SPDX-License-Identifier: MIT
 * Moving boids. Floor 4.
 */
#ifndef JSL_FLOCK_MOVE_H
#define JSL_FLOCK_MOVE_H

#include "base/base.h"
#include "math/wide_dispatch.h"

typedef struct jsl_motion {
    jsl_real *px, *py, *pz, *vx, *vy, *vz, *ax, *ay, *az;
} jsl_motion;

typedef struct jsl_motion_limits {
    jsl_real dt, max_speed, min_speed, max_accel;
    bool pushes_only; /* something else moves the boids: change velocities alone */
} jsl_motion_limits;

/* Semi-implicit Euler over n boids: a shortened to max_accel, v += a dt, |v| brought into
 * [min_speed, max_speed] (a boid at rest stays so), p += v dt. A boid whose new state is not finite
 * keeps its place and velocity and gets bad[j] = 1 (else bad is not written). Returns how many are
 * bad. Nothing past n is written. */
JSL_KERNEL_DECLARE(int64_t, jsl_flock_move,
                   (const jsl_motion_limits *limits, const jsl_motion *boids, int64_t n,
                    uint8_t *bad));

#endif
