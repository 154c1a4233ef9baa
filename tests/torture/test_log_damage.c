/* SPDX-License-Identifier: MIT
 * The reader on damaged logs: it never reads outside the file (run under sanitizers), always ends,
 * finds every event that the damage did not touch, and says what it skipped.
 */
#include "log_fixture.h"

#include "telemetry/message.h"
#include "telemetry/ring.h"
#include "telemetry/state.h"

#define EVENTS 4096

typedef struct sample {
    uint8_t *bytes;
    int64_t size;
    int64_t offset[EVENTS]; /* where its events begin, and the end */
    int events;
} sample;

/* A log of about 50 kB with every kind of message. */
static sample make_sample(void) {
    char path[256];
    log_temp_path(path);
    log_world w = log_world_make(60, 20, 7);
    jsl_publisher *p;
    jsl_publisher_desc desc = {.log_path = path,
                               .scene_name = "sample",
                               .scene_text = "the text",
                               .particles_hz = 128,
                               .boids_hz = 64,
                               .bodies_hz = 128,
                               .keyframe_seconds = 0.0625,
                               .when_full = JSL_FULL_BLOCK};
    assert_ok(jsl_publisher_create(&desc, w.world, &p));
    for (int i = 0; i < 12; i++) {
        log_world_step(&w);
        assert_ok(jsl_publisher_step(p, NULL));
    }
    assert_ok(jsl_publisher_close(p, NULL));
    jsl_world_destroy(w.world);
    sample s = {0};
    s.bytes = log_read_file(path, &s.size);
    unlink(path);
    for (int64_t at = 0; at < s.size; at += jsl_event_at(s.bytes + at).bytes)
        s.offset[s.events++] = at;
    s.offset[s.events] = s.size;
    assert_true(s.size > 30000 && s.size < 120000);
    return s;
}

static int group_setup(void **state) {
    static sample s; /* one for the whole group */
    s = make_sample();
    *state = &s;
    return 0;
}
static int group_teardown(void **state) {
    free(((sample *)*state)->bytes);
    return 0;
}

typedef struct outcome {
    int64_t events, damage, frames;
    jsl_log_info info;
} outcome;

/* Reads everything there is to read of a file. */
static outcome read_file(const char *path, int64_t size) {
    outcome o = {0};
    jsl_log_file *log;
    jsl_log_event e;
    jsl_frame f;
    jsl_log_keyframe k;
    const char *text;
    int64_t n;
    assert_ok(jsl_log_open(path, NULL, &log));
    uint64_t sum = 0;
    for (jsl_result r; (r = jsl_log_next(log, &e)) != JSL_ERR_END; o.events++) {
        assert_true(r == JSL_OK || r == JSL_ERR_FORMAT);
        o.damage += r == JSL_ERR_FORMAT;
        for (int64_t i = 0; i < e.size; i += 61) sum += e.data[i];
        for (int i = 0; i < e.channel_size; i++) sum += (uint8_t)e.channel[i];
    }
    while (jsl_log_next_frame(log, &f) == JSL_OK) {
        o.frames++;
        for (int64_t i = 0; i < f.particles.count; i++)
            sum += f.particles.px && f.particles.pz[i] > 0 && f.particles.size;
        for (int64_t i = 0; i < f.boids.count; i++) sum += f.boids.px && f.boids.px[i] > 0;
        for (int64_t i = 0; i < f.bodies.count; i++) {
            assert_true(f.bodies.shape[i] >= 0 && f.bodies.shape[i] < f.shape_count);
            sum += f.shapes[f.bodies.shape[i]].radius > 0 && f.bodies.qw && f.bodies.rgba[i];
        }
    }
    (void)jsl_log_seek_time(log, 0.05);
    (void)jsl_log_next_frame(log, &f);
    if (jsl_log_get_keyframe(log, 1e9, &k) == JSL_OK && k.size)
        sum += ((const uint8_t *)k.image)[k.size - 1];
    (void)jsl_log_get_scene_text(log, &text, &n);
    (void)jsl_log_verify(log, &o.info);
    assert_i64(o.info.events, o.events);
    assert_true(o.info.good_bytes + o.info.hole_bytes <= size);
    while (jsl_log_next_frame(log, &f) == JSL_OK) sum++;
    jsl_log_close(log);
    assert_true(sum != 1); /* uses it */
    return o;
}

static outcome read_all(const char *path, const void *bytes, int64_t size) {
    log_write_file(path, bytes, size);
    return read_file(path, size);
}

