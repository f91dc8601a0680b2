#include "technique.h"

#include <assert.h>

static int whole(PyObject *value, const char *name, long least, long most, int *into) {
    long number = PyLong_AsLong(value);
    if (number == -1 && PyErr_Occurred()) return -1;
    if (number < least || number > most) {
        PyErr_Format(PyExc_ValueError, "%s: expected %ld to %ld, got %ld", name, least, most,
                     number);
        return -1;
    }
    *into = (int)number;
    return 0;
}

static int set_option(moit_technique *technique, const moit_option *option, PyObject *value) {
    char *place = (char *)technique + option->offset;
    if (option->type == MOIT_NUMBER) {
        *(double *)place = PyFloat_AsDouble(value);
        return PyErr_Occurred() ? -1 : 0;
    }
    if (option->type == MOIT_TRUTH) {
        int truth = PyObject_IsTrue(value);
        *(bool *)place = truth > 0;
        return truth < 0 ? -1 : 0;
    }
    /* the enumerations are as wide as int */
    return whole(value, option->name, option->least, option->most, (int *)place);
}

/* Whether the technique has this one of its kind's; a network hangs on what is set of others. */
static bool has_option(const moit_technique *technique, const moit_option *option) {
    return option->type != MOIT_NETWORK || moit_network_weights(technique);
}

/* Whether the technique has an option of this name; arrays are held beside it. */
static bool is_known(const moit_technique *technique, PyObject *name) {
    if (!PyUnicode_Check(name)) return false;
    for (const moit_option *one = moit_options_of(technique->kind); one->name; ++one)
        if (has_option(technique, one) && !PyUnicode_CompareWithASCIIString(name, one->name))
            return true;
    return !PyUnicode_CompareWithASCIIString(name, "kind")
           || (technique->kind == MOIT_WEIGHTED_BLENDED
               && !PyUnicode_CompareWithASCIIString(name, "weights"));
}

static PyObject *needed_option(const moit_technique *technique, PyObject *object,
                               const char *name) {
    PyObject *value = PyDict_GetItemString(object, name);
    if (!value)
        PyErr_Format(PyExc_TypeError, "technique: %s needs the option '%s'",
                     moit_kind_name(technique->kind), name);
    return value;
}

/* All that the kind needs, and nothing else. */
static int set_options(moit_technique *technique, PyObject *object) {
    PyObject *kind = PyDict_GetItemString(object, "kind"), *name;
    if (!kind) {
        PyErr_SetString(PyExc_TypeError, "technique: 'kind' is missing");
        return -1;
    }
    if (whole(kind, "kind", 0, MOIT_KIND_COUNT - 1, (int *)&technique->kind)) return -1;
    for (const moit_option *one = moit_options_of(technique->kind); one->name; ++one) {
        if (one->type == MOIT_NETWORK) continue;
        PyObject *value = needed_option(technique, object, one->name);
        if (!value || set_option(technique, one, value)) return -1;
    }
    for (Py_ssize_t place = 0; PyDict_Next(object, &place, &name, NULL);)
        if (!is_known(technique, name)) {
            PyErr_Format(PyExc_TypeError, "technique: %s has no option %R",
                         moit_kind_name(technique->kind), name);
            return -1;
        }
    return 0;
}

static int hold_network(held_technique *held, PyObject *object) {
    moit_technique *technique = &held->technique;
    const moit_option *own = moit_options_of(technique->kind);
    while (own->name && own->type != MOIT_NETWORK) ++own;
    int needed = moit_network_weights(technique);
    assert(own->name || needed == 0); /* what has one has a place for it */
    if (!needed) return 0;
    PyObject *network = needed_option(technique, object, own->name);
    if (!network || !(held->network = array_of(network, NPY_FLOAT, 1, "network"))) return -1;
    if (PyArray_SIZE(held->network) != needed) {
        PyErr_Format(PyExc_ValueError, "network: %s needs %d weights, got %zd",
                     moit_kind_name(technique->kind), needed,
                     (Py_ssize_t)PyArray_SIZE(held->network));
        let_technique_go(held);
        return -1;
    }
    *(const float **)((char *)technique + own->offset) = PyArray_DATA(held->network);
    return 0;
}

/* Given weights, one a fragment; without fragments they are not looked at. */
static int hold_weights(held_technique *held, PyObject *object, const held_fragments *fragments) {
    moit_weighted_options *weighted = &held->technique.weighted;
    if (weighted->weight == MOIT_WEIGHT_BLOG && fragments && !fragments->fragments.color) {
        PyErr_SetString(PyExc_ValueError, "the blog's weight needs color");
        return -1;
    }
    if (weighted->weight != MOIT_WEIGHT_GIVEN || !fragments) return 0;
    PyObject *weights = needed_option(&held->technique, object, "weights");
    int type = fragments->fragments.precision == MOIT_FLOAT64 ? NPY_DOUBLE : NPY_FLOAT;
    if (!weights || !(held->weights = array_of(weights, type, 1, "weights"))) return -1;
    if (PyArray_SIZE(held->weights) != fragments->count) {
        PyErr_SetString(PyExc_ValueError, "there must be one weight a fragment");
        let_technique_go(held);
        return -1;
    }
    weighted->weights = PyArray_DATA(held->weights);
    return 0;
}

int hold_technique(held_technique *held, PyObject *object, const held_fragments *fragments) {
    *held = (held_technique){.weights = NULL};
    if (!PyDict_Check(object)) {
        PyErr_SetString(PyExc_TypeError, "technique: expected a dict of its options");
        return -1;
    }
    moit_technique *technique = &held->technique;
    if (set_options(technique, object)) return -1;
    if (!moit_technique_fits(technique)) {
        PyErr_Format(PyExc_ValueError, "count: %s has no loop for %d",
                     moit_kind_name(technique->kind), technique->count);
        return -1;
    }
    return technique->kind == MOIT_WEIGHTED_BLENDED ? hold_weights(held, object, fragments)
                                                    : hold_network(held, object);
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
