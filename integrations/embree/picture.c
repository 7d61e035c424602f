/* Draws RTSL primitives through Embree. */
#include "rtsl_geometry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SIZE = 4096, MAX_PRIMITIVES = 64, MAX_NUMBERS = 64, MAX_SCRATCH = 64 };

/* Primitives of one class, which are a geometry. */
typedef struct Group {
    const char *source;
    RtslUnitId unit;
    const char *class_name;
    RtslInstanceId instances[MAX_PRIMITIVES];
    uint32_t count;
    RtslGeometry *geometry;
    RtslKernelId intersect; /* for comparisons without Embree */
} Group;

typedef struct Scene {
    Embree embree;
    EmbreeDevice device;
    EmbreeScene scene;
    RtslEngineId engine;
    Group groups[MAX_PRIMITIVES];
    uint32_t group_count;
} Scene;

typedef struct Options {
    uint32_t width; /* rays in a packet */
    int size;       /* pixels in a row, and rows */
    bool check;
    const char *output;
} Options;

typedef struct Vector {
    float axis[3];
} Vector;

static const char USAGE[] =
    "usage: picture [--width 1|4|8|16] [--size N] [--check] PRIMITIVE [NAME=NUMBER[,NUMBER]...]... PICTURE.ppm\n"
    "  PRIMITIVE  a class of the standard library, as Torus, or a file.rtsl, whose first class it is\n"
    "  --width    rays in a packet; 16 if not given\n"
    "  --size     pixels in a row, and rows, a multiple of 16; 256 if not given\n"
    "  --check    compares every hit with that of a loop over all primitives without Embree\n";

static void check(RtslResult result)
{
    if (result == RTSL_RESULT_OK)
        return;
    fprintf(stderr, "%s\n", rtsl_last_error());
    exit(1);
}

/* ---- what there is to draw ---- */

static bool ends_with(const char *text, const char *end)
{
    size_t length = strlen(text), end_length = strlen(end);
    return length >= end_length && strcmp(text + length - end_length, end) == 0;
}

/* The group of the newest primitive, which is one more of the same class where the source is the same. */
static Group *add_primitive(Scene *scene, const char *source)
{
    Group *last = scene->group_count ? &scene->groups[scene->group_count - 1] : NULL;
    if (!last || strcmp(last->source, source) != 0) {
        if (scene->group_count == MAX_PRIMITIVES)
            exit((fprintf(stderr, "error: there can be %d groups of primitives\n", MAX_PRIMITIVES), 1));
        const RtslClassInfo *info;
        last = &scene->groups[scene->group_count++];
        last->source = source;
        if (ends_with(source, ".rtsl")) {
            check(rtsl_compile_file(source, NULL, 0, &last->unit));
            check(rtsl_unit_class(last->unit, 0, &info));
        } else {
            check(rtsl_standard_unit(source, &last->unit));
            check(rtsl_unit_find_class(last->unit, source, &info));
        }
        last->class_name = info->name;
    }
    if (last->count == MAX_PRIMITIVES)
        exit((fprintf(stderr, "error: there can be %d primitives of one class\n", MAX_PRIMITIVES), 1));
    check(rtsl_instance_new(last->unit, last->class_name, &last->instances[last->count++]));
    return last;
}

/* Sets NAME=NUMBER,NUMBER. */
static void set_parameter(RtslInstanceId instance, const char *setting)
{
    char name[128];
    float numbers[MAX_NUMBERS];
    size_t count = 0, length = (size_t)(strchr(setting, '=') - setting);
    snprintf(name, sizeof name, "%.*s", (int)length, setting);
    for (const char *text = setting + length + 1; *text && count < MAX_NUMBERS;) {
        char *end;
        numbers[count++] = strtof(text, &end);
        if (end == text || (*end && *end != ','))
            exit((fprintf(stderr, "error: `%s` is no list of numbers\n", setting + length + 1), 2));
        text = *end ? end + 1 : end;
    }
    check(rtsl_instance_set_floats(instance, name, numbers, count));
}

static void build(Scene *scene)
{
    scene->scene = embree_new_scene(&scene->embree, scene->device);
    for (uint32_t i = 0; i < scene->group_count; i++) {
        Group *group = &scene->groups[i];
        for (uint32_t k = 0; k < group->count; k++)
            check(rtsl_instance_commit(group->instances[k]));
        group->geometry = rtsl_geometry_new(&scene->embree, scene->engine, group->instances, group->count);
        if (!group->geometry)
            exit(1);
        check(rtsl_kernel_new(scene->engine, group->instances[0], "intersect", RTSL_PACKET, 1, &group->intersect));
        embree_attach(&scene->embree, scene->scene, rtsl_geometry_attach(group->geometry, &scene->embree, scene->device));
    }
    scene->embree.commit_scene(scene->scene);
}

