/* SPDX-License-Identifier: MIT
 * slots.c - from columns to the solver's lines and back.
 */
#include "rigid/room.h"

#include <math.h>

#define SLOT_BLOCK 512 /* slots a task; a multiple of JSL_LANES */
/* Half the rotation of a sub-step up to which the wide position update is exact, rad. */
#define MAX_HALF_TURN JSL_R(1.0)

/* What gathering or finishing found wrong. */
enum { SLOT_BAD = 1, SLOT_CLAMPED = 2 };

jsl_result jsl_rigid_views_update(jsl_rigid_room *room) {
    JSL_TRY(jsl_array_reserve(room->memory, &room->view, 8));
    room->view.count = 0;
    for (int64_t t = 0; t < room->view_of_table.count; t++) room->view_of_table.at[t] = -1;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(room->ecs, room->moving, 0); jsl_query_next(&it, &rows);) {
        JSL_TRY(jsl_array_reserve(room->memory, &room->view, room->view.count + 1));
        JSL_TRY(jsl_array_reserve(room->memory, &room->view_of_table, (int64_t)rows.table + 1));
        while (room->view_of_table.count <= rows.table)
            room->view_of_table.at[room->view_of_table.count++] = -1;
        room->view_of_table.at[rows.table] = (int32_t)room->view.count;
        room->view.at[room->view.count++] = (jsl_rigid_view){
            rows,
            jsl_position_of(&rows, 0),
            jsl_orientation_of(&rows, 1),
            jsl_velocity_of(&rows, 2),
            jsl_spin_of(&rows, 3),
            jsl_mass_of(&rows, 4),
            jsl_body_of(&rows, 5),
        };
    }
    return JSL_OK;
}

static bool is_dynamic(const jsl_rigid_view *v, int64_t r) {
    return v->body.kind[r] == JSL_BODY_DYNAMIC && !(v->body.body_flags[r] & JSL_BODY_FROZEN) &&
           (v->mass.inv_mass[r] > 0 || v->mass.inv_ixx[r] > 0 || v->mass.inv_iyy[r] > 0 ||
            v->mass.inv_izz[r] > 0);
}

/* The slot of an item: where its body is, if it is one that moves. */
static jsl_rigid_slot slot_of_item(jsl_rigid_room *room, const jsl_collider_item *item) {
    jsl_rigid_slot slot = {.id = jsl_entity_id(item->entity), .entity = item->entity, .view = -1};
    uint32_t table = item->table;
    int64_t row = item->row;
    if (table >= room->view_of_table.count || room->view_of_table.at[table] < 0) return slot;
    const jsl_rigid_view *view = &room->view.at[room->view_of_table.at[table]];
    if (row >= view->rows.count || !jsl_entity_equal(view->rows.entity[row], item->entity)) {
        /* Rows moved since the index was made. */
        if (!jsl_entity_locate(room->ecs, item->entity, &table, &row)) return slot;
        if (table >= room->view_of_table.count || room->view_of_table.at[table] < 0) return slot;
        view = &room->view.at[room->view_of_table.at[table]];
    }
    slot.view = room->view_of_table.at[table];
    slot.row = (int32_t)row;
    slot.moving = !(view->body.body_flags[row] & JSL_BODY_FROZEN);
    slot.dynamic = is_dynamic(view, row);
    return slot;
}

static jsl_result reserve_slots(jsl_rigid_room *room, int64_t count) {
    jsl_memory *m = room->memory;
    int64_t all = jsl_round_up(count, JSL_LANES) + JSL_SPARES;
    JSL_TRY(jsl_array_reserve(m, &room->line, all * JSL_LINE));
    JSL_TRY(jsl_array_reserve(m, &room->move, all * JSL_MOVE));
    JSL_TRY(jsl_array_reserve(m, &room->base, all * JSL_BASE));
    JSL_TRY(jsl_array_reserve(m, &room->kick, all * JSL_KICK));
    JSL_TRY(jsl_array_reserve(m, &room->pose, all * JSL_POSE));
    JSL_TRY(jsl_array_reserve(m, &room->turn, all * JSL_TURN));
    JSL_TRY(jsl_array_reserve(m, &room->used, all * 2));
    JSL_TRY(jsl_array_reserve(m, &room->split, count));
    return JSL_OK;
}

