/* SPDX-License-Identifier: MIT
 * Perception: for each boid, find its neighbours among the candidates of the cells around it, pack
 * them into a list, and sum over the list. Packing first keeps the long arithmetic off the 5 in 6
 * candidates that are out of reach.
 */
#include "flock/sense.h"
#include "math/wide.h"

#if JSL_KERNEL_ISA == 3 && !defined(JSL_DOUBLE)
#define PACK8 1
#endif

#ifdef PACK8
/* Entry b lists the set bits of b, one a byte, lowest first. */
#define PLACE(b, k)                                                                                \
    ((uint64_t)((b) >> (k)&1) * (k) << 8 * __builtin_popcount((b) & ((1 << (k)) - 1)))
#define ROW1(b)                                                                                    \
    PLACE(b, 1) + PLACE(b, 2) + PLACE(b, 3) + PLACE(b, 4) + PLACE(b, 5) + PLACE(b, 6) + PLACE(b, 7)
#define ROW4(b) ROW1(b), ROW1(b + 1), ROW1(b + 2), ROW1(b + 3)
#define ROW16(b) ROW4(b), ROW4(b + 4), ROW4(b + 8), ROW4(b + 12)
#define ROW64(b) ROW16(b), ROW16(b + 16), ROW16(b + 32), ROW16(b + 48)
static const uint64_t pack_order[256] = {ROW64(0), ROW64(64), ROW64(128), ROW64(192)};
#endif

typedef jsl_real list_array[JSL_FLOCK_LIST + 2 * JSL_LANES];
typedef jsl_real candidate_array[JSL_FLOCK_BUFFER + 2 * JSL_LANES];

/* Writes the lanes of v whose bit is set to to[0..], and leaves garbage in the rest of a register
 * behind them. */
JSL_INLINE void pack(jsl_real *to, wreal v, int bits) {
#if defined(PACK8)
    __m256i order = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)&pack_order[bits]));
    _mm256_storeu_ps(to, _mm256_permutevar8x32_ps((__m256)v, order));
#elif JSL_KERNEL_ISA == 4 && !defined(JSL_DOUBLE)
    _mm512_storeu_ps(to, _mm512_maskz_compress_ps((__mmask16)bits, (__m512)v));
#elif JSL_KERNEL_ISA == 4
    _mm512_storeu_pd(to, _mm512_maskz_compress_pd((__mmask8)bits, (__m512d)v));
#elif JSL_KERNEL_ISA == 1
    (void)bits;
    *to = v;
#else
    int q = 0;
    for (int l = 0; l < WN; l++) {
        to[q] = v[l];
        q += bits >> l & 1;
    }
#endif
}

JSL_INLINE int count_bits(int bits) { return WN == 1 ? bits : __builtin_popcount((unsigned)bits); }

typedef struct sums {
    jsl_real lane[9][JSL_LANES];
    int alignment, cohesion, any, same;
} sums;

typedef struct eye {
    jsl_real x, y, z, hx, hy, hz;
} eye;

/* Adds whole groups of 16 listed neighbours to the lanes. The registers of a group are independent,
 * so each is carried through all groups in turn; that keeps the sums in registers at every width.
 */
JSL_INLINE void digest(const jsl_lens *lens, const eye *e, list_array *list, int begin, int groups,
                       bool fresh, sums *s) {
    const wreal hx = wset(e->hx), hy = wset(e->hy), hz = wset(e->hz);
    const wreal tiny = wset(JSL_R(1e-30)), none = wset(0);
    int alignment = 0, cohesion = 0, any = 0, other_count = 0;
    for (int g = 0; g < JSL_LANES; g += WN) {
        wreal t[9];
        for (int k = 0; k < 9; k++) t[k] = fresh ? none : wloadu(s->lane[k] + g);
        for (int j = begin + g; j < begin + groups * JSL_LANES; j += JSL_LANES) {
            wreal dx = wloadu(list[0] + j), dy = wloadu(list[1] + j), dz = wloadu(list[2] + j);
            wreal d2 = dx * dx + dy * dy + dz * dz;
            wreal dot = dx * hx + dy * hy + dz * hz;
            wreal ahead = dot * wabs(dot);
            wmask other = wgt(d2, none);
            wmask near = wgt(wset(lens->near_sq), d2);
            wmask in[JSL_RULES];
            for (int r = 0; r < JSL_RULES; r++)
                in[r] = other & (near | (wge(wset(lens->radius_sq[r]), d2) &
                                         wgt(ahead, wset(lens->cone[r]) * d2)));
            wreal w = wkeep(in[JSL_SEPARATION], wset(1) / wmax(d2, tiny));
            t[0] += dx * w;
            t[1] += dy * w;
            t[2] += dz * w;
            for (int k = 3; k < 6; k++) t[k] += wkeep(in[JSL_ALIGNMENT], wloadu(list[k] + j));
            t[6] += wkeep(in[JSL_COHESION], dx);
            t[7] += wkeep(in[JSL_COHESION], dy);
            t[8] += wkeep(in[JSL_COHESION], dz);
            alignment += count_bits(wbits(in[JSL_ALIGNMENT]));
            cohesion += count_bits(wbits(in[JSL_COHESION]));
            any += count_bits(wbits(in[0] | in[1] | in[2]));
            other_count += count_bits(wbits(other));
        }
        for (int k = 0; k < 9; k++) wstoreu(s->lane[k] + g, t[k]);
    }
    s->alignment = (fresh ? 0 : s->alignment) + alignment;
    s->cohesion = (fresh ? 0 : s->cohesion) + cohesion;
    s->any = (fresh ? 0 : s->any) + any;
    s->same = (fresh ? 0 : s->same) + groups * JSL_LANES - other_count;
}

