/* Program: compiled from texts; uniforms from Python's numbers. */
#include "binding.h"

static const char *const stage_names[] = {"compute", "vertex", "fragment", "link"};

static PyObject *raise_shader_error(PyTypeObject *type, moit_gl_stage stage) {
    PyObject *log = PyUnicode_DecodeUTF8(moit_gl_message(), (Py_ssize_t)strlen(moit_gl_message()),
                                         "replace"),
             *error = NULL, *name = PyUnicode_FromString(stage_names[stage]);
    if (log && name) error = PyObject_CallOneArg(state_of(type)->ShaderError, log);
    if (error && !PyObject_SetAttrString(error, "stage", name))
        PyErr_SetObject(state_of(type)->ShaderError, error);
    Py_XDECREF(log);
    Py_XDECREF(name);
    Py_XDECREF(error);
    return NULL;
}

PyObject *make_program(context_object *context, PyObject *stages) {
    const char *text[MOIT_GL_STAGES] = {NULL};
    PyObject *held[MOIT_GL_STAGES] = {NULL}, *result = NULL;
    Py_ssize_t found = 0;
    if (!PyMapping_Check(stages)) {
        PyErr_SetString(PyExc_TypeError, "stages: expected a mapping of names to texts");
        return NULL;
    }
    for (int i = 0; i < MOIT_GL_STAGES; ++i) {
        if (!PyMapping_HasKeyString(stages, stage_names[i])) continue;
        held[i] = PyMapping_GetItemString(stages, stage_names[i]);
        if (!held[i] || !(text[i] = PyUnicode_AsUTF8(held[i]))) goto done;
        ++found;
    }
    if (found != PyMapping_Size(stages)) {
        PyErr_SetString(PyExc_ValueError,
                        "stages: expected compute, or vertex and fragment, and nothing else");
        goto done;
    }
    PyTypeObject *type = state_of(Py_TYPE(context))->Program;
    program_object *self = (program_object *)type->tp_alloc(type, 0);
    if (!self) goto done;
    self->context = (context_object *)Py_NewRef(context);
    moit_gl_status status;
    moit_gl_stage failed;
    Py_BEGIN_ALLOW_THREADS
    status = moit_gl_compile(context->gl, text, &self->program, &failed);
    Py_END_ALLOW_THREADS
    if (status == MOIT_GL_OK) result = Py_NewRef(self);
    else if (status == MOIT_GL_BAD_SHADER) raise_shader_error(type, failed);
    else check_status(type, status);
    Py_DECREF(self);
done:
    for (int i = 0; i < MOIT_GL_STAGES; ++i) Py_XDECREF(held[i]);
    return result;
}

static void deallocate(PyObject *object) {
    program_object *self = (program_object *)object;
    moit_gl_free_program(self->program);
    free_object(object, self->context);
}

static PyType_Slot slots[] = {
    {Py_tp_dealloc, deallocate},
    {Py_tp_doc, "What Context.program makes."},
    {0, NULL},
};

PyType_Spec program_spec = {
    .name = "moit._gl.Program",
    .basicsize = sizeof(program_object),
    .flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION,
    .slots = slots,
};

/* ---- Uniforms -------------------------------------------------------------------------------- */

/* Numbers as they are gathered from nested sequences. */
typedef struct {
    const moit_gl_uniform *uniform;
    char *values;
    Py_ssize_t count, room;
} gathered;

static size_t scalar_size(moit_gl_scalar scalar) { return scalar == MOIT_GL_FLOAT64 ? 8 : 4; }

static int wrong_number(const gathered *all, PyObject *number, const char *needed) {
    PyErr_Format(PyExc_TypeError, "uniform %s: expected %s, got %R", all->uniform->name, needed,
                 number);
    return -1;
}

