/* SPDX-License-Identifier: MIT
 * Life of an ECS and its small accessors. Floor 2.
 */
#include "ecs/store.h"

static uint32_t tag_of_address(const void *address) {
    return (uint32_t)(jsl_mix64((uint64_t)(uintptr_t)address) % 4095) + 1;
}

jsl_result jsl_ecs_create(const jsl_ecs_desc *desc, jsl_ecs **out) {
    if (!out) return JSL_ERR_ARGUMENT;
    const jsl_ecs_desc none = {0};
    if (!desc) desc = &none;
    if (desc->tag > 4095)
        return jsl_fail(&desc->logger, JSL_ERR_ARGUMENT, "jsl_ecs_create: tag %u exceeds 4095",
                        desc->tag);
    jsl_memory memory = {0};
    JSL_TRY(jsl_memory_init(&memory, desc->allocator));
    jsl_ecs *ecs = jsl_alloc_zero(&memory, sizeof *ecs);
    if (!ecs)
        return jsl_fail(&desc->logger, JSL_ERR_MEMORY, "jsl_ecs_create: no memory for %zu bytes",
                        sizeof *ecs);
    ecs->memory = memory;
    ecs->logger = desc->logger;
    ecs->isa = jsl_isa_resolve(JSL_ISA_AUTO);
    ecs->tag = (desc->tag ? desc->tag : tag_of_address(ecs)) << JSL_TAG_SHIFT;
    atomic_flag_clear(&ecs->growing);
    *out = ecs;
    return JSL_OK;
}

void jsl_ecs_destroy(jsl_ecs *ecs) {
    if (!ecs) return;
    jsl_memory *memory = &ecs->memory;
    for (int64_t i = 0; i < ecs->table.count; i++) jsl_table_free(ecs, ecs->table.at[i]);
    jsl_queries_free(ecs);
    jsl_systems_free(ecs);
    for (int i = 0; i < ecs->component_count; i++)
        jsl_free(memory, ecs->component[i].block, ecs->component[i].block_bytes);
    jsl_free(memory, ecs->slots.at, (size_t)ecs->slots.cap * sizeof(jsl_slot));
    jsl_free(memory, ecs->slots.ring, (size_t)ecs->slots.cap * sizeof(uint32_t));
    jsl_map_free(memory, &ecs->table_of_mask);
    jsl_array_free(memory, &ecs->table);
    jsl_array_free(memory, &ecs->by_mask);
    jsl_array_free(memory, &ecs->dead);
    jsl_memory last = *memory; /* the accounts lie inside what is freed */
    jsl_free(&last, ecs, sizeof *ecs);
}

jsl_memory *jsl_ecs_memory(jsl_ecs *ecs) { return &ecs->memory; }
void jsl_ecs_set_logger(jsl_ecs *ecs, const jsl_logger *logger) {
    if (ecs) ecs->logger = logger ? *logger : (jsl_logger){0};
}

const jsl_logger *jsl_ecs_logger(const jsl_ecs *ecs) { return &ecs->logger; }

/* Switches, not tables: tables of pointers would have to be relocated. */
const char *jsl_stage_text(jsl_stage stage) {
    switch (stage) {
#define JSL_X(code, text)                                                                          \
    case JSL_STAGE_##code:                                                                         \
        return text;
        JSL_STAGES(JSL_X)
#undef JSL_X
    default:
        return "unknown stage";
    }
}

const char *jsl_warning_name(jsl_warning warning) {
    switch (warning) {
#define JSL_X(code, text)                                                                          \
    case JSL_WARN_##code:                                                                          \
        return #code;
        JSL_WARNINGS(JSL_X)
#undef JSL_X
    default:
        return NULL;
    }
}

const char *jsl_warning_text(jsl_warning warning) {
    switch (warning) {
#define JSL_X(code, text)                                                                          \
    case JSL_WARN_##code:                                                                          \
        return text;
        JSL_WARNINGS(JSL_X)
#undef JSL_X
    default:
        return NULL;
    }
}

int jsl_type_size(jsl_type type) {
    static const uint8_t size[JSL_TYPE_COUNT] = {[JSL_TYPE_REAL] = sizeof(jsl_real),
                                                 [JSL_TYPE_F32] = 4,
                                                 [JSL_TYPE_F64] = 8,
                                                 [JSL_TYPE_I8] = 1,
                                                 [JSL_TYPE_U8] = 1,
                                                 [JSL_TYPE_I16] = 2,
                                                 [JSL_TYPE_U16] = 2,
                                                 [JSL_TYPE_I32] = 4,
                                                 [JSL_TYPE_U32] = 4,
                                                 [JSL_TYPE_I64] = 8,
                                                 [JSL_TYPE_U64] = 8,
                                                 [JSL_TYPE_ENTITY] = 8};
    return (unsigned)type < JSL_TYPE_COUNT ? size[type] : 0;
}

void jsl_warn(const jsl_step_context *context, jsl_warning warning, int64_t count,
              jsl_entity offender) {
    if (!context || !context->warnings || (unsigned)warning >= JSL_WARN_COUNT || count <= 0) return;
    jsl_warnings *w = context->warnings;
    w->count[warning] += count;
    jsl_entity first = w->first[warning];
    if (jsl_entity_is_null(offender)) return;
    if (jsl_entity_is_null(first) || jsl_entity_id(offender) < jsl_entity_id(first))
        w->first[warning] = offender;
}
