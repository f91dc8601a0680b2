/* Derivatives of answers, backwards. */
#include "technique.h"

#include "moit_gradients.h"

#include <string.h>

/* Results of a pullback: depth, alpha, color, transmission, background, network; NULL: not asked
 * for. */
enum { RESULTS = 6 };

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

/* What the core needs, checked so far as memory goes. seeds: per pixel, or -1: one a fragment;
 * background: of a picture, or NULL. */
static int hold_pullback(pullback *q, PyObject *fragments, PyObject *technique, PyObject *seed,
                         npy_intp per_pixel, PyArrayObject *background) {
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
    npy_intp rows[2] = {n, 3};
    npy_intp weights = moit_network_weights(&q->technique.technique);
    for (int i = 0; i < RESULTS; ++i) {
        bool wanted = i < 2 || (i == 2 && f->color) || (i == 3 && f->transmission)
                      || (i == 4 && background) || (i == 5 && weights);
        if (!wanted) continue;
        q->results[i] = i == 5   ? PyArray_SimpleNew(1, &weights, NPY_DOUBLE)
                        : i == 4 ? PyArray_SimpleNew(PyArray_NDIM(background),
                                                     PyArray_DIMS(background), NPY_DOUBLE)
                        : i < 2  ? PyArray_SimpleNew(1, rows, type)
                                 : PyArray_SimpleNew(2, rows, type);
        if (!q->results[i]) goto failed;
    }
#define DATA(i) (q->results[i] ? PyArray_DATA((PyArrayObject *)q->results[i]) : NULL)
    q->out = (moit_gradients){DATA(0), DATA(1), DATA(2), DATA(3), DATA(4), DATA(5)};
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
             "background, network): background, of its shape, and network, by the weights as they\n"
             "are given, in float64; None of what is not there.");

