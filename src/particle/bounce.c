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

/* What is touched: an item of the set, or ~i for plane i of the rules. */
#define NOTHING INT32_MAX

typedef struct flight {
    const jsl_particle_solids *solids;
    const jsl_particle_rules *rules;
    jsl_particle_law law; /* of the pieces between events */
    jsl_real radius, begin, h;
    jsl_vec3 kick; /* change of velocity by the forces in h */
    bool glides;   /* between events the velocity changes steadily, not in kicks */
    int32_t rest[MAX_RESTS];
    int rests;
    jsl_real
        rest_time; /* when it came to rest on the last of rest[], where, and with which velocity */
    jsl_vec3 rest_place, rest_velocity;
} flight;

typedef struct contact {
    int32_t target;
    jsl_real fraction; /* of the rest of the sub-step */
} contact;

static const jsl_pose own_frame = {{0, 0, 0}, {0, 0, 0, 1}};

/* Distances along n below this are rounding of the coordinates of x. */
static jsl_real slop(jsl_vec3 n, jsl_vec3 x) {
    return JSL_PARTICLE_SLOP * (jsl_abs(n.x * x.x) + jsl_abs(n.y * x.y) + jsl_abs(n.z * x.z));
}

/* -- Surfaces
 * ------------------------------------------------------------------------------------------------
 */

static jsl_pose pose_at(const jsl_collider_item *item, jsl_real t) {
    jsl_pose p = item->pose;
    p.position = jsl_mul_add(p.position, t, item->velocity);
    if (item->spin.x != 0 || item->spin.y != 0 || item->spin.z != 0)
        p.orientation = jsl_quat_normalize(
            jsl_quat_mul(jsl_quat_from_rotation_vector(jsl_scale(item->spin, t)), p.orientation));
    return p;
}

/* From the particle's skin at time t of the sub-step to the surface, and the outward normal there.
 */
static jsl_real gap_at(const flight *f, int32_t target, jsl_real t, jsl_vec3 x, jsl_vec3 *normal) {
    if (target < 0) {
        const jsl_particle_plane *p = &f->rules->plane[~target];
        *normal = p->n;
        return (jsl_dot(p->n, x) - (p->offset + p->rate * (f->begin + t))) - f->radius;
    }
    const jsl_collider_item *item = &f->solids->set->item.at[target];
    return jsl_shape_point_distance(&item->shape, pose_at(item, f->begin + t), x, normal) -
           f->radius;
}

static jsl_vec3 surface_velocity(const flight *f, int32_t target, jsl_real t, jsl_vec3 x) {
    const jsl_particle_plane *p = target < 0 ? &f->rules->plane[~target] : NULL;
    const jsl_collider_item *item = p ? NULL : &f->solids->set->item.at[target];
    jsl_vec3 velocity = p ? p->velocity : item->velocity, spin = p ? p->spin : item->spin;
    jsl_vec3 centre = jsl_mul_add(p ? p->centre : item->pose.position, f->begin + t, velocity);
    return jsl_add(velocity, jsl_cross(spin, jsl_sub(x, centre)));
}

/* -- When
 * ----------------------------------------------------------------------------------------------------
 */

/* First root in [0, 1] of d0 + b s + (d1 - d0 - b) s^2, given d0 > 0 > d1. */
static jsl_real parabola_root(jsl_real d0, jsl_real b, jsl_real d1) {
    jsl_real a = d1 - d0 - b;
    jsl_real root = jsl_sqrt(jsl_max(b * b - 4 * a * d0, 0));
    jsl_real s = b < 0 ? 2 * d0 / (root - b) : -(b + root) / (2 * a);
    return jsl_clamp(s, 0, 1);
}

static jsl_real meet_plane(const flight *f, int32_t target, jsl_real t, jsl_vec3 x, jsl_vec3 v,
                           jsl_vec3 x1) {
    jsl_vec3 n;
    jsl_real d1 = gap_at(f, target, f->h, x1, &n);
    if (!(d1 < 0)) return 2;
    jsl_real d0 = gap_at(f, target, t, x, &n);
    if (d0 <= slop(n, x)) return 0;
    jsl_real vn = jsl_dot(v, n) - f->rules->plane[~target].rate;
    return parabola_root(d0, vn * (f->h - t), d1);
}

/* A box grown by a radius has round edges, its ray test has not: from the hit on the sharp one,
 * advance by the true distance until it is touched, or passed. */
