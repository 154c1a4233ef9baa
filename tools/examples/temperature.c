/* SPDX-License-Identifier: MIT
 * A component and systems of your own: hot particles rain on cold blocks, cool on the way and warm
 * what they come near. Queries, telemetry, snapshot and hash treat `temperature` like any other.
 *   cc temperature.c $(pkg-config --cflags --libs jostle-lcm jostle) -lm
 */
#include <jostle/jostle.h>
#include <jostle/telemetry.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* One row a field: type, name, unit, role. Makes temperature_fields and temperature_of(). */
#define TEMPERATURE_FIELDS(X) X(real, kelvin, "K", JSL_STATE)
JSL_COMPONENT_COLUMNS(temperature, TEMPERATURE_FIELDS)
JSL_COMPONENT_FIELDS(temperature, TEMPERATURE_FIELDS);

static const jsl_real air = 290, birth = 900; /* K */
static jsl_component temperature;
static jsl_query newborn, hot; /* particles without and with the component */

#define TRY(call) try(call, #call)
static void try(jsl_result r, const char *call) {
    if (r != JSL_OK) fprintf(stderr, "%s: %s\n", call, jsl_result_text(r)), exit(1);
}

/* Once a step: those born in it get the component, zeroed. Nothing else is at 0 K. */
static jsl_result give(const jsl_step_context *c, void *user) {
    (void)user;
    return jsl_entity_add_where(c->ecs, newborn, &temperature, 1, NULL);
}

/* Newton's law, T' = -(T - air) / 0.8 s, exact over a step. Blocks of rows run in parallel. */
static void cool(const jsl_step_context *c, const jsl_rows *rows, void *user) {
    temperature_columns t = temperature_of(rows, 0);
    jsl_real keep = JSL_R(exp(-(double)c->dt / 0.8));
    (void)user;
    for (int64_t i = 0; i < rows->count; i++)
        t.kelvin[i] = t.kelvin[i] == 0 ? birth : air + (t.kelvin[i] - air) * keep;
}

/* A block gains from each particle within 0.8 m, in proportion to the difference. A row writes only
 * itself and sums in the order of the particles: the same bits for any number of threads. */
static void warm(const jsl_step_context *c, const jsl_rows *rows, void *user) {
    temperature_columns t = temperature_of(rows, 0);
    jsl_position_columns at = jsl_position_of(rows, 1);
    jsl_rows near;
    (void)user;
    for (int64_t i = 0; i < rows->count; i++)
        for (jsl_iter it = jsl_query_begin(c->ecs, hot, 0); jsl_query_next(&it, &near);) {
            jsl_position_columns p = jsl_position_of(&near, 1);
            for (int64_t k = 0; k < near.count; k++) {
                jsl_real x = p.px[k] - at.px[i], y = p.py[k] - at.py[i], z = p.pz[k] - at.pz[i];
                jsl_real more = temperature_of(&near, 0).kelvin[k] - t.kelvin[i];
                if (x * x + y * y + z * z < JSL_R(0.64)) t.kelvin[i] += more * c->dt / 500;
            }
        }
}

static void add_heat(jsl_ecs *ecs) {
    jsl_component particle, body, position;
    TRY(jsl_component_register(
        ecs, &(jsl_component_desc){"temperature", temperature_fields, 1, false}, &temperature));
    TRY(jsl_component_find(ecs, "particle", &particle));
    TRY(jsl_component_find(ecs, "body", &body));
    TRY(jsl_component_find(ecs, "position", &position));
    jsl_query_desc q[] = {
        {{{particle, JSL_READ}, {temperature, JSL_WITHOUT}}},
        {{{temperature, JSL_WRITE}, {position, JSL_READ}, {particle, JSL_READ}}},
        {{{temperature, JSL_WRITE}, {position, JSL_READ}, {body, JSL_READ}}},
    };
    TRY(jsl_query_create(ecs, &q[0], &newborn));
    TRY(jsl_query_create(ecs, &q[1], &hot));
    const jsl_system_desc systems[] = {
        /* built-in ones have orders below 1000 */
        {"give", JSL_STAGE_MEASURE, 1000, .query = q[0], .run_whole = give},
        {"cool", JSL_STAGE_MEASURE, 1001, .query = q[1], .run_rows = cool},
        {"warm", JSL_STAGE_MEASURE, 1002, .query = q[2], .run_rows = warm}};
    for (int i = 0; i < 3; i++) TRY(jsl_system_register(ecs, &systems[i]));
}

