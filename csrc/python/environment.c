/* What was compiled in, and what this machine can run. */
#include "binding.h"

static PyMethodDef methods[] = {
    {NULL, NULL, 0, NULL},
};

int moit_add_environment(PyObject *module) { return PyModule_AddFunctions(module, methods); }
