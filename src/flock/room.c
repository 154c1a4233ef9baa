/* SPDX-License-Identifier: MIT
 * Life of the room, of flocks and of boids.
 */
#include "flock/room.h"

JSL_COMPONENT_FIELDS(jsl_position, JSL_POSITION_FIELDS);
JSL_COMPONENT_FIELDS(jsl_velocity, JSL_VELOCITY_FIELDS);
JSL_COMPONENT_FIELDS(jsl_boid, JSL_BOID_FIELDS);
JSL_COMPONENT_FIELDS(jsl_flock, JSL_FLOCK_FIELDS);
JSL_COMPONENT_FIELDS(jsl_flock_path, JSL_FLOCK_PATH_FIELDS);
JSL_COMPONENT_FIELDS(jsl_flock_path_rest, JSL_FLOCK_PATH_REST_FIELDS);

static jsl_result register_components(jsl_flock_room *room) {
    const struct {
        const char *name;
        const jsl_field *fields;
        int count;
        jsl_component *out;
    } all[] = {
        {"position", jsl_position_fields, JSL_COUNT(jsl_position_fields), &room->position},
        {"velocity", jsl_velocity_fields, JSL_COUNT(jsl_velocity_fields), &room->velocity},
        {"boid", jsl_boid_fields, JSL_COUNT(jsl_boid_fields), &room->boid},
        {"flock", jsl_flock_fields, JSL_COUNT(jsl_flock_fields), &room->flock},
        {"flock_path", jsl_flock_path_fields, JSL_COUNT(jsl_flock_path_fields), &room->path},
        {"flock_path_rest", jsl_flock_path_rest_fields, JSL_COUNT(jsl_flock_path_rest_fields),
         &room->path_rest},
    };
    for (int i = 0; i < JSL_COUNT(all); i++) {
        jsl_component_desc desc = {
            .name = all[i].name, .fields = all[i].fields, .field_count = all[i].count};
        JSL_TRY(jsl_component_register(room->ecs, &desc, all[i].out));
    }
    return JSL_OK;
}

static jsl_result register_systems(jsl_flock_room *room) {
    const jsl_query_desc all = {
        {{room->position, JSL_WRITE}, {room->velocity, JSL_WRITE}, {room->boid, JSL_WRITE}}};
    const jsl_system_desc systems[] = {
        {.name = "flock_index",
         .stage = JSL_STAGE_INDEX,
         .order = 200,
         .query = all,
         .also = {{room->flock, JSL_READ}},
         .run_whole = jsl_flock_index,
         .user = room},
        {.name = "flock_steer",
         .stage = JSL_STAGE_DECIDE,
         .order = 200,
         .query = {{{room->position, JSL_READ},
                    {room->velocity, JSL_READ},
                    {room->boid, JSL_WRITE}}},
         .also = {{room->flock, JSL_READ}},
         .run_whole = jsl_flock_steer,
         .user = room},
        {.name = "flock_lead",
         .stage = JSL_STAGE_MOVE,
         .order = 200,
         .query = {{{room->flock, JSL_WRITE}, {room->path, JSL_READ}}},
         .also = {{room->position, JSL_WRITE}, {room->velocity, JSL_WRITE}},
         .run_whole = jsl_flock_lead,
         .user = room},
        {.name = "flock_move",
         .stage = JSL_STAGE_MOVE,
         .order = 210,
         .query = {{{room->position, JSL_WRITE},
                    {room->velocity, JSL_WRITE},
                    {room->boid, JSL_READ}}},
         .run_rows = jsl_flock_move_rows,
         .user = room},
    };
    for (int i = 0; i < JSL_COUNT(systems); i++)
        JSL_TRY(jsl_system_register(room->ecs, &systems[i]));
    return JSL_OK;
}

jsl_result jsl_flock_room_create(jsl_ecs *ecs, jsl_flock_room **out) {
    if (!ecs || !out) return JSL_ERR_ARGUMENT;
    jsl_memory *memory = jsl_ecs_memory(ecs);
    jsl_flock_room *room = jsl_alloc_zero(memory, sizeof *room);
    if (!room) return jsl_fail(jsl_ecs_logger(ecs), JSL_ERR_MEMORY, "no memory for the flock room");
    room->ecs = ecs;
    room->memory = memory;
    jsl_result result = register_components(room);
    if (result == JSL_OK) {
        jsl_query_desc boids = {
            {{room->position, JSL_WRITE}, {room->velocity, JSL_WRITE}, {room->boid, JSL_WRITE}}};
        result = jsl_query_create(ecs, &boids, &room->boids);
    }
    if (result == JSL_OK) {
        jsl_query_desc flocks = {{{room->flock, JSL_WRITE}}};
        result = jsl_query_create(ecs, &flocks, &room->flocks);
    }
    if (result == JSL_OK) result = register_systems(room);
    if (result != JSL_OK) {
        jsl_flock_room_destroy(room);
        return result;
    }
    *out = room;
    return JSL_OK;
}

