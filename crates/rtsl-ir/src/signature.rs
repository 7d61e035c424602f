//! The result types of operations.

use rtsl_spec::COLOR_COMPONENTS;

use crate::{Function, OpKind, Scalar};

impl OpKind {
    /// Appends the types of the operation's results to `scalars`, from its kind and its operands' types. For an `if`
    /// these are the types of the values that the first region yields.
    pub fn result_scalars(&self, function: &Function, scalars: &mut Vec<Scalar>) {
        match self {
            OpKind::Constant(constant) => scalars.push(constant.scalar()),
            OpKind::Unary(_, a) | OpKind::Binary(_, a, _) | OpKind::Select(_, a, _) => {
                scalars.push(function.scalar(*a));
            }
            OpKind::Compare(..) | OpKind::Occluded { .. } | OpKind::IsSet(..) => {
                scalars.push(Scalar::Bool);
            }
            OpKind::Convert(to, _) | OpKind::Bitcast(to, _) => scalars.push(*to),
            OpKind::Load(variable, _) => scalars.push(function.variable(*variable).scalar),
            OpKind::Store(..) | OpKind::ReportBudget | OpKind::Report(..) => {}
            OpKind::Length(_) | OpKind::LightCount | OpKind::ReferenceCount(_) => {
                scalars.push(Scalar::I32);
            }
            OpKind::If { then, .. } => {
                scalars.extend(then.yields.iter().map(|value| function.scalar(*value)));
            }
            OpKind::Loop { initial, .. } => {
                scalars.extend(initial.iter().map(|value| function.scalar(*value)));
            }
            OpKind::Fma(..)
            | OpKind::Rand
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..) => scalars.push(Scalar::F32),
            OpKind::Trace { .. } | OpKind::Ambient => {
                scalars.extend([Scalar::F32; COLOR_COMPONENTS as usize]);
            }
            OpKind::LightSample { .. } => {
                scalars.push(Scalar::Bool);
                scalars.extend([Scalar::F32; LIGHT_SAMPLE_FLOATS]);
            }
            OpKind::Query(query, _) => scalars.extend(query.result_scalars()),
            OpKind::ReferenceCall(call) => {
                scalars.extend(call.results.iter().map(|_| Scalar::F32));
            }
        }
    }
}

/// The results of a light sample after the first: direction, distance, colour, density.
const LIGHT_SAMPLE_FLOATS: usize = 3 + 1 + COLOR_COMPONENTS as usize + 1;
