/* SPDX-License-Identifier: MIT
 * detect.c - the narrow phase: a manifold is kept while its pair has hardly moved against itself,
 * else made anew.
 */
#include "rigid/room.h"

#define PAIR_BLOCK 128

typedef struct narrow {
    jsl_rigid_room *room;
    const jsl_step_context *context;
    jsl_real margin, keep; /* shares, see jsl_rigid_settings */
} narrow;

static jsl_pose pose_of(const jsl_rigid_room *room, int32_t i) {
    const jsl_real *p = room->pose.at + (int64_t)i * JSL_POSE;
    return (jsl_pose){jsl_v3(p[0], p[1], p[2]), {p[4], p[5], p[6], p[7]}};
}
static jsl_vec3 line3(const jsl_rigid_room *room, int32_t i, int at) {
    const jsl_real *p = room->line.at + (int64_t)i * JSL_LINE + at;
    return jsl_v3(p[0], p[1], p[2]);
}
static jsl_vec3 get3(const jsl_real *p) { return jsl_v3(p[0], p[1], p[2]); }
static void put3(jsl_real *p, jsl_vec3 v) { p[0] = v.x, p[1] = v.y, p[2] = v.z; }

static void clear(jsl_rigid_pair *p, jsl_real *geo) {
    p->count = 0;
    p->built = 0;
    memset(geo, 0, JSL_GEO * sizeof *geo);
}

/* The relative pose of B in A's frame. */
typedef struct relation {
    jsl_vec3 offset;
    jsl_quat turn;
} relation;
static relation relate(jsl_pose a, jsl_pose b) {
    return (relation){jsl_rotate_inv(a.orientation, jsl_sub(b.position, a.position)),
                      jsl_quat_mul(jsl_quat_conj(a.orientation), b.orientation)};
}

/* True when B stands to A as it did when the manifold was made, within `most` at distance `radius`
 * from B. */
static bool unmoved(const jsl_real *geo, const relation *now, jsl_real radius, jsl_real most) {
    jsl_vec3 d = jsl_sub(now->offset, get3(geo + JSL_GEO_OFFSET));
    jsl_real t[4] = {now->turn.x - geo[JSL_GEO_TURN], now->turn.y - geo[JSL_GEO_TURN + 1],
                     now->turn.z - geo[JSL_GEO_TURN + 2], now->turn.w - geo[JSL_GEO_TURN + 3]};
    jsl_real angle = 2 * jsl_sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2] + t[3] * t[3]);
    return jsl_length(d) + angle * radius <= most;
}

/* Round shapes roll: their one or two points are cheap and must follow. */
static bool may_keep(const jsl_collider_item *a, const jsl_collider_item *b) {
    bool flat_a = a->shape.kind == JSL_SHAPE_BOX || a->shape.kind == JSL_SHAPE_PLANE;
    bool flat_b = b->shape.kind == JSL_SHAPE_BOX || b->shape.kind == JSL_SHAPE_PLANE;
    return flat_a && flat_b;
}

/* Impulses of the old points go to the new ones: by feature, then by nearness. */
static void match(const jsl_real *old, const uint32_t *old_feature, int old_count, jsl_real *geo,
                  const jsl_manifold *m, jsl_real reach) {
    bool used[JSL_MAX_MANIFOLD] = {0}, done[JSL_MAX_MANIFOLD] = {0};
    for (int j = 0; j < m->count; j++)
        for (int k = 0; k < old_count && !done[j]; k++)
            if (!used[k] && old_feature[k] == m->feature[j]) {
                geo[JSL_GEO_IMPULSE + j] = old[JSL_GEO_IMPULSE + k];
                used[k] = done[j] = true;
            }
    for (int j = 0; j < m->count; j++) {
        if (done[j]) continue;
        int best = -1;
        jsl_real nearest = reach * reach;
        for (int k = 0; k < old_count; k++) {
            jsl_real d = jsl_length_sq(
                jsl_sub(get3(geo + JSL_GEO_B + 4 * j), get3(old + JSL_GEO_B + 4 * k)));
            if (!used[k] && d < nearest) nearest = d, best = k;
        }
        if (best < 0) continue;
        geo[JSL_GEO_IMPULSE + j] = old[JSL_GEO_IMPULSE + best];
        used[best] = true;
    }
}

