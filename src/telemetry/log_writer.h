/* SPDX-License-Identifier: MIT
 * The thread that writes a ring of events into a file. Floor 6.
 */
#ifndef JSL_TELEMETRY_LOG_WRITER_H
#define JSL_TELEMETRY_LOG_WRITER_H

#include "telemetry/ring.h"

/* The bulk channels, whose frames are counted. */
typedef enum jsl_bulk {
    JSL_BULK_PARTICLES,
    JSL_BULK_BOIDS,
    JSL_BULK_BODIES,
    JSL_BULK_KEYFRAME,
    JSL_BULK_COLUMNS, /* of all components together */
    JSL_BULK_COUNT
} jsl_bulk;
const char *jsl_bulk_channel(jsl_bulk bulk);
/* What an event is of a frame of a bulk channel. */
typedef enum jsl_frame_part { JSL_PART_NONE, JSL_PART_CHUNK, JSL_PART_LAST_CHUNK } jsl_frame_part;
jsl_frame_part jsl_event_frame_part(const jsl_event *event, jsl_bulk *bulk);

/* What a consumer did; read under the lock. */
typedef struct jsl_sink_counts {
    int64_t events, bytes; /* written or sent */
    int64_t errors;        /* events that were not, and failed synchronisations */
    int64_t frame_errors[JSL_BULK_COUNT];
} jsl_sink_counts;

typedef struct jsl_log_writer jsl_log_writer;

/* Opens the file and starts the thread. The ring outlives the writer. An existing file is emptied.
 */
jsl_result jsl_log_writer_open(jsl_memory *memory, const jsl_logger *logger, const char *path,
                               jsl_ring *ring, jsl_log_writer **out);
void jsl_log_writer_counts(jsl_log_writer *writer, jsl_sink_counts *out);
/* Closes the ring, waits until everything is written, synchronises and closes the file. JSL_ERR_IO
 * when anything was lost. */
jsl_result jsl_log_writer_close(jsl_log_writer *writer, jsl_sink_counts *out);
/* Takes back the creation of the file: removes it if it was new. */
void jsl_log_writer_abandon(jsl_log_writer *writer, const char *path);

#endif
