//! GLSL's constructors: `vec3(...)`, `mat2(...)`, `float[3](...)`, `Light(...)`, `color(...)`.

use rtsl_ir::{Constant, Scalar, Value};
use rtsl_sema::hir::{Expression, Type};
use rtsl_source::Span;
use rtsl_spec::COLOR_COMPONENTS;

use crate::Lowering;
use crate::layout::join_elements;
use crate::limits::Lowered;

// `color(r, g, b)` uses its arguments as the components.
const _: () = assert!(COLOR_COMPONENTS == 3);

impl<'m> Lowering<'m> {
    pub fn lower_construct(
        &mut self,
        ty: &Type,
        parts: &'m [Expression],
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let mut values = Vec::with_capacity(parts.len());
        for part in parts {
            values.push(self.lower_expression(part)?);
        }
        Ok(match ty {
            Type::Array(element, _) => {
                join_elements(&*self.layouts.layout(element, span)?, &values)
            }
            Type::Struct(_) => values.concat(),
            Type::Matrix(columns, rows) => {
                let (columns, rows) = (usize::from(*columns), usize::from(*rows));
                match (parts, &*values) {
                    ([Expression { ty: Type::Scalar(_), .. }], [scalar]) => {
                        self.diagonal(columns, rows, scalar[0])
                    }
                    ([Expression { ty: Type::Matrix(_, of_rows), .. }], [matrix]) => {
                        self.resize_matrix(columns, rows, matrix, usize::from(*of_rows))
                    }
                    _ => self.components(Scalar::F32, columns * rows, &values.concat()),
                }
            }
            Type::Scalar(scalar) => self.components(*scalar, 1, &values.concat()),
            Type::Vector(scalar, size) => {
                self.components(*scalar, usize::from(*size), &values.concat())
            }
            Type::Color => {
                self.components(Scalar::F32, COLOR_COMPONENTS as usize, &values.concat())
            }
            Type::Void | Type::Buffer(_) | Type::Reference(_) | Type::Error => Vec::new(),
        })
    }

    /// The first `count` of the values, or copies of a single value, converted.
    fn components(&mut self, scalar: Scalar, count: usize, values: &[Value]) -> Vec<Value> {
        let spread = if values.len() == 1 { count } else { 1 };
        let chosen = values.iter().flat_map(|value| std::iter::repeat_n(*value, spread));
        chosen.take(count).map(|value| self.builder.convert(scalar, value)).collect()
    }

    fn diagonal(&mut self, columns: usize, rows: usize, value: Value) -> Vec<Value> {
        let value = self.builder.convert(Scalar::F32, value);
        let zero = self.builder.constant(Constant::zero(Scalar::F32));
        let cells = (0..columns).flat_map(|column| (0..rows).map(move |row| column == row));
        cells.map(|on_diagonal| if on_diagonal { value } else { zero }).collect()
    }

    /// The upper left of a matrix, with the rest from the identity.
    fn resize_matrix(
        &mut self,
        columns: usize,
        rows: usize,
        matrix: &[Value],
        of_rows: usize,
    ) -> Vec<Value> {
        let one = self.builder.f32(1.0);
        let mut resized = self.diagonal(columns, rows, one);
        for (column, from) in matrix.chunks(of_rows).take(columns).enumerate() {
            let kept = rows.min(of_rows);
            resized[column * rows..column * rows + kept].copy_from_slice(&from[..kept]);
        }
        resized
    }
}
