#include "embree.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PROPERTY_VERSION = 0, PROPERTY_MAJOR = 1, BUILD_QUALITY_HIGH = 2, GEOMETRY_USER = 120 };

/* What rtcIntersect and rtcOccluded take besides rays: of Embree 3. */
typedef struct Context3 {
    uint32_t flags;
    void *filter;
    uint32_t instance;
    uint32_t unused[8];
} Context3;

/* The same of Embree 4, which makes a context itself where there is none. */
typedef struct Arguments4 {
    uint32_t flags;
    uint32_t features;
    void *context;
    void *filter;
    void *callback;
    uint32_t unused[8];
} Arguments4;

enum { COHERENT_3 = 1, COHERENT_4 = 1 << 16, ALL_FEATURES = -1 };

typedef void (*Query1of3)(EmbreeScene, Context3 *, EmbreeRays *);
typedef void (*QueryNof3)(const int32_t *, EmbreeScene, Context3 *, EmbreeRays *);
typedef void (*Query1of4)(EmbreeScene, EmbreeRays *, Arguments4 *);
typedef void (*QueryNof4)(const int32_t *, EmbreeScene, EmbreeRays *, Arguments4 *);

static const char *const NAMES[] = { "libembree4.so.4", "libembree4.so", "libembree3.so.3", "libembree3.so",
                                     "libembree4.dylib", "libembree3.dylib" };

static void *open_library(void)
{
    const char *named = getenv("EMBREE");
    if (named) {
        void *library = dlopen(named, RTLD_NOW | RTLD_LOCAL);
        if (!library)
            fprintf(stderr, "error: EMBREE names a library that can't be loaded: %s\n", dlerror());
        return library;
    }
    for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++) {
        void *library = dlopen(NAMES[i], RTLD_NOW | RTLD_LOCAL);
        if (library)
            return library;
    }
    fprintf(stderr, "error: Embree was not found. Tried");
    for (size_t i = 0; i < sizeof NAMES / sizeof *NAMES; i++)
        fprintf(stderr, "%s %s", i ? "," : "", NAMES[i]);
    fprintf(stderr, ".\n  help: install it (Debian, Ubuntu: apt install libembree3-3 or libembree4-4), or name the library"
                    " with the environment variable EMBREE\n");
    return NULL;
}

/* A function of the library; a missing one is told, and counted. */
static void *find(void *library, const char *name, int *missing)
{
    void *function = dlsym(library, name);
    if (!function) {
        fprintf(stderr, "error: this Embree has no %s\n", name);
        ++*missing;
    }
    return function;
}

static int find_version(const Embree *embree)
{
    EmbreeDevice device = embree->new_device("threads=1");
    if (!device)
        return 0;
    int version = (int)embree->device_property(device, PROPERTY_MAJOR);
    embree->release_device(device);
    return version;
}

bool embree_load(Embree *embree)
{
    static const char *const intersect[4] = { "rtcIntersect1", "rtcIntersect4", "rtcIntersect8", "rtcIntersect16" };
    static const char *const occluded[4] = { "rtcOccluded1", "rtcOccluded4", "rtcOccluded8", "rtcOccluded16" };
    memset(embree, 0, sizeof *embree);
    embree->library = open_library();
    if (!embree->library)
        return false;
    int missing = 0;
/* Written through a pointer to an object pointer, since C does not convert those to functions; POSIX says that they are alike. */
#define FIND(field, name) *(void **)&embree->field = find(embree->library, name, &missing)
    FIND(new_device, "rtcNewDevice");
    FIND(release_device, "rtcReleaseDevice");
    FIND(device_error, "rtcGetDeviceError");
    FIND(device_property, "rtcGetDeviceProperty");
    FIND(new_scene, "rtcNewScene");
    FIND(set_build_quality, "rtcSetSceneBuildQuality");
    FIND(commit_scene, "rtcCommitScene");
    FIND(release_scene, "rtcReleaseScene");
    FIND(scene_bounds, "rtcGetSceneBounds");
    FIND(new_geometry, "rtcNewGeometry");
    FIND(set_primitive_count, "rtcSetGeometryUserPrimitiveCount");
    FIND(set_user_data, "rtcSetGeometryUserData");
    FIND(set_bounds_function, "rtcSetGeometryBoundsFunction");
    FIND(set_intersect_function, "rtcSetGeometryIntersectFunction");
    FIND(set_occluded_function, "rtcSetGeometryOccludedFunction");
    FIND(commit_geometry, "rtcCommitGeometry");
    FIND(attach_geometry, "rtcAttachGeometry");
    FIND(release_geometry, "rtcReleaseGeometry");
    for (int i = 0; i < 4; i++) {
        FIND(intersect[i], intersect[i]);
        FIND(occluded[i], occluded[i]);
    }
#undef FIND
    if (missing == 0) {
        embree->version = find_version(embree);
        if (embree->version == 3 || embree->version == 4)
            return true;
        fprintf(stderr, "error: this Embree is version %d; versions 3 and 4 are known here\n", embree->version);
    }
    return false;
}