void jsl_flock_room_destroy(jsl_flock_room *room) {
    if (!room) return;
    jsl_memory *memory = room->memory;
    jsl_array_free(memory, &room->state);
    jsl_array_free(memory, &room->table);
    for (int k = 0; k < 6; k++) jsl_array_free(memory, &room->column[k]);
    jsl_array_free(memory, &room->key);
    jsl_array_free(memory, &room->home);
    jsl_array_free(memory, &room->start);
    jsl_array_free(memory, &room->flock_begin);
    jsl_free(memory, room, sizeof *room);
}

/* -- Leaders and paths
 * ------------------------------------------------------------------------------ */

static jsl_result refuse_flock(const jsl_flock_room *room, jsl_flock flock) {
    if (jsl_entity_has(room->ecs, flock.entity, room->flock)) return JSL_OK;
    return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_HANDLE, "flock: handle %u.%u is none",
                    flock.entity.index, flock.entity.generation);
}

static jsl_result check_path(const jsl_logger *log, const jsl_vec3 *point, int count,
                             jsl_real speed) {
    if (count < 3 || count > JSL_FLOCK_MAX_WAYPOINTS || !point)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "flock path: count is %d, not 0 or 3 .. %d", count,
                        JSL_FLOCK_MAX_WAYPOINTS);
    if (!jsl_is_finite(speed))
        return jsl_fail(log, JSL_ERR_NOT_FINITE, "flock path: speed is not finite");
    if (!(speed > 0 && speed <= JSL_R(1e9)))
        return jsl_fail(log, JSL_ERR_ARGUMENT, "flock path: speed is %g, not in (0, 1e9]",
                        (double)speed);
    for (int i = 0; i < count; i++) {
        if (!jsl_v3_is_finite(point[i]))
            return jsl_fail(log, JSL_ERR_NOT_FINITE, "flock path: waypoints[%d] is not finite", i);
    }
    for (int i = 0; i < count; i++) {
        int next = (i + 1) % count;
        jsl_real l2 = jsl_length_sq(jsl_sub(point[next], point[i]));
        if (!(l2 > 0 && jsl_is_finite(l2)))
            return jsl_fail(log, JSL_ERR_DEGENERATE,
                            "flock path: waypoints[%d] and [%d] coincide or are too far apart", i,
                            next);
    }
    return JSL_OK;
}

jsl_result jsl_flock_room_set_path(jsl_flock_room *room, jsl_flock flock, const jsl_vec3 *waypoints,
                                   int count, jsl_real speed) {
    if (!room) return JSL_ERR_ARGUMENT;
    JSL_TRY(refuse_flock(room, flock));
    const jsl_component both[2] = {room->path, room->path_rest};
    if (count == 0) return jsl_entity_remove(room->ecs, flock.entity, both, 2);
    JSL_TRY(check_path(jsl_ecs_logger(room->ecs), waypoints, count, speed));
    JSL_TRY(jsl_entity_add(room->ecs, flock.entity, both, count > 16 ? 2 : 1));
    if (count <= 16) JSL_TRY(jsl_entity_remove(room->ecs, flock.entity, &room->path_rest, 1));
    jsl_rows rows;
    JSL_TRY(jsl_rows_of_entity(room->ecs, flock.entity, room->path, &rows));
    *(uint32_t *)rows.column[0] = (uint32_t)count;
    for (int i = 0; i < count; i++) {
        if (i == 16) JSL_TRY(jsl_rows_of_entity(room->ecs, flock.entity, room->path_rest, &rows));
        int at = i < 16 ? 1 + 3 * i : 3 * (i - 16);
        *(jsl_real *)rows.column[at] = waypoints[i].x;
        *(jsl_real *)rows.column[at + 1] = waypoints[i].y;
        *(jsl_real *)rows.column[at + 2] = waypoints[i].z;
    }
    JSL_TRY(jsl_rows_of_entity(room->ecs, flock.entity, room->flock, &rows));
    jsl_flock_columns c = jsl_flock_of(&rows, 0);
    *c.leader_speed = speed;
    *c.path_at = 0;
    return JSL_OK;
}

