//! Integrators written in RTSL: those of the library, and some of a scene's own.

use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions, Messages};
use rtsl_image::Aov;
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, RenderRequest, RenderResult};
use rtsl_scene::INTERACTIVE;
use rtsl_scene::reader::MemoryFiles;
use rtsl_testing::turns::ways;

/// A ball of brushed metal and a glass ball on a floor, lit by a sky, a point and a lamp.
const WORLD: &str = "WorldBegin
    LightSource \"SkyLight\"
    LightSource \"point\" \"rgb I\" [10 9 8] \"point3 from\" [2 4 -3]
    AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 4 4] Translate -1 3 0
      Shape \"sphere\" \"float radius\" 0.3 AttributeEnd
    Material \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]
    AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
    Material \"Ward\" Shape \"Sphere\" \"point3 center\" [-1 0 0]
    Material \"Dielectric\" Shape \"Sphere\" \"point3 center\" [1 0 0]";

const CAMERA: &str = "LookAt 0 1 -6  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 40\n";

/// Renders the scene with these classes beside it.
fn render(head: &str, classes: &str, how: RenderRequest<'_>) -> Result<RenderResult, Messages> {
    render_files(&format!("{CAMERA}{head}\n{WORLD}"), classes, how)
}

fn rendered(head: &str, classes: &str, how: RenderRequest<'_>) -> RenderResult {
    render(head, classes, how).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

/// Renders a scene with no class beside it.
fn rendered_text(text: &str, how: RenderRequest<'_>) -> RenderResult {
    rendered_files(text, "", how)
}

/// Renders a scene with these classes beside it.
fn rendered_files(text: &str, classes: &str, how: RenderRequest<'_>) -> RenderResult {
    let result = render_files(text, classes, how);
    result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn render_files(
    text: &str,
    classes: &str,
    how: RenderRequest<'_>,
) -> Result<RenderResult, Messages> {
    let files = [("scene.pbrt", text), ("own.rtsl", classes)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request =
        RenderRequest { scene: Path::new("scene.pbrt").into(), size: Some((13, 9)), ..how };
    render_scene_from(&request, &MemoryFiles(files.into()))
}

fn samples(count: u32) -> RenderRequest<'static> {
    RenderRequest { samples: Some(count), ..RenderRequest::default() }
}

fn mean(result: &RenderResult) -> f64 {
    let values = result.image.pixels.iter().flatten().map(|value| f64::from(*value));
    values.sum::<f64>() / (3 * result.image.pixels.len()) as f64
}

fn bits(result: &RenderResult) -> Vec<u32> {
    result.image.pixels.iter().flatten().map(|value| value.to_bits()).collect()
}

#[test]
fn the_library_draws_what_the_renderers_draw() {
    let paths = rendered("Integrator \"path\" \"integer maxdepth\" 5", "", samples(256));
    let class = rendered("Integrator \"Path\"", "", samples(16));
    assert!((mean(&class) / mean(&paths) - 1.0).abs() < 0.04, "{} {}", mean(&class), mean(&paths));
    let interactive =
        RenderRequest { load: LoadOptions::with_integrator(INTERACTIVE), ..samples(64) };
    let shaded = rendered("", "", interactive);
    let class = rendered("Integrator \"Whitted\"", "", samples(4));
    assert!(
        (mean(&class) / mean(&shaded) - 1.0).abs() < 0.04,
        "{} {}",
        mean(&class),
        mean(&shaded)
    );
}

#[test]
fn pictures_have_the_same_bits_however_they_are_made() {
    let make = |backend: Backend, width: u32, threads: usize| {
        let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        let execution = Execution::on_threads(threads);
        let how = RenderRequest { engine, execution, ..samples(3) };
        bits(&rendered("Integrator \"Path\" \"integer maxDepth\" 3", "", how))
    };
    let reference = make(Backend::Interpreter, 1, 1);
    for (width, threads) in [(1, 2), (4, 1), (8, 3), (16, 1)] {
        assert!(
            make(Backend::Auto, width, threads) == reference,
            "width {width}, {threads} threads"
        );
    }
}

/// One thread takes wavefronts of several tiles, many threads of one; the image's last tiles are not full.
#[test]
fn pictures_do_not_depend_on_the_tiles_of_wavefronts() {
    for count in [1, 3] {
        let make = |threads: usize| {
            let execution = Execution::on_threads(threads);
            let how = RenderRequest { execution, size: Some((131, 99)), ..samples(count) };
            bits(&rendered("Integrator \"Path\"", "", how))
        };
        assert!(make(1) == make(28), "{count} samples");
    }
}

/// Lights and shapes that stages are linked with, in spaces of their own, beside some that they are not: a mesh, and an
/// instance. The pyramid's texture takes its width from the ray's footprint.
const PLACED: &str = "WorldBegin
    AttributeBegin Rotate 40 0 0 1 LightSource \"infinite\" \"rgb L\" [0.4 0.5 0.7] AttributeEnd
    LightSource \"distant\" \"rgb L\" [1 1 0.8]
    AttributeBegin Translate 2 4 -3 Scale 2 2 2 LightSource \"point\" \"rgb I\" [10 9 8] AttributeEnd
    Texture \"checks\" \"spectrum\" \"checkerboard\" \"float uscale\" 8 \"float vscale\" 8
    Material \"diffuse\" \"texture reflectance\" \"checks\"
    AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
    AttributeBegin Translate -1 0 0 Rotate 30 1 1 0 Scale 0.8 1 0.6 ReverseOrientation
      Shape \"sphere\" AttributeEnd
    Material \"Ward\"
    Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 -1 1  1 -1 0  0.5 1 0.5  -1 -1 0]
    ObjectBegin \"ball\" Material \"Dielectric\" Shape \"Sphere\" \"float radius\" 0.7 ObjectEnd
    AttributeBegin Translate 1 0 0 Scale 1 0.8 1 ObjectInstance \"ball\" AttributeEnd";

/// Stages compute to the bit what the interpreter computes, with each kind of sampler.
#[test]
fn every_integrator_of_the_library_has_one_result() {
    let samplers = ["independent", "stratified", "sobol"];
    let integrators: [(&str, &[&str]); 7] = [
        ("Path", &["albedo", "normal", "distance"]),
        ("Direct", &["albedo", "normal", "object"]),
        ("Whitted", &["normal", "distance"]),
        ("AmbientOcclusion", &["albedo", "normal"]),
        ("Normals", &["class"]),
        ("Albedo", &["distance"]),
        ("Depth", &["depth", "distance"]),
    ];
    let samplers = samplers.into_iter().cycle();
    for (index, ((integrator, aovs), sampler)) in integrators.into_iter().zip(samplers).enumerate()
    {
        let head = format!("Sampler \"{sampler}\"\nIntegrator \"{integrator}\"");
        let text = format!("{CAMERA}{head}\n{PLACED}");
        let make = |backend: Backend, width: u32| {
            let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
            let aovs = aovs.iter().map(|name| Aov::from_name(name)).collect();
            let result = rendered_text(&text, RenderRequest { engine, aovs, ..samples(4) });
            let aovs = result.aovs.iter().flat_map(|aov| &aov.values);
            let all = result.image.pixels.iter().flatten().chain(aovs);
            all.map(|value| value.to_bits()).collect::<Vec<u32>>()
        };
        let reference = make(Backend::Interpreter, 1);
        for width in ways(&[4, 16], index) {
            assert!(make(Backend::Auto, width) == reference, "{integrator}, {sampler}, {width}");
        }
    }
}

/// Few shapes of many classes, among which kernels search; two balls coincide, so hits tie.
const FEW: &str = "WorldBegin
    LightSource \"point\" \"rgb I\" [30 30 30] \"point3 from\" [2 4 -3]
    LightSource \"infinite\" \"rgb L\" [0.4 0.5 0.7]
    Material \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]
    AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
    AttributeBegin Translate -1 0 0 Rotate 40 1 1 0 Shape \"Torus\" AttributeEnd
    AttributeBegin Translate 1 0 0 Shape \"disk\" \"float radius\" 0.7 AttributeEnd
    Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]
      \"point3 P\" [-1 -1 1  1 -1 1  1 1 1.5  -1 1 1]
    Shape \"bilinearmesh\" \"point3 P\" [-1 1 0  0 1.5 0  -1 1.2 1  0 1 1]
    Shape \"Sphere\" \"point3 center\" [0 -0.5 -1] \"float radius\" 0.5
    Material \"diffuse\" \"rgb reflectance\" [0.1 0.9 0.1]
    Shape \"Sphere\" \"point3 center\" [0 -0.5 -1] \"float radius\" 0.5";

