/* SPDX-License-Identifier: MIT
 * A world through the publisher into a log and back.
 */
#include "log_fixture.h"

static jsl_publisher *publish(log_world *w, const jsl_publisher_desc *desc, int steps) {
    jsl_publisher *p;
    assert_ok(jsl_publisher_create(desc, w->world, &p));
    for (int i = 0; i < steps; i++) {
        log_world_step(w);
        assert_ok(jsl_publisher_step(p, NULL));
    }
    return p;
}

static void assert_balanced(const jsl_publisher_stats *s) {
    const jsl_frame_counts *both[] = {&s->log, &s->live};
    for (int i = 0; i < 2; i++)
        assert_i64(both[i]->offered,
                   both[i]->sent + both[i]->dropped + both[i]->decimated + both[i]->errors);
    assert_i64(s->frames_offered,
               s->frames_sent + s->frames_dropped + s->frames_decimated + s->send_errors);
}

static void check_particles(const jsl_frame *f, int64_t n, int64_t step) {
    assert_i64(f->particles.count, n);
    assert_null(f->particles.vx);
    for (int64_t i = 0; i < n; i++) {
        /* positions span 100 m: half a u16 step, and float's rounding at 50 m */
        const double tol = 100.0 / 131070 * 1.02 + 1e-5;
        assert_close(f->particles.px[i], log_value(i, step, 0), tol);
        assert_close(f->particles.py[i], log_value(i, step, 1), tol);
        assert_close(f->particles.pz[i], log_value(i, step, 2), tol);
        assert_close(f->particles.size[i], 0.01 + 0.001 * (double)(i % 7), 0.02 * 0x1p-11);
    }
}

static void check_boids(const jsl_frame *f, int64_t n, int64_t step) {
    assert_i64(f->boids.count, n);
    for (int64_t i = 0; i < n; i++) {
        assert_close(f->boids.px[i], log_value(i, step, 0), 100.0 / 131070 * 1.02 + 1e-5);
        assert_true(f->boids.vx[i] == (float)(i % 32)); /* exact in f16 */
        assert_true(f->boids.ax[i] == 1 && f->boids.ay[i] == -2 && f->boids.az[i] == 0.5f);
        assert_int_equal(f->boids.rgba[i], (uint32_t)i << 8 | 0xff);
    }
}

static void check_bodies(const jsl_frame *f, int64_t n, int64_t step) {
    assert_i64(f->bodies.count, n);
    for (int64_t i = 0; i < n; i++) {
        assert_true(f->bodies.px[i] == (float)(jsl_real)log_value(i, step, 0));
        assert_true(f->bodies.pz[i] == (float)(jsl_real)log_value(i, step, 2));
        assert_true(f->bodies.qx[i] == 0 && f->bodies.qw[i] == 1);
        assert_int_equal(f->bodies.rgba[i], 0x10203000u + (uint32_t)i);
        assert_true(f->bodies.shape[i] >= 0 && f->bodies.shape[i] < f->shape_count);
        const jsl_frame_shape *s = &f->shapes[f->bodies.shape[i]];
        assert_int_equal(s->kind, i % 3 == 0   ? JSL_SHAPE_SPHERE
                                  : i % 3 == 1 ? JSL_SHAPE_BOX
                                               : JSL_SHAPE_PLANE);
        if (i % 3 == 0) assert_true(s->radius == 0.5f);
        if (i % 3 == 1) assert_true(s->half[0] == 1 && s->half[1] == 2 && s->half[2] == 3);
    }
}

