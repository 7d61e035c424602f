//! A shader of a stage as a class of RTSL.
//!
//! What a stage receives and passes on becomes members. Where only `main` names these, the functions stay at file scope
//! and `main` receives them as parameters, constant ones for what GLSL doesn't let assign. Elsewhere the whole text
//! stands in the class.

use std::collections::BTreeSet;

use crate::builtins;
use crate::case::{Shader, Stage, Version};
use crate::items::{Item, ItemKind, Storage, Variable, items};
use crate::tokens::{Kind, Token, tokens};

/// A translated shader.
#[derive(Clone, Debug)]
pub struct Translation {
    pub text: String,
    /// The variables that are members.
    pub variables: Vec<Variable>,
}

/// Translates a shader. `outputs` are variables that the case compares.
pub fn translate(shader: &Shader, version: Version, outputs: &BTreeSet<&str>) -> Translation {
    let stages = match shader.stage {
        Stage::Vertex => "v",
        Stage::Both => "vf",
        Stage::Fragment | Stage::Other => "f",
    };
    let (text, implied, limits) = without_builtins(&shader.text, stages, version);
    let tokens = tokens(&text);
    let mut items = items(&tokens, shader.stage == Stage::Vertex);
    for item in &mut items {
        if let ItemKind::Variables(variables) = &mut item.kind {
            let compared = variables.iter_mut().filter(|it| outputs.contains(it.name.as_str()));
            compared.for_each(|it| it.storage = Storage::Out);
        }
    }
    let translator =
        Translator { tokens: &tokens, items: &items, implied: &implied, limits: &limits };
    match translator.main_alone() {
        Some(main) => translator.at_file_scope(main),
        None => translator.in_class(),
    }
}

/// Gives the built-in variables other names, and returns declarations for them and for the limits.
fn without_builtins(text: &str, stages: &str, version: Version) -> (String, Vec<Variable>, String) {
    let has_old = text.contains("compatibility");
    let mut implied: Vec<Variable> = Vec::new();
    let mut limits = BTreeSet::new();
    let mut renamed = String::new();
    for token in tokens(text) {
        let parts =
            if token.kind == Kind::Directive { words(token.text) } else { vec![token.text] };
        for part in parts {
            if let Some(variable) = builtins::variable(part, stages, version, has_old) {
                renamed += &variable.name;
                if implied.iter().all(|it| it.name != variable.name) {
                    implied.push(variable);
                }
            } else if let Some(value) = builtins::limit(part) {
                renamed += &builtins::renamed(part);
                limits.insert(format!("const int {} = {value}; ", builtins::renamed(part)));
            } else {
                renamed += part;
            }
        }
    }
    (renamed, implied, limits.into_iter().collect())
}

/// Splits a directive into words and what is between them.
fn words(text: &str) -> Vec<&str> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut parts = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let differs = |c: char| is_word(c) != is_word(first);
        let (part, after) = rest.split_at(rest.find(differs).unwrap_or(rest.len()));
        parts.push(part);
        rest = after;
    }
    parts
}

struct Translator<'a> {
    tokens: &'a [Token<'a>],
    items: &'a [Item],
    implied: &'a [Variable],
    limits: &'a str,
}

