/* SPDX-License-Identifier: MIT
 * log_list.c - what is where in a log: by its own index, or by one hop over all headers.
 */
#include "telemetry/log_file.h"

#include <stdio.h>
#include <stdlib.h>

#define MAX_CHUNKS (1 << 20)
#define MAX_SESSIONS 64

static bool channel_is(const jsl_log_event *e, const char *name) {
    return (size_t)e->channel_size == strlen(name) &&
           memcmp(e->channel, name, (size_t)e->channel_size) == 0;
}

/* -- Sets
 * ---------------------------------------------------------------------------------------------- */

static int kind_of(const jsl_log_event *e) {
    switch (jsl_lcm_type_of(e->data, e->size)) {
    case JSL_LCM_STATE:
        for (int k = 0; k < JSL_FRAME_KINDS; k++)
            if (channel_is(e, jsl_bulk_channel((jsl_bulk)k))) return k;
        return -1;
    case JSL_LCM_KEYFRAME:
        return JSL_SET_KEYFRAME;
    case JSL_LCM_COLUMNS:
        return JSL_SET_COLUMNS;
    case JSL_LCM_SCENE:
        return JSL_SET_SCENE;
    case JSL_LCM_SHAPES:
        return JSL_SET_SHAPES;
    case JSL_LCM_BODY_INFO:
        return JSL_SET_BODY_INFO;
    case JSL_LCM_SCENE_TEXT:
        return JSL_SET_SCENE_TEXT;
    default:
        return -1;
    }
}

bool jsl_log_set_of(const jsl_log_event *e, jsl_set *out, int32_t *chunk_index) {
    int kind = kind_of(e);
    if (kind < 0 || e->size < JSL_AT_CHUNK_COUNT + 4) return false;
    bool table = kind >= JSL_SET_SHAPES; /* scene_rev, index, count after the stamp */
    const uint8_t *p = e->data;
    *out = (jsl_set){.kind = kind,
                     .session = (int64_t)jsl_get_u64(p + JSL_AT_SESSION),
                     .step = (int64_t)jsl_get_u64(p + JSL_AT_STEP),
                     .sim_ns = (int64_t)jsl_get_u64(p + JSL_AT_SIM_NS),
                     .seq = table || kind == JSL_SET_SCENE
                                ? (int32_t)jsl_get_u32(p + JSL_STAMP_END)
                                : (int64_t)jsl_get_u64(p + JSL_AT_FRAME_SEQ),
                     .offset = e->offset,
                     .head = -1,
                     .tail = -1,
                     .hint = -1};
    const uint8_t *index = p + (table ? JSL_STAMP_END + 4 : JSL_AT_CHUNK_INDEX);
    out->count = kind == JSL_SET_SCENE ? 1 : (int32_t)jsl_get_u32(index + 4);
    *chunk_index = kind == JSL_SET_SCENE ? 0 : (int32_t)jsl_get_u32(index);
    return out->count >= 1 && out->count <= MAX_CHUNKS && *chunk_index >= 0 &&
           *chunk_index < out->count;
}

static bool same_set(const jsl_set *a, const jsl_set *b) {
    return a->kind == b->kind && a->session == b->session && a->seq == b->seq &&
           a->count == b->count && a->step == b->step;
}

/* Adds a chunk to the list of its set, in order of index; false: it is there already. */
static jsl_result add_chunk(jsl_log_file *log, jsl_set *set, const jsl_log_event *e, int32_t index,
                            bool *added) {
    int32_t before = -1;
    *added = false;
    if (set->tail >= 0 && log->chunk.at[set->tail].index < index) {
        before = set->tail;
    } else {
        int32_t c =
            set->hint >= 0 && log->chunk.at[set->hint].index <= index ? set->hint : set->head;
        for (; c >= 0 && log->chunk.at[c].index <= index; c = log->chunk.at[c].next) {
            set->hint = before = c;
            if (log->chunk.at[c].index == index) return JSL_OK;
        }
    }
    JSL_TRY(jsl_array_reserve(&log->memory, &log->chunk, log->chunk.count + 1));
    int32_t at = (int32_t)log->chunk.count++;
    jsl_set_chunk *c = &log->chunk.at[at];
    *c = (jsl_set_chunk){e->data - log->map, e->size, index, -1};
    int32_t *link = before < 0 ? &set->head : &log->chunk.at[before].next;
    c->next = *link;
    *link = at;
    if (c->next < 0) set->tail = at;
    set->hint = at;
    set->got++;
    *added = true;
    return JSL_OK;
}

