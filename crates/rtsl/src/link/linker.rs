//! Linking: a method with the methods that it calls through references becomes one function.
//!
//! The body of the called method replaces each call. Its members, buffers and scratch get the path of the reference as
//! prefix (`kd.scale`), and it reads the caller's state as of the call. Comparisons select the element of an array of
//! references. A call through a reference that is not set gives the role's defaults.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl_ir::class::Reference;
use rtsl_ir::{
    CompareOp, Constant, Function, Index, IndexVec, MAX_NESTING, Op, OpKind, Output, ReferenceCall,
    ReferencePath, Region, Scalar, StateComponent, Value, Values, Variable, VariableId,
    VariableKind,
};
use rtsl_opt::unchanged::VariableScalar;
use rtsl_source::{Diagnostic, deep_stack};
use rtsl_spec::{Default as StateDefault, Direction, Method, Role, lookup_state, state_variables};

use super::attributes::{AttributeUse, attribute_of, method_of};
use super::chosen_light::ChosenLight;
use super::class_tree::{ClassTree, element_path};
use super::linked_method::LinkedMethod;
use super::search::ArrayElement;
use super::sequences::CopiedNumbers;
use super::shade_call::ShadeCall;
use super::stage::SurfaceLinks;
use crate::errors;

/// The greatest number of operations of a linked function.
const OPERATION_LIMIT: usize = 1 << 17;

/// A function without references.
#[derive(Clone, Debug)]
pub(crate) struct Linked {
    pub function: Function,
    /// Scalars that the function sets to the values that they had, as optimisation has found.
    pub unchanged: Vec<VariableScalar>,
    pub warnings: Vec<Diagnostic>,
}

/// Links a function of the class at the tree's root that is no method, such as the constructor.
pub(crate) fn link_function(tree: &ClassTree, function: &Function) -> Result<Linked, Diagnostic> {
    let _span = tracing::debug_span!("link", function = function.name).entered();
    let mut linker = Linker::new(Function::new(function.name.clone()));
    linker.root(tree, function)?;
    Ok(linker.finish())
}

/// Links a method of the class at the tree's root; `None` if the class has no such method.
pub(crate) fn link_method(tree: &ClassTree, method: Method) -> Option<Result<Linked, Diagnostic>> {
    let function = method_of(tree, method)?;
    let _span = tracing::debug_span!("link", function = function.name).entered();
    let mut linker = Linker::new(Function::new(function.name.clone()));
    linker.attributes = AttributeUse::of(tree, method);
    Some(linker.root(tree, &function).map(|()| linker.finish()))
}

pub(super) struct Linker {
    pub out: Function,
    /// The variables of `out`.
    variables: BTreeMap<(VariableKind, String), VariableId>,
    operations: usize,
    /// The values that are constants, by the constants.
    known: BTreeMap<Value, Constant>,
    depth: usize,
    locals: u32,
    /// Unset references, by class and path.
    warnings: BTreeSet<(String, String)>,
    /// If scratch is not in memory: the values of its scalars in the order of their assignments, of which the last
    /// counts. Others are zero.
    pub scratch: Option<Vec<((String, u32), Value)>>,
    /// For a stage of an integrator: the methods that answer its queries.
    pub surface: Option<Arc<SurfaceLinks>>,
    /// The properties of surfaces that are computed already where operations are added, by their operands.
    pub known_properties: Vec<(Vec<Value>, Vec<Value>)>,
    /// The random numbers of the method that is being copied, if operations compute them.
    pub copied_numbers: Option<CopiedNumbers>,
    /// The locals with the values of a path that pass from stage to stage, by their scratch arrays.
    pub passed_values: BTreeMap<&'static str, VariableId>,
    /// The light whose methods are being copied, if each path has chosen one.
    pub chosen_light: Option<Arc<ChosenLight>>,
    /// The object whose method is being copied, if it is one of several with the same code.
    pub element: Option<ArrayElement>,
    /// The call of a method that shades a surface whose body is being copied into a stage of an integrator.
    pub shade_call: Option<ShadeCall>,
    /// The local with the contribution of a stage.
    pub contribution: Option<VariableId>,
    /// The use of the attributes of objects.
    pub attributes: AttributeUse,
    /// True if derivatives may be taken of the called methods.
    takes_derivatives: bool,
    /// The locals with the scratch that calls of `intersect` of other primitives have left, by its names.
    pub called_scratch: BTreeMap<String, VariableId>,
}

