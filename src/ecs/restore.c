/* SPDX-License-Identifier: MIT
 * Reading an image: everything is checked and all room is made before anything changes. Images are
 * not trusted, whatever their checksum says. Floor 2.
 */
#include "ecs/image.h"
#include "ecs/image_kernel.h"

/* -- Reading with bounds ------------------------------------------------------ */

typedef struct reader {
    const unsigned char *bytes;
    size_t at, size;
    bool bad; /* something lay beyond the end */
} reader;

/* The next size bytes, or null. */
static const unsigned char *take(reader *r, uint64_t size) {
    if (r->bad || size > r->size - r->at) {
        r->bad = true;
        return NULL;
    }
    const unsigned char *p = r->bytes + r->at;
    r->at += (size_t)size;
    return p;
}

static bool get(reader *r, void *to, size_t size) {
    const unsigned char *p = take(r, size);
    if (p) memcpy(to, p, size);
    return p != NULL;
}

static int get_u8(reader *r) {
    const unsigned char *p = take(r, 1);
    return p ? *p : 0;
}

static void get_text(reader *r, char text[256]) {
    size_t n = (size_t)get_u8(r);
    const unsigned char *p = take(r, n);
    if (!p) n = 0;
    if (n) memcpy(text, p, n);
    text[n] = 0;
}

static void align(reader *r) { take(r, (8 - r->at % 8) % 8); }

static uint32_t word_at(const unsigned char *p, uint64_t i) {
    uint32_t x;
    memcpy(&x, p + i * 4, 4);
    return x;
}

/* -- What the image says ------------------------------------------------------ */

typedef struct image_part {
    jsl_table *table;
    uint64_t rows;
    const unsigned char *slot, *values;                /* values: of the first saved field */
    uint8_t components, component[JSL_MAX_COMPONENTS]; /* ids here, in the order of the image */
} image_part;

typedef struct image {
    jsl_ecs *ecs;
    reader in;
    jsl_image_header head;
    uint8_t component[JSL_MAX_COMPONENTS]; /* place in the schema -> id here */
    const unsigned char *generation, *free_slot;
    JSL_ARRAY(image_part) part;
    jsl_bitset seen; /* slots */
    uint64_t rows;
} image;

static jsl_result damaged(const image *im, const char *what) {
    return jsl_fail(&im->ecs->logger, JSL_ERR_FORMAT, "image: %s (near byte %zu of %zu)", what,
                    im->in.at, im->in.size);
}

static jsl_result read_header(image *im) {
    jsl_image_header *h = &im->head;
    reader *in = &im->in;
    if (!get(in, h, sizeof *h) || memcmp(h->magic, JSL_IMAGE_MAGIC, sizeof h->magic) != 0)
        return damaged(im, "not an image of an ECS");
    if (h->version != JSL_IMAGE_VERSION)
        return jsl_fail(&im->ecs->logger, JSL_ERR_VERSION, "image has version %u; this is %u",
                        h->version, JSL_IMAGE_VERSION);
    if (h->size != in->size || in->size < sizeof *h + 8) return damaged(im, "its size is wrong");
    in->size -= 8;
    size_t whole = in->size - in->size % JSL_SUM_BYTES;
    jsl_image_sum lanes = jsl_image_sum_begin();
    jsl_image_sum_mix(im->ecs, &lanes, in->bytes, whole);
    uint64_t sum = jsl_image_sum_end(&lanes, in->bytes + whole, in->size - whole), stored;
    memcpy(&stored, in->bytes + in->size, 8);
    if (sum != stored) return damaged(im, "its checksum is wrong");
    if ((h->real_bytes != 4 && h->real_bytes != 8) || h->components > JSL_MAX_COMPONENTS ||
        h->slots > JSL_MAX_SLOTS || h->free_slots > h->slots || h->live > h->slots || h->zero)
        return damaged(im, "its header is wrong");
    return JSL_OK;
}

