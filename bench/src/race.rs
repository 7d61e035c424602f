//! Definition of races.

use rtsl::{CallMode, Method, Numbers, Outputs, Scalar, Value, lookup_state};

use crate::kernels::Kernel;
use crate::packet::RAYS;
use crate::random::Random;
use crate::scalar;
use crate::written::Written;

pub use crate::races::races;

/// One kernel, in RTSL and by hand.
pub struct Race {
    /// The name in tables.
    pub name: &'static str,
    /// The RTSL method.
    pub shader: Shader,
    /// The state variables whose arrays hand-written code shares with RTSL's, in the order in which
    /// they lie in memory.
    pub state: &'static [&'static str],
    /// State variables that only the RTSL kernel uses, and their values.
    pub others: &'static [(&'static str, f32)],
    /// The number of input arrays, which come first.
    pub inputs: usize,
    /// True if the last of the inputs is changed in place; it is restored before every call.
    pub in_place: bool,
    /// The inputs of a packet, ray by ray.
    pub rays: fn(&mut Random) -> Vec<Vec<f32>>,
    /// The parameters, which are the same for all rays.
    pub parameters: Vec<Parameter>,
    /// The hand-written code.
    pub written: WrittenForms,
}

/// The location of a race's RTSL method.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// The file in `shaders/`.
    pub file: &'static str,
    /// The class in that file.
    pub class: &'static str,
    /// The method of that class.
    pub method: Method,
    /// The call mode.
    pub mode: CallMode,
}

/// The hand-written forms of a kernel.
pub struct WrittenForms {
    /// Double precision, one ray at a time.
    pub reference: Written,
    /// Single precision, one ray at a time.
    pub scalar: Written,
    /// With SIMD: the forms that this processor supports, by name.
    pub rivals: Vec<(&'static str, Written)>,
}

/// Numbers that all rays share.
pub struct Parameter {
    /// The member of the RTSL class; `None` if only hand-written code takes it.
    pub name: Option<&'static str>,
    /// Its numbers; those of all parameters follow one another in memory.
    pub numbers: Vec<f32>,
    /// The type of the numbers' bits.
    pub scalar: Scalar,
}

impl Parameter {
    /// Creates a member of the RTSL class.
    pub fn new(name: &'static str, numbers: &[f32]) -> Parameter {
        Parameter { name: Some(name), numbers: numbers.to_vec(), scalar: Scalar::F32 }
    }

    /// Creates a parameter that only hand-written code takes.
    pub fn hidden(numbers: &[f32]) -> Parameter {
        Parameter { name: None, numbers: numbers.to_vec(), scalar: Scalar::F32 }
    }

    /// Creates a table of unsigned integers.
    pub fn table(name: &'static str, numbers: impl IntoIterator<Item = u32>) -> Parameter {
        let numbers = numbers.into_iter().map(f32::from_bits).collect();
        Parameter { name: Some(name), numbers, scalar: Scalar::U32 }
    }

    /// Returns the value for the RTSL class.
    pub fn value(&self) -> Value {
        let words: Vec<u32> = self.numbers.iter().map(|number| number.to_bits()).collect();
        match (words.as_slice(), self.scalar) {
            ([word], Scalar::F32) => Value::Float(f32::from_bits(*word)),
            _ => Value::Numbers(Numbers::from_words(self.scalar, words)),
        }
    }
}

impl WrittenForms {
    /// Returns the forms of a kernel.
    #[cfg(target_arch = "x86_64")]
    pub(crate) fn of<K: Kernel + scalar::Scalar + crate::rivals::Rival>() -> WrittenForms {
        WrittenForms {
            reference: scalar::double::<K>(),
            scalar: scalar::single::<K>(),
            rivals: crate::rivals::available::<K>(),
        }
    }

    /// Returns the forms of a kernel.
    #[cfg(not(target_arch = "x86_64"))]
    pub(crate) fn of<K: Kernel + scalar::Scalar>() -> WrittenForms {
        let rivals = Vec::new();
        WrittenForms { reference: scalar::double::<K>(), scalar: scalar::single::<K>(), rivals }
    }
}

impl Race {
    /// Returns the state variables that hosts of the race read: those after the inputs, and one that is changed in
    /// place.
    pub fn outputs(&self) -> Outputs {
        let mut arrays = 0;
        let variables = self.state.iter().filter_map(|name| lookup_state(name));
        Outputs::state(variables.filter(|variable| {
            arrays += variable.ty.components() as usize;
            arrays > self.inputs || (self.in_place && arrays == self.inputs)
        }))
    }

    /// Returns the numbers of all parameters.
    pub fn numbers(&self) -> Vec<f32> {
        self.parameters.iter().flat_map(|parameter| &parameter.numbers).copied().collect()
    }
}

/// Generates the inputs of a packet of independent rays.
pub(crate) fn independent(
    random: &mut Random,
    mut ray: impl FnMut(&mut Random) -> Vec<f32>,
) -> Vec<Vec<f32>> {
    (0..RAYS).map(|_| ray(random)).collect()
}
