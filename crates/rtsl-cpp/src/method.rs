//! Method bodies: translates the operations of a function to statements.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{
    Function, IndexVec, Name, Op, OpKind, Region, Scalar, Value, Values, VariableId, VariableKind,
};

use crate::class_names::ClassNames;
use crate::expression::Expression;
use crate::identifier::Scope;
use crate::literal::{literal, type_name};
use crate::statement::Statement;
use crate::support::Helper;
use crate::uses::Uses;
use crate::while_loop::{self, WhileForm, while_form};

/// The greatest number of operators in an expression; larger ones are split.
const LARGEST_EXPRESSION: usize = 8;

/// The parameters of a body besides the instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Needs {
    pub state: bool,
    pub scratch: bool,
    pub host: bool,
    pub parameters: bool,
}

/// The statements of a function.
#[derive(Debug)]
pub(crate) struct Body {
    pub statements: Vec<Statement>,
    pub needs: Needs,
    /// True if it returns whether a hit was accepted.
    pub accepts: bool,
}

/// Translates a linked function.
pub(crate) fn write_body(
    function: &Function,
    class: &ClassNames,
    helpers: &mut BTreeSet<Helper>,
) -> Body {
    let mut function = function.clone();
    while_loop::run(&mut function);
    debug_assert!(rtsl_ir::verify::verify(&function).is_ok(), "{function}");
    let function = &function;
    let mut writer = Writer::new(function, class, helpers);
    let mut statements = Vec::new();
    writer.begin(&mut statements);
    writer.region(&function.body, &mut statements);
    let accepts = writer.outputs(&mut statements);
    Body { statements, needs: writer.needs, accepts }
}

/// A variable that is assigned to.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    name: String,
    /// For variables of loops, which can be read until their next value is assigned: the carried value.
    variable: Option<Value>,
}

pub(crate) struct Writer<'a> {
    pub function: &'a Function,
    pub uses: Uses,
    pub class: &'a ClassNames,
    pub helpers: &'a mut BTreeSet<Helper>,
    pub needs: Needs,
    scope: Scope,
    /// The expression of each value defined so far.
    values: IndexVec<Value, Option<Expression>>,
    /// Values to be written at their use, which has not been reached.
    pending: BTreeSet<Value>,
    /// The expression of each variable, without its index.
    variables: Vec<String>,
    is_output: IndexVec<VariableId, bool>,
    /// Variables to which results are assigned.
    bound: BTreeMap<Value, Target>,
}

