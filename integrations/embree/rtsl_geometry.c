#include "rtsl_geometry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTHS = 4, MAX_SCRATCH_ARRAYS = 64, BLOCK_ALIGNMENT = 8 };

/* A state component that Embree knows nothing of. */
typedef struct Other {
    uint32_t component;
    bool is_output;
} Other;

/* A method in the widths of Embree's packets. */
typedef struct Method {
    RtslKernel kernels[WIDTHS];
    RtslKernelId ids[WIDTHS];
    Other others[RTSL_STATE_COMPONENTS];
    uint32_t other_count;
} Method;

struct RtslGeometry {
    uint64_t number; /* never given twice */
    int embree_version;
    uint32_t count;
    char *blocks; /* the data of one instance after the other */
    size_t block_bytes;
    Method intersect;
    Method normal;
    RtslKernel bounds;
    RtslKernelId bounds_id;
    uint32_t scratch_arrays;
    bool reads_inverse_direction;
};

static const uint32_t WIDTH[WIDTHS] = { 1, 4, 8, 16 };
/* What methods find in components that nobody sets. */
static float defaults[RTSL_STATE_COMPONENTS][EMBREE_MAX_RAYS];

static void fill_defaults(void)
{
    static const float values[RTSL_STATE_COMPONENTS] = { RTSL_STATE_DEFAULTS };
    for (int component = 0; component < RTSL_STATE_COMPONENTS; component++)
        for (int lane = 0; lane < EMBREE_MAX_RAYS; lane++)
            defaults[component][lane] = values[component];
}

static bool is_within(uint32_t component, uint32_t first, uint32_t count)
{
    return component >= first && component < first + count;
}

/* Whether callbacks set the component themselves. */
static bool is_bound(uint32_t component)
{
    return is_within(component, RTSL_STATE_RayOrigin, 3) || is_within(component, RTSL_STATE_RayDirection, 3)
        || is_within(component, RTSL_STATE_InverseRayDirection, 3) || component == RTSL_STATE_Epsilon
        || component == RTSL_STATE_HitDistance || component == RTSL_STATE_TimeSeed
        || is_within(component, RTSL_STATE_HitPoint, 3) || is_within(component, RTSL_STATE_GeometricNormal, 3);
}

static void add_others(Method *method, const uint32_t *components, uint32_t count, bool is_output)
{
    for (uint32_t i = 0; i < count; i++)
        if (!is_bound(components[i]))
            method->others[method->other_count++] = (Other){ components[i], is_output };
}

static bool reads(const RtslMethod *info, uint32_t first, uint32_t count)
{
    for (uint32_t i = 0; i < info->read_count; i++)
        if (is_within(info->reads[i], first, count))
            return true;
    return false;
}

/* Whether a call went well; if not it is told. */
static bool is_well(RtslResult result)
{
    if (result != RTSL_RESULT_OK)
        fprintf(stderr, "%s\n", rtsl_last_error());
    return result == RTSL_RESULT_OK;
}

static bool make_kernel(RtslEngineId engine, RtslInstanceId instance, const char *name, uint32_t width, RtslKernelId *id,
                        RtslMethod *info)
{
    return is_well(rtsl_kernel_new(engine, instance, name, RTSL_PACKET, width, id)) && is_well(rtsl_kernel_info(*id, info));
}

static bool make_method(RtslGeometry *geometry, Method *method, RtslEngineId engine, RtslInstanceId instance,
                        const char *name)
{
    RtslMethod info = { 0 };
    for (int i = 0; i < WIDTHS; i++) {
        if (!make_kernel(engine, instance, name, WIDTH[i], &method->ids[i], &info))
            return false;
        method->kernels[i] = info.kernel;
    }
    add_others(method, info.reads, info.read_count, false);
    add_others(method, info.writes, info.write_count, true);
    geometry->reads_inverse_direction |= reads(&info, RTSL_STATE_InverseRayDirection, 3);
    return true;
}

static bool make_kernels(RtslGeometry *geometry, RtslEngineId engine, RtslInstanceId instance)
{
    RtslMethod info = { 0 };
    if (!make_method(geometry, &geometry->intersect, engine, instance, "intersect")
        || !make_method(geometry, &geometry->normal, engine, instance, "computeNormal")
        || !make_kernel(engine, instance, "computeBounds", 1, &geometry->bounds_id, &info))
        return false;
    geometry->bounds = info.kernel;
    return true;
}

