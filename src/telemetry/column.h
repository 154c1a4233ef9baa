/* SPDX-License-Identifier: MIT
 * Bulk columns: arrays of scalars as little-endian bytes in f32, f16 or u16 codes, and back.
 * Floor 6.
 */
#ifndef JSL_TELEMETRY_COLUMN_H
#define JSL_TELEMETRY_COLUMN_H

#include "base/base.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "telemetry columns are written by copying memory: a little-endian machine is needed"
#endif

/* column_t.encoding and column_t.field of jostle.lcm. */
enum {
    JSL_ENC_F32,
    JSL_ENC_F64,
    JSL_ENC_F16,
    JSL_ENC_U16Q,
    JSL_ENC_U8Q,
    JSL_ENC_I32,
    JSL_ENC_I64,
    JSL_ENC_U32,
    JSL_ENC_QUAT32,
    JSL_ENC_COUNT
};
enum {
    JSL_FIELD_ID,
    JSL_FIELD_POS,
    JSL_FIELD_VEL,
    JSL_FIELD_QUAT,
    JSL_FIELD_ANGVEL,
    JSL_FIELD_RADIUS,
    JSL_FIELD_MASS,
    JSL_FIELD_COLOR,
    JSL_FIELD_FLAGS,
    JSL_FIELD_LIFE,
    JSL_FIELD_FORCE,
    JSL_FIELD_TORQUE,
    JSL_FIELD_SLEEP,
    JSL_FIELD_GROUP,
    JSL_FIELD_ACCEL,
    JSL_FIELD_COUNT
};
/* Bytes of one component of one element; 0 for an encoding we do not know. */
int jsl_encoding_bytes(int encoding);

/* IEEE 754 binary16, round to nearest even; NaN stays NaN, too large becomes infinite. */
uint16_t jsl_f16_from_f32(float x);
float jsl_f32_from_f16(uint16_t h);

/* The smallest and largest number, those of 2^127 and more and NaN left out; both 0 when there is
 * none. */
void jsl_column_range(const float *x, int64_t n, float *lo, float *hi);
/* Bytes of n values (F32, F16, U16Q). U16Q: code = round((x - lo) / step), clamped; what is not
 * finite becomes code 0. The error is at most step / 2 = (hi - lo) / 131070, and the rounding of
 * float. out need not be aligned. */
void jsl_column_encode(int encoding, const float *x, int64_t n, float lo, float step, uint8_t *out);
/* The step that spans lo..hi with 65536 codes. */
float jsl_column_step(float lo, float hi);
/* n values of any numeric encoding as float. */
void jsl_column_decode(int encoding, const uint8_t *data, int64_t n, float lo, float step,
                       float *out);
/* double to float. */
void jsl_column_narrow(const double *x, int64_t n, float *out);

#endif
