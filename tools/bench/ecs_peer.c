/* SPDX-License-Identifier: MIT
 * ecs_peer - times the ECS of jostle beside flecs and beside plain arrays, in one process.
 *
 * Fair means: the contestants take turns, repeat by repeat, in an order that rotates; a figure is
 * the median of its repeats; all loops over rows are the functions of this file, one for a layout,
 * whoever owns the memory; flecs is called by the idiom that its header offers for speed, in the
 * better of two loop shapes; every contestant must end with the same positions, bit for bit; time
 * is that of the thread, so that a busy machine takes none of it away; and large blocks come fresh
 * from the system for all, page faults included, as in a program that has just started. Each uses
 * its own default allocator: that of jostle asks for huge pages where the system gives them to who
 * asks, that of flecs and of the arrays is the C library's. ecs_peer.sh builds it. Floor 7.
 */
#include <jostle/ecs.h>

#include "flecs.h"

#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define DT (1.0f / 64) /* s; exact in float */
#define MAX_REPEATS 101
#define MAX_CONTESTANTS 8
#define ALIGN 64
#define TAGS 10
#define SMALL_ROWS 100
#define SMALL_TABLES 1000

typedef struct xyz {
    float x, y, z;
} xyz;

/* Plain columns: px py pz vx vy vz. */
typedef struct arrays {
    float *at[6];
    void *block;
} arrays;

typedef struct options {
    bool json, detail;
    int repeats;
    const char *only; /* part of the names of the groups to run, or null */
    int64_t max;
} options;

static _Noreturn void die(const char *what) {
    fprintf(stderr, "ecs_peer: %s\n", what);
    exit(1);
}

static void must(jsl_result result, const char *what) {
    if (result != JSL_OK) die(what);
}

static void *take(size_t bytes) {
    void *at = aligned_alloc(ALIGN, (bytes + ALIGN - 1) / ALIGN * ALIGN);
    if (!at) die("no memory");
    return at;
}

static double now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *value, int n) {
    qsort(value, (size_t)n, sizeof *value, by_value);
    return n % 2 ? value[n / 2] : 0.5 * (value[n / 2 - 1] + value[n / 2]);
}

/* -- Output ------------------------------------------------------------------- */

/* One figure of jostle beside up to three peers; a peer without a value (0) is left out. */
static void report(const options *o, const char *name, int64_t n, double ours, double flecs,
                   double soa, double aos) {
    const struct {
        const char *name;
        double value;
    } peer[] = {{"flecs", flecs}, {"arrays", soa}, {"structs", aos}};
    if (!o->json) {
        printf("%-34s %9lld %9.3f", name, (long long)n, ours);
        for (int i = 0; i < 3; i++)
            peer[i].value > 0 ? printf(" %9.3f", peer[i].value) : printf("         -");
        for (int i = 0; i < 3; i++)
            peer[i].value > 0 ? printf(" %8.3f", ours / peer[i].value) : printf("        -");
        putchar('\n');
    } else {
        for (int i = 0; i < 3; i++)
            if (peer[i].value > 0)
                printf(
                    "{\"bench\":\"ecs\",\"case\":\"%s\",\"n\":%lld,\"threads\":1,\"value\":%.6g,"
                    "\"unit\":\"ns/entity\",\"peer\":\"%s\",\"peer_value\":%.6g,\"ratio\":%.4f}\n",
                    name, (long long)n, ours, peer[i].name, peer[i].value, ours / peer[i].value);
    }
    fflush(stdout);
}

static void heading(const options *o) {
    if (o->json) return;
    printf("flecs %s; all figures ns per entity, medians; ratio = jostle / peer, below 1 jostle is "
           "ahead\n",
           FLECS_VERSION);
    printf("%-34s %9s %9s %9s %9s %9s %8s %8s %8s\n", "case", "n", "jostle", "flecs", "arrays",
           "structs", "/flecs", "/arrays", "/structs");
}

/* -- The state that all share --------------------------------------------------- */

static uint64_t mix(uint64_t x) {
    x ^= x >> 30, x *= 0xbf58476d1ce4e5b9ull;
    x ^= x >> 27, x *= 0x94d049bb133111ebull;
    return x ^ x >> 31;
}

