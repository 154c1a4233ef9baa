/* SPDX-License-Identifier: MIT
 * jostle/frame.h - one instant of a world as flat arrays of float: what logs are decoded into and
 * pictures are drawn from. Floor 5.
 *
 * Arrays belong to whoever filled the frame and hold `count` elements; any of them may be null when
 * the log or the scene did not have it. SI units; quaternions (x,y,z,w) body to world; rgba is
 * 0xRRGGBBAA.
 */
#ifndef JOSTLE_FRAME_H
#define JOSTLE_FRAME_H

#include <jostle/shape.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct jsl_frame_particles {
    int64_t count;
    const float *px, *py, *pz, *vx, *vy, *vz;
    const float *size;    /* m, radius of the sprite */
    const uint32_t *rgba; /* null: white */
} jsl_frame_particles;

typedef struct jsl_frame_boids {
    int64_t count;
    const float *px, *py, *pz, *vx, *vy, *vz;
    const float *ax, *ay, *az; /* m/s^2, for banking */
    const uint32_t *rgba;
    float length; /* m, of a drawn bird; 0: 0.5 */
} jsl_frame_boids;

/* A shape of the scene's table, in float. */
typedef struct jsl_frame_shape {
    jsl_shape_kind kind;
    float radius, half[3];
} jsl_frame_shape;

typedef struct jsl_frame_bodies {
    int64_t count;
    const float *px, *py, *pz, *qx, *qy, *qz, *qw;
    const int32_t *shape; /* index into shapes */
    const uint32_t *rgba;
    const uint64_t *id; /* jsl_entity_id */
} jsl_frame_bodies;

typedef struct jsl_frame_camera {
    float eye[3], target[3]; /* m; equal: the camera is chosen to see everything */
    float fov;               /* vertical, degrees; 0: 45 */
    float orbit;             /* turns per simulated second about the vertical through target */
} jsl_frame_camera;

typedef struct jsl_frame {
    double time; /* s, simulated */
    int64_t step;
    const char *scene; /* name */
    jsl_frame_particles particles;
    jsl_frame_boids boids;
    jsl_frame_bodies bodies; /* everything with a shape, static ones and planes too */
    const jsl_frame_shape *shapes;
    int64_t shape_count;
    jsl_frame_camera camera;
    bool additive; /* particles add light instead of covering */
} jsl_frame;

#ifdef __cplusplus
}
#endif
#endif
