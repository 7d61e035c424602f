//! "Did you mean": suggests visible names in place of an unknown one.

use rtsl_source::{Diagnostic, Span, most_similar};
use rtsl_spec::builtins::Usable;
use rtsl_spec::{Role, builtins, state_variables};

use super::Checker;
use super::scope::{Entity, Level};
use super::type_names::builtin_type_names;

/// The limit on compared names for one unit. Past it no suggestions are made, so that a long text
/// full of unknown names does not take quadratic time.
pub(super) const COMPARISON_LIMIT: usize = 50_000;

/// Adds "did you mean" to a diagnostic about the name at `span`.
pub(super) fn suggest(diagnostic: Diagnostic, span: Span, similar: Option<String>) -> Diagnostic {
    match similar {
        Some(similar) => diagnostic.suggest("did you mean", span, similar),
        None => diagnostic,
    }
}

impl Checker<'_> {
    /// The value (variable, constant, state variable) or function that was probably meant.
    pub(super) fn similar_name(&mut self, name: &str) -> Option<String> {
        let similar = self.compared(name, |checker| {
            let levels = checker.levels().flat_map(value_names);
            checker.scopes.names().chain(levels).chain(checker.states_in_reach()).collect()
        });
        similar.or_else(|| self.similar_function(name))
    }

    /// The state variables in reach that end in the same word as `name`: `rt_ShadingNormal` and others for `rt_Normal`.
    pub(super) fn related_states(&self, name: &str) -> Vec<&'static str> {
        let start = name.rfind(|letter: char| letter.is_ascii_uppercase());
        let (Some(start), true) = (start, name.starts_with("rt_")) else { return Vec::new() };
        let word = &name[start..];
        self.states_in_reach().into_iter().filter(|state| state.ends_with(word)).collect()
    }

    /// The function that was probably meant.
    pub(super) fn similar_function(&mut self, name: &str) -> Option<String> {
        self.compared(name, |checker| {
            let shown = builtins::all().filter(|builtin| builtin.usable != Usable::Prelude);
            let builtin = shown.map(|builtin| builtin.name);
            let types = type_names().iter().map(String::as_str);
            checker.levels().flat_map(function_names).chain(builtin).chain(types).collect()
        })
    }

    /// The type that was probably meant.
    pub(super) fn similar_type(&mut self, name: &str) -> Option<String> {
        self.compared(name, |checker| {
            let types = type_names().iter().map(String::as_str);
            types.chain(checker.levels().flat_map(struct_names)).collect()
        })
    }

    /// The class that was probably meant.
    pub(super) fn similar_class(&mut self, name: &str) -> Option<String> {
        self.compared(name, |checker| {
            let classes = checker.classes.iter().map(|class| class.ast.name.name.as_str());
            Role::ALL.into_iter().map(|role| role.class()).chain(classes).collect()
        })
    }

    /// The one of `names` that was probably meant.
    pub(super) fn similar_of<'n>(
        &mut self,
        name: &str,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Option<String> {
        let names: Vec<&str> = names.into_iter().collect();
        self.comparisons = self.comparisons.checked_sub(names.len())?;
        most_similar(name, names).map(str::to_owned)
    }

    /// The candidate that was probably meant; `None` once the limit on comparisons is reached.
    fn compared(
        &mut self,
        name: &str,
        candidates: impl for<'s> FnOnce(&'s Self) -> Vec<&'s str>,
    ) -> Option<String> {
        if self.comparisons == 0 {
            return None;
        }
        let candidates = candidates(self);
        let left = self.comparisons.saturating_sub(candidates.len());
        let similar = most_similar(name, candidates).map(str::to_owned);
        self.comparisons = left;
        similar
    }

    fn levels(&self) -> impl Iterator<Item = &Level> {
        self.class.iter().map(|class| &class.names).chain(std::iter::once(&self.file))
    }

    /// The state variables of the class's roles.
    pub(super) fn states_in_reach(&self) -> Vec<&'static str> {
        let Some(class) = &self.class else { return Vec::new() };
        state_variables()
            .iter()
            .filter(|variable| !variable.is_hidden())
            .map(|variable| variable.name)
            .filter(|name| class.roles.iter().any(|role| role.row(name).is_some()))
            .collect()
    }
}

fn value_names(level: &Level) -> impl Iterator<Item = &str> {
    level.iter().filter_map(|(name, named)| match named.entity {
        Entity::Member(_) | Entity::Constant(..) | Entity::Local(_) => Some(name.as_str()),
        Entity::Struct(_)
        | Entity::Enumeration(_)
        | Entity::Functions(_)
        | Entity::Class(_)
        | Entity::Module
        | Entity::Error => None,
    })
}

fn function_names(level: &Level) -> impl Iterator<Item = &str> {
    level.iter().filter_map(|(name, named)| match named.entity {
        Entity::Functions(_) | Entity::Struct(_) => Some(name.as_str()),
        Entity::Enumeration(_)
        | Entity::Member(_)
        | Entity::Constant(..)
        | Entity::Local(_)
        | Entity::Class(_)
        | Entity::Module
        | Entity::Error => None,
    })
}

fn struct_names(level: &Level) -> impl Iterator<Item = &str> {
    level.iter().filter_map(|(name, named)| match named.entity {
        Entity::Struct(_) | Entity::Enumeration(_) => Some(name.as_str()),
        Entity::Functions(_)
        | Entity::Member(_)
        | Entity::Constant(..)
        | Entity::Local(_)
        | Entity::Class(_)
        | Entity::Module
        | Entity::Error => None,
    })
}

fn type_names() -> &'static [String] {
    static NAMES: std::sync::LazyLock<Vec<String>> = std::sync::LazyLock::new(builtin_type_names);
    &NAMES
}
