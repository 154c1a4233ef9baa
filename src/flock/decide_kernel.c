/* SPDX-License-Identifier: MIT
 * Reasoning: from what each boid sees to the acceleration it chooses. One lane a boid.
 */
#include "flock/sense.h"
#include "math/wide.h"

typedef struct wvec {
    wreal x, y, z;
} wvec;

JSL_INLINE wvec wv_load(jsl_real (*p)[JSL_FLOCK_CHUNK], int j) {
    return (wvec){wload(p[0] + j), wload(p[1] + j), wload(p[2] + j)};
}
JSL_INLINE wvec wv_set(jsl_vec3 v) { return (wvec){wset(v.x), wset(v.y), wset(v.z)}; }
JSL_INLINE wvec wv_add(wvec a, wvec b) { return (wvec){a.x + b.x, a.y + b.y, a.z + b.z}; }
JSL_INLINE wvec wv_sub(wvec a, wvec b) { return (wvec){a.x - b.x, a.y - b.y, a.z - b.z}; }
JSL_INLINE wvec wv_scale(wvec a, wreal s) { return (wvec){a.x * s, a.y * s, a.z * s}; }
JSL_INLINE wreal wv_length_sq(wvec a) { return a.x * a.x + a.y * a.y + a.z * a.z; }
/* s / |a|, 0 where |a|^2 is at most floor. */
JSL_INLINE wreal wv_over_length(wreal s, wvec a, jsl_real floor_sq) {
    wreal l2 = wv_length_sq(a);
    return wkeep(wgt(l2, wset(floor_sq)), s / wsqrt(wmax(l2, wset(JSL_R(1e-30)))));
}

/* The requests of the three rules. Directions shorter than the rounding of what they were made from
 * count as none. */
JSL_INLINE void rules(const jsl_decision *d, const jsl_sense_scratch *s, int j, wvec u,
                      wvec request[JSL_RULES]) {
    const wreal one = wset(1), none = wset(0);
    wvec away = {-wload(s->sense[JSL_SUM_SEPARATION] + j),
                 -wload(s->sense[JSL_SUM_SEPARATION + 1] + j),
                 -wload(s->sense[JSL_SUM_SEPARATION + 2] + j)};
    wvec match = {wload(s->sense[JSL_SUM_ALIGNMENT] + j),
                  wload(s->sense[JSL_SUM_ALIGNMENT + 1] + j),
                  wload(s->sense[JSL_SUM_ALIGNMENT + 2] + j)};
    wvec gather = {wload(s->sense[JSL_SUM_COHESION] + j), wload(s->sense[JSL_SUM_COHESION + 1] + j),
                   wload(s->sense[JSL_SUM_COHESION + 2] + j)};
    const wreal n_match = wload(s->sense[JSL_COUNT_ALIGNMENT] + j);
    const wreal n_gather = wload(s->sense[JSL_COUNT_COHESION] + j);
    if (d->response == 2) { /* sums */
        match = wv_sub(match, wv_scale(u, n_match));
    } else {
        const wmask any = wgt(n_match, none);
        const wreal share = one / wmax(n_match, one);
        match = wv_sub(wv_scale(match, share), u);
        match = (wvec){wkeep(any, match.x), wkeep(any, match.y), wkeep(any, match.z)};
        gather = wv_scale(gather, one / wmax(n_gather, one));
    }
    wreal w[JSL_RULES];
    for (int r = 0; r < JSL_RULES; r++) w[r] = wset(d->weight[r]);
    if (d->response == 0) {
        w[0] = wv_over_length(w[0], away, JSL_R(1e-30));
        w[1] = wv_over_length(w[1], match, JSL_R(1e-12));
        w[2] = wv_over_length(w[2], gather, JSL_R(1e-30));
    }
    request[JSL_SEPARATION] = wv_scale(away, w[0]);
    request[JSL_ALIGNMENT] = wv_scale(match, w[1]);
    request[JSL_COHESION] = wv_scale(gather, w[2]);
}

