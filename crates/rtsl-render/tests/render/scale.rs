//! Pictures do not depend on the unit of length, nor on what else is in the scene; and surfaces of all sizes are lit as
//! they should be, near them.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use rtsl::{Backend, Engine, EngineOptions, Messages};
use rtsl_render::Execution;
use rtsl_render::compiled::RenderScene;
use rtsl_render::schedule::{RenderOptions, render};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};
use rtsl_testing::turns::ways;

/// A ball by its field.
const FIELD: &str = "class Ball : rt_Primitive;
    public float radius = 1.0;
    float field(vec3 p) { return length(p) - radius; }
    void intersect() {
        float speed = length(rt_RayDirection);
        float tolerance = 2e-7 * (radius + length(rt_RayOrigin));
        float side = field(rt_RayOrigin) < 0.0 ? -1.0 : 1.0;
        float t = 0.0;
        for (int i = 0; i < 400 && t < rt_HitDistance && t * speed < 1e3 * (radius + length(rt_RayOrigin)); i++) {
            float apart = side * field(rt_RayOrigin + t * rt_RayDirection);
            if (apart < tolerance && t > 0.0) { hit(t); return; }
            t += max(apart, tolerance) / speed;
        }
    }
    void computeBounds() { rt_BoundMin = vec3(-radius); rt_BoundMax = vec3(radius); }";

fn files(scene: &str) -> MemoryFiles {
    let files = [("scene.pbrt", scene), ("ball.rtsl", FIELD), ("views.rtsl", VIEWS)];
    MemoryFiles(files.map(|(name, text)| (PathBuf::from(name), text.to_owned())).into())
}

fn fail(messages: Messages) -> ! {
    panic!("{}", messages.to_text(false))
}

/// The pixels of a small picture, by the path renderer and without compiling.
fn pixels(engine: &Engine, scene: &str) -> Vec<[f32; 3]> {
    let scene = load_scene(Path::new("scene.pbrt"), &files(scene), &LoadOptions::default());
    let scene = scene.unwrap_or_else(|messages| fail(messages)).scene;
    let mut warnings = Messages::default();
    let scene = RenderScene::new(&scene, engine, &[], &mut warnings, &|_| {});
    let scene = scene.unwrap_or_else(|messages| fail(messages));
    let options = RenderOptions { execution: Execution::on_threads(1), ..RenderOptions::default() };
    let rendered = render(&scene, options).unwrap_or_else(|messages| fail(messages));
    rendered.rendered.image.pixels
}

fn interpreter() -> Engine {
    let backend = Backend::Interpreter;
    let options = EngineOptions { backend, width: Some(8), ..EngineOptions::default() };
    Engine::new(options).expect("it is always there").0
}

