/* SPDX-License-Identifier: MIT
 * jostle/body.h - rigid bodies: creation, state, forces, contacts, energy and momentum.
 *
 * A body is an entity with position, orientation, collider and body; a dynamic or kinematic one
 * also has velocity, spin and mass. A body's frame has its origin in the centre of mass and its
 * axes along the principal axes. Contacts are solved by soft constraints over sub-steps (Catto,
 * "Solver2D", 2024). All quantities are SI. Floor 4.
 */
#ifndef JOSTLE_BODY_H
#define JOSTLE_BODY_H

#include <jostle/base.h>
#include <jostle/ecs.h>
#include <jostle/math.h>
#include <jostle/shape.h>

#ifdef __cplusplus
extern "C" {
#endif

struct jsl_world;

/* A body: an entity with the component "body". */
typedef struct jsl_body {
    jsl_entity entity;
} jsl_body;

typedef enum jsl_body_kind {
    JSL_BODY_DYNAMIC,   /* moved by forces and contacts */
    JSL_BODY_STATIC,    /* never moves */
    JSL_BODY_KINEMATIC, /* moves with the velocity and spin it was given, whatever it meets */
    JSL_BODY_KIND_COUNT
} jsl_body_kind;

/* Bits of the field body_flags. */
#define JSL_BODY_FROZEN                                                                            \
    1u /* its state became non-finite: it stands still until its pose or velocity is set */

#define JSL_DENSITY_DEFAULT 1000 /* kg/m^3 */

/* All zero but the shape: a dynamic body of density 1000 kg/m^3 at rest at the origin, not turned.
 */
typedef struct jsl_body_desc {
    jsl_shape shape;       /* null: meets nothing; then mass and inertia must be given (dynamic) */
    jsl_material material; /* null: friction 0.6, restitution 0 */
    jsl_body_kind kind;
    jsl_vec3 position;    /* m */
    jsl_quat orientation; /* zero: the identity; else normalised, its length within 1 % of 1 */
    jsl_vec3 velocity;    /* m/s, must be 0 for a static body */
    jsl_vec3 spin;        /* rad/s, world frame, likewise */
    jsl_real mass;        /* kg, > 0; 0: from density; dynamic bodies only */
    jsl_real density;     /* kg/m^3, > 0; 0: 1000. Not together with mass */
    jsl_vec3
        inertia;   /* kg m^2, principal; zero: of the homogeneous shape. i + j >= k for all three */
    uint32_t rgba; /* 0xRRGGBBAA, 0: 0xb0b0b0ff; given to the world's look component by the world */
    bool no_gravity;        /* true: gravity does not act; gravity_scale must be 0 */
    jsl_real gravity_scale; /* 0: 1 */
    jsl_real linear_damping, angular_damping; /* 1/s, >= 0: v' = -c v */
    uint32_t category, mask;                  /* 0: category 1 and all bits */
} jsl_body_desc;

JSL_API jsl_result jsl_body_create(struct jsl_world *world, const jsl_body_desc *desc,
                                   jsl_body *out);
/* count bodies from as many descs, all or nothing; out may be null. */
JSL_API jsl_result jsl_body_create_n(struct jsl_world *world, const jsl_body_desc *desc,
                                     int64_t count, jsl_body *out);
JSL_API jsl_result jsl_body_destroy(struct jsl_world *world, jsl_body body);

/* What a body is doing. */
typedef struct jsl_body_state {
    jsl_body_kind kind;
    jsl_pose pose;
    jsl_vec3 velocity, spin; /* 0 for a static body */
    jsl_real mass;           /* kg; 0: immovable */
    jsl_vec3 inertia;        /* kg m^2, principal; 0: cannot be turned */
    uint32_t flags;          /* JSL_BODY_* */
} jsl_body_state;
JSL_API jsl_result jsl_body_get(struct jsl_world *world, jsl_body body, jsl_body_state *out);
/* Puts the body elsewhere. The orientation as in the desc. Also thaws a frozen body. */
JSL_API jsl_result jsl_body_set_pose(struct jsl_world *world, jsl_body body, jsl_pose pose);
/* JSL_ERR_STATE for a static body. */
JSL_API jsl_result jsl_body_set_velocity(struct jsl_world *world, jsl_body body, jsl_vec3 velocity,
                                         jsl_vec3 spin);
/* Added to what acts during the next step (N, N m; world frame, about the centre of mass);
 * JSL_ERR_STATE unless dynamic. */
JSL_API jsl_result jsl_body_add_force(struct jsl_world *world, jsl_body body, jsl_vec3 force);
JSL_API jsl_result jsl_body_add_torque(struct jsl_world *world, jsl_body body, jsl_vec3 torque);
/* A force at a world point. */
JSL_API jsl_result jsl_body_add_force_at(struct jsl_world *world, jsl_body body, jsl_vec3 force,
                                         jsl_vec3 point);
/* Changes velocity and spin at once: an impulse (N s) at a world point. */
JSL_API jsl_result jsl_body_apply_impulse(struct jsl_world *world, jsl_body body, jsl_vec3 impulse,
                                          jsl_vec3 point);

/* -- Settings -------------------------------------------------------------------------------- */

/* How anisotropic bodies turn. Bodies with three equal moments turn exactly in either. */
typedef enum jsl_rotation {
    /* Implicit gyroscopic torque, one Newton step (Catto, GDC 2015): stable, first order, loses
       energy. */
    JSL_ROTATION_IMPLICIT,
    /* Kick, three axis rotations, kick (Touma and Wisdom 1994; McLachlan and Reich): second order,
     * reversible, keeps the angular momentum to rounding and the energy bounded. About 0.3
     * microseconds a body and sub-step. */
    JSL_ROTATION_SPLITTING,
    /* The spin stays as it is: wrong but for isotropic bodies, and cheapest. */
    JSL_ROTATION_NONE,
    JSL_ROTATION_COUNT
} jsl_rotation;

/* Zero in any field means the default in brackets. */
typedef struct jsl_rigid_settings {
    jsl_rotation rotation;
    jsl_real contact_hertz; /* stiffness of contacts between bodies [30]; twice that against the
                               immovable. Clamped to 1/(8 h) */
    jsl_real damping_ratio; /* of contacts between bodies [10]; half that against the immovable */
    jsl_real push_speed;    /* m/s: overlap is pushed out no faster [3] */
    jsl_real restitution_threshold; /* m/s: slower approaches do not bounce [2 |g| h; negative: 0,
                                       all bounce] */
    jsl_real margin; /* contacts form at this share of the smaller bounding radius [0.05] */
    jsl_real keep;   /* a manifold is kept while the pair moved less than this share of the margin
                        relative to one another [1; negative: never kept] */
    jsl_real max_speed; /* m/s: faster bodies are slowed, with a warning [no limit] */
} jsl_rigid_settings;

/* JSL_ERR_NOT_FINITE, JSL_ERR_ARGUMENT (a negative rate, an unknown rotation). */
JSL_API jsl_result jsl_rigid_set(struct jsl_world *world, const jsl_rigid_settings *settings);
JSL_API jsl_result jsl_rigid_get(struct jsl_world *world, jsl_rigid_settings *out);

/* -- Contacts -------------------------------------------------------------------------------- */

typedef enum jsl_contact_phase {
    JSL_CONTACT_BEGIN,
    JSL_CONTACT_PERSIST,
    JSL_CONTACT_END /* no longer touching; only entities and phase are set */
} jsl_contact_phase;

/* Two solids that touched during the last step. */
typedef struct jsl_contact {
    jsl_entity a, b;          /* a before b by entity id */
    jsl_vec3 point;           /* m, mean of the manifold's points */
    jsl_vec3 normal;          /* unit, from a to b */
    jsl_real depth;           /* m, deepest point; negative when apart */
    jsl_real normal_impulse;  /* N s over the step, >= 0 */
    jsl_vec3 tangent_impulse; /* N s over the step, on b */
    int32_t points;           /* in the manifold, 1..4 */
    jsl_contact_phase phase;
} jsl_contact;

/* The table of the last step in order of (a, b), ended contacts last; valid until the next step or
 * structural change. */
JSL_API jsl_result jsl_rigid_contacts(struct jsl_world *world, const jsl_contact **out,
                                      int64_t *count);

/* -- Diagnostics ----------------------------------------------------------------------------- */

/* Sums over dynamic bodies in order of entity id, compensated (Neumaier 1974), in double. */
typedef struct jsl_rigid_measure {
    int64_t bodies;             /* dynamic */
    double mass;                /* kg */
    double kinetic, potential;  /* J; potential = - sum m scale g.x */
    double momentum[3];         /* kg m/s */
    double angular_momentum[3]; /* kg m^2/s, about the origin */
    double centre_of_mass[3];   /* m */
    double max_speed;           /* m/s */
    double max_penetration;     /* m, of the contacts of the last step */
    int64_t pairs;              /* kept by the broad phase */
    int64_t manifolds;          /* with at least one point */
    int64_t touching;
    int64_t rebuilt;  /* manifolds that the narrow phase computed anew in the last step */
    int32_t colours;  /* of the last step's graph */
    int64_t overflow; /* manifolds beyond the colours, solved one after the other */
} jsl_rigid_measure;
JSL_API jsl_result jsl_rigid_diagnose(struct jsl_world *world, jsl_rigid_measure *out);

#ifdef __cplusplus
}
#endif
#endif