#[test]
fn kernels_find_the_hits_of_hierarchies() {
    let text = format!("{CAMERA}Integrator \"Path\" \"integer maxDepth\" 3\n{FEW}");
    let make = |backend: Backend, width: u32| {
        let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        bits(&rendered_text(&text, RenderRequest { engine, ..samples(8) }))
    };
    let reference = make(Backend::Interpreter, 1);
    for width in [1, 4, 8, 16] {
        assert!(make(Backend::Auto, width) == reference, "width {width}");
    }
}

/// An integrator that waits for an answer about visibility; one that contributes several times, and in a loop; and one
/// that goes on from surfaces to others without light.
const SEARCHING: &str = "
class Asking : rt_Integrator;
output float seen;
void radiance() {
    rt_Surface surface = nearestHit();
    if (!surface.found) return;
    vec3 up = vec3(0.3, 1.0, -0.2);
    vec3 origin = surface.leave(up);
    bool isDark = occluded(origin, up, 3.0);
    rt_Surface next = surface.follow(up, 0.0);
    seen = (isDark ? 1.0 : 0.0) + (next.found ? 2.0 : 0.0);
    rt_SampleColor = color(isDark ? 0.2 : 0.8, next.found ? next.distance : 0.0, 0.5);
}
class Repeating : rt_Integrator;
void radiance() {
    rt_Surface surface = nearestHit();
    for (int bounce = 0; surface.found && bounce < 3; ++bounce) {
        for (int light = 0; light < 3; ++light) {
            rt_LightSample sampled = surface.sampleLight(sample1D(4 * bounce + light));
            if (sampled.found) surface.contribute(sampled.direction, sampled.distance, sampled.light * 0.1);
        }
        surface.contribute(vec3(0.0, 1.0, 0.0), 2.0, color(0.1 * float(bounce)));
        surface = surface.follow(reflect(surface.direction, surface.shadingNormal), 0.0);
    }
}
class Wandering : rt_Integrator;
void radiance() {
    rt_Surface surface = nearestHit();
    float way = 0.0;
    for (int count = 0; surface.found && count < 5; ++count) {
        way += surface.distance;
        surface = count % 2 == 0 ? surface.follow(surface.direction, 0.0)
            : nearestHit(surface.point + vec3(0.0, 0.5, 0.0), vec3(0.1, -1.0, 0.0));
    }
    rt_SampleColor = color(way);
}
";

