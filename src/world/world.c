/* SPDX-License-Identifier: MIT
 * The world: creation, settings, clocks and accounts.
 */
#include "world/world_internal.h"

#define DEFAULT_DT (1.0 / 60.0)
#define MAX_SUBSTEPS 1024

JSL_COMPONENT_FIELDS(position, JSL_POSITION_FIELDS);
JSL_COMPONENT_FIELDS(orientation, JSL_ORIENTATION_FIELDS);
JSL_COMPONENT_FIELDS(velocity, JSL_VELOCITY_FIELDS);
JSL_COMPONENT_FIELDS(spin, JSL_SPIN_FIELDS);
JSL_COMPONENT_FIELDS(mass, JSL_MASS_FIELDS);
JSL_COMPONENT_FIELDS(collider, JSL_COLLIDER_FIELDS);

static jsl_result check_wind(const jsl_logger *logger, const jsl_wind *wind) {
    if (!jsl_v3_is_finite(wind->velocity) || !jsl_v3_is_finite(wind->gust_direction) ||
        !jsl_is_finite(wind->gust) || !jsl_is_finite(wind->gust_period))
        return jsl_fail(logger, JSL_ERR_NOT_FINITE, "wind: a number is not finite");
    if (wind->gust < 0 || wind->gust_period < 0)
        return jsl_fail(logger, JSL_ERR_ARGUMENT, "wind: gust and gust_period must be >= 0");
    return JSL_OK;
}

static jsl_result check_dt(const jsl_logger *logger, jsl_real dt) {
    if (!jsl_is_finite(dt)) return jsl_fail(logger, JSL_ERR_NOT_FINITE, "dt is not finite");
    if (dt < 0)
        return jsl_fail(logger, JSL_ERR_ARGUMENT, "dt is %g s: it must not be negative",
                        (double)dt);
    return JSL_OK;
}

static jsl_result check_desc(const jsl_world_desc *desc) {
    const jsl_logger *log = &desc->logger;
    if (!jsl_v3_is_finite(desc->gravity))
        return jsl_fail(log, JSL_ERR_NOT_FINITE, "world: gravity is not finite");
    JSL_TRY(check_dt(log, desc->dt));
    JSL_TRY(check_wind(log, &desc->wind));
    if (desc->substeps < 0 || desc->substeps > MAX_SUBSTEPS)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "world: substeps is %d: 0..%d", desc->substeps,
                        MAX_SUBSTEPS);
    if (desc->workers < 0 || desc->workers > JSL_MAX_WORKERS)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "world: workers is %d: 0..%d", desc->workers,
                        JSL_MAX_WORKERS);
    if ((unsigned)desc->isa >= JSL_ISA_COUNT)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "world: isa is %d", (int)desc->isa);
    return JSL_OK;
}

