/* Passes: dispatch and draw, with what is bound for them; clear, fill, times. */
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

/* ---- Drawing --------------------------------------------------------------------------------- */

/* The place of `name` among `count` names; None is the first. */
static int choice(PyObject *name, const char *what, const char *const *names, int count) {
    if (name == Py_None) return 0;
    const char *text = PyUnicode_AsUTF8(name);
    if (!text) return -1;
    for (int i = 1; i < count; ++i)
        if (strcmp(text, names[i]) == 0) return i;
    PyObject *known = PyUnicode_FromString("None");
    for (int i = 1; known && i < count; ++i)
        Py_SETREF(known, PyUnicode_FromFormat("%U, %s", known, names[i]));
    if (known) PyErr_Format(PyExc_ValueError, "%s: expected one of %U; got %R", what, known, name);
    Py_XDECREF(known);
    return -1;
}

static int set_target(moit_gl_target *target, PyObject *texture, PyObject *blend,
                      module_state *state) {
    static const char *const blends[MOIT_GL_BLENDS] = {
        "", "add", "over", "under", "multiply", "multiply-complement", "max", "min"};
    if (!Py_IS_TYPE(texture, state->Texture)) {
        PyErr_Format(PyExc_TypeError, "targets: expected a Texture, got %.80s",
                     Py_TYPE(texture)->tp_name);
        return -1;
    }
    int chosen = choice(blend, "blend", blends, MOIT_GL_BLENDS);
    target->texture = ((texture_object *)texture)->texture;
    target->blend = (moit_gl_blend)chosen;
    return chosen < 0 ? -1 : 0;
}

/* Targets and how they blend, from sequences that `held` keeps. */
static int hold_targets(moit_gl_drawing *drawing, PyObject *held[2], PyObject *targets,
                        PyObject *blend, module_state *state) {
    held[0] = targets ? PySequence_Tuple(targets) : PyTuple_New(0);
    if (!held[0]) return -1;
    if (blend && PyUnicode_Check(blend)) {
        PyErr_SetString(PyExc_TypeError, "blend: expected a sequence, one for each target");
        return -1;
    }
    held[1] = blend ? PySequence_Tuple(blend) : PyTuple_New(0);
    if (!held[1]) return -1;
    Py_ssize_t count = PyTuple_GET_SIZE(held[0]), blends = PyTuple_GET_SIZE(held[1]);
    if (count > MOIT_GL_TARGETS || (blends && blends != count)) {
        PyErr_Format(PyExc_ValueError,
                     "targets, blend: expected at most %d targets and as many, or no, blends; got "
                     "%zd and %zd",
                     MOIT_GL_TARGETS, count, blends);
        return -1;
    }
    drawing->targets = (int)count;
    for (Py_ssize_t i = 0; i < count; ++i)
        if (set_target(&drawing->target[i], PyTuple_GET_ITEM(held[0], i),
                       blends ? PyTuple_GET_ITEM(held[1], i) : Py_None, state))
            return -1;
    return 0;
}

const char draw_doc[] =
    "draw($self, program, vertices, *, first=0, targets=(), depth=None, depth_test=None,\n"
    "     depth_write=False, blend=(), size=None, buffers=None, textures=None, images=None,\n"
    "     uniforms=None)\n--\n\n"
    "Draw triangles, whose shaders fetch by gl_VertexID; no culling, no scissor.";

PyObject *draw(PyObject *object, PyObject *args, PyObject *kwargs) {
    static char *names[] = {"program",    "vertices",    "first",    "targets", "depth",
                            "depth_test", "depth_write", "blend",    "size",    "buffers",
                            "textures",   "images",      "uniforms", NULL};
    static const char *const tests[] = {"", "less", "lequal"};
    context_object *self = (context_object *)object;
    module_state *state = state_of(Py_TYPE(self));
    PyObject *program, *targets = NULL, *depth = Py_None, *depth_test = Py_None, *blend = NULL,
                       *size = Py_None, *buffers = NULL, *textures = NULL, *images = NULL,
                       *uniforms = NULL;
    long long vertices, first = 0;
    int depth_write = 0;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "O!L|$LOOOpOOOOOO:draw", names, state->Program,
                                     &program, &vertices, &first, &targets, &depth, &depth_test,
                                     &depth_write, &blend, &size, &buffers, &textures, &images,
                                     &uniforms)
        || !opened(self))
        return NULL;
    moit_gl_drawing drawing = {
        .first = first, .vertices = vertices, .depth_write = depth_write != 0};
    int test = choice(depth_test, "depth_test", tests, 3);
    if (test < 0) return NULL;
    drawing.depth_test = (moit_gl_depth_test)test;
    if (depth != Py_None) {
        if (!Py_IS_TYPE(depth, state->Texture)) {
            PyErr_Format(PyExc_TypeError, "depth: expected a Texture or None, got %.80s",
                         Py_TYPE(depth)->tp_name);
            return NULL;
        }
        drawing.depth = ((texture_object *)depth)->texture;
    }
    if (size != Py_None) {
        if (!PyTuple_Check(size)) {
            PyErr_SetString(PyExc_TypeError, "size: expected (width, height) or None");
            return NULL;
        }
        if (!PyArg_ParseTuple(size, "ii;size: expected (width, height)", &drawing.width,
                              &drawing.height))
            return NULL;
        if (drawing.width < 1 || drawing.height < 1) {
            PyErr_Format(PyExc_ValueError, "size: expected at least 1 x 1, got %d x %d",
                         drawing.width, drawing.height);
            return NULL;
        }
    }
    held_bindings held = {.items = {NULL}};
    PyObject *kept[2] = {NULL, NULL}, *result = NULL;
    if (hold_targets(&drawing, kept, targets, blend, state)
        || hold_bindings(&held, buffers, textures, images, state)
        || set_uniforms((program_object *)program, uniforms))
        goto done;
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_draw(self->gl, ((program_object *)program)->program, &drawing, &held.bound);
    Py_END_ALLOW_THREADS
    if (!check_status(Py_TYPE(self), status)) result = Py_NewRef(Py_None);
