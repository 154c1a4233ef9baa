/* SPDX-License-Identifier: MIT
 * ring.c - the queue between the step thread and a consumer: a buffer with one wrap point, so that
 * every event is contiguous.
 */
#include "telemetry/ring.h"

#include <time.h>

void jsl_event_put_head(uint8_t *out, int64_t number, int64_t timestamp_us, uint32_t channel_size,
                        uint32_t data_size) {
    jsl_put_u32(out, JSL_EVENT_SYNC);
    jsl_put_u64(out + 4, (uint64_t)number);
    jsl_put_u64(out + 12, (uint64_t)timestamp_us);
    jsl_put_u32(out + 20, channel_size);
    jsl_put_u32(out + 24, data_size);
}

jsl_event jsl_event_at(const uint8_t *p) {
    jsl_event e = {.number = (int64_t)jsl_get_u64(p + 4),
                   .timestamp_us = (int64_t)jsl_get_u64(p + 12),
                   .channel_size = (int)jsl_get_u32(p + 20),
                   .size = (int64_t)jsl_get_u32(p + 24)};
    e.channel = (const char *)p + JSL_EVENT_HEAD;
    e.data = p + JSL_EVENT_HEAD + e.channel_size;
    e.bytes = JSL_EVENT_HEAD + e.channel_size + e.size;
    return e;
}

jsl_result jsl_ring_init(jsl_ring *ring, jsl_memory *memory, int64_t cap) {
    *ring = (jsl_ring){.cap = cap, .timestamp = INT64_MIN};
    ring->at = jsl_alloc(memory, (size_t)cap);
    if (!ring->at) return JSL_ERR_MEMORY;
    pthread_condattr_t attr;
    pthread_condattr_init(&attr);
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    pthread_mutex_init(&ring->lock, NULL);
    pthread_cond_init(&ring->filled, &attr);
    pthread_cond_init(&ring->emptied, &attr);
    pthread_condattr_destroy(&attr);
    return JSL_OK;
}

void jsl_ring_fini(jsl_ring *ring, jsl_memory *memory) {
    if (!ring->at) return;
    pthread_mutex_destroy(&ring->lock);
    pthread_cond_destroy(&ring->filled);
    pthread_cond_destroy(&ring->emptied);
    jsl_free(memory, ring->at, (size_t)ring->cap);
    *ring = (jsl_ring){0};
}

/* -- Producer ---------------------------------------------------------------------------------- */

/* Where an event of that size can go; the lock is held. One byte stays free so that full and empty
 * differ.
 */
static bool place(jsl_ring *ring, int64_t bytes, int64_t *at) {
    if (!ring->used && !ring->group_bytes) ring->read = ring->write = ring->next = ring->limit = 0;
    *at = ring->next;
    if (ring->next < ring->read) return ring->read - ring->next > bytes;
    if (ring->cap - ring->next >= bytes) return true;
    *at = 0;
    return ring->read > bytes;
}

bool jsl_ring_fits(jsl_ring *ring, int64_t bytes, int64_t reserve) {
    pthread_mutex_lock(&ring->lock);
    int64_t free =
        ring->next < ring->read ? ring->read - ring->next : ring->cap - ring->next + ring->read;
    pthread_mutex_unlock(&ring->lock);
    /* The wrap may waste less than one event at the end of the buffer. */
    return bytes + reserve + JSL_EVENT_MAX + 1 <= free;
}

uint8_t *jsl_ring_reserve(jsl_ring *ring, const char *channel, int64_t cap, bool wait) {
    int64_t head = JSL_EVENT_HEAD + (int64_t)strlen(channel), at;
    pthread_mutex_lock(&ring->lock);
    while (!place(ring, head + cap, &at)) {
        if (!wait || head + cap >= ring->cap / 2) {
            pthread_mutex_unlock(&ring->lock);
            return NULL;
        }
        if (ring->group_bytes) {
            pthread_mutex_unlock(&ring->lock);
            jsl_ring_publish(ring);
            pthread_mutex_lock(&ring->lock);
            continue;
        }
        pthread_cond_wait(&ring->emptied, &ring->lock);
    }
    pthread_mutex_unlock(&ring->lock);
    if (at != ring->next) {
        ring->next_limit = ring->next;
        ring->next = at;
    }
    return ring->at + at + head;
}

int64_t jsl_ring_commit(jsl_ring *ring, const char *channel, int64_t size, int64_t timestamp_us) {
    size_t channel_size = strlen(channel);
    uint8_t *event = ring->at + ring->next;
    int64_t bytes = JSL_EVENT_HEAD + (int64_t)channel_size + size, begin = ring->stream;
    if (timestamp_us < ring->timestamp) {
        timestamp_us = ring->timestamp;
        ring->clamped++;
    }
    ring->timestamp = timestamp_us;
    jsl_event_put_head(event, ring->number++, timestamp_us, (uint32_t)channel_size, (uint32_t)size);
    memcpy(event + JSL_EVENT_HEAD, channel, channel_size);
    ring->next += bytes;
    ring->group_bytes += bytes;
    ring->stream += bytes;
    return begin;
}

void jsl_ring_publish(jsl_ring *ring) {
    pthread_mutex_lock(&ring->lock);
    if (ring->group_bytes) {
        if (ring->next_limit) ring->limit = ring->next_limit;
        ring->next_limit = 0;
        ring->write = ring->next;
        ring->used += ring->group_bytes;
        ring->peak = ring->used > ring->peak ? ring->used : ring->peak;
        ring->group_bytes = 0;
        pthread_cond_signal(&ring->filled);
    }
    pthread_mutex_unlock(&ring->lock);
}

void jsl_ring_close(jsl_ring *ring) {
    jsl_ring_publish(ring);
    pthread_mutex_lock(&ring->lock);
    ring->closing = true;
    pthread_cond_signal(&ring->filled);
    pthread_mutex_unlock(&ring->lock);
}

/* -- Consumer ---------------------------------------------------------------------------------- */

int64_t jsl_ring_take(jsl_ring *ring, double seconds, const uint8_t **span, bool *closed) {
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    int64_t ns = until.tv_nsec + (int64_t)(seconds * 1e9);
    until.tv_sec += (time_t)(ns / 1000000000);
    until.tv_nsec = (long)(ns % 1000000000);
    pthread_mutex_lock(&ring->lock);
    int late = 0;
    while (!ring->used && !ring->closing && !late)
        late = pthread_cond_timedwait(&ring->filled, &ring->lock, &until);
    if (ring->used && ring->write <= ring->read && ring->limit == ring->read) {
        ring->read = 0; /* the run at the end of the buffer is used up */
        ring->limit = 0;
    }
    int64_t end = !ring->used ? ring->read : ring->write > ring->read ? ring->write : ring->limit;
    *span = ring->at + ring->read;
    *closed = ring->closing && !ring->used;
    int64_t bytes = end - ring->read;
    pthread_mutex_unlock(&ring->lock);
    return bytes;
}

void jsl_ring_release(jsl_ring *ring, int64_t bytes) {
    pthread_mutex_lock(&ring->lock);
    ring->read += bytes;
    ring->used -= bytes;
    if (ring->limit && ring->read == ring->limit) {
        ring->read = 0;
        ring->limit = 0;
    }
    pthread_cond_signal(&ring->emptied);
    pthread_mutex_unlock(&ring->lock);
}
