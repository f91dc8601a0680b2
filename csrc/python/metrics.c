/* Errors of images. */
#include "binding.h"

static const struct {
    const char *name;
    moit_image_error *error;
} metrics[] = {
    {"mse", moit_mse},   {"rmse", moit_rmse}, {"mae", moit_mae},           {"psnr", moit_psnr},
    {"ssim", moit_ssim}, {"flip", moit_flip}, {"hdr_flip", moit_hdr_flip},
};

static moit_image_error *metric_named(const char *name) {
    for (size_t i = 0; i < sizeof metrics / sizeof *metrics; ++i)
        if (!strcmp(metrics[i].name, name)) return metrics[i].error;
    PyErr_Format(PyExc_ValueError, "no metric is called %s", name);
    return NULL;
}

static moit_image image_in(PyArrayObject *array) {
    return (moit_image){
        .pixels = PyArray_DATA(array),
        .height = PyArray_DIM(array, 0),
        .width = PyArray_DIM(array, 1),
        .channels = (int)PyArray_DIM(array, 2),
        .precision = PyArray_TYPE(array) == NPY_FLOAT32 ? MOIT_FLOAT32 : MOIT_FLOAT64,
    };
}

static bool is_image(PyArrayObject *array) {
    npy_intp channels = PyArray_DIM(array, 2);
    return PyArray_DIM(array, 0) >= MOIT_LEAST_SIDE && PyArray_DIM(array, 1) >= MOIT_LEAST_SIDE
           && (channels == 3 || channels == 4);
}

static PyObject *image_error(PyObject *Py_UNUSED(module), PyObject *arguments) {
    const char *name;
    PyObject *objects[2], *result = NULL;
    PyArrayObject *arrays[2] = {NULL, NULL}, *map = NULL;
    int wants_map, threads;
    if (!PyArg_ParseTuple(arguments, "sOOpi", &name, &objects[0], &objects[1], &wants_map,
                          &threads))
        return NULL;
    moit_image_error *metric = metric_named(name);
    if (!metric) return NULL;
    bool single =
        PyArray_Check(objects[0]) && PyArray_TYPE((PyArrayObject *)objects[0]) == NPY_FLOAT32;
    const int type = single ? NPY_FLOAT32 : NPY_FLOAT64;
    if (!(arrays[0] = array_of(objects[0], type, 3, "image"))) goto done;
    if (!(arrays[1] = array_of(objects[1], type, 3, "reference"))) goto done;
    if (!is_image(arrays[0]) || !is_image(arrays[1])
        || PyArray_DIM(arrays[0], 0) != PyArray_DIM(arrays[1], 0)
        || PyArray_DIM(arrays[0], 1) != PyArray_DIM(arrays[1], 1)) {
        PyErr_Format(PyExc_ValueError,
                     "image and reference must be of one size, at least %d pixels a side, with 3 "
                     "or 4 channels",
                     MOIT_LEAST_SIDE);
        goto done;
    }
    if (wants_map && !(map = (PyArrayObject *)PyArray_SimpleNew(2, PyArray_DIMS(arrays[0]), type)))
        goto done;

    const moit_image image = image_in(arrays[0]), reference = image_in(arrays[1]);
    void *to = map ? PyArray_DATA(map) : NULL;
    double error = 0.0;
    core_call call;
    begin_call(&call, threads);
    moit_status status = metric(&image, &reference, to, &error, &call.run);
    if (end_call(&call, status)) goto done;
    result = map ? Py_NewRef((PyObject *)map) : PyFloat_FromDouble(error);

done:
    Py_XDECREF(arrays[0]);
    Py_XDECREF(arrays[1]);
    Py_XDECREF(map);
    return result;
}

static PyMethodDef methods[] = {
    {"image_error", image_error, METH_VARARGS,
     "image_error(metric, image, reference, wants_map, threads, /)\n--\n\n"
     "The error of two images by the named metric, or its map."},
    {NULL, NULL, 0, NULL},
};

int moit_add_metrics(PyObject *module) { return PyModule_AddFunctions(module, methods); }
