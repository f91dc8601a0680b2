/* Stages of layer techniques. Lanes are neighbouring pixels that take in their fragments one by
 * one; those with fewer take in nothing, which changes nothing. */
#include "kernels/adaptive.h"
#include "kernels/mlab.h"
#include "kernels/steps.h"

/* Fragment k of each of LANES pixels from p on: depth, alpha, color. */
typedef struct {
    SCALAR numbers[5][LANES];
} fragment_of_each;

FN int most_fragments(int pixels, const int32_t *offsets, int p) {
    int most = 0;
    for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
        int n = offsets[p + lane + 1] - offsets[p + lane];
        most = n > most ? n : most;
    }
    return most;
}

FN void gather_one(const int k, const int pixels, const int32_t *offsets, const int p,
                   const SCALAR *depth, const SCALAR *alpha, const SCALAR *color, const SCALAR none,
                   fragment_of_each *of) {
    for (int lane = 0; lane < LANES; ++lane) {
        int i = p + lane < pixels ? offsets[p + lane] + k : 0;
        bool there = p + lane < pixels && i < offsets[p + lane + 1];
        of->numbers[0][lane] = there ? depth[i] : none;
        of->numbers[1][lane] = there ? alpha[i] : (SCALAR)0;
        for (int c = 0; c < 3; ++c)
            of->numbers[2 + c][lane] = there && color ? color[3 * i + c] : (SCALAR)0;
    }
}

/* Of layers and one behind them, the two whose blending does least blend; the last is free then. */
FN void blend_best(const int layers, const bool quantized, layer *held, layer last) {
    held[layers] = last;
    real reaches = K(1.0);
    blending best = blending_of(reaches, held[0], held[1], K(1));
    for (int i = 2; i <= layers; ++i) {
        reaches = reaches * held[i - 2].through;
        best = or_blending(best, blending_of(reaches, held[i - 1], held[i], K(i)));
    }
    best = blending_needed(best, last, K(layers));
    layer front = held[0], behind = held[1];
    for (int i = 2; i <= layers; ++i) {
        truth here = best.place == K(i);
        front = layer_chosen(here, held[i - 1], front);
        behind = layer_chosen(here, held[i], behind);
    }
    layer merged = layers_merged(front, behind, best);
    if (quantized) merged = held_layer(merged);
    for (int i = 0; i < layers; ++i) {
        layer later = layer_chosen(K(i) < best.place, merged, held[i + 1]);
        held[i] = layer_chosen(K(i) < best.place - 1.0, held[i], later);
    }
}

FN void mlab_of(const int layers, const bool quantized, const bool by_energy, int pixels,
                const int32_t *offsets, const SCALAR *depth, const SCALAR *alpha,
                const SCALAR *color, double least, SCALAR *state) {
    const layer none = empty_layer();
    const SCALAR empty = none.depth[0];
    /* the least number of SCALAR that is not below */
    SCALAR limit = (SCALAR)least;
    if ((double)limit < least) limit = (SCALAR)(least * (1.0 + BY_PRECISION(0x1p-23, 0x1p-52)));
    for (int p = 0; p < pixels; p += LANES) {
        layer held[MOIT_MOST_LAYERS + 1];
        for (int i = 0; i < layers; ++i) held[i] = none;
        int most = most_fragments(pixels, offsets, p);
        for (int k = 0; k < most; ++k) {
            fragment_of_each of;
            gather_one(k, pixels, offsets, p, depth, alpha, color, empty, &of);
            layer coming = layer_of(load(of.numbers[0]), load(of.numbers[1]), load(of.numbers[2]),
                                    load(of.numbers[3]), load(of.numbers[4]), K(limit));
            if (quantized) coming = held_layer(coming);
            for (int i = 0; i < layers; ++i) {
                layer_pair pair = layers_passed(held[i], coming);
                held[i] = pair.front;
                coming = pair.behind;
            }
            if (!any_lane(coming.depth < none.depth)) continue;
            if (by_energy) {
                blend_best(layers, quantized, held, coming);
                continue;
            }
            held[layers - 1] = layers_blended(held[layers - 1], coming);
            if (quantized) held[layers - 1] = held_layer(held[layers - 1]);
        }
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
            SCALAR *out = state + (size_t)(p + lane) * MOIT_LAYER_NUMBERS * (size_t)layers;
            for (int i = 0; i < layers; ++i, out += MOIT_LAYER_NUMBERS) {
                out[0] = held[i].depth[lane];
                out[1] = held[i].red[lane];
                out[2] = held[i].green[lane];
                out[3] = held[i].blue[lane];
                out[4] = held[i].through[lane];
            }
        }
    }
}

