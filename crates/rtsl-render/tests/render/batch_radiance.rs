//! The path renderer on scenes whose radiance is known: furnaces, area lights over a floor, and the same bits for all
//! settings that must not matter.

use std::path::{Path, PathBuf};

use rtsl::{Backend, Engine, EngineOptions, Messages};
use rtsl_image::Image;
use rtsl_render::compiled::RenderScene;
use rtsl_render::schedule::{RenderOptions, RenderedImage, render};
use rtsl_render::{Execution, Rendered};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

/// The settings of a render.
#[derive(Clone, Copy)]
struct How {
    backend: Backend,
    width: u32,
    threads: usize,
}

const PLAIN: How = How { backend: Backend::Auto, width: 8, threads: 2 };

fn fail(messages: Messages) -> ! {
    panic!("{}", messages.to_text(false))
}

fn compiled(text: &str, how: How) -> RenderScene {
    let files = [
        ("scene.pbrt", text),
        ("width.rtsl", WIDTH),
        ("shaded.rtsl", SHADED),
        ("chance.rtsl", CHANCE),
        ("raised.rtsl", RAISED),
        ("stepped.rtsl", STEPPED),
    ];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let files = MemoryFiles(files.into());
    let scene = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    let scene = scene.unwrap_or_else(|messages| fail(messages)).scene;
    let options =
        EngineOptions { backend: how.backend, width: Some(how.width), ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the backend is there");
    let mut warnings = Messages::default();
    let scene = RenderScene::new(&scene, &engine, &[], &mut warnings, &|_| {});
    scene.unwrap_or_else(|messages| fail(messages))
}

fn rendered(text: &str, how: How) -> Rendered {
    let scene = compiled(text, how);
    let options =
        RenderOptions { execution: Execution::on_threads(how.threads), ..RenderOptions::default() };
    let RenderedImage { rendered, .. } =
        render(&scene, options).unwrap_or_else(|messages| fail(messages));
    assert_eq!((rendered.dropped_samples, &*rendered.not_finite), (0, [].as_slice()));
    rendered
}

/// A scene of 16 by 16 pixels with a narrow camera.
fn scene(head: &str, world: &str) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16\n{head}\nWorldBegin\n{world}"
    )
}

/// The mean of all pixels, and its standard error, estimated from the variation between pixels.
fn mean(rendered: &Rendered, channel: usize) -> (f64, f64) {
    let values = rendered.image.pixels.iter().map(|pixel| f64::from(pixel[channel]));
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
    (mean, (square / (count - 1.0) / count).sqrt())
}

/// Checks the mean of the first channel, of the path renderer and of the integrator written in RTSL. The camera's
/// pixels must see about the same.
#[track_caller]
fn check(text: &str, expected: f64) {
    check_paths(text, expected);
    if text.contains(INTEGRATOR) {
        check_class(&text.replace(INTEGRATOR, CLASS), expected);
    }
}

/// Checks the mean of few samples, since integrators written in RTSL run on the interpreter.
#[track_caller]
fn check_class(text: &str, expected: f64) {
    let (mean, error) = mean(&rendered(text, PLAIN), 0);
    let allowed = 5.0 * error + 2e-3 * expected;
    assert!((mean - expected).abs() < allowed, "class: {mean} +- {error}, expected {expected}");
    assert!(error < 0.2 * expected, "class: {error} says little of {expected}");
}

/// Checks the mean of the path renderer.
#[track_caller]
fn check_paths(text: &str, expected: f64) {
    let (mean, error) = mean(&rendered(text, PLAIN), 0);
    // Five standard errors, and the pixels' own differences.
    let allowed = 5.0 * error + 2e-3 * expected;
    assert!((mean - expected).abs() < allowed, "{mean} +- {error}, expected {expected}");
    assert!(error < 0.02 * expected, "{error} says little of {expected}");
}

const DOWN: &str = "LookAt 0 4 0  0 0 0  0 0 1\nCamera \"Pinhole\" \"float fov\" 1";
const INTEGRATOR: &str = "Integrator \"path\" \"integer maxdepth\" 8 \"float rrthreshold\" 0\nSampler \"sobol\" \"integer pixelsamples\" 64";
const CLASS: &str = "Integrator \"Path\" \"integer maxDepth\" 8 \"float rouletteThreshold\" 0
    Sampler \"sobol\" \"integer pixelsamples\" 2";
