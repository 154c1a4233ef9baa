/* SPDX-License-Identifier: MIT
 * lists.c - solid things of a frame as instances, in the order in which they are drawn.
 */
#include "render/renderer.h"

#include <stdlib.h>

#define MAX_PATCHES 32

/* What has no colour of its own gets one of these, by its place in the frame. */
static const uint32_t palette[] = {0xd9694fff, 0xe6a84bff, 0x5f9ea8ff, 0x7b9e5cff,
                                   0xb88a6bff, 0x8474a8ff, 0xcfb98bff, 0x4f7cacff};

static uint32_t color_of(const uint32_t *rgba, int64_t i) {
    uint32_t c = rgba ? rgba[i] : 0;
    return c ? c : palette[i % JSL_COUNT(palette)];
}

static jsl_f3 relative(const jsl_renderer *r, float x, float y, float z) {
    return jsl_f3_sub(jsl_f3_make(x, y, z), r->view.eye);
}

/* -- Planes -------------------------------------------------------------------------------------
 */

static float linear(uint32_t byte) { return powf((float)(byte & 255) / 255, 2.2f); }

static void patch_color(const jsl_renderer *r, uint32_t rgba, float alpha, float out[4]) {
    bool night = r->block.screen[3] > 0.5f;
    float dim = night ? 0.35f : 1.0f;
    if (!rgba) rgba = 0x929593ff;
    for (int k = 0; k < 3; k++) out[k] = dim * linear(rgba >> (24 - 8 * k));
    out[3] = alpha;
}

static float remainder_of(float x, float cell) { return x - cell * floorf(x / cell); }

static void cut_square(float radius, jsl_plane_patch *out) {
    const float line[4] = {-radius, -radius / 3, radius / 3, radius};
    memcpy(out->cut[0], line, sizeof line);
    memcpy(out->cut[1], line, sizeof line);
}

/* Where the shadows of the span's bodies and birds can fall, relative to the eye: x and y of two
 * corners. */
static bool shadow_bounds(const jsl_renderer *r, float z, float lo[2], float hi[2]) {
    bool casts =
        r->span.bodies.lo.x <= r->span.bodies.hi.x || r->span.boids.lo.x <= r->span.boids.hi.x;
    if (r->desc.no_shadows || !casts) return false;
    const jsl_sunview *s = &r->sun;
    /* The map is a square prism along the sun; its four edges meet the ground in a parallelogram.
     */
    const float *m = s->texture;
    float side = 1 / sqrtf(m[0] * m[0] + m[4] * m[4] + m[8] * m[8]);
    lo[0] = lo[1] = INFINITY, hi[0] = hi[1] = -INFINITY;
    for (int k = 0; k < 4; k++) {
        float u = ((k & 1 ? 1.0f : 0.0f) - m[12]) * side,
              v = ((k & 2 ? 1.0f : 0.0f) - m[13]) * side;
        jsl_f3 p = jsl_f3_add(jsl_f3_scale(s->right, u), jsl_f3_scale(s->up, v));
        p = jsl_f3_add(p, jsl_f3_scale(s->to_sun, (z - p.z) / s->to_sun.z));
        lo[0] = fminf(lo[0], p.x), hi[0] = fmaxf(hi[0], p.x);
        lo[1] = fminf(lo[1], p.y), hi[1] = fmaxf(hi[1], p.y);
    }
    return true;
}

/* The ground: level, as far as the eye reaches. */
static void level_patch(const jsl_renderer *r, float z, uint32_t rgba, jsl_plane_patch *out) {
    float major = 10 * r->block.grid[0], radius = 3 / r->block.eye[3], down = z - r->view.eye.z;
    *out = (jsl_plane_patch){.level = true};
    const float plane[4][4] = {{0, 0, down, remainder_of(r->view.eye.x, major)},
                               {1, 0, 0, remainder_of(r->view.eye.y, major)},
                               {0, 1, 0, 0}};
    memcpy(out->plane, plane, sizeof plane);
    patch_color(r, rgba, 1, out->plane[4]);
    float lo[2], hi[2];
    bool shaded = shadow_bounds(r, down, lo, hi);
    for (int a = 0; a < 2; a++) {
        float *cut = out->cut[a];
        cut[0] = -radius, cut[1] = cut[2] = 0, cut[3] = radius;
        if (!shaded) continue;
        cut[1] = fminf(fmaxf(lo[a], -radius), radius);
        cut[2] = fminf(fmaxf(hi[a], -radius), radius);
    }
}

