//! Outputs of integrators as AOVs.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use expect_test::{Expect, expect};
use rtsl::{Backend, EngineOptions, Messages};
use rtsl_image::{
    Aov, AovImage, AovType, ExrOptions, ExrPrecision, ImageOptions, write_image_with,
};
use rtsl_render::checkpoint::{Checkpoint, Numbers, Section};
use rtsl_render::request::render_scene_from;
use rtsl_render::{CheckpointRequest, Execution, Progress, RenderRequest, RenderResult};
use rtsl_scene::reader::MemoryFiles;

/// Columns and rows of a quarter of a unit, with four samples in each pixel, one in each quarter.
const HEAD: &str = r#"
LookAt 0 0 -5  0 0 0  0 1 0
Camera "Orthographic" "float scale" 2
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
Sampler "stratified" "integer xsamples" 2 "integer ysamples" 2 "bool jitter" false
"#;

/// A ball before a wall, among which kernels search.
const FEW: &str = "WorldBegin
    LightSource \"distant\"
    Shape \"sphere\"
    Translate 0 0 3 Shape \"disk\" \"float radius\" 1.7";

/// The integrators of these tests.
const CLASSES: &str = "
class Known : rt_Integrator;
output float across;
output float odd;
output int cell;
output uint row;
output bool isRight;
output color tint;
output vec2 place;
output vec3 direction;
output vec4 whole;
output ivec2 cells;
output bvec3 signs;
output int quarter;
output float thickness;
output mat3 basis;
output float many[3];
void radiance() {
    vec2 at = rt_RayOrigin.xy;
    vec2 within = fract(4.0 * at);
    across = at.x;
    quarter = (within.x < 0.5 ? 1 : 2) + (within.y < 0.5 ? 0 : 2);
    odd = quarter == 1 ? 1.0 / (at.x - at.x) : 4.0;
    cell = int(floor(4.0 * at.x));
    row = uint(floor(4.0 * (2.0 - at.y)));
    isRight = at.x > 0.0;
    tint = color(0.25, 0.5, 1.0) * at.x;
    place = at;
    cells = ivec2(cell, 70000);
    whole = vec4(at, rt_RayOrigin.z, 1.0);
    basis = mat3(1.0);
    many[1] = at.x;
    rt_Surface surface = nearestHit();
    signs = bvec3(surface.found, at.y > 0.0, true);
    if (!surface.found) return;
    direction = surface.direction;
    rt_SampleColor = color(0.5);
    for (int count = 0; surface.found && count < 8; ++count) {
        rt_Surface next = surface.follow(surface.direction, 0.0);
        if (next.found) thickness += distance(surface.point, next.point);
        surface = next;
    }
}

class Nested : rt_Integrator;
output int depth;
output vec3 origin;
void radiance() {
    depth = int(rt_RayDepth) + 5;
    origin = rt_RayOrigin;
    if (rt_RayDepth < 3.0) rt_SampleColor = 0.5 * trace(vec3(0.0, 9.0, 0.0), vec3(0.0, 1.0, 0.0));
    else rt_SampleColor = color(1.0);
}

class Renamed : rt_Integrator;
output float samples;
output int distance;
output float albedo;
output float Z;
void radiance() { samples = 7.0; distance = -3; albedo = 0.5; Z = 2.0; }

class Bare : rt_Integrator;
void radiance() { rt_SampleColor = color(1.0); }
";

fn try_render(
    class: &str,
    world: &str,
    names: &[&str],
    how: RenderRequest<'_>,
) -> Result<RenderResult, Messages> {
    let text = format!("{HEAD}Integrator \"{class}\"\n{world}");
    let files = [("scene.pbrt", text), ("own.rtsl", CLASSES.to_owned())];
    let files = files.map(|(name, text)| (PathBuf::from(name), text));
    let aovs = names.iter().map(|name| Aov::from_name(name)).collect();
    let request = RenderRequest { scene: Path::new("scene.pbrt").into(), aovs, ..how };
    render_scene_from(&request, &MemoryFiles(files.into()))
}

