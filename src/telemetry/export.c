/* SPDX-License-Identifier: MIT
 * export.c - the frames of one channel of a log as one table: CSV or NPZ.
 *
 * The log is read through once to learn the columns and the number of rows; then once for CSV, or
 * once for each array of an NPZ, so that memory holds one frame at a time.
 */
#include "telemetry/log_file.h"
#include "telemetry/npz.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* -- Columns
 * ------------------------------------------------------------------------------------------- */

#define MAX_COLUMNS JSL_MAX_COMPONENT_FIELDS
typedef struct column {
    char name[34], unit[32];
    jsl_type type;
    const void *data;     /* of the present frame; null: absent, NaN or 0 */
    int field, component; /* of a built-in kind: FIELD_*, and which of its arrays */
} column;

typedef struct exporter {
    jsl_log_file *log;
    const jsl_export_desc *desc;
    int kind; /* jsl_set_kind of a built-in channel; JSL_SET_COLUMNS: the component `channel` */
    char channel[32];
    column column[MAX_COLUMNS];
    int count;
    uint32_t fields; /* of a built-in kind: those that some frame has */
    int64_t seen;    /* frames within the times, of this pass */
    /* The present frame. */
    int64_t step, rows;
    double time;
    const uint64_t *id;
} exporter;

static const char *const kind_names[JSL_FRAME_KINDS] = {"particles", "boids", "bodies"};

/* Columns of the built-in kinds; FIELD_COLOR is of u32. */
static const struct {
    uint8_t kinds; /* bit k: jsl_set_kind k has it */
    int8_t field, component;
    char name[5], unit[6];
} built_in[] = {
    {7, JSL_FIELD_POS, 0, "px", "m"},        {7, JSL_FIELD_POS, 1, "py", "m"},
    {7, JSL_FIELD_POS, 2, "pz", "m"},        {4, JSL_FIELD_QUAT, 0, "qx", "1"},
    {4, JSL_FIELD_QUAT, 1, "qy", "1"},       {4, JSL_FIELD_QUAT, 2, "qz", "1"},
    {4, JSL_FIELD_QUAT, 3, "qw", "1"},       {7, JSL_FIELD_VEL, 0, "vx", "m/s"},
    {7, JSL_FIELD_VEL, 1, "vy", "m/s"},      {7, JSL_FIELD_VEL, 2, "vz", "m/s"},
    {4, JSL_FIELD_ANGVEL, 0, "wx", "rad/s"}, {4, JSL_FIELD_ANGVEL, 1, "wy", "rad/s"},
    {4, JSL_FIELD_ANGVEL, 2, "wz", "rad/s"}, {2, JSL_FIELD_ACCEL, 0, "ax", "m/s^2"},
    {2, JSL_FIELD_ACCEL, 1, "ay", "m/s^2"},  {2, JSL_FIELD_ACCEL, 2, "az", "m/s^2"},
    {1, JSL_FIELD_RADIUS, 0, "size", "m"},   {7, JSL_FIELD_COLOR, 0, "rgba", ""},
};

static void add_built_in(exporter *e) {
    for (int i = 0; i < JSL_COUNT(built_in); i++) {
        if (!(built_in[i].kinds >> e->kind & 1) || !(e->fields >> built_in[i].field & 1)) continue;
        column *c = &e->column[e->count++];
        *c = (column){.type = built_in[i].field == JSL_FIELD_COLOR ? JSL_TYPE_U32 : JSL_TYPE_F32,
                      .field = built_in[i].field,
                      .component = built_in[i].component};
        snprintf(c->name, sizeof c->name, "%.4s", built_in[i].name);
        snprintf(c->unit, sizeof c->unit, "%.5s", built_in[i].unit);
    }
}

/* A field may be called like a column of the table itself. */
static bool is_taken(const char *name) {
    static const char *const own[] = {"step", "time", "id", "fields", "units"};
    for (int i = 0; i < JSL_COUNT(own); i++)
        if (strcmp(own[i], name) == 0) return true;
    return false;
}

