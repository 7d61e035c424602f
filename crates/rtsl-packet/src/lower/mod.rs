//! Lowers single-ray code to packet code.
//!
//! Operations are added to the prologue or to the open region of the body. A pure operation goes to the prologue if its
//! operands are there, whatever control flow enclosed it: it is total, so speculation is harmless. A loop, which might
//! not end, goes there only if every ray runs it.

mod acceptance;
mod control;
mod cost;
mod hoist;
mod host;
mod implied;
mod memory;
mod nan_bits;
mod nan_shadow;
mod sign_bit;

use std::collections::{BTreeMap, BTreeSet};

use rtsl_abi::{CallMode, DataLocation, Layout, ObjectForm};
use rtsl_ir::host::MAX_LANES;
use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Function, Index, IndexVec, Place, Places, Scalar, UnaryOp,
    Value, Values, VariableId, VariableKind,
};

use crate::kernel::{Kernel, KernelOutput, KernelVariable, Op, OpKind, Region, Type};
use crate::locals::{MAX_LOCAL_WORDS, local_words};
use crate::uniformity::Uniformity;
use crate::verify;
use crate::work::MAX_WORK;

/// The reason a function cannot be lowered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LowerError {
    /// The function has a reference that linking should have replaced.
    #[error("the reference `{0}` is not linked")]
    Unlinked(String),
    /// The function has a variable that the layout or the call lacks.
    #[error("a call has no storage for the {kind} `{name}`", kind = .0.name(), name = .1)]
    NoLocation(VariableKind, String),
    /// The function has an output to a variable that kernels do not store.
    #[error("kernels do not store the {kind} `{name}`", kind = .0.name(), name = .1)]
    NotAnOutput(VariableKind, String),
    /// The locals are too large.
    #[error("local arrays take {0} words for {MAX_LANES} rays, more than {MAX_LOCAL_WORDS}")]
    TooMuchMemory(u64),
    /// The function is too much work for a code generator.
    #[error("it has {0} operations, more than {MAX_WORK}")]
    TooMuchCode(u64),
    /// A width that is not a power of two up to [`MAX_LANES`].
    #[error("packets cannot have {0} rays")]
    Width(u32),
}

/// Lowers a linked function to packet code for calls of one call mode, `width` rays at a time (one if the mode is
/// single).
///
/// # Errors
/// See [`LowerError`].
pub fn lower(
    function: &Function,
    layout: &Layout,
    mode: CallMode,
    width: u32,
) -> Result<Kernel, LowerError> {
    lower_for(function, layout, mode, width, Calls::Large)
}

/// Like [`lower`], for calls of one packet, as with [records](rtsl_abi::RayRecord).
///
/// # Errors
/// See [`LowerError`].
pub fn lower_packet(
    function: &Function,
    layout: &Layout,
    width: u32,
) -> Result<Kernel, LowerError> {
    lower_for(function, layout, CallMode::Packet, width, Calls::OfOnePacket)
}

/// The expected size and coherence of calls.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Calls {
    /// Many chunks, or one with unknown coherence.
    Large,
    /// One packet, whose rays have hit the object's bounding box: their control flow is mostly the same.
    OfOnePacket,
}

