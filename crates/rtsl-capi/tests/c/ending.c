/* What handlers of exit and destructors may still do: release what there is, and hear that no kernel is made any more. */
#include "check.h"

static const char *const text =
    "class P : rt_Primitive; public float radius = 1.0; void intersect() { hit(radius); }"
    "void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";

static RtslEngineId engine, interpreter;
static RtslUnitId unit;
static RtslInstanceId instance;
static RtslKernelId kernel;
static int handlers;

static void release(void)
{
    OK(rtsl_kernel_release(kernel));
    FAILS(rtsl_kernel_release(kernel), RTSL_RESULT_ID, "");
    CHECK(rtsl_last_error()[0] != '\0' && rtsl_last_diagnostic_count() == 0);
    CHECK(rtsl_last_diagnostic(0, (RtslDiagnostic[1]){{0}}) == RTSL_RESULT_ARGUMENT);
    OK(rtsl_instance_commit(instance));
    CHECK(rtsl_last_error()[0] == '\0');
    CHECK(rtsl_compile("bad", "class", &unit) == RTSL_RESULT_COMPILATION);
    /* The interpreter needs nothing that is gone. */
    OK(rtsl_kernel_new(interpreter, instance, "computeNormal", 0, 0, &kernel));
}

/* Registered first, so called when all that was registered later has run: LLVM is gone. */
static void last_handler(void)
{
    release();
    RtslEngineInfo info;
    OK(rtsl_engine_info(engine, &info));
    if (info.llvm)
        CHECK(rtsl_kernel_new(engine, instance, "computeNormal", RTSL_PACKET, 4, &kernel) == RTSL_RESULT_ENDING);
    OK(rtsl_engine_release(engine));
    handlers++;
}

/* Registered last, so called first: all is there. */
static void first_handler(void)
{
    release();
    OK(rtsl_kernel_new(engine, instance, "computeNormal", RTSL_PACKET, 8, &kernel));
    handlers++;
}

__attribute__((destructor)) static void destructor(void)
{
    CHECK(handlers == 2);
    OK(rtsl_engine_release(interpreter));
    OK(rtsl_instance_release(instance));
    puts("ended");
    fflush(stdout);
}

int main(void)
{
    atexit(last_handler);
    RtslEngineOptions options = {.size = sizeof options, .backend = RTSL_BACKEND_INTERPRETER};
    OK(rtsl_engine_new(&options, &interpreter));
    OK(rtsl_engine_new(NULL, &engine));
    OK(rtsl_compile("p.rtsl", text, &unit));
    OK(rtsl_instance_new(unit, "P", &instance));
    OK(rtsl_instance_commit(instance));
    OK(rtsl_kernel_new(engine, instance, "intersect", 0, 0, &kernel));
    FAILS(rtsl_compile("bad", "class", &unit), RTSL_RESULT_COMPILATION, "class");
    atexit(first_handler);
    return 0;
}
