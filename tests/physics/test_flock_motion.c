/* SPDX-License-Identifier: MIT
 * Flocks over time: leaders on their path, and nobody inside an obstacle.
 */
#include "flock_stage.h"

#include "flock/room.h"

#include <stdio.h>

static const jsl_vec3 loop[] = {{30, 0, 0}, {20, 25, 6}, {-10, 20, 12}, {-30, -5, 4}, {0, -25, -6}};

/* Distance from p to the curve, by looking closely at it. */
static jsl_real off_path(jsl_vec3 p, const jsl_vec3 *point, int count) {
    jsl_real best = JSL_R(1e9);
    for (int i = 0; i < count * 2000; i++) {
        jsl_vec3 at, rate;
        jsl_flock_spline(point, count, (jsl_real)i / 2000, &at, &rate);
        best = jsl_min(best, jsl_length(jsl_sub(p, at)));
    }
    return best;
}

static void the_spline_passes_its_waypoints_smoothly(void **state) {
    (void)state;
    for (int i = 0; i < 5; i++) {
        jsl_vec3 at, rate, before, after, way;
        jsl_flock_spline(loop, 5, (jsl_real)i, &at, &rate);
        assert_close_v3(at, loop[i], 1e-5);
        /* The derivative at a waypoint is half the chord between its neighbours, from both sides.
         */
        way = jsl_scale(jsl_sub(loop[(i + 1) % 5], loop[(i + 4) % 5]), JSL_R(0.5));
        assert_close_v3(rate, way, 1e-4);
        const jsl_real h = JSL_R(0.001);
        jsl_flock_spline(loop, 5, (jsl_real)(i ? i : 5) - h, &before, &rate);
        assert_close_v3(rate, way, 1);
        jsl_flock_spline(loop, 5, (jsl_real)i + h, &after, &rate);
        assert_close_v3(jsl_scale(jsl_sub(after, before), 1 / (2 * h)), way, 0.1);
    }
}

static void a_leader_stays_on_its_path_at_its_speed(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock flock = flock_stage_flock(&s, &(jsl_flock_desc){.leader_gap = 2});
    jsl_entity boid[60];
    jsl_boid_spawn spawn = {.centre = {30, 0, 0}, .radius = 10, .velocity = {0, 3, 0}};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 5, flock, 60, &spawn, boid));
    assert_ok(jsl_flock_room_set_path(s.room, flock, loop, 5, 6));
    assert_ok(jsl_flock_room_set_leader(s.room, flock, boid[7]));
    jsl_vec3 last = loop[0];
    double length = 0, far = 0;
    const jsl_real dt = JSL_R(1.0 / 60);
    for (int i = 0; i < 3600; i++) {
        flock_stage_step(&s, dt);
        const boid_state leader = flock_stage_see(&s, boid[7]);
        const double way = (double)jsl_length(jsl_sub(leader.p, last));
        /* A chord is shorter than its arc by way^3 k^2/24, and the bends have radii above 5 m. */
        assert_close(way, 0.1, 1e-4);
        assert_close(jsl_length(leader.v), 6, 1e-4);
        if (i % 100 == 0) assert_true(off_path(leader.p, loop, 5) < JSL_R(0.02));
        length += way;
        last = leader.p;
        if (i < 1200 || i % 10) continue;
        for (int k = 0; k < 60; k++)
            far = fmax(far, (double)jsl_length(jsl_sub(flock_stage_see(&s, boid[k]).p, leader.p)));
    }
    assert_close(length, 360, 0.1);
    print_message("farthest follower %.1f m\n", far);
    assert_true(far > 2 && far < 25); /* the others are with it, but not on it */
    /* Long paths have a second component. */
    jsl_vec3 ring[32];
    for (int i = 0; i < 32; i++) {
        jsl_real x, y;
        jsl_sin_cos((jsl_real)i * JSL_PI / 16, &y, &x);
        ring[i] = jsl_v3(40 * x, 40 * y, 0);
    }
    assert_ok(jsl_flock_room_set_path(s.room, flock, ring, 32, 10));
    for (int i = 0; i < 2000; i++) {
        flock_stage_step(&s, dt);
        if (i % 50) continue;
        /* Chord error of the spline on a circle of 32 points: R (pi/16)^4 / 100 or so. */
        const jsl_vec3 p = flock_stage_see(&s, boid[7]).p;
        assert_close(jsl_length(p), 40, 0.01);
        assert_close(p.z, 0, 1e-5);
    }
    /* Without a leader the rest flies on, and the old one is a boid again. */
    assert_ok(jsl_flock_room_set_leader(s.room, flock, (jsl_entity){0}));
    flock_stage_step(&s, dt);
    assert_true(jsl_length(flock_stage_see(&s, boid[7]).v) <= 9.001);
    flock_stage_close(&s);
}

