/* Deep images: the arrays of pixels that OpenEXR gives and takes as flat ones; volumes as
 * fragments. */
#include <string.h>

#include "binding.h"

/* The samples of one pixel of a channel: NULL for None, which has none. -1 with an exception for
 * anything but a plain array; `type` is that of the first one met, and all have the same. */
static int samples_of(PyObject *object, int *type, PyArrayObject **samples) {
    *samples = NULL;
    if (!object || object == Py_None) return 0;
    PyArrayObject *array = PyArray_Check(object) ? (PyArrayObject *)object : NULL;
    if (array && *type < 0) *type = PyArray_TYPE(array);
    if (!array || PyArray_NDIM(array) != 1 || PyArray_TYPE(array) != *type
        || !PyArray_IS_C_CONTIGUOUS(array) || !PyArray_ISNOTSWAPPED(array)
        || (*type != NPY_HALF && *type != NPY_FLOAT && *type != NPY_UINT)) {
        PyErr_SetString(PyExc_TypeError, "a pixel's samples are neither None nor an array of "
                                         "float16, float32 or uint32 like those before");
        return -1;
    }
    *samples = array;
    return 0;
}

PyDoc_STRVAR(join_doc,
             "join_pixels(pixels, /)\n--\n\n"
             "(counts (P,) int64, samples (N,)) of an array of P arrays or None.\n"
             "float16, float32 or uint32, as the arrays are; float32 where all are None.");

static PyObject *join_pixels(PyObject *Py_UNUSED(module), PyObject *object) {
    PyObject *result = NULL, *counts = NULL, *flat = NULL;
    PyArrayObject *pixels =
        (PyArrayObject *)PyArray_FROM_OTF(object, NPY_OBJECT, NPY_ARRAY_IN_ARRAY);
    if (!pixels) return NULL;
    npy_intp size = PyArray_SIZE(pixels), total = 0;
    PyObject **items = PyArray_DATA(pixels);
    if (!(counts = PyArray_SimpleNew(1, &size, NPY_INT64))) goto done;
    int64_t *count = PyArray_DATA((PyArrayObject *)counts);
    int type = -1;
    for (npy_intp p = 0; p < size; ++p) {
        PyArrayObject *samples;
        if (samples_of(items[p], &type, &samples)) goto done;
        count[p] = samples ? PyArray_DIM(samples, 0) : 0;
        total += count[p];
    }
    if (!(flat = PyArray_SimpleNew(1, &total, type < 0 ? NPY_FLOAT : type))) goto done;
    char *next = PyArray_BYTES((PyArrayObject *)flat);
    for (npy_intp p = 0; p < size; ++p) {
        PyArrayObject *samples = (PyArrayObject *)items[p]; /* an array where it counts */
        if (!count[p]) continue;
        memcpy(next, PyArray_DATA(samples), (size_t)PyArray_NBYTES(samples));
        next += PyArray_NBYTES(samples);
    }
    result = PyTuple_Pack(2, counts, flat);
done:
    Py_DECREF(pixels);
    Py_XDECREF(counts);
    Py_XDECREF(flat);
    return result;
}

PyDoc_STRVAR(split_pixels_doc, "split_pixels(samples, offsets, /)\n--\n\n"
                               "(P,) object: the part of samples that each pixel owns, as views.");

static PyObject *split_pixels(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *ends_object, *result = NULL;
    if (!PyArg_ParseTuple(args, "OO", &object, &ends_object)) return NULL;
    PyArrayObject *ends = NULL, *samples = (PyArrayObject *)PyArray_FROM_O(object);
    if (!samples || !(ends = array_of(ends_object, NPY_INT64, 1, "offsets"))) goto done;
    npy_intp pixels = PyArray_DIM(ends, 0) - 1;
    if (PyArray_NDIM(samples) != 1 || pixels < 0) {
        PyErr_SetString(PyExc_ValueError, "samples and offsets have one dimension, offsets an end");
        goto done;
    }
    if (!(result = PyArray_SimpleNew(1, &pixels, NPY_OBJECT))) goto done;
    PyObject **items = PyArray_DATA((PyArrayObject *)result); /* all NULL, which is None */
    const int64_t *offset = PyArray_DATA(ends);
    npy_intp stride = PyArray_STRIDE(samples, 0), count = PyArray_DIM(samples, 0);
    for (npy_intp p = 0; p < pixels; ++p) {
        int64_t first = offset[p], last = offset[p + 1];
        if (first < 0 || last < first || last > count) {
            PyErr_SetString(PyExc_ValueError, "offsets leave the samples");
            Py_CLEAR(result);
            goto done;
        }
        npy_intp own = last - first;
        PyArray_Descr *type = PyArray_DESCR(samples);
        Py_INCREF(type);
        items[p] = PyArray_NewFromDescr(&PyArray_Type, type, 1, &own, &stride,
                                        PyArray_BYTES(samples) + first * stride, 0, NULL);
        if (items[p]) Py_INCREF(samples);
        if (!items[p] || PyArray_SetBaseObject((PyArrayObject *)items[p], (PyObject *)samples)) {
            Py_CLEAR(result);
            goto done;
        }
    }
done:
    Py_XDECREF(samples);
    Py_XDECREF(ends);
    return result;
}

