// Scattering by RTSL materials at one point. Included by pbrt/bxdfs.h: include that.

#ifndef PBRT_RTSL_BXDF_H
#define PBRT_RTSL_BXDF_H

#include <pbrt/rtsl/color.h>
#include <pbrt/rtsl/instance.h>

#include <string>

namespace pbrt {

namespace rtsl {

class Caller;

/// The methods of a material that scatter light.
struct ScatteringMethods {
    RtslKernel sampleBSDF = nullptr;
    /// Null where every direction is a delta.
    RtslKernel bsdf = nullptr, evaluatePDF = nullptr;
};

/// A point of a surface, as materials know it.
struct SurfacePoint {
    Point3f point;
    Normal3f geometricNormal, shadingNormal;
    Point2f uv;
    Vector3f dpdu, dpdv;
    /// Widths of the filter along u and v.
    Float du = 0, dv = 0;
};

}  // namespace rtsl

/// An RTSL material at a point, for the wavelengths of a path.
class RtslBxDF {
  public:
    RtslBxDF() = default;

    /// `context` tells textures what the place is; `colors` are those of the path's wavelengths.
    RtslBxDF(const rtsl::ScatteringMethods &methods, const rtsl::Instance &instance,
             const TextureEvalContext &context, const rtsl::SurfacePoint &surface,
             const rtsl::ColorBasis &colors);

    BxDFFlags Flags() const {
        BxDFFlags lobes = methods.bsdf ? BxDFFlags::Glossy : BxDFFlags::Specular;
        return lobes | BxDFFlags::Reflection | BxDFFlags::Transmission;
    }

    SampledSpectrum f(Vector3f wo, Vector3f wi, TransportMode mode) const;

    pstd::optional<BSDFSample> Sample_f(Vector3f wo, Float uc, Point2f u, TransportMode mode,
                                        BxDFReflTransFlags sampleFlags) const;

    Float PDF(Vector3f wo, Vector3f wi, TransportMode mode, BxDFReflTransFlags sampleFlags) const;

    void Regularize() {}

    static const char *Name() { return "RtslBxDF"; }

    std::string ToString() const { return "[ RtslBxDF ]"; }

  private:
    const uint32_t *Block() const { return shared ? shared : own; }
    rtsl::Caller &Begin(Vector3f wo) const;
    /// Whether both normals agree on which side of the surface a direction leads to: else light would leak through it.
    bool IsConsistent(Vector3f wiRender, Vector3f wi) const;

    rtsl::ScatteringMethods methods;
    rtsl::SurfacePoint surface;
    Frame frame;
    rtsl::ColorBasis colors;
    /// The material's instance, where it is the same everywhere.
    const uint32_t *shared = nullptr;
    alignas(8) uint32_t own[rtsl::MaxTexturedWords];
};

}  // namespace pbrt

#endif  // PBRT_RTSL_BXDF_H
