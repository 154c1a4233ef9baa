/* SPDX-License-Identifier: MIT
 * Decisions: boids are handled in chunks of places; within a chunk those of one flock look, avoid
 * and negotiate together. Everything a chunk reads is the old state, everything it writes is its
 * own.
 */
#include "flock/room.h"

#define MAX_THREATS 256 /* obstacles looked at together */
/* Boids that share candidates, and the cells they may lie in: more save copying, fewer save
 * looking. */
#define GAZE_BOIDS 6
#define GAZE_CELLS (2 * JSL_FLOCK_SPLIT)

typedef struct scratch {
    jsl_sense_scratch sense;
    jsl_deciders boids;
    jsl_gaze gaze[JSL_FLOCK_CHUNK];
    int64_t who[JSL_FLOCK_CHUNK]; /* places of the boids that decide */
    int count;
} scratch;

typedef struct job {
    const jsl_step_context *context;
    jsl_flock_room *room;
    scratch *scratch;       /* [worker] */
    jsl_obstacle *obstacle; /* item by item of the collider set */
    uint32_t *obstacle_flock;
    jsl_real fastest; /* obstacle, m/s */
} job;

/* -- Who decides
 * ----------------------------------------------------------------------------------------- */

/* A boid without a flock, or led along a path, wants nothing. */
static void want_nothing(jsl_flock_room *room, int64_t place) {
    int64_t row;
    const jsl_boid_table *t = jsl_flock_home(room, place, &row);
    t->boid.ax[row] = t->boid.ay[row] = t->boid.az[row] = 0;
    t->boid.neighbours[row] = 0;
}

/* Boids of places [begin, end) whose turn it is: entity slots take turns. */
static void gather(const job *j, const jsl_flock_state *f, int64_t begin, int64_t end, scratch *s) {
    const jsl_flock_room *room = j->room;
    const jsl_sight *c = &room->sight;
    const jsl_real *const at[3] = {c->x, c->y, c->z}, *const matched[3] = {c->ux, c->uy, c->uz};
    const uint32_t period = f->value.period, turn = (uint32_t)(j->context->step % period);
    jsl_deciders *b = &s->boids;
    int n = 0;
    for (int64_t i = begin; i < end; i++) {
        int64_t row;
        if (period > 1 && jsl_flock_home(room, i, &row)->rows.entity[row].index % period != turn)
            continue;
        s->who[n++] = i;
    }
    s->count = n;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < n; i++) b->p[k][i] = at[k][s->who[i]];
        for (int i = 0; i < n; i++) b->u[k][i] = matched[k][s->who[i]];
        memcpy(b->h[k], b->u[k], (size_t)n * sizeof(jsl_real));
        memset(b->avoid[k], 0, (size_t)n * sizeof(jsl_real));
    }
    if (f->value.response != JSL_FLOCK_DIRECTION)
        JSL_KERNEL_PICK(j->context->isa, jsl_flock_heading)(b->h[0], b->h[1], b->h[2], n);
    if (!f->led && !j->obstacle) return;
    for (int i = 0; i < n; i++) {
        int64_t row;
        const jsl_boid_table *t = jsl_flock_home(room, s->who[i], &row);
        b->v[0][i] = t->velocity.vx[row];
        b->v[1][i] = t->velocity.vy[row];
        b->v[2][i] = t->velocity.vz[row];
    }
}

static jsl_entity entity_at(const jsl_flock_room *room, int64_t place) {
    int64_t row;
    return jsl_flock_home(room, place, &row)->rows.entity[row];
}

/* -- Perception
 * ------------------------------------------------------------------------------------------ */

/* The nine runs of places around cells x0..x1 of row (y, z). */
static int spans_around(const jsl_flock_room *room, const jsl_flock_grid *g, int64_t x0, int64_t x1,
                        int64_t y, int64_t z, int64_t *hint, jsl_span *out) {
    int n = 0;
    const int64_t lo = x0 > JSL_FLOCK_SPLIT ? x0 - JSL_FLOCK_SPLIT : 0;
    const int64_t hi = x1 + JSL_FLOCK_SPLIT < g->nx ? x1 + JSL_FLOCK_SPLIT : g->nx - 1;
    for (int64_t dz = -1; dz <= 1; dz++) {
        if (z + dz < 0 || z + dz >= g->nz) continue;
        for (int64_t dy = -1; dy <= 1; dy++) {
            if (y + dy < 0 || y + dy >= g->ny) continue;
            const uint64_t row = g->base + (uint64_t)(((z + dz) * g->ny + y + dy) * g->nx);
            int64_t *h = &hint[3 * (dz + 1) + dy + 1];
            jsl_span span;
            span.begin = jsl_flock_place(room, row + (uint64_t)lo, h);
            int64_t from = span.begin;
            span.end = jsl_flock_place(room, row + (uint64_t)hi + 1, &from);
            if (span.end > span.begin) out[n++] = span;
        }
    }
    return n;
}

