/* SPDX-License-Identifier: MIT
 * helper.c - see helper.h.
 */
#include "helper.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

void helper_close(double a, double b, double tol, const char *file, int line) {
    if (fabs(a - b) <= tol) return;
    print_error("%.17g and %.17g differ by %.3g, more than %.3g\n", a, b, fabs(a - b), tol);
    _fail(file, line);
}

void helper_close_v3(jsl_vec3 a, jsl_vec3 b, double tol, const char *file, int line) {
    helper_close((double)a.x, (double)b.x, tol, file, line);
    helper_close((double)a.y, (double)b.y, tol, file, line);
    helper_close((double)a.z, (double)b.z, tol, file, line);
}

void helper_result(jsl_result got, jsl_result want, const char *what, const char *file, int line) {
    if (got == want) return;
    print_error("%s gave \"%s\" instead of \"%s\"\n", what, jsl_result_text(got),
                jsl_result_text(want));
    _fail(file, line);
}

void helper_i64(int64_t a, int64_t b, const char *file, int line) {
    if (a == b) return;
    print_error("%lld is not %lld\n", (long long)a, (long long)b);
    _fail(file, line);
}

#ifdef JSL_DOUBLE
#define DIGITS DBL_MANT_DIG
#define LOWEST DBL_MIN_EXP
#else
#define DIGITS FLT_MANT_DIG
#define LOWEST FLT_MIN_EXP
#endif

double ulp_error(jsl_real got, long double truth) {
    if (isnan(truth) || got != got) return isnan(truth) && got != got ? 0 : INFINITY;
    if ((long double)got == truth) return 0;
    int exponent = LOWEST;
    if (truth != 0 && !isinf(truth)) (void)frexpl(truth, &exponent);
    if (exponent < LOWEST) exponent = LOWEST;
    long double ulp = ldexpl(1, exponent - DIGITS);
    /* A true value too large for the type should have become infinite. */
    if (!jsl_is_finite(got)) return (long double)(jsl_real)truth == (long double)got ? 0 : INFINITY;
    return (double)(fabsl((long double)got - truth) / ulp);
}

uint64_t ulp_distance(jsl_real a, jsl_real b) {
#ifdef JSL_DOUBLE
    int64_t i, j, low = INT64_MIN;
#else
    int32_t i, j, low = INT32_MIN;
#endif
    memcpy(&i, &a, sizeof i);
    memcpy(&j, &b, sizeof j);
    int64_t x = i < 0 ? (int64_t)(low - i) : i, y = j < 0 ? (int64_t)(low - j) : j;
    return x > y ? (uint64_t)x - (uint64_t)y : (uint64_t)y - (uint64_t)x;
}

/* -- Memory: a header before each block keeps what it needs to be checked and freed ---- */

typedef struct header {
    void *base;
    size_t size;
    uint64_t guard;
} header;
#define GUARD 0x6a757374206c6574ull

static void *counting_alloc(size_t size, size_t align, void *ctx) {
    test_memory *m = ctx;
    int64_t call = __atomic_add_fetch(&m->calls, 1, __ATOMIC_RELAXED);
    if (m->fail_at && (call == m->fail_at || (m->fail_on && call > m->fail_at))) {
        __atomic_add_fetch(&m->failures, 1, __ATOMIC_RELAXED);
        return NULL;
    }
    /* As high as the alignment allows, so that a write past the end leaves the malloc block. */
    char *base = malloc(size + align + sizeof(header));
    if (!base) return NULL;
    uintptr_t at = ((uintptr_t)base + sizeof(header) + align - 1) & ~(uintptr_t)(align - 1);
    char *ptr = base + (at - (uintptr_t)base);
    header h = {base, size, GUARD};
    memcpy(ptr - sizeof h, &h, sizeof h);
    memset(ptr, 0xa5, size);
    __atomic_add_fetch(&m->live, 1, __ATOMIC_RELAXED);
    __atomic_add_fetch(&m->live_bytes, (int64_t)size, __ATOMIC_RELAXED);
    return ptr;
}

static void counting_free(void *ptr, size_t size, void *ctx) {
    test_memory *m = ctx;
    header h;
    memcpy(&h, (char *)ptr - sizeof h, sizeof h);
    if (h.guard != GUARD || h.size != size) {
        __atomic_add_fetch(&m->bad_frees, 1, __ATOMIC_RELAXED);
        if (h.guard != GUARD) return;
    }
    __atomic_sub_fetch(&m->live, 1, __ATOMIC_RELAXED);
    __atomic_sub_fetch(&m->live_bytes, (int64_t)h.size, __ATOMIC_RELAXED);
    h.guard = 0;
    memcpy((char *)ptr - sizeof h, &h, sizeof h);
    free(h.base);
}

jsl_allocator test_allocator(test_memory *memory) {
    return (jsl_allocator){counting_alloc, counting_free, memory};
}

void helper_no_leaks(const test_memory *memory, const char *file, int line) {
    if (memory->live == 0 && memory->live_bytes == 0 && memory->bad_frees == 0) return;
    print_error("%lld blocks of %lld bytes leaked, %lld bad frees\n", (long long)memory->live,
                (long long)memory->live_bytes, (long long)memory->bad_frees);
    _fail(file, line);
}

/* -- Messages and random numbers ------------------------------------------------------- */

static void remember(jsl_log_level level, jsl_result code, const char *text, void *ctx) {
    test_log *log = ctx;
    log->lines++;
    log->level = level;
    log->code = code;
    size_t length = strlen(text);
    if (length >= sizeof log->text) length = sizeof log->text - 1;
    memcpy(log->text, text, length);
    log->text[length] = 0;
}

jsl_logger test_logger(test_log *log) { return (jsl_logger){remember, log}; }

uint64_t test_random(uint64_t *state) {
    uint64_t z = *state += 0x9e3779b97f4a7c15ull;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ z >> 27) * 0x94d049bb133111ebull;
    return z ^ z >> 31;
}

double test_uniform(uint64_t *state, double lo, double hi) {
    return lo + (hi - lo) * ((double)(test_random(state) >> 11) * 0x1p-53);
}
