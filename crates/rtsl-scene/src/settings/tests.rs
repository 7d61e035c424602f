//! Tests of reading settings.

use crate::reader::{MemoryFiles, read_scene};

use rtsl_math::sampling::{FilterShape, SamplerKind};

use super::*;

#[test]
fn grids_are_as_square_as_they_can_be() {
    assert_eq!([1, 2, 12, 16, 7].map(grid), [(1, 1), (2, 1), (4, 3), (4, 4), (7, 1)]);
}

fn read(text: &str) -> (Settings, String) {
    let path = std::path::Path::new("scene.pbrt");
    let files = MemoryFiles([(path.to_owned(), text.to_owned())].into());
    let (mut map, mut diagnostics) = (rtsl::SourceMap::new(), Diagnostics::new());
    let description = read_scene(path, &files, &mut map, &mut diagnostics);
    let settings = Settings::read(&description, &mut diagnostics);
    (settings, rtsl::render::all_to_text(&map, diagnostics.iter(), false))
}

#[test]
fn the_formats_samplers_of_low_discrepancy_are_sobols() {
    for name in ["sobol", "halton", "paddedsobol", "zsobol", "pmj02bn"] {
        let (settings, messages) = read(&format!(
            "Sampler \"{name}\" \"integer pixelsamples\" 77 \"string randomization\" \"owen\""
        ));
        assert_eq!(messages, "");
        assert_eq!(settings.sampler.kind, SamplerKind::Sobol);
        assert_eq!(settings.sampler.samples_per_pixel(), 77);
    }
}

#[test]
fn filters_have_the_formats_parameters() {
    let filter = |text: &str| {
        let (settings, messages) = read(text);
        assert_eq!(messages, "", "{text}");
        (settings.filter.shape(), settings.filter.radius())
    };
    assert_eq!(filter(""), (FilterShape::Box, [0.5; 2]));
    assert_eq!(
        filter("PixelFilter \"gaussian\" \"float sigma\" 0.4 \"float yradius\" 1"),
        (FilterShape::Gaussian { sigma: 0.4 }, [1.5, 1.0])
    );
    assert_eq!(
        filter("PixelFilter \"mitchell\" \"float B\" 0 \"float C\" 0.5"),
        (FilterShape::Mitchell { b: 0.0, c: 0.5 }, [2.0; 2])
    );
    assert_eq!(filter("PixelFilter \"triangle\""), (FilterShape::Triangle, [2.0; 2]));
    let black = filter("PixelFilter \"blackmanharris\" \"float xradius\" 2");
    assert_eq!(black, (FilterShape::BlackmanHarris, [2.0, 1.5]));
    assert_eq!(filter("PixelFilter \"sinc\""), (FilterShape::Sinc { tau: 3.0 }, [4.0; 2]));
    let of_pbrt = (FilterShape::Gaussian { sigma: 0.5 }, [1.5; 2]);
    assert_eq!(filter("Camera \"perspective\""), of_pbrt);
    assert_eq!(filter("Camera \"Pinhole\""), (FilterShape::Box, [0.5; 2]));
    let given = filter("Camera \"perspective\" PixelFilter \"box\"");
    assert_eq!(given, (FilterShape::Box, [0.5; 2]));
}

#[test]
fn what_is_no_filter_is_said() {
    for (text, part) in [
        ("PixelFilter \"gausian\"", "did you mean `gaussian`?"),
        ("PixelFilter \"box\" \"float sigma\" 1", "has no parameter `sigma`"),
        ("PixelFilter \"box\" \"float xradius\" 0", "`xradius` must lie between 0.001 and 64"),
    ] {
        let (settings, messages) = read(text);
        assert!(messages.contains(part), "{messages}");
        assert_eq!(settings.filter, PixelFilter::default());
    }
}

fn settings_of(text: &str) -> Settings {
    let (settings, messages) = read(text);
    assert_eq!(messages, "", "{text}");
    settings
}

