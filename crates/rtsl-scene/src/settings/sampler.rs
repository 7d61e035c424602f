//! The sampler.

use rtsl::Diagnostics;
use rtsl_math::sampling::{Sampler, SamplerKind};

use super::Settings;
use super::parameters::{ParameterReader, unknown_setting};
use crate::description::Entity;

const MAX_SAMPLES: f64 = 65_536.0;

impl Settings {
    pub(super) fn read_sampler(
        &mut self,
        entity: &Entity,
        seed: Option<u64>,
        diagnostics: &mut Diagnostics,
    ) {
        let mut reader = ParameterReader::new(entity, diagnostics);
        let own = reader.whole("seed", -9.0e15, 9.0e15).map(|seed| (seed as i64).cast_unsigned());
        let seed = own.or(seed).unwrap_or(0);
        let count = reader.whole("pixelsamples", 1.0, MAX_SAMPLES);
        let columns = reader.whole("xsamples", 1.0, 256.0);
        let rows = reader.whole("ysamples", 1.0, 256.0);
        let jitter = reader.boolean("jitter").unwrap_or(true);
        // Scrambling is always Owen's, whatever the scene selects.
        reader.text("randomization");
        reader.finish();
        let (columns, rows) = match (columns, rows) {
            (None, None) => grid(count.map_or(16, |count| count as u32)),
            (columns, rows) => (columns.map_or(4, |n| n as u32), rows.map_or(4, |n| n as u32)),
        };
        let kind = match entity.class.as_str() {
            "independent" => SamplerKind::Independent,
            "stratified" => SamplerKind::Stratified { jitter },
            // One sampler implements all low-discrepancy samplers of the format.
            "sobol" | "halton" | "paddedsobol" | "zsobol" | "pmj02bn" => SamplerKind::Sobol,
            _ => {
                diagnostics.push(unknown_setting(entity, &["independent", "stratified", "sobol"]));
                SamplerKind::Independent
            }
        };
        self.sampler = Sampler { kind, columns, rows, seed };
    }
}

/// A stratified sampler of `count` samples.
pub fn stratified(count: u32, seed: u64) -> Sampler {
    let (columns, rows) = grid(count);
    Sampler { kind: SamplerKind::Stratified { jitter: true }, columns, rows, seed }
}

/// The columns and rows of a grid of `count` cells, as near to square as divisors permit.
pub fn grid(count: u32) -> (u32, u32) {
    let count = count.max(1);
    let divides = |rows: &u32| count.is_multiple_of(*rows);
    let rows = (1..=count.isqrt()).rev().find(divides).unwrap_or(1);
    (count / rows, rows)
}
