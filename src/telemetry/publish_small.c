/* SPDX-License-Identifier: MIT
 * publish_small.c - schema, scene, shapes, diagnostics, timing, statistics, index and keyframes.
 */
#include "telemetry/publisher.h"
#include "telemetry/schema.h"

#include <stdio.h>

#define INDEX_ENTRIES 2000 /* 28 bytes each: one datagram */

void jsl_publish_note(jsl_publisher *p, int64_t offset, int32_t kind) {
    /* Without memory the entry is missing; readers then hop over the headers. */
    if (jsl_array_reserve(&p->memory, &p->index, p->index.count + 1) != JSL_OK) return;
    p->index.at[p->index.count++] = (jsl_index_entry){offset, p->stamp.step, p->stamp.sim_ns, kind};
}

void jsl_publish_message(jsl_publisher *p, unsigned outlets, const char *channel, jsl_lcm_type type,
                         const void *message, int32_t kind) {
    int64_t size = jsl_message_size(type, message);
    bool wait = p->closing || p->desc.when_full == JSL_FULL_BLOCK;
    JSL_ASSERT(size + (int64_t)strlen(channel) + 1 <= JSL_DATAGRAM || type == JSL_LCM_SCENE ||
               type == JSL_LCM_SCHEMA);
    for (int o = 0; o < JSL_OUTLETS; o++) {
        jsl_outlet *out = &p->outlet[o];
        if (!out->on || !(outlets >> o & 1)) continue;
        uint8_t *to = jsl_ring_reserve(&out->ring, channel, size, wait);
        if (!to) {
            p->small_dropped += o == JSL_TO_LOG || !p->outlet[JSL_TO_LOG].on;
            continue;
        }
        jsl_message_encode(type, message, to, size);
        int64_t at = jsl_ring_commit(&out->ring, channel, size, p->stamp.wall_us);
        if (o == JSL_TO_LOG && kind) jsl_publish_note(p, at, kind);
        jsl_ring_publish(&out->ring);
    }
}

void jsl_publish_schema(jsl_publisher *p) {
    const char *names[JSL_LCM_COUNT];
    int64_t fingerprints[JSL_LCM_COUNT];
    for (int i = 0; i < JSL_LCM_COUNT; i++) {
        names[i] = jsl_lcm_type_name((jsl_lcm_type)i);
        fingerprints[i] = (int64_t)jsl_lcm_fingerprint((jsl_lcm_type)i);
    }
    jsl_msg_schema m = {
        JSL_STAMPED(p),     .schema_version = JSL_SCHEMA_VERSION, .n = JSL_LCM_COUNT,
        .type_name = names, .fingerprint = fingerprints,          .source = jsl_schema_text};
    jsl_publish_message(p, ~0u, "JOSTLE_SCHEMA", JSL_LCM_SCHEMA, &m, JSL_INDEX_SCHEMA);
}

/* -- Scene
 * ---------------------------------------------------------------------------------------------- */

static void publish_scene_text(jsl_publisher *p) {
    const char *text = p->desc.scene_text;
    if (!text) return;
    const int64_t room = 60000, total = (int64_t)strlen(text);
    int32_t count = total ? (int32_t)((total + room - 1) / room) : 1;
    for (int32_t i = 0; i < count; i++) {
        int64_t first = i * room, n = total - first < room ? total - first : room;
        jsl_msg_scene_text m = {JSL_STAMPED(p),
                                .scene_rev = p->scene_rev,
                                .chunk_index = i,
                                .chunk_count = count,
                                .first = first,
                                .total = total,
                                .crc32c = (int32_t)jsl_crc32c(0, text + first, (size_t)n),
                                .nbytes = (int32_t)n,
                                .data = (const uint8_t *)text + first};
        jsl_publish_message(p, ~0u, "JOSTLE_SCENE_TEXT", JSL_LCM_SCENE_TEXT, &m,
                            i == 0 ? JSL_INDEX_SCENE : 0);
    }
}

