/* SPDX-License-Identifier: MIT
 * sheet.c - many pictures on one.
 */
#include "base/base.h"
#include "jostle/render.h"

#define SIDE_MAX 65535
#define SCALE_MAX 64

typedef struct layout {
    int scale, columns, rows, cell_width, cell_height;
} layout;

static bool arrange(const jsl_image_sheet *s, layout *l) {
    if (!s || s->count < 1 || s->columns < 1 || s->width < 1 || s->height < 1 ||
        s->width > SIDE_MAX || s->height > SIDE_MAX || s->scale_down < 0 ||
        s->scale_down > SCALE_MAX)
        return false;
    l->scale = s->scale_down ? s->scale_down : 4;
    l->columns = s->columns < s->count ? s->columns : s->count;
    l->rows = (s->count - 1) / l->columns + 1;
    l->cell_width = s->width / l->scale;
    l->cell_height = s->height / l->scale;
    int64_t w = JSL_SHEET_GAP + (int64_t)l->columns * (l->cell_width + JSL_SHEET_GAP);
    int64_t h = JSL_SHEET_GAP + (int64_t)l->rows * (l->cell_height + JSL_SHEET_GAP);
    return l->cell_width > 0 && l->cell_height > 0 && w <= SIDE_MAX && h <= SIDE_MAX;
}

jsl_result jsl_image_sheet_size(const jsl_image_sheet *sheet, int *width, int *height) {
    layout l;
    if (!width || !height || !arrange(sheet, &l)) return JSL_ERR_ARGUMENT;
    *width = JSL_SHEET_GAP + l.columns * (l.cell_width + JSL_SHEET_GAP);
    *height = JSL_SHEET_GAP + l.rows * (l.cell_height + JSL_SHEET_GAP);
    return JSL_OK;
}

/* The mean of a square of pixels, rounded to nearest. */
static void shrink(const uint8_t *from, size_t pitch, int scale, uint8_t *to) {
    unsigned sum[3] = {0, 0, 0}, area = (unsigned)(scale * scale);
    for (int y = 0; y < scale; y++, from += pitch)
        for (int x = 0; x < 3 * scale; x++) sum[x % 3] += from[x];
    for (int c = 0; c < 3; c++) to[c] = (uint8_t)((sum[c] + area / 2) / area);
}

jsl_result jsl_image_sheet_put(const jsl_image_sheet *sheet, int index, const uint8_t *rgb,
                               uint8_t *out) {
    layout l;
    if (!rgb || !out || !arrange(sheet, &l) || index < 0 || index >= sheet->count)
        return JSL_ERR_ARGUMENT;
    size_t from_pitch = (size_t)3 * (size_t)sheet->width;
    size_t to_pitch =
        (size_t)3 * (size_t)(JSL_SHEET_GAP + l.columns * (l.cell_width + JSL_SHEET_GAP));
    int x0 = JSL_SHEET_GAP + index % l.columns * (l.cell_width + JSL_SHEET_GAP);
    int y0 = JSL_SHEET_GAP + index / l.columns * (l.cell_height + JSL_SHEET_GAP);
    for (int y = 0; y < l.cell_height; y++)
        for (int x = 0; x < l.cell_width; x++)
            shrink(rgb + (size_t)(y * l.scale) * from_pitch + (size_t)3 * (size_t)(x * l.scale),
                   from_pitch, l.scale,
                   out + (size_t)(y0 + y) * to_pitch + (size_t)3 * (size_t)(x0 + x));
    return JSL_OK;
}
