/* SPDX-License-Identifier: MIT
 * log_table.c - what frames refer to: the scene, its shapes, the body table; and whole byte blocks
 * (scene text, keyframes).
 */
#include "telemetry/log_file.h"

#include <stdio.h>

void jsl_log_forget(jsl_log_file *log) {
    for (int k = 0; k < JSL_FRAME_KINDS; k++) {
        log->decoded[k] = -1;
        log->count[k] = 0;
        log->fields[k] = 0;
        log->id[k].count = -1;
    }
    log->scene_set = log->shapes_set = log->info_set = -1;
}

/* Makes the chunks of a set known. */
static bool have(jsl_log_file *log, jsl_set *set) {
    if (set->bad || jsl_log_gather(log, set) != JSL_OK) set->bad = true;
    return !set->bad;
}

/* The table of a session whose revision is the given one or the nearest below it; -1 when there is
 * none. */
static int32_t find_table(jsl_log_file *log, jsl_set_kind kind, int64_t session, int64_t rev) {
    int64_t best = -1;
    for (int64_t i = 0; i < log->set.count; i++) {
        jsl_set *s = &log->set.at[i];
        if (s->kind != (int32_t)kind || s->session != session || s->seq > rev) continue;
        if (best >= 0 && s->seq <= log->set.at[best].seq) continue;
        if (have(log, s)) best = i;
    }
    return (int32_t)best;
}

/* -- Scene
 * ---------------------------------------------------------------------------------------------- */

static void set_parameter(jsl_log_file *log, const char *name, double value) {
    static const char *const names[] = {"camera.eye.x",    "camera.eye.y",    "camera.eye.z",
                                        "camera.target.x", "camera.target.y", "camera.target.z",
                                        "camera.fov",      "camera.orbit"};
    float v = value >= -3e38 && value <= 3e38 ? (float)value : 0.0f;
    float *to[] = {&log->camera.eye[0],    &log->camera.eye[1],    &log->camera.eye[2],
                   &log->camera.target[0], &log->camera.target[1], &log->camera.target[2],
                   &log->camera.fov,       &log->camera.orbit};
    for (int i = 0; i < JSL_COUNT(names); i++)
        if (strcmp(name, names[i]) == 0) *to[i] = v;
    if (strcmp(name, "draw.additive") == 0) log->additive = v != 0.0f;
    if (strcmp(name, "draw.boid_length") == 0) log->boid_length = v;
}

jsl_result jsl_log_load_scene(jsl_log_file *log, int64_t session) {
    int32_t at = find_table(log, JSL_SET_SCENE, session, INT64_MAX);
    if (at == log->scene_set) return JSL_OK;
    log->scene_set = at;
    log->camera = (jsl_frame_camera){0};
    log->additive = false;
    log->boid_length = 0.0f;
    log->scene[0] = 0;
    if (at < 0) return JSL_OK;
    const jsl_set_chunk *c = &log->chunk.at[log->set.at[at].head];
    jsl_msg_scene m;
    if (jsl_message_decode(JSL_LCM_SCENE, log->map + c->data, c->size, &log->arena, &m) == JSL_OK) {
        snprintf(log->scene, sizeof log->scene, "%s", m.name);
        for (int32_t i = 0; i < m.n_params; i++)
            set_parameter(log, m.param_name[i], m.param_value[i]);
    } else {
        log->set.at[at].bad = true;
    }
    jsl_arena_reset(&log->arena);
    return JSL_OK;
}

/* -- Shapes and bodies
 * ------------------------------------------------------------------------------------ */

static float length_of(float v) { return v > 0.0f && v < 3e38f ? v : 0.0f; }

static jsl_frame_shape shape_of(const jsl_msg_shapes *m, int32_t i) {
    float p0 = length_of(m->p0[i]), p1 = length_of(m->p1[i]), p2 = length_of(m->p2[i]);
    switch (m->kind[i]) { /* SHAPE_* of jostle.lcm */
    case 0:
        return (jsl_frame_shape){JSL_SHAPE_SPHERE, p0, {0, 0, 0}};
    case 1:
        return (jsl_frame_shape){JSL_SHAPE_BOX, 0, {p0, p1, p2}};
    case 2:
        return (jsl_frame_shape){JSL_SHAPE_CAPSULE, p0, {0, 0, p1}};
    case 3:
        return (jsl_frame_shape){JSL_SHAPE_PLANE, 0, {0, 0, 0}};
    default:
        return (jsl_frame_shape){JSL_SHAPE_NONE, 0, {0, 0, 0}};
    }
}

