/* SPDX-License-Identifier: MIT
 * Pictures have the properties that they should have. No golden images: OpenGL promises no exact
 * pixels.
 */
#include "helper.h"

#include "render/renderer.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* OSMesa 22.3 keeps some 270 bytes of every context that is destroyed, whatever the order of calls:
 * not ours to report. */
JSL_API const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libOSMesa\n"; }

#define W 160
#define H 90

/* A frame with room for a few of everything. */
enum { ROOM = 8 };
typedef struct scene {
    jsl_frame frame;
    jsl_frame_shape shape[3];
    float body[7][ROOM], boid[9][ROOM], particle[6][ROOM], size[ROOM];
    int32_t body_shape[ROOM];
    uint32_t body_rgba[ROOM], boid_rgba[ROOM], particle_rgba[ROOM];
} scene;

enum { BALL, CRATE, PLANE };

static void scene_init(scene *s) {
    memset(s, 0, sizeof *s);
    s->shape[BALL] = (jsl_frame_shape){JSL_SHAPE_SPHERE, 0.5f, {0}};
    s->shape[CRATE] = (jsl_frame_shape){JSL_SHAPE_BOX, 0, {0.5f, 0.5f, 0.5f}};
    s->shape[PLANE] = (jsl_frame_shape){JSL_SHAPE_PLANE, 0, {0}};
    jsl_frame *f = &s->frame;
    f->shapes = s->shape;
    f->shape_count = 3;
    f->bodies = (jsl_frame_bodies){0,          s->body[0], s->body[1], s->body[2],    s->body[3],
                                   s->body[4], s->body[5], s->body[6], s->body_shape, s->body_rgba,
                                   NULL};
    f->boids =
        (jsl_frame_boids){0,          s->boid[0], s->boid[1], s->boid[2], s->boid[3],   s->boid[4],
                          s->boid[5], s->boid[6], s->boid[7], s->boid[8], s->boid_rgba, 1};
    f->particles = (jsl_frame_particles){0,
                                         s->particle[0],
                                         s->particle[1],
                                         s->particle[2],
                                         s->particle[3],
                                         s->particle[4],
                                         s->particle[5],
                                         s->size,
                                         s->particle_rgba};
    f->camera = (jsl_frame_camera){{0, -8, 1.5f}, {0, 0, 1}, 45, 0};
}

static int add_body(scene *s, int shape, float x, float y, float z, uint32_t rgba) {
    int i = (int)s->frame.bodies.count++;
    s->body[0][i] = x, s->body[1][i] = y, s->body[2][i] = z, s->body[6][i] = 1;
    s->body_shape[i] = shape;
    s->body_rgba[i] = rgba;
    return i;
}

static int add_particle(scene *s, float x, float y, float z, float size, uint32_t rgba) {
    int i = (int)s->frame.particles.count++;
    s->particle[0][i] = x, s->particle[1][i] = y, s->particle[2][i] = z;
    s->size[i] = size;
    s->particle_rgba[i] = rgba;
    return i;
}

static int add_boid(scene *s, float x, float y, float z, float vx) {
    int i = (int)s->frame.boids.count++;
    s->boid[0][i] = x, s->boid[1][i] = y, s->boid[2][i] = z, s->boid[3][i] = vx;
    s->boid_rgba[i] = 0xff8000ff;
    return i;
}

typedef struct picture {
    uint8_t rgb[H][W][3];
} picture;

static jsl_renderer *renderer(bool text, bool shadows) {
    jsl_renderer *r = NULL;
    jsl_render_desc desc = {.width = W, .height = H, .no_text = !text, .no_shadows = !shadows};
    assert_ok(jsl_renderer_create(&desc, &r));
    assert_non_null(r);
    return r;
}

static void draw(jsl_renderer *r, const scene *s, picture *out) {
    const uint8_t *pixels = NULL;
    assert_ok(jsl_renderer_draw(r, &s->frame, &pixels));
    assert_non_null(pixels);
    memcpy(out, pixels, sizeof *out);
}

/* Means of the 3 x 3 pixels round a place. */
typedef struct color {
    double r, g, b;
} color;
static color at(const picture *p, int x, int y) {
    double sum[3] = {0};
    for (int v = y - 1; v <= y + 1; v++)
        for (int u = x - 1; u <= x + 1; u++)
            for (int c = 0; c < 3; c++) sum[c] += p->rgb[v][u][c];
    return (color){sum[0] / 9, sum[1] / 9, sum[2] / 9};
}
static double brightness(color c) { return (c.r + c.g + c.b) / 3; }