fn render(class: &str, world: &str, names: &[&str], how: RenderRequest<'_>) -> RenderResult {
    try_render(class, world, names, how)
        .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn on(backend: Backend, width: u32, threads: usize) -> RenderRequest<'static> {
    let engine = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
    let execution = Execution::on_threads(threads);
    RenderRequest { engine, execution, ..RenderRequest::default() }
}

fn bits(result: &RenderResult) -> Vec<u32> {
    let aovs = result.aovs.iter().flat_map(|aov| &aov.values);
    result.image.pixels.iter().flatten().chain(aovs).map(|value| value.to_bits()).collect()
}

const KNOWN: [&str; 13] = [
    "across",
    "odd",
    "cell",
    "row",
    "isRight",
    "tint",
    "place",
    "direction",
    "whole",
    "cells",
    "signs",
    "quarter",
    "thickness",
];

/// Returns the image of an output of `Known`.
fn image<'a>(result: &'a RenderResult, name: &str) -> &'a AovImage {
    result.aovs.iter().find(|image| image.aov.name() == name).expect("it was asked for")
}

/// Checks each pixel of an output against a function of its column, its row, and the coordinates of its middle.
fn assert_is<const N: usize>(
    result: &RenderResult,
    name: &str,
    ty: AovType,
    expected: impl Fn((usize, usize), [f32; 2]) -> [f32; N],
) {
    let image = image(result, name);
    assert_eq!((image.ty, image.values.len()), (ty, 256 * N), "{name}");
    for (index, found) in image.pixels().enumerate() {
        let (column, row) = (index % 16, index / 16);
        let middle = [column as f32 * 0.25 - 1.875, 1.875 - row as f32 * 0.25];
        let expected = expected((column, row), middle);
        let is_near = found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-5);
        assert!(is_near, "{name} ({column}, {row}): {found:?}, expected {expected:?}");
    }
}

#[test]
fn each_type_has_the_values_that_the_class_computes() {
    let result = &render("Known", FEW, &KNOWN, on(Backend::Auto, 8, 2));
    assert_is(result, "across", AovType::Float, |_, [x, _]| [x]);
    // The infinite sample of four counts as 0.
    assert_is(result, "odd", AovType::Float, |_, _| [3.0]);
    assert_is(result, "cell", AovType::Integer, |(column, _), _| [column as f32 - 8.0]);
    assert_is(result, "row", AovType::Integer, |(_, row), _| [row as f32]);
    let is_right = |column: usize| f32::from(u8::from(column > 7));
    assert_is(result, "isRight", AovType::Bool, |(column, _), _| [is_right(column)]);
    assert_is(result, "tint", AovType::Color, |_, [x, _]| [0.25 * x, 0.5 * x, x]);
    assert_is(result, "place", AovType::Vector(2), |_, middle| middle);
    assert_is(result, "whole", AovType::Vector(4), |_, [x, y]| [x, y, -5.0, 1.0]);
    let cells = |(column, _): (usize, usize), _| [column as f32 - 8.0, 70000.0];
    assert_is(result, "cells", AovType::IntegerVector(2), cells);
    // Of the first sample, not a mean.
    let quarters = &image(result, "quarter").values;
    assert!(quarters.iter().all(|quarter| (1.0..=4.0).contains(quarter) && quarter.fract() == 0.0));
    // In the middle a ray passes the ball, which is 2 thick and 2 before the wall; in the corner it hits nothing.
    let at = |name: &str, pixel: usize| image(result, name).pixel(pixel);
    let thickness = at("thickness", 8 * 16 + 8)[0];
    assert!((3.9..=4.0).contains(&thickness), "{thickness}");
    assert_eq!(at("thickness", 0), [0.0]);
    assert_eq!([at("direction", 8 * 16 + 8), at("direction", 0)], [[0.0, 0.0, 1.0], [0.0; 3]]);
    assert_eq!([at("signs", 7 * 16 + 7), at("signs", 255)], [[1.0; 3], [0.0, 0.0, 1.0]]);
}

