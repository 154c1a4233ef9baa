/* SPDX-License-Identifier: MIT
 * Contact of any two shapes: canonical order, dispatch, and back.
 */
#include "geometry/collide.h"

static int compare(jsl_real a, jsl_real b) { return (a > b) - (a < b); }

/* Two of a kind have no natural order, so one is made that rocking and sliding do not upset: by
 * size, then by the side of A on which B lies along the longest coordinate of their offset, and
 * last by orientation. Digits of a number in base 3 rather than branches: the outcome is a coin's.
 */
static bool out_of_order(const jsl_shape_desc *a, jsl_quat qa, const jsl_shape_desc *b, jsl_quat qb,
                         jsl_vec3 p) {
    if (a->kind != b->kind) return a->kind > b->kind;
    jsl_real x = jsl_abs(p.x), y = jsl_abs(p.y), z = jsl_abs(p.z);
    jsl_real xy = y >= x ? p.y : p.x, most = z >= x && z >= y ? p.z : xy;
    int c = 81 * compare(b->half.x, a->half.x) + 27 * compare(b->half.y, a->half.y) +
            9 * compare(b->half.z, a->half.z) + 3 * compare(b->radius, a->radius) -
            compare(most, 0);
    if (c) return c > 0;
    c = 27 * compare(qa.x, qb.x) + 9 * compare(qa.y, qb.y) + 3 * compare(qa.z, qb.z) +
        compare(qa.w, qb.w);
    return c > 0;
}

static uint32_t swap_feature(uint32_t f) { return f << 16 | f >> 16; }

void jsl_collide(const jsl_shape_desc *a, jsl_pose pose_a, const jsl_shape_desc *b, jsl_pose pose_b,
                 jsl_real margin, jsl_manifold *out) {
    static jsl_collide_fn *const table[JSL_SHAPE_KIND_COUNT][JSL_SHAPE_KIND_COUNT] = {
        [JSL_SHAPE_SPHERE] = {[JSL_SHAPE_SPHERE] = jsl_collide_sphere_sphere,
                              [JSL_SHAPE_BOX] = jsl_collide_sphere_box,
                              [JSL_SHAPE_CAPSULE] = jsl_collide_sphere_capsule,
                              [JSL_SHAPE_PLANE] = jsl_collide_sphere_plane},
        [JSL_SHAPE_BOX] = {[JSL_SHAPE_BOX] = jsl_collide_box_box,
                           [JSL_SHAPE_CAPSULE] = jsl_collide_box_capsule,
                           [JSL_SHAPE_PLANE] = jsl_collide_box_plane},
        [JSL_SHAPE_CAPSULE] = {[JSL_SHAPE_CAPSULE] = jsl_collide_capsule_capsule,
                               [JSL_SHAPE_PLANE] = jsl_collide_capsule_plane},
    };
    out->count = 0;
    out->normal = jsl_v3(0, 0, 0);
    if ((unsigned)a->kind >= JSL_SHAPE_KIND_COUNT || (unsigned)b->kind >= JSL_SHAPE_KIND_COUNT)
        return;
    jsl_vec3 p = jsl_sub(pose_b.position, pose_a.position);
    bool swap = out_of_order(a, pose_a.orientation, b, pose_b.orientation, p);
    jsl_pair_in in = {a, b, pose_a.orientation, pose_b.orientation, p, margin};
    jsl_vec3 origin = pose_a.position;
    if (swap) {
        in = (jsl_pair_in){b, a, pose_b.orientation, pose_a.orientation, jsl_neg(p), margin};
        origin = pose_b.position;
    }
    jsl_collide_fn *fn = table[in.a->kind][in.b->kind];
    if (!fn) return;
    fn(&in, out);
    for (int i = 0; i < out->count; i++) {
        out->point[i] = jsl_add(origin, out->point[i]);
        if (swap) out->feature[i] = swap_feature(out->feature[i]);
    }
    if (swap) out->normal = jsl_neg(out->normal);
}
