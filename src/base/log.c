/* SPDX-License-Identifier: MIT
 * log.c - one formatted line to the host's logger.
 */
#include "base/base.h"

#include <stdio.h>

#define LINE 512

static void write_line(const jsl_logger *logger, jsl_log_level level, jsl_result code,
                       const char *format, va_list args) {
    if (!logger || !logger->write) return;
    char line[LINE];
    int length = vsnprintf(line, sizeof line, format, args);
    if (length < 0) memcpy(line, "(message could not be formatted)", 33);
    if (length >= LINE) memcpy(line + LINE - 4, "...", 4);
    /* Names in messages come from files: they must not forge further lines or steer a terminal. */
    for (char *c = line; *c; c++)
        if ((unsigned char)*c < 32 || *c == 127) *c = ' ';
    logger->write(level, code, line, logger->ctx);
}

jsl_result jsl_fail(const jsl_logger *logger, jsl_result code, const char *format, ...) {
    va_list args;
    va_start(args, format);
    write_line(logger, JSL_LOG_ERROR, code, format, args);
    va_end(args);
    return code;
}

void jsl_log_line(const jsl_logger *logger, jsl_log_level level, jsl_result code,
                  const char *format, ...) {
    va_list args;
    va_start(args, format);
    write_line(logger, level, code, format, args);
    va_end(args);
}
