/* A host compiles a class, calls it, changes a parameter and calls the same kernel again. */
#include "check.h"

static const char *const ball =
    "class Ball : rt_Primitive;\n"
    "[[label \"Radius\", min 0, doc \"How far the surface is.\"]] public float radius = 1.0;\n"
    "private float squared;\n"
    "constructor(vec3 center = vec3(0.0), float scale = 1.0) { squared = scale * radius * radius; }\n"
    "scratch float side;\n"
    "void intersect() {\n"
    "    float b = dot(rt_RayOrigin, rt_RayDirection);\n"
    "    float discriminant = b * b - dot(rt_RayOrigin, rt_RayOrigin) + squared;\n"
    "    if (discriminant > 0.0 && hit(-b - sqrt(discriminant))) side = 7.0;\n"
    "}\n";

enum { RAYS = 21, LANES = 32 };

static float arrays[RTSL_STATE_COMPONENTS][LANES];
static float side[LANES];

static float distance_of_first(RtslKernelId kernel, RtslInstanceId instance, RtslArguments *arguments)
{
    const float defaults[RTSL_STATE_COMPONENTS] = {RTSL_STATE_DEFAULTS};
    for (int component = 0; component < RTSL_STATE_COMPONENTS; component++)
        for (int lane = 0; lane < LANES; lane++)
            arrays[component][lane] = defaults[component];
    for (int lane = 0; lane < LANES; lane++)
        arrays[RTSL_STATE_RayOrigin + 2][lane] = -5.0f;
    /* One looks away. */
    arrays[RTSL_STATE_RayDirection + 2][3] = -1.0f;
    arguments->instance = instance;
    OK(rtsl_kernel_call(kernel, arguments));
    return arrays[RTSL_STATE_HitDistance][0];
}

static void check_class(RtslUnitId unit)
{
    const RtslClassInfo *info;
    uint32_t count;
    OK(rtsl_unit_class_count(unit, &count));
    CHECK(count == 1);
    OK(rtsl_unit_class(unit, 0, &info));
    CHECK(strcmp(info->name, "Ball") == 0 && info->roles == RTSL_PRIMITIVE);
    OK(rtsl_unit_find_class(unit, "Ball", &info));
    CHECK(info->method_count == 2 && strcmp(info->methods[0], "intersect") == 0);
    CHECK(info->parameter_count == 3);
    const RtslParameterInfo *radius = &info->parameters[2];
    CHECK(strcmp(radius->name, "radius") == 0 && strcmp(radius->type_name, "float") == 0);
    CHECK(strcmp(radius->label, "Radius") == 0 && radius->minimum == 0.0f);
    CHECK(strcmp(radius->documentation, "How far the surface is.") == 0);
    float one;
    CHECK(radius->default_count == 1);
    memcpy(&one, radius->default_words, sizeof one);
    CHECK(one == 1.0f && radius->annotation_count == 3);
    CHECK(strcmp(radius->annotations[1].key, "min") == 0 && strcmp(radius->annotations[1].value, "0") == 0);
}

int main(void)
{
    CHECK(rtsl_abi() == RTSL_ABI);
    RtslUnitId unit;
    OK(rtsl_compile("ball.rtsl", ball, &unit));
    CHECK(rtsl_last_diagnostic_count() == 0);
    check_class(unit);

    RtslInstanceId instance;
    OK(rtsl_instance_new(unit, "Ball", &instance));
    OK(rtsl_instance_commit(instance));
    RtslEngineOptions options = {.size = sizeof options, .loop_budget = 1000};
    for (uint32_t backend = 0; backend < 3; backend += 2) {
        RtslEngineId engine;
        options.backend = backend;
        OK(rtsl_engine_new(&options, &engine));
        RtslKernelId kernel;
        OK(rtsl_kernel_new(engine, instance, "intersect", RTSL_PACKET, backend == 0 ? 8 : 0, &kernel));
        RtslMethod info;
        OK(rtsl_kernel_info(kernel, &info));
        CHECK(strcmp(info.name, "intersect") == 0 && info.flags == RTSL_WRITES_SCRATCH);

        float *state[RTSL_STATE_COMPONENTS] = {0};
        for (uint32_t i = 0; i < info.read_count; i++)
            state[info.reads[i]] = arrays[info.reads[i]];
        for (uint32_t i = 0; i < info.write_count; i++)
            state[info.writes[i]] = arrays[info.writes[i]];
        float *scratch[] = {side};
        int32_t accepted[LANES];
        RtslArguments arguments = {.size = sizeof arguments,
                                   .count = RAYS,
                                   .lanes = LANES,
                                   .state = state,
                                   .state_count = RTSL_STATE_COMPONENTS,
                                   .scratch = scratch,
                                   .scratch_count = 1,
                                   .accepted = accepted};
        uint32_t scratch_arrays;
        OK(rtsl_kernel_scratch_arrays(kernel, &scratch_arrays));
        CHECK(scratch_arrays == 1);

        CHECK(distance_of_first(kernel, instance, &arguments) == 4.0f);
        CHECK(accepted[0] == -1 && accepted[3] == 0 && accepted[20] == -1);
        CHECK(side[0] == 7.0f && arrays[RTSL_STATE_HitDistance][3] == INFINITY);

        /* A mask leaves rays out. */
        int32_t mask[LANES] = {0, -1, -1, -1};
        arguments.mask = mask;
        CHECK(distance_of_first(kernel, instance, &arguments) == INFINITY);
        CHECK(arrays[RTSL_STATE_HitDistance][1] == 4.0f && accepted[0] == 0 && accepted[1] == -1);
        arguments.mask = NULL;

        /* The same kernel, another radius. */
        float radius = 2.0f;
        OK(rtsl_instance_set_floats(instance, "radius", &radius, 1));
        CHECK(distance_of_first(kernel, instance, &arguments) == 4.0f);
        OK(rtsl_instance_commit(instance));
        CHECK(distance_of_first(kernel, instance, &arguments) == 3.0f);
        int32_t scale = 4;
        OK(rtsl_instance_set_ints(instance, "scale", &scale, 1));
        OK(rtsl_instance_unset(instance, "radius"));
        OK(rtsl_instance_commit(instance));
        CHECK(distance_of_first(kernel, instance, &arguments) == 3.0f);
        OK(rtsl_instance_unset(instance, "scale"));
        OK(rtsl_instance_commit(instance));

        /* The function itself, where there is one. */
        if (info.kernel) {
            CHECK(distance_of_first(kernel, instance, &arguments) == 4.0f);
            arrays[RTSL_STATE_HitDistance][0] = INFINITY;
            RtslCall call = {.state = state, .scratch = scratch, .accepted = accepted, .count = RAYS};
            OK(rtsl_instance_block(instance, kernel, &call.instance));
            ((RtslKernel)info.kernel)(&call);
            CHECK(arrays[RTSL_STATE_HitDistance][0] == 4.0f && call.status == 0);
        }
        OK(rtsl_kernel_release(kernel));
        OK(rtsl_engine_release(engine));
    }
    OK(rtsl_instance_release(instance));
    OK(rtsl_unit_release(unit));
    return 0;
}