/// Balls of a hierarchy, some of which let rays pass.
fn many() -> String {
    let ball = |index: usize| {
        let (x, y) = (index % 6, index / 6);
        let alpha = if index % 7 == 3 { "\"float alpha\" 0.5" } else { "" };
        format!(
            "AttributeBegin Translate {} {} {} Shape \"sphere\" \"float radius\" 0.4 {alpha}\n\
             AttributeEnd\n",
            x as f32 * 0.6 - 1.5,
            y as f32 * 0.6 - 1.5,
            index % 3,
        )
    };
    let balls: String = (0..36).map(ball).collect();
    format!("WorldBegin\nLightSource \"distant\"\n{balls}")
}

#[test]
fn outputs_have_the_same_bits_however_they_are_made() {
    for world in [FEW, &many()] {
        let both = [&KNOWN[..], &["distance", "object"]].concat();
        let reference = render("Known", world, &both, on(Backend::Interpreter, 1, 1));
        for (width, threads) in [(1, 2), (4, 1), (8, 3), (16, 1)] {
            let made = render("Known", world, &both, on(Backend::Auto, width, threads));
            assert!(bits(&made) == bits(&reference), "width {width}, {threads} threads");
        }
        // Each image alone has the values that it has among others.
        for names in [&["thickness"][..], &["distance"], &["object", "cells"]] {
            let alone = render("Known", world, names, on(Backend::Auto, 8, 1));
            assert_eq!(alone.image, reference.image);
            let names = names.iter().zip(&alone.aovs);
            names.for_each(|(name, made)| assert!(made == image(&reference, name), "{name}"));
        }
    }
}

/// Rays that `trace` traces have outputs of their own, which no image shows.
#[test]
fn outputs_are_those_of_camera_rays() {
    for backend in [Backend::Interpreter, Backend::Auto] {
        let result = &render("Nested", FEW, &["depth", "origin"], on(backend, 8, 1));
        assert_eq!(result.image.pixels[0], [0.125; 3]);
        assert_is(result, "depth", AovType::Integer, |_, _| [5.0]);
        assert_is(result, "origin", AovType::Vector(3), |_, [x, y]| [x, y, -5.0]);
    }
}

#[test]
fn outputs_have_precedence_over_images_of_the_renderer() {
    let images = |class: &str, names: &[&str]| -> Vec<(String, AovType, f32)> {
        let result = render(class, FEW, names, on(Backend::Auto, 8, 1));
        let value = |image: &AovImage| image.pixel(8 * 16 + 8)[0];
        let image = |it: &AovImage| (it.aov.name().to_owned(), it.ty, value(it));
        result.aovs.iter().map(image).collect()
    };
    let found = images("Renamed", &["samples", "distance", "depth", "albedo", "samples"]);
    let expected = [
        ("samples".to_owned(), AovType::Float, 7.0),
        ("distance".to_owned(), AovType::Integer, -3.0),
        ("albedo".to_owned(), AovType::Float, 0.5),
    ];
    assert_eq!(found, expected);
    // Another name of the distance, except where the class has an output of this name.
    let [depth, distance] = &images("Depth", &["depth", "distance"])[..] else { panic!() };
    assert_eq!([&*depth.0, &*distance.0], ["depth", "distance"]);
    assert!((depth.2 - distance.2).abs() < 1e-4, "{depth:?} {distance:?}");
    let [distance] = &images("Bare", &["depth", "distance"])[..] else { panic!() };
    assert_eq!((&*distance.0, distance.1), ("distance", AovType::Float));
}

#[test]
fn a_denoiser_is_helped_by_what_there_is() {
    let names = |class: &str, names: &[&str]| -> Vec<String> {
        let how = RenderRequest { for_denoiser: true, ..on(Backend::Auto, 8, 1) };
        let result = render(class, FEW, names, how);
        result.aovs.iter().map(|image| image.aov.name().to_owned()).collect()
    };
    assert_eq!(names("Path", &[]), ["albedo", "normal"]);
    assert_eq!(names("Path", &["distance", "normal"]), ["distance", "normal", "albedo"]);
    assert_eq!(names("Whitted", &[]), ["normal"]);
    assert_eq!(names("Bare", &["object"]), ["object"]);
    // A number is no albedo.
    assert!(names("Renamed", &[]).is_empty());
}

