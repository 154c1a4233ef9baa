/* SPDX-License-Identifier: MIT
 * jostle render: a log as pictures, a video, or a contact sheet. Workers each read the log and draw
 * every n-th picture; the main thread writes them in order.
 */
#include "cli.h"

#include <jostle/render.h>
#include <jostle/telemetry.h>

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define MAX_DRAWERS 16
#define SHEET_PICTURES 12

typedef struct render_job {
    const char *path, *out, *sheet;
    double fps, from, to;
    int64_t width, height, drawers;
    int64_t count; /* pictures */
    double first_time;
} render_job;

/* One worker and the one picture it has ready. */
typedef struct drawer {
    const render_job *job;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t turn;
    int index;
    bool full, failed, quit;
    uint8_t *pixels;
} drawer;

/* -- Drawing
 * ------------------------------------------------------------------------------------------------
 */

/* Hands one picture over and waits until it has been taken. False when the main thread wants no
 * more. */
static bool hand_over(drawer *d, const uint8_t *pixels) {
    pthread_mutex_lock(&d->lock);
    while (d->full && !d->quit) pthread_cond_wait(&d->turn, &d->lock);
    bool wanted = !d->quit;
    if (wanted) {
        memcpy(d->pixels, pixels, (size_t)(3 * d->job->width * d->job->height));
        d->full = true;
        pthread_cond_broadcast(&d->turn);
    }
    pthread_mutex_unlock(&d->lock);
    return wanted;
}

static bool draw_all(drawer *d, jsl_log_file *log, jsl_renderer *renderer) {
    const render_job *job = d->job;
    jsl_frame frame;
    for (int64_t i = d->index; i < job->count; i += job->drawers) {
        /* The last instant at or before the picture's time, with a little slack for dt's rounding.
         */
        double time = job->first_time + (double)i / job->fps + 1e-4;
        if (jsl_log_seek_time(log, time) != JSL_OK || jsl_log_next_frame(log, &frame) != JSL_OK)
            return false;
        const uint8_t *pixels;
        if (jsl_renderer_draw(renderer, &frame, &pixels) != JSL_OK) return false;
        if (!hand_over(d, pixels)) return true;
    }
    return true;
}

static void *drawer_main(void *arg) {
    drawer *d = arg;
    jsl_logger logger = stderr_logger();
    jsl_log_file *log = NULL;
    jsl_renderer *renderer = NULL;
    jsl_render_desc desc = {
        .width = (int)d->job->width, .height = (int)d->job->height, .logger = logger};
    bool good = jsl_log_open(d->job->path, &logger, &log) == JSL_OK &&
                jsl_renderer_create(&desc, &renderer) == JSL_OK && draw_all(d, log, renderer);
    jsl_renderer_destroy(renderer);
    jsl_log_close(log);
    pthread_mutex_lock(&d->lock);
    d->failed = !good;
    pthread_cond_broadcast(&d->turn);
    pthread_mutex_unlock(&d->lock);
    return NULL;
}

/* -- Writing
 * ------------------------------------------------------------------------------------------------
 */

static bool ends_with(const char *text, const char *tail) {
    size_t n = strlen(text), m = strlen(tail);
    return n >= m && strcmp(text + n - m, tail) == 0;
}

static bool is_video(const char *out) {
    return ends_with(out, ".mp4") || ends_with(out, ".webm") || ends_with(out, ".gif") ||
           ends_with(out, ".mkv");
}

/* Exactly one %d or %0Nd, so that the pattern is safe to hand to printf. */
static bool is_pattern(const char *out) {
    const char *p = strchr(out, '%');
    if (!p || !ends_with(out, ".png")) return false;
    const char *q = p + 1;
    while (*q >= '0' && *q <= '9' && q - p < 4) q++;
    return *q == 'd' && !strchr(q, '%');
}

/* Starts ffmpeg with a pipe as its input; no shell is involved, so any file name will do. */
static FILE *start_ffmpeg(const render_job *job, const char *out, pid_t *pid) {
    char size[32], rate[32];
    snprintf(size, sizeof size, "%lldx%lld", (long long)job->width, (long long)job->height);
    snprintf(rate, sizeof rate, "%g", job->fps);
    int ends[2];
    if (pipe(ends) != 0) return NULL;
    *pid = fork();
    if (*pid == 0) {
        dup2(ends[0], STDIN_FILENO);
        close(ends[0]);
        close(ends[1]);
        if (ends_with(job->out, ".mp4") || ends_with(job->out, ".mkv"))
            execlp("ffmpeg", "ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo",
                   "-pixel_format", "rgb24", "-video_size", size, "-framerate", rate, "-i", "-",
                   "-pix_fmt", "yuv420p", "-crf", "20", "-preset", "fast", "-movflags",
                   "+faststart", out, (char *)NULL);
        else
            execlp("ffmpeg", "ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo",
                   "-pixel_format", "rgb24", "-video_size", size, "-framerate", rate, "-i", "-",
                   out, (char *)NULL);
        fprintf(stderr, "jostle render: ffmpeg is not installed; install it, or write pictures "
                        "with -o 'frame_%%05d.png'\n");
        _exit(127);
    }
    close(ends[0]);
    if (*pid < 0) {
        close(ends[1]);
        return NULL;
    }
    return fdopen(ends[1], "wb");
}

