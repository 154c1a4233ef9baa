/* SPDX-License-Identifier: MIT
 * Moving rows: out of a table by its removal rule, into another, or into another order. Floor 2.
 */
#include "ecs/store.h"

/* Rows moved at a time: their indices stay in the first-level cache and on the stack, so that
 * removal allocates nothing and cannot fail. */
#define BATCH 1024

/* Values of one width; the casts are to types of the same size that may alias any other. */
typedef uint8_t value8 __attribute__((may_alias));
typedef uint16_t value16 __attribute__((may_alias));
typedef uint32_t value32 __attribute__((may_alias));
typedef uint64_t value64 __attribute__((may_alias));

#define MOVE_LOOP(type)                                                                            \
    do {                                                                                           \
        type *d = (type *)(void *)dst;                                                             \
        const type *s = (const type *)(const void *)src;                                           \
        if (to)                                                                                    \
            for (int64_t i = 0; i < n; i++) d[to[i]] = s[from[i]];                                 \
        else                                                                                       \
            for (int64_t i = 0; i < n; i++) d[base + i] = s[from[i]];                              \
    } while (0)

/* dst[to[i]] = src[from[i]], or dst[base + i] when to is null. Goes up, so that dst may be src when
 * no target lies above its source. */
static void move_values(unsigned char *dst, const uint32_t *to, int64_t base,
                        const unsigned char *src, const uint32_t *from, int64_t n, uint32_t bytes) {
    switch (bytes) {
    case 1:
        MOVE_LOOP(value8);
        break;
    case 2:
        MOVE_LOOP(value16);
        break;
    case 4:
        MOVE_LOOP(value32);
        break;
    default:
        MOVE_LOOP(value64);
        break;
    }
}

static bool is_run(const uint32_t *from, int64_t n) {
    for (int64_t i = 1; i < n; i++)
        if (from[i] != from[0] + i) return false;
    return true;
}

/* Points the slots of rows [begin, begin + n) at their rows. */
static void point_slots(jsl_ecs *ecs, const jsl_table *table, int64_t begin, int64_t n) {
    jsl_slot *slot = ecs->slots.at;
    const jsl_entity *e = table->entity + begin;
    for (int64_t i = 0; i < n; i++) {
        slot[e[i].index - 1].table = table->id;
        slot[e[i].index - 1].row = (uint32_t)(begin + i);
    }
}

/* -- One row ------------------------------------------------------------------ */

void jsl_row_move(jsl_ecs *ecs, const jsl_table *src, int64_t row, jsl_table *dst, int64_t to) {
    jsl_entity e = src->entity[row];
    dst->entity[to] = e;
    for (int i = 0; i < dst->column_count; i++) {
        const jsl_column *c = &dst->column[i];
        unsigned char *at = c->at + (size_t)to * c->bytes;
        uint16_t first = src->first[c->component];
        if (first == JSL_NO_COLUMN)
            jsl_value_zero(at, c->bytes);
        else
            jsl_value_copy(at, src->column[first + c->field].at + (size_t)row * c->bytes, c->bytes);
    }
    jsl_slot *slot = &ecs->slots.at[e.index - 1];
    slot->table = dst->id;
    slot->row = (uint32_t)to;
}

void jsl_row_remove(jsl_ecs *ecs, jsl_table *table, int64_t row) {
    int64_t last = table->count - 1;
    if (row != last && table->keeps_order) {
        size_t n = (size_t)(last - row);
        memmove(table->entity + row, table->entity + row + 1, n * sizeof(jsl_entity));
        for (int i = 0; i < table->column_count; i++) {
            jsl_column *c = &table->column[i];
            unsigned char *at = c->at + (size_t)row * c->bytes;
            memmove(at, at + c->bytes, n * c->bytes);
        }
        point_slots(ecs, table, row, last - row);
    } else if (row != last) {
        table->entity[row] = table->entity[last];
        for (int i = 0; i < table->column_count; i++) {
            const jsl_column *c = &table->column[i];
            jsl_value_copy(c->at + (size_t)row * c->bytes, c->at + (size_t)last * c->bytes,
                           c->bytes);
        }
        ecs->slots.at[table->entity[row].index - 1].row = (uint32_t)row;
    }
    jsl_table_zero(table, last, last + 1);
    jsl_table_set_count(ecs, table, last);
}

