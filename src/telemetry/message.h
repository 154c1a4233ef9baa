/* SPDX-License-Identifier: MIT
 * The messages of lcmtypes/jostle.lcm as C structs, written and read without lcm-gen's code.
 * Floor 6.
 *
 * One list of fields per message makes its struct and the table that encodes and decodes it. An
 * encoded message is the fingerprint of its type and then its fields, big-endian, in order; strings
 * are an int32 length that counts the closing NUL, and the bytes. (LCM:
 * docs/content/lcm-type-ref.md.)
 */
#ifndef JSL_TELEMETRY_MESSAGE_H
#define JSL_TELEMETRY_MESSAGE_H

#include "base/base.h"

#define JSL_SCHEMA_VERSION 2

/* X(NAME, lcm type, fingerprint): a test compares the fingerprints with lcm-gen's. */
#define JSL_LCM_TYPES(X)                                                                           \
    X(SCENE, scene_t, 0xfcb0bd815af1dedaull)                                                       \
    X(SHAPES, shape_table_t, 0x09af77b7ec492c58ull)                                                \
    X(BODY_INFO, body_info_t, 0xf03b30026e939606ull)                                               \
    X(COLUMN, column_t, 0x7e7157e7ffdf55b1ull)                                                     \
    X(STATE, state_t, 0x598ca537eb5e86c5ull)                                                       \
    X(CONTACTS, contacts_t, 0x81550d678f82a9ebull)                                                 \
    X(DIAG, diag_t, 0x25ea6b75497f381dull)                                                         \
    X(TIMING, timing_t, 0xf367f8aa319f3e2eull)                                                     \
    X(STATS, telemetry_stats_t, 0x6f5cd8bf9a06161full)                                             \
    X(COMMAND, command_t, 0x2e17dbb17aa1ea28ull)                                                   \
    X(REPLY, reply_t, 0x955ca75c15309463ull)                                                       \
    X(SCHEMA, schema_t, 0xce865384f1e82e6bull)                                                     \
    X(INDEX, log_index_t, 0x4ff1fa484ed1458aull)                                                   \
    X(PROBE, probe_t, 0x8a99dac7f57b51ffull)                                                       \
    X(KEYFRAME, keyframe_t, 0xeabeb365bf91a9a0ull)                                                 \
    X(SCENE_TEXT, scene_text_t, 0xe94b279abf0e1879ull)                                             \
    X(COLUMNS, columns_t, 0xe99f8a6f57109f18ull)

typedef enum jsl_lcm_type {
#define JSL_X(name, type, fingerprint) JSL_LCM_##name,
    JSL_LCM_TYPES(JSL_X)
#undef JSL_X
        JSL_LCM_COUNT
} jsl_lcm_type;
/* "scene_t" and so on. */
const char *jsl_lcm_type_name(jsl_lcm_type type);
uint64_t jsl_lcm_fingerprint(jsl_lcm_type type);
/* The type whose fingerprint the first 8 bytes are; JSL_LCM_COUNT for a stranger or when size < 8.
 */
jsl_lcm_type jsl_lcm_type_of(const uint8_t *data, int64_t size);

/* -- Big-endian scalars -------------------------------------------------------------------------
 */

static inline uint32_t jsl_get_u32(const uint8_t *p) {
    uint32_t v;
    memcpy(&v, p, 4);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    v = __builtin_bswap32(v);
#endif
    return v;
}
static inline uint64_t jsl_get_u64(const uint8_t *p) {
    return (uint64_t)jsl_get_u32(p) << 32 | jsl_get_u32(p + 4);
}
static inline void jsl_put_u32(uint8_t *p, uint32_t v) {
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    v = __builtin_bswap32(v);
#endif
    memcpy(p, &v, 4);
}
static inline void jsl_put_u64(uint8_t *p, uint64_t v) {
    jsl_put_u32(p, (uint32_t)(v >> 32));
    jsl_put_u32(p + 4, (uint32_t)v);
}

/* -- Small messages -------------------------------------------------------------------------------
 */

/* F(type, name) one value, A(type, name, n) a fixed array, V(type, name, count) as many as that
 * member says, B(name, count) bytes. */