static void note_session(jsl_log_file *log, int64_t session) {
    for (int64_t i = 0; i < log->session.count; i++)
        if (log->session.at[i] == session) return;
    if (log->session.count < MAX_SESSIONS &&
        jsl_array_reserve(&log->memory, &log->session, log->session.count + 1) == JSL_OK)
        log->session.at[log->session.count++] = session;
}

/* Chunks of different frames may be interleaved; a network and lcm-logger reorder by a few frames
 * at most. */
#define OPEN_SETS 16
static jsl_result add_event(jsl_log_file *log, const jsl_log_event *e, jsl_log_info *info) {
    jsl_set set;
    int32_t index;
    if (!jsl_log_set_of(e, &set, &index)) return JSL_OK;
    note_session(log, set.session);
    int64_t i = log->set.count - 1, stop = i - OPEN_SETS;
    while (i >= 0 && i > stop && !same_set(&log->set.at[i], &set)) i--;
    if (i < 0 || i <= stop) {
        JSL_TRY(jsl_array_reserve(&log->memory, &log->set, log->set.count + 1));
        i = log->set.count++;
        log->set.at[i] = set;
    }
    bool added;
    JSL_TRY(add_chunk(log, &log->set.at[i], e, index, &added));
    if (!added && set.kind <= JSL_SET_COLUMNS) info->duplicate_chunks++;
    return JSL_OK;
}

jsl_result jsl_log_gather(jsl_log_file *log, jsl_set *set) {
    if (set->got >= 0) return set->got == set->count ? JSL_OK : JSL_ERR_FORMAT;
    set->got = 0;
    int64_t at = set->offset, tries = 4096 + 2 * (int64_t)set->count;
    jsl_log_event e;
    bool truncated;
    while (set->got < set->count && tries-- > 0 && jsl_log_find(log, at, &e, &truncated)) {
        jsl_set other;
        int32_t index;
        bool added;
        if (jsl_log_set_of(&e, &other, &index) && same_set(set, &other))
            JSL_TRY(add_chunk(log, set, &e, index, &added));
        at = e.data + e.size - log->map;
    }
    return set->got == set->count ? JSL_OK : JSL_ERR_FORMAT;
}

/* -- By index
 * ------------------------------------------------------------------------------------------- */

/* The index event that ends the file. */
static bool find_last_index(const jsl_log_file *log, jsl_log_event *out) {
    int64_t from = log->size - JSL_EVENT_MAX;
    for (int64_t at = log->size - JSL_EVENT_HEAD; at >= 0 && at >= from; at--)
        if (log->map[at] == 0xed && jsl_log_at(log, at, out) &&
            out->data + out->size == log->map + log->size &&
            jsl_lcm_type_of(out->data, out->size) == JSL_LCM_INDEX)
            return true;
    return false;
}

/* Adds the sets that one index event lists; false when it does not fit the file. */
static bool add_indexed(jsl_log_file *log, const jsl_msg_index *m) {
    for (int32_t i = 0; i < m->n; i++) {
        jsl_log_event e;
        jsl_set set;
        int32_t index;
        if (!jsl_log_at(log, m->offset[i], &e)) return false;
        if (!jsl_log_set_of(&e, &set, &index)) {
            if (jsl_lcm_type_of(e.data, e.size) != JSL_LCM_SCHEMA) return false;
            continue;
        }
        if (set.step != m->event_step[i] || set.sim_ns != m->event_sim_ns[i] || index != 0)
            return false;
        note_session(log, set.session);
        if (jsl_array_reserve(&log->memory, &log->set, log->set.count + 1) != JSL_OK) return false;
        set.got = -1;
        log->set.at[log->set.count++] = set;
    }
    return true;
}

