//! Compiled files.

use std::sync::Arc;

use rtsl_ir::class::Class;
use rtsl_sema::prelude;
use rtsl_source::{Diagnostic, Diagnostics, SourceMap};

use crate::errors;

/// The classes of a file.
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// // The parameters of a class, for a user interface.
/// for parameter in &class.parameters {
///     assert_eq!((parameter.name.as_str(), rtsl::type_name(&parameter.ty)), ("radius", "float".to_owned()));
///     assert!(parameter.annotation("min").is_some() && !parameter.required);
///     assert_eq!(rtsl::default_value(class, parameter), Some(vec![1.0_f32.to_bits()]));
/// }
/// assert!(class.methods.contains_key(&rtsl::Method::Intersect));
/// assert!(unit.class("Bal").is_err_and(|error| error.help.join("").contains("Ball")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Unit {
    pub(crate) classes: Vec<Arc<Class>>,
}

impl Unit {
    /// The classes, in the order of the text.
    pub fn classes(&self) -> &[Arc<Class>] {
        &self.classes
    }

    /// Returns the class of this name.
    ///
    /// # Errors
    /// If there is none; the diagnostic suggests a similar name.
    pub fn class(&self, name: &str) -> Result<&Arc<Class>, Diagnostic> {
        let names = self.classes.iter().map(|class| class.name.as_str());
        let found = self.classes.iter().find(|class| class.name == name);
        found.ok_or_else(|| errors::unknown_class(name, names))
    }
}

/// The result of compiling a file.
///
/// ```
/// let compilation = rtsl::Compiler::default().compile("a.rtsl", "class A : rt_Texture;\nvoid lookup() { x = 1; }");
/// assert!(compilation.unit.is_none());
/// // As text and as data.
/// assert!(compilation.report(false).contains("a.rtsl:2:"));
/// let first = compilation.diagnostics.iter().next().expect("there is an error");
/// let span = first.primary.as_ref().expect("it has a place").span;
/// assert_eq!(compilation.sources.position(span.file, span.start).line, 2);
/// assert_eq!((first.severity, first.code.as_str()), (rtsl::Severity::Error, "E0201"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Compilation {
    /// The classes; `None` if there are errors.
    pub unit: Option<Unit>,
    /// Errors and warnings.
    pub diagnostics: Diagnostics,
    /// The texts that the diagnostics' spans point into.
    pub sources: SourceMap,
}

impl Compilation {
    /// True if a text may print. Comments may have the word, too.
    pub fn has_prints(&self) -> bool {
        self.sources.files().skip(prelude::FILES.len()).any(|(_, file)| file.text.contains("print"))
    }

    /// Returns all diagnostics as text for a terminal.
    pub fn report(&self, color: bool) -> String {
        rtsl_source::render::all_to_text(&self.sources, self.diagnostics.iter(), color)
    }
}
