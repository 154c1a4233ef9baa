/* SPDX-License-Identifier: MIT
 * jostle/shape.h - what solid things are made of, and questions about one or two of them.
 *
 * Shapes are values: a kind and a few lengths, in a frame whose origin is the centre of mass.
 * Floor 3.
 */
#ifndef JOSTLE_SHAPE_H
#define JOSTLE_SHAPE_H

#include <jostle/base.h>
#include <jostle/math.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Handles into the tables of one world; zero is null. */
typedef struct jsl_shape {
    uint32_t id;
} jsl_shape;
typedef struct jsl_material {
    uint32_t id;
} jsl_material;

typedef enum jsl_shape_kind {
    JSL_SHAPE_NONE,
    JSL_SHAPE_SPHERE,  /* radius */
    JSL_SHAPE_BOX,     /* half */
    JSL_SHAPE_CAPSULE, /* radius; segment from (0,0,-half.z) to (0,0,+half.z) */
    JSL_SHAPE_PLANE,   /* the half space z <= 0 of its frame is solid; static only */
    JSL_SHAPE_KIND_COUNT
} jsl_shape_kind;

typedef struct jsl_shape_desc {
    jsl_shape_kind kind;
    jsl_real radius; /* m, > 0 where used */
    jsl_vec3 half;   /* m, half extents, > 0 where used */
} jsl_shape_desc;

JSL_API const char *jsl_shape_kind_text(jsl_shape_kind kind);
/* JSL_ERR_NOT_FINITE or JSL_ERR_ARGUMENT (a length that is not positive, an unknown kind). */
JSL_API jsl_result jsl_shape_check(const jsl_shape_desc *shape);

typedef struct jsl_mass_properties {
    jsl_real volume;  /* m^3; infinite shapes: 0 */
    jsl_real mass;    /* kg */
    jsl_vec3 inertia; /* kg m^2, principal, about the centre of mass */
} jsl_mass_properties;
/* Of a homogeneous shape of the given density (kg/m^3). Planes have none: JSL_ERR_ARGUMENT. */
JSL_API jsl_result jsl_shape_mass(const jsl_shape_desc *shape, jsl_real density,
                                  jsl_mass_properties *out);

/* Bounds of the placed shape; a plane's are +-1e30 where it is unbounded. */
JSL_API jsl_aabb jsl_shape_aabb(const jsl_shape_desc *shape, jsl_pose pose);
/* Radius of the bounding sphere about the origin; a plane's is 1e30. */
JSL_API jsl_real jsl_shape_radius(const jsl_shape_desc *shape);

/* Signed distance from a world point to the surface (negative inside) and the outward unit normal
 * there. Exact for all kinds. */
JSL_API jsl_real jsl_shape_point_distance(const jsl_shape_desc *shape, jsl_pose pose,
                                          jsl_vec3 point, jsl_vec3 *normal);

typedef struct jsl_ray_hit {
    jsl_real fraction; /* of the segment, 0..1 */
    jsl_vec3 point, normal;
} jsl_ray_hit;
/* First hit of the segment from..to; false when there is none. A segment that starts inside hits at
 * fraction 0. */
JSL_API bool jsl_shape_ray(const jsl_shape_desc *shape, jsl_pose pose, jsl_vec3 from, jsl_vec3 to,
                           jsl_ray_hit *out);

/* The nearest points of two placed shapes. */
typedef struct jsl_gap {
    jsl_real distance; /* m, negative when they overlap */
    jsl_vec3 normal;   /* unit, from A to B */
    jsl_vec3 point_a,
        point_b; /* m, world, on the two surfaces; point_b - point_a = distance * normal */
} jsl_gap;
/* Signed distance: exact while the shapes are apart and, where a radius is around them, in shallow
 * overlap; deeper it is the depth that jsl_collide gives. JSL_ERR_ARGUMENT for two planes; else as
 * jsl_shape_check. */
JSL_API jsl_result jsl_shape_distance(const jsl_shape_desc *a, jsl_pose pose_a,
                                      const jsl_shape_desc *b, jsl_pose pose_b, jsl_gap *out);

/* A shape's motion during a step: constant velocity and constant spin (world) about its origin. */
typedef struct jsl_sweep {
    jsl_pose pose;           /* at time 0 */
    jsl_vec3 velocity, spin; /* m/s, rad/s; a plane's spin must be 0 */
} jsl_sweep;

typedef enum jsl_toi_method {
    JSL_TOI_CONSERVATIVE, /* advances by what the motion can close at most: never passes a contact
                           */
    JSL_TOI_BISECTION, /* halves the step while its end overlaps: some root, not always the first;
                        * blind to contacts that end in the step */
    JSL_TOI_LINEAR /* one straight line from the distance at the start to that at the end; as blind,
                      and not exact */
} jsl_toi_method;

typedef enum jsl_toi_state {
    JSL_TOI_SEPARATED,  /* no contact found up to dt */
    JSL_TOI_HIT,        /* contact at `time` */
    JSL_TOI_OVERLAPPED, /* already at time 0 */
    JSL_TOI_FAILED      /* gave up at `time`; conservative: there is no contact before it */
} jsl_toi_state;

typedef struct jsl_toi {
    jsl_toi_state state;
    jsl_real time;   /* s, 0..dt */
    int evaluations; /* of the distance: what it cost */
    jsl_gap gap;     /* at `time` */
} jsl_toi;

/* When two shapes first come within `tolerance` (m, > 0; a few thousand roundings of the
 * coordinates or it fails) during dt (s, >= 0). JSL_ERR_ARGUMENT, JSL_ERR_NOT_FINITE as usual; *out
 * unchanged then. */
JSL_API jsl_result jsl_time_of_impact(const jsl_shape_desc *a, const jsl_sweep *sweep_a,
                                      const jsl_shape_desc *b, const jsl_sweep *sweep_b,
                                      jsl_real dt, jsl_real tolerance, jsl_toi_method method,
                                      jsl_toi *out);

#define JSL_MAX_MANIFOLD 4
/* Contact of two placed shapes: up to 4 points sharing one normal. */
typedef struct jsl_manifold {
    int count;
    jsl_vec3 normal;                       /* unit, from A to B */
    jsl_vec3 point[JSL_MAX_MANIFOLD];      /* m, world, midway between the surfaces */
    jsl_real separation[JSL_MAX_MANIFOLD]; /* m, negative when penetrating */
    uint32_t feature[JSL_MAX_MANIFOLD]; /* names the features that met: stable while the pair rocks
                                           and slides */
} jsl_manifold;

/* Contact of A and B; points farther apart than margin are left out. count 0: no contact. Pairs:
 * all of sphere, box, capsule, plane (plane-plane never). Swapping A and B negates the normal and
 * gives the same points. */
JSL_API void jsl_collide(const jsl_shape_desc *a, jsl_pose pose_a, const jsl_shape_desc *b,
                         jsl_pose pose_b, jsl_real margin, jsl_manifold *out);

#ifdef __cplusplus
}
#endif
#endif