jsl_result jsl_rigid_slots_update(jsl_rigid_room *room, const jsl_step_context *context) {
    JSL_TRY(jsl_rigid_views_update(room));
    const jsl_collider_set *set = context->colliders;
    int64_t items = set ? set->item.count : 0, extra = 0;
    for (int64_t v = 0; v < room->view.count; v++)
        if (!(room->view.at[v].rows.present >> 6 & 1)) extra += room->view.at[v].rows.count;
    JSL_TRY(jsl_array_reserve(room->memory, &room->slot, items + extra));
    JSL_TRY(reserve_slots(room, items + extra));
    bool same = items == room->items && items <= room->slot.count;
    for (int64_t i = 0; i < items; i++) {
        jsl_rigid_slot now = slot_of_item(room, &set->item.at[i]);
        if (same) {
            const jsl_rigid_slot *was = &room->slot.at[i];
            same = was->id == now.id && was->dynamic == now.dynamic;
        }
        room->slot.at[i] = now;
    }
    if (!same) room->pairs_valid = false;
    room->items = items;
    room->slot.count = items;
    for (int64_t v = 0; v < room->view.count; v++) {
        const jsl_rigid_view *view = &room->view.at[v];
        if (view->rows.present >> 6 & 1) continue;
        for (int64_t r = 0; r < view->rows.count; r++)
            room->slot.at[room->slot.count++] =
                (jsl_rigid_slot){.id = jsl_entity_id(view->rows.entity[r]),
                                 .entity = view->rows.entity[r],
                                 .view = (int32_t)v,
                                 .row = (int32_t)r,
                                 .dynamic = is_dynamic(view, r),
                                 .moving = !(view->body.body_flags[r] & JSL_BODY_FROZEN)};
    }
    return JSL_OK;
}

/* -- Gather ---------------------------------------------------------------------------------- */

typedef struct gather {
    jsl_rigid_room *room;
    const jsl_step_context *context;
    jsl_real h;
    int32_t trouble; /* accessed atomically: some slot has a flag raised */
} gather;

static void put3(jsl_real *to, jsl_vec3 v) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }

static void gather_pose(jsl_rigid_room *room, int64_t i, jsl_pose pose) {
    jsl_real *p = room->pose.at + i * JSL_POSE, *m = room->move.at + i * JSL_MOVE;
    put3(p, pose.position);
    p[3] = 0, p[4] = pose.orientation.x, p[5] = pose.orientation.y;
    p[6] = pose.orientation.z, p[7] = pose.orientation.w;
    memset(m, 0, JSL_MOVE * sizeof *m);
    m[7] = 1;
}

static void gather_fixed(jsl_rigid_room *room, int64_t i, jsl_pose pose) {
    gather_pose(room, i, pose);
    jsl_real *k = room->kick.at + i * JSL_KICK;
    memset(room->line.at + i * JSL_LINE, 0, JSL_LINE * sizeof(jsl_real));
    memset(room->base.at + i * JSL_BASE, 0, JSL_BASE * sizeof(jsl_real));
    memset(room->turn.at + i * JSL_TURN, 0, JSL_TURN * sizeof(jsl_real));
    memset(k, 0, JSL_KICK * sizeof *k);
    k[3] = k[7] = 1;
}

static jsl_vec3 limited(jsl_vec3 v, jsl_real most, uint8_t *flags) {
    jsl_real square = jsl_length_sq(v);
    if (!(square > most * most)) return v;
    *flags |= SLOT_CLAMPED;
    return jsl_scale(v, most / jsl_length(v));
}

static jsl_real turn_mode(const jsl_rigid_room *room, jsl_vec3 inv) {
    bool isotropic = inv.x == inv.y && inv.y == inv.z;
    if (isotropic || !(inv.x > 0 && inv.y > 0 && inv.z > 0)) return JSL_TURN_FREE;
    switch (room->settings.rotation) {
    case JSL_ROTATION_IMPLICIT:
        return JSL_TURN_IMPLICIT;
    case JSL_ROTATION_SPLITTING:
        return JSL_TURN_SPLIT;
    default:
        return JSL_TURN_FREE;
    }
}

static void gather_dynamic(const gather *g, int64_t i, const jsl_rigid_view *v, int64_t r,
                           jsl_quat q) {
    jsl_rigid_room *room = g->room;
    jsl_real *line = room->line.at + i * JSL_LINE, *kick = room->kick.at + i * JSL_KICK,
             *turn = room->turn.at + i * JSL_TURN;
    jsl_vec3 inv = jsl_v3(v->mass.inv_ixx[r], v->mass.inv_iyy[r], v->mass.inv_izz[r]);
    jsl_real inv_mass = v->mass.inv_mass[r];
    bool isotropic = inv.x == inv.y && inv.y == inv.z;
    jsl_mat3 world = {{inv.x, 0, 0}, {0, inv.x, 0}, {0, 0, inv.x}};
    if (!isotropic) world = jsl_mat3_rotate_diagonal(q, inv);
    line[3] = inv_mass;
    line[8] = world.r0.x, line[9] = world.r0.y, line[10] = world.r0.z;
    line[11] = world.r1.y, line[12] = world.r1.z, line[13] = world.r2.z;
    jsl_vec3 force = jsl_v3(v->body.fx[r], v->body.fy[r], v->body.fz[r]);
    jsl_vec3 torque = jsl_v3(v->body.tx[r], v->body.ty[r], v->body.tz[r]);
    jsl_real pull = inv_mass > 0 ? v->body.gravity_scale[r] : 0;
    put3(kick, jsl_mul_add(jsl_scale(g->context->gravity, pull), inv_mass, force));
    put3(kick + 4, jsl_mat3_mul_vec(world, torque));
    kick[3] = 1 / (1 + g->h * v->body.linear_damping[r]);
    kick[7] = 1 / (1 + g->h * v->body.angular_damping[r]);
    turn[3] = turn_mode(room, inv);
    room->slot.at[i].split = turn[3] == JSL_TURN_SPLIT;
    put3(turn, turn[3] > 0 ? jsl_v3(1 / inv.x, 1 / inv.y, 1 / inv.z) : jsl_v3(0, 0, 0));
}