#[test]
fn images_that_are_not_there_are_errors() {
    let said = |class: &str, name: &str, expected: Expect| {
        let result = try_render(class, FEW, &[name], on(Backend::Auto, 8, 1));
        expected.assert_eq(&result.err().map_or(String::new(), |it| it.to_text(false)));
    };
    said(
        "Known",
        "thicknes",
        expect![[r#"
        error[E0624]: `Known` has no output `thicknes`, and the renderer makes no image of this name
         = help: did you mean `thickness`?
         = help: outputs of `Known`: across, odd, cell, row, isRight, tint, place, direction, whole, cells, signs, quarter, thickness
         = help: images of the renderer: distance, object, class, samples, variance, time, nodes, lanes

    "#]],
    );
    said(
        "Bare",
        "albedo",
        expect![[r#"
        error[E0624]: `Bare` has no output `albedo`, and the renderer makes no image of this name
         = help: outputs of `Bare`: none
         = help: images of the renderer: distance, object, class, samples, variance, time, nodes, lanes

    "#]],
    );
    said(
        "Known",
        "basis",
        expect![[r#"
        error[E0624]: the output `basis` of `Known` is of type `mat3`, which no image has
         = help: images show numbers, truth values, colours and vectors: declare an output for each part

    "#]],
    );
    said(
        "Known",
        "many",
        expect![[r#"
        error[E0624]: the output `many` of `Known` is of type `float[3]`, which no image has
         = help: images show numbers, truth values, colours and vectors: declare an output for each part

    "#]],
    );
}

/// Renders with a checkpoint, and stops after so many wavefronts.
fn kept(
    folder: &Path,
    names: &[&str],
    stop_after: Option<usize>,
) -> Result<RenderResult, Messages> {
    let stop = AtomicBool::new(false);
    let progress = |progress: Progress| {
        if let (Progress::Rendering(tiles), Some(count)) = (progress, stop_after) {
            stop.fetch_or(tiles.done >= count, Ordering::Relaxed);
        }
    };
    let path = folder.join("kept.checkpoint");
    let how = RenderRequest {
        checkpoint: Some(CheckpointRequest { path, every: None, resume: true }),
        execution: Execution { cancel: Some(&stop), ..Execution::on_threads(1) },
        progress: Some(&progress),
        samples: Some(64),
        ..on(Backend::Auto, 8, 1)
    };
    try_render("Known", FEW, names, how)
}

#[test]
fn a_resumed_render_has_the_outputs_of_one_that_was_not_interrupted() {
    let names = ["whole", "thickness", "object", "tint", "quarter", "cells", "distance"];
    let how = RenderRequest { samples: Some(64), ..on(Backend::Auto, 16, 2) };
    let whole = render("Known", FEW, &names, how);
    let folder = tempfile::tempdir().unwrap();
    let mut stopped = 0;
    for count in [1, 3, 2] {
        let result = kept(folder.path(), &names, Some(count)).unwrap();
        stopped += usize::from(result.statistics.cancelled);
        assert!(bits(&result) != bits(&whole));
    }
    assert_eq!(stopped, 3);
    assert!(bits(&kept(folder.path(), &names, None).unwrap()) == bits(&whole));
    // The order of the request is not one of the render.
    let mut others = names;
    others.reverse();
    kept(folder.path(), &others, None).unwrap();
    for (others, difference) in [
        (
            &["thickness", "object"][..],
            expect![[r#"
            error[E0622]: `/kept.checkpoint` belongs to another render: the checkpoint has outputs cells, quarter, thickness, tint, whole, the render outputs thickness
             = help: restore the difference, or use another checkpoint file for this render

        "#]],
        ),
        (
            &["whole", "thickness", "tint", "quarter", "cells"],
            expect![[r#"
            error[E0622]: `/kept.checkpoint` belongs to another render: the checkpoint has first hits kept, the render first hits not kept
             = help: restore the difference, or use another checkpoint file for this render

        "#]],
        ),
    ] {
        let error = kept(folder.path(), others, None).unwrap_err().to_text(false);
        let error = error.replace(&*folder.path().to_string_lossy(), "");
        difference.assert_eq(&error);
    }
}

/// Checkpoints whose sections are not those of the render are refused, even with the right fingerprint and checksum.
#[test]
fn sections_of_outputs_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["place", "across"];
    kept(folder.path(), &names, Some(1)).unwrap();
    let path = folder.path().join("kept.checkpoint");
    let intact = Checkpoint::read(&path).unwrap();
    let found: Vec<&str> = intact.sections.iter().map(|section| &*section.name).collect();
    let expected = ["taken", "done", "dropped", "seconds", "sums", "squares"];
    assert_eq!(found, [&expected[..], &["output across", "output place"]].concat());
    let refused = |change: &dyn Fn(&mut Vec<Section<'static>>), reason: &str| {
        let mut changed = intact.clone();
        change(&mut changed.sections);
        changed.write(&path).unwrap();
        let error = kept(folder.path(), &names, None).unwrap_err().to_text(false);
        let line = error.lines().next().unwrap_or_default();
        assert!(line.starts_with("error[E0621]"), "{line}");
        assert_eq!(line.split_once(" cannot be resumed: ").map(|(_, reason)| reason), Some(reason));
    };
    refused(&|sections| drop(sections.pop()), "it has no section `output place`");
    let reason = "its section `output place` is not one of this render";
    refused(&|sections| sections.swap(6, 7), reason);
    let reason = "its section `output others` is not one of this render";
    refused(&|sections| sections[7].name = "output others".into(), reason);
    let reason = "its section `output place` has 7 numbers, expected 512";
    refused(&|sections| sections[7].numbers = Numbers::F64(vec![0.0; 7].into()), reason);
    let reason = "its section `output across` has an unexpected type";
    refused(&|sections| sections[6].numbers = Numbers::U32(vec![0; 256].into()), reason);
    intact.write(&path).unwrap();
    kept(folder.path(), &names, None).unwrap();
}

#[test]
fn files_have_channels_of_each_type() {
    let names = ["odd", "isRight", "tint", "place", "whole", "cells", "direction"];
    let result = render("Known", FEW, &names, on(Backend::Auto, 8, 1));
    let folder = tempfile::tempdir().unwrap();
    let exr = ExrOptions { precision: ExrPrecision::Half, multi_part: false };
    let options = ImageOptions { exr, ..ImageOptions::default() };
    write_image_with(&result.image, &result.aovs, &folder.path().join("a.exr"), &options).unwrap();
    let file = exr::prelude::read_all_flat_layers_from_file(folder.path().join("a.exr")).unwrap();
    let channels = file.layer_data[0].channel_data.list.iter();
    let is_half =
        |samples: &exr::prelude::FlatSamples| matches!(samples, exr::prelude::FlatSamples::F16(_));
    let halves = channels.clone().filter(|channel| is_half(&channel.sample_data));
    let halves: Vec<String> = halves.map(|channel| channel.name.to_string()).collect();
    assert_eq!(halves, ["B", "G", "R", "tint.B", "tint.G", "tint.R"]);
    let names_found: Vec<String> = channels.map(|channel| channel.name.to_string()).collect();
    let expected = "B G R cells.X cells.Y direction.X direction.Y direction.Z isRight odd place.X \
                    place.Y tint.B tint.G tint.R whole.W whole.X whole.Y whole.Z";
    assert_eq!(names_found.join(" "), expected);
    write_image_with(&result.image, &result.aovs, &folder.path().join("a.png"), &options).unwrap();
    for name in names {
        assert!(folder.path().join(format!("a.{name}.png")).is_file(), "{name}");
    }
    // The channel of an output named `Z` is not that of distances.
    let result = render("Renamed", FEW, &["Z"], on(Backend::Auto, 8, 1));
    assert_eq!(result.aovs[0].aov.channels(result.aovs[0].ty), ["Z.V"]);
}
