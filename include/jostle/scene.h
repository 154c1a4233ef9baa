/* SPDX-License-Identifier: MIT
 * jostle/scene.h - worlds described by JSON files (libjostle-scene: jansson). Floor 6.
 *
 * SI units. Every error is one line "file:line:column: key: what is wrong" through the logger;
 * unknown keys are errors that name the nearest known one. jsl_scene_schema is the JSON Schema of
 * the format, made from the tables that the reader uses.
 */
#ifndef JOSTLE_SCENE_H
#define JOSTLE_SCENE_H

#include <jostle/frame.h>
#include <jostle/world.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct jsl_scene jsl_scene;

/* JSL_ERR_IO when the file cannot be read, JSL_ERR_FORMAT when it is not JSON. */
JSL_API jsl_result jsl_scene_load(const char *path, const jsl_logger *logger, jsl_scene **out);
/* The same from memory; name stands for the file in messages. */
JSL_API jsl_result jsl_scene_parse(const char *name, const char *text, size_t size,
                                   const jsl_logger *logger, jsl_scene **out);
JSL_API void jsl_scene_free(jsl_scene *scene);

/* "world.substeps=8", "emitters.0.rate=5000": replaces or adds one value; the text after = is JSON,
 * or else a string. */
JSL_API jsl_result jsl_scene_set(jsl_scene *scene, const char *assignment);

/* What the file says about the run as a whole. Valid after jsl_scene_build or jsl_scene_read_info
 * succeeded. */
typedef struct jsl_scene_info {
    char name[64];
    double seconds; /* how long to simulate; 0: the file does not say */
    jsl_frame_camera camera;
    double particles_hz, boids_hz,
        bodies_hz; /* frames to publish per simulated second; 0: the publisher's default */
    const char *const *components; /* to publish; live until the next build of this scene */
    int component_count;           /* 0: the publisher's default */
    double components_hz;
    bool additive; /* particles are light */
    uint64_t hash; /* of the text and everything set since */
} jsl_scene_info;
JSL_API const jsl_scene_info *jsl_scene_get_info(const jsl_scene *scene);
/* The scene as JSON text with everything set since; free with jsl_scene_free_text. */
JSL_API char *jsl_scene_text(const jsl_scene *scene);
JSL_API void jsl_scene_free_text(char *text);

/* What the caller decides and not the file. Zeroed: as the file says. */
typedef struct jsl_scene_options {
    int workers;
    jsl_isa isa;
    jsl_logger logger;
    jsl_allocator allocator;
    jsl_tasks tasks;
} jsl_scene_options;
/* Makes the world. The file is read and checked completely: on failure there is no world. */
JSL_API jsl_result jsl_scene_build(jsl_scene *scene, const jsl_scene_options *options,
                                   jsl_world **out);

/* JSON Schema (draft 2020-12) of scene files; free with jsl_scene_free_text. */
JSL_API char *jsl_scene_schema(void);

#ifdef __cplusplus
}
#endif
#endif