static void the_whole_log_is_sound(void **state) {
    const sample *s = *state;
    char path[256];
    log_temp_path(path);
    outcome o = read_all(path, s->bytes, s->size);
    assert_i64(o.events, s->events);
    assert_i64(o.damage + o.info.holes + o.info.incomplete_frames + o.info.bad_frames, 0);
    assert_true(o.info.closed && !o.info.truncated);
    assert_i64(o.frames, 13);
    unlink(path);
}

static void every_truncation_leaves_the_whole_events_before_it(void **state) {
    const sample *s = *state;
    char path[256];
    log_temp_path(path);
    log_write_file(path, s->bytes, s->size);
    int whole = s->events;
    for (int64_t cut = s->size; cut >= 0; cut--) {
        assert_int_equal(truncate(path, cut), 0);
        while (s->offset[whole] > cut) whole--;
        outcome o = read_file(path, cut);
        assert_i64(o.events, whole);
        assert_i64(o.damage + o.info.holes, 0);
        assert_int_equal(o.info.truncated, cut != s->offset[whole]);
        assert_int_equal(o.info.closed, cut == s->size);
    }
    unlink(path);
}

static void a_flipped_header_byte_costs_that_event_at_most(void **state) {
    const sample *s = *state;
    char path[256];
    log_temp_path(path);
    uint8_t *copy = malloc((size_t)s->size);
    for (int i = 0; i < s->events; i += 5)
        for (int b = 0; b < JSL_EVENT_HEAD; b++)
            for (int bit = 0; bit < 8; bit += 7) {
                memcpy(copy, s->bytes, (size_t)s->size);
                copy[s->offset[i] + b] ^= (uint8_t)(1 << bit);
                outcome o = read_all(path, copy, s->size);
                /* Number and time stamp are not checked; the rest loses the event and nothing else.
                 */
                bool checked = b < 4 || b >= 20;
                assert_i64(o.events, checked ? s->events - 1 : s->events);
                if (checked && i < s->events - 1) assert_i64(o.info.holes, 1);
                if (checked)
                    assert_i64(o.info.good_bytes, s->size - (s->offset[i + 1] - s->offset[i]));
            }
    free(copy);
    unlink(path);
}

static void the_largest_length_is_survived(void **state) {
    const sample *s = *state;
    char path[256];
    log_temp_path(path);
    uint8_t *copy = malloc((size_t)s->size);
    const uint32_t sizes[] = {0x7fffffff, 0x80000000, 0xffffffff, 0x7ffffffe, 100000000};
    for (int k = 0; k < 5; k++)
        for (int i = 0; i < s->events; i += 9) {
            memcpy(copy, s->bytes, (size_t)s->size);
            jsl_put_u32(copy + s->offset[i] + 24, sizes[k]);
            outcome o = read_all(path, copy, s->size);
            assert_i64(o.events, s->events - 1);
            jsl_put_u32(copy + s->offset[i] + 20, sizes[k]);
            o = read_all(path, copy, s->size);
            assert_i64(o.events, s->events - 1);
        }
    free(copy);
    unlink(path);
}

static void a_hole_of_zeros_costs_only_what_it_covers(void **state) {
    const sample *s = *state;
    char path[256];
    log_temp_path(path);
    uint8_t *copy = malloc((size_t)s->size);
    const int64_t hole = 4096;
    for (int64_t at = 0; at + hole < s->size; at += 1777) {
        memcpy(copy, s->bytes, (size_t)s->size);
        memset(copy + at, 0, (size_t)hole);
        int64_t headers = 0;
        for (int i = 0; i < s->events; i++)
            headers += s->offset[i] + JSL_EVENT_HEAD > at && s->offset[i] < at + hole;
        outcome o = read_all(path, copy, s->size);
        /* Events whose header is untouched survive, but the one before the hole, whose payload may
         * be cut, need not. */
        assert_true(o.events >= s->events - headers - 1 && o.events <= s->events - headers + 1);
    }
    free(copy);
    unlink(path);
}

/* -- Logs put together from events
 * ------------------------------------------------------------------------ */

typedef struct builder {
    uint8_t *bytes;
    int64_t size;
    int64_t number;
} builder;

