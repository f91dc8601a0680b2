/* Volumes on grids to fragments. */
#include "binding.h"

enum { NUMBERS = 6 };

PyDoc_STRVAR(march_grid_doc,
             "march_grid(values, origin, spacing, table, low, high, camera, step, width, height,\n"
             "           top, bottom, threads, /)\n--\n\n"
             "(offsets, numbers): (N, 6) float32 depth, back, alpha, red, green, blue of the\n"
             "fragments of rows [top, bottom) of (X, Y, Z, 1) numbers, of which a table (R, 4) "
             "from low to high says\n"
             "colour and absorbance, or of (X, Y, Z, 4) of these, float32.");

static PyObject *march_grid(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *values, *table, *result = NULL;
    PyArrayObject *made[4] = {NULL}; /* values, table, offsets, numbers */
    moit_grid g = {.channels = 0};
    moit_camera camera = {.lights = {0}};
    double step;
    float *numbers = NULL;
    int width, height, top, bottom, threads;
    if (!PyArg_ParseTuple(args, "O(ddd)(ddd)OddO&diiiii", &values, &g.origin[0], &g.origin[1],
                          &g.origin[2], &g.spacing[0], &g.spacing[1], &g.spacing[2], &table, &g.low,
                          &g.high, camera_of, &camera, &step, &width, &height, &top, &bottom,
                          &threads))
        return NULL;
    if (!is_size(width, height)) return NULL;
    if (top < 0 || top > bottom || bottom > height)
        return PyErr_Format(PyExc_ValueError, "rows %d to %d are not in %d", top, bottom, height);
    if (!(made[0] = array_of(values, NPY_FLOAT, 4, "values"))) goto done;
    if (!(made[1] = array_of(table, NPY_FLOAT, 2, "table"))) goto done;
    bool fit = step > 0.0 && g.low < g.high && PyArray_DIM(made[1], 0) >= 1
               && PyArray_DIM(made[1], 0) < INT32_MAX && PyArray_DIM(made[1], 1) == 4;
    for (int k = 0; k < 3; ++k) {
        fit = fit && g.spacing[k] > 0.0 && PyArray_DIM(made[0], k) >= 2
              && PyArray_DIM(made[0], k) < INT32_MAX;
        g.size[k] = (int)PyArray_DIM(made[0], k);
    }
    g.channels = (int)PyArray_DIM(made[0], 3);
    if (!fit || (g.channels != 1 && g.channels != 4)) {
        PyErr_SetString(PyExc_ValueError, "the numbers of this grid do not fit one another");
        goto done;
    }
    g.values = PyArray_DATA(made[0]);
    g.table = PyArray_DATA(made[1]);
    g.rows = (int)PyArray_DIM(made[1], 0);
    npy_intp ends = (npy_intp)width * (bottom - top) + 1;
    if (!(made[2] = (PyArrayObject *)PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA(made[2]);
    core_call call;
    begin_call(&call, threads);
    moit_status status = moit_march_grid(&g, &camera, step, width, height, top, bottom, offsets,
                                         &numbers, &call.run);
    if (end_call(&call, status)) goto done;
    npy_intp shape[2] = {offsets[ends - 1], NUMBERS};
    if (!(made[3] = (PyArrayObject *)PyArray_SimpleNew(2, shape, NPY_FLOAT32))) goto done;
    memcpy(PyArray_DATA(made[3]), numbers, (size_t)shape[0] * NUMBERS * sizeof *numbers);
    result = PyTuple_Pack(2, made[2], made[3]);
done:
    free(numbers);
    for (int i = 0; i < 4; ++i) Py_XDECREF(made[i]);
    return result;
}

static PyMethodDef methods[] = {
    {"march_grid", march_grid, METH_VARARGS, march_grid_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_grids(PyObject *module) { return PyModule_AddFunctions(module, methods); }