JSL_INLINE wreal outside(wreal p, jsl_real lo, jsl_real hi) {
    return wmax(wset(lo) - p, wset(0)) - wmax(p - wset(hi), wset(0));
}

/* The urge, and the way to the place behind the leader: approach it at no more than max_speed
 * relative to it, within a second. */
JSL_INLINE wvec migration(const jsl_decision *d, wvec p, jsl_deciders *b, int j) {
    wvec q = wv_set(d->urge);
    if (d->led) {
        wvec way = wv_sub(wv_set(d->target), p);
        wreal pace = wv_over_length(wset(d->max_speed), way, JSL_R(1e-30));
        way = wv_scale(way, wmin(pace, wset(1)));
        wvec wish = wv_sub(wv_add(way, wv_set(d->target_velocity)), wv_load(b->v, j));
        q = wv_add(q, wv_scale(wish, wset(d->follow)));
    }
    return q;
}

void JSL_KERNEL(jsl_flock_decide)(const jsl_decision *d, const jsl_sense_scratch *scratch,
                                  jsl_deciders *b, int count) {
    for (int j = 0; j < count; j += WN) {
        const wvec p = wv_load(b->p, j);
        wvec request[5];
        request[0] = wv_load(b->avoid, j);
        if (d->bounded) {
            const wreal k = wset(d->bounds_weight);
            wvec e = {outside(p.x, d->lo.x, d->hi.x), outside(p.y, d->lo.y, d->hi.y),
                      outside(p.z, d->lo.z, d->hi.z)};
            request[0] = wv_add(request[0], wv_scale(e, k));
        }
        rules(d, scratch, j, wv_load(b->u, j), &request[1]);
        request[4] = migration(d, p, b, j);
        wvec a = {wset(0), wset(0), wset(0)};
        wreal left = wset(d->budget);
        if (d->negotiation == 0) {
            for (int r = 0; r < 5; r++) {
                const wreal m = wsqrt(wv_length_sq(request[r]));
                const wmask fits = wge(left, m);
                const wreal s = wselect(fits, wset(1), left / wmax(m, wset(JSL_R(1e-30))));
                a = wv_add(a, wv_scale(request[r], s));
                left = wkeep(fits, left - m);
            }
        } else {
            for (int r = 0; r < 5; r++) a = wv_add(a, request[r]);
            a = wv_scale(a, wmin(wv_over_length(left, a, JSL_R(1e-30)) +
                                     wkeep(wge(wset(JSL_R(1e-30)), wv_length_sq(a)), wset(1)),
                                 wset(1)));
        }
        wstore(b->a[0] + j, a.x);
        wstore(b->a[1] + j, a.y);
        wstore(b->a[2] + j, a.z);
    }
}

JSL_INLINE void heading(jsl_real *x, jsl_real *y, jsl_real *z) {
    wvec v = {wloadu(x), wloadu(y), wloadu(z)};
    wreal s = wv_over_length(wset(1), v, JSL_R(1e-30));
    wstoreu(x, v.x * s);
    wstoreu(y, v.y * s);
    wstoreu(z, v.z * s);
}

void JSL_KERNEL(jsl_flock_heading)(jsl_real *x, jsl_real *y, jsl_real *z, int64_t n) {
    int64_t j = 0;
    for (; j + WN <= n; j += WN) heading(x + j, y + j, z + j);
    if (j == n) return;
    jsl_real t[3][WN] = {{0}};
    const size_t rest = (size_t)(n - j) * sizeof(jsl_real);
    memcpy(t[0], x + j, rest);
    memcpy(t[1], y + j, rest);
    memcpy(t[2], z + j, rest);
    heading(t[0], t[1], t[2]);
    memcpy(x + j, t[0], rest);
    memcpy(y + j, t[1], rest);
    memcpy(z + j, t[2], rest);
}