/// A function body that is being copied.
pub(super) struct Site<'a> {
    pub tree: &'a ClassTree,
    pub function: &'a Function,
    /// `""`, or `kd.`.
    pub prefix: String,
    pub is_root: bool,
    /// State that differs from that of the call.
    pub overrides: Vec<(StateComponent, Value)>,
    values: IndexVec<Value, Option<Value>>,
    variables: IndexVec<VariableId, Option<VariableId>>,
    pub in_loop: bool,
    /// The index of the function's first name in the linked function.
    first_text: u32,
}

impl<'a> Site<'a> {
    /// Returns the name in the linked function of a variable with storage of its own.
    pub fn name_of(&self, variable: &Variable) -> String {
        format!("{}{}", self.prefix, variable.name)
    }

    pub fn new(
        tree: &'a ClassTree,
        function: &'a Function,
        prefix: String,
        out: &mut Function,
    ) -> Site<'a> {
        Site {
            first_text: out.names.add_texts(&function.names),
            tree,
            function,
            is_root: prefix.is_empty(),
            prefix,
            overrides: Vec::new(),
            values: IndexVec::filled(function.values.len(), None),
            variables: IndexVec::filled(function.variables.len(), None),
            in_loop: false,
        }
    }

    pub fn value(&self, value: Value) -> Value {
        self.values[value].expect("the verifier saw values defined before their use")
    }

    fn define(&mut self, value: Value, new: Value) {
        self.values[value] = Some(new);
    }
}

/// True if a function takes derivatives.
fn takes_derivatives(function: &Function) -> bool {
    let mut takes = false;
    function.body.for_each_op(&mut |op| takes |= matches!(op.kind, OpKind::Seed(_)));
    takes
}

/// Maps an index of a site to one of the linked function.
pub(super) fn index_of_site(site: &Site<'_>, index: Index) -> Index {
    match index {
        Index::Constant(index) => Index::Constant(index),
        Index::Dynamic(index) => Index::Dynamic(site.value(index)),
    }
}

pub(super) fn find_override(
    overrides: &[(StateComponent, Value)],
    wanted: StateComponent,
) -> Option<Value> {
    overrides.iter().rev().find(|(component, _)| *component == wanted).map(|(_, value)| *value)
}

pub(super) type Linking<T> = Result<T, Diagnostic>;

/// Adds the operations for one element of an array of references and returns their results.
type ElementBody<'a> = dyn FnMut(&mut Linker, usize, &mut Vec<Op>) -> Linking<Vec<Value>> + 'a;

impl Linker {
    pub fn new(out: Function) -> Linker {
        let warnings = BTreeSet::new();
        let variables = BTreeMap::new();
        Linker {
            out,
            variables,
            operations: 0,
            known: BTreeMap::new(),
            depth: 0,
            locals: 0,
            warnings,
            scratch: None,
            surface: None,
            known_properties: Vec::new(),
            copied_numbers: None,
            passed_values: BTreeMap::new(),
            chosen_light: None,
            element: None,
            shade_call: None,
            contribution: None,
            attributes: AttributeUse::Defaults,
            takes_derivatives: false,
            called_scratch: BTreeMap::new(),
        }
    }

    pub fn finish(mut self) -> Linked {
        rtsl_opt::differentiate::run(&mut self.out);
        let warnings = self
            .warnings
            .into_iter()
            .map(|(class, path)| errors::unset_reference(&class, &path))
            .collect();
        Linked { function: self.out, unchanged: Vec::new(), warnings }
    }