static int by_offset(const void *a, const void *b) {
    int64_t x = ((const jsl_set *)a)->offset, y = ((const jsl_set *)b)->offset;
    return (x > y) - (x < y);
}

/* Lists by the chain of index events. Each entry is checked against the file: an index that was
 * copied with other events, or whose file was cut or joined, points elsewhere. */
static bool list_by_index(jsl_log_file *log) {
    jsl_log_event e;
    bool whole = false;
    if (!find_last_index(log, &e)) return false;
    for (int64_t last = log->size;;) {
        jsl_msg_index m;
        if (e.offset >= last ||
            jsl_message_decode(JSL_LCM_INDEX, e.data, e.size, &log->arena, &m) != JSL_OK ||
            !add_indexed(log, &m))
            break;
        last = e.offset;
        if (m.prev_index_offset == -1) {
            whole = m.n > 0 && m.offset[0] == 0; /* else another log precedes this one */
            break;
        }
        if (!jsl_log_at(log, m.prev_index_offset, &e)) break;
        jsl_arena_reset(&log->arena);
    }
    jsl_arena_reset(&log->arena);
    if (whole && log->session.count == 1) {
        if (log->set.count)
            qsort(log->set.at, (size_t)log->set.count, sizeof *log->set.at, by_offset);
        return true;
    }
    log->set.count = log->session.count = 0;
    return false;
}

/* -- By hopping
 * ------------------------------------------------------------------------------------------- */

static void count_channel(jsl_log_info *info, const jsl_log_event *e) {
    int i = 0;
    for (; i < info->channel_count; i++)
        if (strlen(info->channel[i].name) == (size_t)e->channel_size &&
            memcmp(info->channel[i].name, e->channel, (size_t)e->channel_size) == 0)
            break;
    if (i == JSL_LOG_MAX_CHANNELS || e->channel_size >= (int)sizeof info->channel[i].name) return;
    jsl_log_channel *c = &info->channel[i];
    if (i == info->channel_count) {
        memcpy(c->name, e->channel, (size_t)e->channel_size);
        info->channel_count++;
    }
    c->events++;
    c->bytes += e->size;
}

static void read_stats(jsl_log_file *log, const jsl_log_event *e, jsl_log_info *info) {
    jsl_msg_stats m;
    if (jsl_message_decode(JSL_LCM_STATS, e->data, e->size, &log->arena, &m) == JSL_OK) {
        uint64_t offered = 0, dropped = 0; /* unsigned: a damaged message may hold anything */
        for (int32_t i = 0; i < m.n; i++)
            for (int k = 0; k < JSL_BULK_COUNT; k++)
                if (k != JSL_BULK_KEYFRAME &&
                    strcmp(m.channel[i], jsl_bulk_channel((jsl_bulk)k)) == 0) {
                    offered += (uint64_t)m.frames_offered[i];
                    dropped += (uint64_t)m.frames_dropped_queue[i];
                }
        info->frames_offered = (int64_t)offered;
        info->frames_dropped = (int64_t)dropped;
    }
    jsl_arena_reset(&log->arena);
}

static void read_scene(jsl_log_file *log, const jsl_log_event *e, jsl_log_info *info) {
    jsl_msg_scene m;
    if (jsl_message_decode(JSL_LCM_SCENE, e->data, e->size, &log->arena, &m) == JSL_OK) {
        snprintf(info->scene, sizeof info->scene, "%s", m.name);
        snprintf(info->build, sizeof info->build, "%s", m.build);
        info->seed = (uint64_t)m.seed;
        info->dt = m.dt;
    }
    jsl_arena_reset(&log->arena);
}