/* One renderer without text serves most tests: making one takes longer than drawing. */
static int setup(void **state) {
    *state = renderer(false, true);
    return 0;
}
static int teardown(void **state) {
    jsl_renderer_destroy(*state);
    return 0;
}

static void an_empty_frame_shows_grey_ground_under_blue_sky(void **state) {
    scene s;
    picture p;
    scene_init(&s);
    draw(*state, &s, &p);
    color sky = at(&p, W / 2, 4), ground = at(&p, W / 2 + 7, H - 8);
    assert_true(sky.b > sky.r + 20);
    assert_true(fabs(ground.b - ground.r) < 15);
    assert_true(fabs(brightness(sky) - brightness(ground)) > 5 || sky.b > ground.b + 10);
    /* The grid: along a row near the camera some pixels are clearly darker than most. */
    int darkest = 255, lightest = 0;
    for (int x = 0; x < W; x++) {
        int v = p.rgb[H - 12][x][1];
        darkest = v < darkest ? v : darkest;
        lightest = v > lightest ? v : lightest;
    }
    assert_true(lightest - darkest > 12);
}

static void without_ground_there_is_sky_all_over(void **state) {
    (void)state;
    scene s;
    picture with, without;
    scene_init(&s);
    jsl_renderer *r = NULL;
    assert_ok(jsl_renderer_create(
        &(jsl_render_desc){.width = W, .height = H, .no_text = true, .no_ground = true}, &r));
    draw(r, &s, &without);
    jsl_renderer_destroy(r);
    draw(*state, &s, &with);
    assert_memory_equal(with.rgb[0], without.rgb[0], sizeof with.rgb[0]);
    assert_memory_not_equal(with.rgb[H - 1], without.rgb[H - 1], sizeof with.rgb[0]);
    /* Below the horizon the sky has one colour. */
    assert_memory_equal(without.rgb[H - 1], without.rgb[H - 10], sizeof without.rgb[0]);
}

static void a_red_sphere_is_red_and_its_shadow_darkens_the_ground(void **state) {
    scene s;
    picture lit, shaded;
    scene_init(&s);
    /* From above: 9 pixels a metre; the sun is at (-0.55, -0.50, 0.82), so the shadow of a ball at
     * 1 m lies at (0.67, 0.61) m, which is pixel (+6, -5.5) from the middle, outside of the ball's
     * own 5 pixels. */
    s.frame.camera = (jsl_frame_camera){{0, 0, 12}, {0, 0, 0}, 45, 0};
    add_body(&s, BALL, 0, 0, 1, 0xe01010ff);
    jsl_renderer *plain = renderer(false, false);
    draw(plain, &s, &lit);
    jsl_renderer_destroy(plain);
    draw(*state, &s, &shaded);
    color ball = at(&shaded, W / 2, H / 2);
    assert_true(ball.r > 2 * ball.g && ball.r > 2 * ball.b && ball.r > 100);
    int x = W / 2 + 6, y = H / 2 - 6;
    assert_true(brightness(at(&shaded, x, y)) < brightness(at(&lit, x, y)) - 25);
    x = W / 2 - 12, y = H / 2 + 12;
    assert_close(brightness(at(&shaded, x, y)), brightness(at(&lit, x, y)), 2);
}

static void bodies_shade_one_another(void **state) {
    scene s;
    picture alone, under;
    scene_init(&s);
    s.frame.camera = (jsl_frame_camera){{0, 0, 12}, {0, 0, 0}, 45, 0};
    add_body(&s, CRATE, 0, 0, 0.5f, 0xc0c0c0ff);
    draw(*state, &s, &alone);
    /* A ball up along the way to the sun from the crate's lid, beside it in the picture. */
    add_body(&s, BALL, -0.55f / 0.82f * 3, -0.50f / 0.82f * 3, 4, 0xc0c0c0ff);
    draw(*state, &s, &under);
    assert_true(brightness(at(&under, W / 2, H / 2)) < brightness(at(&alone, W / 2, H / 2)) - 25);
}

