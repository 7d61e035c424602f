//! The files of scenes stay within their memory budget, whatever their contents claim.

#[allow(dead_code, reason = "only its numbers are used here")]
#[path = "../../../../fuzz/entries/mutation.rs"]
mod mutation;
#[path = "../../../../fuzz/entries/picture.rs"]
mod picture;

use std::io::{self, Cursor};
use std::path::Path;

use base64::Engine;
use exr::prelude::*;
use rtsl::{Diagnostics, SourceMap, diagnostic_codes as codes};
use rtsl_image::{Depth, Encoding as Transfer, Picture, PictureError, TexelFormat};
use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::WantedAttributes;
use rtsl_scene::mesh::{MeshError, read_gltf_within, read_ply_within};
use rtsl_scene::reader::{MemoryFiles, read_scene_within};

use mutation::Random;

const WIDTH: usize = 45;
const HEIGHT: usize = 37;

fn budget(mebibytes: u64) -> InputBudget {
    InputBudget::new(Some(Amount(mebibytes << 20)))
}

fn color(Vec2(x, y): Vec2<usize>) -> (f16, f16, f16) {
    let part = |number: usize, of: usize| f16::from_f32(number as f32 / of as f32);
    (part(x, WIDTH), part(y, HEIGHT), part(x * y % 7, 3))
}

/// A small picture in one of the encodings of EXR.
fn exr_file(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let channels = SpecificChannels::rgb(color);
    let size = Vec2(WIDTH, HEIGHT);
    let layer = Layer::new(size, LayerAttributes::default(), encoding, channels);
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut file).unwrap();
    file.into_inner()
}

fn exr_files() -> Vec<(Compression, Blocks, Vec<u8>)> {
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::DWAA(None),
        Compression::DWAB(None),
    ];
    let blocks = [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))];
    let kinds = compressions.into_iter().flat_map(|it| blocks.map(|blocks| (it, blocks)));
    kinds.map(|(it, blocks)| (it, blocks, exr_file(it, blocks))).collect()
}

fn png_file(width: u32, height: u32) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![0; width as usize * height as usize]).unwrap();
    writer.finish().unwrap();
    file
}

fn read_picture(bytes: &[u8], budget: &InputBudget) -> std::result::Result<Picture, PictureError> {
    Picture::read(bytes, Transfer::Srgb, budget).map(|(picture, _)| picture)
}

#[test]
fn every_compression_is_read_as_the_library_reads_it() {
    for (compression, blocks, file) in exr_files() {
        let whole = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |_, _| vec![[0.0_f32; 3]; WIDTH * HEIGHT],
                |texels, Vec2(x, y), (red, green, blue): (f32, f32, f32)| {
                    texels[y * WIDTH + x] = [red, green, blue];
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(&file))
            .unwrap();
        let picture = read_picture(&file, &budget(64)).unwrap();
        assert_eq!((picture.width, picture.height), (WIDTH, HEIGHT));
        let ours: Vec<[f32; 3]> = picture.colors().collect();
        assert_eq!(ours, whole.layer_data.channel_data.pixels, "{compression:?} {blocks:?}");
    }
}

/// The position of the eleven counters of the first block of DWA compression.
fn counters(file: &[u8]) -> usize {
    let number = |at: usize| u64::from_le_bytes(file[at..at + 8].try_into().unwrap());
    let is_start = |at: &usize| {
        number(*at) == 2 && (1..10).all(|it| number(at + 8 * it) < 1 << 16) && number(at + 80) < 2
    };
    (0..file.len() - 88).find(is_start).unwrap()
}

/// Such a counter made the library request 140 terabytes, which aborted the process.
#[test]
fn no_memory_is_asked_for_by_counters_of_blocks() {
    for compression in [Compression::DWAA(None), Compression::DWAB(None)] {
        let file = exr_file(compression, Blocks::ScanLines);
        let start = counters(&file);
        for counter in [1, 6, 7, 8, 9] {
            for claimed in [140_737_488_291_726_u64, 1 << 40, u64::MAX >> 1, u64::MAX] {
                let mut hostile = file.clone();
                hostile[start + 8 * counter..][..8].copy_from_slice(&claimed.to_le_bytes());
                let error = read_picture(&hostile, &budget(64)).unwrap_err();
                assert!(matches!(error, PictureError::Malformed(_)), "{counter}: {error:?}");
            }
        }
    }
}

#[test]
fn what_a_header_claims_is_held_before_it_is_taken() {
    let window = b"dataWindow\0box2i\0\x10\0\0\0";
    for (compression, blocks, file) in exr_files() {
        let place = file.windows(window.len()).position(|it| it == window).unwrap() + window.len();
        for (columns, rows) in [(8000, 8000), (1 << 26, 1), (5_898_280, 24), (1 << 29, 1 << 29)] {
            let mut large = file.clone();
            for (at, side) in [(8, columns), (12, rows)] {
                large[place + at..][..4].copy_from_slice(&(side - 1_i32).to_le_bytes());
            }
            let error = read_picture(&large, &budget(64)).unwrap_err();
            let is_large = i64::from(columns) * i64::from(rows) > 1 << 26;
            let expected = match error {
                PictureError::OverBudget(_) => !is_large,
                PictureError::Malformed(_) => is_large,
            };
            assert!(expected, "{compression:?} {blocks:?}, {columns} by {rows}: {error:?}");
        }
    }
    let png = png_file(4096, 4096);
    assert!(png.len() < 1 << 20);
    let Err(PictureError::OverBudget(error)) = read_picture(&png, &budget(128)) else {
        panic!("it takes more");
    };
    let grey = TexelFormat { channels: 1, depth: Depth::Byte };
    assert_eq!(error.needed, Picture::memory(4096, 4096, grey));
    assert!(read_picture(&png, &budget(1024)).is_ok());
}

