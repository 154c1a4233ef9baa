/* SPDX-License-Identifier: MIT
 * jostle schema: the JSON Schema of scene files.
 */
#include "cli.h"

#include <jostle/scene.h>

static int run(const command *self, int argc, char **argv) {
    int first;
    int status = parse_options(self, NULL, 0, argc, argv, &first);
    if (status >= 0) return status;
    if (first != argc) return complain(self, EXIT_INPUT, "takes no argument");
    char *text = jsl_scene_schema();
    if (!text) return complain(self, EXIT_LOST, "out of memory");
    puts(text);
    jsl_scene_free_text(text);
    return EXIT_DONE;
}

const command command_schema = {
    .name = "schema",
    .summary = "print the JSON Schema of scene files",
    .usage = "",
    .example = "jostle schema > scene.schema.json",
    .run = run,
};
