/* SPDX-License-Identifier: MIT
 * The benchmarks of `jostle bench`, one function a room. Each measures and calls emit once per
 * figure; peer is null when nothing was compared. They return 0, or 1 when something could not be
 * measured. Floor 7.
 */
#ifndef JOSTLE_BENCH_H
#define JOSTLE_BENCH_H

#include <stdint.h>

typedef void jsl_bench_emit(const char *bench_case, int64_t n, int threads, double value,
                            const char *unit, const char *peer, double peer_value);

int jsl_bench_ecs(jsl_bench_emit *emit);
int jsl_bench_particles(jsl_bench_emit *emit);
int jsl_bench_flock(jsl_bench_emit *emit);
int jsl_bench_rigid(jsl_bench_emit *emit);
int jsl_bench_telemetry(jsl_bench_emit *emit);

#endif
