/* SPDX-License-Identifier: MIT
 * Images: they bring everything back, in either precision, and damaged ones are refused.
 */
#include "ecs_fixture.h"
#include "ecs_images.h"

#include <ecs/image.h>

#include <stdlib.h>

#define P (1u << PLACE)
#define V (1u << PACE)
#define M (1u << MIXED)
#define L (1u << LINK)
#define T (1u << TAG)
#define R (1u << RANK)

/* Some tables, some free slots, a retired one would take a million steps. */
static void populate(ecs_fixture *f, int64_t n) {
    jsl_entity *e = malloc((size_t)n * 4 * sizeof *e);
    assert_non_null(e);
    fixture_create(f, P | M, n, e);
    fixture_create(f, P | V | T, n, e + n);
    fixture_create(f, L | R, n, e + 2 * n);
    fixture_create(f, 0, n, e + 3 * n);
    for (int64_t i = 0; i < 4 * n; i += 3) assert_ok(jsl_entity_destroy(f->ecs, e[i]));
    fixture_create(f, P | L, n / 2, NULL);
    fixture_fill(f);
    free(e);
}

static void assert_same(const ecs_fixture *a, const ecs_fixture *b) {
    size_t size[2];
    void *image[2] = {fixture_save(a, &size[0]), fixture_save(b, &size[1])};
    assert_true(size[0] == size[1] && memcmp(image[0], image[1], size[0]) == 0);
    assert_true(jsl_ecs_hash(a->ecs) == jsl_ecs_hash(b->ecs));
    free(image[0]);
    free(image[1]);
}

static void restoring_brings_back_handles_slots_order_and_values(void **state) {
    (void)state;
    ecs_fixture f, g;
    size_t size;
    fixture_open(&f);
    fixture_open(&g);
    populate(&f, 70);
    populate(&g, 20); /* to be replaced */
    void *image = fixture_save(&f, &size);
    for (int round = 0; round < 2; round++) {
        assert_ok(jsl_ecs_restore(g.ecs, image, size));
        fixture_validate(&g);
        assert_same(&f, &g);
        jsl_rows a, b;
        jsl_iter i = jsl_query_begin(f.ecs, fixture_query(&f, 0, 0), 0);
        jsl_iter j = jsl_query_begin(g.ecs, fixture_query(&g, 0, 0), 0);
        while (jsl_query_next(&i, &a)) {
            assert_true(jsl_query_next(&j, &b));
            assert_i64(a.count, b.count);
            for (int64_t k = 0; k < a.count; k++)
                assert_true(jsl_entity_id(a.entity[k]) == jsl_entity_id(b.entity[k]));
        }
    }
    /* The same calls go on giving the same handles. */
    jsl_entity e[100], h[100];
    fixture_create(&f, V, 100, e);
    fixture_create(&g, V, 100, h);
    for (int k = 0; k < 100; k++) assert_true(jsl_entity_id(e[k]) == jsl_entity_id(h[k]));
    free(image);
    fixture_close(&f);
    fixture_close(&g);
}

static void references_belong_to_the_restoring_ecs(void **state) {
    (void)state;
    ecs_fixture f, g;
    jsl_entity e[2];
    size_t size;
    fixture_open(&f);
    fixture_open(&g);
    fixture_create(&f, L, 2, e);
    *(jsl_entity *)jsl_entity_field(f.ecs, e[0], f.component[LINK], 0) = e[1];
    void *image = fixture_save(&f, &size);
    assert_ok(jsl_ecs_restore(g.ecs, image, size));
    jsl_entity first = jsl_entity_at(g.ecs, 1);
    jsl_entity next = *(jsl_entity *)jsl_entity_field(g.ecs, first, g.component[LINK], 0);
    assert_true(jsl_entity_is_alive(g.ecs, next));
    assert_int_equal(next.index, 2);
    first = jsl_entity_at(g.ecs, 2);
    next = *(jsl_entity *)jsl_entity_field(g.ecs, first, g.component[LINK], 0);
    assert_true(next.index == 0 && next.generation == 0);
    free(image);
    fixture_close(&f);
    fixture_close(&g);
}

