#include "technique.h"

#include <limits.h>
#include <stddef.h>

enum field_type { INTEGER, NUMBER, TRUTH };

/* The bounds guard tables that are indexed by these; what makes sense the surface has checked. */
static const struct {
    const char *name;
    size_t offset;
    enum field_type type;
    long least, most;
} fields[] = {
    {"kind", offsetof(moit_technique, kind), INTEGER, 0, MOIT_KIND_COUNT - 1},
    {"count", offsetof(moit_technique, count), INTEGER, 0, INT_MAX},
    {"bits", offsetof(moit_technique, bits), INTEGER, 0, 64},
    {"b0_is_half", offsetof(moit_technique, b0_is_half), TRUTH, 0, 0},
    {"bias", offsetof(moit_technique, bias), NUMBER, 0, 0},
    {"overestimation", offsetof(moit_technique, overestimation), NUMBER, 0, 0},
    {"warp", offsetof(moit_technique, warp), INTEGER, MOIT_WARP_LOG, MOIT_WARP_NONE},
    {"range_per_pixel", offsetof(moit_technique, range_per_pixel), TRUTH, 0, 0},
    {"range_in_words", offsetof(moit_technique, range_in_words), TRUTH, 0, 0},
    {"normalize", offsetof(moit_technique, normalize), TRUTH, 0, 0},
    {"exclude_self", offsetof(moit_technique, exclude_self), TRUTH, 0, 0},
    {"max_alpha", offsetof(moit_technique, max_alpha), NUMBER, 0, 0},
    {"wrapping_zone", offsetof(moit_technique, wrapping_zone), NUMBER, 0, 0},
    {"density", offsetof(moit_technique, density), TRUTH, 0, 0},
    {"tolerance", offsetof(moit_technique, tolerance), NUMBER, 0, 0},
    {"quantized", offsetof(moit_technique, quantized), TRUTH, 0, 0},
    {"min_alpha", offsetof(moit_technique, min_alpha), NUMBER, 0, 0},
    {"weight", offsetof(moit_technique, weight), INTEGER, 0, MOIT_WEIGHT_GIVEN},
    {"passes", offsetof(moit_technique, passes), INTEGER, 0, 2},
    {"storage", offsetof(moit_technique, storage), INTEGER, 0, MOIT_STORAGE_UNORM16},
    {"resolution", offsetof(moit_technique, resolution), INTEGER, 0, INT_MAX},
    {"average", offsetof(moit_technique, average), TRUTH, 0, 0},
    {"symmetric", offsetof(moit_technique, symmetric), TRUTH, 0, 0},
    {"depth_scale", offsetof(moit_technique, depth_scale), NUMBER, 0, 0},
    {"seed", offsetof(moit_technique, seed), INTEGER, 0, INT_MAX},
    {"stratified", offsetof(moit_technique, stratified), TRUTH, 0, 0},
};

static int set_field(moit_technique *technique, size_t i, PyObject *value) {
    char *place = (char *)technique + fields[i].offset;
    if (fields[i].type == NUMBER) {
        *(double *)place = PyFloat_AsDouble(value);
        return PyErr_Occurred() ? -1 : 0;
    }
    if (fields[i].type == TRUTH) {
        int truth = PyObject_IsTrue(value);
        *(bool *)place = truth > 0;
        return truth < 0 ? -1 : 0;
    }
    long number = PyLong_AsLong(value);
    if (number == -1 && PyErr_Occurred()) return -1;
    if (number < fields[i].least || number > fields[i].most) {
        PyErr_Format(PyExc_ValueError, "%s: expected %ld to %ld, got %ld", fields[i].name,
                     fields[i].least, fields[i].most, number);
        return -1;
    }
    *(int *)place = (int)number; /* the enumerations are as wide as int */
    return 0;
}

static int hold_network(held_technique *held, PyObject *object) {
    moit_technique *technique = &held->technique;
    int needed = moit_network_weights(technique);
    if (!needed) return 0;
    PyObject *network = PyDict_GetItemString(object, "network");
    if (!network || !(held->network = array_of(network, NPY_FLOAT, 1, "network"))) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "network is missing");
        return -1;
    }
    if (PyArray_SIZE(held->network) != needed) {
        PyErr_Format(PyExc_ValueError, "network: %s needs %d weights, got %zd",
                     moit_kind_name(technique->kind), needed,
                     (Py_ssize_t)PyArray_SIZE(held->network));
        let_technique_go(held);
        return -1;
    }
    technique->network = PyArray_DATA(held->network);
    technique->network_count = (size_t)needed;
    return 0;
}

int hold_technique(held_technique *held, PyObject *object, const held_fragments *fragments) {
    *held = (held_technique){.weights = NULL};
    if (!PyDict_Check(object)) {
        PyErr_SetString(PyExc_TypeError, "technique: expected a dict of its fields");
        return -1;
    }
    for (size_t i = 0; i < sizeof fields / sizeof *fields; ++i) {
        PyObject *value = PyDict_GetItemString(object, fields[i].name);
        if (value && set_field(&held->technique, i, value)) return -1;
    }
    moit_technique *technique = &held->technique;
    if (!moit_technique_fits(technique)) {
        PyErr_Format(PyExc_ValueError, "count: %s has no loop for %d",
                     moit_kind_name(technique->kind), technique->count);
        return -1;
    }
    if (technique->kind != MOIT_WEIGHTED_BLENDED) return hold_network(held, object);
    if (technique->weight == MOIT_WEIGHT_BLOG && fragments && !fragments->fragments.color) {
        PyErr_SetString(PyExc_ValueError, "the blog's weight needs color");
        return -1;
    }
    if (technique->weight != MOIT_WEIGHT_GIVEN || !fragments) return 0;
    PyObject *weights = PyDict_GetItemString(object, "weights");
    int type = fragments->fragments.precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
    if (!weights || !(held->weights = array_of(weights, type, 1, "weights"))) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "weights are missing");
        return -1;
    }
    if (PyArray_SIZE(held->weights) != fragments->count) {
        PyErr_SetString(PyExc_ValueError, "there must be one weight a fragment");
        let_technique_go(held);
        return -1;
    }
    technique->weights = PyArray_DATA(held->weights);
    return 0;
}

void let_technique_go(held_technique *held) {
    Py_CLEAR(held->weights);
    Py_CLEAR(held->network);
}

int hold_asked(held_fragments *held, PyObject *fragments, held_technique *technique,
               PyObject *object) {
    if (hold_fragments(held, fragments)) return -1;
    if (!hold_technique(technique, object, held)) return 0;
    let_go(held);
    return -1;
}
