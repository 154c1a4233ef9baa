/* SPDX-License-Identifier: MIT
 * arena.c - bump allocation of one step's scratch.
 *
 * The blocks form a list, in the order in which they fill. arena->block is the one being filled;
 * blocks that a rewind emptied stay in the list as its newer neighbours and are taken again before
 * memory is asked for more.
 */
#include "base/base.h"

struct jsl_arena_block {
    jsl_arena_block *older, *newer;
    int64_t cap, used; /* bytes after the header, multiples of JSL_ALIGN */
};

#define HEADER JSL_ALIGN
#define FIRST_BLOCK ((int64_t)64 * 1024)

_Static_assert(sizeof(struct jsl_arena_block) <= HEADER, "block header outgrew its cache line");

static char *block_data(jsl_arena_block *block) { return (char *)block + HEADER; }

static jsl_arena_block *block_new(jsl_memory *memory, int64_t cap) {
    jsl_arena_block *block = jsl_alloc(memory, (size_t)(cap + HEADER));
    if (block) *block = (jsl_arena_block){.cap = cap};
    return block;
}

static void free_blocks(jsl_arena *arena) {
    jsl_arena_block *block = arena->block;
    while (block && block->newer) block = block->newer;
    while (block) {
        jsl_arena_block *older = block->older;
        jsl_free(arena->memory, block, (size_t)(block->cap + HEADER));
        block = older;
    }
    arena->block = NULL;
}

void jsl_arena_init(jsl_arena *arena, jsl_memory *memory) {
    *arena = (jsl_arena){.memory = memory};
}

void jsl_arena_fini(jsl_arena *arena) {
    free_blocks(arena);
    arena->used = 0;
}

/* Makes arena->block a block with room for size bytes; false when memory is out. */
static bool make_room(jsl_arena *arena, int64_t size) {
    jsl_arena_block *at = arena->block;
    if (at && at->cap - at->used >= size) return true;
    if (at && at->newer && at->newer->cap >= size) {
        arena->block = at->newer;
        return true;
    }
    /* Doubling keeps a step that grows for ever at a logarithmic number of blocks. */
    int64_t cap = at ? 2 * at->cap : FIRST_BLOCK;
    jsl_arena_block *block = block_new(arena->memory, cap > size ? cap : size);
    if (!block && cap > size) block = block_new(arena->memory, size);
    if (!block) return false;
    block->older = at;
    if (at) {
        block->newer = at->newer;
        if (at->newer) at->newer->older = block;
        at->newer = block;
    }
    arena->block = block;
    return true;
}

void *jsl_arena_alloc(jsl_arena *arena, int64_t size) {
    if (size < 0 || size > INT64_MAX / 4) return NULL;
    size = jsl_round_up(size, JSL_ALIGN);
    /* Of zero bytes any aligned address will do; it must only not look like a failure. */
    if (size == 0) return (void *)(uintptr_t)JSL_ALIGN;
    if (!make_room(arena, size)) return NULL;
    void *ptr = block_data(arena->block) + arena->block->used;
    arena->block->used += size;
    arena->used += size;
    if (arena->used > arena->peak) arena->peak = arena->used;
    return ptr;
}

void *jsl_arena_zero(jsl_arena *arena, int64_t size) {
    void *ptr = jsl_arena_alloc(arena, size);
    if (ptr && size > 0) memset(ptr, 0, (size_t)size);
    return ptr;
}

jsl_arena_mark jsl_arena_save(const jsl_arena *arena) {
    return (jsl_arena_mark){arena->block, arena->block ? arena->block->used : 0, arena->used};
}

void jsl_arena_rewind(jsl_arena *arena, jsl_arena_mark mark) {
    JSL_ASSERT(mark.used <= arena->used);
    /* A mark of the empty arena has no block: rewind to the oldest. */
    while (arena->block && arena->block != mark.block) {
        arena->block->used = 0;
        if (!arena->block->older) break;
        arena->block = arena->block->older;
    }
    if (arena->block) arena->block->used = mark.block_used;
    arena->used = mark.used;
}

void jsl_arena_reset(jsl_arena *arena) {
    jsl_arena_block *block = arena->block;
    arena->used = 0;
    if (!block) return;
    if (!block->older && !block->newer) {
        block->used = 0;
        return;
    }
    /* Not smaller than the largest block: a peak that creeps up by a little every step then costs a
     * block only each time it doubles. */
    int64_t cap = arena->peak;
    while (block->newer) block = block->newer;
    for (; block; block = block->older) cap = block->cap > cap ? block->cap : cap;
    free_blocks(arena);
    arena->block = block_new(arena->memory, cap);
}
