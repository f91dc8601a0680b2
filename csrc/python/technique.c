#include "technique.h"

#include <assert.h>
#include <limits.h>
#include <stddef.h>

enum option_type { INTEGER, NUMBER, TRUTH, NETWORK };

#define ONLY(kind) (1u << MOIT_##kind)
_Static_assert(MOIT_KIND_COUNT <= 32, "a kind has a bit of its own");
#define WEIGHTED ONLY(WEIGHTED_BLENDED)
#define STORED (ONLY(POWER_MOMENTS) | ONLY(TRIGONOMETRIC_MOMENTS))
#define TRANSPARENCY ONLY(MOMENT_TRANSPARENCY)
#define FRONTED ONLY(FRONT)
#define BOUNDED ONLY(BOUNDED_NEURAL)
#define NEURAL (ONLY(NEURAL_MOMENTS) | ONLY(DEEP_FRAGMENTS))
#define WAVELETS ONLY(HAAR_WAVELETS)
#define SERIES (ONLY(FOURIER_OPACITY) | ONLY(FUNCTION_MAP) | WAVELETS)
#define STEPS (ONLY(ADAPTIVE) | ONLY(MLAB))
#define LAYERS (ONLY(DEPTH_PEELING) | ONLY(KBUFFER) | ONLY(HYBRID) | STEPS)
#define STRONGEST (ONLY(ANCHORS) | ONLY(STRONG))
#define RENORMALIZED (ONLY(ADAPTIVE) | ONLY(DEPTH_PEELING) | ONLY(HYBRID) | ONLY(WEIGHTED_SUM))
#define SAMPLED (ONLY(STOCHASTIC) | ONLY(HASHED_ALPHA))
#define SLICED (ONLY(SLICES) | ONLY(AVBOIT))
#define BLOCKS (STORED | BOUNDED | SERIES) /* of pixels, with states */
/* The image's depth or each pixel's. */
#define RANGED (FRONTED | STORED | TRANSPARENCY | BOUNDED | SERIES | STRONGEST | SLICED)

/* Every option, and the kinds that must have it; whatever is not here they must not have. The
 * bounds guard tables that are indexed by these; what makes sense the surface has checked. */
