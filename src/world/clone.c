/* SPDX-License-Identifier: MIT
 * Images in files, and worlds made from worlds.
 */
#include "world/world_internal.h"

#include <errno.h>
#include <stdio.h>
#include <sys/stat.h>

jsl_result jsl_world_save_file(jsl_world *w, const char *path) {
    if (!w || !path) return JSL_ERR_ARGUMENT;
    const jsl_logger *log = &w->settings.logger;
    void *bytes;
    size_t size;
    char temporary[4096];
    int n = snprintf(temporary, sizeof temporary, "%s.part", path);
    if (n < 0 || (size_t)n >= sizeof temporary)
        return jsl_fail(log, JSL_ERR_ARGUMENT, "%.60s...: path is too long", path);
    struct stat old;
    if (stat(path, &old) == 0 && !S_ISREG(old.st_mode)) /* renaming would replace the device */
        return jsl_fail(log, JSL_ERR_IO, "%s: is not a regular file", path);
    JSL_TRY(jsl_world_save(w, &bytes, &size));
    FILE *file = fopen(temporary, "wb");
    bool good = file && fwrite(bytes, 1, size, file) == size;
    int reason = errno;
    if (file && fclose(file) != 0) good = false;
    jsl_world_free_bytes(w, bytes, size);
    if (good && rename(temporary, path) == 0) return JSL_OK;
    if (good) reason = errno;
    if (file) remove(temporary);
    return jsl_fail(log, JSL_ERR_IO, "%s: cannot be written: %s", path, strerror(reason));
}

jsl_result jsl_world_restore_file(jsl_world *w, const char *path) {
    if (!w || !path) return JSL_ERR_ARGUMENT;
    const jsl_logger *log = &w->settings.logger;
    FILE *file = fopen(path, "rb");
    if (!file) return jsl_fail(log, JSL_ERR_IO, "%s: cannot be opened: %s", path, strerror(errno));
    long size = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    if (size <= 0 || fseek(file, 0, SEEK_SET) != 0) {
        fclose(file);
        return jsl_fail(log, JSL_ERR_FORMAT, "%s: not an image", path);
    }
    void *bytes = jsl_alloc(w->memory, (size_t)size);
    bool good = bytes && fread(bytes, 1, (size_t)size, file) == (size_t)size;
    fclose(file);
    jsl_result result = good     ? jsl_world_restore(w, bytes, (size_t)size)
                        : !bytes ? jsl_fail(log, JSL_ERR_MEMORY, "%s: out of memory", path)
                                 : jsl_fail(log, JSL_ERR_IO, "%s: cannot be read", path);
    jsl_free(w->memory, bytes, (size_t)size);
    return result;
}

/* The clone needs the rooms of the original; they are made by their own hooks, so that this file
 * links none. */
static jsl_result same_rooms(const jsl_world *from, jsl_world *to) {
    for (int i = 0; i < JSL_ROOM_COUNT; i++)
        if (from->room[i] && !to->room[i]) JSL_TRY(from->hooks[i]->use(to));
    for (int i = 0; i < jsl_component_count(from->ecs); i++)
        if (strcmp(jsl_component_info(from->ecs, i)->name, "look") == 0)
            JSL_TRY(jsl_look_set_n(to, NULL, 0, 0));
    return JSL_OK;
}

jsl_result jsl_world_clone(jsl_world *w, jsl_prepare_fn *prepare, void *arg, jsl_world **out) {
    if (!w || !out) return JSL_ERR_ARGUMENT;
    *out = NULL;
    jsl_world_desc desc = w->settings;
    desc.tag = 0;
    jsl_world *clone;
    JSL_TRY(jsl_world_create(&desc, &clone));
    void *bytes = NULL;
    size_t size = 0;
    jsl_result result = same_rooms(w, clone);
    if (result == JSL_OK && prepare) result = prepare(clone, arg);
    if (result == JSL_OK) result = jsl_world_save(w, &bytes, &size);
    if (result == JSL_OK) result = jsl_world_restore(clone, bytes, size);
    jsl_world_free_bytes(w, bytes, size);
    if (result != JSL_OK) {
        jsl_world_destroy(clone);
        return result;
    }
    *out = clone;
    return JSL_OK;
}
