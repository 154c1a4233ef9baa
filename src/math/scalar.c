/* SPDX-License-Identifier: MIT
 * scalar.c - sin, cos, atan2, exp, log: the same bits from every compiler, C library and machine.
 *
 * Everything is computed in double by adds, multiplies and divides in a fixed order; the float
 * build rounds once at the end. Arguments are reduced with constants split into pieces so short
 * that products with the multiple are exact (Cody and Waite 1980); the polynomials are the plain
 * series, long enough that their remainder is below 2^-57 of the result (2^-36 in the float build).
 */
#include <jostle/math.h>

#include <string.h>

#ifdef JSL_DOUBLE
#define LONG_SERIES 1
#else
#define LONG_SERIES 0
#endif

static double bits_to_double(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint64_t double_to_bits(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double power_of_two(int n) { return bits_to_double((uint64_t)(n + 1023) << 52); }

/* -- sine and cosine ------------------------------------------------------------------- */

/* An angle less multiples of pi/2: r + tail in [-pi/4, pi/4] (or just outside), and the quadrant.
 */
typedef struct reduced {
    double r, tail;
    unsigned quadrant;
} reduced;

/* pi/2 in pieces of 23 bits, so that n * piece is exact for |n| < 2^30; the last has 53 bits. */
#define PIO2_1 0x1.921fb4p+0
#define PIO2_2 0x1.4442dp-24
#if LONG_SERIES
#define PIO2_3 0x1.846988p-48
#define PIO2_4 0x1.8cc514p-72
#define PIO2_5 0x1.80dc1cd129025p-95
#else
#define PIO2_3 0x1.8469898cc517p-48
#endif
#define TWO_OVER_PI 0x1.45f306dc9c883p-1
#define TWO_PI 0x1.921fb54442d18p+2
#define LARGEST_ANGLE 1e9

static reduced reduce(double x) {
    /* Beyond the documented range the remainder is exact but its period is not quite 2 pi: the
     * result is still in [-1, 1] and the same everywhere. */
    if (!(x <= LARGEST_ANGLE && x >= -LARGEST_ANGLE)) x = fmod(x, TWO_PI);
    double turns = x * TWO_OVER_PI;
    int32_t n = (int32_t)(turns < 0 ? turns - 0.5 : turns + 0.5);
    double dn = n;
    double r = (x - dn * PIO2_1) - dn * PIO2_2; /* exact */
    double t = dn * PIO2_3;
#if LONG_SERIES
    /* Next to a multiple of pi/2 all of r may cancel, so the differences keep their rounding
     * errors. */
    double r1 = r - t, b1 = r - r1;
    double e1 = (r - (r1 + b1)) + (b1 - t);
    double u = dn * PIO2_4;
    double r2 = r1 - u, b2 = r1 - r2;
    double e2 = (r1 - (r2 + b2)) + (b2 - u);
    double tail = (e1 + e2) - dn * PIO2_5;
    r = r2 + tail;
    return (reduced){r, (r2 - r) + tail, (unsigned)n & 3};
#else
    return (reduced){r - t, 0, (unsigned)n & 3};
#endif
}

static double sine_series(double r, double tail) {
    double z = r * r;
#if LONG_SERIES
    double p = -1.0 / 1307674368000 + z * (1.0 / 355687428096000);
    p = 1.0 / 6227020800 + z * p;
    p = -1.0 / 39916800 + z * p;
#else
    double p = -1.0 / 39916800;
    (void)tail;
#endif
    p = 1.0 / 362880 + z * p;
    p = -1.0 / 5040 + z * p;
    p = 1.0 / 120 + z * p;
    p = -1.0 / 6 + z * p;
#if LONG_SERIES
    return r + (r * z * p + tail * (1 - 0.5 * z));
#else
    return r + r * z * p;
#endif
}

static double cosine_series(double r, double tail) {
    double z = r * r;
#if LONG_SERIES
    double p = -1.0 / 87178291200 + z * (1.0 / 20922789888000);
    p = 1.0 / 479001600 + z * p;
    p = -1.0 / 3628800 + z * p;
#else
    double p = 1.0 / 479001600;
    p = -1.0 / 3628800 + z * p;
    (void)tail;
#endif
    p = 1.0 / 40320 + z * p;
    p = -1.0 / 720 + z * p;
    p = 1.0 / 24 + z * p;
    double half = 0.5 * z, w = 1 - half;
#if LONG_SERIES
    /* (1 - w) - half is the rounding error of w. */
    return w + (((1 - w) - half) + (z * z * p - r * tail));
#else
    return w + z * z * p;
#endif
}

void jsl_sin_cos(jsl_real x, jsl_real *sine, jsl_real *cosine) {
    if (!jsl_is_finite(x)) {
        *sine = *cosine = x - x;
        return;
    }
    if (x == 0) { /* the sums below would lose the sign of a zero */
        *sine = x;
        *cosine = 1;
        return;
    }
    reduced a = reduce((double)x);
    double s = sine_series(a.r, a.tail), c = cosine_series(a.r, a.tail);
    double swapped_s = a.quadrant & 1 ? c : s, swapped_c = a.quadrant & 1 ? s : c;
    *sine = (jsl_real)(a.quadrant & 2 ? -swapped_s : swapped_s);
    *cosine = (jsl_real)((a.quadrant + 1) & 2 ? -swapped_c : swapped_c);
}

jsl_real jsl_sin(jsl_real x) {
    jsl_real sine, cosine;
    jsl_sin_cos(x, &sine, &cosine);
    return sine;
}

jsl_real jsl_cos(jsl_real x) {
    jsl_real sine, cosine;
    jsl_sin_cos(x, &sine, &cosine);
    return cosine;
}

/* -- arc tangent ----------------------------------------------------------------------- */

#define PI_HI 0x1.921fb54442d18p+1
#define PI_LO 0x1.1a62633145c07p-53
#define ATAN_QUARTER_HI 0x1.f5b75f92c80ddp-3
#define ATAN_QUARTER_LO 0x1.8ab6e3cf7afbdp-57
#define ATAN_HALF_HI 0x1.dac670561bb4fp-2
#define ATAN_HALF_LO 0x1.a2b7f222f65e2p-56

/* atan(u) - u for |u| <= 1/4. */
static double arc_tangent_excess(double u) {
    double z = u * u;
#if LONG_SERIES
    double p = -1.0 / 27 + z * (1.0 / 29);
    p = 1.0 / 25 + z * p;
    p = -1.0 / 23 + z * p;
    p = 1.0 / 21 + z * p;
    p = -1.0 / 19 + z * p;
    p = 1.0 / 17 + z * p;
#else
    double p = 1.0 / 17;
#endif
    p = -1.0 / 15 + z * p;
    p = 1.0 / 13 + z * p;
    p = -1.0 / 11 + z * p;
    p = 1.0 / 9 + z * p;
    p = -1.0 / 7 + z * p;
    p = 1.0 / 5 + z * p;
    p = -1.0 / 3 + z * p;
    return u * z * p;
}

/* (whole + whole_lo) - (hi + *rest) as a new head and rest; the head's rounding error is not lost.
 */
static double subtract_from(double whole, double whole_lo, double hi, double *rest) {
    double head = whole - hi;
    *rest = ((whole - head) - hi) + (whole_lo - *rest);
    return head;
}

/* The angle of (y, x) for 0 <= y, 0 <= x, not both zero, both finite: q, the smaller over the
 * larger, is at most 1, and atan(q) = atan(c) + atan((q - c) / (1 + q c)) with c in {0, 1/4, 1/2,
 * 1} leaves a short series. All differences from c are exact, and c is below q where the angle is
 * small, so that nothing cancels. */
static double first_quadrant(double y, double x, bool mirrored) {
    bool steep = y > x;
    double num = steep ? x : y, den = steep ? y : x;
    if (den > 0x1p1000) num *= 0x1p-100, den *= 0x1p-100;
    if (den < 0x1p-900) num *= 0x1p100, den *= 0x1p100;
    double u, hi = 0, lo = 0;
    if (num < 0.25 * den) {
        u = num / den;
    } else if (num < 0.5 * den) {
        u = (num - 0.25 * den) / (den + 0.25 * num);
        hi = ATAN_QUARTER_HI, lo = ATAN_QUARTER_LO;
    } else if (num < 0.75 * den) {
        u = (num - 0.5 * den) / (den + 0.5 * num);
        hi = ATAN_HALF_HI, lo = ATAN_HALF_LO;
    } else {
        u = (num - den) / (den + num);
        hi = PI_HI / 4, lo = PI_LO / 4;
    }
    /* angle = hi + u + (lo + excess), then perhaps pi/2 - angle, then perhaps pi - that. */
    double rest = lo + arc_tangent_excess(u);
    double sign = 1;
    if (steep) hi = subtract_from(PI_HI / 2, PI_LO / 2, hi, &rest), sign = -1;
    if (mirrored) hi = subtract_from(PI_HI, PI_LO, hi, &rest), sign = -sign;
    return hi + (sign * u + rest);
}

jsl_real jsl_atan2(jsl_real y, jsl_real x) {
    if (x != x || y != y) return x + y;
    double ay = y < 0 ? -(double)y : (double)y, ax = x < 0 ? -(double)x : (double)x;
    bool mirrored = signbit(x) != 0, below = signbit(y) != 0;
    double angle;
    if (ay == 0) {
        angle = mirrored ? PI_HI : 0;
    } else if (!jsl_is_finite(x) || !jsl_is_finite(y)) {
        double iy = jsl_is_finite(y) ? 0 : 1, ix = jsl_is_finite(x) ? 0 : 1;
        angle = iy == 0 && !mirrored ? 0 : first_quadrant(iy, ix, mirrored);
    } else {
        angle = first_quadrant(ay, ax, mirrored);
    }
    return (jsl_real)(below ? -angle : angle);
}

/* -- exponential and logarithm --------------------------------------------------------- */

/* ln 2 in 32 + 53 bits. */
#define LN2_HI 0x1.62e42feep-1
#define LN2_LO 0x1.a39ef35793c76p-33
#define ONE_OVER_LN2 0x1.71547652b82fep+0

jsl_real jsl_exp(jsl_real x) {
    if (x != x) return x;
    double d = (double)x;
    if (d > 710) return (jsl_real)INFINITY;
    if (d < -746) return 0;
    double scaled = d * ONE_OVER_LN2;
    int n = (int)(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
    double hi = d - n * LN2_HI, lo = n * LN2_LO; /* hi is exact */
    double r = hi - lo;
#if LONG_SERIES
    double p = 1.0 / 479001600 + r * (1.0 / 6227020800);
    p = 1.0 / 39916800 + r * p;
    p = 1.0 / 3628800 + r * p;
    p = 1.0 / 362880 + r * p;
#else
    double p = 1.0 / 362880;
#endif
    p = 1.0 / 40320 + r * p;
    p = 1.0 / 5040 + r * p;
    p = 1.0 / 720 + r * p;
    p = 1.0 / 120 + r * p;
    p = 1.0 / 24 + r * p;
    p = 1.0 / 6 + r * p;
    p = 0.5 + r * p;
    /* (hi - r) - lo is the rounding error of r. */
    double y = 1 + (r + (r * r * p + ((hi - r) - lo)));
    /* In two factors, as 2^n alone may be out of range when the result is not. */
    int half = n / 2;
    return (jsl_real)(y * power_of_two(half) * power_of_two(n - half));
}

jsl_real jsl_log(jsl_real x) {
    if (x != x || x < 0) return (jsl_real)NAN;
    if (x == 0) return -(jsl_real)INFINITY;
    if (!jsl_is_finite(x)) return x;
    double d = (double)x;
    int exponent = 0;
    if (d < 0x1p-1022) d *= 0x1p54, exponent = -54;
    /* d = 2^exponent * m with m in [sqrt(1/2), sqrt(2)). */
    uint64_t bits = double_to_bits(d);
    uint64_t fraction = bits & 0xfffffffffffffull;
    bool upper = fraction > 0x6a09e667f3bccull;
    exponent += (int)(bits >> 52) - 1023 + upper;
    double f = bits_to_double(fraction | (upper ? 0x3feull : 0x3ffull) << 52) - 1;
    /* ln(1 + f) = 2 artanh(s), s = f / (2 + f), = f - s (f - R) with R the series from s^2 on. */
    double s = f / (2 + f), z = s * s;
#if LONG_SERIES
    double p = 2.0 / 19 + z * (2.0 / 21);
    p = 2.0 / 17 + z * p;
    p = 2.0 / 15 + z * p;
    p = 2.0 / 13 + z * p;
#else
    double p = 2.0 / 13;
#endif
    p = 2.0 / 11 + z * p;
    p = 2.0 / 9 + z * p;
    p = 2.0 / 7 + z * p;
    p = 2.0 / 5 + z * p;
    p = 2.0 / 3 + z * p;
    double half_sq = 0.5 * f * f;
    double rest = s * (half_sq + z * p) + exponent * LN2_LO;
    return (jsl_real)(exponent * LN2_HI + (f - (half_sq - rest)));
}
