/* What coincides where densities change with depth: Gaussians among others, in panels so narrow
 * that each density is a polynomial in one. */
#ifndef MOIT_PANELS_H
#define MOIT_PANELS_H

#include "core/extents.h"

/* What coincides, as one: what it hides of all and of each channel, and the light seen of it. */
typedef struct {
    double alpha, opacity[3];
    double color[3], emission[3];
} moit_mixture;

/* A fragment that fills the depth a sweep is at: what is needed of it in each panel. */
typedef struct {
    int64_t fragment;
    moit_extent extent;
    double hides[4];    /* absorbance, of all channels together and of each; 0 of what is opaque */
    bool opaque[4];     /* and whether it is */
    double light[2][3]; /* of colour and emission, for each unit of absorbance; of what is opaque
                           what there is */
    moit_tail passed;
} moit_filling;

typedef struct {
    const moit_fragments *f;
    double unit; /* that light is counted in */
    int64_t count;
    moit_filling *filling; /* room for as many as a pixel has */
} moit_panels;

void moit_panels_begin(moit_panels *panels, int64_t fragment, const moit_extent *extent);
void moit_panels_end(moit_panels *panels, int64_t fragment);

/* How far a panel may reach that begins at a depth, for all that fills it, and for an extent that
 * begins within it. Light is then within 1e-6 of the brightest. */
double moit_panels_reach(const moit_panels *panels, double near);
double moit_panel_reach(const moit_extent *extent, double near);

/* Whether nothing changes where a Gaussian begins or ends: there is nothing of it yet. */
bool moit_begins_softly(const moit_extent *extent);
bool moit_ends_softly(const moit_extent *extent);

/* What fills the panel between two depths. */
moit_mixture moit_mix_panel(moit_panels *panels, double near, double far);

#endif
