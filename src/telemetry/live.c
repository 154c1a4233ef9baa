/* SPDX-License-Identifier: MIT
 * live.c - events from the ring onto an LCM network, on a thread of its own.
 *
 * Sending is paced: LCM's receivers lose what comes in bursts larger than their socket buffer,
 * whatever the average rate. Channels that a late joiner needs (schema, scene, shapes, body table)
 * are kept and sent again once a second.
 */
#include "telemetry/live.h"

#include <arpa/inet.h>
#include <errno.h>
#include <lcm/lcm.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

/* Default Linux socket buffers hold 208 KiB: bursts of half of that, 200 MB/s in the long run. */
#define BURST_BYTES (100 << 10)
#define BYTES_PER_SECOND 200e6
#define RETAIN_SECONDS 1.0
#define RETAIN_MAX 256 /* datagrams: 16 MB of scene */

typedef struct retained {
    char channel[64];
    uint32_t chunk;
    uint8_t *data; /* malloc: this thread only */
    int64_t size, cap;
} retained;

struct jsl_live {
    jsl_memory *memory;
    jsl_logger logger;
    jsl_ring *ring;
    lcm_t *lcm;
    pthread_t thread;
    pthread_mutex_t lock;
    jsl_sink_counts counts;
    bool told;                   /* the first failure was reported */
    bool broken[JSL_BULK_COUNT]; /* a chunk of the present frame was not sent */
    double credit, last;         /* bytes that may be sent now; when that was computed */
    double republished;
    int kept;
    retained keep[RETAIN_MAX];
};

/* -- Opening --------------------------------------------------------------------------------------
 */

/* Whether a datagram to the URL's multicast group has somewhere to go. Sends nothing. */
static bool has_route(const char *url) {
    char host[64] = "239.255.76.67";
    if (url && strncmp(url, "udpm://", 7) == 0) {
        size_t n = strcspn(url + 7, ":?/");
        if (n > 0 && n < sizeof host) {
            memcpy(host, url + 7, n);
            host[n] = 0;
        }
    } else if (url && *url) {
        return true;
    }
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(7667)};
    if (inet_pton(AF_INET, host, &to.sin_addr) != 1) return true;
    int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (s < 0) return true;
    bool ok = connect(s, (struct sockaddr *)&to, sizeof to) == 0 || errno != ENETUNREACH;
    close(s);
    return ok;
}

/* liblcm prints when it does not know a provider, so it is asked for those that it has only. */
static bool known_provider(const char *url) {
    static const char *const provider[] = {"udpm://", "mpudpm://", "tcpq://", "memq://", "file://"};
    if (!url || !url[0]) return true;
    for (int i = 0; i < JSL_COUNT(provider); i++)
        if (strncmp(url, provider[i], strlen(provider[i])) == 0) return true;
    return false;
}

jsl_result jsl_lcm_open(const char *url, const jsl_logger *logger, struct _lcm_t **out) {
    if (!known_provider(url))
        return jsl_fail(logger, JSL_ERR_UNSUPPORTED,
                        "LCM '%s': must begin with udpm://, tcpq:// or memq://", url);
    if (!has_route(url))
        return jsl_fail(logger, JSL_ERR_UNSUPPORTED,
                        "LCM '%s': no route for multicast; as root: 'ip link set lo multicast on' "
                        "and 'ip route add 224.0.0.0/4 dev lo'",
                        url ? url : "default");
    lcm_t *lcm = lcm_create(url);
    if (!lcm)
        return jsl_fail(logger, JSL_ERR_UNSUPPORTED, "LCM '%s' cannot be opened",
                        url ? url : "default");
    *out = lcm;
    return JSL_OK;
}

/* -- Sending --------------------------------------------------------------------------------------
 */

static void sleep_seconds(double seconds) {
    struct timespec t = {(time_t)seconds, (long)((seconds - (double)(time_t)seconds) * 1e9)};
    nanosleep(&t, NULL);
}

static void pace(jsl_live *live, int64_t bytes) {
    double now = jsl_seconds();
    live->credit += (now - live->last) * BYTES_PER_SECOND;
    if (live->credit > BURST_BYTES) live->credit = BURST_BYTES;
    live->last = now;
    live->credit -= (double)bytes;
    if (live->credit < 0) sleep_seconds(-live->credit / BYTES_PER_SECOND);
}

static bool send_event(jsl_live *live, const char *channel, const uint8_t *data, int64_t size) {
    pace(live, size);
    if (lcm_publish(live->lcm, channel, data, (unsigned int)size) == 0) return true;
    if (!live->told)
        jsl_fail(&live->logger, JSL_ERR_IO, "LCM: sending on %s failed: %s", channel,
                 strerror(errno));
    live->told = true;
    return false;
}

