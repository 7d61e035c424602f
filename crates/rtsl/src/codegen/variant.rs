//! Variants of kernels.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_abi::{CallMode, Layout, ObjectForm};
use rtsl_ir::{Function, Index, OpKind, VariableKind};
use rtsl_link::Outputs;
use rtsl_opt::placed::{PLACEMENT, PLACEMENT_SCALARS};
use rtsl_packet::kernel::HIT_DISTANCE;
use rtsl_spec::lookup_state;

/// One of the kernels of a method. The outputs that a caller reads are the same in all of them, to the bit unless
/// results may differ between machines anyway. The general kernel of a [`CallMode`] serves every caller; further
/// properties of the callers make it faster.
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// # let (engine, _) = rtsl::Engine::new(rtsl::EngineOptions::default())?;
/// # let ball = rtsl::Instance::new(class, [("radius", 2.0.into())])?;
/// # let program = engine.program(&ball);
/// use rtsl::{Method, Outputs, CallMode, Variant, lookup_state};
///
/// let normals = Outputs::state(lookup_state("rt_GeometricNormal"));
/// let fast = Variant::new(CallMode::Packet).reading(normals).knowing(program.known_members(&ball));
/// let kernel = program.kernel(Method::ComputeNormal, fast)?;
/// # let _ = kernel;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Variant {
    /// The call mode: the data that the rays of a call share.
    pub mode: CallMode,
    /// The outputs that the caller reads.
    pub outputs: Outputs,
    /// The known members of the instances of every call.
    pub known: KnownMembers,
    /// True if `rt_RayDirection` has unit length. Only [`Math::Fast`](crate::Math::Fast) makes use of it: otherwise
    /// results would depend on the variant.
    pub unit_directions: bool,
    /// The words that differ between the objects of a call. If `None`, kernels of the call modes `stream` and `leaf`
    /// take objects that share nothing, and those of the other modes take one instance.
    pub objects: Option<ObjectForm>,
    /// True if rays are in another space than the object, whose data has a [`Placement`](crate::Placement).
    pub placed: bool,
    /// Rays at a time, one of [`Engine::WIDTHS`](crate::Engine::WIDTHS); that of the engine if `None`. Kernels of the
    /// call mode `single` have 1.
    pub width: Option<u32>,
}

impl Variant {
    /// The general kernel.
    pub fn new(mode: CallMode) -> Variant {
        Variant {
            mode,
            outputs: Outputs::ALL,
            known: KnownMembers::default(),
            unit_directions: false,
            objects: None,
            placed: false,
            width: None,
        }
    }

    /// The variant for callers that read only these outputs.
    #[must_use]
    pub fn reading(self, outputs: Outputs) -> Variant {
        Variant { outputs, ..self }
    }

    /// The variant for instances with these members.
    #[must_use]
    pub fn knowing(self, known: KnownMembers) -> Variant {
        Variant { known, ..self }
    }

    /// The variant for rays whose directions have unit length.
    #[must_use]
    pub fn with_unit_directions(self) -> Variant {
        Variant { unit_directions: true, ..self }
    }

    /// The variant for objects of this form, also in the call modes with one object, which is then one of
    /// [`Objects`](crate::Objects).
    #[must_use]
    pub fn of_objects(self, form: ObjectForm) -> Variant {
        Variant { objects: Some(form), ..self }
    }

    /// The variant for objects with a placement, such as those of
    /// [`Program::placed_objects`](crate::Program::placed_objects). The method reads the ray in the object's space, and
    /// its outputs are in that space; distances along the ray are the same in both spaces.
    #[must_use]
    pub fn placed(self) -> Variant {
        Variant { placed: true, ..self }
    }

    /// The variant for so many rays at a time, regardless of the engine's width.
    #[must_use]
    pub fn with_width(self, width: u32) -> Variant {
        Variant { width: Some(width), ..self }
    }

    /// Returns the rays at a time in an engine of this width.
    pub(crate) fn width_in(&self, engine: u32) -> u32 {
        self.mode.width(self.width.unwrap_or(engine))
    }

    /// Returns the layout of the data in calls of the kernel.
    pub(crate) fn layout(&self, layout: &Layout) -> Layout {
        let layout = if self.placed { placed_layout(layout) } else { layout.clone() };
        Layout { objects: self.objects.clone(), ..layout }
    }

    /// Returns the outputs that the kernel stores: those that the caller reads, and in the
    /// call mode `leaf` the distance, which decides whose outputs are kept.
    pub(crate) fn stored(&self) -> Outputs {
        let distance = lookup_state(HIT_DISTANCE).filter(|_| self.mode == CallMode::Leaf);
        let distance = Outputs::state(distance);
        self.outputs.union(distance)
    }
}

/// Adds the placement at the end of a layout.
pub(crate) fn placed_layout(layout: &Layout) -> Layout {
    let mut layout = layout.clone();
    layout.members.insert(PLACEMENT.to_owned(), layout.block_words);
    layout.block_words += PLACEMENT_SCALARS;
    layout
}

impl From<CallMode> for Variant {
    fn from(mode: CallMode) -> Variant {
        Variant::new(mode)
    }
}

/// Members with known values: scalars of an instance's block that code may treat as constants. Buffers remain data.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KnownMembers {
    /// Indices of words of the block and their values, sorted by index.
    words: Option<Arc<[(u32, u32)]>>,
}

impl KnownMembers {
    pub(crate) fn new(mut words: Vec<(u32, u32)>) -> KnownMembers {
        words.sort_unstable();
        KnownMembers { words: (!words.is_empty()).then(|| words.into()) }
    }

    /// True if no member is known.
    pub fn is_empty(&self) -> bool {
        self.words.is_none()
    }

    fn words(&self) -> &[(u32, u32)] {
        self.words.as_deref().unwrap_or_default()
    }

    /// Returns the bits of a word of the block, if known.
    pub(crate) fn get(&self, word: u32) -> Option<u32> {
        let words = self.words();
        let index = words.binary_search_by_key(&word, |(word, _)| *word).ok()?;
        Some(words[index].1)
    }

    /// Returns those that the function reads.
    pub(crate) fn of_function(&self, function: &Function, layout: &Layout) -> KnownMembers {
        if self.is_empty() {
            return KnownMembers::default();
        }
        let mut words = BTreeSet::new();
        function.body.for_each_op(&mut |op| {
            let OpKind::Load(place, index) = op.kind else { return };
            let place = function.variable(place);
            if place.kind != VariableKind::Member {
                return;
            }
            let first = layout.members[&place.name];
            match index {
                Index::Constant(index) => words.extend([first + index]),
                // Unrolling may make the index constant.
                Index::Dynamic(_) => words.extend(first..first + place.len),
            }
        });
        KnownMembers::new(
            self.words().iter().filter(|(word, _)| words.contains(word)).copied().collect(),
        )
    }
}
