/* SPDX-License-Identifier: MIT
 * What the subcommands of `jostle` share: options, progress, messages, exit statuses. Floor 7.
 */
#ifndef JOSTLE_CLI_H
#define JOSTLE_CLI_H

#include <jostle/world.h>

#include <stdbool.h>
#include <stdio.h>

enum { EXIT_DONE = 0, EXIT_LOST = 1, EXIT_INPUT = 2 };

typedef enum option_kind {
    OPTION_FLAG, /* bool */
    OPTION_TEXT, /* const char * */
    OPTION_REAL, /* double, finite */
    OPTION_INT,  /* int64_t */
    OPTION_MANY  /* text_list: may be given again */
} option_kind;

typedef struct text_list {
    const char **at;
    int count;
} text_list;

typedef struct option_row {
    const char *name; /* without dashes */
    char letter;      /* 0: none */
    option_kind kind;
    const char *argument; /* its name in the help; null for flags */
    const char *help;
    void *target;
    double lo, hi; /* inclusive range of numbers; both 0: any */
} option_row;

typedef struct command {
    const char *name;
    const char *summary; /* one line */
    const char *usage;   /* after "jostle NAME " */
    const char *details; /* paragraphs after the options; may be null */
    const char *example;
    int (*run)(const struct command *self, int argc, char **argv);
} command;

/* Parses argv[1..]; *first is the index of the first positional argument (options may follow it:
 * argv is permuted). Returns -1 to go on, or an exit status (0 after --help, 2 after an error that
 * was told). */
int parse_options(const command *self, const option_row *rows, int count, int argc, char **argv,
                  int *first);
/* One line "jostle NAME: ..." on stderr; returns status. */
int complain(const command *self, int status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Prints errors and warnings on stderr, each as one line. */
jsl_logger stderr_logger(void);

/* Set by SIGINT and SIGTERM after catch_signals: finish the present piece of work, close files,
 * leave. */
extern volatile int stop_requested;
void catch_signals(void);

/* A bar on stderr when it is a terminal and the work takes longer than a second. */
typedef struct progress {
    double start, last;
    bool on, shown;
} progress;
progress progress_start(bool quiet);
void progress_show(progress *p, double done, double total, const char *unit);
void progress_end(progress *p);

double wall_seconds(void);
/* Both names lead to one existing file; null names do not. */
bool same_file(const char *a, const char *b);
/* "12.3 MB" in a static-free way: writes into text. */
const char *human_bytes(double bytes, char *text, size_t size);

extern const command command_run, command_explain, command_log, command_play, command_render, command_bench,
    command_schema;

#endif