/* A slope or a wall: as large as the scene, opaque the flatter it is, and gone at its rim. */
static void tilted_patch(const jsl_renderer *r, jsl_f3 at, const float q[4], uint32_t rgba,
                         jsl_plane_patch *out) {
    const float x = q[0], y = q[1], z = q[2], w = q[3];
    jsl_f3 u = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
    jsl_f3 v = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    jsl_box3 box = r->span.bodies;
    bool any = box.lo.x <= box.hi.x;
    jsl_f3 middle = any ? jsl_f3_scale(jsl_f3_add(box.lo, box.hi), 0.5f) : r->view.target;
    float radius = any ? 0.9f * jsl_f3_length(jsl_f3_sub(box.hi, box.lo)) : r->view.distance;
    radius = fmaxf(radius, 0.5f * r->view.distance);
    jsl_f3 d = jsl_f3_sub(middle, at);
    float along = jsl_f3_dot(d, u), across = jsl_f3_dot(d, v), major = 10 * r->block.grid[0];
    jsl_f3 centre = jsl_f3_add(at, jsl_f3_add(jsl_f3_scale(u, along), jsl_f3_scale(v, across)));
    jsl_f3 c = jsl_f3_sub(centre, r->view.eye);
    float flat = u.x * v.y - u.y * v.x; /* z of the normal */
    *out = (jsl_plane_patch){.level = false};
    const float plane[4][4] = {{c.x, c.y, c.z, remainder_of(along, major)},
                               {u.x, u.y, u.z, remainder_of(across, major)},
                               {v.x, v.y, v.z, 1 / radius}};
    memcpy(out->plane, plane, sizeof plane);
    cut_square(radius, out);
    patch_color(r, rgba, fminf(fmaxf(0.12f + 1.8f * flat, 0.12f), 1), out->plane[4]);
}

static jsl_result add_plane(jsl_renderer *r, jsl_f3 at, const float turn[4], uint32_t rgba) {
    if (r->patches.count == MAX_PATCHES) return JSL_OK;
    float nx = 2 * (turn[0] * turn[2] + turn[3] * turn[1]);
    float ny = 2 * (turn[1] * turn[2] - turn[3] * turn[0]);
    float nz = 1 - 2 * (turn[0] * turn[0] + turn[1] * turn[1]);
    /* From inside its half space a plane is not seen: it would hide everything. */
    if (jsl_f3_dot(jsl_f3_sub(r->view.eye, at), jsl_f3_make(nx, ny, nz)) <= 0) return JSL_OK;
    JSL_TRY(jsl_array_reserve(&r->memory, &r->patches, r->patches.count + 1));
    jsl_plane_patch *out = &r->patches.at[r->patches.count++];
    if (nz > 0.9999f)
        level_patch(r, at.z, rgba, out);
    else
        tilted_patch(r, at, turn, rgba, out);
    return JSL_OK;
}

/* -- Bodies -------------------------------------------------------------------------------------
 */

static jsl_mesh_kind mesh_of(const jsl_renderer *r, jsl_shape_kind kind, jsl_f3 rel, float radius) {
    if (kind == JSL_SHAPE_BOX) return JSL_MESH_BOX;
    float depth = fmaxf(jsl_f3_dot(rel, r->view.forward), radius);
    float pixels = radius / (depth * r->view.pixel);
    return pixels < 5 ? JSL_MESH_ROUND_LOW : pixels < 36 ? JSL_MESH_ROUND_MID : JSL_MESH_ROUND_HIGH;
}

