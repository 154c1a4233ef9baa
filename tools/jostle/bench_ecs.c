/* SPDX-License-Identifier: MIT
 * What the ECS costs: iteration against raw arrays, bulk changes per entity, hash and image against
 * memcpy. Ours and the peer's repeats alternate, and medians are reported.
 */
#include "bench.h"

#include "base/base.h"
#include <jostle/ecs.h>

#include <stdlib.h>

#define PLACE_FIELDS(X)                                                                            \
    X(real, x, "m", JSL_STATE)                                                                     \
    X(real, y, "m", JSL_STATE)                                                                     \
    X(real, z, "m", JSL_STATE)
#define PACE_FIELDS(X)                                                                             \
    X(real, vx, "m/s", JSL_STATE)                                                                  \
    X(real, vy, "m/s", JSL_STATE)                                                                  \
    X(real, vz, "m/s", JSL_STATE)
JSL_COMPONENT_COLUMNS(place, PLACE_FIELDS)
JSL_COMPONENT_COLUMNS(pace, PACE_FIELDS)
JSL_COMPONENT_FIELDS(place, PLACE_FIELDS);
JSL_COMPONENT_FIELDS(pace, PACE_FIELDS);
static const jsl_field heat_fields[] = {{"kelvin", "K", JSL_TYPE_REAL, JSL_STATE}};

#define REPEATS 41
#define MANY_REPEATS 201 /* of slices shorter than those of a scheduler */
#define MILLION 1000000

typedef struct bench {
    jsl_bench_emit *emit;
    jsl_ecs *ecs;
    jsl_component place, pace, heat;
    int failures;
} bench;

static void try_ok(bench *b, jsl_result r) { b->failures += r != JSL_OK; }

static bool open_ecs(bench *b) {
    b->ecs = NULL;
    if (jsl_ecs_create(NULL, &b->ecs) != JSL_OK) return false;
    const jsl_component_desc desc[] = {{"place", place_fields, 3, false},
                                       {"pace", pace_fields, 3, false},
                                       {"heat", heat_fields, 1, false}};
    jsl_component *out[] = {&b->place, &b->pace, &b->heat};
    for (int i = 0; i < 3; i++) try_ok(b, jsl_component_register(b->ecs, &desc[i], out[i]));
    return b->failures == 0;
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *at, int n) {
    qsort(at, (size_t)n, sizeof *at, compare_doubles);
    return at[n / 2];
}

/* -- position += velocity * dt ------------------------------------------------- */

/* Both sides call this. It works on whole groups of 16, as every kernel here may. */
__attribute__((noinline)) static void advance(place_columns p, pace_columns v, jsl_real dt,
                                              int64_t n) {
    jsl_real *restrict x = p.x, *restrict y = p.y, *restrict z = p.z;
    const jsl_real *restrict vx = v.vx, *restrict vy = v.vy, *restrict vz = v.vz;
    for (int64_t i = 0; i < n; i += JSL_LANES) {
        for (int j = 0; j < JSL_LANES; j++) x[i + j] += vx[i + j] * dt;
        for (int j = 0; j < JSL_LANES; j++) y[i + j] += vy[i + j] * dt;
        for (int j = 0; j < JSL_LANES; j++) z[i + j] += vz[i + j] * dt;
    }
}

static void advance_query(bench *b, jsl_query query, jsl_real dt) {
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(b->ecs, query, 0); jsl_query_next(&it, &rows);)
        advance(place_of(&rows, 0), pace_of(&rows, 1), dt, rows.count);
}