static jsl_result add_shapes(jsl_log_file *log, const jsl_msg_shapes *m) {
    int64_t n = log->shape_count;
    JSL_TRY(jsl_array_reserve(&log->memory, &log->shape, n + m->n + 1));
    JSL_TRY(jsl_map_reserve(&log->memory, &log->shape_map, n + m->n));
    for (int32_t i = 0; i < m->n; i++) {
        JSL_TRY(jsl_map_set(&log->memory, &log->shape_map, (uint64_t)(uint32_t)m->shape_id[i] + 1,
                            (uint32_t)n));
        log->shape.at[n++] = shape_of(m, i);
    }
    log->shape_count = n;
    return JSL_OK;
}

static jsl_result add_info(jsl_log_file *log, const jsl_msg_body_info *m) {
    int64_t n = log->info_rgba.count;
    JSL_TRY(jsl_array_reserve(&log->memory, &log->info_shape, n + m->n));
    JSL_TRY(jsl_array_reserve(&log->memory, &log->info_rgba, n + m->n));
    JSL_TRY(jsl_map_reserve(&log->memory, &log->info_map, n + m->n));
    for (int32_t i = 0; i < m->n; i++) {
        uint64_t key = (uint64_t)m->id[i] + 1;
        uint32_t shape = (uint32_t)log->shape_count; /* nothing */
        if (!key) continue;
        (void)jsl_map_get(&log->shape_map, (uint64_t)(uint32_t)m->shape_id[i] + 1, &shape);
        JSL_TRY(jsl_map_set(&log->memory, &log->info_map, key, (uint32_t)n));
        log->info_shape.at[n] = (int32_t)shape;
        log->info_rgba.at[n++] = (uint32_t)m->rgba[i];
    }
    log->info_rgba.count = n;
    return JSL_OK;
}

/* Decodes all chunks of a table; a chunk that does not decode marks the table as bad. */
static jsl_result load_table(jsl_log_file *log, int32_t at) {
    jsl_result r = JSL_OK;
    jsl_set *set = &log->set.at[at];
    for (int32_t c = set->head; r == JSL_OK && c >= 0; c = log->chunk.at[c].next) {
        const uint8_t *data = log->map + log->chunk.at[c].data;
        int64_t size = log->chunk.at[c].size;
        union {
            jsl_msg_shapes shapes;
            jsl_msg_body_info info;
        } m;
        bool shapes = set->kind == JSL_SET_SHAPES;
        r = jsl_message_decode(shapes ? JSL_LCM_SHAPES : JSL_LCM_BODY_INFO, data, size, &log->arena,
                               &m);
        if (r == JSL_OK) r = shapes ? add_shapes(log, &m.shapes) : add_info(log, &m.info);
        jsl_arena_reset(&log->arena);
    }
    if (r != JSL_ERR_MEMORY && r != JSL_OK) {
        set->bad = true;
        r = JSL_OK;
    }
    return r;
}

jsl_result jsl_log_load_tables(jsl_log_file *log, int64_t session, int32_t scene_rev) {
    int32_t shapes = find_table(log, JSL_SET_SHAPES, session, scene_rev);
    int32_t info = find_table(log, JSL_SET_BODY_INFO, session, scene_rev);
    if (shapes == log->shapes_set && info == log->info_set && log->shape.at) return JSL_OK;
    jsl_map_clear(&log->shape_map);
    jsl_map_clear(&log->info_map);
    log->shape_count = log->info_rgba.count = 0;
    log->shapes_set = log->info_set = -1;
    JSL_TRY(jsl_array_reserve(&log->memory, &log->shape, 1));
    if (shapes >= 0) JSL_TRY(load_table(log, shapes));
    log->shape.at[log->shape_count] = (jsl_frame_shape){JSL_SHAPE_NONE, 0, {0, 0, 0}};
    if (info >= 0) JSL_TRY(load_table(log, info));
    log->shapes_set = shapes;
    log->info_set = info;
    return JSL_OK;
}

/* -- Blocks of bytes
 * ------------------------------------------------------------------------------------------ */

typedef struct part {
    int64_t first, total;
    uint32_t crc;
    int32_t size;
    const uint8_t *data;
    uint64_t state_hash;
} part;

