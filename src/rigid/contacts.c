/* SPDX-License-Identifier: MIT
 * contacts.c - the contact table, and the cache of contacts as state: saved, restored, hashed.
 */
#include "rigid/room.h"

/* -- The table ------------------------------------------------------------------------------- */

static jsl_vec3 mean_point(const jsl_rigid_room *room, const jsl_rigid_pair *p, const jsl_real *geo,
                           int32_t second) {
    jsl_vec3 sum = jsl_v3(0, 0, 0);
    for (int j = 0; j < p->count; j++) {
        const jsl_real *b = geo + JSL_GEO_B + 4 * j;
        sum = jsl_add(sum, jsl_v3(b[0], b[1], b[2]));
    }
    const jsl_real *pose = room->pose.at + (int64_t)second * JSL_POSE;
    jsl_quat q = {pose[4], pose[5], pose[6], pose[7]};
    return jsl_add(jsl_v3(pose[0], pose[1], pose[2]),
                   jsl_rotate(q, jsl_scale(sum, 1 / (jsl_real)p->count)));
}

static jsl_contact contact_of(const jsl_rigid_room *room, int64_t k) {
    const jsl_rigid_pair *p = &room->pair.at[k];
    const jsl_real *geo = JSL_RIGID_GEO(room, k);
    jsl_contact c = {.a = room->slot.at[p->a].entity,
                     .b = room->slot.at[p->b].entity,
                     .phase = !jsl_rigid_touching(room, k) ? JSL_CONTACT_END
                              : p->was_touching            ? JSL_CONTACT_PERSIST
                                                           : JSL_CONTACT_BEGIN};
    if (!jsl_rigid_touching(room, k)) return c;
    int32_t first = p->swapped ? p->b : p->a, second = p->swapped ? p->a : p->b;
    const jsl_real *pose = room->pose.at + (int64_t)first * JSL_POSE;
    jsl_vec3 n =
        jsl_rotate((jsl_quat){pose[4], pose[5], pose[6], pose[7]}, jsl_v3(geo[0], geo[1], geo[2]));
    c.point = mean_point(room, p, geo, second);
    c.normal = p->swapped ? jsl_neg(n) : n;
    c.depth = -geo[JSL_GEO_GAP];
    c.normal_impulse = geo[JSL_GEO_PUSH];
    jsl_vec3 rub = jsl_v3(geo[JSL_GEO_RUB], geo[JSL_GEO_RUB + 1], geo[JSL_GEO_RUB + 2]);
    c.tangent_impulse = p->swapped ? jsl_neg(rub) : rub;
    c.points = p->count;
    return c;
}

static jsl_entity entity_of(const jsl_rigid_room *room, uint64_t id) {
    jsl_entity e = jsl_entity_at(room->ecs, (uint32_t)id);
    return !jsl_entity_is_null(e) && jsl_entity_id(e) == id ? e : (jsl_entity){0, 0};
}

jsl_result jsl_rigid_room_contacts(jsl_rigid_room *room, const jsl_contact **out, int64_t *count) {
    if (!room->contacts_valid) {
        room->contact.count = 0;
        int64_t most = room->ended.count;
        for (int64_t k = 0; k < room->pair.count; k++)
            most += jsl_rigid_touching(room, k) || room->pair.at[k].was_touching;
        JSL_TRY(jsl_array_reserve(room->memory, &room->contact, most));
        for (int64_t k = 0; room->pairs_valid && k < room->pair.count; k++)
            if (jsl_rigid_touching(room, k))
                room->contact.at[room->contact.count++] = contact_of(room, k);
        for (int64_t k = 0; room->pairs_valid && k < room->pair.count; k++)
            if (!jsl_rigid_touching(room, k) && room->pair.at[k].was_touching)
                room->contact.at[room->contact.count++] = contact_of(room, k);
        for (int64_t k = 0; k < room->ended.count; k++)
            room->contact.at[room->contact.count++] =
                (jsl_contact){.a = entity_of(room, room->ended.at[k].id_a),
                              .b = entity_of(room, room->ended.at[k].id_b),
                              .phase = JSL_CONTACT_END};
        room->contacts_valid = true;
    }
    *out = room->contact.at;
    *count = room->contact.count;
    return JSL_OK;
}