static void the_nearer_body_hides_the_farther(void **state) {
    scene s;
    picture p;
    for (int order = 0; order < 2; order++) {
        scene_init(&s);
        add_body(&s, order ? CRATE : BALL, 0, order ? 0.0f : -2.0f, 1,
                 order ? 0xe01010ff : 0x10c010ff);
        add_body(&s, order ? BALL : CRATE, 0, order ? -2.0f : 0.0f, 1,
                 order ? 0x10c010ff : 0xe01010ff);
        draw(*state, &s, &p);
        color c = at(&p, W / 2, H / 2);
        assert_true(c.g > 1.5 * c.r);
    }
}

static void a_plane_hides_what_is_under_it_but_only_from_above(void **state) {
    scene s;
    picture p;
    scene_init(&s);
    add_body(&s, PLANE, 0, 0, 2, 0);
    add_body(&s, BALL, 0, 0, 1, 0xe01010ff);
    s.frame.camera = (jsl_frame_camera){{0, -4, 5}, {0, 0, 1}, 45, 0};
    draw(*state, &s, &p);
    color above = at(&p, W / 2, H / 2);
    assert_true(above.r < 1.3 * above.g);
    /* From below, through the plane, at a ball above it. */
    s.body[2][1] = 4;
    s.frame.camera = (jsl_frame_camera){{0, -4, 0}, {0, 0, 4}, 45, 0};
    draw(*state, &s, &p);
    color below = at(&p, W / 2, H / 2);
    assert_true(below.r > 1.5 * below.g);
}

static void a_translucent_body_lets_the_one_behind_show(void **state) {
    scene s;
    picture p;
    scene_init(&s);
    add_body(&s, CRATE, 0, -3, 1, 0x1030e080);
    add_body(&s, CRATE, 0, 0, 1, 0xe01010ff);
    draw(*state, &s, &p);
    color both = at(&p, W / 2, H / 2);
    s.body_rgba[0] = 0x1030e0ff;
    draw(*state, &s, &p);
    color front = at(&p, W / 2, H / 2);
    assert_true(both.r > front.r + 25);
    assert_true(both.b > 40);
}

static void particles_blend_by_their_alpha(void **state) {
    scene s;
    picture p;
    double red[4];
    static const uint32_t rgba[4] = {0xff000000, 0xff000050, 0xff0000a0, 0xff0000ff};
    for (int k = 0; k < 4; k++) {
        scene_init(&s);
        s.frame.camera.target[2] = 1.5f;
        add_body(&s, BALL, 0, 0, 1.5f, 0x2040a0ff);
        add_particle(&s, 0, -2, 1.5f, 0.4f, rgba[k]);
        draw(*state, &s, &p);
        color c = at(&p, W / 2, H / 2);
        red[k] = c.r - c.b;
    }
    for (int k = 1; k < 4; k++) assert_true(red[k] > red[k - 1] + 30);
}

static void particles_behind_a_body_do_not_show(void **state) {
    scene s;
    picture without, with;
    scene_init(&s);
    s.frame.camera.target[2] = 1.5f;
    /* The crate is 24 pixels wide; the particle is smaller and behind it. Shadows of particles
     * would show on the ground beside it: there is none to the eye here. */
    add_body(&s, CRATE, 0, 0, 1.5f, 0x2040a0ff);
    draw(*state, &s, &without);
    add_particle(&s, 0, 2, 1.5f, 0.2f, 0xff0000ff);
    draw(*state, &s, &with);
    for (int y = H / 2 - 8; y < H / 2 + 8; y++)
        assert_memory_equal(with.rgb[y][W / 2 - 8], without.rgb[y][W / 2 - 8], 16 * 3);
}

static void glowing_particles_add_light_to_the_night(void **state) {
    scene s;
    picture day, night, one, two;
    scene_init(&s);
    draw(*state, &s, &day);
    s.frame.additive = true;
    draw(*state, &s, &night);
    assert_true(brightness(at(&night, W / 2, H - 5)) < 0.6 * brightness(at(&day, W / 2, H - 5)));
    add_particle(&s, 0, 0, 1, 0.3f, 0x804020ff);
    draw(*state, &s, &one);
    add_particle(&s, 0, 0, 1, 0.3f, 0x804020ff);
    draw(*state, &s, &two);
    double dark = brightness(at(&night, W / 2, H / 2)), light = brightness(at(&one, W / 2, H / 2));
    assert_true(light > dark + 20);
    assert_true(brightness(at(&two, W / 2, H / 2)) > light + 15);
}

