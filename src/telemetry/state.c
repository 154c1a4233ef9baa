/* SPDX-License-Identifier: MIT
 * state.c - state_t messages: columns to chunks of one datagram each, and back.
 */
#include "telemetry/state.h"

#include <jostle/ecs.h>

/* -- Writing --------------------------------------------------------------------------------------
 */

static int64_t element_bytes(const jsl_state_frame *frame) {
    int64_t bytes = 0;
    for (int c = 0; c < frame->column_count; c++)
        bytes += frame->column[c].components * jsl_encoding_bytes(frame->column[c].encoding);
    return bytes;
}

int64_t jsl_state_size(const jsl_state_frame *frame, int64_t n) {
    return JSL_STATE_HEAD + (int64_t)frame->column_count * JSL_COLUMN_HEAD +
           n * element_bytes(frame);
}

int64_t jsl_state_chunk_elements(const jsl_state_frame *frame, const char *channel) {
    int64_t room = JSL_DATAGRAM - (int64_t)strlen(channel) - 1 - jsl_state_size(frame, 0);
    int64_t bytes = element_bytes(frame);
    return room / (bytes ? bytes : 1) / JSL_LANES * JSL_LANES;
}

int64_t jsl_state_chunk_count(const jsl_state_frame *frame, const char *channel) {
    int64_t elements = jsl_state_chunk_elements(frame, channel);
    return frame->total ? (frame->total + elements - 1) / elements : 1;
}

/* One run of rows of one segment that a chunk takes. */
typedef struct run {
    const jsl_state_segment *segment;
    int64_t begin, count;
} run;

/* Steps through the runs that make up elements [first, first + n). */
typedef struct run_walk {
    const jsl_state_frame *frame;
    int segment;
    int64_t base, first, end; /* base: index in the frame of the segment's first row */
} run_walk;

static bool next_run(run_walk *walk, run *out) {
    while (walk->segment < walk->frame->segment_count && walk->first < walk->end) {
        const jsl_state_segment *s = &walk->frame->segment[walk->segment];
        int64_t stop = walk->base + s->count < walk->end ? walk->base + s->count : walk->end;
        if (walk->first < stop) {
            *out = (run){s, walk->first - walk->base, stop - walk->first};
            walk->first = stop;
            return true;
        }
        walk->base += s->count;
        walk->segment++;
    }
    return false;
}

#define BLOCK 1024
/* At most BLOCK values of one component of a run as floats: in place when they are, else in
 * scratch. */
static const float *run_floats(const jsl_state_column *column, const run *r, int c, int k,
                               int64_t at, int64_t n, float *scratch) {
    const void *data = r->segment->data[c][k];
    if (!data) {
        for (int64_t i = 0; i < n; i++) scratch[i] = column->absent[k];
        return scratch;
    }
#ifdef JSL_DOUBLE
    if (column->source == JSL_SOURCE_REAL) {
        jsl_column_narrow((const double *)data + r->begin + at, n, scratch);
        return scratch;
    }
#endif
    return (const float *)data + r->begin + at;
}

/* Floats in place need no blocks. */
static int64_t run_block(const jsl_state_column *column, const run *r, int c, int k) {
    bool in_place = r->segment->data[c][k] &&
                    (column->source == JSL_SOURCE_F32 || sizeof(jsl_real) == sizeof(float));
    return in_place ? INT64_MAX : BLOCK;
}

static void component_range(const jsl_state_frame *frame, int c, int k, int64_t first, int64_t n,
                            float *lo, float *hi) {
    float scratch[BLOCK];
    const jsl_state_column *column = &frame->column[c];
    run_walk walk = {frame, 0, 0, first, first + n};
    run r;
    bool any = false;
    *lo = *hi = 0.0f;
    while (next_run(&walk, &r)) {
        int64_t block = run_block(column, &r, c, k);
        for (int64_t at = 0, m; at < r.count; at += m) {
            m = r.count - at < block ? r.count - at : block;
            float low, high;
            jsl_column_range(run_floats(column, &r, c, k, at, m, scratch), m, &low, &high);
            *lo = !any || low < *lo ? low : *lo;
            *hi = !any || high > *hi ? high : *hi;
            any = true;
        }
    }
}

