// Opens a text for engines (shaders/engine) to passes: it comes before the dialect, whose names it
// does not know, and its options are uniforms. What others have a name for too is engine_NAME.
// arrays/end_engine.glsl closes it.
uniform float bias;
uniform float beta;
uniform float engine_max_alpha;

#define BIAS bias
#define BETA beta
#define MAX_ALPHA engine_max_alpha
#define absorbance engine_absorbance
#define factors engine_factors
#define warped engine_warped
