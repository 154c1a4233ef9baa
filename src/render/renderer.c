/* SPDX-License-Identifier: MIT
 * renderer.c - makes a renderer, and tells the story of one picture.
 */
#include "render/renderer.h"

#include <stddef.h>

#define SIDE_MIN 16
#define SIDE_MAX 8192

/* -- Creation ------------------------------------------------------------------------------------
 */

static jsl_result make_programs(jsl_renderer *r) {
    static const struct {
        const char *name, *define, *vertex, *fragment;
    } source[JSL_PROGRAM_COUNT] = {
        [JSL_PROGRAM_BOX] = {"box", "#define BOX true\n", jsl_shader_body_vs, jsl_shader_body_fs},
        [JSL_PROGRAM_ROUND] = {"round", "#define BOX false\n", jsl_shader_body_vs,
                               jsl_shader_body_fs},
        [JSL_PROGRAM_BODY_SHADOW] = {"shadow of bodies", "#define camera shadow_clip\n",
                                     jsl_shader_body_vs, jsl_shader_none_fs},
        [JSL_PROGRAM_BIRD] = {"bird", "", jsl_shader_bird_vs, jsl_shader_bird_fs},
        [JSL_PROGRAM_BIRD_SHADOW] = {"shadow of birds", "#define camera shadow_clip\n",
                                     jsl_shader_bird_vs, jsl_shader_none_fs},
        [JSL_PROGRAM_GROUND] = {"ground", "#define LEVEL true\n#define SHADED true\n",
                                jsl_shader_plane_vs, jsl_shader_plane_fs},
        [JSL_PROGRAM_GROUND_SUNNY] = {"sunny ground", "#define LEVEL true\n#define SHADED false\n",
                                      jsl_shader_plane_vs, jsl_shader_plane_fs},
        [JSL_PROGRAM_PATCH] = {"slope", "#define LEVEL false\n#define SHADED true\n",
                               jsl_shader_plane_vs, jsl_shader_plane_fs},
        [JSL_PROGRAM_SKY] = {"sky", "", jsl_shader_screen_vs, jsl_shader_sky_fs},
        [JSL_PROGRAM_SPRITE] = {"sprite", "#define ADD false\n", jsl_shader_sprite_vs,
                                jsl_shader_sprite_fs},
        [JSL_PROGRAM_SPARK] = {"spark", "#define ADD true\n", jsl_shader_sprite_vs,
                               jsl_shader_sprite_fs},
        [JSL_PROGRAM_BLUR] = {"blur", "", jsl_shader_screen_vs, jsl_shader_blur_fs},
        [JSL_PROGRAM_GLOW] = {"glow", "", jsl_shader_screen_vs, jsl_shader_glow_fs},
    };
    for (int i = 0; i < JSL_PROGRAM_COUNT; i++)
        JSL_TRY(jsl_gl_program(&r->gl, &r->logger, source[i].name, source[i].define,
                               source[i].vertex, source[i].fragment, &r->program[i]));
    return JSL_OK;
}

static void attribute(const jsl_gl *gl, GLuint place, int count, GLenum type, size_t stride,
                      size_t offset, bool instanced) {
    gl->EnableVertexAttribArray(place);
    gl->VertexAttribPointer(place, count, type, type != GL_FLOAT, (GLsizei)stride,
                            (const void *)offset);
    gl->VertexAttribDivisor(place, instanced);
}

static void fill(const jsl_gl *gl, GLenum kind, GLuint buffer, const void *data, size_t bytes) {
    gl->BindBuffer(kind, buffer);
    gl->BufferData(kind, (GLsizeiptr)bytes, data, GL_STATIC_DRAW);
}

