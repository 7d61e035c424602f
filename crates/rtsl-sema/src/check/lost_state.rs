//! Warns about state that is written and never read, and about an `intersect` that offers no hit.

use std::collections::BTreeSet;

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::builtins::{Lowering, Special};
use rtsl_spec::{Direction, Method, Role, Row, rows, state_variables};

use super::Checker;
use super::facts::UseKind;
use super::reached::{Reached, Root};
use super::references::quoted_list;
use crate::hir::StateId;

/// The writes of state in the methods of a class. A helper's write is lost only if it is lost for
/// every method that reaches it.
#[derive(Default)]
pub(super) struct LostWrites {
    lost: Vec<(Root, Reached, StateId)>,
    /// The spans of the writes that a caller or the method itself reads.
    kept: BTreeSet<Span>,
}

impl Checker<'_> {
    /// Notes the writes that a method reaches and that get lost: those to variables that do not
    /// pass out of the method, unless the method itself reads them, or another shader that it calls
    /// may read them.
    pub(super) fn note_lost_writes(
        &self,
        root: &Root,
        reached: &[Reached],
        writes: &mut LostWrites,
    ) {
        let Some(method) = root.method else { return };
        if root.roles.is_empty() || self.class_is_uncertain(root.class) {
            return;
        }
        let calls_others =
            reached.iter().any(|each| matches!(each.done.kind, UseKind::Reference(_)));
        let read: BTreeSet<StateId> = reached
            .iter()
            .filter_map(|each| match each.done.kind {
                UseKind::ReadState(id) => Some(id),
                _ => None,
            })
            .collect();
        for each in reached {
            let UseKind::WriteState(id) = each.done.kind else { continue };
            let name = state_variables()[id.0 as usize].name;
            let passes = root
                .roles
                .iter()
                .filter_map(|role| role.row(name))
                .any(|row| row.direction(method).is_some());
            if passes || calls_others || read.contains(&id) {
                writes.kept.insert(each.done.span);
            } else {
                writes.lost.push((root.clone(), *each, id));
            }
        }
    }

    /// Warns about the writes of a class that are never read. Does nothing after errors, since
    /// erroneous text may contain the reads.
    pub(super) fn report_lost_writes(&mut self, writes: LostWrites) {
        if self.errors > 0 {
            return;
        }
        for (root, reached, id) in writes.lost {
            if let (Some(method), false) = (root.method, writes.kept.contains(&reached.done.span)) {
                self.report_lost_write(&root, method, &reached, id);
            }
        }
    }

    fn report_lost_write(&mut self, root: &Root, method: Method, reached: &Reached, id: StateId) {
        let name = state_variables()[id.0 as usize].name;
        let mut diagnostic = Diagnostic::new(
            codes::LOST_STATE,
            format!("`{name}` is written in `{}`, and the value is discarded", method.name()),
        )
        .at(reached.done.span, "lost when the method returns");
        let results = results(method, &root.roles);
        if !results.is_empty() {
            diagnostic = diagnostic.note(format!(
                "`{}` passes out {}",
                method.name(),
                quoted_list(&results)
            ));
        }
        let others: Vec<&str> = methods_that_set(name, &root.roles);
        if !others.is_empty() {
            diagnostic = diagnostic.help(format!("set it in {}", quoted_list(&others)));
        }
        if method == Method::Intersect {
            diagnostic = diagnostic
                .help("a `scratch` member carries a value to the methods after `intersect`");
        }
        self.report_with_path(root, reached, diagnostic);
    }

    /// Warns about an `intersect` that does something and never offers a hit.
    pub(super) fn check_hits(&mut self, root: &Root, reached: &[Reached]) {
        let function = self.function(root.function);
        let (span, is_empty) = (function.span, function.body.is_empty());
        let offers = |each: &Reached| match each.done.kind {
            UseKind::Builtin(it) => it.builtin.lowering == Lowering::Special(Special::Hit),
            _ => false,
        };
        if root.method != Some(Method::Intersect)
            || is_empty
            || self.errors > 0
            || self.class_is_uncertain(root.class)
            || reached.iter().any(offers)
        {
            return;
        }
        let mut diagnostic =
            Diagnostic::new(codes::NEVER_HITS, "this `intersect` never calls `hit`")
                .at(span, "no ray meets this primitive");
        let sets_distance =
            root.written.iter().any(|id| state_variables()[id.0 as usize].name == "rt_HitDistance");
        if sets_distance {
            diagnostic = diagnostic.note("setting `rt_HitDistance` does not accept a hit");
        }
        self.report(diagnostic.help("offer the distance: `hit(t)`"));
    }
}

/// The table's rows for state of these roles.
fn rows_of(roles: &[Role]) -> impl Iterator<Item = &'static Row> {
    rows().iter().filter(|row| row.role.is_some_and(|role| roles.contains(&role)))
}

/// The state variables that a method passes out.
fn results(method: Method, roles: &[Role]) -> Vec<&'static str> {
    rows_of(roles).filter(|row| passes_out(row, method)).map(|row| row.name).collect()
}

/// The methods of the roles that pass the variable out.
fn methods_that_set(name: &str, roles: &[Role]) -> Vec<&'static str> {
    let mut methods = Vec::new();
    for role in roles {
        let row = role.row(name);
        let setting =
            role.methods().filter(|method| row.is_some_and(|row| passes_out(row, *method)));
        methods.extend(setting.map(Method::name));
    }
    methods
}

fn passes_out(row: &Row, method: Method) -> bool {
    matches!(row.direction(method), Some(Direction::Out | Direction::InOut))
}