static jsl_result read_component(image *im, int place) {
    char text[2 + 2 * JSL_MAX_COMPONENT_FIELDS][256];
    jsl_field field[JSL_MAX_COMPONENT_FIELDS];
    reader *in = &im->in;
    get_text(in, text[0]);
    int keeps_order = get_u8(in), fields = get_u8(in);
    if (in->bad || keeps_order > 1 || fields > JSL_MAX_COMPONENT_FIELDS)
        return damaged(im, "its schema is wrong");
    for (int f = 0; f < fields; f++) {
        get_text(in, text[1 + 2 * f]);
        get_text(in, text[2 + 2 * f]);
        int type = get_u8(in), role = get_u8(in);
        field[f] = (jsl_field){text[1 + 2 * f], text[2 + 2 * f], (jsl_type)type, (jsl_role)role};
    }
    if (in->bad) return damaged(im, "its schema is cut off");
    jsl_component_desc desc = {text[0], field, fields, keeps_order != 0};
    for (int c = 0; c < im->ecs->component_count; c++) {
        if (strcmp(im->ecs->component[c].desc.name, desc.name) != 0) continue;
        if (!jsl_component_same(&im->ecs->component[c].desc, &desc))
            return jsl_fail(&im->ecs->logger, JSL_ERR_VERSION,
                            "image: component %.31s has other rows than the registered one",
                            desc.name);
        for (int k = 0; k < place; k++)
            if (im->component[k] == c) return damaged(im, "it names a component twice");
        im->component[place] = (uint8_t)c;
        return JSL_OK;
    }
    return jsl_fail(&im->ecs->logger, JSL_ERR_VERSION, "image: component %.31s is not registered",
                    desc.name);
}

/* Bytes of one value in the image. */
static uint64_t value_bytes(const image *im, jsl_type type) {
    return type == JSL_TYPE_REAL ? im->head.real_bytes : (uint64_t)jsl_type_size(type);
}

static jsl_result read_part(image *im) {
    jsl_image_table head;
    image_part *part = &im->part.at[im->part.count];
    reader *in = &im->in;
    *part = (image_part){0};
    if (!get(in, &head, sizeof head) || head.components > im->head.components || head.zero ||
        head.rows > im->head.slots)
        return damaged(im, "a table is wrong");
    uint64_t mask = 0;
    for (uint32_t i = 0; i < head.components; i++) {
        int place = get_u8(in);
        if (in->bad || place >= (int)im->head.components || (mask >> im->component[place] & 1))
            return damaged(im, "a table's components are wrong");
        part->component[part->components++] = im->component[place];
        mask |= 1ull << im->component[place];
    }
    align(in);
    part->rows = head.rows;
    part->slot = take(in, head.rows * 4);
    align(in);
    part->values = in->bytes + in->at;
    for (int i = 0; i < part->components; i++) {
        const jsl_component_desc *desc = &im->ecs->component[part->component[i]].desc;
        for (int f = 0; f < desc->field_count; f++) {
            if (!jsl_role_is_saved(desc->fields[f].role)) continue;
            take(in, head.rows * value_bytes(im, desc->fields[f].type));
            align(in);
        }
    }
    if (in->bad) return damaged(im, "a table is cut off");
    JSL_TRY(jsl_table_find(im->ecs, mask, &part->table));
    if (part->table->touched) return damaged(im, "two tables have the same components");
    jsl_table_touch(im->ecs, part->table);
    im->rows += head.rows;
    im->part.count++;
    return JSL_OK;
}

/* Sets the bits [begin, begin + n); false when one was set. */
static bool claim_bits(jsl_bitset *seen, uint64_t begin, uint64_t n) {
    uint64_t clash = 0;
    while (n) {
        uint64_t shift = begin & 63, take_bits = 64 - shift < n ? 64 - shift : n;
        uint64_t bits = (take_bits == 64 ? ~0ull : (1ull << take_bits) - 1) << shift;
        clash |= seen->word[begin >> 6] & bits;
        seen->word[begin >> 6] |= bits;
        begin += take_bits;
        n -= take_bits;
    }
    return clash == 0;
}

/* How many of the n words of a list, from the first on, go up by one each. */
static inline uint64_t run_length(const image *im, const unsigned char *list, uint64_t n) {
    if (n < 2 || word_at(list, 1) != word_at(list, 0) + 1) return 1; /* not worth a call */
    return JSL_KERNEL_PICK(im->ecs->isa, jsl_run_length)(list, n);
}

/* Claims the n slots of a list. Neighbours in the list are neighbours in memory where nobody has
 * reordered the rows, so runs are claimed at once. */
