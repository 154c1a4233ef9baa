/* SPDX-License-Identifier: MIT
 * body.c - creating bodies, reading and changing them.
 */
#include "rigid/room.h"

/* The set of components by kind: what cannot move carries no velocity, spin or mass. */
static int set_of(const jsl_rigid_room *room, const jsl_rigid_body_desc *d, jsl_component set[8]) {
    int n = 0;
    set[n++] = room->position;
    set[n++] = room->orientation;
    set[n++] = room->body;
    if (d->shape) set[n++] = room->collider;
    if (d->body.kind != JSL_BODY_STATIC) {
        set[n++] = room->velocity;
        set[n++] = room->spin;
        set[n++] = room->mass;
    }
    return n;
}

/* -- Checks ---------------------------------------------------------------------------------- */

typedef struct checker {
    const jsl_logger *log;
    int64_t index; /* of the desc; -1: a single one */
} checker;

static jsl_result refuse(const checker *c, jsl_result code, const char *field, const char *why) {
    if (c->index < 0) return jsl_fail(c->log, code, "body: %s %s", field, why);
    return jsl_fail(c->log, code, "body %lld of the list: %s %s", (long long)c->index, field, why);
}

static jsl_result check_finite(const checker *c, const jsl_body_desc *d) {
    const struct {
        const char *name;
        jsl_real sum;
    } field[] = {
        {"position", d->position.x + d->position.y + d->position.z},
        {"orientation", d->orientation.x + d->orientation.y + d->orientation.z + d->orientation.w},
        {"velocity", d->velocity.x + d->velocity.y + d->velocity.z},
        {"spin", d->spin.x + d->spin.y + d->spin.z},
        {"mass", d->mass},
        {"density", d->density},
        {"inertia", d->inertia.x + d->inertia.y + d->inertia.z},
        {"gravity_scale", d->gravity_scale},
        {"linear_damping", d->linear_damping},
        {"angular_damping", d->angular_damping},
    };
    for (int i = 0; i < JSL_COUNT(field); i++)
        if (!jsl_is_finite(field[i].sum))
            return refuse(c, JSL_ERR_NOT_FINITE, field[i].name, "is not finite");
    return JSL_OK;
}

static bool zero3(jsl_vec3 v) { return v.x == 0 && v.y == 0 && v.z == 0; }

static jsl_result check_orientation(const checker *c, jsl_quat q, jsl_quat *out) {
    *out = jsl_quat_identity();
    if (q.x == 0 && q.y == 0 && q.z == 0 && q.w == 0) return JSL_OK;
    jsl_real square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (!(jsl_abs(square - 1) < JSL_R(0.02)))
        return refuse(c, JSL_ERR_ARGUMENT, "orientation", "is not a unit quaternion");
    *out = jsl_quat_normalize(q);
    return JSL_OK;
}

