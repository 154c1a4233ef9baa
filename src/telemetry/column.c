/* SPDX-License-Identifier: MIT
 * column.c - the encodings of bulk columns.
 */
#include "telemetry/column.h"

#include "telemetry/column_kernel.h"

int jsl_encoding_bytes(int encoding) {
    static const int bytes[JSL_ENC_COUNT] = {4, 8, 2, 2, 1, 4, 8, 4, 4};
    return encoding >= 0 && encoding < JSL_ENC_COUNT ? bytes[encoding] : 0;
}

uint16_t jsl_f16_from_f32(float x) {
    uint8_t bytes[2];
    uint16_t h;
    jsl_kernel_f16_scalar(&x, 1, bytes);
    memcpy(&h, bytes, 2);
    return h;
}

float jsl_f32_from_f16(uint16_t h) {
    uint8_t bytes[2];
    float x;
    memcpy(bytes, &h, 2);
    jsl_kernel_from_f16_scalar(bytes, 1, &x);
    return x;
}

void jsl_column_range(const float *x, int64_t n, float *lo, float *hi) {
    JSL_KERNEL_PICK(jsl_isa_resolve(JSL_ISA_AUTO), jsl_kernel_range)(x, n, lo, hi);
}

float jsl_column_step(float lo, float hi) { return (float)(((double)hi - (double)lo) / 65535.0); }

void jsl_column_encode(int encoding, const float *x, int64_t n, float lo, float step,
                       uint8_t *out) {
    jsl_isa isa = jsl_isa_resolve(JSL_ISA_AUTO);
    if (n <= 0) return;
    if (encoding == JSL_ENC_F16) {
        JSL_KERNEL_PICK(isa, jsl_kernel_f16)(x, n, out);
    } else if (encoding == JSL_ENC_U16Q) {
        double inverse = step > 0.0f ? 1.0 / (double)step : 0.0;
        /* A span of a few denormals has no finite inverse in float: every code is then 0. */
        float inv_step = inverse <= 3e38 ? (float)inverse : 0.0f;
        JSL_KERNEL_PICK(isa, jsl_kernel_u16)(x, n, lo, inv_step, out);
    } else {
        JSL_ASSERT(encoding == JSL_ENC_F32);
        memcpy(out, x, (size_t)n * 4);
    }
}

void jsl_column_narrow(const double *x, int64_t n, float *out) {
    for (int64_t i = 0; i < n; i++) out[i] = (float)x[i];
}

static float value_at(int encoding, const uint8_t *p, float lo, float step) {
    switch (encoding) {
    case JSL_ENC_F64: {
        double v;
        memcpy(&v, p, 8);
        return (float)v;
    }
    case JSL_ENC_U8Q:
        return lo + (float)p[0] * step;
    case JSL_ENC_I32: {
        int32_t v;
        memcpy(&v, p, 4);
        return (float)v;
    }
    case JSL_ENC_I64: {
        int64_t v;
        memcpy(&v, p, 8);
        return (float)v;
    }
    case JSL_ENC_U32: {
        uint32_t v;
        memcpy(&v, p, 4);
        return (float)v;
    }
    default:
        return 0.0f;
    }
}

void jsl_column_decode(int encoding, const uint8_t *data, int64_t n, float lo, float step,
                       float *out) {
    jsl_isa isa = jsl_isa_resolve(JSL_ISA_AUTO);
    int bytes = jsl_encoding_bytes(encoding);
    if (n <= 0) return;
    if (encoding == JSL_ENC_F32)
        memcpy(out, data, (size_t)n * 4);
    else if (encoding == JSL_ENC_F16)
        JSL_KERNEL_PICK(isa, jsl_kernel_from_f16)(data, n, out);
    else if (encoding == JSL_ENC_U16Q)
        JSL_KERNEL_PICK(isa, jsl_kernel_from_u16)(data, n, lo, step, out);
    else
        for (int64_t i = 0; i < n; i++, data += bytes) out[i] = value_at(encoding, data, lo, step);
}
