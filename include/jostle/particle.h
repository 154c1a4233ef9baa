/* SPDX-License-Identifier: MIT
 * jostle/particle.h - emitters and the particles they give birth to.
 *
 * An emitter is an entity with `emitter`, `position`, `orientation` and `velocity`; make one, or
 * turn an entity that moves already into one. A particle is an entity with `position`, `velocity`
 * and `particle`: the rows of a query for these. Particles do not see one another (the classic
 * assumption of particle systems); they feel gravity, wind and linear drag, and bounce off
 * everything that has a collider. Within a step: MOVE ages and moves particles, RETIRE removes the
 * dead and adds those born during the step, each moved by its own age, so that what can be seen
 * after a step is the state at the end of that step.
 *
 * Sources: Reeves, "Particle systems - a technique for modeling a class of fuzzy objects", 1983
 * (births, attributes as mean + rand * range); Hochbruck and Ostermann, "Exponential integrators",
 * 2010. Floor 4.
 */
#ifndef JOSTLE_PARTICLE_H
#define JOSTLE_PARTICLE_H

#include <jostle/components.h>

#ifdef __cplusplus
extern "C" {
#endif

struct jsl_world;

typedef struct jsl_emitter {
    jsl_entity entity;
} jsl_emitter;

/* X(CODE, text): how births are counted. The text is what scene files say. */
#define JSL_EMIT_MODES(X)                                                                          \
    X(STEADY, "steady")   /* evenly spaced in time, the fraction carried */                        \
    X(REEVES, "reeves")   /* rate + U(-1,1) rate_range, drawn anew every rate_frame */             \
    X(POISSON, "poisson") /* independent births: exponential gaps of mean 1/rate */                \
    X(REFILL, "refill")   /* as many births as deaths: max_particles are kept alive */
typedef enum jsl_emit_mode {
#define JSL_X(code, text) JSL_EMIT_##code,
    JSL_EMIT_MODES(JSL_X)
#undef JSL_X
        JSL_EMIT_MODE_COUNT
} jsl_emit_mode;

/* X(CODE, text): where births happen, in the emitter's frame, uniformly in length, area or volume.
 */
#define JSL_EMITTER_SHAPES(X)                                                                      \
    X(POINT, "point")   /* the origin */                                                           \
    X(LINE, "line")     /* extent.x is half its length along x */                                  \
    X(DISC, "disc")     /* extent.x is its radius, in the plane z = 0 */                           \
    X(SPHERE, "sphere") /* extent.x is the radius of the ball */                                   \
    X(SHELL, "shell")   /* extent.x is the radius of the surface */                                \
    X(BOX, "box")       /* extent holds the half sides */
typedef enum jsl_emitter_shape {
#define JSL_X(code, text) JSL_EMITTER_##code,
    JSL_EMITTER_SHAPES(JSL_X)
#undef JSL_X
        JSL_EMITTER_SHAPE_COUNT
} jsl_emitter_shape;

/* X(CODE, text): one step of v' = g + k (w - v), x' = v. This law is linear, so a step of each of
 * these is an affine map whose few coefficients are worked out once a step: all cost the same. */
#define JSL_PARTICLE_INTEGRATORS(X)                                                                \
    X(EXPONENTIAL, "exponential")     /* exact while the wind is constant, stable for any drag */  \
    X(SEMI_IMPLICIT, "semi_implicit") /* first order; unstable for drag * h > 2 */                 \
    X(EXPLICIT, "explicit")           /* Euler, first order; for comparison */                     \
    X(VERLET, "verlet")               /* second order */                                           \
    X(RK4, "rk4")                     /* fourth order */
typedef enum jsl_particle_integrator {
#define JSL_X(code, text) JSL_PARTICLE_##code,
    JSL_PARTICLE_INTEGRATORS(JSL_X)
#undef JSL_X
        JSL_PARTICLE_INTEGRATOR_COUNT
} jsl_particle_integrator;

/* The texts above; null when out of range. */
JSL_API const char *jsl_emit_mode_text(jsl_emit_mode mode);
JSL_API const char *jsl_emitter_shape_text(jsl_emitter_shape shape);
JSL_API const char *jsl_particle_integrator_text(jsl_particle_integrator integrator);

/* How a particle looks when `at` of its life (0..1) has passed; linear between keys. */
typedef struct jsl_particle_key {
    jsl_real at;
    uint32_t rgba;       /* 0xRRGGBBAA, straight alpha */
    jsl_real size_scale; /* factor on the size it was born with */
} jsl_particle_key;

#define JSL_PARTICLE_KEYS 8 /* at most */

/* A zeroed desc is valid: a point that emits nothing until told to, specks that fall and never die.
 * `x` and `x_range` give each particle x + U(-1,1) x_range. */
typedef struct jsl_emitter_desc {
    /* Where: of the new entity; ignored by jsl_emitter_add. */
    jsl_vec3 position;    /* m */
    jsl_quat orientation; /* zero: identity */
    jsl_vec3 velocity;    /* m/s */
    jsl_emitter_shape shape;
    jsl_vec3 extent; /* m, >= 0, see the shapes */

    /* How many. */
    jsl_emit_mode mode;
    jsl_real rate;         /* births per second, >= 0 */
    jsl_real rate_range;   /* REEVES; >= 0, may exceed rate: a negative count is owed, not lost, so
                              the mean stays rate */
    jsl_real rate_frame;   /* s, > 0; REEVES: how long one draw holds, whatever the step; 0: 1/24 (a
                              frame of film) */
    int64_t max_particles; /* alive at once, >= 0; 0: 1 000 000. Births beyond it are dropped and
                              warned of (not by REFILL) */

    /* How they leave. */
    jsl_vec3 direction; /* axis of the cone, in the emitter's frame, any length; zero: (0,0,1) */
    jsl_real cone;      /* rad, half angle, 0..pi: directions are uniform in the solid angle */
    jsl_real speed, speed_range; /* m/s */
    jsl_real inherit;            /* share of the emitter's own velocity, 0..1 */

    /* What they are. */
    jsl_real life, life_range; /* s, >= 0; life 0: they never die and do not age. A draw below 1 ms
                                  becomes 1 ms */
    jsl_real size, size_range; /* m, radius; size 0: 0.05. A negative draw becomes 0 */

    /* How they move. */
    jsl_particle_integrator integrator;
    jsl_real buoyancy; /* share of the weight that the air carries: 0 falls, 1 floats, 2 rises as
                          fast as it would fall */
    jsl_real drag;     /* 1/s, >= 0, k of v' = k (w - v) */
    jsl_real wind;     /* share of the wind that it feels, 0..1; needs drag */

    /* How they bounce: v' = v - (1+e)(v.N)N relative to the surface. */
    jsl_real restitution; /* e, 0..1 */
    jsl_real friction;    /* Coulomb's coefficient, >= 0 */
    jsl_real
        contact_size;  /* radius in collisions as a share of `size`, 0..1; 0: the centre collides */
    uint32_t category; /* as in `collider`; 0: 1 */
    uint32_t mask;     /* 0: collides with every category */
    bool ghost;        /* collides with nothing */

    /* Where they end: outside of this box they are removed (it has no effect while lo equals hi).
     */
    jsl_aabb bounds; /* m, world */

    /* How they look; key_count 0: white, opaque, constant. */
    int key_count; /* 0..JSL_PARTICLE_KEYS; at ascending in 0..1 */
    jsl_particle_key key[JSL_PARTICLE_KEYS];
    bool additive; /* adds light instead of covering */
} jsl_emitter_desc;

/* Errors of these: JSL_ERR_NOT_FINITE or JSL_ERR_ARGUMENT (the message names the field),
 * JSL_ERR_HANDLE, JSL_ERR_MEMORY. */
JSL_API jsl_result jsl_emitter_create(struct jsl_world *world, const jsl_emitter_desc *desc,
                                      jsl_emitter *out);
/* Gives an existing entity an emitter that rides on it; position, orientation and velocity are
 * added if it lacks them (at rest at the origin). JSL_ERR_STATE when it is one already. */
JSL_API jsl_result jsl_emitter_add(struct jsl_world *world, jsl_entity entity,
                                   const jsl_emitter_desc *desc, jsl_emitter *out);
/* Changes everything but where it is; particles alive follow the new desc (their life and size stay
 * as drawn). */
JSL_API jsl_result jsl_emitter_set(struct jsl_world *world, jsl_emitter emitter,
                                   const jsl_emitter_desc *desc);
/* The desc in force, defaults filled in, pose as of now. */
JSL_API jsl_result jsl_emitter_get(struct jsl_world *world, jsl_emitter emitter,
                                   jsl_emitter_desc *out);
/* Destroys the entity. Its particles go with it, at the end of the next step. To let them finish,
 * set the rate to 0 instead. */
JSL_API jsl_result jsl_emitter_destroy(struct jsl_world *world, jsl_emitter emitter);
/* A burst: n >= 0 births beside those of the rate, at the start of the coming step. JSL_ERR_LIMIT
 * when more than 2^40 are waiting. */
JSL_API jsl_result jsl_emit(struct jsl_world *world, jsl_emitter emitter, int64_t n);
/* Particles alive, as of the end of the last step. */
JSL_API jsl_result jsl_emitter_alive(struct jsl_world *world, jsl_emitter emitter, int64_t *out);

/* The look of the particles in rows (of any query that matches them): colour 0xRRGGBBAA and drawn
 * radius in m, rows->count of each; either may be null. Particles whose emitter is gone are white.
 * JSL_ERR_ARGUMENT when the rows are not of particles. */
JSL_API jsl_result jsl_particle_appearance(struct jsl_world *world, const jsl_rows *rows,
                                           uint32_t *rgba, float *size);

/* -- The component
 * ---------------------------------------------------------------------------------------- */

/* The desc as columns, and what the emitter remembers between steps. */
#define JSL_EMITTER_FIELDS(X)                                                                      \
    X(u8, emit_mode, "", JSL_STATE)                                                                \
    X(u8, emit_shape, "", JSL_STATE)                                                               \
    X(u8, integrator, "", JSL_STATE)                                                               \
    X(u8, emitter_flags, "", JSL_STATE)                                                            \
    X(real, extent_x, "m", JSL_STATE)                                                              \
    X(real, extent_y, "m", JSL_STATE)                                                              \
    X(real, extent_z, "m", JSL_STATE)                                                              \
    X(real, rate, "1/s", JSL_STATE)                                                                \
    X(real, rate_range, "1/s", JSL_STATE)                                                          \
    X(real, rate_frame, "s", JSL_STATE)                                                            \
    X(i64, max_particles, "1", JSL_STATE)                                                          \
    X(real, dir_x, "1", JSL_STATE)                                                                 \
    X(real, dir_y, "1", JSL_STATE)                                                                 \
    X(real, dir_z, "1", JSL_STATE)                                                                 \
    X(real, cone, "rad", JSL_STATE)                                                                \
    X(real, speed, "m/s", JSL_STATE)                                                               \
    X(real, speed_range, "m/s", JSL_STATE)                                                         \
    X(real, inherit, "1", JSL_STATE)                                                               \
    X(real, mean_life, "s", JSL_STATE)                                                             \
    X(real, life_range, "s", JSL_STATE)                                                            \
    X(real, mean_size, "m", JSL_STATE)                                                             \
    X(real, size_range, "m", JSL_STATE)                                                            \
    X(real, buoyancy, "1", JSL_STATE)                                                              \
    X(real, drag, "1/s", JSL_STATE)                                                                \
    X(real, wind_share, "1", JSL_STATE)                                                            \
    X(real, restitution, "1", JSL_STATE)                                                           \
    X(real, friction, "1", JSL_STATE)                                                              \
    X(real, contact_size, "1", JSL_STATE)                                                          \
    X(u32, category, "", JSL_STATE)                                                                \
    X(u32, mask, "", JSL_STATE)                                                                    \
    X(real, lo_x, "m", JSL_STATE)                                                                  \
    X(real, lo_y, "m", JSL_STATE)                                                                  \
    X(real, lo_z, "m", JSL_STATE)                                                                  \
    X(real, hi_x, "m", JSL_STATE)                                                                  \
    X(real, hi_y, "m", JSL_STATE)                                                                  \
    X(real, hi_z, "m", JSL_STATE)                                                                  \
    X(f64, carry, "1", JSL_CACHE)   /* births owed, less than one; may be negative */              \
    X(u64, serial, "1", JSL_CACHE)  /* births so far */                                            \
    X(u64, waiting, "1", JSL_CACHE) /* bursts asked for */                                         \
    X(real, was_px, "m", JSL_CACHE) /* pose at the end of the last step */                         \
    X(real, was_py, "m", JSL_CACHE)                                                                \
    X(real, was_pz, "m", JSL_CACHE)                                                                \
    X(real, was_qx, "1", JSL_CACHE)                                                                \
    X(real, was_qy, "1", JSL_CACHE)                                                                \
    X(real, was_qz, "1", JSL_CACHE)                                                                \
    X(real, was_qw, "1", JSL_CACHE)                                                                \
    X(u64, alive, "1", JSL_CACHE)

#define JSL_EMITTER_ADDITIVE 1u
#define JSL_EMITTER_GHOST 2u

JSL_COMPONENT_COLUMNS(jsl_emitter, JSL_EMITTER_FIELDS)

/* The keys of an emitter that has any, a component of its own. */
#define JSL_EMITTER_LOOK_KEY_(X, i)                                                                \
    X(real, at##i, "1", JSL_STATE)                                                                 \
    X(u32, rgba##i, "", JSL_STATE)                                                                 \
    X(real, scale##i, "1", JSL_STATE)
#define JSL_EMITTER_LOOK_FIELDS(X)                                                                 \
    X(u32, key_count, "1", JSL_STATE)                                                              \
    JSL_EMITTER_LOOK_KEY_(X, 0)                                                                    \
    JSL_EMITTER_LOOK_KEY_(X, 1)                                                                    \
    JSL_EMITTER_LOOK_KEY_(X, 2)                                                                    \
    JSL_EMITTER_LOOK_KEY_(X, 3)                                                                    \
    JSL_EMITTER_LOOK_KEY_(X, 4)                                                                    \
    JSL_EMITTER_LOOK_KEY_(X, 5)                                                                    \
    JSL_EMITTER_LOOK_KEY_(X, 6)                                                                    \
    JSL_EMITTER_LOOK_KEY_(X, 7)

JSL_COMPONENT_COLUMNS(jsl_emitter_look, JSL_EMITTER_LOOK_FIELDS)

#ifdef __cplusplus
}
#endif
#endif
