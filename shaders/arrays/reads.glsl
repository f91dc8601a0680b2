// Whether a pass asks what reaches fragments, of what is kept of their pixel.
#include "arrays/bindings.glsl"
#define READS (PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE || PASS == DRAW_SHADES)
