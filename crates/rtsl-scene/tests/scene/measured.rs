//! Materials from files of measurements.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::Instance;
use rtsl_scene::reader::FileSource;
use rtsl_scene::{LoadOptions, SceneSource};

use crate::paint::{paint, tensors};

/// A scene with a sphere of the material, and its file.
struct Files(Vec<u8>);

const SCENE: &str = "Camera \"perspective\"\nWorldBegin\n\
    Material \"measured\" \"string filename\" \"paint.bsdf\"\nShape \"sphere\"\n";

impl FileSource for Files {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match path.to_str() {
            Some("paint.bsdf") => Ok(self.0.clone()),
            Some("scene.pbrt") => Ok(SCENE.as_bytes().to_vec()),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn list(&self, _: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }
}

/// The material, or the messages.
fn material(file: Vec<u8>) -> Result<Arc<Instance>, String> {
    let files = Files(file);
    let mut source = SceneSource::read(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    let loaded = source.load().map_err(|messages| messages.to_text(false))?;
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings.to_text(false));
    Ok(loaded.scene.materials[0].clone())
}

fn numbers(material: &Instance) -> Vec<f32> {
    let words = material.buffer("tables").expect("the class has it");
    words.iter().map(|word| f32::from_bits(*word)).collect()
}

#[test]
fn measured_materials_read_their_tables() {
    for azimuths in [1, 3] {
        let made = material(paint(azimuths)).unwrap_or_else(|messages| panic!("{messages}"));
        assert_eq!(made.class().name, "Measured");
        let pair = |name: &str| made.member(name).unwrap().to_vec();
        assert_eq!(pair("views"), [3, azimuths as u32]);
        assert_eq!(pair("facets"), [5, 4]);
        assert_eq!(pair("visible"), [6, 5]);
        let tables = numbers(&made);
        let slices = 3 * azimuths;
        // Densities, sums along rows, sums of rows, colours.
        let per_slice = (2 * 6 + 1) * 5 + (2 * 4 + 1) * 4 + 3 * 16;
        assert_eq!(tables.len(), 3 + azimuths + 20 + 18 + slices * per_slice);
        assert_eq!(tables[..3], [0.0, 0.7, 1.5]);
        // The sums of rows of each slice rise to 1.
        let start = 3 + azimuths + 38 + slices * 60;
        for rows in tables[start..start + 5 * slices].chunks(5) {
            assert!(rows.windows(2).all(|two| two[0] < two[1]), "{rows:?}");
            assert!((rows[4] - 1.0).abs() < 1e-6, "{rows:?}");
        }
    }
}

/// A spectrum that is the same at all wavelengths is grey.
#[test]
fn measured_spectra_become_colours() {
    let mut file = paint(1);
    let grey = 0.375_f32.to_le_bytes();
    // The spectra are the last data but 6 bytes.
    let end = file.len() - 6;
    for place in (end - 4 * 3 * 80..end).step_by(4) {
        file[place..place + 4].copy_from_slice(&grey);
    }
    let tables = numbers(&material(file).unwrap_or_else(|messages| panic!("{messages}")));
    let colors = &tables[tables.len() - 3 * 3 * 16..];
    assert!(colors.iter().all(|channel| (channel - 0.375).abs() < 1e-4), "{colors:?}");
}

#[test]
fn damaged_measurements_are_errors() {
    let whole = paint(1);
    let with = |place: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[place..place + bytes.len()].copy_from_slice(bytes);
        file
    };
    let find = |text: &str| {
        whole.windows(text.len()).position(|it| it == text.as_bytes()).unwrap() + text.len()
    };
    let data_of = |name: &str| {
        let place: [u8; 8] = whole[find(name) + 3..][..8].try_into().unwrap();
        u64::from_le_bytes(place) as usize
    };
    let nan = f32::NAN.to_le_bytes();
    let huge = u64::MAX.to_le_bytes();
    let cases: [(Vec<u8>, &str); 11] = [
        (b"PNG".to_vec(), "it does not begin with `tensor_file` and the version 1.0"),
        (with(12, &[9]), "it does not begin with `tensor_file` and the version 1.0"),
        (whole[..40].to_vec(), "it ends after 40 bytes, within the description of field 0"),
        (
            whole[..whole.len() - 1].to_vec(),
            "the data of field `jacobian` do not lie in the file: it is truncated or damaged",
        ),
        (with(find("theta_i") + 2, &[77]), "field `theta_i` has type 77 and 1 dimensions"),
        (with(find("theta_i") + 2, &[5]), "field `theta_i` is not of 32-bit floats"),
        (with(find("theta_i") + 11, &huge), "the data of field `theta_i` do not lie in the file"),
        (with(find("ndf") - 3, b"NDF"), "it has no field `ndf`"),
        (with(data_of("vndf"), &nan), "field `vndf` is not of finite numbers"),
        (
            with(data_of("theta_i"), &2.0_f32.to_le_bytes()),
            "field `theta_i` is not of finite numbers that increase",
        ),
        (
            tensors(&[("theta_i", 10, vec![1, 1], vec![0; 4])]),
            "field `theta_i` is not of 1 dimensions but of 2",
        ),
    ];
    for (file, expected) in cases {
        let messages = material(file).err().unwrap_or_else(|| panic!("accepted: {expected}"));
        assert!(messages.contains(&format!("cannot read `paint.bsdf`: {expected}")), "{messages}");
        assert!(messages.contains("expected a file of the RGL material database"), "{messages}");
    }
}
