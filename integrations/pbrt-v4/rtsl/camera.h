// Cameras of RTSL classes. Included by pbrt/cameras.h: include that.

#ifndef PBRT_RTSL_CAMERA_H
#define PBRT_RTSL_CAMERA_H

#include <pbrt/rtsl/instance.h>

#include <string>

namespace pbrt {

/// An instance of an RTSL camera. Its space is that of pbrt's cameras: z forward, y up, left-handed.
class RtslCamera : public CameraBase {
  public:
    static RtslCamera *Create(const ParameterDictionary &parameters,
                              const CameraTransform &cameraTransform, Film film, Medium medium,
                              const FileLoc *loc, Allocator alloc);

    RtslCamera(CameraBaseParameters base, const RtslClass &cls,
               const rtsl::Instance::Source &source);

    pstd::optional<CameraRay> GenerateRay(CameraSample sample, SampledWavelengths &lambda) const;

    pstd::optional<CameraRayDifferential> GenerateRayDifferential(CameraSample sample,
                                                                  SampledWavelengths &lambda) const {
        return CameraBase::GenerateRayDifferential(this, sample, lambda);
    }

    // RTSL cameras make rays; paths from lights do not reach them.
    SampledSpectrum We(const Ray &ray, SampledWavelengths &lambda,
                       Point2f *pRaster2 = nullptr) const;
    void PDF_We(const Ray &ray, Float *pdfPos, Float *pdfDir) const;
    pstd::optional<CameraWiSample> SampleWi(const Interaction &ref, Point2f u,
                                            SampledWavelengths &lambda) const;

    std::string ToString() const;

  private:
    rtsl::Instance instance;
    RtslKernel generateRay;
    bool setsWeight;
};

}  // namespace pbrt

#endif  // PBRT_RTSL_CAMERA_H
