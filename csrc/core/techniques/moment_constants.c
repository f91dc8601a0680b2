/* Constants of the families of moments: supplement of Muenstermann et al. 2018. */
#include "core/elementary.h"
#include "core/techniques/table.h"

#include <math.h>

/* The vectors are float32, as the published shaders hold them: where eight moments are all but
 * degenerate, their rounding shows in the seventh digit of the transmittance. */
#define SINGLE(x) (double)(x##f)
static const moit_moment_constants power[2][4] = {
    {
        {.published_bias = 5e-7,
         .default_bias = {5e-8, 1e-15},
         .covering_bias = {5e-7, 1e-14},
         .safe = {0, SINGLE(.375)}},
        {.published_bias = 5e-7,
         .default_bias = {5e-8, 1e-15},
         .covering_bias = {5e-7, 1e-14},
         .safe = {0, SINGLE(.375), 0, SINGLE(.375)}},
        {.published_bias = 5e-6,
         .default_bias = {5e-8, 1e-15},
         .covering_bias = {5e-6, 1e-13},
         .safe = {0, SINGLE(.48), 0, SINGLE(.451), 0, SINGLE(.45)}},
        {.published_bias = 5e-5,
         .default_bias = {1.5e-7, 1e-14},
         .covering_bias = {5e-5, 1e-12},
         .safe = {0, SINGLE(.75), 0, SINGLE(.67666666666666664), 0, SINGLE(.63), 0,
                  SINGLE(.60030303030303034)}},
    },
    {
        {.published_bias = 6e-5}, /* two words are not stored */
        {.published_bias = 6e-5,
         .default_bias = {6e-5, 6e-5},
         .covering_bias = {6.8e-5, 6.8e-5}, /* 6e-5 does not do for hair */
         .safe = {0, SINGLE(.628), 0, SINGLE(.628)}},
        {.published_bias = 6e-4,
         .default_bias = {6e-4, 6e-4},
         .covering_bias = {6e-4, 6e-4},
         .safe = {0, SINGLE(.5566), 0, SINGLE(.489), 0, SINGLE(.47869382)}},
        {.published_bias = 2.5e-3,
         .default_bias = {2.5e-3, 2.5e-3},
         .covering_bias = {2.5e-3, 2.5e-3},
         .safe = {0, SINGLE(.42474916387959866), 0, SINGLE(.22407802675585284), 0,
                  SINGLE(.15369230769230768), 0, SINGLE(.12900440529089119)}},
    }};

/* Half floats: by whether the range is the pixel's own, and count. A lesser bias than covers
 * rounding, with pivots that rounding may have made set to what it may, was nearer the truth than
 * one that does, most of all for few surfaces. */
#define HALVES(bias, covering, ...) \
    { \
        .published_bias = bias, .default_bias = {bias, bias}, \
        .covering_bias = {covering, covering}, .safe = { \
            __VA_ARGS__ \
        } \
    }
static const moit_moment_constants halves[2][4] = {
    {
        HALVES(1e-4, 3e-4, 0, SINGLE(.375)),
        HALVES(2e-4, 3e-4, 0, SINGLE(.375), 0, SINGLE(.375)),
        HALVES(5e-4, 1e-3, 0, SINGLE(.48), 0, SINGLE(.451), 0, SINGLE(.45)),
        HALVES(1e-3, 3e-3, 0, SINGLE(.75), 0, SINGLE(.67666666666666664), 0, SINGLE(.63), 0,
               SINGLE(.60030303030303034)),
    },
    {
        HALVES(3e-4, 6e-4, 0, SINGLE(.375)),
        HALVES(4e-4, 6e-4, 0, SINGLE(.375), 0, SINGLE(.375)),
        HALVES(1e-3, 2e-3, 0, SINGLE(.48), 0, SINGLE(.451), 0, SINGLE(.45)),
        HALVES(6e-3, 6e-3, 0, SINGLE(.75), 0, SINGLE(.67666666666666664), 0, SINGLE(.63), 0,
               SINGLE(.60030303030303034)),
    }};
#undef HALVES

static int power_numbers(int count) { return count; }
static int power_rule_size(int count) { return MOIT_RULE_SIZE(count); }
static const moit_moment_constants *power_constants(const moit_technique *technique) {
    if (technique->moments.halves)
        return &halves[technique->range_per_pixel][technique->count / 2 - 1];
    return &power[technique->moments.bits == 16][technique->count / 2 - 1];
}

const moit_moment_family moit_power_moments = {
    .stages = MOIT_POWER,
    .numbers = power_numbers,
    .rule_size = power_rule_size,
    .constants = power_constants,
};

/* Bounded neural transmittance in float32: with less, what rounding makes of a few close surfaces
 * would leave the bounds of their moments as they were (four moments: in no case found). */
static const moit_moment_constants *bounded_constants(const moit_technique *technique) {
    static const moit_moment_constants known[2] = {
        {.published_bias = 5e-7,
         .default_bias = {2.5e-7, 1e-15},
         .covering_bias = {5e-7, 1e-14},
         .safe = {0, SINGLE(.375), 0, SINGLE(.375)}},
        {.published_bias = 5e-6,
         .default_bias = {2.5e-7, 1e-15},
         .covering_bias = {5e-6, 1e-13},
         .safe = {0, SINGLE(.48), 0, SINGLE(.451), 0, SINGLE(.45)}},
    };
    if (technique->moments.halves) return power_constants(technique);
    return &known[technique->count / 2 - 2];
}

