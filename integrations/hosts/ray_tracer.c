/* A ray tracer in C: a primitive and a material from files named on the command line, and a picture for each name that
   ends with .ppm, with the parameters that were set before it:

       ray_tracer torus.rtsl ward.rtsl minorRadius=0.2 thin.ppm minorRadius=0.5 alphaU=0.4 thick.ppm */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "rtsl.h"

enum { WIDTH = 512, HEIGHT = 384, RAYS = 64, SCRATCH = 64 };

static float words[RTSL_STATE_COMPONENTS + SCRATCH][RAYS];
static float *arrays[RTSL_STATE_COMPONENTS + SCRATCH];
static int32_t accepted[RAYS];
static RtslEngineId engine;
static RtslInstanceId primitive, material;

static void check(RtslResult result) {
    if (result != RTSL_RESULT_OK) {
        fprintf(stderr, "%s\n", rtsl_last_error());
        exit(1);
    }
}

/* An instance of the first class of a file. */
static RtslInstanceId load(const char *path) {
    RtslUnitId unit;
    RtslInstanceId instance;
    const RtslClassInfo *info;
    check(rtsl_compile_file(path, NULL, 0, &unit));
    check(rtsl_unit_class(unit, 0, &info));
    check(rtsl_instance_new(unit, info->name, &instance));
    check(rtsl_instance_commit(instance));
    return instance;
}

/* What the material asks for: a light from the upper right, and a sky that its rays find. */
static float sky(int i, float y) { return 0.45f + 0.1f * (float)i + 0.4f * y; }
static uint32_t light_count(void *user) { return user ? 0 : 1; }
static uint32_t light_sample(void *user, uint32_t base, uint32_t active, uint32_t index, const RtslLightQueryLanes *query,
                             RtslLightLanes *light) {
    static const float direction[3] = {0.48f, 0.64f, -0.6f}, color[3] = {3.2f, 3.0f, 2.6f};
    (void)user, (void)base, (void)index, (void)query;
    for (int i = 0; i < 3 * RTSL_LANES; i++) {
        light->direction[i / RTSL_LANES][i % RTSL_LANES] = direction[i / RTSL_LANES];
        light->color[i / RTSL_LANES][i % RTSL_LANES] = color[i / RTSL_LANES];
    }
    return active;
}
static void trace(void *user, uint32_t base, uint32_t active, const RtslRayLanes *rays, float (*radiance)[RTSL_LANES]) {
    (void)user, (void)base, (void)active;
    for (int i = 0; i < 3 * RTSL_LANES; i++)
        radiance[i / RTSL_LANES][i % RTSL_LANES] = sky(i / RTSL_LANES, rays->direction[1][i % RTSL_LANES]);
}
static const RtslHostFunctions host = {.trace = trace, .light_count = light_count, .light_sample = light_sample};

/* Calls a method for the rays of a mask, if the class has it; its kernel is made the first time. */
static void call(RtslInstanceId instance, const char *method, RtslKernelId *kernel, const int32_t *mask) {
    if (kernel->id == 0) {
        RtslResult made = rtsl_kernel_new(engine, instance, method, RTSL_PACKET, 0, kernel);
        if (made == RTSL_RESULT_UNKNOWN)
            return;
        check(made);
    }
    RtslArguments arguments = {.size = sizeof arguments, .count = RAYS, .lanes = RAYS, .host = &host, .instance = instance,
                               .state = arrays, .state_count = RTSL_STATE_COMPONENTS, .mask = mask, .accepted = accepted,
                               .scratch = arrays + RTSL_STATE_COMPONENTS, .scratch_count = SCRATCH};
    check(rtsl_kernel_call(*kernel, &arguments));
}

static void normalize(int first, int ray) {
    float x = words[first][ray], y = words[first + 1][ray], z = words[first + 2][ray];
    for (int i = 0; i < 3; i++)
        words[first + i][ray] /= sqrtf(x * x + y * y + z * z);
}

