/* SPDX-License-Identifier: MIT
 * The scene format, key by key: name, kind, where it goes, range, unit, meaning. The reader, the
 * JSON Schema and the messages all come from here.
 */
#include "scene/tables.h"

#define BIG 1e30
#define TINY 1e-12
/* K(name, kind, struct, member, lo, hi, unit, doc) */
#define K(name, kind, type, member, lo, hi, unit, doc)                                             \
    { name, kind, offsetof(type, member), lo, hi, unit, doc, NULL, NULL }
#define SUB(name, kind, type, member, table, doc)                                                  \
    { name, kind, offsetof(type, member), 0, 0, "", doc, &table, NULL }
#define CHOICE(name, type, member, words, doc)                                                     \
    { name, KEY_CHOICE, offsetof(type, member), 0, 0, "", doc, NULL, words }
#define TABLE(id, what, rows) const key_table id = {what, rows, JSL_COUNT(rows)}

static const key root_keys[] = {
    K("name", KEY_NAME, scene_root, name, 0, 0, "", "name of the scene"),
    K("description", KEY_NAME, scene_root, description, 0, 0, "", "what it shows"),
    K("seconds", KEY_DOUBLE, scene_root, seconds, 0, BIG, "s", "how long to simulate"),
    SUB("world", KEY_OBJECT, scene_root, world, table_world, "settings of the whole world"),
    SUB("camera", KEY_OBJECT, scene_root, camera, table_camera,
        "where pictures look from; default: to see everything"),
    SUB("publish", KEY_OBJECT, scene_root, publish, table_publish,
        "how often what is logged and published"),
    SUB("materials", KEY_MAP, scene_root, materials, table_material, "surfaces by name"),
    SUB("bodies", KEY_LIST, scene_root, bodies, table_body, "rigid bodies"),
    SUB("emitters", KEY_LIST, scene_root, emitters, table_emitter, "sources of particles"),
    SUB("flocks", KEY_LIST, scene_root, flocks, table_flock, "flocks of boids"),
};
TABLE(table_root, "scene", root_keys);

static const key world_keys[] = {
    K("dt", KEY_DOUBLE, scene_world, dt, TINY, 1e6, "s",
      "step; a number or a fraction such as \"1/60\" (1/60)"),
    K("substeps", KEY_INT32, scene_world, substeps, 1, 1024, "", "parts of a step (4)"),
    K("gravity", KEY_VEC3, scene_world, gravity, 0, 0, "m/s^2", "([0, 0, -9.81])"),
    K("seed", KEY_INT, scene_world, seed, 0, 9e18, "", "of all random numbers (0)"),
    SUB("wind", KEY_OBJECT, scene_world, wind, table_wind, "moving air (none)"),
};
TABLE(table_world, "world", world_keys);

static const key wind_keys[] = {
    K("velocity", KEY_VEC3, jsl_wind, velocity, 0, 0, "m/s", "mean"),
    K("gust_direction", KEY_VEC3, jsl_wind, gust_direction, 0, 0, "", "(along velocity)"),
    K("gust", KEY_REAL, jsl_wind, gust, 0, 1e6, "m/s", "largest departure from the mean (0)"),
    K("gust_period", KEY_REAL, jsl_wind, gust_period, 0, 1e6, "s",
      "of the slowest of three sines (5)"),
};
TABLE(table_wind, "wind", wind_keys);

static const key camera_keys[] = {
    K("eye", KEY_VEC3, scene_camera, eye, 0, 0, "m", "where the camera is"),
    K("target", KEY_VEC3, scene_camera, target, 0, 0, "m", "what it looks at"),
    K("fov", KEY_REAL, scene_camera, fov, 1, 170, "degrees", "vertical field of view (45)"),
    K("orbit", KEY_REAL, scene_camera, orbit, -10, 10, "1/s",
      "turns per second about the vertical through target (0)"),
};
TABLE(table_camera, "camera", camera_keys);

