/* A material asks its host for light and rays, structs and references are set, objects are tested in a leaf. */
#include "check.h"

static const char *const text =
    "struct Layer { vec3 tint; int repeats; };\n"
    "class Layered : rt_Material {\n"
    "    public Layer layers[2];\n"
    "    public Layer top;\n"
    "    public Layer list[];\n"
    "    public rt_Texture map;\n"
    "    public bool isOn;\n"
    "    void shade() {\n"
    "        color sum = color(layers[0].tint) + color(float(layers[1].repeats)) + color(top.tint) * list[1].tint.x;\n"
    "        color light = color(0.0);\n"
    "        illuminance (rt_HitPoint, vec3(0.0, 1.0, 0.0), 1.6) light += rt_LightColor;\n"
    "        rt_SampleColor = isOn ? sum + map.lookup() + light + trace(rt_HitPoint, vec3(0.0, 1.0, 0.0)) : ambient();\n"
    "    }\n"
    "};\n"
    "class Tinted : rt_Material { public texture color kd = color(0.25); void BSDF() { rt_BSDFValue = kd; } };\n"
    "class Flat : rt_Texture { public color value = color(0.5); void lookup() { rt_TextureColor = value; } };\n";

static void trace(void *user, uint32_t base, uint32_t active, const RtslRayLanes *rays, float (*radiance)[RTSL_LANES])
{
    ++*(int *)user;
    for (int lane = 0; lane < RTSL_LANES; lane++)
        if (active >> lane & 1)
            for (int i = 0; i < RTSL_COLOR_COMPONENTS; i++)
                radiance[i][lane] = 100.0f * rays->direction[1][lane] + 1000.0f * (float)(base + lane);
}

static uint32_t light_count(void *user)
{
    (void)user;
    return 2;
}

static uint32_t light_sample(void *user, uint32_t base, uint32_t active, uint32_t index, const RtslLightQueryLanes *query,
                             RtslLightLanes *light)
{
    (void)user, (void)base, (void)query;
    for (int lane = 0; lane < RTSL_LANES; lane++) {
        light->direction[1][lane] = 1.0f;
        for (int i = 0; i < RTSL_COLOR_COMPONENTS; i++)
            light->color[i][lane] = index == 0 ? 10.0f : 20.0f;
    }
    return active;
}

static void ambient(void *user, float *color)
{
    (void)user;
    color[0] = color[1] = color[2] = 0.25f;
}

static void shade(RtslEngineId engine)
{
    RtslUnitId unit;
    RtslInstanceId layered, flat;
    OK(rtsl_compile("layered.rtsl", text, &unit));
    OK(rtsl_instance_new(unit, "Flat", &flat));
    OK(rtsl_instance_commit(flat));
    OK(rtsl_instance_new(unit, "Layered", &layered));
    FAILS(rtsl_instance_commit(layered), RTSL_RESULT_PARAMETER, "E0501");
    float tints[6] = {1, 2, 3, 4, 5, 6};
    int32_t repeats[2] = {7, 8};
    uint8_t on = 1;
    OK(rtsl_instance_set_floats(layered, "layers.tint", tints, 6));
    OK(rtsl_instance_set_floats(layered, "top.tint", tints, 3));
    FAILS(rtsl_instance_commit(layered), RTSL_RESULT_PARAMETER, "repeats");
    OK(rtsl_instance_set_ints(layered, "layers.repeats", repeats, 2));
    OK(rtsl_instance_set_ints(layered, "top.repeats", repeats, 1));
    OK(rtsl_instance_set_floats(layered, "list.tint", tints, 6));
    OK(rtsl_instance_set_ints(layered, "list.repeats", repeats, 2));
    OK(rtsl_instance_set_bools(layered, "isOn", &on, 1));
    FAILS(rtsl_instance_set_floats(layered, "layers.tin", tints, 6), RTSL_RESULT_UNKNOWN, "layers");
    OK(rtsl_instance_set_instances(layered, "map", &flat, 1));
    OK(rtsl_instance_commit(layered));
    OK(rtsl_unit_release(unit));

    RtslKernelId kernel;
    OK(rtsl_kernel_new(engine, layered, "shade", RTSL_PACKET, 8, &kernel));
    float words[RTSL_STATE_COMPONENTS][24] = {{0}};
    float *state[RTSL_STATE_COMPONENTS];
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
        state[i] = words[i];
    int traced = 0;
    RtslHostFunctions host = {.trace = trace, .light_count = light_count, .light_sample = light_sample, .ambient = ambient};
    RtslArguments arguments = {.size = sizeof arguments,
                               .count = 20,
                               .lanes = 24,
                               .state = state,
                               .state_count = RTSL_STATE_COMPONENTS,
                               .host = &host,
                               .user = &traced,
                               .instance = layered};
    OK(rtsl_kernel_call(kernel, &arguments));
    /* layers[0].tint + layers[1].repeats + top.tint * list[1].tint.x + map + lights + ray */
    CHECK(words[RTSL_STATE_SampleColor][0] == 1 + 8 + 1 * 4 + 0.5f + 30 + 100);
    CHECK(words[RTSL_STATE_SampleColor + 1][19] == 2 + 8 + 2 * 4 + 0.5f + 30 + 100 + 19000);
    CHECK(traced > 0);
    arguments.host = NULL;
    OK(rtsl_kernel_call(kernel, &arguments));
    CHECK(words[RTSL_STATE_SampleColor][0] == 1 + 8 + 1 * 4 + 0.5f);
    arguments.host = &host;
    on = 0;
    OK(rtsl_instance_set_bools(layered, "isOn", &on, 1));
    OK(rtsl_instance_commit(layered));
    OK(rtsl_kernel_call(kernel, &arguments));
    CHECK(words[RTSL_STATE_SampleColor][5] == 0.25f);
}

