/* Drawing passes: targets, blending, depth. Every piece of GL's state that matters is set for each,
 * as others may draw in between. */
#include "driver.h"

static moit_gl_status check_target(moit_gl *gl, const char *what, const moit_gl_texture *texture,
                                   bool depth) {
    const moit_gl_texture_info *info = &texture->info;
    if (texture->object.gl != gl) return fail("%s: it belongs to another device", what);
    if ((info->kind == MOIT_GL_DEPTH) != depth)
        return fail("%s: expected a texture of %s, got %s", what, depth ? "depth" : "colour",
                    info->format);
    return MOIT_GL_OK;
}

/* The size that targets share, or that of `drawing`. */
static moit_gl_status check_targets(moit_gl *gl, const moit_gl_drawing *drawing, int size[2]) {
    if (drawing->targets > gl->info.color_targets)
        return fail("targets: expected at most %d on this device, got %d", gl->info.color_targets,
                    drawing->targets);
    const moit_gl_texture *first = NULL;
    for (int i = 0; i <= drawing->targets; ++i) {
        bool depth = i == drawing->targets;
        const moit_gl_texture *texture = depth ? drawing->depth : drawing->target[i].texture;
        if (!texture && depth) continue;
        if (!texture) return fail("targets: there is none at %d", i);
        moit_gl_status status = check_target(gl, depth ? "depth" : "targets", texture, depth);
        if (status != MOIT_GL_OK) return status;
        if (!depth && texture->info.kind == MOIT_GL_WHOLE
            && drawing->target[i].blend != MOIT_GL_REPLACE)
            return fail("blend: whole numbers, as in %s, are not blended", texture->info.format);
        if (!first) first = texture;
        if (texture->info.width != first->info.width || texture->info.height != first->info.height)
            return fail("targets: expected textures of one size, got %d x %d and %d x %d",
                        first->info.width, first->info.height, texture->info.width,
                        texture->info.height);
    }
    size[0] = drawing->width ? drawing->width : first ? first->info.width : 0;
    size[1] = drawing->height ? drawing->height : first ? first->info.height : 0;
    int most = gl->info.texture_side;
    if (size[0] < 1 || size[1] < 1 || size[0] > most || size[1] > most)
        return fail("size: expected 1 to %d pixels a side%s, got %d x %d", most,
                    first ? "" : ", as there are no targets", size[0], size[1]);
    if ((drawing->depth_test != MOIT_GL_ANY_DEPTH || drawing->depth_write) && !drawing->depth)
        return fail("depth: expected a texture of depth to test against or to write");
    return MOIT_GL_OK;
}

static moit_gl_status attach(moit_gl *gl, const moit_gl_drawing *drawing, const int size[2]) {
    const gl_functions *f = &gl->f;
    if (!gl->framebuffer) f->CreateFramebuffers(1, &gl->framebuffer);
    if (!gl->vertices) f->CreateVertexArrays(1, &gl->vertices);
    GLenum colors[MOIT_GL_TARGETS];
    for (int i = 0; i < drawing->targets; ++i) {
        colors[i] = (GLenum)(GL_COLOR_ATTACHMENT0 + i);
        f->NamedFramebufferTexture(gl->framebuffer, colors[i],
                                   drawing->target[i].texture->info.name, 0);
    }
    f->NamedFramebufferDrawBuffers(gl->framebuffer, drawing->targets, colors);
    if (drawing->depth)
        f->NamedFramebufferTexture(gl->framebuffer, GL_DEPTH_ATTACHMENT, drawing->depth->info.name,
                                   0);
    f->NamedFramebufferParameteri(gl->framebuffer, GL_FRAMEBUFFER_DEFAULT_WIDTH, size[0]);
    f->NamedFramebufferParameteri(gl->framebuffer, GL_FRAMEBUFFER_DEFAULT_HEIGHT, size[1]);
    GLenum complete = f->CheckNamedFramebufferStatus(gl->framebuffer, GL_DRAW_FRAMEBUFFER);
    if (complete == GL_FRAMEBUFFER_COMPLETE) return MOIT_GL_OK;
    return fail("targets: this device cannot draw to %s%s%s (framebuffer status 0x%04x); try "
                "another format, such as rgba16f",
                drawing->targets ? drawing->target[0].texture->info.format : "depth alone",
                drawing->depth ? " with " : "", drawing->depth ? drawing->depth->info.format : "",
                complete);
}

/* A texture that is still attached would outlive its owner's wish to delete it. */
static void detach(moit_gl *gl, const moit_gl_drawing *drawing) {
    for (int i = 0; i < drawing->targets; ++i)
        gl->f.NamedFramebufferTexture(gl->framebuffer, (GLenum)(GL_COLOR_ATTACHMENT0 + i), 0, 0);
    if (drawing->depth) gl->f.NamedFramebufferTexture(gl->framebuffer, GL_DEPTH_ATTACHMENT, 0, 0);
}