/* The colours of RAYS pixels in a row from x on. */
static void render(int x, int y, unsigned char (*pixels)[3]) {
    static const float defaults[RTSL_STATE_COMPONENTS] = {RTSL_STATE_DEFAULTS};
    static const float eye[3] = {0.0f, 2.4f, -3.2f}, ahead[3] = {0.0f, -0.6f, 0.8f}, up[3] = {0.0f, 0.8f, 0.6f};
    static RtslKernelId intersect, normal, coordinates, derivatives, shade;
    const int direction = RTSL_STATE_RayDirection;
    int32_t hits[RAYS];
    for (int ray = 0; ray < RAYS; ray++) {
        float u = ((float)(x + ray) + 0.5f - WIDTH / 2) / HEIGHT, v = (HEIGHT / 2 - (float)y - 0.5f) / HEIGHT;
        for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
            words[i][ray] = defaults[i];
        for (int i = 0; i < 3; i++) {
            words[RTSL_STATE_RayOrigin + i][ray] = eye[i];
            words[direction + i][ray] = ahead[i] + (i == 0 ? u : v * up[i]);
        }
        normalize(direction, ray);
        for (int i = 0; i < 3; i++)
            words[RTSL_STATE_InverseRayDirection + i][ray] = 1.0f / words[direction + i][ray];
    }
    call(primitive, "intersect", &intersect, NULL);
    memcpy(hits, accepted, sizeof hits);
    for (int i = 0; i < 3 * RAYS; i++)
        words[RTSL_STATE_HitPoint + i / RAYS][i % RAYS] =
            eye[i / RAYS] + words[RTSL_STATE_HitDistance][i % RAYS] * words[direction + i / RAYS][i % RAYS];
    call(primitive, "computeNormal", &normal, hits);
    for (int ray = 0; ray < RAYS; ray++) {
        normalize(RTSL_STATE_GeometricNormal, ray);
        normalize(RTSL_STATE_ShadingNormal, ray);
    }
    call(primitive, "computeTextureCoordinates", &coordinates, hits);
    call(primitive, "computeDerivatives", &derivatives, hits);
    call(material, "shade", &shade, hits);
    for (int i = 0; i < 3; i++)
        for (int ray = 0; ray < RAYS; ray++) {
            float value = hits[ray] ? words[RTSL_STATE_SampleColor + i][ray] : sky(i, words[direction + 1][ray]);
            /* A display's gamma is about 2. */
            pixels[ray][i] = (unsigned char)(255.0f * sqrtf(fminf(fmaxf(value, 0.0f), 1.0f)) + 0.5f);
        }
}

static void write_picture(const char *path) {
    static unsigned char pixels[HEIGHT][WIDTH][3];
    clock_t start = clock();
    for (int i = 0; i < HEIGHT * WIDTH; i += RAYS)
        render(i % WIDTH, i / WIDTH, &pixels[i / WIDTH][i % WIDTH]);
    printf("%s: %.1f ms\n", path, 1e3 * (double)(clock() - start) / CLOCKS_PER_SEC);
    FILE *file = fopen(path, "wb");
    if (!file || fprintf(file, "P6\n%d %d\n255\n", WIDTH, HEIGHT) < 0 || !fwrite(pixels, sizeof pixels, 1, file) || fclose(file))
        exit((perror(path), 1));
}

/* Sets NAME=NUMBER in whichever of the two has such a parameter. Nothing is compiled. */
static void set(const char *name, float value) {
    RtslInstanceId instance = material;
    if (rtsl_instance_set_floats(material, name, &value, 1) == RTSL_RESULT_UNKNOWN)
        check(rtsl_instance_set_floats(instance = primitive, name, &value, 1));
    check(rtsl_instance_commit(instance));
}

int main(int count, char **arguments) {
    if (count < 4)
        return fprintf(stderr, "usage: %s PRIMITIVE.rtsl MATERIAL.rtsl [NAME=NUMBER | PICTURE.ppm]...\n", *arguments), 2;
    for (int i = 0; i < RTSL_STATE_COMPONENTS + SCRATCH; i++)
        arrays[i] = words[i];
    check(rtsl_engine_new(NULL, &engine));
    primitive = load(arguments[1]), material = load(arguments[2]);
    for (int i = 3; i < count; i++) {
        char *equals = strchr(arguments[i], '=');
        equals ? (*equals = '\0', set(arguments[i], strtof(equals + 1, NULL))) : write_picture(arguments[i]);
    }
    return 0;
}
