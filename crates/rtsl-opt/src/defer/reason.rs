//! Reasons for which operations stay as they are.

use rtsl_ir::{Place, Value};

/// A request of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// A traced ray.
    Trace,
    /// A surface whose `shade` an integrator calls.
    Shade,
    /// A sample of a light.
    Light,
}

/// A request that keeps its answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// The request.
    pub request: Request,
    /// The reason.
    pub reason: Reason,
    /// The place of the request in the source, if it is known.
    pub place: Option<Place>,
    /// The place of the reason, if it is known.
    pub cause: Option<Place>,
}

/// A reason for which a request keeps its answer. Of a ray it is about the radiance that comes back, of a light about
/// the sums of its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// It decides what the method does.
    Compared,
    /// It is multiplied by itself, or by what another request answers.
    Multiplied,
    /// Something is divided by it.
    Divisor,
    /// It is the argument of an operation that is no sum and no product.
    Argument,
    /// Another request depends on it.
    Asked,
    /// It is stored where an index selects it.
    Stored,
    /// One of its components reaches another one of the colour.
    Mixed,
    /// An output that is not the colour depends on it.
    OtherOutput,
    /// A loop does more than to add to it.
    Repeated,
    /// A factor is not known where the request is made.
    UnknownFactor,
    /// A factor is an answer that is deferred.
    DeferredFactor,
    /// It passes through too many operations.
    TooLong,
    /// The light's sample is used outside the body that is executed for it.
    SampleUsed,
    /// The body of the loop over lights asks for something else: it traces rays or draws random numbers.
    BodyAsks,
    /// The body sets a variable that is no sum of light.
    BodySets,
}

impl Reason {
    /// Returns the rest of a sentence that begins with what the request asks for.
    pub const fn text(self) -> &'static str {
        match self {
            Reason::Compared => "its light decides what the method does",
            Reason::Multiplied => {
                "its light is multiplied by itself or by light of another request"
            }
            Reason::Divisor => "something is divided by its light",
            Reason::Argument => "its light passes through a function that is no sum and no product",
            Reason::Asked => "another request depends on its light",
            Reason::Stored => "its light is stored in an array by a computed index",
            Reason::Mixed => "one component of its light reaches another component of the color",
            Reason::OtherOutput => "an output that is not `rt_SampleColor` depends on its light",
            Reason::Repeated => "a loop does more with its light than to add it to a sum",
            Reason::UnknownFactor => "a factor of its light is not known when it is asked for",
            Reason::DeferredFactor => "a factor of its light depends on light that is added later",
            Reason::TooLong => "its light passes through too many operations",
            Reason::SampleUsed => "the sample is used outside the body of `illuminance`",
            Reason::BodyAsks => {
                "the body of `illuminance` traces rays, draws random numbers or calls other objects"
            }
            Reason::BodySets => "the body of `illuminance` sets a variable that is no sum of light",
        }
    }
}

/// The reason against deferring a request, and a value of the operation that is the reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub reason: Reason,
    pub at: Option<Value>,
}

impl Refusal {
    pub fn of(reason: Reason, at: Option<Value>) -> Refusal {
        Refusal { reason, at }
    }
}
