/* What the binding's files share: the module's parts, and a call into the core. */
#ifndef MOIT_BINDING_H
#define MOIT_BINDING_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#ifndef MOIT_BINDING_MODULE /* module.c alone holds NumPy's table of functions */
#define NO_IMPORT_ARRAY
#endif
#define PY_ARRAY_UNIQUE_SYMBOL moit_numpy_api
#include <numpy/arrayobject.h>

#include "moit_geometry.h"

/* The instruction set that MOIT_ISA names, or the best; an exception where it names none. */
int moit_choose_isa(PyObject *module);
moit_isa moit_chosen_isa(void);
/* Chooses the one that a string names, and gives the name of the one before. */
PyObject *moit_use_isa(PyObject *module, PyObject *name);
/* Each file of csrc/python adds its functions to the module in one of these; -1 with an
 * exception. */
int moit_add_environment(PyObject *module);
int moit_add_questions(PyObject *module);
int moit_add_gradients(PyObject *module);
int moit_add_fragments(PyObject *module);
int moit_add_metrics(PyObject *module);
int moit_add_deep(PyObject *module);
int moit_add_deep_samples(PyObject *module);
int moit_add_meshes(PyObject *module);
int moit_add_passes(PyObject *module);
int moit_add_mixed(PyObject *module);
int moit_add_moments(PyObject *module);
int moit_add_pixels(PyObject *module);
int moit_add_shadows(PyObject *module);
int moit_add_splats(PyObject *module);
int moit_add_strokes(PyObject *module);
int moit_add_grids(PyObject *module);

/* A call into the core with the GIL released:
 *
 *     core_call call;
 *     begin_call(&call, threads);
 *     moit_status status = moit_something(..., &call.run);
 *     if (end_call(&call, status)) goto done;
 *
 * Between the two no Python object may be touched. end_call gives 0 or -1 with MemoryError or
 * whatever a signal handler raised (KeyboardInterrupt). */
typedef struct {
    moit_run run;
    PyThreadState *python;
} core_call;

void begin_call(core_call *call, int threads);
int end_call(core_call *call, moit_status status);

/* A C-contiguous, aligned view or copy of `object` with `type` and `ndim` dimensions; NULL with
 * an exception that names the argument. The surface has checked already: this guards memory. */
PyArrayObject *array_of(PyObject *object, int type, int ndim, const char *name);

/* NumPy's number for what such an object is computed in: double where it is an array of doubles,
 * else float; and what the core calls either. */
int number_type_of(PyObject *object);
moit_precision precision_of(int type);

/* Converter of PyArg_ParseTuple ("O&"): a moit_camera without lights from (eye, right, up, forward,
 * (scale x, scale y), near, far); and whether a picture can have such a size, else an exception. */
int camera_of(PyObject *object, void *camera);
bool is_size(int width, int height);

/* From rows of (direction, colour) in a moit_lights; NULL: none. 0, or -1 with an exception. */
int hold_lights(moit_lights *lights, PyObject *object);

/* Offsets and what belongs to each fragment; the first three are always there. */
enum { MOIT_FRAGMENT_ARRAYS = MOIT_DEVIATION - MOIT_OFFSETS + 1 };

/* The arrays of a moit.Fragments, alive until let_go:
 *
 *     held_fragments held;
 *     if (hold_fragments(&held, object)) return NULL;
 *     ... held.fragments, held.count; the GIL may be released ...
 *     let_go(&held);
 *
 * hold_fragments gives 0 or, holding nothing, -1 with an exception. */
typedef struct {
    moit_fragments fragments;
    int64_t count, height, width;
    PyArrayObject *arrays[MOIT_FRAGMENT_ARRAYS];
} held_fragments;

int hold_fragments(held_fragments *held, PyObject *object);
void let_go(held_fragments *held);

#endif
