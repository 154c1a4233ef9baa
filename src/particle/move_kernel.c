/* SPDX-License-Identifier: MIT
 * The fused pass over the rows of one emitter: find who may touch something, move, respond, age,
 * judge. Floor 4.
 *
 * Plain loops over chunks that stay in the first-level cache, whatever the number of sub-steps; the
 * compiler vectorises them for each ISA level, and since every loop is elementwise all levels give
 * the same bits. Most chunks touch nothing and fly through the whole step at once. In the others,
 * rows that touch something are put aside before the rest is moved: those that rest on a plane go
 * through a loop of their own, the others one by one.
 */
#include "math/wide.h"
#include "particle/move.h"

/* Functions of their own: inlined, the compiler forgets that columns do not overlap. */
#define ROW_LOOP static __attribute__((noinline))

typedef struct chunk {
    int n;
    jsl_real *px, *py, *pz, *vx, *vy, *vz;
    const jsl_real *size;
} chunk;

/* -- Free flight
 * ------------------------------------------------------------------------------------------- */

#define FLY(x, v, d)                                                                               \
    x = (x + m.run * v) + m.dx.d;                                                                  \
    v = m.keep * v + m.dv.d
#define FLY_ALL                                                                                    \
    FLY(x, u, x);                                                                                  \
    FLY(y, v, y);                                                                                  \
    FLY(z, w, z)
#define FLY_LOOP(steps)                                                                            \
    for (int i = 0; i < n; i++) {                                                                  \
        jsl_real x = px[i], y = py[i], z = pz[i], u = vx[i], v = vy[i], w = vz[i];                 \
        steps;                                                                                     \
        px[i] = x;                                                                                 \
        py[i] = y;                                                                                 \
        pz[i] = z;                                                                                 \
        vx[i] = u;                                                                                 \
        vy[i] = v;                                                                                 \
        vz[i] = w;                                                                                 \
        jsl_real sum = (x + y) + (z + u) + (v + w);                                                \
        bad |= sum - sum == 0 ? 0 : 1;                                                             \
    }

/* One sub-step, x += run v + dx; v = keep v + dv. Returns whether some row is not finite. */
ROW_LOOP bool fly_once(int n, jsl_particle_map m, jsl_real *restrict px, jsl_real *restrict py,
                       jsl_real *restrict pz, jsl_real *restrict vx, jsl_real *restrict vy,
                       jsl_real *restrict vz) {
    jsl_lane_int bad = 0;
    FLY_LOOP(FLY_ALL)
    return bad != 0;
}

/* Four sub-steps in registers, the same bits as four times one. */
ROW_LOOP bool fly_four(int n, jsl_particle_map m, jsl_real *restrict px, jsl_real *restrict py,
                       jsl_real *restrict pz, jsl_real *restrict vx, jsl_real *restrict vy,
                       jsl_real *restrict vz) {
    jsl_lane_int bad = 0;
    FLY_LOOP(FLY_ALL; FLY_ALL; FLY_ALL; FLY_ALL)
    return bad != 0;
}

static bool fly(const chunk *c, const jsl_particle_map *m, int substeps) {
    bool bad = false;
    for (; substeps >= 4; substeps -= 4)
        bad |= fly_four(c->n, *m, c->px, c->py, c->pz, c->vx, c->vy, c->vz);
    for (; substeps > 0; substeps--)
        bad |= fly_once(c->n, *m, c->px, c->py, c->pz, c->vx, c->vy, c->vz);
    return bad;
}

/* -- Who may touch something
 * -------------------------------------------------------------------------------- */

/* Bounds of the motion in a whole step: no coordinate changes by more than time |v| + far. */
typedef struct reach {
    jsl_real time;
    jsl_vec3 far;
} reach;

static reach reach_of(const jsl_particle_tile *t) {
    /* All integrators move by at most |v| T + |a| T^2 while |keep| <= 1; 2 covers rounding. */
    jsl_vec3 a = t->rules->law.a;
    jsl_real far = t->dt * t->dt * JSL_R(1.001), time = t->dt * JSL_R(1.001);
    return (reach){time, {jsl_abs(a.x) * far, jsl_abs(a.y) * far, jsl_abs(a.z) * far}};
}

