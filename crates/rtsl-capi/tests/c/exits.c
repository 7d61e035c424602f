/* Ends while threads compile, after as many milliseconds as the argument says. */
#define _GNU_SOURCE
#include <pthread.h>
#include <unistd.h>

#include "check.h"

static RtslEngineId engine;

static void *compile(void *argument)
{
    for (int number = 0;; number++) {
        char source[400];
        RtslUnitId unit;
        RtslInstanceId instance;
        RtslKernelId kernel;
        snprintf(source, sizeof source,
                 "class P : rt_Primitive; public float radius = %ld.%d;"
                 "void intersect() { float x = sin(rt_RayOrigin.x) * noise(rt_RayOrigin * %d.%ld);"
                 "  if (hit(radius - x)) hit(x); }",
                 (long)argument, number, number, (long)argument);
        OK(rtsl_compile("p.rtsl", source, &unit));
        OK(rtsl_instance_new(unit, "P", &instance));
        OK(rtsl_instance_commit(instance));
        RtslResult result = rtsl_kernel_new(engine, instance, "intersect", 0, 0, &kernel);
        if (result == RTSL_RESULT_ENDING)
            return NULL;
        CHECK(result == RTSL_RESULT_OK);
    }
}

int main(int count, char **arguments)
{
    pthread_t threads[4];
    CHECK(count == 2);
    OK(rtsl_engine_new(NULL, &engine));
    for (long i = 0; i < 4; i++)
        CHECK(pthread_create(&threads[i], NULL, compile, (void *)i) == 0);
    usleep(1000 * atoi(arguments[1]));
    exit(0);
}
