/* SPDX-License-Identifier: MIT
 * targets.c - the framebuffers of a renderer.
 */
#include "render/renderer.h"

static jsl_result complete(const jsl_renderer *r, const char *name) {
    const jsl_gl *gl = &r->gl;
    GLenum error = gl->GetError();
    if (error == GL_OUT_OF_MEMORY)
        return jsl_fail(&r->logger, JSL_ERR_MEMORY, "no memory for the %s picture of %d x %d", name,
                        r->desc.width, r->desc.height);
    GLenum status = gl->CheckFramebufferStatus(GL_FRAMEBUFFER);
    if (error != GL_NO_ERROR || status != GL_FRAMEBUFFER_COMPLETE)
        return jsl_fail(&r->logger, JSL_ERR_UNSUPPORTED,
                        "OpenGL cannot draw to the %s picture (status 0x%x, error 0x%x)", name,
                        (unsigned)status, (unsigned)error);
    return JSL_OK;
}

static jsl_result many_sampled(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    jsl_targets *t = &r->targets;
    static const GLenum format[2] = {GL_RGBA8, GL_DEPTH_COMPONENT32F};
    static const GLenum place[2] = {GL_COLOR_ATTACHMENT0, GL_DEPTH_ATTACHMENT};
    GLuint *name[2] = {&t->many_color, &t->many_depth};
    gl->GenFramebuffers(1, &t->many);
    gl->BindFramebuffer(GL_FRAMEBUFFER, t->many);
    for (int k = 0; k < 2; k++) {
        gl->GenRenderbuffers(1, name[k]);
        gl->BindRenderbuffer(GL_RENDERBUFFER, *name[k]);
        gl->RenderbufferStorageMultisample(GL_RENDERBUFFER,
                                           r->desc.samples > 1 ? r->desc.samples : 0, format[k],
                                           r->desc.width, r->desc.height);
        gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, place[k], GL_RENDERBUFFER, *name[k]);
    }
    return complete(r, "multisampled");
}

static jsl_result flat(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    jsl_targets *t = &r->targets;
    int w = r->desc.width, h = r->desc.height;
    gl->GenFramebuffers(1, &t->one);
    gl->BindFramebuffer(GL_FRAMEBUFFER, t->one);
    t->one_color = jsl_gl_texture(gl, GL_RGBA8, w, h, GL_RGBA, GL_UNSIGNED_BYTE, GL_NEAREST, NULL);
    t->one_depth = jsl_gl_texture(gl, GL_DEPTH_COMPONENT32F, w, h, GL_DEPTH_COMPONENT, GL_FLOAT,
                                  GL_NEAREST, NULL);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t->one_color, 0);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, t->one_depth, 0);
    JSL_TRY(complete(r, "resolved"));

    gl->GenFramebuffers(1, &t->light);
    gl->BindFramebuffer(GL_FRAMEBUFFER, t->light);
    t->light_color = jsl_gl_texture(gl, GL_RGBA16F, w, h, GL_RGBA, GL_FLOAT, GL_LINEAR, NULL);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t->light_color,
                             0);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, t->one_depth, 0);
    JSL_TRY(complete(r, "light"));

    t->halo_width = (w + 3) / 4, t->halo_height = (h + 3) / 4;
    for (int k = 0; k < 2; k++) {
        gl->GenFramebuffers(1, &t->halo[k]);
        gl->BindFramebuffer(GL_FRAMEBUFFER, t->halo[k]);
        t->halo_color[k] = jsl_gl_texture(gl, GL_RGBA16F, t->halo_width, t->halo_height, GL_RGBA,
                                          GL_FLOAT, GL_LINEAR, NULL);
        gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D,
                                 t->halo_color[k], 0);
        JSL_TRY(complete(r, "halo"));
    }
    return JSL_OK;
}

static jsl_result shadow(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    jsl_targets *t = &r->targets;
    t->shadow_side = 256;
    while (t->shadow_side < 2048 && t->shadow_side < 2 * r->desc.height) t->shadow_side *= 2;
    gl->GenFramebuffers(1, &t->shadow);
    gl->BindFramebuffer(GL_FRAMEBUFFER, t->shadow);
    t->shadow_depth = jsl_gl_texture(gl, GL_DEPTH_COMPONENT32F, t->shadow_side, t->shadow_side,
                                     GL_DEPTH_COMPONENT, GL_FLOAT, GL_LINEAR, NULL);
    /* All that is outside of the map is in the sun. */
    static const float lit[4] = {1, 1, 1, 1};
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
    gl->TexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, lit);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, t->shadow_depth,
                             0);
    gl->DrawBuffer(GL_NONE);
    gl->ReadBuffer(GL_NONE);
    return complete(r, "shadow");
}

jsl_result jsl_targets_create(jsl_renderer *r) {
    GLint most = 0;
    r->gl.GetIntegerv(GL_MAX_SAMPLES, &most);
    if (r->desc.samples > 1 && r->desc.samples > most)
        return jsl_fail(&r->logger, JSL_ERR_UNSUPPORTED,
                        "%d samples per pixel: OpenGL has at most %d", r->desc.samples, (int)most);
    JSL_TRY(many_sampled(r));
    JSL_TRY(flat(r));
    return shadow(r);
}

void jsl_targets_destroy(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    jsl_targets *t = &r->targets;
    const GLuint framebuffers[] = {t->many, t->one, t->light, t->halo[0], t->halo[1], t->shadow};
    const GLuint renderbuffers[] = {t->many_color, t->many_depth};
    const GLuint textures[] = {t->one_color,     t->one_depth,     t->light_color,
                               t->halo_color[0], t->halo_color[1], t->shadow_depth};
    gl->DeleteFramebuffers(JSL_COUNT(framebuffers), framebuffers);
    gl->DeleteRenderbuffers(JSL_COUNT(renderbuffers), renderbuffers);
    gl->DeleteTextures(JSL_COUNT(textures), textures);
    *t = (jsl_targets){0};
}
