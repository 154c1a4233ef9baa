/* SPDX-License-Identifier: MIT
 * Creating flocks, boids, leaders and paths; what is refused, and by which name.
 */
#include "flock_stage.h"

#include "ecs/ecs.h"

#include <string.h>

static flock_stage stage;
static int set_up(void **state) {
    (void)state;
    flock_stage_open(&stage, 1, JSL_ISA_AUTO);
    return 0;
}
static int tear_down(void **state) {
    (void)state;
    flock_stage_close(&stage);
    return 0;
}

static void defaults_are_those_of_the_header(void **state) {
    (void)state;
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    jsl_flock_desc d;
    assert_ok(jsl_flock_room_flock_get(stage.room, flock, &d));
    assert_close(d.separation.radius, 5, 0);
    assert_close(d.alignment.radius, 7.5, 0);
    assert_close(d.cohesion.radius, 9, 0);
    assert_close(cos((double)d.separation.half_angle), -0.707, 1e-6);
    assert_close(cos((double)d.alignment.half_angle), 0.7, 1e-6);
    assert_close(cos((double)d.cohesion.half_angle), -0.15, 1e-6);
    assert_close(d.near_distance, 1.5, 0);
    assert_close(d.max_speed, 9, 0);
    assert_close(d.max_accel, 36, 0);
    assert_int_equal(d.period, 1);
    /* One rule given: the others are off. */
    flock = flock_stage_flock(&stage, &(jsl_flock_desc){.cohesion = {4, 1, 2}});
    assert_ok(jsl_flock_room_flock_get(stage.room, flock, &d));
    assert_close(d.separation.weight, 0, 0);
    assert_close(d.cohesion.half_angle, 1, 1e-6);
    assert_close(d.near_distance, 0, 0);
}

static void settings_come_back_as_they_went_in(void **state) {
    (void)state;
    const jsl_flock_desc in = {.separation = {1, 2, 3},
                               .alignment = {4, JSL_R(0.5), 6},
                               .cohesion = {7, 0, 9},
                               .near_distance = JSL_R(0.25),
                               .max_speed = 11,
                               .min_speed = 10,
                               .max_accel = 12,
                               .negotiation = JSL_FLOCK_BLEND,
                               .response = JSL_FLOCK_MEAN,
                               .period = 5,
                               .urge = {1, 2, 3},
                               .ignore_obstacles = true,
                               .avoid_horizon = 3,
                               .avoid_margin = 4,
                               .boid_radius = JSL_R(0.5),
                               .bounds_lo = {-1, -2, -3},
                               .bounds_hi = {1, 2, 3},
                               .bounds_weight = 6,
                               .leader_weight = 7,
                               .leader_gap = 8};
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    jsl_flock_desc out;
    assert_ok(jsl_flock_room_flock_set(stage.room, flock, &in));
    assert_ok(jsl_flock_room_flock_get(stage.room, flock, &out));
    assert_close(out.separation.half_angle, 2, 1e-6);
    assert_close(out.alignment.half_angle, 0.5, 1e-6);
    assert_close(out.cohesion.half_angle, 0, 0);
    out.separation.half_angle = in.separation.half_angle;
    out.alignment.half_angle = in.alignment.half_angle;
    assert_close_v3(out.urge, in.urge, 0);
    assert_close_v3(out.bounds_lo, in.bounds_lo, 0);
    assert_close_v3(out.bounds_hi, in.bounds_hi, 0);
    assert_true(out.ignore_obstacles);
    assert_true(out.separation.weight == 3 && out.alignment.weight == 6 &&
                out.cohesion.weight == 9);
    assert_true(out.max_speed == 11 && out.min_speed == 10 && out.max_accel == 12);
    assert_true(out.negotiation == JSL_FLOCK_BLEND && out.response == JSL_FLOCK_MEAN &&
                out.period == 5);
    assert_true(out.avoid_horizon == 3 && out.avoid_margin == 4 && out.boid_radius == JSL_R(0.5));
    assert_true(out.bounds_weight == 6 && out.leader_weight == 7 && out.leader_gap == 8);
}

