/* SPDX-License-Identifier: MIT
 * mesh.h - the few meshes of which everything solid is drawn.
 */
#ifndef JSL_RENDER_MESH_H
#define JSL_RENDER_MESH_H

#include "base/base.h"

/* point is scaled by half extents, direction by a radius; their sum is the surface (see the body
 * shader). */
typedef struct jsl_solid_vertex {
    float point[3], direction[3];
} jsl_solid_vertex;

typedef enum jsl_mesh_kind {
    JSL_MESH_BOX,
    JSL_MESH_ROUND_LOW, /* a sphere cut at its equator, so that a capsule is a sphere pulled apart
                         */
    JSL_MESH_ROUND_MID,
    JSL_MESH_ROUND_HIGH,
    JSL_MESH_COUNT
} jsl_mesh_kind;

typedef struct jsl_mesh_range {
    int first_index, index_count, first_vertex;
} jsl_mesh_range;

/* point in lengths of the bird: x ahead, y left, z up. beat[0]: how far out on a wing, beat[1]:
 * brightness. */
typedef struct jsl_bird_vertex {
    float point[3], beat[2];
} jsl_bird_vertex;

#define JSL_SOLID_VERTICES_MAX 1400
#define JSL_SOLID_INDICES_MAX 7200

/* Fills the arrays (of the sizes above) and says what is used. */
void jsl_mesh_solids(jsl_solid_vertex *vertex, int *vertices, uint16_t *index, int *indices,
                     jsl_mesh_range range[JSL_MESH_COUNT]);

extern const jsl_bird_vertex jsl_bird_vertices[];
extern const int jsl_bird_vertex_count;
extern const uint16_t jsl_bird_indices[];
extern const int jsl_bird_index_count;

#endif
