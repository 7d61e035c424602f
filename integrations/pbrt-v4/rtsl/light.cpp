#include <pbrt/lights.h>

#include <pbrt/rtsl/library.h>

namespace pbrt {

RtslLight *RtslLight::Create(const Transform &renderFromLight, Medium outsideMedium,
                             const ParameterDictionary &parameters, const FileLoc *loc,
                             Allocator alloc) {
    const RtslClass &cls = rtsl::FindClass(parameters, RTSL_LIGHT, loc);
    rtsl::Instance::Source source{parameters, nullptr, SpectrumType::Illuminant, {}, loc, alloc};
    return alloc.new_object<RtslLight>(
        alloc.new_object<rtsl::LightEmitter>(cls, source, renderFromLight, outsideMedium));
}

RtslLight *RtslLight::CreateArea(const Transform &, const MediumInterface &mediumInterface,
                                 const ParameterDictionary &parameters, Shape shape,
                                 FloatTexture alpha, const FileLoc *loc, Allocator alloc) {
    const RtslClass &cls = rtsl::FindClass(parameters, RTSL_MATERIAL, loc);
    const RtslShape *own = shape.CastOrNullptr<RtslShape>();
    if (own && !own->HasSamples())
        ErrorExit(loc, "Class %s can't be a light: it has no generateSample() and samplePDF().",
                  own->ClassName());
    rtsl::Instance::Source source{parameters, nullptr, SpectrumType::Illuminant, {}, loc, alloc};
    return alloc.new_object<RtslLight>(
        alloc.new_object<rtsl::ShapeEmitter>(cls, source, mediumInterface, shape, alpha));
}

[[noreturn]] static void RefusePaths() {
    ErrorExit("RTSL lights can't start paths. Take an integrator whose paths start at the camera: "
              "\"path\" or \"volpath\".");
}

pstd::optional<LightLeSample> RtslLight::SampleLe(Point2f, Point2f, SampledWavelengths &,
                                                  Float) const {
    RefusePaths();
}

void RtslLight::PDF_Le(const Ray &, Float *, Float *) const {
    RefusePaths();
}

void RtslLight::PDF_Le(const Interaction &, Vector3f, Float *, Float *) const {
    RefusePaths();
}

}  // namespace pbrt
