/* SPDX-License-Identifier: MIT
 * pool.c - threads that wait for the next job: a short spin, then a condition variable.
 *
 * One 64-bit word, the gate, holds the number of the job, whether it is open, and how many threads
 * have joined it. A thread joins by compare-and-swap while the gate is open, at most once a job; it
 * counts itself out in `left`. The caller works too, then closes the gate and waits until all who
 * joined have left: a thread that slept through a short job is not waited for. Fields of the job
 * are written before the gate opens and read only by those who joined, so they need no atomics.
 */
#include "base/pool.h"

#include <pthread.h>
#include <signal.h>

/* About 20 microseconds: longer than the gaps between the stages of a step, shorter than a time
 * slice. */
#define SPINS 500

#define GATE_OPEN (1ull << 31)
#define GATE_JOINED (GATE_OPEN - 1)
#define GATE_JOB 32

typedef struct seat {
    jsl_pool *pool;
    pthread_t thread;
    int worker;
} seat;

struct jsl_pool {
    jsl_region_fn *fn;
    void *arg;
    int workers;
    seat seats[JSL_MAX_WORKERS]; /* of the threads: 1 .. workers - 1 */
    pthread_mutex_t mutex;
    pthread_cond_t wake, done;
    /* On lines of their own: everybody spins on the gate. All accessed atomically. */
    _Alignas(JSL_ALIGN) uint64_t gate;
    _Alignas(JSL_ALIGN) int32_t left;
    int32_t sleepers, caller_sleeps, quit;
};

static bool gate_is_new(uint64_t gate, uint32_t last) {
    return (gate & GATE_OPEN) && (uint32_t)(gate >> GATE_JOB) != last;
}

/* Returns when there is a job newer than last, or the pool quits. */
static void await_job(jsl_pool *pool, uint32_t last) {
    for (int i = 0; i < SPINS; i++) {
        if (gate_is_new(__atomic_load_n(&pool->gate, __ATOMIC_ACQUIRE), last)) return;
        if (__atomic_load_n(&pool->quit, __ATOMIC_ACQUIRE)) return;
        jsl_cpu_relax();
    }
    pthread_mutex_lock(&pool->mutex);
    /* Sequentially consistent on both sides: either we see the gate open, or the caller sees a
     * sleeper. */
    __atomic_add_fetch(&pool->sleepers, 1, __ATOMIC_SEQ_CST);
    while (!gate_is_new(__atomic_load_n(&pool->gate, __ATOMIC_SEQ_CST), last) &&
           !__atomic_load_n(&pool->quit, __ATOMIC_SEQ_CST))
        pthread_cond_wait(&pool->wake, &pool->mutex);
    __atomic_sub_fetch(&pool->sleepers, 1, __ATOMIC_SEQ_CST);
    pthread_mutex_unlock(&pool->mutex);
}

static bool join_job(jsl_pool *pool, uint32_t *last) {
    uint64_t gate = __atomic_load_n(&pool->gate, __ATOMIC_ACQUIRE);
    while (gate_is_new(gate, *last)) {
        if (__atomic_compare_exchange_n(&pool->gate, &gate, gate + 1, true, __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE)) {
            *last = (uint32_t)(gate >> GATE_JOB);
            return true;
        }
    }
    return false;
}

static void leave_job(jsl_pool *pool) {
    __atomic_add_fetch(&pool->left, 1, __ATOMIC_SEQ_CST);
    if (!__atomic_load_n(&pool->caller_sleeps, __ATOMIC_SEQ_CST)) return;
    pthread_mutex_lock(&pool->mutex);
    pthread_cond_signal(&pool->done);
    pthread_mutex_unlock(&pool->mutex);
}

static void *thread_main(void *arg) {
    seat *me = arg;
    jsl_pool *pool = me->pool;
    uint32_t last = 0;
    while (!__atomic_load_n(&pool->quit, __ATOMIC_ACQUIRE)) {
        await_job(pool, last);
        if (!join_job(pool, &last)) continue;
        pool->fn(pool->arg, me->worker, pool->workers);
        leave_job(pool);
    }
    return NULL;
}

static void await_left(jsl_pool *pool, int32_t joined) {
    for (int i = 0; i < SPINS; i++) {
        if (__atomic_load_n(&pool->left, __ATOMIC_ACQUIRE) == joined) return;
        jsl_cpu_relax();
    }
    pthread_mutex_lock(&pool->mutex);
    __atomic_store_n(&pool->caller_sleeps, 1, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(&pool->left, __ATOMIC_SEQ_CST) != joined)
        pthread_cond_wait(&pool->done, &pool->mutex);
    __atomic_store_n(&pool->caller_sleeps, 0, __ATOMIC_SEQ_CST);
    pthread_mutex_unlock(&pool->mutex);
}

void jsl_pool_run(jsl_pool *pool, jsl_region_fn *fn, void *arg, bool all) {
    pool->fn = fn;
    pool->arg = arg;
    __atomic_store_n(&pool->left, 0, __ATOMIC_RELAXED);
    uint64_t job = (__atomic_load_n(&pool->gate, __ATOMIC_RELAXED) >> GATE_JOB) + 1;
    __atomic_store_n(&pool->gate, job << GATE_JOB | GATE_OPEN, __ATOMIC_SEQ_CST);
    if (__atomic_load_n(&pool->sleepers, __ATOMIC_SEQ_CST) > 0) {
        pthread_mutex_lock(&pool->mutex);
        pthread_cond_broadcast(&pool->wake);
        pthread_mutex_unlock(&pool->mutex);
    }
    fn(arg, 0, pool->workers);
    if (all) await_left(pool, pool->workers - 1);
    uint64_t gate = __atomic_fetch_and(&pool->gate, ~GATE_OPEN, __ATOMIC_ACQ_REL);
    await_left(pool, (int32_t)(gate & GATE_JOINED));
}

static void stop_threads(jsl_pool *pool, int workers) {
    pthread_mutex_lock(&pool->mutex);
    __atomic_store_n(&pool->quit, 1, __ATOMIC_SEQ_CST);
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->mutex);
    for (int i = 1; i < workers; i++) pthread_join(pool->seats[i].thread, NULL);
}

static void free_pool(jsl_pool *pool, jsl_memory *memory) {
    pthread_cond_destroy(&pool->done);
    pthread_cond_destroy(&pool->wake);
    pthread_mutex_destroy(&pool->mutex);
    jsl_free(memory, pool, sizeof *pool);
}

jsl_result jsl_pool_create(jsl_memory *memory, int workers, jsl_pool **out) {
    jsl_pool *pool = jsl_alloc_zero(memory, sizeof *pool);
    if (!pool) return JSL_ERR_MEMORY;
    pool->workers = workers;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->wake, NULL);
    pthread_cond_init(&pool->done, NULL);
    /* Signals belong to the host's threads. */
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    int started = 1;
    for (; started < workers; started++) {
        seat *s = &pool->seats[started];
        s->pool = pool;
        s->worker = started;
        if (pthread_create(&s->thread, NULL, thread_main, s) != 0) break;
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (started < workers) {
        stop_threads(pool, started);
        free_pool(pool, memory);
        return JSL_ERR_UNSUPPORTED;
    }
    *out = pool;
    return JSL_OK;
}

void jsl_pool_destroy(jsl_pool *pool, jsl_memory *memory) {
    if (!pool) return;
    stop_threads(pool, pool->workers);
    free_pool(pool, memory);
}
