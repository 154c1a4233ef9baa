/* SPDX-License-Identifier: MIT
 * jostle play: republish a log over LCM.
 */
#include "cli.h"

#include <jostle/telemetry.h>

static void show(double time, double end, void *arg) { progress_show(arg, time, end, "s"); }

static int run(const command *self, int argc, char **argv) {
    const char *url = NULL;
    double speed = 1;
    bool quiet = false;
    const option_row rows[] = {
        {"lcm", 0, OPTION_TEXT, "URL", "where to publish (LCM's default, udpm on this machine)",
         &url, 0, 0},
        {"speed", 'x', OPTION_REAL, "X",
         "times the recorded speed in simulated time; 0: as fast as possible (1)", &speed, 0, 1e30},
        {"quiet", 'q', OPTION_FLAG, NULL, "no summary, no progress bar", &quiet, 0, 0},
    };
    int first;
    int status = parse_options(self, rows, sizeof rows / sizeof rows[0], argc, argv, &first);
    if (status >= 0) return status;
    if (argc - first != 1)
        return complain(self, EXIT_INPUT, "name one log file; see jostle play --help");
    jsl_logger logger = stderr_logger();
    jsl_log_file *log;
    if (jsl_log_open(argv[first], &logger, &log) != JSL_OK) return EXIT_INPUT;
    catch_signals();
    progress bar = progress_start(quiet);
    jsl_play_desc desc = {.lcm_url = url,
                          .speed = speed,
                          .stop = &stop_requested,
                          .progress = show,
                          .progress_arg = &bar,
                          .logger = logger};
    jsl_play_stats stats = {0};
    jsl_result result = jsl_log_play(log, &desc, &stats);
    progress_end(&bar);
    jsl_log_close(log);
    if (result == JSL_ERR_UNSUPPORTED || result == JSL_ERR_ARGUMENT) return EXIT_INPUT;
    if (stats.events == 0 && !stop_requested)
        return complain(self, EXIT_INPUT, "%s holds no LCM event", argv[first]);
    char text[32];
    if (!quiet)
        printf("played %lld events, %s in %.2f s%s\n", (long long)stats.events,
               human_bytes((double)stats.bytes, text, sizeof text), stats.seconds,
               stop_requested ? " (stopped)" : "");
    if (stats.errors)
        complain(self, EXIT_LOST, "%lld events could not be sent or read", (long long)stats.errors);
    return result != JSL_OK || stats.errors ? EXIT_LOST : EXIT_DONE;
}

const command command_play = {
    .name = "play",
    .summary = "republish a log over LCM",
    .usage = "FILE [--lcm URL] [--speed X]",
    .details = "Messages are republished byte for byte, paced by simulated time.\n"
               "Exit status: 0 done, 1 something was lost, 2 bad input.",
    .example = "jostle play showcase.lcmlog --lcm udpm://239.255.76.67:7667?ttl=0 --speed 2",
    .run = run,
};
