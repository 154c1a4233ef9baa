/* SPDX-License-Identifier: MIT
 * publish_bulk.c - particles, boids and bodies: columns of the world to frames of state_t, and the
 * body table.
 */
#include "telemetry/publisher.h"

#include "ecs/ecs.h"

#include <jostle/components.h>

/* -- What the world has
 * ----------------------------------------------------------------------------- */

static jsl_component find(const jsl_ecs *ecs, const char *name) {
    /* Not jsl_component_find: a component that a scene does not use is no failure to log. */
    jsl_component c = {0};
    for (int i = 0; i < jsl_component_count(ecs); i++)
        if (strcmp(jsl_component_info(ecs, i)->name, name) == 0)
            (void)jsl_component_find(ecs, name, &c);
    return c;
}

/* Adds an optional term; its index, or -1 when the component does not exist. */
static int8_t optional(jsl_query_desc *desc, int *terms, jsl_component c) {
    if (!c.id) return -1;
    desc->terms[*terms] = (jsl_term){c, JSL_READ_IF};
    return (int8_t)(*terms)++;
}

static void view_query(jsl_publisher *p, jsl_bulk bulk, jsl_component kind) {
    jsl_world_view *v = &p->view;
    v->query[bulk] = (jsl_query){0};
    if (!v->position.id || !kind.id) return;
    jsl_query_desc desc = {.terms = {{v->position, JSL_READ}, {kind, JSL_READ}}};
    int terms = 2;
    v->velocity_term[bulk] = optional(&desc, &terms, v->velocity);
    v->look_term[bulk] = optional(&desc, &terms, v->look);
    if (bulk == JSL_BULK_BODIES) {
        v->orientation_term = optional(&desc, &terms, v->orientation);
        v->spin_term = optional(&desc, &terms, v->spin);
        v->mass_term = optional(&desc, &terms, v->mass);
    }
    (void)jsl_query_create(p->ecs, &desc, &v->query[bulk]);
}

void jsl_publish_view(jsl_publisher *p) {
    jsl_world_view *v = &p->view;
    int count = jsl_component_count(p->ecs);
    if (count == v->component_count) return;
    jsl_publish_choose_queries(p, v->component_count, count);
    v->component_count = count;
    v->position = find(p->ecs, "position");
    v->orientation = find(p->ecs, "orientation");
    v->velocity = find(p->ecs, "velocity");
    v->spin = find(p->ecs, "spin");
    v->mass = find(p->ecs, "mass");
    v->collider = find(p->ecs, "collider");
    v->look = find(p->ecs, "look");
    v->particle = find(p->ecs, "particle");
    v->boid = find(p->ecs, "boid");
    view_query(p, JSL_BULK_PARTICLES, v->particle);
    view_query(p, JSL_BULK_BOIDS, v->boid);
    view_query(p, JSL_BULK_BODIES, v->collider);
}

int64_t jsl_publish_rows(jsl_publisher *p, jsl_bulk bulk) {
    jsl_query q = p->view.query[bulk];
    return q.id ? jsl_query_count(p->ecs, q) : 0;
}

/* -- Gathering
 * ------------------------------------------------------------------------------------------ */

/* Adds a column to the frame; its index. */
static int add_column(jsl_state_frame *frame, int field, int encoding, int components,
                      jsl_source_type source) {
    frame->column[frame->column_count] =
        (jsl_state_column){field, encoding, components, source, {0}};
    return frame->column_count++;
}

/* `components` columns of a term, from its k-th field on. */
static void point(jsl_state_segment *s, int column, const jsl_rows *rows, int term, int k,
                  int components) {
    for (int i = 0; term >= 0 && i < components; i++)
        s->data[column][i] = rows->column[rows->first[term] + k + i];
}

static int encoding_of(jsl_encoding e) {
    return e == JSL_ENCODING_F32 ? JSL_ENC_F32 : e == JSL_ENCODING_F16 ? JSL_ENC_F16 : JSL_ENC_U16Q;
}

/* Which columns a frame of that kind has; -1: not this one. */
typedef struct columns {
    int id, pos, vel, accel, radius, color, quat, spin;
} columns;

