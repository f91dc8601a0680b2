/* Passes: dispatch and draw, with what is bound for them. */
#include "binding.h"

typedef struct {
    moit_gl_bindings bound;
    PyObject *items[3]; /* keep what is bound alive, whatever becomes of the mappings */
} held_bindings;

static void let_go(held_bindings *held) {
    for (int i = 0; i < 3; ++i) Py_CLEAR(held->items[i]);
}

/* The key of pair `i`, from 0 to `limit` - 1, and its value. */
static int pair_of(PyObject *items, Py_ssize_t i, const char *what, int limit, PyObject **value) {
    PyObject *pair = PyList_GET_ITEM(items, i);
    if (!PyTuple_Check(pair) || PyTuple_GET_SIZE(pair) != 2) {
        PyErr_Format(PyExc_TypeError, "%s: expected a mapping", what);
        return -1;
    }
    *value = PyTuple_GET_ITEM(pair, 1);
    long key = PyLong_AsLong(PyTuple_GET_ITEM(pair, 0));
    if (key == -1 && PyErr_Occurred()) return -1;
    if (key >= 0 && key < limit) return (int)key;
    PyErr_Format(PyExc_ValueError, "%s: expected bindings 0 to %d, got %ld", what, limit - 1, key);
    return -1;
}

static int hold_buffers(held_bindings *held, PyObject *mapping, module_state *state) {
    if (!mapping || mapping == Py_None) return 0;
    PyObject *items = held->items[0] = PyMapping_Items(mapping);
    if (!items) return -1;
    for (Py_ssize_t i = 0; i < PyList_GET_SIZE(items); ++i) {
        PyObject *value;
        int binding = pair_of(items, i, "buffers", MOIT_GL_BUFFERS, &value);
        if (binding < 0) return -1;
        long long offset = 0, size = 0;
        if (PyTuple_Check(value)
            && !PyArg_ParseTuple(value, "OLL;buffers: expected (buffer, offset, size)", &value,
                                 &offset, &size))
            return -1;
        if (!Py_IS_TYPE(value, state->Buffer)) {
            PyErr_Format(PyExc_TypeError, "buffers: expected a Buffer at %d, got %.80s", binding,
                         Py_TYPE(value)->tp_name);
            return -1;
        }
        held->bound.buffers[binding] =
            (moit_gl_bound_buffer){((buffer_object *)value)->buffer, offset, size};
    }
    return 0;
}

static int hold_textures(moit_gl_texture **places, PyObject **items, PyObject *mapping,
                         const char *what, int limit, module_state *state) {
    if (!mapping || mapping == Py_None) return 0;
    if (!(*items = PyMapping_Items(mapping))) return -1;
    for (Py_ssize_t i = 0; i < PyList_GET_SIZE(*items); ++i) {
        PyObject *value;
        int unit = pair_of(*items, i, what, limit, &value);
        if (unit < 0) return -1;
        if (!Py_IS_TYPE(value, state->Texture)) {
            PyErr_Format(PyExc_TypeError, "%s: expected a Texture at %d, got %.80s", what, unit,
                         Py_TYPE(value)->tp_name);
            return -1;
        }
        places[unit] = ((texture_object *)value)->texture;
    }
    return 0;
}

/* 0, or -1 with an exception; let_go in both cases. */
static int hold_bindings(held_bindings *held, PyObject *buffers, PyObject *textures,
                         PyObject *images, module_state *state) {
    return hold_buffers(held, buffers, state)
                   || hold_textures(held->bound.textures, &held->items[1], textures, "textures",
                                    MOIT_GL_TEXTURES, state)
                   || hold_textures(held->bound.images, &held->items[2], images, "images",
                                    MOIT_GL_IMAGES, state)
               ? -1
               : 0;
}

static int opened(context_object *self) {
    if (self->gl) return 1;
    PyErr_SetString(state_of(Py_TYPE(self))->GpuError, "the device was never opened");
    return 0;
}

const char dispatch_doc[] = "dispatch($self, program, groups, *, buffers=None, textures=None, "
                            "images=None, uniforms=None)\n--\n\n"
                            "Run a compute program in (x, y, z) work groups.";

PyObject *dispatch(PyObject *object, PyObject *args, PyObject *kwargs) {
    static char *names[] = {"program", "groups", "buffers", "textures", "images", "uniforms", NULL};
    context_object *self = (context_object *)object;
    module_state *state = state_of(Py_TYPE(self));
    PyObject *program, *buffers = NULL, *textures = NULL, *images = NULL, *uniforms = NULL;
    long long x, y, z;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "O!(LLL)|$OOOO:dispatch", names, state->Program,
                                     &program, &x, &y, &z, &buffers, &textures, &images, &uniforms)
        || !opened(self))
        return NULL;
    held_bindings held = {.items = {NULL}};
    PyObject *result = NULL;
    if (hold_bindings(&held, buffers, textures, images, state)
        || set_uniforms((program_object *)program, uniforms))
        goto done;
    moit_gl_status status;
    const int64_t groups[3] = {x, y, z};
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_dispatch(self->gl, ((program_object *)program)->program, groups, &held.bound);
    Py_END_ALLOW_THREADS
    if (!check_status(Py_TYPE(self), status)) result = Py_NewRef(Py_None);
done:
    let_go(&held);
    return result;
}
