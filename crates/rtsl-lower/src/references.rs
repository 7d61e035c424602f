//! Calls of other instances: `kd.lookup()`.
//!
//! The callee sees the caller's ray and hit. It reads a state variable from the same host storage
//! as the caller if the caller has it unchanged there. All other state is passed as overrides of
//! the call: variables that the caller has written, the light sample of `illuminance`, arguments,
//! and the defaults of variables that the caller does not have. Linking therefore needs no
//! information about the caller.

use rtsl_ir::{BinaryOp, OpKind, ReferenceCall, ReferencePath, StateComponent, Value};
use rtsl_sema::hir::{self, Expression, ExpressionKind, StateId};
use rtsl_source::Span;
use rtsl_spec::{Direction, Method, Role};

use crate::Lowering;
use crate::access::element_count;
use crate::limits::Lowered;
use crate::state_table::{entry, state_id};
use crate::variables::Storage;

/// The state variables whose values the call overrides.
pub(crate) type Overrides = Vec<(StateComponent, Value)>;

/// A reference member, or an element of one.
#[derive(Clone, Debug)]
pub(crate) struct ReferencePlace {
    pub member: String,
    pub path: ReferencePath,
}

impl<'m> Lowering<'m> {
    pub fn lower_reference_call(
        &mut self,
        call: &'m hir::ReferenceCall,
        span: Span,
    ) -> Lowered<Vec<Value>> {
        let ReferencePlace { member, path } = self.lower_reference(&call.reference)?;
        let method = call.method;
        let mut arguments = Vec::new();
        for argument in &call.arguments {
            arguments.push((argument.state, self.lower_expression(&argument.value)?));
        }
        self.add_inverse_direction(&mut arguments);
        let overrides = self.overrides(method.role, method.runs, &arguments, span)?;

        let given: Vec<StateId> = std::iter::once(&method.returns)
            .chain(method.also_sets)
            .map(|name| state_id(name))
            .collect();
        let results = given.iter().flat_map(|state| components(*state)).collect();
        let (role, runs) = (method.role, method.runs);
        let results = self.builder.push(OpKind::ReferenceCall(Box::new(ReferenceCall {
            member,
            path,
            role,
            method: runs,
            overrides,
            results,
        })));
        let mut results = results.iter();
        let mut take = |state: StateId| -> Vec<Value> {
            results.by_ref().take(components(state).len()).collect()
        };
        let result = take(given[0]);
        for state in &given[1..] {
            let values = take(*state);
            let variable = self.state_variable(*state, span)?;
            self.set_variable(variable, &values);
        }
        Ok(result)
    }

    pub fn lower_is_set(&mut self, reference: &'m Expression) -> Lowered<Vec<Value>> {
        if matches!(reference.kind, ExpressionKind::Computed(..)) {
            return Ok(vec![self.builder.bool(true)]);
        }
        let ReferencePlace { member, path } = self.lower_reference(reference)?;
        self.tested.borrow_mut().insert(member.clone());
        Ok(vec![self.builder.push(OpKind::IsSet(member, path)).get(0)])
    }

    /// The reference that an expression denotes.
    pub fn lower_reference(&mut self, reference: &'m Expression) -> Lowered<ReferencePlace> {
        match &reference.kind {
            ExpressionKind::Member(id) | ExpressionKind::Textured(id) => {
                let member = self.class.members[id.0 as usize].name.clone();
                Ok(ReferencePlace { member, path: ReferencePath::Single })
            }
            ExpressionKind::Local(id) => {
                let mut bound = self.frame.references.iter();
                let place = bound.find(|(local, _)| local == id).map(|(_, place)| place.clone());
                Ok(place.expect("calls bind the parameters that are references"))
            }
            ExpressionKind::Index(array, index) => {
                let ReferencePlace { member, .. } = self.lower_reference(array)?;
                let index = self.lower_scalar(index)?;
                let index = match element_count(&array.ty) {
                    Some(count) => self.clamp_index(index, count),
                    None => {
                        let count = self.reference_count(member.clone());
                        self.clamp_index_below(index, count)
                    }
                };
                Ok(ReferencePlace { member, path: ReferencePath::Element(index) })
            }
            _ => unreachable!("references are members, elements of members or parameters"),
        }
    }

    /// The number of elements of an array of references without a size.
    pub fn reference_count(&mut self, member: String) -> Value {
        self.builder.push(OpKind::ReferenceCount(member)).get(0)
    }

    /// Adds the inverse of a ray's direction that the arguments give, as hosts do.
    fn add_inverse_direction(&mut self, arguments: &mut Vec<(StateId, Vec<Value>)>) {
        let inverse = state_id("rt_InverseRayDirection");
        let find = |state| arguments.iter().find(|(argument, _)| *argument == state);
        let (Some((_, direction)), None) = (find(state_id("rt_RayDirection")), find(inverse))
        else {
            return;
        };
        let direction = direction.clone();
        let one = self.builder.f32(1.0);
        let divide = |value| self.builder.binary(BinaryOp::Divide, one, value);
        arguments.push((inverse, direction.into_iter().map(divide).collect()));
    }

    /// The values that a call passes to the callee instead of those in the host's storage: `arguments`, and what the
    /// caller has changed.
    pub fn overrides(
        &mut self,
        role: Role,
        method: Method,
        arguments: &[(StateId, Vec<Value>)],
        span: Span,
    ) -> Lowered<Overrides> {
        let mut overrides = Overrides::new();
        for variable in rtsl_spec::state_variables() {
            let state = StateId(variable.index);
            let Some(row) = role.row(variable.name) else { continue };
            if !matches!(row.direction(method), Some(Direction::In | Direction::InOut)) {
                continue;
            }
            let argument = arguments.iter().find(|(argument, _)| *argument == state);
            let values = match argument {
                Some((_, values)) => Some(values.clone()),
                None => self.state_for_callee(state, row, span)?,
            };
            overrides.extend(components(state).into_iter().zip(values.unwrap_or_default()));
        }
        Ok(overrides)
    }

    /// The values that a callee sees; `None` if it can read the host's storage.
    fn state_for_callee(
        &mut self,
        state: StateId,
        of_callee: &rtsl_spec::Row,
        span: Span,
    ) -> Lowered<Option<Vec<Value>>> {
        let name = entry(state).name;
        let (direction, _) = self.row(state);
        let has_it = self.class.roles.iter().any(|role| role.row(name).is_some());
        if direction.is_none() && name == "rt_BSDFSeed" {
            return Ok(Some((0..3).map(|_| self.builder.push(OpKind::Rand).get(0)).collect()));
        }
        if !has_it {
            return Ok(self.constant_default(of_callee));
        }
        let variable = self.state_variable(state, span)?;
        if matches!(self.variable(variable).storage, Storage::Memory(_)) {
            return Ok(None);
        }
        let values = self.get_variable(variable)?;
        let unchanged = self.variable(variable).input.as_ref() == Some(&values);
        Ok(if unchanged { None } else { Some(values) })
    }
}

/// All components of a state variable.
pub(crate) fn components(state: StateId) -> Vec<StateComponent> {
    let count = entry(state).ty.components();
    (0..count).map(|component| StateComponent { variable: state.0, component }).collect()
}
