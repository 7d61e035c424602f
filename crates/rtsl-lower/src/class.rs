//! Lowers a class: its functions, and its interface to hosts.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::class::{self, Attribute, Reference, ReferenceCount};
use rtsl_ir::{Builder, Constant, Function, OpKind, Variable, VariableKind};
use rtsl_sema::hir::{
    Class, ClassId, Expression, ExpressionKind, FunctionId, LocalId, Member, Module, Passing,
    Storage, Type,
};
use rtsl_source::{Diagnostic, deep_stack};
use rtsl_spec::Method;

use crate::access::Access;
use crate::calls::{Frame, implicit_functions};
use crate::cells::{Cell, Cells};
use crate::facts::{FactTable, Root};
use crate::layout::Layouts;
use crate::limits::{self, Lowered};
use crate::members::ConstantTables;
use crate::parameters::{parameter_type, parameters_of, ray_member_types, reference_role};
use crate::textured;
use crate::variables::{LocalPool, SourceVariableId};
use crate::{Lowering, Purpose, Tracing};

/// Lowers a class of a checked module without errors; a traced one with reports and the places of values.
///
/// # Errors
/// If a limit on the size of types or functions is exceeded; one diagnostic for each function that
/// exceeds one.
pub fn lower_class(
    module: &Module,
    class: ClassId,
    tracing: Option<&Tracing>,
) -> Result<class::Class, Vec<Diagnostic>> {
    let class_name = &module.classes[class.0 as usize].name;
    let _span = tracing::debug_span!("lower", class = %class_name).entered();
    deep_stack::run(|| {
        let layouts = Layouts::new(module);
        let class = &module.classes[class.0 as usize];
        let maker = Maker {
            module,
            class,
            layouts: &layouts,
            facts: &FactTable::new(module, functions_of(module, class), &expressions_of(class)),
            tables: &RefCell::default(),
            tested: &RefCell::default(),
            tracing,
        };
        maker.make()
    })
}

/// The methods of which callers may take derivatives: of textures any shader, of primitives those that have hits of
/// others.
const DIFFERENTIABLE: [Method; 3] =
    [Method::Lookup, Method::Intersect, Method::ComputeTextureCoordinates];

/// The constructor, the methods, and the prelude's functions that they may call implicitly.
fn functions_of(module: &Module, class: &Class) -> impl Iterator<Item = FunctionId> {
    let constructor = class.constructor.iter().map(|constructor| constructor.function);
    let methods = class.methods.iter().map(|(_, function)| *function);
    constructor.chain(methods).chain(implicit_functions(module))
}

/// The initial values of members and the defaults of parameters.
fn expressions_of(class: &Class) -> Vec<&Expression> {
    let members = class.members.iter().filter_map(|member| member.initializer.as_ref());
    let parameters = class.constructor.iter().flat_map(|constructor| &constructor.parameters);
    members.chain(parameters.filter_map(|parameter| parameter.default.as_ref())).collect()
}

/// The data shared by the lowering of all functions of a class.
pub(crate) struct Maker<'m> {
    pub module: &'m Module,
    pub class: &'m Class,
    pub layouts: &'m Layouts<'m>,
    pub facts: &'m FactTable,
    pub tables: &'m RefCell<ConstantTables>,
    pub tested: &'m RefCell<BTreeSet<String>>,
    pub tracing: Option<&'m Tracing>,
}

