/* What passes on a GPU are given. */
#include "shared_numbers.h"
#include "technique.h"

#include <string.h>

static const char *const steps_kinds[] = {
    [MOIT_STEPS_NONE] = "none", [MOIT_STEPS_LEVEL] = "level",     [MOIT_STEPS_LINEAR] = "linear",
    [MOIT_STEPS_LOG] = "log",   [MOIT_STEPS_EXTREME] = "extreme",
};

static PyObject *numbers(const double *from, Py_ssize_t count) {
    PyObject *tuple = PyTuple_New(count);
    for (Py_ssize_t i = 0; tuple && i < count; ++i) {
        PyObject *one = PyFloat_FromDouble(from[i]);
        if (!one) Py_CLEAR(tuple);
        else PyTuple_SET_ITEM(tuple, i, one);
    }
    return tuple;
}

PyDoc_STRVAR(
    pass_constants_doc,
    "pass_constants(technique, is_double, near, far, /)\n--\n\n"
    "(warp's kind, (near, low, high, scale, inverse), max_alpha, moments): moments are None\n"
    "or (bias, least, safe, (turns, edge, scale), middle).");

static PyObject *pass_constants(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *technique;
    int is_double;
    double near, far;
    held_technique held;
    if (!PyArg_ParseTuple(args, "Opdd:pass_constants", &technique, &is_double, &near, &far)
        || hold_technique(&held, technique, NULL))
        return NULL;
    const moit_technique *t = &held.technique;
    moit_precision precision = is_double ? MOIT_FLOAT64 : MOIT_FLOAT32;
    moit_warp_steps warp = moit_technique_warp(t, precision, near, far);
    double max_alpha = moit_technique_max_alpha(t, precision);
    PyObject *moments = Py_NewRef(Py_None);
    if (moit_moment_numbers(t)) {
        moit_moment_steps steps = moit_technique_moments(t, precision);
        Py_SETREF(moments,
                  Py_BuildValue("ddN(ddd)N", t->moments.bias, steps.least, numbers(steps.safe, 8),
                                steps.turns, steps.edge, steps.scale, numbers(steps.middle, 8)));
    }
    let_technique_go(&held);
    if (!moments) return NULL;
    return Py_BuildValue("s(ddddd)dN", steps_kinds[warp.kind], warp.near, warp.low, warp.high,
                         warp.scale, warp.inverse, max_alpha, moments);
}

PyDoc_STRVAR(warped_doc, "warped(fragments, technique, threads, depth, /)\n--\n\n"
                         "z (N,); with depth (K,) float64 of these in each pixel, (P, K).");

static PyObject *warped(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *depth_in, *z = NULL;
    PyArrayObject *depth = NULL;
    held_fragments held;
    held_technique how;
    int threads;
    if (!PyArg_ParseTuple(args, "OOiO:warped", &fragments, &technique, &threads, &depth_in)
        || hold_asked(&held, fragments, &how, technique))
        return NULL;
    if (!moit_facts_of(how.technique.kind).uses_warp) {
        PyErr_SetString(PyExc_ValueError, "technique: expected one that warps depth");
        goto done;
    }
    if (depth_in != Py_None && !(depth = array_of(depth_in, NPY_DOUBLE, 1, "depth"))) goto done;
    npy_intp depths = depth ? PyArray_SIZE(depth) : 0;
    npy_intp shape[2] = {depth ? (npy_intp)held.fragments.pixels : (npy_intp)held.count, depths};
    z = PyArray_SimpleNew(depth ? 2 : 1, shape,
                          held.fragments.precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT);
    if (!z || PyArray_SIZE((PyArrayObject *)z) == 0) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_warped(&held.fragments, &how.technique, depths, depth ? PyArray_DATA(depth) : NULL,
                    PyArray_DATA((PyArrayObject *)z), &call.run);
    if (end_call(&call, status)) Py_CLEAR(z);
done:
    Py_XDECREF(depth);
    let_technique_go(&how);
    let_go(&held);
    return z;
}

PyDoc_STRVAR(surviving_doc,
             "surviving(fragments, cull_opaque, threads, /)\n--\n\n"
             "(kept (N,) bool, occluder (P,) int64, opacity (N, 3) or None, net (N,) or "
             "None).");

