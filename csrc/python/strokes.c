/* Points and lines to fragments. */
#include "binding.h"

enum { STROKE_ARRAYS = 5 };

typedef struct {
    moit_strokes strokes;
    PyArrayObject *arrays[STROKE_ARRAYS];
} held_strokes;

static void let_strokes_go(held_strokes *held) {
    for (int i = 0; i < STROKE_ARRAYS; ++i) Py_CLEAR(held->arrays[i]);
}

static bool rise_to(const int64_t *first, npy_intp count, npy_intp end) {
    for (npy_intp i = 0; i < count; ++i)
        if (first[i] < 0 || first[i] > first[i + 1]) return false;
    return first[count] == end;
}

/* From a tuple (first, positions, radii, colors, alphas); 0, or, holding nothing, -1 with an
 * exception. */
static int hold_strokes(held_strokes *held, PyObject *tuple) {
    static const char *const names[STROKE_ARRAYS] = {"first", "positions", "radii", "colors",
                                                     "alphas"};
    static const int types[STROKE_ARRAYS] = {NPY_INT64, NPY_DOUBLE, NPY_FLOAT, NPY_FLOAT,
                                             NPY_FLOAT},
                     ndims[STROKE_ARRAYS] = {1, 2, 1, 2, 1};
    *held = (held_strokes){.strokes = {.count = 0}};
    if (!PyTuple_Check(tuple) || PyTuple_GET_SIZE(tuple) != STROKE_ARRAYS) {
        PyErr_SetString(PyExc_TypeError, "strokes: expected a tuple of five");
        return -1;
    }
    bool fit = true;
    for (int i = 0; i < STROKE_ARRAYS; ++i) {
        held->arrays[i] = array_of(PyTuple_GET_ITEM(tuple, i), types[i], ndims[i], names[i]);
        if (!held->arrays[i]) goto failed;
        if (i > 0)
            fit = fit && PyArray_DIM(held->arrays[i], 0) == PyArray_DIM(held->arrays[1], 0)
                  && (ndims[i] == 1 || PyArray_DIM(held->arrays[i], 1) == 3);
    }
    npy_intp ends = PyArray_DIM(held->arrays[0], 0), nodes = PyArray_DIM(held->arrays[1], 0);
    if (!fit || ends < 1 || nodes >= INT32_MAX || ends >= INT32_MAX
        || !rise_to(PyArray_DATA(held->arrays[0]), ends - 1, nodes)) {
        PyErr_SetString(PyExc_ValueError, "the arrays of these strokes do not fit one another");
        goto failed;
    }
    held->strokes = (moit_strokes){.count = ends - 1,
                                   .nodes = nodes,
                                   .first = PyArray_DATA(held->arrays[0]),
                                   .position = PyArray_DATA(held->arrays[1]),
                                   .radius = PyArray_DATA(held->arrays[2]),
                                   .color = PyArray_DATA(held->arrays[3]),
                                   .alpha = PyArray_DATA(held->arrays[4])};
    return 0;
failed:
    let_strokes_go(held);
    return -1;
}

/* ---- Rasters --------------------------------------------------------------------------------- */

/* What a capsule of this name has: a raster, its offsets, its lights, and its picture's size. */
static const char NAME[] = "moit strokes on a screen";
typedef struct {
    moit_stroke_raster *raster;
    PyObject *offsets;
    int width, height, lights;
} held_raster;

static void let_raster_go(PyObject *capsule) {
    held_raster *held = PyCapsule_GetPointer(capsule, NAME);
    if (!held) return;
    moit_end_strokes(held->raster);
    Py_XDECREF(held->offsets);
    PyMem_Free(held);
}

PyDoc_STRVAR(begin_strokes_doc,
             "begin_strokes(strokes, how, camera, width, height, threads, lights=(), /)\n--\n\n"
             "(raster, offsets, nearest, farthest): what `draw_strokes` draws, how many fragments\n"
             "the pixels have, and how far away these are (none: inf, -inf), of (first,\n"
             "positions, radii, colors, alphas): (S + 1,) int64, (N, 3) float64, (N,), (N, 3) and\n"
             "(N,) float32, how they are drawn (solid, pixels, lit, samples), camera and lights\n"
             "as rasterize has them. Nobody else may change the arrays meanwhile.");

