/* SPDX-License-Identifier: MIT
 * Components of any fields through the publisher into a log, back as arrays, and out as tables.
 */
#include "log_fixture.h"

#define EVERY_FIELDS(X)                                                                            \
    X(real, r, "m", JSL_STATE)                                                                     \
    X(f32, f, "K", JSL_CACHE)                                                                      \
    X(f64, d, "", JSL_STATE)                                                                       \
    X(i8, b, "1", JSL_STATE)                                                                       \
    X(u8, ub, "", JSL_STATE)                                                                       \
    X(i16, s, "", JSL_STATE)                                                                       \
    X(u16, us, "", JSL_STATE)                                                                      \
    X(i32, i, "", JSL_STATE)                                                                       \
    X(u32, ui, "", JSL_DERIVED)                                                                    \
    X(i64, l, "", JSL_STATE)                                                                       \
    X(u64, ul, "a,\"b", JSL_STATE)                                                                 \
    X(entity, id, "", JSL_STATE)                                                                   \
    X(f32, hidden, "", JSL_SCRATCH)
JSL_COMPONENT_COLUMNS(every, EVERY_FIELDS)
JSL_COMPONENT_FIELDS(every, EVERY_FIELDS);
#define PUBLISHED 12 /* all but the scratch one */

typedef struct user_world {
    log_world w;
    jsl_component every, tag;
} user_world;

static void set_rows(const jsl_rows *rows, int64_t base, int64_t step) {
    every_columns c = every_of(rows, 0);
    for (int64_t i = 0; i < rows->count; i++) {
        int64_t v = base + i + step * 7;
        c.r[i] = (jsl_real)v / 8;
        c.f[i] = (float)v / 4;
        c.d[i] = (double)v / 3;
        c.b[i] = (int8_t)-v;
        c.ub[i] = (uint8_t)v;
        c.s[i] = (int16_t)-v;
        c.us[i] = (uint16_t)v;
        c.i[i] = (int32_t)-v;
        c.ui[i] = (uint32_t)v;
        c.l[i] = -v << 40;
        c.ul[i] = (uint64_t)v << 50;
        c.id[i] = rows->entity[i];
    }
}

static void set_all(user_world *u) {
    jsl_ecs *ecs = jsl_world_ecs(u->w.world);
    jsl_query q;
    jsl_rows rows;
    int64_t base = 0;
    assert_ok(jsl_query_create(ecs, &(jsl_query_desc){{{u->every, JSL_WRITE}}}, &q));
    for (jsl_iter it = jsl_query_begin(ecs, q, 0); jsl_query_next(&it, &rows); base += rows.count)
        set_rows(&rows, base, u->w.step);
}

/* n entities with all types of fields in two tables, m with a tag that has no field. */
static user_world make_world(int64_t n, int64_t m) {
    user_world u = {.w = log_world_make(20, 3, 2)};
    jsl_ecs *ecs = jsl_world_ecs(u.w.world);
    u.every = log_component(ecs, "every", every_fields, PUBLISHED + 1);
    u.tag = log_component(ecs, "tag", NULL, 0);
    const jsl_component both[] = {u.every, u.tag};
    if (n) assert_ok(jsl_entity_create_n(ecs, both, 1, n - n / 3, NULL, NULL));
    if (n / 3) assert_ok(jsl_entity_create_n(ecs, both, 2, n / 3, NULL, NULL));
    if (m) assert_ok(jsl_entity_create_n(ecs, &u.tag, 1, m, NULL, NULL));
    set_all(&u);
    return u;
}

static jsl_publisher_stats log_world_to(user_world *u, const jsl_publisher_desc *desc, int steps) {
    jsl_publisher *p;
    jsl_publisher_stats s;
    assert_ok(jsl_publisher_create(desc, u->w.world, &p));
    for (int i = 0; i < steps; i++) {
        log_world_step(&u->w);
        set_all(u);
        assert_ok(jsl_publisher_step(p, NULL));
    }
    assert_ok(jsl_publisher_close(p, &s));
    assert_i64(s.log.offered, s.log.sent + s.log.dropped + s.log.decimated + s.log.errors);
    return s;
}

