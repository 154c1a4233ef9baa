/* SPDX-License-Identifier: MIT
 * What the files of the particle room share. Floor 4.
 */
#ifndef JSL_PARTICLE_ROOM_H
#define JSL_PARTICLE_ROOM_H

#include "ecs/ecs.h"
#include "geometry/geometry.h"
#include "particle/particle.h"

/* Rows of one parallel block, and of one pass that stays in the first-level cache. */
#define PARTICLE_BLOCK 4096
#define PARTICLE_CHUNK 256

/* -- Motion without collisions (law.c)
 * ------------------------------------------------------------------ */

/* v' = a - k v, x' = v with a = (1 - buoyancy) g + k w. */
typedef struct jsl_particle_law {
    jsl_particle_integrator integrator;
    jsl_vec3 a; /* m/s^2 */
    jsl_real k; /* 1/s */
} jsl_particle_law;

/* One step of the law: x += run * v + dx; v = keep * v + dv. */
typedef struct jsl_particle_map {
    jsl_real keep, run;
    jsl_vec3 dv, dx;
} jsl_particle_map;

/* The step of length h by the law's integrator. */
jsl_particle_map jsl_particle_map_of(const jsl_particle_law *law, double h);
/* e^-z, (1 - e^-z)/z and (z - 1 + e^-z)/z^2 to the rounding of double, for z >= 0. */
void jsl_particle_phi(double z, double phi[3]);

static inline void jsl_particle_apply(const jsl_particle_map *m, jsl_vec3 *x, jsl_vec3 *v) {
    x->x = (x->x + m->run * v->x) + m->dx.x;
    x->y = (x->y + m->run * v->y) + m->dx.y;
    x->z = (x->z + m->run * v->z) + m->dx.z;
    v->x = m->keep * v->x + m->dv.x;
    v->y = m->keep * v->y + m->dv.y;
    v->z = m->keep * v->z + m->dv.z;
}

/* -- Everything solid as particles see it (grid.c)
 * -------------------------------------------------------- */

/* A uniform grid over the boxes of all finite colliders, with two empty layers of cells around it,
 * so that a position outside falls into an empty cell after clamping. near[c]: cell c or a
 * neighbour of it holds something. */
typedef struct jsl_cells {
    int32_t lo[3], hi[3];
} jsl_cells;

typedef struct jsl_particle_grid {
    jsl_vec3 origin;
    jsl_real cell, inv_cell;
    int32_t n[3]; /* 0 when there is nothing */
    JSL_ARRAY(uint8_t) near;
    JSL_ARRAY(int32_t) start; /* first entry of each cell in item */
    JSL_ARRAY(int32_t) item;  /* indices into the set's finite[], ascending in a cell */
    JSL_ARRAY(jsl_aabb) box;  /* of the colliders the grid was built from; same boxes: same grid */
    JSL_ARRAY(jsl_cells) first; /* cells of each box */
    JSL_ARRAY(jsl_real) size;   /* scratch */
} jsl_particle_grid;

jsl_result jsl_particle_grid_build(jsl_memory *memory, jsl_particle_grid *grid,
                                   const jsl_collider_set *set);
void jsl_particle_grid_free(jsl_memory *memory, jsl_particle_grid *grid);

/* Whether some box meets this one. */
bool jsl_particle_grid_meets(const jsl_particle_grid *grid, jsl_aabb box);

static inline int32_t jsl_particle_grid_axis(jsl_real x, jsl_real origin, jsl_real inv, int32_t n) {
    jsl_real f = (x - origin) * inv;
    f = f > 0 ? f : 0; /* NaN too */
    f = f < (jsl_real)(n - 1) ? f : (jsl_real)(n - 1);
    return (int32_t)f;
}

/* The cells that a box covers, clamped to the grid. */
static inline jsl_cells jsl_particle_grid_cells(const jsl_particle_grid *g, jsl_aabb b) {
    jsl_vec3 o = g->origin;
    return (jsl_cells){{jsl_particle_grid_axis(b.lo.x, o.x, g->inv_cell, g->n[0]),
                        jsl_particle_grid_axis(b.lo.y, o.y, g->inv_cell, g->n[1]),
                        jsl_particle_grid_axis(b.lo.z, o.z, g->inv_cell, g->n[2])},
                       {jsl_particle_grid_axis(b.hi.x, o.x, g->inv_cell, g->n[0]),
                        jsl_particle_grid_axis(b.hi.y, o.y, g->inv_cell, g->n[1]),
                        jsl_particle_grid_axis(b.hi.z, o.z, g->inv_cell, g->n[2])}};
}

static inline int64_t jsl_particle_cells_count(const jsl_cells *c) {
    return (int64_t)(c->hi[0] - c->lo[0] + 1) * (c->hi[1] - c->lo[1] + 1) *
           (c->hi[2] - c->lo[2] + 1);
}

/* -- What one emitter's particles obey during this step ------------------------------------------
 */

/* A plane n.x = offset + rate t whose back is solid; t since the start of the step. */
typedef struct jsl_particle_plane {
    jsl_vec3 n;
    jsl_real offset, rate; /* m, m/s */
    jsl_vec3 velocity, spin, centre;
} jsl_particle_plane;

