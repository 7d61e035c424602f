//! Checkpoints come back to the bit, and nothing else is taken for one.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use rtsl_render::checkpoint::{Checkpoint, CheckpointError, Damage, Fingerprint, Section};
use rtsl_scene::reader::Digest;
use tempfile::TempDir;

fn fingerprint(seed: u64) -> Fingerprint {
    // Of its own, so that the format's pins do not change with the settings.
    let mut fingerprint = Fingerprint::default();
    fingerprint.set("seed", seed);
    fingerprint.set_digest("scene.pbrt", Digest::of(b"WorldBegin"));
    fingerprint
}

fn bytes(sections: Vec<Section<'_>>) -> Vec<u8> {
    let mut bytes = Vec::new();
    Checkpoint { fingerprint: fingerprint(3), sections }.write_to(&mut bytes).unwrap();
    bytes
}

fn small() -> Vec<u8> {
    bytes(vec![
        Section::f64("sums", &[1.5, f64::NEG_INFINITY, -0.0]),
        Section::f32("means", &[0.25]),
        Section::u32("counts", &[7, u32::MAX]),
    ])
}

/// The file of a test, in a folder that goes with it.
struct Place {
    path: PathBuf,
    _folder: TempDir,
}

impl Place {
    fn new(name: &str) -> Self {
        let folder = tempfile::Builder::new().prefix(name).tempdir().unwrap();
        Place { path: folder.path().join("render.ckpt"), _folder: folder }
    }
}

fn said(error: &CheckpointError) -> String {
    let diagnostic = error.diagnostic();
    format!("{}: {}", diagnostic.code, diagnostic.message)
}

#[test]
fn numbers_come_back_by_name_and_kind() {
    let place = Place::new("names");
    let (sums, counts) = ([0.1, f64::NAN], [1, 2, 3]);
    let sections = vec![Section::f64("sums", &sums), Section::u32("counts", &counts)];
    Checkpoint { fingerprint: fingerprint(3), sections }.write(&place.path).unwrap();
    let checkpoint = Checkpoint::read_for(&place.path, &fingerprint(3)).unwrap();
    assert_eq!(
        checkpoint.f64("sums").unwrap().iter().map(|it| it.to_bits()).collect::<Vec<_>>(),
        sums.map(f64::to_bits)
    );
    assert_eq!(checkpoint.u32("counts"), Some(&counts[..]));
    assert_eq!((checkpoint.f32("sums"), checkpoint.u32("others")), (None, None));
}

#[test]
fn a_checkpoint_of_another_render_is_refused_with_the_difference() {
    let place = Place::new("foreign");
    let sections = Vec::new();
    Checkpoint { fingerprint: fingerprint(3), sections }.write(&place.path).unwrap();
    let error = Checkpoint::read_for(&place.path, &fingerprint(4)).unwrap_err();
    let expected = format!(
        "E0622: `{}` belongs to another render: the checkpoint has seed 3, the render seed 4",
        place.path.display()
    );
    assert_eq!(said(&error), expected);
}

#[test]
fn what_is_no_checkpoint_is_said() {
    let place = Place::new("damaged");
    let mut version = small();
    version[8] = 9;
    for (bytes, reason) in [
        (b"\x89PNG and more than twenty bytes".to_vec(), "it is not a checkpoint"),
        (b"RTSL".to_vec(), "it is not a checkpoint"),
        (version, "it has version 9 of the format, and this program reads version 1"),
        (small()[..100].to_vec(), "it is truncated: it has 100 of 211 bytes"),
        ([small(), vec![0]].concat(), "it has 212 bytes, expected 211"),
    ] {
        std::fs::write(&place.path, bytes).unwrap();
        let error = Checkpoint::read(&place.path).unwrap_err();
        assert_eq!(
            said(&error),
            format!("E0621: `{}` cannot be resumed: {reason}", place.path.display())
        );
    }
}

#[test]
fn files_that_cannot_be_read_or_written_are_said() {
    let place = Place::new("missing");
    let error = Checkpoint::read(&place.path).unwrap_err();
    assert!(said(&error).starts_with("E0601: cannot read the checkpoint"), "{error}");
    let error = Checkpoint::read(place.path.parent().unwrap()).unwrap_err();
    assert!(said(&error).ends_with("not a regular file"), "{error}");
    let checkpoint = Checkpoint { fingerprint: fingerprint(3), sections: Vec::new() };
    let error = checkpoint.write(&place.path.join("below/a/file")).unwrap_err();
    assert!(said(&error).starts_with("E0623: cannot write the checkpoint"), "{error}");
}

