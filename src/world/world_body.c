/* SPDX-License-Identifier: MIT
 * Rigid bodies in a world: jostle/body.h. The room is made by the first call that needs it; handles
 * of shapes and materials are resolved here.
 */
#include "rigid/rigid.h"
#include "world/world_internal.h"

static void destroy(void *room) { jsl_rigid_room_destroy(room); }

static int64_t count_statics(const jsl_world *world) {
    return jsl_query_count(world->ecs, world->solid);
}

static void measure(void *room, const jsl_world *world, jsl_diagnostics *out) {
    jsl_rigid_measure m;
    if (jsl_rigid_room_measure(room, world->settings.gravity, &m) != JSL_OK) return;
    out->bodies = m.bodies;
    out->statics = count_statics(world) - m.bodies;
    out->contacts = m.touching;
    out->pairs = m.pairs;
    out->kinetic_energy = m.kinetic;
    out->potential_energy = m.potential;
    memcpy(out->momentum, m.momentum, sizeof out->momentum);
    memcpy(out->angular_momentum, m.angular_momentum, sizeof out->angular_momentum);
    memcpy(out->centre_of_mass, m.centre_of_mass, sizeof out->centre_of_mass);
    out->max_speed = m.max_speed;
    out->max_penetration = m.max_penetration;
}

static uint64_t hash(void *room) { return jsl_rigid_room_hash(room); }
static size_t save_size(void *room) { return jsl_rigid_room_save_size(room); }
static jsl_result save(void *room, void *bytes, size_t size) {
    return jsl_rigid_room_save(room, bytes, size);
}
static jsl_result restore(void *room, const void *bytes, size_t size) {
    return jsl_rigid_room_restore(room, bytes, size);
}

static const jsl_room_hooks hooks = {.name = "rigid",
                                     .use = jsl_world_use_bodies,
                                     .destroy = destroy,
                                     .measure = measure,
                                     .hash = hash,
                                     .save_size = save_size,
                                     .save = save,
                                     .restore = restore};

static jsl_result ensure(jsl_world *w, jsl_rigid_room **room) {
    if (!w) return JSL_ERR_ARGUMENT;
    if (!w->room[JSL_ROOM_RIGID]) {
        JSL_TRY(jsl_rigid_room_create(w->ecs, room));
        jsl_room_attach(w, JSL_ROOM_RIGID, *room, &hooks);
    }
    *room = w->room[JSL_ROOM_RIGID];
    return JSL_OK;
}

jsl_result jsl_world_use_bodies(jsl_world *w) {
    jsl_rigid_room *room;
    return ensure(w, &room);
}

/* -- Creating
 * --------------------------------------------------------------------------------------------- */

static jsl_result paint(jsl_world *w, const jsl_body_desc *desc, int64_t count,
                        const jsl_body *body) {
    for (int64_t i = 0; i < count; i++)
        if (desc[i].rgba) JSL_TRY(jsl_look_set_n(w, &body[i].entity, 1, desc[i].rgba));
    return JSL_OK;
}

/* Handles to values; nothing is changed yet. */
static jsl_result resolve(jsl_world *w, const jsl_body_desc *desc, int64_t count,
                          jsl_rigid_body_desc *out) {
    jsl_material_desc material;
    for (int64_t i = 0; i < count; i++) {
        if (desc[i].shape.id > w->shape.count)
            return jsl_fail(&w->settings.logger, JSL_ERR_HANDLE,
                            "body %lld: shape %u does not exist", (long long)i, desc[i].shape.id);
        JSL_TRY(jsl_material_get(w, desc[i].material, &material));
        out[i] = (jsl_rigid_body_desc){
            desc[i], desc[i].shape.id ? &w->shape.at[desc[i].shape.id - 1] : NULL};
    }
    return JSL_OK;
}

