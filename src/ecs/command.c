/* SPDX-License-Identifier: MIT
 * Command buffers: what systems want changed, recorded per worker and applied in an order that no
 * worker count can alter. Floor 2.
 */
#include "ecs/store.h"

enum { CREATE, DESTROY, ADD, REMOVE };

/* A command in words of 8 bytes: kind | set_count << 8 | value bytes << 32; mask; entity; then for
 * a creation with values the component indices (one byte each) and the values, each padded to whole
 * words. */
#define HEAD_WORDS 3

static int64_t words(int64_t bytes) { return (bytes + 7) / 8; }

/* -- Recording ---------------------------------------------------------------- */

void jsl_commands_begin(jsl_command_buffer *buffer, int system, int64_t block) {
    buffer->system = system;
    buffer->block = block;
    buffer->open = false;
}

/* jsl_memory and the logger are not made for several threads. Only growth and failure pass here, so
 * a spin lock does. */
static void lock(jsl_ecs *ecs) {
    while (atomic_flag_test_and_set_explicit(&ecs->growing, memory_order_acquire)) {}
}
static void unlock(jsl_ecs *ecs) {
    atomic_flag_clear_explicit(&ecs->growing, memory_order_release);
}

/* Room for one command of n words, and a segment for it to lie in. Null when memory is out: nothing
 * was recorded. */
static uint64_t *room(jsl_command_buffer *b, int64_t n) {
    jsl_memory *memory = &b->ecs->memory;
    bool fits = b->word.count + n <= b->word.cap && (b->open || b->segment.count < b->segment.cap);
    if (!fits) {
        lock(b->ecs);
        jsl_result r = jsl_array_reserve(memory, &b->word, b->word.count + n);
        if (r == JSL_OK) r = jsl_array_reserve(memory, &b->segment, b->segment.count + 1);
        if (r != JSL_OK)
            jsl_fail(&b->ecs->logger, JSL_ERR_MEMORY, "no memory for a deferred command");
        unlock(b->ecs);
        if (r != JSL_OK) return NULL;
    }
    if (!b->open) {
        b->segment.at[b->segment.count++] =
            (jsl_segment){b->block, b->word.count, b->word.count, b->system};
        b->open = true;
    }
    uint64_t *at = b->word.at + b->word.count;
    b->word.count += n;
    b->segment.at[b->segment.count - 1].end = b->word.count;
    return at;
}

/* Messages come from several workers at once, hence the lock. */
static jsl_result checked_set(jsl_ecs *ecs, const jsl_component *set, int set_count,
                              uint64_t *mask) {
    lock(ecs);
    jsl_result r = jsl_set_mask(ecs, set, set_count, mask);
    unlock(ecs);
    return r;
}

static jsl_result checked_buffer(const jsl_step_context *context, jsl_command_buffer **out) {
    if (!context) return JSL_ERR_ARGUMENT;
    if (!context->commands || !context->commands->ecs) return JSL_ERR_STATE;
    *out = context->commands;
    return JSL_OK;
}

static jsl_result record(const jsl_step_context *context, int kind, jsl_entity entity,
                         const jsl_component *set, int set_count, const char *caller) {
    jsl_command_buffer *b;
    uint64_t mask = 0;
    JSL_TRY(checked_buffer(context, &b));
    if (!jsl_slot_of(b->ecs, entity)) {
        lock(b->ecs);
        jsl_result r = jsl_bad_entity(b->ecs, entity, caller);
        unlock(b->ecs);
        return r;
    }
    if (kind != DESTROY) JSL_TRY(checked_set(b->ecs, set, set_count, &mask));
    uint64_t *at = room(b, HEAD_WORDS);
    if (!at) return JSL_ERR_MEMORY;
    at[0] = (uint64_t)kind;
    at[1] = mask;
    memcpy(&at[2], &entity, sizeof entity);
    return JSL_OK;
}

jsl_result jsl_defer_destroy(const jsl_step_context *context, jsl_entity entity) {
    return record(context, DESTROY, entity, NULL, 0, "jsl_defer_destroy");
}

jsl_result jsl_defer_add(const jsl_step_context *context, jsl_entity entity,
                         const jsl_component *set, int set_count) {
    return record(context, ADD, entity, set, set_count, "jsl_defer_add");
}

jsl_result jsl_defer_remove(const jsl_step_context *context, jsl_entity entity,
                            const jsl_component *set, int set_count) {
    return record(context, REMOVE, entity, set, set_count, "jsl_defer_remove");
}

