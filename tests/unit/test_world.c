/* SPDX-License-Identifier: MIT */
#include "helper.h"

#include <jostle/world.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static jsl_world *make(const jsl_world_desc *desc) {
    jsl_world *w;
    assert_ok(jsl_world_create(desc, &w));
    return w;
}

static void a_zeroed_desc_makes_a_world_with_the_documented_defaults(void **state) {
    (void)state;
    jsl_world *w = make(NULL);
    const jsl_world_desc *s = jsl_world_settings(w);
    assert_close(s->dt, 1.0 / 60, 1e-9);
    assert_int_equal(s->substeps, 4);
    assert_int_equal(s->workers, 1);
    assert_true(s->isa != JSL_ISA_AUTO);
    assert_close(s->gravity.z, 0, 0);
    jsl_world_destroy(w);
    jsl_world_destroy(NULL);
}

static void a_bad_desc_is_refused_with_a_reason(void **state) {
    (void)state;
    const jsl_real nan_ = (jsl_real)NAN, inf = (jsl_real)INFINITY;
    const struct {
        jsl_world_desc desc;
        jsl_result result;
    } bad[] = {
        {{.dt = nan_}, JSL_ERR_NOT_FINITE},
        {{.dt = inf}, JSL_ERR_NOT_FINITE},
        {{.dt = -1}, JSL_ERR_ARGUMENT},
        {{.gravity = {0, nan_, 0}}, JSL_ERR_NOT_FINITE},
        {{.substeps = -1}, JSL_ERR_ARGUMENT},
        {{.substeps = 100000}, JSL_ERR_ARGUMENT},
        {{.workers = -1}, JSL_ERR_ARGUMENT},
        {{.workers = 1000}, JSL_ERR_ARGUMENT},
        {{.isa = (jsl_isa)99}, JSL_ERR_ARGUMENT},
        {{.wind = {.velocity = {inf, 0, 0}}}, JSL_ERR_NOT_FINITE},
        {{.wind = {.gust = -1}}, JSL_ERR_ARGUMENT},
        {{.tag = 5000}, JSL_ERR_ARGUMENT},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        test_log log = {0};
        jsl_world_desc desc = bad[i].desc;
        desc.logger = test_logger(&log);
        jsl_world *w = (jsl_world *)1;
        assert_result(jsl_world_create(&desc, &w), bad[i].result);
        assert_null(w);
        assert_int_equal(log.lines, 1);
    }
}

static void a_step_of_bad_duration_changes_nothing(void **state) {
    (void)state;
    jsl_world *w = make(NULL);
    assert_ok(jsl_step(w, 0, NULL));
    uint64_t before = jsl_world_hash(w);
    assert_result(jsl_step(w, -1, NULL), JSL_ERR_ARGUMENT);
    assert_result(jsl_step(w, (jsl_real)NAN, NULL), JSL_ERR_NOT_FINITE);
    assert_result(jsl_step(w, (jsl_real)INFINITY, NULL), JSL_ERR_NOT_FINITE);
    assert_result(jsl_step(NULL, 0, NULL), JSL_ERR_ARGUMENT);
    assert_true(jsl_world_hash(w) == before);
    assert_int_equal(jsl_world_step_count(w), 1);
    jsl_world_destroy(w);
}

static void time_is_steps_times_dt_without_drift(void **state) {
    (void)state;
    jsl_world *w = make(&(jsl_world_desc){.dt = JSL_R(0.001)});
    double dt = (double)JSL_R(0.001);
    for (int i = 0; i < 100000; i++) assert_ok(jsl_step(w, 0, NULL));
    assert_true(jsl_world_time(w) == 100000 * dt); /* one product: exact */
    assert_i64(jsl_world_time_ns(w), llround(100000 * dt * 1e9));
    /* Another dt: the clock goes on from where it is, to the nanosecond. */
    assert_ok(jsl_step(w, JSL_R(0.5), NULL));
    assert_close(jsl_world_time(w), 100000 * dt + 0.5, 1e-9);
    assert_ok(jsl_refresh(w));
    assert_int_equal(jsl_world_step_count(w), 100001);
    assert_close(jsl_world_time(w), 100000 * dt + 0.5, 1e-9);
    jsl_world_destroy(w);
}

