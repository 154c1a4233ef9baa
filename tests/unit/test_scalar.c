/* SPDX-License-Identifier: MIT
 * test_scalar.c - sin, cos, atan2, exp, log beside the C library's long double functions.
 *
 * The header promises 2 ulp; the bounds here are what is measured plus a little, so that a loss of
 * accuracy is noticed before it breaks the promise.
 */
#include "base/base.h"
#include "helper.h"

#include <float.h>

#ifdef JSL_DOUBLE
#define RANGE 1e9
#define LOWEST_EXPONENT (-1074)
#define HIGHEST_EXPONENT 1023
#define LARGEST DBL_MAX
#define SMALLEST 0x1p-1074
#define BOUND_SIN 0.9
#define BOUND_ATAN2 1.6
#define BOUND_EXP 0.9
#define BOUND_LOG 0.9
#define EXP_LOW (-745.2)
#define EXP_HIGH 709.8
#define next_up(x) nextafter(x, INFINITY)
#define next_down(x) nextafter(x, -INFINITY)
#else
#define RANGE 1e5
#define LOWEST_EXPONENT (-149)
#define HIGHEST_EXPONENT 127
#define LARGEST FLT_MAX
#define SMALLEST 0x1p-149f
#define BOUND_SIN 0.501
#define BOUND_ATAN2 0.501
#define BOUND_EXP 0.501
#define BOUND_LOG 0.501
#define EXP_LOW (-104.0)
#define EXP_HIGH 88.8
#define next_up(x) nextafterf(x, (float)INFINITY)
#define next_down(x) nextafterf(x, -(float)INFINITY)
#endif
#define SAMPLES 300000

/* A number whose logarithm is uniform over 2^lo .. 2^hi, of either sign. */
static jsl_real random_magnitude(uint64_t *seed, int lo, int hi) {
    double x = test_uniform(seed, 0.5, 1);
    int span = hi - lo + 1;
    long double y = ldexpl((long double)x, lo + (int)(test_random(seed) % (uint64_t)span));
    return (jsl_real)(test_random(seed) & 1 ? y : -y);
}

typedef struct worst {
    double error;
    jsl_real x, y;
} worst;

static void note(worst *w, jsl_real got, long double truth, jsl_real x, jsl_real y) {
    double error = ulp_error(got, truth);
    if (error > w->error) *w = (worst){error, x, y};
}

static void judge(worst w, double bound, const char *name) {
    print_message("             %s: at most %.4f ulp, at %.17g %.17g\n", name, w.error, (double)w.x,
                  (double)w.y);
    assert_true(w.error <= bound);
}

static void try_angle(worst *s, worst *c, jsl_real x) {
    note(s, jsl_sin(x), sinl((long double)x), x, 0);
    note(c, jsl_cos(x), cosl((long double)x), x, 0);
}

static void sine_and_cosine_are_within_an_ulp_over_their_range(void **state) {
    (void)state;
    worst s = {0}, c = {0};
    uint64_t seed = 1;
    for (int i = 0; i < SAMPLES; i++) {
        try_angle(&s, &c, (jsl_real)test_uniform(&seed, -RANGE, RANGE));
        try_angle(&s, &c, (jsl_real)test_uniform(&seed, -10, 10));
        try_angle(&s, &c, random_magnitude(&seed, LOWEST_EXPONENT + 1, 16));
    }
    judge(s, BOUND_SIN, "sin");
    judge(c, BOUND_SIN, "cos");
}

static void angles_next_to_multiples_of_a_right_angle_keep_their_digits(void **state) {
    (void)state;
    worst s = {0}, c = {0};
    const long double right = 1.570796326794896619231321691639751442L;
    int64_t most = (int64_t)(RANGE / 1.5708);
    for (int64_t i = 0; i < SAMPLES; i++) {
        int64_t n = i < 100000 ? i : most - (i * 7919) % most;
        jsl_real x = (jsl_real)((long double)n * right);
        try_angle(&s, &c, x);
        try_angle(&s, &c, next_up(x));
        try_angle(&s, &c, -next_down(x));
        try_angle(&s, &c, (jsl_real)(((long double)n + 0.5L) * right));
    }
    judge(s, BOUND_SIN, "sin");
    judge(c, BOUND_SIN, "cos");
    /* The double nearest to a multiple of pi/2 of all: 6381956970095103 * 2^797 is out of range,
     * but these are the worst within it, found from the continued fraction of pi. */
    try_angle(&s, &c, JSL_R(355.0 / 2));
    try_angle(&s, &c, JSL_R(355));
    try_angle(&s, &c, JSL_R(103993));
    try_angle(&s, &c, (jsl_real)(RANGE > 1e8 ? 411557987.0 : 0));
    judge(s, BOUND_SIN, "sin");
    judge(c, BOUND_SIN, "cos");
}

