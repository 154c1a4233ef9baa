/* SPDX-License-Identifier: MIT
 * Births: counts, instants and attributes against what they must be on average, and exactly where
 * they can be.
 */
#include "particle_stage.h"

static jsl_emitter add(particle_stage *s, const jsl_emitter_desc *desc) {
    jsl_emitter e;
    assert_ok(jsl_particle_room_emitter_create(s->room, desc, &e));
    return e;
}

static void steps(particle_stage *s, int n) {
    for (int i = 0; i < n; i++) particle_stage_step(s);
}

static void fractions_of_a_birth_are_carried(void **state) {
    (void)state;
    /* 0.3 births a step for 1000 steps is 300; 250.5 for 10 is 2505. Rates are exact in binary. */
    const struct {
        double rate;
        int steps, want;
    } list[] = {{19.2, 1000, 300}, {16032, 10, 2505}, {1, 640, 10}, {0, 100, 0}};
    for (int i = 0; i < 4; i++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        particle_stage_set_dt(&s, 1.0 / 64);
        add(&s, &(jsl_emitter_desc){.rate = (jsl_real)list[i].rate});
        for (int k = 1; k <= list[i].steps; k++) {
            particle_stage_step(&s);
            double due = (double)(jsl_real)list[i].rate * k / 64;
            /* The integral of the rate is summed in double: at most one birth sits on the edge. */
            assert_true(fabs((double)particle_stage_count(&s) - due) < 1 + 1e-9);
        }
        assert_in_range(particle_stage_count(&s), list[i].want - (list[i].want > 0),
                        list[i].want + 1);
        particle_stage_close(&s);
    }
}

static void births_are_spread_evenly_inside_the_step(void **state) {
    (void)state;
    /* 8 a step, the first an eighth into it: ages 7/8, 6/8 .. 0 of a step. */
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_set_dt(&s, 0.125);
    add(&s, &(jsl_emitter_desc){.rate = 64, .life = 9, .speed = 2, .buoyancy = 1});
    particle_stage_step(&s);
    jsl_rows rows;
    assert_true(particle_stage_rows(&s, &rows));
    assert_i64(rows.count, 8);
    jsl_particle_columns q = jsl_particle_of(&rows, 2);
    for (int i = 0; i < 8; i++) {
        assert_close(q.age[i], (7 - i) / 64.0, 1e-7);
        /* Weightless: 2 m/s along z since its birth. */
        assert_close(particle_position(&rows, i).z, 2 * (7 - i) / 64.0, 1e-6);
    }
    particle_stage_close(&s);
}

/* Counts of births per frame of film, over n frames. */
static void count_frames(jsl_emit_mode mode, double mean, double range, int n, int per_frame,
                         double *out_mean, double *out_variance) {
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_set_dt(&s, 1.0 / (32 * per_frame));
    /* Short-lived, so that the population stays small: the serial number counts births. */
    jsl_emitter_desc d = {.mode = mode,
                          .rate = (jsl_real)(mean * 32),
                          .rate_range = (jsl_real)(range * 32),
                          .rate_frame = JSL_R(1.0 / 32),
                          .life = JSL_R(0.001)};
    jsl_emitter e = add(&s, &d);
    jsl_component c;
    assert_ok(jsl_component_find(s.ecs, "emitter", &c));
    uint64_t last = 0;
    double sum = 0, square = 0;
    for (int i = 0; i < n; i++) {
        steps(&s, per_frame);
        jsl_rows rows;
        assert_ok(jsl_rows_of_entity(s.ecs, e.entity, c, &rows));
        uint64_t serial = *jsl_emitter_of(&rows, 0).serial;
        double births = (double)(serial - last);
        last = serial;
        sum += births;
        square += births * births;
    }
    *out_mean = sum / n;
    *out_variance = square / n - sum / n * (sum / n);
    particle_stage_close(&s);
}