static jsl_real meet_round(const jsl_shape_desc *box, jsl_real radius, jsl_vec3 from, jsl_vec3 to,
                           jsl_real s) {
    jsl_vec3 path = jsl_sub(to, from), n;
    jsl_real length = jsl_length(path);
    for (int i = 0; i < 32; i++) {
        jsl_vec3 at = jsl_mul_add(from, s, path);
        jsl_real d = jsl_shape_point_distance(box, own_frame, at, &n) - radius;
        if (d <= JSL_R(0.001) * radius) return s;
        s += d / length;
        if (!(s <= 1)) return 2;
    }
    return 2;
}

/* Half sides of the shape's box in its own frame. */
static jsl_vec3 half_sides(const jsl_shape_desc *s) {
    if (s->kind == JSL_SHAPE_BOX) return s->half;
    jsl_real z = s->kind == JSL_SHAPE_CAPSULE ? s->half.z : 0;
    return jsl_v3(s->radius, s->radius, z + s->radius);
}

static bool passes_by(jsl_vec3 h, jsl_vec3 a, jsl_vec3 b) {
    return (a.x > h.x && b.x > h.x) || (a.x < -h.x && b.x < -h.x) || (a.y > h.y && b.y > h.y) ||
           (a.y < -h.y && b.y < -h.y) || (a.z > h.z && b.z > h.z) || (a.z < -h.z && b.z < -h.z);
}

/* In the frame of the item, which takes its motion and turning away, along the straight way from x
 * to x1. */
static jsl_real meet_item(const flight *f, const jsl_collider_item *item, jsl_real t, jsl_vec3 x,
                          jsl_vec3 x1) {
    jsl_pose p0 = pose_at(item, f->begin + t), p1 = pose_at(item, f->begin + f->h);
    jsl_vec3 from = jsl_pose_point_inv(p0, x), to = jsl_pose_point_inv(p1, x1), n;
    jsl_real r = f->radius, near = slop(jsl_v3(1, 1, 1), x);
    jsl_shape_desc grown = item->shape;
    if (grown.kind == JSL_SHAPE_BOX)
        grown.half = jsl_add(grown.half, jsl_v3(r, r, r));
    else
        grown.radius += r;
    if (passes_by(jsl_add(half_sides(&grown), jsl_v3(near, near, near)), from, to)) return 2;
    jsl_real d0 = jsl_shape_point_distance(&item->shape, own_frame, from, &n) - r;
    if (d0 <= slop(jsl_rotate(p0.orientation, n), x)) {
        /* Starts on or in it: it may leave by itself. */
        return jsl_shape_point_distance(&item->shape, own_frame, to, &n) < r ? 0 : 2;
    }
    jsl_ray_hit hit;
    if (!jsl_shape_ray(&grown, own_frame, from, to, &hit)) return 2;
    if (grown.kind == JSL_SHAPE_BOX && r > 0)
        return meet_round(&item->shape, r, from, to, hit.fraction);
    return hit.fraction;
}

static bool is_resting(const flight *f, int32_t target) {
    for (int i = 0; i < f->rests; i++)
        if (f->rest[i] == target) return true;
    return false;
}

/* Equal times: the lower target, whatever the order of looking. */
static void keep_first(contact *best, int32_t target, jsl_real s) {
    if (s < best->fraction || (s == best->fraction && s <= 1 && target < best->target))
        *best = (contact){target, s};
}

static jsl_aabb swept(jsl_vec3 a, jsl_vec3 b, jsl_real r) {
    return (jsl_aabb){{jsl_min(a.x, b.x) - r, jsl_min(a.y, b.y) - r, jsl_min(a.z, b.z) - r},
                      {jsl_max(a.x, b.x) + r, jsl_max(a.y, b.y) + r, jsl_max(a.z, b.z) + r}};
}

typedef struct outlook {
    const flight *f;
    jsl_real t;
    jsl_vec3 x, x1;
    jsl_aabb path;
    contact *best;
} outlook;

static void look_at(const outlook *o, int32_t j) {
    const jsl_collider_set *set = o->f->solids->set;
    int32_t target = set->finite.at[j];
    const jsl_collider_item *item = &set->item.at[target];
    if (jsl_particle_meets(o->f->rules, item) && !is_resting(o->f, target))
        keep_first(o->best, target, meet_item(o->f, item, o->t, o->x, o->x1));
}

