/* SPDX-License-Identifier: MIT
 * wide_selftest_kernel.c - every operation of wide.h, for tests/unit/test_wide.c.
 */
#include "math/wide_selftest.h"

#include "math/wide.h"

static void put_bits(jsl_real *out, int bits) {
    for (int i = 0; i < WN; i++) out[i] = (jsl_real)(bits >> i & 1);
}

static void arithmetic(const jsl_real *a, const jsl_real *b, int n, int i, jsl_real *out) {
#define ROW(name) (out + (JSL_WIDE_##name) * n + i)
    wreal x = wload(a + i), y = wloadu(b + i);
    wstore(ROW(load), x);
    wstoreu(ROW(loadu), y);
    wstore(ROW(set), wset(a[i / JSL_LANES * JSL_LANES]));
    wstore(ROW(add), x + y);
    wstore(ROW(sub), x - y);
    wstore(ROW(mul), x * y);
    wstore(ROW(div), x / y);
    wstore(ROW(neg), -x);
    wstore(ROW(max), wmax(x, y));
    wstore(ROW(min), wmin(x, y));
    wstore(ROW(sqrt), wsqrt(x));
    wstore(ROW(abs), wabs(x));
}

static void comparisons(const jsl_real *a, const jsl_real *b, int n, int i, jsl_real *out) {
    wreal x = wload(a + i), y = wload(b + i), one = wset(1), zero = wset(0);
    wmask gt = wgt(x, y), ge = wge(x, y), eq = weq(x, y);
    wstore(ROW(gt), wselect(gt, one, zero));
    wstore(ROW(ge), wselect(ge, one, zero));
    wstore(ROW(eq), wselect(eq, one, zero));
    put_bits(ROW(bits_gt), wbits(gt));
    put_bits(ROW(bits_ge), wbits(ge));
    put_bits(ROW(bits_eq), wbits(eq));
    wstore(ROW(select), wselect(gt, x, y));
    wstore(ROW(keep), wkeep(gt | eq, x));
}

static void sums(const jsl_real *a, int n, int i, jsl_real *out) {
    wreal v[WG];
    for (int g = 0; g < WG; g++) v[g] = wload(a + i + g * WN);
    jsl_real sum = wsum16(a + i), sum_wide = wsum16w(v);
    for (int k = 0; k < JSL_LANES; k++) {
        ROW(sum)[k] = sum;
        ROW(sum_wide)[k] = sum_wide;
    }
}

void JSL_KERNEL(jsl_wide_selftest)(const jsl_real *a, const jsl_real *b, int n, jsl_real *out) {
    for (int i = 0; i < n; i += WN) {
        arithmetic(a, b, n, i, out);
        comparisons(a, b, n, i, out);
    }
    for (int i = 0; i < n; i += JSL_LANES) sums(a, n, i, out);
}
