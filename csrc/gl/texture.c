/* Two-dimensional textures of one level, ours and other people's. */
#include "driver.h"

#include <stdlib.h>
#include <string.h>

struct texture_format {
    const char *name;
    GLenum internal;
    GLenum transfer; /* as pixels go in and out */
    int channels;
    moit_gl_kind kind;
    moit_gl_item integer; /* items of normalised or whole numbers as they are stored */
    bool exact;           /* there is such an item */
    bool only_wrapped;
    bool image; /* shaders may load and store */
};

#define RED GL_RED, 1
#define RG GL_RG, 2
#define RGB GL_RGB, 3
#define RGBA GL_RGBA, 4
#define WHOLE(transfer, channels) transfer, channels, MOIT_GL_WHOLE
#define REAL MOIT_GL_REAL
#define DEPTH GL_DEPTH_COMPONENT, 1, MOIT_GL_DEPTH
#define NO_ITEM MOIT_GL_ITEM_FLOAT32, false

static const struct texture_format formats[] = {
    {"r8", 0x8229, RED, REAL, MOIT_GL_ITEM_UINT8, true, false, true},
    {"rgba8", 0x8058, RGBA, REAL, MOIT_GL_ITEM_UINT8, true, false, true},
    {"r16", 0x822A, RED, REAL, MOIT_GL_ITEM_UINT16, true, false, true},
    {"rg16", 0x822C, RG, REAL, MOIT_GL_ITEM_UINT16, true, false, true},
    {"rgba16", 0x805B, RGBA, REAL, MOIT_GL_ITEM_UINT16, true, false, true},
    {"r16f", 0x822D, RED, REAL, NO_ITEM, false, true},
    {"rg16f", 0x822F, RG, REAL, NO_ITEM, false, true},
    {"rgba16f", 0x881A, RGBA, REAL, NO_ITEM, false, true},
    {"r32f", 0x822E, RED, REAL, NO_ITEM, false, true},
    {"rg32f", 0x8230, RG, REAL, NO_ITEM, false, true},
    {"rgba32f", 0x8814, RGBA, REAL, NO_ITEM, false, true},
    {"r11g11b10f", 0x8C3A, RGB, REAL, NO_ITEM, false, true},
    {"r32ui", 0x8236, WHOLE(GL_RED_INTEGER, 1), MOIT_GL_ITEM_UINT32, true, false, true},
    {"rg32ui", 0x823C, WHOLE(GL_RG_INTEGER, 2), MOIT_GL_ITEM_UINT32, true, false, true},
    {"rgba32ui", 0x8D70, WHOLE(GL_RGBA_INTEGER, 4), MOIT_GL_ITEM_UINT32, true, false, true},
    {"rgba16ui", 0x8D76, WHOLE(GL_RGBA_INTEGER, 4), MOIT_GL_ITEM_UINT16, true, false, true},
    {"depth32f", 0x8CAC, DEPTH, NO_ITEM, false, false},
    /* others' */
    {"rg8", 0x822B, RG, REAL, MOIT_GL_ITEM_UINT8, true, true, true},
    {"rgb8", 0x8051, RGB, REAL, MOIT_GL_ITEM_UINT8, true, true, false},
    {"srgb8", 0x8C41, RGB, REAL, MOIT_GL_ITEM_UINT8, true, true, false},
    {"srgb8_alpha8", 0x8C43, RGBA, REAL, MOIT_GL_ITEM_UINT8, true, true, false},
    {"rgb10_a2", 0x8059, RGBA, REAL, NO_ITEM, true, true},
    {"rgb16", 0x8054, RGB, REAL, MOIT_GL_ITEM_UINT16, true, true, false},
    {"rgb16f", 0x881B, RGB, REAL, NO_ITEM, true, false},
    {"rgb32f", 0x8815, RGB, REAL, NO_ITEM, true, false},
    {"depth16", 0x81A5, DEPTH, NO_ITEM, true, false},
    {"depth24", 0x81A6, DEPTH, NO_ITEM, true, false},
    {"depth32", 0x81A7, DEPTH, NO_ITEM, true, false},
    {"depth24_stencil8", 0x88F0, DEPTH, NO_ITEM, true, false},
    {"depth32f_stencil8", 0x8CAD, DEPTH, NO_ITEM, true, false},
};
enum { FORMATS = sizeof formats / sizeof *formats };

static const struct {
    GLenum type;
    int bytes;
} items[] = {
    [MOIT_GL_ITEM_FLOAT32] = {GL_FLOAT, 4},       [MOIT_GL_ITEM_FLOAT16] = {GL_HALF_FLOAT, 2},
    [MOIT_GL_ITEM_UINT32] = {GL_UNSIGNED_INT, 4}, [MOIT_GL_ITEM_UINT16] = {GL_UNSIGNED_SHORT, 2},
    [MOIT_GL_ITEM_UINT8] = {GL_UNSIGNED_BYTE, 1},
};

static moit_gl_status unknown_format(const char *name) {
    char known[512] = "";
    for (int i = 0; i < FORMATS; ++i)
        if (!formats[i].only_wrapped) {
            if (*known) strcat(known, " ");
            strcat(known, formats[i].name);
        }
    return fail("format: expected one of %s, got %.40s", known, name);
}