static PyObject *surviving(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *made[4] = {NULL}, *result = NULL;
    held_fragments held;
    int cull_opaque, threads;
    if (!PyArg_ParseTuple(args, "Opi:surviving", &fragments, &cull_opaque, &threads)
        || hold_fragments(&held, fragments))
        return NULL;
    int type = held.fragments.precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
    npy_intp shape[2] = {(npy_intp)held.count, 3}, pixels = (npy_intp)held.fragments.pixels;
    bool coloured = held.fragments.transmission;
    if (!(made[0] = PyArray_SimpleNew(1, shape, NPY_BOOL))
        || !(made[1] = PyArray_SimpleNew(1, &pixels, NPY_INT64))
        || !(made[2] = coloured ? PyArray_SimpleNew(2, shape, type) : Py_NewRef(Py_None))
        || !(made[3] = coloured ? PyArray_SimpleNew(1, shape, type) : Py_NewRef(Py_None)))
        goto done;
    void *arrays[4];
    for (int i = 0; i < 4; ++i)
        arrays[i] = made[i] == Py_None ? NULL : PyArray_DATA((PyArrayObject *)made[i]);
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_surviving(&held.fragments, cull_opaque, arrays[0], arrays[1],
                                        arrays[2], arrays[3], &call.run);
    if (!end_call(&call, status)) result = PyTuple_Pack(4, made[0], made[1], made[2], made[3]);
done:
    for (int i = 0; i < 4; ++i) Py_XDECREF(made[i]);
    let_go(&held);
    return result;
}

PyDoc_STRVAR(slice_tables_doc,
             "slice_tables(fragments, technique, cull_opaque, threads, /)\n--\n\n"
             "(tables (regions, cells, 3) float32, side, top, left, across, joined).");

static PyObject *slice_tables(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *tables = NULL, *result = NULL;
    held_fragments held;
    held_technique how;
    int cull_opaque, threads;
    if (!PyArg_ParseTuple(args, "OOpi:slice_tables", &fragments, &technique, &cull_opaque, &threads)
        || hold_asked(&held, fragments, &how, technique))
        return NULL;
    if (how.technique.kind != MOIT_SLICES && how.technique.kind != MOIT_AVBOIT) {
        PyErr_SetString(PyExc_ValueError, "technique: expected slices");
        goto done;
    }
    moit_slice_regions regions = moit_slice_regions_of(&held.fragments, &how.technique);
    npy_intp shape[3] = {(npy_intp)regions.count, how.technique.slices.cells, 3};
    int joined;
    if (!(tables = PyArray_SimpleNew(3, shape, NPY_FLOAT))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_slice_tables(&held.fragments, &how.technique, cull_opaque,
                          PyArray_DATA((PyArrayObject *)tables), &joined, &call.run);
    if (!end_call(&call, status))
        result = Py_BuildValue("OLLLLi", tables, (long long)regions.side, (long long)regions.top,
                               (long long)regions.left, (long long)regions.across, joined);
done:
    Py_XDECREF(tables);
    let_technique_go(&how);
    let_go(&held);
    return result;
}

PyDoc_STRVAR(shared_doc,
             "numbers()\n--\n\n"
             "Those that C, GLSL and Python share, by name, in the order of their text.");

static PyObject *shared(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(none)) {
    PyObject *found = PyDict_New();
    for (const shared_number *one = shared_numbers; found && one->name; ++one) {
        PyObject *value = PyLong_FromLong(one->value);
        if (!value || PyDict_SetItemString(found, one->name, value)) Py_CLEAR(found);
        Py_XDECREF(value);
    }
    return found;
}

static PyMethodDef methods[] = {
    {"numbers", shared, METH_NOARGS, shared_doc},
    {"pass_constants", pass_constants, METH_VARARGS, pass_constants_doc},
    {"warped", warped, METH_VARARGS, warped_doc},
    {"slice_tables", slice_tables, METH_VARARGS, slice_tables_doc},
    {"surviving", surviving, METH_VARARGS, surviving_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_passes(PyObject *module) { return PyModule_AddFunctions(module, methods); }
