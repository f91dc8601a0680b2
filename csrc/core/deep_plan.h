/* Which few samples can stand for a ray's many. */
#ifndef MOIT_DEEP_PLAN_H
#define MOIT_DEEP_PLAN_H

#include "core/deep_curves.h"

/* What leads from one state of a ray to another behind it. */
typedef enum { MOIT_NOTHING, MOIT_SURFACE, MOIT_VOLUME } moit_step_kind;

/* A state of the true ray, and the best way to one that is near enough to it. */
typedef struct {
    int64_t from;
    int64_t samples; /* that it takes */
    moit_step_kind kind;
    double gap; /* how far it is from the truth, relative to the tolerance */
} moit_way;

/* A sample that stands for pieces [begin, end) of the true ray; what comes behind them until the
 * next one begins needs none. */
typedef struct {
    int64_t begin, end;
    moit_step_kind kind;
} moit_stand_in;

typedef struct {
    const moit_ray_curve *truth;
    const double *tolerance;  /* (width) */
    const int64_t *identity;  /* (pieces) what must not be mixed; NULL: all may be */
    bool volumes;             /* whether a volume may stand for what is none */
    double room_for_numbers;  /* what of the tolerance volumes leave, as a share of it */
    moit_ray_curve slope;     /* one piece */
    moit_way *ways;           /* (pieces + 1) */
    double *values;           /* (pieces + 1, width) where they lead */
    double *low, *high;       /* (width) */
    moit_stand_in *stand_ins; /* (pieces) the result */
    int64_t count, room;
} moit_plan;

/* The least stand-ins for plan->truth: MOIT_OK, or MOIT_NO_MEMORY. There may be none: then count
 * is -1. */
moit_status moit_make_plan(moit_plan *plan);
void moit_free_plan(moit_plan *plan);

/* Where the plan leads at state b, if it has a way there. */
const double *moit_planned(const moit_plan *plan, int64_t b);

/* The corridor that a plateau may lie in: within the tolerance of each state from `begin` to `end`,
 * in plan->low and plan->high. false: there is none. */
bool moit_corridor(moit_plan *plan, int64_t begin, int64_t end);

#endif
