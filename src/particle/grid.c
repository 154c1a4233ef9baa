/* SPDX-License-Identifier: MIT
 * A uniform grid over everything finite and solid, so that a particle looks only at what is around
 * it. Floor 4.
 *
 * Beside a bounding volume tree a grid wins here: one lookup rejects most particles, and it is the
 * same work for scattered rows as for neighbouring ones. The boxes already hold one step's motion.
 */
#include "particle/room.h"

#define MAX_CELLS (1 << 18)

void jsl_particle_grid_free(jsl_memory *memory, jsl_particle_grid *grid) {
    jsl_array_free(memory, &grid->near);
    jsl_array_free(memory, &grid->start);
    jsl_array_free(memory, &grid->item);
    jsl_array_free(memory, &grid->box);
    jsl_array_free(memory, &grid->first);
    jsl_array_free(memory, &grid->size);
    *grid = (jsl_particle_grid){0};
}

static bool box_is_usable(jsl_aabb b) {
    return jsl_v3_is_finite(b.lo) && jsl_v3_is_finite(b.hi) && b.lo.x <= b.hi.x &&
           b.lo.y <= b.hi.y && b.lo.z <= b.hi.z;
}

static bool same_boxes(const jsl_particle_grid *grid, const jsl_collider_set *set) {
    return grid->box.count == set->finite.count &&
           (!set->finite.count || memcmp(grid->box.at, set->finite_box.at,
                                         (size_t)grid->box.count * sizeof(jsl_aabb)) == 0);
}

/* The median over boxes of the largest side: neither one huge floor nor many crumbs decide. */
static jsl_real median_side(jsl_particle_grid *grid) {
    int64_t n = 0;
    jsl_real *side = grid->size.at;
    for (int64_t i = 0; i < grid->box.count; i++) {
        jsl_aabb b = grid->box.at[i];
        if (!box_is_usable(b)) continue;
        jsl_vec3 d = jsl_sub(b.hi, b.lo);
        side[n++] = jsl_max(d.x, jsl_max(d.y, d.z));
    }
    /* Quickselect with the middle as pivot; equal results whatever the order of equals. */
    int64_t lo = 0, hi = n - 1, k = n / 2;
    while (lo < hi) {
        jsl_real pivot = side[lo + (hi - lo) / 2];
        int64_t i = lo, j = hi;
        while (i <= j) {
            while (side[i] < pivot) i++;
            while (side[j] > pivot) j--;
            if (i <= j) {
                jsl_real t = side[i];
                side[i++] = side[j];
                side[j--] = t;
            }
        }
        if (k <= j)
            hi = j;
        else if (k >= i)
            lo = i;
        else
            break;
    }
    return n ? side[k] : 0;
}

/* The most cells that so many boxes are given. */
static int64_t max_cells(int64_t boxes) {
    int64_t limit = boxes * 64 < 16384 ? 16384 : boxes * 64;
    return limit < MAX_CELLS ? limit : MAX_CELLS;
}

static void choose_cells(jsl_particle_grid *grid) {
    jsl_aabb all = {{0, 0, 0}, {-1, 0, 0}};
    int64_t usable = 0;
    for (int64_t i = 0; i < grid->box.count; i++) {
        jsl_aabb b = grid->box.at[i];
        if (!box_is_usable(b)) continue;
        if (!usable++) all = b;
        all.lo =
            jsl_v3(jsl_min(all.lo.x, b.lo.x), jsl_min(all.lo.y, b.lo.y), jsl_min(all.lo.z, b.lo.z));
        all.hi =
            jsl_v3(jsl_max(all.hi.x, b.hi.x), jsl_max(all.hi.y, b.hi.y), jsl_max(all.hi.z, b.hi.z));
    }
    grid->n[0] = grid->n[1] = grid->n[2] = 0;
    if (!usable) return;
    /* Half a box: finer cells turn more particles away, coarser ones are filled faster. */
    jsl_real cell = jsl_max(JSL_R(0.5) * median_side(grid), JSL_R(1e-6));
    double limit = (double)max_cells(usable);
    jsl_vec3 d = jsl_sub(all.hi, all.lo);
    for (;; cell *= JSL_R(1.25)) {
        double x = floor((double)d.x / (double)cell) + 6, y = floor((double)d.y / (double)cell) + 6;
        double z = floor((double)d.z / (double)cell) + 6;
        if (x * y * z > limit) continue;
        grid->n[0] = (int32_t)x;
        grid->n[1] = (int32_t)y;
        grid->n[2] = (int32_t)z;
        break;
    }
    grid->cell = cell;
    grid->inv_cell = 1 / cell;
    grid->origin = jsl_sub(all.lo, jsl_v3(2 * cell, 2 * cell, 2 * cell));
}

static jsl_cells grown(const jsl_particle_grid *grid, jsl_cells c) {
    for (int a = 0; a < 3; a++) {
        if (c.lo[a] > 0) c.lo[a]--;
        if (c.hi[a] < grid->n[a] - 1) c.hi[a]++;
    }
    return c;
}