/* ---- looking at it: nothing but arithmetic that has the same bits everywhere ---- */

static float dot(Vector a, Vector b) { return a.axis[0] * b.axis[0] + a.axis[1] * b.axis[1] + a.axis[2] * b.axis[2]; }

static Vector normalize(Vector v)
{
    float length = sqrtf(dot(v, v));
    return (Vector){ { v.axis[0] / length, v.axis[1] / length, v.axis[2] / length } };
}

/* Looks at the middle of a box from the upper left. */
typedef struct Camera {
    Vector eye;
    float scale; /* half of the box's diagonal */
} Camera;

static Camera camera_of(const EmbreeBounds *bounds)
{
    static const Vector back = { { -0.48f, 0.64f, -0.6f } };
    Vector half, middle;
    for (int axis = 0; axis < 3; axis++) {
        half.axis[axis] = 0.5f * (bounds->upper[axis] - bounds->lower[axis]);
        middle.axis[axis] = bounds->lower[axis] + half.axis[axis];
    }
    Camera camera = { middle, sqrtf(dot(half, half)) };
    if (!(camera.scale < 1e18f))
        exit((fprintf(stderr, "error: the primitives' bounds are not finite, which Embree has no use for\n"), 1));
    for (int axis = 0; axis < 3; axis++)
        camera.eye.axis[axis] += 3.0f * camera.scale * back.axis[axis];
    return camera;
}

static Vector direction_to(int x, int y, int size)
{
    static const Vector right = { { 0.78086880f, 0.0f, -0.62469505f } }, up = { { 0.39980480f, 0.76837490f, 0.49975600f } },
                        ahead = { { 0.48f, -0.64f, 0.6f } };
    float u = 0.7f * (2.0f * ((float)x + 0.5f) / (float)size - 1.0f), v = 0.7f * (1.0f - 2.0f * ((float)y + 0.5f) / (float)size);
    Vector direction;
    for (int axis = 0; axis < 3; axis++)
        direction.axis[axis] = u * right.axis[axis] + v * up.axis[axis] + 2.0f * ahead.axis[axis];
    return direction;
}

static void put_ray(EmbreeRays *rays, uint32_t count, uint32_t lane, Vector origin, Vector direction, float near)
{
    for (int axis = 0; axis < 3; axis++) {
        rays->floats[(EMBREE_ORIGIN + axis) * count + lane] = origin.axis[axis];
        rays->floats[(EMBREE_DIRECTION + axis) * count + lane] = direction.axis[axis];
    }
    rays->floats[EMBREE_NEAR * count + lane] = near;
    rays->floats[EMBREE_FAR * count + lane] = INFINITY;
    rays->floats[EMBREE_TIME * count + lane] = 0.0f;
    rays->words[EMBREE_MASK * count + lane] = UINT32_MAX;
    rays->words[EMBREE_ID * count + lane] = lane;
    rays->words[EMBREE_FLAGS * count + lane] = 0;
    rays->words[EMBREE_PRIMITIVE * count + lane] = EMBREE_NONE;
    rays->words[EMBREE_GEOMETRY * count + lane] = EMBREE_NONE;
    rays->words[EMBREE_INSTANCE * count + lane] = EMBREE_NONE;
}

static Vector row_vector(const EmbreeRays *rays, uint32_t count, uint32_t lane, uint32_t row)
{
    Vector vector;
    for (uint32_t axis = 0; axis < 3; axis++)
        vector.axis[axis] = rays->floats[(row + axis) * count + lane];
    return vector;
}

static const Vector TO_LIGHT = { { -0.8f, 0.6f, 0.0f } };

/* The normal on the side that the ray sees. */
static Vector seen_normal(const EmbreeRays *rays, uint32_t count, uint32_t lane)
{
    Vector normal = normalize(row_vector(rays, count, lane, EMBREE_NORMAL));
    float sign = dot(normal, row_vector(rays, count, lane, EMBREE_DIRECTION)) > 0.0f ? -1.0f : 1.0f;
    for (int axis = 0; axis < 3; axis++)
        normal.axis[axis] *= sign;
    return normal;
}

