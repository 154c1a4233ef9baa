/* SPDX-License-Identifier: MIT
 * Kinematic response of particles against closed forms.
 */
#include "particle_stage.h"

static jsl_emitter emitter_of(particle_stage *s, const jsl_emitter_desc *desc) {
    jsl_emitter e;
    assert_ok(jsl_particle_room_emitter_create(s->room, desc, &e));
    return e;
}

/* One particle of an emitter with this desc. */
static void put_one(particle_stage *s, const jsl_emitter_desc *desc, jsl_vec3 x, jsl_vec3 v) {
    jsl_rows rows;
    particle_stage_spawn(s, emitter_of(s, desc), 1, 0, &rows);
    particle_put(&rows, 0, x, v);
}

static void look(const particle_stage *s, jsl_vec3 *x, jsl_vec3 *v) {
    jsl_rows rows;
    assert_true(particle_stage_rows(s, &rows));
    *x = particle_position(&rows, 0);
    *v = particle_velocity(&rows, 0);
}

/* v' = v - (1+k)(v.N)N off planes of any direction, without gravity: to a few units in the last
 * place of |v|. */
static void a_plane_reflects_as_the_formula_says(void **state) {
    (void)state;
    uint64_t seed = 5;
    for (int i = 0; i < 200; i++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        s.context.gravity = jsl_v3(0, 0, 0);
        jsl_real k = (jsl_real)test_uniform(&seed, 0, 1);
        jsl_vec3 axis = {(jsl_real)test_uniform(&seed, -1, 1), (jsl_real)test_uniform(&seed, -1, 1),
                         (jsl_real)test_uniform(&seed, -1, 1)};
        jsl_quat q = jsl_quat_from_rotation_vector(jsl_scale(axis, 3));
        jsl_vec3 n = jsl_rotate(q, jsl_v3(0, 0, 1));
        particle_stage_collider(&s, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE},
                                (jsl_pose){{0, 0, 0}, q}, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
        jsl_vec3 v = {(jsl_real)test_uniform(&seed, -5, 5), (jsl_real)test_uniform(&seed, -5, 5),
                      (jsl_real)test_uniform(&seed, -5, 5)};
        if (jsl_dot(v, n) > 0) v = jsl_neg(v);
        jsl_vec3 x = jsl_scale(n, JSL_R(0.001)), x1, v1;
        if (jsl_dot(v, n) > JSL_R(-0.5)) v = jsl_mul_add(v, JSL_R(-1.0), n);
        put_one(&s, &(jsl_emitter_desc){.restitution = k}, x, v);
        particle_stage_step(&s);
        look(&s, &x1, &v1);
        jsl_vec3 want = jsl_mul_add(v, -(1 + k) * jsl_dot(v, n), n);
        assert_close_v3(v1, want, 16 * JSL_REAL_EPSILON * jsl_length(v));
        /* It left the plane at the instant of crossing: d1 = -k vn (h - t), t = d0 / -vn. */
        jsl_real vn = jsl_dot(v, n), d0 = jsl_dot(x, n), h = s.context.dt;
        assert_close(jsl_dot(x1, n), -k * vn * (h + d0 / vn), 32 * JSL_REAL_EPSILON);
        particle_stage_close(&s);
    }
}

/* Highest point reached between bounces, exactly: z + v_z^2 / 2g, at the first step on the way up.
 */
