/* SPDX-License-Identifier: MIT
 * jostle bench flock: nanoseconds per boid and step with the rules and radii of OpenSteer's boids,
 * beside a plain scalar implementation of the same rules over a grid, in the same run.
 */
#include "bench_flock.h"

#include "base/base.h"
#include "ecs/ecs.h"
#include "flock/flock.h"

#include <stdio.h>
#include <stdlib.h>

/* Separation, alignment, cohesion: radius, cosine, weight; nearer than NEAR always counts. */
static const jsl_real radius[3] = {5, JSL_R(7.5), 9},
                      cosine[3] = {JSL_R(-0.707), JSL_R(0.7), JSL_R(-0.15)};
static const jsl_real weight[3] = {12, 8, 8};
#define NEAR JSL_R(1.5)
#define MAX_ACCEL 27
#define MAX_SPEED 9
#define DT JSL_R(1.0 / 60)

/* -- The plain way
 * ------------------------------------------------------------------------------------- */

enum { PX, PY, PZ, HX, HY, HZ, SPEED, AX, AY, AZ, PLAIN_COLUMNS };

typedef struct plain {
    int n, side;
    jsl_real lo, cell;
    jsl_real *at[PLAIN_COLUMNS], *to[PLAIN_COLUMNS];
    int *where, *start, *id, *to_id;
} plain;

static void plain_free(plain *p) {
    for (int k = 0; k < PLAIN_COLUMNS; k++) {
        free(p->at[k]);
        free(p->to[k]);
    }
    free(p->where);
    free(p->start);
    free(p->id);
    free(p->to_id);
}

static bool plain_open(plain *p, const jsl_real *const state[6], int n, double lo, double side) {
    *p = (plain){.n = n, .lo = (jsl_real)lo, .cell = 9};
    p->side = (int)(side / 9) + 1;
    bool fine = true;
    for (int k = 0; k < PLAIN_COLUMNS; k++) {
        p->at[k] = calloc((size_t)n, sizeof(jsl_real));
        p->to[k] = calloc((size_t)n, sizeof(jsl_real));
        fine = fine && p->at[k] && p->to[k];
    }
    p->where = calloc((size_t)n, sizeof(int));
    p->id = calloc((size_t)n, sizeof(int));
    p->to_id = calloc((size_t)n, sizeof(int));
    p->start = calloc((size_t)p->side * (size_t)p->side * (size_t)p->side + 2, sizeof(int));
    if (!fine || !p->where || !p->start || !p->id || !p->to_id) return false;
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++) p->at[k][i] = state[k][i];
        const jsl_vec3 v = jsl_v3(state[3][i], state[4][i], state[5][i]), h = jsl_normalize(v);
        p->at[HX][i] = h.x, p->at[HY][i] = h.y, p->at[HZ][i] = h.z;
        p->at[SPEED][i] = jsl_length(v);
        p->id[i] = i;
    }
    return true;
}

static int plain_cell(const plain *p, jsl_real x) {
    const int c = (int)((x - p->lo) / p->cell);
    return c < 0 ? 0 : c >= p->side ? p->side - 1 : c;
}

static void plain_sort(plain *p) {
    const size_t cells = (size_t)p->side * (size_t)p->side * (size_t)p->side;
    memset(p->start, 0, (cells + 2) * sizeof(int));
    for (int i = 0; i < p->n; i++) {
        const int x = plain_cell(p, p->at[PX][i]), y = plain_cell(p, p->at[PY][i]);
        p->where[i] = (plain_cell(p, p->at[PZ][i]) * p->side + y) * p->side + x;
        p->start[p->where[i] + 2]++;
    }
    for (size_t c = 2; c < cells + 2; c++) p->start[c] += p->start[c - 1];
    for (int i = 0; i < p->n; i++) {
        const int to = p->start[p->where[i] + 1]++;
        for (int k = 0; k < PLAIN_COLUMNS; k++) p->to[k][to] = p->at[k][i];
        p->to_id[to] = p->id[i];
    }
    for (int k = 0; k < PLAIN_COLUMNS; k++) {
        jsl_real *swap = p->at[k];
        p->at[k] = p->to[k];
        p->to[k] = swap;
    }
    int *swap = p->id;
    p->id = p->to_id;
    p->to_id = swap;
}

