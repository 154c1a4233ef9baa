/* SPDX-License-Identifier: MIT
 * A world of particles, boids and bodies whose columns are known functions of row and step, for
 * tests of what is logged. Included by one file of a test.
 */
#ifndef JSL_TESTS_LOG_FIXTURE_H
#define JSL_TESTS_LOG_FIXTURE_H

#include "helper.h"

#include <jostle/components.h>
#include <jostle/telemetry.h>
#include <jostle/world.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

JSL_COMPONENT_FIELDS(jsl_position, JSL_POSITION_FIELDS);
JSL_COMPONENT_FIELDS(jsl_orientation, JSL_ORIENTATION_FIELDS);
JSL_COMPONENT_FIELDS(jsl_velocity, JSL_VELOCITY_FIELDS);
JSL_COMPONENT_FIELDS(jsl_mass, JSL_MASS_FIELDS);
JSL_COMPONENT_FIELDS(jsl_collider, JSL_COLLIDER_FIELDS);
JSL_COMPONENT_FIELDS(jsl_look, JSL_LOOK_FIELDS);
JSL_COMPONENT_FIELDS(jsl_particle, JSL_PARTICLE_FIELDS);
JSL_COMPONENT_FIELDS(jsl_boid, JSL_BOID_FIELDS);

typedef struct log_world {
    jsl_world *world;
    jsl_component position, orientation, velocity, mass, collider, look, particle, boid;
    jsl_query particles, boids, bodies;
    jsl_shape sphere, box, plane;
    int64_t step;
} log_world;

/* What row i holds at a step in component c of a field: between -50 and 50. */
static inline double log_value(int64_t i, int64_t step, int c) {
    return fmod((double)i * 0.37 + (double)c * 17.3 + (double)step * 0.25, 100.0) - 50.0;
}