static void add(builder *b, const char *channel, const void *data, int64_t size, int64_t us) {
    size_t channel_size = strlen(channel);
    b->bytes = realloc(b->bytes, (size_t)(b->size + JSL_EVENT_HEAD + size) + channel_size);
    jsl_event_put_head(b->bytes + b->size, b->number++, us, (uint32_t)channel_size, (uint32_t)size);
    memcpy(b->bytes + b->size + JSL_EVENT_HEAD, channel, channel_size);
    memcpy(b->bytes + b->size + JSL_EVENT_HEAD + channel_size, data, (size_t)size);
    b->size += JSL_EVENT_HEAD + (int64_t)channel_size + size;
}

/* Chunks of 16 particles each; which order they are added in is the caller's. */
static void add_chunk(builder *b, int64_t step, int index, int count) {
    jsl_real x[3][160];
    jsl_state_segment segment = {.count = 16 * count};
    for (int i = 0; i < 16 * count; i++)
        for (int k = 0; k < 3; k++) x[k][i] = (jsl_real)(i + 1000 * k + step);
    for (int k = 0; k < 3; k++) segment.data[0][k] = x[k];
    jsl_state_frame f = {.session = 5,
                         .step = step,
                         .sim_ns = step * 1000000,
                         .frame_seq = step,
                         .total = 16 * count,
                         .population = 16 * count,
                         .column_count = 1,
                         .segment = &segment,
                         .segment_count = 1};
    f.column[0] = (jsl_state_column){JSL_FIELD_POS, JSL_ENC_F32, 3, JSL_SOURCE_REAL, {0}};
    uint8_t out[4096];
    int64_t size = jsl_state_encode(&f, index, count, 16 * index, 16, out);
    add(b, "JOSTLE_PARTICLES", out, size, 1000 + step);
}

/* Frames of the log, in order; each must be whole. */
static int64_t count_whole(const char *path, const builder *b, jsl_log_info *info) {
    jsl_log_file *log;
    jsl_frame f;
    log_write_file(path, b->bytes, b->size);
    assert_ok(jsl_log_open(path, NULL, &log));
    int64_t frames = 0;
    for (; jsl_log_next_frame(log, &f) == JSL_OK; frames++)
        for (int64_t i = 0; i < f.particles.count; i++) {
            assert_true(f.particles.px[i] == (float)(i + f.step));
            assert_true(f.particles.pz[i] == (float)(i + 2000 + f.step));
        }
    (void)jsl_log_verify(log, info);
    jsl_log_close(log);
    return frames;
}

static void missing_duplicate_and_reordered_chunks_are_told_apart(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    jsl_log_info info;
    builder b = {0};
    const int order[] = {3, 0, 4, 1, 2};
    for (int i = 0; i < 5; i++) add_chunk(&b, 1, order[i], 5); /* reordered */
    for (int i = 1; i < 5; i++) add_chunk(&b, 2, i, 5);        /* chunk 0 is missing */
    for (int i = 0; i < 5; i++) {                              /* each twice */
        add_chunk(&b, 3, i, 5);
        add_chunk(&b, 3, i, 5);
    }
    for (int i = 0; i < 5; i++) { /* two frames interleaved, the earlier one late */
        add_chunk(&b, 5, i, 5);
        add_chunk(&b, 4, 4 - i, 5);
    }
    assert_i64(count_whole(path, &b, &info), 4);
    assert_i64(info.particle_frames, 4);
    assert_i64(info.incomplete_frames, 1);
    assert_i64(info.duplicate_chunks, 5);
    assert_true(info.backward_times > 0);
    free(b.bytes);
    unlink(path);
}

static void a_chunk_with_a_wrong_checksum_spoils_its_frame_only(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    jsl_log_info info;
    builder b = {0};
    for (int64_t step = 0; step < 3; step++)
        for (int i = 0; i < 3; i++) {
            add_chunk(&b, step, i, 3);
            if (step == 1 && i == 1) b.bytes[b.size - 5] ^= 1;
        }
    assert_i64(count_whole(path, &b, &info), 2);
    assert_i64(info.bad_frames, 1);
    assert_i64(info.holes, 0);
    free(b.bytes);
    unlink(path);
}