/* -- Many rows ---------------------------------------------------------------- */

static void close_in_order(jsl_ecs *ecs, jsl_table *table) {
    uint32_t from[BATCH];
    int64_t to = table->hole_first, r = to, end = table->count;
    const jsl_entity *e = table->entity;
    while (r < end) {
        int64_t n = 0;
        for (; r < end && n < BATCH; r++) {
            from[n] = (uint32_t)r;
            n += e[r].index != 0;
        }
        if (n == 0) break;
        bool run = is_run(from, n);
        for (int i = -1; i < table->column_count; i++) {
            unsigned char *at = i < 0 ? (unsigned char *)table->entity : table->column[i].at;
            uint32_t bytes = i < 0 ? (uint32_t)sizeof(jsl_entity) : table->column[i].bytes;
            if (run)
                memmove(at + (size_t)to * bytes, at + (size_t)from[0] * bytes, (size_t)n * bytes);
            else
                move_values(at, NULL, to, at, from, n, bytes);
        }
        point_slots(ecs, table, to, n);
        to += n;
    }
}

/* Fills the holes from below with the last rows from above. */
static void close_with_last(jsl_ecs *ecs, jsl_table *table) {
    uint32_t to[BATCH], from[BATCH];
    int64_t end = table->count - table->holes; /* rows that stay end here */
    int64_t hole = table->hole_first, last = table->count - 1;
    const jsl_entity *e = table->entity;
    while (hole < end) {
        int64_t n = 0;
        for (; hole < end && n < BATCH; hole++) {
            if (e[hole].index != 0) continue;
            while (e[last].index == 0) last--;
            to[n] = (uint32_t)hole;
            from[n++] = (uint32_t)last--;
        }
        move_values((unsigned char *)table->entity, to, 0, (unsigned char *)table->entity, from, n,
                    sizeof(jsl_entity));
        for (int i = 0; i < table->column_count; i++) {
            jsl_column *c = &table->column[i];
            move_values(c->at, to, 0, c->at, from, n, c->bytes);
        }
        for (int64_t i = 0; i < n; i++) ecs->slots.at[e[to[i]].index - 1].row = to[i];
    }
}

void jsl_table_close(jsl_ecs *ecs, jsl_table *table) {
    if (table->holes == 0) return;
    int64_t count = table->count - table->holes, old = table->count;
    if (count > 0 && table->keeps_order)
        close_in_order(ecs, table);
    else if (count > 0)
        close_with_last(ecs, table);
    /* Rows beyond the padding need no zeros: they get them when they come into use. */
    int64_t pad = jsl_round_up(count, JSL_LANES);
    jsl_table_zero(table, count, pad < old ? pad : jsl_round_up(old, JSL_LANES));
    jsl_table_set_count(ecs, table, count);
    table->holes = 0;
}

void jsl_touched_close(jsl_ecs *ecs) {
    while (ecs->touched) {
        jsl_table *table = ecs->touched;
        ecs->touched = table->next_touched;
        jsl_table_close(ecs, table);
        table->touched = false;
    }
}

int64_t jsl_table_destroy_rows(jsl_ecs *ecs, uint32_t id, const uint8_t *dead) {
    if (!ecs || !dead || id >= (uint64_t)ecs->table.count || ecs->busy) return 0;
    jsl_table *table = jsl_table_at(ecs, id);
    int64_t n = table->count;
    table->holes = 0;
    for (int64_t r = 0; r < n; r++) {
        uint64_t eight;
        if (n - r >= 8 && (memcpy(&eight, dead + r, 8), eight == 0)) {
            r += 7;
            continue;
        }
        if (!dead[r]) continue;
        jsl_slot_give(&ecs->slots, table->entity[r].index - 1);
        jsl_row_hole(table, r);
    }
    int64_t gone = table->holes;
    jsl_table_close(ecs, table);
    return gone;
}

