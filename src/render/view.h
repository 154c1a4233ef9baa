/* SPDX-License-Identifier: MIT
 * view.h - where the camera stands, what the frame spans, and the matrices of both camera and sun.
 */
#ifndef JSL_RENDER_VIEW_H
#define JSL_RENDER_VIEW_H

#include "base/base.h"
#include "jostle/frame.h"

#include <math.h>
#include <stdbool.h>

/* Frames are float in both precisions, and so is drawing. */
typedef struct jsl_f3 {
    float x, y, z;
} jsl_f3;

static inline jsl_f3 jsl_f3_make(float x, float y, float z) { return (jsl_f3){x, y, z}; }
static inline jsl_f3 jsl_f3_add(jsl_f3 a, jsl_f3 b) {
    return jsl_f3_make(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline jsl_f3 jsl_f3_sub(jsl_f3 a, jsl_f3 b) {
    return jsl_f3_make(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline jsl_f3 jsl_f3_scale(jsl_f3 a, float s) {
    return jsl_f3_make(a.x * s, a.y * s, a.z * s);
}
static inline float jsl_f3_dot(jsl_f3 a, jsl_f3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline jsl_f3 jsl_f3_cross(jsl_f3 a, jsl_f3 b) {
    return jsl_f3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline float jsl_f3_length(jsl_f3 a) { return sqrtf(jsl_f3_dot(a, a)); }
static inline jsl_f3 jsl_f3_unit(jsl_f3 a) { return jsl_f3_scale(a, 1 / jsl_f3_length(a)); }

/* Coordinates beyond this, and NaN, are not drawn: their products would overflow. */
#define JSL_DRAW_LIMIT 1e9f
static inline bool jsl_drawable(float x) { return fabsf(x) <= JSL_DRAW_LIMIT; }
static inline bool jsl_drawable3(float x, float y, float z) {
    return jsl_drawable(x) && jsl_drawable(y) && jsl_drawable(z);
}
#define JSL_PARTICLE_SIZE 0.04f /* m, where the frame tells none */

/* Components of a velocity or acceleration: 0 when the column is absent or holds no number. */
static inline float jsl_component(const float *column, int64_t i) {
    return column && jsl_drawable(column[i]) ? column[i] : 0;
}

typedef struct jsl_box3 {
    jsl_f3 lo, hi; /* empty when lo.x > hi.x */
} jsl_box3;

#define JSL_SPAN_POINTS 256 /* of each kind, at most */

/* What a frame spans, far outliers left out; and the height of the ground. */
typedef struct jsl_span {
    jsl_f3
        point[3 * JSL_SPAN_POINTS]; /* some of what is inside the boxes, for fitting the camera */
    float radius[3 * JSL_SPAN_POINTS];
    int points;
    jsl_box3 bodies, boids, particles;
    float particle_size; /* m, mean */
    float ground;        /* m: z of the highest level plane, or of the grid that is drawn unasked */
    bool has_level;      /* a level plane is among the bodies: no other ground is wanted */
} jsl_span;

typedef struct jsl_view {
    jsl_f3 eye, target;
    jsl_f3 right, up, forward; /* unit */
    float distance;            /* eye to target, m */
    float tan_x, tan_y;        /* half the picture at 1 m */
    float near;                /* m */
    float pixel;               /* m per pixel at 1 m */
    float camera[16]; /* relative world to clip; reversed depth (1 near, 0 infinitely far), column
                         major */
} jsl_view;

/* The light of the sun, as a square parallel projection round what can be seen of the things that
 * cast shadows. */
typedef struct jsl_sunview {
    jsl_f3 right, up, to_sun; /* unit */
    float clip[16];           /* relative world to clip of the shadow map, depth 0..1 */
    float texture[16];        /* relative world to texture, all 0..1 */
    float texel;              /* m */
} jsl_sunview;

/* The radius of the ball round a body's shape; 0 when it is not to be drawn, planes included. */
float jsl_frame_body_radius(const jsl_frame *frame, int64_t i);
/* Its shape if body i has finite position, a valid index and a rotation; null otherwise. *turn gets
 * the unit rotation. */
const jsl_frame_shape *jsl_frame_body(const jsl_frame *frame, int64_t i, float turn[4]);

void jsl_span_make(const jsl_frame *frame, jsl_span *span);
void jsl_view_make(const jsl_frame *frame, const jsl_span *span, int width, int height,
                   jsl_view *view);
void jsl_sunview_make(const jsl_view *view, const jsl_span *span, jsl_f3 to_sun, int texels,
                      jsl_sunview *sun);

#endif