impl<'a> Writer<'a> {
    fn new(
        function: &'a Function,
        class: &'a ClassNames,
        helpers: &'a mut BTreeSet<Helper>,
    ) -> Writer<'a> {
        let mut is_output = IndexVec::filled(function.variables.len(), false);
        for output in &function.outputs {
            is_output[output.variable] = true;
        }
        Writer {
            uses: Uses::of(function),
            class,
            helpers,
            needs: Needs::default(),
            scope: class.scope().clone(),
            values: IndexVec::filled(function.values.len(), None),
            pending: BTreeSet::new(),
            variables: Vec::new(),
            is_output,
            bound: BTreeMap::new(),
            function,
        }
    }

    /// Names the variables, and defines the locals.
    fn begin(&mut self, out: &mut Vec<Statement>) {
        for (id, variable) in (0..).map(VariableId).zip(&self.function.variables) {
            let (loads, is_output) = (self.uses.loads(id), self.is_output[id]);
            let text = match variable.kind {
                VariableKind::State => {
                    self.needs.state |= loads > 0 || is_output;
                    let field = format!("state.{}", self.class.state(&variable.name));
                    if loads > 1 && !is_output {
                        let name = self.scope.name(&variable.name);
                        let value = Some(Expression::atom(field));
                        out.push(Statement::Define {
                            is_constant: true,
                            type_name: "auto".to_owned(),
                            name: format!("&{name}"),
                            value,
                        });
                        name
                    } else {
                        field
                    }
                }
                VariableKind::Member | VariableKind::Buffer => {
                    self.class.field(variable).to_owned()
                }
                VariableKind::Parameter => {
                    self.needs.parameters |= loads > 0;
                    format!("parameters.{}", self.class.field(variable))
                }
                VariableKind::Scratch => {
                    self.needs.scratch |= loads > 0 || is_output;
                    format!("scratch.{}", self.class.field(variable))
                }
                VariableKind::Local => self.scope.name(&variable.name),
                VariableKind::Accepted => String::new(),
            };
            self.variables.push(text);
        }
        self.define_locals(out);
    }

    fn define_locals(&mut self, out: &mut Vec<Statement>) {
        let mut used = IndexVec::filled(self.function.variables.len(), false);
        self.function.body.for_each_op(&mut |op| {
            if let OpKind::Load(variable, _) | OpKind::Store(variable, ..) = op.kind {
                used[variable] = true;
            }
        });
        for ((variable, name), used) in
            self.function.variables.iter().zip(&self.variables).zip(used.iter().copied())
        {
            if variable.kind == VariableKind::Local && used {
                out.push(Statement::Define {
                    is_constant: false,
                    type_name: type_name(variable.scalar).to_owned(),
                    name: format!("{name}[{}]", variable.len),
                    value: Some(Expression::List(Vec::new())),
                });
            }
        }
    }

    fn region(&mut self, region: &Region, out: &mut Vec<Statement>) {
        for op in &region.ops {
            self.op(op, out);
        }
    }

    fn op(&mut self, op: &Op, out: &mut Vec<Statement>) {
        match &op.kind {
            OpKind::Constant(constant) => {
                self.values[op.results.get(0)] = Some(Expression::atom(literal(*constant)));
            }
            OpKind::If { condition, then, otherwise } => {
                self.branch(op.results, *condition, [then, otherwise], out);
            }
            OpKind::Loop { initial, body } => self.repeat(op.results, initial, body, out),
            OpKind::Load(variable, index) => {
                let value = self.load(*variable, *index, out);
                let is_local = self.function.variable(*variable).kind == VariableKind::Local;
                let result = op.results.get(0);
                // A later store must not affect the value.
                if is_local || self.is_output[*variable] {
                    self.define_now(result, value, out);
                } else {
                    self.define(result, value, out);
                }
            }
            OpKind::Store(variable, index, value) => {
                let value = self.value(*value);
                let target = self.element(*variable, *index, out).flat();
                out.push(Statement::Assign { target, value });
            }
            OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightCount
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand
            | OpKind::ReportBudget => self.request(op, out),
            OpKind::Report(..) => {}
            OpKind::Unary(..)
            | OpKind::Binary(..)
            | OpKind::Compare(..)
            | OpKind::Select(..)
            | OpKind::Fma(..)
            | OpKind::Convert(..)
            | OpKind::Bitcast(..)
            | OpKind::Length(_) => {
                let result = op.results.get(0);
                if self.uses.count(result) > 0 {
                    let value = self.expression(result, &op.kind, out);
                    self.define(result, value, out);
                }
            }
            OpKind::Query(..) => unreachable!("integrators are not written as C++"),
            OpKind::ReferenceCall(_)
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..)
            | OpKind::ReferenceCount(_)
            | OpKind::IsSet(..) => {
                unreachable!("linking has replaced what asks references")
            }
        }
    }

    /// Defines a value as an expression, written at its use or assigned to a variable.
    fn define(&mut self, result: Value, value: Expression, out: &mut Vec<Statement>) {
        if value.is_trivial() {
            self.values[result] = Some(value);
        } else if self.uses.nests(result) && !self.is_named(result) {
            self.values[result] = Some(value);
            self.pending.insert(result);
        } else {
            self.define_now(result, value, out);
        }
    }

    /// Defines a value as a variable.
    pub fn define_now(&mut self, result: Value, value: Expression, out: &mut Vec<Statement>) {
        self.pending.remove(&result);
        if self.uses.count(result) == 0 {
            return;
        }
        let name = self.name_of(result, &value);
        let type_name = type_name(self.function.scalar(result)).to_owned();
        self.values[result] = Some(Expression::atom(name.clone()));
        out.push(Statement::Define { is_constant: true, type_name, name, value: Some(value) });
    }

    /// Returns the expression of a value at its use.
    pub fn value(&mut self, value: Value) -> Expression {
        let written = match self.pending.remove(&value) {
            true => self.values[value].take(),
            false => self.values[value].clone(),
        };
        written.expect("values are defined before they are used, and pending ones used once")
    }

    /// Returns the expressions of the operands of one operation, nested up to the greatest size of an expression.
    pub fn operands<const N: usize>(
        &mut self,
        operands: [Value; N],
        out: &mut Vec<Statement>,
    ) -> [Expression; N] {
        let size =
            |writer: &Self, value: Value| writer.values[value].as_ref().map_or(0, Expression::size);
        while operands.iter().map(|value| size(self, *value)).sum::<usize>() >= LARGEST_EXPRESSION {
            let largest = operands.iter().copied().max_by_key(|value| size(self, *value));
            let largest = largest.expect("there are operands");
            let value = self.value(largest);
            self.define_now(largest, value, out);
        }
        operands.map(|value| self.value(value))
    }

    /// Returns a new name.
    pub fn new_name(&mut self, name: &str) -> String {
        self.scope.name(name)
    }

    /// True if the source declares a variable for the value, and no other value has that name.
    fn is_named(&self, value: Value) -> bool {
        !self.uses.is_assigned(value)
            && self.function.names.get(value).is_some_and(|name| name.rank < Name::DECLARED)
    }

    /// Returns the value's name in the source.
    fn hint(&self, value: Value) -> Option<String> {
        let names = &self.function.names;
        names.get(value).map(|name| names.written(name))
    }

    fn name_of(&mut self, result: Value, value: &Expression) -> String {
        let name =
            self.hint(result).unwrap_or_else(|| describe(value, self.function.scalar(result)));
        self.scope.name(&name)
    }

    fn branch(
        &mut self,
        results: Values,
        condition: Value,
        regions: [&Region; 2],
        out: &mut Vec<Statement>,
    ) {
        let condition = self.value(condition);
        let used: Vec<usize> = (0..results.count as usize)
            .filter(|it| self.uses.count(results.get(*it as u32)) > 0)
            .collect();
        let yields =
            regions.map(|region| used.iter().map(|it| region.yields[*it]).collect::<Vec<_>>());
        let targets: Vec<(Target, bool)> = used
            .iter()
            .enumerate()
            .map(|(position, index)| {
                let result = results.get(*index as u32);
                if let Some(target) = self.bound.remove(&result) {
                    self.flush(&target, out);
                    return (target, false);
                }
                let name = self.result_name(result, [yields[0][position], yields[1][position]]);
                (Target { name, variable: None }, true)
            })
            .collect();
        let mut blocks = [Vec::new(), Vec::new()];
        let mut values = [Vec::new(), Vec::new()];
        for ((region, yields), (block, values)) in
            regions.iter().zip(&yields).zip(blocks.iter_mut().zip(&mut values))
        {
            self.bind(region, yields, &targets);
            let names = self.scope.mark();
            self.region(region, block);
            for (value, (target, _)) in yields.iter().zip(&targets) {
                let value = self.value(*value);
                values.push((target.clone(), value));
            }
            self.scope.release(names);
        }
        for (result, (target, _)) in used.iter().zip(&targets) {
            let result = results.get(*result as u32);
            let (text, variable) = (target.name.clone(), target.variable);
            self.values[result] = Some(Expression::Atom { text, variable });
        }
        let scalars: Vec<Scalar> =
            used.iter().map(|it| self.function.scalar(results.get(*it as u32))).collect();
        self.write_branch(condition, &targets, blocks, values, &scalars, out);
    }

    fn write_branch(
        &mut self,
        mut condition: Expression,
        targets: &[(Target, bool)],
        mut blocks: [Vec<Statement>; 2],
        mut values: [Vec<(Target, Expression)>; 2],
        scalars: &[Scalar],
        out: &mut Vec<Statement>,
    ) {
        if blocks[0].is_empty() && !blocks[1].is_empty() {
            condition = condition.inverted();
            blocks.swap(0, 1);
            values.swap(0, 1);
        }
        if let ([(target, true)], true) = (targets, blocks.iter().all(Vec::is_empty)) {
            let [then, otherwise] = values.map(|mut values| values.remove(0).1);
            let (type_name, name) = (type_name(scalars[0]).to_owned(), target.name.clone());
            let value = Some(Expression::choice(condition, then, otherwise));
            out.push(Statement::Define { is_constant: true, type_name, name, value });
            return;
        }
        // If the second block contains only assignments they can come first, unless variables of loops are pending.
        let comes_first = blocks[1].is_empty();
        let [then_values, otherwise_values] = values;
        let mut left = Vec::new();
        for (((target, is_new), scalar), value) in targets.iter().zip(scalars).zip(otherwise_values)
        {
            let first = comes_first && target.variable.is_none();
            let type_name = type_name(*scalar).to_owned();
            let name = target.name.clone();
            match (is_new, first) {
                (true, _) => out.push(Statement::Define {
                    is_constant: false,
                    type_name,
                    name,
                    value: first.then(|| value.1.clone()),
                }),
                (false, true) => assign(&value.0, value.1.clone(), out),
                (false, false) => {}
            }
            if !first {
                left.push(value);
            }
        }
        let [mut then, mut otherwise] = blocks;
        self.assign_all(then_values, &mut then);
        self.assign_all(left, &mut otherwise);
        if then.is_empty() && otherwise.is_empty() {
            return;
        }
        if then.is_empty() {
            condition = condition.inverted();
            std::mem::swap(&mut then, &mut otherwise);
        }
        out.push(Statement::If { condition, then, otherwise });
    }

    /// Binds results of the region's own operations to the destinations of the region's yields, if the destination's
    /// previous value is not read afterwards.
    fn bind(&mut self, region: &Region, yields: &[Value], targets: &[(Target, bool)]) {
        for (value, (target, _)) in yields.iter().zip(targets) {
            if self.uses.count(*value) != 1 {
                continue;
            }
            let defining =
                region.ops.iter().position(|op| op.results.iter().any(|it| it == *value));
            let Some(defining) = defining else { continue };
            let fits = match (&region.ops[defining].kind, target.variable) {
                (OpKind::If { .. }, None) => true,
                (OpKind::If { .. }, Some(variable)) => !is_used_after(region, defining, variable),
                _ => false,
            };
            if fits {
                self.bound.insert(*value, target.clone());
            }
        }
    }

    /// Assigns pending expressions that read a variable to variables, before it changes.
    fn flush(&mut self, target: &Target, out: &mut Vec<Statement>) {
        let Some(changing) = target.variable else { return };
        let reading: Vec<Value> = self
            .pending
            .iter()
            .copied()
            .filter(|value| {
                let written = self.values[*value].as_ref();
                written.is_some_and(|written| written.reads(&|it| it == changing))
            })
            .collect();
        for value in reading {
            let written = self.value(value);
            self.define_now(value, written, out);
        }
    }

    fn repeat(
        &mut self,
        results: Values,
        initial: &[Value],
        body: &Region,
        out: &mut Vec<Statement>,
    ) {
        let form = while_form(body);
        let next = form.as_ref().map_or(&body.yields[1..], |form| form.next);
        let mut targets = Vec::new();
        for (index, (param, first)) in body.params.iter().zip(initial).enumerate() {
            let result = results.get(index as u32);
            let value = self.value(*first);
            let name = self.result_name(*param, [result, next[index]]);
            let type_name = type_name(self.function.scalar(*param)).to_owned();
            let atom = Expression::Atom { text: name.clone(), variable: Some(*param) };
            self.values[*param] = Some(atom.clone());
            self.values[result] = Some(atom);
            out.push(Statement::Define {
                is_constant: false,
                type_name,
                name: name.clone(),
                value: Some(value),
            });
            targets.push((Target { name, variable: Some(*param) }, false));
        }
        match form {
            Some(form) => self.rounds_while(&form, &targets, out),
            None => self.rounds(body, &targets, out),
        }
    }

    /// Translates a loop that tests before each iteration.
    fn rounds_while(
        &mut self,
        form: &WhileForm<'_>,
        targets: &[(Target, bool)],
        out: &mut Vec<Statement>,
    ) {
        let names = self.scope.mark();
        let mut block = Vec::new();
        form.head.iter().for_each(|op| self.op(op, &mut block));
        let condition = self.value(form.condition);
        let is_simple = block.is_empty();
        if !is_simple {
            block.push(Statement::BreakIf(condition.clone().inverted()));
        }
        self.bind(form.round, form.next, targets);
        self.region(form.round, &mut block);
        let next = self.next_values(form.next, targets);
        self.assign_all(next, &mut block);
        self.scope.release(names);
        out.push(match is_simple {
            true => Statement::While(condition, block),
            false => Statement::Repeat(block),
        });
    }

    /// Assigns the next values of a loop's variables.
    fn next_values(
        &mut self,
        next: &[Value],
        targets: &[(Target, bool)],
    ) -> Vec<(Target, Expression)> {
        next.iter()
            .zip(targets)
            .map(|(value, (target, _))| (target.clone(), self.value(*value)))
            .filter(|(target, value)| !is_itself(target, value))
            .collect()
    }

    /// Translates a loop that tests after each iteration.
    fn rounds(&mut self, body: &Region, targets: &[(Target, bool)], out: &mut Vec<Statement>) {
        let mut block = Vec::new();
        let (again, next) = body.yields.split_first().expect("a loop's body yields a bool");
        let names = self.scope.mark();
        self.bind(body, next, targets);
        self.region(body, &mut block);
        let mut again = self.value(*again);
        let next = self.next_values(next, targets);
        let changes = |value: Value| next.iter().any(|(target, _)| target.variable == Some(value));
        if again.reads(&changes) {
            let name = self.scope.name("again");
            let (type_name, value) = ("bool".to_owned(), Some(again));
            block.push(Statement::Define {
                is_constant: true,
                type_name,
                name: name.clone(),
                value,
            });
            again = Expression::atom(name);
        }
        self.assign_all(next, &mut block);
        self.scope.release(names);
        block.push(Statement::BreakIf(again.inverted()));
        out.push(Statement::Repeat(block));
    }

    /// Emits assignments with the effect of simultaneous ones.
    fn assign_all(&mut self, mut left: Vec<(Target, Expression)>, out: &mut Vec<Statement>) {
        left.retain(|(target, value)| !is_itself(target, value));
        while !left.is_empty() {
            // One whose target no other assignment still reads.
            let free = (0..left.len()).find(|index| {
                let Some(variable) = left[*index].0.variable else { return true };
                let others = left.iter().enumerate().filter(|(other, _)| other != index);
                others.into_iter().all(|(_, (_, value))| !value.reads(&|it| it == variable))
            });
            match free {
                Some(index) => {
                    let (target, value) = left.remove(index);
                    assign(&target, value, out);
                }
                None => {
                    let (target, value) = &mut left[0];
                    let name = self.scope.name(&format!("next_{}", target.name));
                    let scalar = self.function.scalar(target.variable.expect("others are free"));
                    let value = std::mem::replace(value, Expression::atom(name.clone()));
                    let type_name = type_name(scalar).to_owned();
                    out.push(Statement::Define {
                        is_constant: true,
                        type_name,
                        name,
                        value: Some(value),
                    });
                }
            }
        }
    }

    fn result_name(&mut self, result: Value, others: [Value; 2]) -> String {
        let hint = self.hint(result).or_else(|| others.into_iter().find_map(|it| self.hint(it)));
        let name = hint.or_else(|| self.output_name(result)).unwrap_or_else(|| "result".to_owned());
        self.scope.name(&name)
    }

    /// Returns the name of a value that is an output.
    fn output_name(&self, value: Value) -> Option<String> {
        let index = self.function.body.yields.iter().position(|it| *it == value)?;
        let output = self.function.outputs[index];
        let variable = self.function.variable(output.variable);
        Some(component_name(&variable.name, output.component, variable.len))
    }

    /// Stores the outputs; returns true if the method returns whether a hit was accepted.
    fn outputs(&mut self, out: &mut Vec<Statement>) -> bool {
        let kind = |variable: VariableId| self.function.variable(variable).kind;
        let outputs = self.function.outputs.iter().copied().zip(&self.function.body.yields);
        let (accepted, stored): (Vec<_>, Vec<_>) =
            outputs.partition(|(output, _)| kind(output.variable) == VariableKind::Accepted);
        let mut stores = Vec::new();
        for (output, value) in stored {
            let variable = self.function.variable(output.variable);
            let mut value = self.value(*value);
            if variable.kind == VariableKind::Member && variable.scalar == Scalar::Bool {
                value = Expression::call("uint32_t", [value]);
            }
            let target = indexed(
                &self.variables[output.variable.0 as usize],
                output.component,
                variable.len,
            );
            stores.push(Statement::Assign { target, value });
        }
        let Some((_, accepted)) = accepted.first() else {
            out.append(&mut stores);
            return false;
        };
        let accepted = self.value(**accepted);
        if !stores.is_empty() {
            let accepted = match accepted {
                atom @ Expression::Atom { .. } => atom,
                other => {
                    let name = self.scope.name("accepted");
                    let type_name = "bool".to_owned();
                    out.push(Statement::Define {
                        is_constant: true,
                        type_name,
                        name: name.clone(),
                        value: Some(other),
                    });
                    Expression::atom(name)
                }
            };
            out.push(Statement::If {
                condition: accepted.clone(),
                then: stores,
                otherwise: Vec::new(),
            });
            out.push(Statement::Return(accepted));
        } else {
            out.push(Statement::Return(accepted));
        }
        true
    }

    /// Sets the expression of a value.
    pub fn set_value(&mut self, value: Value, written: Expression) {
        self.values[value] = Some(written);
    }

    /// Returns a new name for an answer of the host.
    pub fn answer_name(&mut self, name: &str, result: Value) -> String {
        let hint = self.hint(result);
        self.scope.name(hint.as_deref().unwrap_or(name))
    }

    pub fn variable_text(&self, variable: VariableId) -> &str {
        &self.variables[variable.0 as usize]
    }
}

