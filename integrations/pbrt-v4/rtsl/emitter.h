// What gives off light. Included by pbrt/lights.h, by way of rtsl/light.h: include that.

#ifndef PBRT_RTSL_EMITTER_H
#define PBRT_RTSL_EMITTER_H

#include <pbrt/rtsl/instance.h>

#include <string>

namespace pbrt::rtsl {

class Caller;

/// A light as pbrt's integrators ask for it.
class Emitter {
  public:
    virtual ~Emitter() = default;

    virtual LightType Type() const = 0;
    virtual SampledSpectrum Phi(const SampledWavelengths &lambda) const = 0;
    virtual pstd::optional<LightLiSample> SampleLi(const LightSampleContext &context, Point2f u,
                                                   const SampledWavelengths &lambda) const = 0;
    virtual Float PDF_Li(const LightSampleContext &context, Vector3f wi) const = 0;
    /// Of a surface, towards `w`.
    virtual SampledSpectrum L(Point3f, Normal3f, Point2f, Vector3f,
                              const SampledWavelengths &) const {
        return SampledSpectrum(0.f);
    }
    /// Of rays that leave the scene.
    virtual SampledSpectrum Le(const Ray &, const SampledWavelengths &) const {
        return SampledSpectrum(0.f);
    }
    virtual void Preprocess(const Bounds3f &sceneBounds) = 0;
    virtual pstd::optional<LightBounds> Bounds() const = 0;
    virtual std::string ToString() const = 0;
};

/// A light of an RTSL light class, in its own space.
class LightEmitter final : public Emitter {
  public:
    LightEmitter(const RtslClass &cls, const Instance::Source &source,
                 const Transform &renderFromLight, Medium medium);

    LightType Type() const override;
    SampledSpectrum Phi(const SampledWavelengths &lambda) const override;
    pstd::optional<LightLiSample> SampleLi(const LightSampleContext &context, Point2f u,
                                           const SampledWavelengths &lambda) const override;
    Float PDF_Li(const LightSampleContext &context, Vector3f wi) const override;
    SampledSpectrum Le(const Ray &ray, const SampledWavelengths &lambda) const override;
    void Preprocess(const Bounds3f &sceneBounds) override;
    pstd::optional<LightBounds> Bounds() const override;
    std::string ToString() const override;

  private:
    /// What illumination() gives for a point, in the space that pbrt renders in.
    struct Sample {
        Vector3f direction;
        Float distance;
        RGB color;
        Float pdf;
    };

    Caller &BeginAt(const LightSampleContext &context) const;
    Sample SampleAt(const LightSampleContext &context, Point2f u) const;
    RGB EmissionTowards(Vector3f direction) const;
    void ProbeSky();
    void ProbeLamp(const Bounds3f &sceneBounds);

    Instance instance;
    Transform renderFromLight, lightFromRender;
    MediumInterface mediumInterface;
    RtslKernel illumination, evaluatePDF, emission;
    Float sceneRadius = 1;
    /// What was learned from some samples: where it is, if anywhere, and its power, which says how often it is sampled.
    Bounds3f place;
    bool isSomewhere = false;
    RGB power;
};

/// A shape that gives off an RTSL material's emission.
class ShapeEmitter final : public Emitter {
  public:
    ShapeEmitter(const RtslClass &cls, const Instance::Source &source,
                 const MediumInterface &mediumInterface, Shape shape, FloatTexture alpha);

    LightType Type() const override { return LightType::Area; }
    SampledSpectrum Phi(const SampledWavelengths &lambda) const override;
    pstd::optional<LightLiSample> SampleLi(const LightSampleContext &context, Point2f u,
                                           const SampledWavelengths &lambda) const override;
    Float PDF_Li(const LightSampleContext &context, Vector3f wi) const override;
    SampledSpectrum L(Point3f p, Normal3f n, Point2f uv, Vector3f w,
                      const SampledWavelengths &lambda) const override;
    void Preprocess(const Bounds3f &sceneBounds) override;
    pstd::optional<LightBounds> Bounds() const override;
    std::string ToString() const override;

  private:
    RGB EmissionAt(Point3f p, Normal3f n, Point2f uv, Vector3f w) const;
    bool IsCutOut(Point3f p, Point2f uv) const;

    Instance instance;
    MediumInterface mediumInterface;
    Shape shape;
    FloatTexture alpha;
    RtslKernel emission;
    RGB power;
};

}  // namespace pbrt::rtsl

#endif  // PBRT_RTSL_EMITTER_H
