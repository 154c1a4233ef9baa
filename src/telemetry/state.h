/* SPDX-License-Identifier: MIT
 * state_t: one chunk of one frame of many entities, written straight from columns. Floor 6.
 */
#ifndef JSL_TELEMETRY_STATE_H
#define JSL_TELEMETRY_STATE_H

#include "telemetry/column.h"
#include "telemetry/message.h"

/* The most that LCM's UDP provider sends as one datagram, channel and its NUL included. */
#define JSL_DATAGRAM 65499
#define JSL_STATE_HEAD 105   /* bytes of state_t before its columns */
#define JSL_COLUMN_HEAD 40   /* bytes of column_t before its data */
#define JSL_STATE_COLUMNS 16 /* columns of one message that we write or look at */

/* Byte offsets of the fields that are read without decoding. */
enum {
    JSL_AT_WALL_US = 8,
    JSL_AT_SESSION = 16,
    JSL_AT_STEP = 24,
    JSL_AT_SIM_NS = 32,
    JSL_AT_FRAME_SEQ = 40,
    JSL_AT_CHUNK_INDEX = 48,
    JSL_AT_CHUNK_COUNT = 52,
    JSL_STAMP_END = 40
};

/* -- Writing --------------------------------------------------------------------------------------
 */

typedef enum jsl_source_type {
    JSL_SOURCE_REAL,  /* jsl_real */
    JSL_SOURCE_F32,   /* float */
    JSL_SOURCE_U32,   /* uint32_t */
    JSL_SOURCE_ENTITY /* jsl_entity as uint32_t index, generation; written as jsl_entity_id */
} jsl_source_type;

typedef struct jsl_state_column {
    int field, encoding, components;
    jsl_source_type source;
    float absent[4]; /* the value of a segment that has no such column */
} jsl_state_column;

/* Rows of one table: where each component of each column is; null where absent. */
typedef struct jsl_state_segment {
    int64_t count;
    const void *data[JSL_STATE_COLUMNS][4];
} jsl_state_segment;

typedef struct jsl_state_frame {
    int64_t wall_us, session, step, sim_ns, frame_seq, population;
    int32_t stride, scene_rev, order_rev, flags;
    int64_t total;
    int column_count;
    jsl_state_column column[JSL_STATE_COLUMNS];
    const jsl_state_segment *segment;
    int segment_count;
} jsl_state_frame;

enum { JSL_STATE_KEYFRAME = 1, JSL_STATE_IDS = 2, JSL_STATE_DROPPED_BEFORE = 4 };

/* Elements that fit into one datagram on that channel, a multiple of 16. */
int64_t jsl_state_chunk_elements(const jsl_state_frame *frame, const char *channel);
int64_t jsl_state_chunk_count(const jsl_state_frame *frame, const char *channel);
/* Bytes of a message with n elements. */
int64_t jsl_state_size(const jsl_state_frame *frame, int64_t n);
/* Writes elements [first, first + n); returns the size, which is jsl_state_size(frame, n). */
int64_t jsl_state_encode(const jsl_state_frame *frame, int32_t chunk_index, int32_t chunk_count,
                         int64_t first, int64_t n, uint8_t *out);

/* -- Reading
 * ---------------------------------------------------------------------------------------- */

typedef struct jsl_chunk_column {
    int field, encoding, components;
    float lo[4], step[4];
    const uint8_t *data; /* component k of n elements at data + k * n * bytes */
} jsl_chunk_column;

typedef struct jsl_state_chunk {
    int64_t wall_us, session, step, sim_ns, frame_seq;
    int32_t chunk_index, chunk_count;
    int64_t first, total, population;
    int32_t n, stride, scene_rev, order_rev, flags;
    uint32_t crc;
    int column_count; /* of known encodings and at most 4 components; others are passed over */
    jsl_chunk_column column[JSL_STATE_COLUMNS];
    bool crc_good; /* only when asked for */
} jsl_state_chunk;

/* JSL_ERR_VERSION: not a state_t. JSL_ERR_FORMAT: a count is wrong or the message is not exactly
 * `size` bytes. Columns stay in data. */
jsl_result jsl_state_decode(const uint8_t *data, int64_t size, bool check_crc,
                            jsl_state_chunk *out);
/* The column of a field; null when there is none. */
const jsl_chunk_column *jsl_chunk_find(const jsl_state_chunk *chunk, int field, int components);

#endif
