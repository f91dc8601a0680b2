// What targets hold sums in, and what that rounds off of them.
//
// 1: words of 16 bits, which have a safe distribution of their own.
#ifndef IN_WORDS
#define IN_WORDS 0
#endif
#if IN_WORDS
#define BY_WORDS(plain, words) words
#else
#define BY_WORDS(plain, words) plain
#endif
// 1: half floats, to which blending adds; 0: floats.
#ifndef HALVES
#define HALVES 0
#endif
// PLAIN  1: what is rounded off, and the bias for that, are so much that floats, not pairs of
//        these, do to read sums (pairs.glsl): of words, and where a kit says so.
#if !defined(PLAIN) && IN_WORDS
#define PLAIN 1
#elif !defined(PLAIN)
#define PLAIN 0
#endif
#if IN_WORDS
#define ROUNDING 3.0517578e-5
#define BY_STORAGE(floats, halves) floats
#define SUM_WITHIN(sum, most) sum
#elif HALVES
#define ROUNDING 4.8828125e-4
#define BY_STORAGE(floats, halves) halves
// Rounding leaves means of powers of depth within 1, as it may sums not; SUMS_ARE_WITHIN says that
// a text sees to that itself.
#ifdef SUMS_ARE_WITHIN
#define SUM_WITHIN(sum, most) sum
#else
#define SUM_WITHIN(sum, most) clamp(sum, -(most), most)
#endif
#else
#define ROUNDING 1.1920929e-7
#define BY_STORAGE(floats, halves) floats
#define SUM_WITHIN(sum, most) sum
#endif
