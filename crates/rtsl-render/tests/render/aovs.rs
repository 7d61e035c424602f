//! AOVs.

use std::path::PathBuf;

use rtsl::EngineOptions;
use rtsl_image::{Aov, AovImage, ImageOptions, write_image_with};
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, Messages, RenderRequest, RenderResult};
use rtsl_scene::INTERACTIVE;
use rtsl_scene::reader::MemoryFiles;

/// A ball before a wall, seen without perspective: columns and rows of a quarter of a unit.
const SCENE: &str = r#"
LookAt 0 0 -5  0 0 0  0 1 0
Camera "Orthographic" "float scale" 2
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
Sampler "stratified" "integer xsamples" 2 "integer ysamples" 2 "bool jitter" false
WorldBegin
LightSource "distant"
Shape "sphere"
Translate 0 0 3
Shape "disk" "float radius" 1.7
"#;

fn render(aovs: &[Aov], threads: usize) -> RenderResult {
    render_with(aovs, threads, EngineOptions::default())
}

fn render_with(aovs: &[Aov], threads: usize, engine: EngineOptions) -> RenderResult {
    try_render(aovs, threads, engine)
        .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn try_render(
    aovs: &[Aov],
    threads: usize,
    engine: EngineOptions,
) -> Result<RenderResult, Messages> {
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), SCENE.to_owned())].into());
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        aovs: aovs.to_vec(),
        execution: Execution::on_threads(threads),
        engine,
        load: LoadOptions::with_integrator(INTERACTIVE),
        ..RenderRequest::default()
    };
    render_scene_from(&request, &files)
}

/// The value near the ball's center, on the wall beside it, and in the corner, where nothing is hit.
fn three_places(image: &AovImage) -> [&[f32]; 3] {
    [8 * 16 + 8, 8 * 16 + 2, 0].map(|pixel: usize| image.pixel(pixel))
}

/// The images of the renderer, and the output of the integrator of [`SCENE`].
fn all() -> Vec<Aov> {
    // The integrator calls `shade`, which says nothing about albedo.
    Aov::ALL.into_iter().filter(|aov| *aov != Aov::Albedo).collect()
}

#[test]
fn each_image_shows_what_it_says() {
    let result = render(&all(), 2);
    let [distance, normal, object, class, samples, variance, time, nodes, lanes] = &result.aovs[..]
    else {
        panic!()
    };
    let [ball, wall, nothing] = three_places(distance).map(|value| value[0]);
    assert!((4.0..4.05).contains(&ball) && (wall - 8.0).abs() < 1e-5, "{ball} {wall}");
    assert_eq!(nothing, f32::INFINITY);
    let [ball, wall, nothing] = three_places(normal);
    // Right of and below the middle; the disk's normal points along +z.
    assert!(ball[0] > 0.05 && ball[1] < -0.05 && ball[2] < -0.9, "{ball:?}");
    assert_eq!([wall, nothing], [[0.0, 0.0, 1.0], [0.0; 3]]);
    let numbers = |image: &AovImage| three_places(image).map(|value| value[0]);
    assert_eq!(numbers(object), [0.0, 1.0, -1.0]);
    assert_eq!(numbers(class), [0.0, 1.0, -1.0]);
    assert_eq!(result.statistics.object_classes, ["Sphere", "Disk"]);
    assert!(samples.values.iter().all(|value| *value == 4.0));
    assert!(variance.values.iter().all(|value| *value >= 0.0));
    assert!(time.values.iter().all(|value| *value > 0.0));
    // The root is a run with a leaf for each class.
    assert!(nodes.values.iter().all(|value| *value == 2.0), "{:?}", nodes.values);
    let [ball, wall, nothing] = three_places(lanes).map(|value| value[0]);
    assert!(ball == wall && wall == nothing, "all tiles see the same, mirrored");
    assert!(0.5 < ball && ball < 1.0, "{ball}");
}

#[test]
fn a_single_lane_is_always_used() {
    let engine = EngineOptions { width: Some(1), ..EngineOptions::default() };
    let result = render_with(&[Aov::Lanes], 1, engine);
    assert!(result.aovs[0].values.iter().all(|value| *value == 1.0));
}

#[test]
fn the_picture_does_not_depend_on_them_nor_they_on_threads() {
    let constant: Vec<Aov> = all().into_iter().filter(|aov| *aov != Aov::Time).collect();
    let (with, alone) = (render(&constant, 1), render(&[], 1));
    assert_eq!(with.image, alone.image);
    assert_eq!(with.aovs, render(&constant, 2).aovs);
    assert_eq!(with.statistics.rays, alone.statistics.rays);
}

#[test]
fn files_hold_all_of_them() {
    let result = render(&[Aov::Normal, Aov::Distance], 2);
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let options = ImageOptions::default();
    write_image_with(&result.image, &result.aovs, &folder.join("aovs.exr"), &options).unwrap();
    let file = exr::prelude::read_all_flat_layers_from_file(folder.join("aovs.exr")).unwrap();
    let channels = &file.layer_data[0].channel_data.list;
    let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    assert_eq!(names, ["B", "G", "R", "Z", "normal.X", "normal.Y", "normal.Z"]);
    let distances: Vec<f32> = channels[3].sample_data.values_as_f32().collect();
    assert_eq!(distances, result.aovs[1].values);

    write_image_with(&result.image, &result.aovs, &folder.join("aovs.png"), &options).unwrap();
    for name in ["aovs.png", "aovs.normal.png", "aovs.distance.png"] {
        assert_eq!(&std::fs::read(folder.join(name)).unwrap()[1..4], b"PNG", "{name}");
    }
}
