//! The parts of a module shared by its functions: declarations, helpers, attributes.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use crate::TargetFeatures;

/// A module being written.
pub struct Module<'a> {
    pub target: &'a TargetFeatures,
    data: String,
    functions: String,
    declarations: BTreeSet<String>,
    /// The text of each helper, by name.
    helpers: BTreeMap<String, String>,
    uses_zero: bool,
    /// True if there are functions that keep no vectors on the stack.
    has_scalar_functions: bool,
    /// The attributes of further functions with vectors: whether the stack is aligned, and whether the function uses no
    /// instructions on bytes.
    vector_functions: BTreeSet<(bool, bool)>,
}

/// A zero word, whose address buffers without elements have.
pub const ZERO_WORD: &str = "@rtsl.zero";

impl<'a> Module<'a> {
    pub fn new(target: &'a TargetFeatures) -> Self {
        Module {
            target,
            data: String::new(),
            functions: String::new(),
            declarations: BTreeSet::new(),
            helpers: BTreeMap::new(),
            uses_zero: false,
            has_scalar_functions: false,
            vector_functions: BTreeSet::new(),
        }
    }

    pub fn add_function(&mut self, text: &str) {
        self.functions.push_str(text);
    }

    /// Adds types and constants.
    pub fn add_data(&mut self, text: &str) {
        self.data.push_str(text);
    }

    /// Adds the declaration of an intrinsic, `result @name(types)`, once.
    pub fn declare(&mut self, declaration: String) {
        self.declarations.insert(declaration);
    }

    /// Adds the definition of a helper of this name, once.
    pub fn define_helper(&mut self, name: &str, text: impl FnOnce() -> String) {
        if !self.helpers.contains_key(name) {
            self.helpers.insert(name.to_owned(), text());
        }
    }

    /// Adds the definition of [`ZERO_WORD`], once.
    pub fn use_zero(&mut self) {
        self.uses_zero = true;
    }

    /// Returns the attributes of a function that keeps no vectors on the stack.
    pub fn scalar_attributes(&mut self) -> &'static str {
        self.has_scalar_functions = true;
        "#2"
    }

    /// Returns the attributes of a function with vectors, which may be on the stack if `aligned`, and that uses no
    /// instructions on bytes if `without_bytes`. With those a mask of 32 lanes is in one register, into which the
    /// comparisons of two vectors are combined and which masked stores take apart again.
    pub fn vector_attributes(&mut self, aligned: bool, without_bytes: bool) -> &'static str {
        let name = vector_attributes(aligned, without_bytes);
        if name != "#0" {
            self.vector_functions.insert((aligned, without_bytes));
        }
        name
    }

    /// Returns the text.
    pub fn finish(self) -> String {
        let mut text = format!("target triple = \"{}\"\n\n", self.target.triple);
        if self.uses_zero {
            text.push_str(ZERO_WORD);
            text.push_str(
                " = private unnamed_addr constant [2 x i32] zeroinitializer, align 8\n\n",
            );
        }
        text.push_str(&self.data);
        text.push_str(&self.functions);
        for helper in self.helpers.values() {
            text.push_str(helper);
        }
        for declaration in &self.declarations {
            let _ = writeln!(text, "declare {declaration}");
        }
        // Realigned, since callers align the stack to 16 bytes: vectors spilled there would sometimes cross cache
        // lines, which costs the dielectric 4 to 8 percent.
        text.push('\n');
        let features = self.target.features.as_str();
        let realigned = " \"stackrealign\"";
        self.add_attributes(&mut text, "#0", realigned, &[features]);
        text.push_str("attributes #1 = { nounwind }\n");
        if self.has_scalar_functions {
            // With mask registers LLVM places comparisons of single floats in them, which delays branches: 1 percent of
            // a test of one ray with a sphere.
            let without_masks = if self.target.mask_registers { "-avx512f" } else { "" };
            self.add_attributes(&mut text, "#2", "", &[features, without_masks]);
        }
        for (aligned, without_bytes) in self.vector_functions.iter().copied() {
            let name = vector_attributes(aligned, without_bytes);
            let alignment = if aligned { realigned } else { "" };
            let fewer = if without_bytes { "-avx512bw" } else { "" };
            self.add_attributes(&mut text, name, alignment, &[features, fewer]);
        }
        text
    }

    fn add_attributes(&self, text: &mut String, name: &str, alignment: &str, features: &[&str]) {
        let features: Vec<&str> = features.iter().copied().filter(|it| !it.is_empty()).collect();
        let features = features.join(",");
        // Frames of more than a page probe each of their pages, so that none skips the guard page of a stack.
        let _ = write!(
            text,
            "attributes {name} = {{ nounwind \"frame-pointer\"=\"none\"{alignment} \"probe-stack\"=\"inline-asm\""
        );
        for (key, value) in
            [("target-cpu", self.target.cpu.as_str()), ("target-features", &features)]
        {
            if !value.is_empty() {
                let _ = write!(text, " \"{key}\"=\"{value}\"");
            }
        }
        text.push_str(" }\n");
    }
}

/// Returns the name of the attributes of functions with vectors.
fn vector_attributes(aligned: bool, without_bytes: bool) -> &'static str {
    match (aligned, without_bytes) {
        (true, false) => "#0",
        (true, true) => "#3",
        (false, false) => "#4",
        (false, true) => "#5",
    }
}
