/* Pictures whose draws have resolutions of their own. */
#include "technique.h"

PyDoc_STRVAR(target_sums_doc,
             "target_sums(fragments, technique, threads, /)\n--\n\n"
             "(height, width, 5) float64: what a technique's targets hold; nothing is culled.");

static PyObject *target_sums(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *object, *out = NULL;
    int threads;
    held_fragments held;
    held_technique technique;
    if (!PyArg_ParseTuple(args, "OOi:target_sums", &fragments, &object, &threads)
        || hold_asked(&held, fragments, &technique, object))
        return NULL;
    if (!moit_has_target_sums(&technique.technique) || !held.fragments.color
        || held.fragments.transmission) {
        PyErr_SetString(PyExc_ValueError,
                        "expected a technique that adds up, and coloured fragments");
        goto done;
    }
    npy_intp shape[3] = {held.height, held.width, MOIT_TARGET_SUMS};
    if (!(out = PyArray_SimpleNew(3, shape, NPY_DOUBLE))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_target_sums(&held.fragments, &technique.technique,
                                          PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    let_technique_go(&technique);
    let_go(&held);
    return out;
}

enum { MOST_PICTURES = 8 };

typedef struct {
    moit_target_picture picture[MOST_PICTURES];
    PyArrayObject *arrays[2 * MOST_PICTURES];
    int count;
} held_pictures;

static void let_pictures_go(held_pictures *held) {
    for (int i = 0; i < 2 * MOST_PICTURES; ++i) Py_CLEAR(held->arrays[i]);
}

static bool fits(const moit_target_picture *whole, const moit_target_picture *one) {
    return one->side >= 1 && one->side <= MOIT_MOST_SIDE
           && one->width == (whole->width + one->side - 1) / one->side
           && one->height == (whole->height + one->side - 1) / one->side;
}

/* From a list of (side, sums, occluders), that of the whole picture first. */
static int hold_pictures(held_pictures *held, PyObject *list) {
    *held = (held_pictures){.count = 0};
    if (!PyList_Check(list) || PyList_GET_SIZE(list) < 1 || PyList_GET_SIZE(list) > MOST_PICTURES) {
        PyErr_Format(PyExc_ValueError, "pictures: expected a list of 1 to %d", MOST_PICTURES);
        return -1;
    }
    for (; held->count < PyList_GET_SIZE(list); ++held->count) {
        moit_target_picture *one = &held->picture[held->count];
        PyArrayObject **arrays = held->arrays + 2 * held->count;
        PyObject *tuple = PyList_GET_ITEM(list, held->count), *sums, *occluders;
        if (!PyTuple_Check(tuple)) {
            PyErr_SetString(PyExc_TypeError, "pictures: expected tuples (side, sums, occluders)");
            goto failed;
        }
        if (!PyArg_ParseTuple(tuple, "iOO", &one->side, &sums, &occluders)
            || !(arrays[0] = array_of(sums, NPY_DOUBLE, 3, "sums"))
            || !(arrays[1] = array_of(occluders, NPY_FLOAT, 2, "occluders")))
            goto failed;
        one->height = PyArray_DIM(arrays[1], 0);
        one->width = PyArray_DIM(arrays[1], 1);
        one->sums = PyArray_DATA(arrays[0]);
        one->occluders = PyArray_DATA(arrays[1]);
        if (PyArray_DIM(arrays[0], 0) != one->height || PyArray_DIM(arrays[0], 1) != one->width
            || PyArray_DIM(arrays[0], 2) != MOIT_TARGET_SUMS || !fits(held->picture, one)
            || held->picture[0].side != 1) {
            PyErr_SetString(PyExc_ValueError, "pictures: the shapes do not fit one another");
            goto failed;
        }
    }
    return 0;
failed:
    let_pictures_go(held);
    return -1;
}

PyDoc_STRVAR(
    join_targets_doc,
    "join_targets(technique, pictures, depth_aware, behind, threads, /)\n--\n\n"
    "(height, width, 4) float32 of a list of (side, sums, occluders), the whole picture first,"
    "\nover behind (height, width, 3).");

static PyObject *join_targets(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *object, *list, *behind_in, *out = NULL;
    PyArrayObject *behind = NULL;
    int depth_aware, threads;
    held_technique technique;
    held_pictures held;
    if (!PyArg_ParseTuple(args, "OOpOi:join_targets", &object, &list, &depth_aware, &behind_in,
                          &threads)
        || hold_technique(&technique, object, NULL))
        return NULL;
    if (hold_pictures(&held, list)) {
        let_technique_go(&technique);
        return NULL;
    }
    const moit_target_picture *whole = &held.picture[0];
    if (!(behind = array_of(behind_in, NPY_DOUBLE, 3, "behind"))) goto done;
    if (!moit_has_target_sums(&technique.technique) || PyArray_DIM(behind, 0) != whole->height
        || PyArray_DIM(behind, 1) != whole->width || PyArray_DIM(behind, 2) != 3) {
        PyErr_SetString(PyExc_ValueError, "behind, technique: they do not fit the pictures");
        goto done;
    }
    npy_intp shape[3] = {whole->height, whole->width, 4};
    if (!(out = PyArray_SimpleNew(3, shape, NPY_FLOAT))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_join_targets(&technique.technique, whole, held.count - 1, whole + 1, depth_aware,
                          PyArray_DATA(behind), PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    Py_XDECREF(behind);
    let_pictures_go(&held);
    let_technique_go(&technique);
    return out;
}

static PyMethodDef methods[] = {
    {"target_sums", target_sums, METH_VARARGS, target_sums_doc},
    {"join_targets", join_targets, METH_VARARGS, join_targets_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_mixed(PyObject *module) { return PyModule_AddFunctions(module, methods); }
