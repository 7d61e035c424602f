//! The rules for methods of each role: state variables, built-in functions that need a ray,
//! members.
//!
//! A state variable is checked against the roles of the class where it is named, and at the end
//! against each interface method that reaches the use through calls, because several methods may
//! call one helper. A variable that the table does not list for a method is local to the call
//! there: it starts with its default, may be written, and reading it without writing it gives a
//! warning.
//!
//! `hit` belongs to `intersect`; `trace`, `occluded`, `ambient`, `illuminance` and calls of another
//! material's `shade` to `shade`; `inside` to the methods of materials; `rand` and calls of other
//! shaders to every method. The constructor has no ray, so it has none of these.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes, with_article};
use rtsl_spec::builtins::{Overload, ReferenceMethod, Usable};
use rtsl_spec::{Direction, Method, Role, StateVariable, state_variables};

use super::Checker;
use super::expressions::error_of_type;
use super::facts::{Facts, UseKind};
use super::functions::Kind;
use super::lost_state::LostWrites;
use super::reached::{Reached, Root};
use super::references::quoted_list;
use super::types::from_state;
use crate::hir::{ClassId, Expression, ExpressionKind, FunctionId, MemberId, StateId, Storage};

impl Checker<'_> {
    /// Checks the name of a state variable in an expression.
    pub(super) fn check_state(
        &mut self,
        variable: &'static StateVariable,
        span: Span,
    ) -> Expression {
        let place = match (&self.class, self.function.kind) {
            (Some(_), Kind::ClassFunction) if self.function.is_constructor => {
                Some("the constructor runs before there is a ray")
            }
            (Some(_), Kind::ClassFunction) => None,
            (_, Kind::Initializer | Kind::Constant) => {
                Some("this is computed before there is a ray")
            }
            (None, _) | (_, Kind::FileFunction) => {
                Some("functions at file scope have no role; pass it as an argument")
            }
        };
        if let Some(reason) = place {
            self.report(
                Diagnostic::new(
                    codes::STATE_OUT_OF_PLACE,
                    format!("the state variable `{}` cannot be used here", variable.name),
                )
                .at(span, "only methods of classes can use state variables")
                .note(reason),
            );
            return error_of_type(from_state(variable.ty), span);
        }
        if !self.class_has_state(variable.name) {
            self.report_state_of_other_role(variable, span);
            return error_of_type(from_state(variable.ty), span);
        }
        let kind = ExpressionKind::State(StateId(variable.index));
        Expression { kind, ty: from_state(variable.ty), span }
    }

    /// True if some role of the class has the state variable.
    pub(super) fn class_has_state(&self, name: &str) -> bool {
        self.class.as_ref().is_some_and(|class| {
            class.roles_unknown || class.roles.iter().any(|role| role.row(name).is_some())
        })
    }

    fn report_state_of_other_role(&mut self, variable: &StateVariable, span: Span) {
        let Some(class) = &self.class else { return };
        let owners: Vec<Role> =
            Role::ALL.into_iter().filter(|role| role.row(variable.name).is_some()).collect();
        let own = role_list(&class.roles, "and");
        let class_name = class.name.clone();
        let message =
            format!("{own} cannot access a state variable of {}", role_list(&owners, "or"));
        let diagnostic = Diagnostic::new(codes::STATE_OF_OTHER_ROLE, message)
            .at(span, format!("`{}` is not a state variable of {own}", variable.name))
            .note(format!("the class `{class_name}` is {}", with_article(&own)))
            .note(format!(
                "`{}` is a state variable of {}",
                variable.name,
                role_list(&owners, "and")
            ));
        let similar = self.similar_of(variable.name, self.states_in_reach());
        self.report(super::suggestions::suggest(diagnostic, span, similar));
    }

    /// Checks everything that the methods of all classes reach.
    pub(super) fn check_roles(&mut self) {
        for index in 0..self.module.classes.len() {
            let mut lost = LostWrites::default();
            for root in self.roots(ClassId(index as u32)) {
                self.check_root(root, &mut lost);
            }
            self.report_lost_writes(lost);
        }
    }

    /// The constructor and the methods that the class wrote. Everything that implied methods reach
    /// is also reached from these, except the text of the implied methods.
    fn roots(&self, id: ClassId) -> Vec<Root> {
        let class = &self.module.classes[id.0 as usize];
        let constructor = class.constructor.iter().map(|constructor| (None, constructor.function));
        let methods = class.methods.iter().map(|(method, function)| (Some(*method), *function));
        constructor
            .chain(methods)
            .filter(|(_, function)| !self.function_info[function.0 as usize].is_implied)
            .map(|(method, function)| {
                let belongs = |role: &Role| method.is_some_and(|each| each.roles().contains(role));
                let roles = class.roles.iter().copied().filter(belongs).collect();
                Root { class: id, function, method, roles, written: BTreeSet::new() }
            })
            .collect()
    }

    fn check_root(&mut self, mut root: Root, lost: &mut LostWrites) {
        let reached = self.reach(root.function, root.method.is_none());
        root.written = reached
            .iter()
            .filter_map(|each| match each.done.kind {
                UseKind::WriteState(id) => Some(id),
                _ => None,
            })
            .collect();
        for each in &reached {
            self.check_use(&root, each);
        }
        self.check_textured_reads(&root, &reached);
        self.check_hits(&root, &reached);
        self.note_lost_writes(&root, &reached, lost);
    }

    /// All uses in `start` and the functions that it calls, directly or indirectly: writes of state for each interface
    /// method through which they are reached, others once. The constructor computes no parameters.
    pub(super) fn reach(&self, start: FunctionId, is_constructor: bool) -> Vec<Reached> {
        let mut seen: BTreeSet<(FunctionId, bool, Option<Method>)> = BTreeSet::new();
        let mut pending = vec![(start, false, None)];
        let mut searched: BTreeSet<(FunctionId, bool)> = BTreeSet::new();
        let mut reached = Vec::new();
        while let Some((function, lit, within)) = pending.pop() {
            let facts: &Arc<Facts> = &self.function_info[function.0 as usize].facts;
            let is_first = searched.insert((function, lit));
            for &done in &facts.uses {
                if is_first || matches!(done.kind, UseKind::WriteState(_)) {
                    reached.push(Reached { function, done, lit: lit || done.lit, within });
                }
            }
            let runs = |call: &&super::facts::Call| !(is_constructor && call.of_parameter);
            for call in facts.calls.iter().filter(runs) {
                let within = self.interface_method(call.callee).or(within);
                let next = (call.callee, lit || call.lit, within);
                if seen.insert(next) {
                    pending.push(next);
                }
            }
        }
        reached
    }

    /// The interface method that a function of a class is.
    fn interface_method(&self, function: FunctionId) -> Option<Method> {
        let function = self.function(function);
        Method::from_name(&function.name).filter(|_| function.class.is_some())
    }

    fn check_use(&mut self, root: &Root, reached: &Reached) {
        match reached.done.kind {
            UseKind::ReadState(id) => self.check_state_read(root, reached, id),
            UseKind::WriteState(id) => self.check_state_write(root, reached, id),
            UseKind::WriteMember(id) => self.check_member_write(root, reached, id),
            UseKind::ReadScratch(id) => self.check_scratch_read(root, reached, id),
            UseKind::ReadAttribute(id) => self.check_attribute_read(root, reached, id),
            UseKind::ReadTextured(_) => {}
            UseKind::Builtin(overload) => self.check_builtin_use(root, reached, overload),
            UseKind::Reference(method) => self.check_reference_use(root, reached, method),
            UseKind::Illuminance => {
                if root.method != Some(Method::Shade) {
                    self.report_out_of_place(root, reached, "`illuminance`", "`shade`");
                }
            }
        }
    }

    fn check_state_write(&mut self, root: &Root, reached: &Reached, id: StateId) {
        let Some(method) = root.method else { return };
        let name = state_variables()[id.0 as usize].name;
        let rows: Vec<_> = root.roles.iter().filter_map(|role| role.row(name)).collect();
        if reached.lit && rows.iter().any(|row| row.illuminance) {
            let diagnostic = Diagnostic::new(
                codes::LIGHT_SAMPLE_READ_ONLY,
                format!("`{name}` cannot be written inside `illuminance`"),
            )
            .at(reached.done.span, "holds the light's sample here");
            return self.report_with_path(root, reached, diagnostic);
        }
        let is_read_only =
            |method: Method| rows.iter().any(|row| row.direction(method) == Some(Direction::In));
        // A method that the class calls itself may set what it passes out.
        let passes_out = |method: Method| {
            let directions = || rows.iter().filter_map(move |row| row.direction(method));
            directions().any(|it| it != Direction::In)
        };
        if is_read_only(method) && !reached.within.is_some_and(passes_out) {
            let role = role_list(&root.roles, "and");
            let diagnostic = Diagnostic::new(
                codes::STATE_READ_ONLY,
                format!("`{name}` cannot be written in `{}`", method.name()),
            )
            .at(reached.done.span, format!("an `in` state variable of {role}"))
            .note(format!("the host sets `{name}` before it calls `{}`", method.name()));
            self.report_with_path(root, reached, diagnostic);
        }
    }

    fn check_state_read(&mut self, root: &Root, reached: &Reached, id: StateId) {
        let Some(method) = root.method else { return };
        if root.written.contains(&id) {
            return;
        }
        let name = state_variables()[id.0 as usize].name;
        let rows: Vec<_> = root.roles.iter().filter_map(|role| role.row(name)).collect();
        let has_value = rows
            .iter()
            .any(|row| row.direction(method).is_some() || (reached.lit && row.illuminance));
        if has_value || self.class_is_uncertain(root.class) {
            return;
        }
        let mut diagnostic = Diagnostic::new(
            codes::STATE_WITHOUT_VALUE,
            format!("`{name}` has no value in `{}`", method.name()),
        )
        .at(reached.done.span, "reads its default");
        if rows.iter().any(|row| row.illuminance) && method == Method::Shade {
            diagnostic = diagnostic.note("it has a value inside the body of `illuminance`");
        }
        self.report_with_path(root, reached, diagnostic);
    }

    /// True if a base of the class is unknown, so that its roles are unknown too.
    pub(super) fn class_is_uncertain(&self, id: ClassId) -> bool {
        self.classes.get(id.0 as usize).is_some_and(|class| class.roles_unknown)
    }

    fn check_member_write(&mut self, root: &Root, reached: &Reached, id: MemberId) {
        let member = &self.module.classes[root.class.0 as usize].members[id.0 as usize];
        let (name, storage) = (member.name.clone(), member.storage);
        match (root.method, storage) {
            (_, Storage::Attribute) => self.check_attribute_write(root, reached, id),
            (None, Storage::Scratch | Storage::Output) => self.report_scratch(root, reached, &name),
            (None, Storage::Public | Storage::Private)
            | (Some(_), Storage::Scratch | Storage::Output) => {}
            (Some(method), Storage::Public | Storage::Private) => {
                let diagnostic = Diagnostic::new(
                    codes::INSTANCE_WRITE,
                    format!(
                        "`{name}` is written in `{}`, and the value is discarded",
                        method.name()
                    ),
                )
                .at(reached.done.span, "lost when the method returns")
                .note("members of the instance are one value for all rays")
                .help("use a variable, or a `scratch` member to pass it to later methods");
                self.report_with_path(root, reached, diagnostic);
            }
        }
    }

    fn check_scratch_read(&mut self, root: &Root, reached: &Reached, id: MemberId) {
        if root.method.is_none() {
            let member = &self.module.classes[root.class.0 as usize].members[id.0 as usize];
            let name = member.name.clone();
            self.report_scratch(root, reached, &name);
        }
    }

    /// Warns about parameters that the constructor reads although they may be textures.
    fn check_textured_reads(&mut self, root: &Root, reached: &[Reached]) {
        if root.method.is_some() {
            return;
        }
        let mut seen = BTreeSet::new();
        for each in reached {
            let UseKind::ReadTextured(id) = each.done.kind else { continue };
            let member = &self.module.classes[root.class.0 as usize].members[id.0 as usize];
            if member.tested || !seen.insert(id) {
                continue;
            }
            let name = &member.name;
            let diagnostic = Diagnostic::new(
                codes::TEXTURED_IN_CONSTRUCTOR,
                format!("the constructor reads `{name}`, which may be a texture"),
            )
            .at(each.done.span, "the default, if there is a texture")
            .note("a texture has a value only at a hit, and the constructor runs before there is a ray")
            .help(format!(
                "compute with it in the methods, at least where `isTextured({name})`"
            ));
            self.report_with_path(root, each, diagnostic);
        }
    }

    fn report_scratch(&mut self, root: &Root, reached: &Reached, name: &str) {
        let diagnostic = Diagnostic::new(
            codes::SCRATCH_IN_CONSTRUCTOR,
            format!("the constructor cannot use the scratch member `{name}`"),
        )
        .at(reached.done.span, "belongs to a ray, and there is none yet")
        .help("make it `private`, if it belongs to the instance");
        self.report_with_path(root, reached, diagnostic);
    }

    fn check_builtin_use(&mut self, root: &Root, reached: &Reached, overload: &'static Overload) {
        let (builtin, usable) = (overload.builtin, overload.usable());
        let form = if usable == builtin.usable { "" } else { " without arguments" };
        let what = format!("`{}`{form}", builtin.name);
        match (usable, root.method) {
            (Usable::Methods(methods), method) => {
                let shades = |role: &Role| matches!(role, Role::Material | Role::Texture);
                let fits = !builtin.lowering.needs_surface() || root.roles.iter().any(shades);
                if !fits || method.is_none_or(|method| !methods.contains(&method)) {
                    let names: Vec<&str> = methods.iter().map(|method| method.name()).collect();
                    self.report_out_of_place(root, reached, &what, &quoted_list(&names));
                }
            }
            (Usable::Anywhere, None) => {
                self.report_out_of_place(root, reached, &what, "methods");
            }
            (Usable::Anywhere | Usable::Prelude, _) => {}
        }
    }

    fn check_reference_use(
        &mut self,
        root: &Root,
        reached: &Reached,
        method: &'static ReferenceMethod,
    ) {
        let what = format!("`{}` of another shader", method.name);
        match root.method {
            None => self.report_out_of_place(root, reached, &what, "methods"),
            Some(caller) if method.runs == Method::Shade && caller != Method::Shade => {
                self.report_out_of_place(root, reached, &what, "`shade`");
            }
            Some(_) => self.check_states_set_by_call(root, reached, method),
        }
    }

    /// Reports a call that sets a state variable that the caller's class does not have.
    fn check_states_set_by_call(
        &mut self,
        root: &Root,
        reached: &Reached,
        method: &'static ReferenceMethod,
    ) {
        let of_class = &self.module.classes[root.class.0 as usize].roles;
        let has = |roles: &[Role], name: &str| roles.iter().any(|role| role.row(name).is_some());
        let missing = method.also_sets.iter().find(|name| !has(of_class, name));
        let Some(name) = missing.filter(|_| !self.class_is_uncertain(root.class)) else { return };
        let able: Vec<Role> =
            Role::ALL.into_iter().filter(|role| may_set(*role, method.also_sets)).collect();
        let diagnostic = Diagnostic::new(
            codes::OUT_OF_PLACE,
            format!(
                "only {} can call `{}` of another shader",
                with_article(&role_list(&able, "or")),
                method.name
            ),
        )
        .at(reached.done.span, format!("sets `{name}`, which this class does not have"));
        self.report_with_path(root, reached, diagnostic);
    }

    fn report_out_of_place(&mut self, root: &Root, reached: &Reached, what: &str, place: &str) {
        let found = root
            .method
            .map_or("the constructor".to_owned(), |method| format!("`{}`", method.name()));
        let diagnostic = Diagnostic::new(
            codes::OUT_OF_PLACE,
            format!("{what} is only for {place}, not for {found}"),
        )
        .at(reached.done.span, "not possible here");
        self.report_with_path(root, reached, diagnostic);
    }

    /// Reports a diagnostic, with a note on the path from the method to a helper.
    pub(super) fn report_with_path(
        &mut self,
        root: &Root,
        reached: &Reached,
        diagnostic: Diagnostic,
    ) {
        let diagnostic = if reached.function == root.function {
            diagnostic
        } else {
            let helper = &self.function(reached.function).name;
            let caller = root.method.map_or("constructor", Method::name);
            diagnostic.note(format!("`{caller}` reaches this through `{helper}`"))
        };
        self.report(diagnostic);
    }
}

/// True if some method of the role may set all of these state variables.
fn may_set(role: Role, names: &[&str]) -> bool {
    role.methods().any(|method| {
        names.iter().all(|name| {
            role.row(name).is_some_and(|row| row.direction(method) != Some(Direction::In))
        })
    })
}

/// Formats a list of roles: "camera", "camera and light", "texture, light or material".
pub(super) fn role_list(roles: &[Role], conjunction: &str) -> String {
    let names: Vec<&str> = roles.iter().map(|role| role.name()).collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => {
            format!("{} {conjunction} {last}", rest.join(", "))
        }
        Some((last, _)) => (*last).to_owned(),
        None => "class without a role".to_owned(),
    }
}
