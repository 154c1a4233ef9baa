/* SPDX-License-Identifier: MIT
 * The hash of the state: a sum over entities, so that neither the order of rows nor that of tables
 * matters. Floor 2.
 */
#include "ecs/store.h"

#include "ecs/hash_kernel.h"

/* More columns than this are hashed as a second sum with its own key, so that the list of steps
 * fits the stack. */
#define STEPS 512

static uint64_t hash_table(const jsl_ecs *ecs, const jsl_table *table) {
    jsl_hash_step step[STEPS];
    int n = 0;
    uint64_t sum = 0;
    for (int k = 0; k < ecs->component_count; k++) {
        int c = ecs->by_name[k];
        if (!(table->mask >> c & 1)) continue;
        const jsl_component_type *type = &ecs->component[c];
        if (n + 1 + type->desc.field_count > STEPS) {
            sum += JSL_KERNEL_PICK(ecs->isa, jsl_hash_rows)(table->entity, step, n, table->count);
            n = 0;
        }
        uint32_t key = (uint32_t)(type->name_hash ^ type->name_hash >> 32);
        step[n++] = (jsl_hash_step){.key = key};
        for (int f = 0; f < type->desc.field_count; f++) {
            const jsl_column *column = &table->column[table->first[c] + f];
            if (!jsl_role_is_saved(column->role)) continue;
            step[n++] =
                (jsl_hash_step){column->at, column->bytes, 0, column->type == JSL_TYPE_ENTITY};
        }
    }
    return sum + JSL_KERNEL_PICK(ecs->isa, jsl_hash_rows)(table->entity, step, n, table->count);
}

uint64_t jsl_ecs_hash(const jsl_ecs *ecs) {
    uint64_t sum = 0;
    if (!ecs) return 0;
    for (int64_t i = 0; i < ecs->table.count; i++)
        if (ecs->table.at[i]->count) sum += hash_table(ecs, ecs->table.at[i]);
    return jsl_mix64(sum + (uint64_t)ecs->slots.live);
}
