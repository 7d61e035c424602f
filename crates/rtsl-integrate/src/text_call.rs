//! Calls of functions of the [renderer's texts](crate::renderer_text): a copy of the body takes the place of
//! the call.

use rtsl_abi::Layout;
use rtsl_ir::{
    Constant, Function, Index, IndexVec, Op, OpKind, Region, Scalar, Value, Values, Variable,
    VariableId, VariableKind, evaluate,
};
use rtsl_link::{Linker, Linking, load_component};
use rtsl_lower::LoweredFunction;

use crate::arithmetic::Arithmetic;
use crate::renderer_text::text_function;
use crate::stage_linker::StageLinker;

/// A body that is being copied.
struct TextCopy<'a> {
    text: &'static LoweredFunction,
    /// The operands, in the order of the parameters' scalars.
    operands: &'a [Value],
    /// The variables that take the place of buffers, in the order of the parameters.
    arrays: &'a [Variable],
    values: IndexVec<Value, Option<Value>>,
    variables: IndexVec<VariableId, Option<VariableId>>,
}

impl StageLinker {
    /// Calls a function of the renderer's texts with these operands, one for each scalar of its parameters in order,
    /// and returns the scalars of its result, then those of its `out` parameters. Operations on constants, and branches
    /// of conditions that are constant, leave no trace.
    ///
    /// # Panics
    /// If there is no such function, or it has other parameters.
    pub fn call_text(
        &mut self,
        name: &str,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        self.call_text_with(name, operands, &[], to)
    }

    /// As [`StageLinker::call_text`], of a function with parameters that are buffers: these are the variables, members or
    /// buffers, that take their places, one for each leaf of the buffers' elements in order.
    ///
    /// # Panics
    /// As for [`StageLinker::call_text`].
    pub fn call_text_with(
        &mut self,
        name: &str,
        operands: &[Value],
        arrays: &[Variable],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let text = text_function(name);
        let is_buffer = |it: &&Variable| it.kind == VariableKind::Buffer;
        let (buffers, others): (Vec<_>, Vec<_>) = text.parameters.iter().partition(is_buffer);
        let scalars: Vec<Scalar> =
            others.iter().flat_map(|it| std::iter::repeat_n(it.scalar, it.len as usize)).collect();
        let given: Vec<Scalar> = operands.iter().map(|it| self.out.scalar(*it)).collect();
        assert_eq!((given, arrays.len()), (scalars, buffers.len()), "the operands of {name}");
        let function = &text.function;
        let mut copy = TextCopy {
            text,
            operands,
            arrays,
            values: IndexVec::filled(function.values.len(), None),
            variables: IndexVec::filled(function.variables.len(), None),
        };
        self.nested(|linker| {
            copy.copy_ops(linker, &function.body.ops, to)?;
            Ok(function.body.yields.iter().map(|value| copy.value(*value)).collect())
        })
    }
}

/// Links a function whose parameters, after those of known values, are scratch arrays, and whose results are the next.
/// These members take the places of its buffers.
pub fn link_alone(
    name: &str,
    known: &[Constant],
    members: &[Variable],
) -> Linking<(Function, Layout)> {
    let mut linker = StageLinker::new(name);
    let mut ops: Vec<Op> = Vec::new();
    let code = &mut Arithmetic { linker: &mut linker, to: &mut ops };
    let mut scratch = Vec::new();
    let mut operands: Vec<Value> = Vec::new();
    let mut column = |scalar: Scalar| {
        let (kind, name) = (VariableKind::Scratch, format!("array.{}", scratch.len()));
        scratch.push(Variable { kind, name: name.clone(), scalar, len: 1 });
        name
    };
    let parameters = text_function(name).parameters.iter();
    for parameter in parameters.filter(|it| it.kind != VariableKind::Buffer) {
        for _ in 0..parameter.len {
            operands.push(match known.get(operands.len()) {
                Some(known) => code.linker.constant(code.to, *known)?,
                None => code.column(&column(parameter.scalar), parameter.scalar)?,
            });
        }
    }
    for result in linker.call_text_with(name, &operands, members, &mut ops)? {
        let name = column(linker.out.scalar(result));
        linker.set_column(name, result);
    }
    linker.out.body.ops = ops;
    let layout = Layout::new(members, [], &scratch);
    Ok((linker.finish().function, layout))
}

