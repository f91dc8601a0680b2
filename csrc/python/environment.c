/* What was compiled in, and what this machine can run. */
#include "binding.h"

#include <string.h>

#if defined(__clang__)
#define COMPILER "clang " __clang_version__
#elif defined(__GNUC__)
#define COMPILER "gcc " __VERSION__
#else
#define COMPILER "unknown"
#endif

static PyObject *build_info(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(arguments)) {
    char able[64] = "";
    for (int isa = 0; isa < MOIT_ISA_COUNT; ++isa)
        if (moit_isa_supported((moit_isa)isa)) {
            if (*able) strcat(able, ", ");
            strcat(able, moit_isa_name((moit_isa)isa));
        }
    return Py_BuildValue("{s:s,s:s,s:s}", "compiler", COMPILER, "instruction sets", able,
                         "instruction set in use", moit_isa_name(moit_chosen_isa()));
}

static PyMethodDef methods[] = {
    {"build_info", build_info, METH_NOARGS,
     "build_info()\n--\n\nThe compiler and the instruction sets, as a dict of strings."},
    {"use_instruction_set", moit_use_isa, METH_O,
     "use_instruction_set(name, /)\n--\n\nOf calls from now on; gives the name of that before."},
    {NULL, NULL, 0, NULL},
};

int moit_add_environment(PyObject *module) { return PyModule_AddFunctions(module, methods); }
