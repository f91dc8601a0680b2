/* The state of GL in a context where others draw: all that passes change, captured before the first
 * and put back bit by bit.
 *
 * Where GL can, the driver works without binding (direct state access), or on the first of several
 * viewports alone; that needs no entry here. */
#include "driver.h"

#include <stdlib.h>

static const GLenum switches[] = {
    GL_CULL_FACE,          GL_DEPTH_TEST,         GL_DEPTH_CLAMP,        GL_STENCIL_TEST,
    GL_COLOR_LOGIC_OP,     GL_RASTERIZER_DISCARD, GL_FRAMEBUFFER_SRGB,   GL_POLYGON_OFFSET_FILL,
    GL_CLIP_DISTANCE0,     GL_CLIP_DISTANCE0 + 1, GL_CLIP_DISTANCE0 + 2, GL_CLIP_DISTANCE0 + 3,
    GL_CLIP_DISTANCE0 + 4, GL_CLIP_DISTANCE0 + 5, GL_CLIP_DISTANCE0 + 6, GL_CLIP_DISTANCE0 + 7,
};
static const GLenum packing[] = {
    GL_PACK_SWAP_BYTES,   GL_PACK_LSB_FIRST,     GL_PACK_ROW_LENGTH,    GL_PACK_IMAGE_HEIGHT,
    GL_PACK_SKIP_ROWS,    GL_PACK_SKIP_PIXELS,   GL_PACK_SKIP_IMAGES,   GL_PACK_ALIGNMENT,
    GL_UNPACK_SWAP_BYTES, GL_UNPACK_LSB_FIRST,   GL_UNPACK_ROW_LENGTH,  GL_UNPACK_IMAGE_HEIGHT,
    GL_UNPACK_SKIP_ROWS,  GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SKIP_IMAGES, GL_UNPACK_ALIGNMENT,
};
static const GLenum blending[] = {
    GL_BLEND_SRC_RGB,   GL_BLEND_DST_RGB,      GL_BLEND_SRC_ALPHA,
    GL_BLEND_DST_ALPHA, GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA,
};
static const GLenum images[] = {
    GL_IMAGE_BINDING_NAME,  GL_IMAGE_BINDING_LEVEL,  GL_IMAGE_BINDING_LAYERED,
    GL_IMAGE_BINDING_LAYER, GL_IMAGE_BINDING_ACCESS, GL_IMAGE_BINDING_FORMAT,
};
enum {
    SWITCHES = sizeof switches / sizeof *switches,
    PACKING = sizeof packing / sizeof *packing,
    BLENDING = sizeof blending / sizeof *blending,
    IMAGES = sizeof images / sizeof *images,
};

struct foreign_state {
    GLint draw_framebuffer, read_framebuffer, program, vertices, active_texture;
    GLint pack_buffer, unpack_buffer, storage_buffer;
    GLint polygon_mode[2], depth_function, provoking_vertex, clip_origin, clip_depth;
    GLboolean on[SWITCHES], depth_mask, scissor;
    GLint pixels[PACKING];
    GLfloat viewport[4];
    GLdouble depth_range[2];
    GLboolean blend[MOIT_GL_TARGETS], color_mask[MOIT_GL_TARGETS][4];
    GLint blends[MOIT_GL_TARGETS][BLENDING];
    GLint buffer[MOIT_GL_BUFFERS];
    int64_t start[MOIT_GL_BUFFERS], size[MOIT_GL_BUFFERS];
    GLint texture[MOIT_GL_TEXTURES], sampler[MOIT_GL_TEXTURES];
    GLint image[MOIT_GL_IMAGES][IMAGES];
};

