/* SPDX-License-Identifier: MIT
 * Shared by all tests: cmocka, comparisons of numbers, an allocator that counts and fails, a logger
 * that remembers, and random numbers.
 */
#ifndef JSL_TESTS_HELPER_H
#define JSL_TESTS_HELPER_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <jostle/math.h>

/* -- Numbers --------------------------------------------------------------------------- */

/* |a - b| <= tol, with both values in the message. NaN is never close. */
#define assert_close(a, b, tol)                                                                    \
    helper_close((double)(a), (double)(b), (double)(tol), __FILE__, __LINE__)
#define assert_close_v3(a, b, tol) helper_close_v3(a, b, (double)(tol), __FILE__, __LINE__)
#define assert_ok(expr) helper_result(expr, JSL_OK, #expr, __FILE__, __LINE__)
#define assert_result(expr, want) helper_result(expr, want, #expr, __FILE__, __LINE__)
/* cmocka's comparisons cast to unsigned: this one shows signed 64-bit values. */
#define assert_i64(a, b) helper_i64((int64_t)(a), (int64_t)(b), __FILE__, __LINE__)

void helper_close(double a, double b, double tol, const char *file, int line);
void helper_close_v3(jsl_vec3 a, jsl_vec3 b, double tol, const char *file, int line);
void helper_result(jsl_result got, jsl_result want, const char *what, const char *file, int line);
void helper_i64(int64_t a, int64_t b, const char *file, int line);

/* The error of got against the true value, in units of the last place of got's type at that value.
 * 0 when both are NaN, or the same infinity; infinite when only one is. */
double ulp_error(jsl_real got, long double truth);
/* How many values of the type lie between a and b (0: equal, also -0 and 0). */
uint64_t ulp_distance(jsl_real a, jsl_real b);

/* -- Memory ---------------------------------------------------------------------------- */

/* An allocator over malloc that counts, checks sizes and alignment, fills fresh memory with 0xa5
 * and fails on demand: test_memory memory = {.fail_at = 3};   the third call from now fails (0:
 * none does) jsl_allocator hook = test_allocator(&memory);
 *   ...
 *   assert_no_leaks(&memory);
 * Thread-safe counters; the block list is not kept. */
typedef struct test_memory {
    int64_t fail_at;  /* fails when calls reaches this value; and after it too when fail_on */
    bool fail_on;     /* every call from fail_at on fails */
    int64_t calls;    /* attempts, failed ones too */
    int64_t failures; /* of them */
    int64_t live;     /* blocks */
    int64_t live_bytes;
    int64_t bad_frees; /* with another size or a damaged guard */
} test_memory;
jsl_allocator test_allocator(test_memory *memory);
#define assert_no_leaks(memory) helper_no_leaks(memory, __FILE__, __LINE__)
void helper_no_leaks(const test_memory *memory, const char *file, int line);

/* -- Messages -------------------------------------------------------------------------- */

/* Remembers the last line, and how many there were. */
typedef struct test_log {
    int lines;
    jsl_log_level level;
    jsl_result code;
    char text[512];
} test_log;
jsl_logger test_logger(test_log *log);

/* -- Random numbers: SplitMix64, independent of the library's -------------------------- */

uint64_t test_random(uint64_t *state);
/* Uniform in [lo, hi). */
double test_uniform(uint64_t *state, double lo, double hi);

#endif
