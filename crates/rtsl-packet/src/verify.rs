//! Checks a kernel against the invariants on which code generation relies:
//!
//! 1. Every value is defined once, before its uses, and is visible where it is used: in the region that defines it and
//!    those nested in it; values of the prologue everywhere.
//! 2. The prologue and its regions define uniform values only, and have no effects.
//! 3. The result of a pure operation is uniform if all its operands are, else lanes.
//! 4. Operands have the scalar types that the operation takes; the two of a binary operation the same.
//! 5. Conditions of `if` and `loop` are uniform bools.
//! 6. Regions yield as many values as required. A uniform result or carried value is never given lanes.
//! 7. Masks are lanes of bool. A request to the host has one; its light index is uniform.
//! 8. Variables used by operations exist and have a kind that the operation may use. Constant indices are in range. A
//!    uniform local is never stored lanes, nor under a mask, nor at an index of lanes. A variable other than a local
//!    varies as the call mode gives it; state is a state variable of the language. All locals together are within
//!    [`MAX_LOCAL_WORDS`].
//! 9. There is one yield of the body for each output, and the outputs are state, scratch and accepted variables.

use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_ir::{
    BinaryOp, CompareOp, Index, IndexVec, Scalar, UnaryOp, Value, VariableId, VariableKind,
};
use rtsl_spec::COLOR_COMPONENTS;

use crate::Kernel;
use crate::kernel::{KernelVariable, Op, OpKind, Region, Type};
use crate::locals::{MAX_LOCAL_WORDS, local_words};

/// A violated invariant: a bug in the compiler, never in a shader.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{kernel}: {what}")]
pub struct VerifyError {
    /// The kernel's name.
    pub kernel: String,
    /// The violation: the value or operation and the invariant.
    pub what: String,
}

/// Checks `kernel` against the invariants above.
///
/// # Errors
/// The first violated invariant.
pub fn verify(kernel: &Kernel) -> Result<(), VerifyError> {
    let mut verifier = Verifier {
        kernel,
        visible: IndexVec::filled(kernel.values.len(), false),
        pure_only: false,
    };
    verifier.kernel().map_err(|what| VerifyError { kernel: kernel.name.clone(), what })
}

struct Verifier<'a> {
    kernel: &'a Kernel,
    visible: IndexVec<Value, bool>,
    /// True in the prologue.
    pure_only: bool,
}

type Checked = Result<(), String>;

fn ensure(condition: bool, what: impl FnOnce() -> String) -> Checked {
    if condition { Ok(()) } else { Err(what()) }
}