struct foreign_state *capture_state(moit_gl *gl) {
    const gl_functions *f = &gl->f;
    struct foreign_state *s = calloc(1, sizeof *s);
    if (!s) return NULL;
    f->GetIntegerv(GL_FRAMEBUFFER_BINDING, &s->draw_framebuffer);
    f->GetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &s->read_framebuffer);
    f->GetIntegerv(GL_CURRENT_PROGRAM, &s->program);
    f->GetIntegerv(GL_VERTEX_ARRAY_BINDING, &s->vertices);
    f->GetIntegerv(GL_ACTIVE_TEXTURE, &s->active_texture);
    f->GetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &s->pack_buffer);
    f->GetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &s->unpack_buffer);
    f->GetIntegerv(GL_SHADER_STORAGE_BUFFER_BINDING, &s->storage_buffer);
    f->GetIntegerv(GL_POLYGON_MODE, s->polygon_mode);
    f->GetIntegerv(GL_DEPTH_FUNC, &s->depth_function);
    f->GetIntegerv(GL_PROVOKING_VERTEX, &s->provoking_vertex);
    f->GetIntegerv(GL_CLIP_ORIGIN, &s->clip_origin);
    f->GetIntegerv(GL_CLIP_DEPTH_MODE, &s->clip_depth);
    f->GetBooleanv(GL_DEPTH_WRITEMASK, &s->depth_mask);
    for (int i = 0; i < SWITCHES; ++i) s->on[i] = f->IsEnabled(switches[i]);
    s->scissor = f->IsEnabledi(GL_SCISSOR_TEST, 0);
    f->GetFloati_v(GL_VIEWPORT, 0, s->viewport);
    f->GetDoublei_v(GL_DEPTH_RANGE, 0, s->depth_range);
    for (int i = 0; i < PACKING; ++i) f->GetIntegerv(packing[i], &s->pixels[i]);
    for (GLuint i = 0; i < (GLuint)gl->info.color_targets; ++i) {
        s->blend[i] = f->IsEnabledi(GL_BLEND, i);
        f->GetBooleani_v(GL_COLOR_WRITEMASK, i, s->color_mask[i]);
        for (int k = 0; k < BLENDING; ++k) f->GetIntegeri_v(blending[k], i, &s->blends[i][k]);
    }
    for (GLuint i = 0; i < (GLuint)gl->info.storage_blocks; ++i) {
        f->GetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, i, &s->buffer[i]);
        f->GetInteger64i_v(GL_SHADER_STORAGE_BUFFER_START, i, &s->start[i]);
        f->GetInteger64i_v(GL_SHADER_STORAGE_BUFFER_SIZE, i, &s->size[i]);
    }
    for (GLuint i = 0; i < MOIT_GL_TEXTURES; ++i) {
        f->ActiveTexture(GL_TEXTURE0 + i);
        f->GetIntegerv(GL_TEXTURE_BINDING_2D, &s->texture[i]);
        f->GetIntegerv(GL_SAMPLER_BINDING, &s->sampler[i]);
    }
    f->ActiveTexture((GLenum)s->active_texture);
    for (GLuint i = 0; i < MOIT_GL_IMAGES; ++i)
        for (int k = 0; k < IMAGES; ++k) f->GetIntegeri_v(images[k], i, &s->image[i][k]);
    forget_errors(gl);
    return s;
}

void restore_state(moit_gl *gl, const struct foreign_state *s) {
    const gl_functions *f = &gl->f;
    f->BindFramebuffer(GL_DRAW_FRAMEBUFFER, (GLuint)s->draw_framebuffer);
    f->BindFramebuffer(GL_READ_FRAMEBUFFER, (GLuint)s->read_framebuffer);
    f->UseProgram((GLuint)s->program);
    f->BindVertexArray((GLuint)s->vertices);
    f->BindBuffer(GL_PIXEL_PACK_BUFFER, (GLuint)s->pack_buffer);
    f->BindBuffer(GL_PIXEL_UNPACK_BUFFER, (GLuint)s->unpack_buffer);
    f->PolygonMode(GL_FRONT_AND_BACK, (GLenum)s->polygon_mode[0]);
    f->DepthFunc((GLenum)s->depth_function);
    f->ProvokingVertex((GLenum)s->provoking_vertex);
    f->ClipControl((GLenum)s->clip_origin, (GLenum)s->clip_depth);
    f->DepthMask(s->depth_mask);
    for (int i = 0; i < SWITCHES; ++i) (s->on[i] ? f->Enable : f->Disable)(switches[i]);
    (s->scissor ? f->Enablei : f->Disablei)(GL_SCISSOR_TEST, 0);
    f->ViewportIndexedf(0, s->viewport[0], s->viewport[1], s->viewport[2], s->viewport[3]);
    f->DepthRangeIndexed(0, s->depth_range[0], s->depth_range[1]);
    for (int i = 0; i < PACKING; ++i) f->PixelStorei(packing[i], s->pixels[i]);
    for (GLuint i = 0; i < (GLuint)gl->info.color_targets; ++i) {
        const GLint *b = s->blends[i];
        const GLboolean *m = s->color_mask[i];
        (s->blend[i] ? f->Enablei : f->Disablei)(GL_BLEND, i);
        f->ColorMaski(i, m[0], m[1], m[2], m[3]);
        f->BlendFuncSeparatei(i, (GLenum)b[0], (GLenum)b[1], (GLenum)b[2], (GLenum)b[3]);
        f->BlendEquationSeparatei(i, (GLenum)b[4], (GLenum)b[5]);
    }
    for (GLuint i = 0; i < (GLuint)gl->info.storage_blocks; ++i) {
        if (s->size[i])
            f->BindBufferRange(GL_SHADER_STORAGE_BUFFER, i, (GLuint)s->buffer[i],
                               (GLintptr)s->start[i], (GLsizeiptr)s->size[i]);
        else f->BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, (GLuint)s->buffer[i]);
    }
    f->BindBuffer(GL_SHADER_STORAGE_BUFFER, (GLuint)s->storage_buffer);
    for (GLuint i = 0; i < MOIT_GL_TEXTURES; ++i) {
        f->ActiveTexture(GL_TEXTURE0 + i);
        f->BindTexture(GL_TEXTURE_2D, (GLuint)s->texture[i]);
        f->BindSampler(i, (GLuint)s->sampler[i]);
    }
    f->ActiveTexture((GLenum)s->active_texture);
    for (GLuint i = 0; i < MOIT_GL_IMAGES; ++i) {
        const GLint *m = s->image[i];
        f->BindImageTexture(i, (GLuint)m[0], m[1], (GLboolean)m[2], m[3], (GLenum)m[4],
                            (GLenum)m[5]);
    }
    forget_errors(gl);
}
