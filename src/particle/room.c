/* SPDX-License-Identifier: MIT
 * The room: components, queries and systems of particles. Floor 4.
 */
#include "particle/room.h"

JSL_COMPONENT_FIELDS(jsl_position, JSL_POSITION_FIELDS);
JSL_COMPONENT_FIELDS(jsl_orientation, JSL_ORIENTATION_FIELDS);
JSL_COMPONENT_FIELDS(jsl_velocity, JSL_VELOCITY_FIELDS);
JSL_COMPONENT_FIELDS(jsl_particle, JSL_PARTICLE_FIELDS);
JSL_COMPONENT_FIELDS(jsl_emitter, JSL_EMITTER_FIELDS);
JSL_COMPONENT_FIELDS(jsl_emitter_look, JSL_EMITTER_LOOK_FIELDS);

static jsl_result register_components(jsl_particle_room *room) {
    const struct {
        jsl_component_desc desc;
        jsl_component *out;
    } list[] = {
        {{"position", jsl_position_fields, JSL_COUNT(jsl_position_fields), false}, &room->position},
        {{"orientation", jsl_orientation_fields, JSL_COUNT(jsl_orientation_fields), false},
         &room->orientation},
        {{"velocity", jsl_velocity_fields, JSL_COUNT(jsl_velocity_fields), false}, &room->velocity},
        {{"particle", jsl_particle_fields, JSL_COUNT(jsl_particle_fields), true}, &room->particle},
        {{"emitter", jsl_emitter_fields, JSL_COUNT(jsl_emitter_fields), false}, &room->emitter},
        {{"emitter_look", jsl_emitter_look_fields, JSL_COUNT(jsl_emitter_look_fields), false},
         &room->look},
    };
    for (int i = 0; i < JSL_COUNT(list); i++)
        JSL_TRY(jsl_component_register(room->ecs, &list[i].desc, list[i].out));
    return JSL_OK;
}

static jsl_result create_queries(jsl_particle_room *room, jsl_query_desc *particles,
                                 jsl_query_desc *emitters) {
    *particles = (jsl_query_desc){.terms = {
                                      [TERM_POSITION] = {room->position, JSL_WRITE},
                                      [TERM_VELOCITY] = {room->velocity, JSL_WRITE},
                                      [TERM_PARTICLE] = {room->particle, JSL_WRITE},
                                  }};
    *emitters = (jsl_query_desc){.terms = {
                                     [EMITTER_SELF] = {room->emitter, JSL_WRITE},
                                     [EMITTER_POSITION] = {room->position, JSL_READ},
                                     [EMITTER_ORIENTATION] = {room->orientation, JSL_READ},
                                     [EMITTER_VELOCITY] = {room->velocity, JSL_READ},
                                 }};
    JSL_TRY(jsl_query_create(room->ecs, particles, &room->particles));
    return jsl_query_create(room->ecs, emitters, &room->emitters);
}

static jsl_result register_systems(jsl_particle_room *room, const jsl_query_desc *particles,
                                   const jsl_query_desc *emitters) {
    const jsl_term also_emitter[2] = {{room->emitter, JSL_READ}};
    jsl_system_desc list[] = {
        {.name = "particle_index",
         .stage = JSL_STAGE_INDEX,
         .order = 500,
         .query = *emitters,
         .run_whole = jsl_particle_index_system},
        {.name = "particle_prepare",
         .stage = JSL_STAGE_MOVE,
         .order = 490,
         .query = *particles,
         .run_whole = jsl_particle_prepare_system},
        {.name = "particle_move",
         .stage = JSL_STAGE_MOVE,
         .order = 500,
         .query = *particles,
         .run_rows = jsl_particle_move_system,
         .block = PARTICLE_BLOCK},
        {.name = "particle_retire",
         .stage = JSL_STAGE_RETIRE,
         .order = 500,
         .query = *particles,
         .run_whole = jsl_particle_retire_system},
        {.name = "particle_birth",
         .stage = JSL_STAGE_RETIRE,
         .order = 510,
         .query = *emitters,
         .run_whole = jsl_particle_birth_system},
    };
    for (int i = 0; i < JSL_COUNT(list); i++) {
        list[i].user = room;
        if (list[i].stage == JSL_STAGE_MOVE)
            memcpy(list[i].also, also_emitter, sizeof also_emitter);
        JSL_TRY(jsl_system_register(room->ecs, &list[i]));
    }
    return JSL_OK;
}

jsl_result jsl_particle_room_create(jsl_ecs *ecs, jsl_particle_room **out) {
    if (!ecs || !out) return JSL_ERR_ARGUMENT;
    jsl_memory *memory = jsl_ecs_memory(ecs);
    jsl_particle_room *room = jsl_alloc_zero(memory, sizeof *room);
    if (!room)
        return jsl_fail(jsl_ecs_logger(ecs), JSL_ERR_MEMORY, "no memory for the particle room");
    room->ecs = ecs;
    room->memory = memory;
    jsl_query_desc particles, emitters;
    jsl_result result = register_components(room);
    if (result == JSL_OK) result = create_queries(room, &particles, &emitters);
    if (result == JSL_OK) result = register_systems(room, &particles, &emitters);
    if (result != JSL_OK) {
        jsl_free(memory, room, sizeof *room);
        return result;
    }
    *out = room;
    return JSL_OK;
}

void jsl_particle_room_forget(jsl_particle_room *room) {
    for (int64_t i = 0; i < room->table.count; i++) room->table.at[i].rows = -1;
    room->grid.n[0] = 0;
}

void jsl_particle_room_destroy(jsl_particle_room *room) {
    if (!room) return;
    jsl_memory *memory = room->memory;
    for (int64_t i = 0; i < room->table.count; i++) {
        jsl_array_free(memory, &room->table.at[i].run);
        jsl_array_free(memory, &room->table.at[i].flags);
    }
    jsl_array_free(memory, &room->table);
    jsl_particle_grid_free(memory, &room->grid);
    jsl_array_free(memory, &room->rules);
    jsl_array_free(memory, &room->plane);
    jsl_array_free(memory, &room->dead);
    jsl_array_free(memory, &room->birth);
    jsl_free(memory, room, sizeof *room);
}
