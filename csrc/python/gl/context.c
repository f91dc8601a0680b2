/* Context: opened, entered, left, closed; what it makes. */
#include "binding.h"

#include <structmember.h>

static int add_to_info(PyObject *info, const char *key, PyObject *value) {
    if (!value) return -1;
    int failed = PyDict_SetItemString(info, key, value);
    Py_DECREF(value);
    return failed;
}

static PyObject *extensions_of(context_object *self) {
    PyObject *names = PyList_New(0), *set = NULL;
    if (!names || check_status(Py_TYPE(self), moit_gl_enter(self->gl))) goto done;
    for (int i = 0; i < moit_gl_get_info(self->gl)->extensions; ++i) {
        PyObject *name = PyUnicode_FromString(moit_gl_extension(self->gl, i));
        int failed = !name || PyList_Append(names, name);
        Py_XDECREF(name);
        if (failed) goto leave;
    }
    set = PyFrozenSet_New(names);
leave:
    if (check_status(Py_TYPE(self), moit_gl_exit(self->gl))) Py_CLEAR(set);
done:
    Py_XDECREF(names);
    return set;
}

static PyObject *info_of(context_object *self) {
    const moit_gl_info *found = moit_gl_get_info(self->gl);
    PyObject *info = PyDict_New();
    if (!info || add_to_info(info, "renderer", PyUnicode_FromString(found->renderer))
        || add_to_info(info, "vendor", PyUnicode_FromString(found->vendor))
        || add_to_info(info, "version", PyUnicode_FromString(found->version))
        || add_to_info(info, "platform", PyUnicode_FromString(found->platform))
        || add_to_info(info, "software", PyBool_FromLong(found->software))
        || add_to_info(info, "storage_bytes", PyLong_FromLongLong(found->storage_bytes))
        || add_to_info(info, "storage_alignment", PyLong_FromLongLong(found->storage_alignment))
        || add_to_info(info, "storage_blocks", PyLong_FromLong(found->storage_blocks))
        || add_to_info(info, "groups", PyLong_FromLongLong(found->groups))
        || add_to_info(info, "texture_side", PyLong_FromLong(found->texture_side))
        || add_to_info(info, "color_targets", PyLong_FromLong(found->color_targets))
        || add_to_info(info, "extensions", extensions_of(self)))
        Py_CLEAR(info);
    return info;
}

static int initialize(PyObject *object, PyObject *args, PyObject *kwargs) {
    static char *names[] = {"index", "adopt", NULL};
    context_object *self = (context_object *)object;
    PyObject *index = Py_None;
    int adopt = 0, device = MOIT_GL_ANY;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "|$Op:Context", names, &index, &adopt))
        return -1;
    if (self->gl) {
        PyErr_SetString(PyExc_RuntimeError, "the context is open already");
        return -1;
    }
    if (index != Py_None) {
        long number = PyLong_AsLong(index);
        if (number == -1 && PyErr_Occurred()) {
            if (!PyErr_ExceptionMatches(PyExc_OverflowError)) return -1;
            PyErr_Clear();
        }
        device = number < 0 || number > INT_MAX ? INT_MAX : (int)number; /* none has so many */
        if (number < 0) {
            PyErr_Format(state_of(Py_TYPE(self))->GpuError,
                         "index: expected None or the number of a device of EGL, got %S", index);
            return -1;
        }
    }
    if (adopt) device = MOIT_GL_ADOPT;
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_open(device, &self->gl);
    Py_END_ALLOW_THREADS
    if (check_status(Py_TYPE(self), status)) return -1;
    self->info = info_of(self);
    return self->info ? 0 : -1;
}

static void deallocate(PyObject *object) {
    context_object *self = (context_object *)object;
    PyTypeObject *type = Py_TYPE(self);
    moit_gl_free(self->gl);
    Py_XDECREF(self->info);
    type->tp_free(self);
    Py_DECREF(type);
}

bool opened(context_object *self) {
    if (self->gl) return true;
    PyErr_SetString(state_of(Py_TYPE(self))->GpuError, "the device was never opened");
    return false;
}

#define WITHOUT_ARGUMENTS(name, function) \
    static PyObject *name(PyObject *object, PyObject *Py_UNUSED(ignored)) { \
        context_object *self = (context_object *)object; \
        if (!opened(self) || check_status(Py_TYPE(self), function(self->gl))) return NULL; \
        Py_RETURN_NONE; \
    }

WITHOUT_ARGUMENTS(enter, moit_gl_enter)
WITHOUT_ARGUMENTS(leave, moit_gl_exit)
WITHOUT_ARGUMENTS(close_context, moit_gl_close)

