/* SPDX-License-Identifier: MIT
 * The image of an ECS. All numbers little-endian; every part starts at a multiple of 8 bytes, gaps
 * are zero.
 *
 *   header      jsl_image_header
 *   schema      for each component that a saved table has: name, keeps_order u8, field count u8,
 * for each field name, unit, type u8, role u8. A text is a length u8 and its bytes. slots       u32
 * generation[slots] without the tag (0: retired), then u32 index[free] in the order of reuse tables
 * for each: jsl_image_table, u8 component[components] (places in the schema), u32 slot[rows], then
 * each STATE and CACHE field as an array of rows values, components in that order checksum    u64
 * over all before it
 *
 * Private to this room. Floor 2.
 */
#ifndef JSL_ECS_IMAGE_H
#define JSL_ECS_IMAGE_H

#include "ecs/hash_kernel.h"
#include "ecs/store.h"

#define JSL_IMAGE_MAGIC "JSL-ECS\n"
#define JSL_IMAGE_VERSION 1u

typedef struct jsl_image_header {
    char magic[8];
    uint32_t version, real_bytes; /* 4: written by the float library, 8: by the double one */
    uint64_t size;                /* of the whole image */
    uint32_t components, tables;
    uint64_t slots, free_slots, live;
    uint64_t zero;
} jsl_image_header;

typedef struct jsl_image_table {
    uint32_t components, zero;
    uint64_t rows;
} jsl_image_table;

_Static_assert(sizeof(jsl_image_header) == 64 && sizeof(jsl_image_table) == 16, "no padding");

/* A running checksum: whole groups of bytes go into lanes, the rest and the lanes into one number
 * at the end. */
typedef struct jsl_image_sum {
    uint64_t lane[JSL_SUM_LANES];
} jsl_image_sum;

static inline jsl_image_sum jsl_image_sum_begin(void) {
    jsl_image_sum sum;
    for (uint64_t i = 0; i < JSL_SUM_LANES; i++) sum.lane[i] = jsl_mix64(0x6a736c2d65637321ull + i);
    return sum;
}
static inline void jsl_image_sum_mix(const jsl_ecs *ecs, jsl_image_sum *sum,
                                     const unsigned char *bytes, size_t size) {
    JSL_KERNEL_PICK(ecs->isa, jsl_sum_mix)(sum->lane, bytes, size);
}
static inline uint64_t jsl_image_sum_end(const jsl_image_sum *sum, const unsigned char *rest,
                                         size_t size) {
    return jsl_hash_bytes(rest, size, jsl_hash_bytes(sum->lane, sizeof sum->lane, 0));
}

static inline bool jsl_column_is_saved(const jsl_column *column) {
    return jsl_role_is_saved(column->role);
}

#endif
