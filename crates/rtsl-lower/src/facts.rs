//! The effects of functions on variables, determined before the functions are lowered.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_sema::hir::{
    Expression, ExpressionKind, FunctionId, LocalId, MemberId, Module, Passing, StateId, Statement,
    StatementKind, Type,
};
use rtsl_sema::walk::{Node, called, walk, walk_expression, walk_statements};
use rtsl_spec::builtins::{Lowering, Special};

use crate::state_table::{light_states, state_id};

/// The variable that an lvalue is part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Root {
    Local(LocalId),
    Member(MemberId),
    State(StateId),
    /// The flag that `hit` has accepted a hit.
    Accepted,
}

/// The effects of a function.
#[derive(Clone, Debug, Default)]
pub(crate) struct Facts {
    /// The members and state variables that it or any function it calls may write.
    pub writes: BTreeSet<Root>,
    /// The parameters and local variables that it writes; declarations do not count.
    pub written_locals: BTreeSet<LocalId>,
    /// The parameters and local variables that an expression names. Others are used for their size
    /// at most.
    pub named_locals: BTreeSet<LocalId>,
    /// The variables that have to be in memory because of dynamic indices: its parameters and local
    /// variables, and members indexed by it and all that it calls.
    pub indexed: BTreeSet<Root>,
    /// The parameters and local variables whose values contribute to a `precise` one.
    pub precise: BTreeSet<LocalId>,
    /// True if it or any function that it calls asks how a value changes over the width of the filter.
    pub asks_for_changes: bool,
}

/// The facts of all functions that a class uses.
#[derive(Debug, Default)]
pub(crate) struct FactTable {
    functions: BTreeMap<FunctionId, Facts>,
}

impl FactTable {
    /// Collects the facts of the functions that `nodes` and `functions` call, directly or
    /// indirectly.
    pub fn new(
        module: &Module,
        functions: impl IntoIterator<Item = FunctionId>,
        expressions: &[&Expression],
    ) -> FactTable {
        let mut table = FactTable::default();
        let mut roots: Vec<FunctionId> = functions.into_iter().collect();
        walk(expressions.iter().map(|value| Node::Expression(value)).collect(), |node| {
            roots.extend(callee(node));
        });
        for root in roots {
            table.add(module, root);
        }
        table
    }

    /// The facts of a function that the class uses.
    pub fn of(&self, function: FunctionId) -> &Facts {
        &self.functions[&function]
    }

    /// Adds `root` after all functions that it calls. Uses an explicit stack, since chains of calls
    /// may be long.
    fn add(&mut self, module: &Module, root: FunctionId) {
        let mut open = vec![(root, false)];
        while let Some((id, callees_done)) = open.pop() {
            if self.functions.contains_key(&id) {
                continue;
            }
            if callees_done {
                let facts = self.collect(module, id);
                self.functions.insert(id, facts);
                continue;
            }
            open.push((id, true));
            walk_statements(&module.functions[id.0 as usize].body, |node| {
                open.extend(callee(node).map(|callee| (callee, false)));
            });
        }
    }

    fn collect(&self, module: &Module, id: FunctionId) -> Facts {
        let function = &module.functions[id.0 as usize];
        let mut facts = Facts::default();
        walk_statements(&function.body, |node| {
            self.written_by(module, node, &mut |root| match root {
                Root::Local(local) => {
                    facts.written_locals.insert(local);
                }
                Root::Member(_) | Root::State(_) | Root::Accepted => {
                    facts.writes.insert(root);
                }
            });
            if let Node::Statement(Statement { kind: StatementKind::Illuminance(_), .. }) = node {
                facts.writes.extend(light_states().map(Root::State));
            }
            if let Some(callee) = callee(node) {
                let of_callee = self.of(callee);
                let not_local = |root: &&Root| !matches!(root, Root::Local(_));
                facts.indexed.extend(of_callee.indexed.iter().filter(not_local));
                facts.asks_for_changes |= of_callee.asks_for_changes;
            }
            if let Node::Expression(expression) = node {
                facts.indexed.extend(indexed_root(expression));
                match &expression.kind {
                    ExpressionKind::Local(local) => {
                        facts.named_locals.insert(*local);
                    }
                    ExpressionKind::Builtin(call) => {
                        let lowering = call.builtin.lowering;
                        facts.asks_for_changes |=
                            matches!(lowering, Lowering::Special(Special::Change(_)));
                    }
                    _ => {}
                }
            }
        });
        facts.precise = self.precise_locals(module, id);
        facts
    }

