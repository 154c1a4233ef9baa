/* SPDX-License-Identifier: MIT
 * result.c - texts of results, and what this build is.
 */
#include "base/base.h"

/* A switch, not a table of pointers: that would need relocations, and nm would take it for a
 * global. */
const char *jsl_result_text(jsl_result result) {
    switch (result) {
#define JSL_X(code, text)                                                                          \
    case code:                                                                                     \
        return text;
        JSL_RESULTS(JSL_X)
#undef JSL_X
    default:
        return "unknown result";
    }
}

const char *jsl_version(void) { return JSL_VERSION_TEXT; }

bool jsl_is_double(void) { return sizeof(jsl_real) == sizeof(double); }
