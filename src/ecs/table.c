/* SPDX-License-Identifier: MIT
 * Tables: one block of memory per component set, one aligned column per field. Floor 2.
 */
#include "ecs/store.h"

/* -- Layout ------------------------------------------------------------------- */

/* True when no column starts within gap cache lines of `line`, in a ring of the 64 lines of 4096
 * bytes. */
static bool line_is_free(uint64_t used, int line, int gap) {
    uint64_t window = (2ull << (2 * gap - 2)) - 1;
    int shift = (line - gap + 1) & 63;
    window = window << shift | (shift ? window >> (64 - shift) : 0);
    return (used & window) == 0;
}

/* Where a column of `bytes` may start at or after `end`. Columns that start at the same place
 * modulo 4096 bytes would fight for the same sets of the first-level cache, and loads of one would
 * seem to wait for stores to the other; so starts are kept apart, further for columns that outgrow
 * a page. */
static size_t column_start(size_t end, size_t bytes, uint64_t *used) {
    size_t line = (end + JSL_ALIGN - 1) / JSL_ALIGN;
    if (*used == UINT64_MAX) *used = 0;
    for (int gap = bytes >= 4096 ? 8 : bytes >= 1024 ? 2 : 1; gap >= 1; gap /= 2) {
        for (size_t n = 0; n < 64; n++) {
            int at = (int)((line + n) & 63);
            if (!line_is_free(*used, at, gap)) continue;
            *used |= 1ull << at;
            return (line + n) * JSL_ALIGN;
        }
    }
    return line * JSL_ALIGN; /* not reached: some line is free at gap 1 */
}

static size_t block_size(const jsl_table *table, int64_t cap) {
    size_t end = (size_t)cap * sizeof(jsl_entity);
    uint64_t used = 1;
    for (int i = 0; i < table->column_count; i++) {
        size_t bytes = (size_t)cap * table->column[i].bytes;
        end = column_start(end, bytes, &used) + bytes;
    }
    return end;
}

/* Points the columns into block, taking their rows along. */
static void settle(jsl_table *table, unsigned char *block, int64_t cap, size_t size) {
    size_t end = (size_t)cap * sizeof(jsl_entity), rows = (size_t)table->count;
    uint64_t used = 1;
    if (rows) memcpy(block, table->entity, rows * sizeof(jsl_entity));
    table->entity = (jsl_entity *)(void *)block;
    for (int i = 0; i < table->column_count; i++) {
        jsl_column *c = &table->column[i];
        size_t bytes = (size_t)cap * c->bytes, start = column_start(end, bytes, &used);
        if (rows) memcpy(block + start, c->at, rows * c->bytes);
        c->at = block + start;
        end = start + bytes;
    }
    table->block = block;
    table->block_bytes = size;
    table->cap = cap;
}

jsl_result jsl_table_grow(jsl_ecs *ecs, jsl_table *table, int64_t rows) {
    if (rows > JSL_MAX_ROWS)
        return jsl_fail(&ecs->logger, JSL_ERR_LIMIT, "a table of %lld rows exceeds %lld",
                        (long long)rows, JSL_MAX_ROWS);
    int64_t cap = table->cap * 2;
    if (cap < rows) cap = rows;
    cap = jsl_round_up(cap, JSL_LANES);
    if (cap > JSL_MAX_ROWS) cap = JSL_MAX_ROWS;
    size_t size = block_size(table, cap);
    unsigned char *old = table->block, *block = jsl_alloc(&ecs->memory, size);
    size_t old_size = table->block_bytes;
    if (!block)
        return jsl_fail(&ecs->logger, JSL_ERR_MEMORY, "no memory for a table of %lld rows",
                        (long long)cap);
    settle(table, block, cap, size);
    jsl_table_zero(table, table->count, jsl_round_up(table->count, JSL_LANES));
    jsl_free(&ecs->memory, old, old_size);
    jsl_free(&ecs->memory, table->spare, old_size);
    table->spare = NULL; /* of the old size */
    return JSL_OK;
}

static void zero_columns(jsl_table *table, int64_t from, int64_t n) {
    for (int i = 0; i < table->column_count; i++) {
        const jsl_column *c = &table->column[i];
        unsigned char *at = c->at + (size_t)from * c->bytes;
        if (n == 1)
            jsl_value_zero(at, c->bytes);
        else
            memset(at, 0, (size_t)n * c->bytes);
    }
}

void jsl_table_zero(jsl_table *table, int64_t from, int64_t to) {
    if (from >= to) return;
    memset(table->entity + from, 0, (size_t)(to - from) * sizeof(jsl_entity));
    zero_columns(table, from, to - from);
}

