/* SPDX-License-Identifier: MIT
 * jostle/ecs.h - entities, components as flat columns, queries, systems and the schedule.
 *
 * A component is a list of fields. Every field of every component is an array of its own: 64-byte
 * aligned, padded with inert rows to a multiple of 16. A table holds all entities with the same set
 * of components, one row each. A query names components and yields blocks of rows as column
 * pointers. A system is a query and a function. Structural changes (create, destroy, add, remove)
 * are made directly between steps, and through jsl_defer_* from inside a system; those are applied
 * when the stage ends, in an order that does not depend on threads.
 *
 * Pointers into columns are valid until the next structural change of that ECS. A jsl_ecs may be
 * used by one thread at a time; different ones are independent. Floor 2.
 */
#ifndef JOSTLE_ECS_H
#define JOSTLE_ECS_H

#include <jostle/base.h>
#include <jostle/math.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct jsl_ecs jsl_ecs;

/* -- Handles ------------------------------------------------------------------ */

/* An entity. All zero is the null handle. index is slot + 1; generation holds 20 bits that change
 * when the slot is reused and 12 bits that tell the owning ECS apart from others. Validated by
 * every function. */
typedef struct jsl_entity {
    uint32_t index, generation;
} jsl_entity;

static inline bool jsl_entity_is_null(jsl_entity e) { return e.index == 0; }
static inline bool jsl_entity_equal(jsl_entity a, jsl_entity b) {
    return a.index == b.index && a.generation == b.generation;
}
/* generation<<32 | index without the bits of the owning ECS: the same number in every run, in
 * hashes and in logs. */
static inline uint64_t jsl_entity_id(jsl_entity e) {
    return (uint64_t)(e.generation & 0xfffffu) << 32 | e.index;
}

/* A component type of one ECS; zero is null. */
typedef struct jsl_component {
    uint32_t id;
} jsl_component;

/* A query of one ECS; zero is null. */
typedef struct jsl_query {
    uint32_t id;
} jsl_query;

/* -- Components --------------------------------------------------------------- */

typedef enum jsl_type {
    JSL_TYPE_REAL, /* jsl_real */
    JSL_TYPE_F32,
    JSL_TYPE_F64,
    JSL_TYPE_I8,
    JSL_TYPE_U8,
    JSL_TYPE_I16,
    JSL_TYPE_U16,
    JSL_TYPE_I32,
    JSL_TYPE_U32,
    JSL_TYPE_I64,
    JSL_TYPE_U64,
    JSL_TYPE_ENTITY, /* jsl_entity; null when its target dies is NOT done for you */
    JSL_TYPE_COUNT
} jsl_type;

/* Size in bytes of one value in this build; 0 for none. */
JSL_API int jsl_type_size(jsl_type type);

typedef enum jsl_role {
    JSL_STATE,   /* saved, hashed, published */
    JSL_CACHE,   /* saved and hashed too: warm starts, sleep timers */
    JSL_DERIVED, /* rebuilt by its system before it is read: neither saved nor hashed */
    JSL_SCRATCH, /* dead outside the system that writes it */
    JSL_ROLE_COUNT
} jsl_role;

typedef struct jsl_field {
    const char *name;
    const char *unit; /* SI, "" for none, "1" for a pure number */
    jsl_type type;
    jsl_role role;
} jsl_field;

#define JSL_MAX_COMPONENTS 64       /* types in one ECS */
#define JSL_MAX_COMPONENT_FIELDS 64 /* fields of one component */

typedef struct jsl_component_desc {
    const char *name;        /* [a-z][a-z0-9_]*, at most 31 bytes */
    const jsl_field *fields; /* copied; may be empty (a tag) */
    int field_count;
    bool
        keeps_order; /* tables with it remove rows by stable compaction instead of swap-with-last */
} jsl_component_desc;

