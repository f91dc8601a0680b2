// What passes over triangles need beyond OpenGL 4.5: where a pixel's fragments read and write what
// it keeps one after the other, the order of triangles has to hold.
//
//   ORDERED   with PASS DRAW_ORDERED, one of these
#define FETCH 1     // targets are read, too
#define INTERLOCK 2 // other fragments of the pixel wait
#if PASS == 42      // DRAW_ORDERED
#if ORDERED == FETCH
#extension GL_EXT_shader_framebuffer_fetch : require
#else
#extension GL_ARB_fragment_shader_interlock : require
#endif
#endif
