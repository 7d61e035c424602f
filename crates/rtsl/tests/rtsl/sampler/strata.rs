//! Stratified samplers.

use rtsl_integrate::sampler::{NUMBER, sampler_constants};
use rtsl_math::sampling::{Sampler, SamplerKind, hash};

use super::{STRATIFIED, call, equal, floats, function};

const GRID: Sampler = Sampler { kind: STRATIFIED, columns: 4, rows: 4, seed: 0 };

fn assert_each_once(mut found: Vec<u32>) {
    found.sort_unstable();
    assert_eq!(found, (0..found.len() as u32).collect::<Vec<_>>());
}

#[test]
fn permutations_are_permutations() {
    let permuted = function("rt_permuted", &[]);
    for length in [1, 2, 3, 4, 7, 16, 25, 100] {
        for key in 0..20 {
            let of_lanes = [(0..length).collect(), equal(length, length), equal(key, length)];
            assert_each_once(call(&permuted, &of_lanes).swap_remove(0));
        }
    }
}

#[test]
fn each_stratum_has_one_sample() {
    let number = function(NUMBER, &sampler_constants(&GRID));
    for dimension in 0..8 {
        let of_lanes = [equal(hash(0, 11), 16), equal(dimension, 16), (0..16).collect()];
        let numbers = call(&number, &of_lanes);
        assert_each_once(floats(&numbers[0]).iter().map(|it| (it * 16.0) as u32).collect());
    }
}

#[test]
fn positions_fill_the_grid() {
    let of_lanes = [equal(hash(0, 3), 16), (0..16).collect()];
    for name in ["rt_pixelPosition", "rt_lensPosition"] {
        let positions = call(&function(name, &sampler_constants(&GRID)), &of_lanes);
        let [x, y] = [0, 1].map(|axis| floats(&positions[axis]));
        let cell = |(x, y): (&f32, &f32)| (y * 4.0) as u32 * 4 + (x * 4.0) as u32;
        assert_each_once(x.iter().zip(&y).map(cell).collect());
    }
}

#[test]
fn what_samples_stand_for_depends_on_no_later_ones() {
    let parts = |sampler: &Sampler, samples: &[u32]| {
        let part = function("rt_partOfPixel", &sampler_constants(sampler));
        floats(&call(&part, &[samples.to_vec()])[0])
    };
    for kind in [SamplerKind::Independent, SamplerKind::Sobol] {
        let few = Sampler { kind, ..GRID };
        let many = Sampler { kind, columns: 16, rows: 9, seed: 0 };
        assert_eq!(parts(&few, &[0, 3, 15]), [1.0, 0.5, 0.25]);
        assert_eq!(parts(&many, &[0, 3, 15, 143]), [1.0, 0.5, 0.25, 0.125]);
    }
    assert_eq!(parts(&GRID, &[0]), [0.25]);
}
