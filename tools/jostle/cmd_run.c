/* SPDX-License-Identifier: MIT
 * jostle run: simulate a scene, log or publish it, and say what happened.
 */
#include "cli.h"

#include <jostle/jostle.h>
#include <jostle/scene.h>
#include <jostle/telemetry.h>

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct run_options {
    double seconds, dt;
    int64_t seed, workers;
    const char *log, *lcm, *when_full;
    text_list set;
    bool quiet, json;
} run_options;

/* What is summed up at the end. */
typedef struct run_report {
    jsl_scene_info info;
    jsl_diagnostics first, last;
    double wall, max_penetration;
    jsl_publisher_stats published;
    bool publishing, lost;
    uint64_t hash;
} run_report;

/* -- Setting up
 * ------------------------------------------------------------------------------------------ */

static int apply_sets(const command *self, jsl_scene *scene, const run_options *o) {
    char text[64];
    for (int i = 0; i < o->set.count; i++)
        if (jsl_scene_set(scene, o->set.at[i]) != JSL_OK) return EXIT_INPUT;
    if (o->seed >= 0) {
        snprintf(text, sizeof text, "world.seed=%lld", (long long)o->seed);
        if (jsl_scene_set(scene, text) != JSL_OK) return EXIT_INPUT;
    }
    if (!isnan(o->dt)) {
        if (!(o->dt > 0)) return complain(self, EXIT_INPUT, "--dt %g: must be positive", o->dt);
        snprintf(text, sizeof text, "world.dt=%.17g", o->dt);
        if (jsl_scene_set(scene, text) != JSL_OK) return EXIT_INPUT;
    }
    return -1;
}

static void particle_look(void *arg, const jsl_rows *rows, uint32_t *rgba, float *size) {
    jsl_particle_appearance(arg, rows, rgba, size);
}

static int open_publisher(const run_options *o, jsl_scene *scene, jsl_world *world,
                          jsl_publisher **out) {
    *out = NULL;
    if (!o->log && !o->lcm) return -1;
    const jsl_scene_info *info = jsl_scene_get_info(scene);
    char *text = jsl_scene_text(scene);
    jsl_publisher_desc desc = {.log_path = o->log,
                               .lcm_url = o->lcm,
                               .scene_name = info->name,
                               .scene_text = text,
                               .scene_hash = info->hash,
                               .particles_hz = info->particles_hz,
                               .boids_hz = info->boids_hz,
                               .bodies_hz = info->bodies_hz,
                               .components = info->components,
                               .component_count = info->component_count,
                               .components_hz = info->components_hz,
                               .camera = info->camera,
                               .additive = info->additive,
                               .particle_look = particle_look,
                               .particle_look_arg = world,
                               .when_full = strcmp(o->when_full, "drop") == 0 ? JSL_FULL_DROP_FRAME
                                                                              : JSL_FULL_BLOCK,
                               .logger = stderr_logger()};
    jsl_result result = jsl_publisher_create(&desc, world, out);
    jsl_scene_free_text(text);
    return result == JSL_OK ? -1 : EXIT_INPUT;
}

/* -- Running
 * ---------------------------------------------------------------------------------------------- */

static jsl_result simulate(jsl_world *world, jsl_publisher *publisher, double seconds,
                           const run_options *o, run_report *report) {
    progress bar = progress_start(o->quiet || o->json);
    double start = wall_seconds();
    double dt = (double)jsl_world_settings(world)->dt;
    /* Whole steps: the last one may end up to half a step early or late. */
    int64_t steps = llround(seconds / dt);
    jsl_world_diagnostics(world, &report->first);
    jsl_result result = JSL_OK;
    for (int64_t i = 0; i < steps && result == JSL_OK && !stop_requested; i++) {
        jsl_warnings warnings;
        result = jsl_step(world, 0, &warnings);
        if (result == JSL_OK && publisher) result = jsl_publisher_step(publisher, &warnings);
        if (i % 8 == 7 || i + 1 == steps) {
            jsl_world_diagnostics(world, &report->last);
            report->max_penetration = fmax(report->max_penetration, report->last.max_penetration);
            progress_show(&bar, jsl_world_time(world), seconds, "s");
        }
    }
    jsl_world_diagnostics(world, &report->last);
    report->wall = wall_seconds() - start;
    progress_end(&bar);
    report->hash = jsl_world_hash(world);
    return result;
}

