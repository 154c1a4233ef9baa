/* SPDX-License-Identifier: MIT
 * Internal base services: checked allocation, arena, messages, tasks, random numbers, hashing,
 * sorting, bit sets. Floor 0. Functions shared between files carry the jsl_ prefix but are not
 * exported.
 */
#ifndef JSL_BASE_BASE_H
#define JSL_BASE_BASE_H

#include <jostle/base.h>

#include <assert.h>
#include <stdarg.h>
#include <string.h>

/* Guards our own invariants, never user data. */
#ifndef NDEBUG
#define JSL_ASSERT(x) assert(x)
#else
#define JSL_ASSERT(x) ((void)0)
#endif

#define JSL_COUNT(a) ((int)(sizeof(a) / sizeof((a)[0])))
#define JSL_TRY(expr)                                                                              \
    do {                                                                                           \
        jsl_result jsl_try_ = (expr);                                                              \
        if (jsl_try_ != JSL_OK) return jsl_try_;                                                   \
    } while (0)

/* Column alignment in bytes, and the row multiple to which columns are padded: kernels may read and
 * write whole groups of JSL_LANES rows, the last of which may be padding. */
#define JSL_ALIGN 64
#define JSL_LANES 16

static inline int64_t jsl_round_up(int64_t n, int64_t multiple) {
    return (n + multiple - 1) / multiple * multiple;
}

/* -- Memory (alloc.c) ------------------------------------------------------------------ */

/* An allocator with its accounts. Every object owns one and hands it down. */
typedef struct jsl_memory {
    jsl_allocator hook; /* never null functions after jsl_memory_init */
    int64_t live_bytes, peak_bytes;
    int64_t live_blocks;
    int64_t calls; /* successful so far: its growth over a step is the step's allocations */
} jsl_memory;

/* A zeroed hook becomes the C library's. JSL_ERR_ARGUMENT when only one of its two is given. */
jsl_result jsl_memory_init(jsl_memory *memory, jsl_allocator hook);
/* size bytes at JSL_ALIGN, not zeroed; null when size is 0 or memory is out. Not thread-safe. */
void *jsl_alloc(jsl_memory *memory, size_t size);
void *jsl_alloc_zero(jsl_memory *memory, size_t size);
void jsl_free(jsl_memory *memory, void *ptr, size_t size);
/* *ptr (old bytes) becomes new_size bytes, old contents kept; unchanged on failure. */
jsl_result jsl_realloc(jsl_memory *memory, void **ptr, size_t old_size, size_t new_size);

/* Typed growable array: JSL_ARRAY(int) a = {0}; jsl_array_reserve(&memory, &a, n). */
#define JSL_ARRAY(type)                                                                            \
    struct {                                                                                       \
        type *at;                                                                                  \
        int64_t count, cap;                                                                        \
    }
/* Room for at least n elements (grows by half again, at least 16). */
#define jsl_array_reserve(memory, array, n)                                                        \
    jsl_array_reserve_(memory, (void **)&(array)->at, &(array)->cap, n, sizeof *(array)->at)
#define jsl_array_free(memory, array)                                                              \
    (jsl_free(memory, (array)->at, (size_t)(array)->cap * sizeof *(array)->at),                    \
     (array)->at = NULL, (array)->count = (array)->cap = 0)
jsl_result jsl_array_reserve_(jsl_memory *memory, void **at, int64_t *cap, int64_t n, size_t size);

/* -- Arena (arena.c) ------------------------------------------------------------------- */

/* Bump allocator for one step's scratch. When a block is full the arena takes another from memory,
 * and jsl_arena_reset merges all into one, so that after warm-up a step allocates nothing. */
typedef struct jsl_arena_block jsl_arena_block;
typedef struct jsl_arena {
    jsl_memory *memory;
    jsl_arena_block *block; /* newest first */
    int64_t used, peak;     /* bytes in use, high-water mark since creation */
} jsl_arena;
typedef struct jsl_arena_mark {
    jsl_arena_block *block;
    int64_t block_used, used;
} jsl_arena_mark;

