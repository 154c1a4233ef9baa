/* SPDX-License-Identifier: MIT
 * A stage for tests of flocks: an ECS, the room, obstacles placed by hand, and steps.
 */
#ifndef JSL_TESTS_FLOCK_STAGE_H
#define JSL_TESTS_FLOCK_STAGE_H

#include "flock/flock.h"
#include "geometry/geometry.h"
#include "helper.h"

typedef struct flock_stage {
    test_memory heap;
    test_log log;
    jsl_ecs *ecs;
    jsl_flock_room *room;
    jsl_memory memory; /* of the arena, the workers and the obstacles */
    jsl_exec exec;
    jsl_arena arena;
    jsl_collider_set set;
    jsl_warnings warnings;
    jsl_step_context context;
} flock_stage;

void flock_stage_open(flock_stage *stage, int workers, jsl_isa isa);
void flock_stage_close(flock_stage *stage);
void flock_stage_step(flock_stage *stage, jsl_real dt);
/* INDEX and DECIDE alone: accelerations are decided, nothing moves. */
void flock_stage_decide(flock_stage *stage, jsl_real dt);

jsl_flock flock_stage_flock(flock_stage *stage, const jsl_flock_desc *desc);
jsl_entity flock_stage_boid(flock_stage *stage, jsl_flock flock, jsl_vec3 at, jsl_vec3 velocity);
void flock_stage_obstacle(flock_stage *stage, jsl_shape_desc shape, jsl_pose pose,
                          jsl_vec3 velocity);

typedef struct boid_state {
    jsl_vec3 p, v, a;
    uint32_t neighbours;
} boid_state;
boid_state flock_stage_see(flock_stage *stage, jsl_entity boid);

#endif
