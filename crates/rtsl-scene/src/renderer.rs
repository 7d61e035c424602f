//! The renderers that a scene can ask for.

/// The renderers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renderer {
    /// Packets of rays from tiles; runs `shade` of materials.
    Interactive,
    /// Paths; runs the methods of materials that sample and weigh.
    Batch,
}

impl Renderer {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Renderer::Interactive => "interactive",
            Renderer::Batch => "batch",
        }
    }
}