static void a_world_comes_back_from_its_log(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(20000, 300, 50);
    jsl_publisher_stats s;
    jsl_publisher_desc desc = {.log_path = path,
                               .scene_name = "a scene",
                               .scene_text = "{\"name\": \"a scene\"}",
                               .particles_hz = 32,
                               .boids_hz = 64,
                               .bodies_hz = 128,
                               .keyframe_seconds = 0.25,
                               .additive = true,
                               .boid_length = 0.25f,
                               .camera = {{1, 2, 3}, {4, 5, 6}, 50, 0.5f},
                               .when_full = JSL_FULL_BLOCK};
    jsl_publisher *p = publish(&w, &desc, 64);
    assert_ok(jsl_publisher_close(p, &s));
    assert_balanced(&s);
    /* 128 steps a second; 64 steps and the state at the start. */
    assert_i64(s.frames_offered, 3 * 65);
    assert_i64(s.frames_sent, 65 + 33 + 17);
    assert_i64(s.frames_dropped + s.send_errors + s.log_errors + s.small_dropped, 0);
    assert_i64(s.keyframes, 3);

    jsl_log_file *log;
    jsl_log_info info;
    jsl_frame f;
    assert_ok(jsl_log_open(path, NULL, &log));
    int64_t frames = 0;
    for (; jsl_log_next_frame(log, &f) == JSL_OK; frames++) {
        assert_i64(f.step, frames);
        assert_close(f.time, (double)frames / 128, 1e-9);
        assert_string_equal(f.scene, "a scene");
        check_particles(&f, 20000, frames / 4 * 4);
        check_boids(&f, 300, frames / 2 * 2);
        check_bodies(&f, 50, frames);
        assert_true(f.additive && f.boids.length == 0.25f && f.camera.eye[2] == 3 &&
                    f.camera.fov == 50 && f.camera.orbit == 0.5f);
    }
    assert_i64(frames, 65);
    assert_ok(jsl_log_verify(log, &info));
    assert_true(info.closed && !info.truncated);
    assert_i64(info.events, s.log_events);
    assert_i64(info.good_bytes, s.log_bytes);
    assert_i64(info.file_bytes, s.log_bytes);
    assert_i64(info.particle_frames, 17);
    assert_i64(info.boid_frames, 33);
    assert_i64(info.body_frames, 65);
    assert_i64(info.keyframes, 3);
    assert_i64(info.incomplete_frames + info.holes + info.bad_frames + info.backward_times, 0);
    assert_i64(info.frames_offered, 3 * 65);
    assert_string_equal(info.scene, "a scene");
    assert_true(info.seed == 77 && info.sessions == 1);
    assert_close(info.last_time, 0.5, 1e-9);
    jsl_log_close(log);
    jsl_world_destroy(w.world);
    unlink(path);
}

static void seeking_lands_on_the_last_instant_before(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(200, 30, 5);
    jsl_publisher_desc desc = {.log_path = path,
                               .particles_hz = 16,
                               .boids_hz = 32,
                               .bodies_hz = 64,
                               .keyframe_seconds = -1,
                               .when_full = JSL_FULL_BLOCK};
    assert_ok(jsl_publisher_close(publish(&w, &desc, 600), NULL));
    jsl_log_file *log;
    jsl_frame f;
    uint64_t seed = 2;
    for (int round = 0; round < 2; round++) {
        assert_ok(jsl_log_open(path, NULL, &log));
        static jsl_log_info info;
        if (round) assert_ok(jsl_log_get_info(log, &info)); /* lists by headers, not by the index */
        for (int i = 0; i < 300; i++) {
            double t = test_uniform(&seed, 0, 600.0 / 128);
            int64_t step = (int64_t)(t * 128);
            assert_ok(jsl_log_seek_time(log, t));
            assert_ok(jsl_log_next_frame(log, &f));
            assert_i64(f.step, step / 2 * 2);
            check_bodies(&f, 5, step / 2 * 2);
            check_boids(&f, 30, step / 4 * 4);
            check_particles(&f, 200, step / 8 * 8);
        }
        assert_ok(jsl_log_seek_time(log, -5));
        assert_ok(jsl_log_next_frame(log, &f));
        assert_i64(f.step, 0);
        assert_ok(jsl_log_seek_time(log, 1e9));
        assert_ok(jsl_log_next_frame(log, &f));
        assert_i64(f.step, 600);
        assert_result(jsl_log_next_frame(log, &f), JSL_ERR_END);
        assert_result(jsl_log_seek_time(log, (double)NAN), JSL_ERR_NOT_FINITE);
        jsl_log_close(log);
    }
    jsl_world_destroy(w.world);
    unlink(path);
}

