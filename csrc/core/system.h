/* All that the core asks of an operating system: threads, a clock, memory that begins where lanes
 * want it. POSIX and Windows; Linux is what is tested. */
#ifndef MOIT_SYSTEM_H
#define MOIT_SYSTEM_H

#include <stdbool.h>
#include <stddef.h>

#if defined(_WIN32) && defined(__x86_64__) && !defined(__clang__) \
    && !(defined(MOIT_NO_AVX2) && defined(MOIT_NO_AVX512))
#error GCC leaves wide vectors unaligned on the stack of Windows (its bug 54412): take clang
#endif

enum { MOIT_ALIGNMENT = 64 }; /* of a line of cache, and of the widest vector */

static inline size_t moit_aligned_size(size_t bytes) {
    return (bytes + MOIT_ALIGNMENT - 1) / MOIT_ALIGNMENT * MOIT_ALIGNMENT;
}

/* `bytes` from a multiple of MOIT_ALIGNMENT on; NULL where there is no memory. */
void *moit_aligned_memory(size_t bytes);
void moit_free_aligned(void *memory); /* or NULL */

double moit_seconds(void); /* since some moment, by a clock that nobody sets */

typedef struct {
    void (*work)(void *argument);
    void *argument;
    void *system; /* what it is known by, between start and join */
} moit_thread;

/* False where the system gives no thread: there is nothing to join then. The struct must stay where
 * it is until the thread has been joined. */
bool moit_start_thread(moit_thread *thread, void (*work)(void *argument), void *argument);
void moit_join_thread(moit_thread *thread);

#endif
