#include <pbrt/materials.h>

#include <pbrt/util/print.h>

#include <pbrt/rtsl/caller.h>

#include <cmath>

namespace pbrt {

using rtsl::FindMethod;
using rtsl::KernelOf;
using rtsl::Reads;

/// What a class's methods ask for that pbrt does not tell materials, once for each instance.
static void WarnOfUnknowns(const RtslClass &cls, const FileLoc *loc) {
    for (const char *name : {"BSDF", "sampleBSDF", "evaluatePDF"}) {
        const RtslMethod *method = FindMethod(cls, name);
        if (Reads(method, RTSL_STATE_HitDistance) || Reads(method, RTSL_STATE_RayOrigin)) {
            Warning(loc, "Class %s: %s() reads where rays begin, which pbrt does not tell materials: "
                    "distances are 0, so nothing is absorbed on the way. Use pbrt's media for that.",
                    cls.name, name);
            break;
        }
    }
    if (const RtslMethod *emission = FindMethod(cls, "emission");
        emission && !(emission->flags & RTSL_LEAVES_ZEROS))
        Warning(loc, "Class %s: what it emits is left out; shapes emit by "
                "AreaLightSource \"rtsl\" with the same class.",
                cls.name);
}

static rtsl::ScatteringMethods FindScattering(const RtslClass &cls, const FileLoc *loc) {
    rtsl::ScatteringMethods methods;
    methods.sampleBSDF = KernelOf(FindMethod(cls, "sampleBSDF"));
    if (!methods.sampleBSDF)
        ErrorExit(loc, "Class %s has no sampleBSDF(), which pbrt's integrators need; shade() is of no "
                  "use to them.",
                  cls.name);
    const RtslMethod *bsdf = FindMethod(cls, "BSDF");
    if (bsdf && !(bsdf->flags & RTSL_LEAVES_ZEROS)) {
        methods.bsdf = bsdf->kernel;
        methods.evaluatePDF = KernelOf(FindMethod(cls, "evaluatePDF"));
    }
    return methods;
}

RtslMaterial *RtslMaterial::Create(const TextureParameterDictionary &parameters, Image *normalMap,
                                   const FileLoc *loc, Allocator alloc) {
    const ParameterDictionary &dictionary = parameters;
    const RtslClass &cls = rtsl::FindClass(dictionary, RTSL_MATERIAL, loc);
    rtsl::Instance::Source source{dictionary,
                                  &parameters,
                                  SpectrumType::Albedo,
                                  {"type", "normalmap", "displacement"},
                                  loc,
                                  alloc};
    FloatTexture displacement = parameters.GetFloatTextureOrNull("displacement", alloc);
    return alloc.new_object<RtslMaterial>(cls, source, displacement, normalMap);
}

RtslMaterial::RtslMaterial(const RtslClass &cls, const rtsl::Instance::Source &source,
                           FloatTexture displacement, Image *normalMap)
    : instance(cls, source),
      methods(FindScattering(cls, source.loc)),
      displacement(displacement),
      normalMap(normalMap) {
    WarnOfUnknowns(cls, source.loc);
}

/// The derivative by v where pbrt knows how the surface changes on the image, else a tangent at right angles.
static Vector3f DerivativeByV(const MaterialEvalContext &context) {
    Float determinant = context.dvdx * context.dudy - context.dvdy * context.dudx;
    Vector3f dpdv = (context.dpdx * context.dudy - context.dpdy * context.dudx) / determinant;
    if (IsFinite(LengthSquared(dpdv)) && LengthSquared(dpdv) > 0)
        return dpdv;
    return Cross(Vector3f(context.ns), context.dpdus);
}

RtslBxDF RtslMaterial::BxDFAt(const MaterialEvalContext &context,
                              const SampledWavelengths &lambda) const {
    rtsl::SurfacePoint surface;
    surface.point = context.p;
    surface.geometricNormal = context.n;
    surface.shadingNormal = context.ns;
    surface.uv = context.uv;
    surface.dpdu = context.dpdus;
    surface.dpdv = DerivativeByV(context);
    surface.du = std::hypot(context.dudx, context.dudy);
    surface.dv = std::hypot(context.dvdx, context.dvdy);
    return RtslBxDF(methods, instance, context, surface, rtsl::ColorBasis(lambda));
}

std::string RtslMaterial::ToString() const {
    return StringPrintf("[ RtslMaterial class: %s ]", instance.Class().name);
}

}  // namespace pbrt
