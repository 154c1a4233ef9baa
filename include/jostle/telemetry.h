/* SPDX-License-Identifier: MIT
 * jostle/telemetry.h - each step as LCM messages: into an event log, onto a live LCM network, and
 * back (libjostle-lcm). Floor 6.
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

/* -- Publishing
 * -------------------------------------------------------------------------------------------- */

typedef struct jsl_publisher jsl_publisher;

typedef enum jsl_encoding {
    JSL_ENCODING_DEFAULT,
    JSL_ENCODING_F32,
    JSL_ENCODING_F16,
    JSL_ENCODING_U16
} jsl_encoding;
typedef enum jsl_full_policy {
    JSL_FULL_DROP_FRAME, /* the whole frame, never half */
    JSL_FULL_BLOCK       /* the simulation waits: nothing is lost */
} jsl_full_policy;

/* What frames hold beyond the default, and what of the default they leave out. Particles have
 * position, size and, where known, colour; boids position, velocity, acceleration, colour and, when
 * their order changed, ids; bodies id, position, quaternion, velocity and spin. */
enum {
    JSL_PUBLISH_PARTICLE_VELOCITY = 1, /* +6 bytes a particle */
    JSL_PUBLISH_PARTICLE_IDS =
        2, /* +8 bytes a particle in frames whose order differs from the last */
    JSL_PUBLISH_BOID_ACCELERATION = 4, /* 6 bytes a boid */
    JSL_PUBLISH_BOID_IDS = 8,      /* 8 bytes a boid in frames whose order differs from the last */
    JSL_PUBLISH_BODY_VELOCITY = 16 /* 24 bytes a body */
};

typedef struct jsl_publisher_desc {
    const char *log_path; /* event log to write; null: none. An existing file is replaced */
    const char *lcm_url;  /* "udpm://...", "memq://", "tcpq://..."; null: none */
    const char *scene_name;
    const char *scene_text; /* kept in the log so that a log can be resumed; may be null */
    uint64_t scene_hash;
    /* Frames per simulated second; 0: 30, 60, 60; < 0: never. */
    double particles_hz, boids_hz, bodies_hz;
    /* Components whose fields are sent on JOSTLE_COLUMNS, all but their SCRATCH ones, bit for bit,
     * entities as ids. None named: every component that you registered yourself, also later ones
     * (see JSL_BUILT_IN_COMPONENTS). A named one must exist: JSL_ERR_NAME. Read by
     * jsl_publisher_create only. */
    const char *const *components;
    int component_count;
    double components_hz;    /* frames of each per simulated second; 0: 10; < 0: never */
    double keyframe_seconds; /* of simulated time between resumable keyframes; 0: 1; < 0: none */
    int64_t hash_every; /* steps between state hashes in the diagnostics; 0: with keyframes only */
    jsl_encoding particle_position, boid_position; /* DEFAULT: U16 in each chunk's own box */
    uint32_t with, without; /* JSL_PUBLISH_ bits to add to and take from the default */
    jsl_full_policy when_full;
    int64_t
        queue_bytes; /* of each of the log's and the network's queue; 0: 64 MiB; at least 1 MiB */
    jsl_frame_camera camera; /* where pictures of this scene look from; kept in the scene message */
    bool additive;           /* particles add light: kept in the scene message */
    float boid_length;       /* m, of a drawn bird; kept in the scene message */
    /* Colour (0xRRGGBBAA) and drawn radius (m) of particles; both arrays hold rows->count. Term 0
     * of rows is position, term 1 particle. May be null: the look and particle components are used.
     * Called from jsl_publisher_create and _step. */
    void (*particle_look)(void *arg, const jsl_rows *rows, uint32_t *rgba, float *size);
    void *particle_look_arg;
    jsl_logger logger; /* also called from the threads of the publisher */
} jsl_publisher_desc;

/* Of particle, boid, body and component frames; offered = sent + dropped + decimated + errors,
 * exactly, at any time. Every step offers a frame of every kind that the world has, and of every
 * component chosen. */
typedef struct jsl_frame_counts {
    int64_t offered;
    int64_t sent;      /* queued or written */
    int64_t dropped;   /* the queue was full */
    int64_t decimated; /* left out because of the chosen rate */
    int64_t errors;    /* lost to I/O errors after they were queued */
} jsl_frame_counts;

