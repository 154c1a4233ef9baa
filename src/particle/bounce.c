/* SPDX-License-Identifier: MIT
 * Kinematic response of one particle to everything solid, within one sub-step. Floor 4.
 *
 * The motion without collisions is known in closed form, so a sub-step is: fly to the first
 * contact, respond v' = v - (1+e)(v.N)N relative to the surface, fly on, at most MAX_EVENTS times.
 * A particle that would leave more slowly than it falls within a sub-step rests instead: its normal
 * velocity is taken away and it is put on the surface, which is what ends the infinitely many
 * bounces of Zeno and keeps it from sinking. Friction after Coulomb: the tangential velocity
 * shrinks by mu times the change of the normal one.
 */
#include "particle/room.h"

#define MAX_EVENTS 8
#define MAX_RESTS 4

typedef struct flight {
    const jsl_particle_solids *solids;
    const jsl_particle_rules *rules;
    jsl_particle_law law; /* of the pieces between events */
    jsl_real radius, begin, h;
    jsl_real rest_kick_x, rest_kick_y, rest_kick_z; /* change of velocity by the forces in h */
    int32_t rest[MAX_RESTS];
    int rests;
} flight;

typedef struct contact {
    int32_t item; /* -1: none */
    jsl_real fraction;
} contact;

static jsl_pose pose_at(const jsl_collider_item *item, jsl_real t) {
    jsl_pose p = item->pose;
    p.position = jsl_mul_add(p.position, t, item->velocity);
    if (item->spin.x != 0 || item->spin.y != 0 || item->spin.z != 0)
        p.orientation = jsl_quat_normalize(
            jsl_quat_mul(jsl_quat_from_rotation_vector(jsl_scale(item->spin, t)), p.orientation));
    return p;
}

static jsl_shape_desc grown(const jsl_collider_item *item, jsl_real radius) {
    jsl_shape_desc s = item->shape;
    if (radius > 0) {
        if (s.kind == JSL_SHAPE_BOX)
            s.half = jsl_add(s.half, jsl_v3(radius, radius, radius));
        else if (s.kind != JSL_SHAPE_PLANE)
            s.radius += radius;
    }
    return s;
}

static jsl_real distance_at(const flight *f, const jsl_collider_item *item, jsl_real t, jsl_vec3 x,
                            jsl_vec3 *normal) {
    return jsl_shape_point_distance(&item->shape, pose_at(item, f->begin + t), x, normal) -
           f->radius;
}

static jsl_vec3 surface_velocity(const jsl_collider_item *item, jsl_real t, jsl_vec3 x) {
    jsl_vec3 centre = jsl_mul_add(item->pose.position, t, item->velocity);
    return jsl_add(item->velocity, jsl_cross(item->spin, jsl_sub(x, centre)));
}

/* Distances below this are rounding of coordinates. */
static jsl_real slop(jsl_vec3 x) {
    return 8 * JSL_REAL_EPSILON * (jsl_abs(x.x) + jsl_abs(x.y) + jsl_abs(x.z));
}

/* First root in [0, 1] of d0 + b s + (d1 - d0 - b) s^2, given d0 > 0 > d1. */
static jsl_real parabola_root(jsl_real d0, jsl_real b, jsl_real d1) {
    jsl_real a = d1 - d0 - b;
    jsl_real root = jsl_sqrt(jsl_max(b * b - 4 * a * d0, 0));
    jsl_real s = b < 0 ? 2 * d0 / (root - b) : -(b + root) / (2 * a);
    return jsl_clamp(s, 0, 1);
}

/* A box grown by a radius has round edges, its ray test has not: from the hit on the sharp one,
 * advance by the true distance until it is touched, or passed. */
