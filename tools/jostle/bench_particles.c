/* SPDX-License-Identifier: MIT
 * Nanoseconds a particle, beside the loop that adds one to the same six arrays: what memory allows.
 */
#include "ecs/ecs.h"
#include "geometry/geometry.h"
#include "particle/particle.h"
#include <jostle/wind.h>

#include <stdlib.h>

typedef void bench_emit(const char *bench_case, int64_t n, int threads, double value,
                        const char *unit, const char *peer, double peer_value);
int jsl_bench_particles(bench_emit *emit);

typedef struct bench {
    jsl_ecs *ecs;
    jsl_particle_room *room;
    jsl_collider_set set;
    jsl_arena arena;
    jsl_exec exec;
    jsl_wind wind;
    jsl_warnings warnings;
    jsl_step_context context;
    jsl_component position, velocity, particle;
    jsl_query particles;
    jsl_emitter emitter;
} bench;

static void check(jsl_result r) {
    if (r == JSL_OK) return;
    abort(); /* a bench that cannot be set up has nothing to say */
}

static void bench_open(bench *b, int threads, const jsl_emitter_desc *desc) {
    memset(b, 0, sizeof *b);
    check(jsl_ecs_create(&(jsl_ecs_desc){.tag = 9}, &b->ecs));
    check(jsl_particle_room_create(b->ecs, &b->room));
    jsl_memory *memory = jsl_ecs_memory(b->ecs);
    jsl_arena_init(&b->arena, memory);
    check(jsl_exec_init(&b->exec, memory, (jsl_tasks){0}, threads));
    b->wind.velocity = jsl_v3(2, 0, 1);
    b->context = (jsl_step_context){.dt = JSL_R(1.0 / 60),
                                    .inv_dt = 60,
                                    .substeps = 1,
                                    .seed = 1,
                                    .gravity = {0, 0, JSL_R(-9.81)},
                                    .isa = jsl_isa_resolve(JSL_ISA_AUTO),
                                    .workers = threads,
                                    .ecs = b->ecs,
                                    .warnings = &b->warnings,
                                    .exec = &b->exec,
                                    .memory = memory,
                                    .arena = &b->arena,
                                    .colliders = &b->set,
                                    .wind = &b->wind};
    check(jsl_component_find(b->ecs, "position", &b->position));
    check(jsl_component_find(b->ecs, "velocity", &b->velocity));
    check(jsl_component_find(b->ecs, "particle", &b->particle));
    jsl_query_desc query = {
        .terms = {{b->position, JSL_WRITE}, {b->velocity, JSL_WRITE}, {b->particle, JSL_WRITE}}};
    check(jsl_query_create(b->ecs, &query, &b->particles));
    check(jsl_particle_room_emitter_create(b->room, desc, &b->emitter));
}

static void bench_close(bench *b) {
    jsl_memory *memory = jsl_ecs_memory(b->ecs);
    jsl_collider_set_free(memory, &b->set);
    jsl_arena_fini(&b->arena);
    jsl_exec_fini(&b->exec, memory);
    jsl_particle_room_destroy(b->room);
    jsl_ecs_destroy(b->ecs);
}

static void add_collider(bench *b, jsl_shape_desc shape, jsl_vec3 at) {
    int64_t i = b->set.item.count;
    check(jsl_array_reserve(jsl_ecs_memory(b->ecs), &b->set.item, i + 1));
    b->set.item.at[i] = (jsl_collider_item){.shape = shape,
                                            .pose = {at, {0, 0, 0, 1}},
                                            .radius = jsl_shape_radius(&shape),
                                            .category = 1,
                                            .mask = UINT32_MAX};
    b->set.item.count = i + 1;
}

static void index_colliders(bench *b) {
    jsl_memory *memory = jsl_ecs_memory(b->ecs);
    check(jsl_collider_set_index(memory, &b->set, b->context.dt, JSL_R(0.01)));
    check(jsl_schedule_run(b->ecs, JSL_STAGE_INDEX, &b->context));
}

/* n particles uniform in a box, at rest; speeds up to `speed`. */
static void fill(bench *b, int64_t n, jsl_aabb box, jsl_real speed, jsl_real life) {
    const jsl_component set[] = {b->position, b->velocity, b->particle};
    jsl_rows rows;
    check(jsl_entity_create_n(b->ecs, set, 3, n, NULL, &rows));
    jsl_position_columns p = jsl_position_of(&rows, 0);
    jsl_velocity_columns v = jsl_velocity_of(&rows, 1);
    jsl_particle_columns q = jsl_particle_of(&rows, 2);
    for (int64_t i = 0; i < n; i++) {
        jsl_rng r = jsl_rng_make(3, (uint64_t)i, 0, 0);
        p.px[i] = box.lo.x + jsl_rng_unit(&r) * (box.hi.x - box.lo.x);
        p.py[i] = box.lo.y + jsl_rng_unit(&r) * (box.hi.y - box.lo.y);
        p.pz[i] = box.lo.z + jsl_rng_unit(&r) * (box.hi.z - box.lo.z);
        v.vx[i] = jsl_rng_signed(&r) * speed;
        v.vy[i] = jsl_rng_signed(&r) * speed;
        v.vz[i] = jsl_rng_signed(&r) * speed;
        q.life[i] = life;
        q.size[i] = JSL_R(0.05);
        q.emitter[i] = b->emitter.entity;
    }
}