typedef struct jsl_publisher_stats {
    /* Of the log; of the network when there is no log. */
    int64_t frames_offered, frames_sent, frames_dropped, frames_decimated, send_errors;
    int64_t log_events, log_bytes, log_errors; /* log_errors > 0: the log is incomplete */
    jsl_frame_counts log, live;
    int64_t keyframes, keyframes_dropped; /* a dropped keyframe is tried again at the next step */
    int64_t small_dropped; /* diagnostics and other small messages that found the queue full */
    int64_t live_events, live_bytes, live_errors;
    int64_t clamped_times;    /* wall clock went back: time stamps that were held */
    int64_t queue_peak_bytes; /* of the log's queue */
} jsl_publisher_stats;

/* Opens both ends and publishes the schema, the scene and the present state. JSL_ERR_IO when the
 * log cannot be created (no file is left), JSL_ERR_UNSUPPORTED when the URL cannot be opened. The
 * world must outlive the publisher. */
JSL_API jsl_result jsl_publisher_create(const jsl_publisher_desc *desc, jsl_world *world,
                                        jsl_publisher **out);
/* Call after every jsl_step: publishes what is due. Never fails because of a slow disk or network:
 * that is counted. warnings may be null. */
JSL_API jsl_result jsl_publisher_step(jsl_publisher *publisher, const jsl_warnings *warnings);
JSL_API void jsl_publisher_get_stats(jsl_publisher *publisher, jsl_publisher_stats *out);
/* Drains the queues, writes closing statistics and the index, closes. JSL_ERR_IO when anything of
 * the log was lost to I/O errors. Frees the publisher in every case; null is allowed. out may be
 * null. */
JSL_API jsl_result jsl_publisher_close(jsl_publisher *publisher, jsl_publisher_stats *out);

/* -- Reading logs
 * --------------------------------------------------------------------------------------------- */

typedef struct jsl_log_file jsl_log_file;

typedef struct jsl_log_event {
    int64_t offset;       /* of its sync word in the file */
    int64_t number;       /* as written */
    int64_t timestamp_us; /* as written */
    const char *channel;  /* not terminated */
    int channel_size;
    const uint8_t *data; /* in the mapping: unaligned, valid while the log is open */
    int64_t size;
} jsl_log_event;

/* Maps the file. Survives any bytes. JSL_ERR_IO when it cannot be opened. */
JSL_API jsl_result jsl_log_open(const char *path, const jsl_logger *logger, jsl_log_file **out);
JSL_API void jsl_log_close(jsl_log_file *log);
/* The next good event at or after the cursor. JSL_ERR_END at a clean end, JSL_ERR_FORMAT when
 * damage was skipped just before the event returned in *out (the event is valid), JSL_ERR_END again
 * after a truncated tail (see info). */
JSL_API jsl_result jsl_log_next(jsl_log_file *log, jsl_log_event *out);
JSL_API void jsl_log_rewind(jsl_log_file *log);

typedef struct jsl_log_channel {
    char name[64];
    int64_t events, bytes;
} jsl_log_channel;
#define JSL_LOG_MAX_CHANNELS 64
typedef struct jsl_log_info {
    int64_t file_bytes, events, good_bytes;
    int64_t holes, hole_bytes;    /* damage that was skipped */
    bool truncated;               /* the last event is cut off */
    bool closed;                  /* the writer closed it properly */
    int64_t first_us, last_us;    /* wall clock */
    int64_t backward_times;       /* events stamped earlier than the one before */
    double first_time, last_time; /* s, simulated */
    int64_t first_step, last_step;
    int64_t sessions; /* runs of a simulator, at most 64 are counted */
    char scene[64], build[128];
    uint64_t seed;
    double dt;
    /* Complete frames by kind; a frame with a missing chunk is incomplete. */
    int64_t particle_frames, boid_frames, body_frames, incomplete_frames, keyframes, foreign_events;
    int64_t component_frames;
    int64_t duplicate_chunks;
    int64_t bad_frames; /* complete, but malformed or with a wrong checksum; jsl_log_verify only */
    int64_t frames_offered, frames_dropped; /* as the writer reported at the end */
    int channel_count;
    jsl_log_channel channel[JSL_LOG_MAX_CHANNELS];
} jsl_log_info;
/* Hops over all headers: milliseconds for a log of some GB that is in memory. */
JSL_API jsl_result jsl_log_get_info(jsl_log_file *log, jsl_log_info *out);
/* The same, and checks every frame's and keyframe's bytes. JSL_ERR_FORMAT when anything is missing
 * or damaged; *out is filled in either case. */