impl Translator<'_> {
    fn declared(&self) -> impl Iterator<Item = (&Item, &Variable)> {
        self.items.iter().flat_map(|item| match &item.kind {
            ItemKind::Variables(variables) => variables.iter().map(|it| (item, it)).collect(),
            _ => Vec::new(),
        })
    }

    fn mains(&self) -> Vec<usize> {
        let is_main = |index: &usize| match &self.items[*index].kind {
            ItemKind::Function { name, body, .. } => name == "main" && body.is_some(),
            _ => false,
        };
        (0..self.items.len()).filter(is_main).collect()
    }

    /// The index of `main`, if it alone names variables, which are declared before it.
    fn main_alone(&self) -> Option<usize> {
        let [main] = self.mains()[..] else { return None };
        let ItemKind::Function { body: Some(body), has_parameters: false, .. } =
            &self.items[main].kind
        else {
            return None;
        };
        if !self.tokens[self.items[main].range.start].is("void") {
            return None;
        }
        if self.items.iter().any(|it| matches!(it.kind, ItemKind::StructVariables)) {
            return None;
        }
        let mut names = BTreeSet::new();
        for (item, variable) in self.declared() {
            let is_late = item.range.start > body.start;
            if is_late || item.is_conditional || !names.insert(variable.name.as_str()) {
                return None;
            }
        }
        if self.implied.iter().any(|it| !names.insert(it.name.as_str())) {
            return None;
        }
        let types = self.declared().map(|(_, it)| format!("{} {}", it.ty, it.sizes));
        if types.into_iter().any(|it| words(&it).iter().any(|it| names.contains(it))) {
            return None;
        }
        let is_outside = |at: usize| {
            let own = |item: &Item| {
                matches!(item.kind, ItemKind::Variables(_)) && item.range.contains(&at)
            };
            !body.contains(&at) && !self.items.iter().any(own)
        };
        let names_one = |token: &Token<'_>| words(token.text).iter().any(|it| names.contains(it));
        let relevant = |token: &Token<'_>| matches!(token.kind, Kind::Word | Kind::Directive);
        let mut outside =
            (0..self.tokens.len()).filter(|at| is_outside(*at)).map(|at| &self.tokens[at]);
        (!outside.any(|token| relevant(token) && names_one(token))).then_some(main)
    }

    fn text(&self, range: std::ops::Range<usize>) -> String {
        self.tokens[range].iter().map(|it| it.text).collect()
    }

    /// The ends of lines of an item that goes elsewhere: `__LINE__` stays the same.
    fn lines(&self, item: &Item) -> String {
        let text = self.text(item.range.clone());
        "\n".repeat(text.matches('\n').count())
    }

    /// The text with each item replaced; `head` stands before the first that is no directive.
    fn replaced(
        &self,
        head: &str,
        mut replacement: impl FnMut(usize, &Item) -> Option<String>,
    ) -> String {
        let is_directive = |item: &Item| matches!(item.kind, ItemKind::Directive);
        // Between `#if` and `#endif` it could be left out.
        let first = self.items.iter().position(|item| !is_directive(item) || item.is_conditional);
        let head = if first.is_some_and(|it| is_directive(&self.items[it])) {
            format!("{head}\n")
        } else {
            head.to_owned()
        };
        let mut text = String::new();
        let mut at = 0;
        for (index, item) in self.items.iter().enumerate() {
            text += &self.text(at..item.range.start);
            at = item.range.end;
            if Some(index) == first {
                text += &head;
            }
            text += &replacement(index, item).unwrap_or_else(|| self.text(item.range.clone()));
        }
        text += &self.text(at..self.tokens.len());
        text += if first.is_none() { head.trim_end() } else { "" };
        text
    }

    fn at_file_scope(&self, main: usize) -> Translation {
        let mut variables: Vec<Variable> = Vec::new();
        let mut locals = String::new();
        let declared = self.declared().map(|(_, variable)| variable);
        for variable in declared.chain(self.implied) {
            let Variable { name, ty, sizes, initial, storage, .. } = variable;
            if *storage == Storage::Global {
                let initial = initial.as_ref().map(|it| format!(" = {it}")).unwrap_or_default();
                locals += &format!("{ty} {name}{sizes}{initial}; ");
            } else {
                variables.push(variable.clone());
            }
        }
        let parameters = variables.iter().map(|it| {
            let passing = if it.storage == Storage::Out { "inout" } else { "const in" };
            format!("{passing} {} {}{}", it.ty, it.name, it.sizes)
        });
        let header =
            format!("void main({}) {{ {locals}{{", parameters.collect::<Vec<_>>().join(", "));
        let mut text = self.replaced(self.limits, |index, item| match &item.kind {
            ItemKind::Variables(_) => Some(self.lines(item)),
            ItemKind::Function { body: Some(body), .. } if index == main => {
                let before = self.text(item.range.start..body.start);
                let lines = "\n".repeat(before.matches('\n').count());
                Some(format!("{lines}{header}{}}}}}", self.text(body.clone())))
            }
            _ => None,
        });
        text += "\nclass GlslCase : rt_Texture;\n";
        text += &variables.iter().map(member).collect::<String>();
        let outs = variables.iter().filter(|it| it.storage == Storage::Out);
        let initials =
            outs.filter_map(|it| Some(format!("{} = {}; ", it.name, it.initial.as_ref()?)));
        let names = variables.iter().map(|it| it.name.as_str()).collect::<Vec<_>>().join(", ");
        text += &format!("void lookup() {{ {}main({names}); }}\n", initials.collect::<String>());
        Translation { text, variables }
    }

    fn in_class(&self) -> Translation {
        let variables: Vec<Variable> =
            self.declared().map(|(_, it)| it.clone()).chain(self.implied.iter().cloned()).collect();
        let names: BTreeSet<&str> = variables.iter().map(|it| it.name.as_str()).collect();
        let functions: BTreeSet<&str> = self
            .items
            .iter()
            .filter_map(|item| match &item.kind {
                ItemKind::Function { name, .. } => Some(name.as_str()),
                _ => None,
            })
            .collect();
        let is_computed = |variable: &Variable| {
            let Some(initial) = &variable.initial else { return false };
            let mut words = words(initial).into_iter();
            variable.storage == Storage::Out
                || words.any(|it| names.contains(it) || functions.contains(it))
        };
        let mut prologue = String::new();
        let implied: String = self.implied.iter().map(member).collect();
        let has_struct = self.items.iter().any(|it| matches!(it.kind, ItemKind::StructVariables));
        let is_file = variables.is_empty() && self.mains().is_empty() && !has_struct;
        let class = if is_file { "" } else { "class GlslCase : rt_Texture; " };
        let mut text = self.replaced(&format!("{}{class}{implied}", self.limits), |_, item| {
            if matches!(item.kind, ItemKind::StructVariables) {
                let tokens = &self.tokens[item.range.clone()];
                let start = tokens.iter().position(|it| it.is("struct")).unwrap_or(0);
                return Some(self.text(item.range.start + start..item.range.end));
            }
            let ItemKind::Variables(variables) = &item.kind else { return None };
            let mut members = String::new();
            for variable in variables {
                let mut variable = variable.clone();
                if is_computed(&variable) {
                    let initial = variable.initial.take().unwrap_or_default();
                    prologue += &format!("{} = {initial}; ", variable.name);
                }
                members += &member(&variable);
            }
            Some(members + &self.lines(item))
        });
        let class = if is_file { "class GlslCase : rt_Texture; " } else { "" };
        let call = if self.mains().is_empty() { "" } else { "main(); " };
        text += &format!("\n{class}void lookup() {{ {prologue}{call}}}\n");
        Translation { text, variables }
    }
}

fn member(variable: &Variable) -> String {
    let Variable { name, ty, sizes, initial, storage, .. } = variable;
    let (access, initial) = match storage {
        Storage::In => ("public", initial.as_deref()),
        Storage::Out => ("scratch", None),
        Storage::Global => ("private", initial.as_deref()),
    };
    let initial = initial.map(|it| format!(" = {it}")).unwrap_or_default();
    format!("{access} {ty} {name}{sizes}{initial}; ")
}
