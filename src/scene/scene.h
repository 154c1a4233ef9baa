/* SPDX-License-Identifier: MIT
 * A scene in memory: the JSON tree and where it came from. Floor 6.
 */
#ifndef JSL_SCENE_SCENE_H
#define JSL_SCENE_SCENE_H

#include "scene/reader.h"

struct jsl_scene {
    char *name; /* of the file */
    char *text;
    size_t size;
    json_t *root;
    jsl_logger logger;
    jsl_scene_info info;
    char *component_text; /* what info.components points into */
};

#endif
