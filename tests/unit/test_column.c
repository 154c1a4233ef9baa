/* SPDX-License-Identifier: MIT */
#include "helper.h"

#include "telemetry/column.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The value of a half by its definition: sign, 5 bits of exponent, 10 of mantissa. */
static double half_value(uint16_t h) {
    int exponent = h >> 10 & 31, mantissa = h & 1023;
    double size = exponent == 0    ? ldexp(mantissa, -24)
                  : exponent == 31 ? (mantissa ? (double)NAN : (double)INFINITY)
                                   : ldexp(1024 + mantissa, exponent - 25);
    return h & 0x8000 ? -size : size;
}

static void every_half_decodes_to_its_definition(void **state) {
    (void)state;
    uint8_t bytes[2 * 65536];
    float out[65536];
    for (int h = 0; h < 65536; h++) memcpy(bytes + 2 * h, &(uint16_t){(uint16_t)h}, 2);
    jsl_column_decode(JSL_ENC_F16, bytes, 65536, 0, 0, out);
    for (int h = 0; h < 65536; h++) {
        double want = half_value((uint16_t)h);
        assert_true(isnan(want) ? isnan(out[h]) != 0 : (double)out[h] == want);
        assert_int_equal(!!signbit(out[h]), h >> 15);
        if (!isnan(want)) assert_int_equal(jsl_f16_from_f32(out[h]), h);
    }
    assert_true(isnan(jsl_f32_from_f16(jsl_f16_from_f32(NAN))));
}

/* Between neighbouring halves a and b: nearer to a gives a, nearer to b gives b, the middle gives
 * the even one. */
static void floats_round_to_the_nearest_half_and_ties_to_even(void **state) {
    (void)state;
    for (int h = 0; h < 0x7bff; h++) {
        float a = (float)half_value((uint16_t)h), b = (float)half_value((uint16_t)(h + 1));
        float middle = a + (b - a) / 2; /* exact: halves have 11 bits */
        int even = h & 1 ? h + 1 : h;
        assert_int_equal(jsl_f16_from_f32(middle), even);
        assert_int_equal(jsl_f16_from_f32(nextafterf(middle, 0)), h);
        assert_int_equal(jsl_f16_from_f32(nextafterf(middle, 1e9f)), h + 1);
        assert_int_equal(jsl_f16_from_f32(-middle), even | 0x8000);
    }
    assert_int_equal(jsl_f16_from_f32(65519.996f), 0x7bff);
    assert_int_equal(jsl_f16_from_f32(65520.0f), 0x7c00);
    assert_int_equal(jsl_f16_from_f32(3e38f), 0x7c00);
    assert_int_equal(jsl_f16_from_f32(-INFINITY), 0xfc00);
    assert_int_equal(jsl_f16_from_f32(1e-9f), 0);
}

/* The bound that the schema states, range / 131070, and what float itself loses: the step and the
 * sum are rounded to 24 bits, relative to the code (65535 * 2^-24 steps) and to the size of the
 * value. */
static void check_u16(const float *x, int n) {
    float lo, hi, back[1000];
    uint8_t bytes[2000];
    jsl_column_range(x, n, &lo, &hi);
    float step = jsl_column_step(lo, hi);
    jsl_column_encode(JSL_ENC_U16Q, x, n, lo, step, bytes);
    jsl_column_decode(JSL_ENC_U16Q, bytes, n, lo, step, back);
    double range = (double)hi - (double)lo, size = fmax(fabs((double)lo), fabs((double)hi));
    double bound = range / 131070 * (1 + 4 * 65535 * 0x1p-24) + 2 * size * 0x1p-24 +
                   2.5e-34; /* a step whose inverse overflows: the span is not resolved */
    for (int i = 0; i < n; i++) {
        assert_true(lo <= x[i] && x[i] <= hi);
        assert_close(back[i], x[i], bound);
    }
}

static void u16_codes_stay_within_the_stated_error(void **state) {
    (void)state;
    uint64_t seed = 5;
    for (int round = 0; round < 400; round++) {
        float x[1000];
        int n = 1 + (int)(test_random(&seed) % 1000);
        double centre = test_uniform(&seed, -1000, 1000);
        double width = pow(10, test_uniform(&seed, -6, 6));
        for (int i = 0; i < n; i++) x[i] = (float)(centre + width * test_uniform(&seed, -1, 1));
        check_u16(x, n);
    }
    check_u16((const float[]){-1.7e38f, 1.7e38f, 0, 1}, 4);
    check_u16((const float[]){7, 7, 7}, 3);
    check_u16((const float[]){1e-45f, 4e-45f, 0}, 3);
}

