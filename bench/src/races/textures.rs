//! Noise.

use rtsl::{CallMode, Method};

use crate::kernels::{HashedFbm, TableFbm};
use crate::race::{Parameter, Race, Shader, WrittenForms, independent};
use crate::random::Random;

pub fn races() -> Vec<Race> {
    let race = |name, file, class, parameters, written| Race {
        name,
        shader: Shader { file, class, method: Method::Lookup, mode: CallMode::Packet },
        state: &["rt_TextureUVW", "rt_FloatTextureValue"],
        others: &[],
        inputs: 3,
        in_place: false,
        rays: |random| independent(random, |random| random.point(8.0).to_vec()),
        parameters,
        written,
    };
    let table = vec![Parameter::table("permutation", permutation())];
    vec![
        race("fbm_hash", "fbm_hash.rtsl", "HashedFbm", Vec::new(), WrittenForms::of::<HashedFbm>()),
        race("fbm_table", "fbm_table.rtsl", "TableFbm", table, WrittenForms::of::<TableFbm>()),
    ]
}

/// 0 to 255 in some order, twice.
fn permutation() -> Vec<u32> {
    let mut random = Random::new(1);
    let mut once: Vec<u32> = (0..256).collect();
    for last in (1..once.len()).rev() {
        once.swap(last, (random.next() % (last as u64 + 1)) as usize);
    }
    once.repeat(2)
}
