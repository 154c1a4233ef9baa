/* SPDX-License-Identifier: MIT
 * What boids ask for and how it is negotiated: two and three boids worked out by hand.
 */
#include "flock_stage.h"

#include "ecs/ecs.h"

/* A few operations on numbers of order 30. */
#define TOLERANCE (64 * (double)JSL_REAL_EPSILON * 30)
#define DT JSL_R(0.1)

static jsl_flock_desc one_rule(int rule, jsl_flock_response response) {
    const jsl_flock_rule on = {10, 0, 2}, off = {0};
    return (jsl_flock_desc){.separation = rule == 0 ? on : off,
                            .alignment = rule == 1 ? on : off,
                            .cohesion = rule == 2 ? on : off,
                            .max_speed = 1000,
                            .max_accel = 1000,
                            .response = response};
}

static void expect(flock_stage *s, jsl_entity boid, double x, double y, double z) {
    assert_close_v3(flock_stage_see(s, boid).a, jsl_v3((jsl_real)x, (jsl_real)y, (jsl_real)z),
                    TOLERANCE);
}

/* Boid a at the origin flying along x, b at (3,0,4), c at (0,-2,0). */
typedef struct trio {
    flock_stage stage;
    jsl_flock flock;
    jsl_entity a, b, c;
} trio;
static void open_trio(trio *t, const jsl_flock_desc *desc) {
    flock_stage_open(&t->stage, 1, JSL_ISA_AUTO);
    t->flock = flock_stage_flock(&t->stage, desc);
    t->a = flock_stage_boid(&t->stage, t->flock, jsl_v3(0, 0, 0), jsl_v3(2, 0, 0));
    t->b = flock_stage_boid(&t->stage, t->flock, jsl_v3(3, 0, 4), jsl_v3(0, 1, 0));
    t->c = flock_stage_boid(&t->stage, t->flock, jsl_v3(0, -2, 0), jsl_v3(0, 0, 3));
}

static void separation_by_hand(void **state) {
    (void)state;
    trio t;
    for (int response = 0; response < JSL_FLOCK_RESPONSE_COUNT; response++) {
        jsl_flock_desc desc = one_rule(0, (jsl_flock_response)response);
        open_trio(&t, &desc);
        flock_stage_decide(&t.stage, DT);
        /* -sum d/|d|^2 = -(3,0,4)/25 - (0,-2,0)/4 = (-0.12, 0.5, -0.16) of length sqrt(0.29) */
        const double k = response == JSL_FLOCK_DIRECTION ? 2 / sqrt(0.29) : 2;
        expect(&t.stage, t.a, -0.12 * k, 0.5 * k, -0.16 * k);
        flock_stage_close(&t.stage);
    }
}

static void alignment_by_hand(void **state) {
    (void)state;
    trio t;
    jsl_flock_desc desc = one_rule(1, JSL_FLOCK_DIRECTION);
    open_trio(&t, &desc);
    flock_stage_decide(&t.stage, DT);
    /* Mean heading (0, 0.5, 0.5) less own (1,0,0): length sqrt(1.5). */
    expect(&t.stage, t.a, -2 / sqrt(1.5), 1 / sqrt(1.5), 1 / sqrt(1.5));
    flock_stage_close(&t.stage);
    desc = one_rule(1, JSL_FLOCK_MEAN);
    open_trio(&t, &desc);
    flock_stage_decide(&t.stage, DT);
    expect(&t.stage, t.a, -4, 1, 3); /* 2 ((0,1,3)/2 - (2,0,0)) */
    flock_stage_close(&t.stage);
    desc = one_rule(1, JSL_FLOCK_SUM);
    open_trio(&t, &desc);
    flock_stage_decide(&t.stage, DT);
    expect(&t.stage, t.a, -8, 2, 6);
    expect(&t.stage, t.b, 4, -4, 6); /* 2 ((2,0,3) - 2 (0,1,0)) */
    flock_stage_close(&t.stage);
}