static void set_blending(moit_gl *gl, const moit_gl_drawing *drawing) {
    static const struct {
        GLenum equation, source, destination;
    } how[MOIT_GL_BLENDS] = {
        [MOIT_GL_REPLACE] = {GL_FUNC_ADD, GL_ONE, GL_ZERO},
        [MOIT_GL_ADD] = {GL_FUNC_ADD, GL_ONE, GL_ONE},
        [MOIT_GL_OVER] = {GL_FUNC_ADD, GL_ONE, GL_ONE_MINUS_SRC_ALPHA},
        [MOIT_GL_UNDER] = {GL_FUNC_ADD, GL_ONE_MINUS_DST_ALPHA, GL_ONE},
        [MOIT_GL_MULTIPLY] = {GL_FUNC_ADD, GL_ZERO, GL_SRC_COLOR},
        [MOIT_GL_MULTIPLY_COMPLEMENT] = {GL_FUNC_ADD, GL_ZERO, GL_ONE_MINUS_SRC_COLOR},
        [MOIT_GL_GREATEST] = {GL_MAX, GL_ONE, GL_ONE},
        [MOIT_GL_LEAST] = {GL_MIN, GL_ONE, GL_ONE},
    };
    for (GLuint i = 0; i < (GLuint)drawing->targets; ++i) {
        moit_gl_blend blend = drawing->target[i].blend;
        (blend == MOIT_GL_REPLACE ? gl->f.Disablei : gl->f.Enablei)(GL_BLEND, i);
        gl->f.BlendEquationSeparatei(i, how[blend].equation, how[blend].equation);
        gl->f.BlendFuncSeparatei(i, how[blend].source, how[blend].destination, how[blend].source,
                                 how[blend].destination);
        gl->f.ColorMaski(i, 1, 1, 1, 1);
    }
}

static void set_depth(moit_gl *gl, const moit_gl_drawing *drawing) {
    static const GLenum tests[] = {[MOIT_GL_ANY_DEPTH] = GL_ALWAYS,
                                   [MOIT_GL_LESS] = GL_LESS,
                                   [MOIT_GL_LESS_OR_EQUAL] = GL_LEQUAL};
    bool used = drawing->depth && (drawing->depth_write || drawing->depth_test);
    (used ? gl->f.Enable : gl->f.Disable)(GL_DEPTH_TEST); /* without the test nothing is written */
    gl->f.DepthFunc(tests[drawing->depth_test]);
    gl->f.DepthMask(drawing->depth_write);
    gl->f.DepthRangeIndexed(0, 0.0, 1.0);
}

static void set_raster(moit_gl *gl, const int size[2]) {
    static const GLenum off[] = {GL_CULL_FACE,          GL_STENCIL_TEST,       GL_DEPTH_CLAMP,
                                 GL_COLOR_LOGIC_OP,     GL_RASTERIZER_DISCARD, GL_FRAMEBUFFER_SRGB,
                                 GL_POLYGON_OFFSET_FILL};
    for (size_t i = 0; i < sizeof off / sizeof *off; ++i) gl->f.Disable(off[i]);
    for (GLenum i = 0; i < 8; ++i) gl->f.Disable(GL_CLIP_DISTANCE0 + i);
    gl->f.Disablei(GL_SCISSOR_TEST, 0);
    gl->f.PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    gl->f.ProvokingVertex(GL_LAST_VERTEX_CONVENTION);
    gl->f.ClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
    gl->f.ViewportIndexedf(0, 0.0f, 0.0f, (GLfloat)size[0], (GLfloat)size[1]);
}

moit_gl_status moit_gl_draw(moit_gl *gl, moit_gl_program *program, const moit_gl_drawing *drawing,
                            const moit_gl_bindings *bindings) {
    moit_gl_status status = begin_pass(gl, program, false);
    if (status != MOIT_GL_OK) return status;
    if (drawing->first < 0 || drawing->vertices < 0 || drawing->first > INT32_MAX
        || drawing->vertices > INT32_MAX - drawing->first)
        return fail("vertices: expected 0 to %d, got %lld from %lld on; draw parts", INT32_MAX,
                    (long long)drawing->vertices, (long long)drawing->first);
    int size[2] = {0, 0};
    if ((status = check_targets(gl, drawing, size)) != MOIT_GL_OK
        || (status = bind_everything(gl, program, bindings)) != MOIT_GL_OK)
        return status;
    status = attach(gl, drawing, size);
    if (status == MOIT_GL_OK) {
        set_blending(gl, drawing);
        set_depth(gl, drawing);
        set_raster(gl, size);
        gl->f.BindFramebuffer(GL_DRAW_FRAMEBUFFER, gl->framebuffer);
        gl->f.BindVertexArray(gl->vertices);
        gl->f.UseProgram(program->object.name);
        gl->f.DrawArrays(GL_TRIANGLES, (GLint)drawing->first, (GLsizei)drawing->vertices);
        gl->f.MemoryBarrier(GL_ALL_BARRIER_BITS);
        status = end_gl(gl, "draw");
    }
    detach(gl, drawing);
    forget_errors(gl);
    return status;
}
