//! Short runs of the fuzz targets for scenes, meshes and other files, with mutations of the repository's files that are
//! the same in every run. With `RTSL_FUZZ=N` there are 300 of each format at least.

#[path = "../../../../fuzz/entries/checkpoint.rs"]
mod checkpoint;
#[path = "../../../../fuzz/entries/gltf.rs"]
mod gltf;
#[path = "../../../../fuzz/entries/ies.rs"]
mod ies;
#[path = "../../../../fuzz/entries/lenses.rs"]
mod lenses;
#[path = "../../../../fuzz/entries/materialx.rs"]
mod materialx;
#[path = "../../../../fuzz/entries/measured.rs"]
mod measured;
#[path = "../../../../fuzz/entries/mutation.rs"]
pub mod mutation;
#[path = "../../../../fuzz/entries/paint.rs"]
mod paint;
#[path = "../../../../fuzz/entries/ply.rs"]
mod ply;
#[path = "../../../../fuzz/entries/scene.rs"]
mod scene;

use std::path::Path;

use rtsl_render::checkpoint::{Checkpoint, Fingerprint, Section};
use rtsl_scene::Settings;
use rtsl_scene::reader::Digest;

use mutation::{Random, mutate, overwrite, seeds};

/// The number of mutations of a format: `count`, and in a long run 300 at least.
pub fn cases(count: usize) -> usize {
    const LONG: usize = 300;
    if std::env::var_os("RTSL_FUZZ").is_some() { count.max(LONG) } else { count }
}

/// Calls `target` with mutations of the files in `folder` that end in `extension`.
fn run(folder: &str, extension: &str, count: usize, target: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    run_on(seeds(&folder, extension), count, target);
}

/// Calls `target` with mutations of `seeds`.
fn run_on(seeds: Vec<Vec<u8>>, count: usize, target: fn(&[u8])) {
    let work = move || {
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        for _ in 0..cases(count) {
            let (seed, other) = (random.below(seeds.len()), random.below(seeds.len()));
            target(&mutate(&mut random, &seeds[seed], &seeds[other]));
        }
    };
    // A stack that must suffice for any input.
    let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(work).unwrap();
    assert!(thread.join().is_ok());
}

#[test]
fn any_scene_is_read_or_refused() {
    run("../../scenes", "pbrt", 1000, scene::scene);
}

/// Scenes of earlier versions, with much of what an upgrade translates.
const OLD: [&str; 4] = [
    "Camera \"environment\" Film \"image\" \"float scale\" 2 PixelFilter \"gaussian\" \"float alpha\" 2\n\
     SurfaceIntegrator \"directlighting\" Renderer \"metropolis\" WorldBegin TransformBegin Material \"matte\"\n\
     ReverseOrientation TransformEnd Shape \"sphere\" \"color Kd\" [1 0 0] WorldEnd WorldBegin",
    "WorldBegin Texture \"a\" \"color\" \"uv\" Texture \"a\" \"color\" \"scale\" \"texture tex1\" \"a\"\n\
     \"texture tex2\" \"a\" Material \"uber\" \"texture opacity\" \"a\" \"xyz Kd\" [1 1 1] Shape \"disk\"\n\
     MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string namedmaterial1\" \"m\" NamedMaterial \"m\" WorldEnd",
    "WorldBegin Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2\n\
     \"float uknots\" [0 0 1 1] \"float vknots\" [0 0 1 1] \"point P\" [0 0 0 1 0 0 0 1 0 1 1 0] WorldEnd",
    "WorldBegin Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [0 1 2 3]\n\
     LightSource \"infinite\" \"string mapname\" \"a\" \"color L\" [1 2 3] \"blackbody I\" [3000 2]\n\
     Shape \"cone\" \"float phimax\" 20 Shape \"paraboloid\" Shape \"hyperboloid\" WorldEnd",
];

#[test]
fn any_scene_is_converted_or_refused() {
    run_on(OLD.map(|text| text.as_bytes().to_vec()).into(), 300, scene::conversion);
    run("../../scenes", "pbrt", 300, scene::conversion);
}

