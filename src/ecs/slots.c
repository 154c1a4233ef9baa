/* SPDX-License-Identifier: MIT
 * Slots of entities: which table and row a handle means, and which handles are still good. Floor 2.
 */
#include "ecs/store.h"

jsl_result jsl_slots_reserve_total(jsl_ecs *ecs, int64_t need) {
    jsl_slots *s = &ecs->slots;
    if (need <= s->cap) return JSL_OK;
    if (need > JSL_MAX_SLOTS)
        return jsl_fail(&ecs->logger, JSL_ERR_LIMIT, "%lld slots exceed the limit of %lld",
                        (long long)need, JSL_MAX_SLOTS);
    int64_t cap = s->cap * 2;
    if (cap < need) cap = need;
    cap = jsl_round_up(cap, 16);
    jsl_slot *at = jsl_alloc(&ecs->memory, (size_t)cap * sizeof *at);
    uint32_t *ring = jsl_alloc(&ecs->memory, (size_t)cap * sizeof *ring);
    if (!at || !ring) {
        jsl_free(&ecs->memory, at, (size_t)cap * sizeof *at);
        jsl_free(&ecs->memory, ring, (size_t)cap * sizeof *ring);
        return jsl_fail(&ecs->logger, JSL_ERR_MEMORY, "no memory for %lld slots", (long long)cap);
    }
    if (s->count) memcpy(at, s->at, (size_t)s->count * sizeof *at);
    for (int64_t i = 0, k = s->head; i < s->free_count; i++) {
        ring[i] = s->ring[k];
        if (++k == s->cap) k = 0;
    }
    jsl_free(&ecs->memory, s->at, (size_t)s->cap * sizeof *at);
    jsl_free(&ecs->memory, s->ring, (size_t)s->cap * sizeof *ring);
    s->at = at;
    s->ring = ring;
    s->cap = cap;
    s->head = 0;
    return JSL_OK;
}

/* Handles written and copied at a time: they stay in the first-level cache. */
#define PIECE 1024

static void take_piece(jsl_ecs *ecs, uint32_t table, uint32_t row, int64_t count,
                       jsl_entity *handle) {
    jsl_slots *s = &ecs->slots;
    int64_t reused = count < s->free_count ? count : s->free_count, head = s->head;
    jsl_slot *at = s->at;
    for (int64_t i = 0; i < reused; i++) {
        uint32_t k = s->ring[head];
        if (++head == s->cap) head = 0;
        at[k].table = table;
        at[k].row = row + (uint32_t)i;
        handle[i] = (jsl_entity){k + 1, at[k].generation};
    }
    s->head = head;
    s->free_count -= reused;
    uint32_t first = (uint32_t)s->count, generation = ecs->tag | 1;
    for (int64_t i = 0; i < count - reused; i++) {
        at[first + i] = (jsl_slot){table, row + (uint32_t)(reused + i), generation};
        handle[reused + i] = (jsl_entity){first + 1 + (uint32_t)i, generation};
    }
    s->count += count - reused;
    s->live += count;
}

void jsl_slots_take(jsl_ecs *ecs, const jsl_table *table, int64_t row, int64_t count,
                    jsl_entity *handle, jsl_entity *out) {
    for (int64_t i = 0, n; i < count; i += n) {
        n = count - i < PIECE ? count - i : PIECE;
        take_piece(ecs, table->id, (uint32_t)(row + i), n, handle + i);
        if (out) memcpy(out + i, handle + i, (size_t)n * sizeof *out);
    }
}

jsl_result jsl_bad_entity(const jsl_ecs *ecs, jsl_entity e, const char *caller) {
    uint32_t generation = e.generation & JSL_GENERATION_MAX;
    const char *why = jsl_entity_is_null(e)                              ? "null"
                      : (e.generation & ~JSL_GENERATION_MAX) != ecs->tag ? "of another ECS"
                      : e.index > (uint64_t)ecs->slots.count             ? "forged"
                                                                         : "stale";
    return jsl_fail(&ecs->logger, JSL_ERR_HANDLE, "%s: entity %u:%u is %s", caller, e.index,
                    generation, why);
}

bool jsl_entity_locate(const jsl_ecs *ecs, jsl_entity entity, uint32_t *table, int64_t *row) {
    const jsl_slot *slot = ecs ? jsl_slot_of(ecs, entity) : NULL;
    if (!slot) return false;
    if (table) *table = slot->table;
    if (row) *row = slot->row;
    return true;
}

jsl_entity jsl_entity_at(const jsl_ecs *ecs, uint32_t index) {
    jsl_entity none = {0, 0};
    if (!ecs || index == 0 || index > (uint64_t)ecs->slots.count) return none;
    const jsl_slot *slot = &ecs->slots.at[index - 1];
    if (slot->table >= JSL_LEAVING) return none;
    return (jsl_entity){index, slot->generation};
}

bool jsl_entity_is_alive(const jsl_ecs *ecs, jsl_entity entity) {
    return ecs && jsl_slot_of(ecs, entity);
}

bool jsl_entity_has(const jsl_ecs *ecs, jsl_entity entity, jsl_component component) {
    const jsl_slot *slot = ecs ? jsl_slot_of(ecs, entity) : NULL;
    if (!slot || !jsl_component_known(ecs, component)) return false;
    return jsl_table_at(ecs, slot->table)->mask >> (component.id - 1) & 1;
}

int64_t jsl_entity_count(const jsl_ecs *ecs) { return ecs ? ecs->slots.live : 0; }
