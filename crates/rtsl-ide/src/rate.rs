//! The variables of a function that are the same for all rays of a packet, in calls for rays and one object.
//!
//! These are a part: the compiler, which looks at values after its passes, may find more.

use std::collections::HashSet;

use rtsl::Span;
use rtsl_sema::hir::{
    Expression, ExpressionKind, Function, LocalId, Module, Statement, StatementKind, Storage,
};
use rtsl_spec::Direction;
use rtsl_spec::builtins::{self, Builtin, Lowering, Usable};

use crate::visit;

/// Returns the variables of a method that are uniform, each with the span of its declaration.
pub(crate) fn uniform_locals(module: &Module, function: &Function) -> Vec<(LocalId, Span)> {
    let mut rates = Rates { module, function, varying: HashSet::new(), declared: Vec::new() };
    let parameters = (0..function.parameters.len() as u32).map(LocalId);
    rates.varying.extend(parameters);
    loop {
        let before = rates.varying.len();
        rates.declared.clear();
        rates.statements(&function.body, false);
        if rates.varying.len() == before {
            break;
        }
    }
    let Rates { varying, declared, .. } = rates;
    declared.into_iter().filter(|(local, _)| !varying.contains(local)).collect()
}

struct Rates<'m> {
    module: &'m Module,
    function: &'m Function,
    varying: HashSet<LocalId>,
    declared: Vec<(LocalId, Span)>,
}