    pub fn root(&mut self, tree: &ClassTree, function: &Function) -> Linking<()> {
        let mut site = Site::new(tree, function, String::new(), &mut self.out);
        self.takes_derivatives = takes_derivatives(function);
        self.out.body = self.copy_region(&mut site, &function.body)?;
        let yields = std::mem::take(&mut self.out.body.yields);
        let mut given = Vec::new();
        for (output, value) in function.outputs.iter().zip(yields) {
            let component = output.component;
            if let Some(attribute) = attribute_of(&site, function.variable(output.variable)) {
                given.push((attribute.name.clone(), component, value));
                continue;
            }
            let variable = self.variable(&mut site, output.variable);
            self.out.outputs.push(Output { variable, component });
            self.out.body.yields.push(value);
        }
        self.give_attributes(&tree.class, &given)?;
        self.output_called_scratch()
    }

    fn copy_region(&mut self, site: &mut Site<'_>, region: &Region) -> Linking<Region> {
        self.nested(|linker| {
            let mut copy = Region::default();
            for param in &region.params {
                let new = linker.out.new_values(&[site.function.scalar(*param)]).get(0);
                site.define(*param, new);
                linker.keep_name(site, *param, new);
                copy.params.push(new);
            }
            linker.copy_ops(site, &region.ops, &mut copy.ops)?;
            copy.yields = region.yields.iter().map(|value| site.value(*value)).collect();
            Ok(copy)
        })
    }

    pub fn nested<T>(&mut self, work: impl FnOnce(&mut Self) -> Linking<T>) -> Linking<T> {
        // All later stages recurse as deep.
        if self.depth >= MAX_NESTING.min(deep_stack::depth()) {
            return Err(errors::link_limit(&self.out.name, "is nested too deeply"));
        }
        self.depth += 1;
        let known = self.known_properties.len();
        let result = work(self);
        self.known_properties.truncate(known);
        self.depth -= 1;
        result
    }

    pub fn copy_ops(&mut self, site: &mut Site<'_>, from: &[Op], to: &mut Vec<Op>) -> Linking<()> {
        from.iter().try_for_each(|op| self.copy_op(site, op, to))
    }

    fn copy_op(&mut self, site: &mut Site<'_>, op: &Op, to: &mut Vec<Op>) -> Linking<()> {
        if let Some(results) = self.answer(site, op, to)? {
            for (old, new) in op.results.iter().zip(results) {
                site.define(old, new);
            }
            return Ok(());
        }
        if let OpKind::Length(buffer) = &op.kind
            && let Some(length) = self.length_of_chosen(site, *buffer, to)?
        {
            site.define(op.results.get(0), length);
            return Ok(());
        }
        let kind = match &op.kind {
            OpKind::ReferenceCall(call) => {
                let results = self.reference_call(site, call, to)?;
                for (old, new) in op.results.iter().zip(results) {
                    site.define(old, new);
                }
                return Ok(());
            }
            OpKind::IsSet(member, path) => {
                let result = self.is_set(site, member, *path, to)?;
                site.define(op.results.get(0), result);
                return Ok(());
            }
            OpKind::ReferenceCount(member) => {
                let (_, elements) = find_reference(site.tree, member);
                let count = i32::try_from(elements.len()).unwrap_or(i32::MAX);
                let count = self.constant(to, Constant::I32(count))?;
                site.define(op.results.get(0), count);
                return Ok(());
            }
            OpKind::Load(variable, index) if self.replaces_loads(site, *variable) => {
                let result = self.replaced_load(site, *variable, *index, to)?;
                site.define(op.results.get(0), result);
                return Ok(());
            }
            OpKind::If { condition, then, otherwise } => OpKind::If {
                condition: site.value(*condition),
                then: self.copy_region(site, then)?,
                otherwise: self.copy_region(site, otherwise)?,
            },
            OpKind::Loop { initial, body } => {
                let initial = initial.iter().map(|value| site.value(*value)).collect();
                let was_in_loop = std::mem::replace(&mut site.in_loop, true);
                let body = self.copy_region(site, body)?;
                site.in_loop = was_in_loop;
                OpKind::Loop { initial, body }
            }
            simple => self.copy_simple(site, simple),
        };
        let scalars: Vec<Scalar> =
            op.results.iter().map(|value| site.function.scalar(value)).collect();
        let results = self.emit(to, kind, &scalars, op.precise)?;
        for (old, new) in op.results.iter().zip(results.iter()) {
            site.define(old, new);
            self.keep_name(site, old, new);
        }
        Ok(())
    }