fn lower_for(
    function: &Function,
    layout: &Layout,
    mode: CallMode,
    width: u32,
    calls: Calls,
) -> Result<Kernel, LowerError> {
    let (name, mode_name) = (function.name.as_str(), mode.name());
    let _span = tracing::debug_span!("packet", function = name, mode = mode_name, width).entered();
    if !width.is_power_of_two() || width as usize > MAX_LANES {
        return Err(LowerError::Width(width));
    }
    let width = mode.width(width);
    let form = layout.object_form(mode);
    let mut variables = locate_variables(function, layout, mode, form.as_ref())?;
    let uniformity = Uniformity::new(function, &variables);
    for (index, variable) in variables.iter_mut().enumerate() {
        variable.varies = uniformity.variable_varies(VariableId(index as u32));
    }
    let kernel = Kernel {
        name: function.name.clone(),
        mode,
        width,
        interleave: None,
        object_words: form.as_ref().map(|form| form.words().len() as u32),
        object_blocks: form.and_then(|form| form.few_blocks()),
        variables,
        values: Vec::new(),
        prologue: Region::default(),
        body: Region::default(),
        outputs: locate_outputs(function)?,
        places: Places::default(),
    };
    check_locals(&kernel)?;
    let mut lowering = Lowering::new(function, uniformity, kernel, calls);
    lowering.run()?;
    let mut kernel = lowering.kernel;
    acceptance::run(&mut kernel);
    implied::run(&mut kernel);
    let work = kernel.work();
    if work > MAX_WORK {
        return Err(LowerError::TooMuchCode(work));
    }
    debug_assert_eq!(verify(&kernel), Ok(()), "{kernel}");
    Ok(kernel)
}

fn locate_variables(
    function: &Function,
    layout: &Layout,
    mode: CallMode,
    form: Option<&ObjectForm>,
) -> Result<Vec<KernelVariable>, LowerError> {
    let locate = |variable: &rtsl_ir::Variable| {
        let name = variable.name.as_str();
        let (location, of_objects) = match variable.kind {
            VariableKind::State => {
                (rtsl_spec::lookup_state(name).map(|state| state.first_component), false)
            }
            VariableKind::Scratch => (layout.scratch.get(name).copied(), false),
            VariableKind::Member | VariableKind::Buffer => match layout.locate(variable, form) {
                Some(DataLocation::Instance(word)) => (Some(word), false),
                Some(DataLocation::Objects(word)) => (Some(word), true),
                None => (None, false),
            },
            VariableKind::Local | VariableKind::Accepted => (Some(0), false),
            VariableKind::Parameter => (None, false),
        };
        let location =
            location.ok_or_else(|| LowerError::NoLocation(variable.kind, name.into()))?;
        let varies = mode.varies(variable, of_objects);
        Ok(KernelVariable { variable: variable.clone(), varies, location, of_objects })
    };
    function.variables.iter().map(locate).collect()
}

fn locate_outputs(function: &Function) -> Result<Vec<KernelOutput>, LowerError> {
    let locate = |output: &rtsl_ir::Output| {
        let variable = function.variable(output.variable);
        match variable.kind {
            VariableKind::State | VariableKind::Scratch | VariableKind::Accepted => {
                Ok(KernelOutput { variable: output.variable, component: output.component })
            }
            VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Buffer
            | VariableKind::Local => {
                Err(LowerError::NotAnOutput(variable.kind, variable.name.clone()))
            }
        }
    };
    function.outputs.iter().map(locate).collect()
}

fn check_locals(kernel: &Kernel) -> Result<(), LowerError> {
    match local_words(kernel) {
        0..=MAX_LOCAL_WORDS => Ok(()),
        words => Err(LowerError::TooMuchMemory(words)),
    }
}

/// The state of the traversal of the function.
struct Lowering<'a> {
    function: &'a Function,
    calls: Calls,
    uniformity: Uniformity,
    /// The number of uses of each value of the function.
    uses: IndexVec<Value, u32>,
    /// Bitcasts that need not canonicalise NaNs.
    hidden_bitcasts: Vec<bool>,
    /// Conditions of the function that are rarely true.
    seldom: BTreeSet<Value>,
    /// The number of rarely taken sides around the open region: operations in them are not hoisted, even if they are
    /// uniform.
    rare_sides: u32,
    /// Lanes that are loaded from memory unchanged.
    loaded: BTreeSet<Value>,
    kernel: Kernel,
    /// The packet value of each value of the function lowered so far.
    values: IndexVec<Value, Option<Value>>,
    /// For each packet value, true if the prologue defines it.
    hoisted: IndexVec<Value, bool>,
    constants: BTreeMap<(Scalar, u32), Value>,
    /// The open region of the body.
    open: Vec<Op>,
    /// The mask of the open region.
    mask: Value,
    /// True if the open region's mask may be narrower than the chunk's.
    diverged: bool,
    /// The number of branches and loops around the open region.
    depth: u32,
    /// The place of the operation that is being lowered, or of one around it.
    place: Option<Place>,
}

