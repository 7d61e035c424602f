//! A linked and optimised method.

use std::borrow::Cow;
use std::sync::Arc;

use rtsl_abi::CallMode;
use rtsl_ir::{Function, OpKind, Output, Query, Region, Source, Value, VariableId, VariableKind};
use rtsl_opt::unchanged::{self, VariableScalar};
use rtsl_source::Diagnostic;
use rtsl_spec::{StateVariable, lookup_state};

use crate::linker::Linked;

/// An optimised method without references.
#[derive(Clone, Debug)]
pub struct LinkedMethod {
    /// The code.
    pub function: Arc<Function>,
    /// The warnings of linking.
    pub warnings: Vec<Diagnostic>,
    /// The state variables that the method reads.
    pub reads: Vec<&'static StateVariable>,
    /// The state variables that the method sets.
    pub writes: Vec<&'static StateVariable>,
    /// True if the method reads scratch.
    pub reads_scratch: bool,
    /// True if the method sets scratch.
    pub sets_scratch: bool,
    /// Scalars that the method sets to the values that they had.
    unchanged: Vec<VariableScalar>,
    /// The parts of hits that the method sets, if it is `computeNormal`: the same however it is compiled and whatever is
    /// known of members, since hosts compute the offsets of rays by it.
    pub hit_placement: HitPlacement,
    /// The nesting of the regions.
    pub nesting: usize,
}

/// The parts of hits besides normals that `computeNormal` of a class sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HitPlacement {
    /// True if it sets `rt_HitPoint`: it puts hits back on the surface.
    pub moves: bool,
    /// True if it sets `rt_SurfaceOffset`, too: this bounds the errors of hits in the space of the shape, of which
    /// hosts otherwise know no more than the shape's extents.
    pub is_bounded: bool,
}

impl LinkedMethod {
    /// Returns the texts in which operations have places, of traced classes.
    pub fn sources(&self) -> &[Arc<Source>] {
        self.function.names.sources()
    }

    /// True if constants show that every call leaves a state variable zero.
    pub fn leaves_zero(&self, variable: &StateVariable) -> bool {
        let Function { variables, body, outputs, .. } = &*self.function;
        let is_zero = |value: Value| {
            body.ops.iter().any(|op| match op.kind {
                OpKind::Constant(constant) => {
                    constant.bits() == 0 && op.results.iter().any(|result| result == value)
                }
                _ => false,
            })
        };
        let is_of = |place: VariableId| {
            let place = &variables[place.0 as usize];
            place.kind == VariableKind::State && place.name == variable.name
        };
        let left = outputs.iter().zip(&body.yields).filter(|(output, _)| is_of(output.variable));
        left.map(|(_, value)| *value).all(is_zero)
    }

    /// True if the method asks this of the scene.
    pub fn asks(&self, wanted: Query) -> bool {
        self.function.body.asks(|query| query == wanted)
    }

    /// True if the method takes random numbers.
    pub fn draws_numbers(&self) -> bool {
        let mut draws = false;
        self.function.body.for_each_op(&mut |op| draws |= op.kind == OpKind::Rand);
        draws
    }

    /// True if the method has a loop.
    pub fn has_loops(&self) -> bool {
        let mut has_loops = false;
        let is_loop = |op: &rtsl_ir::Op| matches!(op.kind, OpKind::Loop { .. });
        self.function.body.for_each_op(&mut |op| has_loops |= is_loop(op));
        has_loops
    }

    /// True if the method asks anything of the scene, as those of integrators do.
    pub fn asks_scene(&self) -> bool {
        self.function.body.asks(|_| true)
    }

    /// Returns the method for kernels of a call mode. If lanes store elsewhere than they read, kernels also store the
    /// values that the method leaves as they were.
    pub fn in_mode(&self, mode: CallMode) -> Cow<'_, LinkedMethod> {
        let kind = |output: &Output| self.function.variable(output.variable).kind;
        let accepts = self.function.outputs.iter().any(|it| kind(it) == VariableKind::Accepted);
        let moves = |(place, _): &&VariableScalar| !mode.stores_where_it_reads(place, accepts);
        let mut moved = self.unchanged.iter().filter(moves).peekable();
        if moved.peek().is_none() {
            return Cow::Borrowed(self);
        }
        let mut function = Function::clone(&self.function);
        unchanged::restore(&mut function, moved);
        let (warnings, unchanged) = (self.warnings.clone(), Vec::new());
        let mut linked = LinkedMethod::new(Linked { function, unchanged, warnings });
        linked.hit_placement = self.hit_placement;
        Cow::Owned(linked)
    }

    /// Returns a linked function, once it is optimised, as a method.
    pub fn new(Linked { function, unchanged, warnings }: Linked) -> LinkedMethod {
        let reads = state_places(&function, |function, place| is_loaded(&function.body, place));
        let writes = state_places(&function, |function, place| {
            function.outputs.iter().any(|output| output.variable == place)
        });
        let is_scratch = |place: VariableId| function.variable(place).kind == VariableKind::Scratch;
        let sets_scratch = function.outputs.iter().any(|output| is_scratch(output.variable));
        let places = (0..function.variables.len() as u32).map(VariableId);
        let reads_scratch =
            places.filter(|it| is_scratch(*it)).any(|it| is_loaded(&function.body, it));
        let sets = |name: &str| {
            writes.iter().any(|variable: &&StateVariable| variable.name == name)
                || unchanged.iter().any(|(variable, _)| variable.name == name)
        };
        let moves = sets("rt_HitPoint");
        let hit_placement = HitPlacement { moves, is_bounded: moves && sets("rt_SurfaceOffset") };
        let (nesting, function) = (function.nesting(), Arc::new(function));
        LinkedMethod {
            hit_placement,
            function,
            warnings,
            reads,
            writes,
            reads_scratch,
            sets_scratch,
            unchanged,
            nesting,
        }
    }
}

/// Returns the state variables for which `wanted` holds, in the order of the table of state variables.
fn state_places(
    function: &Function,
    wanted: impl Fn(&Function, VariableId) -> bool,
) -> Vec<&'static StateVariable> {
    let places = (0..).map(VariableId).zip(&function.variables);
    let states =
        places.filter(|(id, place)| place.kind == VariableKind::State && wanted(function, *id));
    let mut variables: Vec<_> = states.filter_map(|(_, place)| lookup_state(&place.name)).collect();
    variables.sort_by_key(|variable| variable.index);
    variables
}

fn is_loaded(region: &Region, place: VariableId) -> bool {
    region.ops.iter().any(|op| match &op.kind {
        OpKind::Load(loaded, _) => *loaded == place,
        kind => kind.regions().any(|region| is_loaded(region, place)),
    })
}
