/* SPDX-License-Identifier: MIT
 * Reading JSON objects by tables of keys.
 */
#include "scene/reader.h"

#include <stdio.h>
#include <stdlib.h>

/* -- Where a value stands in the text
 * ------------------------------------------------------------------ */

/* jansson has already accepted the text, so this walk need not be careful about syntax. */
static size_t skip_space(const scene_reader *r, size_t at) {
    while (at < r->size && strchr(" \t\r\n:,", r->text[at]) && r->text[at]) at++;
    return at;
}

static size_t skip_string(const scene_reader *r, size_t at) {
    for (at++; at < r->size && r->text[at] != '"'; at++)
        if (r->text[at] == '\\') at++;
    return at + 1;
}

static size_t skip_value(const scene_reader *r, size_t at) {
    int depth = 0;
    do {
        at = skip_space(r, at);
        if (at >= r->size) return at;
        char c = r->text[at];
        if (c == '"') {
            at = skip_string(r, at);
        } else if (c == '{' || c == '[') {
            depth++;
            at++;
        } else if (c == '}' || c == ']') {
            depth--;
            at++;
        } else {
            while (at < r->size && !strchr(" \t\r\n,]}", r->text[at])) at++;
        }
    } while (depth > 0);
    return at;
}

static bool key_is(const scene_reader *r, size_t at, const char *name) {
    size_t n = strlen(name);
    return at + n + 2 <= r->size && memcmp(r->text + at + 1, name, n) == 0 &&
           r->text[at + 1 + n] == '"';
}

/* Offset of the value (or of the key itself when the last part is a key) named by the path; size
 * when it is not in the text. */
static size_t locate(const scene_reader *r) {
    size_t at = skip_space(r, 0), found = at;
    for (int d = 0; d < r->depth; d++) {
        const path_part *part = &r->path[d];
        at = skip_space(r, at);
        if (at >= r->size || (r->text[at] != '{' && r->text[at] != '[')) return r->size;
        bool object = r->text[at] == '{';
        at++;
        for (size_t index = 0;; index++) {
            at = skip_space(r, at);
            if (at >= r->size || r->text[at] == '}' || r->text[at] == ']') return r->size;
            found = at;
            if (object) {
                bool here = part->key && key_is(r, at, part->key);
                at = skip_space(r, skip_string(r, at));
                if (here) break;
            } else if (!part->key && index == part->index) {
                break;
            }
            at = skip_value(r, at);
        }
    }
    return found;
}

static void line_of(const scene_reader *r, size_t at, int *line, int *column) {
    *line = *column = 1;
    for (size_t i = 0; i < at && i < r->size; i++) {
        if (r->text[i] == '\n') {
            ++*line;
            *column = 1;
        } else {
            ++*column;
        }
    }
}

static void path_text(const scene_reader *r, char *out, size_t size) {
    size_t n = 0;
    out[0] = 0;
    for (int d = 0; d < r->depth && n < size; d++) {
        int w = r->path[d].key
                    ? snprintf(out + n, size - n, "%s%s", d ? "." : "", r->path[d].key)
                    : snprintf(out + n, size - n, "%s%zu", d ? "." : "", r->path[d].index);
        if (w < 0) break;
        n += (size_t)w;
    }
}

static void where(const scene_reader *r, char *out, size_t size) {
    char path[192];
    path_text(r, path, sizeof path);
    size_t at = r->text ? locate(r) : 0;
    if (r->text && at < r->size) {
        int line, column;
        line_of(r, at, &line, &column);
        snprintf(out, size, "%s:%d:%d: %s", r->file, line, column, path[0] ? path : "(root)");
    } else {
        snprintf(out, size, "%s: %s", r->file, path[0] ? path : "(root)");
    }
}

jsl_result reader_fail(scene_reader *r, jsl_result code, const char *format, ...) {
    char place[320], message[192];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    where(r, place, sizeof place);
    return jsl_fail(r->logger, code, "%s: %s", place, message);
}

jsl_result reader_check(scene_reader *r, jsl_result result, const char *reason) {
    if (result == JSL_OK) return JSL_OK;
    return reader_fail(r, result, "%s", reason && reason[0] ? reason : jsl_result_text(result));
}

jsl_result reader_push_key(scene_reader *r, const char *name) {
    if (r->depth == MAX_DEPTH) return reader_fail(r, JSL_ERR_LIMIT, "nested too deeply");
    r->path[r->depth++] = (path_part){name, 0};
    return JSL_OK;
}

jsl_result reader_push_index(scene_reader *r, size_t index) {
    if (r->depth == MAX_DEPTH) return reader_fail(r, JSL_ERR_LIMIT, "nested too deeply");
    r->path[r->depth++] = (path_part){NULL, index};
    return JSL_OK;
}

void reader_pop(scene_reader *r) { r->depth--; }

/* -- Words
 * --------------------------------------------------------------------------------------------- */