typedef struct hop {
    bool stamped;              /* an event of ours was seen */
    jsl_lcm_type last, before; /* types of the last two events */
    jsl_log_event stats;       /* the last of its kind */
} hop;

static void count_event(jsl_log_file *log, const jsl_log_event *e, hop *h, jsl_log_info *info) {
    jsl_lcm_type type = jsl_lcm_type_of(e->data, e->size);
    if (!info->events++)
        info->first_us = e->timestamp_us;
    else if (e->timestamp_us < info->last_us)
        info->backward_times++;
    info->last_us = e->timestamp_us;
    info->good_bytes += JSL_EVENT_HEAD + e->channel_size + e->size;
    count_channel(info, e);
    h->before = h->last;
    h->last = type;
    if (type == JSL_LCM_COUNT) {
        info->foreign_events++;
        return;
    }
    if (type == JSL_LCM_STATS) h->stats = *e;
    if (type == JSL_LCM_SCENE) read_scene(log, e, info);
    if (e->size < JSL_STAMP_END) return;
    note_session(log, (int64_t)jsl_get_u64(e->data + JSL_AT_SESSION));
    int64_t step = (int64_t)jsl_get_u64(e->data + JSL_AT_STEP);
    double time = (double)(int64_t)jsl_get_u64(e->data + JSL_AT_SIM_NS) * 1e-9;
    if (!h->stamped) {
        info->first_step = step;
        info->first_time = time;
    }
    h->stamped = true;
    info->last_step = step;
    info->last_time = time;
}

static jsl_result list_by_hopping(jsl_log_file *log, jsl_log_info *info) {
    hop h = {.last = JSL_LCM_COUNT, .before = JSL_LCM_COUNT};
    jsl_log_event e;
    int64_t at = 0;
    while (jsl_log_find(log, at, &e, &info->truncated)) {
        if (e.offset > at) {
            info->holes++;
            info->hole_bytes += e.offset - at;
        }
        count_event(log, &e, &h, info);
        JSL_TRY(add_event(log, &e, info));
        at = e.data + e.size - log->map;
    }
    if (at < log->size && !info->truncated) {
        info->holes++;
        info->hole_bytes += log->size - at;
    }
    if (h.stats.data) read_stats(log, &h.stats, info);
    info->closed = at == log->size && h.last == JSL_LCM_INDEX && h.before == JSL_LCM_STATS;
    info->sessions = log->session.count;
    return JSL_OK;
}

/* -- Instants
 * --------------------------------------------------------------------------------------------- */

static int32_t rank_of(const jsl_log_file *log, int64_t session) {
    for (int64_t i = 0; i < log->session.count; i++)
        if (log->session.at[i] == session) return (int32_t)i;
    return MAX_SESSIONS;
}

static int by_step(const jsl_instant *x, const jsl_instant *y) {
    if (x->session_rank != y->session_rank) return x->session_rank < y->session_rank ? -1 : 1;
    if (x->session != y->session) return x->session < y->session ? -1 : 1;
    return (x->step > y->step) - (x->step < y->step);
}

static int by_time(const void *a, const void *b) {
    const jsl_instant *x = a, *y = b;
    int order = by_step(x, y);
    if (order) return order;
    for (int k = 0; k < JSL_FRAME_KINDS; k++)
        if (x->own[k] != y->own[k]) return x->own[k] < y->own[k] ? -1 : 1;
    return 0;
}