impl<'m> Maker<'m> {
    fn make(&self) -> Result<class::Class, Vec<Diagnostic>> {
        let mut failures: Vec<Diagnostic> = Vec::new();
        let mut keep = |function: Lowered<Function>| match function {
            Ok(function) => function,
            Err(diagnostic) => {
                // A method that has derivatives too is lowered twice.
                if !failures.contains(&diagnostic) {
                    failures.push(*diagnostic);
                }
                Function::new("")
            }
        };
        let constructor = self.class.constructor.as_ref();
        let constructor =
            constructor.map(|constructor| keep(self.make_constructor(constructor.function)));
        let methods: BTreeMap<Method, Function> = self
            .class
            .methods
            .iter()
            .map(|(method, function)| (*method, keep(self.make_method(*method, *function, 0))))
            .collect();
        let differentiable = self.class.methods.iter();
        let differentiable = differentiable
            .filter(|(method, _)| DIFFERENTIABLE.contains(method))
            .map(|(method, function)| (*method, keep(self.make_method(*method, *function, 1))))
            .filter(|(_, function)| has_chain_rule(function))
            .collect();
        // Last, since it sets the tables that the other functions use.
        let initializer = keep(self.make_initializer());
        let mut variables = |kind| match self.variables(kind) {
            Ok(variables) => variables,
            Err(diagnostic) => {
                failures.push(*diagnostic);
                Vec::new()
            }
        };
        let class = class::Class {
            name: self.class.name.clone(),
            roles: self.class.roles.clone(),
            documentation: self.class.documentation.clone(),
            parameters: parameters_of(self.module, self.layouts, self.class),
            members: variables(VariableKind::Member),
            buffers: variables(VariableKind::Buffer),
            scratch: variables(VariableKind::Scratch),
            scratch_types: ray_member_types(self.layouts, self.class, Storage::is_of_ray),
            outputs: ray_member_types(self.layouts, self.class, |it| it == Storage::Output),
            attributes: self.attributes(),
            references: self.references(),
            initializer,
            constructor,
            methods,
            differentiable,
            method_documentation: self.method_documentation(),
            is_traced: self.tracing.is_some(),
        };
        if failures.is_empty() { Ok(class) } else { Err(failures) }
    }

    /// The documentation comments of the methods that the class declares.
    fn method_documentation(&self) -> BTreeMap<Method, String> {
        let documented = self.class.methods.iter().filter_map(|(method, function)| {
            let function = &self.module.functions[function.0 as usize];
            // Implied methods have the comments of the prelude.
            function.class?;
            Some((*method, function.documentation.clone()?))
        });
        documented.collect()
    }

    /// The leaves of all members that are stored as `kind`.
    fn variables(&self, kind: VariableKind) -> Lowered<Vec<Variable>> {
        let mut variables = Vec::new();
        for member in self.class.members.iter().filter(|member| variable_kind(member) == Some(kind))
        {
            let layout = self.layouts.layout(&member.ty, member.span)?;
            variables.extend(layout.variables(kind, &member.name));
        }
        if kind == VariableKind::Member {
            for table in self.tables.borrow().iter() {
                let layout = self.layouts.layout(&table.ty, self.class.span)?;
                variables.extend(layout.variables(kind, &table.name));
            }
        }
        let scalars = variables.iter().map(|variable| u64::from(variable.len)).sum();
        let allowed = match kind {
            VariableKind::Buffer => u64::MAX,
            VariableKind::Scratch => limits::SCALARS_OF_SCRATCH,
            _ => limits::SCALARS_OF_AN_INSTANCE,
        };
        if scalars > allowed {
            return Err(limits::too_many_members(self.class.span, kind.name(), scalars, allowed));
        }
        Ok(variables)
    }

    fn attributes(&self) -> Vec<Attribute> {
        let attributes = self.class.members.iter();
        let attributes = attributes.filter(|member| member.storage == Storage::Attribute);
        let attribute = |member: &Member| Attribute {
            name: member.name.clone(),
            ty: parameter_type(self.layouts, &member.ty),
            default: default_of(member).iter().map(|it| f32::from_bits(it.bits())).collect(),
        };
        attributes.map(attribute).collect()
    }

    fn references(&self) -> Vec<Reference> {
        let references = self.class.members.iter().filter_map(|member| {
            if member.textured && member.computed.is_none() {
                return Some(textured::reference(member));
            }
            let role = reference_role(&member.ty)?;
            let count = match &member.ty {
                Type::Array(_, count) => ReferenceCount::Array(*count),
                Type::Buffer(_) => ReferenceCount::Open,
                _ => ReferenceCount::Single,
            };
            let tested = member.tested || self.tested.borrow().contains(&member.name);
            Some(Reference { name: member.name.clone(), role, count, tested })
        });
        references.collect()
    }