#[test]
fn a_write_that_fails_leaves_the_earlier_checkpoint() {
    let place = Place::new("earlier");
    let earlier = Checkpoint { fingerprint: fingerprint(3), sections: Vec::new() };
    earlier.write(&place.path).unwrap();
    // A folder where the file would be made: as good as a disk that is full.
    std::fs::create_dir(place.path.with_file_name(".render.ckpt.part")).unwrap();
    let numbers = [1.0; 10];
    let later =
        Checkpoint { fingerprint: fingerprint(3), sections: vec![Section::f64("sums", &numbers)] };
    assert!(matches!(later.write(&place.path), Err(CheckpointError::Unwritable { .. })));
    assert_eq!(Checkpoint::read(&place.path), Ok(earlier));
}

/// A file of some hundred bytes that claims numbers for terabytes.
#[test]
fn memory_is_taken_for_no_more_than_the_file_holds() {
    let whole = bytes(vec![Section::f64("sums", &[1.0])]);
    let at = whole.len() - 32 - 8 - 8;
    let mut claims = whole.clone();
    claims[at..at + 8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    let message = "`sums` has 1099511627776 numbers, more than the file holds".to_owned();
    assert_eq!(Checkpoint::from_bytes(&claims), Err(Damage::Malformed(message)));
}

/// Names the checkpoint that a process of [`writer_process`] writes.
const WRITTEN: &str = "RTSL_TEST_WRITES_CHECKPOINT";

/// Writes checkpoints until it is killed, if the environment names a file; the test below starts such processes.
#[test]
fn writer_process() {
    let Some(path) = std::env::var_os(WRITTEN) else { return };
    let sums = vec![0.5; 3000];
    let checkpoint =
        Checkpoint { fingerprint: fingerprint(3), sections: vec![Section::f64("sums", &sums)] };
    let end = std::time::Instant::now() + std::time::Duration::from_secs(2);
    while std::time::Instant::now() < end {
        checkpoint.write(Path::new(&path)).unwrap();
    }
}

/// A process that opened the file of another before that took its place must not write into it.
#[test]
fn processes_that_write_one_checkpoint_leave_it_whole() {
    let place = Place::new("processes");
    let writer = || {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command.args(["checkpoint::writer_process", "--exact"]).env(WRITTEN, &place.path);
        command.stdout(std::process::Stdio::null()).spawn().unwrap()
    };
    let mut writers = [writer(), writer(), writer()];
    let mut read = 0;
    while writers.iter_mut().any(|writer| writer.try_wait().unwrap().is_none()) {
        match Checkpoint::read_for(&place.path, &fingerprint(3)) {
            Ok(_) => read += 1,
            Err(error) => assert!(!place.path.exists() || read == 0, "after {read} reads: {error}"),
        }
    }
    assert!(read > 0);
    assert!(writers.into_iter().all(|mut writer| writer.wait().unwrap().success()));
    assert!(Checkpoint::read_for(&place.path, &fingerprint(3)).is_ok());
}

#[test]
fn the_format_is_pinned() {
    let digest = Digest::of(&small());
    let start: String = digest.0[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    expect_test::expect!["456aeafad98c93d7"].assert_eq(&start);
}

#[test]
fn any_flipped_bit_is_refused() {
    let whole = small();
    assert!(Checkpoint::from_bytes(&whole).is_ok());
    for bit in 0..whole.len() * 8 {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(Checkpoint::from_bytes(&flipped).is_err(), "bit {bit}");
    }
}

#[test]
fn any_beginning_is_refused() {
    let whole = small();
    for length in 0..whole.len() {
        assert!(Checkpoint::from_bytes(&whole[..length]).is_err(), "{length} bytes");
    }
}

proptest! {
    #[test]
    fn any_numbers_come_back(
        sums in prop::collection::vec(any::<u64>().prop_map(f64::from_bits), 0..9000),
        means in prop::collection::vec(any::<u32>().prop_map(f32::from_bits), 0..100),
        counts in prop::collection::vec(any::<u32>(), 0..100),
        name in ".{0,20}",
    ) {
        let sections = vec![
            Section::f64(&name, &sums),
            Section::f32("means", &means),
            Section::u32("counts", &counts),
        ];
        let first = bytes(sections);
        let mut second = Vec::new();
        let read = Checkpoint::from_bytes(&first).unwrap();
        prop_assert_eq!(read.sections.len(), 3);
        prop_assert_eq!(&read.sections[0].name, &name);
        read.write_to(&mut second).unwrap();
        prop_assert!(first == second);
    }

    #[test]
    fn any_change_of_a_large_file_is_refused(at in any::<prop::sample::Index>(), xor in 1_u8..) {
        let numbers: Vec<f64> = (0..2000).map(f64::from).collect();
        let mut changed = bytes(vec![Section::f64("sums", &numbers)]);
        *at.get_mut(&mut changed) ^= xor;
        prop_assert!(Checkpoint::from_bytes(&changed).is_err());
    }
}

#[test]
fn paths_of_errors_are_those_that_were_asked_for() {
    let path = Path::new("no/such/place.ckpt");
    let error = Checkpoint::read(path).unwrap_err();
    assert!(error.to_string().contains("`no/such/place.ckpt`"), "{error}");
}
