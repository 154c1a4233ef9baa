/* SPDX-License-Identifier: MIT
 * How the ECS is laid out inside: slots, columns, tables, queries, systems. Private to this room.
 * Floor 2.
 */
#ifndef JSL_ECS_STORE_H
#define JSL_ECS_STORE_H

#include "ecs/ecs.h"

#include <stdatomic.h>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "images are little-endian and columns are copied into them as they are"
#endif

#define JSL_GENERATION_MAX 0xfffffu /* 20 bits; 0 marks a retired slot */
#define JSL_TAG_SHIFT 20
#define JSL_FREE 0x80000000u /* bit of slot.table: free or retired; the rest is its last table */
#define JSL_LEAVING                                                                                \
    0x40000000u /* bit of slot.table: will move, while a bulk call checks its handles */
#define JSL_MAX_ROWS 0xfffffff0ll  /* of one table; rows are 32 bits in slots and permutations */
#define JSL_MAX_SLOTS 0xfffffffell /* of one ECS */
#define JSL_NO_COLUMN 0xffffu
#define JSL_NAME_MAX 31

/* -- Slots -------------------------------------------------------------------- */

typedef struct jsl_slot {
    uint32_t table, row;
    uint32_t generation; /* tag << 20 | generation of the live entity, or of the next one */
} jsl_slot;

/* Free slots wait in a ring, so that taking and giving back a thousand is a copy and not a chase.
 */
typedef struct jsl_slots {
    jsl_slot *at;
    uint32_t *ring; /* as many entries as slots have room */
    int64_t count, cap;
    int64_t head, free_count;
    int64_t live;
} jsl_slots;

/* -- Components --------------------------------------------------------------- */

typedef struct jsl_component_type {
    jsl_component_desc desc; /* strings and fields lie in block */
    void *block;
    size_t block_bytes;
    uint64_t name_hash;
    int row_bytes;
} jsl_component_type;

/* -- Tables ------------------------------------------------------------------- */

typedef struct jsl_column {
    unsigned char *at;
    uint32_t bytes; /* of one value */
    uint8_t type, role, component, field;
} jsl_column;

typedef struct jsl_table {
    /* What iterating reads comes first, in one cache line. */
    uint64_t mask;
    jsl_entity *entity; /* the start of block; columns follow */
    int64_t count, cap; /* cap: multiple of 16 */
    uint32_t id;
    int column_count;
    unsigned char *block;
    size_t block_bytes;
    unsigned char *spare; /* of block_bytes, or null; see jsl_table_reorder */
    uint64_t revision;
    int row_bytes; /* of the columns, without the handle */
    bool keeps_order;
    struct jsl_table *change_to; /* where its last changed entity went; most go the same way */
    /* Meaningful only inside one public call: */
    bool touched;
    bool empties;     /* all rows leave */
    bool dense;       /* so many rows leave that one sweep is cheaper than swaps */
    int64_t leaving;  /* rows that will go */
    int64_t arriving; /* rows that will come */
    int64_t holes;    /* rows whose handle is null: they wait for jsl_table_close */
    int64_t hole_first;
    struct jsl_table *target;
    struct jsl_table *next_touched;
    uint16_t first[JSL_MAX_COMPONENTS]; /* component -> its first column, or JSL_NO_COLUMN */
    jsl_column column[];
} jsl_table;

/* -- Queries ------------------------------------------------------------------ */

typedef struct jsl_match {
    jsl_table *table;
    uint16_t first[JSL_MAX_TERMS]; /* of the table's columns, for each term, or JSL_NO_COLUMN */
    uint16_t present;              /* bit t: it has the component of term t */
    int64_t first_block; /* scratch of the schedule: blocks of the tables before this one */
} jsl_match;

typedef struct jsl_query_plan {
    uint64_t required, excluded, optional;
    int term_count, column_count;
    int64_t nonempty; /* matching tables that hold rows: what an idle system compares with 0 */
    JSL_ARRAY(jsl_match) match; /* in the order of mask */
    uint8_t first[JSL_MAX_TERMS];
    uint8_t component[JSL_MAX_TERMS]; /* index */
    uint8_t fields[JSL_MAX_TERMS];
    jsl_query_desc desc;
} jsl_query_plan;