/* A parameter that may be a texture: its default, a number, an instance; the last counts. */
static void textured(RtslEngineId engine)
{
    RtslUnitId unit;
    RtslInstanceId tinted, flat;
    OK(rtsl_compile("layered.rtsl", text, &unit));
    OK(rtsl_instance_new(unit, "Flat", &flat));
    OK(rtsl_instance_commit(flat));
    OK(rtsl_instance_new(unit, "Tinted", &tinted));
    OK(rtsl_unit_release(unit));
    const float number[3] = {0.75f, 0.5f, 1.0f};
    const float expected[4] = {0.25f, 0.75f, 0.5f, 0.75f};
    float words[RTSL_STATE_COMPONENTS][8] = {{0}};
    float *state[RTSL_STATE_COMPONENTS];
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
        state[i] = words[i];
    for (int step = 0; step < 4; step++) {
        if (step == 1 || step == 3)
            OK(rtsl_instance_set_floats(tinted, "kd", number, 3));
        if (step == 2)
            OK(rtsl_instance_set_instances(tinted, "kd", &flat, 1));
        OK(rtsl_instance_commit(tinted));
        RtslKernelId kernel;
        OK(rtsl_kernel_new(engine, tinted, "BSDF", RTSL_PACKET, 8, &kernel));
        RtslArguments arguments = {.size = sizeof arguments,
                                   .count = 8,
                                   .lanes = 8,
                                   .state = state,
                                   .state_count = RTSL_STATE_COMPONENTS,
                                   .instance = tinted};
        OK(rtsl_kernel_call(kernel, &arguments));
        CHECK(words[RTSL_STATE_BSDFValue][7] == expected[step]);
        OK(rtsl_kernel_release(kernel));
    }
    FAILS(rtsl_instance_set_floats(tinted, "kd.x", number, 1), RTSL_RESULT_UNKNOWN, "kd");
    OK(rtsl_instance_set_floats(tinted, "kd", number, 2));
    FAILS(rtsl_instance_commit(tinted), RTSL_RESULT_PARAMETER, "a color or a texture");
    OK(rtsl_instance_release(tinted));
    OK(rtsl_instance_release(flat));
}

static void leaf(RtslEngineId engine)
{
    RtslUnitId unit;
    RtslInstanceId mesh;
    RtslObjectsId faces;
    RtslKernelId kernel;
    uint32_t count;
    const float positions[] = {0, 0, 1, 1, 0, 1, 0, 1, 1, 0, 0, 2, 1, 0, 2, 0, 1, 2};
    const int32_t indices[] = {3, 4, 5, 0, 1, 2};
    OK(rtsl_standard_unit("TriangleMesh", &unit));
    OK(rtsl_instance_new(unit, "TriangleMesh", &mesh));
    OK(rtsl_instance_set_floats(mesh, "positions", positions, 18));
    OK(rtsl_instance_set_ints(mesh, "indices", indices, 6));
    FAILS(rtsl_instance_commit(mesh), RTSL_RESULT_PARAMETER, "normals");
    /* A buffer of nothing is a value. */
    OK(rtsl_instance_set_floats(mesh, "normals", NULL, 0));
    OK(rtsl_instance_set_floats(mesh, "uvs", NULL, 0));
    OK(rtsl_instance_commit(mesh));
    OK(rtsl_elements_new(engine, mesh, &faces));
    OK(rtsl_objects_count(faces, &count));
    CHECK(count == 2);
    OK(rtsl_kernel_of_objects(faces, "intersect", RTSL_LEAF, 0, &kernel));
    const float defaults[RTSL_STATE_COMPONENTS] = {RTSL_STATE_DEFAULTS};
    float words[RTSL_STATE_COMPONENTS];
    float *state[RTSL_STATE_COMPONENTS];
    memcpy(words, defaults, sizeof words);
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
        state[i] = &words[i];
    words[RTSL_STATE_RayOrigin] = words[RTSL_STATE_RayOrigin + 1] = 0.25f;
    uint32_t scratch_count;
    OK(rtsl_kernel_scratch_arrays(kernel, &scratch_count));
    float scratch_words[16];
    float *scratch[16];
    for (int i = 0; i < 16; i++)
        scratch[i] = &scratch_words[i];
    CHECK(scratch_count <= 16);
    RtslArguments arguments = {.size = sizeof arguments,
                               .count = 2,
                               .lanes = 1,
                               .state = state,
                               .state_count = RTSL_STATE_COMPONENTS,
                               .scratch = scratch,
                               .scratch_count = scratch_count,
                               .objects = faces};
    OK(rtsl_kernel_call(kernel, &arguments));
    CHECK(arguments.nearest == 1 && words[RTSL_STATE_HitDistance] == 1.0f);
    arguments.first = 8;
    FAILS(rtsl_kernel_call(kernel, &arguments), RTSL_RESULT_ARGUMENT, "2 objects");
    const void *blocks, *shared;
    OK(rtsl_objects_blocks(faces, &blocks, &shared));
    CHECK((uintptr_t)blocks % 32 == 0 && (uintptr_t)shared % 8 == 0);
    OK(rtsl_objects_release(faces));
}

int main(void)
{
    RtslEngineId engine;
    OK(rtsl_engine_new(NULL, &engine));
    shade(engine);
    textured(engine);
    leaf(engine);
    return 0;
}
