//! Calls of Open Image Denoise, tested with a library that replaces it and computes something simple, because the real
//! one is not installed everywhere. The test needs a C compiler, without which it passes.

use std::path::{Path, PathBuf};
use std::process::Command;

use rtsl_image::{Denoiser, DenoiserError, DenoiserInput};
use tempfile::TempDir;

/// A filter gives 2 color + albedo + normal, and adds 10 where `hdr` and 100 where `cleanAux` is set; without a color,
/// its one image + 0.25. An image 13 wide is an error.
const SOURCE: &str = r#"
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
typedef struct { const char *error; } Device;
typedef struct { Device *device; const float *color, *albedo, *normal; float *output; size_t width, count; float added; } Filter;
Device *oidnNewDevice(int type) { return type == 1 ? calloc(1, sizeof(Device)) : NULL; }
void oidnCommitDevice(Device *device) {}
void oidnReleaseDevice(Device *device) { free(device); }
int VERSION_NAME(Device *device, const char *name) { return strcmp(name, "version") ? 0 : VERSION; }
int oidnGetDeviceError(Device *device, const char **message) {
    if (!device || !device->error) return 0;
    *message = device->error;
    device->error = NULL;
    return 1;
}
Filter *oidnNewFilter(Device *device, const char *type) {
    if (strcmp(type, "RT")) return NULL;
    Filter *filter = calloc(1, sizeof(Filter));
    filter->device = device;
    return filter;
}
void oidnSetSharedFilterImage(Filter *filter, const char *name, void *pixels, int format,
                              size_t width, size_t height, size_t offset, size_t pixel, size_t row) {
    if (format != 3 || offset || pixel || row) filter->device->error = "another format";
    filter->width = width;
    filter->count = 3 * width * height;
    if (!strcmp(name, "color")) filter->color = pixels;
    else if (!strcmp(name, "albedo")) filter->albedo = pixels;
    else if (!strcmp(name, "normal")) filter->normal = pixels;
    else if (!strcmp(name, "output")) filter->output = pixels;
    else filter->device->error = "an unknown image";
}
void SET_BOOL_NAME(Filter *filter, const char *name, bool value) {
    filter->added += value * (!strcmp(name, "hdr") ? 10 : !strcmp(name, "cleanAux") ? 100 : 1000);
}
void oidnCommitFilter(Filter *filter) {}
void oidnExecuteFilter(Filter *filter) {
    if (filter->width == 13) filter->device->error = "out of luck";
    for (size_t i = 0; i < filter->count; i++) {
        float albedo = filter->albedo ? filter->albedo[i] : 0, normal = filter->normal ? filter->normal[i] : 0;
        filter->output[i] = filter->color ? 2 * filter->color[i] + albedo + normal + filter->added : albedo + normal + 0.25f;
    }
}
void oidnReleaseFilter(Filter *filter) { free(filter); }
"#;

/// The library with the names of a version, and the folder that it lies in.
fn library(version: u32) -> Option<(PathBuf, TempDir)> {
    let folder = tempfile::tempdir().unwrap();
    let inside = |name| folder.path().join(name);
    let (source, library) = (inside("fake.c"), inside("libOpenImageDenoise.so.2"));
    std::fs::write(&source, SOURCE).unwrap();
    let names = match version / 10_000 {
        1 => ["-DVERSION_NAME=oidnGetDevice1i", "-DSET_BOOL_NAME=oidnSetFilter1b"],
        _ => ["-DVERSION_NAME=oidnGetDeviceInt", "-DSET_BOOL_NAME=oidnSetFilterBool"],
    };
    let compiled = Command::new("cc")
        .args(["-shared", "-fPIC", "-w"])
        .args(names)
        .arg(format!("-DVERSION={version}"))
        .arg(&source)
        .arg("-o")
        .arg(&library)
        .status();
    match compiled {
        Ok(status) => assert!(status.success(), "the library in its place does not compile"),
        Err(_) => return None,
    }
    Some((library, folder))
}

fn input<'a>(pixels: &'a [[f32; 3]]) -> DenoiserInput<'a> {
    DenoiserInput { width: pixels.len(), height: 1, color: pixels, albedo: None, normal: None }
}