    fn keep_name(&mut self, site: &Site<'_>, old: Value, new: Value) {
        self.out.names.copy(&site.function.names, site.first_text, old, new);
    }

    /// Copies an operation without regions and references, with its operands and variables mapped.
    fn copy_simple(&mut self, site: &mut Site<'_>, kind: &OpKind) -> OpKind {
        let mut kind = kind.clone();
        kind.for_each_operand_mut(|value| *value = site.value(*value));
        if let OpKind::Load(variable, _)
        | OpKind::Store(variable, _, _)
        | OpKind::Length(variable) = &mut kind
        {
            *variable = self.variable(site, *variable);
        }
        kind
    }

    /// Returns the variable of the linked function for one of the site's.
    pub fn variable(&mut self, site: &mut Site<'_>, id: VariableId) -> VariableId {
        if let Some(known) = site.variables[id] {
            return known;
        }
        let variable = site.function.variable(id);
        let name = match variable.kind {
            VariableKind::State | VariableKind::Parameter | VariableKind::Accepted => {
                variable.name.clone()
            }
            VariableKind::Member | VariableKind::Scratch | VariableKind::Buffer => {
                site.name_of(variable)
            }
            VariableKind::Local if site.is_root => variable.name.clone(),
            VariableKind::Local => {
                self.locals += 1;
                format!("{}{}.{}", site.prefix, variable.name, self.locals)
            }
        };
        let new = self.intern_variable(Variable { name, ..variable.clone() });
        site.variables[id] = Some(new);
        new
    }

    /// Like [`Function::intern_variable`], without its linear search.
    pub fn intern_variable(&mut self, variable: Variable) -> VariableId {
        let next = VariableId(self.out.variables.len() as u32);
        let id = *self.variables.entry((variable.kind, variable.name.clone())).or_insert(next);
        if id == next {
            self.out.variables.push(variable);
        }
        id
    }

    pub fn emit(
        &mut self,
        to: &mut Vec<Op>,
        kind: OpKind,
        results: &[Scalar],
        precise: bool,
    ) -> Linking<Values> {
        self.operations += 1;
        if self.operations > OPERATION_LIMIT {
            return Err(errors::link_limit(&self.out.name, "is too large"));
        }
        let results = self.out.new_values(results);
        to.push(Op { results, precise, kind });
        Ok(results)
    }

    pub fn constant(&mut self, to: &mut Vec<Op>, constant: Constant) -> Linking<Value> {
        let kind = OpKind::Constant(constant);
        let value = self.emit(to, kind, &[constant.scalar()], false)?.get(0);
        self.known.insert(value, constant);
        Ok(value)
    }

    /// Returns the constant that a value is known to be.
    pub fn known(&self, value: Value) -> Option<Constant> {
        self.known.get(&value).copied()
    }

    fn is_set(
        &mut self,
        site: &Site<'_>,
        member: &str,
        path: ReferencePath,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let (_, elements) = find_reference(site.tree, member);
        let mut element = |linker: &mut Self, index: usize, to: &mut Vec<Op>| {
            let is_set = elements.get(index).is_some_and(Option::is_some);
            Ok(vec![linker.constant(to, Constant::Bool(is_set))?])
        };
        let chosen = match path {
            ReferencePath::Single => element(self, 0, to)?,
            ReferencePath::Element(index) => {
                let choice = Choice { index: site.value(index), results: &[Scalar::Bool] };
                self.choose(&choice, 0..elements.len(), &mut element, to)?
            }
        };
        Ok(chosen[0])
    }

