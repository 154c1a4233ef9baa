/* SPDX-License-Identifier: MIT
 * What the subcommands of `jostle` share.
 */
#include "cli.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define MAX_OPTIONS 48

int complain(const command *self, int status, const char *format, ...) {
    va_list args;
    fprintf(stderr, "jostle %s: ", self->name);
    va_start(args, format);
    vfprintf(stderr, format, args);
    va_end(args);
    fputc('\n', stderr);
    return status;
}

static void write_line(jsl_log_level level, jsl_result code, const char *text, void *ctx) {
    (void)code;
    (void)ctx;
    if (level <= JSL_LOG_WARNING) fprintf(stderr, "jostle: %s\n", text);
}

jsl_logger stderr_logger(void) { return (jsl_logger){write_line, NULL}; }

/* -- Options
 * ------------------------------------------------------------------------------------------- */

static void print_help(const command *self, const option_row *rows, int count) {
    printf("jostle %s - %s\n\nusage: jostle %s %s\n\noptions:\n", self->name, self->summary,
           self->name, self->usage);
    for (int i = 0; i < count; i++) {
        char left[64];
        snprintf(left, sizeof left, "%s%c%s--%s%s%s", rows[i].letter ? "-" : " ",
                 rows[i].letter ? rows[i].letter : ' ', rows[i].letter ? ", " : "  ", rows[i].name,
                 rows[i].argument ? " " : "", rows[i].argument ? rows[i].argument : "");
        printf("  %-28s %s\n", left, rows[i].help);
    }
    printf("  %-28s %s\n", "-h, --help", "this text");
    if (self->details) printf("\n%s\n", self->details);
    printf("\nexample:\n  %s\n", self->example);
}

static int bad_value(const command *self, const option_row *row, const char *value,
                     const char *why) {
    return complain(self, EXIT_INPUT, "--%s %s: %s", row->name, value, why);
}

static int store_number(const command *self, const option_row *row, const char *value) {
    char *end;
    errno = 0;
    if (row->kind == OPTION_INT) {
        long long n = strtoll(value, &end, 10);
        if (end == value || *end || errno)
            return bad_value(self, row, value, "must be a whole number");
        if ((row->lo != 0 || row->hi != 0) && ((double)n < row->lo || (double)n > row->hi)) {
            char why[80];
            snprintf(why, sizeof why, "must be from %g to %g", row->lo, row->hi);
            return bad_value(self, row, value, why);
        }
        *(int64_t *)row->target = n;
        return -1;
    }
    double x = strtod(value, &end);
    if (*end == '/' && end != value) { /* 1/60 */
        char *end2;
        double d = strtod(end + 1, &end2);
        if (end2 == end + 1 || d == 0) return bad_value(self, row, value, "must be a number");
        x /= d;
        end = end2;
    }
    if (end == value || *end) return bad_value(self, row, value, "must be a number");
    if (!isfinite(x)) return bad_value(self, row, value, "must be finite");
    if ((row->lo != 0 || row->hi != 0) && (x < row->lo || x > row->hi)) {
        char why[80];
        snprintf(why, sizeof why,
                 x < row->lo && row->hi >= 1e30 ? "must be at least %g" : "must be from %g to %g",
                 row->lo, row->hi);
        return bad_value(self, row, value, why);
    }
    *(double *)row->target = x;
    return -1;
}

static int store(const command *self, const option_row *row, const char *value) {
    switch (row->kind) {
    case OPTION_FLAG:
        *(bool *)row->target = true;
        return -1;
    case OPTION_TEXT:
        *(const char **)row->target = value;
        return -1;
    case OPTION_MANY: {
        text_list *list = row->target;
        const char **grown = realloc(list->at, (size_t)(list->count + 1) * sizeof *grown);
        if (!grown) return complain(self, EXIT_LOST, "out of memory");
        list->at = grown;
        list->at[list->count++] = value;
        return -1;
    }
    default:
        return store_number(self, row, value);
    }
}

int parse_options(const command *self, const option_row *rows, int count, int argc, char **argv,
                  int *first) {
    struct option longs[MAX_OPTIONS + 2];
    char letters[3 * MAX_OPTIONS + 8] = ":h";
    size_t n = strlen(letters);
    for (int i = 0; i < count; i++) {
        longs[i] = (struct option){rows[i].name, rows[i].argument ? required_argument : no_argument,
                                   NULL, 256 + i};
        if (rows[i].letter) letters[n++] = rows[i].letter;
        if (rows[i].letter && rows[i].argument) letters[n++] = ':';
    }
    letters[n] = 0;
    longs[count] = (struct option){"help", no_argument, NULL, 'h'};
    longs[count + 1] = (struct option){0};
    optind = 1;
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, letters, longs, NULL)) != -1;) {
        if (c == 'h') {
            print_help(self, rows, count);
            return EXIT_DONE;
        }
        if (c == '?' || c == ':')
            return complain(self, EXIT_INPUT, "%s %s; see jostle %s --help",
                            c == ':' ? "a value is missing after" : "unknown option",
                            argv[optind - 1], self->name);
        int i = c - 256;
        if (c < 256)
            for (i = 0; rows[i].letter != c;) i++;
        int status = store(self, &rows[i], optarg);
        if (status >= 0) return status;
    }
    *first = optind;
    return -1;
}

/* -- Signals
 * -----------------------------------------------------------------------------------------------
 */

volatile int stop_requested;

static void on_signal(int number) {
    (void)number;
    stop_requested = 1;
}

void catch_signals(void) {
    struct sigaction action = {.sa_handler = on_signal};
    sigemptyset(&action.sa_mask);
    action.sa_flags = (int)SA_RESETHAND; /* a second Ctrl-C ends at once */
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
}

/* -- Progress
 * ------------------------------------------------------------------------------------------------
 */

bool same_file(const char *a, const char *b) {
    struct stat x, y;
    return a && b && stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev &&
           x.st_ino == y.st_ino;
}

double wall_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

progress progress_start(bool quiet) {
    double now = wall_seconds();
    return (progress){.start = now, .last = now, .on = !quiet && isatty(STDERR_FILENO)};
}

void progress_show(progress *p, double done, double total, const char *unit) {
    if (!p->on) return;
    double now = wall_seconds();
    if (now - p->start < 1 || now - p->last < 0.1) return;
    p->last = now;
    p->shown = true;
    double part = total > 0 ? done / total : 0;
    if (part > 1) part = 1;
    char bar[41];
    for (int i = 0; i < 40; i++) bar[i] = i < (int)(part * 40) ? '#' : '.';
    bar[40] = 0;
    double left = part > 0 ? (now - p->start) * (1 - part) / part : 0;
    fprintf(stderr, "\r[%s] %5.1f%%  %.2f / %.2f %s  %.0f s left ", bar, part * 100, done, total,
            unit, left);
    fflush(stderr);
}

void progress_end(progress *p) {
    if (p->shown) fprintf(stderr, "\r\033[K");
}

const char *human_bytes(double bytes, char *text, size_t size) {
    static const char *const unit[] = {"B", "kB", "MB", "GB", "TB"};
    int i = 0;
    while (bytes >= 1000 && i < 4) {
        bytes /= 1000;
        i++;
    }
    snprintf(text, size, i ? "%.1f %s" : "%.0f %s", bytes, unit[i]);
    return text;
}
