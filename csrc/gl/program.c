/* Programs: compiled and linked, with what they ask for: uniforms, buffers, textures, images. */
#include "driver.h"

#include <stdlib.h>
#include <string.h>

static void free_blocks(blocks *some) {
    for (int i = 0; i < some->count; ++i) free(some->all[i].name);
    free(some->all);
}

static void free_all_but_name(moit_gl_program *program) {
    for (int i = 0; i < program->uniform_count; ++i) free((char *)program->uniforms[i].name);
    free(program->uniforms);
    free_blocks(&program->buffers);
    free_blocks(&program->textures);
    free_blocks(&program->images);
    free(program);
}

void moit_gl_free_program(moit_gl_program *program) {
    if (!program) return;
    discard(&program->object, true);
    free_all_but_name(program);
}

/* ---- What a program asks for ----------------------------------------------------------------- */

static bool add_block(blocks *some, int binding, const char *name) {
    block *all = realloc(some->all, (size_t)(some->count + 1) * sizeof *all);
    if (!all) return false;
    some->all = all;
    char *copy = strdup(name);
    if (!copy) return false;
    all[some->count++] = (block){binding, copy};
    return true;
}

/* The scalar and the components of a type of GL; false for samplers, images and the rest. */
static bool numbers_of(GLenum type, moit_gl_scalar *scalar, int *components) {
    static const struct {
        GLenum type;
        moit_gl_scalar scalar;
        int components;
    } types[] = {
        {0x1406, MOIT_GL_FLOAT32, 1}, {0x8B50, MOIT_GL_FLOAT32, 2}, {0x8B51, MOIT_GL_FLOAT32, 3},
        {0x8B52, MOIT_GL_FLOAT32, 4}, {0x8B5B, MOIT_GL_FLOAT32, 9}, {0x8B5C, MOIT_GL_FLOAT32, 16},
        {0x140A, MOIT_GL_FLOAT64, 1}, {0x8FFC, MOIT_GL_FLOAT64, 2}, {0x8FFD, MOIT_GL_FLOAT64, 3},
        {0x8FFE, MOIT_GL_FLOAT64, 4}, {0x1404, MOIT_GL_INT32, 1},   {0x8B53, MOIT_GL_INT32, 2},
        {0x8B54, MOIT_GL_INT32, 3},   {0x8B55, MOIT_GL_INT32, 4},   {0x1405, MOIT_GL_UINT32, 1},
        {0x8DC6, MOIT_GL_UINT32, 2},  {0x8DC7, MOIT_GL_UINT32, 3},  {0x8DC8, MOIT_GL_UINT32, 4},
        {0x8B56, MOIT_GL_TRUTH, 1},   {0x8B57, MOIT_GL_TRUTH, 2},   {0x8B58, MOIT_GL_TRUTH, 3},
        {0x8B59, MOIT_GL_TRUTH, 4},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; ++i)
        if (types[i].type == type) {
            *scalar = types[i].scalar;
            *components = types[i].components;
            return true;
        }
    return false;
}

static bool is_sampler(GLenum type) {
    return (0x8B5D <= type && type <= 0x8B64)     /* sampler1D to sampler2DRectShadow */
           || (0x8DC0 <= type && type <= 0x8DC5)  /* arrays, buffers, cube shadow */
           || (0x8DC9 <= type && type <= 0x8DD8)  /* isampler, usampler */
           || (0x900C <= type && type <= 0x900F)  /* cube arrays */
           || (0x9108 <= type && type <= 0x910D); /* multisample */
}

static bool is_image(GLenum type) { return 0x904C <= type && type <= 0x906C; }

static moit_gl_status ask_for_uniforms(moit_gl *gl, GLuint name, moit_gl_program *program) {
    enum { LONGEST = 256 };
    GLint count = 0;
    gl->f.GetProgramiv(name, GL_ACTIVE_UNIFORMS, &count);
    program->uniforms = calloc((size_t)count + 1, sizeof *program->uniforms);
    if (!program->uniforms) return MOIT_GL_NO_MEMORY;
    for (GLint i = 0; i < count; ++i) {
        char text[LONGEST] = "";
        GLint length = 0;
        GLenum type = 0;
        gl->f.GetActiveUniform(name, (GLuint)i, LONGEST, NULL, &length, &type, text);
        GLint location = gl->f.GetUniformLocation(name, text);
        if (location < 0) continue; /* of a uniform block */
        char *bracket = strstr(text, "[0]");
        bool array = bracket && !bracket[3];
        if (array) *bracket = 0;
        moit_gl_uniform *uniform = &program->uniforms[program->uniform_count];
        uniform->array = array;
        if (numbers_of(type, &uniform->scalar, &uniform->components)) {
            uniform->location = location;
            uniform->length = length;
            if (!(uniform->name = strdup(text))) return MOIT_GL_NO_MEMORY;
            ++program->uniform_count;
        } else if (is_sampler(type) || is_image(type)) {
            for (GLint k = 0; k < length; ++k) {
                GLint unit = 0;
                gl->f.GetUniformiv(name, location + k, &unit);
                if (!add_block(is_image(type) ? &program->images : &program->textures, unit, text))
                    return MOIT_GL_NO_MEMORY;
            }
        }
    }
    return MOIT_GL_OK;
}

