/* SPDX-License-Identifier: MIT
 * Particles in a world: jostle/particle.h. The room is made by the first call that needs it.
 */
#include "particle/particle.h"
#include "world/world_internal.h"

static void destroy(void *room) { jsl_particle_room_destroy(room); }

static void forget(void *room) { jsl_particle_room_forget(room); }

static void measure(void *room, const jsl_world *world, jsl_diagnostics *out) {
    (void)room;
    jsl_component particle;
    jsl_query query;
    if (jsl_component_find(world->ecs, "particle", &particle) == JSL_OK &&
        jsl_query_create(world->ecs, &(jsl_query_desc){{{particle, JSL_READ}}}, &query) == JSL_OK)
        out->particles = jsl_query_count(world->ecs, query);
}

static const jsl_room_hooks hooks = {.name = "particle",
                                     .use = jsl_world_use_particles,
                                     .destroy = destroy,
                                     .measure = measure,
                                     .forget = forget};

static jsl_result ensure(jsl_world *w, jsl_particle_room **room) {
    if (!w) return JSL_ERR_ARGUMENT;
    if (!w->room[JSL_ROOM_PARTICLE]) {
        JSL_TRY(jsl_particle_room_create(w->ecs, room));
        jsl_room_attach(w, JSL_ROOM_PARTICLE, *room, &hooks);
    }
    *room = w->room[JSL_ROOM_PARTICLE];
    return JSL_OK;
}

jsl_result jsl_world_use_particles(jsl_world *w) {
    jsl_particle_room *room;
    return ensure(w, &room);
}

jsl_result jsl_emitter_create(jsl_world *w, const jsl_emitter_desc *desc, jsl_emitter *out) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    if (!desc || !out) return jsl_world_bad_argument(w, "jsl_emitter_create", "null argument");
    return jsl_particle_room_emitter_create(room, desc, out);
}

jsl_result jsl_emitter_add(jsl_world *w, jsl_entity entity, const jsl_emitter_desc *desc,
                           jsl_emitter *out) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    if (!desc || !out) return jsl_world_bad_argument(w, "jsl_emitter_add", "null argument");
    return jsl_particle_room_emitter_add(room, entity, desc, out);
}

jsl_result jsl_emitter_set(jsl_world *w, jsl_emitter emitter, const jsl_emitter_desc *desc) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    if (!desc) return jsl_world_bad_argument(w, "jsl_emitter_set", "null argument");
    return jsl_particle_room_emitter_set(room, emitter, desc);
}

jsl_result jsl_emitter_get(jsl_world *w, jsl_emitter emitter, jsl_emitter_desc *out) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    if (!out) return jsl_world_bad_argument(w, "jsl_emitter_get", "null argument");
    return jsl_particle_room_emitter_get(room, emitter, out);
}

jsl_result jsl_emitter_destroy(jsl_world *w, jsl_emitter emitter) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_particle_room_emitter_destroy(room, emitter);
}

jsl_result jsl_emit(jsl_world *w, jsl_emitter emitter, int64_t n) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_particle_room_emit(room, emitter, n);
}

jsl_result jsl_emitter_alive(jsl_world *w, jsl_emitter emitter, int64_t *out) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    if (!out) return jsl_world_bad_argument(w, "jsl_emitter_alive", "null argument");
    return jsl_particle_room_emitter_alive(room, emitter, out);
}

jsl_result jsl_particle_appearance(jsl_world *w, const jsl_rows *rows, uint32_t *rgba,
                                   float *size) {
    jsl_particle_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_particle_room_colors(room, rows, rgba, size);
}
