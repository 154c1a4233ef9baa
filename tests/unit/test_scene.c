/* SPDX-License-Identifier: MIT */
#include "helper.h"

#include <jostle/jostle.h>
#include <jostle/scene.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static test_log last;

static jsl_result build(const char *text, const char *set, jsl_world **world) {
    last = (test_log){0};
    jsl_logger logger = test_logger(&last);
    jsl_scene *scene;
    *world = NULL;
    jsl_result result = jsl_scene_parse("s.json", text, strlen(text), &logger, &scene);
    if (result != JSL_OK) return result;
    if (set) result = jsl_scene_set(scene, set);
    if (result == JSL_OK) result = jsl_scene_build(scene, NULL, world);
    jsl_scene_free(scene);
    return result;
}

static void assert_message(const char *text, jsl_result want, const char *message) {
    jsl_world *world;
    jsl_result result = build(text, NULL, &world);
    if (result != want || !strstr(last.text, message))
        fail_msg("got %d \"%s\", wanted %d \"%s\"", (int)result, last.text, (int)want, message);
    assert_null(world);
    assert_int_equal(last.lines, 1);
}

static void an_empty_scene_has_the_documented_defaults(void **state) {
    (void)state;
    jsl_world *w;
    assert_ok(build("{}", NULL, &w));
    assert_close(jsl_world_settings(w)->gravity.z, JSL_R(-9.81), 0);
    assert_close(jsl_world_settings(w)->dt, 1.0 / 60, 1e-9);
    assert_int_equal(jsl_world_settings(w)->substeps, 4);
    jsl_world_destroy(w);
}

static void errors_name_file_line_column_and_key(void **state) {
    (void)state;
    assert_message("{\n  \"world\": {\n    \"substeps\": 0\n  }\n}", JSL_ERR_ARGUMENT,
                   "s.json:3:5: world.substeps: is 0");
    assert_message("{\"a b\": 1,\n\n \"bodies\": [{}, 5]}", JSL_ERR_NAME,
                   "s.json:1:2: a b: unknown key");
    assert_message(
        "{\"bodies\": [\n {\"shape\": {\"sphere\": 1}},\n {\"shape\": {\"sphere\": -1}}]}",
        JSL_ERR_ARGUMENT, "s.json:3:13: bodies.1.shape.sphere: is -1 m: must be at least");
    assert_message("{\"bodies\": [{\"shape\": {\"box\": [1, 2]}}]}", JSL_ERR_FORMAT,
                   "must be a list of 3 numbers");
    assert_message("{\"bodies\": [{\"shape\": {\"box\": [1, 2, \"x\"]}}]}", JSL_ERR_FORMAT,
                   "bodies.0.shape.box.2: must be a number");
    assert_message("{\"name\": \"a\\\"{[\", \"seconds\": true}", JSL_ERR_FORMAT,
                   "s.json:1:19: seconds: must be a number");
    assert_message("[]", JSL_ERR_FORMAT, "must be an object");
    assert_message("{\"emitters\": [{\"look\": [{\"at\": 2}]}]}", JSL_ERR_ARGUMENT,
                   "emitters.0.look.0.at: is 2");
    assert_message("{\"materials\": {\"ice\": {\"friction\": -1}}}", JSL_ERR_ARGUMENT,
                   "materials.ice.friction: is -1");
}

static void what_the_library_refuses_is_told_with_its_place(void **state) {
    (void)state;
    /* Two ways to say the mass: no table knows, the rigid room does. */
    assert_message("{\"bodies\": [{\"shape\": {\"sphere\": 1}, \"mass\": 1, \"density\": 2}]}",
                   JSL_ERR_CONFLICT, "s.json:1:13: bodies.0:");
}

static void a_fraction_is_a_step(void **state) {
    (void)state;
    jsl_world *w;
    assert_ok(build("{\"world\": {\"dt\": \"1/240\"}}", NULL, &w));
    assert_close(jsl_world_settings(w)->dt, 1.0 / 240, 1e-9);
    jsl_world_destroy(w);
    assert_message("{\"world\": {\"dt\": \"1/0\"}}", JSL_ERR_ARGUMENT, "world.dt: is 0");
    assert_message("{\"world\": {\"dt\": \"a/b\"}}", JSL_ERR_FORMAT, "fraction");
}

static void a_value_can_be_set_by_path(void **state) {
    (void)state;
    const char *text = "{\"bodies\": [{\"shape\": {\"sphere\": 1}, \"mass\": 2}]}";
    jsl_world *w;
    assert_ok(build(text, "world.gravity=[0,0,-1]", &w));
    assert_close(jsl_world_settings(w)->gravity.z, -1, 0);
    jsl_world_destroy(w);
    assert_result(build(text, "bodies.0.mass=-3", &w), JSL_ERR_ARGUMENT);
    assert_non_null(strstr(last.text, "bodies.0.mass"));
    assert_result(build(text, "bodies.1.mass=3", &w), JSL_ERR_NAME);
    assert_result(build(text, "bodies.x.mass=3", &w), JSL_ERR_NAME);
    assert_result(build(text, "nothing", &w), JSL_ERR_ARGUMENT);
}

