/* moit's pass driver: OpenGL 4.5 passes on a device of EGL, or in a context that is current
 * already.
 *
 * Plain C11 without Python and without a GL header. libEGL is opened at run time, so nothing but
 * moit_gl_open needs it.
 *
 * A function that can fail returns a status; where it is not MOIT_GL_OK, moit_gl_message says in
 * words what went wrong and what to do, and nothing has changed. Sizes and names come from outside:
 * they are checked here.
 *
 * Threads: a context is used by one thread at a time, the one between moit_gl_enter and
 * moit_gl_exit; every function below says so when another calls it. Only functions that free may be
 * called from anywhere: what they free goes when the context is next used. */
#ifndef MOIT_GL_H
#define MOIT_GL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct moit_gl moit_gl;
typedef struct moit_gl_program moit_gl_program;
typedef struct moit_gl_buffer moit_gl_buffer;
typedef struct moit_gl_texture moit_gl_texture;

typedef enum moit_gl_status {
    MOIT_GL_OK = 0,
    MOIT_GL_NO_MEMORY, /* of the host; that of the device is a failure with a message */
    MOIT_GL_FAILED,
    MOIT_GL_BAD_SHADER, /* the message is the compiler's log */
} moit_gl_status;

enum { MOIT_GL_MESSAGE = 8192 }; /* bytes, the 0 included; longer logs are cut */

/* What may be bound: storage blocks, texture units, image units, colour targets of a draw. */
enum {
    MOIT_GL_BUFFERS = 16,
    MOIT_GL_TEXTURES = 16,
    MOIT_GL_IMAGES = 8,
    MOIT_GL_TARGETS = 8,
};

/* ---- Contexts -------------------------------------------------------------------------------- */

enum { MOIT_GL_ANY = -1, MOIT_GL_ADOPT = -2 };

/* A context on a device of EGL: of its list, or MOIT_GL_ANY: hardware before software, then no
 * device (Mesa's surfaceless platform). MOIT_GL_ADOPT: the context that is current in this thread;
 * it stays its owner's, and so does the state of GL in it. */
moit_gl_status moit_gl_open(int device, moit_gl **made);

/* Frees everything that was made in the context; what is used later says so. Fails where another
 * thread is between enter and exit. */
moit_gl_status moit_gl_close(moit_gl *gl);
void moit_gl_free(moit_gl *gl); /* NULL is fine; objects must have been freed before */

const char *moit_gl_message(void); /* of the last call that failed in this thread */

typedef struct moit_gl_info {
    const char *renderer, *vendor, *version, *platform; /* "device 1", "surfaceless", "adopted" */
    bool software;
    int64_t storage_bytes, storage_alignment, groups;
    int texture_side, color_targets, storage_blocks;
    int extensions;
} moit_gl_info;
const moit_gl_info *moit_gl_get_info(const moit_gl *gl);
const char *moit_gl_extension(const moit_gl *gl, int index); /* only while entered */

/* Makes the context current in this thread and remembers what was; exit undoes the last enter.
 * Where others draw in the context, exit puts back the state of GL that passes have changed. */
moit_gl_status moit_gl_enter(moit_gl *gl);
moit_gl_status moit_gl_exit(moit_gl *gl);

/* The address of a function of GL, for others who draw in this context: from now on their state is
 * respected. */
void *moit_gl_function(moit_gl *gl, const char *name);

/* ---- Programs -------------------------------------------------------------------------------- */

typedef enum moit_gl_stage {
    MOIT_GL_COMPUTE = 0,
    MOIT_GL_VERTEX,
    MOIT_GL_FRAGMENT,
    MOIT_GL_STAGES
} moit_gl_stage;

/* From a text of the compute stage, or of the other two; the rest NULL. On MOIT_GL_BAD_SHADER
 * `failed` is the stage the log speaks of, MOIT_GL_STAGES where they do not fit one another. */
moit_gl_status moit_gl_compile(moit_gl *gl, const char *const text[MOIT_GL_STAGES],
                               moit_gl_program **made, moit_gl_stage *failed);
void moit_gl_free_program(moit_gl_program *program);

typedef enum moit_gl_scalar {
    MOIT_GL_FLOAT32 = 0,
    MOIT_GL_FLOAT64,
    MOIT_GL_INT32,
    MOIT_GL_UINT32,
    MOIT_GL_TRUTH, /* an int32 */
} moit_gl_scalar;

typedef struct moit_gl_uniform {
    const char *name; /* of an array without [0] */
    moit_gl_scalar scalar;
    int components; /* 1 to 4, 9 or 16 */
    bool array;     /* of which the compiler may have dropped the end */
    int length;     /* what is left of an array, else 1 */
    int location;
} moit_gl_uniform;

/* NULL where the program has no such uniform, or its compiler has dropped it. */
const moit_gl_uniform *moit_gl_find_uniform(const moit_gl_program *program, const char *name);
/* `values`: `length` times `components` scalars of the uniform's type, matrices by rows. They stay
 * until they are set again. What is longer than an array is ignored. */
moit_gl_status moit_gl_set_uniform(moit_gl_program *program, const moit_gl_uniform *uniform,
                                   const void *values, int length);

/* ---- Buffers and textures -------------------------------------------------------------------- */

/* With the `given` bytes of `data`, which may be NULL, at its beginning; the rest is undefined. */
moit_gl_status moit_gl_make_buffer(moit_gl *gl, int64_t size, const void *data, int64_t given,
                                   moit_gl_buffer **made);