impl Verifier<'_> {
    fn kernel(&mut self) -> Checked {
        let Kernel { prologue, body, outputs, width, .. } = self.kernel;
        ensure(width.is_power_of_two() && *width <= 16, || {
            format!("width {width} is not a power of two up to 16")
        })?;
        self.variables()?;
        ensure(prologue.params.is_empty() && prologue.yields.is_empty(), || {
            "the prologue has parameters or yields".to_owned()
        })?;
        self.pure_only = true;
        self.ops(prologue)?;
        self.pure_only = false;
        ensure(body.params.len() == 1, || "the body does not have one parameter".to_owned())?;
        self.region(body)?;
        ensure(body.yields.len() == outputs.len(), || {
            "the numbers of outputs and yields differ".to_owned()
        })?;
        // The body's values are out of scope here; its yields were checked in the body.
        for (output, value) in outputs.iter().zip(&body.yields) {
            let variable = &self.variable(output.variable)?.variable;
            let kind = matches!(
                variable.kind,
                VariableKind::State | VariableKind::Scratch | VariableKind::Accepted
            );
            ensure(kind && output.component < variable.len, || {
                format!("{}[{}] cannot be an output", variable.name, output.component)
            })?;
            ensure(self.kernel.ty(*value).scalar == variable.scalar, || {
                format!("output {} has the wrong type", variable.name)
            })?;
        }
        Ok(())
    }

    fn variables(&self) -> Checked {
        let Kernel { mode, object_words, .. } = self.kernel;
        ensure(!mode.has_many_objects() || object_words.is_some(), || {
            "the call mode has many objects, but there are no blocks of them".to_owned()
        })?;
        let states = rtsl_spec::state_component_count();
        for KernelVariable { variable, varies, location, of_objects } in &self.kernel.variables {
            let name = &variable.name;
            let as_mode = variable.kind == VariableKind::Local
                || *varies == self.kernel.mode.varies(variable, *of_objects);
            ensure(as_mode, || format!("{name} varies differently from the call mode"))?;
            let end = location.saturating_add(variable.len);
            let is_data = matches!(variable.kind, VariableKind::Member | VariableKind::Buffer);
            let words = match variable.kind {
                VariableKind::Buffer => BUFFER_WORDS,
                VariableKind::State
                | VariableKind::Member
                | VariableKind::Parameter
                | VariableKind::Scratch
                | VariableKind::Local
                | VariableKind::Accepted => variable.len,
            };
            let in_objects =
                location.saturating_add(words) <= self.kernel.object_words.unwrap_or(0);
            ensure(!of_objects || (is_data && in_objects), || {
                format!("{name} is not in the blocks of objects")
            })?;
            let in_table = variable.kind != VariableKind::State || end <= states;
            ensure(in_table, || format!("state {name} is not a state variable of the language"))?;
        }
        let words = local_words(self.kernel);
        ensure(words <= MAX_LOCAL_WORDS, || {
            format!("locals have {words} words, more than {MAX_LOCAL_WORDS}")
        })
    }

    fn region(&mut self, region: &Region) -> Checked {
        for param in &region.params {
            self.define(*param)?;
        }
        self.ops(region)?;
        region.yields.iter().try_for_each(|value| self.check_visible(*value))?;
        let inside = region.ops.iter().flat_map(|op| op.results.iter());
        for value in inside.chain(region.params.iter().copied()) {
            self.visible[value] = false;
        }
        Ok(())
    }

    fn ops(&mut self, region: &Region) -> Checked {
        region.ops.iter().try_for_each(|op| self.op(op))
    }

    fn op(&mut self, op: &Op) -> Checked {
        let mut operands = Vec::new();
        op.kind.for_each_operand(|operand| operands.push(operand));
        operands.iter().try_for_each(|operand| self.check_visible(*operand))?;
        op.kind.regions().try_for_each(|region| self.region(region))?;
        let defined = (op.results.first + op.results.count) as usize <= self.kernel.values.len();
        ensure(defined, || format!("%{} has no type", op.results.first))?;
        self.kind(op, &operands)
            .map_err(|what| format!("%{} = {:?}: {what}", op.results.first, op.kind))?;
        op.results.iter().try_for_each(|result| self.define(result))
    }

    fn define(&mut self, value: Value) -> Checked {
        let lanes = self.kernel.values.get(value.0 as usize).map(|ty| ty.lanes);
        let Some(lanes) = lanes else { return Err(format!("%{} has no type", value.0)) };
        ensure(!(lanes && self.pure_only), || format!("%{} in the prologue is lanes", value.0))?;
        ensure(!self.visible[value], || format!("%{} is defined twice", value.0))?;
        self.visible[value] = true;
        Ok(())
    }

    fn check_visible(&self, value: Value) -> Checked {
        let visible = self.visible.get(value).copied().unwrap_or(false);
        ensure(visible, || format!("%{} is used where it is not visible", value.0))
    }

    fn variable(&self, id: VariableId) -> Result<&KernelVariable, String> {
        self.kernel
            .variables
            .get(id.0 as usize)
            .ok_or_else(|| format!("there is no variable {}", id.0))
    }

    fn ty(&self, value: Value) -> Type {
        self.kernel.ty(value)
    }

    fn kind(&self, op: &Op, operands: &[Value]) -> Checked {
        let results: Vec<Type> = op.results.iter().map(|result| self.ty(result)).collect();
        let joined = operands.iter().any(|operand| self.ty(*operand).lanes);
        let want = |scalars: &[Scalar], lanes: bool| {
            let wanted = scalars.iter().map(|&scalar| Type { scalar, lanes });
            ensure(wanted.eq(results.iter().copied()), || {
                "the results have the wrong types".to_owned()
            })
        };
        match &op.kind {
            OpKind::Constant(constant) => want(&[constant.scalar()], false),
            OpKind::Unary(op, a) => {
                let scalar = self.ty(*a).scalar;
                ensure(unary_takes(*op, scalar), || {
                    "the operation does not take the operand's type".to_owned()
                })?;
                want(&[scalar], joined)
            }
            OpKind::Binary(op, a, _) => {
                let scalar = self.same(operands)?;
                ensure(binary_takes(*op, self.ty(*a).scalar), || {
                    "the operation does not take the operand's type".to_owned()
                })?;
                want(&[scalar], joined)
            }
            OpKind::Compare(op, a, b) => {
                self.same(&[*a, *b])?;
                let equality = matches!(op, CompareOp::Equal | CompareOp::NotEqual);
                let ordered = self.ty(*a).scalar != Scalar::Bool;
                ensure(ordered || equality, || "bools cannot be ordered".to_owned())?;
                want(&[Scalar::Bool], joined)
            }
            OpKind::Select(condition, a, b) => {
                self.check_scalar(*condition, Scalar::Bool)?;
                let scalar = self.same(&[*a, *b])?;
                want(&[scalar], joined)
            }
            OpKind::Fma(..) => {
                self.check_scalars(operands, Scalar::F32)?;
                want(&[Scalar::F32], joined)
            }
            OpKind::Convert(to, _) => want(&[*to], joined),
            OpKind::Bitcast(to, a) | OpKind::Reinterpret(to, a) => {
                let bools = *to == Scalar::Bool || self.ty(*a).scalar == Scalar::Bool;
                ensure(!bools, || "bools have no bits".to_owned())?;
                want(&[*to], joined)
            }
            OpKind::Unspecified => ensure(results.len() == 1 && results[0].lanes, || {
                "the result is not lanes".to_owned()
            }),
            OpKind::Any(mask) => {
                self.check_mask(*mask)?;
                want(&[Scalar::Bool], false)
            }
            OpKind::First(mask, value) => {
                self.check_mask(*mask)?;
                ensure(self.ty(*value).lanes, || "the operand is uniform".to_owned())?;
                want(&[self.ty(*value).scalar], false)
            }
            OpKind::Load(id, index) => {
                let lanes = self.check_element(*id, *index)?;
                let variable = self.variable(*id)?;
                let loads = variable.variable.kind != VariableKind::Accepted;
                ensure(loads, || "accepted cannot be read".to_owned())?;
                let local = variable.variable.kind == VariableKind::Local;
                ensure(!(local && self.pure_only), || "the prologue accesses a local".to_owned())?;
                want(&[variable.variable.scalar], lanes)
            }
            OpKind::Store { variable, index, value, mask } => {
                self.check_effect()?;
                let lanes = self.check_element(*variable, *index)?;
                let local = self.variable(*variable)?;
                ensure(local.variable.kind == VariableKind::Local, || {
                    "the variable is not a local".to_owned()
                })?;
                self.check_scalar(*value, local.variable.scalar)?;
                mask.map_or(Ok(()), |mask| self.check_mask(mask))?;
                let any_lanes = lanes || self.ty(*value).lanes || mask.is_some();
                ensure(local.varies || !any_lanes, || {
                    "lanes are stored to a uniform local".to_owned()
                })?;
                want(&[], false)
            }
            OpKind::Length(id) => {
                let variable = self.variable(*id)?;
                ensure(variable.variable.kind == VariableKind::Buffer, || {
                    "the variable is not a buffer".to_owned()
                })?;
                want(&[Scalar::I32], variable.varies)
            }
            OpKind::If { condition, then, otherwise } => {
                self.check_condition(*condition)?;
                for side in [then, otherwise] {
                    ensure(side.params.is_empty(), || {
                        "a side of a branch has parameters".to_owned()
                    })?;
                    self.check_passed(&side.yields, &results)?;
                }
                Ok(())
            }
            OpKind::Loop { initial, body } => {
                let params: Vec<Type> = body.params.iter().map(|param| self.ty(*param)).collect();
                let Some((again, next)) = body.yields.split_first() else {
                    return Err("the body of a loop yields nothing".to_owned());
                };
                self.check_condition(*again)?;
                self.check_passed(initial, &params)?;
                self.check_passed(next, &params)?;
                self.check_passed(next, &results)
            }
            OpKind::Trace { mask, .. } => {
                self.check_request(*mask, &operands[1..])?;
                want(&[Scalar::F32; COLOR_COMPONENTS as usize], true)
            }
            OpKind::Occluded { mask, .. } => {
                self.check_request(*mask, &operands[1..])?;
                want(&[Scalar::Bool], true)
            }
            OpKind::LightCount => want(&[Scalar::I32], false),
            OpKind::LightSample { mask, index, .. } => {
                self.check_request(*mask, &operands[2..])?;
                let uniform = self.ty(*index) == Type::uniform(Scalar::I32);
                ensure(uniform, || "the index is not a uniform i32".to_owned())?;
                let mut scalars = vec![Scalar::F32; 6 + COLOR_COMPONENTS as usize];
                scalars[0] = Scalar::Bool;
                want(&scalars, true)
            }
            OpKind::Ambient => want(&[Scalar::F32; COLOR_COMPONENTS as usize], false),
            OpKind::Rand(mask) => {
                self.check_request(*mask, &[])?;
                want(&[Scalar::F32], true)
            }
            OpKind::Query { mask, query, operands } => {
                match mask {
                    Some(mask) => self.check_request(*mask, &[])?,
                    None => ensure(query.is_uniform(), || "the query has no mask".to_owned())?,
                }
                let wanted: Vec<Scalar> = query.operand_scalars().collect();
                ensure(operands.len() == wanted.len(), || "operands are missing".to_owned())?;
                for (operand, scalar) in operands.iter().zip(wanted) {
                    self.check_scalar(*operand, scalar)?;
                }
                want(&query.result_scalars().collect::<Vec<_>>(), !query.is_uniform())
            }
            OpKind::ReportBudget => {
                self.check_effect()?;
                want(&[], false)
            }
        }
    }

    fn same(&self, values: &[Value]) -> Result<Scalar, String> {
        let scalar = self.ty(values[0]).scalar;
        self.check_scalars(values, scalar)?;
        Ok(scalar)
    }

    fn check_scalars(&self, values: &[Value], scalar: Scalar) -> Checked {
        values.iter().try_for_each(|value| self.check_scalar(*value, scalar))
    }

    fn check_scalar(&self, value: Value, scalar: Scalar) -> Checked {
        ensure(self.ty(value).scalar == scalar, || format!("%{} is not {}", value.0, scalar.name()))
    }

    fn check_mask(&self, value: Value) -> Checked {
        ensure(self.ty(value) == Type::MASK, || format!("%{} is not a mask", value.0))
    }

    fn check_condition(&self, value: Value) -> Checked {
        ensure(self.ty(value) == Type::CONDITION, || format!("%{} is not a uniform bool", value.0))
    }

    fn check_effect(&self) -> Checked {
        ensure(!self.pure_only, || "the prologue has an effect".to_owned())
    }

    fn check_request(&self, mask: Value, floats: &[Value]) -> Checked {
        self.check_effect()?;
        self.check_mask(mask)?;
        self.check_scalars(floats, Scalar::F32)
    }

    /// Checks that values passed on as `types` have the same scalar types; uniform ones may become lanes.
    fn check_passed(&self, values: &[Value], types: &[Type]) -> Checked {
        ensure(values.len() == types.len(), || "the number of values is wrong".to_owned())?;
        for (value, ty) in values.iter().zip(types) {
            self.check_scalar(*value, ty.scalar)?;
            ensure(ty.lanes || !self.ty(*value).lanes, || {
                format!("%{} is lanes, expected a uniform value", value.0)
            })?;
        }
        Ok(())
    }

    /// Checks an access and returns true if the element differs from ray to ray.
    fn check_element(&self, id: VariableId, index: Index) -> Result<bool, String> {
        let variable = self.variable(id)?;
        match index {
            Index::Constant(index) => {
                ensure(index < variable.variable.len, || format!("index {index} is out of range"))?;
                Ok(variable.varies)
            }
            Index::Dynamic(index) => {
                self.check_scalar(index, Scalar::I32)?;
                Ok(variable.varies || self.ty(index).lanes)
            }
        }
    }
}

