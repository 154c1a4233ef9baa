/* SPDX-License-Identifier: MIT
 * What the files of the flock room share. Floor 4.
 */
#ifndef JSL_FLOCK_ROOM_H
#define JSL_FLOCK_ROOM_H

#include "ecs/ecs.h"
#include "flock/avoid.h"
#include "flock/flock.h"
#include "flock/sense.h"

/* The component `flock` of one flock as a value. */
#define JSL_FLOCK_VALUE_(ctype, name, unit, role) JSL_CTYPE_##ctype name;
typedef struct jsl_flock_values {
    JSL_FLOCK_FIELDS(JSL_FLOCK_VALUE_)
} jsl_flock_values;

/* The cells of one flock: a box of cells about its boids, anchored at multiples of the cell size,
 * so that cells stay where they are in the world. Cells are split along x to read fewer candidates.
 */
typedef struct jsl_flock_grid {
    double inv_x, inv_yz; /* cells per metre */
    double ox, oy, oz;    /* cell coordinates of the box's corner, whole numbers */
    int64_t nx, ny, nz;
    uint64_t base; /* key of the first cell */
} jsl_flock_grid;

/* One flock in the present step. */
typedef struct jsl_flock_state {
    jsl_entity entity;
    jsl_flock_values value;
    bool active;   /* its values are in range */
    bool scripted; /* the leader runs along a path */
    bool led;      /* it has a live leader, at: */
    jsl_vec3 leader_at, leader_velocity;
    jsl_lens lens;
    jsl_flock_grid grid;
} jsl_flock_state;

/* A table with boids. */
typedef struct jsl_boid_table {
    jsl_rows rows;
    jsl_position_columns position;
    jsl_velocity_columns velocity;
    jsl_boid_columns boid;
    int64_t offset; /* number of its first row among all boids */
    uint64_t revision;
    bool fixed_order; /* others remember its rows */
    bool is_body;     /* moved by somebody else */
} jsl_boid_table;

#define JSL_FLOCK_SPLIT 4 /* cells per radius along x */
#define JSL_FLOCK_NONE UINT32_MAX

/* Everything here is rebuilt each step from components. Boids are numbered 0..count-1, table by
 * table ("number"), and again in the order of flocks and cells ("place"). */
struct jsl_flock_room {
    jsl_ecs *ecs;
    jsl_memory *memory;
    jsl_component position, velocity, boid, flock, path, path_rest;
    jsl_query boids, flocks;

    JSL_ARRAY(jsl_flock_state) state; /* in order of entity id */
    JSL_ARRAY(jsl_boid_table) table;
    int64_t count;
    bool ready; /* the index below describes the tables as they are */

    JSL_ARRAY(jsl_real) column[6]; /* of jsl_sight, by place */
    jsl_sight sight;
    JSL_ARRAY(uint64_t) key;   /* cell of each place, ascending */
    JSL_ARRAY(uint32_t) home;  /* the number of the boid at each place */
    JSL_ARRAY(uint32_t) start; /* dense: first place of each cell, and one past the last */
    bool dense;
    uint64_t cells;
    JSL_ARRAY(int64_t) flock_begin; /* first place of each flock, of those without, and the end */
};

/* cells.c */
jsl_result jsl_flock_index(const jsl_step_context *context, void *room);
/* False when rows have come, gone or moved since the index was made. */
bool jsl_flock_index_holds(const jsl_flock_room *room);
/* First place whose cell is `key` or later; *hint is any place not after the answer, and becomes
 * the answer. */
static inline int64_t jsl_flock_place(const jsl_flock_room *room, uint64_t key, int64_t *hint) {
    if (room->dense) return key < room->cells ? room->start.at[key] : room->count;
    const uint64_t *k = room->key.at;
    int64_t lo = *hint, step = 1;
    while (lo + step < room->count && k[lo + step] < key) lo += step, step *= 2;
    int64_t hi = lo + step < room->count ? lo + step : room->count;
    while (lo < hi) {
        const int64_t mid = (lo + hi) / 2;
        if (k[mid] < key)
            lo = mid + 1;
        else
            hi = mid;
    }
    return *hint = lo;
}
/* The boid at a place: its table and row. */
static inline const jsl_boid_table *jsl_flock_home(const jsl_flock_room *room, int64_t place,
                                                   int64_t *row) {
    const jsl_boid_table *t = room->table.at + room->table.count - 1;
    while (room->home.at[place] < t->offset) t--;
    *row = room->home.at[place] - t->offset;
    return t;
}

/* state.c */
jsl_result jsl_flock_refresh(jsl_flock_room *room, const jsl_step_context *context);
jsl_result jsl_flock_find_tables(jsl_flock_room *room);
/* Index into state[], or JSL_FLOCK_NONE; hint: the last answer. */
uint32_t jsl_flock_number(const jsl_flock_room *room, jsl_entity flock, uint32_t hint);
bool jsl_flock_values_read(jsl_flock_room *room, jsl_entity flock, jsl_flock_values *out);
/* Null when every value is in range, else the name of the first field that is not. */
const char *jsl_flock_values_check(const jsl_flock_values *values);

/* steer.c, move.c, path.c */
jsl_result jsl_flock_steer(const jsl_step_context *context, void *room);
void jsl_flock_move_rows(const jsl_step_context *context, const jsl_rows *rows, void *room);
jsl_result jsl_flock_lead(const jsl_step_context *context, void *room);

/* The closed Catmull-Rom spline through point[0..count) at s in [0, count): place and derivative by
 * s. */
void jsl_flock_spline(const jsl_vec3 *point, int count, jsl_real s, jsl_vec3 *at, jsl_vec3 *rate);
/* s after running along it by `length` metres. */
jsl_real jsl_flock_spline_advance(const jsl_vec3 *point, int count, jsl_real s, jsl_real length);
/* The waypoints of a flock; 0 when it has none. */
int jsl_flock_path_read(jsl_flock_room *room, jsl_entity flock,
                        jsl_vec3 point[JSL_FLOCK_MAX_WAYPOINTS]);

#endif