#[test]
fn radiance_is_scaled_by_exposure_and_sensitivity() {
    let imaging = |camera: &str, film: &str| {
        settings_of(&format!("Camera {camera}\nFilm \"rgb\" {film}")).imaging
    };
    let open = "\"float shutteropen\" 0.5 \"float shutterclose\" 0.75";
    for (camera, film, expected) in [
        ("\"perspective\"", "", 1.0),
        ("\"perspective\"", "\"float iso\" 250 \"string sensor\" \"cie1931\"", 2.5),
        ("\"perspective\" \"float shutterclose\" 0.5", "\"float iso\" 100", 0.5),
        (&*format!("\"spherical\" {open}"), "\"float iso\" 400", 1.0),
        (&*format!("\"Pinhole\" {open}"), "", 1.0),
        ("\"perspective\" \"float shutterclose\" 0.5", "\"float exposuretime\" 3", 3.0),
        ("\"perspective\"", "\"float imagingratio\" 0.25", 0.25),
    ] {
        let found = imaging(camera, film);
        assert_eq!(found, Imaging { scale: expected, ..Imaging::default() }, "{camera} {film}");
    }
    let limited = imaging("\"perspective\"", "\"float maxcomponentvalue\" 20");
    assert_eq!(limited.max_component, Some(20.0));
    assert!(imaging("\"perspective\"", "\"float whitebalance\" 5000").balance.is_some());
}

#[test]
fn sensors_of_cameras_are_said_to_be_the_observers() {
    let sensor = |text: &str| read(&format!("Film \"rgb\" \"string sensor\" {text}"));
    let (settings, messages) = sensor("\"canon_eos_5d\" \"float iso\" 50");
    assert_eq!(settings.imaging, Imaging { scale: 0.5, ..Imaging::default() });
    let message = "sensor `canon_eos_5d` is not supported: `cie1931` takes its place";
    assert_eq!((messages.matches(message).count(), messages.matches("help").count()), (1, 0));
    assert!(sensor("\"canon_eos_5x\"").1.contains("did you mean `canon_eos_5d"));
    assert!(sensor("\"nikon_d810\" \"float whitebalance\" 5000").0.imaging.balance.is_some());
    assert!(sensor("\"nikon_d810\" \"float whitebalance\" 6500").0.imaging.balance.is_none());
}

#[test]
fn a_part_of_the_film_is_the_picture() {
    let size = "\"integer xresolution\" 100 \"integer yresolution\" 50";
    let part = |text: &str| {
        let settings = settings_of(&format!("Film \"rgb\" {size} {text}"));
        (settings.width, settings.height, settings.crop)
    };
    let crop = |origin| Some(Crop { whole: [100, 50], origin });
    assert_eq!(part(""), (100, 50, None));
    assert_eq!(part("\"float cropwindow\" [0.25 0.5 0.1 0.9]"), (25, 40, crop([25, 5])));
    assert_eq!(part("\"float cropwindow\" [0.5 0.251 0 2]"), (24, 50, crop([26, 0])));
    assert_eq!(part("\"integer pixelbounds\" [10 30 20 500]"), (20, 30, crop([10, 20])));
    assert_eq!(part("\"float cropwindow\" [0 1 0 1]"), (100, 50, None));
    let both = "\"integer pixelbounds\" [10 30 20 500] \"float cropwindow\" [0.5 1 0 1]";
    assert_eq!(part(both), (50, 50, crop([50, 0])));
    for (text, problem) in [
        ("\"float cropwindow\" [0.5 0.5 0 1]", "contains no pixels"),
        ("\"integer pixelbounds\" [100 200 0 10]", "contains no pixels"),
        ("\"float cropwindow\" [0 1]", "`cropwindow` takes 4 numbers, found 2 numbers"),
    ] {
        let (_, messages) = read(&format!("Film \"rgb\" {size} {text}"));
        assert!(messages.contains(problem), "{messages}");
    }
}

#[test]
fn a_picture_of_another_size_shows_the_same_part() {
    let mut settings = settings_of(
        "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 50 \"float cropwindow\" [0.25 0.5 0 0.5]",
    );
    settings.set_size(50, 10);
    assert_eq!((settings.whole_size(), settings.origin()), ([200, 20], [50, 0]));
    settings.set_size(1, 1);
    assert_eq!((settings.whole_size(), settings.origin()), ([4, 2], [1, 0]));
    let mut whole = settings_of("Film \"rgb\"");
    whole.set_size(30, 20);
    assert_eq!((whole.whole_size(), whole.origin(), whole.crop), ([30, 20], [0, 0], None));
}