static void bounce_heights_fall_by_the_square_of_the_restitution(void **state) {
    (void)state;
    const double e = 0.8, h0 = 2, g = (double)JSL_R(9.81);
    for (int m = 0; m < JSL_PARTICLE_INTEGRATOR_COUNT; m++) {
        if (m == JSL_PARTICLE_SEMI_IMPLICIT || m == JSL_PARTICLE_EXPLICIT) continue;
        particle_stage s;
        particle_stage_open(&s, 1);
        particle_stage_ground(&s);
        jsl_emitter_desc d = {.integrator = (jsl_particle_integrator)m, .restitution = (jsl_real)e};
        put_one(&s, &d, jsl_v3(0, 0, (jsl_real)h0), jsl_v3(0, 0, 0));
        double want = h0;
        jsl_real last = 0;
        int bounces = 0;
        for (int i = 0; i < 400 && bounces < 7; i++) {
            jsl_vec3 x, v;
            particle_stage_step(&s);
            look(&s, &x, &v);
            if (v.z > 0 && last <= 0) {
                bounces++;
                want *= (double)(JSL_R(0.8) * JSL_R(0.8));
                /* Every step rounds height and speed; a bounce turns an error of position into one
                 * of time. */
                double top = (double)x.z + (double)v.z * (double)v.z / (2 * g);
                assert_close(top, want, 2000 * h0 * (double)JSL_REAL_EPSILON);
            }
            last = v.z;
        }
        assert_i64(bounces, 7);
        particle_stage_close(&s);
    }
}

static void many_elastic_bounces_keep_the_energy(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_ground(&s);
    put_one(&s, &(jsl_emitter_desc){.restitution = 1}, jsl_v3(0, 0, 1), jsl_v3(1, 0, 0));
    jsl_vec3 x, v;
    jsl_real last = 0;
    int bounces = 0;
    for (int i = 0; i < 600000 && bounces < 10000; i++) {
        particle_stage_step(&s);
        look(&s, &x, &v);
        bounces += v.z > 0 && last <= 0;
        last = v.z;
    }
    double g = (double)JSL_R(9.81), energy = g * (double)x.z + 0.5 * (double)v.z * (double)v.z;
    assert_close(energy / g, 1, jsl_is_double() ? 1e-10 : 1e-2);
    assert_true(v.x == 1);
    particle_stage_close(&s);
}

/* 10^5 steps on the ground, for every integrator, gently tilted too: it must neither sink, nor hop,
 * nor slide. */
