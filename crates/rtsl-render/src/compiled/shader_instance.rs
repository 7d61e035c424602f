//! Instances of classes with their kernels.

use std::sync::{Arc, OnceLock};

use rtsl::{InstanceBlock, Kernel, Method, SpecialisedKernel};

/// An instance prepared for the kernels of its shader.
pub struct ShaderInstance {
    /// The index of its shader.
    pub shader: usize,
    /// Its members.
    pub block: Arc<InstanceBlock>,
    /// The kernels specialised for its values.
    pub specialised: Specialised,
}

/// The specialised kernels of one instance, once they are requested.
#[derive(Default)]
pub struct Specialised(pub(super) OnceLock<Vec<(Method, SpecialisedKernel)>>);

impl Specialised {
    /// Returns the specialised kernel of a method if it was requested and is ready.
    pub fn kernel(&self, method: Method) -> Option<&Kernel> {
        let mut kernels = self.0.get()?.iter();
        kernels.find(|(other, _)| *other == method).map(|(_, kernel)| &**kernel.kernel())
    }
}