static PyObject *begin_strokes(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *tuple, *capsule = NULL, *lights = NULL;
    moit_camera camera = {.lights = {0}};
    int solid, pixels, lit, samples, width, height, threads;
    if (!PyArg_ParseTuple(args, "O(pppi)O&iii|O", &tuple, &solid, &pixels, &lit, &samples,
                          camera_of, &camera, &width, &height, &threads, &lights))
        return NULL;
    if (!is_size(width, height) || hold_lights(&camera.lights, lights)) return NULL;
    if (samples != 1 && samples != MOIT_SAMPLES) {
        PyErr_Format(PyExc_ValueError, "samples: expected 1 or %d", MOIT_SAMPLES);
        return NULL;
    }
    held_strokes strokes;
    if (hold_strokes(&strokes, tuple)) return NULL;
    npy_intp ends = (npy_intp)width * height + 1;
    float range[2];
    held_raster *held = PyMem_Calloc(1, sizeof *held);
    if (!held) {
        PyErr_NoMemory();
        goto done;
    }
    if (!(capsule = PyCapsule_New(held, NAME, let_raster_go))) {
        PyMem_Free(held);
        goto done;
    }
    held->width = width;
    held->height = height;
    held->lights = camera.lights.count;
    if (!(held->offsets = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto failed;
    PyArrayObject *offsets = (PyArrayObject *)held->offsets;
    const moit_stroking how = {.solid = solid, .pixels = pixels, .lit = lit, .samples = samples};
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_begin_strokes(&strokes.strokes, &how, &camera, width, height,
                                            PyArray_DATA(offsets), range, &held->raster, &call.run);
    if (end_call(&call, status)) goto failed;
    PyArray_CLEARFLAGS(offsets, NPY_ARRAY_WRITEABLE); /* the raster reads them */
    PyObject *result =
        Py_BuildValue("NOdd", capsule, held->offsets, (double)range[0], (double)range[1]);
    let_strokes_go(&strokes);
    return result;
failed:
    Py_CLEAR(capsule);
done:
    let_strokes_go(&strokes);
    return NULL;
}

PyDoc_STRVAR(draw_strokes_doc,
             "draw_strokes(raster, top, bottom, threads, reached=None, /)\n--\n\n"
             "(offsets, depth, alpha, color) of rows [top, bottom) of what begin_strokes gave;\n"
             "reached (N, lights) float64: the share of each light that comes to each fragment.");

static PyObject *draw_strokes(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *capsule, *shares = Py_None, *made[4] = {NULL}, *result = NULL;
    PyArrayObject *reached = NULL;
    int top, bottom, threads;
    if (!PyArg_ParseTuple(args, "Oiii|O", &capsule, &top, &bottom, &threads, &shares)) return NULL;
    if (!PyCapsule_IsValid(capsule, NAME)) {
        PyErr_SetString(PyExc_TypeError, "raster: expected what begin_strokes gave");
        return NULL;
    }
    const held_raster *held = PyCapsule_GetPointer(capsule, NAME);
    if (top < 0 || top >= bottom || bottom > held->height) {
        PyErr_SetString(PyExc_ValueError, "the rows are out of range");
        return NULL;
    }
    npy_intp ends = (npy_intp)held->width * (bottom - top) + 1;
    const int64_t *whole =
        (const int64_t *)PyArray_DATA((PyArrayObject *)held->offsets) + (npy_intp)held->width * top;
    npy_intp shape[2] = {whole[ends - 1] - whole[0], 3};
    if (shares != Py_None) {
        if (!(reached = array_of(shares, NPY_DOUBLE, 2, "reached"))) goto done;
        if (PyArray_DIM(reached, 0) != shape[0] || PyArray_DIM(reached, 1) != held->lights) {
            PyErr_SetString(PyExc_ValueError,
                            "reached: expected a row a fragment, a column a light");
            goto done;
        }
    }
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)made[0]);
    for (npy_intp p = 0; p < ends; ++p) offsets[p] = whole[p] - whole[0];
    for (int i = 1; i < 4; ++i)
        if (!(made[i] = PyArray_SimpleNew(i == 3 ? 2 : 1, shape, NPY_FLOAT32))) goto done;
    float *results[3];
    for (int i = 0; i < 3; ++i) results[i] = PyArray_DATA((PyArrayObject *)made[i + 1]);
    const double *come = reached ? PyArray_DATA(reached) : NULL;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_draw_strokes(held->raster, top, bottom, come, results[0], results[1],
                                           results[2], &call.run);
    if (end_call(&call, status)) goto done;
    result = PyTuple_Pack(4, made[0], made[1], made[2], made[3]);
done:
    Py_XDECREF(reached);
    for (int i = 0; i < 4; ++i) Py_XDECREF(made[i]);
    return result;
}

static PyMethodDef methods[] = {
    {"begin_strokes", begin_strokes, METH_VARARGS, begin_strokes_doc},
    {"draw_strokes", draw_strokes, METH_VARARGS, draw_strokes_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_strokes(PyObject *module) { return PyModule_AddFunctions(module, methods); }
