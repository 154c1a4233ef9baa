/* SPDX-License-Identifier: MIT
 * Making a world from a scene. What the tables cannot express stands here: names, defaults, copies.
 */
#include "scene/scene.h"
#include "scene/tables.h"

#include <stdio.h>
#include <stdlib.h>

#define MAX_COPIES 10000000

/* The reader, the world being made, and the last message of the library, to be told with file and
 * line. */
typedef struct builder {
    scene_reader reader;
    jsl_scene *scene;
    jsl_world *world;
    json_t *materials;
    char reason[512];
} builder;

static void keep_reason(jsl_log_level level, jsl_result code, const char *text, void *ctx) {
    builder *b = ctx;
    (void)level;
    (void)code;
    snprintf(b->reason, sizeof b->reason, "%s", text);
}

static jsl_result told(builder *b, jsl_result result) {
    return reader_check(&b->reader, result, b->reason);
}

/* Runs `part` on every element of a list. */
static jsl_result each(builder *b, const char *name, json_t *list,
                       jsl_result (*part)(builder *, json_t *)) {
    if (!list) return JSL_OK;
    JSL_TRY(reader_push_key(&b->reader, name));
    for (size_t i = 0; i < json_array_size(list); i++) {
        JSL_TRY(reader_push_index(&b->reader, i));
        JSL_TRY(part(b, json_array_get(list, i)));
        reader_pop(&b->reader);
    }
    reader_pop(&b->reader);
    return JSL_OK;
}

/* Reads a sub-object by its table, keeping the path. Absent: nothing. */
static jsl_result sub(builder *b, const char *name, json_t *object, const key_table *table,
                      void *out, uint64_t *present) {
    if (present) *present = 0;
    if (!object) return JSL_OK;
    JSL_TRY(reader_push_key(&b->reader, name));
    JSL_TRY(reader_object(&b->reader, object, table, out, present));
    reader_pop(&b->reader);
    return JSL_OK;
}

/* -- Bodies
 * -------------------------------------------------------------------------------------------------
 */

static jsl_result read_shape(builder *b, json_t *object, jsl_shape *out) {
    scene_shape s = {0};
    uint64_t present;
    if (!object) return reader_fail(&b->reader, JSL_ERR_ARGUMENT, "a body needs a \"shape\"");
    JSL_TRY(reader_push_key(&b->reader, "shape"));
    JSL_TRY(reader_object(&b->reader, object, &table_shape, &s, &present));
    if (present == 0 || (present & (present - 1)) != 0 || (present == 8 && !s.plane))
        return reader_fail(&b->reader, JSL_ERR_ARGUMENT,
                           "give exactly one of sphere, box, capsule, plane");
    jsl_shape_desc desc = {0};
    if (s.sphere > 0) {
        desc = (jsl_shape_desc){.kind = JSL_SHAPE_SPHERE, .radius = s.sphere};
    } else if (s.capsule) {
        scene_capsule c = {0};
        JSL_TRY(sub(b, "capsule", s.capsule, &table_capsule, &c, NULL));
        desc = (jsl_shape_desc){
            .kind = JSL_SHAPE_CAPSULE, .radius = c.radius, .half = {0, 0, c.length / 2}};
    } else if (present & 8) {
        desc = (jsl_shape_desc){.kind = JSL_SHAPE_PLANE};
    } else {
        desc = (jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = jsl_scale(s.box, JSL_R(0.5))};
    }
    JSL_TRY(told(b, jsl_shape_create(b->world, &desc, out)));
    reader_pop(&b->reader);
    return JSL_OK;
}

static jsl_result find_material(builder *b, const char *name, jsl_material *out) {
    *out = (jsl_material){0};
    if (!name) return JSL_OK;
    json_t *object = json_object_get(b->materials, name);
    if (!object) {
        const char *names[64], *word;
        int n = 0;
        json_t *value;
        json_object_foreach(b->materials, word, value) {
            if (n < 64) names[n++] = word;
        }
        const char *near = nearest_word(name, names, n);
        JSL_TRY(reader_push_key(&b->reader, "material"));
        return reader_fail(&b->reader, JSL_ERR_NAME, "no material \"%s\"%s%s", name,
                           near ? "; there is " : "", near ? near : "");
    }
    jsl_material_desc desc = {JSL_R(0.6), 0};
    JSL_TRY(reader_object(&b->reader, object, &table_material, &desc, NULL));
    return told(b, jsl_material_create(b->world, &desc, out));
}