/* Everything that the grid has around the way, once each: what spans several cells is looked at in
 * the first cell that both cover. */
static void look_around(const outlook *o) {
    const jsl_particle_grid *g = o->f->solids->grid;
    const jsl_aabb *box = o->f->solids->set->finite_box.at;
    jsl_cells c = jsl_particle_grid_cells(g, o->path);
    bool several = c.lo[0] < c.hi[0] || c.lo[1] < c.hi[1] || c.lo[2] < c.hi[2];
    if (several && jsl_particle_cells_count(&c) > 4 * g->box.count) {
        for (int32_t j = 0; j < (int32_t)g->box.count; j++)
            if (jsl_aabb_meet(o->path, box[j])) look_at(o, j);
        return;
    }
    for (int32_t z = c.lo[2]; z <= c.hi[2]; z++)
        for (int32_t y = c.lo[1]; y <= c.hi[1]; y++)
            for (int32_t x = c.lo[0]; x <= c.hi[0]; x++) {
                int64_t cell = ((int64_t)z * g->n[1] + y) * g->n[0] + x;
                for (int32_t k = g->start.at[cell]; k < g->start.at[cell + 1]; k++) {
                    int32_t j = g->item.at[k];
                    if (!jsl_aabb_meet(o->path, box[j])) continue;
                    const int32_t *lo = g->first.at[j].lo;
                    if (several && (x != (lo[0] > c.lo[0] ? lo[0] : c.lo[0]) ||
                                    y != (lo[1] > c.lo[1] ? lo[1] : c.lo[1]) ||
                                    z != (lo[2] > c.lo[2] ? lo[2] : c.lo[2])))
                        continue;
                    look_at(o, j);
                }
            }
}

static contact first_contact(const flight *f, jsl_real t, jsl_vec3 x, jsl_vec3 v, jsl_vec3 x1) {
    contact best = {NOTHING, 2};
    for (int32_t i = 0; i < f->rules->planes; i++)
        if (!is_resting(f, ~i)) keep_first(&best, ~i, meet_plane(f, ~i, t, x, v, x1));
    if (f->solids->set && f->solids->grid->n[0]) {
        outlook o = {f, t, x, x1, swept(x, x1, f->radius), &best};
        look_around(&o);
    }
    return best;
}

/* -- What then
 * -------------------------------------------------------------------------------------------------
 */

/* Relative velocity after a contact that changes its normal component by (1+e) |vn|, friction
 * included. */
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

/* Friction acts all along the way, so the way is that of the mean of the velocities at its ends,
 * not that of the flight without friction: a particle held by friction stays where it is, and one
 * that stops does so within the step. */
static void glide(const flight *f, int32_t target, jsl_vec3 n, jsl_real vn, jsl_vec3 after,
                  jsl_vec3 *x) {
    jsl_real left = f->h - f->rest_time;
    jsl_vec3 u = surface_velocity(f, target, f->rest_time, f->rest_place);
    jsl_vec3 v0 = jsl_sub(f->rest_velocity, u);
    v0 = jsl_mul_add(v0, -jsl_dot(v0, n), n);
    jsl_vec3 v1 = jsl_mul_add(after, -jsl_dot(after, n), n);
    jsl_real time = left, brake = f->rules->friction * -vn;
    if (jsl_length_sq(v1) == 0) time = jsl_min(time, left * jsl_length(v0) / brake);
    *x = jsl_mul_add(jsl_mul_add(f->rest_place, left, u), JSL_R(0.5) * time, jsl_add(v0, v1));
    jsl_vec3 normal;
    jsl_real d = gap_at(f, target, f->h, *x, &normal);
    *x = jsl_mul_add(*x, -d, normal);
}

/* Puts the particle on the surface of everything it rests on, and takes its motion into it away. */
static void settle(const flight *f, jsl_vec3 *x, jsl_vec3 *v) {
    for (int pass = 0; pass < (f->rests > 1 ? 2 : 1); pass++)
        for (int i = 0; i < f->rests; i++) {
            int32_t target = f->rest[i];
            jsl_vec3 n;
            jsl_real d = gap_at(f, target, f->h, *x, &n);
            if (d < 0)
                *x = jsl_mul_add(*x, -d, n);
            else if (d > slop(n, *x))
                continue; /* it has left */
            jsl_vec3 u = surface_velocity(f, target, f->h, *x);
            jsl_vec3 rel = jsl_sub(*v, u);
            jsl_real vn = jsl_dot(rel, n);
            if (!(vn < 0)) continue;
            rel = respond(rel, n, vn, 0, f->rules->friction);
            *v = jsl_add(u, rel);
            if (f->glides && f->rests == 1 && f->rules->friction > 0)
                glide(f, target, n, vn, rel, x);
        }
}