static void derived_and_scratch_fields_come_back_zero(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[50];
    size_t size;
    fixture_open(&f);
    fixture_create(&f, M, 50, e);
    for (int i = 0; i < 50; i++) {
        *(jsl_real *)jsl_entity_field(f.ecs, e[i], f.component[MIXED], 7) = 3;
        *(uint32_t *)jsl_entity_field(f.ecs, e[i], f.component[MIXED], 8) = 4;
    }
    void *image = fixture_save(&f, &size);
    assert_ok(jsl_ecs_restore(f.ecs, image, size));
    for (int i = 0; i < 50; i++) {
        assert_true(*(jsl_real *)jsl_entity_field(f.ecs, e[i], f.component[MIXED], 7) == 0);
        assert_true(*(uint32_t *)jsl_entity_field(f.ecs, e[i], f.component[MIXED], 8) == 0);
    }
    free(image);
    fixture_close(&f);
}

static void an_empty_ecs_can_be_saved_and_restored(void **state) {
    (void)state;
    ecs_fixture f;
    size_t size;
    fixture_open(&f);
    void *image = fixture_save(&f, &size);
    populate(&f, 10);
    assert_ok(jsl_ecs_restore(f.ecs, image, size));
    assert_i64(jsl_entity_count(f.ecs), 0);
    jsl_entity e;
    fixture_create(&f, P, 1, &e);
    assert_int_equal(e.index, 1);
    free(image);
    fixture_close(&f);
}

