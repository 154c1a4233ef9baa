/* SPDX-License-Identifier: MIT
 * The loops of column.c that exist once per instruction set. Floor 6.
 */
#ifndef JSL_TELEMETRY_COLUMN_KERNEL_H
#define JSL_TELEMETRY_COLUMN_KERNEL_H

#include "math/wide_dispatch.h"

JSL_KERNEL_DECLARE(void, jsl_kernel_range, (const float *x, int64_t n, float *lo, float *hi));
JSL_KERNEL_DECLARE(void, jsl_kernel_f16, (const float *x, int64_t n, uint8_t *out));
JSL_KERNEL_DECLARE(void, jsl_kernel_u16,
                   (const float *x, int64_t n, float lo, float inv_step, uint8_t *out));
JSL_KERNEL_DECLARE(void, jsl_kernel_from_f16, (const uint8_t *in, int64_t n, float *out));
JSL_KERNEL_DECLARE(void, jsl_kernel_from_u16,
                   (const uint8_t *in, int64_t n, float lo, float step, float *out));

#endif