fn unary_takes(op: UnaryOp, scalar: Scalar) -> bool {
    match op {
        UnaryOp::Negate | UnaryOp::Abs => scalar != Scalar::Bool,
        UnaryOp::Not => scalar != Scalar::F32,
        // The lowering has replaced it by a branch.
        UnaryOp::Seldom => false,
        UnaryOp::Sqrt
        | UnaryOp::Floor
        | UnaryOp::Ceil
        | UnaryOp::Trunc
        | UnaryOp::RoundEven
        | UnaryOp::ApproximateReciprocal
        | UnaryOp::ApproximateInverseSqrt
        | UnaryOp::ApproximateSqrt => scalar == Scalar::F32,
    }
}

fn binary_takes(op: BinaryOp, scalar: Scalar) -> bool {
    match op {
        BinaryOp::Add
        | BinaryOp::Subtract
        | BinaryOp::Multiply
        | BinaryOp::Divide
        | BinaryOp::Min
        | BinaryOp::Max => scalar != Scalar::Bool,
        BinaryOp::And | BinaryOp::Or | BinaryOp::Xor => scalar != Scalar::F32,
        BinaryOp::Remainder
        | BinaryOp::ShiftLeft
        | BinaryOp::ShiftRight
        | BinaryOp::MultiplyHigh => matches!(scalar, Scalar::I32 | Scalar::U32),
    }
}
