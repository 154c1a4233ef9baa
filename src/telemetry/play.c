/* SPDX-License-Identifier: MIT
 * play.c - a log sent again, event by event, in the time of the simulation.
 */
#include "telemetry/live.h"
#include "telemetry/log_file.h"

#include <lcm/lcm.h>
#include <stdio.h>
#include <time.h>

typedef struct player {
    const jsl_play_desc *desc;
    bool started;
    double wall0, sim0; /* s: where the clocks were put in step */
    double sim;         /* s, of the last stamped event */
    double end;
    double told;
} player;

static bool stopped(const player *p) { return p->desc->stop && *p->desc->stop; }

static void wait_until(const player *p, double wall) {
    for (double left; !stopped(p) && (left = wall - jsl_seconds()) > 0;) {
        if (left > 0.05) left = 0.05; /* so that stop is seen */
        struct timespec t = {0, (long)(left * 1e9)};
        nanosleep(&t, NULL);
    }
}

/* Waits until it is the event's turn. Events of other programs go with the last of ours. */
static void wait_turn(player *p, const jsl_log_event *e) {
    if (e->size < JSL_STAMP_END || jsl_lcm_type_of(e->data, e->size) == JSL_LCM_COUNT) return;
    double sim = (double)(int64_t)jsl_get_u64(e->data + JSL_AT_SIM_NS) * 1e-9;
    if (!p->started || sim < p->sim) { /* the first, or another session */
        p->started = true;
        p->sim0 = sim;
        p->wall0 = jsl_seconds();
    }
    p->sim = sim;
    if (p->desc->speed > 0) wait_until(p, p->wall0 + (sim - p->sim0) / p->desc->speed);
    double now = jsl_seconds();
    if (p->desc->progress && now - p->told >= 0.1) {
        p->told = now;
        p->desc->progress(sim, p->end, p->desc->progress_arg);
    }
}

/* The simulated time of the last stamped event, found without reading the log through. */
static double end_time(jsl_log_file *log) {
    double end = 0.0;
    int64_t n;
    if (jsl_log_count_frames(log, &n) == JSL_OK && n > 0)
        end = (double)log->instant.at[n - 1].sim_ns * 1e-9;
    return end;
}

static bool send_event(lcm_t *lcm, const jsl_log_event *e) {
    char channel[1000];
    memcpy(channel, e->channel, (size_t)e->channel_size);
    channel[e->channel_size] = 0;
    return e->size <= UINT32_MAX && lcm_publish(lcm, channel, e->data, (unsigned int)e->size) == 0;
}

jsl_result jsl_log_play(jsl_log_file *log, const jsl_play_desc *desc, jsl_play_stats *out) {
    jsl_play_stats stats = {0};
    if (out) *out = stats;
    if (!log || !desc || !(desc->speed >= 0)) return JSL_ERR_ARGUMENT;
    lcm_t *lcm;
    JSL_TRY(jsl_lcm_open(desc->lcm_url, &desc->logger, &lcm));
    player p = {.desc = desc, .end = end_time(log)};
    double begin = jsl_seconds();
    jsl_log_event e;
    jsl_log_rewind(log);
    while (!stopped(&p) && jsl_log_next(log, &e) != JSL_ERR_END) {
        wait_turn(&p, &e);
        if (stopped(&p)) break;
        if (send_event(lcm, &e)) {
            stats.events++;
            stats.bytes += e.size;
        } else {
            stats.errors++;
        }
    }
    lcm_destroy(lcm);
    stats.seconds = jsl_seconds() - begin;
    if (desc->progress) desc->progress(p.sim, p.end, desc->progress_arg);
    if (out) *out = stats;
    if (stats.errors)
        return jsl_fail(&desc->logger, JSL_ERR_IO, "LCM: %lld events could not be sent",
                        (long long)stats.errors);
    return JSL_OK;
}
