// Calls of RTSL methods for one ray.

#ifndef PBRT_RTSL_CALLER_H
#define PBRT_RTSL_CALLER_H

#include <pbrt/pbrt.h>

#include <pbrt/util/color.h>
#include <pbrt/util/vecmath.h>

#include <pbrt/rtsl/library.h>

namespace pbrt::rtsl {

/// What rand() gives: first the numbers of pbrt's sampler, then others that follow from them.
class Numbers {
  public:
    Numbers() = default;
    Numbers(Point2f u) : given{u.x, u.y}, count(2) {}
    Numbers(Point2f u, Float third) : given{u.x, u.y, third}, count(3) {}

    float Next();

  private:
    float given[3] = {};
    uint32_t count = 0, taken = 0;
};

/// The state variables of one ray, and calls of methods that read and set them. Each thread has one.
class Caller {
  public:
    Caller(const Caller &) = delete;
    Caller &operator=(const Caller &) = delete;

    /// The calling thread's, with all state variables at their defaults.
    static Caller &Begin() {
        Caller &caller = Current();
        caller.Reset();
        return caller;
    }

    /// The calling thread's, as the last call left it.
    static Caller &Current() {
        static thread_local Caller caller;
        return caller;
    }

    void Set(int variable, Float value) { values[variable] = value; }
    void Set(int variable, Point2f value) {
        values[variable] = value.x;
        values[variable + 1] = value.y;
    }
    template <template <typename> class Tuple>
    void Set(int variable, const Tuple<Float> &value) {
        values[variable] = value.x;
        values[variable + 1] = value.y;
        values[variable + 2] = value.z;
    }

    Float Number(int variable) const { return values[variable]; }
    Point2f Pair(int variable) const { return {values[variable], values[variable + 1]}; }
    Vector3f Vector(int variable) const {
        return {values[variable], values[variable + 1], values[variable + 2]};
    }
    Point3f Point(int variable) const { return Point3f(Vector(variable)); }
    Normal3f Normal(int variable) const { return Normal3f(Vector(variable)); }
    /// A colour without what is no number.
    RGB Color(int variable) const;

    /// Sets the ray that methods read.
    void SetRay(Point3f origin, Vector3f direction) {
        Set(RTSL_STATE_RayOrigin, origin);
        Set(RTSL_STATE_RayDirection, direction);
        Set(RTSL_STATE_InverseRayDirection,
            Vector3f(1 / direction.x, 1 / direction.y, 1 / direction.z));
    }

    /// Calls a method of an instance.
    void Call(RtslKernel kernel, const uint32_t *block, Numbers numbers = {});

    /// Calls intersect; whether it accepted a hit.
    bool CallIntersect(RtslKernel kernel, const uint32_t *block) {
        accepted = 0;
        Call(kernel, block);
        return accepted != 0;
    }

  private:
    Caller();
    void Reset();

    float values[RTSL_STATE_COMPONENTS];
    float *state[RTSL_STATE_COMPONENTS];
    float scratchValues[MaxScratchArrays];
    float *scratch[MaxScratchArrays];
    int32_t accepted = 0;
    RtslCall call = {};
};

}  // namespace pbrt::rtsl

#endif  // PBRT_RTSL_CALLER_H
