/* SPDX-License-Identifier: MIT
 * room.c - the life of the rigid room, and its settings.
 */
#include "rigid/room.h"

static jsl_result add_component(jsl_ecs *ecs, const char *name, const jsl_field *fields, int count,
                                jsl_component *out) {
    return jsl_component_register(ecs, &(jsl_component_desc){name, fields, count, false}, out);
}

static jsl_result add_components(jsl_rigid_room *room) {
    JSL_COMPONENT_FIELDS(position, JSL_POSITION_FIELDS);
    JSL_COMPONENT_FIELDS(orientation, JSL_ORIENTATION_FIELDS);
    JSL_COMPONENT_FIELDS(velocity, JSL_VELOCITY_FIELDS);
    JSL_COMPONENT_FIELDS(spin, JSL_SPIN_FIELDS);
    JSL_COMPONENT_FIELDS(mass, JSL_MASS_FIELDS);
    JSL_COMPONENT_FIELDS(collider, JSL_COLLIDER_FIELDS);
    JSL_COMPONENT_FIELDS(body, JSL_BODY_FIELDS);
#define ADD(name)                                                                                  \
    JSL_TRY(add_component(room->ecs, #name, name##_fields, JSL_COUNT(name##_fields), &room->name))
    ADD(position);
    ADD(orientation);
    ADD(velocity);
    ADD(spin);
    ADD(mass);
    ADD(collider);
    ADD(body);
#undef ADD
    return JSL_OK;
}

static jsl_result add_systems(jsl_rigid_room *room) {
    jsl_query_desc moving = {{{room->position, JSL_WRITE},
                              {room->orientation, JSL_WRITE},
                              {room->velocity, JSL_WRITE},
                              {room->spin, JSL_WRITE},
                              {room->mass, JSL_READ},
                              {room->body, JSL_WRITE},
                              {room->collider, JSL_READ_IF}}};
    JSL_TRY(jsl_query_create(room->ecs, &moving, &room->moving));
    jsl_system_desc detect = {.name = "rigid_detect",
                              .stage = JSL_STAGE_DETECT,
                              .order = 100,
                              .query = moving,
                              .run_whole = jsl_rigid_detect,
                              .user = room};
    jsl_system_desc respond = detect;
    respond.name = "rigid_respond";
    respond.stage = JSL_STAGE_RESPOND;
    respond.run_whole = jsl_rigid_respond;
    JSL_TRY(jsl_system_register(room->ecs, &detect));
    return jsl_system_register(room->ecs, &respond);
}

jsl_result jsl_rigid_room_create(jsl_ecs *ecs, jsl_rigid_room **out) {
    jsl_memory *memory = jsl_ecs_memory(ecs);
    jsl_rigid_room *room = jsl_alloc_zero(memory, sizeof *room);
    if (!room) return jsl_fail(jsl_ecs_logger(ecs), JSL_ERR_MEMORY, "rigid room: out of memory");
    room->ecs = ecs;
    room->memory = memory;
    jsl_result result = add_components(room);
    if (result == JSL_OK) result = add_systems(room);
    if (result != JSL_OK) {
        jsl_free(memory, room, sizeof *room);
        return result;
    }
    *out = room;
    return JSL_OK;
}

void jsl_rigid_room_destroy(jsl_rigid_room *room) {
    if (!room) return;
    jsl_memory *m = room->memory;
    jsl_array_free(m, &room->pair);
    jsl_array_free(m, &room->geo);
    jsl_array_free(m, &room->old_pair);
    jsl_array_free(m, &room->old_geo);
    jsl_array_free(m, &room->loose);
    jsl_array_free(m, &room->finite_box);
    jsl_bvh_free(m, &room->bvh);
    jsl_array_free(m, &room->found);
    jsl_array_free(m, &room->slot);
    jsl_array_free(m, &room->view);
    jsl_array_free(m, &room->view_of_table);
    jsl_array_free(m, &room->line);
    jsl_array_free(m, &room->move);
    jsl_array_free(m, &room->base);
    jsl_array_free(m, &room->kick);
    jsl_array_free(m, &room->pose);
    jsl_array_free(m, &room->turn);
    jsl_array_free(m, &room->used);
    jsl_array_free(m, &room->split);
    jsl_array_free(m, &room->normal);
    jsl_array_free(m, &room->friction);
    jsl_array_free(m, &room->bounce);
    jsl_array_free(m, &room->lane_a);
    jsl_array_free(m, &room->lane_b);
    jsl_array_free(m, &room->lane_contact);
    jsl_array_free(m, &room->active);
    jsl_array_free(m, &room->active_colour);
    jsl_array_free(m, &room->colour);
    jsl_array_free(m, &room->ended);
    jsl_array_free(m, &room->contact);
    jsl_array_free(m, &room->sort_key);
    jsl_array_free(m, &room->sort_tmp);
    jsl_array_free(m, &room->sort_value);
    jsl_array_free(m, &room->sort_tmp_value);
    jsl_free(m, room, sizeof *room);
}

jsl_result jsl_rigid_room_set(jsl_rigid_room *room, const jsl_rigid_settings *settings) {
    const jsl_logger *log = jsl_ecs_logger(room->ecs);
    const jsl_rigid_settings *s = settings;
    if ((int)s->rotation < 0 || s->rotation >= JSL_ROTATION_COUNT)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "rigid settings: rotation %d is unknown",
                        (int)s->rotation);
    const struct {
        const char *name;
        jsl_real value;
        bool any_sign;
    } field[] = {
        {"contact_hertz", s->contact_hertz, false},
        {"damping_ratio", s->damping_ratio, false},
        {"push_speed", s->push_speed, false},
        {"restitution_threshold", s->restitution_threshold, true},
        {"margin", s->margin, false},
        {"keep", s->keep, true},
        {"max_speed", s->max_speed, false},
    };
    for (int i = 0; i < JSL_COUNT(field); i++) {
        if (!jsl_is_finite(field[i].value))
            return jsl_fail(log, JSL_ERR_NOT_FINITE, "rigid settings: %s is not finite",
                            field[i].name);
        if (!field[i].any_sign && field[i].value < 0)
            return jsl_fail(log, JSL_ERR_ARGUMENT, "rigid settings: %s is %g, must not be negative",
                            field[i].name, (double)field[i].value);
    }
    room->settings = *settings;
    return JSL_OK;
}

void jsl_rigid_room_get(const jsl_rigid_room *room, jsl_rigid_settings *out) {
    *out = room->settings;
}

jsl_rigid_profile jsl_rigid_room_profile(jsl_rigid_room *room, bool reset) {
    jsl_rigid_profile profile = room->profile;
    if (reset) room->profile = (jsl_rigid_profile){0};
    return profile;
}