static jsl_result match_component(exporter *e, const jsl_log_columns *f) {
    bool same = e->count == f->field_count;
    if (!e->count)
        for (int i = 0; i < f->field_count; i++) {
            column *c = &e->column[e->count++];
            c->type = f->field[i].type;
            snprintf(c->name, sizeof c->name, "%s%s", f->field[i].name,
                     is_taken(f->field[i].name) ? "_" : "");
            snprintf(c->unit, sizeof c->unit, "%s", f->field[i].unit);
            same = true;
        }
    for (int i = 0; same && i < e->count; i++) {
        size_t n = strlen(f->field[i].name);
        same = e->column[i].type == f->field[i].type &&
               strncmp(e->column[i].name, f->field[i].name, n) == 0 &&
               strcmp(e->column[i].name + n, is_taken(f->field[i].name) ? "_" : "") == 0 &&
               strcmp(e->column[i].unit, f->field[i].unit) == 0;
        e->column[i].data = f->field[i].data;
    }
    if (same) return JSL_OK;
    return jsl_fail(&e->desc->logger, JSL_ERR_CONFLICT, "export: %s has other fields at step %lld",
                    e->channel, (long long)f->step);
}

/* -- Frames
 * -------------------------------------------------------------------------------------------- */

static void begin_pass(exporter *e) {
    jsl_log_rewind(e->log);
    jsl_log_forget(e->log); /* ids of later frames do not hold for the first */
    e->seen = 0;
}

static jsl_result next_built_in(exporter *e) {
    const jsl_instant *t;
    jsl_log_file *log = e->log;
    JSL_TRY(jsl_log_next_of_kind(log, e->kind, &t));
    e->step = t->step;
    e->time = (double)t->sim_ns * 1e-9;
    e->rows = log->count[e->kind];
    e->id = jsl_log_ids(log, e->kind);
    /* The colours of bodies are those of the body table. */
    uint32_t has = log->fields[e->kind];
    if (e->kind == JSL_SET_BODIES) has |= 1u << JSL_FIELD_COLOR;
    e->fields |= e->rows ? has : 0;
    for (int i = 0; i < e->count; i++) {
        column *c = &e->column[i];
        c->data = c->field != JSL_FIELD_COLOR ? jsl_log_values(log, e->kind, c->field, c->component)
                  : has >> JSL_FIELD_COLOR & 1 ? (const void *)log->rgba[e->kind].at
                                               : NULL;
    }
    return JSL_OK;
}

static jsl_result next_component(exporter *e) {
    jsl_log_columns f;
    JSL_TRY(jsl_log_next_columns(e->log, e->channel, &f));
    e->step = f.step;
    e->time = f.time;
    e->rows = f.count;
    e->id = f.id;
    return match_component(e, &f);
}

/* Whether a comes before b by more than a step in float may be off: 60 steps of (float)(1.0 / 60)
 * are 1.000000052 s, and still what the user calls 1. */
static bool before(double a, double b) { return a < b - 1e-7 * (1 + fabs(b)); }

/* The next frame that was asked for. */
static jsl_result next_frame(exporter *e) {
    const jsl_export_desc *d = e->desc;
    for (;;) {
        JSL_TRY(e->kind == JSL_SET_COLUMNS ? next_component(e) : next_built_in(e));
        if (before(e->time, d->from) || (d->to != 0 && before(d->to, e->time))) continue;
        if (e->seen++ % (d->every ? d->every : 1) == 0) return JSL_OK;
    }
}

/* -- Which channel
 * ------------------------------------------------------------------------------------------ */

static bool has_name(const char *list, const char *name) {
    size_t k = strlen(name);
    for (const char *p = list; (p = strstr(p, name)) != NULL && *p; p++)
        if ((p == list || p[-1] == ' ') && (p[k] == 0 || p[k] == ',')) return k > 0;
    return false;
}

