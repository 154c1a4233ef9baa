/* SPDX-License-Identifier: MIT
 * The index: boids in order of flock and cell, so that those around a boid are nine runs of an
 * array.
 *
 * Each flock has a grid of its own, just large enough for its boids. While the grids have a few
 * cells a boid, cells are sorted by counting, in two passes: into at most 256 buckets of
 * neighbouring cells by parts of the rows, then within each bucket; both passes are stable and
 * neither depends on the number of workers. When boids are so scattered that cells outnumber them
 * by far, (cell, boid) pairs are radix sorted and cells found by search: memory is bounded by the
 * number of boids, not by the room they take.
 *
 * The index keeps its own copy of what boids see of each other, which is also the old state that
 * all of them decide from. Rows of the tables follow the same order, but are only moved when they
 * have drifted well out of it.
 */
#include "flock/room.h"

#define BLOCK 4096
#define BUCKETS 256
#define MAX_PARTS 64

typedef struct extent {
    jsl_real lo[3], hi[3];
} extent;

typedef struct job {
    jsl_flock_room *room;
    const jsl_boid_table *table; /* survey and keys go table by table */
    extent *extents;             /* [worker][flock] */
    uint32_t *group;             /* flock of each boid, by number */
    uint64_t *pair;              /* dense: cell << 32 | number */
    uint64_t *bucketed;
    uint32_t *histogram; /* [part][bucket] */
    int64_t part;        /* rows of a part */
    int shift;           /* cell -> bucket */
    uint32_t bucket_begin[BUCKETS + 1];
    int64_t *breaks; /* [block] */
    jsl_isa isa;
} job;

/* -- Grids
 * -------------------------------------------------------------------------------------------- */

/* Flock and bounds of each boid. Bounds do not depend on the order, so workers keep their own. */
static void survey(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    job *j = arg;
    (void)block;
    const jsl_boid_table *t = j->table;
    const jsl_real *const p[3] = {t->position.px, t->position.py, t->position.pz};
    extent *all = j->extents + (int64_t)worker * j->room->state.count;
    uint32_t f = JSL_FLOCK_NONE;
    extent here = {{0}, {0}};
    for (int64_t i = begin; i < end; i++) {
        const uint32_t g = jsl_flock_number(j->room, t->boid.flock[i], f);
        j->group[t->offset + i] = g;
        if (g == JSL_FLOCK_NONE) continue;
        if (g != f) {
            if (f != JSL_FLOCK_NONE) all[f] = here;
            f = g;
            here = all[f];
        }
        if (!jsl_v3_is_finite(jsl_v3(p[0][i], p[1][i], p[2][i]))) continue;
        for (int k = 0; k < 3; k++) {
            here.lo[k] = jsl_min(here.lo[k], p[k][i]);
            here.hi[k] = jsl_max(here.hi[k], p[k][i]);
        }
    }
    if (f != JSL_FLOCK_NONE) all[f] = here;
}

/* Cells a little larger than the reach, because distances are rounded; larger still when the box
 * would not be counted in 40 bits. */
static void lay_out(jsl_flock_state *f, extent e, uint64_t base) {
    jsl_flock_grid *g = &f->grid;
    *g = (jsl_flock_grid){.base = base, .nx = 1, .ny = 1, .nz = 1};
    const double reach = (double)jsl_sqrt(f->lens.reach_sq);
    if (!(reach > 0) || !(e.lo[0] <= e.hi[0])) return;
    double n[3], o[3];
    for (double cell = reach * (1 + 1e-6);; cell *= 2) {
        for (int k = 0; k < 3; k++) {
            const double inv = (k == 0 ? JSL_FLOCK_SPLIT : 1) / cell;
            o[k] = floor((double)e.lo[k] * inv);
            n[k] = floor((double)e.hi[k] * inv) - o[k] + 1;
        }
        g->inv_yz = 1 / cell;
        g->inv_x = JSL_FLOCK_SPLIT / cell;
        if (n[0] * n[1] * n[2] <= 1099511627776.0) break;
    }
    g->ox = o[0], g->oy = o[1], g->oz = o[2];
    g->nx = (int64_t)n[0], g->ny = (int64_t)n[1], g->nz = (int64_t)n[2];
}

