//! Shapes of pbrt's format: the areas that pictures show of them.

use std::f64::consts::PI;
use std::path::PathBuf;

use rtsl_render::request::render_scene_from;
use rtsl_render::{LoadOptions, Messages, RenderRequest};
use rtsl_scene::INTERACTIVE;
use rtsl_scene::reader::MemoryFiles;

/// A picture of the square from -1 to 1, in which shapes are white.
const HEAD: &str = "LookAt 0 0 -5  0 0 0  0 1 0\n\
    Camera \"Orthographic\" \"float scale\" 1\n\
    Film \"rgb\" \"integer xresolution\" 64 \"integer yresolution\" 64\n\
    Sampler \"stratified\" \"integer pixelsamples\" 16\nWorldBegin\nMaterial \"White\"\n";

const WHITE: &str = "class White : rt_Material; void shade() { rt_SampleColor = color(1.0); }";

fn render(shape: &str) -> Result<f64, Messages> {
    let scene = (PathBuf::from("scene.pbrt"), format!("{HEAD}{shape}"));
    let white = (PathBuf::from("white.rtsl"), WHITE.to_owned());
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        load: LoadOptions::with_integrator(INTERACTIVE),
        ..RenderRequest::default()
    };
    let image = render_scene_from(&request, &MemoryFiles([scene, white].into()))?.image;
    let sum: f64 = image.pixels.iter().map(|pixel| f64::from(pixel[0])).sum();
    Ok(4.0 * sum / image.pixels.len() as f64)
}

/// Asserts that a shape covers an area.
fn covers(shape: &str, expected: f64) {
    let area = render(shape).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    assert!((area - expected).abs() < 0.003 + 0.01 * expected, "{shape}: {area}, not {expected}");
}

const STRAIGHT: &str = "\"point3 P\" [-0.6 0 0  -0.2 0 0  0.2 0 0  0.6 0 0]";

#[test]
fn flat_and_round_curves_face_the_viewer() {
    for turn in ["", "Rotate 77 1 0 0\n"] {
        for kind in ["flat", "cylinder"] {
            let kind = format!("\"string type\" \"{kind}\"");
            covers(&format!("{turn}Shape \"curve\" {kind} {STRAIGHT} \"float width\" 0.2"), 0.24);
        }
    }
    covers(&format!("Shape \"curve\" {STRAIGHT} \"float width0\" 0.2 \"float width1\" 0"), 0.12);
    covers(
        &format!("Shape \"curve\" {STRAIGHT} \"integer splitdepth\" 0 \"float width\" 0.1"),
        0.12,
    );
}

#[test]
fn ribbons_are_as_wide_as_their_normals_face_the_viewer() {
    let ribbon = |normal: &str| {
        format!(
            "Shape \"curve\" \"string type\" \"ribbon\" {STRAIGHT} \"float width\" 0.2 \"normal N\" [{normal}]"
        )
    };
    covers(&ribbon("0 0 1  0 0 1"), 0.24);
    covers(&ribbon("0 0.8660254 -0.5  0 0.8660254 -0.5"), 0.12);
    // From 0 to 90 degrees: the mean of the cosine.
    covers(&ribbon("0 0 1  0 1 0"), 0.24 * 2.0 / PI);
}

#[test]
fn bent_curves_have_neither_gaps_nor_overlaps() {
    // Two cubics are half a circle of radius 0.6 to 0.03 %.
    let k = 0.6 * 0.5522847;
    let points =
        format!("-0.6 0 0  -0.6 {k} 0  -{k} 0.6 0  0 0.6 0  {k} 0.6 0  0.6 {k} 0  0.6 0 0");
    let shape = format!("Shape \"curve\" \"point3 P\" [{points}] \"float width\" 0.3");
    covers(&shape, 0.5 * PI * (0.75 * 0.75 - 0.45 * 0.45));
}

#[test]
fn splines_and_quadratics_are_curves_of_their_own_points() {
    let line = |count: usize| -> String {
        (0..count).map(|index| format!("{} 0 0 ", -0.75 + 0.3 * index as f64)).collect()
    };
    let curve = |parameters: &str, count: usize| {
        format!("Shape \"curve\" {parameters} \"float width\" 0.2 \"point3 P\" [{}]", line(count))
    };
    covers(&curve("\"string basis\" \"bspline\"", 6), 0.2 * 0.9);
    covers(&curve("\"string basis\" \"bspline\" \"integer degree\" 2", 6), 0.2 * 1.2);
    covers(&curve("\"integer degree\" 2", 5), 0.2 * 1.2);
    covers(&curve("", 4), 0.2 * 0.9);
}

#[test]
fn parts_of_quadrics_end_where_they_should() {
    covers(
        "Shape \"disk\" \"float radius\" 0.8 \"float innerradius\" 0.4 \"float phimax\" 90",
        PI * 0.48 / 4.0,
    );
    covers("Shape \"disk\" \"float radius\" 0.8 \"float phimax\" 360", PI * 0.64);
    // Open at both ends, so that the ring's hole shows nothing.
    let ring = "Shape \"sphere\" \"float radius\" 0.8 \"float zmin\" -0.4 \"float zmax\" 0.4";
    covers(ring, PI * 0.16);
    covers(&format!("{ring} \"float phimax\" 90"), PI * 0.16 / 4.0);
    covers("Shape \"sphere\" \"float radius\" 0.8 \"float zmin\" 0", PI * 0.64);
    covers(
        "Shape \"sphere\" \"float radius\" 0.8 \"float zmin\" -0.8 \"float zmax\" 0.8",
        PI * 0.64,
    );
    let upright = "Rotate 90 1 0 0\nShape \"cylinder\" \"float radius\" 0.5 \"float zmin\" -0.2 \"float zmax\" 0.6";
    covers(&format!("{upright} \"float phimax\" 180"), 0.8);
    covers(&format!("{upright} \"float phimax\" 90"), 0.4);
    covers(upright, 0.8);
}

/// In pbrt the angle goes from +x towards +y, and this view shows +x at the left and +y at the top.
#[test]
fn sweeps_begin_at_the_x_axis() {
    let half =
        |shift: &str| format!("{shift}Shape \"disk\" \"float radius\" 1 \"float phimax\" 90");
    // Moved by its radius along both axes, the quarter leaves the picture or does not.
    covers(&half("Translate -1 -1 0\n"), PI / 4.0);
    covers(&half("Translate 1 0 0\n"), 0.0);
    covers(&half("Translate 0 1 0\n"), 0.0);
}

#[test]
fn wrong_curves_are_errors() {
    for (parameters, problem) in [
        (
            "\"point3 P\" [0 0 0 1 0 0]",
            "must be 4 points and 3 more for each further curve, found 2",
        ),
        (
            "\"point3 P\" [0 0 0 1 0 0] \"string basis\" \"bspline\"",
            "must be at least 4 points, found 2",
        ),
        ("\"point3 P\" [0 0 0 1 0]", "takes 3 numbers a value, found 5"),
        ("\"integer degree\" 4", "`degree` of `curve` must be 2 or 3"),
        ("\"string basis\" \"cubic\"", "must be `bezier` or `bspline`"),
        ("\"string type\" \"ribbon\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]", "must be 2 normals"),
    ] {
        let messages = render(&format!("Shape \"curve\" {parameters}")).expect_err(parameters);
        let text = messages.to_text(false);
        assert!(text.contains(problem), "{parameters}: {text}");
    }
}
