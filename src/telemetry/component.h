/* SPDX-License-Identifier: MIT
 * columns_t: one chunk of one frame of one component, whatever its fields are. Floor 6.
 */
#ifndef JSL_TELEMETRY_COMPONENT_H
#define JSL_TELEMETRY_COMPONENT_H

#include "telemetry/message.h"

#include <jostle/ecs.h>

/* columns_t.type: the enumerators of jsl_type from JSL_TYPE_F32 on, without JSL_TYPE_REAL, which is
 * F32 or F64 by the build that wrote it. An entity is an id. */
_Static_assert(JSL_TYPE_F32 == 1 && JSL_TYPE_F64 == 2 && JSL_TYPE_I8 == 3 && JSL_TYPE_U64 == 10 &&
                   JSL_TYPE_ENTITY == 11,
               "COL_* of jostle.lcm");

/* The type on the wire of a field. */
jsl_type jsl_wire_type(jsl_type type);

typedef struct jsl_component_chunk {
    jsl_msg_columns m; /* its arrays are in the arena, strings and data in the bytes read */
    int64_t row_bytes; /* of one entity in data, its id included */
} jsl_component_chunk;

/* Reads any bytes; see jsl_message_decode. Beyond that: names are names, types are known, counts
 * agree and, when check_crc, so does the checksum. */
jsl_result jsl_component_decode(const uint8_t *data, int64_t size, bool check_crc, jsl_arena *arena,
                                jsl_component_chunk *out);
/* Whether two chunks may belong to one frame or one export: same component, same fields. */
bool jsl_component_alike(const jsl_msg_columns *a, const jsl_msg_columns *b);

#endif
