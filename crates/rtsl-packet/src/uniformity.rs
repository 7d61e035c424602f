//! Uniformity analysis: finds the values that vary from ray to ray.
//!
//! A forward analysis over the structured code, to a fixpoint for loops and locals. A value varies if it comes from a
//! varying variable, operand or control flow:
//! - the results of an `if` whose condition varies, unless both sides yield the same value;
//! - the results of a loop that rays leave at different times. The carried values inside may be uniform, since all rays
//!   still in the loop have made the same number of iterations;
//! - the content of a local, if the value, index or condition of any store varies.

use rtsl_ir::{Function, Index, IndexVec, Op, OpKind, ReferencePath, Region, Value, VariableId};

use crate::kernel::KernelVariable;

/// The result of the analysis.
#[derive(Clone, Debug)]
pub struct Uniformity {
    values: IndexVec<Value, bool>,
    variables: IndexVec<VariableId, bool>,
}

impl Uniformity {
    /// Analyses `function` for calls in which the variables, in the function's order, vary as their `varies` flag gives
    /// it. For locals the flag is the initial assumption.
    pub fn new(function: &Function, variables: &[KernelVariable]) -> Uniformity {
        let mut analysis = Analysis {
            result: Uniformity {
                values: IndexVec::filled(function.values.len(), false),
                variables: variables.iter().map(|variable| variable.varies).collect(),
            },
            changed: true,
        };
        // Values only change from uniform to varying, so this terminates. Without locals one iteration suffices; with
        // them another is needed if a load precedes the store in a loop.
        while std::mem::take(&mut analysis.changed) {
            analysis.region(&function.body, false);
        }
        analysis.result
    }

    /// True if `value` may differ from ray to ray.
    pub fn varies(&self, value: Value) -> bool {
        self.values[value]
    }

    /// True if the content of the variable may differ from ray to ray.
    pub fn variable_varies(&self, variable: VariableId) -> bool {
        self.variables[variable]
    }
}

struct Analysis {
    result: Uniformity,
    changed: bool,
}

impl Analysis {
    /// Analyses a region. `diverged` is true if only some of the rays may execute it.
    fn region(&mut self, region: &Region, diverged: bool) {
        for op in &region.ops {
            self.op(op, diverged);
        }
    }

    fn op(&mut self, op: &Op, diverged: bool) {
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                let diverges = self.result.varies(*condition);
                self.region(then, diverged || diverges);
                self.region(otherwise, diverged || diverges);
                let sides = then.yields.iter().zip(&otherwise.yields);
                for (result, (then, otherwise)) in op.results.iter().zip(sides) {
                    let differ = diverges && then != otherwise;
                    self.join(result, differ || self.any(&[*then, *otherwise]));
                }
            }
            OpKind::Loop { initial, body } => self.run_loop(op, initial, body, diverged),
            OpKind::Store(variable, index, value) => {
                if diverged || self.index_varies(*index) || self.result.varies(*value) {
                    self.changed |= !self.result.variables[*variable];
                    self.result.variables[*variable] = true;
                }
            }
            kind => {
                let varies = self.varies_by_operands(kind);
                op.results.iter().for_each(|result| self.join(result, varies));
            }
        }
    }

    fn run_loop(&mut self, op: &Op, initial: &[Value], body: &Region, diverged: bool) {
        for (param, initial) in body.params.iter().zip(initial) {
            self.join(*param, self.result.varies(*initial));
        }
        let Some((again, next)) = body.yields.split_first() else { return };
        loop {
            let before = std::mem::take(&mut self.changed);
            let diverges = self.result.varies(*again);
            self.region(body, diverged || diverges);
            for (param, next) in body.params.iter().zip(next) {
                self.join(*param, self.result.varies(*next));
            }
            let settled = !std::mem::replace(&mut self.changed, before);
            if settled {
                break;
            }
            self.changed = true;
        }
        let diverges = self.result.varies(*again);
        for (result, next) in op.results.iter().zip(next) {
            self.join(result, diverges || self.result.varies(*next));
        }
    }

    fn varies_by_operands(&self, kind: &OpKind) -> bool {
        match kind {
            OpKind::Constant(_)
            | OpKind::LightCount
            | OpKind::Ambient
            | OpKind::ReportBudget
            | OpKind::Report(..) => false,
            OpKind::Unary(_, a) | OpKind::Convert(_, a) | OpKind::Bitcast(_, a) => self.any(&[*a]),
            OpKind::Binary(_, a, b) | OpKind::Compare(_, a, b) => self.any(&[*a, *b]),
            OpKind::Select(a, b, c) | OpKind::Fma(a, b, c) => self.any(&[*a, *b, *c]),
            OpKind::Load(variable, index) => {
                self.result.variable_varies(*variable) || self.index_varies(*index)
            }
            OpKind::Length(variable) => self.result.variable_varies(*variable),
            // Linking has replaced them.
            OpKind::Seed(_) | OpKind::Derivative(..) | OpKind::ChainRule(..) => true,
            OpKind::IsSet(_, ReferencePath::Single) | OpKind::ReferenceCount(_) => false,
            OpKind::IsSet(_, ReferencePath::Element(index)) => self.any(&[*index]),
            OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightSample { .. }
            | OpKind::Rand
            | OpKind::ReferenceCall(_) => true,
            OpKind::Query(query, _) => !query.is_uniform(),
            OpKind::If { .. } | OpKind::Loop { .. } | OpKind::Store(..) => {
                unreachable!("handled where operations are told apart")
            }
        }
    }

    fn any(&self, values: &[Value]) -> bool {
        values.iter().any(|value| self.result.varies(*value))
    }

    fn index_varies(&self, index: Index) -> bool {
        match index {
            Index::Constant(_) => false,
            Index::Dynamic(value) => self.result.varies(value),
        }
    }

    fn join(&mut self, value: Value, varies: bool) {
        let known = &mut self.result.values[value];
        self.changed |= varies && !*known;
        *known |= varies;
    }
}