static bool describe(const jsl_renderer *r, const jsl_frame *frame, int64_t i, jsl_mesh_kind *mesh,
                     jsl_body_instance *out) {
    float radius = jsl_frame_body_radius(frame, i);
    if (!(radius > 0)) return false;
    const jsl_frame_bodies *b = &frame->bodies;
    const jsl_frame_shape *s = jsl_frame_body(frame, i, out->turn);
    jsl_f3 rel = relative(r, b->px[i], b->py[i], b->pz[i]);
    memcpy(out->centre, &rel, sizeof out->centre);
    bool box = s->kind == JSL_SHAPE_BOX;
    out->size[0] = box ? s->half[0] : 0;
    out->size[1] = box ? s->half[1] : 0;
    out->size[2] = box || s->kind == JSL_SHAPE_CAPSULE ? s->half[2] : 0;
    out->size[3] = box ? 0 : s->radius;
    jsl_rgba_bytes(color_of(b->rgba, i), out->rgba);
    *mesh = mesh_of(r, s->kind, rel, radius);
    return out->rgba[3] > 0;
}

/* Positive floats sort as their bits do. */
static uint32_t depth_bits(float depth) {
    uint32_t bits;
    depth = fmaxf(depth, 0);
    memcpy(&bits, &depth, sizeof bits);
    return bits;
}

static jsl_result reserve_order(jsl_renderer *r, int64_t n) {
    JSL_TRY(jsl_array_reserve(&r->memory, &r->keys, n));
    JSL_TRY(jsl_array_reserve(&r->memory, &r->order, n));
    JSL_TRY(jsl_array_reserve(&r->memory, &r->tmp_keys, n));
    return jsl_array_reserve(&r->memory, &r->tmp_order, n);
}

/* Opaque bodies by mesh, then translucent ones from far to near: one stable sort, whose key's top
 * bit says which. */
static jsl_result list_solids(jsl_renderer *r, const jsl_frame *frame, int64_t count) {
    JSL_TRY(reserve_order(r, count));
    int64_t n = 0;
    jsl_body_instance body;
    jsl_mesh_kind mesh;
    for (int64_t i = 0; i < count; i++) {
        if (!describe(r, frame, i, &mesh, &body)) continue;
        jsl_f3 c = {body.centre[0], body.centre[1], body.centre[2]};
        float depth = jsl_f3_dot(c, r->view.forward);
        r->keys.at[n] =
            body.rgba[3] == 255 ? (uint32_t)mesh : 0x80000000u | ~(0x80000000u | depth_bits(depth));
        r->order.at[n++] = (uint32_t)i;
    }
    r->bodies_drawn = n;
    jsl_sort_u32(r->keys.at, r->order.at, r->tmp_keys.at, r->tmp_order.at, n);
    JSL_TRY(jsl_array_reserve(&r->memory, &r->bodies, n));
    r->clear_runs = -1;
    for (int64_t k = 0; k < n; k++) {
        describe(r, frame, r->order.at[k], &mesh, &body);
        r->bodies.at[r->bodies.count++] = body;
        bool clear = body.rgba[3] != 255;
        bool turning = clear && r->clear_runs < 0;
        if (turning) r->clear_runs = r->runs.count;
        if (turning || k == 0 || r->runs.at[r->runs.count - 1].mesh != mesh) {
            JSL_TRY(jsl_array_reserve(&r->memory, &r->runs, r->runs.count + 1));
            r->runs.at[r->runs.count++] = (jsl_body_run){mesh, (int)k, 0};
        }
        r->runs.at[r->runs.count - 1].count++;
    }
    if (r->clear_runs < 0) r->clear_runs = r->runs.count;
    return JSL_OK;
}

jsl_result jsl_list_bodies(jsl_renderer *r, const jsl_frame *frame) {
    const jsl_frame_bodies *b = &frame->bodies;
    int64_t count = b->px && b->py && b->pz && b->count > 0 ? b->count : 0;
    r->bodies.count = r->runs.count = r->patches.count = 0;
    static const float level[4] = {0, 0, 0, 1};
    if (!r->desc.no_ground && !r->span.has_level)
        JSL_TRY(add_plane(r, jsl_f3_make(0, 0, r->span.ground), level, 0));
    for (int64_t i = 0; i < count; i++) {
        float turn[4];
        const jsl_frame_shape *s = jsl_frame_body(frame, i, turn);
        if (!s || s->kind != JSL_SHAPE_PLANE) continue;
        JSL_TRY(add_plane(r, jsl_f3_make(b->px[i], b->py[i], b->pz[i]), turn,
                          b->rgba ? b->rgba[i] : 0));
    }
    return list_solids(r, frame, count);
}

