/* SPDX-License-Identifier: MIT
 * publish_component.c - the fields of any component to frames of columns_t.
 */
#include "telemetry/component.h"
#include "telemetry/publisher.h"

#include <jostle/components.h>

/* -- Which
 * ---------------------------------------------------------------------------------------------- */

static bool is_chosen(const jsl_publisher *p, const char *name) {
    if (!p->component_count) return !jsl_component_is_built_in(name);
    for (int i = 0; i < p->component_count; i++)
        if (strcmp(p->component_name[i], name) == 0) return true;
    return false;
}

jsl_result jsl_publish_choose(jsl_publisher *p, const jsl_publisher_desc *d) {
    if (d->component_count < 0 || d->component_count > JSL_MAX_COMPONENTS ||
        (d->component_count && !d->components))
        return jsl_fail(&p->logger, JSL_ERR_ARGUMENT, "publisher: component_count is %d",
                        d->component_count);
    for (int i = 0; i < d->component_count; i++) {
        int k = 0, count = jsl_component_count(p->ecs);
        const char *name = d->components[i] ? d->components[i] : "";
        while (k < count && strcmp(jsl_component_info(p->ecs, k)->name, name) != 0) k++;
        if (k == count)
            return jsl_fail(&p->logger, JSL_ERR_NAME, "publisher: no component is called '%.40s'",
                            name);
        p->component_name[i] = jsl_component_info(p->ecs, k)->name; /* lives as long as the ECS */
    }
    p->component_count = d->component_count;
    return JSL_OK;
}

/* Queries of the chosen components among the first `count`; those known before keep theirs. */
void jsl_publish_choose_queries(jsl_publisher *p, int known, int count) {
    for (int i = known < 0 ? 0 : known; i < count; i++) {
        const char *name = jsl_component_info(p->ecs, i)->name;
        jsl_component c;
        p->component_query[i] = (jsl_query){0};
        if (!is_chosen(p, name) || jsl_component_find(p->ecs, name, &c) != JSL_OK) continue;
        jsl_query_desc desc = {.terms = {{c, JSL_READ}}};
        (void)jsl_query_create(p->ecs, &desc, &p->component_query[i]);
    }
}

/* -- One frame
 * ------------------------------------------------------------------------------------------ */

/* The fields that go out, all but scratch. */
typedef struct component_frame {
    jsl_msg_columns m;
    const char *field[JSL_MAX_COMPONENT_FIELDS], *unit[JSL_MAX_COMPONENT_FIELDS];
    int8_t type[JSL_MAX_COMPONENT_FIELDS];
    uint8_t column[JSL_MAX_COMPONENT_FIELDS]; /* its place among all fields */
    int64_t row_bytes, room;                  /* room: entities of one chunk */
} component_frame;

static void describe(jsl_publisher *p, const jsl_component_desc *desc, component_frame *f) {
    *f = (component_frame){.m = {JSL_STAMPED(p), .component = desc->name}, .row_bytes = 8};
    for (int i = 0; i < desc->field_count; i++) {
        const jsl_field *field = &desc->fields[i];
        if (field->role == JSL_SCRATCH) continue;
        int32_t k = f->m.n_fields++;
        f->field[k] = field->name;
        f->unit[k] = field->unit;
        f->type[k] = (int8_t)jsl_wire_type(field->type);
        f->column[k] = (uint8_t)i;
        f->row_bytes += jsl_type_size(field->type);
    }
    f->m.field = f->field;
    f->m.unit = f->unit;
    f->m.type = f->type;
    int64_t room = JSL_DATAGRAM - (int64_t)strlen(jsl_bulk_channel(JSL_BULK_COLUMNS)) - 1 -
                   jsl_message_size(JSL_LCM_COLUMNS, &f->m);
    f->room = room / f->row_bytes;
}

static void put_ids(const jsl_entity *entity, int64_t n, uint8_t *out) {
    for (int64_t i = 0; i < n; i++) {
        uint64_t id = jsl_entity_id(entity[i]);
        memcpy(out + i * 8, &id, 8);
    }
}

/* Entities [first, first + n) of all tables, column after column, to out. */
static void put_columns(jsl_publisher *p, jsl_query query, const component_frame *f, int64_t first,
                        int64_t n, uint8_t *out) {
    int64_t base = 0; /* index in the frame of the table's first row */
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(p->ecs, query, 0); jsl_query_next(&it, &rows);) {
        int64_t begin = first > base ? first - base : 0;
        int64_t end = first + n - base < rows.count ? first + n - base : rows.count;
        int64_t take = end - begin, at = base + begin - first;
        base += rows.count;
        if (take <= 0) continue;
        uint8_t *column = out;
        put_ids(rows.entity + begin, take, column + at * 8);
        column += n * 8;
        for (int32_t k = 0; k < f->m.n_fields; k++) {
            int64_t size = jsl_type_size((jsl_type)f->type[k]);
            const uint8_t *from = rows.column[rows.first[0] + f->column[k]];
            if (f->type[k] == JSL_TYPE_ENTITY)
                put_ids((const jsl_entity *)(const void *)from + begin, take, column + at * size);
            else
                memcpy(column + at * size, from + begin * size, (size_t)(take * size));
            column += n * size;
        }
    }
}

