//! Pearson's chi-square test of samples against their density.
#![allow(clippy::disallowed_methods, reason = "these numbers only test; no result depends on them")]

use glam::Vec3;

use crate::sampling::grid::Grid;

/// A direction and the density with which it was chosen; 0 where none was.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub direction: Vec3,
    pub density: f32,
}

/// The standard normal distribution passes this with a probability of 1e-4.
const CRITICAL_DEVIATION: f64 = 3.719;
/// Cells that expect fewer samples are counted together.
const MIN_EXPECTED: f64 = 5.0;

/// Compares the samples with a density, whose integral over the grid must equal the part of samples that have one,
/// to this relative error.
///
/// # Errors
/// The first difference beyond chance.
pub fn compare(
    grid: &Grid,
    samples: &[Sample],
    density: impl FnMut(&[Vec3]) -> Vec<f32>,
    tolerance: f64,
) -> Result<(), String> {
    let mut observed = vec![0.0; Grid::CELLS];
    for sample in samples.iter().filter(|sample| sample.density != 0.0) {
        let Sample { direction, density } = sample;
        if !(direction.is_finite() && density.is_finite() && *density > 0.0) {
            return Err(format!("not a sample: {sample:?}"));
        }
        match grid.cell(*direction) {
            Some(cell) => observed[cell] += 1.0,
            None => return Err(format!("{direction} lies outside of the grid")),
        }
    }
    let parts = grid.integrate(density);
    if let Some(part) = parts.iter().find(|part| !(part.is_finite() && **part >= 0.0)) {
        return Err(format!("a cell's integral is {part}"));
    }
    let (chosen, integral) = (observed.iter().sum::<f64>(), parts.iter().sum::<f64>());
    let part = chosen / samples.len() as f64;
    let deviation = (part * (1.0 - part) / samples.len() as f64).sqrt();
    if integral > 1.0 + tolerance
        || (integral - part).abs() > tolerance + CRITICAL_DEVIATION * deviation
    {
        return Err(format!("the density's integral is {integral}, the part of samples {part}"));
    }
    // The parts of the whole were compared; here it is the shape that counts.
    let expected: Vec<f64> = parts.iter().map(|it| it * chosen / integral).collect();
    check_shape(&expected, &observed)
}

fn check_shape(expected: &[f64], observed: &[f64]) -> Result<(), String> {
    let (mut statistic, mut cells) = (0.0, 0_u32);
    let mut pool = (0.0, 0.0);
    let mut worst = (0.0, 0);
    for (cell, (expected, observed)) in expected.iter().zip(observed).enumerate() {
        if *expected < MIN_EXPECTED {
            pool = (pool.0 + expected, pool.1 + observed);
            continue;
        }
        let term = (observed - expected).powi(2) / expected;
        statistic += term;
        cells += 1;
        if term > worst.0 {
            worst = (term, cell);
        }
    }
    // Samples where the density says there should be none count in full.
    if pool.0 >= MIN_EXPECTED || pool.1 > MIN_EXPECTED {
        statistic += (pool.1 - pool.0).powi(2) / pool.0.max(1.0);
        cells += 1;
    }
    let critical = critical_value(f64::from(cells.saturating_sub(1).max(1)));
    if statistic > critical {
        let (term, cell) = worst;
        return Err(format!(
            "chi-square is {statistic:.0}, above {critical:.0}, in {cells} cells; the worst, cell \
             {cell}, adds {term:.0}: {} instead of {:.1}; in the pool {} instead of {:.1}",
            observed[cell], expected[cell], pool.1, pool.0
        ));
    }
    Ok(())
}

/// The value that chi-square with this many degrees of freedom exceeds with a probability of 1e-4 (Wilson and Hilferty:
/// its cube root is nearly normal).
fn critical_value(freedom: f64) -> f64 {
    let variance = 2.0 / (9.0 * freedom);
    freedom * (1.0 - variance + CRITICAL_DEVIATION * variance.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::sampling::host::random;

    /// Directions uniform in height and angle.
    fn uniform() -> Vec<Sample> {
        let sample = |ray| {
            let z = 2.0 * random(ray, 0) - 1.0;
            let (sine, cosine) = (2.0 * PI * random(ray, 1)).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            Sample { direction: Vec3::new(radius * cosine, radius * sine, z), density: 0.25 / PI }
        };
        (0..50_000).map(sample).collect()
    }

    fn density_of(density: impl Fn(&Vec3) -> f32) -> impl FnMut(&[Vec3]) -> Vec<f32> {
        move |directions| directions.iter().map(&density).collect()
    }

    #[test]
    fn right_densities_pass_and_wrong_ones_do_not() {
        let (grid, samples) = (Grid::sphere(Vec3::new(0.2, 0.5, 0.7)), uniform());
        let compare =
            |density: &dyn Fn(&Vec3) -> f32| compare(&grid, &samples, density_of(density), 0.005);
        assert_eq!(compare(&|_| 0.25 / PI), Ok(()));
        assert!(compare(&|_| 0.26 / PI).is_err_and(|it| it.contains("integral")));
        assert!(compare(&|it| (1.0 + 0.2 * it.x) * 0.25 / PI).is_err_and(|it| it.contains("chi")));
        assert!(compare(&|it| if it.y > 0.0 { 0.5 / PI } else { 0.0 }).is_err());
        assert!(compare(&|_| f32::NAN).is_err());
    }

    #[test]
    fn critical_values_are_those_of_tables() {
        for (freedom, value) in [(10.0, 35.56), (100.0, 161.32)] {
            assert!((critical_value(freedom) / value - 1.0).abs() < 0.02);
        }
    }
}