jsl_result jsl_body_create_n(jsl_world *w, const jsl_body_desc *desc, int64_t count,
                             jsl_body *out) {
    jsl_rigid_room *room;
    if (!desc || count < 0)
        return jsl_world_bad_argument(w, "jsl_body_create_n", "null desc or negative count");
    JSL_TRY(ensure(w, &room));
    size_t bytes = (size_t)count * (sizeof(jsl_rigid_body_desc) + sizeof(jsl_body));
    char *scratch = jsl_alloc(w->memory, bytes ? bytes : 1);
    if (!scratch)
        return jsl_fail(&w->settings.logger, JSL_ERR_MEMORY, "out of memory for %lld bodies",
                        (long long)count);
    jsl_rigid_body_desc *full = (jsl_rigid_body_desc *)(void *)scratch;
    jsl_body *body = (jsl_body *)(void *)(full + count);
    jsl_result result = resolve(w, desc, count, full);
    if (result == JSL_OK) result = jsl_rigid_body_create_n(room, full, count, body);
    if (result == JSL_OK) {
        result = paint(w, desc, count, body);
        if (result != JSL_OK)
            for (int64_t i = 0; i < count; i++) jsl_rigid_body_destroy(room, body[i]);
        else if (out)
            memcpy(out, body, (size_t)count * sizeof *out);
    }
    jsl_free(w->memory, scratch, bytes ? bytes : 1);
    return result;
}

jsl_result jsl_body_create(jsl_world *w, const jsl_body_desc *desc, jsl_body *out) {
    return jsl_body_create_n(w, desc, 1, out);
}

jsl_result jsl_body_destroy(jsl_world *w, jsl_body body) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_rigid_body_destroy(room, body);
}

/* -- State
 * ----------------------------------------------------------------------------------------------------
 */

jsl_result jsl_body_get(jsl_world *w, jsl_body body, jsl_body_state *out) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    if (!out) return jsl_world_bad_argument(w, "jsl_body_get", "null argument");
    return jsl_rigid_body_get(room, body, out);
}

jsl_result jsl_body_set_pose(jsl_world *w, jsl_body body, jsl_pose pose) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_rigid_body_set_pose(room, body, pose);
}

jsl_result jsl_body_set_velocity(jsl_world *w, jsl_body body, jsl_vec3 velocity, jsl_vec3 spin) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_rigid_body_set_velocity(room, body, velocity, spin);
}

jsl_result jsl_body_add_force(jsl_world *w, jsl_body body, jsl_vec3 force) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_rigid_body_add_force(room, body, force);
}

jsl_result jsl_body_add_torque(jsl_world *w, jsl_body body, jsl_vec3 torque) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_rigid_body_add_torque(room, body, torque);
}

jsl_result jsl_body_add_force_at(jsl_world *w, jsl_body body, jsl_vec3 force, jsl_vec3 point) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_rigid_body_add_force_at(room, body, force, point);
}

jsl_result jsl_body_apply_impulse(jsl_world *w, jsl_body body, jsl_vec3 impulse, jsl_vec3 point) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    return jsl_rigid_body_apply_impulse(room, body, impulse, point);
}

/* -- Settings, contacts, diagnostics
 * ----------------------------------------------------------------------------- */

jsl_result jsl_rigid_set(jsl_world *w, const jsl_rigid_settings *settings) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    if (!settings) return jsl_world_bad_argument(w, "jsl_rigid_set", "null argument");
    return jsl_rigid_room_set(room, settings);
}

jsl_result jsl_rigid_get(jsl_world *w, jsl_rigid_settings *out) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    if (!out) return jsl_world_bad_argument(w, "jsl_rigid_get", "null argument");
    jsl_rigid_room_get(room, out);
    return JSL_OK;
}

jsl_result jsl_rigid_contacts(jsl_world *w, const jsl_contact **out, int64_t *count) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    if (!out || !count) return jsl_world_bad_argument(w, "jsl_rigid_contacts", "null argument");
    return jsl_rigid_room_contacts(room, out, count);
}

jsl_result jsl_rigid_diagnose(jsl_world *w, jsl_rigid_measure *out) {
    jsl_rigid_room *room;
    JSL_TRY(ensure(w, &room));
    if (!out) return jsl_world_bad_argument(w, "jsl_rigid_diagnose", "null argument");
    return jsl_rigid_room_measure(room, w->settings.gravity, out);
}
