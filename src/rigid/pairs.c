/* SPDX-License-Identifier: MIT
 * pairs.c - which solids may meet: a list that stays valid while nothing leaves its loose box.
 *
 * A pair is in the list when its loose boxes meet, and is looked at in a step when its collider
 * boxes do, so what a step computes does not depend on when the list was made.
 */
#include "rigid/room.h"

/* How far a box is loosened, as a share of the bounding radius. */
#define LOOSE JSL_R(0.1)

static jsl_aabb loosened(jsl_aabb box, jsl_real by) {
    return (jsl_aabb){jsl_v3(box.lo.x - by, box.lo.y - by, box.lo.z - by),
                      jsl_v3(box.hi.x + by, box.hi.y + by, box.hi.z + by)};
}
static bool inside(jsl_aabb a, jsl_aabb b) {
    return a.lo.x >= b.lo.x && a.lo.y >= b.lo.y && a.lo.z >= b.lo.z && a.hi.x <= b.hi.x &&
           a.hi.y <= b.hi.y && a.hi.z <= b.hi.z;
}

static bool still_valid(const jsl_rigid_room *room, const jsl_collider_set *set) {
    if (!room->pairs_valid || room->loose.count != set->item.count) return false;
    for (int64_t i = 0; i < set->item.count; i++)
        if (!inside(set->box.at[i], room->loose.at[i])) return false;
    return true;
}

static bool may_meet(const jsl_rigid_room *room, int32_t a, int32_t b) {
    const jsl_rigid_slot *s = room->slot.at;
    return s[a].dynamic || s[b].dynamic;
}

/* Pairs of items as keys a << 32 | b, a < b, in order. */
static jsl_result find_pairs(jsl_rigid_room *room, const jsl_collider_set *set) {
    jsl_memory *m = room->memory;
    int64_t n = set->item.count, finite = set->finite.count;
    JSL_TRY(jsl_array_reserve(m, &room->loose, n));
    JSL_TRY(jsl_array_reserve(m, &room->finite_box, finite));
    for (int64_t i = 0; i < n; i++)
        room->loose.at[i] =
            loosened(set->box.at[i], jsl_min(set->item.at[i].radius, JSL_R(1e6)) * LOOSE);
    room->loose.count = n;
    for (int64_t j = 0; j < finite; j++) room->finite_box.at[j] = room->loose.at[set->finite.at[j]];
    room->found.count = 0;
    if (finite > 0) {
        JSL_TRY(jsl_bvh_build(m, &room->bvh, room->finite_box.at, finite));
        JSL_TRY(jsl_bvh_pairs(m, &room->bvh, room->finite_box.at, finite, &room->found));
    }
    room->sort_key.count = 0;
    JSL_TRY(jsl_array_reserve(m, &room->sort_key, room->found.count));
    for (int64_t k = 0; k < room->found.count; k++) {
        int32_t a = set->finite.at[room->found.at[k].a], b = set->finite.at[room->found.at[k].b];
        if (may_meet(room, a, b))
            room->sort_key.at[room->sort_key.count++] = (uint64_t)(uint32_t)a << 32 | (uint32_t)b;
    }
    int64_t from_tree = room->sort_key.count;
    for (int64_t p = 0; p < set->planes.count; p++)
        for (int64_t j = 0; j < finite; j++) {
            int32_t plane = set->planes.at[p], i = set->finite.at[j];
            if (!may_meet(room, plane, i) ||
                !jsl_aabb_meet(room->loose.at[plane], room->loose.at[i]))
                continue;
            int32_t a = plane < i ? plane : i, b = plane < i ? i : plane;
            JSL_TRY(jsl_array_reserve(m, &room->sort_key, room->sort_key.count + 1));
            room->sort_key.at[room->sort_key.count++] = (uint64_t)(uint32_t)a << 32 | (uint32_t)b;
        }
    int64_t count = room->sort_key.count;
    if (count > from_tree) {
        JSL_TRY(jsl_array_reserve(m, &room->sort_tmp, count));
        JSL_TRY(jsl_array_reserve(m, &room->sort_value, count));
        JSL_TRY(jsl_array_reserve(m, &room->sort_tmp_value, count));
        memset(room->sort_value.at, 0, (size_t)count * sizeof(uint32_t));
        jsl_sort_u64(room->sort_key.at, room->sort_value.at, room->sort_tmp.at,
                     room->sort_tmp_value.at, count);
    }
    return JSL_OK;
}