typedef struct jsl_particle_rules {
    jsl_entity emitter;
    jsl_particle_law law;
    jsl_particle_map map; /* of one sub-step */
    jsl_real restitution, friction, contact_size;
    uint32_t category, mask;
    bool ghost, bounded;
    jsl_aabb bounds;
    const jsl_particle_plane *plane; /* those it may meet */
    int32_t planes;
    int64_t alive;
} jsl_particle_rules;

static inline bool jsl_particle_meets(const jsl_particle_rules *rules,
                                      const jsl_collider_item *item) {
    return (item->category & rules->mask) && (rules->category & item->mask);
}

/* Distances along n below this share of |n.x x| + |n.y y| + |n.z z| are rounding of coordinates. */
#define JSL_PARTICLE_SLOP (8 * JSL_REAL_EPSILON)

/* -- Collisions of one particle (bounce.c)
 * -------------------------------------------------------------------- */

typedef struct jsl_particle_solids {
    const jsl_collider_set *set; /* null: nothing is solid */
    const jsl_particle_grid *grid;
} jsl_particle_solids;

/* Moves a particle of the given radius from the state at `begin` seconds after the start of the
 * step (when colliders have the poses of the set) over h seconds, of which `map` is the step
 * without collisions. */
void jsl_particle_bounce(const jsl_particle_solids *solids, const jsl_particle_rules *rules,
                         const jsl_particle_map *map, jsl_real radius, jsl_real begin, jsl_real h,
                         jsl_vec3 *position, jsl_vec3 *velocity);

/* -- Kernels (move_kernel.c)
 * ------------------------------------------------------------------------------------ */

#define PARTICLE_DIED 1u    /* some row's age has reached its life */
#define PARTICLE_OUTSIDE 2u /* some row left its bounds */
#define PARTICLE_BAD 4u     /* some row is not finite */

/* Consecutive rows of one emitter. */
typedef struct jsl_particle_tile {
    int64_t count;
    jsl_real *px, *py, *pz, *vx, *vy, *vz, *age;
    const jsl_real *life, *size;
    bool mortal;
    int substeps;
    jsl_real h, dt;
    const jsl_particle_rules *rules;
    const jsl_particle_grid *grid; /* null: nothing finite is solid */
    const jsl_particle_solids *solids;
} jsl_particle_tile;

/* -- The room
 * ------------------------------------------------------------------------------------------------------
 */

/* Consecutive rows of one emitter that all can, or all cannot, die of age. */
typedef struct jsl_particle_run {
    int64_t begin, end;
    jsl_entity emitter;
    int32_t rules; /* index, -1: the emitter is gone */
    bool mortal;
} jsl_particle_run;

typedef struct jsl_particle_table {
    uint64_t revision; /* of the table when the runs were found */
    int64_t rows;
    JSL_ARRAY(jsl_particle_run) run;
    JSL_ARRAY(uint8_t) flags; /* PARTICLE_* of each block */
} jsl_particle_table;

struct jsl_particle_room {
    jsl_ecs *ecs;
    jsl_memory *memory;
    jsl_component position, orientation, velocity, particle, emitter, look;
    jsl_query particles, emitters;
    jsl_particle_grid grid;
    jsl_particle_solids solids;
    JSL_ARRAY(jsl_particle_rules) rules; /* of every emitter, by entity id */
    JSL_ARRAY(jsl_particle_plane) plane;
    JSL_ARRAY(jsl_particle_table) table; /* indexed by the ECS's number of the table */
    JSL_ARRAY(uint8_t) dead;
    JSL_ARRAY(double) birth; /* times of birth within the step */
};

/* Terms of the two queries. */
enum { TERM_POSITION, TERM_VELOCITY, TERM_PARTICLE };
enum { EMITTER_SELF, EMITTER_POSITION, EMITTER_ORIENTATION, EMITTER_VELOCITY };

/* Works out the rules of every emitter, and the runs of every table, for this step (prepare.c). */
jsl_result jsl_particle_prepare(jsl_particle_room *room, const jsl_step_context *context);
/* Notes that rows [begin, begin + count) of one emitter were appended to a table. */
jsl_result jsl_particle_runs_append(jsl_particle_room *room, const jsl_rows *rows, int32_t rules,
                                    bool mortal);
/* Notes that the rows with dead[row] != 0 have left. */
void jsl_particle_runs_remove(jsl_particle_room *room, uint32_t table, const uint8_t *dead);

/* Systems. */
jsl_result jsl_particle_index_system(const jsl_step_context *context, void *user);
jsl_result jsl_particle_prepare_system(const jsl_step_context *context, void *user);
void jsl_particle_move_system(const jsl_step_context *context, const jsl_rows *rows, void *user);
jsl_result jsl_particle_retire_system(const jsl_step_context *context, void *user);
jsl_result jsl_particle_birth_system(const jsl_step_context *context, void *user);

/* JSL_OK, or logs the first bad field (emitter.c). */
jsl_result jsl_emitter_desc_check(const jsl_logger *logger, const jsl_emitter_desc *desc);

#endif