static int gather_number(gathered *all, PyObject *number) {
    if (all->count == all->room) {
        Py_ssize_t room = all->room ? 2 * all->room : 16;
        char *values = PyMem_Realloc(all->values, (size_t)room * 8);
        if (!values) {
            PyErr_NoMemory();
            return -1;
        }
        all->values = values;
        all->room = room;
    }
    char *place = all->values + (size_t)all->count++ * scalar_size(all->uniform->scalar);
    switch (all->uniform->scalar) {
    case MOIT_GL_FLOAT32:
    case MOIT_GL_FLOAT64: {
        double value = PyFloat_AsDouble(number);
        if (value == -1.0 && PyErr_Occurred()) {
            PyErr_Clear();
            return wrong_number(all, number, "numbers");
        }
        if (all->uniform->scalar == MOIT_GL_FLOAT64) memcpy(place, &value, sizeof value);
        else memcpy(place, &(float){(float)value}, sizeof(float));
        return 0;
    }
    case MOIT_GL_TRUTH: {
        int truth = PyObject_IsTrue(number);
        if (truth < 0) return -1;
        memcpy(place, &(int32_t){truth}, sizeof(int32_t));
        return 0;
    }
    case MOIT_GL_INT32:
    case MOIT_GL_UINT32: break;
    }
    bool is_signed = all->uniform->scalar == MOIT_GL_INT32;
    long long least = is_signed ? INT32_MIN : 0, most = is_signed ? INT32_MAX : UINT32_MAX;
    PyObject *index = PyNumber_Index(number);
    if (!index) {
        PyErr_Clear();
        return wrong_number(all, number, "integers");
    }
    int overflow;
    long long value = PyLong_AsLongLongAndOverflow(index, &overflow);
    Py_DECREF(index);
    if (overflow || value < least || value > most) {
        PyErr_Format(PyExc_ValueError, "uniform %s: expected %lld to %lld, got %R",
                     all->uniform->name, least, most, number);
        return -1;
    }
    memcpy(place, &(uint32_t){(uint32_t)value}, sizeof(uint32_t));
    return 0;
}

static int gather(gathered *all, PyObject *value, int depth) {
    if (PyFloat_Check(value) || PyLong_Check(value)) return gather_number(all, value);
    if (PyUnicode_Check(value) || PyBytes_Check(value) || depth > 4)
        return wrong_number(all, value, "numbers");
    Py_ssize_t length = PySequence_Check(value) ? PySequence_Size(value) : -1;
    if (length < 0) { /* a number of NumPy's, or an array without dimensions */
        PyErr_Clear();
        return gather_number(all, value);
    }
    for (Py_ssize_t i = 0; i < length; ++i) {
        PyObject *item = PySequence_GetItem(value, i);
        int failed = !item || gather(all, item, depth + 1);
        Py_XDECREF(item);
        if (failed) return -1;
    }
    return 0;
}

static int set_one(program_object *program, PyObject *name, PyObject *value) {
    const char *text = PyUnicode_AsUTF8(name);
    if (!text) return -1;
    const moit_gl_uniform *uniform = moit_gl_find_uniform(program->program, text);
    if (!uniform) return 0; /* not there, or dropped by the compiler */
    gathered all = {.uniform = uniform};
    int failed = gather(&all, value, 0);
    bool fits = uniform->array ? all.count && all.count % uniform->components == 0
                               : all.count == uniform->components;
    if (!failed && (!fits || all.count > INT_MAX)) {
        PyErr_Format(PyExc_ValueError, "uniform %s: expected %d number(s)%s, got %zd", text,
                     uniform->components, uniform->array ? " for each of its members" : "",
                     all.count);
        failed = -1;
    }
    if (!failed)
        failed = check_status(Py_TYPE(program),
                              moit_gl_set_uniform(program->program, uniform, all.values,
                                                  (int)(all.count / uniform->components)));
    PyMem_Free(all.values);
    return failed;
}

int set_uniforms(program_object *program, PyObject *uniforms) {
    if (!uniforms || uniforms == Py_None) return 0;
    PyObject *items = PyMapping_Items(uniforms);
    if (!items) return -1;
    int failed = 0;
    for (Py_ssize_t i = 0; !failed && i < PyList_GET_SIZE(items); ++i) {
        PyObject *pair = PyList_GET_ITEM(items, i);
        if (!PyTuple_Check(pair) || PyTuple_GET_SIZE(pair) != 2) {
            PyErr_SetString(PyExc_TypeError, "uniforms: expected a mapping");
            failed = -1;
        } else {
            failed = set_one(program, PyTuple_GET_ITEM(pair, 0), PyTuple_GET_ITEM(pair, 1));
        }
    }
    Py_DECREF(items);
    return failed;
}
