/* SPDX-License-Identifier: MIT
 * log_component.c - frames of components as arrays, in the order of the file.
 */
#include "telemetry/component.h"
#include "telemetry/log_file.h"

static const uint8_t *chunk_data(const jsl_log_file *log, int32_t c) {
    return log->map + log->chunk.at[c].data;
}

/* Chunks that follow each other, agree on what they hold, and make up their total. The message of
 * the first goes to *first; its arrays live until the arena is reset. */
static bool check(jsl_log_file *log, const jsl_set *set, jsl_component_chunk *first) {
    int64_t seen = 0;
    for (int32_t c = set->head; c >= 0; c = log->chunk.at[c].next) {
        jsl_component_chunk chunk;
        if (jsl_component_decode(chunk_data(log, c), log->chunk.at[c].size, true, &log->arena,
                                 &chunk) != JSL_OK)
            return false;
        if (c == set->head) *first = chunk;
        if (chunk.m.first != seen || chunk.m.total != first->m.total ||
            !jsl_component_alike(&chunk.m, &first->m))
            return false;
        seen += chunk.m.n;
    }
    return set->head >= 0 && seen == first->m.total;
}

bool jsl_log_check_columns(jsl_log_file *log, const jsl_set *set) {
    jsl_component_chunk first;
    bool good = check(log, set, &first);
    jsl_arena_reset(&log->arena);
    return good;
}

/* Whether the frame is of that component; by any of its chunks, without gathering the others. */
static bool is_of(jsl_log_file *log, const jsl_set *set, const char *component) {
    jsl_log_event e;
    jsl_component_chunk chunk;
    bool same = jsl_log_at(log, set->offset, &e) &&
                jsl_component_decode(e.data, e.size, false, &log->arena, &chunk) == JSL_OK &&
                strcmp(chunk.m.component, component) == 0;
    jsl_arena_reset(&log->arena);
    return same;
}

/* Copies the columns of all chunks to arrays of the log; first is that of a set that was checked.
 */
static jsl_result fill(jsl_log_file *log, const jsl_set *set, const jsl_component_chunk *first,
                       jsl_log_columns *out) {
    int64_t total = first->m.total, bytes = 0;
    int64_t at[JSL_MAX_COMPONENT_FIELDS];
    for (int32_t f = 0; f < first->m.n_fields; f++) {
        at[f] = bytes;
        bytes += jsl_round_up(total * jsl_type_size((jsl_type)first->m.type[f]), JSL_ALIGN);
    }
    JSL_TRY(jsl_array_reserve(&log->memory, &log->column_bytes, bytes + 1));
    JSL_TRY(jsl_array_reserve(&log->memory, &log->column_id, total + 1));
    for (int32_t c = set->head; c >= 0; c = log->chunk.at[c].next) {
        jsl_component_chunk chunk;
        JSL_TRY(jsl_component_decode(chunk_data(log, c), log->chunk.at[c].size, false, &log->arena,
                                     &chunk));
        const uint8_t *from = chunk.m.data;
        if (chunk.m.n == 0) continue;
        memcpy(log->column_id.at + chunk.m.first, from, (size_t)chunk.m.n * 8);
        from += (int64_t)chunk.m.n * 8;
        for (int32_t f = 0; f < chunk.m.n_fields; f++) {
            int64_t size = jsl_type_size((jsl_type)chunk.m.type[f]);
            memcpy(log->column_bytes.at + at[f] + chunk.m.first * size, from,
                   (size_t)(chunk.m.n * size));
            from += chunk.m.n * size;
        }
    }
    for (int32_t f = 0; f < first->m.n_fields; f++)
        log->column[f] = (jsl_log_column){first->m.field[f], first->m.unit[f],
                                          (jsl_type)first->m.type[f], log->column_bytes.at + at[f]};
    *out = (jsl_log_columns){.time = (double)set->sim_ns * 1e-9,
                             .step = set->step,
                             .session = set->session,
                             .component = first->m.component,
                             .count = total,
                             .id = log->column_id.at,
                             .field_count = first->m.n_fields,
                             .field = log->column};
    return JSL_OK;
}

jsl_result jsl_log_next_columns(jsl_log_file *log, const char *component, jsl_log_columns *out) {
    if (!log || !out) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_log_list(log, true, NULL));
    while (log->next_columns < log->set.count) {
        jsl_set *set = &log->set.at[log->next_columns++];
        if (set->kind != JSL_SET_COLUMNS || set->bad) continue;
        if (component && !is_of(log, set, component)) continue;
        jsl_result r = jsl_log_gather(log, set);
        if (r == JSL_ERR_MEMORY) return r;
        jsl_component_chunk first;
        set->bad = r != JSL_OK || !check(log, set, &first);
        if (!set->bad) {
            r = fill(log, set, &first, out);
            jsl_arena_reset(&log->arena);
            return r;
        }
        jsl_arena_reset(&log->arena);
    }
    return JSL_ERR_END;
}
