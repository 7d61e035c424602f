/* A child process goes on as its parent would, or is told that it can't: it never waits for threads that it does not have. */
#define _GNU_SOURCE
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include "check.h"

static const char *const text =
    "class P : rt_Primitive; public float radius = 1.0; void intersect() { hit(radius); }"
    "void computeNormal() { rt_GeometricNormal = rt_HitPoint; } void computeBounds() { rt_BoundMin = vec3(radius); }";

enum { FORKS = 12, LONGEST = 120 };

static RtslEngineId engine;
static RtslUnitId unit;
static RtslInstanceId instance;
static volatile int stop;

/* Ends with 0 or 1, or with 2 if the child was refused; killed if it waits for ever. */
static int child(const char *method)
{
    RtslKernelId kernel;
    alarm(LONGEST);
    RtslResult result = rtsl_kernel_new(engine, instance, method, 0, 0, &kernel);
    if (result == RTSL_RESULT_FORKED) {
        CHECK(strstr(rtsl_last_error(), "forked") != NULL);
        CHECK(rtsl_instance_commit(instance) == RTSL_RESULT_FORKED);
        return 2;
    }
    CHECK(result == RTSL_RESULT_OK);
    OK(rtsl_instance_commit(instance));
    OK(rtsl_kernel_release(kernel));
    return 0;
}

static int run_child(const char *method)
{
    int status;
    fflush(NULL);
    pid_t process = fork();
    CHECK(process >= 0);
    if (process == 0)
        _exit(child(method));
    CHECK(waitpid(process, &status, 0) == process);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 2);
    return WEXITSTATUS(status);
}

static void *compile(void *argument)
{
    for (int number = 0; !stop; number++) {
        char source[200];
        RtslUnitId own;
        RtslInstanceId made;
        RtslKernelId kernel;
        snprintf(source, sizeof source, "class Q : rt_Primitive; void intersect() { hit(%d.0 + sin(rt_RayOrigin.x)); }", number);
        OK(rtsl_compile("q.rtsl", source, &own));
        OK(rtsl_instance_new(own, "Q", &made));
        OK(rtsl_instance_commit(made));
        OK(rtsl_kernel_new(engine, made, "intersect", 0, 0, &kernel));
    }
    return argument;
}

int main(void)
{
    RtslKernelId kernel;
    alarm(5 * LONGEST);
    OK(rtsl_engine_new(NULL, &engine));
    OK(rtsl_compile("p.rtsl", text, &unit));
    OK(rtsl_instance_new(unit, "P", &instance));
    OK(rtsl_instance_commit(instance));
    OK(rtsl_kernel_new(engine, instance, "intersect", 0, 0, &kernel));
    /* Nothing is under way: the child compiles, and so does a child of the parent that compiles again. */
    CHECK(run_child("computeNormal") == 0);
    OK(rtsl_kernel_new(engine, instance, "computeNormal", 0, 0, &kernel));
    CHECK(run_child("computeBounds") == 0);
    /* A thread compiles nearly all the time. */
    pthread_t thread;
    CHECK(pthread_create(&thread, NULL, compile, NULL) == 0);
    int refused = 0;
    for (int i = 0; i < FORKS; i++) {
        usleep(7000 + 1000 * i);
        refused += run_child("computeBounds") == 2;
    }
    stop = 1;
    CHECK(pthread_join(thread, NULL) == 0);
    CHECK(refused > 0);
    CHECK(run_child("computeBounds") == 0);
    return 0;
}
