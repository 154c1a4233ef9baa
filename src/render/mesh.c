/* SPDX-License-Identifier: MIT
 * mesh.c - boxes, round things, birds.
 */
#include "render/mesh.h"

#include <math.h>

typedef struct builder {
    jsl_solid_vertex *vertex;
    uint16_t *index;
    int vertices, indices;
    int base; /* first vertex of the mesh being built */
} builder;

static void triangle(builder *b, int i, int j, int k) {
    JSL_ASSERT(b->indices + 3 <= JSL_SOLID_INDICES_MAX);
    b->index[b->indices++] = (uint16_t)i;
    b->index[b->indices++] = (uint16_t)j;
    b->index[b->indices++] = (uint16_t)k;
}

static void vertex(builder *b, jsl_solid_vertex v) {
    JSL_ASSERT(b->vertices < JSL_SOLID_VERTICES_MAX);
    b->vertex[b->vertices++] = v;
}

/* Four corners to a face. Their direction is the face's normal: a box has radius 0, so it only
 * serves the light. */
static void box(builder *b) {
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        float sign = face & 1 ? -1.0f : 1.0f;
        int first = b->vertices - b->base;
        for (int corner = 0; corner < 4; corner++) {
            jsl_solid_vertex out = {{0}, {0}};
            out.point[axis] = out.direction[axis] = sign;
            out.point[u] = (corner == 1 || corner == 2 ? 1.0f : -1.0f) * sign;
            out.point[v] = corner >= 2 ? 1.0f : -1.0f;
            vertex(b, out);
        }
        triangle(b, first, first + 1, first + 2);
        triangle(b, first, first + 2, first + 3);
    }
}

/* Rings of latitude from the north pole down, the equator twice: once for either hemisphere's end
 * of a capsule. */
static void rounded(builder *b, int around, int down) {
    const float pi = 3.14159265f;
    for (int ring = 0; ring < 2 * (down + 1); ring++) {
        bool north = ring <= down;
        float angle = pi * 0.5f * (float)(north ? ring : ring - 1) / (float)down;
        for (int k = 0; k <= around; k++) {
            float turn = 2 * pi * (float)(k % around) / (float)around;
            vertex(b, (jsl_solid_vertex){
                          {0, 0, north ? 1.0f : -1.0f},
                          {sinf(angle) * cosf(turn), sinf(angle) * sinf(turn), cosf(angle)}});
        }
    }
    int row = around + 1;
    for (int ring = 0; ring + 1 < 2 * (down + 1); ring++)
        for (int k = 0; k < around; k++) {
            int i = ring * row + k;
            if (ring > 0) triangle(b, i, i + row, i + 1);
            if (ring < 2 * down) triangle(b, i + 1, i + row, i + row + 1);
        }
}

void jsl_mesh_solids(jsl_solid_vertex *vertices_out, int *vertices, uint16_t *index, int *indices,
                     jsl_mesh_range range[JSL_MESH_COUNT]) {
    builder b = {vertices_out, index, 0, 0, 0};
    for (int kind = 0; kind < JSL_MESH_COUNT; kind++) {
        range[kind].first_vertex = b.base = b.vertices;
        range[kind].first_index = b.indices;
        switch ((jsl_mesh_kind)kind) {
        case JSL_MESH_ROUND_LOW:
            rounded(&b, 8, 2);
            break;
        case JSL_MESH_ROUND_MID:
            rounded(&b, 18, 5);
            break;
        case JSL_MESH_ROUND_HIGH:
            rounded(&b, 36, 10);
            break;
        default:
            box(&b);
        }
        range[kind].index_count = b.indices - range[kind].first_index;
    }
    *vertices = b.vertices;
    *indices = b.indices;
}

/* A spindle with a fanned tail and two wings of three triangles. */
const jsl_bird_vertex jsl_bird_vertices[] = {
    {{0.50f, 0, 0}, {0, 1}},             /* 0 beak */
    {{0.14f, 0, 0.09f}, {0, 1}},         /* 1 back */
    {{0.12f, 0.085f, 0}, {0, 0.95f}},    /* 2 left flank */
    {{0.12f, -0.085f, 0}, {0, 0.95f}},   /* 3 right flank */
    {{0.12f, 0, -0.08f}, {0, 0.85f}},    /* 4 breast */
    {{-0.30f, 0, 0.02f}, {0, 0.9f}},     /* 5 root of the tail */
    {{-0.54f, 0.12f, 0.02f}, {0, 0.6f}}, /* 6 */
    {{-0.54f, -0.12f, 0.02f}, {0, 0.6f}},
    {{0.20f, 0.05f, 0.03f},
     {0.1f, 0.95f}}, /* 8 left wing: shoulder, its back, elbow, its back, tip */
    {{-0.15f, 0.05f, 0.03f}, {0.1f, 0.8f}},
    {{0.25f, 0.34f, 0.03f}, {0.5f, 0.85f}},
    {{-0.08f, 0.34f, 0.03f}, {0.5f, 0.65f}},
    {{-0.06f, 0.78f, 0.03f}, {1, 0.45f}},
    {{0.20f, -0.05f, 0.03f}, {-0.1f, 0.95f}}, /* 13 right wing */
    {{-0.15f, -0.05f, 0.03f}, {-0.1f, 0.8f}},
    {{0.25f, -0.34f, 0.03f}, {-0.5f, 0.85f}},
    {{-0.08f, -0.34f, 0.03f}, {-0.5f, 0.65f}},
    {{-0.06f, -0.78f, 0.03f}, {-1, 0.45f}},
};
const int jsl_bird_vertex_count = JSL_COUNT(jsl_bird_vertices);

const uint16_t jsl_bird_indices[] = {
    0, 2, 1, 0, 1, 3,  0, 4,  2,  0, 3,  4,  5,  1,  2,  5,  3,  1,  5,  2,  4,  5,  4,
    3, 5, 6, 7, 8, 10, 9, 10, 11, 9, 10, 12, 11, 13, 14, 15, 15, 14, 16, 15, 16, 17,
};
const int jsl_bird_index_count = JSL_COUNT(jsl_bird_indices);
