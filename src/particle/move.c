/* SPDX-License-Identifier: MIT
 * Moving and retiring particles. Floor 4.
 */
#include "particle/move.h"

/* -- Moving
 * ------------------------------------------------------------------------------------------------
 */

uint32_t jsl_particle_redo(const jsl_particle_tile *t, int64_t first, const jsl_particle_hits *hits,
                           int count, jsl_real begin) {
    const jsl_particle_rules *rules = t->rules;
    uint32_t result = 0;
    for (int k = 0; k < count; k++) {
        jsl_vec3 x = {hits->px[k], hits->py[k], hits->pz[k]};
        jsl_vec3 v = {hits->vx[k], hits->vy[k], hits->vz[k]};
        jsl_particle_bounce(t->solids, rules, &rules->map, rules->contact_size * hits->size[k],
                            begin, t->h, &x, &v);
        if (!jsl_v3_is_finite(x) || !jsl_v3_is_finite(v)) result = PARTICLE_BAD;
        int64_t i = first + hits->row[k];
        t->px[i] = x.x;
        t->py[i] = x.y;
        t->pz[i] = x.z;
        t->vx[i] = v.x;
        t->vy[i] = v.y;
        t->vz[i] = v.z;
    }
    return result;
}

bool jsl_particle_look(const jsl_particle_tile *t, int64_t first, const int32_t *row, int count,
                       jsl_real time, jsl_vec3 far, uint8_t *near) {
    bool any = false;
    for (int k = 0; k < count; k++) {
        int64_t i = first + row[k];
        jsl_real r = t->rules->contact_size * t->size[i];
        jsl_vec3 x = {t->px[i], t->py[i], t->pz[i]};
        jsl_vec3 d = {jsl_abs(t->vx[i]) * time + far.x + r, jsl_abs(t->vy[i]) * time + far.y + r,
                      jsl_abs(t->vz[i]) * time + far.z + r};
        if (!jsl_particle_grid_meets(t->grid, (jsl_aabb){jsl_sub(x, d), jsl_add(x, d)})) continue;
        near[row[k]] = 2;
        any = true;
    }
    return any;
}

