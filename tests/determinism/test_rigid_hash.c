/* SPDX-License-Identifier: MIT
 * The same bits for every number of workers, instruction set and history; no allocation once warm.
 */
#include "rigid_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* A pyramid hit by a ball and long bricks, with bounces and implicit rotation: every kernel runs.
 */
static void build(rigid_scene *s, int base) {
    s->context.gravity = jsl_v3(0, 0, -10);
    s->restitution[1] = JSL_R(0.4);
    scene_pyramid(s, base, NULL);
    scene_body(s, &(jsl_body_desc){.shape = scene_sphere(s, 1),
                                   .material = {1},
                                   .density = 900,
                                   .position = {-3, -6, 4},
                                   .velocity = {3, 20, 0}});
    jsl_shape brick = scene_box(s, JSL_R(0.9), JSL_R(0.3), JSL_R(0.2)),
              pill = scene_shape(
                  s, (jsl_shape_desc){JSL_SHAPE_CAPSULE, JSL_R(0.2), {0, 0, JSL_R(0.5)}});
    for (int i = 0; i < 10; i++)
        scene_body(s, &(jsl_body_desc){.shape = i % 2 ? brick : pill,
                                       .material = {(uint32_t)(i % 3)},
                                       .position = {2 * (jsl_real)i - 10, -4, 2},
                                       .velocity = {0, 5, 1},
                                       .spin = {1, (jsl_real)i, 3}});
}

static uint64_t run(int base, int steps, int workers, jsl_isa isa) {
    rigid_scene s;
    scene_open(&s, workers);
    s.context.isa = jsl_isa_resolve(isa);
    build(&s, base);
    scene_steps(&s, steps);
    uint64_t hash = scene_hash(&s);
    assert_true(scene_measure(&s).touching > base);
    scene_close(&s);
    return hash;
}

static void hashes_do_not_depend_on_workers(void **state) {
    (void)state;
    const int workers[] = {2, 4, 8};
    uint64_t one = run(40, 40, 1, JSL_ISA_AUTO);
    for (int i = 0; i < JSL_COUNT(workers); i++)
        assert_true(run(40, 40, workers[i], JSL_ISA_AUTO) == one);
}

static void hashes_do_not_depend_on_the_instruction_set(void **state) {
    (void)state;
    uint64_t scalar = run(14, 60, 1, JSL_ISA_SCALAR);
    for (int isa = JSL_ISA_SSE; isa < JSL_ISA_COUNT; isa++)
        assert_true(run(14, 60, 1, (jsl_isa)isa) == scalar);
}

static void a_restored_world_goes_on_as_if_it_had_never_stopped(void **state) {
    (void)state;
    rigid_scene a, b;
    scene_open(&a, 1);
    scene_open(&b, 1);
    build(&a, 10);
    build(&b, 10); /* shapes, and other contacts that restoring must replace */
    scene_steps(&a, 50);
    scene_steps(&b, 9);
    size_t ecs = jsl_ecs_save_size(a.ecs), cache = jsl_rigid_room_save_size(a.room);
    unsigned char *image = malloc(ecs + cache);
    assert_int_equal(jsl_ecs_save(a.ecs, image, ecs), JSL_OK);
    assert_int_equal(jsl_rigid_room_save(a.room, image + ecs, cache), JSL_OK);
    assert_int_equal(jsl_ecs_restore(b.ecs, image, ecs), JSL_OK);
    assert_int_equal(jsl_rigid_room_restore(b.room, image + ecs, cache), JSL_OK);
    free(image);
    assert_true(scene_hash(&a) == scene_hash(&b));
    for (int i = 0; i < 50; i++) {
        scene_step(&a);
        scene_step(&b);
        if (scene_hash(&a) != scene_hash(&b)) fail_msg("differs %d steps after restoring", i + 1);
    }
    scene_close(&a);
    scene_close(&b);
}

static void idle_things_made_before_or_after_change_no_body(void **state) {
    (void)state;
    jsl_body_state end[2][28 + 7];
    for (int k = 0; k < 2; k++) {
        rigid_scene s;
        scene_open(&s, 1);
        s.context.gravity = jsl_v3(0, 0, -10);
        jsl_shape rock = scene_box(&s, 1, 1, 1),
                  cube = scene_box(&s, JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)),
                  slab = scene_box(&s, 50, 50, 1);
        jsl_body_desc ground = {.shape = slab, .kind = JSL_BODY_STATIC, .position = {0, 0, -1}};
        if (k == 0) {
            scene_body(&s, &ground);
            for (int i = 0; i < 20; i++)
                scene_body(&s, &(jsl_body_desc){.shape = rock,
                                                .kind = JSL_BODY_STATIC,
                                                .position = {500, 3 * (jsl_real)i, 0}});
        }
        jsl_body b[28];
        int n = 0;
        for (int i = 0; i < 7; i++)
            for (int j = i; j < 7; j++)
                b[n++] =
                    scene_body(&s, &(jsl_body_desc){.shape = cube,
                                                    .position = {(jsl_real)(i * 0.5 + (j - i)),
                                                                 JSL_R(0.01) * (jsl_real)(j % 3),
                                                                 (jsl_real)(i + 0.6)}});
        if (k == 1) {
            for (int i = 0; i < 20; i++)
                scene_body(&s, &(jsl_body_desc){.shape = rock,
                                                .kind = JSL_BODY_STATIC,
                                                .position = {500, 3 * (jsl_real)i, 0}});
            scene_body(&s, &ground);
        }
        scene_steps(&s, 120);
        for (int i = 0; i < n; i++) end[k][i] = scene_get(&s, b[i]);
        scene_close(&s);
    }
    for (int i = 0; i < 28; i++) {
        const jsl_body_state *a = &end[0][i], *b = &end[1][i];
        assert_true(a->pose.position.x == b->pose.position.x &&
                    a->pose.position.y == b->pose.position.y &&
                    a->pose.position.z == b->pose.position.z &&
                    a->pose.orientation.x == b->pose.orientation.x &&
                    a->pose.orientation.w == b->pose.orientation.w &&
                    a->velocity.x == b->velocity.x && a->spin.y == b->spin.y);
    }
}

static void a_warm_step_allocates_nothing(void **state) {
    (void)state;
    rigid_scene s;
    scene_open(&s, 2);
    s.context.gravity = jsl_v3(0, 0, -10);
    scene_pyramid(&s, 20, NULL);
    scene_steps(&s, 10);
    int64_t calls = jsl_ecs_memory(s.ecs)->calls;
    scene_steps(&s, 100);
    assert_true(jsl_ecs_memory(s.ecs)->calls == calls);
    scene_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hashes_do_not_depend_on_workers),
        cmocka_unit_test(hashes_do_not_depend_on_the_instruction_set),
        cmocka_unit_test(a_restored_world_goes_on_as_if_it_had_never_stopped),
        cmocka_unit_test(idle_things_made_before_or_after_change_no_body),
        cmocka_unit_test(a_warm_step_allocates_nothing),
    };
    return cmocka_run_group_tests_name("rigid hash", tests, NULL, NULL);
}
