//! Materials whose `shade` asks for surfaces, and the types of rays that materials and integrators know.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions, Messages};
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, RenderRequest, RenderResult};
use rtsl_scene::reader::MemoryFiles;

/// Wax shows how thick it is, from the distance and the normal of its other side. `Worn` is brighter where surfaces
/// close by turn away: it searches in random directions, traces a ray, and searches towards lights. `Gauge` goes on
/// from the surfaces that it finds.
const CLASSES: &str = "class Wax : rt_Material;
    public float depth = 0.5;
    void shade() {
        rt_Surface back = nearestHit(rt_HitPoint, -rt_GeometricNormal);
        rt_SampleColor = color(0.1);
        if (back.found) {
            float facing = dot(back.geometricNormal, rt_GeometricNormal);
            rt_SampleColor += color(exp(-back.distance / depth), abs(facing), 0.1 * float(back.object));
            rt_SampleColor += 0.1 * color(back.uv.x, back.uvw.y, length(back.point - rt_HitPoint));
        }
    }

    class Worn : rt_Material;
    public float radius = 0.5;
    void shade() {
        float open = 0.0;
        for (int probe = 0; probe < 3; ++probe) {
            vec3 direction = normalize(vec3(rand(), rand(), rand()) * 2.0 - 1.0);
            rt_Surface near = nearestHit(rt_HitPoint, direction, radius);
            if (near.found) open += 0.5 - 0.5 * dot(near.shadingNormal, rt_ShadingNormal);
        }
        rt_SampleColor = color(open) + 0.5 * trace(rt_HitPoint, rt_GeometricNormal);
        illuminance {
            rt_Surface behind = nearestHit(rt_HitPoint, rt_LightDirection);
            if (!behind.found) rt_SampleColor += 0.1 * rt_LightColor * rand();
        }
    }

    class Gauge : rt_Material;
    void shade() {
        rt_Surface surface = nearestHit(rt_HitPoint, rt_RayDirection, 100.0, 0.01, 0.02);
        float passed = 0.0;
        for (int count = 0; surface.found && count < 4; ++count) {
            passed += surface.distance + surface.du + float(surface.occluded(vec3(0.0, 1.0, 0.0), 2.0));
            surface = surface.follow(surface.direction, 0.0);
        }
        rt_SampleColor = color(passed, float(surface.object), 0.1 * surface.distance);
    }

    class Typed : rt_Material;
    void shade() {
        rt_SampleColor = color(float(rt_RayType == rt_CAMERA_RAY), float(rt_RayType == rt_SCATTERED_RAY),
            float(rt_RayType == rt_TRACED_RAY));
    }

    class Mirror : rt_Material;
    void shade() { rt_SampleColor = trace(rt_HitPoint, reflect(rt_RayDirection, rt_GeometricNormal)); }

    class ShowTypes : rt_Integrator;
    void radiance() {
        rt_Surface surface = nearestHit();
        rt_SampleColor = 0.125 * color(rt_RayType);
        if (surface.found) rt_SampleColor += surface.shade();
        rt_Surface next = surface.found ? surface.follow(vec3(0.0, 1.0, 0.0), 0.0) : surface;
        if (next.found) rt_SampleColor += 0.5 * next.shade();
    }

    class Scattering : rt_Integrator;
    void radiance() {
        rt_Surface surface = nearestHit();
        for (int count = 0; surface.found && count < 3; ++count) {
            rt_BSDFSample next = surface.sampleBSDF(vec3(sample2D(count), sample1D(count)));
            rt_SampleColor += next.weight;
            surface = surface.follow(next.direction, next.density);
        }
    }

    class TypedMatte : rt_Material;
    void BSDF() {
        float cosine = dot(rt_LightDirection, rt_ShadingNormal);
        rt_BSDFValue = color(cosine > 0.0 ? (0.1 + 0.1 * rt_RayType) / 3.14159265 : 0.0);
    }";

const CAMERA: &str = "LookAt 0 1 -6  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 40\n";

/// Balls, a mesh and an instance of these materials on a floor, one of whose walls lets rays pass in places.
const WORLD: &str = "WorldBegin
    LightSource \"point\" \"rgb I\" [10 9 8] \"point3 from\" [2 4 -3]
    Material \"Worn\"
    AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
    Material \"Wax\"
    AttributeBegin Translate -1 0 0 Rotate 30 1 1 0 Scale 0.8 1 0.6 Shape \"sphere\" AttributeEnd
    Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 -1 1  1 -1 0  0.5 1 0.5  -1 -1 0]
    Material \"Wax\" \"float depth\" 0.25 Shape \"Sphere\" \"point3 center\" [2 0 0] \"float radius\" 0.5
    Material \"Gauge\" Shape \"Sphere\" \"point3 center\" [0 0 -1] \"float radius\" 0.4
    ObjectBegin \"ball\" Material \"Gauge\" Shape \"Sphere\" \"float radius\" 0.7 ObjectEnd
    AttributeBegin Translate 1 0 0 Scale 1 0.8 1 ObjectInstance \"ball\" AttributeEnd\n";

