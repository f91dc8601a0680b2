/* A pixel of a deep image, cut where samples begin and end: who is in each piece, with none of them
 * mixed. `deep_volumes.c` mixes, and so forgets who was there. */
#include "core/deep_groups.h"
#include "core/elementary.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double within_floats(float depth) {
    return depth > FLT_MAX ? (double)FLT_MAX : depth < -FLT_MAX ? -(double)FLT_MAX : (double)depth;
}

double moit_front_of(const moit_deep *samples, int64_t i) {
    return within_floats(samples->front[i]);
}

double moit_back_of(const moit_deep *samples, int64_t i) {
    double front = moit_front_of(samples, i);
    return samples->back ? fmax(front, within_floats(samples->back[i])) : front;
}

double moit_alpha_of(const moit_deep *samples, int64_t i, int k) {
    double alpha = (double)samples->alpha[k * samples->offsets[samples->pixels] + i];
    return alpha < 0.0 ? 0.0 : alpha > 1.0 ? 1.0 : alpha;
}

double moit_part_of(double alpha, double share) {
    return share == 1.0 || alpha == 1.0 ? alpha : -moit_expm1(share * moit_log1p(-alpha));
}

double moit_light_of_part(double alpha, double share) {
    return alpha > 0.0 ? moit_part_of(alpha, share) / alpha : share;
}

void moit_free_grouping(moit_grouping *g) {
    free(g->groups);
    free(g->members);
    free(g->depths);
    free(g->order);
    free(g->active);
    *g = (moit_grouping){0};
}

bool moit_grow(void *array, int64_t *room, int64_t wanted, size_t size) {
    if (wanted <= *room) return true;
    int64_t more = wanted > 2 * *room ? wanted : 2 * *room;
    void *grown = realloc(*(void **)array, (size_t)more * size);
    if (!grown) return false;
    *(void **)array = grown;
    *room = more;
    return true;
}

static bool grow_samples(moit_grouping *g, int64_t samples) {
    if (samples <= g->samples_room) return true;
    int64_t room = 0, more = samples > 2 * g->samples_room ? samples : 2 * g->samples_room;
    /* Each array starts from no room, so that all have grown or the call has failed. */
    if (!moit_grow(&g->depths, &room, 2 * more, sizeof *g->depths)) return false;
    room = 0;
    if (!moit_grow(&g->order, &room, more, sizeof *g->order)) return false;
    room = 0;
    if (!moit_grow(&g->active, &room, more, sizeof *g->active)) return false;
    g->samples_room = more;
    return true;
}

/* Sorts indices by front, surfaces first, then by index: a heap, which needs no memory. */
static bool comes_before(const moit_deep *s, int64_t a, int64_t b) {
    double front = moit_front_of(s, a), other = moit_front_of(s, b);
    if (front != other) return front < other;
    bool volume = moit_back_of(s, a) > front, also = moit_back_of(s, b) > other;
    return volume != also ? also : a < b;
}

static void sift(const moit_deep *s, int64_t *order, int64_t root, int64_t count) {
    for (int64_t child; (child = 2 * root + 1) < count; root = child) {
        if (child + 1 < count && comes_before(s, order[child], order[child + 1])) ++child;
        if (!comes_before(s, order[root], order[child])) return;
        int64_t other = order[root];
        order[root] = order[child];
        order[child] = other;
    }
}

static void sort_samples(const moit_deep *s, int64_t *order, int64_t count) {
    if (count <= 32) {
        for (int64_t i = 1; i < count; ++i) {
            int64_t one = order[i], at = i;
            for (; at > 0 && comes_before(s, one, order[at - 1]); --at) order[at] = order[at - 1];
            order[at] = one;
        }
        return;
    }
    for (int64_t root = count / 2; root-- > 0;) sift(s, order, root, count);
    for (int64_t end = count; end-- > 1;) {
        int64_t first = order[0];
        order[0] = order[end];
        order[end] = first;
        sift(s, order, 0, end);
    }
}

static int by_number(const void *left, const void *right) {
    double a = *(const double *)left, b = *(const double *)right;
    return (a > b) - (a < b);
}

/* A group of no members yet; NULL where there is no memory. */
static moit_group *new_group(moit_grouping *g, double near, double far, int64_t members) {
    if (!moit_grow(&g->groups, &g->room, g->count + 1, sizeof *g->groups)) return NULL;
    int64_t begin = g->count ? g->groups[g->count - 1].end : 0;
    if (!moit_grow(&g->members, &g->member_room, begin + members, sizeof *g->members)) return NULL;
    moit_group *group = &g->groups[g->count++];
    *group = (moit_group){near, far, begin, begin};
    return group;
}

moit_status moit_group_samples(moit_grouping *g, const moit_deep *s, int64_t pixel) {
    int64_t first = s->offsets[pixel], samples = s->offsets[pixel + 1] - first;
    g->count = 0;
    if (!grow_samples(g, samples)) return MOIT_NO_MEMORY;
    int64_t ends = 0, next = 0, active = 0;
    for (int64_t i = 0; i < samples; ++i) {
        double front = moit_front_of(s, first + i), back = moit_back_of(s, first + i);
        g->order[i] = first + i;
        g->depths[ends++] = front;
        if (back > front) g->depths[ends++] = back;
    }
    sort_samples(s, g->order, samples);
    qsort(g->depths, (size_t)ends, sizeof *g->depths, by_number);
    for (int64_t d = 0; d < ends; ++d) {
        double depth = g->depths[d];
        if (d && depth == g->depths[d - 1]) continue;
        int64_t left = 0;
        for (int64_t i = 0; i < active; ++i)
            if (moit_back_of(s, g->active[i]) > depth) g->active[left++] = g->active[i];
        active = left;
        moit_group *surfaces = NULL;
        for (; next < samples && moit_front_of(s, g->order[next]) == depth; ++next) {
            int64_t i = g->order[next];
            if (moit_back_of(s, i) > depth) {
                g->active[active++] = i;
                continue;
            }
            if (!surfaces && !(surfaces = new_group(g, depth, depth, samples)))
                return MOIT_NO_MEMORY;
            g->members[surfaces->end++] = (moit_member){i, 1.0};
        }
        if (!active) continue;
        int64_t after = d + 1; /* there is one: the volumes' ends */
        while (g->depths[after] == depth) ++after;
        double far = g->depths[after];
        moit_group *volumes = new_group(g, depth, far, active);
        if (!volumes) return MOIT_NO_MEMORY;
        for (int64_t k = 0; k < active; ++k) {
            int64_t i = g->active[k];
            double front = moit_front_of(s, i), back = moit_back_of(s, i);
            g->members[volumes->end++] = (moit_member){i, (far - depth) / (back - front)};
        }
    }
    return MOIT_OK;
}
