/* Splats to fragments. */
#include "rasters.h"

#include "moit_gradients.h"

enum { SPLAT_ARRAYS = 5 };

typedef struct {
    moit_splats splats;
    PyArrayObject *arrays[SPLAT_ARRAYS];
} held_splats;

static void let_splats_go(held_splats *held) {
    for (int i = 0; i < SPLAT_ARRAYS; ++i) Py_CLEAR(held->arrays[i]);
}

/* From a tuple (means, scales, rotations, opacities, harmonics); 0, or, holding nothing, -1 with an
 * exception. */
static int hold_splats(held_splats *held, PyObject *tuple) {
    static const char *const names[SPLAT_ARRAYS] = {"means", "scales", "rotations", "opacities",
                                                    "harmonics"};
    static const int ndims[SPLAT_ARRAYS] = {2, 2, 2, 1, 3};
    static const npy_intp columns[SPLAT_ARRAYS] = {3, 3, 4, 0, 0};
    *held = (held_splats){.splats = {.count = 0}};
    if (!PyTuple_Check(tuple) || PyTuple_GET_SIZE(tuple) != SPLAT_ARRAYS) {
        PyErr_SetString(PyExc_TypeError, "splats: expected a tuple of five");
        return -1;
    }
    bool fit = true;
    for (int i = 0; i < SPLAT_ARRAYS; ++i) {
        held->arrays[i] = array_of(PyTuple_GET_ITEM(tuple, i), NPY_FLOAT, ndims[i], names[i]);
        if (!held->arrays[i]) goto failed;
        fit = fit && PyArray_DIM(held->arrays[i], 0) == PyArray_DIM(held->arrays[0], 0)
              && (!columns[i] || PyArray_DIM(held->arrays[i], 1) == columns[i]);
    }
    int degree = 0;
    npy_intp harmonics = PyArray_DIM(held->arrays[4], 1);
    while (degree < MOIT_MOST_DEGREE && (degree + 1) * (degree + 1) < harmonics) ++degree;
    fit = fit && (degree + 1) * (degree + 1) == harmonics && PyArray_DIM(held->arrays[4], 2) == 3
          && PyArray_DIM(held->arrays[0], 0) < INT32_MAX;
    if (!fit) {
        PyErr_SetString(PyExc_ValueError, "the arrays of these splats do not fit one another");
        goto failed;
    }
    held->splats = (moit_splats){.count = PyArray_DIM(held->arrays[0], 0),
                                 .mean = PyArray_DATA(held->arrays[0]),
                                 .scale = PyArray_DATA(held->arrays[1]),
                                 .rotation = PyArray_DATA(held->arrays[2]),
                                 .opacity = PyArray_DATA(held->arrays[3]),
                                 .harmonics = PyArray_DATA(held->arrays[4]),
                                 .degree = degree};
    return 0;
failed:
    let_splats_go(held);
    return -1;
}

static bool is_splatting(int number) {
    if ((number >= MOIT_PROJECTED && number <= MOIT_ALL_PROJECTED) || number == MOIT_FILTERED
        || number == MOIT_ALL_FILTERED)
        return true;
    PyErr_SetString(PyExc_ValueError, "splatting: expected a number of moit_splatting");
    return false;
}

/* ---- Rasters --------------------------------------------------------------------------------- */

static const char NAME[] = "moit splats on a screen"; /* detail: they are along rays */

static void end_splats(void *raster) { moit_end_splats(raster); }

PyDoc_STRVAR(begin_splats_doc,
             "begin_splats(splats, splatting, camera, width, height, threads, /)\n--\n\n"
             "(raster, offsets, nearest, farthest): what `draw_splats` draws, how many fragments\n"
             "the pixels have, and how far away these are (none: inf, -inf), of (means, scales,\n"
             "rotations, opacities, harmonics): (N, 3), (N, 3), (N, 4), (N,) and (N, 1, 4, 9 or\n"
             "16, 3) float32; camera as rasterize has it. Nobody else may change the arrays\n"
             "meanwhile.");

static PyObject *begin_splats(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *tuple, *capsule = NULL;
    moit_camera camera = {.lights = {0}};
    int splatting, width, height, threads;
    if (!PyArg_ParseTuple(args, "OiO&iii", &tuple, &splatting, camera_of, &camera, &width, &height,
                          &threads))
        return NULL;
    if (!is_size(width, height) || !is_splatting(splatting)) return NULL;
    held_splats splats;
    if (hold_splats(&splats, tuple)) return NULL;
    float range[2];
    held_raster *held;
    moit_splat_raster *raster = NULL;
    PyObject *result = NULL;
    if (!(capsule = hold_raster(NAME, end_splats, width, height, &held))) goto done;
    held->detail = splatting == MOIT_ALONG_RAYS;
    held->count = (npy_intp)splats.splats.count;
    core_call call;
    begin_call(&call, threads);
    moit_status status =
        moit_begin_splats(&splats.splats, (moit_splatting)splatting, &camera, width, height,
                          offsets_of_raster(held), range, &raster, &call.run);
    held->raster = raster;
    if (end_call(&call, status)) Py_CLEAR(capsule);
    else result = give_raster(capsule, range);
done:
    let_splats_go(&splats);
    return result;
}

