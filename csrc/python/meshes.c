/* Meshes to fragments. */
#include "binding.h"

static const char *const mesh_arrays[] = {"vertices", "normals", "color", "alpha", "triangles"};

typedef struct {
    moit_mesh mesh;
    PyArrayObject *arrays[5];
} held_mesh;

static void let_mesh_go(held_mesh *held) {
    for (int i = 0; i < 5; ++i) Py_CLEAR(held->arrays[i]);
}

/* From a tuple (vertices, normals or None, color, alpha, triangles) of plain arrays. */
static int hold_mesh(held_mesh *held, PyObject *tuple) {
    static const int types[] = {NPY_FLOAT, NPY_FLOAT, NPY_FLOAT, NPY_FLOAT, NPY_INT32};
    *held = (held_mesh){.mesh = {.vertices = 0}};
    if (!PyTuple_Check(tuple) || PyTuple_GET_SIZE(tuple) != 5) {
        PyErr_SetString(PyExc_TypeError, "mesh: expected a tuple of five");
        return -1;
    }
    for (int i = 0; i < 5; ++i) {
        PyObject *object = PyTuple_GET_ITEM(tuple, i);
        if (i == 1 && object == Py_None) continue;
        held->arrays[i] = array_of(object, types[i], i == 3 ? 1 : 2, mesh_arrays[i]);
        if (!held->arrays[i]) goto failed;
    }
    npy_intp vertices = PyArray_DIM(held->arrays[0], 0),
             triangles = PyArray_DIM(held->arrays[4], 0);
    bool fit = PyArray_DIM(held->arrays[4], 1) == 3 && PyArray_DIM(held->arrays[3], 0) == vertices;
    for (int i = 0; i < 3; ++i)
        fit = fit
              && (!held->arrays[i]
                  || (PyArray_DIM(held->arrays[i], 0) == vertices
                      && PyArray_DIM(held->arrays[i], 1) == 3));
    const int32_t *corners = PyArray_DATA(held->arrays[4]);
    for (npy_intp i = 0; fit && i < 3 * triangles; ++i)
        fit = corners[i] >= 0 && corners[i] < vertices;
    if (!fit) {
        PyErr_SetString(PyExc_ValueError, "the arrays of this mesh do not fit one another");
        goto failed;
    }
    held->mesh = (moit_mesh){
        .vertices = vertices,
        .triangles = triangles,
        .position = PyArray_DATA(held->arrays[0]),
        .normal = held->arrays[1] ? PyArray_DATA(held->arrays[1]) : NULL,
        .color = PyArray_DATA(held->arrays[2]),
        .alpha = PyArray_DATA(held->arrays[3]),
        .corners = corners,
    };
    return 0;
failed:
    let_mesh_go(held);
    return -1;
}

PyDoc_STRVAR(
    rasterize_doc,
    "rasterize(mesh, camera, width, height, threads, lights=(), reached=None, /)\n--\n\n"
    "(offsets, depth, alpha, color) of (vertices, normals or None, color, alpha, triangles)\n"
    "and of (eye, right, up, forward, (scale x, scale y), near, far); lights: rows of where light\n"
    "travels, as the camera sees it, and its colour; reached (N, lights) float64: the share of\n"
    "each light that comes to each fragment; None: all.\n"
    "Nobody else may change the arrays meanwhile.");

/* What is drawn: (mesh, camera, width, height, threads). */
typedef struct {
    held_mesh held;
    moit_camera camera;
    int width, height, threads;
    PyObject *reached; /* borrowed; NULL or None: none */
} view;

/* From rows of (direction, colour); NULL: none. */
static int hold_lights(moit_lights *lights, PyObject *object) {
    *lights = (moit_lights){0};
    if (!object) return 0;
    PyArrayObject *array = array_of(object, NPY_DOUBLE, 2, "lights");
    if (!array) return -1;
    npy_intp count = PyArray_DIM(array, 0);
    if (count > MOIT_MOST_LIGHTS || PyArray_DIM(array, 1) != 6) {
        Py_DECREF(array);
        PyErr_Format(PyExc_ValueError, "lights: expected at most %d rows of 6", MOIT_MOST_LIGHTS);
        return -1;
    }
    lights->count = (int)count;
    const double *number = PyArray_DATA(array);
    for (npy_intp i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) {
            lights->direction[i][k] = number[6 * i + k];
            lights->color[i][k] = number[6 * i + 3 + k];
        }
    Py_DECREF(array);
    return 0;
}

