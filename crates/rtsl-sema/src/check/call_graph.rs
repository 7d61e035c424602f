//! Detects recursion, which the language does not allow.

use std::sync::Arc;

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::Checker;
use super::facts::{Call, Facts};
use crate::hir::FunctionId;

/// The number of calls of a cycle that a diagnostic shows.
const SHOWN: usize = 8;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Mark {
    New,
    /// On the path from the start.
    Open,
    Done,
}

impl Checker<'_> {
    /// Reports every cycle of calls once. The search keeps an explicit stack, because call graphs
    /// may be as deep as the text is long.
    pub(super) fn check_call_graph(&mut self) {
        let facts: Vec<Arc<Facts>> =
            self.function_info.iter().map(|info| Arc::clone(&info.facts)).collect();
        let mut marks = vec![Mark::New; facts.len()];
        for start in 0..facts.len() {
            if marks[start] != Mark::New {
                continue;
            }
            marks[start] = Mark::Open;
            // The functions on the path, each with the number of its calls that have been followed.
            let mut path: Vec<(usize, usize)> = vec![(start, 0)];
            while let Some((function, followed)) = path.last_mut() {
                let function = *function;
                let Some(call) = facts[function].calls.get(*followed) else {
                    marks[function] = Mark::Done;
                    path.pop();
                    continue;
                };
                *followed += 1;
                let callee = call.callee.0 as usize;
                match marks[callee] {
                    Mark::New => {
                        marks[callee] = Mark::Open;
                        path.push((callee, 0));
                    }
                    Mark::Open => self.report_cycle(&facts, &path, callee),
                    Mark::Done => {}
                }
            }
        }
    }

    /// Reports the cycle that the path's last call closes by leading back to `first`.
    fn report_cycle(&mut self, facts: &[Arc<Facts>], path: &[(usize, usize)], first: usize) {
        let start = path.iter().rposition(|(function, _)| *function == first).unwrap_or(0);
        let calls: Vec<(usize, Call)> = path[start..]
            .iter()
            .map(|(function, followed)| (*function, facts[*function].calls[followed - 1]))
            .collect();
        let name =
            |function: usize| format!("`{}`", self.function(FunctionId(function as u32)).name);
        let mut names: Vec<String> =
            calls.iter().take(SHOWN).map(|(function, _)| name(*function)).collect();
        if calls.len() > SHOWN {
            names.push(format!("{} more", calls.len() - SHOWN));
        }
        names.push(name(first));
        let Some((last, closing)) = calls.last() else { return };
        let mut diagnostic =
            Diagnostic::new(codes::RECURSION, format!("{} calls itself", name(first)))
                .at(closing.span, format!("{} calls {} here", name(*last), name(first)))
                .note("functions cannot call themselves, directly or through others");
        if calls.len() > 1 {
            diagnostic = diagnostic.note(format!("the calls are {}", names.join(" → ")));
        }
        for (function, call) in calls[..calls.len() - 1].iter().take(SHOWN) {
            let (caller, callee) = (name(*function), name(call.callee.0 as usize));
            diagnostic = diagnostic.label(call.span, format!("{caller} calls {callee} here"));
        }
        self.report(diagnostic.help("use a loop"));
    }
}
