//! The verifier: the invariants that every pass and backend relies on.
//!
//! A verified function never makes the printer, the interpreter, a pass or a backend panic.
//!
//! # Invariants
//!
//! Names and variables
//! 1. Names of functions, variables and references are words of the text form; no two variables of one kind have the
//!    same name.
//! 2. A variable has at least one scalar and, except for buffers and members, at most [`MAX_VARIABLE_SCALARS`]; all
//!    locals together have at most [`MAX_LOCAL_SCALARS`].
//! 3. A state variable has the name, type and number of components of a state variable of the language; an accepted
//!    variable is one bool.
//!
//! Values
//! 4. A value is defined at most once: by an operation or as a parameter of the body of a loop.
//! 5. A use comes after the definition, in the same region or in one nested in it.
//! 6. Operands have the types that the operation takes, and results are as many and of the types that it gives.
//!
//! Variables in operations
//! 7. `load` reads no accepted variable, `store` writes only locals, `length` applies only to buffers; constant indices
//!    are less than the variable's length, dynamic ones are i32.
//! 8. State components of a reference call exist.
//!
//! Regions
//! 9. Only bodies of loops have parameters: as many as initial values, of their types.
//! 10. Both regions of an `if` yield the types of its results; the body of a loop yields a bool and
//!     the types of its parameters.
//! 11. The function's body yields one value for each output, of the variable's type. Outputs go to
//!     existing components of variables that can be outputs, to none twice.
//! 12. Regions are nested at most [`MAX_NESTING`] deep.
//!
//! The verifier does not check that loops over lights are uniform.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};

use crate::{
    Function, Index, IndexVec, MAX_NESTING, Op, OpKind, ReferencePath, Region, Scalar,
    StateComponent, Value, Variable, VariableId, VariableKind, evaluate, scalar_count, text,
};

/// The greatest number of scalars of a variable other than a member or buffer.
pub const MAX_VARIABLE_SCALARS: u32 = 1 << 16;

/// The greatest number of scalars of all locals of a function together.
pub const MAX_LOCAL_SCALARS: u32 = 1 << 16;

/// Checks all invariants. The error names the first violation in the order of the text form.
pub fn verify(function: &Function) -> Result<(), VerifyError> {
    let mut verifier = Verifier::new(function);
    verifier.function().map_err(|message| VerifyError {
        function: function.name.clone(),
        operation: verifier.failed,
        message,
    })
}

/// A violated invariant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerifyError {
    /// The function's name.
    pub function: String,
    /// The first line of the innermost invalid operation, if the violation is inside one.
    pub operation: Option<String>,
    /// The violation.
    pub message: String,
}

impl Display for VerifyError {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        write!(out, "{}: ", self.function)?;
        if let Some(operation) = &self.operation {
            write!(out, "`{operation}`: ")?;
        }
        out.write_str(&self.message)
    }
}

impl std::error::Error for VerifyError {}

type Result<T = (), E = String> = std::result::Result<T, E>;

/// The visibility of a value at the current position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Visibility {
    Undefined,
    Visible,
    /// Defined in a region that has ended.
    Hidden,
}

struct Verifier<'a> {
    function: &'a Function,
    visibility: IndexVec<Value, Visibility>,
    /// The visible values, in the order of their definition.
    visible: Vec<Value>,
    depth: usize,
    /// The first line of the innermost invalid operation.
    failed: Option<String>,
    /// A scratch buffer, kept to save allocations.
    scalars: Vec<Scalar>,
}

impl<'a> Verifier<'a> {
    fn new(function: &'a Function) -> Self {
        Verifier {
            function,
            visibility: IndexVec::filled(function.values.len(), Visibility::Undefined),
            visible: Vec::new(),
            depth: 0,
            failed: None,
            scalars: Vec::new(),
        }
    }

    fn function(&mut self) -> Result {
        check_word("the function's name", &self.function.name)?;
        self.check_places()?;
        let body = &self.function.body;
        if !body.params.is_empty() {
            return Err("the function's body has parameters".to_owned());
        }
        self.check_ops(body)?;
        self.check_outputs(body)
    }