static const struct {
    const char *name;
    uint32_t kinds;
    enum option_type type;
    size_t offset;
    long least, most;
} options[] = {
#define AT(member) offsetof(moit_technique, member)
    {"count",
     FRONTED | STORED | TRANSPARENCY | BOUNDED | SERIES | LAYERS | STRONGEST | ONLY(STOCHASTIC)
         | SLICED,
     INTEGER, AT(count), 0, INT_MAX},
    {"warp", RANGED | NEURAL | STEPS, INTEGER, AT(warp), MOIT_WARP_LOG, MOIT_WARP_NONE},
    {"range_per_pixel", RANGED, TRUTH, AT(range_per_pixel), 0, 0},
    {"max_alpha", RANGED | NEURAL, NUMBER, AT(max_alpha), 0, 0},
    {"resolution", BLOCKS | TRANSPARENCY, INTEGER, AT(resolution), 1, INT_MAX},
    {"full_total", BLOCKS, TRUTH, AT(full_total), 0, 0},
    {"depth_aware", BLOCKS, TRUTH, AT(depth_aware), 0, 0},
    {"normalize",
     RANGED | ONLY(NEURAL_MOMENTS) | ONLY(DEEP_SHADOW_MAP) | ONLY(STOCHASTIC) | RENORMALIZED, TRUTH,
     AT(normalize), 0, 0},
    {"bias", FRONTED | STORED | TRANSPARENCY | BOUNDED, NUMBER, AT(moments.bias), 0, 0},
    {"overestimation", FRONTED | STORED | TRANSPARENCY, NUMBER, AT(moments.overestimation), 0, 0},
    {"exclude_self", FRONTED | STORED | TRANSPARENCY, TRUTH, AT(moments.exclude_self), 0, 0},
    {"bits", STORED, INTEGER, AT(moments.bits), 16, 32},
    {"bits", FRONTED | BOUNDED, INTEGER, AT(moments.bits), 32, 32},
    {"halves", ONLY(POWER_MOMENTS) | BOUNDED, TRUTH, AT(moments.halves), 0, 0},
    {"b0_is_half", STORED, TRUTH, AT(moments.b0_is_half), 0, 0},
    {"wrapping_zone", FRONTED | ONLY(TRIGONOMETRIC_MOMENTS), NUMBER, AT(moments.wrapping_zone), 0,
     0},
    {"tail", FRONTED, INTEGER, AT(front.tail), 0, MOIT_KIND_COUNT - 1},
    {"moment_count", FRONTED, INTEGER, AT(front.moment_count), 2, 8},
    {"small_keys", FRONTED, TRUTH, AT(front.small_keys), 0, 0},
    {"passes", TRANSPARENCY, INTEGER, AT(transparency.passes), 1, 2},
    {"storage", TRANSPARENCY, INTEGER, AT(transparency.storage), 0, MOIT_STORAGE_UNORM16},
    {"average", TRANSPARENCY, TRUTH, AT(transparency.average), 0, 0},
    {"symmetric", TRANSPARENCY, TRUTH, AT(transparency.symmetric), 0, 0},
    {"range_in_words", ONLY(NEURAL_MOMENTS), TRUTH, AT(neural.range_in_words), 0, 0},
    {"bits", SERIES, INTEGER, AT(series.bits), 16, 32},
    {"exclude_self", SERIES, TRUTH, AT(series.exclude_self), 0, 0},
    {"bits", SLICED, INTEGER, AT(slices.bits), 2, 16},
    {"half_total", ONLY(SLICES), TRUTH, AT(slices.half_total), 0, 0},
    {"byte_total", ONLY(SLICES), TRUTH, AT(slices.byte_total), 0, 0},
    {"table", ONLY(SLICES), INTEGER, AT(slices.table), 0, MOIT_TABLE_PIXEL},
    {"tile", ONLY(SLICES), INTEGER, AT(slices.tile), 1, 1024},
    {"cells", SLICED, INTEGER, AT(slices.cells), 64, 8192},
    {"inside", ONLY(SLICES), TRUTH, AT(slices.inside), 0, 0},
    {"slice_bias", ONLY(AVBOIT), NUMBER, AT(slices.bias), 0, 0},
    {"average", ONLY(AVBOIT), TRUTH, AT(slices.average), 0, 0},
    {"cubic", ONLY(AVBOIT), TRUTH, AT(slices.cubic), 0, 0},
    {"resolution", SLICED, INTEGER, AT(resolution), 1, 1024},
    {"full_total", ONLY(SLICES), TRUTH, AT(full_total), 0, 0},
    {"depth_aware", ONLY(SLICES), TRUTH, AT(depth_aware), 0, 0},
    {"density", WAVELETS, TRUTH, AT(series.density), 0, 0},
    {"quantized", STEPS, TRUTH, AT(layers.quantized), 0, 0},
    {"by_energy", STEPS, TRUTH, AT(layers.by_energy), 0, 0},
    {"min_alpha", ONLY(MLAB), NUMBER, AT(layers.min_alpha), 0, 0},
    {"buckets", ONLY(MLAB), TRUTH, AT(layers.buckets), 0, 0},
    {"front_alpha", ONLY(MLAB), NUMBER, AT(layers.front_alpha), 0, 0},
    {"back_alpha", ONLY(MLAB), NUMBER, AT(layers.back_alpha), 0, 0},
    {"cells", ONLY(ANCHORS), INTEGER, AT(anchors.cells), 1, MOST_CELLS},
    {"gamma", ONLY(ANCHORS), NUMBER, AT(anchors.gamma), 0, 0},
    {"gamma", ONLY(STRONG), NUMBER, AT(strong.gamma), 0, 0},
    {"large_keys", ONLY(ANCHORS), TRUTH, AT(anchors.large_keys), 0, 0},
    {"large_keys", ONLY(STRONG), TRUTH, AT(strong.large_keys), 0, 0},
    {"network", BOUNDED, NETWORK, AT(bounded.network), 0, 0},
    {"network", FRONTED, NETWORK, AT(front.network), 0, 0}, /* its tail's */
    {"network", NEURAL, NETWORK, AT(neural.network), 0, 0},
    {"network", ONLY(STRONG), NETWORK, AT(strong.network), 0, 0},
    {"seed", SAMPLED, INTEGER, AT(sampling.seed), 0, INT_MAX},
    {"stratified", ONLY(STOCHASTIC), TRUTH, AT(sampling.stratified), 0, 0},
    {"core_alpha", ONLY(HYBRID), NUMBER, AT(core_alpha), 0, 0},
    {"tolerance", ONLY(DEEP_SHADOW_MAP), NUMBER, AT(tolerance), 0, 0},
    {"weight", WEIGHTED, INTEGER, AT(weighted.weight), 0, MOIT_WEIGHT_GIVEN},
    {"depth_scale", WEIGHTED, NUMBER, AT(weighted.depth_scale), 0, 0},
    {"bits", WEIGHTED, INTEGER, AT(weighted.bits), 16, 32},
#undef AT
};
enum { OPTIONS = sizeof options / sizeof *options };

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