void jsl_arena_init(jsl_arena *arena, jsl_memory *memory);
void jsl_arena_fini(jsl_arena *arena);
/* size bytes at JSL_ALIGN, not zeroed, never null for size 0; null when memory is out. */
void *jsl_arena_alloc(jsl_arena *arena, int64_t size);
void *jsl_arena_zero(jsl_arena *arena, int64_t size);
#define JSL_ARENA_NEW(arena, type, n)                                                              \
    ((type *)jsl_arena_alloc(arena, (int64_t)(n) * (int64_t)sizeof(type)))
jsl_arena_mark jsl_arena_save(const jsl_arena *arena);
/* Gives back everything taken since the mark (blocks stay owned). */
void jsl_arena_rewind(jsl_arena *arena, jsl_arena_mark mark);
/* Everything given back, and one block as large as the peak kept. */
void jsl_arena_reset(jsl_arena *arena);

/* -- Messages (log.c) ------------------------------------------------------------------ */

/* Formats one line (at most 511 bytes) and hands it to the logger; returns code, so that
 * return jsl_fail(&log, JSL_ERR_ARGUMENT, "mass of body %u is %g", ...) reads well. A null or
 * zeroed logger is silent. */
jsl_result jsl_fail(const jsl_logger *logger, jsl_result code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void jsl_log_line(const jsl_logger *logger, jsl_log_level level, jsl_result code,
                  const char *format, ...) __attribute__((format(printf, 4, 5)));

/* -- Tasks (tasks.c, pool.c) ----------------------------------------------------------- */

/* Runs parallel loops over fixed blocks on the host's tasks, on our own pool, or serially. The
 * split into blocks depends on count and block alone, never on the number of workers. */
typedef struct jsl_pool jsl_pool;
typedef struct jsl_exec {
    jsl_tasks tasks; /* workers >= 1 */
    jsl_pool *pool;  /* ours, when the host gave no hooks and asked for workers > 1 */
} jsl_exec;

/* One block [begin, end) of a loop. block counts from 0; worker is in [0, workers) and no two calls
 * run at once with the same worker, so that scratch can be per worker. */
typedef void jsl_block_fn(void *arg, int64_t begin, int64_t end, int64_t block, int worker);

/* hooks zeroed and workers <= 1: serial. hooks zeroed and workers > 1: starts a pool of workers - 1
 * threads. JSL_ERR_UNSUPPORTED when threads cannot be started, JSL_ERR_LIMIT above JSL_MAX_WORKERS.
 */
#define JSL_MAX_WORKERS 64
jsl_result jsl_exec_init(jsl_exec *exec, jsl_memory *memory, jsl_tasks hooks, int workers);
void jsl_exec_fini(jsl_exec *exec, jsl_memory *memory);
/* Runs fn over [0, count) in blocks of block_size and returns when all are done. Blocks are claimed
 * by an atomic counter. Not reentrant from inside fn. Allocates nothing. exec may be null: serial,
 * worker 0. */
void jsl_parallel_for(const jsl_exec *exec, int64_t count, int64_t block_size, jsl_block_fn *fn,
                      void *arg);
/* Runs fn(arg, worker, workers) once on every worker at the same time (workers of exec really
 * concurrent, so that spin barriers between them are allowed only if this returns true; false: it
 * ran serially with workers = 1). */
typedef void jsl_region_fn(void *arg, int worker, int workers);
bool jsl_parallel_region(const jsl_exec *exec, jsl_region_fn *fn, void *arg);

/* Sense-reversing spin barrier for use inside a region; zero-initialise. */
typedef struct jsl_barrier {
    int32_t arrived, generation; /* accessed atomically */
} jsl_barrier;
void jsl_barrier_wait(jsl_barrier *barrier, int workers);

/* Seconds of the monotonic clock, for profiles only: no result may depend on it. */
double jsl_seconds(void);

/* -- Random numbers (rng.h is inline in this header: counter-based) -------------------- */

/* Philox-2x32-like strength is not needed; a 64-bit finaliser over a key and a counter is (Steele,
 * Lea, Flood 2014, "Fast splittable pseudorandom number generators", the mixing function of
 * Stafford's variant 13). */
static inline uint64_t jsl_mix64(uint64_t x) {
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9ull;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}
/* A stream of numbers keyed by who asks, never by when or on which thread. */
typedef struct jsl_rng {
    uint64_t key, counter;
} jsl_rng;
static inline jsl_rng jsl_rng_make(uint64_t seed, uint64_t entity, uint64_t step, uint64_t stream) {
    uint64_t k = jsl_mix64(seed + 0x9e3779b97f4a7c15ull);
    k = jsl_mix64(k ^ (entity + 0x9e3779b97f4a7c15ull));
    k = jsl_mix64(k ^ (step * 0xd1b54a32d192ed03ull + stream));
    return (jsl_rng){k, 0};
}
static inline uint64_t jsl_rng_u64(jsl_rng *rng) {
    return jsl_mix64(rng->key + 0x9e3779b97f4a7c15ull * ++rng->counter);
}
/* Uniform in [0, 1): 24 bits, the same value in float and double builds. */
static inline jsl_real jsl_rng_unit(jsl_rng *rng) {
    return (jsl_real)(jsl_rng_u64(rng) >> 40) * JSL_R(1.0 / 16777216.0);
}
/* Uniform in [-1, 1). */
static inline jsl_real jsl_rng_signed(jsl_rng *rng) { return 2 * jsl_rng_unit(rng) - 1; }

/* -- Hashing (hash.c) ------------------------------------------------------------------ */

/* 64-bit hash of bytes; the same on every machine. Fast: several GB/s. Not cryptographic. */
uint64_t jsl_hash_bytes(const void *data, size_t size, uint64_t seed);
/* CRC-32C (Castagnoli), as the telemetry schema asks for. Start with crc 0; may be continued. */
uint32_t jsl_crc32c(uint32_t crc, const void *data, size_t size);
/* The same without the CPU's instruction: for tests. */
uint32_t jsl_crc32c_by_table(uint32_t crc, const void *data, size_t size);

/* -- Map u64 -> u32 (map.c) ------------------------------------------------------------ */

/* Open addressing, linear probing. Key 0 is not allowed. Iteration order is never exposed. */
typedef struct jsl_map {
    uint64_t *key;
    uint32_t *value;
    int64_t cap, count; /* cap: power of two or 0 */
} jsl_map;
jsl_result jsl_map_reserve(jsl_memory *memory, jsl_map *map, int64_t count);
void jsl_map_free(jsl_memory *memory, jsl_map *map);
bool jsl_map_get(const jsl_map *map, uint64_t key, uint32_t *value);
jsl_result jsl_map_set(jsl_memory *memory, jsl_map *map, uint64_t key, uint32_t value);
bool jsl_map_remove(jsl_map *map, uint64_t key);
void jsl_map_clear(jsl_map *map);

/* -- Sorting (sort.c) ------------------------------------------------------------------ */

/* Stable LSD radix sort of n keys with payload; tmp_* are scratch of n. Skips digits that are all
 * equal. */
void jsl_sort_u64(uint64_t *key, uint32_t *value, uint64_t *tmp_key, uint32_t *tmp_value,
                  int64_t n);
void jsl_sort_u32(uint32_t *key, uint32_t *value, uint32_t *tmp_key, uint32_t *tmp_value,
                  int64_t n);

/* -- Bit sets (bitset.c) --------------------------------------------------------------- */

typedef struct jsl_bitset {
    uint64_t *word;
    int64_t words;
} jsl_bitset;
/* At least bits bits, new ones zero. */
jsl_result jsl_bitset_reserve(jsl_memory *memory, jsl_bitset *set, int64_t bits);
void jsl_bitset_free(jsl_memory *memory, jsl_bitset *set);
void jsl_bitset_clear(jsl_bitset *set);
static inline bool jsl_bitset_get(const jsl_bitset *set, int64_t i) {
    return (i >> 6) < set->words && (set->word[i >> 6] >> (i & 63) & 1);
}
static inline void jsl_bitset_on(jsl_bitset *set, int64_t i) {
    set->word[i >> 6] |= 1ull << (i & 63);
}
static inline void jsl_bitset_off(jsl_bitset *set, int64_t i) {
    set->word[i >> 6] &= ~(1ull << (i & 63));
}
int64_t jsl_bitset_count(const jsl_bitset *set);
/* The first set bit at or after i, or -1. */
int64_t jsl_bitset_next(const jsl_bitset *set, int64_t i);

#endif
