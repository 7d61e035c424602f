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
