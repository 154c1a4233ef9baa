/* SPDX-License-Identifier: MIT
 * Creating and destroying entities, one or a million at a time. Floor 2.
 */
#include "ecs/store.h"

/* -- Creating ----------------------------------------------------------------- */

/* The new rows as the caller wants to fill them: one term for each component of the set, in its
 * order. */
static jsl_result check_view(const jsl_ecs *ecs, const jsl_component *set, int set_count) {
    int columns = 0;
    if (set_count > JSL_MAX_TERMS)
        return jsl_fail(&ecs->logger, JSL_ERR_LIMIT,
                        "rows of %d components: at most %d can be seen at once", set_count,
                        JSL_MAX_TERMS);
    for (int i = 0; i < set_count; i++) columns += ecs->component[set[i].id - 1].desc.field_count;
    if (columns > JSL_MAX_VIEW_COLUMNS)
        return jsl_fail(&ecs->logger, JSL_ERR_LIMIT,
                        "rows of %d columns: at most %d can be seen at once", columns,
                        JSL_MAX_VIEW_COLUMNS);
    return JSL_OK;
}

static void view_set(const jsl_ecs *ecs, const jsl_table *table, const jsl_component *set,
                     int set_count, int64_t row, int64_t count, jsl_rows *rows) {
    int at = 0;
    rows->count = count;
    rows->begin = row;
    rows->table = table->id;
    rows->present = (1ull << set_count) - 1;
    rows->entity = table->entity ? table->entity + row : NULL;
    memset(rows->first, 0, sizeof rows->first);
    for (int i = 0; i < set_count; i++) {
        int c = (int)set[i].id - 1;
        rows->first[i] = (uint8_t)at;
        at = jsl_view_component(table, c, ecs->component[c].desc.field_count, row, at, rows);
    }
}

/* Finds their table and makes room for count more entities of that set. */
static jsl_result reserve_set(jsl_ecs *ecs, uint64_t mask, int64_t count, jsl_table **table) {
    if (count < 0)
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "%lld entities", (long long)count);
    if (count > JSL_MAX_ROWS)
        return jsl_fail(&ecs->logger, JSL_ERR_LIMIT, "%lld entities exceed %lld", (long long)count,
                        JSL_MAX_ROWS);
    JSL_TRY(jsl_table_find(ecs, mask, table));
    JSL_TRY(jsl_table_reserve(ecs, *table, (*table)->count + count));
    return jsl_slots_reserve(ecs, count);
}

jsl_result jsl_entity_create_n(jsl_ecs *ecs, const jsl_component *set, int set_count, int64_t count,
                               jsl_entity *out, jsl_rows *rows) {
    uint64_t mask;
    jsl_table *table;
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_entity_create_n"));
    JSL_TRY(jsl_set_mask(ecs, set, set_count, &mask));
    if (rows) JSL_TRY(check_view(ecs, set, set_count));
    JSL_TRY(reserve_set(ecs, mask, count, &table));
    int64_t row = table->count;
    if (count > 0) {
        jsl_table_append(ecs, table, count);
        jsl_slots_take(ecs, table, row, count, table->entity + row, out);
    }
    if (rows) view_set(ecs, table, set, set_count, row, count, rows);
    return JSL_OK;
}

jsl_result jsl_entity_create(jsl_ecs *ecs, const jsl_component *set, int set_count,
                             jsl_entity *out) {
    uint64_t mask;
    jsl_table *table;
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_entity_create"));
    JSL_TRY(jsl_set_mask(ecs, set, set_count, &mask));
    JSL_TRY(reserve_set(ecs, mask, 1, &table));
    int64_t row = jsl_table_append(ecs, table, 1);
    table->entity[row] = jsl_slot_take(ecs, table, row);
    if (out) *out = table->entity[row];
    return JSL_OK;
}

jsl_result jsl_entity_reserve(jsl_ecs *ecs, const jsl_component *set, int set_count,
                              int64_t count) {
    uint64_t mask;
    jsl_table *table;
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_entity_reserve"));
    JSL_TRY(jsl_set_mask(ecs, set, set_count, &mask));
    return reserve_set(ecs, mask, count, &table);
}

/* -- Destroying --------------------------------------------------------------- */