static void copy_column(unsigned char *dst, int64_t to, const unsigned char *src,
                        const uint32_t *from, int64_t begin, int64_t n, uint32_t bytes) {
    if (from)
        move_values(dst, NULL, to, src, from, n, bytes);
    else
        memcpy(dst + (size_t)to * bytes, src + (size_t)begin * bytes, (size_t)n * bytes);
}

void jsl_rows_move(jsl_ecs *ecs, const jsl_table *src, const uint32_t *from, int64_t begin,
                   jsl_table *dst, int64_t to, int64_t n) {
    if (n == 0) return;
    if (from && is_run(from, n)) {
        begin = from[0];
        from = NULL;
    }
    for (int i = 0; i < dst->column_count; i++) {
        jsl_column *c = &dst->column[i];
        uint16_t first = src->first[c->component];
        if (first == JSL_NO_COLUMN)
            memset(c->at + (size_t)to * c->bytes, 0, (size_t)n * c->bytes);
        else
            copy_column(c->at, to, src->column[first + c->field].at, from, begin, n, c->bytes);
    }
    /* Piece by piece: the slots are found by handles that were written just now. */
    for (int64_t i = 0, piece; i < n; i += piece) {
        piece = n - i < BATCH ? n - i : BATCH;
        copy_column((unsigned char *)dst->entity, to + i, (const unsigned char *)src->entity,
                    from ? from + i : NULL, begin + i, piece, sizeof(jsl_entity));
        point_slots(ecs, dst, to + i, piece);
    }
}

/* -- Another order ------------------------------------------------------------ */

typedef struct reorder_job {
    jsl_ecs *ecs;
    jsl_table *table;
    const uint32_t *from;
    unsigned char *spare;
    int64_t rows_per_block, blocks;
} reorder_job;

/* Unit 0 .. blocks-1: handles and slots; then blocks of column 0, of column 1 ... */
static void reorder_block(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    const reorder_job *job = arg;
    jsl_table *table = job->table;
    (void)block, (void)worker;
    for (int64_t unit = begin; unit < end; unit++) {
        int64_t column = unit / job->blocks - 1;
        int64_t row = unit % job->blocks * job->rows_per_block;
        int64_t n =
            table->count - row < job->rows_per_block ? table->count - row : job->rows_per_block;
        if (column < 0) {
            jsl_entity *to = (jsl_entity *)(void *)job->spare + row;
            for (int64_t i = 0; i < n; i++) {
                to[i] = table->entity[job->from[row + i]];
                job->ecs->slots.at[to[i].index - 1].row = (uint32_t)(row + i);
            }
        } else {
            const jsl_column *c = &table->column[column];
            move_values(job->spare + (c->at - table->block), NULL, row, c->at, job->from + row, n,
                        c->bytes);
        }
    }
}

jsl_result jsl_table_reorder(jsl_ecs *ecs, uint32_t id, const uint32_t *from,
                             const jsl_exec *exec) {
    if (!ecs || !from || id >= (uint64_t)ecs->table.count) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_table_reorder"));
    jsl_table *table = jsl_table_at(ecs, id);
    if (table->count == 0) return JSL_OK;
    if (!table->spare && !(table->spare = jsl_alloc(&ecs->memory, table->block_bytes)))
        return jsl_fail(&ecs->logger, JSL_ERR_MEMORY, "no memory for %zu bytes of spare columns",
                        table->block_bytes);
    reorder_job job = {ecs, table, from, table->spare, 16384, 0};
    job.blocks = (table->count + job.rows_per_block - 1) / job.rows_per_block;
    jsl_parallel_for(exec, job.blocks * (table->column_count + 1), 1, reorder_block, &job);
    unsigned char *old = table->block;
    table->entity = (jsl_entity *)(void *)table->spare;
    for (int i = 0; i < table->column_count; i++)
        table->column[i].at = table->spare + (table->column[i].at - old);
    table->block = table->spare;
    table->spare = old;
    jsl_table_zero(table, table->count, jsl_round_up(table->count, JSL_LANES));
    table->revision++;
    return JSL_OK;
}
