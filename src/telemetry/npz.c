/* SPDX-License-Identifier: MIT
 * npz.c - a zip archive of .npy arrays. Every member has zip64 sizes, so that a length never needs
 * a decision.
 */
#include "telemetry/npz.h"

#define LOCAL_HEAD 30
#define LOCAL_EXTRA 20

void jsl_npz_init(jsl_npz *z, jsl_memory *memory, FILE *file) {
    *z = (jsl_npz){.file = file, .memory = memory};
    for (uint32_t i = 0; i < 256; i++) { /* CRC-32 of ISO 3309, reflected */
        uint32_t c = i;
        for (int k = 0; k < 8; k++) c = c & 1 ? 0xedb88320u ^ c >> 1 : c >> 1;
        z->crc_of_byte[i] = c;
    }
}

/* `bytes` bytes of v, little-endian. */
static uint8_t *put(uint8_t *to, uint64_t v, int bytes) {
    for (int i = 0; i < bytes; i++) *to++ = (uint8_t)(v >> 8 * i);
    return to;
}

static void raw(jsl_npz *z, const void *data, size_t bytes) {
    (void)fwrite(data, 1, bytes, z->file); /* ferror remembers */
    z->at += (int64_t)bytes;
}

/* What local and central headers share: version needed to size of the name. */
static uint8_t *put_common(uint8_t *to, const jsl_npz_member *m, int extra) {
    to = put(to, 45, 2);                 /* zip64 */
    to = put(to, 0, 4);                  /* no flags, stored */
    to = put(to, 0, 2);                  /* 0:00 */
    to = put(to, 1 << 5 | 1, 2);         /* 1980-01-01: the same log gives the same file */
    to = put(to, m->crc, 4);             /* patched when it is known */
    to = put(to, 0xffffffffffffffff, 8); /* both sizes: in the extra field */
    to = put(to, strlen(m->name), 2);
    return put(to, (uint64_t)extra, 2);
}

static void put_local(jsl_npz *z, const jsl_npz_member *m) {
    uint8_t head[LOCAL_HEAD], extra[LOCAL_EXTRA];
    put_common(put(head, 0x04034b50, 4), m, LOCAL_EXTRA);
    put(put(put(extra, 16 << 16 | 1, 4), (uint64_t)m->size, 8), (uint64_t)m->size, 8);
    raw(z, head, sizeof head);
    raw(z, m->name, strlen(m->name));
    raw(z, extra, sizeof extra);
}

jsl_result jsl_npz_begin(jsl_npz *z, const char *name, const char *descr, int64_t size,
                         int64_t rows) {
    char head[192];
    int n = snprintf(head, sizeof head,
                     "\x93NUMPY%c%c%c%c{'descr': '%s', 'fortran_order': False, 'shape': (%lld,), }",
                     1, '0', '0', '0', descr, (long long)rows);
    JSL_ASSERT(n > 10 && n < 128);
    memset(head + n, ' ', (size_t)(127 - n)); /* data begins at a multiple of 64 */
    head[127] = '\n';
    head[7] = 0; /* version 1.0; the length after it is that of the text */
    put((uint8_t *)head + 8, 128 - 10, 2);
    JSL_TRY(jsl_array_reserve(z->memory, &z->member, z->member.count + 1));
    jsl_npz_member *m = &z->member.at[z->member.count++];
    *m = (jsl_npz_member){.size = 128 + rows * size, .offset = z->at};
    snprintf(m->name, sizeof m->name, "%s.npy", name);
    put_local(z, m);
    z->crc = 0xffffffff;
    z->left = m->size;
    jsl_npz_write(z, head, 128);
    return JSL_OK;
}

void jsl_npz_write(jsl_npz *z, const void *data, int64_t bytes) {
    const uint8_t *p = data;
    uint32_t crc = z->crc;
    for (int64_t i = 0; i < bytes; i++) crc = z->crc_of_byte[(crc ^ p[i]) & 255] ^ crc >> 8;
    z->crc = crc;
    z->left -= bytes;
    if (bytes) raw(z, data, (size_t)bytes);
}

jsl_result jsl_npz_end(jsl_npz *z) {
    jsl_npz_member *m = &z->member.at[z->member.count - 1];
    JSL_ASSERT(z->left == 0);
    m->crc = ~z->crc;
    uint8_t crc[4];
    put(crc, m->crc, 4);
    if (fseeko(z->file, (off_t)(m->offset + 14), SEEK_SET) != 0 ||
        fwrite(crc, 1, 4, z->file) != 4 || fseeko(z->file, 0, SEEK_END) != 0 || ferror(z->file))
        return JSL_ERR_IO;
    return JSL_OK;
}

jsl_result jsl_npz_finish(jsl_npz *z) {
    int64_t begin = z->at;
    uint64_t count = (uint64_t)z->member.count;
    for (int64_t i = 0; i < z->member.count; i++) {
        const jsl_npz_member *m = &z->member.at[i];
        uint8_t head[46], extra[28];
        uint8_t *to = put_common(put(put(head, 0x02014b50, 4), 45, 2), m, sizeof extra);
        put(put(put(to, 0, 2), 0, 8), 0xffffffff, 4); /* no comment, disk 0; offset: in the extra */
        to = put(put(extra, 24 << 16 | 1, 4), (uint64_t)m->size, 8);
        put(put(to, (uint64_t)m->size, 8), (uint64_t)m->offset, 8);
        raw(z, head, sizeof head);
        raw(z, m->name, strlen(m->name));
        raw(z, extra, sizeof extra);
    }
    int64_t end = z->at;
    uint8_t tail[56 + 20 + 22], *to = put(tail, 0x06064b50, 4);
    to = put(put(put(to, 44, 8), 45 << 16 | 45, 4), 0, 8);
    to = put(put(to, count, 8), count, 8);
    to = put(put(to, (uint64_t)(end - begin), 8), (uint64_t)begin, 8);
    to = put(put(put(put(to, 0x07064b50, 4), 0, 4), (uint64_t)end, 8), 1, 4);
    to = put(put(put(to, 0x06054b50, 4), 0, 4), count << 16 | count, 4);
    to = put(put(put(to, (uint64_t)(end - begin), 4), 0xffffffff, 4), 0, 2);
    JSL_ASSERT(to == tail + sizeof tail);
    raw(z, tail, sizeof tail);
    return ferror(z->file) ? JSL_ERR_IO : JSL_OK;
}

void jsl_npz_free(jsl_npz *z) { jsl_array_free(z->memory, &z->member); }