/* From an X-macro `#define LIST(X) X(type, name, unit, role) ...`, where type is real, f32 .. u64
 * or entity: JSL_COMPONENT_COLUMNS(temperature, LIST)  defines struct temperature_columns {
 * jsl_real *kelvin; ... } and temperature_columns temperature_of(const jsl_rows *rows, int term);
 *   JSL_COMPONENT_FIELDS(temperature, LIST)   defines static const jsl_field temperature_fields[].
 */
#define JSL_CTYPE_real jsl_real
#define JSL_CTYPE_f32 float
#define JSL_CTYPE_f64 double
#define JSL_CTYPE_i8 int8_t
#define JSL_CTYPE_u8 uint8_t
#define JSL_CTYPE_i16 int16_t
#define JSL_CTYPE_u16 uint16_t
#define JSL_CTYPE_i32 int32_t
#define JSL_CTYPE_u32 uint32_t
#define JSL_CTYPE_i64 int64_t
#define JSL_CTYPE_u64 uint64_t
#define JSL_CTYPE_entity jsl_entity
#define JSL_TYPE_OF_real JSL_TYPE_REAL
#define JSL_TYPE_OF_f32 JSL_TYPE_F32
#define JSL_TYPE_OF_f64 JSL_TYPE_F64
#define JSL_TYPE_OF_i8 JSL_TYPE_I8
#define JSL_TYPE_OF_u8 JSL_TYPE_U8
#define JSL_TYPE_OF_i16 JSL_TYPE_I16
#define JSL_TYPE_OF_u16 JSL_TYPE_U16
#define JSL_TYPE_OF_i32 JSL_TYPE_I32
#define JSL_TYPE_OF_u32 JSL_TYPE_U32
#define JSL_TYPE_OF_i64 JSL_TYPE_I64
#define JSL_TYPE_OF_u64 JSL_TYPE_U64
#define JSL_TYPE_OF_entity JSL_TYPE_ENTITY
#define JSL_POINTER_ROW_(ctype, name, unit, role) JSL_CTYPE_##ctype *name;
#define JSL_FIELD_ROW_(ctype, name, unit, role) {#name, unit, JSL_TYPE_OF_##ctype, role},
#define JSL_COMPONENT_COLUMNS(component, LIST)                                                     \
    typedef struct component##_columns {                                                           \
        LIST(JSL_POINTER_ROW_)                                                                     \
    } component##_columns;                                                                         \
    static inline component##_columns component##_of(const jsl_rows *rows, int term) {             \
        union {                                                                                    \
            void *raw[sizeof(component##_columns) / sizeof(void *)];                               \
            component##_columns columns;                                                           \
        } u;                                                                                       \
        for (size_t i = 0; i < sizeof u.raw / sizeof u.raw[0]; i++)                                \
            u.raw[i] = rows->column[rows->first[term] + i];                                        \
        return u.columns;                                                                          \
    }
#define JSL_COMPONENT_FIELDS(component, LIST)                                                      \
    static const jsl_field component##_fields[] = {LIST(JSL_FIELD_ROW_)}

/* -- Rows --------------------------------------------------------------------- */

#define JSL_MAX_TERMS 12
#define JSL_MAX_VIEW_COLUMNS 96

/* count rows of one table as parallel arrays. Those of a query (its iteration, its systems) start
 * 64-byte aligned and may be read and written up to count rounded up to 16: rows past the last are
 * inert, writing them is harmless. Those of jsl_rows_of_entity and jsl_entity_create_n start at any
 * row and end at count. */
typedef struct jsl_rows {
    int64_t count;
    int64_t begin;                /* index of the first row within its table */
    uint32_t table;               /* which table; for jsl_table_* */
    uint64_t present;             /* bit t: the table has the component of term t */
    const jsl_entity *entity;     /* the handle of each row */
    uint8_t first[JSL_MAX_TERMS]; /* term -> first entry in column[]; columns of a component are in
                                     field order */
    void *column[JSL_MAX_VIEW_COLUMNS]; /* null for an optional term that is absent */
} jsl_rows;

/* -- Queries ------------------------------------------------------------------ */

typedef enum jsl_access {
    JSL_END = 0,  /* closes a term list */
    JSL_READ,     /* required */
    JSL_WRITE,    /* required, changed */
    JSL_READ_IF,  /* optional */
    JSL_WRITE_IF, /* optional, changed */
    JSL_WITHOUT   /* tables that have it are left out */
} jsl_access;

typedef struct jsl_term {
    jsl_component component;
    jsl_access access;
} jsl_term;

/* Terms end at the first with access JSL_END. Their index in this list is the `term` of
 * rows->first, x_of(). */
typedef struct jsl_query_desc {
    jsl_term terms[JSL_MAX_TERMS];
} jsl_query_desc;

/* -- Life of an ECS ----------------------------------------------------------- */

typedef struct jsl_ecs_desc {
    jsl_allocator allocator;
    jsl_logger logger;
    uint32_t tag; /* 1..4095 marks handles of this ECS; 0: chosen from its address */
} jsl_ecs_desc;

JSL_API jsl_result jsl_ecs_create(const jsl_ecs_desc *desc, jsl_ecs **out);
JSL_API void jsl_ecs_destroy(jsl_ecs *ecs); /* null is allowed */
/* Where messages go from now on; null: nowhere. */
JSL_API void jsl_ecs_set_logger(jsl_ecs *ecs, const jsl_logger *logger);

/* Registers a component. Registering a name again with the same rows gives the same component; with
 * others: JSL_ERR_NAME. JSL_ERR_LIMIT beyond JSL_MAX_COMPONENTS. */
JSL_API jsl_result jsl_component_register(jsl_ecs *ecs, const jsl_component_desc *desc,
                                          jsl_component *out);
/* JSL_ERR_NAME when no component has that name. */
JSL_API jsl_result jsl_component_find(const jsl_ecs *ecs, const char *name, jsl_component *out);
JSL_API int jsl_component_count(const jsl_ecs *ecs);
/* The desc of the i-th registered component; null when i is out of range. Valid while the ECS
 * lives. */
JSL_API const jsl_component_desc *jsl_component_info(const jsl_ecs *ecs, int i);

/* -- Entities ----------------------------------------------------------------- */

/* count entities with the given set of components, their fields zeroed. Fills out[0..count) unless
 * null, and *rows (may be null) with the new rows, terms in the order of set (JSL_ERR_LIMIT when
 * they exceed JSL_MAX_TERMS or JSL_MAX_VIEW_COLUMNS). A component twice in a set: JSL_ERR_ARGUMENT.
 * All or nothing. Slots are reused lowest-recently-freed first, so the same calls give the same
 * handles. */
JSL_API jsl_result jsl_entity_create_n(jsl_ecs *ecs, const jsl_component *set, int set_count,
                                       int64_t count, jsl_entity *out, jsl_rows *rows);
JSL_API jsl_result jsl_entity_create(jsl_ecs *ecs, const jsl_component *set, int set_count,
                                     jsl_entity *out);
JSL_API jsl_result jsl_entity_destroy(jsl_ecs *ecs, jsl_entity entity);
/* All or nothing: one invalid or repeated handle and none is destroyed. */
JSL_API jsl_result jsl_entity_destroy_n(jsl_ecs *ecs, const jsl_entity *entity, int64_t count);
/* Destroys the rows of the query for which fn sets dead[i] = 1 (dead starts zeroed). fn is called
 * once for each table and only looks; rows die after its last call. *destroyed may be null. */
typedef void jsl_where_fn(const jsl_rows *rows, uint8_t *dead, void *arg);
JSL_API jsl_result jsl_entity_destroy_where(jsl_ecs *ecs, jsl_query query, jsl_where_fn *fn,
                                            void *arg, int64_t *destroyed);
JSL_API bool jsl_entity_is_alive(const jsl_ecs *ecs, jsl_entity entity);
JSL_API bool jsl_entity_has(const jsl_ecs *ecs, jsl_entity entity, jsl_component component);
JSL_API int64_t jsl_entity_count(const jsl_ecs *ecs); /* live */

/* Adds or removes components; fields that stay keep their values, new ones are zero. Adding what is
 * there or removing what is not is JSL_OK and changes nothing. _n: all or nothing. */
JSL_API jsl_result jsl_entity_add(jsl_ecs *ecs, jsl_entity entity, const jsl_component *set,
                                  int set_count);
JSL_API jsl_result jsl_entity_remove(jsl_ecs *ecs, jsl_entity entity, const jsl_component *set,
                                     int set_count);
JSL_API jsl_result jsl_entity_add_n(jsl_ecs *ecs, const jsl_entity *entity, int64_t count,
                                    const jsl_component *set, int set_count);
JSL_API jsl_result jsl_entity_remove_n(jsl_ecs *ecs, const jsl_entity *entity, int64_t count,
                                       const jsl_component *set, int set_count);
/* Every row of the query; *moved may be null. */
JSL_API jsl_result jsl_entity_add_where(jsl_ecs *ecs, jsl_query query, const jsl_component *set,
                                        int set_count, int64_t *moved);
JSL_API jsl_result jsl_entity_remove_where(jsl_ecs *ecs, jsl_query query, const jsl_component *set,
                                           int set_count, int64_t *moved);

/* The address of one field of one entity; null when the handle is invalid or the component absent.
 */
JSL_API void *jsl_entity_field(jsl_ecs *ecs, jsl_entity entity, jsl_component component, int field);
/* One row with the columns of one component, term 0. JSL_ERR_HANDLE, JSL_ERR_NAME when it lacks the
 * component. */
JSL_API jsl_result jsl_rows_of_entity(jsl_ecs *ecs, jsl_entity entity, jsl_component component,
                                      jsl_rows *rows);
/* Room for count entities with that set without growing later. */
JSL_API jsl_result jsl_entity_reserve(jsl_ecs *ecs, const jsl_component *set, int set_count,
                                      int64_t count);

/* -- Iterating ---------------------------------------------------------------- */

JSL_API jsl_result jsl_query_create(jsl_ecs *ecs, const jsl_query_desc *desc, jsl_query *out);
/* Rows that match now; 0 for an invalid query. */
JSL_API int64_t jsl_query_count(const jsl_ecs *ecs, jsl_query query);

typedef struct jsl_iter {
    jsl_ecs *ecs;
    uint32_t query, table;
    int64_t row, block;
} jsl_iter;

/* for (jsl_iter it = jsl_query_begin(ecs, q, 0); jsl_query_next(&it, &rows);) - whole tables when
 * block is 0, else blocks of at most `block` rows (a multiple of 16). Empty tables are skipped.
 * Tables come in order of their component sets' bits, whatever the history. */
JSL_API jsl_iter jsl_query_begin(jsl_ecs *ecs, jsl_query query, int64_t block);
JSL_API bool jsl_query_next(jsl_iter *iter, jsl_rows *rows);

/* -- Systems ------------------------------------------------------------------ */

/* X(CODE, text): the stages of a step, in order. */
#define JSL_STAGES(X)                                                                              \
    X(INBOX, "inbox")                                                                              \
    X(EMIT, "emit")                                                                                \
    X(INDEX, "index")                                                                              \
    X(PERCEIVE, "perceive")                                                                        \
    X(DECIDE, "decide")                                                                            \
    X(FORCE, "force")                                                                              \
    X(DETECT, "detect")                                                                            \
    X(RESPOND, "respond")                                                                          \
    X(MOVE, "move")                                                                                \
    X(RETIRE, "retire")                                                                            \
    X(MEASURE, "measure")                                                                          \
    X(OUTBOX, "outbox")
typedef enum jsl_stage {
#define JSL_X(code, text) JSL_STAGE_##code,
    JSL_STAGES(JSL_X)
#undef JSL_X
        JSL_STAGE_COUNT
} jsl_stage;
JSL_API const char *jsl_stage_text(jsl_stage stage);

/* X(CODE, text): what a step may warn of. */
#define JSL_WARNINGS(X)                                                                            \
    X(BAD_STATE, "an entity became non-finite and was frozen at its last good state")              \
    X(VELOCITY_CLAMPED, "a speed was limited")                                                     \
    X(PARTICLES_FULL, "an emitter could not emit: its particle limit was reached")                 \
    X(OUT_OF_MEMORY, "a system could not get scratch memory and skipped work")
typedef enum jsl_warning {
#define JSL_X(code, text) JSL_WARN_##code,
    JSL_WARNINGS(JSL_X)
#undef JSL_X
        JSL_WARN_COUNT
} jsl_warning;
/* "BAD_STATE" and so on; null when out of range. */
JSL_API const char *jsl_warning_name(jsl_warning warning);
JSL_API const char *jsl_warning_text(jsl_warning warning);

typedef struct jsl_warnings {
    int64_t count[JSL_WARN_COUNT];
    jsl_entity
        first[JSL_WARN_COUNT]; /* the offender with the lowest id; null when none is to blame */
} jsl_warnings;

/* What a system is told. The pointers at the end are for the built-in systems. */
typedef struct jsl_step_context {
    jsl_real dt;     /* s, >= 0 */
    jsl_real inv_dt; /* 1/s, 0 when dt is 0 */
    int substeps;    /* >= 1 */
    uint64_t step;   /* counts from 0 */
    double time;     /* s at the start of the step */
    uint64_t seed;
    jsl_vec3 gravity; /* m/s^2 */
    int worker;       /* in [0, workers) */
    int workers;
    int64_t block; /* index of this block of rows within the system */
    jsl_isa isa;   /* resolved */
    const jsl_logger *logger;
    struct jsl_ecs *ecs;
    struct jsl_command_buffer *commands; /* of this worker; use jsl_defer_* */
    jsl_warnings *warnings;              /* of this worker; use jsl_warn */
    const struct jsl_exec *exec;
    struct jsl_memory *memory;
    struct jsl_arena *arena;                  /* whole systems only: reset when the stage ends */
    const struct jsl_collider_set *colliders; /* everything solid, indexed; null when nothing is */
    const struct jsl_wind *wind;              /* null when the air is still */
} jsl_step_context;

JSL_API void jsl_warn(const jsl_step_context *context, jsl_warning warning, int64_t count,
                      jsl_entity offender);

/* Called for one block of rows; other blocks of the same system may run at the same time on other
 * workers. So exec, memory and arena of the context are null here, and direct structural changes
 * give JSL_ERR_STATE. */
typedef void jsl_rows_fn(const jsl_step_context *context, const jsl_rows *rows, void *user);
/* Called once a step on the calling thread; may change structure directly. A failure ends the stage
 * with that result and drops what its systems deferred. */
typedef jsl_result jsl_whole_fn(const jsl_step_context *context, void *user);

/* Exactly one of run_rows and run_whole. A system runs only when its query matches a row; a
 * run_whole system with an empty query always runs. Within a stage systems run one after the other
 * by (order, name); two with the same order may not touch the same component when one of them
 * writes it. */
typedef struct jsl_system_desc {
    const char *name; /* unique; copied */
    jsl_stage stage;
    int order; /* within the stage: built-in systems use 0..999; before < 0, after > 999 */
    jsl_query_desc query;
    jsl_term also[JSL_MAX_TERMS]; /* further components it reads or writes, not matched */
    int64_t block; /* rows a call of run_rows; 0: 4096; rounded up to a multiple of 16 */
    jsl_rows_fn *run_rows;
    jsl_whole_fn *run_whole;
    void *user;
} jsl_system_desc;

/* JSL_ERR_NAME: name taken. JSL_ERR_CONFLICT: another system of the same stage and order touches
 * the same component; both names are logged. */
JSL_API jsl_result jsl_system_register(jsl_ecs *ecs, const jsl_system_desc *desc);

typedef struct jsl_system_info {
    const char *name;
    jsl_stage stage;
    int order;
    int64_t rows;   /* that match now */
    uint64_t runs;  /* steps in which it was entered */
    uint64_t calls; /* blocks it was called with */
    uint64_t bytes; /* of the columns it declared, over all calls */
    double seconds; /* in total */
    bool always;    /* runs whatever there is: it has no query */
    /* Components as bits: bit i is that of jsl_component_info(ecs, i). */
    uint64_t required, excluded, reads, writes;
} jsl_system_info;
JSL_API int jsl_system_count(const jsl_ecs *ecs);
/* The i-th in the order of execution. JSL_ERR_ARGUMENT when i is out of range. */
JSL_API jsl_result jsl_system_get(const jsl_ecs *ecs, int i, jsl_system_info *out);

/* Structural changes from inside a system; applied at the end of the stage in (system, block,
 * sequence) order. Handles that have died by then are passed over; a handle that is invalid already
 * gives JSL_ERR_HANDLE, no memory JSL_ERR_MEMORY, and nothing is recorded. Should memory run out
 * while they are applied, the stage returns JSL_ERR_MEMORY and the remaining ones are dropped.
 * jsl_defer_create copies `bytes` of values: the fields of set in order, tightly packed, or none
 * when values is null. */
JSL_API jsl_result jsl_defer_create(const jsl_step_context *context, const jsl_component *set,
                                    int set_count, const void *values, size_t bytes);
JSL_API jsl_result jsl_defer_destroy(const jsl_step_context *context, jsl_entity entity);
JSL_API jsl_result jsl_defer_add(const jsl_step_context *context, jsl_entity entity,
                                 const jsl_component *set, int set_count);
JSL_API jsl_result jsl_defer_remove(const jsl_step_context *context, jsl_entity entity,
                                    const jsl_component *set, int set_count);

/* -- Looking inside -------------------------------------------------------------------------- */

/* A table: all entities with one set of components. */
typedef struct jsl_table_info {
    uint64_t components; /* bit i: the i-th registered component */
    int64_t rows, cap;   /* in use, room for */
    int row_bytes;       /* of the fields of one entity, handle included */
    int64_t bytes;       /* taken, spare columns included */
    bool keeps_order;
} jsl_table_info;
JSL_API int jsl_table_count(const jsl_ecs *ecs);
/* The i-th in the order of component sets. JSL_ERR_ARGUMENT when i is out of range. */
JSL_API jsl_result jsl_table_get(const jsl_ecs *ecs, int i, jsl_table_info *out);

/* -- The state as a whole ----------------------------------------------------- */

/* Hash of all STATE and CACHE fields of all entities, independent of row order, padding, and of the
 * order in which tables came about. */
JSL_API uint64_t jsl_ecs_hash(const jsl_ecs *ecs);

/* Bytes needed, and the image itself (STATE and CACHE, versioned, with lengths and a checksum).
 * Little-endian; both precisions read both. size may exceed what is needed; the rest is left alone,
 * and is no part of the image that restore wants. */
JSL_API size_t jsl_ecs_save_size(const jsl_ecs *ecs);
JSL_API jsl_result jsl_ecs_save(const jsl_ecs *ecs, void *bytes, size_t size);
/* Replaces every entity; DERIVED and SCRATCH fields come back zero. size must be that of the image.
 * Components named in the image must be registered with the same rows (JSL_ERR_VERSION otherwise).
 * Damaged: JSL_ERR_FORMAT. On failure nothing has changed. Handles, slots and row order come back
 * as they were. */
JSL_API jsl_result jsl_ecs_restore(jsl_ecs *ecs, const void *bytes, size_t size);

typedef struct jsl_ecs_report {
    int64_t entities, tables, columns, rows, bytes, peak_bytes, allocations;
    char problem[128]; /* what jsl_ecs_validate found; empty when sound */
} jsl_ecs_report;
/* Walks every table and slot. JSL_ERR_STATE when an invariant is broken. */
JSL_API jsl_result jsl_ecs_validate(const jsl_ecs *ecs, jsl_ecs_report *report);

#ifdef __cplusplus
}
#endif
#endif