static jsl_result make_solids(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    const jsl_buffers *b = &r->buffers;
    size_t vertex_size = JSL_SOLID_VERTICES_MAX * sizeof(jsl_solid_vertex);
    size_t index_size = JSL_SOLID_INDICES_MAX * sizeof(uint16_t);
    jsl_solid_vertex *vertex = jsl_alloc(&r->memory, vertex_size);
    uint16_t *index = jsl_alloc(&r->memory, index_size);
    int vertices = 0, indices = 0;
    if (vertex && index) {
        jsl_mesh_solids(vertex, &vertices, index, &indices, r->mesh);
        gl->BindVertexArray(b->solid_array);
        fill(gl, GL_ARRAY_BUFFER, b->solid_vertices, vertex, (size_t)vertices * sizeof *vertex);
        fill(gl, GL_ELEMENT_ARRAY_BUFFER, b->solid_indices, index, (size_t)indices * sizeof *index);
    }
    jsl_free(&r->memory, vertex, vertex_size);
    jsl_free(&r->memory, index, index_size);
    if (!vertices) return jsl_fail(&r->logger, JSL_ERR_MEMORY, "no memory for meshes");
    size_t stride = sizeof(jsl_solid_vertex);
    attribute(gl, 0, 3, GL_FLOAT, stride, offsetof(jsl_solid_vertex, point), false);
    attribute(gl, 1, 3, GL_FLOAT, stride, offsetof(jsl_solid_vertex, direction), false);
    gl->BindBuffer(GL_ARRAY_BUFFER, b->body_instances);
    stride = sizeof(jsl_body_instance);
    attribute(gl, 2, 3, GL_FLOAT, stride, offsetof(jsl_body_instance, centre), true);
    attribute(gl, 3, 4, GL_FLOAT, stride, offsetof(jsl_body_instance, turn), true);
    attribute(gl, 4, 4, GL_FLOAT, stride, offsetof(jsl_body_instance, size), true);
    attribute(gl, 5, 4, GL_UNSIGNED_BYTE, stride, offsetof(jsl_body_instance, rgba), true);
    return JSL_OK;
}

static void make_birds(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    const jsl_buffers *b = &r->buffers;
    gl->BindVertexArray(b->bird_array);
    fill(gl, GL_ARRAY_BUFFER, b->bird_vertices, jsl_bird_vertices,
         (size_t)jsl_bird_vertex_count * sizeof *jsl_bird_vertices);
    fill(gl, GL_ELEMENT_ARRAY_BUFFER, b->bird_indices, jsl_bird_indices,
         (size_t)jsl_bird_index_count * sizeof *jsl_bird_indices);
    size_t stride = sizeof(jsl_bird_vertex);
    attribute(gl, 0, 3, GL_FLOAT, stride, offsetof(jsl_bird_vertex, point), false);
    attribute(gl, 1, 2, GL_FLOAT, stride, offsetof(jsl_bird_vertex, beat), false);
    gl->BindBuffer(GL_ARRAY_BUFFER, b->bird_instances);
    stride = sizeof(jsl_bird_instance);
    attribute(gl, 2, 4, GL_FLOAT, stride, offsetof(jsl_bird_instance, centre), true);
    attribute(gl, 3, 4, GL_FLOAT, stride, offsetof(jsl_bird_instance, ahead), true);
    attribute(gl, 4, 4, GL_FLOAT, stride, offsetof(jsl_bird_instance, above), true);
    attribute(gl, 5, 4, GL_UNSIGNED_BYTE, stride, offsetof(jsl_bird_instance, rgba), true);
}

static void make_flat(jsl_renderer *r) {
    static const uint16_t index[JSL_PATCH_INDICES] = {
        5, 6, 10, 5, 10, 9,  0, 1,  5,  0, 5,  4,  1,  2,  6,  1,  6,  5,
        2, 3, 7,  2, 7,  6,  4, 5,  9,  4, 9,  8,  6,  7,  11, 6,  11, 10,
        8, 9, 13, 8, 13, 12, 9, 10, 14, 9, 14, 13, 10, 11, 15, 10, 15, 14};
    const jsl_gl *gl = &r->gl;
    jsl_buffers *b = &r->buffers;
    gl->BindVertexArray(b->plane_array);
    fill(gl, GL_ELEMENT_ARRAY_BUFFER, b->plane_indices, index, sizeof index);
    gl->BindBuffer(GL_ARRAY_BUFFER, b->plane_vertices);
    attribute(gl, 0, 2, GL_FLOAT, 2 * sizeof(float), 0, false);

    gl->BindVertexArray(b->sprite_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, b->sprite_vertices);
    size_t stride = sizeof(jsl_sprite_vertex);
    attribute(gl, 0, 4, GL_FLOAT, stride, offsetof(jsl_sprite_vertex, clip), false);
    attribute(gl, 1, 3, GL_BYTE, stride, offsetof(jsl_sprite_vertex, corner), false);
    attribute(gl, 2, 4, GL_UNSIGNED_BYTE, stride, offsetof(jsl_sprite_vertex, rgba), false);
    gl->BindVertexArray(0);
    b->cloud = jsl_gl_texture(gl, GL_R32F, JSL_CLOUD_SIDE, JSL_CLOUD_SIDE, GL_RED, GL_FLOAT,
                              GL_LINEAR, r->cloud);
}

