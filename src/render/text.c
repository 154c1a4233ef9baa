/* SPDX-License-Identifier: MIT
 * text.c - time and counts in the corner, laid over the finished picture.
 */
#include "render/font.h"
#include "render/renderer.h"

#include <stdio.h>

#define LINES 3
#define LINE_LENGTH 96
#define INK 255.0f
#define BACK 26.0f /* grey of the backing */
#define BACK_ALPHA 0.42f
#define LEADING 2 /* dots between lines */

/* Digits in groups of three: 50 000. */
static void grouped(int64_t value, char out[32]) {
    char digits[24];
    int length = snprintf(digits, sizeof digits, "%lld", (long long)value), n = 0;
    for (int i = 0; i < length; i++) {
        if (i > 0 && (length - i) % 3 == 0) out[n++] = ' ';
        out[n++] = digits[i];
    }
    out[n] = 0;
}

static void count(char *line, int64_t value, const char *noun, const char *nouns) {
    char number[32];
    size_t used = strlen(line);
    if (value <= 0) return;
    grouped(value, number);
    snprintf(line + used, LINE_LENGTH - used, "%s%s %s", used ? "   " : "", number,
             value == 1 ? noun : nouns);
}

static int write_lines(const jsl_renderer *r, const jsl_frame *frame,
                       char line[LINES][LINE_LENGTH]) {
    int n = 0;
    if (frame->scene && frame->scene[0]) snprintf(line[n++], LINE_LENGTH, "%.60s", frame->scene);
    char cell[32];
    double metres = (double)r->block.grid[0];
    if (metres < 1000)
        snprintf(cell, sizeof cell, "%g m", metres);
    else
        snprintf(cell, sizeof cell, "%g km", metres / 1000);
    char time[48] = "t = ?";
    if (isfinite(frame->time) && fabs(frame->time) < 1e12)
        snprintf(time, sizeof time, "t = %.2f s", frame->time);
    snprintf(line[n++], LINE_LENGTH, "%s   step %lld   grid %s", time, (long long)frame->step,
             cell);
    line[n][0] = 0;
    count(line[n], r->bodies_drawn, "body", "bodies");
    count(line[n], r->birds_drawn, "boid", "boids");
    count(line[n], r->particles_drawn, "particle", "particles");
    return line[n][0] ? n + 1 : n;
}

/* How much of the dot grid's ink is at a point in dots, with edges one pixel soft. */
static float ink(const uint8_t *glyph, float x, float y) {
    float sum = 0;
    int i = (int)floorf(x - 0.5f), k = (int)floorf(y - 0.5f);
    float fx = x - 0.5f - (float)i, fy = y - 0.5f - (float)k;
    for (int b = 0; b < 2; b++)
        for (int a = 0; a < 2; a++) {
            int c = i + a, w = k + b;
            if (c < 0 || c >= JSL_FONT_WIDTH || w < 0 || w >= JSL_FONT_HEIGHT) continue;
            if (glyph[w] >> (JSL_FONT_WIDTH - 1 - c) & 1)
                sum += (a ? fx : 1 - fx) * (b ? fy : 1 - fy);
        }
    /* Steeper than the plain interpolation: letters stay crisp, diagonals lose their steps. */
    return fminf(fmaxf(1.8f * sum - 0.40f, 0), 1);
}

static void blend(uint8_t *rgb, float value, float alpha) {
    for (int c = 0; c < 3; c++)
        rgb[c] = (uint8_t)((float)rgb[c] + (value - (float)rgb[c]) * alpha + 0.5f);
}

static void letter(const jsl_renderer *r, char code, int x0, int y0, int scale) {
    int index = (unsigned char)code - JSL_FONT_FIRST;
    if (index < 0 || index > JSL_FONT_LAST - JSL_FONT_FIRST) index = '?' - JSL_FONT_FIRST;
    for (int y = -1; y <= JSL_FONT_HEIGHT * scale; y++)
        for (int x = -1; x <= JSL_FONT_WIDTH * scale; x++) {
            int px = x0 + x, py = y0 + y;
            if (px < 0 || py < 0 || px >= r->desc.width || py >= r->desc.height) continue;
            float a = ink(jsl_font[index], ((float)x + 0.5f) / (float)scale,
                          ((float)y + 0.5f) / (float)scale);
            if (a > 0)
                blend(r->rgb + 3 * ((size_t)py * (size_t)r->desc.width + (size_t)px), INK, a);
        }
}

void jsl_text_overlay(const jsl_renderer *r, const jsl_frame *frame) {
    char line[LINES][LINE_LENGTH];
    int lines = write_lines(r, frame, line), widest = 0;
    int scale = r->desc.height >= 1080 ? r->desc.height / 360 : r->desc.height >= 400 ? 2 : 1;
    for (int i = 0; i < lines; i++) {
        int length = (int)strlen(line[i]);
        if (length > widest) widest = length;
    }
    int margin = 3 * scale, advance = (JSL_FONT_WIDTH + 1) * scale;
    int leading = (JSL_FONT_HEIGHT + LEADING) * scale;
    int width = widest * advance + 2 * margin, height = lines * leading + 2 * margin;
    for (int y = margin; y < margin + height && y < r->desc.height; y++)
        for (int x = margin; x < margin + width && x < r->desc.width; x++)
            blend(r->rgb + 3 * ((size_t)y * (size_t)r->desc.width + (size_t)x), BACK, BACK_ALPHA);
    for (int i = 0; i < lines; i++)
        for (int k = 0; line[i][k]; k++)
            letter(r, line[i][k], 2 * margin + k * advance,
                   2 * margin + i * leading + LEADING * scale / 2, scale);
}
