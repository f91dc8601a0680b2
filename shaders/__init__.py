"""The GLSL sources."""
