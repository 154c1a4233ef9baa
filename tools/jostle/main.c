/* SPDX-License-Identifier: MIT
 * jostle: simulate scenes, log them over LCM, play them back, draw them.
 */
#include "cli.h"

#include <string.h>

static const command *const commands[] = {&command_run,   &command_explain, &command_log,
                                          &command_play,  &command_render,  &command_bench,
                                          &command_schema};
#define COMMANDS ((int)(sizeof commands / sizeof commands[0]))

static void usage(FILE *out) {
    fprintf(out,
            "jostle %s (%s): animates particles, flocks and rigid bodies\n\nusage: jostle COMMAND "
            "[...]\n\n",
            jsl_version(), JSL_PRECISION_TEXT);
    for (int i = 0; i < COMMANDS; i++)
        fprintf(out, "  %-8s %s\n", commands[i]->name, commands[i]->summary);
    fprintf(out, "\njostle COMMAND --help tells more, with an example. jostle --version prints the "
                 "version.\n");
}

int main(int argc, char **argv) {
    if (argc < 2) {
        usage(stderr);
        return EXIT_INPUT;
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("jostle %s (%s)\n", jsl_version(), JSL_PRECISION_TEXT);
        return EXIT_DONE;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 ||
        strcmp(argv[1], "help") == 0) {
        usage(stdout);
        return EXIT_DONE;
    }
    for (int i = 0; i < COMMANDS; i++)
        if (strcmp(argv[1], commands[i]->name) == 0)
            return commands[i]->run(commands[i], argc - 1, argv + 1);
    fprintf(stderr, "jostle: unknown command \"%s\"; jostle --help lists them\n", argv[1]);
    return EXIT_INPUT;
}
