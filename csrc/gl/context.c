/* Contexts: opened on a device or adopted, entered and left, closed. */
#include "driver.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_DEVICES = 64 };
#define FORKED "the device was opened before this process was forked; open a new one here"

/* ---- Between begin and end ------------------------------------------------------------------- */

moit_gl_status begin_gl(moit_gl *gl) {
    if (gl->process != getpid()) return fail(FORKED);
    pthread_mutex_lock(&gl->lock);
    bool closed = gl->closed, entered = gl->innermost != NULL,
         here = entered && pthread_equal(gl->thread, pthread_self());
    level *innermost = gl->innermost;
    pthread_mutex_unlock(&gl->lock);
    if (closed) return fail("the device was closed; open a new one");
    if (!here)
        return entered ? fail("the device is in use by another thread; open one for each thread")
                       : fail("the device has not been entered; use it within `with device:`");
    if (gl->egl->GetCurrentContext() != gl->context)
        return fail("the context of the device is no longer current: something within "
                    "`with device:` made another current, or none");
    if (gl->foreign && !innermost->state) {
        forget_errors(gl);
        if (!(innermost->state = capture_state(gl))) return MOIT_GL_NO_MEMORY;
    }
    return MOIT_GL_OK;
}

moit_gl_status end_gl(moit_gl *gl, const char *what) {
    GLenum error = gl->f.GetError();
    if (!error) return MOIT_GL_OK;
    forget_errors(gl);
    return fail("%s: %s (GL error 0x%04x)", what, gl_error_words(error), error);
}

/* ---- Current or not -------------------------------------------------------------------------- */

static level as_it_is(const egl_functions *egl) {
    return (level){.display = egl->GetCurrentDisplay(),
                   .context = egl->GetCurrentContext(),
                   .draw = egl->GetCurrentSurface(EGL_DRAW),
                   .read = egl->GetCurrentSurface(EGL_READ),
                   .api = egl->QueryAPI()};
}

static bool make_current(moit_gl *gl) {
    return gl->egl->BindAPI(EGL_OPENGL_API)
           && gl->egl->MakeCurrent(gl->display, gl->surface, gl->surface, gl->context);
}

static void make_as_it_was(const egl_functions *egl, EGLDisplay display, const level *was) {
    if (was->api) egl->BindAPI(was->api);
    /* its owner may have destroyed it while it was current; then it is no more, and ours must not
     * stay in its place */
    if (!was->context || !egl->MakeCurrent(was->display, was->draw, was->read, was->context))
        egl->MakeCurrent(display, NULL, NULL, NULL);
}

moit_gl_status moit_gl_enter(moit_gl *gl) {
    if (gl->process != getpid()) return fail(FORKED);
    moit_gl_status status = MOIT_GL_OK;
    level *entered = malloc(sizeof *entered);
    if (!entered) return MOIT_GL_NO_MEMORY;
    pthread_mutex_lock(&gl->lock);
    if (gl->closed) {
        status = fail("the device was closed; open a new one");
    } else if (gl->innermost && !pthread_equal(gl->thread, pthread_self())) {
        status = fail("the device is in use by another thread; open one for each thread");
    } else {
        *entered = as_it_is(gl->egl);
        if (entered->context == gl->context) {
            /* as it should be */
        } else if (gl->adopted) {
            status = fail("the adopted context is not current in this thread; make it current, or "
                          "adopt the one that is");
        } else if (!make_current(gl)) {
            EGLint error = gl->egl->GetError();
            status = fail("the context of the device cannot be made current: %s (EGL error 0x%04x)",
                          egl_error_words(error), error);
            if (entered->api) gl->egl->BindAPI(entered->api);
        }
    }
    if (status == MOIT_GL_OK) {
        entered->outer = gl->innermost;
        entered->state = NULL;
        gl->innermost = entered;
        gl->thread = pthread_self();
    }
    pthread_mutex_unlock(&gl->lock);
    if (status != MOIT_GL_OK) {
        free(entered);
        return status;
    }
    if (gl->dead) delete_dead(gl);
    return MOIT_GL_OK;
}

moit_gl_status moit_gl_exit(moit_gl *gl) {
    if (gl->process != getpid()) return MOIT_GL_OK; /* there is nothing to undo here */
    pthread_mutex_lock(&gl->lock);
    level *left = gl->innermost;
    bool here = left && pthread_equal(gl->thread, pthread_self());
    if (here) gl->innermost = left->outer;
    pthread_mutex_unlock(&gl->lock);
    if (!here) return fail("exit without enter in this thread");
    if (left->state && !gl->closed && gl->egl->GetCurrentContext() == gl->context)
        restore_state(gl, left->state);
    if (left->context != gl->egl->GetCurrentContext()) make_as_it_was(gl->egl, gl->display, left);
    free(left->state);
    free(left);
    return MOIT_GL_OK;
}

