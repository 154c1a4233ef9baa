/* SPDX-License-Identifier: MIT
 * gl.c - loads OpenGL functions, compiles programs, makes textures.
 */
#include "render/gl.h"

#include "render/ctx.h"
#include "render/shaders.h"

jsl_result jsl_gl_load(jsl_gl *gl, const jsl_logger *logger) {
#define JSL_X(type, name)                                                                          \
    gl->name = (type)jsl_ctx_address("gl" #name);                                                  \
    if (!gl->name)                                                                                 \
        return jsl_fail(logger, JSL_ERR_UNSUPPORTED, "the OpenGL context lacks gl" #name);
    JSL_GL_FUNCTIONS(JSL_X)
#undef JSL_X
    return JSL_OK;
}

static jsl_result compile(const jsl_gl *gl, const jsl_logger *logger, const char *name, GLenum kind,
                          const char *prefix, const char *source, GLuint *out) {
    const char *light = kind == GL_FRAGMENT_SHADER ? jsl_shader_light : "";
    const char *parts[] = {"#version 450 core\n", jsl_shader_frame, "\n", prefix, light, source};
    GLuint shader = gl->CreateShader(kind);
    gl->ShaderSource(shader, JSL_COUNT(parts), parts, NULL);
    gl->CompileShader(shader);
    GLint good = 0;
    gl->GetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (!good) {
        char text[300] = "";
        gl->GetShaderInfoLog(shader, sizeof text, NULL, text);
        gl->DeleteShader(shader);
        return jsl_fail(logger, JSL_ERR_UNSUPPORTED, "%s shader of '%s': %s",
                        kind == GL_VERTEX_SHADER ? "vertex" : "fragment", name, text);
    }
    *out = shader;
    return JSL_OK;
}

jsl_result jsl_gl_program(const jsl_gl *gl, const jsl_logger *logger, const char *name,
                          const char *prefix, const char *vertex, const char *fragment,
                          GLuint *out) {
    static const char *const samplers[] = {"shadow_map", "cloud_map", "image_a", "image_b",
                                           "depth_map"};
    GLuint vs = 0, fs = 0;
    JSL_TRY(compile(gl, logger, name, GL_VERTEX_SHADER, prefix, vertex, &vs));
    jsl_result result = compile(gl, logger, name, GL_FRAGMENT_SHADER, prefix, fragment, &fs);
    if (result != JSL_OK) {
        gl->DeleteShader(vs);
        return result;
    }
    GLuint program = gl->CreateProgram();
    gl->AttachShader(program, vs);
    gl->AttachShader(program, fs);
    gl->LinkProgram(program);
    gl->DeleteShader(vs);
    gl->DeleteShader(fs);
    GLint good = 0;
    gl->GetProgramiv(program, GL_LINK_STATUS, &good);
    if (!good) {
        char text[300] = "";
        gl->GetProgramInfoLog(program, sizeof text, NULL, text);
        gl->DeleteProgram(program);
        return jsl_fail(logger, JSL_ERR_UNSUPPORTED, "program '%s': %s", name, text);
    }
    GLuint block = gl->GetUniformBlockIndex(program, "Frame");
    if (block != GL_INVALID_INDEX) gl->UniformBlockBinding(program, block, 0);
    gl->UseProgram(program);
    for (int i = 0; i < JSL_COUNT(samplers); i++) {
        GLint place = gl->GetUniformLocation(program, samplers[i]);
        if (place >= 0) gl->Uniform1i(place, i);
    }
    *out = program;
    return JSL_OK;
}

GLuint jsl_gl_texture(const jsl_gl *gl, GLint format, int width, int height, GLenum layout,
                      GLenum type, GLint filter, const void *data) {
    GLuint texture = 0;
    gl->GenTextures(1, &texture);
    gl->BindTexture(GL_TEXTURE_2D, texture);
    gl->TexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, layout, type, data);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}
