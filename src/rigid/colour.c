/* SPDX-License-Identifier: MIT
 * colour.c - pairs that are solved, coloured greedily in order of entity ids so that no two of a
 * colour share a body.
 *
 * A 64-bit mask a body makes the choice one count of trailing zeros. Contacts with the immovable
 * have masks and colours of their own and are solved last, so that what cannot move has the last
 * word.
 */
#include "rigid/room.h"

enum { PAIRS = 0, WALLS = 1 };

static int32_t first_free(uint64_t taken) {
    return taken == ~0ull ? JSL_COLOUR_NONE : __builtin_ctzll(~taken);
}

/* Colours the active pairs of one class; count[c] of each colour, count[JSL_COLOURS] of those
 * without. */
static void colour_class(jsl_rigid_room *room, int class, int64_t count[JSL_COLOURS + 1]) {
    uint64_t *used = room->used.at;
    for (int64_t k = 0; k < room->active.count; k++) {
        const jsl_rigid_pair *p = &room->pair.at[room->active.at[k]];
        if (p->wall != class) continue;
        int32_t a = p->swapped ? p->b : p->a, b = p->swapped ? p->a : p->b;
        uint64_t *ub = &used[2 * (int64_t)b + class],
                 *ua = class == WALLS ? ub : &used[2 * (int64_t)a];
        int32_t c = first_free(*ua | *ub);
        room->active_colour.at[k] = c;
        if (c == JSL_COLOUR_NONE) {
            count[JSL_COLOURS]++;
            continue;
        }
        *ua |= 1ull << c, *ub |= 1ull << c;
        count[c]++;
    }
}

static jsl_result add_colours(jsl_rigid_room *room, int class, const int64_t count[JSL_COLOURS + 1],
                              int64_t begin[JSL_COLOURS + 1]) {
    for (int c = 0; c <= JSL_COLOURS; c++) {
        if (count[c] == 0) continue;
        begin[c] = room->lanes;
        JSL_TRY(jsl_array_reserve(room->memory, &room->colour, room->colour.count + 1));
        room->colour.at[room->colour.count++] =
            (jsl_rigid_colour){room->lanes, count[c], class == WALLS, c == JSL_COLOURS};
        room->lanes += jsl_round_up(count[c], JSL_LANES);
    }
    return JSL_OK;
}

static jsl_result reserve_lanes(jsl_rigid_room *room) {
    jsl_memory *m = room->memory;
    JSL_TRY(jsl_array_reserve(m, &room->normal, room->lanes * JSL_N));
    JSL_TRY(jsl_array_reserve(m, &room->friction, room->lanes * JSL_F));
    JSL_TRY(jsl_array_reserve(m, &room->bounce, room->lanes * JSL_R_FIELDS));
    JSL_TRY(jsl_array_reserve(m, &room->lane_a, room->lanes));
    JSL_TRY(jsl_array_reserve(m, &room->lane_b, room->lanes));
    return jsl_array_reserve(m, &room->lane_contact, room->lanes);
}

static void fill_lanes(jsl_rigid_room *room, int64_t begin[2][JSL_COLOURS + 1]) {
    int32_t dummy = (int32_t)jsl_round_up(room->slot.count, JSL_LANES);
    for (int64_t i = 0; i < room->colour.count; i++) {
        const jsl_rigid_colour *c = &room->colour.at[i];
        for (int64_t l = c->begin + c->count; l < c->begin + jsl_round_up(c->count, JSL_LANES);
             l++) {
            room->lane_a.at[l] = room->lane_b.at[l] = dummy + (int32_t)i;
            room->lane_contact.at[l] = (int32_t)(room->pair.count + i);
        }
    }
    for (int64_t k = 0; k < room->active.count; k++) {
        int32_t i = room->active.at[k], c = room->active_colour.at[k];
        const jsl_rigid_pair *p = &room->pair.at[i];
        int64_t l = begin[p->wall][c == JSL_COLOUR_NONE ? JSL_COLOURS : c]++;
        room->lane_a.at[l] = p->swapped ? p->b : p->a;
        room->lane_b.at[l] = p->swapped ? p->a : p->b;
        room->lane_contact.at[l] = i;
    }
}

jsl_result jsl_rigid_colour_update(jsl_rigid_room *room, const jsl_step_context *context) {
    (void)context;
    JSL_TRY(jsl_array_reserve(room->memory, &room->active, room->pair.count));
    JSL_TRY(jsl_array_reserve(room->memory, &room->active_colour, room->pair.count));
    room->active.count = room->rebuilt = 0;
    for (int64_t k = 0; k < room->pair.count; k++) {
        const jsl_rigid_pair *p = &room->pair.at[k];
        room->rebuilt += p->rebuilt;
        if (!p->idle && p->count > 0) room->active.at[room->active.count++] = (int32_t)k;
    }
    room->manifolds = room->active.count;
    memset(room->used.at, 0, (size_t)room->slot.count * 2 * sizeof *room->used.at);
    int64_t count[2][JSL_COLOURS + 1] = {{0}}, begin[2][JSL_COLOURS + 1] = {{0}};
    room->lanes = room->colour.count = 0;
    for (int class = PAIRS; class <= WALLS; class ++) {
        colour_class(room, class, count[class]);
        JSL_TRY(add_colours(room, class, count[class], begin[class]));
    }
    room->colours = (int32_t)room->colour.count;
    room->overflow = count[PAIRS][JSL_COLOURS] + count[WALLS][JSL_COLOURS];
    JSL_TRY(reserve_lanes(room));
    fill_lanes(room, begin);
    return JSL_OK;
}