static jsl_result claim_slots(image *im, const unsigned char *list, uint64_t n) {
    uint64_t slots = im->head.slots, *seen = im->seen.word;
    const unsigned char *generation = im->generation;
    bool unused = true, good = true;
    for (uint64_t i = 0, run; i < n; i += run) {
        uint64_t slot = word_at(list, i);
        run = run_length(im, list + i * 4, n - i);
        if (slot + run > slots) return damaged(im, "a slot does not exist");
        if (run == 1) {
            unused &= !(seen[slot >> 6] >> (slot & 63) & 1);
            seen[slot >> 6] |= 1ull << (slot & 63);
            good &= word_at(generation, slot) - 1 < JSL_GENERATION_MAX;
        } else {
            unused &= claim_bits(&im->seen, slot, run);
            good &= JSL_KERNEL_PICK(im->ecs->isa, jsl_generations_good)(generation + slot * 4, run);
        }
    }
    if (!unused) return damaged(im, "a slot is used twice");
    return good ? JSL_OK : damaged(im, "a generation is wrong");
}

/* Every slot must be a row's, or free, or retired, and only one of these. */
static jsl_result check_slots(image *im) {
    jsl_memory *memory = &im->ecs->memory;
    uint64_t slots = im->head.slots, used = im->head.live + im->head.free_slots;
    if (im->rows != im->head.live || used > slots) return damaged(im, "its counts disagree");
    if (slots && jsl_bitset_reserve(memory, &im->seen, (int64_t)slots) != JSL_OK)
        return jsl_fail(&im->ecs->logger, JSL_ERR_MEMORY, "image: no memory to check its slots");
    JSL_TRY(claim_slots(im, im->free_slot, im->head.free_slots));
    for (int64_t p = 0; p < im->part.count; p++)
        JSL_TRY(claim_slots(im, im->part.at[p].slot, im->part.at[p].rows));
    for (uint64_t i = 0; i < slots && used < slots; i++)
        if (!jsl_bitset_get(&im->seen, (int64_t)i) && word_at(im->generation, i) != 0)
            return damaged(im, "a slot is neither used nor free nor retired");
    return JSL_OK;
}

/* Reads and checks all of it, and makes all room. */
static jsl_result prepare(image *im) {
    jsl_ecs *ecs = im->ecs;
    reader *in = &im->in;
    JSL_TRY(read_header(im));
    for (uint32_t i = 0; i < im->head.components; i++) JSL_TRY(read_component(im, (int)i));
    align(in);
    im->generation = take(in, im->head.slots * 4);
    align(in);
    im->free_slot = take(in, im->head.free_slots * 4);
    align(in);
    if (in->bad || im->head.tables > (in->size - in->at) / sizeof(jsl_image_table))
        return damaged(im, "its slots are cut off");
    if (im->head.tables &&
        jsl_array_reserve(&ecs->memory, &im->part, (int64_t)im->head.tables) != JSL_OK)
        return jsl_fail(&ecs->logger, JSL_ERR_MEMORY, "image: no memory for its list of tables");
    for (uint32_t i = 0; i < im->head.tables; i++) JSL_TRY(read_part(im));
    if (in->at != in->size) return damaged(im, "something follows its tables");
    JSL_TRY(check_slots(im));
    for (int64_t i = 0; i < im->part.count; i++)
        JSL_TRY(jsl_table_reserve(ecs, im->part.at[i].table, (int64_t)im->part.at[i].rows));
    /* Reserving counts from what is live now; as many as the image has slots is always enough. */
    return jsl_slots_reserve_total(ecs, (int64_t)im->head.slots);
}

/* -- Taking it over ----------------------------------------------------------- */

static void load_reals(const image *im, const jsl_column *c, const unsigned char *from,
                       uint64_t n) {
    if (im->head.real_bytes == sizeof(jsl_real)) {
        memcpy(c->at, from, n * sizeof(jsl_real));
        return;
    }
    jsl_real *to = (jsl_real *)(void *)c->at;
    for (uint64_t i = 0; i < n; i++) {
        float single;
        double twice;
        if (im->head.real_bytes == 4) {
            memcpy(&single, from + i * 4, 4);
            to[i] = (jsl_real)single;
        } else {
            memcpy(&twice, from + i * 8, 8);
            to[i] = (jsl_real)twice;
        }
    }
}

static void load_entities(const image *im, const jsl_column *c, const unsigned char *from,
                          uint64_t n) {
    jsl_entity *to = (jsl_entity *)(void *)c->at;
    memcpy(to, from, n * sizeof *to);
    for (uint64_t i = 0; i < n; i++)
        to[i].generation = to[i].index ? (to[i].generation & JSL_GENERATION_MAX) | im->ecs->tag : 0;
}