static int edit_distance(const char *a, const char *b) {
    int row[64];
    int n = (int)strlen(b);
    if (n > 60) return 99;
    for (int j = 0; j <= n; j++) row[j] = j;
    for (int i = 1; a[i - 1]; i++) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= n; j++) {
            int up = row[j];
            int best = diagonal + (a[i - 1] != b[j - 1]);
            if (up + 1 < best) best = up + 1;
            if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
            row[j] = best;
            diagonal = up;
        }
    }
    return row[n];
}

const char *nearest_word(const char *word, const char *const *candidate, int count) {
    int best = 1 + (int)strlen(word) / 2;
    const char *found = NULL;
    for (int i = 0; i < count; i++) {
        int d = edit_distance(word, candidate[i]);
        if (d < best) {
            best = d;
            found = candidate[i];
        }
    }
    return found;
}

static jsl_result unknown_key(scene_reader *r, const char *name, const key_table *table) {
    const char *names[128];
    int n = table->count < 128 ? table->count : 128;
    for (int i = 0; i < n; i++) names[i] = table->key[i].name;
    const char *near = nearest_word(name, names, n);
    JSL_TRY(reader_push_key(r, name));
    jsl_result result =
        near ? reader_fail(r, JSL_ERR_NAME, "unknown key in %s; the nearest known one is \"%s\"",
                           table->what, near)
             : reader_fail(r, JSL_ERR_NAME, "unknown key in %s", table->what);
    reader_pop(r);
    return result;
}

bool parse_color(const char *text, uint32_t *rgba) {
    size_t n = strlen(text);
    if (text[0] != '#' || (n != 7 && n != 9) || strspn(text + 1, "0123456789abcdefABCDEF") != n - 1)
        return false;
    uint32_t value = (uint32_t)strtoul(text + 1, NULL, 16);
    *rgba = n == 7 ? value << 8 | 0xffu : value;
    return true;
}

/* -- Values
 * -----------------------------------------------------------------------------------------------
 */

static jsl_result read_number(scene_reader *r, json_t *value, const key *k, double *out) {
    if (!json_is_number(value)) return reader_fail(r, JSL_ERR_FORMAT, "must be a number");
    double x = json_number_value(value);
    if (!jsl_is_finite((jsl_real)x))
        return reader_fail(r, JSL_ERR_NOT_FINITE, "is not finite, or too large for %s",
                           JSL_PRECISION_TEXT);
    if ((k->lo != 0 || k->hi != 0) && (x < k->lo || x > k->hi)) {
        if (k->hi >= 1e30)
            return reader_fail(r, JSL_ERR_ARGUMENT, "is %g%s%s: must be at least %g", x,
                               k->unit[0] ? " " : "", k->unit, k->lo);
        return reader_fail(r, JSL_ERR_ARGUMENT, "is %g%s%s: must be from %g to %g", x,
                           k->unit[0] ? " " : "", k->unit, k->lo, k->hi);
    }
    *out = x;
    return JSL_OK;
}

/* A number, or a string such as "1/60". */
static jsl_result read_fraction(scene_reader *r, json_t *value, const key *k, double *out) {
    if (!json_is_string(value)) return read_number(r, value, k, out);
    const char *text = json_string_value(value);
    char *end;
    double a = strtod(text, &end), b = 1;
    bool good = end != text;
    if (good && *end == '/') {
        const char *from = end + 1;
        b = strtod(from, &end);
        good = end != from;
    }
    if (!good || *end)
        return reader_fail(r, JSL_ERR_FORMAT, "must be a number or a fraction such as \"1/60\"");
    json_t *number = json_real(b != 0 ? a / b : 0);
    if (!number) return reader_fail(r, JSL_ERR_NOT_FINITE, "is not finite");
    jsl_result result = read_number(r, number, k, out);
    json_decref(number);
    return result;
}

static jsl_result read_numbers(scene_reader *r, json_t *value, const key *k, int count,
                               double *out) {
    if (!json_is_array(value) || json_array_size(value) != (size_t)count)
        return reader_fail(r, JSL_ERR_FORMAT, "must be a list of %d numbers", count);
    for (int i = 0; i < count; i++) {
        JSL_TRY(reader_push_index(r, (size_t)i));
        JSL_TRY(read_number(r, json_array_get(value, (size_t)i), k, &out[i]));
        reader_pop(r);
    }
    return JSL_OK;
}

static jsl_result read_choice(scene_reader *r, json_t *value, const key *k, int *out) {
    int n = 0;
    while (k->choices[n]) n++;
    if (!json_is_string(value))
        return reader_fail(r, JSL_ERR_FORMAT, "must be a word such as \"%s\"", k->choices[0]);
    for (int i = 0; i < n; i++)
        if (strcmp(json_string_value(value), k->choices[i]) == 0) {
            *out = i;
            return JSL_OK;
        }
    const char *near = nearest_word(json_string_value(value), k->choices, n);
    return reader_fail(r, JSL_ERR_NAME, "unknown word \"%s\"; %s \"%s\"", json_string_value(value),
                       near ? "the nearest known one is" : "known is, for example,",
                       near ? near : k->choices[0]);
}

