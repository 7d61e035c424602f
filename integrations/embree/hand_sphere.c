#include "hand_sphere.h"

#include <math.h>

static void bounds(const EmbreeBoundsArguments *arguments)
{
    const HandSphere *sphere = (const HandSphere *)arguments->user + arguments->primitive;
    for (int axis = 0; axis < 3; axis++) {
        arguments->bounds->lower[axis] = sphere->center[axis] - sphere->radius;
        arguments->bounds->upper[axis] = sphere->center[axis] + sphere->radius;
    }
}

/* Callbacks for packets of one size: loops over arrays of known length, of which compilers make vector code. */
#define PACKET_CALLBACKS(N)                                                                                          \
    static inline void test_##N(const EmbreeHitArguments *arguments, float *distance, int32_t *accepted)             \
    {                                                                                                                \
        const HandSphere sphere = ((const HandSphere *)arguments->user)[arguments->primitive];                       \
        float(*rows)[N] = (float(*)[N])arguments->rays;                                                              \
        for (int i = 0; i < N; i++) {                                                                                \
            float ox = rows[EMBREE_ORIGIN][i] - sphere.center[0];                                                    \
            float oy = rows[EMBREE_ORIGIN + 1][i] - sphere.center[1];                                                \
            float oz = rows[EMBREE_ORIGIN + 2][i] - sphere.center[2];                                                \
            float dx = rows[EMBREE_DIRECTION][i];                                                                    \
            float dy = rows[EMBREE_DIRECTION + 1][i];                                                                \
            float dz = rows[EMBREE_DIRECTION + 2][i];                                                                \
            float a = dx * dx + dy * dy + dz * dz;                                                                   \
            float b = dx * ox + dy * oy + dz * oz;                                                                   \
            float c = ox * ox + oy * oy + oz * oz - sphere.radius * sphere.radius;                                   \
            float discriminant = b * b - a * c;                                                                      \
            float root = sqrtf(fmaxf(discriminant, 0.0f)), inverse = 1.0f / a;                                       \
            float first = (-b - root) * inverse, second = (-b + root) * inverse;                                     \
            float t = first > rows[EMBREE_NEAR][i] ? first : second;                                                 \
            distance[i] = t;                                                                                         \
            accepted[i] = (arguments->valid[i] != 0) & (discriminant >= 0.0f) & (t > rows[EMBREE_NEAR][i])           \
                        & (t < rows[EMBREE_FAR][i]);                                                                 \
        }                                                                                                            \
    }                                                                                                                \
    static void intersect_##N(const EmbreeHitArguments *arguments)                                                   \
    {                                                                                                                \
        _Alignas(64) float distance[N];                                                                              \
        _Alignas(64) int32_t accepted[N];                                                                            \
        test_##N(arguments, distance, accepted);                                                                     \
        const float *center = ((const HandSphere *)arguments->user)[arguments->primitive].center;                    \
        const float x = center[0], y = center[1], z = center[2];                                                     \
        const uint32_t primitive = arguments->primitive, geometry = arguments->geometry;                             \
        float(*rows)[N] = (float(*)[N])arguments->rays;                                                              \
        uint32_t(*words)[N] = (uint32_t(*)[N])arguments->rays;                                                       \
        for (int i = 0; i < N; i++) {                                                                                \
            float t = distance[i];                                                                                   \
            float nx = rows[EMBREE_ORIGIN][i] + t * rows[EMBREE_DIRECTION][i] - x;                                   \
            float ny = rows[EMBREE_ORIGIN + 1][i] + t * rows[EMBREE_DIRECTION + 1][i] - y;                           \
            float nz = rows[EMBREE_ORIGIN + 2][i] + t * rows[EMBREE_DIRECTION + 2][i] - z;                           \
            rows[EMBREE_FAR][i] = accepted[i] ? t : rows[EMBREE_FAR][i];                                             \
            rows[EMBREE_NORMAL][i] = accepted[i] ? nx : rows[EMBREE_NORMAL][i];                                      \
            rows[EMBREE_NORMAL + 1][i] = accepted[i] ? ny : rows[EMBREE_NORMAL + 1][i];                              \
            rows[EMBREE_NORMAL + 2][i] = accepted[i] ? nz : rows[EMBREE_NORMAL + 2][i];                              \
            words[EMBREE_PRIMITIVE][i] = accepted[i] ? primitive : words[EMBREE_PRIMITIVE][i];                       \
            words[EMBREE_GEOMETRY][i] = accepted[i] ? geometry : words[EMBREE_GEOMETRY][i];                          \
        }                                                                                                            \
    }                                                                                                                \
    static void occlude_##N(const EmbreeHitArguments *arguments)                                                     \
    {                                                                                                                \
        _Alignas(64) float distance[N];                                                                              \
        _Alignas(64) int32_t accepted[N];                                                                            \
        test_##N(arguments, distance, accepted);                                                                     \
        float *far = arguments->rays + EMBREE_FAR * N;                                                               \
        for (int i = 0; i < N; i++)                                                                                  \
            far[i] = accepted[i] ? -INFINITY : far[i];                                                               \
    }