const moit_moment_family moit_bounded_moments = {
    .stages = MOIT_POWER,
    .numbers = power_numbers,
    .rule_size = power_rule_size,
    .constants = bounded_constants,
    .transmittance = moit_bounded_transmittance,
};

/* Moment Transparency: the supplement, 1.1, for floats (its shaders hold the bias in float32), and
 * for what nodes are found from; Peters and Klein 2015 for words of depths in [0, 1], and as power
 * moments' for [-1, 1]. */
static const moit_moment_constants *mt_constants(const moit_technique *technique) {
    static const moit_moment_constants floats = {.published_bias = SINGLE(3e-7),
                                                 .default_bias = {SINGLE(3e-7), SINGLE(3e-7)},
                                                 .covering_bias = {3e-7, 1e-14},
                                                 .safe = {0, .375, 0, .375}},
                                       words = {.published_bias = 3e-5,
                                                .default_bias = {3e-5, 3e-5},
                                                .covering_bias = {3e-5, 3e-5},
                                                .safe = {.5, .5, .5, .5}},
                                       symmetric_words = {
                                           .published_bias = 6e-5,
                                           .default_bias = {6e-5, 6e-5},
                                           .covering_bias = {6e-5, 6e-5},
                                           .safe = {0, SINGLE(.628), 0, SINGLE(.628)}};
    if (technique->transparency.storage != MOIT_STORAGE_UNORM16) return &floats;
    return technique->transparency.symmetric ? &symmetric_words : &words;
}

const moit_moment_family moit_mt_moments = {
    .stages = MOIT_POWER,
    .numbers = power_numbers,
    .rule_size = power_rule_size,
    .constants = mt_constants,
    .state = moit_mt_state,
    .transmittance = moit_mt_transmittance,
};

static const moit_moment_constants trigonometric[2][3] = {
    {
        {.published_bias = 4e-7, .default_bias = {4e-8, 1e-15}, .covering_bias = {4e-7, 1e-14}},
        {.published_bias = 8e-7, .default_bias = {8e-8, 1e-15}, .covering_bias = {8e-7, 1e-14}},
        {.published_bias = 1.5e-6,
         .default_bias = {1.5e-7, 1e-15},
         .covering_bias = {1.5e-6, 1e-14}},
    },
    {
        {.published_bias = 4e-4, .default_bias = {4e-4, 4e-4}, .covering_bias = {4e-4, 4e-4}},
        {.published_bias = 6.5e-4,
         .default_bias = {6.5e-4, 6.5e-4},
         .covering_bias = {6.5e-4, 6.5e-4}},
        {.published_bias = 8.5e-4,
         .default_bias = {8.5e-4, 8.5e-4},
         .covering_bias = {8.5e-4, 8.5e-4}},
    }};

static int trigonometric_numbers(int count) { return 2 * count; }
static int trigonometric_rule_size(int count) { return MOIT_CIRCLE_RULE_SIZE(count); }
static const moit_moment_constants *trigonometric_constants(const moit_technique *technique) {
    return &trigonometric[technique->moments.bits == 16][technique->count - 2];
}

const moit_moment_family moit_trigonometric_moments = {
    .stages = MOIT_TRIGONOMETRIC,
    .numbers = trigonometric_numbers,
    .rule_size = trigonometric_rule_size,
    .constants = trigonometric_constants,
};

/* Two moments are not stored in words, nor what is stored in half floats. */
bool moit_power_fits(const moit_technique *technique) {
    return technique->moments.bits != 16 || (technique->count > 2 && !technique->moments.halves);
}

bool moit_wrapping_zone_fits(const moit_technique *technique) {
    return technique->moments.wrapping_zone >= 0.0
           && technique->moments.wrapping_zone <= MOIT_MOST_WRAPPING_ZONE;
}

/* Where there is no zone, one too small for any node to lie in. Powers have no use for one. Sines
 * and cosines to the last bit take as long as a hundred fragments: it is asked once a call. */
moit_wrapping_zone moit_wrapping_zone_of(const moit_technique *technique) {
    int kind = technique->kind == MOIT_FRONT ? (int)technique->front.tail : (int)technique->kind;
    if (kind != MOIT_TRIGONOMETRIC_MOMENTS) return (moit_wrapping_zone){0};
    const double pi = 3.14159265358979323846;
    double theta = technique->moments.wrapping_zone, edge = fmax(moit_tan(0.25 * theta), 1e-30);
    moit_wrapping_zone zone = {
        .turns = 0.25 - theta / (8.0 * pi),
        .edge = edge,
        .scale = (1.0 + edge * edge) / (2.0 * edge * (1.0 + 2.0 * edge - edge * edge)),
    };
    for (int k = 0; k < 4; ++k) {
        double turned = (pi - 0.5 * theta) * (k + 1);
        zone.middle[2 * k] = moit_cos(turned);
        zone.middle[2 * k + 1] = moit_sin(turned);
    }
    return zone;
}
