/* SPDX-License-Identifier: MIT */
#include "particle_stage.h"

static void must(bool ok) { assert_true(ok); }

void particle_stage_open(particle_stage *s, int workers) {
    *s = (particle_stage){0};
    jsl_ecs_desc desc = {.allocator = test_allocator(&s->memory), .logger = test_logger(&s->log)};
    desc.tag = 7;
    assert_ok(jsl_ecs_create(&desc, &s->ecs));
    assert_ok(jsl_particle_room_create(s->ecs, &s->room));
    jsl_memory *memory = jsl_ecs_memory(s->ecs);
    jsl_arena_init(&s->arena, memory);
    assert_ok(jsl_exec_init(&s->exec, memory, (jsl_tasks){0}, workers));
    s->context.substeps = 1;
    s->context.seed = 1;
    s->context.gravity = jsl_v3(0, 0, JSL_R(-9.81));
    s->context.isa = jsl_isa_resolve(JSL_ISA_AUTO);
    s->context.workers = workers;
    s->context.ecs = s->ecs;
    s->context.warnings = &s->warnings;
    s->context.exec = &s->exec;
    s->context.memory = memory;
    s->context.arena = &s->arena;
    s->context.colliders = &s->set;
    s->context.wind = &s->wind;
    particle_stage_set_dt(s, 1.0 / 60);
    assert_ok(jsl_component_find(s->ecs, "position", &s->position));
    assert_ok(jsl_component_find(s->ecs, "orientation", &s->orientation));
    assert_ok(jsl_component_find(s->ecs, "velocity", &s->velocity));
    assert_ok(jsl_component_find(s->ecs, "particle", &s->particle));
    jsl_query_desc query = {
        .terms = {{s->position, JSL_WRITE}, {s->velocity, JSL_WRITE}, {s->particle, JSL_WRITE}}};
    assert_ok(jsl_query_create(s->ecs, &query, &s->particles));
}

void particle_stage_close(particle_stage *s) {
    jsl_memory *memory = jsl_ecs_memory(s->ecs);
    jsl_collider_set_free(memory, &s->set);
    jsl_arena_fini(&s->arena);
    jsl_exec_fini(&s->exec, memory);
    jsl_particle_room_destroy(s->room);
    jsl_ecs_destroy(s->ecs);
    assert_no_leaks(&s->memory);
}

void particle_stage_set_dt(particle_stage *s, double dt) {
    s->context.dt = (jsl_real)dt;
    s->context.inv_dt = dt > 0 ? (jsl_real)(1 / dt) : 0;
}

int64_t particle_stage_collider(particle_stage *s, jsl_shape_desc shape, jsl_pose pose,
                                jsl_vec3 velocity, jsl_vec3 spin) {
    jsl_quat q = pose.orientation;
    if (q.x == 0 && q.y == 0 && q.z == 0 && q.w == 0) pose.orientation.w = 1;
    int64_t i = s->set.item.count;
    assert_ok(jsl_array_reserve(jsl_ecs_memory(s->ecs), &s->set.item, i + 1));
    s->set.item.at[i] = (jsl_collider_item){.shape = shape,
                                            .pose = pose,
                                            .velocity = velocity,
                                            .spin = spin,
                                            .radius = jsl_shape_radius(&shape),
                                            .category = 1,
                                            .mask = UINT32_MAX};
    s->set.item.count = i + 1;
    return i;
}

void particle_stage_ground(particle_stage *s) {
    particle_stage_collider(s, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, (jsl_pose){0},
                            jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
}

void particle_stage_step(particle_stage *s) {
    static const jsl_stage stages[] = {JSL_STAGE_EMIT,    JSL_STAGE_INDEX, JSL_STAGE_FORCE,
                                       JSL_STAGE_RESPOND, JSL_STAGE_MOVE,  JSL_STAGE_RETIRE};
    jsl_real dt = s->context.dt;
    assert_ok(jsl_collider_set_index(jsl_ecs_memory(s->ecs), &s->set, dt, JSL_R(0.01)));
    for (int i = 0; i < JSL_COUNT(stages); i++)
        assert_ok(jsl_schedule_run(s->ecs, stages[i], &s->context));
    for (int64_t i = 0; i < s->set.item.count; i++) {
        jsl_collider_item *item = &s->set.item.at[i];
        item->pose.position = jsl_mul_add(item->pose.position, dt, item->velocity);
        jsl_quat turn = jsl_quat_from_rotation_vector(jsl_scale(item->spin, dt));
        item->pose.orientation = jsl_quat_normalize(jsl_quat_mul(turn, item->pose.orientation));
    }
    s->context.step++;
    s->context.time = (double)s->context.step * (double)dt;
}

void particle_stage_spawn(particle_stage *s, jsl_emitter emitter, int64_t count, jsl_real life,
                          jsl_rows *rows) {
    const jsl_component set[] = {s->position, s->velocity, s->particle};
    assert_ok(jsl_entity_create_n(s->ecs, set, 3, count, NULL, rows));
    jsl_particle_columns q = jsl_particle_of(rows, 2);
    for (int64_t i = 0; i < count; i++) {
        q.life[i] = life;
        q.size[i] = JSL_R(0.05);
        q.emitter[i] = emitter.entity;
    }
}

int64_t particle_stage_count(const particle_stage *s) {
    return jsl_query_count(s->ecs, s->particles);
}

bool particle_stage_rows(const particle_stage *s, jsl_rows *rows) {
    jsl_iter it = jsl_query_begin(s->ecs, s->particles, 0);
    bool some = jsl_query_next(&it, rows);
    jsl_rows more;
    must(!some || !jsl_query_next(&it, &more));
    return some;
}

jsl_vec3 particle_position(const jsl_rows *rows, int64_t i) {
    jsl_position_columns p = jsl_position_of(rows, 0);
    return jsl_v3(p.px[i], p.py[i], p.pz[i]);
}

jsl_vec3 particle_velocity(const jsl_rows *rows, int64_t i) {
    jsl_velocity_columns v = jsl_velocity_of(rows, 1);
    return jsl_v3(v.vx[i], v.vy[i], v.vz[i]);
}

void particle_put(const jsl_rows *rows, int64_t i, jsl_vec3 position, jsl_vec3 velocity) {
    jsl_position_columns p = jsl_position_of(rows, 0);
    jsl_velocity_columns v = jsl_velocity_of(rows, 1);
    p.px[i] = position.x;
    p.py[i] = position.y;
    p.pz[i] = position.z;
    v.vx[i] = velocity.x;
    v.vy[i] = velocity.y;
    v.vz[i] = velocity.z;
}