static void bench_advance(bench *b, int64_t n) {
    jsl_component set[2];
    jsl_query query = {0};
    jsl_rows rows;
    if (!open_ecs(b)) return;
    set[0] = b->place, set[1] = b->pace;
    /* Raw arrays as an expert would lay them: aligned, in one block, and not a power of two apart.
     */
    size_t stride = (size_t)jsl_round_up(n, JSL_LANES) + 11 * JSL_ALIGN / sizeof(jsl_real);
    jsl_real *raw = aligned_alloc(JSL_ALIGN, 6 * stride * sizeof *raw);
    try_ok(b, jsl_entity_create_n(b->ecs, set, 2, n, NULL, &rows));
    try_ok(b, jsl_query_create(
                  b->ecs, &(jsl_query_desc){{{b->place, JSL_WRITE}, {b->pace, JSL_READ}}}, &query));
    if (raw && !b->failures) {
        memset(raw, 0, 6 * stride * sizeof *raw);
        place_columns p = {raw, raw + stride, raw + 2 * stride};
        pace_columns v = {raw + 3 * stride, raw + 4 * stride, raw + 5 * stride};
        for (int k = 3; k < 6; k++)
            for (int64_t i = 0; i < n; i++)
                raw[(size_t)k * stride + (size_t)i] = ((jsl_real *)rows.column[k])[i] =
                    (jsl_real)(i % 7) - 3;
        double ours[MANY_REPEATS], theirs[MANY_REPEATS];
        int repeats = n < 10 * MILLION ? MANY_REPEATS : REPEATS;
        int64_t rounds = n < 200000 ? 200000 / n : 1;
        for (int r = 0; r < repeats; r++) {
            double start = jsl_seconds();
            for (int64_t i = 0; i < rounds; i++) advance(p, v, JSL_R(1e-3), n);
            double middle = jsl_seconds();
            for (int64_t i = 0; i < rounds; i++) advance_query(b, query, JSL_R(1e-3));
            double end = jsl_seconds();
            theirs[r] = (middle - start) / (double)(rounds * n) * 1e9;
            ours[r] = (end - middle) / (double)(rounds * n) * 1e9;
        }
        b->emit("advance", n, 1, median(ours, repeats), "ns/entity", "raw arrays",
                median(theirs, repeats));
    }
    free(raw);
    jsl_ecs_destroy(b->ecs);
}

/* -- Bulk changes ------------------------------------------------------------------ */

enum {
    CREATE_COLD,
    CREATE,
    CREATE_WITHOUT_HANDLES,
    ADD,
    REMOVE,
    ADD_WHERE,
    HALF,
    DESTROY,
    CHANGES
};

static double seconds_since(double *clock) {
    double now = jsl_seconds(), passed = now - *clock;
    *clock = now;
    return passed;
}

static void bench_changes(bench *b) {
    static const char *const name[CHANGES] = {
        "create_n first time", "create_n", "create_n no out", "add_n", "remove_n", "add_where",
        "destroy_n every 2nd", "destroy_n"};
    double took[CHANGES][REPEATS];
    int64_t n = MILLION;
    jsl_entity *e = malloc((size_t)n * sizeof *e), *half = malloc((size_t)n / 2 * sizeof *e);
    for (int r = 0; r < REPEATS && e && half; r++) {
        if (!open_ecs(b)) break;
        const jsl_component set[2] = {b->place, b->pace};
        jsl_query query = {0};
        try_ok(b, jsl_query_create(b->ecs, &(jsl_query_desc){{{b->place, JSL_READ}}}, &query));
        double clock = jsl_seconds();
        try_ok(b, jsl_entity_create_n(b->ecs, set, 2, n, e, NULL));
        took[CREATE_COLD][r] = seconds_since(&clock);
        try_ok(b, jsl_entity_destroy_n(b->ecs, e, n));
        took[DESTROY][r] = seconds_since(&clock);
        try_ok(b, jsl_entity_create_n(b->ecs, set, 2, n, NULL, NULL));
        took[CREATE_WITHOUT_HANDLES][r] = seconds_since(&clock);
        jsl_rows rows;
        jsl_iter it = jsl_query_begin(b->ecs, query, 0);
        if (!jsl_query_next(&it, &rows))
            b->failures++;
        else
            memcpy(e, rows.entity, (size_t)n * sizeof *e);
        try_ok(b, jsl_entity_destroy_n(b->ecs, e, n));
        seconds_since(&clock);
        try_ok(b, jsl_entity_create_n(b->ecs, set, 2, n, e, NULL));
        took[CREATE][r] = seconds_since(&clock);
        try_ok(b, jsl_entity_reserve(b->ecs, (jsl_component[]){b->place, b->pace, b->heat}, 3, n));
        try_ok(b, jsl_entity_add_n(b->ecs, e, n, &b->heat, 1));
        try_ok(b, jsl_entity_remove_n(b->ecs, e, n, &b->heat, 1));
        seconds_since(&clock);
        try_ok(b, jsl_entity_add_n(b->ecs, e, n, &b->heat, 1));
        took[ADD][r] = seconds_since(&clock);
        try_ok(b, jsl_entity_remove_n(b->ecs, e, n, &b->heat, 1));
        took[REMOVE][r] = seconds_since(&clock);
        try_ok(b, jsl_entity_add_where(b->ecs, query, &b->heat, 1, NULL));
        took[ADD_WHERE][r] = seconds_since(&clock);
        for (int64_t i = 0; i < n / 2; i++) half[i] = e[i * 2];
        seconds_since(&clock);
        try_ok(b, jsl_entity_destroy_n(b->ecs, half, n / 2));
        took[HALF][r] = seconds_since(&clock) * 2;
        jsl_ecs_destroy(b->ecs);
    }
    for (int i = 0; i < CHANGES && b->failures == 0; i++)
        b->emit(name[i], n, 1, median(took[i], REPEATS) / (double)n * 1e9, "ns/entity", NULL, 0);
    free(e);
    free(half);
}