done:
    let_go(&held);
    Py_XDECREF(kept[0]);
    Py_XDECREF(kept[1]);
    return result;
}

const char clear_doc[] = "clear($self, target, value, /)\n--\n\n"
                         "Set every pixel of a texture to `value`, one number a channel.";

PyObject *clear(PyObject *object, PyObject *args) {
    context_object *self = (context_object *)object;
    PyObject *texture, *value;
    if (!PyArg_ParseTuple(args, "O!O:clear", state_of(Py_TYPE(self))->Texture, &texture, &value)
        || !opened(self))
        return NULL;
    moit_gl_texture *target = ((texture_object *)texture)->texture;
    int channels = moit_gl_get_texture_info(target)->channels;
    double values[4] = {0.0};
    PyObject *numbers = PySequence_Tuple(value);
    if (!numbers) return NULL;
    Py_ssize_t count = PyTuple_GET_SIZE(numbers);
    for (Py_ssize_t i = 0; i < count && i < channels; ++i)
        values[i] = PyFloat_AsDouble(PyTuple_GET_ITEM(numbers, i));
    Py_DECREF(numbers);
    if (PyErr_Occurred()) return NULL;
    if (count != channels)
        return PyErr_Format(PyExc_ValueError, "value: expected %d number(s) for %s, got %zd",
                            channels, moit_gl_get_texture_info(target)->format, count);
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_clear_texture(target, values);
    Py_END_ALLOW_THREADS
    if (check_status(Py_TYPE(self), status)) return NULL;
    Py_RETURN_NONE;
}

const char fill_doc[] = "fill($self, buffer, word=0, /)\n--\n\n"
                        "Set every 32-bit word of a buffer to `word`.";

PyObject *fill(PyObject *object, PyObject *args) {
    context_object *self = (context_object *)object;
    PyObject *buffer, *number = NULL;
    if (!PyArg_ParseTuple(args, "O!|O:fill", state_of(Py_TYPE(self))->Buffer, &buffer, &number)
        || !opened(self))
        return NULL;
    unsigned long word = 0;
    if (number) {
        PyObject *index = PyNumber_Index(number);
        if (!index) return NULL;
        word = PyLong_AsUnsignedLong(index);
        Py_DECREF(index);
        if (PyErr_Occurred()) return NULL;
        if (word > UINT32_MAX)
            return PyErr_Format(PyExc_ValueError, "word: expected 32 bits, got %lu", word);
    }
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_fill_buffer(((buffer_object *)buffer)->buffer, (uint32_t)word);
    Py_END_ALLOW_THREADS
    if (check_status(Py_TYPE(self), status)) return NULL;
    Py_RETURN_NONE;
}

/* ---- Times ----------------------------------------------------------------------------------- */

const char begin_time_doc[] = "begin_time($self)\n--\n\nBegin to measure what passes take. Nests.";

PyObject *begin_time(PyObject *object, PyObject *Py_UNUSED(ignored)) {
    context_object *self = (context_object *)object;
    if (!opened(self)) return NULL;
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_begin_time(self->gl);
    Py_END_ALLOW_THREADS
    if (check_status(Py_TYPE(self), status)) return NULL;
    Py_RETURN_NONE;
}

const char end_time_doc[] =
    "end_time($self)\n--\n\nA ticket for the time since the last begin_time.";

PyObject *end_time(PyObject *object, PyObject *Py_UNUSED(ignored)) {
    context_object *self = (context_object *)object;
    if (!opened(self)) return NULL;
    int ticket = 0;
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_end_time(self->gl, &ticket);
    Py_END_ALLOW_THREADS
    return check_status(Py_TYPE(self), status) ? NULL : PyLong_FromLong(ticket);
}

const char seconds_doc[] = "seconds($self, ticket, /)\n--\n\n"
                           "The time of a ticket, once; waits for the device where it must.";

PyObject *seconds(PyObject *object, PyObject *argument) {
    context_object *self = (context_object *)object;
    long ticket = PyLong_AsLong(argument);
    if ((ticket == -1 && PyErr_Occurred()) || !opened(self)) return NULL;
    if (ticket < 0 || ticket > INT_MAX) ticket = -1;
    double found = 0.0;
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_seconds(self->gl, (int)ticket, &found);
    Py_END_ALLOW_THREADS
    return check_status(Py_TYPE(self), status) ? NULL : PyFloat_FromDouble(found);
}
