/* SPDX-License-Identifier: MIT
 * Components of every type and role for the tests of the ECS.
 */
#include "ecs_fixture.h"

#include <stdlib.h>

JSL_COMPONENT_FIELDS(place, PLACE_FIELDS);
JSL_COMPONENT_FIELDS(pace, PACE_FIELDS);
JSL_COMPONENT_FIELDS(mixed, MIXED_FIELDS);
JSL_COMPONENT_FIELDS(link, LINK_FIELDS);
static const jsl_field rank_fields[] = {{"rank", "1", JSL_TYPE_U32, JSL_STATE}};

const jsl_component_desc *fixture_desc(int component) {
    static const jsl_component_desc desc[FIXTURE_COUNT] = {
        {"place", place_fields, JSL_COUNT(place_fields), false},
        {"pace", pace_fields, JSL_COUNT(pace_fields), false},
        {"mixed", mixed_fields, JSL_COUNT(mixed_fields), true},
        {"link", link_fields, JSL_COUNT(link_fields), false},
        {"tag", NULL, 0, false},
        {"rank", rank_fields, 1, true}};
    return &desc[component];
}

jsl_result fixture_register(jsl_ecs *ecs, bool backwards, jsl_component component[FIXTURE_COUNT]) {
    for (int i = 0; i < FIXTURE_COUNT; i++) {
        int c = backwards ? FIXTURE_COUNT - 1 - i : i;
        JSL_TRY(jsl_component_register(ecs, fixture_desc(c), &component[c]));
    }
    return JSL_OK;
}

void fixture_open(ecs_fixture *f) {
    *f = (ecs_fixture){0};
    jsl_ecs_desc desc = {.allocator = test_allocator(&f->memory), .logger = test_logger(&f->log)};
    assert_ok(jsl_ecs_create(&desc, &f->ecs));
    assert_ok(fixture_register(f->ecs, false, f->component));
}

void fixture_close(ecs_fixture *f) {
    fixture_validate(f);
    jsl_ecs_destroy(f->ecs);
    assert_no_leaks(&f->memory);
}

void fixture_validate(const ecs_fixture *f) {
    jsl_ecs_report report;
    if (jsl_ecs_validate(f->ecs, &report) != JSL_OK) fail_msg("unsound: %s", report.problem);
}

int fixture_set(const ecs_fixture *f, unsigned mask, jsl_component set[FIXTURE_COUNT]) {
    int n = 0;
    for (int c = 0; c < FIXTURE_COUNT; c++)
        if (mask >> c & 1) set[n++] = f->component[c];
    return n;
}

void fixture_create(ecs_fixture *f, unsigned mask, int64_t count, jsl_entity *out) {
    jsl_component set[FIXTURE_COUNT];
    int n = fixture_set(f, mask, set);
    assert_ok(jsl_entity_create_n(f->ecs, set, n, count, out, NULL));
}

jsl_query fixture_query(ecs_fixture *f, unsigned with, unsigned without) {
    jsl_query_desc desc = {0};
    jsl_query query;
    int n = 0;
    for (int c = 0; c < FIXTURE_COUNT; c++) {
        if (with >> c & 1) desc.terms[n++] = (jsl_term){f->component[c], JSL_WRITE};
        if (without >> c & 1) desc.terms[n++] = (jsl_term){f->component[c], JSL_WITHOUT};
    }
    assert_ok(jsl_query_create(f->ecs, &desc, &query));
    return query;
}

static void put_value(void *at, jsl_type type, uint64_t bits, jsl_entity self) {
    double real = (double)(int64_t)(bits % 2000001 - 1000000) / 64;
    float single = (float)real;
    jsl_real scalar = (jsl_real)single;
    switch (type) {
    case JSL_TYPE_REAL:
        memcpy(at, &scalar, sizeof scalar);
        break;
    case JSL_TYPE_F32:
        memcpy(at, &single, sizeof single);
        break;
    case JSL_TYPE_F64:
        memcpy(at, &real, sizeof real);
        break;
    case JSL_TYPE_ENTITY:
        memcpy(at, &self, sizeof self);
        break;
    default:
        memcpy(at, &bits, (size_t)jsl_type_size(type));
        break;
    }
}

void fixture_fill(ecs_fixture *f) {
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(f->ecs, fixture_query(f, 0, 0), 0);
         jsl_query_next(&it, &rows);) {
        for (int64_t i = 0; i < rows.count; i++) {
            uint64_t state = jsl_entity_id(rows.entity[i]);
            for (int c = 0; c < FIXTURE_COUNT; c++) {
                const jsl_component_desc *desc = fixture_desc(c);
                for (int k = 0; k < desc->field_count; k++) {
                    uint64_t bits = test_random(&state);
                    void *at = jsl_entity_field(f->ecs, rows.entity[i], f->component[c], k);
                    if (at && desc->fields[k].role <= JSL_CACHE)
                        put_value(at, desc->fields[k].type, bits, rows.entity[i]);
                }
            }
        }
    }
}

void *fixture_save(const ecs_fixture *f, size_t *size) {
    *size = jsl_ecs_save_size(f->ecs);
    void *bytes = malloc(*size);
    assert_non_null(bytes);
    assert_ok(jsl_ecs_save(f->ecs, bytes, *size));
    return bytes;
}

void fixture_bad_handles(const ecs_fixture *f, jsl_entity live, jsl_entity stale,
                         jsl_entity out[BAD_HANDLES]) {
    (void)f;
    out[0] = (jsl_entity){0, 0};
    out[1] = stale;
    out[2] = (jsl_entity){live.index, live.generation + 1};
    out[3] = (jsl_entity){UINT32_MAX, live.generation};
    out[4] = (jsl_entity){live.index, live.generation ^ 0x100000u}; /* another tag */
    out[5] = (jsl_entity){0, live.generation};
}
