/* The share of each pixel that a triangle covers: what is left of the pixel when the triangle's
 * three edges have cut it. Triangles on two sides of an edge share out the pixels there. */
#define SCALAR double
#define LANES 2
#include "kernels/dialect.h"
#include "kernels/surface.h"

#include "core/raster.h"

#include <string.h>

enum { MOST_CORNERS = 4 + 3 };

/* What is less is rounding. */
static const double LEAST_SHARE = 1e-9;

typedef struct {
    double x, y;
} place;

/* Twice the area on the right-hand side of an edge (y points down), in squares of 1/256 pixel. */
static double beside(const moit_projected_triangle *t, int from, place p) {
    int to = (from + 1) % 3;
    return (double)(t->x[to] - t->x[from]) * (p.y - t->y[from])
           - (double)(t->y[to] - t->y[from]) * (p.x - t->x[from]);
}

/* What of a polygon is on the inner side of an edge. Sutherland and Hodgman 1974. */
static int cut(const moit_projected_triangle *t, int edge, place *polygon, int count) {
    place kept[MOST_CORNERS];
    int left = 0;
    for (int i = 0; i < count; ++i) {
        place a = polygon[i], b = polygon[(i + 1) % count];
        double from = beside(t, edge, a), to = beside(t, edge, b);
        if (from >= 0.0) kept[left++] = a;
        if ((from >= 0.0) == (to >= 0.0)) continue;
        double s = from / (from - to);
        kept[left++] = (place){a.x + s * (b.x - a.x), a.y + s * (b.y - a.y)};
    }
    memcpy(polygon, kept, (size_t)left * sizeof *kept);
    return left;
}

/* The area of a polygon, and its centroid, from its first corner. */
static double area_of(const place *polygon, int count, place *middle) {
    double sum = 0.0, x = 0.0, y = 0.0;
    for (int i = 2; i < count; ++i) {
        double ax = polygon[i - 1].x - polygon[0].x, ay = polygon[i - 1].y - polygon[0].y,
               bx = polygon[i].x - polygon[0].x, by = polygon[i].y - polygon[0].y,
               twice = ax * by - ay * bx;
        sum += twice;
        x += twice * (ax + bx) / 3.0;
        y += twice * (ay + by) / 3.0;
    }
    if (sum > 0.0) *middle = (place){polygon[0].x + x / sum, polygon[0].y + y / sum};
    return sum / 2.0;
}

/* The share of a pixel whose corner is (x, y), in pixels, and the middle of what is covered. */
static double covered_share(const moit_projected_triangle *t, int x, int y, place *middle) {
    const double side = MOIT_SUBPIXELS, left = x * side, top = y * side;
    place polygon[MOST_CORNERS] = {
        {left, top}, {left + side, top}, {left + side, top + side}, {left, top + side}};
    int count = 4;
    *middle = (place){left + side / 2.0, top + side / 2.0};
    for (int edge = 0; edge < 3; ++edge) {
        int inside = 0;
        for (int k = 0; k < count; ++k) inside += beside(t, edge, polygon[k]) >= 0.0;
        if (!inside) return 0.0;
        if (inside < count) count = cut(t, edge, polygon, count);
    }
    if (count == 4 && polygon[0].x == left && polygon[0].y == top && polygon[2].x == left + side
        && polygon[2].y == top + side)
        return 1.0;
    return area_of(polygon, count, middle) / (side * side);
}

int moit_cover_areas(const moit_projected_triangle *t, int left, int top, int right, int bottom,
                     moit_covered *out) {
    real inverse_z[3];
    for (int k = 0; k < 3; ++k) inverse_z[k] = K(t->inverse_z[k]);
    place third = {t->x[2], t->y[2]}, middle;
    double area = beside(t, 0, third);
    int count = 0;
    for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x) {
            double share = covered_share(t, x, y, &middle);
            if (share < LEAST_SHARE) continue;
            surface_point p = point_of_surface(K(beside(t, 2, middle) / area),
                                               K(beside(t, 0, middle) / area), inverse_z);
            out->x[count] = x;
            out->y[count] = y;
            out->second[count] = p.second[0];
            out->third[count] = p.third[0];
            out->z[count] = p.z[0];
            out->place[count] = (y % MOIT_RASTER_TILE) * MOIT_RASTER_TILE + x % MOIT_RASTER_TILE;
            out->share[count++] = share;
        }
    return count;
}
