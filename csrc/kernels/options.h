// Numbers that C, GLSL and Python know techniques' options and limits by. They are written here
// alone: moit.h names some of them for C, and Python has all from `moit._core.numbers`, whose names
// of options are the ends of these, in this order.
#ifndef OPTIONS_H
#define OPTIONS_H

// Weights: equations are in weights.h.
#define WEIGHT_BLOG 0
#define WEIGHT_EQ7 1
#define WEIGHT_EQ8 2
#define WEIGHT_EQ9 3
#define WEIGHT_EQ10 4
#define WEIGHT_PHENOMENOLOGICAL 5
#define WEIGHT_GIVEN 6 // by an array

// How depth becomes z,
#define WARP_LOG 0
#define WARP_LINEAR 1
#define WARP_NONE 2

// and by which steps.
#define STEPS_NONE 0  // z is depth
#define STEPS_LEVEL 1 // all depths are one: the middle is as good as any
#define STEPS_LINEAR 2
#define STEPS_LOG 3
#define STEPS_EXTREME 4 // the core alone does it

// What Moment Transparency reads its moments from.
#define STORAGE_FLOAT32 0 // as gathered
#define STORAGE_NLQM 1    // four words of 16 bits: nodes, weight, offset; the total a half
#define STORAGE_UNORM16 2 // four words of 16 bits: moments; the total a half

// What has a table of its own of where slices stand.
#define TABLE_IMAGE 0
#define TABLE_TILE 1
#define TABLE_PIXEL 2

// What becomes of colours whose weights do not sum to what is covered.
#define SCALE_NOT 0
#define SCALE_ALL 1    // they are scaled so that they do (MBOIT eq. 2)
#define SCALE_EXCESS 2 // those whose weights sum to more, by more than 2^-15, are

// Weights whose sum is below 2 to the power of minus these have underflowed, in numbers of one
// precision; a pixel of such is left for another look, which its alpha says: no picture has it.
#define WEIGHTS_LOST_SINGLE 100
#define WEIGHTS_LOST_DOUBLE 990
#define LOOK_AGAIN 2

// How an image is read between its texels,
#define FILTER_NEAREST 0
#define FILTER_BILINEAR 1
#define FILTER_MIPMAP 2

// and beyond its edges.
#define WRAP_REPEAT 0
#define WRAP_MIRROR 1
#define WRAP_CLAMP 2

// The most that there may be.
#define MOST_LAYERS 32
#define MOST_SAMPLES 64 // of a pixel
#define MOST_KEPT 16    // fragments that a pixel of anchors keeps
#define MOST_CELLS 16   // of its extent
#define MOST_LIGHTS 8
#define MOST_SIDE 16384        // pixels of a picture's side, texels of an image's
#define MOST_TEXTURE_LEVELS 15 // of which the last has a single texel

// The side of tiles that splats are listed by, in pixels.
#define SPLAT_TILE 16

// How parts of strokes are drawn: balls, else discs; sizes are pixels, else units; light falls on
// them; by samples, else by the middles of pixels.
#define STROKE_SOLID 1
#define STROKE_PIXELS 2
#define STROKE_LIT 4
#define STROKE_SAMPLED 8

#endif
