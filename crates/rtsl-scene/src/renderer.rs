//! The renderers that a scene can select.

/// The renderers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renderer {
    /// Traces packets of rays tile by tile and runs `shade` of materials.
    Interactive,
    /// Traces paths and runs the sampling and evaluation methods of materials.
    Batch,
}

impl Renderer {
    /// Returns the name of the renderer.
    pub fn name(self) -> &'static str {
        match self {
            Renderer::Interactive => "interactive",
            Renderer::Batch => "batch",
        }
    }
}