jsl_result jsl_entity_destroy(jsl_ecs *ecs, jsl_entity entity) {
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_entity_destroy"));
    jsl_slot *slot = jsl_slot_of(ecs, entity);
    if (!slot) return jsl_bad_entity(ecs, entity, "jsl_entity_destroy");
    jsl_table *table = jsl_table_at(ecs, slot->table);
    int64_t row = slot->row;
    jsl_slot_give(&ecs->slots, entity.index - 1);
    jsl_row_remove(ecs, table, row);
    return JSL_OK;
}

/* Takes back the frees of entity[0..count): the handles hold the old generations. */
static void undo_give(jsl_ecs *ecs, const jsl_entity *entity, int64_t count, int64_t free_count) {
    jsl_slots *slots = &ecs->slots;
    for (int64_t i = 0; i < count; i++) {
        jsl_slot *slot = &slots->at[entity[i].index - 1];
        slot->generation = entity[i].generation;
        slot->table &= ~JSL_FREE;
    }
    slots->free_count = free_count;
    slots->live += count;
    jsl_touched_close(ecs);
}

/* Frees the slots of the handles from the first on for as long as they are good and of that table;
 * returns their number. Everything that changes is in locals: a million calls of jsl_slot_give
 * would store it a million times. */
static int64_t give_run(jsl_slots *slots, const jsl_entity *entity, int64_t count, uint32_t table) {
    jsl_slot *at = slots->at;
    uint32_t *ring = slots->ring, last = (uint32_t)slots->count;
    int64_t tail = slots->head + slots->free_count, cap = slots->cap, retired = 0, n = 0;
    if (tail >= cap) tail -= cap;
    for (; n < count; n++) {
        uint32_t index = entity[n].index - 1, generation = entity[n].generation;
        if (index >= last || at[index].generation != generation || at[index].table != table) break;
        at[index].table = table | JSL_FREE;
        if ((generation & JSL_GENERATION_MAX) == JSL_GENERATION_MAX) {
            at[index].generation = 0;
            retired++;
            continue;
        }
        at[index].generation = generation + 1;
        ring[tail++] = index;
        if (tail == cap) tail = 0;
    }
    slots->free_count += n - retired;
    slots->live -= n;
    return n;
}

/* Frees the slots of all handles and counts what leaves each table: one pass instead of one to
 * check and one to free. A bad or repeated handle (its slot is free already) undoes everything. */
static jsl_result give_all(jsl_ecs *ecs, const jsl_entity *entity, int64_t count) {
    int64_t free_count = ecs->slots.free_count;
    for (int64_t i = 0, run; i < count; i += run) {
        const jsl_slot *first = jsl_slot_of(ecs, entity[i]);
        if (!first) {
            undo_give(ecs, entity, i, free_count);
            if (jsl_slot_of(ecs, entity[i]))
                return jsl_fail(&ecs->logger, JSL_ERR_HANDLE,
                                "jsl_entity_destroy_n: entity %u is repeated", entity[i].index);
            return jsl_bad_entity(ecs, entity[i], "jsl_entity_destroy_n");
        }
        jsl_table *table = jsl_table_at(ecs, first->table);
        run = give_run(&ecs->slots, entity + i, count - i, table->id);
        jsl_table_touch(ecs, table);
        table->leaving += run;
    }
    return JSL_OK;
}

/* Takes the rows of freed handles out of the tables that do not empty. */
static void remove_rows(jsl_ecs *ecs, const jsl_entity *entity, int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        const jsl_slot *slot = &ecs->slots.at[entity[i].index - 1];
        jsl_table *table = jsl_table_at(ecs, slot->table & ~JSL_FREE);
        if (table->empties) continue;
        if (table->dense)
            jsl_row_hole(table, slot->row);
        else
            jsl_row_remove(ecs, table, slot->row);
    }
}

