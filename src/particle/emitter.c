/* SPDX-License-Identifier: MIT
 * Emitters: checking descs, and carrying them to columns and back. Floor 4.
 */
#include "particle/room.h"

#define DEFAULT_MAX 1000000
#define DEFAULT_FRAME (1.0 / 24)
#define DEFAULT_SIZE 0.05
#define MAX_WAITING (1ull << 40)

const char *jsl_emit_mode_text(jsl_emit_mode mode) {
    static const char *const text[] = {
#define JSL_X(code, name) name,
        JSL_EMIT_MODES(JSL_X)
#undef JSL_X
    };
    return (unsigned)mode < JSL_EMIT_MODE_COUNT ? text[mode] : NULL;
}

const char *jsl_emitter_shape_text(jsl_emitter_shape shape) {
    static const char *const text[] = {
#define JSL_X(code, name) name,
        JSL_EMITTER_SHAPES(JSL_X)
#undef JSL_X
    };
    return (unsigned)shape < JSL_EMITTER_SHAPE_COUNT ? text[shape] : NULL;
}

const char *jsl_particle_integrator_text(jsl_particle_integrator integrator) {
    static const char *const text[] = {
#define JSL_X(code, name) name,
        JSL_PARTICLE_INTEGRATORS(JSL_X)
#undef JSL_X
    };
    return (unsigned)integrator < JSL_PARTICLE_INTEGRATOR_COUNT ? text[integrator] : NULL;
}

/* -- Checks
 * -----------------------------------------------------------------------------------------------
 */

#define NO_LIMIT 3.0e38

typedef struct number {
    const char *name;
    jsl_real value;
    double lo, hi;
} number;

static jsl_result check_numbers(const jsl_logger *log, const number *n, int count) {
    for (int i = 0; i < count; i++) {
        double v = (double)n[i].value;
        if (!jsl_is_finite(n[i].value))
            return jsl_fail(log, JSL_ERR_NOT_FINITE, "emitter: %s is not finite", n[i].name);
        if (v < n[i].lo || v > n[i].hi)
            return jsl_fail(log, JSL_ERR_ARGUMENT, "emitter: %s is %g, allowed are %g to %g",
                            n[i].name, v, n[i].lo, n[i].hi);
    }
    return JSL_OK;
}

static jsl_result check_keys(const jsl_logger *log, const jsl_emitter_desc *d) {
    if (d->key_count < 0 || d->key_count > JSL_PARTICLE_KEYS)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "emitter: key_count is %d, allowed are 0 to %d",
                        d->key_count, JSL_PARTICLE_KEYS);
    jsl_real last = 0;
    for (int i = 0; i < d->key_count; i++) {
        const number n[] = {{"key at", d->key[i].at, 0, 1},
                            {"key size_scale", d->key[i].size_scale, 0, NO_LIMIT}};
        JSL_TRY(check_numbers(log, n, JSL_COUNT(n)));
        if (d->key[i].at < last)
            return jsl_fail(log, JSL_ERR_ARGUMENT, "emitter: key %d is at %g, before the key at %g",
                            i, (double)d->key[i].at, (double)last);
        last = d->key[i].at;
    }
    return JSL_OK;
}

static jsl_result check_choices(const jsl_logger *log, const jsl_emitter_desc *d) {
    const struct {
        const char *name;
        int64_t value, end;
    } list[] = {{"mode", (int64_t)d->mode, JSL_EMIT_MODE_COUNT},
                {"shape", (int64_t)d->shape, JSL_EMITTER_SHAPE_COUNT},
                {"integrator", (int64_t)d->integrator, JSL_PARTICLE_INTEGRATOR_COUNT},
                {"max_particles", d->max_particles, INT64_MAX}};
    for (int i = 0; i < JSL_COUNT(list); i++)
        if (list[i].value < 0 || list[i].value >= list[i].end)
            return jsl_fail(log, JSL_ERR_ARGUMENT, "emitter: %s is %lld, allowed are 0 to %lld",
                            list[i].name, (long long)list[i].value, (long long)list[i].end - 1);
    return JSL_OK;
}

