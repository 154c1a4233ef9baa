/* SPDX-License-Identifier: MIT
 * Mixing columns into one accumulator a row. Floor 2.
 */
#ifndef JSL_ECS_HASH_KERNEL_H
#define JSL_ECS_HASH_KERNEL_H

#include "math/wide_dispatch.h"
#include <jostle/ecs.h>

typedef struct jsl_hash_step {
    const unsigned char *values; /* of the first row; null: mix in `key` instead */
    uint32_t bytes;              /* 1, 2, 4, 8 */
    uint32_t key;
    bool entity; /* values are handles: leave out the tag */
} jsl_hash_step;

/* The sum over rows [0, count) of the finished accumulators: handle, then every step in turn.
 * Arrays are readable up to count rounded up to 16. All levels give the same number. */
JSL_KERNEL_DECLARE(uint64_t, jsl_hash_rows,
                   (const jsl_entity *entity, const jsl_hash_step *step, int steps, int64_t count));

/* Mixes size bytes (a multiple of JSL_SUM_BYTES) into the lanes of a running checksum. */
#define JSL_SUM_LANES 16
#define JSL_SUM_BYTES (JSL_SUM_LANES * 8)
JSL_KERNEL_DECLARE(void, jsl_sum_mix,
                   (uint64_t sum[JSL_SUM_LANES], const unsigned char *bytes, size_t size));

#endif
