/* Derivatives of answers, backwards. */
#include "technique.h"

#include "moit_gradients.h"

/* Results of a pullback: depth, alpha, color, transmission, background; NULL: not asked for. */
enum { RESULTS = 5 };

typedef struct {
    held_fragments held;
    held_technique technique;
    PyArrayObject *seed;
    PyObject *results[RESULTS];
    moit_gradients out;
} pullback;

static void let_pullback_go(pullback *q) {
    for (int i = 0; i < RESULTS; ++i) Py_CLEAR(q->results[i]);
    Py_CLEAR(q->seed);
    let_technique_go(&q->technique);
    let_go(&q->held);
}

/* What the core needs, checked so far as memory goes. seeds: per pixel, or -1: one a fragment. */
static int hold_pullback(pullback *q, PyObject *fragments, PyObject *technique, PyObject *seed,
                         npy_intp per_pixel, bool background) {
    if (hold_asked(&q->held, fragments, &q->technique, technique)) return -1;
    const moit_fragments *f = &q->held.fragments;
    for (int i = 0; i < RESULTS; ++i) q->results[i] = NULL;
    q->seed = NULL;
    int type = f->precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
    npy_intp n = (npy_intp)q->held.count, pixels = (npy_intp)f->pixels;
    const char *why = moit_gradient_refusal(&q->technique.technique);
    if (!moit_has_gradient(q->technique.technique.kind)) why = "it has none";
    if (f->transmission && !moit_facts_of(q->technique.technique.kind).takes_transmission)
        why = "it does not take transmission";
    if (why) {
        PyErr_Format(PyExc_ValueError, "no derivatives: %s", why);
        let_pullback_go(q);
        return -1;
    }
    q->seed =
        (PyArrayObject *)PyArray_FROM_OTF(seed, type, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED);
    if (!q->seed) goto failed;
    if (PyArray_SIZE(q->seed) != (per_pixel < 0 ? n : per_pixel * pixels)) {
        PyErr_SetString(PyExc_ValueError, "the seed does not fit the answer");
        goto failed;
    }
    npy_intp rows[2] = {n, 3}, image[3] = {q->held.height, q->held.width, 3};
    for (int i = 0; i < RESULTS; ++i) {
        bool wanted =
            i < 2 || (i == 2 && f->color) || (i == 3 && f->transmission) || (i == 4 && background);
        if (!wanted) continue;
        q->results[i] = i == 4  ? PyArray_SimpleNew(3, image, NPY_DOUBLE)
                        : i < 2 ? PyArray_SimpleNew(1, rows, type)
                                : PyArray_SimpleNew(2, rows, type);
        if (!q->results[i]) goto failed;
    }
#define DATA(i) (q->results[i] ? PyArray_DATA((PyArrayObject *)q->results[i]) : NULL)
    q->out = (moit_gradients){DATA(0), DATA(1), DATA(2), DATA(3), DATA(4)};
#undef DATA
    return 0;
failed:
    let_pullback_go(q);
    return -1;
}

static PyObject *finish(pullback *q, int failed) {
    PyObject *all = failed ? NULL : PyTuple_New(RESULTS);
    for (int i = 0; all && i < RESULTS; ++i) {
        PyObject *one = q->results[i] ? q->results[i] : Py_None;
        PyTuple_SET_ITEM(all, i, Py_NewRef(one));
    }
    let_pullback_go(q);
    return all;
}

PyDoc_STRVAR(composite_pullback_doc,
             "composite_pullback(fragments, technique, cull_opaque, threads, background, seed, /)\n"
             "--\n\n"
             "Derivatives of sum(seed * composite) by (depth, alpha, color, transmission,\n"
             "background), the last (height, width, 3) float64; None of what is not there.");

static PyObject *composite_pullback(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *background_in, *seed;
    int cull_opaque, threads, failed = -1;
    pullback q;
    if (!PyArg_ParseTuple(args, "OOpiOO:composite_pullback", &fragments, &technique, &cull_opaque,
                          &threads, &background_in, &seed)
        || hold_pullback(&q, fragments, technique, seed, 4, true))
        return NULL;
    PyArrayObject *background = (PyArrayObject *)PyArray_FROM_OTF(
        background_in, NPY_DOUBLE, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED);
    if (!background) return finish(&q, -1);
    bool per_pixel = PyArray_NDIM(background) == 3;
    npy_intp needed = per_pixel ? 3 * (npy_intp)q.held.fragments.pixels : 3;
    if (PyArray_SIZE(background) != needed || !q.held.fragments.color) {
        PyErr_SetString(PyExc_ValueError, "composite needs color and a fitting background");
    } else {
        core_call call;
        begin_call(&call, threads);
        moit_status status = moit_composite_pullback(
            &q.held.fragments, &q.technique.technique, cull_opaque, PyArray_DATA(background),
            per_pixel, PyArray_DATA(q.seed), &q.out, &call.run);
        failed = end_call(&call, status);
    }
    Py_DECREF(background);
    return finish(&q, failed);
}

