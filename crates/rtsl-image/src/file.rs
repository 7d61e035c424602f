//! Image files. They are replaced atomically, so that no reader sees an incomplete file and a full disk does not
//! destroy an existing one.

use std::path::{Path, PathBuf};

use rtsl_memory::collected;
use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::exr_file::write_exr;
use super::png_file::write_png;
use super::{AovImage, ExrOptions, Image, ImageMetadata, ViewTransform};
use crate::atomic_write::{Output, check_replaceable, replace_file};

/// The formats of image files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// 8 bits per channel, as displayed.
    Png,
    /// Floats, linear.
    Exr,
}

impl ImageFormat {
    /// Returns the format for a file name, by its extension.
    pub fn from_path(path: &Path) -> Result<Self, ImageError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("png") => Ok(ImageFormat::Png),
            Some("exr") => Ok(ImageFormat::Exr),
            Some(_) | None => Err(ImageError::UnknownFormat { path: path.to_owned() }),
        }
    }
}

/// Options for writing images.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageOptions {
    /// The exposure of a PNG in stops.
    pub exposure: f32,
    /// The view transform of a PNG.
    pub view: ViewTransform,
    /// The options for EXR files.
    pub exr: ExrOptions,
    /// Metadata about how the image was made.
    pub metadata: ImageMetadata,
}

/// An error of writing an image.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The extension is not supported.
    #[error("`{}` does not end in .png or .exr", path.display())]
    UnknownFormat {
        /// The name.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("cannot write `{}`: {reason}", path.display())]
    Unwritable {
        /// The name.
        path: PathBuf,
        /// The system's error message.
        reason: String,
    },
}

impl ImageError {
    /// The diagnostic of the error.
    pub fn diagnostic(&self) -> Diagnostic {
        Diagnostic::new(codes::UNWRITABLE_FILE, self.to_string())
    }
}

/// Writes an image in the format given by the file's extension.
///
/// ```
/// use rtsl_image::{Image, ImageOptions, write_image};
///
/// # let folder = tempfile::tempdir()?;
/// # let folder = folder.path();
/// let image = Image::new(64, 48)?;
/// write_image(&image, &folder.join("black.png"), &ImageOptions::default())?;
/// assert!(write_image(&image, &folder.join("black.bmp"), &ImageOptions::default()).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_image(image: &Image, path: &Path, options: &ImageOptions) -> Result<(), ImageError> {
    write_image_with(image, &[], path, options)
}

/// Writes an image and AOVs of the same size: to one EXR file, or next to `picture.png` as `picture.normal.png` and so
/// on. If some files cannot be written, the others are written anyway.
///
/// # Errors
/// The first file that could not be written.
pub fn write_image_with(
    image: &Image,
    aovs: &[AovImage],
    path: &Path,
    options: &ImageOptions,
) -> Result<(), ImageError> {
    let size = (image.width, image.height);
    let metadata = &options.metadata;
    match ImageFormat::from_path(path)? {
        ImageFormat::Exr => {
            replace(path, |file| write_exr(image, aovs, options.exr, metadata, file))
        }
        ImageFormat::Png => {
            let view = options.view;
            let picture = replace(path, |file| {
                let shown = image.to_view(view, options.exposure)?;
                write_png(size, &shown, view, metadata, file)
            });
            let others = aovs.iter().map(|aov| {
                let path = path.with_extension(format!("{}.png", aov.aov.name()));
                let view = ViewTransform::Standard;
                replace(&path, |file| write_png(size, &aov.to_srgb()?, view, metadata, file))
            });
            // All files are attempted before the first error is returned.
            std::iter::once(picture).chain(others).fold(Ok(()), Result::and)
        }
    }
}

/// Writes displayed pixels, `0x00RRGGBB`, in rows of `width`, as PNG.
pub fn write_pixels(pixels: &[u32], width: usize, path: &Path) -> Result<(), ImageError> {
    let bytes = pixels.iter().flat_map(|pixel| pixel.to_be_bytes().into_iter().skip(1));
    let size = (width, pixels.len().checked_div(width).unwrap_or(0));
    let (view, metadata) = (ViewTransform::Standard, ImageMetadata::default());
    replace(path, |file| {
        write_png(size, &collected(3 * pixels.len(), bytes)?, view, &metadata, file)
    })
}

/// Checks that an image can be written, before a render that may take hours.
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    ImageFormat::from_path(path)?;
    check_replaceable(path).map_err(|error| unwritable(path, &error))
}