static jsl_result check_all(const jsl_logger *log, const jsl_emitter_desc *d) {
    const double any = NO_LIMIT;
    const number n[] = {
        {"position.x", d->position.x, -any, any},
        {"position.y", d->position.y, -any, any},
        {"position.z", d->position.z, -any, any},
        {"orientation.x", d->orientation.x, -any, any},
        {"orientation.y", d->orientation.y, -any, any},
        {"orientation.z", d->orientation.z, -any, any},
        {"orientation.w", d->orientation.w, -any, any},
        {"velocity.x", d->velocity.x, -any, any},
        {"velocity.y", d->velocity.y, -any, any},
        {"velocity.z", d->velocity.z, -any, any},
        {"extent.x", d->extent.x, 0, any},
        {"extent.y", d->extent.y, 0, any},
        {"extent.z", d->extent.z, 0, any},
        {"rate", d->rate, 0, any},
        {"rate_range", d->rate_range, 0, any},
        {"rate_frame", d->rate_frame, 0, any},
        {"direction.x", d->direction.x, -any, any},
        {"direction.y", d->direction.y, -any, any},
        {"direction.z", d->direction.z, -any, any},
        {"cone", d->cone, 0, (double)JSL_PI},
        {"speed", d->speed, -any, any},
        {"speed_range", d->speed_range, 0, any},
        {"inherit", d->inherit, 0, 1},
        {"life", d->life, 0, any},
        {"life_range", d->life_range, 0, any},
        {"size", d->size, 0, any},
        {"size_range", d->size_range, 0, any},
        {"buoyancy", d->buoyancy, -any, any},
        {"drag", d->drag, 0, any},
        {"wind", d->wind, 0, 1},
        {"restitution", d->restitution, 0, 1},
        {"friction", d->friction, 0, any},
        {"contact_size", d->contact_size, 0, 1},
        {"bounds.lo.x", d->bounds.lo.x, -any, any},
        {"bounds.lo.y", d->bounds.lo.y, -any, any},
        {"bounds.lo.z", d->bounds.lo.z, -any, any},
        {"bounds.hi.x", d->bounds.hi.x, (double)d->bounds.lo.x, any},
        {"bounds.hi.y", d->bounds.hi.y, (double)d->bounds.lo.y, any},
        {"bounds.hi.z", d->bounds.hi.z, (double)d->bounds.lo.z, any},
    };
    JSL_TRY(check_numbers(log, n, JSL_COUNT(n)));
    JSL_TRY(check_choices(log, d));
    return check_keys(log, d);
}

jsl_result jsl_emitter_desc_check(const jsl_logger *log, const jsl_emitter_desc *d) {
    return d ? check_all(log, d) : jsl_fail(log, JSL_ERR_ARGUMENT, "emitter: there is no desc");
}

/* -- Columns and back
 * ---------------------------------------------------------------------------------------- */

static void write_emitter(const jsl_emitter_columns *e, const jsl_emitter_desc *d) {
    jsl_vec3 direction = jsl_normalize(d->direction);
    if (!(jsl_length_sq(direction) > 0)) direction = jsl_v3(0, 0, 1);
    *e->emit_mode = (uint8_t)d->mode;
    *e->emit_shape = (uint8_t)d->shape;
    *e->integrator = (uint8_t)d->integrator;
    *e->emitter_flags =
        (uint8_t)((d->additive ? JSL_EMITTER_ADDITIVE : 0) | (d->ghost ? JSL_EMITTER_GHOST : 0));
    *e->extent_x = d->extent.x;
    *e->extent_y = d->extent.y;
    *e->extent_z = d->extent.z;
    *e->rate = d->rate;
    *e->rate_range = d->rate_range;
    *e->rate_frame = d->rate_frame > 0 ? d->rate_frame : JSL_R(DEFAULT_FRAME);
    *e->max_particles = d->max_particles > 0 ? d->max_particles : DEFAULT_MAX;
    *e->dir_x = direction.x;
    *e->dir_y = direction.y;
    *e->dir_z = direction.z;
    *e->cone = d->cone;
    *e->speed = d->speed;
    *e->speed_range = d->speed_range;
    *e->inherit = d->inherit;
    *e->mean_life = d->life;
    *e->life_range = d->life_range;
    *e->mean_size = d->size > 0 ? d->size : JSL_R(DEFAULT_SIZE);
    *e->size_range = d->size_range;
    *e->buoyancy = d->buoyancy;
    *e->drag = d->drag;
    *e->wind_share = d->wind;
    *e->restitution = d->restitution;
    *e->friction = d->friction;
    *e->contact_size = d->contact_size;
    *e->category = d->category ? d->category : 1;
    *e->mask = d->mask ? d->mask : UINT32_MAX;
    *e->lo_x = d->bounds.lo.x;
    *e->lo_y = d->bounds.lo.y;
    *e->lo_z = d->bounds.lo.z;
    *e->hi_x = d->bounds.hi.x;
    *e->hi_y = d->bounds.hi.y;
    *e->hi_z = d->bounds.hi.z;
}