static columns choose_columns(jsl_publisher *p, jsl_bulk bulk, bool moved, jsl_state_frame *f) {
    const jsl_world_view *v = &p->view;
    columns c = {-1, -1, -1, -1, -1, -1, -1, -1};
    uint32_t ids = bulk == JSL_BULK_BOIDS ? JSL_PUBLISH_BOID_IDS : JSL_PUBLISH_PARTICLE_IDS;
    if (bulk == JSL_BULK_BODIES || (moved && (p->fields & ids))) {
        c.id = add_column(f, JSL_FIELD_ID, JSL_ENC_I64, 1, JSL_SOURCE_ENTITY);
        f->flags |= JSL_STATE_IDS;
    }
    int pos = bulk == JSL_BULK_BODIES  ? JSL_ENC_F32
              : bulk == JSL_BULK_BOIDS ? encoding_of(p->desc.boid_position)
                                       : encoding_of(p->desc.particle_position);
    c.pos = add_column(f, JSL_FIELD_POS, pos, 3, JSL_SOURCE_REAL);
    if (bulk == JSL_BULK_BODIES) {
        c.quat = add_column(f, JSL_FIELD_QUAT, JSL_ENC_F32, 4, JSL_SOURCE_REAL);
        f->column[c.quat].absent[3] = 1.0f;
        if (p->fields & JSL_PUBLISH_BODY_VELOCITY) {
            c.vel = add_column(f, JSL_FIELD_VEL, JSL_ENC_F32, 3, JSL_SOURCE_REAL);
            c.spin = add_column(f, JSL_FIELD_ANGVEL, JSL_ENC_F32, 3, JSL_SOURCE_REAL);
        }
        return c; /* colours of bodies are in the body table */
    }
    if (bulk == JSL_BULK_BOIDS || (p->fields & JSL_PUBLISH_PARTICLE_VELOCITY))
        c.vel = add_column(f, JSL_FIELD_VEL, JSL_ENC_F16, 3, JSL_SOURCE_REAL);
    if (bulk == JSL_BULK_BOIDS && (p->fields & JSL_PUBLISH_BOID_ACCELERATION))
        c.accel = add_column(f, JSL_FIELD_ACCEL, JSL_ENC_F16, 3, JSL_SOURCE_REAL);
    bool look = bulk == JSL_BULK_PARTICLES && p->desc.particle_look;
    if (bulk == JSL_BULK_PARTICLES)
        c.radius = add_column(f, JSL_FIELD_RADIUS, JSL_ENC_F16, 1,
                              look ? JSL_SOURCE_F32 : JSL_SOURCE_REAL);
    if (look || v->look_term[bulk] >= 0)
        c.color = add_column(f, JSL_FIELD_COLOR, JSL_ENC_U32, 1, JSL_SOURCE_U32);
    return c;
}

enum {
    PARTICLE_SIZE_FIELD = 2,
    BOID_ACCEL_FIELD = 1
}; /* in JSL_PARTICLE_FIELDS, JSL_BOID_FIELDS */

static void point_segment(jsl_publisher *p, jsl_bulk bulk, const columns *c, const jsl_rows *rows,
                          int64_t row, jsl_state_segment *s) {
    const jsl_world_view *v = &p->view;
    *s = (jsl_state_segment){.count = rows->count};
    if (c->id >= 0) s->data[c->id][0] = rows->entity;
    point(s, c->pos, rows, 0, 0, 3);
    if (c->vel >= 0) point(s, c->vel, rows, v->velocity_term[bulk], 0, 3);
    if (c->accel >= 0) point(s, c->accel, rows, 1, BOID_ACCEL_FIELD, 3);
    if (c->quat >= 0) point(s, c->quat, rows, v->orientation_term, 0, 4);
    if (c->spin >= 0) point(s, c->spin, rows, v->spin_term, 0, 3);
    if (bulk == JSL_BULK_PARTICLES && p->desc.particle_look) {
        p->desc.particle_look(p->desc.particle_look_arg, rows, p->rgba.at + row, p->size.at + row);
        s->data[c->radius][0] = p->size.at + row;
        s->data[c->color][0] = p->rgba.at + row;
        return;
    }
    if (c->radius >= 0) point(s, c->radius, rows, 1, PARTICLE_SIZE_FIELD, 1);
    if (c->color >= 0) point(s, c->color, rows, v->look_term[bulk], 0, 1);
}