static PyObject *composite_pullback(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *background_in, *seed;
    int cull_opaque, threads, failed = -1;
    pullback q;
    if (!PyArg_ParseTuple(args, "OOpiOO:composite_pullback", &fragments, &technique, &cull_opaque,
                          &threads, &background_in, &seed))
        return NULL;
    PyArrayObject *background = (PyArrayObject *)PyArray_FROM_OTF(
        background_in, NPY_DOUBLE, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED);
    if (!background) return NULL;
    if (hold_pullback(&q, fragments, technique, seed, 4, background)) {
        Py_DECREF(background);
        return NULL;
    }
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
    if (hold_pullback(&q, fragments, technique, seed, per_pixel, NULL)) return NULL;
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
    if (hold_pullback(&q, fragments, technique, seed, depths, NULL)) {
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

/* ---- Moments by themselves ------------------------------------------------------------------- */

enum { MOMENT_ARRAYS = 4 };

typedef struct {
    held_technique technique;
    PyArrayObject *given[MOMENT_ARRAYS], *seed[2]; /* b0, b, z and alpha */
    PyObject *results[MOMENT_ARRAYS];
    moit_moment_arrays arrays;
    moit_moment_gradients out;
} moments_pullback;

static void let_moments_pullback_go(moments_pullback *q) {
    for (int i = 0; i < MOMENT_ARRAYS; ++i) Py_CLEAR(q->given[i]);
    for (int i = 0; i < MOMENT_ARRAYS; ++i) Py_CLEAR(q->results[i]);
    for (int i = 0; i < 2; ++i) Py_CLEAR(q->seed[i]);
    let_technique_go(&q->technique);
}

static bool moments_fit(const moments_pullback *q, int seeds) {
    PyArrayObject *b0 = q->given[0], *b = q->given[1], *z = q->given[2], *alpha = q->given[3];
    bool fits = PyArray_DIM(b, 0) == PyArray_DIM(b0, 0) && PyArray_DIM(z, 0) == PyArray_DIM(b0, 0)
                && PyArray_DIM(b, 1) == moit_moment_numbers(&q->technique.technique)
                && (!alpha || PyArray_SAMESHAPE(alpha, z));
    for (int i = 0; i < seeds; ++i) fits = fits && PyArray_SAMESHAPE(q->seed[i], z);
    return fits;
}

/* given: b0, b, z and alpha, which may be None. */
static int hold_moments_pullback(moments_pullback *q, PyObject *technique, PyObject *const *given,
                                 PyObject *const *seed, int seeds) {
    static const char *const names[MOMENT_ARRAYS] = {"b0", "b", "z", "alpha"};
    memset(q, 0, sizeof *q);
    if (hold_technique(&q->technique, technique, NULL)) return -1;
    int type = number_type_of(given[0]);
    const char *why = moit_moments_gradient_refusal(&q->technique.technique);
    if (!why && seeds == 2 && q->technique.technique.kind == MOIT_TRIGONOMETRIC_MOMENTS)
        why = "trigonometric moments prove nothing that hangs on them";
    if (why) {
        PyErr_Format(PyExc_ValueError, "no derivatives: %s", why);
        goto failed;
    }
    for (int i = 0; i < MOMENT_ARRAYS; ++i)
        if (given[i] != Py_None
            && !(q->given[i] = array_of(given[i], type, i == 0 ? 1 : 2, names[i])))
            goto failed;
    for (int i = 0; i < seeds; ++i)
        if (!(q->seed[i] = array_of(seed[i], type, 2, "seed"))) goto failed;
    if (!q->given[1] || !q->given[2] || !moments_fit(q, seeds)) {
        PyErr_SetString(PyExc_ValueError, "the shapes of moments and seeds do not fit one another");
        goto failed;
    }
    for (int i = 0; i < MOMENT_ARRAYS; ++i)
        if (q->given[i]
            && !(q->results[i] =
                     PyArray_ZEROS(PyArray_NDIM(q->given[i]), PyArray_DIMS(q->given[i]), type, 0)))
            goto failed;
#define DATA(of, i) (q->of[i] ? PyArray_DATA((PyArrayObject *)q->of[i]) : NULL)
    q->arrays = (moit_moment_arrays){.precision = precision_of(type),
                                     .pixels = PyArray_DIM(q->given[0], 0),
                                     .depths = PyArray_DIM(q->given[2], 1),
                                     .b0 = DATA(given, 0),
                                     .b = DATA(given, 1),
                                     .z = DATA(given, 2),
                                     .alpha = DATA(given, 3)};
    q->out = (moit_moment_gradients){DATA(results, 0), DATA(results, 1), DATA(results, 2),
                                     DATA(results, 3)};
#undef DATA
    return 0;
failed:
    let_moments_pullback_go(q);
    return -1;
}

static PyObject *finish_moments(moments_pullback *q, int failed) {
    PyObject *all = failed ? NULL : PyTuple_New(MOMENT_ARRAYS);
    for (int i = 0; all && i < MOMENT_ARRAYS; ++i) {
        PyObject *one = q->results[i] ? q->results[i] : Py_None;
        PyTuple_SET_ITEM(all, i, Py_NewRef(one));
    }
    let_moments_pullback_go(q);
    return all;
}

PyDoc_STRVAR(
    moments_pullback_doc,
    "moments_pullback(technique, threads, b0, b, z, absorbance, seed, /)\n--\n\n"
    "Derivatives of sum(seed * T), or with absorbance of sum(seed * -ln T), by (b0, b, z,\n"
    "None).");

static PyObject *pull_moments(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *technique, *given[MOMENT_ARRAYS] = {NULL, NULL, NULL, Py_None}, *seed;
    int threads, absorbance;
    moments_pullback q;
    if (!PyArg_ParseTuple(args, "OiOOOpO:moments_pullback", &technique, &threads, &given[0],
                          &given[1], &given[2], &absorbance, &seed)
        || hold_moments_pullback(&q, technique, given, &seed, 1))
        return NULL;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_moments_pullback(&q.technique.technique, &q.arrays, absorbance,
                                               PyArray_DATA(q.seed[0]), &q.out, &call.run);
    return finish_moments(&q, end_call(&call, status));
}

PyDoc_STRVAR(moments_bounds_pullback_doc,
             "moments_bounds_pullback(technique, threads, b0, b, z, alpha, lower, upper, /)\n--\n\n"
             "As moments_pullback, of bounds, by (b0, b, z, alpha or None).");

static PyObject *pull_moments_bounds(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *technique, *given[MOMENT_ARRAYS], *seed[2];
    int threads;
    moments_pullback q;
    if (!PyArg_ParseTuple(args, "OiOOOOOO:moments_bounds_pullback", &technique, &threads, &given[0],
                          &given[1], &given[2], &given[3], &seed[0], &seed[1])
        || hold_moments_pullback(&q, technique, given, seed, 2))
        return NULL;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_moments_bounds_pullback(&q.technique.technique, &q.arrays, PyArray_DATA(q.seed[0]),
                                     PyArray_DATA(q.seed[1]), &q.out, &call.run);
    return finish_moments(&q, end_call(&call, status));
}

PyDoc_STRVAR(bound_of_rows_doc,
             "bound_of_rows(technique, threads, rows, z, slopes, most, /)\n--\n\n"
             "(bound, by rows, by z, all fit) of sums of powers (1 + count, N) and a place each\n"
             "(N), whose sizes are at most `most`, as means are; by rows and by z None unless\n"
             "slopes are asked for.");

static PyObject *bound_of_rows(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fields, *given[2], *out[3] = {NULL, NULL, NULL}, *all = NULL;
    PyArrayObject *rows = NULL, *z = NULL;
    held_technique technique;
    int threads, slopes;
    double most;
    bool all_fit = false;
    if (!PyArg_ParseTuple(args, "OiOOpd:bound_of_rows", &fields, &threads, &given[0], &given[1],
                          &slopes, &most)
        || hold_technique(&technique, fields, NULL))
        return NULL;
    const char *why = moit_moments_gradient_refusal(&technique.technique);
    if (technique.technique.kind != MOIT_POWER_MOMENTS) why = "expected power moments";
    if (why) {
        PyErr_Format(PyExc_ValueError, "no derivatives: %s", why);
        goto done;
    }
    int type = number_type_of(given[0]);
    if (!(rows = array_of(given[0], type, 2, "rows")) || !(z = array_of(given[1], type, 1, "z")))
        goto done;
    npy_intp rays = PyArray_DIM(z, 0);
    if (PyArray_DIM(rows, 0) != 1 + technique.technique.count || PyArray_DIM(rows, 1) != rays) {
        PyErr_SetString(PyExc_ValueError, "rows: expected 1 + count of them, and as many z");
        goto done;
    }
    out[0] = PyArray_SimpleNew(1, &rays, type);
    if (slopes) out[1] = PyArray_SimpleNew(2, PyArray_DIMS(rows), type);
    if (slopes) out[2] = PyArray_SimpleNew(1, &rays, type);
    if (!out[0] || (slopes && (!out[1] || !out[2]))) goto done;
#define DATA(i) (out[i] ? PyArray_DATA((PyArrayObject *)out[i]) : NULL)
    moit_power_rows asked = {precision_of(type),
                             rays,
                             PyArray_DATA(rows),
                             PyArray_DATA(z),
                             DATA(0),
                             DATA(1),
                             DATA(2),
                             most};
#undef DATA
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_bound_of_rows(&technique.technique, &asked, &all_fit, &call.run);
    if (!end_call(&call, status))
        all = Py_BuildValue("OOOO", out[0], slopes ? out[1] : Py_None, slopes ? out[2] : Py_None,
                            all_fit ? Py_True : Py_False);
done:
    for (int i = 0; i < 3; ++i) Py_CLEAR(out[i]);
    Py_XDECREF(rows);
    Py_XDECREF(z);
    let_technique_go(&technique);
    return all;
}

PyDoc_STRVAR(moments_gradient_refusal_doc,
             "moments_gradient_refusal(technique, /)\n--\n\n"
             "Why moments by themselves have no derivatives with these options, or None.");

static PyObject *moments_gradient_refusal(PyObject *Py_UNUSED(module), PyObject *fields) {
    held_technique technique;
    if (hold_technique(&technique, fields, NULL)) return NULL;
    const char *why = moit_moments_gradient_refusal(&technique.technique);
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
    {"moments_pullback", pull_moments, METH_VARARGS, moments_pullback_doc},
    {"moments_bounds_pullback", pull_moments_bounds, METH_VARARGS, moments_bounds_pullback_doc},
    {"bound_of_rows", bound_of_rows, METH_VARARGS, bound_of_rows_doc},
    {"moments_gradient_refusal", moments_gradient_refusal, METH_O, moments_gradient_refusal_doc},
    {"gradient_refusal", gradient_refusal, METH_O, gradient_refusal_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_gradients(PyObject *module) { return PyModule_AddFunctions(module, methods); }
