/* SPDX-License-Identifier: MIT
 * shaders.h - the GLSL sources and the block of values that all of them share.
 *
 * World positions reach the GPU relative to the eye, so that a scene far from the origin does not
 * shake. Colours are linear until tone() turns them into what is stored.
 */
#ifndef JSL_RENDER_SHADERS_H
#define JSL_RENDER_SHADERS_H

/* The uniform block Frame (std140: mat4 and vec4 only, so the C layout is the same). */
typedef struct jsl_frame_block {
    float camera[16];      /* relative world to clip */
    float shadow[16];      /* relative world to shadow map, all in 0..1 */
    float shadow_clip[16]; /* the same to clip, for drawing the map */
    float right[4], up[4],
        forward[4];    /* of the view; right and up span half the picture at 1 m; right.w time */
    float sun[4];      /* xyz: unit, towards the sun; w: m per texel of the shadow map */
    float sunlight[4]; /* rgb; w: 0 no shadows, 1 shadows */
    float zenith[4], horizon[4], bounce[4]; /* rgb of the sky and of light from below */
    float eye[4];    /* xyz: the eye modulo the major grid cell; w: 1 / distance of haze */
    float screen[4]; /* width, height, m per pixel at 1 m, 1 at night */
    float cloud[4];  /* particle shadow: origin x, y relative to the eye, 1 / extent x, y */
    float grid[4]; /* minor cell in m, strength of the lines, strength of the particle shadow, 0 */
} jsl_frame_block;

/* Texture units by the names gl.c gives to samplers. */
enum { JSL_UNIT_SHADOW, JSL_UNIT_CLOUD, JSL_UNIT_A, JSL_UNIT_B, JSL_UNIT_DEPTH };

extern const char jsl_shader_frame[];   /* the block */
extern const char jsl_shader_light[];   /* tone(), sky(), sunlit(), diffuse(), shine(), haze() */
extern const char jsl_shader_body_vs[]; /* boxes and round things; SHADOW: depth only */
extern const char jsl_shader_body_fs[]; /* BOX or ROUND */
extern const char jsl_shader_bird_vs[];
extern const char jsl_shader_bird_fs[];
extern const char jsl_shader_plane_vs[];
extern const char
    jsl_shader_plane_fs[]; /* LEVEL: the ground, else a tilted patch that fades out; SHADED */
extern const char jsl_shader_screen_vs[]; /* one triangle over everything, at infinity */
extern const char jsl_shader_sky_fs[];
extern const char jsl_shader_none_fs[];
extern const char jsl_shader_sprite_vs[];
extern const char jsl_shader_sprite_fs[];
extern const char jsl_shader_blur_fs[]; /* one direction of a Gaussian */
extern const char jsl_shader_glow_fs[]; /* picture, light of particles and its halo together */

#endif
