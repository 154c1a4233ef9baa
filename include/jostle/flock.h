/* SPDX-License-Identifier: MIT
 * jostle/flock.h - flocks: boids that see only their neighbours, and negotiate what they want.
 *
 * A flock is an entity whose component `flock` holds the settings; a boid is an entity with
 * position, velocity and `boid`, which names its flock. Each boid sees the other boids of its own
 * flock within a radius and a cone about its heading, one radius and one cone for each of three
 * rules (Reynolds 1987, "Flocks, herds, and schools"), anything solid that it would hit within a
 * horizon, and nothing else. What the rules ask for is negotiated into one acceleration, limited in
 * size. All boids decide from the same old state. SI units. Floor 4.
 */
#ifndef JOSTLE_FLOCK_H
#define JOSTLE_FLOCK_H

#include <jostle/components.h>

#ifdef __cplusplus
extern "C" {
#endif

struct jsl_world;

/* A flock; all zero is the null handle. */
typedef struct jsl_flock {
    jsl_entity entity;
} jsl_flock;

/* One rule: who counts, and how much. */
typedef struct jsl_flock_rule {
    jsl_real radius;     /* m, [0, 1e9]; 0: the rule is off */
    jsl_real half_angle; /* rad, [0, pi]: half the opening angle of the view cone; 0: all round */
    jsl_real weight;     /* [0, 1e9], see jsl_flock_response; 0: off */
} jsl_flock_rule;

/* How five requests become one acceleration. */
typedef enum jsl_flock_negotiation {
    /* The budget max_accel is given out in the order avoidance (with containment), separation,
     * alignment, cohesion, migration (with following): each request gets what it asks for while the
     * sum of lengths is within the budget, the first that does not fit is shortened, the rest get
     * nothing (Reynolds 1987). */
    JSL_FLOCK_PRIORITY,
    /* The sum of all requests, shortened to max_accel. */
    JSL_FLOCK_BLEND,
    JSL_FLOCK_NEGOTIATION_COUNT
} jsl_flock_negotiation;

/* What a rule asks for. d: offset to a neighbour, h: unit heading, v: velocity, w: weight, n:
 * neighbours of that rule. */
typedef enum jsl_flock_response {
    /* w (m/s^2) times a unit vector along -sum d/|d|^2, mean h - own h, mean d (OpenSteer). */
    JSL_FLOCK_DIRECTION,
    /* -w sum d/|d|^2 (w in m^2/s^2), w (mean v - own v) (1/s), w mean d (1/s^2). */
    JSL_FLOCK_MEAN,
    /* As before with sums instead of means: with equal weights, all-round view and nobody clamped
     * the flock keeps its momentum. */
    JSL_FLOCK_SUM,
    JSL_FLOCK_RESPONSE_COUNT
} jsl_flock_response;

#define JSL_FLOCK_MAX_PERIOD 64 /* steps */
#define JSL_FLOCK_MAX_WAYPOINTS 32

/* Settings. A zeroed desc is valid. When the three rules are all zero they become the rule set of
 * OpenSteer's boids: separation 5 m, cos -0.707, 12; alignment 7.5 m, cos 0.7, 8; cohesion 9 m, cos
 * -0.15, 8 (weights in m/s^2, for JSL_FLOCK_DIRECTION). */
typedef struct jsl_flock_desc {
    jsl_flock_rule separation, alignment, cohesion;
    jsl_real near_distance; /* m: nearer boids count for every rule that is on, even unseen; 0: 1.5
                               with the default rules, else none */
    jsl_real max_speed;     /* m/s; 0: 9 */
    jsl_real
        min_speed; /* m/s, <= max_speed; a boid at rest stays at rest until something pushes it */
    jsl_real max_accel; /* m/s^2, the budget; 0: 36, which leaves 8 when the default rules ask for
                           their most */
    jsl_flock_negotiation negotiation;
    jsl_flock_response response;
    int period;    /* decide every period-th step, staggered over boids; 0: 1 */
    jsl_vec3 urge; /* m/s^2: the migratory urge, the same for every boid */
    bool ignore_obstacles;
    jsl_real avoid_horizon;        /* s: react to hits sooner than this; 0: 2 */
    jsl_real avoid_margin;         /* m: room to leave beside an obstacle; 0: 0.5 */
    jsl_real boid_radius;          /* m: a boid's own size */
    jsl_vec3 bounds_lo, bounds_hi; /* m: containment box; equal: none */
    jsl_real bounds_weight;        /* 1/s^2: pull back inside, per metre outside; 0: 4 */
    jsl_real leader_weight; /* 1/s: how firmly boids follow a leader, if there is one; 0: 1 */
    jsl_real leader_gap;    /* m: they aim this far behind it */
} jsl_flock_desc;

/* A flock with these settings. JSL_ERR_ARGUMENT or JSL_ERR_NOT_FINITE with the field's name in the
 * log. */
JSL_API jsl_result jsl_flock_create(struct jsl_world *world, const jsl_flock_desc *desc,
                                    jsl_flock *out);
/* Its boids fly straight on from then on, and may be given another flock by writing boid.flock. */
JSL_API jsl_result jsl_flock_destroy(struct jsl_world *world, jsl_flock flock);
/* Replaces the settings; leader and path stay. */
JSL_API jsl_result jsl_flock_set(struct jsl_world *world, jsl_flock flock,
                                 const jsl_flock_desc *desc);
/* The settings in force, defaults filled in. */
JSL_API jsl_result jsl_flock_get(struct jsl_world *world, jsl_flock flock, jsl_flock_desc *out);

/* The closed path of the leader: count waypoints (3 .. JSL_FLOCK_MAX_WAYPOINTS, neighbours
 * distinct) joined by a uniform Catmull-Rom spline (Catmull and Rom 1974) and run through at
 * `speed` m/s (> 0), starting at the first. count 0 takes the path away. */
JSL_API jsl_result jsl_flock_set_path(struct jsl_world *world, jsl_flock flock,
                                      const jsl_vec3 *waypoints, int count, jsl_real speed);
/* Makes a boid of the flock its leader (the null entity: none). With a path the leader runs along
 * it from the next step on, placed on it whatever its position was; without one it flies by the
 * rules. The others follow. */
JSL_API jsl_result jsl_flock_set_leader(struct jsl_world *world, jsl_flock flock, jsl_entity boid);

/* Where new boids start: uniformly in a ball (radius > 0) or a box (half), at the mean velocity
 * plus a uniform point of a ball of radius `velocity_spread`. Random numbers are keyed by the
 * world's seed and the entity. */
typedef struct jsl_boid_spawn {
    jsl_vec3 centre;          /* m */
    jsl_real radius;          /* m; 0: the box counts */
    jsl_vec3 half;            /* m, half extents, >= 0 */
    jsl_vec3 velocity;        /* m/s, mean */
    jsl_real velocity_spread; /* m/s, >= 0 */
} jsl_boid_spawn;

/* count boids of the flock, their handles in out[0..count) unless null. All or nothing. */
JSL_API jsl_result jsl_boid_create_n(struct jsl_world *world, jsl_flock flock, int64_t count,
                                     const jsl_boid_spawn *spawn, jsl_entity *out);

/* -- Components -----------------------------------------------------------------------------------
 */

/* The settings as they are kept (component `flock`): cosines instead of angles; -2 stands for all
 * round. Written freely between steps; a flock with values out of range is warned of (BAD_STATE)
 * and its boids fly straight on. */
#define JSL_FLOCK_FIELDS(X)                                                                        \
    X(real, separation_radius, "m", JSL_STATE)                                                     \
    X(real, separation_cos, "1", JSL_STATE)                                                        \
    X(real, separation_weight, "", JSL_STATE)                                                      \
    X(real, alignment_radius, "m", JSL_STATE)                                                      \
    X(real, alignment_cos, "1", JSL_STATE)                                                         \
    X(real, alignment_weight, "", JSL_STATE)                                                       \
    X(real, cohesion_radius, "m", JSL_STATE)                                                       \
    X(real, cohesion_cos, "1", JSL_STATE)                                                          \
    X(real, cohesion_weight, "", JSL_STATE)                                                        \
    X(real, near_distance, "m", JSL_STATE)                                                         \
    X(real, max_speed, "m/s", JSL_STATE)                                                           \
    X(real, min_speed, "m/s", JSL_STATE)                                                           \
    X(real, max_accel, "m/s^2", JSL_STATE)                                                         \
    X(u32, negotiation, "", JSL_STATE)                                                             \
    X(u32, response, "", JSL_STATE)                                                                \
    X(u32, period, "1", JSL_STATE)                                                                 \
    X(u32, flock_flags, "", JSL_STATE)                                                             \
    X(real, urge_x, "m/s^2", JSL_STATE)                                                            \
    X(real, urge_y, "m/s^2", JSL_STATE)                                                            \
    X(real, urge_z, "m/s^2", JSL_STATE)                                                            \
    X(real, avoid_horizon, "s", JSL_STATE)                                                         \
    X(real, avoid_margin, "m", JSL_STATE)                                                          \
    X(real, boid_radius, "m", JSL_STATE)                                                           \
    X(real, lo_x, "m", JSL_STATE)                                                                  \
    X(real, lo_y, "m", JSL_STATE)                                                                  \
    X(real, lo_z, "m", JSL_STATE)                                                                  \
    X(real, hi_x, "m", JSL_STATE)                                                                  \
    X(real, hi_y, "m", JSL_STATE)                                                                  \
    X(real, hi_z, "m", JSL_STATE)                                                                  \
    X(real, bounds_weight, "1/s^2", JSL_STATE)                                                     \
    X(entity, leader, "", JSL_STATE)                                                               \
    X(real, leader_weight, "1/s", JSL_STATE)                                                       \
    X(real, leader_gap, "m", JSL_STATE)                                                            \
    X(real, leader_speed, "m/s", JSL_STATE)                                                        \
    X(real, path_at, "1", JSL_STATE)

#define JSL_FLOCK_IGNORES_OBSTACLES 1u /* in flock_flags */
#define JSL_FLOCK_HAS_BOUNDS 2u

/* path_at of `flock` counts waypoints: 2.5 is halfway from waypoint 2 to 3. Waypoints 0..15 are in
 * `flock_path`, 16..31 in `flock_path_rest`, which only flocks with that many have. */
#define JSL_FLOCK_POINT_(X, i)                                                                     \
    X(real, x##i, "m", JSL_STATE)                                                                  \
    X(real, y##i, "m", JSL_STATE)                                                                  \
    X(real, z##i, "m", JSL_STATE)
#define JSL_FLOCK_PATH_FIELDS(X)                                                                   \
    X(u32, waypoints, "1", JSL_STATE)                                                              \
    JSL_FLOCK_POINT_(X, 0)                                                                         \
    JSL_FLOCK_POINT_(X, 1)                                                                         \
    JSL_FLOCK_POINT_(X, 2)                                                                         \
    JSL_FLOCK_POINT_(X, 3)                                                                         \
    JSL_FLOCK_POINT_(X, 4)                                                                         \
    JSL_FLOCK_POINT_(X, 5)                                                                         \
    JSL_FLOCK_POINT_(X, 6)                                                                         \
    JSL_FLOCK_POINT_(X, 7)                                                                         \
    JSL_FLOCK_POINT_(X, 8)                                                                         \
    JSL_FLOCK_POINT_(X, 9)                                                                         \
    JSL_FLOCK_POINT_(X, 10)                                                                        \
    JSL_FLOCK_POINT_(X, 11)                                                                        \
    JSL_FLOCK_POINT_(X, 12)                                                                        \
    JSL_FLOCK_POINT_(X, 13)                                                                        \
    JSL_FLOCK_POINT_(X, 14)                                                                        \
    JSL_FLOCK_POINT_(X, 15)
#define JSL_FLOCK_PATH_REST_FIELDS(X)                                                              \
    JSL_FLOCK_POINT_(X, 16)                                                                        \
    JSL_FLOCK_POINT_(X, 17)                                                                        \
    JSL_FLOCK_POINT_(X, 18)                                                                        \
    JSL_FLOCK_POINT_(X, 19)                                                                        \
    JSL_FLOCK_POINT_(X, 20)                                                                        \
    JSL_FLOCK_POINT_(X, 21)                                                                        \
    JSL_FLOCK_POINT_(X, 22)                                                                        \
    JSL_FLOCK_POINT_(X, 23)                                                                        \
    JSL_FLOCK_POINT_(X, 24)                                                                        \
    JSL_FLOCK_POINT_(X, 25)                                                                        \
    JSL_FLOCK_POINT_(X, 26)                                                                        \
    JSL_FLOCK_POINT_(X, 27)                                                                        \
    JSL_FLOCK_POINT_(X, 28)                                                                        \
    JSL_FLOCK_POINT_(X, 29)                                                                        \
    JSL_FLOCK_POINT_(X, 30)                                                                        \
    JSL_FLOCK_POINT_(X, 31)

JSL_COMPONENT_COLUMNS(jsl_flock, JSL_FLOCK_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_flock_path, JSL_FLOCK_PATH_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_flock_path_rest, JSL_FLOCK_PATH_REST_FIELDS)

#ifdef __cplusplus
}
#endif
#endif
