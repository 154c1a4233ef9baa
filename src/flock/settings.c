/* SPDX-License-Identifier: MIT
 * Settings of flocks: from desc to component and back.
 */
#include "flock/room.h"

#define ALL_ROUND JSL_R(-2.0)

/* A number of a desc: its name, the value, and the range it must lie in. */
typedef struct entry {
    const char *name;
    jsl_real value, lo, hi;
} entry;

static jsl_result check_entries(const jsl_logger *log, const entry *e, int count) {
    for (int i = 0; i < count; i++)
        if (!jsl_is_finite(e[i].value))
            return jsl_fail(log, JSL_ERR_NOT_FINITE, "flock: %s is not finite", e[i].name);
    for (int i = 0; i < count; i++)
        if (!(e[i].value >= e[i].lo && e[i].value <= e[i].hi))
            return jsl_fail(log, JSL_ERR_ARGUMENT, "flock: %s is %g, not in [%g, %g]", e[i].name,
                            (double)e[i].value, (double)e[i].lo, (double)e[i].hi);
    return JSL_OK;
}

static jsl_result check_desc(const jsl_logger *log, const jsl_flock_desc *d) {
    const jsl_real big = JSL_R(1e9), any = JSL_R(1e18);
    const entry all[] = {
        {"separation.radius", d->separation.radius, 0, big},
        {"separation.half_angle", d->separation.half_angle, 0, JSL_R(3.1415928)},
        {"separation.weight", d->separation.weight, 0, big},
        {"alignment.radius", d->alignment.radius, 0, big},
        {"alignment.half_angle", d->alignment.half_angle, 0, JSL_R(3.1415928)},
        {"alignment.weight", d->alignment.weight, 0, big},
        {"cohesion.radius", d->cohesion.radius, 0, big},
        {"cohesion.half_angle", d->cohesion.half_angle, 0, JSL_R(3.1415928)},
        {"cohesion.weight", d->cohesion.weight, 0, big},
        {"near_distance", d->near_distance, 0, big},
        {"max_speed", d->max_speed, 0, big},
        {"min_speed", d->min_speed, 0, d->max_speed > 0 ? d->max_speed : 9},
        {"max_accel", d->max_accel, 0, big},
        {"urge.x", d->urge.x, -big, big},
        {"urge.y", d->urge.y, -big, big},
        {"urge.z", d->urge.z, -big, big},
        {"avoid_horizon", d->avoid_horizon, 0, big},
        {"avoid_margin", d->avoid_margin, 0, big},
        {"boid_radius", d->boid_radius, 0, big},
        {"bounds_lo.x", d->bounds_lo.x, -any, d->bounds_hi.x},
        {"bounds_lo.y", d->bounds_lo.y, -any, d->bounds_hi.y},
        {"bounds_lo.z", d->bounds_lo.z, -any, d->bounds_hi.z},
        {"bounds_hi.x", d->bounds_hi.x, -any, any},
        {"bounds_hi.y", d->bounds_hi.y, -any, any},
        {"bounds_hi.z", d->bounds_hi.z, -any, any},
        {"bounds_weight", d->bounds_weight, 0, big},
        {"leader_weight", d->leader_weight, 0, big},
        {"leader_gap", d->leader_gap, 0, big},
    };
    JSL_TRY(check_entries(log, all, JSL_COUNT(all)));
    if ((uint32_t)d->negotiation >= JSL_FLOCK_NEGOTIATION_COUNT)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "flock: negotiation is %d", (int)d->negotiation);
    if ((uint32_t)d->response >= JSL_FLOCK_RESPONSE_COUNT)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "flock: response is %d", (int)d->response);
    if (d->period < 0 || d->period > JSL_FLOCK_MAX_PERIOD)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "flock: period is %d, not in [0, %d]", d->period,
                        JSL_FLOCK_MAX_PERIOD);
    return JSL_OK;
}

static bool rule_is_zero(jsl_flock_rule r) {
    return r.radius == 0 && r.half_angle == 0 && r.weight == 0;
}

static jsl_real cosine(jsl_real half_angle) {
    return half_angle == 0 || half_angle >= JSL_PI ? ALL_ROUND : jsl_cos(half_angle);
}

static jsl_real or_else(jsl_real value, double otherwise) {
    return value == 0 ? (jsl_real)otherwise : value;
}

