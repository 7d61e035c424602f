//! Lowers built-in functions as the registry defines.

use rtsl_ir::{BinaryOp, CompareOp, Constant, OpKind, Scalar, UnaryOp, Value};
use rtsl_sema::hir::{BuiltinCall, Expression, FunctionId, Type};
use rtsl_source::Span;
use rtsl_spec::builtins::{Direction, Lowering as BuiltinLowering, Mapped, Operation, Special};
use rtsl_spec::{TO_OBJECT, TO_WORLD};

use crate::Lowering;
use crate::limits::Lowered;
use crate::state_table::state_id;

impl<'m> Lowering<'m> {
    pub fn lower_builtin(
        &mut self,
        call: &'m BuiltinCall,
        expression: &'m Expression,
    ) -> Lowered<Vec<Value>> {
        if call.builtin.lowering == BuiltinLowering::Special(Special::Gradient) {
            return self.lower_gradient(&call.arguments, expression.span);
        }
        if let Some(prelude) = call.prelude {
            return if call.componentwise || self.chain_rule_of(prelude).is_some() {
                self.lower_componentwise_call(prelude, &call.arguments, expression.span)
            } else {
                self.lower_call(prelude, &call.arguments, expression.span)
            };
        }
        match call.builtin.lowering {
            BuiltinLowering::Operation(operation) => {
                let arguments = self.lower_all(&call.arguments)?;
                Ok(self.operate(operation, &arguments))
            }
            BuiltinLowering::Special(special) => {
                self.lower_special(special, &call.arguments, expression.span)
            }
            BuiltinLowering::Prelude => unreachable!("{} has its function", call.builtin.name),
        }
    }

    fn lower_all(&mut self, arguments: &'m [Expression]) -> Lowered<Vec<Vec<Value>>> {
        arguments.iter().map(|argument| self.lower_expression(argument)).collect()
    }

    /// Applies a function of scalars to each component of its arguments.
    fn lower_componentwise_call(
        &mut self,
        function: FunctionId,
        arguments: &'m [Expression],
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let (values, targets) = self.lower_arguments(function, arguments, &[])?;
        let count = values.iter().map(Vec::len).max().unwrap_or(0);
        let mut result = Vec::with_capacity(count);
        let mut outputs: Vec<Option<Vec<Value>>> = vec![None; values.len()];
        for component in 0..count {
            let scalars = values.iter().map(|values| values[component % values.len()]);
            let returned = self.call_with_chain_rule(function, scalars.collect(), span)?;
            result.extend(returned.result);
            for (all, output) in outputs.iter_mut().zip(returned.outputs) {
                if let Some(output) = output {
                    all.get_or_insert_default().extend(output);
                }
            }
        }
        self.copy_out(targets, outputs, arguments)?;
        Ok(result)
    }

    /// Applies one operation to each component.
    fn operate(&mut self, operation: Operation, arguments: &[Vec<Value>]) -> Vec<Value> {
        let count = arguments.iter().map(Vec::len).max().unwrap_or(0);
        (0..count)
            .map(|component| {
                let of = |argument: &Vec<Value>| argument[component % argument.len()];
                let operands: Vec<Value> = arguments.iter().map(of).collect();
                self.builder.emit(operation_kind(operation, &operands))
            })
            .collect()
    }

    fn lower_special(
        &mut self,
        special: Special,
        arguments: &'m [Expression],
        span: Span,
    ) -> Lowered<Vec<Value>> {
        debug_assert!(special != Special::Gradient, "it is lowered by itself");
        if matches!(special, Special::IsSet | Special::IsTextured) {
            return self.lower_is_set(&arguments[0]);
        }
        let values = self.lower_all(arguments)?;
        match special {
            Special::Hit => self.lower_hit(values[0][0], span),
            Special::Trace | Special::Occluded => Ok(self.lower_ray(special, &values)),
            Special::NearestHit => self.lower_nearest_hit(&values, span),
            Special::Query(name) => Ok(self.lower_scene_query(name, values)),
            Special::Ambient => Ok(self.builder.push(OpKind::Ambient).iter().collect()),
            Special::Rand => Ok(vec![self.builder.push(OpKind::Rand).get(0)]),
            Special::Inside => self.lower_inside(span),
            Special::Change(along) => Ok(self.lower_change(along, &values[0])),
            Special::Map(direction, mapped) => self.lower_map(direction, mapped, &values[0], span),
            Special::Rgb => Ok(values.concat()),
            Special::Any => {
                let any = self.builder.bool(false);
                Ok(vec![values[0].iter().fold(any, |any, value| self.either(any, *value))])
            }
            Special::All => {
                let all = self.builder.bool(true);
                Ok(vec![values[0].iter().fold(all, |all, value| self.both(all, *value))])
            }
            Special::MatrixCompMult => {
                Ok(self.componentwise(&values[0], &values[1], |lowering, a, b| {
                    lowering.builder.multiply(a, b)
                }))
            }
            Special::Transpose => {
                let Type::Matrix(_, rows) = arguments[0].ty else { return Ok(values.concat()) };
                Ok(transpose(&values[0], usize::from(rows)))
            }
            Special::IsSet | Special::IsTextured | Special::Gradient => {
                unreachable!("lowered above")
            }
        }
    }

