/* SPDX-License-Identifier: MIT
 * jostle/world.h - the world: settings, the step, what it reports, and the state as a whole.
 *
 *   jsl_world *world;
 *   jsl_world_create(&(jsl_world_desc){.gravity = {0, 0, JSL_R(-9.81)}}, &world);
 *   ...
 *   jsl_step(world, 0, NULL);
 *   jsl_world_destroy(world);
 *
 * A zeroed desc is valid. A world may be used by one thread at a time; different worlds are
 * independent. Floor 5.
 */
#ifndef JOSTLE_WORLD_H
#define JOSTLE_WORLD_H

#include <jostle/components.h>
#include <jostle/ecs.h>
#include <jostle/shape.h>
#include <jostle/wind.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The world is chosen by precision at link time: a program compiled for one and linked with the
 * other does not link. */
#ifdef JSL_DOUBLE
#define jsl_world_create jsl_world_create_f64
#else
#define jsl_world_create jsl_world_create_f32
#endif

typedef struct jsl_world jsl_world;

typedef struct jsl_world_desc {
    jsl_allocator allocator;
    jsl_logger logger;
    jsl_tasks tasks; /* the host's job system; zeroed: our own threads, see workers */
    int workers; /* threads of our own pool, the caller included; 0 or 1: none. Results never depend
                    on it */
    jsl_isa isa; /* results never depend on it */
    uint32_t tag; /* see jsl_ecs_desc */
    uint64_t seed;
    jsl_real dt;      /* s, default step; 0: 1/60 */
    int substeps;     /* 0: 4 */
    jsl_vec3 gravity; /* m/s^2; zero is zero */
    jsl_wind wind;
} jsl_world_desc;

JSL_API jsl_result jsl_world_create(const jsl_world_desc *desc, jsl_world **out);
JSL_API void jsl_world_destroy(jsl_world *world); /* null is allowed */

/* Its entities, for queries, components and systems of your own. */
JSL_API jsl_ecs *jsl_world_ecs(jsl_world *world);

/* -- Shapes and materials
 * ---------------------------------------------------------------------------- */

/* Equal shapes are stored once and share a handle. */
typedef struct jsl_material_desc {
    jsl_real friction;    /* Coulomb's coefficient, >= 0; pairs use sqrt(a b) */
    jsl_real restitution; /* 0..1; pairs use the larger */
} jsl_material_desc;

JSL_API jsl_result jsl_shape_create(jsl_world *world, const jsl_shape_desc *desc, jsl_shape *out);
JSL_API jsl_result jsl_shape_get(const jsl_world *world, jsl_shape shape, jsl_shape_desc *out);
JSL_API int jsl_shape_count(const jsl_world *world); /* handles are 1..count */
/* Material 0 (null) is friction 0.6, restitution 0. */
JSL_API jsl_result jsl_material_create(jsl_world *world, const jsl_material_desc *desc,
                                       jsl_material *out);
JSL_API jsl_result jsl_material_get(const jsl_world *world, jsl_material material,
                                    jsl_material_desc *out);

/* -- What it can hold
 * ------------------------------------------------------------------------------------ */

/* Each kind of thing is made ready by the first call that needs it; a program links and a world
 * pays for what it uses. Before jsl_world_restore into a new world, name the kinds that the image
 * holds. */
JSL_API jsl_result jsl_world_use_particles(jsl_world *world);
JSL_API jsl_result jsl_world_use_flocks(jsl_world *world);
JSL_API jsl_result jsl_world_use_bodies(jsl_world *world);

/* Gives entities a colour (0xRRGGBBAA), the component `look`. */
JSL_API jsl_result jsl_look_set_n(jsl_world *world, const jsl_entity *entity, int64_t count,
                                  uint32_t rgba);

/* -- The step
 * ---------------------------------------------------------------------------------------------- */

/* Advances by dt seconds (0: the world's default; to refresh contacts without moving anything use
 * jsl_refresh). JSL_ERR_ARGUMENT for a negative, JSL_ERR_NOT_FINITE for a non-finite dt: nothing
 * changed. *warnings (may be null) gets this step's. */
