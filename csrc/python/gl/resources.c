/* Buffer and Texture: arrays in, arrays out. */
#include "binding.h"

/* ---- Buffer ---------------------------------------------------------------------------------- */

PyObject *make_buffer(context_object *context, Py_ssize_t size, PyObject *data) {
    PyTypeObject *type = state_of(Py_TYPE(context))->Buffer;
    Py_buffer view = {.buf = NULL};
    PyObject *result = NULL;
    if (data != Py_None) {
        if (PyObject_GetBuffer(data, &view, PyBUF_C_CONTIGUOUS)) return NULL;
        if (view.len > size) {
            PyErr_Format(PyExc_ValueError, "data: expected at most %zd bytes, got %zd", size,
                         view.len);
            goto done;
        }
    }
    buffer_object *self = (buffer_object *)type->tp_alloc(type, 0);
    if (!self) goto done;
    self->context = (context_object *)Py_NewRef(context);
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_make_buffer(context->gl, size, view.buf, view.len, &self->buffer);
    Py_END_ALLOW_THREADS
    if (!check_status(type, status)) result = Py_NewRef(self);
    Py_DECREF(self);
done:
    PyBuffer_Release(&view);
    return result;
}

static void deallocate_buffer(PyObject *object) {
    buffer_object *self = (buffer_object *)object;
    moit_gl_free_buffer(self->buffer);
    free_object(object, self->context);
}

/* `array` is read from (write) or filled. */
static PyObject *transfer(PyObject *object, PyObject *args, PyObject *kwargs, bool fill) {
    static char *read_names[] = {"into", "offset", NULL}, *write_names[] = {"data", "offset", NULL};
    buffer_object *self = (buffer_object *)object;
    PyObject *array;
    long long offset = 0;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, fill ? "O|L:read" : "O|L:write",
                                     fill ? read_names : write_names, &array, &offset))
        return NULL;
    Py_buffer view;
    if (PyObject_GetBuffer(array, &view, PyBUF_C_CONTIGUOUS | (fill ? PyBUF_WRITABLE : 0)))
        return NULL;
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = (fill ? moit_gl_read_buffer(self->buffer, offset, view.len, view.buf)
                   : moit_gl_write_buffer(self->buffer, offset, view.len, view.buf));
    Py_END_ALLOW_THREADS
    PyBuffer_Release(&view);
    if (check_status(Py_TYPE(self), status)) return NULL;
    Py_RETURN_NONE;
}

static PyObject *read_buffer(PyObject *self, PyObject *args, PyObject *kwargs) {
    return transfer(self, args, kwargs, true);
}

static PyObject *write_buffer(PyObject *self, PyObject *args, PyObject *kwargs) {
    return transfer(self, args, kwargs, false);
}

static PyObject *buffer_size(PyObject *self, void *Py_UNUSED(closure)) {
    return PyLong_FromLongLong(moit_gl_buffer_size(((buffer_object *)self)->buffer));
}

static PyObject *buffer_name(PyObject *self, void *Py_UNUSED(closure)) {
    return PyLong_FromUnsignedLong(moit_gl_buffer_name(((buffer_object *)self)->buffer));
}

static PyMethodDef buffer_methods[] = {
    {"read", (PyCFunction)(void (*)(void))read_buffer, METH_VARARGS | METH_KEYWORDS,
     "read($self, into, offset=0)\n--\n\nFill a writable contiguous array."},
    {"write", (PyCFunction)(void (*)(void))write_buffer, METH_VARARGS | METH_KEYWORDS,
     "write($self, data, offset=0)\n--\n\nCopy a contiguous array into the buffer."},
    {NULL, NULL, 0, NULL},
};

