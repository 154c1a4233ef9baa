/* SPDX-License-Identifier: MIT
 * Slots and handles to and from the words of an image. Lists of slots are mostly runs k, k + 1,
 * k + 2 ..., and these are done by whole vectors. Words may lie at any address. All levels do the
 * same. Floor 2.
 */
#ifndef JSL_ECS_IMAGE_KERNEL_H
#define JSL_ECS_IMAGE_KERNEL_H

#include "ecs/store.h"
#include "math/wide_dispatch.h"

/* to[i] = generation of slot[i], without the tag. */
JSL_KERNEL_DECLARE(void, jsl_pack_generations, (uint32_t * to, const jsl_slot *slot, int64_t n));

/* to[i] = slot of entity[i]. */
JSL_KERNEL_DECLARE(void, jsl_pack_handles, (uint32_t * to, const jsl_entity *entity, int64_t n));

/* How many of the n words of the list, from the first on, go up by one each. n is at least 1. */
JSL_KERNEL_DECLARE(uint64_t, jsl_run_length, (const unsigned char *list, uint64_t n));

/* True when all n words are generations that a live or free slot may have. */
JSL_KERNEL_DECLARE(bool, jsl_generations_good, (const unsigned char *generation, uint64_t n));

/* Makes n live slots, of which `first` is the number of the first one, and their handles. head: its
 * table and row, and the tag, which is added to the generations. */
JSL_KERNEL_DECLARE(void, jsl_load_run,
                   (jsl_slot * slot, jsl_entity *entity, const unsigned char *generation,
                    jsl_slot head, uint32_t first, uint64_t n));

#endif
