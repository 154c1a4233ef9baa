/* SPDX-License-Identifier: MIT
 * Registering systems: a list sorted once, and refused when two of one order want the same
 * component. Floor 2.
 */
#include "ecs/store.h"

/* Adds the components of a term list to what a system touches and writes. */
static jsl_result note_terms(const jsl_ecs *ecs, const char *name, const jsl_term *terms,
                             jsl_system *system) {
    for (int i = 0; i < JSL_MAX_TERMS && terms[i].access != JSL_END; i++) {
        jsl_access access = terms[i].access;
        if (!jsl_component_known(ecs, terms[i].component))
            return jsl_fail(&ecs->logger, JSL_ERR_HANDLE,
                            "system %s: component %u is not registered", name,
                            terms[i].component.id);
        if ((unsigned)access > JSL_WITHOUT)
            return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "system %s: term %d has access %d",
                            name, i, (int)access);
        if (access == JSL_WITHOUT) continue;
        uint64_t bit = 1ull << (terms[i].component.id - 1);
        system->touches |= bit;
        if (access == JSL_WRITE || access == JSL_WRITE_IF) system->writes |= bit;
    }
    return JSL_OK;
}

static jsl_result check_desc(const jsl_ecs *ecs, const jsl_system_desc *desc) {
    const jsl_logger *log = &ecs->logger;
    size_t n = desc->name ? strnlen(desc->name, JSL_SYSTEM_NAME_MAX + 1) : 0;
    if (n == 0 || n > JSL_SYSTEM_NAME_MAX)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "a system needs a name of 1 to %d bytes",
                        JSL_SYSTEM_NAME_MAX);
    if ((unsigned)desc->stage >= JSL_STAGE_COUNT)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "system %s: stage %d does not exist", desc->name,
                        (int)desc->stage);
    if (!desc->run_rows == !desc->run_whole)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "system %s: give one of run_rows and run_whole",
                        desc->name);
    if (desc->block < 0 || desc->block > JSL_MAX_ROWS)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "system %s: block is %lld", desc->name,
                        (long long)desc->block);
    return JSL_OK;
}

static jsl_result check_conflicts(const jsl_ecs *ecs, const jsl_system *system) {
    for (int64_t i = 0; i < ecs->system.count; i++) {
        const jsl_system *other = ecs->system.at[i];
        if (strcmp(other->name, system->name) == 0)
            return jsl_fail(&ecs->logger, JSL_ERR_NAME, "there is already a system called %s",
                            system->name);
        if (other->stage != system->stage || other->order != system->order) continue;
        uint64_t both = (system->writes & other->touches) | (system->touches & other->writes);
        if (!both) continue;
        return jsl_fail(&ecs->logger, JSL_ERR_CONFLICT,
                        "systems %s and %s of stage %s have the same order %d and both touch %s; "
                        "give one another order",
                        other->name, system->name, jsl_stage_text(system->stage), system->order,
                        ecs->component[__builtin_ctzll(both)].desc.name);
    }
    return JSL_OK;
}

static bool runs_before(const jsl_system *a, const jsl_system *b) {
    if (a->stage != b->stage) return a->stage < b->stage;
    if (a->order != b->order) return a->order < b->order;
    return strcmp(a->name, b->name) < 0;
}

jsl_result jsl_system_register(jsl_ecs *ecs, const jsl_system_desc *desc) {
    if (!ecs || !desc) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_system_register"));
    if (ecs->in_stage)
        return jsl_fail(&ecs->logger, JSL_ERR_STATE, "jsl_system_register inside a stage");
    JSL_TRY(check_desc(ecs, desc));
    jsl_system s = {.stage = desc->stage,
                    .order = desc->order,
                    .block = desc->block ? jsl_round_up(desc->block, JSL_LANES) : 4096,
                    .run_rows = desc->run_rows,
                    .run_whole = desc->run_whole,
                    .user = desc->user,
                    .always = desc->run_whole && desc->query.terms[0].access == JSL_END};
    memcpy(s.name, desc->name, strlen(desc->name));
    JSL_TRY(note_terms(ecs, s.name, desc->query.terms, &s));
    JSL_TRY(note_terms(ecs, s.name, desc->also, &s));
    JSL_TRY(check_conflicts(ecs, &s));
    jsl_system *made = jsl_alloc(&ecs->memory, sizeof *made);
    jsl_result r = made ? jsl_array_reserve(&ecs->memory, &ecs->system, ecs->system.count + 1)
                        : JSL_ERR_MEMORY;
    jsl_query query = {0};
    if (r == JSL_OK) r = jsl_query_create(ecs, &desc->query, &query);
    if (r != JSL_OK) {
        jsl_free(&ecs->memory, made, sizeof *made);
        return jsl_fail(&ecs->logger, r, "system %s could not be registered", s.name);
    }
    s.query = query.id - 1;
    *made = s;
    int64_t at = ecs->system.count++;
    for (; at > 0 && runs_before(made, ecs->system.at[at - 1]); at--)
        ecs->system.at[at] = ecs->system.at[at - 1];
    ecs->system.at[at] = made;
    return JSL_OK;
}

void jsl_systems_free(jsl_ecs *ecs) {
    for (int64_t i = 0; i < ecs->system.count; i++)
        jsl_free(&ecs->memory, ecs->system.at[i], sizeof(jsl_system));
    jsl_array_free(&ecs->memory, &ecs->system);
    for (int w = 0; w < ecs->worker_count; w++) {
        jsl_array_free(&ecs->memory, &ecs->worker[w].commands.word);
        jsl_array_free(&ecs->memory, &ecs->worker[w].commands.segment);
    }
    jsl_free(&ecs->memory, ecs->worker, (size_t)ecs->worker_count * sizeof(jsl_worker));
}

int jsl_system_count(const jsl_ecs *ecs) { return ecs ? (int)ecs->system.count : 0; }

jsl_result jsl_system_get(const jsl_ecs *ecs, int i, jsl_system_info *out) {
    if (!ecs || !out) return JSL_ERR_ARGUMENT;
    if (i < 0 || i >= ecs->system.count)
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "there is no system %d", i);
    const jsl_system *s = ecs->system.at[i];
    const jsl_query_plan *plan = ecs->query.at[s->query];
    *out = (jsl_system_info){.name = s->name,
                             .stage = s->stage,
                             .order = s->order,
                             .rows = jsl_query_count(ecs, (jsl_query){s->query + 1}),
                             .runs = s->runs,
                             .calls = s->calls,
                             .bytes = s->bytes,
                             .seconds = s->seconds,
                             .always = s->always,
                             .required = plan->required,
                             .excluded = plan->excluded,
                             .reads = s->touches & ~s->writes,
                             .writes = s->writes};
    return JSL_OK;
}
