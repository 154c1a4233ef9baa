/* SPDX-License-Identifier: MIT
 * Every invariant of the ECS, checked from scratch. Floor 2.
 */
#include "ecs/store.h"

#include <stdio.h>

/* Notes the first problem. Returns false, so that checks read `return wrong(...)`. */
__attribute__((format(printf, 2, 3))) static bool wrong(jsl_ecs_report *report, const char *format,
                                                        ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(report->problem, sizeof report->problem, format, args);
    va_end(args);
    return false;
}

static bool check_slots(const jsl_ecs *ecs, jsl_ecs_report *r) {
    const jsl_slots *s = &ecs->slots;
    int64_t live = 0, free_count = 0;
    uint64_t free_sum = 0, ring_sum = 0; /* equal sums of mixed indices: the same set of slots */
    if (s->count > s->cap || s->free_count > s->count || (s->cap && s->head >= s->cap))
        return wrong(r, "slots: count %lld, free %lld, capacity %lld", (long long)s->count,
                     (long long)s->free_count, (long long)s->cap);
    for (int64_t i = 0; i < s->count; i++) {
        const jsl_slot *slot = &s->at[i];
        uint32_t generation = slot->generation & JSL_GENERATION_MAX;
        if (jsl_slot_is_free(slot) && slot->generation == 0) continue;
        if (generation == 0 || slot->generation != (ecs->tag | generation))
            return wrong(r, "slot %lld has generation %x", (long long)i, slot->generation);
        if (jsl_slot_is_free(slot)) {
            free_count++;
            free_sum += jsl_mix64((uint64_t)i + 1);
            continue;
        }
        live++;
        if (slot->table >= (uint64_t)ecs->table.count ||
            slot->row >= ecs->table.at[slot->table]->count)
            return wrong(r, "slot %lld points at row %u of table %u", (long long)i, slot->row,
                         slot->table);
        jsl_entity e = ecs->table.at[slot->table]->entity[slot->row];
        if (e.index != i + 1 || e.generation != slot->generation)
            return wrong(r, "slot %lld points at the row of entity %u", (long long)i, e.index);
    }
    for (int64_t i = 0; i < s->free_count; i++) {
        int64_t k = s->head + i;
        uint32_t slot = s->ring[k >= s->cap ? k - s->cap : k];
        if (slot >= s->count) return wrong(r, "free slot %u does not exist", slot);
        ring_sum += jsl_mix64((uint64_t)slot + 1);
    }
    if (live != s->live || free_count != s->free_count || free_sum != ring_sum)
        return wrong(r, "%lld of %lld slots are live, %lld of %lld free", (long long)live,
                     (long long)s->live, (long long)free_count, (long long)s->free_count);
    return true;
}

static bool check_table(const jsl_ecs *ecs, const jsl_table *t, jsl_ecs_report *r) {
    if (t->touched || t->holes || t->cap % JSL_LANES || t->count > t->cap ||
        jsl_table_lookup(ecs, t->mask) != t || ecs->table.at[t->id] != t)
        return wrong(r, "table %u is inconsistent: %lld of %lld rows", t->id, (long long)t->count,
                     (long long)t->cap);
    const unsigned char *end = t->cap ? (const unsigned char *)(t->entity + t->cap) : NULL;
    if (t->cap && (const unsigned char *)t->entity != t->block)
        return wrong(r, "table %u: its handles lie elsewhere", t->id);
    int columns = 0;
    bool keeps_order = false;
    for (int c = 0; c < JSL_MAX_COMPONENTS; c++) {
        bool has = t->mask >> c & 1;
        if (has != (t->first[c] != JSL_NO_COLUMN) || (has && c >= ecs->component_count) ||
            (has && t->first[c] != columns))
            return wrong(r, "table %u: component %d is out of place", t->id, c);
        if (!has) continue;
        columns += ecs->component[c].desc.field_count;
        keeps_order |= ecs->component[c].desc.keeps_order;
    }
    if (columns != t->column_count || keeps_order != t->keeps_order)
        return wrong(r, "table %u has %d columns, not %d", t->id, t->column_count, columns);
    for (int i = 0; i < t->column_count && t->cap; i++) {
        const jsl_column *c = &t->column[i];
        const jsl_field *field = &ecs->component[c->component].desc.fields[c->field];
        if ((uintptr_t)c->at % JSL_ALIGN || c->at < end || field->type != (jsl_type)c->type ||
            c->bytes != (uint32_t)jsl_type_size(field->type))
            return wrong(r, "table %u: column %d is misplaced", t->id, i);
        end = c->at + (size_t)t->cap * c->bytes;
    }
    if (t->cap && end > t->block + t->block_bytes)
        return wrong(r, "table %u: columns exceed their block", t->id);
    for (int64_t row = 0; row < t->count; row++) {
        jsl_entity e = t->entity[row];
        uint32_t k = e.index - 1;
        if (k >= (uint64_t)ecs->slots.count || ecs->slots.at[k].generation != e.generation ||
            ecs->slots.at[k].table != t->id || ecs->slots.at[k].row != row)
            return wrong(r, "table %u row %lld: entity %u is not there", t->id, (long long)row,
                         e.index);
    }
    return true;
}

