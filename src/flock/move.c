/* SPDX-License-Identifier: MIT
 * Boids move by what they decided, flock by flock along the rows.
 */
#include "flock/move.h"
#include "flock/room.h"

#define RUN 1024

typedef struct columns {
    jsl_position_columns p;
    jsl_velocity_columns v;
    jsl_boid_columns b;
} columns;

static void freeze(const jsl_step_context *context, const jsl_rows *rows, const columns *c,
                   int64_t begin, int64_t count, const uint8_t *bad) {
    for (int64_t i = 0; i < count; i++) {
        if (!bad[i]) continue;
        c->b.ax[begin + i] = c->b.ay[begin + i] = c->b.az[begin + i] = 0;
        jsl_warn(context, JSL_WARN_BAD_STATE, 1, rows->entity[begin + i]);
    }
}

/* Rows [begin, end) are of one flock. */
static void move_run(const jsl_step_context *context, const jsl_rows *rows, const columns *c,
                     const jsl_motion_limits *limits, int64_t begin, int64_t end) {
    uint8_t bad[RUN];
    for (; begin < end; begin += RUN) {
        const int64_t n = end - begin < RUN ? end - begin : RUN;
        const jsl_motion m = {c->p.px + begin, c->p.py + begin, c->p.pz + begin,
                              c->v.vx + begin, c->v.vy + begin, c->v.vz + begin,
                              c->b.ax + begin, c->b.ay + begin, c->b.az + begin};
        memset(bad, 0, (size_t)n);
        if (JSL_KERNEL_PICK(context->isa, jsl_flock_move)(limits, &m, n, bad) > 0)
            freeze(context, rows, c, begin, n, bad);
    }
}

void jsl_flock_move_rows(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    jsl_flock_room *room = user;
    if (!(context->dt > 0)) return;
    const columns c = {jsl_position_of(rows, 0), jsl_velocity_of(rows, 1), jsl_boid_of(rows, 2)};
    bool is_body = false;
    for (int64_t t = 0; t < room->table.count; t++)
        if (room->table.at[t].rows.table == rows->table) is_body = room->table.at[t].is_body;
    uint32_t f = JSL_FLOCK_NONE;
    for (int64_t i = 0, e; i < rows->count; i = e) {
        const jsl_entity flock = c.b.flock[i];
        f = jsl_flock_number(room, flock, f);
        jsl_motion_limits limits = {
            .dt = context->dt, .max_speed = JSL_R(1e30), .pushes_only = is_body};
        jsl_entity leader = {0};
        if (f != JSL_FLOCK_NONE) {
            const jsl_flock_state *s = &room->state.at[f];
            limits.max_speed = s->value.max_speed;
            limits.min_speed = s->value.min_speed;
            limits.max_accel = s->value.max_accel;
            if (s->scripted) leader = s->value.leader;
        }
        for (e = i; e < rows->count && jsl_entity_equal(c.b.flock[e], flock); e++)
            if (!jsl_entity_is_null(leader) && jsl_entity_equal(rows->entity[e], leader)) break;
        if (e > i) move_run(context, rows, &c, &limits, i, e);
        if (e < rows->count && !jsl_entity_is_null(leader) &&
            jsl_entity_equal(rows->entity[e], leader))
            e++;
    }
}
