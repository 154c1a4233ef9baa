/* SPDX-License-Identifier: MIT
 * Free motion of particles against closed forms, for every integrator.
 *
 * Linear drag: v' = a - k v has v = v_t + (v0 - v_t) e^{-kt}, x = x0 + v_t t + (v0 - v_t)(1 -
 * e^{-kt})/k with v_t = a/k.
 */
#include "particle_stage.h"

/* One particle flown for `time` seconds in `steps` steps. */
typedef struct flight {
    jsl_particle_integrator integrator;
    double drag, wind_share, buoyancy;
    jsl_vec3 velocity, wind;
    double time;
    int steps, substeps;
} flight;

static void fly(const flight *f, jsl_vec3 *x, jsl_vec3 *v) {
    particle_stage s;
    particle_stage_open(&s, 1);
    s.wind.velocity = f->wind;
    s.context.substeps = f->substeps ? f->substeps : 1;
    particle_stage_set_dt(&s, f->time / f->steps);
    jsl_emitter e;
    jsl_emitter_desc d = {.integrator = f->integrator,
                          .drag = (jsl_real)f->drag,
                          .wind = (jsl_real)f->wind_share,
                          .buoyancy = (jsl_real)f->buoyancy};
    assert_ok(jsl_particle_room_emitter_create(s.room, &d, &e));
    jsl_rows rows;
    particle_stage_spawn(&s, e, 1, 0, &rows);
    particle_put(&rows, 0, jsl_v3(0, 0, 0), f->velocity);
    for (int i = 0; i < f->steps; i++) particle_stage_step(&s);
    assert_true(particle_stage_rows(&s, &rows));
    *x = particle_position(&rows, 0);
    *v = particle_velocity(&rows, 0);
    particle_stage_close(&s);
}

static void exact(const flight *f, double x[3], double v[3]) {
    const double g[3] = {0, 0, (double)JSL_R(-9.81)};
    const double w[3] = {(double)f->wind.x, (double)f->wind.y, (double)f->wind.z};
    const double v0[3] = {(double)f->velocity.x, (double)f->velocity.y, (double)f->velocity.z};
    double k = (double)(jsl_real)f->drag, t = f->time;
    for (int i = 0; i < 3; i++) {
        double a = g[i] * (1 - f->buoyancy) + k * f->wind_share * w[i];
        if (k == 0) {
            v[i] = v0[i] + a * t;
            x[i] = v0[i] * t + 0.5 * a * t * t;
        } else {
            /* In long double: for small k the two terms of x nearly cancel. */
            long double vt = (long double)a / k, e = expm1l(-(long double)k * t);
            v[i] = (double)(v0[i] + (v0[i] - vt) * e);
            x[i] = (double)(vt * t - (v0[i] - vt) * e / k);
        }
    }
}

static double error_of(const flight *f) {
    double x[3], v[3];
    jsl_vec3 gx, gv;
    exact(f, x, v);
    fly(f, &gx, &gv);
    return sqrt(pow((double)gx.x - x[0], 2) + pow((double)gx.y - x[1], 2) +
                pow((double)gx.z - x[2], 2));
}

static void the_exponential_step_is_exact_to_rounding(void **state) {
    (void)state;
    const double drags[] = {0, 1e-7, 0.5, 3, 60, 2000};
    for (int i = 0; i < 6; i++) {
        flight f = {.drag = drags[i], .wind_share = 0.75, .velocity = {3, -2, 10}, .time = 2};
        f.wind = jsl_v3(4, 1, -2);
        f.steps = 64;
        double x[3], v[3];
        jsl_vec3 gx, gv;
        exact(&f, x, v);
        fly(&f, &gx, &gv);
        /* Each of 64 steps rounds each of a few sums of size <= 30 once or twice. */
        double tol = 64 * 4 * 30 * (double)JSL_REAL_EPSILON;
        assert_close(gx.x, x[0], tol);
        assert_close(gx.y, x[1], tol);
        assert_close(gx.z, x[2], tol);
        assert_close(gv.x, v[0], tol);
        assert_close(gv.y, v[1], tol);
        assert_close(gv.z, v[2], tol);
    }
}

static void a_projectile_lands_where_it_should_in_one_step(void **state) {
    (void)state;
    flight f = {.velocity = {10, 0, 10}, .time = 2, .steps = 1};
    jsl_vec3 x, v;
    fly(&f, &x, &v);
    /* x = 20, z = 20 - 9.81 * 2 */
    assert_close(x.x, 20, 20 * 2 * (double)JSL_REAL_EPSILON);
    assert_close(x.z, 0.38, 20 * 4 * (double)JSL_REAL_EPSILON);
    assert_close(v.z, -9.62, 20 * 4 * (double)JSL_REAL_EPSILON);
}