PyDoc_STRVAR(
    draw_splats_doc,
    "draw_splats(raster, top, bottom, thick, threads, /)\n--\n\n"
    "(offsets, depth, alpha, color) of rows [top, bottom) of what begin_splats gave along\n"
    "rays or not; of the former, if they are to be thick, the deviations too.");

static PyObject *draw_splats(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *capsule, *made[5] = {NULL}, *result = NULL;
    int top, bottom, thick, threads;
    if (!PyArg_ParseTuple(args, "Oiipi", &capsule, &top, &bottom, &thick, &threads)) return NULL;
    const held_raster *held = raster_of(capsule, NAME, "begin_splats", top, bottom);
    if (!held) return NULL;
    if (thick && !held->detail) {
        PyErr_SetString(PyExc_ValueError, "only splats along rays are thick");
        return NULL;
    }
    npy_intp shape[2] = {0, 3};
    if (!(made[0] = offsets_of_rows(held, top, bottom, &shape[0]))) goto done;
    float *results[4] = {NULL};
    for (int i = 1; i < (thick ? 5 : 4); ++i)
        if (!(made[i] = PyArray_SimpleNew(i == 3 ? 2 : 1, shape, NPY_FLOAT32))) goto done;
    for (int i = 0; i < (thick ? 4 : 3); ++i)
        results[i] = PyArray_DATA((PyArrayObject *)made[i + 1]);
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_draw_splats(held->raster, top, bottom, results[0], results[1],
                                          results[2], results[3], &call.run);
    if (end_call(&call, status)) goto done;
    result = PyTuple_Pack(thick ? 5 : 4, made[0], made[1], made[2], made[3], made[4]);
done:
    for (int i = 0; i < 5; ++i) Py_XDECREF(made[i]);
    return result;
}

/* ---- Derivatives ----------------------------------------------------------------------------- */

enum { SUMS = sizeof(moit_splat_sums) / sizeof(double) };

/* What derivatives are added to, or NULL with an exception; of None zeros, if that may be. */
static PyArrayObject *sums_of(const held_raster *held, PyObject *given, bool writes) {
    npy_intp shape[2] = {held->count, SUMS};
    if (writes && given == Py_None) return (PyArrayObject *)PyArray_ZEROS(2, shape, NPY_DOUBLE, 0);
    PyArrayObject *sums = array_of(given, NPY_DOUBLE, 2, "sums");
    if (!sums) return NULL;
    bool fits = PyArray_CompareLists(PyArray_DIMS(sums), shape, 2)
                && (!writes || ((PyObject *)sums == given && PyArray_ISWRITEABLE(sums)));
    if (fits) return sums;
    Py_DECREF(sums);
    PyErr_SetString(PyExc_ValueError,
                    "sums: expected what pull_splat_fragments gave of the raster");
    return NULL;
}

PyDoc_STRVAR(
    pull_splat_fragments_doc,
    "pull_splat_fragments(raster, top, bottom, depth, alpha, color, sums, threads, /)\n"
    "--\n\n"
    "sums, (count, 18) float64 or None for zeros, with what a loss changes by with splats\n"
    "on the screen, from what it changes by with what draw_splats gives of these rows.");

static PyObject *pull_splat_fragments(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *capsule, *given[3], *sums_in, *result = NULL;
    PyArrayObject *by[3] = {NULL}, *sums = NULL;
    int top, bottom, threads;
    if (!PyArg_ParseTuple(args, "OiiOOOOi", &capsule, &top, &bottom, &given[0], &given[1],
                          &given[2], &sums_in, &threads))
        return NULL;
    const held_raster *held = raster_of(capsule, NAME, "begin_splats", top, bottom);
    if (!held) return NULL;
    const int64_t *offsets = offsets_of_raster(held);
    npy_intp n =
        (npy_intp)(offsets[(npy_intp)held->width * bottom] - offsets[(npy_intp)held->width * top]);
    static const char *const names[3] = {"depth", "alpha", "color"};
    for (int i = 0; i < 3; ++i) {
        if (!(by[i] = array_of(given[i], NPY_FLOAT, i < 2 ? 1 : 2, names[i]))) goto done;
        if (PyArray_DIM(by[i], 0) != n || (i == 2 && PyArray_DIM(by[i], 1) != 3)) {
            PyErr_Format(PyExc_ValueError, "%s: expected one a fragment of these rows", names[i]);
            goto done;
        }
    }
    if (!(sums = sums_of(held, sums_in, true))) goto done;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_pull_splat_fragments(held->raster, top, bottom, PyArray_DATA(by[0]),
                                                   PyArray_DATA(by[1]), PyArray_DATA(by[2]),
                                                   PyArray_DATA(sums), &call.run);
    if (!end_call(&call, status)) result = Py_NewRef(sums);
done:
    for (int i = 0; i < 3; ++i) Py_XDECREF(by[i]);
    Py_XDECREF(sums);
    return result;
}