#if defined(PACK8)
/* wsum16 of four rows at once: the same tree, so the same bits. */
JSL_INLINE __m128 fold(const jsl_real *v) {
    __m256 t = _mm256_add_ps(_mm256_loadu_ps(v), _mm256_loadu_ps(v + 8));
    return _mm_add_ps(_mm256_castps256_ps128(t), _mm256_extractf128_ps(t, 1));
}
JSL_INLINE void reduce4(const sums *s, int k, jsl_real *out) {
    __m128 a = fold(s->lane[k]), b = fold(s->lane[k + 1]);
    __m128 c = fold(s->lane[k + 2]), d = fold(s->lane[k + 3]);
    __m128 ab = _mm_add_ps(_mm_movelh_ps(a, b), _mm_movehl_ps(b, a));
    __m128 cd = _mm_add_ps(_mm_movelh_ps(c, d), _mm_movehl_ps(d, c));
    _mm_storeu_ps(out, _mm_add_ps(_mm_shuffle_ps(ab, cd, _MM_SHUFFLE(2, 0, 2, 0)),
                                  _mm_shuffle_ps(ab, cd, _MM_SHUFFLE(3, 1, 3, 1))));
}
#endif

/* Boid k's results; spare: list entries that were only filling. */
JSL_INLINE void report(const sums *s, int spare, jsl_real (*sense)[JSL_FLOCK_CHUNK], int k) {
#if defined(PACK8)
    jsl_real out[8];
    reduce4(s, 0, out);
    reduce4(s, 4, out + 4);
    for (int i = 0; i < 8; i++) sense[i][k] = out[i];
    sense[8][k] = wsum16(s->lane[8]);
#else
    for (int i = 0; i < 9; i++) sense[i][k] = wsum16(s->lane[i]);
#endif
    sense[JSL_COUNT_ALIGNMENT][k] = (jsl_real)s->alignment;
    sense[JSL_COUNT_COHESION][k] = (jsl_real)s->cohesion;
    sense[JSL_COUNT_ANY][k] = (jsl_real)s->any;
    sense[JSL_COUNT_SAME][k] = (jsl_real)(s->same - spare);
}

JSL_INLINE int pack_all(const jsl_real *const c[6], int64_t j, wreal dx, wreal dy, wreal dz,
                        int bits, list_array *list, int q) {
    pack(list[0] + q, dx, bits);
    pack(list[1] + q, dy, bits);
    pack(list[2] + q, dz, bits);
    pack(list[3] + q, wloadu(c[3] + j), bits);
    pack(list[4] + q, wloadu(c[4] + j), bits);
    pack(list[5] + q, wloadu(c[5] + j), bits);
    return q + count_bits(bits);
}

/* Fills the last group from entry q on with offset 0, which counts for nothing but `same`. */
JSL_INLINE void fill(list_array *list, int q) {
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < JSL_LANES; l += WN) wstoreu(list[k] + q + l, wset(0));
}

/* Copies the candidates of a gaze side by side, then one register out of anyone's reach. */
static int collect(const jsl_sight *sight, const jsl_gaze *gaze, candidate_array *to) {
    const jsl_real *const from[6] = {sight->x, sight->y, sight->z, sight->ux, sight->uy, sight->uz};
    int n = 0;
    for (int s = 0; s < gaze->spans; s++) {
        const int64_t begin = gaze->span[s].begin;
        const int count = (int)(gaze->span[s].end - begin);
        for (int j = 0; j < count; j += WN)
            for (int k = 0; k < 6; k++) wstoreu(to[k] + n + j, wloadu(from[k] + begin + j));
        n += count;
    }
    wstoreu(to[0] + n, wset(JSL_R(1e30)));
    return n;
}

/* Lists the neighbours of one boid from entry q on; returns the end of the list. */
JSL_INLINE int enlist(const jsl_lens *lens, candidate_array *from, int total, jsl_real ex,
                      jsl_real ey, jsl_real ez, list_array *list, int q) {
    const wreal x = wset(ex), y = wset(ey), z = wset(ez), reach = wset(lens->reach_sq);
    const jsl_real *c[6];
    for (int k = 0; k < 6; k++) c[k] = from[k];
    for (int j = 0; j < total; j += WN) {
        wreal dx = wloadu(c[0] + j) - x, dy = wloadu(c[1] + j) - y, dz = wloadu(c[2] + j) - z;
        wreal d2 = dx * dx + dy * dy + dz * dz;
        q = pack_all(c, j, dx, dy, dz, wbits(wge(reach, d2)), list, q);
    }
    fill(list, q);
    return q;
}