/* Value c (0..2 position, 3..5 velocity) of entity i, in [-1, 1). */
static float initial(int64_t i, int c) {
    uint64_t bits = mix((uint64_t)i * 6 + (uint64_t)c + 1) >> 40;
    return (float)((double)bits / 8388608.0 - 1.0);
}

/* Sums to the same number in whatever order entities come. */
static uint64_t digest(float x, float y, float z) {
    uint32_t b[3];
    float v[3] = {x, y, z};
    memcpy(b, v, sizeof b);
    return mix(mix(mix(b[0] + 1ull) + b[1]) + b[2]);
}

static uint64_t digest_soa(float *const *at, int64_t n) {
    uint64_t sum = 0;
    for (int64_t i = 0; i < n; i++) sum += digest(at[0][i], at[1][i], at[2][i]);
    return sum;
}

static uint64_t digest_aos(const xyz *p, int64_t n) {
    uint64_t sum = 0;
    for (int64_t i = 0; i < n; i++) sum += digest(p[i].x, p[i].y, p[i].z);
    return sum;
}

static void fill_soa(float *const *at, int64_t first, int64_t n) {
    for (int c = 0; c < 6; c++)
        for (int64_t i = 0; i < n; i++) at[c][i] = initial(first + i, c);
}

static void fill_aos(xyz *p, xyz *v, int64_t first, int64_t n) {
    for (int64_t i = 0; i < n; i++) {
        int64_t e = first + i;
        p[i] = (xyz){initial(e, 0), initial(e, 1), initial(e, 2)};
        v[i] = (xyz){initial(e, 3), initial(e, 4), initial(e, 5)};
    }
}

/* -- The loops: one machine code for each layout --------------------------------- */

#define KERNEL static __attribute__((noinline)) void

KERNEL move_soa(int64_t n, float *restrict px, float *restrict py, float *restrict pz,
                const float *restrict vx, const float *restrict vy, const float *restrict vz) {
    for (int64_t i = 0; i < n; i++) {
        px[i] += vx[i] * DT;
        py[i] += vy[i] * DT;
        pz[i] += vz[i] * DT;
    }
}

KERNEL move_aos(int64_t n, xyz *restrict p, const xyz *restrict v) {
    for (int64_t i = 0; i < n; i++) {
        p[i].x += v[i].x * DT;
        p[i].y += v[i].y * DT;
        p[i].z += v[i].z * DT;
    }
}

/* The same structs seen as one run of floats: contiguous loads, no shuffles. */
KERNEL move_flat(int64_t n, float *restrict p, const float *restrict v) {
    for (int64_t i = 0; i < n; i++) p[i] += v[i] * DT;
}

/* -- Worlds ------------------------------------------------------------------------ */

typedef struct jostle_world {
    jsl_ecs *ecs;
    jsl_component set[3 + TAGS]; /* position, velocity, tags; the last one is mass */
    jsl_query query, of_mass;
} jostle_world;

typedef struct flecs_world {
    ecs_world_t *world;
    ecs_entity_t id[3 + TAGS]; /* as above */
    ecs_query_t *query;
} flecs_world;

enum { POSITION, VELOCITY, FIRST_TAG, MASS = FIRST_TAG + TAGS };

