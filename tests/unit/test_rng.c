/* SPDX-License-Identifier: MIT
 * test_rng.c - random numbers keyed by who asks.
 */
#include "base/base.h"
#include "helper.h"

static void the_same_key_gives_the_same_stream(void **state) {
    (void)state;
    jsl_rng a = jsl_rng_make(1, 2, 3, 4), b = jsl_rng_make(1, 2, 3, 4);
    for (int i = 0; i < 1000; i++) assert_true(jsl_rng_u64(&a) == jsl_rng_u64(&b));
}

/* Pinned: a change of these numbers changes every scene with random births. */
static void the_stream_is_pinned(void **state) {
    (void)state;
    jsl_rng rng = jsl_rng_make(42, 7, 1000, 3);
    uint64_t first = jsl_rng_u64(&rng), second = jsl_rng_u64(&rng);
    assert_true(first == 0xee8f9bfed16db884ull);
    assert_true(second == 0xc3db02474d1c6c21ull);
}

static void neighbouring_keys_share_nothing(void **state) {
    (void)state;
    /* Half of 64 bits differ on average; 4000 comparisons of independent numbers stay in 10 .. 54.
     */
    for (uint64_t i = 0; i < 1000; i++) {
        jsl_rng base = jsl_rng_make(i, i, i, i);
        uint64_t x = jsl_rng_u64(&base);
        jsl_rng near[4] = {jsl_rng_make(i + 1, i, i, i), jsl_rng_make(i, i + 1, i, i),
                           jsl_rng_make(i, i, i + 1, i), jsl_rng_make(i, i, i, i + 1)};
        for (int k = 0; k < 4; k++) {
            int differ = __builtin_popcountll(x ^ jsl_rng_u64(&near[k]));
            assert_in_range(differ, 10, 54);
        }
    }
}

static void the_unit_interval_is_filled_evenly(void **state) {
    (void)state;
    enum { N = 1 << 20, BINS = 64 };
    int bin[BINS] = {0};
    double sum = 0, sum_sq = 0;
    jsl_rng rng = jsl_rng_make(5, 0, 0, 0);
    for (int i = 0; i < N; i++) {
        double u = (double)jsl_rng_unit(&rng);
        assert_true(u >= 0 && u < 1);
        bin[(int)(u * BINS)]++;
        sum += u, sum_sq += u * u;
    }
    assert_close(sum / N, 0.5, 5 * 0.29 / 1024);
    assert_close(sum_sq / N, 1.0 / 3, 5 * 0.3 / 1024);
    double chi_sq = 0;
    for (int b = 0; b < BINS; b++) chi_sq += pow(bin[b] - N / BINS, 2) / (N / BINS);
    assert_true(chi_sq < 63 + 5 * sqrt(2 * 63.0)); /* 63 degrees of freedom, five sigma */
}

static void signed_numbers_are_centred(void **state) {
    (void)state;
    jsl_rng rng = jsl_rng_make(6, 0, 0, 0);
    double sum = 0;
    for (int i = 0; i < 1 << 20; i++) {
        double u = (double)jsl_rng_signed(&rng);
        assert_true(u >= -1 && u < 1);
        sum += u;
    }
    assert_close(sum / (1 << 20), 0, 5 * 0.58 / 1024);
}

static void successive_numbers_are_uncorrelated(void **state) {
    (void)state;
    jsl_rng rng = jsl_rng_make(7, 0, 0, 0);
    double last = (double)jsl_rng_signed(&rng), sum = 0;
    for (int i = 0; i < 1 << 20; i++) {
        double u = (double)jsl_rng_signed(&rng);
        sum += u * last;
        last = u;
    }
    assert_close(sum / (1 << 20), 0, 5 * 0.34 / 1024);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_key_gives_the_same_stream),
        cmocka_unit_test(the_stream_is_pinned),
        cmocka_unit_test(neighbouring_keys_share_nothing),
        cmocka_unit_test(the_unit_interval_is_filled_evenly),
        cmocka_unit_test(signed_numbers_are_centred),
        cmocka_unit_test(successive_numbers_are_uncorrelated),
    };
    return cmocka_run_group_tests_name("rng", tests, NULL, NULL);
}
