/* SPDX-License-Identifier: MIT
 * schema.c - the text of lcmtypes/jostle.lcm, so that every log can say what its messages mean.
 */
#include "telemetry/schema.h"

/* Made by the Makefile: the bytes of the file, separated by commas. */
const char jsl_schema_text[] = {
#include "jostle_lcm_text.h"
    0};
const int64_t jsl_schema_text_size = (int64_t)sizeof jsl_schema_text - 1;
