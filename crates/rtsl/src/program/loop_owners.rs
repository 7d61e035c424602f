//! The methods whose loops a call runs: the called one, and those that it calls through references. The loop of an
//! `illuminance` does not count, since it ends with the lights.

use std::collections::BTreeSet;

use rtsl_ir::{OpKind, ReferencePath, Region};
use rtsl_link::ClassTree;
use rtsl_spec::Method;

use super::program::Program;

/// The methods whose loops may have used up the budget of a call, for messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoopOwners {
    /// The class and method that were called.
    called: (String, Method),
    /// The methods with loops, each once.
    owners: Vec<(String, Method)>,
}

impl LoopOwners {
    /// Finds the owners for a call of `method` of the class; `programs` are its linked forms.
    pub fn of<'a>(
        class: &str,
        method: Method,
        programs: impl IntoIterator<Item = &'a Program>,
    ) -> LoopOwners {
        let mut owners = Vec::new();
        for program in programs {
            add_owners(program.tree(), method, &mut owners);
        }
        LoopOwners { called: (class.to_owned(), method), owners }
    }

    /// Returns the method to name first: the only one with loops, or else the called one.
    pub fn subject(&self) -> String {
        match self.owners.as_slice() {
            [only] if *only != self.called => {
                format!("{}, which {} calls,", shown(only), shown(&self.called))
            }
            _ => shown(&self.called),
        }
    }

    /// Lists the methods with loops, if there are several.
    pub fn note(&self) -> Option<String> {
        const SHOWN: usize = 4;
        let (first, more) =
            (self.owners.get(..SHOWN.min(self.owners.len()))?, self.owners.len() > SHOWN);
        let names: Vec<String> = first.iter().map(shown).collect();
        let end = if more { ", and others" } else { "" };
        (self.owners.len() > 1).then(|| format!("loops are in {}{end}", names.join(", ")))
    }
}

fn shown((class, method): &(String, Method)) -> String {
    format!("`{}` of `{class}`", method.name())
}

/// True if the loop is that of an `illuminance`.
fn is_over_lights(body: &Region) -> bool {
    body.ops.iter().any(|op| match &op.kind {
        OpKind::LightSample { .. } => true,
        OpKind::Loop { .. } => false,
        other => other.regions().any(is_over_lights),
    })
}

/// Adds the methods with loops that a call of `method` runs.
fn add_owners(tree: &ClassTree, method: Method, owners: &mut Vec<(String, Method)>) {
    let mut seen = BTreeSet::new();
    let mut pending = vec![(tree, method)];
    while let Some((tree, method)) = pending.pop() {
        // The limit of links bounds the tree, and each of its methods is read once.
        if !seen.insert((std::ptr::from_ref(tree).addr(), method)) {
            continue;
        }
        let Some(function) = tree.class.methods.get(&method) else { continue };
        let owner = (tree.class.name.clone(), method);
        function.body.for_each_op(&mut |op| match &op.kind {
            OpKind::Loop { body, .. } if !is_over_lights(body) && !owners.contains(&owner) => {
                owners.push(owner.clone());
            }
            OpKind::ReferenceCall(call) => {
                let index = tree.class.references.iter().position(|it| it.name == call.member);
                let elements = index.map_or(&[][..], |index| &tree.references[index]);
                let called = match call.path {
                    ReferencePath::Single => &elements[..elements.len().min(1)],
                    ReferencePath::Element(_) => elements,
                };
                pending.extend(called.iter().flatten().map(|tree| (tree, call.method)));
            }
            _ => {}
        });
    }
}
