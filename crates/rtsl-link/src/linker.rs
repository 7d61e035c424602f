//! Copying of functions into the one that is linked.

use std::ops::DerefMut;

use rtsl_ir::{
    Constant, Function, Index, Op, OpKind, Output, Region, Scalar, StateComponent, Value, Variable,
    VariableKind,
};
use rtsl_opt::unchanged::VariableScalar;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use crate::attributes::{AttributeUse, attribute_of, method_of};
use crate::class_tree::ClassTree;
use crate::draft::{Draft, Linking};
use crate::linked_method::LinkedMethod;
use crate::loads::named;
use crate::reference_calls::{find_reference, is_set, reference_call};
use crate::reported_calls::{report_linked_call, report_linked_return};
use crate::site::Site;
use crate::{errors, loads};

/// A function without references.
#[derive(Clone, Debug)]
pub struct Linked {
    /// The function.
    pub function: Function,
    /// Scalars that the function sets to the values that they had, as optimisation has found.
    pub unchanged: Vec<VariableScalar>,
    /// Warnings about references that are used but not set.
    pub warnings: Vec<Diagnostic>,
}

/// Links a function of the class at the tree's root that is no method, such as the constructor.
///
/// # Errors
/// If linking passes a limit.
pub fn link_function(tree: &ClassTree, function: &Function) -> Result<Linked, Diagnostic> {
    let _span = tracing::debug_span!("link", function = function.name).entered();
    let mut linker = PlainLinker::new(function.name.clone());
    linker.root(Some(tree), function)?;
    Ok(linker.finish())
}

/// Links a method of the class at the tree's root; `None` if the class has no such method.
pub fn link_method(tree: &ClassTree, method: Method) -> Option<Result<Linked, Diagnostic>> {
    let function = method_of(tree, method)?;
    let _span = tracing::debug_span!("link", function = function.name).entered();
    let mut linker = PlainLinker::new(function.name.clone());
    linker.attributes = AttributeUse::of(tree, method);
    Some(linker.root(Some(tree), &function).map(|()| linker.finish()))
}

/// Copies functions into a [draft](Draft), and replaces calls through references by the bodies of the called methods.
///
/// An implementation adds what else it replaces: operations that it [answers](Linker::answer), and members and buffers
/// that it [binds](Linker::binds) to other data.
pub trait Linker: DerefMut<Target = Draft> + Sized {
    /// Returns the results of an operation that something else takes the place of; `None` for others, which are copied.
    ///
    /// # Errors
    /// If linking passes a limit.
    fn answer(&mut self, _: &Site<'_>, _: &Op, _: &mut Vec<Op>) -> Linking<Option<Vec<Value>>> {
        Ok(None)
    }

    /// True if members, or buffers, of the methods that are being copied may be bound to other data.
    fn binds(&self, _: VariableKind) -> bool {
        false
    }

    /// Loads a scalar of a member or a buffer, whose name is that in the draft, from the data to which it is bound; `None`
    /// if it is its own.
    ///
    /// # Errors
    /// If linking passes a limit.
    fn load_bound(&mut self, _: &Variable, _: Index, _: &mut Vec<Op>) -> Linking<Option<Value>> {
        Ok(None)
    }

    /// Returns the number of elements in a buffer, whose name is that in the draft, that is bound to other data; `None` if
    /// it is its own.
    ///
    /// # Errors
    /// If linking passes a limit.
    fn length_of_bound(&mut self, _: &Variable, _: &mut Vec<Op>) -> Linking<Option<Value>> {
        Ok(None)
    }

    /// Adds a region by `work`.
    ///
    /// # Errors
    /// Those of `work`, and if regions are nested too deeply.
    fn nested<T>(&mut self, work: impl FnOnce(&mut Self) -> Linking<T>) -> Linking<T> {
        self.enter()?;
        let result = work(self);
        self.leave();
        result
    }

    /// Copies the function that is linked itself; `tree` is that of its class, unless it is linked already.
    ///
    /// # Errors
    /// If linking passes a limit.
    fn root(&mut self, tree: Option<&ClassTree>, function: &Function) -> Linking<()> {
        let mut site = Site::new(tree, function, String::new(), &mut self.out);
        self.takes_derivatives = takes_derivatives(function);
        self.out.body = copy_region(self, &mut site, &function.body)?;
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
        if let Some(tree) = tree {
            self.give_attributes(&tree.class, &given)?;
        }
        self.output_called_scratch()
    }

    /// Copies operations of a site.
    ///
    /// # Errors
    /// If linking passes a limit.
    fn copy_ops(&mut self, site: &mut Site<'_>, from: &[Op], to: &mut Vec<Op>) -> Linking<()> {
        from.iter().try_for_each(|op| copy_op(self, site, op, to))
    }