static moit_gl_texture *texture_of(const struct texture_format *format, int width, int height,
                                   bool wrapped) {
    moit_gl_texture *texture = calloc(1, sizeof *texture);
    if (!texture) return NULL;
    texture->format = format;
    texture->info = (moit_gl_texture_info){.format = format->name,
                                           .width = width,
                                           .height = height,
                                           .channels = format->channels,
                                           .kind = format->kind,
                                           .wrapped = wrapped};
    return texture;
}

moit_gl_status moit_gl_make_texture(moit_gl *gl, const char *format, int width, int height,
                                    moit_gl_texture **made) {
    *made = NULL;
    const struct texture_format *found = NULL;
    for (int i = 0; i < FORMATS; ++i)
        if (!formats[i].only_wrapped && strcmp(formats[i].name, format) == 0) found = &formats[i];
    if (!found) return unknown_format(format);
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    int most = gl->info.texture_side;
    if (width < 1 || height < 1 || width > most || height > most)
        return fail("width, height: expected 1 to %d on this device, got %d x %d", most, width,
                    height);
    moit_gl_texture *texture = texture_of(found, width, height, false);
    if (!texture) return MOIT_GL_NO_MEMORY;
    GLuint name = 0;
    gl->f.CreateTextures(GL_TEXTURE_2D, 1, &name);
    gl->f.TextureStorage2D(name, 1, found->internal, width, height);
    status = end_gl(gl, "making a texture");
    if (status != MOIT_GL_OK) {
        delete_name(gl, A_TEXTURE, name);
        free(texture);
        return status;
    }
    enlist(gl, &texture->object, A_TEXTURE, name);
    texture->info.name = name;
    *made = texture;
    return MOIT_GL_OK;
}

moit_gl_status moit_gl_wrap_texture(moit_gl *gl, unsigned name, moit_gl_texture **made) {
    *made = NULL;
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    if (!gl->f.IsTexture(name)) return fail("texture %u: there is none in this context", name);
    GLint target = 0, width = 0, height = 0, internal = 0;
    gl->f.GetTextureParameteriv(name, GL_TEXTURE_TARGET, &target);
    if (target != GL_TEXTURE_2D)
        return fail("texture %u: expected a two-dimensional texture with one sample a pixel, got "
                    "target 0x%04x",
                    name, (unsigned)target);
    gl->f.GetTextureLevelParameteriv(name, 0, GL_TEXTURE_WIDTH, &width);
    gl->f.GetTextureLevelParameteriv(name, 0, GL_TEXTURE_HEIGHT, &height);
    gl->f.GetTextureLevelParameteriv(name, 0, GL_TEXTURE_INTERNAL_FORMAT, &internal);
    if ((status = end_gl(gl, "asking for a texture")) != MOIT_GL_OK) return status;
    if (width < 1 || height < 1) return fail("texture %u: it has no pixels", name);
    const struct texture_format *found = NULL;
    for (int i = 0; i < FORMATS; ++i)
        if (formats[i].internal == (GLenum)internal) found = &formats[i];
    if (!found)
        return fail("texture %u: its format 0x%04x is none that passes can use; use one such as "
                    "rgba16f, rgba8 or depth32f",
                    name, (unsigned)internal);
    moit_gl_texture *texture = texture_of(found, width, height, true);
    if (!texture) return MOIT_GL_NO_MEMORY;
    enlist(gl, &texture->object, A_TEXTURE, 0); /* 0: not ours to delete */
    texture->info.name = name;
    *made = texture;
    return MOIT_GL_OK;
}

void moit_gl_free_texture(moit_gl_texture *texture) {
    if (!texture) return;
    discard(&texture->object, !texture->info.wrapped);
    free(texture);
}

const moit_gl_texture_info *moit_gl_get_texture_info(const moit_gl_texture *texture) {
    return &texture->info;
}

/* ---- Pixels ---------------------------------------------------------------------------------- */

static moit_gl_status check_items(const moit_gl_texture *texture, moit_gl_item item,
                                  int64_t count) {
    const struct texture_format *format = texture->format;
    int64_t needed = (int64_t)texture->info.width * texture->info.height * format->channels;
    bool real = item == MOIT_GL_ITEM_FLOAT32
                || (item == MOIT_GL_ITEM_FLOAT16 && format->kind == MOIT_GL_REAL);
    bool fits = (format->kind == MOIT_GL_WHOLE ? item == MOIT_GL_ITEM_UINT32 : real)
                || (format->exact && item == format->integer);
    static const char *const words[] = {"float32", "float16", "uint32", "uint16", "uint8"};
    if (!fits)
        return fail("pixels of a %s texture are %s%s%s, not %s", format->name,
                    format->kind == MOIT_GL_WHOLE ? "uint32" : "float32",
                    format->exact && format->integer != MOIT_GL_ITEM_UINT32 ? " or " : "",
                    format->exact && format->integer != MOIT_GL_ITEM_UINT32 ? words[format->integer]
                                                                            : "",
                    words[item]);
    if (count != needed)
        return fail("pixels of a %s texture of %d x %d are %lld numbers, not %lld", format->name,
                    texture->info.width, texture->info.height, (long long)needed, (long long)count);
    return MOIT_GL_OK;
}

