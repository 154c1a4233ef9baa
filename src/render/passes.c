/* SPDX-License-Identifier: MIT
 * passes.c - the draw calls.
 */
#include "render/renderer.h"

static void upload(const jsl_gl *gl, GLuint buffer, const void *data, int64_t bytes) {
    gl->BindBuffer(GL_ARRAY_BUFFER, buffer);
    gl->BufferData(GL_ARRAY_BUFFER, bytes > 0 ? bytes : 4, bytes > 0 ? data : NULL, GL_STREAM_DRAW);
}

void jsl_pass_upload(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    const jsl_buffers *b = &r->buffers;
    gl->BindBuffer(GL_UNIFORM_BUFFER, b->block);
    gl->BufferData(GL_UNIFORM_BUFFER, sizeof r->block, &r->block, GL_STREAM_DRAW);
    gl->BindBufferBase(GL_UNIFORM_BUFFER, 0, b->block);
    upload(gl, b->body_instances, r->bodies.at, r->bodies.count * (int64_t)sizeof *r->bodies.at);
    upload(gl, b->bird_instances, r->birds.at, r->birds.count * (int64_t)sizeof *r->birds.at);
    upload(gl, b->sprite_vertices, r->sprite_vertices.at,
           r->sprite_vertices.count * (int64_t)sizeof *r->sprite_vertices.at);
    gl->ActiveTexture(GL_TEXTURE0 + JSL_UNIT_CLOUD);
    gl->BindTexture(GL_TEXTURE_2D, b->cloud);
    if (r->block.grid[2] > 0)
        gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, JSL_CLOUD_SIDE, JSL_CLOUD_SIDE, GL_RED, GL_FLOAT,
                          r->cloud);
}

static void draw_runs(const jsl_renderer *r, int64_t first, int64_t last, bool shadow) {
    const jsl_gl *gl = &r->gl;
    gl->BindVertexArray(r->buffers.solid_array);
    for (int64_t i = first; i < last; i++) {
        const jsl_body_run *run = &r->runs.at[i];
        const jsl_mesh_range *mesh = &r->mesh[run->mesh];
        jsl_program program = run->mesh == JSL_MESH_BOX ? JSL_PROGRAM_BOX : JSL_PROGRAM_ROUND;
        gl->UseProgram(r->program[shadow ? JSL_PROGRAM_BODY_SHADOW : program]);
        const void *start = (const void *)((size_t)mesh->first_index * sizeof(uint16_t));
        gl->DrawElementsInstancedBaseVertexBaseInstance(GL_TRIANGLES, mesh->index_count,
                                                        GL_UNSIGNED_SHORT, start, run->count,
                                                        mesh->first_vertex, (GLuint)run->first);
    }
}

static void draw_birds(const jsl_renderer *r, jsl_program program) {
    const jsl_gl *gl = &r->gl;
    if (r->birds.count == 0) return;
    gl->UseProgram(r->program[program]);
    gl->BindVertexArray(r->buffers.bird_array);
    gl->DrawElementsInstancedBaseVertexBaseInstance(
        GL_TRIANGLES, jsl_bird_index_count, GL_UNSIGNED_SHORT, NULL, (GLsizei)r->birds.count, 0, 0);
}

/* Everything over the whole picture. */
static void draw_screen(const jsl_renderer *r, jsl_program program) {
    const jsl_gl *gl = &r->gl;
    gl->UseProgram(r->program[program]);
    gl->BindVertexArray(r->buffers.screen_array);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
}

void jsl_pass_shadow(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    const float far = 1;
    gl->BindFramebuffer(GL_FRAMEBUFFER, r->targets.shadow);
    gl->Viewport(0, 0, r->targets.shadow_side, r->targets.shadow_side);
    gl->DepthMask(GL_TRUE);
    gl->ClearBufferfv(GL_DEPTH, 0, &far);
    if (!r->desc.no_shadows && r->bodies.count + r->birds.count > 0) {
        gl->Enable(GL_DEPTH_TEST);
        gl->Enable(GL_DEPTH_CLAMP);
        gl->DepthFunc(GL_LESS);
        gl->Enable(GL_POLYGON_OFFSET_FILL);
        gl->PolygonOffset(1.5f, 2);
        gl->Enable(GL_CULL_FACE);
        draw_runs(r, 0, r->runs.count, true);
        gl->Disable(GL_CULL_FACE);
        draw_birds(r, JSL_PROGRAM_BIRD_SHADOW);
        gl->Disable(GL_POLYGON_OFFSET_FILL);
        gl->Disable(GL_DEPTH_CLAMP);
    }
    gl->ActiveTexture(GL_TEXTURE0 + JSL_UNIT_SHADOW);
    gl->BindTexture(GL_TEXTURE_2D, r->targets.shadow_depth);
}

static void draw_patch(const jsl_renderer *r, const jsl_plane_patch *patch, jsl_program program,
                       int first, int count) {
    const jsl_gl *gl = &r->gl;
    gl->UseProgram(r->program[program]);
    gl->Uniform4fv(gl->GetUniformLocation(r->program[program], "plane"), 5, &patch->plane[0][0]);
    const void *start = (const void *)((size_t)first * sizeof(uint16_t));
    gl->DrawElements(GL_TRIANGLES, count, GL_UNSIGNED_SHORT, start);
}