static jsl_result make_objects(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    jsl_buffers *b = &r->buffers;
    GLuint *const buffers[] = {&b->solid_vertices, &b->solid_indices, &b->body_instances,
                               &b->bird_vertices,  &b->bird_indices,  &b->bird_instances,
                               &b->plane_vertices, &b->plane_indices, &b->sprite_vertices,
                               &b->block};
    GLuint *const arrays[] = {&b->solid_array, &b->bird_array, &b->plane_array, &b->sprite_array,
                              &b->screen_array};
    for (int i = 0; i < JSL_COUNT(buffers); i++) gl->GenBuffers(1, buffers[i]);
    for (int i = 0; i < JSL_COUNT(arrays); i++) gl->GenVertexArrays(1, arrays[i]);
    JSL_TRY(make_programs(r));
    JSL_TRY(make_solids(r));
    make_birds(r);
    make_flat(r);
    /* Depth runs from 1 near to 0 far: with floats that is precise at every distance (Lapidous,
     * Jiao 1999). */
    gl->ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl->PixelStorei(GL_PACK_ALIGNMENT, 4);
    gl->CullFace(GL_BACK);
    return jsl_targets_create(r);
}

static size_t pixel_count(const jsl_renderer *r) {
    return (size_t)r->desc.width * (size_t)r->desc.height;
}

static jsl_result build(jsl_renderer *r) {
    r->rgba = jsl_alloc(&r->memory, 4 * pixel_count(r));
    r->rgb = jsl_alloc(&r->memory, 3 * pixel_count(r));
    r->cloud = jsl_alloc_zero(&r->memory, 2 * JSL_CLOUD_SIDE * JSL_CLOUD_SIDE * sizeof(float));
    if (!r->rgba || !r->rgb || !r->cloud)
        return jsl_fail(&r->logger, JSL_ERR_MEMORY, "no memory for a picture of %d x %d",
                        r->desc.width, r->desc.height);
    JSL_TRY(jsl_ctx_create(&r->memory, &r->logger, &r->ctx));
    if (!jsl_ctx_acquire(r->ctx))
        return jsl_fail(&r->logger, JSL_ERR_UNSUPPORTED, "the off-screen context cannot be used");
    JSL_TRY(jsl_gl_load(&r->gl, &r->logger));
    return make_objects(r);
}

jsl_result jsl_renderer_create(const jsl_render_desc *desc, jsl_renderer **out) {
    jsl_render_desc d = desc ? *desc : (jsl_render_desc){0};
    if (!out) return jsl_fail(&d.logger, JSL_ERR_ARGUMENT, "renderer: out is null");
    if (d.width == 0 && d.height == 0) d.width = 1280, d.height = 720;
    if (d.samples == 0) d.samples = 4;
    if (d.width < SIDE_MIN || d.width > SIDE_MAX || d.height < SIDE_MIN || d.height > SIDE_MAX)
        return jsl_fail(&d.logger, JSL_ERR_ARGUMENT, "picture of %d x %d: sides are %d..%d pixels",
                        d.width, d.height, SIDE_MIN, SIDE_MAX);
    if (d.samples < 1 || d.samples > 16)
        return jsl_fail(&d.logger, JSL_ERR_ARGUMENT, "%d samples per pixel: 1..16", d.samples);
    jsl_memory memory;
    jsl_result result = jsl_memory_init(&memory, d.allocator);
    if (result != JSL_OK)
        return jsl_fail(&d.logger, result, "renderer: the allocator lacks one of its functions");
    jsl_renderer *r = jsl_alloc_zero(&memory, sizeof *r);
    if (!r) return jsl_fail(&d.logger, JSL_ERR_MEMORY, "no memory for a renderer");
    r->memory = memory;
    r->logger = d.logger;
    r->desc = d;
    result = build(r);
    if (r->ctx) jsl_ctx_release(r->ctx);
    if (result != JSL_OK) {
        jsl_renderer_destroy(r);
        return result;
    }
    *out = r;
    return JSL_OK;
}