static const key publish_keys[] = {
    K("particles_hz", KEY_DOUBLE, scene_publish, particles_hz, -1, 1e6, "Hz",
      "frames per simulated second; -1: never (30)"),
    K("boids_hz", KEY_DOUBLE, scene_publish, boids_hz, -1, 1e6, "Hz", "(60)"),
    K("bodies_hz", KEY_DOUBLE, scene_publish, bodies_hz, -1, 1e6, "Hz", "(60)"),
    K("components", KEY_NAMES, scene_publish, components, 0, 0, "",
      "components whose fields are published (those that a program adds)"),
    K("components_hz", KEY_DOUBLE, scene_publish, components_hz, -1, 1e6, "Hz", "(10)"),
};
TABLE(table_publish, "publish", publish_keys);

static const key material_keys[] = {
    K("friction", KEY_REAL, jsl_material_desc, friction, 0, BIG, "",
      "Coulomb's coefficient; pairs use sqrt(a b) (0.6)"),
    K("restitution", KEY_REAL, jsl_material_desc, restitution, 0, 1, "",
      "pairs use the larger (0)"),
};
TABLE(table_material, "material", material_keys);

static const key shape_keys[] = {
    K("sphere", KEY_REAL, scene_shape, sphere, TINY, BIG, "m", "a ball of this radius"),
    K("box", KEY_VEC3, scene_shape, box, TINY, BIG, "m", "a box with these sides"),
    SUB("capsule", KEY_OBJECT, scene_shape, capsule, table_capsule,
        "a segment along its z axis, made round"),
    K("plane", KEY_BOOL, scene_shape, plane, 0, 0, "",
      "everything below z = 0 of its frame; static only"),
};
TABLE(table_shape, "shape (exactly one of sphere, box, capsule, plane)", shape_keys);

static const key capsule_keys[] = {
    K("radius", KEY_REAL, scene_capsule, radius, TINY, BIG, "m", ""),
    K("length", KEY_REAL, scene_capsule, length, TINY, BIG, "m",
      "of the segment, without the caps"),
};
TABLE(table_capsule, "capsule", capsule_keys);

static const key grid_keys[] = {
    K("count", KEY_VEC3, scene_grid, count, 1, 1e6, "", "copies along x, y, z"),
    K("spacing", KEY_VEC3, scene_grid, spacing, 0, 0, "m", "from copy to copy"),
};
TABLE(table_grid, "grid", grid_keys);

static const key ring_keys[] = {
    K("count", KEY_INT, scene_ring, count, 1, 1e6, "",
      "copies in a ring about the vertical through position"),
    K("radius", KEY_REAL, scene_ring, radius, 0, BIG, "m", "of the ring"),
    K("layers", KEY_INT, scene_ring, layers, 1, 1e6, "", "rings upon one another (1)"),
    K("rise", KEY_REAL, scene_ring, rise, 0, 0, "m", "from layer to layer"),
    K("stagger", KEY_REAL, scene_ring, stagger, -1, 1, "",
      "turn from layer to layer, in shares of the step from copy to copy (0.5)"),
};
TABLE(table_ring, "ring", ring_keys);

