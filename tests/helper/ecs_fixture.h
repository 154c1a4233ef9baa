/* SPDX-License-Identifier: MIT
 * Components of every type and role for the tests of the ECS.
 */
#ifndef JSL_TESTS_ECS_FIXTURE_H
#define JSL_TESTS_ECS_FIXTURE_H

#include "helper.h"

#include <ecs/ecs.h>

#define PLACE_FIELDS(X)                                                                            \
    X(real, x, "m", JSL_STATE)                                                                     \
    X(real, y, "m", JSL_STATE)                                                                     \
    X(real, z, "m", JSL_STATE)
#define PACE_FIELDS(X)                                                                             \
    X(real, vx, "m/s", JSL_STATE)                                                                  \
    X(real, vy, "m/s", JSL_STATE)                                                                  \
    X(real, vz, "m/s", JSL_STATE)
/* Every type and every role; keeps_order. */
#define MIXED_FIELDS(X)                                                                            \
    X(u8, a, "1", JSL_STATE)                                                                       \
    X(i16, b, "1", JSL_CACHE)                                                                      \
    X(i32, c, "1", JSL_STATE)                                                                      \
    X(u64, d, "1", JSL_STATE)                                                                      \
    X(f32, e, "K", JSL_STATE)                                                                      \
    X(f64, f, "Pa", JSL_CACHE)                                                                     \
    X(entity, target, "", JSL_STATE)                                                               \
    X(real, rebuilt, "1", JSL_DERIVED)                                                             \
    X(u32, scratch, "1", JSL_SCRATCH)                                                              \
    X(i8, g, "1", JSL_STATE)                                                                       \
    X(u16, h, "1", JSL_STATE)                                                                      \
    X(i64, i, "1", JSL_STATE)
#define LINK_FIELDS(X)                                                                             \
    X(entity, next, "", JSL_STATE)                                                                 \
    X(u32, number, "1", JSL_STATE)

JSL_COMPONENT_COLUMNS(place, PLACE_FIELDS)
JSL_COMPONENT_COLUMNS(pace, PACE_FIELDS)
JSL_COMPONENT_COLUMNS(mixed, MIXED_FIELDS)
JSL_COMPONENT_COLUMNS(link, LINK_FIELDS)

/* Tables with mixed or rank keep the order of their rows; tag has no fields. */
enum { PLACE, PACE, MIXED, LINK, TAG, RANK, FIXTURE_COUNT };

typedef struct ecs_fixture {
    jsl_ecs *ecs;
    jsl_component component[FIXTURE_COUNT];
    test_memory memory;
    test_log log;
} ecs_fixture;

const jsl_component_desc *fixture_desc(int component);
/* Registers the components in this order, or backwards. */
jsl_result fixture_register(jsl_ecs *ecs, bool backwards, jsl_component component[FIXTURE_COUNT]);
/* With the counting allocator and the remembering logger. */
void fixture_open(ecs_fixture *f);
/* Validates, destroys, and asserts that nothing leaked. */
void fixture_close(ecs_fixture *f);
void fixture_validate(const ecs_fixture *f);
/* count entities with the components of the bits of mask (1 << PLACE and so on). */
void fixture_create(ecs_fixture *f, unsigned mask, int64_t count, jsl_entity *out);
/* The components of the bits; returns their number. */
int fixture_set(const ecs_fixture *f, unsigned mask, jsl_component set[FIXTURE_COUNT]);
/* Fills the STATE and CACHE fields of every entity with values that depend on its id alone. */
void fixture_fill(ecs_fixture *f);
jsl_query fixture_query(ecs_fixture *f, unsigned with, unsigned without);

/* The image of the state in memory from malloc. */
void *fixture_save(const ecs_fixture *f, size_t *size);

/* Handles that no ECS may accept: null, stale (given), forged generation, index out of range,
 * another tag. */
#define BAD_HANDLES 6
void fixture_bad_handles(const ecs_fixture *f, jsl_entity live, jsl_entity stale,
                         jsl_entity out[BAD_HANDLES]);

#endif
