/* What the machine can do: bytes read a second, and steps of a clock. Compiled by moit/rivals.py. */
#include <stdint.h>

/* Reads `count` words once. */
uint64_t read_words(const uint64_t *words, int64_t count) {
    uint64_t sum[8] = {0};
    for (int64_t i = 0; i + 8 <= count; i += 8)
        for (int k = 0; k < 8; ++k) sum[k] += words[i + k];
    uint64_t all = 0;
    for (int k = 0; k < 8; ++k) all += sum[k];
    return all;
}

/* A chain of additions that wait for one another: a clock cycle each. */
uint64_t count_cycles(uint64_t cycles) {
    uint64_t x = 1;
    for (uint64_t i = 0; i < cycles; i += 8) {
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
        x += i;
        __asm__ volatile("" : "+r"(x));
    }
    return x;
}
