//! The classes of references in libraries.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::class::{Class, Reference, ReferenceCount};
use rtsl_link::AttributeTable;
use rtsl_link::class_tree::{ClassTree, element_path};
use rtsl_source::{Diagnostic, diagnostic_codes as codes, with_article};

use crate::errors;

/// The greatest depth and size of a class's tree, as for instances.
const DEPTH_LIMIT: usize = 64;
const TREE_LIMIT: usize = 4096;

/// The classes that references refer to, by class and reference. A reference that is not bound is unset.
///
/// ```
/// use rtsl::{Compiler, aot::Bindings, library};
///
/// let compiler = Compiler::default();
/// let [ward, constant] = [
///     library::unit_of_class(&compiler, "Ward")?.class("Ward")?.clone(),
///     library::unit_of_class(&compiler, "Constant")?.class("Constant")?.clone(),
/// ];
/// let mut bindings = Bindings::default();
/// bindings.bind(&ward, "kd", &constant)?;
/// assert!(bindings.bind(&ward, "kd", &ward).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Bindings {
    /// By class and path.
    classes: BTreeMap<(String, String), Arc<Class>>,
}

impl Bindings {
    /// Binds a reference of `class`: a name, or an element of an array of references, `layers[2]`. This replaces an
    /// earlier binding.
    ///
    /// # Errors
    /// If the class has no such reference, or `to` lacks its role.
    pub fn bind(
        &mut self,
        class: &Class,
        reference: &str,
        to: &Arc<Class>,
    ) -> Result<(), Diagnostic> {
        let role = self.paths(class).find(|(path, _)| path == reference).map(|(_, role)| role);
        let role = role.ok_or_else(|| self.unknown_reference(class, reference))?;
        if !to.roles.contains(&role) {
            let problem = format!(
                "`{}.{reference}` refers to {}, and `{}` is none",
                class.name,
                with_article(role.name()),
                to.name
            );
            return Err(Diagnostic::new(codes::REFERENCE_ROLE, problem));
        }
        self.classes.insert((class.name.clone(), reference.to_owned()), to.clone());
        Ok(())
    }

    /// Returns a class with the classes of its references.
    pub(super) fn tree(&self, class: &Arc<Class>) -> Result<ClassTree, Diagnostic> {
        let mut size = 0;
        self.subtree(class, 0, &mut size).ok_or_else(|| errors::too_many_references(class))
    }

    /// Returns `None` past a limit.
    fn subtree(&self, class: &Arc<Class>, depth: usize, size: &mut usize) -> Option<ClassTree> {
        *size += 1;
        if depth >= DEPTH_LIMIT || *size > TREE_LIMIT {
            return None;
        }
        let mut references = Vec::new();
        for reference in &class.references {
            let mut elements = Vec::new();
            for index in 0..self.element_count(class, reference) {
                let key = (class.name.clone(), element_path(reference, index));
                let bound = self.classes.get(&key);
                elements.push(match bound {
                    Some(class) => Some(self.subtree(class, depth + 1, size)?),
                    None => None,
                });
            }
            references.push(elements);
        }
        Some(ClassTree { class: class.clone(), references, attributes: AttributeTable::default() })
    }

    /// Returns the number of elements of a reference: an array without a size has those that are bound, from the first
    /// on.
    fn element_count(&self, class: &Class, reference: &Reference) -> usize {
        match reference.count {
            ReferenceCount::Open => {
                let key = |index| (class.name.clone(), element_path(reference, index));
                (0..).take_while(|index| self.classes.contains_key(&key(*index))).count()
            }
            count => count.unset(),
        }
    }

    /// Returns the references of a class, with an entry for each element of an array, and for the next element of an
    /// array without a size.
    fn paths(&self, class: &Class) -> impl Iterator<Item = (String, rtsl_spec::Role)> {
        class.references.iter().flat_map(|reference| {
            let next = usize::from(reference.count == ReferenceCount::Open);
            let count = self.element_count(class, reference) + next;
            (0..count).map(move |index| (element_path(reference, index), reference.role))
        })
    }

    fn unknown_reference(&self, class: &Class, reference: &str) -> Diagnostic {
        let problem = format!("`{}` has no reference `{reference}`", class.name);
        let diagnostic = Diagnostic::new(codes::NO_SUCH_PARAMETER, problem);
        let names: Vec<String> = self.paths(class).map(|(path, _)| format!("`{path}`")).collect();
        if names.is_empty() {
            diagnostic.note(format!("`{}` has no references", class.name))
        } else {
            diagnostic.note(format!("it has {}", names.join(", ")))
        }
    }
}
