/* The samples of deep files: held out by others, and fewer of them. */
#include "binding.h"
#include "moit_deep.h"

/* Samples, alive until let_samples_go. */
typedef struct {
    moit_deep samples;
    int64_t count;
    PyArrayObject *offsets, *front, *back, *alpha;
} held_samples;

static void let_samples_go(held_samples *held) {
    Py_XDECREF(held->offsets);
    Py_XDECREF(held->front);
    Py_XDECREF(held->back);
    Py_XDECREF(held->alpha);
    *held = (held_samples){0};
}

static bool is_in_order(const int64_t *offset, npy_intp pixels, int64_t count) {
    if (offset[0] != 0 || offset[pixels] != count) return false;
    for (npy_intp p = 0; p < pixels; ++p)
        if (offset[p + 1] < offset[p]) return false;
    return true;
}

/* 0, or holding nothing -1 with an exception. */
static int hold_samples(held_samples *held, PyObject *offsets, PyObject *front, PyObject *back,
                        PyObject *alpha) {
    *held = (held_samples){0};
    if (!(held->offsets = array_of(offsets, NPY_INT64, 1, "offsets"))
        || !(held->front = array_of(front, NPY_FLOAT32, 1, "front"))
        || (back != Py_None && !(held->back = array_of(back, NPY_FLOAT32, 1, "back")))
        || !(held->alpha = array_of(alpha, NPY_FLOAT32, 2, "alpha")))
        goto failed;
    npy_intp pixels = PyArray_DIM(held->offsets, 0) - 1, alphas = PyArray_DIM(held->alpha, 0);
    held->count = PyArray_DIM(held->front, 0);
    if (pixels < 0 || PyArray_DIM(held->alpha, 1) != held->count
        || (held->back && PyArray_DIM(held->back, 0) != held->count)
        || (alphas != 1 && alphas != MOIT_MOST_ALPHAS)
        || !is_in_order(PyArray_DATA(held->offsets), pixels, held->count)) {
        PyErr_SetString(PyExc_ValueError, "offsets, front, back and alpha (1 or 3, samples) "
                                          "disagree");
        goto failed;
    }
    held->samples = (moit_deep){pixels,
                                PyArray_DATA(held->offsets),
                                PyArray_DATA(held->front),
                                held->back ? PyArray_DATA(held->back) : NULL,
                                (int)alphas,
                                PyArray_DATA(held->alpha)};
    return 0;
failed:
    let_samples_go(held);
    return -1;
}

PyDoc_STRVAR(
    hold_out_doc,
    "hold_out(offsets, front, back, alpha, holds, threads, /)\n--\n\n"
    "(offsets, source, front, back, alpha, gain) of what is seen of samples through those that\n"
    "hold out (moit_hold_out in csrc/moit_deep.h).");

static PyObject *hold_out(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *offsets, *front, *back, *alpha, *holding, *made[6] = {NULL}, *result = NULL;
    int threads;
    if (!PyArg_ParseTuple(args, "OOOOOi", &offsets, &front, &back, &alpha, &holding, &threads))
        return NULL;
    held_samples held;
    PyArrayObject *holds = array_of(holding, NPY_BOOL, 1, "holds");
    if (!holds || hold_samples(&held, offsets, front, back, alpha)) {
        Py_XDECREF(holds);
        return NULL;
    }
    npy_intp ends = (npy_intp)held.samples.pixels + 1;
    if (PyArray_DIM(holds, 0) != held.count) {
        PyErr_SetString(PyExc_ValueError, "holds: needed one for each sample");
        goto done;
    }
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *counted = PyArray_DATA((PyArrayObject *)made[0]);
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_held_out_offsets(&held.samples, PyArray_DATA(holds), counted, &call.run);
    if (end_call(&call, status)) goto done;
    npy_intp pieces = (npy_intp)counted[ends - 1], shape[2] = {held.samples.alphas, pieces};
    static const int types[] = {NPY_INT64, NPY_FLOAT32, NPY_FLOAT32, NPY_DOUBLE, NPY_DOUBLE};
    void *to[5];
    for (int i = 0; i < 5; ++i) {
        made[1 + i] = PyArray_SimpleNew(i < 3 ? 1 : 2, i < 3 ? &pieces : shape, types[i]);
        if (!made[1 + i]) goto done;
        to[i] = PyArray_DATA((PyArrayObject *)made[1 + i]);
    }
    moit_held_out out = {to[0], to[1], to[2], to[3], to[4]};
    begin_call(&call, threads);
    status = moit_hold_out(&held.samples, PyArray_DATA(holds), counted, &out, &call.run);
    if (end_call(&call, status)) goto done;
    result = PyTuple_Pack(6, made[0], made[1], made[2], made[3], made[4], made[5]);
done:
    let_samples_go(&held);
    Py_DECREF(holds);
    for (int i = 0; i < 6; ++i) Py_XDECREF(made[i]);
    return result;
}

/* What is to be done, and the arrays that hold it. */
typedef struct {
    moit_simplifying how;
    PyArrayObject *light, *dimmed_by, *light_is_half, *identity;
} held_simplifying;