impl<'a> Lowering<'a> {
    fn new(function: &'a Function, uniformity: Uniformity, kernel: Kernel, calls: Calls) -> Self {
        let mut uses = IndexVec::filled(function.values.len(), 0);
        function.body.for_each_use(&mut |value| uses[value] += 1);
        Lowering {
            function,
            calls,
            uniformity,
            uses,
            hidden_bitcasts: nan_bits::hidden_bitcasts(function),
            seldom: BTreeSet::new(),
            rare_sides: 0,
            loaded: BTreeSet::new(),
            kernel,
            values: IndexVec::filled(function.values.len(), None),
            hoisted: IndexVec::default(),
            constants: BTreeMap::new(),
            open: Vec::new(),
            mask: Value(0),
            diverged: false,
            depth: 0,
            place: None,
        }
    }

    fn run(&mut self) -> Result<(), LowerError> {
        self.mask = self.new_value(Type::MASK);
        let yields = self.lower_ops(&self.function.body)?;
        self.kernel.body =
            Region { params: vec![self.mask], ops: std::mem::take(&mut self.open), yields };
        Ok(())
    }

    /// Lowers the region's operations into the open region and returns its yields.
    fn lower_ops(&mut self, region: &rtsl_ir::Region) -> Result<Vec<Value>, LowerError> {
        region.ops.iter().try_for_each(|op| self.lower_op(op))?;
        Ok(region.yields.iter().map(|value| self.value(*value)).collect())
    }

    fn lower_op(&mut self, op: &rtsl_ir::Op) -> Result<(), LowerError> {
        let place = op.results.iter().find_map(|result| self.function.names.place(result));
        let outer = self.place.clone();
        self.place = place.or_else(|| outer.clone());
        let lowered = self.lower_op_there(op);
        self.place = outer;
        lowered
    }

    fn lower_op_there(&mut self, op: &rtsl_ir::Op) -> Result<(), LowerError> {
        use rtsl_ir::OpKind as Ray;
        let value = |operand: &Value| self.value(*operand);
        let kind = match &op.kind {
            Ray::Constant(constant) => {
                let value = self.constant(*constant);
                self.set_results(op, &[value]);
                return Ok(());
            }
            Ray::Unary(UnaryOp::Seldom, a) => {
                let condition = value(a);
                self.seldom.insert(op.results.get(0));
                self.set_results(op, &[condition]);
                return Ok(());
            }
            Ray::Unary(unary, a) => OpKind::Unary(*unary, value(a)),
            Ray::Binary(BinaryOp::Subtract, a, b) => self.difference(value(a), value(b)),
            Ray::Binary(binary, a, b) => OpKind::Binary(*binary, value(a), value(b)),
            Ray::Compare(compare, a, b) => OpKind::Compare(*compare, value(a), value(b)),
            Ray::Select(condition, a, b) => {
                let (condition, a, b) = (value(condition), value(a), value(b));
                let value = self.select(condition, a, b);
                self.set_results(op, &[value]);
                return Ok(());
            }
            Ray::Fma(a, b, c) => OpKind::Fma(value(a), value(b), value(c)),
            Ray::Convert(to, a) => OpKind::Convert(*to, value(a)),
            Ray::Bitcast(to, a) if self.hidden_bitcasts[op.results.first as usize] => {
                OpKind::Reinterpret(*to, value(a))
            }
            Ray::Bitcast(to, a) => OpKind::Bitcast(*to, value(a)),
            Ray::Length(variable) => OpKind::Length(*variable),
            Ray::LightCount => OpKind::LightCount,
            Ray::Load(variable, index) => {
                let value = self.lower_load(*variable, *index);
                if self.ty(value).lanes {
                    self.loaded.insert(value);
                }
                self.set_results(op, &[value]);
                return Ok(());
            }
            Ray::Store(variable, index, stored) => {
                self.lower_store(*variable, *index, *stored);
                return Ok(());
            }
            Ray::If { condition, then, otherwise } => {
                return self.lower_if(op, *condition, then, otherwise);
            }
            Ray::Loop { initial, body } => return self.lower_loop(op, initial, body),
            Ray::Trace { .. }
            | Ray::Occluded { .. }
            | Ray::LightSample { .. }
            | Ray::Ambient
            | Ray::Rand
            | Ray::Query(..)
            | Ray::ReportBudget => {
                self.lower_request(op);
                return Ok(());
            }
            Ray::Report(..) => return Ok(()),
            Ray::ReferenceCall(call) => return Err(LowerError::Unlinked(call.member.clone())),
            Ray::Seed(_) | Ray::Derivative(..) | Ray::ChainRule(..) => {
                return Err(LowerError::Unlinked("gradient".to_owned()));
            }
            Ray::IsSet(member, _) | Ray::ReferenceCount(member) => {
                return Err(LowerError::Unlinked(member.clone()));
            }
        };
        let result = self.pure(kind, self.function.scalar(op.results.get(0)));
        self.set_results(op, &[result]);
        Ok(())
    }