static moit_gl_status ask_for_buffers(moit_gl *gl, GLuint name, moit_gl_program *program) {
    enum { LONGEST = 256 };
    GLint count = 0;
    gl->f.GetProgramInterfaceiv(name, GL_SHADER_STORAGE_BLOCK, GL_ACTIVE_RESOURCES, &count);
    for (GLint i = 0; i < count; ++i) {
        char text[LONGEST] = "";
        GLint binding = 0;
        static const GLenum asked = GL_BUFFER_BINDING;
        gl->f.GetProgramResourceName(name, GL_SHADER_STORAGE_BLOCK, (GLuint)i, LONGEST, NULL, text);
        gl->f.GetProgramResourceiv(name, GL_SHADER_STORAGE_BLOCK, (GLuint)i, 1, &asked, 1, NULL,
                                   &binding);
        if (!add_block(&program->buffers, binding, text)) return MOIT_GL_NO_MEMORY;
    }
    return MOIT_GL_OK;
}

/* ---- Compiling ------------------------------------------------------------------------------- */

static const GLenum stages[MOIT_GL_STAGES] = {GL_COMPUTE_SHADER, GL_VERTEX_SHADER,
                                              GL_FRAGMENT_SHADER};

moit_gl_status moit_gl_compile(moit_gl *gl, const char *const text[MOIT_GL_STAGES],
                               moit_gl_program **made, moit_gl_stage *failed) {
    *made = NULL;
    *failed = MOIT_GL_STAGES;
    bool compute = text[MOIT_GL_COMPUTE] != NULL;
    if (compute == (text[MOIT_GL_VERTEX] || text[MOIT_GL_FRAGMENT])
        || (!compute && !(text[MOIT_GL_VERTEX] && text[MOIT_GL_FRAGMENT])))
        return fail("stages: expected compute, or vertex and fragment");
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    moit_gl_program *program = calloc(1, sizeof *program);
    if (!program) return MOIT_GL_NO_MEMORY;
    program->compute = compute;
    char *log = NULL;
    GLint done = 0, length = 0;
    GLuint name = gl->f.CreateProgram();
    for (int i = 0; i < MOIT_GL_STAGES; ++i) {
        if (!text[i]) continue;
        GLuint shader = gl->f.CreateShader(stages[i]);
        gl->f.ShaderSource(shader, 1, &text[i], NULL);
        gl->f.CompileShader(shader);
        gl->f.GetShaderiv(shader, GL_COMPILE_STATUS, &done);
        if (!done) {
            *failed = (moit_gl_stage)i;
            gl->f.GetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
            if ((log = calloc((size_t)length + 1, 1)))
                gl->f.GetShaderInfoLog(shader, length, NULL, log);
        }
        gl->f.AttachShader(name, shader);
        gl->f.DeleteShader(shader); /* once the program lets go of it */
        if (!done) goto failed;
    }
    gl->f.LinkProgram(name);
    gl->f.GetProgramiv(name, GL_LINK_STATUS, &done);
    if (!done) {
        gl->f.GetProgramiv(name, GL_INFO_LOG_LENGTH, &length);
        if ((log = calloc((size_t)length + 1, 1))) gl->f.GetProgramInfoLog(name, length, NULL, log);
        goto failed;
    }
    if ((status = ask_for_uniforms(gl, name, program)) != MOIT_GL_OK
        || (status = ask_for_buffers(gl, name, program)) != MOIT_GL_OK
        || (status = end_gl(gl, "compiling a program")) != MOIT_GL_OK) {
        gl->f.DeleteProgram(name);
        free_all_but_name(program);
        return status;
    }
    enlist(gl, &program->object, A_PROGRAM, name);
    *made = program;
    return MOIT_GL_OK;
failed:
    gl->f.DeleteProgram(name);
    forget_errors(gl);
    free_all_but_name(program);
    status = log ? bad_shader(*log ? log : "the compiler gives no reason") : MOIT_GL_NO_MEMORY;
    free(log);
    return status;
}

/* ---- Uniforms -------------------------------------------------------------------------------- */

const moit_gl_uniform *moit_gl_find_uniform(const moit_gl_program *program, const char *name) {
    for (int i = 0; i < program->uniform_count; ++i)
        if (strcmp(program->uniforms[i].name, name) == 0) return &program->uniforms[i];
    return NULL;
}

moit_gl_status moit_gl_set_uniform(moit_gl_program *program, const moit_gl_uniform *uniform,
                                   const void *values, int length) {
    moit_gl *gl = program->object.gl;
    moit_gl_status status = begin_gl(gl);
    if (status != MOIT_GL_OK) return status;
    const gl_functions *f = &gl->f;
    GLuint name = program->object.name;
    GLint at = uniform->location;
    if (length > uniform->length) length = uniform->length; /* the rest was dropped */
#define SET(count, letters, type) \
    f->ProgramUniform##count##letters(name, at, length, (const type *)values)
#define SET_EACH(letters, type) \
    switch (uniform->components) { \
    case 1: SET(1, letters, type); break; \
    case 2: SET(2, letters, type); break; \
    case 3: SET(3, letters, type); break; \
    case 4: SET(4, letters, type); break; \
    default: break; \
    } \
    break
    switch (uniform->scalar) {
    case MOIT_GL_FLOAT32:
        if (uniform->components == 9) f->ProgramUniformMatrix3fv(name, at, length, 1, values);
        else if (uniform->components == 16) f->ProgramUniformMatrix4fv(name, at, length, 1, values);
        SET_EACH(fv, GLfloat);
    case MOIT_GL_FLOAT64: SET_EACH(dv, GLdouble);
    case MOIT_GL_UINT32: SET_EACH(uiv, GLuint);
    case MOIT_GL_INT32:
    case MOIT_GL_TRUTH: SET_EACH(iv, GLint);
    }
    return end_gl(gl, uniform->name);
}
