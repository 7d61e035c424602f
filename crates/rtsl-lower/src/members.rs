//! Members, and tables of constants.

use std::sync::Arc;

use rtsl_ir::{Constant, UnaryOp, Value, VariableKind, evaluate};
use rtsl_sema::hir::{Expression, ExpressionKind, Member, MemberId, Storage, Type, UnaryOperator};
use rtsl_source::Span;
use rtsl_spec::Method;

use crate::access::Access;
use crate::class::default_of;
use crate::facts::Root;
use crate::limits::Lowered;
use crate::variables::{RANK_OF_DATA, SourceVariableId, Storage as SourceStorage};
use crate::{Lowering, Purpose};

/// Tables of constants that the class indexes dynamically. They become members that only the
/// initializer sets, so that one copy serves all rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct ConstantTables {
    tables: Vec<ConstantTable>,
}

/// One table.
#[derive(Clone, Debug)]
pub(crate) struct ConstantTable {
    /// The generated name, which contains two underscores as no name in a text does.
    pub name: String,
    pub ty: Type,
    /// The values, element by element and field by field.
    pub values: Arc<[Constant]>,
}

impl ConstantTables {
    /// Returns the name of the table with these values, and adds it if it is new.
    fn intern(&mut self, ty: &Type, values: &Arc<[Constant]>) -> String {
        // A named constant is shared by all its uses and may be large, so pointers are compared
        // first.
        let known = |table: &&ConstantTable| Arc::ptr_eq(&table.values, values) && table.ty == *ty;
        let same = |table: &&ConstantTable| table.values == *values && table.ty == *ty;
        let tables = &self.tables;
        if let Some(table) = tables.iter().find(known).or_else(|| tables.iter().find(same)) {
            return table.name.clone();
        }
        let name = format!("table__{}", self.tables.len());
        self.tables.push(ConstantTable {
            name: name.clone(),
            ty: ty.clone(),
            values: values.clone(),
        });
        name
    }

    /// All tables, in the order in which they were first used.
    pub fn iter(&self) -> impl Iterator<Item = &ConstantTable> {
        self.tables.iter()
    }
}

impl<'m> Lowering<'m> {
    /// Creates the variables for all members that the function may write.
    pub fn begin_members(&mut self) -> Lowered<()> {
        let written: Vec<MemberId> = self
            .writes
            .iter()
            .filter_map(|root| match root {
                Root::Member(id) => Some(*id),
                Root::Local(_) | Root::State(_) | Root::Accepted => None,
            })
            .collect();
        for id in written {
            self.member_variable(id)?;
        }
        Ok(())
    }

    /// Outputs the members that the function may have written and that outlive it.
    pub fn output_members(&mut self) -> Lowered<()> {
        let members: Vec<(MemberId, SourceVariableId)> =
            self.members.iter().map(|(id, variable)| (*id, *variable)).collect();
        for (id, variable) in members {
            if !self.writes.contains(&Root::Member(id)) {
                continue;
            }
            let kind = match (self.member(id).storage, self.purpose) {
                (Storage::Scratch, Purpose::Method(method)) if !method.leaves_scratch() => continue,
                (Storage::Scratch | Storage::Output, Purpose::Method(_)) => VariableKind::Scratch,
                (Storage::Public | Storage::Private, Purpose::Constructor)
                | (Storage::Attribute, Purpose::Method(_)) => VariableKind::Member,
                _ => continue,
            };
            let values = self.get_variable(variable)?;
            self.output_variable(variable, kind, &values);
        }
        Ok(())
    }

    /// The variable that a name denotes: a local, a member, state, or a table.
    pub fn root_variable(&mut self, root: &Expression) -> Lowered<SourceVariableId> {
        match &root.kind {
            ExpressionKind::Local(id) => self.local_variable(*id, root.span),
            ExpressionKind::Member(id) => self.member_variable(*id),
            ExpressionKind::State(id) => self.state_variable(*id, root.span),
            _ => {
                let values = constants_of(root).expect("only names and tables are roots");
                self.table_variable(&root.ty, &values, root.span)
            }
        }
    }

    fn table_variable(
        &mut self,
        ty: &Type,
        values: &Arc<[Constant]>,
        span: Span,
    ) -> Lowered<SourceVariableId> {
        let name = self.tables.borrow_mut().intern(ty, values);
        self.new_host_variable(&name, ty, VariableKind::Member, span)
    }

    /// The variable in host memory that an array denotes: a member, or a table of constants.
    pub fn host_variable_of(&mut self, array: &Expression) -> Lowered<Option<SourceVariableId>> {
        let variable = match &array.kind {
            ExpressionKind::Member(_) | ExpressionKind::Local(_) => self.root_variable(array)?,
            _ if self.purpose == Purpose::Initializer => return Ok(None),
            _ => match constants_of(array) {
                Some(values) => self.table_variable(&array.ty, &values, array.span)?,
                None => return Ok(None),
            },
        };
        let in_memory = matches!(self.variable(variable).storage, SourceStorage::Memory(_));
        Ok(in_memory.then_some(variable))
    }