static jsl_result gather(jsl_publisher *p, jsl_bulk bulk, const columns *c, jsl_state_frame *f) {
    int64_t total = jsl_publish_rows(p, bulk), row = 0;
    if (bulk == JSL_BULK_PARTICLES && p->desc.particle_look) {
        /* Kernels of the look may write whole groups of lanes. */
        JSL_TRY(jsl_array_reserve(&p->memory, &p->rgba, total + JSL_LANES));
        JSL_TRY(jsl_array_reserve(&p->memory, &p->size, total + JSL_LANES));
    }
    p->segment.count = 0;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(p->ecs, p->view.query[bulk], 0);
         jsl_query_next(&it, &rows);) {
        JSL_TRY(jsl_array_reserve(&p->memory, &p->segment, p->segment.count + 1));
        point_segment(p, bulk, c, &rows, row, &p->segment.at[p->segment.count++]);
        row += rows.count;
    }
    f->segment = p->segment.at;
    f->segment_count = (int)p->segment.count;
    f->total = f->population = row;
    return JSL_OK;
}

/* A number that changes when rows of the kind come, go or move. */
static uint64_t order_key(jsl_publisher *p, jsl_bulk bulk) {
    uint64_t key = 1;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(p->ecs, p->view.query[bulk], 0); jsl_query_next(&it, &rows);)
        key = jsl_mix64(
            key ^ jsl_mix64((uint64_t)rows.table << 32 ^ jsl_table_revision(p->ecs, rows.table)));
    return key;
}

/* -- Sending
 * -------------------------------------------------------------------------------------------- */

static int64_t small_reserve(const jsl_ring *ring) {
    return ring->cap / 16 < (1 << 20) ? ring->cap / 16 : 1 << 20;
}

unsigned jsl_publish_outlets(jsl_publisher *p, jsl_bulk bulk, int64_t bytes) {
    unsigned outlets = 0;
    for (int o = 0; o < JSL_OUTLETS; o++) {
        jsl_outlet *out = &p->outlet[o];
        if (!out->on) continue;
        bool block = p->desc.when_full == JSL_FULL_BLOCK;
        if (block || jsl_ring_fits(&out->ring, bytes, small_reserve(&out->ring))) {
            outlets |= 1u << o;
        } else {
            out->bulk[bulk].dropped++;
            out->dropped_before[bulk] = true;
        }
    }
    return outlets;
}

static void send_chunk(jsl_publisher *p, unsigned outlets, jsl_bulk bulk, jsl_state_frame *f,
                       int32_t index, int32_t count, int64_t first, int64_t n) {
    const char *channel = jsl_bulk_channel(bulk);
    int64_t size = jsl_state_size(f, n);
    const uint8_t *made = NULL;
    for (int o = 0; o < JSL_OUTLETS; o++) {
        if (!(outlets >> o & 1)) continue;
        jsl_outlet *out = &p->outlet[o];
        uint8_t *to =
            jsl_ring_reserve(&out->ring, channel, size, p->desc.when_full == JSL_FULL_BLOCK);
        JSL_ASSERT(to); /* there was room; blocking always finds it */
        if (made) {
            memcpy(to, made, (size_t)size);
        } else {
            jsl_state_encode(f, index, count, first, n, to);
            made = to;
        }
        /* Each outlet has its own history of drops; flags is no part of the CRC. */
        int32_t flags = f->flags | (out->dropped_before[bulk] ? JSL_STATE_DROPPED_BEFORE : 0);
        jsl_put_u32(to + 96, (uint32_t)flags);
        int64_t at = jsl_ring_commit(&out->ring, channel, size, p->stamp.wall_us);
        if (o == JSL_TO_LOG && index == 0) jsl_publish_note(p, at, JSL_INDEX_FRAME);
        out->bulk[bulk].chunks++;
        out->bulk[bulk].bytes += size;
    }
}

