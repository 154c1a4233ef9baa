/* SPDX-License-Identifier: MIT
 * ctx_osmesa.c - off-screen context by OSMesa: software, no display, no window system.
 */
#include "render/ctx.h"

#include <GL/osmesa.h>

/* The default framebuffer is never drawn to, but OSMesa wants memory for one. */
#define SIDE 16

struct jsl_ctx {
    OSMesaContext osmesa;
    uint32_t pixels[SIDE * SIDE];
};

jsl_result jsl_ctx_create(jsl_memory *memory, const jsl_logger *logger, jsl_ctx **out) {
    static const int attributes[] = {OSMESA_FORMAT,
                                     OSMESA_RGBA,
                                     OSMESA_PROFILE,
                                     OSMESA_CORE_PROFILE,
                                     OSMESA_CONTEXT_MAJOR_VERSION,
                                     4,
                                     OSMESA_CONTEXT_MINOR_VERSION,
                                     5,
                                     0};
    jsl_ctx *ctx = jsl_alloc_zero(memory, sizeof *ctx);
    if (!ctx) return jsl_fail(logger, JSL_ERR_MEMORY, "no memory for an off-screen context");
    ctx->osmesa = OSMesaCreateContextAttribs(attributes, NULL);
    if (!ctx->osmesa) {
        jsl_free(memory, ctx, sizeof *ctx);
        return jsl_fail(logger, JSL_ERR_UNSUPPORTED,
                        "OSMesa makes no OpenGL 4.5 core context on this machine");
    }
    *out = ctx;
    return JSL_OK;
}

void jsl_ctx_destroy(jsl_memory *memory, jsl_ctx *ctx) {
    if (!ctx) return;
    OSMesaDestroyContext(ctx->osmesa);
    jsl_free(memory, ctx, sizeof *ctx);
}

bool jsl_ctx_acquire(jsl_ctx *ctx) {
    return OSMesaMakeCurrent(ctx->osmesa, ctx->pixels, GL_UNSIGNED_BYTE, SIDE, SIDE);
}

void jsl_ctx_release(jsl_ctx *ctx) {
    (void)ctx;
    OSMesaMakeCurrent(NULL, NULL, GL_UNSIGNED_BYTE, 0, 0);
}

jsl_ctx_proc jsl_ctx_address(const char *name) { return OSMesaGetProcAddress(name); }
