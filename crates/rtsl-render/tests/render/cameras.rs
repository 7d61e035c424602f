//! The cameras of pbrt: directions of a map of the sphere, and the brightness of pictures through lenses.

use std::path::{Path, PathBuf};

use rtsl_image::Image;
use rtsl_render::RenderRequest;
use rtsl_render::request::render_scene_from;
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

/// A lens of crown glass, and a diaphragm between it and the film.
const LENSES: &str = "50 4 1.5 60\n-50 20 1 60\n0 30 0 40\n";

fn files(text: &str) -> MemoryFiles {
    let files = [("scene.pbrt", text), ("lens.dat", LENSES)];
    MemoryFiles(files.map(|(path, text)| (PathBuf::from(path), text.to_owned())).into())
}

fn rendered(text: &str) -> Image {
    let request = RenderRequest { scene: "scene.pbrt".into(), ..RenderRequest::default() };
    let result = render_scene_from(&request, &files(text));
    let result = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    assert!(result.warnings.is_empty(), "{}", result.warnings.to_text(false));
    result.image
}

/// Lamps around the camera: red towards +z, green towards -x, blue towards +y.
fn around(mapping: &str) -> Image {
    let lamp = |place: &str, color: &str| {
        format!(
            "AttributeBegin Translate {place} Material \"Emissive\" \"rgb radiance\" [{color}]\n\
             Shape \"sphere\" AttributeEnd\n"
        )
    };
    let lamps = [lamp("0 0 3", "1 0 0"), lamp("-3 0 0", "0 1 0"), lamp("0 3 0", "0 0 1")].concat();
    rendered(&format!(
        "Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 32\n\
         Sampler \"independent\" \"integer pixelsamples\" 4\nIntegrator \"path\"\n\
         Camera \"spherical\" {mapping}\nWorldBegin\n{lamps}"
    ))
}

#[test]
fn a_spherical_camera_sees_directions_where_pbrt_has_them() {
    let pixel = |image: &Image, x: usize, y: usize| image.pixels[y * 32 + x];
    let map = around("\"string mapping\" \"equirectangular\"");
    for x in 0..32 {
        assert_eq!(pixel(&map, x, 0), [0.0, 0.0, 1.0], "the first row looks up");
    }
    // A quarter and a half of the way around.
    assert_eq!([pixel(&map, 7, 15), pixel(&map, 8, 16)], [[1.0, 0.0, 0.0]; 2]);
    assert_eq!([pixel(&map, 15, 15), pixel(&map, 16, 16)], [[0.0, 1.0, 0.0]; 2]);
    let square = around("");
    assert_eq!([pixel(&square, 15, 15), pixel(&square, 16, 16)], [[0.0, 0.0, 1.0]; 2]);
    assert_eq!([pixel(&square, 15, 31), pixel(&square, 16, 31)], [[1.0, 0.0, 0.0]; 2]);
    assert_eq!([pixel(&square, 0, 15), pixel(&square, 0, 16)], [[0.0, 1.0, 0.0]; 2]);
    let seen = square.pixels.iter().filter(|pixel| pixel[2] > 0.5).count() as f64 / 1024.0;
    // The sine of the radius is 1/3.
    let share = (1.0 - (1.0_f64 - 1.0 / 9.0).sqrt()) / 2.0;
    assert!((seen - share).abs() < 6.0 / 1024.0, "{seen} of the sphere, expected {share}");
}

/// The middle of a picture of a white world, through a diaphragm of 10 mm.
fn brightness(aperture: &str) -> (f64, f64) {
    let text = format!(
        "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 \"float diagonal\" 0.2\n\
         Sampler \"sobol\" \"integer pixelsamples\" 256\nIntegrator \"path\"\n\
         Camera \"realistic\" \"string lensfile\" \"lens.dat\" \"float focusdistance\" 2\n\
         \"float aperturediameter\" 10 {aperture}\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
    );
    let pixels = rendered(&text).pixels;
    let mean = pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64;
    let scene =
        load_scene(Path::new("scene.pbrt"), &files(&text), &LoadOptions::default()).unwrap().scene;
    let elements = scene.camera.buffer("elements").unwrap();
    (mean, f64::from(f32::from_bits(elements[1])))
}

/// A disk of radiance 1 shines pi times the square of the sine of the angle that it fills on the film.
#[test]
fn a_diaphragm_before_the_film_lets_through_what_a_disk_would_shine() {
    let (radius, (round, place)) = (0.005, brightness(""));
    let expected = std::f64::consts::PI * (radius * radius) / (radius * radius + place * place);
    assert!((round / expected - 1.0).abs() < 0.01, "{round}, expected {expected}");
    for shape in ["square", "pentagon"] {
        let (shaped, _) = brightness(&format!("\"string aperture\" \"{shape}\""));
        assert!((shaped / round - 1.0).abs() < 0.03, "{shape}: {shaped}, round {round}");
    }
}