#[test]
fn searches_of_stages_have_one_result_and_are_counted() {
    let integrators = ["Asking", "Repeating", "Wandering", "Path", "Direct", "Whitted"];
    for (index, integrator) in integrators.into_iter().enumerate() {
        let text = format!("{CAMERA}Integrator \"{integrator}\"\n{FEW}");
        let make = |backend: Backend, width: u32, aovs: &[Aov]| {
            let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
            let how = RenderRequest { engine, aovs: aovs.to_vec(), ..samples(4) };
            let result = rendered_files(&text, SEARCHING, how);
            let values =
                result.aovs.iter().flat_map(|aov| aov.values.iter().map(|it| it.to_bits()));
            let rays = result.statistics.rays;
            (bits(&result), values.collect::<Vec<u32>>(), (rays.traced, rays.shadow))
        };
        let all = [Aov::Distance, Aov::Object];
        let reference = make(Backend::Interpreter, 1, &all);
        let widths = [1, 4, 8, 16];
        for width in ways(&widths, index) {
            let found = make(Backend::Auto, width, &all);
            assert!(found == reference, "{integrator}, {width}: {:?} {:?}", found.2, reference.2);
        }
        for width in ways(&widths, index + 2) {
            let alone = make(Backend::Auto, width, &[]);
            assert!((alone.0, alone.2) == (reference.0.clone(), reference.2), "{integrator}");
        }
    }
}