static void fast_particles_are_drawn_longer_along_their_way(void **state) {
    scene s;
    picture p;
    scene_init(&s);
    int across[2] = {0}, up[2] = {0};
    for (int k = 0; k < 2; k++) {
        scene_init(&s);
        s.frame.camera = (jsl_frame_camera){{0, -8, 30}, {0, 0, 40}, 45, 0}; /* into the sky */
        int i = add_particle(&s, 0, -4, 35, 0.15f, 0xff0000ff);
        s.particle[3][i] = k ? 60.0f : 0.0f;
        draw(*state, &s, &p);
        for (int x = 0; x < W; x++) across[k] += p.rgb[H / 2][x][0] > p.rgb[H / 2][x][2] + 30;
        for (int y = 0; y < H; y++) up[k] += p.rgb[y][W / 2][0] > p.rgb[y][W / 2][2] + 30;
    }
    assert_true(across[0] > 0 && up[0] > 0);
    assert_true(across[1] > 2 * across[0]);
    assert_true(up[1] <= up[0] + 1);
}

static void sprites_are_ordered_from_far_to_near(void **state) {
    scene s;
    picture p;
    scene_init(&s);
    for (int k = 0; k < ROOM; k++) add_particle(&s, 0, (float)(k * 5 % 8) - 4, 1, 0.1f, 0xffffff80);
    draw(*state, &s, &p);
    const jsl_renderer *r = *state;
    assert_i64(r->sprite_vertices.count, 3 * ROOM);
    for (int k = 1; k < ROOM; k++)
        assert_true(r->sprite_vertices.at[3 * k].clip[3] <
                    r->sprite_vertices.at[3 * k - 3].clip[3]);
}

static void particles_together_darken_the_ground(void **state) {
    scene s;
    picture bare, shaded;
    scene_init(&s);
    s.frame.camera = (jsl_frame_camera){{0, 0, 12}, {0, 0, 0}, 45, 0};
    draw(*state, &s, &bare);
    for (int k = 0; k < ROOM; k++) add_particle(&s, -0.1f, -0.1f, 2, 0.25f, 0xffffffff);
    draw(*state, &s, &shaded);
    /* Falls at 2 m times (0.67, 0.61), that is 12 and 11 pixels off. */
    int x = W / 2 + 11, y = H / 2 - 10;
    assert_true(brightness(at(&shaded, x, y)) < brightness(at(&bare, x, y)) - 8);
}

static void boids_bank_into_their_turns(void **state) {
    scene s;
    picture empty, p;
    scene_init(&s);
    draw(*state, &s, &empty);
    int straight = add_boid(&s, 0, 0, 1, 5), left = add_boid(&s, 0, 2, 2, 5);
    s.boid[7][left] = 9.81f; /* to its left, as strong as gravity: 45 degrees */
    draw(*state, &s, &p);
    assert_memory_not_equal(&p, &empty, sizeof p);
    const jsl_renderer *r = *state;
    assert_close(r->birds.at[straight].above[2], 1, 1e-6);
    assert_close(r->birds.at[left].above[1], sqrt(0.5), 1e-6);
    assert_close(r->birds.at[left].above[2], sqrt(0.5), 1e-6);
    assert_close(r->birds.at[left].ahead[0], 1, 1e-6);
}

static void a_bird_that_stands_or_dives_has_an_attitude(void **state) {
    scene s;
    picture p;
    scene_init(&s);
    add_boid(&s, 0, 0, 1, 0);
    int dive = add_boid(&s, 0, 2, 2, 0);
    s.boid[5][dive] = -8;
    draw(*state, &s, &p);
    const jsl_renderer *r = *state;
    for (int i = 0; i < 2; i++) {
        const float *a = r->birds.at[i].ahead, *u = r->birds.at[i].above;
        assert_close(a[0] * a[0] + a[1] * a[1] + a[2] * a[2], 1, 1e-5);
        assert_close(u[0] * u[0] + u[1] * u[1] + u[2] * u[2], 1, 1e-5);
        assert_close(a[0] * u[0] + a[1] * u[1] + a[2] * u[2], 0, 1e-5);
    }
}