typedef struct picture_sink {
    const render_job *job;
    FILE *video;
    char part[4096]; /* the video's name until it is whole; its ending tells ffmpeg the format */
    pid_t ffmpeg;
    jsl_image_sheet shape; /* of the contact sheet */
    uint8_t *sheet;        /* null: none is wanted */
    int width, height, kept;
} picture_sink;

static bool start_sheet(picture_sink *s) {
    const render_job *job = s->job;
    if (!job->sheet) return true;
    int count = job->count < SHEET_PICTURES ? (int)job->count : SHEET_PICTURES;
    s->shape = (jsl_image_sheet){.count = count,
                                 .columns = 3,
                                 .width = (int)job->width,
                                 .height = (int)job->height,
                                 .scale_down = 3};
    if (jsl_image_sheet_size(&s->shape, &s->width, &s->height) != JSL_OK) return false;
    s->sheet = calloc((size_t)s->width * (size_t)s->height, 3);
    return s->sheet != NULL;
}

static bool take_picture(picture_sink *s, int64_t i, const uint8_t *pixels) {
    const render_job *job = s->job;
    size_t bytes = (size_t)(3 * job->width * job->height);
    jsl_logger logger = stderr_logger();
    int last = s->shape.count - 1;
    /* The sheet's pictures are spread evenly from the first to the last. */
    if (s->sheet && s->kept <= last && i >= (last ? s->kept * (job->count - 1) / last : 0))
        if (jsl_image_sheet_put(&s->shape, s->kept++, pixels, s->sheet) != JSL_OK) return false;
    if (s->video) return fwrite(pixels, 1, bytes, s->video) == bytes;
    if (!job->out) return true;
    char name[4096];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(name, sizeof name, job->out, (int)i);
#pragma GCC diagnostic pop
    return jsl_image_write_png(name, pixels, (int)job->width, (int)job->height, &logger) == JSL_OK;
}

static bool finish(picture_sink *s, bool good) {
    jsl_logger logger = stderr_logger();
    if (s->video) {
        good = fclose(s->video) == 0 && good;
        int code = 0;
        waitpid(s->ffmpeg, &code, 0);
        good = WIFEXITED(code) && WEXITSTATUS(code) == 0 && good;
        if (good) good = rename(s->part, s->job->out) == 0;
        if (!good) unlink(s->part);
    }
    if (s->sheet && good)
        good = jsl_image_write_png(s->job->sheet, s->sheet, s->width, s->height, &logger) == JSL_OK;
    free(s->sheet);
    return good;
}

/* -- The command
 * --------------------------------------------------------------------------------------------------
 */

static bool start_drawers(drawer *d, const render_job *job) {
    for (int i = 0; i < job->drawers; i++) {
        d[i] = (drawer){.job = job, .index = i};
        d[i].pixels = malloc((size_t)(3 * job->width * job->height));
        pthread_mutex_init(&d[i].lock, NULL);
        pthread_cond_init(&d[i].turn, NULL);
        if (!d[i].pixels || pthread_create(&d[i].thread, NULL, drawer_main, &d[i]) != 0)
            d[i].failed = true;
    }
    return true;
}

static bool collect(drawer *all, picture_sink *sink, progress *bar) {
    const render_job *job = sink->job;
    for (int64_t i = 0; i < job->count && !stop_requested; i++) {
        drawer *d = &all[i % job->drawers];
        pthread_mutex_lock(&d->lock);
        while (!d->full && !d->failed) pthread_cond_wait(&d->turn, &d->lock);
        bool have = d->full;
        pthread_mutex_unlock(&d->lock);
        if (!have || !take_picture(sink, i, d->pixels)) return false;
        pthread_mutex_lock(&d->lock);
        d->full = false;
        pthread_cond_broadcast(&d->turn);
        pthread_mutex_unlock(&d->lock);
        progress_show(bar, (double)(i + 1), (double)job->count, "pictures");
    }
    return true;
}