/* Materials are checked even when no body uses them. */
static jsl_result check_materials(builder *b) {
    const char *name;
    json_t *value;
    JSL_TRY(reader_push_key(&b->reader, "materials"));
    json_object_foreach(b->materials, name, value) {
        jsl_material_desc desc = {0};
        JSL_TRY(reader_push_key(&b->reader, name));
        JSL_TRY(reader_object(&b->reader, value, &table_material, &desc, NULL));
        reader_pop(&b->reader);
    }
    reader_pop(&b->reader);
    return JSL_OK;
}

/* Where the copies go. */
typedef struct copies {
    int64_t nx, ny, nz;
    jsl_vec3 spacing;
    scene_ring ring;
    bool in_ring;
} copies;

static jsl_result read_copies(builder *b, const scene_body *body, copies *c) {
    *c = (copies){
        1, 1, 1, {0, 0, 0}, {.count = 1, .layers = 1, .stagger = JSL_R(0.5)}, body->ring != NULL};
    scene_grid grid = {.count = {1, 1, 1}};
    JSL_TRY(sub(b, "grid", body->grid, &table_grid, &grid, NULL));
    JSL_TRY(sub(b, "ring", body->ring, &table_ring, &c->ring, NULL));
    if (body->grid && body->ring)
        return reader_fail(&b->reader, JSL_ERR_CONFLICT, "give grid or ring, not both");
    c->nx = (int64_t)grid.count.x;
    c->ny = (int64_t)grid.count.y;
    c->nz = (int64_t)grid.count.z;
    c->spacing = grid.spacing;
    if (c->in_ring) {
        c->nx = c->ring.count;
        c->nz = c->ring.layers;
    }
    if (c->nx > MAX_COPIES || c->ny > MAX_COPIES || c->nz > MAX_COPIES ||
        c->nx * c->ny > MAX_COPIES / c->nz)
        return reader_fail(&b->reader, JSL_ERR_LIMIT, "more than %d copies", MAX_COPIES);
    return JSL_OK;
}

static void place_copy(const copies *c, const jsl_body_desc *first, int64_t x, int64_t y, int64_t z,
                       jsl_body_desc *out) {
    *out = *first;
    if (!c->in_ring) {
        jsl_vec3 offset = {(jsl_real)x * c->spacing.x, (jsl_real)y * c->spacing.y,
                           (jsl_real)z * c->spacing.z};
        out->position = jsl_add(first->position, offset);
        return;
    }
    jsl_real turns = ((jsl_real)x + c->ring.stagger * (jsl_real)(z % 2)) / (jsl_real)c->ring.count;
    jsl_real angle = 2 * JSL_PI * turns, s, k;
    jsl_sin_cos(angle, &s, &k);
    out->position = jsl_add(first->position, jsl_v3(c->ring.radius * k, c->ring.radius * s,
                                                    c->ring.rise * (jsl_real)z));
    out->orientation = jsl_quat_mul(jsl_quat_from_axis_angle(jsl_v3(0, 0, 1), angle),
                                    jsl_quat_normalize(first->orientation));
}

/* The same colour a little lighter or darker. */
static uint32_t vary_color(uint32_t rgba, jsl_real vary, uint64_t copy) {
    jsl_rng rng = jsl_rng_make(1, copy, 0, 0);
    jsl_real factor = 1 + vary * jsl_rng_signed(&rng);
    uint32_t out = rgba & 0xff;
    for (int shift = 8; shift <= 24; shift += 8) {
        jsl_real x = factor * (jsl_real)(rgba >> shift & 0xff);
        out |= (uint32_t)(x < 255 ? x : 255) << shift;
    }
    return out;
}

