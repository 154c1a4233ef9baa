/* SPDX-License-Identifier: MIT
 * The bounding volume tree: binned surface-area build (Wald 2007, "On fast construction of
 * SAH-based bounding volume hierarchies") along the longest axis of the centres, refit, overlap and
 * all pairs.
 */
#include "geometry/geometry.h"

/* Splits by area go MAX_SKEW levels down, then by halves: a tree is never deeper than 40 + 31
 * levels. */
enum { BINS = 8, FEW = 8, MAX_SKEW = 40, STACK = 128 };

static jsl_aabb empty_box(void) {
    const jsl_real far = JSL_R(3e38);
    return (jsl_aabb){{far, far, far}, {-far, -far, -far}};
}
static jsl_aabb unite(jsl_aabb a, jsl_aabb b) {
    return (jsl_aabb){{jsl_min(a.lo.x, b.lo.x), jsl_min(a.lo.y, b.lo.y), jsl_min(a.lo.z, b.lo.z)},
                      {jsl_max(a.hi.x, b.hi.x), jsl_max(a.hi.y, b.hi.y), jsl_max(a.hi.z, b.hi.z)}};
}
/* Half the surface. */
static jsl_real area(jsl_aabb b) {
    jsl_real x = b.hi.x - b.lo.x, y = b.hi.y - b.lo.y, z = b.hi.z - b.lo.z;
    return x * y + (y * z + z * x);
}
static jsl_real part(jsl_vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
/* Twice the centre. */
static jsl_real centre(const jsl_aabb *b, int axis) {
    return part(b->lo, axis) + part(b->hi, axis);
}

void jsl_bvh_free(jsl_memory *memory, jsl_bvh *bvh) {
    jsl_array_free(memory, &bvh->node);
    jsl_array_free(memory, &bvh->item);
}

/* -- Build
 * -------------------------------------------------------------------------------------------------
 */

typedef struct split {
    int axis, bin; /* bins below `bin` go left */
    jsl_real origin, scale;
} split;

static int bin_of(const split *s, const jsl_aabb *box) {
    jsl_real x = (centre(box, s->axis) - s->origin) * s->scale;
    return !(x > 0) ? 0 : x >= BINS ? BINS - 1 : (int)x; /* 0 for NaN */
}

/* The cheapest of the 7 planes between bins. False when the centres cannot be told apart. */
static bool find_split(const jsl_bvh_item *item, int32_t n, split *out) {
    jsl_aabb centres = empty_box();
    for (int32_t i = 0; i < n; i++) {
        jsl_vec3 c = jsl_add(item[i].box.lo, item[i].box.hi);
        centres = unite(centres, (jsl_aabb){c, c});
    }
    jsl_vec3 size = jsl_sub(centres.hi, centres.lo);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    jsl_real scale = (jsl_real)BINS / part(size, axis);
    if (!(part(size, axis) > 0) || !jsl_is_finite(scale)) return false;
    *out = (split){axis, 0, part(centres.lo, axis), scale};

    if (n <= FEW) { /* the middle will do: the outermost centres lie on either side of it */
        out->bin = BINS / 2;
        return true;
    }
    jsl_aabb box[BINS];
    int32_t count[BINS] = {0};
    for (int i = 0; i < BINS; i++) box[i] = empty_box();
    for (int32_t i = 0; i < n; i++) {
        int b = bin_of(out, &item[i].box);
        box[b] = unite(box[b], item[i].box);
        count[b]++;
    }
    jsl_real right_cost[BINS];
    jsl_aabb sum = empty_box();
    int32_t items = 0;
    for (int i = BINS - 1; i > 0; i--) {
        sum = unite(sum, box[i]);
        items += count[i];
        right_cost[i] = items ? area(sum) * (jsl_real)items : 0;
    }
    sum = empty_box();
    jsl_real best = 0;
    items = 0;
    for (int i = 1; i < BINS; i++) {
        sum = unite(sum, box[i - 1]);
        items += count[i - 1];
        if (items == 0 || items == n) continue;
        jsl_real cost = area(sum) * (jsl_real)items + right_cost[i];
        if (out->bin == 0 || cost < best) best = cost, out->bin = i;
    }
    return out->bin > 0;
}

/* Left ones first; returns their number. Deterministic, not stable. */
static int32_t partition(jsl_bvh_item *item, int32_t n, const split *s) {
    int32_t i = 0, j = n - 1;
    for (;;) {
        while (i <= j && bin_of(s, &item[i].box) < s->bin) i++;
        while (i <= j && bin_of(s, &item[j].box) >= s->bin) j--;
        if (i >= j) return i;
        jsl_bvh_item swap = item[i];
        item[i++] = item[j];
        item[j--] = swap;
    }
}

/* Fills nodes from `at` on for n items and returns the first free one. */
static int32_t build(jsl_bvh *bvh, jsl_bvh_item *item, int32_t n, int32_t at, int depth) {
    jsl_bvh_node *node = &bvh->node.at[at];
    if (n == 1) {
        *node = (jsl_bvh_node){item->box, -1 - item->item, 0};
        return at + 1;
    }
    split s;
    int32_t left = n / 2;
    if (n > 2 && depth < MAX_SKEW && find_split(item, n, &s)) left = partition(item, n, &s);
    if (left == 0 || left == n) left = n / 2; /* centres that are not numbers */
    node->left = at + 1;
    node->right = build(bvh, item, left, at + 1, depth + 1);
    int32_t end = build(bvh, item + left, n - left, node->right, depth + 1);
    node->box = unite(bvh->node.at[node->left].box, bvh->node.at[node->right].box);
    return end;
}

jsl_result jsl_bvh_build(jsl_memory *memory, jsl_bvh *bvh, const jsl_aabb *box, int64_t count) {
    if (count < 0 || count > INT32_MAX / 2) return JSL_ERR_LIMIT;
    JSL_TRY(jsl_array_reserve(memory, &bvh->node, 2 * count));
    JSL_TRY(jsl_array_reserve(memory, &bvh->item, count));
    for (int32_t i = 0; i < count; i++) bvh->item.at[i] = (jsl_bvh_item){box[i], i};
    bvh->item.count = count;
    bvh->node.count = count ? build(bvh, bvh->item.at, (int32_t)count, 0, 0) : 0;
    return JSL_OK;
}

void jsl_bvh_refit(jsl_bvh *bvh, const jsl_aabb *box, int64_t count) {
    JSL_ASSERT(bvh->item.count == count);
    (void)count;
    /* Children come after their parents. */
    for (int64_t i = bvh->node.count - 1; i >= 0; i--) {
        jsl_bvh_node *node = &bvh->node.at[i];
        node->box = node->left < 0
                        ? box[-1 - node->left]
                        : unite(bvh->node.at[node->left].box, bvh->node.at[node->right].box);
    }
}

/* -- Questions
 * ------------------------------------------------------------------------------------------------
 */

int64_t jsl_bvh_overlap(const jsl_bvh *bvh, jsl_aabb box, int32_t *item, int64_t cap) {
    int32_t stack[STACK], top = 0;
    int64_t found = 0;
    if (bvh->node.count > 0) stack[top++] = 0;
    while (top > 0) {
        const jsl_bvh_node *node = &bvh->node.at[stack[--top]];
        if (!jsl_aabb_meet(node->box, box)) continue;
        if (node->left < 0) {
            if (found < cap) item[found] = -1 - node->left;
            found++;
            continue;
        }
        JSL_ASSERT(top + 2 <= STACK);
        stack[top++] = node->right;
        stack[top++] = node->left;
    }
    return found;
}

typedef struct pair_walk {
    jsl_memory *memory;
    const jsl_bvh_node *node;
    jsl_pair_array *out;
    jsl_result result;
} pair_walk;

/* All pairs of an item under a and one under b, whose boxes are known to meet. */
static void cross(pair_walk *walk, int32_t a, int32_t b) {
    const jsl_bvh_node *na = &walk->node[a], *nb = &walk->node[b];
    if (na->left < 0 && nb->left < 0) {
        jsl_pair_array *out = walk->out;
        if (out->count == out->cap) {
            jsl_result r = jsl_array_reserve(walk->memory, out, out->count + 1);
            if (r != JSL_OK) {
                walk->result = r;
                return;
            }
        }
        int32_t i = -1 - na->left, j = -1 - nb->left;
        out->at[out->count++] = i < j ? (jsl_pair){i, j} : (jsl_pair){j, i};
        return;
    }
    if (walk->result != JSL_OK) return;
    if (nb->left < 0 || (na->left >= 0 && area(na->box) >= area(nb->box))) {
        if (jsl_aabb_meet(walk->node[na->left].box, nb->box)) cross(walk, na->left, b);
        if (jsl_aabb_meet(walk->node[na->right].box, nb->box)) cross(walk, na->right, b);
    } else {
        if (jsl_aabb_meet(na->box, walk->node[nb->left].box)) cross(walk, a, nb->left);
        if (jsl_aabb_meet(na->box, walk->node[nb->right].box)) cross(walk, a, nb->right);
    }
}

/* Two stable counting passes, by b and then by a. The scratch lies behind the pairs in the array
 * itself, so that a caller who keeps the array allocates nothing later. */
static jsl_result sort_pairs(jsl_memory *memory, jsl_pair_array *out, int64_t first,
                             int64_t items) {
    int64_t n = out->count - first, words = (items + 2) / 2;
    if (n < 2) return JSL_OK;
    JSL_TRY(jsl_array_reserve(memory, out, out->count + n + words));
    jsl_pair *from = out->at + first, *to = from + n;
    int32_t *start = (int32_t *)(void *)(to + n);
    for (int pass = 0; pass < 2; pass++) {
        memset(start, 0, (size_t)(items + 1) * sizeof *start);
        for (int64_t i = 0; i < n; i++) start[(pass ? from[i].a : from[i].b) + 1]++;
        for (int64_t i = 0; i < items; i++) start[i + 1] += start[i];
        for (int64_t i = 0; i < n; i++) to[start[pass ? from[i].a : from[i].b]++] = from[i];
        jsl_pair *swap = from;
        from = to, to = swap;
    }
    return JSL_OK;
}

jsl_result jsl_bvh_pairs(jsl_memory *memory, const jsl_bvh *bvh, const jsl_aabb *box, int64_t count,
                         jsl_pair_array *out) {
    (void)box; /* the leaves hold the boxes */
    int64_t first = out->count;
    pair_walk walk = {memory, bvh->node.at, out, JSL_OK};
    /* Children under one parent, for every parent: each pair of items meets at exactly one. */
    for (int64_t i = 0; i < bvh->node.count && walk.result == JSL_OK; i++) {
        const jsl_bvh_node *node = &bvh->node.at[i];
        if (node->left < 0) continue;
        if (jsl_aabb_meet(bvh->node.at[node->left].box, bvh->node.at[node->right].box))
            cross(&walk, node->left, node->right);
    }
    if (walk.result == JSL_OK && out->count - first > INT32_MAX) walk.result = JSL_ERR_LIMIT;
    if (walk.result == JSL_OK) walk.result = sort_pairs(memory, out, first, count);
    if (walk.result != JSL_OK) out->count = first;
    return walk.result;
}