    fn member(&self, id: MemberId) -> &'m Member {
        &self.class.members[id.0 as usize]
    }

    pub fn member_variable(&mut self, id: MemberId) -> Lowered<SourceVariableId> {
        if let Some(made) = self.members.get(&id) {
            return Ok(*made);
        }
        let variable = self.new_member_variable(id)?;
        self.members.insert(id, variable);
        Ok(variable)
    }

    fn new_member_variable(&mut self, id: MemberId) -> Lowered<SourceVariableId> {
        let Member { name, ty, storage, span, .. } = self.member(id);
        let kind = match (storage, self.purpose) {
            _ if matches!(ty, Type::Buffer(_)) => VariableKind::Buffer,
            (Storage::Attribute, Purpose::Method(Method::ComputeTextureCoordinates)) => {
                return self.new_given_attribute(id);
            }
            (Storage::Public | Storage::Private | Storage::Attribute, _) => VariableKind::Member,
            (Storage::Scratch | Storage::Output, purpose) => {
                if !keeps_scratch(purpose) {
                    return self.new_zero_member(id, name, ty, *span);
                }
                VariableKind::Scratch
            }
        };
        let host = self.new_host_variable(name, ty, kind, *span)?;
        if !self.writes.contains(&Root::Member(id)) {
            return Ok(host);
        }
        let values = self.read(&Access::whole(host, ty.clone(), *span))?;
        let copy = self.new_variable(name, ty, self.is_indexed(id), RANK_OF_DATA, *span)?;
        self.set_variable(copy, &values);
        Ok(copy)
    }

    fn new_zero_member(
        &mut self,
        id: MemberId,
        name: &str,
        ty: &Type,
        span: Span,
    ) -> Lowered<SourceVariableId> {
        let variable = self.new_variable(name, ty, self.is_indexed(id), RANK_OF_DATA, span)?;
        let layout = self.variable(variable).layout.clone();
        let zeros = self.zeros(&layout);
        self.set_variable(variable, &zeros);
        Ok(variable)
    }

    /// The variable of an attribute that the method gives: it starts with the default.
    fn new_given_attribute(&mut self, id: MemberId) -> Lowered<SourceVariableId> {
        let attribute = self.member(id);
        let variable = self.new_zero_member(id, &attribute.name, &attribute.ty, attribute.span)?;
        let default = default_of(attribute);
        if !default.is_empty() {
            let default: Vec<Value> = default.iter().map(|it| self.builder.constant(*it)).collect();
            self.set_variable(variable, &default);
        }
        Ok(variable)
    }

    fn is_indexed(&self, id: MemberId) -> bool {
        self.indexed.contains(&Root::Member(id))
    }
}

/// The scalars of a constant expression, element by element and field by field.
fn constants_of(expression: &Expression) -> Option<Arc<[Constant]>> {
    if let ExpressionKind::Constant(values) = &expression.kind {
        return Some(values.clone());
    }
    let mut values = Vec::new();
    collect_constants(expression, &mut values)?;
    Some(values.into())
}

/// Appends the scalars; `None` if they are not all literal constants.
fn collect_constants(expression: &Expression, values: &mut Vec<Constant>) -> Option<()> {
    match (&expression.kind, &expression.ty) {
        (ExpressionKind::Constant(constants), _) => values.extend_from_slice(constants),
        (ExpressionKind::Construct(parts), Type::Array(..) | Type::Struct(_)) => {
            for part in parts {
                collect_constants(part, values)?;
            }
        }
        (ExpressionKind::Construct(parts), Type::Vector(scalar, size)) => {
            let first = values.len();
            for part in parts {
                collect_constants(part, values)?;
            }
            let plain = values[first..].iter().all(|value| value.scalar() == *scalar);
            if !plain || values.len() - first != usize::from(*size) {
                return None;
            }
        }
        (ExpressionKind::Convert(value), Type::Scalar(to)) => {
            let mut from = Vec::new();
            collect_constants(value, &mut from)?;
            let [from] = *from else { return None };
            values.push(if from.scalar() == *to {
                from
            } else {
                Constant::from_bits(*to, evaluate::convert(from.scalar(), *to)(from.bits()))
            });
        }
        (ExpressionKind::Unary(UnaryOperator::Negate, value), _) => {
            let first = values.len();
            collect_constants(value, values)?;
            for value in &mut values[first..] {
                let negate = evaluate::unary(UnaryOp::Negate, value.scalar())?;
                *value = Constant::from_bits(value.scalar(), negate(value.bits()));
            }
        }
        _ => return None,
    }
    Some(())
}

/// True if scratch members hold the values of an earlier method. `intersect` starts with zeros for
/// every object, so that the order in which objects are tested has no effect. `radiance` is the only method of its
/// role.
fn keeps_scratch(purpose: Purpose) -> bool {
    match purpose {
        Purpose::Method(method) => !matches!(method, Method::Intersect | Method::Radiance),
        Purpose::Constructor | Purpose::Initializer | Purpose::Function => false,
    }
}
