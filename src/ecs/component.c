/* SPDX-License-Identifier: MIT
 * Registering component types: what a field is called, what it holds, and whether it is state.
 * Floor 2.
 */
#include "ecs/store.h"
#include <jostle/components.h>

static bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
static bool is_digit(char c) { return c >= '0' && c <= '9'; }

static bool name_is_good(const char *name, bool lower_only) {
    if (!name) return false;
    size_t n = strnlen(name, JSL_NAME_MAX + 1);
    if (n == 0 || n > JSL_NAME_MAX) return false;
    for (size_t i = 0; i < n; i++) {
        char c = name[i];
        bool letter = is_lower(c) || (!lower_only && c >= 'A' && c <= 'Z');
        bool inner = is_digit(c) || c == '_';
        if (!letter && !(inner && i > 0)) return false;
    }
    return true;
}

static jsl_result check_fields(const jsl_ecs *ecs, const jsl_component_desc *desc) {
    const jsl_logger *log = &ecs->logger;
    if (desc->field_count < 0 || desc->field_count > JSL_MAX_COMPONENT_FIELDS ||
        (desc->field_count > 0 && !desc->fields))
        return jsl_fail(log, JSL_ERR_ARGUMENT, "component %s: %d fields; 0 to %d are allowed",
                        desc->name, desc->field_count, JSL_MAX_COMPONENT_FIELDS);
    for (int i = 0; i < desc->field_count; i++) {
        const jsl_field *f = &desc->fields[i];
        if (!name_is_good(f->name, false))
            return jsl_fail(log, JSL_ERR_ARGUMENT,
                            "component %s: field %d has no name of at most %d letters, digits, _",
                            desc->name, i, JSL_NAME_MAX);
        if (f->unit && strnlen(f->unit, JSL_NAME_MAX + 1) > JSL_NAME_MAX)
            return jsl_fail(log, JSL_ERR_ARGUMENT, "component %s: unit of %s exceeds %d bytes",
                            desc->name, f->name, JSL_NAME_MAX);
        if (jsl_type_size(f->type) == 0 || (unsigned)f->role >= JSL_ROLE_COUNT)
            return jsl_fail(log, JSL_ERR_ARGUMENT, "component %s: field %s has type %d, role %d",
                            desc->name, f->name, (int)f->type, (int)f->role);
        for (int k = 0; k < i; k++)
            if (strcmp(desc->fields[k].name, f->name) == 0)
                return jsl_fail(log, JSL_ERR_ARGUMENT, "component %s: two fields are called %s",
                                desc->name, f->name);
    }
    return JSL_OK;
}

bool jsl_component_same(const jsl_component_desc *a, const jsl_component_desc *b) {
    if (strcmp(a->name, b->name) != 0 || a->field_count != b->field_count ||
        a->keeps_order != b->keeps_order)
        return false;
    for (int i = 0; i < a->field_count; i++) {
        const jsl_field *f = &a->fields[i], *g = &b->fields[i];
        if (strcmp(f->name, g->name) != 0 || f->type != g->type || f->role != g->role ||
            strcmp(f->unit ? f->unit : "", g->unit ? g->unit : "") != 0)
            return false;
    }
    return true;
}

static char *put_text(char **to, const char *text) {
    if (!text) text = "";
    size_t n = strlen(text) + 1;
    char *at = memcpy(*to, text, n);
    *to += n;
    return at;
}

/* Fields and all strings in one block that lives as long as the ECS. */
static jsl_result copy_desc(jsl_ecs *ecs, const jsl_component_desc *desc,
                            jsl_component_type *type) {
    size_t fields = (size_t)desc->field_count * sizeof(jsl_field);
    size_t bytes = fields + strlen(desc->name) + 1;
    for (int i = 0; i < desc->field_count; i++)
        bytes += strlen(desc->fields[i].name) + 1 +
                 (desc->fields[i].unit ? strlen(desc->fields[i].unit) : 0) + 1;
    char *block = jsl_alloc(&ecs->memory, bytes);
    if (!block)
        return jsl_fail(&ecs->logger, JSL_ERR_MEMORY, "component %s: no memory for its fields",
                        desc->name);
    jsl_field *field = (jsl_field *)(void *)block;
    char *text = block + fields;
    *type = (jsl_component_type){.block = block, .block_bytes = bytes};
    type->desc = *desc;
    type->desc.fields = field;
    type->desc.name = put_text(&text, desc->name);
    for (int i = 0; i < desc->field_count; i++) {
        field[i] = desc->fields[i];
        field[i].name = put_text(&text, desc->fields[i].name);
        field[i].unit = put_text(&text, desc->fields[i].unit);
        type->row_bytes += jsl_type_size(field[i].type);
    }
    type->name_hash = jsl_hash_bytes(desc->name, strlen(desc->name), 0);
    return JSL_OK;
}

