/* SPDX-License-Identifier: MIT
 * bench_rigid.c - the pyramid, timed: Box3D's benchmark large_pyramid (base 100, unit cubes of
 * density 100, friction 0.6, 1/60 s, 4 sub-steps), mean of 200 steps after the first, whole and by
 * phase, on 1 and 2 threads. The room is driven by hand, so that nothing else is in the figures but
 * the indexing of colliders, which has a line of its own.
 */
#include "bench.h"

#include "ecs/ecs.h"
#include "geometry/geometry.h"
#include "rigid/rigid.h"

#define BASE 100
#define STEPS 200

typedef struct bench {
    jsl_ecs *ecs;
    jsl_rigid_room *room;
    jsl_arena arena;
    jsl_exec exec;
    jsl_collider_set set;
    jsl_query solid;
    jsl_warnings warnings;
    jsl_step_context context;
    double index; /* s */
} bench;

static const jsl_shape_desc shapes[2] = {{JSL_SHAPE_BOX, 0, {JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)}},
                                         {JSL_SHAPE_BOX, 0, {400, 400, 1}}};

static jsl_result add_bodies(bench *b, int64_t *count) {
    jsl_rigid_body_desc d = {{.shape = {2}, .kind = JSL_BODY_STATIC, .position = {0, 0, -1}},
                             &shapes[1]};
    jsl_body body;
    JSL_TRY(jsl_rigid_body_create(b->room, &d, &body));
    for (int i = 0; i < BASE; i++)
        for (int j = i; j < BASE; j++, ++*count) {
            d = (jsl_rigid_body_desc){{.shape = {1}, .density = 100}, &shapes[0]};
            d.body.position.x = (jsl_real)((i + 1) * 0.5 + (j - i) - 0.5 * BASE);
            d.body.position.z = (jsl_real)(i + 0.5);
            JSL_TRY(jsl_rigid_body_create(b->room, &d, &body));
        }
    return JSL_OK;
}

static jsl_result open_bench(bench *b, int threads, int64_t *count) {
    *b = (bench){0};
    JSL_TRY(jsl_ecs_create(&(jsl_ecs_desc){.tag = 1}, &b->ecs));
    jsl_memory *m = jsl_ecs_memory(b->ecs);
    jsl_arena_init(&b->arena, m);
    JSL_TRY(jsl_rigid_room_create(b->ecs, &b->room));
    JSL_TRY(jsl_exec_init(&b->exec, m, (jsl_tasks){0}, threads));
    const char *name[6] = {"position", "orientation", "collider", "velocity", "spin", "mass"};
    jsl_query_desc q = {0};
    for (int i = 0; i < 6; i++) {
        JSL_TRY(jsl_component_find(b->ecs, name[i], &q.terms[i].component));
        q.terms[i].access = i < 3 ? JSL_READ : JSL_READ_IF;
    }
    JSL_TRY(jsl_query_create(b->ecs, &q, &b->solid));
    b->context = (jsl_step_context){.dt = JSL_R(1.0) / 60,
                                    .inv_dt = 60,
                                    .substeps = 4,
                                    .gravity = {0, 0, JSL_R(-9.81)},
                                    .workers = threads,
                                    .isa = jsl_isa_resolve(JSL_ISA_AUTO),
                                    .ecs = b->ecs,
                                    .warnings = &b->warnings,
                                    .exec = &b->exec,
                                    .memory = m,
                                    .arena = &b->arena,
                                    .colliders = &b->set};
    return add_bodies(b, count);
}

static void close_bench(bench *b) {
    if (!b->ecs) return;
    jsl_memory *m = jsl_ecs_memory(b->ecs);
    jsl_rigid_room_destroy(b->room);
    jsl_collider_set_free(m, &b->set);
    jsl_arena_fini(&b->arena);
    jsl_exec_fini(&b->exec, m);
    jsl_ecs_destroy(b->ecs);
}

/* What the world does in its INDEX stage. Tables come with the static body apart, so ids are in
 * order. */