static void reeves_counts_have_their_mean_and_variance(void **state) {
    (void)state;
    /* Uniform on mean +- range: variance range^2/3. Whole births add the variance of the difference
     * of two fractions, 1/6. Standard errors: sd/sqrt(n), and sd^2 sqrt(0.8/n) for the variance of
     * a uniform law. */
    const int n = 4000;
    for (int per_frame = 1; per_frame <= 4; per_frame += 3) {
        double mean, variance;
        count_frames(JSL_EMIT_REEVES, 50, 30, n, per_frame, &mean, &variance);
        assert_close(mean, 50, 4 * sqrt(300.0 / n));
        assert_close(variance, 300 + 1.0 / 6, 4 * 300 * sqrt(0.8 / n));
    }
}

static void negative_reeves_counts_are_owed_and_do_not_bias_the_mean(void **state) {
    (void)state;
    /* Range 5 times the mean: clamping at 0 would give 2.4 times as many. */
    const int n = 20000;
    double mean, variance;
    count_frames(JSL_EMIT_REEVES, 4, 20, n, 1, &mean, &variance);
    assert_close(mean, 4, 4 * sqrt(400.0 / 3 / n));
}

static void poisson_counts_have_equal_mean_and_variance(void **state) {
    (void)state;
    const int n = 4000;
    double mean, variance;
    count_frames(JSL_EMIT_POISSON, 10, 0, n, 1, &mean, &variance);
    assert_close(mean, 10, 4 * sqrt(10.0 / n));
    assert_close(variance / mean, 1, 4 * sqrt(2.0 / n));
}

static void the_population_is_rate_times_life(void **state) {
    (void)state;
    /* Little's law; with Poisson births the population is Poisson too, whatever the law of lives
     * (M/G/infinity). */
    const jsl_emit_mode modes[] = {JSL_EMIT_STEADY, JSL_EMIT_POISSON};
    for (int m = 0; m < 2; m++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        particle_stage_set_dt(&s, 1.0 / 32);
        jsl_emitter e = add(&s, &(jsl_emitter_desc){.mode = modes[m],
                                                    .rate = 400,
                                                    .life = JSL_R(0.5),
                                                    .life_range = JSL_R(0.3),
                                                    .speed = 1});
        steps(&s, 64);
        /* Samples two lives apart are independent. */
        const int n = 400;
        double sum = 0, square = 0;
        for (int i = 0; i < n; i++) {
            steps(&s, 32);
            int64_t alive;
            assert_ok(jsl_particle_room_emitter_alive(s.room, e, &alive));
            assert_i64(alive, particle_stage_count(&s));
            sum += (double)alive;
            square += (double)alive * (double)alive;
        }
        double mean = sum / n, variance = square / n - mean * mean;
        assert_close(mean, 200, 4 * sqrt(200.0 / n));
        if (modes[m] == JSL_EMIT_POISSON) assert_close(variance / mean, 1, 4 * sqrt(2.0 / n));
        particle_stage_close(&s);
    }
}

static void refill_keeps_the_population_constant(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    add(&s, &(jsl_emitter_desc){.mode = JSL_EMIT_REFILL,
                                .max_particles = 1000,
                                .life = JSL_R(0.3),
                                .life_range = JSL_R(0.2)});
    for (int i = 0; i < 100; i++) {
        particle_stage_step(&s);
        assert_i64(particle_stage_count(&s), 1000);
    }
    assert_i64(s.warnings.count[JSL_WARN_PARTICLES_FULL], 0);
    particle_stage_close(&s);
}

/* An emitter that flies along x at 3 m/s; where were its particles born? */
static int64_t fly_emitter(double dt, int n, jsl_emit_mode mode, jsl_vec3 *out, int64_t cap) {
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_set_dt(&s, dt);
    jsl_emitter_desc d = {.mode = mode,
                          .rate = 400,
                          .rate_range = 300,
                          .buoyancy = 1,
                          .speed = 2,
                          .direction = {0, 1, 0},
                          .velocity = {3, 0, 0}};
    jsl_emitter e = add(&s, &d);
    for (int i = 0; i < n; i++) {
        jsl_real *px = jsl_entity_field(s.ecs, e.entity, s.position, 0);
        *px = (jsl_real)(3 * dt * (i + 1));
        particle_stage_step(&s);
    }
    jsl_rows rows;
    assert_true(particle_stage_rows(&s, &rows));
    assert_true(rows.count <= cap);
    int64_t count = rows.count;
    for (int64_t i = 0; i < count; i++) out[i] = particle_position(&rows, i);
    particle_stage_close(&s);
    return count;
}

