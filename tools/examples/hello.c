/* SPDX-License-Identifier: MIT
 * The program of the README: a box falls, a fountain plays.
 *   cc hello.c $(pkg-config --cflags --libs jostle) -o hello
 */
#include <jostle/jostle.h>
#include <stdio.h>

int main(void) {
    jsl_world *world;
    if (jsl_world_create(&(jsl_world_desc){.gravity = {0, 0, JSL_R(-9.81)}}, &world)) return 1;
    jsl_shape ground, cube;
    jsl_shape_create(world, &(jsl_shape_desc){.kind = JSL_SHAPE_PLANE}, &ground);
    jsl_shape_create(world, &(jsl_shape_desc){.kind = JSL_SHAPE_BOX, .half = {.5, .5, .5}}, &cube);
    jsl_body_create(world, &(jsl_body_desc){.shape = ground, .kind = JSL_BODY_STATIC}, NULL);
    jsl_body box;
    jsl_body_create(world, &(jsl_body_desc){.shape = cube, .position = {0, 0, 5}}, &box);
    jsl_emitter fountain;
    jsl_emitter_create(world, &(jsl_emitter_desc){.rate = 1000, .speed = 8, .life = 2}, &fountain);

    for (int i = 0; i < 180; i++) jsl_step(world, 0, NULL); /* 3 s in steps of 1/60 s */

    jsl_body_state state;
    int64_t particles;
    jsl_body_get(world, box, &state);
    jsl_emitter_alive(world, fountain, &particles);
    printf("box at z = %.3f m, %lld particles\n", (double)state.pose.position.z,
           (long long)particles);
    jsl_world_destroy(world);
}
