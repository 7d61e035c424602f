//! `illuminance`: a loop over the light samples of the call.
//!
//! The index counts from 0 in steps of 1 for every iteration of the body, so that it is uniform
//! over all rays that are still in the loop.

use rtsl_ir::{CompareOp, OpKind, Scalar, Value, ValueScope};
use rtsl_sema::hir::{Expression, Illuminance, Type};
use rtsl_source::Span;
use rtsl_spec::COLOR_COMPONENTS;

use crate::Lowering;
use crate::calls::Jumps;
use crate::cells::Cell;
use crate::facts::Root;
use crate::limits::Lowered;
use crate::state_table::{light_states, state_id};
use rtsl_sema::walk::Node;

/// The arguments of the light query.
struct Query {
    point: [Value; 3],
    normal: [Value; 3],
    cosine: Value,
}

impl<'m> Lowering<'m> {
    pub fn lower_illuminance(&mut self, illuminance: &'m Illuminance, span: Span) -> Lowered<()> {
        let query = self.lower_query(illuminance, span)?;
        let count = self.builder.push(OpKind::LightCount).get(0);
        let zero = self.builder.i32(0);
        let any = self.builder.compare(CompareOp::Greater, count, zero);

        let outer = self.frame.jumps;
        let jumps = Jumps { broke: self.new_flag(), continued: Some(self.new_flag()) };
        self.frame.jumps = Some(jumps);
        let index = self.new_cell(zero);
        let mut carried = self.carried_over_lights(illuminance);
        carried.push(index);
        self.lower_when(any, span, |lowering| {
            lowering.lower_repeat(&carried, span, |lowering| {
                let this = lowering.cells.get(index);
                lowering.clear(lowering.frame.returned);
                lowering.lower_light(illuminance, &query, this, span)?;
                let one = lowering.builder.i32(1);
                let next = lowering.builder.add(this, one);
                lowering.cells.set(index, next);
                let more = lowering.builder.compare(CompareOp::Less, next, count);
                let stopped = lowering.any_flag([lowering.frame.returned, jumps.broke]);
                let going = lowering.builder.not(stopped);
                Ok(lowering.both(more, going))
            })?;
            // The index is not read outside.
            lowering.cells.set(index, zero);
            Ok(())
        })?;
        self.frame.jumps = outer;
        Ok(())
    }

    fn lower_query(&mut self, illuminance: &'m Illuminance, span: Span) -> Lowered<Query> {
        let point = match &illuminance.point {
            Some(point) => self.lower_expression(point)?,
            None => {
                let point = self.state_variable(state_id("rt_HitPoint"), span)?;
                self.get_variable(point)?
            }
        };
        let (normal, cosine) = match &illuminance.cone {
            Some((axis, angle)) => self.lower_cone(axis, angle, span)?,
            None => {
                let zero = self.builder.f32(0.0);
                let one = self.builder.f32(1.0);
                (vec![zero, zero, one], self.builder.f32(f32::NEG_INFINITY))
            }
        };
        Ok(Query { point: vector(&point), normal: vector(&normal), cosine })
    }

    fn lower_cone(
        &mut self,
        axis: &'m Expression,
        angle: &'m Expression,
        span: Span,
    ) -> Lowered<(Vec<Value>, Value)> {
        let axis = self.lower_expression(axis)?;
        let angle = self.lower_expression(angle)?;
        let cosine = self.call_prelude("cos", &[Type::Scalar(Scalar::F32)], vec![angle], span)?;
        Ok((axis, cosine[0]))
    }

    /// The cells that the body changes, except those of the light's sample, which are restored
    /// afterwards.
    fn carried_over_lights(&self, illuminance: &Illuminance) -> Vec<Cell> {
        let nodes = illuminance.body.iter().map(Node::Statement).collect();
        let mut assigned = self.facts.assigned(self.module, nodes);
        for state in light_states() {
            assigned.roots.remove(&Root::State(state));
        }
        self.cells_changed_by(&assigned)
    }

    /// Lowers the body for one light, executed if its sample reaches the point.
    fn lower_light(
        &mut self,
        illuminance: &'m Illuminance,
        query: &Query,
        index: Value,
        span: Span,
    ) -> Lowered<()> {
        let Query { point, normal, cosine } = *query;
        self.report_step(span);
        let sample = self.builder.push(OpKind::LightSample { index, point, normal, cosine });
        let mut values = sample.iter();
        let reaches = values.next().expect("a sample begins with whether it reaches");
        for (name, len) in [
            ("rt_LightDirection", 3),
            ("rt_LightDistance", 1),
            ("rt_LightColor", COLOR_COMPONENTS as usize),
            ("rt_PDF", 1),
        ] {
            let variable = self.state_variable(state_id(name), span)?;
            let component: Vec<Value> = values.by_ref().take(len).collect();
            self.set_variable(variable, &component);
            let ty = match len {
                1 => Type::Scalar(Scalar::F32),
                _ => Type::Vector(Scalar::F32, len as u8),
            };
            self.report_known(name, ValueScope::State, &ty, &component, span);
        }
        self.lower_when(reaches, span, |lowering| lowering.lower_list(&illuminance.body))
    }
}

fn vector(values: &[Value]) -> [Value; 3] {
    [values[0], values[1], values[2]]
}
