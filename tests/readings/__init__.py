"""The kernels in both readings of their dialect: `c` by a compiler, `glsl` by a GL context."""