PACKET_CALLBACKS(4)
PACKET_CALLBACKS(8)
PACKET_CALLBACKS(16)

/* The distance of the hit of one ray, or -1; it leaves as soon as the ray is known to miss. */
static inline float distance_of_one(const EmbreeHitArguments *arguments)
{
    const HandSphere *sphere = (const HandSphere *)arguments->user + arguments->primitive;
    const float *ray = arguments->rays;
    float ox = ray[0] - sphere->center[0], oy = ray[1] - sphere->center[1], oz = ray[2] - sphere->center[2];
    float dx = ray[4], dy = ray[5], dz = ray[6];
    float a = dx * dx + dy * dy + dz * dz;
    float b = dx * ox + dy * oy + dz * oz;
    float c = ox * ox + oy * oy + oz * oz - sphere->radius * sphere->radius;
    float discriminant = b * b - a * c;
    if (discriminant < 0.0f)
        return -1.0f;
    float root = sqrtf(discriminant), inverse = 1.0f / a;
    float t = (-b - root) * inverse;
    if (!(t > ray[EMBREE_NEAR]))
        t = (-b + root) * inverse;
    return t > ray[EMBREE_NEAR] && t < ray[EMBREE_FAR] ? t : -1.0f;
}

static void intersect_one(const EmbreeHitArguments *arguments)
{
    float t = distance_of_one(arguments);
    if (t < 0.0f)
        return;
    const HandSphere *sphere = (const HandSphere *)arguments->user + arguments->primitive;
    float *ray = arguments->rays;
    ray[EMBREE_FAR] = t;
    for (int axis = 0; axis < 3; axis++)
        ray[EMBREE_NORMAL + axis] = ray[axis] + t * ray[EMBREE_DIRECTION + axis] - sphere->center[axis];
    ((uint32_t *)ray)[EMBREE_PRIMITIVE] = arguments->primitive;
    ((uint32_t *)ray)[EMBREE_GEOMETRY] = arguments->geometry;
}

static void intersect(const EmbreeHitArguments *arguments)
{
    switch (arguments->count) {
    case 16: intersect_16(arguments); break;
    case 8: intersect_8(arguments); break;
    case 4: intersect_4(arguments); break;
    default:
        if (arguments->valid[0])
            intersect_one(arguments);
    }
}

static void occlude(const EmbreeHitArguments *arguments)
{
    switch (arguments->count) {
    case 16: occlude_16(arguments); break;
    case 8: occlude_8(arguments); break;
    case 4: occlude_4(arguments); break;
    default:
        if (arguments->valid[0] && distance_of_one(arguments) >= 0.0f)
            arguments->rays[EMBREE_FAR] = -INFINITY;
    }
}

EmbreeGeometry hand_sphere_geometry(const Embree *embree, EmbreeDevice device, HandSphere *spheres, uint32_t count)
{
    return embree_user_geometry(embree, device, count, spheres, bounds, intersect, occlude);
}
