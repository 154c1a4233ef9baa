/* SPDX-License-Identifier: MIT
 * test_result.c - texts of results, and what this build is.
 */
#include "base/base.h"
#include "helper.h"

#include <stdio.h>

static void every_result_has_a_text_of_its_own(void **state) {
    (void)state;
    for (int i = 0; i < JSL_RESULT_COUNT; i++) {
        assert_true(strlen(jsl_result_text((jsl_result)i)) > 0);
        for (int j = 0; j < i; j++)
            assert_string_not_equal(jsl_result_text((jsl_result)i), jsl_result_text((jsl_result)j));
    }
    assert_string_equal(jsl_result_text(JSL_OK), "ok");
    assert_int_equal(JSL_OK, 0);
}

static void a_value_that_is_no_result_is_unknown(void **state) {
    (void)state;
    assert_string_equal(jsl_result_text(JSL_RESULT_COUNT), "unknown result");
    assert_string_equal(jsl_result_text((jsl_result)-1), "unknown result");
    assert_string_equal(jsl_result_text((jsl_result)12345), "unknown result");
}

static void the_version_is_that_of_the_header(void **state) {
    (void)state;
    char text[40];
    snprintf(text, sizeof text, "%d.%d.%d", JSL_VERSION_MAJOR, JSL_VERSION_MINOR,
             JSL_VERSION_PATCH);
    assert_string_equal(jsl_version(), text);
}

static void the_library_knows_its_precision(void **state) {
    (void)state;
    assert_int_equal(jsl_is_double(), sizeof(jsl_real) == 8);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_result_has_a_text_of_its_own),
        cmocka_unit_test(a_value_that_is_no_result_is_unknown),
        cmocka_unit_test(the_version_is_that_of_the_header),
        cmocka_unit_test(the_library_knows_its_precision),
    };
    return cmocka_run_group_tests_name("result", tests, NULL, NULL);
}