static jostle_world jostle_open(void) {
    jostle_world w;
    static const jsl_field p[] = {{"px", "m", JSL_TYPE_F32, JSL_STATE},
                                  {"py", "m", JSL_TYPE_F32, JSL_STATE},
                                  {"pz", "m", JSL_TYPE_F32, JSL_STATE}};
    static const jsl_field v[] = {{"vx", "m/s", JSL_TYPE_F32, JSL_STATE},
                                  {"vy", "m/s", JSL_TYPE_F32, JSL_STATE},
                                  {"vz", "m/s", JSL_TYPE_F32, JSL_STATE}};
    static const jsl_field m[] = {{"kg", "kg", JSL_TYPE_F32, JSL_STATE}};
    must(jsl_ecs_create(&(jsl_ecs_desc){.tag = 1}, &w.ecs), "jsl_ecs_create");
    const jsl_component_desc main[] = {{"position", p, 3, false}, {"velocity", v, 3, false}};
    for (int i = 0; i < 2; i++)
        must(jsl_component_register(w.ecs, &main[i], &w.set[i]), "register");
    for (int i = 0; i < TAGS; i++) {
        char name[16];
        snprintf(name, sizeof name, "tag%d", i);
        jsl_component_desc tag = {.name = name};
        must(jsl_component_register(w.ecs, &tag, &w.set[FIRST_TAG + i]), "register");
    }
    must(jsl_component_register(w.ecs, &(jsl_component_desc){"mass", m, 1, false}, &w.set[MASS]),
         "register");
    jsl_query_desc moving = {{{w.set[POSITION], JSL_WRITE}, {w.set[VELOCITY], JSL_READ}}};
    jsl_query_desc heavy = {{{w.set[MASS], JSL_READ}}};
    must(jsl_query_create(w.ecs, &moving, &w.query), "jsl_query_create");
    must(jsl_query_create(w.ecs, &heavy, &w.of_mass), "jsl_query_create");
    return w;
}

static ecs_entity_t flecs_component(ecs_world_t *world, size_t size, size_t align) {
    return ecs_component_init(world, &(ecs_component_desc_t){.type.size = (ecs_size_t)size,
                                                             .type.alignment = (ecs_size_t)align});
}

static flecs_world flecs_open(void) {
    flecs_world w;
    w.world = ecs_mini();
    w.id[POSITION] = flecs_component(w.world, sizeof(xyz), _Alignof(xyz));
    w.id[VELOCITY] = flecs_component(w.world, sizeof(xyz), _Alignof(xyz));
    for (int i = 0; i < TAGS; i++) w.id[FIRST_TAG + i] = ecs_new(w.world);
    w.id[MASS] = flecs_component(w.world, sizeof(float), _Alignof(float));
    w.query = ecs_query(w.world, {.terms = {{.id = w.id[POSITION], .inout = EcsInOut},
                                            {.id = w.id[VELOCITY], .inout = EcsIn}},
                                  .cache_kind = EcsQueryCacheAll});
    if (!w.query) die("ecs_query");
    return w;
}

/* What flecs itself calls for a query that needs no more; ecs_query_next would ask every time. */
static bool flecs_next(ecs_iter_t *it) {
    return it->flags & EcsIterTrivialCached ? flecs_query_trivial_cached_next(it)
                                            : ecs_query_next(it);
}

static void columns_of(const jsl_rows *rows, float **at) {
    for (int i = 0; i < 6; i++) at[i] = rows->column[rows->first[i / 3] + i % 3];
}

/* n entities in the table of position, velocity and the tags whose bit is set, with the values of
 * entities first, first + 1 ... */
static void jostle_fill(const jostle_world *w, unsigned tags, int64_t first, int64_t n) {
    jsl_component set[2 + TAGS] = {w->set[POSITION], w->set[VELOCITY]};
    int count = 2;
    float *at[6];
    jsl_rows rows;
    for (int t = 0; t < TAGS; t++)
        if (tags >> t & 1) set[count++] = w->set[FIRST_TAG + t];
    must(jsl_entity_create_n(w->ecs, set, count, n, NULL, &rows), "jsl_entity_create_n");
    columns_of(&rows, at);
    fill_soa(at, first, n);
}

static void flecs_fill(const flecs_world *w, unsigned tags, int64_t first, int64_t n, xyz *p,
                       xyz *v) {
    ecs_bulk_desc_t desc = {.count = (int32_t)n, .ids = {w->id[POSITION], w->id[VELOCITY]}};
    void *data[2 + TAGS] = {p, v};
    int count = 2;
    for (int t = 0; t < TAGS; t++)
        if (tags >> t & 1) desc.ids[count++] = w->id[FIRST_TAG + t];
    desc.data = data;
    fill_aos(p, v, first, n);
    if (!ecs_bulk_init(w->world, &desc)) die("ecs_bulk_init");
}