/* Flies to the contact, and answers it. Returns the new time. */
static jsl_real touch(flight *f, contact c, jsl_real t, jsl_vec3 *x, jsl_vec3 *v) {
    jsl_real s = c.fraction * (f->h - t), d = 0;
    jsl_vec3 n, y, w;
    /* The way was taken as straight or as a parabola; Newton on the true one closes what is left.
     */
    for (int i = 0;; i++) {
        y = *x;
        w = *v;
        if (s > 0) {
            jsl_particle_map m = jsl_particle_map_of(&f->law, (double)s);
            jsl_particle_apply(&m, &y, &w);
        }
        d = gap_at(f, c.target, t + s, y, &n);
        if (i == 2 || s == 0 || jsl_abs(d) <= slop(n, y)) break;
        jsl_real rate = jsl_dot(jsl_sub(w, surface_velocity(f, c.target, t + s, y)), n);
        if (!(rate < 0)) break;
        s = jsl_clamp(s - d / rate, 0, f->h - t);
    }
    *x = jsl_mul_add(y, -d, n);
    jsl_vec3 u = surface_velocity(f, c.target, t + s, *x);
    jsl_vec3 rel = jsl_sub(w, u);
    jsl_real vn = jsl_dot(rel, n), e = f->rules->restitution;
    bool rests = vn < 0 ? e * -vn <= jsl_abs(jsl_dot(n, f->kick)) : s == 0;
    if (rests) e = 0;
    *v = vn < 0 ? jsl_add(u, respond(rel, n, vn, e, f->rules->friction)) : w;
    if (rests && f->rests < MAX_RESTS) {
        f->rest[f->rests++] = c.target;
        f->rest_time = t + s;
        f->rest_place = *x;
        f->rest_velocity = *v;
    }
    return t + s;
}

void jsl_particle_bounce(const jsl_particle_solids *solids, const jsl_particle_rules *rules,
                         const jsl_particle_map *map, jsl_real radius, jsl_real begin, jsl_real h,
                         jsl_vec3 *position, jsl_vec3 *velocity) {
    jsl_vec3 x = *position, v = *velocity, x1 = x, v1 = v;
    jsl_particle_apply(map, &x1, &v1);
    flight f = {.solids = solids, .rules = rules, .radius = radius, .begin = begin, .h = h};
    contact c = first_contact(&f, 0, x, v, x1);
    if (c.target == NOTHING) {
        *position = x1;
        *velocity = v1;
        return;
    }
    f.kick = jsl_sub(v1, v);
    /* The two Euler methods kick and drift: in between the particle flies straight. */
    bool kick_first = rules->law.integrator == JSL_PARTICLE_SEMI_IMPLICIT;
    bool kick_last = rules->law.integrator == JSL_PARTICLE_EXPLICIT;
    f.glides = !kick_first && !kick_last;
    if (f.glides) f.law = rules->law;
    f.law.integrator = JSL_PARTICLE_EXPONENTIAL;
    if (kick_first) v = v1;
    jsl_real t = 0;
    for (int i = 0; i < MAX_EVENTS && c.target != NOTHING; i++) {
        t = touch(&f, c, t, &x, &v);
        bool whole = t == 0 && rules->law.integrator == JSL_PARTICLE_EXPONENTIAL;
        jsl_particle_map m = whole ? *map : jsl_particle_map_of(&f.law, (double)(h - t));
        x1 = x;
        v1 = v;
        jsl_particle_apply(&m, &x1, &v1);
        c = first_contact(&f, t, x, v, x1);
    }
    if (c.target == NOTHING) {
        x = x1;
        v = v1;
    } /* else it stays at its last contact: time is lost, nothing is entered */
    if (kick_last) v = jsl_add(jsl_scale(v, map->keep), map->dv);
    settle(&f, &x, &v);
    *position = x;
    *velocity = v;
}