    /// Lowers `hit(t)`. The nearest hit so far is an ordinary variable.
    fn lower_hit(&mut self, t: Value, span: Span) -> Lowered<Vec<Value>> {
        let epsilon = self.state_variable(state_id("rt_Epsilon"), span)?;
        let epsilon = self.get_variable(epsilon)?[0];
        let distance = self.state_variable(state_id("rt_HitDistance"), span)?;
        let nearest = self.get_variable(distance)?[0];
        let far = self.builder.compare(CompareOp::Less, epsilon, t);
        let near = self.builder.compare(CompareOp::Less, t, nearest);
        let accept = self.both(far, near);
        let nearest = self.builder.select(accept, t, nearest);
        self.set_variable(distance, &[nearest]);
        let accepted = self.cells.get(self.accepted);
        let accepted = self.either(accepted, accept);
        self.cells.set(self.accepted, accepted);
        Ok(vec![accept])
    }

    fn lower_ray(&mut self, special: Special, values: &[Vec<Value>]) -> Vec<Value> {
        let vector = |values: &Vec<Value>| [values[0], values[1], values[2]];
        let (origin, direction) = (vector(&values[0]), vector(&values[1]));
        let limit = match values.get(2) {
            Some(limit) => limit[0],
            None => self.builder.f32(f32::INFINITY),
        };
        let kind = if special == Special::Occluded {
            OpKind::Occluded { origin, direction, limit }
        } else {
            let weight = self.builder.f32(1.0);
            OpKind::Trace { origin, direction, limit, weight }
        };
        self.builder.push(kind).iter().collect()
    }

    /// Lowers a map between the world and the space of the hit object. Normals take the transposed map of the other
    /// direction.
    pub fn lower_map(
        &mut self,
        direction: Direction,
        mapped: Mapped,
        operand: &[Value],
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let is_normal = mapped == Mapped::Normal;
        let name = match (direction, is_normal) {
            (Direction::ToObject, false) | (Direction::ToWorld, true) => TO_OBJECT,
            (Direction::ToWorld, false) | (Direction::ToObject, true) => TO_WORLD,
        };
        let map = self.state_variable(state_id(name), span)?;
        let map = self.get_variable(map)?;
        let component = |column: usize, row: usize| map[3 * column + row];
        let mut mapped_components = Vec::new();
        for row in 0..3 {
            let mut sum = None;
            for (axis, value) in operand.iter().enumerate() {
                let factor = if is_normal { component(row, axis) } else { component(axis, row) };
                let product = self.builder.multiply(*value, factor);
                sum = Some(match sum {
                    Some(sum) => self.builder.add(sum, product),
                    None => product,
                });
            }
            if mapped == Mapped::Point {
                sum = sum.map(|sum| self.builder.add(sum, component(3, row)));
            }
            mapped_components.extend(sum);
        }
        Ok(mapped_components)
    }

    fn lower_inside(&mut self, span: Span) -> Lowered<Vec<Value>> {
        let direction = self.state_variable(state_id("rt_RayDirection"), span)?;
        let direction = self.get_variable(direction)?;
        let normal = self.state_variable(state_id("rt_GeometricNormal"), span)?;
        let normal = self.get_variable(normal)?;
        let vec3 = Type::Vector(Scalar::F32, 3);
        let cosine =
            self.call_prelude("dot", &[vec3.clone(), vec3], vec![direction, normal], span)?;
        let zero = self.builder.constant(Constant::zero(Scalar::F32));
        Ok(vec![self.builder.compare(CompareOp::Greater, cosine[0], zero)])
    }
}

fn transpose(matrix: &[Value], rows: usize) -> Vec<Value> {
    (0..rows).flat_map(|row| matrix.iter().skip(row).step_by(rows).copied()).collect()
}

fn operation_kind(operation: Operation, operands: &[Value]) -> OpKind {
    let unary = |op| OpKind::Unary(op, operands[0]);
    let binary = |op| OpKind::Binary(op, operands[0], operands[1]);
    let compare = |op| OpKind::Compare(op, operands[0], operands[1]);
    match operation {
        Operation::Abs => unary(UnaryOp::Abs),
        Operation::Sqrt => unary(UnaryOp::Sqrt),
        Operation::Floor => unary(UnaryOp::Floor),
        Operation::Ceil => unary(UnaryOp::Ceil),
        Operation::Trunc => unary(UnaryOp::Trunc),
        Operation::RoundEven => unary(UnaryOp::RoundEven),
        Operation::Not => unary(UnaryOp::Not),
        Operation::Seldom => unary(UnaryOp::Seldom),
        Operation::Fma => OpKind::Fma(operands[0], operands[1], operands[2]),
        Operation::Min => binary(BinaryOp::Min),
        Operation::Max => binary(BinaryOp::Max),
        Operation::MultiplyHigh => binary(BinaryOp::MultiplyHigh),
        Operation::Less => compare(CompareOp::Less),
        Operation::LessEqual => compare(CompareOp::LessEqual),
        Operation::Greater => compare(CompareOp::Greater),
        Operation::GreaterEqual => compare(CompareOp::GreaterEqual),
        Operation::Equal => compare(CompareOp::Equal),
        Operation::NotEqual => compare(CompareOp::NotEqual),
        Operation::BitcastToUint => OpKind::Bitcast(Scalar::U32, operands[0]),
        Operation::BitcastToFloat => OpKind::Bitcast(Scalar::F32, operands[0]),
    }
}
