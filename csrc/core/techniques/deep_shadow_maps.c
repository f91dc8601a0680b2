/* Deep shadow maps on a tile. A map is made and read pixel by pixel, in double and one lane wide:
 * each segment depends on the one before. */
#define SCALAR double
#define LANES 1
#include "kernels/dialect.h"
#include "kernels/deep_shadow.h"

#include "core/techniques/options.h"
#include "core/techniques/table.h"

/* Differences of the largest depths are finite when both are a quarter. */
static const double unit = 0.25;

/* A pixel's map: nodes from front to back, of which two may share a depth. */
typedef struct {
    double *z, *T;
    int count;
    bool wide; /* T is stored in double, not in float */
} shadow_map;

/* Nodes of a map of n surfaces at most. */
static size_t most_nodes(int n) { return 3 * (size_t)n + 3; }

static size_t deep_shadow_scratch(const moit_job *job, int fragments, int pixels) {
    (void)job, (void)pixels;
    return 2 * most_nodes(fragments) * sizeof(double);
}

static shadow_map empty_map(const moit_job *job, const moit_tile *tile) {
    double *z = (double *)tile->own;
    size_t n = most_nodes(tile->fragments);
    return (shadow_map){z, z + n, 0, job->fragments->precision == MOIT_FLOAT64};
}

static void add_node(shadow_map *map, double z, double T) {
    int last = map->count - 1;
    if (!map->wide) T = (double)(float)T;
    if (last >= 0 && map->z[last] == z && map->T[last] == T) return;
    map->z[last + 1] = z;
    map->T[last + 1] = T;
    ++map->count;
}

static bool is_lost(shadow_segment s) { return s.steepest[0] > s.flattest[0]; }

/* The map of pixel p, whose fragments `order` lists from front to back, and its exact total. */
static double make_map(const moit_job *job, const moit_tile *tile, int p, const int32_t *order,
                       shadow_map *map) {
    moit_precision precision = job->fragments->precision;
    const real tolerance = K(job->technique->tolerance);
    int n = tile->offsets[p + 1] - tile->offsets[p];
    map->count = 0;
    if (n == 0) return 1.0;
    double total = 1.0, behind = 1.0;
    for (int k = 0; k < n; ++k) total *= 1.0 - moit_number(precision, tile->alpha, order[k]);
    double last = moit_number(precision, tile->depth, order[0]) * unit;
    shadow_segment segment = shadow_segment_from(K(last), K(1.0));
    add_node(map, last, 1.0);
    for (int k = 0; k < n;) {
        double depth = moit_number(precision, tile->depth, order[k]), before = behind;
        real z = K(depth * unit);
        do behind *= 1.0 - moit_number(precision, tile->alpha, order[k++]);
        while (k < n && moit_number(precision, tile->depth, order[k]) == depth);

        shadow_segment front = shadow_segment_through(segment, z, K(before), K(total), tolerance);
        if (is_lost(front)) {
            real T = shadow_segment_at(segment, K(last));
            add_node(map, last, T[0]);
            segment = shadow_segment_from(K(last), T);
            front = shadow_segment_through(segment, z, K(before), K(total), tolerance);
        }
        segment = shadow_segment_through(front, z, K(behind), K(total), tolerance);
        last = z[0];
        if (is_lost(segment)) {
            add_node(map, last, shadow_segment_at(front, z)[0]);
            add_node(map, last, behind);
            segment = shadow_segment_from(z, K(behind));
        }
    }
    add_node(map, last, shadow_segment_at(segment, K(last))[0]);
    add_node(map, last, total);
    return total;
}

/* The map at z; node: the first that is not in front of z. */
static double map_at(const shadow_map *map, int node, double z) {
    if (map->count == 0) return 1.0;
    if (node == 0) return map->T[0];
    if (node == map->count) return map->T[node - 1];
    return shadow_between(K(map->z[node - 1]), K(map->T[node - 1]), K(map->z[node]),
                          K(map->T[node]), K(z))[0];
}

/* Fills tile->order with places of fragments from front to back, pixel after pixel. */
static void sort_tile(const moit_job *job, moit_tile *tile) {
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p];
        for (int i = start; i < tile->offsets[p + 1]; ++i) tile->order[start + tile->rank[i]] = i;
    }
}

static void deep_shadow_weigh(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    shadow_map map = empty_map(job, tile);
    sort_tile(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        const int32_t *order = tile->order + tile->offsets[p];
        tile->total[p] = make_map(job, tile, p, order, &map);
        int n = tile->offsets[p + 1] - tile->offsets[p], node = 0;
        for (int k = 0; k < n; ++k) {
            double z = moit_number(precision, tile->depth, order[k]) * unit;
            while (node < map.count && map.z[node] < z) ++node;
            moit_set_number(precision, tile->T, order[k], map_at(&map, node, z));
        }
    }
}

static void deep_shadow_curve(const moit_job *job, moit_tile *tile) {
    shadow_map map = empty_map(job, tile);
    sort_tile(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        tile->total[p] = make_map(job, tile, p, tile->order + tile->offsets[p], &map);
        for (int64_t k = 0; k < job->depths; ++k) {
            double z = job->depth[k] * unit;
            int node = 0, end = map.count;
            while (node < end) {
                int middle = node + (end - node) / 2;
                if (map.z[middle] < z) node = middle + 1;
                else end = middle;
            }
            moit_set_number(job->fragments->precision, tile->curve, p * job->depths + k,
                            map_at(&map, node, z));
        }
    }
}

const moit_technique_row moit_deep_shadow_row = {.name = "deep-shadow",
                                                 OPTIONS(NORMALIZE, NUMBER("tolerance", tolerance)),
                                                 .weigh = deep_shadow_weigh,
                                                 .curve = deep_shadow_curve,
                                                 .scratch = deep_shadow_scratch,
                                                 .reconstructs = true,
                                                 .geometry_passes = 2};