/* More frames than one index message lists: they are chained. */
static void a_chain_of_index_events_lists_every_frame(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(20, 3, 2);
    jsl_publisher_desc desc = {.log_path = path,
                               .particles_hz = 128,
                               .boids_hz = 128,
                               .bodies_hz = 128,
                               .when_full = JSL_FULL_BLOCK};
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_close(publish(&w, &desc, 1500), &s));
    jsl_log_file *log;
    static jsl_log_info info;
    int64_t indexed, hopped;
    assert_ok(jsl_log_open(path, NULL, &log));
    assert_ok(jsl_log_count_frames(log, &indexed));
    assert_ok(jsl_log_get_info(log, &info));
    assert_ok(jsl_log_count_frames(log, &hopped));
    assert_i64(indexed, 1501);
    assert_i64(hopped, 1501);
    int64_t index_events = 0;
    for (int i = 0; i < info.channel_count; i++)
        if (strcmp(info.channel[i].name, "JOSTLE_INDEX") == 0)
            index_events = info.channel[i].events;
    assert_i64(index_events, 3);
    jsl_log_close(log);
    jsl_world_destroy(w.world);
    unlink(path);
}

static void a_keyframe_restores_the_state_it_was_taken_of(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(5000, 30, 5);
    jsl_publisher_desc desc = {.log_path = path,
                               .scene_text = "text of the scene",
                               .keyframe_seconds = 0.125,
                               .hash_every = 1,
                               .when_full = JSL_FULL_BLOCK};
    jsl_publisher *p = publish(&w, &desc, 32);
    uint64_t hash = jsl_world_hash(w.world);
    for (int i = 0; i < 10; i++) {
        log_world_step(&w);
        assert_ok(jsl_publisher_step(p, NULL));
    }
    assert_ok(jsl_publisher_close(p, NULL));
    jsl_log_file *log;
    jsl_log_keyframe k;
    const char *text;
    int64_t size;
    assert_ok(jsl_log_open(path, NULL, &log));
    assert_ok(jsl_log_get_keyframe(log, 0.27, &k));
    assert_i64(k.step, 32);
    assert_close(k.time, 0.25, 1e-12);
    assert_true(k.state_hash == hash);
    assert_true(jsl_world_hash(w.world) != hash);
    assert_ok(jsl_world_restore(w.world, k.image, k.size));
    assert_true(jsl_world_hash(w.world) == hash);
    assert_ok(jsl_log_get_keyframe(log, 0, &k));
    assert_i64(k.step, 0);
    assert_result(jsl_log_get_keyframe(log, -1, &k), JSL_ERR_END);
    assert_ok(jsl_log_get_scene_text(log, &text, &size));
    assert_i64(size, 17);
    assert_memory_equal(text, "text of the scene", 17);
    jsl_log_close(log);
    jsl_world_destroy(w.world);
    unlink(path);
}

