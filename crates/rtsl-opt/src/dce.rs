//! Dead code elimination: removes values that neither outputs nor effects need.
//!
//! The roots are the outputs and operations with effects on the host. Need propagates backward through results of `if`,
//! carried values of loops, and locals: a store is needed if a needed operation reads the local. An operation with
//! regions is needed if an operation inside it is. Everything else is removed, including single results of `if` and
//! loops, and unused locals. A loop without needed operations is removed even if it would never end.

use rtsl_ir::{
    Effect, Function, IndexVec, Op, OpKind, Region, Value, Values, Variable, VariableId,
    VariableKind,
};

use crate::substitution::Substitution;

/// Removes the dead code of `function`.
pub fn run(function: &mut Function) {
    let needed = Liveness::new(function).find(function, true);
    let mut body = std::mem::take(&mut function.body);
    let mut sweep = Sweep { function, needed, substitution: Substitution::default() };
    sweep.region(&mut body, 0);
    sweep.substitution.keep_names(&mut sweep.function.names);
    function.body = body;
    remove_unused_locals(function);
}

/// Finds the values that are needed even if reports are left out; `None` if there are no reports.
pub(crate) fn needed_beside_reports(function: &Function) -> Option<IndexVec<Value, bool>> {
    let mut reports = false;
    function.body.for_each_op(&mut |op| reports |= matches!(op.kind, OpKind::Report(..)));
    reports.then(|| Liveness::new(function).find(function, false).values)
}

/// The source of a value.
#[derive(Clone, Copy)]
enum Source {
    Undefined,
    /// An operation without regions.
    Plain,
    /// The result of an `if` with this index.
    IfResult(u32),
    /// The carried value of a loop with this index: its parameter or its result.
    Carried(u32),
}

/// The needed values, found backward from the roots.
struct Liveness<'a> {
    variables: &'a [Variable],
    /// The operations, in the order of the text.
    ops: Vec<&'a Op>,
    /// For each operation, the one whose region contains it.
    parents: Vec<Option<u32>>,
    /// For each value, the operation that defines it.
    owners: IndexVec<Value, u32>,
    sources: IndexVec<Value, Source>,
    /// The stores to each variable.
    stores: IndexVec<VariableId, Vec<u32>>,
    needed_values: IndexVec<Value, bool>,
    needed_ops: Vec<bool>,
    needed_locals: IndexVec<VariableId, bool>,
    /// Needed values whose definitions have not been visited.
    worklist: Vec<Value>,
}

impl<'a> Liveness<'a> {
    fn new(function: &'a Function) -> Self {
        let values = function.values.len();
        let mut liveness = Liveness {
            variables: &function.variables,
            ops: Vec::new(),
            parents: Vec::new(),
            owners: IndexVec::filled(values, u32::MAX),
            sources: IndexVec::filled(values, Source::Undefined),
            stores: IndexVec::filled(function.variables.len(), Vec::new()),
            needed_values: IndexVec::filled(values, false),
            needed_ops: Vec::new(),
            needed_locals: IndexVec::filled(function.variables.len(), false),
            worklist: Vec::new(),
        };
        liveness.index(&function.body, None);
        liveness.needed_ops = vec![false; liveness.ops.len()];
        liveness
    }

    fn index(&mut self, region: &'a Region, parent: Option<u32>) {
        for op in &region.ops {
            let number = self.ops.len() as u32;
            self.ops.push(op);
            self.parents.push(parent);
            for (position, value) in (0..).zip(op.results.iter()) {
                let source = match op.kind {
                    OpKind::If { .. } => Source::IfResult(position),
                    OpKind::Loop { .. } => Source::Carried(position),
                    _ => Source::Plain,
                };
                self.set_source(value, number, source);
            }
            if let OpKind::Loop { body, .. } = &op.kind {
                for (position, value) in (0..).zip(&body.params) {
                    self.set_source(*value, number, Source::Carried(position));
                }
            }
            if let Effect::WritesLocal(local) = op.kind.effect(self.variables) {
                self.stores[local].push(number);
            }
            for region in op.kind.regions() {
                self.index(region, Some(number));
            }
        }
    }

    fn set_source(&mut self, value: Value, owner: u32, source: Source) {
        self.owners[value] = owner;
        self.sources[value] = source;
    }