static void cohesion_by_hand(void **state) {
    (void)state;
    trio t;
    const double k[] = {2 / sqrt(29), 1, 2}; /* of (3,-2,4): sum of offsets */
    for (int response = 0; response < JSL_FLOCK_RESPONSE_COUNT; response++) {
        jsl_flock_desc desc = one_rule(2, (jsl_flock_response)response);
        open_trio(&t, &desc);
        flock_stage_decide(&t.stage, DT);
        expect(&t.stage, t.a, 3 * k[response], -2 * k[response], 4 * k[response]);
        assert_int_equal(flock_stage_see(&t.stage, t.a).neighbours, 2);
        flock_stage_close(&t.stage);
    }
}

static void boids_behind_count_only_when_near(void **state) {
    (void)state;
    trio t;
    jsl_flock_desc desc = one_rule(2, JSL_FLOCK_SUM);
    desc.cohesion.half_angle = JSL_PI / 4;
    desc.near_distance = JSL_R(2.5);
    open_trio(&t, &desc);
    /* b is 53 degrees off the heading, c at right angles but near. */
    flock_stage_decide(&t.stage, DT);
    expect(&t.stage, t.a, 0, -4, 0);
    assert_int_equal(flock_stage_see(&t.stage, t.a).neighbours, 1);
    desc.cohesion.half_angle = JSL_PI / 3;
    assert_ok(jsl_flock_room_flock_set(t.stage.room, t.flock, &desc));
    flock_stage_decide(&t.stage, DT);
    expect(&t.stage, t.a, 6, -4, 8);
    flock_stage_close(&t.stage);
}

static void a_step_is_semi_implicit_and_clamped(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {.urge = {3, 0, 4}, .max_speed = 2, .min_speed = 1, .max_accel = 100};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity slow = flock_stage_boid(&s, flock, jsl_v3(0, 0, 0), jsl_v3(JSL_R(0.3), 0, 0));
    jsl_entity fast = flock_stage_boid(&s, flock, jsl_v3(500, 0, 0), jsl_v3(0, 0, 10));
    jsl_entity mid = flock_stage_boid(&s, flock, jsl_v3(0, 500, 0), jsl_v3(1, 1, 0));
    flock_stage_step(&s, DT);
    /* v + a dt = (1.3, 1, 0.4) is within the limits. */
    boid_state b = flock_stage_see(&s, mid);
    assert_close_v3(b.v, jsl_v3(JSL_R(1.3), 1, JSL_R(0.4)), TOLERANCE);
    assert_close_v3(b.p, jsl_v3(JSL_R(0.13), JSL_R(500.1), JSL_R(0.04)),
                    500 * (double)JSL_REAL_EPSILON);
    /* (0.6, 0, 0.4) is stretched to 1, (0.3, 0, 10.4) cut to 2. */
    b = flock_stage_see(&s, slow);
    assert_close_v3(b.v, jsl_scale(jsl_v3(JSL_R(0.6), 0, JSL_R(0.4)), 1 / jsl_sqrt(JSL_R(0.52))),
                    TOLERANCE);
    b = flock_stage_see(&s, fast);
    assert_close(jsl_length(b.v), 2, TOLERANCE);
    assert_close(b.v.x / b.v.z, 0.3 / 10.4, TOLERANCE);
    flock_stage_close(&s);
}

/* Separation asks for 6 along -x, cohesion for 8 along +x; alignment for nothing; the urge for 5
 * along y. */
static jsl_vec3 negotiated(jsl_flock_negotiation how, double budget) {
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {.separation = {10, 0, 6},
                           .cohesion = {10, 0, 8},
                           .urge = {0, 5, 0},
                           .max_speed = 100,
                           .max_accel = (jsl_real)budget,
                           .negotiation = how};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity a = flock_stage_boid(&s, flock, jsl_v3(0, 0, 0), jsl_v3(0, 0, 1));
    flock_stage_boid(&s, flock, jsl_v3(4, 0, 0), jsl_v3(0, 0, 1));
    flock_stage_decide(&s, DT);
    jsl_vec3 got = flock_stage_see(&s, a).a;
    flock_stage_close(&s);
    return got;
}