static void what_is_not_finite_is_clamped_and_spares_the_others(void **state) {
    (void)state;
    const float x[] = {1, NAN, 3, INFINITY, 2, -INFINITY};
    float lo, hi, back[6];
    uint8_t bytes[12];
    jsl_column_range(x, 6, &lo, &hi);
    assert_true(lo == 1 && hi == 3);
    jsl_column_encode(JSL_ENC_U16Q, x, 6, lo, jsl_column_step(lo, hi), bytes);
    jsl_column_decode(JSL_ENC_U16Q, bytes, 6, lo, jsl_column_step(lo, hi), back);
    assert_true(back[0] == 1 && back[1] == 1 && back[5] == 1);
    assert_close(back[2], 3, 3 * 0x1p-22);
    assert_close(back[3], 3, 3 * 0x1p-22); /* +infinite is clamped to the largest code */
    assert_close(back[4], 2, 2.0 / 131070 * 1.02);
    const float far[] = {1, 3e38f, 3};
    jsl_column_range(far, 3, &lo, &hi);
    assert_true(lo == 1 && hi == 3);
    const float none[] = {NAN, INFINITY};
    jsl_column_range(none, 2, &lo, &hi);
    assert_true(lo == 0 && hi == 0);
    jsl_column_range(none, 0, &lo, &hi);
    assert_true(lo == 0 && hi == 0);
}

static void the_range_is_the_smallest_and_largest_at_every_length(void **state) {
    (void)state;
    uint64_t seed = 9;
    for (int n = 1; n <= 200; n++) {
        float x[200], lo = INFINITY, hi = -INFINITY, a, b;
        for (int i = 0; i < n; i++) {
            x[i] = (float)test_uniform(&seed, -10, 10);
            lo = fminf(lo, x[i]);
            hi = fmaxf(hi, x[i]);
        }
        jsl_column_range(x, n, &a, &b);
        assert_true(a == lo && b == hi);
    }
}

static void columns_may_begin_at_any_byte(void **state) {
    (void)state;
    float x[33], back[33];
    for (int i = 0; i < 33; i++) x[i] = (float)i - 16;
    const int encodings[] = {JSL_ENC_F32, JSL_ENC_F16, JSL_ENC_U16Q};
    for (int e = 0; e < 3; e++)
        for (int shift = 0; shift < 4; shift++) {
            uint8_t bytes[33 * 4 + 5];
            memset(bytes, 0xee, sizeof bytes);
            jsl_column_encode(encodings[e], x, 33, -16, 32.0f / 65535, bytes + shift);
            assert_int_equal(bytes[shift + 33 * jsl_encoding_bytes(encodings[e])], 0xee);
            jsl_column_decode(encodings[e], bytes + shift, 33, -16, 32.0f / 65535, back);
            for (int i = 0; i < 33; i++) assert_close(back[i], x[i], 16.0 / 65535 + 1e-5);
        }
}

/* JSL_ISA picks the level; a level that this CPU lacks resolves to one it has. */
static void every_instruction_set_gives_the_same_bytes(void **state) {
    (void)state;
    const char *old = getenv("JSL_ISA");
    char keep[32] = "";
    if (old) snprintf(keep, sizeof keep, "%s", old);
    float x[777], lo, hi, lo0 = 0, hi0 = 0;
    static float back[777], back0[777];
    static uint8_t f16[2 * 777], u16[2 * 777], f16_0[2 * 777], u16_0[2 * 777];
    uint64_t seed = 12;
    for (int i = 0; i < 777; i++) {
        uint32_t bits = (uint32_t)test_random(&seed); /* all of float, NaN and infinities too */
        memcpy(&x[i], &bits, 4);
        if (i % 3) x[i] = (float)test_uniform(&seed, -3, 3);
    }
    for (int isa = JSL_ISA_SCALAR; isa < JSL_ISA_COUNT; isa++) {
        setenv("JSL_ISA", jsl_isa_text((jsl_isa)isa), 1);
        jsl_column_range(x, 777, &lo, &hi);
        jsl_column_encode(JSL_ENC_F16, x, 777, 0, 0, f16);
        jsl_column_encode(JSL_ENC_U16Q, x, 777, -2, 5.0f / 65535, u16);
        jsl_column_decode(JSL_ENC_F16, f16, 777, 0, 0, back);
        if (isa == JSL_ISA_SCALAR) {
            lo0 = lo;
            hi0 = hi;
            memcpy(f16_0, f16, sizeof f16);
            memcpy(u16_0, u16, sizeof u16);
            memcpy(back0, back, sizeof back);
        }
        assert_true(lo == lo0 && hi == hi0);
        assert_memory_equal(f16, f16_0, sizeof f16);
        assert_memory_equal(u16, u16_0, sizeof u16);
        assert_memory_equal(back, back0, sizeof back);
    }
    if (old)
        setenv("JSL_ISA", keep, 1);
    else
        unsetenv("JSL_ISA");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_half_decodes_to_its_definition),
        cmocka_unit_test(floats_round_to_the_nearest_half_and_ties_to_even),
        cmocka_unit_test(u16_codes_stay_within_the_stated_error),
        cmocka_unit_test(what_is_not_finite_is_clamped_and_spares_the_others),
        cmocka_unit_test(the_range_is_the_smallest_and_largest_at_every_length),
        cmocka_unit_test(columns_may_begin_at_any_byte),
        cmocka_unit_test(every_instruction_set_gives_the_same_bytes),
    };
    return cmocka_run_group_tests_name("column", tests, NULL, NULL);
}
