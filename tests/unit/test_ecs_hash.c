/* SPDX-License-Identifier: MIT
 * The state hash: what it sees, and what it must not see.
 */
#include "ecs_fixture.h"

#include <stdlib.h>

#define P (1u << PLACE)
#define V (1u << PACE)
#define M (1u << MIXED)
#define L (1u << LINK)
#define ALL ((1u << FIXTURE_COUNT) - 1)

static void every_bit_of_every_saved_field_counts_and_no_other(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[40];
    fixture_open(&f);
    fixture_create(&f, ALL, 40, e);
    fixture_fill(&f);
    uint64_t before = jsl_ecs_hash(f.ecs);
    for (int c = 0; c < FIXTURE_COUNT; c++) {
        const jsl_component_desc *desc = fixture_desc(c);
        for (int k = 0; k < desc->field_count; k++) {
            unsigned char *at = jsl_entity_field(f.ecs, e[33], f.component[c], k);
            bool entity = desc->fields[k].type == JSL_TYPE_ENTITY;
            for (int bit = 0; bit < jsl_type_size(desc->fields[k].type) * 8; bit++) {
                bool tag = entity && bit >= 52; /* the bits of the owning ECS */
                at[bit / 8] ^= (unsigned char)(1 << bit % 8);
                assert_int_equal(before != jsl_ecs_hash(f.ecs),
                                 desc->fields[k].role <= JSL_CACHE && !tag);
                at[bit / 8] ^= (unsigned char)(1 << bit % 8);
            }
        }
    }
    assert_true(before == jsl_ecs_hash(f.ecs));
    fixture_close(&f);
}

static void zeros_of_both_signs_and_swapped_values_differ(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[2];
    jsl_rows rows;
    fixture_open(&f);
    fixture_create(&f, P, 2, e);
    uint64_t zero = jsl_ecs_hash(f.ecs);
    assert_ok(jsl_rows_of_entity(f.ecs, e[0], f.component[PLACE], &rows));
    jsl_real *x = rows.column[0], *y = rows.column[1];
    x[0] = JSL_R(-0.0);
    assert_true(jsl_ecs_hash(f.ecs) != zero);
    x[0] = 1, y[0] = 2;
    uint64_t one = jsl_ecs_hash(f.ecs);
    x[0] = 2, y[0] = 1;
    assert_true(jsl_ecs_hash(f.ecs) != one); /* between fields */
    x[0] = 0, y[0] = 0, x[1] = 1, y[1] = 2;
    assert_true(jsl_ecs_hash(f.ecs) != one); /* between entities */
    fixture_close(&f);
}

static void components_without_fields_and_the_set_itself_count(void **state) {
    (void)state;
    ecs_fixture f;
    jsl_entity e[2];
    fixture_open(&f);
    uint64_t empty = jsl_ecs_hash(f.ecs);
    fixture_create(&f, 0, 2, e);
    uint64_t bare = jsl_ecs_hash(f.ecs);
    assert_true(bare != empty);
    assert_ok(jsl_entity_add(f.ecs, e[0], &f.component[TAG], 1));
    uint64_t tagged = jsl_ecs_hash(f.ecs);
    assert_true(tagged != bare);
    assert_ok(jsl_entity_remove(f.ecs, e[0], &f.component[TAG], 1));
    assert_true(jsl_ecs_hash(f.ecs) == bare);
    assert_ok(jsl_entity_add(f.ecs, e[1], &f.component[TAG], 1));
    assert_true(jsl_ecs_hash(f.ecs) != tagged);
    assert_true(jsl_ecs_hash(NULL) == 0);
    fixture_close(&f);
}

/* The same 600 entities by three ways. */
static uint64_t build(int way) {
    ecs_fixture f = {0};
    jsl_entity e[600];
    jsl_ecs_desc desc = {.allocator = test_allocator(&f.memory), .tag = (uint32_t)(way + 9)};
    assert_ok(jsl_ecs_create(&desc, &f.ecs));
    assert_ok(fixture_register(f.ecs, way == 2, f.component));
    if (way == 0) {
        fixture_create(&f, P | V, 200, e);
        fixture_create(&f, P | M | L, 400, e + 200);
    } else if (way == 1) {
        for (int i = 0; i < 600; i++) fixture_create(&f, 0, 1, &e[i]);
        assert_ok(jsl_entity_add_n(f.ecs, e, 600, &f.component[PLACE], 1));
        for (int i = 599; i >= 200; i--) {
            assert_ok(jsl_entity_add(f.ecs, e[i], &f.component[MIXED], 1));
            assert_ok(jsl_entity_add(f.ecs, e[i], &f.component[LINK], 1));
        }
        assert_ok(jsl_entity_add_n(f.ecs, e, 200, &f.component[PACE], 1));
    } else {
        fixture_create(&f, ALL, 600, e);
        jsl_component off[FIXTURE_COUNT];
        int n = fixture_set(&f, ALL & ~(P | V), off);
        assert_ok(jsl_entity_remove_n(f.ecs, e, 200, off, n));
        n = fixture_set(&f, ALL & ~(P | M | L), off);
        assert_ok(jsl_entity_remove_n(f.ecs, e + 200, 400, off, n));
    }
    fixture_fill(&f);
    uint64_t hash = jsl_ecs_hash(f.ecs);
    fixture_close(&f);
    return hash;
}

static void the_same_state_has_one_hash_whatever_its_history(void **state) {
    (void)state;
    uint64_t first = build(0);
    assert_true(build(1) == first); /* other tables on the way */
    assert_true(build(2) == first); /* components registered backwards, another tag */
}

static void every_instruction_set_gives_the_same_hash(void **state) {
    (void)state;
    const char *old = getenv("JSL_ISA");
    char *kept = old ? strdup(old) : NULL;
    uint64_t first = 0;
    size_t first_size = 0;
    void *first_image = NULL;
    for (jsl_isa isa = JSL_ISA_SCALAR; isa < JSL_ISA_COUNT; isa++) {
        ecs_fixture f;
        setenv("JSL_ISA", jsl_isa_text(isa), 1);
        fixture_open(&f);
        for (unsigned mask = 0; mask <= ALL; mask++) fixture_create(&f, mask, mask * 3, NULL);
        fixture_create(&f, ALL, 1000, NULL);
        fixture_fill(&f);
        uint64_t hash = jsl_ecs_hash(f.ecs);
        size_t size;
        void *image = fixture_save(&f, &size);
        if (first_image) {
            assert_true(hash == first);
            assert_true(size == first_size && memcmp(image, first_image, size) == 0);
            free(image);
        } else {
            first = hash, first_size = size, first_image = image;
        }
        fixture_close(&f);
    }
    free(first_image);
    if (kept)
        setenv("JSL_ISA", kept, 1);
    else
        unsetenv("JSL_ISA");
    free(kept);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_bit_of_every_saved_field_counts_and_no_other),
        cmocka_unit_test(zeros_of_both_signs_and_swapped_values_differ),
        cmocka_unit_test(components_without_fields_and_the_set_itself_count),
        cmocka_unit_test(the_same_state_has_one_hash_whatever_its_history),
        cmocka_unit_test(every_instruction_set_gives_the_same_hash)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
