/* SPDX-License-Identifier: MIT
 * log_file.c - a mapped event log, event by event, whatever its bytes are.
 *
 * An event is believed when its sync word, sizes and end are right: it ends where the file ends or
 * where the next sync word begins, or, before damage, when it is one of our own messages and its
 * bytes are sound. Otherwise the search goes on one byte later: LCM's own reader takes the next
 * sync word from wherever it stopped, and so loses what a wrong length covers.
 */
#include "telemetry/log_file.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static const uint8_t sync_bytes[4] = {0xed, 0xa1, 0xda, 0x01};

/* -- Opening
 * ------------------------------------------------------------------------------------------ */

static jsl_result map_file(jsl_log_file *log, const char *path) {
    log->file = open(path, O_RDONLY | O_CLOEXEC);
    struct stat st;
    if (log->file < 0 || fstat(log->file, &st) != 0)
        return jsl_fail(&log->logger, JSL_ERR_IO, "log '%s' cannot be read: %s", path,
                        strerror(errno));
    if (!S_ISREG(st.st_mode))
        return jsl_fail(&log->logger, JSL_ERR_IO, "log '%s' is not a regular file", path);
    log->size = (int64_t)st.st_size;
    if (log->size == 0) return JSL_OK;
    void *map = mmap(NULL, (size_t)log->size, PROT_READ, MAP_PRIVATE, log->file, 0);
    if (map == MAP_FAILED)
        return jsl_fail(&log->logger, JSL_ERR_IO, "log '%s' cannot be mapped: %s", path,
                        strerror(errno));
    log->map = map;
    return JSL_OK;
}

jsl_result jsl_log_open(const char *path, const jsl_logger *logger, jsl_log_file **out) {
    if (!path || !out) return JSL_ERR_ARGUMENT;
    *out = NULL;
    jsl_memory memory;
    JSL_TRY(jsl_memory_init(&memory, (jsl_allocator){0}));
    jsl_log_file *log = jsl_alloc_zero(&memory, sizeof *log);
    if (!log) return JSL_ERR_MEMORY;
    log->memory = memory;
    log->file = -1;
    if (logger) log->logger = *logger;
    jsl_arena_init(&log->arena, &log->memory);
    jsl_log_forget(log);
    jsl_result r = map_file(log, path);
    if (r == JSL_OK)
        *out = log;
    else
        jsl_log_close(log);
    return r;
}

void jsl_log_close(jsl_log_file *log) {
    if (!log) return;
    if (log->map) munmap((void *)(uintptr_t)log->map, (size_t)log->size);
    if (log->file >= 0) close(log->file);
    jsl_arena_fini(&log->arena);
    jsl_memory *m = &log->memory;
    jsl_array_free(m, &log->set);
    jsl_array_free(m, &log->chunk);
    jsl_array_free(m, &log->instant);
    jsl_array_free(m, &log->session);
    for (int k = 0; k < JSL_FRAME_KINDS; k++) {
        jsl_array_free(m, &log->value[k]);
        jsl_array_free(m, &log->rgba[k]);
    }
    jsl_array_free(m, &log->body_shape);
    for (int k = 0; k < JSL_FRAME_KINDS; k++) jsl_array_free(m, &log->id[k].at);
    jsl_array_free(m, &log->column_bytes);
    jsl_array_free(m, &log->column_id);
    jsl_array_free(m, &log->shape);
    jsl_map_free(m, &log->shape_map);
    jsl_map_free(m, &log->info_map);
    jsl_array_free(m, &log->info_shape);
    jsl_array_free(m, &log->info_rgba);
    jsl_array_free(m, &log->image);
    jsl_array_free(m, &log->text);
    jsl_memory memory = log->memory;
    jsl_free(&memory, log, sizeof *log);
}

/* -- Events
 * ------------------------------------------------------------------------------------------- */

/* Whether one of our messages is whole. Bounded work: ours are one datagram at most. */
static bool payload_sound(const uint8_t *data, int64_t size) {
    if (size > JSL_DATAGRAM) return false;
    jsl_lcm_type type = jsl_lcm_type_of(data, size);
    jsl_state_chunk chunk;
    if (type == JSL_LCM_COUNT) return false;
    if (type == JSL_LCM_STATE)
        return jsl_state_decode(data, size, true, &chunk) == JSL_OK && chunk.crc_good;
    return jsl_message_sound(type, data, size);
}

bool jsl_log_at(const jsl_log_file *log, int64_t at, jsl_log_event *out) {
    if (at < 0 || log->size - at < JSL_EVENT_HEAD) return false;
    const uint8_t *p = log->map + at;
    if (memcmp(p, sync_bytes, 4) != 0) return false;
    uint32_t channel = jsl_get_u32(p + 20), size = jsl_get_u32(p + 24);
    if (channel == 0 || channel >= 1000 || size > INT32_MAX) return false;
    int64_t rest = log->size - at - JSL_EVENT_HEAD - channel - (int64_t)size;
    if (rest < 0) return false;
    *out = (jsl_log_event){.offset = at,
                           .number = (int64_t)jsl_get_u64(p + 4),
                           .timestamp_us = (int64_t)jsl_get_u64(p + 12),
                           .channel = (const char *)p + JSL_EVENT_HEAD,
                           .channel_size = (int)channel,
                           .data = p + JSL_EVENT_HEAD + channel,
                           .size = (int64_t)size};
    const uint8_t *next = out->data + size;
    return memcmp(next, sync_bytes, rest < 4 ? (size_t)rest : 4) == 0 ||
           payload_sound(out->data, out->size);
}

/* Whether the bytes at `at` begin an event that the end of the file cuts off. */
static bool cut_off(const jsl_log_file *log, int64_t at) {
    int64_t rest = log->size - at;
    const uint8_t *p = log->map + at;
    if (memcmp(p, sync_bytes, rest < 4 ? (size_t)rest : 4) != 0) return false;
    if (rest < JSL_EVENT_HEAD) return true;
    uint32_t channel = jsl_get_u32(p + 20), size = jsl_get_u32(p + 24);
    return channel > 0 && channel < 1000 && size <= INT32_MAX &&
           rest < JSL_EVENT_HEAD + (int64_t)channel + (int64_t)size;
}

bool jsl_log_find(const jsl_log_file *log, int64_t at, jsl_log_event *out, bool *truncated) {
    *truncated = false;
    if (at >= log->size) return false;
    int64_t begin = at;
    while (!jsl_log_at(log, at, out)) {
        const uint8_t *end = log->map + log->size;
        const uint8_t *p = log->map + at + 1;
        do {
            p = p < end ? memchr(p, sync_bytes[0], (size_t)(end - p)) : NULL;
            if (!p || end - p < JSL_EVENT_HEAD) {
                *truncated = cut_off(log, begin);
                return false;
            }
        } while (memcmp(p, sync_bytes, 4) != 0 && ++p);
        at = p - log->map;
    }
    return true;
}

jsl_result jsl_log_next(jsl_log_file *log, jsl_log_event *out) {
    if (!log || !out) return JSL_ERR_ARGUMENT;
    bool truncated;
    int64_t at = log->cursor;
    if (!jsl_log_find(log, at, out, &truncated)) {
        log->cursor = log->size;
        return JSL_ERR_END;
    }
    log->cursor = out->data + out->size - log->map;
    return out->offset == at ? JSL_OK : JSL_ERR_FORMAT;
}

void jsl_log_rewind(jsl_log_file *log) {
    log->cursor = 0;
    log->next_instant = log->next_columns = 0;
}
