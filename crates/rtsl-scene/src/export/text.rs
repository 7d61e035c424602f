//! Text of directives in the format of pbrt-v4.

use std::fmt::Write as _;

use rtsl_math::Transform;

use crate::reader::push_quoted;

/// A text under construction, directive by directive.
#[derive(Default)]
pub struct Text {
    text: String,
    indentation: usize,
}

/// The parameters of a directive.
#[derive(Clone, Debug, Default)]
pub struct Parameters(Vec<String>);

impl Text {
    /// Returns the text.
    pub fn finish(self) -> String {
        self.text
    }

    /// Adds a line with a comment.
    pub fn comment(&mut self, comment: &str) {
        let line: String = comment.chars().filter(|letter| !letter.is_control()).collect();
        let _ = writeln!(self.text, "# {line}");
    }

    /// Adds an empty line.
    pub fn gap(&mut self) {
        self.text.push('\n');
    }

    /// Adds a directive without parameters.
    pub fn plain(&mut self, directive: &str) {
        self.indent();
        self.text.push_str(directive);
        self.text.push('\n');
    }

    /// Adds a directive that opens a block, which [`Text::close`] closes.
    pub fn open(&mut self, directive: &str, name: Option<&str>) {
        self.indent();
        self.text.push_str(directive);
        if let Some(name) = name {
            self.text.push(' ');
            push_quoted(&mut self.text, name);
        }
        self.text.push('\n');
        self.indentation += 1;
    }

    /// Closes a block.
    pub fn close(&mut self, directive: &str) {
        self.indentation -= 1;
        self.plain(directive);
    }

    /// Sets the current transform, unless it is the identity.
    pub fn transform(&mut self, transform: Transform) {
        if transform != Transform::IDENTITY {
            let columns = transform.columns().map(|number| number.to_string());
            self.plain(&format!("Transform [ {} ]", columns.join(" ")));
        }
    }

    /// Adds a directive with texts and parameters.
    pub fn directive(&mut self, directive: &str, texts: &[&str], parameters: Parameters) {
        self.indent();
        self.text.push_str(directive);
        for text in texts {
            self.text.push(' ');
            push_quoted(&mut self.text, text);
        }
        for parameter in parameters.0 {
            self.text.push('\n');
            self.indent();
            self.text.push_str("    ");
            self.text.push_str(&parameter);
        }
        self.text.push('\n');
    }

    fn indent(&mut self) {
        self.text.extend(std::iter::repeat_n("    ", self.indentation));
    }
}

impl Parameters {
    fn push(mut self, kind: &str, name: &str, values: &str) -> Self {
        self.0.push(format!("\"{kind} {name}\" [ {values} ]"));
        self
    }

    pub fn float(self, name: &str, value: f64) -> Self {
        self.push("float", name, &value.to_string())
    }

    pub fn floats(self, name: &str, values: &[f64]) -> Self {
        self.push("float", name, &list(values))
    }

    pub fn integer(self, name: &str, value: i64) -> Self {
        self.push("integer", name, &value.to_string())
    }

    pub fn boolean(self, name: &str, value: bool) -> Self {
        self.push("bool", name, if value { "true" } else { "false" })
    }

    pub fn rgb(self, name: &str, color: [f64; 3]) -> Self {
        self.push("rgb", name, &list(&color))
    }

    pub fn point(self, name: &str, point: [f64; 3]) -> Self {
        self.push("point3", name, &list(&point))
    }

    pub fn text(self, name: &str, value: &str) -> Self {
        self.texts(name, &[value])
    }

    pub fn texts(self, name: &str, values: &[&str]) -> Self {
        let mut quoted = String::new();
        for value in values {
            if !quoted.is_empty() {
                quoted.push(' ');
            }
            push_quoted(&mut quoted, value);
        }
        self.push("string", name, &quoted)
    }

    pub fn texture(self, name: &str, texture: &str) -> Self {
        let mut quoted = String::new();
        push_quoted(&mut quoted, texture);
        self.push("texture", name, &quoted)
    }
}

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}