/* Fills everything but leader and path. */
static void from_desc(const jsl_flock_desc *d, jsl_flock_values *v) {
    const bool plain =
        rule_is_zero(d->separation) && rule_is_zero(d->alignment) && rule_is_zero(d->cohesion);
    v->separation_radius = plain ? 5 : d->separation.radius;
    v->separation_cos = plain ? JSL_R(-0.707) : cosine(d->separation.half_angle);
    v->separation_weight = plain ? 12 : d->separation.weight;
    v->alignment_radius = plain ? JSL_R(7.5) : d->alignment.radius;
    v->alignment_cos = plain ? JSL_R(0.7) : cosine(d->alignment.half_angle);
    v->alignment_weight = plain ? 8 : d->alignment.weight;
    v->cohesion_radius = plain ? 9 : d->cohesion.radius;
    v->cohesion_cos = plain ? JSL_R(-0.15) : cosine(d->cohesion.half_angle);
    v->cohesion_weight = plain ? 8 : d->cohesion.weight;
    v->near_distance = or_else(d->near_distance, plain ? 1.5 : 0);
    v->max_speed = or_else(d->max_speed, 9);
    v->min_speed = d->min_speed;
    v->max_accel = or_else(d->max_accel, 36);
    v->negotiation = (uint32_t)d->negotiation;
    v->response = (uint32_t)d->response;
    v->period = d->period ? (uint32_t)d->period : 1;
    const bool bounds = d->bounds_lo.x != d->bounds_hi.x || d->bounds_lo.y != d->bounds_hi.y ||
                        d->bounds_lo.z != d->bounds_hi.z;
    v->flock_flags = (d->ignore_obstacles ? JSL_FLOCK_IGNORES_OBSTACLES : 0) |
                     (bounds ? JSL_FLOCK_HAS_BOUNDS : 0);
    v->urge_x = d->urge.x, v->urge_y = d->urge.y, v->urge_z = d->urge.z;
    v->avoid_horizon = or_else(d->avoid_horizon, 2);
    v->avoid_margin = or_else(d->avoid_margin, 0.5);
    v->boid_radius = d->boid_radius;
    v->lo_x = d->bounds_lo.x, v->lo_y = d->bounds_lo.y, v->lo_z = d->bounds_lo.z;
    v->hi_x = d->bounds_hi.x, v->hi_y = d->bounds_hi.y, v->hi_z = d->bounds_hi.z;
    v->bounds_weight = or_else(d->bounds_weight, 4);
    v->leader_weight = or_else(d->leader_weight, 1);
    v->leader_gap = d->leader_gap;
}

static jsl_flock_rule to_rule(jsl_real radius, jsl_real cos, jsl_real weight) {
    jsl_real sine = jsl_sqrt(jsl_max(0, 1 - cos * cos));
    return (jsl_flock_rule){radius, cos < -1 ? 0 : jsl_atan2(sine, cos), weight};
}

static void to_desc(const jsl_flock_values *v, jsl_flock_desc *d) {
    *d = (jsl_flock_desc){
        .separation = to_rule(v->separation_radius, v->separation_cos, v->separation_weight),
        .alignment = to_rule(v->alignment_radius, v->alignment_cos, v->alignment_weight),
        .cohesion = to_rule(v->cohesion_radius, v->cohesion_cos, v->cohesion_weight),
        .near_distance = v->near_distance,
        .max_speed = v->max_speed,
        .min_speed = v->min_speed,
        .max_accel = v->max_accel,
        .negotiation = (jsl_flock_negotiation)v->negotiation,
        .response = (jsl_flock_response)v->response,
        .period = (int)v->period,
        .urge = {v->urge_x, v->urge_y, v->urge_z},
        .ignore_obstacles = v->flock_flags & JSL_FLOCK_IGNORES_OBSTACLES,
        .avoid_horizon = v->avoid_horizon,
        .avoid_margin = v->avoid_margin,
        .boid_radius = v->boid_radius,
        .bounds_weight = v->bounds_weight,
        .leader_weight = v->leader_weight,
        .leader_gap = v->leader_gap,
    };
    if (!(v->flock_flags & JSL_FLOCK_HAS_BOUNDS)) return;
    d->bounds_lo = jsl_v3(v->lo_x, v->lo_y, v->lo_z);
    d->bounds_hi = jsl_v3(v->hi_x, v->hi_y, v->hi_z);
}

#define CHECK(field, lo, hi)                                                                       \
    if (!(v->field >= (lo) && v->field <= (hi))) return #field