static void priority_spends_the_budget_in_order(void **state) {
    (void)state;
    const struct {
        double budget, x, y;
    } all[] = {
        {4, -4, 0},       /* separation alone, shortened */
        {6, -6, 0},       /* exactly what separation asks for */
        {10, -6 + 4, 0},  /* then half of cohesion */
        {14, -6 + 8, 0},  /* all of cohesion */
        {16, -6 + 8, 2},  /* and 2 of the urge */
        {100, -6 + 8, 5}, /* everything */
    };
    for (int i = 0; i < 6; i++)
        assert_close_v3(negotiated(JSL_FLOCK_PRIORITY, all[i].budget),
                        jsl_v3((jsl_real)all[i].x, (jsl_real)all[i].y, 0), TOLERANCE);
}

static void a_blend_cuts_the_sum(void **state) {
    (void)state;
    assert_close_v3(negotiated(JSL_FLOCK_BLEND, 100), jsl_v3(2, 5, 0), TOLERANCE);
    const double k = 4 / sqrt(29);
    assert_close_v3(negotiated(JSL_FLOCK_BLEND, 4), jsl_v3((jsl_real)(2 * k), (jsl_real)(5 * k), 0),
                    TOLERANCE);
}

static void avoidance_comes_before_everything(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {.urge = {5, 0, 0}, .max_speed = 10, .max_accel = 20};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    /* Flying at a wall 1 m away at 10 m/s: all of the budget goes into the turn. */
    flock_stage_obstacle(&s, (jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = 5},
                         (jsl_pose){.position = {JSL_R(6.0), JSL_R(0.5), 0}}, jsl_v3(0, 0, 0));
    jsl_entity a = flock_stage_boid(&s, flock, jsl_v3(0, 0, 0), jsl_v3(10, 0, 0));
    flock_stage_decide(&s, JSL_R(1.0 / 60));
    boid_state b = flock_stage_see(&s, a);
    assert_close(jsl_length(b.a), 20, TOLERANCE);
    assert_true(b.a.x < 0 && b.a.y < 0);
    flock_stage_close(&s);
}

static void symmetric_weights_keep_the_momentum(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 2, JSL_ISA_AUTO);
    const int n = 500;
    jsl_flock_desc desc = {.separation = {6, 0, JSL_R(0.5)},
                           .alignment = {6, 0, JSL_R(0.02)},
                           .cohesion = {6, 0, JSL_R(0.01)},
                           .max_speed = 1000,
                           .max_accel = JSL_R(1e6),
                           .response = JSL_FLOCK_SUM};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity boid[500];
    jsl_boid_spawn spawn = {.radius = 12, .velocity = {1, 2, -1}, .velocity_spread = 3};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 1, flock, n, &spawn, boid));
    double before[3] = {0}, after[3] = {0}, pushed = 0;
    for (int i = 0; i < n; i++) {
        jsl_vec3 v = flock_stage_see(&s, boid[i]).v;
        before[0] += (double)v.x, before[1] += (double)v.y, before[2] += (double)v.z;
    }
    for (int step = 0; step < 60; step++) flock_stage_step(&s, JSL_R(1.0 / 60));
    for (int i = 0; i < n; i++) {
        boid_state b = flock_stage_see(&s, boid[i]);
        after[0] += (double)b.v.x, after[1] += (double)b.v.y, after[2] += (double)b.v.z;
        pushed += (double)jsl_length(b.a);
    }
    assert_true(pushed > 100); /* they do act on each other */
    /* Each boid's velocity is rounded once a step, each acceleration about fifty times: errors of
     * 30 eps on speeds of 10 add up at random over 500 boids and 60 steps. */
    for (int k = 0; k < 3; k++)
        assert_close(after[k], before[k], 10 * 30 * (double)JSL_REAL_EPSILON * sqrt(500 * 60.0));
    flock_stage_close(&s);
}

static void boids_at_the_same_place_part(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {.max_speed = 5};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity a = flock_stage_boid(&s, flock, jsl_v3(1, 1, 1), jsl_v3(1, 0, 0));
    jsl_entity b = flock_stage_boid(&s, flock, jsl_v3(1, 1, 1), jsl_v3(1, 0, 0));
    for (int i = 0; i < 30; i++) flock_stage_step(&s, JSL_R(1.0 / 60));
    jsl_vec3 d = jsl_sub(flock_stage_see(&s, a).p, flock_stage_see(&s, b).p);
    assert_true(jsl_length(d) > JSL_R(0.5));
    flock_stage_close(&s);
}

