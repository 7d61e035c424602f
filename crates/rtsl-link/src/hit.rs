//! Linking `intersect` and the methods that describe the surface at a hit to one function.
//!
//! The values that one method sets, scratch included, are operands of the next ones. Only state for which the host's
//! record has rows passes through memory; other state has its default.

use rtsl_abi::RayRecord;
use rtsl_ir::{
    BinaryOp, Constant, Function, Index, Op, OpKind, Output, Region, Scalar, StateComponent, Value,
    Variable, VariableId, VariableKind,
};
use rtsl_source::Diagnostic;
use rtsl_spec::{Method, Role, StateVariable, lookup_state, state_variables};

use crate::class_tree::ClassTree;
use crate::draft::Linking;
use crate::errors;
use crate::linker::{Linked, Linker, PlainLinker};
use crate::outputs::Outputs;
use crate::reference_calls::default_of;
use crate::site::{Site, find_override};

/// The methods that describe a surface, in the order in which hosts call them.
const SURFACE_METHODS: [Method; 3] =
    [Method::ComputeNormal, Method::ComputeTextureCoordinates, Method::ComputeDerivatives];

/// Links a function that tests for a hit and sets what of `outputs` the class's methods set; `None` if the class does
/// not test for hits.
pub fn link_hit(
    tree: &ClassTree,
    record: &RayRecord,
    outputs: Outputs,
) -> Option<Result<Linked, Diagnostic>> {
    let class = &tree.class;
    let intersect = class.methods.get(&Method::Intersect)?;
    let mut linker = PlainLinker::new(format!("{}.hit", class.name));
    linker.scratch = Some(Vec::new());
    let mut hit = HitLinker { linker: &mut linker, tree, record, known: Vec::new() };
    Some(hit.link(intersect, outputs).map(|()| linker.finish()))
}

struct HitLinker<'a, 'l> {
    linker: &'l mut PlainLinker,
    tree: &'a ClassTree,
    record: &'a RayRecord,
    /// The values of state that is not in the record's rows: state without rows, and state that methods have set. The
    /// last one counts.
    known: Vec<(StateComponent, Value)>,
}

impl HitLinker<'_, '_> {
    fn link(&mut self, intersect: &Function, outputs: Outputs) -> Linking<()> {
        let mut ops = Vec::new();
        self.set_unbound(&mut ops)?;
        let accepted = self.method(intersect, &mut ops)?;
        let accepted = accepted.expect("intersect says whether it accepts a hit");

        let mut surface = Region::default();
        self.linker.nested(|linker| {
            let (tree, record) = (self.tree, self.record);
            let known = std::mem::take(&mut self.known);
            let mut inner = HitLinker { linker, tree, record, known };
            inner.surface(&mut surface.ops)?;
            self.known = inner.known;
            Ok(())
        })?;
        let stored = self.stored(outputs)?;
        surface.yields = stored.iter().map(|(_, value)| *value).collect();
        let results = self.describe_hits(accepted, surface, &mut ops)?;

        let place = self.variable(VariableKind::Accepted, "accepted", Scalar::Bool, 1);
        self.linker.out.outputs.push(Output { variable: place, component: 0 });
        self.linker.out.body = Region { ops, yields: vec![accepted], ..Region::default() };
        for ((component, _), value) in stored.into_iter().zip(results) {
            let variable = variable(component);
            let len = variable.ty.components();
            let place = self.variable(VariableKind::State, variable.name, Scalar::F32, len);
            self.linker
                .out
                .outputs
                .push(Output { variable: place, component: component.component });
            self.linker.out.body.yields.push(value);
        }
        Ok(())
    }

    /// Sets state for which the record has no rows.
    fn set_unbound(&mut self, to: &mut Vec<Op>) -> Linking<()> {
        let unbound = state_variables().iter().filter(|it| !has_rows(self.record, it));
        for variable in unbound.filter(|variable| Role::Primitive.row(variable.name).is_some()) {
            for component in 0..variable.ty.components() {
                let wanted = StateComponent { variable: variable.index, component };
                let value = match variable.name {
                    "rt_InverseRayDirection" => {
                        let direction = self.load("rt_RayDirection", component, to)?;
                        let one = self.linker.constant(to, Constant::F32(1.0))?;
                        self.binary(BinaryOp::Divide, one, direction, to)?
                    }
                    _ => self.linker.constant(to, default_of(Role::Primitive, wanted))?,
                };
                self.known.push((wanted, value));
            }
        }
        Ok(())
    }