    fn find(mut self, function: &Function, with_reports: bool) -> Needed {
        for value in &function.body.yields {
            self.need(*value);
        }
        for number in 0..self.ops.len() as u32 {
            let kind = &self.ops[number as usize].kind;
            let is_left_out = !with_reports && matches!(kind, OpKind::Report(..));
            if kind.effect(self.variables) == Effect::Host && !is_left_out {
                self.need_op(number);
            }
        }
        while let Some(value) = self.worklist.pop() {
            self.need_source(value);
        }
        Needed { values: self.needed_values, ops: self.needed_ops }
    }

    fn need(&mut self, value: Value) {
        let needed = &mut self.needed_values[value];
        if !*needed {
            *needed = true;
            self.worklist.push(value);
        }
    }

    /// Marks the operands of the definition of a needed value.
    fn need_source(&mut self, value: Value) {
        let owner = self.owners[value];
        let op = self.ops[owner as usize];
        self.need_op(owner);
        match (&op.kind, self.sources[value]) {
            (OpKind::If { then, otherwise, .. }, Source::IfResult(position)) => {
                self.need(then.yields[position as usize]);
                self.need(otherwise.yields[position as usize]);
            }
            (OpKind::Loop { initial, body }, Source::Carried(position)) => {
                self.need(op.results.get(position));
                self.need(body.params[position as usize]);
                self.need(initial[position as usize]);
                self.need(body.yields[position as usize + 1]);
            }
            _ => {}
        }
    }

    /// Marks an operation and those that enclose it as needed.
    fn need_op(&mut self, number: u32) {
        let mut next = Some(number);
        while let Some(number) = next {
            if std::mem::replace(&mut self.needed_ops[number as usize], true) {
                return;
            }
            let op = self.ops[number as usize];
            match &op.kind {
                OpKind::If { condition, .. } => self.need(*condition),
                OpKind::Loop { body, .. } => self.need(body.yields[0]),
                kind => kind.for_each_operand(|value| self.need(value)),
            }
            if let Effect::ReadsLocal(local) = op.kind.effect(self.variables) {
                self.need_local(local);
            }
            next = self.parents[number as usize];
        }
    }

    fn need_local(&mut self, local: VariableId) {
        if !std::mem::replace(&mut self.needed_locals[local], true) {
            for store in std::mem::take(&mut self.stores[local]) {
                self.need_op(store);
            }
        }
    }
}

/// The result of [`Liveness`]: by value, and by operation in the order of the text.
struct Needed {
    values: IndexVec<Value, bool>,
    ops: Vec<bool>,
}

struct Sweep<'a> {
    function: &'a mut Function,
    needed: Needed,
    substitution: Substitution,
}

impl Sweep<'_> {
    /// Removes unneeded operations from a region whose first operation has the index `first`; returns the index after
    /// its last.
    fn region(&mut self, region: &mut Region, first: usize) -> usize {
        let mut number = first;
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            let needed = self.needed.ops[number];
            number += 1;
            if !needed {
                number += count_inside(&op.kind);
                continue;
            }
            self.prune(&mut op);
            self.substitution.apply_to_operands(&mut op.kind);
            for region in op.kind.regions_mut() {
                number = self.region(region, number);
            }
            ops.push(op);
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
        number
    }

    /// Removes the unneeded results of an `if` or a loop.
    fn prune(&mut self, op: &mut Op) {
        let results = op.results;
        let is_needed = |value: Value| self.needed.values[value];
        let keep: Vec<bool> = results.iter().map(is_needed).collect();
        match &mut op.kind {
            OpKind::If { then, otherwise, .. } => {
                retain(&mut then.yields, &keep, 0);
                retain(&mut otherwise.yields, &keep, 0);
            }
            OpKind::Loop { initial, body } => {
                retain(initial, &keep, 0);
                retain(&mut body.params, &keep, 0);
                retain(&mut body.yields, &keep, 1);
            }
            _ => return,
        }
        if keep.contains(&false) {
            op.results = self.renumbered(results, &keep);
        }
    }

    /// Allocates new consecutive values for the results to keep.
    fn renumbered(&mut self, results: Values, keep: &[bool]) -> Values {
        let kept = results.iter().zip(keep).filter(|(_, keep)| **keep).map(|(value, _)| value);
        let kept: Vec<Value> = kept.collect();
        let scalars: Vec<_> = kept.iter().map(|value| self.function.scalar(*value)).collect();
        let new = self.function.new_values(&scalars);
        for (old, new) in kept.into_iter().zip(new.iter()) {
            self.substitution.set(old, new);
        }
        new
    }
}