static void check_every(const jsl_log_columns *f, int64_t n) {
    const char *const names[] = {"r", "f", "d", "b", "ub", "s", "us", "i", "ui", "l", "ul", "id"};
    assert_i64(f->count, n);
    assert_int_equal(f->field_count, PUBLISHED);
    for (int k = 0; k < PUBLISHED; k++) assert_string_equal(f->field[k].name, names[k]);
    assert_string_equal(f->field[1].unit, "K");
    assert_string_equal(f->field[10].unit, "a,\"b");
    assert_int_equal(f->field[0].type, sizeof(jsl_real) == 4 ? JSL_TYPE_F32 : JSL_TYPE_F64);
    for (int64_t i = 0; i < n; i++) {
        int64_t v = i + f->step * 7;
        assert_true(((const jsl_real *)f->field[0].data)[i] == (jsl_real)v / 8);
        assert_true(((const float *)f->field[1].data)[i] == (float)v / 4);
        assert_true(((const double *)f->field[2].data)[i] == (double)v / 3);
        assert_int_equal(((const int8_t *)f->field[3].data)[i], (int8_t)-v);
        assert_int_equal(((const uint8_t *)f->field[4].data)[i], (uint8_t)v);
        assert_int_equal(((const int16_t *)f->field[5].data)[i], (int16_t)-v);
        assert_int_equal(((const uint16_t *)f->field[6].data)[i], (uint16_t)v);
        assert_i64(((const int32_t *)f->field[7].data)[i], (int32_t)-v);
        assert_int_equal(((const uint32_t *)f->field[8].data)[i], (uint32_t)v);
        assert_i64(((const int64_t *)f->field[9].data)[i], -v << 40);
        assert_true(((const uint64_t *)f->field[10].data)[i] == (uint64_t)v << 50);
        assert_true(((const uint64_t *)f->field[11].data)[i] == f->id[i] && f->id[i] != 0);
    }
}

/* By default a user's own components are logged and the built-in ones are not. */
static void a_component_comes_back_bit_for_bit(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    const int64_t sizes[] = {0, 1, 5000}; /* none, one chunk, several */
    for (int k = 0; k < 3; k++) {
        user_world u = make_world(sizes[k], 4);
        jsl_publisher_desc desc = {.log_path = path,
                                   .components_hz = 64, /* of 128 steps a second */
                                   .particles_hz = -1,
                                   .boids_hz = -1,
                                   .bodies_hz = -1,
                                   .when_full = JSL_FULL_BLOCK};
        jsl_publisher_stats s = log_world_to(&u, &desc, 8);
        assert_i64(s.frames_offered, 2 * 9);
        assert_i64(s.frames_sent, 2 * 5);
        jsl_log_file *log;
        jsl_log_columns f;
        static jsl_log_info info;
        assert_ok(jsl_log_open(path, NULL, &log));
        for (int round = 0; round < 2; round++) { /* by the index, and by one hop */
            int64_t frames = 0;
            jsl_log_rewind(log);
            for (; jsl_log_next_columns(log, "every", &f) == JSL_OK; frames++) {
                assert_i64(f.step, frames * 2);
                assert_string_equal(f.component, "every");
                check_every(&f, sizes[k]);
            }
            assert_i64(frames, 5);
            jsl_log_rewind(log);
            for (frames = 0; jsl_log_next_columns(log, NULL, &f) == JSL_OK; frames++)
                if (strcmp(f.component, "tag") == 0) {
                    assert_i64(f.count, sizes[k] / 3 + 4);
                    assert_int_equal(f.field_count, 0);
                }
            assert_i64(frames, 10);
            assert_ok(jsl_log_verify(log, &info));
        }
        assert_i64(info.component_frames, 10);
        assert_i64(info.incomplete_frames + info.bad_frames + info.holes, 0);
        assert_i64(info.frames_offered, 18);
        jsl_log_close(log);
        jsl_world_destroy(u.w.world);
    }
    unlink(path);
}

static void only_the_components_named_are_published(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    user_world u = make_world(30, 0);
    const char *const names[] = {"position", "tag"}, *const wrong[] = {"tag", "tga"};
    jsl_publisher_desc desc = {
        .log_path = path, .components = wrong, .component_count = 2, .when_full = JSL_FULL_BLOCK};
    jsl_publisher *p;
    assert_result(jsl_publisher_create(&desc, u.w.world, &p), JSL_ERR_NAME);
    assert_int_not_equal(access(path, F_OK), 0);
    desc.component_count = -1;
    assert_result(jsl_publisher_create(&desc, u.w.world, &p), JSL_ERR_ARGUMENT);
    desc.components = names;
    desc.component_count = 2;
    log_world_to(&u, &desc, 1);
    jsl_log_file *log;
    jsl_log_columns f;
    assert_ok(jsl_log_open(path, NULL, &log));
    assert_result(jsl_log_next_columns(log, "every", &f), JSL_ERR_END);
    jsl_log_rewind(log);
    assert_ok(jsl_log_next_columns(log, "position", &f));
    assert_i64(f.count, 25);
    assert_string_equal(f.field[2].name, "pz");
    jsl_log_close(log);
    desc.components_hz = -1;
    assert_i64(log_world_to(&u, &desc, 1).frames_offered, 2 * 3); /* the three kinds only */
    jsl_world_destroy(u.w.world);
    unlink(path);
}