void jsl_publish_scene(jsl_publisher *p) {
    const jsl_world_desc *w = jsl_world_settings(p->world);
    const jsl_frame_camera *c = &p->desc.camera;
    static const char *const names[] = {"camera.eye.x",     "camera.eye.y",    "camera.eye.z",
                                        "camera.target.x",  "camera.target.y", "camera.target.z",
                                        "camera.fov",       "camera.orbit",    "draw.additive",
                                        "draw.boid_length", "workers"};
    const double values[] = {(double)c->eye[0],
                             (double)c->eye[1],
                             (double)c->eye[2],
                             (double)c->target[0],
                             (double)c->target[1],
                             (double)c->target[2],
                             (double)c->fov,
                             (double)c->orbit,
                             p->desc.additive ? 1.0 : 0.0,
                             (double)p->desc.boid_length,
                             (double)w->workers};
    char build[128];
#ifdef __clang__
    const char *compiler = "clang " __clang_version__;
#else
    const char *compiler = "gcc " __VERSION__;
#endif
    snprintf(build, sizeof build, "jostle %s %s %s %s, %s", jsl_version(), JSL_GIT,
             JSL_PRECISION_TEXT, jsl_isa_text(jsl_isa_resolve(w->isa)), compiler);
    jsl_msg_scene m = {
        JSL_STAMPED(p),
        .schema_version = JSL_SCHEMA_VERSION,
        .scene_rev = p->scene_rev,
        .name = p->desc.scene_name,
        .build = build,
        .config_hash = (int64_t)p->desc.scene_hash,
        .seed = (int64_t)w->seed,
        .dt = (double)w->dt,
        .substeps = w->substeps,
        .gravity = {(double)w->gravity.x, (double)w->gravity.y, (double)w->gravity.z},
        .n_particles = jsl_publish_rows(p, JSL_BULK_PARTICLES),
        .n_boids = jsl_publish_rows(p, JSL_BULK_BOIDS),
        .n_bodies = jsl_publish_rows(p, JSL_BULK_BODIES),
        .n_params = JSL_COUNT(values),
        .param_name = names,
        .param_value = values,
        .chunk_count = 1};
    jsl_publish_message(p, ~0u, "JOSTLE_SCENE", JSL_LCM_SCENE, &m, JSL_INDEX_SCENE);
    publish_scene_text(p);
}

#define SHAPE_CHUNK 2048 /* 21 bytes each */
typedef struct shape_chunk {
    int32_t n, id[SHAPE_CHUNK];
    int8_t kind[SHAPE_CHUNK];
    float p0[SHAPE_CHUNK], p1[SHAPE_CHUNK], p2[SHAPE_CHUNK], p3[SHAPE_CHUNK];
} shape_chunk;

static void put_shape(shape_chunk *c, int id, const jsl_shape_desc *s) {
    static const int8_t kinds[JSL_SHAPE_KIND_COUNT] = {-1, 0, 1, 2, 3}; /* SHAPE_* of jostle.lcm */
    int32_t k = c->n++;
    c->id[k] = id;
    c->kind[k] = kinds[s->kind < JSL_SHAPE_KIND_COUNT ? s->kind : 0];
    c->p0[k] = c->p1[k] = c->p2[k] = c->p3[k] = 0.0f;
    switch (s->kind) {
    case JSL_SHAPE_BOX:
        c->p0[k] = (float)s->half.x;
        c->p1[k] = (float)s->half.y;
        c->p2[k] = (float)s->half.z;
        break;
    case JSL_SHAPE_SPHERE:
    case JSL_SHAPE_CAPSULE:
        c->p0[k] = (float)s->radius;
        c->p1[k] = s->kind == JSL_SHAPE_CAPSULE ? (float)s->half.z : 0.0f;
        break;
    case JSL_SHAPE_PLANE: /* in its own frame */
        c->p2[k] = 1.0f;
        break;
    default:
        break;
    }
}

jsl_result jsl_publish_shapes(jsl_publisher *p) {
    int shapes = jsl_shape_count(p->world);
    int32_t count = shapes ? (shapes + SHAPE_CHUNK - 1) / SHAPE_CHUNK : 1;
    JSL_TRY(jsl_array_reserve(&p->memory, &p->table, (int64_t)sizeof(shape_chunk)));
    shape_chunk *c = (shape_chunk *)(void *)p->table.at;
    for (int32_t i = 0; i < count; i++) {
        c->n = 0;
        for (int id = i * SHAPE_CHUNK + 1; id <= shapes && c->n < SHAPE_CHUNK; id++) {
            jsl_shape_desc s = {0};
            (void)jsl_shape_get(p->world, (jsl_shape){(uint32_t)id}, &s);
            put_shape(c, id, &s);
        }
        jsl_msg_shapes m = {JSL_STAMPED(p),   .scene_rev = p->scene_rev,
                            .chunk_index = i, .chunk_count = count,
                            .n = c->n,        .shape_id = c->id,
                            .kind = c->kind,  .p0 = c->p0,
                            .p1 = c->p1,      .p2 = c->p2,
                            .p3 = c->p3};
        jsl_publish_message(p, ~0u, "JOSTLE_SHAPES", JSL_LCM_SHAPES, &m,
                            i == 0 ? JSL_INDEX_SCENE : 0);
    }
    return JSL_OK;
}

/* -- Each step
 * --------------------------------------------------------------------------------------------- */

