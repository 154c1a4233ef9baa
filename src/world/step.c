/* SPDX-License-Identifier: MIT
 * THE step.
 */
#include "world/world_internal.h"

static jsl_step_context make_context(jsl_world *w, jsl_real dt, jsl_warnings *warnings) {
    bool still = jsl_length_sq(w->settings.wind.velocity) == 0 && w->settings.wind.gust == 0;
    return (jsl_step_context){
        .dt = dt,
        .inv_dt = dt > 0 ? 1 / dt : 0,
        .substeps = w->settings.substeps,
        .step = w->step,
        .time = jsl_world_time(w),
        .seed = w->settings.seed,
        .gravity = w->settings.gravity,
        .workers = w->exec.tasks.workers,
        .isa = w->isa,
        .logger = &w->settings.logger,
        .ecs = w->ecs,
        .warnings = warnings,
        .exec = &w->exec,
        .memory = w->memory,
        .arena = &w->arena,
        .wind = still ? NULL : &w->settings.wind,
    };
}

/* A stage without work is not entered: it touches nothing and is not counted. */
static jsl_result run_stage(jsl_world *w, jsl_stage stage, const jsl_step_context *context) {
    if (!jsl_schedule_has_work(w->ecs, stage)) return JSL_OK;
    double start = jsl_seconds();
    jsl_result result = jsl_schedule_run(w->ecs, stage, context);
    jsl_arena_reset(&w->arena);
    w->profile.seconds[stage] += jsl_seconds() - start;
    w->profile.entered[stage]++;
    return result;
}

static void advance_clock(jsl_world *w, jsl_real dt) {
    if ((double)dt != w->clock.dt) {
        w->clock = (jsl_clock){jsl_world_time_ns(w), 0, (double)dt};
    }
    w->clock.steps++;
    w->step++;
}

static void merge_warnings(jsl_warnings *total, const jsl_warnings *step) {
    for (int i = 0; i < JSL_WARN_COUNT; i++) {
        if (total->count[i] == 0) total->first[i] = step->first[i];
        total->count[i] += step->count[i];
    }
}

static jsl_result step_by(jsl_world *w, jsl_real dt, jsl_warnings *warnings) {
    if (w->stepping)
        return jsl_fail(&w->settings.logger, JSL_ERR_STATE, "jsl_step inside jsl_step");
    double start = jsl_seconds();
    jsl_warnings own = {0};
    jsl_step_context context = make_context(w, dt, &own);
    w->stepping = true;

    jsl_result result = JSL_OK;
    for (int stage = 0; stage < JSL_STAGE_COUNT && result == JSL_OK; stage++) {
        /* What is solid is indexed once, where the INDEX stage begins; later stages read it. */
        if (stage == JSL_STAGE_INDEX && jsl_query_count(w->ecs, w->solid) > 0) {
            result = jsl_world_index_colliders(w, dt);
            if (result != JSL_OK) break;
            context.colliders = &w->colliders;
        }
        result = run_stage(w, (jsl_stage)stage, &context);
    }

    w->stepping = false;
    advance_clock(w, dt);
    merge_warnings(&w->warnings, &own);
    w->profile.steps++;
    w->profile.total += jsl_seconds() - start;
    if (warnings) *warnings = own;
    return result;
}

jsl_result jsl_step(jsl_world *w, jsl_real dt, jsl_warnings *warnings) {
    if (!w) return JSL_ERR_ARGUMENT;
    if (!jsl_is_finite(dt))
        return jsl_fail(&w->settings.logger, JSL_ERR_NOT_FINITE, "jsl_step: dt is not finite");
    if (dt < 0)
        return jsl_fail(&w->settings.logger, JSL_ERR_ARGUMENT,
                        "jsl_step: dt is %g s: it must not be negative", (double)dt);
    return step_by(w, dt > 0 ? dt : w->settings.dt, warnings);
}

jsl_result jsl_refresh(jsl_world *w) {
    if (!w) return JSL_ERR_ARGUMENT;
    jsl_clock clock = w->clock;
    uint64_t step = w->step;
    jsl_result result = step_by(w, 0, NULL);
    w->clock = clock; /* no time has passed */
    w->step = step;
    return result;
}