/// Highlights are widened alike by stages and by hosts, which the glass of the instance asks.
#[test]
fn regularization_has_one_result() {
    let metal = "Material \"conductor\" \"float roughness\" 0.01
        AttributeBegin Translate 0 0 -1 Shape \"sphere\" \"float radius\" 0.4 AttributeEnd";
    let make = |regularize: bool, backend: Backend, width: u32| {
        let integrator = format!("Integrator \"path\" \"bool regularize\" {regularize}");
        let text = format!("{CAMERA}{integrator}\n{PLACED}\n{metal}");
        let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        bits(&rendered_text(&text, RenderRequest { engine, ..samples(4) }))
    };
    let reference = make(true, Backend::Interpreter, 1);
    for width in [4, 16] {
        assert!(make(true, Backend::Auto, width) == reference, "{width}");
    }
    assert!(make(false, Backend::Auto, 16) != reference);
}

/// Scenes with lights that stages are linked with: shapes, moved, scaled, turned round, textured, cut out or placed by
/// instances, beside others.
const LIGHTS: [(&str, &str); 9] = [
    (
        "one quad",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]
           Shape \"bilinearmesh\" \"point3 P\" [-1 3 -1  0.5 3 -1  -1 3 0.5  0.5 3 0.5] AttributeEnd",
    ),
    (
        "a scaled ball, and a quad that shines on both sides",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]
           Translate -1 2.5 0 Rotate 30 1 1 0 Scale 0.4 0.2 0.6 Shape \"sphere\" AttributeEnd
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [2 4 6] \"bool twosided\" true
           Translate 2 1 0 Rotate 70 0 0 1 Scale 0.5 1 2
           Shape \"bilinearmesh\" \"point3 P\" [-1 0 -1  1 0 -1  -1 0 1  1 0 1] AttributeEnd",
    ),
    (
        "two shapes of one class, a point and a sky",
        "LightSource \"infinite\" \"rgb L\" [0.2 0.3 0.4]
         LightSource \"point\" \"rgb I\" [10 9 8] \"point3 from\" [2 4 -3]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]
           Translate -1 2.5 0 Scale 0.2 0.2 0.2 Shape \"sphere\" AttributeEnd
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 8 3]
           Translate 1.5 0.5 -1 Scale 0.3 0.2 0.3 ReverseOrientation Shape \"sphere\" AttributeEnd",
    ),
    (
        "seven lights, of which one is at infinity and one is never hit",
        "LightSource \"distant\" \"rgb L\" [0.5 0.5 0.4]
         LightSource \"point\" \"rgb I\" [3 2 1] \"point3 from\" [2 4 -3]
         LightSource \"spot\" \"rgb I\" [9 9 9] \"point3 from\" [-2 3 -3] \"point3 to\" [0 0 0]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]
         Shape \"sphere\" \"float radius\" 0.1
         AttributeBegin Translate 1 1 0 Shape \"disk\" \"float radius\" 0.5 AttributeEnd
         AttributeBegin Translate 0 2 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 0.4 AttributeEnd
         AttributeBegin Translate -2 1 0 Shape \"sphere\" \"float radius\" 0.2 \"float alpha\" 0 AttributeEnd
         AttributeEnd",
    ),
    (
        "a ball with a texture",
        "AttributeBegin AreaLightSource \"Glow\" Translate -1 2.5 0 Rotate 30 1 1 0 Scale 0.4 0.6 0.6
           Shape \"Sphere\" AttributeEnd
         AttributeBegin AreaLightSource \"Glow\" Translate 2 2 0
           Shape \"bilinearmesh\" \"point3 P\" [-1 0 -1  1 0 -1  -1 0 1  1 0 1] AttributeEnd",
    ),
    (
        "elements of meshes in and out of the world's space",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 2 1 3]
             \"point3 P\" [-1 3 -1  0.5 3 -1  -1 3 0.5  0.5 2.5 0.5] AttributeEnd
         AttributeBegin AreaLightSource \"Glow\" Translate 2 1 0 Rotate 70 0 0 1 Scale 0.5 1 2
           Shape \"bilinearmesh\" \"integer indices\" [0 1 2 3  2 3 4 5]
             \"point3 P\" [-1 0 -1  1 0 -1  -1 0 0  1 0 0  -1 0.5 1  1 0 1] AttributeEnd",
    ),
    (
        "meshes of one class, whose arrays differ, and emitters whose arrays do",
        "AttributeBegin AreaLightSource \"Palette\" \"float shades\" [1 2 3]
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 2 1 3]
             \"point3 P\" [-1 3 -1  0.5 3 -1  -1 3 0.5  0.5 2.5 0.5] \"point2 uv\" [0 0  1 0  0 1  1 1] AttributeEnd
         AttributeBegin AreaLightSource \"Palette\" \"float shades\" [0.5]
           Shape \"trianglemesh\" \"point3 P\" [2 3 -1  2 2 -1  2 3 0.5]
             \"normal N\" [-1 0 0  -1 0.2 0  -1 0 0.2] AttributeEnd
         AttributeBegin AreaLightSource \"Palette\" \"float shades\" [4 3 2 1 0]
           Shape \"trianglemesh\" \"integer indices\" [0 1 2  2 1 0  1 2 3]
             \"point3 P\" [-2 1 -2  -2 2 -2  -1 1 -3  -1 2 -3] AttributeEnd",
    ),
    (
        "shapes that textures cut out, of which one reads the surface and draws a number",
        "Texture \"holes\" \"float\" \"Holes\"
         LightSource \"infinite\" \"rgb L\" [0.2 0.3 0.4]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]
           Shape \"bilinearmesh\" \"point3 P\" [-1 3 -1  0.5 3 -1  -1 3 0.5  0.5 3 0.5]
             \"texture alpha\" \"holes\"
           Translate 2 1 0 Shape \"sphere\" \"float radius\" 0.3 \"float alpha\" 0.5 AttributeEnd
         AttributeBegin AreaLightSource \"Glow\" Translate -1 2.5 0 Scale 0.4 0.6 0.6
           Shape \"Sphere\" \"texture alpha\" \"holes\" AttributeEnd",
    ),
    (
        "shapes in groups, which instances place",
        "ObjectBegin \"lamp\"
           AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]
           AttributeBegin Scale 0.2 0.3 0.2 Shape \"sphere\" AttributeEnd
           AreaLightSource \"Glow\"
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 2 1 3] \"float alpha\" 0.75
             \"point3 P\" [-0.5 -0.4 -0.5  0.5 -0.4 -0.5  -0.5 -0.4 0.5  0.5 -0.2 0.5]
         ObjectEnd
         AttributeBegin Translate -1 2.5 0 Rotate 30 1 1 0 Scale 1 0.5 2 ObjectInstance \"lamp\" AttributeEnd
         AttributeBegin Translate 2 1 0 ObjectInstance \"lamp\" AttributeEnd",
    ),
];