static void a_camera_that_looks_away_sees_only_sky(void **state) {
    scene s;
    picture empty, p;
    scene_init(&s);
    s.frame.camera = (jsl_frame_camera){{0, 0, 5}, {0, 0, 10}, 45, 0};
    draw(*state, &s, &empty);
    add_body(&s, CRATE, 0, 0, 1, 0xe01010ff);
    add_boid(&s, 1, 0, 1, 3);
    add_particle(&s, 2, 0, 1, 0.1f, 0xff0000ff);
    draw(*state, &s, &p);
    assert_memory_equal(&p, &empty, sizeof p);
}

static void kinds_without_positions_are_left_out(void **state) {
    scene s;
    picture empty, p;
    scene_init(&s);
    draw(*state, &s, &empty);
    s.frame.bodies = (jsl_frame_bodies){.count = 100};
    s.frame.boids = (jsl_frame_boids){.count = 100};
    s.frame.particles = (jsl_frame_particles){.count = 100};
    s.frame.shapes = NULL;
    draw(*state, &s, &p);
    assert_memory_equal(&p, &empty, sizeof p);
    s.frame.bodies.count = s.frame.boids.count = s.frame.particles.count = -5;
    draw(*state, &s, &p);
    assert_memory_equal(&p, &empty, sizeof p);
}

static void columns_that_are_absent_have_defaults(void **state) {
    scene s;
    picture empty, p;
    scene_init(&s);
    draw(*state, &s, &empty);
    add_body(&s, BALL, 0, 0, 1, 0);
    add_boid(&s, 1, 0, 1, 0);
    add_particle(&s, -1, 0, 1, 0, 0);
    jsl_frame *f = &s.frame;
    f->bodies.qx = f->bodies.qy = f->bodies.qz = f->bodies.qw = NULL;
    f->bodies.rgba = f->boids.rgba = f->particles.rgba = NULL;
    f->boids.vx = f->boids.vy = f->boids.vz = f->boids.ax = f->boids.ay = f->boids.az = NULL;
    f->particles.vx = f->particles.vy = f->particles.vz = f->particles.size = NULL;
    draw(*state, &s, &p);
    const jsl_renderer *r = *state;
    assert_i64(r->bodies_drawn, 1);
    assert_i64(r->birds_drawn, 1);
    assert_i64(r->sprites.count, 1);
    assert_memory_not_equal(p.rgb[H / 2], empty.rgb[H / 2], sizeof p.rgb[0]);
    f->bodies.shape = NULL; /* without a shape there is no body to see */
    draw(*state, &s, &p);
    assert_i64(r->bodies_drawn, 0);
}

static void three_things(scene *s) {
    scene_init(s);
    add_body(s, BALL, 0, 0, 1, 0xe01010ff);
    add_boid(s, 1, 0, 1, 3);
    add_particle(s, -1, 0, 1, 0.1f, 0xff0000ff);
}

static void damaged_elements_are_left_out_and_the_rest_is_drawn(void **state) {
    scene s;
    picture whole, p;
    three_things(&s);
    draw(*state, &s, &whole);
    static const float bad[] = {NAN, INFINITY, -INFINITY, 3e38f};
    for (int k = 0; k < JSL_COUNT(bad); k++) {
        three_things(&s);
        add_body(&s, BALL, bad[k], 0, 1, 0xffffffff);
        int zero = add_body(&s, CRATE, 0, -1, 1, 0xffffffff);
        s.body[6][zero] = 0;
        int turn = add_body(&s, CRATE, 0, -1, 1, 0xffffffff);
        s.body[5][turn] = bad[k];
        add_body(&s, 3, 0, -1, 1, 0xffffffff);
        add_body(&s, -1, 0, -1, 1, 0xffffffff);
        add_boid(&s, 0, bad[k], 1, 3);
        add_particle(&s, 0, 0, bad[k], 0.1f, 0x00ff00ff);
        add_particle(&s, 0, 0, 1, bad[k], 0x00ff00ff);
        draw(*state, &s, &p);
        assert_memory_equal(&p, &whole, sizeof p);
    }
}