static uint8_t *put_floats(const jsl_state_frame *frame, int c, int k, int64_t first, int64_t n,
                           float lo, float step, uint8_t *out) {
    float scratch[BLOCK];
    const jsl_state_column *column = &frame->column[c];
    run_walk walk = {frame, 0, 0, first, first + n};
    run r;
    while (next_run(&walk, &r)) {
        int64_t block = run_block(column, &r, c, k);
        for (int64_t at = 0, m; at < r.count; at += m) {
            m = r.count - at < block ? r.count - at : block;
            jsl_column_encode(column->encoding, run_floats(column, &r, c, k, at, m, scratch), m, lo,
                              step, out);
            out += m * jsl_encoding_bytes(column->encoding);
        }
    }
    return out;
}

static uint8_t *put_integers(const jsl_state_frame *frame, int c, int64_t first, int64_t n,
                             uint8_t *out) {
    run_walk walk = {frame, 0, 0, first, first + n};
    run r;
    while (next_run(&walk, &r)) {
        const void *data = r.segment->data[c][0];
        size_t bytes = (size_t)r.count * (size_t)jsl_encoding_bytes(frame->column[c].encoding);
        if (!data) {
            memset(out, 0, bytes);
        } else if (frame->column[c].source == JSL_SOURCE_ENTITY) {
            const jsl_entity *entity = (const jsl_entity *)data + r.begin;
            for (int64_t i = 0; i < r.count; i++) {
                uint64_t id = jsl_entity_id(entity[i]);
                memcpy(out + i * 8, &id, 8);
            }
        } else {
            memcpy(out, (const uint32_t *)data + r.begin, bytes);
        }
        out += bytes;
    }
    return out;
}

/* Writes one column_t; returns its end, and where its data is. */
static uint8_t *put_column(const jsl_state_frame *frame, int c, int64_t first, int64_t n,
                           uint8_t *out, uint8_t **data) {
    const jsl_state_column *column = &frame->column[c];
    float lo[4] = {0}, step[4] = {0};
    int64_t bytes = n * column->components * jsl_encoding_bytes(column->encoding);
    for (int k = 0; column->encoding == JSL_ENC_U16Q && k < column->components; k++) {
        float high;
        component_range(frame, c, k, first, n, &lo[k], &high);
        step[k] = jsl_column_step(lo[k], high);
    }
    out[0] = (uint8_t)column->field;
    out[1] = (uint8_t)column->encoding;
    out[2] = (uint8_t)column->components;
    out[3] = 0;
    for (int k = 0; k < 4; k++) {
        uint32_t bits;
        memcpy(&bits, &lo[k], 4);
        jsl_put_u32(out + 4 + 4 * k, bits);
        memcpy(&bits, &step[k], 4);
        jsl_put_u32(out + 20 + 4 * k, bits);
    }
    jsl_put_u32(out + 36, (uint32_t)bytes);
    out += JSL_COLUMN_HEAD;
    *data = out;
    if (column->source == JSL_SOURCE_U32 || column->source == JSL_SOURCE_ENTITY)
        return put_integers(frame, c, first, n, out);
    for (int k = 0; k < column->components; k++)
        out = put_floats(frame, c, k, first, n, lo[k], step[k], out);
    return out;
}

int64_t jsl_state_encode(const jsl_state_frame *frame, int32_t chunk_index, int32_t chunk_count,
                         int64_t first, int64_t n, uint8_t *out) {
    JSL_ASSERT(frame->column_count <= JSL_STATE_COLUMNS);
    jsl_put_u64(out, jsl_lcm_fingerprint(JSL_LCM_STATE));
    jsl_put_u64(out + 8, (uint64_t)frame->wall_us);
    jsl_put_u64(out + 16, (uint64_t)frame->session);
    jsl_put_u64(out + 24, (uint64_t)frame->step);
    jsl_put_u64(out + 32, (uint64_t)frame->sim_ns);
    jsl_put_u64(out + 40, (uint64_t)frame->frame_seq);
    jsl_put_u32(out + 48, (uint32_t)chunk_index);
    jsl_put_u32(out + 52, (uint32_t)chunk_count);
    jsl_put_u64(out + 56, (uint64_t)first);
    jsl_put_u32(out + 64, (uint32_t)n);
    jsl_put_u64(out + 68, (uint64_t)frame->total);
    jsl_put_u64(out + 76, (uint64_t)frame->population);
    jsl_put_u32(out + 84, (uint32_t)frame->stride);
    jsl_put_u32(out + 88, (uint32_t)frame->scene_rev);
    jsl_put_u32(out + 92, (uint32_t)frame->order_rev);
    jsl_put_u32(out + 96, (uint32_t)frame->flags);
    out[104] = (uint8_t)frame->column_count;
    uint8_t *at = out + JSL_STATE_HEAD;
    uint32_t crc = 0;
    for (int c = 0; c < frame->column_count; c++) {
        uint8_t *data;
        at = put_column(frame, c, first, n, at, &data);
        crc = jsl_crc32c(crc, data, (size_t)(at - data));
    }
    jsl_put_u32(out + 100, crc);
    JSL_ASSERT(at - out == jsl_state_size(frame, n));
    return at - out;
}

