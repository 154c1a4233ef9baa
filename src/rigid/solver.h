/* SPDX-License-Identifier: MIT
 * Data of the contact solver and its kernels. Floor 4.
 *
 * Manifolds are solved in blocks of 16 (JSL_LANES): every field of a block is 16 adjacent numbers,
 * so the layout is the same whatever the width of the hardware, and a kernel of WN lanes takes a
 * block in 16 / WN bites. All kernels are elementwise: lanes never meet, hence the same bits at
 * every width.
 */
#ifndef JSL_RIGID_SOLVER_H
#define JSL_RIGID_SOLVER_H

#include "base/base.h"
#include "math/wide_dispatch.h"
#include <jostle/math.h>

/* -- Bodies as the solver sees them ---------------------------------------------------------- */

#define JSL_LINE 16 /* reals of a body's line: v 3, 1/m, w 3, 0, world inverse inertia 6, 0, 0 */
#define JSL_MOVE                                                                                   \
    8              /* displacement since the step's origin 3, 0, rotation since then (quaternion)  \
                    */
#define JSL_BASE 8 /* velocity after kicks and before impulses of this sub-step: v 3, 0, w 3, 0 */
#define JSL_KICK                                                                                   \
    8 /* acceleration 3, linear damping factor, angular acceleration 3, angular factor */
#define JSL_POSE 8 /* position 3, 0, orientation */
#define JSL_TURN 4 /* principal inertia 3, what turns it (JSL_TURN_*) */

/* How a body turns in the position update. */
#define JSL_TURN_FREE 0     /* constant spin: exact for isotropic inertia */
#define JSL_TURN_IMPLICIT 1 /* implicit gyroscopic term in the velocity update */
#define JSL_TURN_SPLIT 2    /* by the splitting integrator, outside the wide kernel */

typedef struct jsl_rigid_bodies {
    jsl_real *line, *move, *base, *kick, *pose, *turn; /* of slot i at i * JSL_x */
} jsl_rigid_bodies;

/* -- Geometry of a contact between steps ----------------------------------------------------- */

/* One record a contact: the manifold in the frames of its bodies, as built by the last narrow phase
 * that ran for the pair, and the impulses. B is always dynamic; A may be immovable. */
enum {
    JSL_GEO_NORMAL = 0,   /* in A's frame, from A to B */
    JSL_GEO_FRICTION = 3, /* coefficient of the pair */
    JSL_GEO_A = 4,        /* point j at 4 + 4 j: R_A^T (p - x_B), and separation when built */
    JSL_GEO_B = 20,       /* point j at 20 + 4 j: R_B^T (p - x_B), and a spare */
    JSL_GEO_TANGENT = 36, /* friction impulse, world */
    JSL_GEO_TWIST = 39,   /* twisting impulse about the normal */
    JSL_GEO_SHIFT = 40,   /* R_A^T (x_B - x_A): when built minus now */
    JSL_GEO_BOUNCE = 43,  /* restitution of the pair */
    JSL_GEO_TURN = 44,    /* q_A* q_B when built */
    JSL_GEO_OFFSET = 48,  /* R_A^T (x_B - x_A) when built */
    JSL_GEO_ROUND =
        52, /* radii of A and B about the cores that the points belong to: 0 for boxes */
    JSL_GEO_SCALE = 54,   /* 1 / margin */
    JSL_GEO_GAP = 55,     /* smallest separation now, m */
    JSL_GEO_RUB = 56,     /* tangential impulse over the last step on B, world, N s */
    JSL_GEO_PUSH = 59,    /* normal impulse over the last step, N s */
    JSL_GEO_IMPULSE = 60, /* of the points, to start from */
    JSL_GEO = 64
};
/* Separation of a point that is not there. */
#define JSL_FAR JSL_R(1e9)

/* -- Blocks ---------------------------------------------------------------------------------- */