const FLOOR: &str = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\nShape \"Plane\"\n";

fn above_floor(world: &str) -> String {
    scene(&format!("{DOWN}\n{INTEGRATOR}"), &format!("{FLOOR}{world}"))
}

#[test]
fn a_floor_under_an_even_sky_reflects_its_part_of_it() {
    check(&above_floor("LightSource \"infinite\" \"rgb L\" [2 2 2]"), 1.0);
}

#[test]
fn a_point_light_lights_by_its_squared_distance() {
    // Intensity 10 at height 2: irradiance 2.5.
    let light = "LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [0 2 0]";
    // The light is not in the way of the camera: it has no extent.
    check(&above_floor(light), 0.5 / std::f64::consts::PI * 2.5);
}

/// Transforms of lights move them, and leave their intensity.
#[test]
fn lights_at_a_point_keep_their_intensity_under_transforms() {
    let lit = 0.5 / std::f64::consts::PI * 2.5;
    for light in [
        "Scale 4 4 4 LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [0 0.5 0]",
        "Scale 3 0.5 1 LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [0 4 0]",
        "Rotate 90 0 0 1 Scale 0.1 0.1 0.1 LightSource \"spot\" \"rgb I\" [10 10 10] \"float coneangle\" 60
            \"point3 from\" [20 0 0] \"point3 to\" [0 0 0]",
    ] {
        check(&above_floor(light), lit);
    }
}

#[test]
fn two_lights_add_up() {
    let lights = "LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [0 2 0]
        LightSource \"infinite\" \"rgb L\" [2 2 2]";
    check(&above_floor(lights), 1.0 + 0.5 / std::f64::consts::PI * 2.5);
}

/// Lamps stand aside of the camera's view, so that it sees the floor: irradiance of a sphere of radiance L and radius r
/// whose centre is at distance d and cosine c is pi L c (r / d)^2 while all of it is above the floor.
fn sphere_irradiance(radiance: f64, radius: f64, [x, y]: [f64; 2]) -> f64 {
    let square = x * x + y * y;
    std::f64::consts::PI * radiance * (y / square.sqrt()) * radius * radius / square
}

#[test]
fn a_spherical_lamp_lights_as_the_solid_angle_says() {
    let lamp = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 3 3]
        Material \"diffuse\" \"rgb reflectance\" [0 0 0]
        Translate 1.5 2 0
        Shape \"sphere\" \"float radius\" 1 AttributeEnd";
    let expected = 0.5 / std::f64::consts::PI * sphere_irradiance(3.0, 1.0, [1.5, 2.0]);
    check(&above_floor(lamp), expected);
}

#[test]
fn a_lamp_may_be_scaled_unevenly_or_placed_by_an_instance() {
    let expected = 0.5 / std::f64::consts::PI * sphere_irradiance(3.0, 1.0, [1.5, 2.0]);
    // A sphere of radius 2, halved, and stretched and squeezed back.
    let shape = "AreaLightSource \"diffuse\" \"rgb L\" [3 3 3]
        Material \"diffuse\" \"rgb reflectance\" [0 0 0]";
    let scaled = format!(
        "AttributeBegin {shape} Translate 1.5 2 0 Scale 0.5 0.5 0.5 Shape \"sphere\" \"float radius\" 2 AttributeEnd"
    );
    check(&above_floor(&scaled), expected);
    let placed = format!(
        "ObjectBegin \"lamp\" {shape} Translate 0 2 0 Shape \"sphere\" \"float radius\" 1 ObjectEnd
        Translate 1.5 0 0 ObjectInstance \"lamp\""
    );
    check(&above_floor(&placed), expected);
    // An ellipsoid and the same as a sphere under an uneven scale light alike.
    let flat = |shape_text: &str| {
        let lamp = format!("AttributeBegin {shape} Translate 1.5 2 0 {shape_text} AttributeEnd");
        mean(&rendered(&above_floor(&lamp), PLAIN), 0).0
    };
    let one = flat("Scale 1 0.25 1 Shape \"sphere\" \"float radius\" 1");
    let other = flat("Scale 2 0.5 2 Shape \"sphere\" \"float radius\" 0.5");
    assert!((one - other).abs() < 0.01 * one, "{one} {other}");
}

