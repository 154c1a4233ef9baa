/* SPDX-License-Identifier: MIT
 * measure.c - energy, momentum, penetration: compensated sums in double over bodies in order of
 * entity id.
 */
#include "rigid/room.h"

/* Neumaier's compensated sum. */
typedef struct sum {
    double total, lost;
} sum;
static void add(sum *s, double x) {
    double t = s->total + x;
    s->lost += (s->total < 0 ? -s->total : s->total) >= (x < 0 ? -x : x) ? (s->total - t) + x
                                                                         : (x - t) + s->total;
    s->total = t;
}
static double value(const sum *s) { return s->total + s->lost; }

typedef struct sums {
    sum mass, kinetic, potential, p[3], l[3], moment[3];
    double max_speed_sq;
} sums;

static void add_body(sums *s, const jsl_rigid_view *v, int64_t r, jsl_vec3 g) {
    double im = (double)v->mass.inv_mass[r];
    double inv[3] = {(double)v->mass.inv_ixx[r], (double)v->mass.inv_iyy[r],
                     (double)v->mass.inv_izz[r]};
    double m = im > 0 ? 1 / im : 0;
    double x[3] = {(double)v->position.px[r], (double)v->position.py[r], (double)v->position.pz[r]};
    double u[3] = {(double)v->velocity.vx[r], (double)v->velocity.vy[r], (double)v->velocity.vz[r]};
    double w[3] = {(double)v->spin.wx[r], (double)v->spin.wy[r], (double)v->spin.wz[r]};
    double q[4] = {(double)v->orientation.qx[r], (double)v->orientation.qy[r],
                   (double)v->orientation.qz[r], (double)v->orientation.qw[r]};
    double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], k = n > 0 ? 2 / n : 0;
    /* Columns of the rotation, normalised: a float quaternion's length is off by its rounding. */
    double c[3][3] = {{1 - k * (q[1] * q[1] + q[2] * q[2]), k * (q[0] * q[1] + q[3] * q[2]),
                       k * (q[0] * q[2] - q[3] * q[1])},
                      {k * (q[0] * q[1] - q[3] * q[2]), 1 - k * (q[0] * q[0] + q[2] * q[2]),
                       k * (q[1] * q[2] + q[3] * q[0])},
                      {k * (q[0] * q[2] + q[3] * q[1]), k * (q[1] * q[2] - q[3] * q[0]),
                       1 - k * (q[0] * q[0] + q[1] * q[1])}};
    double turn[3] = {0, 0, 0}, energy = 0;
    for (int a = 0; a < 3; a++) {
        if (!(inv[a] > 0)) continue;
        double wb = c[a][0] * w[0] + c[a][1] * w[1] + c[a][2] * w[2], lb = wb / inv[a];
        energy += 0.5 * wb * lb;
        for (int d = 0; d < 3; d++) turn[d] += lb * c[a][d];
    }
    double scale = (double)v->body.gravity_scale[r];
    double speed_sq = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    if (speed_sq > s->max_speed_sq) s->max_speed_sq = speed_sq;
    add(&s->mass, m);
    add(&s->kinetic, 0.5 * m * speed_sq);
    add(&s->kinetic, energy);
    add(&s->potential, -m * scale * ((double)g.x * x[0] + (double)g.y * x[1] + (double)g.z * x[2]));
    for (int d = 0; d < 3; d++) {
        int e = (d + 1) % 3, f = (d + 2) % 3;
        add(&s->p[d], m * u[d]);
        add(&s->moment[d], m * x[d]);
        add(&s->l[d], m * x[e] * u[f]);
        add(&s->l[d], -m * x[f] * u[e]);
        add(&s->l[d], turn[d]);
    }
}

static jsl_result sorted_bodies(jsl_rigid_room *room, int64_t *count) {
    int64_t n = jsl_query_count(room->ecs, room->moving), k = 0;
    JSL_TRY(jsl_array_reserve(room->memory, &room->sort_key, n));
    JSL_TRY(jsl_array_reserve(room->memory, &room->sort_tmp, n));
    JSL_TRY(jsl_array_reserve(room->memory, &room->sort_value, n));
    JSL_TRY(jsl_array_reserve(room->memory, &room->sort_tmp_value, n));
    JSL_TRY(jsl_rigid_views_update(room));
    for (int64_t v = 0; v < room->view.count; v++)
        for (int64_t r = 0; r < room->view.at[v].rows.count; r++, k++) {
            room->sort_key.at[k] = jsl_entity_id(room->view.at[v].rows.entity[r]);
            room->sort_value.at[k] = (uint32_t)k;
        }
    jsl_sort_u64(room->sort_key.at, room->sort_value.at, room->sort_tmp.at, room->sort_tmp_value.at,
                 n);
    *count = n;
    return JSL_OK;
}

jsl_result jsl_rigid_room_measure(jsl_rigid_room *room, jsl_vec3 gravity, jsl_rigid_measure *out) {
    int64_t n;
    JSL_TRY(sorted_bodies(room, &n));
    sums s = {0};
    *out = (jsl_rigid_measure){.manifolds = room->manifolds,
                               .pairs = room->pair.count,
                               .rebuilt = room->rebuilt,
                               .colours = room->colours,
                               .overflow = room->overflow};
    for (int64_t k = 0; k < n; k++) {
        int64_t r = room->sort_value.at[k], v = 0;
        for (; r >= room->view.at[v].rows.count; v++) r -= room->view.at[v].rows.count;
        const jsl_rigid_view *view = &room->view.at[v];
        if (view->body.kind[r] != JSL_BODY_DYNAMIC) continue;
        add_body(&s, view, r, gravity);
        out->bodies++;
    }
    out->mass = value(&s.mass), out->kinetic = value(&s.kinetic),
    out->potential = value(&s.potential);
    for (int d = 0; d < 3; d++)
        out->momentum[d] = value(&s.p[d]), out->angular_momentum[d] = value(&s.l[d]),
        out->centre_of_mass[d] = out->mass > 0 ? value(&s.moment[d]) / out->mass : 0;
    out->max_speed = sqrt(s.max_speed_sq);
    for (int64_t k = 0; k < room->pair.count; k++) {
        const jsl_rigid_pair *p = &room->pair.at[k];
        double depth = -(double)JSL_RIGID_GEO(room, k)[JSL_GEO_GAP];
        out->touching += jsl_rigid_touching(room, k);
        if (p->count > 0 && depth > out->max_penetration) out->max_penetration = depth;
    }
    return JSL_OK;
}
