/* SPDX-License-Identifier: MIT
 * log_frame.c - whole instants as arrays of float, forward and by time.
 */
#include "telemetry/log_file.h"

/* Columns of each kind in the order of their arrays in value[kind]. */
typedef struct kept_field {
    int field, components;
} kept_field;
#define KEPT 4
static const kept_field kept[JSL_FRAME_KINDS][KEPT] = {
    {{JSL_FIELD_POS, 3}, {JSL_FIELD_VEL, 3}, {JSL_FIELD_RADIUS, 1}},
    {{JSL_FIELD_POS, 3}, {JSL_FIELD_VEL, 3}, {JSL_FIELD_ACCEL, 3}},
    {{JSL_FIELD_POS, 3}, {JSL_FIELD_QUAT, 4}, {JSL_FIELD_VEL, 3}, {JSL_FIELD_ANGVEL, 3}},
};

/* -- Decoding
 * ------------------------------------------------------------------------------------------- */

static jsl_result reserve(jsl_log_file *log, int kind, int64_t n) {
    int64_t components = 0;
    for (int f = 0; f < KEPT; f++) components += kept[kind][f].components;
    JSL_TRY(jsl_array_reserve(&log->memory, &log->value[kind], n * components + 1));
    JSL_TRY(jsl_array_reserve(&log->memory, &log->id[kind].at, n + 1));
    JSL_TRY(jsl_array_reserve(&log->memory, &log->rgba[kind], n + 1));
    if (kind != JSL_SET_BODIES) return JSL_OK;
    return jsl_array_reserve(&log->memory, &log->body_shape, n + 1);
}

static void decode_bodies(jsl_log_file *log, const jsl_state_chunk *chunk) {
    for (int32_t i = 0; i < chunk->n; i++) {
        uint64_t id = log->fields[JSL_SET_BODIES] >> JSL_FIELD_ID & 1
                          ? log->id[JSL_SET_BODIES].at.at[chunk->first + i]
                          : 0;
        uint32_t at;
        bool known = id + 1 && jsl_map_get(&log->info_map, id + 1, &at);
        log->body_shape.at[chunk->first + i] =
            known ? log->info_shape.at[at] : (int32_t)log->shape_count;
        log->rgba[JSL_SET_BODIES].at[chunk->first + i] =
            known ? log->info_rgba.at[at] : 0xffffffffu;
    }
}

/* The column of a field if its numbers can be read. */
static const jsl_chunk_column *usable(const jsl_state_chunk *chunk, int field, int components) {
    const jsl_chunk_column *c = jsl_chunk_find(chunk, field, components);
    if (!c || c->encoding == JSL_ENC_QUAT32) return NULL;
    if (field == JSL_FIELD_ID) return c->encoding == JSL_ENC_I64 ? c : NULL;
    return field != JSL_FIELD_COLOR || jsl_encoding_bytes(c->encoding) == 4 ? c : NULL;
}

static uint32_t fields_of(const jsl_state_chunk *chunk, int kind) {
    uint32_t has = usable(chunk, JSL_FIELD_COLOR, 1) ? 1u << JSL_FIELD_COLOR : 0;
    if (usable(chunk, JSL_FIELD_ID, 1)) has |= 1u << JSL_FIELD_ID;
    for (int f = 0; f < KEPT && kept[kind][f].components; f++)
        if (usable(chunk, kept[kind][f].field, kept[kind][f].components))
            has |= 1u << kept[kind][f].field;
    return has;
}

static void decode_chunk(jsl_log_file *log, int kind, const jsl_state_chunk *chunk) {
    int64_t n = log->count[kind], column = 0;
    if (chunk->n == 0) return; /* of an empty set: it need not have columns */
    for (int f = 0; f < KEPT && kept[kind][f].components; f++) {
        const kept_field *k = &kept[kind][f];
        const jsl_chunk_column *c = usable(chunk, k->field, k->components);
        if (log->fields[kind] >> k->field & 1) {
            int64_t bytes = (int64_t)chunk->n * jsl_encoding_bytes(c->encoding);
            for (int i = 0; i < k->components; i++)
                jsl_column_decode(c->encoding, c->data + i * bytes, chunk->n, c->lo[i], c->step[i],
                                  log->value[kind].at + (column + i) * n + chunk->first);
        }
        column += k->components;
    }
    if (log->fields[kind] >> JSL_FIELD_COLOR & 1)
        memcpy(log->rgba[kind].at + chunk->first, usable(chunk, JSL_FIELD_COLOR, 1)->data,
               (size_t)chunk->n * 4);
    if (log->fields[kind] >> JSL_FIELD_ID & 1)
        memcpy(log->id[kind].at.at + chunk->first, usable(chunk, JSL_FIELD_ID, 1)->data,
               (size_t)chunk->n * 8);
    if (kind == JSL_SET_BODIES) decode_bodies(log, chunk);
}

