/* SPDX-License-Identifier: MIT
 * What is solid: shapes, materials, and the set of placed colliders that every room reads.
 */
#include "world/world_internal.h"

/* Boxes are grown by this much beyond the motion of a step, so that things about to touch are
 * found. */
#define COLLIDER_MARGIN JSL_R(0.02)

/* -- Shapes and materials
 * ------------------------------------------------------------------------------ */

jsl_result jsl_shape_create(jsl_world *w, const jsl_shape_desc *desc, jsl_shape *out) {
    if (!w || !desc || !out) return jsl_world_bad_argument(w, "jsl_shape_create", "null argument");
    *out = (jsl_shape){0};
    jsl_result result = jsl_shape_check(desc);
    if (result != JSL_OK)
        return jsl_fail(&w->settings.logger, result, "shape %s: %s (radius %g, half %g %g %g)",
                        jsl_shape_kind_text(desc->kind), jsl_result_text(result),
                        (double)desc->radius, (double)desc->half.x, (double)desc->half.y,
                        (double)desc->half.z);
    for (int64_t i = 0; i < w->shape.count; i++) {
        const jsl_shape_desc *s = &w->shape.at[i];
        if (s->kind == desc->kind && s->radius == desc->radius && s->half.x == desc->half.x &&
            s->half.y == desc->half.y && s->half.z == desc->half.z) {
            out->id = (uint32_t)i + 1;
            return JSL_OK;
        }
    }
    JSL_TRY(jsl_array_reserve(w->memory, &w->shape, w->shape.count + 1));
    w->shape.at[w->shape.count++] = *desc;
    out->id = (uint32_t)w->shape.count;
    return JSL_OK;
}

jsl_result jsl_shape_get(const jsl_world *w, jsl_shape shape, jsl_shape_desc *out) {
    if (!w || !out) return JSL_ERR_ARGUMENT;
    if (shape.id == 0 || shape.id > w->shape.count)
        return jsl_fail(&w->settings.logger, JSL_ERR_HANDLE, "shape %u does not exist", shape.id);
    *out = w->shape.at[shape.id - 1];
    return JSL_OK;
}

int jsl_shape_count(const jsl_world *w) { return w ? (int)w->shape.count : 0; }

jsl_result jsl_material_create(jsl_world *w, const jsl_material_desc *desc, jsl_material *out) {
    if (!w || !desc || !out)
        return jsl_world_bad_argument(w, "jsl_material_create", "null argument");
    *out = (jsl_material){0};
    if (!jsl_is_finite(desc->friction) || !jsl_is_finite(desc->restitution))
        return jsl_fail(&w->settings.logger, JSL_ERR_NOT_FINITE,
                        "material: a number is not finite");
    if (desc->friction < 0 || desc->restitution < 0 || desc->restitution > 1)
        return jsl_fail(&w->settings.logger, JSL_ERR_ARGUMENT,
                        "material: friction %g must be >= 0, restitution %g in 0..1",
                        (double)desc->friction, (double)desc->restitution);
    for (int64_t i = 0; i < w->material.count; i++)
        if (w->material.at[i].friction == desc->friction &&
            w->material.at[i].restitution == desc->restitution) {
            out->id = (uint32_t)i + 1;
            return JSL_OK;
        }
    JSL_TRY(jsl_array_reserve(w->memory, &w->material, w->material.count + 1));
    w->material.at[w->material.count++] = *desc;
    out->id = (uint32_t)w->material.count;
    return JSL_OK;
}

jsl_result jsl_material_get(const jsl_world *w, jsl_material material, jsl_material_desc *out) {
    if (!w || !out) return JSL_ERR_ARGUMENT;
    if (material.id > w->material.count)
        return jsl_fail(&w->settings.logger, JSL_ERR_HANDLE, "material %u does not exist",
                        material.id);
    *out = material.id ? w->material.at[material.id - 1] : (jsl_material_desc){JSL_R(0.6), 0};
    return JSL_OK;
}

/* -- The set
 * -----------------------------------------------------------------------------------------------
 */

