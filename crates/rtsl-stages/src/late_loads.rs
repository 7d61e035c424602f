//! Moves loads of state and scratch that a later stage would execute to the start of the function.
//!
//! The runtime keeps the state of a path only until its first stage has run. A load that may come after a suspension is
//! therefore made at the start, and its value passes through the frame. For a load at a dynamic index the whole
//! variable is copied to a local there.

use std::collections::HashMap;

use rtsl_ir::{
    Function, Index, Op, OpKind, Region, Value, Values, Variable, VariableId, VariableKind,
};

use crate::points::{has_point, is_point};

/// Moves the late loads of a function.
pub(crate) fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let mut moves = Moves {
        function,
        start: Vec::new(),
        loaded: HashMap::new(),
        copies: HashMap::new(),
        substitutes: HashMap::new(),
    };
    moves.region(&mut body, false);
    let Moves { start, substitutes, .. } = moves;
    body.for_each_use_mut(&mut |value| *value = *substitutes.get(value).unwrap_or(value));
    body.ops.splice(0..0, start);
    function.body = body;
}

/// Its maps are used for lookup only, so the iteration order cannot affect results.
struct Moves<'a> {
    function: &'a mut Function,
    /// The operations to be put at the start.
    start: Vec<Op>,
    /// The values of scalars loaded at the start.
    loaded: HashMap<(VariableId, u32), Value>,
    /// The local that is a copy of a variable.
    copies: HashMap<VariableId, VariableId>,
    /// The values that take the place of results of late loads.
    substitutes: HashMap<Value, Value>,
}

impl Moves<'_> {
    /// Rewrites a region. `late` is true if a suspension may come before it; returns true if one may come before its
    /// end.
    fn region(&mut self, region: &mut Region, mut late: bool) -> bool {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            if late && self.is_moved(&mut op) {
                continue;
            }
            match &mut op.kind {
                OpKind::If { then, otherwise, .. } => {
                    let [then, otherwise] = [then, otherwise].map(|it| self.region(it, late));
                    late = then || otherwise;
                }
                OpKind::Loop { body, .. } => {
                    late |= has_point(body);
                    self.region(body, late);
                }
                _ => late |= is_point(&op),
            }
            ops.push(op);
        }
        region.ops = ops;
        late
    }

    /// Moves the load that an operation is, or redirects it to a copy; true if the operation is no longer needed.
    fn is_moved(&mut self, op: &mut Op) -> bool {
        let OpKind::Load(variable, index) = &mut op.kind else { return false };
        let kind = self.function.variable(*variable).kind;
        if !matches!(kind, VariableKind::State | VariableKind::Scratch) {
            return false;
        }
        match *index {
            Index::Constant(component) => {
                let value = self.scalar(*variable, component);
                self.function.names.keep(op.results.get(0), value);
                self.substitutes.insert(op.results.get(0), value);
                true
            }
            Index::Dynamic(_) => {
                *variable = self.copy(*variable);
                false
            }
        }
    }

    /// Returns the scalar of a variable, loaded at the start.
    fn scalar(&mut self, variable: VariableId, component: u32) -> Value {
        if let Some(known) = self.loaded.get(&(variable, component)) {
            return *known;
        }
        let scalar = self.function.variable(variable).scalar;
        let load = OpKind::Load(variable, Index::Constant(component));
        let value = self.function.push(&mut self.start, scalar, load);
        self.loaded.insert((variable, component), value);
        value
    }

    /// Returns a local to which the variable is copied at the start.
    fn copy(&mut self, variable: VariableId) -> VariableId {
        if let Some(known) = self.copies.get(&variable) {
            return *known;
        }
        let Variable { name, scalar, len, .. } = self.function.variable(variable).clone();
        let mut local = Variable { kind: VariableKind::Local, name, scalar, len };
        while self.function.find_variable(VariableKind::Local, &local.name).is_some() {
            local.name.push_str(".copy");
        }
        let local = self.function.intern_variable(local);
        for component in 0..len {
            let value = self.scalar(variable, component);
            let kind = OpKind::Store(local, Index::Constant(component), value);
            self.start.push(Op { results: Values::default(), precise: false, kind });
        }
        self.copies.insert(variable, local);
        local
    }
}