/* Ids that came with this frame, or with an earlier one whose rows were in the same order. */
static void keep_ids(jsl_log_file *log, int kind, int64_t session, int32_t order_rev) {
    int64_t n = log->count[kind];
    if (n && !(log->fields[kind] >> JSL_FIELD_ID & 1)) {
        if (log->id[kind].count != n || log->id[kind].session != session ||
            log->id[kind].order_rev != order_rev)
            log->id[kind].count = -1;
        return;
    }
    log->id[kind].count = n;
    log->id[kind].session = session;
    log->id[kind].order_rev = order_rev;
}

/* A set becomes the present state of its kind. JSL_ERR_FORMAT: it is damaged and nothing has
 * changed. */
static jsl_result decode_set(jsl_log_file *log, int32_t at) {
    jsl_set *set = &log->set.at[at];
    int kind = set->kind;
    if (set->bad) return JSL_ERR_FORMAT;
    jsl_result r = jsl_log_gather(log, set);
    set->bad = r == JSL_ERR_FORMAT || (r == JSL_OK && !jsl_log_check_set(log, set));
    if (r != JSL_OK || set->bad) return r == JSL_OK ? JSL_ERR_FORMAT : r;
    uint32_t fields = ~0u;
    int64_t total = 0;
    jsl_state_chunk chunk = {0};
    for (int32_t c = set->head; c >= 0; c = log->chunk.at[c].next) {
        (void)jsl_state_decode(log->map + log->chunk.at[c].data, log->chunk.at[c].size, false,
                               &chunk);
        if (chunk.n) fields &= fields_of(&chunk, kind);
        total += chunk.n;
    }
    JSL_TRY(reserve(log, kind, total));
    if (kind == JSL_SET_BODIES) JSL_TRY(jsl_log_load_tables(log, set->session, chunk.scene_rev));
    log->count[kind] = total;
    log->fields[kind] = total ? fields : 0;
    for (int32_t c = set->head; c >= 0; c = log->chunk.at[c].next) {
        (void)jsl_state_decode(log->map + log->chunk.at[c].data, log->chunk.at[c].size, false,
                               &chunk);
        if (chunk.n) decode_chunk(log, kind, &chunk);
    }
    keep_ids(log, kind, set->session, chunk.order_rev);
    log->decoded[kind] = at;
    return JSL_OK;
}

/* Brings one kind to what it was at an instant: its latest set, or the last before that which is
 * whole. */
static jsl_result bring(jsl_log_file *log, int64_t at, int kind) {
    int64_t session = log->instant.at[at].session;
    int32_t tried = -1;
    for (int64_t i = at; i >= 0 && log->instant.at[i].session == session; i--) {
        int32_t set = log->instant.at[i].latest[kind];
        if (set < 0) break;
        if (set == log->decoded[kind]) return JSL_OK;
        if (set == tried) continue;
        tried = set;
        jsl_result r = decode_set(log, set);
        if (r != JSL_ERR_FORMAT) return r;
    }
    log->decoded[kind] = -1;
    log->count[kind] = 0;
    log->fields[kind] = 0;
    return JSL_OK;
}

/* -- Frames
 * --------------------------------------------------------------------------------------------- */

const float *jsl_log_values(const jsl_log_file *log, int kind, int field, int i) {
    if (!(log->fields[kind] >> field & 1)) return NULL;
    int64_t before = 0;
    for (int f = 0; f < KEPT && kept[kind][f].components; f++) {
        if (kept[kind][f].field == field)
            return log->value[kind].at + (before + i) * log->count[kind];
        before += kept[kind][f].components;
    }
    return NULL;
}

const uint64_t *jsl_log_ids(const jsl_log_file *log, int kind) {
    return log->id[kind].count == log->count[kind] ? log->id[kind].at.at : NULL;
}