/* Whether some row's coordinate sign * p along a plane's normal may come below margin. */
ROW_LOOP bool near_axis(int n, const jsl_real *restrict p, const jsl_real *restrict v,
                        jsl_real sign, jsl_real time, jsl_real margin) {
    const jsl_real signed_time = sign * time;
    jsl_lane_int any = 0;
    for (int i = 0; i < n; i++) {
        jsl_real way = signed_time * v[i];
        any |= sign * p[i] + (way < 0 ? way : 0) > margin ? 0 : 1;
    }
    return any != 0;
}

/* The same for any plane, and for particles that have a radius. */
ROW_LOOP bool near_plane(const chunk *c, jsl_real share, jsl_vec3 normal, jsl_real time,
                         jsl_real margin) {
    const jsl_real *restrict px = c->px, *restrict py = c->py, *restrict pz = c->pz;
    const jsl_real *restrict vx = c->vx, *restrict vy = c->vy, *restrict vz = c->vz;
    const jsl_real *restrict size = c->size;
    const jsl_real rounding = 16 * JSL_REAL_EPSILON;
    const int n = c->n;
    jsl_lane_int any = 0;
    for (int i = 0; i < n; i++) {
        jsl_real x = normal.x * px[i], y = normal.y * py[i], z = normal.z * pz[i];
        jsl_real w = normal.x * vx[i] + normal.y * vy[i] + normal.z * vz[i];
        w = w < 0 ? w : 0;
        jsl_real sum = (x < 0 ? -x : x) + (y < 0 ? -y : y) + (z < 0 ? -z : z);
        jsl_real low = ((x + y + z) + time * w) - share * size[i];
        any |= low - rounding * sum > margin ? 0 : 1;
    }
    return any != 0;
}

/* Whether some row may meet the plane in this step. Never wrong when it says no. */
static bool may_touch(const jsl_particle_tile *t, const chunk *c, const jsl_particle_plane *plane,
                      const reach *r) {
    jsl_vec3 n = plane->n, a = {jsl_abs(n.x), jsl_abs(n.y), jsl_abs(n.z)};
    jsl_real share = t->rules->contact_size;
    jsl_real rise = jsl_max(plane->offset, plane->offset + plane->rate * t->dt * JSL_R(1.001));
    /* A coordinate near the plane rounds like the offset; one that comes from far has the slack of
     * its time. */
    jsl_real margin = rise + 64 * JSL_REAL_EPSILON * jsl_abs(rise) + jsl_dot(a, r->far);
    if (share == 0 && n.x == 0 && n.y == 0)
        return near_axis(c->n, c->pz, c->vz, n.z, r->time, margin);
    if (share == 0 && n.y == 0 && n.z == 0)
        return near_axis(c->n, c->px, c->vx, n.x, r->time, margin);
    if (share == 0 && n.z == 0 && n.x == 0)
        return near_axis(c->n, c->py, c->vy, n.y, r->time, margin);
    return near_plane(c, share, n, r->time, margin);
}

/* The grid cell of each row, or -1 for one that may fly farther than the neighbouring cells. */
ROW_LOOP void find_cells(const chunk *c, const jsl_particle_grid *g, const reach *motion,
                         jsl_real share, jsl_lane_int *restrict cell) {
    const jsl_real *restrict px = c->px, *restrict py = c->py, *restrict pz = c->pz;
    const jsl_real *restrict vx = c->vx, *restrict vy = c->vy, *restrict vz = c->vz;
    const jsl_real *restrict size = c->size;
    const jsl_real ox = g->origin.x, oy = g->origin.y, oz = g->origin.z, inv = g->inv_cell;
    const jsl_real ex = (jsl_real)(g->n[0] - 1), ey = (jsl_real)(g->n[1] - 1),
                   ez = (jsl_real)(g->n[2] - 1);
    const jsl_lane_int nx = g->n[0], nxy = nx * g->n[1];
    const jsl_real time = motion->time;
    const jsl_vec3 far = motion->far;
    const int n = c->n;
    /* A little less than a cell, for the rounding of the cell index. */
    const jsl_real limit = JSL_R(0.99) * g->cell;
    for (int i = 0; i < n; i++) {
        jsl_real fx = (px[i] - ox) * inv, fy = (py[i] - oy) * inv, fz = (pz[i] - oz) * inv;
        fx = fx > 0 ? fx : 0;
        fy = fy > 0 ? fy : 0;
        fz = fz > 0 ? fz : 0;
        fx = fx < ex ? fx : ex;
        fy = fy < ey ? fy : ey;
        fz = fz < ez ? fz : ez;
        jsl_lane_int index = (jsl_lane_int)fz * nxy + (jsl_lane_int)fy * nx + (jsl_lane_int)fx;
        jsl_real sx = vx[i] < 0 ? -vx[i] : vx[i], sy = vy[i] < 0 ? -vy[i] : vy[i],
                 sz = vz[i] < 0 ? -vz[i] : vz[i];
        sx = time * sx + far.x;
        sy = time * sy + far.y;
        sz = time * sz + far.z;
        sx = sx > sy ? sx : sy;
        sx = sx > sz ? sx : sz;
        jsl_lane_int stays = sx + share * size[i] < limit ? -1 : 0;
        cell[i] = (index & stays) | ~stays;
    }
}