void jsl_table_turned(jsl_ecs *ecs, const jsl_table *table, bool has_rows) {
    for (int64_t i = 0; i < ecs->query.count; i++)
        if (jsl_query_matches(ecs->query.at[i], table->mask))
            ecs->query.at[i]->nonempty += has_rows ? 1 : -1;
}

int64_t jsl_table_extend(jsl_ecs *ecs, jsl_table *table, int64_t count) {
    int64_t row = table->count, end = row + count;
    JSL_ASSERT(end <= table->cap);
    /* What lies behind is padding already, unless the rows reach into a new group. */
    if (end > jsl_round_up(row, JSL_LANES))
        jsl_table_zero(table, end, jsl_round_up(end, JSL_LANES));
    jsl_table_set_count(ecs, table, end);
    return row;
}

int64_t jsl_table_append(jsl_ecs *ecs, jsl_table *table, int64_t count) {
    int64_t row = jsl_table_extend(ecs, table, count);
    zero_columns(table, row, count); /* padding may have been written */
    return row;
}

/* -- Finding and making ------------------------------------------------------- */

jsl_table *jsl_table_lookup(const jsl_ecs *ecs, uint64_t mask) {
    uint32_t id;
    if (mask == 0) return ecs->bare;
    return jsl_map_get(&ecs->table_of_mask, mask, &id) ? ecs->table.at[id] : NULL;
}

static void describe(const jsl_ecs *ecs, jsl_table *table) {
    int n = 0;
    for (int c = 0; c < JSL_MAX_COMPONENTS; c++) {
        table->first[c] = JSL_NO_COLUMN;
        if (!(table->mask >> c & 1)) continue;
        const jsl_component_desc *desc = &ecs->component[c].desc;
        table->first[c] = (uint16_t)n;
        table->keeps_order |= desc->keeps_order;
        table->row_bytes += ecs->component[c].row_bytes;
        for (int f = 0; f < desc->field_count; f++) {
            const jsl_field *field = &desc->fields[f];
            table->column[n++] = (jsl_column){.bytes = (uint32_t)jsl_type_size(field->type),
                                              .type = (uint8_t)field->type,
                                              .role = (uint8_t)field->role,
                                              .component = (uint8_t)c,
                                              .field = (uint8_t)f};
        }
    }
    table->column_count = n;
}

static size_t table_bytes(int columns) {
    return sizeof(jsl_table) + (size_t)columns * sizeof(jsl_column);
}

jsl_result jsl_table_find_slow(jsl_ecs *ecs, uint64_t mask, jsl_table **out) {
    if ((*out = jsl_table_lookup(ecs, mask))) {
        ecs->last_found = *out;
        return JSL_OK;
    }
    int columns = 0;
    for (int c = 0; c < ecs->component_count; c++)
        if (mask >> c & 1) columns += ecs->component[c].desc.field_count;
    jsl_table *table = jsl_alloc_zero(&ecs->memory, table_bytes(columns));
    jsl_result r = table ? JSL_OK : JSL_ERR_MEMORY;
    if (r == JSL_OK) r = jsl_array_reserve(&ecs->memory, &ecs->table, ecs->table.count + 1);
    if (r == JSL_OK) r = jsl_array_reserve(&ecs->memory, &ecs->by_mask, ecs->table.count + 1);
    if (r == JSL_OK) r = jsl_queries_reserve(ecs, mask);
    uint32_t id = (uint32_t)ecs->table.count;
    if (r == JSL_OK && mask) r = jsl_map_set(&ecs->memory, &ecs->table_of_mask, mask, id);
    if (r != JSL_OK) {
        jsl_free(&ecs->memory, table, table_bytes(columns));
        return jsl_fail(&ecs->logger, r, "no memory for a table of %d columns", columns);
    }
    table->mask = mask;
    table->id = id;
    describe(ecs, table);
    ecs->table.at[ecs->table.count++] = table;
    int64_t at = ecs->by_mask.count++;
    for (; at > 0 && ecs->by_mask.at[at - 1]->mask > mask; at--)
        ecs->by_mask.at[at] = ecs->by_mask.at[at - 1];
    ecs->by_mask.at[at] = table;
    if (!mask) ecs->bare = table;
    jsl_queries_add(ecs, table);
    *out = table;
    return JSL_OK;
}

void jsl_table_free(jsl_ecs *ecs, jsl_table *table) {
    jsl_free(&ecs->memory, table->block, table->block_bytes);
    jsl_free(&ecs->memory, table->spare, table->block_bytes);
    jsl_free(&ecs->memory, table, table_bytes(table->column_count));
}

uint64_t jsl_table_revision(const jsl_ecs *ecs, uint32_t table) {
    return table < (uint64_t)ecs->table.count ? ecs->table.at[table]->revision : 0;
}
