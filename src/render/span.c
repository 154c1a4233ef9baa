/* SPDX-License-Identifier: MIT
 * span.c - which elements of a frame can be drawn, and what space they fill.
 */
#include "render/view.h"

#include <stdlib.h>

/* Enough for percentiles; larger columns are sampled at equal strides. */
#define SAMPLES 2048

typedef struct cloud {
    float lo[3][SAMPLES], hi[3][SAMPLES]; /* sorted in the end */
    jsl_f3 point[SAMPLES];
    float radius[SAMPLES];
    int count;
} cloud;

const jsl_frame_shape *jsl_frame_body(const jsl_frame *frame, int64_t i, float turn[4]) {
    const jsl_frame_bodies *b = &frame->bodies;
    if (!jsl_drawable3(b->px[i], b->py[i], b->pz[i])) return NULL;
    if (!b->shape || !frame->shapes || b->shape[i] < 0 || b->shape[i] >= frame->shape_count)
        return NULL;
    turn[0] = turn[1] = turn[2] = 0, turn[3] = 1;
    if (b->qx && b->qy && b->qz && b->qw) {
        float q[4] = {b->qx[i], b->qy[i], b->qz[i], b->qw[i]};
        float n = sqrtf(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        if (!(n > 1e-6f && n < JSL_DRAW_LIMIT)) return NULL;
        for (int k = 0; k < 4; k++) turn[k] = q[k] / n;
    }
    return &frame->shapes[b->shape[i]];
}

static bool positive(float x) { return x > 0 && x <= JSL_DRAW_LIMIT; }

float jsl_frame_body_radius(const jsl_frame *frame, int64_t i) {
    float turn[4];
    const jsl_frame_shape *s = jsl_frame_body(frame, i, turn);
    if (!s) return 0;
    switch (s->kind) {
    case JSL_SHAPE_SPHERE:
        return positive(s->radius) ? s->radius : 0;
    case JSL_SHAPE_CAPSULE:
        return positive(s->radius) && positive(s->half[2]) ? s->radius + s->half[2] : 0;
    case JSL_SHAPE_BOX:
        if (!positive(s->half[0]) || !positive(s->half[1]) || !positive(s->half[2])) return 0;
        return jsl_f3_length(jsl_f3_make(s->half[0], s->half[1], s->half[2]));
    default:
        return 0;
    }
}

static void cloud_add(cloud *c, float x, float y, float z, float radius) {
    if (!jsl_drawable3(x, y, z) || c->count == SAMPLES) return;
    const float p[3] = {x, y, z};
    for (int k = 0; k < 3; k++) {
        c->lo[k][c->count] = p[k] - radius;
        c->hi[k][c->count] = p[k] + radius;
    }
    c->point[c->count] = jsl_f3_make(x, y, z);
    c->radius[c->count++] = radius;
}

static int by_value(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The range of most: without the outer hundredths of a crowd, and without what is farther out than
 * ten times the spread of the middle half, for even one lost body would otherwise make all others
 * too small to see. */
static jsl_box3 cloud_box(cloud *c) {
    if (c->count == 0) return (jsl_box3){{1, 1, 1}, {-1, -1, -1}};
    float out[2][3], spread = 0.1f;
    for (int k = 0; k < 3; k++) {
        qsort(c->lo[k], (size_t)c->count, sizeof(float), by_value);
        qsort(c->hi[k], (size_t)c->count, sizeof(float), by_value);
        spread = fmaxf(spread, c->hi[k][c->count * 3 / 4] - c->lo[k][c->count / 4]);
    }
    int cut = c->count >= 200 ? c->count / 100 : 0;
    for (int k = 0; k < 3; k++) {
        int first = cut, last = c->count - 1 - cut;
        float low = c->lo[k][c->count / 4] - 10 * spread;
        float high = c->hi[k][c->count * 3 / 4] + 10 * spread;
        while (c->lo[k][first] < low) first++;
        while (c->hi[k][last] > high) last--;
        out[0][k] = c->lo[k][first];
        out[1][k] = c->hi[k][last];
    }
    return (jsl_box3){{out[0][0], out[0][1], out[0][2]}, {out[1][0], out[1][1], out[1][2]}};
}

/* Every so many of the elements whose balls are inside the box. Their order has been kept apart
 * from the sorted columns. */
static void keep_points(const cloud *c, const jsl_box3 *box, jsl_span *span) {
    int stride = (c->count + JSL_SPAN_POINTS - 1) / JSL_SPAN_POINTS;
    for (int i = 0; i < c->count; i += stride) {
        jsl_f3 p = c->point[i];
        float r = c->radius[i];
        if (p.x - r < box->lo.x || p.y - r < box->lo.y || p.z - r < box->lo.z) continue;
        if (p.x + r > box->hi.x || p.y + r > box->hi.y || p.z + r > box->hi.z) continue;
        span->point[span->points] = p;
        span->radius[span->points++] = r;
    }
}

/* The grid lies at z = 0, or, when much is below that and no plane is there, at a power of two
 * below: it moves seldom. */
static float ground_under(const jsl_span *span) {
    float low = 0;
    const jsl_box3 *all[] = {&span->bodies, &span->boids, &span->particles};
    for (int k = 0; k < JSL_COUNT(all); k++)
        if (all[k]->lo.x <= all[k]->hi.x) low = fminf(low, all[k]->lo.z);
    return low > -0.25f ? 0 : -exp2f(ceilf(log2f(-low)));
}

void jsl_span_make(const jsl_frame *frame, jsl_span *span) {
    cloud c;
    c.count = 0;
    *span = (jsl_span){0};
    const jsl_frame_bodies *b = &frame->bodies;
    int64_t count = b->px && b->py && b->pz ? b->count : 0;
    int64_t stride = (count + SAMPLES - 1) / SAMPLES;
    float level = 0;
    for (int64_t i = 0; i < count; i++) {
        float turn[4];
        const jsl_frame_shape *s = jsl_frame_body(frame, i, turn);
        if (s && s->kind == JSL_SHAPE_PLANE) {
            float tilt = 1 - 2 * (turn[0] * turn[0] + turn[1] * turn[1]);
            if (tilt > 0.9999f) {
                level = span->has_level ? fmaxf(level, b->pz[i]) : b->pz[i];
                span->has_level = true;
            }
        }
        if (i % stride) continue;
        float radius = jsl_frame_body_radius(frame, i);
        if (radius > 0) cloud_add(&c, b->px[i], b->py[i], b->pz[i], radius);
    }
    span->bodies = cloud_box(&c);
    keep_points(&c, &span->bodies, span);

    c.count = 0;
    const jsl_frame_boids *f = &frame->boids;
    count = f->px && f->py && f->pz ? f->count : 0;
    stride = (count + SAMPLES - 1) / SAMPLES;
    for (int64_t i = 0; i < count; i += stride) cloud_add(&c, f->px[i], f->py[i], f->pz[i], 0.25f);
    span->boids = cloud_box(&c);
    keep_points(&c, &span->boids, span);

    c.count = 0;
    const jsl_frame_particles *p = &frame->particles;
    count = p->px && p->py && p->pz ? p->count : 0;
    stride = (count + SAMPLES - 1) / SAMPLES;
    float sum = 0, sizes = 0;
    for (int64_t i = 0; i < count; i += stride) {
        float size = p->size ? p->size[i] : JSL_PARTICLE_SIZE;
        if (!positive(size)) continue;
        cloud_add(&c, p->px[i], p->py[i], p->pz[i], size);
        sum += size, sizes++;
    }
    span->particle_size = sizes > 0 ? sum / sizes : 0;
    span->particles = cloud_box(&c);
    keep_points(&c, &span->particles, span);
    span->ground = span->has_level ? level : ground_under(span);
}
