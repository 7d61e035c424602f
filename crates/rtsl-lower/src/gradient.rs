//! Derivatives: `gradient(value, variable)`.
//!
//! The variable becomes a seed while the value is lowered, and the derivatives of the value's scalars are taken with
//! respect to it. Linking computes them, so that those of called textures are exact. Functions of the prelude that
//! compute with the bits of their arguments get their derivatives from other functions of the prelude.

use rtsl_ir::{OpKind, Value};
use rtsl_sema::hir::{Expression, ExpressionKind, FunctionId, Type};
use rtsl_source::Span;

use crate::Lowering;
use crate::calls::{Argument, Returned, find_function};
use crate::cells::Cell;
use crate::limits::Lowered;
use crate::variables::{RANK_OF_DATA, SourceVariable, SourceVariableId, Storage};

/// The beginning of the names of the prelude's functions that give derivatives.
pub(crate) const DERIVATIVES: &str = "rt_derivativeOf";

/// The functions whose derivatives the prelude has, with the functions that give them.
const CHAIN_RULES: [(&str, &str); 17] = [
    ("sin", "rt_derivativeOfSin"),
    ("cos", "rt_derivativeOfCos"),
    ("tan", "rt_derivativeOfTan"),
    ("asin", "rt_derivativeOfAsin"),
    ("acos", "rt_derivativeOfAcos"),
    ("atan", "rt_derivativeOfAtan"),
    ("sinh", "rt_derivativeOfSinh"),
    ("cosh", "rt_derivativeOfCosh"),
    ("tanh", "rt_derivativeOfTanh"),
    ("asinh", "rt_derivativeOfAsinh"),
    ("acosh", "rt_derivativeOfAcosh"),
    ("atanh", "rt_derivativeOfAtanh"),
    ("exp", "rt_derivativeOfExp"),
    ("exp2", "rt_derivativeOfExp2"),
    ("log", "rt_derivativeOfLog"),
    ("log2", "rt_derivativeOfLog2"),
    ("pow", "rt_derivativeOfPow"),
];

impl<'m> Lowering<'m> {
    /// Lowers `gradient(value, variable)`: for a number, its derivatives by the variable's components; for a vector, the
    /// derivatives of its components by a number.
    pub fn lower_gradient(
        &mut self,
        arguments: &'m [Expression],
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let [value, variable] = arguments else { return Ok(Vec::new()) };
        let (seeds, values) = match variable.kind {
            ExpressionKind::Local(id) => {
                let variable = self.local_variable(id, span)?;
                self.lower_with_seeds(variable, value)?
            }
            ExpressionKind::State(id) => {
                // Variables that are only read have no cells that could hold the seeds.
                let variable = self.state_variable(id, span)?;
                let seeded = self.in_cells(variable)?;
                self.states.insert(id, seeded);
                let lowered = self.lower_with_seeds(seeded, value);
                self.states.insert(id, variable);
                lowered?
            }
            _ => return Ok(Vec::new()),
        };
        let pairs = values.iter().flat_map(|of| seeds.iter().map(|by| (*of, *by)));
        Ok(pairs.map(|(of, by)| self.builder.emit(OpKind::Derivative(of, by))).collect())
    }

    /// Lowers a value while the scalars of a variable are seeds. Returns the seeds and the value's scalars.
    fn lower_with_seeds(
        &mut self,
        variable: SourceVariableId,
        value: &'m Expression,
    ) -> Lowered<(Vec<Value>, Vec<Value>)> {
        let before = self.get_variable(variable)?;
        let seeds = before.iter().map(|it| self.builder.emit(OpKind::Seed(*it)));
        let seeds: Vec<Value> = seeds.collect();
        self.set_variable(variable, &seeds);
        let values = self.at_order(self.order + 1, |it| it.lower_expression(value))?;
        self.set_variable(variable, &before);
        Ok((seeds, values))
    }

    /// Returns a variable in cells with the values of this one, or this one if it is in cells.
    pub fn in_cells(&mut self, id: SourceVariableId) -> Lowered<SourceVariableId> {
        if matches!(self.variable(id).storage, Storage::Cells(_)) {
            return Ok(id);
        }
        let values = self.get_variable(id)?;
        let SourceVariable { name, layout, .. } = self.variable(id).clone();
        let names = self.scalar_names(&name, &layout, RANK_OF_DATA);
        let storage = Storage::Cells(Cell(self.cells.allocate_named(values, names).start));
        Ok(self.add_variable(SourceVariable { name, layout, storage, default: None, input: None }))
    }

    /// Returns the function that gives the derivatives of another, where derivatives may be taken.
    pub fn chain_rule_of(&self, id: FunctionId) -> Option<FunctionId> {
        if self.order == 0 {
            return None;
        }
        let function = self.function(id);
        let (_, rule) = CHAIN_RULES.iter().find(|(name, _)| *name == function.name)?;
        let float = Type::Scalar(rtsl_ir::Scalar::F32);
        let parameters = &function.locals[..function.parameters.len()];
        let is_scalar = function.result == float && parameters.iter().all(|it| it.ty == float);
        let types: Vec<Type> = parameters.iter().map(|local| local.ty.clone()).collect();
        if is_scalar { find_function(self.module, rule, &types) } else { None }
    }

    /// Lowers a call of a function of numbers, with its derivatives if it has a rule.
    pub fn call_with_chain_rule(
        &mut self,
        id: FunctionId,
        arguments: Vec<Value>,
        span: Span,
    ) -> Lowered<Returned> {
        let values = |of: &[Value]| of.iter().map(|it| Argument::Values(vec![*it])).collect();
        let Some(rule) = self.chain_rule_of(id) else {
            return self.call(id, values(&arguments), span);
        };
        let mut returned = self.at_order(0, |it| it.call(id, values(&arguments), span))?;
        let factors =
            self.at_order(self.order - 1, |it| it.call(rule, values(&arguments), span))?;
        let factors = arguments.into_iter().zip(factors.result).collect();
        if let [value] = &mut *returned.result {
            *value = self.builder.emit(OpKind::ChainRule(*value, factors));
        }
        Ok(returned)
    }

    /// Does `work` where derivatives of this order may be taken.
    fn at_order<T>(&mut self, order: u32, work: impl FnOnce(&mut Self) -> T) -> T {
        let outer = std::mem::replace(&mut self.order, order);
        let result = work(self);
        self.order = outer;
        result
    }
}