static jsl_result check_mass(const checker *c, const jsl_rigid_body_desc *rd,
                             jsl_mass_properties *out) {
    const jsl_body_desc *d = &rd->body;
    *out = (jsl_mass_properties){0};
    if (d->mass < 0) return refuse(c, JSL_ERR_ARGUMENT, "mass", "must be positive");
    if (d->density < 0) return refuse(c, JSL_ERR_ARGUMENT, "density", "must be positive");
    jsl_vec3 i = d->inertia;
    if (i.x < 0 || i.y < 0 || i.z < 0)
        return refuse(c, JSL_ERR_ARGUMENT, "inertia", "must not be negative");
    if (d->kind != JSL_BODY_DYNAMIC) {
        if (d->mass > 0 || d->density > 0 || !zero3(i))
            return refuse(c, JSL_ERR_CONFLICT, "mass", "is for dynamic bodies only");
        return JSL_OK;
    }
    if (d->mass > 0 && d->density > 0)
        return refuse(c, JSL_ERR_CONFLICT, "density", "excludes mass");
    if (!zero3(i)) {
        jsl_real slack = 1 + 16 * JSL_REAL_EPSILON;
        if (!(i.x > 0 && i.y > 0 && i.z > 0))
            return refuse(c, JSL_ERR_ARGUMENT, "inertia", "must be positive about all three axes");
        if (i.x > (i.y + i.z) * slack || i.y > (i.z + i.x) * slack || i.z > (i.x + i.y) * slack)
            return refuse(c, JSL_ERR_ARGUMENT, "inertia", "breaks i + j >= k: no body has it");
    }
    if (!rd->shape) {
        if (!(d->mass > 0)) return refuse(c, JSL_ERR_ARGUMENT, "mass", "is needed without a shape");
        if (zero3(i)) return refuse(c, JSL_ERR_ARGUMENT, "inertia", "is needed without a shape");
        *out = (jsl_mass_properties){0, d->mass, i};
        return JSL_OK;
    }
    jsl_real density = d->density > 0 ? d->density : JSL_DENSITY_DEFAULT;
    if (jsl_shape_mass(rd->shape, density, out) != JSL_OK)
        return refuse(c, JSL_ERR_ARGUMENT, "shape",
                      "has no volume: only a static body can have it");
    if (d->mass > 0) {
        jsl_real scale = d->mass / out->mass;
        out->mass = d->mass;
        out->inertia = jsl_scale(out->inertia, scale);
    }
    if (!zero3(i)) out->inertia = i;
    bool usable = out->mass > 0 && jsl_is_finite(1 / out->mass) && jsl_is_finite(out->mass) &&
                  jsl_is_finite(1 / out->inertia.x) && jsl_is_finite(1 / out->inertia.y) &&
                  jsl_is_finite(1 / out->inertia.z);
    if (!usable)
        return refuse(c, JSL_ERR_ARGUMENT, "mass", "or inertia is beyond the scalar's range");
    return JSL_OK;
}

static jsl_result check(const checker *c, const jsl_rigid_body_desc *rd, jsl_quat *orientation,
                        jsl_mass_properties *mass) {
    const jsl_body_desc *d = &rd->body;
    if ((int)d->kind < 0 || d->kind >= JSL_BODY_KIND_COUNT)
        return refuse(c, JSL_ERR_ARGUMENT, "kind", "is unknown");
    JSL_TRY(check_finite(c, d));
    if (rd->shape && jsl_shape_check(rd->shape) != JSL_OK)
        return refuse(c, JSL_ERR_ARGUMENT, "shape", "is not valid");
    JSL_TRY(check_orientation(c, d->orientation, orientation));
    if (d->kind == JSL_BODY_STATIC && !(zero3(d->velocity) && zero3(d->spin)))
        return refuse(c, JSL_ERR_CONFLICT, zero3(d->velocity) ? "spin" : "velocity",
                      "of a static body must be 0");
    if (rd->shape && rd->shape->kind == JSL_SHAPE_PLANE && d->kind != JSL_BODY_STATIC)
        return refuse(c, JSL_ERR_CONFLICT, "shape", "is a plane: only a static body can have it");
    if (d->no_gravity && d->gravity_scale != 0)
        return refuse(c, JSL_ERR_CONFLICT, "gravity_scale", "excludes no_gravity");
    if (d->linear_damping < 0)
        return refuse(c, JSL_ERR_ARGUMENT, "linear_damping", "must not be negative");
    if (d->angular_damping < 0)
        return refuse(c, JSL_ERR_ARGUMENT, "angular_damping", "must not be negative");
    return check_mass(c, rd, mass);
}

/* -- Creation -------------------------------------------------------------------------------- */

static jsl_real *real_field(jsl_rigid_room *room, jsl_entity e, jsl_component c, int field) {
    return jsl_entity_field(room->ecs, e, c, field);
}
static void set_fields(jsl_rigid_room *room, jsl_entity e, jsl_component c, int first,
                       const jsl_real *value, int count) {
    for (int k = 0; k < count; k++) *real_field(room, e, c, first + k) = value[k];
}
/* Field numbers, as the rows stand in components.h. */
enum { BODY_KIND, BODY_FLAGS, BODY_FORCE = 5, BODY_TORQUE = 8 };

/* Columns of rows made by set_of, term by term. */
typedef struct columns {
    jsl_position_columns x;
    jsl_orientation_columns q;
    jsl_body_columns body;
    jsl_collider_columns collider;
    jsl_velocity_columns v;
    jsl_spin_columns w;
    jsl_mass_columns mass;
} columns;