static uint64_t jostle_digest(const jostle_world *w) {
    jsl_rows rows;
    float *at[6];
    uint64_t sum = 0;
    for (jsl_iter it = jsl_query_begin(w->ecs, w->query, 0); jsl_query_next(&it, &rows);) {
        columns_of(&rows, at);
        sum += digest_soa(at, rows.count);
    }
    return sum;
}

static uint64_t flecs_digest(const flecs_world *w) {
    uint64_t sum = 0;
    for (ecs_iter_t it = ecs_query_iter(w->world, w->query); ecs_query_next(&it);)
        sum += digest_aos(ecs_field(&it, xyz, 0), it.count);
    return sum;
}

/* -- Case 1 and 4: position += velocity * dt --------------------------------------- */

typedef struct scene {
    jostle_world jostle[3]; /* one for each way to iterate, so that all make the same steps */
    flecs_world flecs[2];
    arrays *soa[2]; /* one a table */
    xyz *p, *v;
    int64_t n, tables, rows; /* n = tables * rows */
} scene;

typedef void pass_fn(scene *s);

static void jostle_pass(const jostle_world *w, int64_t block, bool padded) {
    jsl_rows rows;
    float *at[6];
    for (jsl_iter it = jsl_query_begin(w->ecs, w->query, block); jsl_query_next(&it, &rows);) {
        columns_of(&rows, at);
        int64_t n = padded ? (rows.count + 15) & ~15ll : rows.count;
        move_soa(n, at[0], at[1], at[2], at[3], at[4], at[5]);
    }
}

static void pass_jostle(scene *s) { jostle_pass(&s->jostle[0], 0, false); }
static void pass_padded(scene *s) { jostle_pass(&s->jostle[1], 0, true); } /* ecs.h allows it */
static void pass_blocks(scene *s) { jostle_pass(&s->jostle[2], 4096, false); }

static void pass_flecs(scene *s) {
    ecs_iter_t it = ecs_query_iter(s->flecs[0].world, s->flecs[0].query);
    while (flecs_next(&it)) move_aos(it.count, ecs_field(&it, xyz, 0), ecs_field(&it, xyz, 1));
}

static void pass_flecs_flat(scene *s) {
    ecs_iter_t it = ecs_query_iter(s->flecs[1].world, s->flecs[1].query);
    while (flecs_next(&it))
        move_flat(it.count * 3ll, &ecs_field(&it, xyz, 0)->x, &ecs_field(&it, xyz, 1)->x);
}

static void soa_pass(const scene *s, const arrays *a) {
    for (int64_t t = 0; t < s->tables; t++, a++)
        move_soa(s->rows, a->at[0], a->at[1], a->at[2], a->at[3], a->at[4], a->at[5]);
}

static void pass_soa(scene *s) { soa_pass(s, s->soa[0]); }
static void pass_staggered(scene *s) { soa_pass(s, s->soa[1]); }

static void pass_aos(scene *s) {
    for (int64_t i = 0; i < s->n; i += s->rows) move_aos(s->rows, s->p + i, s->v + i);
}

enum { JOSTLE, PADDED, BLOCKS, FLECS, FLECS_FLAT, SOA, STAGGERED, AOS, PASSES };
static pass_fn *const passes[PASSES] = {pass_jostle,     pass_padded, pass_blocks,    pass_flecs,
                                        pass_flecs_flat, pass_soa,    pass_staggered, pass_aos};

/* Six arrays in one block; each starts `stagger` bytes further into its page than the one before,
 * or where the one before ends when that is 0. */
static arrays make_arrays(int64_t first, int64_t n, size_t stagger) {
    arrays a;
    size_t bytes = ((size_t)n * sizeof(float) + ALIGN - 1) / ALIGN * ALIGN;
    if (stagger) bytes = (bytes + 4095) / 4096 * 4096 + stagger;
    a.block = take(6 * bytes);
    for (size_t c = 0; c < 6; c++) a.at[c] = (float *)(void *)((char *)a.block + c * bytes);
    fill_soa(a.at, first, n);
    return a;
}