static bool all_finite(const jsl_real *p, int n) {
    jsl_real sum = 0;
    for (int i = 0; i < n; i++) sum += p[i] - p[i];
    return sum == 0;
}

/* True when the body's state can be used. */
static bool gather_body(gather *g, int64_t i, const jsl_rigid_view *v, int64_t r, uint8_t *flags) {
    jsl_rigid_room *room = g->room;
    jsl_rigid_slot *slot = &room->slot.at[i];
    jsl_pose pose = {
        jsl_v3(v->position.px[r], v->position.py[r], v->position.pz[r]),
        {v->orientation.qx[r], v->orientation.qy[r], v->orientation.qz[r], v->orientation.qw[r]}};
    gather_fixed(room, i, pose);
    jsl_vec3 vel = jsl_v3(v->velocity.vx[r], v->velocity.vy[r], v->velocity.vz[r]);
    jsl_vec3 spin = jsl_v3(v->spin.wx[r], v->spin.wy[r], v->spin.wz[r]);
    if (!slot->moving) return true;
    if (slot->dynamic) gather_dynamic(g, i, v, r, pose.orientation);
    if (room->settings.max_speed > 0) vel = limited(vel, room->settings.max_speed, flags);
    if (g->h > 0 && !slot->split) spin = limited(spin, 2 * MAX_HALF_TURN / g->h, flags);
    jsl_real *line = room->line.at + i * JSL_LINE;
    put3(line, vel);
    put3(line + 4, spin);
    return all_finite(line, JSL_LINE) && all_finite(room->pose.at + i * JSL_POSE, JSL_POSE) &&
           all_finite(room->kick.at + i * JSL_KICK, JSL_KICK);
}

/* The body stands still where it last was sound; a pose that is not finite goes to the origin. */
static void freeze(const jsl_rigid_view *v, int64_t r) {
    v->body.body_flags[r] |= JSL_BODY_FROZEN;
    jsl_real *still[] = {v->velocity.vx, v->velocity.vy, v->velocity.vz, v->spin.wx,
                         v->spin.wy,     v->spin.wz,     v->body.fx,     v->body.fy,
                         v->body.fz,     v->body.tx,     v->body.ty,     v->body.tz};
    for (int k = 0; k < JSL_COUNT(still); k++) still[k][r] = 0;
    jsl_real *pose[] = {v->position.px,    v->position.py,    v->position.pz,   v->orientation.qx,
                        v->orientation.qy, v->orientation.qz, v->orientation.qw};
    bool sound = true;
    for (int k = 0; k < JSL_COUNT(pose); k++) sound = sound && jsl_is_finite(pose[k][r]);
    if (sound) return;
    for (int k = 0; k < JSL_COUNT(pose); k++) pose[k][r] = k == 6;
}

static void gather_slots(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    (void)block, (void)worker;
    gather *g = arg;
    jsl_rigid_room *room = g->room;
    for (int64_t i = begin; i < end; i++) {
        jsl_rigid_slot *slot = &room->slot.at[i];
        slot->flags = 0;
        slot->split = 0;
        if (slot->view < 0) {
            const jsl_collider_item *item = &g->context->colliders->item.at[i];
            gather_fixed(room, i, item->pose);
            put3(room->line.at + i * JSL_LINE, item->velocity);
            put3(room->line.at + i * JSL_LINE + 4, item->spin);
            /* Some other room's: what it does in this step is not ours to know. */
            if (!all_finite(room->pose.at + i * JSL_POSE, JSL_POSE) ||
                !all_finite(room->line.at + i * JSL_LINE, JSL_LINE))
                gather_fixed(room, i, (jsl_pose){{0, 0, 0}, {0, 0, 0, 1}}), slot->absent = 1;
            continue;
        }
        const jsl_rigid_view *v = &room->view.at[slot->view];
        if (!gather_body(g, i, v, slot->row, &slot->flags)) {
            freeze(v, slot->row);
            slot->dynamic = slot->moving = slot->split = 0;
            slot->flags |= SLOT_BAD;
            jsl_pose pose = {jsl_v3(v->position.px[slot->row], v->position.py[slot->row],
                                    v->position.pz[slot->row]),
                             {v->orientation.qx[slot->row], v->orientation.qy[slot->row],
                              v->orientation.qz[slot->row], v->orientation.qw[slot->row]}};
            gather_fixed(room, i, pose);
        }
        if (slot->flags) __atomic_store_n(&g->trouble, 1, __ATOMIC_RELAXED);
    }
}

