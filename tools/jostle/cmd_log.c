/* SPDX-License-Identifier: MIT
 * jostle log: what is in an LCM event log.
 */
#include "cli.h"

#include <jostle/telemetry.h>

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static void print_info(const char *path, const jsl_log_info *i) {
    char text[32];
    printf("%s: %s, %lld events, %s%s\n", path,
           human_bytes((double)i->file_bytes, text, sizeof text), (long long)i->events,
           i->closed ? "closed properly" : "not closed",
           i->truncated ? ", the last event is cut off" : "");
    printf("scene        %s (seed %llu, dt %.6g s)\n", i->scene[0] ? i->scene : "unknown",
           (unsigned long long)i->seed, i->dt);
    printf("build        %s\n", i->build[0] ? i->build : "unknown");
    printf("simulated    %.3f .. %.3f s, steps %lld .. %lld, %lld session%s\n", i->first_time,
           i->last_time, (long long)i->first_step, (long long)i->last_step, (long long)i->sessions,
           i->sessions == 1 ? "" : "s");
    printf("wall clock   %.3f s\n", 1e-6 * (double)(i->last_us - i->first_us));
    printf("frames       %lld particle, %lld boid, %lld body; %lld incomplete; %lld keyframes\n",
           (long long)i->particle_frames, (long long)i->boid_frames, (long long)i->body_frames,
           (long long)i->incomplete_frames, (long long)i->keyframes);
    printf("writer       %lld frames offered, %lld dropped\n", (long long)i->frames_offered,
           (long long)i->frames_dropped);
    if (i->holes)
        printf("damage       %lld holes, %lld bytes skipped\n", (long long)i->holes,
               (long long)i->hole_bytes);
    printf("channels\n");
    for (int c = 0; c < i->channel_count; c++)
        printf("  %-24s %10lld events  %10s\n", i->channel[c].name, (long long)i->channel[c].events,
               human_bytes((double)i->channel[c].bytes, text, sizeof text));
}

static void print_json(const char *path, const jsl_log_info *i) {
    json_t *channels = json_array();
    for (int c = 0; c < i->channel_count; c++)
        json_array_append_new(channels, json_pack("{s:s s:I s:I}", "name", i->channel[c].name,
                                                  "events", (json_int_t)i->channel[c].events,
                                                  "bytes", (json_int_t)i->channel[c].bytes));
    json_t *out = json_pack(
        "{s:s s:I s:I s:b s:b s:I s:I s:s s:s s:I s:f s:f s:f s:I s:I s:I s:I s:I s:I s:I s:I s:I "
        "s:I s:o}",
        "path", path, "bytes", (json_int_t)i->file_bytes, "events", (json_int_t)i->events, "closed",
        i->closed, "truncated", i->truncated, "holes", (json_int_t)i->holes, "hole_bytes",
        (json_int_t)i->hole_bytes, "scene", i->scene, "build", i->build, "seed",
        (json_int_t)i->seed, "dt", i->dt, "first_time", i->first_time, "last_time", i->last_time,
        "first_step", (json_int_t)i->first_step, "last_step", (json_int_t)i->last_step, "sessions",
        (json_int_t)i->sessions, "particle_frames", (json_int_t)i->particle_frames, "boid_frames",
        (json_int_t)i->boid_frames, "body_frames", (json_int_t)i->body_frames, "incomplete_frames",
        (json_int_t)i->incomplete_frames, "keyframes", (json_int_t)i->keyframes, "frames_offered",
        (json_int_t)i->frames_offered, "frames_dropped", (json_int_t)i->frames_dropped, "channels",
        channels);
    char *text = out ? json_dumps(out, JSON_COMPACT | JSON_REAL_PRECISION(12)) : NULL;
    if (text) puts(text);
    free(text);
    json_decref(out);
}

static int run(const command *self, int argc, char **argv) {
    bool json = false;
    const option_row rows[] = {
        {"json", 0, OPTION_FLAG, NULL, "print one JSON object", &json, 0, 0}};
    int first;
    int status = parse_options(self, rows, 1, argc, argv, &first);
    if (status >= 0) return status;
    if (argc - first != 2 || strcmp(argv[first], "info") != 0)
        return complain(self, EXIT_INPUT, "usage: jostle log info FILE");
    jsl_logger logger = stderr_logger();
    jsl_log_file *log;
    const char *path = argv[first + 1];
    if (jsl_log_open(path, &logger, &log) != JSL_OK) return EXIT_INPUT;
    static jsl_log_info info;
    jsl_result result = jsl_log_get_info(log, &info);
    if (result == JSL_OK) {
        if (json)
            print_json(path, &info);
        else
            print_info(path, &info);
    }
    jsl_log_close(log);
    if (result != JSL_OK) return EXIT_LOST;
    if (info.events == 0) return complain(self, EXIT_INPUT, "%s holds no LCM event", path);
    return info.holes || info.truncated ? EXIT_LOST : EXIT_DONE;
}

const command command_log = {
    .name = "log",
    .summary = "tell what is in an LCM event log",
    .usage = "info FILE [--json]",
    .details = "Exit status: 0 sound, 1 damaged but readable, 2 not a log.",
    .example = "jostle log info showcase.lcmlog",
    .run = run,
};
