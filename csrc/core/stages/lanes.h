/* What units of lanes begin with: their target, the dialect, and numbers from memory and back. A
 * unit ends with lanes_end.h. */
#include <stdint.h>
#include <string.h>

#define PRAGMA(x) _Pragma(#x)
#define STRING(x) STRING_(x)
#define STRING_(x) #x
#ifdef TARGET
#ifdef __clang__
#define TARGET_BEGIN(t) \
    PRAGMA(clang attribute push(__attribute__((target(t))), apply_to = function))
#else
#define TARGET_BEGIN(t) PRAGMA(GCC target(t))
#endif
TARGET_BEGIN(TARGET)
#endif

#include "kernels/dialect.h"
#include "kernels/elementary.h"

FN real load(const SCALAR *p) {
    real x;
    memcpy(&x, p, sizeof x);
    return x;
}

FN void store(SCALAR *p, real x) { memcpy(p, &x, sizeof x); }

/* The lanes at `p` of which only n are there; the others repeat the first. */
FN real load_some(const SCALAR *p, int n) {
    SCALAR x[LANES];
    for (int i = 0; i < LANES; ++i) x[i] = p[i < n ? i : 0];
    return load(x);
}

FN real load_at_most(const SCALAR *p, int n) { return n >= LANES ? load(p) : load_some(p, n); }

FN void store_at_most(SCALAR *p, real x, int n) {
    if (n >= LANES) {
        store(p, x);
        return;
    }
    SCALAR lanes[LANES];
    store(lanes, x);
    for (int i = 0; i < n; ++i) p[i] = lanes[i];
}
