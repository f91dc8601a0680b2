/* Buffers that passes read and write. */
#include "driver.h"

#include <stdlib.h>

enum { LEAST_ROOM = 16 }; /* GL has no empty buffers; we have */

moit_gl_status moit_gl_make_buffer(moit_gl *gl, int64_t size, const void *data, int64_t given,
                                   moit_gl_buffer **made) {
    *made = NULL;
    if (size < 0 || given < 0 || given > size)
        return fail("size: expected at least %lld, got %lld", (long long)(given > 0 ? given : 0),
                    (long long)size);
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    moit_gl_buffer *buffer = calloc(1, sizeof *buffer);
    if (!buffer) return MOIT_GL_NO_MEMORY;
    GLuint name = 0;
    gl->f.CreateBuffers(1, &name);
    int64_t room = size < LEAST_ROOM ? LEAST_ROOM : size;
    bool whole = data && given == room;
    gl->f.NamedBufferStorage(name, (GLsizeiptr)room, whole ? data : NULL, GL_DYNAMIC_STORAGE_BIT);
    if (data && given && !whole) gl->f.NamedBufferSubData(name, 0, (GLsizeiptr)given, data);
    status = end_gl(gl, "making a buffer");
    if (status != MOIT_GL_OK) {
        delete_name(gl, A_BUFFER, name);
        free(buffer);
        return status;
    }
    buffer->size = size;
    enlist(gl, &buffer->object, A_BUFFER, name);
    *made = buffer;
    return MOIT_GL_OK;
}

void moit_gl_free_buffer(moit_gl_buffer *buffer) {
    if (!buffer) return;
    discard(&buffer->object, true);
    free(buffer);
}

int64_t moit_gl_buffer_size(const moit_gl_buffer *buffer) { return buffer->size; }
unsigned moit_gl_buffer_name(const moit_gl_buffer *buffer) { return buffer->object.name; }

static moit_gl_status check_range(const moit_gl_buffer *buffer, int64_t offset, int64_t size) {
    if (offset >= 0 && size >= 0 && offset <= buffer->size && size <= buffer->size - offset)
        return MOIT_GL_OK;
    return fail("a buffer of %lld bytes has no %lld bytes from %lld on", (long long)buffer->size,
                (long long)size, (long long)offset);
}

moit_gl_status moit_gl_write_buffer(moit_gl_buffer *buffer, int64_t offset, int64_t size,
                                    const void *data) {
    moit_gl *gl = buffer->object.gl;
    moit_gl_status status = begin_gl(gl);
    if (status == MOIT_GL_OK) status = check_range(buffer, offset, size);
    if (status != MOIT_GL_OK || !size) return status;
    gl->f.NamedBufferSubData(buffer->object.name, (GLintptr)offset, (GLsizeiptr)size, data);
    return end_gl(gl, "writing a buffer");
}

moit_gl_status moit_gl_read_buffer(moit_gl_buffer *buffer, int64_t offset, int64_t size,
                                   void *data) {
    moit_gl *gl = buffer->object.gl;
    moit_gl_status status = begin_gl(gl);
    if (status == MOIT_GL_OK) status = check_range(buffer, offset, size);
    if (status != MOIT_GL_OK || !size) return status;
    gl->f.GetNamedBufferSubData(buffer->object.name, (GLintptr)offset, (GLsizeiptr)size, data);
    return end_gl(gl, "reading a buffer");
}

moit_gl_status moit_gl_fill_buffer(moit_gl_buffer *buffer, uint32_t word) {
    moit_gl *gl = buffer->object.gl;
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    if (buffer->size % 4)
        return fail("a buffer of %lld bytes is not filled by words of 4", (long long)buffer->size);
    gl->f.ClearNamedBufferData(buffer->object.name, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT,
                               &word);
    return end_gl(gl, "filling a buffer");
}
