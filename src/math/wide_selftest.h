/* SPDX-License-Identifier: MIT
 * Every operation of wide.h over arrays, so that a test can compare the levels bit by bit. Floor 1.
 */
#ifndef JSL_MATH_WIDE_SELFTEST_H
#define JSL_MATH_WIDE_SELFTEST_H

#include "math/wide_dispatch.h"

/* X(name): one row of n results each. bits_*: 1 or 0 from wbits of a comparison. sum and sum_wide:
 * one result for each group of 16, repeated in all its lanes. */
#define JSL_WIDE_OPS(X)                                                                            \
    X(load)                                                                                        \
    X(loadu)                                                                                       \
    X(set)                                                                                         \
    X(add)                                                                                         \
    X(sub)                                                                                         \
    X(mul)                                                                                         \
    X(div)                                                                                         \
    X(neg)                                                                                         \
    X(gt)                                                                                          \
    X(ge)                                                                                          \
    X(eq)                                                                                          \
    X(bits_gt)                                                                                     \
    X(bits_ge)                                                                                     \
    X(bits_eq)                                                                                     \
    X(select)                                                                                      \
    X(max)                                                                                         \
    X(min)                                                                                         \
    X(sqrt)                                                                                        \
    X(abs)                                                                                         \
    X(keep)                                                                                        \
    X(sum)                                                                                         \
    X(sum_wide)

enum {
#define JSL_X(name) JSL_WIDE_##name,
    JSL_WIDE_OPS(JSL_X)
#undef JSL_X
        JSL_WIDE_OP_COUNT
};

/* a, b and out are aligned to JSL_ALIGN; n is a multiple of JSL_LANES; out has JSL_WIDE_OP_COUNT
 * rows of n. Selection is by a > b. */
JSL_KERNEL_DECLARE(void, jsl_wide_selftest,
                   (const jsl_real *a, const jsl_real *b, int n, jsl_real *out));

#endif