static void bodies_that_come_and_go_are_told_of_again(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(0, 0, 9);
    jsl_publisher_desc desc = {.log_path = path, .bodies_hz = 1e6, .when_full = JSL_FULL_BLOCK};
    jsl_publisher *p = publish(&w, &desc, 4);
    jsl_rows rows;
    jsl_iter it = jsl_query_begin(jsl_world_ecs(w.world), w.bodies, 0);
    assert_true(jsl_query_next(&it, &rows));
    assert_ok(jsl_entity_destroy(jsl_world_ecs(w.world), rows.entity[8]));
    log_world_step(&w);
    assert_ok(jsl_publisher_step(p, NULL));
    log_world_fill(&w, 0, 0, 9); /* colours and shapes count from 0 again */
    log_world_step(&w);
    assert_ok(jsl_publisher_step(p, NULL));
    assert_ok(jsl_publisher_close(p, NULL));
    jsl_log_file *log;
    jsl_frame f;
    assert_ok(jsl_log_open(path, NULL, &log));
    for (int i = 0; i < 5; i++) {
        assert_ok(jsl_log_next_frame(log, &f));
        check_bodies(&f, 9, i);
    }
    assert_ok(jsl_log_next_frame(log, &f));
    check_bodies(&f, 8, 5);
    assert_ok(jsl_log_next_frame(log, &f));
    assert_i64(f.bodies.count, 17);
    for (int i = 0; i < 9; i++) assert_int_equal(f.bodies.rgba[8 + i], 0x10203000u + (uint32_t)i);
    /* Backwards: an older table is loaded again. */
    assert_ok(jsl_log_seek_time(log, 0));
    assert_ok(jsl_log_next_frame(log, &f));
    check_bodies(&f, 9, 0);
    jsl_log_close(log);
    jsl_world_destroy(w.world);
    unlink(path);
}

static void paint(void *arg, const jsl_rows *rows, uint32_t *rgba, float *size) {
    ++*(int *)arg;
    for (int64_t i = 0; i < rows->count; i++) {
        rgba[i] = 0xff000000u + (uint32_t)i;
        size[i] = (float)jsl_particle_of(rows, 1).size[i] * 2;
    }
}

static void the_look_of_particles_comes_from_the_callback(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(100, 0, 0);
    int calls = 0;
    jsl_publisher_desc desc = {.log_path = path,
                               .particle_look = paint,
                               .particle_look_arg = &calls,
                               .with = JSL_PUBLISH_PARTICLE_VELOCITY | JSL_PUBLISH_PARTICLE_IDS,
                               .particle_position = JSL_ENCODING_F32,
                               .when_full = JSL_FULL_BLOCK};
    assert_ok(jsl_publisher_close(publish(&w, &desc, 1), NULL));
    assert_int_equal(calls, 1);
    jsl_log_file *log;
    jsl_frame f;
    assert_ok(jsl_log_open(path, NULL, &log));
    assert_ok(jsl_log_next_frame(log, &f));
    assert_i64(f.particles.count, 100);
    for (int i = 0; i < 100; i++) {
        assert_int_equal(f.particles.rgba[i], 0xff000000u + (uint32_t)i);
        assert_close(f.particles.size[i], 0.02 + 0.002 * (i % 7), 0.04 * 0x1p-11);
        assert_true(f.particles.vx[i] == 0); /* these have no velocity */
        assert_true(f.particles.px[i] == (float)(jsl_real)log_value(i, 0, 0));
    }
    jsl_log_close(log);
    jsl_world_destroy(w.world);
    unlink(path);
}

/* A queue of 1 MiB and frames of 0.9 MB back to back: some must be dropped, each of them is
 * counted, none is half there. */
static void dropped_frames_are_counted_and_never_halved(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(60000, 0, 10);
    jsl_publisher_desc desc = {.log_path = path,
                               .particles_hz = 1e6,
                               .bodies_hz = 1e6,
                               .keyframe_seconds = -1,
                               .queue_bytes = 1 << 20,
                               .particle_position = JSL_ENCODING_F32};
    jsl_publisher *p;
    assert_ok(jsl_publisher_create(&desc, w.world, &p));
    for (int i = 0; i < 200; i++) {
        jsl_publisher_stats now;
        assert_ok(jsl_step(w.world, 0, NULL));
        assert_ok(jsl_publisher_step(p, NULL));
        jsl_publisher_get_stats(p, &now);
        assert_balanced(&now);
    }
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_close(p, &s));
    assert_balanced(&s);
    assert_i64(s.frames_offered, 3 * 201); /* the boids' component exists: empty frames */
    assert_true(s.frames_dropped > 0);
    assert_i64(s.log_errors, 0);
    jsl_log_file *log;
    static jsl_log_info info;
    assert_ok(jsl_log_open(path, NULL, &log));
    assert_ok(jsl_log_verify(log, &info));
    assert_i64(info.particle_frames + info.boid_frames + info.body_frames, s.frames_sent);
    assert_i64(info.frames_offered, s.frames_offered);
    assert_i64(info.frames_dropped, s.frames_dropped);
    jsl_log_close(log);
    jsl_world_destroy(w.world);
    unlink(path);
}

