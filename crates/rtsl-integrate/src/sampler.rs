//! Calls of the sampler's text, `prelude/renderer/sampler.rtsl`.

use rtsl_ir::{Constant, Query, Scalar, Value};
use rtsl_link::Linking;
use rtsl_math::sampling::{NUMBERS_OF_PAIRS, NUMBERS_OF_SINGLES, Sampler, SamplerKind, hash};

use crate::arithmetic::Arithmetic;

/// The scratch array with the key of each path's sequences.
pub const KEY_COLUMN: &str = "path.key";
/// The scratch array with the sample of each path.
pub const SAMPLE_COLUMN: &str = "path.sample";

/// The text's function of a number of a stream: its parameters are the sampler, the key of the stream, the dimension
/// and the index of the sample.
pub const NUMBER: &str = "rt_numberOfStream";
/// That of two numbers which are stratified together: its parameters have the pair of dimensions instead.
pub const PAIR: &str = "rt_pairOfStream";

/// Returns the scalars of a sampler as a parameter of the text's functions.
pub fn sampler_constants(sampler: &Sampler) -> [Constant; 4] {
    let Sampler { kind, columns, rows, seed: _ } = *sampler;
    let number = match kind {
        SamplerKind::Independent => 0,
        SamplerKind::Stratified { .. } => 1,
        SamplerKind::Sobol => 2,
    };
    let is_jittered = kind != SamplerKind::Stratified { jitter: false };
    let [number, columns, rows] = [number, columns, rows].map(Constant::U32);
    [number, columns, rows, Constant::Bool(is_jittered)]
}

impl Arithmetic<'_> {
    /// Calls a function of the renderer's texts.
    pub fn call(&mut self, name: &str, operands: &[Value]) -> Linking<Vec<Value>> {
        self.linker.call_text(name, operands, self.to)
    }

    /// Adds the constants of a sampler: an `rt_Sampler`.
    pub fn sampler(&mut self, sampler: &Sampler) -> Linking<Vec<Value>> {
        let constants = sampler_constants(sampler).into_iter();
        constants.map(|constant| self.linker.constant(self.to, constant)).collect()
    }

    /// Adds the constant that selects the numbers of an image.
    pub fn seed(&mut self, sampler: &Sampler) -> Linking<Value> {
        self.word(hash((sampler.seed >> 32) as u32, sampler.seed as u32))
    }

    /// Calls a function whose first parameter is the sampler.
    fn call_sampler(
        &mut self,
        name: &str,
        sampler: &Sampler,
        operands: &[Value],
    ) -> Linking<Vec<Value>> {
        let operands = [&self.sampler(sampler)?, operands].concat();
        self.call(name, &operands)
    }

    /// Returns the numbers that a query for dimensions gets.
    pub fn numbers(
        &mut self,
        sampler: &Sampler,
        query: Query,
        dimension: Value,
    ) -> Linking<Vec<Value>> {
        let key = self.column(KEY_COLUMN, Scalar::U32)?;
        let sample = self.column(SAMPLE_COLUMN, Scalar::U32)?;
        let dimension = self.bitcast(Scalar::U32, dimension)?;
        let (name, numbers) = match query {
            Query::Sample => (NUMBER, NUMBERS_OF_SINGLES),
            _ => (PAIR, NUMBERS_OF_PAIRS),
        };
        let key = self.hash_with(key, numbers)?;
        self.call_sampler(name, sampler, &[key, dimension, sample])
    }

    /// Returns the number of a dimension in a stream.
    pub fn number_of_stream(
        &mut self,
        sampler: &Sampler,
        key: Value,
        dimension: Value,
        sample: Value,
    ) -> Linking<Value> {
        let operands = [key, dimension, sample];
        Ok(self.call_sampler(NUMBER, sampler, &operands)?[0])
    }

    /// Returns the hash of a word and a constant.
    pub fn hash_with(&mut self, a: Value, b: u32) -> Linking<Value> {
        let b = self.word(b)?;
        self.hash(a, b)
    }

    pub fn hash(&mut self, a: Value, b: Value) -> Linking<Value> {
        Ok(self.call("rt_hash", &[a, b])?[0])
    }
}
