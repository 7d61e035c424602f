//! The random sequences of a path's calls: of light samples, and of methods of materials that draw numbers; and the
//! numbers that the method that was split draws itself.
//!
//! A path begins a sequence for each such call. It counts them, for each purpose, from a multiple for each search on;
//! the counts pass from stage to stage in scratch arrays. So does the count of the method's own numbers, which searches
//! do not change.

use rtsl_ir::{
    Index, Op, OpKind, Output, Region, Scalar, Value, Variable, VariableId, VariableKind,
};
use rtsl_math::sampling::{
    NUMBERS_OF_LIGHT_SAMPLES, NUMBERS_OF_LIGHTS, NUMBERS_OF_MATERIAL_CALLS, NUMBERS_OF_RAND,
    NUMBERS_OF_SHAPES, Sampler,
};

use super::arithmetic::Arithmetic;
use super::linker::{Linker, Linking};
use super::numbers::{KEY_COLUMN, SAMPLE_COLUMN};
use super::search::SEARCHES_COLUMN;

/// The number of sequences of a purpose among which those of a search count.
pub const SEQUENCES_OF_SEARCH: u32 = 1 << 10;

/// The purpose of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Purpose {
    LightSample,
    MaterialCall,
}

/// The scratch array that counts the numbers of `rand()` in the method that was split.
pub(crate) const DRAWN_COLUMN: &str = "path.drawn";

impl Purpose {
    pub const ALL: [Purpose; 2] = [Purpose::LightSample, Purpose::MaterialCall];

    /// Returns the name of the scratch array that counts a path's sequences.
    pub const fn column(self) -> &'static str {
        match self {
            Purpose::LightSample => "path.lights",
            Purpose::MaterialCall => "path.materials",
        }
    }

    /// Returns what selects the sequences among those of a path, and the numbers of a call among those of a vertex.
    const fn selectors(self) -> [u32; 2] {
        match self {
            Purpose::LightSample => [NUMBERS_OF_LIGHT_SAMPLES, NUMBERS_OF_LIGHTS],
            Purpose::MaterialCall => [NUMBERS_OF_MATERIAL_CALLS, NUMBERS_OF_SHAPES],
        }
    }
}

/// The random numbers that a copied method takes.
#[derive(Clone, Copy)]
pub(crate) struct CopiedNumbers {
    key: Value,
    sampler: Sampler,
    /// The local that counts the numbers taken.
    count: VariableId,
}

impl Linker {
    /// Begins the random numbers of a method that is copied next.
    pub(super) fn begin_numbers(
        &mut self,
        key: Value,
        sampler: Sampler,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let count = self.new_local(format!("numbers.{}", self.out.variables.len()));
        let code = &mut Arithmetic { linker: self, to };
        let zero = code.word(0)?;
        code.count_to(count, zero)?;
        self.copied_numbers = Some(CopiedNumbers { key, sampler, count });
        Ok(())
    }

    /// Returns the next random number of a method that is being copied.
    pub(super) fn next_number(
        &mut self,
        numbers: CopiedNumbers,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let CopiedNumbers { key, sampler, count } = numbers;
        let code = &mut Arithmetic { linker: self, to };
        let dimension = code.counted(count)?;
        let one = code.word(1)?;
        let next = code.add(dimension, one)?;
        code.count_to(count, next)?;
        let sample = code.column(SAMPLE_COLUMN, Scalar::U32)?;
        code.number_of_stream(&sampler, key, dimension, sample)
    }

    /// Loads the counts of sequences when the stage begins, and stores them when it ends. Right after a search, the number
    /// of searches tells the counts of sequences.
    pub(super) fn pass_on_counts(&mut self) -> Linking<()> {
        let follows_search = self.surface.as_ref().is_some_and(|links| links.follows_search);
        for (column, counter) in self.counters.clone() {
            let mut ops = Vec::new();
            let code = &mut Arithmetic { linker: &mut *self, to: &mut ops };
            let before = match follows_search && column != DRAWN_COLUMN {
                true => {
                    let searches = code.column(SEARCHES_COLUMN, Scalar::U32)?;
                    code.count_after(searches)?
                }
                false => code.column(column, Scalar::U32)?,
            };
            code.count_to(counter, before)?;
            let mut body = std::mem::take(&mut self.out.body);
            ops.append(&mut body.ops);
            let after = Arithmetic { linker: &mut *self, to: &mut ops }.counted(counter)?;
            let name = column.to_owned();
            let kind = VariableKind::Scratch;
            let column = self.intern_variable(Variable { kind, name, scalar: Scalar::U32, len: 1 });
            self.out.outputs.push(Output { variable: column, component: 0 });
            body.yields.push(after);
            self.out.body = Region { ops, ..body };
        }
        Ok(())
    }

    /// Returns the local with the count of a path that passes from stage to stage in a scratch array.
    fn counter(&mut self, column: &'static str) -> VariableId {
        if let Some(counter) = self.counters.get(column) {
            return *counter;
        }
        let counter = self.new_local(column.to_owned());
        self.counters.insert(column, counter);
        counter
    }

    fn new_local(&mut self, name: String) -> VariableId {
        let kind = VariableKind::Local;
        self.intern_variable(Variable { kind, name, scalar: Scalar::U32, len: 1 })
    }
}

impl Arithmetic<'_> {
    /// Returns the count of sequences that a path begins with after so many searches.
    pub fn count_after(&mut self, searches: Value) -> Linking<Value> {
        let sequences = self.word(SEQUENCES_OF_SEARCH)?;
        self.multiply(searches, sequences)
    }

    /// Begins a path's sequence of numbers, and returns its key.
    pub fn begin_sequence(&mut self, purpose: Purpose) -> Linking<Value> {
        let counter = self.linker.counter(purpose.column());
        let count = self.counted(counter)?;
        let one = self.word(1)?;
        let count = self.add(count, one)?;
        self.count_to(counter, count)?;
        let [of_path, of_call] = purpose.selectors();
        let key = self.column(KEY_COLUMN, Scalar::U32)?;
        let key = self.hash_with(key, of_path)?;
        let key = self.hash(key, count)?;
        self.hash_with(key, of_call)
    }

    /// Returns the next number of `rand()`.
    pub fn drawn_number(&mut self, sampler: &Sampler) -> Linking<Value> {
        let counter = self.linker.counter(DRAWN_COLUMN);
        let dimension = self.counted(counter)?;
        let one = self.word(1)?;
        let next = self.add(dimension, one)?;
        self.count_to(counter, next)?;
        let key = self.column(KEY_COLUMN, Scalar::U32)?;
        let key = self.hash_with(key, NUMBERS_OF_RAND)?;
        let sample = self.column(SAMPLE_COLUMN, Scalar::U32)?;
        self.number_of_stream(sampler, key, dimension, sample)
    }

    /// Loads a count from its local.
    fn counted(&mut self, local: VariableId) -> Linking<Value> {
        let kind = OpKind::Load(local, Index::Constant(0));
        Ok(self.linker.emit(self.to, kind, &[Scalar::U32], false)?.get(0))
    }

    /// Stores a count to its local.
    fn count_to(&mut self, local: VariableId, value: Value) -> Linking<()> {
        let kind = OpKind::Store(local, Index::Constant(0), value);
        self.linker.emit(self.to, kind, &[], false).map(drop)
    }
}