/* Sums the lists of boids [first, end) of who. */
static void settle(const jsl_lens *lens, const jsl_sight *sight, const int64_t *who,
                   const jsl_real *const heading[3], int first, int end,
                   jsl_sense_scratch *scratch) {
    for (int k = first, begin = 0; k < end; k++) {
        const int64_t self = who[k];
        const eye e = {sight->x[self], sight->y[self], sight->z[self],
                       heading[0][k],  heading[1][k],  heading[2][k]};
        const int n = scratch->length[k], whole = (int)jsl_round_up(n, JSL_LANES);
        sums s;
        digest(lens, &e, scratch->list, begin, whole / JSL_LANES, true, &s);
        report(&s, whole - n, scratch->sense, k);
        begin += whole;
    }
}

/* A crowd: candidates are read in place and the list is summed whenever it is full. */
static void sense_crowd(const jsl_lens *lens, const jsl_sight *sight, const jsl_span *span,
                        int spans, const eye *e, int k, jsl_sense_scratch *scratch) {
    list_array *list = scratch->list;
    const jsl_real *const c[6] = {sight->x, sight->y, sight->z, sight->ux, sight->uy, sight->uz};
    const wreal x = wset(e->x), y = wset(e->y), z = wset(e->z), reach = wset(lens->reach_sq);
    sums s = {.alignment = 0};
    int q = 0;
    for (int i = 0; i < spans; i++) {
        for (int64_t j = span[i].begin; j < span[i].end; j += WN) {
            wreal dx = wloadu(c[0] + j) - x, dy = wloadu(c[1] + j) - y, dz = wloadu(c[2] + j) - z;
            wreal d2 = dx * dx + dy * dy + dz * dz;
            int bits = wbits(wge(reach, d2));
            if (span[i].end - j < WN) bits &= (1 << (span[i].end - j)) - 1;
            q = pack_all(c, j, dx, dy, dz, bits, list, q);
            if (q < JSL_FLOCK_LIST) continue;
            const int whole = q / JSL_LANES * JSL_LANES;
            digest(lens, e, list, 0, whole / JSL_LANES, false, &s);
            q -= whole;
            for (int f = 0; f < 6; f++)
                memcpy(list[f], list[f] + whole, (size_t)q * sizeof(jsl_real));
        }
    }
    fill(list, q);
    const int whole = (int)jsl_round_up(q, JSL_LANES);
    digest(lens, e, list, 0, whole / JSL_LANES, false, &s);
    report(&s, whole - q, scratch->sense, k);
}

static int64_t candidates(const jsl_gaze *gaze) {
    int64_t n = 0;
    for (int i = 0; i < gaze->spans; i++) n += gaze->span[i].end - gaze->span[i].begin;
    return n;
}

/* What was just stored in overlapping pieces cannot be loaded at once without a stall, so the work
 * is taken apart: the candidates of the next gaze are collected before those of this one are read,
 * and many boids are listed before the first is summed. */
void JSL_KERNEL(jsl_flock_sense)(const jsl_lens *lens, const jsl_sight *sight, const jsl_gaze *gaze,
                                 int gazes, const int64_t *who, const jsl_real *const heading[3],
                                 jsl_sense_scratch *scratch) {
    int listed = 0, q = 0, total[2] = {0, 0};
    for (int g = -1; g < gazes; g++) {
        if (g + 1 < gazes && candidates(&gaze[g + 1]) <= JSL_FLOCK_BUFFER)
            total[(g + 1) & 1] = collect(sight, &gaze[g + 1], scratch->candidate[(g + 1) & 1]);
        if (g < 0) continue;
        const int begin = gaze[g].begin, end = gaze[g].end;
        if (candidates(&gaze[g]) > JSL_FLOCK_BUFFER) {
            settle(lens, sight, who, heading, listed, begin, scratch);
            listed = end, q = 0;
            for (int k = begin; k < end; k++) {
                const int64_t self = who[k];
                const eye e = {sight->x[self], sight->y[self], sight->z[self],
                               heading[0][k],  heading[1][k],  heading[2][k]};
                sense_crowd(lens, sight, gaze[g].span, gaze[g].spans, &e, k, scratch);
            }
            continue;
        }
        for (int k = begin; k < end; k++) {
            if (q + total[g & 1] + JSL_LANES > JSL_FLOCK_LIST) {
                settle(lens, sight, who, heading, listed, k, scratch);
                listed = k, q = 0;
            }
            const int64_t self = who[k];
            const int stop = enlist(lens, scratch->candidate[g & 1], total[g & 1], sight->x[self],
                                    sight->y[self], sight->z[self], scratch->list, q);
            scratch->length[k] = stop - q;
            q = (int)jsl_round_up(stop, JSL_LANES);
        }
    }
    settle(lens, sight, who, heading, listed, gazes ? gaze[gazes - 1].end : 0, scratch);
}