/// A name, and the text of a shape by its radius.
type NamedShape = (&'static str, fn(f64) -> String);

/// Shapes whose surface passes through the origin, where its normal is along y, by functions of a radius; the inside is
/// below.
const SHAPES: &[NamedShape] = &[
    ("sphere", |r| format!("Translate 0 {} 0 Shape \"Sphere\" \"float radius\" {r}", -r)),
    ("sphere in the world", |r| {
        format!("Shape \"Sphere\" \"point3 center\" [0 {} 0] \"float radius\" {r}", -r)
    }),
    ("scaled sphere", |r| {
        format!("Translate 0 {} 0 Scale {r} {r} {} Shape \"Sphere\"", -r, 2.0 * r)
    }),
    ("partial sphere", |r| {
        format!(
            "Translate 0 {} 0 Rotate 90 0 0 1 Shape \"PartialSphere\" \"float radius\" {r}
            \"float yMin\" {} \"float yMax\" {} \"float sweep\" 300",
            -r,
            -0.7 * r,
            0.7 * r
        )
    }),
    ("cylinder", |r| {
        format!(
            "Translate 0 {} 0 Rotate 90 0 0 1 Shape \"Cylinder\" \"float radius\" {r}
            \"float yMin\" {} \"float yMax\" {r}",
            -r, -r
        )
    }),
    ("partial cylinder", |r| {
        format!(
            "Translate 0 {} 0 Rotate 90 0 0 1 Shape \"PartialCylinder\" \"float radius\" {r}
            \"float yMin\" {} \"float yMax\" {r} \"float sweep\" 300",
            -r, -r
        )
    }),
    ("cone", |r| {
        format!(
            "Rotate 63.43494882292201 0 0 1 Translate {} {} 0 Shape \"Cone\" \"float radius\" {r}
            \"float topRadius\" {} \"float yMin\" 0 \"float yMax\" {r}",
            -0.75 * r,
            -0.5 * r,
            0.5 * r
        )
    }),
    ("end of a cone", |r| {
        format!(
            "Translate 0 {} 0 Shape \"Cone\" \"float radius\" {} \"float topRadius\" {r} \"float yMin\" 0
            \"float yMax\" {r}",
            -r,
            0.5 * r
        )
    }),
    ("disk", |r| {
        format!("Translate 0 {} 0 Shape \"Disk\" \"float radius\" {r} \"float height\" {r}", -r)
    }),
    ("partial disk", |r| {
        format!(
            "Translate {} {} 0 Shape \"PartialDisk\" \"float radius\" {r} \"float height\" {r} \"float sweep\" 300",
            -0.5 * r,
            -r
        )
    }),
    ("torus", |r| {
        format!(
            "Translate {} {} 0 Shape \"Torus\" \"float majorRadius\" {r} \"float minorRadius\" {}",
            -r,
            -0.25 * r,
            0.25 * r
        )
    }),
    ("superquadric", |r| {
        format!(
            "Translate 0 {} 0 Shape \"Superquadric\" \"vector3 radii\" [{} {r} {}] \"float profile\" 0.8
            \"float section\" 0.5",
            -r,
            1.5 * r,
            0.7 * r
        )
    }),
    ("end of a round cone", |r| {
        format!(
            "Translate 0 {} 0 Shape \"RoundCone\" \"point3 start\" [0 0 0] \"point3 end\" [0 {} 0]
            \"float startRadius\" {r} \"float endRadius\" {r}",
            -2.0 * r,
            r
        )
    }),
    ("side of a round cone", |r| {
        format!(
            "Shape \"RoundCone\" \"point3 start\" [{} {} 0] \"point3 end\" [{r} {} 0]
            \"float startRadius\" {r} \"float endRadius\" {r}",
            -r, -r, -r
        )
    }),
    ("union", |r| {
        format!(
            "Translate 0 {} 0 Shape \"SdfUnion\" \"point3 centers\" [0 0 0 0 {} 0] \"float radii\" [{r} {}]
            \"float blend\" 0",
            -r,
            -0.5 * r,
            0.5 * r
        )
    }),
    ("field", |r| format!("Translate 0 {} 0 Shape \"Ball\" \"float radius\" {r}", -r)),
];

/// A ribbon through the origin that faces each ray: its rays begin outside of the strand that it stands for.
const STRAND: NamedShape = ("curve", |r| {
    format!(
        "Shape \"curve\" \"point3 P\" [{0} 0 0  {1} 0 0  {2} 0 0  {r} 0 0] \"float width\" {3}
        \"string type\" \"cylinder\"",
        -r,
        -r / 3.0,
        r / 3.0,
        0.2 * r
    )
});

/// Looks down at the origin in the left half of the picture, and up in the right half, from a height.
const VIEWS: &str = "class Views : rt_Camera;
    public float height = 1.0;
    public float width = 0.0;
    void generateRay() {
        float side = rt_ScreenCoord.x < 0.5 ? 1.0 : -1.0;
        rt_RayOrigin = vec3(width * rt_ScreenCoord, height * side).xzy;
        rt_RayDirection = vec3(0.0, -side, 0.0);
    }";

/// A scene with a red lamp above the origin, and a green one below, of the irradiance 10 at twice the camera's height.
fn between_lamps(height: f64, shape: &str) -> String {
    format!(
        "Camera \"Views\" \"float height\" {height} \"float width\" {2}
        Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 1
        Integrator \"Whitted\"\nSampler \"independent\" \"integer pixelsamples\" 1\nWorldBegin
        LightSource \"point\" \"rgb I\" [{0} 0 0] \"point3 from\" [0 {1} 0]
        LightSource \"point\" \"rgb I\" [0 {0} 0] \"point3 from\" [0 -{1} 0]
        Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n{shape}\n",
        10.0 * (2.0 * height) * (2.0 * height),
        2.0 * height,
        1e-3 * height,
    )
}

/// Both sides of shapes are lit by the lamp of their side, and no light leaks through. Radii from a thousandth to ten
/// million take turns among the shapes; all have the greatest one.
#[test]
fn surfaces_of_all_sizes_are_lit() {
    let engine = interpreter();
    let mut wrong = String::new();
    for (index, (name, shape)) in SHAPES.iter().chain([&STRAND]).enumerate() {
        let radii: [f64; 10] = [1e-3, 1e4, 1e-2, 1e5, 1e-1, 1e6, 1.0, 1e3, 1e1, 1e2];
        for radius in ways(&radii, index).into_iter().chain([1e7]) {
            // Within the shape, and no nearer than some roundings of its coordinates.
            let height = (0.05 * radius).min(5.0).max(1e-6 * radius);
            let pixels = pixels(&engine, &between_lamps(height, &shape(radius)));
            let rounding = 8.0 * 6e-8 * radius / height;
            if let Some(pixel) = wrong_pixel(&pixels, 1e-4 + rounding) {
                let _ = writeln!(wrong, "{name}, radius {radius}: {pixel:?}");
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// A pixel with the wrong radiance from the lamp on its side, or any from the other one.
fn wrong_pixel(pixels: &[[f32; 3]], allowed: f64) -> Option<[f32; 3]> {
    let lit = 5.0 / std::f64::consts::PI;
    let is_wrong = |(index, pixel): (usize, &[f32; 3])| {
        let sides = if index < pixels.len() / 2 { [0, 1] } else { [1, 0] };
        let [seen, leaked] = sides.map(|channel: usize| f64::from(pixel[channel]));
        ((seen - lit).abs() > allowed * lit || leaked != 0.0).then_some(*pixel)
    };
    pixels.iter().enumerate().find_map(is_wrong)
}

/// A camera far above a surface, or near it, sees the shadow of a thing that all but touches it.
#[test]
fn things_cast_shadows_from_where_they_touch() {
    let engine = interpreter();
    let mut wrong = String::new();
    let turns = |(index, it)| ways(&[0.05, 1e3], index).into_iter().map(move |height| (height, it));
    for (height, (name, shape)) in SHAPES.iter().enumerate().flat_map(turns) {
        let scene = |thing: &str| {
            format!(
                "Camera \"Views\" \"float height\" {height}
                Film \"rgb\" \"integer xresolution\" 2 \"integer yresolution\" 1
                Integrator \"path\" \"integer maxdepth\" 1\nSampler \"independent\" \"integer pixelsamples\" 1
                WorldBegin LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [0.03 0.03 0]
                {thing} Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] {}",
                shape(1.0)
            )
        };
        let thing = "AttributeBegin Translate 1.2e-5 1.2e-5 0 Shape \"Sphere\" \"float radius\" 4e-6 AttributeEnd";
        let [lit, shadowed] = ["", thing].map(|thing| pixels(&engine, &scene(thing))[0][0]);
        // The field's own search ends farther off the surface for a camera far away.
        let is_vague = *name == "field" && height > 1.0;
        if lit < 30.0 || (shadowed > 0.0 && !is_vague) {
            let _ = writeln!(wrong, "{name} from {height}: {lit} {shadowed}");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// A picture at a scale, with a floor so many times as large as the rest.
fn scene_at(integrator: &str, scale: f64, floor: f64) -> String {
    let half = scale * floor;
    let lengths = |values: &[f64]| {
        let mut text = String::new();
        values.iter().for_each(|value| _ = write!(text, "{} ", value * scale));
        text
    };
    let mut text = format!(
        "LookAt {}  {}  0 1 0\nCamera \"perspective\" \"float fov\" 40
        Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16
        Sampler \"independent\" \"integer pixelsamples\" 1\nIntegrator {integrator}\nWorldBegin\n",
        lengths(&[0.0, 3.0, -4.0]),
        lengths(&[0.0, 0.5, 0.0]),
    );
    let square = scale * scale;
    let _ = write!(
        text,
        "LightSource \"point\" \"rgb I\" [{0} {0} {0}] \"point3 from\" [{1}]
        LightSource \"infinite\" \"rgb L\" [0.2 0.2 0.2]
        Material \"diffuse\" \"rgb reflectance\" [0.5 0.3 0.1]
        AttributeBegin Translate {2} Shape \"sphere\" \"float radius\" {3} AttributeEnd
        AttributeBegin Translate {4} Shape \"Cylinder\" \"float radius\" {5} \"float yMin\" 0 \"float yMax\" {3} AttributeEnd
        AttributeBegin Translate {6} Shape \"Cone\" \"float radius\" {5} \"float yMax\" {3} AttributeEnd
        AttributeBegin Translate {7} Rotate 40 1 0 0 Shape \"Torus\" \"float majorRadius\" {5} \"float minorRadius\" {8}
        AttributeEnd
        Shape \"trianglemesh\" \"point3 P\" [{9}] \"integer indices\" [0 1 2 0 2 3 0 1 3]
        Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]
        Shape \"bilinearmesh\" \"point3 P\" [{10} 0 {10}  {11} 0 {10}  {10} 0 {11}  {11} 0 {11}]\n",
        20.0 * square,
        lengths(&[2.0, 5.0, -2.0]),
        lengths(&[0.0, 0.6, 0.0]),
        0.6 * scale,
        lengths(&[1.0, 0.0, -1.0]),
        0.4 * scale,
        lengths(&[-1.1, 0.0, -0.6]),
        lengths(&[-0.2, 0.5, 1.4]),
        0.15 * scale,
        lengths(&[0.9, 0.0, 0.9, 1.7, 0.0, 0.8, 1.2, 0.9, 1.0, 1.3, 0.1, 1.6]),
        -half,
        half,
    );
    text
}

/// Checks pictures of scaled scenes, with floors of many sizes. Rounding may move edges across a few samples.
fn check_scales(integrator: &str, scenes: &[(f64, f64)]) {
    let engine = interpreter();
    let picture = |scale, floor| pixels(&engine, &scene_at(integrator, scale, floor));
    let expected = picture(1.0, 1e2);
    let mean = expected.iter().map(|pixel| pixel[0]).sum::<f32>() / expected.len() as f32;
    for (scale, floor) in scenes {
        let found = picture(*scale, *floor);
        let pairs = expected.iter().zip(&found);
        let apart = pairs.map(|(one, other)| (one[0] - other[0]).abs() / mean);
        let (least, most) =
            (apart.clone().filter(|it| *it > 1e-4).count(), apart.fold(0.0, f32::max));
        assert!(least <= 6, "{integrator}, scale {scale}, floor {floor}: {least} pixels, {most}");
    }
}

#[test]
fn pictures_do_not_depend_on_the_unit_of_length() {
    check_scales("\"Whitted\"", &[(1.0 / f64::from(1 << 17), 1e7), (1e5, 1e3)]);
    check_scales("\"path\" \"integer maxdepth\" 2", &[(1e-5, 1e2), (1e5, 1e7)]);
}

/// Cameras see what is near, however large the scene is.
#[test]
fn a_floor_does_not_hide_what_stands_on_it() {
    let engine = interpreter();
    let scene = "LookAt 0 1 -4  0 1 0  0 1 0\nCamera \"perspective\" \"float fov\" 10
        Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4
        Sampler \"independent\" \"integer pixelsamples\" 1\nWorldBegin
        Material \"diffuse\" \"rgb reflectance\" [0 0 0]
        AreaLightSource \"diffuse\" \"rgb L\" [1 0 0]
        AttributeBegin Translate 0 1 0 Shape \"sphere\" \"float radius\" 1 AttributeEnd
        AreaLightSource \"diffuse\" \"rgb L\" [0 0 1]
        Shape \"bilinearmesh\" \"point3 P\" [-1e5 0 -1e5  1e5 0 -1e5  -1e5 0 1e5  1e5 0 1e5]";
    for integrator in ["Integrator \"Whitted\"", "Integrator \"path\""] {
        let pixels = pixels(&engine, &format!("{integrator}\n{scene}"));
        assert!(pixels.iter().all(|pixel| *pixel == [1.0, 0.0, 0.0]), "{integrator}: {pixels:?}");
    }
}