/* As anchors.h has it: the usual options have a text of their own, all others share one. */
static void mlab_stage(int layers, bool quantized, bool by_energy, int pixels,
                       const int32_t *offsets, const void *depth, const void *alpha,
                       const void *color, double least, void *state) {
#define MLAB(quantized, by_energy) \
    mlab_of(layers, quantized, by_energy, pixels, offsets, depth, alpha, color, least, state)
    if (quantized && !by_energy) MLAB(true, false);
    else MLAB(quantized, by_energy);
#undef MLAB
}

/* The node of the least area goes. */
FN void leave_node_out(const int nodes, const visibility *more, visibility *held) {
    removal gone = {K(1.0), area_lost(more[0], more[1])};
    for (int i = 2; i < nodes; ++i) gone = or_removal(gone, K(i), area_lost(more[i - 1], more[i]));
    real out = place_left_out(gone, more[nodes], K(nodes));
    for (int i = 0; i < nodes; ++i) held[i] = node_kept(more[i], more[i + 1], K(i), out);
}

/* The two nodes become one whose merging does least. */
FN void merge_nodes(const int nodes, const bool quantized, const visibility *more,
                    visibility *held) {
    const real scale = quantized ? word_step() : K(1);
    merging best = merging_of(K(1.0), more[0], more[1], K(1), scale);
    for (int i = 2; i <= nodes; ++i)
        best = or_merging(best, merging_of(more[i - 2].through, more[i - 1], more[i], K(i), scale));
    best = merging_needed(best, more[nodes - 1], more[nodes], K(nodes));
    real depth = merged_depth(best);
    if (quantized) depth = nearest_integer(depth);
    for (int i = 0; i < nodes; ++i)
        held[i] = node_merged(more[i], more[i + 1], K(i), best.place, depth);
}

FN void adaptive_of(const int nodes, const bool quantized, const bool by_energy, int pixels,
                    const int32_t *offsets, const SCALAR *depth, const SCALAR *alpha,
                    SCALAR *steps) {
    const SCALAR empty = empty_depth()[0];
    for (int p = 0; p < pixels; p += LANES) {
        visibility held[MOIT_MOST_LAYERS + 1], more[MOIT_MOST_LAYERS + 1];
        for (int i = 0; i <= nodes; ++i) held[i] = (visibility){K(empty), K(1.0)};
        int most = most_fragments(pixels, offsets, p);
        for (int k = 0; k < most; ++k) {
            fragment_of_each of;
            gather_one(k, pixels, offsets, p, depth, alpha, NULL, empty, &of);
            real at = load(of.numbers[0]), passes = 1.0 - load(of.numbers[1]);
            more[0] = node_shifted((visibility){at, K(1.0)}, held[0], at, passes);
            for (int i = 1; i <= nodes; ++i)
                more[i] = node_shifted(held[i - 1], held[i], at, passes);
            if (by_energy) merge_nodes(nodes, quantized, more, held);
            else leave_node_out(nodes, more, held);
            for (int i = 0; quantized && i < nodes; ++i) held[i] = held_node(held[i]);
        }
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            for (int i = 0; i < nodes; ++i) {
                SCALAR *out = steps + 2 * ((size_t)(p + lane) * (size_t)nodes + (size_t)i);
                out[0] = held[i].depth[lane];
                out[1] = held[i].through[lane];
            }
    }
}

static void adaptive_stage(int nodes, bool quantized, bool by_energy, int pixels,
                           const int32_t *offsets, const void *depth, const void *alpha,
                           void *steps) {
#define ADAPTIVE(quantized, by_energy) \
    adaptive_of(nodes, quantized, by_energy, pixels, offsets, depth, alpha, steps)
    if (quantized && !by_energy) ADAPTIVE(true, false);
    else ADAPTIVE(quantized, by_energy);
#undef ADAPTIVE
}

static void words_stage(int n, void *z_) {
    SCALAR *z = z_;
    for (int i = 0; i < n; i += LANES) store(z + i, unorm16_word(load(z + i)));
}