JSL_API jsl_result jsl_log_verify(jsl_log_file *log, jsl_log_info *out);

/* Assembles frames: every call decodes the next whole instant (all chunks of the channels present
 * at one step) into a frame whose arrays belong to the log and live until the next call. Channels
 * logged less often keep their last state. JSL_ERR_END after the last. */
JSL_API jsl_result jsl_log_next_frame(jsl_log_file *log, jsl_frame *out);
/* Positions the frame cursor at the last instant at or before `time` (s, simulated), or at the
 * first; in the session in which the cursor is. By the log's index; without one the first call hops
 * over all headers. */
JSL_API jsl_result jsl_log_seek_time(jsl_log_file *log, double time);
/* How many instants frames can be made for. */
JSL_API jsl_result jsl_log_count_frames(jsl_log_file *log, int64_t *count);

/* One field of a component, an array of values: F32 to U64 as named, ENTITY as uint64_t
 * jsl_entity_id; never REAL. */
typedef struct jsl_log_column {
    const char *name, *unit;
    jsl_type type;
    const void *data; /* aligned for its type */
} jsl_log_column;
typedef struct jsl_log_columns {
    double time; /* s, simulated */
    int64_t step, session;
    const char *component;
    int64_t count;
    const uint64_t *id; /* jsl_entity_id of each row */
    int field_count;
    const jsl_log_column *field;
} jsl_log_columns;
/* The next whole frame of a component (null: of any) in the order of the file, as the publisher was
 * given it; damaged and incomplete ones are passed over. Everything in *out lives until the next
 * call. JSL_ERR_END after the last; jsl_log_rewind begins again. */
JSL_API jsl_result jsl_log_next_columns(jsl_log_file *log, const char *component,
                                        jsl_log_columns *out);

/* The text that the scene was made from; JSL_ERR_END when the log has none. Lives as long as the
 * log; not terminated. */
JSL_API jsl_result jsl_log_get_scene_text(jsl_log_file *log, const char **text, int64_t *size);

/* The last whole keyframe at or before `time` (s): an image for jsl_world_restore and the hash that
 * the restored world must have. *image lives until the next call. JSL_ERR_END when there is none.
 */
typedef struct jsl_log_keyframe {
    const void *image;
    size_t size;
    double time;
    int64_t step;
    uint64_t state_hash;
} jsl_log_keyframe;
JSL_API jsl_result jsl_log_get_keyframe(jsl_log_file *log, double time, jsl_log_keyframe *out);

/* -- Exporting
 * ---------------------------------------------------------------------------------------- */

/* X(CODE, text) */
#define JSL_EXPORT_FORMATS(X)                                                                      \
    X(CSV, "csv") /* a line a row; floats with the digits that give back the same bits */          \
    X(NPZ, "npz") /* for numpy.load: an array a field, and `fields` and `units` */
typedef enum jsl_export_format {
#define JSL_X(code, text) JSL_EXPORT_##code,
    JSL_EXPORT_FORMATS(JSL_X)
#undef JSL_X
        JSL_EXPORT_FORMAT_COUNT
} jsl_export_format;

typedef struct jsl_export_desc {
    const char *path; /* replaced when it exists; not left behind after a failure */
    jsl_export_format format;
    const char *channel; /* "particles", "boids", "bodies" or the name of a component; null: the
                            only one that the log has */
    double from, to;     /* s, simulated, both included; to 0: the end */
    int64_t every;       /* every n-th frame of these; 0: 1 */
    jsl_logger logger;
} jsl_export_desc;
typedef struct jsl_export_stats {
    int64_t frames, rows;
    int64_t lost; /* frames of any kind in the log that are incomplete or damaged */
} jsl_export_stats;
/* A table of step, time, id (0: the log does not tell) and every field, in order of the log. Moves
 * the cursors of the log. JSL_ERR_NAME: the log has no such channel. JSL_ERR_CONFLICT: channel is
 * null and there are several, or a component changed its fields on the way. *out may be null. */
JSL_API jsl_result jsl_log_export(jsl_log_file *log, const jsl_export_desc *desc,
                                  jsl_export_stats *out);

/* -- Playing
 * ------------------------------------------------------------------------------------------------------
 */

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
