/* SPDX-License-Identifier: MIT
 * test_tasks.c - parallel loops, regions and barriers, on our pool and on a host's tasks.
 */
#include "base/base.h"
#include "helper.h"

#include <pthread.h>
#include <stdlib.h>
#include <time.h>

typedef struct cover {
    int64_t count, block_size;
    int32_t *hits;                   /* of each index */
    int32_t in_use[JSL_MAX_WORKERS]; /* how many calls run with this worker now */
    int32_t wrong;
    int workers;
} cover;

static void cover_block(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    cover *c = arg;
    bool fine = worker >= 0 && worker < c->workers && begin == block * c->block_size &&
                (end == begin + c->block_size || end == c->count) && begin < end;
    if (!fine) {
        __atomic_add_fetch(&c->wrong, 1, __ATOMIC_RELAXED);
        return;
    }
    if (__atomic_add_fetch(&c->in_use[worker], 1, __ATOMIC_RELAXED) != 1)
        __atomic_add_fetch(&c->wrong, 1, __ATOMIC_RELAXED);
    for (int64_t i = begin; i < end; i++) __atomic_add_fetch(&c->hits[i], 1, __ATOMIC_RELAXED);
    __atomic_sub_fetch(&c->in_use[worker], 1, __ATOMIC_RELAXED);
}

/* 0 when every index was visited exactly once. */
static int64_t run_cover(const jsl_exec *exec, int workers, int64_t count, int64_t block_size) {
    cover c = {.count = count, .block_size = block_size, .workers = workers};
    c.hits = calloc((size_t)count + 1, sizeof *c.hits);
    jsl_parallel_for(exec, count, block_size, cover_block, &c);
    int64_t wrong = c.wrong;
    for (int64_t i = 0; i < count; i++) wrong += c.hits[i] != 1;
    free(c.hits);
    return wrong;
}

static void every_block_runs_exactly_once_whatever_the_workers(void **state) {
    (void)state;
    const int workers[] = {1, 2, 3, 8};
    const int64_t counts[] = {0, 1, 15, 16, 17, 1000, 4096, 100003};
    const int64_t sizes[] = {1, 7, 16, 1024, 1000000};
    for (int w = 0; w < JSL_COUNT(workers); w++) {
        jsl_memory memory;
        jsl_exec exec;
        assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
        assert_ok(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, workers[w]));
        assert_int_equal(exec.tasks.workers, workers[w]);
        for (int c = 0; c < JSL_COUNT(counts); c++)
            for (int s = 0; s < JSL_COUNT(sizes); s++)
                assert_i64(run_cover(&exec, workers[w], counts[c], sizes[s]), 0);
        jsl_exec_fini(&exec, &memory);
        assert_i64(memory.live_blocks, 0);
    }
}

static void no_exec_means_serial(void **state) {
    (void)state;
    assert_i64(run_cover(NULL, 1, 1000, 16), 0);
}

static void a_loop_allocates_nothing(void **state) {
    (void)state;
    test_memory test = {0};
    jsl_memory memory;
    jsl_exec exec;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    assert_ok(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, 3));
    int64_t calls = memory.calls;
    for (int i = 0; i < 100; i++) assert_i64(run_cover(&exec, 3, 1000, 16), 0);
    assert_i64(memory.calls, calls);
    jsl_exec_fini(&exec, &memory);
    assert_no_leaks(&test);
}

/* -- A host: one thread a task, or every second task inline ---------------------------- */

typedef struct host_job {
    jsl_task_fn *fn;
    void *arg;
    pthread_t thread;
} host_job;

typedef struct host {
    int enqueued, finished;
} host;

static void *host_main(void *arg) {
    host_job *job = arg;
    job->fn(job->arg);
    return NULL;
}

static void *host_enqueue(jsl_task_fn *fn, void *arg, void *ctx) {
    host *h = ctx;
    if (++h->enqueued % 2 == 0) {
        fn(arg);
        return NULL;
    }
    host_job *job = malloc(sizeof *job);
    *job = (host_job){.fn = fn, .arg = arg};
    if (pthread_create(&job->thread, NULL, host_main, job) != 0) abort();
    return job;
}