/* Sums over candidates [begin, end) for boid i: separation, headings, offsets, and two counts. */
static void plain_sum(const plain *p, int i, int begin, int end, jsl_real s[11]) {
    const jsl_real x = p->at[PX][i], y = p->at[PY][i], z = p->at[PZ][i];
    const jsl_real hx = p->at[HX][i], hy = p->at[HY][i], hz = p->at[HZ][i];
    for (int j = begin; j < end; j++) {
        const jsl_real dx = p->at[PX][j] - x, dy = p->at[PY][j] - y, dz = p->at[PZ][j] - z;
        const jsl_real d2 = dx * dx + dy * dy + dz * dz;
        if (d2 > radius[2] * radius[2] || j == i) continue;
        const jsl_real c = (dx * hx + dy * hy + dz * hz) / jsl_sqrt(d2);
        const bool near = d2 < NEAR * NEAR;
        if (near || (d2 <= radius[0] * radius[0] && c > cosine[0])) {
            const jsl_real w = 1 / d2;
            s[0] -= dx * w, s[1] -= dy * w, s[2] -= dz * w;
        }
        if (near || (d2 <= radius[1] * radius[1] && c > cosine[1])) {
            s[3] += p->at[HX][j], s[4] += p->at[HY][j], s[5] += p->at[HZ][j], s[9] += 1;
        }
        if (near || c > cosine[2]) s[6] += dx, s[7] += dy, s[8] += dz, s[10] += 1;
    }
}

static void plain_force(plain *p, int i) {
    const int n = p->side;
    const int cx = plain_cell(p, p->at[PX][i]), cy = plain_cell(p, p->at[PY][i]);
    const int cz = plain_cell(p, p->at[PZ][i]), x0 = cx > 0 ? cx - 1 : 0,
              x1 = cx < n - 1 ? cx + 1 : n - 1;
    jsl_real s[11] = {0};
    for (int z = cz > 0 ? cz - 1 : 0; z <= cz + 1 && z < n; z++)
        for (int y = cy > 0 ? cy - 1 : 0; y <= cy + 1 && y < n; y++) {
            const int row = (z * n + y) * n;
            plain_sum(p, i, p->start[row + x0], p->start[row + x1 + 1], s);
        }
    const jsl_vec3 away = jsl_normalize(jsl_v3(s[0], s[1], s[2]));
    jsl_vec3 match = {0, 0, 0}, gather = {0, 0, 0};
    if (s[9] > 0)
        match = jsl_normalize(jsl_v3(s[3] / s[9] - p->at[HX][i], s[4] / s[9] - p->at[HY][i],
                                     s[5] / s[9] - p->at[HZ][i]));
    if (s[10] > 0) gather = jsl_normalize(jsl_v3(s[6], s[7], s[8]));
    jsl_vec3 a =
        jsl_mul_add(jsl_mul_add(jsl_scale(away, weight[0]), weight[1], match), weight[2], gather);
    const jsl_real length = jsl_length(a);
    if (length > MAX_ACCEL) a = jsl_scale(a, MAX_ACCEL / length);
    p->at[AX][i] = a.x, p->at[AY][i] = a.y, p->at[AZ][i] = a.z;
}

static void plain_move(plain *p) {
    for (int i = 0; i < p->n; i++) {
        const jsl_real speed = p->at[SPEED][i];
        jsl_vec3 v = jsl_scale(jsl_v3(p->at[HX][i], p->at[HY][i], p->at[HZ][i]), speed);
        v = jsl_mul_add(v, DT, jsl_v3(p->at[AX][i], p->at[AY][i], p->at[AZ][i]));
        const jsl_real now = jsl_length(v);
        const jsl_vec3 h = now > 0 ? jsl_scale(v, 1 / now) : v;
        p->at[SPEED][i] = jsl_min(now, MAX_SPEED);
        p->at[HX][i] = h.x, p->at[HY][i] = h.y, p->at[HZ][i] = h.z;
        p->at[PX][i] += h.x * p->at[SPEED][i] * DT;
        p->at[PY][i] += h.y * p->at[SPEED][i] * DT;
        p->at[PZ][i] += h.z * p->at[SPEED][i] * DT;
    }
}

/* -- Ours
 * ---------------------------------------------------------------------------------------------- */

typedef struct ours {
    jsl_memory memory;
    jsl_exec exec;
    jsl_arena arena;
    jsl_ecs *ecs;
    jsl_flock_room *room;
    jsl_warnings warnings;
    jsl_step_context context;
    jsl_entity *boid;
    int n;
} ours;

static void ours_close(ours *o) {
    jsl_flock_room_destroy(o->room);
    if (o->arena.memory) jsl_arena_fini(&o->arena);
    jsl_exec_fini(&o->exec, &o->memory);
    jsl_ecs_destroy(o->ecs);
    free(o->boid);
}

