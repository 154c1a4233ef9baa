/* SPDX-License-Identifier: MIT
 * What the files of the rigid room share. Floor 4.
 */
#ifndef JSL_RIGID_ROOM_H
#define JSL_RIGID_ROOM_H

#include "base/base.h"
#include "ecs/ecs.h"
#include "geometry/geometry.h"
#include "rigid/rigid.h"
#include "rigid/solver.h"

/* Colours of contacts between dynamic bodies, and of contacts with the immovable: one bit a colour
 * and body. Beyond them contacts are solved one after the other. */
#define JSL_COLOURS 64
#define JSL_COLOUR_NONE (-1)
/* Slots and geometry records that hold nothing, one a colour: what its padding lanes point at and
 * may write. */
#define JSL_SPARES (2 * JSL_COLOURS + JSL_LANES)

/* What the room knows of a pair that the broad phase keeps; its geometry record lies in geo[] at
 * the same index. Only pairs with points (count > 0) are state; the others can be found again. */
typedef struct jsl_rigid_pair {
    uint64_t id_a, id_b; /* of item a and b, id_a < id_b */
    int32_t a, b;        /* collider items */
    uint32_t feature[JSL_MAX_MANIFOLD];
    uint8_t count;   /* points */
    uint8_t swapped; /* the solver's A is item b: always so when b is immovable and a is not */
    uint8_t wall;    /* the solver's A is immovable */
    uint8_t idle;    /* both are immovable, or filtered: never solved */
    uint8_t was_touching;
    uint8_t rebuilt;
    uint8_t built;             /* the record's frames are of a manifold (or of none: count 0) */
    uint32_t shape_a, shape_b; /* shape ids when built */
} jsl_rigid_pair;

/* Something solid, or a body that is not: slot i < items is collider item i, the others are bodies
 * without collider. */
typedef struct jsl_rigid_slot {
    uint64_t id;
    jsl_entity entity;
    int32_t view; /* which table of the query holds it; -1: not a body that moves */
    int32_t row;
    uint8_t dynamic; /* answers impulses */
    uint8_t moving;  /* its state is written back */
    uint8_t split;   /* turned by the splitting integrator */
    uint8_t flags;   /* slots.c: what is wrong with it */
    uint8_t absent;  /* not fit to meet anything */
} jsl_rigid_slot;

/* Lanes of one colour: [begin, begin + count), padded to JSL_LANES. */
typedef struct jsl_rigid_colour {
    int64_t begin, count;
    bool wall;
    bool serial; /* overflow: lanes share bodies, solved in order by one worker */
} jsl_rigid_colour;

/* Columns of one table of moving bodies. */
typedef struct jsl_rigid_view {
    jsl_rows rows;
    jsl_position_columns position;
    jsl_orientation_columns orientation;
    jsl_velocity_columns velocity;
    jsl_spin_columns spin;
    jsl_mass_columns mass;
    jsl_body_columns body;
} jsl_rigid_view;

typedef struct jsl_rigid_ended {
    uint64_t id_a, id_b;
} jsl_rigid_ended;

struct jsl_rigid_room {
    jsl_ecs *ecs;
    jsl_memory *memory;
    jsl_rigid_settings settings; /* as given; zeros not yet replaced */
    jsl_component position, orientation, velocity, spin, mass, collider, body;
    jsl_query moving; /* bodies with velocity, spin and mass */

    /* Pairs, in order of (a, b). Valid while no collider leaves its loose box. */
    JSL_ARRAY(jsl_rigid_pair) pair;
    JSL_ARRAY(jsl_real) geo; /* JSL_GEO reals a pair, and JSL_SPARES empty records at the end */
    JSL_ARRAY(jsl_rigid_pair) old_pair;
    JSL_ARRAY(jsl_real) old_geo;
    JSL_ARRAY(jsl_aabb) loose;
    JSL_ARRAY(jsl_aabb) finite_box;
    JSL_ARRAY(int32_t) finite;
    jsl_bvh bvh;
    jsl_pair_array found;
    bool pairs_valid;
    uint64_t pairs_revision;

