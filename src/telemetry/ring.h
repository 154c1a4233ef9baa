/* SPDX-License-Identifier: MIT
 * A bounded queue of LCM log events between the step thread and one consumer thread. Floor 6.
 *
 * Its bytes are those of an event log: a consumer may write spans of it to a file as they are. The
 * producer adds events to a group and publishes the group at once, so that a frame is there whole
 * or not at all.
 */
#ifndef JSL_TELEMETRY_RING_H
#define JSL_TELEMETRY_RING_H

#include "telemetry/message.h"

#include <pthread.h>

#define JSL_EVENT_SYNC 0xeda1da01u
#define JSL_EVENT_HEAD 28 /* sync 4, number 8, timestamp 8, channel size 4, data size 4 */
#define JSL_EVENT_MAX (JSL_EVENT_HEAD + 65536)

typedef struct jsl_ring {
    uint8_t *at;
    int64_t cap;
    /* Producer's own: where the next event goes, and what is in the group that is not published
     * yet. */
    int64_t next, next_limit, group_bytes;
    int64_t number;    /* of the next event */
    int64_t timestamp; /* us, of the last event: they never go back */
    int64_t stream;    /* bytes of all events so far: where in a file the next one begins */
    int64_t clamped;   /* timestamps that had to be moved forward */
    /* Shared, under the lock. */
    pthread_mutex_t lock;
    pthread_cond_t filled, emptied;
    int64_t read, write,
        limit; /* data is [read, write), or [read, limit) and [0, write) when write < read */
    int64_t used, peak; /* bytes of published events */
    bool closing;       /* no more will come */
} jsl_ring;

jsl_result jsl_ring_init(jsl_ring *ring, jsl_memory *memory, int64_t cap);
void jsl_ring_fini(jsl_ring *ring, jsl_memory *memory);

/* -- Producer ---------------------------------------------------------------------------------- */

/* Whether events of `bytes` in total (headers included) fit and leave `reserve` bytes free. */
bool jsl_ring_fits(jsl_ring *ring, int64_t bytes, int64_t reserve);
/* Room for the data of one event of at most cap bytes; null when there is none. wait: waits for it
 * instead, after publishing the group. */
uint8_t *jsl_ring_reserve(jsl_ring *ring, const char *channel, int64_t cap, bool wait);
/* Completes the event just reserved with its size and time stamp. Returns where in the stream it
 * begins. */
int64_t jsl_ring_commit(jsl_ring *ring, const char *channel, int64_t size, int64_t timestamp_us);
/* Publishes the group. */
void jsl_ring_publish(jsl_ring *ring);
void jsl_ring_close(jsl_ring *ring);

/* -- Consumer ---------------------------------------------------------------------------------- */

/* Waits at most `seconds` for published events; *span gets a run of whole events and the result is
 * its size (0: none). *closed is true when the ring is closed and empty. */
int64_t jsl_ring_take(jsl_ring *ring, double seconds, const uint8_t **span, bool *closed);
/* Gives back the first `bytes` of what was taken. */
void jsl_ring_release(jsl_ring *ring, int64_t bytes);

/* -- Events in memory -----------------------------------------------------------------------------
 */

typedef struct jsl_event {
    int64_t number, timestamp_us, size, bytes; /* bytes: header, channel and data */
    const char *channel;
    int channel_size;
    const uint8_t *data;
} jsl_event;
void jsl_event_put_head(uint8_t *out, int64_t number, int64_t timestamp_us, uint32_t channel_size,
                        uint32_t data_size);
/* Of an event that we wrote. */
jsl_event jsl_event_at(const uint8_t *p);

#endif
