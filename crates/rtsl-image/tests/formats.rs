//! Files of every format that is read, as other programs write them.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding as ExrEncoding, FlatSamples, Image, Layer, LayerAttributes,
    SmallVec, WritableImage, f16,
};
use rtsl_image::{Encoding, Mipmap, Picture, PictureError, Samples};
use rtsl_memory::{Amount, InputBudget};

const WIDTH: usize = 20;
const HEIGHT: usize = 12;

/// The colour that the files in `pictures` have at a place.
fn color(x: usize, y: usize) -> [u8; 3] {
    [12 * x as u8, 20 * y as u8, (255 - 5 * x - 10 * y) as u8]
}

fn file(name: &str) -> Vec<u8> {
    let path = format!("{}/tests/pictures/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn read(bytes: &[u8], encoding: Encoding) -> Picture {
    let budget = InputBudget::new(Some(Amount(64 << 20)));
    let (picture, _) =
        Picture::read(bytes, encoding, &budget).unwrap_or_else(|it| panic!("{it:?}"));
    picture
}

/// The greatest difference of a file's bytes from the colours.
fn difference(name: &str) -> u8 {
    let picture = read(&file(name), Encoding::Gamma(2.0));
    assert_eq!((picture.width, picture.height), (WIDTH, HEIGHT), "{name}");
    // The scene's encoding does not matter to these formats: a QOI file names its own, others are sRGB.
    let encoding = if name.ends_with("qoi") { Encoding::Linear } else { Encoding::Srgb };
    assert_eq!((picture.channels, picture.encoding), (3, encoding), "{name}");
    let expected = (0..HEIGHT).flat_map(|y| (0..WIDTH).flat_map(move |x| color(x, y)));
    let pairs = picture.bytes().expect("8 bits a channel").iter().zip(expected);
    pairs.map(|(found, expected)| found.abs_diff(expected)).max().unwrap()
}

#[test]
fn lossless_files_have_their_colors() {
    for name in ["colors.bmp", "colors.qoi", "colors.tga", "runs.tga", "opacity.tga"] {
        assert_eq!(difference(name), 0, "{name}");
    }
    let opacity = read(&file("opacity.qoi"), Encoding::Linear);
    assert_eq!((opacity.channels, &opacity.bytes().unwrap()[4..8]), (4, &[12, 0, 250, 13][..]));
    let palette = read(&file("palette.bmp"), Encoding::Srgb);
    let pixel = |x: usize, y: usize| palette.bytes().unwrap()[3 * (y * WIDTH + x)..][..3].to_vec();
    // The colours that another program reads.
    let expected = [vec![48, 10, 230], vec![198, 200, 73], vec![72, 120, 165]];
    assert_eq!([pixel(0, 0), pixel(19, 11), pixel(7, 5)], expected);
}

#[test]
fn jpeg_files_are_near_their_colors() {
    assert!(difference("baseline.jpg") <= 3, "{}", difference("baseline.jpg"));
    assert!(difference("progressive.jpg") <= 40, "{}", difference("progressive.jpg"));
    let grey = read(&file("grey.jpg"), Encoding::Srgb);
    let [red, green, blue] = color(7, 5).map(f64::from);
    let luma = 0.299 * red + 0.587 * green + 0.114 * blue;
    assert_eq!((grey.channels, grey.format().words(8)), (1, 2));
    assert!((f64::from(grey.bytes().unwrap()[5 * WIDTH + 7]) - luma).abs() <= 2.0);
}

fn png(
    (width, height): (u32, u32),
    write: impl Fn(&mut png::Encoder<&mut Vec<u8>>) -> Vec<u8>,
) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    let data = write(&mut encoder);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&data).unwrap();
    writer.finish().unwrap();
    file
}