    fn check_places(&self) -> Result {
        let mut names = BTreeSet::new();
        let mut local_scalars = 0;
        for variable in &self.function.variables {
            check_variable(variable)?;
            if !names.insert((variable.kind, &variable.name)) {
                let (kind, name) = (variable.kind.name(), &variable.name);
                return Err(format!("{kind} `{name}` is declared twice"));
            }
            if variable.kind == VariableKind::Local {
                local_scalars += u64::from(variable.len);
            }
        }
        if local_scalars > u64::from(MAX_LOCAL_SCALARS) {
            return Err(format!(
                "locals have {local_scalars} scalars, more than {MAX_LOCAL_SCALARS}"
            ));
        }
        Ok(())
    }

    fn check_outputs(&self, body: &Region) -> Result {
        let outputs = &self.function.outputs;
        if outputs.len() != body.yields.len() {
            let (yields, outputs) = (body.yields.len(), outputs.len());
            return Err(format!("the body yields {yields} values for {outputs} outputs"));
        }
        let mut seen = BTreeSet::new();
        for (output, value) in outputs.iter().zip(&body.yields) {
            let variable = self.variable(output.variable)?;
            let name =
                format!("output {}:{}@{}", variable.kind.name(), variable.name, output.component);
            match variable.kind {
                VariableKind::State
                | VariableKind::Member
                | VariableKind::Parameter
                | VariableKind::Scratch
                | VariableKind::Accepted => {}
                VariableKind::Buffer | VariableKind::Local => {
                    return Err(format!("{name} is in a variable that can be no output"));
                }
            }
            if output.component >= variable.len {
                return Err(format!("{name} is beyond the variable's length {}", variable.len));
            }
            if !seen.insert((output.variable, output.component)) {
                return Err(format!("{name} occurs twice"));
            }
            self.check_use(*value, Some(variable.scalar))
                .map_err(|error| format!("{name}: {error}"))?;
        }
        Ok(())
    }

    /// Checks the operations of a region and leaves the values they define visible.
    fn check_ops(&mut self, region: &Region) -> Result {
        for op in &region.ops {
            if let Err(message) = self.check_op(op) {
                self.failed.get_or_insert_with(|| text::op_line(self.function, op));
                return Err(message);
            }
        }
        Ok(())
    }

    fn check_op(&mut self, op: &Op) -> Result {
        let end = u64::from(op.results.first) + u64::from(op.results.count);
        if end > self.function.values.len() as u64 {
            return Err("results are beyond the function's values".to_owned());
        }
        self.check_operands(&op.kind)?;
        match &op.kind {
            OpKind::If { then, otherwise, .. } => {
                let results = op.results.iter().map(|value| self.function.scalar(value));
                let results: Vec<Scalar> = results.collect();
                for region in [then, otherwise] {
                    if !region.params.is_empty() {
                        return Err("a region of an `if` has parameters".to_owned());
                    }
                    self.check_region(region, &results)?;
                }
            }
            OpKind::Loop { initial, body } => {
                if body.params.len() != initial.len() {
                    let (params, initial) = (body.params.len(), initial.len());
                    return Err(format!("{params} parameters for {initial} initial values"));
                }
                let carried = initial.iter().map(|value| self.function.scalar(*value));
                let yields: Vec<Scalar> = [Scalar::Bool].into_iter().chain(carried).collect();
                self.check_region(body, &yields)?;
            }
            // The other operations have no regions.
            _ => {}
        }
        self.check_results(op)?;
        op.results.iter().try_for_each(|value| self.define(value))
    }

    /// Checks a region of an operation, which must yield values of these types.
    fn check_region(&mut self, region: &Region, yields: &[Scalar]) -> Result {
        if self.depth == MAX_NESTING {
            return Err(format!("regions are nested deeper than {MAX_NESTING}"));
        }
        self.depth += 1;
        let outer = self.visible.len();
        for (position, param) in region.params.iter().enumerate() {
            self.define(*param)?;
            let expected = yields.get(position + 1).copied();
            self.check_use(*param, expected)?;
        }
        self.check_ops(region)?;
        if region.yields.len() != yields.len() {
            let (found, expected) = (region.yields.len(), yields.len());
            return Err(format!("a region yields {found} values, expected {expected}"));
        }
        for (value, expected) in region.yields.iter().zip(yields) {
            self.check_use(*value, Some(*expected))?;
        }
        for value in self.visible.drain(outer..) {
            self.visibility[value] = Visibility::Hidden;
        }
        self.depth -= 1;
        Ok(())
    }

