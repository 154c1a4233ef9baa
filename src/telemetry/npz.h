/* SPDX-License-Identifier: MIT
 * Writing .npz files: arrays of numpy's .npy format in an uncompressed zip archive. Floor 6.
 *
 * Sources: numpy.lib.format (NPY version 1.0); PKWARE APPNOTE 6.3 (zip, zip64).
 */
#ifndef JSL_TELEMETRY_NPZ_H
#define JSL_TELEMETRY_NPZ_H

#include "base/base.h"

#include <stdio.h>

typedef struct jsl_npz_member {
    char name[64];
    uint32_t crc;
    int64_t size, offset; /* size: .npy header included */
} jsl_npz_member;

typedef struct jsl_npz {
    FILE *file; /* seekable; not closed by us */
    jsl_memory *memory;
    uint32_t crc_of_byte[256];
    JSL_ARRAY(jsl_npz_member) member;
    uint32_t crc;
    int64_t at, left; /* bytes written; still to come of the present member */
} jsl_npz;

void jsl_npz_init(jsl_npz *z, jsl_memory *memory, FILE *file);
/* A one-dimensional array of `rows` values; descr is numpy's type string, size that of a value. */
jsl_result jsl_npz_begin(jsl_npz *z, const char *name, const char *descr, int64_t size,
                         int64_t rows);
void jsl_npz_write(jsl_npz *z, const void *data, int64_t bytes);
/* Errors of the file since the beginning show here. */
jsl_result jsl_npz_end(jsl_npz *z);
/* Writes the directory. */
jsl_result jsl_npz_finish(jsl_npz *z);
void jsl_npz_free(jsl_npz *z);

#endif
