/* What went wrong, in words: the message of each thread, and the errors of EGL and GL. */
#include "driver.h"

#include <stdarg.h>
#include <stdio.h>

static _Thread_local char message[MOIT_GL_MESSAGE];

const char *moit_gl_message(void) { return message; }

moit_gl_status fail(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    return MOIT_GL_FAILED;
}

moit_gl_status bad_shader(const char *log) {
    snprintf(message, sizeof message, "%s", log);
    return MOIT_GL_BAD_SHADER;
}

const char *egl_error_words(EGLint error) {
    switch (error) {
    case EGL_NOT_INITIALIZED: return "its display was terminated by somebody else";
    case EGL_BAD_ACCESS: return "it is current in another thread; leave it there first";
    case EGL_BAD_ALLOC: return "memory is exhausted";
    case EGL_BAD_CONTEXT: return "it was destroyed by somebody else";
    case EGL_CONTEXT_LOST: return "it was lost, by a reset of the GPU, say; open a new device";
    default: return "EGL refuses";
    }
}

const char *gl_error_words(GLenum error) {
    switch (error) {
    case GL_INVALID_ENUM: return "a name that GL does not know (invalid enum)";
    case GL_INVALID_VALUE: return "a number out of range (invalid value)";
    case GL_INVALID_OPERATION: return "not allowed in this state (invalid operation)";
    case GL_OUT_OF_MEMORY:
        return "the memory of the device is exhausted; use smaller images or "
               "fewer fragments, or free what is not needed";
    case GL_INVALID_FRAMEBUFFER_OPERATION: return "these targets cannot be drawn to together";
    case GL_CONTEXT_LOST:
        return "the context was lost, by a reset of the GPU, say; open a new "
               "device";
    default: return "an error of GL";
    }
}

void forget_errors(moit_gl *gl) {
    for (int i = 0; i < 64 && gl->f.GetError(); ++i) {
    }
}
