/* The part of Embree's C interface that these programs need, for Embree 3 and 4, loaded when the program runs. */
#ifndef EMBREE_H
#define EMBREE_H

#include <stdbool.h>
#include <stdint.h>

/* No geometry, no primitive, no instance. */
#define EMBREE_NONE UINT32_MAX
/* The most rays in a packet. */
#define EMBREE_MAX_RAYS 16

typedef struct EmbreeDeviceObject *EmbreeDevice;
typedef struct EmbreeSceneObject *EmbreeScene;
typedef struct EmbreeGeometryObject *EmbreeGeometry;

/* Rays and their hits are rows of one word a ray. */
enum EmbreeRow {
    EMBREE_ORIGIN = 0,
    EMBREE_NEAR = 3,
    EMBREE_DIRECTION = 4,
    EMBREE_TIME = 7,
    EMBREE_FAR = 8,
    EMBREE_MASK = 9,
    EMBREE_ID = 10,
    EMBREE_FLAGS = 11,
    EMBREE_RAY_ROWS = 12,
    EMBREE_NORMAL = 12,
    EMBREE_UV = 15,
    EMBREE_PRIMITIVE = 17,
    EMBREE_GEOMETRY = 18,
    EMBREE_INSTANCE = 19,
    /* Embree 4 may have been built with a number for the elements of arrays of instances, whose row follows. */
    EMBREE_ROWS = 21
};

/* As many rays as asked for, row after row without gaps: row r of ray i of n is words[r * n + i]. */
typedef union EmbreeRays {
    _Alignas(64) float floats[(EMBREE_ROWS + 3) * EMBREE_MAX_RAYS];
    uint32_t words[(EMBREE_ROWS + 3) * EMBREE_MAX_RAYS];
} EmbreeRays;

typedef struct EmbreeBounds {
    _Alignas(16) float lower[4];
    float upper[4];
} EmbreeBounds;

typedef struct EmbreeBoundsArguments {
    void *user;
    uint32_t primitive;
    uint32_t time_step;
    EmbreeBounds *bounds;
} EmbreeBoundsArguments;

/* Of intersection and occlusion callbacks alike; the latter's rays end before EMBREE_RAY_ROWS. */
typedef struct EmbreeHitArguments {
    const int32_t *valid; /* 0 or -1 a ray */
    void *user;
    uint32_t primitive;
    const void *context; /* what it is differs between the versions: see embree_instance_offset */
    float *rays;
    uint32_t count;
    uint32_t geometry;
} EmbreeHitArguments;

typedef void (*EmbreeBoundsFunction)(const EmbreeBoundsArguments *arguments);
typedef void (*EmbreeHitFunction)(const EmbreeHitArguments *arguments);

/* Embree, loaded. */
typedef struct Embree {
    void *library;
    int version; /* 3 or 4 */
    EmbreeDevice (*new_device)(const char *configuration);
    void (*release_device)(EmbreeDevice device);
    int (*device_error)(EmbreeDevice device);
    intptr_t (*device_property)(EmbreeDevice device, int property);
    EmbreeScene (*new_scene)(EmbreeDevice device);
    void (*set_build_quality)(EmbreeScene scene, int quality);
    void (*commit_scene)(EmbreeScene scene);
    void (*release_scene)(EmbreeScene scene);
    void (*scene_bounds)(EmbreeScene scene, EmbreeBounds *bounds);
    EmbreeGeometry (*new_geometry)(EmbreeDevice device, int type);
    void (*set_primitive_count)(EmbreeGeometry geometry, uint32_t count);
    void (*set_user_data)(EmbreeGeometry geometry, void *user);
    void (*set_bounds_function)(EmbreeGeometry geometry, EmbreeBoundsFunction function, void *user);
    void (*set_intersect_function)(EmbreeGeometry geometry, EmbreeHitFunction function);
    void (*set_occluded_function)(EmbreeGeometry geometry, EmbreeHitFunction function);
    void (*commit_geometry)(EmbreeGeometry geometry);
    uint32_t (*attach_geometry)(EmbreeScene scene, EmbreeGeometry geometry);
    void (*release_geometry)(EmbreeGeometry geometry);
    /* rtcIntersect1, 4, 8, 16 and rtcOccluded1, 4, 8, 16, whose parameters differ between the versions */
    void (*intersect[4])(void);
    void (*occluded[4])(void);
} Embree;

/* Loads the library that the environment variable EMBREE names, else the newest that there is. False if there is none: then it
   has told so on standard error. It stays loaded, since its threads may be at work until the program ends. */
bool embree_load(Embree *embree);

/* The version in full, as 30 * 1000 + 13 * 100 + 5. */
int embree_full_version(const Embree *embree, EmbreeDevice device);

/* A geometry of primitives that callbacks intersect. */
EmbreeGeometry embree_user_geometry(const Embree *embree, EmbreeDevice device, uint32_t primitive_count, void *user,
                                    EmbreeBoundsFunction bounds, EmbreeHitFunction intersect, EmbreeHitFunction occluded);

/* An empty scene, to be committed when it has its geometries. */
EmbreeScene embree_new_scene(const Embree *embree, EmbreeDevice device);

/* Gives a geometry to a scene: its number. */
uint32_t embree_attach(const Embree *embree, EmbreeScene scene, EmbreeGeometry geometry);

/* Finds the nearest hits of 1, 4, 8 or 16 rays. */
void embree_intersect(const Embree *embree, EmbreeScene scene, const int32_t *valid, EmbreeRays *rays, uint32_t count,
                      bool coherent);

/* Makes the far ends of rays that hit anything -infinity. */
void embree_occluded(const Embree *embree, EmbreeScene scene, const int32_t *valid, EmbreeRays *rays, uint32_t count,
                     bool coherent);

/* Where in a callback's context the number of the instance stands that it is asked about, in bytes. */
static inline uint32_t embree_instance_offset(int version)
{
    /* In Embree 3 flags and a filter function stand before it. */
    return version == 3 ? 16 : 0;
}

#endif
