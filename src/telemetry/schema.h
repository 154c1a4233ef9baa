/* SPDX-License-Identifier: MIT
 * The text of lcmtypes/jostle.lcm, closed by a NUL. Floor 6.
 */
#ifndef JSL_TELEMETRY_SCHEMA_H
#define JSL_TELEMETRY_SCHEMA_H

#include <stdint.h>

extern const char jsl_schema_text[];
extern const int64_t jsl_schema_text_size;

#endif
