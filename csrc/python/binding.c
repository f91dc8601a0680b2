#define _GNU_SOURCE
#include "binding.h"

#ifdef __linux__
#include <sched.h>
#endif
#include <stdlib.h>
#include <string.h>

/* Of the calls that begin from now on; results do not depend on it. */
static _Atomic(moit_isa) chosen_isa;

static bool choose(const char *name) {
    for (int isa = 0; isa < MOIT_ISA_COUNT; ++isa)
        if (strcmp(name, moit_isa_name((moit_isa)isa)) == 0 && moit_isa_supported((moit_isa)isa)) {
            chosen_isa = (moit_isa)isa;
            return true;
        }
    return false;
}

int moit_choose_isa(PyObject *Py_UNUSED(module)) {
    chosen_isa = moit_isa_best();
    const char *wanted = getenv("MOIT_ISA");
    if (!wanted || !*wanted || choose(wanted)) return 0;
    PyErr_Format(PyExc_ImportError,
                 "MOIT_ISA: expected base, avx2 or avx512 as far as this processor has it, got %s",
                 wanted);
    return -1;
}

PyObject *moit_use_isa(PyObject *Py_UNUSED(module), PyObject *name) {
    const char *text = PyUnicode_Check(name) ? PyUnicode_AsUTF8(name) : NULL;
    const char *before = moit_isa_name(chosen_isa);
    if (!text && PyErr_Occurred()) return NULL;
    if (!text || !choose(text))
        return PyErr_Format(PyExc_ValueError,
                            "expected an instruction set that this processor has, got %R", name);
    return PyUnicode_FromString(before);
}

moit_isa moit_chosen_isa(void) { return chosen_isa; }

static bool python_wants_to_stop(void *context) {
    core_call *call = context;
    PyEval_RestoreThread(call->python);
    bool stop = PyErr_CheckSignals() != 0;
    call->python = PyEval_SaveThread();
    return stop;
}

/* As many threads as processors work at a time, and each takes room: more would be slower. Two
 * there may be on any machine, or what goes wrong between them would be seen on some alone. */
static int useful(int threads) {
    int most = threads;
#ifdef __linux__
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0) most = CPU_COUNT(&set);
#endif
    if (most < 2) most = 2;
    return threads < 1 ? 1 : threads < most ? threads : most;
}

void begin_call(core_call *call, int threads) {
    call->run = (moit_run){.threads = useful(threads),
                           .isa = chosen_isa,
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

int number_type_of(PyObject *object) {
    bool wide = PyArray_Check(object) && PyArray_TYPE((PyArrayObject *)object) == NPY_DOUBLE;
    return wide ? NPY_DOUBLE : NPY_FLOAT;
}

moit_precision precision_of(int type) { return type == NPY_DOUBLE ? MOIT_FLOAT64 : MOIT_FLOAT32; }

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
