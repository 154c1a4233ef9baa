/* SPDX-License-Identifier: MIT
 * A stage for tests of particles: an ECS, the room, a set of colliders by hand, and a step made of
 * the stages that the room uses.
 */
#ifndef JSL_TESTS_PARTICLE_STAGE_H
#define JSL_TESTS_PARTICLE_STAGE_H

#include "helper.h"

#include "ecs/ecs.h"
#include "geometry/geometry.h"
#include "particle/particle.h"
#include <jostle/wind.h>

typedef struct particle_stage {
    test_memory memory;
    test_log log;
    jsl_ecs *ecs;
    jsl_particle_room *room;
    jsl_collider_set set;
    jsl_arena arena;
    jsl_exec exec;
    jsl_wind wind;
    jsl_warnings warnings; /* since creation */
    jsl_step_context context;
    jsl_component position, orientation, velocity, particle;
    jsl_query particles;
} particle_stage;

/* dt 1/60, one sub-step, gravity (0,0,-9.81), no wind, seed 1, the machine's ISA. */
void particle_stage_open(particle_stage *stage, int workers);
void particle_stage_close(particle_stage *stage);
void particle_stage_set_dt(particle_stage *stage, double dt);
/* Adds a collider; what is not said is 0, the pose's orientation identity. Returns its index. */
int64_t particle_stage_collider(particle_stage *stage, jsl_shape_desc shape, jsl_pose pose,
                                jsl_vec3 velocity, jsl_vec3 spin);
/* A ground z = 0. */
void particle_stage_ground(particle_stage *stage);
/* One step; colliders then move by their velocities. */
void particle_stage_step(particle_stage *stage);
/* count particles of an emitter at rest at the origin, size 0.05, with the given life. Rows are
 * those of a query with terms position, velocity, particle. */
void particle_stage_spawn(particle_stage *stage, jsl_emitter emitter, int64_t count, jsl_real life,
                          jsl_rows *rows);
int64_t particle_stage_count(const particle_stage *stage);
/* The only table of particles. */
bool particle_stage_rows(const particle_stage *stage, jsl_rows *rows);
jsl_vec3 particle_position(const jsl_rows *rows, int64_t i);
jsl_vec3 particle_velocity(const jsl_rows *rows, int64_t i);
void particle_put(const jsl_rows *rows, int64_t i, jsl_vec3 position, jsl_vec3 velocity);

#endif
