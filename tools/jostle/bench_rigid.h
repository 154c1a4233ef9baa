/* SPDX-License-Identifier: MIT
 * Timing of rigid bodies: for `jostle bench rigid`.
 */
#ifndef JOSTLE_TOOL_BENCH_RIGID_H
#define JOSTLE_TOOL_BENCH_RIGID_H

#include <stdint.h>

typedef void jsl_bench_emit(const char *bench_case, int64_t n, int threads, double value,
                            const char *unit, const char *peer, double peer_value);
/* The pyramid of 5050 boxes (Box3D's benchmark large_pyramid: base 100, unit cubes of density 100,
 * friction 0.6, 1/60 s, 4 sub-steps): mean of 200 steps after the first, whole step and by phase,
 * on 1 and 2 threads. Returns 0, or a jsl_result. */
int jsl_bench_rigid(jsl_bench_emit *emit);

#endif