/* -- Reporting
 * ---------------------------------------------------------------------------------------------- */

static double relative(double change, double scale) { return scale > 0 ? change / scale : 0; }

static double distance3(const double *a, const double *b) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

static double drift3(const double *a, const double *b) {
    const double zero[3] = {0};
    return relative(distance3(a, b), fmax(distance3(a, zero), distance3(b, zero)));
}

static double energy(const jsl_diagnostics *d) { return d->kinetic_energy + d->potential_energy; }

static double energy_drift(const run_report *r) {
    return relative(energy(&r->last) - energy(&r->first),
                    fmax(fabs(energy(&r->first)), fabs(energy(&r->last))));
}

static json_t *json_of_report(jsl_world *world, const run_report *r, const run_options *o) {
    jsl_profile profile;
    jsl_world_profile(world, &profile);
    const jsl_world_desc *settings = jsl_world_settings(world);
    char hash[20];
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)r->hash);
    json_t *warnings = json_object(), *stages = json_object();
    for (int i = 0; i < JSL_WARN_COUNT; i++)
        if (r->last.warnings.count[i])
            json_object_set_new(warnings, jsl_warning_name((jsl_warning)i),
                                json_integer(r->last.warnings.count[i]));
    for (int i = 0; i < JSL_STAGE_COUNT; i++)
        if (profile.entered[i])
            json_object_set_new(stages, jsl_stage_text((jsl_stage)i),
                                json_real(1e3 * profile.seconds[i] / (double)profile.steps));
    double sim = jsl_world_time(world);
    json_t *out = json_pack(
        "{s:s s:I s:f s:f s:f s:i s:s s:s s:s s:{s:I s:I s:i s:I} s:s s:{s:f s:f s:f} s:f s:f s:f "
        "s:o s:o}",
        "scene", r->info.name, "steps", (json_int_t)jsl_world_step_count(world), "sim_seconds", sim,
        "wall_seconds", r->wall, "real_time_factor", r->wall > 0 ? sim / r->wall : 0.0, "workers",
        settings->workers, "isa", jsl_isa_text(settings->isa), "precision", JSL_PRECISION_TEXT,
        "fidelity", "realtime", "entities", "particles", (json_int_t)r->last.particles, "boids",
        (json_int_t)r->last.boids, "agents", 0, "bodies", (json_int_t)r->last.bodies, "state_hash",
        hash, "energy", "start", energy(&r->first), "end", energy(&r->last), "drift_rel",
        energy_drift(r), "momentum_drift_rel", drift3(r->first.momentum, r->last.momentum),
        "angular_momentum_drift_rel", drift3(r->first.angular_momentum, r->last.angular_momentum),
        "max_penetration_m", r->max_penetration, "warnings", warnings, "stages_ms", stages);
    if (out && r->publishing)
        json_object_set_new(out, "log",
                            json_pack("{s:s? s:I s:I s:I s:I s:I s:I}", "path", o->log, "bytes",
                                      (json_int_t)r->published.log_bytes, "events",
                                      (json_int_t)r->published.log_events, "frames_offered",
                                      (json_int_t)r->published.frames_offered, "frames_sent",
                                      (json_int_t)r->published.frames_sent, "frames_dropped",
                                      (json_int_t)r->published.frames_dropped, "frames_decimated",
                                      (json_int_t)r->published.frames_decimated));
    return out;
}

