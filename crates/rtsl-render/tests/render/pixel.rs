//! One pixel: its value is that of a render, to the bit, and what its shaders print comes in order.

use std::path::{Path, PathBuf};

use expect_test::expect;
use rtsl::{Trace, TraceDetail, TraceEntry, TraceKind};
use rtsl_render::pixel::render_pixel_from;
use rtsl_render::request::render_scene_from;
use rtsl_render::{
    Execution, LoadOptions, Optimise, PixelRequest, RenderRequest, TracedPixel, render_pixel,
    render_scene,
};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};
use rtsl_testing::turns::is_long_run;

/// Compares some pixels of a scene with those of a picture.
fn compare(scene: &str, renderer: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let request = RenderRequest {
        scene: folder.join(scene),
        load: LoadOptions::with_integrator(renderer),
        size: Some((24, 16)),
        samples: Some(3),
        execution: Execution { optimise: Optimise::Never, ..Execution::on_threads(2) },
        ..RenderRequest::default()
    };
    let picture = render_scene(&request).unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    for (pixel, detail) in [
        ([12, 8], TraceDetail::Steps),
        ([3, 13], TraceDetail::Calls),
        ([17, 10], TraceDetail::Prints),
    ] {
        let chosen = PixelRequest { pixel, first: 0, count: None };
        let traced = render_pixel(&request, chosen, &Trace::new(detail));
        let traced = traced.unwrap_or_else(|it| panic!("{}", it.to_text(false)));
        let expected = picture.image.pixels[pixel[1] * 24 + pixel[0]];
        let bits = |color: [f32; 3]| color.map(f32::to_bits);
        let message = format!("{scene}, {}, {pixel:?}: {:?}", renderer, traced.color);
        assert_eq!(bits(traced.color), bits(expected), "{message} for {expected:?}");
        assert_eq!(traced.samples.len(), 3);
        let has_calls = traced.samples.iter().all(|it| !it.recording.entries.is_empty());
        assert_eq!(has_calls, detail > TraceDetail::Prints, "{message}");
    }
}

