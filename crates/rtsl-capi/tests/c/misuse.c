/* Whatever a host does wrong that can be seen is an error with a message. */
#include <math.h>

#include "check.h"

static const RtslUnitId no_unit;
static const RtslEngineId no_engine;
static const RtslInstanceId no_instance;
static const RtslKernelId no_kernel;
static const RtslObjectsId no_objects;
static const RtslCallbackId no_callback;

static void texts(void)
{
    RtslUnitId unit;
    FAILS(rtsl_compile(NULL, "", &unit), RTSL_RESULT_ARGUMENT, "`name` is null");
    FAILS(rtsl_compile("a", NULL, &unit), RTSL_RESULT_ARGUMENT, "`source` is null");
    FAILS(rtsl_compile("a", "", NULL), RTSL_RESULT_ARGUMENT, "`unit` is null");
    FAILS(rtsl_compile("a", "\xff", &unit), RTSL_RESULT_ARGUMENT, "UTF-8");
    FAILS(rtsl_compile_file("/no/such/file.rtsl", NULL, 0, &unit), RTSL_RESULT_COMPILATION, "E0601");
    FAILS(rtsl_compile_file("x", NULL, 2, &unit), RTSL_RESULT_ARGUMENT, "`search_path` is null");
    FAILS(rtsl_standard_unit("Spere", &unit), RTSL_RESULT_UNKNOWN, "Sphere");

    FAILS(rtsl_compile("bad.rtsl", "class A : rt_Texture;\nvoid lookup() { rt_TextureColor = 1 }", &unit),
          RTSL_RESULT_COMPILATION, "bad.rtsl:2:");
    RtslDiagnostic diagnostic;
    CHECK(rtsl_last_diagnostic_count() >= 1);
    CHECK(rtsl_last_diagnostic(0, &diagnostic) == RTSL_RESULT_OK);
    CHECK(diagnostic.is_error && diagnostic.line == 2 && strcmp(diagnostic.file, "bad.rtsl") == 0);
    CHECK(diagnostic.code[0] == 'E' && diagnostic.message[0] != '\0' && strstr(diagnostic.text, "rt_TextureColor"));
    CHECK(rtsl_last_diagnostic(1000, &diagnostic) == RTSL_RESULT_ARGUMENT);
    CHECK(rtsl_last_diagnostic(0, NULL) == RTSL_RESULT_ARGUMENT);
}

static void ids(RtslUnitId unit, RtslEngineId engine)
{
    RtslInstanceId instance;
    RtslKernelId kernel;
    RtslObjectsId objects;
    const RtslClassInfo *info;
    const void *block;
    uint32_t count;
    FAILS(rtsl_unit_class_count(no_unit, &count), RTSL_RESULT_ID, "unit");
    FAILS(rtsl_unit_class_count(unit, NULL), RTSL_RESULT_ARGUMENT, "null");
    FAILS(rtsl_unit_class(unit, 77, &info), RTSL_RESULT_UNKNOWN, "77");
    FAILS(rtsl_unit_find_class(unit, "Spher", &info), RTSL_RESULT_UNKNOWN, "Sphere");
    FAILS(rtsl_instance_new(no_unit, "Sphere", &instance), RTSL_RESULT_ID, "unit");
    FAILS(rtsl_instance_new(unit, NULL, &instance), RTSL_RESULT_ARGUMENT, "null");
    FAILS(rtsl_instance_new(unit, "Cube", &instance), RTSL_RESULT_UNKNOWN, "Cube");
    FAILS(rtsl_instance_commit(no_instance), RTSL_RESULT_ID, "instance");
    FAILS(rtsl_instance_release(no_instance), RTSL_RESULT_ID, "instance");
    FAILS(rtsl_kernel_new(no_engine, no_instance, "intersect", 0, 0, &kernel), RTSL_RESULT_ID, "engine");
    FAILS(rtsl_kernel_info(no_kernel, (RtslMethod[1]){{0}}), RTSL_RESULT_ID, "kernel");
    FAILS(rtsl_kernel_call(no_kernel, (RtslArguments[1]){{sizeof(RtslArguments)}}), RTSL_RESULT_ID, "kernel");
    FAILS(rtsl_objects_count(no_objects, &count), RTSL_RESULT_ID, "objects");
    FAILS(rtsl_engine_release(no_engine), RTSL_RESULT_ID, "engine");

    /* An id is not good for something else, nor after its release. */
    OK(rtsl_instance_new(unit, "Sphere", &instance));
    FAILS(rtsl_kernel_new(engine, instance, "intersect", 0, 0, &kernel), RTSL_RESULT_INSTANCE, "commit");
    OK(rtsl_instance_release(instance));
    FAILS(rtsl_instance_commit(instance), RTSL_RESULT_ID, "released");
    FAILS(rtsl_instance_release(instance), RTSL_RESULT_ID, "released");
    FAILS(rtsl_instance_block(instance, no_kernel, &block), RTSL_RESULT_ID, "");
    FAILS(rtsl_objects_new(engine, NULL, 1, &objects), RTSL_RESULT_ARGUMENT, "null");
    FAILS(rtsl_objects_new(engine, NULL, 0, &objects), RTSL_RESULT_ARGUMENT, "one instance");
    FAILS(rtsl_objects_new(engine, &instance, 1, &objects), RTSL_RESULT_ID, "released");

    RtslEngineOptions options = {.size = 4};
    FAILS(rtsl_engine_new(&options, &engine), RTSL_RESULT_ARGUMENT, "size");
    options = (RtslEngineOptions){.size = sizeof options, .backend = 9};
    FAILS(rtsl_engine_new(&options, &engine), RTSL_RESULT_ARGUMENT, "backend 9");
    options = (RtslEngineOptions){.size = sizeof options, .width = 3};
    FAILS(rtsl_engine_new(&options, &engine), RTSL_RESULT_ARGUMENT, "E0703");
    FAILS(rtsl_engine_new(NULL, NULL), RTSL_RESULT_ARGUMENT, "null");
}