    /// Calls `report` for each variable that this node writes; for a call, that includes the
    /// callee's writes.
    fn written_by(&self, module: &Module, node: Node, report: &mut impl FnMut(Root)) {
        let Node::Expression(expression) = node else { return };
        match &expression.kind {
            ExpressionKind::Assign { target, .. } | ExpressionKind::Step { target, .. } => {
                root_of(target).map(&mut *report);
            }
            ExpressionKind::ReferenceCall(call) => {
                for name in call.method.also_sets {
                    report(Root::State(state_id(name)));
                }
            }
            ExpressionKind::Builtin(call)
                if call.builtin.lowering == Lowering::Special(Special::Hit) =>
            {
                report(Root::Accepted);
                report(Root::State(state_id("rt_HitDistance")));
            }
            _ => {}
        }
        if let Some((callee, arguments)) = called(expression) {
            self.of(callee).writes.iter().copied().for_each(&mut *report);
            let parameters = &module.functions[callee.0 as usize].parameters;
            for (argument, passing) in arguments.iter().zip(parameters) {
                if *passing != Passing::In {
                    root_of(argument).map(&mut *report);
                }
            }
        }
    }

    /// The variables declared outside the nodes that the nodes may change.
    pub fn assigned(&self, module: &Module, nodes: Vec<Node>) -> Assigned {
        let mut assigned = Assigned::default();
        let mut declared = BTreeSet::new();
        walk(nodes, |node| {
            self.written_by(module, node, &mut |root| {
                assigned.roots.insert(root);
            });
            if let Node::Statement(statement) = node {
                match &statement.kind {
                    StatementKind::Declare(local, _) => {
                        declared.insert(Root::Local(*local));
                    }
                    StatementKind::Return(_) => assigned.returns = true,
                    _ => {}
                }
            }
        });
        assigned.roots.retain(|root| !declared.contains(root));
        assigned
    }

    /// The variables whose values contribute to a `precise` variable or result, directly or through
    /// others.
    fn precise_locals(&self, module: &Module, id: FunctionId) -> BTreeSet<LocalId> {
        let function = &module.functions[id.0 as usize];
        let mut precise: BTreeSet<LocalId> = (0..)
            .map(LocalId)
            .zip(&function.locals)
            .filter(|(_, local)| local.precise)
            .map(|(id, _)| id)
            .collect();
        if precise.is_empty() && !function.precise {
            return precise;
        }
        let mut sources: BTreeMap<LocalId, BTreeSet<LocalId>> = BTreeMap::new();
        walk_statements(&function.body, |node| match node {
            Node::Statement(statement) => match &statement.kind {
                StatementKind::Declare(local, Some(value)) => {
                    sources.entry(*local).or_default().extend(locals_in(value));
                }
                StatementKind::Return(Some(value)) if function.precise => {
                    precise.extend(locals_in(value));
                }
                _ => {}
            },
            Node::Expression(expression) => {
                self.written_by(module, node, &mut |root| {
                    if let Root::Local(local) = root {
                        sources.entry(local).or_default().extend(locals_in(expression));
                    }
                });
            }
        });
        let mut open: Vec<LocalId> = precise.iter().copied().collect();
        while let Some(local) = open.pop() {
            for source in sources.remove(&local).unwrap_or_default() {
                if precise.insert(source) || sources.contains_key(&source) {
                    open.push(source);
                }
            }
        }
        precise
    }
}

/// The variables that a part of a function may change.
#[derive(Clone, Debug, Default)]
pub(crate) struct Assigned {
    pub roots: BTreeSet<Root>,
    /// True if it contains a `return`.
    pub returns: bool,
}

/// The variable that an lvalue denotes or is a part of.
pub(crate) fn root_of(target: &Expression) -> Option<Root> {
    let mut part = target;
    loop {
        match &part.kind {
            ExpressionKind::Local(id) => return Some(Root::Local(*id)),
            ExpressionKind::Member(id) => return Some(Root::Member(*id)),
            ExpressionKind::State(id) => return Some(Root::State(*id)),
            ExpressionKind::Swizzle(whole, _)
            | ExpressionKind::Field(whole, _)
            | ExpressionKind::Index(whole, _) => part = whole,
            _ => return None,
        }
    }
}

/// The maximum number of elements for which a dynamic index becomes selects instead of a memory
/// access.
pub(crate) const CHOICE: u32 = 4;

/// The variable that has to be in memory because this expression indexes it dynamically.
fn indexed_root(expression: &Expression) -> Option<Root> {
    let ExpressionKind::Index(whole, index) = &expression.kind else { return None };
    let Type::Array(element, count) = &whole.ty else { return None };
    let basic = !matches!(**element, Type::Array(..) | Type::Struct(_));
    let constant = matches!(index.kind, ExpressionKind::Constant(_));
    if constant || (*count <= CHOICE && basic) { None } else { root_of(whole) }
}

fn locals_in(expression: &Expression) -> BTreeSet<LocalId> {
    let mut locals = BTreeSet::new();
    walk_expression(expression, |node| {
        if let Node::Expression(Expression { kind: ExpressionKind::Local(id), .. }) = node {
            locals.insert(*id);
        }
    });
    locals
}

fn callee(node: Node) -> Option<FunctionId> {
    match node {
        Node::Expression(expression) => called(expression).map(|(function, _)| function),
        Node::Statement(_) => None,
    }
}