static const char *const body_kinds[] = {"dynamic", "static", "kinematic", NULL};
static const key body_keys[] = {
    SUB("shape", KEY_OBJECT, scene_body, shape, table_shape, "required"),
    CHOICE("kind", scene_body, desc.kind, body_kinds, "(dynamic)"),
    K("position", KEY_VEC3, scene_body, desc.position, 0, 0, "m", "of the centre of mass"),
    K("orientation", KEY_QUAT, scene_body, desc.orientation, 0, 0, "", "quaternion [x, y, z, w]"),
    K("turn", KEY_TURN, scene_body, desc.orientation, 0, 0, "", "the same as [x, y, z, degrees]"),
    K("velocity", KEY_VEC3, scene_body, desc.velocity, 0, 0, "m/s", ""),
    K("spin", KEY_VEC3, scene_body, desc.spin, 0, 0, "rad/s", "in the world's frame"),
    K("mass", KEY_REAL, scene_body, desc.mass, TINY, BIG, "kg", "(from density)"),
    K("density", KEY_REAL, scene_body, desc.density, TINY, BIG, "kg/m^3", "(1000)"),
    K("material", KEY_NAME, scene_body, material, 0, 0, "",
      "name of a material (friction 0.6, restitution 0)"),
    K("color", KEY_COLOR, scene_body, desc.rgba, 0, 0, "", "\"#rrggbb\" or \"#rrggbbaa\""),
    K("vary", KEY_REAL, scene_body, vary, 0, 1, "",
      "brightness of copies differs by up to this share (0)"),
    K("no_gravity", KEY_BOOL, scene_body, desc.no_gravity, 0, 0, "", ""),
    K("linear_damping", KEY_REAL, scene_body, desc.linear_damping, 0, 1e6, "1/s", "(0)"),
    K("angular_damping", KEY_REAL, scene_body, desc.angular_damping, 0, 1e6, "1/s", "(0)"),
    SUB("grid", KEY_OBJECT, scene_body, grid, table_grid, "copies on a grid"),
    SUB("ring", KEY_OBJECT, scene_body, ring, table_ring,
        "copies in rings, each turned to face outward"),
};
TABLE(table_body, "body", body_keys);

static const key look_keys[] = {
    K("at", KEY_REAL, scene_look, at, 0, 1, "", "share of the life that has passed"),
    K("color", KEY_COLOR, scene_look, color, 0, 0, "", "\"#rrggbb\" or \"#rrggbbaa\""),
    K("size", KEY_REAL, scene_look, size, 0, BIG, "", "factor on the size at birth (1)"),
};
TABLE(table_look, "look", look_keys);

static const key bounds_keys[] = {
    K("lo", KEY_VEC3, scene_bounds, lo, 0, 0, "m", "lowest corner"),
    K("hi", KEY_VEC3, scene_bounds, hi, 0, 0, "m", "highest corner"),
};
TABLE(table_bounds, "bounds", bounds_keys);

static const char *const emit_modes[] = {
#define JSL_X(code, text) text,
    JSL_EMIT_MODES(JSL_X)
#undef JSL_X
        NULL};
static const char *const emitter_shapes[] = {
#define JSL_X(code, text) text,
    JSL_EMITTER_SHAPES(JSL_X)
#undef JSL_X
        NULL};
static const char *const integrators[] = {
#define JSL_X(code, text) text,
    JSL_PARTICLE_INTEGRATORS(JSL_X)
#undef JSL_X
        NULL};
