/* SPDX-License-Identifier: MIT
 * Systems and the schedule: order, conflicts, blocks, counters, warnings.
 */
#include "ecs_fixture.h"

#define P (1u << PLACE)
#define V (1u << PACE)
#define T (1u << TAG)

typedef struct diary {
    char text[256];
    int64_t blocks, rows;
    jsl_result result; /* of run_whole */
} diary;

typedef struct entry {
    diary *diary;
    char letter;
} entry;

static void write_letter(entry *e) {
    size_t n = strlen(e->diary->text);
    e->diary->text[n] = e->letter;
    e->diary->text[n + 1] = 0;
}

static void note_rows(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    entry *e = user;
    assert_null(context->arena);
    assert_null(context->memory);
    assert_null(context->exec);
    assert_i64(context->block, e->diary->blocks);
    e->diary->blocks++;
    e->diary->rows += rows->count;
    write_letter(e);
}

static jsl_result note_whole(const jsl_step_context *context, void *user) {
    entry *e = user;
    assert_non_null(context->ecs);
    write_letter(e);
    return e->diary->result;
}

static jsl_result run(ecs_fixture *f, jsl_stage stage) {
    jsl_step_context context = {.dt = JSL_R(0.25)};
    return jsl_schedule_run(f->ecs, stage, &context);
}

static void systems_run_by_stage_order_and_name(void **state) {
    (void)state;
    ecs_fixture f;
    diary d = {0};
    entry e[] = {{&d, 'a'}, {&d, 'b'}, {&d, 'c'}, {&d, 'd'}, {&d, 'e'}};
    fixture_open(&f);
    const jsl_system_desc desc[] = {
        {.name = "zeta", .stage = JSL_STAGE_FORCE, .run_whole = note_whole, .user = &e[2]},
        {.name = "late", .stage = JSL_STAGE_MOVE, .run_whole = note_whole, .user = &e[4]},
        {.name = "after",
         .stage = JSL_STAGE_FORCE,
         .order = 1000,
         .run_whole = note_whole,
         .user = &e[3]},
        {.name = "alpha", .stage = JSL_STAGE_FORCE, .run_whole = note_whole, .user = &e[1]},
        {.name = "before",
         .stage = JSL_STAGE_FORCE,
         .order = -1,
         .run_whole = note_whole,
         .user = &e[0]}};
    for (int i = 0; i < 5; i++) assert_ok(jsl_system_register(f.ecs, &desc[i]));
    assert_ok(run(&f, JSL_STAGE_FORCE));
    assert_string_equal(d.text, "abcd");
    assert_ok(run(&f, JSL_STAGE_MOVE));
    assert_string_equal(d.text, "abcde");
    assert_false(jsl_schedule_has_work(f.ecs, JSL_STAGE_EMIT));
    jsl_system_info info;
    const char *names[] = {"before", "alpha", "zeta", "after", "late"};
    assert_int_equal(jsl_system_count(f.ecs), 5);
    for (int i = 0; i < 5; i++) {
        assert_ok(jsl_system_get(f.ecs, i, &info));
        assert_string_equal(info.name, names[i]);
        assert_true(info.runs == 1 && info.calls == 1);
    }
    assert_result(jsl_system_get(f.ecs, 5, &info), JSL_ERR_ARGUMENT);
    fixture_close(&f);
}

static void idle_systems_are_not_entered(void **state) {
    (void)state;
    ecs_fixture f;
    diary d = {0};
    entry rows = {&d, 'r'}, whole = {&d, 'w'};
    jsl_entity e[3];
    jsl_system_info info;
    fixture_open(&f);
    jsl_system_desc desc = {.name = "rows",
                            .stage = JSL_STAGE_FORCE,
                            .query = {{{f.component[PACE], JSL_WRITE}}},
                            .run_rows = note_rows,
                            .user = &rows};
    assert_ok(jsl_system_register(f.ecs, &desc));
    desc.name = "whole", desc.run_rows = NULL, desc.run_whole = note_whole, desc.user = &whole;
    desc.order = 1;
    assert_ok(jsl_system_register(f.ecs, &desc));
    fixture_create(&f, P, 100, NULL);
    int64_t calls = f.memory.calls;
    assert_false(jsl_schedule_has_work(f.ecs, JSL_STAGE_FORCE));
    assert_ok(run(&f, JSL_STAGE_FORCE));
    assert_string_equal(d.text, "");
    assert_i64(f.memory.calls, calls);
    for (int i = 0; i < 2; i++) {
        assert_ok(jsl_system_get(f.ecs, i, &info));
        assert_true(info.runs == 0 && info.calls == 0 && info.bytes == 0 && info.seconds == 0);
    }
    fixture_create(&f, V, 3, e);
    assert_true(jsl_schedule_has_work(f.ecs, JSL_STAGE_FORCE));
    assert_ok(run(&f, JSL_STAGE_FORCE));
    assert_string_equal(d.text, "rw");
    assert_ok(jsl_entity_destroy_n(f.ecs, e, 3));
    assert_false(jsl_schedule_has_work(f.ecs, JSL_STAGE_FORCE));
    assert_ok(run(&f, JSL_STAGE_FORCE));
    assert_string_equal(d.text, "rw");
    fixture_close(&f);
}