static bool copy_blocks(RtslGeometry *geometry, const RtslInstanceId *instances)
{
    RtslKernelId kernel = geometry->intersect.ids[0];
    uint32_t words;
    if (!is_well(rtsl_kernel_block_words(kernel, &words)))
        return false;
    geometry->block_bytes = (words * sizeof(uint32_t) + BLOCK_ALIGNMENT - 1) / BLOCK_ALIGNMENT * BLOCK_ALIGNMENT;
    geometry->blocks = calloc(geometry->count, geometry->block_bytes + 1);
    for (uint32_t i = 0; i < geometry->count; i++) {
        const void *block;
        if (!is_well(rtsl_instance_block(instances[i], kernel, &block)))
            return false;
        memcpy(geometry->blocks + i * geometry->block_bytes, block, words * sizeof(uint32_t));
    }
    return true;
}

static bool has_few_scratch_arrays(RtslGeometry *geometry)
{
    if (!is_well(rtsl_kernel_scratch_arrays(geometry->intersect.ids[0], &geometry->scratch_arrays)))
        return false;
    if (geometry->scratch_arrays <= MAX_SCRATCH_ARRAYS)
        return true;
    fprintf(stderr, "error: the class has %u scratch scalars; under Embree there may be %d\n", geometry->scratch_arrays,
            MAX_SCRATCH_ARRAYS);
    return false;
}

RtslGeometry *rtsl_geometry_new(RtslEngineId engine, const RtslInstanceId *instances, uint32_t count)
{
    static uint64_t numbers;
    RtslGeometry *geometry = calloc(1, sizeof *geometry);
    geometry->number = ++numbers;
    geometry->count = count;
    fill_defaults();
    if (make_kernels(geometry, engine, instances[0]) && has_few_scratch_arrays(geometry)
        && copy_blocks(geometry, instances))
        return geometry;
    rtsl_geometry_free(geometry);
    return NULL;
}

void rtsl_geometry_free(RtslGeometry *geometry)
{
    for (int i = 0; i < WIDTHS; i++) {
        rtsl_kernel_release(geometry->intersect.ids[i]);
        rtsl_kernel_release(geometry->normal.ids[i]);
    }
    rtsl_kernel_release(geometry->bounds_id);
    free(geometry->blocks);
    free(geometry);
}

static const void *block_of(const RtslGeometry *geometry, uint32_t primitive)
{
    return geometry->blocks + primitive * geometry->block_bytes;
}

static void bind_others(const Method *method, float **state, float *ignored)
{
    for (uint32_t i = 0; i < method->other_count; i++) {
        Other other = method->others[i];
        state[other.component] = other.is_output ? ignored : defaults[other.component];
    }
}

static void bounds(const EmbreeBoundsArguments *arguments)
{
    const RtslGeometry *geometry = arguments->user;
    float box[6];
    float *state[RTSL_STATE_COMPONENTS];
    for (int component = 0; component < RTSL_STATE_COMPONENTS; component++)
        state[component] = defaults[component];
    for (int axis = 0; axis < 3; axis++) {
        state[RTSL_STATE_BoundMin + axis] = &box[axis];
        state[RTSL_STATE_BoundMax + axis] = &box[3 + axis];
    }
    RtslCall call = { .state = state, .instance = block_of(geometry, arguments->primitive), .count = 1 };
    geometry->bounds(&call);
    for (int axis = 0; axis < 3; axis++) {
        arguments->bounds->lower[axis] = box[axis];
        arguments->bounds->upper[axis] = box[3 + axis];
    }
}

/* Some rays of a packet: `count` from `rays` on, whose rows are `stride` words long. */
typedef struct Packet {
    float *rays;
    const int32_t *valid;
    uint32_t stride;
    uint32_t count;
    int width; /* which of WIDTH */
} Packet;

/* The calls of a thread's packets of one width. Embree asks of the same rays again and again, and callers use the same memory for
   the next ones, so what follows from where the rays lie stays as it is until they lie elsewhere. What every call writes lies on the
   stack instead: in memory of the thread it took a tenth longer. */