static inline int64_t cell_index(const jsl_particle_grid *grid, int32_t x, int32_t y, int32_t z) {
    return ((int64_t)z * grid->n[1] + y) * grid->n[0] + x;
}

/* Counting sort of the items by cell: ascending items within a cell. */
static jsl_result fill_cells(jsl_memory *memory, jsl_particle_grid *grid) {
    int64_t cells = (int64_t)grid->n[0] * grid->n[1] * grid->n[2];
    /* Room for as many as there may ever be: boxes that drift apart take no memory. */
    JSL_TRY(jsl_array_reserve(memory, &grid->start, max_cells(grid->box.count) + 1));
    JSL_TRY(jsl_array_reserve(memory, &grid->near, max_cells(grid->box.count)));
    JSL_TRY(jsl_array_reserve(memory, &grid->first, grid->box.count));
    memset(grid->start.at, 0, (size_t)(cells + 1) * sizeof(int32_t));
    memset(grid->near.at, 0, (size_t)cells);
    int32_t *start = grid->start.at;
    for (int64_t i = 0; i < grid->box.count; i++) {
        if (!box_is_usable(grid->box.at[i])) continue;
        jsl_cells r = grid->first.at[i] = jsl_particle_grid_cells(grid, grid->box.at[i]);
        for (int32_t z = r.lo[2]; z <= r.hi[2]; z++)
            for (int32_t y = r.lo[1]; y <= r.hi[1]; y++)
                for (int32_t x = r.lo[0]; x <= r.hi[0]; x++) start[cell_index(grid, x, y, z)]++;
        r = grown(grid, r);
        for (int32_t z = r.lo[2]; z <= r.hi[2]; z++)
            for (int32_t y = r.lo[1]; y <= r.hi[1]; y++)
                memset(grid->near.at + cell_index(grid, r.lo[0], y, z), 1,
                       (size_t)(r.hi[0] - r.lo[0] + 1));
    }
    int32_t sum = 0;
    for (int64_t c = 0; c <= cells; c++) {
        sum += start[c];
        start[c] = sum; /* the end of cell c; filling from behind turns it into the beginning */
    }
    JSL_TRY(jsl_array_reserve(memory, &grid->item, sum));
    for (int64_t i = grid->box.count - 1; i >= 0; i--) {
        if (!box_is_usable(grid->box.at[i])) continue;
        jsl_cells r = grid->first.at[i];
        for (int32_t z = r.lo[2]; z <= r.hi[2]; z++)
            for (int32_t y = r.lo[1]; y <= r.hi[1]; y++)
                for (int32_t x = r.lo[0]; x <= r.hi[0]; x++)
                    grid->item.at[--start[cell_index(grid, x, y, z)]] = (int32_t)i;
    }
    grid->near.count = cells;
    grid->start.count = cells + 1;
    grid->item.count = sum;
    return JSL_OK;
}

jsl_result jsl_particle_grid_build(jsl_memory *memory, jsl_particle_grid *grid,
                                   const jsl_collider_set *set) {
    int64_t count = set ? set->finite.count : 0;
    if (count == 0) {
        grid->n[0] = grid->n[1] = grid->n[2] = 0;
        grid->box.count = 0;
        return JSL_OK;
    }
    if (grid->n[0] && same_boxes(grid, set)) return JSL_OK;
    grid->n[0] = 0;
    JSL_TRY(jsl_array_reserve(memory, &grid->box, count));
    JSL_TRY(jsl_array_reserve(memory, &grid->size, count));
    memcpy(grid->box.at, set->finite_box.at, (size_t)count * sizeof(jsl_aabb));
    grid->box.count = count;
    choose_cells(grid);
    if (!grid->n[0]) return JSL_OK;
    jsl_result result = fill_cells(memory, grid);
    if (result != JSL_OK) grid->n[0] = 0;
    return result;
}

bool jsl_particle_grid_meets(const jsl_particle_grid *g, jsl_aabb box) {
    jsl_cells c = jsl_particle_grid_cells(g, box);
    if (jsl_particle_cells_count(&c) > 4 * g->box.count) {
        for (int64_t j = 0; j < g->box.count; j++)
            if (jsl_aabb_meet(box, g->box.at[j])) return true;
        return false;
    }
    for (int32_t z = c.lo[2]; z <= c.hi[2]; z++)
        for (int32_t y = c.lo[1]; y <= c.hi[1]; y++) {
            /* The items of neighbours along x lie together. */
            int64_t first = cell_index(g, c.lo[0], y, z), last = cell_index(g, c.hi[0], y, z);
            for (int32_t k = g->start.at[first]; k < g->start.at[last + 1]; k++)
                if (jsl_aabb_meet(box, g->box.at[g->item.at[k]])) return true;
        }
    return false;
}
