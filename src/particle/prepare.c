/* SPDX-License-Identifier: MIT
 * What is worked out once a step: each emitter's rules, the planes, and which rows belong to whom.
 * Floor 4.
 *
 * Particles keep the order of their births, so those of one emitter lie in runs. Runs are found by
 * reading the emitter column only when someone else has changed a table; births and deaths of this
 * room keep them up to date.
 */
#include "particle/room.h"
#include <jostle/wind.h>

/* -- Rules
 * ------------------------------------------------------------------------------------------------
 */

/* The planes that these rules may meet; the list has room. */
static void add_planes(jsl_particle_room *room, jsl_particle_rules *rules,
                       const jsl_collider_set *set) {
    rules->plane = room->plane.at + room->plane.count;
    rules->planes = 0;
    if (!set || rules->ghost) return;
    for (int64_t i = 0; i < set->planes.count; i++) {
        const jsl_collider_item *item = &set->item.at[set->planes.at[i]];
        if (!jsl_particle_meets(rules, item)) continue;
        jsl_vec3 n = jsl_rotate(item->pose.orientation, jsl_v3(0, 0, 1));
        room->plane.at[room->plane.count++] = (jsl_particle_plane){n,
                                                                   jsl_dot(n, item->pose.position),
                                                                   jsl_dot(n, item->velocity),
                                                                   item->velocity,
                                                                   item->spin,
                                                                   item->pose.position};
        rules->planes++;
    }
}

static jsl_particle_rules rules_of_row(const jsl_emitter_columns *e, int64_t i, jsl_entity entity,
                                       const jsl_step_context *context) {
    jsl_particle_rules r = {.emitter = entity};
    /* Gusts are sampled in the middle of the step: second order. */
    jsl_vec3 wind = jsl_wind_at(context->wind, context->time + 0.5 * (double)context->dt);
    r.law.integrator = (jsl_particle_integrator)e->integrator[i];
    r.law.k = e->drag[i];
    r.law.a = jsl_mul_add(jsl_scale(context->gravity, 1 - e->buoyancy[i]),
                          e->drag[i] * e->wind_share[i], wind);
    r.map = jsl_particle_map_of(&r.law, (double)context->dt / (double)context->substeps);
    r.restitution = e->restitution[i];
    r.friction = e->friction[i];
    r.contact_size = e->contact_size[i];
    r.category = e->category[i];
    r.mask = e->mask[i];
    r.ghost = e->emitter_flags[i] & JSL_EMITTER_GHOST;
    r.bounds =
        (jsl_aabb){{e->lo_x[i], e->lo_y[i], e->lo_z[i]}, {e->hi_x[i], e->hi_y[i], e->hi_z[i]}};
    r.bounded = r.bounds.lo.x < r.bounds.hi.x || r.bounds.lo.y < r.bounds.hi.y ||
                r.bounds.lo.z < r.bounds.hi.z;
    return r;
}

/* By entity id, so that nothing depends on the order of the emitters' rows. Insertion: nearly
 * sorted, and few. */
static void insert_rules(jsl_particle_room *room, jsl_particle_rules r) {
    int64_t i = room->rules.count++;
    uint64_t id = jsl_entity_id(r.emitter);
    for (; i > 0 && jsl_entity_id(room->rules.at[i - 1].emitter) > id; i--)
        room->rules.at[i] = room->rules.at[i - 1];
    room->rules.at[i] = r;
}

static jsl_result find_rules(jsl_particle_room *room, const jsl_step_context *context) {
    const jsl_collider_set *set = room->solids.set;
    jsl_rows rows;
    room->rules.count = 0;
    room->plane.count = 0;
    int64_t count = jsl_query_count(room->ecs, room->emitters);
    JSL_TRY(jsl_array_reserve(room->memory, &room->rules, count));
    /* At once, for rules point into it. */
    if (set) JSL_TRY(jsl_array_reserve(room->memory, &room->plane, count * set->planes.count));
    for (jsl_iter it = jsl_query_begin(room->ecs, room->emitters, 0); jsl_query_next(&it, &rows);) {
        jsl_emitter_columns e = jsl_emitter_of(&rows, EMITTER_SELF);
        for (int64_t i = 0; i < rows.count; i++)
            insert_rules(room, rules_of_row(&e, i, rows.entity[i], context));
    }
    for (int64_t i = 0; i < room->rules.count; i++) add_planes(room, &room->rules.at[i], set);
    return JSL_OK;
}

static int32_t rules_find(const jsl_particle_room *room, jsl_entity emitter) {
    uint64_t id = jsl_entity_id(emitter);
    int64_t lo = 0, hi = room->rules.count;
    while (lo < hi) {
        int64_t mid = lo + (hi - lo) / 2;
        if (jsl_entity_id(room->rules.at[mid].emitter) < id)
            lo = mid + 1;
        else
            hi = mid;
    }
    bool found = lo < room->rules.count && jsl_entity_equal(room->rules.at[lo].emitter, emitter);
    return found ? (int32_t)lo : -1;
}

/* -- Runs
 * ----------------------------------------------------------------------------------------------------
 */

