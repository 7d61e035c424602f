// Lights of RTSL classes. Included by pbrt/lights.h: include that.

#ifndef PBRT_RTSL_LIGHT_H
#define PBRT_RTSL_LIGHT_H

#include <pbrt/rtsl/emitter.h>

#include <string>

namespace pbrt {

/// A light: an RTSL light class, or a shape that gives off the emission of an RTSL material class.
class RtslLight {
  public:
    static RtslLight *Create(const Transform &renderFromLight, Medium outsideMedium,
                             const ParameterDictionary &parameters, const FileLoc *loc,
                             Allocator alloc);

    static RtslLight *CreateArea(const Transform &renderFromLight,
                                 const MediumInterface &mediumInterface,
                                 const ParameterDictionary &parameters, Shape shape,
                                 FloatTexture alpha, const FileLoc *loc, Allocator alloc);

    explicit RtslLight(rtsl::Emitter *emitter) : emitter(emitter) {}

    LightType Type() const { return emitter->Type(); }

    SampledSpectrum Phi(SampledWavelengths lambda) const { return emitter->Phi(lambda); }

    pstd::optional<LightLiSample> SampleLi(LightSampleContext context, Point2f u,
                                           SampledWavelengths lambda, bool) const {
        return emitter->SampleLi(context, u, lambda);
    }

    Float PDF_Li(LightSampleContext context, Vector3f wi, bool) const {
        return emitter->PDF_Li(context, wi);
    }

    SampledSpectrum L(Point3f p, Normal3f n, Point2f uv, Vector3f w,
                      const SampledWavelengths &lambda) const {
        return emitter->L(p, n, uv, w, lambda);
    }

    SampledSpectrum Le(const Ray &ray, const SampledWavelengths &lambda) const {
        return emitter->Le(ray, lambda);
    }

    void Preprocess(const Bounds3f &sceneBounds) { emitter->Preprocess(sceneBounds); }

    pstd::optional<LightBounds> Bounds() const { return emitter->Bounds(); }

    // RTSL lights light points; what leaves them is not sampled.
    pstd::optional<LightLeSample> SampleLe(Point2f u1, Point2f u2, SampledWavelengths &lambda,
                                           Float time) const;
    void PDF_Le(const Ray &, Float *pdfPos, Float *pdfDir) const;
    void PDF_Le(const Interaction &, Vector3f w, Float *pdfPos, Float *pdfDir) const;

    std::string ToString() const { return emitter->ToString(); }

  private:
    rtsl::Emitter *emitter;
};

}  // namespace pbrt

#endif  // PBRT_RTSL_LIGHT_H
