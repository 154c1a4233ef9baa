/* SPDX-License-Identifier: MIT
 * What the rooms above may do to tables beyond the public interface. Floor 2.
 */
#ifndef JSL_ECS_ECS_H
#define JSL_ECS_ECS_H

#include "base/base.h"
#include <jostle/ecs.h>

/* The accounts that everything owned by this ECS (and its world) is charged to. */
jsl_memory *jsl_ecs_memory(jsl_ecs *ecs);
const jsl_logger *jsl_ecs_logger(const jsl_ecs *ecs);

/* New row i takes old row from[i]; from is a permutation of [0, rows of the table). Handles keep
 * pointing at their entities. exec may be null. JSL_ERR_MEMORY leaves the order unchanged.
 * Allocates nothing once the table's spare columns exist. */
jsl_result jsl_table_reorder(jsl_ecs *ecs, uint32_t table, const uint32_t *from,
                             const jsl_exec *exec);

/* Destroys the rows of one table with dead[row] != 0 by the table's own removal rule (stable
 * compaction or swap-with-last). Returns their number. */
int64_t jsl_table_destroy_rows(jsl_ecs *ecs, uint32_t table, const uint8_t *dead);

/* A number that grows whenever rows of the table move, come or go (order_rev of the telemetry). */
uint64_t jsl_table_revision(const jsl_ecs *ecs, uint32_t table);

/* Where an entity's row is: table and row. False when the handle is invalid. */
bool jsl_entity_locate(const jsl_ecs *ecs, jsl_entity entity, uint32_t *table, int64_t *row);
/* The live entity in a slot (index as in the handle); null when the slot is free. Undoes
 * jsl_entity_id. */
jsl_entity jsl_entity_at(const jsl_ecs *ecs, uint32_t index);

/* Runs the systems of one stage in order on base->exec, then applies what they deferred. `base` is
 * copied per worker (worker, commands and warnings filled in); warnings are merged into
 * *base->warnings. */
jsl_result jsl_schedule_run(jsl_ecs *ecs, jsl_stage stage, const jsl_step_context *base);
/* True when some system of the stage would run. */
bool jsl_schedule_has_work(const jsl_ecs *ecs, jsl_stage stage);

#endif
