//! `shade` of materials, called by integrators: as stages, and on the interpreter.

use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions, Messages};
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, RenderRequest, RenderResult};
use rtsl_scene::reader::MemoryFiles;

/// A material that makes each request of a renderer, in loops and branches, and a shape that is its own material, which
/// reads what its `intersect` has left.
const CLASSES: &str = "class Everything : rt_Material;
    public color tint = color(0.5);
    public int bounces = 2;
    void shade() {
        vec3 n = dot(rt_RayDirection, rt_ShadingNormal) < 0.0 ? rt_ShadingNormal : -rt_ShadingNormal;
        color sum = 0.1 * ambient() + 0.01 * rt_RayDepth;
        illuminance (rt_HitPoint, n, 1.2) {
            sum += tint * rt_LightColor * dot(n, rt_LightDirection) / (1.0 + rt_LightDistance)
                / (rt_PDF > 0.0 ? rt_PDF : 1.0);
            if (rgb(sum).x > 3.0) break;
        }
        for (int bounce = 0; bounce < bounces; ++bounce) {
            vec3 way = normalize(n + 0.5 * (vec3(rand(), rand(), rand()) - 0.5));
            if (rand() < 0.75 && !occluded(rt_HitPoint, way, 0.3)) {
                color light = trace(rt_HitPoint, way);
                sum += 0.25 * tint * light * (rgb(light).y > 0.4 ? rand() : 1.0);
            }
        }
        rt_SampleColor = sum;
    }

    class Endless : rt_Material;
    void shade() { for (;;) rt_SampleColor = color(rand()); }

    class Burst : rt_Material;
    void shade() {
        color sum = color(0.0);
        for (int ray = 0; ray < 4096; ++ray) {
            sum += trace(rt_HitPoint, vec3(rand(), rand(), rand()) - 0.5);
        }
        rt_SampleColor = sum;
    }

    class Rings : rt_Primitive, rt_Material;
    scratch float radius;
    void intersect() {
        float t = (1.5 - rt_RayOrigin.z) / rt_RayDirection.z;
        vec3 p = rt_RayOrigin + t * rt_RayDirection;
        if (length(p.xy) < 3.0 && hit(t)) radius = length(p.xy);
    }
    void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, -1.0); }
    void shade() {
        rt_SampleColor = color(fract(3.0 * radius));
        if (rt_RayDepth < 2.0) rt_SampleColor += 0.3 * trace(rt_HitPoint, rt_GeometricNormal);
    }";

const WORLD: &str = "WorldBegin
    LightSource \"SkyLight\"
    LightSource \"point\" \"rgb I\" [10 9 8] \"point3 from\" [2 4 -3]
    AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 4 4] Translate -1 3 0
      Shape \"sphere\" \"float radius\" 0.3 AttributeEnd
    Shape \"Rings\"
    Material \"Everything\"
    AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
    Material \"Everything\" \"rgb tint\" [0.7 0.2 0.1] \"integer bounces\" 1
    Shape \"Sphere\" \"point3 center\" [-1 0 0]
    Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 -1 1  1 -1 0  0.5 1 0.5  -1 -1 0]
    Material \"Phong\"
    ObjectBegin \"ball\" Material \"Dielectric\" Shape \"Sphere\" \"float radius\" 0.7 ObjectEnd
    AttributeBegin Translate 1 0 0 Scale 1 0.8 1 ObjectInstance \"ball\" AttributeEnd";

const CAMERA: &str = "LookAt 0 1 -6  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 40\n";

