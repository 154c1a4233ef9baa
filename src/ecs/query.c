/* SPDX-License-Identifier: MIT
 * Queries: which tables have these components, kept up to date as tables appear. Floor 2.
 */
#include "ecs/store.h"

#define FETCH_BYTES 128

/* -- Making ------------------------------------------------------------------- */

static jsl_result plan_terms(const jsl_ecs *ecs, const jsl_query_desc *desc, jsl_query_plan *plan) {
    uint64_t seen = 0;
    int n = 0;
    for (; n < JSL_MAX_TERMS && desc->terms[n].access != JSL_END; n++) {
        jsl_term term = desc->terms[n];
        if ((unsigned)term.access > JSL_WITHOUT)
            return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "query term %d has access %d", n,
                            (int)term.access);
        if (!jsl_component_known(ecs, term.component))
            return jsl_fail(&ecs->logger, JSL_ERR_HANDLE,
                            "query term %d: component %u is not registered", n, term.component.id);
        int c = (int)term.component.id - 1;
        const jsl_component_desc *info = &ecs->component[c].desc;
        uint64_t bit = 1ull << c;
        if (seen & bit)
            return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "query names %s twice", info->name);
        seen |= bit;
        plan->component[n] = (uint8_t)c;
        plan->first[n] = (uint8_t)plan->column_count;
        if (term.access == JSL_WITHOUT) {
            plan->excluded |= bit;
            continue;
        }
        if (term.access == JSL_READ || term.access == JSL_WRITE)
            plan->required |= bit;
        else
            plan->optional |= bit;
        plan->fields[n] = (uint8_t)info->field_count;
        plan->column_count += info->field_count;
        if (plan->column_count > JSL_MAX_VIEW_COLUMNS)
            return jsl_fail(&ecs->logger, JSL_ERR_LIMIT, "query has more than %d columns",
                            JSL_MAX_VIEW_COLUMNS);
    }
    plan->term_count = n;
    memcpy(plan->desc.terms, desc->terms, (size_t)n * sizeof(jsl_term));
    return JSL_OK;
}

static bool same_terms(const jsl_query_plan *a, const jsl_query_plan *b) {
    if (a->term_count != b->term_count) return false;
    for (int i = 0; i < a->term_count; i++)
        if (a->component[i] != b->component[i] ||
            a->desc.terms[i].access != b->desc.terms[i].access)
            return false;
    return true;
}

/* Inserts a table where its mask belongs; room must be there. */
static void insert_match(jsl_query_plan *plan, jsl_table *table) {
    int64_t at = plan->match.count++;
    for (; at > 0 && plan->match.at[at - 1].table->mask > table->mask; at--)
        plan->match.at[at] = plan->match.at[at - 1];
    jsl_match *match = &plan->match.at[at];
    *match = (jsl_match){.table = table};
    for (int t = 0; t < plan->term_count; t++) {
        match->first[t] = table->first[plan->component[t]];
        match->present |= (uint16_t)((table->mask >> plan->component[t] & 1) << t);
    }
    plan->nonempty += table->count > 0;
}

static jsl_result gather_matches(jsl_ecs *ecs, jsl_query_plan *plan) {
    int64_t n = 0;
    for (int64_t i = 0; i < ecs->table.count; i++)
        n += jsl_query_matches(plan, ecs->table.at[i]->mask);
    if (n) JSL_TRY(jsl_array_reserve(&ecs->memory, &plan->match, n));
    for (int64_t i = 0; i < ecs->table.count; i++)
        if (jsl_query_matches(plan, ecs->by_mask.at[i]->mask))
            insert_match(plan, ecs->by_mask.at[i]);
    return JSL_OK;
}

static void free_plan(jsl_ecs *ecs, jsl_query_plan *plan) {
    jsl_array_free(&ecs->memory, &plan->match);
    jsl_free(&ecs->memory, plan, sizeof *plan);
}

jsl_result jsl_query_create(jsl_ecs *ecs, const jsl_query_desc *desc, jsl_query *out) {
    if (!ecs || !desc || !out) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_query_create"));
    jsl_query_plan plan = {0};
    JSL_TRY(plan_terms(ecs, desc, &plan));
    for (int64_t i = 0; i < ecs->query.count; i++) {
        if (!same_terms(ecs->query.at[i], &plan)) continue;
        out->id = (uint32_t)i + 1; /* the same terms share one table list */
        return JSL_OK;
    }
    jsl_query_plan *made = jsl_alloc(&ecs->memory, sizeof *made);
    jsl_result r = made ? JSL_OK : JSL_ERR_MEMORY;
    if (r == JSL_OK) {
        *made = plan;
        r = jsl_array_reserve(&ecs->memory, &ecs->query, ecs->query.count + 1);
        if (r == JSL_OK) r = gather_matches(ecs, made);
        if (r != JSL_OK) free_plan(ecs, made);
    }
    if (r != JSL_OK) return jsl_fail(&ecs->logger, r, "no memory for a query");
    ecs->query.at[ecs->query.count++] = made;
    out->id = (uint32_t)ecs->query.count;
    return JSL_OK;
}