/* Adds a name to a comma-separated list once. */
static int add_name(char *list, size_t size, const char *name) {
    size_t n = strlen(list);
    if (has_name(list, name)) return 0;
    snprintf(list + n, size - n, "%s%s", n ? ", " : "", name);
    return 1;
}

static int list_channels(jsl_log_file *log, char *list, size_t size) {
    int count = 0;
    jsl_log_columns f;
    list[0] = 0;
    for (int64_t i = 0; i < log->set.count; i++)
        if (log->set.at[i].kind < JSL_FRAME_KINDS)
            count += add_name(list, size, kind_names[log->set.at[i].kind]);
    jsl_log_rewind(log);
    while (jsl_log_next_columns(log, NULL, &f) == JSL_OK)
        count += add_name(list, size, f.component);
    return count;
}

static jsl_result choose_channel(exporter *e) {
    char list[512];
    const char *name = e->desc->channel;
    int count = list_channels(e->log, list, sizeof list);
    if (!count) return jsl_fail(&e->desc->logger, JSL_ERR_NAME, "export: the log has no frames");
    if (!name && count > 1)
        return jsl_fail(&e->desc->logger, JSL_ERR_CONFLICT, "export: choose a channel: %s", list);
    snprintf(e->channel, sizeof e->channel, "%.*s", (int)sizeof e->channel - 1, name ? name : list);
    e->kind = JSL_SET_COLUMNS;
    for (int k = 0; k < JSL_FRAME_KINDS; k++)
        if (strcmp(e->channel, kind_names[k]) == 0) e->kind = k;
    if (name && !has_name(list, name))
        return jsl_fail(&e->desc->logger, JSL_ERR_NAME, "export: the log has no %s, but %s", name,
                        list);
    return JSL_OK;
}

/* -- CSV
 * -----------------------------------------------------------------------------------------------
 */

static void put_value(FILE *file, const column *c, int64_t i) {
    char text[40];
    const void *p = c->data;
    int n = 0;
    switch (p ? c->type : JSL_TYPE_COUNT) {
    case JSL_TYPE_F32:
        n = snprintf(text, sizeof text, "%.9g", (double)((const float *)p)[i]);
        break;
    case JSL_TYPE_F64:
        n = snprintf(text, sizeof text, "%.17g", ((const double *)p)[i]);
        break;
    case JSL_TYPE_I8:
        n = snprintf(text, sizeof text, "%d", ((const int8_t *)p)[i]);
        break;
    case JSL_TYPE_U8:
        n = snprintf(text, sizeof text, "%d", ((const uint8_t *)p)[i]);
        break;
    case JSL_TYPE_I16:
        n = snprintf(text, sizeof text, "%d", ((const int16_t *)p)[i]);
        break;
    case JSL_TYPE_U16:
        n = snprintf(text, sizeof text, "%d", ((const uint16_t *)p)[i]);
        break;
    case JSL_TYPE_I32:
        n = snprintf(text, sizeof text, "%ld", (long)((const int32_t *)p)[i]);
        break;
    case JSL_TYPE_U32:
        n = snprintf(text, sizeof text, "%lu", (unsigned long)((const uint32_t *)p)[i]);
        break;
    case JSL_TYPE_I64:
        n = snprintf(text, sizeof text, "%lld", (long long)((const int64_t *)p)[i]);
        break;
    case JSL_TYPE_U64:
    case JSL_TYPE_ENTITY:
        n = snprintf(text, sizeof text, "%llu", (unsigned long long)((const uint64_t *)p)[i]);
        break;
    default: /* the frame does not have it: an empty cell */
        break;
    }
    for (int k = 0; k < n; k++) /* whatever the host's locale */
        if (text[k] == ',') text[k] = '.';
    fputc(',', file);
    fwrite(text, 1, (size_t)n, file);
}

/* Quoted when the unit needs it. */
static void put_heading(FILE *file, const column *c) {
    bool quote = strpbrk(c->unit, ",\"\r\n") != NULL;
    fprintf(file, ",%s%s", quote ? "\"" : "", c->name);
    if (c->unit[0]) fputs(" [", file);
    for (const char *p = c->unit; *p; p++) {
        if (*p == '"') fputc('"', file);
        fputc(*p, file);
    }
    fprintf(file, "%s%s", c->unit[0] ? "]" : "", quote ? "\"" : "");
}

