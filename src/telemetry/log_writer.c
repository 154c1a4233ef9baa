/* SPDX-License-Identifier: MIT
 * log_writer.c - events from the ring into a file, on a thread of its own.
 *
 * After the first failure nothing more is written, the file is cut back to its last whole event,
 * and everything that still comes is counted as lost: the simulation goes on.
 */
#include "telemetry/log_writer.h"

#include "telemetry/state.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#define SPAN_MAX (4 << 20) /* bytes of one write: after each the ring gets its room back */
#define SYNC_SECONDS 1.0

struct jsl_log_writer {
    jsl_memory *memory;
    jsl_logger logger;
    jsl_ring *ring;
    int file;
    bool created, failed, dirty, syncs; /* syncs: a regular file */
    double synced;
    int64_t good; /* bytes of whole events in the file */
    pthread_t thread;
    pthread_mutex_t lock;
    jsl_sink_counts counts;
};

const char *jsl_bulk_channel(jsl_bulk bulk) {
    static const char *const channels[JSL_BULK_COUNT] = {"JOSTLE_PARTICLES", "JOSTLE_BOIDS",
                                                         "JOSTLE_BODIES", "JOSTLE_KEYFRAME",
                                                         "JOSTLE_COLUMNS"};
    return channels[bulk];
}

jsl_frame_part jsl_event_frame_part(const jsl_event *event, jsl_bulk *bulk) {
    if (event->size < JSL_AT_CHUNK_COUNT + 4) return JSL_PART_NONE;
    for (int b = 0; b < JSL_BULK_COUNT; b++) {
        const char *channel = jsl_bulk_channel((jsl_bulk)b);
        if ((size_t)event->channel_size != strlen(channel) ||
            memcmp(event->channel, channel, (size_t)event->channel_size) != 0)
            continue;
        *bulk = (jsl_bulk)b;
        bool last = jsl_get_u32(event->data + JSL_AT_CHUNK_INDEX) + 1 ==
                    jsl_get_u32(event->data + JSL_AT_CHUNK_COUNT);
        return last ? JSL_PART_LAST_CHUNK : JSL_PART_CHUNK;
    }
    return JSL_PART_NONE;
}

static void fail(jsl_log_writer *w, const char *what) {
    w->failed = true;
    int code = errno;
    if (w->syncs && ftruncate(w->file, (off_t)w->good) != 0) w->syncs = false;
    jsl_fail(&w->logger, JSL_ERR_IO,
             "log: %s failed after %lld bytes: %s; the simulation goes on without a log", what,
             (long long)w->good, strerror(code));
}

/* How many of the bytes got written. */
static int64_t write_bytes(jsl_log_writer *w, const uint8_t *p, int64_t bytes) {
    int64_t done = 0;
    while (done < bytes) {
        ssize_t n = write(w->file, p + done, (size_t)(bytes - done));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        done += n;
    }
    return done;
}

/* The whole events at the start of a span, at most `limit` bytes of them. */
static int64_t whole_events(const uint8_t *span, int64_t bytes, int64_t limit, int64_t *events) {
    int64_t at = 0;
    *events = 0;
    while (at < bytes) {
        int64_t next = at + jsl_event_at(span + at).bytes;
        if (next > limit) break;
        at = next;
        ++*events;
    }
    return at;
}

static void account(jsl_log_writer *w, const uint8_t *span, int64_t bytes, int64_t events,
                    bool written) {
    pthread_mutex_lock(&w->lock);
    if (written) {
        w->counts.events += events;
        w->counts.bytes += bytes;
    } else {
        w->counts.errors += events;
        for (int64_t at = 0; at < bytes;) {
            jsl_event e = jsl_event_at(span + at);
            jsl_bulk bulk;
            if (jsl_event_frame_part(&e, &bulk) == JSL_PART_LAST_CHUNK)
                w->counts.frame_errors[bulk]++;
            at += e.bytes;
        }
    }
    pthread_mutex_unlock(&w->lock);
}