static void parameters(RtslUnitId unit)
{
    RtslInstanceId sphere;
    float numbers[3] = {-1.0f, 0.0f, 0.0f};
    OK(rtsl_instance_new(unit, "Sphere", &sphere));
    FAILS(rtsl_instance_set_floats(sphere, "radios", numbers, 1), RTSL_RESULT_UNKNOWN, "radius");
    FAILS(rtsl_instance_set_floats(sphere, "radius", NULL, 1), RTSL_RESULT_ARGUMENT, "null");
    FAILS(rtsl_instance_set_floats(sphere, "radius", numbers, SIZE_MAX), RTSL_RESULT_ARGUMENT, "elements");
    FAILS(rtsl_instance_set_instances(sphere, "radius", &sphere, 1), RTSL_RESULT_INSTANCE, "commit");
    OK(rtsl_instance_commit(sphere));
    OK(rtsl_instance_set_floats(sphere, "radius", numbers, 1));
    OK(rtsl_instance_commit(sphere));
    RtslDiagnostic outside;
    OK(rtsl_last_diagnostic(0, &outside));
    CHECK(strcmp(outside.code, "W0502") == 0 && strstr(outside.message, "-1 is not at least 0"));
    numbers[0] = NAN;
    OK(rtsl_instance_set_floats(sphere, "radius", numbers, 1));
    FAILS(rtsl_instance_commit(sphere), RTSL_RESULT_PARAMETER, "E0504");
    OK(rtsl_instance_set_floats(sphere, "radius", numbers, 3));
    FAILS(rtsl_instance_commit(sphere), RTSL_RESULT_PARAMETER, "E0503");
    OK(rtsl_instance_set_instances(sphere, "radius", &sphere, 1));
    FAILS(rtsl_instance_commit(sphere), RTSL_RESULT_PARAMETER, "E0503");
    OK(rtsl_instance_unset(sphere, "radius"));
    FAILS(rtsl_instance_unset(sphere, "radius"), RTSL_RESULT_UNKNOWN, "not set");
    OK(rtsl_instance_commit(sphere));
    OK(rtsl_instance_release(sphere));
}