static void print_summary(jsl_world *world, const run_report *r, const run_options *o) {
    jsl_profile profile;
    jsl_world_profile(world, &profile);
    const jsl_world_desc *settings = jsl_world_settings(world);
    double sim = jsl_world_time(world);
    char text[32];
    printf("%s: %llu steps, %.3f s simulated in %.2f s: %.2f x real time (%d worker%s, %s, %s)\n",
           r->info.name, (unsigned long long)jsl_world_step_count(world), sim, r->wall,
           r->wall > 0 ? sim / r->wall : 0.0, settings->workers, settings->workers == 1 ? "" : "s",
           jsl_isa_text(settings->isa), JSL_PRECISION_TEXT);
    printf("entities     %lld particles, %lld boids, %lld moving bodies, %lld static\n",
           (long long)r->last.particles, (long long)r->last.boids, (long long)r->last.bodies,
           (long long)r->last.statics);
    printf("stages       ");
    double staged = 0;
    for (int i = 0; i < JSL_STAGE_COUNT; i++)
        if (profile.entered[i]) {
            printf("%s %.3f  ", jsl_stage_text((jsl_stage)i),
                   1e3 * profile.seconds[i] / (double)profile.steps);
            staged += profile.seconds[i];
        }
    printf("other %.3f  ms a step\n",
           profile.steps ? 1e3 * (profile.total - staged) / (double)profile.steps : 0.0);
    if (r->last.bodies) {
        printf(
            "bodies       energy %.4g -> %.4g J (%+.2e), momentum changed by %.2e, angular %.2e\n",
            energy(&r->first), energy(&r->last), energy_drift(r),
            drift3(r->first.momentum, r->last.momentum),
            drift3(r->first.angular_momentum, r->last.angular_momentum));
        printf("contacts     %lld now, largest penetration %.2f mm\n", (long long)r->last.contacts,
               1e3 * r->max_penetration);
    }
    printf("warnings     ");
    bool any = false;
    for (int i = 0; i < JSL_WARN_COUNT; i++)
        if (r->last.warnings.count[i]) {
            printf("%s %lld (first: entity %u)  ", jsl_warning_name((jsl_warning)i),
                   (long long)r->last.warnings.count[i], r->last.warnings.first[i].index);
            any = true;
        }
    printf("%s\n", any ? "" : "none");
    printf("memory       %s, state hash %016llx\n",
           human_bytes((double)profile.memory_peak_bytes, text, sizeof text),
           (unsigned long long)r->hash);
    if (r->publishing)
        printf("telemetry    %s%s, %lld events, frames: %lld offered, %lld sent, %lld dropped, "
               "%lld decimated, %lld errors%s%s\n",
               human_bytes((double)r->published.log_bytes, text, sizeof text),
               o->log ? " logged" : "", (long long)r->published.log_events,
               (long long)r->published.frames_offered, (long long)r->published.frames_sent,
               (long long)r->published.frames_dropped, (long long)r->published.frames_decimated,
               (long long)r->published.send_errors, o->log ? " -> " : "", o->log ? o->log : "");
}

/* -- The command
 * -----------------------------------------------------------------------------------------------
 */