static PyObject *finish(PyObject *object, PyObject *Py_UNUSED(ignored)) {
    context_object *self = (context_object *)object;
    if (!opened(self)) return NULL;
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_finish(self->gl);
    Py_END_ALLOW_THREADS
    if (check_status(Py_TYPE(self), status)) return NULL;
    Py_RETURN_NONE;
}

static PyObject *function(PyObject *object, PyObject *argument) {
    context_object *self = (context_object *)object;
    const char *name = PyUnicode_AsUTF8(argument);
    if (!name || !opened(self)) return NULL;
    return PyLong_FromVoidPtr(moit_gl_function(self->gl, name));
}

static PyObject *program(PyObject *self, PyObject *stages) {
    return opened((context_object *)self) ? make_program((context_object *)self, stages) : NULL;
}

static PyObject *buffer(PyObject *self, PyObject *args, PyObject *kwargs) {
    static char *names[] = {"size", "data", NULL};
    Py_ssize_t size;
    PyObject *data = Py_None;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "n|O:buffer", names, &size, &data)) return NULL;
    return opened((context_object *)self) ? make_buffer((context_object *)self, size, data) : NULL;
}

static PyObject *texture(PyObject *self, PyObject *args, PyObject *kwargs) {
    static char *names[] = {"format", "width", "height", NULL};
    const char *format;
    int width, height;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "sii:texture", names, &format, &width, &height))
        return NULL;
    return opened((context_object *)self)
               ? make_texture((context_object *)self, format, width, height)
               : NULL;
}

static PyObject *wrap(PyObject *self, PyObject *argument) {
    unsigned long name = PyLong_AsUnsignedLong(argument);
    if (PyErr_Occurred()) return NULL;
    if (name > UINT_MAX) name = UINT_MAX; /* no name of GL's */
    return opened((context_object *)self) ? wrap_texture((context_object *)self, (unsigned)name)
                                          : NULL;
}

static PyMethodDef methods[] = {
    {"enter", enter, METH_NOARGS,
     "enter($self)\n--\n\nMake it current in this thread and remember what was. Nests."},
    {"exit", leave, METH_NOARGS, "exit($self)\n--\n\nUndo the last enter."},
    {"close", close_context, METH_NOARGS,
     "close($self)\n--\n\nFree everything made here; what is used later raises GpuError."},
    {"finish", finish, METH_NOARGS, "finish($self)\n--\n\nWait until all passes are done."},
    {"function", function, METH_O,
     "function($self, name, /)\n--\n\nThe address of a function of GL."},
    {"program", program, METH_O,
     "program($self, stages, /)\n--\n\nFrom {\"compute\": text} or {\"vertex\": text, "
     "\"fragment\": "
     "text}."},
    {"buffer", (PyCFunction)(void (*)(void))buffer, METH_VARARGS | METH_KEYWORDS,
     "buffer($self, size, data=None)\n--\n\nA buffer of `size` bytes that begins with data; "
     "the rest is undefined."},
    {"texture", (PyCFunction)(void (*)(void))texture, METH_VARARGS | METH_KEYWORDS,
     "texture($self, format, width, height)\n--\n\nA texture; its content is undefined."},
    {"wrap_texture", wrap, METH_O,
     "wrap_texture($self, name, /)\n--\n\nSomebody else's texture in this context, by its GL "
     "name."},
    {"dispatch", (PyCFunction)(void (*)(void))dispatch, METH_VARARGS | METH_KEYWORDS, dispatch_doc},
    {"draw", (PyCFunction)(void (*)(void))draw, METH_VARARGS | METH_KEYWORDS, draw_doc},
    {"clear", clear, METH_VARARGS, clear_doc},
    {"fill", fill, METH_VARARGS, fill_doc},
    {"begin_time", begin_time, METH_NOARGS, begin_time_doc},
    {"end_time", end_time, METH_NOARGS, end_time_doc},
    {"seconds", seconds, METH_O, seconds_doc},
    {NULL, NULL, 0, NULL},
};

static PyMemberDef members[] = {
    {"info", T_OBJECT_EX, offsetof(context_object, info), READONLY,
     "renderer, vendor, version, platform, software, extensions, and limits"},
    {NULL, 0, 0, 0, NULL},
};

PyDoc_STRVAR(doc, "Context(*, index=None, adopt=False)\n--\n\n"
                  "An OpenGL 4.5 core context on a device of EGL, or the one that is current.");

static PyType_Slot slots[] = {
    {Py_tp_new, PyType_GenericNew},
    {Py_tp_init, initialize},
    {Py_tp_dealloc, deallocate},
    {Py_tp_methods, methods},
    {Py_tp_members, members},
    {Py_tp_doc, (void *)doc},
    {0, NULL},
};

PyType_Spec context_spec = {
    .name = "moit._gl.Context",
    .basicsize = sizeof(context_object),
    .flags = Py_TPFLAGS_DEFAULT,
    .slots = slots,
};