void moit_gl_free_buffer(moit_gl_buffer *buffer);
int64_t moit_gl_buffer_size(const moit_gl_buffer *buffer);
unsigned moit_gl_buffer_name(const moit_gl_buffer *buffer);
moit_gl_status moit_gl_write_buffer(moit_gl_buffer *buffer, int64_t offset, int64_t size,
                                    const void *data);
moit_gl_status moit_gl_read_buffer(moit_gl_buffer *buffer, int64_t offset, int64_t size,
                                   void *data);
moit_gl_status moit_gl_fill_buffer(moit_gl_buffer *buffer, uint32_t word);

typedef enum moit_gl_kind {
    MOIT_GL_REAL = 0, /* floats and normalised integers: read as float */
    MOIT_GL_WHOLE,    /* integers */
    MOIT_GL_DEPTH,
} moit_gl_kind;

/* What an item of an array is that goes into a texture or comes from one. */
typedef enum moit_gl_item {
    MOIT_GL_ITEM_FLOAT32 = 0,
    MOIT_GL_ITEM_FLOAT16,
    MOIT_GL_ITEM_UINT32,
    MOIT_GL_ITEM_UINT16,
    MOIT_GL_ITEM_UINT8,
} moit_gl_item;

typedef struct moit_gl_texture_info {
    const char *format;
    int width, height, channels;
    moit_gl_kind kind;
    unsigned name;
    bool wrapped;
} moit_gl_texture_info;

/* Two-dimensional, one level. Formats: r8 rgba8 r16 rg16 rgba16 r16f rg16f rgba16f r32f rg32f
 * rgba32f r11g11b10f r32ui rg32ui rgba32ui rgba16ui depth32f. */
moit_gl_status moit_gl_make_texture(moit_gl *gl, const char *format, int width, int height,
                                    moit_gl_texture **made);
/* Somebody else's texture in the same context; never deleted by us. */
moit_gl_status moit_gl_wrap_texture(moit_gl *gl, unsigned name, moit_gl_texture **made);
void moit_gl_free_texture(moit_gl_texture *texture);
const moit_gl_texture_info *moit_gl_get_texture_info(const moit_gl_texture *texture);
/* `count` items: height times width times channels. Row 0 is GL's first. */
moit_gl_status moit_gl_read_texture(moit_gl_texture *texture, moit_gl_item item, int64_t count,
                                    void *data);
moit_gl_status moit_gl_write_texture(moit_gl_texture *texture, moit_gl_item item, int64_t count,
                                     const void *data);
/* To `values`, one a channel; depth textures have one. */
moit_gl_status moit_gl_clear_texture(moit_gl_texture *texture, const double values[4]);

/* ---- Passes ---------------------------------------------------------------------------------- */

typedef struct moit_gl_bound_buffer {
    moit_gl_buffer *buffer; /* NULL: none */
    int64_t offset, size;   /* size 0: to its end */
} moit_gl_bound_buffer;

typedef struct moit_gl_bindings {
    moit_gl_bound_buffer buffers[MOIT_GL_BUFFERS];
    moit_gl_texture *textures[MOIT_GL_TEXTURES]; /* sampled as they are: nearest, clamped */
    moit_gl_texture *images[MOIT_GL_IMAGES];
} moit_gl_bindings;

/* Every pass sees what earlier ones wrote. */
moit_gl_status moit_gl_dispatch(moit_gl *gl, moit_gl_program *program, const int64_t groups[3],
                                const moit_gl_bindings *bindings);

typedef enum moit_gl_blend {
    MOIT_GL_REPLACE = 0,
    MOIT_GL_ADD,
    MOIT_GL_OVER,  /* of premultiplied colour */
    MOIT_GL_UNDER, /* likewise, behind what is there */
    MOIT_GL_MULTIPLY,
    MOIT_GL_MULTIPLY_COMPLEMENT, /* by 1 - what is written */
    MOIT_GL_GREATEST,
    MOIT_GL_LEAST,
    MOIT_GL_BLENDS
} moit_gl_blend;

typedef enum moit_gl_depth_test {
    MOIT_GL_ANY_DEPTH = 0,
    MOIT_GL_LESS,
    MOIT_GL_LESS_OR_EQUAL
} moit_gl_depth_test;

typedef struct moit_gl_target {
    moit_gl_texture *texture;
    moit_gl_blend blend;
} moit_gl_target;

typedef struct moit_gl_drawing {
    int64_t first, vertices; /* triangles; shaders fetch by gl_VertexID */
    int targets;
    moit_gl_target target[MOIT_GL_TARGETS];
    moit_gl_texture *depth; /* or NULL */
    moit_gl_depth_test depth_test;
    bool depth_write;
    int width, height; /* 0: those of the targets */
} moit_gl_drawing;

/* No culling, no scissor; depth from 0 to 1 over [-1, 1]. */
moit_gl_status moit_gl_draw(moit_gl *gl, moit_gl_program *program, const moit_gl_drawing *drawing,
                            const moit_gl_bindings *bindings);

moit_gl_status moit_gl_finish(moit_gl *gl);

/* ---- Times ----------------------------------------------------------------------------------- */

/* Times nest. Queries of the device's clock; where the device is a processor, the clock's monotonic
 * time and a glFinish on both sides. */
moit_gl_status moit_gl_begin_time(moit_gl *gl);
moit_gl_status moit_gl_end_time(moit_gl *gl, int *ticket);
moit_gl_status moit_gl_seconds(moit_gl *gl, int ticket, double *seconds); /* once a ticket */

#ifdef __cplusplus
}
#endif
#endif
