/* SPDX-License-Identifier: MIT
 * Our bytes against those of the code that lcm-gen makes from the same schema.
 */
#include "helper.h"

#include "telemetry/component.h"
#include "telemetry/message.h"
#include "telemetry/schema.h"
#include "telemetry/state.h"

#include <jostle/ecs.h>
#include <jostle_body_info_t.h>
#include <jostle_column_t.h>
#include <jostle_columns_t.h>
#include <jostle_command_t.h>
#include <jostle_contacts_t.h>
#include <jostle_diag_t.h>
#include <jostle_keyframe_t.h>
#include <jostle_log_index_t.h>
#include <jostle_probe_t.h>
#include <jostle_reply_t.h>
#include <jostle_scene_t.h>
#include <jostle_scene_text_t.h>
#include <jostle_schema_t.h>
#include <jostle_shape_table_t.h>
#include <jostle_state_t.h>
#include <jostle_telemetry_stats_t.h>
#include <jostle_timing_t.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CAP 70000

static void fingerprints_are_those_of_lcm_gen(void **state) {
    (void)state;
#define JSL_X(name, type, fingerprint)                                                             \
    assert_true((uint64_t)__jostle_##type##_get_hash() == (fingerprint));
    JSL_LCM_TYPES(JSL_X)
#undef JSL_X
}

static void the_embedded_schema_is_the_file(void **state) {
    (void)state;
    FILE *f = fopen("lcmtypes/jostle.lcm", "rb");
    if (!f) {
        print_message("skipped: run from the source folder to compare the schema's text\n");
        skip();
    }
    char *text = malloc(1 << 20);
    assert_non_null(text);
    size_t n = fread(text, 1, 1 << 20, f);
    fclose(f);
    assert_int_equal(n, jsl_schema_text_size);
    assert_memory_equal(text, jsl_schema_text, n);
    assert_int_equal(jsl_schema_text[n], 0);
    free(text);
}

/* Fills n elements with values that use all bytes. */
static uint64_t next_bits(uint64_t *seed) { return test_random(seed) >> 1; }
static int64_t *make_i64(uint64_t *seed, int n) {
    int64_t *v = malloc((size_t)(n ? n : 1) * sizeof *v);
    for (int i = 0; i < n; i++) v[i] = (int64_t)next_bits(seed) * (i & 1 ? -1 : 1);
    return v;
}
static int32_t *make_i32(uint64_t *seed, int n) {
    int32_t *v = malloc((size_t)(n ? n : 1) * sizeof *v);
    for (int i = 0; i < n; i++) v[i] = (int32_t)next_bits(seed);
    return v;
}
static float *make_f32(uint64_t *seed, int n) {
    float *v = malloc((size_t)(n ? n : 1) * sizeof *v);
    for (int i = 0; i < n; i++) v[i] = (float)test_uniform(seed, -1e6, 1e6);
    return v;
}
static const char *const words[] = {"", "a", "JOSTLE_PARTICLES", "phase with spaces", "\xc3\xa4"};
static char **make_words(int n) {
    char **v = malloc((size_t)(n ? n : 1) * sizeof *v);
    for (int i = 0; i < n; i++) v[i] = (char *)(uintptr_t)words[i % 5];
    return v;
}

/* Ours and lcm-gen's bytes are the same; each reads the other's; every shorter message is refused.
 */
#define CHECK_BOTH(TYPE, lcmtype, ours, theirs)                                                    \
    do {                                                                                           \
        uint8_t our_bytes_[CAP], their_bytes_[CAP];                                                \
        int64_t our_size_ = jsl_message_encode(JSL_LCM_##TYPE, ours, our_bytes_, CAP);             \
        int their_size_ = jostle_##lcmtype##_encode(their_bytes_, 0, CAP, theirs);                 \
        assert_true(our_size_ > 8);                                                                \
        assert_int_equal(our_size_, their_size_);                                                  \
        assert_int_equal(our_size_, jsl_message_size(JSL_LCM_##TYPE, ours));                       \
        assert_memory_equal(our_bytes_, their_bytes_, (size_t)our_size_);                          \
        jostle_##lcmtype decoded_;                                                                 \
        assert_int_equal(jostle_##lcmtype##_decode(our_bytes_, 0, (int)our_size_, &decoded_),      \
                         their_size_);                                                             \
        memset(their_bytes_, 0, sizeof their_bytes_);                                              \
        assert_int_equal(jostle_##lcmtype##_encode(their_bytes_, 0, CAP, &decoded_), their_size_); \
        assert_memory_equal(our_bytes_, their_bytes_, (size_t)our_size_);                          \
        jostle_##lcmtype##_decode_cleanup(&decoded_);                                              \
        check_decode(JSL_LCM_##TYPE, their_bytes_, our_size_);                                     \
    } while (0)

/* Decodes lcm-gen's bytes, encodes what came out, and compares; then every truncation. */
static void check_decode(jsl_lcm_type type, const uint8_t *bytes, int64_t n) {
    union {
        uint8_t raw[512];
        int64_t align;
    } message;
    uint8_t again[CAP];
    jsl_memory memory;
    jsl_arena arena;
    assert_ok(jsl_memory_init(&memory, (jsl_allocator){0}));
    jsl_arena_init(&arena, &memory);
    assert_ok(jsl_message_decode(type, bytes, n, &arena, message.raw));
    assert_int_equal(jsl_message_encode(type, message.raw, again, CAP), n);
    assert_memory_equal(again, bytes, (size_t)n);
    assert_true(jsl_message_sound(type, bytes, n));
    assert_int_equal(jsl_message_encode(type, message.raw, again, n - 1), -1);
    for (int64_t cut = 0; cut<n; cut += n> 3000 ? 37 : 1) {
        uint8_t *copy =
            malloc((size_t)cut + 1); /* the heap, so that sanitizers see reads past it */
        memcpy(copy, bytes, (size_t)cut);
        assert_int_not_equal(jsl_message_decode(type, copy, cut, &arena, message.raw), JSL_OK);
        free(copy);
        jsl_arena_reset(&arena);
    }
    jsl_arena_fini(&arena);
    assert_int_equal(memory.live_blocks, 0);
}

#define STAMP .wall_us = 0x0123456789abcdef, .session = 77, .step = 5, .sim_ns = 83333333

static void scenes_are_equal(void **state) {
    (void)state;
    for (int n = 0; n < 7; n += 3) {
        double value[7] = {1.5, -2, 3e300, 0, 5, 6, 7};
        char **name = make_words(n);
        jsl_msg_scene a = {STAMP,
                           .schema_version = 1,
                           .scene_rev = 2,
                           .name = "name",
                           .build = "",
                           .config_hash = -5,
                           .seed = 9,
                           .dt = 1.0 / 60,
                           .substeps = 4,
                           .gravity = {0, 0, -9.81},
                           .bounds_lo = {1, 2, 3},
                           .bounds_hi = {4, 5, 6},
                           .n_particles = 1,
                           .n_boids = 2,
                           .n_bodies = 3,
                           .n_params = n,
                           .param_name = (const char *const *)name,
                           .param_value = value,
                           .chunk_index = 0,
                           .chunk_count = 1};
        jostle_scene_t b = {STAMP,
                            .schema_version = 1,
                            .scene_rev = 2,
                            .name = (char[]){"name"},
                            .build = (char[]){""},
                            .config_hash = -5,
                            .seed = 9,
                            .dt = 1.0 / 60,
                            .substeps = 4,
                            .gravity = {0, 0, -9.81},
                            .bounds_lo = {1, 2, 3},
                            .bounds_hi = {4, 5, 6},
                            .n_particles = 1,
                            .n_boids = 2,
                            .n_bodies = 3,
                            .n_params = n,
                            .param_name = name,
                            .param_value = value,
                            .chunk_index = 0,
                            .chunk_count = 1};
        CHECK_BOTH(SCENE, scene_t, &a, &b);
        free(name);
    }
}

static void shape_and_body_tables_are_equal(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int n = 0; n < 40; n += 13) {
        int32_t *id = make_i32(&seed, n), *rgba = make_i32(&seed, n);
        int64_t *entity = make_i64(&seed, n);
        int8_t kind[40] = {0, 1, 2, 3, -1, 5};
        float *f = make_f32(&seed, 6 * n);
        jsl_msg_shapes a = {STAMP,       .scene_rev = 1,  .chunk_index = 2, .chunk_count = 3,
                            .n = n,      .shape_id = id,  .kind = kind,     .p0 = f,
                            .p1 = f + n, .p2 = f + 2 * n, .p3 = f + 3 * n};
        jostle_shape_table_t b = {STAMP,       .scene_rev = 1,  .chunk_index = 2, .chunk_count = 3,
                                  .n = n,      .shape_id = id,  .kind = kind,     .p0 = f,
                                  .p1 = f + n, .p2 = f + 2 * n, .p3 = f + 3 * n};
        CHECK_BOTH(SHAPES, shape_table_t, &a, &b);
        jsl_msg_body_info c = {STAMP,
                               .scene_rev = 1,
                               .chunk_index = 0,
                               .chunk_count = 1,
                               .n = n,
                               .id = entity,
                               .shape_id = id,
                               .mass = f,
                               .ixx = f + n,
                               .iyy = f + 2 * n,
                               .izz = f + 3 * n,
                               .friction = f + 4 * n,
                               .restitution = f + 5 * n,
                               .rgba = rgba};
        jostle_body_info_t d = {STAMP,
                                .scene_rev = 1,
                                .chunk_index = 0,
                                .chunk_count = 1,
                                .n = n,
                                .id = entity,
                                .shape_id = id,
                                .mass = f,
                                .ixx = f + n,
                                .iyy = f + 2 * n,
                                .izz = f + 3 * n,
                                .friction = f + 4 * n,
                                .restitution = f + 5 * n,
                                .rgba = rgba};
        CHECK_BOTH(BODY_INFO, body_info_t, &c, &d);
        free(id);
        free(rgba);
        free(entity);
        free(f);
    }
}

static void diagnostics_and_timing_are_equal(void **state) {
    (void)state;
    uint64_t seed = 2;
    jsl_msg_diag a = {STAMP,
                      .e_kinetic = 1.25,
                      .e_potential = -3,
                      .momentum = {1, 2, 3},
                      .ang_momentum = {4, 5, 6},
                      .com = {7, 8, 9},
                      .max_speed = 10,
                      .max_depth = 11,
                      .n_particles = 12,
                      .n_boids = 13,
                      .n_bodies = 14,
                      .n_awake = 15,
                      .n_contacts = 16,
                      .n_pairs = 17,
                      .n_islands = 18,
                      .n_nan = 19,
                      .state_hash = (int64_t)0xfedcba9876543210u};
    jostle_diag_t b = {STAMP,
                       .e_kinetic = 1.25,
                       .e_potential = -3,
                       .momentum = {1, 2, 3},
                       .ang_momentum = {4, 5, 6},
                       .com = {7, 8, 9},
                       .max_speed = 10,
                       .max_depth = 11,
                       .n_particles = 12,
                       .n_boids = 13,
                       .n_bodies = 14,
                       .n_awake = 15,
                       .n_contacts = 16,
                       .n_pairs = 17,
                       .n_islands = 18,
                       .n_nan = 19,
                       .state_hash = (int64_t)0xfedcba9876543210u};
    CHECK_BOTH(DIAG, diag_t, &a, &b);
    int64_t *ns = make_i64(&seed, 5);
    char **phase = make_words(5);
    jsl_msg_timing c = {STAMP,
                        .real_time_factor = 2.5,
                        .n_threads = 4,
                        .n = 5,
                        .phase = (const char *const *)phase,
                        .ns = ns};
    jostle_timing_t d = {STAMP,  .real_time_factor = 2.5, .n_threads = 4,
                         .n = 5, .phase = phase,          .ns = ns};
    CHECK_BOTH(TIMING, timing_t, &c, &d);
    free(ns);
    free(phase);
}

static void statistics_schema_and_index_are_equal(void **state) {
    (void)state;
    uint64_t seed = 3;
    const int n = 4;
    int64_t *v = make_i64(&seed, 7 * n);
    char **name = make_words(n);
    jsl_msg_stats a = {STAMP,
                       .n = n,
                       .channel = (const char *const *)name,
                       .frames_offered = v,
                       .frames_sent = v + n,
                       .frames_dropped_queue = v + 2 * n,
                       .frames_decimated = v + 3 * n,
                       .chunks_sent = v + 4 * n,
                       .send_errors = v + 5 * n,
                       .bytes_sent = v + 6 * n,
                       .log_events = 1,
                       .log_bytes = 2,
                       .log_dropped = 3,
                       .log_errors = 4,
                       .queue_bytes = 5,
                       .queue_bytes_max = 6,
                       .queue_bytes_peak = 7};
    jostle_telemetry_stats_t b = {STAMP,
                                  .n = n,
                                  .channel = name,
                                  .frames_offered = v,
                                  .frames_sent = v + n,
                                  .frames_dropped_queue = v + 2 * n,
                                  .frames_decimated = v + 3 * n,
                                  .chunks_sent = v + 4 * n,
                                  .send_errors = v + 5 * n,
                                  .bytes_sent = v + 6 * n,
                                  .log_events = 1,
                                  .log_bytes = 2,
                                  .log_dropped = 3,
                                  .log_errors = 4,
                                  .queue_bytes = 5,
                                  .queue_bytes_max = 6,
                                  .queue_bytes_peak = 7};
    CHECK_BOTH(STATS, telemetry_stats_t, &a, &b);
    jsl_msg_schema c = {STAMP,
                        .schema_version = 1,
                        .n = n,
                        .type_name = (const char *const *)name,
                        .fingerprint = v,
                        .source = jsl_schema_text};
    jostle_schema_t d = {STAMP,
                         .schema_version = 1,
                         .n = n,
                         .type_name = name,
                         .fingerprint = v,
                         .source = (char *)(uintptr_t)jsl_schema_text};
    CHECK_BOTH(SCHEMA, schema_t, &c, &d);
    int32_t *kind = make_i32(&seed, n);
    jsl_msg_index e = {STAMP,       .prev_index_offset = -1, .n = n,
                       .offset = v, .event_step = v + n,     .event_sim_ns = v + 2 * n,
                       .kind = kind};
    jostle_log_index_t f = {STAMP,       .prev_index_offset = -1, .n = n,
                            .offset = v, .event_step = v + n,     .event_sim_ns = v + 2 * n,
                            .kind = kind};
    CHECK_BOTH(INDEX, log_index_t, &e, &f);
    free(v);
    free(name);
    free(kind);
}

static void byte_blocks_are_equal(void **state) {
    (void)state;
    uint8_t data[1000];
    uint64_t seed = 4;
    for (int i = 0; i < 1000; i++) data[i] = (uint8_t)test_random(&seed);
    for (int n = 0; n <= 1000; n += 250) {
        jsl_msg_keyframe a = {
            STAMP,         .keyframe_seq = 3, .chunk_index = 1, .chunk_count = 4,
            .first = 1000, .total = 4000,     .state_hash = -1, .crc32c = (int32_t)0xdeadbeef,
            .nbytes = n,   .data = data};
        jostle_keyframe_t b = {
            STAMP,         .keyframe_seq = 3, .chunk_index = 1, .chunk_count = 4,
            .first = 1000, .total = 4000,     .state_hash = -1, .crc32c = (int32_t)0xdeadbeef,
            .nbytes = n,   .data = data};
        CHECK_BOTH(KEYFRAME, keyframe_t, &a, &b);
        jsl_msg_scene_text c = {STAMP,         .scene_rev = 1, .chunk_index = 1, .chunk_count = 4,
                                .first = 1000, .total = 4000,  .crc32c = 5,      .nbytes = n,
                                .data = data};
        jostle_scene_text_t d = {STAMP,         .scene_rev = 1, .chunk_index = 1, .chunk_count = 4,
                                 .first = 1000, .total = 4000,  .crc32c = 5,      .nbytes = n,
                                 .data = data};
        CHECK_BOTH(SCENE_TEXT, scene_text_t, &c, &d);
    }
}

/* -- state_t -------------------------------------------------------------------------------------
 */

#define ROWS 3000
typedef struct rows {
    jsl_real v[3][ROWS];
    float radius[ROWS];
    uint32_t rgba[ROWS];
    jsl_entity id[ROWS];
} rows;

static void fill(rows *r, jsl_state_segment segment[2]) {
    uint64_t seed = 6;
    for (int i = 0; i < ROWS; i++) {
        for (int k = 0; k < 3; k++) r->v[k][i] = (jsl_real)test_uniform(&seed, -20, 30);
        r->radius[i] = (float)test_uniform(&seed, 0, 1);
        r->rgba[i] = (uint32_t)test_random(&seed);
        r->id[i] = (jsl_entity){(uint32_t)i + 1, 0xabc00000u | (uint32_t)(i % 5)};
    }
    memset(segment, 0, 2 * sizeof *segment);
    segment[0].count = 1001;
    segment[1].count = ROWS - 1001;
    for (int s = 0; s < 2; s++) {
        int64_t at = s ? 1001 : 0;
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++) segment[s].data[c][k] = r->v[k] + at;
        segment[s].data[3][0] = r->radius + at;
        segment[s].data[4][0] = s ? NULL : r->rgba; /* the second table has no colour */
        segment[s].data[5][0] = r->id + at;
    }
}

static jsl_state_frame make_frame(const jsl_state_segment *segment) {
    jsl_state_frame f = {STAMP,
                         .frame_seq = 8,
                         .population = ROWS,
                         .stride = 1,
                         .scene_rev = 2,
                         .order_rev = 3,
                         .flags = JSL_STATE_IDS,
                         .total = ROWS,
                         .column_count = 7,
                         .segment = segment,
                         .segment_count = 2};
    f.column[0] = (jsl_state_column){JSL_FIELD_POS, JSL_ENC_U16Q, 3, JSL_SOURCE_REAL, {0}};
    f.column[1] = (jsl_state_column){JSL_FIELD_VEL, JSL_ENC_F16, 3, JSL_SOURCE_REAL, {0}};
    f.column[2] = (jsl_state_column){JSL_FIELD_ACCEL, JSL_ENC_F32, 3, JSL_SOURCE_REAL, {0}};
    f.column[3] = (jsl_state_column){JSL_FIELD_RADIUS, JSL_ENC_F16, 1, JSL_SOURCE_F32, {0}};
    f.column[4] = (jsl_state_column){JSL_FIELD_COLOR, JSL_ENC_U32, 1, JSL_SOURCE_U32, {0}};
    f.column[5] = (jsl_state_column){JSL_FIELD_ID, JSL_ENC_I64, 1, JSL_SOURCE_ENTITY, {0}};
    f.column[6] = (jsl_state_column){JSL_FIELD_QUAT, JSL_ENC_F32, 4, JSL_SOURCE_REAL, {0, 0, 0, 1}};
    return f;
}

/* lcm-gen reads a chunk of ours, writes the same bytes again, and every element is what the columns
 * hold. */
static void check_chunk(const rows *r, const uint8_t *a, int64_t size, int64_t first) {
    jostle_state_t m;
    uint8_t b[CAP];
    assert_int_equal(jostle_state_t_decode(a, 0, (int)size, &m), size);
    assert_int_equal(jostle_state_t_encode(b, 0, CAP, &m), size);
    assert_memory_equal(a, b, (size_t)size);
    assert_i64(m.first, first);
    assert_i64(m.total, ROWS);
    assert_int_equal(m.n_columns, 7);
    uint32_t crc = 0;
    for (int c = 0; c < m.n_columns; c++)
        crc = jsl_crc32c(crc, m.column[c].data, (size_t)m.column[c].nbytes);
    assert_int_equal((uint32_t)m.crc32c, crc);
    for (int32_t i = 0; i < m.n; i++) {
        int64_t row = first + i;
        for (int k = 0; k < 3; k++) {
            float x = (float)r->v[k][row], y;
            const jostle_column_t *c = &m.column[0];
            uint16_t code;
            memcpy(&code, c->data + 2 * (k * m.n + i), 2);
            /* half a step, and what float arithmetic loses over 65535 codes */
            assert_close((double)c->lo[k] + (double)c->step[k] * code, x,
                         (double)c->step[k] * 0.51 + 1e-5);
            memcpy(&code, m.column[1].data + 2 * (k * m.n + i), 2);
            assert_int_equal(code, jsl_f16_from_f32(x));
            memcpy(&y, m.column[2].data + 4 * (k * m.n + i), 4);
            assert_true(y == x);
        }
        uint32_t rgba, want = row < 1001 ? r->rgba[row] : 0;
        int64_t id;
        float quat[4];
        memcpy(&rgba, m.column[4].data + 4 * i, 4);
        memcpy(&id, m.column[5].data + 8 * i, 8);
        for (int k = 0; k < 4; k++) memcpy(&quat[k], m.column[6].data + 4 * (k * m.n + i), 4);
        assert_int_equal(rgba, want);
        assert_true((uint64_t)id == jsl_entity_id(r->id[row]));
        assert_true(quat[0] == 0 && quat[3] == 1);
    }
    jostle_state_t_decode_cleanup(&m);
}

static void state_chunks_are_what_lcm_gen_would_write(void **state) {
    (void)state;
    rows *r = malloc(sizeof *r);
    jsl_state_segment segment[2];
    fill(r, segment);
    jsl_state_frame f = make_frame(segment);
    const char *channel = "JOSTLE_PARTICLES";
    int64_t each = jsl_state_chunk_elements(&f, channel);
    int64_t count = jsl_state_chunk_count(&f, channel), seen = 0;
    assert_int_equal(each % JSL_LANES, 0);
    assert_true(count > 1);
    for (int64_t i = 0; i < count; i++) {
        uint8_t a[CAP];
        int64_t first = i * each, n = ROWS - first < each ? ROWS - first : each;
        int64_t size = jsl_state_encode(&f, (int32_t)i, (int32_t)count, first, n, a);
        assert_int_equal(size, jsl_state_size(&f, n));
        assert_true(size + (int64_t)strlen(channel) + 1 <= 65499);
        check_chunk(r, a, size, first);
        seen += n;
        jsl_state_chunk c;
        assert_ok(jsl_state_decode(a, size, true, &c));
        assert_true(c.crc_good && c.n == n && c.first == first && c.column_count == 7);
    }
    assert_i64(seen, ROWS);
    /* One more group of lanes would not fit. */
    assert_true(jsl_state_size(&f, each + JSL_LANES) + (int64_t)strlen(channel) + 1 > 65499);
    free(r);
}

static void component_columns_are_equal(void **state) {
    (void)state;
    for (int n = 0; n < 40; n += 13) {
        uint64_t seed = 3;
        const char *const field[] = {"kelvin", "owner", "tick"}, *const unit[] = {"K", "", "1"};
        int8_t type[] = {JSL_TYPE_F32, JSL_TYPE_ENTITY, JSL_TYPE_U16};
        uint8_t data[40 * 22];
        for (size_t i = 0; i < sizeof data; i++) data[i] = (uint8_t)next_bits(&seed);
        int32_t bytes = n * (8 + 4 + 8 + 2);
        jsl_msg_columns a = {STAMP,
                             .frame_seq = 9,
                             .chunk_index = 1,
                             .chunk_count = 3,
                             .first = 100,
                             .n = n,
                             .total = 1000,
                             .crc32c = (int32_t)jsl_crc32c(0, data, (size_t)bytes),
                             .component = "temperature",
                             .n_fields = 3,
                             .field = field,
                             .unit = unit,
                             .type = type,
                             .nbytes = bytes,
                             .data = data};
        jostle_columns_t b = {.wall_us = a.wall_us,
                              .session = a.session,
                              .step = a.step,
                              .sim_ns = a.sim_ns,
                              .frame_seq = 9,
                              .chunk_index = 1,
                              .chunk_count = 3,
                              .first = 100,
                              .n = n,
                              .total = 1000,
                              .crc32c = a.crc32c,
                              .component = (char *)(uintptr_t)a.component,
                              .n_fields = 3,
                              .field = (char **)(uintptr_t)field,
                              .unit = (char **)(uintptr_t)unit,
                              .type = type,
                              .nbytes = bytes,
                              .data = data};
        CHECK_BOTH(COLUMNS, columns_t, &a, &b);
    }
    assert_int_equal(JOSTLE_COLUMNS_T_COL_F32, JSL_TYPE_F32);
    assert_int_equal(JOSTLE_COLUMNS_T_COL_U64, JSL_TYPE_U64);
    assert_int_equal(JOSTLE_COLUMNS_T_COL_ID, JSL_TYPE_ENTITY);
}

static void damaged_state_chunks_are_refused_or_fail_their_checksum(void **state) {
    (void)state;
    rows *r = malloc(sizeof *r);
    jsl_state_segment segment[2];
    fill(r, segment);
    jsl_state_frame f = make_frame(segment);
    uint8_t a[CAP];
    jsl_state_chunk c;
    int64_t size = jsl_state_encode(&f, 0, 94, 0, 32, a);
    for (int64_t cut = 0; cut < size; cut++) {
        uint8_t *copy = malloc((size_t)cut + 1);
        memcpy(copy, a, (size_t)cut);
        assert_int_not_equal(jsl_state_decode(copy, cut, true, &c), JSL_OK);
        free(copy);
    }
    int64_t caught = 0;
    for (int64_t i = 0; i < size; i++) {
        a[i] ^= 0x40;
        caught += jsl_state_decode(a, size, true, &c) != JSL_OK || !c.crc_good;
        a[i] ^= 0x40;
    }
    /* What no check covers: the stamp and counters before the columns, and scales of the columns.
     */
    assert_true(caught >= size - JSL_STATE_HEAD - 7 * JSL_COLUMN_HEAD);
    free(r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fingerprints_are_those_of_lcm_gen),
        cmocka_unit_test(the_embedded_schema_is_the_file),
        cmocka_unit_test(scenes_are_equal),
        cmocka_unit_test(shape_and_body_tables_are_equal),
        cmocka_unit_test(diagnostics_and_timing_are_equal),
        cmocka_unit_test(statistics_schema_and_index_are_equal),
        cmocka_unit_test(byte_blocks_are_equal),
        cmocka_unit_test(component_columns_are_equal),
        cmocka_unit_test(state_chunks_are_what_lcm_gen_would_write),
        cmocka_unit_test(damaged_state_chunks_are_refused_or_fail_their_checksum),
    };
    return cmocka_run_group_tests_name("lcmgen", tests, NULL, NULL);
}