static void callbacks(RtslUnitId unit, RtslEngineId engine)
{
    RtslInstanceId sphere;
    RtslEngineId interpreter;
    RtslCallbackId callback;
    const void *function;
    const RtslRow rows[] = {{RTSL_STATE_RayOrigin, 0}, {RTSL_STATE_RayOrigin + 1, 1}, {RTSL_STATE_RayOrigin + 2, 2}};
    const uint32_t outputs[] = {RTSL_STATE_RayOrigin + 1};
    const RtslMark marks[] = {{.row = 9, .source = 3}};
    RtslEngineInfo info;
    OK(rtsl_engine_info(engine, &info));
    if (!info.llvm)
        return; /* callbacks are machine code */
    const RtslRecord good = {.size = sizeof good, .width = 4, .mask = RTSL_NONE, .number = RTSL_NONE, .rows = rows, .row_count = 3};
    RtslRecord bad = good;
    OK(rtsl_instance_new(unit, "Sphere", &sphere));
    FAILS(rtsl_callback_new(engine, sphere, &good, &callback), RTSL_RESULT_INSTANCE, "commit");
    OK(rtsl_instance_commit(sphere));
    FAILS(rtsl_callback_new(no_engine, sphere, &good, &callback), RTSL_RESULT_ID, "engine");
    FAILS(rtsl_callback_new(engine, no_instance, &good, &callback), RTSL_RESULT_ID, "instance");
    FAILS(rtsl_callback_new(engine, sphere, NULL, &callback), RTSL_RESULT_ARGUMENT, "`record` is null");
    FAILS(rtsl_callback_new(engine, sphere, &good, NULL), RTSL_RESULT_ARGUMENT, "`callback` is null");
    bad.size = 8;
    FAILS(rtsl_callback_new(engine, sphere, &bad, &callback), RTSL_RESULT_ARGUMENT, "size");
    bad = good;
    bad.width = 3;
    FAILS(rtsl_callback_new(engine, sphere, &bad, &callback), RTSL_RESULT_ARGUMENT, "E0703");
    bad = good;
    bad.rows = NULL;
    FAILS(rtsl_callback_new(engine, sphere, &bad, &callback), RTSL_RESULT_ARGUMENT, "`rows` is null");
    bad = good;
    bad.output_count = 1;
    FAILS(rtsl_callback_new(engine, sphere, &bad, &callback), RTSL_RESULT_ARGUMENT, "`outputs` is null");
    bad.outputs = outputs;
    FAILS(rtsl_callback_new(engine, sphere, &bad, &callback), RTSL_RESULT_ARGUMENT, "component 8");
    bad = good;
    bad.marks = marks;
    bad.mark_count = 1;
    FAILS(rtsl_callback_new(engine, sphere, &bad, &callback), RTSL_RESULT_ARGUMENT, "source 3");
    bad = good;
    bad.outputs = (const uint32_t[]){RTSL_STATE_GeometricNormal};
    bad.output_count = 1;
    FAILS(rtsl_callback_new(engine, sphere, &bad, &callback), RTSL_RESULT_CODE_GENERATION, "rt_GeometricNormal");
    RtslEngineOptions options = {.size = sizeof options, .backend = RTSL_BACKEND_INTERPRETER};
    OK(rtsl_engine_new(&options, &interpreter));
    FAILS(rtsl_callback_new(interpreter, sphere, &good, &callback), RTSL_RESULT_NO_LLVM, "E0701");
    FAILS(rtsl_callback_function(no_callback, &function), RTSL_RESULT_ID, "callback");
    FAILS(rtsl_callback_release(no_callback), RTSL_RESULT_ID, "callback");
    OK(rtsl_callback_new(engine, sphere, &good, &callback));
    FAILS(rtsl_callback_function(callback, NULL), RTSL_RESULT_ARGUMENT, "null");
    OK(rtsl_callback_function(callback, &function));
    CHECK(function != NULL);
    OK(rtsl_callback_release(callback));
    FAILS(rtsl_callback_function(callback, &function), RTSL_RESULT_ID, "released");
    OK(rtsl_engine_release(interpreter));
    OK(rtsl_instance_release(sphere));
}

