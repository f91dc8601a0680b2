/* Points and lines to fragments. */
#include "rasters.h"

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

static const char NAME[] = "moit strokes on a screen"; /* detail: how many lights there are */

static void end_strokes(void *raster) { moit_end_strokes(raster); }

static bool is_samples(int samples) {
    if (samples == 1 || samples == MOIT_SAMPLES) return true;
    PyErr_Format(PyExc_ValueError, "samples: expected 1 or %d", MOIT_SAMPLES);
    return false;
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
    if (!is_samples(samples)) return NULL;
    held_strokes strokes;
    if (hold_strokes(&strokes, tuple)) return NULL;
    float range[2];
    held_raster *held;
    moit_stroke_raster *raster = NULL;
    PyObject *result = NULL;
    if (!(capsule = hold_raster(NAME, end_strokes, width, height, &held))) goto done;
    held->detail = camera.lights.count;
    const moit_stroking how = {.solid = solid, .pixels = pixels, .lit = lit, .samples = samples};
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_begin_strokes(&strokes.strokes, &how, &camera, width, height,
                                            offsets_of_raster(held), range, &raster, &call.run);
    held->raster = raster;
    if (end_call(&call, status)) Py_CLEAR(capsule);
    else result = give_raster(capsule, range);
done:
    let_strokes_go(&strokes);
    return result;
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
    const held_raster *held = raster_of(capsule, NAME, "begin_strokes", top, bottom);
    if (!held) return NULL;
    npy_intp shape[2] = {0, 3};
    if (!(made[0] = offsets_of_rows(held, top, bottom, &shape[0]))) goto done;
    if (shares != Py_None) {
        if (!(reached = array_of(shares, NPY_DOUBLE, 2, "reached"))) goto done;
        if (PyArray_DIM(reached, 0) != shape[0] || PyArray_DIM(reached, 1) != held->detail) {
            PyErr_SetString(PyExc_ValueError,
                            "reached: expected a row a fragment, a column a light");
            goto done;
        }
    }
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

PyDoc_STRVAR(screen_strokes_doc,
             "screen_strokes(strokes, how, camera, width, height, /)\n--\n\n"
             "Parts of strokes that are seen, of begin_strokes' arguments: (N * size of\n"
             "moit_screen_stroke,) bytes.");

static PyObject *screen_strokes(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *tuple, *array = NULL;
    moit_camera camera = {.lights = {0}};
    int solid, pixels, lit, samples, width, height;
    if (!PyArg_ParseTuple(args, "O(pppi)O&ii", &tuple, &solid, &pixels, &lit, &samples, camera_of,
                          &camera, &width, &height))
        return NULL;
    if (!is_size(width, height) || !is_samples(samples)) return NULL;
    held_strokes strokes;
    if (hold_strokes(&strokes, tuple)) return NULL;
    const moit_stroking how = {.solid = solid, .pixels = pixels, .lit = lit, .samples = samples};
    moit_screen_stroke *parts;
    int64_t count;
    core_call call;
    begin_call(&call, 1);
    moit_status status =
        moit_find_screen_strokes(&strokes.strokes, &how, &camera, width, height, &parts, &count);
    if (end_call(&call, status)) goto done;
    npy_intp bytes = count * (npy_intp)sizeof *parts;
    if ((array = PyArray_SimpleNew(1, &bytes, NPY_UINT8)) && bytes)
        memcpy(PyArray_DATA((PyArrayObject *)array), parts, (size_t)bytes);
done:
    free(parts);
    let_strokes_go(&strokes);
    return array;
}

static PyMethodDef methods[] = {
    {"screen_strokes", screen_strokes, METH_VARARGS, screen_strokes_doc},
    {"begin_strokes", begin_strokes, METH_VARARGS, begin_strokes_doc},
    {"draw_strokes", draw_strokes, METH_VARARGS, draw_strokes_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_strokes(PyObject *module) { return PyModule_AddFunctions(module, methods); }