static void sine_and_cosine_at_special_points(void **state) {
    (void)state;
    jsl_real s, c;
    assert_true(jsl_sin(0) == 0 && !signbit(jsl_sin(0)));
    assert_true(jsl_sin(JSL_R(-0.0)) == 0 && signbit(jsl_sin(JSL_R(-0.0))));
    assert_true(jsl_cos(0) == 1);
    assert_true(jsl_sin(SMALLEST) == SMALLEST);
    const jsl_real bad[] = {(jsl_real)NAN, (jsl_real)INFINITY, -(jsl_real)INFINITY};
    for (int i = 0; i < 3; i++) {
        jsl_sin_cos(bad[i], &s, &c);
        assert_true(s != s && c != c);
    }
    /* Out of the promised range: still a point of the circle. */
    for (int e = 17; e <= HIGHEST_EXPONENT; e++) {
        jsl_sin_cos((jsl_real)ldexp(1.3, e), &s, &c);
        assert_close(s * s + c * c, 1, 1e-6);
    }
    jsl_sin_cos(LARGEST, &s, &c);
    assert_close(s * s + c * c, 1, 1e-6);
}

static void sine_is_odd_and_cosine_is_even_to_the_bit(void **state) {
    (void)state;
    uint64_t seed = 2;
    for (int i = 0; i < 100000; i++) {
        jsl_real x = (jsl_real)test_uniform(&seed, -RANGE, RANGE);
        assert_true(jsl_sin(-x) == -jsl_sin(x) && jsl_cos(-x) == jsl_cos(x));
    }
}

static void arc_tangent_is_within_its_bound_in_all_octants(void **state) {
    (void)state;
    worst w = {0};
    uint64_t seed = 3;
    for (int i = 0; i < SAMPLES; i++) {
        jsl_real x = (jsl_real)test_uniform(&seed, -1, 1), y = (jsl_real)test_uniform(&seed, -1, 1);
        note(&w, jsl_atan2(y, x), atan2l((long double)y, (long double)x), x, y);
        y = random_magnitude(&seed, LOWEST_EXPONENT + 1, HIGHEST_EXPONENT);
        x = random_magnitude(&seed, LOWEST_EXPONENT + 1, HIGHEST_EXPONENT);
        note(&w, jsl_atan2(y, x), atan2l((long double)y, (long double)x), x, y);
        /* Next to the diagonal and to the borders of the series. */
        x = (jsl_real)test_uniform(&seed, 0.5, 2);
        const double ratio[] = {1, 0.25, 0.5, 0.75, -1, 4};
        y = x * (jsl_real)(ratio[i % 6] * (1 + test_uniform(&seed, -1e-5, 1e-5)));
        note(&w, jsl_atan2(y, x), atan2l((long double)y, (long double)x), x, y);
    }
    judge(w, BOUND_ATAN2, "atan2");
}

static void arc_tangent_at_special_points_is_that_of_the_standard(void **state) {
    (void)state;
    const jsl_real v[] = {0,
                          JSL_R(-0.0),
                          1,
                          -1,
                          (jsl_real)INFINITY,
                          -(jsl_real)INFINITY,
                          (jsl_real)NAN,
                          SMALLEST,
                          -SMALLEST,
                          LARGEST,
                          -LARGEST};
    for (int i = 0; i < JSL_COUNT(v); i++) {
        for (int k = 0; k < JSL_COUNT(v); k++) {
            jsl_real got = jsl_atan2(v[i], v[k]);
            long double truth = atan2l((long double)v[i], (long double)v[k]);
            assert_true(ulp_error(got, truth) <= BOUND_ATAN2);
            if (got == 0) assert_int_equal(signbit(got) != 0, signbit(truth) != 0);
        }
    }
}

