/* SPDX-License-Identifier: MIT
 * Telling what tables there are.
 */
#include "ecs/store.h"

int jsl_table_count(const jsl_ecs *ecs) { return ecs ? (int)ecs->by_mask.count : 0; }

jsl_result jsl_table_get(const jsl_ecs *ecs, int i, jsl_table_info *out) {
    if (!ecs || !out) return JSL_ERR_ARGUMENT;
    if (i < 0 || i >= ecs->by_mask.count)
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "there is no table %d", i);
    const jsl_table *t = ecs->by_mask.at[i];
    *out = (jsl_table_info){.components = t->mask,
                            .rows = t->count,
                            .cap = t->cap,
                            .row_bytes = t->row_bytes + (int)sizeof(jsl_entity),
                            .bytes = (int64_t)t->block_bytes * (t->spare ? 2 : 1),
                            .keeps_order = t->keeps_order};
    return JSL_OK;
}
