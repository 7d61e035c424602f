//! The numbers of a sampler, called by hosts.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use rtsl_abi::LaneBlock;
use rtsl_integrate::sampler::{NUMBER, PAIR, sampler_constants};
use rtsl_ir::Constant;
use rtsl_math::sampling::Sampler;

use super::engine::Engine;
use super::renderer_function::RendererFunction;

/// The numbers of a sampler as kernels for many lanes, of the text that is a part of stages, too: the bits are the
/// same. Threads may share them.
///
/// Kernels are made when they are needed, since stages draw the numbers of most pictures. They are interpreted at
/// first, because the few numbers for the preparation of a scene take less time than machine code does.
#[derive(Debug)]
pub struct SamplerNumbers {
    engine: Engine,
    sampler: Sampler,
    numbers: LazyKernel,
    pairs: LazyKernel,
}

/// A function of the text as kernels.
#[derive(Debug, Default)]
struct LazyKernel {
    interpreted: OnceLock<RendererFunction>,
    compiled: OnceLock<RendererFunction>,
    /// The number of lanes of interpreted calls.
    lanes: AtomicUsize,
}

impl SamplerNumbers {
    /// The number of arrays that calls have.
    pub const ARRAYS: usize = 5;

    /// Creates the numbers of a sampler.
    pub fn new(engine: &Engine, sampler: Sampler) -> SamplerNumbers {
        let (numbers, pairs) = (LazyKernel::default(), LazyKernel::default());
        SamplerNumbers { engine: engine.clone(), sampler, numbers, pairs }
    }

    /// Returns the sampler.
    pub fn sampler(&self) -> &Sampler {
        &self.sampler
    }

    /// Computes a number in [0,1) for each of so many lanes. The first three arrays are those of the keys of sequences,
    /// of dimensions and of the indices of samples; then come the numbers.
    pub fn numbers(&self, arrays: &mut LaneBlock, count: usize) {
        self.call(&self.numbers, NUMBER, arrays, count);
    }

    /// Computes the numbers of dimensions 2k and 2k + 1, which are stratified together, for each of so many lanes. The
    /// first three arrays are those of keys, of k and of samples; then come the numbers.
    pub fn pairs(&self, arrays: &mut LaneBlock, count: usize) {
        self.call(&self.pairs, PAIR, arrays, count);
    }

    #[inline]
    fn call(&self, kernel: &LazyKernel, name: &str, arrays: &mut LaneBlock, count: usize) {
        let function = match kernel.compiled.get() {
            Some(compiled) => compiled,
            None => kernel.prepare(&self.engine, name, &sampler_constants(&self.sampler), count),
        };
        function.call(arrays, count, None);
    }
}

impl LazyKernel {
    /// The number of lanes that are interpreted, in about the time that it takes to make machine code.
    const INTERPRETED: usize = 1 << 12;

    /// Returns the function for a further call of so many lanes. One thread makes the machine code; the others need not
    /// wait. If code generation fails, the function is interpreted from then on.
    #[cold]
    fn prepare(
        &self,
        engine: &Engine,
        name: &str,
        known: &[Constant],
        count: usize,
    ) -> &RendererFunction {
        let before = self.lanes.fetch_add(count, Ordering::Relaxed);
        let is_last = before < Self::INTERPRETED && before + count >= Self::INTERPRETED;
        if is_last && let Ok(compiled) = engine.renderer_function(name, known) {
            return self.compiled.get_or_init(|| compiled);
        }
        self.interpreted.get_or_init(|| {
            let made = Engine::interpreter().renderer_function(name, known);
            made.expect("the interpreter runs the texts of the library")
        })
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
        assert!(numbers.numbers.compiled.get().is_none());
        (0..LazyKernel::INTERPRETED / LANES).for_each(|_| assert_eq!(call(), first));
        assert!(numbers.numbers.compiled.get().is_some());
    }
}