jsl_result jsl_flock_room_set_leader(jsl_flock_room *room, jsl_flock flock, jsl_entity boid) {
    if (!room) return JSL_ERR_ARGUMENT;
    JSL_TRY(refuse_flock(room, flock));
    jsl_rows rows, old;
    uint32_t *flags = NULL;
    if (!jsl_entity_is_null(boid)) {
        if (jsl_rows_of_entity(room->ecs, boid, room->boid, &rows) != JSL_OK ||
            !jsl_entity_equal(*jsl_boid_of(&rows, 0).flock, flock.entity))
            return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_HANDLE,
                            "flock leader: %u.%u is no boid of this flock", boid.index,
                            boid.generation);
        flags = jsl_boid_of(&rows, 0).boid_flags;
    }
    jsl_rows own;
    JSL_TRY(jsl_rows_of_entity(room->ecs, flock.entity, room->flock, &own));
    jsl_flock_columns c = jsl_flock_of(&own, 0);
    if (jsl_entity_has(room->ecs, *c.leader, room->boid) &&
        jsl_rows_of_entity(room->ecs, *c.leader, room->boid, &old) == JSL_OK)
        *jsl_boid_of(&old, 0).boid_flags &= ~JSL_BOID_LEADER;
    if (flags) *flags |= JSL_BOID_LEADER;
    *c.leader = boid;
    return JSL_OK;
}

/* -- Boids
 * -------------------------------------------------------------------------------------------- */

static jsl_result check_spawn(const jsl_logger *log, int64_t count, const jsl_boid_spawn *spawn) {
    if (count < 0 || count > INT32_MAX)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "boids: count is %lld", (long long)count);
    if (!spawn) return jsl_fail(log, JSL_ERR_ARGUMENT, "boids: spawn is null");
    const struct {
        const char *name;
        jsl_real value;
        bool negative;
    } all[] = {{"centre.x", spawn->centre.x, true},
               {"centre.y", spawn->centre.y, true},
               {"centre.z", spawn->centre.z, true},
               {"radius", spawn->radius, false},
               {"half.x", spawn->half.x, false},
               {"half.y", spawn->half.y, false},
               {"half.z", spawn->half.z, false},
               {"velocity.x", spawn->velocity.x, true},
               {"velocity.y", spawn->velocity.y, true},
               {"velocity.z", spawn->velocity.z, true},
               {"velocity_spread", spawn->velocity_spread, false}};
    for (int i = 0; i < JSL_COUNT(all); i++) {
        if (!jsl_is_finite(all[i].value))
            return jsl_fail(log, JSL_ERR_NOT_FINITE, "boids: %s is not finite", all[i].name);
        if ((all[i].value < 0 && !all[i].negative) || jsl_abs(all[i].value) > JSL_R(1e18))
            return jsl_fail(log, JSL_ERR_ARGUMENT, "boids: %s is %g", all[i].name,
                            (double)all[i].value);
    }
    return JSL_OK;
}

/* Uniform in the cube [-1, 1)^3. One after the other: the order of evaluation of arguments is the
 * compiler's. */
static jsl_vec3 in_cube(jsl_rng *rng) {
    jsl_vec3 v;
    v.x = jsl_rng_signed(rng);
    v.y = jsl_rng_signed(rng);
    v.z = jsl_rng_signed(rng);
    return v;
}

/* Uniform in the unit ball, by rejection. */
static jsl_vec3 in_ball(jsl_rng *rng) {
    for (;;) {
        jsl_vec3 v = in_cube(rng);
        if (jsl_length_sq(v) <= 1) return v;
    }
}

#define STREAM_SPAWN 0x626f6964u /* "boid" */

jsl_result jsl_flock_room_boid_create_n(jsl_flock_room *room, uint64_t seed, jsl_flock flock,
                                        int64_t count, const jsl_boid_spawn *spawn,
                                        jsl_entity *out) {
    if (!room) return JSL_ERR_ARGUMENT;
    JSL_TRY(refuse_flock(room, flock));
    JSL_TRY(check_spawn(jsl_ecs_logger(room->ecs), count, spawn));
    if (count == 0) return JSL_OK;
    const jsl_component set[] = {room->position, room->velocity, room->boid};
    jsl_rows rows;
    JSL_TRY(jsl_entity_create_n(room->ecs, set, JSL_COUNT(set), count, out, &rows));
    const jsl_position_columns p = jsl_position_of(&rows, 0);
    const jsl_velocity_columns v = jsl_velocity_of(&rows, 1);
    const jsl_boid_columns b = jsl_boid_of(&rows, 2);
    for (int64_t i = 0; i < rows.count; i++) {
        jsl_rng rng = jsl_rng_make(seed, jsl_entity_id(rows.entity[i]), 0, STREAM_SPAWN);
        const bool ball = spawn->radius > 0;
        jsl_vec3 at = ball ? in_ball(&rng) : in_cube(&rng);
        at.x *= ball ? spawn->radius : spawn->half.x;
        at.y *= ball ? spawn->radius : spawn->half.y;
        at.z *= ball ? spawn->radius : spawn->half.z;
        at = jsl_add(at, spawn->centre);
        jsl_vec3 velocity = jsl_mul_add(spawn->velocity, spawn->velocity_spread, in_ball(&rng));
        p.px[i] = at.x, p.py[i] = at.y, p.pz[i] = at.z;
        v.vx[i] = velocity.x, v.vy[i] = velocity.y, v.vz[i] = velocity.z;
        b.flock[i] = flock.entity;
    }
    return JSL_OK;
}