impl Rates<'_> {
    /// `masked`: the statements run for a part of the rays only.
    fn statements(&mut self, body: &[Statement], masked: bool) {
        // After a jump of some rays the rest of the body runs for the others.
        let mut masked = masked;
        for statement in body {
            self.statement(statement, masked);
            masked |= self.jumps_for_some(std::slice::from_ref(statement), false);
        }
    }

    fn statement(&mut self, statement: &Statement, masked: bool) {
        match &statement.kind {
            StatementKind::Expression(value) => {
                self.effects(value, masked);
            }
            StatementKind::Declare(local, value) => {
                self.declared.push((*local, statement.span));
                if let Some(value) = value
                    && self.effects(value, masked)
                {
                    self.varying.insert(*local);
                }
            }
            StatementKind::Block(body) => self.statements(body, masked),
            StatementKind::If { condition, then, otherwise } => {
                let masked = self.effects(condition, masked) || masked;
                self.statements(then, masked);
                self.statements(otherwise, masked);
            }
            StatementKind::Switch { selector, cases } => {
                let masked = self.effects(selector, masked) || masked;
                cases.iter().for_each(|case| self.statements(&case.body, masked));
            }
            StatementKind::Loop(it) => {
                self.statements(&it.initializer, masked);
                let condition = it.condition.as_ref().is_some_and(|it| self.effects(it, masked));
                if let Some(local) = it.declaration.filter(|_| condition) {
                    self.varying.insert(local);
                }
                let masked = masked || condition || self.jumps_for_some(&it.body, false);
                self.statements(&it.body, masked);
                it.step.iter().for_each(|step| {
                    self.effects(step, masked);
                });
            }
            StatementKind::Illuminance(it) => self.statements(&it.body, true),
            StatementKind::Return(value) => {
                value.iter().for_each(|value| {
                    self.effects(value, masked);
                });
            }
            StatementKind::Print { .. } | StatementKind::Break | StatementKind::Continue => {}
        }
    }

    /// True if statements contain a jump under a varying condition.
    fn jumps_for_some(&self, body: &[Statement], masked: bool) -> bool {
        body.iter().any(|statement| match &statement.kind {
            StatementKind::Return(_) | StatementKind::Break | StatementKind::Continue => masked,
            StatementKind::Block(body) => self.jumps_for_some(body, masked),
            StatementKind::If { condition, then, otherwise } => {
                let masked = masked || self.is_varying(condition);
                self.jumps_for_some(then, masked) || self.jumps_for_some(otherwise, masked)
            }
            StatementKind::Switch { selector, cases } => {
                let masked = masked || self.is_varying(selector);
                cases.iter().any(|case| self.jumps_for_some(&case.body, masked))
            }
            StatementKind::Loop(it) => {
                let masked = masked || it.condition.as_ref().is_some_and(|it| self.is_varying(it));
                self.jumps_for_some(&it.body, masked)
            }
            StatementKind::Illuminance(it) => self.jumps_for_some(&it.body, true),
            StatementKind::Expression(_)
            | StatementKind::Declare(..)
            | StatementKind::Print { .. } => false,
        })
    }

    /// Notes what an expression assigns; returns whether its value is varying.
    fn effects(&mut self, whole: &Expression, masked: bool) -> bool {
        let mut assigned: Vec<(LocalId, bool)> = Vec::new();
        visit::expression(whole, &mut |expression| match &expression.kind {
            ExpressionKind::Assign { target, value, .. } => {
                let varies = masked || self.is_varying(value) || self.has_varying_index(target);
                assigned.extend(root(target).map(|local| (local, varies)));
            }
            ExpressionKind::Step { target, .. } => {
                let varies = masked || self.has_varying_index(target);
                assigned.extend(root(target).map(|local| (local, varies)));
            }
            // The operands of `&&`, `||` and `?:` run for some rays; what a call passes out is unknown.
            ExpressionKind::Call(_, arguments) => {
                assigned.extend(arguments.iter().filter_map(root).map(|it| (it, true)));
            }
            ExpressionKind::Builtin(call) if passes_out(call.builtin) => {
                assigned.extend(call.arguments.iter().filter_map(root).map(|it| (it, true)));
            }
            _ => {}
        });
        let varying = assigned.into_iter().filter(|(_, varies)| *varies).map(|(local, _)| local);
        self.varying.extend(varying.collect::<Vec<_>>());
        self.is_varying(whole)
    }

    fn has_varying_index(&self, target: &Expression) -> bool {
        match &target.kind {
            ExpressionKind::Index(base, index) => {
                self.is_varying(index) || self.has_varying_index(base)
            }
            ExpressionKind::Field(base, _) | ExpressionKind::Swizzle(base, _) => {
                self.has_varying_index(base)
            }
            _ => false,
        }
    }

    fn is_varying(&self, whole: &Expression) -> bool {
        let mut varies = false;
        visit::expression(whole, &mut |expression| {
            varies |= match &expression.kind {
                ExpressionKind::Local(local) => self.varying.contains(local),
                ExpressionKind::Member(member) => {
                    let class = self.function.class.map(|id| &self.module.classes[id.0 as usize]);
                    let storage = class.map(|class| class.members[member.0 as usize].storage);
                    !matches!(storage, Some(Storage::Public | Storage::Private))
                }
                ExpressionKind::State(_)
                | ExpressionKind::Textured(_)
                | ExpressionKind::Computed(..)
                | ExpressionKind::ReferenceCall(_)
                | ExpressionKind::Error => true,
                ExpressionKind::Call(id, _) => {
                    self.reads_ray(&self.module.functions[id.0 as usize], 0)
                }
                ExpressionKind::Builtin(call) => {
                    call.builtin.usable != Usable::Anywhere
                        || matches!(call.builtin.lowering, Lowering::Special(_))
                }
                _ => false,
            };
        });
        varies
    }

    /// True if a function may read what differs between rays, beside its parameters.
    fn reads_ray(&self, function: &Function, depth: u32) -> bool {
        if depth > 8 {
            return true;
        }
        let mut reads = false;
        visit::for_each_expression(function, &mut |expression| {
            reads |= match &expression.kind {
                ExpressionKind::State(_)
                | ExpressionKind::Textured(_)
                | ExpressionKind::Computed(..)
                | ExpressionKind::ReferenceCall(_) => true,
                ExpressionKind::Member(member) => {
                    let class = function.class.map(|id| &self.module.classes[id.0 as usize]);
                    class.is_none_or(|class| class.members[member.0 as usize].storage.is_of_ray())
                }
                ExpressionKind::Call(id, _) => {
                    self.reads_ray(&self.module.functions[id.0 as usize], depth + 1)
                }
                ExpressionKind::Builtin(call) => {
                    call.builtin.usable != Usable::Anywhere
                        || matches!(call.builtin.lowering, Lowering::Special(_))
                }
                _ => false,
            };
        });
        reads
    }
}

/// The variable whose part a place is.
fn root(place: &Expression) -> Option<LocalId> {
    match &place.kind {
        ExpressionKind::Local(local) => Some(*local),
        ExpressionKind::Index(base, _)
        | ExpressionKind::Field(base, _)
        | ExpressionKind::Swizzle(base, _) => root(base),
        _ => None,
    }
}

/// True if some form of a built-in function has an `out` parameter.
fn passes_out(builtin: &Builtin) -> bool {
    let parameters = builtins::overloads(builtin.name).iter().flat_map(|it| &it.parameters);
    parameters.into_iter().any(|parameter| parameter.direction != Direction::In)
}