void jsl_publish_diag(jsl_publisher *p) {
    jsl_diagnostics d;
    if (jsl_world_diagnostics(p->world, &d) != JSL_OK) return;
    jsl_msg_diag m = {JSL_STAMPED(p),
                      .e_kinetic = d.kinetic_energy,
                      .e_potential = d.potential_energy,
                      .max_speed = d.max_speed,
                      .max_depth = d.max_penetration,
                      .n_particles = d.particles,
                      .n_boids = d.boids,
                      .n_bodies = d.bodies,
                      .n_awake = d.bodies,
                      .n_contacts = d.contacts,
                      .n_pairs = d.pairs,
                      .n_nan = d.not_finite,
                      .state_hash = p->hashed ? (int64_t)p->state_hash : 0};
    memcpy(m.momentum, d.momentum, sizeof m.momentum);
    memcpy(m.ang_momentum, d.angular_momentum, sizeof m.ang_momentum);
    memcpy(m.com, d.centre_of_mass, sizeof m.com);
    jsl_publish_message(p, ~0u, "JOSTLE_DIAG", JSL_LCM_DIAG, &m, 0);
}

void jsl_publish_timing(jsl_publisher *p) {
    jsl_profile now;
    jsl_world_profile(p->world, &now);
    double wall = jsl_seconds(), sim = (double)p->stamp.sim_ns * 1e-9;
    if (wall - p->rate_wall >= 1.0 || p->real_time_factor == 0.0) {
        if (wall > p->rate_wall) p->real_time_factor = (sim - p->rate_sim) / (wall - p->rate_wall);
        p->rate_wall = wall;
        p->rate_sim = sim;
    }
    const char *phase[JSL_STAGE_COUNT];
    int64_t ns[JSL_STAGE_COUNT];
    for (int i = 0; i < JSL_STAGE_COUNT; i++) {
        phase[i] = jsl_stage_text((jsl_stage)i);
        ns[i] = (int64_t)((now.seconds[i] - p->profile.seconds[i]) * 1e9);
    }
    p->profile = now;
    jsl_msg_timing m = {JSL_STAMPED(p),
                        .real_time_factor = p->real_time_factor,
                        .n_threads = jsl_world_settings(p->world)->workers,
                        .n = JSL_STAGE_COUNT,
                        .phase = phase,
                        .ns = ns};
    jsl_publish_message(p, ~0u, "JOSTLE_TIMING", JSL_LCM_TIMING, &m, 0);
}

/* What the counts are when this very message can be read: everything queued before it has been
 * written. */
void jsl_publish_stats(jsl_publisher *p) {
    for (int o = 0; o < JSL_OUTLETS; o++) {
        jsl_outlet *out = &p->outlet[o];
        if (!out->on) continue;
        const char *channel[JSL_BULK_COUNT];
        int64_t count[7][JSL_BULK_COUNT];
        jsl_sink_counts sink = {0};
        if (o == JSL_TO_LIVE) jsl_live_counts(p->live, &sink);
        for (int b = 0; b < JSL_BULK_COUNT; b++) {
            const jsl_bulk_counts *c = &out->bulk[b];
            channel[b] = jsl_bulk_channel((jsl_bulk)b);
            count[0][b] = c->offered;
            count[1][b] = c->queued - sink.frame_errors[b];
            count[2][b] = c->dropped;
            count[3][b] = c->decimated;
            count[4][b] = c->chunks;
            count[5][b] = sink.frame_errors[b];
            count[6][b] = c->bytes;
        }
        pthread_mutex_lock(&out->ring.lock);
        int64_t used = out->ring.used, peak = out->ring.peak;
        pthread_mutex_unlock(&out->ring.lock);
        jsl_msg_stats m = {JSL_STAMPED(p),
                           .n = JSL_BULK_COUNT,
                           .channel = channel,
                           .frames_offered = count[0],
                           .frames_sent = count[1],
                           .frames_dropped_queue = count[2],
                           .frames_decimated = count[3],
                           .chunks_sent = count[4],
                           .send_errors = count[5],
                           .bytes_sent = count[6],
                           .log_events = o == JSL_TO_LOG ? out->ring.number : 0,
                           .log_bytes = o == JSL_TO_LOG ? out->ring.stream : 0,
                           .log_dropped = p->small_dropped,
                           .queue_bytes = used,
                           .queue_bytes_max = out->ring.cap,
                           .queue_bytes_peak = peak};
        jsl_publish_message(p, 1u << o, "JOSTLE_TELEMETRY", JSL_LCM_STATS, &m, 0);
    }
}