static jsl_result index_colliders(bench *b) {
    jsl_memory *m = jsl_ecs_memory(b->ecs);
    JSL_TRY(jsl_array_reserve(m, &b->set.item, jsl_query_count(b->ecs, b->solid)));
    b->set.item.count = 0;
    jsl_rows rows;
    for (int pass = 0; pass < 2; pass++)
        for (jsl_iter it = jsl_query_begin(b->ecs, b->solid, 0); jsl_query_next(&it, &rows);) {
            jsl_position_columns x = jsl_position_of(&rows, 0);
            jsl_orientation_columns q = jsl_orientation_of(&rows, 1);
            jsl_collider_columns c = jsl_collider_of(&rows, 2);
            jsl_velocity_columns v = jsl_velocity_of(&rows, 3);
            jsl_spin_columns w = jsl_spin_of(&rows, 4);
            jsl_mass_columns mass = jsl_mass_of(&rows, 5);
            if ((mass.inv_mass != NULL) != (pass == 1)) continue;
            for (int64_t r = 0; r < rows.count; r++) {
                jsl_collider_item *i = &b->set.item.at[b->set.item.count++];
                *i = (jsl_collider_item){
                    .entity = rows.entity[r],
                    .shape = shapes[c.shape[r] - 1],
                    .pose = {{x.px[r], x.py[r], x.pz[r]}, {q.qx[r], q.qy[r], q.qz[r], q.qw[r]}},
                    .friction = JSL_R(0.6),
                    .category = c.category[r],
                    .mask = c.mask[r],
                    .shape_id = c.shape[r],
                    .table = rows.table,
                    .row = (int32_t)(rows.begin + r)};
                i->radius = jsl_shape_radius(&i->shape);
                if (pass == 0) continue;
                i->velocity = jsl_v3(v.vx[r], v.vy[r], v.vz[r]);
                i->spin = jsl_v3(w.wx[r], w.wy[r], w.wz[r]);
                i->inv_mass = mass.inv_mass[r];
            }
        }
    return jsl_collider_set_index(m, &b->set, b->context.dt, JSL_R(0.02));
}

static jsl_result step(bench *b) {
    double start = jsl_seconds();
    JSL_TRY(index_colliders(b));
    b->index += jsl_seconds() - start;
    JSL_TRY(jsl_schedule_run(b->ecs, JSL_STAGE_DETECT, &b->context));
    jsl_arena_reset(&b->arena);
    JSL_TRY(jsl_schedule_run(b->ecs, JSL_STAGE_RESPOND, &b->context));
    jsl_arena_reset(&b->arena);
    b->context.step++;
    return JSL_OK;
}

static jsl_result run(bench *b, int threads, jsl_bench_emit *emit) {
    int64_t n = 0;
    JSL_TRY(open_bench(b, threads, &n));
    JSL_TRY(step(b));
    (void)jsl_rigid_room_profile(b->room, true);
    b->index = 0;
    double start = jsl_seconds();
    for (int i = 1; i < STEPS; i++) JSL_TRY(step(b));
    double all = (jsl_seconds() - start) / (STEPS - 1) * 1e3, k = 1e3 / (STEPS - 1);
    jsl_rigid_profile p = jsl_rigid_room_profile(b->room, true);
    emit("pyramid", n, threads, all, "ms/step", NULL, 0);
    emit("pyramid.index", n, threads, b->index * k, "ms/step", NULL, 0);
    emit("pyramid.gather", n, threads, p.gather * k, "ms/step", NULL, 0);
    emit("pyramid.pairs", n, threads, p.pairs * k, "ms/step", NULL, 0);
    emit("pyramid.narrow", n, threads, p.narrow * k, "ms/step", NULL, 0);
    emit("pyramid.colour", n, threads, p.colour * k, "ms/step", NULL, 0);
    emit("pyramid.prepare", n, threads, p.prepare * k, "ms/step", NULL, 0);
    emit("pyramid.solve", n, threads, p.solve * k, "ms/step", NULL, 0);
    emit("pyramid.finish", n, threads, p.finish * k, "ms/step", NULL, 0);
    return JSL_OK;
}

int jsl_bench_rigid(jsl_bench_emit *emit) {
    for (int threads = 1; threads <= 2; threads++) {
        bench b;
        jsl_result result = run(&b, threads, emit);
        close_bench(&b);
        if (result != JSL_OK) return 1;
    }
    return 0;
}