    /* Slots, in the order of collider items. */
    JSL_ARRAY(jsl_rigid_slot) slot;
    JSL_ARRAY(jsl_rigid_view) view;
    JSL_ARRAY(int32_t) view_of_table; /* -1: none */
    int64_t items;

    /* The solver's own arrays: a slot each, then dummies for padding. */
    JSL_ARRAY(jsl_real) line, move, base, kick, pose, turn;
    JSL_ARRAY(uint64_t) used; /* colours taken, two words a slot: pairs, walls */
    JSL_ARRAY(int32_t) split; /* slots that turn by splitting */

    /* Blocks. */
    JSL_ARRAY(jsl_real) normal, friction, bounce;
    JSL_ARRAY(int32_t) lane_a, lane_b, lane_contact;
    JSL_ARRAY(int32_t) active;        /* pairs that are solved */
    JSL_ARRAY(int32_t) active_colour; /* parallel to active */
    JSL_ARRAY(jsl_rigid_colour) colour;
    int64_t lanes;

    JSL_ARRAY(jsl_rigid_ended) ended;
    JSL_ARRAY(jsl_contact) contact;
    bool contacts_valid;
    JSL_ARRAY(uint64_t) sort_key, sort_tmp;
    JSL_ARRAY(uint32_t) sort_value, sort_tmp_value;

    int64_t manifolds, rebuilt, overflow;
    int32_t colours;
    jsl_rigid_profile profile;
};

/* detect.c: slots, pairs and manifolds for this step. */
jsl_whole_fn jsl_rigid_detect;
jsl_rigid_soft jsl_rigid_soft_of(jsl_real hertz, jsl_real zeta, jsl_real h);
/* pairs.c: the list of pairs; exchanging it with the spare one; noting that a touching pair parted.
 */
void jsl_rigid_swap_pairs(jsl_rigid_room *room);
jsl_result jsl_rigid_pair_ended(jsl_rigid_room *room, const jsl_rigid_pair *pair);
jsl_result jsl_rigid_pairs_update(jsl_rigid_room *room, const jsl_step_context *context);
/* slots.c: columns of the moving bodies; which slots there are, and the state of moving bodies;
 * writes finished states back. */
jsl_result jsl_rigid_views_update(jsl_rigid_room *room);
jsl_result jsl_rigid_slots_update(jsl_rigid_room *room, const jsl_step_context *context);
void jsl_rigid_slots_gather(jsl_rigid_room *room, const jsl_step_context *context);
void jsl_rigid_slots_finish(jsl_rigid_room *room, const jsl_step_context *context);
/* colour.c: the active pairs, coloured, and the lanes that hold them. */
jsl_result jsl_rigid_colour_update(jsl_rigid_room *room, const jsl_step_context *context);
/* respond.c */
jsl_whole_fn jsl_rigid_respond;
/* rotation.c: turns the listed slots over h by three axis rotations, and takes the change of spin
 * out of what the next warm start would repeat. kick: share of h that the torque acts before (1
 * after the last sub-step is handled by the caller). */
void jsl_rigid_turn_split(const jsl_rigid_bodies *bodies, const int32_t *slot, int64_t count,
                          jsl_real h);

#define JSL_RIGID_GEO(room, i) ((room)->geo.at + (int64_t)(i)*JSL_GEO)

/* Whether the pair touched in the last step: it pushed, or overlaps. */
static inline bool jsl_rigid_touching(const jsl_rigid_room *room, int64_t i) {
    const jsl_real *geo = JSL_RIGID_GEO(room, i);
    return room->pair.at[i].count > 0 && (geo[JSL_GEO_GAP] <= 0 || geo[JSL_GEO_PUSH] > 0);
}

#endif