static void scene_open(scene *s, int64_t tables, int64_t rows) {
    *s = (scene){.n = tables * rows, .tables = tables, .rows = rows};
    s->p = take((size_t)s->n * sizeof(xyz));
    s->v = take((size_t)s->n * sizeof(xyz));
    for (int i = 0; i < 3; i++) {
        s->jostle[i] = jostle_open();
        for (int64_t t = 0; t < tables; t++)
            jostle_fill(&s->jostle[i], (unsigned)t, t * rows, rows);
    }
    for (int i = 0; i < 2; i++) {
        s->flecs[i] = flecs_open();
        for (int64_t t = 0; t < tables; t++)
            flecs_fill(&s->flecs[i], (unsigned)t, t * rows, rows, s->p, s->v);
    }
    for (int i = 0; i < 2; i++) {
        s->soa[i] = take((size_t)tables * sizeof(arrays));
        for (int64_t t = 0; t < tables; t++)
            s->soa[i][t] = make_arrays(t * rows, rows, i && tables == 1 ? 8 * ALIGN : 0);
    }
    fill_aos(s->p, s->v, 0, s->n);
}

static void scene_close(scene *s, const char *name) {
    uint64_t want = digest_aos(s->p, s->n);
    bool same = true;
    for (int i = 0; i < 3; i++) same &= jostle_digest(&s->jostle[i]) == want;
    for (int i = 0; i < 2; i++) same &= flecs_digest(&s->flecs[i]) == want;
    for (int i = 0; i < 2; i++) {
        uint64_t sum = 0;
        for (int64_t t = 0; t < s->tables; t++) sum += digest_soa(s->soa[i][t].at, s->rows);
        same &= sum == want;
    }
    if (!same) {
        fprintf(stderr, "%s: ", name);
        die("contestants disagree about the positions");
    }
    for (int i = 0; i < 3; i++) jsl_ecs_destroy(s->jostle[i].ecs);
    for (int i = 0; i < 2; i++) ecs_fini(s->flecs[i].world);
    for (int i = 0; i < 2; i++) {
        for (int64_t t = 0; t < s->tables; t++) free(s->soa[i][t].block);
        free(s->soa[i]);
    }
    free(s->p);
    free(s->v);
}

static double least(double a, double b) { return a < b ? a : b; }

static void bench_move(const options *o, const char *name, int64_t tables, int64_t rows) {
    static const char *const suffix[] = {"", ", padded", ", blocks of 4096"};
    scene s;
    double sample[PASSES][MAX_REPEATS], ns[PASSES];
    scene_open(&s, tables, rows);
    int64_t loops = 4000000 / s.n + 1; /* about a millisecond */
    for (int r = -1; r < o->repeats; r++) {
        for (int k = 0; k < PASSES; k++) {
            int c = (r + 1 + k) % PASSES;
            passes[c](&s); /* warms the caches after the others */
            double t = now_ns();
            for (int64_t i = 0; i < loops; i++) passes[c](&s);
            t = now_ns() - t;
            if (r >= 0) sample[c][r] = t / ((double)loops * (double)s.n);
        }
    }
    for (int c = 0; c < PASSES; c++) ns[c] = median(sample[c], o->repeats);
    double flecs = least(ns[FLECS], ns[FLECS_FLAT]), soa = least(ns[SOA], ns[STAGGERED]);
    for (int c = JOSTLE; c <= BLOCKS; c++) {
        char text[64];
        snprintf(text, sizeof text, "%s%s", name, suffix[c]);
        report(o, text, s.n, ns[c], flecs, soa, ns[AOS]);
    }
    if (o->detail)
        fprintf(stderr, "  flecs structs %.4f flat %.4f; arrays packed %.4f staggered %.4f\n",
                ns[FLECS], ns[FLECS_FLAT], ns[SOA], ns[STAGGERED]);
    scene_close(&s, name);
}

/* -- Cases 2 and 3: structure ---------------------------------------------------------- */

