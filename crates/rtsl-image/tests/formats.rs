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
    // The scene's encoding matters only to WebP of these formats: a QOI file names its own, others are sRGB.
    let encoding = match name.split_once('.').expect("an extension").1 {
        "qoi" => Encoding::Linear,
        "webp" => Encoding::Gamma(2.0),
        _ => Encoding::Srgb,
    };
    assert_eq!((picture.channels, picture.encoding), (3, encoding), "{name}");
    let expected = (0..HEIGHT).flat_map(|y| (0..WIDTH).flat_map(move |x| color(x, y)));
    let pairs = picture.bytes().expect("8 bits a channel").iter().zip(expected);
    pairs.map(|(found, expected)| found.abs_diff(expected)).max().unwrap()
}

#[test]
fn lossless_files_have_their_colors() {
    let names = [
        "colors.bmp",
        "colors.qoi",
        "colors.tga",
        "colors.webp",
        "animated.webp",
        "runs.tga",
        "opacity.tga",
    ];
    for name in names {
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
fn webp_files_have_opacity() {
    for (name, tolerance) in [("opacity.webp", 0), ("lossy-opacity.webp", 60)] {
        let picture = read(&file(name), Encoding::Srgb);
        assert_eq!((picture.channels, rtsl_image::has_opacity(&file(name))), (4, Ok(true)));
        let texel = &picture.bytes().unwrap()[4 * (5 * WIDTH + 7)..][..4];
        let [red, green, blue] = color(7, 5);
        let expected = [red, green, blue, 91];
        let near = texel.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= tolerance);
        assert!(near && texel[3] == 91, "{name}: {texel:?}");
    }
    for name in ["colors.webp", "lossy.webp"] {
        assert_eq!(rtsl_image::has_opacity(&file(name)), Ok(false), "{name}");
    }
    assert!(difference("lossy.webp") <= 24, "{}", difference("lossy.webp"));
}

/// A KTX 2.0 file of blocks in one colour each, compressed by Zstandard or not.
fn ktx2((width, height): (u32, u32), colors: &[[u8; 4]], channel: u8, is_packed: bool) -> Vec<u8> {
    let blocks: Vec<u8> = colors
        .iter()
        .flat_map(|color| {
            // The mode of blocks in one colour has the code 23 of five bits.
            let bits = 0x17 | u128::from(u32::from_le_bytes(*color)) << 5;
            bits.to_le_bytes()
        })
        .collect();
    let data = if is_packed {
        // A frame of one segment whose size takes a byte, with one block that is stored as it is.
        let size = blocks.len();
        let header = (1 | size << 3).to_le_bytes();
        [&[0x28, 0xb5, 0x2f, 0xfd, 0x20, size as u8], &header[..3], &blocks].concat()
    } else {
        blocks.clone()
    };
    let mut file = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    let word = |file: &mut Vec<u8>, word: u32| file.extend(word.to_le_bytes());
    let descriptor = 104;
    let scheme = if is_packed { 2 } else { 0 };
    for it in [0, 1, width, height, 0, 0, 1, 1, scheme, descriptor, 44, 0, 0] {
        word(&mut file, it);
    }
    file.extend([0_u8; 16]);
    for it in [148, data.len() as u64, blocks.len() as u64] {
        file.extend(it.to_le_bytes());
    }
    word(&mut file, 44);
    word(&mut file, 0);
    word(&mut file, 2 | 40 << 16);
    file.extend([166, 1, 1, 0, 3, 3, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0]);
    file.extend([0, 0, 127, channel]);
    file.extend([0_u8; 12]);
    file.extend(data);
    file
}

#[test]
fn ktx2_files_have_the_colors_of_their_blocks() {
    let colors = [[255, 0, 10, 255], [1, 2, 3, 128]];
    for is_packed in [false, true] {
        let opaque = read(&ktx2((6, 3), &colors, 0, is_packed), Encoding::Linear);
        assert_eq!((opaque.width, opaque.height, opaque.channels), (6, 3, 3));
        let texels = opaque.bytes().expect("8 bits a channel");
        assert_eq!(
            (&texels[3 * 3..][..3], &texels[3 * 10..][..3]),
            (&[255, 0, 10][..], &[1, 2, 3][..])
        );
        let file = ktx2((6, 3), &colors, 3, is_packed);
        assert_eq!(rtsl_image::has_opacity(&file), Ok(true));
        assert_eq!(read(&file, Encoding::Linear).bytes().unwrap()[4 * 5..][..4], [1, 2, 3, 128]);
    }
}

#[test]
fn ktx2_files_may_have_bytes() {
    let [colors, opaque, pair, grey] =
        [(37_u8, 4_usize), (29, 3), (16, 2), (9, 1)].map(|(format, count)| {
            [false, true].map(|is_packed| {
                let bytes: [u8; 16] = std::array::from_fn(|index| 10 * index as u8);
                let blocks = [[bytes[0], bytes[1], bytes[2], bytes[3]]];
                let mut file = ktx2((2, 2), &blocks, 0, is_packed);
                // The block's place has the bytes.
                let start = if is_packed { 148 + 6 + 3 } else { 148 };
                file[start..start + 16].copy_from_slice(&bytes);
                file[12] = format;
                let picture = read(&file, Encoding::Linear);
                assert_eq!(rtsl_image::has_opacity(&file), Ok(count == 4));
                (picture.channels, picture.bytes().expect("8 bits").to_vec())
            })
        });
    let list = |count: u8| (0..4 * count).map(|index| 10 * index).collect::<Vec<u8>>();
    assert_eq!(colors, [(4, list(4)), (4, list(4))]);
    assert_eq!(opaque, [(3, list(3)), (3, list(3))]);
    assert_eq!(pair[1], (3, vec![0, 10, 0, 20, 30, 0, 40, 50, 0, 60, 70, 0]));
    assert_eq!(grey[0], (1, list(1)));
}

#[test]
fn ktx2_files_that_are_wrong_are_refused() {
    let whole = ktx2((6, 3), &[[9; 4]; 2], 0, true);
    let problem = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut file = whole.clone();
        change(&mut file);
        let budget = InputBudget::new(Some(Amount(64 << 20)));
        match Picture::read(&file, Encoding::Srgb, &budget) {
            Err(PictureError::Malformed(problem)) => problem,
            Err(PictureError::OverBudget(_)) => "over budget".to_owned(),
            Ok(_) => "none".to_owned(),
        }
    };
    let end = "it ends within its header";
    assert_eq!(problem(&|file| file.truncate(50)), end);
    assert_eq!(problem(&|file| file.truncate(120)), end);
    assert_eq!(problem(&|file| file.truncate(170)), "it is damaged");
    assert_eq!(problem(&|file| file[28] = 1), "it has several pictures, expected one");
    let expected =
        "its texels are neither compressed by Basis Universal as ETC1S or UASTC nor bytes";
    assert_eq!(problem(&|file| file[116] = 1), expected);
    // More is claimed to be unpacked than the texels take.
    assert_eq!(problem(&|file| file[101] = 1), "it is damaged");
    assert_eq!(problem(&|file| file[22] = 200), "over budget");
}

