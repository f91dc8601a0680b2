/* The questions about fragments. */
#include "technique.h"

#include "moit_gradients.h"

#define QUESTION_ARGUMENTS "fragments, technique, cull_opaque, threads"

typedef struct {
    held_fragments held;
    held_technique technique;
    int cull_opaque, threads;
} question;

static void let_question_go(question *q) {
    let_technique_go(&q->technique);
    let_go(&q->held);
}

static int hold_question(question *q, PyObject *fragments, PyObject *technique) {
    if (hold_asked(&q->held, fragments, &q->technique, technique)) return -1;
    if (q->held.fragments.transmission
        && !moit_facts_of(q->technique.technique.kind).takes_transmission) {
        PyErr_Format(PyExc_ValueError, "%s does not take transmission",
                     moit_kind_name(q->technique.technique.kind));
        let_question_go(q);
        return -1;
    }
    return 0;
}

static int result_type(const question *q) {
    return q->held.fragments.precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
}

PyDoc_STRVAR(composite_doc,
             "composite(" QUESTION_ARGUMENTS ", background, /)\n--\n\n"
             "(height, width, 4), and how many pixels keep more than half floats hold;\n"
             "background (3,) or (height, width, 3) float64.");

static PyObject *composite(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *background_in, *out = NULL;
    question q;
    if (!PyArg_ParseTuple(args, "OOpiO:composite", &fragments, &technique, &q.cull_opaque,
                          &q.threads, &background_in)
        || hold_question(&q, fragments, technique))
        return NULL;
    PyArrayObject *background = (PyArrayObject *)PyArray_FROM_OTF(
        background_in, NPY_DOUBLE, NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED);
    if (!background) goto done;
    bool per_pixel = PyArray_NDIM(background) == 3;
    npy_intp needed = per_pixel ? 3 * (npy_intp)q.held.fragments.pixels : 3;
    if (PyArray_SIZE(background) != needed || !q.held.fragments.color) {
        PyErr_SetString(PyExc_ValueError, "composite needs color and a fitting background");
        goto done;
    }
    npy_intp shape[3] = {q.held.height, q.held.width, 4};
    if (!(out = PyArray_SimpleNew(3, shape, result_type(&q)))) goto done;
    core_call call;
    begin_call(&call, q.threads);
    int64_t overflows = 0;
    call.run.overflows = &overflows;
    moit_status status = moit_composite(&q.held.fragments, &q.technique.technique, q.cull_opaque,
                                        PyArray_DATA(background), per_pixel,
                                        PyArray_DATA((PyArrayObject *)out), &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
    if (out) out = Py_BuildValue("NL", out, (long long)overflows);
done:
    Py_XDECREF(background);
    let_question_go(&q);
    return out;
}

PyDoc_STRVAR(total_transmittance_doc, "total_transmittance(" QUESTION_ARGUMENTS ", /)\n--\n\n"
                                      "(height, width), with transmission (height, width, 3).");

static PyObject *total_transmittance(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique;
    question q;
    if (!PyArg_ParseTuple(args, "OOpi:total_transmittance", &fragments, &technique, &q.cull_opaque,
                          &q.threads)
        || hold_question(&q, fragments, technique))
        return NULL;
    npy_intp shape[3] = {q.held.height, q.held.width, 3};
    PyObject *out =
        PyArray_SimpleNew(q.held.fragments.transmission ? 3 : 2, shape, result_type(&q));
    if (out) {
        core_call call;
        begin_call(&call, q.threads);
        moit_status status =
            moit_total_transmittance(&q.held.fragments, &q.technique.technique, q.cull_opaque,
                                     PyArray_DATA((PyArrayObject *)out), &call.run);
        if (end_call(&call, status)) Py_CLEAR(out);
    }
    let_question_go(&q);
    return out;
}

PyDoc_STRVAR(network_features_doc,
             "network_features(" QUESTION_ARGUMENTS ", /)\n--\n\n"
             "(N, columns) float64: what the technique's network sees of each fragment.");

static PyObject *network_features(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique;
    question q;
    if (!PyArg_ParseTuple(args, "OOpi:network_features", &fragments, &technique, &q.cull_opaque,
                          &q.threads)
        || hold_question(&q, fragments, technique))
        return NULL;
    PyObject *out = NULL;
    npy_intp shape[2] = {(npy_intp)q.held.count, moit_network_columns(&q.technique.technique)};
    if (!shape[1]) PyErr_SetString(PyExc_ValueError, "technique: expected one that has a network");
    else if ((out = PyArray_SimpleNew(2, shape, NPY_DOUBLE))) {
        core_call call;
        begin_call(&call, q.threads);
        moit_status status =
            moit_network_features(&q.held.fragments, &q.technique.technique, q.cull_opaque,
                                  PyArray_DATA((PyArrayObject *)out), &call.run);
        if (end_call(&call, status)) Py_CLEAR(out);
    }
    let_question_go(&q);
    return out;
}

/* One or two arrays: (N,), or with depths (height, width, K). */
static int new_results(const question *q, PyArrayObject *depth, PyObject **out, int count) {
    npy_intp per_fragment = (npy_intp)q->held.count;
    npy_intp curve[3] = {q->held.height, q->held.width, depth ? PyArray_SIZE(depth) : 0};
    for (int i = 0; i < count; ++i) {
        out[i] = depth ? PyArray_SimpleNew(3, curve, result_type(q))
                       : PyArray_SimpleNew(1, &per_fragment, result_type(q));
        if (!out[i]) return -1;
    }
    return 0;
}

static int hold_depth(PyObject *depth_in, PyArrayObject **depth) {
    *depth = NULL;
    if (depth_in == Py_None) return 0;
    return (*depth = array_of(depth_in, NPY_DOUBLE, 1, "depth")) ? 0 : -1;
}

PyDoc_STRVAR(transmittance_doc, "transmittance(" QUESTION_ARGUMENTS ", depth, /)\n--\n\n"
                                "(N,); with depth (K,) float64 the curve (height, width, K).");

static PyObject *transmittance(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *depth_in, *out = NULL;
    PyArrayObject *depth = NULL;
    question q;
    if (!PyArg_ParseTuple(args, "OOpiO:transmittance", &fragments, &technique, &q.cull_opaque,
                          &q.threads, &depth_in)
        || hold_question(&q, fragments, technique))
        return NULL;
    if (hold_depth(depth_in, &depth) || new_results(&q, depth, &out, 1)) goto done;
    core_call call;
    begin_call(&call, q.threads);
    void *data = PyArray_DATA((PyArrayObject *)out);
    moit_status status = depth
                             ? moit_curve(&q.held.fragments, &q.technique.technique, q.cull_opaque,
                                          PyArray_SIZE(depth), PyArray_DATA(depth), data, &call.run)
                             : moit_transmittance(&q.held.fragments, &q.technique.technique,
                                                  q.cull_opaque, data, &call.run);
    if (end_call(&call, status)) Py_CLEAR(out);
done:
    Py_XDECREF(depth);
    let_question_go(&q);
    return out;
}

PyDoc_STRVAR(bounds_doc, "bounds(" QUESTION_ARGUMENTS ", depth, /)\n--\n\n"
                         "(lower, upper), shapes as transmittance.");

static PyObject *bounds(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *depth_in, *out[2] = {NULL, NULL}, *pair = NULL;
    PyArrayObject *depth = NULL;
    question q;
    if (!PyArg_ParseTuple(args, "OOpiO:bounds", &fragments, &technique, &q.cull_opaque, &q.threads,
                          &depth_in)
        || hold_question(&q, fragments, technique))
        return NULL;
    if (hold_depth(depth_in, &depth) || new_results(&q, depth, out, 2)) goto done;
    core_call call;
    begin_call(&call, q.threads);
    void *lower = PyArray_DATA((PyArrayObject *)out[0]),
         *upper = PyArray_DATA((PyArrayObject *)out[1]);
    moit_status status =
        depth ? moit_curve_bounds(&q.held.fragments, &q.technique.technique, q.cull_opaque,
                                  PyArray_SIZE(depth), PyArray_DATA(depth), lower, upper, &call.run)
              : moit_bounds(&q.held.fragments, &q.technique.technique, q.cull_opaque, lower, upper,
                            &call.run);
    if (!end_call(&call, status)) pair = PyTuple_Pack(2, out[0], out[1]);
done:
    Py_XDECREF(out[0]);
    Py_XDECREF(out[1]);
    Py_XDECREF(depth);
    let_question_go(&q);
    return pair;
}

PyDoc_STRVAR(gather_doc, "gather(" QUESTION_ARGUMENTS ", raw, /)\n--\n\n"
                         "(b0 (P,), b (P, count)); raw, with 16 bits: b as uint16 words.");

static PyObject *gather(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *fragments, *technique, *pair = NULL;
    int raw;
    question q;
    if (!PyArg_ParseTuple(args, "OOpip:gather", &fragments, &technique, &q.cull_opaque, &q.threads,
                          &raw)
        || hold_question(&q, fragments, technique))
        return NULL;
    if (!moit_moment_numbers(&q.technique.technique)) {
        PyErr_SetString(PyExc_ValueError, "technique: expected one that stores moments");
        let_question_go(&q);
        return NULL;
    }
    npy_intp shape[2] = {(npy_intp)q.held.fragments.pixels,
                         moit_moment_numbers(&q.technique.technique)};
    PyObject *b0 = PyArray_SimpleNew(1, shape, result_type(&q));
    bool words = raw && q.technique.technique.moments.bits == 16;
    PyObject *b = PyArray_SimpleNew(2, shape, words ? NPY_UINT16 : result_type(&q));
    if (b0 && b) {
        core_call call;
        begin_call(&call, q.threads);
        void *b0_to = PyArray_DATA((PyArrayObject *)b0), *b_to = PyArray_DATA((PyArrayObject *)b);
        moit_status status = words ? moit_gather_words(&q.held.fragments, &q.technique.technique,
                                                       q.cull_opaque, b0_to, b_to, &call.run)
                                   : moit_gather(&q.held.fragments, &q.technique.technique,
                                                 q.cull_opaque, b0_to, b_to, &call.run);
        if (!end_call(&call, status)) pair = PyTuple_Pack(2, b0, b);
    }
    Py_XDECREF(b0);
    Py_XDECREF(b);
    let_question_go(&q);
    return pair;
}

PyDoc_STRVAR(technique_facts_doc,
             "technique_facts()\n--\n\n"
             "A dict for each kind, at its number: its name, and what is so whatever its options "
             "are.");

static PyObject *technique_facts(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(arguments)) {
    static const char *const ties[] = {"together", "earlier", "later"};
    static const char *const thick[] = {"points", "middle", "pieces", "moments", "waves", "cells"};
    PyObject *all = PyTuple_New(MOIT_KIND_COUNT);
    for (int kind = 0; all && kind < MOIT_KIND_COUNT; ++kind) {
        moit_technique_facts facts = moit_facts_of((moit_kind)kind);
#define TRUTH(fact) #fact, PyBool_FromLong(facts.fact)
        PyObject *one = Py_BuildValue(
            "{ss sN sN sN sN sN sN sN sN sN sN sN sN sN sN ss si sN si sN s(dd) ss}", "kind",
            moit_kind_name((moit_kind)kind), TRUTH(proves_bounds), TRUTH(has_curve),
            TRUTH(is_random), TRUTH(takes_transmission), TRUTH(knows_channels), TRUTH(uses_warp),
            TRUTH(stores_moments), TRUTH(has_network), TRUTH(adds_targets), TRUTH(adds_texels),
            TRUTH(takes_points), "has_gradient",
            PyBool_FromLong(moit_has_gradient((moit_kind)kind)), "order_independent",
            PyBool_FromLong(facts.arrival != MOIT_IN_ORDER), "ties_in_order",
            PyBool_FromLong(facts.arrival == MOIT_TIES_IN_ORDER), "ties", ties[facts.ties],
            "exact_up_to", facts.exact_up_to, TRUTH(exact_counts), "geometry_passes",
            facts.geometry_passes, TRUTH(passes_count), "unit_range", facts.unit_range[0],
            facts.unit_range[1], "thick", thick[facts.thick]);
#undef TRUTH
        if (!one) Py_CLEAR(all);
        else PyTuple_SET_ITEM(all, kind, one);
    }
    return all;
}

static PyMethodDef methods[] = {
    {"composite", composite, METH_VARARGS, composite_doc},
    {"total_transmittance", total_transmittance, METH_VARARGS, total_transmittance_doc},
    {"transmittance", transmittance, METH_VARARGS, transmittance_doc},
    {"network_features", network_features, METH_VARARGS, network_features_doc},
    {"bounds", bounds, METH_VARARGS, bounds_doc},
    {"gather", gather, METH_VARARGS, gather_doc},
    {"technique_facts", technique_facts, METH_NOARGS, technique_facts_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_questions(PyObject *module) { return PyModule_AddFunctions(module, methods); }