static void let_simplifying_go(held_simplifying *held) {
    Py_XDECREF(held->light);
    Py_XDECREF(held->dimmed_by);
    Py_XDECREF(held->light_is_half);
    Py_XDECREF(held->identity);
    *held = (held_simplifying){0};
}

/* 0, or holding nothing -1 with an exception; held->how has the rest already. */
static int hold_simplifying(held_simplifying *held, const held_samples *samples, PyObject *light,
                            PyObject *dimmed_by, PyObject *light_is_half, PyObject *identity) {
    if (!(held->light = array_of(light, NPY_FLOAT32, 2, "light"))
        || !(held->dimmed_by = array_of(dimmed_by, NPY_INT, 1, "dimmed_by"))
        || !(held->light_is_half = array_of(light_is_half, NPY_BOOL, 1, "light_is_half"))
        || (identity != Py_None
            && !(held->identity = array_of(identity, NPY_INT64, 1, "identity"))))
        goto failed;
    npy_intp lights = PyArray_DIM(held->light, 0);
    const int *dims = PyArray_DATA(held->dimmed_by);
    bool fits = lights <= MOIT_MOST_DEEP_LIGHTS && PyArray_DIM(held->light, 1) == samples->count
                && PyArray_DIM(held->dimmed_by, 0) == lights
                && PyArray_DIM(held->light_is_half, 0) == lights
                && (!held->identity || PyArray_DIM(held->identity, 0) == samples->count);
    for (npy_intp l = 0; fits && l < lights; ++l)
        fits = 0 <= dims[l] && dims[l] < samples->samples.alphas;
    if (!fits) {
        PyErr_SetString(PyExc_ValueError, "light (at most 60, samples), dimmed_by, light_is_half "
                                          "and identity disagree");
        goto failed;
    }
    held->how.lights = (int)lights;
    held->how.light = PyArray_DATA(held->light);
    held->how.dimmed_by = dims;
    held->how.light_is_half = PyArray_DATA(held->light_is_half);
    held->how.identity = held->identity ? PyArray_DATA(held->identity) : NULL;
    return 0;
failed:
    let_simplifying_go(held);
    return -1;
}

PyDoc_STRVAR(
    simplify_doc,
    "simplify(offsets, front, back, alpha, light, dimmed_by, light_is_half, identity,\n"
    "         alpha_is_half, depth_is_half, volumes, shortest, error, depth_error,\n"
    "         threads, /)\n--\n\n"
    "(counts, source, front, back, alpha, light, worst): pixel p's samples are counts[p] from\n"
    "offsets[p] on (moit_simplify in csrc/moit_deep.h).");

static PyObject *simplify(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *offsets, *front, *back, *alpha, *light, *dimmed_by, *light_is_half, *identity;
    PyObject *made[7] = {NULL}, *result = NULL;
    int alpha_is_half, depth_is_half, volumes, shortest, threads;
    held_samples held;
    held_simplifying wanted = {0};
    if (!PyArg_ParseTuple(args, "OOOOOOOOppppddi", &offsets, &front, &back, &alpha, &light,
                          &dimmed_by, &light_is_half, &identity, &alpha_is_half, &depth_is_half,
                          &volumes, &shortest, &wanted.how.error, &wanted.how.depth_error,
                          &threads))
        return NULL;
    wanted.how.alpha_is_half = alpha_is_half;
    wanted.how.depth_is_half = depth_is_half;
    wanted.how.volumes = volumes;
    wanted.how.shortest = shortest;
    if (hold_samples(&held, offsets, front, back, alpha)) return NULL;
    if (hold_simplifying(&wanted, &held, light, dimmed_by, light_is_half, identity)) goto done;
    npy_intp pixels = (npy_intp)held.samples.pixels, samples = (npy_intp)held.count;
    const npy_intp shapes[7][2] = {{pixels, 0},
                                   {samples, 0},
                                   {samples, 0},
                                   {samples, 0},
                                   {held.samples.alphas, samples},
                                   {wanted.how.lights, samples},
                                   {pixels, 2}};
    static const int types[7] = {NPY_INT64,   NPY_INT64,   NPY_FLOAT32, NPY_FLOAT32,
                                 NPY_FLOAT32, NPY_FLOAT32, NPY_DOUBLE};
    void *to[7];
    for (int i = 0; i < 7; ++i) {
        made[i] = PyArray_SimpleNew(i < 4 ? 1 : 2, shapes[i], types[i]);
        if (!made[i]) goto done;
        to[i] = PyArray_DATA((PyArrayObject *)made[i]);
    }
    const moit_simplified out = {to[0], to[1], to[2], to[3], to[4], to[5], to[6]};
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_simplify(&held.samples, &wanted.how, &out, &call.run);
    if (end_call(&call, status)) goto done;
    result = PyTuple_Pack(7, made[0], made[1], made[2], made[3], made[4], made[5], made[6]);
done:
    let_samples_go(&held);
    let_simplifying_go(&wanted);
    for (int i = 0; i < 7; ++i) Py_XDECREF(made[i]);
    return result;
}

static PyMethodDef methods[] = {
    {"hold_out", hold_out, METH_VARARGS, hold_out_doc},
    {"simplify", simplify, METH_VARARGS, simplify_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_deep_samples(PyObject *module) { return PyModule_AddFunctions(module, methods); }
