/* SPDX-License-Identifier: MIT
 * test_wide.c - every operation of wide.h gives the same bits at every level that this CPU has, and
 * those that the scalar definitions in this file give.
 */
#include "base/base.h"
#include "helper.h"
#include "math/wide_selftest.h"

#include <float.h>

enum { N = 4096 };
typedef struct data {
    _Alignas(JSL_ALIGN) jsl_real a[N], b[N];
    _Alignas(JSL_ALIGN) jsl_real out[JSL_ISA_COUNT][JSL_WIDE_OP_COUNT][N];
    jsl_isa widest;
} data;

static const char *const op_name[] = {
#define JSL_X(name) #name,
    JSL_WIDE_OPS(JSL_X)
#undef JSL_X
};

static bool same_bits(jsl_real x, jsl_real y) { return memcmp(&x, &y, sizeof x) == 0; }

/* Which NaN an arithmetic operation gives depends on the order in which the compiler puts operands:
 * there NaN is NaN. Selection must keep all bits. */
static bool is_arithmetic(int op) {
    return op == JSL_WIDE_add || op == JSL_WIDE_sub || op == JSL_WIDE_mul || op == JSL_WIDE_div ||
           op == JSL_WIDE_sqrt || op == JSL_WIDE_sum || op == JSL_WIDE_sum_wide;
}

static void check_same(int op, int i, jsl_real got, jsl_real want, const char *level) {
    if (same_bits(got, want)) return;
    if (is_arithmetic(op) && got != got && want != want) return;
    fail_msg("%s at %s, row %d: %.17g, not %.17g", op_name[op], level, i, (double)got,
             (double)want);
}

static int fill(void **state) {
    static data d; /* too large for a stack */
    const jsl_real special[] = {0,
                                JSL_R(-0.0),
                                1,
                                -1,
                                (jsl_real)NAN,
                                -(jsl_real)NAN,
                                (jsl_real)INFINITY,
                                -(jsl_real)INFINITY,
#ifdef JSL_DOUBLE
                                DBL_MAX,
                                -DBL_MIN,
                                0x1p-1074,
                                -0x1p-1074
#else
                                FLT_MAX,
                                -FLT_MIN,
                                0x1p-149f,
                                -0x1p-149f
#endif
    };
    const int specials = JSL_COUNT(special);
    uint64_t seed = 77;
    for (int i = 0; i < N; i++) {
        d.a[i] = (jsl_real)test_uniform(&seed, -10, 10);
        d.b[i] = i % 5 ? (jsl_real)test_uniform(&seed, -10, 10) : d.a[i];
    }
    /* All pairs of special values; plain numbers follow, so that sums are finite there. */
    for (int i = 0; i < specials * specials; i++) {
        d.a[i] = special[i / specials];
        d.b[i] = special[i % specials];
    }
    d.widest = jsl_isa_resolve(JSL_ISA_AVX512);
    for (int isa = JSL_ISA_SCALAR; isa <= (int)d.widest; isa++)
        JSL_KERNEL_PICK((jsl_isa)isa, jsl_wide_selftest)(d.a, d.b, N, &d.out[isa][0][0]);
    *state = &d;
    return 0;
}

static void all_levels_give_the_bits_of_the_scalar_one(void **state) {
    data *d = *state;
    for (int isa = JSL_ISA_SSE; isa <= (int)d->widest; isa++)
        for (int op = 0; op < JSL_WIDE_OP_COUNT; op++)
            for (int i = 0; i < N; i++)
                check_same(op, i, d->out[isa][op][i], d->out[JSL_ISA_SCALAR][op][i],
                           jsl_isa_text((jsl_isa)isa));
    print_message("             compared up to %s\n", jsl_isa_text(d->widest));
}

static jsl_real clear_sign(jsl_real x) {
    unsigned char bytes[sizeof x];
    memcpy(bytes, &x, sizeof x);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    bytes[sizeof x - 1] &= 0x7f;
#else
    bytes[0] &= 0x7f;
#endif
    memcpy(&x, bytes, sizeof x);
    return x;
}

static void the_results_are_those_of_the_definitions(void **state) {
    data *d = *state;
    for (int isa = JSL_ISA_SCALAR; isa <= (int)d->widest; isa++) {
        for (int i = 0; i < N; i++) {
            jsl_real a = d->a[i], b = d->b[i];
#define CHECK(op, want)                                                                            \
    check_same(JSL_WIDE_##op, i, d->out[isa][JSL_WIDE_##op][i], want, jsl_isa_text((jsl_isa)isa))
            CHECK(load, a);
            CHECK(loadu, b);
            CHECK(set, d->a[i / JSL_LANES * JSL_LANES]);
            CHECK(add, a + b);
            CHECK(sub, a - b);
            CHECK(mul, a * b);
            CHECK(gt, a > b);
            CHECK(ge, a >= b);
            CHECK(eq, a == b);
            CHECK(bits_gt, a > b);
            CHECK(bits_ge, a >= b);
            CHECK(bits_eq, a == b);
            CHECK(select, a > b ? a : b);
            CHECK(max, a > b ? a : b);
            CHECK(min, a < b ? a : b);
            CHECK(sqrt, jsl_sqrt(a));
            CHECK(abs, clear_sign(a));
            CHECK(keep, a >= b ? a : 0);
        }
    }
}

static void extrema_give_the_second_operand_on_nan_and_on_equal_zeros(void **state) {
    data *d = *state;
    int nan_pairs = 0, zero_pairs = 0;
    for (int isa = JSL_ISA_SCALAR; isa <= (int)d->widest; isa++) {
        for (int i = 0; i < N; i++) {
            jsl_real a = d->a[i], b = d->b[i];
            bool nan = a != a || b != b, zeros = a == 0 && b == 0;
            if (!nan && !zeros) continue;
            assert_true(same_bits(d->out[isa][JSL_WIDE_max][i], b));
            assert_true(same_bits(d->out[isa][JSL_WIDE_min][i], b));
            nan_pairs += nan, zero_pairs += zeros;
        }
    }
    assert_true(nan_pairs >= 40 && zero_pairs >= 4);
}

static void sums_use_the_fixed_tree(void **state) {
    data *d = *state;
    for (int isa = JSL_ISA_SCALAR; isa <= (int)d->widest; isa++) {
        for (int i = 0; i < N; i += JSL_LANES) {
            jsl_real t[JSL_LANES];
            memcpy(t, d->a + i, sizeof t);
            for (int half = JSL_LANES / 2; half; half /= 2)
                for (int k = 0; k < half; k++) t[k] = t[k] + t[k + half];
            CHECK(sum, t[0]);
            CHECK(sum_wide, t[0]);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_levels_give_the_bits_of_the_scalar_one),
        cmocka_unit_test(the_results_are_those_of_the_definitions),
        cmocka_unit_test(extrema_give_the_second_operand_on_nan_and_on_equal_zeros),
        cmocka_unit_test(sums_use_the_fixed_tree),
    };
    return cmocka_run_group_tests_name("wide", tests, fill, NULL);
}