/* A queue of 1 MiB and frames of 0.7 MB back to back, then frames that never fit. */
static void dropped_frames_are_counted_and_never_halved(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    for (int large = 0; large < 2; large++) {
        user_world u = make_world(large ? 20000 : 9000, 0);
        jsl_publisher_desc desc = {
            .log_path = path, .components_hz = 1e6, .keyframe_seconds = -1, .queue_bytes = 1 << 20};
        jsl_publisher_stats s = log_world_to(&u, &desc, 40);
        jsl_world_destroy(u.w.world);
        jsl_log_file *log;
        jsl_log_columns f;
        static jsl_log_info info;
        int64_t whole = 0;
        assert_ok(jsl_log_open(path, NULL, &log));
        while (jsl_log_next_columns(log, "every", &f) == JSL_OK) whole += f.count == 9000;
        assert_ok(jsl_log_verify(log, &info)); /* nothing incomplete */
        jsl_log_close(log);
        assert_i64(s.frames_offered, 5 * 41); /* three kinds and two components */
        assert_i64(info.frames_dropped, s.frames_dropped);
        assert_i64(info.component_frames + info.body_frames + info.boid_frames +
                       info.particle_frames,
                   s.frames_sent);
        if (large) assert_true(whole == 0 && s.frames_dropped >= 41);
        if (!large) assert_true(whole > 0);
    }
    unlink(path);
}

static void every_component_of_a_mixed_world_is_built_in(void **state) {
    (void)state;
    jsl_world *world;
    assert_ok(jsl_world_create(&(jsl_world_desc){0}, &world));
    assert_ok(jsl_world_use_particles(world));
    assert_ok(jsl_world_use_flocks(world));
    assert_ok(jsl_world_use_bodies(world));
    assert_ok(jsl_look_set_n(world, NULL, 0, 0xffffffff));
    jsl_ecs *ecs = jsl_world_ecs(world);
    assert_true(jsl_component_count(ecs) > 10);
    for (int i = 0; i < jsl_component_count(ecs); i++)
        assert_true(jsl_component_is_built_in(jsl_component_info(ecs, i)->name));
    assert_false(jsl_component_is_built_in("temperature"));
    assert_false(jsl_component_is_built_in(NULL));
    jsl_world_destroy(world);
}

/* -- Damage
 * -------------------------------------------------------------------------------------------- */

static int64_t read_columns(const char *path, const void *bytes, int64_t size) {
    jsl_log_file *log;
    jsl_log_columns f;
    int64_t frames = 0;
    uint64_t sum = 0;
    log_write_file(path, bytes, size);
    assert_ok(jsl_log_open(path, NULL, &log));
    for (; jsl_log_next_columns(log, NULL, &f) == JSL_OK; frames++)
        for (int k = 0; k < f.field_count; k++)
            for (int64_t i = 0; i < f.count * jsl_type_size(f.field[k].type); i++)
                sum +=
                    ((const uint8_t *)f.field[k].data)[i] + f.id[i / 8] + strlen(f.field[k].unit);
    assert_true(sum != 1);
    jsl_log_close(log);
    return frames;
}

