/* SPDX-License-Identifier: MIT
 * sprites.c - particles: culled, stretched along their motion, ordered by depth, turned into
 * corners.
 *
 * A streak covers what the particle sweeps while a shutter is open (Reeves 1983). Order is from far
 * to near, as blending wants it; light that only adds needs none.
 */
#include "render/renderer.h"

#define SHUTTER (1.0f / 50)
#define LONGEST 5.0f /* streak, in sizes */
#define SMALLEST                                                                                   \
    0.65f /* half axis in pixels: thinner ones flicker, so they get fainter instead                \
           */
#define NEAR_SIZE                                                                                  \
    0.10f /* half axis in heights of the picture, from which a sprite fades, for it would ... */
#define NEAREST_SIZE 0.3f /* ... blind the view */

static int64_t particle_count(const jsl_frame *frame) {
    const jsl_frame_particles *p = &frame->particles;
    return p->px && p->py && p->pz && p->count > 0 ? p->count : 0;
}

static float size_of(const jsl_frame_particles *p, int64_t i) {
    return p->size ? p->size[i] : JSL_PARTICLE_SIZE;
}

/* False when it is out of sight. */
static bool project(const jsl_renderer *r, const jsl_frame_particles *p, int64_t i,
                    jsl_sprite *out) {
    const jsl_view *view = &r->view;
    jsl_f3 d = jsl_f3_sub(jsl_f3_make(p->px[i], p->py[i], p->pz[i]), view->eye);
    float z = jsl_f3_dot(d, view->forward), size = size_of(p, i);
    /* Written so that NaN fails too. */
    if (!(z > 2 * view->near && z < JSL_DRAW_LIMIT && size > 0 && size < JSL_DRAW_LIMIT))
        return false;
    float x = jsl_f3_dot(d, view->right), y = jsl_f3_dot(d, view->up);
    float reach = 2 * size * (1 + LONGEST);
    if (!(fabsf(x) < z * view->tan_x + reach && fabsf(y) < z * view->tan_y + reach)) return false;
    uint8_t *rgba = out->rgba;
    jsl_rgba_bytes(p->rgba ? p->rgba[i] : 0xffffffff, rgba);

    jsl_f3 v = {jsl_component(p->vx, i), jsl_component(p->vy, i), jsl_component(p->vz, i)};
    float ahead = jsl_f3_dot(v, view->forward) / z;
    float dx = jsl_f3_dot(v, view->right) - x * ahead, dy = jsl_f3_dot(v, view->up) - y * ahead;
    float speed = sqrtf(dx * dx + dy * dy);
    float longer = fminf(0.5f * SHUTTER * speed, LONGEST * size);
    float a = size + longer, b = size, alpha = (float)rgba[3] * sqrtf(size / a);
    float pixel = z * view->pixel, least = SMALLEST * pixel;
    if (a < least) alpha *= a / least, a = least;
    if (b < least) alpha *= b / least, b = least;
    float seen = b / (pixel * (float)r->desc.height);
    if (seen > NEAR_SIZE) alpha *= fmaxf(0, (NEAREST_SIZE - seen) / (NEAREST_SIZE - NEAR_SIZE));
    if (!(alpha >= 0.5f)) return false;
    rgba[3] = (uint8_t)(alpha + 0.5f);
    bool moves = speed > 1e-6f;
    out->x = x, out->y = y, out->z = z, out->b = b;
    out->ax = moves ? dx / speed * a : a;
    out->ay = moves ? dy / speed * a : 0;
    return true;
}

/* One triangle round the ellipse: it costs a third more area than a rectangle, but small ones are
 * all setup. */
static void corners(const jsl_view *view, const jsl_sprite *s, jsl_f3 sun,
                    jsl_sprite_vertex out[3]) {
    static const float corner[3][2] = {{-1.7320508f, -1}, {1.7320508f, -1}, {0, 2}};
    float n = 1 / sqrtf(s->ax * s->ax + s->ay * s->ay), bx = -s->ay * n, by = s->ax * n;
    float along = (s->ax * sun.x + s->ay * sun.y) * n, across = bx * sun.x + by * sun.y;
    for (int k = 0; k < 3; k++) {
        float u = corner[k][0], v = corner[k][1];
        jsl_sprite_vertex *c = &out[k];
        c->clip[0] = (s->x + u * s->ax + v * s->b * bx) / view->tan_x;
        c->clip[1] = (s->y + u * s->ay + v * s->b * by) / view->tan_y;
        c->clip[2] = view->near;
        c->clip[3] = s->z;
        c->corner[0] = (int8_t)(u * 63.5f);
        c->corner[1] = (int8_t)(v * 63.5f);
        c->corner[2] = (int8_t)((u * along + v * across) * 63.0f);
        c->corner[3] = 0;
        memcpy(c->rgba, s->rgba, sizeof c->rgba);
    }
}