/* -- Reading
 * ---------------------------------------------------------------------------------------- */

static float get_f32(const uint8_t *p) {
    uint32_t bits = jsl_get_u32(p);
    float v;
    memcpy(&v, &bits, 4);
    return v;
}

static void read_head(const uint8_t *data, jsl_state_chunk *out) {
    *out = (jsl_state_chunk){
        .wall_us = (int64_t)jsl_get_u64(data + JSL_AT_WALL_US),
        .session = (int64_t)jsl_get_u64(data + JSL_AT_SESSION),
        .step = (int64_t)jsl_get_u64(data + JSL_AT_STEP),
        .sim_ns = (int64_t)jsl_get_u64(data + JSL_AT_SIM_NS),
        .frame_seq = (int64_t)jsl_get_u64(data + JSL_AT_FRAME_SEQ),
        .chunk_index = (int32_t)jsl_get_u32(data + JSL_AT_CHUNK_INDEX),
        .chunk_count = (int32_t)jsl_get_u32(data + JSL_AT_CHUNK_COUNT),
        .first = (int64_t)jsl_get_u64(data + 56),
        .n = (int32_t)jsl_get_u32(data + 64),
        .total = (int64_t)jsl_get_u64(data + 68),
        .population = (int64_t)jsl_get_u64(data + 76),
        .stride = (int32_t)jsl_get_u32(data + 84),
        .scene_rev = (int32_t)jsl_get_u32(data + 88),
        .order_rev = (int32_t)jsl_get_u32(data + 92),
        .flags = (int32_t)jsl_get_u32(data + 96),
        .crc = jsl_get_u32(data + 100),
    };
}

jsl_result jsl_state_decode(const uint8_t *data, int64_t size, bool check_crc,
                            jsl_state_chunk *out) {
    if (jsl_lcm_type_of(data, size) != JSL_LCM_STATE) return JSL_ERR_VERSION;
    if (size < JSL_STATE_HEAD) return JSL_ERR_FORMAT;
    read_head(data, out);
    int8_t columns = (int8_t)data[104];
    if (out->n < 0 || columns < 0 || out->chunk_count < 1 || out->chunk_index < 0 ||
        out->chunk_index >= out->chunk_count || out->first < 0 || out->total < 0 ||
        out->first > out->total || out->n > out->total - out->first)
        return JSL_ERR_FORMAT;
    const uint8_t *at = data + JSL_STATE_HEAD, *end = data + size;
    uint32_t crc = 0;
    for (int c = 0; c < columns; c++) {
        if (end - at < JSL_COLUMN_HEAD) return JSL_ERR_FORMAT;
        jsl_chunk_column column = {(int8_t)at[0], (int8_t)at[1], (int8_t)at[2], {0}, {0}, NULL};
        for (int k = 0; k < 4; k++) {
            column.lo[k] = get_f32(at + 4 + 4 * k);
            column.step[k] = get_f32(at + 20 + 4 * k);
        }
        int32_t bytes = (int32_t)jsl_get_u32(at + 36);
        at += JSL_COLUMN_HEAD;
        if (bytes < 0 || bytes > end - at) return JSL_ERR_FORMAT;
        column.data = at;
        at += bytes;
        if (check_crc) crc = jsl_crc32c(crc, column.data, (size_t)bytes);
        int each = jsl_encoding_bytes(column.encoding);
        if (!each || column.components < 1 || column.components > 4) continue;
        if (bytes != (int64_t)out->n * column.components * each) return JSL_ERR_FORMAT;
        if (out->column_count < JSL_STATE_COLUMNS) out->column[out->column_count++] = column;
    }
    out->crc_good = check_crc && crc == out->crc;
    return at == end ? JSL_OK : JSL_ERR_FORMAT;
}

const jsl_chunk_column *jsl_chunk_find(const jsl_state_chunk *chunk, int field, int components) {
    for (int c = 0; c < chunk->column_count; c++)
        if (chunk->column[c].field == field && chunk->column[c].components == components)
            return &chunk->column[c];
    return NULL;
}