/* The slots and handles of the rows of a table. */
static void load_handles(const image *im, const image_part *part) {
    jsl_slot *slots = im->ecs->slots.at;
    jsl_entity *entity = part->table->entity;
    uint32_t table = part->table->id, tag = im->ecs->tag;
    for (uint64_t i = 0, run; i < part->rows; i += run) {
        uint32_t slot = word_at(part->slot, i);
        run = run_length(im, part->slot + i * 4, part->rows - i);
        if (run == 1) {
            uint32_t generation = word_at(im->generation, slot) | tag;
            slots[slot] = (jsl_slot){table, (uint32_t)i, generation};
            entity[i] = (jsl_entity){slot + 1, generation};
        } else {
            JSL_KERNEL_PICK(im->ecs->isa, jsl_load_run)
            (slots + slot, entity + i, im->generation + slot * 4ull,
             (jsl_slot){table, (uint32_t)i, tag}, slot, run);
        }
    }
}

static void load_part(const image *im, const image_part *part) {
    jsl_ecs *ecs = im->ecs;
    jsl_table *table = part->table;
    uint64_t n = part->rows;
    if (n == 0) return;
    jsl_table_set_count(ecs, table, (int64_t)n);
    jsl_table_zero(table, (int64_t)n, jsl_round_up((int64_t)n, JSL_LANES));
    load_handles(im, part);
    reader in = im->in;
    in.at = (size_t)(part->values - in.bytes);
    for (int i = 0; i < part->components; i++) {
        int component = part->component[i];
        const jsl_component_desc *desc = &ecs->component[component].desc;
        for (int f = 0; f < desc->field_count; f++) {
            const jsl_column *c = &table->column[table->first[component] + f];
            if (!jsl_role_is_saved(c->role)) {
                memset(c->at, 0, n * c->bytes);
                continue;
            }
            const unsigned char *from = take(&in, n * value_bytes(im, (jsl_type)c->type));
            if (c->type == JSL_TYPE_REAL)
                load_reals(im, c, from, n);
            else if (c->type == JSL_TYPE_ENTITY)
                load_entities(im, c, from, n);
            else
                memcpy(c->at, from, n * c->bytes);
            align(&in);
        }
    }
}

static void commit(image *im) {
    jsl_ecs *ecs = im->ecs;
    jsl_slots *slots = &ecs->slots;
    for (int64_t i = 0; i < ecs->table.count; i++) {
        jsl_table *table = ecs->table.at[i];
        if (table->count == 0) continue;
        jsl_table_zero(table, 0, table->count < JSL_LANES ? table->count : JSL_LANES);
        jsl_table_set_count(ecs, table, 0);
    }
    slots->count = (int64_t)im->head.slots;
    slots->free_count = (int64_t)im->head.free_slots;
    slots->live = (int64_t)im->head.live;
    slots->head = 0;
    for (int64_t i = 0; i < slots->free_count; i++) {
        uint32_t slot = word_at(im->free_slot, (uint64_t)i);
        slots->at[slot] = (jsl_slot){JSL_FREE, 0, word_at(im->generation, slot) | ecs->tag};
    }
    if (slots->live + slots->free_count < slots->count)
        for (int64_t i = 0; i < slots->count; i++)
            if (!jsl_bitset_get(&im->seen, i)) slots->at[i] = (jsl_slot){JSL_FREE, 0, 0};
    if (slots->free_count)
        memcpy(slots->ring, im->free_slot, (size_t)slots->free_count * sizeof *slots->ring);
    for (int64_t i = 0; i < im->part.count; i++) load_part(im, &im->part.at[i]);
}

jsl_result jsl_ecs_restore(jsl_ecs *ecs, const void *bytes, size_t size) {
    if (!ecs) return JSL_ERR_ARGUMENT;
    JSL_TRY(jsl_refuse_busy(ecs, "jsl_ecs_restore"));
    if (!bytes) return jsl_fail(&ecs->logger, JSL_ERR_ARGUMENT, "jsl_ecs_restore: no image");
    image im = {.ecs = ecs, .in = {.bytes = bytes, .size = size}};
    jsl_result r = prepare(&im);
    if (r == JSL_OK) commit(&im);
    jsl_touched_close(ecs);
    jsl_array_free(&ecs->memory, &im.part);
    jsl_bitset_free(&ecs->memory, &im.seen);
    return r;
}