/* One sequence of structural changes; every step of it is a figure. */
enum {
    CREATE_NEW,  /* a new world; jostle zeroes the values, flecs leaves them as they are */
    ADD_BULK,    /* mass, to all */
    REMOVE_BULK, /* mass, from all */
    ADD_HANDLES, /* the same by handle */
    REMOVE_HANDLES,
    DESTROY_BULK,
    CREATE_AGAIN, /* into the world that has been that large */
    DESTROY_HANDLES,
    CREATE_FILLED, /* the same, and both copy values in */
    CREATE_ONE,    /* from here on one call for each entity */
    ADD_ONE,
    REMOVE_ONE,
    DESTROY_ONE,
    CHANGES
};
static const char *const change_name[CHANGES] = {
    "create, bulk, new world",   "add component, bulk",          "remove component, bulk",
    "add component, by handles", "remove component, by handles", "destroy, bulk",
    "create, bulk, again",       "destroy, by handles",          "create and fill, bulk, again",
    "create, one at a time",     "add component, one at a time", "remove component, one at a time",
    "destroy, one at a time"};

typedef struct changes {
    double ns[CHANGES];
    uint64_t digest;
    int64_t heavy; /* entities with mass, summed over the three times it was added */
} changes;

static void lap(double *t, double *ns, int64_t n) {
    double now = now_ns();
    *ns = (now - *t) / (double)n;
    *t = now_ns();
}

static void kill_all(const jsl_rows *rows, uint8_t *dead, void *arg) {
    (void)arg;
    memset(dead, 1, (size_t)rows->count);
}

static void jostle_changes(int64_t n, const arrays *a, jsl_entity *handle, changes *c) {
    jostle_world w = jostle_open();
    jsl_ecs *ecs = w.ecs;
    const jsl_component *mass = &w.set[MASS];
    jsl_rows rows;
    float *at[6];
    double t = now_ns();
    must(jsl_entity_create_n(ecs, w.set, 2, n, handle, &rows), "create_n");
    lap(&t, &c->ns[CREATE_NEW], n);
    columns_of(&rows, at);
    for (int k = 0; k < 6; k++) memcpy(at[k], a->at[k], (size_t)n * sizeof(float));
    t = now_ns();
    must(jsl_entity_add_where(ecs, w.query, mass, 1, NULL), "add_where");
    lap(&t, &c->ns[ADD_BULK], n);
    c->heavy += jsl_query_count(ecs, w.of_mass);
    c->digest += jostle_digest(&w);
    t = now_ns();
    must(jsl_entity_remove_where(ecs, w.of_mass, mass, 1, NULL), "remove_where");
    lap(&t, &c->ns[REMOVE_BULK], n);
    must(jsl_entity_add_n(ecs, handle, n, mass, 1), "add_n");
    lap(&t, &c->ns[ADD_HANDLES], n);
    c->heavy += jsl_query_count(ecs, w.of_mass);
    c->digest += jostle_digest(&w);
    t = now_ns();
    must(jsl_entity_remove_n(ecs, handle, n, mass, 1), "remove_n");
    lap(&t, &c->ns[REMOVE_HANDLES], n);
    must(jsl_entity_destroy_where(ecs, w.query, kill_all, NULL, NULL), "destroy_where");
    lap(&t, &c->ns[DESTROY_BULK], n);
    must(jsl_entity_create_n(ecs, w.set, 2, n, handle, &rows), "create_n");
    lap(&t, &c->ns[CREATE_AGAIN], n);
    must(jsl_entity_destroy_n(ecs, handle, n), "destroy_n");
    lap(&t, &c->ns[DESTROY_HANDLES], n);
    must(jsl_entity_create_n(ecs, w.set, 2, n, handle, &rows), "create_n");
    columns_of(&rows, at);
    for (int k = 0; k < 6; k++) memcpy(at[k], a->at[k], (size_t)n * sizeof(float));
    lap(&t, &c->ns[CREATE_FILLED], n);
    c->digest += jostle_digest(&w);
    must(jsl_entity_destroy_where(ecs, w.query, kill_all, NULL, NULL), "destroy_where");
    t = now_ns();
    for (int64_t i = 0; i < n; i++) must(jsl_entity_create(ecs, w.set, 2, &handle[i]), "create");
    lap(&t, &c->ns[CREATE_ONE], n);
    for (int64_t i = n; i-- > 0;) must(jsl_entity_add(ecs, handle[i], mass, 1), "add");
    lap(&t, &c->ns[ADD_ONE], n);
    c->heavy += jsl_query_count(ecs, w.of_mass);
    t = now_ns();
    for (int64_t i = 0; i < n; i++) must(jsl_entity_remove(ecs, handle[i], mass, 1), "remove");
    lap(&t, &c->ns[REMOVE_ONE], n);
    for (int64_t i = 0; i < n; i++) must(jsl_entity_destroy(ecs, handle[i]), "destroy");
    lap(&t, &c->ns[DESTROY_ONE], n);
    if (jsl_entity_count(ecs) != 0) die("jostle: entities are left");
    jsl_ecs_destroy(ecs);
}

