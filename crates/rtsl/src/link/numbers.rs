//! The numbers of a path's sampler as operations: [`Sampler`] in the representation of linked functions.

use rtsl_ir::{BinaryOp, CompareOp, OpKind, Query, Region, Scalar, Value};
use rtsl_math::sampling::{
    INDEPENDENT, NUMBERS_OF_PAIRS, NUMBERS_OF_SINGLES, SOBOL, Sampler, SamplerKind,
};

use super::arithmetic::Arithmetic;
use super::linker::Linking;

/// The scratch array with the key of each path's sequences.
pub(crate) const KEY_COLUMN: &str = "path.key";
/// The scratch array with the sample of each path.
pub(crate) const SAMPLE_COLUMN: &str = "path.sample";

impl Arithmetic<'_> {
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
        if query == Query::Sample {
            let key = self.hash_with(key, NUMBERS_OF_SINGLES)?;
            return Ok(vec![self.number_of_stream(sampler, key, dimension, sample)?]);
        }
        let key = self.hash_with(key, NUMBERS_OF_PAIRS)?;
        if sampler.spread() == SOBOL {
            let key = self.hash(key, dimension)?;
            return Ok(self.sobol_pair(key, sample)?.to_vec());
        }
        let one = self.word(1)?;
        let first = self.add(dimension, dimension)?;
        let second = self.add(first, one)?;
        Ok(vec![
            self.number_of_stream(sampler, key, first, sample)?,
            self.number_of_stream(sampler, key, second, sample)?,
        ])
    }

    /// As [`Sampler::number_of_stream`].
    pub fn number_of_stream(
        &mut self,
        sampler: &Sampler,
        key: Value,
        dimension: Value,
        sample: Value,
    ) -> Linking<Value> {
        if sampler.spread() == SOBOL {
            return self.sobol_number(key, dimension, sample);
        }
        let key = self.hash(key, dimension)?;
        self.number(sampler, key, sample)
    }

    /// Returns the time of a sample, as [`Sampler::time`]; `key` is that of a pixel's times.
    pub fn number(&mut self, sampler: &Sampler, key: Value, sample: Value) -> Linking<Value> {
        if sampler.spread() == SOBOL {
            return Ok(self.sobol_pair(key, sample)?[0]);
        }
        let random = self.random(key, sample)?;
        if sampler.spread() == INDEPENDENT {
            return Ok(random);
        }
        let order = self.hash_with(key, u32::MAX)?;
        let stratum = self.permuted(sampler, sample, order)?;
        self.in_stratum(sampler, (stratum, sampler.samples_per_pixel()), random)
    }

    /// Returns the position of a sample in its pixel, as [`Sampler::pixel_position`].
    pub fn position(
        &mut self,
        sampler: &Sampler,
        key: Value,
        sample: Value,
    ) -> Linking<[Value; 2]> {
        if sampler.spread() == SOBOL {
            return self.sobol_pair(key, sample);
        }
        let one = self.word(1)?;
        let even = self.shifted_left(sample, 1)?;
        let odd = self.binary(BinaryOp::Or, even, one)?;
        let random = [self.random(key, even)?, self.random(key, odd)?];
        if sampler.spread() == INDEPENDENT {
            return Ok(random);
        }
        let columns = self.word(sampler.columns)?;
        let column = self.binary(BinaryOp::Remainder, sample, columns)?;
        let row = self.divide(sample, columns)?;
        Ok([
            self.in_stratum(sampler, (column, sampler.columns), random[0])?,
            self.in_stratum(sampler, (row, sampler.rows), random[1])?,
        ])
    }

    /// Returns the position of a sample on the lens, as [`Sampler::lens_position`].
    pub fn lens_position(
        &mut self,
        sampler: &Sampler,
        key: Value,
        sample: Value,
    ) -> Linking<[Value; 2]> {
        let order = self.hash_with(key, 3)?;
        let sample = match sampler.kind {
            SamplerKind::Stratified { .. } => self.permuted(sampler, sample, order)?,
            SamplerKind::Independent | SamplerKind::Sobol => sample,
        };
        self.position(sampler, key, sample)
    }

    fn random(&mut self, key: Value, sample: Value) -> Linking<Value> {
        let bits = self.hash(key, sample)?;
        self.unit_float(bits)
    }

    /// The number in a stratum, of which there are `count`, at a random place or in the middle.
    fn in_stratum(
        &mut self,
        sampler: &Sampler,
        (stratum, count): (Value, u32),
        random: Value,
    ) -> Linking<Value> {
        let stratum = self.bitcast(Scalar::I32, stratum)?;
        let stratum = self.convert(Scalar::F32, stratum)?;
        let within = match sampler.kind {
            SamplerKind::Stratified { jitter: false } => self.float(0.5)?,
            _ => random,
        };
        let (place, count) = (self.add(stratum, within)?, self.float(count as f32)?);
        let number = self.divide(place, count)?;
        let (one, last) = (self.float(1.0)?, self.float(1.0_f32.next_down())?);
        let is_below = self.less(number, one)?;
        self.select(is_below, number, last)
    }

    /// The stratum of a sample in an order of all of a pixel's, as [`permute`](rtsl_math::sampling::permute).
    fn permuted(&mut self, sampler: &Sampler, sample: Value, order: Value) -> Linking<Value> {
        let count = sampler.samples_per_pixel();
        if count <= 1 {
            return self.word(0);
        }
        if count.is_power_of_two() {
            return self.permuted_power_of_two(sample, count, order);
        }
        let last = self.word(count - 1)?;
        let first = self.binary(BinaryOp::Min, sample, last)?;
        let param = self.linker.out.new_values(&[Scalar::U32]).get(0);
        let mut body = Region { params: vec![param], ..Region::default() };
        self.linker.nested(|linker| {
            let code = &mut Arithmetic { linker, to: &mut body.ops };
            let next = code.permuted_power_of_two(param, count.next_power_of_two(), order)?;
            let count = code.word(count)?;
            let again = code.compare(CompareOp::GreaterEqual, next, count)?;
            body.yields = vec![again, next];
            Ok(())
        })?;
        let kind = OpKind::Loop { initial: vec![first], body };
        Ok(self.linker.emit(self.to, kind, &[Scalar::U32], false)?.get(0))
    }

    fn permuted_power_of_two(&mut self, index: Value, length: u32, key: Value) -> Linking<Value> {
        let mask = length.wrapping_sub(1);
        let (mask_word, shift) = (self.word(mask)?, self.word((mask.count_ones() / 2).max(1))?);
        let one = self.word(1)?;
        let mut value = self.and(index, mask_word)?;
        for round in 0..4 {
            let word = self.hash_with(key, round)?;
            let odd = self.binary(BinaryOp::Or, word, one)?;
            let high = self.shifted(word, 16)?;
            value = self.multiply(value, odd)?;
            value = self.add(value, high)?;
            value = self.and(value, mask_word)?;
            let shifted = self.binary(BinaryOp::ShiftRight, value, shift)?;
            value = self.binary(BinaryOp::Xor, value, shifted)?;
        }
        Ok(value)
    }

    fn sobol_number(&mut self, key: Value, dimension: Value, sample: Value) -> Linking<Value> {
        let pair = self.shifted(dimension, 1)?;
        let key = self.hash(key, pair)?;
        let one = self.word(1)?;
        let component = self.and(dimension, one)?;
        let index = self.shuffled(sample, key)?;
        let product = self.pascal(index)?;
        let first = self.scrambled(index, key, 0)?;
        let second = self.scrambled(product, key, 1)?;
        let is_second = self.compare(CompareOp::Equal, component, one)?;
        let bits = self.select(is_second, second, first)?;
        self.unit_float(bits)
    }

    fn sobol_pair(&mut self, key: Value, sample: Value) -> Linking<[Value; 2]> {
        let index = self.shuffled(sample, key)?;
        let first = self.scrambled(index, key, 0)?;
        let product = self.pascal(index)?;
        let second = self.scrambled(product, key, 1)?;
        Ok([self.unit_float(first)?, self.unit_float(second)?])
    }

    /// The index that replaces a sample.
    fn shuffled(&mut self, sample: Value, key: Value) -> Linking<Value> {
        let reversed = self.reversed(sample)?;
        let hashed = self.owen_hash(reversed, key)?;
        self.reversed(hashed)
    }

    fn scrambled(&mut self, product: Value, key: Value, component: u32) -> Linking<Value> {
        let offset = self.word((component + 1).wrapping_mul(0x9E37_79B9))?;
        let seed = self.add(key, offset)?;
        let seed = self.mix(seed)?;
        let hashed = self.owen_hash(product, seed)?;
        self.reversed(hashed)
    }

    fn pascal(&mut self, mut index: Value) -> Linking<Value> {
        for (shift, mask) in [
            (16, 0x0000_FFFF),
            (8, 0x00FF_00FF),
            (4, 0x0F0F_0F0F),
            (2, 0x3333_3333),
            (1, 0x5555_5555),
        ] {
            let (shifted, mask) = (self.shifted(index, shift)?, self.word(mask)?);
            let chosen = self.and(shifted, mask)?;
            index = self.binary(BinaryOp::Xor, index, chosen)?;
        }
        Ok(index)
    }

    fn owen_hash(&mut self, bits: Value, seed: Value) -> Linking<Value> {
        let bits = self.xor_product(bits, 0x3D20_ADEA)?;
        let (high, one) = (self.shifted(seed, 16)?, self.word(1)?);
        let odd = self.binary(BinaryOp::Or, high, one)?;
        let bits = self.add(bits, seed)?;
        let bits = self.multiply(bits, odd)?;
        let bits = self.xor_product(bits, 0x0552_6C56)?;
        self.xor_product(bits, 0x53A2_2864)
    }

    fn xor_product(&mut self, bits: Value, factor: u32) -> Linking<Value> {
        let factor = self.word(factor)?;
        let product = self.multiply(bits, factor)?;
        self.binary(BinaryOp::Xor, bits, product)
    }

    /// The bits in the opposite order.
    fn reversed(&mut self, mut bits: Value) -> Linking<Value> {
        for (shift, mask) in
            [(1, 0x5555_5555), (2, 0x3333_3333), (4, 0x0F0F_0F0F), (8, 0x00FF_00FF)]
        {
            let mask = self.word(mask)?;
            let high = self.shifted(bits, shift)?;
            let high = self.and(high, mask)?;
            let low = self.and(bits, mask)?;
            let low = self.shifted_left(low, shift)?;
            bits = self.binary(BinaryOp::Or, high, low)?;
        }
        let (high, low) = (self.shifted(bits, 16)?, self.shifted_left(bits, 16)?);
        self.binary(BinaryOp::Or, high, low)
    }

    /// As [`rtsl_math::sampling::hash`].
    pub fn hash(&mut self, a: Value, b: Value) -> Linking<Value> {
        let (mixed, offset) = (self.mix(a)?, self.word(0x9E37_79B9)?);
        let sum = self.add(mixed, b)?;
        let sum = self.add(sum, offset)?;
        self.mix(sum)
    }

    pub fn hash_with(&mut self, a: Value, b: u32) -> Linking<Value> {
        let b = self.word(b)?;
        self.hash(a, b)
    }

    fn mix(&mut self, word: Value) -> Linking<Value> {
        let word = self.mix_round(word, 16, 0x7FEB_352D)?;
        let word = self.mix_round(word, 15, 0x846C_A68B)?;
        let shifted = self.shifted(word, 16)?;
        self.binary(BinaryOp::Xor, word, shifted)
    }

    fn mix_round(&mut self, word: Value, shift: u32, factor: u32) -> Linking<Value> {
        let (shifted, factor) = (self.shifted(word, shift)?, self.word(factor)?);
        let word = self.binary(BinaryOp::Xor, word, shifted)?;
        self.multiply(word, factor)
    }

    /// As [`rtsl_math::sampling::unit_float`].
    fn unit_float(&mut self, bits: Value) -> Linking<Value> {
        let high = self.shifted(bits, 8)?;
        let high = self.bitcast(Scalar::I32, high)?;
        let number = self.convert(Scalar::F32, high)?;
        let unit = self.float(1.0 / 16_777_216.0)?;
        self.multiply(number, unit)
    }

    fn shifted(&mut self, word: Value, shift: u32) -> Linking<Value> {
        let shift = self.word(shift)?;
        self.binary(BinaryOp::ShiftRight, word, shift)
    }

    fn shifted_left(&mut self, word: Value, shift: u32) -> Linking<Value> {
        let shift = self.word(shift)?;
        self.binary(BinaryOp::ShiftLeft, word, shift)
    }
}

