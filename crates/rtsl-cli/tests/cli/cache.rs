//! The cache of machine code: pictures with it, without it, and what it refuses.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::os::unix::fs::PermissionsExt;

use crate::command::{DONE, Folder, ball_scene};

const RENDER: [&str; 7] =
    ["render", "scene.pbrt", "-o", "a.exr", "--threads", "2", "--optimise=first"];

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("scene.pbrt", ball_scene([32, 32], 4));
    folder
}

/// The files of the cache with their contents.
fn files(folder: &Folder) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder.path("cache")).into_iter().flatten().flatten();
    let file = |entry: std::fs::DirEntry| {
        (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())
    };
    entries.map(file).collect()
}

/// True where kernels are machine code.
fn has_llvm(folder: &Folder) -> bool {
    !folder.run(&["info"]).exits(DONE).output().contains("LLVM          none")
}

#[test]
fn a_second_render_takes_what_the_first_compiled() {
    let folder = folder("cache");
    if !has_llvm(&folder) {
        return;
    }
    folder.run(&RENDER).exits(DONE);
    let picture = folder.bytes("a.exr");
    assert!(!folder.path("cache").exists());
    let compiled = |arguments: &[&str]| {
        let arguments = [&RENDER[..], &["-v"], arguments].concat();
        let ran = folder.run_with_cache("cache", &arguments).exits(DONE);
        assert_eq!(folder.bytes("a.exr"), picture);
        ran.errors().lines().filter(|line| line.trim_start().starts_with("llvm_compile")).count()
    };
    let first = compiled(&[]);
    let kept = files(&folder);
    assert!(first > 3 && kept.len() >= first - 1, "{first} modules, {} files", kept.len());
    // A small one is compiled in any case, so that LLVM is there when it is needed.
    assert_eq!(compiled(&[]), 1);
    assert_eq!(files(&folder), kept);
    assert!(compiled(&["--no-cache"]) > 3);
    let info = folder.run_with_cache("cache", &["info"]).exits(DONE).output();
    assert!(info.contains(&format!("/cache, {} modules", kept.len())), "{info}");
    // Damaged files count as missing, and are written again.
    for name in kept.keys() {
        let path = folder.path("cache").join(name);
        let mut bytes = std::fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(&path, bytes).unwrap();
    }
    assert!(compiled(&[]) > 3);
    assert_eq!(compiled(&[]), 1);
}

#[test]
fn a_folder_that_others_may_write_is_not_used() {
    let folder = folder("lax-cache");
    let path = folder.path("cache");
    std::fs::create_dir(&path).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o777)).unwrap();
    let ran = folder.run_with_cache("cache", &RENDER).exits(DONE);
    let errors = ran.errors();
    assert!(
        errors.contains("warning: machine code is not kept: other users may write"),
        "{errors}"
    );
    assert!(errors.contains("of mode 700"), "{errors}");
    assert!(files(&folder).is_empty());
    let info = folder.run_with_cache("cache", &["info"]).exits(DONE).output();
    assert!(info.contains("/cache, not used: other users may write"), "{info}");
    folder.write("file", "");
    let ran = folder.run_with_cache("file", &RENDER).exits(DONE);
    assert!(ran.errors().contains("can't be used"), "{}", ran.errors());
}
