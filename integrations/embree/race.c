/* Races user geometries of spheres under Embree: callbacks written by hand in C, and RTSL's, on one thread. */
#define _POSIX_C_SOURCE 200809L
#include "hand_sphere.h"
#include "rtsl_geometry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SIDE = 512, RAYS = SIDE * SIDE, SPHERES = 10000, MAX_CONTESTANTS = 9, MAX_ROUNDS = 101 };

typedef struct Ray {
    float origin[3];
    float direction[3];
} Ray;

typedef struct Contestant {
    char name[64];
    EmbreeScene scene;
} Contestant;

/* What is measured at a time. */
typedef struct Heat {
    const Ray *rays;
    uint32_t width; /* rays in a packet */
    bool coherent;
    bool occluded;
} Heat;

typedef struct Result {
    double seconds;
    uint32_t hits;
} Result;

static const char USAGE[] = "usage: race [--rounds N] [--width 1|4|8|16] [--spheres FILE] [CLASS | FILE.rtsl]...\n"
                            "  --rounds   how often each is measured, in turns; 11 if not given\n"
                            "  --width    rays in a packet; all sizes if not given\n"
                            "  --spheres  10,000 lines that begin with centre and radius; random spheres if not given\n"
                            "  A class has parameters `center` and `radius`; Sphere of the library if none is given.\n";

static void check(bool is_well)
{
    if (is_well)
        return;
    fprintf(stderr, "%s\n", rtsl_last_error());
    exit(1);
}

/* Of this thread's own time, which others on the machine take less of. */
static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* In [0,1). */
static float random_float(void)
{
    static uint64_t state = 7;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (float)(state >> 40) / (float)(1 << 24);
}

static void read_spheres(const char *path, HandSphere *spheres)
{
    FILE *file = fopen(path, "r");
    if (!file)
        exit((perror(path), 1));
    for (int i = 0; i < SPHERES; i++) {
        float *center = spheres[i].center;
        if (fscanf(file, "%f %f %f %f%*[^\n]", &center[0], &center[1], &center[2], &spheres[i].radius) != 4)
            exit((fprintf(stderr, "error: %s: line %d is no sphere\n", path, i + 1), 1));
    }
    fclose(file);
}

static void make_spheres(HandSphere *spheres)
{
    for (int i = 0; i < SPHERES; i++) {
        for (int axis = 0; axis < 3; axis++)
            spheres[i].center[axis] = 20.0f * random_float() - 10.0f;
        spheres[i].radius = 0.1f + 0.3f * random_float();
    }
}

/* From anywhere among the spheres, every way. */
static Ray random_ray(void)
{
    Ray ray;
    for (int axis = 0; axis < 3; axis++)
        ray.origin[axis] = 20.0f * random_float() - 10.0f;
    float z = 2.0f * random_float() - 1.0f, around = 6.2831853f * random_float(), r = sqrtf(1.0f - z * z);
    ray.direction[0] = r * cosf(around);
    ray.direction[1] = r * sinf(around);
    ray.direction[2] = z;
    return ray;
}

/* Of a camera; in the order of tiles of 4 x 4 pixels. */
static Ray camera_ray(uint32_t i)
{
    const float scale = 0.36397f;
    uint32_t tile = i / 16, pixel = i % 16;
    float x = (float)(tile % (SIDE / 4) * 4 + pixel % 4), y = (float)(tile / (SIDE / 4) * 4 + pixel / 4);
    return (Ray){ { 0.0f, 0.0f, 32.0f },
                  { scale * (2.0f * (x + 0.5f) / SIDE - 1.0f), scale * (1.0f - 2.0f * (y + 0.5f) / SIDE), -1.0f } };
}