static void report(jsl_rigid_room *room, const jsl_step_context *context) {
    for (int64_t i = 0; i < room->slot.count; i++) {
        uint8_t flags = room->slot.at[i].flags;
        if (flags & SLOT_BAD) jsl_warn(context, JSL_WARN_BAD_STATE, 1, room->slot.at[i].entity);
        if (flags & SLOT_CLAMPED)
            jsl_warn(context, JSL_WARN_VELOCITY_CLAMPED, 1, room->slot.at[i].entity);
    }
}

void jsl_rigid_slots_gather(jsl_rigid_room *room, const jsl_step_context *context) {
    int64_t count = room->slot.count, padded = jsl_round_up(count, JSL_LANES);
    gather g = {room, context, context->dt / (jsl_real)context->substeps, 0};
    jsl_parallel_for(context->exec, count, SLOT_BLOCK, gather_slots, &g);
    for (int64_t i = count; i < padded + JSL_SPARES; i++)
        gather_fixed(room, i, (jsl_pose){{0, 0, 0}, {0, 0, 0, 1}});
    room->split.count = 0;
    for (int64_t i = 0; i < count; i++)
        if (room->slot.at[i].split) room->split.at[room->split.count++] = (int32_t)i;
    if (g.trouble) report(room, context);
}

/* -- Finish ---------------------------------------------------------------------------------- */

static void finish_body(jsl_rigid_room *room, int64_t i, jsl_rigid_slot *slot) {
    const jsl_rigid_view *v = &room->view.at[slot->view];
    int64_t r = slot->row;
    const jsl_real *line = room->line.at + i * JSL_LINE, *m = room->move.at + i * JSL_MOVE;
    jsl_real *p = room->pose.at + i * JSL_POSE;
    jsl_quat turn = {m[4], m[5], m[6], m[7]}, q = {p[4], p[5], p[6], p[7]};
    jsl_vec3 x = jsl_v3(p[0] + m[0], p[1] + m[1], p[2] + m[2]);
    if (m[4] != 0 || m[5] != 0 || m[6] != 0) q = jsl_quat_normalize(jsl_quat_mul(turn, q));
    jsl_real state[13] = {x.x,     x.y,     x.z,     q.x,     q.y,     q.z,    q.w,
                          line[0], line[1], line[2], line[4], line[5], line[6]};
    if (!all_finite(state, 13)) {
        freeze(v, r);
        slot->flags |= SLOT_BAD;
        return;
    }
    v->position.px[r] = p[0] = x.x, v->position.py[r] = p[1] = x.y, v->position.pz[r] = p[2] = x.z;
    v->orientation.qx[r] = p[4] = q.x, v->orientation.qy[r] = p[5] = q.y;
    v->orientation.qz[r] = p[6] = q.z, v->orientation.qw[r] = p[7] = q.w;
    v->velocity.vx[r] = line[0], v->velocity.vy[r] = line[1], v->velocity.vz[r] = line[2];
    v->spin.wx[r] = line[4], v->spin.wy[r] = line[5], v->spin.wz[r] = line[6];
    v->body.fx[r] = v->body.fy[r] = v->body.fz[r] = 0;
    v->body.tx[r] = v->body.ty[r] = v->body.tz[r] = 0;
}

static void finish_slots(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    (void)block, (void)worker;
    gather *g = arg;
    for (int64_t i = begin; i < end; i++) {
        jsl_rigid_slot *slot = &g->room->slot.at[i];
        slot->flags = 0;
        if (slot->view < 0 || !slot->moving) continue;
        finish_body(g->room, i, slot);
        if (slot->flags) __atomic_store_n(&g->trouble, 1, __ATOMIC_RELAXED);
    }
}

void jsl_rigid_slots_finish(jsl_rigid_room *room, const jsl_step_context *context) {
    gather g = {room, context, 0, 0};
    jsl_parallel_for(context->exec, room->slot.count, SLOT_BLOCK, finish_slots, &g);
    if (g.trouble) report(room, context);
}