static void color_of(const EmbreeRays *rays, uint32_t count, uint32_t lane, bool is_lit, unsigned char *pixel)
{
    float value[3] = { 0.85f, 0.9f, 0.95f };
    if (rays->words[EMBREE_GEOMETRY * count + lane] != EMBREE_NONE) {
        Vector normal = seen_normal(rays, count, lane);
        float light = 0.25f + (is_lit ? 0.75f * fmaxf(dot(normal, TO_LIGHT), 0.0f) : 0.0f);
        for (int axis = 0; axis < 3; axis++)
            value[axis] = light * (0.75f + 0.25f * normal.axis[axis]);
    }
    for (int axis = 0; axis < 3; axis++)
        /* A display's gamma is about 2. */
        pixel[axis] = (unsigned char)(255.0f * sqrtf(value[axis]) + 0.5f);
}

/* A few roundings. */
static const float ROUNDINGS = 0x1p-20f;

/* The point at which rays to the light begin: off the surface by more than rounding may have put the hit on the other side, which
   follows from the sizes of the numbers that it is computed from, whatever the size of the scene. */
static Vector start_of_shadow(const EmbreeRays *rays, uint32_t count, uint32_t lane)
{
    Vector origin = row_vector(rays, count, lane, EMBREE_ORIGIN);
    Vector direction = row_vector(rays, count, lane, EMBREE_DIRECTION);
    Vector normal = seen_normal(rays, count, lane);
    float distance = rays->floats[EMBREE_FAR * count + lane];
    float offset = 0.0f;
    Vector point;
    for (int axis = 0; axis < 3; axis++) {
        float way = distance * direction.axis[axis];
        offset += ROUNDINGS * fabsf(normal.axis[axis]) * (fabsf(origin.axis[axis]) + fabsf(way));
        point.axis[axis] = origin.axis[axis] + way;
    }
    for (int axis = 0; axis < 3; axis++)
        point.axis[axis] += offset * normal.axis[axis];
    return point;
}

/* Rays from hits to the light; what hit nothing has none. */
static void put_shadow_rays(const EmbreeRays *rays, uint32_t count, EmbreeRays *shadows, int32_t *valid)
{
    for (uint32_t lane = 0; lane < count; lane++) {
        valid[lane] = rays->words[EMBREE_GEOMETRY * count + lane] != EMBREE_NONE ? -1 : 0;
        Vector start = valid[lane] ? start_of_shadow(rays, count, lane) : (Vector){ { 0 } };
        put_ray(shadows, count, lane, start, TO_LIGHT, 0.0f);
    }
}

/* The pixels of a packet in a row from x on. */
static void draw_packet(const Scene *scene, Camera camera, Options options, int x, int y, EmbreeRays *rays,
                        unsigned char (*pixels)[3])
{
    _Alignas(64) int32_t valid[EMBREE_MAX_RAYS];
    EmbreeRays shadows;
    uint32_t count = options.width;
    for (uint32_t lane = 0; lane < count; lane++) {
        put_ray(rays, count, lane, camera.eye, direction_to(x + (int)lane, y, options.size), 0.0f);
        valid[lane] = -1;
    }
    embree_intersect(&scene->embree, scene->scene, valid, rays, count, true);
    put_shadow_rays(rays, count, &shadows, valid);
    if (count > 1 || valid[0])
        embree_occluded(&scene->embree, scene->scene, valid, &shadows, count, true);
    for (uint32_t lane = 0; lane < count; lane++)
        color_of(rays, count, lane, shadows.floats[EMBREE_FAR * count + lane] > 0.0f, pixels[lane]);
}

/* ---- the same without Embree ---- */

/* The nearest hit of a ray among all primitives: its distance; an earlier primitive wins where two are as near. */
static float nearest(const Scene *scene, Vector origin, Vector direction, float near)
{
    float words[RTSL_STATE_COMPONENTS] = { RTSL_STATE_DEFAULTS };
    float scratch_words[MAX_SCRATCH] = { 0 };
    float *state[RTSL_STATE_COMPONENTS], *scratch[MAX_SCRATCH];
    int32_t accepted = 0;
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
        state[i] = &words[i];
    for (int i = 0; i < MAX_SCRATCH; i++)
        scratch[i] = &scratch_words[i];
    for (int axis = 0; axis < 3; axis++) {
        words[RTSL_STATE_RayOrigin + axis] = origin.axis[axis];
        words[RTSL_STATE_RayDirection + axis] = direction.axis[axis];
        words[RTSL_STATE_InverseRayDirection + axis] = 1.0f / direction.axis[axis];
    }
    words[RTSL_STATE_Epsilon] = near;
    words[RTSL_STATE_HitDistance] = INFINITY;
    for (uint32_t i = 0; i < scene->group_count; i++) {
        const Group *group = &scene->groups[i];
        for (uint32_t k = 0; k < group->count; k++) {
            RtslArguments arguments = { .size = sizeof arguments, .count = 1, .lanes = 1, .state_count = RTSL_STATE_COMPONENTS,
                                        .scratch_count = MAX_SCRATCH, .state = state, .scratch = scratch, .accepted = &accepted,
                                        .instance = group->instances[k] };
            check(rtsl_kernel_call(group->intersect, &arguments));
        }
    }
    return words[RTSL_STATE_HitDistance];
}