static void calls(RtslUnitId unit, RtslEngineId engine)
{
    RtslInstanceId sphere, ward;
    RtslKernelId kernel;
    RtslUnitId ward_unit;
    OK(rtsl_instance_new(unit, "Sphere", &sphere));
    OK(rtsl_instance_commit(sphere));
    OK(rtsl_standard_unit("Ward", &ward_unit));
    OK(rtsl_instance_new(ward_unit, "Ward", &ward));
    OK(rtsl_instance_commit(ward));
    FAILS(rtsl_kernel_new(engine, sphere, "intersekt", 0, 0, &kernel), RTSL_RESULT_UNKNOWN, "intersect");
    FAILS(rtsl_kernel_new(engine, sphere, "shade", 0, 0, &kernel), RTSL_RESULT_UNKNOWN, "E0508");
    FAILS(rtsl_kernel_new(engine, sphere, "intersect", 5, 0, &kernel), RTSL_RESULT_ARGUMENT, "shape 5");
    FAILS(rtsl_kernel_new(engine, sphere, "intersect", RTSL_LEAF, 0, &kernel), RTSL_RESULT_ARGUMENT, "objects");
    FAILS(rtsl_kernel_new(engine, sphere, "intersect", RTSL_PACKET, 5, &kernel), RTSL_RESULT_ARGUMENT, "E0703");
    FAILS(rtsl_kernel_new(engine, sphere, "intersect", RTSL_PACKET, 0, NULL), RTSL_RESULT_ARGUMENT, "null");
    OK(rtsl_kernel_new(engine, sphere, "intersect", RTSL_PACKET, 4, &kernel));

    float words[RTSL_STATE_COMPONENTS][8] = {{0}};
    float *state[RTSL_STATE_COMPONENTS];
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
        state[i] = words[i];
    int32_t accepted[8];
    RtslArguments good = {.size = sizeof good,
                          .count = 5,
                          .lanes = 8,
                          .state = state,
                          .state_count = RTSL_STATE_COMPONENTS,
                          .accepted = accepted,
                          .instance = sphere};
    RtslArguments bad = good;
    OK(rtsl_kernel_call(kernel, &bad));
    FAILS(rtsl_kernel_call(kernel, NULL), RTSL_RESULT_ARGUMENT, "null");
    bad.size = 0;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "size");
    bad = good;
    bad.lanes = 7;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_LANES, "8 lanes");
    bad = good;
    bad.count = UINT32_MAX;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_LANES, "2^31");
    bad = good;
    bad.state = NULL;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "`state` is null");
    bad = good;
    bad.state_count = 3;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_LANES, "component");
    bad = good;
    state[RTSL_STATE_RayOrigin + 1] = NULL;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_LANES, "component");
    state[RTSL_STATE_RayOrigin + 1] = words[RTSL_STATE_RayOrigin + 1];
    bad.accepted = NULL;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "hit");
    bad = good;
    bad.instance = no_instance;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ID, "instance");
    bad.instance = ward;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_INSTANCE, "Ward");
    bad.instance = sphere;
    OK(rtsl_kernel_call(kernel, &bad));
    OK(rtsl_kernel_release(kernel));
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ID, "released");

    /* Many objects. */
    RtslObjectsId objects;
    RtslInstanceId both[2] = {sphere, ward};
    FAILS(rtsl_objects_new(engine, both, 2, &objects), RTSL_RESULT_INSTANCE, "several classes");
    FAILS(rtsl_elements_new(engine, sphere, &objects), RTSL_RESULT_UNKNOWN, "E0502");
    both[1] = sphere;
    OK(rtsl_objects_new(engine, both, 2, &objects));
    FAILS(rtsl_kernel_of_objects(objects, "intersect", RTSL_PACKET, 0, &kernel), RTSL_RESULT_ARGUMENT, "stream");
    OK(rtsl_kernel_of_objects(objects, "intersect", RTSL_STREAM, 8, &kernel));
    uint32_t index[5] = {0, 1, 1, 0, 2};
    bad.objects = objects;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "`index` is null");
    bad.index = index;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "out of range");
    index[4] = 1;
    OK(rtsl_kernel_call(kernel, &bad));
    OK(rtsl_kernel_release(kernel));
    OK(rtsl_kernel_of_objects(objects, "intersect", RTSL_LEAF, 8, &kernel));
    bad.count = 2;
    OK(rtsl_kernel_call(kernel, &bad));
    bad.count = 3;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "2 objects");
    bad.objects = no_objects;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ID, "objects");
}

/* The shape single takes one ray: code of it looks at neither the count nor the mask. */
static void single(RtslUnitId unit, RtslEngineId engine)
{
    RtslInstanceId sphere;
    RtslKernelId kernel;
    OK(rtsl_instance_new(unit, "Sphere", &sphere));
    OK(rtsl_instance_commit(sphere));
    OK(rtsl_kernel_new(engine, sphere, "intersect", RTSL_SINGLE, 0, &kernel));
    float words[RTSL_STATE_COMPONENTS] = {0};
    float *state[RTSL_STATE_COMPONENTS] = {0};
    RtslMethod method;
    OK(rtsl_kernel_info(kernel, &method));
    /* Only what the method touches. */
    for (uint32_t i = 0; i < method.read_count; i++)
        state[method.reads[i]] = &words[method.reads[i]];
    for (uint32_t i = 0; i < method.write_count; i++)
        state[method.writes[i]] = &words[method.writes[i]];
    int32_t accepted[1], mask[1] = {-1};
    RtslArguments good = {.size = sizeof good,
                          .count = 1,
                          .lanes = 1,
                          .state = state,
                          .state_count = RTSL_STATE_COMPONENTS,
                          .accepted = accepted,
                          .instance = sphere};
    RtslArguments bad = good;
    OK(rtsl_kernel_call(kernel, &bad));
    bad.count = 0;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "one ray");
    bad.lanes = 0;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "one ray");
    bad = good;
    bad.count = 2;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "one ray");
    bad = good;
    bad.mask = mask;
    FAILS(rtsl_kernel_call(kernel, &bad), RTSL_RESULT_ARGUMENT, "no mask");
    OK(rtsl_instance_release(sphere));
}