static void damaged_settings_do_no_harm(void **state) {
    scene s;
    picture p;
    scene_init(&s);
    add_body(&s, BALL, 0, 0, 1, 0xe01010ff);
    add_boid(&s, 1, 0, 1, 3);
    s.shape[CRATE].half[1] = NAN;
    s.shape[PLANE].kind = (jsl_shape_kind)77;
    add_body(&s, CRATE, 0, -1, 1, 0);
    add_body(&s, PLANE, 0, -1, 1, 0);
    s.frame.time = NAN;
    s.frame.boids.length = NAN;
    s.boid[6][0] = NAN;
    s.frame.camera = (jsl_frame_camera){{NAN, 0, 0}, {0, INFINITY, 0}, NAN, NAN};
    draw(*state, &s, &p);
    const jsl_renderer *r = *state;
    assert_i64(r->bodies_drawn, 1);
    /* The camera was unusable, so one was chosen: the ball is in the picture. */
    int red = 0;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) red += p.rgb[y][x][0] > 2 * p.rgb[y][x][1];
    assert_true(red > 50);
}

static void text_stands_in_the_corner_and_nowhere_else(void **state) {
    scene s;
    picture plain, lettered;
    scene_init(&s);
    s.frame.scene = "unit";
    draw(*state, &s, &plain);
    jsl_renderer *r = renderer(true, true);
    draw(r, &s, &lettered);
    jsl_renderer_destroy(r);
    int white = 0;
    for (int y = 0; y < 30; y++)
        for (int x = 0; x < W; x++) white += lettered.rgb[y][x][1] > 230;
    assert_true(white > 40);
    assert_memory_equal(plain.rgb[H / 2], lettered.rgb[H / 2], sizeof plain.rgb / 2);
}

static void any_text_is_drawn_without_harm(void **state) {
    (void)state;
    scene s;
    picture p;
    char name[300];
    scene_init(&s);
    for (int k = 0; k < 299; k++) name[k] = (char)(k + 1);
    name[299] = 0;
    s.frame.scene = name;
    s.frame.time = 1e300;
    s.frame.step = INT64_MIN;
    jsl_renderer *r = renderer(true, true);
    draw(r, &s, &p);
    jsl_renderer_destroy(r);
}

static void the_same_frame_gives_the_same_picture(void **state) {
    scene s;
    picture first, other, again;
    three_things(&s);
    draw(*state, &s, &first);
    s.frame.additive = true;
    draw(*state, &s, &other);
    s.frame.additive = false;
    draw(*state, &s, &again);
    assert_memory_equal(&first, &again, sizeof first);
}

typedef struct job {
    picture out;
    jsl_result result;
    int rounds;
} job;

static void *draw_in_thread(void *arg) {
    job *j = arg;
    for (int k = 0; k < j->rounds && j->result == JSL_OK; k++) {
        scene s;
        scene_init(&s);
        add_body(&s, BALL, 0, 0, 1, 0xe01010ff);
        add_body(&s, CRATE, 1, 1, 0.5f, 0x10e010ff);
        add_boid(&s, -1, 0, 1, 3);
        add_particle(&s, -1, 0, 1, 0.1f, 0xff0000ff);
        jsl_renderer *r = NULL;
        jsl_render_desc desc = {.width = W, .height = H};
        const uint8_t *pixels = NULL;
        j->result = jsl_renderer_create(&desc, &r);
        if (j->result == JSL_OK) j->result = jsl_renderer_draw(r, &s.frame, &pixels);
        if (j->result == JSL_OK) memcpy(&j->out, pixels, sizeof j->out);
        jsl_renderer_destroy(r);
    }
    return NULL;
}

static void renderers_in_several_threads_draw_the_same(void **state) {
    (void)state;
    static const int rounds = 3;
    job alone = {.rounds = 1}, *many = calloc(3, sizeof *many);
    pthread_t thread[3];
    assert_non_null(many);
    for (int k = 0; k < 3; k++) {
        many[k].rounds = rounds;
        assert_int_equal(pthread_create(&thread[k], NULL, draw_in_thread, &many[k]), 0);
    }
    for (int k = 0; k < 3; k++) pthread_join(thread[k], NULL);
    draw_in_thread(&alone);
    assert_ok(alone.result);
    for (int k = 0; k < 3; k++) {
        assert_ok(many[k].result);
        assert_memory_equal(&many[k].out, &alone.out, sizeof alone.out);
    }
    free(many);
}

