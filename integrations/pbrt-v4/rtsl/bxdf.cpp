#include <pbrt/bxdfs.h>

#include <pbrt/textures.h>
#include <pbrt/util/math.h>

#include <pbrt/rtsl/caller.h>

#include <cmath>

namespace pbrt {

using rtsl::Caller;

RtslBxDF::RtslBxDF(const rtsl::ScatteringMethods &methods, const rtsl::Instance &instance,
                   const TextureEvalContext &context, const rtsl::SurfacePoint &surface,
                   const rtsl::ColorBasis &colors)
    : methods(methods),
      surface(surface),
      frame(Frame::FromXZ(Normalize(surface.dpdu), Vector3f(surface.shadingNormal))),
      colors(colors) {
    if (instance.IsTextured())
        instance.MakeBlock(context, own);
    else
        shared = instance.Block();
}

Caller &RtslBxDF::Begin(Vector3f wo) const {
    Caller &caller = Caller::Begin();
    Vector3f view = frame.FromLocal(wo);
    // pbrt does not tell BxDFs where a ray began: it is taken to end where it begins.
    caller.SetRay(surface.point, -view);
    caller.Set(RTSL_STATE_HitDistance, 0);
    caller.Set(RTSL_STATE_HitPoint, surface.point);
    caller.Set(RTSL_STATE_GeometricNormal, surface.geometricNormal);
    caller.Set(RTSL_STATE_ShadingNormal, surface.shadingNormal);
    caller.Set(RTSL_STATE_TextureUV, surface.uv);
    caller.Set(RTSL_STATE_TextureUVW, surface.point);
    caller.Set(RTSL_STATE_dPdu, surface.dpdu);
    caller.Set(RTSL_STATE_dPdv, surface.dpdv);
    caller.Set(RTSL_STATE_du, surface.du);
    caller.Set(RTSL_STATE_dv, surface.dv);
    return caller;
}

bool RtslBxDF::IsConsistent(Vector3f wiRender, Vector3f wi) const {
    return Dot(wiRender, surface.geometricNormal) * wi.z > 0;
}

SampledSpectrum RtslBxDF::f(Vector3f wo, Vector3f wi, TransportMode) const {
    Vector3f light = frame.FromLocal(wi);
    if (!methods.bsdf || !IsConsistent(light, wi))
        return SampledSpectrum(0.f);
    Caller &caller = Begin(wo);
    caller.Set(RTSL_STATE_LightDirection, light);
    caller.Call(methods.bsdf, Block());
    return colors(caller.Color(RTSL_STATE_BSDFValue));
}

Float RtslBxDF::PDF(Vector3f wo, Vector3f wi, TransportMode, BxDFReflTransFlags) const {
    if (!methods.evaluatePDF)
        return 0;
    Caller &caller = Begin(wo);
    caller.Set(RTSL_STATE_LightDirection, frame.FromLocal(wi));
    caller.Call(methods.evaluatePDF, Block());
    Float pdf = caller.Number(RTSL_STATE_PDF);
    return pdf > 0 && pdf < Infinity ? pdf : 0;
}

/// How much denser the medium is that the light comes from, by Snell's law: pbrt asks for it where light is refracted.
static Float RelativeIndex(Vector3f wo, Vector3f wi) {
    Float sineBeyond = std::hypot(wi.x, wi.y);
    return sineBeyond > 1e-4f ? std::hypot(wo.x, wo.y) / sineBeyond : 1;
}

pstd::optional<BSDFSample> RtslBxDF::Sample_f(Vector3f wo, Float uc, Point2f u, TransportMode,
                                              BxDFReflTransFlags sampleFlags) const {
    Caller &caller = Begin(wo);
    caller.Set(RTSL_STATE_BSDFSeed, Vector3f(u.x, u.y, uc));
    caller.Call(methods.sampleBSDF, Block(), rtsl::Numbers(u, uc));
    Vector3f light = caller.Vector(RTSL_STATE_LightDirection);
    Vector3f wi = frame.ToLocal(light);
    Float pdf = caller.Number(RTSL_STATE_PDF);
    if (!IsConsistent(light, wi) || !IsFinite(LengthSquared(wi)) || !(pdf < Infinity))
        return {};
    SampledSpectrum value = colors(caller.Color(RTSL_STATE_BSDFValue));
    bool isReflection = SameHemisphere(wo, wi);
    BxDFFlags side = isReflection ? BxDFFlags::Reflection : BxDFFlags::Transmission;
    if (!(side & sampleFlags))
        return {};
    Float eta = isReflection ? 1 : RelativeIndex(wo, wi);
    // The value of a delta is the whole weight; pbrt multiplies by the cosine.
    if (!(pdf > 0))
        return BSDFSample(value / AbsCosTheta(wi), wi, 1, BxDFFlags::Specular | side, eta);
    return BSDFSample(value, wi, pdf, BxDFFlags::Glossy | side, eta);
}

}  // namespace pbrt
