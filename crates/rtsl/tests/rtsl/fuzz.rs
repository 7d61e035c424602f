//! A short run of the fuzz targets for texts: mutations of the repository's own shaders, the same
//! in every run. `RTSL_FUZZ=N` runs N times as many.

#[path = "../../../../fuzz/entries/mutation.rs"]
mod mutation;
#[path = "../../../../fuzz/entries/text.rs"]
mod text;

use std::path::Path;

use mutation::{Random, mutate, seeds};

/// The stack that any text must be content with.
const STACK: usize = 2 << 20;

fn run(name: &str, cases: usize, target: impl Fn(&[u8]) + Send + 'static) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folders = ["shaders", "tests/syntax", "tests/glsl"];
    let seeds: Vec<Vec<u8>> =
        folders.iter().flat_map(|folder| seeds(&root.join(folder), "rtsl")).collect();
    let factor = std::env::var("RTSL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let work = move || {
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        for _ in 0..cases * factor {
            let (seed, other) = (random.below(seeds.len()), random.below(seeds.len()));
            let mutant = mutate(&mut random, &seeds[seed], &seeds[other]);
            let outcome =
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| target(&mutant)));
            if let Err(panic) = outcome {
                eprintln!("--- this text fails\n{}\n---", String::from_utf8_lossy(&mutant));
                std::panic::resume_unwind(panic);
            }
        }
    };
    let thread = std::thread::Builder::new().name(name.to_owned()).stack_size(STACK);
    assert!(thread.spawn(work).unwrap().join().is_ok(), "{name} fails");
}

#[test]
fn preprocessor() {
    run("preprocessor", 300, text::preprocessor);
}

#[test]
fn parser() {
    run("parser", 500, text::parser);
}

#[test]
fn compile() {
    run("compile", 200, |data| {
        text::compile(data);
    });
}

#[test]
fn the_seeds_of_the_compiler_compile() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders/textures");
    // The target has no files to include.
    let includes = |seed: &Vec<u8>| seed.windows(8).any(|word| word == b"#include");
    let seeds = seeds(&root, "rtsl").into_iter().filter(|seed| !includes(seed));
    let mut compiled = 0;
    for seed in seeds {
        assert!(text::compile(&seed), "{}", String::from_utf8_lossy(&seed));
        compiled += 1;
    }
    assert!(compiled > 10, "only {compiled} texts were found");
}