static const key emitter_keys[] = {
    K("position", KEY_VEC3, scene_emitter, desc.position, 0, 0, "m", ""),
    K("orientation", KEY_QUAT, scene_emitter, desc.orientation, 0, 0, "",
      "quaternion [x, y, z, w]"),
    K("turn", KEY_TURN, scene_emitter, desc.orientation, 0, 0, "",
      "the same as [x, y, z, degrees]"),
    K("velocity", KEY_VEC3, scene_emitter, desc.velocity, 0, 0, "m/s", "of the emitter"),
    CHOICE("shape", scene_emitter, desc.shape, emitter_shapes, "where births happen (point)"),
    K("extent", KEY_VEC3, scene_emitter, desc.extent, 0, BIG, "m",
      "half length, radius or half sides of the shape"),
    CHOICE("mode", scene_emitter, desc.mode, emit_modes, "how births are counted (steady)"),
    K("rate", KEY_REAL, scene_emitter, desc.rate, 0, 1e12, "1/s", "births per second (0)"),
    K("rate_range", KEY_REAL, scene_emitter, desc.rate_range, 0, 1e12, "1/s",
      "reeves: rate + U(-1,1) rate_range"),
    K("rate_frame", KEY_REAL, scene_emitter, desc.rate_frame, TINY, 1e6, "s",
      "reeves: how long one draw holds (1/24)"),
    K("burst", KEY_INT, scene_emitter, burst, 0, 1e9, "", "births at the start (0)"),
    K("max_particles", KEY_INT, scene_emitter, desc.max_particles, 1, 1e9, "",
      "alive at once (1000000)"),
    K("direction", KEY_VEC3, scene_emitter, desc.direction, 0, 0, "",
      "axis of the cone ([0, 0, 1])"),
    K("cone", KEY_DEGREES, scene_emitter, desc.cone, 0, 180, "degrees", "half angle (0)"),
    K("speed", KEY_REAL, scene_emitter, desc.speed, 0, 0, "m/s", "(0)"),
    K("speed_range", KEY_REAL, scene_emitter, desc.speed_range, 0, BIG, "m/s",
      "each x_range: x + U(-1,1) x_range"),
    K("inherit", KEY_REAL, scene_emitter, desc.inherit, 0, 1, "",
      "share of the emitter's velocity (0)"),
    K("life", KEY_REAL, scene_emitter, desc.life, 0, BIG, "s", "0: for ever (0)"),
    K("life_range", KEY_REAL, scene_emitter, desc.life_range, 0, BIG, "s", ""),
    K("size", KEY_REAL, scene_emitter, desc.size, 0, BIG, "m", "radius (0.05)"),
    K("size_range", KEY_REAL, scene_emitter, desc.size_range, 0, BIG, "m", ""),
    CHOICE("integrator", scene_emitter, desc.integrator, integrators, "(exponential)"),
    K("buoyancy", KEY_REAL, scene_emitter, desc.buoyancy, 0, 0, "",
      "share of the weight that the air carries (0)"),
    K("drag", KEY_REAL, scene_emitter, desc.drag, 0, 1e9, "1/s", "v' = drag (wind - v) (0)"),
    K("wind", KEY_REAL, scene_emitter, desc.wind, 0, 1, "", "share of the wind that it feels (0)"),
    K("restitution", KEY_REAL, scene_emitter, desc.restitution, 0, 1, "", "(0)"),
    K("friction", KEY_REAL, scene_emitter, desc.friction, 0, BIG, "", "(0)"),
    K("contact_size", KEY_REAL, scene_emitter, desc.contact_size, 0, 1, "",
      "radius in collisions as a share of size (0)"),
    K("ghost", KEY_BOOL, scene_emitter, desc.ghost, 0, 0, "", "collides with nothing"),
    SUB("bounds", KEY_OBJECT, scene_emitter, bounds, table_bounds, "particles outside are removed"),
    SUB("look", KEY_LIST, scene_emitter, look, table_look,
        "colour and size over life, at most 8 keys"),
    K("additive", KEY_BOOL, scene_emitter, desc.additive, 0, 0, "",
      "adds light instead of covering"),
};
TABLE(table_emitter, "emitter", emitter_keys);

static const key rule_keys[] = {
    K("radius", KEY_REAL, scene_rule, rule.radius, 0, 1e9, "m", "who counts"),
    K("half_angle", KEY_DEGREES, scene_rule, rule.half_angle, 0, 180, "degrees",
      "of the view cone; 0: all round"),
    K("weight", KEY_REAL, scene_rule, rule.weight, 0, 1e9, "", "how much"),
};
TABLE(table_rule, "rule", rule_keys);