/* Groups the deciding boids: neighbours along a row of cells share what they look at. */
static int group(const jsl_flock_room *room, const jsl_flock_state *f, scratch *s) {
    const jsl_flock_grid *g = &f->grid;
    const uint64_t *key = room->key.at;
    int64_t hint[9] = {0}, row = 0;
    uint64_t row_begin = 0, row_end = 0;
    int gazes = 0;
    for (int i = 0; i < s->count;) {
        const uint64_t first = key[s->who[i]];
        if (first >= row_end) {
            row = (int64_t)((first - g->base) / (uint64_t)g->nx);
            row_begin = g->base + (uint64_t)(row * g->nx);
            row_end = row_begin + (uint64_t)g->nx;
        }
        uint64_t last = first;
        int e = i + 1;
        for (; e < s->count; e++) {
            const uint64_t next = key[s->who[e]];
            if (next == last) continue;
            if (next >= row_end || e - i >= GAZE_BOIDS || next >= first + GAZE_CELLS) break;
            last = next;
        }
        jsl_gaze *gaze = &s->gaze[gazes++];
        gaze->begin = i;
        gaze->end = e;
        gaze->spans =
            spans_around(room, g, (int64_t)(first - row_begin), (int64_t)(last - row_begin),
                         row % g->ny, row / g->ny, hint, gaze->span);
        i = e;
    }
    return gazes;
}

/* Boids at exactly the same place have no direction apart: each gets one from its id, as at a
 * hundredth of the reach. */
static void part_company(const jsl_flock_room *room, const jsl_flock_state *f, scratch *s) {
    if (f->lens.radius_sq[JSL_SEPARATION] < 0) return;
    const jsl_real push = 100 / jsl_sqrt(f->lens.reach_sq);
    for (int i = 0; i < s->count; i++) {
        if (!(s->sense.sense[JSL_COUNT_SAME][i] > 1)) continue;
        jsl_rng rng = jsl_rng_make(0, jsl_entity_id(entity_at(room, s->who[i])), 0, 0);
        jsl_vec3 d;
        d.x = jsl_rng_signed(&rng);
        d.y = jsl_rng_signed(&rng);
        d.z = jsl_rng_signed(&rng);
        d = jsl_scale(jsl_normalize(d), push);
        s->sense.sense[JSL_SUM_SEPARATION][i] -= d.x;
        s->sense.sense[JSL_SUM_SEPARATION + 1][i] -= d.y;
        s->sense.sense[JSL_SUM_SEPARATION + 2][i] -= d.z;
    }
}

static void look(const job *j, const jsl_flock_state *f, scratch *s) {
    jsl_deciders *b = &s->boids;
    if (!(f->lens.reach_sq > 0)) {
        for (int k = 0; k < JSL_SENSES; k++)
            memset(s->sense.sense[k], 0, (size_t)s->count * sizeof(jsl_real));
        return;
    }
    const jsl_real *const heading[3] = {b->h[0], b->h[1], b->h[2]};
    const int gazes = group(j->room, f, s);
    JSL_KERNEL_PICK(j->context->isa, jsl_flock_sense)
    (&f->lens, &j->room->sight, s->gaze, gazes, s->who, heading, &s->sense);
    part_company(j->room, f, s);
}

/* -- Obstacles
 * ------------------------------------------------------------------------------------------- */

static jsl_result prepare_obstacles(job *j) {
    const jsl_collider_set *set = j->context->colliders;
    j->obstacle = NULL;
    j->fastest = 0;
    if (!set || set->item.count == 0) return JSL_OK;
    j->obstacle = JSL_ARENA_NEW(j->context->arena, jsl_obstacle, set->item.count);
    j->obstacle_flock = JSL_ARENA_NEW(j->context->arena, uint32_t, set->item.count);
    if (!j->obstacle || !j->obstacle_flock) return JSL_ERR_MEMORY;
    for (int64_t i = 0; i < set->item.count; i++) {
        const jsl_collider_item *item = &set->item.at[i];
        jsl_rows rows;
        jsl_obstacle_from(item, &j->obstacle[i]);
        j->fastest = jsl_max(j->fastest, jsl_length(j->obstacle[i].velocity));
        j->obstacle_flock[i] = JSL_FLOCK_NONE;
        if (jsl_entity_has(j->room->ecs, item->entity, j->room->boid) &&
            jsl_rows_of_entity(j->room->ecs, item->entity, j->room->boid, &rows) == JSL_OK)
            j->obstacle_flock[i] = jsl_flock_number(j->room, *jsl_boid_of(&rows, 0).flock, 0);
    }
    return JSL_OK;
}