/// The part of a lamp that rays hit shines, and all of a lamp that no ray hits.
#[test]
fn lamps_shine_by_their_alpha() {
    let lamp = |alpha: f32| {
        format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 3 3]
            Material \"diffuse\" \"rgb reflectance\" [0 0 0] Translate 1.5 2 0
            Shape \"sphere\" \"float radius\" 1 \"float alpha\" {alpha} AttributeEnd"
        )
    };
    let whole = 0.5 / std::f64::consts::PI * sphere_irradiance(3.0, 1.0, [1.5, 2.0]);
    check(&above_floor(&lamp(0.5)), 0.5 * whole);
    check(&above_floor(&lamp(0.0)), whole);
}

/// Paths alone would find one sample in a hundred of this lamp.
#[test]
fn lamps_with_a_texture_are_sampled() {
    let lamp = "Texture \"halves\" \"spectrum\" \"checkerboard\" \"float uscale\" 2 \"float vscale\" 1
            \"rgb tex1\" [0.2 0.2 0.2] \"rgb tex2\" [1 1 1]
        AttributeBegin AreaLightSource \"Emissive\" \"rgb radiance\" [3 3 3] \"texture image\" \"halves\"
        ReverseOrientation Material \"diffuse\" \"rgb reflectance\" [0 0 0]
        Translate 0 5 0 Shape \"Disk\" \"float radius\" 0.5 AttributeEnd";
    check(&above_floor(lamp), 0.5 * 0.6 * 3.0 * 0.25 / 25.25);
}

/// A floor whose rays begin above it, by a length in its own space.
const RAISED: &str = "class Raised : rt_Primitive;
    public float offset = 0.0;
    void intersect() {
        float t = -rt_RayOrigin.y / rt_RayDirection.y;
        vec3 at = rt_RayOrigin + t * rt_RayDirection;
        if (max(abs(at.x), abs(at.z)) < 1.0) hit(t);
    }
    void computeBounds() { rt_BoundMin = vec3(-1.0, -0.1, -1.0); rt_BoundMax = vec3(1.0, 0.1, 1.0); }
    void computeNormal() { rt_GeometricNormal = vec3(0.0, 2.0, 0.0); rt_SurfaceOffset = offset; }";

/// Rays towards a light pass a screen below their origins.
#[test]
fn shapes_set_offsets_of_rays() {
    let floor = |shape: &str| {
        let world = format!(
            "LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [2 2 0]
            Material \"diffuse\" \"rgb reflectance\" [0 0 0]
            AttributeBegin Translate 0.5 0.5 0 Shape \"Disk\" \"float radius\" 0.2 AttributeEnd
            Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n{shape}"
        );
        scene(&format!("{DOWN}\n{INTEGRATOR}"), &world)
    };
    let lit = 0.5 / std::f64::consts::PI * 10.0 * 0.5_f64.sqrt() / 8.0;
    check(&floor("Shape \"Raised\" \"float offset\" 1"), lit);
    check(&floor("Scale 2 2 2 Shape \"Raised\" \"float offset\" 0.5"), lit);
    let shadowed = rendered(&floor("Shape \"Raised\""), PLAIN);
    assert_eq!(mean(&shadowed, 0), (0.0, 0.0));
}

#[test]
fn a_disk_lights_what_it_faces() {
    // Over the middle of a disk of radius r at height h: pi L r^2 / (r^2 + h^2). The camera looks from below it.
    let lamp = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] ReverseOrientation
        Material \"diffuse\" \"rgb reflectance\" [0 0 0]
        Translate 0 5 0 Shape \"Disk\" \"float radius\" 2 AttributeEnd";
    check(&above_floor(lamp), 0.5 * 3.0 * 4.0 / 29.0);
}

#[test]
fn lamps_are_found_by_mirrors_too() {
    // Mirrors show lights with full weight.
    let lamp = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] ReverseOrientation
        Translate 0 5 0 Shape \"Disk\" \"float radius\" 2 AttributeEnd
        Material \"Mirror\" \"rgb kr\" [0.5 0.5 0.5]
        Shape \"Disk\" \"float radius\" 0.5";
    let text = scene(&format!("{DOWN}\n{INTEGRATOR}"), lamp);
    check(&text, 1.5);
}

