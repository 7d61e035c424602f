#include "rays.h"

#include <math.h>
#include <stdlib.h>

enum { PACKET = 64, OF_RANDOM_RAYS = 2, BLOCK_WIDTH = 4 };

static const float EPSILON = 1e-4f, LIMIT = 1e30f;

static float dot(const float *a, const float *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void scale(float *vector, float factor)
{
    for (int axis = 0; axis < 3; axis++)
        vector[axis] *= factor;
}

static void cross(const float *a, const float *b, float *result)
{
    for (int axis = 0; axis < 3; axis++) {
        int next = (axis + 1) % 3, last = (axis + 2) % 3;
        result[axis] = a[next] * b[last] - a[last] * b[next];
    }
}

Camera camera_of(const SceneFile *scene)
{
    static const float up[3] = { 0.0f, 1.0f, 0.0f };
    Camera camera;
    float ahead[3], half = tanf(scene->field_of_view * 3.14159265f / 360.0f);
    for (int axis = 0; axis < 3; axis++)
        ahead[axis] = scene->target[axis] - scene->eye[axis];
    scale(ahead, 1.0f / sqrtf(dot(ahead, ahead)));
    cross(ahead, up, camera.right);
    scale(camera.right, 2.0f * half / SIDE / sqrtf(dot(camera.right, camera.right)));
    cross(ahead, camera.right, camera.down);
    for (int axis = 0; axis < 3; axis++) {
        float to_corner = camera.right[axis] + camera.down[axis];
        camera.origin[axis] = scene->eye[axis];
        camera.corner[axis] = ahead[axis] - 0.5f * (SIDE - 1) * to_corner;
    }
    return camera;
}

static uint32_t mix(uint32_t word)
{
    word = (word ^ word >> 16) * 0x7FEB352Du;
    word = (word ^ word >> 15) * 0x846CA68Bu;
    return word ^ word >> 16;
}

static uint32_t hash(uint32_t a, uint32_t b)
{
    return mix(mix(a) + b + 0x9E3779B9u);
}

/* Random numbers of one packet. */
typedef struct Numbers {
    uint32_t key;
    uint32_t count;
} Numbers;

static float around_zero(Numbers *numbers)
{
    numbers->count++;
    return 2.0f * ((float)(hash(numbers->key, numbers->count) >> 8) / 16777216.0f) - 1.0f;
}

static void random_direction(Numbers *numbers, float *direction)
{
    float square;
    do {
        for (int axis = 0; axis < 3; axis++)
            direction[axis] = around_zero(numbers);
        square = dot(direction, direction);
    } while (!(square >= 1e-4f && square <= 1.0f));
    scale(direction, 1.0f / sqrtf(square));
}

Ray *random_rays(const EmbreeBounds *bounds)
{
    float half = 0.0f;
    for (int axis = 0; axis < 3; axis++)
        half = fmaxf(half, 0.5f * (bounds->upper[axis] - bounds->lower[axis]));
    Ray *rays = calloc(RANDOM_RAYS, sizeof *rays);
    Numbers numbers = { 0, 0 };
    for (uint32_t i = 0; rays && i < RANDOM_RAYS; i++) {
        if (i % PACKET == 0)
            numbers = (Numbers){ hash(OF_RANDOM_RAYS, i / PACKET), 0 };
        for (int axis = 0; axis < 3; axis++) {
            float middle = 0.5f * (bounds->lower[axis] + bounds->upper[axis]);
            rays[i].origin[axis] = middle + half * around_zero(&numbers);
        }
        random_direction(&numbers, rays[i].direction);
    }
    return rays;
}

/* What all rays have alike. */
static inline void put_ends(EmbreeRays *rays, uint32_t count)
{
    for (uint32_t lane = 0; lane < count; lane++) {
        rays->floats[EMBREE_NEAR * count + lane] = EPSILON;
        rays->floats[EMBREE_TIME * count + lane] = 0.0f;
        rays->floats[EMBREE_FAR * count + lane] = LIMIT;
        rays->words[EMBREE_MASK * count + lane] = UINT32_MAX;
        rays->words[EMBREE_ID * count + lane] = 0;
        rays->words[EMBREE_FLAGS * count + lane] = 0;
        rays->words[EMBREE_GEOMETRY * count + lane] = EMBREE_NONE;
        rays->words[EMBREE_INSTANCE * count + lane] = EMBREE_NONE;
    }
}

static inline void put_pixels(const Camera *camera, EmbreeRays *rays, uint32_t count, uint32_t x, uint32_t y)
{
    for (int axis = 0; axis < 3; axis++)
        for (uint32_t lane = 0; lane < count; lane++) {
            float column = (float)(int)(x + lane % BLOCK_WIDTH), row = (float)(int)(y + lane / BLOCK_WIDTH);
            rays->floats[(EMBREE_ORIGIN + axis) * count + lane] = camera->origin[axis];
            rays->floats[(EMBREE_DIRECTION + axis) * count + lane] =
                camera->corner[axis] + column * camera->right[axis] + row * camera->down[axis];
        }
    put_ends(rays, count);
}

void put_camera_rays(const Camera *camera, EmbreeRays *rays, uint32_t count, uint32_t first)
{
    uint32_t block = first / 16, within = first % 16;
    uint32_t x = block % (SIDE / BLOCK_WIDTH) * BLOCK_WIDTH + within % BLOCK_WIDTH;
    uint32_t y = block / (SIDE / BLOCK_WIDTH) * BLOCK_WIDTH + within / BLOCK_WIDTH;
    /* Loops of known length become vector code. */
    switch (count) {
    case 16: put_pixels(camera, rays, 16, x, y); break;
    case 8: put_pixels(camera, rays, 8, x, y); break;
    default: put_pixels(camera, rays, 1, x, y);
    }
}

void put_rays(const Ray *some, EmbreeRays *rays, uint32_t count)
{
    for (uint32_t lane = 0; lane < count; lane++)
        for (int axis = 0; axis < 3; axis++) {
            rays->floats[(EMBREE_ORIGIN + axis) * count + lane] = some[lane].origin[axis];
            rays->floats[(EMBREE_DIRECTION + axis) * count + lane] = some[lane].direction[axis];
        }
    put_ends(rays, count);
}