static void destroy_objects(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    jsl_buffers *b = &r->buffers;
    const GLuint buffers[] = {b->solid_vertices, b->solid_indices, b->body_instances,
                              b->bird_vertices,  b->bird_indices,  b->bird_instances,
                              b->plane_vertices, b->plane_indices, b->sprite_vertices,
                              b->block};
    const GLuint arrays[] = {b->solid_array, b->bird_array, b->plane_array, b->sprite_array,
                             b->screen_array};
    gl->DeleteBuffers(JSL_COUNT(buffers), buffers);
    gl->DeleteVertexArrays(JSL_COUNT(arrays), arrays);
    gl->DeleteTextures(1, &b->cloud);
    for (int i = 0; i < JSL_PROGRAM_COUNT; i++) gl->DeleteProgram(r->program[i]);
    jsl_targets_destroy(r);
}

void jsl_renderer_destroy(jsl_renderer *r) {
    if (!r) return;
    if (r->ctx) {
        /* The last function of the table is there only if all are. */
        if (jsl_ctx_acquire(r->ctx) && r->gl.Viewport) destroy_objects(r);
        jsl_ctx_release(r->ctx);
        jsl_ctx_destroy(&r->memory, r->ctx);
    }
    jsl_memory *m = &r->memory;
    jsl_array_free(m, &r->bodies);
    jsl_array_free(m, &r->runs);
    jsl_array_free(m, &r->birds);
    jsl_array_free(m, &r->patches);
    jsl_array_free(m, &r->sprites);
    jsl_array_free(m, &r->sprite_vertices);
    jsl_array_free(m, &r->keys);
    jsl_array_free(m, &r->order);
    jsl_array_free(m, &r->tmp_keys);
    jsl_array_free(m, &r->tmp_order);
    jsl_free(m, r->rgba, 4 * pixel_count(r));
    jsl_free(m, r->rgb, 3 * pixel_count(r));
    jsl_free(m, r->cloud, 2 * JSL_CLOUD_SIDE * JSL_CLOUD_SIDE * sizeof(float));
    jsl_memory memory = r->memory;
    jsl_free(&memory, r, sizeof *r);
}

int jsl_renderer_width(const jsl_renderer *r) { return r ? r->desc.width : 0; }
int jsl_renderer_height(const jsl_renderer *r) { return r ? r->desc.height : 0; }

/* -- One picture
 * ------------------------------------------------------------------------------------ */

static void set4(float out[4], jsl_f3 v, float w) {
    out[0] = v.x, out[1] = v.y, out[2] = v.z, out[3] = w;
}

/* The hour: sunlight by day; moonlight when particles glow, for light shows only in the dark. */
static void make_light(jsl_renderer *r, bool night) {
    jsl_frame_block *b = &r->block;
    float shadows = r->desc.no_shadows ? 0 : 1;
    if (night) {
        set4(b->sunlight, jsl_f3_make(0.26f, 0.33f, 0.48f), shadows);
        set4(b->zenith, jsl_f3_make(0.007f, 0.011f, 0.028f), 0);
        set4(b->horizon, jsl_f3_make(0.040f, 0.055f, 0.100f), 0);
        set4(b->bounce, jsl_f3_make(0.020f, 0.023f, 0.032f), 0);
    } else {
        set4(b->sunlight, jsl_f3_make(1.75f, 1.58f, 1.30f), shadows);
        set4(b->zenith, jsl_f3_make(0.07f, 0.23f, 0.56f), 0);
        set4(b->horizon, jsl_f3_make(0.56f, 0.72f, 0.88f), 0);
        set4(b->bounce, jsl_f3_make(0.24f, 0.225f, 0.20f), 0);
    }
}

/* The cell is a metre, unless the camera is so near or so far that metres say nothing. */
static float grid_cell(float distance) {
    float cell = 1;
    while (distance > 250 * cell && cell < 1e6f) cell *= 10;
    while (distance < 1.2f * cell && cell > 1e-3f) cell /= 10;
    return cell;
}

