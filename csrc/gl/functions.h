/* The functions and constants of EGL 1.5 and OpenGL 4.5 that the driver uses, and no more, so that
 * it needs no GL header. Functions are found at run time: nothing links libEGL or libGL. */
#ifndef MOIT_GL_FUNCTIONS_H
#define MOIT_GL_FUNCTIONS_H

#include <stddef.h>
#include <stdint.h>

typedef unsigned GLenum, GLuint, GLbitfield;
typedef int GLint, GLsizei;
typedef unsigned char GLboolean, GLubyte;
typedef char GLchar;
typedef float GLfloat;
typedef double GLdouble;
typedef uint64_t GLuint64;
typedef ptrdiff_t GLintptr, GLsizeiptr;

typedef unsigned EGLBoolean, EGLenum;
typedef int32_t EGLint;
typedef intptr_t EGLAttrib;
typedef void *EGLDisplay, *EGLContext, *EGLSurface, *EGLConfig, *EGLDeviceEXT;

/* X(result, name without egl, arguments) */
#define EGL_FUNCTIONS(X) \
    X(EGLBoolean, BindAPI, (EGLenum)) \
    X(EGLBoolean, ChooseConfig, (EGLDisplay, const EGLint *, EGLConfig *, EGLint, EGLint *)) \
    X(EGLContext, CreateContext, (EGLDisplay, EGLConfig, EGLContext, const EGLint *)) \
    X(EGLSurface, CreatePbufferSurface, (EGLDisplay, EGLConfig, const EGLint *)) \
    X(EGLBoolean, DestroyContext, (EGLDisplay, EGLContext)) \
    X(EGLBoolean, DestroySurface, (EGLDisplay, EGLSurface)) \
    X(EGLContext, GetCurrentContext, (void)) \
    X(EGLDisplay, GetCurrentDisplay, (void)) \
    X(EGLSurface, GetCurrentSurface, (EGLint)) \
    X(EGLint, GetError, (void)) \
    X(EGLBoolean, Initialize, (EGLDisplay, EGLint *, EGLint *)) \
    X(EGLBoolean, MakeCurrent, (EGLDisplay, EGLSurface, EGLSurface, EGLContext)) \
    X(EGLenum, QueryAPI, (void)) \
    X(const char *, QueryString, (EGLDisplay, EGLint))

/* Those of extensions, which are asked for by the extension's name. */
#define EGL_EXTENSION_FUNCTIONS(X) \
    X(EGLDisplay, GetPlatformDisplayEXT, (EGLenum, void *, const EGLint *)) \
    X(EGLBoolean, QueryDevicesEXT, (EGLint, EGLDeviceEXT *, EGLint *)) \
    X(const char *, QueryDeviceStringEXT, (EGLDeviceEXT, EGLint))