/* flecs has no call that adds to all or that takes handles: the loop stands in for both, from the
 * last row to the first, so that no row has to move up. */
static void flecs_add_each(const flecs_world *w, const ecs_entity_t *e, int64_t n) {
    for (int64_t i = n; i-- > 0;) ecs_add_id(w->world, e[i], w->id[MASS]);
}

static void flecs_changes(int64_t n, xyz *p, xyz *v, ecs_entity_t *handle, changes *c) {
    flecs_world w = flecs_open();
    ecs_bulk_desc_t desc = {.count = (int32_t)n, .ids = {w.id[POSITION], w.id[VELOCITY]}};
    ecs_entity_t mass = w.id[MASS];
    double t = now_ns();
    memcpy(handle, ecs_bulk_init(w.world, &desc), (size_t)n * sizeof *handle);
    lap(&t, &c->ns[CREATE_NEW], n);
    ecs_table_t *table = ecs_get_table(w.world, handle[0]);
    memcpy(ecs_table_get_id(w.world, table, w.id[POSITION], 0), p, (size_t)n * sizeof *p);
    memcpy(ecs_table_get_id(w.world, table, w.id[VELOCITY], 0), v, (size_t)n * sizeof *v);
    t = now_ns();
    flecs_add_each(&w, handle, n);
    lap(&t, &c->ns[ADD_BULK], n);
    c->heavy += ecs_count_id(w.world, mass);
    c->digest += flecs_digest(&w);
    t = now_ns();
    ecs_remove_all(w.world, mass);
    lap(&t, &c->ns[REMOVE_BULK], n);
    flecs_add_each(&w, handle, n);
    lap(&t, &c->ns[ADD_HANDLES], n);
    c->heavy += ecs_count_id(w.world, mass);
    c->digest += flecs_digest(&w);
    t = now_ns();
    for (int64_t i = 0; i < n; i++) ecs_remove_id(w.world, handle[i], mass);
    lap(&t, &c->ns[REMOVE_HANDLES], n);
    ecs_delete_with(w.world, w.id[POSITION]);
    lap(&t, &c->ns[DESTROY_BULK], n);
    memcpy(handle, ecs_bulk_init(w.world, &desc), (size_t)n * sizeof *handle);
    lap(&t, &c->ns[CREATE_AGAIN], n);
    for (int64_t i = n; i-- > 0;) ecs_delete(w.world, handle[i]);
    lap(&t, &c->ns[DESTROY_HANDLES], n);
    desc.data = (void *[]){p, v};
    memcpy(handle, ecs_bulk_init(w.world, &desc), (size_t)n * sizeof *handle);
    lap(&t, &c->ns[CREATE_FILLED], n);
    c->digest += flecs_digest(&w);
    ecs_delete_with(w.world, w.id[POSITION]);
    table = ecs_table_find(w.world, desc.ids, 2);
    t = now_ns();
    for (int64_t i = 0; i < n; i++) handle[i] = ecs_new_w_table(w.world, table);
    lap(&t, &c->ns[CREATE_ONE], n);
    flecs_add_each(&w, handle, n);
    lap(&t, &c->ns[ADD_ONE], n);
    c->heavy += ecs_count_id(w.world, mass);
    t = now_ns();
    for (int64_t i = 0; i < n; i++) ecs_remove_id(w.world, handle[i], mass);
    lap(&t, &c->ns[REMOVE_ONE], n);
    for (int64_t i = 0; i < n; i++) ecs_delete(w.world, handle[i]);
    lap(&t, &c->ns[DESTROY_ONE], n);
    if (ecs_count_id(w.world, w.id[POSITION]) != 0) die("flecs: entities are left");
    ecs_fini(w.world);
}

