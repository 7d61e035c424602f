#include <pbrt/lights.h>

#include <pbrt/util/print.h>
#include <pbrt/util/rng.h>
#include <pbrt/util/sampling.h>

#include <pbrt/rtsl/caller.h>
#include <pbrt/rtsl/color.h>

#include <algorithm>
#include <cmath>

namespace pbrt::rtsl {

/// Samples from which a light's place and power are learned.
constexpr int Probes = 64;

/// Of the strongest sample, what every light is taken to have at least: none may be left out because the samples missed
/// where it shines.
constexpr Float LeastShare = 0.01f;

LightEmitter::LightEmitter(const RtslClass &cls, const Instance::Source &source,
                           const Transform &renderFromLight, Medium medium)
    : instance(cls, source),
      renderFromLight(renderFromLight),
      lightFromRender(Inverse(renderFromLight)),
      mediumInterface(medium),
      illumination(KernelOf(FindMethod(cls, "illumination"))),
      evaluatePDF(KernelOf(FindMethod(cls, "evaluatePDF"))),
      emission(KernelOf(FindMethod(cls, "emission"))),
      power(1, 1, 1) {
    if (!illumination && !emission)
        ErrorExit(source.loc, "Class %s has neither illumination() nor emission(): it gives no light.",
                  cls.name);
}

// Rays find a light that has emission. pbrt weighs samples of others as those of a point: there is nothing to weigh them
// against, whether they have a density or not.
LightType LightEmitter::Type() const {
    return emission ? LightType::Infinite : LightType::DeltaPosition;
}

Caller &LightEmitter::BeginAt(const LightSampleContext &context) const {
    Caller &caller = Caller::Begin();
    caller.Set(RTSL_STATE_HitPoint, lightFromRender(context.p()));
    if (context.n != Normal3f(0, 0, 0)) {
        caller.Set(RTSL_STATE_GeometricNormal, Normalize(lightFromRender(context.n)));
        caller.Set(RTSL_STATE_ShadingNormal, Normalize(lightFromRender(context.ns)));
    }
    return caller;
}

LightEmitter::Sample LightEmitter::SampleAt(const LightSampleContext &context, Point2f u) const {
    Caller &caller = BeginAt(context);
    caller.Set(RTSL_STATE_LightDistance, Infinity);
    caller.Call(illumination, instance.Block(), Numbers(u));
    Vector3f direction = renderFromLight(caller.Vector(RTSL_STATE_LightDirection));
    Float stretch = Length(direction);
    return Sample{direction / stretch, caller.Number(RTSL_STATE_LightDistance) * stretch,
                  caller.Color(RTSL_STATE_LightColor), caller.Number(RTSL_STATE_PDF)};
}

pstd::optional<LightLiSample> LightEmitter::SampleLi(const LightSampleContext &context, Point2f u,
                                                     const SampledWavelengths &lambda) const {
    if (!illumination)
        return {};
    Sample sample = SampleAt(context, u);
    bool isBlack = sample.color.r <= 0 && sample.color.g <= 0 && sample.color.b <= 0;
    if (isBlack || !(sample.distance > 0) || !IsFinite(LengthSquared(sample.direction)))
        return {};
    Float distance = std::min(sample.distance, 2 * sceneRadius);
    Interaction end(context.p() + distance * sample.direction, &mediumInterface);
    SampledSpectrum radiance = Radiance(sample.color, lambda);
    bool isFound = emission && sample.distance == Infinity;
    if (sample.pdf > 0 && (isFound || !emission))
        return LightLiSample(radiance, sample.direction, sample.pdf, end);
    // A delta, or a point at a finite distance, of a light that rays can find, too: they never find this part of it, so
    // its weight is to be 1.
    Float pdf = emission ? 1e6f : 1;
    Float own = sample.pdf > 0 ? sample.pdf : 1;
    return LightLiSample(pdf / own * radiance, sample.direction, pdf, end);
}

Float LightEmitter::PDF_Li(const LightSampleContext &context, Vector3f wi) const {
    if (!illumination || !evaluatePDF)
        return 0;
    Caller &caller = BeginAt(context);
    caller.Set(RTSL_STATE_LightDirection, Normalize(lightFromRender(wi)));
    caller.Call(evaluatePDF, instance.Block());
    Float pdf = caller.Number(RTSL_STATE_PDF);
    return pdf > 0 && pdf < Infinity ? pdf : 0;
}

RGB LightEmitter::EmissionTowards(Vector3f direction) const {
    Caller &caller = Caller::Begin();
    caller.Set(RTSL_STATE_RayDirection, direction);
    caller.Set(RTSL_STATE_LightDirection, direction);
    caller.Call(emission, instance.Block());
    return caller.Color(RTSL_STATE_EmissionColor);
}

SampledSpectrum LightEmitter::Le(const Ray &ray, const SampledWavelengths &lambda) const {
    if (!emission)
        return SampledSpectrum(0.f);
    return Radiance(EmissionTowards(Normalize(lightFromRender(ray.d))), lambda);
}

SampledSpectrum LightEmitter::Phi(const SampledWavelengths &lambda) const {
    return Radiance(power, lambda);
}

void LightEmitter::Preprocess(const Bounds3f &sceneBounds) {
    Point3f center;
    sceneBounds.BoundingSphere(&center, &sceneRadius);
    if (emission)
        ProbeSky();
    else
        ProbeLamp(sceneBounds);
}

void LightEmitter::ProbeSky() {
    RNG rng;
    RGB sum(0, 0, 0);
    for (int i = 0; i < Probes; ++i)
        sum += EmissionTowards(SampleUniformSphere({rng.Uniform<Float>(), rng.Uniform<Float>()}));
    power = 4 * Pi * Pi * Sqr(sceneRadius) / Probes * sum;
}

void LightEmitter::ProbeLamp(const Bounds3f &sceneBounds) {
    RNG rng;
    RGB sum(0, 0, 0), most(0, 0, 0);
    isSomewhere = true;
    place = Bounds3f();
    for (int i = 0; i < Probes; ++i) {
        Point3f part(rng.Uniform<Float>(), rng.Uniform<Float>(), rng.Uniform<Float>());
        Point3f point = sceneBounds.Lerp(part);
        LightSampleContext context(Point3fi(point), Normal3f(0, 0, 0), Normal3f(0, 0, 0));
        Sample sample = SampleAt(context, {rng.Uniform<Float>(), rng.Uniform<Float>()});
        if (!(sample.distance < Infinity)) {
            isSomewhere = false;
            sample.distance = sceneRadius;
        }
        place = Union(place, point + sample.distance * sample.direction);
        RGB intensity = Sqr(sample.distance) / (sample.pdf > 0 ? sample.pdf : 1) * sample.color;
        sum += intensity;
        for (int channel = 0; channel < 3; ++channel)
            most[channel] = std::max(most[channel], intensity[channel]);
    }
    RGB mean = sum / Probes + LeastShare * most;
    bool isDark = mean.r <= 0 && mean.g <= 0 && mean.b <= 0;
    power = 4 * Pi * (isDark ? RGB(1, 1, 1) : mean);
}

pstd::optional<LightBounds> LightEmitter::Bounds() const {
    if (emission || !isSomewhere)
        return {};
    // It may shine anywhere.
    Float all = std::cos(Pi), beyond = std::cos(Pi / 2);
    return LightBounds(place, Vector3f(0, 0, 1), GreatestRadiance(power), all, beyond, false);
}

std::string LightEmitter::ToString() const {
    return StringPrintf("[ RtslLight class: %s ]", instance.Class().name);
}

}  // namespace pbrt::rtsl
