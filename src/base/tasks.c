/* SPDX-License-Identifier: MIT
 * tasks.c - parallel loops over fixed blocks, on the host's tasks, our pool, or the calling thread.
 */
#include "base/base.h"
#include "base/pool.h"

#include <sched.h>
#include <time.h>

jsl_result jsl_exec_init(jsl_exec *exec, jsl_memory *memory, jsl_tasks hooks, int workers) {
    if (!hooks.enqueue != !hooks.finish) return JSL_ERR_ARGUMENT;
    bool hosted = hooks.enqueue != NULL;
    if (hosted && hooks.workers > 0) workers = hooks.workers;
    if (workers < 1) workers = 1;
    if (workers > JSL_MAX_WORKERS) return JSL_ERR_LIMIT;
    jsl_pool *pool = NULL;
    if (!hosted && workers > 1) JSL_TRY(jsl_pool_create(memory, workers, &pool));
    hooks.workers = workers;
    *exec = (jsl_exec){hooks, pool};
    return JSL_OK;
}

void jsl_exec_fini(jsl_exec *exec, jsl_memory *memory) {
    jsl_pool_destroy(exec->pool, memory);
    *exec = (jsl_exec){.tasks.workers = 1};
}

typedef struct loop {
    jsl_block_fn *fn;
    void *arg;
    int64_t count, block_size, blocks;
    int64_t next; /* accessed atomically: the first block that nobody has claimed */
} loop;

static void run_block(const loop *l, int64_t block, int worker) {
    int64_t begin = block * l->block_size;
    int64_t end = l->count - begin < l->block_size ? l->count : begin + l->block_size;
    l->fn(l->arg, begin, end, block, worker);
}

static void loop_worker(void *arg, int worker, int workers) {
    (void)workers;
    loop *l = arg;
    for (;;) {
        int64_t block = __atomic_fetch_add(&l->next, 1, __ATOMIC_RELAXED);
        if (block >= l->blocks) return;
        run_block(l, block, worker);
    }
}

typedef struct host_task {
    loop *loop;
    int worker;
} host_task;

static void host_entry(void *arg) {
    host_task *task = arg;
    loop_worker(task->loop, task->worker, 0);
}

static void run_on_host(const jsl_tasks *host, loop *l) {
    host_task task[JSL_MAX_WORKERS];
    void *handle[JSL_MAX_WORKERS];
    int workers = l->blocks < host->workers ? (int)l->blocks : host->workers;
    for (int i = 1; i < workers; i++) {
        task[i] = (host_task){l, i};
        handle[i] = host->enqueue(host_entry, &task[i], host->ctx);
    }
    loop_worker(l, 0, 0);
    for (int i = 1; i < workers; i++)
        if (handle[i]) host->finish(handle[i], host->ctx);
}

void jsl_parallel_for(const jsl_exec *exec, int64_t count, int64_t block_size, jsl_block_fn *fn,
                      void *arg) {
    JSL_ASSERT(block_size > 0);
    if (count <= 0) return;
    loop l = {fn, arg, count, block_size, (count - 1) / block_size + 1, 0};
    if (exec && exec->tasks.workers > 1 && l.blocks > 1) {
        if (exec->pool)
            jsl_pool_run(exec->pool, loop_worker, &l, false);
        else
            run_on_host(&exec->tasks, &l);
        return;
    }
    for (int64_t block = 0; block < l.blocks; block++) run_block(&l, block, 0);
}

bool jsl_parallel_region(const jsl_exec *exec, jsl_region_fn *fn, void *arg) {
    if (!exec || !exec->pool) {
        fn(arg, 0, 1);
        return false;
    }
    jsl_pool_run(exec->pool, fn, arg, true);
    return true;
}

void jsl_barrier_wait(jsl_barrier *barrier, int workers) {
    int32_t generation = __atomic_load_n(&barrier->generation, __ATOMIC_ACQUIRE);
    if (__atomic_add_fetch(&barrier->arrived, 1, __ATOMIC_ACQ_REL) == workers) {
        __atomic_store_n(&barrier->arrived, 0, __ATOMIC_RELAXED);
        __atomic_store_n(&barrier->generation, (int32_t)((uint32_t)generation + 1),
                         __ATOMIC_RELEASE);
        return;
    }
    /* With fewer cores than workers the one we wait for may need ours. */
    for (int spins = 0; __atomic_load_n(&barrier->generation, __ATOMIC_ACQUIRE) == generation;
         spins++) {
        if (spins < 200)
            jsl_cpu_relax();
        else
            sched_yield();
    }
}

double jsl_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
