//! Identifiers that are valid in C++.

use std::collections::{BTreeMap, BTreeSet};

/// Keywords of C++ up to C++23, alternative operators, and lower-case macros that common headers or compilers define.
const TAKEN: &[&str] = &[
    "alignas",
    "alignof",
    "and",
    "and_eq",
    "asm",
    "assert",
    "auto",
    "bitand",
    "bitor",
    "bool",
    "break",
    "case",
    "catch",
    "char",
    "char16_t",
    "char32_t",
    "char8_t",
    "class",
    "co_await",
    "co_return",
    "co_yield",
    "compl",
    "complex",
    "concept",
    "const",
    "const_cast",
    "consteval",
    "constexpr",
    "constinit",
    "continue",
    "decltype",
    "default",
    "delete",
    "do",
    "double",
    "dynamic_cast",
    "else",
    "enum",
    "errno",
    "explicit",
    "export",
    "extern",
    "false",
    "far",
    "float",
    "for",
    "friend",
    "goto",
    "i386",
    "if",
    "inline",
    "int",
    "int32_t",
    "interface",
    "linux",
    "long",
    "major",
    "makedev",
    "max",
    "min",
    "minor",
    "mutable",
    "namespace",
    "near",
    "new",
    "noexcept",
    "not",
    "not_eq",
    "nullptr",
    "offsetof",
    "operator",
    "or",
    "or_eq",
    "private",
    "protected",
    "public",
    "register",
    "reinterpret_cast",
    "requires",
    "return",
    "setjmp",
    "short",
    "signed",
    "sizeof",
    "small",
    "static",
    "static_assert",
    "static_cast",
    "std",
    "stderr",
    "stdin",
    "stdout",
    "struct",
    "switch",
    "template",
    "this",
    "thread_local",
    "throw",
    "true",
    "try",
    "typedef",
    "typeid",
    "typename",
    "uint32_t",
    "uint64_t",
    "int64_t",
    "union",
    "unix",
    "unsigned",
    "using",
    "va_arg",
    "va_end",
    "va_start",
    "virtual",
    "void",
    "volatile",
    "wchar_t",
    "while",
    "xor",
    "xor_eq",
];

/// Returns `name` as an identifier: letters, digits and single underscores, not at its start, and neither a keyword nor
/// a name that looks like a macro.
pub(crate) fn identifier(name: &str) -> String {
    let mut result = String::with_capacity(name.len());
    for character in name.chars() {
        let character = if character.is_ascii_alphanumeric() { character } else { '_' };
        if character != '_' || !(result.is_empty() || result.ends_with('_')) {
            result.push(character);
        }
    }
    let result = result.trim_end_matches('_');
    if result.is_empty() || result.starts_with(|first: char| first.is_ascii_digit()) {
        return format!("value{}{result}", if result.is_empty() { "" } else { "_" });
    }
    if TAKEN.contains(&result) || looks_like_macro(result) {
        return format!("{result}_");
    }
    result.to_owned()
}

/// True for names of several letters, all upper-case; and for the imaginary unit of <complex.h>.
fn looks_like_macro(name: &str) -> bool {
    let has_small = name.chars().any(|character| character.is_ascii_lowercase());
    name == "I" || (name.len() > 1 && !has_small)
}

/// The names used in a scope.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scope {
    taken: BTreeSet<String>,
    /// The last number tried for each identifier: all lower ones are used.
    numbers: BTreeMap<String, u32>,
    /// The names that were assigned, in order.
    given: Vec<Given>,
}

/// An assigned name, and the identifier it was made from.
#[derive(Clone, Debug)]
struct Given {
    name: String,
    base: String,
    /// The last number tried before.
    number: Option<u32>,
}

/// A position to which a scope can be reverted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mark(usize);

impl Scope {
    /// Reserves these names unchanged.
    pub fn reserve<'a>(&mut self, names: impl IntoIterator<Item = &'a str>) {
        self.taken.extend(names.into_iter().map(str::to_owned));
    }

    /// Returns an unused identifier similar to `name`.
    pub fn name(&mut self, name: &str) -> String {
        let base = identifier(name);
        let mut unique = base.clone();
        let before = self.numbers.get(&base).copied();
        let mut number = before.unwrap_or(1);
        let separator = if base.ends_with(|last: char| last.is_ascii_digit()) { "_" } else { "" };
        while !self.taken.insert(unique.clone()) {
            number += 1;
            unique = format!("{base}{separator}{number}");
        }
        self.numbers.insert(base.clone(), number);
        self.given.push(Given { name: unique.clone(), base, number: before });
        unique
    }

    /// Returns the position at the start of a block.
    pub fn mark(&self) -> Mark {
        Mark(self.given.len())
    }

    /// Ends a block: its names can be assigned again.
    pub fn release(&mut self, mark: Mark) {
        for Given { name, base, number } in self.given.drain(mark.0..).rev() {
            self.taken.remove(&name);
            match number {
                Some(number) => self.numbers.insert(base, number),
                None => self.numbers.remove(&base),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_identifiers() {
        let table = [
            ("center", "center"),
            ("s.a", "s_a"),
            ("layers[2].scale", "layers_2_scale"),
            ("__x__y_", "x_y"),
            ("_Upper", "Upper"),
            ("float", "float_"),
            ("PI", "PI_"),
            ("I", "I_"),
            ("R", "R"),
            ("2d", "value_2d"),
            ("", "value"),
            ("größe", "gr_e"),
        ];
        for (name, expected) in table {
            assert_eq!(identifier(name), expected, "{name}");
        }
    }

    #[test]
    fn names_are_unique() {
        let mut scope = Scope::default();
        scope.reserve(["radius"]);
        assert_eq!(scope.name("radius"), "radius2");
        assert_eq!(scope.name("radius"), "radius3");
        assert_eq!(scope.name("radius2"), "radius2_2");
    }

    #[test]
    fn released_names_are_given_again() {
        let mut scope = Scope::default();
        assert_eq!(["p", "p", "q"].map(|name| scope.name(name)), ["p", "p2", "q"]);
        let block = scope.mark();
        assert_eq!(
            ["p4", "p", "p", "q", "r"].map(|name| scope.name(name)),
            ["p4", "p3", "p5", "q2", "r"]
        );
        let inner = scope.mark();
        assert_eq!(scope.name("p"), "p6");
        scope.release(inner);
        assert_eq!(scope.name("p"), "p6");
        scope.release(block);
        assert_eq!(["p", "q", "r"].map(|name| scope.name(name)), ["p3", "q2", "r"]);
    }

    #[test]
    fn many_names_alike_take_time_by_their_number() {
        // In quadratic time, this would take a billion look-ups, and minutes.
        const COUNT: u32 = 50_000;
        let (mut scope, start) = (Scope::default(), std::time::Instant::now());
        let last = (0..COUNT).map(|_| scope.name("p")).last();
        assert_eq!(last, Some(format!("p{COUNT}")));
        assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
    }
}