/* -1 with an exception unless the arrays fit one another: this guards memory. */
static int check_samples(PyArrayObject *arrays[5]) {
    npy_intp count = PyArray_DIM(arrays[1], 0), ends = PyArray_DIM(arrays[0], 0);
    const int64_t *offsets = PyArray_DATA(arrays[0]);
    bool fit = ends >= 1 && offsets[0] == 0 && offsets[ends - 1] == count;
    for (npy_intp p = 1; fit && p < ends; ++p) fit = offsets[p - 1] <= offsets[p];
    for (int i = 2; i < 4; ++i) fit = fit && PyArray_DIM(arrays[i], 0) == count;
    if (arrays[4])
        fit = fit && PyArray_DIM(arrays[4], 0) == count && PyArray_DIM(arrays[4], 1) == 3;
    if (fit) return 0;
    PyErr_SetString(PyExc_ValueError, "the arrays of these deep samples do not fit one another");
    return -1;
}

PyDoc_STRVAR(
    split_doc,
    "split_volumes(offsets, front, back, alpha, color, threads, /)\n--\n\n"
    "(offsets, depth, alpha, color): fragments of deep samples whose volumes, where front < back,\n"
    "are split where samples overlap. All finite, float32; color may be None.\n"
    "Nobody else may change the arrays meanwhile.");

static PyObject *split_volumes(PyObject *Py_UNUSED(module), PyObject *args) {
    static const char *const names[] = {"offsets", "front", "back", "alpha", "color"};
    static const int types[] = {NPY_INT64, NPY_FLOAT32, NPY_FLOAT32, NPY_FLOAT32, NPY_FLOAT32};
    PyObject *given[5], *result = NULL, *made[4] = {NULL};
    PyArrayObject *arrays[5] = {NULL};
    int threads;
    if (!PyArg_ParseTuple(args, "OOOOOi", &given[0], &given[1], &given[2], &given[3], &given[4],
                          &threads))
        return NULL;
    for (int i = 0; i < 5; ++i) {
        if (i == 4 && given[i] == Py_None) break;
        if (!(arrays[i] = array_of(given[i], types[i], i == 4 ? 2 : 1, names[i]))) goto done;
    }
    if (check_samples(arrays)) goto done;

    npy_intp ends = PyArray_DIM(arrays[0], 0);
    moit_deep_samples samples = {
        .pixels = ends - 1,
        .offsets = PyArray_DATA(arrays[0]),
        .front = PyArray_DATA(arrays[1]),
        .back = PyArray_DATA(arrays[2]),
        .alpha = PyArray_DATA(arrays[3]),
        .color = arrays[4] ? PyArray_DATA(arrays[4]) : NULL,
    };
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)made[0]);
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_volume_offsets(&samples, offsets, &call.run);
    if (end_call(&call, status)) goto done;

    npy_intp shape[2] = {offsets[ends - 1], 3};
    for (int i = 1; i < 4; ++i) {
        if (i == 3 && !arrays[4]) {
            made[i] = Py_NewRef(Py_None);
            break;
        }
        if (!(made[i] = PyArray_SimpleNew(i == 3 ? 2 : 1, shape, NPY_FLOAT32))) goto done;
    }
    float *depth = PyArray_DATA((PyArrayObject *)made[1]);
    float *alpha = PyArray_DATA((PyArrayObject *)made[2]);
    float *color = arrays[4] ? PyArray_DATA((PyArrayObject *)made[3]) : NULL;
    begin_call(&call, threads);
    status = moit_split_volumes(&samples, offsets, depth, alpha, color, &call.run);
    if (end_call(&call, status)) goto done;
    result = PyTuple_Pack(4, made[0], made[1], made[2], made[3]);
done:
    for (int i = 0; i < 5; ++i) Py_XDECREF(arrays[i]);
    for (int i = 0; i < 4; ++i) Py_XDECREF(made[i]);
    return result;
}

static PyMethodDef methods[] = {
    {"join_pixels", join_pixels, METH_O, join_doc},
    {"split_pixels", split_pixels, METH_VARARGS, split_pixels_doc},
    {"split_volumes", split_volumes, METH_VARARGS, split_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_deep(PyObject *module) { return PyModule_AddFunctions(module, methods); }