    /// Copies the body of a method that reads this state, and returns the state that it sets. The names of its members
    /// begin with `prefix`.
    ///
    /// # Errors
    /// If linking passes a limit.
    fn copy_method(
        &mut self,
        prefix: &str,
        method: &LinkedMethod,
        state: Vec<(StateComponent, Value)>,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let function = &*method.function;
        let mut site = Site::new(None, function, prefix.to_owned(), &mut self.out);
        // The locals of each method are distinct.
        site.is_root = false;
        site.overrides = state;
        self.begin_copy(&mut site, to)?;
        if self.reports_calls {
            report_linked_call(self, &mut site, to)?;
        }
        self.nested(|linker| linker.copy_ops(&mut site, &function.body.ops, to))?;
        if self.reports_calls {
            report_linked_return(self, &site, to)?;
        }
        Ok(self.note_outputs(&site))
    }

    /// Returns the finished function, which the linker then lacks.
    fn finish(&mut self) -> Linked {
        rtsl_opt::differentiate::run(&mut self.out);
        let warnings = std::mem::take(&mut self.warnings).into_iter();
        let warnings = warnings.map(|(class, path)| errors::unset_reference(&class, &path));
        let warnings = warnings.collect();
        let function = std::mem::take(&mut self.out);
        Linked { function, unchanged: Vec::new(), warnings }
    }
}

/// Links methods with those that they call, and nothing else.
#[derive(Default)]
pub struct PlainLinker {
    draft: Draft,
}

impl PlainLinker {
    /// Begins a function of this name.
    pub fn new(name: impl Into<String>) -> PlainLinker {
        PlainLinker { draft: Draft::new(name) }
    }
}

impl Linker for PlainLinker {}

impl std::ops::Deref for PlainLinker {
    type Target = Draft;

    fn deref(&self) -> &Draft {
        &self.draft
    }
}

impl DerefMut for PlainLinker {
    fn deref_mut(&mut self) -> &mut Draft {
        &mut self.draft
    }
}

/// True if a function takes derivatives.
pub(crate) fn takes_derivatives(function: &Function) -> bool {
    let mut takes = false;
    function.body.for_each_op(&mut |op| takes |= matches!(op.kind, OpKind::Seed(_)));
    takes
}

fn copy_region<L: Linker>(linker: &mut L, site: &mut Site<'_>, region: &Region) -> Linking<Region> {
    linker.nested(|linker| {
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

fn copy_op<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    op: &Op,
    to: &mut Vec<Op>,
) -> Linking<()> {
    if let Some(results) = linker.answer(site, op, to)? {
        for (old, new) in op.results.iter().zip(results) {
            site.define(old, new);
        }
        return Ok(());
    }
    if let OpKind::Length(buffer) = &op.kind
        && linker.binds(VariableKind::Buffer)
        && let Some(length) = linker.length_of_bound(&named(site, *buffer), to)?
    {
        site.define(op.results.get(0), length);
        return Ok(());
    }
    let kind = match &op.kind {
        OpKind::ReferenceCall(call) => {
            let results = reference_call(linker, site, call, to)?;
            for (old, new) in op.results.iter().zip(results) {
                site.define(old, new);
            }
            return Ok(());
        }
        OpKind::IsSet(member, path) => {
            let result = is_set(linker, site, member, *path, to)?;
            site.define(op.results.get(0), result);
            return Ok(());
        }
        OpKind::ReferenceCount(member) => {
            let (_, elements) = find_reference(site, member);
            let count = i32::try_from(elements.len()).unwrap_or(i32::MAX);
            let count = linker.constant(to, Constant::I32(count))?;
            site.define(op.results.get(0), count);
            return Ok(());
        }
        OpKind::Load(variable, index) if loads::are_replaced(linker, site, *variable) => {
            let result = loads::replaced(linker, site, *variable, *index, to)?;
            site.define(op.results.get(0), result);
            return Ok(());
        }
        OpKind::If { condition, then, otherwise } => OpKind::If {
            condition: site.value(*condition),
            then: copy_region(linker, site, then)?,
            otherwise: copy_region(linker, site, otherwise)?,
        },
        OpKind::Loop { initial, body } => {
            let initial = initial.iter().map(|value| site.value(*value)).collect();
            let was_in_loop = std::mem::replace(&mut linker.in_loop, true);
            let body = copy_region(linker, site, body);
            linker.in_loop = was_in_loop;
            OpKind::Loop { initial, body: body? }
        }
        simple => copy_simple(linker, site, simple),
    };
    let scalars: Vec<Scalar> = op.results.iter().map(|value| site.function.scalar(value)).collect();
    let results = linker.emit(to, kind, &scalars, op.precise)?;
    for (old, new) in op.results.iter().zip(results.iter()) {
        site.define(old, new);
        linker.keep_name(site, old, new);
    }
    Ok(())
}

/// Copies an operation without regions and references, with its operands and variables mapped.
fn copy_simple<L: Linker>(linker: &mut L, site: &mut Site<'_>, kind: &OpKind) -> OpKind {
    let mut kind = kind.clone();
    kind.for_each_operand_mut(|value| *value = site.value(*value));
    if let OpKind::Load(variable, _) | OpKind::Store(variable, _, _) | OpKind::Length(variable) =
        &mut kind
    {
        *variable = linker.variable(site, *variable);
    }
    kind
}
