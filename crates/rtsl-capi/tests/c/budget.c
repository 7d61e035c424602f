/* Texts of strangers: a budget ends their constructors, also those of elements. */
#include "check.h"

static const char *const endless =
    "class Endless : rt_Texture; private float x; constructor() { while (true) x += 1.0; }"
    "void lookup() { rt_FloatTextureValue = x; }";

static const char *const elements =
    "class Mesh : rt_Primitive; public float at[]; [[element \"at\"]] public int number; private float depth;"
    "constructor() { while (number > 0 && depth < 1.0) depth *= at[number]; } void intersect() { hit(depth); }";

int main(void)
{
    RtslUnitId unit;
    RtslInstanceId instance;
    RtslEngineId engine;
    RtslObjectsId objects;
    RtslCompilerOptions options = {.size = sizeof options, .loop_budget = 1000};
    OK(rtsl_compile_with("endless.rtsl", endless, &options, &unit));
    OK(rtsl_instance_new(unit, "Endless", &instance));
    FAILS(rtsl_instance_commit(instance), RTSL_RESULT_BUDGET, "E0619");
    FAILS(rtsl_instance_commit(instance), RTSL_RESULT_BUDGET, "budget");

    OK(rtsl_compile_with("mesh.rtsl", elements, &options, &unit));
    OK(rtsl_instance_new(unit, "Mesh", &instance));
    float at[3] = {0};
    OK(rtsl_instance_set_floats(instance, "at", at, 3));
    OK(rtsl_instance_commit(instance));
    OK(rtsl_engine_new(NULL, &engine));
    FAILS(rtsl_elements_new(engine, instance, &objects), RTSL_RESULT_BUDGET, "E0619");

    /* The defaults, and what is wrong with options. */
    OK(rtsl_compile_with("texture.rtsl", "class T : rt_Texture; void lookup() { rt_TextureColor = color(1.0); }", NULL, &unit));
    options.search_path_count = 1;
    FAILS(rtsl_compile_with("a", "", &options, &unit), RTSL_RESULT_ARGUMENT, "`search_path` is null");
    FAILS(rtsl_compile_file_with("/no/such/file.rtsl", NULL, &unit), RTSL_RESULT_COMPILATION, "E0601");
    options = (RtslCompilerOptions){.size = 8};
    FAILS(rtsl_compile_with("a", "", &options, &unit), RTSL_RESULT_ARGUMENT, "size");
    FAILS(rtsl_compile_file_with("a", &options, &unit), RTSL_RESULT_ARGUMENT, "size");
    return 0;
}
