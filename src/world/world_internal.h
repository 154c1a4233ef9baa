/* SPDX-License-Identifier: MIT
 * The world's insides, seen by src/world/ only. Floor 5.
 */
#ifndef JSL_WORLD_INTERNAL_H
#define JSL_WORLD_INTERNAL_H

#include "base/base.h"
#include "ecs/ecs.h"
#include "geometry/geometry.h"
#include <jostle/world.h>

/* The kinds of thing a world can hold. A room is made by the first call that needs it; world.c
 * knows rooms only by these hooks, so that a program links what it calls. */
typedef enum jsl_room_slot {
    JSL_ROOM_PARTICLE,
    JSL_ROOM_FLOCK,
    JSL_ROOM_RIGID,
    JSL_ROOM_COUNT
} jsl_room_slot;

typedef struct jsl_room_hooks {
    const char *name;
    /* Makes the room in another world. */
    jsl_result (*use)(jsl_world *world);
    void (*destroy)(void *room);
    /* Adds its part to the diagnostics; may be null. */
    void (*measure)(void *room, const jsl_world *world, jsl_diagnostics *out);
    /* State that is not in components; all four are null when there is none. A failed restore
     * changes nothing. */
    uint64_t (*hash)(void *room);
    size_t (*save_size)(void *room);
    jsl_result (*save)(void *room, void *bytes, size_t size);
    jsl_result (*restore)(void *room, const void *bytes, size_t size);
    /* Called after the entities were replaced by a restore; may be null. */
    void (*forget)(void *room);
} jsl_room_hooks;

typedef struct jsl_clock {
    int64_t epoch_ns; /* when dt last changed */
    uint64_t steps;   /* since then */
    double dt;        /* s */
} jsl_clock;

struct jsl_world {
    jsl_world_desc settings;
    jsl_ecs *ecs;
    jsl_memory *memory; /* the ECS's: one account for everything */
    jsl_exec exec;
    jsl_arena arena;
    jsl_isa isa;
    jsl_clock clock;
    uint64_t step;

    JSL_ARRAY(jsl_shape_desc) shape;
    JSL_ARRAY(jsl_material_desc) material;
    jsl_component position, orientation, velocity, spin, mass, collider;
    jsl_query solid; /* position + collider */
    jsl_collider_set colliders;
    uint64_t colliders_key; /* hash of the list of items, to tell when it changes */

    void *room[JSL_ROOM_COUNT];
    const jsl_room_hooks *hooks[JSL_ROOM_COUNT];

    jsl_warnings warnings; /* since creation */
    jsl_profile profile;
    bool stepping;
};

/* world.c */
void jsl_room_attach(jsl_world *world, jsl_room_slot slot, void *room, const jsl_room_hooks *hooks);
jsl_result jsl_world_bad_argument(const jsl_world *world, const char *function, const char *what);

/* colliders.c: fills the collider set from the solid entities, in order of entity id. */
jsl_result jsl_world_index_colliders(jsl_world *world, jsl_real dt);

#endif