/// A texture that draws a number and reads where it is.
const HOLES: &str = "class Holes : rt_Texture;
    void lookup() { rt_FloatTextureValue = 2.0 * rt_TextureUV.x - 0.5 * rand(); }";

/// An emitter whose radiance varies over the shape, and draws a number.
const GLOW: &str = "class Glow : rt_Material;
    void emission() {
        float stripe = fract(4.0 * rt_TextureUV.x + 3.0 * rt_TextureUV.y);
        rt_EmissionColor = color(4.0 * stripe, 3.0, rand())
            * (0.5 + 0.5 * abs(normalize(rt_dPdu).x) + rt_du + 0.1 * abs(rt_ShadingNormal.y));
    }";

/// An emitter with an array, of which it reads elements that are not there.
const PALETTE: &str = "class Palette : rt_Material;
    public float shades[];
    void emission() {
        int shade = int(6.0 * rt_TextureUV.x) - 1;
        rt_EmissionColor = color(shades[shade], 1.0 + float(shades.length()), 1.0 + shades[0])
            + color(0.1 * abs(rt_ShadingNormal));
    }";

/// The surfaces beside lights: a floor, a ball in a space of its own, a mesh and glass.
const LIT: &str = "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]
      AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
      AttributeBegin Translate -1 0 0 Rotate 30 1 1 0 Scale 0.8 1 0.6 Shape \"sphere\" AttributeEnd
      Material \"Ward\"
      Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 -1 1  1 -1 0  0.5 1 0.5  -1 -1 0]
      Material \"Dielectric\" AttributeBegin Translate 1 0 0 Shape \"Sphere\" \"float radius\" 0.6 AttributeEnd
    AttributeEnd";

