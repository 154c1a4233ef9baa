/* SPDX-License-Identifier: MIT
 * Who sees whom: against all pairs.
 *
 * The set of neighbours is read off exactly. Velocities are small whole numbers, alignment alone is
 * on with weight 1 and the response that sums, so a boid's acceleration is sum v_j - n v_i without
 * rounding: equal counts and equal sums of three random codes mean equal sets.
 */
#include "flock_stage.h"

#include <stdlib.h>

typedef struct probe {
    jsl_real radius, cos, near;
} lens;

typedef struct swarm {
    int count;
    jsl_vec3 *p, *v;
    int *flock;
    jsl_entity *entity;
} swarm;

static swarm make_swarm(int count) {
    return (swarm){count, calloc((size_t)count, sizeof(jsl_vec3)),
                   calloc((size_t)count, sizeof(jsl_vec3)), calloc((size_t)count, sizeof(int)),
                   calloc((size_t)count, sizeof(jsl_entity))};
}
static void free_swarm(swarm *s) {
    free(s->p);
    free(s->v);
    free(s->flock);
    free(s->entity);
}

/* The definition of jostle/flock.h, operation by operation as the kernel does it, so that both
 * agree on boids at the very edge. */
static bool sees(const swarm *s, const lens *probe, int i, int j) {
    const jsl_vec3 d = jsl_sub(s->p[j], s->p[i]);
    const jsl_real d2 = d.x * d.x + d.y * d.y + d.z * d.z;
    if (i == j || s->flock[i] != s->flock[j] || d2 == 0) return false;
    if (d2 < probe->near * probe->near) return true;
    if (d2 > probe->radius * probe->radius) return false;
    const jsl_real speed_sq = jsl_length_sq(s->v[i]);
    const jsl_real k = speed_sq > 0 ? 1 / jsl_sqrt(speed_sq) : 0;
    const jsl_vec3 h = jsl_v3(s->v[i].x * k, s->v[i].y * k, s->v[i].z * k);
    const jsl_real dot = d.x * h.x + d.y * h.y + d.z * h.z;
    return dot * jsl_abs(dot) > probe->cos * jsl_abs(probe->cos) * d2;
}

static jsl_vec3 code(uint64_t *seed) {
    jsl_vec3 v;
    do {
        v.x = (jsl_real)((int)(test_random(seed) % 2001) - 1000);
        v.y = (jsl_real)((int)(test_random(seed) % 2001) - 1000);
        v.z = (jsl_real)((int)(test_random(seed) % 2001) - 1000);
    } while (jsl_length_sq(v) == 0);
    return v;
}

static jsl_vec3 at(uint64_t *seed, jsl_vec3 centre, double half) {
    const double x = test_uniform(seed, -half, half), y = test_uniform(seed, -half, half);
    const double z = test_uniform(seed, -half, half);
    return jsl_v3((jsl_real)((double)centre.x + x), (jsl_real)((double)centre.y + y),
                  (jsl_real)((double)centre.z + z));
}

/* Lets the room look at the swarm through the probe, and compares with all pairs. Returns the
 * neighbours found. */
static int64_t compare(swarm *s, int flocks, const lens *probe, jsl_isa isa) {
    flock_stage stage;
    flock_stage_open(&stage, 2, isa);
    jsl_flock flock[4];
    jsl_component component;
    for (int f = 0; f < flocks; f++) {
        jsl_flock_desc desc = {.alignment = {.radius = probe->radius, .weight = 1},
                               .near_distance = probe->near,
                               .max_speed = JSL_R(1e6),
                               .max_accel = JSL_R(1e9),
                               .response = JSL_FLOCK_SUM,
                               .negotiation = JSL_FLOCK_BLEND};
        flock[f] = flock_stage_flock(&stage, &desc);
        jsl_rows rows;
        assert_ok(jsl_component_find(stage.ecs, "flock", &component));
        assert_ok(jsl_rows_of_entity(stage.ecs, flock[f].entity, component, &rows));
        *jsl_flock_of(&rows, 0).alignment_cos = probe->cos;
    }
    for (int i = 0; i < s->count; i++)
        s->entity[i] = flock_stage_boid(&stage, flock[s->flock[i]], s->p[i], s->v[i]);
    /* A third of them have one component more, and so live in another table. */
    jsl_component_desc tag = {.name = "tagged"};
    assert_ok(jsl_component_register(stage.ecs, &tag, &component));
    for (int i = 0; i < s->count; i += 3)
        assert_ok(jsl_entity_add(stage.ecs, s->entity[i], &component, 1));
    flock_stage_decide(&stage, 0);
    int64_t total = 0;
    for (int i = 0; i < s->count; i++) {
        int n = 0;
        jsl_vec3 sum = jsl_v3(0, 0, 0);
        for (int j = 0; j < s->count; j++) {
            if (!sees(s, probe, i, j)) continue;
            n++;
            sum = jsl_add(sum, s->v[j]);
        }
        sum = jsl_mul_add(sum, -(jsl_real)n, s->v[i]);
        boid_state got = flock_stage_see(&stage, s->entity[i]);
        assert_int_equal(got.neighbours, n);
        assert_close_v3(got.a, sum, 0);
        total += n;
    }
    flock_stage_close(&stage);
    return total;
}

