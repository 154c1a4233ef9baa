/* SPDX-License-Identifier: MIT
 * The fused pass over the rows of one emitter: find who touches something, move, respond, age,
 * judge. Floor 4.
 *
 * Plain loops over chunks that stay in the first-level cache, whatever the number of sub-steps; the
 * compiler vectorises them for each ISA level, and since every loop is elementwise all levels give
 * the same bits. Rows that touch something are rare: their old state is put aside and they are
 * redone one by one after the loop.
 */
#include "math/wide.h"
#include "particle/move.h"

typedef struct chunk {
    int n;
    jsl_real *px, *py, *pz, *vx, *vy, *vz;
    const jsl_real *size;
} chunk;

#define CHUNK_POINTERS                                                                             \
    jsl_real *restrict px = c->px, *restrict py = c->py, *restrict pz = c->pz;                     \
    jsl_real *restrict vx = c->vx, *restrict vy = c->vy, *restrict vz = c->vz;                     \
    const jsl_real run = m->run, keep = m->keep;                                                   \
    const jsl_vec3 dx = m->dx, dv = m->dv;                                                         \
    const int n = c->n

/* x += run v + dx; v = keep v + dv. Returns whether some row is not finite. */
static bool move_rows(const chunk *c, const jsl_particle_map *m) {
    CHUNK_POINTERS;
    jsl_lane_int bad = 0;
    for (int i = 0; i < n; i++) {
        jsl_real ux = vx[i], uy = vy[i], uz = vz[i];
        jsl_real x = (px[i] + run * ux) + dx.x, y = (py[i] + run * uy) + dx.y,
                 z = (pz[i] + run * uz) + dx.z;
        ux = keep * ux + dv.x;
        uy = keep * uy + dv.y;
        uz = keep * uz + dv.z;
        px[i] = x;
        py[i] = y;
        pz[i] = z;
        vx[i] = ux;
        vy[i] = uy;
        vz[i] = uz;
        jsl_real sum = (x + y) + (z + ux) + (uy + uz);
        bad |= sum - sum == 0 ? 0 : 1;
    }
    return bad != 0;
}

/* flag |= the step ends behind the plane. */
static bool flag_plane(const chunk *c, const jsl_particle_map *m, const jsl_particle_plane *plane,
                       jsl_real offset, jsl_real share, jsl_lane_int *restrict flag) {
    CHUNK_POINTERS;
    (void)keep, (void)dv;
    const jsl_vec3 normal = plane->n;
    const jsl_real *restrict size = c->size;
    jsl_lane_int any = 0;
    if (share > 0) {
        for (int i = 0; i < n; i++) {
            jsl_real x = (px[i] + run * vx[i]) + dx.x, y = (py[i] + run * vy[i]) + dx.y,
                     z = (pz[i] + run * vz[i]) + dx.z;
            jsl_real d = (normal.x * x + normal.y * y + normal.z * z - offset) - share * size[i];
            jsl_lane_int hit = d < 0 ? 1 : 0;
            flag[i] |= hit;
            any |= hit;
        }
    } else {
        for (int i = 0; i < n; i++) {
            jsl_real x = (px[i] + run * vx[i]) + dx.x, y = (py[i] + run * vy[i]) + dx.y,
                     z = (pz[i] + run * vz[i]) + dx.z;
            jsl_real d = normal.x * x + normal.y * y + normal.z * z - offset;
            jsl_lane_int hit = d < 0 ? 1 : 0;
            flag[i] |= hit;
            any |= hit;
        }
    }
    return any != 0;
}

/* The grid cell of each row, or -1 for one that flies farther than the neighbouring cells. */
static void find_cells(const chunk *c, const jsl_particle_map *m, const jsl_particle_grid *g,
                       jsl_real share, jsl_lane_int *restrict cell) {
    CHUNK_POINTERS;
    (void)keep, (void)dv;
    const jsl_real *restrict size = c->size;
    const jsl_real ox = g->origin.x, oy = g->origin.y, oz = g->origin.z, inv = g->inv_cell;
    const jsl_real ex = (jsl_real)(g->n[0] - 1), ey = (jsl_real)(g->n[1] - 1),
                   ez = (jsl_real)(g->n[2] - 1);
    const jsl_real nx = (jsl_real)g->n[0], nxy = nx * (jsl_real)g->n[1];
    /* A little less than a cell, for the rounding of the cell index. */
    const jsl_real reach = JSL_R(0.99) * g->cell;
    for (int i = 0; i < n; i++) {
        jsl_real r = share > 0 ? share * size[i] : 0;
        jsl_real fx = (px[i] - ox) * inv, fy = (py[i] - oy) * inv, fz = (pz[i] - oz) * inv;
        fx = fx > 0 ? fx : 0;
        fy = fy > 0 ? fy : 0;
        fz = fz > 0 ? fz : 0;
        fx = fx < ex ? fx : ex;
        fy = fy < ey ? fy : ey;
        fz = fz < ez ? fz : ez;
        /* Whole numbers below 2^18 are exact in float, and so are these products. */
        jsl_real index = (jsl_real)(jsl_lane_int)fz * nxy + (jsl_real)(jsl_lane_int)fy * nx +
                         (jsl_real)(jsl_lane_int)fx;
        jsl_real sx = run * vx[i] + dx.x, sy = run * vy[i] + dx.y, sz = run * vz[i] + dx.z;
        sx = sx < 0 ? -sx : sx;
        sy = sy < 0 ? -sy : sy;
        sz = sz < 0 ? -sz : sz;
        jsl_real far = sx > sy ? sx : sy;
        far = far > sz ? far : sz;
        cell[i] = far + r < reach ? (jsl_lane_int)index : -1;
    }
}

