/* SPDX-License-Identifier: MIT
 * Every allocation of the renderer fails once: an error is returned, nothing is lost, and it draws
 * again.
 */
#include "helper.h"

#include "jostle/render.h"

/* OSMesa 22.3 keeps some 270 bytes of every context that is destroyed, whatever the order of calls:
 * not ours to report. */
JSL_API const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libOSMesa\n"; }

#define BODIES 40

/* Bodies of several meshes, birds, particles and a plane, so that every list grows. */
static void fill(jsl_frame *frame, float x[BODIES], int32_t shape[BODIES],
                 const jsl_frame_shape shapes[3]) {
    for (int i = 0; i < BODIES; i++) x[i] = (float)i * 0.3f, shape[i] = i % 3;
    *frame = (jsl_frame){.shapes = shapes, .shape_count = 3};
    frame->bodies = (jsl_frame_bodies){.count = BODIES, .px = x, .py = x, .pz = x, .shape = shape};
    frame->boids = (jsl_frame_boids){.count = BODIES, .px = x, .py = x, .pz = x};
    frame->particles = (jsl_frame_particles){.count = BODIES, .px = x, .py = x, .pz = x};
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    static const jsl_frame_shape shapes[3] = {{JSL_SHAPE_BOX, 0, {0.1f, 0.1f, 0.1f}},
                                              {JSL_SHAPE_SPHERE, 0.1f, {0}},
                                              {JSL_SHAPE_PLANE, 0, {0}}};
    float x[BODIES];
    int32_t shape[BODIES];
    jsl_frame frame;
    fill(&frame, x, shape, shapes);
    bool done = false;
    int failed = 0;
    for (int64_t fail = 1; !done; fail++) {
        test_memory memory = {.fail_at = fail};
        test_log log = {0};
        jsl_render_desc desc = {.width = 64,
                                .height = 36,
                                .logger = test_logger(&log),
                                .allocator = test_allocator(&memory)};
        jsl_renderer *r = NULL;
        const uint8_t *pixels = NULL;
        jsl_result result = jsl_renderer_create(&desc, &r);
        if (result != JSL_OK) {
            assert_result(result, JSL_ERR_MEMORY);
            assert_null(r);
            assert_int_equal(log.lines, 1);
        } else if ((result = jsl_renderer_draw(r, &frame, &pixels)) != JSL_OK) {
            assert_result(result, JSL_ERR_MEMORY);
            assert_null(pixels);
            assert_int_equal(log.lines, 1);
            assert_ok(jsl_renderer_draw(r, &frame, &pixels));
        }
        failed += result != JSL_OK;
        done = memory.failures == 0;
        jsl_renderer_destroy(r);
        assert_no_leaks(&memory);
    }
    assert_true(failed > 10);
}

static void a_second_picture_allocates_nothing(void **state) {
    (void)state;
    static const jsl_frame_shape shapes[3] = {{JSL_SHAPE_BOX, 0, {0.1f, 0.1f, 0.1f}},
                                              {JSL_SHAPE_SPHERE, 0.1f, {0}},
                                              {JSL_SHAPE_PLANE, 0, {0}}};
    float x[BODIES];
    int32_t shape[BODIES];
    jsl_frame frame;
    fill(&frame, x, shape, shapes);
    test_memory memory = {0};
    jsl_render_desc desc = {.width = 64, .height = 36, .allocator = test_allocator(&memory)};
    jsl_renderer *r = NULL;
    const uint8_t *pixels = NULL;
    assert_ok(jsl_renderer_create(&desc, &r));
    assert_ok(jsl_renderer_draw(r, &frame, &pixels));
    int64_t calls = memory.calls;
    assert_ok(jsl_renderer_draw(r, &frame, &pixels));
    assert_i64(memory.calls, calls);
    jsl_renderer_destroy(r);
    assert_no_leaks(&memory);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(a_second_picture_allocates_nothing),
    };
    return cmocka_run_group_tests_name("render memory", tests, NULL, NULL);
}