#[cfg(test)]
mod tests {
    use rtsl_ir::host::NoHost;
    use rtsl_ir::{Function, Interpreter, Op, Output, Region, Storage, Variable};
    use rtsl_ir::{VariableId, VariableKind};
    use rtsl_math::sampling::hash;

    use super::super::linker::Linker;
    use super::*;

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

    /// Returns a function that stores the numbers of one dimension and of one pair to `result.0` to `result.2`, then the
    /// positions in the pixel and on the lens, and the time. Its variables are, in order, the results, the dimension, key
    /// and sample.
    fn function(sampler: &Sampler) -> Function {
        let mut linker = Linker::new(Function::new("numbers".to_owned()));
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
        yields.extend(code.position(sampler, key, sample).unwrap());
        yields.extend(code.lens_position(sampler, key, sample).unwrap());
        yields.push(code.number(sampler, key, sample).unwrap());
        let outputs = results.map(|variable| Output { variable, component: 0 });
        linker.out.outputs.extend(outputs);
        linker.out.body = Region { ops, yields, ..Region::default() };
        rtsl_ir::verify::verify(&linker.out).expect("it is valid");
        linker.out
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
                let single =
                    sampler.single_number(hash(key, NUMBERS_OF_SINGLES), dimension, sample);
                let pair = sampler.single_pair(hash(key, NUMBERS_OF_PAIRS), dimension, sample);
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