static void bounds_pull_back_by_depth(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {
        .bounds_lo = {-10, -10, -10}, .bounds_hi = {10, 20, 30}, .bounds_weight = 2};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity in = flock_stage_boid(&s, flock, jsl_v3(9, 19, 29), jsl_v3(1, 0, 0));
    jsl_entity out = flock_stage_boid(&s, flock, jsl_v3(-13, 21, 34), jsl_v3(1, 0, 0));
    flock_stage_decide(&s, DT);
    expect(&s, in, 0, 0, 0);
    expect(&s, out, 6, -2, -8);
    flock_stage_close(&s);
}

static void an_odd_one_out_flies_straight_on(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {.urge = {1, 0, 0}};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity a = flock_stage_boid(&s, flock, jsl_v3(0, 0, 0), jsl_v3(0, 1, 0));
    assert_ok(jsl_flock_room_flock_destroy(s.room, flock));
    for (int i = 0; i < 10; i++) flock_stage_step(&s, DT);
    assert_close_v3(flock_stage_see(&s, a).p, jsl_v3(0, 1, 0), TOLERANCE);
    flock_stage_close(&s);
}

static void bad_state_is_frozen_and_named(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {0};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity boid[40];
    jsl_boid_spawn spawn = {.radius = 5, .velocity = {1, 0, 0}};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 1, flock, 40, &spawn, boid));
    jsl_component velocity;
    assert_ok(jsl_component_find(s.ecs, "velocity", &velocity));
    *(jsl_real *)jsl_entity_field(s.ecs, boid[17], velocity, 1) = (jsl_real)NAN;
    jsl_vec3 was = flock_stage_see(&s, boid[17]).p;
    flock_stage_step(&s, DT);
    assert_i64(s.warnings.count[JSL_WARN_BAD_STATE], 1);
    assert_true(jsl_entity_equal(s.warnings.first[JSL_WARN_BAD_STATE], boid[17]));
    assert_close_v3(flock_stage_see(&s, boid[17]).p, was, 0);
    for (int i = 0; i < 40; i++) {
        boid_state b = flock_stage_see(&s, boid[i]);
        assert_true(i == 17 || (jsl_v3_is_finite(b.p) && jsl_v3_is_finite(b.v)));
    }
    flock_stage_close(&s);
}

static void bad_values_in_the_component_are_warned_of(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {.urge = {1, 0, 0}};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity a = flock_stage_boid(&s, flock, jsl_v3(0, 0, 0), jsl_v3(0, 1, 0));
    jsl_component component;
    assert_ok(jsl_component_find(s.ecs, "flock", &component));
    *(jsl_real *)jsl_entity_field(s.ecs, flock.entity, component, 0) = (jsl_real)NAN;
    flock_stage_step(&s, DT);
    assert_i64(s.warnings.count[JSL_WARN_BAD_STATE], 1);
    assert_true(jsl_entity_equal(s.warnings.first[JSL_WARN_BAD_STATE], flock.entity));
    assert_close_v3(flock_stage_see(&s, a).v, jsl_v3(0, 1, 0), 0);
    flock_stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(separation_by_hand),
        cmocka_unit_test(alignment_by_hand),
        cmocka_unit_test(cohesion_by_hand),
        cmocka_unit_test(boids_behind_count_only_when_near),
        cmocka_unit_test(a_step_is_semi_implicit_and_clamped),
        cmocka_unit_test(priority_spends_the_budget_in_order),
        cmocka_unit_test(a_blend_cuts_the_sum),
        cmocka_unit_test(avoidance_comes_before_everything),
        cmocka_unit_test(symmetric_weights_keep_the_momentum),
        cmocka_unit_test(boids_at_the_same_place_part),
        cmocka_unit_test(bounds_pull_back_by_depth),
        cmocka_unit_test(an_odd_one_out_flies_straight_on),
        cmocka_unit_test(bad_state_is_frozen_and_named),
        cmocka_unit_test(bad_values_in_the_component_are_warned_of),
    };
    return cmocka_run_group_tests_name("flock_rules", tests, NULL, NULL);
}
