/* SPDX-License-Identifier: MIT
 * rigid_scene.c - see rigid_scene.h.
 */
#include "rigid_scene.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>

/* Failures here are of the test itself. */
#define MUST(expr)                                                                                 \
    do {                                                                                           \
        jsl_result must_ = (expr);                                                                 \
        if (must_ != JSL_OK) {                                                                     \
            fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #expr, jsl_result_text(must_)); \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

static void keep_message(jsl_log_level level, jsl_result code, const char *text, void *ctx) {
    (void)level, (void)code;
    rigid_scene *s = ctx;
    snprintf(s->message, sizeof s->message, "%s", text);
}

static jsl_component find(rigid_scene *s, const char *name) {
    jsl_component c = {0};
    MUST(jsl_component_find(s->ecs, name, &c));
    return c;
}

void scene_open(rigid_scene *s, int workers) {
    *s = (rigid_scene){0};
    MUST(jsl_ecs_create(&(jsl_ecs_desc){.logger = {keep_message, s}, .tag = 7}, &s->ecs));
    MUST(jsl_rigid_room_create(s->ecs, &s->room));
    jsl_memory *m = jsl_ecs_memory(s->ecs);
    jsl_arena_init(&s->arena, m);
    MUST(jsl_exec_init(&s->exec, m, (jsl_tasks){0}, workers));
    jsl_query_desc solid = {{{find(s, "position"), JSL_READ},
                             {find(s, "orientation"), JSL_READ},
                             {find(s, "collider"), JSL_READ},
                             {find(s, "velocity"), JSL_READ_IF},
                             {find(s, "spin"), JSL_READ_IF},
                             {find(s, "mass"), JSL_READ_IF}}};
    MUST(jsl_query_create(s->ecs, &solid, &s->solid));
    for (int i = 0; i < SCENE_SHAPES; i++) s->friction[i] = JSL_R(0.6);
    s->context = (jsl_step_context){.dt = JSL_R(1.0) / 60,
                                    .inv_dt = 60,
                                    .substeps = 4,
                                    .workers = workers,
                                    .isa = jsl_isa_resolve(JSL_ISA_AUTO),
                                    .logger = jsl_ecs_logger(s->ecs),
                                    .ecs = s->ecs,
                                    .warnings = &s->warnings,
                                    .exec = &s->exec,
                                    .memory = m,
                                    .arena = &s->arena};
}

void scene_close(rigid_scene *s) {
    jsl_memory *m = jsl_ecs_memory(s->ecs);
    jsl_rigid_room_destroy(s->room);
    jsl_collider_set_free(m, &s->set);
    jsl_array_free(m, &s->key);
    jsl_array_free(m, &s->tmp);
    jsl_array_free(m, &s->order);
    jsl_array_free(m, &s->tmp_order);
    jsl_array_free(m, &s->unsorted);
    jsl_arena_fini(&s->arena);
    jsl_exec_fini(&s->exec, m);
    jsl_ecs_destroy(s->ecs);
}

jsl_shape scene_shape(rigid_scene *s, jsl_shape_desc shape) {
    assert(s->shapes < SCENE_SHAPES);
    s->shape[s->shapes] = shape;
    return (jsl_shape){(uint32_t)++s->shapes};
}
jsl_shape scene_box(rigid_scene *s, jsl_real hx, jsl_real hy, jsl_real hz) {
    return scene_shape(s, (jsl_shape_desc){JSL_SHAPE_BOX, 0, {hx, hy, hz}});
}
jsl_shape scene_sphere(rigid_scene *s, jsl_real radius) {
    return scene_shape(s, (jsl_shape_desc){JSL_SHAPE_SPHERE, radius, {0, 0, 0}});
}
jsl_shape scene_plane(rigid_scene *s) {
    return scene_shape(s, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE});
}

jsl_result scene_try(rigid_scene *s, const jsl_body_desc *desc, jsl_body *out) {
    jsl_rigid_body_desc d = {*desc, desc->shape.id ? &s->shape[desc->shape.id - 1] : NULL};
    return jsl_rigid_body_create(s->room, &d, out);
}
jsl_body scene_body(rigid_scene *s, const jsl_body_desc *desc) {
    jsl_body body = {{0, 0}};
    MUST(scene_try(s, desc, &body));
    return body;
}

static void add_items(rigid_scene *s, const jsl_rows *rows) {
    jsl_position_columns x = jsl_position_of(rows, 0);
    jsl_orientation_columns q = jsl_orientation_of(rows, 1);
    jsl_collider_columns c = jsl_collider_of(rows, 2);
    jsl_velocity_columns v = jsl_velocity_of(rows, 3);
    jsl_spin_columns w = jsl_spin_of(rows, 4);
    jsl_mass_columns m = jsl_mass_of(rows, 5);
    for (int64_t r = 0; r < rows->count; r++) {
        jsl_collider_item item = {
            .entity = rows->entity[r],
            .shape = s->shape[c.shape[r] - 1],
            .pose = {{x.px[r], x.py[r], x.pz[r]}, {q.qx[r], q.qy[r], q.qz[r], q.qw[r]}},
            .friction = s->friction[c.material[r]],
            .restitution = s->restitution[c.material[r]],
            .category = c.category[r],
            .mask = c.mask[r],
            .shape_id = c.shape[r],
            .table = rows->table,
            .row = (int32_t)(rows->begin + r)};
        item.radius = jsl_shape_radius(&item.shape);
        if (v.vx) item.velocity = jsl_v3(v.vx[r], v.vy[r], v.vz[r]);
        if (w.wx) item.spin = jsl_v3(w.wx[r], w.wy[r], w.wz[r]);
        if (m.inv_mass) item.inv_mass = m.inv_mass[r];
        s->key.at[s->unsorted.count] = jsl_entity_id(item.entity);
        s->order.at[s->unsorted.count] = (uint32_t)s->unsorted.count;
        s->unsorted.at[s->unsorted.count++] = item;
    }
}

static void index_colliders(rigid_scene *s) {
    jsl_memory *m = jsl_ecs_memory(s->ecs);
    int64_t n = jsl_query_count(s->ecs, s->solid);
    MUST(jsl_array_reserve(m, &s->unsorted, n));
    MUST(jsl_array_reserve(m, &s->key, n));
    MUST(jsl_array_reserve(m, &s->tmp, n));
    MUST(jsl_array_reserve(m, &s->order, n));
    MUST(jsl_array_reserve(m, &s->tmp_order, n));
    MUST(jsl_array_reserve(m, &s->set.item, n));
    s->unsorted.count = 0;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(s->ecs, s->solid, 0); jsl_query_next(&it, &rows);)
        add_items(s, &rows);
    jsl_sort_u64(s->key.at, s->order.at, s->tmp.at, s->tmp_order.at, n);
    for (int64_t i = 0; i < n; i++) s->set.item.at[i] = s->unsorted.at[s->order.at[i]];
    s->set.item.count = n;
    MUST(jsl_collider_set_index(m, &s->set, s->context.dt, JSL_R(0.02)));
    s->context.colliders = n > 0 ? &s->set : NULL;
}

