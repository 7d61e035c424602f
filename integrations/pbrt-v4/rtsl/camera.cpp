#include <pbrt/cameras.h>

#include <pbrt/util/print.h>

#include <pbrt/rtsl/caller.h>
#include <pbrt/rtsl/color.h>

namespace pbrt {

using rtsl::Caller;

RtslCamera *RtslCamera::Create(const ParameterDictionary &parameters,
                               const CameraTransform &cameraTransform, Film film, Medium medium,
                               const FileLoc *loc, Allocator alloc) {
    const RtslClass &cls = rtsl::FindClass(parameters, RTSL_CAMERA, loc);
    CameraBaseParameters base(cameraTransform, film, medium, parameters, loc);
    rtsl::Instance::Source source{parameters,
                                  nullptr,
                                  SpectrumType::Albedo,
                                  {"shutteropen", "shutterclose"},
                                  loc,
                                  alloc};
    return alloc.new_object<RtslCamera>(base, cls, source);
}

RtslCamera::RtslCamera(CameraBaseParameters base, const RtslClass &cls,
                       const rtsl::Instance::Source &source)
    : CameraBase(base), instance(cls, source) {
    const RtslMethod &method = rtsl::RequireMethod(cls, "generateRay", source.loc);
    generateRay = method.kernel;
    setsWeight = rtsl::Writes(method, RTSL_STATE_SampleColor);
    if (rtsl::Writes(method, RTSL_STATE_HitDistance) || rtsl::Writes(method, RTSL_STATE_Epsilon))
        Warning(source.loc, "Class %s sets where rays begin and end to count, which pbrt's rays do not "
                "heed.",
                cls.name);
    FindMinimumDifferentials(this);
}

pstd::optional<CameraRay> RtslCamera::GenerateRay(CameraSample sample,
                                                  SampledWavelengths &lambda) const {
    Point2i resolution = film.FullResolution();
    Float time = SampleTime(sample.time);
    Caller &caller = Caller::Begin();
    caller.Set(RTSL_STATE_ScreenCoord,
               Point2f(sample.pFilm.x / resolution.x, 1 - sample.pFilm.y / resolution.y));
    caller.Set(RTSL_STATE_LensCoord, sample.pLens);
    caller.Set(RTSL_STATE_du, Float(1) / resolution.x);
    caller.Set(RTSL_STATE_dv, Float(1) / resolution.y);
    caller.Set(RTSL_STATE_TimeSeed, time);
    caller.Set(RTSL_STATE_SampleColor, Vector3f(1, 1, 1));
    caller.Call(generateRay, instance.Block(), rtsl::Numbers(sample.pLens));
    Vector3f direction = caller.Vector(RTSL_STATE_RayDirection);
    RGB weight = caller.Color(RTSL_STATE_SampleColor);
    bool isBlack = weight.r <= 0 && weight.g <= 0 && weight.b <= 0;
    if (isBlack || !(LengthSquared(direction) > 0) || !IsFinite(LengthSquared(direction)))
        return {};
    Ray ray(caller.Point(RTSL_STATE_RayOrigin), Normalize(direction), time, medium);
    if (!setsWeight)
        return CameraRay{RenderFromCamera(ray)};
    return CameraRay{RenderFromCamera(ray), rtsl::ColorBasis(lambda)(weight)};
}

[[noreturn]] static void RefusePaths() {
    ErrorExit("RTSL cameras only make rays. Take an integrator whose paths start at the camera: "
              "\"path\" or \"volpath\".");
}

SampledSpectrum RtslCamera::We(const Ray &, SampledWavelengths &, Point2f *) const {
    RefusePaths();
}

void RtslCamera::PDF_We(const Ray &, Float *, Float *) const {
    RefusePaths();
}

pstd::optional<CameraWiSample> RtslCamera::SampleWi(const Interaction &, Point2f,
                                                    SampledWavelengths &) const {
    RefusePaths();
}

std::string RtslCamera::ToString() const {
    return StringPrintf("[ RtslCamera %s class: %s ]", CameraBase::ToString(),
                        instance.Class().name);
}

}  // namespace pbrt