/* -- The peer: one added to six arrays
 * --------------------------------------------------------------------- */

typedef struct add_job {
    jsl_real *restrict a[6];
    jsl_real one;
} add_job;

/* As wide as the machine: the best that a compiler makes of it. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
__attribute__((target_clones("avx2", "default"), optimize("O3"), noinline))
#endif
static void
add_rows(jsl_real *restrict a, jsl_real *restrict b, jsl_real *restrict c, jsl_real *restrict d,
         jsl_real *restrict e, jsl_real *restrict f, int64_t n, jsl_real one) {
    for (int64_t i = 0; i < n; i++) {
        a[i] += one;
        b[i] += one;
        c[i] += one;
        d[i] += one;
        e[i] += one;
        f[i] += one;
    }
}

static void add_block(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    const add_job *j = arg;
    (void)block, (void)worker;
    add_rows(j->a[0] + begin, j->a[1] + begin, j->a[2] + begin, j->a[3] + begin, j->a[4] + begin,
             j->a[5] + begin, end - begin, j->one);
}

static void add(bench *b, jsl_real one) {
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(b->ecs, b->particles, 0); jsl_query_next(&it, &rows);) {
        jsl_position_columns p = jsl_position_of(&rows, 0);
        jsl_velocity_columns v = jsl_velocity_of(&rows, 1);
        add_job job = {{p.px, p.py, p.pz, v.vx, v.vy, v.vz}, one};
        jsl_parallel_for(&b->exec, rows.count, 4096, add_block, &job);
    }
}

/* -- Measuring
 * ------------------------------------------------------------------------------------------------
 */

#define MAX_REPEATS 200

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *at, int n) {
    qsort(at, (size_t)n, sizeof *at, by_value);
    return n & 1 ? at[n / 2] : 0.5 * (at[n / 2 - 1] + at[n / 2]);
}

static void move(bench *b) {
    check(jsl_schedule_run(b->ecs, JSL_STAGE_MOVE, &b->context));
    b->context.step++;
    b->context.time = (double)b->context.step * (double)b->context.dt;
}

static void step(bench *b) {
    move(b);
    check(jsl_schedule_run(b->ecs, JSL_STAGE_RETIRE, &b->context));
}

/* Medians, in ns a particle, of ours and of add-one, measured in turns. */
static void measure(bench *b, int64_t n, void (*run)(bench *), double *ours, double *peer) {
    static const double budget = 1e8; /* particles in total */
    double a[MAX_REPEATS], p[MAX_REPEATS];
    int repeats = (int)(budget / (double)n);
    if (repeats > MAX_REPEATS) repeats = MAX_REPEATS;
    if (repeats < 12) repeats = 12;
    for (int i = -2; i < repeats; i++) {
        double t0 = jsl_seconds();
        add(b, 1);
        double t1 = jsl_seconds();
        add(b, -1); /* the scene stays what it is, and both find the caches as a pass over the
                       arrays left them */
        double t2 = jsl_seconds();
        run(b);
        double t3 = jsl_seconds();
        if (i < 0) continue;
        p[i] = (t1 - t0) * 1e9 / (double)n;
        a[i] = (t3 - t2) * 1e9 / (double)n;
    }
    *ours = median(a, repeats);
    *peer = median(p, repeats);
}

static const jsl_emitter_desc breeze = {
    .drag = JSL_R(0.5), .wind = 1, .restitution = JSL_R(0.5), .friction = JSL_R(0.1)};

typedef struct motion_case {
    const char *name;
    jsl_aabb box;
    jsl_real speed, life;
    int substeps;
    bool plane, elastic;
} motion_case;

static void bench_motion(const motion_case *c, int64_t n, int threads, bench_emit *emit) {
    bench b;
    double ours = 0, peer = 0;
    jsl_emitter_desc desc = breeze;
    if (c->elastic) desc = (jsl_emitter_desc){.restitution = 1};
    bench_open(&b, threads, &desc);
    if (c->plane) add_collider(&b, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, jsl_v3(0, 0, 0));
    b.context.substeps = c->substeps;
    fill(&b, n, c->box, c->speed, c->life);
    index_colliders(&b);
    measure(&b, n, move, &ours, &peer);
    emit(c->name, n, threads, ours, "ns/particle", "add one to six arrays", peer);
    bench_close(&b);
}

/* -- A tower of boxes, births and deaths, colours
 * ------------------------------------------------------------------ */

