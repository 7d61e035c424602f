/* Calls what a library that was compiled ahead of time has, as words on standard input say, and writes what kernels leave. */
#include <stdio.h>
#include <stdlib.h>

#include "library.h"

enum { LANES = 16 };

static uint32_t word(void)
{
    uint32_t value;
    if (fread(&value, sizeof value, 1, stdin) != 1)
        exit(2);
    return value;
}

static void *words(size_t count)
{
    uint32_t *all = malloc(count * sizeof *all);
    if (count > 0 && fread(all, sizeof *all, count, stdin) != count)
        exit(2);
    return all;
}

static void draw(void *user, uint32_t base, uint32_t active, float *values)
{
    (void)user, (void)base, (void)active;
    for (int lane = 0; lane < RTSL_LANES; lane++)
        values[lane] = 0.25f;
}

static void trace(void *user, uint32_t base, uint32_t active, const RtslRayLanes *rays, float (*radiance)[RTSL_LANES])
{
    (void)user, (void)base, (void)active, (void)rays;
    memset(radiance, 0, sizeof(float[RTSL_COLOR_COMPONENTS][RTSL_LANES]));
}

static uint32_t light_count(void *user)
{
    (void)user;
    return 0;
}

static void ambient(void *user, float *color)
{
    (void)user;
    memset(color, 0, sizeof(float[RTSL_COLOR_COMPONENTS]));
}

static const RtslHostFunctions host = {.trace = trace, .light_count = light_count, .ambient = ambient, .rand = draw};

/* An instance with the parameters that follow. */
static uint32_t *instance(const RtslClass *cls, RtslBuffer *buffers, uint32_t *buffer_count)
{
    uint32_t *block = aligned_alloc(8, (cls->construct_words * 4 + 15) / 8 * 8);
    rtsl_begin_instance(cls, block);
    for (uint32_t count = word(); count > 0; count--) {
        uint32_t offset = word();
        block[offset] = word();
    }
    *buffer_count = word();
    for (uint32_t i = 0; i < *buffer_count; i++) {
        uint32_t offset = word(), elements = word(), size = word();
        buffers[i] = (RtslBuffer){words(size), elements, 0};
        memcpy(block + offset, &buffers[i], sizeof buffers[i]);
    }
    if (rtsl_end_instance(cls, block) != 0)
        exit(3);
    return block;
}

static void call(const RtslMethod *method, RtslCall *call_, float **state, float **scratch, uint32_t scratch_count)
{
    if (method->shape != RTSL_SINGLE) {
        method->kernel(call_);
        return;
    }
    int32_t *accepted = call_->accepted;
    for (int lane = 0; lane < LANES; lane++) {
        if (call_->mask[lane])
            method->kernel(call_);
        else
            call_->accepted[0] = 0;
        for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
            state[i]++;
        for (uint32_t i = 0; i < scratch_count; i++)
            scratch[i]++;
        call_->accepted++;
    }
    call_->accepted = accepted;
}

static void run(const RtslClass *cls, const RtslMethod *method)
{
    RtslBuffer buffers[16];
    uint32_t buffer_count;
    uint32_t *block = instance(cls, buffers, &buffer_count);
    int32_t *mask = words(LANES);
    int32_t accepted[LANES] = {0};
    float *state_words = words(RTSL_STATE_COMPONENTS * LANES);
    float *scratch_words = words(cls->scratch_arrays * LANES);
    float *state[RTSL_STATE_COMPONENTS], *scratch[64];
    for (int i = 0; i < RTSL_STATE_COMPONENTS; i++)
        state[i] = state_words + i * LANES;
    for (uint32_t i = 0; i < cls->scratch_arrays; i++)
        scratch[i] = scratch_words + i * LANES;
    RtslCall arguments = {.state = state,
                          .scratch = scratch,
                          .mask = mask,
                          .accepted = accepted,
                          .instance = block,
                          .host = &host,
                          .count = method->shape == RTSL_SINGLE ? 1 : LANES};
    call(method, &arguments, state, scratch, cls->scratch_arrays);
    fwrite(&arguments.status, 4, 1, stdout);
    fwrite(accepted, 4, LANES, stdout);
    fwrite(state_words, 4, RTSL_STATE_COMPONENTS * LANES, stdout);
    fwrite(scratch_words, 4, cls->scratch_arrays * LANES, stdout);
    for (uint32_t i = 0; i < buffer_count; i++)
        free((void *)buffers[i].words);
    free(block);
    free(mask);
    free(state_words);
    free(scratch_words);
}

int main(void)
{
    if (rtsl_library.abi != RTSL_ABI || rtsl_library.target[0] == '\0' || rtsl_library.version[0] == '\0')
        return 4;
    for (uint32_t count = word(); count > 0; count--) {
        const RtslClass *cls = rtsl_library.classes[word()];
        if (rtsl_find_class(&rtsl_library, cls->name) != cls)
            return 5;
        const RtslMethod *method = &cls->methods[word()];
        if (rtsl_find_method(cls, method->name, method->shape, method->width) != method)
            return 6;
        run(cls, method);
    }
    return 0;
}
