/* SPDX-License-Identifier: MIT
 * Everything solid: swept boxes, the tree over the finite items, and queries over both.
 */
#include "geometry/geometry.h"

void jsl_collider_set_free(jsl_memory *memory, jsl_collider_set *set) {
    jsl_array_free(memory, &set->item);
    jsl_array_free(memory, &set->box);
    jsl_array_free(memory, &set->planes);
    jsl_array_free(memory, &set->finite);
    jsl_array_free(memory, &set->finite_box);
    jsl_bvh_free(memory, &set->bvh);
    *set = (jsl_collider_set){0};
}

/* Bounds of the item during the next dt. Turning moves a point at distance R by at most R |w| dt,
 * and never out of the bounding sphere. */
static jsl_aabb swept_box(const jsl_collider_item *item, jsl_real dt, jsl_real margin) {
    jsl_aabb box = jsl_shape_aabb(&item->shape, item->pose);
    if (item->shape.kind == JSL_SHAPE_PLANE) return box;
    jsl_real r = item->radius;
    jsl_real turn = item->shape.kind == JSL_SHAPE_SPHERE ? 0 : r * jsl_length(item->spin) * dt;
    jsl_vec3 c = item->pose.position, d = jsl_scale(item->velocity, dt);
    box.lo.x = jsl_max(box.lo.x - turn, jsl_min(box.lo.x, c.x - r)) + jsl_min(d.x, 0) - margin;
    box.lo.y = jsl_max(box.lo.y - turn, jsl_min(box.lo.y, c.y - r)) + jsl_min(d.y, 0) - margin;
    box.lo.z = jsl_max(box.lo.z - turn, jsl_min(box.lo.z, c.z - r)) + jsl_min(d.z, 0) - margin;
    box.hi.x = jsl_min(box.hi.x + turn, jsl_max(box.hi.x, c.x + r)) + jsl_max(d.x, 0) + margin;
    box.hi.y = jsl_min(box.hi.y + turn, jsl_max(box.hi.y, c.y + r)) + jsl_max(d.y, 0) + margin;
    box.hi.z = jsl_min(box.hi.z + turn, jsl_max(box.hi.z, c.z + r)) + jsl_max(d.z, 0) + margin;
    return box;
}

jsl_result jsl_collider_set_index(jsl_memory *memory, jsl_collider_set *set, jsl_real dt,
                                  jsl_real margin) {
    int64_t n = set->item.count;
    if (n > INT32_MAX / 2) return JSL_ERR_LIMIT;
    JSL_TRY(jsl_array_reserve(memory, &set->box, n));
    JSL_TRY(jsl_array_reserve(memory, &set->planes, n));
    JSL_TRY(jsl_array_reserve(memory, &set->finite, n));
    JSL_TRY(jsl_array_reserve(memory, &set->finite_box, n));
    /* And what the tree will need, so that nothing fails halfway. */
    JSL_TRY(jsl_array_reserve(memory, &set->bvh.node, 2 * n));
    JSL_TRY(jsl_array_reserve(memory, &set->bvh.item, n));
    set->box.count = n;
    set->planes.count = set->finite.count = 0;
    uint64_t revision = (uint64_t)n;
    for (int32_t i = 0; i < n; i++) {
        const jsl_collider_item *item = &set->item.at[i];
        uint64_t place = (uint64_t)i * 0x9e3779b97f4a7c15u;
        uint64_t what = (uint64_t)item->shape_id << 8 | (uint64_t)item->shape.kind;
        revision += jsl_mix64(jsl_entity_id(item->entity) ^ place) ^ what;
        set->box.at[i] = swept_box(item, dt, margin);
        if (item->shape.kind == JSL_SHAPE_PLANE) {
            set->planes.at[set->planes.count++] = i;
        } else if (item->shape.kind != JSL_SHAPE_NONE) {
            set->finite_box.at[set->finite.count] = set->box.at[i];
            set->finite.at[set->finite.count++] = i;
        }
    }
    set->finite_box.count = set->finite.count;
    set->revision = revision;
    /* Built anew rather than refitted: a tree that remembers the past would order its answers by
     * it. */
    return jsl_bvh_build(memory, &set->bvh, set->finite_box.at, set->finite.count);
}