/* flag = 2 for rows that may meet something finite in this step. */
static bool flag_solids(const chunk *c, const jsl_particle_grid *g, const reach *motion,
                        jsl_real share, jsl_lane_int *restrict flag) {
    jsl_lane_int cell[PARTICLE_CHUNK];
    find_cells(c, g, motion, share, cell);
    const uint8_t *restrict near = g->near.at;
    jsl_lane_int any = 0;
    for (int i = 0; i < c->n; i++) {
        jsl_lane_int hit = cell[i] < 0 ? 2 : (jsl_lane_int)(near[cell[i]] * 2);
        flag[i] = hit;
        any |= hit;
    }
    return any != 0;
}

/* flag |= 1 for rows that end this sub-step behind the plane n.x = offset. */
ROW_LOOP bool flag_plane(const chunk *c, const jsl_particle_map *m, jsl_vec3 normal,
                         jsl_real offset, jsl_real share, jsl_lane_int *restrict flag) {
    const jsl_real *restrict px = c->px, *restrict py = c->py, *restrict pz = c->pz;
    const jsl_real *restrict vx = c->vx, *restrict vy = c->vy, *restrict vz = c->vz;
    const jsl_real *restrict size = c->size;
    const jsl_real run = m->run;
    const jsl_vec3 dx = m->dx;
    const int n = c->n;
    jsl_lane_int any = 0;
    for (int i = 0; i < n; i++) {
        jsl_real x = (px[i] + run * vx[i]) + dx.x, y = (py[i] + run * vy[i]) + dx.y,
                 z = (pz[i] + run * vz[i]) + dx.z;
        jsl_real d = (normal.x * x + normal.y * y + normal.z * z - offset) - share * size[i];
        jsl_lane_int hit = d < 0 ? 1 : 0;
        flag[i] |= hit;
        any |= hit;
    }
    return any != 0;
}

/* -- Rows that touch something
 * --------------------------------------------------------------------------------- */

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
        hits->size[k] = c->size[i];
    }
    return count;
}

typedef struct rest_state {
    jsl_real px[PARTICLE_CHUNK], py[PARTICLE_CHUNK], pz[PARTICLE_CHUNK];
    jsl_real vx[PARTICLE_CHUNK], vy[PARTICLE_CHUNK], vz[PARTICLE_CHUNK];
    jsl_lane_int done[PARTICLE_CHUNK];
} rest_state;

/* What jsl_particle_bounce does to a particle that rests on a plane which is still: it takes the
 * normal velocity away, brakes, and moves by the mean of the velocities. done = 0 for rows of which
 * this is not the case. */
