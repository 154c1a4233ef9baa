/* SPDX-License-Identifier: MIT
 * The rigid room: bodies, their contacts, and how they respond. Floor 4.
 *
 * Functions mirror those of jostle/body.h with the room instead of the world. The world resolves
 * shape and material handles and hands the shape by value; friction and restitution reach the room
 * through the collider set.
 */
#ifndef JSL_RIGID_RIGID_H
#define JSL_RIGID_RIGID_H

#include "base/base.h"
#include <jostle/body.h>
#include <jostle/components.h>
#include <jostle/shape.h>

typedef struct jsl_rigid_room jsl_rigid_room;

/* Registers the shared components, "body", and two whole systems: "rigid_detect" (detect, 100) and
 * "rigid_respond" (respond, 100). Needs context->colliders from the INDEX stage (null: nothing is
 * solid). */
jsl_result jsl_rigid_room_create(jsl_ecs *ecs, jsl_rigid_room **out);
void jsl_rigid_room_destroy(jsl_rigid_room *room);

/* desc->shape is a handle that the room only stores; shape is its value, null when desc->shape is
 * null. */
typedef struct jsl_rigid_body_desc {
    jsl_body_desc body;
    const jsl_shape_desc *shape;
} jsl_rigid_body_desc;
jsl_result jsl_rigid_body_create(jsl_rigid_room *room, const jsl_rigid_body_desc *desc,
                                 jsl_body *out);
jsl_result jsl_rigid_body_create_n(jsl_rigid_room *room, const jsl_rigid_body_desc *desc,
                                   int64_t count, jsl_body *out);
jsl_result jsl_rigid_body_destroy(jsl_rigid_room *room, jsl_body body);
jsl_result jsl_rigid_body_get(jsl_rigid_room *room, jsl_body body, jsl_body_state *out);
jsl_result jsl_rigid_body_set_pose(jsl_rigid_room *room, jsl_body body, jsl_pose pose);
jsl_result jsl_rigid_body_set_velocity(jsl_rigid_room *room, jsl_body body, jsl_vec3 velocity,
                                       jsl_vec3 spin);
jsl_result jsl_rigid_body_add_force(jsl_rigid_room *room, jsl_body body, jsl_vec3 force);
jsl_result jsl_rigid_body_add_torque(jsl_rigid_room *room, jsl_body body, jsl_vec3 torque);
jsl_result jsl_rigid_body_add_force_at(jsl_rigid_room *room, jsl_body body, jsl_vec3 force,
                                       jsl_vec3 point);
jsl_result jsl_rigid_body_apply_impulse(jsl_rigid_room *room, jsl_body body, jsl_vec3 impulse,
                                        jsl_vec3 point);

jsl_result jsl_rigid_room_set(jsl_rigid_room *room, const jsl_rigid_settings *settings);
void jsl_rigid_room_get(const jsl_rigid_room *room, jsl_rigid_settings *out);

jsl_result jsl_rigid_room_contacts(jsl_rigid_room *room, const jsl_contact **out, int64_t *count);
jsl_result jsl_rigid_room_measure(jsl_rigid_room *room, jsl_vec3 gravity, jsl_rigid_measure *out);

/* The contact cache and the settings: what a restored world needs to go on as if it had never
 * stopped. The image is little-endian and holds doubles, so both precisions read both. Hash: of the
 * same data. */
size_t jsl_rigid_room_save_size(const jsl_rigid_room *room);
jsl_result jsl_rigid_room_save(const jsl_rigid_room *room, void *bytes, size_t size);
jsl_result jsl_rigid_room_restore(jsl_rigid_room *room, const void *bytes, size_t size);
uint64_t jsl_rigid_room_hash(const jsl_rigid_room *room);

/* Seconds spent in each phase since the last call with reset. */
typedef struct jsl_rigid_profile {
    double pairs, narrow, colour, gather, prepare, solve, finish;
    int64_t steps;
} jsl_rigid_profile;
jsl_rigid_profile jsl_rigid_room_profile(jsl_rigid_room *room, bool reset);

/* The lecture's impulse of two bodies that meet in one point without friction (Witkin and Baraff,
 * "Physically based modeling", SIGGRAPH 1997): j = -(1 + e) vn / (1/ma + 1/mb + n.((Ia^-1 (ra x n))
 * x ra + (Ib^-1 (rb x n)) x rb)), n from B to A, vn the speed of A's point relative to B's along n.
 * Applies +j n to A and -j n to B; returns j, 0 when they separate. */
typedef struct jsl_impulse_body {
    jsl_vec3 position, velocity, spin; /* world */
    jsl_quat orientation;
    jsl_real inv_mass;
    jsl_vec3 inv_inertia; /* principal */
} jsl_impulse_body;
jsl_real jsl_impulse_two_bodies(jsl_impulse_body *a, jsl_impulse_body *b, jsl_vec3 point,
                                jsl_vec3 normal, jsl_real restitution);

#endif
