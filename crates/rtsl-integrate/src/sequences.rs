//! The random sequences of a path's calls: of light samples, and of methods of materials that draw numbers; and the
//! numbers that the method that was split draws itself.
//!
//! A path begins a sequence for each such call. It counts them, for each purpose, from a multiple for each search on;
//! the counts pass from stage to stage in scratch arrays. So does the count of the method's own numbers, which searches
//! do not change.

use rtsl_ir::{Op, Scalar, Value, VariableId};
use rtsl_link::Linking;
use rtsl_math::sampling::{
    NUMBERS_OF_LIGHT_SAMPLES, NUMBERS_OF_LIGHTS, NUMBERS_OF_MATERIAL_CALLS, NUMBERS_OF_RAND,
    NUMBERS_OF_SHAPES, Sampler,
};

use crate::arithmetic::Arithmetic;
use crate::sampler::{KEY_COLUMN, SAMPLE_COLUMN};
use crate::search::SEARCHES_COLUMN;
use crate::stage_linker::StageLinker;

/// The number of sequences of a purpose among which those of a search count.
pub const SEQUENCES_OF_SEARCH: u32 = 1 << 10;

/// The purpose of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Purpose {
    /// A sample of a light.
    LightSample,
    /// A call of a method of a material.
    MaterialCall,
}

/// The scratch array that counts the numbers of `rand()` in the method that was split.
pub const DRAWN_COLUMN: &str = "path.drawn";

impl Purpose {
    /// All purposes.
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

impl StageLinker {
    /// Begins the random numbers of a method that is copied next.
    pub(crate) fn begin_numbers(
        &mut self,
        key: Value,
        sampler: Sampler,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let count = self.new_local(format!("numbers.{}", self.out.variables.len()), Scalar::U32);
        let code = &mut Arithmetic { linker: self, to };
        let zero = code.word(0)?;
        code.store_local(count, zero)?;
        self.copied_numbers = Some(CopiedNumbers { key, sampler, count });
        Ok(())
    }

    /// Returns the next random number of a method that is being copied.
    pub(crate) fn next_number(
        &mut self,
        numbers: CopiedNumbers,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let CopiedNumbers { key, sampler, count } = numbers;
        let code = &mut Arithmetic { linker: self, to };
        let dimension = code.load_local(count)?;
        let one = code.word(1)?;
        let next = code.add(dimension, one)?;
        code.store_local(count, next)?;
        let sample = code.column(SAMPLE_COLUMN, Scalar::U32)?;
        code.number_of_stream(&sampler, key, dimension, sample)
    }

    /// Returns a count of sequences as of the begin of a stage that follows a search: the number of searches tells it.
    /// `None` for other values, and for stages that begin with the count of the stage before.
    pub(crate) fn count_at_start(
        &mut self,
        column: &str,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Value>> {
        let follows_search = self.surface.as_ref().is_some_and(|links| links.follows_search);
        if !follows_search || !Purpose::ALL.iter().any(|purpose| purpose.column() == column) {
            return Ok(None);
        }
        let code = &mut Arithmetic { linker: self, to };
        let searches = code.column(SEARCHES_COLUMN, Scalar::U32)?;
        code.count_after(searches).map(Some)
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
        let counter = self.linker.passed_value(purpose.column(), Scalar::U32);
        let key = self.column(KEY_COLUMN, Scalar::U32)?;
        self.begin_counted_sequence(purpose, key, counter)
    }

    /// Begins a sequence of numbers among those with a key, which a local counts, and returns its key.
    pub fn begin_counted_sequence(
        &mut self,
        purpose: Purpose,
        key: Value,
        counter: VariableId,
    ) -> Linking<Value> {
        let count = self.next_count(counter)?;
        let [of_path, of_call] = purpose.selectors();
        let (of_path, of_call) = (self.word(of_path)?, self.word(of_call)?);
        Ok(self.call("rt_streamKey", &[key, of_path, count, of_call])?[0])
    }

    /// Adds 1 to a local that counts, and returns the sum.
    pub fn next_count(&mut self, counter: VariableId) -> Linking<Value> {
        let (count, one) = (self.load_local(counter)?, self.word(1)?);
        let count = self.add(count, one)?;
        self.store_local(counter, count)?;
        Ok(count)
    }

    /// Returns the next number of `rand()`.
    pub fn drawn_number(&mut self, sampler: &Sampler) -> Linking<Value> {
        let counter = self.linker.passed_value(DRAWN_COLUMN, Scalar::U32);
        let dimension = self.load_local(counter)?;
        let one = self.word(1)?;
        let next = self.add(dimension, one)?;
        self.store_local(counter, next)?;
        let key = self.column(KEY_COLUMN, Scalar::U32)?;
        let key = self.hash_with(key, NUMBERS_OF_RAND)?;
        let sample = self.column(SAMPLE_COLUMN, Scalar::U32)?;
        self.number_of_stream(sampler, key, dimension, sample)
    }
}
