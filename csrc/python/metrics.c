/* Errors of images. */
#include "binding.h"

#include "moit_errors.h"

static const struct {
    const char *name;
    moit_image_error *error;
} metrics[MOIT_METRICS] = {
    {"mse", moit_mse},   {"rmse", moit_rmse}, {"mae", moit_mae},           {"psnr", moit_psnr},
    {"ssim", moit_ssim}, {"flip", moit_flip}, {"hdr_flip", moit_hdr_flip},
};

/* In the order of moit_metric; -1 with an exception where there is none. */
static int metric_named(const char *name) {
    for (int i = 0; i < MOIT_METRICS; ++i)
        if (!strcmp(metrics[i].name, name)) return i;
    PyErr_Format(PyExc_ValueError, "no metric is called %s", name);
    return -1;
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

/* Otherwise with an exception. */
static bool are_comparable(PyArrayObject *image, PyArrayObject *reference) {
    if (is_image(image) && is_image(reference) && PyArray_DIM(image, 0) == PyArray_DIM(reference, 0)
        && PyArray_DIM(image, 1) == PyArray_DIM(reference, 1))
        return true;
    PyErr_Format(PyExc_ValueError,
                 "image and reference must be of one size, at least %d pixels a side, with 3 or 4 "
                 "channels",
                 MOIT_LEAST_SIDE);
    return false;
}

static PyObject *image_error(PyObject *Py_UNUSED(module), PyObject *arguments) {
    const char *name;
    PyObject *objects[2], *result = NULL;
    PyArrayObject *arrays[2] = {NULL, NULL}, *map = NULL;
    int wants_map, threads;
    if (!PyArg_ParseTuple(arguments, "sOOpi", &name, &objects[0], &objects[1], &wants_map,
                          &threads))
        return NULL;
    const int metric = metric_named(name);
    if (metric < 0) return NULL;
    bool single =
        PyArray_Check(objects[0]) && PyArray_TYPE((PyArrayObject *)objects[0]) == NPY_FLOAT32;
    const int type = single ? NPY_FLOAT32 : NPY_FLOAT64;
    if (!(arrays[0] = array_of(objects[0], type, 3, "image"))) goto done;
    if (!(arrays[1] = array_of(objects[1], type, 3, "reference"))) goto done;
    if (!are_comparable(arrays[0], arrays[1])) goto done;
    if (wants_map && !(map = (PyArrayObject *)PyArray_SimpleNew(2, PyArray_DIMS(arrays[0]), type)))
        goto done;

    const moit_image image = image_in(arrays[0]), reference = image_in(arrays[1]);
    void *to = map ? PyArray_DATA(map) : NULL;
    double error = 0.0;
    core_call call;
    begin_call(&call, threads);
    moit_status status = metrics[metric].error(&image, &reference, to, &error, &call.run);
    if (end_call(&call, status)) goto done;
    result = map ? Py_NewRef((PyObject *)map) : PyFloat_FromDouble(error);

done:
    Py_XDECREF(arrays[0]);
    Py_XDECREF(arrays[1]);
    Py_XDECREF(map);
    return result;
}

/* A reference with the array that it looks at; callers wait for one another. */
typedef struct {
    moit_reference *reference;
    PyArrayObject *array;
    PyThread_type_lock lock;
} held_reference;

static const char reference_name[] = "moit.reference";

static void let_reference_go(PyObject *capsule) {
    held_reference *held = PyCapsule_GetPointer(capsule, reference_name);
    moit_free_reference(held->reference);
    if (held->lock) PyThread_free_lock(held->lock);
    Py_XDECREF(held->array);
    PyMem_Free(held);
}

static PyObject *reference_of(PyObject *Py_UNUSED(module), PyObject *arguments) {
    PyObject *object;
    long long most_bytes;
    if (!PyArg_ParseTuple(arguments, "OL", &object, &most_bytes)) return NULL;
    held_reference *held = PyMem_Calloc(1, sizeof *held);
    if (!held) return PyErr_NoMemory();
    PyObject *capsule = PyCapsule_New(held, reference_name, let_reference_go);
    if (!capsule) {
        PyMem_Free(held);
        return NULL;
    }
    if (!(held->array = array_of(object, number_type_of(object), 3, "reference"))) goto failed;
    if (!are_comparable(held->array, held->array)) goto failed;
    const moit_image image = image_in(held->array);
    held->reference = moit_reference_of(&image, most_bytes > 0 ? most_bytes : 0);
    held->lock = PyThread_allocate_lock();
    if (held->reference && held->lock) return capsule;
    PyErr_NoMemory();
failed:
    Py_DECREF(capsule);
    return NULL;
}

static PyObject *image_errors(PyObject *Py_UNUSED(module), PyObject *arguments) {
    PyObject *names, *object, *capsule, *found = NULL;
    int threads;
    if (!PyArg_ParseTuple(arguments, "O!OOi", &PyTuple_Type, &names, &object, &capsule, &threads))
        return NULL;
    held_reference *held = PyCapsule_GetPointer(capsule, reference_name);
    if (!held) return NULL;
    const Py_ssize_t count = PyTuple_GET_SIZE(names);
    bool wanted[MOIT_METRICS] = {false};
    for (Py_ssize_t i = 0; i < count; ++i) {
        const char *name = PyUnicode_AsUTF8(PyTuple_GET_ITEM(names, i));
        const int metric = name ? metric_named(name) : -1;
        if (metric < 0) return NULL;
        wanted[metric] = true;
    }
    PyArrayObject *array = array_of(object, number_type_of(object), 3, "image");
    if (!array) return NULL;
    if (!are_comparable(array, held->array)) goto done;

    const moit_image image = image_in(array);
    double errors[MOIT_METRICS] = {0};
    core_call call;
    begin_call(&call, threads);
    PyThread_acquire_lock(held->lock, WAIT_LOCK);
    moit_status status = moit_errors(&image, held->reference, wanted, errors, &call.run);
    PyThread_release_lock(held->lock);
    if (end_call(&call, status) || !(found = PyTuple_New(count))) goto done;
    for (Py_ssize_t i = 0; i < count; ++i) {
        const int metric = metric_named(PyUnicode_AsUTF8(PyTuple_GET_ITEM(names, i)));
        PyObject *error = PyFloat_FromDouble(errors[metric]);
        if (!error) {
            Py_CLEAR(found);
            break;
        }
        PyTuple_SET_ITEM(found, i, error);
    }

done:
    Py_DECREF(array);
    return found;
}

static PyMethodDef methods[] = {
    {"reference_of", reference_of, METH_VARARGS,
     "reference_of(reference, most_bytes, /)\n--\n\n"
     "What image_errors compares with; keeps at most so much of what it finds out."},
    {"image_errors", image_errors, METH_VARARGS,
     "image_errors(metrics, image, reference_of, threads, /)\n--\n\n"
     "The errors of an image by the named metrics."},
    {"image_error", image_error, METH_VARARGS,
     "image_error(metric, image, reference, wants_map, threads, /)\n--\n\n"
     "The error of two images by the named metric, or its map."},
    {NULL, NULL, 0, NULL},
};

int moit_add_metrics(PyObject *module) { return PyModule_AddFunctions(module, methods); }