typedef moit_status pull(const moit_fragments *, const moit_technique *, bool, const void *,
                         const moit_gradients *, const moit_run *);

static PyObject *pulled(PyObject *args, pull *pull_back, bool totals) {
    PyObject *fragments, *technique, *seed;
    int cull_opaque, threads;
    pullback q;
    if (!PyArg_ParseTuple(args, "OOpiO", &fragments, &technique, &cull_opaque, &threads, &seed))
        return NULL;
    PyObject *transmission = PyObject_GetAttrString(fragments, "transmission");
    if (!transmission) return NULL;
    int per_pixel = !totals ? -1 : transmission == Py_None ? 1 : 3;
    Py_DECREF(transmission);
    if (hold_pullback(&q, fragments, technique, seed, per_pixel, false)) return NULL;
    core_call call;
    begin_call(&call, threads);
    moit_status status = pull_back(&q.held.fragments, &q.technique.technique, cull_opaque,
                                   PyArray_DATA(q.seed), &q.out, &call.run);
    return finish(&q, end_call(&call, status));
}

PyDoc_STRVAR(transmittance_pullback_doc,
             "transmittance_pullback(fragments, technique, cull_opaque, threads, seed, /)\n--\n\n"
             "As composite_pullback, of sum(seed * transmittance), seed (N,).");

static PyObject *transmittance_pullback(PyObject *Py_UNUSED(module), PyObject *args) {
    return pulled(args, moit_transmittance_pullback, false);
}

PyDoc_STRVAR(
    curve_pullback_doc,
    "curve_pullback(fragments, technique, cull_opaque, threads, depth, seed, /)\n--\n\n"
    "As composite_pullback, of sum(seed * curve), depth (K,) and seed (height, width, K).");

static PyObject *curve_pullback(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *depth_in, *seed;
    int cull_opaque, threads, failed = -1;
    pullback q;
    if (!PyArg_ParseTuple(args, "OOpiOO:curve_pullback", &fragments, &technique, &cull_opaque,
                          &threads, &depth_in, &seed))
        return NULL;
    PyArrayObject *depth = (PyArrayObject *)PyArray_FROM_OTF(
        depth_in, NPY_DOUBLE, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED);
    if (!depth) return NULL;
    npy_intp depths = PyArray_SIZE(depth);
    if (hold_pullback(&q, fragments, technique, seed, depths, false)) {
        Py_DECREF(depth);
        return NULL;
    }
    if (!moit_facts_of(q.technique.technique.kind).has_curve || depths < 1) {
        PyErr_SetString(PyExc_ValueError, "no derivatives: it has no curve, or there is no depth");
    } else {
        core_call call;
        begin_call(&call, threads);
        moit_status status =
            moit_curve_pullback(&q.held.fragments, &q.technique.technique, cull_opaque, depths,
                                PyArray_DATA(depth), PyArray_DATA(q.seed), &q.out, &call.run);
        failed = end_call(&call, status);
    }
    Py_DECREF(depth);
    return finish(&q, failed);
}

PyDoc_STRVAR(total_transmittance_pullback_doc,
             "total_transmittance_pullback(fragments, technique, cull_opaque, threads, seed, /)\n"
             "--\n\n"
             "As composite_pullback, of sum(seed * total_transmittance).");

static PyObject *total_transmittance_pullback(PyObject *Py_UNUSED(module), PyObject *args) {
    return pulled(args, moit_total_transmittance_pullback, true);
}

PyDoc_STRVAR(gradient_refusal_doc, "gradient_refusal(technique, /)\n--\n\n"
                                   "Why there are no derivatives with these options, or None.");

static PyObject *gradient_refusal(PyObject *Py_UNUSED(module), PyObject *fields) {
    held_technique technique;
    if (hold_technique(&technique, fields, NULL)) return NULL;
    const char *why = moit_gradient_refusal(&technique.technique);
    let_technique_go(&technique);
    if (!why) Py_RETURN_NONE;
    return PyUnicode_FromString(why);
}

static PyMethodDef methods[] = {
    {"composite_pullback", composite_pullback, METH_VARARGS, composite_pullback_doc},
    {"transmittance_pullback", transmittance_pullback, METH_VARARGS, transmittance_pullback_doc},
    {"curve_pullback", curve_pullback, METH_VARARGS, curve_pullback_doc},
    {"total_transmittance_pullback", total_transmittance_pullback, METH_VARARGS,
     total_transmittance_pullback_doc},
    {"gradient_refusal", gradient_refusal, METH_O, gradient_refusal_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_gradients(PyObject *module) { return PyModule_AddFunctions(module, methods); }
