#include <pbrt/lights.h>

#include <pbrt/util/hash.h>
#include <pbrt/util/print.h>
#include <pbrt/util/rng.h>
#include <pbrt/util/sampling.h>

#include <pbrt/rtsl/caller.h>
#include <pbrt/rtsl/color.h>

#include <cmath>

namespace pbrt::rtsl {

/// Samples from which an emitter's power is learned.
constexpr int Probes = 64;

ShapeEmitter::ShapeEmitter(const RtslClass &cls, const Instance::Source &source,
                           const MediumInterface &mediumInterface, Shape shape, FloatTexture alpha)
    : instance(cls, source),
      mediumInterface(mediumInterface),
      shape(shape),
      alpha(alpha),
      power(1, 1, 1) {
    const RtslMethod &method = RequireMethod(cls, "emission", source.loc);
    if (method.flags & RTSL_LEAVES_ZEROS)
        ErrorExit(source.loc, "Class %s can't make a shape a light: its emission() is black.", cls.name);
    emission = method.kernel;
}

RGB ShapeEmitter::EmissionAt(Point3f p, Normal3f n, Point2f uv, Vector3f w) const {
    Caller &caller = Caller::Begin();
    caller.SetRay(p + w, -w);
    caller.Set(RTSL_STATE_HitDistance, 1);
    caller.Set(RTSL_STATE_HitPoint, p);
    caller.Set(RTSL_STATE_GeometricNormal, n);
    caller.Set(RTSL_STATE_ShadingNormal, n);
    caller.Set(RTSL_STATE_TextureUV, uv);
    caller.Set(RTSL_STATE_TextureUVW, p);
    caller.Call(emission, instance.Block());
    return caller.Color(RTSL_STATE_EmissionColor);
}

// As pbrt cuts out its own area lights.
bool ShapeEmitter::IsCutOut(Point3f p, Point2f uv) const {
    if (!alpha)
        return false;
    Float part = UniversalTextureEvaluator()(alpha, Interaction(p, uv));
    return part <= 0 || (part < 1 && HashFloat(p) > part);
}

SampledSpectrum ShapeEmitter::L(Point3f p, Normal3f n, Point2f uv, Vector3f w,
                                const SampledWavelengths &lambda) const {
    if (IsCutOut(p, uv))
        return SampledSpectrum(0.f);
    RGB color = EmissionAt(p, n, uv, w);
    if (color.r <= 0 && color.g <= 0 && color.b <= 0)
        return SampledSpectrum(0.f);
    return Radiance(color, lambda);
}

pstd::optional<LightLiSample> ShapeEmitter::SampleLi(const LightSampleContext &context, Point2f u,
                                                     const SampledWavelengths &lambda) const {
    ShapeSampleContext from(context.pi, context.n, context.ns, 0);
    pstd::optional<ShapeSample> sample = shape.Sample(from, u);
    if (!sample || sample->pdf == 0)
        return {};
    Interaction &point = sample->intr;
    Vector3f way = point.p() - context.p();
    if (LengthSquared(way) == 0)
        return {};
    point.mediumInterface = &mediumInterface;
    Vector3f wi = Normalize(way);
    SampledSpectrum radiance = L(point.p(), point.n, point.uv, -wi, lambda);
    if (!radiance)
        return {};
    return LightLiSample(radiance, wi, sample->pdf, point);
}

Float ShapeEmitter::PDF_Li(const LightSampleContext &context, Vector3f wi) const {
    return shape.PDF(ShapeSampleContext(context.pi, context.n, context.ns, 0), wi);
}

// What it emits on average towards points around it, times its area.
void ShapeEmitter::Preprocess(const Bounds3f &) {
    RNG rng;
    Point3f center;
    Float radius;
    shape.Bounds().BoundingSphere(&center, &radius);
    RGB sum(0, 0, 0);
    for (int i = 0; i < Probes; ++i) {
        Vector3f d = SampleUniformSphere({rng.Uniform<Float>(), rng.Uniform<Float>()});
        ShapeSampleContext from(Point3fi(center + 4 * radius * d), Normal3f(0, 0, 0),
                                Normal3f(0, 0, 0), 0);
        Point2f u(rng.Uniform<Float>(), rng.Uniform<Float>());
        if (pstd::optional<ShapeSample> sample = shape.Sample(from, u)) {
            const Interaction &point = sample->intr;
            sum += EmissionAt(point.p(), point.n, point.uv, Normalize(from.p() - point.p()));
        }
    }
    bool isDark = sum.r <= 0 && sum.g <= 0 && sum.b <= 0;
    power = Pi * shape.Area() * (isDark ? RGB(1, 1, 1) : sum / Probes);
}

SampledSpectrum ShapeEmitter::Phi(const SampledWavelengths &lambda) const {
    return Radiance(power, lambda);
}

pstd::optional<LightBounds> ShapeEmitter::Bounds() const {
    // It may shine anywhere.
    Float all = std::cos(Pi), beyond = std::cos(Pi / 2);
    return LightBounds(shape.Bounds(), Vector3f(0, 0, 1), GreatestRadiance(power), all, beyond,
                       false);
}

std::string ShapeEmitter::ToString() const {
    return StringPrintf("[ RtslLight class: %s shape: %s ]", instance.Class().name, shape);
}

}  // namespace pbrt::rtsl
