//! Instances of classes with their kernels.

use std::sync::Arc;

use rtsl::InstanceBlock;

/// An instance prepared for the kernels of its shader.
pub struct ShaderInstance {
    /// The index of its shader.
    pub shader: usize,
    /// Its members.
    pub block: Arc<InstanceBlock>,
}