static jsl_result write_csv(exporter *e, FILE *file) {
    fputs("step,time [s],id", file);
    for (int c = 0; c < e->count; c++) put_heading(file, &e->column[c]);
    fputc('\n', file);
    begin_pass(e);
    jsl_result r;
    while ((r = next_frame(e)) == JSL_OK)
        for (int64_t i = 0; i < e->rows; i++) {
            long long ns = llround(e->time * 1e9);
            fprintf(file, "%lld,%lld.%09lld,%llu", (long long)e->step, ns / 1000000000,
                    llabs(ns % 1000000000), (unsigned long long)(e->id ? e->id[i] : 0));
            for (int c = 0; c < e->count; c++) put_value(file, &e->column[c], i);
            fputc('\n', file);
        }
    if (r != JSL_ERR_END) return r;
    return ferror(file) ? JSL_ERR_IO : JSL_OK;
}

/* -- NPZ
 * -----------------------------------------------------------------------------------------------
 */

static const char *const descr[JSL_TYPE_COUNT] = {
    [JSL_TYPE_F32] = "<f4", [JSL_TYPE_F64] = "<f8",   [JSL_TYPE_I8] = "|i1",
    [JSL_TYPE_U8] = "|u1",  [JSL_TYPE_I16] = "<i2",   [JSL_TYPE_U16] = "<u2",
    [JSL_TYPE_I32] = "<i4", [JSL_TYPE_U32] = "<u4",   [JSL_TYPE_I64] = "<i8",
    [JSL_TYPE_U64] = "<u8", [JSL_TYPE_ENTITY] = "<u8"};

/* One row's worth of something, count times. */
static void repeat(jsl_npz *z, const void *value, int64_t size, int64_t count) {
    for (int64_t i = 0; i < count; i++) jsl_npz_write(z, value, size);
}

enum { STEP = -3, TIME = -2, ID = -1 }; /* columns of the table itself */

static void put_array(exporter *e, jsl_npz *z, int which) {
    static const uint64_t zero = 0;
    const float nan32 = NAN;
    if (which == STEP) {
        repeat(z, &e->step, 8, e->rows);
    } else if (which == TIME) {
        repeat(z, &e->time, 8, e->rows);
    } else if (which == ID) {
        if (e->id)
            jsl_npz_write(z, e->id, e->rows * 8);
        else
            repeat(z, &zero, 8, e->rows);
    } else {
        const column *c = &e->column[which];
        int64_t size = jsl_type_size(c->type);
        if (c->data)
            jsl_npz_write(z, c->data, e->rows * size);
        else /* only built-in kinds lack a field now and then: f32 and u32 */
            repeat(z, c->type == JSL_TYPE_F32 ? (const void *)&nan32 : &zero, size, e->rows);
    }
}

static jsl_result write_texts(exporter *e, jsl_npz *z, bool units) {
    JSL_TRY(jsl_npz_begin(z, units ? "units" : "fields", "|S32", 32, e->count));
    for (int c = 0; c < e->count; c++) {
        char text[34] = {0};
        snprintf(text, sizeof text, "%s", units ? e->column[c].unit : e->column[c].name);
        jsl_npz_write(z, text, 32);
    }
    return jsl_npz_end(z);
}