/* X(result, name without gl, arguments) */
#define GL_FUNCTIONS(X) \
    X(void, ActiveTexture, (GLenum)) \
    X(void, AttachShader, (GLuint, GLuint)) \
    X(void, BindBuffer, (GLenum, GLuint)) \
    X(void, BindBufferBase, (GLenum, GLuint, GLuint)) \
    X(void, BindBufferRange, (GLenum, GLuint, GLuint, GLintptr, GLsizeiptr)) \
    X(void, BindFramebuffer, (GLenum, GLuint)) \
    X(void, BindImageTexture, (GLuint, GLuint, GLint, GLboolean, GLint, GLenum, GLenum)) \
    X(void, BindSampler, (GLuint, GLuint)) \
    X(void, BindTexture, (GLenum, GLuint)) \
    X(void, BindTextureUnit, (GLuint, GLuint)) \
    X(void, BindVertexArray, (GLuint)) \
    X(void, BlendEquationSeparatei, (GLuint, GLenum, GLenum)) \
    X(void, BlendFuncSeparatei, (GLuint, GLenum, GLenum, GLenum, GLenum)) \
    X(GLenum, CheckNamedFramebufferStatus, (GLuint, GLenum)) \
    X(void, ClearNamedBufferData, (GLuint, GLenum, GLenum, GLenum, const void *)) \
    X(void, ClearTexImage, (GLuint, GLint, GLenum, GLenum, const void *)) \
    X(void, ClipControl, (GLenum, GLenum)) \
    X(void, ColorMaski, (GLuint, GLboolean, GLboolean, GLboolean, GLboolean)) \
    X(void, CompileShader, (GLuint)) \
    X(void, CreateBuffers, (GLsizei, GLuint *)) \
    X(void, CreateFramebuffers, (GLsizei, GLuint *)) \
    X(GLuint, CreateProgram, (void)) \
    X(void, CreateQueries, (GLenum, GLsizei, GLuint *)) \
    X(void, CreateSamplers, (GLsizei, GLuint *)) \
    X(GLuint, CreateShader, (GLenum)) \
    X(void, CreateTextures, (GLenum, GLsizei, GLuint *)) \
    X(void, CreateVertexArrays, (GLsizei, GLuint *)) \
    X(void, DeleteBuffers, (GLsizei, const GLuint *)) \
    X(void, DeleteFramebuffers, (GLsizei, const GLuint *)) \
    X(void, DeleteProgram, (GLuint)) \
    X(void, DeleteQueries, (GLsizei, const GLuint *)) \
    X(void, DeleteSamplers, (GLsizei, const GLuint *)) \
    X(void, DeleteShader, (GLuint)) \
    X(void, DeleteTextures, (GLsizei, const GLuint *)) \
    X(void, DeleteVertexArrays, (GLsizei, const GLuint *)) \
    X(void, DepthFunc, (GLenum)) \
    X(void, DepthMask, (GLboolean)) \
    X(void, DepthRangeIndexed, (GLuint, GLdouble, GLdouble)) \
    X(void, DetachShader, (GLuint, GLuint)) \
    X(void, Disable, (GLenum)) \
    X(void, Disablei, (GLenum, GLuint)) \
    X(void, DispatchCompute, (GLuint, GLuint, GLuint)) \
    X(void, DrawArrays, (GLenum, GLint, GLsizei)) \
    X(void, Enable, (GLenum)) \
    X(void, Enablei, (GLenum, GLuint)) \
    X(void, Finish, (void)) \
    X(void, GetActiveUniform, (GLuint, GLuint, GLsizei, GLsizei *, GLint *, GLenum *, GLchar *)) \
    X(void, GetBooleani_v, (GLenum, GLuint, GLboolean *)) \
    X(void, GetBooleanv, (GLenum, GLboolean *)) \
    X(void, GetDoublei_v, (GLenum, GLuint, GLdouble *)) \
    X(GLenum, GetError, (void)) \
    X(void, GetFloati_v, (GLenum, GLuint, GLfloat *)) \
    X(void, GetInteger64i_v, (GLenum, GLuint, int64_t *)) \
    X(void, GetInteger64v, (GLenum, int64_t *)) \
    X(void, GetIntegeri_v, (GLenum, GLuint, GLint *)) \
    X(void, GetIntegerv, (GLenum, GLint *)) \
    X(void, GetNamedBufferParameteri64v, (GLuint, GLenum, int64_t *)) \
    X(void, GetNamedBufferSubData, (GLuint, GLintptr, GLsizeiptr, void *)) \
    X(void, GetProgramInfoLog, (GLuint, GLsizei, GLsizei *, GLchar *)) \
    X(void, GetProgramInterfaceiv, (GLuint, GLenum, GLenum, GLint *)) \
    X(void, GetProgramResourceName, (GLuint, GLenum, GLuint, GLsizei, GLsizei *, GLchar *)) \
    X(void, GetProgramResourceiv, \
      (GLuint, GLenum, GLuint, GLsizei, const GLenum *, GLsizei, GLsizei *, GLint *)) \
    X(void, GetProgramiv, (GLuint, GLenum, GLint *)) \
    X(void, GetQueryObjectui64v, (GLuint, GLenum, GLuint64 *)) \
    X(void, GetShaderInfoLog, (GLuint, GLsizei, GLsizei *, GLchar *)) \
    X(void, GetShaderiv, (GLuint, GLenum, GLint *)) \
    X(const GLubyte *, GetString, (GLenum)) \
    X(const GLubyte *, GetStringi, (GLenum, GLuint)) \
    X(void, GetTextureImage, (GLuint, GLint, GLenum, GLenum, GLsizei, void *)) \
    X(void, GetTextureLevelParameteriv, (GLuint, GLint, GLenum, GLint *)) \
    X(void, GetTextureParameteriv, (GLuint, GLenum, GLint *)) \
    X(GLint, GetUniformLocation, (GLuint, const GLchar *)) \
    X(void, GetUniformiv, (GLuint, GLint, GLint *)) \
    X(GLboolean, IsEnabled, (GLenum)) \
    X(GLboolean, IsEnabledi, (GLenum, GLuint)) \
    X(GLboolean, IsTexture, (GLuint)) \
    X(void, LinkProgram, (GLuint)) \
    X(void, MemoryBarrier, (GLbitfield)) \
    X(void, NamedBufferStorage, (GLuint, GLsizeiptr, const void *, GLbitfield)) \
    X(void, NamedBufferSubData, (GLuint, GLintptr, GLsizeiptr, const void *)) \
    X(void, NamedFramebufferDrawBuffers, (GLuint, GLsizei, const GLenum *)) \
    X(void, NamedFramebufferParameteri, (GLuint, GLenum, GLint)) \
    X(void, NamedFramebufferTexture, (GLuint, GLenum, GLuint, GLint)) \
    X(void, PixelStorei, (GLenum, GLint)) \
    X(void, PolygonMode, (GLenum, GLenum)) \
    X(void, ProgramUniform1iv, (GLuint, GLint, GLsizei, const GLint *)) \
    X(void, ProgramUniform2iv, (GLuint, GLint, GLsizei, const GLint *)) \
    X(void, ProgramUniform3iv, (GLuint, GLint, GLsizei, const GLint *)) \
    X(void, ProgramUniform4iv, (GLuint, GLint, GLsizei, const GLint *)) \
    X(void, ProgramUniform1uiv, (GLuint, GLint, GLsizei, const GLuint *)) \
    X(void, ProgramUniform2uiv, (GLuint, GLint, GLsizei, const GLuint *)) \
    X(void, ProgramUniform3uiv, (GLuint, GLint, GLsizei, const GLuint *)) \
    X(void, ProgramUniform4uiv, (GLuint, GLint, GLsizei, const GLuint *)) \
    X(void, ProgramUniform1fv, (GLuint, GLint, GLsizei, const GLfloat *)) \
    X(void, ProgramUniform2fv, (GLuint, GLint, GLsizei, const GLfloat *)) \
    X(void, ProgramUniform3fv, (GLuint, GLint, GLsizei, const GLfloat *)) \
    X(void, ProgramUniform4fv, (GLuint, GLint, GLsizei, const GLfloat *)) \
    X(void, ProgramUniform1dv, (GLuint, GLint, GLsizei, const GLdouble *)) \
    X(void, ProgramUniform2dv, (GLuint, GLint, GLsizei, const GLdouble *)) \
    X(void, ProgramUniform3dv, (GLuint, GLint, GLsizei, const GLdouble *)) \
    X(void, ProgramUniform4dv, (GLuint, GLint, GLsizei, const GLdouble *)) \
    X(void, ProgramUniformMatrix3fv, (GLuint, GLint, GLsizei, GLboolean, const GLfloat *)) \
    X(void, ProgramUniformMatrix4fv, (GLuint, GLint, GLsizei, GLboolean, const GLfloat *)) \
    X(void, ProvokingVertex, (GLenum)) \
    X(void, QueryCounter, (GLuint, GLenum)) \
    X(void, SamplerParameteri, (GLuint, GLenum, GLint)) \
    X(void, ShaderSource, (GLuint, GLsizei, const GLchar *const *, const GLint *)) \
    X(void, TextureParameteri, (GLuint, GLenum, GLint)) \
    X(void, TextureStorage2D, (GLuint, GLsizei, GLenum, GLsizei, GLsizei)) \
    X(void, TextureSubImage2D, \
      (GLuint, GLint, GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, const void *)) \
    X(void, UseProgram, (GLuint)) \
    X(void, ViewportIndexedf, (GLuint, GLfloat, GLfloat, GLfloat, GLfloat))

