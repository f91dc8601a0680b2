// What passes over triangles need beyond OpenGL 4.5: where a pixel's fragments read and write what
// it keeps one after the other, the order of triangles has to hold.
//
//   ORDERED   with PASS DRAW_ORDERED, FETCH or INTERLOCK
#include "arrays/bindings.glsl"
#if PASS == DRAW_ORDERED
#if ORDERED == FETCH
#extension GL_EXT_shader_framebuffer_fetch : require
#else
#extension GL_ARB_fragment_shader_interlock : require
#endif
#endif