/// Asks for densities of points that are not the origins of rays, and for samples with numbers out of range.
const DENSITIES: &str = "class Densities : rt_Integrator;
    void radiance() {
        rt_Surface s = nearestHit();
        if (!s.found) return;
        rt_SampleColor = s.lightEmission() * 0.1;
        rt_SampleColor += color(s.lightPDF(s.origin), s.lightPDF(vec3(0.0, 0.5, 0.25)), s.lightPDF(s.point));
        for (int i = -1; i < 5; ++i) {
            rt_LightSample light = s.sampleLight(float(i) / 3.0 + 0.1 * sample1D(0));
            rt_SampleColor += light.light * 0.1 + color(light.density, min(light.distance, 10.0), 0.0);
        }
        rt_SampleColor += s.sampleLight(sqrt(-1.0 - abs(s.origin.x))).light;
    }";

#[test]
fn stages_sample_lights_as_hosts_do() {
    let samplers = ["independent", "stratified", "sobol", "halton"];
    let integrators = [("Path", [4, 16]), ("Densities", [1, 8])];
    let mut samplers = samplers.into_iter().cycle();
    for (index, (name, lights)) in LIGHTS.into_iter().enumerate() {
        for (integrator, widths) in integrators {
            let sampler = samplers.next().unwrap_or_default();
            let head = format!("Sampler \"{sampler}\"\nIntegrator \"{integrator}\"");
            let text = format!("{CAMERA}{head}\nWorldBegin\n{lights}\n{LIT}");
            let classes = [GLOW, PALETTE, HOLES, DENSITIES].join("\n");
            let make = |backend: Backend, width: u32| {
                let width = Some(width);
                let engine = EngineOptions { backend, width, ..EngineOptions::default() };
                bits(&rendered_files(&text, &classes, RenderRequest { engine, ..samples(4) }))
            };
            let reference = make(Backend::Interpreter, 1);
            assert!(reference.iter().any(|word| *word != 0), "{name}, {integrator}: black");
            for width in ways(&widths, index) {
                let made = make(Backend::Auto, width);
                assert!(made == reference, "{name}, {integrator}, {sampler}, {width}");
            }
        }
    }
}

/// A material whose methods draw numbers, as many as the direction decides.
const GRAIN: &str = "class Grain : rt_Material;
    void emission() { rt_EmissionColor = color(0.1 * rand(), 0.2 * rand(), 0.0); }
    void BSDF() { rt_BSDFValue = color(0.2 + 0.1 * rand()); }
    void evaluatePDF() { rt_PDF = max(0.0, dot(rt_LightDirection, rt_ShadingNormal)) * 0.318; }
    void sampleBSDF() {
        vec3 to = rt_ShadingNormal + vec3(rand(), rand(), rand()) - vec3(0.5);
        if (to.x > 0.0) to.y += 0.1 * rand();
        rt_LightDirection = normalize(to);
        rt_BSDFValue = color(0.3 + 0.3 * rand());
        rt_PDF = 0.3;
    }";

/// A shape that is its own material and draws a number. Stages are not linked with it, since it reads what `intersect`
/// left.
const SHELL: &str = "class Shell : rt_Primitive, rt_Material;
    scratch float inner;
    void intersect() {
        float t = -rt_RayOrigin.z / rt_RayDirection.z;
        vec2 at = (rt_RayOrigin + t * rt_RayDirection).xy;
        inner = dot(at, at);
        if (inner < 1.0) hit(t);
    }
    void computeBounds() { rt_BoundMin = vec3(-1.0, -1.0, 0.0); rt_BoundMax = vec3(1.0, 1.0, 0.0); }
    void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
    void emission() { rt_EmissionColor = color(inner * rand()); }";

/// Asks surfaces in loops, and after others.
const ASKS: &str = "class Asks : rt_Integrator;
    void radiance() {
        rt_Surface s = nearestHit();
        if (!s.found) return;
        rt_LightSample light = s.sampleLight(sample1D(0));
        if (light.found) s.contribute(light.direction, light.distance, 0.1 * light.light);
        for (int i = 0; i < 3; ++i) rt_SampleColor += s.sampleBSDF(vec3(0.5)).weight;
        rt_Surface other = nearestHit(s.leave(s.shadingNormal), s.shadingNormal);
        if (other.found) rt_SampleColor += other.BSDF(other.shadingNormal) + other.emission();
        rt_SampleColor += s.emission() + s.sampleBSDF(vec3(0.25)).weight;
        if (!s.occluded(vec3(0.0, 1.0, 0.0), 8.0)) rt_SampleColor += s.emission();
    }";

