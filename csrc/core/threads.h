/* Work shared among threads. */
#ifndef MOIT_THREADS_H
#define MOIT_THREADS_H

#include "moit.h"

/* Calls work(context, item, thread) for every item in [0, items), on up to run->threads threads
 * that each take the next item when they are done with one; `thread` counts from 0 and is below
 * run->threads. The calling thread works too and alone asks run->interrupted. The first status
 * other than MOIT_OK stops the rest and is returned. Results must not depend on which thread
 * took which item. */
moit_status moit_parallel_for(const moit_run *run, int64_t items,
                              moit_status (*work)(void *context, int64_t item, int thread),
                              void *context);

#endif