/// Everything within a closed room emits L and reflects the part r: after n reflections that is L (1 + r + ... + r^n).
#[test]
fn a_closed_room_gathers_all_orders() {
    let text = scene(
        &format!("Camera \"Pinhole\" \"float fov\" 60\n{INTEGRATOR}"),
        "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] ReverseOrientation
        Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]
        Shape \"sphere\" \"float radius\" 3",
    );
    let orders = (0..8).fold(1.0, |sum, _| 1.0 + 0.5 * sum);
    check(&text, orders);
}

/// A screen of which half is there lets half of everything pass: of what is seen, and of what lights.
#[test]
fn cut_outs_let_their_part_pass() {
    let screen = |alpha: f32, y: f32| {
        format!(
            "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] Translate 0 {y} 0
            Shape \"Disk\" \"float radius\" 4 \"float alpha\" {alpha} AttributeEnd\n"
        )
    };
    let light = "LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [0 2 0]\n";
    let lit = 0.5 / std::f64::consts::PI * 2.5;
    // Before the camera, but behind the light; then between the light and the floor as well, twice.
    check(&above_floor(&format!("{light}{}", screen(0.5, 3.0))), 0.5 * lit);
    check(&above_floor(&format!("{light}{}", screen(0.5, 1.0))), 0.25 * lit);
    let two = above_floor(&format!("{light}{}{}", screen(0.5, 1.0), screen(0.5, 1.5)));
    // Few of its samples are lit.
    check(&two.replace("pixelsamples\" 64", "pixelsamples\" 512"), 0.0625 * lit);
    check(&above_floor(&format!("{light}{}", screen(0.0, 1.0))), lit);
}

/// A texture that shows how wide rays are.
const WIDTH: &str = "class Width : rt_Texture;
    public float scale = 1.0;
    void lookup() { rt_TextureColor = color(scale * rt_du); }";

/// Pixels of a degree's sixteenth, four units away, of whose sides each of 64 samples has a part: one over the root of
/// its number.
#[test]
fn textures_know_how_wide_rays_are() {
    let tangent = 0.008_726_867_790_758_8; // Of half a degree.
    let parts: f64 = (1..=64).map(|number| 1.0 / f64::from(number).sqrt()).sum();
    let width = 4.0 * 2.0 * tangent / 16.0 * parts / 64.0;
    // The first sample is four times as wide as the mean: no reflectance may exceed 1.
    let floor = |head: &str| {
        let world = "LightSource \"infinite\" \"rgb L\" [1 1 1]
            Texture \"width\" \"spectrum\" \"Width\" \"float scale\" 100
            Material \"diffuse\" \"texture reflectance\" \"width\" Shape \"Plane\"";
        scene(&format!("{head}\n{INTEGRATOR}"), world)
    };
    // Widths depend on the number of samples.
    check_paths(&floor(DOWN), 100.0 * width);
    // At a slant of 60 degrees the cut is twice as long one way.
    let aslant = "LookAt 0 2 -3.464102  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 1";
    check_paths(&floor(aslant), 100.0 * width * 2.0_f64.sqrt());
}

/// Materials that have nothing but `shade`.
const SHADED: &str = "class Half : rt_Material;
    void shade() { rt_SampleColor = 0.5 * trace(rt_HitPoint, reflect(rt_RayDirection, rt_ShadingNormal)); }

    class Lit : rt_Material;
    void shade() {
        color sum = color(0.0);
        illuminance { sum += rt_LightColor * max(dot(rt_LightDirection, rt_ShadingNormal), 0.0); }
        rt_SampleColor = 0.5 / 3.14159265 * sum;
    }";