#define JSL_STAMP_(F, A, V, B) F(i64, wall_us) F(i64, session) F(i64, step) F(i64, sim_ns)
#define JSL_MSG_SCENE(F, A, V, B)                                                                  \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i32, schema_version)                                                                         \
    F(i32, scene_rev)                                                                              \
    F(str, name)                                                                                   \
    F(str, build)                                                                                  \
    F(i64, config_hash)                                                                            \
    F(i64, seed)                                                                                   \
    F(f64, dt)                                                                                     \
    F(i32, substeps)                                                                               \
    A(f64, gravity, 3)                                                                             \
    A(f64, bounds_lo, 3)                                                                           \
    A(f64, bounds_hi, 3)                                                                           \
    F(i64, n_particles)                                                                            \
    F(i64, n_boids)                                                                                \
    F(i64, n_bodies)                                                                               \
    F(i32, n_params)                                                                               \
    V(str, param_name, n_params)                                                                   \
    V(f64, param_value, n_params)                                                                  \
    F(i32, chunk_index)                                                                            \
    F(i32, chunk_count)
#define JSL_MSG_SHAPES(F, A, V, B)                                                                 \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i32, scene_rev)                                                                              \
    F(i32, chunk_index)                                                                            \
    F(i32, chunk_count)                                                                            \
    F(i32, n)                                                                                      \
    V(i32, shape_id, n)                                                                            \
    V(i8, kind, n)                                                                                 \
    V(f32, p0, n)                                                                                  \
    V(f32, p1, n)                                                                                  \
    V(f32, p2, n)                                                                                  \
    V(f32, p3, n)
#define JSL_MSG_BODY_INFO(F, A, V, B)                                                              \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i32, scene_rev)                                                                              \
    F(i32, chunk_index)                                                                            \
    F(i32, chunk_count)                                                                            \
    F(i32, n)                                                                                      \
    V(i64, id, n)                                                                                  \
    V(i32, shape_id, n)                                                                            \
    V(f32, mass, n)                                                                                \
    V(f32, ixx, n)                                                                                 \
    V(f32, iyy, n)                                                                                 \
    V(f32, izz, n)                                                                                 \
    V(f32, friction, n)                                                                            \
    V(f32, restitution, n)                                                                         \
    V(i32, rgba, n)
#define JSL_MSG_DIAG(F, A, V, B)                                                                   \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(f64, e_kinetic)                                                                              \
    F(f64, e_potential)                                                                            \
    F(f64, e_dissipated)                                                                           \
    F(f64, e_input)                                                                                \
    A(f64, momentum, 3)                                                                            \
    A(f64, ang_momentum, 3)                                                                        \
    A(f64, com, 3)                                                                                 \
    F(f64, max_speed)                                                                              \
    F(f64, max_depth)                                                                              \
    F(f64, solver_residual)                                                                        \
    F(i64, n_particles)                                                                            \
    F(i64, n_boids)                                                                                \
    F(i64, n_bodies)                                                                               \
    F(i64, n_awake)                                                                                \
    F(i64, n_contacts)                                                                             \
    F(i64, n_pairs)                                                                                \
    F(i64, n_islands)                                                                              \
    F(i64, n_nan)                                                                                  \
    F(i64, state_hash)
#define JSL_MSG_TIMING(F, A, V, B)                                                                 \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(f64, real_time_factor) F(i32, n_threads) F(i32, n) V(str, phase, n) V(i64, ns, n)
#define JSL_MSG_STATS(F, A, V, B)                                                                  \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i32, n)                                                                                      \
    V(str, channel, n)                                                                             \
    V(i64, frames_offered, n)                                                                      \
    V(i64, frames_sent, n)                                                                         \
    V(i64, frames_dropped_queue, n)                                                                \
    V(i64, frames_decimated, n)                                                                    \
    V(i64, chunks_sent, n)                                                                         \
    V(i64, send_errors, n)                                                                         \
    V(i64, bytes_sent, n)                                                                          \
    F(i64, log_events)                                                                             \
    F(i64, log_bytes)                                                                              \
    F(i64, log_dropped)                                                                            \
    F(i64, log_errors)                                                                             \
    F(i64, queue_bytes)                                                                            \
    F(i64, queue_bytes_max)                                                                        \
    F(i64, queue_bytes_peak)
#define JSL_MSG_SCHEMA(F, A, V, B)                                                                 \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i32, schema_version) F(i32, n) V(str, type_name, n) V(i64, fingerprint, n) F(str, source)
#define JSL_MSG_INDEX(F, A, V, B)                                                                  \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i64, prev_index_offset)                                                                      \
    F(i32, n)                                                                                      \
    V(i64, offset, n)                                                                              \
    V(i64, event_step, n)                                                                          \
    V(i64, event_sim_ns, n)                                                                        \
    V(i32, kind, n)
