//! Calls of the sampler's text, `prelude/renderer/sampler.rtsl`.

use rtsl_ir::{Constant, Query, Scalar, Value};
use rtsl_link::Linking;
use rtsl_math::sampling::{NUMBERS_OF_PAIRS, NUMBERS_OF_SINGLES, Sampler, SamplerKind, hash};

use crate::arithmetic::Arithmetic;

/// The scratch array with the key of each path's sequences.
pub const KEY_COLUMN: &str = "path.key";
/// The scratch array with the sample of each path.
pub const SAMPLE_COLUMN: &str = "path.sample";

/// The number of a kind in the text.
fn kind_number(kind: SamplerKind) -> u32 {
    match kind {
        SamplerKind::Independent => 0,
        SamplerKind::Stratified { .. } => 1,
        SamplerKind::Sobol => 2,
    }
}

impl Arithmetic<'_> {
    /// Calls a function of the renderer's texts.
    pub fn call(&mut self, name: &str, operands: &[Value]) -> Linking<Vec<Value>> {
        self.linker.call_text(name, operands, self.to)
    }

    /// Adds the constants of a sampler: an `rt_Sampler`.
    pub fn sampler(&mut self, sampler: &Sampler) -> Linking<Vec<Value>> {
        let Sampler { kind, columns, rows, seed: _ } = *sampler;
        let is_jittered = kind != SamplerKind::Stratified { jitter: false };
        let words = [kind_number(kind), columns, rows].map(Constant::U32);
        let constants = words.into_iter().chain([Constant::Bool(is_jittered)]);
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
            Query::Sample => ("rt_numberOfStream", NUMBERS_OF_SINGLES),
            _ => ("rt_pairOfStream", NUMBERS_OF_PAIRS),
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
        Ok(self.call_sampler("rt_numberOfStream", sampler, &operands)?[0])
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

#[cfg(test)]
mod tests {
    use rtsl_ir::host::NoHost;
    use rtsl_ir::{Function, Interpreter, Op, Output, Region, Storage, Variable};
    use rtsl_ir::{VariableId, VariableKind};
    use rtsl_link::Linker;

    use super::*;
    use crate::stage_linker::StageLinker;

    /// The words of the function's variables by index.
    struct Words(Vec<u32>);

    impl Storage for Words {
        fn load(&self, variable: VariableId, _: u32) -> u32 {
            self.0[variable.0 as usize]
        }

        fn elements(&self, _: VariableId) -> u32 {
            0
        }

        fn store(&mut self, variable: VariableId, _: u32, bits: u32) {
            self.0[variable.0 as usize] = bits;
        }
    }

    /// Returns a function that stores the numbers of one dimension and of one pair to `result.0` to `result.2`, then
    /// the positions in the pixel and on the lens, and the time. Its variables are, in order, the results, the
    /// dimension, key and sample.
    fn function(sampler: &Sampler) -> Function {
        let mut linker = StageLinker::new("sampler");
        let variable = |name: &str, scalar: Scalar| Variable {
            kind: VariableKind::Scratch,
            name: name.to_owned(),
            scalar,
            len: 1,
        };
        let results: [String; 8] = std::array::from_fn(|index| format!("result.{index}"));
        let results = results.map(|name| linker.intern_variable(variable(&name, Scalar::F32)));
        let mut ops: Vec<Op> = Vec::new();
        let mut code = Arithmetic { linker: &mut linker, to: &mut ops };
        let dimension = code.column("dimension", Scalar::I32).unwrap();
        let mut yields = code.numbers(sampler, Query::Sample, dimension).unwrap();
        yields.extend(code.numbers(sampler, Query::SamplePair, dimension).unwrap());
        let [key, sample] =
            [KEY_COLUMN, SAMPLE_COLUMN].map(|name| code.column(name, Scalar::U32).unwrap());
        yields.extend(code.call_sampler("rt_pixelPosition", sampler, &[key, sample]).unwrap());
        yields.extend(code.call_sampler("rt_lensPosition", sampler, &[key, sample]).unwrap());
        yields.extend(code.call_sampler("rt_number", sampler, &[key, sample]).unwrap());
        let outputs = results.map(|variable| Output { variable, component: 0 });
        linker.out.outputs.extend(outputs);
        linker.out.body = Region { ops, yields, ..Region::default() };
        rtsl_ir::verify::verify(&linker.out).expect("it is valid");
        linker.finish().function
    }

    #[test]
    fn numbers_are_those_of_the_sampler() {
        let stratified = |columns: u32, jitter: bool| {
            let kind = SamplerKind::Stratified { jitter };
            Sampler { kind, columns, rows: 4, seed: 7 }
        };
        let of_kind = |kind: SamplerKind| Sampler { kind, ..stratified(4, true) };
        let samplers = [
            of_kind(SamplerKind::Independent),
            of_kind(SamplerKind::Sobol),
            stratified(4, true),
            stratified(8, false),
            stratified(5, true),
            Sampler { columns: 1, rows: 1, ..stratified(1, true) },
        ];
        for sampler in samplers {
            let mut interpreter = Interpreter::prepare(&function(&sampler)).unwrap();
            for index in 0..200 {
                let (key, dimension) = (hash(1, index), index % 9);
                let sample = hash(2, index) % sampler.samples_per_pixel();
                let mut words = Words(vec![0; 8]);
                words.0.extend([dimension, key, sample]);
                let _ = interpreter.run(0, &mut words, &mut NoHost);
                let single = sampler.number(hash(key, NUMBERS_OF_SINGLES), dimension, sample);
                let pair = sampler.pair(hash(key, NUMBERS_OF_PAIRS), dimension, sample);
                let position = sampler.pixel_position(key, sample);
                let lens = sampler.lens_position(key, sample);
                let time = sampler.time(key, sample);
                let expected =
                    [single, pair[0], pair[1], position[0], position[1], lens[0], lens[1], time];
                assert_eq!(words.0[..8], expected.map(f32::to_bits), "{sampler:?}, {index}");
            }
        }
    }
}