static void equal_shapes_and_materials_share_a_handle(void **state) {
    (void)state;
    test_log log = {0};
    jsl_world *w = make(&(jsl_world_desc){.logger = test_logger(&log)});
    jsl_shape a, b, c;
    assert_ok(jsl_shape_create(w, &(jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 1}, &a));
    assert_ok(jsl_shape_create(w, &(jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 2}, &b));
    assert_ok(jsl_shape_create(w, &(jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 1}, &c));
    assert_int_equal(a.id, c.id);
    assert_int_not_equal(a.id, b.id);
    assert_int_equal(jsl_shape_count(w), 2);
    assert_result(
        jsl_shape_create(w, &(jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = -1}, &a),
        JSL_ERR_ARGUMENT);
    assert_int_equal(a.id, 0);
    jsl_shape_desc got;
    assert_result(jsl_shape_get(w, (jsl_shape){9}, &got), JSL_ERR_HANDLE);
    assert_result(jsl_shape_get(w, (jsl_shape){0}, &got), JSL_ERR_HANDLE);
    jsl_material m, n;
    assert_ok(jsl_material_create(w, &(jsl_material_desc){JSL_R(0.3), JSL_R(0.5)}, &m));
    assert_ok(jsl_material_create(w, &(jsl_material_desc){JSL_R(0.3), JSL_R(0.5)}, &n));
    assert_int_equal(m.id, n.id);
    jsl_material_desc d;
    assert_ok(jsl_material_get(w, (jsl_material){0}, &d));
    assert_close(d.friction, 0.6, 1e-7);
    assert_result(jsl_material_create(w, &(jsl_material_desc){-1, 0}, &m), JSL_ERR_ARGUMENT);
    assert_result(jsl_material_create(w, &(jsl_material_desc){0, 2}, &m), JSL_ERR_ARGUMENT);
    assert_result(jsl_material_create(w, &(jsl_material_desc){(jsl_real)NAN, 0}, &m),
                  JSL_ERR_NOT_FINITE);
    jsl_world_destroy(w);
}

/* -- Stages
 * ------------------------------------------------------------------------------------------- */

static jsl_result note(const jsl_step_context *context, void *user) {
    (void)context;
    char **end = user;
    *(*end)++ = 'x';
    return JSL_OK;
}

static jsl_result count_colliders(const jsl_step_context *context, void *user) {
    *(int64_t *)user = context->colliders ? jsl_query_count(context->ecs, (jsl_query){1}) : -1;
    return JSL_OK;
}

static jsl_result step_again(const jsl_step_context *context, void *user) {
    (void)context;
    return jsl_step(user, 0, NULL);
}

static void a_stage_without_work_is_not_entered(void **state) {
    (void)state;
    jsl_world *w = make(NULL);
    char notes[8] = {0}, *end = notes;
    assert_ok(jsl_system_register(jsl_world_ecs(w), &(jsl_system_desc){.name = "noter",
                                                                       .stage = JSL_STAGE_FORCE,
                                                                       .order = 1000,
                                                                       .run_whole = note,
                                                                       .user = &end}));
    for (int i = 0; i < 3; i++) assert_ok(jsl_step(w, 0, NULL));
    jsl_profile p;
    jsl_world_profile(w, &p);
    for (int i = 0; i < JSL_STAGE_COUNT; i++)
        assert_int_equal(p.entered[i], i == JSL_STAGE_FORCE ? 3 : 0);
    assert_string_equal(notes, "xxx");
    jsl_world_destroy(w);
}

static void what_is_solid_is_indexed_only_when_there_is_something(void **state) {
    (void)state;
    jsl_world *w = make(NULL);
    int64_t seen = 0;
    assert_ok(jsl_system_register(jsl_world_ecs(w), &(jsl_system_desc){.name = "look",
                                                                       .stage = JSL_STAGE_DETECT,
                                                                       .order = 1000,
                                                                       .run_whole = count_colliders,
                                                                       .user = &seen}));
    assert_ok(jsl_step(w, 0, NULL));
    assert_i64(seen, -1);
    jsl_component set[2];
    assert_ok(jsl_component_find(jsl_world_ecs(w), "position", &set[0]));
    assert_ok(jsl_component_find(jsl_world_ecs(w), "collider", &set[1]));
    jsl_entity e;
    assert_ok(jsl_entity_create(jsl_world_ecs(w), set, 2, &e));
    assert_ok(jsl_step(w, 0, NULL));
    assert_true(seen >= 0);
    jsl_world_destroy(w);
}

static void a_step_inside_a_step_is_refused(void **state) {
    (void)state;
    jsl_world *w = make(NULL);
    assert_ok(jsl_system_register(jsl_world_ecs(w), &(jsl_system_desc){.name = "nested",
                                                                       .stage = JSL_STAGE_FORCE,
                                                                       .order = 1000,
                                                                       .run_whole = step_again,
                                                                       .user = w}));
    assert_result(jsl_step(w, 0, NULL), JSL_ERR_STATE);
    jsl_world_destroy(w);
}

/* -- Images
 * -------------------------------------------------------------------------------------------- */

static jsl_world *furnished(void) {
    jsl_world *w = make(&(jsl_world_desc){.seed = 3, .gravity = {0, 0, -1}, .tag = 7});
    jsl_shape shape;
    jsl_material material;
    assert_ok(
        jsl_shape_create(w, &(jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {1, 2, 3}}, &shape));
    assert_ok(jsl_material_create(w, &(jsl_material_desc){JSL_R(0.25), JSL_R(0.5)}, &material));
    jsl_component position;
    assert_ok(jsl_component_find(jsl_world_ecs(w), "position", &position));
    assert_ok(jsl_entity_create_n(jsl_world_ecs(w), &position, 1, 100, NULL, NULL));
    for (int i = 0; i < 5; i++) assert_ok(jsl_step(w, 0, NULL));
    return w;
}