    /// Copies a method's body and notes the values that it sets. Returns the flag of an accepted hit, if it has one.
    fn method(&mut self, function: &Function, to: &mut Vec<Op>) -> Linking<Option<Value>> {
        let mut site = Site::new(Some(self.tree), function, String::new(), &mut self.linker.out);
        // The locals of each method are distinct.
        site.is_root = false;
        site.overrides.clone_from(&self.known);
        self.linker.copy_ops(&mut site, &function.body.ops, to)?;
        let accepted = function
            .outputs
            .iter()
            .position(|output| function.variable(output.variable).kind == VariableKind::Accepted);
        let accepted = accepted.map(|index| site.value(function.body.yields[index]));
        let set = self.linker.note_outputs(&site);
        self.known.extend(set);
        Ok(accepted)
    }

    /// Computes the state at a hit.
    fn surface(&mut self, to: &mut Vec<Op>) -> Linking<()> {
        for axis in 0..3 {
            let origin = self.load("rt_RayOrigin", axis, to)?;
            let direction = self.load("rt_RayDirection", axis, to)?;
            let distance = self.load("rt_HitDistance", 0, to)?;
            let way = self.binary(BinaryOp::Multiply, distance, direction, to)?;
            let point = self.binary(BinaryOp::Add, origin, way, to)?;
            self.known.extend(component("rt_HitPoint", axis).map(|it| (it, point)));
        }
        let tree = self.tree;
        for method in SURFACE_METHODS {
            if let Some(function) = tree.class.methods.get(&method) {
                self.method(function, to)?;
            }
        }
        Ok(())
    }

    /// Returns the values to store for a hit.
    fn stored(&self, outputs: Outputs) -> Linking<Vec<(StateComponent, Value)>> {
        let mut stored = Vec::new();
        for variable in outputs.variables() {
            for component in 0..variable.ty.components() {
                let wanted = StateComponent { variable: variable.index, component };
                match find_override(&self.known, wanted) {
                    // `Outputs::ALL` means all outputs for which the record has rows.
                    _ if outputs == Outputs::ALL && !has_rows(self.record, variable) => {}
                    Some(value) => stored.push((wanted, value)),
                    None if outputs == Outputs::ALL => {}
                    None => return Err(errors::unset_at_hits(&self.tree.class, variable.name)),
                }
            }
        }
        Ok(stored)
    }

    /// Runs `surface` if a hit was accepted, and returns its yields.
    fn describe_hits(
        &mut self,
        accepted: Value,
        surface: Region,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let results = vec![Scalar::F32; surface.yields.len()];
        let mut otherwise = Region::default();
        // Unobservable: nothing is stored without a hit.
        let zero = self.linker.constant(&mut otherwise.ops, Constant::F32(0.0))?;
        otherwise.yields = vec![zero; results.len()];
        let kind = OpKind::If { condition: accepted, then: surface, otherwise };
        Ok(self.linker.emit(to, kind, &results, false)?.iter().collect())
    }

    /// Returns the current value of a component.
    fn load(&mut self, name: &str, wanted: u32, to: &mut Vec<Op>) -> Linking<Value> {
        let known = component(name, wanted).and_then(|it| find_override(&self.known, it));
        if let Some(value) = known {
            return Ok(value);
        }
        let len = lookup_state(name).map_or(1, |variable| variable.ty.components());
        let place = self.variable(VariableKind::State, name, Scalar::F32, len);
        let kind = OpKind::Load(place, Index::Constant(wanted));
        Ok(self.linker.emit(to, kind, &[Scalar::F32], false)?.get(0))
    }

    /// Adds a precise operation, so that a host that computes the same gets the same bits.
    fn binary(&mut self, op: BinaryOp, a: Value, b: Value, to: &mut Vec<Op>) -> Linking<Value> {
        Ok(self.linker.emit(to, OpKind::Binary(op, a, b), &[Scalar::F32], true)?.get(0))
    }

    fn variable(&mut self, kind: VariableKind, name: &str, scalar: Scalar, len: u32) -> VariableId {
        self.linker.intern_variable(Variable { kind, name: name.to_owned(), scalar, len })
    }
}

/// True if the record has rows for all components of a variable.
fn has_rows(record: &RayRecord, variable: &StateVariable) -> bool {
    let first = variable.first_component;
    (first..first + variable.ty.components()).all(|it| record.rows.contains_key(&it))
}

fn component(name: &str, component: u32) -> Option<StateComponent> {
    StateComponent::named(name, component)
}

fn variable(component: StateComponent) -> &'static StateVariable {
    &state_variables()[component.variable as usize]
}
