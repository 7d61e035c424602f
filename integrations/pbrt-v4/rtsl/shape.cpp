#include <pbrt/shapes.h>

#include <pbrt/util/print.h>
#include <pbrt/util/rng.h>
#include <pbrt/util/sampling.h>

#include <pbrt/rtsl/caller.h>

#include <algorithm>
#include <cmath>

namespace pbrt {

using rtsl::Caller;
using rtsl::Instance;
using rtsl::KernelOf;

/// Points on a shape are uncertain by this part of its extent at least: RTSL methods do not bound their rounding.
constexpr Float RelativeError = 1e-5f;

static bool IsUsable(Float density) {
    return density > 0 && density < Infinity;
}

static Float Determinant(const Transform &transform) {
    const SquareMatrix<4> &m = transform.GetMatrix();
    SquareMatrix<3> linear(m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1],
                           m[2][2]);
    return Determinant(linear);
}

static Normal3f NormalizedOr(Normal3f normal, Normal3f other) {
    Float square = LengthSquared(normal);
    return IsUsable(square) ? normal / std::sqrt(square) : other;
}

pstd::vector<Shape> RtslShape::Create(const Transform *renderFromObject,
                                      const Transform *objectFromRender, bool reverseOrientation,
                                      const ParameterDictionary &parameters, const FileLoc *loc,
                                      Allocator alloc) {
    const RtslClass &cls = rtsl::FindClass(parameters, RTSL_PRIMITIVE, loc);
    auto instance = std::make_shared<const Instance>(
        cls, Instance::Source{parameters, nullptr, SpectrumType::Albedo, {"alpha"}, loc, alloc});
    pstd::vector<Shape> shapes(alloc);
    for (uint32_t element = 0; element < instance->ElementCount(); ++element)
        shapes.push_back(alloc.new_object<RtslShape>(instance, element, renderFromObject,
                                                     objectFromRender, reverseOrientation, loc));
    return shapes;
}

RtslShape::RtslShape(std::shared_ptr<const Instance> instance, uint32_t element,
                     const Transform *renderFromObject, const Transform *objectFromRender,
                     bool reverseOrientation, const FileLoc *loc)
    : instance(instance),
      block(instance->ElementBlock(element)),
      renderFromObject(renderFromObject),
      objectFromRender(objectFromRender),
      reverseOrientation(reverseOrientation),
      volumeScale(std::abs(Determinant(*renderFromObject))) {
    const RtslClass &cls = instance->Class();
    intersect = rtsl::RequireMethod(cls, "intersect", loc).kernel;
    const RtslMethod *normal = rtsl::FindMethod(cls, "computeNormal");
    setsShadingNormal = normal && rtsl::Writes(*normal, RTSL_STATE_ShadingNormal);
    computeNormal = KernelOf(normal);
    computeTextureCoordinates = KernelOf(rtsl::FindMethod(cls, "computeTextureCoordinates"));
    computeDerivatives = KernelOf(rtsl::FindMethod(cls, "computeDerivatives"));
    generateSample = KernelOf(rtsl::FindMethod(cls, "generateSample"));
    samplePDF = KernelOf(rtsl::FindMethod(cls, "samplePDF"));
    SetBounds(loc);
}

void RtslShape::SetBounds(const FileLoc *loc) {
    Caller &caller = Caller::Begin();
    caller.Set(RTSL_STATE_BoundMin, Vector3f(-Infinity, -Infinity, -Infinity));
    caller.Set(RTSL_STATE_BoundMax, Vector3f(Infinity, Infinity, Infinity));
    if (RtslKernel kernel = KernelOf(rtsl::FindMethod(instance->Class(), "computeBounds")))
        caller.Call(kernel, block.data());
    Point3f low = caller.Point(RTSL_STATE_BoundMin), high = caller.Point(RTSL_STATE_BoundMax);
    if (!IsFinite(LengthSquared(high - low)))
        ErrorExit(loc, "Class %s has no bounds, and pbrt can't render what is infinite. Take a finite "
                  "shape, such as a large disk or patch instead of a plane.",
                  ClassName());
    objectBounds = Bounds3f(low, high);
    Vector3f reach = Max(Abs(Vector3f(low)), Abs(Vector3f(high)));
    error = RelativeError * MaxComponentValue(reach);
}

