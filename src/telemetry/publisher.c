/* SPDX-License-Identifier: MIT
 * publisher.c - the life of a publisher, and what it does at each step.
 */
#include "telemetry/publisher.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#define QUEUE_DEFAULT (64ll << 20)
#define QUEUE_MIN (1ll << 20)

/* -- Time
 * ---------------------------------------------------------------------------------------------- */

static int64_t wall_us(void) {
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

static void take_stamp(jsl_publisher *p) {
    p->stamp.wall_us = wall_us();
    p->stamp.step = (int64_t)jsl_world_step_count(p->world);
    p->stamp.sim_ns = jsl_world_time_ns(p->world);
    p->hashed = false;
}

/* Frame k of a channel is due at k / hz. The millionth part of a frame covers the rounding of time
 * to whole nanoseconds. */
static bool is_due(jsl_publisher *p, jsl_bulk bulk) {
    if (p->hz[bulk] < 0) return false;
    double k = floor((double)p->stamp.sim_ns * 1e-9 * p->hz[bulk] + 1e-6);
    int64_t index = k < 9e18 ? (int64_t)k : INT64_MAX;
    bool due = index != p->due[bulk]; /* less: the world was restored to an earlier time */
    p->due[bulk] = index;
    return due;
}

/* -- Life
 * ---------------------------------------------------------------------------------------------- */

static jsl_result check(const jsl_publisher_desc *d) {
    const double numbers[] = {d->particles_hz, d->boids_hz, d->bodies_hz, d->components_hz,
                              d->keyframe_seconds};
    for (int i = 0; i < JSL_COUNT(numbers); i++)
        if (!isfinite(numbers[i]))
            return jsl_fail(&d->logger, JSL_ERR_NOT_FINITE, "publisher: a rate is not finite");
    if (d->queue_bytes < 0 || (d->queue_bytes && d->queue_bytes < QUEUE_MIN))
        return jsl_fail(&d->logger, JSL_ERR_ARGUMENT,
                        "publisher: queue_bytes %lld is less than 1 MiB",
                        (long long)d->queue_bytes);
    if (d->particle_position > JSL_ENCODING_U16 || d->boid_position > JSL_ENCODING_U16 ||
        d->when_full > JSL_FULL_BLOCK || d->hash_every < 0)
        return jsl_fail(&d->logger, JSL_ERR_ARGUMENT, "publisher: an enumerator is out of range");
    if (d->scene_name && strlen(d->scene_name) > 1000)
        return jsl_fail(&d->logger, JSL_ERR_LIMIT,
                        "publisher: the scene's name is longer than 1000 bytes");
    return JSL_OK;
}

static jsl_result keep_strings(jsl_publisher *p) {
    size_t name = strlen(p->desc.scene_name ? p->desc.scene_name : "") + 1;
    size_t text = p->desc.scene_text ? strlen(p->desc.scene_text) + 1 : 0;
    size_t size = name + text;
    char *s = jsl_alloc_zero(&p->memory, size);
    if (!s) return JSL_ERR_MEMORY;
    if (p->desc.scene_name) memcpy(s, p->desc.scene_name, name);
    if (text) memcpy(s + name, p->desc.scene_text, text);
    p->desc.scene_name = s;
    p->desc.scene_text = text ? s + name : NULL;
    p->desc.log_path = p->desc.lcm_url = NULL; /* not ours to keep */
    p->strings = s;
    p->strings_size = size;
    return JSL_OK;
}

static double rate(double hz, double preset) { return hz == 0.0 ? preset : hz; }

static jsl_result set_up(jsl_publisher *p, const jsl_publisher_desc *d, jsl_world *world) {
    p->desc = *d;
    p->logger = d->logger;
    p->world = world;
    p->ecs = jsl_world_ecs(world);
    p->view.component_count = -1;
    p->fields = (JSL_PUBLISH_BOID_ACCELERATION | JSL_PUBLISH_BOID_IDS | JSL_PUBLISH_BODY_VELOCITY |
                 d->with) &
                ~d->without;
    p->hz[JSL_BULK_PARTICLES] = rate(d->particles_hz, 30.0);
    p->hz[JSL_BULK_BOIDS] = rate(d->boids_hz, 60.0);
    p->hz[JSL_BULK_BODIES] = rate(d->bodies_hz, 60.0);
    p->hz[JSL_BULK_KEYFRAME] =
        d->keyframe_seconds < 0 ? -1.0 : 1.0 / rate(d->keyframe_seconds, 1.0);
    p->hz[JSL_BULK_COLUMNS] = rate(d->components_hz, 10.0);
    for (int b = 0; b < JSL_BULK_COUNT; b++) p->due[b] = INT64_MIN;
    p->index_offset = -1;
    uint64_t session = 0;
    if (getentropy(&session, sizeof session) != 0)
        session = jsl_mix64((uint64_t)wall_us() ^ (uint64_t)getpid() << 40);
    p->stamp.session = (int64_t)(session >> 1);
    p->stats_wall = p->rate_wall = jsl_seconds();
    p->rate_sim = (double)jsl_world_time_ns(world) * 1e-9;
    jsl_world_profile(world, &p->profile);
    JSL_TRY(jsl_publish_choose(p, d));
    p->desc.components = NULL; /* not ours to keep */
    return keep_strings(p);
}

static void tear_down(jsl_publisher *p) {
    jsl_memory memory = p->memory;
    for (int o = 0; o < JSL_OUTLETS; o++) jsl_ring_fini(&p->outlet[o].ring, &memory);
    jsl_array_free(&memory, &p->segment);
    jsl_array_free(&memory, &p->rgba);
    jsl_array_free(&memory, &p->size);
    jsl_array_free(&memory, &p->table);
    jsl_array_free(&memory, &p->index);
    jsl_free(&memory, p->strings, p->strings_size);
    jsl_free(&memory, p, sizeof *p);
}

/* The network first: what can fail after the file was made is only the file's own thread. */
static jsl_result open_outlets(jsl_publisher *p, const jsl_publisher_desc *d) {
    int64_t cap = d->queue_bytes ? d->queue_bytes : QUEUE_DEFAULT;
    if (d->lcm_url) {
        jsl_outlet *live = &p->outlet[JSL_TO_LIVE];
        JSL_TRY(jsl_ring_init(&live->ring, &p->memory, cap));
        JSL_TRY(jsl_live_open(&p->memory, &p->logger, d->lcm_url, &live->ring, &p->live));
        live->on = true;
    }
    if (d->log_path) {
        jsl_outlet *log = &p->outlet[JSL_TO_LOG];
        JSL_TRY(jsl_ring_init(&log->ring, &p->memory, cap));
        JSL_TRY(jsl_log_writer_open(&p->memory, &p->logger, d->log_path, &log->ring, &p->writer));
        log->on = true;
    }
    return JSL_OK;
}

static jsl_result publish_all(jsl_publisher *p);

jsl_result jsl_publisher_create(const jsl_publisher_desc *desc, jsl_world *world,
                                jsl_publisher **out) {
    if (!out) return JSL_ERR_ARGUMENT;
    *out = NULL;
    if (!desc || !world) return JSL_ERR_ARGUMENT;
    JSL_TRY(check(desc));
    jsl_memory memory;
    JSL_TRY(jsl_memory_init(&memory, (jsl_allocator){0}));
    jsl_publisher *p = jsl_alloc_zero(&memory, sizeof *p);
    if (!p) return JSL_ERR_MEMORY;
    p->memory = memory;
    jsl_result r = set_up(p, desc, world);
    if (r == JSL_OK) r = open_outlets(p, desc);
    if (r == JSL_OK) {
        take_stamp(p);
        jsl_publish_view(p);
        jsl_publish_schema(p);
        jsl_publish_scene(p);
        r = jsl_publish_shapes(p);
    }
    if (r == JSL_OK) r = publish_all(p);
    if (r == JSL_OK) {
        *out = p;
        return JSL_OK;
    }
    jsl_sink_counts counts;
    jsl_live_close(p->live, &counts);
    jsl_log_writer_abandon(p->writer, desc->log_path);
    tear_down(p);
    return r;
}

/* -- The step
 * ------------------------------------------------------------------------------------------ */

static jsl_result publish_all(jsl_publisher *p) {
    jsl_result r = JSL_OK, each;
    if (p->desc.hash_every && p->stamp.step % p->desc.hash_every == 0) {
        p->state_hash = jsl_world_hash(p->world);
        p->hashed = true;
    }
    if (is_due(p, JSL_BULK_KEYFRAME) && (each = jsl_publish_keyframe(p)) != JSL_OK) r = each;
    for (int b = 0; b < JSL_BULK_KEYFRAME; b++) {
        bool due = is_due(p, (jsl_bulk)b);
        if (b == JSL_BULK_BODIES && due && (each = jsl_publish_body_info(p)) != JSL_OK) r = each;
        if ((each = jsl_publish_bulk(p, (jsl_bulk)b, due)) != JSL_OK) r = each;
    }
    if ((each = jsl_publish_components(p, is_due(p, JSL_BULK_COLUMNS))) != JSL_OK) r = each;
    jsl_publish_diag(p);
    jsl_publish_timing(p);
    jsl_publish_index(p);
    double now = jsl_seconds();
    if (now - p->stats_wall >= 1.0) {
        p->stats_wall = now;
        jsl_publish_stats(p);
    }
    return r;
}

jsl_result jsl_publisher_step(jsl_publisher *p, const jsl_warnings *warnings) {
    if (!p) return JSL_ERR_ARGUMENT;
    (void)warnings; /* no message of the schema carries them yet */
    take_stamp(p);
    jsl_publish_view(p);
    return publish_all(p);
}

/* -- Accounts
 * ------------------------------------------------------------------------------------------ */

static jsl_frame_counts frame_counts(const jsl_outlet *out, const jsl_sink_counts *sink) {
    jsl_frame_counts c = {0};
    for (int b = 0; b < JSL_BULK_COUNT; b++) {
        if (b == JSL_BULK_KEYFRAME) continue;
        c.offered += out->bulk[b].offered;
        c.sent += out->bulk[b].queued - sink->frame_errors[b];
        c.dropped += out->bulk[b].dropped;
        c.decimated += out->bulk[b].decimated;
        c.errors += sink->frame_errors[b];
    }
    return c;
}

static void fill_stats(jsl_publisher *p, const jsl_sink_counts *log, const jsl_sink_counts *live,
                       jsl_publisher_stats *out) {
    const jsl_outlet *to = p->outlet;
    *out = (jsl_publisher_stats){.log = frame_counts(&to[JSL_TO_LOG], log),
                                 .live = frame_counts(&to[JSL_TO_LIVE], live),
                                 .log_events = log->events,
                                 .log_bytes = log->bytes,
                                 .log_errors = log->errors,
                                 .live_events = live->events,
                                 .live_bytes = live->bytes,
                                 .live_errors = live->errors,
                                 .small_dropped = p->small_dropped};
    const jsl_frame_counts *c = to[JSL_TO_LOG].on ? &out->log : &out->live;
    out->frames_offered = c->offered;
    out->frames_sent = c->sent;
    out->frames_dropped = c->dropped;
    out->frames_decimated = c->decimated;
    out->send_errors = c->errors;
    const jsl_bulk_counts *k = &to[JSL_TO_LOG].bulk[JSL_BULK_KEYFRAME];
    out->keyframes = k->queued - log->frame_errors[JSL_BULK_KEYFRAME];
    out->keyframes_dropped = k->dropped;
    out->clamped_times = to[to[JSL_TO_LOG].on ? JSL_TO_LOG : JSL_TO_LIVE].ring.clamped;
    out->queue_peak_bytes = to[JSL_TO_LOG].ring.peak;
}

void jsl_publisher_get_stats(jsl_publisher *p, jsl_publisher_stats *out) {
    jsl_sink_counts log = {0}, live = {0};
    if (!p) {
        *out = (jsl_publisher_stats){0};
        return;
    }
    if (p->writer) jsl_log_writer_counts(p->writer, &log);
    if (p->live) jsl_live_counts(p->live, &live);
    fill_stats(p, &log, &live, out);
}

jsl_result jsl_publisher_close(jsl_publisher *p, jsl_publisher_stats *out) {
    if (out) *out = (jsl_publisher_stats){0};
    if (!p) return JSL_OK;
    p->closing = true;
    p->stamp.wall_us = wall_us();
    jsl_publish_stats(p);
    jsl_publish_index(p);
    jsl_sink_counts log = {0}, live = {0};
    jsl_live_close(p->live, &live);
    jsl_result r = jsl_log_writer_close(p->writer, &log);
    if (out) fill_stats(p, &log, &live, out);
    tear_down(p);
    return r;
}
