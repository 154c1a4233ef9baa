/* SPDX-License-Identifier: MIT
 * alloc.c - checked allocation over the host's hook, with accounts.
 */
#include "base/base.h"

#include <stdlib.h>
#if defined(__linux__)
#include <sys/mman.h>
#endif

#define HUGE_PAGE ((size_t)2 << 20)

/* Columns of a million rows touch a new page of 4 KiB every hundred rows or so, and its fault costs
 * more than filling it. So large blocks ask for huge pages; where the system has none to give, they
 * are blocks like any other. */
static void *libc_alloc(size_t size, size_t align, void *ctx) {
    (void)ctx;
    void *ptr = NULL;
    if (align < sizeof(void *)) align = sizeof(void *);
    if (size >= HUGE_PAGE && align < HUGE_PAGE) align = HUGE_PAGE;
    if (posix_memalign(&ptr, align, size) != 0) return NULL;
#if defined(MADV_HUGEPAGE)
    if (size >= HUGE_PAGE) (void)madvise(ptr, size / HUGE_PAGE * HUGE_PAGE, MADV_HUGEPAGE);
#endif
    return ptr;
}

static void libc_free(void *ptr, size_t size, void *ctx) {
    (void)size, (void)ctx;
    free(ptr);
}

jsl_result jsl_memory_init(jsl_memory *memory, jsl_allocator hook) {
    if (!hook.alloc != !hook.free) return JSL_ERR_ARGUMENT;
    *memory = (jsl_memory){.hook = hook};
    if (!hook.alloc) memory->hook = (jsl_allocator){libc_alloc, libc_free, NULL};
    return JSL_OK;
}

void *jsl_alloc(jsl_memory *memory, size_t size) {
    /* More than half the address space is a computation gone wrong; refusing it here keeps our
     * signed accounts from overflowing. */
    if (size == 0 || size > PTRDIFF_MAX) return NULL;
    void *ptr = memory->hook.alloc(size, JSL_ALIGN, memory->hook.ctx);
    if (!ptr) return NULL;
    memory->live_bytes += (int64_t)size;
    if (memory->live_bytes > memory->peak_bytes) memory->peak_bytes = memory->live_bytes;
    memory->live_blocks++;
    memory->calls++;
    return ptr;
}

void *jsl_alloc_zero(jsl_memory *memory, size_t size) {
    void *ptr = jsl_alloc(memory, size);
    if (ptr) memset(ptr, 0, size);
    return ptr;
}

void jsl_free(jsl_memory *memory, void *ptr, size_t size) {
    if (!ptr) return;
    memory->live_bytes -= (int64_t)size;
    memory->live_blocks--;
    JSL_ASSERT(memory->live_bytes >= 0 && memory->live_blocks >= 0);
    memory->hook.free(ptr, size, memory->hook.ctx);
}

jsl_result jsl_realloc(jsl_memory *memory, void **ptr, size_t old_size, size_t new_size) {
    if (new_size == old_size) return JSL_OK;
    void *fresh = NULL;
    if (new_size > 0) {
        fresh = jsl_alloc(memory, new_size);
        if (!fresh) return JSL_ERR_MEMORY;
        size_t kept = old_size < new_size ? old_size : new_size;
        if (*ptr && kept) memcpy(fresh, *ptr, kept);
    }
    jsl_free(memory, *ptr, old_size);
    *ptr = fresh;
    return JSL_OK;
}

jsl_result jsl_array_reserve_(jsl_memory *memory, void **at, int64_t *cap, int64_t n, size_t size) {
    if (n <= *cap) return JSL_OK;
    int64_t limit = (int64_t)((size_t)PTRDIFF_MAX / size);
    if (n > limit) return JSL_ERR_MEMORY;
    int64_t grown = *cap > limit - *cap / 2 ? limit : *cap + *cap / 2;
    if (grown < 16 && limit >= 16) grown = 16;
    if (grown < n) grown = n;
    JSL_TRY(jsl_realloc(memory, at, (size_t)*cap * size, (size_t)grown * size));
    *cap = grown;
    return JSL_OK;
}
