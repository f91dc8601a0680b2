#pragma once
#include <stddef.h>
void *aligned_alloc(size_t, size_t), *calloc(size_t, size_t), *malloc(size_t);
void *realloc(void *, size_t);
void free(void *);
void qsort(void *, size_t, size_t, int (*)(const void *, const void *));
int abs(int);
