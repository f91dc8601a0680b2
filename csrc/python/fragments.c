/* Fragments: what is wrong with them, their orders, and their arrays as the core takes them. */
#include "binding.h"

#include <string.h>

enum { ARRAYS = MOIT_FRAGMENT_ARRAYS };

static const char *const array_names[ARRAYS] = {"offsets",      "depth", "alpha",    "color",
                                                "transmission", "back",  "emission", "deviation"};

/* Of array i: 2 where it has three numbers a fragment. */
static int dimensions_of(int i) {
    int array = MOIT_OFFSETS + i;
    return array == MOIT_COLOR || array == MOIT_TRANSMISSION || array == MOIT_EMISSION ? 2 : 1;
}

static int is_plain(PyObject *object, int type, int ndim) {
    if (!PyArray_Check(object)) return 0;
    PyArrayObject *array = (PyArrayObject *)object;
    return PyArray_TYPE(array) == type && PyArray_NDIM(array) == ndim
           && PyArray_IS_C_CONTIGUOUS(array) && PyArray_ISBEHAVED_RO(array);
}

/* Takes over `arrays`: what is NULL or None is absent. Shapes and types are guarded, values not. */
static int describe(held_fragments *held, PyObject *arrays[ARRAYS]) {
    *held = (held_fragments){.count = 0};
    int type =
        arrays[1] && PyArray_Check(arrays[1]) ? PyArray_TYPE((PyArrayObject *)arrays[1]) : -1;
    bool usable = is_plain(arrays[0], NPY_INT64, 1) && (type == NPY_FLOAT32 || type == NPY_FLOAT64)
                  && PyArray_DIM((PyArrayObject *)arrays[0], 0) >= 1
                  && is_plain(arrays[1], type, 1);
    if (usable) held->count = PyArray_DIM((PyArrayObject *)arrays[1], 0);
    for (int i = 2; usable && i < ARRAYS; ++i) {
        if (i > 2 && arrays[i] == Py_None) continue;
        PyArrayObject *array = (PyArrayObject *)arrays[i];
        int ndim = dimensions_of(i);
        usable = is_plain(arrays[i], type, ndim) && PyArray_DIM(array, 0) == held->count
                 && (ndim == 1 || PyArray_DIM(array, 1) == 3);
    }
    if (!usable) {
        PyErr_SetString(PyExc_TypeError,
                        "the arrays do not have the types and shapes of Fragments");
        for (int i = 0; i < ARRAYS; ++i) Py_XDECREF(arrays[i]);
        return -1;
    }
    const void *data[ARRAYS] = {NULL};
    for (int i = 0; i < ARRAYS; ++i) {
        if (arrays[i] == Py_None) {
            Py_DECREF(arrays[i]);
            continue;
        }
        held->arrays[i] = (PyArrayObject *)arrays[i];
        data[i] = PyArray_DATA(held->arrays[i]);
    }
    held->fragments = (moit_fragments){
        .precision = type == NPY_FLOAT32 ? MOIT_FLOAT32 : MOIT_FLOAT64,
        .pixels = PyArray_DIM(held->arrays[0], 0) - 1,
        .offsets = data[0],
        .depth = data[1],
        .alpha = data[2],
        .color = data[3],
        .transmission = data[4],
        .back = data[5],
        .emission = data[6],
        .deviation = data[7],
    };
    return 0;
}

void let_go(held_fragments *held) {
    for (int i = 0; i < ARRAYS; ++i) Py_CLEAR(held->arrays[i]);
}

static int pair_of(PyObject *object, const char *name, const char *format, void *first,
                   void *second) {
    PyObject *pair = PyObject_GetAttrString(object, name);
    if (!pair) return -1;
    int parsed = PyTuple_Check(pair) && PyArg_ParseTuple(pair, format, first, second);
    Py_DECREF(pair);
    if (parsed) return 0;
    if (!PyErr_Occurred()) PyErr_Format(PyExc_TypeError, "%s must be a pair", name);
    return -1;
}