jsl_result jsl_defer_create(const jsl_step_context *context, const jsl_component *set,
                            int set_count, const void *values, size_t bytes) {
    jsl_command_buffer *b;
    uint64_t mask;
    JSL_TRY(checked_buffer(context, &b));
    JSL_TRY(checked_set(b->ecs, set, set_count, &mask));
    size_t need = 0;
    for (int i = 0; i < set_count; i++) need += (size_t)b->ecs->component[set[i].id - 1].row_bytes;
    if (values ? bytes != need : bytes != 0) {
        lock(b->ecs);
        jsl_fail(&b->ecs->logger, JSL_ERR_ARGUMENT,
                 "jsl_defer_create: %zu bytes of values; the set has %zu", bytes, need);
        unlock(b->ecs);
        return JSL_ERR_ARGUMENT;
    }
    int64_t set_words = values ? words(set_count) : 0, value_words = words((int64_t)bytes);
    uint64_t *at = room(b, HEAD_WORDS + set_words + value_words);
    if (!at) return JSL_ERR_MEMORY;
    at[0] = (uint64_t)CREATE | (uint64_t)(values ? set_count : 0) << 8 | (uint64_t)bytes << 32;
    at[1] = mask;
    at[2] = 0;
    unsigned char *to = (unsigned char *)(at + HEAD_WORDS);
    memset(to, 0, (size_t)(set_words + value_words) * 8);
    for (int i = 0; values && i < set_count; i++) to[i] = (uint8_t)(set[i].id - 1);
    if (bytes) memcpy(to + set_words * 8, values, bytes);
    return JSL_OK;
}

/* -- Applying ----------------------------------------------------------------- */

static jsl_result apply_create(jsl_ecs *ecs, const uint64_t *at) {
    int set_count = (int)(at[0] >> 8 & 0xff);
    jsl_table *table;
    JSL_TRY(jsl_table_find(ecs, at[1], &table));
    JSL_TRY(jsl_table_reserve(ecs, table, table->count + 1));
    JSL_TRY(jsl_slots_reserve(ecs, 1));
    int64_t row = jsl_table_append(ecs, table, 1);
    table->entity[row] = jsl_slot_take(ecs, table, row);
    const unsigned char *component = (const unsigned char *)(at + HEAD_WORDS);
    const unsigned char *value = component + words(set_count) * 8;
    for (int i = 0; i < set_count; i++) {
        int fields = ecs->component[component[i]].desc.field_count;
        const jsl_column *c = &table->column[table->first[component[i]]];
        for (int f = 0; f < fields; f++, c++) {
            memcpy(c->at + (size_t)row * c->bytes, value, c->bytes);
            value += c->bytes;
        }
    }
    return JSL_OK;
}

static jsl_result apply(jsl_ecs *ecs, const uint64_t *at) {
    int kind = (int)(at[0] & 0xff);
    if (kind == CREATE) return apply_create(ecs, at);
    jsl_entity entity;
    memcpy(&entity, &at[2], sizeof entity);
    jsl_slot *slot = jsl_slot_of(ecs, entity);
    if (!slot) return JSL_OK; /* it died by an earlier command */
    jsl_table *table = jsl_table_at(ecs, slot->table);
    if (kind != DESTROY)
        return jsl_entity_change(ecs, slot,
                                 kind == ADD ? table->mask | at[1] : table->mask & ~at[1], true);
    int64_t row = slot->row;
    jsl_slot_give(&ecs->slots, entity.index - 1);
    if (table->keeps_order) {
        jsl_table_touch(ecs, table); /* one sweep at the end instead of one for each */
        jsl_row_hole(table, row);
    } else {
        jsl_row_remove(ecs, table, row);
    }
    return JSL_OK;
}

static bool before(const jsl_segment *a, const jsl_segment *b) {
    return a->system != b->system ? a->system < b->system : a->block < b->block;
}

/* Workers claim blocks in rising order, so this finds them sorted, unless a host's tasks did
 * otherwise. */
static void sort_segments(jsl_command_buffer *b) {
    for (int64_t i = 1; i < b->segment.count; i++) {
        jsl_segment s = b->segment.at[i];
        int64_t k = i;
        for (; k > 0 && before(&s, &b->segment.at[k - 1]); k--)
            b->segment.at[k] = b->segment.at[k - 1];
        b->segment.at[k] = s;
    }
    b->next = 0;
}

static jsl_command_buffer *next_buffer(jsl_ecs *ecs) {
    jsl_command_buffer *best = NULL;
    for (int w = 0; w < ecs->worker_count; w++) {
        jsl_command_buffer *b = &ecs->worker[w].commands;
        if (b->next == b->segment.count) continue;
        if (!best || before(&b->segment.at[b->next], &best->segment.at[best->next])) best = b;
    }
    return best;
}

static int64_t length(const uint64_t *at) {
    if ((at[0] & 0xff) != CREATE) return HEAD_WORDS;
    return HEAD_WORDS + words((int64_t)(at[0] >> 8 & 0xff)) + words((int64_t)(at[0] >> 32));
}

jsl_result jsl_commands_apply(jsl_ecs *ecs, bool drop) {
    jsl_result r = JSL_OK;
    jsl_command_buffer *b;
    for (int w = 0; w < ecs->worker_count; w++) sort_segments(&ecs->worker[w].commands);
    while (!drop && r == JSL_OK && (b = next_buffer(ecs))) {
        const jsl_segment *s = &b->segment.at[b->next++];
        for (int64_t i = s->begin; i < s->end && r == JSL_OK; i += length(b->word.at + i))
            r = apply(ecs, b->word.at + i);
    }
    jsl_touched_close(ecs);
    for (int w = 0; w < ecs->worker_count; w++) {
        b = &ecs->worker[w].commands;
        b->word.count = b->segment.count = 0;
        b->open = false;
    }
    return r;
}
