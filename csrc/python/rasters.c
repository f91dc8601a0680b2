/* What is counted and yet to be drawn, in a capsule. */
#include "rasters.h"

static void let_raster_go(PyObject *capsule) {
    held_raster *held = PyCapsule_GetPointer(capsule, PyCapsule_GetName(capsule));
    if (!held) return;
    held->end(held->raster);
    Py_XDECREF(held->offsets);
    PyMem_Free(held);
}

PyObject *hold_raster(const char *name, void (*end)(void *), int width, int height,
                      held_raster **held) {
    npy_intp ends = (npy_intp)width * height + 1;
    held_raster *own = PyMem_Calloc(1, sizeof *own);
    if (!own) return PyErr_NoMemory();
    *own = (held_raster){.end = end, .width = width, .height = height};
    PyObject *capsule = PyCapsule_New(own, name, let_raster_go);
    if (!capsule) {
        PyMem_Free(own);
        return NULL;
    }
    if (!(own->offsets = PyArray_SimpleNew(1, &ends, NPY_INT64))) Py_CLEAR(capsule);
    *held = own;
    return capsule;
}

int64_t *offsets_of_raster(const held_raster *held) {
    return PyArray_DATA((PyArrayObject *)held->offsets);
}

PyObject *give_raster(PyObject *capsule, const float range[2]) {
    held_raster *held = PyCapsule_GetPointer(capsule, PyCapsule_GetName(capsule));
    PyArray_CLEARFLAGS((PyArrayObject *)held->offsets, NPY_ARRAY_WRITEABLE);
    return Py_BuildValue("NOdd", capsule, held->offsets, (double)range[0], (double)range[1]);
}

const held_raster *whole_raster_of(PyObject *capsule, const char *name, const char *begins) {
    if (PyCapsule_IsValid(capsule, name)) return PyCapsule_GetPointer(capsule, name);
    PyErr_Format(PyExc_TypeError, "raster: expected what %s gave", begins);
    return NULL;
}

const held_raster *raster_of(PyObject *capsule, const char *name, const char *begins, int top,
                             int bottom) {
    const held_raster *held = whole_raster_of(capsule, name, begins);
    if (held && (top < 0 || top >= bottom || bottom > held->height)) {
        PyErr_SetString(PyExc_ValueError, "the rows are out of range");
        return NULL;
    }
    return held;
}

PyObject *offsets_of_rows(const held_raster *held, int top, int bottom, npy_intp *count) {
    npy_intp ends = (npy_intp)held->width * (bottom - top) + 1;
    const int64_t *whole = offsets_of_raster(held) + (npy_intp)held->width * top;
    *count = whole[ends - 1] - whole[0];
    PyObject *array = PyArray_SimpleNew(1, &ends, NPY_INT64);
    if (!array) return NULL;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)array);
    for (npy_intp p = 0; p < ends; ++p) offsets[p] = whole[p] - whole[0];
    return array;
}
