/* A pixel of a deep image, cut where samples begin and end. */
#ifndef MOIT_DEEP_GROUPS_H
#define MOIT_DEEP_GROUPS_H

#include "moit_deep.h"

/* Part of a sample. */
typedef struct {
    int64_t sample;
    double share; /* of its depth, 1 of a surface */
} moit_member;

/* All that fills [near, far), or the surfaces at near where the two are equal. */
typedef struct {
    double near, far;
    int64_t begin, end; /* members */
} moit_group;

/* What one thread works with: zero before the first pixel. */
typedef struct {
    moit_group *groups;
    moit_member *members;
    double *depths;
    int64_t *order, *active;
    int64_t count;                           /* groups of the pixel */
    int64_t room, member_room, samples_room; /* that there is memory for */
} moit_grouping;

/* Groups the samples of a pixel front to back; surfaces come before volumes that begin at their
 * depth. MOIT_OK or MOIT_NO_MEMORY. */
moit_status moit_group_samples(moit_grouping *grouping, const moit_deep *samples, int64_t pixel);
void moit_free_grouping(moit_grouping *grouping);

/* Room for `wanted` things of a size in an array, a pointer to which is given, that has room for
 * `room`. */
bool moit_grow(void *array, int64_t *room, int64_t wanted, size_t size);

/* A sample's numbers, as moit_deep says that they are taken. */
double moit_front_of(const moit_deep *samples, int64_t i);
double moit_back_of(const moit_deep *samples, int64_t i);
double moit_alpha_of(const moit_deep *samples, int64_t i, int k);

/* What a share of a medium of opacity alpha hides, and how much of its light that gives: of all of
 * it where alpha is 0, too. */
double moit_part_of(double alpha, double share);
double moit_light_of_part(double alpha, double share);

#endif