/* -- Commands ----------------------------------------------------------------- */

/* What one system deferred in one block: words [begin, end) of the buffer that recorded it. */
typedef struct jsl_segment {
    int64_t block, begin, end;
    int32_t system;
} jsl_segment;

typedef struct jsl_command_buffer {
    struct jsl_ecs *ecs;
    JSL_ARRAY(uint64_t) word;
    JSL_ARRAY(jsl_segment) segment;
    int64_t block; /* that is running */
    int32_t system;
    bool open;    /* the last segment belongs to this system and block */
    int64_t next; /* segment to apply */
} jsl_command_buffer;

/* -- Systems ------------------------------------------------------------------ */

#define JSL_SYSTEM_NAME_MAX 63

typedef struct jsl_system {
    char name[JSL_SYSTEM_NAME_MAX + 1];
    jsl_stage stage;
    int order;
    uint32_t query;
    bool always; /* a whole system without a query */
    uint64_t touches, writes;
    int64_t block;
    jsl_rows_fn *run_rows;
    jsl_whole_fn *run_whole;
    void *user;
    uint64_t runs, calls, bytes;
    double seconds;
} jsl_system;

/* One a worker; the schedule hands out its parts as the context of a system. */
typedef struct jsl_worker {
    jsl_step_context context;
    jsl_warnings warnings;
    jsl_command_buffer commands;
    int64_t match; /* where the last block was found */
    char pad[64];  /* keeps two workers off one cache line */
} jsl_worker;

/* -- The whole ---------------------------------------------------------------- */

struct jsl_ecs {
    jsl_memory memory;
    jsl_logger logger;
    uint32_t tag;        /* already shifted */
    jsl_isa isa;         /* of the hash */
    bool busy;           /* rows are being visited: structural changes are refused */
    bool in_stage;       /* the schedule runs */
    atomic_flag growing; /* held by the worker that grows a command buffer or logs */

    int component_count;
    jsl_component_type component[JSL_MAX_COMPONENTS];
    uint8_t by_name[JSL_MAX_COMPONENTS]; /* components in the order of their names */

    jsl_slots slots;
    JSL_ARRAY(jsl_table *) table;   /* by id */
    JSL_ARRAY(jsl_table *) by_mask; /* in the order of their masks */
    jsl_map table_of_mask;
    jsl_table *bare;       /* the table of the empty set: 0 is no key of a map */
    jsl_table *last_found; /* the next one asked for is mostly the same; tables live as long */
    jsl_table *touched;

    JSL_ARRAY(jsl_query_plan *) query;
    JSL_ARRAY(jsl_system *) system; /* in the order of execution */
    jsl_worker *worker;
    int worker_count;
    JSL_ARRAY(uint8_t) dead; /* scratch of the _where calls */
};

/* component.c */
/* The mask of a set, or an error for a null, unknown or repeated component. */
jsl_result jsl_set_mask(const jsl_ecs *ecs, const jsl_component *set, int set_count,
                        uint64_t *mask);
static inline bool jsl_component_known(const jsl_ecs *ecs, jsl_component c) {
    return c.id >= 1 && c.id <= (uint32_t)ecs->component_count;
}
static inline bool jsl_role_is_saved(unsigned role) {
    return role == JSL_STATE || role == JSL_CACHE;
}
bool jsl_component_same(const jsl_component_desc *a, const jsl_component_desc *b);

/* slots.c */
/* Room for so many slots altogether, or for `more` new entities. */
jsl_result jsl_slots_reserve_total(jsl_ecs *ecs, int64_t need);
static inline jsl_result jsl_slots_reserve(jsl_ecs *ecs, int64_t more) {
    int64_t need = ecs->slots.count + more - ecs->slots.free_count;
    return need > ecs->slots.cap ? jsl_slots_reserve_total(ecs, need) : JSL_OK;
}
/* Takes count slots for rows [row, row + count) of table, writes their handles to handle[] and
 * out[] (may be null). Room must have been reserved. */