static void put_ray(EmbreeRays *rays, uint32_t count, uint32_t lane, const Ray *ray)
{
    for (int axis = 0; axis < 3; axis++) {
        rays->floats[(EMBREE_ORIGIN + axis) * count + lane] = ray->origin[axis];
        rays->floats[(EMBREE_DIRECTION + axis) * count + lane] = ray->direction[axis];
    }
    rays->floats[EMBREE_NEAR * count + lane] = 1e-4f;
    rays->floats[EMBREE_TIME * count + lane] = 0.0f;
    rays->floats[EMBREE_FAR * count + lane] = 1e30f;
    rays->words[EMBREE_MASK * count + lane] = UINT32_MAX;
    rays->words[EMBREE_ID * count + lane] = 0;
    rays->words[EMBREE_FLAGS * count + lane] = 0;
    rays->words[EMBREE_GEOMETRY * count + lane] = EMBREE_NONE;
    rays->words[EMBREE_INSTANCE * count + lane] = EMBREE_NONE;
}

static Result run(const Embree *embree, EmbreeScene scene, Heat heat)
{
    _Alignas(64) int32_t valid[EMBREE_MAX_RAYS];
    EmbreeRays rays;
    Result result = { 0 };
    memset(valid, -1, sizeof valid);
    double begin = seconds();
    for (uint32_t first = 0; first < RAYS; first += heat.width) {
        for (uint32_t lane = 0; lane < heat.width; lane++)
            put_ray(&rays, heat.width, lane, &heat.rays[first + lane]);
        if (heat.occluded)
            embree_occluded(embree, scene, valid, &rays, heat.width, heat.coherent);
        else
            embree_intersect(embree, scene, valid, &rays, heat.width, heat.coherent);
        for (uint32_t lane = 0; lane < heat.width; lane++)
            result.hits += heat.occluded ? rays.floats[EMBREE_FAR * heat.width + lane] < 0.0f
                                         : rays.words[EMBREE_GEOMETRY * heat.width + lane] != EMBREE_NONE;
    }
    result.seconds = seconds() - begin;
    return result;
}

static EmbreeScene scene_of(const Embree *embree, EmbreeDevice device, EmbreeGeometry geometry)
{
    EmbreeScene scene = embree_new_scene(embree, device);
    embree_attach(embree, scene, geometry);
    embree->commit_scene(scene);
    return scene;
}

/* Spheres of an RTSL class. */
static RtslGeometry *rtsl_spheres(const Embree *embree, RtslEngineId engine, const char *source, const HandSphere *spheres)
{
    static RtslInstanceId instances[SPHERES];
    bool is_file = strlen(source) > 5 && strcmp(source + strlen(source) - 5, ".rtsl") == 0;
    RtslUnitId unit;
    const RtslClassInfo *info;
    if (is_file) {
        check(rtsl_compile_file(source, NULL, 0, &unit) == RTSL_RESULT_OK);
        check(rtsl_unit_class(unit, 0, &info) == RTSL_RESULT_OK);
    } else {
        check(rtsl_standard_unit(source, &unit) == RTSL_RESULT_OK);
        check(rtsl_unit_find_class(unit, source, &info) == RTSL_RESULT_OK);
    }
    for (int i = 0; i < SPHERES; i++) {
        check(rtsl_instance_new(unit, info->name, &instances[i]) == RTSL_RESULT_OK);
        check(rtsl_instance_set_floats(instances[i], "center", spheres[i].center, 3) == RTSL_RESULT_OK);
        check(rtsl_instance_set_floats(instances[i], "radius", &spheres[i].radius, 1) == RTSL_RESULT_OK);
        check(rtsl_instance_commit(instances[i]) == RTSL_RESULT_OK);
    }
    RtslGeometry *geometry = rtsl_geometry_new(embree, engine, instances, SPHERES);
    if (!geometry)
        exit(1);
    return geometry;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, by_size);
    return values[count / 2];
}