impl TextCopy<'_> {
    fn value(&self, value: Value) -> Value {
        self.values[value].expect("the verifier saw values defined before their use")
    }

    fn copy_ops(&mut self, linker: &mut StageLinker, from: &[Op], to: &mut Vec<Op>) -> Linking<()> {
        from.iter().try_for_each(|op| self.copy_op(linker, op, to))
    }

    fn copy_op(&mut self, linker: &mut StageLinker, op: &Op, to: &mut Vec<Op>) -> Linking<()> {
        let (kind, results) = (&op.kind, op.results);
        if let Some(constant) = evaluate::fold(kind, |value| linker.known(self.value(value))) {
            let value = linker.constant(to, constant)?;
            self.define(results, [value]);
            return Ok(());
        }
        let kind = match kind {
            OpKind::If { condition, then, otherwise } => {
                let condition = self.value(*condition);
                if let Some(known) = linker.known(condition) {
                    let taken = if known.bits() != 0 { then } else { otherwise };
                    self.copy_ops(linker, &taken.ops, to)?;
                    let values: Vec<Value> =
                        taken.yields.iter().map(|value| self.value(*value)).collect();
                    self.define(results, values);
                    return Ok(());
                }
                let then = self.copy_region(linker, then)?;
                OpKind::If { condition, then, otherwise: self.copy_region(linker, otherwise)? }
            }
            OpKind::Loop { initial, body } => {
                let initial = initial.iter().map(|value| self.value(*value)).collect();
                OpKind::Loop { initial, body: self.copy_region(linker, body)? }
            }
            OpKind::Load(variable, index) => {
                let index = match *index {
                    Index::Constant(index) => Index::Constant(index),
                    Index::Dynamic(index) => Index::Dynamic(self.value(index)),
                };
                if let Some(operands) = self.operands_of(*variable) {
                    let operand = |_: &mut StageLinker, _: &mut Vec<Op>, component: u32| {
                        Ok(operands[component as usize])
                    };
                    let Variable { len, scalar, .. } = *self.text.function.variable(*variable);
                    let value = load_component(linker, index, len, scalar, operand, to)?;
                    self.define(results, [value]);
                    return Ok(());
                }
                OpKind::Load(self.variable(linker, *variable), index)
            }
            OpKind::Length(buffer) => {
                let len = self.text.function.variable(*buffer).len;
                let array = self.array_of(*buffer);
                if array.kind == VariableKind::Member {
                    let count = Constant::I32((array.len / len) as i32);
                    let value = linker.constant(to, count)?;
                    self.define(results, [value]);
                    return Ok(());
                }
                OpKind::Length(self.variable(linker, *buffer))
            }
            simple => {
                let mut kind = simple.clone();
                kind.for_each_operand_mut(|value| *value = self.value(*value));
                if let OpKind::Store(variable, ..) = &mut kind {
                    *variable = self.variable(linker, *variable);
                }
                kind
            }
        };
        let scalars: Vec<Scalar> =
            results.iter().map(|value| self.text.function.scalar(value)).collect();
        let copies = linker.emit(to, kind, &scalars, op.precise)?;
        self.define(results, copies.iter());
        Ok(())
    }

    fn define(&mut self, results: Values, copies: impl IntoIterator<Item = Value>) {
        for (value, copy) in results.iter().zip(copies) {
            self.values[value] = Some(copy);
        }
    }

    fn copy_region(&mut self, linker: &mut StageLinker, region: &Region) -> Linking<Region> {
        linker.nested(|linker| {
            let mut copy = Region::default();
            for param in &region.params {
                let new = linker.out.new_values(&[self.text.function.scalar(*param)]).get(0);
                self.values[*param] = Some(new);
                copy.params.push(new);
            }
            self.copy_ops(linker, &region.ops, &mut copy.ops)?;
            copy.yields = region.yields.iter().map(|value| self.value(*value)).collect();
            Ok(copy)
        })
    }

    /// The operands of a parameter; `None` for other variables.
    fn operands_of(&self, variable: VariableId) -> Option<&[Value]> {
        let variable = self.text.function.variable(variable);
        let mut first = 0;
        for parameter in &self.text.parameters {
            if parameter.kind == VariableKind::Buffer {
                continue;
            }
            let end = first + parameter.len as usize;
            if parameter == variable {
                return Some(&self.operands[first..end]);
            }
            first = end;
        }
        None
    }

    /// The variable that takes the place of a buffer.
    fn array_of(&self, buffer: VariableId) -> &Variable {
        let buffer = self.text.function.variable(buffer);
        let parameters = self.text.parameters.iter();
        let buffers = parameters.filter(|it| it.kind == VariableKind::Buffer);
        let index = buffers.take_while(|it| *it != buffer).count();
        &self.arrays[index]
    }

    /// The variable of the linked function for a buffer or a local.
    fn variable(&mut self, linker: &mut StageLinker, id: VariableId) -> VariableId {
        if let Some(known) = self.variables[id] {
            return known;
        }
        let variable = self.text.function.variable(id);
        let new = match variable.kind {
            VariableKind::Buffer => linker.intern_variable(self.array_of(id).clone()),
            _ => {
                let name = format!("{}.{}", variable.name, linker.out.variables.len());
                linker.intern_variable(Variable { name, ..variable.clone() })
            }
        };
        self.variables[id] = Some(new);
        new
    }
}
