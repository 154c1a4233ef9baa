/* SPDX-License-Identifier: MIT
 * bench_telemetry.c - encoding beside memcpy, the log beside write(2), the reader beside LCM's own.
 */
#include "bench.h"

#include "telemetry/column.h"
#include "telemetry/log_writer.h"
#include "telemetry/state.h"

#include <jostle/telemetry.h>

#include <fcntl.h>
#include <lcm/lcm.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PARTICLES 1000000
#define ROUNDS 7

typedef struct columns {
    jsl_real *v[3];
    float *narrow[3]; /* what memcpy copies: the bytes of f32 */
    uint8_t *out;
} columns;

static int make_columns(columns *c) {
    memset(c, 0, sizeof *c);
    c->out = malloc((size_t)PARTICLES * 12 + (8 << 20));
    int ok = c->out != NULL;
    for (int k = 0; k < 3; k++) {
        c->v[k] = malloc(PARTICLES * sizeof(jsl_real));
        c->narrow[k] = malloc(PARTICLES * sizeof(float));
        ok = ok && c->v[k] && c->narrow[k];
        for (int i = 0; ok && i < PARTICLES; i++) {
            uint64_t bits = jsl_mix64((uint64_t)i * 3 + (uint64_t)k);
            c->v[k][i] = (jsl_real)(bits >> 40) * JSL_R(1e-6);
            c->narrow[k][i] = (float)c->v[k][i];
        }
    }
    if (ok) memset(c->out, 1, (size_t)PARTICLES * 12 + (8 << 20));
    return ok;
}

static void free_columns(columns *c) {
    free(c->out);
    for (int k = 0; k < 3; k++) {
        free(c->v[k]);
        free(c->narrow[k]);
    }
}

/* -- Encoding
 * --------------------------------------------------------------------------------------- */

/* Seconds to write a frame of positions as chunks, CRC included, as the publisher does. */
static double encode_frame(const columns *c, int encoding) {
    jsl_state_segment segment = {.count = PARTICLES};
    for (int k = 0; k < 3; k++) segment.data[0][k] = c->v[k];
    jsl_state_frame f = {
        .total = PARTICLES, .column_count = 1, .segment = &segment, .segment_count = 1};
    f.column[0] = (jsl_state_column){JSL_FIELD_POS, encoding, 3, JSL_SOURCE_REAL, {0}};
    const char *channel = jsl_bulk_channel(JSL_BULK_PARTICLES);
    int64_t each = jsl_state_chunk_elements(&f, channel),
            count = jsl_state_chunk_count(&f, channel);
    double best = 1e9;
    for (int round = 0; round < ROUNDS; round++) {
        double t = jsl_seconds();
        uint8_t *out = c->out;
        for (int64_t i = 0; i < count; i++) {
            int64_t first = i * each, n = PARTICLES - first < each ? PARTICLES - first : each;
            out += jsl_state_encode(&f, (int32_t)i, (int32_t)count, first, n, out);
        }
        t = jsl_seconds() - t;
        best = t < best ? t : best;
    }
    return best;
}

/* The same elements by jsl_column_encode alone: no chunks, no checksum. */
static double encode_columns(const columns *c, int encoding) {
    double best = 1e9;
    for (int round = 0; round < ROUNDS; round++) {
        double t = jsl_seconds();
        for (int k = 0; k < 3; k++) {
            float lo = 0, hi = 0;
            if (encoding == JSL_ENC_U16Q) jsl_column_range(c->narrow[k], PARTICLES, &lo, &hi);
            jsl_column_encode(encoding, c->narrow[k], PARTICLES, lo, jsl_column_step(lo, hi),
                              c->out + (int64_t)k * PARTICLES * 4);
        }
        t = jsl_seconds() - t;
        best = t < best ? t : best;
    }
    return best;
}

static double copy_columns(const columns *c) {
    double best = 1e9;
    for (int round = 0; round < ROUNDS; round++) {
        double t = jsl_seconds();
        for (int k = 0; k < 3; k++)
            memcpy(c->out + (int64_t)k * PARTICLES * 4, c->narrow[k], PARTICLES * 4);
        t = jsl_seconds() - t;
        best = t < best ? t : best;
    }
    return best;
}

static void bench_encode(const columns *c, jsl_bench_emit *emit) {
    const double gb = 12e-9 * PARTICLES;
    double copy = copy_columns(c);
    const struct {
        const char *columns, *frame;
        int encoding;
    } cases[] = {{"column-f32", "frame-f32", JSL_ENC_F32},
                 {"column-f16", "frame-f16", JSL_ENC_F16},
                 {"column-u16", "frame-u16", JSL_ENC_U16Q}};
    for (int i = 0; i < 3; i++) {
        double t = encode_columns(c, cases[i].encoding);
        emit(cases[i].columns, PARTICLES, 1, gb / t, "GB/s of f32", "memcpy", gb / copy);
        t = encode_frame(c, cases[i].encoding);
        emit(cases[i].frame, PARTICLES, 1, t * 1e3, "ms", "memcpy", copy * 1e3);
    }
}

