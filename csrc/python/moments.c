/* The moments by themselves. */
#include "technique.h"

#include <string.h>

typedef struct {
    held_technique technique;
    PyArrayObject *b0, *b, *z, *alpha; /* alpha: NULL for none */
    int type;
    npy_intp pixels, depths;
} given_moments;

static void let_moments_go(given_moments *m) {
    let_technique_go(&m->technique);
    Py_CLEAR(m->b0);
    Py_CLEAR(m->b);
    Py_CLEAR(m->z);
    Py_CLEAR(m->alpha);
}

static int hold_moments(given_moments *m, PyObject *technique, PyObject *b0, PyObject *b,
                        PyObject *z, PyObject *alpha) {
    m->b0 = m->b = m->z = m->alpha = NULL;
    if (hold_technique(&m->technique, technique, NULL)) return -1;
    m->type = number_type_of(b0);
    if (!(m->b0 = array_of(b0, m->type, 1, "b0")) || !(m->b = array_of(b, m->type, 2, "b"))
        || !(m->z = array_of(z, m->type, 2, "z"))
        || (alpha != Py_None && !(m->alpha = array_of(alpha, m->type, 2, "alpha"))))
        goto failed;
    m->pixels = PyArray_DIM(m->b0, 0);
    m->depths = PyArray_DIM(m->z, 1);
    if (moit_moment_numbers(&m->technique.technique) && PyArray_DIM(m->b, 0) == m->pixels
        && PyArray_DIM(m->b, 1) == moit_moment_numbers(&m->technique.technique)
        && PyArray_DIM(m->z, 0) == m->pixels && (!m->alpha || PyArray_SAMESHAPE(m->alpha, m->z)))
        return 0;
    PyErr_SetString(PyExc_ValueError, "the shapes of b0, b, z and alpha do not fit one another");
failed:
    let_moments_go(m);
    return -1;
}

typedef moit_status moments_answer(const moit_technique *, moit_precision, int64_t, int64_t,
                                   const void *, const void *, const void *, void *,
                                   const moit_run *);

static PyObject *answer_moments(PyObject *args, moments_answer *ask) {
    PyObject *technique, *b0, *b, *z;
    int threads;
    given_moments m;
    if (!PyArg_ParseTuple(args, "OiOOO", &technique, &threads, &b0, &b, &z)
        || hold_moments(&m, technique, b0, b, z, Py_None))
        return NULL;
    PyObject *out = PyArray_SimpleNew(2, PyArray_DIMS(m.z), m.type);
    if (out) {
        core_call call;
        begin_call(&call, threads);
        moit_status status = ask(&m.technique.technique, precision_of(m.type), m.pixels, m.depths,
                                 PyArray_DATA(m.b0), PyArray_DATA(m.b), PyArray_DATA(m.z),
                                 PyArray_DATA((PyArrayObject *)out), &call.run);
        if (end_call(&call, status)) Py_CLEAR(out);
    }
    let_moments_go(&m);
    return out;
}

PyDoc_STRVAR(moments_transmittance_doc,
             "moments_transmittance(technique, threads, b0, b, z, /)\n--\n\n(P, K).");

static PyObject *moments_transmittance(PyObject *Py_UNUSED(module), PyObject *args) {
    return answer_moments(args, moit_moments_transmittance);
}

PyDoc_STRVAR(moments_absorbance_doc, "moments_absorbance(technique, threads, b0, b, z, /)\n--\n\n"
                                     "(P, K): -ln of that, of power or trigonometric moments.");

static PyObject *moments_absorbance(PyObject *Py_UNUSED(module), PyObject *args) {
    return answer_moments(args, moit_moments_absorbance);
}

PyDoc_STRVAR(moment_words_doc, "moment_words(technique, threads, b, /)\n--\n\n"
                               "(P, 4) uint16 that Moment Transparency keeps of b (P, 4).");

