#include "scene_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 1024, CORNERS = 3 };

static void fail(const char *path, const char *message)
{
    fprintf(stderr, "error: %s: %s\n", path, message);
    exit(1);
}

static void *allocate(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory)
        exit((fputs("error: out of memory\n", stderr), 1));
    return memory;
}

static void add_sphere(SceneFile *scene, const float *center, float radius)
{
    uint32_t count = scene->sphere_count;
    if ((count & (count - 1)) == 0) {
        HandSphere *more = allocate(count ? 2 * (size_t)count : 1, sizeof *more);
        if (count)
            memcpy(more, scene->spheres, count * sizeof *more);
        free(scene->spheres);
        scene->spheres = more;
    }
    scene->spheres[scene->sphere_count++] = (HandSphere){ { center[0], center[1], center[2] }, radius };
}

/* The numbers of vertices and faces in the header of a PLY file, which the data follow. */
static void read_ply_header(const char *path, FILE *file, SceneFile *scene)
{
    char line[LINE];
    while (fgets(line, LINE, file)) {
        sscanf(line, "element vertex %u", &scene->vertex_count);
        sscanf(line, "element face %u", &scene->triangle_count);
        if (strcmp(line, "end_header\n") == 0)
            return;
    }
    fail(path, "its header does not end");
}

/* A mesh as make_scene writes it: little-endian coordinates, then triangles, each after the number of its corners. */
static void read_ply(const char *path, SceneFile *scene)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        exit((perror(path), 1));
    read_ply_header(path, file, scene);
    scene->vertices = allocate(scene->vertex_count, 3 * sizeof(float));
    scene->triangles = allocate(scene->triangle_count, CORNERS * sizeof(uint32_t));
    if (fread(scene->vertices, 3 * sizeof(float), scene->vertex_count, file) != scene->vertex_count)
        fail(path, "it lacks vertices");
    for (uint32_t i = 0; i < scene->triangle_count; i++) {
        uint32_t *corners = scene->triangles + CORNERS * (size_t)i;
        if (fgetc(file) != CORNERS || fread(corners, sizeof *corners, CORNERS, file) != CORNERS)
            fail(path, "a face is no triangle");
        for (int corner = 0; corner < CORNERS; corner++)
            if (corners[corner] >= scene->vertex_count)
                fail(path, "a face has a vertex that there is not");
    }
    fclose(file);
}

/* A file in the folder of another. */
static void beside(const char *path, const char *name, char result[2 * LINE])
{
    const char *end = strrchr(path, '/');
    int length = end ? (int)(end - path) + 1 : 0;
    snprintf(result, 2 * LINE, "%.*s%s", length, path, name);
}

SceneFile read_scene(const char *path)
{
    SceneFile scene = { 0 };
    FILE *file = fopen(path, "r");
    if (!file)
        exit((perror(path), 1));
    char line[LINE], name[LINE], ply[2 * LINE];
    float center[3] = { 0 }, radius, *eye = scene.eye, *target = scene.target;
    while (fgets(line, LINE, file)) {
        sscanf(line, "LookAt %f %f %f %f %f %f", &eye[0], &eye[1], &eye[2], &target[0], &target[1], &target[2]);
        sscanf(line, "Camera \"perspective\" \"float fov\" %f", &scene.field_of_view);
        sscanf(line, "Translate %f %f %f", &center[0], &center[1], &center[2]);
        if (sscanf(line, "Shape \"sphere\" \"float radius\" %f", &radius) == 1)
            add_sphere(&scene, center, radius);
        if (sscanf(line, "Shape \"plymesh\" \"string filename\" \"%1023[^\"]", name) == 1) {
            beside(path, name, ply);
            read_ply(ply, &scene);
        }
    }
    fclose(file);
    if (scene.sphere_count + scene.triangle_count == 0 || !(scene.field_of_view > 0.0f))
        fail(path, "it has no camera, or neither spheres nor a mesh");
    return scene;
}