void scene_step(rigid_scene *s) {
    s->context.inv_dt = s->context.dt > 0 ? 1 / s->context.dt : 0;
    index_colliders(s);
    MUST(jsl_schedule_run(s->ecs, JSL_STAGE_DETECT, &s->context));
    jsl_arena_reset(&s->arena);
    MUST(jsl_schedule_run(s->ecs, JSL_STAGE_RESPOND, &s->context));
    jsl_arena_reset(&s->arena);
    s->context.step++;
    s->context.time += (double)s->context.dt;
}
void scene_steps(rigid_scene *s, int count) {
    while (count-- > 0) scene_step(s);
}

jsl_body_state scene_get(rigid_scene *s, jsl_body body) {
    jsl_body_state state;
    MUST(jsl_rigid_body_get(s->room, body, &state));
    return state;
}
jsl_rigid_measure scene_measure(rigid_scene *s) {
    jsl_rigid_measure measure;
    MUST(jsl_rigid_room_measure(s->room, s->context.gravity, &measure));
    return measure;
}
uint64_t scene_hash(rigid_scene *s) {
    return jsl_mix64(jsl_ecs_hash(s->ecs) ^ jsl_mix64(jsl_rigid_room_hash(s->room)));
}

int64_t scene_pyramid(rigid_scene *s, int base, jsl_body *out) {
    jsl_shape cube = scene_box(s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)),
              slab = scene_box(s, 200, 200, 1);
    scene_body(s, &(jsl_body_desc){.shape = slab, .kind = JSL_BODY_STATIC, .position = {0, 0, -1}});
    int64_t n = 0;
    for (int i = 0; i < base; i++)
        for (int j = i; j < base; j++, n++) {
            jsl_vec3 at = {(jsl_real)((i + 1) * 0.5 + (j - i) - 0.5 * base), 0,
                           (jsl_real)(i + 0.5)};
            jsl_body b =
                scene_body(s, &(jsl_body_desc){.shape = cube, .density = 100, .position = at});
            if (out) out[n] = b;
        }
    return n;
}
