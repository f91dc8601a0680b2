/* Buffers, textures, programs and queries as names in GL: who holds them, and when they go.
 *
 * Python frees objects in any thread, and at any time. A name can be deleted only while its context
 * is current; so it waits on a list where it is not. */
#include "driver.h"

#include <stdlib.h>

void enlist(moit_gl *gl, object *object, object_type type, GLuint name) {
    object->gl = gl;
    object->type = type;
    object->name = name;
    pthread_mutex_lock(&gl->lock);
    object->before = gl->objects.before;
    object->after = &gl->objects;
    object->before->after = object->after->before = object;
    pthread_mutex_unlock(&gl->lock);
}

void delete_name(moit_gl *gl, object_type type, GLuint name) {
    switch (type) {
    case A_BUFFER: gl->f.DeleteBuffers(1, &name); break;
    case A_TEXTURE: gl->f.DeleteTextures(1, &name); break;
    case A_PROGRAM: gl->f.DeleteProgram(name); break;
    case A_QUERY: gl->f.DeleteQueries(1, &name); break;
    }
}

void delete_dead(moit_gl *gl) {
    pthread_mutex_lock(&gl->lock);
    dead_name *dead = gl->dead;
    gl->dead = NULL;
    pthread_mutex_unlock(&gl->lock);
    while (dead) {
        dead_name *next = dead->next;
        delete_name(gl, dead->type, dead->name);
        free(dead);
        dead = next;
    }
}

void discard(object *object, bool ours) {
    moit_gl *gl = object->gl;
    if (gl->process != getpid()) return; /* its lock and its driver did not survive the fork */
    pthread_mutex_lock(&gl->lock);
    object->before->after = object->after;
    object->after->before = object->before;
    bool gone = gl->closed || !ours || !object->name;
    bool here = !gone && gl->innermost && pthread_equal(gl->thread, pthread_self())
                && gl->egl->GetCurrentContext() == gl->context;
    if (!gone && !here) {
        dead_name *dead = malloc(sizeof *dead);
        if (dead) { /* without memory it lives as long as its context */
            *dead = (dead_name){gl->dead, object->type, object->name};
            gl->dead = dead;
        }
    }
    pthread_mutex_unlock(&gl->lock);
    if (here) delete_name(gl, object->type, object->name);
}