#[test]
fn any_compressed_scene_is_read_or_refused() {
    // Stored blocks, in which a mutation can reach the text, and the lengths before it.
    let seed = |text: &[u8]| {
        let length = (text.len() as u16).to_le_bytes();
        let inverse = (!(text.len() as u16)).to_le_bytes();
        let header = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255, 1];
        [&header, &length[..], &inverse, text, &[0; 8]].concat()
    };
    let seeds =
        [&b"WorldBegin Shape \"sphere\" Include \"fuzz.pbrt\""[..], b"Camera \"perspective\""];
    run_on(seeds.map(seed).into(), 2000, scene::scene);
}

#[test]
fn any_lenses_are_read_or_refused() {
    let seeds = [
        &b"0 2 0 20\n50 2 1.5 20\n-50 50 1 20\n"[..],
        b"# lens\n29.475 3.76 1.67 25.2\n84.83 0.12 1 25.2\n0 4.5 0 17.1\n-39.73 35 1 20\n",
    ];
    run_on(seeds.map(<[u8]>::to_vec).into(), 40, lenses::lenses);
}

#[test]
fn any_photometric_file_is_read_or_refused() {
    let seeds = [
        &b"IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 60\n0 45 90\n0\n9 5 0\n"[..],
        b"A lamp\nTILT=INCLUDE\n1\n2\n0 90\n1 0.5\n1 1 1 2 2 1 1 0 0 0 1 1 9\n0 180\n0 90\n1 2 3 4\n",
    ];
    run_on(seeds.map(<[u8]>::to_vec).into(), 60, ies::ies);
}

#[test]
fn any_materialx_document_is_read_or_refused() {
    run("../../scenes/materialx", "mtlx", 60, materialx::materialx);
}

#[test]
fn any_measured_material_is_read_or_refused() {
    let seeds = vec![paint::paint(1), paint::paint(3), paint::paint(8)];
    for seed in &seeds {
        assert!(measured::measured(seed), "a file of the database is read");
    }
    run_on(seeds.clone(), 40, |data| {
        measured::measured(data);
    });
    // Sizes and places that a mutation of words does not reach.
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for _ in 0..cases(30) {
        let mut data = seeds[random.below(seeds.len())].clone();
        for _ in 0..1 + random.below(3) {
            overwrite(&mut random, &mut data, 600);
        }
        measured::measured(&data);
    }
}

#[test]
fn any_ply_file_is_read_or_refused() {
    run("tests/meshes", "ply", 5000, ply::ply);
}

#[test]
fn any_obj_or_stl_file_is_read_or_refused() {
    run("tests/meshes", "obj", 5000, ply::obj);
    run("tests/meshes", "stl", 5000, ply::stl);
}

#[test]
fn any_gltf_file_is_read_or_refused() {
    run("tests/meshes", "gltf", 5000, gltf::gltf);
    run("tests/meshes", "glb", 5000, gltf::gltf);
}

#[test]
fn any_gltf_scene_is_read_or_refused() {
    run("../../scenes", "glb", 20, gltf::gltf_attributes);
    run("tests/meshes", "gltf", 20, gltf::gltf_attributes);
    run("../../scenes", "glb", 100, gltf::gltf_scene);
    run("tests/meshes", "gltf", 100, gltf::gltf_scene);
    run("tests/meshes", "glb", 100, gltf::gltf_scene);
}

#[test]
fn any_checkpoint_is_read_or_refused() {
    let mut seeds = Vec::new();
    for count in [0, 3, 200] {
        let (sums, counts) = (vec![0.5; count], vec![7; count]);
        let mut fingerprint = Fingerprint::of_settings(&Settings::default());
        fingerprint.set_digest("scene.pbrt", Digest::of(b"WorldBegin"));
        let sections = vec![Section::f64("sums", &sums), Section::u32("counts", &counts)];
        let mut bytes = Vec::new();
        Checkpoint { fingerprint, sections }.write_to(&mut bytes).unwrap();
        checkpoint::checkpoint(&bytes);
        seeds.push(bytes);
    }
    run_on(seeds, 5000, checkpoint::checkpoint);
}