static jsl_result build_body(builder *b, json_t *object) {
    scene_body body = {0};
    uint64_t present;
    JSL_TRY(reader_object(&b->reader, object, &table_body, &body, &present));
    JSL_TRY(read_shape(b, body.shape, &body.desc.shape));
    JSL_TRY(find_material(b, body.material, &body.desc.material));
    copies c;
    JSL_TRY(read_copies(b, &body, &c));
    int64_t count = c.nx * c.ny * c.nz, n = 0;
    jsl_body_desc *desc = malloc((size_t)count * sizeof *desc);
    if (!desc)
        return reader_fail(&b->reader, JSL_ERR_MEMORY, "out of memory for %lld bodies",
                           (long long)count);
    for (int64_t z = 0; z < c.nz; z++)
        for (int64_t y = 0; y < c.ny; y++)
            for (int64_t x = 0; x < c.nx; x++) {
                place_copy(&c, &body.desc, x, y, z, &desc[n]);
                if (body.vary > 0)
                    desc[n].rgba = vary_color(body.desc.rgba, body.vary, (uint64_t)n);
                n++;
            }
    jsl_result result = told(b, jsl_body_create_n(b->world, desc, count, NULL));
    free(desc);
    return result;
}

/* -- Emitters
 * -------------------------------------------------------------------------------------------------
 */

static jsl_result read_looks(builder *b, json_t *list, jsl_emitter_desc *desc) {
    if (!list) return JSL_OK;
    JSL_TRY(reader_push_key(&b->reader, "look"));
    if (json_array_size(list) > JSL_PARTICLE_KEYS)
        return reader_fail(&b->reader, JSL_ERR_LIMIT, "at most %d keys", JSL_PARTICLE_KEYS);
    for (size_t i = 0; i < json_array_size(list); i++) {
        scene_look look = {.size = 1, .color = 0xffffffffu};
        JSL_TRY(reader_push_index(&b->reader, i));
        JSL_TRY(reader_object(&b->reader, json_array_get(list, i), &table_look, &look, NULL));
        reader_pop(&b->reader);
        desc->key[desc->key_count++] = (jsl_particle_key){look.at, look.color, look.size};
    }
    reader_pop(&b->reader);
    return JSL_OK;
}

static jsl_result build_emitter(builder *b, json_t *object) {
    scene_emitter e = {0};
    JSL_TRY(reader_object(&b->reader, object, &table_emitter, &e, NULL));
    JSL_TRY(read_looks(b, e.look, &e.desc));
    scene_bounds bounds = {0};
    JSL_TRY(sub(b, "bounds", e.bounds, &table_bounds, &bounds, NULL));
    e.desc.bounds = (jsl_aabb){bounds.lo, bounds.hi};
    jsl_emitter emitter;
    JSL_TRY(told(b, jsl_emitter_create(b->world, &e.desc, &emitter)));
    if (e.burst) JSL_TRY(told(b, jsl_emit(b->world, emitter, e.burst)));
    if (e.desc.additive) b->scene->info.additive = true;
    return JSL_OK;
}

/* -- Flocks
 * ----------------------------------------------------------------------------------------------------
 */

