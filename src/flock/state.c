/* SPDX-License-Identifier: MIT
 * What is known of flocks and of the tables of boids during one step.
 */
#include "flock/room.h"

static jsl_real signed_square(jsl_real c) { return c * jsl_abs(c); }

static void focus(const jsl_flock_values *v, jsl_lens *lens) {
    const jsl_real radius[JSL_RULES] = {v->separation_radius, v->alignment_radius,
                                        v->cohesion_radius};
    const jsl_real cos[JSL_RULES] = {v->separation_cos, v->alignment_cos, v->cohesion_cos};
    const jsl_real weight[JSL_RULES] = {v->separation_weight, v->alignment_weight,
                                        v->cohesion_weight};
    jsl_real reach = v->near_distance;
    for (int r = 0; r < JSL_RULES; r++) {
        const bool on = radius[r] > 0 && weight[r] > 0;
        lens->radius_sq[r] = on ? radius[r] * radius[r] : -1;
        lens->cone[r] = signed_square(cos[r]);
        if (on) reach = jsl_max(reach, radius[r]);
    }
    lens->near_sq = v->near_distance * v->near_distance;
    lens->reach_sq = reach * reach;
}

/* A leader without a path is a boid like the others, but for being followed. */
static void find_leader(jsl_flock_room *room, jsl_flock_state *f) {
    jsl_rows place, velocity;
    f->led = false;
    if (jsl_entity_is_null(f->value.leader) ||
        !jsl_entity_has(room->ecs, f->value.leader, room->boid) ||
        jsl_rows_of_entity(room->ecs, f->value.leader, room->position, &place) != JSL_OK ||
        jsl_rows_of_entity(room->ecs, f->value.leader, room->velocity, &velocity) != JSL_OK)
        return;
    const jsl_position_columns p = jsl_position_of(&place, 0);
    const jsl_velocity_columns v = jsl_velocity_of(&velocity, 0);
    f->leader_at = jsl_v3(*p.px, *p.py, *p.pz);
    f->leader_velocity = jsl_v3(*v.vx, *v.vy, *v.vz);
    f->led = jsl_v3_is_finite(f->leader_at) && jsl_v3_is_finite(f->leader_velocity);
}

/* Insertion by entity id: flocks are few and mostly in order already. */
static void insert(jsl_flock_room *room, jsl_entity entity) {
    int64_t i = room->state.count++;
    for (; i > 0 && jsl_entity_id(room->state.at[i - 1].entity) > jsl_entity_id(entity); i--)
        room->state.at[i] = room->state.at[i - 1];
    room->state.at[i] = (jsl_flock_state){.entity = entity};
}

jsl_result jsl_flock_refresh(jsl_flock_room *room, const jsl_step_context *context) {
    jsl_rows rows;
    room->state.count = 0;
    JSL_TRY(
        jsl_array_reserve(room->memory, &room->state, jsl_query_count(room->ecs, room->flocks)));
    for (jsl_iter it = jsl_query_begin(room->ecs, room->flocks, 0); jsl_query_next(&it, &rows);)
        for (int64_t i = 0; i < rows.count; i++) insert(room, rows.entity[i]);
    for (int64_t i = 0; i < room->state.count; i++) {
        jsl_flock_state *f = &room->state.at[i];
        f->active = jsl_flock_values_read(room, f->entity, &f->value);
        const char *bad = f->active ? jsl_flock_values_check(&f->value) : NULL;
        if (bad) {
            f->active = false;
            jsl_warn(context, JSL_WARN_BAD_STATE, 1, f->entity);
        }
        if (!f->active) continue;
        focus(&f->value, &f->lens);
        find_leader(room, f);
        jsl_vec3 point[JSL_FLOCK_MAX_WAYPOINTS];
        f->scripted = f->led && jsl_flock_path_read(room, f->entity, point) > 0;
    }
    return JSL_OK;
}

uint32_t jsl_flock_number(const jsl_flock_room *room, jsl_entity flock, uint32_t hint) {
    if (hint < room->state.count && jsl_entity_equal(room->state.at[hint].entity, flock))
        return room->state.at[hint].active ? hint : JSL_FLOCK_NONE;
    const uint64_t id = jsl_entity_id(flock);
    int64_t lo = 0, hi = room->state.count;
    while (lo < hi) {
        int64_t mid = (lo + hi) / 2;
        if (jsl_entity_id(room->state.at[mid].entity) < id)
            lo = mid + 1;
        else
            hi = mid;
    }
    if (lo == room->state.count || !jsl_entity_equal(room->state.at[lo].entity, flock) ||
        !room->state.at[lo].active)
        return JSL_FLOCK_NONE;
    return (uint32_t)lo;
}

/* Looking up a name that nobody registered is no error here. */
static bool find_component(const jsl_ecs *ecs, const char *name, jsl_component *out) {
    for (int i = 0; i < jsl_component_count(ecs); i++)
        if (strcmp(jsl_component_info(ecs, i)->name, name) == 0)
            return jsl_component_find(ecs, name, out) == JSL_OK;
    return false;
}

jsl_result jsl_flock_find_tables(jsl_flock_room *room) {
    jsl_rows rows;
    jsl_component collider = {0}, body = {0};
    const bool colliders = find_component(room->ecs, "collider", &collider);
    const bool bodies = find_component(room->ecs, "body", &body);
    room->table.count = 0;
    room->count = 0;
    for (jsl_iter it = jsl_query_begin(room->ecs, room->boids, 0); jsl_query_next(&it, &rows);) {
        JSL_TRY(jsl_array_reserve(room->memory, &room->table, room->table.count + 1));
        jsl_boid_table *t = &room->table.at[room->table.count++];
        *t = (jsl_boid_table){.rows = rows,
                              .position = jsl_position_of(&rows, 0),
                              .velocity = jsl_velocity_of(&rows, 1),
                              .boid = jsl_boid_of(&rows, 2),
                              .offset = room->count,
                              .revision = jsl_table_revision(room->ecs, rows.table)};
        t->is_body = bodies && jsl_entity_has(room->ecs, rows.entity[0], body);
        t->fixed_order =
            t->is_body || (colliders && jsl_entity_has(room->ecs, rows.entity[0], collider));
        room->count += rows.count;
    }
    return room->count < (int64_t)UINT32_MAX ? JSL_OK : JSL_ERR_LIMIT;
}
