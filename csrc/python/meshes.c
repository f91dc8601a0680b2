/* Meshes to fragments. */
#include "binding.h"

enum { PLAIN_ARRAYS = 5, MESH_ARRAYS = 8, MESH_PARTS = 9 };
static const char *const mesh_arrays[MESH_ARRAYS] = {
    "vertices", "normals", "color", "alpha", "triangles", "uv", "material_of", "materials"};

typedef struct {
    moit_mesh mesh;
    PyArrayObject *arrays[MESH_ARRAYS];
    moit_material *materials;
    PyArrayObject **texels; /* of each material, then NULL */
} held_mesh;

static void let_mesh_go(held_mesh *held) {
    for (int i = 0; i < MESH_ARRAYS; ++i) Py_CLEAR(held->arrays[i]);
    for (int i = 0; held->texels && held->texels[i]; ++i) Py_DECREF(held->texels[i]);
    PyMem_Free(held->texels);
    PyMem_Free(held->materials);
    held->texels = NULL;
    held->materials = NULL;
}

static bool is_whole(double number, double least, double most) {
    return number >= least && number <= most && number == (double)(int64_t)number;
}

/* From a row of numbers, in the order of moit_material; whether they say something that can be. */
static bool read_material(const double *row, moit_material *out) {
    bool fits = is_whole(row[0], 0.0, INT32_MAX) && is_whole(row[1], 1.0, MOIT_MOST_SIDE)
                && is_whole(row[2], 1.0, MOIT_MOST_SIDE) && is_whole(row[3], 0.0, FILTER_MIPMAP)
                && is_whole(row[4], 0.0, WRAP_CLAMP) && is_whole(row[5], 0.0, WRAP_CLAMP);
    if (!fits) return false;
    *out = (moit_material){
        .first = (int32_t)row[0],
        .width = (int)row[1],
        .height = (int)row[2],
        .filtering = (int)row[3],
        .wrap_u = (int)row[4],
        .wrap_v = (int)row[5],
        .transparent = row[6] != 0.0,
        .masked = row[7] != 0.0,
        .cutoff = (float)row[8],
        .lit = row[9] != 0.0,
        .painted = row[10] != 0.0,
        .listed = row[11] != 0.0,
    };
    return true;
}

static bool hold_texels(moit_material *material, PyObject *object, PyArrayObject **held) {
    if (!(*held = array_of(object, NPY_FLOAT, 2, "texels"))) return false;
    int64_t needed = material->filtering == FILTER_MIPMAP
                         ? moit_level_texels(material->width, material->height)
                         : (int64_t)material->width * material->height;
    material->texels = PyArray_DATA(*held);
    if (PyArray_DIM(*held, 0) >= needed && PyArray_DIM(*held, 1) == 4) return true;
    PyErr_SetString(PyExc_ValueError, "texels: expected (N, 4) of all levels of an image");
    return false;
}

/* What follows the plain arrays; those of its parts that are arrays are held already. images: a
 * tuple of texels, one for each material; with `unread` none is asked for. */
static int hold_materials(held_mesh *held, PyObject *images, bool unread) {
    moit_mesh *m = &held->mesh;
    PyArrayObject *const *a = held->arrays;
    npy_intp count = PyArray_DIM(a[7], 0);
    bool fit = PyArray_DIM(a[5], 0) == m->vertices && PyArray_DIM(a[5], 1) == 2
               && PyArray_DIM(a[6], 0) == m->triangles && PyArray_DIM(a[7], 1) == 12
               && (unread || (PyTuple_Check(images) && PyTuple_GET_SIZE(images) == count));
    const int32_t *which = PyArray_DATA(a[6]);
    for (npy_intp i = 0; fit && i < m->triangles; ++i) fit = which[i] >= -1 && which[i] < count;
    held->materials = PyMem_New(moit_material, (size_t)count + 1);
    held->texels = PyMem_Calloc((size_t)count + 1, sizeof *held->texels);
    if (!held->materials || !held->texels) {
        PyErr_NoMemory();
        return -1;
    }
    const double *rows = PyArray_DATA(a[7]);
    for (npy_intp i = 0; fit && i < count; ++i) {
        fit = read_material(rows + 12 * i, &held->materials[i]);
        if (fit && !unread
            && !hold_texels(&held->materials[i], PyTuple_GET_ITEM(images, i), &held->texels[i]))
            return -1;
    }
    m->uv = PyArray_DATA(a[5]);
    m->material_of = which;
    m->materials = held->materials;
    if (fit) return 0;
    PyErr_SetString(PyExc_ValueError, "the materials of this mesh do not fit it");
    return -1;
}