static void a_moving_emitter_leaves_the_same_trail_at_any_step(void **state) {
    (void)state;
    enum { CAP = 4096 };
    static jsl_vec3 coarse[CAP], fine[CAP];
    const jsl_emit_mode modes[] = {JSL_EMIT_STEADY, JSL_EMIT_REEVES, JSL_EMIT_POISSON};
    for (int m = 0; m < 3; m++) {
        int64_t a = fly_emitter(1.0 / 30, 60, modes[m], coarse, CAP);
        int64_t b = fly_emitter(1.0 / 240, 480, modes[m], fine, CAP);
        /* dt in float is not 1/30: one birth may fall on either side of the end. Which of them is
         * the same, and so is where they are, not only how dense. */
        assert_in_range(a, b - 1, b + 1);
        assert_in_range(a, modes[m] == JSL_EMIT_STEADY ? 799 : 600, 1000);
        for (int64_t i = 0; i < (a < b ? a : b); i++) {
            double tol = jsl_is_double() ? 1e-6 : 1e-3;
            assert_close_v3(coarse[i], fine[i], tol);
        }
    }
}

static void bursts_come_at_once_and_limits_hold(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    jsl_emitter e = add(&s, &(jsl_emitter_desc){.max_particles = 150, .life = 1});
    assert_ok(jsl_particle_room_emit(s.room, e, 60));
    assert_ok(jsl_particle_room_emit(s.room, e, 40));
    assert_i64(particle_stage_count(&s), 0);
    particle_stage_step(&s);
    assert_i64(particle_stage_count(&s), 100);
    assert_ok(jsl_particle_room_emit(s.room, e, 1000000000));
    particle_stage_step(&s);
    assert_i64(particle_stage_count(&s), 150);
    assert_i64(s.warnings.count[JSL_WARN_PARTICLES_FULL], 1000000000 - 50);
    assert_true(jsl_entity_equal(s.warnings.first[JSL_WARN_PARTICLES_FULL], e.entity));
    particle_stage_step(&s);
    assert_i64(particle_stage_count(&s), 150);
    particle_stage_close(&s);
}

static void absurd_rates_cost_no_more_than_the_limit(void **state) {
    (void)state;
    for (int m = 0; m < 3; m++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        add(&s, &(jsl_emitter_desc){
                    .mode = (jsl_emit_mode)m, .rate = JSL_R(1e30), .max_particles = 1000});
        steps(&s, 3);
        assert_i64(particle_stage_count(&s), 1000);
        assert_true(s.warnings.count[JSL_WARN_PARTICLES_FULL] > 0);
        particle_stage_close(&s);
    }
}

static void births_fill_their_shapes_uniformly(void **state) {
    (void)state;
    /* Mean and second moment along x of each shape of extent (2, 1, 0.5). */
    const double second[] = {0, 4.0 / 3, 4.0 / 4, 4.0 / 5, 4.0 / 3, 4.0 / 3};
    const int n = 20000;
    for (int shape = 0; shape < JSL_EMITTER_SHAPE_COUNT; shape++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        s.context.gravity = jsl_v3(0, 0, 0);
        jsl_emitter e = add(&s, &(jsl_emitter_desc){.shape = (jsl_emitter_shape)shape,
                                                    .extent = {2, 1, JSL_R(0.5)}});
        assert_ok(jsl_particle_room_emit(s.room, e, n));
        particle_stage_step(&s);
        jsl_rows rows;
        assert_true(particle_stage_rows(&s, &rows));
        double sum = 0, square = 0;
        for (int i = 0; i < n; i++) {
            jsl_vec3 x = particle_position(&rows, i);
            sum += (double)x.x;
            square += (double)x.x * (double)x.x;
            double r = (double)jsl_length(x);
            if (shape == JSL_EMITTER_SHELL) assert_close(r, 2, 1e-6);
            assert_true(r <= 2.3);
        }
        assert_close(sum / n, 0, 4 * sqrt(second[shape] / n) + 1e-12);
        assert_close(square / n, second[shape], 4 * 2 * second[shape] / sqrt(n) + 1e-12);
        particle_stage_close(&s);
    }
}