    // Values of the function.

    fn value(&self, value: Value) -> Value {
        self.values[value].expect("values are defined before they are used")
    }

    fn values_of<const N: usize>(&self, values: [Value; N]) -> [Value; N] {
        values.map(|value| self.value(value))
    }

    fn index(&self, index: Index) -> Index {
        match index {
            Index::Constant(index) => Index::Constant(index),
            Index::Dynamic(value) => Index::Dynamic(self.value(value)),
        }
    }

    fn set_results(&mut self, op: &rtsl_ir::Op, values: &[Value]) {
        for (result, value) in op.results.iter().zip(values) {
            self.values[result] = Some(*value);
        }
    }

    fn is_used(&self, value: Value) -> bool {
        self.uses[value] > 0
    }

    // Values of the kernel.

    fn ty(&self, value: Value) -> Type {
        self.kernel.ty(value)
    }

    fn new_value(&mut self, ty: Type) -> Value {
        self.new_values(&[ty]).get(0)
    }

    fn new_values(&mut self, types: &[Type]) -> Values {
        let first = self.kernel.values.len() as u32;
        self.kernel.values.extend_from_slice(types);
        self.hoisted.resize(self.kernel.values.len(), false);
        let values = Values { first, count: types.len() as u32 };
        if let Some(place) = &self.place {
            values.iter().for_each(|value| self.kernel.places.set(value, place));
        }
        values
    }

    fn constant(&mut self, constant: Constant) -> Value {
        let key = (constant.scalar(), constant.bits());
        if let Some(value) = self.constants.get(&key) {
            return *value;
        }
        let value = self.pure(OpKind::Constant(constant), constant.scalar());
        self.constants.insert(key, value);
        value
    }

    /// Adds an `if` or a loop, to the prologue if possible.
    fn push_control(&mut self, kind: OpKind, types: &[Type]) -> Vec<Value> {
        let ends = self.depth == 0 || !hoist::has_loop(&kind);
        let hoist = ends && types.iter().all(|ty| !ty.lanes) && self.is_hoistable(&kind);
        self.push(kind, types, hoist).iter().collect()
    }

    /// Adds an operation without effects that gives one `scalar` per ray, or a uniform one.
    fn pure(&mut self, kind: OpKind, scalar: Scalar) -> Value {
        let lanes = self.gives_lanes(&kind);
        let hoist = !lanes && self.is_hoistable(&kind);
        self.push(kind, &[Type { scalar, lanes }], hoist).get(0)
    }