    fn check_operands(&self, kind: &OpKind) -> Result {
        let mut uses = Ok(());
        kind.for_each_operand(|value| {
            if uses.is_ok() {
                uses = self.check_use(value, None);
            }
        });
        uses?;
        let scalar = |value: Value| self.function.scalar(value);
        match kind {
            OpKind::Constant(_)
            | OpKind::Loop { .. }
            | OpKind::LightCount
            | OpKind::Ambient
            | OpKind::Rand
            | OpKind::ReportBudget => Ok(()),
            OpKind::Report(event, operands) => {
                let expected = event.values.iter().map(|value| scalar_count(&value.ty)).sum();
                if operands.len() == expected {
                    return Ok(());
                }
                let found = operands.len();
                Err(format!("a report of {expected} scalars has {found} operands"))
            }
            OpKind::Unary(op, a) => {
                check_defined(evaluate::unary(*op, scalar(*a)).is_some(), scalar(*a))
            }
            OpKind::Binary(op, a, b) => {
                check_defined(evaluate::binary(*op, scalar(*a)).is_some(), scalar(*a))?;
                self.check_use(*b, Some(scalar(*a)))
            }
            OpKind::Compare(op, a, b) => {
                check_defined(evaluate::compare(*op, scalar(*a)).is_some(), scalar(*a))?;
                self.check_use(*b, Some(scalar(*a)))
            }
            OpKind::Select(condition, a, b) => {
                self.check_use(*condition, Some(Scalar::Bool))?;
                self.check_use(*b, Some(scalar(*a)))
            }
            OpKind::Convert(..) => Ok(()),
            OpKind::Bitcast(to, a) => {
                check_defined(evaluate::bitcast(scalar(*a), *to).is_some(), scalar(*a))
            }
            OpKind::Load(variable, index) => {
                if self.variable(*variable)?.kind == VariableKind::Accepted {
                    return Err("an accepted variable cannot be read".to_owned());
                }
                self.check_index(*variable, *index)
            }
            OpKind::Store(variable, index, value) => {
                let local = self.variable(*variable)?;
                if local.kind != VariableKind::Local {
                    return Err("only locals can be stored to".to_owned());
                }
                self.check_index(*variable, *index)?;
                self.check_use(*value, Some(local.scalar))
            }
            OpKind::Length(variable) => match self.variable(*variable)?.kind {
                VariableKind::Buffer => Ok(()),
                _ => Err("only buffers have a length".to_owned()),
            },
            OpKind::If { condition, .. } => self.check_use(*condition, Some(Scalar::Bool)),
            OpKind::Fma(..)
            | OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..) => self.check_all_f32(kind, 0),
            OpKind::LightSample { index, .. } => {
                self.check_use(*index, Some(Scalar::I32))?;
                self.check_all_f32(kind, 1)
            }
            OpKind::Query(query, operands) => {
                let (found, expected) = (operands.len(), query.operand_scalars().count());
                if found != expected {
                    return Err(format!("{found} operands, expected {expected}"));
                }
                let mut typed = operands.iter().zip(query.operand_scalars());
                typed.try_for_each(|(value, scalar)| self.check_use(*value, Some(scalar)))
            }
            OpKind::ReferenceCall(call) => {
                check_word("the reference's name", &call.member)?;
                self.check_path(call.path)?;
                for (component, value) in &call.overrides {
                    check_component(*component)?;
                    self.check_use(*value, Some(Scalar::F32))?;
                }
                call.results.iter().try_for_each(|component| check_component(*component))
            }
            OpKind::IsSet(member, path) => {
                check_word("the reference's name", member)?;
                self.check_path(*path)
            }
            OpKind::ReferenceCount(member) => check_word("the reference's name", member),
        }
    }

    /// Checks that all operands after the first `skipped` are f32.
    fn check_all_f32(&self, kind: &OpKind, skipped: usize) -> Result {
        let mut result = Ok(());
        let mut position = 0;
        kind.for_each_operand(|value| {
            if position >= skipped && result.is_ok() {
                result = self.check_use(value, Some(Scalar::F32));
            }
            position += 1;
        });
        result
    }

    fn check_index(&self, id: VariableId, index: Index) -> Result {
        match index {
            Index::Constant(index) => {
                let len = self.variable(id)?.len;
                if index >= len {
                    return Err(format!("index {index} is beyond the variable's length {len}"));
                }
                Ok(())
            }
            Index::Dynamic(value) => self.check_use(value, Some(Scalar::I32)),
        }
    }

    fn check_path(&self, path: ReferencePath) -> Result {
        match path {
            ReferencePath::Single => Ok(()),
            ReferencePath::Element(value) => self.check_use(value, Some(Scalar::I32)),
        }
    }

    fn check_results(&mut self, op: &Op) -> Result {
        let mut expected = std::mem::take(&mut self.scalars);
        expected.clear();
        op.kind.result_scalars(self.function, &mut expected);
        if expected.len() != op.results.count as usize {
            let (found, expected) = (op.results.count, expected.len());
            return Err(format!("{found} results, expected {expected}"));
        }
        for (value, expected) in op.results.iter().zip(&expected) {
            self.check_type(value, *expected)?;
        }
        self.scalars = expected;
        Ok(())
    }

    fn define(&mut self, value: Value) -> Result {
        match self.visibility.get_mut(value) {
            Some(visibility @ Visibility::Undefined) => *visibility = Visibility::Visible,
            Some(_) => return Err(format!("{value} is defined twice")),
            None => return Err(format!("{value} is beyond the function's values")),
        }
        self.visible.push(value);
        Ok(())
    }

    fn check_use(&self, value: Value, expected: Option<Scalar>) -> Result {
        match self.visibility.get(value) {
            Some(Visibility::Visible) => {}
            Some(Visibility::Undefined) => {
                return Err(format!("{value} is used before it is defined"));
            }
            Some(Visibility::Hidden) => {
                return Err(format!("{value} is used outside the region that defines it"));
            }
            None => return Err(format!("{value} is beyond the function's values")),
        }
        expected.map_or(Ok(()), |expected| self.check_type(value, expected))
    }

    fn check_type(&self, value: Value, expected: Scalar) -> Result {
        let Some(found) = self.function.values.get(value.0 as usize) else {
            return Err(format!("{value} is beyond the function's values"));
        };
        if *found != expected {
            let (found, expected) = (found.name(), expected.name());
            return Err(format!("{value} is {found}, expected {expected}"));
        }
        Ok(())
    }

    fn variable(&self, id: VariableId) -> Result<&'a Variable> {
        let variable = self.function.variables.get(id.0 as usize);
        variable.ok_or_else(|| format!("there is no variable {}", id.0))
    }
}