static jsl_result register_shared(jsl_world *w) {
#define SHARED(name)                                                                               \
    JSL_TRY(jsl_component_register(                                                                \
        w->ecs, &(jsl_component_desc){#name, name##_fields, JSL_COUNT(name##_fields), false},      \
        &w->name))
    SHARED(position);
    SHARED(orientation);
    SHARED(velocity);
    SHARED(spin);
    SHARED(mass);
    SHARED(collider);
#undef SHARED
    return jsl_query_create(w->ecs,
                            &(jsl_query_desc){{{w->position, JSL_READ},
                                               {w->collider, JSL_READ},
                                               {w->orientation, JSL_READ_IF},
                                               {w->velocity, JSL_READ_IF},
                                               {w->spin, JSL_READ_IF},
                                               {w->mass, JSL_READ_IF}}},
                            &w->solid);
}

jsl_result jsl_world_create(const jsl_world_desc *desc, jsl_world **out) {
    static const jsl_world_desc all_defaults = {0};
    if (!out) return JSL_ERR_ARGUMENT;
    *out = NULL;
    if (!desc) desc = &all_defaults;
    JSL_TRY(check_desc(desc));
    jsl_ecs *ecs;
    JSL_TRY(jsl_ecs_create(&(jsl_ecs_desc){desc->allocator, desc->logger, desc->tag}, &ecs));
    jsl_memory *memory = jsl_ecs_memory(ecs);
    jsl_world *w = jsl_alloc_zero(memory, sizeof *w);
    if (!w) {
        jsl_ecs_destroy(ecs);
        return jsl_fail(&desc->logger, JSL_ERR_MEMORY, "world: out of memory");
    }
    w->settings = *desc;
    w->settings.dt = desc->dt > 0 ? desc->dt : JSL_R(DEFAULT_DT);
    w->settings.substeps = desc->substeps > 0 ? desc->substeps : 4;
    w->settings.workers = desc->workers > 0 ? desc->workers : 1;
    w->clock.dt = (double)w->settings.dt;
    w->ecs = ecs;
    w->memory = memory;
    w->isa = w->settings.isa = jsl_isa_resolve(desc->isa);
    jsl_arena_init(&w->arena, memory);
    jsl_result result = jsl_exec_init(&w->exec, memory, desc->tasks, w->settings.workers);
    if (result == JSL_OK) {
        w->settings.workers = w->exec.tasks.workers;
        result = register_shared(w);
    }
    if (result != JSL_OK) {
        jsl_world_destroy(w);
        return result;
    }
    *out = w;
    return JSL_OK;
}

void jsl_world_destroy(jsl_world *w) {
    if (!w) return;
    for (int i = 0; i < JSL_ROOM_COUNT; i++)
        if (w->room[i]) w->hooks[i]->destroy(w->room[i]);
    jsl_collider_set_free(w->memory, &w->colliders);
    jsl_array_free(w->memory, &w->shape);
    jsl_array_free(w->memory, &w->material);
    jsl_exec_fini(&w->exec, w->memory);
    jsl_arena_fini(&w->arena);
    jsl_ecs *ecs = w->ecs;
    jsl_free(w->memory, w, sizeof *w);
    jsl_ecs_destroy(ecs);
}

jsl_ecs *jsl_world_ecs(jsl_world *world) { return world ? world->ecs : NULL; }

void jsl_room_attach(jsl_world *world, jsl_room_slot slot, void *room,
                     const jsl_room_hooks *hooks) {
    JSL_ASSERT(!world->room[slot]);
    world->room[slot] = room;
    world->hooks[slot] = hooks;
}

jsl_result jsl_world_bad_argument(const jsl_world *world, const char *function, const char *what) {
    return jsl_fail(world ? &world->settings.logger : NULL, JSL_ERR_ARGUMENT, "%s: %s", function,
                    what);
}

/* -- Settings
 * --------------------------------------------------------------------------------------- */

const jsl_world_desc *jsl_world_settings(const jsl_world *world) {
    return world ? &world->settings : NULL;
}

void jsl_world_set_logger(jsl_world *w, const jsl_logger *logger) {
    if (!w) return;
    w->settings.logger = logger ? *logger : (jsl_logger){0};
    jsl_ecs_set_logger(w->ecs, logger);
}

jsl_result jsl_world_set_gravity(jsl_world *w, jsl_vec3 gravity) {
    if (!w) return JSL_ERR_ARGUMENT;
    if (!jsl_v3_is_finite(gravity))
        return jsl_fail(&w->settings.logger, JSL_ERR_NOT_FINITE, "gravity is not finite");
    w->settings.gravity = gravity;
    return JSL_OK;
}

jsl_result jsl_world_set_wind(jsl_world *w, const jsl_wind *wind) {
    if (!w || !wind) return JSL_ERR_ARGUMENT;
    JSL_TRY(check_wind(&w->settings.logger, wind));
    w->settings.wind = *wind;
    return JSL_OK;
}

jsl_result jsl_world_set_dt(jsl_world *w, jsl_real dt) {
    if (!w) return JSL_ERR_ARGUMENT;
    JSL_TRY(check_dt(&w->settings.logger, dt));
    w->settings.dt = dt > 0 ? dt : JSL_R(DEFAULT_DT);
    return JSL_OK;
}

jsl_result jsl_world_set_substeps(jsl_world *w, int substeps) {
    if (!w) return JSL_ERR_ARGUMENT;
    if (substeps < 1 || substeps > MAX_SUBSTEPS)
        return jsl_fail(&w->settings.logger, JSL_ERR_ARGUMENT, "substeps is %d: 1..%d", substeps,
                        MAX_SUBSTEPS);
    w->settings.substeps = substeps;
    return JSL_OK;
}

/* -- Clocks and accounts
 * ------------------------------------------------------------------------------ */

double jsl_world_time(const jsl_world *w) {
    return w ? 1e-9 * (double)w->clock.epoch_ns + (double)w->clock.steps * w->clock.dt : 0;
}

int64_t jsl_world_time_ns(const jsl_world *w) {
    return w ? w->clock.epoch_ns + llround((double)w->clock.steps * w->clock.dt * 1e9) : 0;
}

uint64_t jsl_world_step_count(const jsl_world *w) { return w ? w->step : 0; }

void jsl_world_profile(const jsl_world *w, jsl_profile *out) {
    *out = (jsl_profile){0};
    if (!w) return;
    *out = w->profile;
    out->memory_bytes = w->memory->live_bytes;
    out->memory_peak_bytes = w->memory->peak_bytes;
    out->allocations = w->memory->calls;
}

jsl_result jsl_world_diagnostics(jsl_world *w, jsl_diagnostics *out) {
    if (!w || !out) return JSL_ERR_ARGUMENT;
    *out = (jsl_diagnostics){0};
    for (int i = 0; i < JSL_ROOM_COUNT; i++)
        if (w->room[i] && w->hooks[i]->measure) w->hooks[i]->measure(w->room[i], w, out);
    out->warnings = w->warnings;
    return JSL_OK;
}

jsl_result jsl_world_validate(jsl_world *w, jsl_ecs_report *report) {
    if (!w || !report) return JSL_ERR_ARGUMENT;
    return jsl_ecs_validate(w->ecs, report);
}
