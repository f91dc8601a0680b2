/* Stands before the C library's allocation (LD_PRELOAD): the `lack_after`-th one of at least
   `lack_least[0]` bytes fails, once; of callers from lack_first[k] up to lack_last[k], of at least
   lack_least[k] bytes. `lack_live` is what is held. tests/test_no_memory.py sets these. */
#include <errno.h>
#include <malloc.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *__libc_memalign(size_t, size_t);
void __libc_free(void *);

_Atomic int64_t lack_seen, lack_live;
int64_t lack_after = -1;
size_t lack_least[3], lack_first[3], lack_last[3];

static int lacks(size_t size, void *caller) {
    size_t at = (size_t)caller, least = lack_least[0];
    for (int k = 1; k < 3; ++k)
        if (lack_first[k] <= at && at < lack_last[k]) least = lack_least[k];
    if (size < least) return 0;
    if (lack_seen++ != lack_after) return 0;
    errno = ENOMEM;
    return 1;
}

static void *kept(void *piece) {
    if (piece) lack_live += (int64_t)malloc_usable_size(piece);
    return piece;
}

static void gone(void *piece) {
    if (piece) lack_live -= (int64_t)malloc_usable_size(piece);
}

#define LACKS(size) lacks(size, __builtin_return_address(0))

void *malloc(size_t size) { return LACKS(size) ? NULL : kept(__libc_malloc(size)); }

void *calloc(size_t count, size_t size) {
    return LACKS(count * size) ? NULL : kept(__libc_calloc(count, size));
}

void *realloc(void *piece, size_t size) {
    if (LACKS(size)) return NULL;
    gone(piece);
    void *moved = __libc_realloc(piece, size);
    if (!moved && size) kept(piece);
    return kept(moved);
}

void *aligned_alloc(size_t to, size_t size) {
    return LACKS(size) ? NULL : kept(__libc_memalign(to, size));
}

void *memalign(size_t to, size_t size) {
    return LACKS(size) ? NULL : kept(__libc_memalign(to, size));
}

int posix_memalign(void **piece, size_t to, size_t size) {
    if (LACKS(size)) return ENOMEM;
    return (*piece = kept(__libc_memalign(to, size))) ? 0 : ENOMEM;
}

void free(void *piece) {
    gone(piece);
    __libc_free(piece);
}