#[test]
fn versions_1_and_2_are_asked_the_same() {
    for (version, expected) in [(10_403, (1, 4)), (20_501, (2, 5))] {
        let Some((path, _folder)) = library(version) else { return };
        let denoiser = Denoiser::open(&path).unwrap();
        assert_eq!((denoiser.version(), denoiser.path()), (expected, path.as_path()));
        let color = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        let alone = input(&color);
        assert_eq!(denoiser.denoise(&alone).unwrap()[1], [18.0, 20.0, 22.0]);
        let (albedo, normal) = ([[0.5; 3]; 2], [[0.125; 3]; 2]);
        // Normals are ignored without an albedo.
        let with_normal = DenoiserInput { normal: Some(&normal), ..alone };
        assert_eq!(denoiser.denoise(&with_normal), denoiser.denoise(&alone));
        let with_both = DenoiserInput { albedo: Some(&albedo), ..with_normal };
        // Twice the color, both others prefiltered, and both flags.
        let sum = 0.75 + 0.375 + 110.0;
        assert_eq!(denoiser.denoise(&with_both).unwrap()[0], [2.0 + sum, 4.0 + sum, 6.0 + sum]);
        let with_albedo = DenoiserInput { normal: None, ..with_both };
        assert_eq!(denoiser.denoise(&with_albedo).unwrap()[0][0], 2.0 + 0.75 + 110.0);
    }
}

#[test]
fn what_goes_wrong_is_said() {
    let Some((path, folder)) = library(20_000) else { return };
    let denoiser = Denoiser::open(&path).unwrap();
    let unlucky = [[0.0; 3]; 13];
    assert_eq!(
        denoiser.denoise(&input(&unlucky)),
        Err(DenoiserError::Failed("out of luck".to_owned()))
    );
    let albedo = [[0.0; 3]; 12];
    let wrong = DenoiserInput { albedo: Some(&albedo), ..input(&unlucky) };
    assert_eq!(
        denoiser.denoise(&wrong).unwrap_err().to_string(),
        "the albedo has 12 pixels, expected 13"
    );
    let refused = |path: &Path| Denoiser::open(path).err().unwrap().to_string();
    let missing = refused(&folder.path().join("missing.so"));
    assert!(missing.contains("missing.so` cannot be used as Open Image Denoise"), "{missing}");
    let source = refused(&folder.path().join("fake.c"));
    assert!(source.contains("cannot be used"), "{source}");
}

/// Tests the real library if it is installed.
#[test]
fn the_installed_library_takes_the_noise_out() {
    const SIDE: usize = 64;
    let Ok(denoiser) = Denoiser::load() else { return };
    // Two halves, bright and dim, with noise of a third of their brightness.
    let half = |index: usize| if index % SIDE < SIDE / 2 { 3.0_f32 } else { 0.2 };
    let noise = |index: usize| {
        let word = (index as u32 ^ 0x5bd1).wrapping_mul(0x9E37_79B9);
        let word = (word ^ word >> 15).wrapping_mul(0x846C_A68B);
        (word >> 16) as f32 / 65536.0 - 0.5
    };
    let pixels = |value: fn(f32, f32) -> f32| {
        let pixel = |index: usize| [value(half(index), noise(index)); 3];
        (0..SIDE * SIDE).map(pixel).collect::<Vec<_>>()
    };
    let color = pixels(|half, noise| half * (1.0 + noise));
    let (albedo, normal) = (pixels(|half, _| half / 4.0), vec![[0.0, 0.0, 1.0]; SIDE * SIDE]);
    let alone = DenoiserInput { width: SIDE, height: SIDE, ..input(&color) };
    let helped = DenoiserInput { albedo: Some(&albedo), normal: Some(&normal), ..alone };
    for input in [alone, helped] {
        let error = |image: &[[f32; 3]]| {
            let relative =
                |(index, pixel): (usize, &[f32; 3])| (pixel[0] / half(index) - 1.0).abs();
            image.iter().enumerate().map(relative).sum::<f32>() / image.len() as f32
        };
        let clean = denoiser.denoise(&input).unwrap();
        assert!(error(&clean) < 0.3 * error(&color), "{} {}", error(&clean), error(&color));
    }
}