    fn make_initializer(&self) -> Lowered<Function> {
        let mut lowering = self.lowering(Purpose::Initializer, "initializer", None);
        for member in &self.class.members {
            if variable_kind(member) == Some(VariableKind::Member) {
                let value = member.initializer.as_ref();
                lowering.lower_initial(member, VariableKind::Member, value)?;
            }
        }
        if let Some(constructor) = &self.class.constructor {
            let locals = &self.module.functions[constructor.function.0 as usize].locals;
            for (parameter, local) in constructor.parameters.iter().zip(locals) {
                let member = Member {
                    name: local.name.clone(),
                    ty: local.ty.clone(),
                    storage: Storage::Public,
                    initializer: None,
                    annotations: Vec::new(),
                    textured: false,
                    tested: false,
                    computed: None,
                    span: self.class.span,
                };
                let value = parameter.default.as_ref();
                lowering.lower_initial(&member, VariableKind::Parameter, value)?;
            }
        }
        lowering.lower_tables()?;
        Ok(lowering.builder.finish())
    }

    fn make_constructor(&self, id: FunctionId) -> Lowered<Function> {
        let mut lowering = self.lowering(Purpose::Constructor, "constructor", Some(id));
        lowering.begin_members()?;
        lowering.begin_state(self.class.span)?;
        lowering.frame = lowering.new_frame(id, self.class.span)?;
        lowering.begin_parameters(id, VariableKind::Parameter)?;
        lowering.lower_list(&lowering.function(id).body)?;
        lowering.output_members()?;
        Ok(lowering.builder.finish())
    }

    /// Lowers a method of which derivatives of an order may be taken.
    fn make_method(&self, method: Method, id: FunctionId, order: u32) -> Lowered<Function> {
        let mut lowering = self.lowering(Purpose::Method(method), method.name(), Some(id));
        lowering.order = order;
        lowering.begin_members()?;
        lowering.begin_state(self.class.span)?;
        if self.facts.of(id).asks_for_changes {
            lowering.begin_filter(self.class.span)?;
        }
        lowering.frame = lowering.new_frame(id, self.class.span)?;
        let function = lowering.function(id);
        lowering.lower_list(&function.body)?;
        lowering.report_step(function.end);
        lowering.output_state()?;
        lowering.output_members()?;
        if method == Method::Intersect {
            lowering.output_accepted();
        }
        Ok(lowering.builder.finish())
    }

    /// Returns the state in which the lowering of a function begins.
    pub fn lowering(
        &self,
        purpose: Purpose,
        name: &str,
        function: Option<FunctionId>,
    ) -> Lowering<'m> {
        let mut builder = Builder::new(format!("{}.{name}", self.class.name));
        let mut cells = Cells::default();
        let mut flag = || {
            let no = builder.bool(false);
            Cell(cells.allocate([no]).start)
        };
        let (accepted, returned) = (flag(), flag());
        let facts = function.map(|function| self.facts.of(function));
        let members = |roots: &BTreeSet<Root>| -> BTreeSet<Root> {
            roots.iter().filter(|root| !matches!(root, Root::Local(_))).copied().collect()
        };
        Lowering {
            module: self.module,
            class: self.class,
            layouts: self.layouts,
            facts: self.facts,
            tables: self.tables,
            tested: self.tested,
            purpose,
            writes: facts.map(|facts| facts.writes.clone()).unwrap_or_default(),
            indexed: facts.map(|facts| members(&facts.indexed)).unwrap_or_default(),
            builder,
            cells,
            variables: Vec::new(),
            members: BTreeMap::new(),
            states: BTreeMap::new(),
            locals: LocalPool::default(),
            accepted,
            frame: Frame {
                id: None,
                function: None,
                locals: Vec::new(),
                references: Vec::new(),
                result: None,
                returned,
                jumps: None,
                calls: 0,
                extents: Vec::new(),
                scope_end: 0,
            },
            looked_up: Vec::new(),
            visits: 0,
            depth: 0,
            order: 0,
            filter: None,
            tracing: self.tracing,
            outer_places: Vec::new(),
        }
    }
}