static jsl_result make_grids(job *j, const jsl_step_context *context) {
    jsl_flock_room *room = j->room;
    const int64_t flocks = room->state.count;
    const int workers = context->exec ? context->exec->tasks.workers : 1;
    j->extents = JSL_ARENA_NEW(context->arena, extent, workers * flocks);
    j->group = JSL_ARENA_NEW(context->arena, uint32_t, room->count);
    if (!j->extents || !j->group) return JSL_ERR_MEMORY;
    const jsl_real far = JSL_R(1e38);
    for (int64_t i = 0; i < workers * flocks; i++)
        j->extents[i] = (extent){{far, far, far}, {-far, -far, -far}};
    for (int64_t t = 0; t < room->table.count; t++) {
        j->table = &room->table.at[t];
        jsl_parallel_for(context->exec, j->table->rows.count, BLOCK, survey, j);
    }
    uint64_t base = 0;
    for (int64_t f = 0; f < flocks; f++) {
        extent e = j->extents[f];
        for (int w = 1; w < workers; w++) {
            const extent *o = &j->extents[w * flocks + f];
            for (int k = 0; k < 3; k++) {
                e.lo[k] = jsl_min(e.lo[k], o->lo[k]);
                e.hi[k] = jsl_max(e.hi[k], o->hi[k]);
            }
        }
        lay_out(&room->state.at[f], e, base);
        const jsl_flock_grid *g = &room->state.at[f].grid;
        base += (uint64_t)(g->nx * g->ny * g->nz);
    }
    room->cells = base + 1; /* the last cell holds the boids without a flock */
    return JSL_OK;
}

/* -- Cells
 * -------------------------------------------------------------------------------------------- */

/* Monotone in x, and never outside [0, n): NaN lands in cell 0. */
static inline int64_t cell_of(jsl_real x, double inv, double origin, int64_t n) {
    const double t = (double)x * inv - origin;
    const int64_t c = t > 0 ? (t < (double)n ? (int64_t)t : n - 1) : 0;
    return c;
}

static inline uint64_t key_of(const job *j, const jsl_boid_table *t, int64_t row) {
    const uint32_t f = j->group[t->offset + row];
    if (f == JSL_FLOCK_NONE) return j->room->cells - 1;
    const jsl_flock_grid *g = &j->room->state.at[f].grid;
    const int64_t x = cell_of(t->position.px[row], g->inv_x, g->ox, g->nx);
    const int64_t y = cell_of(t->position.py[row], g->inv_yz, g->oy, g->ny);
    const int64_t z = cell_of(t->position.pz[row], g->inv_yz, g->oz, g->nz);
    return g->base + (uint64_t)((z * g->ny + y) * g->nx + x);
}

static const jsl_boid_table *table_with(const jsl_flock_room *room, int64_t number) {
    const jsl_boid_table *t = room->table.at;
    while (number >= t->offset + t->rows.count) t++;
    return t;
}

static void make_pairs(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    job *j = arg;
    (void)worker;
    uint32_t *histogram = j->histogram + block * BUCKETS;
    memset(histogram, 0, BUCKETS * sizeof *histogram);
    while (begin < end) {
        const jsl_boid_table *t = table_with(j->room, begin);
        const int64_t last = t->offset + t->rows.count < end ? t->offset + t->rows.count : end;
        for (; begin < last; begin++) {
            const uint64_t key = key_of(j, t, begin - t->offset);
            histogram[key >> j->shift]++;
            j->pair[begin] = key << 32 | (uint64_t)begin;
        }
    }
}

static void fill_buckets(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    job *j = arg;
    (void)worker;
    uint32_t *place = j->histogram + block * BUCKETS;
    for (; begin < end; begin++)
        j->bucketed[place[j->pair[begin] >> 32 >> j->shift]++] = j->pair[begin];
}

static void sort_bucket(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    job *j = arg;
    jsl_flock_room *room = j->room;
    (void)end, (void)block, (void)worker;
    const uint32_t first = j->bucket_begin[begin], last = j->bucket_begin[begin + 1];
    const uint64_t lo = (uint64_t)begin << j->shift;
    uint64_t hi = lo + (1ull << j->shift);
    if (hi > room->cells) hi = room->cells;
    /* While boids are placed, place[c] is where the next of cell c goes; in the end it is where the
     * next cell starts. */
    uint32_t *place = room->start.at + 1;
    memset(place + lo, 0, (hi - lo) * sizeof *place);
    for (uint32_t i = first; i < last; i++) place[j->bucketed[i] >> 32]++;
    uint32_t sum = first;
    for (uint64_t c = lo; c < hi; c++) {
        const uint32_t n = place[c];
        place[c] = sum;
        sum += n;
    }
    for (uint32_t i = first; i < last; i++) {
        const uint64_t pair = j->bucketed[i];
        const uint32_t at = place[pair >> 32]++;
        room->key.at[at] = pair >> 32;
        room->home.at[at] = (uint32_t)pair;
    }
}