jsl_result jsl_component_register(jsl_ecs *ecs, const jsl_component_desc *desc,
                                  jsl_component *out) {
    if (!ecs) return JSL_ERR_ARGUMENT;
    if (!desc || !out || !name_is_good(desc->name, true))
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT,
                        "component name must match [a-z][a-z0-9_]* and have at most %d bytes",
                        JSL_NAME_MAX);
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_component_register"));
    JSL_TRY(check_fields(ecs, desc));
    jsl_component known;
    for (int i = 0; i < ecs->component_count; i++) {
        if (strcmp(ecs->component[i].desc.name, desc->name) != 0) continue;
        if (!jsl_component_same(&ecs->component[i].desc, desc))
            return jsl_fail(&ecs->logger, JSL_ERR_NAME,
                            "component %s is already registered with other rows", desc->name);
        known.id = (uint32_t)i + 1;
        *out = known;
        return JSL_OK;
    }
    if (ecs->component_count == JSL_MAX_COMPONENTS)
        return jsl_fail(&ecs->logger, JSL_ERR_LIMIT, "component %s: there are already %d",
                        desc->name, JSL_MAX_COMPONENTS);
    int id = ecs->component_count;
    JSL_TRY(copy_desc(ecs, desc, &ecs->component[id]));
    int at = id;
    for (; at > 0; at--) {
        uint8_t before = ecs->by_name[at - 1];
        if (strcmp(ecs->component[before].desc.name, desc->name) < 0) break;
        ecs->by_name[at] = before;
    }
    ecs->by_name[at] = (uint8_t)id;
    ecs->component_count++;
    out->id = (uint32_t)id + 1;
    return JSL_OK;
}

jsl_result jsl_component_find(const jsl_ecs *ecs, const char *name, jsl_component *out) {
    if (!ecs || !name || !out) return JSL_ERR_ARGUMENT;
    for (int i = 0; i < ecs->component_count; i++) {
        if (strcmp(ecs->component[i].desc.name, name) == 0) {
            out->id = (uint32_t)i + 1;
            return JSL_OK;
        }
    }
    return jsl_fail(&ecs->logger, JSL_ERR_NAME, "no component is called %.64s", name);
}

int jsl_component_count(const jsl_ecs *ecs) { return ecs ? ecs->component_count : 0; }

const jsl_component_desc *jsl_component_info(const jsl_ecs *ecs, int i) {
    if (!ecs || i < 0 || i >= ecs->component_count) return NULL;
    return &ecs->component[i].desc;
}

jsl_result jsl_set_mask(const jsl_ecs *ecs, const jsl_component *set, int set_count,
                        uint64_t *mask) {
    if (set_count < 0 || (set_count > 0 && !set))
        return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "a set of %d components", set_count);
    uint64_t m = 0;
    for (int i = 0; i < set_count; i++) {
        if (!jsl_component_known(ecs, set[i]))
            return jsl_fail(&ecs->logger, JSL_ERR_HANDLE, "component %u of a set is not registered",
                            set[i].id);
        uint64_t bit = 1ull << (set[i].id - 1);
        if (m & bit)
            return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "component %s is twice in a set",
                            ecs->component[set[i].id - 1].desc.name);
        m |= bit;
    }
    *mask = m;
    return JSL_OK;
}

bool jsl_component_is_built_in(const char *name) {
#define JSL_X(built_in)                                                                            \
    if (name && strcmp(name, #built_in) == 0) return true;
    JSL_BUILT_IN_COMPONENTS(JSL_X)
#undef JSL_X
    return false;
}
