/* SPDX-License-Identifier: MIT
 * Loading scene files, changing single values, and giving the text back.
 */
#include "scene/scene.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#define MAX_SCENE_BYTES (256 << 20)

static jsl_result read_file(const char *path, const jsl_logger *logger, char **text, size_t *size) {
    FILE *file = fopen(path, "rb");
    if (!file)
        return jsl_fail(logger, JSL_ERR_IO, "%s: cannot be opened: %s", path, strerror(errno));
    char *buffer = NULL;
    size_t used = 0, cap = 0;
    for (;;) {
        if (used + 4096 > cap) {
            cap = cap ? 2 * cap : 65536;
            char *grown = cap <= MAX_SCENE_BYTES ? realloc(buffer, cap) : NULL;
            if (!grown) {
                free(buffer);
                fclose(file);
                return jsl_fail(logger, JSL_ERR_MEMORY, "%s: too large", path);
            }
            buffer = grown;
        }
        size_t n = fread(buffer + used, 1, cap - used, file);
        used += n;
        if (n == 0) break;
    }
    bool bad = ferror(file) != 0;
    fclose(file);
    if (bad) {
        free(buffer);
        return jsl_fail(logger, JSL_ERR_IO, "%s: cannot be read: %s", path, strerror(errno));
    }
    *text = buffer;
    *size = used;
    return JSL_OK;
}

jsl_result jsl_scene_load(const char *path, const jsl_logger *logger, jsl_scene **out) {
    if (!path || !out) return JSL_ERR_ARGUMENT;
    *out = NULL;
    char *text = NULL;
    size_t size = 0;
    JSL_TRY(read_file(path, logger, &text, &size));
    jsl_result result = jsl_scene_parse(path, text, size, logger, out);
    free(text);
    return result;
}

jsl_result jsl_scene_parse(const char *name, const char *text, size_t size,
                           const jsl_logger *logger, jsl_scene **out) {
    if (!name || !text || !out) return JSL_ERR_ARGUMENT;
    *out = NULL;
    json_error_t error;
    json_t *root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    if (!root)
        return jsl_fail(logger, JSL_ERR_FORMAT, "%s:%d:%d: %s", name, error.line, error.column,
                        error.text);
    jsl_scene *scene = calloc(1, sizeof *scene);
    if (scene) {
        scene->root = root;
        scene->name = malloc(strlen(name) + 1);
        scene->text = malloc(size + 1);
    }
    if (!scene || !scene->name || !scene->text) {
        if (scene)
            jsl_scene_free(scene);
        else
            json_decref(root);
        return jsl_fail(logger, JSL_ERR_MEMORY, "%s: out of memory", name);
    }
    memcpy(scene->name, name, strlen(name) + 1);
    memcpy(scene->text, text, size);
    scene->text[size] = 0;
    scene->size = size;
    if (logger) scene->logger = *logger;
    *out = scene;
    return JSL_OK;
}

void jsl_scene_free(jsl_scene *scene) {
    if (!scene) return;
    json_decref(scene->root);
    free(scene->name);
    free(scene->text);
    free(scene->component_text);
    free((void *)scene->info.components);
    free(scene);
}

/* -- Setting one value
 * ------------------------------------------------------------------------------------ */

/* The container that holds the last part of the path, making objects on the way; null when the path
 * cannot be followed. */
static json_t *descend(json_t *at, char *path, char **last) {
    for (;;) {
        char *dot = strchr(path, '.');
        if (!dot) {
            *last = path;
            return at;
        }
        *dot = 0;
        json_t *next = NULL;
        if (json_is_object(at)) {
            next = json_object_get(at, path);
            if (!next) {
                next = json_object();
                if (json_object_set_new(at, path, next) != 0) return NULL;
            }
        } else if (json_is_array(at)) {
            char *end;
            unsigned long i = strtoul(path, &end, 10);
            if (*path && !*end) next = json_array_get(at, i);
        }
        if (!next) return NULL;
        at = next;
        path = dot + 1;
    }
}

jsl_result jsl_scene_set(jsl_scene *scene, const char *assignment) {
    if (!scene || !assignment) return JSL_ERR_ARGUMENT;
    const jsl_logger *log = &scene->logger;
    const char *equals = strchr(assignment, '=');
    char path[256];
    if (!equals || equals == assignment || (size_t)(equals - assignment) >= sizeof path)
        return jsl_fail(log, JSL_ERR_ARGUMENT,
                        "\"%s\": must be KEY=VALUE, such as world.substeps=8", assignment);
    memcpy(path, assignment, (size_t)(equals - assignment));
    path[equals - assignment] = 0;
    json_t *value = json_loads(equals + 1, JSON_DECODE_ANY | JSON_REJECT_DUPLICATES, NULL);
    if (!value) value = json_string(equals + 1);
    if (!value)
        return jsl_fail(log, JSL_ERR_FORMAT, "\"%s\": the value is not valid UTF-8", assignment);
    char *last;
    json_t *holder = descend(scene->root, path, &last);
    int failed = -1;
    if (json_is_object(holder)) {
        failed = json_object_set(holder, last, value);
    } else if (json_is_array(holder)) {
        char *end;
        unsigned long i = strtoul(last, &end, 10);
        if (*last && !*end && i < json_array_size(holder))
            failed = json_array_set(holder, i, value);
    }
    json_decref(value);
    if (failed)
        return jsl_fail(log, JSL_ERR_NAME, "\"%s\": the scene has no such place", assignment);
    return JSL_OK;
}

/* -- Giving it back
 * ------------------------------------------------------------------------------------------ */

const jsl_scene_info *jsl_scene_get_info(const jsl_scene *scene) {
    return scene ? &scene->info : NULL;
}

char *jsl_scene_text(const jsl_scene *scene) {
    return scene ? json_dumps(scene->root, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) : NULL;
}

void jsl_scene_free_text(char *text) { free(text); }