fn rendered(text: &str, how: RenderRequest<'_>) -> RenderResult {
    render(text, how).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn render(text: &str, how: RenderRequest<'_>) -> Result<RenderResult, Messages> {
    let files = [("scene.pbrt", text), ("own.rtsl", CLASSES)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request =
        RenderRequest { scene: Path::new("scene.pbrt").into(), size: Some((13, 9)), ..how };
    render_scene_from(&request, &MemoryFiles(files.into()))
}

fn bits(result: &RenderResult) -> Vec<u32> {
    result.image.pixels.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Also where an integrator that scatters light meets materials that have nothing but `shade`.
#[test]
fn shade_has_one_result() {
    for (integrator, sampler) in [("Whitted", "independent"), ("Path", "sobol")] {
        let head = format!("Sampler \"{sampler}\"\nIntegrator \"{integrator}\"");
        let text = format!("{CAMERA}{head}\n{WORLD}");
        let make = |backend: Backend, width: u32, threads: usize| {
            let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
            let execution = Execution::on_threads(threads);
            let request = RenderRequest { samples: Some(3), ..RenderRequest::default() };
            bits(&rendered(&text, RenderRequest { engine, execution, ..request }))
        };
        let reference = make(Backend::Interpreter, 1, 1);
        assert!(reference.iter().any(|bits| f32::from_bits(*bits) > 0.0));
        for (width, threads) in [(1, 1), (4, 2), (8, 1), (16, 3)] {
            let found = make(Backend::Auto, width, threads);
            assert!(found == reference, "{integrator}, width {width}, {threads} threads");
        }
    }
}

/// Renders a scene by the class `Whitted` with stages of these widths, and compares it with the interpreter.
fn assert_one_result(text: &str) {
    let make = |backend: Backend, width: u32| {
        let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        let request = RenderRequest { samples: Some(2), ..RenderRequest::default() };
        bits(&rendered(text, RenderRequest { engine, ..request }))
    };
    let reference = make(Backend::Interpreter, 1);
    assert!(reference.iter().any(|bits| f32::from_bits(*bits) > 0.0));
    for width in [1, 8, 16] {
        assert!(make(Backend::Auto, width) == reference, "width {width}:\n{text}");
    }
}

/// Each path names the lights one after another: those of one class differ in their members, some are shapes, some
/// are found by no ray, one never reaches a surface, and one is transformed.
#[test]
fn lights_that_shade_names_have_one_result() {
    let point = |index: usize| {
        format!("LightSource \"point\" \"rgb I\" [{index} 2 1] \"point3 from\" [{index} 4 -3]\n")
    };
    let several = "LightSource \"distant\" \"rgb L\" [1 2 3] \"point3 from\" [1 3 -1]
        LightSource \"spot\" \"rgb I\" [9 1 4] \"point3 from\" [1 3 -2] \"float coneangle\" 50
        LightSource \"point\" \"rgb I\" [0 0 0]
        AttributeBegin Scale 2 1 1 LightSource \"point\" \"rgb I\" [4 5 6] \"point3 from\" [1 3 0] AttributeEnd
        AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [2 3 4] Translate 2 3 0
          Shape \"disk\" \"float radius\" 0.5 AttributeEnd\n";
    for (sampler, lights) in [
        ("\"independent\"", format!("{}{several}{}", point(1), point(3))),
        ("\"stratified\" \"integer xsamples\" 4 \"integer ysamples\" 1", several.to_owned()),
        ("\"stratified\" \"integer xsamples\" 3 \"integer ysamples\" 1", point(2)),
        ("\"sobol\"", (0..15).map(point).collect()),
        ("\"sobol\"", String::new()),
    ] {
        let world = WORLD.replace("WorldBegin", &format!("WorldBegin\n{lights}"));
        let head = format!("Sampler {sampler}\nIntegrator \"Whitted\"");
        assert_one_result(&format!("{CAMERA}{head}\n{world}"));
    }
    let without = "WorldBegin Material \"Everything\" Shape \"Sphere\"";
    assert_one_result(&format!("{CAMERA}Integrator \"Whitted\"\n{without} Shape \"Rings\""));
}

#[test]
fn endless_loops_are_told_by_the_class_of_the_material() {
    let text = format!(
        "{CAMERA}Integrator \"Whitted\" \"integer budget\" 1000
        WorldBegin Material \"Endless\" Shape \"Sphere\""
    );
    for backend in [Backend::Auto, Backend::Interpreter] {
        let engine = EngineOptions { backend, ..EngineOptions::default() };
        let request = RenderRequest { samples: Some(1), ..RenderRequest::default() };
        let said = render(&text, RenderRequest { engine, ..request }).err();
        let said = said.map_or_else(String::new, |messages| messages.to_text(false));
        assert!(said.contains("`Endless`") && said.contains("shade"), "{said}");
    }
}

/// Rays from within a sphere whose points trace thousands of rays each.
#[test]
fn rays_that_become_too_many_end_the_render() {
    let text = format!(
        "{CAMERA}Integrator \"interactive\" \"integer maxdepth\" 8
        WorldBegin Material \"Burst\" Shape \"Sphere\" \"float radius\" 50"
    );
    let request = RenderRequest { samples: Some(1), size: Some((4, 4)), ..Default::default() };
    let said = render(&text, request).err();
    let said = said.map_or_else(String::new, |messages| messages.to_text(false));
    assert!(said.contains("error[E0643]: the rays that `trace` traces become too many"), "{said}");
}
