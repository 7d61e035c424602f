//! Parameters that are a value or a texture: `public texture float roughness = 0.3;`.
//!
//! Such a member is data and a reference of the same name. A read is a lookup if the reference is set, and a load
//! otherwise. Linking decides which, so that the code of an instance has only one of them. A value that was looked up
//! serves the reads that follow it, since the inputs of a lookup do not change within a method.
//!
//! A class below may compute the parameter by a function of its name. A read is then a call, whose value serves further
//! reads likewise, and neither the data nor the reference is a parameter.

use rtsl_ir::class::{Reference, ReferenceCount};
use rtsl_ir::{BinaryOp, Constant, OpKind, ReferenceCall, ReferencePath, Value, ValueScope};
use rtsl_sema::hir::{FunctionId, Member, MemberId, Type};
use rtsl_source::Span;
use rtsl_spec::{Direction, Method, Role, state_variables};

use crate::access::Access;
use crate::facts::Root;
use crate::limits::Lowered;
use crate::references::components;
use crate::state_table::state_id;
use crate::{Lowering, Purpose};

/// The reference to the texture. The class works without one.
pub(crate) fn reference(member: &Member) -> Reference {
    let count = ReferenceCount::Single;
    Reference { name: member.name.clone(), role: Role::Texture, count, tested: true }
}

impl Lowering<'_> {
    /// Lowers a read. The constructor has no ray and reads the value.
    pub fn lower_textured(&mut self, id: MemberId, span: Span) -> Lowered<Vec<Value>> {
        if self.purpose == Purpose::Constructor {
            return self.lower_value_of_textured(id, span);
        }
        if let Some((_, values)) = self.looked_up.iter().find(|(member, _)| *member == id) {
            return Ok(values.clone());
        }
        let name = self.class.members[id.0 as usize].name.clone();
        let is_set = OpKind::IsSet(name, ReferencePath::Single);
        let is_textured = self.builder.push(is_set).get(0);
        let values = self.lower_if(
            is_textured,
            span,
            |lowering| lowering.lower_lookup_of_textured(id, span),
            |lowering| lowering.lower_value_of_textured(id, span),
        )?;
        self.report_textured(id, &values, span);
        if !self.writes_input_of_lookup() {
            self.looked_up.push((id, values.clone()));
        }
        Ok(values)
    }

    fn report_textured(&mut self, id: MemberId, values: &[Value], span: Span) {
        let member = &self.class.members[id.0 as usize];
        self.report_known(&member.name, ValueScope::Member, &member.ty, values, span);
    }

    /// Lowers a read of a parameter that a function computes.
    pub fn lower_computed(
        &mut self,
        id: MemberId,
        function: FunctionId,
        span: Span,
    ) -> Lowered<Vec<Value>> {
        if self.purpose == Purpose::Constructor {
            return self.lower_value_of_textured(id, span);
        }
        if let Some((_, values)) = self.looked_up.iter().find(|(member, _)| *member == id) {
            return Ok(values.clone());
        }
        let result = self.call(function, Vec::new(), span)?.result;
        let member = &self.class.members[id.0 as usize];
        let values: Vec<Value> =
            result.into_iter().map(|value| self.clamp_to_range(member, value)).collect();
        self.report_textured(id, &values, span);
        if !self.writes_input_of_lookup() {
            self.looked_up.push((id, values.clone()));
        }
        Ok(values)
    }

    fn lower_value_of_textured(&mut self, id: MemberId, span: Span) -> Lowered<Vec<Value>> {
        let variable = self.member_variable(id)?;
        let ty = self.class.members[id.0 as usize].ty.clone();
        self.read(&Access::whole(variable, ty, span))
    }

    /// Looks up the texture at the hit. The value is brought into the parameter's range, as a host's must be.
    fn lower_lookup_of_textured(&mut self, id: MemberId, span: Span) -> Lowered<Vec<Value>> {
        let member = &self.class.members[id.0 as usize];
        let returns = match member.ty {
            Type::Scalar(_) => "rt_FloatTextureValue",
            _ => "rt_TextureColor",
        };
        let overrides = self.overrides(Role::Texture, Method::Lookup, &[], span)?;
        let results = self.builder.push(OpKind::ReferenceCall(Box::new(ReferenceCall {
            member: member.name.clone(),
            path: ReferencePath::Single,
            role: Role::Texture,
            method: Method::Lookup,
            overrides,
            results: components(state_id(returns)),
        })));
        Ok(results.iter().map(|value| self.clamp_to_range(member, value)).collect())
    }

    /// The order of the operands replaces NaN by a bound.
    fn clamp_to_range(&mut self, member: &Member, value: Value) -> Value {
        let mut value = value;
        for (key, op) in [("min", BinaryOp::Max), ("max", BinaryOp::Min)] {
            if let Some(bound) = bound(member, key) {
                let bound = self.builder.f32(bound);
                value = self.builder.binary(op, bound, value);
            }
        }
        value
    }

    /// True if the method writes a state variable that textures read, so that lookups differ.
    fn writes_input_of_lookup(&self) -> bool {
        self.writes.iter().any(|root| {
            let Root::State(id) = root else { return false };
            let row = Role::Texture.row(state_variables()[id.0 as usize].name);
            row.is_some_and(|row| row.direction(Method::Lookup) == Some(Direction::In))
        })
    }
}

/// The bound that an annotation gives.
fn bound(member: &Member, key: &str) -> Option<f32> {
    let annotation = member.annotations.iter().find(|annotation| annotation.key == key)?;
    let rtsl_ir::class::AnnotationValue::Constant(value) = annotation.value else { return None };
    Some(match value {
        Constant::F32(value) => value,
        Constant::I32(value) => value as f32,
        Constant::U32(value) => value as f32,
        Constant::Bool(value) => f32::from(u8::from(value)),
    })
}
