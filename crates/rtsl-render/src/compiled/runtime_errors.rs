//! Runtime errors of shaders.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rtsl::{Diagnostic, LoopOwners, Messages, Method, diagnostic_codes as codes};

use super::compiled_scene::CompiledScene;
use crate::statistics::NotFinite;

/// The runtime errors of a render: shaders that exceeded their loop budget, which ends the render, and values that are
/// not finite.
#[derive(Debug, Default)]
pub struct RuntimeErrors {
    any: AtomicBool,
    /// The classes and methods that exceeded their budget.
    exhausted: Mutex<Vec<(String, Method)>>,
    /// True if too many paths waited.
    many_paths: AtomicBool,
    /// The number of values of a class's method that were not finite.
    not_finite: Mutex<BTreeMap<(String, Method), u64>>,
    /// The number of samples that were evaluated again to find who made them so.
    causes: AtomicU64,
}

/// The greatest number of such samples: the interpreter evaluates them one by one, and all samples of an image may have
/// one cause.
const MAX_CAUSES: u64 = 1 << 12;

impl RuntimeErrors {
    /// True if an error ends the render.
    pub fn any(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }

    /// Records that methods have spawned more paths than are followed.
    #[cold]
    pub fn report_many_paths(&self) {
        self.any.store(true, Ordering::Relaxed);
        self.many_paths.store(true, Ordering::Relaxed);
    }

    /// Returns the methods that exceeded their budget, each once, in a fixed order.
    pub fn exhausted(&self) -> Vec<(String, Method)> {
        let mut list = self.exhausted.lock().map(|list| list.clone()).unwrap_or_default();
        list.sort();
        list
    }

    /// Records that a method of a class exceeded its budget.
    #[cold]
    pub fn report(&self, class: &str, method: Method) {
        self.any.store(true, Ordering::Relaxed);
        if let Ok(mut list) = self.exhausted.lock() {
            let entry = (class.to_owned(), method);
            if !list.contains(&entry) {
                list.push(entry);
            }
        }
    }
}

impl RuntimeErrors {
    /// Records `count` values of a method of a class that are not finite.
    #[cold]
    pub fn report_not_finite(&self, class: &str, method: Method, count: u64) {
        if let Ok(mut counts) = self.not_finite.lock() {
            *counts.entry((class.to_owned(), method)).or_default() += count;
        }
    }

    /// Counts a sample that is evaluated again to find the cause of a value that is not finite; false if there were
    /// enough.
    pub fn may_find_cause(&self) -> bool {
        self.causes.fetch_add(1, Ordering::Relaxed) < MAX_CAUSES
    }

    /// Takes the methods with values that are not finite, which are then forgotten.
    pub fn take_not_finite(&self) -> Vec<NotFinite> {
        let taken = self.not_finite();
        if let Ok(mut counts) = self.not_finite.lock() {
            counts.clear();
        }
        self.causes.store(0, Ordering::Relaxed);
        taken
    }

    /// Returns the methods with values that are not finite, in a fixed order.
    pub fn not_finite(&self) -> Vec<NotFinite> {
        let counts = self.not_finite.lock().map(|counts| counts.clone()).unwrap_or_default();
        let entries = counts.into_iter();
        entries
            .map(|((class, method), count)| NotFinite { class, method: method.name(), count })
            .collect()
    }
}

/// Returns the warning about samples that are not finite and count as black, with the methods that caused them.
pub fn dropped_samples(count: u64, not_finite: &[NotFinite]) -> Option<Diagnostic> {
    let message = match count {
        0 => return None,
        1 => "1 sample is not finite and counts as black".to_owned(),
        count => format!("{count} samples are not finite and count as black"),
    };
    let mut warning = Diagnostic::new(codes::DROPPED_SAMPLES, message);
    for NotFinite { class, method, count } in not_finite {
        let values =
            if *count == 1 { "1 value that is" } else { &format!("{count} values that are") };
        warning = warning.note(format!("`{method}` of `{class}` returned {values} not finite"));
    }
    let explained: u64 = not_finite.iter().map(|it| it.count).sum();
    if (MAX_CAUSES..count).contains(&explained) {
        let others = count - explained;
        warning =
            warning.note(format!("the methods were not looked for in {others} other samples"));
    }
    Some(warning.help(
        "check these methods and their textures for divisions by 0, for roots and logarithms of negative numbers, and for numbers beyond 3e38",
    ))
}

/// Returns the error messages for shaders that exceeded their budget.
pub fn exhausted_budgets(scene: &CompiledScene, errors: &RuntimeErrors) -> Messages {
    let mut messages = Messages::default();
    if errors.many_paths.load(Ordering::Relaxed) {
        let message = "the rays that `trace` traces become too many";
        let diagnostic = Diagnostic::new(codes::MANY_PATHS, message)
            .help("trace fewer rays at each surface")
            .help("`interactive` has `\"integer maxdepth\"`, and `\"float cutoff\"` for rays of little weight");
        messages.push_one(diagnostic);
    }
    for (class, method) in errors.exhausted() {
        let budget = scene.settings.loop_budget;
        let programs = scene.shaders.iter().map(|shader| &*shader.program);
        let index_in_class = programs.filter(|program| program.class().name == class);
        let owners = LoopOwners::of(&class, method, index_in_class);
        let message = format!("{} ran for more than {budget} loop iterations", owners.subject());
        let diagnostic = Diagnostic::new(codes::BUDGET_EXHAUSTED, message)
            .help("if the loop is finite, raise the integrator's `\"integer budget\"`");
        messages.push_one(match owners.note() {
            Some(note) => diagnostic.note(note),
            None => diagnostic,
        });
    }
    messages
}