PyDoc_STRVAR(pull_splat_projection_doc,
             "pull_splat_projection(raster, splats, sums, threads, /)\n--\n\n"
             "The derivatives by the arrays of the splats that the raster was begun with, of\n"
             "their shapes.");

static PyObject *pull_splat_projection(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *capsule, *tuple, *sums_in, *made[SPLAT_ARRAYS] = {NULL}, *result = NULL;
    PyArrayObject *sums = NULL;
    int threads;
    if (!PyArg_ParseTuple(args, "OOOi", &capsule, &tuple, &sums_in, &threads)) return NULL;
    const held_raster *held = whole_raster_of(capsule, NAME, "begin_splats");
    held_splats splats;
    if (!held || hold_splats(&splats, tuple)) return NULL;
    if (splats.splats.count != held->count) {
        PyErr_SetString(PyExc_ValueError, "splats: expected those of the raster");
        goto done;
    }
    if (!(sums = sums_of(held, sums_in, false))) goto done;
    float *out[SPLAT_ARRAYS];
    for (int i = 0; i < SPLAT_ARRAYS; ++i) {
        made[i] = PyArray_SimpleNew(PyArray_NDIM(splats.arrays[i]), PyArray_DIMS(splats.arrays[i]),
                                    NPY_FLOAT);
        if (!made[i]) goto done;
        out[i] = PyArray_DATA((PyArrayObject *)made[i]);
    }
    const moit_splat_gradients by = {out[0], out[1], out[2], out[3], out[4]};
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_pull_splat_projection(held->raster, &splats.splats,
                                                    PyArray_DATA(sums), &by, &call.run);
    if (!end_call(&call, status))
        result = PyTuple_Pack(SPLAT_ARRAYS, made[0], made[1], made[2], made[3], made[4]);
done:
    for (int i = 0; i < SPLAT_ARRAYS; ++i) Py_XDECREF(made[i]);
    Py_XDECREF(sums);
    let_splats_go(&splats);
    return result;
}

/* ---- For devices ----------------------------------------------------------------------------- */

/* A new one-dimensional array of so many numbers. */
static PyObject *copied(const void *numbers, npy_intp count, int type) {
    PyObject *array = PyArray_SimpleNew(1, &count, type);
    if (array && count)
        memcpy(PyArray_DATA((PyArrayObject *)array), numbers,
               (size_t)count * (size_t)PyArray_ITEMSIZE((PyArrayObject *)array));
    return array;
}

PyDoc_STRVAR(screen_splats_doc,
             "screen_splats(splats, splatting, camera, width, height, threads, /)\n--\n\n"
             "(records, first, front_to_back) of begin_splats' arguments: (N * size of\n"
             "moit_screen_splat,) bytes; and of MOIT_PROJECTED ones those of each\n"
             "tile: of tile t front_to_back[first[t]] to front_to_back[first[t + 1]]; else None.");

static PyObject *screen_splats(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *tuple, *made[3] = {NULL}, *result = NULL;
    moit_camera camera = {.lights = {0}};
    int splatting, width, height, threads;
    if (!PyArg_ParseTuple(args, "OiO&iii", &tuple, &splatting, camera_of, &camera, &width, &height,
                          &threads))
        return NULL;
    if (!is_size(width, height) || !is_splatting(splatting)) return NULL;
    held_splats splats;
    if (hold_splats(&splats, tuple)) return NULL;
    moit_screen_splats found;
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_find_screen_splats(&splats.splats, (moit_splatting)splatting, &camera,
                                                 width, height, &found, &call.run);
    if (end_call(&call, status)) goto done;
    npy_intp size = sizeof *found.splats;
    made[0] = copied(found.splats, found.count * size, NPY_UINT8);
    made[1] = copied(found.first, found.tiles + 1, NPY_INT64);
    if (found.front_to_back)
        made[2] = copied(found.front_to_back, found.first[found.tiles], NPY_INT32);
    else made[2] = Py_NewRef(Py_None);
    if (made[0] && made[1] && made[2]) result = PyTuple_Pack(3, made[0], made[1], made[2]);
done:
    for (int i = 0; i < 3; ++i) Py_XDECREF(made[i]);
    moit_let_go_of_screen_splats(&found);
    let_splats_go(&splats);
    return result;
}

static PyMethodDef methods[] = {
    {"screen_splats", screen_splats, METH_VARARGS, screen_splats_doc},
    {"begin_splats", begin_splats, METH_VARARGS, begin_splats_doc},
    {"draw_splats", draw_splats, METH_VARARGS, draw_splats_doc},
    {"pull_splat_fragments", pull_splat_fragments, METH_VARARGS, pull_splat_fragments_doc},
    {"pull_splat_projection", pull_splat_projection, METH_VARARGS, pull_splat_projection_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_splats(PyObject *module) { return PyModule_AddFunctions(module, methods); }
