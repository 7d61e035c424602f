// RTSL materials. Included by pbrt/materials.h: include that.

#ifndef PBRT_RTSL_MATERIAL_H
#define PBRT_RTSL_MATERIAL_H

#include <pbrt/rtsl/bxdf.h>
#include <pbrt/rtsl/instance.h>

#include <string>

namespace pbrt {

/// An instance of an RTSL material. Parameters may be pbrt's textures: then the instance is made anew for each hit.
class RtslMaterial {
  public:
    using BxDF = RtslBxDF;
    using BSSRDF = void;

    static RtslMaterial *Create(const TextureParameterDictionary &parameters, Image *normalMap,
                                const FileLoc *loc, Allocator alloc);

    RtslMaterial(const RtslClass &cls, const rtsl::Instance::Source &source,
                 FloatTexture displacement, Image *normalMap);

    static const char *Name() { return "RtslMaterial"; }

    template <typename TextureEvaluator>
    bool CanEvaluateTextures(TextureEvaluator) const {
        return !instance.IsTextured() ||
               std::is_same_v<TextureEvaluator, UniversalTextureEvaluator>;
    }

    template <typename TextureEvaluator>
    RtslBxDF GetBxDF(TextureEvaluator, const MaterialEvalContext &context,
                     SampledWavelengths &lambda) const {
        return BxDFAt(context, lambda);
    }

    template <typename TextureEvaluator>
    void GetBSSRDF(TextureEvaluator, const MaterialEvalContext &, SampledWavelengths &) const {}

    FloatTexture GetDisplacement() const { return displacement; }

    const Image *GetNormalMap() const { return normalMap; }

    static constexpr bool HasSubsurfaceScattering() { return false; }

    std::string ToString() const;

  private:
    RtslBxDF BxDFAt(const MaterialEvalContext &context, const SampledWavelengths &lambda) const;

    rtsl::Instance instance;
    rtsl::ScatteringMethods methods;
    FloatTexture displacement;
    Image *normalMap;
};

}  // namespace pbrt

#endif  // PBRT_RTSL_MATERIAL_H