fn replace(
    path: &Path,
    write: impl FnOnce(&mut dyn Output) -> std::io::Result<()>,
) -> Result<(), ImageError> {
    replace_file(path, write).map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &std::io::Error) -> ImageError {
    ImageError::Unwritable { path: path.to_owned(), reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use tempfile::tempdir;

    use super::*;
    use crate::{Aov, AovType, ExrPrecision};

    fn picture() -> (Image, Vec<AovImage>) {
        let pixels =
            (0..96 * 64).map(|index| [index as f32 * 100.0, 0.1, -1.0 / (1 + index) as f32]);
        let image = Image { width: 96, height: 64, pixels: pixels.collect() };
        let types = [AovType::Color, AovType::Integer, AovType::Float];
        let aovs = [Aov::Albedo, Aov::Object, Aov::Distance].into_iter().zip(types);
        let aovs = aovs.map(|(aov, ty)| {
            let pixels = (0..96 * 64).map(|index| index as f32 + 0.1);
            let values = pixels.flat_map(|value| vec![value; ty.channels()]).collect();
            AovImage { aov, ty, width: 96, height: 64, values }
        });
        (image, aovs.collect())
    }

    fn options(precision: ExrPrecision, multi_part: bool) -> ImageOptions {
        let metadata = ImageMetadata { samples: Some(256), seed: Some(3) };
        let exr = ExrOptions { precision, multi_part };
        ImageOptions { exr, metadata, ..ImageOptions::default() }
    }

    #[test]
    fn the_same_image_gives_the_same_bytes() {
        let (image, aovs) = picture();
        let folder = tempdir().unwrap();
        for (ending, multi_part) in [("exr", false), ("exr", true), ("png", false)] {
            let write = |name: &str| {
                let path = folder.path().join(format!("{name}.{ending}"));
                let options = options(ExrPrecision::Half, multi_part);
                write_image_with(&image, &aovs, &path, &options).unwrap();
                std::fs::read(path).unwrap()
            };
            let first = write("first");
            assert!((0..4).all(|_| write("again") == first), "{ending}");
        }
    }

    #[test]
    fn halves_are_for_colors_and_finite() {
        let (image, aovs) = picture();
        let folder = tempdir().unwrap();
        for multi_part in [false, true] {
            let path = folder.path().join("half.exr");
            let options = options(ExrPrecision::Half, multi_part);
            write_image_with(&image, &aovs, &path, &options).unwrap();
            let file = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
            let parts: Vec<Option<String>> = (file.layer_data.iter())
                .map(|layer| layer.attributes.layer_name.as_ref().map(ToString::to_string))
                .collect();
            let expected = [Some("color"), Some("albedo"), Some("object"), Some("distance")];
            let expected: &[Option<&str>] = if multi_part { &expected } else { &[None] };
            assert_eq!(parts.iter().map(Option::as_deref).collect::<Vec<_>>(), expected);
            let channels: Vec<_> =
                file.layer_data.iter().flat_map(|layer| &layer.channel_data.list).collect();
            let find = |name: &str| {
                let channel = channels.iter().find(|channel| channel.name == *name).unwrap();
                let is_half = matches!(channel.sample_data, exr::prelude::FlatSamples::F16(_));
                (is_half, channel.sample_data.values_as_f32().collect::<Vec<f32>>())
            };
            for (name, half) in [("R", true), ("albedo.G", true), ("object", false), ("Z", false)] {
                assert_eq!(find(name).0, half, "{name}");
            }
            assert_eq!(channels.len(), 8);
            let reds = find("R").1;
            assert_eq!(reds[3], 300.0);
            assert_eq!(reds[96 * 64 - 1], 65504.0);
            assert_eq!(find("object").1[4000], 4000.1);
            let attributes = &file.layer_data[0].attributes;
            let comment = attributes.comments.as_ref().map(ToString::to_string);
            assert_eq!(comment.as_deref(), Some("samples 256, seed 3"));
            assert!(attributes.software_name.as_ref().unwrap().to_string().starts_with("RTSL "));
        }
    }

    #[test]
    fn a_raw_picture_says_that_it_is_linear() {
        let (image, _) = picture();
        let folder = tempdir().unwrap();
        let path = folder.path().join("raw.png");
        let options = ImageOptions { view: ViewTransform::Raw, ..ImageOptions::default() };
        write_image(&image, &path, &options).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let reader = png::Decoder::new(file).read_info().unwrap();
        assert_eq!(reader.info().gama_chunk, Some(png::ScaledFloat::new(1.0)));
        assert_eq!(reader.info().srgb, None);
    }

    #[test]
    fn an_image_that_cannot_be_written_keeps_others() {
        let (image, aovs) = picture();
        let folder = tempdir().unwrap();
        let path = folder.path().join("picture.png");
        std::fs::create_dir(folder.path().join("picture.albedo.png")).unwrap();
        let error = write_image_with(&image, &aovs, &path, &ImageOptions::default()).unwrap_err();
        assert!(
            error.to_string().ends_with("picture.albedo.png`: it is a folder, expected a file"),
            "{error}"
        );
        assert_eq!(error.diagnostic().code, codes::UNWRITABLE_FILE);
        for name in ["picture.png", "picture.object.png", "picture.distance.png"] {
            assert!(folder.path().join(name).is_file(), "{name}");
        }
    }

    #[test]
    fn what_cannot_be_written_is_found_before() {
        let folder = tempdir().unwrap();
        assert!(check_writable(&folder.path().join("picture.png")).is_ok());
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        for path in ["picture", "missing/picture.png", "picture.tiff"] {
            assert!(check_writable(&folder.path().join(path)).is_err(), "{path}");
        }
        std::fs::create_dir(folder.path().join("folder.png")).unwrap();
        assert!(check_writable(&folder.path().join("folder.png")).is_err());
    }
}
