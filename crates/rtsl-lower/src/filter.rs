//! Changes over the width of a filter: `dFdx(value)`, `dFdy(value)` and `fwidth(value)`.
//!
//! The state variables of the place change along both sides of the filter: by a step `rt_du` of the first surface
//! parameter, and by `rt_dv` of the second. Each step is a seed, and the place's derivatives by it are stated where the
//! function begins, so that whatever is computed from the place has derivatives.

use rtsl_ir::{OpKind, UnaryOp, Value};
use rtsl_source::Span;
use rtsl_spec::builtins::{Along, Direction, Mapped};

use crate::Lowering;
use crate::limits::Lowered;
use crate::state_table::state_id;

/// The seeds of a step along u and of one along v.
pub(crate) type Steps = [Value; 2];

/// The state variables of a side: its width, the derivative of the point, and those of the texture coordinates.
struct Side {
    width: &'static str,
    point: &'static str,
    coordinates: [&'static str; 2],
}

const SIDES: [Side; 2] = [
    Side { width: "rt_du", point: "rt_dPdu", coordinates: ["rt_dsdu", "rt_dtdu"] },
    Side { width: "rt_dv", point: "rt_dPdv", coordinates: ["rt_dsdv", "rt_dtdv"] },
];

impl Lowering<'_> {
    /// States the derivatives of the place by steps along the sides of the filter.
    pub fn begin_filter(&mut self, span: Span) -> Lowered<()> {
        let steps = [(); 2].map(|()| {
            let zero = self.builder.f32(0.0);
            self.builder.emit(OpKind::Seed(zero))
        });
        let mut coordinates = Vec::new();
        let mut points = Vec::new();
        let mut solid = Vec::new();
        for side in SIDES {
            let mut along = self.state_values(side.coordinates[0], span)?;
            along.extend(self.state_values(side.coordinates[1], span)?);
            coordinates.push(self.scaled(along, side.width, span)?);
            let point = self.state_values(side.point, span)?;
            let point = self.scaled(point, side.width, span)?;
            solid.push(self.lower_map(Direction::ToObject, Mapped::Vector, &point, span)?);
            points.push(point);
        }
        self.state_derivatives("rt_TextureUV", steps, &coordinates, span)?;
        self.state_derivatives("rt_TextureUVW", steps, &solid, span)?;
        self.state_derivatives("rt_HitPoint", steps, &points, span)?;
        self.filter = Some(steps);
        self.order += 1;
        Ok(())
    }

    /// Lowers the change of a value: component by component.
    pub fn lower_change(&mut self, along: Along, components: &[Value]) -> Vec<Value> {
        let steps = self.filter.expect("the functions that ask for changes are known");
        let change =
            |it: &mut Self, of: Value, by: Value| it.builder.emit(OpKind::Derivative(of, by));
        let components = components.iter();
        let changes = components.map(|component| match along {
            Along::U => change(self, *component, steps[0]),
            Along::V => change(self, *component, steps[1]),
            Along::Both => {
                let sides = steps.map(|by| {
                    let signed = change(self, *component, by);
                    self.builder.emit(OpKind::Unary(UnaryOp::Abs, signed))
                });
                self.builder.add(sides[0], sides[1])
            }
        });
        changes.collect()
    }

    fn state_values(&mut self, name: &str, span: Span) -> Lowered<Vec<Value>> {
        let variable = self.state_variable(state_id(name), span)?;
        self.get_variable(variable)
    }

    fn scaled(&mut self, values: Vec<Value>, width: &str, span: Span) -> Lowered<Vec<Value>> {
        let width = self.state_values(width, span)?[0];
        Ok(values.into_iter().map(|value| self.builder.multiply(value, width)).collect())
    }

    /// States the derivatives of a state variable's components by each step.
    fn state_derivatives(
        &mut self,
        name: &str,
        steps: Steps,
        derivatives: &[Vec<Value>],
        span: Span,
    ) -> Lowered<()> {
        let id = state_id(name);
        let variable = self.state_variable(id, span)?;
        let variable = self.in_cells(variable)?;
        let values = self.get_variable(variable)?;
        let values = values.into_iter().enumerate().map(|(component, value)| {
            let factors = steps.into_iter().zip(derivatives.iter().map(|it| it[component]));
            self.builder.emit(OpKind::ChainRule(value, factors.collect()))
        });
        let values: Vec<Value> = values.collect();
        self.set_variable(variable, &values);
        self.states.insert(id, variable);
        Ok(())
    }
}