static void send(jsl_publisher *p, unsigned outlets, const jsl_msg_columns *m) {
    const char *channel = jsl_bulk_channel(JSL_BULK_COLUMNS);
    int64_t size = jsl_message_size(JSL_LCM_COLUMNS, m);
    JSL_ASSERT(size + (int64_t)strlen(channel) + 1 <= JSL_DATAGRAM);
    for (int o = 0; o < JSL_OUTLETS; o++) {
        if (!(outlets >> o & 1)) continue;
        jsl_outlet *out = &p->outlet[o];
        uint8_t *to =
            jsl_ring_reserve(&out->ring, channel, size, p->desc.when_full == JSL_FULL_BLOCK);
        JSL_ASSERT(to); /* there is room: jsl_publish_outlets saw it */
        jsl_message_encode(JSL_LCM_COLUMNS, m, to, size);
        int64_t at = jsl_ring_commit(&out->ring, channel, size, p->stamp.wall_us);
        if (o == JSL_TO_LOG && m->chunk_index == 0) jsl_publish_note(p, at, JSL_INDEX_FRAME);
        out->bulk[JSL_BULK_COLUMNS].chunks++;
        out->bulk[JSL_BULK_COLUMNS].bytes += size;
    }
}

static jsl_result publish_one(jsl_publisher *p, jsl_query query, const jsl_component_desc *desc) {
    component_frame f;
    describe(p, desc, &f);
    int64_t total = jsl_query_count(p->ecs, query);
    int64_t chunks = total ? (total + f.room - 1) / f.room : 1;
    int64_t head = JSL_EVENT_HEAD + (int64_t)strlen(jsl_bulk_channel(JSL_BULK_COLUMNS)) +
                   jsl_message_size(JSL_LCM_COLUMNS, &f.m);
    jsl_result r = jsl_array_reserve(&p->memory, &p->table, f.room * f.row_bytes);
    unsigned outlets = 0;
    if (r == JSL_OK)
        outlets = jsl_publish_outlets(p, JSL_BULK_COLUMNS, chunks * head + total * f.row_bytes);
    for (int o = 0; r != JSL_OK && o < JSL_OUTLETS; o++)
        p->outlet[o].bulk[JSL_BULK_COLUMNS].dropped += p->outlet[o].on;
    f.m.frame_seq = p->frame_seq[JSL_BULK_COLUMNS]++;
    f.m.chunk_count = (int32_t)chunks;
    f.m.total = total;
    f.m.data = p->table.at;
    for (int64_t i = 0; outlets && i < chunks; i++) {
        f.m.chunk_index = (int32_t)i;
        f.m.first = i * f.room;
        f.m.n = (int32_t)(total - f.m.first < f.room ? total - f.m.first : f.room);
        f.m.nbytes = (int32_t)(f.m.n * f.row_bytes);
        put_columns(p, query, &f, f.m.first, f.m.n, p->table.at);
        f.m.crc32c = (int32_t)jsl_crc32c(0, f.m.data, (size_t)f.m.nbytes);
        send(p, outlets, &f.m);
    }
    for (int o = 0; o < JSL_OUTLETS; o++) {
        if (!(outlets >> o & 1)) continue;
        jsl_ring_publish(&p->outlet[o].ring);
        p->outlet[o].bulk[JSL_BULK_COLUMNS].queued++;
    }
    return r;
}

jsl_result jsl_publish_components(jsl_publisher *p, bool due) {
    jsl_result r = JSL_OK, each;
    if (p->hz[JSL_BULK_COLUMNS] < 0) return JSL_OK;
    for (int i = 0; i < p->view.component_count; i++) {
        jsl_query query = p->component_query[i];
        if (!query.id) continue;
        for (int o = 0; o < JSL_OUTLETS; o++) {
            p->outlet[o].bulk[JSL_BULK_COLUMNS].offered += p->outlet[o].on;
            p->outlet[o].bulk[JSL_BULK_COLUMNS].decimated += p->outlet[o].on && !due;
        }
        if (due && (each = publish_one(p, query, jsl_component_info(p->ecs, i))) != JSL_OK)
            r = each;
    }
    return r;
}