void jsl_slots_take(jsl_ecs *ecs, const jsl_table *table, int64_t row, int64_t count,
                    jsl_entity *handle, jsl_entity *out);
/* The same for one entity. */
static inline jsl_entity jsl_slot_take(jsl_ecs *ecs, const jsl_table *table, int64_t row) {
    jsl_slots *s = &ecs->slots;
    uint32_t k, generation = ecs->tag | 1;
    if (s->free_count) {
        k = s->ring[s->head];
        if (++s->head == s->cap) s->head = 0;
        s->free_count--;
        generation = s->at[k].generation;
    } else {
        k = (uint32_t)s->count++;
    }
    s->at[k] = (jsl_slot){table->id, (uint32_t)row, generation};
    s->live++;
    return (jsl_entity){k + 1, generation};
}
/* Frees a live slot. Its handle dies; its row is the caller's business. */
static inline void jsl_slot_give(jsl_slots *slots, uint32_t index) {
    jsl_slot *slot = &slots->at[index];
    slot->table |= JSL_FREE;
    slots->live--;
    if ((slot->generation & JSL_GENERATION_MAX) == JSL_GENERATION_MAX) {
        slot->generation = 0; /* used up: were it reused, an old handle could come alive again */
        return;
    }
    slot->generation++;
    int64_t tail = slots->head + slots->free_count++;
    slots->ring[tail >= slots->cap ? tail - slots->cap : tail] = index;
}
static inline bool jsl_slot_is_free(const jsl_slot *slot) { return slot->table & JSL_FREE; }
static inline jsl_slot *jsl_slot_of(const jsl_ecs *ecs, jsl_entity e) {
    uint32_t i = e.index - 1; /* null wraps round and fails the test */
    if (i >= (uint64_t)ecs->slots.count) return NULL;
    jsl_slot *s = &ecs->slots.at[i];
    return s->generation == e.generation && s->table < JSL_LEAVING ? s : NULL;
}
jsl_result jsl_bad_entity(const jsl_ecs *ecs, jsl_entity e, const char *caller);

/* table.c */
/* The table of a set, made when there is none yet. */
jsl_result jsl_table_find_slow(jsl_ecs *ecs, uint64_t mask, jsl_table **out);
static inline jsl_result jsl_table_find(jsl_ecs *ecs, uint64_t mask, jsl_table **out) {
    *out = ecs->last_found;
    return *out && (*out)->mask == mask ? JSL_OK : jsl_table_find_slow(ecs, mask, out);
}
/* Null when there is none yet. */
jsl_table *jsl_table_lookup(const jsl_ecs *ecs, uint64_t mask);
jsl_result jsl_table_grow(jsl_ecs *ecs, jsl_table *table, int64_t rows);
static inline jsl_result jsl_table_reserve(jsl_ecs *ecs, jsl_table *table, int64_t rows) {
    return rows <= table->cap ? JSL_OK : jsl_table_grow(ecs, table, rows);
}
void jsl_table_free(jsl_ecs *ecs, jsl_table *table);
/* Tells the queries that the table has got rows, or lost the last of them. */
void jsl_table_turned(jsl_ecs *ecs, const jsl_table *table, bool has_rows);
static inline void jsl_table_set_count(jsl_ecs *ecs, jsl_table *table, int64_t count) {
    bool had = table->count > 0, has = count > 0;
    table->count = count;
    table->revision++;
    if (had != has) jsl_table_turned(ecs, table, has);
}
/* Zeroes rows [from, to) of every column; handles too. */
void jsl_table_zero(jsl_table *table, int64_t from, int64_t to);
/* Adds count rows that the caller fills, handles included; room must have been reserved. Returns
 * the first. The padding behind them is inert. */
int64_t jsl_table_extend(jsl_ecs *ecs, jsl_table *table, int64_t count);
/* The same with all values zero; the handles stay the caller's. */
int64_t jsl_table_append(jsl_ecs *ecs, jsl_table *table, int64_t count);
static inline jsl_table *jsl_table_at(const jsl_ecs *ecs, uint32_t id) { return ecs->table.at[id]; }

