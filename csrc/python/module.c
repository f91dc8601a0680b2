/* moit._core: assembles what the other files of this folder define. */
#define MOIT_BINDING_MODULE
#include "binding.h"

static int import_numpy(PyObject *Py_UNUSED(module)) {
    import_array1(-1);
    return 0;
}

static PyModuleDef_Slot slots[] = {
    {Py_mod_exec, import_numpy},
    {Py_mod_exec, moit_choose_isa},
    {Py_mod_exec, moit_add_environment},
    {Py_mod_exec, moit_add_questions},
    {Py_mod_exec, moit_add_gradients},
    {Py_mod_exec, moit_add_fragments},
    {Py_mod_exec, moit_add_metrics},
    {Py_mod_exec, moit_add_deep},
    {Py_mod_exec, moit_add_deep_samples},
    {Py_mod_exec, moit_add_meshes},
    {Py_mod_exec, moit_add_passes},
    {Py_mod_exec, moit_add_mixed},
    {Py_mod_exec, moit_add_moments},
    {Py_mod_exec, moit_add_pixels},
    {Py_mod_exec, moit_add_shadows},
    {Py_mod_exec, moit_add_splats},
    {Py_mod_exec, moit_add_strokes},
    {Py_mod_exec, moit_add_grids},
#ifdef Py_mod_multiple_interpreters
    {Py_mod_multiple_interpreters, Py_MOD_MULTIPLE_INTERPRETERS_NOT_SUPPORTED}, /* as NumPy */
#endif
#ifdef Py_mod_gil
    {Py_mod_gil, Py_MOD_GIL_NOT_USED},
#endif
    {0, NULL},
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "moit._core",
    .m_doc = "The C core. Use the functions of moit, which check and explain.",
    .m_slots = slots,
};

PyMODINIT_FUNC PyInit__core(void) { return PyModuleDef_Init(&definition); }
