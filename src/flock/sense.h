/* SPDX-License-Identifier: MIT
 * The two kernels of a decision: what boids see, and what they make of it. Floor 4.
 */
#ifndef JSL_FLOCK_SENSE_H
#define JSL_FLOCK_SENSE_H

#include "base/base.h"
#include "math/wide_dispatch.h"
#include <jostle/math.h>

/* Boids in cell order, one array a coordinate, readable JSL_LANES past the end. u is what a
 * neighbour is matched with: its unit heading or its velocity. */
typedef struct jsl_sight {
    jsl_real *x, *y, *z, *ux, *uy, *uz;
} jsl_sight;

/* Boids [begin, end) of a sight. */
typedef struct jsl_span {
    int64_t begin, end;
} jsl_span;

/* Boids who[begin..end) look at the boids of these spans. */
typedef struct jsl_gaze {
    jsl_span span[9];
    int spans, begin, end;
} jsl_gaze;

enum { JSL_SEPARATION, JSL_ALIGNMENT, JSL_COHESION, JSL_RULES };

/* Who counts. A neighbour at offset d counts for a rule when |d|^2 < near_sq, or |d|^2 <= radius_sq
 * and its direction is within the cone about the heading h: d.h > c|d|. Squared with signs kept,
 * (d.h)|d.h| > c|c| |d|^2, which needs no square root. */
typedef struct jsl_lens {
    jsl_real reach_sq; /* the largest radius, squared */
    jsl_real near_sq;
    jsl_real radius_sq[JSL_RULES];
    jsl_real cone[JSL_RULES]; /* c|c| */
} jsl_lens;

/* Sums over the neighbours of boid k, in element k of each array. */
enum {
    JSL_SUM_SEPARATION, /* x, y, z: sum of d/|d|^2 */
    JSL_SUM_ALIGNMENT = 3,
    JSL_SUM_COHESION = 6,
    JSL_COUNT_ALIGNMENT = 9,
    JSL_COUNT_COHESION,
    JSL_COUNT_ANY,  /* neighbours that count for some rule */
    JSL_COUNT_SAME, /* boids at exactly the same place, the boid itself included */
    JSL_SENSES
};

#define JSL_FLOCK_CHUNK 256  /* boids handled together by one worker */
#define JSL_FLOCK_BUFFER 512 /* candidates copied together; more are read in place */
#define JSL_FLOCK_LIST 1024  /* neighbours listed before they are summed */

/* Scratch of one worker. */
typedef struct jsl_sense_scratch {
    _Alignas(JSL_ALIGN) jsl_real sense[JSL_SENSES][JSL_FLOCK_CHUNK];
    jsl_real candidate[2][6][JSL_FLOCK_BUFFER + 2 * JSL_LANES];
    jsl_real list[6][JSL_FLOCK_LIST + 2 * JSL_LANES]; /* dx dy dz ux uy uz */
    int length[JSL_FLOCK_CHUNK];                      /* entries of each boid in the list */
} jsl_sense_scratch;

/* What the boids of some gazes (adjoining, from who[0] on, at most JSL_FLOCK_CHUNK boids), with
 * unit headings heading[0..2][k], see; results go to scratch->sense[*][k]. The neighbours of a boid
 * are summed in the order of its spans in 16 interleaved lanes, so that the bits depend on that
 * order only. */
JSL_KERNEL_DECLARE(void, jsl_flock_sense,
                   (const jsl_lens *lens, const jsl_sight *sight, const jsl_gaze *gaze, int gazes,
                    const int64_t *who, const jsl_real *const heading[3],
                    jsl_sense_scratch *scratch));

/* u /= |u| over [0, n), 0 where it is shorter than 1e-15; nothing past n is written. */
JSL_KERNEL_DECLARE(void, jsl_flock_heading, (jsl_real * x, jsl_real *y, jsl_real *z, int64_t n));

/* What the boids of one flock share when they decide. */
typedef struct jsl_decision {
    jsl_real weight[JSL_RULES];
    jsl_real budget; /* m/s^2 */
    int response, negotiation;
    jsl_vec3 urge;
    bool bounded, led;
    jsl_vec3 lo, hi;
    jsl_real bounds_weight;
    jsl_vec3 target, target_velocity; /* of the place behind the leader */
    jsl_real follow, max_speed;
} jsl_decision;

/* Columns of the boids that decide, count of them in whole groups of lanes: places, matched
 * quantity, velocity (read when led), request of avoidance (read and added to), and the
 * accelerations decided. */
typedef struct jsl_deciders {
    _Alignas(JSL_ALIGN) jsl_real p[3][JSL_FLOCK_CHUNK];
    jsl_real u[3][JSL_FLOCK_CHUNK], h[3][JSL_FLOCK_CHUNK], v[3][JSL_FLOCK_CHUNK];
    jsl_real avoid[3][JSL_FLOCK_CHUNK], a[3][JSL_FLOCK_CHUNK];
} jsl_deciders;
JSL_KERNEL_DECLARE(void, jsl_flock_decide,
                   (const jsl_decision *decision, const jsl_sense_scratch *scratch,
                    jsl_deciders *boids, int count));

#endif
