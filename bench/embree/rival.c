/* Traces a scene of make_scene with Embree: the rival of `rtsl bench`. It prints a line for each kind of ray and size of packet. */
#define _POSIX_C_SOURCE 200809L
#include "rays.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { GEOMETRY_TRIANGLES = 0, BUFFER_INDICES = 0, BUFFER_VERTICES = 1, FORMAT_UINT3 = 0x5003, FORMAT_FLOAT3 = 0x9003 };

typedef void *(*NewBuffer)(EmbreeGeometry, int type, unsigned slot, int format, size_t stride, size_t count);

/* What is traced: rays of the camera, or random ones. */
typedef struct Heat {
    const Camera *camera;
    const Ray *random;
    uint32_t count;
    uint32_t width; /* rays in a packet */
} Heat;

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static EmbreeGeometry mesh_geometry(const Embree *embree, EmbreeDevice device, const SceneFile *scene)
{
    NewBuffer new_buffer;
    *(void **)&new_buffer = dlsym(embree->library, "rtcSetNewGeometryBuffer");
    if (!new_buffer)
        exit((fputs("error: Embree has no rtcSetNewGeometryBuffer\n", stderr), 1));
    EmbreeGeometry geometry = embree->new_geometry(device, GEOMETRY_TRIANGLES);
    size_t of_vertex = 3 * sizeof(float), of_triangle = 3 * sizeof(uint32_t);
    void *vertices = new_buffer(geometry, BUFFER_VERTICES, 0, FORMAT_FLOAT3, of_vertex, scene->vertex_count);
    void *triangles = new_buffer(geometry, BUFFER_INDICES, 0, FORMAT_UINT3, of_triangle, scene->triangle_count);
    if (!vertices || !triangles)
        exit((fputs("error: Embree has no memory for the mesh\n", stderr), 1));
    memcpy(vertices, scene->vertices, of_vertex * scene->vertex_count);
    memcpy(triangles, scene->triangles, of_triangle * scene->triangle_count);
    embree->commit_geometry(geometry);
    return geometry;
}

static EmbreeScene build(const Embree *embree, EmbreeDevice device, const SceneFile *file)
{
    EmbreeScene scene = embree_new_scene(embree, device);
    embree_attach(embree, scene,
                  file->sphere_count ? hand_sphere_geometry(embree, device, file->spheres, file->sphere_count)
                                     : mesh_geometry(embree, device, file));
    embree->commit_scene(scene);
    return scene;
}

/* Traces all rays once: the number of those that hit something. */
static uint32_t trace(const Embree *embree, EmbreeScene scene, Heat heat)
{
    _Alignas(64) int32_t valid[EMBREE_MAX_RAYS];
    EmbreeRays rays;
    uint32_t hits = 0;
    memset(valid, -1, sizeof valid);
    for (uint32_t first = 0; first < heat.count; first += heat.width) {
        if (heat.random)
            put_rays(heat.random + first, &rays, heat.width);
        else
            put_camera_rays(heat.camera, &rays, heat.width, first);
        embree_intersect(embree, scene, valid, &rays, heat.width, !heat.random);
        for (uint32_t lane = 0; lane < heat.width; lane++)
            hits += rays.words[EMBREE_GEOMETRY * heat.width + lane] != EMBREE_NONE;
    }
    return hits;
}

static void report(const Embree *embree, EmbreeScene scene, Heat heat, int repetitions)
{
    double least = 1e30;
    uint32_t hits = 0;
    for (int i = 0; i < repetitions; i++) {
        double begin = seconds();
        hits = trace(embree, scene, heat);
        double taken = seconds() - begin;
        least = taken < least ? taken : least;
    }
    printf("%s %u %.3f %.4f\n", heat.random ? "random" : "camera", heat.width, heat.count * 1e-6 / least,
           (double)hits / heat.count);
    fflush(stdout);
}

int main(int count, char **arguments)
{
    static const uint32_t widths[3] = { 1, 8, 16 };
    int repetitions = count == 3 ? atoi(arguments[2]) : 5;
    if (count < 2 || count > 3 || repetitions < 1)
        return fputs("usage: rival SCENE.pbrt [REPETITIONS]\n", stderr), 2;
    SceneFile file = read_scene(arguments[1]);
    Embree embree;
    if (!embree_load(&embree))
        return 1;
    EmbreeDevice device = embree.new_device("threads=1");
    EmbreeScene scene = build(&embree, device, &file);
    Camera camera = camera_of(&file);
    EmbreeBounds bounds;
    embree.scene_bounds(scene, &bounds);
    Ray *random = random_rays(&bounds);
    if (!random)
        return fputs("error: out of memory\n", stderr), 1;
    int version = embree_full_version(&embree, device);
    printf("version %d.%d.%d\n", version / 10000, version / 100 % 100, version % 100);
    for (int w = 0; w < 3; w++) {
        report(&embree, scene, (Heat){ &camera, NULL, CAMERA_RAYS, widths[w] }, repetitions);
        report(&embree, scene, (Heat){ &camera, random, RANDOM_RAYS, widths[w] }, repetitions);
    }
    return 0;
}
