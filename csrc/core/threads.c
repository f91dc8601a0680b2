/* Threads live for one call: starting one costs some 20 microseconds, and a library without
 * threads of its own between calls survives fork and leaves no global state behind. */
#include "core/threads.h"

#include <fenv.h>
#include <stdatomic.h>

#include "core/system.h"

enum { MOST_THREADS = 256 };

/* How long a call may go on before it looks whether somebody wants it to stop. */
static const double seconds_between_questions = 0.05;

typedef struct {
    const moit_run *run;
    int64_t items;
    moit_status (*work)(void *context, int64_t item, int thread);
    void *context;
    atomic_int_least64_t next;
    atomic_int status;
} shared_work;

typedef struct {
    shared_work *shared;
    int thread;
} worker;

static void stop(shared_work *shared, moit_status status) {
    int expected = MOIT_OK;
    atomic_compare_exchange_strong(&shared->status, &expected, status);
}

static void work_until_done(shared_work *shared, int thread) {
    const moit_run *run = shared->run;
    double asked = moit_seconds();
    while (atomic_load(&shared->status) == MOIT_OK) {
        int64_t item = atomic_fetch_add(&shared->next, 1);
        if (item >= shared->items) return;
        moit_status status = shared->work(shared->context, item, thread);
        if (status != MOIT_OK) stop(shared, status);
        if (thread == 0 && run->interrupted && moit_seconds() - asked > seconds_between_questions) {
            if (run->interrupted(run->context)) stop(shared, MOIT_INTERRUPTED);
            asked = moit_seconds();
        }
    }
}

static void worker_main(void *argument) {
    worker *self = argument;
    work_until_done(self->shared, self->thread);
}

moit_status moit_parallel_for(const moit_run *run, int64_t items,
                              moit_status (*work)(void *context, int64_t item, int thread),
                              void *context) {
    shared_work shared = {.run = run, .items = items, .work = work, .context = context};
    int wanted = run->threads < MOST_THREADS ? run->threads : MOST_THREADS;
    if (wanted > items) wanted = (int)items;

    /* A caller's thread may take numbers below the normal ones for 0, as XLA's do where JAX calls
     * back, or round in another way; threads that are started inherit that. */
    fenv_t of_caller;
    fegetenv(&of_caller);
    fesetenv(FE_DFL_ENV);
    moit_thread threads[MOST_THREADS];
    worker workers[MOST_THREADS];
    int started = 1; /* the calling thread is number 0 */
    for (; started < wanted; ++started) {
        workers[started] = (worker){&shared, started};
        /* Fewer threads than asked for is slower, not wrong. */
        if (!moit_start_thread(&threads[started], worker_main, &workers[started])) break;
    }
    work_until_done(&shared, 0);
    for (int i = 1; i < started; ++i) moit_join_thread(&threads[i]);
    fesetenv(&of_caller);
    return (moit_status)atomic_load(&shared.status);
}