/* 0, or, holding nothing, -1 with an exception. */
static int hold_view(view *v, PyObject *args) {
    PyObject *mesh, *lights = NULL;
    moit_camera *c = &v->camera;
    v->reached = NULL;
    if (!PyArg_ParseTuple(args, "O((ddd)(ddd)(ddd)(ddd)(dd)dd)iii|OO", &mesh, &c->eye[0],
                          &c->eye[1], &c->eye[2], &c->right[0], &c->right[1], &c->right[2],
                          &c->up[0], &c->up[1], &c->up[2], &c->forward[0], &c->forward[1],
                          &c->forward[2], &c->scale[0], &c->scale[1], &c->near, &c->far, &v->width,
                          &v->height, &v->threads, &lights, &v->reached))
        return -1;
    if (hold_lights(&c->lights, lights)) return -1;
    if (v->width < 1 || v->height < 1 || v->width > MOIT_MOST_SIDE || v->height > MOIT_MOST_SIDE
        || !(0.0 < c->near && c->near < c->far) || !(c->scale[0] > 0.0 && c->scale[1] > 0.0)) {
        PyErr_SetString(PyExc_ValueError, "the camera or the size is out of range");
        return -1;
    }
    return hold_mesh(&v->held, mesh);
}

static PyObject *rasterize(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *made[4] = {NULL}, *result = NULL;
    PyArrayObject *reached = NULL;
    view v;
    if (hold_view(&v, args)) return NULL;
    npy_intp ends = (npy_intp)v.width * v.height + 1;
    moit_raster *raster = NULL;
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)made[0]);
    core_call call;
    begin_call(&call, v.threads);
    moit_status status =
        moit_begin_raster(&v.held.mesh, &v.camera, v.width, v.height, offsets, &raster, &call.run);
    if (end_call(&call, status)) goto done;
    npy_intp shape[2] = {offsets[ends - 1], 3};
    if (v.reached && v.reached != Py_None) {
        if (!(reached = array_of(v.reached, NPY_DOUBLE, 2, "reached"))) goto done;
        if (PyArray_DIM(reached, 0) != shape[0]
            || PyArray_DIM(reached, 1) != v.camera.lights.count) {
            PyErr_SetString(PyExc_ValueError, "reached: expected one for each fragment and light");
            goto done;
        }
    }
    for (int i = 1; i < 4; ++i)
        if (!(made[i] = PyArray_SimpleNew(i == 3 ? 2 : 1, shape, NPY_FLOAT32))) goto done;
    float *results[3];
    for (int i = 0; i < 3; ++i) results[i] = PyArray_DATA((PyArrayObject *)made[i + 1]);
    begin_call(&call, v.threads);
    status = moit_draw(raster, reached ? PyArray_DATA(reached) : NULL, results[0], results[1],
                       results[2], &call.run);
    if (end_call(&call, status)) goto done;
    result = PyTuple_Pack(4, made[0], made[1], made[2], made[3]);
done:
    moit_end_raster(raster);
    for (int i = 0; i < 4; ++i) Py_XDECREF(made[i]);
    Py_XDECREF(reached);
    let_mesh_go(&v.held);
    return result;
}

PyDoc_STRVAR(
    screen_triangles_doc,
    "screen_triangles(mesh, camera, width, height, threads, /)\n--\n\n"
    "The triangles that rasterize draws of the same arguments, in their order: (n, size of\n"
    "moit_screen_triangle) bytes.");

static PyObject *screen_triangles(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *made = NULL;
    view v;
    if (hold_view(&v, args)) return NULL;
    moit_raster *raster = NULL;
    core_call call;
    begin_call(&call, v.threads);
    moit_status status =
        moit_begin_raster(&v.held.mesh, &v.camera, v.width, v.height, NULL, &raster, &call.run);
    if (end_call(&call, status)) goto done;
    npy_intp shape[2] = {moit_screen_triangle_count(raster), sizeof(moit_screen_triangle)};
    if (!(made = PyArray_SimpleNew(2, shape, NPY_UINT8))) goto done;
    moit_screen_triangle *out = PyArray_DATA((PyArrayObject *)made);
    begin_call(&call, v.threads);
    status = moit_screen_triangles(raster, out, &call.run);
    if (end_call(&call, status)) Py_CLEAR(made);
done:
    moit_end_raster(raster);
    let_mesh_go(&v.held);
    return made;
}

static PyMethodDef methods[] = {
    {"rasterize", rasterize, METH_VARARGS, rasterize_doc},
    {"screen_triangles", screen_triangles, METH_VARARGS, screen_triangles_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_meshes(PyObject *module) { return PyModule_AddFunctions(module, methods); }
