/* SPDX-License-Identifier: MIT
 * view.c - cameras of the frame and of the sun.
 */
#include "render/view.h"

#include "jostle/math.h"

#include <string.h>

#define DEFAULT_FOV 45.0f
#define PI 3.14159265f

static bool filled(jsl_box3 box) { return box.lo.x <= box.hi.x; }

static jsl_box3 box_union(jsl_box3 a, jsl_box3 b) {
    if (!filled(a)) return b;
    if (!filled(b)) return a;
    return (jsl_box3){{fminf(a.lo.x, b.lo.x), fminf(a.lo.y, b.lo.y), fminf(a.lo.z, b.lo.z)},
                      {fmaxf(a.hi.x, b.hi.x), fmaxf(a.hi.y, b.hi.y), fmaxf(a.hi.z, b.hi.z)}};
}

static jsl_f3 box_corner(jsl_box3 b, int k) {
    return jsl_f3_make(k & 1 ? b.hi.x : b.lo.x, k & 2 ? b.hi.y : b.lo.y, k & 4 ? b.hi.z : b.lo.z);
}

/* Right, up and forward of somebody who looks along forward with his head towards +z (+y when he
 * looks straight up or down). */
static void axes(jsl_f3 forward, jsl_f3 *right, jsl_f3 *up) {
    jsl_f3 head = fabsf(forward.z) > 0.9999f ? jsl_f3_make(0, 1, 0) : jsl_f3_make(0, 0, 1);
    *right = jsl_f3_unit(jsl_f3_cross(forward, head));
    *up = jsl_f3_cross(*right, forward);
}

static jsl_f3 turn_about_z(jsl_f3 v, float angle) {
    float c = cosf(angle), s = sinf(angle);
    return jsl_f3_make(c * v.x - s * v.y, s * v.x + c * v.y, v.z);
}

/* The nearest eye in direction away from which every point kept is in the picture, and the target
 * that centres them. */
static void fit(jsl_view *view, const jsl_span *span, jsl_f3 centre, jsl_f3 away) {
    jsl_f3 right, up, forward = jsl_f3_scale(away, -1);
    axes(forward, &right, &up);
    float distance = 0.5f;
    /* Balls seen at an angle look larger than their radius. */
    const float tan_of[2] = {view->tan_x * 0.94f, view->tan_y * 0.94f};
    const float grow[2] = {sqrtf(1 + tan_of[0] * tan_of[0]), sqrtf(1 + tan_of[1] * tan_of[1])};
    const jsl_f3 side[2] = {right, up};
    view->target = centre;
    for (int pass = 0; pass < 2; pass++) {
        /* |s| <= tan (distance + depth), for both sides of both directions: the two sides of a
         * direction meet where the picture is centred. */
        float most = 0.5f;
        jsl_f3 shift = {0, 0, 0};
        for (int a = 0; a < 2; a++) {
            float high = -INFINITY, low = -INFINITY;
            for (int i = 0; i < span->points; i++) {
                jsl_f3 d = jsl_f3_sub(span->point[i], view->target);
                float s = jsl_f3_dot(d, side[a]), depth = jsl_f3_dot(d, forward) * tan_of[a];
                high = fmaxf(high, s + span->radius[i] * grow[a] - depth);
                low = fmaxf(low, -s + span->radius[i] * grow[a] - depth);
            }
            if (span->points == 0) high = low = 12 * tan_of[a];
            shift = jsl_f3_add(shift, jsl_f3_scale(side[a], 0.5f * (high - low)));
            most = fmaxf(most, 0.5f * (high + low) / tan_of[a]);
        }
        distance = most;
        /* The first pass only finds the middle. */
        if (pass == 0) view->target = jsl_f3_add(view->target, shift);
    }
    view->eye = jsl_f3_add(view->target, jsl_f3_scale(away, distance));
}

static void place_camera(const jsl_frame *frame, const jsl_span *span, jsl_view *view) {
    const jsl_frame_camera *c = &frame->camera;
    float turns = 0;
    if (isfinite(frame->time) && jsl_drawable(c->orbit))
        turns = (float)fmod(frame->time * (double)c->orbit, 1.0);
    jsl_f3 eye = jsl_f3_make(c->eye[0], c->eye[1], c->eye[2]);
    jsl_f3 target = jsl_f3_make(c->target[0], c->target[1], c->target[2]);
    bool given = jsl_drawable3(eye.x, eye.y, eye.z) && jsl_drawable3(target.x, target.y, target.z);
    jsl_f3 away = jsl_f3_sub(eye, target);
    float length = jsl_f3_length(away);
    /* Closer than the rounding of the target's coordinates there is no direction to look in. */
    given = given && length > 1e-6f * (1 + jsl_f3_length(target));
    if (given) {
        view->target = target;
        view->eye = jsl_f3_add(target, turn_about_z(away, 2 * PI * turns));
    } else {
        jsl_box3 box = box_union(span->bodies, box_union(span->boids, span->particles));
        if (!filled(box)) box = (jsl_box3){{0, 0, 1}, {0, 0, 1}};
        away = jsl_f3_unit(jsl_f3_make(0.42f, -1.0f, 0.40f));
        jsl_f3 centre = jsl_f3_scale(jsl_f3_add(box.lo, box.hi), 0.5f);
        fit(view, span, centre, turn_about_z(away, 2 * PI * turns));
    }
    jsl_f3 look = jsl_f3_sub(view->target, view->eye);
    view->distance = jsl_f3_length(look);
    view->forward = jsl_f3_scale(look, 1 / view->distance);
    axes(view->forward, &view->right, &view->up);
}

