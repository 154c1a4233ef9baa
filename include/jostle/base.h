/* SPDX-License-Identifier: MIT
 * jostle/base.h - results, versions, and the three hooks a host may supply: memory, messages,
 * tasks.
 *
 * Everything fallible returns a jsl_result, in every build. On failure the callee changed nothing,
 * and logged one line that names the offender through the logger of the object concerned. Nothing
 * in the library exits, aborts or prints. All quantities are SI. Floor 0.
 */
#ifndef JOSTLE_BASE_H
#define JOSTLE_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __FAST_MATH__
#error "jostle promises bitwise reproducible results: do not compile it with -ffast-math"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define JSL_VERSION_MAJOR 0
#define JSL_VERSION_MINOR 1
#define JSL_VERSION_PATCH 0
#define JSL_VERSION_TEXT "0.1.0"

#if defined(__GNUC__)
#define JSL_API __attribute__((visibility("default")))
#else
#define JSL_API
#endif

/* The scalar of every state column: float in libjostle, double in libjostle-f64 (compile with
 * -DJSL_DOUBLE, which the .pc file of the double library does for you). */
#ifdef JSL_DOUBLE
typedef double jsl_real;
#define JSL_REAL_EPSILON 2.220446049250313e-16
#define JSL_PRECISION_TEXT "double"
#else
typedef float jsl_real;
#define JSL_REAL_EPSILON 1.1920929e-7f
#define JSL_PRECISION_TEXT "float"
#endif
/* A literal in the scalar type: JSL_R(0.5). */
#define JSL_R(x) ((jsl_real)(x))

/* -- Results --------------------------------------------------------------------------- */

/* X(code, text). Zero is success; every failure is positive. */
#define JSL_RESULTS(X)                                                                             \
    X(JSL_OK, "ok")                                                                                \
    X(JSL_ERR_ARGUMENT, "argument out of its range")                                               \
    X(JSL_ERR_NOT_FINITE, "a number is NaN or infinite")                                           \
    X(JSL_ERR_HANDLE, "handle is null, stale, forged or of another world")                         \
    X(JSL_ERR_MEMORY, "out of memory")                                                             \
    X(JSL_ERR_LIMIT, "a documented limit was reached")                                             \
    X(JSL_ERR_NAME, "name is unknown or already taken")                                            \
    X(JSL_ERR_CONFLICT, "the choices exclude each other")                                          \
    X(JSL_ERR_STATE, "not allowed in the present state")                                           \
    X(JSL_ERR_DEGENERATE, "geometry is degenerate")                                                \
    X(JSL_ERR_FORMAT, "data is damaged or of another format")                                      \
    X(JSL_ERR_VERSION, "data was written by an incompatible version or schema")                    \
    X(JSL_ERR_IO, "input or output failed")                                                        \
    X(JSL_ERR_END, "end of data")                                                                  \
    X(JSL_ERR_UNSUPPORTED, "not supported by this build or machine")

typedef enum jsl_result {
#define JSL_X(code, text) code,
    JSL_RESULTS(JSL_X)
#undef JSL_X
        JSL_RESULT_COUNT
} jsl_result;

/* The text of a result; "unknown result" for a value that is none. Never null. */
JSL_API const char *jsl_result_text(jsl_result result);

/* The library's version as "major.minor.patch", and whether it was built for double. */
JSL_API const char *jsl_version(void);
JSL_API bool jsl_is_double(void);

/* -- Memory ---------------------------------------------------------------------------- */

/* alloc returns size bytes aligned to align (a power of two >= 8) or null; free gets the size that
 * was asked for. A zeroed allocator means the C library's. ctx is passed back. Both must be
 * callable from any thread that uses the object concerned. */
typedef struct jsl_allocator {
    void *(*alloc)(size_t size, size_t align, void *ctx);
    void (*free)(void *ptr, size_t size, void *ctx);
    void *ctx;
} jsl_allocator;

/* -- Messages -------------------------------------------------------------------------- */

typedef enum jsl_log_level { JSL_LOG_ERROR, JSL_LOG_WARNING, JSL_LOG_INFO } jsl_log_level;

/* Receives one line without newline. A zeroed logger is silent. */
typedef struct jsl_logger {
    void (*write)(jsl_log_level level, jsl_result code, const char *text, void *ctx);
    void *ctx;
} jsl_logger;

/* -- Tasks ----------------------------------------------------------------------------- */

typedef void jsl_task_fn(void *arg);

/* A host's job system. enqueue starts fn(arg) on some thread and returns a handle (null: it already
 * ran inline); finish waits for that handle. workers is the number of threads that may run at once,
 * the caller included. A zeroed struct means: run everything on the calling thread. Results never
 * depend on it. */
typedef struct jsl_tasks {
    void *(*enqueue)(jsl_task_fn *fn, void *arg, void *ctx);
    void (*finish)(void *handle, void *ctx);
    void *ctx;
    int workers;
} jsl_tasks;

/* -- Instruction sets ------------------------------------------------------------------ */

/* Kernels exist once per level, and give the same bits at each. JSL_ISA_AUTO picks the widest that
 * this CPU has, or the one that the environment variable JSL_ISA names (scalar, sse, avx2, avx512).
 */
typedef enum jsl_isa {
    JSL_ISA_AUTO,
    JSL_ISA_SCALAR,
    JSL_ISA_SSE,
    JSL_ISA_AVX2,
    JSL_ISA_AVX512,
    JSL_ISA_COUNT
} jsl_isa;

/* "scalar", "sse", "avx2", "avx512", or "auto". */
JSL_API const char *jsl_isa_text(jsl_isa isa);

/* Resolves AUTO as told above; any other level is returned if this CPU can run it, else the widest
 * it can. Never AUTO. */
JSL_API jsl_isa jsl_isa_resolve(jsl_isa isa);

#ifdef __cplusplus
}
#endif
#endif