static bool ours_open(ours *o, int n, double half, int threads, int period) {
    *o = (ours){.n = n};
    o->boid = calloc((size_t)n, sizeof *o->boid);
    if (!o->boid || jsl_memory_init(&o->memory, (jsl_allocator){0}) != JSL_OK) return false;
    if (jsl_exec_init(&o->exec, &o->memory, (jsl_tasks){0}, threads) != JSL_OK) return false;
    jsl_arena_init(&o->arena, &o->memory);
    if (jsl_ecs_create(&(jsl_ecs_desc){0}, &o->ecs) != JSL_OK) return false;
    if (jsl_flock_room_create(o->ecs, &o->room) != JSL_OK) return false;
    jsl_flock flock;
    const jsl_flock_desc desc = {.max_accel = MAX_ACCEL,
                                 .max_speed = MAX_SPEED,
                                 .negotiation = JSL_FLOCK_BLEND,
                                 .period = period};
    const jsl_real h = (jsl_real)half;
    const jsl_boid_spawn spawn = {.half = {h, h, h}, .velocity_spread = 4};
    if (jsl_flock_room_flock_create(o->room, &desc, &flock) != JSL_OK) return false;
    if (jsl_flock_room_boid_create_n(o->room, 1, flock, n, &spawn, o->boid) != JSL_OK) return false;
    o->context = (jsl_step_context){.dt = DT,
                                    .inv_dt = 1 / DT,
                                    .substeps = 1,
                                    .workers = threads,
                                    .isa = jsl_isa_resolve(JSL_ISA_AUTO),
                                    .ecs = o->ecs,
                                    .warnings = &o->warnings,
                                    .exec = &o->exec,
                                    .memory = jsl_ecs_memory(o->ecs),
                                    .arena = &o->arena};
    return true;
}

static bool ours_run(ours *o, jsl_stage last) {
    for (int stage = JSL_STAGE_INDEX; stage <= (int)last; stage++)
        if (jsl_schedule_run(o->ecs, (jsl_stage)stage, &o->context) != JSL_OK) return false;
    return true;
}

static bool ours_step(ours *o) {
    const bool fine = ours_run(o, JSL_STAGE_MOVE);
    o->context.step++;
    o->context.time += (double)DT;
    return fine;
}

/* Component `name` of boid i: its first field in out[0..2], from field `first` on. */
static jsl_vec3 ours_read(const ours *o, int i, const char *name, int first) {
    jsl_component c = {0};
    if (jsl_component_find(o->ecs, name, &c) != JSL_OK) return jsl_v3(0, 0, 0);
    jsl_real v[3];
    for (int k = 0; k < 3; k++)
        v[k] = *(jsl_real *)jsl_entity_field(o->ecs, o->boid[i], c, first + k);
    return jsl_v3(v[0], v[1], v[2]);
}

/* -- Measuring
 * ----------------------------------------------------------------------------------------- */

/* One step (or `group` of them) of ours, in ns per boid and step; negative when it failed. */
static double time_ours(ours *o, int group) {
    const double t = jsl_seconds();
    for (int k = 0; k < group; k++)
        if (!ours_step(o)) return -1;
    return (jsl_seconds() - t) * 1e9 / group / o->n;
}

static double time_plain(plain *p) {
    const double t = jsl_seconds();
    plain_sort(p);
    for (int k = 0; k < p->n; k++) plain_force(p, k);
    plain_move(p);
    return (jsl_seconds() - t) * 1e9 / p->n;
}

/* The plain implementation started from the same state. */
static bool plain_of(plain *p, const ours *o, double half) {
    jsl_real *state[6] = {0};
    bool fine = true;
    for (int k = 0; k < 6; k++) {
        state[k] = calloc((size_t)o->n, sizeof(jsl_real));
        fine = fine && state[k];
    }
    for (int i = 0; fine && i < o->n; i++) {
        const jsl_vec3 x = ours_read(o, i, "position", 0), v = ours_read(o, i, "velocity", 0);
        state[0][i] = x.x, state[1][i] = x.y, state[2][i] = x.z;
        state[3][i] = v.x, state[4][i] = v.y, state[5][i] = v.z;
    }
    const jsl_real *const view[6] = {state[0], state[1], state[2], state[3], state[4], state[5]};
    fine = fine && plain_open(p, view, o->n, -half, 2 * half);
    for (int k = 0; k < 6; k++) free(state[k]);
    return fine;
}

/* Largest difference of the accelerations that both decide from the same state. */
static double disagreement(ours *o, double half) {
    plain p = {0};
    double worst = -1;
    if (plain_of(&p, o, half) && ours_run(o, JSL_STAGE_DECIDE)) {
        plain_sort(&p);
        worst = 0;
        for (int i = 0; i < p.n; i++) plain_force(&p, i);
        for (int i = 0; i < p.n; i++) {
            const jsl_vec3 a = jsl_v3(p.at[AX][i], p.at[AY][i], p.at[AZ][i]);
            const double d = (double)jsl_length(jsl_sub(a, ours_read(o, p.id[i], "boid", 1)));
            if (d > worst) worst = d;
        }
    }
    plain_free(&p);
    return worst;
}