    fn reference_call(
        &mut self,
        site: &Site<'_>,
        call: &ReferenceCall,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let (reference, elements) = find_reference(site.tree, &call.member);
        let mut overrides = site.overrides.clone();
        for (component, value) in &call.overrides {
            overrides.retain(|(other, _)| other != component);
            overrides.push((*component, site.value(*value)));
        }
        let mut element = |linker: &mut Self, index: usize, to: &mut Vec<Op>| {
            let path = reference.map_or_else(String::new, |it| element_path(it, index));
            match elements.get(index).and_then(Option::as_ref) {
                Some(tree) => {
                    let prefix = format!("{}{path}.", site.prefix);
                    linker.inline(tree, prefix, call, &overrides, site.in_loop, to)
                }
                None => {
                    // An array without elements has none that is unset.
                    let is_element = index < elements.len();
                    if reference.is_some_and(|reference| is_element && !reference.tested) {
                        let path = format!("{}{path}", site.prefix);
                        linker.warnings.insert((site.tree.class.name.clone(), path));
                    }
                    linker.defaults(call, &overrides, to)
                }
            }
        };
        match call.path {
            ReferencePath::Single => element(self, 0, to),
            ReferencePath::Element(index) => {
                let results = vec![Scalar::F32; call.results.len()];
                let choice = Choice { index: site.value(index), results: &results };
                self.choose(&choice, 0..elements.len(), &mut element, to)
            }
        }
    }

    /// Copies the body of the called method.
    fn inline(
        &mut self,
        tree: &ClassTree,
        prefix: String,
        call: &ReferenceCall,
        overrides: &[(StateComponent, Value)],
        in_loop: bool,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let class = &tree.class;
        let differentiable = class.differentiable.get(&call.method);
        let differentiable = differentiable.filter(|_| self.takes_derivatives);
        let Some(function) = differentiable.or_else(|| class.methods.get(&call.method)) else {
            return self.defaults(call, overrides, to);
        };
        let mut site = Site::new(tree, function, prefix, &mut self.out);
        site.overrides = overrides.to_vec();
        site.in_loop = in_loop;
        if in_loop {
            self.zero_slots(&mut site, to)?;
        }
        self.report_call(&mut site, call, to)?;
        let takes_derivatives = self.takes_derivatives || takes_derivatives(function);
        let outer = std::mem::replace(&mut self.takes_derivatives, takes_derivatives);
        let copied = self.nested(|linker| linker.copy_ops(&mut site, &function.body.ops, to));
        self.takes_derivatives = outer;
        copied?;
        self.keep_called_scratch(&site, to)?;
        let result = |linker: &mut Self, wanted: &StateComponent, to: &mut Vec<Op>| {
            let output = function.outputs.iter().position(|output| {
                let variable = function.variable(output.variable);
                let state = lookup_state(&variable.name).map(|state| state.index);
                variable.kind == VariableKind::State
                    && state == Some(wanted.variable)
                    && output.component == wanted.component
            });
            match output {
                Some(index) => Ok(site.value(function.body.yields[index])),
                None => linker.default(call, overrides, *wanted, to),
            }
        };
        let results = call.results.iter().map(|wanted| result(self, wanted, to));
        let results = results.collect::<Linking<Vec<Value>>>()?;
        self.report_return(&site, call, &results, to)?;
        Ok(results)
    }

    /// Returns the results of a call of an unset reference, or of a method that the class lacks.
    fn defaults(
        &mut self,
        call: &ReferenceCall,
        overrides: &[(StateComponent, Value)],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        call.results.iter().map(|wanted| self.default(call, overrides, *wanted, to)).collect()
    }

    /// Returns a result that no method sets: its default or, if the method also receives it, what it received.
    fn default(
        &mut self,
        call: &ReferenceCall,
        overrides: &[(StateComponent, Value)],
        wanted: StateComponent,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let row = wanted.variable().and_then(|variable| call.role.row(variable.name));
        let is_received = row.and_then(|row| row.direction(call.method)) == Some(Direction::InOut);
        if !is_received {
            return self.constant(to, default_of(call.role, wanted));
        }
        match (find_override(overrides, wanted), wanted.variable()) {
            (None, Some(variable)) => {
                let received = Variable {
                    kind: VariableKind::State,
                    name: variable.name.to_owned(),
                    scalar: Scalar::F32,
                    len: variable.ty.components(),
                };
                let received = self.intern_variable(received);
                let load = OpKind::Load(received, Index::Constant(wanted.component));
                Ok(self.emit(to, load, &[Scalar::F32], false)?.get(0))
            }
            (Some(value), _) => Ok(value),
            (None, None) => self.constant(to, Constant::F32(0.0)),
        }
    }

