// The passes over a picture's triangles, which go by
//
//   numbers, NUMBERS_DRAWN of them: what targets hold of a pixel, or terms for them
//
// A technique's file has, of these, what it needs:
//
//   void set_terms(surface s, uint p)  DRAW_TERMS: numbers that s adds
//   void take(surface s)            DRAW_ORDERED: numbers after s has come
//   void change_words(surface s, uint p)   DRAW_WORDS: changes words of p, by atomics, for s
//   void collect(uint p)            COLLECT: from numbers what CAPTURE leaves
//   void load_ray(uint p), number in_front(uint p, surface s)   DRAW_SHADES: what s counts
//   SHADES_SECOND and number second_of(surface s)               for the second target, if there is
//                                                               one
//   RESOLVES_DRAWN and contribution resolved_drawn(uint p, vec4 held, vec4 second)
//                                   RESOLVE: where what was shaded is not yet it; it sets the total
//
//   TARGETS             how many there are for numbers; FROM0 .. FROM7: the first number of each,
//                       CHANNELS0 .. CHANNELS7: how many it has; WORDS0 .. WORDS7: true where
//                       they are words of 16 bits, which the target holds as shares of 65,535
//   void after_round(uint p)            BETWEEN: what a second round needs of the first
//
//   EMPTY               a pixel a thread: numbers before any fragment, for INTERLOCK
//   DRAW_TERMS          triangles; blend: add
//   DRAW_ORDERED        triangles; ORDERED in meshes/extensions.glsl
//   DRAW_WORDS          triangles, to no target
//   COLLECT, BETWEEN    a pixel a thread
//   DRAW_SHADES         triangles; blend: add colour and opacity times what they count
//   RESOLVE             a pixel a thread: its colour over opaque surfaces; UNSHADED: of what has
//                       no DRAW_SHADES

#if DRAWN
#include "meshes/transparent.glsl"

uint pixel_number(ivec2 pixel) {
    return uint(pixel.y * (block_side > 1 ? blocks_there.x : picture.x) + pixel.x);
}

// The fragment, and whether there is one that is transparent.
bool drawn_surface(ivec2 pixel, bool colored, out surface s) {
    pixel_of_triangle c = seen_at(pixel);
    float alpha = alpha_of(triangle, c.at);
    s = surface(0u, number(float(c.at.z)), number(alpha));
    bool there = c.there && alpha != 1.0;
    if (there && colored) drawn_color = lit_color(triangle, c.at, asked_pixel(pixel), 0u);
    return there;
}
#else
uniform int width; // of the picture
ivec2 place_of(uint p) { return ivec2(int(p) % width, int(p) / width); }
#endif

#if PASS == DRAW_SHADES
layout(location = 0) out vec4 shade;
#ifdef SHADES_SECOND
layout(location = 1) out vec4 second;
#endif
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface s;
    bool there = drawn_surface(pixel, true, s);
    if (there) {
        uint p = pixel_number(pixel);
        load_ray(p);
        float counts = float(s.alpha * in_front(p, s));
        shade = vec4(drawn_color * counts, counts);
#ifdef SHADES_SECOND
        second = vec4(float(second_of(s)));
#endif
    }
    if (!there) discard; // last: what comes behind takes llvmpipe 50 s to compile, not 0.2
}

#elif PASS == DRAW_WORDS
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface s;
    if (drawn_surface(pixel, false, s)) change_words(s, pixel_number(pixel));
}

#elif PASS == DRAW_TERMS || PASS == DRAW_ORDERED || PASS == COLLECT || PASS == EMPTY
#if PASS == COLLECT || PASS == EMPTY || (PASS == DRAW_ORDERED && ORDERED == INTERLOCK)
#if PASS == EMPTY || ORDERED == INTERLOCK
layout(std430, binding = KEPT) coherent restrict buffer Kept { float kept[]; };
#endif
#endif

#if PASS == EMPTY
uniform float empty[NUMBERS_DRAWN];
void main() {
    uint p = thread();
    if (p >= count) return;
    for (int i = 0; i < NUMBERS_DRAWN; ++i) kept[NUMBERS_DRAWN * p + i] = empty[i];
}

#elif ORDERED == INTERLOCK
#if PASS == DRAW_ORDERED
layout(pixel_interlock_ordered) in;
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint p = pixel_number(pixel);
    surface s;
    bool there = drawn_surface(pixel, COLORED == 1, s);
    beginInvocationInterlockARB();
    if (there) {
        for (int i = 0; i < NUMBERS_DRAWN; ++i) numbers[i] = kept[NUMBERS_DRAWN * p + i];
        take(s);
        for (int i = 0; i < NUMBERS_DRAWN; ++i) kept[NUMBERS_DRAWN * p + i] = numbers[i];
    }
    endInvocationInterlockARB();
}
#else
void main() {
    uint p = thread();
    if (p >= count) return;
    for (int i = 0; i < NUMBERS_DRAWN; ++i) numbers[i] = kept[NUMBERS_DRAWN * p + i];
    collect(p);
}
#endif

#else // targets
#if PASS == DRAW_TERMS
#define TARGET out vec4
#elif PASS == DRAW_ORDERED
#define TARGET inout vec4
#else
#define TARGET uniform sampler2D
#endif
#if PASS == COLLECT
#define AT(number_of_target) layout(binding = FIRST_TARGET + number_of_target)
#define HELD(target, p) texelFetch(target, place_of(p), 0)
#else
#define AT(number_of_target) layout(location = number_of_target)
#define HELD(target, p) target
#endif
AT(0) TARGET target0;
#if TARGETS > 1
AT(1) TARGET target1;
#endif
#if TARGETS > 2
AT(2) TARGET target2;
#endif
#if TARGETS > 3
AT(3) TARGET target3;
#endif
#if TARGETS > 4
AT(4) TARGET target4;
#endif
#if TARGETS > 5
AT(5) TARGET target5;
#endif
#if TARGETS > 6
AT(6) TARGET target6;
#endif
#if TARGETS > 7
AT(7) TARGET target7;
#endif