/// The scenes to compare: all of them in long runs.
fn scenes(usual: [&'static str; 4]) -> Vec<String> {
    if !is_long_run() {
        return usual.map(str::to_owned).to_vec();
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name());
    let scenes = files.map(|name| name.into_string().unwrap());
    let mut scenes: Vec<String> = scenes.filter(|name| name.ends_with(".pbrt")).collect();
    scenes.sort();
    scenes
}

#[test]
fn pixels_are_those_of_the_interactive_renderer() {
    let usual = ["three-spheres.pbrt", "textures.pbrt", "patterns.pbrt", "stage.pbrt"];
    scenes(usual).iter().for_each(|scene| compare(scene, INTERACTIVE));
}

#[test]
fn pixels_are_those_of_the_batch_renderer() {
    let usual = ["three-spheres.pbrt", "surfaces.pbrt", "layers.pbrt", "motion.pbrt"];
    scenes(usual).iter().for_each(|scene| compare(scene, BATCH));
}

const SHADERS: &str = "class Glow : rt_Texture;
void lookup() {
    print(\"u = {}\", rt_TextureUV.x);
    rt_TextureColor = color(1.0 / max(0.5 - rt_TextureUV.x, 0.0));
}
class Flat : rt_Material;
public rt_Texture kd;
color paint() {
    color c = kd.lookup();
    print(\"paint {}, depth {}\", c, rt_RayDepth);
    return c;
}
void shade() { rt_SampleColor = paint(); }
void BSDF() { rt_BSDFValue = paint() / 3.1415926; }
";

fn traced(renderer: &str, pixel: [usize; 2], detail: TraceDetail) -> TracedPixel {
    let scene = "LookAt 0 0 -5  0 0 0  0 1 0 Camera \"Orthographic\"
        PixelFilter \"box\" Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4
        Sampler \"independent\" \"integer pixelsamples\" 2
        WorldBegin
        LightSource \"DirectionalLight\" \"vector3 direction\" [0 0 1]
        Texture \"glow\" \"spectrum\" \"Glow\" Material \"Flat\" \"texture kd\" \"glow\"
        Shape \"Parallelogram\" \"point3 corner\" [-2 -2 0] \"vector3 sideU\" [4 0 0] \"vector3 sideV\" [0 4 0]\n";
    let files = [("scene.pbrt", scene), ("shaders.rtsl", SHADERS)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let files = MemoryFiles(files.into());
    let request = RenderRequest {
        scene: PathBuf::from("scene.pbrt"),
        load: LoadOptions::with_integrator(renderer),
        ..RenderRequest::default()
    };
    let chosen = PixelRequest { pixel, first: 0, count: None };
    let traced = render_pixel_from(&request, chosen, &Trace::new(detail), &files)
        .unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    let picture = render_scene_from(&request, &files).unwrap();
    let expected = picture.image.pixels[pixel[1] * 4 + pixel[0]];
    assert_eq!(traced.color.map(f32::to_bits), expected.map(f32::to_bits));
    traced
}

/// The lines of each sample.
fn lines(traced: &TracedPixel, is_shown: impl Fn(&TraceEntry) -> bool) -> String {
    let mut text = String::new();
    for sample in &traced.samples {
        text += &format!("sample {}\n", sample.index);
        for entry in sample.recording.entries.iter().filter(|entry| is_shown(entry)) {
            text += &format!("{}{entry}\n", "  ".repeat(entry.depth as usize));
        }
    }
    text
}

#[test]
fn prints_of_both_renderers() {
    let all = |renderer| lines(&traced(renderer, [1, 2], TraceDetail::Prints), |_| true);
    expect![[r#"
        sample 0
        shaders.rtsl:3: Glow.lookup: u = 0.41985703
        shaders.rtsl:10: Flat.shade: paint (12.4777, 12.4777, 12.4777), depth 0.0
        sample 1
        shaders.rtsl:3: Glow.lookup: u = 0.46420792
        shaders.rtsl:10: Flat.shade: paint (27.93914, 27.93914, 27.93914), depth 0.0
    "#]]
    .assert_eq(&all(INTERACTIVE));
    expect![[r#"
        sample 0
        shaders.rtsl:3: Glow.lookup: u = 0.41985703
        shaders.rtsl:10: Flat.BSDF: paint (12.4777, 12.4777, 12.4777), depth 0.0
        shaders.rtsl:3: Glow.lookup: u = 0.41985703
        shaders.rtsl:10: Flat.sampleBSDF: paint (12.4777, 12.4777, 12.4777), depth 0.0
        sample 1
        shaders.rtsl:3: Glow.lookup: u = 0.46420792
        shaders.rtsl:10: Flat.BSDF: paint (27.93914, 27.93914, 27.93914), depth 0.0
        shaders.rtsl:3: Glow.lookup: u = 0.46420792
        shaders.rtsl:10: Flat.sampleBSDF: paint (27.93914, 27.93914, 27.93914), depth 0.0
    "#]]
    .assert_eq(&all(BATCH));
}

#[test]
fn calls_are_nested_and_name_objects() {
    let traced = traced(INTERACTIVE, [0, 0], TraceDetail::Lines);
    let is_of_shading = |entry: &TraceEntry| {
        entry.method.starts_with("Flat")
            || entry.method.starts_with("Glow")
            || entry.method.is_empty()
    };
    expect![[r#"
        sample 0
          nearest hit: Parallelogram, shape on line 7, at distance 5.0
          Flat.shade(rt_TextureUV = (0.3405202, 0.63426554), rt_RayDepth = 0.0)
            Glow.lookup(rt_TextureUV = (0.3405202, 0.63426554)) of `kd`
              shaders.rtsl:3: Glow.lookup: u = 0.3405202
              shaders.rtsl:4: rt_TextureColor = (6.2703867, 6.2703867, 6.2703867)
            Glow.lookup returns rt_TextureColor = (6.2703867, 6.2703867, 6.2703867)
            shaders.rtsl:9: c = (6.2703867, 6.2703867, 6.2703867)
            shaders.rtsl:10: Flat.shade: paint (6.2703867, 6.2703867, 6.2703867), depth 0.0
            shaders.rtsl:13: rt_SampleColor = (6.2703867, 6.2703867, 6.2703867)
          Flat.shade returns rt_SampleColor = (6.2703867, 6.2703867, 6.2703867)
        sample 1
          nearest hit: Parallelogram, shape on line 7, at distance 5.0
          Flat.shade(rt_TextureUV = (0.30575544, 0.67271864), rt_RayDepth = 0.0)
            Glow.lookup(rt_TextureUV = (0.30575544, 0.67271864)) of `kd`
              shaders.rtsl:3: Glow.lookup: u = 0.30575544
              shaders.rtsl:4: rt_TextureColor = (5.148149, 5.148149, 5.148149)
            Glow.lookup returns rt_TextureColor = (5.148149, 5.148149, 5.148149)
            shaders.rtsl:9: c = (5.148149, 5.148149, 5.148149)
            shaders.rtsl:10: Flat.shade: paint (5.148149, 5.148149, 5.148149), depth 0.0
            shaders.rtsl:13: rt_SampleColor = (5.148149, 5.148149, 5.148149)
          Flat.shade returns rt_SampleColor = (5.148149, 5.148149, 5.148149)
    "#]]
    .assert_eq(&lines(&traced, is_of_shading));
}

#[test]
fn values_that_are_not_finite_are_followed_to_their_operation() {
    let traced = traced(BATCH, [3, 1], TraceDetail::Calls);
    let first = traced.samples[0].recording.entries.iter().find_map(|entry| match entry.kind {
        TraceKind::NotFinite(value, _) => Some((entry, value)),
        _ => None,
    });
    let (entry, value) = first.expect("the texture divides by 0");
    let place = entry.place.as_ref().expect("the texture's text is known");
    let text = &place.source.text[place.start as usize..place.end as usize];
    assert_eq!(
        (text, place.line(), value),
        ("1.0 / max(0.5 - rt_TextureUV.x, 0.0)", 4, f32::INFINITY)
    );
}

#[test]
fn pixels_and_samples_outside_are_errors() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let request = RenderRequest {
        scene: folder.join("three-spheres.pbrt"),
        size: Some((8, 8)),
        samples: Some(2),
        ..RenderRequest::default()
    };
    let error = |pixel, first| {
        let chosen = PixelRequest { pixel, first, count: None };
        let traced = render_pixel(&request, chosen, &Trace::new(TraceDetail::Prints));
        traced.expect_err("there is no such pixel").to_text(false)
    };
    assert!(
        error([8, 0], 0).contains("E0627]: there is no pixel 8,0 in a picture of 8 by 8 pixels")
    );
    assert!(error([0, 0], 2).contains("E0627]: there is no sample 2"), "{}", error([0, 0], 2));
}
