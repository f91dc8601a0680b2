/* Triangles onto the screen.
 *
 * Corners snap to 1/256 pixel, as on GPUs, so that edges are exact integers and neighbouring
 * triangles neither overlap nor leave gaps (Giesen, "Triangle rasterization in practice", 2013, and
 * the rules of Direct3D 11). */
#include "core/projection.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Beyond so many pixels from the middle of the picture triangles are clipped, so that products of
 * coordinates stay below 2^53. */
static const double guard = 32768.0;

typedef struct {
    double x, y, z;
    double weight[3];
} corner;

static corner seen(const moit_raster *r, int32_t vertex, int which) {
    const moit_camera *c = &r->camera;
    double from_eye[3];
    for (int k = 0; k < 3; ++k)
        from_eye[k] = (double)r->mesh->position[3 * (int64_t)vertex + k] - c->eye[k];
    corner o = {moit_dot(c->right, from_eye),
                moit_dot(c->up, from_eye),
                moit_dot(c->forward, from_eye),
                {0}};
    o.weight[which] = 1.0;
    return o;
}

/* Positive on the side that is kept: in front of the eye, then within the guard band. */
static double inside(const moit_raster *r, const corner *c, int plane) {
    double across = c->x * r->camera.scale[0] * 0.5 * r->width,
           along = c->y * r->camera.scale[1] * 0.5 * r->height;
    switch (plane) {
    case 0: return c->z - r->camera.near;
    case 1: return guard * c->z - across;
    case 2: return guard * c->z + across;
    case 3: return guard * c->z - along;
    default: return guard * c->z + along;
    }
}

enum { PLANES = 5, MOST_CORNERS = 3 + PLANES };

/* Sutherland and Hodgman 1974. Returns how many corners are left. */
static int clip(const moit_raster *r, corner *polygon, int count, bool *cut) {
    for (int plane = 0; plane < PLANES && count; ++plane) {
        corner kept[MOST_CORNERS];
        int left = 0;
        for (int i = 0; i < count; ++i) {
            corner a = polygon[i], b = polygon[(i + 1) % count];
            double from = inside(r, &a, plane), to = inside(r, &b, plane);
            if (from >= 0.0) kept[left++] = a;
            if ((from >= 0.0) == (to >= 0.0)) continue;
            double t = from / (from - to);
            corner between = {
                a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z), {0}};
            if (plane == 0) between.z = r->camera.near; /* not a rounding in front of it */
            for (int k = 0; k < 3; ++k)
                between.weight[k] = a.weight[k] + t * (b.weight[k] - a.weight[k]);
            kept[left++] = between;
            *cut = true;
        }
        memcpy(polygon, kept, (size_t)left * sizeof *kept);
        count = left;
    }
    return count;
}

static void *grown(void *array, int64_t *room, int64_t needed, size_t size) {
    if (needed <= *room) return array;
    int64_t more = *room * 2 > needed ? *room * 2 : needed + 1024;
    void *larger = realloc(array, (size_t)more * size);
    if (larger) *room = more;
    return larger;
}

static bool keep(moit_raster *r, int64_t source, bool opaque, bool cut, const corner part[3]) {
    moit_projected_triangle t = {.clipped = -1, .opaque = opaque, .source = source};
    int order[3] = {0, 1, 2};
    for (int k = 0; k < 3; ++k) {
        const corner *c = &part[k];
        double x = r->width * (0.5 + 0.5 * r->camera.scale[0] * c->x / c->z),
               y = r->height * (0.5 - 0.5 * r->camera.scale[1] * c->y / c->z);
        /* nor NaN, of a mesh that was changed after it was looked at */
        if (!(fabs(x) < 4.0 * guard && fabs(y) < 4.0 * guard)) return true;
        t.x[k] = (int32_t)lrint(x * MOIT_SUBPIXELS);
        t.y[k] = (int32_t)lrint(y * MOIT_SUBPIXELS);
        t.inverse_z[k] = 1.0 / c->z;
    }
    int64_t area = (int64_t)(t.x[1] - t.x[0]) * (t.y[2] - t.y[0])
                   - (int64_t)(t.y[1] - t.y[0]) * (t.x[2] - t.x[0]);
    if (area == 0) return true;
    if (area < 0) {
        moit_projected_triangle turned = t;
        for (int k = 1; k < 3; ++k) {
            turned.x[k] = t.x[3 - k];
            turned.y[k] = t.y[3 - k];
            turned.inverse_z[k] = t.inverse_z[3 - k];
            order[k] = 3 - k;
        }
        t = turned;
        t.turned = true;
    }
    if (cut) {
        void *weights = grown(r->weights, &r->clipped_room, r->clipped + 1, sizeof *r->weights);
        if (!weights || r->clipped == INT32_MAX) return false;
        r->weights = weights;
        for (int k = 0; k < 3; ++k)
            memcpy(r->weights[r->clipped][k], part[order[k]].weight, sizeof part->weight);
        t.clipped = (int32_t)r->clipped++;
    }
    void *triangles = grown(r->triangles, &r->room, r->count + 1, sizeof *r->triangles);
    if (!triangles || r->count == INT32_MAX) return false;
    r->triangles = triangles;
    r->triangles[r->count++] = t;
    return true;
}

moit_status moit_project(moit_raster *r, const moit_run *run) {
    for (int64_t i = 0; i < r->mesh->triangles; ++i) {
        if (i % 65536 == 0 && run->interrupted && run->interrupted(run->context))
            return MOIT_INTERRUPTED;
        const int32_t *vertex = r->mesh->corners + 3 * i;
        corner polygon[MOST_CORNERS];
        bool opaque = true, cut = false;
        for (int k = 0; k < 3; ++k) {
            polygon[k] = seen(r, vertex[k], k);
            opaque &= r->mesh->alpha[vertex[k]] == 1.0f;
        }
        const moit_material *material = moit_material_of(r, i);
        if (material)
            opaque = !material->listed && (material->masked || (opaque && !material->transparent));
        int count = clip(r, polygon, 3, &cut);
        for (int k = 2; k < count; ++k)
            if (!keep(r, i, opaque, cut, (corner[3]){polygon[0], polygon[k - 1], polygon[k]}))
                return MOIT_NO_MEMORY;
    }
    return MOIT_OK;
}
