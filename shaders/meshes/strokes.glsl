// Parts of strokes on the screen, as csrc/core/stroke_shapes.c has them.
#include "arrays/bindings.glsl"
#include "kernels/options.h"
#include "meshes/picture.glsl"

struct screen_stroke { // moit_screen_stroke
    double x[2];
    double y[2];
    double radius[2];
    double along[2];
    double apart;
    double lean;
    double upright;
    double at[6];
    double size[2];
    double outside[2];
    double over;
    double per_over;
    double start;
    double beyond;
    float color[6];
    float opacity[2];
    float alpha;
    int holder;
    int everywhere;
    int left; // pixels
    int top;
    int right;
    int bottom;
    int stroke;
    int place;
    int opens;
    int closes;
    int other;
    int how;
    int opaque;
};
layout(std430, binding = TRIANGLES) readonly restrict buffer Strokes { screen_stroke strokes[]; };

pixel_box pixels_of(int i) {
    return pixel_box(ivec2(strokes[i].left, strokes[i].top),
                     ivec2(strokes[i].right, strokes[i].bottom));
}