static void rows_come_in_fixed_blocks_that_are_counted(void **state) {
    (void)state;
    ecs_fixture f;
    diary d = {0};
    entry e = {&d, 'x'};
    jsl_system_info info;
    fixture_open(&f);
    fixture_create(&f, P | V, 100, NULL); /* 7 blocks of 16 */
    fixture_create(&f, P | V | T, 1, NULL);
    fixture_create(&f, P | V | 1u << LINK, 32, NULL);
    assert_ok(
        jsl_system_register(f.ecs, &(jsl_system_desc){.name = "blocks",
                                                      .stage = JSL_STAGE_MOVE,
                                                      .query = {{{f.component[PLACE], JSL_WRITE},
                                                                 {f.component[PACE], JSL_READ},
                                                                 {f.component[LINK], JSL_READ_IF}}},
                                                      .block = 9, /* rounded up to 16 */
                                                      .run_rows = note_rows,
                                                      .user = &e}));
    assert_ok(run(&f, JSL_STAGE_MOVE));
    assert_i64(d.blocks, 7 + 1 + 2);
    assert_i64(d.rows, 133);
    assert_ok(jsl_system_get(f.ecs, 0, &info));
    assert_i64(info.rows, 133);
    assert_i64(info.calls, 10);
    assert_i64(info.bytes, 133 * 6 * (int64_t)sizeof(jsl_real) + 32 * 12);
    assert_true(info.seconds > 0);
    fixture_close(&f);
}

static void conflicts_are_refused_with_both_names(void **state) {
    (void)state;
    ecs_fixture f;
    diary d = {0};
    entry e = {&d, 'x'};
    fixture_open(&f);
    jsl_system_desc desc = {.name = "gravity",
                            .stage = JSL_STAGE_FORCE,
                            .order = 5,
                            .query = {{{f.component[PACE], JSL_WRITE}}},
                            .run_rows = note_rows,
                            .user = &e};
    assert_ok(jsl_system_register(f.ecs, &desc));
    assert_result(jsl_system_register(f.ecs, &desc), JSL_ERR_NAME);
    desc.name = "drag";
    desc.query.terms[0].access = JSL_READ;
    assert_result(jsl_system_register(f.ecs, &desc), JSL_ERR_CONFLICT);
    assert_non_null(strstr(f.log.text, "gravity"));
    assert_non_null(strstr(f.log.text, "drag"));
    assert_non_null(strstr(f.log.text, "pace"));
    desc.query.terms[0] = (jsl_term){f.component[PLACE], JSL_READ};
    desc.also[0] = (jsl_term){f.component[PACE], JSL_READ_IF};
    assert_result(jsl_system_register(f.ecs, &desc), JSL_ERR_CONFLICT);
    desc.also[0].access = JSL_WITHOUT; /* does not touch it */
    assert_ok(jsl_system_register(f.ecs, &desc));
    desc.name = "lift";
    desc.query.terms[0] = (jsl_term){f.component[PACE], JSL_WRITE};
    desc.also[0] = (jsl_term){{0}, JSL_END};
    desc.order = 6;
    assert_ok(jsl_system_register(f.ecs, &desc));
    desc.name = "thrust";
    desc.order = 5;
    desc.stage = JSL_STAGE_DECIDE;
    assert_ok(jsl_system_register(f.ecs, &desc));
    assert_int_equal(jsl_system_count(f.ecs), 4);
    fixture_close(&f);
}

static void bad_systems_are_refused(void **state) {
    (void)state;
    ecs_fixture f;
    fixture_open(&f);
    jsl_system_desc good = {.name = "good", .stage = JSL_STAGE_MOVE, .run_whole = note_whole};
    jsl_system_desc bad = good;
    bad.name = NULL;
    assert_result(jsl_system_register(f.ecs, &bad), JSL_ERR_ARGUMENT);
    bad = good, bad.stage = JSL_STAGE_COUNT;
    assert_result(jsl_system_register(f.ecs, &bad), JSL_ERR_ARGUMENT);
    bad = good, bad.run_rows = note_rows;
    assert_result(jsl_system_register(f.ecs, &bad), JSL_ERR_ARGUMENT);
    bad = good, bad.run_whole = NULL;
    assert_result(jsl_system_register(f.ecs, &bad), JSL_ERR_ARGUMENT);
    bad = good, bad.block = -1;
    assert_result(jsl_system_register(f.ecs, &bad), JSL_ERR_ARGUMENT);
    bad = good, bad.query.terms[0] = (jsl_term){{50}, JSL_READ};
    assert_result(jsl_system_register(f.ecs, &bad), JSL_ERR_HANDLE);
    bad = good, bad.also[0] = (jsl_term){{0}, JSL_READ};
    assert_result(jsl_system_register(f.ecs, &bad), JSL_ERR_HANDLE);
    assert_int_equal(jsl_system_count(f.ecs), 0);
    fixture_close(&f);
}

