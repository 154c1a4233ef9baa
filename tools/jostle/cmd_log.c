/* SPDX-License-Identifier: MIT
 * jostle log: what is in an LCM event log, and its frames as tables.
 */
#include "cli.h"

#include <jostle/telemetry.h>

#include <jansson.h>
#include <math.h>
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
    printf("frames       %lld particle, %lld boid, %lld body, %lld component; %lld incomplete; "
           "%lld damaged; %lld keyframes\n",
           (long long)i->particle_frames, (long long)i->boid_frames, (long long)i->body_frames,
           (long long)i->component_frames, (long long)i->incomplete_frames,
           (long long)i->bad_frames, (long long)i->keyframes);
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
        "s:I s:I s:o}",
        "path", path, "bytes", (json_int_t)i->file_bytes, "events", (json_int_t)i->events, "closed",
        i->closed, "truncated", i->truncated, "holes", (json_int_t)i->holes, "hole_bytes",
        (json_int_t)i->hole_bytes, "scene", i->scene, "build", i->build, "seed",
        (json_int_t)i->seed, "dt", i->dt, "first_time", i->first_time, "last_time", i->last_time,
        "first_step", (json_int_t)i->first_step, "last_step", (json_int_t)i->last_step, "sessions",
        (json_int_t)i->sessions, "particle_frames", (json_int_t)i->particle_frames, "boid_frames",
        (json_int_t)i->boid_frames, "body_frames", (json_int_t)i->body_frames, "component_frames",
        (json_int_t)i->component_frames, "incomplete_frames", (json_int_t)i->incomplete_frames,
        "keyframes", (json_int_t)i->keyframes, "frames_offered", (json_int_t)i->frames_offered,
        "frames_dropped", (json_int_t)i->frames_dropped, "channels", channels);
    char *text = out ? json_dumps(out, JSON_COMPACT | JSON_REAL_PRECISION(12)) : NULL;
    if (text) puts(text);
    free(text);
    json_decref(out);
}

/* What options of the subcommands say. */
typedef struct log_options {
    bool json;
    const char *format, *channel, *output;
    double from, to;
    int64_t every;
} log_options;

static int run_info(const command *self, const char *path, jsl_log_file *log, bool json) {
    static jsl_log_info info;
    jsl_result result =
        jsl_log_verify(log, &info); /* every frame's bytes: damage must not pass as sound */
    if (result != JSL_OK && result != JSL_ERR_FORMAT) return EXIT_LOST;
    if (info.events == 0) return complain(self, EXIT_INPUT, "%s holds no LCM event", path);
    if (json)
        print_json(path, &info);
    else
        print_info(path, &info);
    return result != JSL_OK || info.holes || info.truncated ? EXIT_LOST : EXIT_DONE;
}

static int choose_format(const command *self, const log_options *o, jsl_export_format *out) {
    static const char *const names[] = {
#define JSL_X(code, text) text,
        JSL_EXPORT_FORMATS(JSL_X)
#undef JSL_X
    };
    const char *dot = strrchr(o->output, '.');
    const char *name = o->format ? o->format : dot ? dot + 1 : "";
    for (int i = 0; i < JSL_EXPORT_FORMAT_COUNT; i++)
        if (strcmp(name, names[i]) == 0) {
            *out = (jsl_export_format)i;
            return -1;
        }
    return complain(self, EXIT_INPUT, "%s%s: the format must be csv or npz",
                    o->format ? "--format " : "-o ", o->format ? o->format : o->output);
}

static int run_export(const command *self, const char *path, jsl_log_file *log,
                      const log_options *o) {
    jsl_export_desc desc = {.path = o->output,
                            .channel = o->channel,
                            .from = o->from,
                            .to = isnan(o->to) ? 0 : o->to,
                            .every = o->every,
                            .logger = stderr_logger()};
    if (!o->output) return complain(self, EXIT_INPUT, "export needs -o FILE");
    if (same_file(path, o->output))
        return complain(self, EXIT_INPUT, "-o %s: would replace the log", o->output);
    int status = choose_format(self, o, &desc.format);
    if (status >= 0) return status;
    if (!isnan(o->to) && (o->to < o->from || o->to == 0))
        return complain(self, EXIT_INPUT, "--to %g: must be positive and not before --from", o->to);
    jsl_export_stats stats;
    jsl_result result = jsl_log_export(log, &desc, &stats);
    if (result != JSL_OK) return result == JSL_ERR_IO ? EXIT_LOST : EXIT_INPUT;
    if (o->json)
        printf("{\"path\":\"%s\",\"frames\":%lld,\"rows\":%lld,\"lost\":%lld}\n", o->output,
               (long long)stats.frames, (long long)stats.rows, (long long)stats.lost);
    else
        printf("%s: %lld frames, %lld rows\n", o->output, (long long)stats.frames,
               (long long)stats.rows);
    if (stats.lost)
        return complain(self, EXIT_LOST, "%lld frames of %s are damaged and were passed over",
                        (long long)stats.lost, path);
    return EXIT_DONE;
}

static int run(const command *self, int argc, char **argv) {
    log_options o = {.to = NAN, .every = 1};
    const option_row rows[] = {
        {"json", 0, OPTION_FLAG, NULL, "print one JSON object", &o.json, 0, 0},
        {"output", 'o', OPTION_TEXT, "FILE", "export: the file to write", &o.output, 0, 0},
        {"format", 0, OPTION_TEXT, "csv|npz", "export: (as the name of FILE ends)", &o.format, 0,
         0},
        {"channel", 0, OPTION_TEXT, "NAME",
         "export: particles, boids, bodies or a component (the only one)", &o.channel, 0, 0},
        {"from", 0, OPTION_REAL, "T", "export: simulated seconds (0)", &o.from, 0, 1e30},
        {"to", 0, OPTION_REAL, "T", "export: simulated seconds, included (the end)", &o.to, 0,
         1e30},
        {"every", 0, OPTION_INT, "N", "export: every N-th frame of these (1)", &o.every, 1, 1e9},
    };
    int first;
    int status = parse_options(self, rows, sizeof rows / sizeof rows[0], argc, argv, &first);
    if (status >= 0) return status;
    bool info = argc - first == 2 && strcmp(argv[first], "info") == 0;
    if (!info && (argc - first != 2 || strcmp(argv[first], "export") != 0))
        return complain(self, EXIT_INPUT, "usage: jostle log info|export FILE [options]");
    jsl_logger logger = stderr_logger();
    jsl_log_file *log;
    const char *path = argv[first + 1];
    if (jsl_log_open(path, &logger, &log) != JSL_OK) return EXIT_INPUT;
    status = info ? run_info(self, path, log, o.json) : run_export(self, path, log, &o);
    jsl_log_close(log);
    return status;
}

const command command_log = {
    .name = "log",
    .summary = "tell what is in an LCM event log, or export its frames",
    .usage = "info FILE [--json]\n       jostle log export FILE -o TABLE.csv|TABLE.npz [options]",
    .details =
        "info: exit status 0 sound, 1 damaged but readable, 2 not a log.\n"
        "export: a table of step, time, id and every field. Exit status 0 done, 1 the log is\n"
        "damaged or the table could not be written, 2 no such channel or bad usage.",
    .example = "jostle log export showcase.lcmlog --channel bodies --from 1 --to 2 -o bodies.npz",
    .run = run,
};
