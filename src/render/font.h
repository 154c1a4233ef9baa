/* SPDX-License-Identifier: MIT
 * font.h - letters of 5 by 8 dots (the last row for tails), drawn for jostle.
 */
#ifndef JSL_RENDER_FONT_H
#define JSL_RENDER_FONT_H

#include <stdint.h>

#define JSL_FONT_WIDTH 5
#define JSL_FONT_HEIGHT 8
#define JSL_FONT_FIRST 32
#define JSL_FONT_LAST 126

/* Rows from the top; bit 4 is the leftmost dot. */
extern const uint8_t jsl_font[JSL_FONT_LAST - JSL_FONT_FIRST + 1][JSL_FONT_HEIGHT];

#endif