static columns columns_of(const jsl_rows *rows, const jsl_rigid_body_desc *d) {
    columns c = {.x = jsl_position_of(rows, 0),
                 .q = jsl_orientation_of(rows, 1),
                 .body = jsl_body_of(rows, 2)};
    int term = 3;
    if (d->shape) c.collider = jsl_collider_of(rows, term++);
    if (d->body.kind == JSL_BODY_STATIC) return c;
    c.v = jsl_velocity_of(rows, term);
    c.w = jsl_spin_of(rows, term + 1);
    c.mass = jsl_mass_of(rows, term + 2);
    return c;
}

/* Fields that are not set stay zero, as they were made. */
static void fill(const columns *c, int64_t r, const jsl_rigid_body_desc *rd, jsl_quat q,
                 const jsl_mass_properties *mass) {
    const jsl_body_desc *d = &rd->body;
    c->x.px[r] = d->position.x, c->x.py[r] = d->position.y, c->x.pz[r] = d->position.z;
    c->q.qx[r] = q.x, c->q.qy[r] = q.y, c->q.qz[r] = q.z, c->q.qw[r] = q.w;
    c->body.kind[r] = (uint32_t)d->kind;
    c->body.gravity_scale[r] = d->no_gravity ? 0 : d->gravity_scale == 0 ? 1 : d->gravity_scale;
    c->body.linear_damping[r] = d->linear_damping;
    c->body.angular_damping[r] = d->angular_damping;
    if (rd->shape) {
        c->collider.shape[r] = d->shape.id;
        c->collider.material[r] = d->material.id;
        c->collider.category[r] = d->category ? d->category : 1;
        c->collider.mask[r] = d->mask ? d->mask : ~0u;
    }
    if (d->kind == JSL_BODY_STATIC) return;
    c->v.vx[r] = d->velocity.x, c->v.vy[r] = d->velocity.y, c->v.vz[r] = d->velocity.z;
    c->w.wx[r] = d->spin.x, c->w.wy[r] = d->spin.y, c->w.wz[r] = d->spin.z;
    if (d->kind != JSL_BODY_DYNAMIC) return;
    c->mass.inv_mass[r] = 1 / mass->mass;
    c->mass.inv_ixx[r] = 1 / mass->inertia.x;
    c->mass.inv_iyy[r] = 1 / mass->inertia.y;
    c->mass.inv_izz[r] = 1 / mass->inertia.z;
}

/* As many descs from the first on as have the same components are made at once. */
static jsl_result create_run(jsl_rigid_room *room, const checker *c,
                             const jsl_rigid_body_desc *desc, int64_t count, jsl_entity *made,
                             int64_t *done) {
    jsl_component set[8], other[8];
    int n = set_of(room, &desc[0], set);
    int64_t run = 1;
    while (run < count && set_of(room, &desc[run], other) == n &&
           memcmp(set, other, (size_t)n * sizeof *set) == 0)
        run++;
    jsl_rows rows;
    JSL_TRY(jsl_entity_create_n(room->ecs, set, n, run, made, &rows));
    *done += run;
    columns to = columns_of(&rows, &desc[0]);
    for (int64_t r = 0; r < run; r++) {
        jsl_quat q;
        jsl_mass_properties mass;
        JSL_TRY(check(c, &desc[r], &q, &mass)); /* passed before: for what it derives */
        fill(&to, r, &desc[r], q, &mass);
    }
    return JSL_OK;
}

jsl_result jsl_rigid_body_create_n(jsl_rigid_room *room, const jsl_rigid_body_desc *desc,
                                   int64_t count, jsl_body *out) {
    checker c = {jsl_ecs_logger(room->ecs), -1};
    if (count < 0 || (count > 0 && !desc))
        return refuse(&c, JSL_ERR_ARGUMENT, "count", "or desc is missing");
    jsl_quat q;
    jsl_mass_properties mass;
    for (int64_t i = 0; i < count; i++) {
        c.index = count == 1 ? -1 : i;
        JSL_TRY(check(&c, &desc[i], &q, &mass));
    }
    if (count == 0) return JSL_OK;
    jsl_entity *made = jsl_alloc(room->memory, (size_t)count * sizeof *made);
    if (!made)
        return jsl_fail(c.log, JSL_ERR_MEMORY, "body: out of memory for %lld handles",
                        (long long)count);
    jsl_result result = JSL_OK;
    int64_t done = 0;
    while (done < count && result == JSL_OK)
        result = create_run(room, &c, desc + done, count - done, made + done, &done);
    if (result != JSL_OK && done > 0) (void)jsl_entity_destroy_n(room->ecs, made, done);
    for (int64_t i = 0; out && result == JSL_OK && i < count; i++) out[i].entity = made[i];
    jsl_free(room->memory, made, (size_t)count * sizeof *made);
    return result;
}

