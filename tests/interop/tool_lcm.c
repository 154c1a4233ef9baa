/* SPDX-License-Identifier: MIT
 * What tests/interop/test_lcm_tools.sh needs beside stock LCM tools:
 *   tool_lcm write FILE MS       a log of a small world, MS milliseconds between steps
 *   tool_lcm live URL MS         the same world published live, MS milliseconds between steps
 *   tool_lcm play FILE URL SPEED  jsl_log_play
 *   tool_lcm sum FILE            one line a channel: events, bytes, hash of the payloads in order
 *   tool_lcm frames FILE         whole frames that can be read
 */
#include <jostle/components.h>
#include <jostle/telemetry.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

JSL_COMPONENT_FIELDS(position, JSL_POSITION_FIELDS);
JSL_COMPONENT_FIELDS(orientation, JSL_ORIENTATION_FIELDS);
JSL_COMPONENT_FIELDS(collider, JSL_COLLIDER_FIELDS);
JSL_COMPONENT_FIELDS(particle, JSL_PARTICLE_FIELDS);
JSL_COMPONENT_FIELDS(boid, JSL_BOID_FIELDS);

static void check(jsl_result r, const char *what) {
    if (r == JSL_OK) return;
    fprintf(stderr, "%s: %s\n", what, jsl_result_text(r));
    exit(1);
}

static void say(jsl_log_level level, jsl_result code, const char *text, void *ctx) {
    (void)level;
    (void)code;
    (void)ctx;
    fprintf(stderr, "%s\n", text);
}

static jsl_component add(jsl_ecs *ecs, const char *name, const jsl_field *fields, size_t bytes) {
    jsl_component c;
    jsl_component_desc desc = {
        .name = name, .fields = fields, .field_count = (int)(bytes / sizeof *fields)};
    check(jsl_component_register(ecs, &desc, &c), name);
    return c;
}
#define ADD(name) add(ecs, #name, name##_fields, sizeof name##_fields)

typedef struct scene {
    jsl_world *world;
    jsl_query all;
} scene;

static scene make(void) {
    scene s;
    jsl_shape ball;
    check(jsl_world_create(&(jsl_world_desc){.seed = 5}, &s.world), "world");
    jsl_ecs *ecs = jsl_world_ecs(s.world);
    jsl_component pos = ADD(position), quat = ADD(orientation), solid = ADD(collider);
    jsl_component dust = ADD(particle), bird = ADD(boid);
    check(jsl_shape_create(s.world, &(jsl_shape_desc){JSL_SHAPE_SPHERE, 1, {0, 0, 0}}, &ball),
          "shape");
    jsl_rows rows;
    check(jsl_entity_create_n(ecs, (jsl_component[]){pos, dust}, 2, 12000, NULL, &rows), "dust");
    check(jsl_entity_create_n(ecs, (jsl_component[]){pos, bird}, 2, 500, NULL, &rows), "birds");
    check(jsl_entity_create_n(ecs, (jsl_component[]){pos, quat, solid}, 3, 40, NULL, &rows),
          "bodies");
    for (int i = 0; i < 40; i++) {
        jsl_orientation_of(&rows, 1).qw[i] = 1;
        jsl_collider_of(&rows, 2).shape[i] = ball.id;
    }
    check(jsl_query_create(ecs, &(jsl_query_desc){{{pos, JSL_WRITE}}}, &s.all), "query");
    return s;
}

static void run(const jsl_publisher_desc *desc, int64_t pause_us) {
    scene s = make();
    jsl_publisher *p;
    jsl_publisher_stats stats;
    check(jsl_publisher_create(desc, s.world, &p), "publisher");
    for (int step = 0; step < 60; step++) {
        jsl_rows rows;
        for (jsl_iter it = jsl_query_begin(jsl_world_ecs(s.world), s.all, 0);
             jsl_query_next(&it, &rows);) {
            jsl_position_columns c = jsl_position_of(&rows, 0);
            for (int64_t i = 0; i < rows.count; i++) {
                c.px[i] = (jsl_real)(10 * sin((double)(i + step)));
                c.py[i] = (jsl_real)(10 * cos((double)(i + step)));
                c.pz[i] = (jsl_real)(0.01 * (double)step);
            }
        }
        check(jsl_step(s.world, 0, NULL), "step");
        check(jsl_publisher_step(p, NULL), "publish");
        if (pause_us) usleep((useconds_t)pause_us);
    }
    check(jsl_publisher_close(p, &stats), "close");
    printf("%lld %lld %lld %lld\n", (long long)stats.frames_sent, (long long)stats.frames_dropped,
           (long long)stats.log_events, (long long)stats.live_events);
    jsl_world_destroy(s.world);
}