static bool read_part(const jsl_log_file *log, const jsl_set *set, int32_t c, part *out) {
    const uint8_t *data = log->map + log->chunk.at[c].data;
    int64_t size = log->chunk.at[c].size;
    if (set->kind == JSL_SET_KEYFRAME) {
        jsl_msg_keyframe m;
        if (jsl_message_decode(JSL_LCM_KEYFRAME, data, size, NULL, &m) != JSL_OK) return false;
        *out =
            (part){m.first, m.total, (uint32_t)m.crc32c, m.nbytes, m.data, (uint64_t)m.state_hash};
    } else {
        jsl_msg_scene_text m;
        if (jsl_message_decode(JSL_LCM_SCENE_TEXT, data, size, NULL, &m) != JSL_OK) return false;
        *out = (part){m.first, m.total, (uint32_t)m.crc32c, m.nbytes, m.data, 0};
    }
    return jsl_crc32c(0, out->data, (size_t)out->size) == out->crc;
}

/* The bytes of a set of parts that follow each other and make up their total; -1 when they do not.
 * to may be null. */
static int64_t join_parts(const jsl_log_file *log, const jsl_set *set, uint8_t *to,
                          uint64_t *state_hash) {
    int64_t size = 0, total = -1;
    for (int32_t c = set->head; c >= 0; c = log->chunk.at[c].next) {
        part p;
        if (!read_part(log, set, c, &p) || p.first != size || (total >= 0 && p.total != total))
            return -1;
        if (to) memcpy(to + size, p.data, (size_t)p.size);
        total = p.total;
        size += p.size;
        *state_hash = p.state_hash;
    }
    return size == total ? size : -1;
}

bool jsl_log_check_set(jsl_log_file *log, const jsl_set *set) {
    if (set->kind == JSL_SET_COLUMNS) return jsl_log_check_columns(log, set);
    uint64_t hash;
    if (set->kind == JSL_SET_KEYFRAME || set->kind == JSL_SET_SCENE_TEXT)
        return join_parts(log, set, NULL, &hash) >= 0;
    int64_t first = 0, total = -1;
    for (int32_t c = set->head; c >= 0; c = log->chunk.at[c].next) {
        jsl_state_chunk chunk;
        if (jsl_state_decode(log->map + log->chunk.at[c].data, log->chunk.at[c].size, true,
                             &chunk) != JSL_OK ||
            !chunk.crc_good || chunk.first != first || (total >= 0 && chunk.total != total) ||
            (chunk.n && !jsl_chunk_find(&chunk, JSL_FIELD_POS, 3)))
            return false;
        first += chunk.n;
        total = chunk.total;
    }
    return first == total;
}

jsl_result jsl_log_get_scene_text(jsl_log_file *log, const char **text, int64_t *size) {
    if (!log || !text || !size) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_log_list(log, true, NULL));
    for (int64_t i = log->set.count - 1; i >= 0; i--) {
        jsl_set *s = &log->set.at[i];
        uint64_t hash;
        if (s->kind != JSL_SET_SCENE_TEXT || !have(log, s)) continue;
        int64_t n = join_parts(log, s, NULL, &hash);
        if (n < 0) continue;
        JSL_TRY(jsl_array_reserve(&log->memory, &log->text, n + 1));
        join_parts(log, s, log->text.at, &hash);
        log->text.at[n] = 0;
        *text = (const char *)log->text.at;
        *size = n;
        return JSL_OK;
    }
    return JSL_ERR_END;
}

jsl_result jsl_log_get_keyframe(jsl_log_file *log, double time, jsl_log_keyframe *out) {
    if (!log || !out) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_log_list(log, true, NULL));
    int64_t best = -1;
    for (int64_t i = 0; i < log->set.count; i++) {
        jsl_set *s = &log->set.at[i];
        uint64_t hash;
        if (s->kind != JSL_SET_KEYFRAME || (double)s->sim_ns * 1e-9 > time + 1e-9) continue;
        if (best >= 0 && s->sim_ns < log->set.at[best].sim_ns) continue;
        if (have(log, s) && join_parts(log, s, NULL, &hash) >= 0) best = i;
    }
    if (best < 0) return JSL_ERR_END;
    const jsl_set *s = &log->set.at[best];
    uint64_t hash;
    int64_t size = join_parts(log, s, NULL, &hash);
    JSL_TRY(jsl_array_reserve(&log->memory, &log->image, size ? size : 1));
    join_parts(log, s, log->image.at, &hash);
    *out = (jsl_log_keyframe){log->image.at, (size_t)size, (double)s->sim_ns * 1e-9, s->step, hash};
    return JSL_OK;
}
