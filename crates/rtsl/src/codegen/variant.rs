//! Which of a method's kernels a caller wants.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_abi::{CallMode, Layout, ObjectForm};
use rtsl_ir::{Function, Index, OpKind, VariableKind};
use rtsl_opt::placed::{PLACEMENT, PLACEMENT_SCALARS};
use rtsl_packet::kernel::HIT_DISTANCE;
use rtsl_spec::lookup_state;

use crate::link::outputs::Outputs;

/// One of the kernels of a method. What a caller reads of the results is the same in all of them, to
/// the bit unless results may differ between machines anyway. The plain one of a [`CallMode`] serves every caller; what else is said makes it faster.
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
    /// What the rays of a call have in common.
    pub mode: CallMode,
    /// What the caller reads.
    pub outputs: Outputs,
    /// What is known of the instances of every call.
    pub known: KnownMembers,
    /// `rt_RayDirection` has unit length. Of use with [`Math::Fast`](crate::Math::Fast) only:
    /// otherwise results would depend on who asks.
    pub unit_directions: bool,
    /// The words that differ between the objects of a call. If `None`, kernels of the call modes `stream` and `leaf`
    /// take objects that share nothing, and those of the other modes take one instance.
    pub objects: Option<ObjectForm>,
    /// The method meets rays of another space than its object's: the object's data has a
    /// [`Placement`](crate::Placement).
    pub placed: bool,
    /// Rays at a time, one of [`Engine::WIDTHS`](crate::Engine::WIDTHS); those of the engine where `None`. Kernels of the
    /// call mode `single` have 1.
    pub width: Option<u32>,
}

impl Variant {
    /// The kernel for every caller.
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

    /// The same for a caller that reads no more than this.
    #[must_use]
    pub fn reading(self, outputs: Outputs) -> Variant {
        Variant { outputs, ..self }
    }

    /// The same for instances with these members.
    #[must_use]
    pub fn knowing(self, known: KnownMembers) -> Variant {
        Variant { known, ..self }
    }

    /// The same for rays whose directions have unit length.
    #[must_use]
    pub fn with_unit_directions(self) -> Variant {
        Variant { unit_directions: true, ..self }
    }

    /// The same for objects of this form, also in the call modes with one object, which is then one of
    /// [`Objects`](crate::Objects).
    #[must_use]
    pub fn of_objects(self, form: ObjectForm) -> Variant {
        Variant { objects: Some(form), ..self }
    }

    /// The same for objects with a placement, made by
    /// [`Program::placed_objects`](crate::Program::placed_objects) and its like: what the method reads of
    /// the ray, it reads in the object's space. What it sets stays there; distances along the ray
    /// are the same in both.
    #[must_use]
    pub fn placed(self) -> Variant {
        Variant { placed: true, ..self }
    }

    /// The same for so many rays at a time, whatever the engine's width is.
    #[must_use]
    pub fn with_width(self, width: u32) -> Variant {
        Variant { width: Some(width), ..self }
    }

    /// Rays at a time in an engine of this width.
    pub(crate) fn width_in(&self, engine: u32) -> u32 {
        self.mode.width(self.width.unwrap_or(engine))
    }

    /// Where data lies in calls of the kernel.
    pub(crate) fn layout(&self, layout: &Layout) -> Layout {
        let layout = if self.placed { placed_layout(layout) } else { layout.clone() };
        Layout { objects: self.objects.clone(), ..layout }
    }

    /// What the kernel stores of what its method sets: what the caller reads, and in the
    /// call mode `leaf` the distance, which decides whose outputs are kept.
    pub(crate) fn stored(&self) -> Outputs {
        let distance = lookup_state(HIT_DISTANCE).filter(|_| self.mode == CallMode::Leaf);
        let distance = Outputs::state(distance);
        self.outputs.union(distance)
    }
}

/// The layout with the placement at its end.
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

/// Members of known value: scalars of an instance's block that code may take for constants.
/// Buffers stay data.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KnownMembers {
    /// Words of the block and what they hold, sorted by word.
    words: Option<Arc<[(u32, u32)]>>,
}

impl KnownMembers {
    pub(crate) fn new(mut words: Vec<(u32, u32)>) -> KnownMembers {
        words.sort_unstable();
        KnownMembers { words: (!words.is_empty()).then(|| words.into()) }
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.words.is_none()
    }

    fn words(&self) -> &[(u32, u32)] {
        self.words.as_deref().unwrap_or_default()
    }

    /// The bits of a word of the block.
    pub(crate) fn get(&self, word: u32) -> Option<u32> {
        let words = self.words();
        let index = words.binary_search_by_key(&word, |(word, _)| *word).ok()?;
        Some(words[index].1)
    }

    /// Of these the ones that the function reads.
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
                // Unrolling may make a constant of it.
                Index::Dynamic(_) => words.extend(first..first + place.len),
            }
        });
        KnownMembers::new(
            self.words().iter().filter(|(word, _)| words.contains(word)).copied().collect(),
        )
    }
}
