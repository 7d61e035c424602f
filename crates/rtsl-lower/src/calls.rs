//! Calls, which are inlined.

use std::ops::Range;

use rtsl_ir::Value;
use rtsl_sema::hir::{Expression, Function, FunctionId, LocalId, Module, Passing, Type};
use rtsl_source::Span;

use crate::Lowering;
use crate::access::Access;
use crate::cells::Cell;
use crate::class::is_buffer;
use crate::facts::Root;
use crate::gradient::DERIVATIVES;
use crate::limits::{self, Lowered};
use crate::references::ReferencePlace;
use crate::variables::{RANK_OF_PARAMETERS, SourceVariableId};

/// One call whose body is being lowered.
#[derive(Clone, Debug)]
pub(crate) struct Frame<'m> {
    pub id: Option<FunctionId>,
    pub function: Option<&'m Function>,
    /// The variables of the locals; each is created at its declaration.
    pub locals: Vec<Option<SourceVariableId>>,
    /// The references that parameters stand for.
    pub references: Vec<(LocalId, ReferencePlace)>,
    pub result: Option<SourceVariableId>,
    /// The flag of `return`.
    pub returned: Cell,
    /// The flags of the innermost loop or `switch`.
    pub jumps: Option<Jumps>,
    /// The number of calls around it.
    pub calls: u32,
    /// The bytes of the text in which each local is visible, for traces.
    pub extents: Vec<Range<u32>>,
    /// The end of the statements around the one that is being lowered, for traces.
    pub scope_end: u32,
}

impl Frame<'_> {
    /// The rank of the names of its variables, at most half of [`RANK_OF_PARAMETERS`]. Deeper calls
    /// have greater ranks, because their names are less informative: of two names, a value keeps
    /// the one of lesser rank.
    fn rank(&self) -> u8 {
        self.calls.min(u32::from(RANK_OF_PARAMETERS / 2)) as u8
    }
}

/// The flags of a loop or `switch`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jumps {
    pub broke: Cell,
    /// `None` in a `switch` outside loops.
    pub continued: Option<Cell>,
}

/// The initial content of a parameter.
pub(crate) enum Argument {
    Values(Vec<Value>),
    /// A variable in host memory that neither side writes. The parameter becomes an alias of it, so
    /// that large tables are not copied.
    Shared(SourceVariableId),
    /// A reference of the class. Calls through the parameter are calls through it.
    Reference(ReferencePlace),
}

/// For each parameter, the destination that it is copied out to.
pub(crate) type Targets = Vec<Option<Access>>;

/// The results of a call.
pub(crate) struct Returned {
    pub result: Vec<Value>,
    /// For each `out` parameter, its final value.
    pub outputs: Vec<Option<Vec<Value>>>,
}

impl<'m> Lowering<'m> {
    /// Lowers a call.
    pub fn lower_call(
        &mut self,
        id: FunctionId,
        arguments: &'m [Expression],
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let bound = self.bound_arguments(id, arguments)?;
        let (values, targets) = self.lower_arguments(id, arguments, &bound)?;
        let values = values.into_iter().zip(bound);
        let values = values.map(|(values, bound)| bound.unwrap_or(Argument::Values(values)));
        let returned = self.call(id, values.collect(), span)?;
        self.copy_out(targets, returned.outputs, arguments)?;
        Ok(returned.result)
    }

    /// For each argument, what the parameter can be an alias of: a variable, or a reference.
    fn bound_arguments(
        &mut self,
        id: FunctionId,
        arguments: &'m [Expression],
    ) -> Lowered<Vec<Option<Argument>>> {
        let facts = self.facts.of(id);
        let mut bound = Vec::with_capacity(arguments.len());
        for (local, argument) in (0..).map(LocalId).zip(arguments) {
            if matches!(argument.ty, Type::Reference(_)) {
                bound.push(Some(Argument::Reference(self.lower_reference(argument)?)));
                continue;
            }
            let wanted = is_buffer(&argument.ty)
                || facts.indexed.contains(&Root::Local(local))
                    && !facts.written_locals.contains(&local)
                    && self.function(id).parameters[local.0 as usize] == Passing::In;
            let shared = if wanted { self.host_variable_of(argument)? } else { None };
            bound.push(shared.map(Argument::Shared));
        }
        Ok(bound)
    }

