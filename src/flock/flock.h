/* SPDX-License-Identifier: MIT
 * The flock room as the world sees it: what jostle/flock.h offers, with the room in place of the
 * world. Floor 4.
 */
#ifndef JSL_FLOCK_FLOCK_H
#define JSL_FLOCK_FLOCK_H

#include <jostle/flock.h>

typedef struct jsl_flock_room jsl_flock_room;

/* Registers position, velocity, boid, flock, flock_path, flock_path_rest and the systems
 * flock_index (INDEX 200), flock_steer (DECIDE 200), flock_lead (MOVE 200) and flock_move (MOVE
 * 210). Its memory is the ECS's. */
jsl_result jsl_flock_room_create(jsl_ecs *ecs, jsl_flock_room **out);
void jsl_flock_room_destroy(jsl_flock_room *room);

jsl_result jsl_flock_room_flock_create(jsl_flock_room *room, const jsl_flock_desc *desc,
                                       jsl_flock *out);
jsl_result jsl_flock_room_flock_destroy(jsl_flock_room *room, jsl_flock flock);
jsl_result jsl_flock_room_flock_set(jsl_flock_room *room, jsl_flock flock,
                                    const jsl_flock_desc *desc);
jsl_result jsl_flock_room_flock_get(jsl_flock_room *room, jsl_flock flock, jsl_flock_desc *out);
jsl_result jsl_flock_room_set_path(jsl_flock_room *room, jsl_flock flock, const jsl_vec3 *waypoints,
                                   int count, jsl_real speed);
jsl_result jsl_flock_room_set_leader(jsl_flock_room *room, jsl_flock flock, jsl_entity boid);
/* seed: the world's. */
jsl_result jsl_flock_room_boid_create_n(jsl_flock_room *room, uint64_t seed, jsl_flock flock,
                                        int64_t count, const jsl_boid_spawn *spawn,
                                        jsl_entity *out);

#endif
