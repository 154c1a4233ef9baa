/* SPDX-License-Identifier: MIT
 * jostle bench: time the kernels beside their peers, in one run.
 */
#include "bench.h"
#include "cli.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static const struct bench {
    const char *name;
    int (*run)(jsl_bench_emit *emit);
} benches[] = {{"ecs", jsl_bench_ecs},
               {"particles", jsl_bench_particles},
               {"flock", jsl_bench_flock},
               {"rigid", jsl_bench_rigid},
               {"telemetry", jsl_bench_telemetry}};

/* What emit needs to know; a callback without context keeps the benchmarks simple, and this tool
 * has one thread. */
static const char *present;
static bool as_json;

static void emit(const char *bench_case, int64_t n, int threads, double value, const char *unit,
                 const char *peer, double peer_value) {
    double ratio = peer && peer_value > 0 ? value / peer_value : 0;
    if (!as_json) {
        printf("%-10s %-34s n %-9lld threads %d  %10.3f %-14s", present, bench_case, (long long)n,
               threads, value, unit);
        if (peer) printf("  %-22s %10.3f  ratio %.3f", peer, peer_value, ratio);
        putchar('\n');
    } else {
        json_t *o =
            json_pack("{s:s s:s s:I s:i s:s s:f s:s}", "bench", present, "case", bench_case, "n",
                      (json_int_t)n, "threads", threads, "isa",
                      jsl_isa_text(jsl_isa_resolve(JSL_ISA_AUTO)), "value", value, "unit", unit);
        if (peer) {
            json_object_set_new(o, "peer", json_string(peer));
            json_object_set_new(o, "peer_value", json_real(peer_value));
            json_object_set_new(o, "ratio", json_real(ratio));
        }
        char *text = json_dumps(o, JSON_COMPACT | JSON_REAL_PRECISION(6));
        if (text) puts(text);
        free(text);
        json_decref(o);
    }
    fflush(stdout);
}

static int run(const command *self, int argc, char **argv) {
    const option_row rows[] = {
        {"json", 0, OPTION_FLAG, NULL, "one JSON object a line", &as_json, 0, 0}};
    int first;
    int status = parse_options(self, rows, 1, argc, argv, &first);
    if (status >= 0) return status;
    if (first == argc)
        return complain(self, EXIT_INPUT,
                        "name a benchmark: all, ecs, particles, flock, rigid, telemetry");
    for (int a = first; a < argc; a++) {
        bool known = false;
        for (size_t i = 0; i < sizeof benches / sizeof benches[0]; i++) {
            if (strcmp(argv[a], "all") != 0 && strcmp(argv[a], benches[i].name) != 0) continue;
            known = true;
            present = benches[i].name;
            if (benches[i].run(emit) != 0)
                return complain(self, EXIT_LOST, "%s could not be measured", present);
        }
        if (!known) return complain(self, EXIT_INPUT, "unknown benchmark \"%s\"", argv[a]);
    }
    return EXIT_DONE;
}

const command command_bench = {
    .name = "bench",
    .summary = "time the kernels beside their peers",
    .usage = "all | ecs | particles | flock | rigid | telemetry ... [--json]",
    .details = "Figures are medians of several interleaved repeats in this run; ratio = ours / "
               "peer, smaller is better for times.",
    .example = "jostle bench particles --json",
    .run = run,
};