int hold_fragments(held_fragments *held, PyObject *object) {
    PyObject *arrays[ARRAYS] = {NULL};
    for (int i = 0; i < ARRAYS; ++i) {
        if ((arrays[i] = PyObject_GetAttrString(object, array_names[i]))) continue;
        while (i-- > 0) Py_DECREF(arrays[i]);
        return -1;
    }
    if (describe(held, arrays)) return -1;
    moit_fragments *f = &held->fragments;
    if (pair_of(object, "depth_range", "dd", &f->near, &f->far)
        || pair_of(object, "shape", "LL", &held->height, &held->width)
        || pair_of(object, "origin", "LL", &f->top, &f->left))
        goto failed;
    f->width = held->width;
    if (f->offsets[f->pixels] != held->count || held->height * held->width != f->pixels) {
        PyErr_SetString(PyExc_ValueError, "the arrays of these Fragments do not fit one another");
        goto failed;
    }
    return 0;
failed:
    let_go(held);
    return -1;
}

/* ---- Offsets that nobody can change ---------------------------------------------------------- */

static const char of_frozen[] = "offsets that nobody can change";

static void let_frozen_go(PyObject *owner) {
    Py_XDECREF((PyObject *)PyCapsule_GetPointer(owner, of_frozen));
}

static int is_frozen(PyArrayObject *offsets) {
    PyObject *base = PyArray_BASE(offsets);
    return base && PyCapsule_IsValid(base, of_frozen);
}

/* Room for n of them. What owns it is a capsule, of which NumPy can ask no memory to write to;
 * memory that NumPy asked for comes in large pages, as that of a bytes object does not. */
static PyArrayObject *frozen_room(npy_intp n) {
    PyObject *memory = PyArray_SimpleNew(1, &n, NPY_INT64), *owner = NULL, *room = NULL;
    if (!memory) return NULL;
    if (!(owner = PyCapsule_New(memory, of_frozen, let_frozen_go))) {
        Py_DECREF(memory);
        return NULL;
    }
    room = PyArray_New(&PyArray_Type, 1, &n, NPY_INT64, NULL, PyArray_DATA((PyArrayObject *)memory),
                       0, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED, NULL);
    if (!room) Py_DECREF(owner);
    else if (PyArray_SetBaseObject((PyArrayObject *)room, owner)) Py_CLEAR(room);
    return (PyArrayObject *)room;
}

PyDoc_STRVAR(frozen_doc, "frozen(offsets, /)\n--\n\n"
                         "A copy that cannot be made writeable; what this gave is given again.");

static PyObject *frozen(PyObject *Py_UNUSED(module), PyObject *object) {
    PyArrayObject *offsets = array_of(object, NPY_INT64, 1, "offsets");
    if (!offsets || is_frozen(offsets)) return (PyObject *)offsets;
    npy_intp n = PyArray_DIM(offsets, 0);
    PyArrayObject *copy = frozen_room(n);
    if (copy) memcpy(PyArray_DATA(copy), PyArray_DATA(offsets), (size_t)n * sizeof(int64_t));
    Py_DECREF(offsets);
    return (PyObject *)copy;
}

PyDoc_STRVAR(
    check_doc,
    "check_fragments(offsets, depth, alpha, color, transmission, back, emission, deviation,\n"
    "                near, far, threads, /)\n"
    "--\n\n"
    "(offsets, (name, index), None): what `frozen` makes of them, and the first offending number,\n"
    "in the flat array; if all is well (offsets, None, (near, far, transparent)), the range of\n"
    "depth, or (offsets, None, None) where it is not known.");

static PyObject *check_fragments(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *arrays[ARRAYS];
    double near, far;
    int threads;
    if (!PyArg_ParseTuple(args, "OOOOOOOOddi", &arrays[0], &arrays[1], &arrays[2], &arrays[3],
                          &arrays[4], &arrays[5], &arrays[6], &arrays[7], &near, &far, &threads))
        return NULL;
    for (int i = 0; i < ARRAYS; ++i) Py_INCREF(arrays[i]);
    held_fragments held;
    if (describe(&held, arrays)) return NULL;
    held.fragments.near = near;
    held.fragments.far = far;
    PyArrayObject *offsets = held.arrays[0];
    int64_t *copy = NULL;
    if (is_frozen(offsets)) {
        Py_INCREF(offsets);
    } else if ((offsets = frozen_room(PyArray_DIM(offsets, 0)))) {
        copy = PyArray_DATA(offsets);
    } else {
        let_go(&held);
        return NULL;
    }
    moit_fault fault;
    moit_span span;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_survey_fragments(&held.fragments, held.count, copy, &fault, &span, &call.run);
    int failed = end_call(&call, status);
    let_go(&held);
    if (failed) {
        Py_DECREF(offsets);
        return NULL;
    }
    if (fault.array != MOIT_NO_ARRAY)
        return Py_BuildValue("N(sL)O", offsets, array_names[fault.array - MOIT_OFFSETS],
                             (long long)fault.index, Py_None);
    if (!span.known) return Py_BuildValue("NOO", offsets, Py_None, Py_None);
    return Py_BuildValue("NO(ddO)", offsets, Py_None, span.near, span.far,
                         span.transparent ? Py_True : Py_False);
}