    /// Copies the body of a method that reads this state, and returns the state that it sets. The names of its members
    /// begin with `prefix`.
    pub fn copy_method(
        &mut self,
        caller: &Site<'_>,
        prefix: &str,
        method: &LinkedMethod,
        state: Vec<(StateComponent, Value)>,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let function = &*method.function;
        let mut site = Site::new(caller.tree, function, prefix.to_owned(), &mut self.out);
        site.overrides = state;
        site.in_loop = caller.in_loop;
        if site.in_loop {
            self.zero_slots(&mut site, to)?;
        }
        self.nested(|linker| linker.copy_ops(&mut site, &function.body.ops, to))?;
        Ok(self.note_outputs(&mut site))
    }

    /// Returns the state that a copied body sets; its scratch is noted if scratch is not in memory.
    pub fn note_outputs(&mut self, site: &mut Site<'_>) -> Vec<(StateComponent, Value)> {
        let function = site.function;
        let mut state = Vec::new();
        for (output, value) in function.outputs.iter().zip(&function.body.yields) {
            let (place, value) = (function.variable(output.variable), site.value(*value));
            match place.kind {
                VariableKind::State => state.extend(
                    StateComponent::named(&place.name, output.component).map(|it| (it, value)),
                ),
                VariableKind::Scratch => {
                    if let Some(scratch) = &mut self.scratch {
                        scratch.push(((site.name_of(place), output.component), value));
                    }
                }
                VariableKind::Accepted
                | VariableKind::Member
                | VariableKind::Parameter
                | VariableKind::Buffer
                | VariableKind::Local => {}
            }
        }
        state
    }

    /// Calls `element` for each index of `range` and makes comparisons that select one by the clamped index: each
    /// halves the range.
    fn choose(
        &mut self,
        choice: &Choice<'_>,
        range: std::ops::Range<usize>,
        element: &mut ElementBody<'_>,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        if range.len() <= 1 {
            return element(self, range.start, to);
        }
        let middle = range.start + range.len() / 2;
        let bound = self.constant(to, Constant::I32(i32::try_from(middle).unwrap_or(i32::MAX)))?;
        let kind = OpKind::Compare(CompareOp::Less, choice.index, bound);
        let condition = self.emit(to, kind, &[Scalar::Bool], false)?.get(0);
        let mut half = |linker: &mut Self, range| {
            linker.nested(|linker| {
                let mut region = Region::default();
                region.yields = linker.choose(choice, range, element, &mut region.ops)?;
                Ok(region)
            })
        };
        let then = half(self, range.start..middle)?;
        let otherwise = half(self, middle..range.end)?;
        let kind = OpKind::If { condition, then, otherwise };
        Ok(self.emit(to, kind, choice.results, false)?.iter().collect())
    }
}

/// An index that selects, clamped, one of several bodies with these results.
struct Choice<'a> {
    index: Value,
    results: &'a [Scalar],
}

fn find_reference<'a>(
    tree: &'a ClassTree,
    member: &str,
) -> (Option<&'a Reference>, &'a [Option<ClassTree>]) {
    let index = tree.class.references.iter().position(|reference| reference.name == member);
    match index {
        Some(index) => (tree.class.references.get(index), &tree.references[index]),
        None => (None, &[]),
    }
}

/// Returns the value of an output that its method leaves unset. If the default is another variable's value it is zero,
/// as that of the other variable is.
pub(super) fn default_of(role: Role, wanted: StateComponent) -> Constant {
    let variable = state_variables().get(wanted.variable as usize);
    let default = variable.and_then(|variable| role.row(variable.name)).map(|row| row.default);
    Constant::F32(match default {
        Some(StateDefault::Constant(value)) => value,
        Some(StateDefault::Components(values)) => {
            values.get(wanted.component as usize).copied().unwrap_or(0.0)
        }
        Some(
            StateDefault::Variable(_)
            | StateDefault::Grey(_)
            | StateDefault::Luminance(_)
            | StateDefault::Tangent(_),
        )
        | None => 0.0,
    })
}