/* Fields of the normal part of a block. */
enum {
    JSL_N_NORMAL = 0,
    JSL_N_TANGENT = 3,
    JSL_N_ARM_A = 6, /* friction centre from A's centre of mass */
    JSL_N_ARM_B = 9,
    JSL_N_XY = 12,   /* x_j, y_j of the points about the friction centre along the tangents */
    JSL_N_GAP = 20,  /* separations now */
    JSL_N_MASS = 24, /* 1 / K_jj */
    JSL_N_K = 28,    /* K_01 K_02 K_03 K_12 K_13 K_23 */
    JSL_N_IMPULSE = 34,
    JSL_N = 38
};
/* Fields of the friction part. */
enum {
    JSL_F_GAP = 0, /* separations at the step's origin */
    JSL_F_LEVER = 4,
    JSL_F_MU = 8,
    JSL_F_TANGENT = 9,
    JSL_F_TWIST = 11,
    JSL_F_TWIST_MASS = 12,
    JSL_F_MASS = 13,   /* inverse of the 2x2 block: 11, 12, 22 */
    JSL_F_COUPLE = 16, /* 3 of the twist, 4 each of the tangents: see the prepare kernel */
    JSL_F_ROUND = 27,  /* radii of A and B */
    JSL_F_SUM = 29,    /* over the step: normal impulse, two tangential */
    JSL_F = 32
};
/* Fields of the bounce part, touched only when some pair has restitution. */
enum { JSL_R_BOUNCE = 0, JSL_R_SPEED = 1, JSL_R_MOST = 5, JSL_R_FIELDS = 9 };

typedef struct jsl_rigid_blocks {
    jsl_real *normal, *friction, *bounce;
    int32_t *a, *b;   /* slot of each lane's bodies */
    int32_t *contact; /* index of its geometry record; padding lanes point at an empty one */
} jsl_rigid_blocks;

/* Soft constraint: bias rate (1/s), and scales of the new and the accumulated impulse. Catto, "Soft
 * contact", Solver2D 2024: w = 2 pi hertz, a1 = 2 zeta + h w, a2 = h w a1, a3 = 1 / (1 + a2). */
typedef struct jsl_rigid_soft {
    jsl_real bias, mass, impulse;
} jsl_rigid_soft;

/* What a pass over lanes is told. */
typedef struct jsl_rigid_pass {
    jsl_rigid_blocks blocks;
    jsl_rigid_bodies bodies;
    jsl_real *geo;
    jsl_real h, inv_h;
    jsl_rigid_soft pair, wall; /* between dynamic bodies; against the immovable */
    jsl_real push;             /* m/s, fastest correction of overlap */
    jsl_real threshold;        /* m/s, slower approaches do not bounce */
    jsl_real kick;             /* share of h that this velocity update kicks: 1, 0.5, 0 */
    bool bounces;              /* some pair has restitution */
} jsl_rigid_pass;

/* Lanes [begin, end), multiples of the kernel's width. _wall: A of every lane is immovable and is
 * not written. */
typedef void jsl_rigid_lanes_fn(const jsl_rigid_pass *pass, int64_t begin, int64_t end);
/* Slots [begin, end), multiples of 16. */
typedef void jsl_rigid_slots_fn(const jsl_rigid_pass *pass, int64_t begin, int64_t end);

#define JSL_RIGID_KERNEL(name)                                                                     \
    JSL_KERNEL_DECLARE(void, name, (const jsl_rigid_pass *pass, int64_t begin, int64_t end))
JSL_RIGID_KERNEL(jsl_rigid_prepare);
JSL_RIGID_KERNEL(jsl_rigid_warm);
JSL_RIGID_KERNEL(jsl_rigid_warm_wall);
JSL_RIGID_KERNEL(jsl_rigid_solve);
JSL_RIGID_KERNEL(jsl_rigid_solve_wall);
JSL_RIGID_KERNEL(jsl_rigid_relax);
JSL_RIGID_KERNEL(jsl_rigid_relax_wall);
JSL_RIGID_KERNEL(jsl_rigid_bounce);
JSL_RIGID_KERNEL(jsl_rigid_bounce_wall);
JSL_RIGID_KERNEL(jsl_rigid_store);
JSL_RIGID_KERNEL(jsl_rigid_kick_first);
JSL_RIGID_KERNEL(jsl_rigid_kick_next);
JSL_RIGID_KERNEL(jsl_rigid_drift);

/* The kernels of one ISA level. */
typedef struct jsl_rigid_kernels {
    jsl_rigid_lanes_fn *prepare, *store, *warm[2], *solve[2], *relax[2],
        *bounce[2]; /* [1]: _wall */
    jsl_rigid_slots_fn *kick_first, *kick_next, *drift;
} jsl_rigid_kernels;

#endif