/* Each contestant in each round, in turns; ratios of speeds to the first's within a round, and their medians. */
static void race(const Embree *embree, const Contestant *contestants, int count, int rounds, Heat heat)
{
    static double times[MAX_CONTESTANTS][MAX_ROUNDS], ratios[MAX_CONTESTANTS][MAX_ROUNDS];
    Result result[MAX_CONTESTANTS];
    for (int round = 0; round < rounds; round++)
        for (int i = 0; i < count; i++) {
            result[i] = run(embree, contestants[i].scene, heat);
            times[i][round] = result[i].seconds;
            ratios[i][round] = times[0][round] / times[i][round];
        }
    for (int i = 0; i < count; i++)
        printf("%-8s  %-8s  %5u  %-24s  %7.2f  %5.3f  %6u\n", heat.occluded ? "occluded" : "closest",
               heat.coherent ? "coherent" : "random", heat.width, contestants[i].name,
               RAYS * 1e-6 / median(times[i], rounds), median(ratios[i], rounds), result[i].hits);
    fflush(stdout);
}

int main(int count, char **arguments)
{
    static HandSphere spheres[SPHERES];
    static Ray rays[2][RAYS];
    static const uint32_t widths[4] = { 1, 4, 8, 16 };
    const char *sources[MAX_CONTESTANTS], *path = NULL;
    int source_count = 0, rounds = 11;
    uint32_t width = 0;
    for (int i = 1; i < count; i++) {
        bool has_value = i + 1 < count;
        if (strcmp(arguments[i], "--rounds") == 0 && has_value)
            rounds = atoi(arguments[++i]);
        else if (strcmp(arguments[i], "--width") == 0 && has_value)
            width = (uint32_t)atoi(arguments[++i]);
        else if (strcmp(arguments[i], "--spheres") == 0 && has_value)
            path = arguments[++i];
        else if (arguments[i][0] != '-' && source_count < MAX_CONTESTANTS - 1)
            sources[source_count++] = arguments[i];
        else
            return fputs(USAGE, stderr), 2;
    }
    if (rounds < 1 || rounds > MAX_ROUNDS)
        return fprintf(stderr, "error: there can be 1 to %d rounds\n", MAX_ROUNDS), 2;
    if (source_count == 0)
        sources[source_count++] = "Sphere";
    if (path)
        read_spheres(path, spheres);
    else
        make_spheres(spheres);
    for (uint32_t i = 0; i < RAYS; i++) {
        rays[0][i] = camera_ray(i);
        rays[1][i] = random_ray();
    }

    Embree embree;
    if (!embree_load(&embree))
        return 1;
    EmbreeDevice device = embree.new_device("threads=1");
    RtslEngineOptions options = { .size = sizeof options, .backend = RTSL_BACKEND_JIT };
    RtslEngineId engine;
    check(rtsl_engine_new(&options, &engine) == RTSL_RESULT_OK);
    Contestant contestants[MAX_CONTESTANTS] = { { "by hand", NULL } };
    contestants[0].scene = scene_of(&embree, device, hand_sphere_geometry(&embree, device, spheres, SPHERES));
    for (int i = 0; i < source_count; i++) {
        Contestant *contestant = &contestants[1 + i];
        snprintf(contestant->name, sizeof contestant->name, "%s", sources[i]);
        RtslGeometry *geometry = rtsl_spheres(&embree, engine, sources[i], spheres);
        contestant->scene = scene_of(&embree, device, rtsl_geometry_attach(geometry, &embree, device));
    }
    printf("Embree %d, %d spheres, %d rounds of %d rays\n", embree_full_version(&embree, device), SPHERES, rounds, RAYS);
    printf("query     rays      width  callback                   Mray/s  ratio    hits\n");
    for (int occluded = 0; occluded < 2; occluded++)
        for (int random = 0; random < 2; random++)
            for (int w = 0; w < 4; w++)
                if (width == 0 || width == widths[w])
                    race(&embree, contestants, 1 + source_count, rounds,
                         (Heat){ rays[random], widths[w], !random, occluded });
    return 0;
}
