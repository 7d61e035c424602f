//! The selection of lights, called by hosts.

use rtsl_abi::LaneBlock;
use rtsl_integrate::light_selection::{LightSelection, PROBABILITY, SELECT};
use rtsl_source::Diagnostic;

use super::engine::Engine;
use super::renderer_function::RendererFunction;

/// A [selection](LightSelection) of lights as kernels for many points, of the text that is a part of stages, too: the
/// bits are the same.
#[derive(Debug)]
pub struct LightSelector {
    select: RendererFunction,
    probability: RendererFunction,
}

impl Engine {
    /// Makes the kernels of a selection that has lights.
    ///
    /// # Errors
    /// If code generation fails.
    pub fn light_selector(&self, selection: &LightSelection) -> Result<LightSelector, Diagnostic> {
        let (form, tables) = (selection.form(), selection.tables());
        Ok(LightSelector {
            select: self.renderer_function_with(SELECT, &form, &tables)?,
            // It has no need of the lights at infinity.
            probability: self.renderer_function_with(
                PROBABILITY,
                &form,
                &tables[..tables.len() - 1],
            )?,
        })
    }
}

impl LightSelector {
    /// The number of arrays that calls have.
    pub const ARRAYS: usize = 6;

    /// Selects a light for each of so many points. The first three arrays are those of the points, the next is that of
    /// random numbers in [0,1); then come the index of the light and the probability of its selection, which is
    /// positive.
    pub fn select(&self, arrays: &mut LaneBlock, count: usize) {
        self.select.call(arrays, count, None);
    }

    /// Computes the probabilities with which lights are selected for so many points. The first array is that of the
    /// [ways](LightSelection::way) to the lights, the next three are those of the points; then come the probabilities.
    pub fn probabilities(&self, arrays: &mut LaneBlock, count: usize) {
        self.probability.call(arrays, count, None);
    }
}
