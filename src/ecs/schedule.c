/* SPDX-License-Identifier: MIT
 * Running a stage: its systems one after the other, each over fixed blocks of rows on all workers.
 * Floor 2.
 */
#include "ecs/store.h"

/* Workers keep their contexts and command buffers between steps; only a larger team allocates. */
static jsl_result reserve_workers(jsl_ecs *ecs, int count) {
    if (count <= ecs->worker_count) return JSL_OK;
    size_t old = (size_t)ecs->worker_count * sizeof(jsl_worker);
    size_t size = (size_t)count * sizeof(jsl_worker);
    jsl_worker *worker = jsl_alloc_zero(&ecs->memory, size);
    if (!worker) return jsl_fail(&ecs->logger, JSL_ERR_MEMORY, "no memory for %d workers", count);
    if (old) memcpy(worker, ecs->worker, old);
    jsl_free(&ecs->memory, ecs->worker, old);
    ecs->worker = worker;
    ecs->worker_count = count;
    return JSL_OK;
}

static void prepare_workers(jsl_ecs *ecs, const jsl_step_context *base, int workers) {
    for (int w = 0; w < workers; w++) {
        jsl_worker *worker = &ecs->worker[w];
        memset(&worker->warnings, 0, sizeof worker->warnings);
        worker->commands.ecs = ecs;
        worker->context = *base;
        worker->context.worker = w;
        worker->context.workers = workers;
        worker->context.block = 0;
        worker->context.ecs = ecs;
        worker->context.commands = &worker->commands;
        worker->context.warnings = &worker->warnings;
    }
}

/* -- Row systems -------------------------------------------------------------- */

typedef struct rows_job {
    jsl_ecs *ecs;
    const jsl_system *system;
    const jsl_query_plan *plan;
    int index;
} rows_job;

/* The table in which a block lies: that of the last block or the next, else by halving. */
static int64_t find_match(const jsl_query_plan *plan, int64_t block, int64_t hint) {
    int64_t lo = 0, hi = plan->match.count;
    if (hint < hi && plan->match.at[hint].first_block <= block) lo = hint;
    if (lo + 1 < hi && plan->match.at[lo + 1].first_block > block) return lo;
    while (hi - lo > 1) {
        int64_t mid = lo + (hi - lo) / 2;
        if (plan->match.at[mid].first_block <= block)
            lo = mid;
        else
            hi = mid;
    }
    return lo;
}

static void run_blocks(void *arg, int64_t begin, int64_t end, int64_t unused, int worker_index) {
    const rows_job *job = arg;
    jsl_worker *worker = &job->ecs->worker[worker_index];
    jsl_rows rows;
    (void)unused;
    for (int64_t b = begin; b < end; b++) {
        worker->match = find_match(job->plan, b, worker->match);
        const jsl_match *m = &job->plan->match.at[worker->match];
        int64_t row = (b - m->first_block) * job->system->block;
        int64_t n = m->table->count - row;
        if (n > job->system->block) n = job->system->block;
        jsl_query_view(job->plan, m, row, n, &rows);
        worker->context.block = b;
        jsl_commands_begin(&worker->commands, job->index, b);
        job->system->run_rows(&worker->context, &rows, job->system->user);
    }
}

/* Numbers the blocks over all tables of the query in their order. An empty table gets none: it
 * shares its number with the table after it, and find_match takes the last of equals. */
static int64_t number_blocks(jsl_query_plan *plan, int64_t block_rows) {
    int64_t blocks = 0;
    for (int64_t i = 0; i < plan->match.count; i++) {
        plan->match.at[i].first_block = blocks;
        blocks += (plan->match.at[i].table->count + block_rows - 1) / block_rows;
    }
    return blocks;
}

static void run_rows(jsl_ecs *ecs, jsl_system *system, int index, const jsl_step_context *base,
                     int workers) {
    jsl_query_plan *plan = ecs->query.at[system->query];
    rows_job job = {ecs, system, plan, index};
    int64_t blocks = number_blocks(plan, system->block);
    for (int w = 0; w < workers; w++) {
        jsl_worker *worker = &ecs->worker[w];
        worker->match = 0;
        worker->context.exec = NULL; /* these three are for whole systems only */
        worker->context.memory = NULL;
        worker->context.arena = NULL;
    }
    ecs->busy = true;
    jsl_parallel_for(base->exec, blocks, 1, run_blocks, &job);
    ecs->busy = false;
    system->calls += (uint64_t)blocks;
}