/* How many of a packet's distances differ, by any bit, from those of a loop over all primitives. */
static uint32_t count_differences(const Scene *scene, const EmbreeRays *rays, uint32_t count)
{
    uint32_t differences = 0;
    for (uint32_t lane = 0; lane < count; lane++) {
        float expected = nearest(scene, row_vector(rays, count, lane, EMBREE_ORIGIN),
                                 row_vector(rays, count, lane, EMBREE_DIRECTION), rays->floats[EMBREE_NEAR * count + lane]);
        differences += memcmp(&expected, &rays->floats[EMBREE_FAR * count + lane], sizeof expected) != 0;
    }
    return differences;
}

/* ---- the program ---- */

static uint32_t draw(const Scene *scene, Options options, unsigned char (*pixels)[3])
{
    EmbreeBounds bounds;
    EmbreeRays rays;
    uint32_t differences = 0;
    scene->embree.scene_bounds(scene->scene, &bounds);
    Camera camera = camera_of(&bounds);
    for (int pixel = 0; pixel < options.size * options.size; pixel += (int)options.width) {
        draw_packet(scene, camera, options, pixel % options.size, pixel / options.size, &rays, pixels + pixel);
        if (options.check)
            differences += count_differences(scene, &rays, options.width);
    }
    return differences;
}

static Options read_arguments(Scene *scene, int count, char **arguments)
{
    Options options = { 16, 256, false, NULL };
    Group *group = NULL;
    for (int i = 1; i < count; i++) {
        if (strcmp(arguments[i], "--width") == 0 && i + 1 < count)
            options.width = (uint32_t)atoi(arguments[++i]);
        else if (strcmp(arguments[i], "--size") == 0 && i + 1 < count)
            options.size = atoi(arguments[++i]);
        else if (strcmp(arguments[i], "--check") == 0)
            options.check = true;
        else if (strchr(arguments[i], '=') && group)
            set_parameter(group->instances[group->count - 1], arguments[i]);
        else if (ends_with(arguments[i], ".ppm"))
            options.output = arguments[i];
        else
            group = add_primitive(scene, arguments[i]);
    }
    bool is_width = options.width == 1 || options.width == 4 || options.width == 8 || options.width == 16;
    bool is_size = options.size > 0 && options.size <= MAX_SIZE && options.size % 16 == 0;
    if (!is_width || !is_size || !options.output || !group)
        exit((fputs(USAGE, stderr), 2));
    return options;
}

static void write_picture(const char *path, int size, const void *pixels)
{
    FILE *file = fopen(path, "wb");
    if (!file || fprintf(file, "P6\n%d %d\n255\n", size, size) < 0
        || fwrite(pixels, 3 * (size_t)size, (size_t)size, file) != (size_t)size || fclose(file) != 0)
        exit((perror(path), 1));
}

int main(int count, char **arguments)
{
    static Scene scene;
    RtslEngineOptions engine = { .size = sizeof engine, .backend = RTSL_BACKEND_JIT };
    if (count < 2)
        return fputs(USAGE, stderr), 2;
    Options options = read_arguments(&scene, count, arguments);
    if (!embree_load(&scene.embree))
        return 1;
    check(rtsl_engine_new(&engine, &scene.engine));
    scene.device = scene.embree.new_device(NULL);
    build(&scene);
    unsigned char(*pixels)[3] = malloc(3 * (size_t)options.size * (size_t)options.size);
    uint32_t differences = draw(&scene, options, pixels);
    write_picture(options.output, options.size, pixels);
    if (options.check)
        printf("%u of %d hits differ from those without Embree\n", differences, options.size * options.size);
    free(pixels);
    scene.embree.release_scene(scene.scene);
    scene.embree.release_device(scene.device);
    for (uint32_t i = 0; i < scene.group_count; i++)
        rtsl_geometry_free(scene.groups[i].geometry);
    return differences != 0;
}