fn check_variable(variable: &Variable) -> Result {
    let Variable { kind, name, scalar, len } = variable;
    let (kind_name, scalar_name) = (kind.name(), scalar.name());
    check_word("the name of a variable", name)?;
    let fits = match kind {
        VariableKind::State => {
            let variable = rtsl_spec::lookup_state(name);
            let variable = variable.ok_or_else(|| format!("there is no state `{name}`"))?;
            *scalar == Scalar::F32 && *len == variable.ty.components()
        }
        VariableKind::Accepted => *scalar == Scalar::Bool && *len == 1,
        VariableKind::Parameter | VariableKind::Scratch | VariableKind::Local => {
            (1..=MAX_VARIABLE_SCALARS).contains(len)
        }
        VariableKind::Member | VariableKind::Buffer => *len >= 1,
    };
    if !fits {
        return Err(format!("{kind_name} `{name}` cannot be {scalar_name}[{len}]"));
    }
    Ok(())
}

fn check_component(component: StateComponent) -> Result {
    let exists =
        component.variable().is_some_and(|variable| component.component < variable.ty.components());
    let missing = || format!("there is no state component {component}");
    exists.then_some(()).ok_or_else(missing)
}

fn check_word(what: &str, name: &str) -> Result {
    let is_word = !name.is_empty() && name.chars().all(text::is_word_character);
    let message = || format!("{what} `{name}` is not a word of the text form");
    is_word.then_some(()).ok_or_else(message)
}