/* RMS distance between the same boids after a second, flown with decisions every step and every
 * period-th. */
static double stagger_error(int n, double half, int period) {
    ours a = {0}, b = {0};
    double sum = -1;
    if (ours_open(&a, n, half, 1, 1) && ours_open(&b, n, half, 1, period)) {
        for (int i = 0; i < 60; i++)
            if (!ours_step(&a) || !ours_step(&b)) break;
        sum = 0;
        for (int i = 0; i < n; i++)
            sum += (double)jsl_length_sq(
                jsl_sub(ours_read(&a, i, "position", 0), ours_read(&b, i, "position", 0)));
    }
    ours_close(&a);
    ours_close(&b);
    return sum < 0 ? sum : sqrt(sum / n);
}

/* Contestants of one size: decisions every step on one and two threads, every 2nd and 4th on one.
 */
enum { ONE, TWO, HALF, QUARTER, CONTESTANTS };

/* Best of several rounds: other work on the machine only ever adds. Contestants take turns, so that
 * it adds to all alike. */
static bool race(ours all[CONTESTANTS], plain *p, int rounds, double best[CONTESTANTS],
                 double *scalar) {
    static const int group[CONTESTANTS] = {1, 1, 2, 4};
    *scalar = 1e30;
    for (int k = 0; k < CONTESTANTS; k++) {
        best[k] = 1e30;
        for (int i = 0; i < 2 * group[k]; i++)
            if (!ours_step(&all[k])) return false;
    }
    for (int i = 0; i < rounds; i++) {
        for (int k = 0; k < CONTESTANTS; k++) {
            const double now = time_ours(&all[k], group[k]);
            if (now < 0) return false;
            if (now < best[k]) best[k] = now;
        }
        if (i % 3) continue;
        const double now = time_plain(p);
        if (now < *scalar) *scalar = now;
    }
    return true;
}

static int bench_size(jsl_bench_emit *emit, int n, int neighbours) {
    const double half = 4.5 * cbrt(n * 4.18879 / neighbours);
    const int rounds = n >= 1000000 ? 4 : n >= 100000 ? 12 : 60;
    static const int threads[CONTESTANTS] = {1, 2, 1, 1}, period[CONTESTANTS] = {1, 1, 2, 4};
    ours all[CONTESTANTS];
    memset(all, 0, sizeof all);
    plain p = {0};
    double best[CONTESTANTS], scalar = 0;
    bool fine = true;
    for (int k = 0; k < CONTESTANTS && fine; k++)
        fine = ours_open(&all[k], n, half, threads[k], period[k]);
    fine = fine && plain_of(&p, &all[ONE], half) && race(all, &p, rounds, best, &scalar);
    plain_free(&p);
    for (int k = 0; k < CONTESTANTS; k++) ours_close(&all[k]);
    if (!fine) return 1;
    char name[64];
    for (int k = 0; k < CONTESTANTS; k++) {
        if (k <= TWO) {
            snprintf(name, sizeof name, "step, %d neighbours", neighbours);
            emit(name, n, threads[k], best[k], "ns/boid/step", "plain scalar grid, 1 thread",
                 scalar);
        } else {
            snprintf(name, sizeof name, "decide every %d steps, %d neighbours", period[k],
                     neighbours);
            emit(name, n, 1, best[k], "ns/boid/step", "every step", best[ONE]);
        }
    }
    return 0;
}

int jsl_bench_flock(jsl_bench_emit *emit) {
    const int sizes[] = {10000, 100000, 1000000}, neighbours[] = {7, 30};
    for (int k = 0; k < 2; k++) {
        const int n = 10000;
        const double half = 4.5 * cbrt(n * 4.18879 / neighbours[k]);
        char name[64];
        ours o = {0};
        const double worst = ours_open(&o, n, half, 1, 1) ? disagreement(&o, half) : -1;
        ours_close(&o);
        if (worst < 0) return 1;
        snprintf(name, sizeof name, "largest difference of accelerations, %d neighbours",
                 neighbours[k]);
        emit(name, n, 1, worst, "m/s^2", "budget", MAX_ACCEL);
        for (int period = 2; period <= 4; period *= 2) {
            snprintf(name, sizeof name, "rms error after 1 s, every %d steps, %d neighbours",
                     period, neighbours[k]);
            emit(name, n, 1, stagger_error(n, half, period), "m", "way flown at full speed",
                 MAX_SPEED);
        }
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            if (bench_size(emit, sizes[i], neighbours[k])) return 1;
    return 0;
}