static int order(const jsl_rigid_pair *p, uint64_t a, uint64_t b) {
    if (p->id_a != a) return p->id_a < a ? -1 : 1;
    if (p->id_b != b) return p->id_b < b ? -1 : 1;
    return 0;
}

jsl_result jsl_rigid_pair_ended(jsl_rigid_room *room, const jsl_rigid_pair *pair) {
    JSL_TRY(jsl_array_reserve(room->memory, &room->ended, room->ended.count + 1));
    room->ended.at[room->ended.count++] = (jsl_rigid_ended){pair->id_a, pair->id_b};
    return JSL_OK;
}

/* The new list takes over what the old one knew of the same entities. */
static jsl_result merge_pairs(jsl_rigid_room *room) {
    int64_t count = room->sort_key.count, o = 0;
    JSL_TRY(jsl_array_reserve(room->memory, &room->old_pair, count));
    JSL_TRY(jsl_array_reserve(room->memory, &room->old_geo, (count + JSL_SPARES) * JSL_GEO));
    for (int64_t k = 0; k < count; k++) {
        int32_t a = (int32_t)(room->sort_key.at[k] >> 32),
                b = (int32_t)(uint32_t)room->sort_key.at[k];
        uint64_t id_a = room->slot.at[a].id, id_b = room->slot.at[b].id;
        jsl_rigid_pair *p = &room->old_pair.at[k];
        jsl_real *geo = room->old_geo.at + k * JSL_GEO;
        for (; o < room->pair.count && order(&room->pair.at[o], id_a, id_b) < 0; o++)
            if (jsl_rigid_touching(room, o)) JSL_TRY(jsl_rigid_pair_ended(room, &room->pair.at[o]));
        if (o < room->pair.count && order(&room->pair.at[o], id_a, id_b) == 0) {
            *p = room->pair.at[o];
            memcpy(geo, JSL_RIGID_GEO(room, o), JSL_GEO * sizeof *geo);
            o++;
        } else {
            *p = (jsl_rigid_pair){.id_a = id_a, .id_b = id_b};
            memset(geo, 0, JSL_GEO * sizeof *geo);
        }
        p->a = a, p->b = b;
    }
    for (; o < room->pair.count; o++)
        if (jsl_rigid_touching(room, o)) JSL_TRY(jsl_rigid_pair_ended(room, &room->pair.at[o]));
    jsl_rigid_swap_pairs(room);
    room->pair.count = count;
    return JSL_OK;
}

void jsl_rigid_swap_pairs(jsl_rigid_room *room) {
#define SWAP(x, y)                                                                                 \
    do {                                                                                           \
        void *at = (x).at;                                                                         \
        int64_t cap = (x).cap;                                                                     \
        (x).at = (y).at, (x).cap = (y).cap;                                                        \
        (y).at = at, (y).cap = cap;                                                                \
    } while (0)
    SWAP(room->pair, room->old_pair);
    SWAP(room->geo, room->old_geo);
#undef SWAP
}

/* The record of lanes that hold nothing: no direction, no point. */
static void empty_record(jsl_real *geo) {
    memset(geo, 0, JSL_GEO * sizeof *geo);
    for (int j = 0; j < JSL_MAX_MANIFOLD; j++) geo[JSL_GEO_A + 4 * j + 3] = JSL_FAR;
}

jsl_result jsl_rigid_pairs_update(jsl_rigid_room *room, const jsl_step_context *context) {
    static const jsl_collider_set nothing;
    const jsl_collider_set *set = context->colliders ? context->colliders : &nothing;
    room->ended.count = 0;
    if (still_valid(room, set)) return JSL_OK;
    room->pairs_valid = false;
    JSL_TRY(find_pairs(room, set));
    JSL_TRY(merge_pairs(room));
    for (int c = 0; c < JSL_SPARES; c++) empty_record(JSL_RIGID_GEO(room, room->pair.count + c));
    room->pairs_valid = true;
    return JSL_OK;
}
