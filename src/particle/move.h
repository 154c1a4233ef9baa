/* SPDX-License-Identifier: MIT
 * Between the moving system and its kernel. Floor 4.
 */
#ifndef JSL_PARTICLE_MOVE_H
#define JSL_PARTICLE_MOVE_H

#include "math/wide_dispatch.h"
#include "particle/room.h"

/* Rows put aside before they were moved, with their states and sizes. */
typedef struct jsl_particle_hits {
    int32_t row[PARTICLE_CHUNK]; /* within the chunk */
    jsl_real px[PARTICLE_CHUNK], py[PARTICLE_CHUNK], pz[PARTICLE_CHUNK];
    jsl_real vx[PARTICLE_CHUNK], vy[PARTICLE_CHUNK], vz[PARTICLE_CHUNK];
    jsl_real size[PARTICLE_CHUNK];
} jsl_particle_hits;

/* Moves the rows of a tile through one step; returns PARTICLE_* flags. */
JSL_KERNEL_DECLARE(uint32_t, jsl_particle_move, (const jsl_particle_tile *tile));

/* Sets near[row] = 2 for those of the given rows (of the chunk that starts at `first`) whose box
 * over a step, in which a coordinate changes by at most time |v| + far, meets that of something
 * finite; returns whether any does. */
bool jsl_particle_look(const jsl_particle_tile *tile, int64_t first, const int32_t *row, int count,
                       jsl_real time, jsl_vec3 far, uint8_t *near);

/* Moves rows put aside through one sub-step with collisions and writes them to their places, first
 * + row. */
uint32_t jsl_particle_redo(const jsl_particle_tile *tile, int64_t first,
                           const jsl_particle_hits *hits, int count, jsl_real begin);

#endif