const char *jsl_flock_values_check(const jsl_flock_values *v) {
    const jsl_real big = JSL_R(1e9), any = JSL_R(1e18);
    CHECK(separation_radius, 0, big);
    CHECK(separation_cos, ALL_ROUND, 1);
    CHECK(separation_weight, 0, big);
    CHECK(alignment_radius, 0, big);
    CHECK(alignment_cos, ALL_ROUND, 1);
    CHECK(alignment_weight, 0, big);
    CHECK(cohesion_radius, 0, big);
    CHECK(cohesion_cos, ALL_ROUND, 1);
    CHECK(cohesion_weight, 0, big);
    CHECK(near_distance, 0, big);
    CHECK(max_speed, 0, big);
    CHECK(min_speed, 0, v->max_speed);
    CHECK(max_accel, 0, big);
    if (v->negotiation >= JSL_FLOCK_NEGOTIATION_COUNT) return "negotiation";
    if (v->response >= JSL_FLOCK_RESPONSE_COUNT) return "response";
    CHECK(period, 1u, (uint32_t)JSL_FLOCK_MAX_PERIOD);
    CHECK(urge_x, -big, big);
    CHECK(urge_y, -big, big);
    CHECK(urge_z, -big, big);
    CHECK(avoid_horizon, 0, big);
    CHECK(avoid_margin, 0, big);
    CHECK(boid_radius, 0, big);
    if (v->flock_flags & JSL_FLOCK_HAS_BOUNDS) {
        CHECK(lo_x, -any, v->hi_x);
        CHECK(lo_y, -any, v->hi_y);
        CHECK(lo_z, -any, v->hi_z);
        CHECK(hi_x, -any, any);
        CHECK(hi_y, -any, any);
        CHECK(hi_z, -any, any);
    }
    CHECK(bounds_weight, 0, big);
    CHECK(leader_weight, 0, big);
    CHECK(leader_gap, 0, big);
    CHECK(leader_speed, 0, big);
    CHECK(path_at, 0, JSL_FLOCK_MAX_WAYPOINTS);
    return NULL;
}

/* -- Component and value
 * ------------------------------------------------------------------------------ */

#define READ_(ctype, name, unit, role) v->name = *c.name;
#define WRITE_(ctype, name, unit, role) *c.name = v->name;

static bool columns_of(jsl_flock_room *room, jsl_entity flock, jsl_flock_columns *c) {
    jsl_rows rows;
    if (!jsl_entity_has(room->ecs, flock, room->flock)) return false;
    if (jsl_rows_of_entity(room->ecs, flock, room->flock, &rows) != JSL_OK) return false;
    *c = jsl_flock_of(&rows, 0);
    return true;
}

bool jsl_flock_values_read(jsl_flock_room *room, jsl_entity flock, jsl_flock_values *v) {
    jsl_flock_columns c;
    if (!columns_of(room, flock, &c)) return false;
    JSL_FLOCK_FIELDS(READ_)
    return true;
}

static void write_values(jsl_flock_columns c, const jsl_flock_values *v) {
    JSL_FLOCK_FIELDS(WRITE_)
}

static jsl_result bad_handle(const jsl_flock_room *room, jsl_flock flock) {
    return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_HANDLE, "flock: handle %u.%u is none",
                    flock.entity.index, flock.entity.generation);
}

jsl_result jsl_flock_room_flock_create(jsl_flock_room *room, const jsl_flock_desc *desc,
                                       jsl_flock *out) {
    if (!room) return JSL_ERR_ARGUMENT;
    const jsl_logger *log = jsl_ecs_logger(room->ecs);
    if (!desc || !out) return jsl_fail(log, JSL_ERR_ARGUMENT, "flock: desc or out is null");
    JSL_TRY(check_desc(log, desc));
    jsl_flock_values value = {0};
    from_desc(desc, &value);
    jsl_flock made;
    JSL_TRY(jsl_entity_create(room->ecs, &room->flock, 1, &made.entity));
    jsl_flock_columns c;
    if (!columns_of(room, made.entity, &c)) return JSL_ERR_STATE;
    write_values(c, &value);
    *out = made;
    return JSL_OK;
}

jsl_result jsl_flock_room_flock_destroy(jsl_flock_room *room, jsl_flock flock) {
    if (!room) return JSL_ERR_ARGUMENT;
    if (!jsl_entity_has(room->ecs, flock.entity, room->flock)) return bad_handle(room, flock);
    return jsl_entity_destroy(room->ecs, flock.entity);
}

jsl_result jsl_flock_room_flock_set(jsl_flock_room *room, jsl_flock flock,
                                    const jsl_flock_desc *desc) {
    if (!room) return JSL_ERR_ARGUMENT;
    const jsl_logger *log = jsl_ecs_logger(room->ecs);
    jsl_flock_columns c;
    jsl_flock_values value;
    if (!columns_of(room, flock.entity, &c) || !jsl_flock_values_read(room, flock.entity, &value))
        return bad_handle(room, flock);
    if (!desc) return jsl_fail(log, JSL_ERR_ARGUMENT, "flock: desc is null");
    JSL_TRY(check_desc(log, desc));
    from_desc(desc, &value);
    write_values(c, &value);
    return JSL_OK;
}

jsl_result jsl_flock_room_flock_get(jsl_flock_room *room, jsl_flock flock, jsl_flock_desc *out) {
    if (!room || !out) return JSL_ERR_ARGUMENT;
    jsl_flock_values value;
    if (!jsl_flock_values_read(room, flock.entity, &value)) return bad_handle(room, flock);
    to_desc(&value, out);
    return JSL_OK;
}