/* -- A thousand tables --------------------------------------------------------------- */

static void bench_tables(bench *b) {
    enum { TAGS = 10, TABLES = 1000, ROWS = 10 };
    jsl_component set[2 + TAGS], tag[TAGS];
    jsl_query query = {0};
    double ours[REPEATS];
    if (!open_ecs(b)) return;
    for (int i = 0; i < TAGS; i++) {
        char name[8] = {'t', 'a', 'g', (char)('a' + i), 0};
        try_ok(b, jsl_component_register(b->ecs, &(jsl_component_desc){.name = name}, &tag[i]));
    }
    set[0] = b->place, set[1] = b->pace;
    for (int t = 0; t < TABLES; t++) {
        int n = 2;
        for (int i = 0; i < TAGS; i++)
            if (t >> i & 1) set[n++] = tag[i];
        try_ok(b, jsl_entity_create_n(b->ecs, set, n, ROWS, NULL, NULL));
    }
    try_ok(b, jsl_query_create(
                  b->ecs, &(jsl_query_desc){{{b->place, JSL_WRITE}, {b->pace, JSL_READ}}}, &query));
    for (int r = 0; r < REPEATS; r++) {
        double start = jsl_seconds();
        int64_t rows_seen = 0;
        for (int i = 0; i < 100; i++) {
            jsl_rows rows;
            for (jsl_iter it = jsl_query_begin(b->ecs, query, 0); jsl_query_next(&it, &rows);)
                rows_seen += rows.count;
        }
        ours[r] = (jsl_seconds() - start) / (100.0 * TABLES) * 1e9;
        b->failures += rows_seen != 100ll * TABLES * ROWS;
    }
    b->emit("iterate tables", TABLES, 1, median(ours, REPEATS), "ns/table", NULL, 0);
    jsl_ecs_destroy(b->ecs);
}

/* -- The state as a whole ---------------------------------------------------------------- */

static void bench_state(bench *b, int64_t n) {
    double copy[REPEATS], hash[REPEATS], save[REPEATS], restore[REPEATS];
    jsl_rows rows;
    uint64_t sum = 0;
    if (!open_ecs(b)) return;
    const jsl_component set[2] = {b->place, b->pace};
    try_ok(b, jsl_entity_create_n(b->ecs, set, 2, n, NULL, &rows));
    for (int k = 0; k < 6; k++)
        for (int64_t i = 0; i < n; i++) ((jsl_real *)rows.column[k])[i] = (jsl_real)(i * 7 + k);
    size_t size = jsl_ecs_save_size(b->ecs);
    unsigned char *image = malloc(size), *other = malloc(size);
    double gigabytes = (double)size * 1e-9;
    if (image && other) {
        memset(image, 0, size);
        memset(other, 0, size);
        int64_t rounds = n < MILLION ? MILLION / n : 1;
        double per = gigabytes * (double)rounds;
        for (int r = 0; r < REPEATS; r++) {
            double clock = jsl_seconds();
            for (int64_t i = 0; i < rounds; i++) try_ok(b, jsl_ecs_save(b->ecs, image, size));
            save[r] = per / seconds_since(&clock);
            for (int64_t i = 0; i < rounds; i++) {
                memcpy(other, image, size);
                __asm__ volatile("" ::"r"(other) : "memory");
            }
            copy[r] = per / seconds_since(&clock);
            for (int64_t i = 0; i < rounds; i++) sum += jsl_ecs_hash(b->ecs);
            hash[r] = per / seconds_since(&clock);
            for (int64_t i = 0; i < rounds; i++) try_ok(b, jsl_ecs_restore(b->ecs, image, size));
            restore[r] = per / seconds_since(&clock);
        }
        double peer = median(copy, REPEATS);
        b->emit("save", n, 1, median(save, REPEATS), "GB/s", "memcpy", peer);
        b->emit("restore", n, 1, median(restore, REPEATS), "GB/s", "memcpy", peer);
        b->emit("hash", n, 1, median(hash, REPEATS), "GB/s", "memcpy", peer);
    }
    b->failures += !image || !other || sum == 0;
    free(image);
    free(other);
    jsl_ecs_destroy(b->ecs);
}

int jsl_bench_ecs(jsl_bench_emit *emit) {
    bench b = {.emit = emit};
    for (int64_t n = 10000; n <= 10000000; n *= 10) bench_advance(&b, n);
    bench_changes(&b);
    bench_tables(&b);
    bench_state(&b, 100000);
    bench_state(&b, MILLION);
    return b.failures != 0;
}
