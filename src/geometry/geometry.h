/* SPDX-License-Identifier: MIT
 * Internal geometry: the bounding volume tree, and the set of everything solid. Floor 3.
 */
#ifndef JSL_GEOMETRY_GEOMETRY_H
#define JSL_GEOMETRY_GEOMETRY_H

#include "base/base.h"
#include <jostle/ecs.h>
#include <jostle/shape.h>

/* -- A bounding volume tree built in one go (bvh.c)
 * ---------------------------------------------------- */

/* Binary, median or binned SAH over centres; deterministic for a given order of boxes. Leaves hold
 * one item. Memory comes from the arrays' owner and is kept between builds. */
typedef struct jsl_bvh_node {
    jsl_aabb box;
    int32_t left;  /* child indices, or -1 - item for a leaf */
    int32_t right; /* unused in leaves */
} jsl_bvh_node;
typedef struct jsl_bvh_item {
    jsl_aabb box;
    int32_t item;
} jsl_bvh_item;
typedef struct jsl_bvh {
    JSL_ARRAY(jsl_bvh_node) node; /* node 0 is the root when count > 0 */
    JSL_ARRAY(jsl_bvh_item) item; /* scratch of the build */
} jsl_bvh;
void jsl_bvh_free(jsl_memory *memory, jsl_bvh *bvh);
jsl_result jsl_bvh_build(jsl_memory *memory, jsl_bvh *bvh, const jsl_aabb *box, int64_t count);
/* Same items with moved boxes: refits bounds without changing the tree. count must match the last
 * build. */
void jsl_bvh_refit(jsl_bvh *bvh, const jsl_aabb *box, int64_t count);
/* Items whose box meets the query's, in tree order (deterministic), at most cap; returns how many
 * there are. */
int64_t jsl_bvh_overlap(const jsl_bvh *bvh, jsl_aabb box, int32_t *item, int64_t cap);
/* All pairs (a < b) whose boxes meet, appended to the array in order of (a, b). */
typedef struct jsl_pair {
    int32_t a, b;
} jsl_pair;
typedef JSL_ARRAY(jsl_pair) jsl_pair_array;
jsl_result jsl_bvh_pairs(jsl_memory *memory, const jsl_bvh *bvh, const jsl_aabb *box, int64_t count,
                         jsl_pair_array *out);

static inline bool jsl_aabb_meet(jsl_aabb a, jsl_aabb b) {
    return a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && a.lo.y <= b.hi.y && b.lo.y <= a.hi.y &&
           a.lo.z <= b.hi.z && b.lo.z <= a.hi.z;
}

/* -- Everything solid (collider_set.c)
 * -------------------------------------------------------------------- */

/* One record per entity with a collider, filled by the world in the INDEX stage in order of entity
 * id, so that it does not depend on row order. Planes come in `planes` as well and are not in the
 * tree. The rooms read it; none writes. */
typedef struct jsl_collider_item {
    jsl_entity entity;
    jsl_shape_desc shape;
    jsl_pose pose;
    jsl_vec3 velocity, spin; /* m/s, rad/s (world); 0 when it has none */
    jsl_real inv_mass;       /* 1/kg; 0: immovable */
    jsl_real radius;         /* m, bounding sphere about the pose's origin */
    jsl_real friction, restitution;
    uint32_t category, mask;
    uint32_t shape_id; /* the world's shape handle value */
    uint32_t table;    /* where the entity's row is */
    int32_t row;
} jsl_collider_item;

typedef struct jsl_collider_set {
    JSL_ARRAY(jsl_collider_item) item;
    JSL_ARRAY(jsl_aabb) box;   /* of item i, grown by margin and by the motion of one step */
    JSL_ARRAY(int32_t) planes; /* indices of plane items */
    jsl_bvh bvh;               /* over all items but planes: leaf item j is finite[j] */
    JSL_ARRAY(int32_t) finite;
    JSL_ARRAY(jsl_aabb) finite_box;
    uint64_t revision; /* changes when the list of items changes, not when they move */
} jsl_collider_set;

void jsl_collider_set_free(jsl_memory *memory, jsl_collider_set *set);
/* Call after item[] is filled: computes boxes for motion over dt, and the tree. */
jsl_result jsl_collider_set_index(jsl_memory *memory, jsl_collider_set *set, jsl_real dt,
                                  jsl_real margin);
/* Items (indices into item[]) whose box meets the query's, planes included first; at most cap;
 * returns how many there are. */
int64_t jsl_collider_set_overlap(const jsl_collider_set *set, jsl_aabb box, int32_t *item,
                                 int64_t cap);
/* Nearest hit of the segment among all items whose category is in mask; false when none. */
bool jsl_collider_set_ray(const jsl_collider_set *set, jsl_vec3 from, jsl_vec3 to, uint32_t mask,
                          jsl_ray_hit *out, int32_t *item);

#endif