/* LCM's file provider is a network that can be looked at. */
static void the_live_stream_holds_the_same_messages(void **state) {
    (void)state;
    char path[256], live[256], url[300];
    log_temp_path(path);
    log_temp_path(live);
    snprintf(url, sizeof url, "file://%s?mode=w", live);
    log_world w = log_world_make(5000, 100, 20);
    jsl_publisher_desc desc = {
        .log_path = path, .lcm_url = url, .scene_name = "live", .when_full = JSL_FULL_BLOCK};
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_close(publish(&w, &desc, 40), &s));
    assert_balanced(&s);
    assert_i64(s.live.sent, s.log.sent);
    assert_i64(s.live_errors, 0);
    jsl_log_file *a, *b;
    static jsl_log_info info, other;
    jsl_frame f, g;
    assert_ok(jsl_log_open(path, NULL, &a));
    assert_ok(jsl_log_open(live, NULL, &b));
    assert_ok(jsl_log_get_info(a, &info));
    assert_ok(jsl_log_get_info(b, &other));
    assert_i64(other.particle_frames, info.particle_frames);
    assert_i64(other.body_frames, info.body_frames);
    assert_i64(other.keyframes, 0); /* into the log only */
    assert_string_equal(other.scene, "live");
    jsl_log_rewind(a);
    jsl_log_rewind(b);
    while (jsl_log_next_frame(a, &f) == JSL_OK) {
        assert_ok(jsl_log_next_frame(b, &g));
        assert_i64(g.step, f.step);
        assert_i64(g.particles.count, f.particles.count);
        assert_memory_equal(g.particles.px, f.particles.px, (size_t)f.particles.count * 4);
        check_bodies(&g, 20, f.step);
    }
    assert_result(jsl_log_next_frame(b, &g), JSL_ERR_END);
    jsl_log_close(a);
    jsl_log_close(b);
    jsl_world_destroy(w.world);
    unlink(path);
    unlink(live);
}

static void memq_and_replay_into_a_file_work(void **state) {
    (void)state;
    char path[256], copy[256], url[300];
    log_temp_path(path);
    log_temp_path(copy);
    snprintf(url, sizeof url, "file://%s?mode=w", copy);
    log_world w = log_world_make(100, 10, 5);
    jsl_publisher_desc desc = {.log_path = path, .lcm_url = "memq://", .when_full = JSL_FULL_BLOCK};
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_close(publish(&w, &desc, 20), &s));
    assert_true(s.live_events > 20 && s.live_errors == 0);
    jsl_log_file *log, *again;
    jsl_play_stats played;
    assert_ok(jsl_log_open(path, NULL, &log));
    assert_ok(jsl_log_play(log, &(jsl_play_desc){.lcm_url = url}, &played));
    assert_i64(played.events, s.log_events);
    assert_i64(played.errors, 0);
    assert_ok(jsl_log_open(copy, NULL, &again));
    jsl_log_rewind(log);
    jsl_log_event a, b;
    while (jsl_log_next(log, &a) == JSL_OK) {
        assert_ok(jsl_log_next(again, &b));
        assert_int_equal(a.size, b.size);
        assert_int_equal(a.channel_size, b.channel_size);
        assert_memory_equal(a.channel, b.channel, (size_t)a.channel_size);
        assert_memory_equal(a.data, b.data, (size_t)a.size);
    }
    assert_result(jsl_log_next(again, &b), JSL_ERR_END);
    jsl_log_close(log);
    jsl_log_close(again);
    jsl_world_destroy(w.world);
    unlink(path);
    unlink(copy);
}

