#include <pbrt/rtsl/caller.h>

#include <pbrt/util/float.h>
#include <pbrt/util/hash.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace pbrt::rtsl {

float Numbers::Next() {
    if (taken < count)
        return given[taken++];
    return std::min(HashFloat(given[0], given[1], given[2], ++taken), float(OneMinusEpsilon));
}

// Only shade() traces rays and asks for lights, and pbrt's integrators do that themselves.
static void NoRadiance(void *, uint32_t, uint32_t, const RtslRayLanes *,
                       float (*radiance)[RTSL_LANES]) {
    std::memset(radiance, 0, RTSL_COLOR_COMPONENTS * sizeof(*radiance));
}

static uint32_t NothingOccluded(void *, uint32_t, uint32_t, const RtslRayLanes *) {
    return 0;
}

static uint32_t NoLights(void *) {
    return 0;
}

static uint32_t NoLightSample(void *, uint32_t, uint32_t, uint32_t, const RtslLightQueryLanes *,
                              RtslLightLanes *) {
    return 0;
}

static void NoAmbientLight(void *, float *color) {
    std::memset(color, 0, RTSL_COLOR_COMPONENTS * sizeof(float));
}

static void NextNumber(void *user, uint32_t, uint32_t, float *values) {
    values[0] = static_cast<Numbers *>(user)->Next();
}

static const RtslHostFunctions HostFunctions = {NoRadiance,    NothingOccluded, NoLights,
                                                NoLightSample, NoAmbientLight,  NextNumber};

static const float Defaults[RTSL_STATE_COMPONENTS] = {RTSL_STATE_DEFAULTS};

Caller::Caller() {
    for (int i = 0; i < RTSL_STATE_COMPONENTS; ++i)
        state[i] = &values[i];
    for (uint32_t i = 0; i < MaxScratchArrays; ++i)
        scratch[i] = &scratchValues[i];
    std::memset(scratchValues, 0, sizeof(scratchValues));
    call.state = state;
    call.scratch = scratch;
    call.accepted = &accepted;
    call.host = &HostFunctions;
    call.count = 1;
}

void Caller::Reset() {
    std::memcpy(values, Defaults, sizeof(values));
}

RGB Caller::Color(int variable) const {
    RGB color(values[variable], values[variable + 1], values[variable + 2]);
    bool isUsable = std::isfinite(color.r) && std::isfinite(color.g) && std::isfinite(color.b);
    return isUsable ? color : RGB(0, 0, 0);
}

void Caller::Call(RtslKernel kernel, const uint32_t *block, Numbers numbers) {
    call.instance = block;
    call.objects = block;
    call.user = &numbers;
    kernel(&call);
}

}  // namespace pbrt::rtsl