    fn gives_lanes(&self, kind: &OpKind) -> bool {
        let from_variable = match kind {
            OpKind::Load(variable, _) | OpKind::Length(variable) => {
                self.kernel.variable(*variable).varies
            }
            OpKind::Unspecified => true,
            _ => false,
        };
        let mut from_operand = false;
        kind.for_each_operand(|operand| from_operand |= self.ty(operand).lanes);
        from_variable || from_operand
    }

    fn push(&mut self, kind: OpKind, types: &[Type], hoist: bool) -> Values {
        let results = self.new_values(types);
        self.push_op(Op { results, kind }, hoist);
        results
    }

    fn push_op(&mut self, op: Op, hoist: bool) {
        if hoist {
            op.results.iter().for_each(|result| self.hoisted[result] = true);
            self.kernel.prologue.ops.push(op);
        } else {
            self.open.push(op);
        }
    }

    fn and(&mut self, a: Value, b: Value) -> Value {
        self.pure(OpKind::Binary(BinaryOp::And, a, b), Scalar::Bool)
    }

    fn or(&mut self, a: Value, b: Value) -> Value {
        self.pure(OpKind::Binary(BinaryOp::Or, a, b), Scalar::Bool)
    }

    fn not(&mut self, a: Value) -> Value {
        self.pure(OpKind::Unary(UnaryOp::Not, a), Scalar::Bool)
    }

    fn compare(&mut self, op: CompareOp, a: Value, b: Value) -> Value {
        self.pure(OpKind::Compare(op, a, b), Scalar::Bool)
    }

    /// Returns the operation for `a - b`. If `a` is loaded and `b` is uniform, this adds the negation of `b`, which has
    /// the same bits: instructions can read the second operand of a sum from memory, but not the first of a difference.
    /// On Zen 3 this saves 5 % on spheres (0.76 instead of 0.79 ns per ray).
    fn difference(&mut self, a: Value, b: Value) -> OpKind {
        let opposite = OpKind::Unary(UnaryOp::Negate, b);
        let is_float = self.ty(a).scalar == Scalar::F32;
        if is_float && self.loaded.contains(&a) && self.is_hoistable(&opposite) {
            let opposite = self.pure(opposite, Scalar::F32);
            return OpKind::Binary(BinaryOp::Add, a, opposite);
        }
        OpKind::Binary(BinaryOp::Subtract, a, b)
    }

    /// Adds a select: `a` if the condition is true, else `b`.
    fn select(&mut self, condition: Value, a: Value, b: Value) -> Value {
        if a == b {
            return a;
        }
        if a == condition {
            return self.or(condition, b);
        }
        if b == condition {
            return self.and(condition, a);
        }
        match (self.known_bool(a), self.known_bool(b)) {
            (Some(true), Some(_)) => condition,
            (Some(false), Some(_)) => self.not(condition),
            (Some(true), None) => self.or(condition, b),
            (None, Some(false)) => self.and(condition, a),
            (Some(false), None) => {
                let inverse = self.not(condition);
                self.and(inverse, b)
            }
            (None, Some(true)) => {
                let inverse = self.not(condition);
                self.or(inverse, a)
            }
            (None, None) => {
                let scalar = self.ty(a).scalar;
                self.pure(OpKind::Select(condition, a, b), scalar)
            }
        }
    }

    fn known_bool(&self, value: Value) -> Option<bool> {
        let is = |constant: bool| {
            self.constants.get(&(Scalar::Bool, u32::from(constant))) == Some(&value)
        };
        [true, false].into_iter().find(|constant| is(*constant))
    }

    /// Returns a bool to branch on: the condition itself, or true if any lane of it is on.
    fn any(&mut self, condition: Value) -> Value {
        if !self.ty(condition).lanes {
            return condition;
        }
        self.push(OpKind::Any(condition), &[Type::CONDITION], false).get(0)
    }
}