static void foreign_channels_and_sync_words_in_payloads_are_passed_over(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    jsl_log_info info;
    builder b = {0};
    uint8_t payload[400];
    for (int i = 0; i < 400; i += 4) jsl_put_u32(payload + i, JSL_EVENT_SYNC);
    for (int64_t step = 0; step < 20; step++) {
        add(&b, "CAMERA", payload, 400 - step, 5);
        add(&b, "EMPTY", payload, 0, 5);
        for (int i = 0; i < 2; i++) add_chunk(&b, step, i, 2);
        add(&b, "JOSTLE_PARTICLES", payload, 100, 5); /* our channel, not our type */
    }
    assert_i64(count_whole(path, &b, &info), 20);
    assert_i64(info.foreign_events, 60);
    assert_i64(info.events, 100);
    assert_i64(info.holes, 0);
    /* A wrong length in an event full of sync words: the search goes through all of them. */
    jsl_put_u32(b.bytes + 24, 0x7fffffff);
    assert_i64(count_whole(path, &b, &info), 20);
    assert_i64(info.events, 99);
    free(b.bytes);
    unlink(path);
}

static void joined_and_appended_logs_are_read_to_the_end(void **state) {
    const sample *s = *state;
    char path[256];
    log_temp_path(path);
    uint8_t *two = malloc(2 * (size_t)s->size);
    memcpy(two, s->bytes, (size_t)s->size);
    memcpy(two + s->size, s->bytes, (size_t)s->size);
    outcome o = read_all(path, two, 2 * s->size);
    assert_i64(o.events, 2 * s->events);
    assert_i64(o.info.holes, 0);
    assert_i64(o.info.backward_times, 1);
    /* Appended after the last event of the first was cut off: stock readers see none of the second.
     */
    int64_t cut = s->offset[s->events - 1] + 50;
    memcpy(two + cut, s->bytes, (size_t)s->size);
    o = read_all(path, two, cut + s->size);
    assert_i64(o.events, 2 * s->events - 1);
    assert_i64(o.damage, 1);
    assert_i64(o.info.holes, 1);
    assert_i64(o.info.hole_bytes, 50);
    free(two);
    unlink(path);
}

static void hostile_counts_allocate_nothing_and_end(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    builder b = {0};
    jsl_log_info info;
    const uint32_t counts[] = {0x7fffffff, 0xffffffff, 0x80000000, 0, 1 << 20};
    for (int k = 0; k < 5; k++)
        for (int64_t at = 40; at < 106; at++) {
            add_chunk(&b, 7, 0, 1);
            uint8_t *data = b.bytes + b.size - (JSL_STATE_HEAD + JSL_COLUMN_HEAD + 192);
            jsl_put_u32(data + at, counts[k]);
        }
    add_chunk(&b, 9, 0, 1);
    log_write_file(path, b.bytes, b.size);
    jsl_log_file *log;
    jsl_frame f;
    assert_ok(jsl_log_open(path, NULL, &log));
    while (jsl_log_next_frame(log, &f) == JSL_OK) assert_true(f.particles.count <= 16);
    assert_i64(f.step, 9);
    (void)jsl_log_verify(log, &info);
    assert_i64(info.events, 5 * 66 + 1);
    jsl_log_close(log);
    free(b.bytes);
    unlink(path);
}

/* -- Random damage
 * -------------------------------------------------------------------------------------------- */

static void random_damage_is_survived(void **state) {
    const sample *s = *state;
    char path[256];
    log_temp_path(path);
    const char *text = getenv("JSL_TEST_SEED"), *rounds_text = getenv("JSL_TEST_ROUNDS");
    uint64_t seed = text ? strtoull(text, NULL, 0) : 20240229;
    int rounds = rounds_text ? atoi(rounds_text) : 600;
    print_message("seed %llu, %d rounds\n", (unsigned long long)seed, rounds);
    uint8_t *copy = malloc(3 * (size_t)s->size);
    for (int round = 0; round < rounds; round++) {
        int64_t size = s->size;
        memcpy(copy, s->bytes, (size_t)size);
        int edits = 1 + (int)(test_random(&seed) % 12);
        for (int i = 0; i < edits; i++) {
            int64_t at = (int64_t)(test_random(&seed) % (uint64_t)size);
            int64_t n = (int64_t)(test_random(&seed) % 200);
            if (n > size - at) n = size - at;
            int64_t from = (int64_t)(test_random(&seed) % (uint64_t)(size - n + 1));
            switch (test_random(&seed) % 6) {
            case 0:
                copy[at] = (uint8_t)test_random(&seed);
                break;
            case 1: /* a length or count somewhere in a header or a message */
                at = s->offset[test_random(&seed) % (uint64_t)s->events] +
                     (int64_t)(test_random(&seed) % 120);
                if (at + 4 <= size)
                    jsl_put_u32(copy + at, (uint32_t)test_random(&seed) >> test_random(&seed) % 32);
                break;
            case 2:
                memmove(copy + at, copy + from, (size_t)n);
                break;
            case 3: /* cut out */
                memmove(copy + at, copy + at + n, (size_t)(size - at - n));
                size -= n;
                break;
            case 4:
                memset(copy + at, (int)test_random(&seed), (size_t)n);
                break;
            default: /* put in twice */
                if (size + n < 3 * s->size) {
                    memmove(copy + at + n, copy + at, (size_t)(size - at));
                    size += n;
                }
                break;
            }
            if (size < 2) break;
        }
        read_all(path, copy, size);
    }
    free(copy);
    unlink(path);
}

