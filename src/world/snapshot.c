/* SPDX-License-Identifier: MIT
 * The state as a whole: hash, save, restore. An image is a header, sections with their lengths, and
 * a checksum over all of it:
 *
 *   header | clock and settings | shapes | materials | one section a room | the ECS image
 *
 * Numbers are little-endian; reals are kept as doubles, so that both precisions read both.
 */
#include "world/world_internal.h"

#define IMAGE_MAGIC 0x31574c534aull /* "JSLW1" */
#define IMAGE_VERSION 1u

typedef struct cursor {
    uint8_t *at; /* null: only counts */
    size_t used, size;
    bool bad; /* read past the end */
} cursor;

static void put_bytes(cursor *c, const void *data, size_t n) {
    if (c->at) memcpy(c->at + c->used, data, n);
    c->used += n;
}

static void put_u64(cursor *c, uint64_t x) {
    uint8_t b[8];
    for (int i = 0; i < 8; i++) b[i] = (uint8_t)(x >> (8 * i));
    put_bytes(c, b, 8);
}

static void put_real(cursor *c, double x) {
    uint64_t u;
    memcpy(&u, &x, 8);
    put_u64(c, u);
}

static void put_vec3(cursor *c, jsl_vec3 v) {
    put_real(c, (double)v.x);
    put_real(c, (double)v.y);
    put_real(c, (double)v.z);
}

static uint64_t get_u64(cursor *c) {
    uint64_t x = 0;
    if (c->size - c->used < 8) {
        c->bad = true;
        c->used = c->size;
        return 0;
    }
    for (int i = 0; i < 8; i++) x |= (uint64_t)c->at[c->used + (size_t)i] << (8 * i);
    c->used += 8;
    return x;
}

static double get_real(cursor *c) {
    uint64_t u = get_u64(c);
    double x;
    memcpy(&x, &u, 8);
    return x;
}

static jsl_vec3 get_vec3(cursor *c) {
    jsl_real x = (jsl_real)get_real(c), y = (jsl_real)get_real(c), z = (jsl_real)get_real(c);
    return jsl_v3(x, y, z);
}

/* -- Clock, settings, shapes, materials
 * ----------------------------------------------------------------------- */

static void put_settings(cursor *c, const jsl_world *w) {
    const jsl_world_desc *s = &w->settings;
    put_u64(c, (uint64_t)w->clock.epoch_ns);
    put_u64(c, w->clock.steps);
    put_real(c, w->clock.dt);
    put_u64(c, w->step);
    put_u64(c, s->seed);
    put_real(c, (double)s->dt);
    put_u64(c, (uint64_t)s->substeps);
    put_vec3(c, s->gravity);
    put_vec3(c, s->wind.velocity);
    put_vec3(c, s->wind.gust_direction);
    put_real(c, (double)s->wind.gust);
    put_real(c, (double)s->wind.gust_period);
}

static void get_settings(cursor *c, jsl_world *w) {
    jsl_world_desc *s = &w->settings;
    w->clock.epoch_ns = (int64_t)get_u64(c);
    w->clock.steps = get_u64(c);
    w->clock.dt = get_real(c);
    w->step = get_u64(c);
    s->seed = get_u64(c);
    s->dt = (jsl_real)get_real(c);
    s->substeps = (int)get_u64(c);
    s->gravity = get_vec3(c);
    s->wind.velocity = get_vec3(c);
    s->wind.gust_direction = get_vec3(c);
    s->wind.gust = (jsl_real)get_real(c);
    s->wind.gust_period = (jsl_real)get_real(c);
}

static void put_tables(cursor *c, const jsl_world *w) {
    put_u64(c, (uint64_t)w->shape.count);
    for (int64_t i = 0; i < w->shape.count; i++) {
        put_u64(c, (uint64_t)w->shape.at[i].kind);
        put_real(c, (double)w->shape.at[i].radius);
        put_vec3(c, w->shape.at[i].half);
    }
    put_u64(c, (uint64_t)w->material.count);
    for (int64_t i = 0; i < w->material.count; i++) {
        put_real(c, (double)w->material.at[i].friction);
        put_real(c, (double)w->material.at[i].restitution);
    }
}

