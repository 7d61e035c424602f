//! Lights that no traced ray hits: both renderers show the same, independent of how a material divides light between
//! samples and rays.

use std::path::PathBuf;

use rtsl_render::request::render_scene_from;
use rtsl_render::{LoadOptions, RenderRequest, RenderResult};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};

/// A rectangle whose samples have a density, and that no ray finds: it has no `emission`.
const PANEL: &str = "class Panel : rt_Light;
public vec3 corner = vec3(-2.0, 2.0, -2.0);
void illumination() {
    vec3 d = corner + vec3(4.0 * rand(), 0.0, 4.0 * rand()) - rt_HitPoint;
    rt_LightDistance = length(d);
    rt_LightDirection = d / rt_LightDistance;
    if (d.y <= 0.0) return;
    rt_LightColor = color(10.0);
    rt_PDF = dot(d, d) / (rt_LightDirection.y * 16.0);
}";

/// The panel as it would be if rays found it.
const FOUND: &str = "class Found : Panel;
bool meets(vec3 from, vec3 d) {
    vec2 at = (from + d * ((corner.y - from.y) / d.y) - corner).xz;
    return d.y > 0.0 && corner.y > from.y && min(at.x, at.y) >= 0.0 && max(at.x, at.y) <= 4.0;
}
void evaluatePDF() {
    float d = (corner.y - rt_HitPoint.y) / rt_LightDirection.y;
    rt_PDF = meets(rt_HitPoint, rt_LightDirection) ? d * d / (rt_LightDirection.y * 16.0) : 0.0;
}
void emission() { if (meets(rt_RayOrigin, rt_RayDirection)) rt_EmissionColor = color(10.0); }
// Even light from above, of which one half comes from a finite distance.
class HalfSky : rt_Light;
public bool near = true;
const float DENSITY = 0.5 / 3.14159265;
bool isNear(vec3 d) { return near && d.x > 0.0; }
void illumination() {
    rt_LightDirection = sampleUniformSphere(vec2(rand(), rand()));
    rt_LightDirection.y = abs(rt_LightDirection.y);
    if (isNear(rt_LightDirection)) rt_LightDistance = 1000.0;
    rt_LightColor = color(1.0);
    rt_PDF = DENSITY;
}
void evaluatePDF() { if (rt_LightDirection.y > 0.0) rt_PDF = DENSITY; }
void emission() { if (rt_RayDirection.y > 0.0 && !isNear(rt_RayDirection)) rt_EmissionColor = color(1.0); }";

/// The mean of the picture of a floor under a light.
fn mean(light: &str, material: &str, renderer: &str) -> f64 {
    let image = render(light, material, "Shape \"Plane\"", renderer).image;
    let sum: f64 = image.pixels.iter().map(|pixel| f64::from(pixel[0])).sum();
    sum / image.pixels.len() as f64
}

fn render(light: &str, material: &str, shapes: &str, renderer: &str) -> RenderResult {
    let scene = format!(
        "LookAt 0 4 -9  0 0.7 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 40
        Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 20
        Sampler \"stratified\" \"integer pixelsamples\" 81\nWorldBegin
        LightSource {light}\nMaterial {material}\n{shapes}"
    );
    let found = format!("{PANEL}\n{FOUND}");
    let files = [("scene.pbrt", scene.as_str()), ("panel.rtsl", found.as_str())];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        load: LoadOptions::with_integrator(renderer),
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, &MemoryFiles(files.into()));
    result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

#[track_caller]
fn check(light: &str, material: &str) {
    let [shaded, traced] = [INTERACTIVE, BATCH].map(|it| mean(light, material, it));
    assert!(traced > 0.05, "{material}: {traced}");
    assert!((shaded - traced).abs() < 0.03 * traced, "{material}: {shaded} {traced}");
}

#[test]
fn both_renderers_light_highlights_by_a_panel() {
    for material in [
        "\"Conductor\" \"rgb reflectance\" [0.8 0.8 0.8] \"float roughness\" 0.3",
        "\"Principled\" \"float metallic\" 1 \"float roughness\" 0.5",
        "\"Ward\"",
        "\"Phong\"",
        "\"CoatedDiffuse\" \"float roughness\" 0.4",
    ] {
        check("\"Panel\"", material);
    }
}

/// Light that rays find is not counted twice.
#[test]
fn both_renderers_light_highlights_by_a_sky() {
    for material in ["\"Ward\"", "\"Phong\""] {
        check("\"ConstantSky\"", material);
    }
}

/// Rays that leave the scene find what is infinitely far away: a panel near by gives the same light with `emission`,
/// whether walls are behind it or not.
#[test]
fn what_is_near_by_has_no_emission() {
    let floor = "Shape \"Plane\"";
    let room = "Shape \"Box\" \"point3 corner\" [-9 0 -12] \"point3 opposite\" [9 5 9]";
    for (shapes, renderer) in [(floor, INTERACTIVE), (room, BATCH)] {
        let [without, with] =
            ["\"Panel\"", "\"Found\""].map(|light| render(light, "\"Phong\"", shapes, renderer));
        assert!(without.image == with.image, "{shapes}, {renderer:?}");
        let warnings = with.warnings.to_text(false);
        assert!(warnings.contains("W0504"), "{shapes}, {renderer:?}: {warnings}");
        assert_eq!(without.warnings.to_text(false), "");
    }
}

/// A sky of which a panel hides a part counts once in each direction: its samples there are near by.
#[test]
fn samples_near_by_and_far_away_count_once() {
    let sky = "\"HalfSky\"";
    let whole = mean(sky, "\"Lambertian\"", BATCH);
    let expected = mean("\"HalfSky\" \"bool near\" false", "\"Lambertian\"", BATCH);
    assert!((whole - expected).abs() < 0.02 * expected, "{whole} {expected}");
}
