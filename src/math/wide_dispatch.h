/* SPDX-License-Identifier: MIT
 * Choosing one of the four builds of a kernel. Floor 1.
 *
 *   JSL_KERNEL_DECLARE(void, particle_move, (args));      declares particle_move_scalar .. _avx512
 *   JSL_KERNEL_PICK(isa, particle_move)                     the one of that (resolved) level
 */
#ifndef JSL_MATH_WIDE_DISPATCH_H
#define JSL_MATH_WIDE_DISPATCH_H

#include <jostle/base.h>

#if defined(__x86_64__)
#define JSL_KERNEL_DECLARE(result, name, args)                                                     \
    result name##_scalar args;                                                                     \
    result name##_sse args;                                                                        \
    result name##_avx2 args;                                                                       \
    result name##_avx512 args
#define JSL_KERNEL_PICK(isa, name)                                                                 \
    ((isa) == JSL_ISA_AVX512 ? name##_avx512                                                       \
     : (isa) == JSL_ISA_AVX2 ? name##_avx2                                                         \
     : (isa) == JSL_ISA_SSE  ? name##_sse                                                          \
                             : name##_scalar)
#else
#define JSL_KERNEL_DECLARE(result, name, args) result name##_scalar args
#define JSL_KERNEL_PICK(isa, name) ((void)(isa), name##_scalar)
#endif

#endif