PyDoc_STRVAR(depth_order_doc,
             "depth_order(offsets, key, threads, /)\n--\n\n"
             "(N,) int64: within each pixel the indices by increasing key, stable.");

static PyObject *depth_order(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *arrays[ARRAYS] = {NULL, NULL, NULL, Py_None, Py_None, Py_None, Py_None, Py_None};
    int threads;
    if (!PyArg_ParseTuple(args, "OOi", &arrays[0], &arrays[1], &threads)) return NULL;
    arrays[2] = arrays[1]; /* alpha is not looked at */
    for (int i = 0; i < ARRAYS; ++i) Py_INCREF(arrays[i]);
    held_fragments held;
    if (describe(&held, arrays)) return NULL;
    PyObject *order = NULL;
    npy_intp count = held.count;
    if (held.fragments.offsets[held.fragments.pixels] != held.count) {
        PyErr_SetString(PyExc_ValueError, "offsets do not end at the number of keys");
        goto done;
    }
    if (!(order = PyArray_SimpleNew(1, &count, NPY_INT64))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_depth_order(&held.fragments, PyArray_DATA((PyArrayObject *)order), &call.run);
    if (end_call(&call, status)) Py_CLEAR(order);
done:
    let_go(&held);
    return order;
}

PyDoc_STRVAR(group_doc,
             "group_by_pixel(pixel, pixels, /)\n--\n\n"
             "(offsets (pixels + 1,), order (N,)), or the first index outside [0, pixels).\n"
             "Nobody else may change `pixel` meanwhile.");

static PyObject *group_by_pixel(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *result = NULL;
    Py_ssize_t pixels;
    if (!PyArg_ParseTuple(args, "On", &object, &pixels)) return NULL;
    if (pixels < 0 || pixels == PY_SSIZE_T_MAX)
        return PyErr_Format(PyExc_ValueError, "pixels: expected 0 to %zd, got %zd",
                            PY_SSIZE_T_MAX - 1, pixels);
    PyArrayObject *pixel = array_of(object, NPY_INT64, 1, "pixel");
    if (!pixel) return NULL;
    npy_intp count = PyArray_DIM(pixel, 0), ends = (npy_intp)pixels + 1;
    PyObject *offsets = PyArray_SimpleNew(1, &ends, NPY_INT64);
    PyObject *order = PyArray_SimpleNew(1, &count, NPY_INT64);
    if (!offsets || !order) goto done;
    int64_t grouped;
    Py_BEGIN_ALLOW_THREADS
    grouped = moit_group_by_pixel(PyArray_DATA(pixel), count, pixels,
                                  PyArray_DATA((PyArrayObject *)offsets),
                                  PyArray_DATA((PyArrayObject *)order));
    Py_END_ALLOW_THREADS
    result = grouped == count ? PyTuple_Pack(2, offsets, order) : PyLong_FromLongLong(grouped);
done:
    Py_DECREF(pixel);
    Py_XDECREF(offsets);
    Py_XDECREF(order);
    return result;
}

static PyMethodDef methods[] = {
    {"check_fragments", check_fragments, METH_VARARGS, check_doc},
    {"frozen", frozen, METH_O, frozen_doc},
    {"depth_order", depth_order, METH_VARARGS, depth_order_doc},
    {"group_by_pixel", group_by_pixel, METH_VARARGS, group_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_fragments(PyObject *module) { return PyModule_AddFunctions(module, methods); }
