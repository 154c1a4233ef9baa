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

/* bits is a constant at each call, so that both digit widths are compiled with fixed loops. */
static inline __attribute__((always_inline)) void
NAME(radix)(KEY *key, uint32_t *value, KEY *tmp_key, uint32_t *tmp_value, int64_t n, int bits) {
    enum { MAX_DIGITS = 8, MAX_BINS = 1 << 11 };
    const int digits = ((int)sizeof(KEY) * 8 + bits - 1) / bits;
    const KEY mask = (KEY)((1u << bits) - 1);
    uint32_t histogram[MAX_DIGITS * 256 > 6 * MAX_BINS ? MAX_DIGITS * 256 : 6 * MAX_BINS];
    memset(histogram, 0, sizeof(uint32_t) * ((size_t)digits << bits));

    bool sorted = true;
    for (int64_t i = 0; i < n; i++) {
        KEY k = key[i];
        sorted &= i == 0 || key[i - 1] <= k;
        for (int d = 0; d < digits; d++) histogram[(d << bits) + (int)(k >> (d * bits) & mask)]++;
    }
    if (sorted) return;

    KEY *from_key = key, *to_key = tmp_key;
    uint32_t *from_value = value, *to_value = tmp_value;
    for (int d = 0; d < digits; d++) {
        uint32_t *place = histogram + (d << bits);
        int shift = d * bits;
        if (place[key[0] >> shift & mask] == (uint32_t)n) continue;
        uint32_t sum = 0;
        for (int b = 0; b < 1 << bits; b++) {
            uint32_t count = place[b];
            place[b] = sum;
            sum += count;
        }
        for (int64_t i = 0; i < n; i++) {
            KEY k = from_key[i];
            uint32_t to = place[k >> shift & mask]++;
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
    if (n <= 48)
        NAME(insertion)(key, value, n);
    else if (n < 4096)
        NAME(radix)(key, value, tmp_key, tmp_value, n, 8);
    else
        NAME(radix)(key, value, tmp_key, tmp_value, n, 11);
}
