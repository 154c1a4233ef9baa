/* SPDX-License-Identifier: MIT
 * test_isa.c - levels of instruction sets.
 */
#include "base/base.h"
#include "helper.h"

#include <stdlib.h>

static int forget_variable(void **state) {
    (void)state;
    return unsetenv("JSL_ISA");
}

static void every_level_has_a_name(void **state) {
    (void)state;
    const char *want[] = {"auto", "scalar", "sse", "avx2", "avx512"};
    for (int i = 0; i < JSL_ISA_COUNT; i++) assert_string_equal(jsl_isa_text((jsl_isa)i), want[i]);
    assert_string_equal(jsl_isa_text((jsl_isa)99), "auto");
}

static void a_level_that_this_cpu_has_is_kept_and_others_fall_to_the_widest(void **state) {
    (void)state;
    jsl_isa widest = jsl_isa_resolve(JSL_ISA_AUTO);
    assert_in_range(widest, JSL_ISA_SCALAR, JSL_ISA_AVX512);
    for (int i = JSL_ISA_SCALAR; i < JSL_ISA_COUNT; i++)
        assert_int_equal(jsl_isa_resolve((jsl_isa)i), i < (int)widest ? i : (int)widest);
    assert_int_equal(jsl_isa_resolve((jsl_isa)99), widest);
    assert_int_equal(jsl_isa_resolve((jsl_isa)-1), widest);
}

static void the_variable_decides_only_for_auto(void **state) {
    (void)state;
    jsl_isa widest = jsl_isa_resolve(JSL_ISA_AUTO);
    setenv("JSL_ISA", "scalar", 1);
    assert_int_equal(jsl_isa_resolve(JSL_ISA_AUTO), JSL_ISA_SCALAR);
    assert_int_equal(jsl_isa_resolve(widest), widest);
    setenv("JSL_ISA", "avx512", 1);
    assert_int_equal(jsl_isa_resolve(JSL_ISA_AUTO), widest);
    const char *nonsense[] = {"", "AVX2", "auto", "mmx", "scalar "};
    for (int i = 0; i < JSL_COUNT(nonsense); i++) {
        setenv("JSL_ISA", nonsense[i], 1);
        assert_int_equal(jsl_isa_resolve(JSL_ISA_AUTO), widest);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(every_level_has_a_name, forget_variable, forget_variable),
        cmocka_unit_test_setup_teardown(
            a_level_that_this_cpu_has_is_kept_and_others_fall_to_the_widest, forget_variable,
            forget_variable),
        cmocka_unit_test_setup_teardown(the_variable_decides_only_for_auto, forget_variable,
                                        forget_variable),
    };
    return cmocka_run_group_tests_name("isa", tests, NULL, NULL);
}
