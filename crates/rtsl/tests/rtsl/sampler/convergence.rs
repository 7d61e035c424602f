//! Properties of samplers: uniform numbers, independent pairs and fast convergence.

use rtsl::RendererFunction;
use rtsl_integrate::sampler::{NUMBER, PAIR, sampler_constants};
use rtsl_math::sampling::{Sampler, SamplerKind};

use super::{call, equal, floats, function, hashes, stream_keys};

const INDEPENDENT_SAMPLER: Sampler =
    Sampler { kind: SamplerKind::Independent, columns: 16, rows: 16, seed: 1 };
const SOBOL_SAMPLER: Sampler = Sampler { kind: SamplerKind::Sobol, ..INDEPENDENT_SAMPLER };

/// The function of the text that returns the numbers of a sampler.
fn number(sampler: &Sampler) -> RendererFunction {
    function(NUMBER, &sampler_constants(sampler))
}

/// Returns the numbers of a dimension for these samples of so many pixels, all those of a pixel together.
fn numbers(
    number: &RendererFunction,
    pixels: u32,
    dimension: u32,
    samples: std::ops::Range<u32>,
) -> Vec<f32> {
    let count = samples.len();
    let keys = stream_keys(pixels).into_iter().flat_map(|key| std::iter::repeat_n(key, count));
    let keys: Vec<u32> = keys.collect();
    let lanes = keys.len();
    let samples = samples.cycle().take(lanes).collect();
    floats(&call(number, &[keys, equal(dimension, lanes as u32), samples])[0])
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
    let sobol = number(&SOBOL_SAMPLER);
    // One sample per pixel, so that only hashing makes the numbers uniform.
    for dimension in 0..6 {
        for sample in [0, 1, 5, 1000] {
            let mut counts = [0_u32; 64];
            for number in numbers(&sobol, 1 << 15, dimension, sample..sample + 1) {
                counts[(number * 64.0) as usize] += 1;
            }
            let deviation = chi_square_deviation(&counts);
            assert!(deviation.abs() < 4.5, "dimension {dimension} of sample {sample}: {deviation}");
        }
    }
}

#[test]
fn dimensions_of_pairs_have_nothing_to_do_with_each_other() {
    let sobol = number(&SOBOL_SAMPLER);
    // All pixels' first 16 samples: cells of two dimensions, one from each pair.
    for (first, second) in [(0, 2), (0, 3), (1, 2), (1, 3), (0, 7), (2, 4), (1, 101)] {
        let mut counts = [0_u32; 256];
        let [columns, rows] = [first, second].map(|it| numbers(&sobol, 1 << 13, it, 0..16));
        for (column, row) in columns.iter().zip(&rows) {
            counts[(row * 16.0) as usize * 16 + (column * 16.0) as usize] += 1;
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
    let number = number(sampler);
    let columns: [Vec<f32>; DIMENSIONS] =
        std::array::from_fn(|dimension| numbers(&number, PIXELS, dimension as u32, 0..samples));
    let value = |lane: u32| integrand(std::array::from_fn(|it| columns[it][lane as usize].into()));
    let squares = (0..PIXELS).map(|pixel| {
        let lanes = pixel * samples..(pixel + 1) * samples;
        squared(lanes.map(value).sum::<f64>() / f64::from(samples) - truth)
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

#[test]
fn pairs_have_the_bits_of_single_numbers() {
    let stratified = Sampler { kind: super::STRATIFIED, ..SOBOL_SAMPLER };
    for sampler in [INDEPENDENT_SAMPLER, SOBOL_SAMPLER, stratified] {
        let number = number(&sampler);
        let pair = function(PAIR, &sampler_constants(&sampler));
        let keys = hashes(6, 256);
        let pairs: Vec<u32> = hashes(7, 256).iter().map(|it| it >> 1).collect();
        let samples: Vec<u32> = hashes(8, 256).iter().map(|it| it % 256).collect();
        let found = call(&pair, &[keys.clone(), pairs.clone(), samples.clone()]);
        for (component, found) in (0..2).zip(found) {
            let dimensions = pairs.iter().map(|pair| pair << 1 | component).collect();
            let singles = call(&number, &[keys.clone(), dimensions, samples.clone()]);
            assert_eq!(singles[0], found);
            assert!(floats(&found).iter().all(|number| (0.0..1.0).contains(number)));
        }
    }
}
