/* SPDX-License-Identifier: MIT
 * impulse.c - the impulse of two bodies that meet in one point: the lecture's formula, as it
 * stands.
 */
#include "rigid/rigid.h"

static jsl_vec3 inverse_inertia(const jsl_impulse_body *b, jsl_vec3 v) {
    jsl_vec3 local = jsl_rotate_inv(b->orientation, v), i = b->inv_inertia;
    return jsl_rotate(b->orientation, jsl_v3(i.x * local.x, i.y * local.y, i.z * local.z));
}

jsl_real jsl_impulse_two_bodies(jsl_impulse_body *a, jsl_impulse_body *b, jsl_vec3 point,
                                jsl_vec3 normal, jsl_real restitution) {
    jsl_vec3 ra = jsl_sub(point, a->position), rb = jsl_sub(point, b->position);
    jsl_vec3 va = jsl_add(a->velocity, jsl_cross(a->spin, ra));
    jsl_vec3 vb = jsl_add(b->velocity, jsl_cross(b->spin, rb));
    jsl_real vn = jsl_dot(normal, jsl_sub(va, vb));
    if (!(vn < 0)) return 0;
    jsl_vec3 ta = inverse_inertia(a, jsl_cross(ra, normal)),
             tb = inverse_inertia(b, jsl_cross(rb, normal));
    jsl_real k = a->inv_mass + b->inv_mass + jsl_dot(normal, jsl_cross(ta, ra)) +
                 jsl_dot(normal, jsl_cross(tb, rb));
    if (!(k > 0)) return 0; /* two immovable bodies */
    jsl_real j = -(1 + restitution) * vn / k;
    a->velocity = jsl_mul_add(a->velocity, j * a->inv_mass, normal);
    b->velocity = jsl_mul_add(b->velocity, -j * b->inv_mass, normal);
    a->spin = jsl_mul_add(a->spin, j, ta);
    b->spin = jsl_mul_add(b->spin, -j, tb);
    return j;
}