/* ---- Opening --------------------------------------------------------------------------------- */

static bool load_gl(moit_gl *gl) {
    const char *missing = NULL;
#define ASK(result, function, arguments) \
    gl->f.function = (result(*) arguments)gl->egl->GetProcAddress("gl" #function); \
    if (!gl->f.function) missing = "gl" #function;
    GL_FUNCTIONS(ASK)
#undef ASK
    if (missing) fail("the driver has no function %s", missing);
    return !missing;
}

/* Of a context that is current. Function pointers tell nothing: some libraries have one for any
 * name. Versions do. */
static moit_gl_status look_around(moit_gl *gl) {
    if (!load_gl(gl)) return MOIT_GL_FAILED;
    forget_errors(gl);
    static const GLenum asked[] = {GL_RENDERER, GL_VENDOR, GL_VERSION};
    for (int i = 0; i < 3; ++i) {
        const char *name = (const char *)gl->f.GetString(asked[i]);
        if (!name) return fail("the context does not say what it is");
        if (!(gl->names[i] = strdup(name))) return MOIT_GL_NO_MEMORY;
    }
    GLint major = 0, minor = 0;
    gl->f.GetIntegerv(GL_MAJOR_VERSION, &major);
    gl->f.GetIntegerv(GL_MINOR_VERSION, &minor);
    if (strncmp(gl->names[2], "OpenGL ES", 9) == 0 || 10 * major + minor < 45)
        return fail("%s has OpenGL %s; 4.5 is needed: install a newer driver, or use Mesa's "
                    "llvmpipe (package libgl1-mesa-dri)",
                    gl->names[0], gl->names[2]);
    moit_gl_info *info = &gl->info;
    *info = (moit_gl_info){.renderer = gl->names[0],
                           .vendor = gl->names[1],
                           .version = gl->names[2],
                           .platform = gl->platform};
    static const char *const processors[] = {"llvmpipe", "softpipe", "swrast", "SwiftShader",
                                             "Software Rasterizer"};
    for (size_t i = 0; i < sizeof processors / sizeof *processors; ++i)
        if (strstr(info->renderer, processors[i])) info->software = true;
    gl->f.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &info->storage_bytes);
    gl->f.GetInteger64v(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &info->storage_alignment);
    GLint groups = 0;
    gl->f.GetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &groups);
    info->groups = groups;
    gl->f.GetIntegerv(GL_MAX_TEXTURE_SIZE, &info->texture_side);
    gl->f.GetIntegerv(GL_MAX_DRAW_BUFFERS, &info->color_targets);
    gl->f.GetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &info->storage_blocks);
    gl->f.GetIntegerv(GL_NUM_EXTENSIONS, &info->extensions);
    if (info->color_targets > MOIT_GL_TARGETS) info->color_targets = MOIT_GL_TARGETS;
    if (info->storage_blocks > MOIT_GL_BUFFERS) info->storage_blocks = MOIT_GL_BUFFERS;
    return end_gl(gl, "asking for limits");
}

