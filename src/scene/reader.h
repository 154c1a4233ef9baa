/* SPDX-License-Identifier: MIT
 * Reading JSON objects by tables of keys, with errors that say where. Floor 6.
 */
#ifndef JSL_SCENE_READER_H
#define JSL_SCENE_READER_H

#include "base/base.h"
#include <jansson.h>
#include <jostle/scene.h>

#define MAX_DEPTH 12

/* Where we are: the keys and indices from the root. */
typedef struct path_part {
    const char *key; /* null: index */
    size_t index;
} path_part;

typedef struct scene_reader {
    const char *file;
    const char *text; /* null parts of the tree came from --set: no line is known */
    size_t size;
    const jsl_logger *logger;
    path_part path[MAX_DEPTH];
    int depth;
} scene_reader;

typedef enum key_kind {
    KEY_REAL,    /* jsl_real */
    KEY_DEGREES, /* jsl_real, kept in rad */
    KEY_DOUBLE,  /* double; also "1/60" */
    KEY_INT,     /* int64_t */
    KEY_INT32,   /* int */
    KEY_BOOL,    /* bool */
    KEY_NAME,    /* const char *, borrowed from the tree */
    KEY_VEC3,    /* jsl_vec3 */
    KEY_QUAT,    /* jsl_quat, normalised */
    KEY_TURN,    /* jsl_quat from [x, y, z, degrees] */
    KEY_COLOR,   /* uint32_t from "#rrggbb" or "#rrggbbaa" */
    KEY_CHOICE,  /* int: index into choices */
    KEY_OBJECT,  /* json_t *, an object; keys says of what */
    KEY_LIST,    /* json_t *, an array of objects or vectors; keys says of what */
    KEY_NAMES,   /* json_t *, an array of strings */
    KEY_MAP      /* json_t *, an object of named objects; keys says of what */
} key_kind;

struct key_table;
typedef struct key {
    const char *name;
    key_kind kind;
    size_t offset; /* of the value in the struct that is filled */
    double lo, hi; /* inclusive range of numbers; both 0: any finite */
    const char *unit;
    const char *doc;
    const struct key_table *keys; /* of OBJECT, LIST, MAP; null: anything */
    const char *const *choices;   /* of CHOICE, null-terminated */
} key;

/* present has bit i set when key i was given. */
typedef struct key_table {
    const char *what;
    const key *key;
    int count;
} key_table;

/* Fills *out (which holds the defaults) from the object by the table. */
jsl_result reader_object(scene_reader *r, json_t *object, const key_table *table, void *out,
                         uint64_t *present);

jsl_result reader_push_key(scene_reader *r, const char *name);
jsl_result reader_push_index(scene_reader *r, size_t index);
void reader_pop(scene_reader *r);

/* Logs "file:line:column: path: message" for the present path, and returns code. */
jsl_result reader_fail(scene_reader *r, jsl_result code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Logs the present path before what a library call says of it. */
jsl_result reader_check(scene_reader *r, jsl_result result, const char *reason);

/* "#rrggbb" or "#rrggbbaa". */
bool parse_color(const char *text, uint32_t *rgba);

/* The candidate nearest to the word by edit distance; null when none is near. */
const char *nearest_word(const char *word, const char *const *candidate, int count);

#endif
