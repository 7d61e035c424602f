//! Statements: each value of a graph is one, and equal ones are the same.

use std::collections::{BTreeSet, HashMap};

use crate::types::Type;

/// A value of a graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// The type.
    pub ty: Type,
    /// The expression: the name of a statement, or a constant. Of texts, the text itself.
    pub text: String,
    /// The numbers, if they are known.
    pub constant: Option<Vec<f64>>,
    /// For texture coordinates, the widths that a ray sees.
    pub footprint: Option<String>,
}

impl Value {
    /// A value with this expression.
    pub fn new(ty: Type, text: impl Into<String>) -> Self {
        Value { ty, text: text.into(), constant: None, footprint: None }
    }

    /// A value of known numbers.
    pub fn constant(ty: Type, numbers: Vec<f64>) -> Self {
        let text = crate::literal::rtsl(&numbers, ty);
        Value { ty, text, constant: Some(numbers), footprint: None }
    }

    /// The same value, of texture coordinates with this width.
    #[must_use]
    pub fn with_footprint(mut self, footprint: Option<String>) -> Self {
        self.footprint = footprint;
        self
    }
}

/// A statement `type name = expression;`.
#[derive(Clone, Debug)]
struct Statement {
    /// The type in RTSL.
    ty: String,
    expression: String,
}

/// The statements of a material, in their order.
#[derive(Clone, Debug, Default)]
pub struct Statements {
    list: Vec<Statement>,
    indices: HashMap<String, usize>,
}

/// The start of the statements' names.
const PREFIX: &str = "n";

impl Statements {
    /// The number of statements.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Adds a statement, unless an equal one exists, and returns its name.
    pub fn add(&mut self, ty: &str, expression: String) -> String {
        let key = format!("{ty} {expression}");
        let list = &mut self.list;
        let index = *self.indices.entry(key).or_insert_with(|| {
            list.push(Statement { ty: ty.to_owned(), expression });
            list.len() - 1
        });
        format!("{PREFIX}{index}")
    }

    /// The indices of the statements that an expression needs, in order.
    pub fn needed(&self, expression: &str) -> BTreeSet<usize> {
        let mut found = BTreeSet::new();
        let mut open: Vec<usize> = names(expression).collect();
        while let Some(index) = open.pop() {
            if index < self.list.len() && found.insert(index) {
                open.extend(names(&self.list[index].expression));
            }
        }
        found
    }

    /// The expressions of the statements that an expression needs.
    pub fn expressions(&self, expression: &str) -> impl Iterator<Item = (String, &str)> {
        let needed = self.needed(expression).into_iter();
        needed.map(|index| (format!("{PREFIX}{index}"), self.list[index].expression.as_str()))
    }

    /// Writes the statements that an expression needs, one a line.
    pub fn write(&self, expression: &str, out: &mut String) {
        for index in self.needed(expression) {
            let Statement { ty, expression } = &self.list[index];
            out.push_str(&format!("    {ty} {PREFIX}{index} = {expression};\n"));
        }
    }
}

/// The indices of the statements that an expression names.
fn names(expression: &str) -> impl Iterator<Item = usize> + '_ {
    let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '.';
    let words = expression.split(move |letter| !is_word(letter));
    words.filter_map(|word| {
        let rest = word.strip_prefix(PREFIX)?;
        let digits = rest.split('.').next().unwrap_or_default();
        digits.bytes().all(|byte| byte.is_ascii_digit()).then(|| digits.parse().ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_statements_are_one() {
        let mut statements = Statements::default();
        let first = statements.add("vec2", "rt_TextureUV".to_owned());
        let second = statements.add("float", format!("{first}.x * 2.0"));
        assert_eq!(statements.add("vec2", "rt_TextureUV".to_owned()), first);
        statements.add("float", "unused + n9x".to_owned());
        let mut out = String::new();
        statements.write(&format!("sin({second})"), &mut out);
        assert_eq!(out, "    vec2 n0 = rt_TextureUV;\n    float n1 = n0.x * 2.0;\n");
    }
}