/* One value; constant sizes become single moves. */
static inline void jsl_value_copy(unsigned char *dst, const unsigned char *src, uint32_t bytes) {
    switch (bytes) {
    case 1:
        memcpy(dst, src, 1);
        break;
    case 2:
        memcpy(dst, src, 2);
        break;
    case 4:
        memcpy(dst, src, 4);
        break;
    default:
        memcpy(dst, src, 8);
        break;
    }
}
static inline void jsl_value_zero(unsigned char *at, uint32_t bytes) {
    static const unsigned char zero[8] = {0};
    jsl_value_copy(at, zero, bytes);
}

/* rows.c */
/* Removes one row by the table's rule; its slot must have been given back or moved already. */
void jsl_row_remove(jsl_ecs *ecs, jsl_table *table, int64_t row);
/* Leaves a hole that jsl_table_close sweeps up. */
static inline void jsl_row_hole(jsl_table *table, int64_t row) {
    table->entity[row] = (jsl_entity){0, 0};
    if (table->holes++ == 0 || row < table->hole_first) table->hole_first = row;
}
void jsl_table_close(jsl_ecs *ecs, jsl_table *table);
/* Copies the rows from[0..n) (or begin.. when from is null) of src to rows [to, to + n) of dst,
 * handles included, zeroes what src lacks, and points the slots at their new place. */
void jsl_rows_move(jsl_ecs *ecs, const jsl_table *src, const uint32_t *from, int64_t begin,
                   jsl_table *dst, int64_t to, int64_t n);

/* The same for one row. */
void jsl_row_move(jsl_ecs *ecs, const jsl_table *src, int64_t row, jsl_table *dst, int64_t to);

/* touched tables: a list of those that the current call works on */
static inline void jsl_table_touch(jsl_ecs *ecs, jsl_table *table) {
    if (table->touched) return;
    table->touched = true;
    table->leaving = table->arriving = table->holes = 0;
    table->target = NULL;
    table->next_touched = ecs->touched;
    ecs->touched = table;
}
/* Closes the holes of all touched tables and forgets the list. */
void jsl_touched_close(jsl_ecs *ecs);

/* query.c */
jsl_query_plan *jsl_query_at(const jsl_ecs *ecs, jsl_query query);
/* Rows [row, row + count) of a table that has rows. */
void jsl_query_view(const jsl_query_plan *plan, const jsl_match *match, int64_t row, int64_t count,
                    jsl_rows *rows);
static inline bool jsl_query_matches(const jsl_query_plan *plan, uint64_t mask) {
    return (mask & plan->required) == plan->required && (mask & plan->excluded) == 0;
}
/* Makes room for one more table in every query that will match it, then adds it (cannot fail). */
jsl_result jsl_queries_reserve(jsl_ecs *ecs, uint64_t mask);
void jsl_queries_add(jsl_ecs *ecs, jsl_table *table);
void jsl_queries_free(jsl_ecs *ecs);
/* Columns of one component of one table as term `term`, starting at rows->column[at]. Returns the
 * next place. */
int jsl_view_component(const jsl_table *table, int component, int fields, int64_t row, int at,
                       jsl_rows *rows);

/* change.c */
/* Moves one entity to the table of mask. sweep_later: a table that keeps order gets a hole, for
 * jsl_touched_close. */
jsl_result jsl_entity_change(jsl_ecs *ecs, jsl_slot *slot, uint64_t mask, bool sweep_later);
static inline jsl_result jsl_refuse_busy(const jsl_ecs *ecs, const char *caller) {
    if (!ecs->busy) return JSL_OK;
    return jsl_fail(&ecs->logger, JSL_ERR_STATE,
                    "%s: rows are being visited; use jsl_defer_* inside a system", caller);
}

/* command.c */
void jsl_commands_begin(jsl_command_buffer *buffer, int system, int64_t block);
/* Applies and empties all buffers; when `drop`, only empties them. */
jsl_result jsl_commands_apply(jsl_ecs *ecs, bool drop);

/* system.c, schedule.c */
void jsl_systems_free(jsl_ecs *ecs);
static inline bool jsl_system_is_idle(const jsl_ecs *ecs, const jsl_system *system) {
    return !system->always && ecs->query.at[system->query]->nonempty == 0;
}

#endif