static void neighbours_equal_those_of_all_pairs(void **state) {
    (void)state;
    uint64_t seed = 1;
    const lens probes[] = {{9, -2, 0},           {9, JSL_R(-0.15), JSL_R(1.5)},
                           {5, JSL_R(0.7), 1},   {3, JSL_R(-0.707), 4},
                           {40, JSL_R(0.95), 0}, {JSL_R(1.5), -2, 0}};
    for (int k = 0; k < 6; k++) {
        swarm s = make_swarm(700);
        for (int i = 0; i < s.count; i++) {
            s.p[i] = at(&seed, jsl_v3(3, -7, 11), 20);
            s.v[i] = code(&seed);
        }
        assert_true(compare(&s, 1, &probes[k], JSL_ISA_AUTO) > 0);
        free_swarm(&s);
    }
}

static void each_flock_sees_only_its_own(void **state) {
    (void)state;
    uint64_t seed = 2;
    swarm s = make_swarm(900);
    for (int i = 0; i < s.count; i++) {
        s.p[i] = at(&seed, jsl_v3(0, 0, 0), 12);
        s.v[i] = code(&seed);
        s.flock[i] = (int)(test_random(&seed) % 4);
    }
    assert_true(compare(&s, 4, &(lens){6, JSL_R(-0.3), 1}, JSL_ISA_AUTO) > 0);
    free_swarm(&s);
}

static void five_thousand_in_one_cell_lose_nobody(void **state) {
    (void)state;
    uint64_t seed = 3;
    swarm s = make_swarm(5000);
    for (int i = 0; i < s.count; i++) {
        s.p[i] = at(&seed, jsl_v3(1, 1, 1), 0.9);
        s.v[i] = jsl_v3((jsl_real)(i % 7 - 3), (jsl_real)(i % 5 - 2), 1);
    }
    assert_i64(compare(&s, 1, &(lens){9, -2, 0}, JSL_ISA_AUTO), (int64_t)5000 * 4999);
    assert_true(compare(&s, 1, &(lens){1, JSL_R(0.2), 0}, JSL_ISA_AUTO) > 0);
    free_swarm(&s);
}

static void far_from_the_origin_and_far_apart(void **state) {
    (void)state;
    uint64_t seed = 4;
    const double far[] = {1e5, 3e6};
    for (int k = 0; k < 2; k++) {
        swarm s = make_swarm(600);
        for (int i = 0; i < s.count; i++) {
            /* Two clouds so far apart that cells outnumber boids by far. */
            jsl_vec3 c =
                jsl_v3((jsl_real)(i % 2 ? far[k] : -far[k]), (jsl_real)far[k], (jsl_real)-far[k]);
            s.p[i] = at(&seed, c, 15);
            s.v[i] = code(&seed);
        }
        assert_true(compare(&s, 1, &(lens){7, JSL_R(-0.5), 1}, JSL_ISA_AUTO) > 0);
        free_swarm(&s);
    }
}

static void thinly_spread_over_a_large_world(void **state) {
    (void)state;
    uint64_t seed = 5;
    swarm s = make_swarm(1000);
    for (int i = 0; i < s.count; i++) {
        s.p[i] = i % 4 ? jsl_add(s.p[i - 1], at(&seed, jsl_v3(0, 0, 0), 3))
                       : at(&seed, jsl_v3(0, 0, 0), 4000);
        s.v[i] = code(&seed);
    }
    assert_true(compare(&s, 1, &(lens){4, -2, 0}, JSL_ISA_AUTO) > 0);
    free_swarm(&s);
}

static void every_level_sees_the_same(void **state) {
    (void)state;
    uint64_t seed = 6;
    swarm s = make_swarm(800);
    for (int i = 0; i < s.count; i++) {
        /* Many on a lattice, so that distances meet the radius exactly. */
        s.p[i] = jsl_v3((jsl_real)(test_random(&seed) % 12), (jsl_real)(test_random(&seed) % 12),
                        (jsl_real)(test_random(&seed) % 12));
        s.v[i] = code(&seed);
    }
    int64_t found = compare(&s, 1, &(lens){3, JSL_R(0.1), 1}, JSL_ISA_SCALAR);
    for (int isa = JSL_ISA_SSE; isa < JSL_ISA_COUNT; isa++)
        assert_i64(compare(&s, 1, &(lens){3, JSL_R(0.1), 1}, (jsl_isa)isa), found);
    free_swarm(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(neighbours_equal_those_of_all_pairs),
        cmocka_unit_test(each_flock_sees_only_its_own),
        cmocka_unit_test(five_thousand_in_one_cell_lose_nobody),
        cmocka_unit_test(far_from_the_origin_and_far_apart),
        cmocka_unit_test(thinly_spread_over_a_large_world),
        cmocka_unit_test(every_level_sees_the_same),
    };
    return cmocka_run_group_tests_name("flock_sight", tests, NULL, NULL);
}
