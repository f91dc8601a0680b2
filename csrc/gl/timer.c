/* Times of passes. Timer queries of llvmpipe count a small part of what it does; so there a clock
 * is read while nothing runs. */
#include "driver.h"

#include <stdlib.h>
#include <time.h>

static double clock_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static GLuint timestamp(moit_gl *gl) {
    GLuint query = 0;
    gl->f.CreateQueries(GL_TIMESTAMP, 1, &query);
    gl->f.QueryCounter(query, GL_TIMESTAMP);
    return query;
}

moit_gl_status moit_gl_begin_time(moit_gl *gl) {
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    if (gl->pending_count == TIMES_WITHIN_TIMES)
        return fail("begin_time: at most %d times nest", TIMES_WITHIN_TIMES);
    interval *begun = &gl->pending[gl->pending_count];
    *begun = (interval){0};
    if (gl->info.software) {
        gl->f.Finish();
        begun->seconds = clock_now();
    } else {
        begun->begin = timestamp(gl);
    }
    status = end_gl(gl, "begin_time");
    if (status == MOIT_GL_OK) ++gl->pending_count;
    return status;
}

moit_gl_status moit_gl_end_time(moit_gl *gl, int *ticket) {
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    if (!gl->pending_count) return fail("end_time: there was no begin_time");
    int at = 0;
    while (at < gl->interval_count && !gl->intervals[at].used) ++at;
    if (at == gl->interval_room) {
        int room = at ? 2 * at : 16;
        interval *all = realloc(gl->intervals, (size_t)room * sizeof *all);
        if (!all) return MOIT_GL_NO_MEMORY;
        gl->intervals = all;
        gl->interval_room = room;
    }
    interval ended = gl->pending[--gl->pending_count];
    if (gl->info.software) {
        gl->f.Finish();
        ended.seconds = clock_now() - ended.seconds;
    } else {
        ended.end = timestamp(gl);
    }
    gl->intervals[at] = ended;
    if (at == gl->interval_count) ++gl->interval_count;
    *ticket = at;
    return end_gl(gl, "end_time");
}

moit_gl_status moit_gl_seconds(moit_gl *gl, int ticket, double *seconds) {
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    if (ticket < 0 || ticket >= gl->interval_count || gl->intervals[ticket].used)
        return fail("seconds: %d is no ticket of end_time, or was used", ticket);
    interval *asked = &gl->intervals[ticket];
    *seconds = asked->seconds;
    if (!gl->info.software) {
        GLuint64 begin = 0, end = 0;
        gl->f.GetQueryObjectui64v(asked->begin, GL_QUERY_RESULT, &begin); /* waits */
        gl->f.GetQueryObjectui64v(asked->end, GL_QUERY_RESULT, &end);
        gl->f.DeleteQueries(2, (GLuint[]){asked->begin, asked->end});
        *seconds = 1e-9 * (double)(end - begin);
    }
    asked->used = true;
    return end_gl(gl, "seconds");
}
