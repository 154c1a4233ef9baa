/* SPDX-License-Identifier: MIT
 * Writing an image of the state. Floor 2.
 */
#include "ecs/image.h"
#include "ecs/image_kernel.h"

/* What was copied is summed in pieces of this many bytes, while the caches still hold it. */
#define PIECE (256 * JSL_SUM_BYTES)

/* With bytes null it only counts. */
typedef struct writer {
    const jsl_ecs *ecs;
    unsigned char *bytes;
    size_t at, summed;
    jsl_image_sum sum;
} writer;

static void put(writer *w, const void *data, size_t size) {
    const unsigned char *from = data;
    if (!w->bytes) {
        w->at += size;
        return;
    }
    while (size) {
        size_t room = w->summed + PIECE - w->at, n = size < room ? size : room;
        memcpy(w->bytes + w->at, from, n);
        w->at += n;
        from += n;
        size -= n;
        if (n < room) break;
        jsl_image_sum_mix(w->ecs, &w->sum, w->bytes + w->summed, PIECE);
        w->summed = w->at;
    }
}

static void put_u8(writer *w, int x) {
    uint8_t byte = (uint8_t)x;
    put(w, &byte, 1);
}

static void put_text(writer *w, const char *text) {
    size_t n = strlen(text);
    put_u8(w, (int)n);
    put(w, text, n);
}

static void align(writer *w) {
    static const unsigned char zero[8] = {0};
    put(w, zero, (8 - w->at % 8) % 8);
}

static void put_schema(writer *w, const jsl_ecs *ecs, uint64_t used) {
    for (int c = 0; c < ecs->component_count; c++) {
        if (!(used >> c & 1)) continue;
        const jsl_component_desc *desc = &ecs->component[c].desc;
        put_text(w, desc->name);
        put_u8(w, desc->keeps_order);
        put_u8(w, desc->field_count);
        for (int f = 0; f < desc->field_count; f++) {
            put_text(w, desc->fields[f].name);
            put_text(w, desc->fields[f].unit);
            put_u8(w, (int)desc->fields[f].type);
            put_u8(w, (int)desc->fields[f].role);
        }
    }
    align(w);
}

#define BATCH 1024

static void put_slots(writer *w, const jsl_slots *slots) {
    uint32_t word[BATCH];
    if (!w->bytes) {
        w->at += (size_t)slots->count * 4;
        align(w);
        w->at += (size_t)slots->free_count * 4;
        align(w);
        return;
    }
    for (int64_t i = 0, n; i < slots->count; i += n) {
        n = slots->count - i < BATCH ? slots->count - i : BATCH;
        JSL_KERNEL_PICK(w->ecs->isa, jsl_pack_generations)(word, slots->at + i, n);
        put(w, word, (size_t)n * 4);
    }
    align(w);
    int64_t tail = slots->cap - slots->head;
    int64_t first = slots->free_count < tail ? slots->free_count : tail;
    if (first) put(w, slots->ring + slots->head, (size_t)first * 4);
    if (first < slots->free_count) put(w, slots->ring, (size_t)(slots->free_count - first) * 4);
    align(w);
}

static void put_handles(writer *w, const jsl_entity *entity, int64_t count) {
    uint32_t word[BATCH];
    for (int64_t i = 0, n; w->bytes && i < count; i += n) {
        n = count - i < BATCH ? count - i : BATCH;
        JSL_KERNEL_PICK(w->ecs->isa, jsl_pack_handles)(word, entity + i, n);
        put(w, word, (size_t)n * 4);
    }
    if (!w->bytes) w->at += (size_t)count * 4;
    align(w);
}

static void put_entities(writer *w, const jsl_entity *value, int64_t count) {
    jsl_entity word[BATCH];
    for (int64_t i = 0; w->bytes && i < count;) {
        int64_t n = 0;
        for (; n < BATCH && i < count; n++, i++)
            word[n] = (jsl_entity){value[i].index, value[i].generation & JSL_GENERATION_MAX};
        put(w, word, (size_t)n * sizeof *word);
    }
    if (!w->bytes) w->at += (size_t)count * sizeof *word;
}

static void put_table(writer *w, const jsl_table *table, uint64_t used) {
    jsl_image_table head = {.components = (uint32_t)__builtin_popcountll(table->mask),
                            .rows = (uint64_t)table->count};
    put(w, &head, sizeof head);
    for (int c = 0; c < JSL_MAX_COMPONENTS; c++)
        if (table->mask >> c & 1) put_u8(w, __builtin_popcountll(used & ((1ull << c) - 1)));
    align(w);
    put_handles(w, table->entity, table->count);
    for (int i = 0; i < table->column_count; i++) {
        const jsl_column *c = &table->column[i];
        if (!jsl_column_is_saved(c)) continue;
        if (c->type == JSL_TYPE_ENTITY)
            put_entities(w, (const jsl_entity *)(const void *)c->at, table->count);
        else
            put(w, c->at, (size_t)table->count * c->bytes);
        align(w);
    }
}

static void write_image(writer *w, const jsl_ecs *ecs, size_t size) {
    jsl_image_header head = {.magic = {0},
                             .version = JSL_IMAGE_VERSION,
                             .real_bytes = sizeof(jsl_real),
                             .size = size,
                             .slots = (uint64_t)ecs->slots.count,
                             .free_slots = (uint64_t)ecs->slots.free_count,
                             .live = (uint64_t)ecs->slots.live};
    uint64_t used = 0;
    memcpy(head.magic, JSL_IMAGE_MAGIC, sizeof head.magic);
    for (int64_t i = 0; i < ecs->table.count; i++) {
        if (ecs->table.at[i]->count == 0) continue;
        used |= ecs->table.at[i]->mask;
        head.tables++;
    }
    head.components = (uint32_t)__builtin_popcountll(used);
    put(w, &head, sizeof head);
    put_schema(w, ecs, used);
    put_slots(w, &ecs->slots);
    for (int64_t i = 0; i < ecs->by_mask.count; i++)
        if (ecs->by_mask.at[i]->count) put_table(w, ecs->by_mask.at[i], used);
    if (w->bytes) {
        size_t left = w->at - w->summed, whole = left - left % JSL_SUM_BYTES;
        jsl_image_sum_mix(ecs, &w->sum, w->bytes + w->summed, whole);
        uint64_t sum = jsl_image_sum_end(&w->sum, w->bytes + w->summed + whole, left - whole);
        memcpy(w->bytes + w->at, &sum, sizeof sum);
    }
    w->at += sizeof(uint64_t);
}

size_t jsl_ecs_save_size(const jsl_ecs *ecs) {
    writer w = {0};
    if (!ecs) return 0;
    write_image(&w, ecs, 0);
    return w.at;
}

jsl_result jsl_ecs_save(const jsl_ecs *ecs, void *bytes, size_t size) {
    if (!ecs) return JSL_ERR_ARGUMENT;
    size_t need = jsl_ecs_save_size(ecs);
    if (!bytes || size < need)
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "jsl_ecs_save: %zu bytes; %zu are needed",
                        size, need);
    writer w = {.ecs = ecs, .bytes = bytes, .sum = jsl_image_sum_begin()};
    write_image(&w, ecs, need);
    return JSL_OK;
}