/* Above this, cells are found by sorting their keys. */
static int64_t max_dense_cells(const jsl_flock_room *room) { return 4 * room->count + 4096; }

static jsl_result sort_dense(job *j, const jsl_step_context *context) {
    jsl_flock_room *room = j->room;
    const int64_t n = room->count;
    /* Room for the most cells that are sorted this way: a flock that spreads takes no memory. */
    JSL_TRY(jsl_array_reserve(room->memory, &room->start, max_dense_cells(room) + 1));
    j->part = BLOCK > (n + MAX_PARTS - 1) / MAX_PARTS ? BLOCK : (n + MAX_PARTS - 1) / MAX_PARTS;
    const int64_t parts = (n + j->part - 1) / j->part;
    j->pair = JSL_ARENA_NEW(context->arena, uint64_t, n);
    j->bucketed = JSL_ARENA_NEW(context->arena, uint64_t, n);
    j->histogram = JSL_ARENA_NEW(context->arena, uint32_t, parts * BUCKETS);
    if (!j->pair || !j->bucketed || !j->histogram) return JSL_ERR_MEMORY;
    for (j->shift = 0; (room->cells - 1) >> j->shift >= BUCKETS;) j->shift++;
    jsl_parallel_for(context->exec, n, j->part, make_pairs, j);
    uint32_t sum = 0;
    for (int b = 0; b < BUCKETS; b++) {
        j->bucket_begin[b] = sum;
        for (int64_t p = 0; p < parts; p++) {
            const uint32_t count = j->histogram[p * BUCKETS + b];
            j->histogram[p * BUCKETS + b] = sum;
            sum += count;
        }
    }
    j->bucket_begin[BUCKETS] = sum;
    jsl_parallel_for(context->exec, n, j->part, fill_buckets, j);
    room->start.at[0] = 0;
    jsl_parallel_for(context->exec, (int64_t)((room->cells - 1) >> j->shift) + 1, 1, sort_bucket,
                     j);
    return JSL_OK;
}

static jsl_result sort_sparse(job *j, const jsl_step_context *context) {
    jsl_flock_room *room = j->room;
    uint64_t *spare_key = JSL_ARENA_NEW(context->arena, uint64_t, room->count);
    uint32_t *spare_home = JSL_ARENA_NEW(context->arena, uint32_t, room->count);
    if (!spare_key || !spare_home) return JSL_ERR_MEMORY;
    for (int64_t t = 0; t < room->table.count; t++) {
        const jsl_boid_table *table = &room->table.at[t];
        for (int64_t i = 0; i < table->rows.count; i++) {
            room->key.at[table->offset + i] = key_of(j, table, i);
            room->home.at[table->offset + i] = (uint32_t)(table->offset + i);
        }
    }
    jsl_sort_u64(room->key.at, room->home.at, spare_key, spare_home, room->count);
    return JSL_OK;
}

/* -- What is seen
 * -------------------------------------------------------------------------------------- */

/* Copies what others see of the boids at places [begin, end). A velocity that is not finite is seen
 * as none. */
static void copy_sight(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    job *j = arg;
    jsl_flock_room *room = j->room;
    (void)worker;
    const jsl_sight s = room->sight;
    int64_t breaks = 0;
    for (int64_t i = begin; i < end; i++) {
        int64_t row;
        const jsl_boid_table *t = jsl_flock_home(room, i, &row);
        s.x[i] = t->position.px[row];
        s.y[i] = t->position.py[row];
        s.z[i] = t->position.pz[row];
        const jsl_vec3 v = jsl_v3(t->velocity.vx[row], t->velocity.vy[row], t->velocity.vz[row]);
        const bool sound = jsl_v3_is_finite(v);
        s.ux[i] = sound ? v.x : 0;
        s.uy[i] = sound ? v.y : 0;
        s.uz[i] = sound ? v.z : 0;
        breaks += i > 0 && room->home.at[i] != room->home.at[i - 1] + 1;
    }
    j->breaks[block] = breaks;
    for (int64_t f = 0; f < room->state.count; f++) {
        const int64_t lo = room->flock_begin.at[f] > begin ? room->flock_begin.at[f] : begin;
        const int64_t hi = room->flock_begin.at[f + 1] < end ? room->flock_begin.at[f + 1] : end;
        if (lo < hi && room->state.at[f].value.response == JSL_FLOCK_DIRECTION)
            JSL_KERNEL_PICK(j->isa, jsl_flock_heading)(s.ux + lo, s.uy + lo, s.uz + lo, hi - lo);
    }
}

