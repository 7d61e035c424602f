//! The methods of a material that a path tracer calls.

use rtsl::Method;

use crate::subject::Subject;

/// The reason why contracts of scattering do not apply to a class that has only `shade`.
pub const ONLY_SHADES: &str = "the class has neither BSDF nor sampleBSDF";

/// True if the class has the methods that a path tracer calls.
pub fn scatters(subject: &Subject<'_>) -> bool {
    subject.has(Method::SampleBsdf) && subject.has(Method::Bsdf)
}
