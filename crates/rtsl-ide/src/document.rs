//! A text with what is known about it.

use rtsl::{Analysis, FileId, IncludeLoader, Span};
use rtsl_sema::index::{Symbol, Use};

use crate::cursor::Cursor;
use crate::declaration::{DeclarationId, Declarations};
use crate::macros::Macros;

/// A text, its analysis, and its declarations.
#[derive(Debug)]
pub struct Document {
    /// The analysis.
    pub analysis: Analysis,
    /// The declarations of the text and of the modules that it uses.
    pub declarations: Declarations,
    /// The macros of its files.
    pub macros: Macros,
    /// The uses of names whose text is the name, sorted by place: names that macros make are not among them.
    uses: Vec<Use>,
}

/// The word at an offset of a text.
#[derive(Clone, Debug)]
pub struct Word {
    /// The word.
    pub span: Span,
    /// Its meaning.
    pub meaning: Meaning,
    /// Its type, or the header of a function.
    pub ty: Option<String>,
}

/// The meaning of a word.
#[derive(Clone, Debug)]
pub enum Meaning {
    /// A declaration of the text or of a module.
    Declared(DeclarationId),
    /// A part of the language.
    Language(Symbol),
    /// A macro.
    Macro(Span),
}

impl Document {
    /// Analyses a text whose includes and modules come from `loader`. Diagnostics call it `name`.
    pub fn new(name: &str, text: &str, loader: &mut dyn IncludeLoader) -> Document {
        let analysis = Analysis::new(name, text, loader);
        let declarations = Declarations::of(&analysis);
        let macros = Macros::of(&analysis);
        let named = |it: &&Use| is_written(&analysis, &declarations, it);
        let mut uses: Vec<Use> = analysis.index.uses.iter().filter(named).cloned().collect();
        uses.sort_by_key(|it| (it.span.file, it.span.start, it.span.end));
        uses.dedup_by(|left, right| left.span == right.span);
        Document { analysis, declarations, macros, uses }
    }

    /// The text's file.
    pub fn file(&self) -> FileId {
        self.analysis.file
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.analysis.sources.file(self.file()).text
    }

    /// The uses of names in all files, sorted by place.
    pub fn uses(&self) -> &[Use] {
        &self.uses
    }

    /// The word at an offset of the text: one that contains it or ends there.
    pub fn word(&self, offset: u32) -> Option<Word> {
        let touches =
            |span: Span| span.file == self.file() && span.start <= offset && offset <= span.end;
        let declared = self.declarations.iter().find(|(_, it)| touches(it.span));
        if let Some((id, declaration)) = declared {
            let meaning = Meaning::Declared(id);
            return Some(Word { span: declaration.span, meaning, ty: None });
        }
        let used = self.uses.iter().filter(|it| touches(it.span));
        if let Some(used) = used.min_by_key(|it| it.span.end - it.span.start) {
            return Some(self.word_of(used));
        }
        // Comments are full of words.
        if Cursor::at(self.text(), offset as usize).is_inert {
            return None;
        }
        let (span, definition) = self.macros.at(self, offset)?;
        Some(Word { span, meaning: Meaning::Macro(definition), ty: None })
    }

    fn word_of(&self, used: &Use) -> Word {
        let meaning = match &used.symbol {
            Symbol::Declared(span) => match self.declarations.at(*span) {
                Some(id) => Meaning::Declared(id),
                None => Meaning::Language(used.symbol.clone()),
            },
            other => Meaning::Language(other.clone()),
        };
        Word { span: used.span, meaning, ty: used.ty.clone() }
    }

    /// The meaning of a use.
    pub fn meaning(&self, used: &Use) -> Meaning {
        self.word_of(used).meaning
    }
}

/// True if the text at the place of a use is the name that is used, and not that of a macro that makes it.
fn is_written(analysis: &Analysis, declarations: &Declarations, used: &Use) -> bool {
    let text = analysis.sources.text(used.span);
    match &used.symbol {
        Symbol::Declared(span) => {
            declarations.at(*span).is_none_or(|id| declarations.get(id).name == text)
        }
        Symbol::State(variable) => text == variable.name,
        Symbol::Builtin(name, _) => text == *name,
        Symbol::Method(method) => text == method.name,
        Symbol::Role(role) => text == role.class(),
        Symbol::Type(name) => text == name,
        Symbol::RayType(ray_type) => text == ray_type.name(),
    }
}
