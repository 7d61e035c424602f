//! Cameras, lights and primitives that call others through references: a picture of them is one of the others.

use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions};
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, RenderRequest};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};

/// `Round` keeps the point in scratch, which its other methods read. `Moved` is another primitive elsewhere, `Twice` is
/// it at two places, `Gel` a light, `Mirrored` a camera.
const CLASSES: &str = "class Round : rt_Primitive;
    public float radius = 1.0;
    scratch vec3 point;
    scratch float turn[2];
    void computeBounds() { rt_BoundMin = vec3(-radius); rt_BoundMax = vec3(radius); }
    void intersect() {
        float a = dot(rt_RayDirection, rt_RayDirection), b = dot(rt_RayOrigin, rt_RayDirection);
        float d = b * b - a * (dot(rt_RayOrigin, rt_RayOrigin) - radius * radius);
        if (d >= 0.0 && hit((-b - sqrt(d)) / a)) {
            point = rt_RayOrigin + rt_HitDistance * rt_RayDirection;
            turn[1] = point.y;
        }
    }
    void computeNormal() { rt_GeometricNormal = point; }
    void computeTextureCoordinates() { rt_TextureUV = vec2(point.x, turn[1]); }

    class Moved : rt_Primitive;
    public rt_Primitive base;
    public vec3 by = vec3(0.0);
    scratch vec3 own;
    void computeBounds() { rt_BoundMin = base.computeBounds() + by; rt_BoundMax += by; }
    void intersect() {
        own = by;
        hit(base.intersect(rt_RayOrigin = rt_RayOrigin - by));
    }
    void computeNormal() { rt_GeometricNormal = base.computeNormal(rt_HitPoint = rt_HitPoint - own); }
    void computeTextureCoordinates() { rt_TextureUV = base.computeTextureCoordinates(); }

    class Twice : rt_Primitive;
    public rt_Primitive parts[];
    scratch int nearest;
    void computeBounds() {
        rt_BoundMin = vec3(1.0e30);
        rt_BoundMax = vec3(-1.0e30);
        vec3 low = rt_BoundMin, high = rt_BoundMax;
        for (int i = 0; i < parts.length(); ++i) {
            low = min(low, parts[i].computeBounds());
            high = max(high, rt_BoundMax);
        }
        rt_BoundMin = low;
        rt_BoundMax = high;
    }
    void intersect() { for (int i = 0; i < parts.length(); ++i) if (hit(parts[i].intersect())) nearest = i; }
    void computeNormal() { rt_GeometricNormal = parts[nearest].computeNormal(); }
    void computeTextureCoordinates() { rt_TextureUV = parts[nearest].computeTextureCoordinates(); }

    class Gel : rt_Light;
    public rt_Light base;
    public color tint = color(1.0);
    void illumination() { rt_LightColor = tint * base.illumination(); }

    class Mirrored : rt_Camera;
    public rt_Camera base;
    void generateRay() {
        rt_SampleColor = base.generateRay(rt_ScreenCoord = vec2(1.0 - rt_ScreenCoord.x, rt_ScreenCoord.y));
    }

    class Shown : rt_Material;
    void BSDF() { rt_BSDFValue = color(0.3, fract(rt_TextureUV.x), fract(rt_TextureUV.y)); }";

fn picture(camera: &str, world: &str, renderer: &str, backend: Backend) -> Vec<[f32; 3]> {
    let scene = format!(
        "LookAt 0 1 -5  0 0 0  0 1 0
        Camera \"Pinhole\" \"float fov\" 40 \"string name\" \"plain\"
        {camera}
        Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 24
        PixelFilter \"box\"
        Sampler \"stratified\" \"integer pixelsamples\" 1 \"bool jitter\" false
        WorldBegin
        Material \"Shown\"
        {world}"
    );
    let files = [("scene.pbrt", &*scene), ("round.rtsl", CLASSES)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: Path::new("scene.pbrt").to_owned(),
        load: LoadOptions::with_integrator(renderer),
        execution: Execution::on_threads(1),
        engine: EngineOptions { backend, ..EngineOptions::default() },
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, &MemoryFiles(files.into()));
    let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    result.image.pixels.clone()
}

const LIGHT: &str = "LightSource \"PointLight\" \"point3 position\" [-3 8 -6] \"rgb intensity\"";

