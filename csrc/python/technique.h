/* A technique as the surface hands it to the core. */
#ifndef MOIT_TECHNIQUE_BINDING_H
#define MOIT_TECHNIQUE_BINDING_H

#include "binding.h"

typedef struct {
    moit_technique technique;
    PyArrayObject *weights, *network;
} held_technique;

/* `object` is a dict of the options of a kind, by its number "kind": a missing or unknown one is a
 * TypeError. Given weights and those of a network are held until let_technique_go; the former must
 * be as many as the fragments, and without fragments are not looked at. Gives 0, or -1 with an
 * exception. */
int hold_technique(held_technique *held, PyObject *object, const held_fragments *fragments);
void let_technique_go(held_technique *held);

/* Fragments and a technique that a question is about; nothing is held where it gives -1. Each is
 * let go by itself. */
int hold_asked(held_fragments *held, PyObject *fragments, held_technique *technique,
               PyObject *object);

#endif
