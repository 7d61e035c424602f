/* A shape passes an attribute to a texture, and a choice is set by its name. */
#include "check.h"

static const char *const classes =
    "class Ball : rt_Primitive {\n"
    "    public float dust = 0.5;\n"
    "    attribute vec2 st;\n"
    "    void intersect() { hit(-rt_RayOrigin.z); }\n"
    "    void computeNormal() { rt_GeometricNormal = rt_HitPoint; }\n"
    "    void computeTextureCoordinates() { st = 2.0 * rt_HitPoint.xy; }\n"
    "};\n"
    "class Dusty : rt_Texture {\n"
    "    enum Kind { Fine = 1, Coarse = 4 };\n"
    "    public Kind kind = Fine;\n"
    "    attribute float dust = 0.125;\n"
    "    attribute vec2 st;\n"
    "    void lookup() { rt_FloatTextureValue = float(kind) * (dust + st.y); }\n"
    "};\n";

enum { LANES = 16 };

static float arrays[RTSL_STATE_COMPONENTS][LANES];

static void call(RtslEngineId engine, RtslInstanceId instance, const char *method)
{
    RtslKernelId kernel;
    OK(rtsl_kernel_new(engine, instance, method, RTSL_PACKET, 0, &kernel));
    float *state[RTSL_STATE_COMPONENTS];
    for (int component = 0; component < RTSL_STATE_COMPONENTS; component++)
        state[component] = arrays[component];
    int32_t accepted[LANES];
    RtslArguments arguments = {.size = sizeof arguments,
                               .count = 1,
                               .lanes = LANES,
                               .state = state,
                               .state_count = RTSL_STATE_COMPONENTS,
                               .accepted = accepted,
                               .instance = instance};
    OK(rtsl_kernel_call(kernel, &arguments));
    OK(rtsl_kernel_release(kernel));
}

/* The texture's value at the point (0, 3, 0) of the ball. */
static float value(RtslEngineId engine, RtslInstanceId ball, RtslInstanceId texture)
{
    memset(arrays, 0, sizeof arrays);
    arrays[RTSL_STATE_HitPoint + 1][0] = 3.0f;
    call(engine, ball, "computeTextureCoordinates");
    call(engine, texture, "lookup");
    return arrays[RTSL_STATE_FloatTextureValue][0];
}

int main(void)
{
    RtslUnitId unit;
    OK(rtsl_compile("dust.rtsl", classes, &unit));
    RtslInstanceId ball, texture;
    OK(rtsl_instance_new(unit, "Ball", &ball));
    OK(rtsl_instance_new(unit, "Dusty", &texture));
    FAILS(rtsl_instances_share_attributes(&texture, 1, &ball, 1), RTSL_RESULT_INSTANCE, "commit");
    OK(rtsl_instance_commit(ball));
    OK(rtsl_instance_commit(texture));
    RtslEngineOptions options = {.size = sizeof options};
    for (uint32_t backend = 0; backend < 3; backend += 2) {
        RtslEngineId engine;
        options.backend = backend;
        OK(rtsl_engine_new(&options, &engine));
        OK(rtsl_instance_commit(texture));
        CHECK(value(engine, ball, texture) == 0.125f);
        OK(rtsl_instances_share_attributes(&texture, 1, &ball, 1));
        CHECK(value(engine, ball, texture) == 6.5f);

        const char *const coarse = "Coarse";
        OK(rtsl_instance_set_choices(texture, "kind", &coarse, 1));
        OK(rtsl_instance_commit(texture));
        CHECK(value(engine, ball, texture) == 0.5f);
        OK(rtsl_instances_share_attributes(&texture, 1, &ball, 1));
        CHECK(value(engine, ball, texture) == 26.0f);

        const char *const other = "Corse";
        OK(rtsl_instance_set_choices(texture, "kind", &other, 1));
        FAILS(rtsl_instance_commit(texture), RTSL_RESULT_PARAMETER, "Coarse");
        OK(rtsl_instance_unset(texture, "kind"));
        FAILS(rtsl_instance_set_choices(texture, "sort", &coarse, 1), RTSL_RESULT_UNKNOWN, "kind");
        OK(rtsl_engine_release(engine));
    }
    /* No shape, no attribute. */
    OK(rtsl_instance_commit(texture));
    OK(rtsl_instances_share_attributes(&texture, 1, NULL, 0));
    FAILS(rtsl_instances_share_attributes(NULL, 1, &ball, 1), RTSL_RESULT_ARGUMENT, "readers");
    OK(rtsl_instance_release(ball));
    OK(rtsl_instance_release(texture));
    OK(rtsl_unit_release(unit));
    return 0;
}