fn check_defined(defined: bool, scalar: Scalar) -> Result {
    let message = || format!("the operation does not take {}", scalar.name());
    defined.then_some(()).ok_or_else(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Verifies a function with a few variables and this body, and returns the error message.
    fn error(body: &str) -> String {
        let text = format!(
            "function f\nstate rt_RayOrigin: f32[3]\nmember m: i32[2]\nbuffer b: f32[1]\n\
             local s: f32[4]\naccepted a: bool[1]\n{{{body}}}"
        );
        let function: Function = text.parse().unwrap();
        verify(&function).expect_err(body).to_string()
    }

    #[test]
    fn each_invariant_has_its_error() {
        let table = [
            ("%a: i32 = constant 1 %b: f32 = add %a, %a return", "%1 is f32, expected i32"),
            ("%a: f32 = constant 1 %b: f32 = and %a, %a return", "the operation does not take f32"),
            (
                "%a: f32 = constant 1 %c: i32 = constant 1 %b: f32 = add %a, %c return",
                "%1 is i32, expected f32",
            ),
            ("%a: f32, %b: f32 = constant 1 return", "2 results, expected 1"),
            ("%a: f32 = load accepted:a@0 return", "an accepted variable cannot be read"),
            (
                "%a: i32 = constant 1 %b: f32 = query sample %a %c: f32 = query sample %b return",
                "%1 is f32, expected i32",
            ),
            ("%a: i32 = constant 1 store member:m@0, %a return", "only locals can be stored to"),
            ("%a: i32 = length member:m return", "only buffers have a length"),
            ("%a: i32 = load member:m@2 return", "index 2 is beyond the variable's length 2"),
            ("%a: f32 = constant 1 %b: i32 = load member:m@%a return", "%0 is f32, expected i32"),
            (
                "%c: bool = constant true if %c { %a: f32 = constant 1 yield } else { yield }
                 store local:s@0, %a return",
                "%1 is used outside the region that defines it",
            ),
            (
                "%c: bool = constant true if %c { yield %c } else { yield } return",
                "a region yields 1 values, expected 0",
            ),
            (
                "%a: i32 = constant 1 %b: i32 = loop (%p: i32 = %a) { repeat %p, %p } return",
                "%2 is i32, expected bool",
            ),
            (
                "%a: i32 = constant 1 return state:rt_RayOrigin@0 = %a",
                "output state:rt_RayOrigin@0: %0 is i32, expected f32",
            ),
            (
                "%a: f32 = constant 1 return state:rt_RayOrigin@3 = %a",
                "output state:rt_RayOrigin@3 is beyond the variable's length 3",
            ),
            (
                "%a: f32 = constant 1 return local:s@0 = %a",
                "output local:s@0 is in a variable that can be no output",
            ),
            (
                "%a: f32 = constant 1 return state:rt_RayOrigin@0 = %a, state:rt_RayOrigin@0 = %a",
                "output state:rt_RayOrigin@0 occurs twice",
            ),
        ];
        for (body, expected) in table {
            let found = error(body);
            assert!(found.ends_with(expected), "{body}\n{found}");
        }
    }

    #[test]
    fn variables_are_checked() {
        let table = [
            ("state rt_Nothing: f32[3]", "there is no state `rt_Nothing`"),
            ("state rt_RayOrigin: f32[2]", "state `rt_RayOrigin` cannot be f32[2]"),
            ("accepted a: f32[1]", "accepted `a` cannot be f32[1]"),
            ("local s: f32[4000000000]", "local `s` cannot be f32[4000000000]"),
            ("local s: f32[65536] local t: i32[1]", "locals have 65537 scalars, more than 65536"),
        ];
        for (variables, expected) in table {
            let function: Function =
                format!("function f {variables} {{ return }}").parse().unwrap();
            assert_eq!(verify(&function).unwrap_err().message, expected);
        }
    }

    #[test]
    fn values_are_defined_once_and_before_use() {
        let constant = |first| Op {
            results: crate::Values { first, count: 1 },
            precise: false,
            kind: OpKind::Constant(crate::Constant::I32(0)),
        };
        let mut function = Function::new("f");
        function.values = vec![Scalar::I32];
        function.body.ops = vec![constant(0), constant(0)];
        assert_eq!(verify(&function).unwrap_err().message, "%0 is defined twice");
        function.body.ops = vec![constant(u32::MAX)];
        let message = verify(&function).unwrap_err().message;
        assert_eq!(message, "results are beyond the function's values");
    }

    #[test]
    fn nesting_is_limited() {
        let mut region = Region::default();
        for _ in 0..MAX_NESTING + 1 {
            let kind =
                OpKind::If { condition: Value(0), then: region, otherwise: Region::default() };
            let op = Op { results: Default::default(), precise: false, kind };
            region = Region { ops: vec![op], ..Region::default() };
        }
        let mut function: Function =
            "function f { %c: bool = constant true return }".parse().unwrap();
        function.body.ops.append(&mut region.ops);
        let error = verify(&function).unwrap_err();
        assert_eq!(error.message, "regions are nested deeper than 256");
    }
}