/// Keeps those values after the first `skipped` whose flag in `keep` is set.
fn retain(values: &mut Vec<Value>, keep: &[bool], skipped: usize) {
    let mut position = 0;
    values.retain(|_| {
        position += 1;
        position <= skipped || keep[position - 1 - skipped]
    });
}

/// Returns the number of operations nested in an operation.
fn count_inside(kind: &OpKind) -> usize {
    let mut count = 0;
    for region in kind.regions() {
        region.for_each_op(&mut |_| count += 1);
    }
    count
}

/// Removes locals that no operation uses; other variables are the interface and remain.
fn remove_unused_locals(function: &mut Function) {
    let mut used: IndexVec<VariableId, bool> =
        function.variables.iter().map(|variable| variable.kind != VariableKind::Local).collect();
    function.body.for_each_op(&mut |op| {
        if let OpKind::Load(variable, _) | OpKind::Store(variable, ..) = op.kind {
            used[variable] = true;
        }
    });
    if used.iter().all(|used| *used) {
        return;
    }
    let mut new_ids = IndexVec::default();
    let mut next = 0;
    for used in used.iter() {
        new_ids.push(VariableId(next));
        next += u32::from(*used);
    }
    let mut is_used = used.iter().copied();
    function.variables.retain(|_| is_used.next().unwrap_or(true));
    for output in &mut function.outputs {
        output.variable = new_ids[output.variable];
    }
    rename_variables(&mut function.body, &new_ids);
}

fn rename_variables(region: &mut Region, new_ids: &IndexVec<VariableId, VariableId>) {
    for op in &mut region.ops {
        match &mut op.kind {
            OpKind::Load(variable, _) | OpKind::Store(variable, ..) | OpKind::Length(variable) => {
                *variable = new_ids[*variable];
            }
            kind => kind.regions_mut().for_each(|region| rename_variables(region, new_ids)),
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn results_and_carried_values_go_one_by_one() {
        let text = "
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0
            %unused: f32 = sqrt %x
            %a: f32, %b: f32 = if %c {
                %y: f32 = negate %x %z: f32 = abs %x yield %y, %z
            } else { yield %x, %x }
            %l: f32, %m: f32, %n: f32 = loop (%p: f32 = %x, %q: f32 = %b, %r: f32 = %x) {
                %p2: f32 = add %p, %p %q2: f32 = add %q, %r %r2: f32 = add %r, %r
                repeat %c, %p2, %q2, %r2
            }
            return scratch:f@0 = %m";
        expect![[r#"
            %2: f32 = if %0 {
              %3: f32 = abs %1
              yield %3
            } else {
              yield %1
            }
            %4: f32, %5: f32 = loop (%6: f32 = %2, %7: f32 = %1) {
              %8: f32 = add %6, %7
              %9: f32 = add %7, %7
              repeat %0, %8, %9
            }
            return scratch:f@0 = %4
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn effects_and_the_operations_around_them_are_kept() {
        let text = "
            %c: bool = load scratch:b@0
            if %c { %r: f32 = rand yield } else { %x: f32 = load scratch:f@0 yield }
            loop () { repeat %c }
            return";
        expect![[r#"
            if %0 {
              %1: f32 = rand
              yield
            } else {
              yield
            }
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn unread_stores_are_removed_with_the_local() {
        let text = "
            %x: f32 = load scratch:f@0 %i: i32 = load scratch:i@0
            store local:s@0, %x
            store local:r@0, %i
            %y: i32 = load local:r@%i
            return scratch:i@0 = %y";
        let function = |function: &mut rtsl_ir::Function| {
            super::run(function);
            assert!(function.find_variable(rtsl_ir::VariableKind::Local, "s").is_none());
        };
        expect![[r#"
            store local:r@0, %0
            %1: i32 = load local:r@%0
            return scratch:i@0 = %1
        "#]]
        .assert_eq(&transformed(text, function));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
