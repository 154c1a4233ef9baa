/* SPDX-License-Identifier: MIT
 * message.c - small messages to bytes and back, by table.
 */
#include "telemetry/message.h"

typedef enum wire_type { WIRE_i8, WIRE_i32, WIRE_i64, WIRE_f32, WIRE_f64, WIRE_str } wire_type;
typedef enum wire_shape { ONE, FIXED, COUNTED, BYTES } wire_shape;
typedef struct wire_field {
    uint8_t type, shape;
    uint16_t offset; /* of the member in the struct */
    uint16_t count;  /* FIXED: elements. COUNTED, BYTES: offset of the int32 member that counts */
} wire_field;

#define ROW_F(type, name) {WIRE_##type, ONE, offsetof(MESSAGE, name), 1},
#define ROW_A(type, name, size) {WIRE_##type, FIXED, offsetof(MESSAGE, name), size},
#define ROW_V(type, name, size)                                                                    \
    {WIRE_##type, COUNTED, offsetof(MESSAGE, name), offsetof(MESSAGE, size)},
#define ROW_B(name, size) {WIRE_i8, BYTES, offsetof(MESSAGE, name), offsetof(MESSAGE, size)},
#define ROWS(NAME) JSL_MSG_##NAME(ROW_F, ROW_A, ROW_V, ROW_B)

#define MESSAGE jsl_msg_scene
static const wire_field scene_fields[] = {ROWS(SCENE)};
#undef MESSAGE
#define MESSAGE jsl_msg_shapes
static const wire_field shapes_fields[] = {ROWS(SHAPES)};
#undef MESSAGE
#define MESSAGE jsl_msg_body_info
static const wire_field body_info_fields[] = {ROWS(BODY_INFO)};
#undef MESSAGE
#define MESSAGE jsl_msg_diag
static const wire_field diag_fields[] = {ROWS(DIAG)};
#undef MESSAGE
#define MESSAGE jsl_msg_timing
static const wire_field timing_fields[] = {ROWS(TIMING)};
#undef MESSAGE
#define MESSAGE jsl_msg_stats
static const wire_field stats_fields[] = {ROWS(STATS)};
#undef MESSAGE
#define MESSAGE jsl_msg_schema
static const wire_field schema_fields[] = {ROWS(SCHEMA)};
#undef MESSAGE
#define MESSAGE jsl_msg_index
static const wire_field index_fields[] = {ROWS(INDEX)};
#undef MESSAGE
#define MESSAGE jsl_msg_keyframe
static const wire_field keyframe_fields[] = {ROWS(KEYFRAME)};
#undef MESSAGE
#define MESSAGE jsl_msg_scene_text
static const wire_field scene_text_fields[] = {ROWS(SCENE_TEXT)};
#undef MESSAGE
#define MESSAGE jsl_msg_columns
static const wire_field columns_fields[] = {ROWS(COLUMNS)};
#undef MESSAGE

typedef struct wire_message {
    const wire_field *field;
    int count;
} wire_message;
#define TABLE(fields)                                                                              \
    { fields, JSL_COUNT(fields) }
static const wire_message messages[JSL_LCM_COUNT] = {
    [JSL_LCM_SCENE] = TABLE(scene_fields),         [JSL_LCM_SHAPES] = TABLE(shapes_fields),
    [JSL_LCM_BODY_INFO] = TABLE(body_info_fields), [JSL_LCM_DIAG] = TABLE(diag_fields),
    [JSL_LCM_TIMING] = TABLE(timing_fields),       [JSL_LCM_STATS] = TABLE(stats_fields),
    [JSL_LCM_SCHEMA] = TABLE(schema_fields),       [JSL_LCM_INDEX] = TABLE(index_fields),
    [JSL_LCM_KEYFRAME] = TABLE(keyframe_fields),   [JSL_LCM_SCENE_TEXT] = TABLE(scene_text_fields),
    [JSL_LCM_COLUMNS] = TABLE(columns_fields),
};
static const int wire_size[] = {1, 4, 8, 4, 8, 0};
static const int member_size[] = {1, 4, 8, 4, 8, sizeof(char *)};

static const struct {
    const char *name;
    uint64_t fingerprint;
} types[JSL_LCM_COUNT] = {
#define JSL_X(name, type, fingerprint) {#type, fingerprint},
    JSL_LCM_TYPES(JSL_X)
#undef JSL_X
};

const char *jsl_lcm_type_name(jsl_lcm_type type) {
    return type < JSL_LCM_COUNT ? types[type].name : NULL;
}

uint64_t jsl_lcm_fingerprint(jsl_lcm_type type) {
    return type < JSL_LCM_COUNT ? types[type].fingerprint : 0;
}

jsl_lcm_type jsl_lcm_type_of(const uint8_t *data, int64_t size) {
    if (size < 8) return JSL_LCM_COUNT;
    uint64_t fingerprint = jsl_get_u64(data);
    for (int i = 0; i < JSL_LCM_COUNT; i++)
        if (types[i].fingerprint == fingerprint) return (jsl_lcm_type)i;
    return JSL_LCM_COUNT;
}

/* -- Encoding
 * --------------------------------------------------------------------------------------- */

static int64_t count_of(const wire_field *f, const uint8_t *message) {
    if (f->shape == ONE || f->shape == FIXED) return f->count;
    int32_t n;
    memcpy(&n, message + f->count, sizeof n);
    return n < 0 ? 0 : n;
}

/* Where the elements of a field are. */
static const uint8_t *elements_of(const wire_field *f, const uint8_t *message) {
    if (f->shape == ONE || f->shape == FIXED) return message + f->offset;
    const uint8_t *p;
    memcpy(&p, message + f->offset, sizeof p);
    return p;
}

static const char *string_at(const uint8_t *element) {
    const char *s;
    memcpy(&s, element, sizeof s);
    return s ? s : "";
}

int64_t jsl_message_size(jsl_lcm_type type, const void *message) {
    int64_t size = 8;
    for (int i = 0; i < messages[type].count; i++) {
        const wire_field *f = &messages[type].field[i];
        int64_t n = count_of(f, message);
        size += n * wire_size[f->type];
        const uint8_t *p = elements_of(f, message);
        for (int64_t k = 0; f->type == WIRE_str && k < n; k++)
            size += 5 + (int64_t)strlen(string_at(p + (size_t)k * sizeof(char *)));
    }
    return size;
}

static uint8_t *put_elements(uint8_t *out, wire_type type, const uint8_t *p, int64_t n) {
    switch (type) {
    case WIRE_i8:
        if (n) memcpy(out, p, (size_t)n);
        return out + n;
    case WIRE_i32:
    case WIRE_f32:
        for (int64_t k = 0; k < n; k++, out += 4, p += 4) {
            uint32_t v;
            memcpy(&v, p, 4);
            jsl_put_u32(out, v);
        }
        return out;
    case WIRE_i64:
    case WIRE_f64:
        for (int64_t k = 0; k < n; k++, out += 8, p += 8) {
            uint64_t v;
            memcpy(&v, p, 8);
            jsl_put_u64(out, v);
        }
        return out;
    case WIRE_str:
        for (int64_t k = 0; k < n; k++, p += sizeof(char *)) {
            const char *s = string_at(p);
            size_t length = strlen(s) + 1;
            jsl_put_u32(out, (uint32_t)length);
            memcpy(out + 4, s, length);
            out += 4 + length;
        }
        return out;
    }
    return out;
}

int64_t jsl_message_encode(jsl_lcm_type type, const void *message, uint8_t *out, int64_t cap) {
    JSL_ASSERT(messages[type].count > 0);
    int64_t size = jsl_message_size(type, message);
    if (size > cap) return -1;
    jsl_put_u64(out, types[type].fingerprint);
    uint8_t *at = out + 8;
    for (int i = 0; i < messages[type].count; i++) {
        const wire_field *f = &messages[type].field[i];
        at = put_elements(at, (wire_type)f->type, elements_of(f, message), count_of(f, message));
    }
    JSL_ASSERT(at == out + size);
    return size;
}

/* -- Decoding
 * --------------------------------------------------------------------------------------- */

typedef struct cursor {
    const uint8_t *at, *end;
} cursor;

/* A string of the message, in place; null when it is not sound. */
static const char *take_string(cursor *in) {
    if (in->end - in->at < 4) return NULL;
    uint32_t length = jsl_get_u32(in->at);
    if (length < 1 || length > (uint64_t)(in->end - in->at - 4)) return NULL;
    const uint8_t *s = in->at + 4;
    if (memchr(s, 0, length) != s + length - 1) return NULL;
    in->at = s + length;
    return (const char *)s;
}

static bool take_elements(cursor *in, wire_type type, uint8_t *to, int64_t n) {
    if (n > (in->end - in->at) / (wire_size[type] ? wire_size[type] : 5)) return false;
    for (int64_t k = 0; k < n; k++, to += member_size[type], in->at += wire_size[type]) {
        if (type == WIRE_str) {
            const char *s = take_string(in);
            if (!s) return false;
            memcpy(to, &s, sizeof s);
        } else if (wire_size[type] == 1) {
            *to = *in->at;
        } else if (wire_size[type] == 4) {
            uint32_t v = jsl_get_u32(in->at);
            memcpy(to, &v, 4);
        } else {
            uint64_t v = jsl_get_u64(in->at);
            memcpy(to, &v, 8);
        }
    }
    return true;
}

static bool skip_elements(cursor *in, wire_type type, int64_t n) {
    if (n > (in->end - in->at) / (wire_size[type] ? wire_size[type] : 5)) return false;
    for (int64_t k = 0; type == WIRE_str && k < n; k++)
        if (!take_string(in)) return false;
    in->at += n * wire_size[type];
    return true;
}

/* Counts that a skipped message holds: a COUNTED field needs the value of an earlier one. */
typedef union counts {
    uint8_t message[512];
    int64_t align;
} counts;
_Static_assert(sizeof(jsl_msg_scene) <= 512 && sizeof(jsl_msg_diag) <= 512 &&
                   sizeof(jsl_msg_stats) <= 512,
               "counts must hold every message");

static jsl_result decode(jsl_lcm_type type, const uint8_t *data, int64_t size, jsl_arena *arena,
                         uint8_t *message) {
    if (jsl_lcm_type_of(data, size) != type || !messages[type].count) return JSL_ERR_VERSION;
    cursor in = {data + 8, data + size};
    for (int i = 0; i < messages[type].count; i++) {
        const wire_field *f = &messages[type].field[i];
        int32_t n = f->count;
        if (f->shape == COUNTED || f->shape == BYTES) memcpy(&n, message + f->count, sizeof n);
        if (n < 0) return JSL_ERR_FORMAT;
        if (f->shape == ONE || f->shape == FIXED) {
            if (!take_elements(&in, (wire_type)f->type, message + f->offset, n))
                return JSL_ERR_FORMAT;
        } else if (f->shape == BYTES || !arena) {
            const uint8_t *p = in.at;
            if (!skip_elements(&in, (wire_type)f->type, n)) return JSL_ERR_FORMAT;
            memcpy(message + f->offset, &p, sizeof p);
        } else {
            cursor probe = in; /* the count is verified before it is allocated for */
            if (!skip_elements(&probe, (wire_type)f->type, n)) return JSL_ERR_FORMAT;
            uint8_t *to = jsl_arena_alloc(arena, (int64_t)n * member_size[f->type]);
            if (!to) return JSL_ERR_MEMORY;
            take_elements(&in, (wire_type)f->type, to, n);
            memcpy(message + f->offset, &to, sizeof to);
        }
    }
    return in.at == in.end ? JSL_OK : JSL_ERR_FORMAT;
}

jsl_result jsl_message_decode(jsl_lcm_type type, const uint8_t *data, int64_t size,
                              jsl_arena *arena, void *message) {
    return decode(type, data, size, arena, message);
}

bool jsl_message_sound(jsl_lcm_type type, const uint8_t *data, int64_t size) {
    counts scratch;
    return decode(type, data, size, NULL, scratch.message) == JSL_OK;
}
