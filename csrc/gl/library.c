/* libEGL, opened at run time and kept as long as the process. */
#include "driver.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

bool listed(const char *names, const char *name) {
    size_t length = strlen(name);
    for (const char *at = names; at && (at = strstr(at, name)); at += length)
        if ((at == names || at[-1] == ' ') && (at[length] == ' ' || !at[length])) return true;
    return false;
}

#define PACKAGES \
    "install the packages libegl1 and libgl1-mesa-dri (Debian, Ubuntu) or mesa-libEGL and " \
    "mesa-dri-drivers (Fedora), or the GPU's own driver"

/* Pointers to functions and to objects are alike in POSIX, not in C. */
static void assign(void *pointer, void *found) { memcpy(pointer, &found, sizeof found); }

const egl_functions *load_egl(void) {
    static egl_functions egl;
    static bool loaded;
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    const egl_functions *result = NULL;
    pthread_mutex_lock(&lock);
    if (!loaded) {
        const char *name = getenv("MOIT_EGL");
        if (!name || !*name) name = "libEGL.so.1";
        void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
        if (!library) {
            fail("no OpenGL: %s cannot be opened (%s); " PACKAGES, name, dlerror());
            goto done;
        }
        const char *missing = NULL;
        void *found;
#define FIND(result, function, arguments) \
    found = dlsym(library, "egl" #function); \
    if (!found) missing = "egl" #function; \
    assign(&egl.function, found);
        EGL_FUNCTIONS(FIND)
        FIND(void, GetProcAddress, (void))
#undef FIND
        if (missing) {
            dlclose(library);
            fail("no OpenGL: %s has no function %s; " PACKAGES, name, missing);
            goto done;
        }
        const char *extensions = egl.QueryString(NULL, EGL_EXTENSIONS);
#define ASK(result, function, arguments) \
    egl.function = (result(*) arguments)egl.GetProcAddress("egl" #function);
        if (listed(extensions, "EGL_EXT_platform_base")) {
            EGL_EXTENSION_FUNCTIONS(ASK)
        }
#undef ASK
        if (!egl.GetPlatformDisplayEXT) {
            dlclose(library);
            fail("no OpenGL: %s finds no driver; " PACKAGES, name);
            goto done;
        }
        loaded = true;
    }
    result = &egl;
done:
    pthread_mutex_unlock(&lock);
    return result;
}
