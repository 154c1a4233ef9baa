/* SPDX-License-Identifier: MIT
 * The set of everything solid: swept boxes, overlap and rays against brute force.
 */
#include "random_shape.h"

#include "geometry/geometry.h"

typedef struct fixture {
    test_memory counted;
    jsl_memory memory;
    jsl_collider_set set;
} fixture;

static void open_fixture(fixture *f) {
    *f = (fixture){.counted = {0}};
    assert_ok(jsl_memory_init(&f->memory, test_allocator(&f->counted)));
}
static void close_fixture(fixture *f) {
    jsl_collider_set_free(&f->memory, &f->set);
    assert_no_leaks(&f->counted);
}

static void fill(fixture *f, uint64_t *seed, int count) {
    assert_ok(jsl_array_reserve(&f->memory, &f->set.item, count));
    f->set.item.count = count;
    for (int i = 0; i < count; i++) {
        jsl_shape_kind kind = (jsl_shape_kind)(i % 20 == 7 ? JSL_SHAPE_PLANE : 1 + i % 3);
        jsl_collider_item it = {.entity = {(uint32_t)i + 1, 1},
                                .shape = random_shape(seed, kind, 1)};
        it.pose = (jsl_pose){random_vec3(seed, 12), random_quat(seed)};
        if (kind == JSL_SHAPE_PLANE)
            it.pose.position = jsl_v3(0, 0, -20), it.pose.orientation = jsl_quat_identity();
        if (i % 4) it.velocity = random_vec3(seed, 20), it.spin = random_vec3(seed, 10);
        it.radius = jsl_shape_radius(&it.shape);
        it.category = 1u << (i % 3);
        f->set.item.at[i] = it;
    }
}

static void boxes_hold_the_whole_motion_of_the_step(void **state) {
    (void)state;
    uint64_t seed = 31;
    fixture f;
    open_fixture(&f);
    fill(&f, &seed, 300);
    const double dt = 0.05;
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, (jsl_real)dt, JSL_R(0.01)));
    for (int i = 0; i < 300; i++) {
        const jsl_collider_item *it = &f.set.item.at[i];
        if (it->shape.kind == JSL_SHAPE_PLANE) continue;
        for (int k = 0; k <= 10; k++) {
            jsl_real t = (jsl_real)(dt * k / 10);
            jsl_vec3 w = jsl_scale(it->spin, t);
            jsl_real angle = jsl_length(w);
            jsl_quat q = it->pose.orientation;
            if (angle > 0) {
                jsl_vec3 u = jsl_scale(w, jsl_sin(angle / 2) / angle);
                q = jsl_quat_mul((jsl_quat){u.x, u.y, u.z, jsl_cos(angle / 2)}, q);
            }
            jsl_aabb b = jsl_shape_aabb(
                &it->shape,
                (jsl_pose){jsl_mul_add(it->pose.position, t, it->velocity), jsl_quat_normalize(q)});
            jsl_aabb s = f.set.box.at[i];
            /* The margin is far above rounding. */
            assert_true(s.lo.x < b.lo.x && s.lo.y < b.lo.y && s.lo.z < b.lo.z);
            assert_true(s.hi.x > b.hi.x && s.hi.y > b.hi.y && s.hi.z > b.hi.z);
        }
        /* However fast it spins, the box stays within the bounding sphere's and the motion. */
        jsl_real most = 2 * (it->radius + jsl_abs(it->velocity.x) * (jsl_real)dt + JSL_R(0.011));
        assert_true(f.set.box.at[i].hi.x - f.set.box.at[i].lo.x <= most);
    }
    close_fixture(&f);
}

static void overlap_finds_what_brute_force_finds(void **state) {
    (void)state;
    uint64_t seed = 32;
    for (int count = 0; count <= 400; count += 80) {
        fixture f;
        open_fixture(&f);
        fill(&f, &seed, count);
        assert_ok(jsl_collider_set_index(&f.memory, &f.set, JSL_R(0.02), 0));
        for (int q = 0; q < 50; q++) {
            jsl_vec3 c = random_vec3(&seed, 20), h = jsl_v3(3, 2, 4);
            jsl_aabb box = {jsl_sub(c, h), jsl_add(c, h)};
            int32_t item[500];
            char seen[500] = {0};
            int64_t n = jsl_collider_set_overlap(&f.set, box, item, 500), want = 0;
            bool finite_seen = false;
            for (int i = 0; i < count; i++) want += jsl_aabb_meet(f.set.box.at[i], box);
            assert_i64(n, want);
            for (int64_t i = 0; i < n; i++) {
                assert_false(seen[item[i]]);
                seen[item[i]] = 1;
                assert_true(jsl_aabb_meet(f.set.box.at[item[i]], box));
                bool plane = f.set.item.at[item[i]].shape.kind == JSL_SHAPE_PLANE;
                assert_false(plane && finite_seen); /* planes first */
                finite_seen |= !plane;
            }
            int32_t few[2] = {-9, -9};
            assert_i64(jsl_collider_set_overlap(&f.set, box, few, 1), want);
            assert_i64(few[1], -9);
            if (n > 0) assert_i64(few[0], item[0]);
            assert_i64(jsl_collider_set_overlap(&f.set, box, few, 0), want);
        }
        close_fixture(&f);
    }
}