static jsl_emitter_desc read_emitter(const jsl_emitter_columns *e) {
    return (jsl_emitter_desc){
        .shape = (jsl_emitter_shape)*e->emit_shape,
        .extent = {*e->extent_x, *e->extent_y, *e->extent_z},
        .mode = (jsl_emit_mode)*e->emit_mode,
        .rate = *e->rate,
        .rate_range = *e->rate_range,
        .rate_frame = *e->rate_frame,
        .max_particles = *e->max_particles,
        .direction = {*e->dir_x, *e->dir_y, *e->dir_z},
        .cone = *e->cone,
        .speed = *e->speed,
        .speed_range = *e->speed_range,
        .inherit = *e->inherit,
        .life = *e->mean_life,
        .life_range = *e->life_range,
        .size = *e->mean_size,
        .size_range = *e->size_range,
        .integrator = (jsl_particle_integrator)*e->integrator,
        .buoyancy = *e->buoyancy,
        .drag = *e->drag,
        .wind = *e->wind_share,
        .restitution = *e->restitution,
        .friction = *e->friction,
        .contact_size = *e->contact_size,
        .category = *e->category,
        .mask = *e->mask,
        .ghost = *e->emitter_flags & JSL_EMITTER_GHOST,
        .bounds = {{*e->lo_x, *e->lo_y, *e->lo_z}, {*e->hi_x, *e->hi_y, *e->hi_z}},
        .additive = *e->emitter_flags & JSL_EMITTER_ADDITIVE,
    };
}

/* The keys lie as at, rgba, scale after the count. */
static void write_look(const jsl_rows *rows, const jsl_emitter_desc *d) {
    void *const *column = rows->column + rows->first[0];
    *(uint32_t *)column[0] = (uint32_t)d->key_count;
    for (int i = 0; i < JSL_PARTICLE_KEYS; i++) {
        jsl_particle_key key = i < d->key_count ? d->key[i] : (jsl_particle_key){0};
        *(jsl_real *)column[1 + 3 * i] = key.at;
        *(uint32_t *)column[2 + 3 * i] = key.rgba;
        *(jsl_real *)column[3 + 3 * i] = key.size_scale;
    }
}

static void read_look(const jsl_rows *rows, jsl_emitter_desc *d) {
    void *const *column = rows->column + rows->first[0];
    uint32_t count = *(const uint32_t *)column[0];
    d->key_count = count < JSL_PARTICLE_KEYS ? (int)count : JSL_PARTICLE_KEYS;
    for (int i = 0; i < d->key_count; i++)
        d->key[i] = (jsl_particle_key){*(const jsl_real *)column[1 + 3 * i],
                                       *(const uint32_t *)column[2 + 3 * i],
                                       *(const jsl_real *)column[3 + 3 * i]};
}

/* -- Functions of the room
 * --------------------------------------------------------------------------------------- */

static jsl_result rows_of(const jsl_particle_room *room, jsl_entity entity, jsl_component component,
                          jsl_rows *rows) {
    return jsl_rows_of_entity(room->ecs, entity, component, rows);
}

/* The columns of an emitter, or JSL_ERR_HANDLE. */
static jsl_result find(const jsl_particle_room *room, jsl_emitter emitter, const char *what,
                       jsl_emitter_columns *e) {
    jsl_rows rows;
    if (!jsl_entity_has(room->ecs, emitter.entity, room->emitter))
        return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_HANDLE,
                        "%s: entity %u is not a living emitter", what, emitter.entity.index);
    JSL_TRY(rows_of(room, emitter.entity, room->emitter, &rows));
    *e = jsl_emitter_of(&rows, 0);
    return JSL_OK;
}