static jsl_result read_rotation(scene_reader *r, json_t *value, const key *k, jsl_quat *out) {
    double q[4];
    JSL_TRY(read_numbers(r, value, k, 4, q));
    double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
    if (k->kind == KEY_TURN) {
        if (n == 0)
            return reader_fail(r, JSL_ERR_ARGUMENT, "the axis is zero: give [x, y, z, degrees]");
        *out = jsl_quat_from_axis_angle(jsl_v3((jsl_real)q[0], (jsl_real)q[1], (jsl_real)q[2]),
                                        (jsl_real)(q[3] * 3.14159265358979323846 / 180));
        return JSL_OK;
    }
    if (n + q[3] * q[3] == 0) return reader_fail(r, JSL_ERR_ARGUMENT, "is the zero quaternion");
    *out = jsl_quat_normalize(
        (jsl_quat){(jsl_real)q[0], (jsl_real)q[1], (jsl_real)q[2], (jsl_real)q[3]});
    return JSL_OK;
}

static jsl_result read_container(scene_reader *r, json_t *value, const key *k, json_t **out) {
    if (k->kind == KEY_LIST && !json_is_array(value))
        return reader_fail(r, JSL_ERR_FORMAT, "must be a list");
    if (k->kind != KEY_LIST && !json_is_object(value))
        return reader_fail(r, JSL_ERR_FORMAT, "must be an object");
    *out = value;
    return JSL_OK;
}

static jsl_result read_names(scene_reader *r, json_t *value, json_t **out) {
    if (!json_is_array(value)) return reader_fail(r, JSL_ERR_FORMAT, "must be a list of strings");
    for (size_t i = 0; i < json_array_size(value); i++) {
        JSL_TRY(reader_push_index(r, i));
        if (!json_is_string(json_array_get(value, i)))
            return reader_fail(r, JSL_ERR_FORMAT, "must be a string");
        reader_pop(r);
    }
    *out = value;
    return JSL_OK;
}

static jsl_result read_value(scene_reader *r, json_t *value, const key *k, void *out) {
    double x[3];
    switch (k->kind) {
    case KEY_REAL:
    case KEY_DEGREES:
        JSL_TRY(read_number(r, value, k, x));
        *(jsl_real *)out =
            (jsl_real)(k->kind == KEY_REAL ? x[0] : x[0] * 3.14159265358979323846 / 180);
        return JSL_OK;
    case KEY_DOUBLE:
        return read_fraction(r, value, k, out);
    case KEY_INT:
    case KEY_INT32:
        if (!json_is_integer(value))
            return reader_fail(r, JSL_ERR_FORMAT, "must be a whole number");
        JSL_TRY(read_number(r, value, k, x));
        if (k->kind == KEY_INT)
            *(int64_t *)out = json_integer_value(value);
        else
            *(int *)out = (int)json_integer_value(value);
        return JSL_OK;
    case KEY_BOOL:
        if (!json_is_boolean(value)) return reader_fail(r, JSL_ERR_FORMAT, "must be true or false");
        *(bool *)out = json_is_true(value);
        return JSL_OK;
    case KEY_NAME:
        if (!json_is_string(value)) return reader_fail(r, JSL_ERR_FORMAT, "must be a string");
        *(const char **)out = json_string_value(value);
        return JSL_OK;
    case KEY_VEC3:
        JSL_TRY(read_numbers(r, value, k, 3, x));
        *(jsl_vec3 *)out = jsl_v3((jsl_real)x[0], (jsl_real)x[1], (jsl_real)x[2]);
        return JSL_OK;
    case KEY_QUAT:
    case KEY_TURN:
        return read_rotation(r, value, k, out);
    case KEY_COLOR:
        if (!json_is_string(value) || !parse_color(json_string_value(value), out))
            return reader_fail(r, JSL_ERR_FORMAT, "must be a colour \"#rrggbb\" or \"#rrggbbaa\"");
        return JSL_OK;
    case KEY_CHOICE:
        return read_choice(r, value, k, out);
    case KEY_NAMES:
        return read_names(r, value, out);
    case KEY_OBJECT:
    case KEY_LIST:
    case KEY_MAP:
        return read_container(r, value, k, out);
    }
    return JSL_ERR_FORMAT;
}

jsl_result reader_object(scene_reader *r, json_t *object, const key_table *table, void *out,
                         uint64_t *present) {
    if (present) *present = 0;
    if (!json_is_object(object))
        return reader_fail(r, JSL_ERR_FORMAT, "must be an object (%s)", table->what);
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value) {
        int i = 0;
        while (i < table->count && strcmp(table->key[i].name, name) != 0) i++;
        if (i == table->count) return unknown_key(r, name, table);
        JSL_TRY(reader_push_key(r, name));
        JSL_TRY(read_value(r, value, &table->key[i], (char *)out + table->key[i].offset));
        reader_pop(r);
        if (present) *present |= 1ull << i;
    }
    return JSL_OK;
}
