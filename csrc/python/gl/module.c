/* moit._gl: the pass driver for Python. */
#include "binding.h"

module_state *state_of(PyTypeObject *type) { return PyType_GetModuleState(type); }

int check_status(PyTypeObject *type, moit_gl_status status) {
    switch (status) {
    case MOIT_GL_OK: return 0;
    case MOIT_GL_NO_MEMORY: PyErr_NoMemory(); return -1;
    case MOIT_GL_FAILED:
    case MOIT_GL_BAD_SHADER: break;
    }
    PyErr_SetString(state_of(type)->GpuError, moit_gl_message());
    return -1;
}

void free_object(PyObject *self, context_object *context) {
    PyTypeObject *type = Py_TYPE(self);
    type->tp_free(self);
    Py_XDECREF(context);
    Py_DECREF(type);
}

static int add_types(PyObject *module) {
    module_state *state = PyModule_GetState(module);
    struct {
        PyTypeObject **type;
        PyType_Spec *spec;
    } types[] = {{&state->Context, &context_spec},
                 {&state->Program, &program_spec},
                 {&state->Buffer, &buffer_spec},
                 {&state->Texture, &texture_spec}};
    for (size_t i = 0; i < sizeof types / sizeof *types; ++i) {
        PyObject *type = PyType_FromModuleAndSpec(module, types[i].spec, NULL);
        *types[i].type = (PyTypeObject *)type;
        if (!type || PyModule_AddType(module, *types[i].type)) return -1;
    }
    return 0;
}

static int add_exceptions(PyObject *module) {
    module_state *state = PyModule_GetState(module);
    PyObject *exceptions = PyImport_ImportModule("moit.checks.exceptions");
    if (!exceptions) return -1;
    state->GpuError = PyObject_GetAttrString(exceptions, "GpuError");
    Py_DECREF(exceptions);
    if (!state->GpuError) return -1;
    state->ShaderError = PyErr_NewExceptionWithDoc(
        "moit._gl.ShaderError",
        "A compiler's log; `stage` is compute, vertex, fragment, or link where they do not fit.",
        state->GpuError, NULL);
    return state->ShaderError ? PyModule_AddObjectRef(module, "ShaderError", state->ShaderError)
                              : -1;
}

/* ---- Shader texts ---------------------------------------------------------------------------- */

static PyObject *shader_names(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(ignored)) {
    PyObject *names = PyList_New(0);
    for (const shader_text *one = shader_texts; names && one->name; ++one) {
        PyObject *name = PyUnicode_FromString(one->name);
        if (!name || PyList_Append(names, name)) Py_CLEAR(names);
        Py_XDECREF(name);
    }
    return names;
}

static PyObject *shader_text_of(PyObject *Py_UNUSED(module), PyObject *name) {
    const char *asked = PyUnicode_AsUTF8(name);
    if (!asked) return NULL;
    for (const shader_text *one = shader_texts; one->name; ++one)
        if (strcmp(one->name, asked) == 0) return PyUnicode_FromString(one->text);
    Py_RETURN_NONE;
}

static PyMethodDef functions[] = {
    {"shader_names", shader_names, METH_NOARGS,
     "shader_names()\n--\n\nThe names of the texts that the build holds."},
    {"shader_text", shader_text_of, METH_O,
     "shader_text(name, /)\n--\n\nOne of these texts; None where there is none of that name."},
    {NULL, NULL, 0, NULL},
};

/* ---- The module ------------------------------------------------------------------------------ */

static int traverse(PyObject *module, visitproc visit, void *arg) {
    module_state *state = PyModule_GetState(module);
    if (!state) return 0;
    Py_VISIT(state->GpuError);
    Py_VISIT(state->ShaderError);
    Py_VISIT(state->Context);
    Py_VISIT(state->Program);
    Py_VISIT(state->Buffer);
    Py_VISIT(state->Texture);
    return 0;
}

static int clear_state(PyObject *module) {
    module_state *state = PyModule_GetState(module);
    if (!state) return 0;
    Py_CLEAR(state->GpuError);
    Py_CLEAR(state->ShaderError);
    Py_CLEAR(state->Context);
    Py_CLEAR(state->Program);
    Py_CLEAR(state->Buffer);
    Py_CLEAR(state->Texture);
    return 0;
}

static void free_module(void *module) { clear_state(module); }

static PyModuleDef_Slot slots[] = {
    {Py_mod_exec, add_exceptions},
    {Py_mod_exec, add_types},
#ifdef Py_mod_multiple_interpreters
    {Py_mod_multiple_interpreters, Py_MOD_MULTIPLE_INTERPRETERS_NOT_SUPPORTED},
#endif
    {0, NULL},
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "moit._gl",
    .m_doc =
        "The pass driver: contexts, buffers, textures, programs, and the passes that use them.",
    .m_size = sizeof(module_state),
    .m_methods = functions,
    .m_slots = slots,
    .m_traverse = traverse,
    .m_clear = clear_state,
    .m_free = free_module,
};

PyMODINIT_FUNC PyInit__gl(void) { return PyModuleDef_Init(&definition); }