static int run_scene(const command *self, jsl_scene *scene, const run_options *o) {
    int status = apply_sets(self, scene, o);
    if (status >= 0) return status;
    jsl_world *world;
    jsl_scene_options options = {.workers = (int)o->workers, .logger = stderr_logger()};
    if (jsl_scene_build(scene, &options, &world) != JSL_OK) return EXIT_INPUT;
    run_report report = {.info = *jsl_scene_get_info(scene)};
    double seconds = !isnan(o->seconds)        ? o->seconds
                     : report.info.seconds > 0 ? report.info.seconds
                                               : 10;
    jsl_publisher *publisher;
    status = open_publisher(o, scene, world, &publisher);
    if (status >= 0) {
        jsl_world_destroy(world);
        return status;
    }
    catch_signals();
    jsl_result result = simulate(world, publisher, seconds, o, &report);
    status = result == JSL_OK ? EXIT_DONE : EXIT_LOST;
    if (report.last.warnings.count[JSL_WARN_OUT_OF_MEMORY])
        status = complain(self, EXIT_LOST, "memory ran out: births or other work were lost");
    if (publisher) {
        report.publishing = true;
        result = jsl_publisher_close(publisher, &report.published);
        if (result != JSL_OK || report.published.frames_dropped || report.published.send_errors) {
            status = EXIT_LOST;
            complain(self, status, "%lld frames dropped, %lld send errors, %lld log errors",
                     (long long)report.published.frames_dropped,
                     (long long)report.published.send_errors,
                     (long long)report.published.log_errors);
        }
    }
    if (o->json) {
        json_t *json = json_of_report(world, &report, o);
        char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(12)) : NULL;
        if (text) puts(text);
        free(text);
        json_decref(json);
    } else if (!o->quiet) {
        print_summary(world, &report, o);
    }
    jsl_world_destroy(world);
    return status;
}

static int run(const command *self, int argc, char **argv) {
    run_options o = {.seconds = NAN, .dt = NAN, .seed = -1, .workers = 0, .when_full = "block"};
    const option_row rows[] = {
        {"seconds", 's', OPTION_REAL, "T", "simulated seconds (the scene's, or 10)", &o.seconds, 0,
         1e30},
        {"dt", 0, OPTION_REAL, "DT", "step in seconds, such as 1/120", &o.dt, 0, 0},
        {"seed", 0, OPTION_INT, "N", "random seed", &o.seed, 0, 9e18},
        {"workers", 'w', OPTION_INT, "N", "threads; results never depend on it (1)", &o.workers, 1,
         64},
        {"set", 0, OPTION_MANY, "KEY=VALUE",
         "change a value of the scene, such as world.substeps=8", &o.set, 0, 0},
        {"log", 'l', OPTION_TEXT, "FILE", "write an LCM event log", &o.log, 0, 0},
        {"lcm", 0, OPTION_TEXT, "URL",
         "publish live, such as udpm://239.255.76.67:7667?ttl=0 or memq://", &o.lcm, 0, 0},
        {"when-full", 0, OPTION_TEXT, "block|drop",
         "when the disk or network is slower than the simulation (block)", &o.when_full, 0, 0},
        {"quiet", 'q', OPTION_FLAG, NULL, "no summary, no progress bar", &o.quiet, 0, 0},
        {"json", 0, OPTION_FLAG, NULL, "print the summary as one JSON object", &o.json, 0, 0},
    };
    int first;
    int status = parse_options(self, rows, sizeof rows / sizeof rows[0], argc, argv, &first);
    if (status >= 0) return status;
    if (argc - first != 1)
        return complain(self, EXIT_INPUT, "name one scene file; see jostle run --help");
    if (same_file(argv[first], o.log))
        return complain(self, EXIT_INPUT, "--log %s: would replace the scene", o.log);
    if (strcmp(o.when_full, "block") != 0 && strcmp(o.when_full, "drop") != 0)
        return complain(self, EXIT_INPUT, "--when-full %s: must be block or drop", o.when_full);
    jsl_logger logger = stderr_logger();
    jsl_scene *scene;
    if (jsl_scene_load(argv[first], &logger, &scene) != JSL_OK) return EXIT_INPUT;
    status = run_scene(self, scene, &o);
    jsl_scene_free(scene);
    free(o.set.at);
    return status;
}

const command command_run = {
    .name = "run",
    .summary = "simulate a scene; log it, publish it, sum it up",
    .usage = "SCENE.json [options]",
    .details = "Ctrl-C ends the run properly: the log is closed and the summary printed.\n"
               "Exit status: 0 done, 1 something was lost or failed, 2 bad input.",
    .example = "jostle run tools/scenes/showcase.json --seconds 2 --log showcase.lcmlog",
    .run = run,
};