jsl_result jsl_publish_bulk(jsl_publisher *p, jsl_bulk bulk, bool due) {
    if (!p->view.query[bulk].id || p->hz[bulk] < 0) return JSL_OK;
    for (int o = 0; o < JSL_OUTLETS; o++) {
        p->outlet[o].bulk[bulk].offered += p->outlet[o].on;
        p->outlet[o].bulk[bulk].decimated += p->outlet[o].on && !due;
    }
    if (!due) return JSL_OK;
    uint64_t key = order_key(p, bulk);
    bool moved = key != p->order_key[bulk];
    jsl_state_frame f = {.wall_us = p->stamp.wall_us,
                         .session = p->stamp.session,
                         .step = p->stamp.step,
                         .sim_ns = p->stamp.sim_ns,
                         .frame_seq = p->frame_seq[bulk]++,
                         .stride = 1,
                         .scene_rev = p->scene_rev,
                         .order_rev = p->order_rev[bulk] + moved};
    columns c = choose_columns(p, bulk, moved, &f);
    jsl_result r = gather(p, bulk, &c, &f);
    const char *channel = jsl_bulk_channel(bulk);
    int64_t each = jsl_state_chunk_elements(&f, channel);
    int64_t chunks = jsl_state_chunk_count(&f, channel);
    int64_t bytes = chunks * (JSL_EVENT_HEAD + (int64_t)strlen(channel) + jsl_state_size(&f, 0)) +
                    jsl_state_size(&f, f.total) - jsl_state_size(&f, 0);
    unsigned outlets = r == JSL_OK ? jsl_publish_outlets(p, bulk, bytes) : 0;
    for (int o = 0; r != JSL_OK && o < JSL_OUTLETS; o++)
        p->outlet[o].bulk[bulk].dropped += p->outlet[o].on;
    for (int64_t i = 0; outlets && i < chunks; i++) {
        int64_t first = i * each, n = f.total - first < each ? f.total - first : each;
        send_chunk(p, outlets, bulk, &f, (int32_t)i, (int32_t)chunks, first, n);
    }
    for (int o = 0; o < JSL_OUTLETS; o++) {
        if (!(outlets >> o & 1)) continue;
        jsl_ring_publish(&p->outlet[o].ring);
        p->outlet[o].bulk[bulk].queued++;
        p->outlet[o].dropped_before[bulk] = false;
    }
    if (outlets) { /* ids that nobody got are sent again */
        p->order_key[bulk] = key;
        p->order_rev[bulk] = f.order_rev;
    }
    return r;
}

/* -- The body table
 * --------------------------------------------------------------------------------------- */

static double inverse(jsl_real x) { return x > 0 ? 1.0 / (double)x : 0.0; }

#define INFO_CHUNK 1600 /* 40 bytes each: one datagram */
typedef struct info_chunk {
    int32_t n;
    int64_t id[INFO_CHUNK];
    int32_t shape[INFO_CHUNK], rgba[INFO_CHUNK];
    float mass[INFO_CHUNK], ixx[INFO_CHUNK], iyy[INFO_CHUNK], izz[INFO_CHUNK];
    float friction[INFO_CHUNK], restitution[INFO_CHUNK];
} info_chunk;

/* Order-independent: a table that was only sorted is not told of again. */
static uint64_t body_set_key(jsl_publisher *p) {
    const jsl_world_view *v = &p->view;
    uint64_t key = 0;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(p->ecs, v->query[JSL_BULK_BODIES], 0);
         jsl_query_next(&it, &rows);) {
        jsl_collider_columns c = jsl_collider_of(&rows, 1);
        int look = v->look_term[JSL_BULK_BODIES], mass = v->mass_term;
        const uint32_t *rgba = look >= 0 ? rows.column[rows.first[look]] : NULL;
        const jsl_real *inv_mass = mass >= 0 ? rows.column[rows.first[mass]] : NULL;
        for (int64_t i = 0; i < rows.count; i++) {
            double m = inv_mass ? (double)inv_mass[i] : 0.0;
            uint64_t bits;
            memcpy(&bits, &m, 8);
            uint64_t look_bits = rgba ? (uint64_t)rgba[i] + 1 : 0;
            key += jsl_mix64(jsl_entity_id(rows.entity[i]) ^
                             jsl_mix64(((uint64_t)c.shape[i] << 32 | c.material[i]) ^
                                       jsl_mix64(look_bits ^ jsl_mix64(bits + 1))));
        }
    }
    return key;
}

