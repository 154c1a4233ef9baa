/* SPDX-License-Identifier: MIT
 * map.c - u64 -> u32 by open addressing and linear probing. A removal shifts the run behind it
 * back, so there are no tombstones and lookups do not slow down with age.
 */
#include "base/base.h"

#define SMALLEST 16

static int64_t home(const jsl_map *map, uint64_t key) {
    return (int64_t)(jsl_mix64(key) & (uint64_t)(map->cap - 1));
}

/* The place of key, or the empty place where it would go; cap must not be 0. */
static int64_t find(const jsl_map *map, uint64_t key) {
    int64_t i = home(map, key);
    while (map->key[i] && map->key[i] != key) i = (i + 1) & (map->cap - 1);
    return i;
}

/* At most two thirds full. */
static bool fits(int64_t cap, int64_t count) { return count <= cap / 3 * 2; }

jsl_result jsl_map_reserve(jsl_memory *memory, jsl_map *map, int64_t count) {
    if (fits(map->cap, count)) return JSL_OK;
    if (count > INT64_MAX / 64) return JSL_ERR_MEMORY;
    jsl_map fresh = {.cap = SMALLEST, .count = map->count};
    while (!fits(fresh.cap, count)) fresh.cap *= 2;
    fresh.key = jsl_alloc_zero(memory, (size_t)fresh.cap * sizeof *fresh.key);
    if (!fresh.key) return JSL_ERR_MEMORY;
    fresh.value = jsl_alloc(memory, (size_t)fresh.cap * sizeof *fresh.value);
    if (!fresh.value) {
        jsl_map_free(memory, &fresh);
        return JSL_ERR_MEMORY;
    }
    for (int64_t i = 0; i < map->cap; i++) {
        if (!map->key[i]) continue;
        int64_t to = find(&fresh, map->key[i]);
        fresh.key[to] = map->key[i];
        fresh.value[to] = map->value[i];
    }
    jsl_map_free(memory, map);
    *map = fresh;
    return JSL_OK;
}

void jsl_map_free(jsl_memory *memory, jsl_map *map) {
    jsl_free(memory, map->key, (size_t)map->cap * sizeof *map->key);
    jsl_free(memory, map->value, (size_t)map->cap * sizeof *map->value);
    *map = (jsl_map){0};
}

bool jsl_map_get(const jsl_map *map, uint64_t key, uint32_t *value) {
    if (!map->cap || !key) return false;
    int64_t i = find(map, key);
    if (!map->key[i]) return false;
    if (value) *value = map->value[i];
    return true;
}

jsl_result jsl_map_set(jsl_memory *memory, jsl_map *map, uint64_t key, uint32_t value) {
    if (!key) return JSL_ERR_ARGUMENT;
    int64_t i = map->cap ? find(map, key) : 0;
    if (!map->cap || !map->key[i]) {
        JSL_TRY(jsl_map_reserve(memory, map, map->count + 1));
        i = find(map, key);
        map->key[i] = key;
        map->count++;
    }
    map->value[i] = value;
    return JSL_OK;
}

bool jsl_map_remove(jsl_map *map, uint64_t key) {
    if (!map->cap || !key) return false;
    int64_t mask = map->cap - 1, hole = find(map, key);
    if (!map->key[hole]) return false;
    for (int64_t i = (hole + 1) & mask; map->key[i]; i = (i + 1) & mask) {
        /* An entry may fill the hole unless its home lies behind the hole. */
        if (((i - home(map, map->key[i])) & mask) < ((i - hole) & mask)) continue;
        map->key[hole] = map->key[i];
        map->value[hole] = map->value[i];
        hole = i;
    }
    map->key[hole] = 0;
    map->count--;
    return true;
}

void jsl_map_clear(jsl_map *map) {
    if (map->cap) memset(map->key, 0, (size_t)map->cap * sizeof *map->key);
    map->count = 0;
}
