#include "binding.h"

static bool python_wants_to_stop(void *context) {
    core_call *call = context;
    PyEval_RestoreThread(call->python);
    bool stop = PyErr_CheckSignals() != 0;
    call->python = PyEval_SaveThread();
    return stop;
}

void begin_call(core_call *call, int threads) {
    call->run = (moit_run){.threads = threads < 1 ? 1 : threads,
                           .interrupted = python_wants_to_stop,
                           .context = call};
    call->python = PyEval_SaveThread();
}

int end_call(core_call *call, moit_status status) {
    PyEval_RestoreThread(call->python);
    switch (status) {
    case MOIT_OK: return 0;
    case MOIT_INTERRUPTED: return -1; /* the signal handler's exception is set */
    case MOIT_NO_MEMORY: break;
    }
    PyErr_NoMemory();
    return -1;
}

PyArrayObject *array_of(PyObject *object, int type, int ndim, const char *name) {
    PyArrayObject *array =
        (PyArrayObject *)PyArray_FROM_OTF(object, type, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED);
    if (array && PyArray_NDIM(array) != ndim) {
        PyErr_Format(PyExc_ValueError, "%s: expected %d dimension(s), got %d", name, ndim,
                     PyArray_NDIM(array));
        Py_CLEAR(array);
    }
    return array;
}