static bool sound(const jsl_manifold *m) {
    jsl_real sum = m->normal.x + m->normal.y + m->normal.z;
    for (int j = 0; j < m->count; j++)
        sum += m->point[j].x + m->point[j].y + m->point[j].z + m->separation[j];
    return jsl_is_finite(sum);
}

/* Round shapes are a point or a segment grown by this. */
static jsl_real core_radius(const jsl_shape_desc *shape) {
    return shape->kind == JSL_SHAPE_SPHERE || shape->kind == JSL_SHAPE_CAPSULE ? shape->radius : 0;
}

static void rebuild(const narrow *n, jsl_rigid_pair *p, jsl_real *geo, const jsl_collider_item *a,
                    const jsl_collider_item *b, jsl_pose pa, jsl_pose pb, const relation *now,
                    jsl_real margin, jsl_real reach) {
    (void)n;
    /* About B's centre, so that floats stay fine far from the origin. */
    jsl_vec3 from_b = jsl_sub(pa.position, pb.position);
    jsl_manifold m = {0};
    jsl_collide(&a->shape, (jsl_pose){from_b, pa.orientation}, &b->shape,
                (jsl_pose){{0, 0, 0}, pb.orientation}, reach, &m);
    p->rebuilt = 1;
    if (m.count <= 0 || !sound(&m)) {
        clear(p, geo);
        return;
    }
    jsl_real old[JSL_GEO];
    memcpy(old, geo, sizeof old);
    for (int j = 0; j < JSL_MAX_MANIFOLD; j++) {
        jsl_real *ga = geo + JSL_GEO_A + 4 * j, *gb = geo + JSL_GEO_B + 4 * j;
        if (j < m.count) {
            put3(ga, jsl_rotate_inv(pa.orientation, m.point[j]));
            put3(gb, jsl_rotate_inv(pb.orientation, m.point[j]));
            ga[3] = m.separation[j];
        } else {
            memset(ga, 0, 3 * sizeof *ga), memset(gb, 0, 3 * sizeof *gb);
            ga[3] = JSL_FAR;
        }
        geo[JSL_GEO_IMPULSE + j] = 0;
    }
    match(old, p->feature, p->count, geo, &m, 2 * margin);
    put3(geo + JSL_GEO_NORMAL, jsl_rotate_inv(pa.orientation, m.normal));
    geo[JSL_GEO_TURN] = now->turn.x, geo[JSL_GEO_TURN + 1] = now->turn.y;
    geo[JSL_GEO_TURN + 2] = now->turn.z, geo[JSL_GEO_TURN + 3] = now->turn.w;
    put3(geo + JSL_GEO_OFFSET, now->offset);
    geo[JSL_GEO_ROUND] = core_radius(&a->shape), geo[JSL_GEO_ROUND + 1] = core_radius(&b->shape);
    geo[JSL_GEO_SCALE] = 1 / margin;
    memcpy(p->feature, m.feature, sizeof p->feature);
    p->count = (uint8_t)m.count;
    p->built = 1;
    p->shape_a = a->shape_id, p->shape_b = b->shape_id;
    geo[JSL_GEO_GAP] = m.separation[0];
    for (int j = 1; j < m.count; j++) geo[JSL_GEO_GAP] = jsl_min(geo[JSL_GEO_GAP], m.separation[j]);
}

/* Bound on how far the two can come nearer in one step. */
static jsl_real approach(const narrow *n, int32_t a, int32_t b, jsl_real ra, jsl_real rb) {
    const jsl_rigid_room *room = n->room;
    jsl_real speed = jsl_length(jsl_sub(line3(room, a, 0), line3(room, b, 0)));
    if (ra < JSL_R(1e20)) speed += ra * jsl_length(line3(room, a, 4));
    if (rb < JSL_R(1e20)) speed += rb * jsl_length(line3(room, b, 4));
    return speed * n->context->dt;
}