/* From a tuple (vertices, normals or None, color, alpha, triangles) of plain arrays, and of
 * (uv, material_of, materials, texels) where there are textures. */
static int hold_mesh(held_mesh *held, PyObject *tuple, bool unread) {
    static const int types[] = {NPY_FLOAT, NPY_FLOAT, NPY_FLOAT, NPY_FLOAT,
                                NPY_INT32, NPY_FLOAT, NPY_INT32, NPY_DOUBLE};
    *held = (held_mesh){.mesh = {.vertices = 0}};
    Py_ssize_t given = PyTuple_Check(tuple) ? PyTuple_GET_SIZE(tuple) : 0;
    if (given != PLAIN_ARRAYS && given != MESH_PARTS) {
        PyErr_SetString(PyExc_TypeError, "mesh: expected a tuple of five or nine");
        return -1;
    }
    for (int i = 0; i < given && i < MESH_ARRAYS; ++i) {
        PyObject *object = PyTuple_GET_ITEM(tuple, i);
        if (i == 1 && object == Py_None) continue;
        held->arrays[i] = array_of(object, types[i], i == 3 || i == 6 ? 1 : 2, mesh_arrays[i]);
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
    if (given == MESH_PARTS && hold_materials(held, PyTuple_GET_ITEM(tuple, 8), unread))
        goto failed;
    return 0;
failed:
    let_mesh_go(held);
    return -1;
}

PyDoc_STRVAR(
    rasterize_doc,
    "rasterize(mesh, camera, width, height, threads, lights=(), reached=None, by_area=False, /)\n"
    "--\n\n"
    "(offsets, depth, alpha, color) of (vertices, normals or None, color, alpha, triangles),\n"
    "where there are textures and (uv, material_of, materials, texels), materials rows of\n"
    "moit_material, texels a tuple of arrays; and of (eye, right, up, forward, (scale x, scale y), "
    "near, far); lights: rows "
    "of where light\n"
    "travels, as the camera sees it, and its colour; reached (N, lights) float64: the share of\n"
    "each light that comes to each fragment; None: all. by_area: alpha counts by the share of\n"
    "the pixel that is covered.\n"
    "Nobody else may change the arrays meanwhile.");

/* What is drawn: (mesh, camera, width, height, threads). */
typedef struct {
    held_mesh held;
    moit_camera camera;
    int width, height, threads;
    PyObject *reached; /* borrowed; NULL or None: none */
    int by_area;
} view;

int hold_lights(moit_lights *lights, PyObject *object) {
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

int camera_of(PyObject *object, void *camera) {
    moit_camera *c = camera;
    if (!PyTuple_Check(object)) {
        PyErr_SetString(PyExc_TypeError, "camera: expected a tuple");
        return 0;
    }
    if (!PyArg_ParseTuple(object, "(ddd)(ddd)(ddd)(ddd)(dd)dd", &c->eye[0], &c->eye[1], &c->eye[2],
                          &c->right[0], &c->right[1], &c->right[2], &c->up[0], &c->up[1], &c->up[2],
                          &c->forward[0], &c->forward[1], &c->forward[2], &c->scale[0],
                          &c->scale[1], &c->near, &c->far))
        return 0;
    if (0.0 < c->near && c->near < c->far && c->scale[0] > 0.0 && c->scale[1] > 0.0) return 1;
    PyErr_SetString(PyExc_ValueError, "the camera is out of range");
    return 0;
}

bool is_size(int width, int height) {
    if (width >= 1 && height >= 1 && width <= MOIT_MOST_SIDE && height <= MOIT_MOST_SIDE)
        return true;
    PyErr_SetString(PyExc_ValueError, "the size is out of range");
    return false;
}

/* 0, or, holding nothing, -1 with an exception. */
static int hold_view(view *v, PyObject *args, bool unread) {
    PyObject *mesh, *lights = NULL;
    moit_camera *c = &v->camera;
    v->reached = NULL;
    v->by_area = 0;
    if (!PyArg_ParseTuple(args, "OO&iii|OOp", &mesh, camera_of, c, &v->width, &v->height,
                          &v->threads, &lights, &v->reached, &v->by_area))
        return -1;
    if (hold_lights(&c->lights, lights)) return -1;
    if (!is_size(v->width, v->height)) return -1;
    return hold_mesh(&v->held, mesh, unread);
}

/* What `reached` has of so many fragments; NULL: all, or with an exception. */
static PyArrayObject *reached_of(const view *v, npy_intp fragments) {
    if (!v->reached || v->reached == Py_None) return NULL;
    PyArrayObject *reached = array_of(v->reached, NPY_DOUBLE, 2, "reached");
    if (!reached) return NULL;
    if (PyArray_DIM(reached, 0) == fragments && PyArray_DIM(reached, 1) == v->camera.lights.count)
        return reached;
    PyErr_SetString(PyExc_ValueError, "reached: expected one for each fragment and light");
    Py_DECREF(reached);
    return NULL;
}

/* Parts of pixels, and the fragments that they are joined to. */
typedef struct {
    int64_t count, fragments;
    double *share, *reached;
    int32_t *source;
    int64_t *which;
} parts_of_pixels;

static void let_parts_go(parts_of_pixels *parts) {
    PyMem_Free(parts->share);
    PyMem_Free(parts->reached);
    PyMem_Free(parts->source);
    PyMem_Free(parts->which);
}

/* Draws them to results and joins them there; of light that is shared out to fragments once to know
 * these, and again with the light. 0, or -1 with an exception. */
static int draw_parts(const view *v, const moit_raster *raster, int64_t *offsets, float *results[3],
                      parts_of_pixels *parts) {
    int64_t pixels = (int64_t)v->width * v->height;
    size_t count = (size_t)offsets[pixels];
    int lights = v->camera.lights.count;
    int64_t *begins = PyMem_New(int64_t, (size_t)pixels + 1);
    PyArrayObject *reached = NULL;
    int failed = -1;
    parts->count = (int64_t)count;
    parts->share = PyMem_New(double, count + 1);
    parts->source = PyMem_New(int32_t, count + 1);
    parts->which = PyMem_New(int64_t, count + 1);
    if (!begins || !parts->share || !parts->source || !parts->which) {
        PyErr_NoMemory();
        goto done;
    }
    memcpy(begins, offsets, ((size_t)pixels + 1) * sizeof *begins);
    bool shared = v->reached && v->reached != Py_None;
    for (int turn = 0; turn < 1 + shared; ++turn) {
        if (turn) {
            reached = reached_of(v, parts->fragments);
            parts->reached = PyMem_New(double, count *(size_t)lights + 1);
            if (!parts->reached) PyErr_NoMemory();
            if (PyErr_Occurred()) goto done;
            const double *of_fragment = PyArray_DATA(reached);
            for (size_t i = 0; i < count * (size_t)lights; ++i) {
                int64_t to = parts->which[i / (size_t)lights];
                parts->reached[i] = to < 0 ? 0.0 : of_fragment[to * lights + (int64_t)i % lights];
            }
            memcpy(offsets, begins, ((size_t)pixels + 1) * sizeof *begins);
        }
        core_call call;
        begin_call(&call, v->threads);
        moit_status status = moit_draw_parts(raster, parts->reached, results[0], results[1],
                                             results[2], parts->share, parts->source, &call.run);
        if (status == MOIT_OK)
            status = moit_join_parts(&v->held.mesh, pixels, offsets, parts->share, parts->source,
                                     results[0], results[1], results[2], parts->which);
        if (end_call(&call, status)) goto done;
        parts->fragments = offsets[pixels];
    }
    failed = 0;
done:
    PyMem_Free(begins);
    Py_XDECREF(reached);
    return failed;
}

/* Room for depth, alpha and color of so many in made[1] to made[3], and where it begins. */
static int make_fragments(npy_intp count, PyObject *made[4], float *results[3]) {
    npy_intp shape[2] = {count, 3};
    for (int i = 1; i < 4; ++i) {
        if (!(made[i] = PyArray_SimpleNew(i == 3 ? 2 : 1, shape, NPY_FLOAT32))) return -1;
        results[i - 1] = PyArray_DATA((PyArrayObject *)made[i]);
    }
    return 0;
}

static PyObject *rasterize(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *made[4] = {NULL}, *result = NULL;
    PyArrayObject *reached = NULL;
    parts_of_pixels parts = {.count = 0};
    view v;
    if (hold_view(&v, args, false)) return NULL;
    npy_intp ends = (npy_intp)v.width * v.height + 1;
    moit_raster *raster = NULL;
    if (!(made[0] = PyArray_SimpleNew(1, &ends, NPY_INT64))) goto done;
    int64_t *offsets = PyArray_DATA((PyArrayObject *)made[0]);
    core_call call;
    begin_call(&call, v.threads);
    moit_status status = (v.by_area ? moit_begin_parts : moit_begin_raster)(
        &v.held.mesh, &v.camera, v.width, v.height, offsets, &raster, &call.run);
    if (end_call(&call, status)) goto done;
    float *results[3];
    if (make_fragments(offsets[ends - 1], made, results)) goto done;
    if (v.by_area) {
        if (draw_parts(&v, raster, offsets, results, &parts)) goto done;
        for (int i = 1; i < 4; ++i) {
            PyObject *some = PySequence_GetSlice(made[i], 0, parts.fragments);
            if (!some) goto done;
            Py_SETREF(made[i], some);
        }
    } else {
        reached = reached_of(&v, offsets[ends - 1]);
        if (PyErr_Occurred()) goto done;
        begin_call(&call, v.threads);
        status = moit_draw(raster, reached ? PyArray_DATA(reached) : NULL, results[0], results[1],
                           results[2], &call.run);
        if (end_call(&call, status)) goto done;
    }
    result = PyTuple_Pack(4, made[0], made[1], made[2], made[3]);
done:
    moit_end_raster(raster);
    for (int i = 0; i < 4; ++i) Py_XDECREF(made[i]);
    Py_XDECREF(reached);
    let_parts_go(&parts);
    let_mesh_go(&v.held);
    return result;
}

PyDoc_STRVAR(
    screen_triangles_doc,
    "screen_triangles(mesh, camera, width, height, threads, /)\n--\n\n"
    "The triangles that rasterize draws of the same arguments, in their order: (n, size of\n"
    "moit_screen_triangle) bytes; of a mesh with uv, all of whose triangles have materials, of\n"
    "moit_textured_triangle. Texels are not read.");

static PyObject *screen_triangles(PyObject *Py_UNUSED(module), PyObject *args) {
    PyObject *made = NULL;
    view v;
    if (hold_view(&v, args, true)) return NULL;
    bool textured = v.held.mesh.uv;
    for (npy_intp i = 0; textured && i < v.held.mesh.triangles; ++i)
        if (v.held.mesh.material_of[i] < 0) {
            PyErr_SetString(PyExc_ValueError, "expected a material of each triangle");
            let_mesh_go(&v.held);
            return NULL;
        }
    moit_raster *raster = NULL;
    core_call call;
    begin_call(&call, v.threads);
    moit_status status =
        moit_begin_raster(&v.held.mesh, &v.camera, v.width, v.height, NULL, &raster, &call.run);
    if (end_call(&call, status)) goto done;
    npy_intp shape[2] = {moit_screen_triangle_count(raster),
                         textured ? sizeof(moit_textured_triangle) : sizeof(moit_screen_triangle)};
    if (!(made = PyArray_SimpleNew(2, shape, NPY_UINT8))) goto done;
    void *out = PyArray_DATA((PyArrayObject *)made);
    begin_call(&call, v.threads);
    status = textured ? moit_textured_triangles(raster, out, &call.run)
                      : moit_screen_triangles(raster, out, &call.run);
    if (end_call(&call, status)) Py_CLEAR(made);
done:
    moit_end_raster(raster);
    let_mesh_go(&v.held);
    return made;
}

PyDoc_STRVAR(levels_doc, "texture_levels(texels, /)\n--\n\n"
                         "All levels of an image of (H, W, 4) float32, one after the other: "
                         "(N, 4).");

static PyObject *texture_levels(PyObject *Py_UNUSED(module), PyObject *object) {
    PyArrayObject *image = array_of(object, NPY_FLOAT, 3, "texels");
    if (!image) return NULL;
    const npy_intp *sides = PyArray_DIMS(image);
    PyObject *made = NULL;
    if (sides[0] < 1 || sides[1] < 1 || sides[0] > MOIT_MOST_SIDE || sides[1] > MOIT_MOST_SIDE
        || sides[2] != 4) {
        PyErr_SetString(PyExc_ValueError, "texels: expected (H, W, 4) of at most MOST_SIDE");
        goto done;
    }
    int height = (int)sides[0], width = (int)sides[1];
    npy_intp shape[2] = {moit_level_texels(width, height), 4};
    if (!(made = PyArray_SimpleNew(2, shape, NPY_FLOAT32))) goto done;
    float *texels = PyArray_DATA((PyArrayObject *)made);
    const float *first = PyArray_DATA(image);
    Py_BEGIN_ALLOW_THREADS
    memcpy(texels, first, (size_t)width * (size_t)height * 4 * sizeof *texels);
    moit_fill_levels(width, height, texels);
    Py_END_ALLOW_THREADS
done:
    Py_DECREF(image);
    return made;
}

static PyMethodDef methods[] = {
    {"texture_levels", texture_levels, METH_O, levels_doc},
    {"rasterize", rasterize, METH_VARARGS, rasterize_doc},
    {"screen_triangles", screen_triangles, METH_VARARGS, screen_triangles_doc},
    {NULL, NULL, 0, NULL},
};

int moit_add_meshes(PyObject *module) { return PyModule_AddFunctions(module, methods); }