static jsl_result set_look(jsl_particle_room *room, jsl_entity entity, const jsl_emitter_desc *d) {
    jsl_rows rows;
    if (d->key_count == 0) return jsl_entity_remove(room->ecs, entity, &room->look, 1);
    JSL_TRY(jsl_entity_add(room->ecs, entity, &room->look, 1));
    JSL_TRY(rows_of(room, entity, room->look, &rows));
    write_look(&rows, d);
    return JSL_OK;
}

/* The pose from which births of the next step start. */
static void remember_pose(jsl_particle_room *room, jsl_entity entity) {
    jsl_rows er, pr, qr;
    if (rows_of(room, entity, room->emitter, &er) != JSL_OK ||
        rows_of(room, entity, room->position, &pr) != JSL_OK ||
        rows_of(room, entity, room->orientation, &qr) != JSL_OK)
        return;
    jsl_emitter_columns e = jsl_emitter_of(&er, 0);
    jsl_position_columns p = jsl_position_of(&pr, 0);
    jsl_orientation_columns q = jsl_orientation_of(&qr, 0);
    *e.was_px = *p.px;
    *e.was_py = *p.py;
    *e.was_pz = *p.pz;
    *e.was_qx = *q.qx;
    *e.was_qy = *q.qy;
    *e.was_qz = *q.qz;
    *e.was_qw = *q.qw;
}

static jsl_quat orientation_or_identity(jsl_quat q) {
    bool zero = q.x == 0 && q.y == 0 && q.z == 0 && q.w == 0;
    return zero ? jsl_quat_identity() : jsl_quat_normalize(q);
}

jsl_result jsl_particle_room_emitter_add(jsl_particle_room *room, jsl_entity entity,
                                         const jsl_emitter_desc *desc, jsl_emitter *out) {
    const jsl_logger *log = jsl_ecs_logger(room->ecs);
    JSL_TRY(jsl_emitter_desc_check(log, desc));
    if (!jsl_entity_is_alive(room->ecs, entity))
        return jsl_fail(log, JSL_ERR_HANDLE, "emitter: entity %u is not alive", entity.index);
    if (jsl_entity_has(room->ecs, entity, room->emitter))
        return jsl_fail(log, JSL_ERR_STATE, "emitter: entity %u is one already", entity.index);
    bool turned = jsl_entity_has(room->ecs, entity, room->orientation);
    const jsl_component set[] = {room->emitter, room->position, room->orientation, room->velocity,
                                 room->look};
    jsl_rows rows;
    JSL_TRY(jsl_entity_add(room->ecs, entity, set, desc->key_count > 0 ? 5 : 4));
    JSL_TRY(rows_of(room, entity, room->emitter, &rows));
    jsl_emitter_columns e = jsl_emitter_of(&rows, 0);
    write_emitter(&e, desc);
    if (!turned) *(jsl_real *)jsl_entity_field(room->ecs, entity, room->orientation, 3) = 1;
    if (desc->key_count > 0) {
        JSL_TRY(rows_of(room, entity, room->look, &rows));
        write_look(&rows, desc);
    }
    remember_pose(room, entity);
    if (out) *out = (jsl_emitter){entity};
    return JSL_OK;
}

jsl_result jsl_particle_room_emitter_create(jsl_particle_room *room, const jsl_emitter_desc *desc,
                                            jsl_emitter *out) {
    JSL_TRY(jsl_emitter_desc_check(jsl_ecs_logger(room->ecs), desc));
    const jsl_component set[] = {room->emitter, room->position, room->orientation, room->velocity,
                                 room->look};
    jsl_entity entity;
    jsl_rows rows;
    JSL_TRY(jsl_entity_create_n(room->ecs, set, desc->key_count > 0 ? 5 : 4, 1, &entity, &rows));
    jsl_emitter_columns e = jsl_emitter_of(&rows, 0);
    jsl_position_columns p = jsl_position_of(&rows, 1);
    jsl_orientation_columns q = jsl_orientation_of(&rows, 2);
    jsl_velocity_columns v = jsl_velocity_of(&rows, 3);
    write_emitter(&e, desc);
    *p.px = desc->position.x;
    *p.py = desc->position.y;
    *p.pz = desc->position.z;
    jsl_quat turn = orientation_or_identity(desc->orientation);
    *q.qx = turn.x;
    *q.qy = turn.y;
    *q.qz = turn.z;
    *q.qw = turn.w;
    *v.vx = desc->velocity.x;
    *v.vy = desc->velocity.y;
    *v.vz = desc->velocity.z;
    if (desc->key_count > 0) {
        JSL_TRY(rows_of(room, entity, room->look, &rows));
        write_look(&rows, desc);
    }
    remember_pose(room, entity);
    if (out) *out = (jsl_emitter){entity};
    return JSL_OK;
}