static void what_cannot_be_opened_leaves_nothing_behind(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(10, 0, 0);
    test_log lines = {0};
    jsl_publisher *p = (jsl_publisher *)1;
    jsl_publisher_desc desc = {.log_path = "/nonexistent/folder/log",
                               .logger = test_logger(&lines)};
    assert_result(jsl_publisher_create(&desc, w.world, &p), JSL_ERR_IO);
    assert_null(p);
    assert_int_equal(lines.lines, 1);
    desc.log_path = path;
    desc.lcm_url = "no-such-provider://x";
    assert_result(jsl_publisher_create(&desc, w.world, &p), JSL_ERR_UNSUPPORTED);
    assert_int_equal(access(path, F_OK), -1);
    desc.lcm_url = NULL;
    desc.queue_bytes = 5;
    assert_result(jsl_publisher_create(&desc, w.world, &p), JSL_ERR_ARGUMENT);
    desc.queue_bytes = 0;
    desc.bodies_hz = (double)INFINITY;
    assert_result(jsl_publisher_create(&desc, w.world, &p), JSL_ERR_NOT_FINITE);
    assert_int_equal(access(path, F_OK), -1);
    assert_result(jsl_publisher_create(NULL, w.world, &p), JSL_ERR_ARGUMENT);
    assert_ok(jsl_publisher_close(NULL, NULL));
    jsl_log_file *log;
    assert_result(jsl_log_open(path, NULL, &log), JSL_ERR_IO);
    assert_result(jsl_log_open("/", NULL, &log), JSL_ERR_IO);
    jsl_world_destroy(w.world);
}

static void an_older_longer_log_is_replaced(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    uint8_t *junk = calloc(1, 4 << 20);
    log_write_file(path, junk, 4 << 20);
    free(junk);
    log_world w = log_world_make(10, 0, 0);
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_close(publish(&w, &(jsl_publisher_desc){.log_path = path}, 3), &s));
    struct stat st;
    assert_int_equal(stat(path, &st), 0);
    assert_i64(st.st_size, s.log_bytes);
    jsl_world_destroy(w.world);
    unlink(path);
}

static void a_world_without_any_kind_makes_a_readable_log(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    jsl_world *world;
    assert_ok(jsl_world_create(NULL, &world));
    jsl_publisher *p;
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_create(&(jsl_publisher_desc){.log_path = path}, world, &p));
    assert_ok(jsl_step(world, 0, NULL));
    assert_ok(jsl_publisher_step(p, NULL));
    assert_ok(jsl_publisher_close(p, &s));
    assert_balanced(&s);
    jsl_log_file *log;
    jsl_frame f;
    static jsl_log_info info;
    assert_ok(jsl_log_open(path, NULL, &log));
    while (jsl_log_next_frame(log, &f) == JSL_OK)
        assert_i64(f.particles.count + f.boids.count + f.bodies.count, 0);
    assert_ok(jsl_log_verify(log, &info));
    assert_true(info.closed);
    jsl_log_close(log);
    jsl_world_destroy(world);
    unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_world_comes_back_from_its_log),
        cmocka_unit_test(seeking_lands_on_the_last_instant_before),
        cmocka_unit_test(a_chain_of_index_events_lists_every_frame),
        cmocka_unit_test(a_keyframe_restores_the_state_it_was_taken_of),
        cmocka_unit_test(bodies_that_come_and_go_are_told_of_again),
        cmocka_unit_test(the_look_of_particles_comes_from_the_callback),
        cmocka_unit_test(dropped_frames_are_counted_and_never_halved),
        cmocka_unit_test(the_live_stream_holds_the_same_messages),
        cmocka_unit_test(memq_and_replay_into_a_file_work),
        cmocka_unit_test(what_cannot_be_opened_leaves_nothing_behind),
        cmocka_unit_test(an_older_longer_log_is_replaced),
        cmocka_unit_test(a_world_without_any_kind_makes_a_readable_log),
    };
    return cmocka_run_group_tests_name("publisher", tests, NULL, NULL);
}
