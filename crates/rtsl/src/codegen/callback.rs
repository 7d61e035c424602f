//! Functions for a host's own packets of rays.

use rtsl_abi::RayRecord;
use rtsl_link::Outputs;

/// A function that tests a packet of a host's own rays with an object, for the callbacks of acceleration structures.
/// One call runs `intersect` and, for rays with a hit, the parts of `computeNormal`, `computeTextureCoordinates` and
/// `computeDerivatives` that the [`outputs`](Callback::outputs) need. It reads and writes the rays in place.
///
/// Rays with a hit get the outputs and the [marks](RayRecord::marks); nothing else is written. State that the record
/// has no rows for has its default, except `rt_InverseRayDirection`, which is computed. `rt_HitPoint` is origin +
/// distance * direction, each operation rounded, until `computeNormal` sets it.
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// # let (engine, _) = rtsl::Engine::new(rtsl::EngineOptions::default())?;
/// # let ball = rtsl::Instance::new(class, [("radius", 2.0.into())])?;
/// use rtsl::{Callback, Mark, MarkWord, Outputs, RayRecord, lookup_state};
///
/// /// The argument of the host's callbacks.
/// #[repr(C)]
/// struct Question {
///     rays: *mut [[f32; 4]; 8],
///     ball: *const u32,
///     object: u32,
/// }
///
/// let state = |name| lookup_state(name).expect("the table has it");
/// let first = |name| state(name).first_component;
/// let rows = (0..3).flat_map(|axis| {
///     [(first("rt_RayOrigin") + axis, axis), (first("rt_RayDirection") + axis, 3 + axis)]
/// });
/// let callback = Callback {
///     width: 4,
///     outputs: Outputs::state([state("rt_HitDistance")]),
///     record: RayRecord {
///         rays: std::mem::offset_of!(Question, rays) as u32,
///         mask: None,
///         instances: std::mem::offset_of!(Question, ball) as u32,
///         number: None,
///         rows: rows.chain([(first("rt_HitDistance"), 6)]).collect(),
///         marks: vec![Mark { row: 7, word: MarkWord::Argument(std::mem::offset_of!(Question, object) as u32) }],
///     },
/// };
/// let program = engine.program(&ball);
/// # if engine.llvm().is_none() { return Ok(()); }
/// let compiled = program.callback(&callback)?;
///
/// // Four rays from z = -5; the third one ends before the ball.
/// let mut rays = [[0.0; 4]; 8];
/// (rays[2], rays[6]) = ([-5.0; 4], [9.0, 9.0, 2.0, 9.0]);
/// let block = program.block(&ball);
/// let question = Question { rays: &mut rays, ball: block.words().as_ptr(), object: 7.0_f32.to_bits() };
/// // Safety: the record describes the question, and the code is kept.
/// unsafe {
///     let function: unsafe extern "C" fn(&Question) = std::mem::transmute(compiled.address());
///     function(&question);
/// }
/// assert_eq!((rays[6], rays[7]), ([3.0, 3.0, 2.0, 3.0], [7.0, 7.0, 0.0, 7.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Callback {
    /// Rays in a packet, one of [`Engine::WIDTHS`](crate::Engine::WIDTHS).
    pub width: u32,
    /// The state that is written for rays with a hit; scratch is discarded. [`Outputs::ALL`] is all state that methods
    /// set and the record has rows for.
    pub outputs: Outputs,
    /// The locations of rays and instances.
    pub record: RayRecord,
}