static void narrow_pair(const narrow *n, int64_t k) {
    jsl_rigid_room *room = n->room;
    const jsl_collider_set *set = n->context->colliders;
    jsl_rigid_pair *p = &room->pair.at[k];
    jsl_real *geo = JSL_RIGID_GEO(room, k);
    const jsl_rigid_slot *slot = room->slot.at;
    p->was_touching = jsl_rigid_touching(room, k);
    p->rebuilt = 0;
    memset(geo + JSL_GEO_RUB, 0, 4 * sizeof *geo);
    const jsl_collider_item *a = &set->item.at[p->a], *b = &set->item.at[p->b];
    bool dynamic = slot[p->a].dynamic || slot[p->b].dynamic;
    bool fit = !slot[p->a].absent && !slot[p->b].absent;
    p->idle = !dynamic || !fit || !(a->category & b->mask) || !(b->category & a->mask) ||
              !jsl_aabb_meet(set->box.at[p->a], set->box.at[p->b]);
    if (p->idle) {
        if (p->count > 0) clear(p, geo);
        return;
    }
    uint8_t swapped = !slot[p->b].dynamic;
    if (swapped != p->swapped) clear(p, geo), p->swapped = swapped;
    p->wall = !(slot[p->a].dynamic && slot[p->b].dynamic);
    int32_t ia = swapped ? p->b : p->a, ib = swapped ? p->a : p->b;
    const jsl_collider_item *first = swapped ? b : a, *second = swapped ? a : b;
    jsl_pose pa = pose_of(room, ia), pb = pose_of(room, ib);
    relation now = relate(pa, pb);
    jsl_real margin = n->margin * jsl_min(first->radius, second->radius);
    bool same = p->built && p->shape_a == first->shape_id && p->shape_b == second->shape_id;
    if (same && may_keep(first, second) && unmoved(geo, &now, second->radius, margin * n->keep)) {
        put3(geo + JSL_GEO_SHIFT, jsl_sub(get3(geo + JSL_GEO_OFFSET), now.offset));
    } else {
        jsl_real reach = margin + approach(n, ia, ib, first->radius, second->radius);
        rebuild(n, p, geo, first, second, pa, pb, &now, margin, reach);
        memset(geo + JSL_GEO_SHIFT, 0, 3 * sizeof *geo);
    }
    geo[JSL_GEO_FRICTION] = jsl_sqrt(first->friction * second->friction);
    geo[JSL_GEO_BOUNCE] = jsl_max(first->restitution, second->restitution);
}

static void narrow_block(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    (void)block, (void)worker;
    for (int64_t k = begin; k < end; k++) narrow_pair(arg, k);
}

jsl_result jsl_rigid_detect(const jsl_step_context *context, void *user) {
    jsl_rigid_room *room = user;
    double t0 = jsl_seconds();
    room->contacts_valid = false;
    JSL_TRY(jsl_rigid_slots_update(room, context));
    jsl_rigid_slots_gather(room, context);
    double t1 = jsl_seconds();
    JSL_TRY(jsl_rigid_pairs_update(room, context));
    double t2 = jsl_seconds();
    const jsl_rigid_settings *s = &room->settings;
    narrow n = {room, context, s->margin > 0 ? s->margin : JSL_R(0.05),
                s->keep > 0   ? s->keep
                : s->keep < 0 ? -1
                              : 1};
    jsl_parallel_for(context->exec, room->pair.count, PAIR_BLOCK, narrow_block, &n);
    double t3 = jsl_seconds();
    jsl_result result = jsl_rigid_colour_update(room, context);
    double t4 = jsl_seconds();
    room->profile.gather += t1 - t0, room->profile.pairs += t2 - t1;
    room->profile.narrow += t3 - t2, room->profile.colour += t4 - t3;
    return result;
}
