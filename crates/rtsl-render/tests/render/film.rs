//! The film's response to radiance and its parts, in both renderers.

use std::path::{Path, PathBuf};

use rtsl::EngineOptions;
use rtsl_image::Image;
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, RenderRequest};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};

/// Two spheres that shine, of which the brighter one is also behind a noisy floor.
const WORLD: &str = "Camera \"perspective\" \"float fov\" 40\nSampler \"independent\" \"integer pixelsamples\" 8\n\
    WorldBegin\nLightSource \"infinite\" \"rgb L\" [0.4 0.5 0.6]\n\
    Material \"Emissive\" \"rgb radiance\" [8 4 1]\nTranslate 0.4 0.2 5\nShape \"sphere\"\n\
    Material \"diffuse\"\nTranslate -1.5 0 0\nShape \"sphere\"\n";

fn rendered(film: &str, renderer: &str, width: u32, threads: usize) -> Image {
    let text = format!(
        "Film \"rgb\" \"integer xresolution\" 40 \"integer yresolution\" 24 {film}\n{WORLD}"
    );
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    let request = RenderRequest {
        scene: Path::new("scene.pbrt").into(),
        load: LoadOptions::with_integrator(renderer),
        engine: EngineOptions { width: Some(width), ..EngineOptions::default() },
        execution: Execution::on_threads(threads),
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, &files);
    result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).image
}

const BOTH: [&str; 2] = [BATCH, INTERACTIVE];

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    for renderer in BOTH {
        let whole = rendered("", renderer, 8, 2);
        let crop = rendered("\"integer pixelbounds\" [7 31 3 20]", renderer, 8, 2);
        assert_eq!((crop.width, crop.height), (24, 17));
        for y in 0..crop.height {
            for x in 0..crop.width {
                let (part, all) = (crop.pixels[y * 24 + x], whole.pixels[(y + 3) * 40 + x + 7]);
                assert_eq!(part, all, "{renderer:?} ({x}, {y})");
            }
        }
    }
}

#[test]
fn sensitivity_scales_every_pixel() {
    for renderer in BOTH {
        let plain = rendered("", renderer, 8, 2);
        let fast = rendered("\"float iso\" 400", renderer, 8, 2);
        for (plain, fast) in plain.pixels.iter().zip(&fast.pixels) {
            assert_eq!(plain.map(|component| 4.0 * component), *fast);
        }
    }
}

#[test]
fn samples_are_limited_one_by_one_with_the_same_bits_everywhere() {
    let film = "\"float maxcomponentvalue\" 1.5 \"float iso\" 90 \"float whitebalance\" 5000";
    for renderer in BOTH {
        let limited = rendered(film, renderer, 8, 2);
        for (width, threads) in [(4, 1), (16, 3)] {
            let other = rendered(film, renderer, width, threads);
            assert!(limited.pixels == other.pixels, "{renderer:?} {width} {threads}");
        }
        let limited = rendered("\"float maxcomponentvalue\" 1.5", renderer, 8, 2);
        let plain = rendered("", renderer, 8, 2);
        let middle = 11 * 40 + 22;
        let [red, green, blue] = limited.pixels[middle];
        let ratio = red / plain.pixels[middle][0];
        // The tristimulus values of the emission are 4.91, 4.64 and 1.58.
        assert!((ratio - 1.5 / 4.9106).abs() < 1e-3, "{renderer:?}: {ratio}");
        assert!((green / red - 0.5).abs() < 1e-5 && (blue / red - 0.125).abs() < 1e-5);
    }
}