static void copies_stand_where_grid_and_ring_put_them(void **state) {
    (void)state;
    jsl_world *w;
    assert_ok(build("{\"bodies\": [{\"shape\": {\"sphere\": 0.1}, \"position\": [1, 0, 0],"
                    " \"grid\": {\"count\": [2, 3, 4], \"spacing\": [1, 1, 1]}}]}",
                    NULL, &w));
    jsl_diagnostics d;
    assert_ok(jsl_world_diagnostics(w, &d));
    assert_i64(d.bodies, 24);
    jsl_world_destroy(w);
    assert_ok(build("{\"bodies\": [{\"shape\": {\"sphere\": 0.1}, \"ring\": {\"count\": 4, "
                    "\"radius\": 2, \"layers\": 2, \"rise\": 1}}]}",
                    NULL, &w));
    assert_ok(jsl_world_diagnostics(w, &d));
    assert_i64(d.bodies, 8);
    jsl_world_destroy(w);
    assert_message("{\"bodies\": [{\"shape\": {\"sphere\": 1}, \"grid\": {\"count\": [1000000, "
                   "1000000, 2]}}]}",
                   JSL_ERR_LIMIT, "copies");
}

static void the_info_says_what_the_file_says(void **state) {
    (void)state;
    const char *text = "{\"name\": \"n\", \"seconds\": 3, \"camera\": {\"eye\": [1, 2, 3], "
                       "\"fov\": 50}, \"publish\": {\"boids_hz\": 12, "
                       "\"components\": [\"temperature\", \"wet\"], \"components_hz\": 5}}";
    jsl_scene *scene;
    jsl_world *w;
    assert_ok(jsl_scene_parse("s", text, strlen(text), NULL, &scene));
    assert_ok(jsl_scene_build(scene, NULL, &w));
    const jsl_scene_info *i = jsl_scene_get_info(scene);
    assert_string_equal(i->name, "n");
    assert_close(i->seconds, 3, 0);
    assert_close(i->camera.eye[1], 2, 0);
    assert_close(i->camera.fov, 50, 0);
    assert_close(i->boids_hz, 12, 0);
    assert_int_equal(i->component_count, 2);
    assert_string_equal(i->components[0], "temperature");
    assert_string_equal(i->components[1], "wet");
    assert_close(i->components_hz, 5, 0);
    uint64_t hash = i->hash;
    jsl_world_destroy(w);
    assert_ok(jsl_scene_set(scene, "seconds=4"));
    assert_ok(jsl_scene_build(scene, NULL, &w));
    assert_true(jsl_scene_get_info(scene)->hash != hash);
    jsl_world_destroy(w);
    /* The text with everything set since makes the same scene. */
    char *again = jsl_scene_text(scene);
    jsl_scene *twin;
    assert_ok(jsl_scene_parse("t", again, strlen(again), NULL, &twin));
    assert_ok(jsl_scene_build(twin, NULL, &w));
    assert_true(jsl_scene_get_info(twin)->hash == jsl_scene_get_info(scene)->hash);
    jsl_world_destroy(w);
    jsl_scene_free_text(again);
    jsl_scene_free(twin);
    jsl_scene_free(scene);
}

static void the_schema_names_every_kind_of_object(void **state) {
    (void)state;
    char *schema = jsl_scene_schema();
    assert_non_null(schema);
    const char *const words[] = {"substeps", "gust_period", "restitution", "capsule",
                                 "poisson",  "half_angle",  "waypoints",   "additionalProperties"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        assert_non_null(strstr(schema, words[i]));
    jsl_scene_free_text(schema);
}

static void no_cut_of_a_scene_crashes(void **state) {
    (void)state;
    FILE *file = fopen("tools/scenes/showcase.json", "rb");
    if (!file) skip();
    static char text[65536];
    size_t n = fread(text, 1, sizeof text, file);
    fclose(file);
    jsl_scene *scene;
    for (size_t i = 0; i < n; i++) {
        if (jsl_scene_parse("cut", text, i, NULL, &scene) != JSL_OK) continue;
        jsl_scene_free(scene);
        assert_true(i + 2 >= n); /* only the whole object, give or take the last newline */
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_scene_has_the_documented_defaults),
        cmocka_unit_test(errors_name_file_line_column_and_key),
        cmocka_unit_test(what_the_library_refuses_is_told_with_its_place),
        cmocka_unit_test(a_fraction_is_a_step),
        cmocka_unit_test(a_value_can_be_set_by_path),
        cmocka_unit_test(copies_stand_where_grid_and_ring_put_them),
        cmocka_unit_test(the_info_says_what_the_file_says),
        cmocka_unit_test(the_schema_names_every_kind_of_object),
        cmocka_unit_test(no_cut_of_a_scene_crashes),
    };
    return cmocka_run_group_tests_name("scene", tests, NULL, NULL);
}
