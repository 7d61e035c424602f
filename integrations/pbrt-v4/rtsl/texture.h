// Textures of RTSL classes. Included by pbrt/textures.h: include that.

#ifndef PBRT_RTSL_TEXTURE_H
#define PBRT_RTSL_TEXTURE_H

#include <pbrt/util/color.h>

#include <pbrt/rtsl/instance.h>

#include <string>

namespace pbrt {

namespace rtsl {

class Caller;

/// What float and spectrum textures of RTSL classes share.
class Texture {
  public:
    Texture(const RtslClass &cls, const Instance::Source &source,
            const Transform &renderFromTexture);

    /// Looks a place up; the result stands in the caller's state.
    Caller &Lookup(const TextureEvalContext &context) const;

    std::string ToString() const;

  private:
    Instance instance;
    Transform textureFromRender;
    RtslKernel lookup;
};

}  // namespace rtsl

/// Numbers of an RTSL texture.
class RtslFloatTexture {
  public:
    static RtslFloatTexture *Create(const Transform &renderFromTexture,
                                    const TextureParameterDictionary &parameters,
                                    const FileLoc *loc, Allocator alloc);

    RtslFloatTexture(const RtslClass &cls, const rtsl::Instance::Source &source,
                     const Transform &renderFromTexture)
        : texture(cls, source, renderFromTexture) {}

    Float Evaluate(TextureEvalContext context) const;

    std::string ToString() const { return texture.ToString(); }

  private:
    rtsl::Texture texture;
};

/// Colours of an RTSL texture, as spectra the way that pbrt makes them of images.
class RtslSpectrumTexture {
  public:
    static RtslSpectrumTexture *Create(const Transform &renderFromTexture,
                                       const TextureParameterDictionary &parameters,
                                       SpectrumType spectrumType, const FileLoc *loc,
                                       Allocator alloc);

    RtslSpectrumTexture(const RtslClass &cls, const rtsl::Instance::Source &source,
                        const Transform &renderFromTexture)
        : texture(cls, source, renderFromTexture), spectrumType(source.colors) {}

    SampledSpectrum Evaluate(TextureEvalContext context, SampledWavelengths lambda) const;

    /// The colour itself, for RTSL materials.
    RGB Color(const TextureEvalContext &context) const;

    std::string ToString() const { return texture.ToString(); }

  private:
    rtsl::Texture texture;
    SpectrumType spectrumType;
};

}  // namespace pbrt

#endif  // PBRT_RTSL_TEXTURE_H