typedef struct Frame {
    const float *rays;
    uint64_t geometry;
    uint32_t stride;
    RtslCall intersect;
    RtslCall normal;
    float *state[RTSL_STATE_COMPONENTS];
    float *scratch[MAX_SCRATCH_ARRAYS];
    float inverse_direction[3][EMBREE_MAX_RAYS];
    float ignored[EMBREE_MAX_RAYS];
    float scratch_words[MAX_SCRATCH_ARRAYS][EMBREE_MAX_RAYS];
} Frame;

static _Thread_local Frame intersect_frames[WIDTHS];
static _Thread_local Frame occlude_frames[WIDTHS];

#define INLINE static inline __attribute__((always_inline))

static float *row(Packet packet, uint32_t number) { return packet.rays + number * packet.stride; }

static __attribute__((noinline, cold)) void bind_frame(Frame *frame, const RtslGeometry *geometry, Packet packet)
{
    float **state = frame->state;
    bind_others(&geometry->intersect, state, frame->ignored);
    bind_others(&geometry->normal, state, frame->ignored);
    for (uint32_t axis = 0; axis < 3; axis++) {
        state[RTSL_STATE_RayOrigin + axis] = row(packet, EMBREE_ORIGIN + axis);
        state[RTSL_STATE_RayDirection + axis] = row(packet, EMBREE_DIRECTION + axis);
        state[RTSL_STATE_InverseRayDirection + axis] = frame->inverse_direction[axis];
        state[RTSL_STATE_GeometricNormal + axis] = row(packet, EMBREE_NORMAL + axis);
    }
    state[RTSL_STATE_Epsilon] = row(packet, EMBREE_NEAR);
    state[RTSL_STATE_HitDistance] = row(packet, EMBREE_FAR);
    state[RTSL_STATE_TimeSeed] = row(packet, EMBREE_TIME);
    for (uint32_t i = 0; i < geometry->scratch_arrays; i++)
        frame->scratch[i] = frame->scratch_words[i];
    frame->intersect = (RtslCall){ .state = state, .scratch = frame->scratch, .count = packet.count };
    frame->normal = (RtslCall){ .state = state, .scratch = frame->scratch, .count = packet.count };
    frame->rays = packet.rays;
    frame->stride = packet.stride;
    frame->geometry = geometry->number;
}

/* The mask for a kernel: none where all rays are valid. */
INLINE const int32_t *mask_of(Packet packet)
{
    if (packet.count == 1)
        return NULL;
    int32_t all = -1;
    for (uint32_t i = 0; i < packet.count; i++)
        all &= packet.valid[i];
    return all ? NULL : packet.valid;
}

/* Calls intersect: whether any ray hit before its limit. */
INLINE bool call_intersect(Frame *frame, const RtslGeometry *geometry, uint32_t primitive, Packet packet,
                           int32_t *accepted)
{
    if (frame->rays != packet.rays || frame->geometry != geometry->number || frame->stride != packet.stride)
        bind_frame(frame, geometry, packet);
    if (geometry->reads_inverse_direction)
        for (uint32_t axis = 0; axis < 3; axis++)
            for (uint32_t i = 0; i < packet.count; i++)
                frame->inverse_direction[axis][i] = 1.0f / row(packet, EMBREE_DIRECTION + axis)[i];
    frame->intersect.accepted = accepted;
    frame->intersect.mask = mask_of(packet);
    frame->intersect.instance = block_of(geometry, primitive);
    geometry->intersect.kernels[packet.width](&frame->intersect);
    int32_t any = 0;
    for (uint32_t i = 0; i < packet.count; i++)
        any |= accepted[i];
    return any != 0;
}

INLINE void call_normal(Frame *frame, const RtslGeometry *geometry, Packet packet, const int32_t *accepted)
{
    _Alignas(64) float point[3][EMBREE_MAX_RAYS];
    const float *distance = row(packet, EMBREE_FAR);
    for (uint32_t axis = 0; axis < 3; axis++) {
        const float *origin = row(packet, EMBREE_ORIGIN + axis);
        const float *direction = row(packet, EMBREE_DIRECTION + axis);
        for (uint32_t i = 0; i < packet.count; i++)
            point[axis][i] = origin[i] + distance[i] * direction[i];
    }
    for (uint32_t axis = 0; axis < 3; axis++)
        frame->state[RTSL_STATE_HitPoint + axis] = point[axis];
    frame->normal.mask = accepted;
    frame->normal.instance = frame->intersect.instance;
    geometry->normal.kernels[packet.width](&frame->normal);
}

