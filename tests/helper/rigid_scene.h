/* SPDX-License-Identifier: MIT
 * The least world that lets the rigid room step: an ECS, the room, a table of shapes, a collider
 * set. For tests.
 */
#ifndef RIGID_SCENE_H
#define RIGID_SCENE_H

#include "ecs/ecs.h"
#include "geometry/geometry.h"
#include "rigid/rigid.h"

#define SCENE_SHAPES 64

typedef struct rigid_scene {
    jsl_ecs *ecs;
    jsl_rigid_room *room;
    jsl_arena arena;
    jsl_collider_set set;
    jsl_query solid;
    jsl_shape_desc shape[SCENE_SHAPES];                         /* by handle - 1 */
    jsl_real friction[SCENE_SHAPES], restitution[SCENE_SHAPES]; /* by material */
    int shapes;
    jsl_step_context context;
    jsl_warnings warnings;
    jsl_exec exec;
    JSL_ARRAY(uint64_t) key, tmp;
    JSL_ARRAY(uint32_t) order, tmp_order;
    JSL_ARRAY(jsl_collider_item) unsorted;
    char message[512]; /* the last line logged */
} rigid_scene;

/* Gravity 0, 4 sub-steps, dt 1/60, one worker, best ISA. Asserts on failure. */
void scene_open(rigid_scene *s, int workers);
void scene_close(rigid_scene *s);
/* A shape handle; material m has friction and restitution of index m. */
jsl_shape scene_shape(rigid_scene *s, jsl_shape_desc shape);
jsl_shape scene_box(rigid_scene *s, jsl_real hx, jsl_real hy, jsl_real hz);
jsl_shape scene_sphere(rigid_scene *s, jsl_real radius);
jsl_shape scene_plane(rigid_scene *s);
/* Fills in the shape's value from its handle. */
jsl_result scene_try(rigid_scene *s, const jsl_body_desc *desc, jsl_body *out);
jsl_body scene_body(rigid_scene *s, const jsl_body_desc *desc);
/* One step: index, detect, respond. */
void scene_step(rigid_scene *s);
void scene_steps(rigid_scene *s, int count);
jsl_body_state scene_get(rigid_scene *s, jsl_body body);
jsl_rigid_measure scene_measure(rigid_scene *s);
/* Of components and contact cache. */
uint64_t scene_hash(rigid_scene *s);
/* 2D pyramid of unit cubes in the xz plane on a ground slab; returns the number of cubes, handles
 * in out unless null. */
int64_t scene_pyramid(rigid_scene *s, int base, jsl_body *out);

#endif