/* -- Stages ------------------------------------------------------------------- */

static uint64_t declared_bytes(const jsl_ecs *ecs, const jsl_system *system) {
    const jsl_query_plan *plan = ecs->query.at[system->query];
    uint64_t bytes = 0;
    for (int64_t i = 0; i < plan->match.count; i++) {
        const jsl_table *table = plan->match.at[i].table;
        uint64_t row = 0;
        for (int t = 0; t < plan->term_count && table->count; t++)
            if (plan->desc.terms[t].access != JSL_WITHOUT &&
                table->first[plan->component[t]] != JSL_NO_COLUMN)
                row += (uint64_t)ecs->component[plan->component[t]].row_bytes;
        bytes += row * (uint64_t)table->count;
    }
    return bytes;
}

static jsl_result run_system(jsl_ecs *ecs, jsl_system *system, int index,
                             const jsl_step_context *base, int workers) {
    double start = jsl_seconds();
    jsl_result r = JSL_OK;
    system->bytes += declared_bytes(ecs, system);
    system->runs++;
    if (system->run_rows) {
        run_rows(ecs, system, index, base, workers);
    } else {
        jsl_worker *worker = &ecs->worker[0];
        worker->context.exec = base->exec;
        worker->context.memory = base->memory;
        worker->context.arena = base->arena;
        worker->context.block = 0;
        jsl_commands_begin(&worker->commands, index, 0);
        r = system->run_whole(&worker->context, system->user);
        system->calls++;
    }
    system->seconds += jsl_seconds() - start;
    return r;
}

static void merge_warnings(jsl_ecs *ecs, int workers, jsl_warnings *to) {
    jsl_step_context context = {.warnings = to};
    for (int w = 0; to && w < workers; w++) {
        const jsl_warnings *from = &ecs->worker[w].warnings;
        for (int i = 0; i < JSL_WARN_COUNT; i++)
            jsl_warn(&context, (jsl_warning)i, from->count[i], from->first[i]);
    }
}

bool jsl_schedule_has_work(const jsl_ecs *ecs, jsl_stage stage) {
    for (int64_t i = 0; i < ecs->system.count; i++)
        if (ecs->system.at[i]->stage == stage && !jsl_system_is_idle(ecs, ecs->system.at[i]))
            return true;
    return false;
}

jsl_result jsl_schedule_run(jsl_ecs *ecs, jsl_stage stage, const jsl_step_context *base) {
    if (!ecs || !base) return JSL_ERR_ARGUMENT;
    if (ecs->in_stage || ecs->busy)
        return jsl_fail(&ecs->logger, JSL_ERR_STATE, "stage %s was run from inside a stage",
                        jsl_stage_text(stage));
    if (!jsl_schedule_has_work(ecs, stage)) return JSL_OK;
    int workers = base->exec && base->exec->tasks.workers > 1 ? base->exec->tasks.workers : 1;
    JSL_TRY(reserve_workers(ecs, workers));
    prepare_workers(ecs, base, workers);
    jsl_arena *arena = base->arena;
    jsl_arena_mark mark = {0};
    if (arena) mark = jsl_arena_save(arena);
    jsl_result r = JSL_OK;
    ecs->in_stage = true;
    for (int64_t i = 0; i < ecs->system.count && r == JSL_OK; i++) {
        jsl_system *system = ecs->system.at[i];
        if (system->stage == stage && !jsl_system_is_idle(ecs, system))
            r = run_system(ecs, system, (int)i, base, workers);
    }
    ecs->in_stage = false;
    jsl_result applied = jsl_commands_apply(ecs, r != JSL_OK);
    merge_warnings(ecs, workers, base->warnings);
    /* An arena that was empty is merged into one block, so that later stages find it warm. */
    if (arena && mark.used == 0)
        jsl_arena_reset(arena);
    else if (arena)
        jsl_arena_rewind(arena, mark);
    return r != JSL_OK ? r : applied;
}
