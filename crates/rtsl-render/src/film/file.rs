//! Image files, written beside their place and then renamed, so that no reader sees half a file.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, SpecificChannels, WritableImage};

use super::{AovImage, Image};

/// The formats that images are kept in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// 8 bits a channel, sRGB.
    Png,
    /// 32-bit floats, linear.
    Exr,
}

impl ImageFormat {
    /// The format that the ending of a file's name tells.
    pub fn from_path(path: &Path) -> Result<Self, ImageError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("png") => Ok(ImageFormat::Png),
            Some("exr") => Ok(ImageFormat::Exr),
            Some(_) | None => Err(ImageError::UnknownFormat { path: path.to_owned() }),
        }
    }
}

/// Why an image was not written.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The name has no known ending.
    #[error("`{}` does not end in .png or .exr", path.display())]
    UnknownFormat {
        /// The name.
        path: PathBuf,
    },
    /// The system refused.
    #[error("cannot write `{}`: {reason}", path.display())]
    Unwritable {
        /// The name.
        path: PathBuf,
        /// The system's words.
        reason: String,
    },
}

/// Writes an image in the format that the file's name tells. `exposure`, in stops, applies to PNG.
pub fn write_image(image: &Image, path: &Path, exposure: f32) -> Result<(), ImageError> {
    write_image_with(image, &[], path, exposure)
}

/// Writes an image and, of the same size, what else is known of its pixels: as channels of the same
/// EXR file, or beside `picture.png` as `picture.normal.png` and so on.
pub fn write_image_with(
    image: &Image,
    aovs: &[AovImage],
    path: &Path,
    exposure: f32,
) -> Result<(), ImageError> {
    let size = (image.width, image.height);
    match ImageFormat::from_path(path)? {
        ImageFormat::Exr if aovs.is_empty() => write_beside(path, |file| write_exr(image, file)),
        ImageFormat::Exr => write_beside(path, |file| write_exr_layers(image, aovs, file)),
        ImageFormat::Png => {
            write_beside(path, |file| write_png(size, &image.to_srgb(exposure), file))?;
            aovs.iter().try_for_each(|aov| {
                let path = path.with_extension(format!("{}.png", aov.aov.name()));
                write_beside(&path, |file| write_png(size, &aov.to_srgb(), file))
            })
        }
    }
}

/// Writes pixels as a screen shows them, `0x00RRGGBB`, of which `width` make a row, as PNG.
pub fn write_pixels(pixels: &[u32], width: usize, path: &Path) -> Result<(), ImageError> {
    let bytes = pixels.iter().flat_map(|pixel| pixel.to_be_bytes().into_iter().skip(1));
    let bytes: Vec<u8> = bytes.collect();
    let height = pixels.len().checked_div(width).unwrap_or(0);
    write_beside(path, |temporary| write_png((width, height), &bytes, temporary))
}

/// Writes a file beside its place and renames it then.
fn write_beside(
    path: &Path,
    write: impl FnOnce(&Path) -> io::Result<()>,
) -> Result<(), ImageError> {
    let temporary = temporary_path(path);
    write(&temporary).and_then(|()| std::fs::rename(&temporary, path)).map_err(|error| {
        // Nothing is left behind; that it cannot be removed either is no further news.
        let _ = std::fs::remove_file(&temporary);
        ImageError::Unwritable { path: path.to_owned(), reason: error.to_string() }
    })
}

fn temporary_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

fn write_png((width, height): (usize, usize), bytes: &[u8], path: &Path) -> io::Result<()> {
    let file = io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(())
}

/// On one thread: several would order the blocks of the file as they finish, so that the same image
/// gave other bytes from run to run.
fn write_exr(image: &Image, path: &Path) -> io::Result<()> {
    let color = |position: exr::math::Vec2<usize>| {
        let [red, green, blue] = image.pixels[position.y() * image.width + position.x()];
        (red, green, blue)
    };
    let channels = SpecificChannels::rgb(color);
    let file = exr::image::Image::from_channels((image.width, image.height), channels);
    let written = file.write().non_parallel().to_file(path);
    written.map_err(|error| io::Error::other(error.to_string()))
}

/// The colours as `R`, `G` and `B`, then the channels of the others. On one thread, as above.
fn write_exr_layers(image: &Image, aovs: &[AovImage], path: &Path) -> io::Result<()> {
    let channel = |name: &str, pixels: &[[f32; 3]], component: usize| {
        let values = pixels.iter().map(|pixel| pixel[component]).collect();
        AnyChannel::new(name, FlatSamples::F32(values))
    };
    let colors = ["R", "G", "B"].into_iter().enumerate();
    let colors = colors.map(|(component, name)| channel(name, &image.pixels, component));
    let others = aovs.iter().flat_map(|aov| {
        let names = aov.aov.channels().iter().enumerate();
        names.map(|(component, name)| channel(name, &aov.pixels, component))
    });
    let channels = AnyChannels::sort(colors.chain(others).collect());
    let file = exr::image::Image::from_channels((image.width, image.height), channels);
    let written = file.write().non_parallel().to_file(path);
    written.map_err(|error| io::Error::other(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_image_gives_the_same_bytes() {
        let pixels = (0..96 * 64).map(|index| [index as f32, 0.5, -1.0 / (1 + index) as f32]);
        let image = Image { width: 96, height: 64, pixels: pixels.collect() };
        let folder = std::env::temp_dir().join(format!("rtsl-image-file-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for ending in ["exr", "png"] {
            let write = |name: &str| {
                let path = folder.join(format!("{name}.{ending}"));
                write_image(&image, &path, 0.0).unwrap();
                std::fs::read(path).unwrap()
            };
            let first = write("first");
            assert!((0..4).all(|_| write("again") == first), "{ending}");
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
