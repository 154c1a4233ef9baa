/* SPDX-License-Identifier: MIT
 * test_log.c - one line to the host's logger.
 */
#include "base/base.h"
#include "helper.h"

static void a_failure_is_one_line_and_returns_its_code(void **state) {
    (void)state;
    test_log log = {0};
    jsl_logger logger = test_logger(&log);
    assert_result(jsl_fail(&logger, JSL_ERR_ARGUMENT, "mass of body %u is %g", 7u, -1.5),
                  JSL_ERR_ARGUMENT);
    assert_int_equal(log.lines, 1);
    assert_int_equal(log.level, JSL_LOG_ERROR);
    assert_int_equal(log.code, JSL_ERR_ARGUMENT);
    assert_string_equal(log.text, "mass of body 7 is -1.5");
    jsl_log_line(&logger, JSL_LOG_INFO, JSL_OK, "hello");
    assert_int_equal(log.lines, 2);
    assert_int_equal(log.level, JSL_LOG_INFO);
}

static void no_logger_is_silent_and_still_returns_the_code(void **state) {
    (void)state;
    jsl_logger zero = {0};
    assert_result(jsl_fail(NULL, JSL_ERR_IO, "%s", "nobody"), JSL_ERR_IO);
    assert_result(jsl_fail(&zero, JSL_ERR_IO, "%s", "nobody"), JSL_ERR_IO);
}

static void a_long_line_is_cut_and_says_so(void **state) {
    (void)state;
    test_log log = {0};
    jsl_logger logger = test_logger(&log);
    jsl_fail(&logger, JSL_ERR_NAME, "%0600d", 1);
    assert_int_equal(strlen(log.text), 511);
    assert_string_equal(log.text + 508, "...");
    jsl_fail(&logger, JSL_ERR_NAME, "%0511d", 1);
    assert_int_equal(strlen(log.text), 511);
    assert_int_equal(log.text[510], '1');
}

static void control_characters_cannot_forge_a_second_line(void **state) {
    (void)state;
    test_log log = {0};
    jsl_logger logger = test_logger(&log);
    jsl_fail(&logger, JSL_ERR_NAME, "scene \"%s\"", "a\nok\x1b[2J\r\x7f");
    assert_string_equal(log.text, "scene \"a ok [2J  \"");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_failure_is_one_line_and_returns_its_code),
        cmocka_unit_test(no_logger_is_silent_and_still_returns_the_code),
        cmocka_unit_test(a_long_line_is_cut_and_says_so),
        cmocka_unit_test(control_characters_cannot_forge_a_second_line),
    };
    return cmocka_run_group_tests_name("log", tests, NULL, NULL);
}
