//! What a race is.

use rtsl::{CallMode, Method, Numbers, Outputs, Scalar, Value, lookup_state};

use crate::kernels::Kernel;
use crate::packet::RAYS;
use crate::random::Random;
use crate::scalar;
use crate::written::Written;

pub use crate::races::races;

/// One kernel, in RTSL and by hand.
pub struct Race {
    /// What tables call it.
    pub name: &'static str,
    /// The RTSL method.
    pub shader: Shader,
    /// The state variables whose arrays hand-written code shares with RTSL's, in the order in which
    /// they lie in memory.
    pub state: &'static [&'static str],
    /// State variables that only the RTSL kernel touches, and what they hold.
    pub others: &'static [(&'static str, f32)],
    /// How many of the arrays are inputs: the first ones.
    pub inputs: usize,
    /// Whether the last of the inputs is changed in place; it is put back before every call.
    pub in_place: bool,
    /// The inputs of a packet, ray by ray.
    pub rays: fn(&mut Random) -> Vec<Vec<f32>>,
    /// What is the same for all rays.
    pub parameters: Vec<Parameter>,
    /// What hand-written code there is.
    pub written: WrittenForms,
}

/// Where a race's RTSL method is.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// In `shaders/`.
    pub file: &'static str,
    /// In that file.
    pub class: &'static str,
    /// Of that class.
    pub method: Method,
    /// What its rays have in common.
    pub shape: CallMode,
}

/// The hand-written forms of a kernel.
pub struct WrittenForms {
    /// Double precision, one ray at a time.
    pub reference: Written,
    /// Single precision, one ray at a time.
    pub scalar: Written,
    /// With SIMD: those that this processor can run, by name.
    pub rivals: Vec<(&'static str, Written)>,
}

/// Numbers that all rays share.
pub struct Parameter {
    /// The member of the RTSL class; `None` if only hand-written code takes it.
    pub name: Option<&'static str>,
    /// Its numbers; those of all parameters follow one another in memory.
    pub numbers: Vec<f32>,
    /// What the bits of the numbers are.
    pub scalar: Scalar,
}

impl Parameter {
    /// A member of the RTSL class.
    pub fn new(name: &'static str, numbers: &[f32]) -> Parameter {
        Parameter { name: Some(name), numbers: numbers.to_vec(), scalar: Scalar::F32 }
    }

    /// What RTSL has from elsewhere.
    pub fn hidden(numbers: &[f32]) -> Parameter {
        Parameter { name: None, numbers: numbers.to_vec(), scalar: Scalar::F32 }
    }

    /// Unsigned integers.
    pub fn table(name: &'static str, numbers: impl IntoIterator<Item = u32>) -> Parameter {
        let numbers = numbers.into_iter().map(f32::from_bits).collect();
        Parameter { name: Some(name), numbers, scalar: Scalar::U32 }
    }

    /// For the RTSL class.
    pub fn value(&self) -> Value {
        let words: Vec<u32> = self.numbers.iter().map(|number| number.to_bits()).collect();
        match (words.as_slice(), self.scalar) {
            ([word], Scalar::F32) => Value::Float(f32::from_bits(*word)),
            _ => Value::Numbers(Numbers::from_words(self.scalar, words)),
        }
    }
}

impl WrittenForms {
    /// Those of a kernel.
    #[cfg(target_arch = "x86_64")]
    pub(crate) fn of<K: Kernel + scalar::Scalar + crate::rivals::Rival>() -> WrittenForms {
        WrittenForms {
            reference: scalar::double::<K>(),
            scalar: scalar::single::<K>(),
            rivals: crate::rivals::available::<K>(),
        }
    }

    /// Those of a kernel.
    #[cfg(not(target_arch = "x86_64"))]
    pub(crate) fn of<K: Kernel + scalar::Scalar>() -> WrittenForms {
        let rivals = Vec::new();
        WrittenForms { reference: scalar::double::<K>(), scalar: scalar::single::<K>(), rivals }
    }
}

impl Race {
    /// The state variables that hosts of the race read: those past the inputs, and one that is
    /// changed in place.
    pub fn outputs(&self) -> Outputs {
        let mut arrays = 0;
        let variables = self.state.iter().filter_map(|name| lookup_state(name));
        Outputs::state(variables.filter(|variable| {
            arrays += variable.ty.components() as usize;
            arrays > self.inputs || (self.in_place && arrays == self.inputs)
        }))
    }

    /// The numbers of all parameters.
    pub fn numbers(&self) -> Vec<f32> {
        self.parameters.iter().flat_map(|parameter| &parameter.numbers).copied().collect()
    }
}

/// The inputs of a packet whose rays have nothing to do with one another.
pub(crate) fn independent(
    random: &mut Random,
    mut ray: impl FnMut(&mut Random) -> Vec<f32>,
) -> Vec<Vec<f32>> {
    (0..RAYS).map(|_| ray(random)).collect()
}