fn assign(target: &Target, value: Expression, out: &mut Vec<Statement>) {
    if !is_itself(target, &value) {
        out.push(Statement::Assign { target: target.name.clone(), value });
    }
}

fn is_itself(target: &Target, value: &Expression) -> bool {
    matches!(value, Expression::Atom { text, .. } if *text == target.name)
}

/// True if an operation of the region after `position` uses the value.
fn is_used_after(region: &Region, position: usize, value: Value) -> bool {
    let mut used = region.yields.contains(&value);
    for op in &region.ops[position + 1..] {
        op.kind.for_each_operand(|it| used |= it == value);
        for inner in op.kind.regions() {
            inner.for_each_use(&mut |it| used |= it == value);
        }
    }
    used
}

/// Returns `name`, or an element of it.
pub(crate) fn indexed(name: &str, index: u32, len: u32) -> String {
    if len == 1 { name.to_owned() } else { format!("{name}[{index}]") }
}

/// Returns the name of a component of a variable with `len` components.
pub(crate) fn component_name(name: &str, component: u32, len: u32) -> String {
    match (len, component) {
        (1, _) => name.to_owned(),
        (2..=4, 0..=3) => format!("{name}.{}", ["x", "y", "z", "w"][component as usize]),
        _ => format!("{name}.{component}"),
    }
}