/* A context of a display, looked at and left again. */
static moit_gl_status open_on(moit_gl *gl, EGLDisplay display) {
    const egl_functions *egl = gl->egl;
    EGLint version[2];
    if (!display || !egl->Initialize(display, &version[0], &version[1]))
        return fail("its driver does not start (EGL error 0x%04x)", egl->GetError());
    const char *extensions = egl->QueryString(display, EGL_EXTENSIONS);
    bool surfaceless = listed(extensions, "EGL_KHR_surfaceless_context"),
         configless = listed(extensions, "EGL_KHR_no_config_context")
                      || listed(extensions, "EGL_MESA_configless_context");
    EGLConfig config = NULL;
    if (!configless || !surfaceless) {
        const EGLint wanted[] = {EGL_SURFACE_TYPE, surfaceless ? 0 : EGL_PBUFFER_BIT,
                                 EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
        EGLint count = 0;
        if (!egl->ChooseConfig(display, wanted, &config, 1, &count) || count < 1)
            return fail("its driver has no configuration for OpenGL");
    }
    level was = as_it_is(egl);
    moit_gl_status status;
    if (!egl->BindAPI(EGL_OPENGL_API)) {
        status = fail("its driver has no OpenGL, only OpenGL ES");
        goto done;
    }
    static const EGLint version45[] = {EGL_CONTEXT_MAJOR_VERSION,
                                       4,
                                       EGL_CONTEXT_MINOR_VERSION,
                                       5,
                                       EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                       EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                       EGL_NONE};
    gl->display = display;
    if (!surfaceless) {
        static const EGLint one_pixel[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
        gl->surface = egl->CreatePbufferSurface(display, config, one_pixel);
    }
    gl->context = egl->CreateContext(display, config, NULL, version45);
    if (!gl->context) {
        status =
            fail("its driver makes no context of OpenGL 4.5 (EGL error 0x%04x)", egl->GetError());
        goto done;
    }
    if (!make_current(gl)) {
        status = fail("its context cannot be made current (EGL error 0x%04x)", egl->GetError());
        goto done;
    }
    status = look_around(gl);
    make_as_it_was(egl, display, &was);
done:
    if (was.api) egl->BindAPI(was.api);
    if (status != MOIT_GL_OK) {
        if (gl->context) egl->DestroyContext(display, gl->context);
        if (gl->surface) egl->DestroySurface(display, gl->surface);
        gl->context = gl->surface = NULL;
        for (int i = 0; i < 3; ++i) {
            free(gl->names[i]);
            gl->names[i] = NULL;
        }
    }
    return status;
}

static int devices_of(const egl_functions *egl, EGLDeviceEXT devices[MOST_DEVICES]) {
    EGLint count = 0;
    const char *extensions = egl->QueryString(NULL, EGL_EXTENSIONS);
    bool offered = (listed(extensions, "EGL_EXT_device_enumeration")
                    || listed(extensions, "EGL_EXT_device_base"))
                   && listed(extensions, "EGL_EXT_platform_device") && egl->QueryDevicesEXT;
    return offered && egl->QueryDevicesEXT(MOST_DEVICES, devices, &count) ? count : 0;
}

static moit_gl_status open_device(moit_gl *gl, int index, EGLDeviceEXT device) {
    snprintf(gl->platform, sizeof gl->platform, "device %d", index);
    return open_on(gl, gl->egl->GetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, NULL));
}

/* Appends why the last attempt failed to `reasons`. */
static void remember(char *reasons, size_t size, const char *platform) {
    size_t used = strlen(reasons);
    snprintf(reasons + used, size - used, "%s%s: %s", used ? "; " : "", platform,
             moit_gl_message());
}

static moit_gl_status open_any(moit_gl *gl) {
    char reasons[MOIT_GL_MESSAGE / 2] = "";
    EGLDeviceEXT devices[MOST_DEVICES];
    int count = devices_of(gl->egl, devices);
    for (int software = 0; software < 2; ++software)
        for (int i = 0; i < count; ++i) {
            const char *extensions = gl->egl->QueryDeviceStringEXT
                                         ? gl->egl->QueryDeviceStringEXT(devices[i], EGL_EXTENSIONS)
                                         : NULL;
            if (listed(extensions, "EGL_MESA_device_software") != software) continue;
            moit_gl_status status = open_device(gl, i, devices[i]);
            if (status != MOIT_GL_FAILED) return status;
            remember(reasons, sizeof reasons, gl->platform);
        }
    if (listed(gl->egl->QueryString(NULL, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless")) {
        snprintf(gl->platform, sizeof gl->platform, "surfaceless");
        moit_gl_status status =
            open_on(gl, gl->egl->GetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, NULL, NULL));
        if (status != MOIT_GL_FAILED) return status;
        remember(reasons, sizeof reasons, gl->platform);
    }
    return fail("no OpenGL 4.5: libEGL is there, but %s%s; install the package libgl1-mesa-dri "
                "(Debian, Ubuntu) or mesa-dri-drivers (Fedora), or the GPU's own driver",
                *reasons ? "no driver that works: " : "no driver", reasons);
}

static moit_gl_status open_one(moit_gl *gl, int index) {
    EGLDeviceEXT devices[MOST_DEVICES];
    int count = devices_of(gl->egl, devices);
    if (count == 0) return fail("index: expected None, as EGL lists no devices, got %d", index);
    if (index < 0 || index >= count)
        return fail("index: expected 0 to %d, the devices of EGL, got %d", count - 1, index);
    moit_gl_status status = open_device(gl, index, devices[index]);
    if (status != MOIT_GL_FAILED) return status;
    char reason[MOIT_GL_MESSAGE / 2] = "";
    remember(reason, sizeof reason, gl->platform);
    return fail("no OpenGL 4.5 on %s; another index or none may have it", reason);
}

static moit_gl_status adopt(moit_gl *gl) {
    gl->adopted = gl->foreign = true;
    snprintf(gl->platform, sizeof gl->platform, "adopted");
    gl->display = gl->egl->GetCurrentDisplay();
    gl->context = gl->egl->GetCurrentContext();
    if (!gl->context)
        return fail("no context of EGL is current in this thread; make one current first, such as "
                    "moderngl.create_context(standalone=True, backend='egl')");
    return look_around(gl);
}

moit_gl_status moit_gl_open(int device, moit_gl **made) {
    *made = NULL;
    const egl_functions *egl = load_egl();
    if (!egl) return MOIT_GL_FAILED;
    moit_gl *gl = calloc(1, sizeof *gl);
    if (!gl) return MOIT_GL_NO_MEMORY;
    gl->egl = egl;
    gl->process = getpid();
    gl->objects.before = gl->objects.after = &gl->objects;
    pthread_mutex_init(&gl->lock, NULL);
    moit_gl_status status = device == MOIT_GL_ADOPT ? adopt(gl)
                            : device == MOIT_GL_ANY ? open_any(gl)
                                                    : open_one(gl, device);
    if (status == MOIT_GL_OK) {
        *made = gl;
    } else {
        gl->closed = true;
        moit_gl_free(gl);
    }
    return status;
}

/* ---- Closing --------------------------------------------------------------------------------- */

/* What an adopted context holds of ours; it must be current. */
static void delete_everything(moit_gl *gl) {
    for (object *one = gl->objects.after; one != &gl->objects; one = one->after) {
        if (one->name) delete_name(gl, one->type, one->name);
        one->name = 0;
    }
    for (int i = 0; i < gl->interval_count; ++i)
        if (!gl->info.software && !gl->intervals[i].used)
            gl->f.DeleteQueries(2, (GLuint[]){gl->intervals[i].begin, gl->intervals[i].end});
    for (int i = 0; i < gl->pending_count; ++i)
        if (gl->pending[i].begin) gl->f.DeleteQueries(1, &gl->pending[i].begin);
    if (gl->vertices) gl->f.DeleteVertexArrays(1, &gl->vertices);
    if (gl->framebuffer) gl->f.DeleteFramebuffers(1, &gl->framebuffer);
    if (gl->sampler) gl->f.DeleteSamplers(1, &gl->sampler);
}

moit_gl_status moit_gl_close(moit_gl *gl) {
    if (gl->process != getpid()) { /* locks and drivers do not survive a fork */
        gl->closed = true;
        return MOIT_GL_OK;
    }
    pthread_mutex_lock(&gl->lock);
    bool elsewhere = gl->innermost && !pthread_equal(gl->thread, pthread_self());
    bool closed = gl->closed;
    if (!elsewhere && !closed && gl->adopted && gl->egl->GetCurrentContext() == gl->context) {
        /* the state first: it may name what is bound of ours */
        for (level *one = gl->innermost; one; one = one->outer)
            if (one->state) restore_state(gl, one->state);
    }
    if (!elsewhere) gl->closed = true;
    pthread_mutex_unlock(&gl->lock);
    if (elsewhere) return fail("the device is in use by another thread; close it there");
    if (closed) return MOIT_GL_OK;
    if (gl->adopted) {
        if (gl->egl->GetCurrentContext() == gl->context) {
            delete_dead(gl);
            delete_everything(gl);
            forget_errors(gl);
        }
        return MOIT_GL_OK;
    }
    /* where it is still current, it goes when the last exit makes another current */
    gl->egl->DestroyContext(gl->display, gl->context);
    if (gl->surface) gl->egl->DestroySurface(gl->display, gl->surface);
    return MOIT_GL_OK;
}

void moit_gl_free(moit_gl *gl) {
    if (!gl) return;
    if (gl->process == getpid() && gl->innermost && pthread_equal(gl->thread, pthread_self()))
        while (gl->innermost) moit_gl_exit(gl);
    moit_gl_close(gl);
    while (gl->innermost) {
        level *outer = gl->innermost->outer;
        free(gl->innermost->state);
        free(gl->innermost);
        gl->innermost = outer;
    }
    while (gl->dead) {
        dead_name *next = gl->dead->next;
        free(gl->dead);
        gl->dead = next;
    }
    for (int i = 0; i < 3; ++i) free(gl->names[i]);
    free(gl->intervals);
    if (gl->process == getpid()) pthread_mutex_destroy(&gl->lock);
    free(gl);
}

/* ---- What it is ------------------------------------------------------------------------------ */

const moit_gl_info *moit_gl_get_info(const moit_gl *gl) { return &gl->info; }

const char *moit_gl_extension(const moit_gl *gl, int index) {
    const char *name = (const char *)gl->f.GetStringi(0x1F03 /* GL_EXTENSIONS */, (GLuint)index);
    return name ? name : "";
}

void *moit_gl_function(moit_gl *gl, const char *name) {
    gl->foreign = true;
    void (*function)(void) = gl->egl->GetProcAddress(name);
    void *address;
    memcpy(&address, &function, sizeof address);
    return address;
}