/* Smallest distance of any boid's centre to the surface of any obstacle over a run. */
static double clearance(flock_stage *s, const jsl_entity *boid, int n, double seconds) {
    const jsl_real dt = JSL_R(1.0 / 60);
    jsl_real least = JSL_R(1e9);
    for (int i = 0; i < (int)(seconds * 60); i++) {
        flock_stage_step(s, dt);
        for (int b = 0; b < n; b++) {
            const jsl_vec3 p = flock_stage_see(s, boid[b]).p;
            assert_true(jsl_v3_is_finite(p));
            for (int64_t o = 0; o < s->set.item.count; o++) {
                const jsl_collider_item *item = &s->set.item.at[o];
                jsl_vec3 normal;
                least =
                    jsl_min(least, jsl_shape_point_distance(&item->shape, item->pose, p, &normal));
            }
        }
    }
    return (double)least;
}

static const jsl_flock_desc careful = {.max_speed = 6,
                                       .min_speed = 2,
                                       .max_accel = 25,
                                       .boid_radius = JSL_R(0.1),
                                       .avoid_margin = JSL_R(0.5),
                                       .avoid_horizon = JSL_R(2.5),
                                       .bounds_lo = {-30, -30, 2},
                                       .bounds_hi = {30, 30, 18}};

static void two_hundred_boids_among_pillars_touch_none(void **state) {
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        flock_stage s;
        flock_stage_open(&s, 2, JSL_ISA_AUTO);
        jsl_flock_desc desc = careful;
        desc.negotiation = JSL_FLOCK_PRIORITY;
        jsl_flock flock = flock_stage_flock(&s, &desc);
        jsl_entity boid[200];
        jsl_boid_spawn spawn = {.centre = {-25, 0, 10},
                                .half = {4, 12, 6},
                                .velocity = {4, 0, 0},
                                .velocity_spread = 1};
        assert_ok(jsl_flock_room_boid_create_n(s.room, 5, flock, 200, &spawn, boid));
        for (int i = 0; i < 25; i++) {
            const jsl_real x = (jsl_real)(i % 5 - 2) * 8 + (i / 5 % 2 ? 4 : 0),
                           y = (jsl_real)(i / 5 - 2) * 8;
            const jsl_shape_desc shape[] = {
                {.kind = JSL_SHAPE_BOX, .half = {1, 1, 15}},
                {.kind = JSL_SHAPE_CAPSULE, .radius = 1, .half = {0, 0, 15}},
                {.kind = JSL_SHAPE_SPHERE, .radius = 2}};
            flock_stage_obstacle(&s, shape[kind], (jsl_pose){.position = {x, y, 10}},
                                 jsl_v3(0, 0, 0));
        }
        const double least = clearance(&s, boid, 200, 30);
        print_message("pillars of kind %d: clearance %.3f m (margin 0.5 m, radius 0.1 m)\n", kind,
                      least);
        assert_true(least > 0.1);
        flock_stage_close(&s);
    }
}