static jsl_real meet_round(const jsl_shape_desc *box, jsl_real radius, jsl_vec3 from, jsl_vec3 to,
                           jsl_real s) {
    jsl_vec3 path = jsl_sub(to, from), n;
    jsl_real length = jsl_length(path);
    jsl_pose still = {{0, 0, 0}, {0, 0, 0, 1}};
    for (int i = 0; i < 32; i++) {
        jsl_vec3 at = jsl_mul_add(from, s, path);
        jsl_real d = jsl_shape_point_distance(box, still, at, &n) - radius;
        if (d <= JSL_R(0.001) * radius) return s;
        s += d / length;
        if (!(s <= 1)) return 2;
    }
    return 2;
}

/* When the particle, flying from x (velocity v, at time t) to x1 (at h), meets the item. */
static jsl_real meet(const flight *f, const jsl_collider_item *item, jsl_real t, jsl_vec3 x,
                     jsl_vec3 v, jsl_vec3 x1) {
    jsl_vec3 n, n1;
    if (item->shape.kind == JSL_SHAPE_PLANE) {
        jsl_real d1 = distance_at(f, item, f->h, x1, &n1);
        if (!(d1 < 0)) return 2;
        jsl_real d0 = distance_at(f, item, t, x, &n);
        if (d0 <= 0) return 0;
        jsl_vec3 rel = jsl_sub(v, surface_velocity(item, f->begin + t, x));
        return parabola_root(d0, jsl_dot(rel, n) * (f->h - t), d1);
    }
    jsl_pose p0 = pose_at(item, f->begin + t), p1 = pose_at(item, f->begin + f->h);
    jsl_shape_desc shape = grown(item, f->radius);
    jsl_vec3 from = jsl_pose_point_inv(p0, x), to = jsl_pose_point_inv(p1, x1);
    jsl_pose still = {{0, 0, 0}, {0, 0, 0, 1}};
    if (jsl_shape_point_distance(&item->shape, still, from, &n) - f->radius <= slop(x)) {
        /* Starts on or in it: it may leave by itself. */
        return jsl_shape_point_distance(&item->shape, still, to, &n1) < f->radius ? 0 : 2;
    }
    jsl_ray_hit hit;
    if (!jsl_shape_ray(&shape, still, from, to, &hit)) return 2;
    if (shape.kind == JSL_SHAPE_BOX && f->radius > 0)
        return meet_round(&item->shape, f->radius, from, to, hit.fraction);
    return hit.fraction;
}

static bool is_resting(const flight *f, int32_t item) {
    for (int i = 0; i < f->rests; i++)
        if (f->rest[i] == item) return true;
    return false;
}

static void consider(const flight *f, int32_t index, jsl_real t, jsl_vec3 x, jsl_vec3 v,
                     jsl_vec3 x1, contact *best) {
    const jsl_collider_item *item = &f->solids->set->item.at[index];
    if (!jsl_particle_meets(f->rules, item) || is_resting(f, index)) return;
    jsl_real s = meet(f, item, t, x, v, x1);
    /* Equal times: the lower index, whatever the order of looking. */
    if (s < best->fraction || (s == best->fraction && s <= 1 && index < best->item))
        *best = (contact){index, s};
}

static jsl_aabb swept(jsl_vec3 a, jsl_vec3 b, jsl_real r) {
    return (jsl_aabb){{jsl_min(a.x, b.x) - r, jsl_min(a.y, b.y) - r, jsl_min(a.z, b.z) - r},
                      {jsl_max(a.x, b.x) + r, jsl_max(a.y, b.y) + r, jsl_max(a.z, b.z) + r}};
}

/* Every item that the grid has around the path, once each: a pair is looked at in the first cell
 * that both cover. */
