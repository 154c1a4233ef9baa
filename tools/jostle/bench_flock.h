/* SPDX-License-Identifier: MIT
 * jostle bench flock. Floor 7.
 */
#ifndef JSL_TOOLS_BENCH_FLOCK_H
#define JSL_TOOLS_BENCH_FLOCK_H

#include <stdint.h>

/* One figure: value of ours beside the value of a peer from the same run. */
typedef void jsl_bench_emit(const char *bench_case, int64_t n, int threads, double value,
                            const char *unit, const char *peer, double peer_value);

/* 0, or 1 when something could not be measured. Takes about a minute. */
int jsl_bench_flock(jsl_bench_emit *emit);

#endif