static jsl_result write_npz(exporter *e, FILE *file, int64_t rows, jsl_npz *z) {
    static const char *const own[] = {"step", "time", "id"};
    static const jsl_type own_type[] = {JSL_TYPE_I64, JSL_TYPE_F64, JSL_TYPE_U64};
    jsl_npz_init(z, &e->log->memory, file);
    for (int which = STEP; which < e->count; which++) {
        jsl_type type = which < 0 ? own_type[which - STEP] : e->column[which].type;
        const char *name = which < 0 ? own[which - STEP] : e->column[which].name;
        JSL_TRY(jsl_npz_begin(z, name, descr[type], jsl_type_size(type), rows));
        begin_pass(e);
        jsl_result r;
        while ((r = next_frame(e)) == JSL_OK) put_array(e, z, which);
        if (r != JSL_ERR_END) return r;
        JSL_TRY(jsl_npz_end(z));
    }
    JSL_TRY(write_texts(e, z, false));
    JSL_TRY(write_texts(e, z, true));
    return jsl_npz_finish(z);
}

/* -- The whole
 * ----------------------------------------------------------------------------------------- */

/* Columns and rows, by a first look at every frame. */
static jsl_result survey(exporter *e, jsl_export_stats *stats) {
    jsl_result r;
    begin_pass(e);
    while ((r = next_frame(e)) == JSL_OK) {
        stats->frames++;
        stats->rows += e->rows;
    }
    if (r != JSL_ERR_END) return r;
    if (e->kind != JSL_SET_COLUMNS) add_built_in(e);
    for (int64_t i = 0; i < e->log->set.count; i++) {
        const jsl_set *s = &e->log->set.at[i];
        bool frame = s->kind < JSL_FRAME_KINDS || s->kind == JSL_SET_COLUMNS;
        stats->lost += frame && (s->bad || (s->got >= 0 && s->got < s->count));
    }
    return JSL_OK;
}

static jsl_result check_desc(const jsl_export_desc *d) {
    if (!d->path || d->format >= JSL_EXPORT_FORMAT_COUNT || d->every < 0 ||
        (d->channel && strlen(d->channel) > 31))
        return jsl_fail(&d->logger, JSL_ERR_ARGUMENT,
                        "export: path, format, channel or every is out of range");
    if (!isfinite(d->from) || !isfinite(d->to))
        return jsl_fail(&d->logger, JSL_ERR_NOT_FINITE, "export: from %g, to %g", d->from, d->to);
    return JSL_OK;
}

/* A device or a pipe: written as it stands, never replaced or removed. */
static bool is_special(const char *path) {
    struct stat s;
    return stat(path, &s) == 0 && !S_ISREG(s.st_mode);
}

jsl_result jsl_log_export(jsl_log_file *log, const jsl_export_desc *desc, jsl_export_stats *out) {
    jsl_export_stats stats = {0};
    if (out) *out = stats;
    if (!log || !desc) return JSL_ERR_ARGUMENT;
    JSL_TRY(check_desc(desc));
    JSL_TRY(jsl_log_list(log, true, NULL));
    exporter e = {.log = log, .desc = desc};
    JSL_TRY(choose_channel(&e));
    JSL_TRY(survey(&e, &stats));
    /* Written beside it and renamed: a failure leaves what was there, and the log itself is safe.
     */
    char part[4096];
    bool special = is_special(desc->path);
    int n = snprintf(part, sizeof part, special ? "%s" : "%s.part", desc->path);
    FILE *file = n > 0 && (size_t)n < sizeof part ? fopen(part, "wb") : NULL;
    if (!file)
        return jsl_fail(&desc->logger, JSL_ERR_IO, "export: '%s' cannot be written: %s", desc->path,
                        strerror(errno));
    jsl_npz z = {.memory = &log->memory};
    jsl_result r =
        desc->format == JSL_EXPORT_CSV ? write_csv(&e, file) : write_npz(&e, file, stats.rows, &z);
    jsl_npz_free(&z);
    if (fclose(file) != 0 && r == JSL_OK) r = JSL_ERR_IO;
    if (r == JSL_OK && !special && rename(part, desc->path) != 0) r = JSL_ERR_IO;
    jsl_log_rewind(log);
    if (r == JSL_OK) {
        if (out) *out = stats;
        return JSL_OK;
    }
    if (!special) (void)unlink(part);
    return jsl_fail(&desc->logger, r, "export: '%s' could not be written: %s", desc->path,
                    jsl_result_text(r));
}