static PyObject *moment_words(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *b_in, *out = NULL;
    int threads;
    held_technique held;
    if (!PyArg_ParseTuple(args, "OiO:moment_words", &object, &threads, &b_in)
        || hold_technique(&held, object, NULL))
        return NULL;
    const moit_technique *technique = &held.technique;
    int type = number_type_of(b_in);
    PyArrayObject *b = array_of(b_in, type, 2, "b");
    if (!b) goto done;
    if (technique->kind != MOIT_MOMENT_TRANSPARENCY
        || technique->transparency.storage == MOIT_STORAGE_FLOAT || PyArray_DIM(b, 1) != 4) {
        PyErr_SetString(PyExc_ValueError, "expected a storage in words, and four moments a pixel");
        goto done;
    }
    if (!(out = PyArray_SimpleNew(2, PyArray_DIMS(b), NPY_UINT16))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_moment_words_kept(technique, precision_of(type), PyArray_DIM(b, 0), PyArray_DATA(b),
                               PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    Py_XDECREF(b);
    let_technique_go(&held);
    return out;
}

PyDoc_STRVAR(moments_bounds_doc, "moments_bounds(technique, threads, b0, b, z, alpha, /)\n--\n\n"
                                 "(lower, upper), (P, K) each; alpha (P, K) or None.");

static PyObject *moments_bounds(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *technique, *b0, *b, *z, *alpha, *pair = NULL;
    int threads;
    given_moments m;
    if (!PyArg_ParseTuple(args, "OiOOOO:moments_bounds", &technique, &threads, &b0, &b, &z, &alpha)
        || hold_moments(&m, technique, b0, b, z, alpha))
        return NULL;
    PyObject *lower = PyArray_SimpleNew(2, PyArray_DIMS(m.z), m.type);
    PyObject *upper = PyArray_SimpleNew(2, PyArray_DIMS(m.z), m.type);
    if (lower && upper) {
        core_call call;
        begin_call(&call, threads);
        moit_status status = moit_moments_bounds(
            &m.technique.technique, precision_of(m.type), m.pixels, m.depths, PyArray_DATA(m.b0),
            PyArray_DATA(m.b), PyArray_DATA(m.z), m.alpha ? PyArray_DATA(m.alpha) : NULL,
            PyArray_DATA((PyArrayObject *)lower), PyArray_DATA((PyArrayObject *)upper), &call.run);
        if (!end_call(&call, status)) pair = PyTuple_Pack(2, lower, upper);
    }
    Py_XDECREF(lower);
    Py_XDECREF(upper);
    let_moments_go(&m);
    return pair;
}

PyDoc_STRVAR(moments_pivots_doc,
             "moments_pivots(technique, threads, b0, b, needed, /)\n--\n\n"
             "(P,) float64: least pivots of one set of moments b (P, m); with `needed` the biases "
             "that make them positive.");

static PyObject *moments_pivots(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *b0_in, *b_in, *out = NULL;
    PyArrayObject *b0 = NULL, *b = NULL;
    int threads, needed;
    held_technique held;
    if (!PyArg_ParseTuple(args, "OiOOp:moments_pivots", &object, &threads, &b0_in, &b_in, &needed)
        || hold_technique(&held, object, NULL))
        return NULL;
    int type = number_type_of(b0_in);
    if (!(b0 = array_of(b0_in, type, 1, "b0")) || !(b = array_of(b_in, type, 2, "b"))) goto done;
    int numbers = moit_moment_set(&held.technique);
    if (!numbers || PyArray_DIM(b, 0) != PyArray_DIM(b0, 0) || PyArray_DIM(b, 1) != numbers) {
        PyErr_SetString(PyExc_ValueError, "the shapes of b0 and b do not fit the technique");
        goto done;
    }
    if (!(out = PyArray_SimpleNew(1, PyArray_DIMS(b0), NPY_DOUBLE))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status = (needed ? moit_moments_least_bias : moit_moments_pivots)(
        &held.technique, precision_of(type), PyArray_DIM(b0, 0), PyArray_DATA(b0), PyArray_DATA(b),
        PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    Py_XDECREF(b0);
    Py_XDECREF(b);
    let_technique_go(&held);
    return out;
}

PyDoc_STRVAR(bias_doc, "bias(technique, which, /)\n--\n\n"
                       "The default for 'float32' or 'float64' storage, or the 'published' bias.");

static PyObject *bias(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *technique;
    const char *which;
    held_technique held;
    if (!PyArg_ParseTuple(args, "Os:bias", &technique, &which)
        || hold_technique(&held, technique, NULL))
        return NULL;
    bool is_double = strcmp(which, "float64") == 0,
         known = moit_moment_numbers(&held.technique) > 0;
    double bias = !known ? 0.0
                  : strcmp(which, "published") == 0
                      ? moit_published_bias(&held.technique)
                      : moit_default_bias(&held.technique, is_double ? MOIT_FLOAT64 : MOIT_FLOAT32);
    let_technique_go(&held);
    if (!known)
        return PyErr_Format(PyExc_ValueError, "technique: expected one that stores moments");
    return PyFloat_FromDouble(bias);
}

PyDoc_STRVAR(
    numbers_within_doc,
    "numbers_within(threads, checks, /)\n--\n\n"
    "Whether the numbers of all checks (array, low, high) are within; NaN is not. At most\n"
    "four arrays of one dtype, C-contiguous.");

static PyObject *numbers_within(PyObject *Py_UNUSED(module), PyObject *args) {
    enum { MOST = 4 };
    PyObject *checks, *result = NULL;
    PyArrayObject *held[MOST] = {NULL};
    moit_range_check arrays[MOST];
    int threads, type = -1;
    if (!PyArg_ParseTuple(args, "iO!:numbers_within", &threads, &PyTuple_Type, &checks))
        return NULL;
    Py_ssize_t count = PyTuple_GET_SIZE(checks);
    if (count > MOST) return PyErr_Format(PyExc_ValueError, "checks: expected at most %d", MOST);
    for (Py_ssize_t i = 0; i < count; ++i) {
        PyObject *check = PyTuple_GET_ITEM(checks, i), *array;
        if (!PyTuple_Check(check)) {
            PyErr_SetString(PyExc_TypeError, "checks: expected (array, low, high)");
            goto done;
        }
        if (!PyArg_ParseTuple(check, "O!dd", &PyArray_Type, &array, &arrays[i].low,
                              &arrays[i].high))
            goto done;
        if (type < 0) type = number_type_of(array);
        if (!(held[i] = array_of(array, type, PyArray_NDIM((PyArrayObject *)array), "array")))
            goto done;
        arrays[i].x = PyArray_DATA(held[i]);
        arrays[i].n = PyArray_SIZE(held[i]);
    }
    bool within;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_are_within(precision_of(type), (int)count, arrays, &within, &call.run);
    if (!end_call(&call, status)) result = PyBool_FromLong(within);
done:
    for (int i = 0; i < MOST; ++i) Py_XDECREF(held[i]);
    return result;
}

static PyMethodDef methods[] = {
    {"numbers_within", numbers_within, METH_VARARGS, numbers_within_doc},
    {"moments_absorbance", moments_absorbance, METH_VARARGS, moments_absorbance_doc},
    {"moments_transmittance", moments_transmittance, METH_VARARGS, moments_transmittance_doc},
    {"moment_words", moment_words, METH_VARARGS, moment_words_doc},
    {"moments_bounds", moments_bounds, METH_VARARGS, moments_bounds_doc},
    {"moments_pivots", moments_pivots, METH_VARARGS, moments_pivots_doc},
    {"bias", bias, METH_VARARGS, bias_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_moments(PyObject *module) { return PyModule_AddFunctions(module, methods); }
