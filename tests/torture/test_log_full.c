/* SPDX-License-Identifier: MIT
 * Disks that are full, slow or gone: the simulation goes on, the loss is counted, and what is in
 * the file can be read.
 */
#include "log_fixture.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>

static void assert_balanced(const jsl_publisher_stats *s) {
    assert_i64(s->log.offered, s->log.sent + s->log.dropped + s->log.decimated + s->log.errors);
}

/* Publishes until the disk must be full; every step succeeds. */
static jsl_publisher_stats run(const char *path, jsl_full_policy policy, int steps,
                               jsl_result expected, test_log *lines) {
    log_world w = log_world_make(20000, 0, 100);
    jsl_publisher *p;
    jsl_publisher_stats s;
    jsl_publisher_desc desc = {.log_path = path,
                               .particles_hz = 1e6,
                               .bodies_hz = 1e6,
                               .queue_bytes = 2 << 20,
                               .when_full = policy,
                               .logger = test_logger(lines)};
    assert_ok(jsl_publisher_create(&desc, w.world, &p));
    for (int i = 0; i < steps; i++) {
        log_world_step(&w);
        assert_ok(jsl_publisher_step(p, NULL));
        jsl_publisher_get_stats(p, &s);
        assert_balanced(&s);
    }
    assert_result(jsl_publisher_close(p, &s), expected);
    assert_balanced(&s);
    jsl_world_destroy(w.world);
    return s;
}

static void a_full_disk_ends_the_log_and_not_the_simulation(void **state) {
    (void)state;
    char dir[256], path[300];
    log_temp_path(dir);
    assert_int_equal(mkdir(dir, 0700), 0);
    if (mount("tmpfs", dir, "tmpfs", 0, "size=4096k") != 0) {
        int why = errno;
        rmdir(dir);
        print_message("skipped: a small tmpfs cannot be mounted: %s\n", strerror(why));
        skip();
    }
    snprintf(path, sizeof path, "%s/log", dir);
    for (int policy = 0; policy < 2; policy++) {
        test_log lines = {0};
        jsl_publisher_stats s = run(path, (jsl_full_policy)policy, 60, JSL_ERR_IO, &lines);
        assert_int_equal(lines.lines, 1);
        assert_int_equal(lines.code, JSL_ERR_IO);
        assert_true(s.log.errors > 0 && s.log_errors > 0 && s.log.sent > 0);
        if (policy == JSL_FULL_BLOCK) assert_i64(s.log.dropped, 0);
        jsl_log_file *log;
        static jsl_log_info info;
        assert_ok(jsl_log_open(path, NULL, &log));
        (void)jsl_log_verify(log, &info);
        /* Cut back to its last whole event, it holds what is said to have been written. */
        assert_false(info.truncated || info.closed);
        assert_i64(info.holes + info.bad_frames, 0);
        assert_i64(info.events, s.log_events);
        assert_i64(info.file_bytes, s.log_bytes);
        assert_i64(info.particle_frames + info.body_frames + info.boid_frames, s.log.sent);
        assert_true(info.incomplete_frames <= 1);
        jsl_log_close(log);
    }
    assert_int_equal(umount(dir), 0);
    rmdir(dir);
}

static void a_device_that_is_always_full_loses_everything_and_says_so(void **state) {
    (void)state;
    if (access("/dev/full", W_OK) != 0) {
        print_message("skipped: there is no /dev/full\n");
        skip();
    }
    for (int policy = 0; policy < 2; policy++) {
        test_log lines = {0};
        jsl_publisher_stats s = run("/dev/full", (jsl_full_policy)policy, 20, JSL_ERR_IO, &lines);
        assert_int_equal(lines.lines, 1);
        assert_i64(s.log_events + s.log_bytes + s.log.sent, 0);
        assert_true(s.log.errors > 0);
    }
}

/* -- A slow reader of a pipe is a slow disk
 * ---------------------------------------------------------------- */

typedef struct slow {
    const char *path;
    int64_t bytes;
    uint8_t *data;
} slow;

static void *read_slowly(void *arg) {
    slow *s = arg;
    int f = open(s->path, O_RDONLY);
    s->data = malloc(64 << 20);
    for (ssize_t n; f >= 0 && (n = read(f, s->data + s->bytes, 60000)) > 0; usleep(1000))
        s->bytes += n;
    close(f);
    return NULL;
}