/// Their rays are paths: a mirror over a floor shows what paths bring back from it.
#[test]
fn materials_that_only_shade_run_as_they_stand() {
    let light = "LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [0 2 0]\n";
    let lit = 0.5 / std::f64::consts::PI * 2.5;
    let floor = "Material \"Lit\" Shape \"Plane\"\n";
    check(&scene(&format!("{DOWN}\n{INTEGRATOR}"), &format!("{light}{floor}")), lit);
    // From below, by a mirror under the camera: sky, half of it.
    let mirror = "LightSource \"infinite\" \"rgb L\" [2 2 2]\nMaterial \"Half\" Shape \"Plane\"\n";
    check(&scene(&format!("{DOWN}\n{INTEGRATOR}"), mirror), 1.0);
    // The camera looks up into a mirror that shows the floor, which paths light by the sky at its side.
    let up = "LookAt 0 1 0  0 2 0  0 0 1\nCamera \"Pinhole\" \"float fov\" 1";
    let world = format!(
        "LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [0 2 0.5]
        {FLOOR} AttributeBegin Material \"Half\" Translate 0 4 0
        Shape \"Disk\" \"float radius\" 0.2 AttributeEnd"
    );
    // At the height of 2 and half a unit aside.
    let square: f64 = 4.25;
    let irradiance = 10.0 * 2.0 / (square * square.sqrt());
    check(
        &scene(&format!("{up}\n{INTEGRATOR}"), &world),
        0.5 * 0.5 / std::f64::consts::PI * irradiance,
    );
}

/// Reflects a tenth of the light, and another for each surface between it and the camera.
const STEPPED: &str = "class Stepped : rt_Material;
    void BSDF() {
        bool above = dot(rt_LightDirection, rt_GeometricNormal) > 0.0;
        rt_BSDFValue = color(above ? 0.1 * (1.0 + rt_RayDepth) * 0.318309886 : 0.0);
    }";

#[test]
fn materials_know_the_surfaces_before_them() {
    let sky = "LightSource \"infinite\" \"rgb L\" [2 2 2]\nMaterial \"Stepped\" Shape \"Plane\"\n";
    check(&scene(&format!("{DOWN}\n{INTEGRATOR}"), sky), 0.2);
    // The camera looks up into a mirror that shows the floor.
    let up = "LookAt 0 1 0  0 2 0  0 0 1\nCamera \"Pinhole\" \"float fov\" 1";
    let mirror = "AttributeBegin Material \"Mirror\" \"rgb kr\" [1 1 1] Translate 0 4 0
        Shape \"Disk\" \"float radius\" 0.05 AttributeEnd";
    check(&scene(&format!("{up}\n{INTEGRATOR}"), &format!("{sky}{mirror}")), 0.4);
}

/// Many lamps light as the sum of each, whichever of them are sampled how often.
#[test]
fn many_lights_add_up() {
    let places: Vec<[f64; 2]> = (0..40)
        .map(|index| [1.0 + 0.05 * f64::from(index), 2.0 + 0.1 * f64::from(index)])
        .collect();
    let lamp = |(index, [x, y]): (usize, &[f64; 2])| {
        let radiance = 1 + index % 7;
        format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{radiance} 1 1] Translate {x} {y} {}
            Shape \"sphere\" \"float radius\" 0.01 AttributeEnd\n",
            0.3 * index as f64
        )
    };
    let lamps: String = places.iter().enumerate().map(lamp).collect();
    let black = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
    let lit = |(index, [x, y]): (usize, &[f64; 2])| {
        let z = 0.3 * index as f64;
        let across = (x * x + z * z).sqrt();
        sphere_irradiance(1.0 + (index % 7) as f64, 0.01, [across, *y])
    };
    let irradiance: f64 = places.iter().enumerate().map(lit).sum();
    check(&above_floor(&format!("{black}{lamps}")), 0.5 / std::f64::consts::PI * irradiance);
}

/// Materials that neither absorb nor emit light are invisible in a uniform sky.
#[test]
fn lossless_materials_vanish_in_a_furnace() {
    for material in [
        "Material \"diffuse\" \"rgb reflectance\" [1 1 1]",
        "Material \"Mirror\" \"rgb kr\" [1 1 1]",
        "Material \"SchlickDielectric\"",
        "Material \"Dielectric\"",
        "Material \"ThinDielectric\"",
    ] {
        let text = scene(
            "LookAt 0 0 -6  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 10
            Integrator \"path\" \"integer maxdepth\" 64 \"float rrthreshold\" 0
            Sampler \"sobol\" \"integer pixelsamples\" 16",
            &format!("LightSource \"infinite\" \"rgb L\" [1 1 1]\n{material}\nShape \"Sphere\""),
        );
        check(&text, 1.0);
    }
}