/* Objects of one class, but of another form than the kernel is made for. */
static void forms(RtslEngineId engine)
{
    RtslUnitId unit;
    RtslInstanceId mesh;
    RtslObjectsId whole, elements;
    RtslKernelId kernel;
    OK(rtsl_compile("mesh.rtsl",
                    "class Mesh : rt_Primitive; public float at[]; [[element \"at\"]] public int number;\n"
                    "private float depth; constructor() { depth = at[number]; }\n"
                    "void intersect() { hit(depth); }",
                    &unit));
    OK(rtsl_instance_new(unit, "Mesh", &mesh));
    float at[3] = {1.0f, 2.0f, 3.0f};
    OK(rtsl_instance_set_floats(mesh, "at", at, 3));
    OK(rtsl_instance_commit(mesh));
    OK(rtsl_objects_new(engine, &mesh, 1, &whole));
    OK(rtsl_elements_new(engine, mesh, &elements));
    float words[RTSL_STATE_COMPONENTS][4] = {{0}};
    float *state[RTSL_STATE_COMPONENTS];
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
        state[i] = words[i];
    words[RTSL_STATE_HitDistance][0] = 100.0f;
    RtslArguments arguments = {.size = sizeof arguments,
                               .count = 1,
                               .lanes = 4,
                               .state = state,
                               .state_count = RTSL_STATE_COMPONENTS};
    OK(rtsl_kernel_of_objects(elements, "intersect", RTSL_LEAF, 4, &kernel));
    arguments.objects = elements;
    OK(rtsl_kernel_call(kernel, &arguments));
    CHECK(arguments.nearest == 0 && words[RTSL_STATE_HitDistance][0] == 1.0f);
    arguments.objects = whole;
    FAILS(rtsl_kernel_call(kernel, &arguments), RTSL_RESULT_INSTANCE, "kernel's class");
    /* No objects, no hit. */
    arguments.objects = elements;
    arguments.count = 0;
    OK(rtsl_kernel_call(kernel, &arguments));
    CHECK(arguments.nearest == RTSL_NONE);
    OK(rtsl_kernel_release(kernel));
    /* More numbers than lanes are not read. */
    OK(rtsl_kernel_of_objects(elements, "intersect", RTSL_STREAM, 4, &kernel));
    uint32_t index[4] = {0};
    int32_t accepted[4];
    arguments.index = index;
    arguments.accepted = accepted;
    arguments.count = 1u << 30;
    FAILS(rtsl_kernel_call(kernel, &arguments), RTSL_RESULT_LANES, "lanes");
}

/* There is no function by which a host would answer questions about surfaces. */
static void questions(RtslEngineId engine)
{
    RtslUnitId unit;
    RtslInstanceId wax;
    RtslKernelId kernel;
    OK(rtsl_compile("wax.rtsl",
                    "class Wax : rt_Material;\nvoid shade() { rt_SampleColor = "
                    "color(nearestHit(rt_HitPoint, vec3(1.0)).distance); }",
                    &unit));
    OK(rtsl_instance_new(unit, "Wax", &wax));
    OK(rtsl_instance_commit(wax));
    FAILS(rtsl_kernel_new(engine, wax, "shade", 0, 0, &kernel), RTSL_RESULT_CODE_GENERATION, "E0707");
}

int main(void)
{
    RtslUnitId unit;
    RtslEngineId engine;
    OK(rtsl_standard_unit("Sphere", &unit));
    OK(rtsl_engine_new(NULL, &engine));
    texts();
    ids(unit, engine);
    parameters(unit);
    callbacks(unit, engine);
    calls(unit, engine);
    single(unit, engine);
    forms(engine);
    questions(engine);
    RtslEngineOptions options = {.size = sizeof options, .backend = RTSL_BACKEND_INTERPRETER};
    OK(rtsl_engine_new(&options, &engine));
    single(unit, engine);
    forms(engine);
    return 0;
}
