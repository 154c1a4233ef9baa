/* SPDX-License-Identifier: MIT
 * The in-tree thread pool, for tasks.c.
 */
#ifndef JSL_BASE_POOL_H
#define JSL_BASE_POOL_H

#include "base/base.h"

/* A pool of workers - 1 threads; the caller of jsl_pool_run is worker 0. */
jsl_result jsl_pool_create(jsl_memory *memory, int workers, jsl_pool **out);
void jsl_pool_destroy(jsl_pool *pool, jsl_memory *memory);
/* Runs fn(arg, worker, workers) on the caller and on the threads. all: on every one of them,
 * exactly once. Otherwise a thread that is not awake by the time the caller is done takes no part.
 */
void jsl_pool_run(jsl_pool *pool, jsl_region_fn *fn, void *arg, bool all);

/* Tells the CPU that this is a spin loop. */
static inline void jsl_cpu_relax(void) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

#endif