/// Roulette changes what pixels look like, but not what they are on average.
#[test]
fn roulette_does_not_darken() {
    let room = |roulette: f32| {
        let head = format!(
            "Camera \"Pinhole\" \"float fov\" 60
            Integrator \"path\" \"integer maxdepth\" 8 \"float rrthreshold\" {roulette}
            Sampler \"independent\" \"integer pixelsamples\" 256"
        );
        scene(
            &head,
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] ReverseOrientation
            Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]
            Shape \"sphere\" \"float radius\" 3",
        )
    };
    let [without, with] = [0.0, 1.0].map(|roulette| rendered(&room(roulette), PLAIN));
    assert!(with.rays.traced < without.rays.traced, "it ends paths");
    let ((one, _), (other, error)) = (mean(&without, 0), mean(&with, 0));
    assert!((one - other).abs() < 5.0 * error + 1e-3, "{one} {other} +- {error}");
}

/// A little of everything: elements and single objects, one material and several, instances, motion, two kinds of
/// lights, glass and metal.
const MIXED: &str = "
    LightSource \"infinite\" \"rgb L\" [0.3 0.4 0.5]
    LightSource \"point\" \"rgb I\" [10 9 8] \"point3 from\" [2 4 -3]
    Material \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]
    Shape \"bilinearmesh\" \"point3 P\" [-5 -1 -5  5 -1 -5  -5 -1 5  5 -1 5]
    AttributeBegin
      AreaLightSource \"diffuse\" \"rgb L\" [4 4 4]
      Translate -1.5 2 0 Scale 1 0.5 1
      Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 0 1  1 0 1] \"integer indices\" [0 1 2  2 1 3]
    AttributeEnd
    Material \"conductor\" \"float roughness\" 0.2
    Shape \"Sphere\" \"point3 center\" [-1 0 0]
    ObjectBegin \"ball\"
      Material \"SchlickDielectric\"
      Scale 1 1.2 1
      Shape \"Sphere\" \"float radius\" 0.8
    ObjectEnd
    AttributeBegin Translate 1 0 0 ObjectInstance \"ball\" AttributeEnd
    AttributeBegin
      ActiveTransform EndTime Translate 0.3 0 0 ActiveTransform All
      Translate 0 0.2 -2 ObjectInstance \"ball\"
    AttributeEnd";

#[test]
fn images_have_the_same_bits_however_they_are_made() {
    let head = "LookAt 0 1 -6  0 0 0  0 1 0\nCamera \"ThinLens\" \"float fov\" 40 \"float lensRadius\" 0.05
        Integrator \"path\" \"integer maxdepth\" 4\nSampler \"sobol\" \"integer pixelsamples\" 20";
    let text = scene(head, MIXED);
    let bits = |how: How| {
        let rendered = rendered(&text, how);
        let pixels = rendered.image.pixels.into_iter().flatten();
        (pixels.map(f32::to_bits).collect::<Vec<u32>>(), rendered.rays)
    };
    let reference = bits(How { backend: Backend::Interpreter, width: 1, threads: 1 });
    assert!(reference.0.iter().any(|bits| *bits != 0));
    for (width, threads) in [(1, 2), (4, 1), (8, 1), (8, 3), (16, 2)] {
        let how = How { backend: Backend::Auto, width, threads };
        assert!(bits(how) == reference, "width {width}, {threads} threads");
    }
}

/// Classes that ask for random numbers wherever they may.
const CHANCE: &str = "class ChanceSky : rt_Light;
    void emission() { rt_EmissionColor = color(rand(), rand(), 0.5); }

    class ChanceTexture : rt_Texture;
    void lookup() {
        rt_TextureColor = color(rand());
        rt_FloatTextureValue = step(0.5, rand());
    }

    class ChanceShape : rt_Primitive;
    public float height = 0.0;
    void intersect() {
        float t = (height - rt_RayOrigin.y) / rt_RayDirection.y;
        vec3 p = rt_RayOrigin + t * rt_RayDirection;
        if (max(abs(p.x), abs(p.z)) < 3.0) hit(t);
    }
    void computeBounds() {
        rt_BoundMin = vec3(-3.0, height, -3.0);
        rt_BoundMax = vec3(3.0, height, 3.0);
    }
    void computeNormal() {
        rt_GeometricNormal = vec3(0.0, 1.0, 0.0);
        rt_ShadingNormal = normalize(vec3(0.2 * rand(), 1.0, 0.2 * rand()));
    }

    class ChanceShade : rt_Material;
    void shade() {
        rt_SampleColor = 0.5 * rand() * trace(rt_HitPoint, reflect(rt_RayDirection, rt_GeometricNormal));
    }";