/// A wall with holes.
const HOLES: &str = "Texture \"holes\" \"float\" \"checkerboard\" \"float uscale\" 8 \"float vscale\" 8
      \"float tex1\" 0 \"float tex2\" 1
    AttributeBegin Translate 0 0 0.5
      Shape \"bilinearmesh\" \"point3 P\" [-2 -1 0  2 -1 0  -2 2 0  2 2 0] \"texture alpha\" \"holes\"
    AttributeEnd\n";

fn render(text: &str, how: RenderRequest<'_>) -> Result<RenderResult, Messages> {
    let files = [("scene.pbrt", text), ("own.rtsl", CLASSES)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: Path::new("scene.pbrt").into(),
        size: Some((13, 9)),
        samples: Some(4),
        ..how
    };
    render_scene_from(&request, &MemoryFiles(files.into()))
}

fn rendered(text: &str, backend: Backend, width: u32, threads: usize) -> RenderResult {
    let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
    let execution = Execution::on_threads(threads);
    let result = render(text, RenderRequest { engine, execution, ..RenderRequest::default() });
    result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn bits(result: &RenderResult) -> Vec<u32> {
    result.image.pixels.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Compares stages with the interpreter, and returns the picture.
fn one_result(text: &str) -> RenderResult {
    let reference = rendered(text, Backend::Interpreter, 1, 1);
    for (width, threads) in [(1, 2), (4, 1), (8, 3), (16, 1)] {
        let made = rendered(text, Backend::Auto, width, threads);
        assert!(bits(&made) == bits(&reference), "width {width}, {threads} threads\n{text}");
    }
    reference
}

/// `Path` asks hosts for the light of materials that have nothing but `shade`.
#[test]
fn surfaces_of_materials_have_one_result() {
    for (integrator, holes) in [("Whitted", ""), ("Path", ""), ("Whitted", HOLES)] {
        let picture = one_result(&format!("{CAMERA}Integrator \"{integrator}\"\n{WORLD}{holes}"));
        let different: BTreeSet<u32> = bits(&picture).into_iter().collect();
        assert!(different.len() > 100, "{integrator}: {}", different.len());
    }
}

/// In the middle of a ball, the way through it is its diameter; it ends on the same object, whose normal is opposite.
#[test]
fn thickness_is_the_distance_to_the_other_side() {
    let text =
        "LookAt 0 0 -6  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 1\nIntegrator \"Whitted\"\n
         WorldBegin Material \"Wax\" \"float depth\" 1 Shape \"Sphere\" \"float radius\" 0.5";
    let result = one_result(text);
    let [red, green, blue] = result.image.pixels[13 * 4 + 6].map(|it| it - 0.1);
    assert!((red - 1.0 / std::f32::consts::E).abs() < 0.11, "{red}");
    assert!((green - 1.0).abs() < 0.11, "{green}");
    assert!((blue - 0.1).abs() < 1e-3, "{blue}");
}

/// A camera sees its own rays at first surfaces, scattered ones behind, and traced ones in mirrors.
#[test]
fn materials_and_integrators_know_the_types_of_rays() {
    let of = |integrator: &str, material: &str| {
        let text = format!(
            "LookAt 0 2 -6  0 1 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 20\nIntegrator \"{integrator}\"\n
             WorldBegin Material \"{material}\" AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
             Material \"Typed\" AttributeBegin Translate 0 30 0 Shape \"Plane\" AttributeEnd"
        );
        one_result(&text).image.pixels[13 * 8 + 6]
    };
    // The floor is seen by the camera, and the ceiling by a scattered ray.
    assert_eq!(of("ShowTypes", "Typed"), [1.0, 0.5, 0.0]);
    // The ray that the mirror traces has a type of its own, and those that its integrator searches along are scattered.
    let [red, green, blue] = of("ShowTypes", "Mirror");
    assert_eq!((red, blue), (0.25, 1.25), "{green}");
}

#[test]
fn scattering_depends_on_the_type_of_the_ray() {
    let world = "WorldBegin LightSource \"SkyLight\" Material \"TypedMatte\"
        AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
        Shape \"Sphere\" \"point3 center\" [-1 0 0] Shape \"Sphere\" \"point3 center\" [1 0 0]
        Material \"Mirror\" Shape \"Sphere\" \"point3 center\" [0 2 0]";
    for integrator in ["Scattering", "Path", "Whitted"] {
        one_result(&format!("{CAMERA}Integrator \"{integrator}\"\n{world}"));
    }
}