static int render(const command *self, const render_job *job, bool quiet) {
    drawer all[MAX_DRAWERS];
    picture_sink sink = {.job = job};
    if (!start_sheet(&sink))
        return complain(self, EXIT_LOST, "out of memory for the contact sheet");
    if (job->out && is_video(job->out)) {
        int stem = (int)(strrchr(job->out, '.') - job->out);
        snprintf(sink.part, sizeof sink.part, "%.*s.part%s", stem, job->out, job->out + stem);
        sink.video = start_ffmpeg(job, sink.part, &sink.ffmpeg);
        if (!sink.video) return complain(self, EXIT_LOST, "cannot start ffmpeg");
    }
    progress bar = progress_start(quiet);
    start_drawers(all, job);
    bool good = collect(all, &sink, &bar);
    for (int i = 0; i < job->drawers; i++) {
        pthread_mutex_lock(&all[i].lock);
        all[i].quit = true;
        pthread_cond_broadcast(&all[i].turn);
        pthread_mutex_unlock(&all[i].lock);
        if (all[i].thread) pthread_join(all[i].thread, NULL);
        free(all[i].pixels);
    }
    progress_end(&bar);
    good = finish(&sink, good && !stop_requested);
    if (!good)
        return complain(self, EXIT_LOST,
                        stop_requested ? "stopped" : "not all pictures could be made");
    if (!quiet)
        printf("%lld pictures of %lldx%lld in %.1f s%s%s\n", (long long)job->count,
               (long long)job->width, (long long)job->height, wall_seconds() - bar.start,
               job->out ? " -> " : "", job->out ? job->out : "");
    return EXIT_DONE;
}

static int plan(const command *self, render_job *job) {
    if (job->out && !is_video(job->out) && !is_pattern(job->out))
        return complain(
            self, EXIT_INPUT,
            "-o %s: must end in .mp4, .webm, .mkv or .gif, or be like 'frame_%%05d.png'", job->out);
    if (same_file(job->path, job->out) || same_file(job->path, job->sheet))
        return complain(self, EXIT_INPUT, "the output would replace the log");
    if (!job->out && !job->sheet)
        return complain(self, EXIT_INPUT, "say where to: -o FILE or --sheet FILE");
    jsl_logger logger = stderr_logger();
    jsl_log_file *log;
    if (jsl_log_open(job->path, &logger, &log) != JSL_OK) return EXIT_INPUT;
    static jsl_log_info info;
    jsl_result result = jsl_log_get_info(log, &info);
    jsl_log_close(log);
    if (result != JSL_OK) return EXIT_INPUT;
    if (info.particle_frames + info.boid_frames + info.body_frames == 0)
        return complain(self, EXIT_INPUT, "%s holds nothing that can be drawn", job->path);
    double from = isnan(job->from) ? info.first_time : fmax(job->from, info.first_time);
    double to = isnan(job->to) ? info.last_time : fmin(job->to, info.last_time);
    if (!isnan(job->from) && !isnan(job->to) && job->to < job->from)
        return complain(self, EXIT_INPUT, "--to comes before --from");
    if (to < from)
        return complain(self, EXIT_INPUT, "the log covers %g .. %g s only", info.first_time,
                        info.last_time);
    job->first_time = from;
    job->count = 1 + (int64_t)floor((to - from) * job->fps + 1e-3);
    if (job->drawers > job->count) job->drawers = job->count;
    return -1;
}

static int run(const command *self, int argc, char **argv) {
    render_job job = {
        .fps = 30, .from = NAN, .to = NAN, .width = 1280, .height = 720, .drawers = 2};
    bool quiet = false;
    const option_row rows[] = {
        {"output", 'o', OPTION_TEXT, "FILE",
         "video (.mp4 .webm .mkv .gif) or pictures ('frame_%05d.png')", &job.out, 0, 0},
        {"sheet", 0, OPTION_TEXT, "FILE", "contact sheet of 12 pictures (PNG)", &job.sheet, 0, 0},
        {"fps", 0, OPTION_REAL, "N", "pictures per simulated second (30)", &job.fps, 0.001, 10000},
        {"from", 0, OPTION_REAL, "T", "first simulated second", &job.from, 0, 0},
        {"to", 0, OPTION_REAL, "T", "last simulated second", &job.to, 0, 0},
        {"width", 0, OPTION_INT, "N", "pixels, even (1280)", &job.width, 16, 8192},
        {"height", 0, OPTION_INT, "N", "pixels, even (720)", &job.height, 16, 8192},
        {"workers", 'w', OPTION_INT, "N", "pictures drawn at once (2)", &job.drawers, 1,
         MAX_DRAWERS},
        {"quiet", 'q', OPTION_FLAG, NULL, "no summary, no progress bar", &quiet, 0, 0},
    };
    int first;
    int status = parse_options(self, rows, sizeof rows / sizeof rows[0], argc, argv, &first);
    if (status >= 0) return status;
    if (argc - first != 1)
        return complain(self, EXIT_INPUT, "name one log file; see jostle render --help");
    if (job.width % 2 || job.height % 2)
        return complain(self, EXIT_INPUT, "width and height must be even");
    job.path = argv[first];
    status = plan(self, &job);
    if (status >= 0) return status;
    catch_signals();
    return render(self, &job, quiet);
}

const command command_render = {
    .name = "render",
    .summary = "draw a log as a video, pictures or a contact sheet",
    .usage = "LOG -o out.mp4 | -o 'frame_%05d.png' [options]",
    .details = "Videos need ffmpeg; pictures do not. No display is needed.",
    .example = "jostle render showcase.lcmlog -o showcase.mp4 --sheet showcase.png",
    .run = run,
};