/// The rules of glTF: the scene tells the encoding of every format, and opacity is kept.
#[test]
fn files_for_gltf_keep_their_numbers_and_opacity() {
    use png::{BitDepth, ColorType};
    let read = |bytes: &[u8], encoding| {
        let budget = InputBudget::new(Some(Amount(64 << 20)));
        Picture::read_for_gltf(bytes, encoding, &budget).expect("the file is valid").0
    };
    for name in ["baseline.jpg", "colors.webp", "colors.qoi", "colors.tga"] {
        assert_eq!(read(&file(name), Encoding::Linear).encoding, Encoding::Linear, "{name}");
        assert_eq!(read(&file(name), Encoding::Srgb).encoding, Encoding::Srgb, "{name}");
    }
    let read_as = |color: ColorType, depth: BitDepth, has_key: bool, data: &[u8]| {
        let file = png((2, 1), |encoder| {
            encoder.set_color(color);
            encoder.set_depth(depth);
            if color == ColorType::Indexed {
                encoder.set_palette(vec![1, 2, 3, 40, 50, 60]);
            }
            if has_key {
                encoder.set_trns(vec![0, 7]);
            }
            data.to_vec()
        });
        let picture = read(&file, Encoding::Linear);
        assert_eq!(rtsl_image::has_opacity(&file), Ok(picture.channels == 4));
        picture.samples
    };
    let bytes = |bytes: &[u8]| Samples::Bytes(bytes.to_vec());
    use BitDepth::{Eight, Sixteen};
    let opaque = [1, 2, 3, 255, 4, 5, 6, 255];
    assert_eq!(read_as(ColorType::Rgba, Eight, false, &opaque), bytes(&opaque));
    let greys = read_as(ColorType::GrayscaleAlpha, Eight, false, &[3, 9, 4, 8]);
    assert_eq!(greys, bytes(&[3, 3, 3, 9, 4, 4, 4, 8]));
    let keyed = read_as(ColorType::Grayscale, Eight, true, &[7, 8]);
    assert_eq!(keyed, bytes(&[7, 7, 7, 0, 8, 8, 8, 255]));
    let palette = read_as(ColorType::Indexed, Eight, true, &[0, 1]);
    assert_eq!(palette, bytes(&[1, 2, 3, 0, 40, 50, 60, 7]));
    let deep =
        read_as(ColorType::GrayscaleAlpha, Sixteen, false, &[255, 255, 0, 0, 0, 0, 255, 255]);
    let expected = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(f16::from_f32).to_vec();
    assert_eq!(deep, Samples::Halves(expected));
    assert_eq!(read_as(ColorType::Grayscale, Eight, false, &[3, 4]), bytes(&[3, 4]));
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
    let files: [&[u8]; 5] = [
        b"RIFF\x12\0\0\0WEBPVP8L\x05\0\0\0\x2f\x3f\xdf\xcf\x07\0",
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
