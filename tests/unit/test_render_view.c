/* SPDX-License-Identifier: MIT
 * Cameras: of the frame, chosen, orbiting; and the sun's.
 */
#include "helper.h"

#include "render/view.h"

#include <string.h>

#define COUNT 1000

typedef struct points {
    float x[COUNT], y[COUNT], z[COUNT];
} points;

static void crowd(points *p, uint64_t seed, double cx, double cy, double cz, double radius) {
    for (int i = 0; i < COUNT; i++) {
        p->x[i] = (float)(cx + test_uniform(&seed, -radius, radius));
        p->y[i] = (float)(cy + test_uniform(&seed, -radius, radius));
        p->z[i] = (float)(cz + test_uniform(&seed, -radius, radius));
    }
}

static void project(const float m[16], jsl_f3 p, float out[4]) {
    for (int r = 0; r < 4; r++) out[r] = m[r] * p.x + m[4 + r] * p.y + m[8 + r] * p.z + m[12 + r];
}

/* How many points are inside the picture. */
static int inside(const jsl_view *view, const points *p, float *widest) {
    int count = 0;
    *widest = 0;
    for (int i = 0; i < COUNT; i++) {
        float c[4];
        project(view->camera, jsl_f3_sub(jsl_f3_make(p->x[i], p->y[i], p->z[i]), view->eye), c);
        bool in = c[3] > 0 && fabsf(c[0]) <= c[3] && fabsf(c[1]) <= c[3];
        count += in;
        if (in) *widest = fmaxf(*widest, fmaxf(fabsf(c[0]), fabsf(c[1])) / c[3]);
    }
    return count;
}

static void see(const jsl_frame *frame, jsl_span *span, jsl_view *view) {
    jsl_span_make(frame, span);
    jsl_view_make(frame, span, 160, 90, view);
}

static void the_camera_is_where_the_frame_says(void **state) {
    (void)state;
    jsl_frame frame = {.camera = {{1, -8, 3}, {1, 0, 3}, 60, 0}};
    jsl_span span;
    jsl_view view;
    see(&frame, &span, &view);
    assert_close(view.distance, 8, 1e-6);
    float c[4];
    project(view.camera, jsl_f3_sub(jsl_f3_make(1, 0, 3), view.eye), c);
    assert_close(c[0], 0, 1e-5);
    assert_close(c[1], 0, 1e-5);
    assert_close(c[3], 8, 1e-5);
    /* 60 degrees high: the upper edge at 8 m is 8 tan 30 above the middle. */
    project(view.camera, jsl_f3_sub(jsl_f3_make(1, 0, 3 + 8 * 0.57735027f), view.eye), c);
    assert_close(c[1] / c[3], 1, 1e-5);
    project(view.camera, jsl_f3_sub(jsl_f3_make(2, 0, 3), view.eye), c);
    assert_true(c[0] > 0); /* x is to the right of somebody who looks along y */
}

static void the_camera_orbits_by_turns_per_second(void **state) {
    (void)state;
    jsl_frame frame = {.time = 0.5, .camera = {{0, -8, 3}, {0, 0, 1}, 0, 0.5f}};
    jsl_span span;
    jsl_view view;
    see(&frame, &span, &view); /* a quarter turn, counter-clockwise from above: from -y to +x */
    assert_close(view.eye.x, 8, 1e-5);
    assert_close(view.eye.y, 0, 1e-5);
    assert_close(view.eye.z, 3, 1e-6);
}

static void a_chosen_camera_sees_everything_and_fills_the_picture(void **state) {
    (void)state;
    static points p;
    static const double place[][4] = {{0, 0, 5, 3}, {1000, -500, 80, 60}, {0, 0, 0.1, 0.05}};
    for (int k = 0; k < JSL_COUNT(place); k++) {
        crowd(&p, 11, place[k][0], place[k][1], place[k][2], place[k][3]);
        jsl_frame frame = {.boids = {.count = COUNT, .px = p.x, .py = p.y, .pz = p.z}};
        jsl_span span;
        jsl_view view;
        float widest;
        see(&frame, &span, &view);
        /* A hundredth at each end of three axes may be left out, and a quarter of a thousand points
         * stands for the rest. */
        assert_true(inside(&view, &p, &widest) > COUNT * 9 / 10);
        if (place[k][3] > 1) assert_true(widest > 0.7f);
    }
}