jsl_result jsl_list_sprites(jsl_renderer *r, const jsl_frame *frame) {
    int64_t count = particle_count(frame), n = 0;
    r->sprites.count = r->sprite_vertices.count = r->particles_drawn = 0;
    if (count == 0) return JSL_OK;
    JSL_TRY(jsl_array_reserve(&r->memory, &r->sprites, count));
    for (int64_t i = 0; i < count; i++) {
        const jsl_frame_particles *p = &frame->particles;
        r->particles_drawn += jsl_drawable3(p->px[i], p->py[i], p->pz[i]);
        n += project(r, p, i, &r->sprites.at[n]);
    }
    r->sprites.count = n;
    if (n == 0) return JSL_OK;
    JSL_TRY(jsl_array_reserve(&r->memory, &r->sprite_vertices, 3 * n));
    if (!frame->additive) {
        JSL_TRY(jsl_array_reserve(&r->memory, &r->keys, n));
        JSL_TRY(jsl_array_reserve(&r->memory, &r->order, n));
        JSL_TRY(jsl_array_reserve(&r->memory, &r->tmp_keys, n));
        JSL_TRY(jsl_array_reserve(&r->memory, &r->tmp_order, n));
        for (int64_t i = 0; i < n; i++) {
            uint32_t bits; /* depths are positive, and positive floats sort as their bits do */
            memcpy(&bits, &r->sprites.at[i].z, sizeof bits);
            r->keys.at[i] = ~bits;
            r->order.at[i] = (uint32_t)i;
        }
        jsl_sort_u32(r->keys.at, r->order.at, r->tmp_keys.at, r->tmp_order.at, n);
    }
    /* Towards the sun, in the picture. */
    jsl_f3 sun = {jsl_f3_dot(r->sun.to_sun, r->view.right), jsl_f3_dot(r->sun.to_sun, r->view.up),
                  0};
    for (int64_t i = 0; i < n; i++) {
        int64_t from = frame->additive ? i : r->order.at[i];
        corners(&r->view, &r->sprites.at[from], sun, &r->sprite_vertices.at[3 * i]);
    }
    r->sprite_vertices.count = 3 * n;
    return JSL_OK;
}

/* -- Shadow of all particles together
 * --------------------------------------------------------------- */

/* Box filter of 3 along one direction. */
static void soften(const float *from, float *to, int step, int other) {
    const int side = JSL_CLOUD_SIDE;
    for (int i = 0; i < side; i++)
        for (int k = 1; k + 1 < side; k++) {
            const float *f = from + i * other + k * step;
            to[i * other + k * step] = (f[-step] + f[0] + f[step]) * (1.0f / 3);
        }
}

static void splat(float *cloud, float u, float v, float weight) {
    const int side = JSL_CLOUD_SIDE;
    float x = u * (float)side - 0.5f, y = v * (float)side - 0.5f;
    if (!(x >= 1 && y >= 1 && x < (float)(side - 3) && y < (float)(side - 3))) return;
    int i = (int)x, k = (int)y;
    float fx = x - (float)i, fy = y - (float)k;
    float *at = cloud + k * side + i;
    at[0] += weight * (1 - fx) * (1 - fy);
    at[1] += weight * fx * (1 - fy);
    at[side] += weight * (1 - fx) * fy;
    at[side + 1] += weight * fx * fy;
}

/* Optical thickness of the particles over the ground, seen along the sunlight. */
void jsl_cloud_make(jsl_renderer *r, const jsl_frame *frame) {
    jsl_box3 box = r->span.particles;
    float *block = r->block.cloud;
    block[0] = block[1] = 1e9f, block[2] = block[3] = 1e-9f;
    r->block.grid[2] = 0;
    if (frame->additive || r->desc.no_shadows || box.lo.x > box.hi.x) return;
    jsl_f3 sun = r->sun.to_sun;
    float ground = r->span.ground, kx = sun.x / sun.z, ky = sun.y / sun.z;
    float high = fmaxf(box.hi.z - ground, 0);
    float x0 = fminf(box.lo.x, box.lo.x - kx * high), x1 = fmaxf(box.hi.x, box.hi.x - kx * high);
    float y0 = fminf(box.lo.y, box.lo.y - ky * high), y1 = fmaxf(box.hi.y, box.hi.y - ky * high);
    /* A texel is not smaller than half a particle: one alone must cast a round shadow, not a point.
     */
    float least = 0.5f * r->span.particle_size * JSL_CLOUD_SIDE;
    float padx = fmaxf(0.05f * (x1 - x0) + 0.1f, 0.5f * (least - (x1 - x0)));
    float pady = fmaxf(0.05f * (y1 - y0) + 0.1f, 0.5f * (least - (y1 - y0)));
    x0 -= padx, x1 += padx, y0 -= pady, y1 += pady;
    float ix = 1 / (x1 - x0), iy = 1 / (y1 - y0);
    const int side = JSL_CLOUD_SIDE, texels = side * side;
    float *a = r->cloud, *b = r->cloud + texels;
    memset(a, 0, sizeof *a * (size_t)(2 * texels));
    float per_area = 3.14159265f * (float)texels * ix * iy;
    const jsl_frame_particles *p = &frame->particles;
    int64_t count = particle_count(frame);
    for (int64_t i = 0; i < count; i++) {
        float z = p->pz[i] - ground, size = size_of(p, i);
        if (!(z > 0 && z < JSL_DRAW_LIMIT && size > 0 && size < 1e3f)) continue;
        float alpha = p->rgba ? (float)(p->rgba[i] & 255) / 255 : 1;
        splat(a, (p->px[i] - kx * z - x0) * ix, (p->py[i] - ky * z - y0) * iy,
              alpha * size * size * per_area);
    }
    soften(a, b, 1, side);
    soften(b, a, side, 1);
    soften(a, b, 1, side);
    soften(b, a, side, 1);
    block[0] = x0 - r->view.eye.x, block[1] = y0 - r->view.eye.y;
    block[2] = ix, block[3] = iy;
    r->block.grid[2] = 0.8f;
}