static void plain_packing(moit_gl *gl, bool pack) {
    static const GLenum zero[2][7] = {
        {GL_UNPACK_SWAP_BYTES, GL_UNPACK_LSB_FIRST, GL_UNPACK_ROW_LENGTH, GL_UNPACK_IMAGE_HEIGHT,
         GL_UNPACK_SKIP_ROWS, GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SKIP_IMAGES},
        {GL_PACK_SWAP_BYTES, GL_PACK_LSB_FIRST, GL_PACK_ROW_LENGTH, GL_PACK_IMAGE_HEIGHT,
         GL_PACK_SKIP_ROWS, GL_PACK_SKIP_PIXELS, GL_PACK_SKIP_IMAGES},
    };
    for (int i = 0; i < 7; ++i) gl->f.PixelStorei(zero[pack][i], 0);
    gl->f.PixelStorei(pack ? GL_PACK_ALIGNMENT : GL_UNPACK_ALIGNMENT, 1);
    gl->f.BindBuffer(pack ? GL_PIXEL_PACK_BUFFER : GL_PIXEL_UNPACK_BUFFER, 0);
}

moit_gl_status moit_gl_read_texture(moit_gl_texture *texture, moit_gl_item item, int64_t count,
                                    void *data) {
    moit_gl *gl = texture->object.gl;
    moit_gl_status status = begin_gl(gl);
    if (status == MOIT_GL_OK) status = check_items(texture, item, count);
    if (status != MOIT_GL_OK) return status;
    int64_t bytes = count * items[item].bytes;
    if (bytes > INT32_MAX)
        return fail("a texture of %lld bytes cannot be read at once", (long long)bytes);
    plain_packing(gl, true);
    gl->f.GetTextureImage(texture->info.name, 0, texture->format->transfer, items[item].type,
                          (GLsizei)bytes, data);
    return end_gl(gl, "reading a texture");
}

moit_gl_status moit_gl_write_texture(moit_gl_texture *texture, moit_gl_item item, int64_t count,
                                     const void *data) {
    moit_gl *gl = texture->object.gl;
    moit_gl_status status = begin_gl(gl);
    if (status == MOIT_GL_OK) status = check_items(texture, item, count);
    if (status != MOIT_GL_OK) return status;
    plain_packing(gl, false);
    gl->f.TextureSubImage2D(texture->info.name, 0, 0, 0, texture->info.width, texture->info.height,
                            texture->format->transfer, items[item].type, data);
    return end_gl(gl, "writing a texture");
}

moit_gl_status moit_gl_clear_texture(moit_gl_texture *texture, const double values[4]) {
    moit_gl *gl = texture->object.gl;
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    plain_packing(gl, false);
    if (texture->format->kind == MOIT_GL_WHOLE) {
        GLuint whole[4];
        for (int i = 0; i < 4; ++i) {
            if (!(0.0 <= values[i] && values[i] <= UINT32_MAX))
                return fail("value: expected 0 to %u in a %s texture, got %g", UINT32_MAX,
                            texture->format->name, values[i]);
            whole[i] = (GLuint)values[i];
        }
        gl->f.ClearTexImage(texture->info.name, 0, texture->format->transfer, GL_UNSIGNED_INT,
                            whole);
    } else {
        GLfloat real[4];
        for (int i = 0; i < 4; ++i) real[i] = (GLfloat)values[i];
        gl->f.ClearTexImage(texture->info.name, 0, texture->format->transfer, GL_FLOAT, real);
    }
    return end_gl(gl, "clearing a texture");
}

/* ---- Units ----------------------------------------------------------------------------------- */

moit_gl_status bind_textures(moit_gl *gl, const moit_gl_bindings *bindings) {
    const gl_functions *f = &gl->f;
    for (int i = 0; i < MOIT_GL_IMAGES; ++i)
        if (bindings->images[i] && !bindings->images[i]->format->image)
            return fail("image %d: shaders cannot load and store %s", i,
                        bindings->images[i]->format->name);
    if (!gl->sampler) { /* makes a texture without smaller levels complete, whoever made it */
        f->CreateSamplers(1, &gl->sampler);
        f->SamplerParameteri(gl->sampler, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        f->SamplerParameteri(gl->sampler, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        f->SamplerParameteri(gl->sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        f->SamplerParameteri(gl->sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    for (GLuint i = 0; i < MOIT_GL_TEXTURES; ++i) {
        if (!bindings->textures[i]) continue;
        f->BindTextureUnit(i, bindings->textures[i]->info.name);
        f->BindSampler(i, gl->sampler);
    }
    for (GLuint i = 0; i < MOIT_GL_IMAGES; ++i)
        if (bindings->images[i])
            f->BindImageTexture(i, bindings->images[i]->info.name, 0, 0, 0, GL_READ_WRITE,
                                bindings->images[i]->format->internal);
    return MOIT_GL_OK;
}