static void sync_file(jsl_log_writer *w, bool closing) {
    double now = jsl_seconds();
    if (w->failed || !w->syncs || !w->dirty || (!closing && now - w->synced < SYNC_SECONDS)) return;
    w->dirty = false;
    w->synced = now;
    if (fdatasync(w->file) != 0 && errno != EINVAL && errno != EROFS) {
        fail(w, "fdatasync");
        pthread_mutex_lock(&w->lock);
        w->counts.errors++;
        pthread_mutex_unlock(&w->lock);
    }
}

static void write_span(jsl_log_writer *w, const uint8_t *span, int64_t bytes) {
    int64_t events, lost;
    int64_t done = w->failed ? 0 : write_bytes(w, span, bytes);
    int64_t whole = whole_events(span, bytes, done, &events);
    w->good += whole;
    w->dirty |= whole > 0;
    if (!w->failed && done < bytes) fail(w, "write");
    account(w, span, whole, events, true);
    whole_events(span + whole, bytes - whole, bytes - whole, &lost);
    account(w, span + whole, bytes - whole, lost, false);
}

static void *run(void *arg) {
    jsl_log_writer *w = arg;
    for (bool closed = false; !closed;) {
        const uint8_t *span;
        int64_t bytes = jsl_ring_take(w->ring, SYNC_SECONDS, &span, &closed), events;
        if (bytes > 0) {
            bytes = whole_events(span, bytes, SPAN_MAX, &events);
            write_span(w, span, bytes);
            jsl_ring_release(w->ring, bytes);
        }
        sync_file(w, closed);
    }
    return NULL;
}

jsl_result jsl_log_writer_open(jsl_memory *memory, const jsl_logger *logger, const char *path,
                               jsl_ring *ring, jsl_log_writer **out) {
    bool created = true;
    int file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0 && errno == EEXIST) {
        created = false;
        file = open(path, O_WRONLY | O_CLOEXEC);
    }
    if (file < 0)
        return jsl_fail(logger, JSL_ERR_IO, "log '%s' cannot be written: %s", path,
                        strerror(errno));
    struct stat st;
    bool regular = fstat(file, &st) == 0 && S_ISREG(st.st_mode);
    jsl_result r = JSL_OK;
    jsl_log_writer *w = NULL;
    if (regular && ftruncate(file, 0) != 0)
        r = jsl_fail(logger, JSL_ERR_IO, "log '%s' cannot be emptied: %s", path, strerror(errno));
    else if (!(w = jsl_alloc_zero(memory, sizeof *w)))
        r = JSL_ERR_MEMORY;
    if (r == JSL_OK) {
        w->memory = memory;
        if (logger) w->logger = *logger;
        w->ring = ring;
        w->file = file;
        w->created = created;
        w->syncs = regular;
        w->synced = jsl_seconds();
        pthread_mutex_init(&w->lock, NULL);
        if (pthread_create(&w->thread, NULL, run, w) == 0) {
            *out = w;
            return JSL_OK;
        }
        r = jsl_fail(logger, JSL_ERR_UNSUPPORTED, "log: the writer's thread cannot be started");
        pthread_mutex_destroy(&w->lock);
        jsl_free(memory, w, sizeof *w);
    }
    close(file);
    if (created) unlink(path);
    return r;
}

void jsl_log_writer_counts(jsl_log_writer *w, jsl_sink_counts *out) {
    pthread_mutex_lock(&w->lock);
    *out = w->counts;
    pthread_mutex_unlock(&w->lock);
}

jsl_result jsl_log_writer_close(jsl_log_writer *w, jsl_sink_counts *out) {
    if (!w) return JSL_OK;
    jsl_ring_close(w->ring);
    pthread_join(w->thread, NULL);
    /* Network file systems report late. */
    if (close(w->file) != 0 && !w->failed) {
        w->failed = true;
        w->counts.errors++;
    }
    bool failed = w->failed;
    *out = w->counts;
    pthread_mutex_destroy(&w->lock);
    jsl_free(w->memory, w, sizeof *w);
    return failed ? JSL_ERR_IO : JSL_OK;
}

void jsl_log_writer_abandon(jsl_log_writer *w, const char *path) {
    if (!w) return;
    bool created = w->created;
    jsl_sink_counts counts;
    jsl_log_writer_close(w, &counts);
    if (created) unlink(path);
}