static void a_restored_world_is_the_saved_one(void **state) {
    (void)state;
    jsl_world *a = furnished(), *b = make(&(jsl_world_desc){.tag = 9});
    void *bytes;
    size_t size;
    assert_ok(jsl_world_save(a, &bytes, &size));
    assert_true(jsl_world_hash(a) != jsl_world_hash(b));
    assert_ok(jsl_world_restore(b, bytes, size));
    assert_true(jsl_world_hash(a) == jsl_world_hash(b));
    assert_int_equal(jsl_world_step_count(b), 5);
    assert_i64(jsl_world_time_ns(a), jsl_world_time_ns(b));
    assert_int_equal(jsl_shape_count(b), 1);
    jsl_world_free_bytes(a, bytes, size);
    jsl_world_destroy(a);
    jsl_world_destroy(b);
}

static void every_damaged_image_is_refused_and_changes_nothing(void **state) {
    (void)state;
    jsl_world *a = furnished(), *b = furnished();
    assert_ok(jsl_step(b, 0, NULL));
    uint64_t before = jsl_world_hash(b);
    void *bytes;
    size_t size;
    assert_ok(jsl_world_save(a, &bytes, &size));
    uint8_t *copy = test_malloc(size);
    for (size_t i = 0; i < size; i++) {
        memcpy(copy, bytes, size);
        copy[i] ^= 0x40;
        assert_true(jsl_world_restore(b, copy, size) != JSL_OK);
    }
    for (size_t n = 0; n < size; n++) {
        uint8_t *cut = test_malloc(n + 1); /* its own block, so that a read past the end is seen */
        memcpy(cut, bytes, n);
        assert_true(jsl_world_restore(b, cut, n) != JSL_OK);
        test_free(cut);
    }
    assert_true(jsl_world_hash(b) == before);
    assert_ok(jsl_world_restore(b, bytes, size));
    test_free(copy);
    jsl_world_free_bytes(a, bytes, size);
    jsl_world_destroy(a);
    jsl_world_destroy(b);
}

static void an_image_in_a_file_is_whole_or_absent(void **state) {
    (void)state;
    char folder[] = "/tmp/jostle-world-XXXXXX", path[64], missing[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/image", folder);
    snprintf(missing, sizeof missing, "%s/no/such/place", folder);
    jsl_world *a = furnished(), *b = make(NULL), *c;
    assert_ok(jsl_world_save_file(a, path));
    assert_ok(jsl_world_restore_file(b, path));
    assert_true(jsl_world_hash(a) == jsl_world_hash(b));
    assert_result(jsl_world_save_file(a, missing), JSL_ERR_IO);
    assert_result(jsl_world_restore_file(b, missing), JSL_ERR_IO);
    assert_result(jsl_world_save_file(a, "/dev/null"), JSL_ERR_IO); /* not replaced by a file */
    assert_result(jsl_world_restore_file(b, "/dev/null"), JSL_ERR_FORMAT);
    assert_int_equal(remove(path), 0);
    assert_int_equal(remove(folder), 0); /* nothing else was left in it */
    assert_ok(jsl_world_clone(a, NULL, NULL, &c));
    assert_true(jsl_world_hash(a) == jsl_world_hash(c));
    for (int i = 0; i < 3; i++) {
        assert_ok(jsl_step(a, 0, NULL));
        assert_ok(jsl_step(c, 0, NULL));
    }
    assert_true(jsl_world_hash(a) == jsl_world_hash(c));
    jsl_world_destroy(a);
    jsl_world_destroy(b);
    jsl_world_destroy(c);
}

static void nothing_leaks_when_any_allocation_fails(void **state) {
    (void)state;
    for (int64_t n = 1;; n++) {
        test_memory memory = {.fail_at = n};
        jsl_world *w = NULL;
        jsl_result result =
            jsl_world_create(&(jsl_world_desc){.allocator = test_allocator(&memory)}, &w);
        if (result == JSL_OK) {
            jsl_world_destroy(w);
            assert_no_leaks(&memory);
            assert_true(n > 3);
            return;
        }
        assert_result(result, JSL_ERR_MEMORY);
        assert_null(w);
        assert_no_leaks(&memory);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_zeroed_desc_makes_a_world_with_the_documented_defaults),
        cmocka_unit_test(a_bad_desc_is_refused_with_a_reason),
        cmocka_unit_test(a_step_of_bad_duration_changes_nothing),
        cmocka_unit_test(time_is_steps_times_dt_without_drift),
        cmocka_unit_test(equal_shapes_and_materials_share_a_handle),
        cmocka_unit_test(a_stage_without_work_is_not_entered),
        cmocka_unit_test(what_is_solid_is_indexed_only_when_there_is_something),
        cmocka_unit_test(a_step_inside_a_step_is_refused),
        cmocka_unit_test(a_restored_world_is_the_saved_one),
        cmocka_unit_test(every_damaged_image_is_refused_and_changes_nothing),
        cmocka_unit_test(an_image_in_a_file_is_whole_or_absent),
        cmocka_unit_test(nothing_leaks_when_any_allocation_fails),
    };
    return cmocka_run_group_tests_name("world", tests, NULL, NULL);
}