static bool flag_solids(const chunk *c, const jsl_particle_map *m, const jsl_particle_grid *g,
                        jsl_real share, jsl_lane_int *restrict flag) {
    jsl_lane_int cell[PARTICLE_CHUNK];
    find_cells(c, m, g, share, cell);
    const uint8_t *restrict near = g->near.at;
    jsl_lane_int any = 0;
    for (int i = 0; i < c->n; i++) {
        jsl_lane_int hit = cell[i] < 0 ? 2 : (jsl_lane_int)(near[cell[i]] * 2);
        flag[i] |= hit;
        any |= hit;
    }
    return any != 0;
}

/* Puts the flagged rows' states aside; returns their number. */
static int put_aside(const chunk *c, const jsl_lane_int *restrict flag, jsl_particle_hits *hits) {
    int count = 0;
    for (int i = 0; i < c->n; i++) {
        hits->row[count] = i;
        count += flag[i] != 0;
    }
    for (int k = 0; k < count; k++) {
        int i = hits->row[k];
        hits->px[k] = c->px[i];
        hits->py[k] = c->py[i];
        hits->pz[k] = c->pz[i];
        hits->vx[k] = c->vx[i];
        hits->vy[k] = c->vy[i];
        hits->vz[k] = c->vz[i];
        hits->radius[k] = c->size[i];
    }
    return count;
}

static bool age_rows(jsl_real *restrict age, const jsl_real *restrict life, int n, jsl_real dt) {
    jsl_lane_int died = 0;
    for (int i = 0; i < n; i++) {
        jsl_real a = age[i] + dt;
        age[i] = a;
        died |= a >= life[i] ? 1 : 0;
    }
    return died != 0;
}

static bool any_outside(const chunk *c, jsl_aabb b) {
    const jsl_real *restrict px = c->px, *restrict py = c->py, *restrict pz = c->pz;
    jsl_lane_int out = 0;
    for (int i = 0; i < c->n; i++) {
        jsl_lane_int x = (px[i] < b.lo.x) | (px[i] > b.hi.x);
        jsl_lane_int y = (py[i] < b.lo.y) | (py[i] > b.hi.y);
        jsl_lane_int z = (pz[i] < b.lo.z) | (pz[i] > b.hi.z);
        out |= x | y | z;
    }
    return out != 0;
}

static bool find_hits(const jsl_particle_tile *t, const chunk *c, jsl_real begin,
                      jsl_lane_int *restrict flag) {
    const jsl_particle_rules *rules = t->rules;
    bool any = false;
    for (int i = 0; i < c->n; i++) flag[i] = 0;
    for (int p = 0; p < t->planes; p++) {
        const jsl_particle_plane *plane = &t->plane[p];
        jsl_real offset = plane->offset + plane->rate * (begin + t->h);
        any |= flag_plane(c, &rules->map, plane, offset, rules->contact_size, flag);
    }
    if (t->grid) any |= flag_solids(c, &rules->map, t->grid, rules->contact_size, flag);
    return any;
}

uint32_t JSL_KERNEL(jsl_particle_move)(const jsl_particle_tile *t) {
    const jsl_particle_rules *rules = t->rules;
    bool solid = t->planes > 0 || t->grid;
    uint32_t result = 0;
    jsl_lane_int flag[PARTICLE_CHUNK];
    jsl_particle_hits hits;
    for (int64_t b = 0; b < t->count; b += PARTICLE_CHUNK) {
        int64_t left = t->count - b;
        chunk c = {left < PARTICLE_CHUNK ? (int)left : PARTICLE_CHUNK,
                   t->px + b,
                   t->py + b,
                   t->pz + b,
                   t->vx + b,
                   t->vy + b,
                   t->vz + b,
                   t->size + b};
        for (int s = 0; s < t->substeps; s++) {
            jsl_real begin = (jsl_real)s * t->h;
            int count = solid && find_hits(t, &c, begin, flag) ? put_aside(&c, flag, &hits) : 0;
            if (move_rows(&c, &rules->map)) result |= PARTICLE_BAD;
            if (count) result |= jsl_particle_redo(t, b, &hits, count, begin);
        }
        if (t->mortal && age_rows(t->age + b, t->life + b, c.n, t->dt)) result |= PARTICLE_DIED;
        if (rules->bounded && any_outside(&c, rules->bounds)) result |= PARTICLE_OUTSIDE;
    }
    return result;
}