static void a_slow_disk_drops_whole_frames_or_blocks(void **state) {
    (void)state;
    char path[256], copy[256];
    log_temp_path(path);
    log_temp_path(copy);
    assert_int_equal(mkfifo(path, 0600), 0);
    for (int policy = 0; policy < 2; policy++) {
        slow reader = {.path = path};
        pthread_t thread;
        assert_int_equal(pthread_create(&thread, NULL, read_slowly, &reader), 0);
        test_log lines = {0};
        jsl_publisher_stats s = run(path, (jsl_full_policy)policy, 60, JSL_OK, &lines);
        assert_int_equal(pthread_join(thread, NULL), 0);
        assert_i64(s.log_errors + s.log.errors, 0);
        assert_i64(reader.bytes, s.log_bytes);
        if (policy == JSL_FULL_BLOCK)
            assert_i64(s.log.dropped + s.keyframes_dropped + s.small_dropped, 0);
        else
            assert_true(s.log.dropped > 0);
        log_write_file(copy, reader.data, reader.bytes);
        free(reader.data);
        jsl_log_file *log;
        static jsl_log_info info;
        assert_ok(jsl_log_open(copy, NULL, &log));
        assert_ok(jsl_log_verify(log, &info));
        assert_true(info.closed);
        assert_i64(info.particle_frames + info.body_frames + info.boid_frames, s.log.sent);
        assert_i64(info.frames_dropped, s.log.dropped);
        jsl_log_close(log);
    }
    unlink(path);
    unlink(copy);
}

/* A pipe whose reader goes away: EPIPE. The library does not touch signals, so the host ignores
 * SIGPIPE. */
static void a_disk_that_goes_away_is_an_error(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    assert_int_equal(mkfifo(path, 0600), 0);
    signal(SIGPIPE, SIG_IGN);
    int f = open(path, O_RDONLY | O_NONBLOCK);
    log_world w = log_world_make(1000, 0, 0);
    jsl_publisher *p;
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_create(&(jsl_publisher_desc){.log_path = path}, w.world, &p));
    close(f);
    for (int i = 0; i < 50; i++) {
        log_world_step(&w);
        assert_ok(jsl_publisher_step(p, NULL));
        usleep(1000);
    }
    assert_result(jsl_publisher_close(p, &s), JSL_ERR_IO);
    assert_balanced(&s);
    assert_true(s.log_errors > 0);
    jsl_world_destroy(w.world);
    unlink(path);
}

/* A killed simulator leaves a readable beginning. */
static void a_killed_process_leaves_a_readable_log(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    for (int round = 0; round < 5; round++) {
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            log_world w = log_world_make(20000, 100, 10);
            jsl_publisher *p;
            jsl_publisher_desc desc = {.log_path = path, .particles_hz = 1e6, .bodies_hz = 1e6};
            if (jsl_publisher_create(&desc, w.world, &p) != JSL_OK) _exit(1);
            for (;;) {
                log_world_step(&w);
                (void)jsl_publisher_step(p, NULL);
                usleep(500);
            }
        }
        usleep(60000 + 17000 * (useconds_t)round);
        kill(child, SIGKILL);
        assert_int_equal(waitpid(child, NULL, 0), child);
        jsl_log_file *log;
        static jsl_log_info info;
        jsl_frame f;
        int64_t frames = 0;
        assert_ok(jsl_log_open(path, NULL, &log));
        while (jsl_log_next_frame(log, &f) == JSL_OK) frames++;
        (void)jsl_log_verify(log, &info);
        assert_true(info.events > 3 && frames > 0);
        assert_false(info.closed);
        assert_i64(info.holes + info.bad_frames, 0);
        assert_true(info.incomplete_frames <=
                    2); /* one at the end, perhaps of each of two channels */
        jsl_log_close(log);
        unlink(path);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_full_disk_ends_the_log_and_not_the_simulation),
        cmocka_unit_test(a_device_that_is_always_full_loses_everything_and_says_so),
        cmocka_unit_test(a_slow_disk_drops_whole_frames_or_blocks),
        cmocka_unit_test(a_disk_that_goes_away_is_an_error),
        cmocka_unit_test(a_killed_process_leaves_a_readable_log),
    };
    return cmocka_run_group_tests_name("log full", tests, NULL, NULL);
}
