#ifndef _WIN32
#define _GNU_SOURCE /* clock_gettime, whatever standard the compiler keeps to */
#endif
#include "core/system.h"

#ifdef _WIN32

#include <malloc.h>
#include <process.h>
#include <windows.h>

void *moit_aligned_memory(size_t bytes) { return _aligned_malloc(bytes, MOIT_ALIGNMENT); }

void moit_free_aligned(void *memory) { _aligned_free(memory); }

double moit_seconds(void) {
    LARGE_INTEGER now, each_second;
    QueryPerformanceCounter(&now);
    QueryPerformanceFrequency(&each_second);
    return (double)now.QuadPart / (double)each_second.QuadPart;
}

static unsigned __stdcall thread_main(void *argument) {
    moit_thread *self = argument;
    self->work(self->argument);
    return 0;
}

bool moit_start_thread(moit_thread *thread, void (*work)(void *argument), void *argument) {
    *thread = (moit_thread){work, argument, NULL};
    thread->system = (void *)_beginthreadex(NULL, 0, thread_main, thread, 0, NULL);
    return thread->system != NULL;
}

void moit_join_thread(moit_thread *thread) {
    WaitForSingleObject(thread->system, INFINITE);
    CloseHandle(thread->system);
}

#else

#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

void *moit_aligned_memory(size_t bytes) {
    if (bytes > SIZE_MAX - MOIT_ALIGNMENT) return NULL;
    /* macOS gives nothing where the size is no multiple */
    return aligned_alloc(MOIT_ALIGNMENT, moit_aligned_size(bytes));
}

void moit_free_aligned(void *memory) { free(memory); }

double moit_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *thread_main(void *argument) {
    moit_thread *self = argument;
    self->work(self->argument);
    return NULL;
}

bool moit_start_thread(moit_thread *thread, void (*work)(void *argument), void *argument) {
    *thread = (moit_thread){work, argument, NULL};
    pthread_t id;
    _Static_assert(sizeof id <= sizeof thread->system, "a thread is a number or a pointer");
    if (pthread_create(&id, NULL, thread_main, thread)) return false;
    memcpy(&thread->system, &id, sizeof id);
    return true;
}

void moit_join_thread(moit_thread *thread) {
    pthread_t id;
    memcpy(&id, &thread->system, sizeof id);
    pthread_join(id, NULL);
}

#endif