static int set_option(moit_technique *technique, size_t i, PyObject *value) {
    char *place = (char *)technique + options[i].offset;
    if (options[i].type == NUMBER) {
        *(double *)place = PyFloat_AsDouble(value);
        return PyErr_Occurred() ? -1 : 0;
    }
    if (options[i].type == TRUTH) {
        int truth = PyObject_IsTrue(value);
        *(bool *)place = truth > 0;
        return truth < 0 ? -1 : 0;
    }
    /* the enumerations are as wide as int */
    return whole(value, options[i].name, options[i].least, options[i].most, (int *)place);
}

/* Whether the technique has that option; a network hangs on what is set of others. */
static bool has_option(const moit_technique *technique, size_t i) {
    return (options[i].kinds >> technique->kind & 1)
           && (options[i].type != NETWORK || moit_network_weights(technique));
}

/* Whether the technique has an option of this name; arrays are held beside it. */
static bool is_known(const moit_technique *technique, PyObject *name) {
    if (!PyUnicode_Check(name)) return false;
    for (size_t i = 0; i < OPTIONS; ++i)
        if (has_option(technique, i) && !PyUnicode_CompareWithASCIIString(name, options[i].name))
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
    for (size_t i = 0; i < OPTIONS; ++i) {
        if (options[i].type == NETWORK || !has_option(technique, i)) continue;
        PyObject *value = needed_option(technique, object, options[i].name);
        if (!value || set_option(technique, i, value)) return -1;
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
    size_t i = 0;
    while (i < OPTIONS && !(options[i].type == NETWORK && has_option(technique, i))) ++i;
    int needed = moit_network_weights(technique);
    assert((i < OPTIONS) == (needed > 0)); /* what has one has a place for it in the table */
    if (i == OPTIONS) return 0;
    PyObject *network = needed_option(technique, object, options[i].name);
    if (!network || !(held->network = array_of(network, NPY_FLOAT, 1, "network"))) return -1;
    if (PyArray_SIZE(held->network) != needed) {
        PyErr_Format(PyExc_ValueError, "network: %s needs %d weights, got %zd",
                     moit_kind_name(technique->kind), needed,
                     (Py_ssize_t)PyArray_SIZE(held->network));
        let_technique_go(held);
        return -1;
    }
    *(const float **)((char *)technique + options[i].offset) = PyArray_DATA(held->network);
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