jsl_result jsl_entity_destroy_n(jsl_ecs *ecs, const jsl_entity *entity, int64_t count) {
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_entity_destroy_n"));
    if (count < 0 || (count > 0 && !entity))
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "jsl_entity_destroy_n: %lld handles",
                        (long long)count);
    JSL_TRY(give_all(ecs, entity, count));
    bool all = true;
    for (jsl_table *t = ecs->touched; t; t = t->next_touched) {
        t->empties = t->leaving == t->count;
        /* A sweep reads every handle of the table; below one leaving row in 16, swaps cost less. */
        t->dense = t->keeps_order || t->leaving * 16 > t->count;
        if (t->empties) t->holes = t->count;
        all = all && t->empties;
    }
    if (!all) remove_rows(ecs, entity, count);
    jsl_touched_close(ecs);
    return JSL_OK;
}

jsl_result jsl_entity_destroy_where(jsl_ecs *ecs, jsl_query query, jsl_where_fn *fn, void *arg,
                                    int64_t *destroyed) {
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_entity_destroy_where"));
    const jsl_query_plan *plan = jsl_query_at(ecs, query);
    if (!plan)
        return jsl_fail(&ecs->logger, JSL_ERR_HANDLE, "jsl_entity_destroy_where: query %u",
                        query.id);
    if (!fn)
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "jsl_entity_destroy_where: no function");
    int64_t bytes = 0, gone = 0;
    for (int64_t i = 0; i < plan->match.count; i++)
        bytes += jsl_round_up(plan->match.at[i].table->count, JSL_ALIGN);
    if (bytes && jsl_array_reserve(&ecs->memory, &ecs->dead, bytes) != JSL_OK)
        return jsl_fail(&ecs->logger, JSL_ERR_MEMORY, "no memory for %lld marks", (long long)bytes);
    uint8_t *dead = ecs->dead.at;
    if (bytes) memset(dead, 0, (size_t)bytes);
    ecs->busy = true; /* the callback only looks; everything dies after the last call */
    for (int64_t i = 0; i < plan->match.count; i++) {
        jsl_rows rows;
        jsl_table *table = plan->match.at[i].table;
        if (table->count == 0) continue;
        jsl_query_view(plan, &plan->match.at[i], 0, table->count, &rows);
        fn(&rows, dead, arg);
        dead += jsl_round_up(table->count, JSL_ALIGN);
    }
    ecs->busy = false;
    dead = ecs->dead.at;
    for (int64_t i = 0; i < plan->match.count; i++) {
        jsl_table *table = plan->match.at[i].table;
        int64_t step = jsl_round_up(table->count, JSL_ALIGN);
        if (table->count) gone += jsl_table_destroy_rows(ecs, table->id, dead);
        dead += step;
    }
    if (destroyed) *destroyed = gone;
    return JSL_OK;
}

/* -- One entity --------------------------------------------------------------- */

void *jsl_entity_field(jsl_ecs *ecs, jsl_entity entity, jsl_component component, int field) {
    const jsl_slot *slot = ecs ? jsl_slot_of(ecs, entity) : NULL;
    if (!slot || !jsl_component_known(ecs, component)) return NULL;
    const jsl_table *table = jsl_table_at(ecs, slot->table);
    int c = (int)component.id - 1;
    if (table->first[c] == JSL_NO_COLUMN || field < 0 ||
        field >= ecs->component[c].desc.field_count)
        return NULL;
    const jsl_column *column = &table->column[table->first[c] + field];
    return column->at + (size_t)slot->row * column->bytes;
}

jsl_result jsl_rows_of_entity(jsl_ecs *ecs, jsl_entity entity, jsl_component component,
                              jsl_rows *rows) {
    if (!ecs || !rows) return JSL_ERR_ARGUMENT;
    const jsl_slot *slot = jsl_slot_of(ecs, entity);
    if (!slot) return jsl_bad_entity(ecs, entity, "jsl_rows_of_entity");
    if (!jsl_component_known(ecs, component))
        return jsl_fail(&ecs->logger, JSL_ERR_HANDLE,
                        "jsl_rows_of_entity: component %u is not registered", component.id);
    const jsl_table *table = jsl_table_at(ecs, slot->table);
    if (table->first[component.id - 1] == JSL_NO_COLUMN)
        return jsl_fail(&ecs->logger, JSL_ERR_NAME, "entity %u has no component %s", entity.index,
                        ecs->component[component.id - 1].desc.name);
    view_set(ecs, table, &component, 1, slot->row, 1, rows);
    return JSL_OK;
}