void jsl_view_make(const jsl_frame *frame, const jsl_span *span, int width, int height,
                   jsl_view *view) {
    float fov = frame->camera.fov;
    if (!(fov >= 1 && fov <= 150)) fov = DEFAULT_FOV;
    *view = (jsl_view){0};
    view->tan_y = tanf(fov * PI / 360);
    view->tan_x = view->tan_y * (float)width / (float)height;
    view->pixel = 2 * view->tan_y / (float)height;
    place_camera(frame, span, view);
    view->near = fminf(0.1f, 0.01f * view->distance);
    /* Rows: right and up to the picture's half extents, a constant for z, and depth for w. */
    const jsl_f3 r = view->right, u = view->up, f = view->forward;
    float sx = 1 / view->tan_x, sy = 1 / view->tan_y;
    const float m[16] = {r.x * sx, u.x * sy, 0, f.x, r.y * sx, u.y * sy, 0,          f.y,
                         r.z * sx, u.z * sy, 0, f.z, 0,        0,        view->near, 0};
    memcpy(view->camera, m, sizeof m);
}

void jsl_sunview_make(const jsl_view *view, const jsl_span *span, jsl_f3 to_sun, int texels,
                      jsl_sunview *sun) {
    *sun = (jsl_sunview){.to_sun = to_sun};
    axes(jsl_f3_scale(to_sun, -1), &sun->right, &sun->up);
    jsl_box3 box = box_union(span->bodies, span->boids);
    if (!filled(box)) box = (jsl_box3){view->target, view->target};
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int k = 0; k < 8; k++) {
        jsl_f3 d = jsl_f3_sub(box_corner(box, k), view->eye);
        const float s[3] = {jsl_f3_dot(d, sun->right), jsl_f3_dot(d, sun->up),
                            jsl_f3_dot(d, to_sun)};
        for (int a = 0; a < 3; a++) lo[a] = fminf(lo[a], s[a]), hi[a] = fmaxf(hi[a], s[a]);
    }
    /* A close-up wants its texels where it looks. */
    float reach = 2.0f * view->distance * fmaxf(view->tan_x, view->tan_y) + 0.5f * view->distance;
    jsl_f3 t = jsl_f3_sub(view->target, view->eye);
    const float middle[2] = {jsl_f3_dot(t, sun->right), jsl_f3_dot(t, sun->up)};
    for (int a = 0; a < 2; a++) {
        lo[a] = fminf(fmaxf(lo[a], middle[a] - reach), middle[a] + reach);
        hi[a] = fmaxf(fminf(hi[a], middle[a] + reach), middle[a] - reach);
    }
    float extent = fmaxf(fmaxf(hi[0] - lo[0], hi[1] - lo[1]), 0.1f) * 1.05f;
    /* Eighths of an octave and whole texels of the world: edges of shadows do not crawl from frame
     * to frame. */
    extent = exp2f(ceilf(log2f(extent) * 8) / 8);
    sun->texel = extent / (float)texels;
    const float eye[2] = {jsl_f3_dot(view->eye, sun->right), jsl_f3_dot(view->eye, sun->up)};
    float start[2];
    for (int a = 0; a < 2; a++) {
        float at = 0.5f * (lo[a] + hi[a] - extent) + eye[a];
        start[a] = floorf(at / sun->texel) * sun->texel - eye[a];
    }
    /* Depth runs from the highest caster down to far below the lowest; the ground is clamped to it.
     */
    float top = hi[2] + 0.05f * extent, depth = hi[2] - lo[2] + 2 * extent;
    const jsl_f3 r = sun->right, u = sun->up;
    float s = 1 / extent, d = -1 / depth;
    const float m[16] = {
        r.x * s, u.x * s, to_sun.x * d, 0, r.y * s,       u.y * s,       to_sun.y * d, 0,
        r.z * s, u.z * s, to_sun.z * d, 0, -start[0] * s, -start[1] * s, -top * d,     1};
    memcpy(sun->texture, m, sizeof m);
    memcpy(sun->clip, m, sizeof m);
    for (int c = 0; c < 4; c++) {
        float one = c == 3 ? 1.0f : 0.0f;
        sun->clip[4 * c] = 2 * m[4 * c] - one;
        sun->clip[4 * c + 1] = 2 * m[4 * c + 1] - one;
    }
}