/* A desc with one bad field is refused, the log names the field, and nothing has been made. */
static void refuse(const jsl_flock_desc *desc, jsl_result want, const char *field) {
    jsl_flock out = {{77, 77}};
    const int64_t entities = jsl_entity_count(stage.ecs);
    stage.log.lines = 0;
    assert_result(jsl_flock_room_flock_create(stage.room, desc, &out), want);
    assert_int_equal(stage.log.lines, 1);
    if (!strstr(stage.log.text, field)) fail_msg("'%s' does not name %s", stage.log.text, field);
    assert_i64(jsl_entity_count(stage.ecs), entities);
    assert_int_equal(out.entity.index, 77);
}

#define REFUSE(field, bad, want)                                                                   \
    do {                                                                                           \
        jsl_flock_desc desc = {.max_speed = 5};                                                    \
        desc.field = (bad);                                                                        \
        refuse(&desc, want, #field);                                                               \
    } while (0)
#define REFUSE_REAL(field)                                                                         \
    do {                                                                                           \
        REFUSE(field, (jsl_real)NAN, JSL_ERR_NOT_FINITE);                                          \
        REFUSE(field, (jsl_real)INFINITY, JSL_ERR_NOT_FINITE);                                     \
        REFUSE(field, (jsl_real)-INFINITY, JSL_ERR_NOT_FINITE);                                    \
    } while (0)
#define REFUSE_NEGATIVE(field)                                                                     \
    do {                                                                                           \
        REFUSE_REAL(field);                                                                        \
        REFUSE(field, -1, JSL_ERR_ARGUMENT);                                                       \
        REFUSE(field, JSL_R(2e9), JSL_ERR_ARGUMENT);                                               \
    } while (0)

static void every_bad_field_is_named(void **state) {
    (void)state;
    REFUSE_NEGATIVE(separation.radius);
    REFUSE_NEGATIVE(separation.half_angle);
    REFUSE_NEGATIVE(separation.weight);
    REFUSE_NEGATIVE(alignment.radius);
    REFUSE_NEGATIVE(alignment.half_angle);
    REFUSE_NEGATIVE(alignment.weight);
    REFUSE_NEGATIVE(cohesion.radius);
    REFUSE_NEGATIVE(cohesion.half_angle);
    REFUSE_NEGATIVE(cohesion.weight);
    REFUSE(cohesion.half_angle, JSL_R(3.2), JSL_ERR_ARGUMENT);
    REFUSE_NEGATIVE(near_distance);
    REFUSE_NEGATIVE(max_speed);
    REFUSE_NEGATIVE(min_speed);
    REFUSE(min_speed, 6, JSL_ERR_ARGUMENT); /* above max_speed */
    REFUSE_NEGATIVE(max_accel);
    REFUSE_NEGATIVE(avoid_horizon);
    REFUSE_NEGATIVE(avoid_margin);
    REFUSE_NEGATIVE(boid_radius);
    REFUSE_NEGATIVE(bounds_weight);
    REFUSE_NEGATIVE(leader_weight);
    REFUSE_NEGATIVE(leader_gap);
    REFUSE_REAL(urge.x);
    REFUSE_REAL(urge.y);
    REFUSE_REAL(urge.z);
    REFUSE_REAL(bounds_lo.x);
    REFUSE_REAL(bounds_lo.y);
    REFUSE_REAL(bounds_lo.z);
    REFUSE_REAL(bounds_hi.x);
    REFUSE_REAL(bounds_hi.y);
    REFUSE_REAL(bounds_hi.z);
    REFUSE(bounds_lo.x, 3, JSL_ERR_ARGUMENT); /* above bounds_hi */
    REFUSE(negotiation, JSL_FLOCK_NEGOTIATION_COUNT, JSL_ERR_ARGUMENT);
    REFUSE(response, (jsl_flock_response)-1, JSL_ERR_ARGUMENT);
    REFUSE(period, -1, JSL_ERR_ARGUMENT);
    REFUSE(period, 65, JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_flock_create(stage.room, NULL, &(jsl_flock){0}), JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_flock_create(stage.room, &(jsl_flock_desc){0}, NULL),
                  JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_flock_create(NULL, &(jsl_flock_desc){0}, &(jsl_flock){0}),
                  JSL_ERR_ARGUMENT);
}

static void bad_settings_leave_the_old_ones(void **state) {
    (void)state;
    jsl_flock_desc desc = {.max_speed = 4}, bad = {.max_speed = 3, .max_accel = -2}, now;
    jsl_flock flock = flock_stage_flock(&stage, &desc);
    assert_result(jsl_flock_room_flock_set(stage.room, flock, &bad), JSL_ERR_ARGUMENT);
    assert_ok(jsl_flock_room_flock_get(stage.room, flock, &now));
    assert_close(now.max_speed, 4, 0);
}

static void stale_and_foreign_handles_are_refused(void **state) {
    (void)state;
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    jsl_entity boid = flock_stage_boid(&stage, flock, jsl_v3(0, 0, 0), jsl_v3(1, 0, 0));
    jsl_flock other = flock_stage_flock(&stage, &(jsl_flock_desc){0}), none = {{0, 0}};
    jsl_flock not_a_flock = {boid}, dead = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    assert_ok(jsl_flock_room_flock_destroy(stage.room, dead));
    const jsl_flock bad[] = {none, not_a_flock, dead};
    for (int i = 0; i < 3; i++) {
        jsl_flock_desc desc = {0};
        jsl_boid_spawn spawn = {.radius = 1};
        assert_result(jsl_flock_room_flock_get(stage.room, bad[i], &desc), JSL_ERR_HANDLE);
        assert_result(jsl_flock_room_flock_set(stage.room, bad[i], &desc), JSL_ERR_HANDLE);
        assert_result(jsl_flock_room_flock_destroy(stage.room, bad[i]), JSL_ERR_HANDLE);
        assert_result(jsl_flock_room_set_leader(stage.room, bad[i], boid), JSL_ERR_HANDLE);
        assert_result(jsl_flock_room_set_path(stage.room, bad[i], NULL, 0, 0), JSL_ERR_HANDLE);
        assert_result(jsl_flock_room_boid_create_n(stage.room, 0, bad[i], 1, &spawn, NULL),
                      JSL_ERR_HANDLE);
    }
    assert_result(jsl_flock_room_set_leader(stage.room, other, boid), JSL_ERR_HANDLE);
    assert_result(jsl_flock_room_set_leader(stage.room, flock, flock.entity), JSL_ERR_HANDLE);
}

static void bad_spawns_make_nobody(void **state) {
    (void)state;
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    const struct {
        jsl_boid_spawn spawn;
        jsl_result want;
        const char *name;
    } bad[] = {
        {{.centre = {(jsl_real)NAN, 0, 0}}, JSL_ERR_NOT_FINITE, "centre.x"},
        {{.radius = -1}, JSL_ERR_ARGUMENT, "radius"},
        {{.half = {1, -1, 1}}, JSL_ERR_ARGUMENT, "half.y"},
        {{.velocity = {0, 0, (jsl_real)INFINITY}}, JSL_ERR_NOT_FINITE, "velocity.z"},
        {{.velocity_spread = -2}, JSL_ERR_ARGUMENT, "velocity_spread"},
    };
    const int64_t entities = jsl_entity_count(stage.ecs);
    for (int i = 0; i < 5; i++) {
        assert_result(jsl_flock_room_boid_create_n(stage.room, 0, flock, 5, &bad[i].spawn, NULL),
                      bad[i].want);
        assert_non_null(strstr(stage.log.text, bad[i].name));
    }
    assert_result(jsl_flock_room_boid_create_n(stage.room, 0, flock, -1, &bad[0].spawn, NULL),
                  JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_boid_create_n(stage.room, 0, flock, 3, NULL, NULL),
                  JSL_ERR_ARGUMENT);
    assert_ok(jsl_flock_room_boid_create_n(stage.room, 0, flock, 0, &(jsl_boid_spawn){0}, NULL));
    assert_i64(jsl_entity_count(stage.ecs), entities);
}

static void bad_paths_are_refused(void **state) {
    (void)state;
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    jsl_vec3 p[33];
    for (int i = 0; i < 33; i++) p[i] = jsl_v3((jsl_real)i, (jsl_real)(i * i), 0);
    assert_result(jsl_flock_room_set_path(stage.room, flock, p, 2, 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_set_path(stage.room, flock, p, 33, 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_set_path(stage.room, flock, p, -1, 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_set_path(stage.room, flock, NULL, 4, 1), JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_set_path(stage.room, flock, p, 4, 0), JSL_ERR_ARGUMENT);
    assert_result(jsl_flock_room_set_path(stage.room, flock, p, 4, (jsl_real)NAN),
                  JSL_ERR_NOT_FINITE);
    p[2] = p[1];
    assert_result(jsl_flock_room_set_path(stage.room, flock, p, 4, 1), JSL_ERR_DEGENERATE);
    p[2].y = (jsl_real)NAN;
    assert_result(jsl_flock_room_set_path(stage.room, flock, p, 4, 1), JSL_ERR_NOT_FINITE);
    assert_non_null(strstr(stage.log.text, "waypoints[2]"));
    p[2] = jsl_v3(2, 4, 0);
    assert_ok(jsl_flock_room_set_path(stage.room, flock, p, 32, 1));
    assert_ok(jsl_flock_room_set_path(stage.room, flock, p, 5, 1));
    assert_ok(jsl_flock_room_set_path(stage.room, flock, NULL, 0, 0));
}

static void spawns_fill_their_shape_and_depend_on_seed_and_entity_alone(void **state) {
    (void)state;
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    jsl_entity boid[2000];
    jsl_boid_spawn spawn = {
        .centre = {10, 20, 30}, .half = {1, 2, 3}, .velocity = {5, 0, 0}, .velocity_spread = 1};
    assert_ok(jsl_flock_room_boid_create_n(stage.room, 42, flock, 2000, &spawn, boid));
    double mean[3] = {0}, fast = 0;
    for (int i = 0; i < 2000; i++) {
        const boid_state b = flock_stage_see(&stage, boid[i]);
        const jsl_vec3 d = jsl_sub(b.p, spawn.centre);
        assert_true(jsl_abs(d.x) <= JSL_R(1.0001) && jsl_abs(d.y) <= JSL_R(2.0001) &&
                    jsl_abs(d.z) <= JSL_R(3.0001));
        mean[0] += (double)d.x / 2000, mean[1] += (double)d.y / 2000, mean[2] += (double)d.z / 2000;
        fast = fmax(fast, (double)jsl_length(jsl_sub(b.v, spawn.velocity)));
    }
    /* Standard errors of the mean are half/sqrt(3 n): five of them. */
    for (int k = 0; k < 3; k++) assert_close(mean[k], 0, 5 * (k + 1) / sqrt(6000.0));
    assert_true(fast <= 1.0001 && fast > 0.9);
    /* The first boid of another run of the same calls, with the same and another seed. */
    const jsl_vec3 first = flock_stage_see(&stage, boid[0]).p;
    for (uint64_t seed = 42; seed < 44; seed++) {
        flock_stage again;
        flock_stage_open(&again, 1, JSL_ISA_AUTO);
        jsl_flock other = flock_stage_flock(&again, &(jsl_flock_desc){0});
        jsl_entity e;
        assert_ok(jsl_flock_room_boid_create_n(again.room, seed, other, 1, &spawn, &e));
        const jsl_vec3 p = flock_stage_see(&again, e).p;
        assert_true((p.x == first.x && p.y == first.y && p.z == first.z) == (seed == 42));
        flock_stage_close(&again);
    }
}

static void a_dead_leader_leads_nobody(void **state) {
    (void)state;
    const jsl_vec3 way[] = {{5, 0, 0}, {0, 5, 0}, {-5, 0, 0}};
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    jsl_entity a = flock_stage_boid(&stage, flock, jsl_v3(500, 0, 0), jsl_v3(1, 0, 0));
    jsl_entity leader = flock_stage_boid(&stage, flock, jsl_v3(0, 0, 0), jsl_v3(1, 0, 0));
    assert_ok(jsl_flock_room_set_path(stage.room, flock, way, 3, 2));
    assert_ok(jsl_flock_room_set_leader(stage.room, flock, leader));
    flock_stage_step(&stage, JSL_R(0.1));
    assert_true(flock_stage_see(&stage, a).a.x < 0);
    assert_ok(jsl_entity_destroy(stage.ecs, leader));
    flock_stage_step(&stage, JSL_R(0.1));
    assert_close_v3(flock_stage_see(&stage, a).a, jsl_v3(0, 0, 0), 0);
}

static void boids_may_come_and_go_between_and_during_steps(void **state) {
    (void)state;
    jsl_flock flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    jsl_entity boid[400];
    jsl_boid_spawn spawn = {.radius = 10, .velocity_spread = 3};
    assert_ok(jsl_flock_room_boid_create_n(stage.room, 1, flock, 400, &spawn, boid));
    for (int i = 0; i < 20; i++) {
        flock_stage_step(&stage, JSL_R(1.0 / 60));
        assert_ok(jsl_entity_destroy_n(stage.ecs, boid + 10 * i, 10));
        assert_ok(jsl_flock_room_boid_create_n(stage.room, 1, flock, 5, &spawn, NULL));
        assert_ok(jsl_ecs_validate(stage.ecs, &(jsl_ecs_report){0}));
    }
    flock_stage_step(&stage, 0);
    assert_i64(jsl_entity_count(stage.ecs), 1 + 400 - 200 + 100);
}

/* A user system that makes and destroys boids between INDEX and DECIDE. */
typedef struct meddler {
    jsl_entity victim;
    jsl_component set[3];
    jsl_flock flock;
} meddler;
static jsl_result meddle(const jsl_step_context *context, void *user) {
    const meddler *m = user;
    const struct {
        jsl_real p[3], v[3];
        jsl_entity flock;
        jsl_real a[3];
        uint32_t flags, neighbours;
    } fresh = {.p = {1, 2, 3}, .v = {1, 0, 0}, .flock = m->flock.entity};
    JSL_TRY(jsl_defer_destroy(context, m->victim));
    return jsl_defer_create(context, m->set, 3, &fresh, sizeof fresh);
}

static void boids_made_after_the_index_are_seen_in_the_same_step(void **state) {
    (void)state;
    meddler m;
    m.flock = flock_stage_flock(&stage, &(jsl_flock_desc){0});
    assert_ok(jsl_component_find(stage.ecs, "position", &m.set[0]));
    assert_ok(jsl_component_find(stage.ecs, "velocity", &m.set[1]));
    assert_ok(jsl_component_find(stage.ecs, "boid", &m.set[2]));
    jsl_entity boid[50];
    jsl_boid_spawn spawn = {.radius = 20, .velocity_spread = 3};
    assert_ok(jsl_flock_room_boid_create_n(stage.room, 1, m.flock, 50, &spawn, boid));
    m.victim = boid[3];
    jsl_system_desc desc = {
        .name = "meddler", .stage = JSL_STAGE_PERCEIVE, .run_whole = meddle, .user = &m};
    assert_ok(jsl_system_register(stage.ecs, &desc));
    flock_stage_decide(&stage, JSL_R(1.0 / 60));
    assert_i64(jsl_entity_count(stage.ecs), 51);
    /* Everyone's neighbours, against all pairs of those alive now. */
    jsl_rows rows;
    jsl_query_desc all = {{{m.set[0], JSL_READ}, {m.set[1], JSL_READ}, {m.set[2], JSL_READ}}};
    jsl_query query;
    assert_ok(jsl_query_create(stage.ecs, &all, &query));
    jsl_iter it = jsl_query_begin(stage.ecs, query, 0);
    assert_true(jsl_query_next(&it, &rows));
    assert_i64(rows.count, 50);
    const jsl_position_columns p = jsl_position_of(&rows, 0);
    const jsl_velocity_columns v = jsl_velocity_of(&rows, 1);
    const jsl_boid_columns b = jsl_boid_of(&rows, 2);
    const double r[3] = {5, 7.5, 9}, c[3] = {-0.707, 0.7, -0.15};
    int fresh = 0;
    for (int i = 0; i < 50; i++) {
        uint32_t n = 0;
        for (int k = 0; k < 50; k++) {
            const jsl_vec3 d = jsl_v3(p.px[k] - p.px[i], p.py[k] - p.py[i], p.pz[k] - p.pz[i]);
            const double l = (double)jsl_length(d);
            const double cosine =
                (double)jsl_dot(d, jsl_normalize(jsl_v3(v.vx[i], v.vy[i], v.vz[i]))) / l;
            bool sees = l < 1.5;
            for (int q = 0; q < 3; q++) sees |= l <= r[q] && cosine > c[q];
            n += k != i && sees;
        }
        assert_int_equal(b.neighbours[i], n);
        fresh += p.px[i] == 1 && p.py[i] == 2 && p.pz[i] == 3;
    }
    assert_int_equal(fresh, 1);
}

static void running_out_of_memory_skips_a_step_and_says_so(void **state) {
    (void)state;
    int warned = 0, clean = 0;
    for (int i = 1; i < 40; i++) {
        flock_stage s;
        flock_stage_open(&s, 1, JSL_ISA_AUTO);
        jsl_flock flock = flock_stage_flock(&s, &(jsl_flock_desc){0});
        jsl_boid_spawn spawn = {.radius = 10, .velocity_spread = 3};
        assert_ok(jsl_flock_room_boid_create_n(s.room, 1, flock, 3000, &spawn, NULL));
        s.heap.fail_at = s.heap.calls + i;
        s.context.dt = JSL_R(1.0 / 60);
        for (int k = 0; k < JSL_STAGE_COUNT; k++) {
            jsl_result r = jsl_schedule_run(s.ecs, (jsl_stage)k, &s.context);
            assert_true(r == JSL_OK || r == JSL_ERR_MEMORY);
        }
        const bool skipped = s.warnings.count[JSL_WARN_OUT_OF_MEMORY] > 0;
        warned += skipped;
        clean += s.heap.failures == 0;
        assert_ok(jsl_ecs_validate(s.ecs, &(jsl_ecs_report){0}));
        s.heap.fail_at = 0;
        flock_stage_step(&s, JSL_R(1.0 / 60));
        flock_stage_close(&s);
    }
    assert_true(warned > 5 && clean > 0);
}

int main(void) {
#define TEST(f) cmocka_unit_test_setup_teardown(f, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(defaults_are_those_of_the_header),
        TEST(settings_come_back_as_they_went_in),
        TEST(every_bad_field_is_named),
        TEST(bad_settings_leave_the_old_ones),
        TEST(stale_and_foreign_handles_are_refused),
        TEST(bad_spawns_make_nobody),
        TEST(bad_paths_are_refused),
        TEST(spawns_fill_their_shape_and_depend_on_seed_and_entity_alone),
        TEST(a_dead_leader_leads_nobody),
        TEST(boids_may_come_and_go_between_and_during_steps),
        TEST(boids_made_after_the_index_are_seen_in_the_same_step),
        TEST(running_out_of_memory_skips_a_step_and_says_so),
    };
    return cmocka_run_group_tests_name("flock_room", tests, NULL, NULL);
}