/* -- Writing
 * ---------------------------------------------------------------------------------------- */

#define LOG_EVENTS 6000
#define LOG_PAYLOAD 65000

static int64_t write_plain(const char *path, const uint8_t *bytes, double *seconds) {
    double t = jsl_seconds();
    int f = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (f < 0) return -1;
    int64_t total = 0;
    for (int i = 0; i < LOG_EVENTS; i++) {
        ssize_t n = write(f, bytes, LOG_PAYLOAD + 44);
        if (n < 0) break;
        total += n;
    }
    fdatasync(f);
    close(f);
    *seconds = jsl_seconds() - t;
    return total;
}

static int64_t write_log(const char *path, const uint8_t *bytes, double *seconds) {
    jsl_memory memory;
    jsl_ring ring;
    jsl_log_writer *writer;
    jsl_sink_counts counts = {0};
    if (jsl_memory_init(&memory, (jsl_allocator){0}) != JSL_OK ||
        jsl_ring_init(&ring, &memory, 64 << 20) != JSL_OK)
        return -1;
    double t = jsl_seconds();
    if (jsl_log_writer_open(&memory, NULL, path, &ring, &writer) == JSL_OK) {
        for (int i = 0; i < LOG_EVENTS; i++) {
            uint8_t *to = jsl_ring_reserve(&ring, "JOSTLE_PARTICLES", LOG_PAYLOAD, true);
            memcpy(to, bytes, LOG_PAYLOAD);
            jsl_ring_commit(&ring, "JOSTLE_PARTICLES", LOG_PAYLOAD, i);
            jsl_ring_publish(&ring);
        }
        (void)jsl_log_writer_close(writer, &counts);
        *seconds = jsl_seconds() - t;
    }
    jsl_ring_fini(&ring, &memory);
    return counts.bytes;
}

static int bench_write(const char *path, const uint8_t *bytes, jsl_bench_emit *emit) {
    double ours = 1e9, plain = 1e9;
    int64_t total = 0;
    for (int round = 0; round < 3; round++) { /* alternately: the disk's mood changes */
        double t = 1e9;
        if (write_plain(path, bytes, &t) < 0) return 1;
        plain = t < plain ? t : plain;
        unlink(path);
        total = write_log(path, bytes, &t);
        if (total <= 0) return 1;
        ours = t < ours ? t : ours;
        if (round < 2) unlink(path); /* the last is read below */
    }
    emit("log-write", LOG_EVENTS, 2, 1e-6 * (double)total / ours, "MB/s", "write(2)",
         1e-6 * (double)total / plain);
    return 0;
}

/* -- Reading
 * ---------------------------------------------------------------------------------------- */

static int bench_read(const char *path, int64_t events, const char *bench_case,
                      jsl_bench_emit *emit) {
    double ours = 1e9, theirs = 1e9;
    for (int round = 0; round < 3; round++) {
        jsl_log_file *log;
        jsl_log_event e;
        int64_t n = 0, m = 0;
        double t = jsl_seconds();
        if (jsl_log_open(path, NULL, &log) != JSL_OK) return 1;
        while (jsl_log_next(log, &e) == JSL_OK) n++;
        jsl_log_close(log);
        t = jsl_seconds() - t;
        ours = t < ours ? t : ours;
        t = jsl_seconds();
        lcm_eventlog_t *stock = lcm_eventlog_create(path, "r");
        if (!stock) return 1;
        for (lcm_eventlog_event_t *event; (event = lcm_eventlog_read_next_event(stock)); m++)
            lcm_eventlog_free_event(event);
        lcm_eventlog_destroy(stock);
        t = jsl_seconds() - t;
        theirs = t < theirs ? t : theirs;
        if (n != events || m != events) return 1;
    }
    emit(bench_case, events, 1, (double)events / ours, "events/s", "lcm_eventlog_read_next_event",
         (double)events / theirs);
    return 0;
}

static int write_small_events(const char *path, int64_t events) {
    uint8_t event[JSL_EVENT_HEAD + 4 + 1000] = {0};
    FILE *f = fopen(path, "wb");
    if (!f) return 1;
    memcpy(event + JSL_EVENT_HEAD, "TEST", 4);
    for (int64_t i = 0; i < events; i++) {
        jsl_event_put_head(event, i, i, 4, 1000);
        if (fwrite(event, sizeof event, 1, f) != 1) break;
    }
    return fclose(f);
}

int jsl_bench_telemetry(jsl_bench_emit *emit) {
    columns c;
    char path[300];
    const char *dir = getenv("TMPDIR");
    snprintf(path, sizeof path, "%s/jostle-bench-%d.lcmlog", dir ? dir : "/tmp", (int)getpid());
    int bad = !make_columns(&c);
    if (!bad) {
        bench_encode(&c, emit);
        bad = bench_write(path, c.out, emit);
        bad = bad || bench_read(path, LOG_EVENTS, "hop-65kB", emit);
        bad = bad || write_small_events(path, 300000) || bench_read(path, 300000, "hop-1kB", emit);
        unlink(path);
    }
    free_columns(&c);
    return bad;
}