INLINE void set_where(Packet packet, uint32_t number, const int32_t *restrict accepted, uint32_t value)
{
    uint32_t *restrict words = (uint32_t *)row(packet, number);
    for (uint32_t i = 0; i < packet.count; i++)
        words[i] = accepted[i] ? value : words[i];
}

INLINE void intersect_rays(const EmbreeHitArguments *arguments, Packet packet)
{
    const RtslGeometry *geometry = arguments->user;
    Frame *frame = &intersect_frames[packet.width];
    _Alignas(64) int32_t accepted[EMBREE_MAX_RAYS];
    if (!call_intersect(frame, geometry, arguments->primitive, packet, accepted))
        return;
    set_where(packet, EMBREE_PRIMITIVE, accepted, arguments->primitive);
    set_where(packet, EMBREE_GEOMETRY, accepted, arguments->geometry);
    set_where(packet, EMBREE_INSTANCE, accepted, embree_instance(geometry->embree_version, arguments->context));
    call_normal(frame, geometry, packet, accepted);
}

/* Hits shorten the rays first, and end them then. */
INLINE void occlude_rays(const EmbreeHitArguments *arguments, Packet packet)
{
    const RtslGeometry *geometry = arguments->user;
    Frame *frame = &occlude_frames[packet.width];
    _Alignas(64) int32_t accepted[EMBREE_MAX_RAYS];
    if (!call_intersect(frame, geometry, arguments->primitive, packet, accepted))
        return;
    float *far = row(packet, EMBREE_FAR);
    for (uint32_t i = 0; i < packet.count; i++)
        far[i] = accepted[i] ? -INFINITY : far[i];
}

/* Callbacks for packets of known size, so that the compiler makes vector code of their loops and none saves registers that only
   others need. */
#define NEVER_INLINE static __attribute__((noinline)) void
#define CALLBACK(name, function)                                                                                     \
    NEVER_INLINE name##_16(const EmbreeHitArguments *it) { function(it, (Packet){ it->rays, it->valid, 16, 16, 3 }); }\
    NEVER_INLINE name##_8(const EmbreeHitArguments *it) { function(it, (Packet){ it->rays, it->valid, 8, 8, 2 }); }  \
    NEVER_INLINE name##_4(const EmbreeHitArguments *it) { function(it, (Packet){ it->rays, it->valid, 4, 4, 1 }); }  \
    NEVER_INLINE name##_1(const EmbreeHitArguments *it)                                                              \
    {                                                                                                                \
        if (it->valid[0])                                                                                            \
            function(it, (Packet){ it->rays, it->valid, 1, 1, 0 });                                                  \
    }                                                                                                                \
    NEVER_INLINE name##_in_turn(const EmbreeHitArguments *it)                                                        \
    {                                                                                                                \
        for (uint32_t ray = 0; ray < it->count; ray++)                                                               \
            if (it->valid[ray])                                                                                      \
                function(it, (Packet){ it->rays + ray, it->valid + ray, it->count, 1, 0 });                          \
    }                                                                                                                \
    static void name(const EmbreeHitArguments *it)                                                                   \
    {                                                                                                                \
        switch (it->count) {                                                                                         \
        case 16: name##_16(it); break;                                                                               \
        case 8: name##_8(it); break;                                                                                 \
        case 4: name##_4(it); break;                                                                                 \
        case 1: name##_1(it); break;                                                                                 \
        default: name##_in_turn(it);                                                                                 \
        }                                                                                                            \
    }

CALLBACK(intersect, intersect_rays)
CALLBACK(occlude, occlude_rays)

EmbreeGeometry rtsl_geometry_attach(RtslGeometry *geometry, const Embree *embree, EmbreeDevice device)
{
    geometry->embree_version = embree->version;
    return embree_user_geometry(embree, device, geometry->count, geometry, bounds, intersect, occlude);
}
