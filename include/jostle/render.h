/* SPDX-License-Identifier: MIT
 * jostle/render.h - pictures of frames, without a display (libjostle-render: OSMesa, libpng).
 * Floor 6.
 */
#ifndef JOSTLE_RENDER_H
#define JOSTLE_RENDER_H

#include <jostle/frame.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct jsl_renderer jsl_renderer;

typedef struct jsl_render_desc {
    int width, height; /* pixels, 16..8192; 0: 1280 x 720 */
    int samples;       /* per pixel; 0: 4 */
    bool no_ground;    /* without the metre grid on z = 0 */
    bool no_text;      /* without time and counts in the corner */
    bool no_shadows;
    jsl_logger logger;
    jsl_allocator
        allocator; /* of the renderer's own memory; OpenGL and libpng use the C library's */
} jsl_render_desc;

/* JSL_ERR_UNSUPPORTED when no off-screen context can be made or it lacks the samples asked for;
 * JSL_ERR_ARGUMENT for sizes and samples (1..16) out of range. Any number of renderers in any
 * threads, each used by one thread at a time. */
JSL_API jsl_result jsl_renderer_create(const jsl_render_desc *desc, jsl_renderer **out);
JSL_API void jsl_renderer_destroy(jsl_renderer *renderer);
/* Draws the frame. Elements that cannot be drawn (positions that are not finite or beyond 1e9 m,
 * zero quaternions, shape indices out of range, lengths that are not positive) are left out, whole
 * kinds when a position array is null. A colour of 0x00000000 means none was chosen: bodies get one
 * of a few by their index. Without a level plane among the bodies a metre grid is drawn on z = 0,
 * or on the next power of two metres below when much is under it. Additive particles are drawn at
 * night. *pixels then points at height rows of width RGB triples, top row first, owned by the
 * renderer and valid until its next call. */
JSL_API jsl_result jsl_renderer_draw(jsl_renderer *renderer, const jsl_frame *frame,
                                     const uint8_t **pixels);
JSL_API int jsl_renderer_width(const jsl_renderer *renderer);
JSL_API int jsl_renderer_height(const jsl_renderer *renderer);

/* Writes RGB rows as PNG. JSL_ERR_IO names the path in the log; no partial file is left. */
JSL_API jsl_result jsl_image_write_png(const char *path, const uint8_t *rgb, int width, int height,
                                       const jsl_logger *logger);

/* A contact sheet: pictures of one size, shrunk by a whole factor (box filter), in rows of columns
 * with a gap of JSL_SHEET_GAP pixels around each. The caller owns the pixels, so that pictures can
 * be put in as they are drawn, in any order. */
#define JSL_SHEET_GAP 4
typedef struct jsl_image_sheet {
    int count, columns; /* of pictures, >= 1; fewer pictures than columns make a narrower sheet */
    int width, height;  /* of a picture, pixels */
    int scale_down;     /* 1..64; 0: 4 */
} jsl_image_sheet;
/* JSL_ERR_ARGUMENT when a number is out of range or the sheet would have a side above 65535 pixels.
 */
JSL_API jsl_result jsl_image_sheet_size(const jsl_image_sheet *sheet, int *width, int *height);
/* Shrinks the picture into cell index of out, which holds height rows of width RGB triples as told
 * by jsl_image_sheet_size and was cleared to the colour of the gaps by the caller. */
JSL_API jsl_result jsl_image_sheet_put(const jsl_image_sheet *sheet, int index, const uint8_t *rgb,
                                       uint8_t *out);

#ifdef __cplusplus
}
#endif
#endif