jsl_result jsl_rigid_body_create(jsl_rigid_room *room, const jsl_rigid_body_desc *desc,
                                 jsl_body *out) {
    return jsl_rigid_body_create_n(room, desc, 1, out);
}

/* -- Access ---------------------------------------------------------------------------------- */

static jsl_result valid(jsl_rigid_room *room, jsl_body body, const char *what) {
    if (jsl_entity_has(room->ecs, body.entity, room->body)) return JSL_OK;
    return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_HANDLE,
                    "%s: body %u/%u is null, stale or no body", what, body.entity.index,
                    body.entity.generation);
}
static jsl_vec3 get3(jsl_rigid_room *room, jsl_entity e, jsl_component c, int first) {
    return jsl_v3(*real_field(room, e, c, first), *real_field(room, e, c, first + 1),
                  *real_field(room, e, c, first + 2));
}
static void put3(jsl_rigid_room *room, jsl_entity e, jsl_component c, int first, jsl_vec3 v) {
    set_fields(room, e, c, first, (jsl_real[]){v.x, v.y, v.z}, 3);
}
static jsl_quat get_turn(jsl_rigid_room *room, jsl_entity e) {
    jsl_vec3 v = get3(room, e, room->orientation, 0);
    return (jsl_quat){v.x, v.y, v.z, *real_field(room, e, room->orientation, 3)};
}
static uint32_t *flags_of(jsl_rigid_room *room, jsl_entity e) {
    return jsl_entity_field(room->ecs, e, room->body, BODY_FLAGS);
}
static jsl_body_kind kind_of(jsl_rigid_room *room, jsl_entity e) {
    return (jsl_body_kind) * (uint32_t *)jsl_entity_field(room->ecs, e, room->body, BODY_KIND);
}
static jsl_result finite3(jsl_rigid_room *room, jsl_vec3 v, const char *what, const char *field) {
    if (jsl_v3_is_finite(v)) return JSL_OK;
    return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_NOT_FINITE, "%s: %s is not finite", what,
                    field);
}
static jsl_result need_dynamic(jsl_rigid_room *room, jsl_body body, const char *what) {
    JSL_TRY(valid(room, body, what));
    if (kind_of(room, body.entity) == JSL_BODY_DYNAMIC) return JSL_OK;
    return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_STATE, "%s: body %u is not dynamic", what,
                    body.entity.index);
}

jsl_result jsl_rigid_body_destroy(jsl_rigid_room *room, jsl_body body) {
    JSL_TRY(valid(room, body, "body destroy"));
    return jsl_entity_destroy(room->ecs, body.entity);
}

jsl_result jsl_rigid_body_get(jsl_rigid_room *room, jsl_body body, jsl_body_state *out) {
    JSL_TRY(valid(room, body, "body get"));
    jsl_entity e = body.entity;
    *out = (jsl_body_state){.kind = kind_of(room, e),
                            .pose = {get3(room, e, room->position, 0), get_turn(room, e)},
                            .flags = *flags_of(room, e)};
    if (!jsl_entity_has(room->ecs, e, room->velocity)) return JSL_OK;
    out->velocity = get3(room, e, room->velocity, 0);
    out->spin = get3(room, e, room->spin, 0);
    jsl_real m = *real_field(room, e, room->mass, 0);
    jsl_vec3 i = get3(room, e, room->mass, 1);
    out->mass = m > 0 ? 1 / m : 0;
    out->inertia = jsl_v3(i.x > 0 ? 1 / i.x : 0, i.y > 0 ? 1 / i.y : 0, i.z > 0 ? 1 / i.z : 0);
    return JSL_OK;
}

