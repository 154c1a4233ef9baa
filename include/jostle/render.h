/* SPDX-License-Identifier: MIT
 * jostle/render.h - pictures of frames, without a display (libjostle-render: OSMesa, libpng). Floor 6.
 */
#ifndef JOSTLE_RENDER_H
#define JOSTLE_RENDER_H

#include <jostle/frame.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct jsl_renderer jsl_renderer;

typedef struct jsl_render_desc {
    int width, height;    /* pixels, 16..8192; 0: 1280 x 720 */
    int samples;          /* per pixel; 0: 4 */
    bool no_ground;       /* without the metre grid on z = 0 */
    bool no_text;         /* without time and counts in the corner */
    bool no_shadows;
    jsl_logger logger;
} jsl_render_desc;

/* JSL_ERR_UNSUPPORTED when no off-screen context can be made. One renderer per thread. */
JSL_API jsl_result jsl_renderer_create(const jsl_render_desc *desc, jsl_renderer **out);
JSL_API void jsl_renderer_destroy(jsl_renderer *renderer);
/* Draws the frame; *pixels then points at height rows of width RGB triples, top row first, owned by the renderer and valid until
 * its next call. */
JSL_API jsl_result jsl_renderer_draw(jsl_renderer *renderer, const jsl_frame *frame, const uint8_t **pixels);
JSL_API int jsl_renderer_width(const jsl_renderer *renderer);
JSL_API int jsl_renderer_height(const jsl_renderer *renderer);

/* Writes RGB rows as PNG. JSL_ERR_IO names the path in the log; no partial file is left. */
JSL_API jsl_result jsl_image_write_png(const char *path, const uint8_t *rgb, int width, int height, const jsl_logger *logger);

#ifdef __cplusplus
}
#endif
#endif