impl<'m> Lowering<'m> {
    /// Outputs the initial value of a member or constructor parameter, or zero if it has none.
    fn lower_initial(
        &mut self,
        member: &Member,
        kind: VariableKind,
        value: Option<&'m Expression>,
    ) -> Lowered<()> {
        let variable = self.new_host_variable(&member.name, &member.ty, kind, member.span)?;
        let values = match value {
            Some(value) => self.lower_expression(value)?,
            None => {
                let layout = self.variable(variable).layout.clone();
                self.zeros(&layout)
            }
        };
        self.output_variable(variable, kind, &values);
        Ok(())
    }

    fn lower_tables(&mut self) -> Lowered<()> {
        let tables = self.tables;
        for table in tables.borrow().iter() {
            let span = self.class.span;
            let variable =
                self.new_host_variable(&table.name, &table.ty, VariableKind::Member, span)?;
            let values = table.values.iter().map(|value| self.builder.constant(*value)).collect();
            let values = self.layouts.by_leaves(&table.ty, values, span)?;
            self.output_variable(variable, VariableKind::Member, &values);
        }
        Ok(())
    }

    /// Creates the variables of a function's parameters, which the host stores; those that are arrays without a size
    /// are buffers.
    pub fn begin_parameters(&mut self, id: FunctionId, kind: VariableKind) -> Lowered<()> {
        let function = self.function(id);
        for (index, passing) in function.parameters.iter().enumerate() {
            if *passing == Passing::Out {
                continue;
            }
            let local = &function.locals[index];
            let kind = if is_buffer(&local.ty) { VariableKind::Buffer } else { kind };
            let host = self.new_host_variable(&local.name, &local.ty, kind, function.span)?;
            let local_id = LocalId(index as u32);
            if self.facts.of(id).written_locals.contains(&local_id) {
                let values = self.read(&Access::whole(host, local.ty.clone(), function.span))?;
                let copy: SourceVariableId = self.local_variable(local_id, function.span)?;
                self.set_variable(copy, &values);
            } else {
                self.frame.locals[index] = Some(host);
            }
        }
        Ok(())
    }

    fn output_accepted(&mut self) {
        let variable = Variable {
            kind: VariableKind::Accepted,
            name: "accepted".to_owned(),
            scalar: rtsl_ir::Scalar::Bool,
            len: 1,
        };
        let variable = self.builder.variable(variable);
        let accepted = self.cells.get(self.accepted);
        self.builder.output(variable, 0, accepted);
    }
}

/// True for an array without a size.
pub(crate) fn is_buffer(ty: &Type) -> bool {
    matches!(ty, Type::Buffer(_))
}

/// True if a function states derivatives.
fn has_chain_rule(function: &Function) -> bool {
    let mut has = false;
    function.body.for_each_op(&mut |op| has |= matches!(op.kind, OpKind::ChainRule(..)));
    has
}

/// The scalars of the default value of an attribute; none for zeros.
pub(crate) fn default_of(attribute: &Member) -> &[Constant] {
    match attribute.initializer.as_ref().map(|value| &value.kind) {
        Some(ExpressionKind::Constant(values)) => values,
        _ => &[],
    }
}

/// The kind of IR variable that stores a member; `None` for references and attributes.
fn variable_kind(member: &Member) -> Option<VariableKind> {
    match (&member.ty, member.storage) {
        (ty, _) if reference_role(ty).is_some() => None,
        (Type::Buffer(_), _) => Some(VariableKind::Buffer),
        (_, Storage::Public | Storage::Private) => Some(VariableKind::Member),
        (_, Storage::Scratch | Storage::Output) => Some(VariableKind::Scratch),
        (_, Storage::Attribute) => None,
    }
}