    /// The values of the arguments except bound ones, and the destinations of those that are
    /// copied out.
    pub fn lower_arguments(
        &mut self,
        id: FunctionId,
        arguments: &'m [Expression],
        bound: &[Option<Argument>],
    ) -> Lowered<(Vec<Vec<Value>>, Targets)> {
        let function = self.function(id);
        let mut values = Vec::with_capacity(arguments.len());
        let mut targets = Vec::with_capacity(arguments.len());
        for (index, argument) in arguments.iter().enumerate() {
            if bound.get(index).is_some_and(Option::is_some) {
                values.push(Vec::new());
                targets.push(None);
                continue;
            }
            let passing = function.parameters[index];
            let target = match passing {
                Passing::In => None,
                Passing::Out | Passing::InOut => self.lower_access(argument)?,
            };
            values.push(match (passing, &target) {
                (Passing::In, _) => self.lower_expression(argument)?,
                (Passing::InOut, Some(target)) => self.read(target)?,
                (Passing::Out | Passing::InOut, _) => {
                    self.zeros_of_parameter(&function.locals[index].ty, argument)?
                }
            });
            targets.push(target);
        }
        Ok((values, targets))
    }

    /// The initial value of an `out` parameter: zeros. A scalar parameter that is applied to each
    /// component of a vector has as many zeros as components.
    fn zeros_of_parameter(
        &mut self,
        parameter: &Type,
        argument: &Expression,
    ) -> Lowered<Vec<Value>> {
        let layout = self.layouts.layout(parameter, argument.span)?;
        let count = self.layouts.layout(&argument.ty, argument.span)?.len() as usize;
        let zeros = self.zeros(&layout);
        Ok(if zeros.len() == count { zeros } else { vec![zeros[0]; count] })
    }

    /// Writes the final values of `out` parameters from left to right, converted to the types of
    /// their destinations.
    pub fn copy_out(
        &mut self,
        targets: Targets,
        outputs: Vec<Option<Vec<Value>>>,
        arguments: &[Expression],
    ) -> Lowered<()> {
        for ((target, output), argument) in targets.into_iter().zip(outputs).zip(arguments) {
            if let (Some(target), Some(output)) = (target, output) {
                let layout = self.layouts.layout(&target.ty, target.span)?;
                let scalars = layout.scalars().zip(output);
                let output: Vec<Value> =
                    scalars.map(|(scalar, value)| self.builder.convert(scalar, value)).collect();
                self.write(&target, &output)?;
                self.report_assignment(argument, &output);
            }
        }
        Ok(())
    }

    /// Inlines the function's body for these arguments.
    pub fn call(
        &mut self,
        id: FunctionId,
        arguments: Vec<Argument>,
        span: Span,
    ) -> Lowered<Returned> {
        self.enter(span)?;
        let frame = self.new_frame(id, span)?;
        let caller = std::mem::replace(&mut self.frame, frame);
        let function = self.function(id);
        for (local, argument) in (0..).map(LocalId).zip(arguments) {
            match argument {
                Argument::Values(values) => {
                    let variable = self.local_variable(local, span)?;
                    self.set_variable(variable, &values);
                }
                Argument::Shared(variable) => {
                    self.frame.locals[local.0 as usize] = Some(variable);
                }
                Argument::Reference(place) => self.frame.references.push((local, place)),
            }
        }
        self.report_enter(function, span);
        self.lower_list(&function.body)?;
        self.report_step(function.end);
        let returned = self.leave_frame(function)?;
        self.report_leave(function, &returned.result);
        let callee = std::mem::replace(&mut self.frame, caller);
        self.release_locals(callee.locals.into_iter().flatten().chain(callee.result));
        self.leave();
        Ok(returned)
    }

    /// Returns what a call gives its caller.
    pub fn leave_frame(&mut self, function: &Function) -> Lowered<Returned> {
        let result = match self.frame.result {
            Some(result) => self.get_variable(result)?,
            None => Vec::new(),
        };
        let mut outputs = Vec::with_capacity(function.parameters.len());
        for (index, passing) in function.parameters.iter().enumerate() {
            outputs.push(match (passing, self.frame.locals[index]) {
                (Passing::Out | Passing::InOut, Some(local)) => Some(self.get_variable(local)?),
                (Passing::In, _) | (_, None) => None,
            });
        }
        Ok(Returned { result, outputs })
    }

