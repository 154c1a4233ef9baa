/* SPDX-License-Identifier: MIT
 * jostle/components.h - the built-in components: every field, its unit and its role.
 *
 * Rows are X(type, name, unit, role). A world registers those shared by all kinds, and a kind's
 * own when it is first used. For each list NAME_FIELDS there is a struct jsl_NAME_columns of
 * pointers and jsl_NAME_of(rows, term), see ecs.h. Quaternions are (x,y,z,w), body to world.
 * Floor 2.
 */
#ifndef JOSTLE_COMPONENTS_H
#define JOSTLE_COMPONENTS_H

#include <jostle/ecs.h>

/* -- Shared by all kinds -------------------------------------------------------------------------
 */

#define JSL_POSITION_FIELDS(X)                                                                     \
    X(real, px, "m", JSL_STATE)                                                                    \
    X(real, py, "m", JSL_STATE)                                                                    \
    X(real, pz, "m", JSL_STATE)

#define JSL_ORIENTATION_FIELDS(X)                                                                  \
    X(real, qx, "1", JSL_STATE)                                                                    \
    X(real, qy, "1", JSL_STATE)                                                                    \
    X(real, qz, "1", JSL_STATE)                                                                    \
    X(real, qw, "1", JSL_STATE)

#define JSL_VELOCITY_FIELDS(X)                                                                     \
    X(real, vx, "m/s", JSL_STATE)                                                                  \
    X(real, vy, "m/s", JSL_STATE)                                                                  \
    X(real, vz, "m/s", JSL_STATE)

/* Angular velocity in the world frame. */
#define JSL_SPIN_FIELDS(X)                                                                         \
    X(real, wx, "rad/s", JSL_STATE)                                                                \
    X(real, wy, "rad/s", JSL_STATE)                                                                \
    X(real, wz, "rad/s", JSL_STATE)

/* Principal: the body frame's axes are the principal axes and its origin the centre of mass. An
 * inverse of 0 means immovable in that freedom. */
#define JSL_MASS_FIELDS(X)                                                                         \
    X(real, inv_mass, "1/kg", JSL_STATE)                                                           \
    X(real, inv_ixx, "1/(kg m^2)", JSL_STATE)                                                      \
    X(real, inv_iyy, "1/(kg m^2)", JSL_STATE)                                                      \
    X(real, inv_izz, "1/(kg m^2)", JSL_STATE)

/* Solid: shape and material are handles of the world. Two colliders meet when each one's category
 * is in the other's mask. */
#define JSL_COLLIDER_FIELDS(X)                                                                     \
    X(u32, shape, "", JSL_STATE)                                                                   \
    X(u32, material, "", JSL_STATE)                                                                \
    X(u32, category, "", JSL_STATE)                                                                \
    X(u32, mask, "", JSL_STATE)

/* How to draw it: 0xRRGGBBAA. */
#define JSL_LOOK_FIELDS(X) X(u32, rgba, "", JSL_STATE)

/* -- Particles
 * ------------------------------------------------------------------------------------- */

/* size is the radius of the drawn sprite; the emitter's contact_size says what share of it
 * collides. Colour, transparency and size over life come from the curves of the emitter that gave
 * birth. */
#define JSL_PARTICLE_FIELDS(X)                                                                     \
    X(real, age, "s", JSL_STATE)                                                                   \
    X(real, life, "s", JSL_STATE)                                                                  \
    X(real, size, "m", JSL_STATE)                                                                  \
    X(entity, emitter, "", JSL_STATE)

/* -- Flocks
 * ------------------------------------------------------------------------------------------ */

/* (ax, ay, az) is the steering acceleration last decided; carried between decisions when perception
 * is staggered. */
#define JSL_BOID_FIELDS(X)                                                                         \
    X(entity, flock, "", JSL_STATE)                                                                \
    X(real, ax, "m/s^2", JSL_CACHE)                                                                \
    X(real, ay, "m/s^2", JSL_CACHE)                                                                \
    X(real, az, "m/s^2", JSL_CACHE)                                                                \
    X(u32, boid_flags, "", JSL_STATE)                                                              \
    X(u32, neighbours, "1", JSL_DERIVED)

/* A leader follows waypoints of its flock's path instead of the three rules. */
#define JSL_BOID_LEADER 1u

/* -- Rigid bodies
 * --------------------------------------------------------------------------------------- */

/* Force and torque (world frame, about the centre of mass) act during the next step and are then
 * cleared. */
#define JSL_BODY_FIELDS(X)                                                                         \
    X(u32, kind, "", JSL_STATE)                                                                    \
    X(u32, body_flags, "", JSL_STATE)                                                              \
    X(real, gravity_scale, "1", JSL_STATE)                                                         \
    X(real, linear_damping, "1/s", JSL_STATE)                                                      \
    X(real, angular_damping, "1/s", JSL_STATE)                                                     \
    X(real, fx, "N", JSL_STATE)                                                                    \
    X(real, fy, "N", JSL_STATE)                                                                    \
    X(real, fz, "N", JSL_STATE)                                                                    \
    X(real, tx, "N m", JSL_STATE)                                                                  \
    X(real, ty, "N m", JSL_STATE)                                                                  \
    X(real, tz, "N m", JSL_STATE)                                                                  \
    X(real, still_time, "s", JSL_CACHE)

/* -- Names
 * ---------------------------------------------------------------------------------------------- */

/* X(name): the components that the library registers itself. Every other one is its user's own. */
#define JSL_BUILT_IN_COMPONENTS(X)                                                                 \
    X(position)                                                                                    \
    X(orientation)                                                                                 \
    X(velocity)                                                                                    \
    X(spin)                                                                                        \
    X(mass)                                                                                        \
    X(collider)                                                                                    \
    X(look)                                                                                        \
    X(particle)                                                                                    \
    X(emitter)                                                                                     \
    X(emitter_look)                                                                                \
    X(boid)                                                                                        \
    X(flock)                                                                                       \
    X(flock_path)                                                                                  \
    X(flock_path_rest)                                                                             \
    X(body)

/* Whether it is one of these; null is not. */
#ifdef __cplusplus
extern "C" {
#endif
JSL_API bool jsl_component_is_built_in(const char *name);
#ifdef __cplusplus
}
#endif

/* -- Columns
 * ---------------------------------------------------------------------------------------------- */

JSL_COMPONENT_COLUMNS(jsl_position, JSL_POSITION_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_orientation, JSL_ORIENTATION_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_velocity, JSL_VELOCITY_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_spin, JSL_SPIN_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_mass, JSL_MASS_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_collider, JSL_COLLIDER_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_look, JSL_LOOK_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_particle, JSL_PARTICLE_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_boid, JSL_BOID_FIELDS)
JSL_COMPONENT_COLUMNS(jsl_body, JSL_BODY_FIELDS)

#endif