#[test]
fn png_files_of_every_depth_are_read() {
    use png::{BitDepth, ColorType};
    let read_as = |color: ColorType, depth: BitDepth, data: &[u8]| {
        let file = png((2, 1), |encoder| {
            encoder.set_color(color);
            encoder.set_depth(depth);
            if color == ColorType::Indexed {
                encoder.set_palette(vec![1, 2, 3, 40, 50, 60]);
                encoder.set_trns(vec![7, 255]);
            }
            data.to_vec()
        });
        let picture = read(&file, Encoding::Linear);
        (picture.channels, picture.samples)
    };
    let bytes = |channels: usize, bytes: &[u8]| (channels, Samples::Bytes(bytes.to_vec()));
    use BitDepth::{Eight, Four, One, Sixteen, Two};
    assert_eq!(read_as(ColorType::Grayscale, One, &[0b0100_0000]), bytes(1, &[0, 255]));
    assert_eq!(read_as(ColorType::Grayscale, Two, &[0b0110_0000]), bytes(1, &[85, 170]));
    assert_eq!(read_as(ColorType::Grayscale, Four, &[0x1f]), bytes(1, &[17, 255]));
    assert_eq!(read_as(ColorType::Grayscale, Eight, &[3, 4]), bytes(1, &[3, 4]));
    // Only colours keep opacity, as in pbrt-v4.
    assert_eq!(read_as(ColorType::GrayscaleAlpha, Eight, &[3, 9, 4, 9]), bytes(1, &[3, 4]));
    assert_eq!(read_as(ColorType::Indexed, One, &[0x80]), bytes(3, &[40, 50, 60, 1, 2, 3]));
    assert_eq!(read_as(ColorType::Indexed, Eight, &[0, 1]), bytes(3, &[1, 2, 3, 40, 50, 60]));
    let opaque = [1, 2, 3, 255, 4, 5, 6, 255];
    assert_eq!(read_as(ColorType::Rgba, Eight, &opaque), bytes(3, &[1, 2, 3, 4, 5, 6]));
    let partial = [1, 2, 3, 255, 4, 5, 6, 254];
    assert_eq!(read_as(ColorType::Rgba, Eight, &partial), bytes(4, &partial));
    let deep = read_as(ColorType::Grayscale, Sixteen, &[0x80, 0, 0xff, 0xff]);
    let expected = [32768.0 / 65535.0, 1.0].map(f16::from_f32).to_vec();
    assert_eq!(deep, (1, Samples::Halves(expected)));
}

#[test]
fn encodings_apply_to_all_channels_of_png_files() {
    let file = png((1, 1), |encoder| {
        encoder.set_color(png::ColorType::Rgba);
        vec![128, 0, 255, 128]
    });
    let code = |encoding| {
        let picture = read(&file, encoding);
        picture.components(&rtsl_image::ByteCode::new(picture.encoding), 0)
    };
    let half = 128.0 / 255.0_f32;
    assert_eq!(code(Encoding::Linear), [half, 0.0, 1.0, half]);
    let srgb = code(Encoding::Srgb);
    assert!((srgb[0] - 0.215_860_5).abs() < 1e-6 && srgb[0] == srgb[3], "{srgb:?}");
    let gamma = code(Encoding::Gamma(2.0));
    assert!((gamma[0] - half * half).abs() < 1e-6 && gamma[0] == gamma[3], "{gamma:?}");
}

#[test]
fn hdr_files_have_a_common_exponent() {
    let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".to_vec();
    file.extend([128, 64, 0, 129, 255, 128, 0, 136]);
    let picture = read(&file, Encoding::Srgb);
    assert_eq!(picture.samples, Samples::Floats(vec![1.0, 0.5, 0.0, 255.0, 128.0, 0.0]));
    // Channels of a row in runs.
    let mut file = b"#?RADIANCE\n\n-Y 1 +X 8\n".to_vec();
    file.extend([2, 2, 0, 8, 136, 128, 8, 1, 2, 3, 4, 5, 6, 7, 8, 136, 0, 136, 129]);
    let picture = read(&file, Encoding::Srgb);
    assert_eq!(picture.colors().nth(2), Some([1.0, 3.0 / 128.0, 0.0]));
}

/// An EXR file of parts with channels by name.
fn exr_file(parts: &[(&str, &[(&str, FlatSamples)])]) -> Vec<u8> {
    let layer = |(name, channels): &(&str, &[(&str, FlatSamples)])| {
        let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone()));
        let channels = AnyChannels::sort(list.collect::<SmallVec<_>>());
        Layer::new((2, 1), LayerAttributes::named(*name), ExrEncoding::FAST_LOSSLESS, channels)
    };
    let mut file = Cursor::new(Vec::new());
    let layers: SmallVec<_> = parts.iter().map(layer).collect();
    let window = exr::meta::attribute::IntegerBounds::from_dimensions((2, 1));
    let image = Image::from_layers(exr::meta::header::ImageAttributes::new(window), layers);
    image.write().non_parallel().to_buffered(&mut file).unwrap();
    file.into_inner()
}

