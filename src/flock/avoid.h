/* SPDX-License-Identifier: MIT
 * Steering round solid things: pure geometry, and the request that comes of it. Floor 4.
 */
#ifndef JSL_FLOCK_AVOID_H
#define JSL_FLOCK_AVOID_H

#include "geometry/geometry.h"
#include <jostle/math.h>

/* -- Geometry -------------------------------------------------------------------------------------
 */

/* Boundary points of the sphere (c, r) nearest to the course v from p: the tangent from p touches
 * at B, where |B - c| = r and (B - p).(B - c) = 0. With D = c - p, d = |D|, U = D/d, k^2 = d^2 -
 * r^2 and W the unit vector of v - (v.U)U: B = p + (k^2/d) U + (r k/d) W. When v is within about a
 * thousandth of the line to c, W is a fixed function of `who`, so that a flock that comes head-on
 * splits, always in the same way. near_side is B, far_side the point across (W negated). False when
 * p is not outside the sphere. */
bool jsl_tangent_points(jsl_vec3 p, jsl_vec3 v, jsl_vec3 c, jsl_real r, uint64_t who,
                        jsl_vec3 *near_side, jsl_vec3 *far_side);

/* The same in the plane at right angles to the unit vector axis, for an endless cylinder about (c,
 * axis): c is the point of the axis level with p. B is level with p as well. */
bool jsl_tangent_points_around(jsl_vec3 p, jsl_vec3 v, jsl_vec3 c, jsl_vec3 axis, jsl_real r,
                               uint64_t who, jsl_vec3 *near_side, jsl_vec3 *far_side);

/* Time until p + v t enters the sphere: 0 when inside and going deeper, -1 when it never will. */
jsl_real jsl_time_to_sphere(jsl_vec3 p, jsl_vec3 v, jsl_vec3 c, jsl_real r);

/* Where on the segment (c - half axis, c + half axis) lies the point nearest to the segment p, p +
 * path: the coordinate along axis in [-half, half]. */
jsl_real jsl_slide_along(jsl_vec3 c, jsl_vec3 axis, jsl_real half, jsl_vec3 p, jsl_vec3 path);

/* -- Obstacles
 * -------------------------------------------------------------------------------------- */

/* A solid thing as boids see it: a capsule around it (half 0: a sphere), or a plane. */
typedef struct jsl_obstacle {
    jsl_entity entity;
    jsl_shape_desc shape;
    jsl_pose pose;
    jsl_vec3 centre, axis, velocity; /* axis: unit; of a plane its normal */
    jsl_real half, radius;
    bool plane, snug; /* snug: the capsule is the shape itself */
} jsl_obstacle;

void jsl_obstacle_from(const jsl_collider_item *item, jsl_obstacle *out);

/* One boid looking at obstacles. */
typedef struct jsl_avoider {
    jsl_vec3 p, v;
    jsl_real room;     /* own radius plus margin, m */
    jsl_real horizon;  /* s */
    jsl_real budget;   /* m/s^2 */
    jsl_real interval; /* s between decisions */
    uint64_t who;
} jsl_avoider;

/* Distance from the boid's inflated surface to the obstacle (negative: too close), and the
 * direction straight away from it. */
jsl_real jsl_obstacle_distance(const jsl_avoider *boid, const jsl_obstacle *obstacle,
                               jsl_vec3 *normal);

/* The acceleration that keeps the boid clear of obstacles at[list[0..count)]; zero when none is in
 * the way. */
jsl_vec3 jsl_avoid(const jsl_avoider *boid, const jsl_obstacle *at, const int32_t *list, int count);

#endif
