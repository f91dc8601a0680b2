/* Pixels one by one: what is known of them, and the fragments of some. */
#include "binding.h"

PyDoc_STRVAR(pixel_facts_doc, "pixel_facts(fragments, cull_opaque, threads, /)\n--\n\n"
                              "(P, facts) float64, in the order of moit_fact (csrc/moit.h).");

static PyObject *pixel_facts(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments;
    held_fragments held;
    int cull_opaque, threads;
    if (!PyArg_ParseTuple(args, "Opi:pixel_facts", &fragments, &cull_opaque, &threads)
        || hold_fragments(&held, fragments))
        return NULL;
    npy_intp shape[2] = {(npy_intp)held.fragments.pixels, MOIT_PIXEL_FACTS};
    PyObject *facts = PyArray_SimpleNew(2, shape, NPY_DOUBLE);
    if (facts) {
        core_call call;
        begin_call(&call, threads);
        moit_status status = moit_pixel_facts(&held.fragments, cull_opaque,
                                              PyArray_DATA((PyArrayObject *)facts), &call.run);
        if (end_call(&call, status)) Py_CLEAR(facts);
    }
    let_go(&held);
    return facts;
}

PyDoc_STRVAR(take_pixels_doc,
             "take_pixels(fragments, pixel, threads, /)\n--\n\n"
             "(offsets, depth, alpha, color or None, transmission or None) of the pixels\n"
             "pixel (K,) int64. Nobody else may change `pixel` meanwhile.");

static PyObject *take_pixels(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *pixel_in, *made[5] = {NULL}, *result = NULL;
    held_fragments held;
    int threads;
    if (!PyArg_ParseTuple(args, "OOi:take_pixels", &fragments, &pixel_in, &threads)
        || hold_fragments(&held, fragments))
        return NULL;
    const moit_fragments *f = &held.fragments;
    PyArrayObject *pixel = array_of(pixel_in, NPY_INT64, 1, "pixel");
    if (!pixel) goto done;
    npy_intp count = PyArray_SIZE(pixel), ends = count + 1;
    const int64_t *at = PyArray_DATA(pixel);
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)made[0]);
    offsets[0] = 0;
    for (npy_intp k = 0; k < count; ++k) {
        if (at[k] < 0 || at[k] >= f->pixels) {
            PyErr_SetString(PyExc_ValueError, "pixel: expected indices of pixels");
            goto done;
        }
        offsets[k + 1] = offsets[k] + (f->offsets[at[k] + 1] - f->offsets[at[k]]);
    }
    int type = f->precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
    npy_intp shape[2] = {(npy_intp)offsets[count], 3};
    void *data[4] = {NULL};
    bool present[4] = {true, true, f->color, f->transmission};
    for (int i = 0; i < 4; ++i) {
        made[i + 1] =
            present[i] ? PyArray_SimpleNew(i < 2 ? 1 : 2, shape, type) : Py_NewRef(Py_None);
        if (!made[i + 1]) goto done;
        if (present[i]) data[i] = PyArray_DATA((PyArrayObject *)made[i + 1]);
    }
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_take_pixels(f, at, count, offsets, data[0], data[1], data[2], data[3], &call.run);
    if (!end_call(&call, status))
        result = PyTuple_Pack(5, made[0], made[1], made[2], made[3], made[4]);
done:
    for (int i = 0; i < 5; ++i) Py_XDECREF(made[i]);
    Py_XDECREF(pixel);
    let_go(&held);
    return result;
}

PyDoc_STRVAR(color_bounds_doc,
             "color_bounds(fragments, cull_opaque, threads, background, lower, upper, /)\n--\n\n"
             "(low, high), (P, 4) float64; lower and upper (N,), with transmission (N, 3).");

static PyObject *color_bounds(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *behind_in, *given[2], *made[2] = {NULL, NULL}, *result = NULL;
    PyArrayObject *behind = NULL, *bounds[2] = {NULL, NULL};
    held_fragments held;
    int cull_opaque, threads;
    if (!PyArg_ParseTuple(args, "OpiOOO:color_bounds", &fragments, &cull_opaque, &threads,
                          &behind_in, &given[0], &given[1])
        || hold_fragments(&held, fragments))
        return NULL;
    const moit_fragments *f = &held.fragments;
    int type = f->precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
    npy_intp pixels = (npy_intp)f->pixels, shape[2] = {pixels, 4},
             numbers = (npy_intp)held.count * (f->transmission ? 3 : 1);
    if (!(behind = array_of(behind_in, NPY_DOUBLE, 2, "background"))) goto done;
    bool one = PyArray_DIM(behind, 0) == 1;
    if (!f->color || PyArray_DIM(behind, 1) != 3 || (!one && PyArray_DIM(behind, 0) != pixels)) {
        PyErr_SetString(PyExc_ValueError, "expected color, and background (1, 3) or (P, 3)");
        goto done;
    }
    for (int i = 0; i < 2; ++i) {
        bounds[i] = array_of(given[i], type, f->transmission ? 2 : 1, "bounds");
        if (!bounds[i]) goto done;
        if (PyArray_SIZE(bounds[i]) != numbers) {
            PyErr_SetString(PyExc_ValueError, "there must be bounds for every fragment");
            goto done;
        }
        if (!(made[i] = PyArray_SimpleNew(2, shape, NPY_DOUBLE))) goto done;
    }
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_color_bounds(f, cull_opaque, PyArray_DATA(behind), !one, PyArray_DATA(bounds[0]),
                          PyArray_DATA(bounds[1]), PyArray_DATA((PyArrayObject *)made[0]),
                          PyArray_DATA((PyArrayObject *)made[1]), &call.run);
    if (!end_call(&call, status)) result = PyTuple_Pack(2, made[0], made[1]);
done:
    for (int i = 0; i < 2; ++i) {
        Py_XDECREF(bounds[i]);
        Py_XDECREF(made[i]);
    }
    Py_XDECREF(behind);
    let_go(&held);
    return result;
}

static PyMethodDef methods[] = {
    {"pixel_facts", pixel_facts, METH_VARARGS, pixel_facts_doc},
    {"take_pixels", take_pixels, METH_VARARGS, take_pixels_doc},
    {"color_bounds", color_bounds, METH_VARARGS, color_bounds_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_pixels(PyObject *module) { return PyModule_AddFunctions(module, methods); }