static void a_falling_particle_with_drag_matches_the_reference_numbers(void **state) {
    (void)state;
    /* g = 9.81, k = 0.5, from rest, t = 2: speed 12.402205, drop 14.435589. */
    flight f = {.drag = 0.5, .time = 2, .steps = 10};
    jsl_vec3 x, v;
    fly(&f, &x, &v);
    assert_close(v.z, -12.402205, 2e-6 + 200 * (double)JSL_REAL_EPSILON);
    assert_close(x.z, -14.435589, 2e-6 + 200 * (double)JSL_REAL_EPSILON);
}

static void the_step_is_an_affine_map_whatever_the_substeps(void **state) {
    (void)state;
    flight one = {.drag = 0.7, .velocity = {5, 1, 2}, .time = 1, .steps = 8, .substeps = 4};
    flight four = {.drag = 0.7, .velocity = {5, 1, 2}, .time = 1, .steps = 32};
    for (int m = 0; m < JSL_PARTICLE_INTEGRATOR_COUNT; m++) {
        one.integrator = four.integrator = (jsl_particle_integrator)m;
        jsl_vec3 xa, va, xb, vb;
        fly(&one, &xa, &va);
        fly(&four, &xb, &vb);
        assert_memory_equal(&xa, &xb, sizeof xa);
        assert_memory_equal(&va, &vb, sizeof va);
    }
}

static void integrators_converge_with_their_order(void **state) {
    (void)state;
    /* Steps are halved where the error is well above rounding, which in float RK4 never is. */
    const struct {
        jsl_particle_integrator integrator;
        double order;
    } list[] = {{JSL_PARTICLE_SEMI_IMPLICIT, 1},
                {JSL_PARTICLE_EXPLICIT, 1},
                {JSL_PARTICLE_VERLET, 2},
                {JSL_PARTICLE_RK4, 4}};
    for (int i = 0; i < 4; i++) {
        if (list[i].order > 2 && !jsl_is_double()) continue;
        flight f = {.integrator = list[i].integrator, .drag = 1.5, .wind_share = 1, .time = 1.3};
        f.velocity = jsl_v3(10, 3, 10);
        f.wind = jsl_v3(0, 5, 0);
        f.steps = 16;
        double coarse = error_of(&f);
        f.steps = 32;
        double fine = error_of(&f);
        assert_close(log2(coarse / fine), list[i].order, 0.1);
    }
}

static void semi_implicit_euler_obeys_its_own_recurrence(void **state) {
    (void)state;
    /* v_n = v_t (1 - (1 - k dt)^n) exactly. */
    const int n = 200;
    double dt = 1.0 / 64, k = 0.5, vt = (double)JSL_R(-9.81) / k;
    flight f = {.integrator = JSL_PARTICLE_SEMI_IMPLICIT, .drag = k, .time = n * dt, .steps = n};
    jsl_vec3 x, v;
    fly(&f, &x, &v);
    /* Three roundings a step, damped by 1 - k dt: at most 3 eps |v| / (k dt). */
    double tol = 3 * (double)JSL_REAL_EPSILON * fabs(vt) / (k * dt);
    assert_close(v.z, vt * (1 - pow(1 - k * dt, n)), tol);
    /* Unstable beyond k dt = 2, where the exponential step settles at the terminal velocity. */
    flight stiff = {.integrator = JSL_PARTICLE_SEMI_IMPLICIT, .drag = 300, .time = 1, .steps = 20};
    fly(&stiff, &x, &v);
    assert_true(jsl_abs(v.z) > 1000);
    stiff.integrator = JSL_PARTICLE_EXPONENTIAL;
    fly(&stiff, &x, &v);
    assert_close(v.z, (double)JSL_R(-9.81) / 300, 1e-6);
}

static void buoyancy_carries_the_weight(void **state) {
    (void)state;
    flight f = {.buoyancy = 1, .velocity = {1, 2, 3}, .time = 4, .steps = 16};
    jsl_vec3 x, v;
    fly(&f, &x, &v);
    assert_true(v.x == 1 && v.y == 2 && v.z == 3);
    f.buoyancy = 2;
    f.velocity = jsl_v3(0, 0, 0);
    fly(&f, &x, &v);
    assert_close(v.z, 9.81 * 4, 1e-4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_exponential_step_is_exact_to_rounding),
        cmocka_unit_test(a_projectile_lands_where_it_should_in_one_step),
        cmocka_unit_test(a_falling_particle_with_drag_matches_the_reference_numbers),
        cmocka_unit_test(the_step_is_an_affine_map_whatever_the_substeps),
        cmocka_unit_test(integrators_converge_with_their_order),
        cmocka_unit_test(semi_implicit_euler_obeys_its_own_recurrence),
        cmocka_unit_test(buoyancy_carries_the_weight),
    };
    return cmocka_run_group_tests_name("particle motion", tests, NULL, NULL);
}