/* Chunk index of a message that late joiners need; false for others. */
static bool is_retained(const uint8_t *data, int64_t size, uint32_t *chunk) {
    *chunk = 0;
    switch (jsl_lcm_type_of(data, size)) {
    case JSL_LCM_SCHEMA:
    case JSL_LCM_SCENE:
        return true;
    case JSL_LCM_SHAPES:
    case JSL_LCM_BODY_INFO:
    case JSL_LCM_SCENE_TEXT:
        if (size < 48) return false;
        *chunk = jsl_get_u32(data + 44); /* after the stamp and scene_rev */
        return true;
    default:
        return false;
    }
}

static void retain(jsl_live *live, const char *channel, uint32_t chunk, const uint8_t *data,
                   int64_t size) {
    int i = 0, n = 0;
    for (; chunk == 0 && i < live->kept; i++) { /* a new table: the chunks of the old one go */
        retained *r = &live->keep[i];
        if (strcmp(r->channel, channel) == 0)
            free(r->data);
        else
            live->keep[n++] = *r;
    }
    if (chunk == 0) live->kept = n;
    if (live->kept == RETAIN_MAX) return;
    retained *r = &live->keep[live->kept];
    *r = (retained){.chunk = chunk, .size = size, .cap = size, .data = malloc((size_t)size)};
    if (!r->data) return;
    memcpy(r->data, data, (size_t)size);
    snprintf(r->channel, sizeof r->channel, "%s", channel);
    live->kept++;
}

static void republish(jsl_live *live) {
    double now = jsl_seconds();
    if (now - live->republished < RETAIN_SECONDS) return;
    live->republished = now;
    for (int i = 0; i < live->kept; i++)
        send_event(live, live->keep[i].channel, live->keep[i].data, live->keep[i].size);
}

static void send_span(jsl_live *live, const uint8_t *span, int64_t bytes) {
    for (int64_t at = 0; at < bytes;) {
        jsl_event e = jsl_event_at(span + at);
        char channel[64];
        uint32_t chunk;
        jsl_bulk bulk;
        snprintf(channel, sizeof channel, "%.*s", e.channel_size, e.channel);
        bool sent = send_event(live, channel, e.data, e.size);
        if (is_retained(e.data, e.size, &chunk)) retain(live, channel, chunk, e.data, e.size);
        pthread_mutex_lock(&live->lock);
        live->counts.events += sent;
        live->counts.bytes += sent ? e.size : 0;
        live->counts.errors += !sent;
        jsl_frame_part part = jsl_event_frame_part(&e, &bulk);
        if (part != JSL_PART_NONE && !sent) live->broken[bulk] = true;
        if (part == JSL_PART_LAST_CHUNK) {
            live->counts.frame_errors[bulk] += live->broken[bulk];
            live->broken[bulk] = false;
        }
        pthread_mutex_unlock(&live->lock);
        at += e.bytes;
        jsl_ring_release(live->ring, e.bytes);
        republish(live);
    }
}

static void *run(void *arg) {
    jsl_live *live = arg;
    for (bool closed = false; !closed;) {
        const uint8_t *span;
        int64_t bytes = jsl_ring_take(live->ring, 0.25, &span, &closed);
        send_span(live, span, bytes);
        republish(live);
    }
    return NULL;
}

jsl_result jsl_live_open(jsl_memory *memory, const jsl_logger *logger, const char *url,
                         jsl_ring *ring, jsl_live **out) {
    lcm_t *lcm;
    JSL_TRY(jsl_lcm_open(url, logger, &lcm));
    jsl_live *live = jsl_alloc_zero(memory, sizeof *live);
    if (!live) {
        lcm_destroy(lcm);
        return JSL_ERR_MEMORY;
    }
    live->memory = memory;
    if (logger) live->logger = *logger;
    live->ring = ring;
    live->lcm = lcm;
    live->last = live->republished = jsl_seconds();
    pthread_mutex_init(&live->lock, NULL);
    if (pthread_create(&live->thread, NULL, run, live) == 0) {
        *out = live;
        return JSL_OK;
    }
    pthread_mutex_destroy(&live->lock);
    lcm_destroy(lcm);
    jsl_free(memory, live, sizeof *live);
    return jsl_fail(logger, JSL_ERR_UNSUPPORTED, "LCM: the sender's thread cannot be started");
}

void jsl_live_counts(jsl_live *live, jsl_sink_counts *out) {
    pthread_mutex_lock(&live->lock);
    *out = live->counts;
    pthread_mutex_unlock(&live->lock);
}

void jsl_live_close(jsl_live *live, jsl_sink_counts *out) {
    if (!live) return;
    jsl_ring_close(live->ring);
    pthread_join(live->thread, NULL);
    *out = live->counts;
    for (int i = 0; i < live->kept; i++) free(live->keep[i].data);
    lcm_destroy(live->lcm);
    pthread_mutex_destroy(&live->lock);
    jsl_free(live->memory, live, sizeof *live);
}