static void steps_stage(int count, int pixels, const int32_t *offsets, const void *z_,
                        const void *steps_, void *T_) {
    const SCALAR *z = z_, *steps = steps_;
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p, steps += 2 * count)
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            real at = load_at_most(z + i, offsets[pixels] - i), through = K(1.0);
            for (int k = 0; k < count; ++k)
                through = behind_step(at, K(steps[2 * k]), K(steps[2 * k + 1]), through);
            store(T + i, through);
        }
}

/* Keeps the places of the `layers` nearest, in order; what there is no room for has gone to the
 * back before, each in front of those that went earlier. */
FN void kbuffer_ranks_of(const int layers, int pixels, const int32_t *offsets, const SCALAR *depth,
                         int32_t *rank) {
    const SCALAR infinite = (SCALAR)__builtin_inf();
    for (int p = 0; p < pixels; p += LANES) {
        real held_depth[MOIT_MOST_LAYERS];
        truth held_place[MOIT_MOST_LAYERS]; /* in the pixel; -1: none */
        int last[LANES] = {0};              /* the rank of the next that has to go */
        for (int i = 0; i < layers; ++i) {
            held_depth[i] = K(infinite);
            held_place[i] = (truth){0} - 1;
        }
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            last[lane] = offsets[p + lane + 1] - offsets[p + lane] - 1;
        int most = most_fragments(pixels, offsets, p);
        for (int k = 0; k < most; ++k) {
            SCALAR depths[LANES];
            truth place = {0};
            for (int lane = 0; lane < LANES; ++lane) {
                int i = p + lane < pixels ? offsets[p + lane] + k : 0;
                bool there = p + lane < pixels && i < offsets[p + lane + 1];
                depths[lane] = there ? depth[i] : infinite;
                place[lane] = there ? k : -1;
            }
            real at = load(depths);
            truth front = {0}; /* behind equals at first; then all move on, equals too */
            for (int i = 0; i < layers; ++i) {
                real other = held_depth[i];
                truth other_place = held_place[i];
                front |= at < other;
                held_depth[i] = select(front, at, other);
                held_place[i] = (front & place) | (~front & other_place);
                at = select(front, other, at);
                place = (front & other_place) | (~front & place);
            }
            for (int lane = 0; lane < LANES; ++lane)
                if (place[lane] >= 0) rank[offsets[p + lane] + place[lane]] = last[lane]--;
        }
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            for (int i = 0; i < layers; ++i)
                if (held_place[i][lane] >= 0) rank[offsets[p + lane] + held_place[i][lane]] = i;
    }
}

static void kbuffer_ranks_stage(int layers, int pixels, const int32_t *offsets, const void *depth,
                                int32_t *rank) {
    if (layers == 4) kbuffer_ranks_of(4, pixels, offsets, depth, rank);
    else kbuffer_ranks_of(layers, pixels, offsets, depth, rank);
}

/* T of the `layers` nearest, in `through` what they let through, which all others have for T, and
 * in `behind` the sum of alpha of these others. */
static void foremost_stage(int layers, double least, int pixels, const int32_t *offsets,
                           const void *alpha_, int32_t *rank, int32_t *order, void *T_,
                           double *through, double *behind) {
    const SCALAR *alpha = alpha_;
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p) {
        int start = offsets[p], n = offsets[p + 1] - start, front = n < layers ? n : layers;
        for (int i = 0; i < n; ++i) order[rank[start + i]] = start + i;
        for (; front > 0 && alpha[order[front - 1]] < (SCALAR)least; --front)
            rank[order[front - 1]] = layers;
        double left = 1.0, sum = 0.0;
        for (int k = 0; k < front; ++k) {
            T[order[k]] = (SCALAR)left;
            left *= 1.0 - (double)alpha[order[k]];
        }
        for (int k = front; k < n; ++k) {
            T[order[k]] = (SCALAR)left;
            sum += (double)alpha[order[k]];
        }
        through[p] = left;
        behind[p] = sum;
    }
}

/* T of all but the `layers` nearest. */
static void tail_stage(int layers, int pixels, const int32_t *offsets, const int32_t *rank,
                       const double *factor, void *T_) {
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p) {
        SCALAR own = (SCALAR)factor[p];
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) T[i] = rank[i] < layers ? T[i] : own;
    }
}
