/* SPDX-License-Identifier: MIT
 * The radix sort of one key type; sort.c includes this once for each. KEY is the type, NAME(x) its
 * names.
 */

/* Small inputs: shorter than clearing the histograms. Stable. */
static void NAME(insertion)(KEY *key, uint32_t *value, int64_t n) {
    for (int64_t i = 1; i < n; i++) {
        KEY k = key[i];
        uint32_t v = value[i];
        int64_t j = i;
        for (; j > 0 && key[j - 1] > k; j--) {
            key[j] = key[j - 1];
            value[j] = value[j - 1];
        }
        key[j] = k;
        value[j] = v;
    }
}

/* Counts `digits` digits of `bits` bits from bit `low` up. digits is a constant at each call, so
 * that the inner loop is straight code. */
static inline __attribute__((always_inline)) void
NAME(count_digits)(const KEY *key, int64_t n, int low, int bits, int digits, uint32_t *histogram) {
    const KEY mask = (KEY)(((KEY)1 << bits) - 1);
    memset(histogram, 0, sizeof *histogram * ((size_t)digits << bits));
    for (int64_t i = 0; i < n; i++) {
        KEY k = (KEY)(key[i] >> low);
        for (int d = 0; d < digits; d++)
            histogram[((size_t)d << bits) + (size_t)(k >> (d * bits) & mask)]++;
    }
}

static void NAME(count)(const KEY *key, int64_t n, int low, int bits, int digits,
                        uint32_t *histogram) {
    switch (digits) {
    case 1:
        NAME(count_digits)(key, n, low, bits, 1, histogram);
        break;
    case 2:
        NAME(count_digits)(key, n, low, bits, 2, histogram);
        break;
    case 3:
        NAME(count_digits)(key, n, low, bits, 3, histogram);
        break;
    case 4:
        NAME(count_digits)(key, n, low, bits, 4, histogram);
        break;
    case 5:
        NAME(count_digits)(key, n, low, bits, 5, histogram);
        break;
    case 6:
        NAME(count_digits)(key, n, low, bits, 6, histogram);
        break;
    case 7:
        NAME(count_digits)(key, n, low, bits, 7, histogram);
        break;
    default:
        NAME(count_digits)(key, n, low, bits, 8, histogram);
        break;
    }
}

/* The keys lie in [0, 2^width) << low, but for bits that are equal in all; width > 0. */
static void NAME(radix)(KEY *key, uint32_t *value, KEY *tmp_key, uint32_t *tmp_value, int64_t n,
                        int low, int width) {
    /* Few keys: small digits, whose histograms cost less. The digits are made equally wide. */
    const int widest = n < 4096 ? 8 : 11;
    const int digits = (width + widest - 1) / widest, bits = (width + digits - 1) / digits;
    const KEY mask = (KEY)(((KEY)1 << bits) - 1);
    uint32_t histogram[6 << 11]; /* at least 8 << 8 */
    NAME(count)(key, n, low, bits, digits, histogram);

    KEY *from_key = key, *to_key = tmp_key;
    uint32_t *from_value = value, *to_value = tmp_value;
    for (int d = 0; d < digits; d++) {
        uint32_t *place = histogram + ((size_t)d << bits);
        /* In two steps: together they may reach the width of the type when the digit is the last.
         */
        int shift = d * bits;
        if (place[key[0] >> low >> shift & mask] == (uint32_t)n) continue;
        uint32_t sum = 0;
        for (int b = 0; b < 1 << bits; b++) {
            uint32_t count = place[b];
            place[b] = sum;
            sum += count;
        }
        for (int64_t i = 0; i < n; i++) {
            KEY k = from_key[i];
            uint32_t to = place[k >> low >> shift & mask]++;
            to_key[to] = k;
            to_value[to] = from_value[i];
        }
        KEY *swap_key = from_key;
        uint32_t *swap_value = from_value;
        from_key = to_key, to_key = swap_key;
        from_value = to_value, to_value = swap_value;
    }
    if (from_key != key) {
        memcpy(key, from_key, (size_t)n * sizeof *key);
        memcpy(value, from_value, (size_t)n * sizeof *value);
    }
}

void NAME(jsl_sort)(KEY *key, uint32_t *value, KEY *tmp_key, uint32_t *tmp_value, int64_t n) {
    JSL_ASSERT(n <= (int64_t)UINT32_MAX);
    if (n <= 48) {
        NAME(insertion)(key, value, n);
        return;
    }
    /* Which bits differ at all, and whether there is anything to do. */
    KEY differ = 0, falls = 0;
    for (int64_t i = 1; i < n; i++) {
        differ |= key[i] ^ key[0];
        falls |= key[i] < key[i - 1];
    }
    if (!falls) return;
    int low = __builtin_ctzll((unsigned long long)differ);
    int high = 64 - __builtin_clzll((unsigned long long)differ);
    NAME(radix)(key, value, tmp_key, tmp_value, n, low, high - low);
}
