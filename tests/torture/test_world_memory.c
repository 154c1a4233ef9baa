/* SPDX-License-Identifier: MIT
 * Every allocation of a scenario that builds, steps, saves, restores and destroys a mixed world
 * fails in turn. Nothing leaks or crashes, the error reaches the caller, and a world that was made
 * still validates, steps and is destroyed.
 */
#include "helper.h"

#include <jostle/jostle.h>

static jsl_result furnish(jsl_world *w, jsl_flock *flock) {
    jsl_shape ground, box;
    jsl_result r = jsl_shape_create(w, &(jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, &ground);
    if (r == JSL_OK)
        r = jsl_shape_create(
            w,
            &(jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {JSL_R(0.5), JSL_R(0.5), JSL_R(0.5)}},
            &box);
    if (r == JSL_OK)
        r = jsl_body_create(w, &(jsl_body_desc){.shape = ground, .kind = JSL_BODY_STATIC}, NULL);
    for (int i = 0; i < 4 && r == JSL_OK; i++)
        r = jsl_body_create(w,
                            &(jsl_body_desc){.shape = box,
                                             .position = {0, 0, JSL_R(0.5) + (jsl_real)i},
                                             .rgba = 0xff0000ffu},
                            NULL);
    jsl_emitter emitter;
    if (r == JSL_OK)
        r = jsl_emitter_create(
            w,
            &(jsl_emitter_desc){
                .position = {0, 0, 6}, .rate = 3000, .cone = 1, .speed = 2, .life = JSL_R(0.1)},
            &emitter);
    if (r == JSL_OK) r = jsl_flock_create(w, NULL, flock);
    if (r == JSL_ERR_ARGUMENT) r = jsl_flock_create(w, &(jsl_flock_desc){0}, flock);
    if (r == JSL_OK)
        r = jsl_boid_create_n(
            w, *flock, 40,
            &(jsl_boid_spawn){.centre = {0, 0, 8}, .radius = 4, .velocity = {3, 0, 0}}, NULL);
    return r;
}

static jsl_result use(jsl_world *w) {
    jsl_flock flock;
    jsl_result r = furnish(w, &flock);
    for (int i = 0; i < 6 && r == JSL_OK; i++) r = jsl_step(w, 0, NULL);
    void *bytes = NULL;
    size_t size = 0;
    if (r == JSL_OK) r = jsl_world_save(w, &bytes, &size);
    if (r == JSL_OK) r = jsl_step(w, 0, NULL);
    if (r == JSL_OK) r = jsl_world_restore(w, bytes, size);
    jsl_world_free_bytes(w, bytes, size);
    jsl_world *clone = NULL;
    if (r == JSL_OK) r = jsl_world_clone(w, NULL, NULL, &clone);
    if (r == JSL_OK) r = jsl_step(clone, 0, NULL);
    jsl_world_destroy(clone);
    return r;
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    for (int64_t n = 1; n < 100000; n++) {
        test_memory memory = {.fail_at = n};
        jsl_world *w = NULL;
        jsl_warnings total = {0};
        jsl_result r = jsl_world_create(
            &(jsl_world_desc){.allocator = test_allocator(&memory), .gravity = {0, 0, -10}}, &w);
        if (r == JSL_OK) {
            r = use(w);
            jsl_ecs_report report;
            if (jsl_world_validate(w, &report) != JSL_OK)
                fail_msg("allocation %d: %s", (int)n, report.problem);
            /* Memory is there again: the world goes on. */
            for (int i = 0; i < 3; i++) assert_ok(jsl_step(w, 0, &total));
            jsl_world_destroy(w);
        }
        assert_no_leaks(&memory);
        assert_int_equal(memory.bad_frees, 0);
        if (memory.failures == 0) {
            assert_ok(r);
            print_message("%d allocations, each failed once\n", (int)n - 1);
            assert_true(n > 50);
            return;
        }
        /* A system may do without scratch and say so; anything else is told to the caller. */
        if (r != JSL_OK && r != JSL_ERR_MEMORY)
            fail_msg("allocation %d: \"%s\" instead of out of memory", (int)n, jsl_result_text(r));
    }
    fail_msg("the scenario never came to an end");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_allocation_may_fail)};
    return cmocka_run_group_tests_name("world memory", tests, NULL, NULL);
}