/* Into a scratch world, whose arrays the caller swaps in when everything has been read. */
static jsl_result get_tables(cursor *c, jsl_world *scratch) {
    uint64_t n = get_u64(c);
    if (c->bad || n > (c->size - c->used) / 40) return JSL_ERR_FORMAT;
    JSL_TRY(jsl_array_reserve(scratch->memory, &scratch->shape, (int64_t)n + 1));
    for (uint64_t i = 0; i < n; i++) {
        jsl_shape_desc s = {.kind = (jsl_shape_kind)get_u64(c)};
        s.radius = (jsl_real)get_real(c);
        s.half = get_vec3(c);
        if (jsl_shape_check(&s) != JSL_OK) return JSL_ERR_FORMAT;
        scratch->shape.at[scratch->shape.count++] = s;
    }
    n = get_u64(c);
    if (c->bad || n > (c->size - c->used) / 16) return JSL_ERR_FORMAT;
    JSL_TRY(jsl_array_reserve(scratch->memory, &scratch->material, (int64_t)n + 1));
    for (uint64_t i = 0; i < n; i++) {
        jsl_real friction = (jsl_real)get_real(c), restitution = (jsl_real)get_real(c);
        scratch->material.at[scratch->material.count++] =
            (jsl_material_desc){friction, restitution};
    }
    return c->bad ? JSL_ERR_FORMAT : JSL_OK;
}

/* -- Hash
 * ----------------------------------------------------------------------------------------------------
 */

/* Tables are hashed by content. Shape handles in colliders are STATE, so worlds that numbered equal
 * shapes differently differ. */
uint64_t jsl_world_hash(jsl_world *w) {
    if (!w) return 0;
    uint8_t bytes[256];
    cursor c = {bytes, 0, sizeof bytes, false};
    put_settings(&c, w);
    uint64_t hash = jsl_hash_bytes(bytes, c.used, IMAGE_VERSION);
    for (int64_t i = 0; i < w->shape.count; i++) {
        c.used = 0;
        put_u64(&c, (uint64_t)w->shape.at[i].kind);
        put_real(&c, (double)w->shape.at[i].radius);
        put_vec3(&c, w->shape.at[i].half);
        hash = jsl_mix64(hash) + jsl_hash_bytes(bytes, c.used, 1);
    }
    for (int i = 0; i < JSL_ROOM_COUNT; i++)
        if (w->room[i] && w->hooks[i]->hash) hash = jsl_mix64(hash) + w->hooks[i]->hash(w->room[i]);
    return jsl_mix64(hash) + jsl_ecs_hash(w->ecs);
}

/* -- Save
 * ------------------------------------------------------------------------------------------------------
 */

static size_t room_size(const jsl_world *w, int i) {
    return w->room[i] && w->hooks[i]->save_size ? w->hooks[i]->save_size(w->room[i]) : 0;
}

static jsl_result put_image(cursor *c, jsl_world *w) {
    put_u64(c, IMAGE_MAGIC);
    put_u64(c, IMAGE_VERSION);
    put_settings(c, w);
    put_tables(c, w);
    for (int i = 0; i < JSL_ROOM_COUNT; i++) {
        size_t n = room_size(w, i);
        put_u64(c, n);
        if (c->at && n) JSL_TRY(w->hooks[i]->save(w->room[i], c->at + c->used, n));
        c->used += n;
    }
    size_t n = jsl_ecs_save_size(w->ecs);
    put_u64(c, n);
    if (c->at) JSL_TRY(jsl_ecs_save(w->ecs, c->at + c->used, n));
    c->used += n;
    put_u64(c, c->at ? jsl_hash_bytes(c->at, c->used, IMAGE_VERSION) : 0);
    return JSL_OK;
}

jsl_result jsl_world_save(jsl_world *w, void **bytes, size_t *size) {
    if (!w || !bytes || !size) return JSL_ERR_ARGUMENT;
    *bytes = NULL;
    *size = 0;
    cursor c = {0};
    JSL_TRY(put_image(&c, w));
    size_t n = c.used;
    c = (cursor){jsl_alloc(w->memory, n), 0, n, false};
    if (!c.at)
        return jsl_fail(&w->settings.logger, JSL_ERR_MEMORY,
                        "out of memory for an image of %zu bytes", n);
    jsl_result result = put_image(&c, w);
    if (result != JSL_OK) {
        jsl_free(w->memory, c.at, n);
        return result;
    }
    *bytes = c.at;
    *size = n;
    return JSL_OK;
}

void jsl_world_free_bytes(jsl_world *w, void *bytes, size_t size) {
    if (w && bytes) jsl_free(w->memory, bytes, size);
}