pstd::optional<RtslShape::Hit> RtslShape::Find(const Ray &ray, Float tMax) const {
    Point3f origin = (*objectFromRender)(ray.o);
    Vector3f direction = (*objectFromRender)(ray.d);
    Caller &caller = Caller::Begin();
    caller.SetRay(origin, direction);
    caller.Set(RTSL_STATE_TimeSeed, ray.time);
    // Rays of pbrt start off the surfaces that they leave.
    caller.Set(RTSL_STATE_Epsilon, 0);
    caller.Set(RTSL_STATE_HitDistance, tMax);
    if (!caller.CallIntersect(intersect, block.data()))
        return {};
    Float t = caller.Number(RTSL_STATE_HitDistance);
    return Hit{origin, direction, t, origin + t * direction, ray.time};
}

bool RtslShape::IntersectP(const Ray &ray, Float tMax) const {
    return Find(ray, tMax).has_value();
}

pstd::optional<ShapeIntersection> RtslShape::Intersect(const Ray &ray, Float tMax) const {
    pstd::optional<Hit> hit = Find(ray, tMax);
    if (!hit)
        return {};
    // The state and the scratch of the call that found the hit are there for the methods that follow.
    Caller &caller = Caller::Current();
    Normals normals = NormalsAt(*hit, caller);
    // computeNormal may have put it back on the surface.
    hit->point = caller.Point(RTSL_STATE_HitPoint);
    Point2f uv = CoordinatesAt(*hit, caller);
    Tangents tangents = TangentsAt(normals, caller);
    Point3fi point = ToRender(hit->point, hit->t * Length(hit->direction));
    SurfaceInteraction surface(point, uv, -ray.d, tangents.dpdu, tangents.dpdv, {}, {}, ray.time,
                               false);
    surface.n = normals.geometric;
    Vector3f dpdus = GramSchmidt(tangents.dpdu, Vector3f(normals.shading));
    if (!IsUsable(LengthSquared(dpdus)))
        CoordinateSystem(Vector3f(normals.shading), &dpdus, &tangents.dpdv);
    Vector3f dpdvs = Normalize(Cross(Vector3f(normals.shading), dpdus)) * Length(tangents.dpdv);
    surface.SetShadingGeometry(normals.shading, dpdus, dpdvs, {}, {}, false);
    return ShapeIntersection{surface, hit->t};
}

RtslShape::Normals RtslShape::NormalsAt(const Hit &hit, Caller &caller) const {
    Normal3f facing = Normal3f(-Normalize(hit.direction));
    caller.Set(RTSL_STATE_HitPoint, hit.point);
    caller.Set(RTSL_STATE_GeometricNormal, facing);
    caller.Set(RTSL_STATE_ShadingNormal, facing);
    if (computeNormal)
        caller.Call(computeNormal, block.data());
    Normal3f geometric = NormalizedOr(caller.Normal(RTSL_STATE_GeometricNormal), facing);
    Normal3f shading = geometric;
    if (setsShadingNormal)
        shading = NormalizedOr(caller.Normal(RTSL_STATE_ShadingNormal), geometric);
    caller.Set(RTSL_STATE_GeometricNormal, geometric);
    caller.Set(RTSL_STATE_ShadingNormal, shading);
    return {ToRender(geometric), ToRender(shading)};
}

Point2f RtslShape::CoordinatesAt(const Hit &hit, Caller &caller) const {
    caller.Set(RTSL_STATE_TextureUVW, hit.point);
    if (computeTextureCoordinates)
        caller.Call(computeTextureCoordinates, block.data());
    return caller.Pair(RTSL_STATE_TextureUV);
}

RtslShape::Tangents RtslShape::TangentsAt(const Normals &normals, Caller &caller) const {
    Tangents tangents;
    if (computeDerivatives) {
        caller.Call(computeDerivatives, block.data());
        tangents.dpdu = (*renderFromObject)(caller.Vector(RTSL_STATE_dPdu));
        tangents.dpdv = (*renderFromObject)(caller.Vector(RTSL_STATE_dPdv));
    } else
        CoordinateSystem(Vector3f(normals.geometric), &tangents.dpdu, &tangents.dpdv);
    return tangents;
}

Normal3f RtslShape::ToRender(Normal3f normal) const {
    Normal3f outward = Normalize((*renderFromObject)(normal));
    return reverseOrientation ? -outward : outward;
}