static void buffers_that_are_too_small_are_refused(void **state) {
    (void)state;
    ecs_fixture f;
    unsigned char bytes[4096];
    fixture_open(&f);
    fixture_create(&f, P, 3, NULL);
    size_t size = jsl_ecs_save_size(f.ecs);
    memset(bytes, 0x5a, sizeof bytes);
    assert_result(jsl_ecs_save(f.ecs, bytes, size - 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_ecs_save(f.ecs, NULL, size), JSL_ERR_ARGUMENT);
    assert_int_equal(bytes[0], 0x5a);
    assert_ok(jsl_ecs_save(f.ecs, bytes, sizeof bytes));
    for (size_t i = size; i < sizeof bytes; i++) assert_int_equal(bytes[i], 0x5a);
    assert_result(jsl_ecs_restore(f.ecs, bytes, sizeof bytes), JSL_ERR_FORMAT);
    assert_result(jsl_ecs_restore(f.ecs, NULL, size), JSL_ERR_ARGUMENT);
    assert_ok(jsl_ecs_restore(f.ecs, bytes, size));
    fixture_close(&f);
}

/* Restores a copy in memory of exactly that size, and expects a refusal that changes nothing. */
static jsl_result restore_copy(ecs_fixture *f, const void *bytes, size_t size) {
    void *copy = malloc(size ? size : 1);
    assert_non_null(copy);
    memcpy(copy, bytes, size);
    jsl_result r = jsl_ecs_restore(f->ecs, copy, size);
    free(copy);
    return r;
}

static void every_truncation_and_every_changed_byte_is_refused(void **state) {
    (void)state;
    ecs_fixture f;
    size_t size;
    fixture_open(&f);
    populate(&f, 12);
    unsigned char *image = fixture_save(&f, &size);
    uint64_t before = jsl_ecs_hash(f.ecs);
    for (size_t n = 0; n < size; n++) assert_result(restore_copy(&f, image, n), JSL_ERR_FORMAT);
    const unsigned char flips[] = {0x01, 0x80, 0xff};
    for (size_t i = 0; i < size; i++) {
        for (int k = 0; k < JSL_COUNT(flips); k++) {
            image[i] ^= flips[k];
            jsl_result r = restore_copy(&f, image, size);
            assert_true(r == JSL_ERR_FORMAT || r == JSL_ERR_VERSION);
            image[i] ^= flips[k];
        }
        assert_true(before == jsl_ecs_hash(f.ecs));
    }
    fixture_validate(&f);
    assert_ok(restore_copy(&f, image, size));
    free(image);
    fixture_close(&f);
}

static void seal(const ecs_fixture *f, unsigned char *image, size_t size) {
    jsl_image_sum lanes = jsl_image_sum_begin();
    size_t n = size - 8, whole = n - n % JSL_SUM_BYTES;
    jsl_image_sum_mix(f->ecs, &lanes, image, whole);
    uint64_t sum = jsl_image_sum_end(&lanes, image + whole, n - whole);
    memcpy(image + n, &sum, 8);
}

/* A forger can compute the checksum too: then the rest of the checks must hold. */
static void forged_images_never_leave_an_unsound_ecs(void **state) {
    (void)state;
    ecs_fixture f;
    size_t size;
    fixture_open(&f);
    populate(&f, 12);
    unsigned char *image = fixture_save(&f, &size);
    uint64_t before = jsl_ecs_hash(f.ecs), random = 5;
    int refused = 0;
    for (size_t i = 0; i < size - 8; i++) {
        for (int k = 0; k < 4; k++) {
            unsigned char old = image[i];
            image[i] = (unsigned char)(k == 0 ? 0xff : k == 1 ? 0 : test_random(&random));
            seal(&f, image, size);
            jsl_result r = restore_copy(&f, image, size);
            image[i] = old;
            fixture_validate(&f);
            if (r == JSL_OK) {
                seal(&f, image, size);
                assert_ok(jsl_ecs_restore(f.ecs, image, size));
            } else {
                assert_true(r == JSL_ERR_FORMAT || r == JSL_ERR_VERSION);
                refused++;
            }
            assert_true(before == jsl_ecs_hash(f.ecs));
        }
    }
    assert_true(refused > 1000);
    free(image);
    fixture_close(&f);
}

static void other_schemas_are_refused_as_of_another_version(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_ecs *other;
    jsl_component c;
    test_log log;
    size_t size;
    fixture_open(&f);
    fixture_create(&f, P, 3, NULL);
    void *image = fixture_save(&f, &size);
    for (int way = 0; way < 6; way++) {
        jsl_field fields[3];
        memcpy(fields, fixture_desc(PLACE)->fields, sizeof fields);
        jsl_component_desc desc = {"place", fields, 3, false};
        if (way == 1) desc.keeps_order = true;
        if (way == 2) fields[1].type = JSL_TYPE_F64;
        if (way == 3) fields[1].name = "q";
        if (way == 4) fields[1].unit = "km";
        if (way == 5) fields[1].role = JSL_CACHE;
        assert_ok(jsl_ecs_create(&(jsl_ecs_desc){.logger = test_logger(&log)}, &other));
        if (way) assert_ok(jsl_component_register(other, &desc, &c));
        assert_result(jsl_ecs_restore(other, image, size), JSL_ERR_VERSION);
        assert_non_null(strstr(log.text, "place"));
        jsl_ecs_destroy(other);
    }
    /* Components that no table of the image has need not be known. */
    assert_ok(jsl_ecs_create(NULL, &other));
    assert_ok(jsl_component_register(other, fixture_desc(PLACE), &c));
    assert_ok(jsl_ecs_restore(other, image, size));
    assert_true(jsl_ecs_hash(other) == jsl_ecs_hash(f.ecs));
    jsl_ecs_destroy(other);
    free(image);
    fixture_close(&f);
}

static void images_of_either_precision_are_read(void **state) {
    (void)state;
    ecs_fixture f, g;
    fixture_open(&f);
    fixture_open(&g);
    populate(&f, 3); /* values that float and double both hold */
    assert_ok(jsl_ecs_restore(g.ecs, image_f32, sizeof image_f32));
    fixture_validate(&g);
    assert_same(&f, &g);
    assert_ok(jsl_ecs_restore(g.ecs, image_f64, sizeof image_f64));
    fixture_validate(&g);
    assert_same(&f, &g);
    size_t size;
    void *image = fixture_save(&f, &size); /* the format is what it was when these were written */
    const void *golden = sizeof(jsl_real) == 4 ? (const void *)image_f32 : image_f64;
    assert_true(size == (sizeof(jsl_real) == 4 ? sizeof image_f32 : sizeof image_f64));
    assert_memory_equal(image, golden, size);
    free(image);
    fixture_close(&f);
    fixture_close(&g);
}

static void jumble(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    ecs_fixture *f = user;
    place_columns p = place_of(rows, 0);
    for (int64_t i = 0; i < rows->count; i++) {
        uint64_t h = jsl_mix64(jsl_entity_id(rows->entity[i]) + context->step * 977);
        p.x[i] += (jsl_real)(h % 100);
        if (h % 17 == 0) jsl_defer_destroy(context, rows->entity[i]);
        if (h % 13 == 0) jsl_defer_create(context, &f->component[PLACE], 1, NULL, 0);
        if (h % 7 == 0) jsl_defer_add(context, rows->entity[i], &f->component[RANK], 1);
        if (h % 11 == 0) jsl_defer_remove(context, rows->entity[i], &f->component[RANK], 1);
    }
}

static void add_jumble(ecs_fixture *f) {
    assert_ok(jsl_system_register(f->ecs,
                                  &(jsl_system_desc){.name = "jumble",
                                                     .stage = JSL_STAGE_MOVE,
                                                     .query = {{{f->component[PLACE], JSL_WRITE}}},
                                                     .block = 32,
                                                     .run_rows = jumble,
                                                     .user = f}));
}

static void saved_and_restored_goes_on_as_if_never_stopped(void **state) {
    (void)state;
    ecs_fixture f, g;
    size_t size;
    fixture_open(&f);
    populate(&f, 200);
    add_jumble(&f);
    for (uint64_t step = 0; step < 40; step++) {
        jsl_step_context context = {.step = step};
        if (step == 20) {
            void *image = fixture_save(&f, &size);
            fixture_open(&g);
            add_jumble(&g);
            assert_ok(jsl_ecs_restore(g.ecs, image, size));
            free(image);
        }
        assert_ok(jsl_schedule_run(f.ecs, JSL_STAGE_MOVE, &context));
        if (step < 20) continue;
        assert_ok(jsl_schedule_run(g.ecs, JSL_STAGE_MOVE, &context));
        assert_same(&f, &g);
    }
    fixture_close(&f);
    fixture_close(&g);
}

static void retired_slots_stay_retired(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e;
    size_t size;
    fixture_open(&f);
    fixture_create(&f, 0, 1, &e);
    for (int i = 1; i < 0xfffff; i++) {
        assert_ok(jsl_entity_destroy(f.ecs, e));
        assert_ok(jsl_entity_create(f.ecs, NULL, 0, &e));
    }
    assert_ok(jsl_entity_destroy_n(f.ecs, &e, 1));
    void *image = fixture_save(&f, &size);
    assert_ok(jsl_ecs_restore(f.ecs, image, size));
    fixture_create(&f, 0, 1, &e);
    assert_int_equal(e.index, 2);
    free(image);
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(restoring_brings_back_handles_slots_order_and_values),
        cmocka_unit_test(references_belong_to_the_restoring_ecs),
        cmocka_unit_test(derived_and_scratch_fields_come_back_zero),
        cmocka_unit_test(an_empty_ecs_can_be_saved_and_restored),
        cmocka_unit_test(buffers_that_are_too_small_are_refused),
        cmocka_unit_test(every_truncation_and_every_changed_byte_is_refused),
        cmocka_unit_test(forged_images_never_leave_an_unsound_ecs),
        cmocka_unit_test(other_schemas_are_refused_as_of_another_version),
        cmocka_unit_test(images_of_either_precision_are_read),
        cmocka_unit_test(saved_and_restored_goes_on_as_if_never_stopped),
        cmocka_unit_test(retired_slots_stay_retired)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