#if PASS != DRAW_TERMS
#define READ(target, from, channels, words) \
    { \
        vec4 held = HELD(target, p); \
        if (words) held = floor(held * 65535.0 + 0.5); \
        for (int c = 0; c < channels; ++c) numbers[from + c] = held[c]; \
    }
void read_targets(uint p) {
    READ(target0, FROM0, CHANNELS0, WORDS0)
#if TARGETS > 1
    READ(target1, FROM1, CHANNELS1, WORDS1)
#endif
#if TARGETS > 2
    READ(target2, FROM2, CHANNELS2, WORDS2)
#endif
#if TARGETS > 3
    READ(target3, FROM3, CHANNELS3, WORDS3)
#endif
#if TARGETS > 4
    READ(target4, FROM4, CHANNELS4, WORDS4)
#endif
#if TARGETS > 5
    READ(target5, FROM5, CHANNELS5, WORDS5)
#endif
#if TARGETS > 6
    READ(target6, FROM6, CHANNELS6, WORDS6)
#endif
#if TARGETS > 7
    READ(target7, FROM7, CHANNELS7, WORDS7)
#endif
}
#endif

#if PASS != COLLECT
#define WRITE(target, from, channels, words) \
    { \
        vec4 held = vec4(0.0); \
        for (int c = 0; c < channels; ++c) held[c] = float(numbers[from + c]); \
        target = words ? held / 65535.0 : held; \
    }
void write_targets() {
    WRITE(target0, FROM0, CHANNELS0, WORDS0)
#if TARGETS > 1
    WRITE(target1, FROM1, CHANNELS1, WORDS1)
#endif
#if TARGETS > 2
    WRITE(target2, FROM2, CHANNELS2, WORDS2)
#endif
#if TARGETS > 3
    WRITE(target3, FROM3, CHANNELS3, WORDS3)
#endif
#if TARGETS > 4
    WRITE(target4, FROM4, CHANNELS4, WORDS4)
#endif
#if TARGETS > 5
    WRITE(target5, FROM5, CHANNELS5, WORDS5)
#endif
#if TARGETS > 6
    WRITE(target6, FROM6, CHANNELS6, WORDS6)
#endif
#if TARGETS > 7
    WRITE(target7, FROM7, CHANNELS7, WORDS7)
#endif
}
#endif

void main() {
#if PASS == COLLECT
    uint p = thread();
    if (p >= count) return;
    read_targets(p);
    collect(p);
#else
    surface s;
    bool there = drawn_surface(ivec2(gl_FragCoord.xy), COLORED == 1, s);
    if (there) {
#if PASS == DRAW_TERMS
        set_terms(s, pixel_number(ivec2(gl_FragCoord.xy)));
#else
        read_targets(0u);
        take(s);
#endif
        write_targets();
    }
    if (!there) discard;
#endif
}
#endif

#elif PASS == BETWEEN
void main() {
    uint p = thread();
    if (p < count) after_round(p);
}

#elif PASS == RESOLVE
layout(binding = OCCLUDER_COLORS) uniform sampler2D occluder_colors;
layout(binding = FIRST_TARGET) uniform sampler2D shaded;
layout(binding = FIRST_TARGET + 1) uniform sampler2D seconds;
layout(std430, binding = ANSWERS) writeonly restrict buffer Answers { SCALAR answers[]; };
uniform uint scaling; // as in arrays/questions.glsl
uniform uint marks;
uniform uint marks_overflows; // the same; 2: targets are half floats, too

void main() {
    uint p = thread();
    if (p >= count) return;
    vec4 held = texelFetch(shaded, place_of(p), 0), occluder = texelFetch(occluder_colors, place_of(p), 0);
    bool over = false;
#ifndef UNSHADED
    if (marks_overflows == 2u) { // beyond its largest number a target is infinite
        for (int k = 0; k < 4; ++k) {
            float most = float(MOST_HALF);
            over = over || !(held[k] > -most && held[k] < most);
            held[k] = held[k] < most ? held[k] : most;
            held[k] = held[k] > -most ? held[k] : -most;
        }
    }
#endif
    precise contribution sum;
#ifdef RESOLVES_DRAWN
    sum = resolved_drawn(p, held, texelFetch(seconds, place_of(p), 0));
#else
    for (int c = 0; c < 3; ++c) sum.color[c] = double(held[c]);
    sum.covers = double(held.a);
#endif
    precise double scale = 1.0, total = totals[4u * p];
    precise double shown = 1.0 - total, excess = sum.covers - shown;
    if (scaling == SCALE_ALL && sum.covers > 0.0) scale = shown / sum.covers;
    if (scaling == SCALE_EXCESS && excess > 0.000030517578125) scale = shown / sum.covers;
    for (int c = 0; c < 3; ++c)
        answers[4u * p + c] = SCALAR(total * double(occluder[c]) + scale * sum.color[c]);
    // an opaque surface lets nothing through
    // (and totals that are joined from several sizes may round to more than 1)
    SCALAR opacity = occluder.a > 0.0 ? SCALAR(1.0) : SCALAR(max(1.0 - total, 0.0));
#ifdef OVERFLOWS
    over = over || (marks_overflows > 0u && overflowed(p));
#endif
    bool lost = scaling == SCALE_ALL && sum.covers == 0.0 && total < 0.5;
    if (marks > 0u && lost) opacity = SCALAR(LOOK_AGAIN);
    answers[4u * p + 3u] = over ? -opacity : opacity;
}
#endif