/* The floor under creation: take zeroed columns and a column of handles from the C library. */
static double arrays_create(int64_t n) {
    double t = now_ns(), ns;
    size_t bytes = (size_t)n * (6 * sizeof(float) + sizeof(jsl_entity));
    char *at = take(bytes);
    memset(at, 0, bytes);
    __asm__ volatile("" : : "r"(at) : "memory"); /* keep the writes */
    lap(&t, &ns, n);
    free(at);
    return ns;
}

static void bench_changes(const options *o, int64_t n) {
    arrays a = make_arrays(0, n, 0);
    xyz *p = take((size_t)n * sizeof *p), *v = take((size_t)n * sizeof *v);
    jsl_entity *ours = take((size_t)n * sizeof *ours);
    ecs_entity_t *theirs = take((size_t)n * sizeof *theirs);
    static double sample[2 * CHANGES + 1][MAX_REPEATS];
    fill_aos(p, v, 0, n);
    memset(ours, 0, (size_t)n * sizeof *ours);
    memset(theirs, 0, (size_t)n * sizeof *theirs);
    for (int r = -1; r < o->repeats; r++) {
        changes c[2] = {0};
        if (r & 1) flecs_changes(n, p, v, theirs, &c[1]);
        jostle_changes(n, &a, ours, &c[0]);
        if (!(r & 1)) flecs_changes(n, p, v, theirs, &c[1]);
        if (c[0].digest != c[1].digest || c[0].heavy != c[1].heavy || c[0].heavy != 3 * n)
            die("jostle and flecs disagree after structural changes");
        double floor = arrays_create(n);
        for (int k = 0; k < 2 * CHANGES && r >= 0; k++)
            sample[k][r] = c[k / CHANGES].ns[k % CHANGES];
        if (r >= 0) sample[2 * CHANGES][r] = floor;
    }
    double floor = median(sample[2 * CHANGES], o->repeats);
    for (int k = 0; k < CHANGES; k++)
        report(o, change_name[k], n, median(sample[k], o->repeats),
               median(sample[CHANGES + k], o->repeats),
               k == CREATE_NEW || k == CREATE_AGAIN ? floor : 0, 0);
    free(a.block);
    free(p);
    free(v);
    free(ours);
    free(theirs);
}

static bool wanted(const options *o, const char *group) {
    return !o->only || strcmp(o->only, group) == 0;
}

int main(int argc, char **argv) {
    options o = {.repeats = 21, .max = 10000000};
    for (int i = 1; i < argc; i++) {
        bool more = i + 1 < argc;
        if (strcmp(argv[i], "--json") == 0)
            o.json = true;
        else if (strcmp(argv[i], "--detail") == 0)
            o.detail = true;
        else if (strcmp(argv[i], "--repeats") == 0 && more)
            o.repeats = atoi(argv[++i]);
        else if (strcmp(argv[i], "--max") == 0 && more)
            o.max = atoll(argv[++i]);
        else if (strcmp(argv[i], "--only") == 0 && more)
            o.only = argv[++i];
        else {
            fprintf(stderr, "usage: ecs_peer [--json] [--detail] [--repeats N] [--max ENTITIES] "
                            "[--only move|tables|changes]\n");
            return 2;
        }
    }
    if (o.repeats < 1 || o.repeats > MAX_REPEATS) die("--repeats is 1 to 101");
    if (o.max < 1) die("--max is at least 1");
    mallopt(M_MMAP_THRESHOLD, 128 * 1024); /* the default, without its drift */
    heading(&o);
    for (int64_t n = 10000; n <= 10000000 && n <= o.max && wanted(&o, "move"); n *= 10)
        bench_move(&o, "move", 1, n);
    if (wanted(&o, "tables")) bench_move(&o, "move, 1000 tables", SMALL_TABLES, SMALL_ROWS);
    if (wanted(&o, "changes")) bench_changes(&o, o.max < 1000000 ? o.max : 1000000);
    return 0;
}