jsl_result jsl_queries_reserve(jsl_ecs *ecs, uint64_t mask) {
    for (int64_t i = 0; i < ecs->query.count; i++) {
        jsl_query_plan *plan = ecs->query.at[i];
        if (!jsl_query_matches(plan, mask)) continue;
        JSL_TRY(jsl_array_reserve(&ecs->memory, &plan->match, plan->match.count + 1));
    }
    return JSL_OK;
}

void jsl_queries_add(jsl_ecs *ecs, jsl_table *table) {
    for (int64_t i = 0; i < ecs->query.count; i++)
        if (jsl_query_matches(ecs->query.at[i], table->mask)) insert_match(ecs->query.at[i], table);
}

void jsl_queries_free(jsl_ecs *ecs) {
    for (int64_t i = 0; i < ecs->query.count; i++) free_plan(ecs, ecs->query.at[i]);
    jsl_array_free(&ecs->memory, &ecs->query);
}

/* -- Reading ------------------------------------------------------------------ */

jsl_query_plan *jsl_query_at(const jsl_ecs *ecs, jsl_query query) {
    if (!ecs || query.id == 0 || query.id > (uint64_t)ecs->query.count) return NULL;
    return ecs->query.at[query.id - 1];
}

int64_t jsl_query_count(const jsl_ecs *ecs, jsl_query query) {
    const jsl_query_plan *plan = jsl_query_at(ecs, query);
    int64_t rows = 0;
    for (int64_t i = 0; plan && i < plan->match.count; i++) rows += plan->match.at[i].table->count;
    return rows;
}

int jsl_view_component(const jsl_table *table, int component, int fields, int64_t row, int at,
                       jsl_rows *rows) {
    uint16_t first = table->first[component];
    if (first == JSL_NO_COLUMN) {
        for (int f = 0; f < fields; f++) rows->column[at++] = NULL;
        return at;
    }
    const jsl_column *c = &table->column[first];
    for (int f = 0; f < fields; f++, c++)
        rows->column[at++] = c->at ? c->at + (size_t)row * c->bytes : NULL;
    return at;
}

void jsl_query_view(const jsl_query_plan *plan, const jsl_match *match, int64_t row, int64_t count,
                    jsl_rows *rows) {
    jsl_table *table = match->table;
    rows->count = count;
    rows->begin = row;
    rows->table = table->id;
    rows->present = match->present;
    rows->entity = table->entity + row;
    memcpy(rows->first, plan->first, sizeof rows->first);
    void **to = rows->column;
    for (int t = 0; t < plan->term_count; t++) {
        int fields = plan->fields[t];
        const jsl_column *c = &table->column[match->first[t]];
        if (match->first[t] == JSL_NO_COLUMN)
            for (int f = 0; f < fields; f++) *to++ = NULL;
        else
            for (int f = 0; f < fields; f++, c++) *to++ = c->at + (size_t)row * c->bytes;
    }
}

/* The start of a column, as far as the processor would not follow it by itself soon enough. */
static void fetch_column(const jsl_column *column, int64_t rows) {
    size_t bytes = (size_t)rows * column->bytes;
    if (bytes > FETCH_BYTES) bytes = FETCH_BYTES;
    for (size_t i = 0; i < bytes; i += JSL_ALIGN) __builtin_prefetch(column->at + i);
}

/* Small tables lie anywhere, and each is done before the next one has arrived: so what its first
 * rows need is asked for early, the places of columns two tables ahead, the columns one. */
static void fetch_ahead(const jsl_query_plan *plan, int64_t at) {
    if (at + 2 < plan->match.count) {
        const jsl_match *match = &plan->match.at[at + 2];
        __builtin_prefetch(match->table);
        for (int t = 0; t < plan->term_count; t++)
            if (match->first[t] != JSL_NO_COLUMN)
                __builtin_prefetch(&match->table->column[match->first[t]]);
    }
    if (at + 1 < plan->match.count) {
        const jsl_match *match = &plan->match.at[at + 1];
        for (int t = 0; t < plan->term_count; t++)
            if (match->first[t] != JSL_NO_COLUMN)
                for (int f = 0; f < plan->fields[t]; f++)
                    fetch_column(&match->table->column[match->first[t] + f], match->table->count);
    }
}

jsl_iter jsl_query_begin(jsl_ecs *ecs, jsl_query query, int64_t block) {
    return (jsl_iter){ecs, query.id, 0, 0, block > 0 ? jsl_round_up(block, JSL_LANES) : 0};
}

bool jsl_query_next(jsl_iter *it, jsl_rows *rows) {
    const jsl_query_plan *plan = jsl_query_at(it->ecs, (jsl_query){it->query});
    if (!plan) return false;
    for (; it->table < plan->match.count; it->table++, it->row = 0) {
        const jsl_match *match = &plan->match.at[it->table];
        int64_t left = match->table->count - it->row;
        if (left <= 0) continue;
        int64_t n = it->block && it->block < left ? it->block : left;
        if (it->row == 0) fetch_ahead(plan, it->table);
        jsl_query_view(plan, match, it->row, n, rows);
        it->row += n;
        return true;
    }
    return false;
}
