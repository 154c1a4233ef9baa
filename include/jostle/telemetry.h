/* SPDX-License-Identifier: MIT
 * jostle/telemetry.h - each step as LCM messages: into an event log, onto a live LCM network, and back (libjostle-lcm). Floor 6.
 *
 * The messages are those of lcmtypes/jostle.lcm; stock LCM tools read, record and replay them.
 */
#ifndef JOSTLE_TELEMETRY_H
#define JOSTLE_TELEMETRY_H

#include <jostle/frame.h>
#include <jostle/world.h>

#ifdef __cplusplus
extern "C" {
#endif

/* -- Publishing -------------------------------------------------------------------------------------------- */

typedef struct jsl_publisher jsl_publisher;

typedef enum jsl_encoding { JSL_ENCODING_DEFAULT, JSL_ENCODING_F32, JSL_ENCODING_F16, JSL_ENCODING_U16 } jsl_encoding;
typedef enum jsl_full_policy {
    JSL_FULL_DROP_FRAME, /* the whole frame, never half */
    JSL_FULL_BLOCK       /* the simulation waits: nothing is lost */
} jsl_full_policy;

typedef struct jsl_publisher_desc {
    const char *log_path;   /* event log to write; null: none. An existing file is replaced when the first event is written */
    const char *lcm_url;    /* "udpm://...", "memq://", "tcpq://..."; null: none */
    const char *scene_name;
    const char *scene_text; /* kept in the log so that a log can be resumed; may be null */
    uint64_t scene_hash;
    double particles_hz, boids_hz, bodies_hz; /* frames per simulated second; 0: 30, 60, 60; < 0: never */
    double keyframe_seconds; /* of simulated time between resumable keyframes; 0: 1; < 0: none */
    jsl_encoding particle_position, boid_position; /* DEFAULT: U16 in each chunk's own box */
    jsl_full_policy when_full;
    int64_t queue_bytes;     /* 0: 64 MiB */
    jsl_frame_camera camera; /* where pictures of this scene look from; kept in the scene message */
    jsl_logger logger;
} jsl_publisher_desc;

typedef struct jsl_publisher_stats {
    int64_t frames_offered, frames_sent, frames_dropped, frames_decimated, send_errors;
    int64_t log_events, log_bytes, log_errors; /* log_errors > 0: the log is incomplete */
} jsl_publisher_stats;

/* JSL_ERR_IO when the log cannot be created (no file is left), JSL_ERR_UNSUPPORTED when the URL cannot be opened. */
JSL_API jsl_result jsl_publisher_create(const jsl_publisher_desc *desc, jsl_world *world, jsl_publisher **out);
/* Call after every jsl_step: publishes what is due. Never fails because of a slow disk or network: that is counted. */
JSL_API jsl_result jsl_publisher_step(jsl_publisher *publisher, const jsl_warnings *warnings);
JSL_API void jsl_publisher_get_stats(jsl_publisher *publisher, jsl_publisher_stats *out);
/* Drains the queue, writes closing statistics and the index, closes. JSL_ERR_IO when anything was lost to I/O errors. Frees the
 * publisher in every case. */
JSL_API jsl_result jsl_publisher_close(jsl_publisher *publisher, jsl_publisher_stats *out);

/* -- Reading logs --------------------------------------------------------------------------------------------- */

typedef struct jsl_log_file jsl_log_file;

typedef struct jsl_log_event {
    int64_t offset;          /* of its sync word in the file */
    int64_t number;          /* as written */
    int64_t timestamp_us;    /* as written */
    const char *channel;     /* not terminated */
    int channel_size;
    const uint8_t *data;     /* in the mapping: unaligned, valid while the log is open */
    int64_t size;
} jsl_log_event;

/* Maps the file. Survives any bytes. JSL_ERR_IO when it cannot be opened. */
JSL_API jsl_result jsl_log_open(const char *path, const jsl_logger *logger, jsl_log_file **out);
JSL_API void jsl_log_close(jsl_log_file *log);
/* The next good event at or after the cursor. JSL_ERR_END at a clean end, JSL_ERR_FORMAT when damage was skipped just before
 * the event returned in *out (the event is valid), JSL_ERR_END again after a truncated tail (see info). */
JSL_API jsl_result jsl_log_next(jsl_log_file *log, jsl_log_event *out);
JSL_API void jsl_log_rewind(jsl_log_file *log);

typedef struct jsl_log_channel {
    char name[64];
    int64_t events, bytes;
} jsl_log_channel;
#define JSL_LOG_MAX_CHANNELS 64
typedef struct jsl_log_info {
    int64_t file_bytes, events, good_bytes;
    int64_t holes, hole_bytes;   /* damage that was skipped */
    bool truncated;              /* the last event is cut off */
    bool closed;                 /* the writer closed it properly */
    int64_t first_us, last_us;   /* wall clock */
    double first_time, last_time; /* s, simulated */
    int64_t first_step, last_step;
    int64_t sessions;
    char scene[64], build[128];
    uint64_t seed;
    double dt;
    int64_t particle_frames, boid_frames, body_frames, incomplete_frames, keyframes, foreign_events;
    int64_t frames_offered, frames_dropped; /* as the writer reported at the end */
    int channel_count;
    jsl_log_channel channel[JSL_LOG_MAX_CHANNELS];
} jsl_log_info;
JSL_API jsl_result jsl_log_get_info(jsl_log_file *log, jsl_log_info *out);

/* Assembles frames: every call decodes the next whole instant (all chunks of the channels present at one step) into a frame whose arrays belong to the
 * log and live until the next call. Channels logged less often keep their last state. JSL_ERR_END after the last. */
JSL_API jsl_result jsl_log_next_frame(jsl_log_file *log, jsl_frame *out);
/* Positions the frame cursor at the last instant at or before `time` (s, simulated). */
JSL_API jsl_result jsl_log_seek_time(jsl_log_file *log, double time);

/* -- Playing ------------------------------------------------------------------------------------------------------ */

typedef struct jsl_play_desc {
    const char *lcm_url; /* null: the LCM default */
    double speed;        /* 1: as recorded in simulated time; 0: as fast as possible */
    volatile int *stop;  /* set to nonzero (for instance by a signal handler) to end; may be null */
    void (*progress)(double time, double end, void *arg); /* may be null */
    void *progress_arg;
    jsl_logger logger;
} jsl_play_desc;
typedef struct jsl_play_stats {
    int64_t events, bytes, errors;
    double seconds; /* wall */
} jsl_play_stats;
/* Republishes every event of the log with byte-identical payload, paced by simulated time. */
JSL_API jsl_result jsl_log_play(jsl_log_file *log, const jsl_play_desc *desc, jsl_play_stats *out);

#ifdef __cplusplus
}
#endif
#endif
