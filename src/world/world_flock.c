/* SPDX-License-Identifier: MIT
 * Flocks in a world: jostle/flock.h. The room is made by the first call that needs it.
 */
#include "flock/flock.h"
#include "world/world_internal.h"

static void destroy(void *room) { jsl_flock_room_destroy(room); }

static void measure(void *room, const jsl_world *world, jsl_diagnostics *out) {
    (void)room;
    jsl_component boid;
    jsl_query query;
    if (jsl_component_find(world->ecs, "boid", &boid) == JSL_OK &&
        jsl_query_create(world->ecs, &(jsl_query_desc){{{boid, JSL_READ}}}, &query) == JSL_OK)
        out->boids = jsl_query_count(world->ecs, query);
}

static const jsl_room_hooks hooks = {
    .name = "flock", .use = jsl_world_use_flocks, .destroy = destroy, .measure = measure};

static jsl_result ensure(jsl_world *w, jsl_flock_room **room) {
    if (!w) return JSL_ERR_ARGUMENT;
    if (!w->room[JSL_ROOM_FLOCK]) {
        JSL_TRY(jsl_flock_room_create(w->ecs, room));
        jsl_room_attach(w, JSL_ROOM_FLOCK, *room, &hooks);
    }
    *room = w->room[JSL_ROOM_FLOCK];
    return JSL_OK;
}

jsl_result jsl_world_use_flocks(jsl_world *w) {
    jsl_flock_room *room;
    return ensure(w, &room);
}

jsl_result jsl_flock_create(jsl_world *w, const jsl_flock_desc *desc, jsl_flock *out) {
    jsl_flock_room *room;
    JSL_TRY(ensure(w, &room));
    if (!desc || !out) return jsl_world_bad_argument(w, "jsl_flock_create", "null argument");
    return jsl_flock_room_flock_create(room, desc, out);
}

jsl_result jsl_flock_destroy(jsl_world *w, jsl_flock flock) {
    jsl_flock_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_flock_room_flock_destroy(room, flock);
}

jsl_result jsl_flock_set(jsl_world *w, jsl_flock flock, const jsl_flock_desc *desc) {
    jsl_flock_room *room;
    JSL_TRY(ensure(w, &room));
    if (!desc) return jsl_world_bad_argument(w, "jsl_flock_set", "null argument");
    return jsl_flock_room_flock_set(room, flock, desc);
}

jsl_result jsl_flock_get(jsl_world *w, jsl_flock flock, jsl_flock_desc *out) {
    jsl_flock_room *room;
    JSL_TRY(ensure(w, &room));
    if (!out) return jsl_world_bad_argument(w, "jsl_flock_get", "null argument");
    return jsl_flock_room_flock_get(room, flock, out);
}

jsl_result jsl_flock_set_path(jsl_world *w, jsl_flock flock, const jsl_vec3 *waypoints, int count,
                              jsl_real speed) {
    jsl_flock_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_flock_room_set_path(room, flock, waypoints, count, speed);
}

jsl_result jsl_flock_set_leader(jsl_world *w, jsl_flock flock, jsl_entity boid) {
    jsl_flock_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_flock_room_set_leader(room, flock, boid);
}

jsl_result jsl_boid_create_n(jsl_world *w, jsl_flock flock, int64_t count,
                             const jsl_boid_spawn *spawn, jsl_entity *out) {
    jsl_flock_room *room;
    JSL_TRY(ensure(w, &room));
    if (!spawn) return jsl_world_bad_argument(w, "jsl_boid_create_n", "null argument");
    return jsl_flock_room_boid_create_n(room, w->settings.seed, flock, count, spawn, out);
}
