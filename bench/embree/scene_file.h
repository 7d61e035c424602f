/* Reads the scenes of make_scene, whose spheres and meshes are also what `rtsl bench` traces. */
#ifndef SCENE_FILE_H
#define SCENE_FILE_H

#include "../../integrations/embree/hand_sphere.h"

/* A camera, and either spheres or one mesh. */
typedef struct SceneFile {
    float eye[3];
    float target[3];
    float field_of_view; /* degrees */
    HandSphere *spheres;
    uint32_t sphere_count;
    float *vertices; /* three numbers a vertex */
    uint32_t vertex_count;
    uint32_t *triangles; /* three vertices a triangle */
    uint32_t triangle_count;
} SceneFile;

/* Reads a scene and the PLY file that it names. Ends the program with a message if that fails. */
SceneFile read_scene(const char *path);

#endif