int64_t jsl_collider_set_overlap(const jsl_collider_set *set, jsl_aabb box, int32_t *item,
                                 int64_t cap) {
    int64_t found = 0;
    for (int64_t i = 0; i < set->planes.count; i++) {
        int32_t plane = set->planes.at[i];
        if (!jsl_aabb_meet(set->box.at[plane], box)) continue;
        if (found < cap) item[found] = plane;
        found++;
    }
    int64_t room = cap > found ? cap - found : 0;
    int64_t finite = jsl_bvh_overlap(&set->bvh, box, item + (found < cap ? found : cap), room);
    for (int64_t i = 0; i < finite && i < room; i++) {
        item[found + i] = set->finite.at[item[found + i]];
    }
    return found + finite;
}

/* -- Rays
 * -------------------------------------------------------------------------------------------------------
 */

typedef struct segment {
    jsl_vec3 from, to;
    jsl_real from_at[3], inv[3];
} segment;

/* Fraction at which the segment enters the box; 2 when it does not before `limit`. inv is finite,
 * so there is no 0 * inf. */
static jsl_real enter(const segment *s, const jsl_aabb *box, jsl_real limit) {
    const jsl_real lo[3] = {box->lo.x, box->lo.y, box->lo.z};
    const jsl_real hi[3] = {box->hi.x, box->hi.y, box->hi.z};
    jsl_real t0 = 0, t1 = limit;
    for (int i = 0; i < 3; i++) {
        jsl_real a = (lo[i] - s->from_at[i]) * s->inv[i], b = (hi[i] - s->from_at[i]) * s->inv[i];
        t0 = jsl_max(t0, jsl_min(a, b));
        t1 = jsl_min(t1, jsl_max(a, b) * (1 + 4 * JSL_REAL_EPSILON));
    }
    return t0 <= t1 ? t0 : 2;
}

typedef struct nearest_hit {
    uint32_t mask;
    jsl_ray_hit hit;
    int32_t item; /* -1: none yet */
} nearest_hit;

/* Equal fractions go to the lower item. */
static void try_item(const jsl_collider_set *set, const segment *s, int32_t i, nearest_hit *best) {
    const jsl_collider_item *item = &set->item.at[i];
    jsl_ray_hit hit;
    if (!(item->category & best->mask)) return;
    if (!jsl_shape_ray(&item->shape, item->pose, s->from, s->to, &hit)) return;
    bool nearer = best->item < 0 || hit.fraction < best->hit.fraction ||
                  (hit.fraction == best->hit.fraction && i < best->item);
    if (nearer) best->hit = hit, best->item = i;
}

enum { STACK = 128 };

bool jsl_collider_set_ray(const jsl_collider_set *set, jsl_vec3 from, jsl_vec3 to, uint32_t mask,
                          jsl_ray_hit *out, int32_t *item) {
    const jsl_vec3 d = jsl_sub(to, from);
    const jsl_real v[3] = {d.x, d.y, d.z}, most = JSL_R(1e30);
    segment s = {.from = from, .to = to, .from_at = {from.x, from.y, from.z}};
    for (int i = 0; i < 3; i++)
        s.inv[i] = jsl_abs(v[i]) > 1 / most ? 1 / v[i] : v[i] < 0 ? -most : most;
    nearest_hit best = {.mask = mask, .item = -1};
    for (int64_t i = 0; i < set->planes.count; i++) try_item(set, &s, set->planes.at[i], &best);

    int32_t stack[STACK], top = 0;
    const jsl_bvh_node *node = set->bvh.node.at;
    if (set->bvh.node.count > 0) stack[top++] = 0;
    while (top > 0) {
        const jsl_bvh_node *at = &node[stack[--top]];
        jsl_real limit = best.item < 0 ? 1 : best.hit.fraction;
        if (enter(&s, &at->box, limit) > limit) continue;
        if (at->left < 0) {
            try_item(set, &s, set->finite.at[-1 - at->left], &best);
            continue;
        }
        bool left_first =
            enter(&s, &node[at->left].box, limit) <= enter(&s, &node[at->right].box, limit);
        stack[top++] = left_first ? at->right : at->left;
        stack[top++] = left_first ? at->left : at->right;
    }
    if (best.item < 0) return false;
    *out = best.hit;
    if (item) *item = best.item;
    return true;
}