static void host_finish(void *handle, void *ctx) {
    host *h = ctx;
    h->finished++;
    pthread_join(((host_job *)handle)->thread, NULL);
    free(handle);
}

static void too_many_workers_and_half_a_host_are_refused(void **state) {
    (void)state;
    test_memory test = {.fail_at = 1};
    jsl_memory memory;
    jsl_exec exec;
    assert_ok(jsl_memory_init(&memory, test_allocator(&test)));
    assert_result(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, JSL_MAX_WORKERS + 1),
                  JSL_ERR_LIMIT);
    assert_result(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, 2), JSL_ERR_MEMORY);
    assert_result(jsl_exec_init(&exec, &memory, (jsl_tasks){.finish = host_finish}, 2),
                  JSL_ERR_ARGUMENT);
    assert_ok(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, -3));
    assert_int_equal(exec.tasks.workers, 1);
    jsl_exec_fini(&exec, &memory);
    assert_no_leaks(&test);
}

static void note_region(void *arg, int worker, int workers) {
    int *seen = arg;
    seen[0] += 1, seen[1] = worker, seen[2] = workers;
}

static void a_host_runs_the_blocks_and_a_region_is_serial_on_it(void **state) {
    (void)state;
    host h = {0};
    jsl_memory memory;
    jsl_exec exec;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    jsl_tasks hooks = {host_enqueue, host_finish, &h, 5};
    assert_ok(jsl_exec_init(&exec, &memory, hooks, 2));
    assert_int_equal(exec.tasks.workers, 5);
    for (int i = 0; i < 20; i++) assert_i64(run_cover(&exec, 5, 5000, 16), 0);
    assert_int_equal(h.enqueued, 80);
    assert_int_equal(h.finished, 40);
    int seen[3] = {0, -1, -1};
    assert_false(jsl_parallel_region(&exec, note_region, seen));
    assert_int_equal(seen[0], 1);
    assert_int_equal(seen[1], 0);
    assert_int_equal(seen[2], 1);
    assert_false(jsl_parallel_region(NULL, note_region, seen));
    jsl_exec_fini(&exec, &memory);
    assert_i64(memory.calls, 0);
}

/* -- Regions and barriers -------------------------------------------------------------- */

enum { ROUNDS = 300 };
typedef struct team {
    jsl_barrier barrier;
    int64_t value[JSL_MAX_WORKERS]; /* plain: the barrier alone makes this safe */
    int32_t wrong, ran[JSL_MAX_WORKERS];
} team;

/* In each round everybody adds up what all wrote in the round before. */
static void team_fn(void *arg, int worker, int workers) {
    team *t = arg;
    __atomic_add_fetch(&t->ran[worker], 1, __ATOMIC_RELAXED);
    for (int64_t round = 0; round < ROUNDS; round++) {
        t->value[worker] = round * 100 + worker;
        jsl_barrier_wait(&t->barrier, workers);
        int64_t sum = 0;
        for (int w = 0; w < workers; w++) sum += t->value[w];
        if (sum != round * 100 * workers + workers * (workers - 1) / 2)
            __atomic_add_fetch(&t->wrong, 1, __ATOMIC_RELAXED);
        jsl_barrier_wait(&t->barrier, workers);
    }
}

static void a_region_runs_all_workers_at_once_and_barriers_order_them(void **state) {
    (void)state;
    const int workers[] = {2, 3, 8};
    for (int w = 0; w < JSL_COUNT(workers); w++) {
        jsl_memory memory;
        jsl_exec exec;
        assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
        assert_ok(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, workers[w]));
        for (int repeat = 0; repeat < 5; repeat++) {
            team t = {0};
            assert_true(jsl_parallel_region(&exec, team_fn, &t));
            assert_int_equal(t.wrong, 0);
            for (int i = 0; i < JSL_MAX_WORKERS; i++) assert_int_equal(t.ran[i], i < workers[w]);
        }
        assert_i64(run_cover(&exec, workers[w], 999, 16), 0);
        jsl_exec_fini(&exec, &memory);
    }
}