void jsl_publish_index(jsl_publisher *p) {
    jsl_outlet *out = &p->outlet[JSL_TO_LOG];
    if (!out->on || (!p->closing && p->index.count < INDEX_ENTRIES)) return;
    int64_t done = 0;
    do {
        int32_t n = (int32_t)(p->index.count - done < INDEX_ENTRIES ? p->index.count - done
                                                                    : INDEX_ENTRIES);
        int64_t column[3][INDEX_ENTRIES];
        int32_t kind[INDEX_ENTRIES];
        for (int32_t i = 0; i < n; i++) {
            const jsl_index_entry *e = &p->index.at[done + i];
            column[0][i] = e->offset;
            column[1][i] = e->step;
            column[2][i] = e->sim_ns;
            kind[i] = e->kind;
        }
        jsl_msg_index m = {JSL_STAMPED(p),
                           .prev_index_offset = p->index_offset,
                           .n = n,
                           .offset = column[0],
                           .event_step = column[1],
                           .event_sim_ns = column[2],
                           .kind = kind};
        int64_t at = out->ring.stream, number = out->ring.number;
        jsl_publish_message(p, 1u << JSL_TO_LOG, "JOSTLE_INDEX", JSL_LCM_INDEX, &m, 0);
        if (out->ring.number == number) break; /* no room: at a later step */
        p->index_offset = at;
        done += n;
    } while (done < p->index.count);
    memmove(p->index.at, p->index.at + done, (size_t)(p->index.count - done) * sizeof *p->index.at);
    p->index.count -= done;
}

/* -- Keyframes
 * --------------------------------------------------------------------------------------------- */

#define KEYFRAME_ROOM 65000
static void send_image(jsl_publisher *p, const uint8_t *image, int64_t total, bool wait) {
    jsl_outlet *out = &p->outlet[JSL_TO_LOG];
    const char *channel = jsl_bulk_channel(JSL_BULK_KEYFRAME);
    int32_t count = total ? (int32_t)((total + KEYFRAME_ROOM - 1) / KEYFRAME_ROOM) : 1;
    for (int32_t i = 0; i < count; i++) {
        int64_t first = (int64_t)i * KEYFRAME_ROOM;
        int64_t n = total - first < KEYFRAME_ROOM ? total - first : KEYFRAME_ROOM;
        jsl_msg_keyframe m = {JSL_STAMPED(p),
                              .keyframe_seq = p->frame_seq[JSL_BULK_KEYFRAME] - 1,
                              .chunk_index = i,
                              .chunk_count = count,
                              .first = first,
                              .total = total,
                              .state_hash = (int64_t)p->state_hash,
                              .crc32c = (int32_t)jsl_crc32c(0, image + first, (size_t)n),
                              .nbytes = (int32_t)n,
                              .data = image + first};
        int64_t size = jsl_message_size(JSL_LCM_KEYFRAME, &m);
        uint8_t *to = jsl_ring_reserve(&out->ring, channel, size, wait);
        JSL_ASSERT(to);
        jsl_message_encode(JSL_LCM_KEYFRAME, &m, to, size);
        int64_t at = jsl_ring_commit(&out->ring, channel, size, p->stamp.wall_us);
        if (i == 0) jsl_publish_note(p, at, JSL_INDEX_KEYFRAME);
        out->bulk[JSL_BULK_KEYFRAME].chunks++;
        out->bulk[JSL_BULK_KEYFRAME].bytes += size;
    }
    jsl_ring_publish(&out->ring);
    out->bulk[JSL_BULK_KEYFRAME].queued++;
}

static bool keyframe_fits(const jsl_publisher *p, jsl_ring *ring, int64_t image, bool *wait) {
    int64_t bytes = image + (image / KEYFRAME_ROOM + 1) * 150;
    *wait = p->desc.when_full == JSL_FULL_BLOCK || bytes > ring->cap / 2;
    return *wait || jsl_ring_fits(ring, bytes, 0);
}

/* An image larger than half the queue would never fit: then, and when blocking, the step waits for
 * the writer. */
jsl_result jsl_publish_keyframe(jsl_publisher *p) {
    jsl_outlet *out = &p->outlet[JSL_TO_LOG];
    jsl_bulk_counts *counts = &out->bulk[JSL_BULK_KEYFRAME];
    if (!out->on) return JSL_OK;
    counts->offered++;
    p->frame_seq[JSL_BULK_KEYFRAME]++;
    void *image = NULL;
    size_t size = 0;
    bool wait, sent = false;
    jsl_result r = JSL_OK;
    /* The last image's size tells whether to try: saving a world only to drop it would slow a step
     * that is late already. */
    if (keyframe_fits(p, &out->ring, p->keyframe_bytes, &wait))
        r = jsl_world_save(p->world, &image, &size);
    if (r == JSL_OK && image) {
        p->keyframe_bytes = (int64_t)size;
        sent = keyframe_fits(p, &out->ring, p->keyframe_bytes, &wait);
        if (sent) {
            if (!p->hashed) p->state_hash = jsl_world_hash(p->world);
            p->hashed = true;
            send_image(p, image, (int64_t)size, wait);
        }
        jsl_world_free_bytes(p->world, image, size);
    }
    if (!sent) {
        counts->dropped++;
        p->due[JSL_BULK_KEYFRAME] = INT64_MIN; /* again at the next step */
    }
    return r;
}
