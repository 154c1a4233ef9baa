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

/* One sub-step, x += run v + dx; v = keep v + dv. Returns whether some row is not finite. */
ROW_LOOP bool fly_once(int n, jsl_particle_map m, jsl_real *restrict px, jsl_real *restrict py,
                       jsl_real *restrict pz, jsl_real *restrict vx, jsl_real *restrict vy,
                       jsl_real *restrict vz) {
    jsl_lane_int bad = 0;
    for (int i = 0; i < n; i++) {
        jsl_real u = vx[i], v = vy[i], w = vz[i];
        jsl_real x = (px[i] + m.run * u) + m.dx.x, y = (py[i] + m.run * v) + m.dx.y,
                 z = (pz[i] + m.run * w) + m.dx.z;
        u = m.keep * u + m.dv.x;
        v = m.keep * v + m.dv.y;
        w = m.keep * w + m.dv.z;
        px[i] = x;
        py[i] = y;
        pz[i] = z;
        vx[i] = u;
        vy[i] = v;
        vz[i] = w;
        jsl_real sum = (x + y) + (z + u) + (v + w);
        bad |= sum - sum == 0 ? 0 : 1;
    }
    return bad != 0;
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

/* A row whose n.x, less what it may move and its radius, stays above margin cannot meet the plane.
 */
typedef struct guard {
    jsl_vec3 n;
    jsl_real margin;
} guard;

#define MAX_GUARDS 8

static guard guard_of(const jsl_particle_tile *t, const jsl_particle_plane *plane, const reach *r) {
    jsl_vec3 n = plane->n, a = {jsl_abs(n.x), jsl_abs(n.y), jsl_abs(n.z)};
    jsl_real rise = jsl_max(plane->offset, plane->offset + plane->rate * t->dt * JSL_R(1.001));
    return (guard){n, rise + 64 * JSL_REAL_EPSILON * jsl_abs(rise) + jsl_dot(a, r->far)};
}

/* -- Strips
 * -------------------------------------------------------------------------------------------------
 */

typedef struct strip {
    wreal x, y, z, u, v, w;
} strip;

/* Lanes that stay above the guard of a plane whose normal is along an axis, the right way round. A
 * coordinate near the plane rounds like its offset, and one that comes from far has the slack of
 * its time. */
JSL_INLINE wmask above_axis(jsl_real margin, jsl_real time, wreal p, wreal v) {
    return wgt(p + wmin(wset(time) * v, wset(0)), wset(margin));
}

/* The same for any plane: the terms of the product round on their own. */
JSL_INLINE wmask above(const guard *g, jsl_real time, const strip *s, wreal radius) {
    const wreal nx = wset(g->n.x), ny = wset(g->n.y), nz = wset(g->n.z);
    wreal x = nx * s->x, y = ny * s->y, z = nz * s->z;
    wreal way = wset(time) * (nx * s->u + ny * s->v + nz * s->w);
    wreal rounding = wset(16 * JSL_REAL_EPSILON) * (wabs(x) + wabs(y) + wabs(z));
    return wgt(((x + y) + z) + wmin(way, wset(0)) - radius - rounding, wset(g->margin));
}

JSL_INLINE void fly_strip(strip *s, const jsl_particle_map *m) {
    const wreal run = wset(m->run), keep = wset(m->keep);
    s->x = (s->x + run * s->u) + wset(m->dx.x);
    s->u = keep * s->u + wset(m->dv.x);
    s->y = (s->y + run * s->v) + wset(m->dx.y);
    s->v = keep * s->v + wset(m->dv.y);
    s->z = (s->z + run * s->w) + wset(m->dx.z);
    s->w = keep * s->w + wset(m->dv.z);
}

enum { GUARD_NONE, GUARD_X, GUARD_Y, GUARD_Z, GUARD_ALL };

typedef struct span {
    int begin, end;
} span;

typedef struct strips_job {
    const chunk *c;
    const jsl_particle_map *map;
    int substeps;
    jsl_real time, share;
    const guard *guards;
    int guard_count;
    span *touched; /* rows left alone because they may touch something; neighbours in one span */
    int touched_count;
    bool bad;
} strips_job;

#define LINE_ROWS (64 / (int)sizeof(jsl_real))

/* Six streams read and written are more than the hardware foresees: eight lines ahead. */
JSL_INLINE void fetch_ahead(const chunk *c, int i) {
    i += 8 * LINE_ROWS;
    __builtin_prefetch(c->px + i, 1);
    __builtin_prefetch(c->py + i, 1);
    __builtin_prefetch(c->pz + i, 1);
    __builtin_prefetch(c->vx + i, 1);
    __builtin_prefetch(c->vy + i, 1);
    __builtin_prefetch(c->vz + i, 1);
}

/* Flies the whole strips of a chunk through the whole step, in registers, but for those in which
 * some row may meet a plane. Returns the first row not reached. */
JSL_INLINE int fly_strips(strips_job *job, int kind, int substeps) {
    const chunk c = *job->c;
    const jsl_particle_map m = *job->map;
    const jsl_real time = job->time, margin = job->guards[0].margin;
    const wmask all = weq(wset(0), wset(0));
    const int whole = wbits(all);
    wreal bad = wset(0); /* becomes NaN */
    int i = 0;
    for (; i + WN <= c.n; i += WN) {
        if (i % LINE_ROWS == 0) fetch_ahead(&c, i);
        strip s = {wloadu(c.px + i), wloadu(c.py + i), wloadu(c.pz + i),
                   wloadu(c.vx + i), wloadu(c.vy + i), wloadu(c.vz + i)};
        wmask clear = all;
        if (kind == GUARD_X) clear = above_axis(margin, time, s.x, s.u);
        if (kind == GUARD_Y) clear = above_axis(margin, time, s.y, s.v);
        if (kind == GUARD_Z) clear = above_axis(margin, time, s.z, s.w);
        if (kind == GUARD_ALL) {
            wreal radius = wset(0);
            if (job->share > 0) radius = wset(job->share) * wloadu(c.size + i);
            for (int p = 0; p < job->guard_count; p++)
                clear &= above(&job->guards[p], time, &s, radius);
        }
        if (kind != GUARD_NONE && wbits(clear) != whole) {
            span *last = &job->touched[job->touched_count - 1];
            if (job->touched_count > 0 && last->end == i)
                last->end = i + WN;
            else
                job->touched[job->touched_count++] = (span){i, i + WN};
            continue;
        }
        for (int k = 0; k < substeps; k++) fly_strip(&s, &m);
        wstoreu(c.px + i, s.x);
        wstoreu(c.py + i, s.y);
        wstoreu(c.pz + i, s.z);
        wstoreu(c.vx + i, s.u);
        wstoreu(c.vy + i, s.v);
        wstoreu(c.vz + i, s.w);
        /* A velocity that was not finite has made the position so, and a tame map makes none. */
        wreal sum = (s.x + s.y) + s.z;
        bad = bad + (sum - sum);
    }
    job->bad = wbits(weq(bad, wset(0))) != whole;
    return i;
}

/* One function for each kind of guard, and for the usual numbers of sub-steps. */
#define STRIPS(name, kind)                                                                         \
    static __attribute__((noinline)) int name(strips_job *job) {                                   \
        if (job->substeps == 1) return fly_strips(job, kind, 1);                                   \
        if (job->substeps == 4) return fly_strips(job, kind, 4);                                   \
        return fly_strips(job, kind, job->substeps);                                               \
    }
STRIPS(strips_free, GUARD_NONE)
STRIPS(strips_x, GUARD_X)
STRIPS(strips_y, GUARD_Y)
STRIPS(strips_z, GUARD_Z)
STRIPS(strips_all, GUARD_ALL)

static int run_strips(strips_job *job) {
    if (job->guard_count == 0) return strips_free(job);
    jsl_vec3 n = job->guards[0].n;
    if (job->guard_count > 1 || job->share > 0) return strips_all(job);
    if (n.x == 1) return strips_x(job);
    if (n.y == 1) return strips_y(job);
    if (n.z == 1) return strips_z(job);
    return strips_all(job);
}

/* -- What is around, and who touches a plane
 * ------------------------------------------------------------------ */

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

/* near = 2 for rows whose box over the whole step meets that of something finite. */
static bool find_near(const jsl_particle_tile *t, const chunk *c, int64_t first, const reach *r,
                      uint8_t *restrict near) {
    jsl_lane_int cell[PARTICLE_CHUNK];
    int32_t row[PARTICLE_CHUNK];
    find_cells(c, t->grid, r, t->rules->contact_size, cell);
    const uint8_t *restrict occupied = t->grid->near.at;
    int count = 0;
    for (int i = 0; i < c->n; i++) {
        row[count] = i;
        count += cell[i] < 0 || occupied[cell[i]];
    }
    if (count == 0) return false;
    memset(near, 0, (size_t)c->n);
    return jsl_particle_look(t, first, row, count, r->time, r->far, near);
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
        jsl_real slop =
            JSL_PARTICLE_SLOP * (jsl_abs(n.x * x.x) + jsl_abs(n.y * x.y) + jsl_abs(n.z * x.z));
        jsl_real d0 = (jsl_dot(n, x) - offset) - share * size[i];
        jsl_real vn0 = jsl_dot(v, n);
        jsl_real kick = jsl_abs((m.keep - 1) * vn0 + jsl_dot(m.dv, n));
        jsl_real sink = vn0 < 0 ? -vn0 : 0;
        jsl_lane_int rests = ((d0 <= slop) & (e * sink <= kick)) ? 1 : 0;
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
        part = ((scale1 > 0) | (part > 1)) ? 1 : part;
        jsl_vec3 way = jsl_mul_add(x, JSL_R(0.5) * h * part, jsl_add(t0, t1));
        jsl_lane_int glides = ((mu > 0) & (vn1 < 0)) ? 1 : 0;
        x1.x = glides ? way.x : x1.x;
        x1.y = glides ? way.y : x1.y;
        x1.z = glides ? way.z : x1.z;
        d1 = (jsl_dot(n, x1) - offset) - share * size[i];
        d1 = (glides | (d1 < 0)) ? d1 : 0;
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
                           jsl_real begin, bool planes, const uint8_t *near) {
    const jsl_particle_rules *rules = t->rules;
    jsl_lane_int flag[PARTICLE_CHUNK];
    jsl_particle_hits hits;
    rest_state rest;
    bool any = near != NULL;
    for (int i = 0; i < c->n; i++) flag[i] = near ? near[i] : 0;
    for (int p = 0; planes && p < rules->planes; p++) {
        const jsl_particle_plane *plane = &rules->plane[p];
        any |= flag_plane(c, &rules->map, plane->n, plane->offset + plane->rate * (begin + t->h),
                          rules->contact_size, flag);
    }
    int count = any ? put_aside(c, flag, &hits) : 0;
    uint32_t result =
        fly_once(c->n, rules->map, c->px, c->py, c->pz, c->vx, c->vy, c->vz) ? PARTICLE_BAD : 0;
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

/* All sub-steps of rows [begin, end) of a chunk, looking at every plane in each of them. */
static uint32_t touch_span(const jsl_particle_tile *t, int64_t first, int count,
                           const uint8_t *near) {
    chunk c = {count,         t->px + first, t->py + first, t->pz + first,
               t->vx + first, t->vy + first, t->vz + first, t->size + first};
    uint32_t result = 0;
    for (int s = 0; s < t->substeps; s++)
        result |= touch_rows(t, &c, first, (jsl_real)s * t->h, t->rules->planes > 0, near);
    return result;
}

/* Beyond its limit of stability an integrator keeps to no bounds, and absurd forces may overflow a
 * velocity. */
static bool is_tame(const jsl_particle_map *m) {
    const jsl_real most = JSL_R(1e30);
    return jsl_abs(m->keep) <= 1 && jsl_length_sq(m->dv) < most && jsl_length_sq(m->dx) < most;
}

uint32_t JSL_KERNEL(jsl_particle_move)(const jsl_particle_tile *t) {
    const jsl_particle_rules *rules = t->rules;
    const reach r = reach_of(t);
    guard guards[MAX_GUARDS] = {0};
    const bool wild = !is_tame(&rules->map) || rules->planes > MAX_GUARDS;
    for (int p = 0; p < rules->planes && !wild; p++) guards[p] = guard_of(t, &rules->plane[p], &r);
    uint8_t near[PARTICLE_CHUNK];
    span touched[PARTICLE_CHUNK];
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
        if (t->grid && find_near(t, &c, b, &r, near)) {
            result |= touch_span(t, b, c.n, near);
        } else if (wild) {
            result |= touch_span(t, b, c.n, NULL);
        } else {
            strips_job job = {&c,     &rules->map,   t->substeps, r.time, rules->contact_size,
                              guards, rules->planes, touched,     0,      false};
            int done = run_strips(&job);
            if (job.bad) result |= PARTICLE_BAD;
            for (int k = 0; k < job.touched_count; k++)
                result |=
                    touch_span(t, b + touched[k].begin, touched[k].end - touched[k].begin, NULL);
            if (done < c.n) result |= touch_span(t, b + done, c.n - done, NULL);
        }
        if (t->mortal && age_rows(t->age + b, t->life + b, c.n, t->dt)) result |= PARTICLE_DIED;
        if (rules->bounded && any_outside(&c, rules->bounds)) result |= PARTICLE_OUTSIDE;
    }
    return result;
}
