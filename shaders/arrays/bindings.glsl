// The numbers by which moit.gpu and the shaders call passes, buffers and textures, written here
// alone: shaders include this, and the build puts what C makes of it into `moit._core.numbers`,
// which
// moit.gpu.bindings reads. A line is a name, an expression and what it is.
#ifndef BINDINGS
#define BINDINGS

#define GROUP 64 // threads in a work group of every pass

// ---- PASS over arrays (arrays/questions.glsl) ----
#define CAPTURE 0       // a pixel a thread: what its fragments leave in it
#define FACTOR 1        // a pixel a thread, DOUBLE: what fragments then ask of it, made once
#define TRANSMITTANCE 2 // a fragment a thread: what reaches it
#define CURVE 3         // a depth of a pixel a thread: what reaches it
#define COMPOSITE 4     // a pixel a thread: its colour over what is behind
#define CHANNELS 5      // a pixel a thread: with transmission, what each channel lets through

// From OWN on a technique's own, a pixel a thread.
#define OWN 10
#define EXTENT OWN          // neural.glsl: the range of depth
#define BLEND_TAIL OWN      // dfa.glsl: what lies behind the foremost
#define MIX (OWN + 1)       // dfa.glsl: all of it
#define NOTHING_KEPT OWN         // anchors.glsl: before the first fragment
#define RATIO_PASS OWN      // moment_transparency.glsl: of what its passes cover
#define SECOND (OWN + 1)    // moment_transparency.glsl, in double: moments of what the first leaves
#define TAKEN_SECOND (OWN + 2) // the same of pixels that blocks take
#define BLOCK_FIRST (OWN + 3)  // arrays/blocks.glsl, in double, a block a thread: its state
#define BLOCK_SECOND (OWN + 4) // the second set of its numbers
#define BLOCK_READ (OWN + 5)   // in double: what pixels read between blocks
#define BLOCK_TOTAL (OWN + 6)  // what they let through, where blocks do not know it
#define EXPAND (OWN + 7)       // of series: what fragments ask of what was read
#define INTEGRATE OWN          // slices.glsl: from slices to what is before each
#define HOLD_MOMENTS (OWN + 1) // arrays/power_bounds.glsl: power moments of the pixel's fragments

// From FRAGMENTS on a technique's own, a fragment a thread.
#define FRAGMENTS 20
#define RANK FRAGMENTS        // arrays/ranks.glsl: from front to back
#define WEIGH FRAGMENTS       // neural.glsl: what reaches it
#define KEY FRAGMENTS         // stochastic.glsl: what it is told apart by
#define COVER (FRAGMENTS + 1) // stochastic.glsl: the samples that it covers
#define DEPOSIT FRAGMENTS     // slices.glsl: whole steps to a pixel's slices
#define HOLD_WITHIN (FRAGMENTS + 1) // slices.glsl: what reaches it, within what moments prove
#define MARK (FRAGMENTS + 2)  // arrays/slices.glsl: which cells have anything
#define KEEP FRAGMENTS        // anchors.glsl: among the greatest keys, perhaps
#define ADD_TO_CELLS (FRAGMENTS + 1) // anchors.glsl: all others
#define WARPED FRAGMENTS      // moment_transparency.glsl: z, in the fragment's precision
#define SEEN (FRAGMENTS + 1)  // moment_transparency.glsl, in double: what the first leaves of it

// From OVER_TRIANGLES on those of meshes/drawn.glsl, which has what they are.
#define OVER_TRIANGLES 40
#define EMPTY OVER_TRIANGLES
#define DRAW_TERMS (OVER_TRIANGLES + 1)
#define DRAW_ORDERED (OVER_TRIANGLES + 2)
#define COLLECT (OVER_TRIANGLES + 3)
#define DRAW_SHADES (OVER_TRIANGLES + 4)
#define RESOLVE (OVER_TRIANGLES + 5)
#define BETWEEN (OVER_TRIANGLES + 6)
#define DRAW_WORDS (OVER_TRIANGLES + 7)

// ORDERED, with PASS DRAW_ORDERED (meshes/extensions.glsl).
#define FETCH 1     // targets are read, too
#define INTERLOCK 2 // other fragments of the pixel wait

// ---- PASS of meshes/listed.frag.glsl ----
#define COUNT 0
#define FILL 1

// ---- PASS of meshes/lists.comp.glsl ----
#define BEGIN 0          // counts, before any fragment
#define SCAN 1           // to sums of what comes before, in runs of RUN numbers, and each run's sum
#define ADD 2            // what comes before a run to its numbers
#define PLACE 3          // where each pixel's next fragment goes
#define SHADE 4          // keys to fragments
#define OCCLUDER_FRAGMENTS 5 // opaque surfaces to fragments
#define BEHIND 6         // what is behind transparent fragments, for arrays/questions.glsl
#define SEAL 7           // what is opaque lets nothing through
#define FARTHEST_OCCLUDER 8  // a block of pixels a thread: the farthest of their occluders,
                         // or of every other block the nearest
#define OCCLUDER_DEPTHS 9    // of opaque surfaces; 0: none
#define RUN_EACH 16      // numbers of a thread of SCAN
#define RUN (GROUP * RUN_EACH)

// ---- PASS of meshes/shadows.comp.glsl ----
#define READ_MAP 0 // from sums to state (and factors, of Fourier opacity)
#define REACH 1    // from transmittance to what of the light reaches each point

// ---- FORM of techniques/weighted.glsl ----
#define FORM_SUM 0     // Meshkin 2007
#define FORM_AVERAGE 1 // Bavoil and Myers 2008
#define FORM_BLENDED 2 // McGuire and Bavoil 2013
#define EQUAL_WEIGHTS 100 // WEIGHT of FORM_BLENDED: that of sums with exact coverage

// ---- Buffers ----
#define OFFSETS 0
#define DEPTHS 1
#define ALPHAS 2
#define EMISSIONS 3
#define COLORS 4
#define STATE 5
#define FACTORS 6
#define TOTALS 7
#define ASKED 8 // what is asked of, or over what
#define ANSWERS 9
#define DOUBLES 10
#define WEIGHTS 11
#define INDICES 12
#define BLOCKS 13
#define NETWORK 14
#define BUFFERS 15 // that passes over arrays may name

// Of passes over triangles and lights, some in the place of one above that these do not have.
#define RUN_NUMBERS 0
#define RUN_SUMS 1
#define RAYS ASKED // the pixel of each fragment
#define KEPT 11
#define REACHED 12
#define TRIANGLES 13
#define PLACES 14
#define KEYS 15
#define SEEN_UNTIL EMISSIONS
#define DEVIATIONS DOUBLES // of thick fragments
#define TILE_FIRSTS 0
#define FRONT_TO_BACK 1
#define POINT_ALPHAS 11
#define MAP_SUMS 13
#define POINT_DEPTHS 14
#define POINT_RAYS 15

// ---- Texture units ----
#define OCCLUDERS 0        // depth of opaque surfaces
#define OCCLUDER_COLORS 1
#define FIRST_TARGET 2 // of targets that are read
#define SMALL_OCCLUDERS 1  // meshes/upsampled.frag.glsl
#define SMALL_SHADE 2
#define SMALL_SECOND 3
#define TEXELS 15           // of images on triangles
#define THEIR_COLOR 0 // meshes/foreign.frag.glsl
#define THEIR_DEPTH 1

// ---- Image units ----
#define BLOCK_OCCLUDERS 0

#endif
