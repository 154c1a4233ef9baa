/* SPDX-License-Identifier: MIT
 * Adding and removing components: rows move between tables. Floor 2.
 */
#include "ecs/store.h"

#define BATCH 1024

static uint64_t mask_after(uint64_t mask, uint64_t add, uint64_t remove) {
    return (mask | add) & ~remove;
}

/* -- One entity --------------------------------------------------------------- */

jsl_result jsl_entity_change(jsl_ecs *ecs, jsl_slot *slot, uint64_t mask, bool sweep_later) {
    jsl_table *src = jsl_table_at(ecs, slot->table), *dst = src->change_to;
    if (src->mask == mask) return JSL_OK;
    if (!dst || dst->mask != mask) {
        JSL_TRY(jsl_table_find(ecs, mask, &dst));
        src->change_to = dst;
    }
    JSL_TRY(jsl_table_reserve(ecs, dst, dst->count + 1));
    int64_t row = slot->row;
    jsl_row_move(ecs, src, row, dst, jsl_table_extend(ecs, dst, 1));
    if (sweep_later && src->keeps_order) {
        jsl_table_touch(ecs, src);
        jsl_row_hole(src, row);
    } else {
        jsl_row_remove(ecs, src, row);
    }
    return JSL_OK;
}

static jsl_result change_one(jsl_ecs *ecs, jsl_entity entity, const jsl_component *set,
                             int set_count, bool add) {
    uint64_t mask;
    const char *caller = add ? "jsl_entity_add" : "jsl_entity_remove";
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, caller));
    jsl_slot *slot = jsl_slot_of(ecs, entity);
    if (!slot) return jsl_bad_entity(ecs, entity, caller);
    JSL_TRY(jsl_set_mask(ecs, set, set_count, &mask));
    uint64_t old = jsl_table_at(ecs, slot->table)->mask;
    return jsl_entity_change(ecs, slot, mask_after(old, add ? mask : 0, add ? 0 : mask), false);
}

jsl_result jsl_entity_add(jsl_ecs *ecs, jsl_entity entity, const jsl_component *set,
                          int set_count) {
    return change_one(ecs, entity, set, set_count, true);
}

jsl_result jsl_entity_remove(jsl_ecs *ecs, jsl_entity entity, const jsl_component *set,
                             int set_count) {
    return change_one(ecs, entity, set, set_count, false);
}

/* -- Many entities ------------------------------------------------------------ */

static void unmark(jsl_ecs *ecs, const jsl_entity *entity, int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        jsl_slot *slot = &ecs->slots.at[entity[i].index - 1];
        slot->table &= ~JSL_LEAVING;
    }
    jsl_touched_close(ecs);
}

/* Marks the slots of all entities that will move, and counts them by table. */
static jsl_result mark_movers(jsl_ecs *ecs, const jsl_entity *entity, int64_t count, uint64_t add,
                              uint64_t remove, const char *caller) {
    for (int64_t i = 0; i < count; i++) {
        uint32_t k = entity[i].index - 1;
        jsl_slot *slot = k < (uint64_t)ecs->slots.count ? &ecs->slots.at[k] : NULL;
        if (!slot || slot->generation != entity[i].generation || jsl_slot_is_free(slot)) {
            unmark(ecs, entity, i);
            return jsl_bad_entity(ecs, entity[i], caller);
        }
        if (slot->table & JSL_LEAVING) continue; /* a repeated handle moves once */
        jsl_table *table = jsl_table_at(ecs, slot->table);
        if (mask_after(table->mask, add, remove) == table->mask) continue;
        jsl_table_touch(ecs, table);
        table->leaving++;
        slot->table |= JSL_LEAVING;
    }
    return JSL_OK;
}

/* Finds the target of every touched table and makes room there for all that will come. */
static jsl_result reserve_targets(jsl_ecs *ecs, uint64_t add, uint64_t remove) {
    for (jsl_table *t = ecs->touched; t; t = t->next_touched) {
        if (t->leaving == 0) continue;
        JSL_TRY(jsl_table_find(ecs, mask_after(t->mask, add, remove), &t->target));
        jsl_table_touch(ecs, t->target); /* goes before t in the list: not visited again */
        t->target->arriving += t->leaving;
        t->dense = t->keeps_order || t->leaving * 16 > t->count;
    }
    for (jsl_table *t = ecs->touched; t; t = t->next_touched)
        if (t->arriving) JSL_TRY(jsl_table_reserve(ecs, t, t->count + t->arriving));
    return JSL_OK;
}

/* Rows of one table that wait to be moved together, column by column. */
typedef struct pending {
    jsl_table *src;
    int64_t count;
    uint32_t row[BATCH];
} pending;

static void flush(jsl_ecs *ecs, pending *p) {
    if (p->count == 0) return;
    jsl_table *dst = p->src->target;
    int64_t to = dst->count;
    jsl_table_set_count(ecs, dst, to + p->count);
    jsl_rows_move(ecs, p->src, p->row, 0, dst, to, p->count);
    for (int64_t i = 0; i < p->count; i++) jsl_row_hole(p->src, p->row[i]);
    p->count = 0;
}