static jsl_collider_item make_item(const jsl_world *w, const jsl_rows *rows, int64_t i) {
    jsl_position_columns p = jsl_position_of(rows, 0);
    jsl_collider_columns c = jsl_collider_of(rows, 1);
    jsl_collider_item item = {.entity = rows->entity[i],
                              .pose = {{p.px[i], p.py[i], p.pz[i]}, jsl_quat_identity()},
                              .category = c.category[i],
                              .mask = c.mask[i],
                              .shape_id = c.shape[i],
                              .table = rows->table,
                              .row = (int32_t)(rows->begin + i)};
    if (rows->present >> 2 & 1) {
        jsl_orientation_columns q = jsl_orientation_of(rows, 2);
        item.pose.orientation = (jsl_quat){q.qx[i], q.qy[i], q.qz[i], q.qw[i]};
    }
    if (rows->present >> 3 & 1) {
        jsl_velocity_columns v = jsl_velocity_of(rows, 3);
        item.velocity = jsl_v3(v.vx[i], v.vy[i], v.vz[i]);
    }
    if (rows->present >> 4 & 1) {
        jsl_spin_columns s = jsl_spin_of(rows, 4);
        item.spin = jsl_v3(s.wx[i], s.wy[i], s.wz[i]);
    }
    if (rows->present >> 5 & 1) item.inv_mass = jsl_mass_of(rows, 5).inv_mass[i];
    if (item.shape_id >= 1 && item.shape_id <= w->shape.count) {
        item.shape = w->shape.at[item.shape_id - 1];
        item.radius = jsl_shape_radius(&item.shape);
    }
    jsl_material_desc material = {JSL_R(0.6), 0};
    if (c.material[i] >= 1 && c.material[i] <= w->material.count)
        material = w->material.at[c.material[i] - 1];
    item.friction = material.friction;
    item.restitution = material.restitution;
    return item;
}

/* Puts the items in order of entity id, so that nothing downstream depends on the order of tables
 * or rows. */
static jsl_result sort_items(jsl_world *w, jsl_collider_item *item, int64_t count) {
    bool sorted = true;
    for (int64_t i = 1; i < count && sorted; i++)
        sorted = jsl_entity_id(item[i - 1].entity) < jsl_entity_id(item[i].entity);
    if (sorted) return JSL_OK;
    jsl_arena_mark mark = jsl_arena_save(&w->arena);
    uint64_t *key = JSL_ARENA_NEW(&w->arena, uint64_t, 2 * count);
    uint32_t *order = JSL_ARENA_NEW(&w->arena, uint32_t, 2 * count);
    jsl_collider_item *copy = JSL_ARENA_NEW(&w->arena, jsl_collider_item, count);
    if (!key || !order || !copy) {
        jsl_arena_rewind(&w->arena, mark);
        return jsl_fail(&w->settings.logger, JSL_ERR_MEMORY, "out of memory sorting %lld colliders",
                        (long long)count);
    }
    for (int64_t i = 0; i < count; i++) {
        key[i] = jsl_entity_id(item[i].entity);
        order[i] = (uint32_t)i;
    }
    memcpy(copy, item, (size_t)count * sizeof *item);
    jsl_sort_u64(key, order, key + count, order + count, count);
    for (int64_t i = 0; i < count; i++) item[i] = copy[order[i]];
    jsl_arena_rewind(&w->arena, mark);
    return JSL_OK;
}

jsl_result jsl_world_index_colliders(jsl_world *w, jsl_real dt) {
    jsl_collider_set *set = &w->colliders;
    JSL_TRY(jsl_array_reserve(w->memory, &set->item, jsl_query_count(w->ecs, w->solid)));
    set->item.count = 0;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(w->ecs, w->solid, 0); jsl_query_next(&it, &rows);)
        for (int64_t i = 0; i < rows.count; i++) {
            jsl_collider_item item = make_item(w, &rows, i);
            if (item.shape.kind != JSL_SHAPE_NONE) set->item.at[set->item.count++] = item;
        }
    JSL_TRY(sort_items(w, set->item.at, set->item.count));
    uint64_t key = (uint64_t)set->item.count;
    for (int64_t i = 0; i < set->item.count; i++)
        key = jsl_mix64(key ^ jsl_entity_id(set->item.at[i].entity)) + set->item.at[i].shape_id;
    if (key != w->colliders_key) set->revision++;
    w->colliders_key = key;
    return jsl_collider_set_index(w->memory, set, dt, COLLIDER_MARGIN);
}