static void draw_patches(const jsl_renderer *r, bool level) {
    const jsl_gl *gl = &r->gl;
    gl->BindVertexArray(r->buffers.plane_array);
    for (int64_t i = 0; i < r->patches.count; i++) {
        const jsl_plane_patch *patch = &r->patches.at[i];
        if (patch->level != level) continue;
        float vertex[16][2];
        for (int k = 0; k < 16; k++)
            vertex[k][0] = patch->cut[0][k % 4], vertex[k][1] = patch->cut[1][k / 4];
        upload(gl, r->buffers.plane_vertices, vertex, sizeof vertex);
        if (!level) {
            draw_patch(r, patch, JSL_PROGRAM_PATCH, 0, JSL_PATCH_INDICES);
            continue;
        }
        if (patch->cut[0][1] < patch->cut[0][2])
            draw_patch(r, patch, JSL_PROGRAM_GROUND, 0, JSL_PATCH_MIDDLE);
        draw_patch(r, patch, JSL_PROGRAM_GROUND_SUNNY, JSL_PATCH_MIDDLE,
                   JSL_PATCH_INDICES - JSL_PATCH_MIDDLE);
    }
}

/* Solid things first, so that ground and sky are worked out only where they show. */
void jsl_pass_solid(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    const float far = 0;
    gl->BindFramebuffer(GL_FRAMEBUFFER, r->targets.many);
    gl->Viewport(0, 0, r->desc.width, r->desc.height);
    gl->DepthMask(GL_TRUE);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthFunc(GL_GREATER);
    gl->Disable(GL_BLEND);
    gl->ClearBufferfv(GL_DEPTH, 0, &far);
    gl->Enable(GL_CULL_FACE);
    draw_runs(r, 0, r->clear_runs, false);
    gl->Disable(GL_CULL_FACE);
    draw_birds(r, JSL_PROGRAM_BIRD);
    draw_patches(r, true);
    gl->DepthFunc(GL_GEQUAL);
    draw_screen(r, JSL_PROGRAM_SKY);

    gl->DepthFunc(GL_GREATER);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    draw_patches(r, false);
    gl->DepthMask(GL_FALSE);
    gl->Enable(GL_CULL_FACE);
    draw_runs(r, r->clear_runs, r->runs.count, false);
    gl->Disable(GL_CULL_FACE);
    gl->Disable(GL_BLEND);
}

void jsl_pass_resolve(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    int w = r->desc.width, h = r->desc.height;
    GLbitfield what = GL_COLOR_BUFFER_BIT | (r->sprites.count > 0 ? GL_DEPTH_BUFFER_BIT : 0u);
    gl->BindFramebuffer(GL_READ_FRAMEBUFFER, r->targets.many);
    gl->BindFramebuffer(GL_DRAW_FRAMEBUFFER, r->targets.one);
    gl->BlitFramebuffer(0, 0, w, h, 0, 0, w, h, what, GL_NEAREST);
}

void jsl_pass_sprites(jsl_renderer *r, bool additive) {
    const jsl_gl *gl = &r->gl;
    if (r->sprites.count == 0) return;
    gl->BindFramebuffer(GL_FRAMEBUFFER, additive ? r->targets.light : r->targets.one);
    gl->Viewport(0, 0, r->desc.width, r->desc.height);
    if (additive) {
        static const float dark[4] = {0, 0, 0, 0};
        gl->ClearBufferfv(GL_COLOR, 0, dark);
    }
    gl->DepthMask(GL_FALSE);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthFunc(GL_GREATER);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_SRC_ALPHA, additive ? GL_ONE : GL_ONE_MINUS_SRC_ALPHA);
    gl->UseProgram(r->program[additive ? JSL_PROGRAM_SPARK : JSL_PROGRAM_SPRITE]);
    gl->BindVertexArray(r->buffers.sprite_array);
    gl->DrawArrays(GL_TRIANGLES, 0, (GLsizei)r->sprite_vertices.count);
    gl->Disable(GL_BLEND);
}

static void blur(const jsl_renderer *r, GLuint from, int to, float dx, float dy) {
    const jsl_gl *gl = &r->gl;
    const jsl_targets *t = &r->targets;
    gl->BindFramebuffer(GL_FRAMEBUFFER, t->halo[to]);
    gl->ActiveTexture(GL_TEXTURE0 + JSL_UNIT_A);
    gl->BindTexture(GL_TEXTURE_2D, from);
    const float stride[4] = {dx / (float)t->halo_width, dy / (float)t->halo_height, 0, 0};
    gl->UseProgram(r->program[JSL_PROGRAM_BLUR]);
    gl->Uniform4fv(gl->GetUniformLocation(r->program[JSL_PROGRAM_BLUR], "stride"), 1, stride);
    draw_screen(r, JSL_PROGRAM_BLUR);
}

void jsl_pass_glow(jsl_renderer *r) {
    const jsl_gl *gl = &r->gl;
    const jsl_targets *t = &r->targets;
    if (r->sprites.count == 0) return;
    gl->Disable(GL_DEPTH_TEST);
    gl->Disable(GL_BLEND);
    gl->Viewport(0, 0, t->halo_width, t->halo_height);
    blur(r, t->light_color, 0, 0.4f, 0);
    blur(r, t->halo_color[0], 1, 0, 1);
    blur(r, t->halo_color[1], 0, 2, 0);
    blur(r, t->halo_color[0], 1, 0, 2);
    gl->BindFramebuffer(GL_FRAMEBUFFER, t->one);
    gl->Viewport(0, 0, r->desc.width, r->desc.height);
    gl->ActiveTexture(GL_TEXTURE0 + JSL_UNIT_A);
    gl->BindTexture(GL_TEXTURE_2D, t->light_color);
    gl->ActiveTexture(GL_TEXTURE0 + JSL_UNIT_B);
    gl->BindTexture(GL_TEXTURE_2D, t->halo_color[1]);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_COLOR);
    draw_screen(r, JSL_PROGRAM_GLOW);
    gl->Disable(GL_BLEND);
}
