/* SPDX-License-Identifier: MIT
 * The particle room: the functions of jostle/particle.h with the room in place of the world.
 * Floor 4.
 */
#ifndef JSL_PARTICLE_PARTICLE_H
#define JSL_PARTICLE_PARTICLE_H

#include "base/base.h"
#include <jostle/particle.h>

typedef struct jsl_particle_room jsl_particle_room;

/* Registers components and systems with the ecs; memory comes from jsl_ecs_memory(ecs). Systems
 * cannot be unregistered, so the room must live as long as the schedule runs. */
jsl_result jsl_particle_room_create(jsl_ecs *ecs, jsl_particle_room **out);
void jsl_particle_room_destroy(jsl_particle_room *room); /* null is allowed */
/* Forgets what it has worked out from tables and colliders; call after jsl_ecs_restore. */
void jsl_particle_room_forget(jsl_particle_room *room);

jsl_result jsl_particle_room_emitter_create(jsl_particle_room *room, const jsl_emitter_desc *desc,
                                            jsl_emitter *out);
jsl_result jsl_particle_room_emitter_add(jsl_particle_room *room, jsl_entity entity,
                                         const jsl_emitter_desc *desc, jsl_emitter *out);
jsl_result jsl_particle_room_emitter_set(jsl_particle_room *room, jsl_emitter emitter,
                                         const jsl_emitter_desc *desc);
jsl_result jsl_particle_room_emitter_get(jsl_particle_room *room, jsl_emitter emitter,
                                         jsl_emitter_desc *out);
jsl_result jsl_particle_room_emitter_destroy(jsl_particle_room *room, jsl_emitter emitter);
jsl_result jsl_particle_room_emit(jsl_particle_room *room, jsl_emitter emitter, int64_t n);
jsl_result jsl_particle_room_emitter_alive(jsl_particle_room *room, jsl_emitter emitter,
                                           int64_t *out);
jsl_result jsl_particle_room_colors(jsl_particle_room *room, const jsl_rows *rows, uint32_t *rgba,
                                    float *size);

#endif