/* Under sanitizers: no byte outside the file is read. One changed byte costs one frame at most. */
static void truncation_and_mutation_are_survived(void **state) {
    (void)state;
    char path[256];
    log_temp_path(path);
    user_world u = make_world(30, 2);
    jsl_publisher_desc desc = {.log_path = path,
                               .components_hz = 128,
                               .particles_hz = -1,
                               .boids_hz = -1,
                               .bodies_hz = -1,
                               .keyframe_seconds = -1,
                               .when_full = JSL_FULL_BLOCK};
    log_world_to(&u, &desc, 4);
    jsl_world_destroy(u.w.world);
    int64_t size, last = 0;
    uint8_t *bytes = log_read_file(path, &size);
    assert_i64(read_columns(path, bytes, size), 10);
    for (int64_t cut = 0; cut < size; cut += 31) {
        int64_t frames = read_columns(path, bytes, cut);
        assert_true(frames >= last && frames <= 10);
        last = frames;
    }
    assert_i64(last, 10);
    uint64_t seed = 11;
    for (int i = 0; i < 2000; i++) {
        int64_t at = (int64_t)(test_random(&seed) % (uint64_t)size);
        uint8_t old = bytes[at];
        bytes[at] ^= (uint8_t)(1 + test_random(&seed) % 255);
        int64_t frames = read_columns(path, bytes, size);
        assert_true(frames >= 9 && frames <= 10);
        bytes[at] = old;
    }
    free(bytes);
    unlink(path);
}

/* -- Export
 * -------------------------------------------------------------------------------------------- */

static char *export_text(const char *log_path, const jsl_export_desc *desc, int64_t rows) {
    jsl_log_file *log;
    jsl_export_stats s;
    int64_t size;
    assert_ok(jsl_log_open(log_path, NULL, &log));
    assert_ok(jsl_log_export(log, desc, &s));
    jsl_log_close(log);
    assert_i64(s.rows, rows);
    assert_i64(s.lost, 0);
    char *text = (char *)log_read_file(desc->path, &size);
    text[size] = 0;
    unlink(desc->path);
    return text;
}

static void a_log_is_exported_as_csv(void **state) {
    (void)state;
    char path[256], table[256], line[512];
    log_temp_path(path);
    log_temp_path(table);
    user_world u = make_world(5, 0);
    jsl_publisher_desc desc = {
        .log_path = path, .components_hz = 128, .boids_hz = 128, .when_full = JSL_FULL_BLOCK};
    log_world_to(&u, &desc, 8);
    jsl_world_destroy(u.w.world);
    jsl_export_desc e = {
        .path = table, .channel = "every", .from = 2.0 / 128, .to = 6.0 / 128, .every = 2};
    char *text = export_text(path, &e, 3 * 5); /* steps 2, 4, 6 */
    char *at = text;
    const char *head = "step,time [s],id,r [m],f [K],d,b [1],ub,s,us,i,ui,l,\"ul [a,\"\"b]\",id_\n";
    assert_memory_equal(at, head, strlen(head));
    at += strlen(head);
    for (int64_t row = 0; row < 15; row++) {
        int64_t step = 2 + row / 5 * 2, v = row % 5 + step * 7;
        unsigned long long id;
        int n = 0;
        assert_int_equal(sscanf(at, "%*d,%*d.%*d,%llu", &id), 1);
        n = snprintf(line, sizeof line,
                     "%lld,0.%09lld,%llu,%.9g,%.9g,%.17g,%d,%d,%d,%d,%d,%d,%lld,%llu,%llu\n",
                     (long long)step, (long long)step * 7812500, id, (double)v / 8, (double)v / 4,
                     (double)v / 3, (int8_t)-v, (uint8_t)v, (int16_t)-v, (uint16_t)v, (int)-v,
                     (int)v, (long long)(-v << 40), (unsigned long long)v << 50, id);
        assert_memory_equal(at, line, (size_t)n);
        at += n;
    }
    assert_int_equal(*at, 0);
    free(text);
    /* Boids have ids in the first frame only: later ones are in the same order. */
    e = (jsl_export_desc){.path = table, .channel = "boids", .from = 8.0 / 128};
    text = export_text(path, &e, 3);
    head = "step,time [s],id,px [m],py [m],pz [m],vx [m/s],vy [m/s],vz [m/s],ax [m/s^2],"
           "ay [m/s^2],az [m/s^2],rgba\n8,0.062500000,";
    assert_memory_equal(text, head, strlen(head));
    assert_true(strtoull(text + strlen(head), NULL, 10) > 0);
    assert_non_null(strstr(text, ",2,0,0,1,-2,0.5,767\n")); /* velocity to colour of the third */
    free(text);
    unlink(path);
}

