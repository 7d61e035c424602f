/* RTSL makes functions for packets as Embree keeps them: they find rays, masks and instances in what Embree hands to its callbacks. What is
   left to do here is to choose the one for the number of rays. */
#include "rtsl_geometry.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTHS = 4, HIT_ROWS = EMBREE_INSTANCE + 1, CACHE_LINE = 64 };

static const uint32_t WIDTH[WIDTHS] = { 1, 4, 8, 16 };

/* What callbacks need beside the instances' blocks. It lies right before them, and Embree's user data is their address, so that
   the functions find the blocks with one load. */
typedef struct Head {
    EmbreeHitFunction intersect[WIDTHS];
    EmbreeHitFunction occlude[WIDTHS];
    RtslKernel bounds;
    size_t block_bytes;
} Head;

struct RtslGeometry {
    uint32_t count;
    RtslCallbackId intersect[WIDTHS];
    RtslCallbackId occlude[WIDTHS];
    RtslKernelId bounds;
    size_t block_bytes;
    char *blocks; /* the data of one instance after the other, behind a Head */
};

static const RtslRow ROWS[] = {
    { RTSL_STATE_RayOrigin, EMBREE_ORIGIN },
    { RTSL_STATE_RayOrigin + 1, EMBREE_ORIGIN + 1 },
    { RTSL_STATE_RayOrigin + 2, EMBREE_ORIGIN + 2 },
    { RTSL_STATE_RayDirection, EMBREE_DIRECTION },
    { RTSL_STATE_RayDirection + 1, EMBREE_DIRECTION + 1 },
    { RTSL_STATE_RayDirection + 2, EMBREE_DIRECTION + 2 },
    { RTSL_STATE_Epsilon, EMBREE_NEAR },
    { RTSL_STATE_HitDistance, EMBREE_FAR },
    { RTSL_STATE_TimeSeed, EMBREE_TIME },
    { RTSL_STATE_GeometricNormal, EMBREE_NORMAL },
    { RTSL_STATE_GeometricNormal + 1, EMBREE_NORMAL + 1 },
    { RTSL_STATE_GeometricNormal + 2, EMBREE_NORMAL + 2 },
};

#define COUNT(array) (sizeof(array) / sizeof(array)[0])
#define ARGUMENT(field) offsetof(EmbreeHitArguments, field)

/* Whether a call went well; if not it is told. */
static bool is_well(RtslResult result)
{
    if (result != RTSL_RESULT_OK)
        fprintf(stderr, "%s\n", rtsl_last_error());
    return result == RTSL_RESULT_OK;
}

static RtslRecord record_of_packets(uint32_t width)
{
    return (RtslRecord){ .size = sizeof(RtslRecord),
                         .width = width,
                         .rays = ARGUMENT(rays),
                         /* Embree asks of a single ray only if it is valid. */
                         .mask = width > 1 ? ARGUMENT(valid) : RTSL_NONE,
                         .instances = ARGUMENT(user),
                         .number = ARGUMENT(primitive),
                         .rows = ROWS,
                         .row_count = COUNT(ROWS) };
}

/* For the nearest hits. */
static bool make_intersect(RtslGeometry *geometry, const Embree *embree, RtslEngineId engine, RtslInstanceId instance)
{
    static const uint32_t outputs[] = { RTSL_STATE_HitDistance, RTSL_STATE_GeometricNormal };
    const RtslMark marks[] = {
        { .row = EMBREE_PRIMITIVE, .source = RTSL_MARK_SOURCE_ARGUMENT, .value = ARGUMENT(primitive) },
        { .row = EMBREE_GEOMETRY, .source = RTSL_MARK_SOURCE_ARGUMENT, .value = ARGUMENT(geometry) },
        { .row = EMBREE_INSTANCE,
          .source = RTSL_MARK_SOURCE_BEHIND,
          .value = ARGUMENT(context),
          .offset = embree_instance_offset(embree->version) },
    };
    for (int i = 0; i < WIDTHS; i++) {
        RtslRecord record = record_of_packets(WIDTH[i]);
        record.outputs = outputs;
        record.output_count = COUNT(outputs);
        record.marks = marks;
        record.mark_count = COUNT(marks);
        if (!is_well(rtsl_callback_new(engine, instance, &record, &geometry->intersect[i])))
            return false;
    }
    return true;
}

/* For whether there are any: the rays end. */
static bool make_occlude(RtslGeometry *geometry, RtslEngineId engine, RtslInstanceId instance)
{
    const float ended = -INFINITY;
    RtslMark mark = { .row = EMBREE_FAR, .source = RTSL_MARK_SOURCE_CONSTANT };
    memcpy(&mark.value, &ended, sizeof ended);
    for (int i = 0; i < WIDTHS; i++) {
        RtslRecord record = record_of_packets(WIDTH[i]);
        record.marks = &mark;
        record.mark_count = 1;
        if (!is_well(rtsl_callback_new(engine, instance, &record, &geometry->occlude[i])))
            return false;
    }
    return true;
}

static Head *head_of(const void *blocks) { return (Head *)blocks - 1; }

