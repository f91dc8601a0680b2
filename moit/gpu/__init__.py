"""The techniques as OpenGL passes; without EGL nothing here is needed and all else works."""
