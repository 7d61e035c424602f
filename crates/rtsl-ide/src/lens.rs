//! The commands that an editor offers beside classes and methods.

use rtsl::{Method, Span};

use crate::declaration::DeclarationKind;
use crate::document::Document;

/// A command beside a declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lens {
    /// The name of the class or method.
    pub span: Span,
    /// The class.
    pub class: String,
    /// The method to measure; `None` to test the class.
    pub method: Option<String>,
}

/// Returns the commands of the classes of a text.
pub fn lenses(document: &Document) -> Vec<Lens> {
    let mut lenses = Vec::new();
    let classes = document
        .declarations
        .inside(None)
        .filter(|(_, it)| it.kind == DeclarationKind::Class && it.span.file == document.file());
    for (id, class) in classes {
        lenses.push(Lens { span: class.span, class: class.name.clone(), method: None });
        for (_, function) in document.declarations.inside(Some(id)) {
            let is_method = function.kind == DeclarationKind::Function
                && function.span.file == document.file()
                && Method::from_name(&function.name).is_some();
            if is_method {
                let method = Some(function.name.clone());
                lenses.push(Lens { span: function.span, class: class.name.clone(), method });
            }
        }
    }
    lenses
}