static void one_lost_body_does_not_shrink_the_rest(void **state) {
    (void)state;
    float x[6] = {0, 1, 2, 0, 1, 1e8f}, y[6] = {0, 0, 0, 1, 1, 0}, z[6] = {1, 1, 1, 1, 1, 1};
    int32_t shape[6] = {0};
    jsl_frame_shape ball = {JSL_SHAPE_SPHERE, 0.5f, {0}};
    jsl_frame frame = {.bodies = {.count = 6, .px = x, .py = y, .pz = z, .shape = shape},
                       .shapes = &ball,
                       .shape_count = 1};
    jsl_span span;
    jsl_view view;
    see(&frame, &span, &view);
    assert_true(span.bodies.hi.x < 3);
    assert_true(view.distance < 20);
    static points p;
    crowd(&p, 12, 0, 0, 5, 3);
    for (int i = 0; i < 8; i++) p.x[i * 100] = 1e7f; /* nearly one in a hundred */
    jsl_frame flock = {.boids = {.count = COUNT, .px = p.x, .py = p.y, .pz = p.z}};
    see(&flock, &span, &view);
    assert_true(view.distance < 40);
}

static void a_camera_can_look_straight_down(void **state) {
    (void)state;
    jsl_frame frame = {.camera = {{2, 3, 9}, {2, 3, 0}, 45, 0}};
    jsl_span span;
    jsl_view view;
    see(&frame, &span, &view);
    float c[4];
    project(view.camera, jsl_f3_make(0, 1, -9), c);
    assert_true(c[1] > 0 && fabsf(c[0]) < 1e-5f); /* y is up in the picture */
}

static void an_empty_frame_has_a_camera(void **state) {
    (void)state;
    jsl_frame frame = {0};
    jsl_span span;
    jsl_view view;
    see(&frame, &span, &view);
    assert_true(view.distance > 1 && view.distance < 100);
    assert_true(view.eye.z > 0);
}

static void the_ground_is_under_things_that_have_no_plane(void **state) {
    (void)state;
    static points p;
    jsl_frame frame = {.boids = {.count = COUNT, .px = p.x, .py = p.y, .pz = p.z}};
    jsl_span span;
    crowd(&p, 13, 0, 0, 10, 3);
    jsl_span_make(&frame, &span);
    assert_close(span.ground, 0, 0);
    crowd(&p, 13, 0, 0, 0, 20);
    jsl_span_make(&frame, &span);
    assert_close(span.ground, -32, 0);
    float zero = 0, level = 1.5f;
    int32_t shape = 0;
    jsl_frame_shape plane = {JSL_SHAPE_PLANE, 0, {0}};
    frame.shapes = &plane, frame.shape_count = 1;
    frame.bodies =
        (jsl_frame_bodies){.count = 1, .px = &zero, .py = &zero, .pz = &level, .shape = &shape};
    jsl_span_make(&frame, &span);
    assert_true(span.has_level);
    assert_close(span.ground, 1.5, 0);
}

static void the_sun_sees_what_casts_shadows(void **state) {
    (void)state;
    static points p;
    crowd(&p, 14, 3, 4, 6, 5);
    jsl_frame frame = {.boids = {.count = COUNT, .px = p.x, .py = p.y, .pz = p.z}};
    jsl_span span;
    jsl_view view;
    jsl_sunview sun;
    see(&frame, &span, &view);
    jsl_sunview_make(&view, &span, jsl_f3_unit(jsl_f3_make(-0.5f, -0.5f, 0.8f)), 1024, &sun);
    int in = 0;
    for (int i = 0; i < COUNT; i++) {
        float c[4], t[4];
        jsl_f3 d = jsl_f3_sub(jsl_f3_make(p.x[i], p.y[i], p.z[i]), view.eye);
        project(sun.clip, d, c);
        project(sun.texture, d, t);
        for (int k = 0; k < 2; k++) assert_close(c[k], 2 * t[k] - 1, 1e-4);
        assert_close(c[2], t[2], 1e-4);
        in += t[0] >= 0 && t[0] <= 1 && t[1] >= 0 && t[1] <= 1 && t[2] >= 0 && t[2] <= 1;
    }
    assert_true(in > COUNT * 9 / 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_camera_is_where_the_frame_says),
        cmocka_unit_test(the_camera_orbits_by_turns_per_second),
        cmocka_unit_test(a_chosen_camera_sees_everything_and_fills_the_picture),
        cmocka_unit_test(one_lost_body_does_not_shrink_the_rest),
        cmocka_unit_test(a_camera_can_look_straight_down),
        cmocka_unit_test(an_empty_frame_has_a_camera),
        cmocka_unit_test(the_ground_is_under_things_that_have_no_plane),
        cmocka_unit_test(the_sun_sees_what_casts_shadows),
    };
    return cmocka_run_group_tests_name("render view", tests, NULL, NULL);
}
