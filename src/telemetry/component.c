/* SPDX-License-Identifier: MIT
 * component.c - reading one chunk of a component's columns.
 */
#include "telemetry/component.h"

jsl_type jsl_wire_type(jsl_type type) {
    if (type != JSL_TYPE_REAL) return type;
    return sizeof(jsl_real) == sizeof(float) ? JSL_TYPE_F32 : JSL_TYPE_F64;
}

#define NAME_MAX_BYTES 31
/* As the ECS takes them: they become column headings and file names. */
static bool name_is_good(const char *name) {
    size_t n = strnlen(name, NAME_MAX_BYTES + 1);
    if (n == 0 || n > NAME_MAX_BYTES) return false;
    for (size_t i = 0; i < n; i++) {
        char c = name[i];
        bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        bool inner = (c >= '0' && c <= '9') || c == '_';
        if (!letter && !(inner && i > 0)) return false;
    }
    return true;
}

static bool counts_are_good(const jsl_msg_columns *m) {
    return m->n >= 0 && m->n_fields >= 0 && m->n_fields <= JSL_MAX_COMPONENT_FIELDS &&
           m->chunk_count >= 1 && m->chunk_index >= 0 && m->chunk_index < m->chunk_count &&
           m->first >= 0 && m->total >= 0 && m->first <= m->total && m->n <= m->total - m->first;
}

jsl_result jsl_component_decode(const uint8_t *data, int64_t size, bool check_crc, jsl_arena *arena,
                                jsl_component_chunk *out) {
    JSL_TRY(jsl_message_decode(JSL_LCM_COLUMNS, data, size, arena, &out->m));
    const jsl_msg_columns *m = &out->m;
    if (!counts_are_good(m) || !name_is_good(m->component)) return JSL_ERR_FORMAT;
    out->row_bytes = 8;
    for (int32_t f = 0; f < m->n_fields; f++) {
        if (m->type[f] < JSL_TYPE_F32 || m->type[f] > JSL_TYPE_ENTITY) return JSL_ERR_FORMAT;
        if (!name_is_good(m->field[f]) || strnlen(m->unit[f], NAME_MAX_BYTES + 1) > NAME_MAX_BYTES)
            return JSL_ERR_FORMAT;
        out->row_bytes += jsl_type_size((jsl_type)m->type[f]);
    }
    if (m->nbytes != m->n * out->row_bytes) return JSL_ERR_FORMAT;
    if (check_crc && jsl_crc32c(0, m->data, (size_t)m->nbytes) != (uint32_t)m->crc32c)
        return JSL_ERR_FORMAT;
    return JSL_OK;
}

bool jsl_component_alike(const jsl_msg_columns *a, const jsl_msg_columns *b) {
    if (a->n_fields != b->n_fields || strcmp(a->component, b->component) != 0) return false;
    for (int32_t f = 0; f < a->n_fields; f++)
        if (a->type[f] != b->type[f] || strcmp(a->field[f], b->field[f]) != 0 ||
            strcmp(a->unit[f], b->unit[f]) != 0)
            return false;
    return true;
}