static void the_exponential_is_within_an_ulp_from_zero_to_infinity(void **state) {
    (void)state;
    worst w = {0};
    uint64_t seed = 4;
    for (int i = 0; i < SAMPLES; i++) {
        jsl_real x = (jsl_real)test_uniform(&seed, EXP_LOW, EXP_HIGH);
        note(&w, jsl_exp(x), expl((long double)x), x, 0);
        x = (jsl_real)test_uniform(&seed, -1, 1);
        note(&w, jsl_exp(x), expl((long double)x), x, 0);
        x = random_magnitude(&seed, LOWEST_EXPONENT + 1, 6);
        note(&w, jsl_exp(x), expl((long double)x), x, 0);
    }
    judge(w, BOUND_EXP, "exp");
    assert_true(jsl_exp(0) == 1 && jsl_exp(JSL_R(-0.0)) == 1);
    assert_true(jsl_exp(LARGEST) == (jsl_real)INFINITY &&
                jsl_exp((jsl_real)INFINITY) == (jsl_real)INFINITY);
    assert_true(jsl_exp(-LARGEST) == 0 && jsl_exp(-(jsl_real)INFINITY) == 0);
    assert_true(jsl_exp((jsl_real)NAN) != jsl_exp((jsl_real)NAN));
}

static void the_logarithm_is_within_an_ulp_also_next_to_one(void **state) {
    (void)state;
    worst w = {0};
    uint64_t seed = 5;
    jsl_real up = 1, down = 1;
    for (int i = 0; i < SAMPLES; i++) {
        jsl_real x = jsl_abs(random_magnitude(&seed, LOWEST_EXPONENT + 1, HIGHEST_EXPONENT + 1));
        if (x > 0 && jsl_is_finite(x)) note(&w, jsl_log(x), logl((long double)x), x, 0);
        x = (jsl_real)test_uniform(&seed, 0.5, 2);
        note(&w, jsl_log(x), logl((long double)x), x, 0);
        up = next_up(up), down = next_down(down);
        note(&w, jsl_log(up), logl((long double)up), up, 0);
        note(&w, jsl_log(down), logl((long double)down), down, 0);
    }
    note(&w, jsl_log(SMALLEST), logl((long double)SMALLEST), SMALLEST, 0);
    note(&w, jsl_log(LARGEST), logl((long double)LARGEST), LARGEST, 0);
    judge(w, BOUND_LOG, "log");
    assert_true(jsl_log(1) == 0);
    assert_true(jsl_log(0) == -(jsl_real)INFINITY && jsl_log(JSL_R(-0.0)) == -(jsl_real)INFINITY);
    assert_true(jsl_log((jsl_real)INFINITY) == (jsl_real)INFINITY);
    const jsl_real bad[] = {-1, -SMALLEST, -(jsl_real)INFINITY, (jsl_real)NAN};
    for (int i = 0; i < 4; i++) assert_true(jsl_log(bad[i]) != jsl_log(bad[i]));
}

/* Pinned: the same bits from every compiler and option. */
static void the_bits_are_pinned(void **state) {
    (void)state;
    uint64_t hash = 0;
    for (int i = -20000; i <= 20000; i++) {
        jsl_real x = (jsl_real)i * JSL_R(0.0078125), r[5];
        jsl_sin_cos(x, &r[0], &r[1]);
        r[2] = jsl_atan2(x, JSL_R(0.75) - x * x);
        r[3] = jsl_exp(x / 4);
        r[4] = jsl_log(jsl_abs(x) + JSL_R(0.001));
        hash = jsl_hash_bytes(r, sizeof r, hash);
    }
    print_message("             hash %016llx\n", (unsigned long long)hash);
    assert_true(hash ==
                (jsl_is_double() ? UINT64_C(0x826538092ee7b919) : UINT64_C(0xc684d0249604f608)));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sine_and_cosine_are_within_an_ulp_over_their_range),
        cmocka_unit_test(angles_next_to_multiples_of_a_right_angle_keep_their_digits),
        cmocka_unit_test(sine_and_cosine_at_special_points),
        cmocka_unit_test(sine_is_odd_and_cosine_is_even_to_the_bit),
        cmocka_unit_test(arc_tangent_is_within_its_bound_in_all_octants),
        cmocka_unit_test(arc_tangent_at_special_points_is_that_of_the_standard),
        cmocka_unit_test(the_exponential_is_within_an_ulp_from_zero_to_infinity),
        cmocka_unit_test(the_logarithm_is_within_an_ulp_also_next_to_one),
        cmocka_unit_test(the_bits_are_pinned),
    };
    return cmocka_run_group_tests_name("scalar", tests, NULL, NULL);
}