static void a_barrier_of_one_does_not_wait(void **state) {
    (void)state;
    jsl_barrier barrier = {0};
    for (int i = 0; i < 10; i++) jsl_barrier_wait(&barrier, 1);
    assert_int_equal(barrier.generation, 10);
}

/* -- Many execs in many threads -------------------------------------------------------- */

static void *own_exec(void *arg) {
    int64_t *wrong = arg;
    for (int repeat = 0; repeat < 5; repeat++) {
        jsl_memory memory;
        jsl_exec exec;
        if (jsl_memory_init(&memory, (jsl_allocator){0}) != JSL_OK ||
            jsl_exec_init(&exec, &memory, (jsl_tasks){0}, 3) != JSL_OK) {
            ++*wrong;
            return NULL;
        }
        for (int i = 0; i < 40; i++) *wrong += run_cover(&exec, 3, 700, 16);
        jsl_exec_fini(&exec, &memory);
    }
    return NULL;
}

static void several_threads_use_execs_of_their_own_at_once(void **state) {
    (void)state;
    pthread_t thread[4];
    int64_t wrong[4] = {0};
    for (int i = 0; i < 4; i++)
        assert_int_equal(pthread_create(&thread[i], NULL, own_exec, &wrong[i]), 0);
    for (int i = 0; i < 4; i++) {
        pthread_join(thread[i], NULL);
        assert_i64(wrong[i], 0);
    }
}

/* Inside a block of one exec another exec runs a loop of its own. */
static void nest_block(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    (void)begin, (void)end, (void)block, (void)worker;
    int64_t wrong = 0;
    own_exec(&wrong);
    __atomic_add_fetch((int64_t *)arg, wrong, __ATOMIC_RELAXED);
}

static void a_loop_may_run_inside_a_block_of_another_exec(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_exec exec;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    assert_ok(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, 2));
    int64_t wrong = 0;
    jsl_parallel_for(&exec, 4, 1, nest_block, &wrong);
    assert_i64(wrong, 0);
    jsl_exec_fini(&exec, &memory);
}

static void parked_threads_wake_again(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_exec exec;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    assert_ok(jsl_exec_init(&exec, &memory, (jsl_tasks){0}, 3));
    for (int i = 0; i < 20; i++) {
        struct timespec pause = {0, 2000000};
        nanosleep(&pause, NULL);
        team t = {0};
        assert_true(jsl_parallel_region(&exec, team_fn, &t));
        assert_int_equal(t.wrong, 0);
    }
    jsl_exec_fini(&exec, &memory);
}

static void the_clock_does_not_go_back(void **state) {
    (void)state;
    double last = jsl_seconds();
    for (int i = 0; i < 1000; i++) {
        double now = jsl_seconds();
        assert_true(now >= last);
        last = now;
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_block_runs_exactly_once_whatever_the_workers),
        cmocka_unit_test(no_exec_means_serial),
        cmocka_unit_test(a_loop_allocates_nothing),
        cmocka_unit_test(too_many_workers_and_half_a_host_are_refused),
        cmocka_unit_test(a_host_runs_the_blocks_and_a_region_is_serial_on_it),
        cmocka_unit_test(a_region_runs_all_workers_at_once_and_barriers_order_them),
        cmocka_unit_test(a_barrier_of_one_does_not_wait),
        cmocka_unit_test(several_threads_use_execs_of_their_own_at_once),
        cmocka_unit_test(a_loop_may_run_inside_a_block_of_another_exec),
        cmocka_unit_test(parked_threads_wake_again),
        cmocka_unit_test(the_clock_does_not_go_back),
    };
    return cmocka_run_group_tests_name("tasks", tests, NULL, NULL);
}
