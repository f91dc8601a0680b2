/* What the files of moit._gl share. */
#ifndef MOIT_GL_BINDING_H
#define MOIT_GL_BINDING_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "moit_gl.h"

typedef struct {
    PyObject *GpuError, *ShaderError;
    PyTypeObject *Context, *Program, *Buffer, *Texture;
} module_state;

typedef struct {
    PyObject_HEAD moit_gl *gl; /* NULL until __init__ has opened it */
    PyObject *info;
} context_object;

/* Programs, buffers and textures keep their context alive, so that it is freed last. */
typedef struct {
    PyObject_HEAD context_object *context;
    moit_gl_program *program;
} program_object;

typedef struct {
    PyObject_HEAD context_object *context;
    moit_gl_buffer *buffer;
} buffer_object;

typedef struct {
    PyObject_HEAD context_object *context;
    moit_gl_texture *texture;
} texture_object;

/* The state of the module that `type`, one of its own, belongs to. */
module_state *state_of(PyTypeObject *type);

/* 0, or -1 with the exception that `status` stands for. */
int check_status(PyTypeObject *type, moit_gl_status status);

/* The texts of shaders/ and csrc/kernels, which the build puts into a table; a last one without a
 * name. */
typedef struct {
    const char *name, *text;
} shader_text;
extern const shader_text shader_texts[];

extern PyType_Spec context_spec, program_spec, buffer_spec, texture_spec;

PyObject *make_program(context_object *context, PyObject *stages);
PyObject *make_buffer(context_object *context, Py_ssize_t size, PyObject *data);
PyObject *make_texture(context_object *context, const char *format, int width, int height);
PyObject *wrap_texture(context_object *context, unsigned name);
/* What is common to the deallocators of heap types. */
void free_object(PyObject *self, context_object *context);

/* From a mapping of names to numbers, sequences of them or arrays; NULL is none. */
int set_uniforms(program_object *program, PyObject *uniforms);

/* Whether `self` has a context; false with an exception where its __init__ failed or never ran. */
bool opened(context_object *self);

/* Passes and times (passes.c); methods of Context. */
PyObject *dispatch(PyObject *self, PyObject *args, PyObject *kwargs);
PyObject *draw(PyObject *self, PyObject *args, PyObject *kwargs);
PyObject *clear(PyObject *self, PyObject *args);
PyObject *fill(PyObject *self, PyObject *args);
PyObject *begin_time(PyObject *self, PyObject *ignored);
PyObject *end_time(PyObject *self, PyObject *ignored);
PyObject *seconds(PyObject *self, PyObject *ticket);
extern const char dispatch_doc[], draw_doc[], clear_doc[], fill_doc[], begin_time_doc[],
    end_time_doc[], seconds_doc[];

#endif