/// Returns a name for the result of an expression.
fn describe(value: &Expression, scalar: Scalar) -> String {
    let name = match value {
        Expression::Atom { text, .. } => text.rsplit(['.', ' ']).next().unwrap_or("value"),
        Expression::Unary(..) if scalar == Scalar::Bool => "is_not",
        Expression::Unary(..) => "negative",
        Expression::Binary(operator, ..) => match operator.text {
            "*" => "product",
            "/" => "ratio",
            "+" => "sum",
            "-" => "difference",
            "<" | "<=" => "is_less",
            ">" | ">=" => "is_greater",
            "==" => "is_equal",
            "!=" => "differs",
            "&&" => "both",
            "||" => "either",
            _ => "bits",
        },
        Expression::Choice(..) => "chosen",
        Expression::Call(callee, _) => match callee.as_str() {
            "std::fma" | "fused" | "wrapping_add" => "sum",
            "std::sqrt" => "root",
            "std::fabs" | "wrapping_abs" => "magnitude",
            "std::floor" | "std::ceil" | "std::trunc" | "std::nearbyint" => "whole",
            "minimum" => "least",
            "maximum" => "greatest",
            "rounded" | "wrapping_multiply" => "product",
            "bits_of" => "bits",
            "wrapping_subtract" => "difference",
            _ => "value",
        },
        Expression::List(_) => "list",
        Expression::Element(array, _) => array.rsplit('.').next().unwrap_or("element"),
    };
    let name = name.split('[').next().unwrap_or("value");
    name.to_owned()
}
