//! Properties of samplers: uniform numbers, independent pairs and fast convergence.

use proptest::prelude::*;
use rtsl_math::sampling::{Sampler, SamplerKind};

const INDEPENDENT_SAMPLER: Sampler =
    Sampler { kind: SamplerKind::Independent, columns: 16, rows: 16, seed: 1 };
const SOBOL_SAMPLER: Sampler = Sampler { kind: SamplerKind::Sobol, ..INDEPENDENT_SAMPLER };

fn sobol(pixel: u32, dimension: u32, sample: u32) -> f32 {
    SOBOL_SAMPLER.number(SOBOL_SAMPLER.pixel_keys(pixel).stream, dimension, sample)
}

/// Pearson's statistic minus its mean, in standard deviations of its distribution.
fn chi_square_deviation(counts: &[u32]) -> f64 {
    let freedom = (counts.len() - 1) as f64;
    let expected = f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
    let square = |count: &u32| squared(f64::from(*count) - expected) / expected;
    (counts.iter().map(square).sum::<f64>() - freedom) / (2.0 * freedom).sqrt()
}

fn squared(x: f64) -> f64 {
    x * x
}

#[test]
fn each_dimension_is_even_over_pixels() {
    // One sample per pixel, so that only hashing makes the numbers uniform.
    for dimension in 0..6 {
        for sample in [0, 1, 5, 1000] {
            let mut counts = [0_u32; 64];
            for pixel in 0..1 << 15 {
                counts[(sobol(pixel, dimension, sample) * 64.0) as usize] += 1;
            }
            let deviation = chi_square_deviation(&counts);
            assert!(deviation.abs() < 4.5, "dimension {dimension} of sample {sample}: {deviation}");
        }
    }
}

#[test]
fn dimensions_of_pairs_have_nothing_to_do_with_each_other() {
    // All pixels' first 16 samples: cells of two dimensions, one from each pair.
    for (first, second) in [(0, 2), (0, 3), (1, 2), (1, 3), (0, 7), (2, 4), (1, 101)] {
        let mut counts = [0_u32; 256];
        for pixel in 0..1 << 13 {
            for sample in 0..16 {
                let [column, row] =
                    [first, second].map(|it| (sobol(pixel, it, sample) * 16.0) as usize);
                counts[row * 16 + column] += 1;
            }
        }
        // Strata of each dimension are full in every pixel, which takes away 30 of 255 degrees of freedom.
        let deviation = chi_square_deviation(&counts);
        assert!((-6.0..4.5).contains(&deviation), "{first} and {second}: {deviation}");
    }
}

/// The root of the mean square error of `integrand`'s mean over `samples`, over many pixels.
fn error<const DIMENSIONS: usize>(
    sampler: &Sampler,
    samples: u32,
    integrand: impl Fn([f64; DIMENSIONS]) -> f64,
    truth: f64,
) -> f64 {
    const PIXELS: u32 = 300;
    let squares = (0..PIXELS).map(|pixel| {
        let key = sampler.pixel_keys(pixel).stream;
        let value = |sample: u32| {
            integrand(std::array::from_fn(|dimension| {
                f64::from(sampler.number(key, dimension as u32, sample))
            }))
        };
        squared((0..samples).map(value).sum::<f64>() / f64::from(samples) - truth)
    });
    (squares.sum::<f64>() / f64::from(PIXELS)).sqrt()
}

#[test]
fn a_smooth_integrand_converges_faster_than_by_independent_numbers() {
    let smooth = |[x, y]: [f64; 2]| x * x * (1.0 + y) * y;
    let truth = 1.0 / 3.0 * (1.0 / 2.0 + 1.0 / 3.0);
    let ratio = |samples| {
        error::<2>(&INDEPENDENT_SAMPLER, samples, smooth, truth)
            / error::<2>(&SOBOL_SAMPLER, samples, smooth, truth)
    };
    // The error of a scrambled net falls as n^-1.5, of independent numbers as n^-0.5.
    let ratios = [16, 64, 256, 1024].map(ratio);
    for (least, ratio) in [4.0, 16.0, 56.0, 200.0].into_iter().zip(ratios) {
        assert!(ratio > least, "{ratios:?}");
    }
}

#[test]
fn any_number_of_samples_is_better_than_independent_ones() {
    let smooth = |[x, y]: [f64; 2]| (x - 0.3) * (x - 0.3) + x * y;
    let truth = 1.0 / 3.0 - 0.3 + 0.09 + 0.25;
    for samples in [3, 7, 33, 100, 1000] {
        let independent = error::<2>(&INDEPENDENT_SAMPLER, samples, smooth, truth);
        let sobol = error::<2>(&SOBOL_SAMPLER, samples, smooth, truth);
        assert!(sobol < 0.8 * independent, "{samples}: {sobol} against {independent}");
    }
}

#[test]
fn pairs_that_are_padded_together_converge_too() {
    let smooth = |p: [f64; 6]| p.iter().map(|x| 0.5 + x).product::<f64>();
    let independent = error::<6>(&INDEPENDENT_SAMPLER, 256, smooth, 1.0);
    let sobol = error::<6>(&SOBOL_SAMPLER, 256, smooth, 1.0);
    assert!(sobol < 0.6 * independent, "{sobol} against {independent}");
}

proptest! {
    #[test]
    fn pairs_have_the_bits_of_single_numbers(
        key in any::<u32>(),
        dimension in any::<u32>(),
        sample in any::<u32>(),
    ) {
        let number = SOBOL_SAMPLER.number(key, dimension, sample);
        let pair = SOBOL_SAMPLER.pair(key, dimension >> 1, sample);
        prop_assert_eq!(pair[(dimension & 1) as usize].to_bits(), number.to_bits());
        prop_assert!((0.0..1.0).contains(&number));
    }
}