int embree_full_version(const Embree *embree, EmbreeDevice device)
{
    return (int)embree->device_property(device, PROPERTY_VERSION);
}

EmbreeGeometry embree_user_geometry(const Embree *embree, EmbreeDevice device, uint32_t primitive_count, void *user,
                                    EmbreeBoundsFunction bounds, EmbreeHitFunction intersect, EmbreeHitFunction occluded)
{
    EmbreeGeometry geometry = embree->new_geometry(device, GEOMETRY_USER);
    embree->set_primitive_count(geometry, primitive_count);
    embree->set_user_data(geometry, user);
    embree->set_bounds_function(geometry, bounds, NULL);
    embree->set_intersect_function(geometry, intersect);
    embree->set_occluded_function(geometry, occluded);
    embree->commit_geometry(geometry);
    return geometry;
}

EmbreeScene embree_new_scene(const Embree *embree, EmbreeDevice device)
{
    EmbreeScene scene = embree->new_scene(device);
    embree->set_build_quality(scene, BUILD_QUALITY_HIGH);
    return scene;
}

uint32_t embree_attach(const Embree *embree, EmbreeScene scene, EmbreeGeometry geometry)
{
    uint32_t number = embree->attach_geometry(scene, geometry);
    embree->release_geometry(geometry);
    return number;
}

/* Which of the functions for 1, 4, 8 and 16 rays. */
static int function_of(uint32_t count) { return count == 1 ? 0 : count == 4 ? 1 : count == 8 ? 2 : 3; }

static void query(const Embree *embree, void (*const functions[4])(void), EmbreeScene scene, const int32_t *valid,
                  EmbreeRays *rays, uint32_t count, bool coherent)
{
    void (*function)(void) = functions[function_of(count)];
    if (embree->version == 3) {
        Context3 context = { .flags = coherent ? COHERENT_3 : 0, .instance = EMBREE_NONE };
        if (count == 1)
            ((Query1of3)function)(scene, &context, rays);
        else
            ((QueryNof3)function)(valid, scene, &context, rays);
    } else {
        Arguments4 arguments = { .flags = coherent ? COHERENT_4 : 0, .features = (uint32_t)ALL_FEATURES };
        if (count == 1)
            ((Query1of4)function)(scene, rays, &arguments);
        else
            ((QueryNof4)function)(valid, scene, rays, &arguments);
    }
}

void embree_intersect(const Embree *embree, EmbreeScene scene, const int32_t *valid, EmbreeRays *rays, uint32_t count,
                      bool coherent)
{
    query(embree, embree->intersect, scene, valid, rays, count, coherent);
}

void embree_occluded(const Embree *embree, EmbreeScene scene, const int32_t *valid, EmbreeRays *rays, uint32_t count,
                     bool coherent)
{
    query(embree, embree->occluded, scene, valid, rays, count, coherent);
}
