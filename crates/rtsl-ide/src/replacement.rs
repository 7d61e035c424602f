//! The declarations that replace others: functions their prototypes, and members of classes those of the classes that
//! they inherit.

use std::collections::HashMap;

use rtsl::FileId;

use crate::declaration::{DeclarationId, DeclarationKind, Declarations};

/// The greatest number of classes that inherit from each other, as the compiler accepts them.
const MAX_CHAIN: usize = 16;

/// Returns for each declaration the one that stands for it and for those that it replaces: in the class farthest up
/// that has it; of functions the first of the same parameters.
pub(crate) fn canonical_ids(declarations: &Declarations) -> Vec<DeclarationId> {
    let firsts = Firsts::of(declarations);
    declarations.iter().map(|(id, _)| firsts.canonical(id)).collect()
}

/// The first of the declarations that are alike, by what makes them alike.
struct Firsts<'d> {
    declarations: &'d Declarations,
    classes: HashMap<&'d str, DeclarationId>,
    /// Functions of a scope and a file.
    functions: HashMap<(Option<DeclarationId>, FileId, Header<'d>), DeclarationId>,
    /// Functions of a class.
    methods: HashMap<(DeclarationId, Header<'d>), DeclarationId>,
    /// Declarations of a class, by whether they are functions.
    members: HashMap<(DeclarationId, &'d str, bool), DeclarationId>,
}

/// The name of a function and the types of its parameters.
type Header<'d> = (&'d str, &'d [String]);

impl<'d> Firsts<'d> {
    fn of(declarations: &'d Declarations) -> Firsts<'d> {
        let mut firsts = Firsts {
            declarations,
            classes: HashMap::new(),
            functions: HashMap::new(),
            methods: HashMap::new(),
            members: HashMap::new(),
        };
        for (id, it) in declarations.iter() {
            let name = it.name.as_str();
            let header = (name, it.parameters.as_slice());
            let is_function = it.kind == DeclarationKind::Function;
            if it.kind == DeclarationKind::Class {
                firsts.classes.entry(name).or_insert(id);
            }
            if is_function {
                firsts.functions.entry((it.parent, it.span.file, header)).or_insert(id);
            }
            if let Some(parent) = it.parent {
                firsts.members.entry((parent, name, is_function)).or_insert(id);
                if is_function {
                    firsts.methods.entry((parent, header)).or_insert(id);
                }
            }
        }
        firsts
    }

    fn canonical(&self, id: DeclarationId) -> DeclarationId {
        let mut id = self.first_alike(id);
        // Classes that inherit from each other are errors, and end the search here.
        for _ in 0..MAX_CHAIN {
            let Some(above) = self.inherited(id) else { return id };
            id = self.first_alike(above);
        }
        id
    }

    /// The first declaration of the same function: its prototype.
    fn first_alike(&self, id: DeclarationId) -> DeclarationId {
        let it = self.declarations.get(id);
        let header = (it.name.as_str(), it.parameters.as_slice());
        match it.kind {
            DeclarationKind::Function => self.functions[&(it.parent, it.span.file, header)],
            _ => id,
        }
    }

    /// The declaration that one of a class replaces in the nearest class above that has it.
    fn inherited(&self, id: DeclarationId) -> Option<DeclarationId> {
        let declaration = self.declarations.get(id);
        let is_class =
            |id: &DeclarationId| self.declarations.get(*id).kind == DeclarationKind::Class;
        let mut class = declaration.parent.filter(is_class)?;
        // Classes that inherit from each other are errors, and end the search here.
        for _ in 0..MAX_CHAIN {
            class = self.parent_class(class)?;
            let name = declaration.name.as_str();
            let other = self.members.get(&(class, name, false));
            let function = match declaration.kind {
                DeclarationKind::Function => {
                    self.methods.get(&(class, (name, declaration.parameters.as_slice())))
                }
                _ => self.members.get(&(class, name, true)),
            };
            if let Some(found) = other.into_iter().chain(function).min() {
                return Some(*found);
            }
        }
        None
    }

    /// The class from which a class inherits.
    fn parent_class(&self, class: DeclarationId) -> Option<DeclarationId> {
        let bases = self.declarations.bases(class).iter();
        let names = bases.map(|base| base.rsplit('.').next().unwrap_or(base));
        let found = names.filter_map(|name| self.classes.get(name).copied());
        found.into_iter().find(|parent| *parent != class)
    }
}
