/* SPDX-License-Identifier: MIT
 * result.c - texts of results, and what this build is.
 */
#include "base/base.h"

const char *jsl_result_text(jsl_result result) {
    static const char *const text[] = {
#define JSL_X(code, text) text,
        JSL_RESULTS(JSL_X)
#undef JSL_X
    };
    return (unsigned)result < (unsigned)JSL_RESULT_COUNT ? text[result] : "unknown result";
}

const char *jsl_version(void) { return JSL_VERSION_TEXT; }

bool jsl_is_double(void) { return sizeof(jsl_real) == sizeof(double); }