ROW_LOOP void rest_rows(const jsl_particle_hits *hits, int count, const jsl_particle_rules *rules,
                        jsl_real h, rest_state *out) {
    const jsl_real *restrict px = hits->px, *restrict py = hits->py, *restrict pz = hits->pz;
    const jsl_real *restrict vx = hits->vx, *restrict vy = hits->vy, *restrict vz = hits->vz;
    const jsl_real *restrict size = hits->size;
    jsl_real *restrict ox = out->px, *restrict oy = out->py, *restrict oz = out->pz;
    jsl_real *restrict ovx = out->vx, *restrict ovy = out->vy, *restrict ovz = out->vz;
    jsl_lane_int *restrict done = out->done;
    const jsl_particle_map m = rules->map;
    const jsl_vec3 n = rules->plane->n;
    const jsl_real offset = rules->plane->offset, share = rules->contact_size;
    const jsl_real e = rules->restitution, mu = rules->friction;
    for (int i = 0; i < count; i++) {
        jsl_vec3 x = {px[i], py[i], pz[i]}, v = {vx[i], vy[i], vz[i]};
        jsl_real slop = JSL_PARTICLE_SLOP * (jsl_abs(x.x) + jsl_abs(x.y) + jsl_abs(x.z));
        jsl_real d0 = (jsl_dot(n, x) - offset) - share * size[i];
        jsl_real vn0 = jsl_dot(v, n);
        jsl_real kick = jsl_abs((m.keep - 1) * vn0 + jsl_dot(m.dv, n));
        jsl_real sink = vn0 < 0 ? -vn0 : 0;
        jsl_lane_int rests = (d0 <= slop) & (e * sink <= kick) ? 1 : 0;
        /* At the contact: on the plane, not into it, braked. */
        x = jsl_mul_add(x, -d0, n);
        jsl_vec3 t0 = jsl_mul_add(v, -vn0, n);
        jsl_real speed0 = jsl_sqrt(jsl_length_sq(t0));
        jsl_real scale0 = 1 - mu * sink / (speed0 > 0 ? speed0 : 1);
        t0 = jsl_scale(t0, scale0 > 0 ? scale0 : 0);
        v = jsl_mul_add(t0, vn0 > 0 ? vn0 : 0, n);
        /* At the end of the sub-step. */
        jsl_vec3 x1 = x;
        jsl_particle_apply(&m, &x1, &v);
        jsl_real d1 = (jsl_dot(n, x1) - offset) - share * size[i], vn1 = jsl_dot(v, n);
        jsl_real push = vn1 < 0 ? -vn1 : 0;
        jsl_vec3 t1 = jsl_mul_add(v, -vn1, n);
        jsl_real speed1 = jsl_sqrt(jsl_length_sq(t1));
        jsl_real scale1 = 1 - mu * push / (speed1 > 0 ? speed1 : 1);
        t1 = jsl_scale(t1, scale1 > 0 ? scale1 : 0);
        v = jsl_mul_add(t1, vn1 > 0 ? vn1 : 0, n);
        /* The way, and back onto the plane. */
        jsl_real brake = mu * push, stop = speed0 * (scale0 > 0 ? scale0 : 0);
        jsl_real part = stop / (brake > 0 ? brake : 1);
        part = (scale1 > 0) | (part > 1) ? 1 : part;
        jsl_vec3 way = jsl_mul_add(x, JSL_R(0.5) * h * part, jsl_add(t0, t1));
        jsl_lane_int glides = (mu > 0) & (vn1 < 0) ? 1 : 0;
        x1.x = glides ? way.x : x1.x;
        x1.y = glides ? way.y : x1.y;
        x1.z = glides ? way.z : x1.z;
        d1 = (jsl_dot(n, x1) - offset) - share * size[i];
        d1 = glides | (d1 < 0) ? d1 : 0;
        x1 = jsl_mul_add(x1, -d1, n);
        ox[i] = x1.x;
        oy[i] = x1.y;
        oz[i] = x1.z;
        ovx[i] = v.x;
        ovy[i] = v.y;
        ovz[i] = v.z;
        done[i] = rests;
    }
}

static bool can_rest(const jsl_particle_rules *rules) {
    const jsl_particle_plane *p = rules->plane;
    return rules->planes == 1 && rules->law.integrator == JSL_PARTICLE_EXPONENTIAL &&
           jsl_length_sq(p->velocity) == 0 && jsl_length_sq(p->spin) == 0;
}

/* Handles the rows that rest, of those which touch the plane alone; leaves the others in hits and
 * returns their number. */