/// The environment variable that selects the process whose memory is limited.
const LIMITED: &str = "RTSL_TEST_READS_PICTURES";

/// Reads pictures with mutated bytes, some of them numbers at the limits of their types.
#[test]
fn mutated_pictures_process() {
    if std::env::var_os(LIMITED).is_none() {
        return;
    }
    let mut seeds: Vec<Vec<u8>> = exr_files().into_iter().map(|(_, _, file)| file).collect();
    seeds.push(png_file(20, 20));
    let pictures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../rtsl-image/tests/pictures");
    for extension in ["jpg", "bmp", "qoi", "tga", "webp", "ktx2"] {
        seeds.extend(mutation::seeds(&pictures, extension));
    }
    seeds.push([&b"PF 9 7 -1\n"[..], &[63; 9 * 7 * 12]].concat());
    seeds.push([&b"#?RADIANCE\n\n-Y 7 +X 9\n"[..], &[2, 2, 0, 9], &[137; 100]].concat());
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for _ in 0..4000 {
        let mut file = seeds[random.below(seeds.len())].clone();
        for _ in 0..1 + random.below(4) {
            // Most numbers that control allocations are near the beginning.
            let near = if random.below(4) > 0 { file.len().min(900) } else { file.len() };
            let at = random.below(near);
            const ODD: [u64; 8] =
                [0, 1, 1 << 15, (1 << 31) - 1, u32::MAX as u64, 1 << 40, u64::MAX >> 1, u64::MAX];
            let odd = ODD[random.below(ODD.len())].to_le_bytes();
            let count = [1, 2, 4, 8][random.below(4)].min(file.len() - at);
            file[at..at + count].copy_from_slice(&odd[..count]);
        }
        if random.below(8) == 0 {
            file.truncate(random.below(file.len()));
        }
        picture::picture(&file);
    }
}

/// Runs the process above with 500 MiB of address space, where an allocation beyond the budget aborts it.
#[cfg(target_os = "linux")]
#[test]
fn mutated_pictures_take_no_more_than_their_budget() {
    let mut command = std::process::Command::new("sh");
    command
        .args(["-c", "ulimit -v 512000 && exec \"$0\" inputs::mutated_pictures_process --exact"]);
    command.arg(std::env::current_exe().unwrap()).env(LIMITED, "1");
    let output = command.env("MALLOC_ARENA_MAX", "1").output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{:?}: {said}", output.status);
}

#[test]
fn faces_of_a_mesh_are_held_as_they_come() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 2000\n\
        property list uchar uchar vertex_indices\nend_header\n";
    let mut file = header.as_bytes().to_vec();
    file.extend([0; 36]);
    for _ in 0..2000 {
        file.push(255);
        file.extend([0; 255]);
    }
    let Err(MeshError::OverBudget(error)) =
        read_ply_within(&*file, &budget(4), &WantedAttributes::default())
    else {
        panic!("half a megabyte stands for six");
    };
    assert!(error.needed > Amount(4 << 20), "{error}");
    let enough = budget(64);
    let mesh = read_ply_within(&*file, &enough, &WantedAttributes::default()).unwrap();
    assert_eq!((mesh.triangles(), enough.taken()), (2000 * 253, mesh.memory()));
}

#[test]
fn meshes_that_are_placed_often_are_held_as_they_come() {
    let data = base64::engine::general_purpose::STANDARD.encode(vec![0; 12 * 999]);
    let nodes = vec!["{\"mesh\":0}"; 20_000].join(",");
    let roots = (0..20_000).map(|node| node.to_string()).collect::<Vec<_>>().join(",");
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{roots}]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":999,"type":"VEC3","min":[0,0,0],"max":[0,0,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":11988}}],
        "buffers":[{{"byteLength":11988,"uri":"data:application/octet-stream;base64,{data}"}}]}}"#
    );
    let no_files = |_: &str| Err(io::ErrorKind::NotFound.into());
    let read = |budget: &InputBudget| {
        read_gltf_within(text.as_bytes(), &no_files, budget, &WantedAttributes::default())
    };
    assert!(matches!(read(&budget(128)), Err(MeshError::OverBudget(_))));
    let few = text.replace(&nodes, "{\"mesh\":0},{\"mesh\":0}").replace(&roots, "0,1");
    let enough = budget(8);
    let mesh =
        read_gltf_within(few.as_bytes(), &no_files, &enough, &WantedAttributes::default()).unwrap();
    assert_eq!((mesh.vertices(), enough.taken()), (1998, mesh.memory()));
}

#[test]
fn a_scene_is_read_as_far_as_its_memory_goes() {
    let values = "1 ".repeat(1000);
    let shapes = "Shape \"Sphere\"\n".repeat(20_000);
    let attributes = format!("WorldBegin\nAttribute \"shape\" \"float many\" [{values}]\n{shapes}");
    let list = format!("WorldBegin\nShape \"Sphere\" \"float many\" [{}]\n", "1 ".repeat(1 << 20));
    let blocks = format!("WorldBegin\n{}", "AttributeBegin\n".repeat(200_000));
    for (name, text) in [("attributes", attributes), ("list", list), ("blocks", blocks)] {
        let path = Path::new("scene.pbrt");
        let files = MemoryFiles([(path.to_owned(), text)].into());
        let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
        let description = read_scene_within(path, &files, &budget(16), &mut map, &mut diagnostics);
        let refused: Vec<_> =
            diagnostics.iter().filter(|it| it.code == codes::INPUT_MEMORY).collect();
        assert!(description.entities.len() < 5000, "{name}");
        assert_eq!(refused.len(), 1, "{name}");
        assert!(refused[0].message.contains("for the scene's files"), "{name}");
    }
}
