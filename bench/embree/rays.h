/* The rays of `rtsl bench`: those of its camera, and random ones. */
#ifndef RAYS_H
#define RAYS_H

#include "scene_file.h"

/* Pixels along a side of the image. */
enum { SIDE = 1024, CAMERA_RAYS = SIDE * SIDE, RANDOM_RAYS = 4096 * 64 };

/* What leads from pixels to directions. */
typedef struct Camera {
    float origin[3];
    float corner[3];
    float right[3];
    float down[3];
} Camera;

typedef struct Ray {
    float origin[3];
    float direction[3];
} Ray;

/* The camera of a scene. */
Camera camera_of(const SceneFile *scene);

/* As many random rays as RANDOM_RAYS in the cube around some bounds: the same numbers as those of `rtsl bench`. */
Ray *random_rays(const EmbreeBounds *bounds);

/* Sets the rays of a packet to those of a block of pixels, 4 wide where there are at least 4, in the order of blocks. */
void put_camera_rays(const Camera *camera, EmbreeRays *rays, uint32_t count, uint32_t first);

/* Sets the rays of a packet. */
void put_rays(const Ray *some, EmbreeRays *rays, uint32_t count);

#endif