static void fill_frame(const jsl_log_file *log, const jsl_instant *t, jsl_frame *out) {
    *out = (jsl_frame){.time = (double)t->sim_ns * 1e-9,
                       .step = t->step,
                       .scene = log->scene,
                       .shapes = log->shape.at,
                       .shape_count = log->shape.at ? log->shape_count + 1 : 0,
                       .camera = log->camera,
                       .additive = log->additive};
    const int p = JSL_SET_PARTICLES, b = JSL_SET_BOIDS, r = JSL_SET_BODIES;
    bool color_p = log->fields[p] >> JSL_FIELD_COLOR & 1,
         color_b = log->fields[b] >> JSL_FIELD_COLOR & 1;
    out->particles = (jsl_frame_particles){
        log->count[p],
        jsl_log_values(log, p, JSL_FIELD_POS, 0),
        jsl_log_values(log, p, JSL_FIELD_POS, 1),
        jsl_log_values(log, p, JSL_FIELD_POS, 2),
        jsl_log_values(log, p, JSL_FIELD_VEL, 0),
        jsl_log_values(log, p, JSL_FIELD_VEL, 1),
        jsl_log_values(log, p, JSL_FIELD_VEL, 2),
        jsl_log_values(log, p, JSL_FIELD_RADIUS, 0),
        color_p ? log->rgba[p].at : NULL,
    };
    out->boids = (jsl_frame_boids){
        log->count[b],
        jsl_log_values(log, b, JSL_FIELD_POS, 0),
        jsl_log_values(log, b, JSL_FIELD_POS, 1),
        jsl_log_values(log, b, JSL_FIELD_POS, 2),
        jsl_log_values(log, b, JSL_FIELD_VEL, 0),
        jsl_log_values(log, b, JSL_FIELD_VEL, 1),
        jsl_log_values(log, b, JSL_FIELD_VEL, 2),
        jsl_log_values(log, b, JSL_FIELD_ACCEL, 0),
        jsl_log_values(log, b, JSL_FIELD_ACCEL, 1),
        jsl_log_values(log, b, JSL_FIELD_ACCEL, 2),
        color_b ? log->rgba[b].at : NULL,
        log->boid_length,
    };
    out->bodies = (jsl_frame_bodies){
        log->count[r],
        jsl_log_values(log, r, JSL_FIELD_POS, 0),
        jsl_log_values(log, r, JSL_FIELD_POS, 1),
        jsl_log_values(log, r, JSL_FIELD_POS, 2),
        jsl_log_values(log, r, JSL_FIELD_QUAT, 0),
        jsl_log_values(log, r, JSL_FIELD_QUAT, 1),
        jsl_log_values(log, r, JSL_FIELD_QUAT, 2),
        jsl_log_values(log, r, JSL_FIELD_QUAT, 3),
        log->count[r] ? log->body_shape.at : NULL,
        log->count[r] ? log->rgba[r].at : NULL,
        log->fields[r] >> JSL_FIELD_ID & 1 ? log->id[r].at.at : NULL,
    };
}

/* An instant none of whose own sets is whole is passed over. */
static bool any_own(const jsl_log_file *log, const jsl_instant *t) {
    for (int k = 0; k < JSL_FRAME_KINDS; k++)
        if (t->own[k] >= 0 && !log->set.at[t->own[k]].bad) return true;
    return false;
}

jsl_result jsl_log_next_frame(jsl_log_file *log, jsl_frame *out) {
    if (!log || !out) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_log_list(log, true, NULL));
    while (log->next_instant < log->instant.count) {
        int64_t at = log->next_instant++;
        for (int k = 0; k < JSL_FRAME_KINDS; k++) JSL_TRY(bring(log, at, k));
        const jsl_instant *t = &log->instant.at[at];
        if (!any_own(log, t)) continue;
        JSL_TRY(jsl_log_load_scene(log, t->session));
        fill_frame(log, t, out);
        return JSL_OK;
    }
    return JSL_ERR_END;
}

jsl_result jsl_log_next_of_kind(jsl_log_file *log, int kind, const jsl_instant **out) {
    JSL_TRY(jsl_log_list(log, true, NULL));
    while (log->next_instant < log->instant.count) {
        const jsl_instant *t = *out = &log->instant.at[log->next_instant++];
        if (t->own[kind] < 0) continue;
        JSL_TRY(bring(log, t - log->instant.at, kind));
        if (log->decoded[kind] == t->own[kind]) return JSL_OK;
    }
    return JSL_ERR_END;
}

jsl_result jsl_log_seek_time(jsl_log_file *log, double time) {
    if (!log) return JSL_ERR_ARGUMENT;
    if (!(time == time)) return JSL_ERR_NOT_FINITE;
    JSL_TRY(jsl_log_list(log, true, NULL));
    int64_t n = log->instant.count, low = 0, high = n;
    if (!n) return JSL_ERR_END;
    int64_t here = log->next_instant < n ? log->next_instant : n - 1;
    int64_t session = log->instant.at[here].session;
    while (low < n && log->instant.at[low].session != session) low++;
    int64_t begin = low;
    for (high = low; high < n && log->instant.at[high].session == session;) high++;
    /* The last instant at or before; half a nanosecond of slack for times that went through double.
     */
    while (high - low > 1) {
        int64_t middle = low + (high - low) / 2;
        if ((double)log->instant.at[middle].sim_ns * 1e-9 <= time + 0.5e-9)
            low = middle;
        else
            high = middle;
    }
    log->next_instant = low > begin ? low : begin;
    return JSL_OK;
}

jsl_result jsl_log_count_frames(jsl_log_file *log, int64_t *count) {
    if (!log || !count) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_log_list(log, true, NULL));
    *count = log->instant.count;
    return JSL_OK;
}