/* The first run that ends after row. */
static int64_t run_at(const jsl_particle_table *t, int64_t row) {
    int64_t lo = 0, hi = t->run.count;
    while (lo < hi) {
        int64_t mid = lo + (hi - lo) / 2;
        if (t->run.at[mid].end <= row)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

void jsl_particle_move_system(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    jsl_particle_room *room = user;
    jsl_particle_table *t = &room->table.at[rows->table];
    jsl_position_columns p = jsl_position_of(rows, TERM_POSITION);
    jsl_velocity_columns v = jsl_velocity_of(rows, TERM_VELOCITY);
    jsl_particle_columns q = jsl_particle_of(rows, TERM_PARTICLE);
    const jsl_collider_set *set = room->solids.set;
    uint32_t flags = 0;
    if (!(context->dt > 0)) return;
    int64_t end = rows->begin + rows->count;
    for (int64_t r = run_at(t, rows->begin); r < t->run.count && t->run.at[r].begin < end; r++) {
        const jsl_particle_run *run = &t->run.at[r];
        if (run->rules < 0) {
            flags |= PARTICLE_DIED;
            continue;
        }
        const jsl_particle_rules *rules = &room->rules.at[run->rules];
        int64_t a = (run->begin > rows->begin ? run->begin : rows->begin) - rows->begin;
        int64_t b = (run->end < end ? run->end : end) - rows->begin;
        jsl_particle_tile tile = {
            .count = b - a,
            .px = p.px + a,
            .py = p.py + a,
            .pz = p.pz + a,
            .vx = v.vx + a,
            .vy = v.vy + a,
            .vz = v.vz + a,
            .age = q.age + a,
            .life = q.life + a,
            .size = q.size + a,
            .mortal = run->mortal,
            .substeps = context->substeps,
            .h = (jsl_real)((double)context->dt / (double)context->substeps),
            .dt = context->dt,
            .rules = rules,
            .grid = set && !rules->ghost && room->grid.n[0] ? &room->grid : NULL,
            .solids = &room->solids,
        };
        flags |= JSL_KERNEL_PICK(context->isa, jsl_particle_move)(&tile);
    }
    t->flags.at[rows->begin / PARTICLE_BLOCK] = (uint8_t)flags;
}

/* -- Retiring
 * ------------------------------------------------------------------------------------------------
 */

static bool is_outside(jsl_aabb b, jsl_real x, jsl_real y, jsl_real z) {
    return x < b.lo.x || x > b.hi.x || y < b.lo.y || y > b.hi.y || z < b.lo.z || z > b.hi.z;
}

/* Rows of which something is not finite: marked and named. */
static void mark_bad(const jsl_rows *rows, int64_t begin, int64_t end,
                     const jsl_step_context *context, uint8_t *dead) {
    jsl_position_columns p = jsl_position_of(rows, TERM_POSITION);
    jsl_velocity_columns v = jsl_velocity_of(rows, TERM_VELOCITY);
    for (int64_t i = begin; i < end; i++) {
        bool finite = jsl_is_finite(p.px[i]) && jsl_is_finite(p.py[i]) && jsl_is_finite(p.pz[i]) &&
                      jsl_is_finite(v.vx[i]) && jsl_is_finite(v.vy[i]) && jsl_is_finite(v.vz[i]);
        if (finite) continue;
        jsl_warn(context, JSL_WARN_BAD_STATE, 1, rows->entity[i]);
        dead[i] = 1;
    }
}

/* Marks the dead among rows [begin, end) of a run, for the reasons that the flags of their block
 * give. */
static void mark_dead(const jsl_particle_room *room, const jsl_particle_run *run, uint32_t flags,
                      int64_t begin, int64_t end, const jsl_rows *rows,
                      const jsl_step_context *context) {
    uint8_t *dead = room->dead.at;
    if (run->rules < 0) {
        memset(dead + begin, 1, (size_t)(end - begin));
        return;
    }
    if (run->mortal && flags & PARTICLE_DIED) {
        jsl_particle_columns q = jsl_particle_of(rows, TERM_PARTICLE);
        for (int64_t i = begin; i < end; i++) dead[i] = q.age[i] >= q.life[i];
    }
    const jsl_particle_rules *rules = &room->rules.at[run->rules];
    if (rules->bounded && flags & PARTICLE_OUTSIDE) {
        jsl_position_columns p = jsl_position_of(rows, TERM_POSITION);
        for (int64_t i = begin; i < end; i++)
            dead[i] |= is_outside(rules->bounds, p.px[i], p.py[i], p.pz[i]);
    }
    if (flags & PARTICLE_BAD) mark_bad(rows, begin, end, context, dead);
}

static jsl_result retire_table(jsl_particle_room *room, const jsl_rows *rows,
                               const jsl_step_context *context) {
    const jsl_particle_table *t = &room->table.at[rows->table];
    uint32_t any = 0;
    for (int64_t b = 0; b < t->flags.count; b++) any |= t->flags.at[b];
    if (!any) return JSL_OK;
    JSL_TRY(jsl_array_reserve(room->memory, &room->dead, jsl_round_up(rows->count, JSL_ALIGN)));
    memset(room->dead.at, 0, (size_t)rows->count);
    for (int64_t r = 0; r < t->run.count; r++) {
        const jsl_particle_run *run = &t->run.at[r];
        for (int64_t a = run->begin; a < run->end;) {
            int64_t block = a / PARTICLE_BLOCK, end = (block + 1) * PARTICLE_BLOCK;
            if (end > run->end) end = run->end;
            if (t->flags.at[block]) mark_dead(room, run, t->flags.at[block], a, end, rows, context);
            a = end;
        }
    }
    uint32_t table = rows->table;
    if (jsl_table_destroy_rows(room->ecs, table, room->dead.at) > 0)
        jsl_particle_runs_remove(room, table, room->dead.at);
    return JSL_OK;
}

jsl_result jsl_particle_retire_system(const jsl_step_context *context, void *user) {
    jsl_particle_room *room = user;
    jsl_rows rows;
    bool fresh = true; /* nobody has changed a table since the particles moved */
    for (jsl_iter it = jsl_query_begin(room->ecs, room->particles, 0);
         jsl_query_next(&it, &rows);) {
        const jsl_particle_table *t =
            rows.table < room->table.count ? &room->table.at[rows.table] : NULL;
        fresh &=
            t && t->rows == rows.count && t->revision == jsl_table_revision(room->ecs, rows.table);
    }
    if (!fresh) {
        JSL_TRY(jsl_particle_prepare(room, context));
        for (int64_t i = 0; i < room->table.count; i++)
            if (room->table.at[i].flags.count)
                memset(room->table.at[i].flags.at, PARTICLE_DIED | PARTICLE_OUTSIDE | PARTICLE_BAD,
                       (size_t)room->table.at[i].flags.count);
    }
    for (jsl_iter it = jsl_query_begin(room->ecs, room->particles, 0); jsl_query_next(&it, &rows);)
        JSL_TRY(retire_table(room, &rows, context));
    return JSL_OK;
}