Point3fi RtslShape::ToRender(Point3f point, Float distance) const {
    Float uncertain = error + gamma(8) * distance;
    return (*renderFromObject)(Point3fi(point, Vector3f(uncertain, uncertain, uncertain)));
}

/// What densities of directions in the primitive's space are multiplied with for pbrt's: the Jacobian of directions under a
/// linear map is its stretch along the direction, cubed, over its determinant.
Float RtslShape::DensityScale(Vector3f world, Vector3f local) const {
    Float stretch = Length(world) / Length(local);
    return stretch * stretch * stretch / volumeScale;
}

pstd::optional<ShapeSample> RtslShape::Sample(const ShapeSampleContext &ctx, Point2f u) const {
    Caller &caller = Caller::Begin();
    Point3f origin = (*objectFromRender)(ctx.p());
    caller.Set(RTSL_STATE_RayOrigin, origin);
    caller.Set(RTSL_STATE_Epsilon, 0);
    caller.Set(RTSL_STATE_TimeSeed, ctx.time);
    caller.Call(generateSample, block.data(), rtsl::Numbers(u));
    Point3f local = caller.Point(RTSL_STATE_HitPoint);
    Normal3f normal = caller.Normal(RTSL_STATE_GeometricNormal);
    Point3fi point = ToRender(local, 0);
    Vector3f way = Point3f(point) - ctx.p();
    Float pdf = caller.Number(RTSL_STATE_PDF) * DensityScale(way, local - origin);
    if (!IsUsable(pdf) || !IsUsable(LengthSquared(normal)))
        return {};
    caller.Set(RTSL_STATE_GeometricNormal, Normalize(normal));
    Point2f uv = CoordinatesAt(Hit{origin, way, 1, local, ctx.time}, caller);
    return ShapeSample{Interaction(point, ToRender(normal), ctx.time, uv), pdf};
}

Float RtslShape::PDF(const ShapeSampleContext &ctx, Vector3f wi) const {
    pstd::optional<Hit> hit = Find(ctx.SpawnRay(wi), Infinity);
    if (!hit)
        return 0;
    Caller &caller = Caller::Current();
    NormalsAt(*hit, caller);
    Point3f origin = (*objectFromRender)(ctx.p());
    caller.Set(RTSL_STATE_RayOrigin, origin);
    caller.Call(samplePDF, block.data());
    Vector3f way = (*renderFromObject)(hit->point) - ctx.p();
    Float pdf = caller.Number(RTSL_STATE_PDF) * DensityScale(way, hit->point - origin);
    return IsUsable(pdf) ? pdf : 0;
}

pstd::optional<ShapeSample> RtslShape::Sample(Point2f u) const {
    ErrorExit("Class %s: RTSL shapes are sampled as seen from a point. Integrators that start paths at "
              "lights can't use them as lights; take \"path\" or \"volpath\".",
              ClassName());
}

Float RtslShape::PDF(const Interaction &) const {
    return 1 / Area();
}

// A line through a sphere of radius R meets a surface of area A within it A / (2 pi R^2) times on average (Cauchy and
// Crofton).
Float RtslShape::Area() const {
    if (!HasSamples())
        ErrorExit("Class %s can't be a light: it has no generateSample() and samplePDF().", ClassName());
    constexpr int lines = 4096, mostHits = 64;
    Point3f center;
    Float radius;
    Bounds().BoundingSphere(&center, &radius);
    RNG rng;
    int64_t hits = 0;
    for (int i = 0; i < lines; ++i) {
        Vector3f d = SampleUniformSphere({rng.Uniform<Float>(), rng.Uniform<Float>()});
        Point2f disk = SampleUniformDiskConcentric({rng.Uniform<Float>(), rng.Uniform<Float>()});
        Frame frame = Frame::FromZ(d);
        Point3f start = center + radius * (disk.x * frame.x + disk.y * frame.y - 2 * d);
        Ray ray(start, d);
        for (int hit = 0; hit < mostHits; ++hit) {
            pstd::optional<ShapeIntersection> found = Intersect(ray);
            if (!found)
                break;
            ++hits;
            ray = found->intr.SpawnRay(d);
        }
    }
    return 2 * Pi * radius * radius * hits / lines;
}

std::string RtslShape::ToString() const {
    return StringPrintf("[ RtslShape class: %s ]", ClassName());
}

}  // namespace pbrt
