//! Materials with holes, in both renderers and on all backends.

use std::path::{Path, PathBuf};

use rtsl::{Backend, EngineOptions};
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, RenderRequest};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};

/// A floor behind the plane of a shape with holes, in light that comes askew: what is at x on the floor is in the
/// shadow of what is at x + 1 on the plane. Pixels of half a unit, each with a sample at its centre.
const HEAD: &str = r#"
LookAt 0 0 -5  0 0 0  0 1 0
Camera "Orthographic" "float scale" 2
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
Sampler "stratified" "integer xsamples" 1 "integer ysamples" 1 "bool jitter" false
PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
WorldBegin
LightSource "distant" "point3 from" [1 0 -1] "point3 to" [0 0 0] "rgb L" [4.4428829 4.4428829 4.4428829]
Material "diffuse" "rgb reflectance" [1 1 1]
AttributeBegin Translate 0 0 1 Shape "disk" "float radius" 9 AttributeEnd
Material "diffuse" "rgb reflectance" [0 0 0]
"#;

const CLASSES: &str = "
// The left part alone is there.
class Half : rt_Material;
void presence() { rt_Presence = rt_HitPoint.x > 0.0 ? 1.0 : 0.0; }
void BSDF() { rt_BSDFValue = color(0.0); }

class Step : rt_Texture;
void lookup() { rt_FloatTextureValue = rt_HitPoint.x > 0.0 ? 1.0 : 0.0; }
";

const SHAPE: &str = "Shape \"disk\" \"float radius\" 9";

/// The red of a row of pixels, from x = -1.75 on.
fn row(world: &str) -> [[f32; 8]; 3] {
    let ways = [
        (Backend::Interpreter, 1, BATCH),
        (Backend::Jit, 16, BATCH),
        (Backend::Jit, 8, INTERACTIVE),
    ];
    ways.map(|(backend, width, renderer)| {
        let files = [("scene.pbrt", format!("{HEAD}{world}")), ("own.rtsl", CLASSES.to_owned())];
        let files = files.map(|(name, text)| (PathBuf::from(name), text));
        let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
        let request = RenderRequest {
            scene: Path::new("scene.pbrt").into(),
            engine,
            load: LoadOptions::with_integrator(renderer),
            execution: Execution::on_threads(2),
            ..Default::default()
        };
        let result = render_scene_from(&request, &MemoryFiles(files.into()));
        let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        std::array::from_fn(|column| result.image.pixels[4 * 8 + column][0])
    })
}

/// Compares the pixels: the floor is lit where neither it nor the light is behind the shape.
fn check(world: &str, is_lit: impl Fn(f32) -> bool) {
    for row in row(world) {
        for (column, found) in row.into_iter().enumerate() {
            let x = 0.5 * column as f32 - 1.75;
            let expected = if is_lit(x) { 1.0 } else { 0.0 };
            assert!((found - expected).abs() < 1e-4, "{world} at {x}: {row:?}");
        }
    }
}

/// True where the part of the plane with x > 0 hides neither the floor from the camera nor the light from it.
fn beside_half(x: f32) -> bool {
    x + 1.0 < 0.0
}

#[test]
fn rays_and_light_pass_where_a_material_is_absent() {
    check("", |_| true);
    check(SHAPE, |_| false);
    check(&format!("Material \"Half\" {SHAPE}"), beside_half);
}

#[test]
fn materials_on_top_are_absent_where_their_bases_are() {
    let step = "Texture \"step\" \"float\" \"Step\"";
    let black =
        "MakeNamedMaterial \"black\" \"string type\" \"diffuse\" \"rgb reflectance\" [0 0 0]";
    let half = "MakeNamedMaterial \"half\" \"string type\" \"Half\"";
    for material in [
        "Material \"Masked\" \"material base\" \"black\" \"texture opacity\" \"step\"",
        "Material \"Bump\" \"material base\" \"half\" \"texture displacement\" \"step\"",
        "Material \"NormalMap\" \"material base\" \"half\"",
        "Material \"TwoSided\" \"material front\" \"half\"",
        "Material \"Mix\" \"material first\" \"half\" \"material second\" \"half\"",
    ] {
        check(&format!("{step} {black} {half} {material} {SHAPE}"), beside_half);
    }
    let holes = "Material \"Masked\" \"material base\" \"black\" \"float opacity\" 0";
    check(&format!("{black} {holes} {SHAPE}"), |_| true);
    let whole = "Material \"Masked\" \"material base\" \"black\"";
    check(&format!("{step} {black} {whole} {SHAPE} \"texture alpha\" \"step\""), beside_half);
}

#[test]
fn the_models_of_the_library_have_opacities() {
    let step = "Texture \"step\" \"float\" \"Step\"";
    for material in [
        "Material \"OpenPbr\" \"float baseWeight\" 0 \"float specularWeight\" 0 \"texture geometryOpacity\" \"step\"",
        "Material \"StandardSurface\" \"float base\" 0 \"float specular\" 0 \"texture opacity\" \"step\"",
    ] {
        check(&format!("{step} {material} {SHAPE}"), beside_half);
    }
}

#[test]
fn the_alpha_of_a_shape_counts_with_the_presence_of_its_material() {
    let flipped = "Texture \"low\" \"float\" \"mix\" \"texture amount\" \"step\" \"float tex1\" 1 \"float tex2\" 0";
    let world = format!(
        "Texture \"step\" \"float\" \"Step\" {flipped} Material \"Half\" {SHAPE} \"texture alpha\" \"low\""
    );
    check(&world, |_| true);
}