static jsl_result add_run(jsl_particle_room *room, jsl_particle_table *t, jsl_particle_run run) {
    if (t->run.count > 0) {
        jsl_particle_run *last = &t->run.at[t->run.count - 1];
        if (last->mortal == run.mortal && jsl_entity_equal(last->emitter, run.emitter)) {
            last->end = run.end;
            return JSL_OK;
        }
    }
    JSL_TRY(jsl_array_reserve(room->memory, &t->run, t->run.count + 1));
    t->run.at[t->run.count++] = run;
    return JSL_OK;
}

static jsl_result scan_runs(jsl_particle_room *room, jsl_particle_table *t, const jsl_rows *rows) {
    jsl_particle_columns p = jsl_particle_of(rows, TERM_PARTICLE);
    t->run.count = 0;
    t->rows = -1;
    for (int64_t i = 0; i < rows->count;) {
        jsl_entity e = p.emitter[i];
        bool mortal = p.life[i] > 0;
        int64_t end = i + 1;
        while (end < rows->count && jsl_entity_equal(p.emitter[end], e) &&
               (p.life[end] > 0) == mortal)
            end++;
        JSL_TRY(add_run(room, t, (jsl_particle_run){i, end, e, -1, mortal}));
        i = end;
    }
    t->rows = rows->count;
    t->revision = jsl_table_revision(room->ecs, rows->table);
    return JSL_OK;
}

static jsl_particle_table *table_at(jsl_particle_room *room, uint32_t table) {
    int64_t want = (int64_t)table + 1;
    if (want > room->table.count) {
        if (jsl_array_reserve(room->memory, &room->table, want) != JSL_OK) return NULL;
        memset(room->table.at + room->table.count, 0,
               (size_t)(want - room->table.count) * sizeof *room->table.at);
        room->table.count = want;
    }
    return &room->table.at[table];
}

static jsl_result update_runs(jsl_particle_room *room, const jsl_rows *rows) {
    jsl_particle_table *t = table_at(room, rows->table);
    if (!t) return JSL_ERR_MEMORY;
    int64_t blocks = (rows->count + PARTICLE_BLOCK - 1) / PARTICLE_BLOCK;
    JSL_TRY(jsl_array_reserve(room->memory, &t->flags, blocks));
    memset(t->flags.at, 0, (size_t)blocks);
    t->flags.count = blocks;
    if (t->rows != rows->count || t->revision != jsl_table_revision(room->ecs, rows->table))
        JSL_TRY(scan_runs(room, t, rows));
    for (int64_t i = 0; i < t->run.count; i++)
        t->run.at[i].rules = rules_find(room, t->run.at[i].emitter);
    return JSL_OK;
}

jsl_result jsl_particle_runs_append(jsl_particle_room *room, const jsl_rows *rows, int32_t rules,
                                    bool mortal) {
    jsl_particle_table *t = table_at(room, rows->table);
    if (!t) return JSL_ERR_MEMORY;
    if (t->rows != rows->begin) {
        t->rows = -1; /* to be scanned */
        return JSL_OK;
    }
    jsl_entity emitter = room->rules.at[rules].emitter;
    jsl_particle_run run = {rows->begin, rows->begin + rows->count, emitter, rules, mortal};
    jsl_result result = add_run(room, t, run);
    t->rows = result == JSL_OK ? rows->begin + rows->count : -1;
    t->revision = jsl_table_revision(room->ecs, rows->table);
    return result;
}

void jsl_particle_runs_remove(jsl_particle_room *room, uint32_t table, const uint8_t *dead) {
    jsl_particle_table *t = &room->table.at[table];
    int64_t out = 0, begin = 0;
    for (int64_t i = 0; i < t->run.count; i++) {
        jsl_particle_run run = t->run.at[i];
        int64_t left = 0;
        for (int64_t r = run.begin; r < run.end; r++) left += !dead[r];
        if (left == 0) continue;
        run.begin = begin;
        run.end = begin += left;
        jsl_particle_run *last = out ? &t->run.at[out - 1] : NULL;
        if (last && last->mortal == run.mortal && jsl_entity_equal(last->emitter, run.emitter))
            last->end = run.end;
        else
            t->run.at[out++] = run;
    }
    t->run.count = out;
    t->rows = begin;
    t->revision = jsl_table_revision(room->ecs, table);
}

/* -- Both
 * -------------------------------------------------------------------------------------------------------
 */

jsl_result jsl_particle_prepare(jsl_particle_room *room, const jsl_step_context *context) {
    jsl_rows rows;
    room->solids = (jsl_particle_solids){context->colliders, &room->grid};
    JSL_TRY(find_rules(room, context));
    for (jsl_iter it = jsl_query_begin(room->ecs, room->particles, 0); jsl_query_next(&it, &rows);)
        JSL_TRY(update_runs(room, &rows));
    return JSL_OK;
}

jsl_result jsl_particle_prepare_system(const jsl_step_context *context, void *user) {
    return jsl_particle_prepare(user, context);
}

jsl_result jsl_particle_index_system(const jsl_step_context *context, void *user) {
    jsl_particle_room *room = user;
    return jsl_particle_grid_build(room->memory, &room->grid, context->colliders);
}
