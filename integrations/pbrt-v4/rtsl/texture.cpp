#include <pbrt/textures.h>

#include <pbrt/util/colorspace.h>
#include <pbrt/util/print.h>

#include <pbrt/rtsl/caller.h>

#include <cmath>

namespace pbrt {

namespace rtsl {

Texture::Texture(const RtslClass &cls, const Instance::Source &source,
                 const Transform &renderFromTexture)
    : instance(cls, source),
      textureFromRender(Inverse(renderFromTexture)),
      lookup(RequireMethod(cls, "lookup", source.loc).kernel) {}

Caller &Texture::Lookup(const TextureEvalContext &context) const {
    alignas(8) uint32_t words[MaxTexturedWords];
    const uint32_t *block = instance.Block();
    if (instance.IsTextured()) {
        instance.MakeBlock(context, words);
        block = words;
    }
    Caller &caller = Caller::Begin();
    Point3f point = textureFromRender(context.p);
    caller.Set(RTSL_STATE_TextureUV, context.uv);
    caller.Set(RTSL_STATE_TextureUVW, point);
    caller.Set(RTSL_STATE_HitPoint, point);
    caller.Set(RTSL_STATE_du, std::hypot(context.dudx, context.dudy));
    caller.Set(RTSL_STATE_dv, std::hypot(context.dvdx, context.dvdy));
    caller.Call(lookup, block);
    return caller;
}

std::string Texture::ToString() const {
    return StringPrintf("[ RtslTexture class: %s ]", instance.Class().name);
}

}  // namespace rtsl

RtslFloatTexture *RtslFloatTexture::Create(const Transform &renderFromTexture,
                                           const TextureParameterDictionary &parameters,
                                           const FileLoc *loc, Allocator alloc) {
    const ParameterDictionary &dictionary = parameters;
    const RtslClass &cls = rtsl::FindClass(dictionary, RTSL_TEXTURE, loc);
    rtsl::Instance::Source source{dictionary, &parameters, SpectrumType::Unbounded, {}, loc, alloc};
    return alloc.new_object<RtslFloatTexture>(cls, source, renderFromTexture);
}

Float RtslFloatTexture::Evaluate(TextureEvalContext context) const {
    return texture.Lookup(context).Number(RTSL_STATE_FloatTextureValue);
}

RtslSpectrumTexture *RtslSpectrumTexture::Create(const Transform &renderFromTexture,
                                                 const TextureParameterDictionary &parameters,
                                                 SpectrumType spectrumType, const FileLoc *loc,
                                                 Allocator alloc) {
    const ParameterDictionary &dictionary = parameters;
    const RtslClass &cls = rtsl::FindClass(dictionary, RTSL_TEXTURE, loc);
    rtsl::Instance::Source source{dictionary, &parameters, spectrumType, {}, loc, alloc};
    return alloc.new_object<RtslSpectrumTexture>(cls, source, renderFromTexture);
}

RGB RtslSpectrumTexture::Color(const TextureEvalContext &context) const {
    return texture.Lookup(context).Color(RTSL_STATE_TextureColor);
}

SampledSpectrum RtslSpectrumTexture::Evaluate(TextureEvalContext context,
                                              SampledWavelengths lambda) const {
    const RGBColorSpace &space = *RGBColorSpace::sRGB;
    RGB color = ClampZero(Color(context));
    switch (spectrumType) {
    case SpectrumType::Albedo:
        return RGBAlbedoSpectrum(space, Clamp(color, 0, 1)).Sample(lambda);
    case SpectrumType::Unbounded:
        return RGBUnboundedSpectrum(space, color).Sample(lambda);
    default:
        return RGBIlluminantSpectrum(space, color).Sample(lambda);
    }
}

}  // namespace pbrt