#[test]
fn layers_parts_and_single_channels_of_exr_files_are_found() {
    let halves = |values: [f32; 2]| FlatSamples::F16(values.map(f16::from_f32).to_vec());
    let floats = |values: [f32; 2]| FlatSamples::F32(values.to_vec());
    let whole = |values: [u32; 2]| FlatSamples::U32(values.to_vec());
    let samples = |parts: &[(&str, &[(&str, FlatSamples)])]| {
        let picture = read(&exr_file(parts), Encoding::Srgb);
        (picture.channels, picture.samples)
    };
    let halves_of = |values: &[f32]| {
        Samples::Halves(values.iter().map(|it| f16::from_f32(*it)).collect::<Vec<_>>())
    };
    let grey = samples(&[("", &[("Y", halves([0.5, f32::INFINITY]))])]);
    assert_eq!(grey, (1, halves_of(&[0.5, 0.0])));
    assert_eq!(samples(&[("", &[("depth", whole([3, 7]))])]), (1, Samples::Floats(vec![3.0, 7.0])));
    let layered: &[(&str, FlatSamples)] = &[
        ("Z", floats([9.0, 9.0])),
        ("diffuse.R", halves([1.0, 2.0])),
        ("diffuse.G", halves([3.0, 4.0])),
        ("diffuse.B", halves([5.0, 6.0])),
        ("diffuse.A", halves([1.0, 0.5])),
    ];
    let expected = halves_of(&[1.0, 3.0, 5.0, 1.0, 2.0, 4.0, 6.0, 0.5]);
    assert_eq!(samples(&[("", layered)]), (4, expected.clone()));
    let depth: &[(&str, FlatSamples)] = &[("Z", floats([9.0, 9.0]))];
    assert_eq!(samples(&[("depth", depth), ("beauty", layered)]), (4, expected));
    let mixed: &[(&str, FlatSamples)] =
        &[("R", halves([1.0, 2.0])), ("G", floats([0.1, 4.0])), ("B", halves([5.0, 6.0]))];
    let expected = Samples::Floats(vec![1.0, 0.1, 5.0, 2.0, 4.0, 6.0]);
    assert_eq!(samples(&[("", mixed)]), (3, expected));
    let none: &[(&str, FlatSamples)] = &[("u", floats([1.0; 2])), ("v", floats([1.0; 2]))];
    let error = Picture::read(&exr_file(&[("", none)]), Encoding::Srgb, &InputBudget::default());
    let expected = "it has neither red, green and blue of one resolution nor a single channel";
    assert_eq!(error.unwrap_err(), PictureError::Malformed(expected.to_owned()));
}

#[test]
fn headers_that_claim_much_are_over_budget() {
    let files: [&[u8]; 4] = [
        b"PF\n8000 8000\n-1\n",
        b"#?RADIANCE\n\n-Y 8000 +X 8000\n",
        b"qoif\0\0\x1f\x40\0\0\x1f\x40\x03\0",
        b"\0\0\x02\0\0\0\0\0\0\0\0\0\x40\x1f\x40\x1f\x18\0",
    ];
    for bytes in files {
        let budget = InputBudget::new(Some(Amount(8 << 20)));
        let read = Picture::read(bytes, Encoding::Srgb, &budget);
        assert!(matches!(read, Err(PictureError::OverBudget(_))), "{bytes:?}: {read:?}");
        assert_eq!(budget.taken(), Amount(0));
    }
}

#[test]
fn texels_take_the_bytes_of_their_file() {
    let words = |name: &str| Mipmap::flat(&read(&file(name), Encoding::Srgb)).unwrap().words.len();
    assert_eq!((words("colors.tga"), words("grey.jpg")), (WIDTH * HEIGHT, WIDTH * HEIGHT / 4));
}