jsl_result jsl_rigid_body_set_pose(jsl_rigid_room *room, jsl_body body, jsl_pose pose) {
    JSL_TRY(valid(room, body, "body pose"));
    JSL_TRY(finite3(room, pose.position, "body pose", "position"));
    checker c = {jsl_ecs_logger(room->ecs), -1};
    jsl_quat q = pose.orientation;
    if (!jsl_is_finite(q.x + q.y + q.z + q.w))
        return refuse(&c, JSL_ERR_NOT_FINITE, "orientation", "is not finite");
    JSL_TRY(check_orientation(&c, pose.orientation, &q));
    put3(room, body.entity, room->position, 0, pose.position);
    set_fields(room, body.entity, room->orientation, 0, (jsl_real[]){q.x, q.y, q.z, q.w}, 4);
    *flags_of(room, body.entity) &= ~JSL_BODY_FROZEN;
    return JSL_OK;
}

jsl_result jsl_rigid_body_set_velocity(jsl_rigid_room *room, jsl_body body, jsl_vec3 velocity,
                                       jsl_vec3 spin) {
    JSL_TRY(valid(room, body, "body velocity"));
    JSL_TRY(finite3(room, velocity, "body velocity", "velocity"));
    JSL_TRY(finite3(room, spin, "body velocity", "spin"));
    if (kind_of(room, body.entity) == JSL_BODY_STATIC)
        return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_STATE,
                        "body velocity: body %u is static", body.entity.index);
    put3(room, body.entity, room->velocity, 0, velocity);
    put3(room, body.entity, room->spin, 0, spin);
    *flags_of(room, body.entity) &= ~JSL_BODY_FROZEN;
    return JSL_OK;
}

static jsl_result add3(jsl_rigid_room *room, jsl_body body, int field, jsl_vec3 v, const char *what,
                       const char *name) {
    JSL_TRY(need_dynamic(room, body, what));
    JSL_TRY(finite3(room, v, what, name));
    put3(room, body.entity, room->body, field,
         jsl_add(get3(room, body.entity, room->body, field), v));
    return JSL_OK;
}
jsl_result jsl_rigid_body_add_force(jsl_rigid_room *room, jsl_body body, jsl_vec3 force) {
    return add3(room, body, BODY_FORCE, force, "body force", "force");
}
jsl_result jsl_rigid_body_add_torque(jsl_rigid_room *room, jsl_body body, jsl_vec3 torque) {
    return add3(room, body, BODY_TORQUE, torque, "body torque", "torque");
}
jsl_result jsl_rigid_body_add_force_at(jsl_rigid_room *room, jsl_body body, jsl_vec3 force,
                                       jsl_vec3 point) {
    JSL_TRY(need_dynamic(room, body, "body force"));
    JSL_TRY(finite3(room, force, "body force", "force"));
    JSL_TRY(finite3(room, point, "body force", "point"));
    jsl_vec3 arm = jsl_sub(point, get3(room, body.entity, room->position, 0));
    jsl_vec3 torque = jsl_cross(arm, force);
    JSL_TRY(finite3(room, torque, "body force", "torque"));
    JSL_TRY(jsl_rigid_body_add_force(room, body, force));
    return jsl_rigid_body_add_torque(room, body, torque);
}

jsl_result jsl_rigid_body_apply_impulse(jsl_rigid_room *room, jsl_body body, jsl_vec3 impulse,
                                        jsl_vec3 point) {
    JSL_TRY(need_dynamic(room, body, "body impulse"));
    JSL_TRY(finite3(room, impulse, "body impulse", "impulse"));
    JSL_TRY(finite3(room, point, "body impulse", "point"));
    jsl_entity e = body.entity;
    jsl_vec3 arm = jsl_sub(point, get3(room, e, room->position, 0)),
             inv = get3(room, e, room->mass, 1);
    jsl_quat q = get_turn(room, e);
    jsl_vec3 local = jsl_rotate_inv(q, jsl_cross(arm, impulse));
    jsl_vec3 dw = jsl_rotate(q, jsl_v3(inv.x * local.x, inv.y * local.y, inv.z * local.z));
    jsl_vec3 v =
        jsl_mul_add(get3(room, e, room->velocity, 0), *real_field(room, e, room->mass, 0), impulse);
    jsl_vec3 w = jsl_add(get3(room, e, room->spin, 0), dw);
    JSL_TRY(finite3(room, v, "body impulse", "velocity"));
    JSL_TRY(finite3(room, w, "body impulse", "spin"));
    put3(room, e, room->velocity, 0, v);
    put3(room, e, room->spin, 0, w);
    return JSL_OK;
}
