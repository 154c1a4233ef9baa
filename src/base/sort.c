/* SPDX-License-Identifier: MIT
 * sort.c - stable least-significant-digit radix sorts. All histograms are taken in one pass; a
 * digit that is equal in all keys costs nothing; sorted input returns after that pass.
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