static void move_marked(jsl_ecs *ecs, const jsl_entity *entity, int64_t count) {
    pending p = {.count = 0};
    for (int64_t i = 0; i < count; i++) {
        jsl_slot *slot = &ecs->slots.at[entity[i].index - 1];
        if (!(slot->table & JSL_LEAVING)) continue;
        slot->table &= ~JSL_LEAVING;
        jsl_table *src = jsl_table_at(ecs, slot->table);
        if (!src->dense) {
            int64_t row = slot->row, to = src->target->count;
            jsl_table_set_count(ecs, src->target, to + 1);
            jsl_row_move(ecs, src, row, src->target, to);
            jsl_row_remove(ecs, src, row);
            continue;
        }
        if (p.count == BATCH || (p.count && p.src != src)) flush(ecs, &p);
        p.src = src;
        p.row[p.count++] = slot->row;
    }
    flush(ecs, &p);
    for (jsl_table *t = ecs->touched; t; t = t->next_touched)
        jsl_table_zero(t, t->count, jsl_round_up(t->count, JSL_LANES));
    jsl_touched_close(ecs);
}

static jsl_result change_n(jsl_ecs *ecs, const jsl_entity *entity, int64_t count,
                           const jsl_component *set, int set_count, bool add) {
    uint64_t mask;
    const char *caller = add ? "jsl_entity_add_n" : "jsl_entity_remove_n";
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, caller));
    JSL_TRY(jsl_set_mask(ecs, set, set_count, &mask));
    if (count < 0 || (count > 0 && !entity))
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "%s: %lld handles", caller,
                        (long long)count);
    uint64_t on = add ? mask : 0, off = add ? 0 : mask;
    JSL_TRY(mark_movers(ecs, entity, count, on, off, caller));
    jsl_result r = reserve_targets(ecs, on, off);
    if (r != JSL_OK) {
        unmark(ecs, entity, count);
        return r;
    }
    move_marked(ecs, entity, count);
    return JSL_OK;
}

jsl_result jsl_entity_add_n(jsl_ecs *ecs, const jsl_entity *entity, int64_t count,
                            const jsl_component *set, int set_count) {
    return change_n(ecs, entity, count, set, set_count, true);
}

jsl_result jsl_entity_remove_n(jsl_ecs *ecs, const jsl_entity *entity, int64_t count,
                               const jsl_component *set, int set_count) {
    return change_n(ecs, entity, count, set, set_count, false);
}

/* -- Whole tables ------------------------------------------------------------- */

static jsl_result change_where(jsl_ecs *ecs, jsl_query query, const jsl_component *set,
                               int set_count, bool add, int64_t *moved) {
    uint64_t mask;
    const char *caller = add ? "jsl_entity_add_where" : "jsl_entity_remove_where";
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, caller));
    JSL_TRY(jsl_set_mask(ecs, set, set_count, &mask));
    const jsl_query_plan *plan = jsl_query_at(ecs, query);
    if (!plan)
        return jsl_fail(&ecs->logger, JSL_ERR_HANDLE, "%s: query %u is unknown", caller, query.id);
    uint64_t on = add ? mask : 0, off = add ? 0 : mask;
    for (int64_t i = 0; i < plan->match.count; i++) {
        jsl_table *t = plan->match.at[i].table;
        if (t->count == 0 || mask_after(t->mask, on, off) == t->mask) continue;
        jsl_table_touch(ecs, t);
        t->leaving = t->count;
    }
    jsl_result r = reserve_targets(ecs, on, off);
    int64_t n = 0;
    /* Tables in the order of the query: where several flow into one, its rows come in that order.
     */
    for (int64_t i = 0; r == JSL_OK && i < plan->match.count; i++) {
        jsl_table *t = plan->match.at[i].table;
        if (!t->touched || t->leaving == 0) continue;
        int64_t to = t->target->count;
        jsl_table_set_count(ecs, t->target, to + t->count);
        jsl_rows_move(ecs, t, NULL, 0, t->target, to, t->count);
        n += t->count;
        jsl_table_set_count(ecs, t, 0);
    }
    for (jsl_table *t = ecs->touched; t && r == JSL_OK; t = t->next_touched)
        jsl_table_zero(t, t->count, jsl_round_up(t->count, JSL_LANES));
    jsl_touched_close(ecs);
    if (r == JSL_OK && moved) *moved = n;
    return r;
}

jsl_result jsl_entity_add_where(jsl_ecs *ecs, jsl_query query, const jsl_component *set,
                                int set_count, int64_t *moved) {
    return change_where(ecs, query, set, set_count, true, moved);
}

jsl_result jsl_entity_remove_where(jsl_ecs *ecs, jsl_query query, const jsl_component *set,
                                   int set_count, int64_t *moved) {
    return change_where(ecs, query, set, set_count, false, moved);
}
