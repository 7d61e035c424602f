//! The functions that a call could mean, while it is typed.

use rtsl::IncludeLoader;
use rtsl_sema::index::{Signature, Symbol};
use rtsl_spec::builtins::REFERENCE_METHODS;

use crate::cursor::Cursor;
use crate::declaration::DeclarationKind;
use crate::document::{Document, Meaning};

/// The functions that a call could mean.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignatureHelp {
    /// The functions, the likelier first.
    pub signatures: Vec<Signature>,
    /// The index of the first function that takes so many arguments.
    pub active: usize,
    /// The index of the argument at the cursor.
    pub argument: usize,
}

/// Returns the functions that the call around an offset of a text could mean.
pub fn signature_help(
    name: &str,
    text: &str,
    offset: usize,
    loader: &mut dyn IncludeLoader,
) -> Option<SignatureHelp> {
    let cursor = Cursor::at(text, offset);
    let (open, name_end, argument) = cursor.call()?;
    // The arguments may not be complete: the call is looked at without them.
    let rest = after_call(text, open);
    for closing in [")", ");", "));", ")) { }", "))) { }"] {
        let text = format!("{}{closing}{rest}", &text[..open]);
        let document = Document::new(name, &text, loader);
        let signatures = signatures_of(&document, name_end as u32);
        if !signatures.is_empty() {
            let takes = |signature: &Signature| signature.parameters.len() > argument;
            let active = signatures.iter().position(takes).unwrap_or(0);
            return Some(SignatureHelp { signatures, active, argument });
        }
    }
    None
}

/// The text after a call whose parenthesis ends before `open`: what follows its closing one on the line, or the next
/// line.
fn after_call(text: &str, open: usize) -> &str {
    let line = text[open..].find('\n').map_or(text.len(), |at| open + at);
    let mut nesting = 0;
    for (at, letter) in text[open..line].char_indices() {
        match letter {
            '(' => nesting += 1,
            ')' if nesting == 0 => return &text[open + at + 1..],
            ')' => nesting -= 1,
            _ => {}
        }
    }
    &text[line..]
}

fn signatures_of(document: &Document, name_end: u32) -> Vec<Signature> {
    let file = document.file();
    let ends_here = |span: rtsl::Span| span.file == file && span.end == name_end;
    if let Some(call) = document.analysis.index.calls.iter().find(|call| ends_here(call.name)) {
        let module = &document.analysis.module;
        let all = call.candidates.iter().map(|callee| Signature::of(module, *callee));
        let mut signatures: Vec<Signature> = all.collect();
        signatures.dedup();
        return signatures;
    }
    let Some(used) = document.uses().iter().find(|used| ends_here(used.span)) else {
        return Vec::new();
    };
    match document.meaning(used) {
        Meaning::Language(Symbol::Method(method)) => {
            let alike = REFERENCE_METHODS
                .iter()
                .filter(|it| it.role == method.role && it.name == method.name);
            let signature = |it: &rtsl_spec::builtins::ReferenceMethod| {
                let parameters = it.parameters.iter().map(|(name, ty)| format!("{ty} {name}"));
                Signature::from_parts(
                    &format!("{} {}", it.result, it.name),
                    parameters,
                    Some(it.doc),
                )
            };
            alike.map(signature).collect()
        }
        Meaning::Declared(id) => {
            let declaration = document.declarations.get(id);
            if declaration.kind != DeclarationKind::Struct {
                return Vec::new();
            }
            let fields =
                document.declarations.inside(Some(id)).map(|(_, field)| field.text.clone());
            let documentation = declaration.documentation.as_deref();
            vec![Signature::from_parts(&declaration.name, fields, documentation)]
        }
        Meaning::Language(_) | Meaning::Macro(_) => Vec::new(),
    }
}