static jsl_result build_leader(builder *b, json_t *object, jsl_flock flock, jsl_entity first) {
    scene_leader leader = {.speed = 5};
    JSL_TRY(reader_push_key(&b->reader, "leader"));
    JSL_TRY(reader_object(&b->reader, object, &table_leader, &leader, NULL));
    jsl_vec3 point[JSL_FLOCK_MAX_WAYPOINTS];
    size_t n = json_array_size(leader.path);
    if (n > JSL_FLOCK_MAX_WAYPOINTS)
        return reader_fail(&b->reader, JSL_ERR_LIMIT, "path: at most %d waypoints",
                           JSL_FLOCK_MAX_WAYPOINTS);
    static const key waypoint = {"waypoint", KEY_VEC3, 0, 0, 0, "m", "", NULL, NULL};
    static const key_table table = {"waypoint", &waypoint, 1};
    JSL_TRY(reader_push_key(&b->reader, "path"));
    for (size_t i = 0; i < n; i++) {
        /* A waypoint is read as the one value of an object, so that its range and its place are
         * told alike. */
        json_t *wrapped = json_pack("{s:O}", "waypoint", json_array_get(leader.path, i));
        if (!wrapped) return reader_fail(&b->reader, JSL_ERR_MEMORY, "out of memory");
        jsl_result result = reader_push_index(&b->reader, i);
        if (result == JSL_OK) result = reader_object(&b->reader, wrapped, &table, &point[i], NULL);
        json_decref(wrapped);
        JSL_TRY(result);
        reader_pop(&b->reader);
    }
    JSL_TRY(told(b, jsl_flock_set_path(b->world, flock, point, (int)n, leader.speed)));
    reader_pop(&b->reader);
    if (jsl_entity_is_null(first))
        return reader_fail(&b->reader, JSL_ERR_STATE, "the flock has no boid that could lead");
    JSL_TRY(told(b, jsl_flock_set_leader(b->world, flock, first)));
    reader_pop(&b->reader);
    return JSL_OK;
}

static jsl_result build_boids(builder *b, const scene_flock *f, jsl_flock flock,
                              jsl_entity *first) {
    scene_boids boids = {0};
    *first = (jsl_entity){0};
    JSL_TRY(reader_push_key(&b->reader, "boids"));
    if (f->boids) JSL_TRY(reader_object(&b->reader, f->boids, &table_boids, &boids, NULL));
    if (boids.count > 0) {
        jsl_entity *entity = malloc((size_t)boids.count * sizeof *entity);
        if (!entity)
            return reader_fail(&b->reader, JSL_ERR_MEMORY, "out of memory for %lld boids",
                               (long long)boids.count);
        jsl_result result =
            told(b, jsl_boid_create_n(b->world, flock, boids.count, &boids.spawn, entity));
        if (result == JSL_OK && f->color)
            result = told(b, jsl_look_set_n(b->world, entity, boids.count, f->color));
        if (result == JSL_OK) *first = entity[0];
        free(entity);
        JSL_TRY(result);
    }
    reader_pop(&b->reader);
    return JSL_OK;
}

static jsl_result build_flock(builder *b, json_t *object) {
    scene_flock f = {0};
    JSL_TRY(reader_object(&b->reader, object, &table_flock, &f, NULL));
    JSL_TRY(sub(b, "separation", f.separation, &table_rule, &f.desc.separation, NULL));
    JSL_TRY(sub(b, "alignment", f.alignment, &table_rule, &f.desc.alignment, NULL));
    JSL_TRY(sub(b, "cohesion", f.cohesion, &table_rule, &f.desc.cohesion, NULL));
    scene_bounds bounds = {0};
    JSL_TRY(sub(b, "bounds", f.bounds, &table_bounds, &bounds, NULL));
    f.desc.bounds_lo = bounds.lo;
    f.desc.bounds_hi = bounds.hi;
    jsl_flock flock;
    JSL_TRY(told(b, jsl_flock_create(b->world, &f.desc, &flock)));
    jsl_entity first;
    JSL_TRY(build_boids(b, &f, flock, &first));
    return f.leader ? build_leader(b, f.leader, flock, first) : JSL_OK;
}

/* -- The whole
 * ---------------------------------------------------------------------------------------------------
 */

