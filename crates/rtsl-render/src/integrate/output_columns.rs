//! The outputs of an integrator in its scratch.

use rtsl::{LaneBlock, ParameterType, Program, Scalar};

use super::staged::StagedMethod;
use crate::film::features::Features;

/// The scratch array of a component of an output.
#[derive(Clone, Copy, Debug)]
pub struct OutputColumn {
    /// The index of the array.
    array: usize,
    /// The type of its words.
    scalar: Scalar,
}

/// Returns the columns of the components of kept outputs, in their order, for the interpreter.
pub fn output_columns(program: &Program, features: &Features) -> Vec<OutputColumn> {
    let columns = features.outputs().iter().flat_map(|output| {
        let declared = program.class().outputs.iter().find(|(name, _)| **name == *output.name);
        let scalar = match declared {
            Some((_, ParameterType::Scalar(scalar) | ParameterType::Vector(scalar, _))) => *scalar,
            _ => Scalar::F32,
        };
        let first = program.layout().scratch.get(&*output.name).copied().unwrap_or_default();
        let arrays = (first as usize..).take(output.ty.channels());
        arrays.map(move |array| OutputColumn { array, scalar })
    });
    columns.collect()
}

impl OutputColumn {
    /// Returns the column in the scratch of stages.
    pub fn in_stages(self, staged: &StagedMethod) -> OutputColumn {
        OutputColumn { array: staged.program.class_array(self.array), ..self }
    }

    /// Returns the value of a word.
    fn value(self, word: u32) -> f32 {
        match self.scalar {
            Scalar::F32 => f32::from_bits(word),
            Scalar::I32 => word.cast_signed() as f32,
            Scalar::U32 => word as f32,
            Scalar::Bool => f32::from(u8::from(word != 0)),
        }
    }
}

/// Copies the outputs of lanes to those of samples. `lanes` are pairs of a lane and the index of its sample, of which
/// `outputs` has all components one after the other.
pub fn copy_outputs(
    columns: impl ExactSizeIterator<Item = OutputColumn>,
    scratch: &LaneBlock,
    lanes: impl Iterator<Item = (usize, usize)> + Clone,
    outputs: &mut [f32],
) {
    let count = columns.len();
    for (component, column) in columns.enumerate() {
        let words = scratch.words(column.array);
        for (lane, sample) in lanes.clone() {
            outputs[sample * count + component] = column.value(words[lane]);
        }
    }
}