static void find_flocks(jsl_flock_room *room) {
    int64_t hint = 0;
    for (int64_t f = 0; f < room->state.count; f++)
        room->flock_begin.at[f] = jsl_flock_place(room, room->state.at[f].grid.base, &hint);
    room->flock_begin.at[room->state.count] = jsl_flock_place(room, room->cells - 1, &hint);
    room->flock_begin.at[room->state.count + 1] = room->count;
}

static jsl_result reserve(jsl_flock_room *room) {
    const int64_t n = room->count + 2 * JSL_LANES;
    for (int k = 0; k < 6; k++) JSL_TRY(jsl_array_reserve(room->memory, &room->column[k], n));
    JSL_TRY(jsl_array_reserve(room->memory, &room->key, n));
    JSL_TRY(jsl_array_reserve(room->memory, &room->home, n));
    JSL_TRY(jsl_array_reserve(room->memory, &room->flock_begin, room->state.count + 2));
    room->sight = (jsl_sight){room->column[0].at, room->column[1].at, room->column[2].at,
                              room->column[3].at, room->column[4].at, room->column[5].at};
    for (int k = 0; k < 6; k++)
        memset(room->column[k].at + room->count, 0, 2 * JSL_LANES * sizeof(jsl_real));
    return JSL_OK;
}

/* Brings the rows of each table into the order of places. Tables whose rows others remember are
 * left alone. */
static jsl_result reorder(jsl_flock_room *room, const jsl_step_context *context) {
    uint32_t *from = room->home.at, *next = NULL;
    if (room->table.count > 1) {
        from = JSL_ARENA_NEW(context->arena, uint32_t, room->count);
        next = jsl_arena_zero(context->arena, room->table.count * (int64_t)sizeof *next);
        if (!from || !next) return JSL_ERR_MEMORY;
        for (int64_t i = 0; i < room->count; i++) {
            int64_t row;
            const jsl_boid_table *t = jsl_flock_home(room, i, &row);
            const uint32_t to = next[t - room->table.at]++;
            from[t->offset + to] = (uint32_t)row;
            if (!t->fixed_order) room->home.at[i] = (uint32_t)t->offset + to;
        }
    }
    jsl_result result = JSL_OK;
    for (int64_t t = 0; t < room->table.count; t++) {
        const jsl_boid_table *table = &room->table.at[t];
        if (table->fixed_order) continue;
        result =
            jsl_table_reorder(room->ecs, table->rows.table, from + table->offset, context->exec);
        if (result != JSL_OK) break;
    }
    if (!next && result == JSL_OK && !room->table.at[0].fixed_order)
        for (int64_t i = 0; i < room->count; i++) room->home.at[i] = (uint32_t)i;
    if (result == JSL_OK) result = jsl_flock_find_tables(room);
    return result;
}

static jsl_result make_index(jsl_flock_room *room, const jsl_step_context *context) {
    JSL_TRY(jsl_flock_refresh(room, context));
    JSL_TRY(jsl_flock_find_tables(room));
    JSL_TRY(reserve(room));
    job j = {.room = room, .isa = context->isa};
    JSL_TRY(make_grids(&j, context));
    room->dense = (int64_t)room->cells <= max_dense_cells(room);
    JSL_TRY(room->dense ? sort_dense(&j, context) : sort_sparse(&j, context));
    find_flocks(room);
    const int64_t blocks = (room->count + BLOCK - 1) / BLOCK;
    j.breaks = JSL_ARENA_NEW(context->arena, int64_t, blocks);
    if (!j.breaks) return JSL_ERR_MEMORY;
    jsl_parallel_for(context->exec, room->count, BLOCK, copy_sight, &j);
    int64_t breaks = 0;
    for (int64_t b = 0; b < blocks; b++) breaks += j.breaks[b];
    if (breaks > room->count / 4) JSL_TRY(reorder(room, context));
    return JSL_OK;
}

jsl_result jsl_flock_index(const jsl_step_context *context, void *user) {
    jsl_flock_room *room = user;
    room->ready = false;
    jsl_result result = make_index(room, context);
    if (result == JSL_ERR_MEMORY) {
        /* Boids keep their last accelerations for this step. */
        jsl_warn(context, JSL_WARN_OUT_OF_MEMORY, 1, (jsl_entity){0});
        return JSL_OK;
    }
    room->ready = result == JSL_OK;
    return result;
}

bool jsl_flock_index_holds(const jsl_flock_room *room) {
    if (!room->ready || jsl_query_count(room->ecs, room->boids) != room->count) return false;
    for (int64_t t = 0; t < room->table.count; t++)
        if (jsl_table_revision(room->ecs, room->table.at[t].rows.table) !=
            room->table.at[t].revision)
            return false;
    return true;
}