/// Stages draw the numbers that hosts draw: for materials, and for rays to lights past a veil.
#[test]
fn stages_draw_the_numbers_that_hosts_draw() {
    let samplers = ["independent", "stratified", "sobol", "halton"];
    let shells = ["", "AttributeBegin Translate 0.5 0.5 -1 Shape \"Shell\" AttributeEnd"];
    let world = "WorldBegin LightSource \"point\" \"rgb I\" [30 30 30] \"point3 from\" [2 4 -3]
        LightSource \"infinite\" \"rgb L\" [0.4 0.5 0.7]
        Material \"Grain\" AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
        AttributeBegin Translate -1 0 0 Shape \"sphere\" AttributeEnd
        Material \"diffuse\" AttributeBegin Translate 1 0.5 -1 Shape \"sphere\" \"float radius\" 0.7
          \"float alpha\" 0.5 AttributeEnd";
    for (index, sampler) in samplers.into_iter().enumerate() {
        for integrator in ["Path", "Asks"] {
            let head = format!("{CAMERA}Sampler \"{sampler}\"\nIntegrator \"{integrator}\"");
            let text = format!("{head}\n{world}\n{}", shells[index % 2]);
            let classes = [GRAIN, SHELL, ASKS].join("\n");
            let make = |backend: Backend, width: u32| {
                let width = Some(width);
                let engine = EngineOptions { backend, width, ..EngineOptions::default() };
                bits(&rendered_files(&text, &classes, RenderRequest { engine, ..samples(4) }))
            };
            let reference = make(Backend::Interpreter, 1);
            assert!(reference.iter().any(|word| *word != 0), "{integrator}: black");
            for width in ways(&[4, 16], index / 2) {
                assert!(
                    make(Backend::Auto, width) == reference,
                    "{integrator}, {sampler}, {width}"
                );
            }
        }
    }
}

/// An integrator of a scene's own, with parameters, an output that the film keeps, and a probe behind the surface.
const THICKNESS: &str = "class Thickness : rt_Integrator;
    public float scale = 1.0;
    output color albedo;
    void radiance() {
        rt_Surface front = nearestHit();
        if (!front.found) return;
        rt_Surface back = nearestHit(front.leave(front.direction), front.direction);
        // The first surface is asked again after the second.
        albedo = front.sampleBSDF(vec3(0.5)).weight;
        float thickness = back.found && back.object == front.object
            ? distance(front.point, back.point) : 0.0;
        rt_SampleColor = color(scale * thickness);
    }";

/// A class of a scene's own may have the name of the renderer's integrator.
#[test]
fn a_class_with_the_name_of_the_path_tracer_takes_no_ones_place() {
    let road = "class Path : rt_Primitive; void intersect() { hit(-1.0); }";
    let head = "Integrator \"path\"";
    assert_eq!(bits(&rendered(head, road, samples(1))), bits(&rendered(head, "", samples(1))));
}

#[test]
fn scenes_bring_integrators() {
    let aovs = vec![Aov::Albedo, Aov::Distance, Aov::Object];
    let how = RenderRequest { aovs, ..samples(1) };
    let result = rendered("Integrator \"Thickness\" \"float scale\" 0.5", THICKNESS, how);
    // The balls have a diameter of 2, and the floor has no back.
    let most = result.image.pixels.iter().map(|pixel| pixel[0]).fold(0.0, f32::max);
    assert!((0.8..=1.0001).contains(&most), "{most}");
    assert!(result.image.pixels.iter().any(|pixel| pixel[0] == 0.0));
    let albedo = &result.aovs[0];
    assert!(albedo.pixels().any(|pixel| (pixel[0] - 0.5).abs() < 1e-3), "that of the floor");
}