#[test]
fn films_are_said_to_have_colours_alone() {
    for (film, message) in [
        (
            "\"gbuffer\" \"string coordinatesystem\" \"world\"",
            "film `gbuffer` has only the colours",
        ),
        ("\"spectral\" \"integer nbuckets\" 31", "film `spectral` has only the colours"),
    ] {
        let (_, messages) = read(&format!("Film {film}"));
        assert!(messages.contains(message), "{messages}");
        assert_eq!(messages.matches("warning").count(), 1, "{messages}");
    }
    assert_eq!(read("Film \"rgb\" \"float diagonal\" 35 \"bool savefp16\" false").1, "");
}

#[test]
fn the_nearest_integrator_takes_the_place_of_others() {
    for silent in [
        "\"path\" \"string lightsampler\" \"power\" \"bool regularize\" false",
        "\"volpath\" \"integer maxdepth\" 100",
        "\"simplepath\" \"bool samplelights\" true \"bool samplebsdf\" false",
        "\"simplevolpath\"",
    ] {
        settings_of(&format!("Integrator {silent}"));
    }
    for said in [
        "\"bdpt\" \"bool visualizeweights\" false",
        "\"mlt\" \"integer chains\" 10 \"float sigma\" 0.1",
        "\"sppm\" \"float radius\" 0.1 \"integer photonsperiteration\" 5",
        "\"ambientocclusion\" \"float maxdistance\" 3 \"bool cossample\" true",
        "\"function\" \"string imagefilename\" \"a.exr\"",
        "\"randomwalk\"",
        "\"lightpath\"",
    ] {
        let (_, messages) = read(&format!("Integrator {said}"));
        assert_eq!(messages.matches("is not supported").count(), 1, "{messages}");
        assert_eq!(messages.matches("warning[").count(), 1, "{messages}");
        assert!(!messages.contains("error"), "{messages}");
    }
    let regularizing = |integrator: &str| {
        let (settings, messages) =
            read(&format!("Integrator {integrator} \"bool regularize\" true"));
        (settings.regularize, messages.contains("`regularize` has no effect"))
    };
    assert_eq!(regularizing("\"path\""), (true, false));
    assert_eq!(regularizing("\"interactive\""), (true, true));
    let (settings, _) = read("Integrator \"path\" \"bool regularize\" false");
    assert!(!settings.regularize);
}

#[test]
fn paths_are_as_long_as_the_scene_wants() {
    let depth = |text: &str| settings_of(&format!("Integrator \"path\" {text}")).max_depth;
    assert_eq!(depth(""), 5);
    assert_eq!(depth("\"integer maxdepth\" 65"), 65);
    assert_eq!(depth("\"integer maxdepth\" 2147483647"), 65_536);
    assert_eq!(depth("\"integer maxdepth\" -1"), 65_536);
    let (settings, messages) = read("Integrator \"interactive\" \"integer maxdepth\" 65");
    assert_eq!(settings.max_depth, 65);
    assert!(messages.contains("follows rays to a depth of 64"), "{messages}");
}

#[test]
fn unknown_parameters_are_errors_if_they_are_misspelt() {
    let (_, messages) = read("Film \"rgb\" \"integer xresolutin\" 3 \"float quux\" 3");
    let heads: Vec<&str> = messages.lines().filter(|line| line.contains("film `rgb`")).collect();
    assert_eq!(
        heads,
        [
            "error[E0608]: film `rgb` has no parameter `xresolutin`",
            "warning[W0601]: film `rgb` has no parameter `quux`: it has no effect",
        ]
    );
}

#[test]
fn options_reach_the_sampler_and_the_filter() {
    let settings = settings_of("Option \"seed\" 5 Option \"disablepixeljitter\" true");
    assert_eq!((settings.sampler.seed, settings.filter.radius()), (5, [0.001; 2]));
    let own = settings_of("Option \"seed\" 5 Sampler \"sobol\" \"integer seed\" 6");
    assert_eq!((own.sampler.seed, own.filter.radius()), (6, [0.5; 2]));
    assert_eq!(settings_of("Option \"seed\" 5 Sampler \"sobol\"").sampler.seed, 5);
}