/* One instant a set, sorted, then those of one step made one. */
static jsl_result make_instants(jsl_log_file *log) {
    int64_t n = 0;
    JSL_TRY(jsl_array_reserve(&log->memory, &log->instant, log->set.count + 1));
    for (int64_t i = 0; i < log->set.count; i++) {
        const jsl_set *s = &log->set.at[i];
        if (s->kind >= JSL_FRAME_KINDS || (s->got >= 0 && s->got < s->count)) continue;
        jsl_instant *t = &log->instant.at[n++];
        *t = (jsl_instant){s->session,   s->step,     s->sim_ns, rank_of(log, s->session),
                           {-1, -1, -1}, {-1, -1, -1}};
        t->own[s->kind] = (int32_t)i;
    }
    if (n) qsort(log->instant.at, (size_t)n, sizeof *log->instant.at, by_time);
    int64_t count = 0;
    for (int64_t i = 0; i < n; i++) {
        jsl_instant t = log->instant.at[i], *last = count ? &log->instant.at[count - 1] : NULL;
        bool same_run = last && last->session == t.session;
        if (same_run && last->step == t.step) {
            for (int k = 0; k < JSL_FRAME_KINDS; k++)
                if (t.own[k] >= 0) last->own[k] = last->latest[k] = t.own[k];
            continue;
        }
        for (int k = 0; k < JSL_FRAME_KINDS; k++)
            t.latest[k] = t.own[k] >= 0 ? t.own[k] : same_run ? last->latest[k] : -1;
        log->instant.at[count++] = t;
    }
    log->instant.count = count;
    return JSL_OK;
}

jsl_result jsl_log_list(jsl_log_file *log, bool may_use_index, jsl_log_info *info) {
    jsl_log_info own;
    if (!info) info = &own;
    if (log->listed && may_use_index) return JSL_OK;
    *info = (jsl_log_info){.file_bytes = log->size};
    jsl_result r = JSL_OK;
    bool inside = log->next_instant > 0 && log->next_instant < log->instant.count;
    jsl_instant next = {0};
    if (inside) next = log->instant.at[log->next_instant];
    int64_t columns_from = log->next_columns == 0 ? 0
                           : log->next_columns < log->set.count
                               ? log->set.at[log->next_columns].offset
                               : INT64_MAX;
    log->set.count = log->chunk.count = log->session.count = log->instant.count = 0;
    jsl_log_forget(log); /* it names sets by number */
    if (!may_use_index || !list_by_index(log)) r = list_by_hopping(log, info);
    if (r == JSL_OK) r = make_instants(log);
    log->listed = r == JSL_OK;
    if (inside) { /* numbers may differ from those of the last listing */
        int64_t i = 0;
        while (i < log->instant.count && by_step(&log->instant.at[i], &next) < 0) i++;
        log->next_instant = i;
    }
    log->next_columns = 0;
    while (log->next_columns < log->set.count &&
           log->set.at[log->next_columns].offset < columns_from)
        log->next_columns++;
    return r;
}

/* -- Info
 * ---------------------------------------------------------------------------------------------------
 */

static void count_sets(jsl_log_file *log, bool check, jsl_log_info *info) {
    for (int64_t i = 0; i < log->set.count; i++) {
        const jsl_set *s = &log->set.at[i];
        bool whole = s->got == s->count;
        if (s->kind > JSL_SET_COLUMNS) continue;
        if (!whole) {
            info->incomplete_frames++;
            continue;
        }
        if (check && !jsl_log_check_set(log, s)) info->bad_frames++;
        int64_t *count[] = {&info->particle_frames, &info->boid_frames, &info->body_frames,
                            &info->keyframes, &info->component_frames};
        ++*count[s->kind];
    }
}

jsl_result jsl_log_get_info(jsl_log_file *log, jsl_log_info *out) {
    if (!log || !out) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_log_list(log, false, out));
    count_sets(log, false, out);
    return JSL_OK;
}

jsl_result jsl_log_verify(jsl_log_file *log, jsl_log_info *out) {
    if (!log || !out) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_log_list(log, false, out));
    count_sets(log, true, out);
    bool sound = !out->holes && !out->truncated && !out->incomplete_frames && !out->bad_frames;
    return sound ? JSL_OK : JSL_ERR_FORMAT;
}
