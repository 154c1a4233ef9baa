/* SPDX-License-Identifier: MIT
 * The scene format: one table a kind of object. Floor 6.
 */
#ifndef JSL_SCENE_TABLES_H
#define JSL_SCENE_TABLES_H

#include "scene/reader.h"
#include <jostle/body.h>
#include <jostle/flock.h>
#include <jostle/particle.h>

typedef struct scene_root {
    const char *name, *description;
    double seconds;
    json_t *world, *camera, *publish, *materials, *bodies, *emitters, *flocks;
} scene_root;

typedef struct scene_world {
    double dt;
    int substeps;
    jsl_vec3 gravity;
    int64_t seed;
    json_t *wind;
} scene_world;

typedef struct scene_camera {
    jsl_vec3 eye, target;
    jsl_real fov, orbit;
} scene_camera;

typedef struct scene_publish {
    double particles_hz, boids_hz, bodies_hz, components_hz;
    json_t *components;
} scene_publish;

typedef struct scene_shape {
    jsl_real sphere;
    jsl_vec3 box;
    json_t *capsule; /* an object */
    bool plane;
} scene_shape;

typedef struct scene_capsule {
    jsl_real radius, length;
} scene_capsule;

typedef struct scene_grid {
    jsl_vec3 count, spacing;
} scene_grid;

typedef struct scene_ring {
    int64_t count, layers;
    jsl_real radius, rise, stagger;
} scene_ring;

typedef struct scene_body {
    jsl_body_desc desc;
    json_t *shape, *grid, *ring;
    const char *material;
    jsl_real vary;
} scene_body;

typedef struct scene_look {
    jsl_real at, size;
    uint32_t color;
} scene_look;

typedef struct scene_emitter {
    jsl_emitter_desc desc;
    json_t *look;
    json_t *bounds;
    int64_t burst;
} scene_emitter;

typedef struct scene_bounds {
    jsl_vec3 lo, hi;
} scene_bounds;

typedef struct scene_rule {
    jsl_flock_rule rule;
} scene_rule;

typedef struct scene_boids {
    int64_t count;
    jsl_boid_spawn spawn;
} scene_boids;

typedef struct scene_leader {
    json_t *path;
    jsl_real speed;
} scene_leader;

typedef struct scene_flock {
    jsl_flock_desc desc;
    json_t *separation, *alignment, *cohesion, *bounds, *boids, *leader;
    uint32_t color;
} scene_flock;

extern const key_table table_root, table_world, table_wind, table_camera, table_publish,
    table_material, table_body, table_shape, table_capsule, table_grid, table_ring, table_emitter,
    table_look, table_bounds, table_flock, table_rule, table_boids, table_leader;

#endif