static void send_info(jsl_publisher *p, info_chunk *chunk, int32_t index, int32_t count) {
    jsl_msg_body_info m = {JSL_STAMPED(p),
                           .scene_rev = p->scene_rev,
                           .chunk_index = index,
                           .chunk_count = count,
                           .n = chunk->n,
                           .id = chunk->id,
                           .shape_id = chunk->shape,
                           .mass = chunk->mass,
                           .ixx = chunk->ixx,
                           .iyy = chunk->iyy,
                           .izz = chunk->izz,
                           .friction = chunk->friction,
                           .restitution = chunk->restitution,
                           .rgba = chunk->rgba};
    jsl_publish_message(p, ~0u, "JOSTLE_BODY_INFO", JSL_LCM_BODY_INFO, &m,
                        index == 0 ? JSL_INDEX_SCENE : 0);
    chunk->n = 0;
}

static void put_info(jsl_publisher *p, const jsl_rows *rows, int64_t i, info_chunk *chunk) {
    const jsl_world_view *v = &p->view;
    jsl_collider_columns c = jsl_collider_of(rows, 1);
    int32_t k = chunk->n++;
    chunk->id[k] = (int64_t)jsl_entity_id(rows->entity[i]);
    chunk->shape[k] = (int32_t)c.shape[i];
    int look = v->look_term[JSL_BULK_BODIES];
    bool has_look = look >= 0 && rows->column[rows->first[look]];
    chunk->rgba[k] =
        has_look ? (int32_t)((const uint32_t *)rows->column[rows->first[look]])[i] : -1;
    chunk->mass[k] = chunk->ixx[k] = chunk->iyy[k] = chunk->izz[k] = 0.0f;
    if (v->mass_term >= 0 && rows->column[rows->first[v->mass_term]]) {
        jsl_mass_columns m = jsl_mass_of(rows, v->mass_term);
        chunk->mass[k] = (float)inverse(m.inv_mass[i]);
        chunk->ixx[k] = (float)inverse(m.inv_ixx[i]);
        chunk->iyy[k] = (float)inverse(m.inv_iyy[i]);
        chunk->izz[k] = (float)inverse(m.inv_izz[i]);
    }
    jsl_material_desc material = {JSL_R(0.6), 0};
    if (c.material[i]) (void)jsl_material_get(p->world, (jsl_material){c.material[i]}, &material);
    chunk->friction[k] = (float)material.friction;
    chunk->restitution[k] = (float)material.restitution;
}

jsl_result jsl_publish_body_info(jsl_publisher *p) {
    if (!p->view.query[JSL_BULK_BODIES].id) return JSL_OK;
    uint64_t key = body_set_key(p);
    if (p->body_told && key == p->body_key) return JSL_OK;
    JSL_TRY(jsl_array_reserve(&p->memory, &p->table, (int64_t)sizeof(info_chunk)));
    info_chunk *chunk = (info_chunk *)(void *)p->table.at;
    chunk->n = 0;
    p->scene_rev++;
    JSL_TRY(jsl_publish_shapes(p));
    /* Shapes used the same scratch, which may have moved. */
    JSL_TRY(jsl_array_reserve(&p->memory, &p->table, (int64_t)sizeof(info_chunk)));
    chunk = (info_chunk *)(void *)p->table.at;
    chunk->n = 0;
    int64_t total = jsl_publish_rows(p, JSL_BULK_BODIES);
    int32_t count = total ? (int32_t)((total + INFO_CHUNK - 1) / INFO_CHUNK) : 1, index = 0;
    int64_t dropped = p->small_dropped;
    jsl_rows rows;
    for (jsl_iter it = jsl_query_begin(p->ecs, p->view.query[JSL_BULK_BODIES], 0);
         jsl_query_next(&it, &rows);)
        for (int64_t i = 0; i < rows.count; i++) {
            put_info(p, &rows, i, chunk);
            if (chunk->n == INFO_CHUNK) send_info(p, chunk, index++, count);
        }
    if (chunk->n || !total) send_info(p, chunk, index, count);
    p->body_told = p->small_dropped == dropped; /* else try again with the next frame */
    p->body_key = key;
    return JSL_OK;
}