JSL_API jsl_result jsl_step(jsl_world *world, jsl_real dt, jsl_warnings *warnings);
/* A step of no duration. */
JSL_API jsl_result jsl_refresh(jsl_world *world);

JSL_API double
jsl_world_time(const jsl_world *world); /* s, exact multiple of dt while dt is constant */
JSL_API int64_t
jsl_world_time_ns(const jsl_world *world); /* ns, integer: never accumulates rounding */
JSL_API uint64_t jsl_world_step_count(const jsl_world *world);
/* The settings in force: the desc with its defaults filled in. */
JSL_API const jsl_world_desc *jsl_world_settings(const jsl_world *world);
/* Where its messages go from now on; null: nowhere. */
JSL_API void jsl_world_set_logger(jsl_world *world, const jsl_logger *logger);
JSL_API jsl_result jsl_world_set_gravity(jsl_world *world, jsl_vec3 gravity);
JSL_API jsl_result jsl_world_set_wind(jsl_world *world, const jsl_wind *wind);
JSL_API jsl_result jsl_world_set_dt(jsl_world *world, jsl_real dt);
JSL_API jsl_result jsl_world_set_substeps(jsl_world *world, int substeps);

/* Everything is computed in double, in a fixed order. */
typedef struct jsl_diagnostics {
    int64_t particles, boids, bodies, statics, contacts, pairs;
    double kinetic_energy, potential_energy; /* J, of bodies */
    double momentum[3];                      /* kg m/s, of bodies */
    double angular_momentum[3];              /* kg m^2/s about the world's origin, of bodies */
    double centre_of_mass[3];                /* m, of bodies */
    double max_speed;                        /* m/s, of bodies */
    double max_penetration;                  /* m */
    int64_t not_finite;                      /* entities frozen this step */
    jsl_warnings warnings;                   /* since creation */
} jsl_diagnostics;
JSL_API jsl_result jsl_world_diagnostics(jsl_world *world, jsl_diagnostics *out);

typedef struct jsl_profile {
    double seconds[JSL_STAGE_COUNT]; /* wall time since creation */
    double total;                    /* s */
    uint64_t steps;
    uint64_t entered[JSL_STAGE_COUNT]; /* steps in which the stage had work */
    int64_t memory_bytes, memory_peak_bytes;
    int64_t allocations; /* so far; its growth over a step is that step's */
} jsl_profile;
JSL_API void jsl_world_profile(const jsl_world *world, jsl_profile *out);

/* -- The state as a whole
 * -------------------------------------------------------------------------------------- */

/* Hash of everything that decides the future; the same for every worker count, ISA level and
 * history of idle things. */
JSL_API uint64_t jsl_world_hash(jsl_world *world);

/* A self-contained image: entities, shapes, materials, settings, clocks, warm starts. *bytes is
 * allocated by the world; give it back with jsl_world_free_bytes. */
JSL_API jsl_result jsl_world_save(jsl_world *world, void **bytes, size_t *size);
JSL_API void jsl_world_free_bytes(jsl_world *world, void *bytes, size_t size);
/* Makes the world what it was when the image was saved. On failure nothing has changed. */
JSL_API jsl_result jsl_world_restore(jsl_world *world, const void *bytes, size_t size);
/* The same to and from a file. A file that cannot be written completely is not left behind:
 * JSL_ERR_IO. */
JSL_API jsl_result jsl_world_save_file(jsl_world *world, const char *path);
JSL_API jsl_result jsl_world_restore_file(jsl_world *world, const char *path);
/* A second world that goes on like the first: state and settings; its own entities, with the same
 * ids. Components and systems that the caller registered are not copied (a system's user pointer
 * belongs to one world): JSL_ERR_VERSION names a component that is missing, unless `prepare` (may
 * be null) registers it in the new world. */
typedef jsl_result jsl_prepare_fn(jsl_world *clone, void *arg);
JSL_API jsl_result jsl_world_clone(jsl_world *world, jsl_prepare_fn *prepare, void *arg,
                                   jsl_world **out);
/* JSL_ERR_STATE when an invariant is broken; the report says which. */
JSL_API jsl_result jsl_world_validate(jsl_world *world, jsl_ecs_report *report);

#ifdef __cplusplus
}
#endif
#endif
