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

/* New arrays for the pieces that `offsets` counts, and where the core puts them; -1 with an
 * exception. */
static int make_pieces(const held_fragments *held, const int64_t *offsets, bool wants_back,
                       PyObject *made[8], moit_pieces *pieces) {
    const moit_fragments *f = &held->fragments;
    npy_intp shape[2] = {(npy_intp)offsets[f->pixels], 3}, given = (npy_intp)held->count;
    int type = f->precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
    const struct {
        bool wanted;
        int dimensions;
        void **to;
    } arrays[] = {
        {true, 1, &pieces->depth},      {true, 1, &pieces->alpha},
        {f->color, 2, &pieces->color},  {f->transmission, 2, &pieces->transmission},
        {wants_back, 1, &pieces->back}, {f->emission, 2, &pieces->emission},
    };
    for (int i = 0; i < 6; ++i) {
        made[1 + i] = arrays[i].wanted ? PyArray_SimpleNew(arrays[i].dimensions, shape, type)
                                       : Py_NewRef(Py_None);
        if (!made[1 + i]) return -1;
        if (arrays[i].wanted) *arrays[i].to = PyArray_DATA((PyArrayObject *)made[1 + i]);
    }
    if (!(made[7] = PyArray_SimpleNew(1, &given, NPY_INT64))) return -1;
    pieces->first = PyArray_DATA((PyArrayObject *)made[7]);
    return 0;
}

PyDoc_STRVAR(
    split_doc,
    "split_volumes(fragments, tidy, cuts, threads, /)\n--\n\n"
    "(offsets, depth, alpha, color, transmission, back, emission, first) of the pieces of\n"
    "fragments (moit_split_volumes in csrc/moit.h): tidy with back, else without it. None\n"
    "where nothing changes. cuts: increasing float64.");

static PyObject *split_volumes(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *given, *result = NULL, *made[8] = {NULL};
    int tidy, threads;
    held_fragments held;
    if (!PyArg_ParseTuple(args, "OpOi", &fragments, &tidy, &given, &threads)) return NULL;
    PyArrayObject *cuts = array_of(given, NPY_FLOAT64, 1, "cuts");
    if (!cuts || hold_fragments(&held, fragments)) {
        Py_XDECREF(cuts);
        return NULL;
    }
    moit_splitting how = {tidy, PyArray_DIM(cuts, 0), PyArray_DATA(cuts)};
    bool has_extents = held.fragments.back || held.fragments.deviation;
    npy_intp ends = (npy_intp)held.fragments.pixels + 1;
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)made[0]);
    bool changes;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_piece_offsets(&held.fragments, &how, offsets, &changes, &call.run);
    if (end_call(&call, status)) goto done;
    if (!changes) {
        result = Py_NewRef(Py_None);
        goto done;
    }
    moit_pieces pieces = {0};
    if (make_pieces(&held, offsets, tidy && has_extents, made, &pieces)) goto done;
    begin_call(&call, threads);
    status = moit_split_volumes(&held.fragments, &how, offsets, &pieces, &call.run);
    if (end_call(&call, status)) goto done;
    result =
        PyTuple_Pack(8, made[0], made[1], made[2], made[3], made[4], made[5], made[6], made[7]);
done:
    let_go(&held);
    Py_DECREF(cuts);
    for (int i = 0; i < 8; ++i) Py_XDECREF(made[i]);
    return result;
}

PyDoc_STRVAR(
    thin_doc,
    "thin(fragments, volumes, points, frequency, warp, range_per_pixel, cells, step, threads, /)\n"
    "--\n\n"
    "What split_volumes gives, of Gaussians and, if they shall, volumes as points\n"
    "(moit_thin in csrc/moit.h); else volumes keep their back. None where nothing changes.");

static PyObject *thin(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *result = NULL, *made[8] = {NULL};
    int volumes, points, warp, per_pixel, cells, threads;
    double frequency, step;
    held_fragments held;
    if (!PyArg_ParseTuple(args, "Opidipidi", &fragments, &volumes, &points, &frequency, &warp,
                          &per_pixel, &cells, &step, &threads))
        return NULL;
    if (points < 0 || points > 48 || warp < MOIT_WARP_LOG || warp > MOIT_WARP_NONE)
        return PyErr_Format(PyExc_ValueError, "points are 0 to 48, and a warp is one of options.h");
    if (cells < 0 || cells > 65536 || (cells && !(step > 0.0)))
        return PyErr_Format(PyExc_ValueError, "cells are 0 to 65536, and a step is above 0");
    if (hold_fragments(&held, fragments)) return NULL;
    moit_thinning how = {volumes, points, frequency, (moit_warp)warp, per_pixel, cells, step};
    npy_intp ends = (npy_intp)held.fragments.pixels + 1;
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)made[0]);
    bool changes;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_point_offsets(&held.fragments, &how, offsets, &changes, &call.run);
    if (end_call(&call, status)) goto done;
    if (!changes) {
        result = Py_NewRef(Py_None);
        goto done;
    }
    moit_pieces pieces = {0};
    if (make_pieces(&held, offsets, held.fragments.back && !volumes, made, &pieces)) goto done;
    begin_call(&call, threads);
    status = moit_thin(&held.fragments, &how, offsets, &pieces, &call.run);
    if (end_call(&call, status)) goto done;
    result =
        PyTuple_Pack(8, made[0], made[1], made[2], made[3], made[4], made[5], made[6], made[7]);
done:
    let_go(&held);
    for (int i = 0; i < 8; ++i) Py_XDECREF(made[i]);
    return result;
}

static PyMethodDef methods[] = {
    {"join_pixels", join_pixels, METH_O, join_doc},
    {"split_pixels", split_pixels, METH_VARARGS, split_pixels_doc},
    {"split_volumes", split_volumes, METH_VARARGS, split_doc},
    {"thin", thin, METH_VARARGS, thin_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_deep(PyObject *module) { return PyModule_AddFunctions(module, methods); }
