/* csrc/moit_gl.h: passes without Python, and everything given back. Where there is no OpenGL it
 * says so and is content. */
#include "expect.h"

#include "moit_gl.h"

/* For the leak sanitizer, where there is one: what Mesa and its compiler keep is not ours. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) {
    return "leak:_dri.so\nleak:libgallium\nleak:libEGL\nleak:libGL\nleak:libLLVM\nleak:libglapi\n"
           "leak:libdrm\nleak:libgbm\n";
}

static const char *const ADD = "#version 450\n"
                               "layout(local_size_x = 4) in;\n"
                               "layout(std430, binding = 1) buffer Sums { uint sums[]; };\n"
                               "uniform uint more;\n"
                               "void main() { sums[gl_GlobalInvocationID.x] += more; }\n";
static const char *const COVER =
    "#version 450\n"
    "void main() {\n"
    "    gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1);\n"
    "}\n";
static const char *const TINT = "#version 450\n"
                                "layout(location = 0) out vec4 color;\n"
                                "void main() { color = vec4(1, 2, 3, 4); }\n";

#define EXPECT_OK(call) EXPECT((call) == MOIT_GL_OK)
#define EXPECT_FAILED(call) EXPECT((call) == MOIT_GL_FAILED && *moit_gl_message())

static void sums_are_added(moit_gl *gl) {
    const char *const text[MOIT_GL_STAGES] = {[MOIT_GL_COMPUTE] = ADD};
    uint32_t sums[16], more = 5;
    for (uint32_t i = 0; i < 16; ++i) sums[i] = i;
    moit_gl_stage failed;
    moit_gl_program *program = NULL;
    moit_gl_buffer *buffer = NULL;
    EXPECT_OK(moit_gl_compile(gl, text, &program, &failed));
    EXPECT_OK(moit_gl_make_buffer(gl, sizeof sums, sums, sizeof sums, &buffer));
    const moit_gl_uniform *uniform = moit_gl_find_uniform(program, "more");
    EXPECT(uniform && uniform->scalar == MOIT_GL_UINT32);
    EXPECT(!moit_gl_find_uniform(program, "less"));
    EXPECT_OK(moit_gl_set_uniform(program, uniform, &more, 1));
    moit_gl_bindings bindings = {.buffers[1] = {.buffer = buffer}};
    EXPECT_OK(moit_gl_dispatch(gl, program, (int64_t[3]){4, 1, 1}, &bindings));
    EXPECT_FAILED(moit_gl_dispatch(gl, program, (int64_t[3]){1 << 20, 1, 1}, &bindings));
    EXPECT_FAILED(
        moit_gl_dispatch(gl, program, (int64_t[3]){4, 1, 1}, &(moit_gl_bindings){.images = {0}}));
    EXPECT_OK(moit_gl_read_buffer(buffer, 0, sizeof sums, sums));
    for (uint32_t i = 0; i < 16; ++i) EXPECT(sums[i] == i + more);
    EXPECT_FAILED(moit_gl_read_buffer(buffer, 1, sizeof sums, sums));
    moit_gl_free_buffer(buffer);
    moit_gl_free_program(program);
}

static void targets_are_drawn_to(moit_gl *gl) {
    const char *const text[MOIT_GL_STAGES] = {[MOIT_GL_VERTEX] = COVER, [MOIT_GL_FRAGMENT] = TINT};
    moit_gl_stage failed;
    moit_gl_program *program = NULL;
    moit_gl_texture *texture = NULL;
    EXPECT_OK(moit_gl_compile(gl, text, &program, &failed));
    EXPECT_OK(moit_gl_make_texture(gl, "rgba16f", 5, 3, &texture));
    EXPECT_OK(moit_gl_clear_texture(texture, (double[4]){1.0, 1.0, 1.0, 1.0}));
    moit_gl_drawing drawing = {.vertices = 3, .targets = 1, .target[0] = {texture, MOIT_GL_ADD}};
    int ticket;
    EXPECT_OK(moit_gl_begin_time(gl));
    EXPECT_OK(moit_gl_draw(gl, program, &drawing, &(moit_gl_bindings){.images = {0}}));
    EXPECT_OK(moit_gl_end_time(gl, &ticket));
    double seconds = -1.0;
    EXPECT_OK(moit_gl_seconds(gl, ticket, &seconds));
    EXPECT(seconds >= 0.0);
    float pixels[60];
    EXPECT_OK(moit_gl_read_texture(texture, MOIT_GL_ITEM_FLOAT32, 60, pixels));
    for (int i = 0; i < 60; ++i) EXPECT_NEAR((double)pixels[i], 2.0 + i % 4, 0.0);
    EXPECT_FAILED(moit_gl_read_texture(texture, MOIT_GL_ITEM_UINT32, 60, pixels));
    EXPECT_FAILED(moit_gl_make_texture(gl, "rgba99", 5, 3, &(moit_gl_texture *){0}));
    moit_gl_free_texture(texture);
    moit_gl_free_program(program);
}

static void wrong_shaders_have_a_log(moit_gl *gl) {
    const char *const text[MOIT_GL_STAGES] = {
        [MOIT_GL_VERTEX] = COVER, [MOIT_GL_FRAGMENT] = "#version 450\nvoid main() { wrong = 1; }"};
    moit_gl_stage failed;
    moit_gl_program *program = NULL;
    EXPECT(moit_gl_compile(gl, text, &program, &failed) == MOIT_GL_BAD_SHADER);
    EXPECT(failed == MOIT_GL_FRAGMENT && !program && strstr(moit_gl_message(), "wrong"));
}

static void a_device(void) {
    moit_gl *gl = NULL;
    moit_gl_buffer *left = NULL;
    EXPECT_OK(moit_gl_open(MOIT_GL_ANY, &gl));
    if (!gl) return;
    EXPECT_FAILED(moit_gl_make_buffer(gl, 4, NULL, 0, &left)); /* not entered */
    EXPECT_OK(moit_gl_enter(gl));
    EXPECT_OK(moit_gl_enter(gl));
    sums_are_added(gl);
    targets_are_drawn_to(gl);
    wrong_shaders_have_a_log(gl);
    moit_gl *foreign = NULL;
    EXPECT_OK(moit_gl_open(MOIT_GL_ADOPT, &foreign));
    EXPECT_OK(moit_gl_enter(foreign));
    sums_are_added(foreign);
    targets_are_drawn_to(foreign);
    EXPECT_OK(moit_gl_exit(foreign));
    moit_gl_free(foreign);
    EXPECT_OK(moit_gl_make_buffer(gl, 4, NULL, 0, &left));
    EXPECT_OK(moit_gl_exit(gl));
    EXPECT_OK(moit_gl_exit(gl));
    EXPECT_FAILED(moit_gl_exit(gl));
    moit_gl_free_buffer(left); /* goes with the context */
    EXPECT_OK(moit_gl_close(gl));
    EXPECT_FAILED(moit_gl_enter(gl));
    moit_gl_free(gl);
}

int main(void) {
    moit_gl *none = NULL;
    EXPECT_FAILED(moit_gl_open(1 << 20, &none));
    EXPECT(!none);
    if (moit_gl_open(MOIT_GL_ANY, &none) == MOIT_GL_FAILED) {
        fprintf(stderr, "not tested: %s\n", moit_gl_message());
        return verdict();
    }
    moit_gl_free(none);
    for (int i = 0; i < 3; ++i) a_device();
    moit_gl_free(NULL);
    return verdict();
}
