// Shapes of RTSL primitives. Included by pbrt/shapes.h: include that.

#ifndef PBRT_RTSL_SHAPE_H
#define PBRT_RTSL_SHAPE_H

#include <pbrt/rtsl/instance.h>

#include <memory>
#include <string>
#include <vector>

namespace pbrt {

namespace rtsl {
class Caller;
}

/// An instance of an RTSL primitive: in its own space, as the shader was written for, whatever space pbrt renders in.
class RtslShape {
  public:
    /// The shapes that a scene's `Shape "rtsl"` stands for: one, or as many as a class counts elements.
    static pstd::vector<Shape> Create(const Transform *renderFromObject,
                                      const Transform *objectFromRender, bool reverseOrientation,
                                      const ParameterDictionary &parameters, const FileLoc *loc,
                                      Allocator alloc);

    RtslShape(std::shared_ptr<const rtsl::Instance> instance, uint32_t element,
              const Transform *renderFromObject, const Transform *objectFromRender,
              bool reverseOrientation, const FileLoc *loc);

    /// Whether it can be sampled as a light.
    bool HasSamples() const { return generateSample && samplePDF; }

    const char *ClassName() const { return instance->Class().name; }

    Bounds3f Bounds() const { return (*renderFromObject)(objectBounds); }

    DirectionCone NormalBounds() const { return DirectionCone::EntireSphere(); }

    pstd::optional<ShapeIntersection> Intersect(const Ray &ray, Float tMax = Infinity) const;

    bool IntersectP(const Ray &ray, Float tMax = Infinity) const;

    /// Estimated: RTSL classes do not tell. pbrt weighs lights by it, and nothing else where lights have no "power".
    Float Area() const;

    /// RTSL shapes are sampled as seen from a point; by area, which bidirectional integrators want, they are not.
    pstd::optional<ShapeSample> Sample(Point2f u) const;
    Float PDF(const Interaction &) const;

    pstd::optional<ShapeSample> Sample(const ShapeSampleContext &ctx, Point2f u) const;

    Float PDF(const ShapeSampleContext &ctx, Vector3f wi) const;

    std::string ToString() const;

  private:
    /// A hit in the primitive's space.
    struct Hit {
        Point3f origin;
        Vector3f direction;
        Float t;
        Point3f point;
        Float time;
    };

    /// Normals in the space that pbrt renders in, of unit length.
    struct Normals {
        Normal3f geometric, shading;
    };

    /// Tangents in that space.
    struct Tangents {
        Vector3f dpdu, dpdv;
    };

    pstd::optional<Hit> Find(const Ray &ray, Float tMax) const;
    Normals NormalsAt(const Hit &hit, rtsl::Caller &caller) const;
    Point2f CoordinatesAt(const Hit &hit, rtsl::Caller &caller) const;
    Tangents TangentsAt(const Normals &normals, rtsl::Caller &caller) const;
    Normal3f ToRender(Normal3f normal) const;
    Point3fi ToRender(Point3f point, Float distance) const;
    Float DensityScale(Vector3f world, Vector3f local) const;
    void SetBounds(const FileLoc *loc);

    std::shared_ptr<const rtsl::Instance> instance;
    std::vector<uint32_t> block;
    const Transform *renderFromObject, *objectFromRender;
    bool reverseOrientation;
    bool setsShadingNormal = false;
    /// How much larger a volume of the primitive's space is in pbrt's.
    Float volumeScale;
    Bounds3f objectBounds;
    /// Least uncertainty of points on it.
    Float error;
    RtslKernel intersect, computeNormal, computeTextureCoordinates, computeDerivatives;
    RtslKernel generateSample, samplePDF;
};

}  // namespace pbrt

#endif  // PBRT_RTSL_SHAPE_H
