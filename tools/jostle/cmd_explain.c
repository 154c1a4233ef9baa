/* SPDX-License-Identifier: MIT
 * jostle explain: what a scene is made of, which systems will run and why, and what it costs in
 * memory.
 */
#include "cli.h"

#include <jostle/jostle.h>
#include <jostle/scene.h>

#include <string.h>

static void print_set(const jsl_ecs *ecs, uint64_t set) {
    const char *comma = "";
    for (int i = 0; i < jsl_component_count(ecs); i++)
        if (set >> i & 1) {
            printf("%s%s", comma, jsl_component_info(ecs, i)->name);
            comma = " ";
        }
}

static int component_bytes(const jsl_component_desc *desc) {
    int bytes = 0;
    for (int f = 0; f < desc->field_count; f++) bytes += jsl_type_size(desc->fields[f].type);
    return bytes;
}

static void print_tables(const jsl_ecs *ecs) {
    char text[32];
    printf("tables\n");
    for (int t = 0; t < jsl_table_count(ecs); t++) {
        jsl_table_info info;
        if (jsl_table_get(ecs, t, &info) != JSL_OK || info.rows == 0) continue;
        printf("  %8lld rows of %4d bytes, %8s%s: ", (long long)info.rows, info.row_bytes,
               human_bytes((double)info.bytes, text, sizeof text),
               info.keeps_order ? ", in order" : "");
        print_set(ecs, info.components);
        putchar('\n');
    }
}

/* Components in use, field by field. */
static void print_fields(const jsl_ecs *ecs) {
    static const char *const role[JSL_ROLE_COUNT] = {"", " cache", " derived", " scratch"};
    uint64_t used = 0;
    for (int t = 0; t < jsl_table_count(ecs); t++) {
        jsl_table_info info;
        if (jsl_table_get(ecs, t, &info) == JSL_OK && info.rows > 0) used |= info.components;
    }
    printf("components, bytes an entity\n");
    for (int c = 0; c < jsl_component_count(ecs); c++) {
        const jsl_component_desc *desc = jsl_component_info(ecs, c);
        if (!(used >> c & 1)) continue;
        printf("  %-14s %4d  ", desc->name, component_bytes(desc));
        for (int f = 0; f < desc->field_count && f < 8; f++) {
            const jsl_field *field = &desc->fields[f];
            printf("%s%s(%d%s%s%s)", f ? " " : "", field->name, jsl_type_size(field->type),
                   field->unit[0] ? " " : "", field->unit, role[field->role]);
        }
        if (desc->field_count > 8) printf(" and %d more", desc->field_count - 8);
        putchar('\n');
    }
}

static void print_reason(const jsl_ecs *ecs, const jsl_system_info *s) {
    if (s->always) {
        printf("runs, whatever there is");
    } else if (s->rows > 0) {
        printf("runs, %lld rows have ", (long long)s->rows);
        print_set(ecs, s->required);
    } else {
        printf("idle, nothing has ");
        print_set(ecs, s->required);
    }
    if (s->excluded) {
        printf(" without ");
        print_set(ecs, s->excluded);
    }
}

static void print_systems(const jsl_ecs *ecs) {
    printf("systems, in the order of execution\n");
    for (int i = 0; i < jsl_system_count(ecs); i++) {
        jsl_system_info s;
        if (jsl_system_get(ecs, i, &s) != JSL_OK) continue;
        printf("  %-9s %5d  %-18s ", jsl_stage_text(s.stage), s.order, s.name);
        print_reason(ecs, &s);
        if (s.reads) {
            printf("; reads ");
            print_set(ecs, s.reads);
        }
        if (s.writes) {
            printf("; writes ");
            print_set(ecs, s.writes);
        }
        putchar('\n');
    }
}

static int explain(const command *self, jsl_scene *scene) {
    jsl_world *world;
    jsl_scene_options options = {.logger = stderr_logger()};
    if (jsl_scene_build(scene, &options, &world) != JSL_OK) return EXIT_INPUT;
    const jsl_world_desc *s = jsl_world_settings(world);
    /* One step, so that what emitters give birth to is there too. */
    jsl_result result = jsl_step(world, 0, NULL);
    const jsl_ecs *ecs = jsl_world_ecs(world);
    char text[32];
    jsl_profile profile;
    jsl_world_profile(world, &profile);
    printf("%s: dt %g s, %d substeps, seed %llu, %s, %s\n", jsl_scene_get_info(scene)->name,
           (double)s->dt, s->substeps, (unsigned long long)s->seed, jsl_isa_text(s->isa),
           JSL_PRECISION_TEXT);
    printf("after one step: %lld entities, %s\n", (long long)jsl_entity_count(ecs),
           human_bytes((double)profile.memory_bytes, text, sizeof text));
    print_tables(ecs);
    print_fields(ecs);
    print_systems(ecs);
    printf("stages entered: ");
    for (int i = 0; i < JSL_STAGE_COUNT; i++)
        if (profile.entered[i]) printf("%s ", jsl_stage_text((jsl_stage)i));
    putchar('\n');
    jsl_world_destroy(world);
    return result == JSL_OK
               ? EXIT_DONE
               : complain(self, EXIT_LOST, "the step failed: %s", jsl_result_text(result));
}

static int run(const command *self, int argc, char **argv) {
    text_list set = {0};
    const option_row rows[] = {
        {"set", 0, OPTION_MANY, "KEY=VALUE", "change a value of the scene", &set, 0, 0},
    };
    int first;
    int status = parse_options(self, rows, 1, argc, argv, &first);
    if (status >= 0) return status;
    if (argc - first != 1)
        return complain(self, EXIT_INPUT, "name one scene file; see jostle explain --help");
    jsl_logger logger = stderr_logger();
    jsl_scene *scene;
    if (jsl_scene_load(argv[first], &logger, &scene) != JSL_OK) return EXIT_INPUT;
    status = -1;
    for (int i = 0; i < set.count && status < 0; i++)
        if (jsl_scene_set(scene, set.at[i]) != JSL_OK) status = EXIT_INPUT;
    if (status < 0) status = explain(self, scene);
    jsl_scene_free(scene);
    return status;
}

const command command_explain = {
    .name = "explain",
    .summary = "tell what a scene is made of, which systems will run and why",
    .usage = "SCENE.json [--set KEY=VALUE]",
    .details = "Simulates one step and prints the tables, the bytes of an entity by field, and the "
               "systems in their order.",
    .example = "jostle explain tools/scenes/showcase.json",
    .run = run,
};