/// Checks that two scenes have the same picture, which shows something.
fn same([camera, world]: [&str; 2], [other_camera, other_world]: [&str; 2]) {
    let every =
        [(BATCH, Backend::Auto), (INTERACTIVE, Backend::Auto), (BATCH, Backend::Interpreter)];
    for (renderer, backend) in every {
        let found = picture(camera, world, renderer, backend);
        assert!(found.iter().filter(|pixel| pixel[0] > 0.0).count() > 40);
        let expected = picture(other_camera, other_world, renderer, backend);
        let differing = found.iter().zip(&expected).filter(|(found, expected)| found != expected);
        assert_eq!(differing.count(), 0, "{}", renderer);
    }
}

#[test]
fn a_primitive_may_be_another_one() {
    let light = format!("{LIGHT} [60 60 60]");
    // By a power of two, so that both origins are exact.
    let moved = format!(
        "{light} ObjectBegin \"hidden\" Shape \"Round\" \"string name\" \"ball\" ObjectEnd
        Shape \"Moved\" \"primitive base\" \"ball\" \"vector3 by\" [0 0 0]"
    );
    let plain = format!("{light} Shape \"Round\"");
    same(["", &moved], ["", &plain]);
    let nested = format!(
        "{light} ObjectBegin \"hidden\" Shape \"Round\" \"string name\" \"ball\"
        Shape \"Moved\" \"string name\" \"moved\" \"primitive base\" \"ball\" ObjectEnd
        Shape \"Moved\" \"primitive base\" \"moved\""
    );
    same(["", &nested], ["", &plain]);
}

#[test]
fn a_primitive_may_be_the_nearest_of_several() {
    let light = format!("{LIGHT} [60 60 60]");
    let twice = format!(
        "{light} ObjectBegin \"hidden\"
        Shape \"Round\" \"string name\" \"ball\" \"float radius\" 0.75
        Shape \"Moved\" \"string name\" \"moved\" \"primitive base\" \"ball\" \"vector3 by\" [1 0 0.25]
        ObjectEnd
        Shape \"Twice\" \"primitive parts\" [\"ball\" \"moved\"]"
    );
    let both = format!(
        "{light} ObjectBegin \"hidden\"
        Shape \"Round\" \"string name\" \"ball\" \"float radius\" 0.75 ObjectEnd
        Shape \"Round\" \"float radius\" 0.75
        Shape \"Moved\" \"primitive base\" \"ball\" \"vector3 by\" [1 0 0.25]"
    );
    let (twice, both) = (&*twice, &*both);
    // Shadows between the parts begin elsewhere than those between shapes.
    for backend in [Backend::Auto, Backend::Interpreter] {
        let [found, expected] = [twice, both].map(|world| picture("", world, INTERACTIVE, backend));
        let near = |(a, b): &(&[f32; 3], &[f32; 3])| (0..3).all(|it| (a[it] - b[it]).abs() < 1e-3);
        let same = found.iter().zip(&expected).filter(near).count();
        assert!(same * 100 >= found.len() * 98, "{same} of {} pixels", found.len());
    }
}

#[test]
fn a_light_may_be_another_one() {
    let shape = "Shape \"Round\"";
    let gel = format!(
        "{LIGHT} [64 64 64] \"string name\" \"lamp\"
        LightSource \"Gel\" \"light base\" \"lamp\" \"rgb tint\" [0.5 0.25 1] {shape}"
    );
    let plain = format!("{LIGHT} [32 16 64] {shape}");
    same(["", &gel], ["", &plain]);
}

#[test]
fn a_camera_may_be_another_one() {
    let world = format!("{LIGHT} [60 60 60] Shape \"Round\" \"float radius\" 0.5");
    let mirrored = picture(
        "Camera \"Mirrored\" \"camera base\" \"plain\"",
        &world,
        INTERACTIVE,
        Backend::Auto,
    );
    let plain = picture("", &world, INTERACTIVE, Backend::Auto);
    let rows = plain.chunks(32).map(|row| row.iter().rev().copied().collect::<Vec<_>>());
    let turned: Vec<[f32; 3]> = rows.flatten().collect();
    assert!(mirrored == turned && mirrored != plain);
}
