/* SPDX-License-Identifier: MIT
 * ctx.h - an off-screen OpenGL core context, whoever makes it. One file implements this:
 * ctx_osmesa.c.
 */
#ifndef JSL_RENDER_CTX_H
#define JSL_RENDER_CTX_H

#include "base/base.h"

typedef struct jsl_ctx jsl_ctx;
typedef void (*jsl_ctx_proc)(void);

/* OpenGL 4.5 core or newer, with any default framebuffer: the renderer draws to its own. Not
 * current yet. JSL_ERR_UNSUPPORTED with the reason in the log. */
jsl_result jsl_ctx_create(jsl_memory *memory, const jsl_logger *logger, jsl_ctx **out);
void jsl_ctx_destroy(jsl_memory *memory, jsl_ctx *ctx);
/* Makes the context current on this thread; false when it cannot. */
bool jsl_ctx_acquire(jsl_ctx *ctx);
/* Leaves this thread without a current context. */
void jsl_ctx_release(jsl_ctx *ctx);
/* The address of an OpenGL function, or null. */
jsl_ctx_proc jsl_ctx_address(const char *name);

#endif
