/* SPDX-License-Identifier: MIT
 * How particles look: colour and size over life. Floor 4.
 */
#include "particle/room.h"

typedef struct look {
    int keys;
    jsl_particle_key key[JSL_PARTICLE_KEYS];
} look;

static look look_of(const jsl_particle_room *room, jsl_entity emitter) {
    jsl_emitter_desc desc;
    look l = {0};
    if (jsl_entity_has(room->ecs, emitter, room->look) &&
        jsl_particle_room_emitter_get((jsl_particle_room *)room, (jsl_emitter){emitter}, &desc) ==
            JSL_OK) {
        l.keys = desc.key_count;
        memcpy(l.key, desc.key, sizeof l.key);
    }
    return l;
}

static uint32_t mix_channel(uint32_t a, uint32_t b, int shift, jsl_real f) {
    jsl_real x = (jsl_real)(a >> shift & 255u), y = (jsl_real)(b >> shift & 255u);
    return (uint32_t)(x + (y - x) * f + JSL_R(0.5)) << shift;
}

static uint32_t mix_rgba(uint32_t a, uint32_t b, jsl_real f) {
    if (a == b) return a;
    return mix_channel(a, b, 24, f) | mix_channel(a, b, 16, f) | mix_channel(a, b, 8, f) |
           mix_channel(a, b, 0, f);
}

static void appearance_at(const look *l, jsl_real at, uint32_t *rgba, jsl_real *scale) {
    int i = 0;
    while (i < l->keys && l->key[i].at <= at) i++;
    const jsl_particle_key *a = &l->key[i > 0 ? i - 1 : 0];
    const jsl_particle_key *b = &l->key[i < l->keys ? i : l->keys - 1];
    jsl_real span = b->at - a->at;
    jsl_real f = span > 0 ? jsl_clamp((at - a->at) / span, 0, 1) : 0;
    *rgba = mix_rgba(a->rgba, b->rgba, f);
    *scale = a->size_scale + (b->size_scale - a->size_scale) * f;
}

jsl_result jsl_particle_room_colors(jsl_particle_room *room, const jsl_rows *rows, uint32_t *rgba,
                                    float *size) {
    jsl_rows view;
    if (!rows) return JSL_ERR_ARGUMENT;
    if (rows->count == 0) return JSL_OK;
    if (!jsl_entity_has(room->ecs, rows->entity[0], room->particle))
        return jsl_fail(jsl_ecs_logger(room->ecs), JSL_ERR_ARGUMENT,
                        "jsl_particle_appearance: the rows are not of particles");
    JSL_TRY(jsl_rows_of_entity(room->ecs, rows->entity[0], room->particle, &view));
    jsl_particle_columns q = jsl_particle_of(&view, 0);
    jsl_entity last = {0, 0};
    look l = {0};
    for (int64_t i = 0; i < rows->count; i++) {
        if (!jsl_entity_equal(q.emitter[i], last)) l = look_of(room, last = q.emitter[i]);
        uint32_t color = 0xffffffffu;
        jsl_real scale = 1;
        if (l.keys > 0) appearance_at(&l, q.life[i] > 0 ? q.age[i] / q.life[i] : 0, &color, &scale);
        if (rgba) rgba[i] = color;
        if (size) size[i] = (float)(q.size[i] * scale);
    }
    return JSL_OK;
}