/// Every request for a number is that of a lane, wherever the lane stands among those that are worked on together, and
/// whatever these did before.
#[test]
fn random_numbers_belong_to_their_paths() {
    let head = "LookAt 0 2 -4  0 0 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 60
        Integrator \"path\" \"integer maxdepth\" 4\nSampler \"independent\" \"integer pixelsamples\" 20";
    let world = "LightSource \"ChanceSky\"
        LightSource \"ConstantSky\"
        Texture \"chance\" \"spectrum\" \"ChanceTexture\"
        Texture \"holes\" \"float\" \"ChanceTexture\"
        MakeNamedMaterial \"matte\" \"string type\" \"Lambertian\" \"texture kd\" \"chance\"
        MakeNamedMaterial \"polish\" \"string type\" \"Mirror\" \"rgb kr\" [0.8 0.8 0.8]
        MakeNamedMaterial \"floor\" \"string type\" \"Mix\" \"material first\" \"matte\"
            \"material second\" \"polish\" \"float amount\" 0.4
        AttributeBegin
          AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] ReverseOrientation
          Translate 0 5 0 Shape \"Disk\" \"float radius\" 2
        AttributeEnd
        NamedMaterial \"floor\"
        Shape \"ChanceShape\"
        Shape \"ChanceShape\" \"float height\" 0.5 \"texture alpha\" \"holes\"
        Material \"ChanceShade\"
        Shape \"Sphere\" \"float radius\" 0.4";
    let text = scene(head, world);
    let image = |how: How| rendered(&text, how).image;
    let reference = image(How { backend: Backend::Interpreter, width: 1, threads: 1 });
    let bits = |image: &Image| image.pixels.iter().flatten().map(|it| it.to_bits()).collect();
    let expected: Vec<u32> = bits(&reference);
    for (width, threads) in [(1, 1), (4, 3), (8, 1), (16, 2)] {
        let other: Vec<u32> = bits(&image(How { backend: Backend::Auto, width, threads }));
        assert!(other == expected, "width {width}, {threads} threads");
    }
}

#[test]
fn streams_and_packets_find_the_same() {
    let head = "LookAt 0 1 -6  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40
        Integrator \"path\" \"integer maxdepth\" 4\nSampler \"independent\" \"integer pixelsamples\" 16";
    let balls = (0..200).map(|number| {
        let [x, y, z] = [number % 10, number / 10 % 5, number / 50].map(|it| it as f32 * 0.5 - 1.5);
        let class = if number % 3 == 0 {
            "Shape \"Torus\" \"float minorRadius\" 0.1 \"float majorRadius\""
        } else {
            "Shape \"sphere\" \"float radius\""
        };
        format!("AttributeBegin Translate {x} {y} {z} {class} 0.25 AttributeEnd\n")
    });
    let world = "LightSource \"infinite\" \"rgb L\" [0.3 0.4 0.5]
        LightSource \"point\" \"rgb I\" [10 9 8] \"point3 from\" [2 4 -3]
        Material \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]
        Shape \"bilinearmesh\" \"point3 P\" [-5 -2 -5  5 -2 -5  -5 -2.5 5  5 -1 5]\n"
        .to_owned()
        + &balls.collect::<String>();
    // Where there is an instance there are no streams.
    let far = "ObjectBegin \"far\" Shape \"sphere\" \"float radius\" 1e-3 ObjectEnd
        Translate 0 1e5 -1e6 ObjectInstance \"far\"";
    let [streams, packets] = [scene(head, &world), scene(head, &format!("{world}{far}"))];
    for (text, are_streams) in [(&streams, true), (&packets, false)] {
        assert_eq!(compiled(text, PLAIN).compiled.geometry.suits_stream(500), are_streams);
    }
    let bits = |text: &str, how: How| {
        let pixels = rendered(text, how).image.pixels.into_iter().flatten();
        pixels.map(f32::to_bits).collect::<Vec<u32>>()
    };
    let reference = bits(&packets, PLAIN);
    for (width, threads) in [(1, 2), (4, 1), (8, 2), (16, 1)] {
        let how = How { backend: Backend::Auto, width, threads };
        assert!(bits(&streams, how) == reference, "width {width}");
    }
}