static void a_failing_system_ends_its_stage(void **state) {
    (void)state;
    ecs_fixture f;
    diary d = {.result = JSL_ERR_IO};
    entry e[] = {{&d, 'a'}, {&d, 'b'}};
    fixture_open(&f);
    jsl_system_desc desc = {
        .name = "first", .stage = JSL_STAGE_MOVE, .run_whole = note_whole, .user = &e[0]};
    assert_ok(jsl_system_register(f.ecs, &desc));
    desc.name = "second", desc.user = &e[1];
    assert_ok(jsl_system_register(f.ecs, &desc));
    assert_result(run(&f, JSL_STAGE_MOVE), JSL_ERR_IO);
    assert_string_equal(d.text, "a");
    fixture_close(&f);
}

static void warn_rows(const jsl_step_context *context, const jsl_rows *rows, void *user) {
    (void)user;
    jsl_warn(context, JSL_WARN_BAD_STATE, 2, rows->entity[rows->count - 1]);
    jsl_warn(context, JSL_WARN_BAD_STATE, 1, rows->entity[0]);
    jsl_warn(context, JSL_WARN_PARTICLES_FULL, 1, (jsl_entity){0, 0});
    jsl_warn(context, (jsl_warning)99, 1, rows->entity[0]);
    assert_result(jsl_entity_destroy(context->ecs, rows->entity[0]), JSL_ERR_STATE);
    assert_result(jsl_schedule_run(context->ecs, JSL_STAGE_MOVE, context), JSL_ERR_STATE);
}

static void warnings_are_counted_and_name_the_lowest_offender(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[160];
    fixture_open(&f);
    fixture_create(&f, P, 160, e);
    assert_ok(
        jsl_system_register(f.ecs, &(jsl_system_desc){.name = "warn",
                                                      .stage = JSL_STAGE_MOVE,
                                                      .query = {{{f.component[PLACE], JSL_READ}}},
                                                      .block = 16,
                                                      .run_rows = warn_rows}));
    jsl_warnings warnings = {0};
    warnings.count[JSL_WARN_BAD_STATE] = 5;
    jsl_step_context context = {.warnings = &warnings};
    assert_ok(jsl_schedule_run(f.ecs, JSL_STAGE_MOVE, &context));
    assert_i64(warnings.count[JSL_WARN_BAD_STATE], 35);
    assert_i64(warnings.count[JSL_WARN_PARTICLES_FULL], 10);
    assert_true(jsl_entity_equal(warnings.first[JSL_WARN_BAD_STATE], e[0]));
    assert_true(jsl_entity_is_null(warnings.first[JSL_WARN_PARTICLES_FULL]));
    assert_ok(jsl_schedule_run(f.ecs, JSL_STAGE_MOVE, &(jsl_step_context){0}));
    fixture_close(&f);
}

static void stages_warnings_and_types_have_texts(void **state) {
    (void)state;
    assert_string_equal(jsl_stage_text(JSL_STAGE_OUTBOX), "outbox");
    assert_non_null(jsl_stage_text((jsl_stage)99));
    assert_string_equal(jsl_warning_name(JSL_WARN_VELOCITY_CLAMPED), "VELOCITY_CLAMPED");
    assert_non_null(jsl_warning_text(JSL_WARN_VELOCITY_CLAMPED));
    assert_null(jsl_warning_name((jsl_warning)-1));
    assert_null(jsl_warning_text(JSL_WARN_COUNT));
    assert_int_equal(jsl_type_size(JSL_TYPE_REAL), sizeof(jsl_real));
    assert_int_equal(jsl_type_size(JSL_TYPE_ENTITY), sizeof(jsl_entity));
    assert_int_equal(jsl_type_size((jsl_type)77), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(systems_run_by_stage_order_and_name),
        cmocka_unit_test(idle_systems_are_not_entered),
        cmocka_unit_test(rows_come_in_fixed_blocks_that_are_counted),
        cmocka_unit_test(conflicts_are_refused_with_both_names),
        cmocka_unit_test(bad_systems_are_refused),
        cmocka_unit_test(a_failing_system_ends_its_stage),
        cmocka_unit_test(warnings_are_counted_and_name_the_lowest_offender),
        cmocka_unit_test(stages_warnings_and_types_have_texts)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