#define MEMBER(result, name, arguments) result(*name) arguments;
typedef struct {
    EGL_FUNCTIONS(MEMBER)
    EGL_EXTENSION_FUNCTIONS(MEMBER) /* NULL where there is no such extension */
    void (*(*GetProcAddress)(const char *))(void);
} egl_functions;
typedef struct {
    GL_FUNCTIONS(MEMBER)
} gl_functions;
#undef MEMBER

enum {
    EGL_SUCCESS = 0x3000,
    EGL_NOT_INITIALIZED = 0x3001,
    EGL_BAD_ACCESS = 0x3002,
    EGL_BAD_ALLOC = 0x3003,
    EGL_BAD_CONTEXT = 0x3006,
    EGL_CONTEXT_LOST = 0x300E,
    EGL_SURFACE_TYPE = 0x3033,
    EGL_PBUFFER_BIT = 1,
    EGL_NONE = 0x3038,
    EGL_RENDERABLE_TYPE = 0x3040,
    EGL_OPENGL_BIT = 8,
    EGL_EXTENSIONS = 0x3055,
    EGL_HEIGHT = 0x3056,
    EGL_WIDTH = 0x3057,
    EGL_DRAW = 0x3059,
    EGL_READ = 0x305A,
    EGL_CONTEXT_MAJOR_VERSION = 0x3098,
    EGL_OPENGL_API = 0x30A2,
    EGL_CONTEXT_MINOR_VERSION = 0x30FB,
    EGL_CONTEXT_OPENGL_PROFILE_MASK = 0x30FD,
    EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT = 1,
    EGL_PLATFORM_SURFACELESS_MESA = 0x31DD,
    EGL_PLATFORM_DEVICE_EXT = 0x313F,
};

