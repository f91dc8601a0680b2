/* What the files of this folder share: the context, its objects, and how each call begins and
 * ends. */
#ifndef MOIT_GL_DRIVER_H
#define MOIT_GL_DRIVER_H

#include <pthread.h>
#include <sys/types.h>
#include <unistd.h>

#include "functions.h"
#include "moit_gl.h"

/* ---- EGL (library.c) ------------------------------------------------------------------------- */

/* The functions of EGL; NULL, with a message, where there is no library. Loaded once a process. */
const egl_functions *load_egl(void);
bool listed(const char *names, const char *name); /* in a list with spaces between */

/* ---- The context ----------------------------------------------------------------------------- */

/* What a call of enter found. */
typedef struct level {
    struct level *outer;
    EGLDisplay display;
    EGLContext context;
    EGLSurface draw, read;
    EGLenum api;
    struct foreign_state *state; /* as it was before our first pass; NULL: none yet, or all ours */
} level;

typedef enum object_type { A_BUFFER = 0, A_TEXTURE, A_PROGRAM, A_QUERY } object_type;

/* The head of everything that has a name in GL. */
typedef struct object {
    moit_gl *gl;
    struct object *before, *after;
    object_type type;
    GLuint name;
} object;

typedef struct dead_name {
    struct dead_name *next;
    object_type type;
    GLuint name;
} dead_name;

typedef struct interval {
    GLuint begin, end; /* queries; 0 on software */
    double seconds;
    bool used;
} interval;

enum { TIMES_WITHIN_TIMES = 16, PLATFORM_NAME = 32 };

struct moit_gl {
    const egl_functions *egl;
    gl_functions f;
    EGLDisplay display;
    EGLContext context;
    EGLSurface surface; /* EGL_NO_SURFACE where contexts can do without */
    bool adopted, foreign, closed;
    pid_t process;
    moit_gl_info info;
    char *names[3]; /* copies of renderer, vendor, version */
    char platform[PLATFORM_NAME];
    GLint alignment_of_storage;

    pthread_mutex_t lock; /* of the members up to the empty line */
    level *innermost;
    pthread_t thread; /* that has entered, where innermost is not NULL */
    object objects;   /* a ring */
    dead_name *dead;

    GLuint vertices, framebuffer, sampler; /* made when first drawn with */
    interval *intervals;
    int interval_count, interval_room;
    interval pending[TIMES_WITHIN_TIMES];
    int pending_count;
};

struct moit_gl_buffer {
    object object;
    int64_t size;
};

struct moit_gl_texture {
    object object;
    moit_gl_texture_info info;
    const struct texture_format *format;
};

typedef struct block {
    int binding;
    char *name;
} block;

typedef struct blocks {
    block *all;
    int count;
} blocks;

struct moit_gl_program {
    object object;
    bool compute;
    moit_gl_uniform *uniforms;
    int uniform_count;
    blocks buffers, textures, images; /* that must be bound */
};

/* ---- Errors (errors.c) ----------------------------------------------------------------------- */

/* Sets this thread's message; gives MOIT_GL_FAILED, so that `return fail(...)` reads well. */
__attribute__((format(printf, 1, 2))) moit_gl_status fail(const char *format, ...);
moit_gl_status bad_shader(const char *log);
const char *egl_error_words(EGLint error);
const char *gl_error_words(GLenum error);
void forget_errors(moit_gl *gl); /* that GL has in store */

/* ---- Begin and end (context.c) --------------------------------------------------------------- */

/* Every call into GL stands between these two. begin_gl fails where the context is not ours to use:
 * closed, not entered by this thread, no longer current. end_gl gives GL's error the words
 * "`what`: ...". */
moit_gl_status begin_gl(moit_gl *gl);
moit_gl_status end_gl(moit_gl *gl, const char *what);

/* ---- Objects (objects.c) --------------------------------------------------------------------- */

void enlist(moit_gl *gl, object *object, object_type type, GLuint name);
/* Takes the object off the list; its name goes now, or when the context is next used. */
void discard(object *object, bool ours);
void delete_name(moit_gl *gl, object_type type, GLuint name);
void delete_dead(moit_gl *gl);

/* ---- Textures (texture.c) -------------------------------------------------------------------- */

moit_gl_status bind_textures(moit_gl *gl, const moit_gl_bindings *bindings);

/* ---- Passes (pass.c) ------------------------------------------------------------------------- */

/* As begin_gl; and the program is of this context and of the right stages. */
moit_gl_status begin_pass(moit_gl *gl, const moit_gl_program *program, bool compute);
/* Everything the program asks for must be there. */
moit_gl_status bind_everything(moit_gl *gl, const moit_gl_program *program,
                               const moit_gl_bindings *bindings);

/* ---- State of others (state.c) --------------------------------------------------------------- */

struct foreign_state *capture_state(moit_gl *gl); /* NULL: no memory */
void restore_state(moit_gl *gl, const struct foreign_state *state);

#endif