static uint64_t hash_scene(const jsl_scene *scene) {
    char *text = json_dumps(scene->root, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    uint64_t hash = text ? jsl_hash_bytes(text, strlen(text), 0) : 0;
    free(text);
    return hash;
}

/* Copies the names: the tree may change before they are used. */
static jsl_result keep_components(builder *b, json_t *list) {
    jsl_scene *scene = b->scene;
    size_t count = json_array_size(list), bytes = 1;
    for (size_t i = 0; i < count; i++) bytes += json_string_length(json_array_get(list, i)) + 1;
    if (count > JSL_MAX_COMPONENTS)
        return reader_fail(&b->reader, JSL_ERR_LIMIT, "publish.components: more than %d",
                           JSL_MAX_COMPONENTS);
    const char **names = calloc(count + 1, sizeof *names);
    char *text = malloc(bytes);
    if (!names || !text) {
        free(names);
        free(text);
        return JSL_ERR_MEMORY;
    }
    scene->component_text = text;
    for (size_t i = 0; i < count; i++) {
        const char *name = json_string_value(json_array_get(list, i));
        names[i] = strcpy(text, name);
        text += strlen(name) + 1;
    }
    scene->info.components = names;
    scene->info.component_count = (int)count;
    return JSL_OK;
}

static jsl_result read_info(builder *b, const scene_root *root) {
    jsl_scene_info *info = &b->scene->info;
    free((void *)info->components);
    free(b->scene->component_text);
    b->scene->component_text = NULL;
    *info = (jsl_scene_info){.seconds = root->seconds, .hash = hash_scene(b->scene)};
    snprintf(info->name, sizeof info->name, "%s", root->name ? root->name : "unnamed");
    scene_camera camera = {0};
    JSL_TRY(sub(b, "camera", root->camera, &table_camera, &camera, NULL));
    info->camera =
        (jsl_frame_camera){{(float)camera.eye.x, (float)camera.eye.y, (float)camera.eye.z},
                           {(float)camera.target.x, (float)camera.target.y, (float)camera.target.z},
                           (float)camera.fov,
                           (float)camera.orbit};
    scene_publish publish = {0};
    JSL_TRY(sub(b, "publish", root->publish, &table_publish, &publish, NULL));
    info->particles_hz = publish.particles_hz;
    info->boids_hz = publish.boids_hz;
    info->bodies_hz = publish.bodies_hz;
    info->components_hz = publish.components_hz;
    return publish.components ? keep_components(b, publish.components) : JSL_OK;
}

static jsl_result make_world(builder *b, const scene_root *root, const jsl_scene_options *options) {
    scene_world w = {.dt = 1.0 / 60, .substeps = 4, .gravity = {0, 0, JSL_R(-9.81)}};
    JSL_TRY(sub(b, "world", root->world, &table_world, &w, NULL));
    jsl_world_desc desc = {.allocator = options->allocator,
                           .logger = {keep_reason, b},
                           .tasks = options->tasks,
                           .workers = options->workers,
                           .isa = options->isa,
                           .seed = (uint64_t)w.seed,
                           .dt = (jsl_real)w.dt,
                           .substeps = w.substeps,
                           .gravity = w.gravity};
    if (root->world) {
        JSL_TRY(reader_push_key(&b->reader, "world"));
        JSL_TRY(sub(b, "wind", w.wind, &table_wind, &desc.wind, NULL));
        reader_pop(&b->reader);
    }
    return told(b, jsl_world_create(&desc, &b->world));
}

static jsl_result build(builder *b, const jsl_scene_options *options) {
    scene_root root = {0};
    JSL_TRY(reader_object(&b->reader, b->scene->root, &table_root, &root, NULL));
    JSL_TRY(read_info(b, &root));
    JSL_TRY(make_world(b, &root, options));
    b->materials = root.materials;
    JSL_TRY(check_materials(b));
    JSL_TRY(each(b, "bodies", root.bodies, build_body));
    JSL_TRY(each(b, "emitters", root.emitters, build_emitter));
    return each(b, "flocks", root.flocks, build_flock);
}

jsl_result jsl_scene_build(jsl_scene *scene, const jsl_scene_options *options, jsl_world **out) {
    static const jsl_scene_options all_defaults = {0};
    if (!scene || !out) return JSL_ERR_ARGUMENT;
    *out = NULL;
    if (!options) options = &all_defaults;
    const jsl_logger *logger = options->logger.write ? &options->logger : &scene->logger;
    builder b = {
        .reader = {.file = scene->name, .text = scene->text, .size = scene->size, .logger = logger},
        .scene = scene};
    jsl_result result = build(&b, options);
    if (result != JSL_OK) {
        jsl_world_destroy(b.world);
        return result;
    }
    jsl_world_set_logger(b.world, logger);
    *out = b.world;
    return JSL_OK;
}