static inline jsl_component log_component(jsl_ecs *ecs, const char *name, const jsl_field *fields,
                                          int count) {
    jsl_component c;
    assert_ok(jsl_component_register(
        ecs, &(jsl_component_desc){.name = name, .fields = fields, .field_count = count}, &c));
    return c;
}
#define LOG_COMPONENT(ecs, name)                                                                   \
    log_component(ecs, #name, jsl_##name##_fields,                                                 \
                  (int)(sizeof jsl_##name##_fields / sizeof jsl_##name##_fields[0]))

/* Sets every column for the present step. */
static inline void log_world_move(log_world *w) {
    jsl_ecs *ecs = jsl_world_ecs(w->world);
    jsl_rows r;
    const jsl_query all[] = {w->particles, w->boids, w->bodies};
    for (int q = 0; q < 3; q++) {
        int64_t base = 0;
        for (jsl_iter it = jsl_query_begin(ecs, all[q], 0); jsl_query_next(&it, &r);) {
            jsl_position_columns p = jsl_position_of(&r, 0);
            for (int64_t i = 0; i < r.count; i++) {
                p.px[i] = (jsl_real)log_value(base + i, w->step, 0);
                p.py[i] = (jsl_real)log_value(base + i, w->step, 1);
                p.pz[i] = (jsl_real)log_value(base + i, w->step, 2);
                if (q == 0) {
                    jsl_particle_columns c = jsl_particle_of(&r, 1);
                    c.life[i] = 1000;
                    c.size[i] = (jsl_real)(0.01 + 0.001 * (double)(i % 7));
                } else if (q == 1) {
                    jsl_boid_columns c = jsl_boid_of(&r, 1);
                    c.ax[i] = 1;
                    c.ay[i] = -2;
                    c.az[i] = (jsl_real)0.5;
                } else {
                    jsl_orientation_columns o = jsl_orientation_of(&r, 2);
                    o.qx[i] = o.qy[i] = o.qz[i] = 0;
                    o.qw[i] = 1;
                }
            }
            base += r.count;
        }
    }
}

static inline void log_world_fill(log_world *w, int64_t particles, int64_t boids, int64_t bodies) {
    jsl_ecs *ecs = jsl_world_ecs(w->world);
    const jsl_component p[] = {w->position, w->particle};
    const jsl_component b[] = {w->position, w->boid, w->velocity, w->look};
    const jsl_component r[] = {w->position, w->orientation, w->velocity,
                               w->mass,     w->collider,    w->look};
    jsl_rows rows;
    if (particles) assert_ok(jsl_entity_create_n(ecs, p, 2, particles, NULL, &rows));
    if (boids) {
        assert_ok(jsl_entity_create_n(ecs, b, 4, boids, NULL, &rows));
        for (int64_t i = 0; i < boids; i++) {
            jsl_velocity_of(&rows, 2).vx[i] = (jsl_real)(i % 32);
            jsl_look_of(&rows, 3).rgba[i] = (uint32_t)i << 8 | 0xffu;
        }
    }
    if (bodies) {
        assert_ok(jsl_entity_create_n(ecs, r, 6, bodies, NULL, &rows));
        for (int64_t i = 0; i < bodies; i++) {
            jsl_mass_of(&rows, 3).inv_mass[i] = JSL_R(0.5);
            jsl_mass_of(&rows, 3).inv_ixx[i] = 1;
            jsl_mass_of(&rows, 3).inv_iyy[i] = 1;
            jsl_mass_of(&rows, 3).inv_izz[i] = 1;
            jsl_collider_of(&rows, 4).shape[i] = i % 3 == 0   ? w->sphere.id
                                                 : i % 3 == 1 ? w->box.id
                                                              : w->plane.id;
            jsl_look_of(&rows, 5).rgba[i] = 0x10203000u + (uint32_t)i;
        }
    }
}

static inline log_world log_world_make(int64_t particles, int64_t boids, int64_t bodies) {
    log_world w = {0};
    assert_ok(jsl_world_create(&(jsl_world_desc){.seed = 77, .dt = JSL_R(0.0078125)}, &w.world));
    jsl_ecs *ecs = jsl_world_ecs(w.world);
    w.position = LOG_COMPONENT(ecs, position);
    w.orientation = LOG_COMPONENT(ecs, orientation);
    w.velocity = LOG_COMPONENT(ecs, velocity);
    w.mass = LOG_COMPONENT(ecs, mass);
    w.collider = LOG_COMPONENT(ecs, collider);
    w.look = LOG_COMPONENT(ecs, look);
    if (particles >= 0) w.particle = LOG_COMPONENT(ecs, particle);
    w.boid = LOG_COMPONENT(ecs, boid);
    assert_ok(jsl_shape_create(
        w.world, &(jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = JSL_R(0.5)}, &w.sphere));
    assert_ok(jsl_shape_create(w.world, &(jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {1, 2, 3}},
                               &w.box));
    assert_ok(jsl_shape_create(w.world, &(jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, &w.plane));
    if (w.particle.id)
        assert_ok(jsl_query_create(
            ecs, &(jsl_query_desc){{{w.position, JSL_WRITE}, {w.particle, JSL_WRITE}}},
            &w.particles));
    assert_ok(jsl_query_create(
        ecs, &(jsl_query_desc){{{w.position, JSL_WRITE}, {w.boid, JSL_WRITE}}}, &w.boids));
    assert_ok(jsl_query_create(
        ecs,
        &(jsl_query_desc){
            {{w.position, JSL_WRITE}, {w.collider, JSL_WRITE}, {w.orientation, JSL_WRITE}}},
        &w.bodies));
    log_world_fill(&w, particles > 0 ? particles : 0, boids, bodies);
    log_world_move(&w);
    return w;
}

static inline void log_world_step(log_world *w) {
    assert_ok(jsl_step(w->world, 0, NULL));
    w->step++;
    log_world_move(w);
}

/* A file name of its own in the folder for temporary files; the file does not exist. */
static inline void log_temp_path(char path[256]) {
    const char *dir = getenv("TMPDIR");
    snprintf(path, 256, "%s/jostle-test-XXXXXX", dir ? dir : "/tmp");
    int f = mkstemp(path);
    assert_true(f >= 0);
    close(f);
    unlink(path);
}

/* The bytes of a file; free them. */
static inline uint8_t *log_read_file(const char *path, int64_t *size) {
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    assert_int_equal(fseek(f, 0, SEEK_END), 0);
    *size = ftell(f);
    rewind(f);
    uint8_t *bytes = malloc((size_t)*size + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, (size_t)*size, f), *size);
    fclose(f);
    return bytes;
}

static inline void log_write_file(const char *path, const void *bytes, int64_t size) {
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, (size_t)size, f), size);
    assert_int_equal(fclose(f), 0);
}

#endif
