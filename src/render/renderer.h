/* SPDX-License-Identifier: MIT
 * renderer.h - what the files of this room share: the renderer, its pictures and its lists of what
 * to draw.
 */
#ifndef JSL_RENDER_RENDERER_H
#define JSL_RENDER_RENDERER_H

#include "jostle/render.h"
#include "render/ctx.h"
#include "render/gl.h"
#include "render/mesh.h"
#include "render/shaders.h"
#include "render/view.h"

/* Instances as the GPU reads them. */
typedef struct jsl_body_instance {
    float centre[3]; /* relative to the eye */
    float turn[4];
    float size[4]; /* half extents, radius */
    uint8_t rgba[4];
} jsl_body_instance;

typedef struct jsl_bird_instance {
    float centre[4]; /* relative to the eye; length in m */
    float ahead[4];  /* unit; phase of the wing beat, rad */
    float above[4];  /* unit; amplitude of the wing beat, rad */
    uint8_t rgba[4];
} jsl_bird_instance;

/* A particle between culling and drawing. Metres in the view: x right, y up, z forward; a is the
 * half axis along the projected velocity. */
typedef struct jsl_sprite {
    float x, y, z;
    float ax, ay; /* long half axis */
    float b;      /* length of the short half axis */
    uint8_t rgba[4];
} jsl_sprite;

typedef struct jsl_sprite_vertex {
    float clip[4];
    int8_t corner[4]; /* along, across, towards the sun, unused; 127 is twice the half axis */
    uint8_t rgba[4];
} jsl_sprite_vertex;

typedef struct jsl_plane_patch {
    float plane[5][4]; /* the uniform of the plane shader */
    float cut[2][4]; /* where its lines x and y cut it into nine, m; shadows fall in the middle one
                        only */
    bool level;
} jsl_plane_patch;

/* A run of instances of one mesh. */
typedef struct jsl_body_run {
    jsl_mesh_kind mesh;
    int first, count;
} jsl_body_run;

#define JSL_CLOUD_SIDE 128 /* texels of the particles' shadow */

typedef enum jsl_program {
    JSL_PROGRAM_BOX,
    JSL_PROGRAM_ROUND,
    JSL_PROGRAM_BODY_SHADOW,
    JSL_PROGRAM_BIRD,
    JSL_PROGRAM_BIRD_SHADOW,
    JSL_PROGRAM_GROUND,
    JSL_PROGRAM_GROUND_SUNNY,
    JSL_PROGRAM_PATCH,
    JSL_PROGRAM_SKY,
    JSL_PROGRAM_SPRITE,
    JSL_PROGRAM_SPARK,
    JSL_PROGRAM_BLUR,
    JSL_PROGRAM_GLOW,
    JSL_PROGRAM_COUNT
} jsl_program;

/* Framebuffers with what they draw to. Names of OpenGL objects; 0: not made. */
typedef struct jsl_targets {
    GLuint many, many_color, many_depth; /* multisampled, solid things */
    GLuint one, one_color,
        one_depth;             /* resolved; particles are drawn here: softness needs no samples */
    GLuint light, light_color; /* sum of glowing particles, half floats, same depth */
    GLuint halo[2], halo_color[2]; /* a quarter of the size */
    GLuint shadow, shadow_depth;
    int shadow_side;
    int halo_width, halo_height;
} jsl_targets;

typedef struct jsl_buffers {
    GLuint solid_vertices, solid_indices, body_instances, solid_array;
    GLuint bird_vertices, bird_indices, bird_instances, bird_array;
    GLuint plane_vertices, plane_indices, plane_array;
    GLuint sprite_vertices, sprite_array;
    GLuint screen_array, block, cloud;
} jsl_buffers;

struct jsl_renderer {
    jsl_memory memory;
    jsl_logger logger;
    jsl_render_desc desc; /* defaults filled in */
    jsl_ctx *ctx;
    jsl_gl gl;
    GLuint program[JSL_PROGRAM_COUNT];
    jsl_targets targets;
    jsl_buffers buffers;
    jsl_mesh_range mesh[JSL_MESH_COUNT];

    /* Of the frame being drawn. */
    jsl_span span;
    jsl_view view;
    jsl_sunview sun;
    jsl_frame_block block;
    JSL_ARRAY(jsl_body_instance) bodies;
    JSL_ARRAY(jsl_body_run)
    runs; /* opaque ones, then from clear_runs on translucent ones, back to front */
    int64_t clear_runs;
    JSL_ARRAY(jsl_bird_instance) birds;
    JSL_ARRAY(jsl_plane_patch) patches;
    JSL_ARRAY(jsl_sprite) sprites;
    JSL_ARRAY(jsl_sprite_vertex) sprite_vertices;
    JSL_ARRAY(uint32_t) keys, order, tmp_keys, tmp_order;
    float *cloud; /* JSL_CLOUD_SIDE squared, twice */
    int64_t bodies_drawn, birds_drawn,
        particles_drawn; /* for the text: elements that the frame holds */

    uint8_t *rgba; /* as OpenGL gives it: bottom row first */
    uint8_t *rgb;
};

/* targets.c */
jsl_result jsl_targets_create(jsl_renderer *r);
void jsl_targets_destroy(jsl_renderer *r);

/* lists.c: what to draw, from the frame. */
jsl_result jsl_list_bodies(jsl_renderer *r, const jsl_frame *frame);
jsl_result jsl_list_birds(jsl_renderer *r, const jsl_frame *frame);
/* sprites.c */
jsl_result jsl_list_sprites(jsl_renderer *r, const jsl_frame *frame);
void jsl_cloud_make(jsl_renderer *r, const jsl_frame *frame);

/* Indices into the 4 x 4 corners of a patch: first the square in the middle, then the eight round
 * it. */
#define JSL_PATCH_INDICES 54
#define JSL_PATCH_MIDDLE 6

/* passes.c: the draw calls, in the order in which they are declared. */
void jsl_pass_upload(jsl_renderer *r);
void jsl_pass_shadow(jsl_renderer *r);
void jsl_pass_solid(jsl_renderer *r);
void jsl_pass_resolve(jsl_renderer *r);
void jsl_pass_sprites(jsl_renderer *r, bool additive);
void jsl_pass_glow(jsl_renderer *r);

/* text.c: draws into top-first RGB rows. */
void jsl_text_overlay(const jsl_renderer *r, const jsl_frame *frame);

/* 0xRRGGBBAA as bytes. */
static inline void jsl_rgba_bytes(uint32_t rgba, uint8_t out[4]) {
    for (int k = 0; k < 4; k++) out[k] = (uint8_t)(rgba >> (24 - 8 * k));
}

#endif
