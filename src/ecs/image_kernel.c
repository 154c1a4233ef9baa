/* SPDX-License-Identifier: MIT
 * Slots and handles to and from the words of an image: plain loops that the compiler turns into
 * vectors of each level. Floor 2.
 */
#include "ecs/image_kernel.h"

#include "math/wide.h"

#define GROUP 64 /* words of a list compared at a time */

JSL_INLINE uint32_t word_at(const unsigned char *p, uint64_t i) {
    uint32_t x;
    memcpy(&x, p + i * 4, 4);
    return x;
}

void JSL_KERNEL(jsl_pack_generations)(uint32_t *restrict to, const jsl_slot *restrict slot,
                                      int64_t n) {
    for (int64_t i = 0; i < n; i++) to[i] = slot[i].generation & JSL_GENERATION_MAX;
}

void JSL_KERNEL(jsl_pack_handles)(uint32_t *restrict to, const jsl_entity *restrict entity,
                                  int64_t n) {
    for (int64_t i = 0; i < n; i++) to[i] = entity[i].index - 1;
}

uint64_t JSL_KERNEL(jsl_run_length)(const unsigned char *list, uint64_t n) {
    uint32_t first = word_at(list, 0);
    uint64_t i = 1;
    for (; i + GROUP <= n; i += GROUP) {
        uint32_t other = 0;
        for (uint32_t k = 0; k < GROUP; k++)
            other |= word_at(list, i + k) ^ (first + (uint32_t)i + k);
        if (other) break;
    }
    while (i < n && word_at(list, i) == first + (uint32_t)i) i++;
    return i;
}

bool JSL_KERNEL(jsl_generations_good)(const unsigned char *generation, uint64_t n) {
    uint32_t bad = 0;
    for (uint64_t i = 0; i < n; i++) bad |= word_at(generation, i) - 1 >= JSL_GENERATION_MAX;
    return !bad;
}

void JSL_KERNEL(jsl_load_run)(jsl_slot *restrict slot, jsl_entity *restrict entity,
                              const unsigned char *restrict generation, jsl_slot head,
                              uint32_t first, uint64_t n) {
    for (uint64_t i = 0; i < n; i++) {
        uint32_t g = word_at(generation, i) | head.generation;
        slot[i] = (jsl_slot){head.table, head.row + (uint32_t)i, g};
        entity[i] = (jsl_entity){first + 1 + (uint32_t)i, g};
    }
}