static void what_cannot_be_exported_is_refused(void **state) {
    (void)state;
    char path[256], table[256];
    log_temp_path(path);
    log_temp_path(table);
    user_world u = make_world(5, 0);
    log_world_to(&u, &(jsl_publisher_desc){.log_path = path}, 1);
    jsl_world_destroy(u.w.world);
    jsl_log_file *log;
    assert_ok(jsl_log_open(path, NULL, &log));
    jsl_export_desc e = {.path = table};
    assert_result(jsl_log_export(log, &e, NULL), JSL_ERR_CONFLICT);
    e.channel = "nothing";
    assert_result(jsl_log_export(log, &e, NULL), JSL_ERR_NAME);
    e.channel = "";
    assert_result(jsl_log_export(log, &e, NULL), JSL_ERR_NAME);
    e.channel = "every";
    e.every = -1;
    assert_result(jsl_log_export(log, &e, NULL), JSL_ERR_ARGUMENT);
    e.every = 0;
    e.from = (double)NAN;
    assert_result(jsl_log_export(log, &e, NULL), JSL_ERR_NOT_FINITE);
    assert_int_not_equal(access(table, F_OK), 0);
    e = (jsl_export_desc){.path = "/nonexistent/table", .channel = "every"};
    assert_result(jsl_log_export(log, &e, NULL), JSL_ERR_IO);
    jsl_log_close(log);
    unlink(path);
}

static uint64_t little(const uint8_t *p, int n) {
    uint64_t v = 0;
    while (n--) v = v << 8 | p[n];
    return v;
}

/* A member's values behind its zip and .npy headers. */
static const uint8_t *find_member(const uint8_t *zip, int64_t size, const char *name,
                                  const char *header) {
    for (int64_t at = 0; at + 30 < size && little(zip + at, 4) == 0x04034b50;) {
        int64_t n = (int64_t)little(zip + at + 26, 2);
        const uint8_t *extra = zip + at + 30 + n, *npy = extra + 20;
        if ((size_t)n == strlen(name) && memcmp(zip + at + 30, name, (size_t)n) == 0) {
            assert_memory_equal(npy, "\x93NUMPY\1\0v\0", 10);
            assert_memory_equal(npy + 10, header, strlen(header));
            assert_int_equal(npy[127], '\n');
            return npy + 128;
        }
        at = npy - zip + (int64_t)little(extra + 4, 8);
    }
    return NULL;
}

static void a_log_is_exported_as_npz(void **state) {
    (void)state;
    char path[256], table[256];
    log_temp_path(path);
    log_temp_path(table);
    user_world u = make_world(5, 0);
    log_world_to(&u, &(jsl_publisher_desc){.log_path = path, .components_hz = 128}, 3);
    jsl_world_destroy(u.w.world);
    int64_t size;
    jsl_log_file *log;
    assert_ok(jsl_log_open(path, NULL, &log));
    jsl_export_desc e = {.path = table, .format = JSL_EXPORT_NPZ, .channel = "every"};
    assert_ok(jsl_log_export(log, &e, NULL));
    jsl_log_close(log);
    uint8_t *zip = log_read_file(table, &size);
    const uint8_t *step = find_member(zip, size, "step.npy",
                                      "{'descr': '<i8', 'fortran_order': False, 'shape': (20,), }");
    const uint8_t *d = find_member(zip, size, "d.npy",
                                   "{'descr': '<f8', 'fortran_order': False, 'shape': (20,), }");
    const uint8_t *us = find_member(zip, size, "us.npy",
                                    "{'descr': '<u2', 'fortran_order': False, 'shape': (20,), }");
    assert_true(step && d && us);
    for (int64_t i = 0; i < 20; i++) {
        double x;
        memcpy(&x, d + i * 8, 8);
        assert_i64(little(step + i * 8, 8), i / 5);
        assert_true(x == (double)(i % 5 + i / 5 * 7) / 3);
        assert_int_equal(little(us + i * 2, 2), i % 5 + i / 5 * 7);
    }
    assert_null(find_member(zip, size, "hidden.npy", ""));
    free(zip);
    unlink(table);
    unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_component_comes_back_bit_for_bit),
        cmocka_unit_test(only_the_components_named_are_published),
        cmocka_unit_test(dropped_frames_are_counted_and_never_halved),
        cmocka_unit_test(every_component_of_a_mixed_world_is_built_in),
        cmocka_unit_test(truncation_and_mutation_are_survived),
        cmocka_unit_test(a_log_is_exported_as_csv),
        cmocka_unit_test(what_cannot_be_exported_is_refused),
        cmocka_unit_test(a_log_is_exported_as_npz),
    };
    return cmocka_run_group_tests_name("component_log", tests, NULL, NULL);
}