static void consider_grid(const flight *f, jsl_real t, jsl_vec3 x, jsl_vec3 v, jsl_vec3 x1,
                          contact *best) {
    const jsl_particle_grid *g = f->solids->grid;
    const jsl_collider_set *set = f->solids->set;
    jsl_aabb path = swept(x, x1, f->radius);
    int32_t lo[3], hi[3];
    const jsl_real pl[3] = {path.lo.x, path.lo.y, path.lo.z};
    const jsl_real ph[3] = {path.hi.x, path.hi.y, path.hi.z};
    const jsl_real o[3] = {g->origin.x, g->origin.y, g->origin.z};
    for (int a = 0; a < 3; a++) {
        lo[a] = jsl_particle_grid_axis(pl[a], o[a], g->inv_cell, g->n[a]);
        hi[a] = jsl_particle_grid_axis(ph[a], o[a], g->inv_cell, g->n[a]);
    }
    for (int32_t cz = lo[2]; cz <= hi[2]; cz++)
        for (int32_t cy = lo[1]; cy <= hi[1]; cy++)
            for (int32_t cx = lo[0]; cx <= hi[0]; cx++) {
                int64_t c = ((int64_t)cz * g->n[1] + cy) * g->n[0] + cx;
                for (int32_t k = g->start.at[c]; k < g->start.at[c + 1]; k++) {
                    int32_t j = g->item.at[k];
                    jsl_aabb box = set->finite_box.at[j];
                    if (!jsl_aabb_meet(path, box)) continue;
                    int32_t bx = jsl_particle_grid_axis(box.lo.x, o[0], g->inv_cell, g->n[0]);
                    int32_t by = jsl_particle_grid_axis(box.lo.y, o[1], g->inv_cell, g->n[1]);
                    int32_t bz = jsl_particle_grid_axis(box.lo.z, o[2], g->inv_cell, g->n[2]);
                    if (cx != (bx > lo[0] ? bx : lo[0]) || cy != (by > lo[1] ? by : lo[1]) ||
                        cz != (bz > lo[2] ? bz : lo[2]))
                        continue;
                    consider(f, set->finite.at[j], t, x, v, x1, best);
                }
            }
}

static contact first_contact(const flight *f, jsl_real t, jsl_vec3 x, jsl_vec3 v, jsl_vec3 x1) {
    contact best = {-1, 2};
    const jsl_collider_set *set = f->solids->set;
    for (int64_t i = 0; i < set->planes.count; i++)
        consider(f, set->planes.at[i], t, x, v, x1, &best);
    if (f->solids->grid->n[0]) consider_grid(f, t, x, v, x1, &best);
    return best;
}

/* v after a contact that changes its normal component by (1+e) |vn|, friction included. */
static jsl_vec3 respond(jsl_vec3 rel, jsl_vec3 n, jsl_real vn, jsl_real e, jsl_real mu) {
    jsl_vec3 out = jsl_mul_add(rel, -(1 + e) * vn, n);
    if (mu > 0) {
        jsl_vec3 vt = jsl_mul_add(rel, -vn, n);
        jsl_real speed = jsl_length(vt);
        if (speed > 0) {
            jsl_real scale = jsl_max(0, 1 - mu * (1 + e) * -vn / speed);
            out = jsl_mul_add(jsl_scale(n, -e * vn), scale, vt);
        }
    }
    return out;
}

/* Puts the particle on the surface of everything it rests on, and takes its motion into it away. */
static void settle(const flight *f, jsl_vec3 *x, jsl_vec3 *v) {
    for (int pass = 0; pass < (f->rests > 1 ? 2 : 1); pass++)
        for (int i = 0; i < f->rests; i++) {
            const jsl_collider_item *item = &f->solids->set->item.at[f->rest[i]];
            jsl_vec3 n;
            jsl_real d = distance_at(f, item, f->h, *x, &n);
            if (d < 0)
                *x = jsl_mul_add(*x, -d, n);
            else if (d > slop(*x))
                continue; /* it has left */
            jsl_vec3 u = surface_velocity(item, f->begin + f->h, *x);
            jsl_vec3 rel = jsl_sub(*v, u);
            jsl_real vn = jsl_dot(rel, n);
            if (vn < 0) *v = jsl_add(u, respond(rel, n, vn, 0, f->rules->friction));
        }
}