/* -- Restore
 * ------------------------------------------------------------------------------------------------------
 */

static jsl_result check_envelope(const jsl_world *w, const uint8_t *bytes, size_t size) {
    const jsl_logger *log = &w->settings.logger;
    if (size < 24) return jsl_fail(log, JSL_ERR_FORMAT, "image: %zu bytes are too few", size);
    cursor c = {(uint8_t *)(uintptr_t)bytes, 0, size, false};
    if (get_u64(&c) != IMAGE_MAGIC)
        return jsl_fail(log, JSL_ERR_FORMAT, "image: not of a jostle world");
    uint64_t version = get_u64(&c);
    c.used = size - 8;
    if (get_u64(&c) != jsl_hash_bytes(bytes, size - 8, IMAGE_VERSION))
        return jsl_fail(log, JSL_ERR_FORMAT, "image: the checksum does not match");
    if (version != IMAGE_VERSION)
        return jsl_fail(log, JSL_ERR_VERSION, "image: version %llu, this library reads %u",
                        (unsigned long long)version, IMAGE_VERSION);
    return JSL_OK;
}

/* Restores rooms and entities. A room that fails after others succeeded is undone from `before`. */
static jsl_result get_rooms(cursor *c, jsl_world *w) {
    const uint8_t *section[JSL_ROOM_COUNT];
    size_t length[JSL_ROOM_COUNT];
    for (int i = 0; i < JSL_ROOM_COUNT; i++) {
        uint64_t n = get_u64(c);
        if (c->bad || n > c->size - c->used) return JSL_ERR_FORMAT;
        section[i] = c->at + c->used;
        length[i] = (size_t)n;
        c->used += (size_t)n;
        if (n && !(w->room[i] && w->hooks[i]->restore))
            return jsl_fail(&w->settings.logger, JSL_ERR_VERSION,
                            "image: holds state of a kind that this world has not been told to use "
                            "(see jsl_world_use_*)");
    }
    uint64_t n = get_u64(c);
    if (c->bad || n > c->size - c->used) return JSL_ERR_FORMAT;
    JSL_TRY(jsl_ecs_restore(w->ecs, c->at + c->used, (size_t)n));
    for (int i = 0; i < JSL_ROOM_COUNT; i++) {
        if (w->room[i] && w->hooks[i]->forget) w->hooks[i]->forget(w->room[i]);
        if (length[i]) JSL_TRY(w->hooks[i]->restore(w->room[i], section[i], length[i]));
    }
    return JSL_OK;
}

static jsl_result restore_checked(jsl_world *w, const uint8_t *bytes, size_t size) {
    cursor c = {(uint8_t *)(uintptr_t)bytes, 16, size - 8, false};
    jsl_world scratch = {.memory = w->memory};
    get_settings(&c, &scratch);
    jsl_result result = get_tables(&c, &scratch);
    if (result == JSL_OK) result = get_rooms(&c, w);
    if (result != JSL_OK) {
        jsl_array_free(w->memory, &scratch.shape);
        jsl_array_free(w->memory, &scratch.material);
        return result;
    }
    jsl_array_free(w->memory, &w->shape);
    jsl_array_free(w->memory, &w->material);
    memcpy(&w->shape, &scratch.shape, sizeof w->shape);
    memcpy(&w->material, &scratch.material, sizeof w->material);
    w->clock = scratch.clock;
    w->step = scratch.step;
    w->settings.seed = scratch.settings.seed;
    w->settings.dt = scratch.settings.dt;
    w->settings.substeps = scratch.settings.substeps;
    w->settings.gravity = scratch.settings.gravity;
    w->settings.wind = scratch.settings.wind;
    return JSL_OK;
}

jsl_result jsl_world_restore(jsl_world *w, const void *bytes, size_t size) {
    if (!w || !bytes) return JSL_ERR_ARGUMENT;
    JSL_TRY(check_envelope(w, bytes, size));
    /* What fails half way is undone: the checksum was right, so that takes a lack of memory or a
     * foreign schema. */
    void *before;
    size_t before_size;
    JSL_TRY(jsl_world_save(w, &before, &before_size));
    jsl_result result = restore_checked(w, bytes, size);
    if (result != JSL_OK) {
        jsl_fail(&w->settings.logger, result, "image: %s", jsl_result_text(result));
        restore_checked(w, before, before_size);
    }
    jsl_world_free_bytes(w, before, before_size);
    return result;
}