/* -- Large
 * ----------------------------------------------------------------------------------------------------
 */

/* A frame before and one behind 5 GiB of a sparse file: offsets need more than 32 bits. */
static void logs_above_4_gib_are_read(void **state) {
    (void)state;
    if (sizeof(void *) < 8) {
        print_message("skipped: a 32-bit address space cannot map it\n");
        skip();
    }
    char path[256];
    log_temp_path(path);
    builder b = {0};
    add_chunk(&b, 1, 0, 1);
    int64_t first = b.size;
    /* Events of 1 GiB each on a foreign channel, their payloads never written. */
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(b.bytes, 1, (size_t)first, f), first);
    int64_t at = first;
    bool room = true;
    for (int i = 0; i < 5; i++, at += JSL_EVENT_HEAD + 3 + (1 << 30)) {
        uint8_t head[JSL_EVENT_HEAD];
        jsl_event_put_head(head, i, 2, 3, 1 << 30);
        room = room && fseeko(f, at, SEEK_SET) == 0 &&
               fwrite(head, 1, sizeof head, f) == sizeof head && fwrite("BIG", 1, 3, f) == 3;
    }
    builder tail = {.number = 9};
    add_chunk(&tail, 2, 0, 1);
    room = room && fseeko(f, at, SEEK_SET) == 0 &&
           fwrite(tail.bytes, 1, (size_t)tail.size, f) == (size_t)tail.size;
    room = fclose(f) == 0 && room;
    free(b.bytes);
    free(tail.bytes);
    if (!room) {
        unlink(path);
        print_message("skipped: the folder for temporary files has no sparse files of 5 GiB\n");
        skip();
    }
    jsl_log_file *log;
    jsl_frame frame;
    jsl_log_info info;
    assert_ok(jsl_log_open(path, NULL, &log));
    assert_ok(jsl_log_next_frame(log, &frame));
    assert_ok(jsl_log_next_frame(log, &frame));
    assert_i64(frame.step, 2);
    assert_true(frame.particles.px[3] == 5);
    assert_ok(jsl_log_verify(log, &info));
    assert_i64(info.events, 7);
    assert_true(info.file_bytes > 5ll << 30);
    jsl_log_close(log);
    unlink(path);
}

static void an_empty_file_and_one_of_noise_hold_nothing(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    outcome o = read_all(path, "", 0);
    assert_i64(o.events + o.info.holes, 0);
    uint8_t noise[5000];
    uint64_t seed = 11;
    for (int i = 0; i < 5000; i++) noise[i] = (uint8_t)test_random(&seed);
    o = read_all(path, noise, 5000);
    assert_i64(o.events, 0);
    assert_i64(o.info.holes, 1);
    assert_i64(o.info.hole_bytes, 5000);
    unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_whole_log_is_sound),
        cmocka_unit_test(every_truncation_leaves_the_whole_events_before_it),
        cmocka_unit_test(a_flipped_header_byte_costs_that_event_at_most),
        cmocka_unit_test(the_largest_length_is_survived),
        cmocka_unit_test(a_hole_of_zeros_costs_only_what_it_covers),
        cmocka_unit_test(missing_duplicate_and_reordered_chunks_are_told_apart),
        cmocka_unit_test(a_chunk_with_a_wrong_checksum_spoils_its_frame_only),
        cmocka_unit_test(foreign_channels_and_sync_words_in_payloads_are_passed_over),
        cmocka_unit_test(joined_and_appended_logs_are_read_to_the_end),
        cmocka_unit_test(hostile_counts_allocate_nothing_and_end),
        cmocka_unit_test(random_damage_is_survived),
        cmocka_unit_test(logs_above_4_gib_are_read),
        cmocka_unit_test(an_empty_file_and_one_of_noise_hold_nothing),
    };
    return cmocka_run_group_tests_name("log damage", tests, group_setup, group_teardown);
}