/* -- The cache as state ---------------------------------------------------------------------- */

#define CACHE_MAGIC 0x314352ull /* "RC1" */
#define CACHE_SETTINGS 8
#define CACHE_WORDS                                                                                \
    (4 + 2 + JSL_GEO) /* ids, bytes and features, gap and spare, reals: all 64 bits */

static bool is_state(const jsl_rigid_pair *p) { return p->count > 0; }

static int64_t state_count(const jsl_rigid_room *room) {
    int64_t n = 0;
    for (int64_t k = 0; k < room->pair.count; k++) n += is_state(&room->pair.at[k]);
    return n;
}

static uint64_t bits_of(double x) {
    uint64_t u;
    memcpy(&u, &x, sizeof u);
    return u;
}
static double real_of(uint64_t u) {
    double x;
    memcpy(&x, &u, sizeof x);
    return x;
}

static void pack_settings(const jsl_rigid_settings *s, uint64_t w[CACHE_SETTINGS]) {
    const double value[CACHE_SETTINGS] = {(double)s->rotation,
                                          (double)s->contact_hertz,
                                          (double)s->damping_ratio,
                                          (double)s->push_speed,
                                          (double)s->restitution_threshold,
                                          (double)s->margin,
                                          (double)s->keep,
                                          (double)s->max_speed};
    for (int i = 0; i < CACHE_SETTINGS; i++) w[i] = bits_of(value[i]);
}

static void pack(const jsl_rigid_room *room, int64_t k, uint64_t w[CACHE_WORDS]) {
    const jsl_rigid_pair *p = &room->pair.at[k];
    const jsl_real *geo = JSL_RIGID_GEO(room, k);
    w[0] = p->id_a, w[1] = p->id_b;
    w[2] = (uint64_t)p->count | (uint64_t)p->swapped << 8 | (uint64_t)p->built << 24 |
           (uint64_t)p->wall << 32;
    w[3] = (uint64_t)p->shape_a << 32 | p->shape_b;
    w[4] = (uint64_t)p->feature[0] << 32 | p->feature[1];
    w[5] = (uint64_t)p->feature[2] << 32 | p->feature[3];
    for (int i = 0; i < JSL_GEO; i++) w[6 + i] = bits_of((double)geo[i]);
}

static void put_word(unsigned char *to, uint64_t w) {
    for (int i = 0; i < 8; i++) to[i] = (unsigned char)(w >> 8 * i);
}
static uint64_t get_word(const unsigned char *from) {
    uint64_t w = 0;
    for (int i = 0; i < 8; i++) w |= (uint64_t)from[i] << 8 * i;
    return w;
}

size_t jsl_rigid_room_save_size(const jsl_rigid_room *room) {
    return 8 * (2 + CACHE_SETTINGS + (size_t)state_count(room) * CACHE_WORDS + 1);
}

jsl_result jsl_rigid_room_save(const jsl_rigid_room *room, void *bytes, size_t size) {
    if (size < jsl_rigid_room_save_size(room))
        return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_ARGUMENT,
                        "rigid save: %zu bytes are too few", size);
    unsigned char *to = bytes;
    uint64_t settings[CACHE_SETTINGS], w[CACHE_WORDS];
    put_word(to, CACHE_MAGIC), put_word(to + 8, (uint64_t)state_count(room)), to += 16;
    pack_settings(&room->settings, settings);
    for (int i = 0; i < CACHE_SETTINGS; i++, to += 8) put_word(to, settings[i]);
    for (int64_t k = 0; k < room->pair.count; k++) {
        if (!is_state(&room->pair.at[k])) continue;
        pack(room, k, w);
        for (int i = 0; i < CACHE_WORDS; i++, to += 8) put_word(to, w[i]);
    }
    put_word(to, jsl_hash_bytes(bytes, (size_t)(to - (unsigned char *)bytes), CACHE_MAGIC));
    return JSL_OK;
}