static int settle_rows(const jsl_particle_tile *t, const chunk *c, const jsl_lane_int *flag,
                       jsl_particle_hits *hits, int count, rest_state *rest) {
    rest_rows(hits, count, t->rules, t->h, rest);
    int left = 0;
    for (int k = 0; k < count; k++) {
        int i = hits->row[k];
        if (rest->done[k] && flag[i] == 1) {
            c->px[i] = rest->px[k];
            c->py[i] = rest->py[k];
            c->pz[i] = rest->pz[k];
            c->vx[i] = rest->vx[k];
            c->vy[i] = rest->vy[k];
            c->vz[i] = rest->vz[k];
            continue;
        }
        hits->row[left] = i;
        hits->px[left] = hits->px[k];
        hits->py[left] = hits->py[k];
        hits->pz[left] = hits->pz[k];
        hits->vx[left] = hits->vx[k];
        hits->vy[left] = hits->vy[k];
        hits->vz[left] = hits->vz[k];
        hits->size[left++] = hits->size[k];
    }
    return left;
}

/* One sub-step of a chunk of which some rows may touch a plane, and those with near[] = 2 something
 * else. */
static uint32_t touch_rows(const jsl_particle_tile *t, const chunk *c, int64_t first,
                           jsl_real begin, bool planes, const jsl_lane_int *near) {
    const jsl_particle_rules *rules = t->rules;
    jsl_lane_int flag[PARTICLE_CHUNK];
    jsl_particle_hits hits;
    rest_state rest;
    bool any = near != NULL;
    if (near)
        memcpy(flag, near, (size_t)c->n * sizeof *flag);
    else
        memset(flag, 0, (size_t)c->n * sizeof *flag);
    for (int p = 0; planes && p < rules->planes; p++) {
        const jsl_particle_plane *plane = &rules->plane[p];
        any |= flag_plane(c, &rules->map, plane->n, plane->offset + plane->rate * (begin + t->h),
                          rules->contact_size, flag);
    }
    int count = any ? put_aside(c, flag, &hits) : 0;
    uint32_t result = fly(c, &rules->map, 1) ? PARTICLE_BAD : 0;
    if (count && planes && can_rest(rules)) count = settle_rows(t, c, flag, &hits, count, &rest);
    if (count) result |= jsl_particle_redo(t, first, &hits, count, begin);
    return result;
}

/* -- Age and bounds
 * ------------------------------------------------------------------------------------------- */

ROW_LOOP bool age_rows(jsl_real *restrict age, const jsl_real *restrict life, int n, jsl_real dt) {
    jsl_lane_int died = 0;
    for (int i = 0; i < n; i++) {
        jsl_real a = age[i] + dt;
        age[i] = a;
        died |= a >= life[i] ? 1 : 0;
    }
    return died != 0;
}

ROW_LOOP bool any_outside(const chunk *c, jsl_aabb b) {
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

/* -- All of it
 * --------------------------------------------------------------------------------------------------
 */

uint32_t JSL_KERNEL(jsl_particle_move)(const jsl_particle_tile *t) {
    const jsl_particle_rules *rules = t->rules;
    const reach r = reach_of(t);
    /* An integrator beyond its limit of stability keeps to no bounds: look at every sub-step. */
    const bool wild = !(jsl_abs(rules->map.keep) <= 1);
    jsl_lane_int near[PARTICLE_CHUNK];
    uint32_t result = 0;
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
        bool planes = wild && rules->planes > 0;
        for (int p = 0; p < rules->planes && !planes; p++)
            planes = may_touch(t, &c, &rules->plane[p], &r);
        bool solids = t->grid && flag_solids(&c, t->grid, &r, rules->contact_size, near);
        if (!planes && !solids) {
            if (fly(&c, &rules->map, t->substeps)) result |= PARTICLE_BAD;
        } else {
            for (int s = 0; s < t->substeps; s++)
                result |= touch_rows(t, &c, b, (jsl_real)s * t->h, planes, solids ? near : NULL);
        }
        if (t->mortal && age_rows(t->age + b, t->life + b, c.n, t->dt)) result |= PARTICLE_DIED;
        if (rules->bounded && any_outside(&c, rules->bounds)) result |= PARTICLE_OUTSIDE;
    }
    return result;
}