    /// Creates a frame for a call of this function.
    pub fn new_frame(&mut self, id: FunctionId, span: Span) -> Lowered<Frame<'m>> {
        let function = self.function(id);
        let result = match &function.result {
            Type::Void => None,
            ty => {
                let rank = RANK_OF_PARAMETERS + self.frame.rank() + 1;
                let result = self.new_variable(&function.name, ty, false, rank, span)?;
                let zeros = self.variable(result).layout.clone();
                let zeros = self.zeros(&zeros);
                self.set_variable(result, &zeros);
                Some(result)
            }
        };
        Ok(Frame {
            id: Some(id),
            function: Some(function),
            locals: vec![None; function.locals.len()],
            references: Vec::new(),
            result,
            returned: self.new_flag(),
            jumps: None,
            calls: self.frame.calls + 1,
            extents: vec![function.span.start..function.end.end; function.locals.len()],
            scope_end: function.end.end,
        })
    }

    /// The variable of a local of the current call.
    pub fn local_variable(&mut self, id: LocalId, span: Span) -> Lowered<SourceVariableId> {
        let index = id.0 as usize;
        if let Some(made) = self.frame.locals[index] {
            return Ok(made);
        }
        let (Some(function), Some(function_id)) = (self.frame.function, self.frame.id) else {
            unreachable!("only functions have locals")
        };
        let local = &function.locals[index];
        let indexed = self.facts.of(function_id).indexed.contains(&Root::Local(id));
        let is_parameter = index < function.parameters.len();
        let rank = self.frame.rank() + if is_parameter { RANK_OF_PARAMETERS } else { 0 };
        let variable = self.new_variable(&local.name, &local.ty, indexed, rank, span)?;
        self.frame.locals[index] = Some(variable);
        Ok(variable)
    }

    /// True if a local of the current call contributes to a `precise` one.
    pub fn is_precise(&self, id: LocalId) -> bool {
        self.frame.id.is_some_and(|function| self.facts.of(function).precise.contains(&id))
    }

    /// Inlines the prelude's function with this name and these parameters.
    ///
    /// # Panics
    /// If there is none: the prelude contains every function that the table of state variables
    /// needs.
    pub fn call_prelude(
        &mut self,
        name: &'static str,
        parameters: &[Type],
        arguments: Vec<Vec<Value>>,
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let function = find_function(self.module, name, parameters);
        let id = function.unwrap_or_else(|| panic!("the prelude has {name}"));
        let arguments = arguments.into_iter().map(Argument::Values).collect();
        Ok(self.call(id, arguments, span)?.result)
    }

    pub fn function(&self, id: FunctionId) -> &'m Function {
        &self.module.functions[id.0 as usize]
    }

    /// Counts a visit of a statement, expression or call, nested in those that are being visited.
    pub fn enter(&mut self, span: Span) -> Lowered<()> {
        self.visits += 1;
        self.depth += 1;
        if self.depth > limits::nested_visits() {
            return Err(limits::nested_too_deeply(span));
        }
        let size = self.builder.value_count().max(self.cells.len() / 4);
        self.enter_place(span);
        if self.visits > limits::VISITS_OF_A_FUNCTION || size > limits::VALUES_OF_A_FUNCTION {
            return Err(limits::too_much_code(span, &self.builder.function().name));
        }
        Ok(())
    }

    /// Ends a visit.
    pub fn leave(&mut self) {
        self.depth -= 1;
        self.leave_place();
    }
}

/// The functions of the prelude that [`Lowering::call_prelude`] is used with, and those that give derivatives.
/// Computed defaults, cones of light and `inside` need them even if the text calls none.
pub(crate) fn implicit_functions(module: &Module) -> impl Iterator<Item = FunctionId> {
    const NAMES: [&str; 5] = ["cos", "cross", "dot", "luminance", "perpendicularTo"];
    let named = |function: &Function| {
        let name = function.name.as_str();
        function.class.is_none() && (NAMES.contains(&name) || name.starts_with(DERIVATIVES))
    };
    let functions = (0..).map(FunctionId).zip(&module.functions);
    functions.filter(move |(_, function)| named(function)).map(|(id, _)| id)
}

/// The function outside classes with this name and these parameters.
pub(crate) fn find_function(
    module: &Module,
    name: &str,
    parameters: &[Type],
) -> Option<FunctionId> {
    let found = module.functions.iter().position(|function| {
        function.class.is_none()
            && function.name == name
            && function.parameters.len() == parameters.len()
            && function.locals.iter().map(|local| &local.ty).zip(parameters).all(|(a, b)| a == b)
    });
    found.map(|index| FunctionId(index as u32))
}