static void bench_tower(int64_t n, int boxes, int threads, bench_emit *emit) {
    bench b;
    double ours = 0, peer = 0;
    jsl_emitter_desc desc = {.restitution = JSL_R(0.4), .friction = JSL_R(0.3), .drag = JSL_R(0.1)};
    bench_open(&b, threads, &desc);
    add_collider(&b, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, jsl_v3(0, 0, 0));
    jsl_shape_desc box = {.kind = JSL_SHAPE_BOX, .half = {JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)}};
    for (int i = 0; i < boxes; i++)
        add_collider(&b, box,
                     jsl_v3((jsl_real)(i % 2) * JSL_R(1.1), (jsl_real)(i / 2 % 2) * JSL_R(1.1),
                            JSL_R(0.5) + (jsl_real)(i / 4)));
    jsl_real top = (jsl_real)boxes / 4;
    fill(&b, n, (jsl_aabb){{-3, -3, top}, {4, 4, top + 12}}, 1, 0);
    index_colliders(&b);
    for (int i = 0; i < 100; i++) move(&b); /* they have come down upon it */
    measure(&b, n, move, &ours, &peer);
    emit("rain on a tower of 60 boxes", n, threads, ours, "ns/particle", "add one to six arrays",
         peer);
    bench_close(&b);
}

static void bench_turnover(int64_t n, int threads, bench_emit *emit) {
    bench b;
    double ours = 0, peer = 0;
    jsl_emitter_desc desc = {.mode = JSL_EMIT_REFILL,
                             .max_particles = n,
                             .life = JSL_R(10.0 / 60),
                             .life_range = JSL_R(5.0 / 60),
                             .cone = 1,
                             .speed = 5,
                             .speed_range = 2,
                             .drag = JSL_R(0.5)};
    bench_open(&b, threads, &desc);
    for (int i = 0; i < 60; i++) step(&b);
    measure(&b, n, step, &ours, &peer);
    emit("step with a tenth born and dead", n, threads, ours, "ns/particle",
         "add one to six arrays", peer);
    bench_close(&b);
}

static uint32_t *color_out;
static float *size_out;

static void colors(bench *b) {
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(b->ecs, b->particles, 0); jsl_query_next(&it, &rows);)
        check(jsl_particle_room_colors(b->room, &rows, color_out, size_out));
}

static void bench_colors(int64_t n, bench_emit *emit) {
    bench b;
    double ours = 0, peer = 0;
    jsl_emitter_desc desc = {.life = 2, .key_count = 4};
    for (int i = 0; i < 4; i++)
        desc.key[i] = (jsl_particle_key){(jsl_real)i / 3, 0x20406080u * (uint32_t)(i + 1), 1};
    bench_open(&b, 1, &desc);
    fill(&b, n, (jsl_aabb){{-1, -1, -1}, {1, 1, 1}}, 1, 2);
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(b.ecs, b.particles, 0); jsl_query_next(&it, &rows);) {
        jsl_particle_columns q = jsl_particle_of(&rows, 2);
        for (int64_t i = 0; i < rows.count; i++) q.age[i] = (jsl_real)(i % 1000) / 500;
    }
    color_out = malloc((size_t)n * sizeof *color_out);
    size_out = malloc((size_t)n * sizeof *size_out);
    if (color_out && size_out) measure(&b, n, colors, &ours, &peer);
    if (color_out && size_out)
        emit("colour and size over life", n, 1, ours, "ns/particle", "add one to six arrays", peer);
    free(color_out);
    free(size_out);
    bench_close(&b);
}

int jsl_bench_particles(bench_emit *emit) {
    static const jsl_aabb sky = {{-50, -50, 1000}, {50, 50, 1100}},
                          low = {{-50, -50, 0}, {50, 50, 2}};
    static const jsl_aabb floor_level = {{-50, -50, 0}, {50, 50, 0}};
    static const motion_case cases[] = {
        {"gravity, drag, wind, plane", sky, 5, 0, 1, true, false},
        {"the same with 4 sub-steps", sky, 5, 0, 4, true, false},
        {"the same with ageing", sky, 5, 1000, 1, true, false},
        {"bouncing for ever", low, 1, 0, 1, true, true},
        {"at rest on the plane", floor_level, 0, 0, 1, true, false},
    };
    static const int64_t sizes[] = {10000, 100000, 1000000, 10000000};
    for (int threads = 1; threads <= 2; threads++)
        for (int s = 0; s < 4; s++)
            for (int c = 0; c < JSL_COUNT(cases); c++) {
                if (c >= 3 && sizes[s] > 1000000) continue;
                bench_motion(&cases[c], sizes[s], threads, emit);
            }
    for (int threads = 1; threads <= 2; threads++) {
        bench_tower(50000, 60, threads, emit);
        bench_turnover(100000, threads, emit);
        bench_turnover(1000000, threads, emit);
    }
    bench_colors(1000000, emit);
    return 0;
}