/* Flies to the contact, and answers it. Returns the new time. */
static jsl_real touch(flight *f, contact c, jsl_real t, jsl_vec3 *x, jsl_vec3 *v) {
    const jsl_collider_item *item = &f->solids->set->item.at[c.item];
    jsl_real s = c.fraction * (f->h - t);
    jsl_vec3 n, y, w;
    jsl_real d = 0;
    /* The ray is straight and the path is not: Newton on the true distance, which is convex here.
     */
    for (int i = 0;; i++) {
        jsl_particle_map m = jsl_particle_map_of(&f->law, (double)s);
        y = *x;
        w = *v;
        jsl_particle_apply(&m, &y, &w);
        d = distance_at(f, item, t + s, y, &n);
        if (i == 2 || s == 0 || jsl_abs(d) <= slop(y)) break;
        jsl_real rate = jsl_dot(jsl_sub(w, surface_velocity(item, f->begin + t + s, y)), n);
        if (!(rate < 0)) break;
        s = jsl_clamp(s - d / rate, 0, f->h - t);
    }
    *x = jsl_mul_add(y, -d, n);
    jsl_vec3 u = surface_velocity(item, f->begin + t + s, *x);
    jsl_vec3 rel = jsl_sub(w, u);
    jsl_real vn = jsl_dot(rel, n);
    jsl_real kick = n.x * f->rest_kick_x + n.y * f->rest_kick_y + n.z * f->rest_kick_z;
    jsl_real e = f->rules->restitution;
    bool rests = vn < 0 ? e * -vn <= jsl_abs(kick) : s == 0;
    if (rests) e = 0;
    *v = vn < 0 ? jsl_add(u, respond(rel, n, vn, e, f->rules->friction)) : w;
    if (rests && f->rests < MAX_RESTS) f->rest[f->rests++] = c.item;
    return t + s;
}

void jsl_particle_bounce(const jsl_particle_solids *solids, const jsl_particle_rules *rules,
                         const jsl_particle_map *map, jsl_real radius, jsl_real begin, jsl_real h,
                         jsl_vec3 *position, jsl_vec3 *velocity) {
    jsl_vec3 x = *position, v = *velocity, x1 = x, v1 = v;
    jsl_particle_apply(map, &x1, &v1);
    flight f = {.solids = solids, .rules = rules, .law = rules->law, .radius = radius};
    f.begin = begin;
    f.h = h;
    contact c = first_contact(&f, 0, x, v, x1);
    if (c.item < 0) {
        *position = x1;
        *velocity = v1;
        return;
    }
    f.rest_kick_x = v1.x - v.x;
    f.rest_kick_y = v1.y - v.y;
    f.rest_kick_z = v1.z - v.z;
    /* The two Euler methods kick and drift: in between the particle flies straight. */
    bool kick_first = rules->law.integrator == JSL_PARTICLE_SEMI_IMPLICIT;
    bool kick_last = rules->law.integrator == JSL_PARTICLE_EXPLICIT;
    if (kick_first) v = v1;
    if (kick_first || kick_last)
        f.law = (jsl_particle_law){.integrator = JSL_PARTICLE_EXPONENTIAL};
    else
        f.law.integrator = JSL_PARTICLE_EXPONENTIAL;
    jsl_real t = 0;
    for (int i = 0; i < MAX_EVENTS && c.item >= 0; i++) {
        t = touch(&f, c, t, &x, &v);
        jsl_particle_map m = jsl_particle_map_of(&f.law, (double)(h - t));
        x1 = x;
        v1 = v;
        jsl_particle_apply(&m, &x1, &v1);
        c = first_contact(&f, t, x, v, x1);
    }
    if (c.item < 0) {
        x = x1;
        v = v1;
    } /* else it stays at its last contact: time is lost, nothing is entered */
    if (kick_last) v = jsl_add(jsl_scale(v, map->keep), map->dv);
    settle(&f, &x, &v);
    *position = x;
    *velocity = v;
}