static int play(const char *path, const char *url, double speed) {
    jsl_log_file *log;
    jsl_play_stats stats;
    jsl_logger logger = {say, NULL};
    check(jsl_log_open(path, &logger, &log), path);
    jsl_result r = jsl_log_play(
        log, &(jsl_play_desc){.lcm_url = url, .speed = speed, .logger = logger}, &stats);
    printf("%lld %.3f\n", (long long)stats.events, stats.seconds);
    jsl_log_close(log);
    return r == JSL_OK ? 0 : 1;
}

/* FNV-1a of sizes and bytes. */
static uint64_t hash(uint64_t h, const uint8_t *p, int64_t n) {
    for (int64_t i = 0; i < n; i++) h = (h ^ p[i]) * 0x100000001b3ull;
    return (h ^ (uint64_t)n) * 0x100000001b3ull;
}

static int sum(const char *path) {
    jsl_log_file *log;
    jsl_log_event e;
    struct {
        char name[64];
        long long events, bytes;
        uint64_t hash;
    } channel[64];
    int count = 0;
    check(jsl_log_open(path, NULL, &log), path);
    while (jsl_log_next(log, &e) != JSL_ERR_END) {
        char name[64];
        snprintf(name, sizeof name, "%.*s", e.channel_size, e.channel);
        int i = 0;
        while (i < count && strcmp(channel[i].name, name) != 0) i++;
        if (i == 64) continue;
        if (i == count) {
            memset(&channel[count], 0, sizeof channel[count]);
            memcpy(channel[count++].name, name, sizeof name);
            channel[i].hash = 0xcbf29ce484222325ull;
        }
        channel[i].events++;
        channel[i].bytes += e.size;
        channel[i].hash = hash(channel[i].hash, e.data, e.size);
    }
    for (int i = 0; i < count; i++)
        printf("%s %lld %lld %016llx\n", channel[i].name, channel[i].events, channel[i].bytes,
               (unsigned long long)channel[i].hash);
    jsl_log_close(log);
    return 0;
}

static int frames(const char *path) {
    static jsl_log_info info;
    jsl_log_file *log;
    jsl_frame f;
    long long n = 0;
    check(jsl_log_open(path, NULL, &log), path);
    while (jsl_log_next_frame(log, &f) == JSL_OK)
        n += f.particles.count == 12000 && f.boids.count == 500 && f.bodies.count == 40;
    (void)jsl_log_verify(log, &info);
    printf("%lld %lld %lld\n", n, (long long)info.incomplete_frames, (long long)info.bad_frames);
    jsl_log_close(log);
    return 0;
}

int main(int argc, char **argv) {
    const char *verb = argc > 1 ? argv[1] : "";
    jsl_publisher_desc desc = {
        .scene_name = "interop", .scene_text = "{}", .when_full = JSL_FULL_BLOCK};
    desc.logger = (jsl_logger){say, NULL};
    if (strcmp(verb, "write") == 0 && argc == 4) {
        desc.log_path = argv[2];
        run(&desc, 1000 * atoll(argv[3]));
        return 0;
    }
    if (strcmp(verb, "live") == 0 && argc == 4) {
        desc.lcm_url = argv[2];
        run(&desc, 1000 * atoll(argv[3]));
        return 0;
    }
    if (strcmp(verb, "play") == 0 && argc == 5) return play(argv[2], argv[3], atof(argv[4]));
    if (strcmp(verb, "sum") == 0 && argc == 3) return sum(argv[2]);
    if (strcmp(verb, "frames") == 0 && argc == 3) return frames(argv[2]);
    fprintf(stderr, "usage: tool_lcm write|live|play|sum|frames ...\n");
    return 2;
}
