/* SPDX-License-Identifier: MIT
 * The hooks of a host: memory from its own allocator, work on its own threads, messages to its own
 * log. The state is the same with and without them.
 *   cc own_allocator_and_tasks.c $(pkg-config --cflags --libs jostle) -pthread
 */
#include <jostle/jostle.h>

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

/* -- Memory: here malloc's, with accounts. A world allocates from one thread at a time. */
typedef struct accounts {
    long long bytes, peak, blocks;
} accounts;

static void *take(size_t size, size_t align, void *ctx) {
    accounts *a = ctx;
    void *p = aligned_alloc(align, (size + align - 1) / align * align);
    if (!p) return NULL;
    a->blocks++;
    a->bytes += (long long)size;
    if (a->bytes > a->peak) a->peak = a->bytes;
    return p;
}

static void give_back(void *p, size_t size, void *ctx) { /* the size that was asked for */
    accounts *a = ctx;
    a->blocks -= p != NULL;
    a->bytes -= p ? (long long)size : 0;
    free(p);
}

/* -- Tasks: here a thread each; a game would put them into its job system. */
typedef struct job {
    pthread_t thread;
    jsl_task_fn *fn;
    void *arg;
} job;

static void *run_job(void *p) {
    ((job *)p)->fn(((job *)p)->arg);
    return NULL;
}

static void *enqueue(jsl_task_fn *fn, void *arg, void *ctx) {
    job *j = malloc(sizeof *j);
    if (j) *j = (job){.fn = fn, .arg = arg};
    if (j && pthread_create(&j->thread, NULL, run_job, j) == 0) {
        ++*(long long *)ctx;
        return j;
    }
    free(j);
    fn(arg); /* ran inline */
    return NULL;
}

static void finish(void *handle, void *ctx) {
    job *j = handle;
    (void)ctx;
    pthread_join(j->thread, NULL);
    free(j);
}

/* -- Messages */
static void say(jsl_log_level level, jsl_result code, const char *text, void *ctx) {
    (void)level;
    (void)ctx;
    fprintf(stderr, "jostle: %s (%s)\n", text, jsl_result_text(code));
}

/* A fountain of 20 000 specks a second for one second; the hash of the state at its end. */
static uint64_t fountain(const jsl_world_desc *desc) {
    jsl_world *world;
    jsl_emitter source;
    uint64_t hash = 0;
    if (jsl_world_create(desc, &world) != JSL_OK) return 0;
    jsl_emitter_desc d = {.rate = 20000, .speed = 8, .cone = 1, .life = 2};
    bool good = jsl_emitter_create(world, &d, &source) == JSL_OK;
    for (int i = 0; good && i < 60; i++) good = jsl_step(world, 0, NULL) == JSL_OK;
    if (good) hash = jsl_world_hash(world);
    jsl_world_destroy(world);
    return hash;
}

int main(void) {
    accounts a = {0};
    long long jobs = 0;
    jsl_world_desc plain = {.gravity = {0, 0, JSL_R(-9.81)}, .seed = 7}, hosted = plain;
    hosted.allocator = (jsl_allocator){take, give_back, &a};
    hosted.tasks = (jsl_tasks){enqueue, finish, &jobs, 4}; /* 4: threads at once, ours included */
    hosted.logger = (jsl_logger){say, NULL};
    uint64_t one = fountain(&plain), two = fountain(&hosted);
    printf("host's memory: %.1f MB at most, %lld blocks left; host's threads: %lld jobs\n",
           1e-6 * (double)a.peak, a.blocks, jobs);
    printf("%s\n", one == two && one ? "equal hashes" : "HASHES DIFFER");
    return one == two && one && !a.blocks && !a.bytes && jobs ? 0 : 1;
}