static void directions_fill_their_cone_uniformly(void **state) {
    (void)state;
    /* Uniform in the solid angle: the mean of the cosine is (1 + cos a)/2; around an axis of any
     * direction. */
    const double angles[] = {0, 0.01, 0.6, 3.14159};
    const int n = 20000;
    for (int k = 0; k < 4; k++) {
        particle_stage s;
        particle_stage_open(&s, 1);
        s.context.gravity = jsl_v3(0, 0, 0);
        jsl_vec3 axis = jsl_normalize(jsl_v3(1, -2, JSL_R(0.5)));
        jsl_emitter e = add(
            &s, &(jsl_emitter_desc){
                    .direction = axis, .cone = (jsl_real)angles[k], .speed = 10, .speed_range = 3});
        assert_ok(jsl_particle_room_emit(s.room, e, n));
        particle_stage_step(&s);
        jsl_rows rows;
        assert_true(particle_stage_rows(&s, &rows));
        double cosine = 0, speed = 0, square = 0;
        for (int i = 0; i < n; i++) {
            jsl_vec3 v = particle_velocity(&rows, i);
            double length = (double)jsl_length(v), c = (double)jsl_dot(v, axis) / length;
            cosine += c;
            speed += length;
            square += (length - 10) * (length - 10);
            assert_true(c >= cos(angles[k]) - 1e-6);
        }
        double half = (1 - cos(angles[k])) / 2;
        assert_close(cosine / n, 1 - half, 4 * half / sqrt(3.0 * n) + 1e-6);
        assert_close(speed / n, 10, 4 * sqrt(3.0 / n));
        assert_close(square / n, 3, 4 * 3 / sqrt((double)n));
        particle_stage_close(&s);
    }
}

static void particles_inherit_a_share_of_the_emitters_velocity(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    s.context.gravity = jsl_v3(0, 0, 0);
    jsl_emitter e =
        add(&s, &(jsl_emitter_desc){.velocity = {4, 0, -2}, .inherit = JSL_R(0.5), .speed = 1});
    assert_ok(jsl_particle_room_emit(s.room, e, 1));
    particle_stage_step(&s);
    jsl_rows rows;
    assert_true(particle_stage_rows(&s, &rows));
    assert_close_v3(particle_velocity(&rows, 0), jsl_v3(2, 0, 0), 1e-6);
    particle_stage_close(&s);
}

static void newborns_do_not_start_inside_the_ground(void **state) {
    (void)state;
    particle_stage s;
    particle_stage_open(&s, 1);
    particle_stage_ground(&s);
    add(&s, &(jsl_emitter_desc){.rate = 3000,
                                .position = {0, 0, JSL_R(0.1)},
                                .direction = {0, 0, -1},
                                .cone = 1,
                                .speed = 30,
                                .restitution = JSL_R(0.5)});
    steps(&s, 5);
    jsl_rows rows;
    assert_true(particle_stage_rows(&s, &rows));
    assert_true(rows.count > 200);
    for (int64_t i = 0; i < rows.count; i++) assert_true(particle_position(&rows, i).z >= -1e-6);
    particle_stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fractions_of_a_birth_are_carried),
        cmocka_unit_test(births_are_spread_evenly_inside_the_step),
        cmocka_unit_test(reeves_counts_have_their_mean_and_variance),
        cmocka_unit_test(negative_reeves_counts_are_owed_and_do_not_bias_the_mean),
        cmocka_unit_test(poisson_counts_have_equal_mean_and_variance),
        cmocka_unit_test(the_population_is_rate_times_life),
        cmocka_unit_test(refill_keeps_the_population_constant),
        cmocka_unit_test(a_moving_emitter_leaves_the_same_trail_at_any_step),
        cmocka_unit_test(bursts_come_at_once_and_limits_hold),
        cmocka_unit_test(absurd_rates_cost_no_more_than_the_limit),
        cmocka_unit_test(births_fill_their_shapes_uniformly),
        cmocka_unit_test(directions_fill_their_cone_uniformly),
        cmocka_unit_test(particles_inherit_a_share_of_the_emitters_velocity),
        cmocka_unit_test(newborns_do_not_start_inside_the_ground),
    };
    return cmocka_run_group_tests_name("particle births", tests, NULL, NULL);
}
