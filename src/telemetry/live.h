/* SPDX-License-Identifier: MIT
 * The thread that sends a ring of events into an LCM network. Floor 6.
 */
#ifndef JSL_TELEMETRY_LIVE_H
#define JSL_TELEMETRY_LIVE_H

#include "telemetry/log_writer.h"

struct _lcm_t;

/* lcm_create with an explanation: JSL_ERR_UNSUPPORTED, and when the cause is a missing multicast
 * route the log line names the commands that make one. url may be null: LCM's default. */
jsl_result jsl_lcm_open(const char *url, const jsl_logger *logger, struct _lcm_t **out);

typedef struct jsl_live jsl_live;
jsl_result jsl_live_open(jsl_memory *memory, const jsl_logger *logger, const char *url,
                         jsl_ring *ring, jsl_live **out);
void jsl_live_counts(jsl_live *live, jsl_sink_counts *out);
void jsl_live_close(jsl_live *live, jsl_sink_counts *out);

#endif
