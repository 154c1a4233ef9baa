/* SPDX-License-Identifier: MIT */
#include "flock_stage.h"

#include "ecs/ecs.h"

#include <string.h>

void flock_stage_open(flock_stage *s, int workers, jsl_isa isa) {
    memset(s, 0, sizeof *s);
    jsl_ecs_desc desc = {
        .allocator = test_allocator(&s->heap), .logger = test_logger(&s->log), .tag = 7};
    assert_ok(jsl_ecs_create(&desc, &s->ecs));
    assert_ok(jsl_flock_room_create(s->ecs, &s->room));
    assert_ok(jsl_memory_init(&s->memory, test_allocator(&s->heap)));
    assert_ok(jsl_exec_init(&s->exec, &s->memory, (jsl_tasks){0}, workers));
    jsl_arena_init(&s->arena, &s->memory);
    s->context = (jsl_step_context){.substeps = 1,
                                    .seed = 11,
                                    .workers = workers,
                                    .isa = jsl_isa_resolve(isa),
                                    .logger = jsl_ecs_logger(s->ecs),
                                    .ecs = s->ecs,
                                    .warnings = &s->warnings,
                                    .exec = &s->exec,
                                    .memory = jsl_ecs_memory(s->ecs),
                                    .arena = &s->arena,
                                    .colliders = &s->set};
}

void flock_stage_close(flock_stage *s) {
    jsl_flock_room_destroy(s->room);
    jsl_collider_set_free(&s->memory, &s->set);
    jsl_arena_fini(&s->arena);
    jsl_exec_fini(&s->exec, &s->memory);
    jsl_ecs_destroy(s->ecs);
    assert_no_leaks(&s->heap);
}

static void run(flock_stage *s, jsl_real dt, jsl_stage last) {
    s->context.dt = dt;
    s->context.inv_dt = dt > 0 ? 1 / dt : 0;
    if (s->set.item.count > 0)
        assert_ok(jsl_collider_set_index(&s->memory, &s->set, dt, JSL_R(0.01)));
    for (int stage = 0; stage <= (int)last; stage++)
        assert_ok(jsl_schedule_run(s->ecs, (jsl_stage)stage, &s->context));
}

void flock_stage_step(flock_stage *s, jsl_real dt) {
    run(s, dt, JSL_STAGE_OUTBOX);
    for (int64_t i = 0; i < s->set.item.count; i++) {
        jsl_collider_item *item = &s->set.item.at[i];
        item->pose.position = jsl_mul_add(item->pose.position, dt, item->velocity);
    }
    s->context.step++;
    s->context.time += (double)dt;
}

void flock_stage_decide(flock_stage *s, jsl_real dt) { run(s, dt, JSL_STAGE_DECIDE); }

jsl_flock flock_stage_flock(flock_stage *s, const jsl_flock_desc *desc) {
    jsl_flock flock;
    assert_ok(jsl_flock_room_flock_create(s->room, desc, &flock));
    return flock;
}

jsl_entity flock_stage_boid(flock_stage *s, jsl_flock flock, jsl_vec3 at, jsl_vec3 velocity) {
    jsl_entity boid;
    jsl_boid_spawn spawn = {.centre = at, .velocity = velocity};
    assert_ok(jsl_flock_room_boid_create_n(s->room, s->context.seed, flock, 1, &spawn, &boid));
    return boid;
}

void flock_stage_obstacle(flock_stage *s, jsl_shape_desc shape, jsl_pose pose, jsl_vec3 velocity) {
    assert_ok(jsl_array_reserve(&s->memory, &s->set.item, s->set.item.count + 1));
    if (pose.orientation.w == 0 && pose.orientation.x == 0 && pose.orientation.y == 0 &&
        pose.orientation.z == 0)
        pose.orientation = jsl_quat_identity();
    s->set.item.at[s->set.item.count++] = (jsl_collider_item){.shape = shape,
                                                              .pose = pose,
                                                              .velocity = velocity,
                                                              .radius = jsl_shape_radius(&shape),
                                                              .category = ~0u,
                                                              .mask = ~0u};
}

boid_state flock_stage_see(flock_stage *s, jsl_entity boid) {
    jsl_component c;
    jsl_rows r;
    boid_state out;
    assert_ok(jsl_component_find(s->ecs, "position", &c));
    assert_ok(jsl_rows_of_entity(s->ecs, boid, c, &r));
    jsl_position_columns p = jsl_position_of(&r, 0);
    out.p = jsl_v3(*p.px, *p.py, *p.pz);
    assert_ok(jsl_component_find(s->ecs, "velocity", &c));
    assert_ok(jsl_rows_of_entity(s->ecs, boid, c, &r));
    jsl_velocity_columns v = jsl_velocity_of(&r, 0);
    out.v = jsl_v3(*v.vx, *v.vy, *v.vz);
    assert_ok(jsl_component_find(s->ecs, "boid", &c));
    assert_ok(jsl_rows_of_entity(s->ecs, boid, c, &r));
    jsl_boid_columns b = jsl_boid_of(&r, 0);
    out.a = jsl_v3(*b.ax, *b.ay, *b.az);
    out.neighbours = *b.neighbours;
    return out;
}