static PyGetSetDef buffer_members[] = {
    {"size", buffer_size, NULL, "bytes", NULL},
    {"glo", buffer_name, NULL, "its name in GL", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};

static PyType_Slot buffer_slots[] = {
    {Py_tp_dealloc, deallocate_buffer},
    {Py_tp_methods, buffer_methods},
    {Py_tp_getset, buffer_members},
    {Py_tp_doc, "What Context.buffer makes."},
    {0, NULL},
};

PyType_Spec buffer_spec = {
    .name = "moit._gl.Buffer",
    .basicsize = sizeof(buffer_object),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION,
    .slots = buffer_slots,
};

/* ---- Texture --------------------------------------------------------------------------------- */

static PyObject *texture_from(context_object *context, const char *format, int width, int height,
                              unsigned name) {
    PyTypeObject *type = state_of(Py_TYPE(context))->Texture;
    texture_object *self = (texture_object *)type->tp_alloc(type, 0);
    if (!self) return NULL;
    self->context = (context_object *)Py_NewRef(context);
    moit_gl_status status;
    Py_BEGIN_ALLOW_THREADS
    status = (format ? moit_gl_make_texture(context->gl, format, width, height, &self->texture)
                     : moit_gl_wrap_texture(context->gl, name, &self->texture));
    Py_END_ALLOW_THREADS
    if (!check_status(type, status)) return (PyObject *)self;
    Py_DECREF(self);
    return NULL;
}

PyObject *make_texture(context_object *context, const char *format, int width, int height) {
    return texture_from(context, format, width, height, 0);
}

PyObject *wrap_texture(context_object *context, unsigned name) {
    return texture_from(context, NULL, 0, 0, name);
}

static void deallocate_texture(PyObject *object) {
    texture_object *self = (texture_object *)object;
    moit_gl_free_texture(self->texture);
    free_object(object, self->context);
}

/* What the items of an array are: by its format, native byte order only. */
static int item_of(const Py_buffer *view, moit_gl_item *item) {
    const char *format = view->format ? view->format : "B";
    if (*format == '@' || *format == '=') ++format;
    static const struct {
        char letter;
        Py_ssize_t size;
        moit_gl_item item;
    } items[] = {
        {'f', 4, MOIT_GL_ITEM_FLOAT32}, {'e', 2, MOIT_GL_ITEM_FLOAT16},
        {'I', 4, MOIT_GL_ITEM_UINT32},  {'L', 4, MOIT_GL_ITEM_UINT32},
        {'H', 2, MOIT_GL_ITEM_UINT16},  {'B', 1, MOIT_GL_ITEM_UINT8},
    };
    for (size_t i = 0; i < sizeof items / sizeof *items; ++i)
        if (format[0] == items[i].letter && !format[1] && view->itemsize == items[i].size) {
            *item = items[i].item;
            return 0;
        }
    PyErr_Format(PyExc_TypeError,
                 "pixels: expected float32, float16, uint32, uint16 or uint8, got format %.20s",
                 view->format ? view->format : "B");
    return -1;
}

static PyObject *move_pixels(PyObject *object, PyObject *array, bool fill) {
    texture_object *self = (texture_object *)object;
    Py_buffer view;
    moit_gl_item item;
    if (PyObject_GetBuffer(array, &view,
                           PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (fill ? PyBUF_WRITABLE : 0)))
        return NULL;
    PyObject *result = NULL;
    if (item_of(&view, &item)) goto done;
    moit_gl_status status;
    int64_t count = view.len / view.itemsize;
    Py_BEGIN_ALLOW_THREADS
    status = (fill ? moit_gl_read_texture(self->texture, item, count, view.buf)
                   : moit_gl_write_texture(self->texture, item, count, view.buf));
    Py_END_ALLOW_THREADS
    if (!check_status(Py_TYPE(self), status)) result = Py_NewRef(Py_None);
done:
    PyBuffer_Release(&view);
    return result;
}

static PyObject *read_texture(PyObject *self, PyObject *into) {
    return move_pixels(self, into, true);
}

static PyObject *write_texture(PyObject *self, PyObject *data) {
    return move_pixels(self, data, false);
}

enum texture_member { FORMAT, WIDTH, HEIGHT, CHANNELS, NAME };

static PyObject *texture_member(PyObject *self, void *closure) {
    const moit_gl_texture_info *info = moit_gl_get_texture_info(((texture_object *)self)->texture);
    switch ((enum texture_member)(intptr_t)closure) {
    case FORMAT: return PyUnicode_FromString(info->format);
    case WIDTH: return PyLong_FromLong(info->width);
    case HEIGHT: return PyLong_FromLong(info->height);
    case CHANNELS: return PyLong_FromLong(info->channels);
    case NAME: break;
    }
    return PyLong_FromUnsignedLong(info->name);
}

static PyMethodDef texture_methods[] = {
    {"read", read_texture, METH_O,
     "read($self, into, /)\n--\n\nFill an array (height, width, channels); row 0 is GL's first."},
    {"write", write_texture, METH_O,
     "write($self, data, /)\n--\n\nFrom an array as `read` fills it."},
    {NULL, NULL, 0, NULL},
};

static PyGetSetDef texture_members[] = {
    {"format", texture_member, NULL, "such as rgba16f", (void *)FORMAT},
    {"width", texture_member, NULL, "pixels", (void *)WIDTH},
    {"height", texture_member, NULL, "pixels", (void *)HEIGHT},
    {"channels", texture_member, NULL, "numbers a pixel", (void *)CHANNELS},
    {"glo", texture_member, NULL, "its name in GL", (void *)NAME},
    {NULL, NULL, NULL, NULL, NULL},
};

static PyType_Slot texture_slots[] = {
    {Py_tp_dealloc, deallocate_texture},
    {Py_tp_methods, texture_methods},
    {Py_tp_getset, texture_members},
    {Py_tp_doc, "What Context.texture and Context.wrap_texture make."},
    {0, NULL},
};

PyType_Spec texture_spec = {
    .name = "moit._gl.Texture",
    .basicsize = sizeof(texture_object),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION,
    .slots = texture_slots,
};
