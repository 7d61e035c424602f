//! The numbers of a sampler, called by hosts.

use rtsl_abi::LaneBlock;
use rtsl_integrate::sampler::{NUMBER, PAIR, sampler_constants};
use rtsl_math::sampling::Sampler;

use super::engine::Engine;
use super::host_function::HostFunction;

/// The numbers of a sampler as kernels for many lanes, of the text that is a part of stages, too: the bits are the
/// same. Threads may share them.
#[derive(Debug)]
pub struct SamplerNumbers {
    sampler: Sampler,
    numbers: HostFunction,
    pairs: HostFunction,
}

impl SamplerNumbers {
    /// The number of arrays that calls have.
    pub const ARRAYS: usize = 5;

    /// Creates the numbers of a sampler.
    pub fn new(engine: &Engine, sampler: Sampler) -> SamplerNumbers {
        let known = sampler_constants(&sampler);
        let [numbers, pairs] = [NUMBER, PAIR].map(|name| HostFunction::new(engine, name, &known));
        SamplerNumbers { sampler, numbers, pairs }
    }

    /// Returns the sampler.
    pub fn sampler(&self) -> &Sampler {
        &self.sampler
    }

    /// Computes a number in [0,1) for each of so many lanes. The first three arrays are those of the keys of sequences,
    /// of dimensions and of the indices of samples; then come the numbers.
    pub fn numbers(&self, arrays: &mut LaneBlock, count: usize) {
        self.numbers.call(arrays, count);
    }

    /// Computes the numbers of dimensions 2k and 2k + 1, which are stratified together, for each of so many lanes. The
    /// first three arrays are those of keys, of k and of samples; then come the numbers.
    pub fn pairs(&self, arrays: &mut LaneBlock, count: usize) {
        self.pairs.call(arrays, count);
    }
}

#[cfg(test)]
mod tests {
    use rtsl_math::sampling::{SamplerKind, hash};

    use super::*;
    use crate::codegen::options::EngineOptions;

    /// Machine code takes the place of the interpreter without a change of numbers.
    #[test]
    fn first_numbers_are_interpreted() {
        const LANES: usize = 64;
        let engine = Engine::new(EngineOptions::default()).unwrap().0;
        let sampler = Sampler { kind: SamplerKind::Sobol, columns: 4, rows: 4, seed: 0 };
        let numbers = SamplerNumbers::new(&engine, sampler);
        let mut arrays = LaneBlock::new(SamplerNumbers::ARRAYS, LANES);
        (0..).zip(arrays.words_mut(0)).for_each(|(lane, key)| *key = hash(3, lane));
        let mut call = || {
            numbers.numbers(&mut arrays, LANES);
            let single = arrays.words(3).to_vec();
            numbers.pairs(&mut arrays, LANES);
            assert_eq!(arrays.words(3), single, "the first dimension");
            single
        };
        let first = call();
        assert!(!numbers.numbers.is_compiled());
        (0..HostFunction::INTERPRETED / LANES).for_each(|_| assert_eq!(call(), first));
        assert!(numbers.numbers.is_compiled());
    }
}
