/* SPDX-License-Identifier: MIT
 * The publisher's insides, shared by publisher.c and publish_*.c. Floor 6.
 */
#ifndef JSL_TELEMETRY_PUBLISHER_H
#define JSL_TELEMETRY_PUBLISHER_H

#include "telemetry/live.h"
#include "telemetry/state.h"

#include <jostle/telemetry.h>

typedef enum jsl_outlet_kind { JSL_TO_LOG, JSL_TO_LIVE, JSL_OUTLETS } jsl_outlet_kind;

/* One bulk channel on one outlet, as the step thread knows it. */
typedef struct jsl_bulk_counts {
    int64_t offered, dropped, decimated, queued, chunks, bytes;
} jsl_bulk_counts;

/* Where messages go: a queue and the thread behind it. */
typedef struct jsl_outlet {
    bool on;
    jsl_ring ring;
    jsl_bulk_counts bulk[JSL_BULK_COUNT];
    bool dropped_before[JSL_BULK_COUNT];
} jsl_outlet;

/* log_index_t.kind */
enum { JSL_INDEX_KEYFRAME = 1, JSL_INDEX_SCENE, JSL_INDEX_SCHEMA, JSL_INDEX_FRAME };

typedef struct jsl_index_entry {
    int64_t offset, step, sim_ns;
    int32_t kind;
} jsl_index_entry;

/* Components by name; the null component when the ECS does not have it. Refreshed when its count
 * changes. */
typedef struct jsl_world_view {
    int component_count;
    jsl_component position, orientation, velocity, spin, mass, collider, look, particle, boid;
    jsl_query query[JSL_BULK_KEYFRAME]; /* null: the world has no such kind */
    int8_t orientation_term, velocity_term[JSL_BULK_KEYFRAME], spin_term, mass_term,
        look_term[JSL_BULK_KEYFRAME];
} jsl_world_view;

typedef struct jsl_stamp {
    int64_t wall_us, session, step, sim_ns;
} jsl_stamp;

struct jsl_publisher {
    jsl_memory memory;
    jsl_publisher_desc desc; /* defaults filled in; its strings are our copies */
    jsl_logger logger;
    jsl_world *world;
    jsl_ecs *ecs;
    jsl_world_view view;
    uint32_t fields; /* JSL_PUBLISH_ bits */
    char *strings;
    size_t strings_size;

    jsl_outlet outlet[JSL_OUTLETS];
    jsl_log_writer *writer;
    jsl_live *live;
    bool closing;          /* everything waits for room */
    int64_t small_dropped; /* of the log; of the network when there is no log */

    jsl_stamp stamp; /* of the step being published */
    double hz[JSL_BULK_COUNT];
    int64_t due[JSL_BULK_COUNT]; /* index of the last frame time */
    int64_t frame_seq[JSL_BULK_COUNT];
    uint64_t order_key[JSL_BULK_COUNT];
    int32_t order_rev[JSL_BULK_COUNT];
    int32_t scene_rev;
    uint64_t body_key; /* of the set of bodies that the last body table told of */
    bool body_told;
    uint64_t state_hash; /* of this step when hashed */
    bool hashed;
    int64_t keyframe_bytes; /* of the last image */

    const char *component_name[JSL_MAX_COMPONENTS]; /* those asked for; none: the user's own */
    int component_count;
    jsl_query component_query[JSL_MAX_COMPONENTS]; /* of the i-th registered; null: not published */

    double rate_wall, rate_sim, real_time_factor, stats_wall;
    jsl_profile profile; /* at the last timing message */

    JSL_ARRAY(jsl_state_segment) segment;
    JSL_ARRAY(uint32_t) rgba;
    JSL_ARRAY(float) size;
    JSL_ARRAY(uint8_t) table; /* scratch of shape and body tables */
    JSL_ARRAY(jsl_index_entry) index;
    int64_t index_offset; /* of the last index event, or -1 */
};

/* publish_bulk.c */
void jsl_publish_view(jsl_publisher *p);
jsl_result jsl_publish_bulk(jsl_publisher *p, jsl_bulk bulk, bool due);
jsl_result jsl_publish_body_info(jsl_publisher *p);
int64_t jsl_publish_rows(jsl_publisher *p, jsl_bulk bulk);

/* Which outlets have room for a whole frame of `bytes` (headers included); the others count it as
 * dropped. */
unsigned jsl_publish_outlets(jsl_publisher *p, jsl_bulk bulk, int64_t bytes);

/* publish_component.c */
jsl_result jsl_publish_choose(jsl_publisher *p, const jsl_publisher_desc *desc);
void jsl_publish_choose_queries(jsl_publisher *p, int known, int count);
jsl_result jsl_publish_components(jsl_publisher *p, bool due);

/* publish_small.c */
/* Encodes to every outlet of the mask and publishes. kind: the index entry of it; 0: none. */
void jsl_publish_message(jsl_publisher *p, unsigned outlets, const char *channel, jsl_lcm_type type,
                         const void *message, int32_t kind);
void jsl_publish_schema(jsl_publisher *p);
void jsl_publish_scene(jsl_publisher *p);
jsl_result jsl_publish_shapes(jsl_publisher *p);
void jsl_publish_diag(jsl_publisher *p);
void jsl_publish_timing(jsl_publisher *p);
void jsl_publish_stats(jsl_publisher *p);
void jsl_publish_index(jsl_publisher *p);
jsl_result jsl_publish_keyframe(jsl_publisher *p);
void jsl_publish_note(jsl_publisher *p, int64_t offset, int32_t kind);
#define JSL_STAMPED(p)                                                                             \
    .wall_us = (p)->stamp.wall_us, .session = (p)->stamp.session, .step = (p)->stamp.step,         \
    .sim_ns = (p)->stamp.sim_ns

#endif
