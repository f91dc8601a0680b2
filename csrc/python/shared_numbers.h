/* What kernels/options.h and shaders/arrays/bindings.glsl define, which the build puts into a table;
 * a last one has no name. */
#ifndef MOIT_SHARED_NUMBERS_H
#define MOIT_SHARED_NUMBERS_H

typedef struct {
    const char *name;
    long value;
} shared_number;
extern const shared_number shared_numbers[];

#endif
