/* What is counted and yet to be drawn, in a capsule. */
#ifndef MOIT_PYTHON_RASTERS_H
#define MOIT_PYTHON_RASTERS_H

#include "binding.h"

/* A raster, its offsets, and the size of its picture. */
typedef struct {
    void *raster;
    void (*end)(void *raster);
    PyObject *offsets;
    int width, height;
    npy_intp count; /* of what is drawn, where derivatives are summed for each */
    int detail;     /* the kind's own: whether there are deviations, how many lights there are */
} held_raster;

/* A new capsule of this name, which lives as long as it does, with room for offsets and no raster
 * yet; or NULL with an exception. */
PyObject *hold_raster(const char *name, void (*end)(void *), int width, int height,
                      held_raster **held);

/* Where offsets are to be filled in. */
int64_t *offsets_of_raster(const held_raster *held);

/* (capsule, offsets, nearest, farthest), once offsets are filled in: the raster reads them. Takes
 * the capsule. */
PyObject *give_raster(PyObject *capsule, const float range[2]);

/* What a capsule of this name has, or NULL with an exception. begins: what makes such. */
const held_raster *whole_raster_of(PyObject *capsule, const char *name, const char *begins);

/* The same, if it has these rows. */
const held_raster *raster_of(PyObject *capsule, const char *name, const char *begins, int top,
                             int bottom);

/* A new array of the offsets of rows [top, bottom), from 0; *count: of their fragments. */
PyObject *offsets_of_rows(const held_raster *held, int top, int bottom, npy_intp *count);

#endif