static void two_renderers_in_one_thread_take_turns(void **state) {
    scene s;
    picture first, second;
    scene_init(&s);
    add_body(&s, BALL, 0, 0, 1, 0xe01010ff);
    jsl_renderer *other = renderer(false, true);
    draw(*state, &s, &first);
    draw(other, &s, &second);
    assert_memory_equal(&first, &second, sizeof first);
    jsl_renderer_destroy(other);
    draw(*state, &s, &second);
    assert_memory_equal(&first, &second, sizeof first);
}

static void settings_out_of_range_are_refused(void **state) {
    (void)state;
    static const jsl_render_desc bad[] = {{.width = 15, .height = 90},
                                          {.width = 160, .height = 8193},
                                          {.width = -1, .height = 90},
                                          {.width = 160, .height = 0},
                                          {.width = 160, .height = 90, .samples = 17},
                                          {.width = 160, .height = 90, .samples = -1}};
    for (int k = 0; k < JSL_COUNT(bad); k++) {
        test_log log = {0};
        jsl_render_desc desc = bad[k];
        desc.logger = test_logger(&log);
        jsl_renderer *r = (jsl_renderer *)&log; /* must stay */
        assert_result(jsl_renderer_create(&desc, &r), JSL_ERR_ARGUMENT);
        assert_ptr_equal(r, &log);
        assert_int_equal(log.lines, 1);
    }
    assert_result(jsl_renderer_create(NULL, NULL), JSL_ERR_ARGUMENT);
}

static void bad_calls_are_refused(void **state) {
    scene s;
    const uint8_t *pixels = NULL;
    scene_init(&s);
    assert_result(jsl_renderer_draw(NULL, &s.frame, &pixels), JSL_ERR_HANDLE);
    assert_result(jsl_renderer_draw(*state, NULL, &pixels), JSL_ERR_ARGUMENT);
    assert_result(jsl_renderer_draw(*state, &s.frame, NULL), JSL_ERR_ARGUMENT);
    s.frame.particles.count = INT64_MAX;
    assert_result(jsl_renderer_draw(*state, &s.frame, &pixels), JSL_ERR_LIMIT);
    assert_null(pixels);
    jsl_renderer_destroy(NULL);
    assert_int_equal(jsl_renderer_width(*state), W);
    assert_int_equal(jsl_renderer_height(*state), H);
    assert_int_equal(jsl_renderer_width(NULL), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_frame_shows_grey_ground_under_blue_sky),
        cmocka_unit_test(without_ground_there_is_sky_all_over),
        cmocka_unit_test(a_red_sphere_is_red_and_its_shadow_darkens_the_ground),
        cmocka_unit_test(bodies_shade_one_another),
        cmocka_unit_test(the_nearer_body_hides_the_farther),
        cmocka_unit_test(a_plane_hides_what_is_under_it_but_only_from_above),
        cmocka_unit_test(a_translucent_body_lets_the_one_behind_show),
        cmocka_unit_test(particles_blend_by_their_alpha),
        cmocka_unit_test(particles_behind_a_body_do_not_show),
        cmocka_unit_test(glowing_particles_add_light_to_the_night),
        cmocka_unit_test(fast_particles_are_drawn_longer_along_their_way),
        cmocka_unit_test(sprites_are_ordered_from_far_to_near),
        cmocka_unit_test(particles_together_darken_the_ground),
        cmocka_unit_test(boids_bank_into_their_turns),
        cmocka_unit_test(a_bird_that_stands_or_dives_has_an_attitude),
        cmocka_unit_test(a_camera_that_looks_away_sees_only_sky),
        cmocka_unit_test(kinds_without_positions_are_left_out),
        cmocka_unit_test(columns_that_are_absent_have_defaults),
        cmocka_unit_test(damaged_elements_are_left_out_and_the_rest_is_drawn),
        cmocka_unit_test(damaged_settings_do_no_harm),
        cmocka_unit_test(text_stands_in_the_corner_and_nowhere_else),
        cmocka_unit_test(any_text_is_drawn_without_harm),
        cmocka_unit_test(the_same_frame_gives_the_same_picture),
        cmocka_unit_test(renderers_in_several_threads_draw_the_same),
        cmocka_unit_test(two_renderers_in_one_thread_take_turns),
        cmocka_unit_test(settings_out_of_range_are_refused),
        cmocka_unit_test(bad_calls_are_refused),
    };
    return cmocka_run_group_tests_name("render", tests, setup, teardown);
}