/* -- Birds --------------------------------------------------------------------------------------
 */

#define GRAVITY 9.81f
#define DEFAULT_LENGTH 0.5f

/* Up is where the lift points that makes the acceleration: a bird that turns banks (Reynolds 1987
 * rolls his boids so). */
static void attitude(jsl_f3 velocity, jsl_f3 a, jsl_f3 *ahead, jsl_f3 *above) {
    float speed = jsl_f3_length(velocity);
    *ahead = speed > 1e-6f ? jsl_f3_scale(velocity, 1 / speed) : jsl_f3_make(1, 0, 0);
    float side = sqrtf(a.x * a.x + a.y * a.y), most = 2 * GRAVITY; /* 63 degrees */
    if (side > most) a.x *= most / side, a.y *= most / side;
    jsl_f3 lift = {a.x, a.y, GRAVITY + fminf(fmaxf(a.z, -0.5f * GRAVITY), GRAVITY)};
    jsl_f3 up = jsl_f3_sub(lift, jsl_f3_scale(*ahead, jsl_f3_dot(lift, *ahead)));
    float length = jsl_f3_length(up);
    if (length < 1e-3f) { /* straight up or down: any side is up */
        up = fabsf(ahead->x) < 0.9f ? jsl_f3_make(1, 0, 0) : jsl_f3_make(0, 1, 0);
        up = jsl_f3_sub(up, jsl_f3_scale(*ahead, jsl_f3_dot(up, *ahead)));
        length = jsl_f3_length(up);
    }
    *above = jsl_f3_scale(up, 1 / length);
}

static jsl_bird_instance bird(const jsl_renderer *r, const jsl_frame *frame, int64_t i,
                              float length) {
    const jsl_frame_boids *b = &frame->boids;
    jsl_f3 rel = relative(r, b->px[i], b->py[i], b->pz[i]);
    jsl_f3 v = {jsl_component(b->vx, i), jsl_component(b->vy, i), jsl_component(b->vz, i)};
    jsl_f3 a = {jsl_component(b->ax, i), jsl_component(b->ay, i), jsl_component(b->az, i)};
    jsl_f3 ahead, above;
    attitude(v, a, &ahead, &above);
    /* Small birds beat faster (about the inverse root of their size), and climbing ones harder. */
    double beats = 2.6 / sqrt(length);
    double time = isfinite(frame->time) ? frame->time : 0;
    float own = (float)(jsl_mix64((uint64_t)i + 1) >> 40) / 16777216.0f;
    float phase =
        2 * 3.14159265f * (float)fmod(time * beats * (0.85 + 0.3 * (double)own) + (double)own, 1.0);
    float beat = fminf(fmaxf(0.55f + 0.8f * ahead.z, 0.12f), 0.9f);
    jsl_bird_instance out = {{rel.x, rel.y, rel.z, length},
                             {ahead.x, ahead.y, ahead.z, phase},
                             {above.x, above.y, above.z, beat},
                             {0}};
    jsl_rgba_bytes(b->rgba && b->rgba[i] ? b->rgba[i] : 0x3c4654ff, out.rgba);
    return out;
}

jsl_result jsl_list_birds(jsl_renderer *r, const jsl_frame *frame) {
    const jsl_frame_boids *b = &frame->boids;
    int64_t count = b->px && b->py && b->pz && b->count > 0 ? b->count : 0;
    float length = b->length > 0 && jsl_drawable(b->length) ? b->length : DEFAULT_LENGTH;
    JSL_TRY(jsl_array_reserve(&r->memory, &r->birds, count));
    r->birds.count = 0;
    for (int64_t i = 0; i < count; i++)
        if (jsl_drawable3(b->px[i], b->py[i], b->pz[i]))
            r->birds.at[r->birds.count++] = bird(r, frame, i, length);
    r->birds_drawn = r->birds.count;
    return JSL_OK;
}