static void make_block(jsl_renderer *r, const jsl_frame *frame) {
    jsl_frame_block *b = &r->block;
    const jsl_view *v = &r->view;
    *b = (jsl_frame_block){0};
    make_light(r, frame->additive);
    float cell = grid_cell(v->distance), major = 10 * cell;
    memcpy(b->camera, v->camera, sizeof b->camera);
    memcpy(b->shadow, r->sun.texture, sizeof b->shadow);
    memcpy(b->shadow_clip, r->sun.clip, sizeof b->shadow_clip);
    set4(b->right, jsl_f3_scale(v->right, v->tan_x), 0);
    set4(b->up, jsl_f3_scale(v->up, v->tan_y), 0);
    set4(b->forward, v->forward, 0);
    set4(b->sun, r->sun.to_sun, r->sun.texel);
    float height = fabsf(v->eye.z - r->span.ground);
    set4(b->eye,
         jsl_f3_make(fmodf(v->eye.x, major), fmodf(v->eye.y, major), fmodf(v->eye.z, major)),
         1 / fmaxf(fmaxf(7 * v->distance, 12 * height), 10));
    b->screen[0] = (float)r->desc.width;
    b->screen[1] = (float)r->desc.height;
    b->screen[2] = v->pixel;
    b->screen[3] = frame->additive ? 1 : 0;
    b->grid[0] = cell;
    b->grid[1] = 0.75f;
}

/* Triples, top row first, from OpenGL's bottom-first quadruples. */
static void read_back(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    int w = r->desc.width, h = r->desc.height;
    gl->BindFramebuffer(GL_READ_FRAMEBUFFER, r->targets.one);
    gl->ReadPixels(0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, r->rgba);
    for (int y = 0; y < h; y++) {
        const uint8_t *from = r->rgba + (size_t)4 * (size_t)w * (size_t)(h - 1 - y);
        uint8_t *to = r->rgb + (size_t)3 * (size_t)w * (size_t)y;
        for (int x = 0; x < w; x++, from += 4, to += 3)
            to[0] = from[0], to[1] = from[1], to[2] = from[2];
    }
}

static jsl_result draw(jsl_renderer *r, const jsl_frame *frame) {
    jsl_span_make(frame, &r->span);
    jsl_view_make(frame, &r->span, r->desc.width, r->desc.height, &r->view);
    jsl_f3 to_sun = jsl_f3_unit(jsl_f3_make(-0.55f, -0.50f, 0.82f));
    jsl_sunview_make(&r->view, &r->span, to_sun, r->targets.shadow_side, &r->sun);
    make_block(r, frame);
    jsl_cloud_make(r, frame);
    JSL_TRY(jsl_list_bodies(r, frame));
    JSL_TRY(jsl_list_birds(r, frame));
    JSL_TRY(jsl_list_sprites(r, frame));
    jsl_pass_upload(r);
    jsl_pass_shadow(r);
    jsl_pass_solid(r);
    jsl_pass_resolve(r);
    jsl_pass_sprites(r, frame->additive);
    if (frame->additive) jsl_pass_glow(r);
    read_back(r);
    GLenum error = r->gl.GetError();
    if (error == GL_NO_ERROR) return JSL_OK;
    return jsl_fail(&r->logger, error == GL_OUT_OF_MEMORY ? JSL_ERR_MEMORY : JSL_ERR_UNSUPPORTED,
                    "OpenGL failed with error 0x%x at step %lld", (unsigned)error,
                    (long long)frame->step);
}

jsl_result jsl_renderer_draw(jsl_renderer *r, const jsl_frame *frame, const uint8_t **pixels) {
    if (!r) return JSL_ERR_HANDLE;
    if (!frame || !pixels)
        return jsl_fail(&r->logger, JSL_ERR_ARGUMENT, "draw: frame or pixels is null");
    /* OpenGL counts in int; a particle has three corners. */
    int64_t most =
        frame->bodies.count > frame->boids.count ? frame->bodies.count : frame->boids.count;
    if (most > INT32_MAX / 6 || frame->particles.count > INT32_MAX / 6)
        return jsl_fail(&r->logger, JSL_ERR_LIMIT, "draw: more than %d elements of a kind",
                        INT32_MAX / 6);
    if (!jsl_ctx_acquire(r->ctx))
        return jsl_fail(&r->logger, JSL_ERR_UNSUPPORTED, "the off-screen context cannot be used");
    jsl_result result = draw(r, frame);
    jsl_ctx_release(r->ctx);
    if (result == JSL_ERR_MEMORY)
        jsl_fail(&r->logger, result, "no memory to draw step %lld", (long long)frame->step);
    if (result != JSL_OK) return result;
    if (!r->desc.no_text) jsl_text_overlay(r, frame);
    *pixels = r->rgb;
    return JSL_OK;
}
