//! Members, and tables of constants.

use std::sync::Arc;

use rtsl_ir::{Constant, PlaceKind};
use rtsl_source::Span;

use super::access::Access;
use super::facts::Root;
use super::limits::Lowered;
use super::variables::VariableId;
use super::{Lowering, Purpose};
use crate::hir::{Expression, ExpressionKind, Member, MemberId, Storage, Type};

/// Tables of constants that the class indexes dynamically. They become members that only the
/// initializer sets, so that one copy serves all rays.
#[derive(Clone, Debug, Default)]
pub(super) struct ConstantTables {
    tables: Vec<ConstantTable>,
}

/// One table.
#[derive(Clone, Debug)]
pub(super) struct ConstantTable {
    /// No name of a text has two underscores.
    pub name: String,
    pub ty: Type,
    /// Element by element and field by field.
    pub values: Arc<[Constant]>,
}

impl ConstantTables {
    /// The name of the table with these values.
    fn intern(&mut self, ty: &Type, values: &Arc<[Constant]>) -> String {
        let same = |table: &&ConstantTable| table.ty == *ty && table.values == *values;
        if let Some(table) = self.tables.iter().find(same) {
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

    /// All of them, in the order in which they were first used.
    pub fn iter(&self) -> impl Iterator<Item = &ConstantTable> {
        self.tables.iter()
    }
}

impl<'m> Lowering<'m> {
    /// Makes the variables for all members that the function may write.
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

    /// Makes the function's outputs of the members that it may have written and that outlive it.
    pub fn output_members(&mut self) -> Lowered<()> {
        let members: Vec<(MemberId, VariableId)> =
            self.members.iter().map(|(id, variable)| (*id, *variable)).collect();
        for (id, variable) in members {
            if !self.writes.contains(&Root::Member(id)) {
                continue;
            }
            let kind = match (self.member(id).storage, self.purpose) {
                (Storage::Scratch, Purpose::Method(_)) => PlaceKind::Scratch,
                (Storage::Public | Storage::Private, Purpose::Constructor) => PlaceKind::Member,
                _ => continue,
            };
            let values = self.get_variable(variable)?;
            self.output_variable(variable, kind, &values);
        }
        Ok(())
    }

    /// The variable that a name stands for: a local, a member, state, or a table.
    pub fn root_variable(&mut self, root: &Expression) -> Lowered<VariableId> {
        match &root.kind {
            ExpressionKind::Local(id) => self.local_variable(*id, root.span),
            ExpressionKind::Member(id) => self.member_variable(*id),
            ExpressionKind::State(id) => self.state_variable(*id, root.span),
            ExpressionKind::Constant(values) => {
                let name = self.tables.borrow_mut().intern(&root.ty, values);
                self.new_place_variable(&name, &root.ty, PlaceKind::Member, root.span)
            }
            _ => unreachable!("only names and tables are roots"),
        }
    }

    fn member(&self, id: MemberId) -> &'m Member {
        &self.class.members[id.0 as usize]
    }

    fn member_variable(&mut self, id: MemberId) -> Lowered<VariableId> {
        if let Some(made) = self.members.get(&id) {
            return Ok(*made);
        }
        let variable = self.new_member_variable(id)?;
        self.members.insert(id, variable);
        Ok(variable)
    }

    fn new_member_variable(&mut self, id: MemberId) -> Lowered<VariableId> {
        let Member { name, ty, storage, span, .. } = self.member(id);
        let kind = match (storage, self.purpose) {
            _ if matches!(ty, Type::Buffer(_)) => PlaceKind::Buffer,
            (Storage::Public | Storage::Private, _) => PlaceKind::Member,
            (Storage::Scratch, purpose) => {
                if !keeps_scratch(purpose) {
                    return self.new_zero_member(id, name, ty, *span);
                }
                PlaceKind::Scratch
            }
        };
        let host = self.new_place_variable(name, ty, kind, *span)?;
        if !self.writes.contains(&Root::Member(id)) {
            return Ok(host);
        }
        let values = self.read(&Access::whole(host, ty.clone(), *span))?;
        let copy = self.new_variable(name, ty, self.is_indexed(id), *span)?;
        self.set_variable(copy, &values);
        Ok(copy)
    }

    fn new_zero_member(
        &mut self,
        id: MemberId,
        name: &str,
        ty: &Type,
        span: Span,
    ) -> Lowered<VariableId> {
        let variable = self.new_variable(name, ty, self.is_indexed(id), span)?;
        let layout = self.variable(variable).layout.clone();
        let zeros = self.zeros(&layout);
        self.set_variable(variable, &zeros);
        Ok(variable)
    }

    fn is_indexed(&self, id: MemberId) -> bool {
        self.indexed.contains(&Root::Member(id))
    }
}

/// Whether scratch holds what an earlier method has left. `intersect` starts afresh for every object, so that the
/// order in which objects are tested never shows.
fn keeps_scratch(purpose: Purpose) -> bool {
    match purpose {
        Purpose::Method(method) => method != rtsl_spec::Method::Intersect,
        Purpose::Constructor | Purpose::Initializer => false,
    }
}