jsl_result jsl_particle_room_emitter_set(jsl_particle_room *room, jsl_emitter emitter,
                                         const jsl_emitter_desc *desc) {
    jsl_emitter_columns e;
    JSL_TRY(find(room, emitter, "jsl_emitter_set", &e));
    JSL_TRY(jsl_emitter_desc_check(jsl_ecs_logger(room->ecs), desc));
    JSL_TRY(set_look(room, emitter.entity, desc));
    JSL_TRY(find(room, emitter, "jsl_emitter_set", &e)); /* the row may have moved */
    write_emitter(&e, desc);
    return JSL_OK;
}

jsl_result jsl_particle_room_emitter_get(jsl_particle_room *room, jsl_emitter emitter,
                                         jsl_emitter_desc *out) {
    jsl_emitter_columns e;
    jsl_rows rows;
    JSL_TRY(find(room, emitter, "jsl_emitter_get", &e));
    if (!out) return JSL_ERR_ARGUMENT;
    jsl_emitter_desc d = read_emitter(&e);
    if (jsl_entity_has(room->ecs, emitter.entity, room->look)) {
        JSL_TRY(rows_of(room, emitter.entity, room->look, &rows));
        read_look(&rows, &d);
    }
    JSL_TRY(rows_of(room, emitter.entity, room->position, &rows));
    jsl_position_columns p = jsl_position_of(&rows, 0);
    d.position = jsl_v3(*p.px, *p.py, *p.pz);
    JSL_TRY(rows_of(room, emitter.entity, room->orientation, &rows));
    jsl_orientation_columns q = jsl_orientation_of(&rows, 0);
    d.orientation = (jsl_quat){*q.qx, *q.qy, *q.qz, *q.qw};
    JSL_TRY(rows_of(room, emitter.entity, room->velocity, &rows));
    jsl_velocity_columns v = jsl_velocity_of(&rows, 0);
    d.velocity = jsl_v3(*v.vx, *v.vy, *v.vz);
    *out = d;
    return JSL_OK;
}

jsl_result jsl_particle_room_emitter_destroy(jsl_particle_room *room, jsl_emitter emitter) {
    jsl_emitter_columns e;
    JSL_TRY(find(room, emitter, "jsl_emitter_destroy", &e));
    return jsl_entity_destroy(room->ecs, emitter.entity);
}

jsl_result jsl_particle_room_emit(jsl_particle_room *room, jsl_emitter emitter, int64_t n) {
    const jsl_logger *log = jsl_ecs_logger(room->ecs);
    jsl_emitter_columns e;
    JSL_TRY(find(room, emitter, "jsl_emit", &e));
    if (n < 0)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "jsl_emit: n is %lld, it must not be negative",
                        (long long)n);
    if ((uint64_t)n > MAX_WAITING || *e.waiting > MAX_WAITING - (uint64_t)n)
        return jsl_fail(log, JSL_ERR_LIMIT, "jsl_emit: more than 2^40 births would wait");
    *e.waiting += (uint64_t)n;
    return JSL_OK;
}

jsl_result jsl_particle_room_emitter_alive(jsl_particle_room *room, jsl_emitter emitter,
                                           int64_t *out) {
    jsl_emitter_columns e;
    JSL_TRY(find(room, emitter, "jsl_emitter_alive", &e));
    if (!out) return JSL_ERR_ARGUMENT;
    *out = (int64_t)*e.alive;
    return JSL_OK;
}
