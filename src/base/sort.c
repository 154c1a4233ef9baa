/* SPDX-License-Identifier: MIT
 * sort.c - stable least-significant-digit radix sorts. A first pass finds the bits that differ at
 * all and returns when the keys are sorted; digits are laid over those bits only, all their
 * histograms are taken in one pass, and a digit that is equal in all keys is skipped.
 */
#include "base/base.h"

#define KEY uint64_t
#define NAME(x) x##_u64
#include "base/sort_radix.h"
#undef KEY
#undef NAME

#define KEY uint32_t
#define NAME(x) x##_u32
#include "base/sort_radix.h"
#undef KEY
#undef NAME