static void boids_stay_above_ground_and_off_walls(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 2, JSL_ISA_AUTO);
    jsl_flock_desc desc = careful;
    desc.urge = jsl_v3(0, 0, -3);
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity boid[200];
    jsl_boid_spawn spawn = {.centre = {0, 0, 10}, .half = {15, 15, 5}, .velocity_spread = 4};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 5, flock, 200, &spawn, boid));
    flock_stage_obstacle(&s, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE},
                         (jsl_pose){.position = {0, 0, 0}}, jsl_v3(0, 0, 0));
    /* A broad flat wall: no sphere and no capsule resembles it. */
    flock_stage_obstacle(&s, (jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {JSL_R(0.5), 10, 9}},
                         (jsl_pose){.position = {20, 0, 9}}, jsl_v3(0, 0, 0));
    const double least = clearance(&s, boid, 200, 30);
    print_message("ground and wall: clearance %.3f m\n", least);
    assert_true(least > 0.1);
    flock_stage_close(&s);
}

static void boids_dodge_what_comes_at_them(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 2, JSL_ISA_AUTO);
    jsl_flock_desc desc = careful;
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity boid[100];
    jsl_boid_spawn spawn = {
        .centre = {10, 0, 10}, .radius = 8, .velocity = {-3, 0, 0}, .velocity_spread = 1};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 5, flock, 100, &spawn, boid));
    for (int i = 0; i < 4; i++)
        flock_stage_obstacle(
            &s, (jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = JSL_R(1.5)},
            (jsl_pose){.position = {JSL_R(-20.0) - 10 * (jsl_real)i, (jsl_real)(i - 2) * 3, 10}},
            jsl_v3(3, 0, 0));
    const double least = clearance(&s, boid, 100, 25);
    print_message("moving spheres: clearance %.3f m\n", least);
    assert_true(least > 0.1);
    flock_stage_close(&s);
}

/* The demonstration of Reynolds' allocation: a flock aimed at a pillar splits and comes together
 * again. */
static void a_flock_splits_round_a_pillar(void **state) {
    (void)state;
    flock_stage s;
    flock_stage_open(&s, 1, JSL_ISA_AUTO);
    jsl_flock_desc desc = {
        .max_speed = 5, .min_speed = 3, .urge = {2, 0, 0}, .boid_radius = JSL_R(0.1)};
    jsl_flock flock = flock_stage_flock(&s, &desc);
    jsl_entity boid[80];
    jsl_boid_spawn spawn = {.centre = {-20, 0, 0}, .half = {4, 4, 4}, .velocity = {4, 0, 0}};
    assert_ok(jsl_flock_room_boid_create_n(s.room, 5, flock, 80, &spawn, boid));
    flock_stage_obstacle(
        &s, (jsl_shape_desc){.kind = JSL_SHAPE_CAPSULE, .radius = 2, .half = {0, 0, 40}},
        (jsl_pose){{0, 0, 0}, jsl_quat_identity()}, jsl_v3(0, 0, 0));
    int left = 0, right = 0;
    bool crossed[80] = {false};
    for (int i = 0; i < 60 * 20; i++) {
        flock_stage_step(&s, JSL_R(1.0 / 60));
        for (int k = 0; k < 80; k++) {
            const jsl_vec3 p = flock_stage_see(&s, boid[k]).p;
            assert_true(p.x * p.x + p.y * p.y > 4);
            if (crossed[k] || p.x < 0) continue;
            crossed[k] = true;
            left += p.y > 0;
            right += p.y < 0;
        }
    }
    print_message("%d went left, %d right\n", left, right);
    assert_int_equal(left + right, 80);
    assert_true(left >= 8 && right >= 8);
    flock_stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_spline_passes_its_waypoints_smoothly),
        cmocka_unit_test(a_leader_stays_on_its_path_at_its_speed),
        cmocka_unit_test(two_hundred_boids_among_pillars_touch_none),
        cmocka_unit_test(boids_stay_above_ground_and_off_walls),
        cmocka_unit_test(boids_dodge_what_comes_at_them),
        cmocka_unit_test(a_flock_splits_round_a_pillar),
    };
    return cmocka_run_group_tests_name("flock_motion", tests, NULL, NULL);
}