/* Where boids [begin, end) and everything they may hit within the horizon can be. */
static jsl_aabb reachable(const scratch *s, int begin, int end, jsl_real horizon, jsl_real grow) {
    jsl_aabb box = {{JSL_R(1e30), JSL_R(1e30), JSL_R(1e30)},
                    {JSL_R(-1e30), JSL_R(-1e30), JSL_R(-1e30)}};
    jsl_real *lo[3] = {&box.lo.x, &box.lo.y, &box.lo.z}, *hi[3] = {&box.hi.x, &box.hi.y, &box.hi.z};
    for (int k = 0; k < 3; k++) {
        for (int i = begin; i < end; i++) {
            const jsl_real a = s->boids.p[k][i], b = a + s->boids.v[k][i] * horizon;
            *lo[k] = jsl_min(*lo[k], jsl_min(a, b));
            *hi[k] = jsl_max(*hi[k], jsl_max(a, b));
        }
        *lo[k] -= grow;
        *hi[k] += grow;
    }
    return box;
}

/* Obstacles that matter to boids [begin, end), at most MAX_THREATS: a crowd of obstacles is looked
 * at over a shorter horizon, as the nearest come first. */
static int threats(const job *j, const scratch *s, int begin, int end, jsl_avoider *boid,
                   int32_t *list) {
    for (int tries = 0;; tries++) {
        const jsl_real grow = boid->room + j->fastest * boid->horizon;
        const jsl_aabb box = reachable(s, begin, end, boid->horizon, grow);
        const int64_t n = jsl_collider_set_overlap(j->context->colliders, box, list, MAX_THREATS);
        if (n <= MAX_THREATS) return (int)n;
        if (end - begin > 1) return -1;
        if (tries == 8) return MAX_THREATS;
        boid->horizon /= 2;
    }
}

static void avoid_one(const job *j, uint32_t flock, scratch *s, int i, jsl_avoider *boid,
                      const int32_t *list, int count) {
    const jsl_deciders *b = &s->boids;
    int32_t mine[MAX_THREATS];
    int n = 0;
    boid->p = jsl_v3(b->p[0][i], b->p[1][i], b->p[2][i]);
    boid->v = jsl_v3(b->v[0][i], b->v[1][i], b->v[2][i]);
    const jsl_entity self = entity_at(j->room, s->who[i]);
    boid->who = jsl_entity_id(self);
    const jsl_real speed = jsl_length(boid->v) + j->fastest;
    for (int k = 0; k < count; k++) {
        const jsl_obstacle *o = &j->obstacle[list[k]];
        if (jsl_entity_equal(o->entity, self) || j->obstacle_flock[list[k]] == flock) continue;
        const jsl_real far = speed * boid->horizon + boid->room + o->radius + o->half;
        if (!o->plane && jsl_length_sq(jsl_sub(o->centre, boid->p)) > far * far) continue;
        mine[n++] = list[k];
    }
    const jsl_vec3 a = jsl_avoid(boid, j->obstacle, mine, n);
    s->boids.avoid[0][i] = a.x;
    s->boids.avoid[1][i] = a.y;
    s->boids.avoid[2][i] = a.z;
}

static void avoid(const job *j, uint32_t flock, scratch *s) {
    const jsl_flock_values *v = &j->room->state.at[flock].value;
    if (!j->obstacle || (v->flock_flags & JSL_FLOCK_IGNORES_OBSTACLES)) return;
    const jsl_avoider plain = {.room = v->boid_radius + v->avoid_margin,
                               .horizon = v->avoid_horizon,
                               .budget = v->max_accel,
                               .interval = j->context->dt * (jsl_real)v->period};
    int32_t list[MAX_THREATS];
    const int step = 32;
    for (int begin = 0; begin < s->count; begin += step) {
        const int end = begin + step < s->count ? begin + step : s->count;
        jsl_avoider boid = plain;
        const int n = threats(j, s, begin, end, &boid, list);
        if (n == 0) continue;
        for (int i = begin; i < end; i++) {
            int own = n;
            boid = plain;
            if (n < 0) own = threats(j, s, i, i + 1, &boid, list);
            avoid_one(j, flock, s, i, &boid, list, own);
        }
    }
}

/* -- Negotiation
 * ----------------------------------------------------------------------------------------- */

