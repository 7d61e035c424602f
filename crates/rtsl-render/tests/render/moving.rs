//! Images of objects that move while the shutter is open, compared with computed ones.

use std::path::PathBuf;

use rtsl_image::Aov;
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, RenderRequest, RenderResult};
use rtsl_scene::INTERACTIVE;
use rtsl_scene::reader::MemoryFiles;

/// One row of pixels, a quarter of a unit wide each, from x = -4 to x = 4, seen along z.
fn head(camera_motion: &str) -> String {
    format!(
        "{camera_motion} LookAt 0 0 -10  0 0 0  0 1 0 Camera \"Orthographic\" \"float scale\" 0.125\n\
         Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 1\n\
         Sampler \"stratified\" \"integer pixelsamples\" 1024\nWorldBegin\nMaterial \"White\"\n"
    )
}

const WHITE: &str = "class White : rt_Material; void shade() { rt_SampleColor = color(1.0); }";

/// From x = -1 to x = 2.
const SLIDE: &str =
    "Translate -1 0 0 ActiveTransform EndTime Translate 3 0 0 ActiveTransform All\n";

fn render(text: &str, aovs: &[Aov]) -> RenderResult {
    let files = [("scene.pbrt", text), ("white.rtsl", WHITE)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        aovs: aovs.to_vec(),
        execution: Execution::on_threads(2),
        load: LoadOptions::with_integrator(INTERACTIVE),
        ..RenderRequest::default()
    };
    render_scene_from(&request, &MemoryFiles(files.into()))
        .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

/// The middle of a pixel.
fn place(column: usize) -> f64 {
    (column as f64 + 0.5) * 0.25 - 4.0
}

/// The mean over each pixel of the fraction of time for which `covers` holds at a place and a time.
fn profile(covers: impl Fn(f64, f64) -> bool) -> Vec<f64> {
    const STEPS: usize = 200;
    let part = |step: usize| (step as f64 + 0.5) / STEPS as f64;
    let pixel = |column: usize| {
        let cells = (0..STEPS * STEPS).filter(|cell| {
            let x = place(column) + (part(cell % STEPS) - 0.5) * 0.25;
            covers(x, part(cell / STEPS))
        });
        cells.count() as f64 / (STEPS * STEPS) as f64
    };
    (0..32).map(pixel).collect()
}

fn assert_shows(text: &str, expected: &[f64]) {
    let image = render(text, &[]).image;
    for (column, (pixel, expected)) in image.pixels.iter().zip(expected).enumerate() {
        let found = f64::from(pixel[0]);
        assert!((found - expected).abs() < 0.02, "{column}: {found}, expected {expected}\n{text}");
    }
}

/// A ball of radius 1 that slides, with the motion described in several ways: the row is so low that the ball has
/// nearly constant width over it.
#[test]
fn a_sliding_ball_covers_pixels_for_its_time() {
    let expected = profile(|x, time| (x - (3.0 * time - 1.0)).abs() < 1.0);
    let still = head("");
    // A motion of the camera is the inverse motion of the world.
    let camera = "ActiveTransform EndTime Translate 3 0 0 ActiveTransform All Translate -1 0 0";
    let half = "Translate -0.5 0 0 ActiveTransform EndTime Translate 1.5 0 0 ActiveTransform All\n";
    for text in [
        format!("{still}{SLIDE}Shape \"Sphere\"\n"),
        format!(
            "{still}ObjectBegin \"ball\" Shape \"Sphere\" ObjectEnd {SLIDE} ObjectInstance \"ball\"\n"
        ),
        format!(
            "{still}ObjectBegin \"ball\" {SLIDE} Shape \"Sphere\" ObjectEnd ObjectInstance \"ball\"\n"
        ),
        format!(
            "{still}ObjectBegin \"ball\" {half} Shape \"Sphere\" ObjectEnd {half} ObjectInstance \"ball\"\n"
        ),
        format!("{}Shape \"Sphere\"\n", head(camera)),
    ] {
        assert_shows(&text, &expected);
    }
}

#[test]
fn a_growing_ball_covers_pixels_for_its_time() {
    let text = format!(
        "{}ActiveTransform EndTime Scale 3 3 3 ActiveTransform All Shape \"Sphere\"\n",
        head("")
    );
    assert_shows(&text, &profile(|x, time| x.abs() < 1.0 + 2.0 * time));
}

#[test]
fn the_shutter_decides_what_is_seen() {
    let text = head("").replace(
        "\"float scale\" 0.125",
        "\"float scale\" 0.125 \"float shutteropen\" 0.5 \"float shutterclose\" 0.75",
    );
    let expected = profile(|x, time| (x - (3.0 * (0.5 + 0.25 * time) - 1.0)).abs() < 1.0);
    assert_shows(&format!("{text}{SLIDE}Shape \"Sphere\"\n"), &expected);
}

#[test]
fn distances_and_normals_are_those_of_the_rays_time() {
    // A wall that turns by 60 degrees about y, and one that goes 2 away.
    let turning = format!(
        "{}ActiveTransform EndTime Rotate 60 0 1 0 ActiveTransform All Scale 9 9 1 Shape \"disk\"\n",
        head("")
    );
    let image = &render(&turning, &[Aov::Normal]).aovs[0];
    let normal = image.pixel(16);
    let angle = 60_f32.to_radians();
    // The means of sine and cosine up to there.
    let expected = [0.5 / angle, 0.0, 0.75_f32.sqrt() / angle];
    for (found, expected) in normal.iter().zip(expected) {
        assert!((found.abs() - expected).abs() < 0.01, "{normal:?}");
    }
    let leaving = format!(
        "{}ActiveTransform EndTime Translate 0 0 2 ActiveTransform All Scale 9 9 1 Shape \"disk\"\n",
        head("")
    );
    let distance = render(&leaving, &[Aov::Distance]).aovs[0].values[16];
    assert!((distance - 11.0).abs() < 0.01, "{distance}");
}