#define JSL_MSG_KEYFRAME(F, A, V, B)                                                               \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i64, keyframe_seq)                                                                           \
    F(i32, chunk_index)                                                                            \
    F(i32, chunk_count)                                                                            \
    F(i64, first)                                                                                  \
    F(i64, total)                                                                                  \
    F(i64, state_hash)                                                                             \
    F(i32, crc32c)                                                                                 \
    F(i32, nbytes)                                                                                 \
    B(data, nbytes)
#define JSL_MSG_SCENE_TEXT(F, A, V, B)                                                             \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i32, scene_rev)                                                                              \
    F(i32, chunk_index)                                                                            \
    F(i32, chunk_count)                                                                            \
    F(i64, first)                                                                                  \
    F(i64, total)                                                                                  \
    F(i32, crc32c)                                                                                 \
    F(i32, nbytes)                                                                                 \
    B(data, nbytes)
#define JSL_MSG_COLUMNS(F, A, V, B)                                                                \
    JSL_STAMP_(F, A, V, B)                                                                         \
    F(i64, frame_seq)                                                                              \
    F(i32, chunk_index)                                                                            \
    F(i32, chunk_count)                                                                            \
    F(i64, first)                                                                                  \
    F(i32, n)                                                                                      \
    F(i64, total)                                                                                  \
    F(i32, crc32c)                                                                                 \
    F(str, component)                                                                              \
    F(i32, n_fields)                                                                               \
    V(str, field, n_fields)                                                                        \
    V(str, unit, n_fields)                                                                         \
    V(i8, type, n_fields)                                                                          \
    F(i32, nbytes)                                                                                 \
    B(data, nbytes)

/* X(NAME, struct): what the tables are made for. */
#define JSL_SMALL_MESSAGES(X)                                                                      \
    X(SCENE, jsl_msg_scene)                                                                        \
    X(SHAPES, jsl_msg_shapes)                                                                      \
    X(BODY_INFO, jsl_msg_body_info)                                                                \
    X(DIAG, jsl_msg_diag)                                                                          \
    X(TIMING, jsl_msg_timing)                                                                      \
    X(STATS, jsl_msg_stats)                                                                        \
    X(SCHEMA, jsl_msg_schema)                                                                      \
    X(INDEX, jsl_msg_index)                                                                        \
    X(KEYFRAME, jsl_msg_keyframe)                                                                  \
    X(SCENE_TEXT, jsl_msg_scene_text)                                                              \
    X(COLUMNS, jsl_msg_columns)

typedef int8_t jsl_wire_i8;
typedef int32_t jsl_wire_i32;
typedef int64_t jsl_wire_i64;
typedef float jsl_wire_f32;
typedef double jsl_wire_f64;
typedef const char *jsl_wire_str;
#define JSL_MEMBER_F_(type, name) jsl_wire_##type name;
#define JSL_MEMBER_A_(type, name, size) jsl_wire_##type name[size];
#define JSL_MEMBER_V_(type, name, size) const jsl_wire_##type *name;
#define JSL_MEMBER_B_(name, size) const uint8_t *name;
#define JSL_X(NAME, type)                                                                          \
    typedef struct type {                                                                          \
        JSL_MSG_##NAME(JSL_MEMBER_F_, JSL_MEMBER_A_, JSL_MEMBER_V_, JSL_MEMBER_B_)                 \
    } type;
JSL_SMALL_MESSAGES(JSL_X)
#undef JSL_X

/* Bytes that the encoded message takes. `message` is the struct of that type (not STATE, COLUMN).
 * Null strings count as "". */
int64_t jsl_message_size(jsl_lcm_type type, const void *message);
/* Writes it to out, which has room for cap bytes; its size, or -1 when it does not fit. */
int64_t jsl_message_encode(jsl_lcm_type type, const void *message, uint8_t *out, int64_t cap);
/* Reads any bytes. JSL_ERR_VERSION when the fingerprint is another type's, JSL_ERR_FORMAT unless
 * the message is exactly `size` long and every count and string in it is sound. Arrays come from
 * the arena, strings and bytes stay in data. */
jsl_result jsl_message_decode(jsl_lcm_type type, const uint8_t *data, int64_t size,
                              jsl_arena *arena, void *message);
/* Whether the bytes would decode; needs no memory. */
bool jsl_message_sound(jsl_lcm_type type, const uint8_t *data, int64_t size);

#endif
