/* What passes read and write is checked and bound; dispatch. */
#include "driver.h"

/* ---- What is bound --------------------------------------------------------------------------- */

static moit_gl_status check_buffer(moit_gl *gl, int binding, const moit_gl_bound_buffer *bound,
                                   int64_t *size) {
    const moit_gl_buffer *buffer = bound->buffer;
    if (buffer->object.gl != gl)
        return fail("buffers: that at %d belongs to another device", binding);
    *size = bound->size ? bound->size : buffer->size - bound->offset;
    if (bound->offset < 0 || *size < 0 || bound->offset > buffer->size
        || *size > buffer->size - bound->offset)
        return fail("buffer %d: %lld bytes from %lld on are not within its %lld bytes", binding,
                    (long long)*size, (long long)bound->offset, (long long)buffer->size);
    if (bound->offset % gl->info.storage_alignment)
        return fail("buffer %d: offset %lld is not a multiple of %lld, as this device needs it",
                    binding, (long long)bound->offset, (long long)gl->info.storage_alignment);
    if (*size > gl->info.storage_bytes)
        return fail("buffer %d: %lld bytes are more than the %lld that a pass sees of one buffer "
                    "on this device; bind a part",
                    binding, (long long)*size, (long long)gl->info.storage_bytes);
    return MOIT_GL_OK;
}

static moit_gl_status check_texture(moit_gl *gl, const char *what, int unit,
                                    const moit_gl_texture *texture) {
    if (texture->object.gl != gl)
        return fail("%s: that at %d belongs to another device", what, unit);
    return MOIT_GL_OK;
}

static moit_gl_status check_bound(const moit_gl_program *program,
                                  const moit_gl_bindings *bindings) {
    for (int i = 0; i < program->buffers.count; ++i) {
        const block *one = &program->buffers.all[i];
        if (one->binding >= MOIT_GL_BUFFERS || !bindings->buffers[one->binding].buffer)
            return fail("buffers: the program reads or writes %s at binding %d, where no buffer is",
                        one->name, one->binding);
    }
    for (int i = 0; i < program->textures.count; ++i) {
        const block *one = &program->textures.all[i];
        if (one->binding >= MOIT_GL_TEXTURES || !bindings->textures[one->binding])
            return fail("textures: the program samples %s at unit %d, where no texture is",
                        one->name, one->binding);
    }
    for (int i = 0; i < program->images.count; ++i) {
        const block *one = &program->images.all[i];
        if (one->binding >= MOIT_GL_IMAGES || !bindings->images[one->binding])
            return fail("images: the program reads or writes %s at unit %d, where no texture is",
                        one->name, one->binding);
    }
    return MOIT_GL_OK;
}

moit_gl_status bind_everything(moit_gl *gl, const moit_gl_program *program,
                               const moit_gl_bindings *bindings) {
    const gl_functions *f = &gl->f;
    moit_gl_status status = check_bound(program, bindings);
    int64_t size[MOIT_GL_BUFFERS];
    for (int i = 0; status == MOIT_GL_OK && i < MOIT_GL_BUFFERS; ++i)
        if (bindings->buffers[i].buffer)
            status = check_buffer(gl, i, &bindings->buffers[i], &size[i]);
    for (int i = 0; status == MOIT_GL_OK && i < MOIT_GL_TEXTURES; ++i)
        if (bindings->textures[i]) status = check_texture(gl, "textures", i, bindings->textures[i]);
    for (int i = 0; status == MOIT_GL_OK && i < MOIT_GL_IMAGES; ++i)
        if (bindings->images[i]) status = check_texture(gl, "images", i, bindings->images[i]);
    if (status != MOIT_GL_OK) return status;
    for (GLuint i = 0; i < MOIT_GL_BUFFERS; ++i) {
        const moit_gl_bound_buffer *bound = &bindings->buffers[i];
        if (!bound->buffer) continue;
        if (size[i]) /* an empty buffer has some room that nobody reads */
            f->BindBufferRange(GL_SHADER_STORAGE_BUFFER, i, bound->buffer->object.name,
                               (GLintptr)bound->offset, (GLsizeiptr)size[i]);
        else f->BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, bound->buffer->object.name);
    }
    return bind_textures(gl, bindings);
}

/* ---- Passes ---------------------------------------------------------------------------------- */

moit_gl_status begin_pass(moit_gl *gl, const moit_gl_program *program, bool compute) {
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    if (program->object.gl != gl) return fail("program: it belongs to another device");
    if (program->compute != compute)
        return fail(compute ? "program: expected a compute shader, to dispatch"
                            : "program: expected a vertex and a fragment shader, to draw");
    return MOIT_GL_OK;
}

moit_gl_status moit_gl_dispatch(moit_gl *gl, moit_gl_program *program, const int64_t groups[3],
                                const moit_gl_bindings *bindings) {
    moit_gl_status status = begin_pass(gl, program, true);
    if (status != MOIT_GL_OK) return status;
    for (int i = 0; i < 3; ++i)
        if (groups[i] < 0 || groups[i] > gl->info.groups) /* GL would do nothing, in no time */
            return fail("groups: expected 0 to %lld in %c, got %lld; dispatch parts",
                        (long long)gl->info.groups, "xyz"[i], (long long)groups[i]);
    if ((status = bind_everything(gl, program, bindings)) != MOIT_GL_OK) return status;
    gl->f.UseProgram(program->object.name);
    gl->f.DispatchCompute((GLuint)groups[0], (GLuint)groups[1], (GLuint)groups[2]);
    gl->f.MemoryBarrier(GL_ALL_BARRIER_BITS);
    return end_gl(gl, "dispatch");
}

moit_gl_status moit_gl_finish(moit_gl *gl) {
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    gl->f.Finish();
    return end_gl(gl, "finish");
}