static bool check_queries(const jsl_ecs *ecs, jsl_ecs_report *r) {
    for (int64_t q = 0; q < ecs->query.count; q++) {
        const jsl_query_plan *plan = ecs->query.at[q];
        int64_t matches = 0, nonempty = 0;
        for (int64_t i = 0; i < ecs->by_mask.count; i++) {
            const jsl_table *t = ecs->by_mask.at[i];
            if (!jsl_query_matches(plan, t->mask)) continue;
            nonempty += t->count > 0;
            if (matches >= plan->match.count || plan->match.at[matches].table != t)
                return wrong(r, "query %lld lacks table %u", (long long)q + 1, t->id);
            matches++;
        }
        if (matches != plan->match.count || nonempty != plan->nonempty)
            return wrong(r, "query %lld: %lld tables, %lld of %lld with rows", (long long)q + 1,
                         (long long)matches, (long long)plan->nonempty, (long long)nonempty);
    }
    return true;
}

static bool check_rest(const jsl_ecs *ecs, jsl_ecs_report *r) {
    for (int64_t i = 0; i < ecs->by_mask.count; i++)
        if (i > 0 && ecs->by_mask.at[i - 1]->mask >= ecs->by_mask.at[i]->mask)
            return wrong(r, "tables are not in the order of their masks");
    if (ecs->by_mask.count != ecs->table.count)
        return wrong(r, "%lld tables are in order, not %lld", (long long)ecs->by_mask.count,
                     (long long)ecs->table.count);
    for (int i = 1; i < ecs->component_count; i++)
        if (strcmp(ecs->component[ecs->by_name[i - 1]].desc.name,
                   ecs->component[ecs->by_name[i]].desc.name) >= 0)
            return wrong(r, "components are not in the order of their names");
    for (int64_t i = 1; i < ecs->system.count; i++) {
        const jsl_system *a = ecs->system.at[i - 1], *b = ecs->system.at[i];
        if (a->stage > b->stage || (a->stage == b->stage && a->order > b->order))
            return wrong(r, "systems %s and %s are not in order", a->name, b->name);
    }
    if (ecs->touched || ecs->busy) return wrong(r, "a call has not tidied up");
    return true;
}

jsl_result jsl_ecs_validate(const jsl_ecs *ecs, jsl_ecs_report *report) {
    jsl_ecs_report local;
    jsl_ecs_report *r = report ? report : &local;
    if (!ecs) return JSL_ERR_ARGUMENT;
    *r = (jsl_ecs_report){.entities = ecs->slots.live,
                          .tables = ecs->table.count,
                          .bytes = ecs->memory.live_bytes,
                          .peak_bytes = ecs->memory.peak_bytes,
                          .allocations = ecs->memory.calls};
    bool sound = check_rest(ecs, r) && check_slots(ecs, r);
    for (int64_t i = 0; i < ecs->table.count; i++) {
        r->columns += ecs->table.at[i]->column_count;
        r->rows += ecs->table.at[i]->count;
        sound = sound && check_table(ecs, ecs->table.at[i], r);
    }
    sound = sound && check_queries(ecs, r);
    if (sound && r->rows != ecs->slots.live)
        sound = wrong(r, "%lld rows hold %lld entities", (long long)r->rows,
                      (long long)ecs->slots.live);
    if (sound) return JSL_OK;
    return jsl_fail(&ecs->logger, JSL_ERR_STATE, "the ECS is unsound: %s", r->problem);
}
