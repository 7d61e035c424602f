//! What goes wrong while rendering.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rtsl::{Diagnostic, LoopOwners, Messages, Method, diagnostic_codes as codes};

use super::compiled_scene::CompiledScene;
use crate::statistics::NotFinite;

/// What went wrong while rendering: a shader ran past its budget, which ends the render; or it gave values that are not
/// finite.
#[derive(Debug, Default)]
pub struct RuntimeErrors {
    any: AtomicBool,
    /// Class and method.
    exhausted: Mutex<Vec<(String, Method)>>,
    /// How many values of a class's method were not finite.
    not_finite: Mutex<BTreeMap<(String, Method), u64>>,
}

impl RuntimeErrors {
    /// Whether there is any that ends the render.
    pub fn any(&self) -> bool {
        self.any.load(Ordering::Relaxed)
    }

    /// The methods that ran past their budget, each once, in a fixed order.
    pub fn exhausted(&self) -> Vec<(String, Method)> {
        let mut list = self.exhausted.lock().map(|list| list.clone()).unwrap_or_default();
        list.sort();
        list
    }

    /// A method of a class ran past its budget.
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
    /// A method of a class gave so many values that are not finite.
    #[cold]
    pub fn report_not_finite(&self, class: &str, method: Method, count: u64) {
        if let Ok(mut counts) = self.not_finite.lock() {
            *counts.entry((class.to_owned(), method)).or_default() += count;
        }
    }

    /// The methods that gave values which are not finite, in a fixed order.
    pub fn not_finite(&self) -> Vec<NotFinite> {
        let counts = self.not_finite.lock().map(|counts| counts.clone()).unwrap_or_default();
        let entries = counts.into_iter();
        entries
            .map(|((class, method), count)| NotFinite { class, method: method.name(), count })
            .collect()
    }
}

/// What to say of shaders that ran past their budget.
pub fn exhausted_budgets(scene: &CompiledScene, problems: &RuntimeErrors) -> Messages {
    let mut messages = Messages::default();
    for (class, method) in problems.exhausted() {
        let budget = scene.settings.loop_budget;
        let programs = scene.shaders.iter().map(|shader| &*shader.program);
        let of_class = programs.filter(|program| program.class().name == class);
        let owners = LoopOwners::of(&class, method, of_class);
        let message = format!("{} ran for more than {budget} loop iterations", owners.subject());
        let diagnostic = Diagnostic::new(codes::BUDGET_EXHAUSTED, message)
            .help("if it does end, raise the integrator's `\"integer budget\"`");
        messages.push_one(match owners.note() {
            Some(note) => diagnostic.note(note),
            None => diagnostic,
        });
    }
    messages
}
