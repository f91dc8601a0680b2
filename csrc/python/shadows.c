/* Shadow maps. */
#include "technique.h"

/* A texel's numbers; NULL with an exception. */
static PyArrayObject *texels_of(PyObject *object, moit_texels *texels) {
    int type = number_type_of(object);
    PyArrayObject *array = array_of(object, type, 3, "sums");
    if (!array) return NULL;
    *texels = (moit_texels){
        .precision = precision_of(type),
        .height = PyArray_DIM(array, 0),
        .width = PyArray_DIM(array, 1),
        .numbers = (int)PyArray_DIM(array, 2),
        .sums = PyArray_DATA(array),
    };
    return array;
}

PyDoc_STRVAR(texel_sums_doc, "texel_sums(fragments, technique, threads, /)\n--\n\n"
                             "(height, width, numbers): what of a technique adds up.");

static PyObject *texel_sums(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *object, *out = NULL;
    int threads;
    held_fragments held;
    held_technique technique;
    if (!PyArg_ParseTuple(args, "OOi:texel_sums", &fragments, &object, &threads)
        || hold_asked(&held, fragments, &technique, object))
        return NULL;
    int numbers = moit_texel_numbers(&technique.technique);
    if (!numbers) {
        PyErr_SetString(PyExc_ValueError, "technique: expected one that adds up");
        goto done;
    }
    npy_intp shape[3] = {held.height, held.width, numbers};
    out = PyArray_SimpleNew(3, shape,
                            held.fragments.precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT);
    if (!out) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_texel_sums(&held.fragments, &technique.technique,
                                         PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    let_technique_go(&technique);
    let_go(&held);
    return out;
}

PyDoc_STRVAR(filter_texels_doc, "filter_texels(sums, weights, threads, /)\n--\n\n"
                                "Like sums (height, width, numbers); weights an odd number of "
                                "float64.");

static PyObject *filter_texels(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *weights_in, *out = NULL;
    PyArrayObject *sums = NULL, *weights = NULL;
    int threads;
    moit_texels texels;
    if (!PyArg_ParseTuple(args, "OOi:filter_texels", &object, &weights_in, &threads)) return NULL;
    if (!(sums = texels_of(object, &texels))
        || !(weights = array_of(weights_in, NPY_DOUBLE, 1, "weights")))
        goto done;
    npy_intp taps = PyArray_DIM(weights, 0);
    if (taps % 2 == 0 || taps > 255) {
        PyErr_SetString(PyExc_ValueError, "weights: expected an odd number of them, below 256");
        goto done;
    }
    if (!(out = PyArray_SimpleNew(3, PyArray_DIMS(sums), PyArray_TYPE(sums)))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_filter_texels(&texels, (int)taps, PyArray_DATA(weights),
                                            PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    Py_XDECREF(sums);
    Py_XDECREF(weights);
    return out;
}

PyDoc_STRVAR(hold_texels_doc, "hold_texels(moments, threads, /)\n--\n\n"
                              "What words keep of moments (height, width, 4).");

static PyObject *hold_texels(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *out = NULL;
    int threads;
    moit_texels texels;
    if (!PyArg_ParseTuple(args, "Oi:hold_texels", &object, &threads)) return NULL;
    PyArrayObject *moments = texels_of(object, &texels);
    if (!moments) return NULL;
    if (texels.numbers != 4) {
        PyErr_SetString(PyExc_ValueError, "moments: expected four a texel");
        goto done;
    }
    if (!(out = PyArray_SimpleNew(3, PyArray_DIMS(moments), PyArray_TYPE(moments)))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_hold_texels(&texels, PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    Py_DECREF(moments);
    return out;
}

PyDoc_STRVAR(shadow_at_doc,
             "shadow_at(sums, technique, near, far, opaque, threads, place, alpha, /)\n--\n\n"
             "(N,) float64: what reaches places (N, 3) of column, row and depth; alpha (N,) or "
             "None.");

static PyObject *shadow_at(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *technique, *place_in, *alpha_in, *out = NULL;
    PyArrayObject *sums = NULL, *place = NULL, *alpha = NULL;
    double near, far;
    int opaque, threads;
    moit_texels texels;
    held_technique held;
    if (!PyArg_ParseTuple(args, "OOddpiOO:shadow_at", &object, &technique, &near, &far, &opaque,
                          &threads, &place_in, &alpha_in)
        || hold_technique(&held, technique, NULL))
        return NULL;
    if (!(sums = texels_of(object, &texels))
        || !(place = array_of(place_in, NPY_DOUBLE, 2, "place"))
        || (alpha_in != Py_None && !(alpha = array_of(alpha_in, NPY_DOUBLE, 1, "alpha"))))
        goto done;
    npy_intp points = PyArray_DIM(place, 0);
    int numbers = moit_texel_numbers(&held.technique);
    bool fits = numbers && texels.numbers == numbers - (opaque ? 1 : 0)
                && (!opaque || held.technique.kind == MOIT_POWER_MOMENTS);
    if (!fits || PyArray_DIM(place, 1) != 3 || (alpha && PyArray_DIM(alpha, 0) != points)
        || texels.width < 1 || texels.height < 1) {
        PyErr_SetString(PyExc_ValueError, "the shapes do not fit the technique or one another");
        goto done;
    }
    if (!(out = PyArray_SimpleNew(1, &points, NPY_DOUBLE))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_shadow_at(&texels, &held.technique, near, far, opaque, points,
                                        PyArray_DATA(place), alpha ? PyArray_DATA(alpha) : NULL,
                                        PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    Py_XDECREF(sums);
    Py_XDECREF(place);
    Py_XDECREF(alpha);
    let_technique_go(&held);
    return out;
}

static PyMethodDef methods[] = {
    {"texel_sums", texel_sums, METH_VARARGS, texel_sums_doc},
    {"filter_texels", filter_texels, METH_VARARGS, filter_texels_doc},
    {"hold_texels", hold_texels, METH_VARARGS, hold_texels_doc},
    {"shadow_at", shadow_at, METH_VARARGS, shadow_at_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_shadows(PyObject *module) { return PyModule_AddFunctions(module, methods); }