static const key boids_keys[] = {
    K("count", KEY_INT, scene_boids, count, 0, 1e9, "", "how many"),
    K("centre", KEY_VEC3, scene_boids, spawn.centre, 0, 0, "m", "where they start"),
    K("radius", KEY_REAL, scene_boids, spawn.radius, 0, BIG, "m", "in a ball"),
    K("half", KEY_VEC3, scene_boids, spawn.half, 0, BIG, "m", "or in a box with these half sides"),
    K("velocity", KEY_VEC3, scene_boids, spawn.velocity, 0, 0, "m/s", "mean"),
    K("velocity_spread", KEY_REAL, scene_boids, spawn.velocity_spread, 0, BIG, "m/s", ""),
};
TABLE(table_boids, "boids", boids_keys);

static const key leader_keys[] = {
    K("path", KEY_LIST, scene_leader, path, 0, 0, "m",
      "waypoints [x, y, z] of a closed path, 3 to 32"),
    K("speed", KEY_REAL, scene_leader, speed, TINY, 1e9, "m/s", "along the path"),
};
TABLE(table_leader, "leader", leader_keys);

static const char *const negotiations[] = {"priority", "blend", NULL};
static const char *const responses[] = {"direction", "mean", "sum", NULL};
static const key flock_keys[] = {
    SUB("boids", KEY_OBJECT, scene_flock, boids, table_boids, "who is in it"),
    SUB("separation", KEY_OBJECT, scene_flock, separation, table_rule,
        "away from those near (OpenSteer's rule set when no rule is given)"),
    SUB("alignment", KEY_OBJECT, scene_flock, alignment, table_rule, "the same way as those near"),
    SUB("cohesion", KEY_OBJECT, scene_flock, cohesion, table_rule,
        "towards the middle of those near"),
    K("near_distance", KEY_REAL, scene_flock, desc.near_distance, 0, 1e9, "m",
      "nearer ones count even when not seen"),
    K("max_speed", KEY_REAL, scene_flock, desc.max_speed, TINY, 1e9, "m/s", "(9)"),
    K("min_speed", KEY_REAL, scene_flock, desc.min_speed, 0, 1e9, "m/s", "(0)"),
    K("max_accel", KEY_REAL, scene_flock, desc.max_accel, TINY, 1e9, "m/s^2",
      "the budget that is negotiated (36)"),
    CHOICE("negotiation", scene_flock, desc.negotiation, negotiations, "(priority)"),
    CHOICE("response", scene_flock, desc.response, responses, "(direction)"),
    K("period", KEY_INT32, scene_flock, desc.period, 1, 64, "steps",
      "decide every period-th step (1)"),
    K("urge", KEY_VEC3, scene_flock, desc.urge, 0, 0, "m/s^2", "migratory urge"),
    K("ignore_obstacles", KEY_BOOL, scene_flock, desc.ignore_obstacles, 0, 0, "", ""),
    K("avoid_horizon", KEY_REAL, scene_flock, desc.avoid_horizon, TINY, 1e6, "s",
      "react to hits sooner than this (2)"),
    K("avoid_margin", KEY_REAL, scene_flock, desc.avoid_margin, TINY, 1e6, "m",
      "room to leave beside an obstacle (0.5)"),
    K("boid_radius", KEY_REAL, scene_flock, desc.boid_radius, 0, 1e6, "m", "(0)"),
    SUB("bounds", KEY_OBJECT, scene_flock, bounds, table_bounds, "box they are kept in"),
    K("bounds_weight", KEY_REAL, scene_flock, desc.bounds_weight, TINY, 1e9, "1/s^2", "(4)"),
    K("leader_weight", KEY_REAL, scene_flock, desc.leader_weight, TINY, 1e9, "1/s",
      "how firmly they follow (1)"),
    K("leader_gap", KEY_REAL, scene_flock, desc.leader_gap, 0, 1e9, "m",
      "how far behind the leader they aim (0)"),
    SUB("leader", KEY_OBJECT, scene_flock, leader, table_leader,
        "the first boid runs along a path"),
    K("color", KEY_COLOR, scene_flock, color, 0, 0, "", "of its boids"),
};
TABLE(table_flock, "flock", flock_keys);
