/* SPDX-License-Identifier: MIT
 * isa.c - which instruction sets this CPU has, and which one to use.
 */
#include "base/base.h"

#include <stdlib.h>

const char *jsl_isa_text(jsl_isa isa) {
    switch (isa) {
    case JSL_ISA_SCALAR:
        return "scalar";
    case JSL_ISA_SSE:
        return "sse";
    case JSL_ISA_AVX2:
        return "avx2";
    case JSL_ISA_AVX512:
        return "avx512";
    default:
        return "auto";
    }
}

/* The levels must match the machine flags that the Makefile gives to kernels. */
static jsl_isa widest(void) {
#if defined(__x86_64__)
    if (!__builtin_cpu_supports("sse4.1")) return JSL_ISA_SCALAR;
    if (!__builtin_cpu_supports("avx2")) return JSL_ISA_SSE;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
        return JSL_ISA_AVX512;
    return JSL_ISA_AVX2;
#else
    return JSL_ISA_SCALAR;
#endif
}

jsl_isa jsl_isa_resolve(jsl_isa isa) {
    jsl_isa best = widest();
    if (isa == JSL_ISA_AUTO) {
        const char *name = getenv("JSL_ISA");
        for (int i = JSL_ISA_SCALAR; name && i < JSL_ISA_COUNT; i++)
            if (strcmp(name, jsl_isa_text((jsl_isa)i)) == 0) isa = (jsl_isa)i;
    }
    return isa > JSL_ISA_AUTO && isa < best ? isa : best;
}
