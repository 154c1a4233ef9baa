/* SPDX-License-Identifier: MIT */
#include "helper.h"

#include "telemetry/ring.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static jsl_ring make(jsl_memory *memory, int64_t cap) {
    jsl_ring ring;
    assert_ok(jsl_memory_init(memory, (jsl_allocator){0}));
    assert_ok(jsl_ring_init(&ring, memory, cap));
    return ring;
}

/* One event whose bytes depend on its number. */
static bool put(jsl_ring *ring, int64_t size, bool wait) {
    int64_t number = ring->number;
    uint8_t *p = jsl_ring_reserve(ring, "CHANNEL", size, wait);
    if (!p) return false;
    for (int64_t i = 0; i < size; i++) p[i] = (uint8_t)(number * 31 + i);
    jsl_ring_commit(ring, "CHANNEL", size, 1000 + number);
    return true;
}

/* Checks one event and returns its bytes. */
static int64_t check(const uint8_t *p, int64_t number) {
    jsl_event e = jsl_event_at(p);
    assert_int_equal(jsl_get_u32(p), JSL_EVENT_SYNC);
    assert_i64(e.number, number);
    assert_i64(e.timestamp_us, 1000 + number);
    assert_int_equal(e.channel_size, 7);
    assert_memory_equal(e.channel, "CHANNEL", 7);
    for (int64_t i = 0; i < e.size; i++) assert_int_equal(e.data[i], (uint8_t)(number * 31 + i));
    return e.bytes;
}

/* Everything that is published now, in spans. */
static int64_t drain(jsl_ring *ring, int64_t number, int64_t limit) {
    const uint8_t *span;
    bool closed;
    for (int64_t n; limit > 0 && (n = jsl_ring_take(ring, 0, &span, &closed)) > 0;) {
        int64_t at = 0;
        for (; at < n && limit > 0; limit--) at += check(span + at, number++);
        jsl_ring_release(ring, at);
    }
    return number;
}

static void events_come_out_as_they_went_in_for_any_sizes(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_ring ring = make(&memory, 5000);
    uint64_t seed = 3;
    int64_t read = 0, refused = 0;
    for (int round = 0; round < 20000; round++) {
        int group = (int)(test_random(&seed) % 4);
        for (int i = 0; i < group; i++)
            refused += !put(&ring, (int64_t)(test_random(&seed) % 1400), false);
        jsl_ring_publish(&ring);
        if (test_random(&seed) % 2) read = drain(&ring, read, (int64_t)(test_random(&seed) % 6));
    }
    read = drain(&ring, read, INT64_MAX);
    assert_i64(read, ring.number);
    assert_true(read > 10000 && refused > 100);
    assert_i64(ring.used, 0);
    jsl_ring_fini(&ring, &memory);
}

static void a_group_is_invisible_until_it_is_published(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_ring ring = make(&memory, 5000);
    const uint8_t *span;
    bool closed;
    assert_true(put(&ring, 10, false) && put(&ring, 10, false));
    assert_i64(jsl_ring_take(&ring, 0, &span, &closed), 0);
    assert_false(closed);
    jsl_ring_publish(&ring);
    assert_i64(drain(&ring, 0, INT64_MAX), 2);
    jsl_ring_close(&ring);
    assert_i64(jsl_ring_take(&ring, 5, &span, &closed), 0);
    assert_true(closed);
    jsl_ring_fini(&ring, &memory);
}

static void what_is_said_to_fit_fits(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_ring ring = make(&memory, 1 << 20);
    uint64_t seed = 8;
    int64_t fitted = 0;
    for (int round = 0; round < 3000; round++) {
        int n = 1 + (int)(test_random(&seed) % 12);
        int64_t size = 1 + (int64_t)(test_random(&seed) % 65000);
        if (jsl_ring_fits(&ring, n * (size + JSL_EVENT_HEAD + 7), 1000)) {
            fitted++;
            for (int i = 0; i < n; i++) {
                uint8_t *p = jsl_ring_reserve(&ring, "CHANNEL", size, false);
                assert_non_null(p);
                memset(p, 0, (size_t)size);
                jsl_ring_commit(&ring, "CHANNEL", size, 1);
            }
            jsl_ring_publish(&ring);
        } else {
            const uint8_t *span;
            bool closed;
            int64_t bytes = jsl_ring_take(&ring, 0, &span, &closed);
            jsl_ring_release(&ring, bytes);
        }
    }
    assert_true(fitted > 500);
    jsl_ring_fini(&ring, &memory);
}

static void time_stamps_never_go_back(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_ring ring = make(&memory, 5000);
    const int64_t times[] = {100, 50, 200, 199};
    const int64_t want[] = {100, 100, 200, 200};
    for (int i = 0; i < 4; i++) {
        assert_non_null(jsl_ring_reserve(&ring, "T", 0, false));
        jsl_ring_commit(&ring, "T", 0, times[i]);
    }
    jsl_ring_publish(&ring);
    const uint8_t *span;
    bool closed;
    jsl_ring_take(&ring, 0, &span, &closed);
    for (int i = 0; i < 4; i++) {
        assert_i64(jsl_event_at(span).timestamp_us, want[i]);
        span += jsl_event_at(span).bytes;
    }
    assert_i64(ring.clamped, 2);
    jsl_ring_fini(&ring, &memory);
}

static void *consume(void *arg) {
    jsl_ring *ring = arg;
    int64_t number = 0;
    for (bool closed = false; !closed;) {
        const uint8_t *span;
        int64_t n = jsl_ring_take(ring, 1, &span, &closed), at = 0;
        while (at < n) at += check(span + at, number++);
        jsl_ring_release(ring, n);
    }
    return (void *)(intptr_t)number;
}

static void a_waiting_producer_loses_nothing(void **state) {
    (void)state;
    jsl_memory memory;
    jsl_ring ring = make(&memory, 1 << 16);
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, consume, &ring), 0);
    uint64_t seed = 4;
    for (int i = 0; i < 20000; i++) {
        assert_true(put(&ring, (int64_t)(test_random(&seed) % 3000), true));
        if (test_random(&seed) % 3 == 0) jsl_ring_publish(&ring);
    }
    jsl_ring_close(&ring);
    void *result;
    assert_int_equal(pthread_join(thread, &result), 0);
    assert_i64((intptr_t)result, 20000);
    jsl_ring_fini(&ring, &memory);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(events_come_out_as_they_went_in_for_any_sizes),
        cmocka_unit_test(a_group_is_invisible_until_it_is_published),
        cmocka_unit_test(what_is_said_to_fit_fits),
        cmocka_unit_test(time_stamps_never_go_back),
        cmocka_unit_test(a_waiting_producer_loses_nothing),
    };
    return cmocka_run_group_tests_name("ring", tests, NULL, NULL);
}