static bool copy_blocks(RtslGeometry *geometry, const RtslInstanceId *instances)
{
    const size_t head_bytes = (sizeof(Head) + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE;
    uint32_t words;
    if (!is_well(rtsl_kernel_block_words(geometry->bounds, &words)))
        return false;
    geometry->block_bytes = words * sizeof(uint32_t);
    size_t bytes = head_bytes + geometry->count * geometry->block_bytes;
    char *memory = aligned_alloc(CACHE_LINE, (bytes + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE);
    geometry->blocks = memory + head_bytes;
    for (uint32_t i = 0; i < geometry->count; i++) {
        const void *block;
        if (!is_well(rtsl_instance_block(instances[i], geometry->bounds, &block)))
            return false;
        memcpy(geometry->blocks + i * geometry->block_bytes, block, geometry->block_bytes);
    }
    return true;
}

static bool fill_head(const RtslGeometry *geometry)
{
    Head *head = head_of(geometry->blocks);
    RtslMethod bounds;
    for (int i = 0; i < WIDTHS; i++)
        if (!is_well(rtsl_callback_function(geometry->intersect[i], (const void **)&head->intersect[i]))
            || !is_well(rtsl_callback_function(geometry->occlude[i], (const void **)&head->occlude[i])))
            return false;
    head->block_bytes = geometry->block_bytes;
    if (!is_well(rtsl_kernel_info(geometry->bounds, &bounds)))
        return false;
    head->bounds = bounds.kernel;
    return true;
}

RtslGeometry *rtsl_geometry_new(const Embree *embree, RtslEngineId engine, const RtslInstanceId *instances, uint32_t count)
{
    RtslGeometry *geometry = calloc(1, sizeof *geometry);
    geometry->count = count;
    if (make_intersect(geometry, embree, engine, instances[0]) && make_occlude(geometry, engine, instances[0])
        && is_well(rtsl_kernel_new(engine, instances[0], "computeBounds", RTSL_PACKET, 1, &geometry->bounds))
        && copy_blocks(geometry, instances) && fill_head(geometry))
        return geometry;
    rtsl_geometry_free(geometry);
    return NULL;
}

void rtsl_geometry_free(RtslGeometry *geometry)
{
    const size_t head_bytes = (sizeof(Head) + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE;
    for (int i = 0; i < WIDTHS; i++) {
        rtsl_callback_release(geometry->intersect[i]);
        rtsl_callback_release(geometry->occlude[i]);
    }
    rtsl_kernel_release(geometry->bounds);
    if (geometry->blocks)
        free(geometry->blocks - head_bytes);
    free(geometry);
}

static void bounds(const EmbreeBoundsArguments *arguments)
{
    static const float defaults[RTSL_STATE_COMPONENTS] = { RTSL_STATE_DEFAULTS };
    const Head *head = head_of(arguments->user);
    float components[RTSL_STATE_COMPONENTS], *state[RTSL_STATE_COMPONENTS];
    memcpy(components, defaults, sizeof components);
    for (int component = 0; component < RTSL_STATE_COMPONENTS; component++)
        state[component] = &components[component];
    const void *block = (const char *)arguments->user + arguments->primitive * head->block_bytes;
    RtslCall call = { .state = state, .instance = block, .count = 1 };
    head->bounds(&call);
    memcpy(arguments->bounds->lower, &components[RTSL_STATE_BoundMin], 3 * sizeof(float));
    memcpy(arguments->bounds->upper, &components[RTSL_STATE_BoundMax], 3 * sizeof(float));
}

/* Packets of other sizes: one ray after the other, copied to where it is a packet of one. Not inlined, since its callers would
   then save registers for it in each call. */
static __attribute__((noinline, cold)) void in_turn(const EmbreeHitArguments *arguments, EmbreeHitFunction function, uint32_t rows)
{
    for (uint32_t ray = 0; ray < arguments->count; ray++) {
        if (!arguments->valid[ray])
            continue;
        float one[HIT_ROWS];
        EmbreeHitArguments single = *arguments;
        single.valid += ray;
        single.rays = one;
        single.count = 1;
        for (uint32_t row = 0; row < rows; row++)
            one[row] = arguments->rays[row * arguments->count + ray];
        function(&single);
        for (uint32_t row = 0; row < rows; row++)
            arguments->rays[row * arguments->count + ray] = one[row];
    }
}

static void intersect(const EmbreeHitArguments *arguments)
{
    const Head *head = head_of(arguments->user);
    switch (arguments->count) {
    case 1: head->intersect[0](arguments); break;
    case 4: head->intersect[1](arguments); break;
    case 8: head->intersect[2](arguments); break;
    case 16: head->intersect[3](arguments); break;
    default: in_turn(arguments, head->intersect[0], HIT_ROWS);
    }
}

static void occlude(const EmbreeHitArguments *arguments)
{
    const Head *head = head_of(arguments->user);
    switch (arguments->count) {
    case 1: head->occlude[0](arguments); break;
    case 4: head->occlude[1](arguments); break;
    case 8: head->occlude[2](arguments); break;
    case 16: head->occlude[3](arguments); break;
    default: in_turn(arguments, head->occlude[0], EMBREE_RAY_ROWS);
    }
}

EmbreeGeometry rtsl_geometry_attach(RtslGeometry *geometry, const Embree *embree, EmbreeDevice device)
{
    return embree_user_geometry(embree, device, geometry->count, geometry->blocks, bounds, intersect, occlude);
}
