//! A short run of the fuzz target for scenes: mutations of the repository's own, the same in
//! every run.

#[path = "../../../fuzz/entries/mutation.rs"]
mod mutation;
#[path = "../../../fuzz/entries/scene.rs"]
mod scene;

use std::path::Path;

use mutation::{Random, mutate, seeds};

#[test]
fn any_scene_is_read_or_refused() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let seeds = seeds(&root, "pbrt");
    let work = move || {
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        for _ in 0..1000 {
            let (seed, other) = (random.below(seeds.len()), random.below(seeds.len()));
            scene::scene(&mutate(&mut random, &seeds[seed], &seeds[other]));
        }
    };
    // The stack that any text must be content with.
    let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(work).unwrap();
    assert!(thread.join().is_ok());
}