/* The same frames as jostle log export LOG --channel temperature. */
static void print_log(const char *path, jsl_body block) {
    jsl_log_file *log;
    jsl_log_columns f;
    TRY(jsl_log_open(path, NULL, &log));
    printf("time [s]  particles  their mean [K]  block [K]\n");
    while (jsl_log_next_columns(log, "temperature", &f) == JSL_OK) {
        const jsl_real *kelvin = f.field[0].data; /* written by this very build: F32 is jsl_real */
        double sum = 0, own = 0;
        for (int64_t i = 0; i < f.count; i++)
            *(f.id[i] == jsl_entity_id(block.entity) ? &own : &sum) += (double)kelvin[i];
        double mean = f.count > 1 ? sum / (double)(f.count - 1) : 0;
        if (llround(f.time * 10) % 5 == 0) /* logged at 10 Hz: every fifth frame */
            printf("%8.1f  %9lld  %14.2f  %9.3f\n", f.time, (long long)f.count - 1, mean, own);
    }
    jsl_log_close(log);
}

static uint64_t run(jsl_world *world, jsl_publisher *publisher) { /* 3 s */
    for (int i = 0; i < 180; i++) {
        TRY(jsl_step(world, 0, NULL));
        if (publisher) TRY(jsl_publisher_step(publisher, NULL));
    }
    return jsl_world_hash(world);
}

int main(int argc, char **argv) {
    const char *path = argc > 1 ? argv[1] : "temperature.lcmlog";
    jsl_world *world;
    jsl_shape cube;
    jsl_body block;
    jsl_emitter source;
    TRY(jsl_world_create(&(jsl_world_desc){.gravity = {0, 0, JSL_R(-9.81)}, .workers = 2}, &world));
    jsl_shape_desc half_metre = {.kind = JSL_SHAPE_BOX, .half = {.5, .5, .5}};
    jsl_emitter_desc rain = {.position = {0, 0, 4}, .rate = 400, .life = 1};
    TRY(jsl_emitter_create(world, &rain, &source));
    TRY(jsl_shape_create(world, &half_metre, &cube));
    TRY(jsl_body_create(world, &(jsl_body_desc){.shape = cube, .no_gravity = true}, &block));
    add_heat(jsl_world_ecs(world));
    TRY(jsl_entity_add(jsl_world_ecs(world), block.entity, &temperature, 1));
    *(jsl_real *)jsl_entity_field(jsl_world_ecs(world), block.entity, temperature, 0) = air;

    jsl_publisher *publisher; /* by default it logs every component of your own at 10 Hz */
    TRY(jsl_publisher_create(&(jsl_publisher_desc){.log_path = path}, world, &publisher));
    run(world, publisher);
    TRY(jsl_publisher_close(publisher, NULL));
    print_log(path, block);

    void *image; /* the component is part of the state: saved, restored and hashed */
    size_t size;
    TRY(jsl_world_save(world, &image, &size));
    uint64_t went_on = run(world, NULL);
    TRY(jsl_world_restore(world, image, size));
    bool same = run(world, NULL) == went_on;
    printf("went on, restored and went on again: %s\n", same ? "equal hashes" : "HASHES DIFFER");
    jsl_world_free_bytes(world, image, size);
    jsl_world_destroy(world);
    return same ? 0 : 1;
}