static void rays_find_the_nearest_item_of_their_mask(void **state) {
    (void)state;
    uint64_t seed = 33;
    fixture f;
    open_fixture(&f);
    fill(&f, &seed, 300);
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, 0, 0));
    int hits = 0;
    for (int q = 0; q < 3000; q++) {
        jsl_vec3 from = random_vec3(&seed, 20), to = random_vec3(&seed, 25);
        if (q % 3 == 0) to = jsl_v3(to.x, from.y, from.z); /* along an axis: zero components */
        uint32_t mask = q % 2 ? ~0u : 2u;
        jsl_ray_hit hit, best = {.fraction = 2};
        int32_t item = -1, want = -1;
        for (int i = 0; i < 300; i++) {
            const jsl_collider_item *it = &f.set.item.at[i];
            if (!(it->category & mask) || !jsl_shape_ray(&it->shape, it->pose, from, to, &hit))
                continue;
            if (hit.fraction < best.fraction) best = hit, want = i;
        }
        bool found = jsl_collider_set_ray(&f.set, from, to, mask, &hit, &item);
        assert_true(found == (want >= 0));
        if (!found) continue;
        hits++;
        assert_i64(item, want);
        assert_true(hit.fraction == best.fraction);
        assert_true(jsl_collider_set_ray(&f.set, from, to, mask, &hit, NULL));
    }
    assert_true(hits > 300);
    close_fixture(&f);
}

static void the_revision_follows_the_list_and_not_the_motion(void **state) {
    (void)state;
    uint64_t seed = 34;
    fixture f;
    open_fixture(&f);
    fill(&f, &seed, 50);
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, 0, 0));
    uint64_t r = f.set.revision;
    int64_t calls = f.memory.calls;
    for (int i = 0; i < 50; i++) f.set.item.at[i].pose.position.x += 1;
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, 0, 0));
    assert_true(f.set.revision == r);
    assert_i64(f.memory.calls, calls); /* nor does a second step allocate */
    f.set.item.at[3].shape_id = 9;
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, 0, 0));
    assert_true(f.set.revision != r);
    r = f.set.revision;
    jsl_entity e = f.set.item.at[3].entity;
    f.set.item.at[3].entity = f.set.item.at[4].entity, f.set.item.at[4].entity = e;
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, 0, 0));
    assert_true(f.set.revision != r);
    r = f.set.revision;
    f.set.item.count--;
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, 0, 0));
    assert_true(f.set.revision != r);
    f.set.item.at[3].entity.generation++;
    r = f.set.revision;
    assert_ok(jsl_collider_set_index(&f.memory, &f.set, 0, 0));
    assert_true(f.set.revision != r);
    close_fixture(&f);
}

static void lack_of_memory_is_reported(void **state) {
    (void)state;
    for (int fail = 2; fail < 9; fail++) {
        uint64_t seed = 35;
        fixture f;
        open_fixture(&f);
        f.counted.fail_at = fail;
        fill(&f, &seed, 100); /* the first call */
        jsl_result r = jsl_collider_set_index(&f.memory, &f.set, 0, 0);
        assert_result(r, f.counted.failures ? JSL_ERR_MEMORY : JSL_OK);
        close_fixture(&f);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_hold_the_whole_motion_of_the_step),
        cmocka_unit_test(overlap_finds_what_brute_force_finds),
        cmocka_unit_test(rays_find_the_nearest_item_of_their_mask),
        cmocka_unit_test(the_revision_follows_the_list_and_not_the_motion),
        cmocka_unit_test(lack_of_memory_is_reported),
    };
    return cmocka_run_group_tests_name("collider_set", tests, NULL, NULL);
}