static jsl_result check_image(const jsl_rigid_room *room, const unsigned char *from, size_t size,
                              uint64_t *count) {
    const jsl_logger *log = jsl_ecs_logger(room->ecs);
    const size_t head = 8 * (2 + CACHE_SETTINGS);
    if (size < head + 8 || get_word(from) != CACHE_MAGIC)
        return jsl_fail(log, JSL_ERR_FORMAT, "rigid restore: not a contact cache");
    *count = get_word(from + 8);
    if (*count > (size - head - 8) / (8 * CACHE_WORDS))
        return jsl_fail(log, JSL_ERR_FORMAT, "rigid restore: shorter than it says");
    size_t body = head + 8 * CACHE_WORDS * (size_t)*count;
    if (get_word(from + body) != jsl_hash_bytes(from, body, CACHE_MAGIC))
        return jsl_fail(log, JSL_ERR_FORMAT, "rigid restore: checksum differs");
    uint64_t last[2] = {0, 0};
    for (uint64_t k = 0; k < *count; k++) {
        const unsigned char *w = from + head + 8 * CACHE_WORDS * k;
        uint64_t a = get_word(w), b = get_word(w + 8), flags = get_word(w + 16);
        bool after = a > last[0] || (a == last[0] && b > last[1]);
        if (!after || a >= b || (flags & 0xff) > JSL_MAX_MANIFOLD)
            return jsl_fail(log, JSL_ERR_FORMAT, "rigid restore: contact %llu is damaged",
                            (unsigned long long)k);
        last[0] = a, last[1] = b;
    }
    return JSL_OK;
}

jsl_result jsl_rigid_room_restore(jsl_rigid_room *room, const void *bytes, size_t size) {
    const unsigned char *from = bytes;
    uint64_t count = 0;
    JSL_TRY(check_image(room, from, size, &count));
    double value[CACHE_SETTINGS];
    for (int i = 0; i < CACHE_SETTINGS; i++) value[i] = real_of(get_word(from + 16 + 8 * i));
    jsl_rigid_settings s = {
        (jsl_rotation)(value[0] >= 0 && value[0] < JSL_ROTATION_COUNT ? (int)value[0] : -1),
        (jsl_real)value[1],
        (jsl_real)value[2],
        (jsl_real)value[3],
        (jsl_real)value[4],
        (jsl_real)value[5],
        (jsl_real)value[6],
        (jsl_real)value[7]};
    JSL_TRY(jsl_array_reserve(room->memory, &room->old_pair, (int64_t)count));
    JSL_TRY(
        jsl_array_reserve(room->memory, &room->old_geo, ((int64_t)count + JSL_SPARES) * JSL_GEO));
    JSL_TRY(jsl_rigid_room_set(room, &s));
    from += 8 * (2 + CACHE_SETTINGS);
    for (uint64_t k = 0; k < count; k++, from += 8 * CACHE_WORDS) {
        uint64_t f = get_word(from + 16), shapes = get_word(from + 24), f0 = get_word(from + 32),
                 f1 = get_word(from + 40);
        room->old_pair.at[k] = (jsl_rigid_pair){
            .id_a = get_word(from),
            .id_b = get_word(from + 8),
            .count = (uint8_t)f,
            .swapped = f >> 8 & 1,
            .built = f >> 24 & 1,
            .wall = f >> 32 & 1,
            .shape_a = (uint32_t)(shapes >> 32),
            .shape_b = (uint32_t)shapes,
            .feature = {(uint32_t)(f0 >> 32), (uint32_t)f0, (uint32_t)(f1 >> 32), (uint32_t)f1}};
        for (int i = 0; i < JSL_GEO; i++)
            room->old_geo.at[k * JSL_GEO + (uint64_t)i] =
                (jsl_real)real_of(get_word(from + 8 * (6 + i)));
    }
    jsl_rigid_swap_pairs(room);
    room->pair.count = (int64_t)count;
    room->pairs_valid = room->contacts_valid = false;
    room->slot.count = room->items = room->active.count = room->ended.count = 0;
    return JSL_OK;
}

uint64_t jsl_rigid_room_hash(const jsl_rigid_room *room) {
    uint64_t settings[CACHE_SETTINGS], w[CACHE_WORDS];
    pack_settings(&room->settings, settings);
    uint64_t hash = jsl_hash_bytes(settings, sizeof settings, CACHE_MAGIC);
    for (int64_t k = 0; k < room->pair.count; k++) {
        if (!is_state(&room->pair.at[k])) continue;
        pack(room, k, w);
        hash = jsl_hash_bytes(w, sizeof w, hash);
    }
    return hash;
}