#[test]
fn mistakes_are_told() {
    let said = |head: &str, classes: &str| {
        render(head, classes, samples(1)).err().map_or(String::new(), |it| it.to_text(false))
    };
    let unknown = said("Integrator \"Paht\"", "");
    assert!(unknown.contains("did you mean `Path`?"), "{unknown}");
    assert!(said("Integrator \"bdtp\"", "").contains("did you mean `bdpt`?"));
    let role = said("Integrator \"Lambertian\"", "");
    assert!(role.contains("`Lambertian`") && role.contains("integrator"), "{role}");
    let parameter = said("Integrator \"Path\" \"integer maxDept\" 3", "");
    assert!(parameter.contains("maxDepth"), "{parameter}");
    let endless = "class Endless : rt_Integrator; void radiance() { for (;;) rt_SampleColor += color(rand()); }";
    let endless = said("Integrator \"Endless\" \"integer budget\" 1000", endless);
    assert!(endless.contains("Endless"), "{endless}");
}

/// Surfaces that no ray found are black and do no harm.
#[test]
fn invented_surfaces_are_black() {
    let invented = "class Invented : rt_Integrator;
        void radiance() {
            rt_Surface s;
            s.object = 123456; s.instance = -7; s.element = 99999; s.direction = vec3(0.0, 0.0, 1.0);
            rt_SampleColor = color(0.25) + s.BSDF(s.direction) + s.emission() + s.lightEmission()
                + color(s.lightPDF(s.point)) + s.sampleBSDF(vec3(0.5)).weight + s.shade()
                + skyEmission(77, s.point, s.direction);
            s.object = -1; s.instance = -1;
            rt_SampleColor += s.emission();
        }";
    let result = rendered("Integrator \"Invented\"", invented, samples(1));
    assert!(result.image.pixels.iter().flatten().all(|value| *value == 0.25));
}

/// Numbers of the sampler: the same for one dimension, others for another, and in their range.
#[test]
fn samplers_give_numbers_by_dimension() {
    let numbers = "class Numbers : rt_Integrator;
        void radiance() {
            vec2 pair = sample2D(4);
            bool same = sample1D(3) == sample1D(3) && pair == sample2D(4) && sample1D(3) != sample1D(4);
            float other = rand();
            bool fresh = other != rand() && other >= 0.0 && other < 1.0;
            rt_SampleColor = color(pair.x, pair.y, same && fresh ? 1.0 : 0.0);
        }";
    let result = rendered("Integrator \"Numbers\"\nSampler \"sobol\"", numbers, samples(64));
    for pixel in &result.image.pixels {
        // Stratified, so that the mean of 64 is near one half.
        assert!((pixel[0] - 0.5).abs() < 0.02 && (pixel[1] - 0.5).abs() < 0.02, "{pixel:?}");
        assert_eq!(pixel[2], 1.0);
    }
}

/// The number of surfaces before is the same in the interactive renderer and in the integrator that calls `shade`.
#[test]
fn materials_know_the_surfaces_before_them() {
    let classes = "class Counted : rt_Material;
        void shade() { rt_SampleColor = color(0.25 + rt_RayDepth); }";
    let world = "WorldBegin
        Material \"Counted\" AttributeBegin Translate 0 -1 0 Shape \"Plane\" AttributeEnd
        Material \"Mirror\" \"rgb kr\" [1 1 1] Shape \"Sphere\"";
    let values = |how: RenderRequest<'_>, head: &str| {
        let text = format!("{CAMERA}{head}\n{world}");
        let files = [("scene.pbrt", text.as_str()), ("own.rtsl", classes)];
        let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
        let scene = Path::new("scene.pbrt").into();
        let request = RenderRequest { scene, size: Some((16, 12)), ..how };
        let rendered = render_scene_from(&request, &MemoryFiles(files.into()));
        let rendered = rendered.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        let mut values: Vec<u32> = bits(&rendered);
        values.sort_unstable();
        values.dedup();
        values.into_iter().map(f32::from_bits).collect::<Vec<f32>>()
    };
    // Nothing, the floor, and the floor in the mirror.
    let expected = [0.0, 0.25, 1.25];
    let interactive =
        RenderRequest { load: LoadOptions::with_integrator(INTERACTIVE), ..samples(1) };
    assert_eq!(values(interactive, ""), expected);
    assert_eq!(values(samples(1), "Integrator \"Whitted\""), expected);
}