static void a_resting_particle_neither_sinks_nor_hops(void **state) {
    (void)state;
    for (int m = 0; m < JSL_PARTICLE_INTEGRATOR_COUNT; m++)
        for (int tilted = 0; tilted < 2; tilted++) {
            particle_stage s;
            particle_stage_open(&s, 1);
            jsl_pose pose = {{0, 0, 0}, {0, 0, 0, 1}};
            if (tilted) pose.orientation = jsl_quat_from_rotation_vector(jsl_v3(0, JSL_R(0.3), 0));
            particle_stage_collider(&s, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, pose,
                                    jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
            jsl_vec3 n = jsl_rotate(pose.orientation, jsl_v3(0, 0, 1));
            /* tan 0.3 = 0.309 < 0.5: Coulomb's cone holds it. */
            jsl_emitter_desc d = {.integrator = (jsl_particle_integrator)m,
                                  .restitution = JSL_R(0.6),
                                  .friction = JSL_R(0.5)};
            put_one(&s, &d, jsl_scale(n, JSL_R(0.02)), jsl_v3(0, 0, 0));
            for (int i = 0; i < 200; i++) particle_stage_step(&s);
            /* Explicit Euler drifts before it kicks, so that the ground answers a kick one step
             * later. */
            jsl_real slow = m == JSL_PARTICLE_EXPLICIT ? JSL_R(0.1636) : JSL_R(1e-6);
            jsl_vec3 x0, x, v;
            look(&s, &x0, &v);
            for (int i = 0; i < (m ? 10000 : 100000); i++) {
                particle_stage_step(&s);
                look(&s, &x, &v);
                jsl_real d1 = jsl_dot(x, n);
                if (jsl_abs(d1) > 16 * JSL_REAL_EPSILON || jsl_length(v) > slow) break;
            }
            /* Coordinates below 1: the projection rounds a few products of that size. */
            assert_close(jsl_dot(x, n), 0, 16 * JSL_REAL_EPSILON);
            assert_close(jsl_length(v), 0, slow);
            assert_close_v3(x, x0, 1e-5);
            particle_stage_close(&s);
        }
}

static void bouncing_comes_to_rest_in_the_time_of_the_series(void **state) {
    (void)state;
    /* h = 1, e = 0.5: sqrt(2h/g)(1+e)/(1-e) = 1.35457 s for infinitely many bounces; we stop at
     * most a few steps before. */
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_set_dt(&s, 1.0 / 240);
    particle_stage_ground(&s);
    put_one(&s, &(jsl_emitter_desc){.restitution = JSL_R(0.5)}, jsl_v3(0, 0, 1), jsl_v3(0, 0, 0));
    int last = 0;
    for (int i = 0; i < 480; i++) {
        jsl_vec3 x, v;
        particle_stage_step(&s);
        look(&s, &x, &v);
        if (x.z > JSL_R(1e-6) || jsl_abs(v.z) > JSL_R(1e-6)) last = i + 1;
    }
    assert_close(last / 240.0, 1.35457092295719, 5.0 / 240);
    particle_stage_close(&s);
}

static void friction_brakes_a_sliding_particle_by_mu_g(void **state) {
    (void)state;
    /* v = v0 - mu g t until it stops at v0^2 / (2 mu g). */
    const double mu = 0.25, v0 = 3, g = (double)JSL_R(9.81);
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_ground(&s);
    put_one(&s, &(jsl_emitter_desc){.friction = (jsl_real)mu}, jsl_v3(0, 0, 0),
            jsl_v3((jsl_real)v0, 0, 0));
    jsl_vec3 x, v;
    for (int i = 0; i < 30; i++) particle_stage_step(&s);
    look(&s, &x, &v);
    assert_close(v.x, v0 - mu * g * 0.5, 30 * 4 * (double)JSL_REAL_EPSILON * v0);
    for (int i = 0; i < 90; i++) particle_stage_step(&s);
    look(&s, &x, &v);
    assert_true(v.x == 0);
    /* Steps brake evenly and the last one stops within itself: the path is exact. */
    assert_close(x.x, v0 * v0 / (2 * mu * g), 120 * 4 * (double)JSL_REAL_EPSILON * v0);
    particle_stage_close(&s);
}

static void friction_at_a_bounce_follows_the_impulse(void **state) {
    (void)state;
    /* Tangential speed shrinks by mu (1+e) |vn|: 4 - 0.2 * 1.5 * 2 = 3.4; with mu = 10 it sticks.
     */
    for (int i = 0; i < 2; i++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        s.context.gravity = jsl_v3(0, 0, 0);
        particle_stage_ground(&s);
        jsl_emitter_desc d = {.restitution = JSL_R(0.5), .friction = i ? 10 : JSL_R(0.2)};
        put_one(&s, &d, jsl_v3(0, 0, JSL_R(0.01)), jsl_v3(4, 0, -2));
        particle_stage_step(&s);
        jsl_vec3 x, v;
        look(&s, &x, &v);
        assert_close(v.x, i ? 0 : 3.4, 16 * (double)JSL_REAL_EPSILON);
        assert_close(v.z, 1, 16 * (double)JSL_REAL_EPSILON);
        particle_stage_close(&s);
    }
}

static const jsl_shape_desc ball = {.kind = JSL_SHAPE_SPHERE, .radius = 1};
static const jsl_shape_desc cube = {.kind = JSL_SHAPE_BOX, .half = {1, 1, 1}};
static const jsl_shape_desc pill = {.kind = JSL_SHAPE_CAPSULE, .radius = 1, .half = {0, 0, 1}};

static void moving_colliders_impart_their_velocity(void **state) {
    (void)state;
    /* A collider at speed 3 along x meets a particle at rest: it leaves at (1+e) 3. The particle is
     * hit face on. */
    const jsl_shape_desc shapes[] = {ball, cube, pill};
    for (int i = 0; i < 3; i++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        s.context.gravity = jsl_v3(0, 0, 0);
        particle_stage_collider(&s, shapes[i], (jsl_pose){0}, jsl_v3(3, 0, 0), jsl_v3(0, 0, 0));
        put_one(&s, &(jsl_emitter_desc){.restitution = JSL_R(0.5)}, jsl_v3(JSL_R(1.02), 0, 0),
                jsl_v3(0, 0, 0));
        particle_stage_step(&s);
        jsl_vec3 x, v;
        look(&s, &x, &v);
        assert_close(v.x, 4.5, 64 * (double)JSL_REAL_EPSILON);
        assert_close(v.y, 0, 64 * (double)JSL_REAL_EPSILON);
        /* Met after 0.02 / 3 s; then 4.5 m/s for what is left of the step. */
        assert_close(x.x, 1.02 + 4.5 * (1.0 / 60 - 0.02 / 3), 64 * (double)JSL_REAL_EPSILON);
        particle_stage_close(&s);
    }
}

static void a_turning_collider_imparts_the_speed_of_its_surface(void **state) {
    (void)state;
    /* A ball turning about z at 5 rad/s, touched on its equator: the surface moves at (0,5,0)
     * there; with much friction the particle takes it over. */
    particle_stage s;
    particle_stage_open(&s, 1);
    s.context.gravity = jsl_v3(0, 0, 0);
    particle_stage_collider(&s, ball, (jsl_pose){0}, jsl_v3(0, 0, 0), jsl_v3(0, 0, 5));
    put_one(&s, &(jsl_emitter_desc){.restitution = 1, .friction = 100}, jsl_v3(JSL_R(1.01), 0, 0),
            jsl_v3(-2, 0, 0));
    particle_stage_step(&s);
    jsl_vec3 x, v;
    look(&s, &x, &v);
    assert_close(v.x, 2, 64 * (double)JSL_REAL_EPSILON);
    assert_close(v.y, 5, 64 * (double)JSL_REAL_EPSILON);
    particle_stage_close(&s);
}

static void a_rising_floor_carries_what_rests_on_it(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_collider(&s, cube, (jsl_pose){{0, 0, -1}, {0, 0, 0, 1}}, jsl_v3(0, 0, 2),
                            jsl_v3(0, 0, 0));
    put_one(&s, &(jsl_emitter_desc){.friction = 1}, jsl_v3(JSL_R(0.25), 0, JSL_R(0.001)),
            jsl_v3(0, 0, 0));
    jsl_vec3 x, v;
    for (int i = 0; i < 120; i++) {
        particle_stage_step(&s);
        look(&s, &x, &v);
        jsl_real top = s.set.item.at[0].pose.position.z + 1;
        assert_close(x.z, top, 1e-5);
    }
    assert_close(v.z, 2, 1e-5);
    assert_close(x.z, 4, 1e-4);
    particle_stage_close(&s);
}

static void fast_particles_do_not_tunnel(void **state) {
    (void)state;
    /* 200 m/s: 3.3 m a step, through a ball, a box and a capsule of 0.2 m. */
    const jsl_shape_desc shapes[] = {
        {.kind = JSL_SHAPE_SPHERE, .radius = JSL_R(0.1)},
        {.kind = JSL_SHAPE_BOX, .half = {1, 1, JSL_R(0.1)}},
        {.kind = JSL_SHAPE_CAPSULE, .radius = JSL_R(0.1), .half = {0, 0, JSL_R(0.2)}}};
    for (int i = 0; i < 3; i++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        particle_stage_collider(&s, shapes[i], (jsl_pose){0}, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
        put_one(&s, &(jsl_emitter_desc){.restitution = 1}, jsl_v3(0, 0, 5), jsl_v3(0, 0, -200));
        jsl_vec3 x, v;
        for (int k = 0; k < 3; k++) particle_stage_step(&s);
        look(&s, &x, &v);
        assert_true(v.z > 199);
        assert_true(x.z > 0);
        particle_stage_close(&s);
    }
}

static void particles_with_a_radius_touch_with_their_skin(void **state) {
    (void)state;
    const jsl_shape_desc shapes[] = {ball, cube, pill};
    for (int i = 0; i < 4; i++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        jsl_real top = i == 2 ? 2 : 1;
        if (i < 3) {
            particle_stage_collider(&s, shapes[i], (jsl_pose){0}, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
        } else {
            particle_stage_ground(&s);
            top = 0;
        }
        /* size 0.05 * 0.5 */
        put_one(&s, &(jsl_emitter_desc){.contact_size = JSL_R(0.5), .friction = 1},
                jsl_v3(0, 0, top + JSL_R(0.2)), jsl_v3(0, 0, 0));
        jsl_vec3 x, v;
        for (int k = 0; k < 120; k++) particle_stage_step(&s);
        look(&s, &x, &v);
        assert_close(x.z, (double)top + 0.025, 16 * (double)JSL_REAL_EPSILON * 3);
        assert_close(jsl_length(v), 0, 1e-6);
        particle_stage_close(&s);
    }
}

static void masks_and_ghosts_pass_through(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        particle_stage_ground(&s);
        particle_stage_collider(&s, cube, (jsl_pose){{0, 0, 3}, {0, 0, 0, 1}}, jsl_v3(0, 0, 0),
                                jsl_v3(0, 0, 0));
        jsl_emitter_desc d = {.ghost = i == 0, .mask = i == 1 ? 2 : 0, .category = i == 2 ? 4 : 0};
        if (i == 2) s.set.item.at[0].mask = s.set.item.at[1].mask = ~4u;
        put_one(&s, &d, jsl_v3(0, 0, 5), jsl_v3(0, 0, 0));
        jsl_vec3 x, v;
        for (int k = 0; k < 120; k++) particle_stage_step(&s);
        look(&s, &x, &v);
        assert_close(x.z, 5 - 9.81 * 2, 1e-3);
        particle_stage_close(&s);
    }
}

static void a_corner_of_planes_holds_a_particle(void **state) {
    (void)state;
    /* A V of two planes at 45 degrees: the particle ends in the groove. */
    particle_stage s;
    particle_stage_open(&s, 1);
    for (int side = -1; side <= 1; side += 2) {
        jsl_quat q = jsl_quat_from_rotation_vector(jsl_v3(0, (jsl_real)side * JSL_PI / 4, 0));
        particle_stage_collider(&s, (jsl_shape_desc){.kind = JSL_SHAPE_PLANE},
                                (jsl_pose){{0, 0, 0}, q}, jsl_v3(0, 0, 0), jsl_v3(0, 0, 0));
    }
    put_one(&s, &(jsl_emitter_desc){.restitution = JSL_R(0.3), .friction = JSL_R(0.4)},
            jsl_v3(JSL_R(0.3), 0, 1), jsl_v3(0, 0, 0));
    jsl_vec3 x, v;
    for (int k = 0; k < 600; k++) particle_stage_step(&s);
    look(&s, &x, &v);
    assert_close_v3(x, jsl_v3(0, 0, 0), 0.01);
    assert_close(jsl_length(v), 0, 0.01);
    particle_stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plane_reflects_as_the_formula_says),
        cmocka_unit_test(bounce_heights_fall_by_the_square_of_the_restitution),
        cmocka_unit_test(many_elastic_bounces_keep_the_energy),
        cmocka_unit_test(a_resting_particle_neither_sinks_nor_hops),
        cmocka_unit_test(bouncing_comes_to_rest_in_the_time_of_the_series),
        cmocka_unit_test(friction_brakes_a_sliding_particle_by_mu_g),
        cmocka_unit_test(friction_at_a_bounce_follows_the_impulse),
        cmocka_unit_test(moving_colliders_impart_their_velocity),
        cmocka_unit_test(a_turning_collider_imparts_the_speed_of_its_surface),
        cmocka_unit_test(a_rising_floor_carries_what_rests_on_it),
        cmocka_unit_test(fast_particles_do_not_tunnel),
        cmocka_unit_test(particles_with_a_radius_touch_with_their_skin),
        cmocka_unit_test(masks_and_ghosts_pass_through),
        cmocka_unit_test(a_corner_of_planes_holds_a_particle),
    };
    return cmocka_run_group_tests_name("particle bounce", tests, NULL, NULL);
}