enum {
    GL_TRIANGLES = 0x0004,
    GL_ZERO = 0,
    GL_ONE = 1,
    GL_SRC_COLOR = 0x0300,
    GL_ONE_MINUS_SRC_COLOR = 0x0301,
    GL_ONE_MINUS_SRC_ALPHA = 0x0303,
    GL_ONE_MINUS_DST_ALPHA = 0x0305,
    GL_LESS = 0x0201,
    GL_LEQUAL = 0x0203,
    GL_ALWAYS = 0x0207,
    GL_FRONT_AND_BACK = 0x0408,
    GL_INVALID_ENUM = 0x0500,
    GL_INVALID_VALUE = 0x0501,
    GL_INVALID_OPERATION = 0x0502,
    GL_OUT_OF_MEMORY = 0x0505,
    GL_INVALID_FRAMEBUFFER_OPERATION = 0x0506,
    GL_CONTEXT_LOST = 0x0507,
    GL_POLYGON_MODE = 0x0B40,
    GL_CULL_FACE = 0x0B44,
    GL_DEPTH_RANGE = 0x0B70,
    GL_DEPTH_TEST = 0x0B71,
    GL_DEPTH_WRITEMASK = 0x0B72,
    GL_DEPTH_FUNC = 0x0B74,
    GL_STENCIL_TEST = 0x0B90,
    GL_VIEWPORT = 0x0BA2,
    GL_BLEND = 0x0BE2,
    GL_COLOR_LOGIC_OP = 0x0BF2,
    GL_SCISSOR_TEST = 0x0C11,
    GL_COLOR_WRITEMASK = 0x0C23,
    GL_UNPACK_SWAP_BYTES = 0x0CF0,
    GL_UNPACK_LSB_FIRST,
    GL_UNPACK_ROW_LENGTH,
    GL_UNPACK_SKIP_ROWS,
    GL_UNPACK_SKIP_PIXELS,
    GL_UNPACK_ALIGNMENT,
    GL_PACK_SWAP_BYTES = 0x0D00,
    GL_PACK_LSB_FIRST,
    GL_PACK_ROW_LENGTH,
    GL_PACK_SKIP_ROWS,
    GL_PACK_SKIP_PIXELS,
    GL_PACK_ALIGNMENT,
    GL_MAX_TEXTURE_SIZE = 0x0D33,
    GL_TEXTURE_2D = 0x0DE1,
    GL_TEXTURE_WIDTH = 0x1000,
    GL_TEXTURE_HEIGHT = 0x1001,
    GL_TEXTURE_INTERNAL_FORMAT = 0x1003,
    GL_UNSIGNED_BYTE = 0x1401,
    GL_UNSIGNED_SHORT = 0x1403,
    GL_INT = 0x1404,
    GL_UNSIGNED_INT = 0x1405,
    GL_FLOAT = 0x1406,
    GL_DOUBLE = 0x140A,
    GL_HALF_FLOAT = 0x140B,
    GL_DEPTH_COMPONENT = 0x1902,
    GL_RED = 0x1903,
    GL_RGB = 0x1907,
    GL_RGBA = 0x1908,
    GL_FILL = 0x1B02,
    GL_VENDOR = 0x1F00,
    GL_RENDERER = 0x1F01,
    GL_VERSION = 0x1F02,
    GL_NEAREST = 0x2600,
    GL_TEXTURE_MAG_FILTER = 0x2800,
    GL_TEXTURE_MIN_FILTER = 0x2801,
    GL_TEXTURE_WRAP_S = 0x2802,
    GL_TEXTURE_WRAP_T = 0x2803,
    GL_POLYGON_OFFSET_FILL = 0x8037,
    GL_CLIP_DISTANCE0 = 0x3000,
    GL_FUNC_ADD = 0x8006,
    GL_MIN = 0x8007,
    GL_MAX = 0x8008,
    GL_BLEND_EQUATION_RGB = 0x8009,
    GL_TEXTURE_BINDING_2D = 0x8069,
    GL_PACK_SKIP_IMAGES = 0x806B,
    GL_PACK_IMAGE_HEIGHT = 0x806C,
    GL_UNPACK_SKIP_IMAGES = 0x806D,
    GL_UNPACK_IMAGE_HEIGHT = 0x806E,
    GL_BLEND_DST_RGB = 0x80C8,
    GL_BLEND_SRC_RGB = 0x80C9,
    GL_BLEND_DST_ALPHA = 0x80CA,
    GL_BLEND_SRC_ALPHA = 0x80CB,
    GL_CLAMP_TO_EDGE = 0x812F,
    GL_MAJOR_VERSION = 0x821B,
    GL_MINOR_VERSION = 0x821C,
    GL_NUM_EXTENSIONS = 0x821D,
    GL_RG = 0x8227,
    GL_RG_INTEGER = 0x8228,
    GL_TEXTURE0 = 0x84C0,
    GL_ACTIVE_TEXTURE = 0x84E0,
    GL_VERTEX_ARRAY_BINDING = 0x85B5,
    GL_PROGRAM_POINT_SIZE = 0x8642,
    GL_DEPTH_CLAMP = 0x864F,
    GL_BUFFER_SIZE = 0x8764,
    GL_QUERY_RESULT = 0x8866,
    GL_MAX_DRAW_BUFFERS = 0x8824,
    GL_BLEND_EQUATION_ALPHA = 0x883D,
    GL_READ_WRITE = 0x88BA,
    GL_PIXEL_PACK_BUFFER = 0x88EB,
    GL_PIXEL_UNPACK_BUFFER = 0x88EC,
    GL_PIXEL_PACK_BUFFER_BINDING = 0x88ED,
    GL_PIXEL_UNPACK_BUFFER_BINDING = 0x88EF,
    GL_SAMPLER_BINDING = 0x8919,
    GL_FRAGMENT_SHADER = 0x8B30,
    GL_VERTEX_SHADER = 0x8B31,
    GL_COMPILE_STATUS = 0x8B81,
    GL_LINK_STATUS = 0x8B82,
    GL_INFO_LOG_LENGTH = 0x8B84,
    GL_ACTIVE_UNIFORMS = 0x8B86,
    GL_CURRENT_PROGRAM = 0x8B8D,
    GL_RASTERIZER_DISCARD = 0x8C89,
    GL_FRAMEBUFFER_BINDING = 0x8CA6,
    GL_READ_FRAMEBUFFER = 0x8CA8,
    GL_DRAW_FRAMEBUFFER = 0x8CA9,
    GL_READ_FRAMEBUFFER_BINDING = 0x8CAA,
    GL_FRAMEBUFFER_COMPLETE = 0x8CD5,
    GL_FRAMEBUFFER_UNSUPPORTED = 0x8CDD,
    GL_COLOR_ATTACHMENT0 = 0x8CE0,
    GL_DEPTH_ATTACHMENT = 0x8D00,
    GL_RED_INTEGER = 0x8D94,
    GL_RGBA_INTEGER = 0x8D99,
    GL_FRAMEBUFFER_SRGB = 0x8DB9,
    GL_TIMESTAMP = 0x8E28,
    GL_PROVOKING_VERTEX = 0x8E4F,
    GL_LAST_VERTEX_CONVENTION = 0x8E4E,
    GL_MAX_IMAGE_UNITS = 0x8F38,
    GL_IMAGE_BINDING_NAME = 0x8F3A,
    GL_IMAGE_BINDING_LEVEL = 0x8F3B,
    GL_IMAGE_BINDING_LAYERED = 0x8F3C,
    GL_IMAGE_BINDING_LAYER = 0x8F3D,
    GL_IMAGE_BINDING_ACCESS = 0x8F3E,
    GL_IMAGE_BINDING_FORMAT = 0x906E,
    GL_TEXTURE_TARGET = 0x1006,
    GL_SHADER_STORAGE_BUFFER = 0x90D2,
    GL_SHADER_STORAGE_BUFFER_BINDING = 0x90D3,
    GL_SHADER_STORAGE_BUFFER_START = 0x90D4,
    GL_SHADER_STORAGE_BUFFER_SIZE = 0x90D5,
    GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS = 0x90DD,
    GL_MAX_SHADER_STORAGE_BLOCK_SIZE = 0x90DE,
    GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT = 0x90DF,
    GL_COMPUTE_SHADER = 0x91B9,
    GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS = 0x90DB,
    GL_MAX_COMPUTE_WORK_GROUP_COUNT = 0x91BE,
    GL_MAX_TEXTURE_IMAGE_UNITS = 0x8872,
    GL_BUFFER_BINDING = 0x9302,
    GL_FRAMEBUFFER_DEFAULT_WIDTH = 0x9310,
    GL_FRAMEBUFFER_DEFAULT_HEIGHT = 0x9311,
    GL_SHADER_STORAGE_BLOCK = 0x92E6,
    GL_ACTIVE_RESOURCES = 0x92F5,
    GL_DYNAMIC_STORAGE_BIT = 0x0100,
    GL_CLIP_ORIGIN = 0x935C,
    GL_CLIP_DEPTH_MODE = 0x935D,
    GL_LOWER_LEFT = 0x8CA1,
    GL_NEGATIVE_ONE_TO_ONE = 0x935E,
};
#define GL_ALL_BARRIER_BITS 0xFFFFFFFFu
#define GL_R32UI 0x8236u

#endif