static jsl_decision decision_of(const jsl_flock_state *f, bool is_leader) {
    const jsl_flock_values *v = &f->value;
    jsl_decision d = {.weight = {v->separation_radius > 0 ? v->separation_weight : 0,
                                 v->alignment_radius > 0 ? v->alignment_weight : 0,
                                 v->cohesion_radius > 0 ? v->cohesion_weight : 0},
                      .budget = v->max_accel,
                      .response = (int)v->response,
                      .negotiation = (int)v->negotiation,
                      .urge = {v->urge_x, v->urge_y, v->urge_z},
                      .bounded = v->flock_flags & JSL_FLOCK_HAS_BOUNDS,
                      .lo = {v->lo_x, v->lo_y, v->lo_z},
                      .hi = {v->hi_x, v->hi_y, v->hi_z},
                      .bounds_weight = v->bounds_weight,
                      .led = f->led && !is_leader,
                      .target_velocity = f->leader_velocity,
                      .follow = v->leader_weight,
                      .max_speed = v->max_speed};
    const jsl_vec3 ahead = jsl_normalize(f->leader_velocity);
    d.target = jsl_mul_add(f->leader_at, -v->leader_gap, ahead);
    return d;
}

static void decide(const job *j, uint32_t flock, int64_t begin, int64_t end, bool is_leader,
                   scratch *s) {
    const jsl_flock_state *f = &j->room->state.at[flock];
    gather(j, f, begin, end, s);
    if (s->count == 0) return;
    look(j, f, s);
    avoid(j, flock, s);
    const jsl_decision d = decision_of(f, is_leader);
    JSL_KERNEL_PICK(j->context->isa, jsl_flock_decide)
    (&d, &s->sense, &s->boids, (int)jsl_round_up(s->count, JSL_LANES));
    for (int i = 0; i < s->count; i++) {
        int64_t row;
        const jsl_boid_table *t = jsl_flock_home(j->room, s->who[i], &row);
        t->boid.ax[row] = s->boids.a[0][i];
        t->boid.ay[row] = s->boids.a[1][i];
        t->boid.az[row] = s->boids.a[2][i];
        t->boid.neighbours[row] = (uint32_t)s->sense.sense[JSL_COUNT_ANY][i];
    }
}

static bool is_leader_at(const jsl_flock_room *room, const jsl_flock_state *f, int64_t place) {
    int64_t row;
    const jsl_boid_table *t = jsl_flock_home(room, place, &row);
    return jsl_entity_equal(t->rows.entity[row], f->value.leader);
}

static void steer_chunk(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    const job *j = arg;
    jsl_flock_room *room = j->room;
    scratch *s = &j->scratch[worker];
    (void)block;
    const int64_t flocks = room->state.count;
    int64_t f = 0;
    while (f < flocks && room->flock_begin.at[f + 1] <= begin) f++;
    for (int64_t i = begin; i < end;) {
        if (f == flocks || !room->state.at[f].active) {
            want_nothing(room, i++);
        } else {
            const jsl_flock_state *state = &room->state.at[f];
            int64_t stop = room->flock_begin.at[f + 1] < end ? room->flock_begin.at[f + 1] : end;
            if (state->led) { /* a leader decides alone */
                int64_t at = i;
                while (at < stop && !is_leader_at(room, state, at)) at++;
                const bool alone = at == i;
                stop = alone && at < stop ? i + 1 : at;
                if (alone && state->scripted)
                    want_nothing(room, i);
                else
                    decide(j, (uint32_t)f, i, stop, alone, s);
            } else {
                decide(j, (uint32_t)f, i, stop, false, s);
            }
            i = stop;
        }
        while (f < flocks && room->flock_begin.at[f + 1] <= i) f++;
    }
}

jsl_result jsl_flock_steer(const jsl_step_context *context, void *user) {
    jsl_flock_room *room = user;
    if (!jsl_flock_index_holds(room)) JSL_TRY(jsl_flock_index(context, room));
    if (!room->ready) return JSL_OK;
    const int workers = context->exec ? context->exec->tasks.workers : 1;
    job j = {.context = context, .room = room};
    j.scratch = jsl_arena_zero(context->arena, workers * (int64_t)sizeof(scratch));
    jsl_result result = j.scratch ? prepare_obstacles(&j) : JSL_ERR_MEMORY;
    if (result == JSL_ERR_MEMORY) {
        jsl_warn(context, JSL_WARN_OUT_OF_MEMORY, 1, (jsl_entity){0});
        return JSL_OK;
    }
    jsl_parallel_for(context->exec, room->count, JSL_FLOCK_CHUNK, steer_chunk, &j);
    return result;
}
