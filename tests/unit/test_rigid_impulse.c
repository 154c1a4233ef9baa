/* SPDX-License-Identifier: MIT
 * The impulse of two bodies in one point against values of the closed form computed elsewhere.
 */
#include "rigid/rigid.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static jsl_vec3 box_inverse(jsl_real m, jsl_real x, jsl_real y, jsl_real z) {
    return jsl_v3(12 / (m * (y * y + z * z)), 12 / (m * (z * z + x * x)),
                  12 / (m * (x * x + y * y)));
}
static void two_boxes(jsl_impulse_body *a, jsl_impulse_body *b) {
    *a = (jsl_impulse_body){
        {0, 0, 0},
        {1, -2, JSL_R(0.5)},
        {JSL_R(0.3), JSL_R(-0.7), JSL_R(1.1)},
        jsl_quat_normalize((jsl_quat){JSL_R(0.2), JSL_R(-0.4), JSL_R(0.4), JSL_R(0.8)}),
        JSL_R(1) / 6,
        box_inverse(6, 1, 2, 3)};
    *b = (jsl_impulse_body){{JSL_R(0.9), JSL_R(-1.3), JSL_R(0.4)},
                            {JSL_R(-1.5), JSL_R(2.5), JSL_R(0.25)},
                            {JSL_R(-0.2), JSL_R(0.9), JSL_R(0.4)},
                            {0, 0, 0, 1},
                            JSL_R(1) / 2,
                            box_inverse(2, 2, 1, 1)};
}
static const jsl_vec3 point = {JSL_R(0.45), JSL_R(-0.8), JSL_R(0.3)};
static const jsl_vec3 normal = {JSL_R(-0.36), JSL_R(0.48), JSL_R(-0.8)};

/* The check values carry 12 decimals; the double formula adds some 40 roundings of values of
 * order 1. In float the inputs alone are off by half an ulp each. */
#ifdef JSL_DOUBLE
#define CLOSE 2e-12
#else
#define CLOSE 4e-6
#endif
static void assert_close(jsl_real ours, double reference) {
    if (!(fabs((double)ours - reference) <= CLOSE))
        fail_msg("%.17g is not %.17g", (double)ours, reference);
}

static void impulse_equals_the_closed_form(void **state) {
    (void)state;
    const double e[3] = {0, 0.5, 1},
                 j[3] = {2.474637630963008, 3.711956446444513, 4.949275261926017};
    for (int i = 0; i < 3; i++) {
        jsl_impulse_body a, b;
        two_boxes(&a, &b);
        jsl_real ours = jsl_impulse_two_bodies(&a, &b, point, normal, (jsl_real)e[i]);
        /* 4 ulp of j in the scalar, and the 16 digits of the reference. */
        double ulp = 4 * (double)JSL_REAL_EPSILON * 4;
        if (!(fabs((double)ours - j[i]) <= ulp))
            fail_msg("j(e=%g) is %.17g, not %.17g", e[i], (double)ours, j[i]);
    }
}

static void velocities_after_equal_the_closed_form(void **state) {
    (void)state;
    jsl_impulse_body a, b;
    two_boxes(&a, &b);
    jsl_impulse_two_bodies(&a, &b, point, normal, JSL_R(0.5));
    assert_close(a.velocity.x, .777282613213);
    assert_close(a.velocity.y, -1.703043484284);
    assert_close(a.velocity.z, .005072473807);
    assert_close(a.spin.x, .811010812912);
    assert_close(a.spin.y, -.322537750533);
    assert_close(a.spin.z, .816259419802);
    assert_close(b.velocity.x, -.831847839640);
    assert_close(b.velocity.y, 1.609130452853);
    assert_close(b.velocity.z, 1.734782578578);
    assert_close(b.spin.x, 3.719826007445);
    assert_close(b.spin.y, 2.343208666378);
    assert_close(b.spin.z, .560356518486);
}

static void bodies_that_part_feel_nothing(void **state) {
    (void)state;
    jsl_impulse_body a, b;
    two_boxes(&a, &b);
    assert_true(jsl_impulse_two_bodies(&a, &b, point, jsl_neg(normal), 1) == 0);
    assert_true(a.velocity.x == 1 && b.velocity.x == JSL_R(-1.5));
}

static void an_immovable_body_stays_and_the_other_reflects(void **state) {
    (void)state;
    jsl_impulse_body a = {{0, 0, 1}, {1, 0, -2}, {0, 0, 0}, {0, 0, 0, 1}, 1, {1, 1, 1}};
    jsl_impulse_body b = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0, 1}, 0, {0, 0, 0}};
    jsl_real j = jsl_impulse_two_bodies(&a, &b, jsl_v3(0, 0, 0), jsl_v3(0, 0, 1), JSL_R(0.5));
    assert_true(j == 3 && a.velocity.z == 1 && a.velocity.x == 1 && b.velocity.z == 0);
    assert_true(jsl_impulse_two_bodies(&b, &b, jsl_v3(0, 0, 0), jsl_v3(0, 0, 1), 1) == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(impulse_equals_the_closed_form),
        cmocka_unit_test(velocities_after_equal_the_closed_form),
        cmocka_unit_test(bodies_that_part_feel_nothing),
        cmocka_unit_test(an_immovable_body_stays_and_the_other_reflects),
    };
    return cmocka_run_group_tests_name("rigid impulse", tests, NULL, NULL);
}
