/* SPDX-License-Identifier: MIT
 * The reader's insides, shared by log_*.c, export.c and play.c. Floor 6.
 */
#ifndef JSL_TELEMETRY_LOG_FILE_H
#define JSL_TELEMETRY_LOG_FILE_H

#include "telemetry/log_writer.h"
#include "telemetry/state.h"

#include <jostle/telemetry.h>

/* What a log holds in chunks: the bulk channels first, in the order of jsl_bulk. */
typedef enum jsl_set_kind {
    JSL_SET_PARTICLES,
    JSL_SET_BOIDS,
    JSL_SET_BODIES,
    JSL_SET_KEYFRAME,
    JSL_SET_COLUMNS,
    JSL_SET_SCENE,
    JSL_SET_SHAPES,
    JSL_SET_BODY_INFO,
    JSL_SET_SCENE_TEXT,
    JSL_SET_KINDS
} jsl_set_kind;
#define JSL_FRAME_KINDS 3

/* Where one chunk's data is in the mapping; chunks of a set are a list in order of index. */
typedef struct jsl_set_chunk {
    int64_t data, size;
    int32_t index, next; /* next: into the chunk array, -1 at the end */
} jsl_set_chunk;

/* All chunks of one frame, keyframe or table. */
typedef struct jsl_set {
    int64_t session, seq;         /* seq: frame_seq, keyframe_seq or scene_rev */
    int64_t step, sim_ns, offset; /* offset: of the first event seen */
    int32_t kind, count, got; /* got: distinct chunks; -1: not gathered yet (listed by the index) */
    int32_t head, tail, hint; /* of the list of chunks; hint: the last one added or met */
    bool bad;                 /* did not decode */
} jsl_set;

/* One step of a session that has a frame of some kind. */
typedef struct jsl_instant {
    int64_t session, step, sim_ns;
    int32_t session_rank;
    int32_t latest[JSL_FRAME_KINDS]; /* the set in force: of this step or an earlier one; -1: none
                                        yet */
    int32_t own[JSL_FRAME_KINDS];    /* the set of this very step, or -1 */
} jsl_instant;

typedef JSL_ARRAY(float) jsl_float_array;
typedef JSL_ARRAY(uint32_t) jsl_u32_array;

struct jsl_log_file {
    jsl_memory memory;
    jsl_logger logger;
    int file;
    const uint8_t *map;
    int64_t size;
    int64_t cursor; /* of jsl_log_next */

    bool listed;
    JSL_ARRAY(jsl_set) set;
    JSL_ARRAY(jsl_set_chunk) chunk;
    JSL_ARRAY(jsl_instant) instant;
    JSL_ARRAY(int64_t) session; /* ids in order of appearance */
    int64_t next_instant;
    int64_t next_columns; /* of jsl_log_next_columns: into set */

    /* What the frame arrays hold now. */
    int32_t decoded[JSL_FRAME_KINDS]; /* set, or -1 */
    uint32_t fields[JSL_FRAME_KINDS]; /* bit f: FIELD_f was present */
    int64_t count[JSL_FRAME_KINDS];
    jsl_float_array value[JSL_FRAME_KINDS];
    jsl_u32_array rgba[JSL_FRAME_KINDS];
    JSL_ARRAY(int32_t) body_shape;
    struct { /* of the rows in force: frames without ids keep those of the last with them */
        JSL_ARRAY(uint64_t) at;
        int64_t count, session; /* count -1: not known */
        int32_t order_rev;
    } id[JSL_FRAME_KINDS];
    int32_t scene_set, shapes_set, info_set; /* decoded tables, or -1 */
    JSL_ARRAY(jsl_frame_shape) shape; /* one more than shape_count: a shape that is nothing */
    int64_t shape_count;
    bool shape_unknown;
    jsl_map shape_map, info_map; /* id + 1 -> index */
    JSL_ARRAY(int32_t) info_shape;
    jsl_u32_array info_rgba;
    char scene[64];
    jsl_frame_camera camera;
    bool additive;
    float boid_length;
    jsl_arena arena;
    JSL_ARRAY(uint8_t) image, text;
    /* What jsl_log_next_columns gave last. */
    JSL_ARRAY(uint8_t) column_bytes;
    JSL_ARRAY(uint64_t) column_id;
    jsl_log_column column[JSL_MAX_COMPONENT_FIELDS];
};

/* log_file.c: the first good event at or after `at`. False at the end; *truncated then tells of a
 * cut-off event. */
bool jsl_log_find(const jsl_log_file *log, int64_t at, jsl_log_event *out, bool *truncated);
/* Whether a good event is exactly there. */
bool jsl_log_at(const jsl_log_file *log, int64_t at, jsl_log_event *out);

/* log_list.c */
jsl_result jsl_log_list(jsl_log_file *log, bool may_use_index, jsl_log_info *info);
/* The set that this event is a chunk of (filled but for its chunks), or false. */
bool jsl_log_set_of(const jsl_log_event *event, jsl_set *out, int32_t *chunk_index);
/* Finds the chunks of a set that the index listed. JSL_ERR_FORMAT when one is missing. */
jsl_result jsl_log_gather(jsl_log_file *log, jsl_set *set);

/* log_frame.c: the next instant that has a whole frame of its own of that kind; it becomes the
 * present one. JSL_ERR_END after the last. */
jsl_result jsl_log_next_of_kind(jsl_log_file *log, int kind, const jsl_instant **out);
/* The i-th component of a field of the present frame of a kind; null when the field is absent. */
const float *jsl_log_values(const jsl_log_file *log, int kind, int field, int i);
/* The ids of its rows; null when they are not known. */
const uint64_t *jsl_log_ids(const jsl_log_file *log, int kind);
/* log_table.c: whether the bytes of a complete set are sound. */
bool jsl_log_check_set(jsl_log_file *log, const jsl_set *set);
/* log_component.c */
bool jsl_log_check_columns(jsl_log_file *log, const jsl_set *set);
/* log_table.c */
jsl_result jsl_log_load_scene(jsl_log_file *log, int64_t session);
jsl_result jsl_log_load_tables(jsl_log_file *log, int64_t session, int32_t scene_rev);
void jsl_log_forget(jsl_log_file *log);

#endif
