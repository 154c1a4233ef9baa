/* SPDX-License-Identifier: MIT
 * Scripted leaders. A path is a closed uniform Catmull-Rom spline (Catmull and Rom 1974, "A class
 * of local interpolating splines"); a leader is placed on it and runs along it at a given speed.
 */
#include "flock/room.h"

void jsl_flock_spline(const jsl_vec3 *point, int count, jsl_real s, jsl_vec3 *at, jsl_vec3 *rate) {
    int i = (int)s;
    if (i >= count) i = count - 1;
    const jsl_real t = s - (jsl_real)i;
    const jsl_vec3 a = point[(i + count - 1) % count], b = point[i];
    const jsl_vec3 c = point[(i + 1) % count], d = point[(i + 2) % count];
    /* b + m t + q t^2 + h t^3 with m = (c - a)/2. */
    jsl_vec3 m = jsl_scale(jsl_sub(c, a), JSL_R(0.5));
    jsl_vec3 q = jsl_sub(jsl_sub(jsl_add(a, jsl_scale(c, 2)), jsl_scale(b, JSL_R(2.5))),
                         jsl_scale(d, JSL_R(0.5)));
    jsl_vec3 h =
        jsl_add(jsl_scale(jsl_sub(d, a), JSL_R(0.5)), jsl_scale(jsl_sub(b, c), JSL_R(1.5)));
    *at = jsl_mul_add(b, t, jsl_mul_add(m, t, jsl_mul_add(q, t, h)));
    *rate = jsl_mul_add(m, t, jsl_mul_add(jsl_scale(q, 2), t, jsl_scale(h, 3)));
}

static jsl_real wrap(jsl_real s, int count) {
    const jsl_real n = (jsl_real)count;
    while (s >= n) s -= n;
    return s;
}

/* ds for `length` metres at s. Where waypoints turn back on themselves the derivative vanishes: it
 * is not taken below a hundredth of the chord, which passes such a point in a finite number of
 * steps. */
static jsl_real pace(const jsl_vec3 *point, int count, jsl_real s, jsl_real length) {
    jsl_vec3 at, rate;
    jsl_flock_spline(point, count, s, &at, &rate);
    const int i = (int)s < count ? (int)s : count - 1;
    const jsl_real chord = jsl_length(jsl_sub(point[(i + 1) % count], point[i]));
    return jsl_min(length / jsl_max(jsl_length(rate), JSL_R(0.01) * chord), (jsl_real)count);
}

jsl_real jsl_flock_spline_advance(const jsl_vec3 *point, int count, jsl_real s, jsl_real length) {
    /* Four midpoint steps: the error in arc length is of third order in a quarter of the way. */
    for (int i = 0; i < 4; i++) {
        const jsl_real part = length / 4;
        const jsl_real half = wrap(s + pace(point, count, s, part / 2), count);
        s = wrap(s + pace(point, count, half, part), count);
    }
    return s;
}

int jsl_flock_path_read(jsl_flock_room *room, jsl_entity flock,
                        jsl_vec3 point[JSL_FLOCK_MAX_WAYPOINTS]) {
    jsl_rows rows;
    if (!jsl_entity_has(room->ecs, flock, room->path) ||
        jsl_rows_of_entity(room->ecs, flock, room->path, &rows) != JSL_OK)
        return 0;
    const uint32_t count = *jsl_flock_path_of(&rows, 0).waypoints;
    const bool rest = jsl_entity_has(room->ecs, flock, room->path_rest);
    if (count < 3 || count > (rest ? 32u : 16u)) return 0;
    for (int i = 0; i < (int)count; i++) {
        if (i == 16 && jsl_rows_of_entity(room->ecs, flock, room->path_rest, &rows) != JSL_OK)
            return 0;
        const int at = i < 16 ? 1 + 3 * i : 3 * (i - 16);
        point[i] = jsl_v3(*(jsl_real *)rows.column[at], *(jsl_real *)rows.column[at + 1],
                          *(jsl_real *)rows.column[at + 2]);
        if (!jsl_v3_is_finite(point[i])) return 0;
    }
    return (int)count;
}

/* Moves the leader of every flock that has both a path and a leader. */
jsl_result jsl_flock_lead(const jsl_step_context *context, void *user) {
    jsl_flock_room *room = user;
    for (int64_t i = 0; i < room->state.count; i++) {
        jsl_flock_state *f = &room->state.at[i];
        jsl_vec3 point[JSL_FLOCK_MAX_WAYPOINTS], at, rate;
        jsl_rows own, place, velocity;
        int count;
        if (!f->active || !f->scripted || !(context->dt > 0)) continue;
        if (!(count = jsl_flock_path_read(room, f->entity, point))) continue;
        if (jsl_rows_of_entity(room->ecs, f->entity, room->flock, &own) != JSL_OK ||
            jsl_rows_of_entity(room->ecs, f->value.leader, room->position, &place) != JSL_OK ||
            jsl_rows_of_entity(room->ecs, f->value.leader, room->velocity, &velocity) != JSL_OK)
            continue;
        const jsl_real speed = f->value.leader_speed;
        const jsl_real s = jsl_flock_spline_advance(point, count, wrap(f->value.path_at, count),
                                                    speed * context->dt);
        jsl_flock_spline(point, count, s, &at, &rate);
        jsl_vec3 v = jsl_scale(jsl_normalize(rate), speed);
        if (!jsl_v3_is_finite(at) || !jsl_v3_is_finite(v) || !jsl_is_finite(s)) {
            jsl_warn(context, JSL_WARN_BAD_STATE, 1, f->value.leader);
            continue;
        }
        *jsl_flock_of(&own, 0).path_at = s;
        jsl_position_columns p = jsl_position_of(&place, 0);
        jsl_velocity_columns u = jsl_velocity_of(&velocity, 0);
        *p.px = at.x, *p.py = at.y, *p.pz = at.z;
        *u.vx = v.x, *u.vy = v.y, *u.vz = v.z;
    }
    return JSL_OK;
}
